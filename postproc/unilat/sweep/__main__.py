"""python3 -m unilat.sweep is unilat-sweep, for machines where the package is not installed."""

import sys

from .command import main

sys.exit(main())

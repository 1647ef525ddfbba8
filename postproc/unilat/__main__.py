"""python3 -m unilat is unilat-plot, for machines where the package is not installed."""

import sys

from .command import main

sys.exit(main())

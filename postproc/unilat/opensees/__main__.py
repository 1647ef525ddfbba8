"""python3 -m unilat.opensees"""

import sys

from .command import main

sys.exit(main())

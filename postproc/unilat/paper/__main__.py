"""python3 -m unilat.paper: what input/run paper calls."""

import sys

from ..command import guarded

sys.exit(guarded("paper", "paper.work", sys.argv[1:]))

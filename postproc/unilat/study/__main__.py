"""python3 -m unilat.study map FILE.toml, python3 -m unilat.study time FILE.toml: see work."""

import sys

from ..command import guarded

sys.exit(guarded("unilat.study", "study.work", sys.argv[1:]))

"""The command unilat-sweep."""

from __future__ import annotations

import sys

from ..command import guarded


def main(argv: list[str] | None = None) -> int:
    """The exit code: 0 all runs complete, 1 some failed or are missing, 2 wrong input, 5 a picture failed."""
    return guarded("unilat-sweep", "sweep.work", sys.argv[1:] if argv is None else argv)

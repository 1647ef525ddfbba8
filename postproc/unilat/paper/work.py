"""Runs the decks of the paper's examples, prints its tables, draws its figures."""

from __future__ import annotations

import argparse
import os

from ..results import ResultsError
from .runs import RUNS, Runs
from .tables import Sources, table_1, table_2, table_column

DESCRIPTION = """\
Silveira & Goncalves, Structural Engineering and Mechanics 12 (2001) 35-50: Tables 1 and 2 and Figs. 5, 6, 9, 10 and 11, computed
from the example decks and put beside the numbers that the paper prints and the exact ones."""


def main(argv=None) -> int:
    parser = argparse.ArgumentParser("paper", description=DESCRIPTION)
    parser.add_argument("--root", required=True, help="the repository")
    parser.add_argument("--program", required=True, help="unilat")
    parser.add_argument("--folder", required=True, help="where results, tables and pictures go")
    parser.add_argument("-j", type=int, default=len(os.sched_getaffinity(0)), dest="jobs",
                        help="runs at a time (default: all cores)")
    parser.add_argument("--no-figures", action="store_true", help="tables alone")
    args = parser.parse_args(argv)
    runs = Runs(args.root, args.program, args.folder)
    print(f"{len(RUNS)} runs", flush=True)
    runs.make(args.jobs)
    sources = Sources(args.root)
    text = "\n".join(table(runs, sources) for table in (table_1, table_2, table_column))
    print(f"\n{text}")
    try:
        with open(os.path.join(args.folder, "paper.txt"), "w", encoding="utf-8") as file:
            file.write(text)
    except OSError as problem:
        raise ResultsError(f"{args.folder}: {problem.strerror}") from problem
    if not args.no_figures:
        from . import figures
        for name in figures.draw(runs, sources, args.folder):
            print(f"picture: {name}")
    return 0

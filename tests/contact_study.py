"""Rods in rigid contact over mesh, order and slenderness: tables of errors, points and seconds, to be compared.

    UNILAT=.build/release/unilat PYTHONPATH=postproc python3 tests/contact_study.py ring column tube curves
    ... tests/contact_study.py length            # pipe lift with 100 to 100,000 elements: seconds and megabytes

Exact values: contact_cases.py. A dash: the run stopped before (exit code 2), or found something else.
"""

from __future__ import annotations

import os
import pathlib
import resource
import subprocess
import sys
import tempfile
import time

import contact_cases as cases
import deck_runner as dr
import numpy as np
import test_decks_span_accuracy as decks

KINDS = tuple(decks.ORDERS)


def attempt(function, *arguments):
    """Its value, or NaN where the run stopped or gave something else."""
    try:
        return float(function(*arguments))
    except (AssertionError, ValueError, IndexError, KeyError, subprocess.TimeoutExpired):
        return float("nan")


def cell(error):
    return f"{'-':>9}" if not np.isfinite(error) else f"{error:9.1e}"


def table(title, meshes, error):
    """Rows of meshes, a column for each order."""
    print(f"{title}\n{'elements':>10}" + "".join(f"{kind:>9}" for kind in KINDS))
    for elements in meshes:
        print(f"{elements:10}" + "".join(cell(attempt(error, elements, kind)) for kind in KINDS), flush=True)
    print()


def ring():
    for slenderness in decks.DEPTH:
        table(f"ring, R/h = {slenderness}: critical load, relative error", (8, 12, 16, 24, 32, 64, 160),
              lambda n, kind: decks.ring(slenderness, n, kind).load("LP") / cases.RING[slenderness] - 1.0)
    print("ring: points to the limit point, GE8")
    for slenderness in decks.DEPTH:
        print(f"  R/h = {slenderness:6}: " + ", ".join(
            f"{n} elements {attempt(lambda: decks.ring(slenderness, n).only('LP').point):g}" for n in (8, 16, 32, 160, 320)))
    print()


def column():
    for number, name in enumerate(("contact", "limit load", "loss", "least load")):
        table(f"column: {name}, relative error", (6, 12, 24, 48),
              lambda n, kind: decks.column_loads(decks.column(n, kind))[number] / decks.COLUMN_LOADS[number] - 1.0)


def tube():
    for down in (0.5, 0.7, 0.9):
        exact = cases.tube_force(down, 1e-7)
        table(f"tube: F at a flattening of {down}, relative error", (4, 8, 16, 32),
              lambda n, kind: decks.located(decks.tube("LOAD", False, n, kind), "LOAD", down).monitors["F"] / exact - 1.0)
    print("tube, 16 GE8, to 0.95: largest error at 0.5, 0.7, 0.9")
    for whole in (False, True):
        for method in decks.METHODS:
            def worst():
                run = decks.tube(method, whole)
                return max(abs(decks.located(run, "LOAD", x).monitors["F"] / cases.tube_force(x, 1e-7) - 1.0)
                           for x in (0.5, 0.7, 0.9))
            print(f"  {'whole' if whole else 'quarter':8}{method:28}{cell(attempt(worst))}", flush=True)
    print()


def curves():
    for name, error in decks.ERRORS.items():
        table(f"{name}: relative error", (4, 8, 16, 32, 64), error)


def _limits():
    """Of a run: 5 minutes, 8 GB."""
    resource.setrlimit(resource.RLIMIT_CPU, (300, 300))
    resource.setrlimit(resource.RLIMIT_AS, (8 << 30, 8 << 30))


def length():
    """Time and memory of the pipe lift."""
    text = dr.changed(dr.on_given_mesh("pipe-lift"), (", POINTS=ALONG", ""), ("*FIELD OUTPUT, EVERY=5\nDISPLACEMENT, REACTION\n", ""))
    print(f"{'elements':>10}{'s':>9}{'MB':>9}{'points':>8}{'us/(point element)':>20}  exit")
    for elements in (100, 1000, 10000, 100000):
        with tempfile.TemporaryDirectory(prefix="unilat-") as folder:
            (pathlib.Path(folder) / "deck.inp").write_text(dr.changed(text, ("1, 2, 60", f"1, 2, {elements}")), encoding="utf-8")
            begin = time.perf_counter()
            with open(pathlib.Path(folder) / "listing", "w", encoding="utf-8") as listing:
                process = subprocess.Popen([os.environ["UNILAT"], "deck.inp"], cwd=folder, stdout=listing, stderr=listing,
                                           preexec_fn=_limits)
                _, status, usage = os.wait4(process.pid, 0)
            seconds = time.perf_counter() - begin
            process.returncode = os.waitstatus_to_exitcode(status)
            try:
                points = dr.read_results(str(next(pathlib.Path(folder).glob("*.h5")))).n_points
            except (StopIteration, OSError, ValueError):
                points = 0
            rate = f"{1e6 * seconds / points / elements:20.3f}" if points else f"{'-':>20}"
            print(f"{elements:10}{seconds:9.2f}{usage.ru_maxrss / 1024:9.0f}{points:8}{rate}  {process.returncode}", flush=True)
    print()


STUDIES = {"ring": ring, "column": column, "tube": tube, "curves": curves, "length": length}

if __name__ == "__main__":
    for study in sys.argv[1:] or list(STUDIES):
        STUDIES[study]()

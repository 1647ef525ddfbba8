"""Study of shallow hinged arches: does every strategy find every limit point, on any mesh and with any largest increment?

    UNILAT=.build/release/unilat PYTHONPATH=postproc python3 tests/arch_study.py      # 600 runs, two minutes
    ... tests/arch_study.py --every 5 --jobs 2 --keep folder        # 1554 runs; decks of bad runs are kept in the folder

Half angle 0.2 to 0.35, R/h 50 and 100, full and half model, GE4 to GE8, 10 to 320 elements, seven strategies, largest increment
0.005 to the default: 8064 combinations, of which every 13th is run (13 is prime to all the numbers of choices, so that every
choice and every pair of choices comes up equally often), without meshes too coarse to have these points (error bound above
5 %). The special points are compared, in their order, with those of arch_reference.py.

wrong:    a located LP or BP that is none of the reference, or comes again or too early
missing:  one of the reference that the run passed by: not among its points although a later one is, or the run is complete
open:     labelled, but not located; not silent when the exit code says so
silent:   runs with one of these, or an arc length that falls, and exit code 0
stopped:  runs with another exit code
"""

from __future__ import annotations

import argparse
import itertools
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from math import cos, factorial, sin

import numpy as np
from unilat.results import ResultsError, read_results

import arch_reference

HALF_ANGLES, SLENDERNESS = arch_reference.HALF_ANGLES, arch_reference.SLENDERNESS
MODELS = "full", "half"
ORDERS = 4, 6, 8
ELEMENTS = 10, 20, 40, 80, 160, 320
METHODS = ("CYLINDRICAL", "SPHERICAL", "LINEARISED", "MINIMUM RESIDUAL", "VARIABLE LOAD", "GENERALISED DISPLACEMENT",
           "LARGEST DISPLACEMENT")
LARGEST = 0.005, 0.01, 0.02, None


@dataclass(frozen=True)
class Case:
    half_angle: float
    slenderness: int
    model: str
    order: int
    elements: int
    method: str
    largest: float | None

    def __str__(self):
        largest = "default" if self.largest is None else f"{self.largest:g}"
        return (f"{self.half_angle:<5g}{self.slenderness:<4} {self.model} GE{self.order} {self.elements:<4}"
                f"{self.method:<25}{largest:<8}")


@dataclass
class Outcome:
    case: Case
    code: int = -1
    status: str = ""
    limits: int = 0                 # LPs of the reference up to where the run came
    wrong: list = field(default_factory=list)
    missing: list = field(default_factory=list)
    unlocated: list = field(default_factory=list)
    falls: bool = False             # the arc length
    points: int = 0
    seconds: float = 0.0
    error: float = 0.0              # largest over what the mesh allows

    @property
    def bad(self) -> bool:
        return bool(self.wrong or self.missing or self.unlocated or self.falls)


def cases(every: int) -> list[Case]:
    product = itertools.product(HALF_ANGLES, SLENDERNESS, MODELS, ORDERS, ELEMENTS, METHODS, LARGEST)
    chosen = [Case(*choice) for choice in itertools.islice(product, 0, None, every)]
    points = arch_reference.table()
    return [case for case in chosen
            if max(mesh_error(case, point) for point in points[case.half_angle, case.slenderness]) < 0.05]


def deck(case: Case) -> str:
    """The load factor is P R^2/EI, v the crown's displacement over R, in both models."""
    x, y = sin(case.half_angle), cos(case.half_angle)
    full = case.model == "full"
    half = case.elements // 2 if full else case.elements
    right = (f"3, {x!r}, {y!r}\n", f"2, 3, 0., 0., {half}\n", "3, PINNED") if full else ("", "", "2, XSYMM")
    largest = "" if case.largest is None else f", 1E-9, {case.largest}"
    return f"""*HEADING
{' '.join(str(case).split())}
*NODE
1, {-x!r}, {y!r}
2, 0., 1.
{right[0]}*ARC, ELSET=ARCH, DIRECTION=CLOCKWISE, TYPE=GE{case.order}
1, 2, 0., 0., {half}
{right[1]}*BEAM SECTION, ELSET=ARCH, SECTION=STIFFNESS
{12.0 * case.slenderness**2}, 1.
*BOUNDARY
1, PINNED
{right[2]}
*MONITOR, NAME=v
2, U2, -1.
*STEP
*STATIC, METHOD={case.method}
0.1{largest}
*CONTROLS, POINTS=3000
*CLOAD
2, 2, {-1.0 if full else -0.5}
*STOP
v, ABOVE, {2.2 * (1.0 - y)!r}
*END STEP
"""


def mesh_error(case: Case, point) -> float:
    """Bound of the error of a load by the mesh, over the larger of the load and what the thrust carries.

    Gauss collocation with s stages, 2s the order, errs by c (K h)^2s k L: c = s!^4/((2s)!^3 (2s+1)) its error constant, L the
    half length, k = root(H) the wave number of the direction and K = 2 k that of the products of its sines in the equations.
    """
    s = case.order // 2
    constant = factorial(s)**4 / factorial(2 * s)**3 / (2 * s + 1)
    h = case.half_angle * (2 if case.model == "full" else 1) / case.elements
    k = np.sqrt(abs(point.thrust))
    return constant * (2.0 * k * h)**case.order * k * case.half_angle


def allowance(case: Case, point) -> float:
    """How far a load may be off; 1E-7: Newton's tolerance and rounding."""
    return (mesh_error(case, point) + 1e-7) * max(abs(point.load), abs(point.thrust) * case.half_angle)


def compare(case: Case, found: list, complete: bool, outcome: Outcome):
    """Finds the longest common row of the run's special points and the reference's; the rest is wrong or missing."""
    expected = [p for p in arch_reference.table()[case.half_angle, case.slenderness] if case.model == "full" or p.label == "LP"]
    found = [c for c in found if c.label in ("LP", "BP")]
    n, m = len(found), len(expected)

    def same(i, j):
        return found[i].label == expected[j].label and abs(found[i].load_factor - expected[j].load) <= allowance(case, expected[j])

    best = np.zeros((n + 1, m + 1), int)
    for i, j in itertools.product(reversed(range(n)), reversed(range(m))):
        best[i, j] = best[i + 1, j + 1] + 1 if same(i, j) else max(best[i + 1, j], best[i, j + 1])
    i = j = 0
    pairs = []
    while i < n and j < m:
        if same(i, j):
            pairs.append((i, j))
            i, j = i + 1, j + 1
        elif best[i + 1, j] >= best[i, j + 1]:
            i += 1
        else:
            j += 1
    hit_found, hit_expected = {i for i, _ in pairs}, {j for _, j in pairs}
    outcome.unlocated = [found[i] for i in range(n) if not found[i].located]
    outcome.wrong = [found[i] for i in range(n) if i not in hit_found and found[i].located]
    passed = m if complete else max(hit_expected, default=-1) + 1
    outcome.missing = [expected[j] for j in range(passed) if j not in hit_expected]
    outcome.limits = sum(p.label == "LP" for p in expected[:passed])
    outcome.error = max((abs(found[i].load_factor - expected[j].load) / allowance(case, expected[j]) for i, j in pairs),
                        default=0.0)


def run(case: Case, keep: str | None = None) -> Outcome:
    outcome = Outcome(case)
    with tempfile.TemporaryDirectory(prefix="arch-") as folder:
        path = pathlib.Path(folder)
        (path / "arch.inp").write_text(deck(case), encoding="utf-8")
        start = time.perf_counter()
        try:
            done = subprocess.run([os.path.abspath(os.environ["UNILAT"]), "arch.inp"], cwd=folder, capture_output=True, timeout=120,
                                  encoding="utf-8", check=False, env=os.environ | {"OPENBLAS_NUM_THREADS": "1"})
            outcome.code = done.returncode
            results = read_results(path / "arch.h5")
            outcome.status = results.status
            outcome.points = len(results.column("load_factor").values)
            outcome.falls = bool(np.any(np.diff(results.column("arc_length").values) < 0.0))
            compare(case, results.critical, results.status == "complete", outcome)
        except (subprocess.TimeoutExpired, ResultsError) as problem:
            outcome.status = re.sub(r"\s+", " ", str(problem))
        outcome.seconds = time.perf_counter() - start
    if keep and (outcome.bad or outcome.code != 0):
        name = re.sub(r"\W+", "-", " ".join(str(case).split()).replace(".", "p"))
        (pathlib.Path(keep) / f"{name}.inp").write_text(deck(case), encoding="utf-8")
    return outcome


def table(outcomes: list[Outcome]) -> str:
    """One row for all, then one for each choice of each quantity."""
    head = (f"{'':<26}{'runs':>6}{'LPs':>6}{'wrong':>7}{'missing':>9}{'open':>6}{'runs bad':>10}{'silent':>8}{'stopped':>9}"
            f"{'points':>8}")
    rows = [head]

    def row(name, chosen):
        count = Counter(wrong=sum(len(o.wrong) for o in chosen), missing=sum(len(o.missing) for o in chosen),
                        open=sum(len(o.unlocated) for o in chosen))
        rows.append(f"{name:<26}{len(chosen):>6}{sum(o.limits for o in chosen):>6}{count['wrong']:>7}{count['missing']:>9}"
                    f"{count['open']:>6}{sum(o.bad for o in chosen):>10}{sum(o.bad and o.code == 0 for o in chosen):>8}"
                    f"{sum(o.code != 0 for o in chosen):>9}{sum(o.points for o in chosen):>8}")

    row("all", outcomes)
    for quantity, choices in (("half_angle", HALF_ANGLES), ("slenderness", SLENDERNESS), ("model", MODELS), ("order", ORDERS),
                              ("elements", ELEMENTS), ("method", METHODS), ("largest", LARGEST)):
        rows.append("")
        for choice in choices:
            name = "default" if choice is None else str(choice)
            row(name if quantity == "method" else f"{quantity} {name}",
                [o for o in outcomes if getattr(o.case, quantity) == choice])
    return "\n".join(rows)


def describe(outcome: Outcome) -> str:
    parts = [f"exit {outcome.code}"]
    for word, points in (("wrong", outcome.wrong), ("open", outcome.unlocated)):
        parts += [f"{word} {c.label} {c.load_factor:.7g}" for c in points]
    parts += [f"missing {p.label} {p.load:.7g}" for p in outcome.missing]
    parts += ["arc length falls"] * outcome.falls + ([outcome.status] if outcome.status != "complete" else [])
    return f"{outcome.case} {', '.join(parts)}"


def main():
    options = argparse.ArgumentParser(description="Study of shallow hinged arches (see the head of this file).")
    options.add_argument("--every", type=int, default=13, help="run every n-th combination (default 13)")
    options.add_argument("--jobs", type=int, default=1)
    options.add_argument("--keep", help="folder for the decks of bad runs")
    options.add_argument("--only", default="", help="only combinations whose description contains this")
    given = options.parse_args()
    if given.keep:
        os.makedirs(given.keep, exist_ok=True)
    chosen = [case for case in cases(given.every) if given.only in str(case)]
    start = time.perf_counter()
    with ThreadPoolExecutor(given.jobs) as pool:
        outcomes = list(pool.map(lambda case: run(case, given.keep), chosen))
    for outcome in outcomes:
        if outcome.bad or outcome.code != 0:
            print(describe(outcome))
    print(table(outcomes))
    print(f"\nlargest error over the mesh's allowance: {max(o.error for o in outcomes):.2g}; {time.perf_counter() - start:.0f} s, "
          f"slowest run {max(o.seconds for o in outcomes):.1f} s")
    return 1 if any(o.bad or o.code != 0 for o in outcomes) else 0


if __name__ == "__main__":
    sys.exit(main())

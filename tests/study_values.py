"""Exact values for the maps of input/maps: python3 tests/study_values.py ring winkler column arch writes input/maps/exact/*.csv anew.

ring, winkler, column: boundary-value solver of contact_reference.py. arch: arch_reference.py. Both to 1e-10 or so and independent of the
program; an empty cell: there is no such point.
"""

from __future__ import annotations

import csv
import math
import pathlib
import sys

import arch_reference
import contact_cases as cases
import winkler_reference
from contact_cases import Line, Wave, _column, _to_the_wall, assert_admissible, shortening

FOLDER = pathlib.Path(__file__).resolve().parent.parent / "input" / "maps" / "exact"


def write(name, source, columns, rows):
    FOLDER.mkdir(exist_ok=True)
    with open(FOLDER / f"{name}.csv", "w", newline="", encoding="utf-8") as file:
        file.write("".join(f"# {line}\n" for line in source.splitlines()))
        table = csv.writer(file, lineterminator="\n")
        table.writerow(columns)
        for row in rows:
            table.writerow(row)
            file.flush()


def number(value):
    return "" if value is None else f"{value:.13g}"


def ring():
    write("ring", "Half ring in a rigid cavity, dead load p: limit load p R^3/EI with EA R^2/EI = 12 (R/h)^2, and the apex's\n"
          "displacement v/R there. Boundary-value solver of tests/contact_reference.py (tests/study_values.py)",
          ("slenderness", "limit_load", "v"),
          ((r, number(found.load), f"{found.monitor:.8g}") for r in (5, 10, 20, 50, 100, 1e3, 1e4, 1e5, 1e6)
           for found in [cases.ring_limit(float(r))]))


def column_events(gap, slenderness):
    """P/Pcr of first contact and of the limit point of the column of column.inp at another distance and slenderness.

    Followed by the shortening that bending makes: that of P/EA hides it in short columns.
    """
    a2 = 0.0525 * gap * 0.375 * math.sqrt(3.0)
    wave = Wave(cosines=((0.035 * gap, 2.0 * math.pi), (-a2, math.pi), (a2, 3.0 * math.pi)))
    wall, flexibility, unit = Line(0.0, gap, 0.0), 1.0 / (12.0 * slenderness**2), 4.0 * math.pi**2
    problem = _column(wave, True, unit, flexibility, wall, "point")

    def bending(state):
        return (shortening(state) - state["P"] * unit * flexibility) / gap**2

    onset, clear = _to_the_wall(problem, wave, wall, 0.45)
    limit = problem.limit(onset, bending, 15.0, "P", {clear: 0.0}, steps=30)
    assert_admissible(onset, {0: wall, 1: wall}, on_left=True)
    assert_admissible(limit, {0: wall, 1: wall}, on_left=True)
    return onset["P"], limit["P"]


def column():
    def rows():
        for slenderness in (20, 50, 100, 200, 1e3, 1e4, 1e5):
            events = {gap: column_events(gap, slenderness) for gap in (1e-4, 1e-3, 0.003, 0.01, 0.02, 0.03, 0.05, 0.1, 0.15)}
            # Newton's method of the solver lacks digits below; both loads differ from those of no gap by its square.
            one, two = events[1e-4], events[1e-3]
            for gap in (1e-6, 1e-5):
                events[gap] = [a - (b - a) * (1e-8 - gap**2) / (1e-6 - 1e-8) for a, b in zip(one, two)]
            for gap in sorted(events):
                yield slenderness, gap, *(number(load) for load in events[gap])
    write("column", "Column of column.inp at a distance gap = d/L from the wall, EA L^2/EI = 12 (L/h)^2, a1 = 0.07 d, a2 = 0.0525 d:\n"
          "P/Pcr of first contact and of the limit point. Boundary-value solver of tests/contact_reference.py, below gap = 1e-4\n"
          "continued by its square (tests/study_values.py)", ("slenderness", "gap", "contact", "limit_load"), rows())


def arch():
    def rows():
        for decade in range(2, 15):
            ea = 10.0**decade
            points = arch_reference.special_points(0.5, math.sqrt(ea / 12.0), most=2)
            others = arch_reference.special_points(0.5, math.sqrt(ea / 12.0), arch_reference.DEGREE + 12, 0.03, 2)
            assert [p.label for p in points] == [p.label for p in others]
            first = {p.label: p for p in reversed(points)}
            worst = max((abs(p.load / q.load - 1.0) for p, q in zip(points, others)), default=0.0)
            print(f"1e{decade}", [(p.label, p.load) for p in points], f"{worst:.1e}", flush=True)
            yield f"1e{decade}", *(number(first[label].load if label in first else None) for label in ("BP", "LP"))
    write("arch", "Hinged circular arch, half angle 0.5, load P R^2/EI at the crown, R = EI = 1, axial stiffness ea = EA R^2/EI: first\n"
          "bifurcation and first limit point of the symmetric path. Solver of tests/arch_reference.py (tests/study_values.py)",
          ("ea", "bifurcation", "limit_load"), rows())


def winkler():
    """Depth 0.02 and the limit point up to a depth of 0.06. Beyond k = 1e8 boundary layers lift off behind the end of contact,
    which the solver does not follow to the limit point."""
    # input/maps/winkler.inp by 640 GE8, which agree with 320 GE8 to 1e-11 and with 640 GE6 to 2e-9. The solver has the load of 1e9,
    # to 1e-13; rigid are 69.58145569622 and 81.55742756466.
    program = {9: ("69.57541496836", "81.55103593568"), 10: ("69.58076434265", "81.55658483618"),
               12: ("69.58144444399", "81.55740900625"), 14: ("69.58145544511", "81.55742705547"),
               16: ("69.58145568928", "81.55742754925")}

    def rows():
        for decade in range(-2, 9):
            state = winkler_reference.ring(100.0, 10.0**decade, 0.02)
            yield f"1e{decade}", number(state["p"]), number(winkler_reference.limit(state, 0.06)), "solver"
        for decade, (load, limit_load) in program.items():
            yield f"1e{decade}", load, limit_load, "two fine meshes"
    write("winkler", "Half ring, R/h = 100, in a tensionless Winkler medium, k = k R^4/EI, dead load p R^3/EI: at the depth v/R = 0.02 of the\n"
          "apex, and at the limit point where it comes before a depth of 0.06. Up to 1e8 boundary-value solver of\n"
          "tests/winkler_reference.py, then two fine meshes of different order (tests/study_values.py)",
          ("k", "load", "limit_load", "source"), rows())


if __name__ == "__main__":
    for name in sys.argv[1:]:
        {"ring": ring, "column": column, "arch": arch, "winkler": winkler}[name]()

"""A hinged arch under a flat plate that comes down: its middle lies flat on the plate without pressure, and may buckle away from it.

The flat part, of natural length l, keeps position and direction at its ends. It buckles like a clamped strut whose thrust N does
not turn: k^2 = N (1 - N/EA)/EI, with k l = 2 pi (symmetric: it opens all along) or tan(k l/2) = k l/2 (one half would press).
"""
import functools
import math

import numpy as np
import pytest

import deck_runner as dr
from unilat.plot import path_curves

EA = 1e5
DECK = """*HEADING, JOB=deck
*NODE
1, ${-sqrt(0.75)}, -0.5
2, ${sqrt(0.75)}, -0.5
*ARC, ELSET=ARCH, NSET=ARCH, DIRECTION=CLOCKWISE
1, 2, 0, -1
*BEAM SECTION, ELSET=ARCH, SECTION=STIFFNESS
1e5, 1
*BOUNDARY
1, PINNED
2, PINNED
*OBSTACLE, NAME=PLATE, TYPE=LINE
1, 0, -1, 0
*CONTACT, OBSTACLE=PLATE, NSET=ARCH
*MONITOR, NAME=thrust
1, RF1
*STEP
*STATIC
0.01, , 0.02
*OBSTACLE MOTION
PLATE, 0, -0.35
*ACCURACY, TOLERANCE=1e-5
*STOP
LOAD, ABOVE, 1
*END STEP
"""
BRANCH = """*BRANCH, POINTS=150
LOAD, ABOVE, 1
*END STEP
"""


def plate(tolerance, code=0, side=""):
    branch = BRANCH.replace("*BRANCH,", f"*BRANCH, SIDE={side},") if side else "*END STEP\n"
    return dr.run_deck(dr.changed(DECK, ("=1e-5", f"={tolerance}"), ("*END STEP\n", branch)), code=code)


@functools.cache
def followed():
    return plate("1e-5", side="BOTH")


def flat_part(run, critical):
    """k l of the flat part."""
    row = critical.point - 1
    length = run.results.contact.end[row, 0] - run.results.contact.start[row, 0]
    thrust = run.results.monitors["thrust"].values[row]
    return math.sqrt(thrust * (1.0 - thrust / EA)) * length


@pytest.mark.parametrize("tolerance", ["1e-3", "1e-4", "1e-5", "3e-6", "1e-7"])
def test_the_flat_part_buckles(tolerance):
    """The path has other bifurcations close by; 0.730072 is that of the arch beside the plate."""
    run = plate(tolerance)
    found = run.labelled("BP")
    dr.assert_close([c.load_factor for c in found], [0.64492439, 0.73007193, 0.77245511, 0.94110671], relative=float(tolerance))
    assert ["one-sided" in c.note for c in found] == [True, False, False, True]
    halves = 2.0 * np.array([math.pi, 4.493409457909064, 2.0 * math.pi])
    dr.assert_close([flat_part(run, found[k]) for k in (0, 2, 3)], halves, relative=10.0 * float(tolerance))


def test_behind_a_one_sided_bifurcation_the_path_is_unstable():
    """Its tangent has no negative pivot as long as all contacts hold."""
    run = followed()
    load, pivots, free = (run.column(name) for name in ("load_factor", "negative_pivots", "free_pivots"))
    loads = [c.load_factor for c in run.labelled("BP")]
    inside = np.all([abs(load - one) > 1e-9 for one in loads], axis=0)
    assert np.all(pivots[inside] == (load > loads[1])[inside])
    assert np.all(free[inside] == np.sum([load > one for one in loads], axis=0)[inside])
    curve = path_curves.stretches(run.results, breaks=True)
    assert [stable for _, stable in curve] == [True, False]
    assert curve[0][0][-1] == run.labelled("BP")[0].point - 1
    assert "1+2" in run.stdout.split("Branch 1")[0]


def test_both_sides_are_the_one_that_opens():
    run = followed()
    branch, = run.results.branches.values()
    assert branch.side == -1
    assert [c.label for c in branch.critical] == ["LP", "EP"]
    dr.assert_close(branch.critical[0].load_factor, 0.63783130, relative=1e-5)
    pivots, load = branch.path["negative_pivots"].values, branch.path["load_factor"].values
    turn = branch.critical[0].point - 1
    assert np.all(pivots[1:turn] == 1) and np.all(pivots[turn + 1:] == 0) and load[turn] == load.min()


def test_the_other_side_is_refused():
    run = plate("1e-5", code=2, side="PLUS")
    assert "SIDE=MINUS is the side that opens" in run.stdout
    assert not run.results.branches


def test_the_load_of_a_branch_may_change_with_the_distance():
    """Clamped at one end, the arch turns as its flat part lets go: the load falls in proportion to the height of the hump."""
    text = dr.changed(DECK, ("1, PINNED\n2", "1, ENCASTRE\n2"))
    runs = [dr.run_deck(dr.changed(text, ("*END STEP\n", BRANCH.replace("*BRANCH,", f"*BRANCH, INCREMENT={first},"))))
            for first in (0.02, 0.002)]
    branches = [next(iter(run.results.branches.values())) for run in runs]
    dr.assert_close(flat_part(runs[0], runs[0].labelled("BP")[0]), 2.0 * math.pi, relative=1e-4)
    limits = [branch.critical[0] for branch in branches]
    assert [c.label for c in limits] == ["LP", "LP"]
    bars = [branch.errors["load_factor"].values[limit.point - 1] for branch, limit in zip(branches, limits)]
    dr.assert_close(limits[0].load_factor, limits[1].load_factor, absolute=sum(bars))

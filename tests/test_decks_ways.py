"""Antisymmetric columns between two walls that come to both walls at once: three ways lead on from there.

Before, the column is unstable: it may turn over to either wall. The rate complementarity problem of the two gaps has three solutions
for a rising load, contact with both walls or with one of them. The ways to one wall are the ends of the branch that leaves the path
at the bifurcation before: from both ends the same branch is followed, through the same limit point.
"""
import functools
import math

import pytest

import deck_runner as dr

DECK = """*HEADING, JOB=deck
*NODE
1, 0., 0.
2, 1., 0.
*LINE, ELSET=COLUMN, NSET=COLUMN, TYPE=GE8
1, 2
{shape}
*BEAM SECTION, ELSET=COLUMN, SECTION=STIFFNESS
4.8e5, 1.
*BOUNDARY
1, PINNED
2, 2
{ends}*OBSTACLE, NAME=TOP, TYPE=LINE
1., 0.02, 0., 0.02
*OBSTACLE, NAME=BOTTOM, TYPE=LINE
0., -0.02, 1., -0.02
*CONTACT, OBSTACLE=TOP, NSET=COLUMN
*CONTACT, OBSTACLE=BOTTOM, NSET=COLUMN
*MONITOR, NAME=shortening
2, U1, -1
*MONITOR, NAME=top, OBSTACLE=TOP
RN
*MONITOR, NAME=bottom, OBSTACLE=BOTTOM
RN
*STEP
*STATIC, METHOD=CYLINDRICAL
0.5, 1E-12, 0.05
*CLOAD
2, 1, {load}
*ACCURACY, TOLERANCE=1E-6
*STOP
LOAD, ABOVE, 5.
{branches}*END STEP
"""
HINGED = {"shape": "*IMPERFECTION, ELSET=COLUMN, SHAPE=SINE\n0.0014, 2", "ends": "", "load": "-9.869604401089358"}
CLAMPED = {"shape": "*IMPERFECTION, ELSET=COLUMN, SHAPE=CLAMPED\n0, 0.0014", "ends": "1, 6\n2, 6\n", "load": "-39.47841760435743"}
BRANCHES = """*BRANCH, NAME=BEFORE, BIFURCATION=1
shortening, ABOVE, 0.02
*BRANCH, NAME=ONE, BIFURCATION=2
shortening, ABOVE, 0.02
*BRANCH, NAME=OTHER, BIFURCATION=2, MODE=2
shortening, ABOVE, 0.02
"""


@functools.cache
def clamped():
    return dr.run_deck(DECK.format(**CLAMPED, branches=BRANCHES))


def branch(run, name, side=1):
    found, = [b for b in run.results.branches.values() if (b.name, b.side) == (name, side)]
    return found


def close(one, other):
    """Two critical points have one load within their bars."""
    (path, a), (reference, b) = one, other
    bars = [p.errors["load_factor"].values[c.point - 1] for p, c in (one, other)]
    dr.assert_close(a.load_factor, b.load_factor, absolute=sum(bars))


@pytest.mark.parametrize("column, load", [(HINGED, 3.728025), (CLAMPED, 1.905575)], ids=["hinged", "clamped"])
def test_both_contacts_are_a_bifurcation(column, load):
    run = dr.run_deck(DECK.format(**column, branches=""))
    gained, (before, ways) = run.only("C+"), run.labelled("BP")
    dr.assert_close(gained.load_factor, load, relative=1e-6)
    assert ways.point == gained.point and ways.load_factor == gained.load_factor
    assert "3 ways on" in ways.note and before.load_factor < ways.load_factor
    # The path itself goes on with both.
    after = slice(gained.point, None)
    dr.assert_close(run.column("top")[after], run.column("bottom")[after], relative=1e-6)


def test_each_way_to_one_wall_leads_to_the_bifurcation_before():
    run = clamped()
    before, _ = run.labelled("BP")
    for name, wall, free in (("ONE", "bottom", "top"), ("OTHER", "top", "bottom")):
        path = branch(run, name)
        assert [c.label for c in path.critical] == ["LP", "C-", "BP", "EP"]
        assert "back on the path it left" in path.critical[-1].note
        close((path, path.critical[2]), (run.results, before))
        top = path.critical[0].point - 1
        assert path.monitors[wall].values[top] > 1.0 and path.monitors[free].values[top] == 0.0
        # At the change no force acts: it grows from there.
        assert path.monitors[wall].values[0] == 0.0 and path.monitors[wall].values[1] > 0.0


def test_the_branch_from_there_comes_to_the_same_point():
    run = clamped()
    _, ways = run.labelled("BP")
    for side, name in ((1, "OTHER"), (-1, "ONE")):
        path = branch(run, "BEFORE", side)
        assert [c.label for c in path.critical] == ["C+", "LP", "BP", "EP"]
        close((path, path.critical[2]), (run.results, ways))
        back = branch(run, name)
        wall = [w for w in ("top", "bottom") if back.monitors[w].values[1] > 0.0]
        if path.monitors[wall[0]].values[path.critical[1].point - 1] == 0.0:
            back = branch(run, {"ONE": "OTHER", "OTHER": "ONE"}[name])
        close((path, path.critical[1]), (back, back.critical[0]))
        close((path, path.critical[0]), (back, back.critical[1]))


def test_a_way_to_one_wall_is_that_without_the_other_wall():
    """Hinged: the point of contact divides before the column comes to the other wall."""
    run = dr.run_deck(DECK.format(**HINGED, branches="*BRANCH, BIFURCATION=2, MODE=2\nLOAD, ABOVE, 16.5\n"))
    way, = run.results.branches.values()
    alone = dr.changed(DECK.format(**HINGED, branches=""), ("*OBSTACLE, NAME=BOTTOM, TYPE=LINE\n0., -0.02, 1., -0.02\n", ""),
                       ("*CONTACT, OBSTACLE=BOTTOM, NSET=COLUMN\n", ""), ("*MONITOR, NAME=bottom, OBSTACLE=BOTTOM\nRN\n", ""),
                       ("LOAD, ABOVE, 5.", "LOAD, ABOVE, 16.5"))
    single = dr.run_deck(alone)
    divided, end = way.critical
    assert divided.label == "C-" and "splits" in divided.note
    close((way, divided), (single.results, single.only("C-")))
    dr.assert_close(end.monitors["top"], single.only("EP").monitors["top"], relative=1e-5)


@pytest.mark.parametrize("wanted, reason", [("SIDE=MINUS", "SIDE=PLUS"), ("MODE=3", "2 null vector(s) or other way(s) on, not 3")])
def test_what_is_no_way_on(wanted, reason):
    run = dr.run_deck(DECK.format(**CLAMPED, branches=f"*BRANCH, BIFURCATION=2, {wanted}\n"), code=2)
    assert reason in run.stdout


HEXAGON = """*HEADING
Ring that sags under its weight inside a hexagon: it meets two walls at once, and another two after that
*NODE
1, 0, 1
2, 0, -1
*ARC, ELSET=RING, NSET=RING, DIRECTION=ANTICLOCKWISE
1, 2, 0, 0
2, 1, 0, 0
*BEAM SECTION, ELSET=RING, SECTION=STIFFNESS
7500, 1
*BOUNDARY
2, ENCASTRE
*OBSTACLE, NAME=HOST, TYPE=POLYLINE, ENDS=CLOSED
1, 0.57735026919
0, 1.15470053838
-1, 0.57735026919
-1, -0.57735026919
0, -1.15470053838
1, -0.57735026919
*CONTACT, OBSTACLE=HOST, NSET=RING, GAP=0.003
*STEP
*ACCURACY, TOLERANCE={tolerance}
*STATIC, METHOD=LOAD
{first}, , 0.5
*DLOAD
RING, PY, -0.48
*END STEP
"""


@pytest.mark.parametrize("tolerance, first", [
    ("1E-5", 0.2), ("1E-5", 0.1), ("1E-6", 0.2), ("1E-6", 0.1), ("1E-7", 0.2), ("1E-7", 0.1)])
def test_a_stable_structure_has_one_way_on(tolerance, first):
    """The rate complementarity problem of a stable structure has one solution: the ring rests on both walls."""
    run = dr.run_deck(HEXAGON.format(tolerance=tolerance, first=first))
    assert {critical.label for critical in run.results.critical} == {"C+", "EP"}
    for begins in run.labelled("C+"):
        assert min(abs(begins.load_factor - load) for load in (0.0290742873, 0.0635240254)) <= 1e-9 + begins.error
    assert all(run.column("negative_pivots") == 0)


def polygon(corners, gap, tolerance, first):
    """The ring in a regular polygon around the circle of radius 1, with a corner at the top."""
    turn = 2 * math.pi / corners
    radius = 1 / math.cos(turn / 2)
    points = "\n".join(f"{radius * math.sin(turn * k)!r}, {radius * math.cos(turn * k)!r}" for k in range(corners, 0, -1))
    before, after = HEXAGON.format(tolerance=tolerance, first=first).split("ENDS=CLOSED\n")
    return f"{before}ENDS=CLOSED\n{points}\n{after[after.index('*CONTACT'):]}".replace("GAP=0.003", f"GAP={gap}")


@pytest.mark.parametrize("corners, gap, first", [(12, 0.001, 0.2), (12, 0.003, 0.2), (12, 0.01, 0.13), (8, 0.003, 0.13), (5, 0.01, 0.2)])
def test_mirror_images_of_a_wall_are_met_at_once(corners, gap, first):
    """A coarse mesh may show another wall first, or a wall too late: the gap between nodes has an error of its own."""
    reference = dr.run_deck(polygon(corners, gap, "1E-7", 0.1))
    for tolerance in ("1E-4", "1E-6"):
        run = dr.run_deck(polygon(corners, gap, tolerance, first))
        assert [c.label for c in run.results.critical] == [c.label for c in reference.results.critical]
        for met, exact in zip(run.labelled("C+"), reference.labelled("C+")):
            close((run.results, met), (reference.results, exact))
        # Each event is that of two mirror images.
        for met in run.labelled("C+"):
            assert run.column("active_contacts")[met.point] - run.column("active_contacts")[met.point - 1] == 2

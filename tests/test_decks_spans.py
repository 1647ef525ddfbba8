"""What contact points that lived at nodes could not follow: strips between walls, liners, tubes, fine rings."""
import functools
import pathlib

import numpy as np
import pytest

import deck_runner as dr
from test_decks_path import LINER, PINNED, TUBE, liner

WALLS = """*HEADING
{title}
*NODE
1, 0., 0.
2, {length}, 0.
*LINE, ELSET=S, NSET=S, TYPE=GE6
1, 2, {elements}
*BEAM SECTION, ELSET=S, SECTION=STIFFNESS
1e6, 1.
*BOUNDARY
1, ENCASTRE
{guide}
*OBSTACLE, NAME=UPPER, TYPE=LINE
1., 0.1, 0., 0.1
*OBSTACLE, NAME=LOWER, TYPE=LINE
0., -0.1, 1., -0.1
*CONTACT, OBSTACLE=UPPER, NSET=S
*CONTACT, OBSTACLE=LOWER, NSET=S
*MONITOR, NAME=d
2, U1, {factor}
*STEP
*STATIC
1., 1e-9, 0.02
*CONTROLS, POINTS=600
*CLOAD
2, 1, -1.
{trigger}*LOCATE
LOAD, 60, 100, 140, 160, 200
*STOP
LOAD, ABOVE, {end}
d, ABOVE, 0.6
{branch}*END STEP
"""


def test_half_of_a_strip_between_walls():
    """Point contact to P = 155.482, then line contact; d = 0.0313907 at P = 160."""
    run = dr.run_deck(WALLS.format(title="half of a strip", length=0.5, elements=60, guide="2, 6", factor=-2,
                                   trigger="2, 2, 1e-5\n", end=240, branch=""))
    point, = [c for c in run.labelled("UZ") if abs(c.load_factor - 160.0) < 1e-6]
    dr.assert_close(point.monitors["d"], 0.0313907, relative=1e-5)
    assert "do not get on" not in run.stdout and not [c for c in run.labelled("BP") if c.load_factor > 45.0]


def test_strip_between_walls():
    """The same without symmetry, on the branch of the perfect strip; in line contact it may shift along itself: no BP."""
    run = dr.run_deck(WALLS.format(title="strip", length=1.0, elements=120, guide="2, 2\n2, 6", factor=-1, trigger="", end=45,
                                   branch="*BRANCH, SIDE=PLUS\nLOAD, ABOVE, 240.\n"))
    branch = run.results.branches[1]
    point, = [c for c in branch.critical if c.label == "UZ" and abs(c.load_factor - 160.0) < 1e-6]
    dr.assert_close(point.monitors["d"], 0.0313907, relative=1e-5)
    assert "do not get on" not in run.stdout
    assert not [c for c in branch.critical if c.label == "BP" and 150.0 < c.load_factor]
    assert np.all(branch.column("negative_pivots").values[-3:] == 0)


def test_a_line_contact_opens_inside():
    """The pressure, whose zero it is, comes from the moments by two derivatives: of elements of order 6 errors fall as h^4."""
    run = dr.run_deck(dr.changed(PINNED.format(middle="", lines="1, 3, 81", monitor="", end=0.0018), ("TYPE=GE4", "TYPE=GE6")))
    split = [c for c in run.labelled("C-") if "split" in c.note]
    dr.assert_close(split[0].load_factor, 4.804326, relative=1e-4)


@pytest.mark.parametrize("disturbance, exact", [pytest.param("1e-5", 35.2454714568, marks=dr.release_only), ("2e-4", 35.2180743713),
                                                pytest.param("5e-3", 34.5418107598, marks=dr.release_only)])
def test_liner_without_a_gap(disturbance, exact):
    """R/t = 25, tight (Glock 34.3); exact limit loads are those of reference/liner_limits.csv."""
    run = dr.run_deck(dr.changed(LINER, ("0., 0.004, 1.004", "0., 0., 1."), ("30000, 1.", "7500, 1."),
                                 ("1, 2, -0.001", f"1, 2, -{disturbance}")))
    dr.assert_close(run.load("LP"), exact, relative=1e-6)


@dr.once_in_release
@pytest.mark.parametrize("gap", [pytest.param(0.001, marks=dr.release_only), 0.002, pytest.param(0.006, marks=dr.release_only)])
def test_liners_with_gaps(gap):
    """One limit point each, whatever small force disturbs them; exact limit loads are those of reference/liner_limits.csv."""
    table = dr.reference("liner_limits")
    for disturbance in (2e-4, 2e-3):
        row, = np.flatnonzero((table["R_t"] == 50) & (table["lobes"] == 1) & (table["gap"] == gap)
                              & (table["disturbance"] == disturbance))
        dr.assert_close(dr.run_deck(liner(gap, disturbance)).load("LP"), table["p"][row], relative=1e-6)


@dr.release_only
def test_tube_between_plates():
    """Whether one mesh comes through is a matter of rounding today."""
    for element, elements in (("GE4", 80), ("GE6", 40), ("GE6", 80), ("GE8", 40)):
        for method in ("LOAD", "SPHERICAL"):
            run = dr.run_deck(dr.changed(TUBE, ("TYPE=GE6", f"TYPE={element}"), ("0., 0., 80", f"0., 0., {elements}"),
                                         ("SPHERICAL", method)))
            dr.assert_close([c.monitors["F"] for c in run.labelled("UZ")][2:], (5.7421601, 15.950445), relative=1e-5)
            assert not run.labelled("BP")


@dr.release_only
def test_ring_of_640_elements():
    run = dr.run_deck(dr.changed(dr.on_given_mesh("ring"), ("0., 0., 160, 6.", "0., 0., 640"), ("ABOVE, 0.6", "ABOVE, 0.05")))
    dr.assert_close(run.load("LP"), 81.557427564661, relative=1e-8)


# The decks without numbers of elements are run by test_decks_tolerance.
@pytest.mark.parametrize("name", sorted({path.stem for path in (pathlib.Path(__file__).parent.parent / "input").glob("*.inp")}
                                        - set(dr.MESHES)))
def test_example_decks_need_no_contact_at_nodes(name):
    assert "do not get on" not in dr.run_deck(dr.example(name)).stdout


def test_clamped_column_between_walls_that_are_near():
    """Small rotations: between clamps and a line there is a wave length each, at any load. The line is free to buckle where it is
    as long as that, at 9 Pcr, or two of them, at 16; or where tan(k l/2) = k l/2, which opens one half and presses the other."""
    text = WALLS.format(title="column", length=1.0, elements=24, guide="2, 2\n2, 6", factor=-1, trigger="", end=45,
                        branch="*BRANCH, SIDE=PLUS\nLOAD, ABOVE, 790.\n")
    run = dr.run_deck(dr.changed(text, ("1., 0.1, 0., 0.1", "1., 1e-4, 0., 1e-4"), ("0., -0.1, 1., -0.1", "0., -1e-4, 1., -1e-4"),
                                 ("TYPE=GE6", "TYPE=GE8"), ("1e6, 1.", "1e9, 1."),
                                 ("LOAD, 60, 100, 140, 160, 200", "LOAD, 200, 400, 700")))
    assert "do not get on" not in run.stdout
    branch = run.results.branches[1]
    assert [c.label for c in branch.critical] == ["C+", "UZ", "BP", "UZ", "BP", "BP", "UZ", "BP", "EP"]
    pcr = 4.0 * np.pi**2
    odd = 4.493409457909064 / np.pi
    dr.assert_close([c.load_factor / pcr for c in branch.critical if c.label == "BP"],
                    [9.0, (2.0 + odd)**2, 16.0, (2.0 + 7.725251836937707 / np.pi)**2], relative=1e-5)
    for c in (c for c in branch.critical if c.label == "UZ"):
        wave = 2.0 * np.pi / np.sqrt(c.load_factor)
        ends = [branch.contact.start[c.point - 1, 0], 1.0 - branch.contact.end[c.point - 1, 0]]
        dr.assert_close(ends, np.full(2, wave), absolute=1e-6)


BOTH = """*HEADING
One beam falls on a drum, another one lies on springs
*NODE
1, 0., 0.
2, 2., 0.
11, 0., 5.
12, 2., 5.
*LINE, ELSET=ONE, NSET=ONE, TYPE=GE8
1, 2, 12
*LINE, ELSET=TWO, NSET=TWO, TYPE=GE8
11, 12, 12
*BEAM SECTION, ELSET=ONE, SECTION=STIFFNESS
1e6, 1.
*BEAM SECTION, ELSET=TWO, SECTION=STIFFNESS
1e6, 1.
*BOUNDARY
1, ENCASTRE
11, 1
*OBSTACLE, NAME=DRUM, TYPE=CIRCLE, SIDE=OUTSIDE
1., -1.55, 1.5
*OBSTACLE, NAME=BED, TYPE=LINE, FOUNDATION=WINKLER, MODULUS=50.
0., 5., 2., 5.
*CONTACT, OBSTACLE=DRUM, NSET=ONE
*CONTACT, OBSTACLE=BED, NSET=TWO
*MONITOR, NAME=one
2, U2
*MONITOR, NAME=two
12, U2
*MONITOR, NAME=drum, OBSTACLE=DRUM
RN
*MONITOR, NAME=bed, OBSTACLE=BED
RN
*STEP
*STATIC, METHOD=LOAD
0.1
*DLOAD
{loads}
*CLOAD
12, 2, 3.
*END STEP
"""


def test_spans_beside_a_foundation():
    """Two beams that know nothing of each other: each as it is with the other one out of reach of its obstacle."""
    text = BOTH.format(loads="ONE, PY, -3.\nTWO, PY, -4.")
    both = dr.run_deck(text)
    one = dr.run_deck(dr.changed(text, ("*CONTACT, OBSTACLE=BED, NSET=TWO\n", ""), ("\n11, 1\n", "\n11, ENCASTRE\n"),
                                 ("*MONITOR, NAME=bed, OBSTACLE=BED\nRN\n", "")))
    two = dr.run_deck(dr.changed(text, ("*CONTACT, OBSTACLE=DRUM, NSET=ONE\n", ""), ("*MONITOR, NAME=drum, OBSTACLE=DRUM\nRN\n", "")))
    assert "points and lines anywhere along the rod" in both.stdout and "do not get on" not in both.stdout
    assert both.results.contact.regions(both.results.n_points)[0].start > 0.5
    for name, alone in (("one", one), ("drum", one), ("two", two), ("bed", two)):
        dr.assert_close(both.column(name)[-1], alone.column(name)[-1], relative=1e-7)
        assert abs(both.column(name)[-1]) > 1e-3


def test_a_stop_inside_a_line_contact():
    """A strip pressed on a table, with a stop beside it that is never reached: nothing changes."""
    text = dr.on_given_mesh("pipe-lift")
    alone = dr.run_deck(text)
    stopped = dr.run_deck(dr.changed(text, ("*MONITOR, NAME=height", "*GAP, NAME=LID, DIRECTION=-90\n1, 100.\n*MONITOR, NAME=height")))
    assert "do not get on" not in stopped.stdout
    dr.assert_close(stopped.column("load_factor")[-1], alone.column("load_factor")[-1], relative=1e-7)


BEAM_OVER_A_WALL = """*HEADING
A beam on two supports sags onto a wall; a node divides it, nothing else
*NODE
1, 0., 0.
2, {node}, 0.
3, 1., 0.
*LINE, ELSET=LEFT, NSET=BEAM, TYPE=GE8
1, 2{count}
*LINE, ELSET=RIGHT, NSET=BEAM, TYPE=GE8
2, 3{count}
*BEAM SECTION, ELSET=LEFT, SECTION=STIFFNESS
1e5, 1.
*BEAM SECTION, ELSET=RIGHT, SECTION=STIFFNESS
1e5, 1.
*BOUNDARY
1, PINNED
3, 2
*OBSTACLE, NAME=WALL, TYPE=LINE
0., -0.01, 1., -0.01
*CONTACT, OBSTACLE=WALL, NSET=BEAM
*STEP
*ACCURACY
*STATIC, METHOD=LOAD
0.05
*DLOAD
LEFT, PY, -10.
RIGHT, PY, -10.
*CLOAD
3, 6, 0.3
*STOP
LOAD, ABOVE, 0.1
*END STEP
"""


@pytest.mark.parametrize("node", [0.48, 0.5, 0.53])
def test_where_contact_begins_beside_a_node(node):
    """Between the node and the first place inside an element where the gap is looked at the rod came down, and it touched at the node later.
    The node only divides a uniform beam."""
    (begins,) = dr.run_deck(BEAM_OVER_A_WALL.format(node=node, count="")).labelled("C+")
    finer, *_ = dr.run_deck(BEAM_OVER_A_WALL.format(node=node, count=", 12")).labelled("C+")
    dr.assert_close(begins.load_factor, finer.load_factor, relative=1e-6)
    dr.assert_close(begins.load_factor, 0.0671384205, relative=1e-6)


STEPPED_COLUMN = """*HEADING
A column whose section steps lies flat on a wall
*NODE
1, 0., 0.
2, 0.3, 0.
3, 1., 0.
*LINE, ELSET=STIFF, NSET=COLUMN, TYPE=GE8
1, 2
*LINE, ELSET=SOFT, NSET=COLUMN, TYPE=GE8
2, 3
*BEAM SECTION, ELSET=STIFF, SECTION=STIFFNESS
1e6, 1.
*BEAM SECTION, ELSET=SOFT, SECTION=STIFFNESS
1e6, 0.5
*BOUNDARY
1, PINNED
3, 2
*OBSTACLE, NAME=WALL, TYPE=LINE
0., -0.02, 1., -0.02
*CONTACT, OBSTACLE=WALL, NSET=COLUMN
*STEP
*ACCURACY, TOLERANCE={asked}
*STATIC
0.1, , 0.02
*CLOAD
3, 6, 0.2
3, 1, -10.
*STOP
LOAD, ABOVE, 40.
*END STEP
"""


@pytest.mark.parametrize("asked", [1e-2, 1e-3, 1e-4, 1e-5, 1e-6])
def test_what_a_long_flat_line_hides(asked):
    """On its wall it is exact with an element or two, which buckle between their own nodes long before those tell. Loads from 32 elements of order 8
    in each part. Nothing there may err by any amount, nor do the places where contact ends."""
    run = dr.run_deck(STEPPED_COLUMN.format(asked=asked))
    assert not np.isinf(run.results.contact.bars[:2]).any()
    bifurcations = [bp.load_factor for bp in run.labelled("BP")]
    dr.assert_close(bifurcations, [7.904543401, 11.867385655, 18.944274327, 24.910777917, 33.746071205], relative=asked)


ARCH_IN_A_CAVITY = """*HEADING
A shallow arch below a circle; both halves touch it, and let go, at once
*NODE
1, -0.573576436351046, -0.1808479557110082
2, 0., 0.
3, 0.573576436351046, -0.1808479557110082
*ARC, ELSET=ARCH, NSET=ARCH, TYPE=GE8, DIRECTION=CLOCKWISE
1, 2, 0., -1.
2, 3, 0., -1.
*BEAM SECTION, ELSET=ARCH, SECTION=STIFFNESS
1e6, 1.
*BOUNDARY
1, PINNED
3, PINNED
*OBSTACLE, NAME=CAVITY, TYPE=CIRCLE, SIDE=INSIDE
0., -1., 1.01
*CONTACT, OBSTACLE=CAVITY, NSET=ARCH
*MONITOR, NAME=v
2, U2, -1.
*MONITOR, NAME=u
2, U1, 1.
*STEP
*ACCURACY
*STATIC
0.5, , 0.03
*CLOAD
2, 2, -1.
*LOCATE
v, 0.16
*STOP
v, ABOVE, 0.17
*END STEP
"""


def test_two_contacts_that_end_at_once():
    """What lets go of both sides at once is neither's alone: beyond it the arch is the free one again."""
    run = dr.run_deck(ARCH_IN_A_CAVITY)
    assert run.labelled("C-")
    free = dr.run_deck(ARCH_IN_A_CAVITY.replace("*CONTACT, OBSTACLE=CAVITY, NSET=ARCH\n", ""))
    (load,), (alone,) = ([point.load_factor for point in one.labelled("UZ")] for one in (run, free))
    dr.assert_close(load, alone, relative=1e-6)


# Contact that cannot be along the rod ---------------------------------------------------------------------------------------

SAGGING = """*HEADING
Beam over a block, at its middle; contact begins at 384/5 of the gap
*NODE
1, 0., 0.
2, 1., 0.
*LINE, ELSET=BEAM, NSET=BEAM, TYPE={kind}
1, 2, 16
*BEAM SECTION, ELSET=BEAM, SECTION={section}
*BOUNDARY
1, PINNED
2, 2
*OBSTACLE, NAME=BLOCK, TYPE=CIRCLE, SIDE=OUTSIDE
0.5, -1.001, 1.
*CONTACT, OBSTACLE=BLOCK, NSET=BEAM{points}
{more}*STEP
*STATIC, METHOD=LOAD
0.1
*DLOAD
BEAM, PY, -1.
*STOP
LOAD, ABOVE, 1.
*END STEP
"""
LAW_ACROSS = """*FOUNDATION LAW, NAME=GRIP
0., 0.
1., 1.
*OBSTACLE, NAME=END, TYPE=LINE, FOUNDATION=LAW, LAW=GRIP, WIDTH=1
2., -1., 2., 1.
*CONTACT, OBSTACLE=END, NSET=BEAM, POINTS=NODES
"""


@pytest.mark.parametrize("kind, section, more, needs", [
    ("GE8", "STIFFNESS\n1e6, 1., 1e4", "", "by its *BEAM SECTION element 1 has it"),
    ("GE2", "STIFFNESS\n1e6, 1.", "", "element 1 is GE2"),
    ("UL2", "STIFFNESS\n1e6, 1.", "", "GE elements on a generated curve (*LINE, *ARC ...); element 1 is not"),
    ("GE8", "STIFFNESS\n1e6, 1.", LAW_ACROSS, "*CONTACT with END acts on element 1"),
], ids=["shear", "GE2", "UL2", "another"])
def test_contact_at_nodes_that_was_not_asked_for(kind, section, more, needs):
    """It runs, but is not what it would be along the rod: the listing and the last line say why, and the exit code is 2."""
    text = functools.partial(SAGGING.format, kind=kind, section=section, more=more)
    run = dr.run_deck(text(points=""), code=2)
    assert needs in " ".join(run.stdout.split()) and "BLOCK" in run.stderr and needs in run.stderr
    assert needs in run.results.status
    asked = dr.run_deck(text(points=", POINTS=NODES"))
    assert "it needs" not in asked.stdout
    assert run.load("EP") == asked.load("EP")

"""Contact that begins with the load: what touches from the start is no event, what comes next is one, however near it is."""
import math

import pytest

import deck_runner as dr


def two_humps(gap, static):
    """A pipe hinged at its left end lies on the crest of a hump; that of the next one, of the same spline, is lower by `gap`."""
    def ground(x):
        return 0.1 * (math.exp(-((x + 1.0) / 0.45)**2) + math.exp(-((x - 1.0) / 0.45)**2)) - (gap if x > 0.45 else 0.0)
    points = "".join(f"{x:.1f}, {ground(x):.15f}\n" for x in (-2.5 + 0.1 * k for k in range(51)))
    crest = f"{ground(-1.0):.15f}"
    return (f"*HEADING\nA pipe on two humps\n*NODE\n1, -4, {crest}\n2, -1, {crest}\n3, 4, {crest}\n"
            "*LINE, ELSET=PIPE, NSET=PIPE, TYPE=GE8\n1, 2\n2, 3\n*BEAM SECTION, ELSET=PIPE, SECTION=STIFFNESS\n1e6, 1\n"
            f"*BOUNDARY\n1, PINNED\n*OBSTACLE, NAME=GROUND, TYPE=SPLINE\n{points}*CONTACT, OBSTACLE=GROUND, NSET=PIPE\n"
            "*MONITOR, NAME=ground, OBSTACLE=GROUND\nRF2\n"
            f"*STEP\n*ACCURACY, TOLERANCE=1E-6\n{static}*DLOAD\nPIPE, PY, -0.1\n*STOP\nLOAD, ABOVE, 0.04\n*END STEP\n")


@pytest.mark.parametrize("static", ["*STATIC, METHOD=LOAD\n0.02, 1e-6, 0.05\n", "*STATIC\n0.02, , 0.02\n"])
@pytest.mark.parametrize("gap", [1e-7, 1e-5, 1e-3])
def test_a_second_place_of_one_contact(gap, static):
    """Hinge, support 3 behind it and 5 that overhang under q: 2 behind the support the beam sinks by q (1.1375 + 1.9) / 0.1 =
    41.75 q, q = 0.1. What is not linear is of the order of the gap over these lengths: 0.1 of it, squares of angles 2 % at 1e-3."""
    run = dr.run_deck(two_humps(gap, static))
    first = run.labelled("C+")[0]
    dr.assert_close(first.load_factor, gap / 4.175, relative=1e-7 + 0.1 * gap)
    # Moments about the hinge: the first hump alone carries it.
    dr.assert_close(first.monitors["ground"], first.load_factor * 0.1 * 8 * 4 / 3, relative=1e-6 + 10 * gap)


def test_what_touches_at_two_places_from_the_start():
    assert not run_below(0.04, 0.0).labelled("C+")


LIFTED = """*HEADING
A heavy beam on a floor, lifted by a disc
*NODE
1, -5, 0
2, 5.03, 0
*LINE, ELSET=BEAM, NSET=BEAM
1, 2
*BEAM SECTION, ELSET=BEAM, SECTION=STIFFNESS
1e5, 100
*BOUNDARY
1, 1
*OBSTACLE, NAME=FLOOR, TYPE=LINE
-9, 0, 9, 0
*OBSTACLE, NAME=DISC, TYPE=CIRCLE, SIDE=OUTSIDE
0.007, {centre}, 4
*CONTACT, OBSTACLE=FLOOR, NSET=BEAM
*CONTACT, OBSTACLE=DISC, NSET=BEAM
*MONITOR, NAME=disc, OBSTACLE=DISC
RF2
*STEP
*STATIC, METHOD=LOAD
0.2
*DLOAD
BEAM, PY, -1
*END STEP
*STEP
*STATIC, METHOD=LOAD
0.2
*{lift}
*END STEP
"""


@pytest.mark.parametrize("centre, lift", [(-4, "OBSTACLE MOTION\nDISC, 0, 0.01"), (-3.999995, "OBSTACLE MOTION\nDISC, 0, 0.01"),
                                          (-3.99, "CONTACT INTERFERENCE, SHRINK\nDISC")])
def test_a_disc_that_begins_behind_a_rod(centre, lift):
    """A disc between two nodes, flush with the floor, above it by less than the rounding of coordinates, or by 0.01, is withdrawn to
    where it touches. It lifts q per length by h over a = (72 EI h / q)^(1/4) on each side, with 4/3 q a; slopes are 0.005."""
    run = dr.run_deck(LIFTED.format(centre=centre, lift=lift))
    dr.assert_close(run.column("disc")[-1], 4 / 3 * 72**0.25, relative=1e-4)


def test_a_disc_beside_a_loaded_node():
    """The rod touches its only support at a place that is nearer to the end of a rod segment than any node that looks for contact.
    The force on the disc is that of a lever; its angle is 2e-6."""
    run = dr.run_deck("*HEADING\nA lever on a disc\n*NODE\n1, 0, 0\n2, 2.772, 0\n3, 10, 0\n*LINE, ELSET=BEAM, NSET=BEAM\n1, 2\n2, 3\n"
                      "*BEAM SECTION, ELSET=BEAM, SECTION=STIFFNESS\n1e5, 100\n*BOUNDARY\n1, 1, 2\n"
                      "*OBSTACLE, NAME=DISC, TYPE=CIRCLE, SIDE=OUTSIDE\n2.79, -4, 4\n*CONTACT, OBSTACLE=DISC, NSET=BEAM\n"
                      "*MONITOR, NAME=disc, OBSTACLE=DISC\nRF2\n*STEP\n*STATIC, METHOD=LOAD\n1\n"
                      "*CLOAD\n2, 2, -1e-5\n3, 2, -1e-5\n*END STEP\n")
    dr.assert_close(run.column("disc")[-1], 1e-5 * (10 + 2.772) / 2.79, relative=1e-5)


def test_a_rod_between_two_walls_without_clearance():
    """A clamped rod lies on a floor and under a plate that touches it. The load on one of its nodes goes straight to the floor."""
    run = dr.run_deck("*HEADING\nNo clearance\n*NODE\n1, 0, 0\n2, 4, 0\n3, 10, 0\n*LINE, ELSET=BEAM, NSET=BEAM\n1, 2\n2, 3\n"
                      "*BEAM SECTION, ELSET=BEAM, SECTION=STIFFNESS\n1e5, 100\n*BOUNDARY\n1, ENCASTRE\n3, 2, 6\n"
                      "*OBSTACLE, NAME=FLOOR, TYPE=LINE\n-3, 0, 13, 0\n*OBSTACLE, NAME=PLATE, TYPE=LINE\n13, 0, -3, 0\n"
                      "*CONTACT, OBSTACLE=FLOOR, NSET=BEAM\n*CONTACT, OBSTACLE=PLATE, NSET=BEAM\n"
                      "*MONITOR, NAME=floor, OBSTACLE=FLOOR\nRF2\n*MONITOR, NAME=plate, OBSTACLE=PLATE\nRF2\n"
                      "*STEP\n*STATIC, METHOD=LOAD\n0.5\n*CLOAD\n2, 2, -0.17\n*END STEP\n")
    dr.assert_close(run.column("floor")[-1], 0.17, relative=1e-12)
    dr.assert_close(run.column("plate")[-1], 0.0, absolute=1e-12)


def run_below(load, gap):
    return dr.run_deck(two_humps(gap, "*STATIC, METHOD=LOAD\n0.02, 1e-6, 0.05\n").replace("ABOVE, 0.04", f"ABOVE, {load}"))


@pytest.mark.parametrize("first", [0.04, 0.01, 0.007])
def test_a_roller_that_comes_by_arc_length(first):
    """Until the roller is there nothing moves, and no arc length has a scale; it stops to touch at 0.04, an increment's end or not.
    From there on all is as with a roller that touches from the start, 0.04 later."""
    text = dr.changed(dr.example("indenter"), ("*LOCATE", "*STOP\nLOAD, ABOVE, 1.\n*LOCATE"),
                      ("*STATIC, METHOD=LOAD\n0.04, 1e-6, 0.1\n", f"*STATIC\n{first}, , 0.02\n"))
    near, apart = dr.run_deck(text), dr.run_deck(dr.changed(text, ("0., 0.4, 0.4", "0., 0.41, 0.4")))
    dr.assert_close(apart.load("C+"), 0.04, relative=1e-7)
    for one, other in zip(near.labelled("UZ"), apart.labelled("UZ"), strict=True):
        dr.assert_close(other.load_factor, one.load_factor + 0.04, absolute=one.error + other.error + 1e-10)


# Where nothing but reactions changes ---------------------------------------------------------------------------------------

LEAF = """*PARAMETER
half = 40
*HEADING
Half of a bent leaf on a table, pressed down in the middle until that lies on the table, then on
*NODE
1, 0., ${{1 - cos(radians(half))}}
2, ${{sin(radians(half))}}, 0.
*ARC, ELSET=LEAF, NSET=LEAF, DIRECTION=CLOCKWISE
1, 2, 0., ${{-cos(radians(half))}}
*BEAM SECTION, ELSET=LEAF, SECTION=STIFFNESS
1e6, 1.
*BOUNDARY
1, XSYMM
*OBSTACLE, NAME=TABLE, TYPE=LINE
0., 0., 1., 0.
*CONTACT, OBSTACLE=TABLE, NSET=LEAF
*MONITOR, NAME=table, OBSTACLE=TABLE
RF2
*STEP
*STATIC, METHOD={method}
0.02, , 0.05
*CLOAD
1, 2, -6.
*STOP
LOAD, ABOVE, 1.
*END STEP
"""
LEAF_TOUCHES = 2.1539165  # the load on one half there: the elastica as a boundary-value problem


@pytest.mark.parametrize("method", ["LOAD", "CYLINDRICAL", "SPHERICAL", "LINEARISED", "MINIMUM RESIDUAL", "VARIABLE LOAD",
                                    "GENERALISED DISPLACEMENT", "LARGEST DISPLACEMENT"])
def test_a_load_that_stands_on_an_obstacle_grows_on(method):
    """The node that carries the load has come down on the table: more load changes the table's force and nothing else."""
    run = dr.run_deck(LEAF.format(method=method))
    dr.assert_close(6.0 * run.load("C+"), LEAF_TOUCHES, relative=1e-7)
    dr.assert_close(run.column("table")[-1], 6.0, relative=1e-12)
    dr.assert_close(run.only("EP").load_factor, 1.0, relative=1e-12)

"""Rigid bodies without mass that a force moves: nodes of no element, joined by stops (*GAP) and springs.

The arch under a platen is exact by the path P(v) of the arch alone (tests/reference), the column beside a wall by beam-column theory.
"""
import math

import numpy as np
import pytest

import deck_runner as dr

PLATEN = dr.example("arch-platen")
FORCE = "*CLOAD\n9, 2, -0.5\n"
MOTION = "*BOUNDARY\n9, 2, 2, -1.\n*TURNING POINTS\ntotal\n"


def summed(spring):
    """Largest P(v) + spring v of the arch, and its v, from a polynomial through eight neighbouring points of the exact path."""
    exact = dr.reference("arch_shallow_hinged_symmetric")
    v, total = exact["v"], exact["P"] + spring * exact["v"]
    first = int(np.argmax(np.where(v < 0.13, total, 0.0))) - 3
    part = slice(first, first + 8)
    middle, width = v[part].mean(), np.ptp(v[part])
    fit = np.polynomial.Polynomial.fit((v[part] - middle) / width, total[part], 7)
    roots = [r.real for r in fit.deriv().roots() if abs(r.imag) < 1e-9 and abs(r.real) < 0.5]
    best = max(roots, key=fit)
    return fit(best), middle + width * best


@pytest.mark.parametrize("spring", [100.0, 30.0])
def test_limit_point_of_a_platen_on_a_spring(spring):
    """The largest force is that of P(v) + k v, within its bar and to the digits of the reference."""
    run = dr.run_deck(dr.changed(PLATEN, ("9, 2, 50.", f"9, 2, {spring / 2!r}")))
    load, v = summed(spring)
    limit = run.only("LP")
    assert abs(limit.load_factor - load) <= limit.error
    dr.assert_close(limit.load_factor, load, relative=1e-6)
    # The place of a maximum has the root of the load's relative error.
    dr.assert_close(limit.monitors["platen"], v, relative=1e-3)
    dr.assert_close(run.column("platen"), run.column("apex"), absolute=1e-12)
    dr.assert_close(run.column("load_factor"), run.column("force") + spring * run.column("platen"), relative=1e-8, absolute=1e-8)


def test_force_and_motion_give_the_same_path():
    """Where a support moves the platen instead of a force, its reaction is largest where the force is."""
    moved = dr.run_deck(dr.changed(
        PLATEN, ("9, XSYMM", "9, ENCASTRE"), ("*SPRING\n9, 2, 50.", "*SPRING\n2, 2, 50."), (FORCE, MOTION),
        ("METHOD=CYLINDRICAL\n0.5, 1E-9, 0.005", "METHOD=LOAD\n0.005, 1E-9, 0.005"), ("*STEP", "*MONITOR, NAME=total\n9, RF2, -2.\n*STEP")))
    pressed = dr.run_deck(PLATEN)
    dr.assert_close(moved.only("TP").monitors["total"], pressed.only("LP").load_factor, relative=1e-6)


COLUMN = """*HEADING
Column beside a wall on a spring
*NODE
1, 0, 0
2, 0.5, 0
3, 1, 0
9, 0.5, 0.1
*LINE, ELSET=COLUMN
1, 2, 4
2, 3, 4
*BEAM SECTION, ELSET=COLUMN, SECTION=STIFFNESS
1e8, 1.
*BOUNDARY
1, PINNED
3, 2
9, 1
9, 6
*SPRING
9, 2, {spring!r}
*GAP, NAME=WALL, DIRECTION=-90
2, 1e-4, 9
*MONITOR, NAME=w
2, U2
*MONITOR, NAME=wall
9, U2
*STEP
*STATIC, METHOD=LOAD
1
*CLOAD
3, 1, -{press!r}
*END STEP
*STEP
*STATIC, METHOD=LOAD
0.1, , 0.1
*CLOAD
2, 2, 0.02
9, 2, -{push!r}
*END STEP
"""


@pytest.mark.parametrize("press, spring, push", [(5.0, 40.0, 0.0), (5.0, 40.0, 0.005)])
def test_column_beside_a_wall_on_a_spring(press, spring, push):
    """A force Q bends the column towards the wall, which a force may push towards the column.

    Under the force P the middle moves by f times a force there, f = (tan u - u) / (16 u^3), u = sqrt(P) / 2.
    Deflections are 1e-3, and their square is the error of the theory.
    """
    u = math.sqrt(press) / 2.0
    f = (math.tan(u) - u) / (16.0 * u**3)
    run = dr.run_deck(COLUMN.format(press=press, spring=spring, push=push))
    step = run.column("step") == 2
    factor = run.column("load_factor")[step]
    free, back = 0.02 * factor * f, -push * factor / spring
    reaction = np.maximum(free - back - 1e-4, 0.0) / (f + 1.0 / spring)
    dr.assert_close(run.column("w")[step], free - f * reaction, absolute=1e-8)
    dr.assert_close(run.column("wall")[step], back + reaction / spring, absolute=1e-8)
    assert reaction[-1] > 0.0 and run.only("C+")


PAIR = """*HEADING
Two cantilevers under one platen
*NODE
1, 0, 0
2, 1, 0
3, 0, -0.1
4, 1, -0.1
9, 1, 0.1
*LINE, ELSET=LEAVES
1, 2, 2
3, 4, 2
*BEAM SECTION, ELSET=LEAVES, SECTION=STIFFNESS
1e8, 1.
*BOUNDARY
1, ENCASTRE
3, ENCASTRE
9, XSYMM
*GAP, NAME=PLATEN, DIRECTION=-90{law}
2, 0, 9
4, 0.001, 9
*MONITOR, NAME=platen
9, U2, -1
*STEP
*STATIC, METHOD=LOAD
0.1, , 0.1
*CLOAD
9, 2, -0.01
*END STEP
"""


@pytest.mark.parametrize("law, soft", [("", 0.0), (", STIFFNESS=6", 1.0 / 6.0)])
def test_two_rods_under_one_platen(law, soft):
    """Each tip has the stiffness 3, in series with its stop; the second one is met after 0.001. Deflections are 3e-3 at the most."""
    run = dr.run_deck(PAIR.format(law=law))
    stiffness, way = 1.0 / (1.0 / 3.0 + soft), run.column("platen")
    dr.assert_close(0.01 * run.column("load_factor"), stiffness * (way + np.maximum(way - 0.001, 0.0)), absolute=3e-7)
    dr.assert_close(0.01 * run.only("C+").load_factor, 0.001 * stiffness, relative=1e-5)


def test_a_body_that_nothing_holds():
    """The rotation of the platen is free."""
    run = dr.run_deck(dr.changed(PLATEN, ("9, XSYMM", "9, 1")), code=2)
    assert "node 9 belongs to no element and can move or turn without resistance" in run.stderr


LEFT = """*HEADING
A circle bends a cantilever and is drawn back
*NODE
1, 0., 0.
2, 1., 0.
*LINE, ELSET=ROD, NSET=ROD
1, 2
*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS
1e6, 1.
*BOUNDARY
1, ENCASTRE
*OBSTACLE, NAME=BODY, TYPE=CIRCLE, SIDE=OUTSIDE
0.45, 0.05, 0.04
*CONTACT, OBSTACLE=BODY, NSET=ROD
*MONITOR, NAME=force, OBSTACLE=BODY
RN
*STEP
*ACCURACY, TOLERANCE=1E-6
*STATIC, METHOD=LOAD
0.1
*OBSTACLE MOTION
BODY, -0.01, -0.04
*END STEP
*STEP
*ACCURACY, TOLERANCE=1E-6
*STATIC, METHOD=LOAD
0.1
*OBSTACLE MOTION
BODY, 0., 0.3
*END STEP
"""


def test_where_a_body_leaves_the_rod_forces_are_measured_by_those_before():
    """Nothing is left of the force there: TOLERANCE is a part of the largest force so far. The circle leaves where it came."""
    run = dr.run_deck(LEFT)
    begins, pressed, leaves, end = run.results.critical
    assert [c.label for c in (begins, pressed, leaves, end)] == ["C+", "EP", "C-", "EP"]
    dr.assert_close([begins.load_factor, leaves.load_factor], [0.25, 0.1], relative=1e-6)
    assert not leaves.monitor_errors["force"] > 1e-6 * pressed.monitors["force"]

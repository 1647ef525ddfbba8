"""A rod that lies on one obstacle and meets another one: gaps of lines of contact to the other obstacles, and the sets that follow.

A heavy rod on a floor, w its weight per length. A point that is lifted by d takes 4 w a / 3 and raises a = (72 EI d / w)^(1/4) on each
side; a tip that is lifted by d takes w a / 2 and raises a = (24 EI d / w)^(1/4): the rod's moment and slope are zero where it leaves
the floor (beam theory; geometry adds terms of the order (d / a)^2).
"""
import math

import pytest

import deck_runner as dr

EI, WEIGHT, LENGTH = 100.0, 1.0, 10.0
ROD = """*HEADING
Heavy rod on a floor
*NODE
1, 0, 0
{nodes}
*LINE, ELSET=ROD, NSET=ROD
{lines}
*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS
1e6, 100, , , 1e-5
*BOUNDARY
1, {support}
*OBSTACLE, NAME=FLOOR, TYPE=LINE
-1, 0, 11, 0
{obstacles}
*CONTACT, OBSTACLE=FLOOR, NSET=ROD
{contacts}
*STEP, NAME=WEIGHT
*STATIC, METHOD=LOAD
1
*DLOAD
ROD, PY, -1
*END STEP
*STEP
*STATIC, METHOD={method}
0.1
{load}
*STOP
LOAD, ABOVE, 1
*END STEP
"""


def rod(load, other="", inner=(), support="XSYMM", method="LOAD"):
    """`other`: the second obstacle's data, its name is LIFT; `inner`: places of nodes between the ends."""
    places = [*inner, LENGTH]
    obstacles = f"*OBSTACLE, NAME=LIFT, TYPE={other}" if other else ""
    return ROD.format(nodes="\n".join(f"{k}, {x!r}, 0" for k, x in enumerate(places, 2)), support=support,
                      lines="\n".join(f"{k}, {k + 1}, 8" for k in range(1, len(places) + 1)), method=method, load=load, obstacles=obstacles,
                      contacts="*CONTACT, OBSTACLE=LIFT, NSET=ROD\n*MONITOR, NAME=force, OBSTACLE=LIFT\nRF2" if other else
                      "\n".join(f"*MONITOR, NAME=rise{k}\n{k}, U2" for k in range(2, len(places) + 2)))


def raised(lift, share):
    """Length that lifts off if a point (72) or a tip (24) is lifted."""
    return (share * EI * lift / WEIGHT)**0.25


@pytest.mark.parametrize("place", [5.0, 4.321])
@pytest.mark.parametrize("radius", [2.0, 20.0])
def test_a_circle_rises_through_the_floor(place, radius):
    below, rise = 0.1, 0.15
    run = dr.run_deck(rod(f"*OBSTACLE MOTION\nLIFT, 0, {rise!r}", f"CIRCLE, SIDE=OUTSIDE\n{place!r}, {-below - radius!r}, {radius!r}"))
    assert [c.label for c in run.results.critical] == ["EP", "C+", "EP"]
    dr.assert_close(run.only("C+").load_factor, below / rise, relative=1e-8)
    a = raised(rise - below, 72)
    # The rod's curvature above the circle, a^2 w / 6 EI, is less than that of the circle, so it stays a point.
    assert a**2 * WEIGHT / (6 * EI) < 1 / radius
    dr.assert_close(run.results.critical[-1].monitors["force"], 4 * WEIGHT * a / 3, relative=((rise - below) / a)**2)
    assert run.results.contact.count[-1] == 3


def test_a_rod_changes_over_to_another_bed():
    below, rise = 0.1, 0.5
    text = rod(f"*OBSTACLE MOTION\nLIFT, 0, {rise!r}", f"LINE\n-1, {-below!r}, 11, {-below!r}", support="1")
    run = dr.run_deck(dr.changed(text, ("*STEP, NAME=WEIGHT", "*MONITOR, NAME=end\n2, U2\n*STEP, NAME=WEIGHT")))
    assert [c.label for c in run.results.critical] == ["EP", "C+", "EP"]
    dr.assert_close(run.only("C+").load_factor, below / rise, relative=1e-8)
    dr.assert_close(run.results.critical[-1].monitors["force"], WEIGHT * LENGTH, relative=1e-8)
    dr.assert_close(run.results.critical[-1].monitors["end"], rise - below, relative=1e-8)


ROOM = 0.001
WALL = f"*OBSTACLE, NAME=LIFT, TYPE=LINE\n{LENGTH + ROOM!r}, -1, {LENGTH + ROOM!r}, 1\n"


@pytest.mark.parametrize("wall, contact", [
    (WALL, "*CONTACT, OBSTACLE=FLOOR, NSET=ROD\n*CONTACT, OBSTACLE=LIFT, NSET=ROD\n"),
    (WALL, "*CONTACT, OBSTACLE=LIFT, NSET=ROD\n*CONTACT, OBSTACLE=FLOOR, NSET=ROD\n"),
    (f"*GAP, NAME=LIFT, DIRECTION=180\n2, {ROOM!r}\n", "*CONTACT, OBSTACLE=FLOOR, NSET=ROD\n"),
], ids=["wall", "wall first", "stop"])
def test_a_strip_grows_into_a_wall(wall, contact):
    """EA (strain of the heat - gap / length), whichever contact comes first. Once both hold its end, nothing moves any more."""
    heat = 5e-4
    text = rod(f"*TEMPERATURE\nROD, {heat / 1e-5!r}")
    run = dr.run_deck(dr.changed(text, ("*CONTACT, OBSTACLE=FLOOR, NSET=ROD\n", wall + contact + "*MONITOR, NAME=force, OBSTACLE=LIFT\nRF1\n")))
    assert [c.label for c in run.results.critical] == ["EP", "C+", "EP"]
    dr.assert_close(run.only("C+").load_factor, ROOM / LENGTH / heat, relative=1e-8)
    dr.assert_close(run.results.critical[-1].monitors["force"], -1e6 * (heat - ROOM / LENGTH), relative=1e-8)


def test_between_two_obstacles_a_rod_is_held_fast():
    """A circle comes down on the rod: it can go no further, and the run says where and why."""
    above, radius = 0.1, 3.0
    run = dr.run_deck(rod("*OBSTACLE MOTION\nLIFT, 0, -0.25", f"CIRCLE, SIDE=OUTSIDE\n4.0, {above + radius!r}, {radius!r}"), code=2)
    dr.assert_close(run.only("C+").load_factor, above / 0.25, relative=1e-8)
    assert "the rod lies on one obstacle and meets LIFT, which may hold it fast" in run.stderr
    assert run.column("load_factor")[-1] <= above / 0.25 * (1 + 1e-8)


@pytest.mark.parametrize("method", ["LOAD", "CYLINDRICAL"])
@pytest.mark.parametrize("place", [3.0, 4.4])
def test_two_forces_lift_at_once(place, method):
    """A force inside and one at the tip: both spans open with the first of the load, so neither alone is an equilibrium."""
    inner, tip = 1.2, 0.4
    run = dr.run_deck(rod(f"*CLOAD\n2, 2, {inner!r}\n3, 2, {tip!r}", inner=(place,), support="1", method=method))
    rises = run.results.critical[-1].monitors
    for rise, a, share in ((rises["rise2"], 0.75 * inner / WEIGHT, 72), (rises["rise3"], 2.0 * tip / WEIGHT, 24)):
        exact = WEIGHT * a**4 / (share * EI)
        dr.assert_close(rise, exact, relative=max((exact / a)**2, 1e-6))
        assert math.isclose(raised(exact, share), a)


LEANING = """*HEADING
Column beside a wall, with a stop in the middle
*NODE
1, 0, 0
2, 0.5, 0
3, 1, 0
*LINE, ELSET=B, NSET=B
1, 2{elements}
2, 3{elements}
*IMPERFECTION, ELSET=B, SHAPE=SINE
-0.0005, 1
0.00015, 2
*BEAM SECTION, ELSET=B, SECTION=STIFFNESS
1e6, 1
*BOUNDARY
1, ENCASTRE
*OBSTACLE, NAME=TOP, TYPE=LINE
1.5, 0.05, -0.5, 0.05
*CONTACT, OBSTACLE=TOP, NSET=B
*GAP, NAME=STOP, DIRECTION=-90
2, 0.0175
*MONITOR, NAME=short
3, U1, -1
*STEP
*ACCURACY, {accuracy}
*STATIC
{first!r}
*CLOAD
3, 1, -2.46740110027
*STOP
LOAD, ABOVE, 8
*END STEP
"""


@pytest.mark.parametrize("first", [0.037, 0.05, 0.02])
def test_wall_that_is_met_before_a_stop(first):
    """The tip meets the wall at 0.9934 of Euler's load and would have the middle meet its stop at 0.9950, both in one increment, behind
    which neither seems to have been met. Whatever the increments and the mesh, only the wall is."""
    run = dr.run_deck(LEANING.format(first=first, elements="", accuracy="TOLERANCE=1E-6"))
    given = dr.run_deck(LEANING.format(first=0.01, elements=", 8", accuracy="WIDEST=1"))
    for one in (run, given):
        assert [c.label for c in one.results.critical] == ["C+", "EP"]
    touched, fine = run.only("C+"), given.only("C+")
    assert abs(touched.load_factor - fine.load_factor) <= touched.error + fine.error + 1e-8


TIP = """*HEADING
Heavy rod on a floor; a ramp rises under its end, which is held
*NODE
1, 0, 0
2, 1.3, 0
3, 3, 0
*LINE, ELSET=ROD, NSET=ROD
{lines}
*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS
3e4, 1
*BOUNDARY
1, ENCASTRE
3, 2
*OBSTACLE, NAME=FLOOR, TYPE=LINE
-3, 0, 6, 0
*OBSTACLE, NAME=RAMP, TYPE=LINE
0, -0.6, 3, -0.0127
*CONTACT, OBSTACLE=FLOOR, NSET=ROD
*CONTACT, OBSTACLE=RAMP, NSET=ROD
*MONITOR, NAME=floor, OBSTACLE=FLOOR
RF2
*MONITOR, NAME=ramp, OBSTACLE=RAMP
RF2
*MONITOR, NAME=held
3, RF2
*MONITOR, NAME=clamp
1, RF2
*STEP
*STATIC, METHOD=LOAD
1
*DLOAD
ROD, PY, -1.1
*END STEP
*STEP
*STATIC, METHOD=LOAD
0.1
*OBSTACLE MOTION
RAMP, 0, 0.0237
*END STEP
"""


@pytest.mark.parametrize("lines", ["1, 2\n2, 3", "3, 2\n2, 1"])
def test_the_weight_of_a_line_is_borne_by_its_own_obstacle(lines):
    """The point at the line's end belongs to the ramp, the line beside it to the floor, whichever node comes first."""
    run = dr.run_deck(TIP.format(lines=lines))
    begins, = run.labelled("C+")
    dr.assert_close(begins.load_factor, 0.0127 / 0.0237, relative=1e-6)
    end = run.results.critical[-1].monitors
    dr.assert_close(end["floor"] + end["ramp"] + end["held"] + end["clamp"], 3.3, relative=1e-9)
    # The end cannot rise: what the ramp gives, the support takes.
    dr.assert_close(end["floor"], 3.3, absolute=1e-6)


@pytest.mark.parametrize("points", ["", ", POINTS=NODES"])
def test_a_support_carries_what_an_obstacle_pushes_against_it(points):
    """The inclined ramp presses on a node that is held in y: its reaction is not a part of the support's."""
    alone = dr.changed(TIP.format(lines="1, 2, 6\n2, 3, 8"), ("*CONTACT, OBSTACLE=FLOOR, NSET=ROD\n", ""),
                       ("*OBSTACLE, NAME=FLOOR, TYPE=LINE\n-3, 0, 6, 0\n", ""), ("NAME=floor, OBSTACLE=FLOOR", "NAME=along, OBSTACLE=RAMP"),
                       ("RF2\n*MONITOR, NAME=ramp", "RF1\n*MONITOR, NAME=ramp"), ("3e4, 1\n", "3e4, 1000\n"),
                       ("OBSTACLE=RAMP, NSET=ROD", f"OBSTACLE=RAMP, NSET=ROD{points}"))
    end = dr.run_deck(alone).results.critical[-1]
    forces = end.monitors
    dr.assert_close(forces["ramp"], -forces["along"] * 3 / 0.5873, relative=1e-9)
    dr.assert_close(forces["ramp"] + forces["held"] + forces["clamp"], 3.3, absolute=1e-8 * forces["ramp"])
    if not points:  # contact at nodes has no bars
        fine = dr.run_deck(dr.changed(alone, ("1\n*DLOAD", "1\n*ACCURACY, TOLERANCE=1E-8\n*DLOAD"),
                                       ("0.1\n*OBSTACLE", "0.1\n*ACCURACY, TOLERANCE=1E-8\n*OBSTACLE"))).results.critical[-1]
        dr.assert_close(forces["held"], fine.monitors["held"], absolute=end.monitor_errors["held"] + fine.monitor_errors["held"])

"""What a run says where it ends before its time: of what is ahead, and of METHODs that have been tried."""
import math
import re

import pytest

import deck_runner as dr

# Half of a pipe on a rock of 0.5 m, with a bed below: it takes its weight, and then heat.
ON_A_ROCK = """*HEADING
Half of a steel pipeline on a rock
*NODE
1, 0., 0.
2, 3., 0.
3, 200., 0.
*LINE, ELSET=PIPE, NSET=CROWN
1, 2, 6
*LINE, ELSET=PIPE, NSET=REST
2, 3, 60, 10
*NSET, NSET=PIPE
CROWN, REST
*MATERIAL, NAME=STEEL
*ELASTIC
207e9, 0.3
*EXPANSION
1.17e-5
*DENSITY
7850.
*BEAM SECTION, ELSET=PIPE, SECTION=PIPE, MATERIAL=STEEL
0.16, 0.016
*BOUNDARY
1, XSYMM
3, 1
*OBSTACLE, NAME=BED, TYPE=LINE
0., -0.5, 10., -0.5
*OBSTACLE, NAME=ROCK, TYPE=CIRCLE, SIDE=OUTSIDE
0., -1., 1.
*CONTACT, OBSTACLE=BED, NSET=PIPE
*CONTACT, OBSTACLE=ROCK, NSET=CROWN
*MONITOR, NAME=crown
1, U2
*STEP
*STATIC, METHOD=LOAD
1e-6, , 0.1
*DLOAD
PIPE, GRAV, 9.81, 0., -1.
*END STEP
*STEP
*STATIC, METHOD={method}
0.02{largest}
*TEMPERATURE
PIPE, 80.
{stop}*END STEP
"""


def test_the_load_turns_where_the_run_stands():
    """The pipe lifts off its rock, and the load falls from there on: no limit point ahead, but the maximum here."""
    run = dr.run_deck(ON_A_ROCK.format(method="LOAD", largest="", stop=""), code=2)
    top, lost = run.only("LP"), run.only("C-")
    assert top.point == lost.point == run.results.n_points
    assert "turns back where the contact changes" in run.stderr and "ahead" not in run.stderr
    # What the message says of another METHOD is true.
    assert "(METHOD=CYLINDRICAL can)" in run.stderr
    other = dr.run_deck(ON_A_ROCK.format(method="CYLINDRICAL", largest=", , 0.01", stop="*STOP\ncrown, ABOVE, 1.\n"))
    assert [c.label for c in other.results.critical if c.step == 2] == ["C-", "LP", "LP", "EP"]
    dr.assert_close(other.labelled("LP")[0].load_factor, top.load_factor, relative=1e-8)
    assert other.column("crown")[-1] > 0.99


@pytest.mark.parametrize("first", ["0.2, 1E-4, 0.5", "1., 1E-4, 2."])
def test_a_limit_point_is_ahead(first):
    text = dr.on_given_mesh("lee-frame")
    run = dr.run_deck(dr.with_static(text, "METHOD=LOAD", first), code=2)
    told = re.search(r"limit point ahead, near load factor (\S+) \(METHOD=CYLINDRICAL can\)", run.stderr)
    near, last = float(told.group(1)), run.column("load_factor")[-1]
    limit = dr.run_deck(text).labelled("LP")[0].load_factor
    assert last <= near <= limit * (1.0 + 1e-9)
    dr.assert_close(near, limit, relative=1e-3)


def in_a_host_of_splines():
    """A liner in a round host that is drawn as half a spline: where this has no curvature, at its ends, the host bulges in."""
    host = "\n".join(f"{-math.sin(a)!r}, {math.cos(a)!r}" for a in (math.radians(6.0 * k) for k in range(31)))
    return f"""*NODE
1, 0., 1.
2, 0., -1.
*ARC, ELSET=LINER, NSET=LINER
1, 2, 0., 0., 24
*BEAM SECTION, ELSET=LINER, SECTION=STIFFNESS
19200., 1.
*BOUNDARY
1, XSYMM
2, ENCASTRE
*OBSTACLE, NAME=HOST, TYPE=SPLINE
{host}
*CONTACT, OBSTACLE=HOST, NSET=LINER, GAP=0.0005
*MONITOR, NAME=v
1, U2, -1.
*STEP
*STATIC
0.5, , 0.005
*DLOAD
LINER, P, 1.
*CLOAD
1, 2, -0.002
*STOP
v, ABOVE, 0.2
*END STEP
"""


def test_a_host_that_begins_inside_the_liner():
    """The overlap between the nodes is told before the run; a first increment could not push the liner out."""
    run = dr.run_deck(in_a_host_of_splines(), code=1)
    assert "behind the obstacle, between its nodes" in run.stderr and "SHRINK" in run.stderr, run.stderr


def test_no_method_that_leads_nowhere():
    """One iteration is not enough for increments as long as these, by load or by arc length."""
    text = dr.with_static(dr.on_given_mesh("lee-frame"), "METHOD=LOAD", "15., 14., 20.").replace(
        "*STOP", "*CONTROLS, ITERATIONS=1, DESIRED=1\n*STOP")
    run = dr.run_deck(text, code=2)
    assert run.results.n_points == 1 and "METHOD" not in run.stderr, run.stderr


# A rod on a floor, which a force at a node lifts; its weight is 1.
LIFTED = """*HEADING
Rod lifted off its floor
*NODE
1, 0., 0.
2, 0.5, 0.
3, 1., 0.
*LINE, ELSET=ROD, NSET=ROD
1, 2
2, 3
*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS
1e6, 100.
*BOUNDARY
1, 1
*OBSTACLE, NAME=FLOOR, TYPE=LINE
-1., 0., 2., 0.
*CONTACT, OBSTACLE=FLOOR, NSET=ROD
*STEP
*STATIC, METHOD=LOAD
0.5
*DLOAD
ROD, PY, -1.
*END STEP
*STEP
*STATIC, METHOD=LOAD
0.1
*CLOAD
2, 2, 2.
*END STEP
"""


def test_the_last_contact_ends():
    """The rod flies from where the force is its weight; no other method follows it."""
    run = dr.run_deck(LIFTED, code=2)
    assert "stopped: the contact that holds the structure ends: the part with node 1 can move as a rigid body" in run.stderr
    assert "was not tried" not in run.stderr
    dr.assert_close(run.labelled("C-")[-1].load_factor, 0.5, relative=1e-6)


# A plate presses a shallow arch through.
SNAPPED = """*HEADING
Arch that a plate presses until it snaps through
*NODE
1, -0.5, 0.
2, 0., 0.05
3, 0.5, 0.
*ARC, ELSET=ARCH, NSET=ARCH, DIRECTION=CLOCKWISE
1, 2, 0., -2.475
2, 3, 0., -2.475
*BEAM SECTION, ELSET=ARCH, SECTION=STIFFNESS
1e5, 1.
*BOUNDARY
1, PINNED
3, PINNED
*OBSTACLE, NAME=PLATE, TYPE=LINE
1., 0.05, -1., 0.05
*CONTACT, OBSTACLE=PLATE, NSET=ARCH
*STEP
*STATIC, METHOD=CYLINDRICAL
0.01, , 0.02
*OBSTACLE MOTION
PLATE, 0., -0.06
*STOP
LOAD, ABOVE, 1.
*END STEP
"""


def test_a_plate_leaves_the_arch_that_has_snapped():
    """The force vanishes where the arch stands by itself, and a gap opens only if the plate goes back: it may go any distance. The
    run ends when the loads before are rounding beside it."""
    run = dr.run_deck(SNAPPED, code=2)
    assert "stopped: nothing moves any more" in run.stderr
    assert run.results.n_points < 100


# A clamped ring in a cavity that becomes smaller: node 1 cannot follow it.
SHRINKS = """*HEADING
Clamped ring in a cavity that shrinks
*NODE
1, 0., -1.
2, 0., 1.
*ARC, ELSET=RING, NSET=RING, DIRECTION=ANTICLOCKWISE
1, 2, 0., 0.
2, 1, 0., 0.
*BEAM SECTION, ELSET=RING, SECTION=STIFFNESS
1e5, 1.
*BOUNDARY
1, ENCASTRE
*OBSTACLE, NAME=CAVITY, TYPE=CIRCLE, SIDE=INSIDE
0., 0., 1.
*CONTACT, OBSTACLE=CAVITY, NSET=RING, GAP=0.002
*STEP
*STATIC, METHOD=LOAD
0.1
*CONTACT INTERFERENCE
CAVITY, 0.01
*END STEP
"""


def test_an_obstacle_reaches_a_support():
    """The cavity is 0.002 away from the held node, and comes by 0.01 to it."""
    run = dr.run_deck(SHRINKS, code=2)
    found = re.search(r"stopped: obstacle CAVITY reaches node 1, which supports hold, at load factor ([0-9.]+)", run.stderr)
    assert found and "was not tried" not in run.stderr
    dr.assert_close(float(found[1]), 0.2, relative=1e-5)


# A cantilever under a disc; a table lifts it until no room is left between both.
PINCHED = """*HEADING
Cantilever between a disc and a table
*NODE
1, 0., 0.
2, 1., 0.
*LINE, ELSET=ROD, NSET=ROD
1, 2
*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS
1e5, 1.
*BOUNDARY
1, ENCASTRE
*OBSTACLE, NAME=OVER, TYPE=CIRCLE, SIDE=OUTSIDE
0.6, 0.51, 0.5
*OBSTACLE, NAME=UNDER, TYPE=CIRCLE, SIDE=OUTSIDE
0.6, -0.51, 0.5
*CONTACT, OBSTACLE=OVER, NSET=ROD
*CONTACT, OBSTACLE=UNDER, NSET=ROD
*STEP
*STATIC, METHOD=LOAD
0.1
*OBSTACLE MOTION
UNDER, 0., 0.05
*END STEP
"""


def test_two_obstacles_pinch_a_rod():
    run = dr.run_deck(PINCHED, code=2)
    assert re.search("stopped: obstacles (OVER and UNDER|UNDER and OVER) pinch the rod from both sides", run.stderr)
    assert "was not tried" not in run.stderr

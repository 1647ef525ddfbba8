"""Walls of several pieces: contact passes their joints, and where the curvature jumps the rod bridges the joint.

A rod that is pressed by q per length onto a wall whose curvature jumps by D at a joint would need the couple C = EI D there. It lifts over
the length l, l^2 = 2 sqrt(3) C / q, and ends with (sqrt(3) + 1) C / l at its end on the less curved side, (3 - sqrt(3)) / 6 l from the
joint, and with (sqrt(3) - 1) C / l at its other end (beam theory; geometry adds terms of the order of the squared slope).
"""
import math

import numpy as np
import pytest

import deck_runner as dr

LIMIT = 47.01187314993       # of the liner in one CIRCLE, see test_decks_closed_walls

LINER = """*PARAMETER
q = {q}
d = 2*q/(sqrt(2) - 1)
s = sqrt(0.5)
*HEADING
Round liner in an oval host of arcs, half of it; half axes 1 + q and 1 - q
*NODE
1, 0, 1
2, ${{-s}}, ${{s}}
3, ${{-s}}, ${{-s}}
4, 0, -1
*ARC, ELSET=LINER, NSET=TOP
1, 2, 0, 0, 12
*ARC, ELSET=LINER, NSET=SIDE
2, 3, 0, 0, 12
*ARC, ELSET=LINER, NSET=LOW
3, 4, 0, 0, 6
*NSET, NSET=LINER
TOP, SIDE, LOW
*BEAM SECTION, ELSET=LINER, SECTION=STIFFNESS
19200, 1
*BOUNDARY
1, XSYMM
4, ENCASTRE
{host}
*MONITOR, NAME=v
1, U2, -1
*STEP
*STATIC
0.5, , 0.005
*DLOAD
LINER, P, 1
*CLOAD
1, 2, -0.002
*STOP
v, ABOVE, 0.08
*END STEP
"""

ARCS = """*OBSTACLE, NAME=TOPWALL, TYPE=ARC
0, ${-d*s}, ${1 + d/2}, 45, 135
*OBSTACLE, NAME=SIDEWALL, TYPE=ARC
${-d*s}, 0, ${1 - d/2}, 135, 225
*OBSTACLE, NAME=LOWWALL, TYPE=ARC
0, ${d*s}, ${1 + d/2}, 225, 315
*CONTACT, OBSTACLE=TOPWALL, NSET=TOP, GAP=0.0005
*CONTACT, OBSTACLE=SIDEWALL, NSET=SIDE, GAP=0.0005
*CONTACT, OBSTACLE=LOWWALL, NSET=LOW, GAP=0.0005"""

POLYLINE = """*OBSTACLE, NAME=HOST, TYPE=POLYLINE, ENDS=CLOSED
0, ${sqrt(2)}, ${1 + d/2}
${-sqrt(2)}, 0, ${1 - d/2}
0, ${-sqrt(2)}, ${1 + d/2}
${sqrt(2)}, 0, ${1 - d/2}
*CONTACT, OBSTACLE=HOST, NSET=LINER, GAP=0.0005"""


def limit(q, host):
    return dr.run_deck(LINER.format(q=q, host=host)).only("LP")


@pytest.mark.xfail(reason="the debug build stops where the line opens at a joint of the arcs: the run says so", strict=False)
def test_oval_of_arcs_tends_to_the_circle():
    """The limit load falls linearly with the ovality: what two ovalities extrapolate to is the circle's, but for the square of theirs."""
    loads = [limit(q, POLYLINE).corrected for q in (1e-6, 1e-8)]
    slope = (loads[1] - loads[0]) / (1e-6 - 1e-8)
    assert abs(loads[1] + slope * 1e-8 - LIMIT) < 1e-9 * LIMIT
    assert abs(loads[0] - LIMIT) < 5e-4


def test_three_arcs_are_one_closed_polyline():
    """The same wall said in two ways."""
    one, other = limit(1e-8, ARCS), limit(1e-8, POLYLINE)
    assert abs(one.corrected - other.corrected) < one.error + other.error + 1e-10 * LIMIT


def test_jump_below_resolution_is_none():
    """The bridge over a jump of 5e-8 is lower than rounding: the list of events is the circle's."""
    run = dr.run_deck(LINER.format(q=1e-8, host=ARCS))
    assert [point.label for point in run.results.critical] == ["C+", "LP", "EP"]


HILL = """*HEADING
A heavy strip over the edge where a floor goes on as a hill of radius {radius}
*NODE
1, {start}, 0
2, 0, 0
3, {tip}, 0
*LINE, ELSET=STRIP, NSET=BACK
1, 2, 8
*LINE, ELSET=STRIP, NSET=FRONT
2, 3, 8
*BEAM SECTION, ELSET=STRIP, SECTION=STIFFNESS
1E4, 1
*BOUNDARY
1, ENCASTRE
*OBSTACLE, NAME=FLOOR, TYPE=LINE
{floor}
*OBSTACLE, NAME=HILL, TYPE=ARC
0, {centre}, {radius}, {angles}
*CONTACT, OBSTACLE={order[0]}, NSET={order[1]}
*CONTACT, OBSTACLE={order[2]}, NSET={order[3]}
*MONITOR, NAME=floor, OBSTACLE=FLOOR
RF2
*MONITOR, NAME=hill, OBSTACLE=HILL
RF2
*STEP
*STATIC, METHOD=LOAD
0.05
*DLOAD
STRIP, PY, -4
*END STEP
"""


RIGHT = {"start": -1, "tip": 1, "floor": "-2, 0, -1, 0", "angles": "90, 80"}
LEFT = {"start": 1, "tip": -1, "floor": "1, 0, 2, 0", "angles": "100, 90"}


@pytest.mark.parametrize("order, way", [(("FLOOR", "BACK", "HILL", "FRONT"), RIGHT), (("HILL", "FRONT", "FLOOR", "BACK"), RIGHT),
                                        (("FLOOR", "BACK", "HILL", "FRONT"), LEFT)])
def test_strip_bridges_the_joint(order, way):
    """Whichever piece the deck names first, and in a mirror: the strip then runs against the sense of the wall."""
    radius, weight = 1000.0, 4.0
    run = dr.run_deck(HILL.format(radius=radius, centre=-radius, order=order, **way))
    assert [point.label for point in run.results.critical] == ["EP"]
    couple = 1.0 / radius
    contact = run.results.contact
    load = run.column("load_factor")
    for at in np.flatnonzero(load > 0.2):
        q = weight * load[at]
        length = math.sqrt(2.0 * math.sqrt(3.0) * couple / q)
        part = (3.0 - math.sqrt(3.0)) / 6.0
        # The joint is 1 from the strip's beginning. The slope is 1e-3; forces in balance to 1e-9 locate the ends to 1e-9 q / T.
        near = 1e-6 * length + 1e-9 * weight / (0.7 * couple / length) * 10.0
        assert abs(contact.end[at, 0] - (1.0 - (1.0 - part) * length)) < near
        assert abs(contact.start[at, 1] - (1.0 + part * length)) < near
        # The line's pressure and the force of its end; the clamp takes nothing.
        force = q * (1.0 - (1.0 - part) * length) + (math.sqrt(3.0) - 1.0) * couple / length
        assert abs(run.column("floor")[at] - force) < 1e-6 * force
        assert abs(run.column("floor")[at] + run.column("hill")[at] - 2.0 * q) < 1e-6 * q


BEAM = """*HEADING
Clamped beam pressed onto two boards side by side, level, 40 below
*NODE
1, 0, 0
2, 240, 0
3, 300, 0
*LINE, ELSET=RULER, NSET=INNER, TYPE=GE8
1, 2, 8
*LINE, ELSET=RULER, NSET=OUTER, TYPE=GE8
2, 3, 4
*NSET, NSET=RULER
INNER, OUTER
*MATERIAL, NAME=STEEL
*ELASTIC
210000
*BEAM SECTION, ELSET=RULER, SECTION=RECT, MATERIAL=STEEL
25, 1
*BOUNDARY
1, ENCASTRE
{boards}
*STEP
*STATIC, METHOD=LOAD
0.02
*DLOAD
RULER, PY, -2
*END STEP
"""

TWO = """*OBSTACLE, NAME=BOARD1, TYPE=LINE
0, -40, 300, -40
*OBSTACLE, NAME=BOARD2, TYPE=LINE
240, -40, 300, -40
*CONTACT, OBSTACLE=BOARD1, NSET=INNER, GAP=-0.5
*CONTACT, OBSTACLE=BOARD2, NSET=OUTER, GAP=-0.5
*MONITOR, NAME=board1, OBSTACLE=BOARD1
RF2
*MONITOR, NAME=board2, OBSTACLE=BOARD2
RF2"""

ONE = """*OBSTACLE, NAME=BOARD, TYPE=LINE
0, -40, 300, -40
*CONTACT, OBSTACLE=BOARD, NSET=RULER, GAP=-0.5
*MONITOR, NAME=board, OBSTACLE=BOARD
RF2"""


def test_two_boards_are_one():
    """The beam lies on both at the end; that part of it that belongs to the second board is pressed by its load alone."""
    two, one = dr.run_deck(BEAM.format(boards=TWO)), dr.run_deck(BEAM.format(boards=ONE))
    assert [point.label for point in two.results.critical] == [point.label for point in one.results.critical] == ["C+", "EP"]
    assert abs(two.load("C+") - one.load("C+")) < 1e-12
    forces = [two.column(name)[-1] for name in ("board1", "board2")]
    assert abs(sum(forces) - one.column("board")[-1]) < 1e-7 * sum(forces)
    assert abs(forces[1] - 120.0) < 1e-7 * 120.0

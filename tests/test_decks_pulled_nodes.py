"""Contact sets that follow where no rule gives one: neighbours of the present set are tried (contact_trials).

A dead load pulls a node of a column off a straight wall, where the end of the line of contact gets to the node: the line cannot go on
over it, however small the load, and a span opens there. References: the same program with contact at 400 nodes, and the load at which
the line's end reaches the node, extrapolated from the points before.
"""
import functools
import math

import numpy as np
import pytest

import deck_runner as dr

pytestmark = dr.once_in_release

COLUMN = """*HEADING
Column whose node a dead load pulls off the wall
*NODE
1, 0., 0.
2, {at!r}, 0.
3, 1., 0.
*LINE, ELSET=COLUMN, NSET=COLUMN, TYPE=GE8
1, 2
2, 3
*IMPERFECTION, ELSET=COLUMN, SHAPE=SINE
0.0014, 1
*BEAM SECTION, ELSET=COLUMN, SECTION=STIFFNESS
480000., 1.
*BOUNDARY
1, PINNED
3, 2
*OBSTACLE, NAME=TOP, TYPE=LINE
1., 0.02, 0., 0.02
*CONTACT, OBSTACLE=TOP, NSET=COLUMN
*MONITOR, NAME=shortening
3, U1, -1.
*STEP
*ACCURACY, TOLERANCE={tolerance!r}
*STATIC, METHOD=CYLINDRICAL
0.1, 1E-9, 0.003
*CLOAD
2, 2, {pull!r}
3, 1, -9.869604401089358
*STOP
LOAD, ABOVE, 12.
*END STEP
"""
# Place of the node, load that pulls; shortening at the end with contact at 400 nodes.
CASES = {(0.62, -0.02): 0.0023295807, (0.53, -0.04): 0.0023332463, (0.58, -0.003): 0.0023293848, (0.7, -0.01): 0.0023293846}


@functools.cache
def column(at, pull, tolerance=1e-6):
    return dr.run_deck(COLUMN.format(at=at, pull=pull, tolerance=tolerance))


SHORTEST = 1e-4                                     # of a rod segment: shorter spans are not told from points


def along_axis(at):
    """Length of the imperfect axis up to a place."""
    x, weight = np.polynomial.legendre.leggauss(20)
    slope = 0.0014 * math.pi * np.cos(0.5 * math.pi * at * (x + 1.0))
    return 0.5 * at * float(np.sum(weight * np.sqrt(1.0 + slope**2)))


@pytest.mark.parametrize("at, pull", CASES)
def test_a_line_opens_at_the_node(at, pull):
    run = column(at, pull)
    assert [c.label for c in run.results.critical] == ["C+", "C-", "EP"]
    opening = run.only("C-")
    # The line ends at the node there; behind it contact is on both sides.
    assert list(run.results.contact.count[opening.point - 1:opening.point + 1]) == [1, 2]
    # The load at which the line's end comes to the node, a cubic through the last points before.
    before = slice(opening.point - 5, opening.point - 1)
    ends, loads = run.results.contact.end[before, 0], run.column("load_factor")[before]
    assert np.all(np.diff(ends) > 0) and ends[-1] < along_axis(at)
    cubic = np.polyfit(ends - along_axis(at), loads, 3)
    # Places of ends are accurate to a part of the shortest length.
    dr.assert_close(opening.load_factor, cubic[3], absolute=0.1 * SHORTEST * min(at, 1.0 - at) * cubic[2])


def test_the_load_at_the_node_is_within_its_error_bar():
    """An error of the distance at which an end counts as arrived, 1e-4 of the segment, would be 300 bars."""
    fine, coarse = column(0.62, -0.02).only("C-"), column(0.62, -0.02, 1e-5).only("C-")
    assert 0.0 < fine.error < 1e-6 * fine.load_factor
    dr.assert_close(coarse.load_factor, fine.load_factor, absolute=coarse.error + fine.error)
    dr.assert_close(coarse.corrected, fine.corrected, absolute=0.1 * coarse.error)


@pytest.mark.parametrize("at, pull", CASES)
def test_the_path_behind_is_that_of_contact_at_nodes(at, pull):
    """Contact at nodes errs by the square of their distance."""
    end = column(at, pull).only("EP")
    dr.assert_close(end.load_factor, 12.0, relative=1e-12)
    dr.assert_close(end.monitors["shortening"], CASES[at, pull], relative=20.0 / 400.0**2)


STRUT = """*HEADING
Strut with three nodes of its own, the second pulled off the wall
*NODE
1, 0, 0
2, 0.52093, 0
3, 0.528384, 0
4, 0.663956, 0
5, 1, 0
*LINE, ELSET=C, NSET=C
1, 2
2, 3
3, 4
4, 5
*IMPERFECTION, ELSET=C, SHAPE=SINE
0.001679, 1
-0.002737, 2
*BEAM SECTION, ELSET=C, SECTION=STIFFNESS
1.662e+06, 1
*BOUNDARY
1, PINNED
5, 2
*OBSTACLE, NAME=TOP, TYPE=LINE
1.2, 0.0397, -0.2, 0.0397
*CONTACT, OBSTACLE=TOP, NSET=C
*MONITOR, NAME=short
5, U1, -1
*STEP
*STATIC, METHOD=CYLINDRICAL
0.1, 1E-9, 0.01
*CLOAD
5, 1, -9.8696
3, 2, -0.01622
*STOP
LOAD, ABOVE, 5.55
*END STEP
"""


def test_a_strut_whose_line_is_pulled():
    """Contact at 460 nodes, at most 1/300 apart, gives 0.0055195740."""
    run = dr.run_deck(STRUT)
    assert [c.label for c in run.results.critical] == ["C+", "C-", "EP"]
    dr.assert_close(run.only("EP").monitors["short"], 0.0055195740, relative=20.0 / 300.0**2)


HOST = """*PARAMETER
** ovality (half axes 1 + q across, 1 - q upright), radius over thickness, room, disturbing force; R = EI = 1
q = 0.02
slender = 40
room = 0.0005
force = 0.002
d = 2*q/(sqrt(2) - 1)
R1 = 1 + d/2
R2 = 1 - d/2
s = sqrt(0.5)
*HEADING
Half of a liner in an oval host of three arcs a side
*NODE
1, 0, ${R1 - d*s}
2, ${-R1*s}, ${R1*s - d*s}
3, ${-R1*s}, ${d*s - R1*s}
4, 0, ${d*s - R1}
*ARC, ELSET=LINER, NSET=TOP
1, 2, 0, ${-d*s}, 12
*ARC, ELSET=LINER, NSET=SIDE
2, 3, ${-d*s}, 0, 12
*ARC, ELSET=LINER, NSET=LOW
3, 4, 0, ${d*s}, 6
*BEAM SECTION, ELSET=LINER, SECTION=STIFFNESS
${12*slender**2}, 1
*BOUNDARY
1, XSYMM
4, ENCASTRE
*OBSTACLE, NAME=TOPWALL, TYPE=ARC
0, ${-d*s}, ${R1}, 45, 135
*OBSTACLE, NAME=SIDEWALL, TYPE=ARC
${-d*s}, 0, ${R2}, 135, 225
*OBSTACLE, NAME=LOWWALL, TYPE=ARC
0, ${d*s}, ${R1}, 225, 315
*CONTACT, OBSTACLE=TOPWALL, NSET=TOP, GAP=${room}
*CONTACT, OBSTACLE=SIDEWALL, NSET=SIDE, GAP=${room}
*CONTACT, OBSTACLE=LOWWALL, NSET=LOW, GAP=${room}
*MONITOR, NAME=v
1, U2, -1
*STEP
*STATIC
0.5, , 0.005
*DLOAD
LINER, P, 1
*CLOAD
1, 2, ${-force}
*STOP
v, ABOVE, 0.2
*END STEP
"""


def test_the_limit_pressure_of_a_liner_in_a_host_of_several_arcs():
    """With contact at 150 nodes the limit pressure is 42.978; contact at nodes errs by the square of their distance, pi/150."""
    run = dr.run_deck(HOST)
    dr.assert_close(run.load("LP"), 42.978, relative=(math.pi / 150.0)**2)


@pytest.mark.parametrize("at, pull", [(0.45, -0.03), (0.38, -0.02), (0.3, -0.01)])
def test_a_node_left_of_the_middle_opens_as_its_mirror_image(at, pull):
    """What differs is the end of the line that meets the node, the last one or the first one."""
    seen, mirrored = column(at, pull), column(round(1.0 - at, 12), pull)
    assert [c.label for c in seen.results.critical] == [c.label for c in mirrored.results.critical] == ["C+", "C-", "EP"]
    for mine, its in zip(seen.results.critical, mirrored.results.critical):
        dr.assert_close(mine.load_factor, its.load_factor, relative=2 * SHORTEST)


PRESSED = """*HEADING
Heated column on a floor, a dead load presses a node down
*NODE
1, 0., 0.
2, {at!r}, 0.
3, 1., 0.
*LINE, ELSET=COLUMN, NSET=COLUMN
1, 2
2, 3
*BEAM SECTION, ELSET=COLUMN, SECTION=STIFFNESS
108300., 1., , 1., 1E-5
*BOUNDARY
1, PINNED
3, PINNED
*IMPERFECTION, ELSET=COLUMN, SHAPE=SINE
-0.00039, 1
{second!r}, 2
*OBSTACLE, NAME=FLOOR, TYPE=LINE
-1., -0.039, 2., -0.039
*CONTACT, OBSTACLE=FLOOR, NSET=COLUMN
*STEP
*ACCURACY, TOLERANCE={tolerance!r}
*STATIC, METHOD=SPHERICAL
0.02, , 0.05
*TEMPERATURE
COLUMN, 1405.8344413666
*CLOAD
2, 2, -0.2925
*STOP
LOAD, ABOVE, 0.45
*END STEP
"""


@pytest.mark.parametrize("at, second, tolerance", [(0.51, 0.00195, 1e-4), (0.51, 0.00195, 1e-6), (0.49, -0.00195, 1e-5)])
def test_the_end_of_a_line_passes_a_pressed_node(at, second, tolerance):
    """Contact begins, and the line divides. At 0.38643 the end of the line passes the node: the load presses it down on both sides, so
    that nothing begins or ends there, and no couple may keep the end at the node."""
    critical = dr.run_deck(PRESSED.format(at=at, second=second, tolerance=tolerance)).results.critical
    assert [c.label for c in critical] == ["C+", "C-", "EP"]
    for event, load in zip(critical, [0.26974552, 0.37407859]):
        dr.assert_close(event.load_factor, load, absolute=event.error + 1e-8)

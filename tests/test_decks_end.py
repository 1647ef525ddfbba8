"""Decks come to their end: with the answer, or with what keeps them from it. What makes no progress is not tried again and again.

How long a run takes hangs on the machine; points, elements and words do not.
"""
import re

import numpy as np

import deck_runner as dr

# A point contact rolls to the free end of a stepped rod, which a moment at the end turns round an edge there.
ROLLED = """*HEADING
A stepped cantilever is turned round a drum by a moment at its end
*NODE
1, 0, 0
2, 0.5, 0
3, 1, 0
*LINE, ELSET=SOFT, NSET=ROD
1, 2
*LINE, ELSET=STIFF, NSET=ROD
2, 3
*BEAM SECTION, ELSET=SOFT, SECTION=STIFFNESS
1e4, 1
*BEAM SECTION, ELSET=STIFF, SECTION=STIFFNESS
1e4, 10
*BOUNDARY
1, ENCASTRE
*OBSTACLE, NAME=DRUM, TYPE=CIRCLE, SIDE=OUTSIDE
0, -1.1, 1
*CONTACT, OBSTACLE=DRUM, NSET=ROD
*MONITOR, NAME=v
3, U2, -1
*STEP
*STATIC, METHOD=LOAD
0.05
*CLOAD
3, 6, -30
*ACCURACY, TOLERANCE=1E-8
*END STEP
"""

# On a bed of its own shape and two supports the arch may lie with next to no gap: no element tells what touches.
BEDDED = """*HEADING
A hinged arch on a Winkler bed of its own shape
*NODE
1, -1, 0
2, 0, 0.3
3, 1, 0
*ARC, ELSET=ARCH, NSET=ARCH, DIRECTION=CLOCKWISE
1, 2, 0, {centre}
2, 3, 0, {centre}
*BEAM SECTION, ELSET=ARCH, SECTION=STIFFNESS
1e5, 1
*BOUNDARY
1, PINNED
3, PINNED
*OBSTACLE, NAME=BED, TYPE=CIRCLE, SIDE=OUTSIDE, FOUNDATION=WINKLER, MODULUS=100
0, {centre}, {radius}
*CONTACT, OBSTACLE=BED, NSET=ARCH
*MONITOR, NAME=v
2, U2, -1
*STEP
*STATIC
0.1, , 0.01
*DLOAD
ARCH, PY, -20
*STOP
v, ABOVE, 0.3
*ACCURACY, TOLERANCE=1E-5
*END STEP
"""

# The middle of the column is held at the wall by a force; where it buckles beside it no set of contacts is known.
PRESSED = """*HEADING
A hinged column with a node that is pressed on a wall
*NODE
1, 0, 0
2, 0.5, 0
3, 1, 0
*LINE, ELSET=COLUMN, NSET=COLUMN
1, 2
2, 3
*BEAM SECTION, ELSET=COLUMN, SECTION=STIFFNESS
1e6, 1
*BOUNDARY
1, PINNED
3, 2
*OBSTACLE, NAME=WALL, TYPE=LINE
0, -0.001, 1, -0.001
*CONTACT, OBSTACLE=WALL, NSET=COLUMN
*MONITOR, NAME=s
3, U1, -1
*STEP
*STATIC, METHOD=LOAD
0.1
*CLOAD
2, 2, -10
*ACCURACY, TOLERANCE=1E-2
*END STEP
*STEP
*STATIC
0.05, , 0.005
*CLOAD
3, 1, -2.467
*STOP
s, ABOVE, 0.05
*ACCURACY, TOLERANCE=1E-2
*END STEP
"""

# A column that lies on a flat without pressure: elements of a higher order have other unstable directions than any mesh.
LYING = """*HEADING
A clamped column along a wall
*NODE
1, 0, 0
2, 0.5, 0
3, 1, 0
*LINE, ELSET=COLUMN, NSET=COLUMN
1, 2
2, 3
*BEAM SECTION, ELSET=COLUMN, SECTION=STIFFNESS
{ea}, 1
*BOUNDARY
1, ENCASTRE
*OBSTACLE, NAME=WALL, TYPE=POLYLINE
-1, -0.2
0.3, 0
0.7, 0
2, -0.2
*CONTACT, OBSTACLE=WALL, NSET=COLUMN
*MONITOR, NAME=s
3, U1, -1
*STEP
*STATIC
0.05, , 0.005
*CLOAD
3, 1, -39.478
*STOP
LOAD, ABOVE, 20
*ACCURACY, TOLERANCE=1E-8
*END STEP
"""


def counted(run, words):
    """A number of the listing's table of costs."""
    return int(re.search(rf"^   {words} +(\d+)$", run.stdout, re.MULTILINE)[1])


def test_a_point_that_rolls_to_the_end_of_its_rod_is_there_once():
    """It was held at the end a little before it is there, let go again, and so on."""
    run = dr.run_deck(ROLLED)
    load = run.column("load_factor")
    assert load[-1] == 1.0 and np.all(np.diff(load) > 0.0)
    assert len(load) < 60


def test_a_mesh_that_is_finer_in_vain_is_given_back():
    """Each such point made it four times as fine, and the next ones began with that."""
    run = dr.run_deck(BEDDED.format(centre=0.3 - 1.09 / 0.6, radius=1.09 / 0.6), code=2)
    assert "the errors asked for are not reached" in run.stderr
    assert counted(run, "elements at the most") < 300


@dr.release_only
def test_nodes_are_asked_once_at_a_place():
    """What they said was a point of its own at the same load, with the same contacts; there they were asked again."""
    run = dr.run_deck(PRESSED, code=None)
    assert "the allowed number of points was used up" not in run.stderr
    assert np.count_nonzero(np.diff(run.column("load_factor")) == 0.0) < 10


@dr.release_only
def test_meshes_that_are_doubled_point_after_point_are_given_back():
    """Where no errors can be told the mesh is doubled; the next points began with that, and doubled it again."""
    run = dr.run_deck(LYING.format(ea="4.8e5"), code=2)
    assert run.column("load_factor")[-1] >= 20.0 * (1.0 - 1e-9)
    assert counted(run, "elements at the most") < 8192  # of one stretch of order 4 that is all rounding


TWO_STEPS = """*HEADING
Heated liner in a pipe: two steps with the same loads in other sizes
*NODE
1, 0, 25400
2, 0, -25400
*ARC, ELSET=LINER, NSET=LINER, DIRECTION=ANTICLOCKWISE
1, 2, 0, 0
*BEAM SECTION, ELSET=LINER, SECTION=STIFFNESS
3075.84, 2870962, , 1.751968503937e-07, 1e-05
*BOUNDARY
1, XSYMM
2, ENCASTRE
*OBSTACLE, NAME=PIPE, TYPE=CIRCLE, SIDE=INSIDE
0, 0, 25400
*CONTACT, OBSTACLE=PIPE, NSET=LINER, GAP=45.72
*IMPERFECTION, ELSET=LINER, SHAPE=COSINE
-9.6012, 2
*MONITOR, NAME=v
1, U2, -1
*MONITOR, NAME=thrust, ELSET=LINER
N, 12700
*STEP
*ACCURACY, TOLERANCE=1E-6
*STATIC, METHOD=LOAD
0.1, , 0.2
*TEMPERATURE
LINER, 180
*CLOAD
1, 2, -1.2905e-05
*END STEP
*STEP
*ACCURACY, TOLERANCE=1E-6
*STATIC, METHOD=CYLINDRICAL
0.1, , 0.02
*TEMPERATURE
LINER, 7300
*CLOAD
1, 2, -0.0002225
*STOP
LOAD, ABOVE, 1
*END STEP
"""


def test_a_step_does_not_return_to_the_one_before():
    """The mesh is made coarser at the end of the first step, and no increment converges from there. The finer mesh to which the run
    could return has the loads of the first step, whose end was then told twice."""
    ends = dr.run_deck(TWO_STEPS).labelled("EP")
    assert [(end.step, end.load_factor) for end in ends] == [(1, 1.0), (2, 1.0)]

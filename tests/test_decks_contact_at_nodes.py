"""Contact at nodes: the arch that snaps onto a floor.

A node of the arch meets the floor while the load falls; contact turns the path, so that the load has a minimum at this corner.
The equations know contact at nodes only: the corner is where the node's gap is zero, whatever the rod between the nodes does.
"""
import h5py
import numpy as np
import pytest

import deck_runner as dr

FLOOR = 0.5

ARCH = """*HEADING
Shallow arch, pushed onto a floor
*NODE
1, -0.8, 0.6
2, 0, 1
3, 0.8, 0.6
*ARC, ELSET=B, NSET=B, TYPE=GE8, DIRECTION=CLOCKWISE
1, 2, 0, 0, {elements}
2, 3, 0, 0, {elements}
*BOUNDARY
1, PINNED
3, PINNED
*OBSTACLE, NAME=FLOOR, TYPE=LINE
-3, {floor}, 3, {floor}
*CONTACT, OBSTACLE=FLOOR, NSET=B, POINTS=NODES
*BEAM SECTION, ELSET=B, SECTION=STIFFNESS
2500, 1
*MONITOR, NAME=crown
2, U2, 1
*STEP
*ACCURACY, TOLERANCE={tolerance}
*STATIC, METHOD=CYLINDRICAL
{first}, , 0.03
*CONTROLS, POINTS=300
*CLOAD
2, 2, -1
2, 1, {push}
*STOP
LOAD, ABOVE, 20
*FIELD OUTPUT
DISPLACEMENT, REACTION
*END STEP
"""


@pytest.mark.parametrize("elements, push", [(12, -0.016), (12, -0.02), (9, 0.011), (15, -0.014)])
def test_corner_where_a_node_meets_the_floor(elements, push):
    """All tolerances and increments find the same corner, C+ and LP; one node lies on the floor there, and none below it."""
    found = []
    for tolerance in ("1E-5", "1E-6", "1E-7"):
        for first in (0.1, 0.05):
            run = dr.run_deck(ARCH.format(elements=elements, push=push, tolerance=tolerance, first=first, floor=FLOOR))
            begins = run.labelled("C+")[0]
            assert begins.point in [limit.point for limit in run.labelled("LP")]
            heights = node_heights(run, begins.point)
            assert np.isclose(heights.min(), FLOOR, rtol=0, atol=1e-8)
            found.append(begins.load_factor)
    np.testing.assert_allclose(found, found[0], rtol=1e-7)


def node_heights(run, point):
    """Heights of the nodes at a point of the path."""
    with h5py.File(run.results.filename) as file:
        row = list(file["fields/point"]).index(point)
        return file["mesh/coordinates"][:, 1] + file["fields/displacement"][row, :, 1]

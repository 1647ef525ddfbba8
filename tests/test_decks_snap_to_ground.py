"""Arches that snap onto what lies below: a rigid floor stops the node that carries the load, after which only the load grows."""
import numpy as np
import pytest

import deck_runner as dr

ARCH = """*HEADING
Arch whose crown is pressed down onto a floor
*NODE
1, {x:.17g}, {y:.17g}
2, 0., 1.
3, {right:.17g}, {y:.17g}
*ARC, ELSET=ARCH, NSET=ARCH, DIRECTION=CLOCKWISE, TYPE={element}
1, 2, 0., 0.{count}
2, 3, 0., 0.{count}
*BEAM SECTION, ELSET=ARCH, SECTION=STIFFNESS
1E5, 1.
*BOUNDARY
1, ENCASTRE
3, ENCASTRE
*MONITOR, NAME=v
2, U2, -1.
*OBSTACLE, NAME=FLOOR, TYPE=LINE
-3., {floor:.17g}, 3., {floor:.17g}
*CONTACT, OBSTACLE=FLOOR, NSET=ARCH
*MONITOR, NAME=push, OBSTACLE=FLOOR
RN
*STEP
{accuracy}*STATIC, METHOD={method}
0.5, 1E-10, 0.03
*CLOAD
2, 2, -1.
*STOP
LOAD, ABOVE, 40.
*END STEP
"""


def arch(half_angle, depth, floor=True, count="", accuracy="*ACCURACY, TOLERANCE=1E-6\n", method="CYLINDRICAL", element="GE8"):
    x, y = -np.sin(half_angle), np.cos(half_angle)
    text = ARCH.format(x=x, y=y, right=-x, floor=1.0 - depth if floor else -9.0, count=count, accuracy=accuracy,
                       method=method, element=element)
    return text if floor else text.replace("LOAD, ABOVE, 40.", f"v, ABOVE, {depth:.17g}")


# Where the crown comes down the load of the free arch still falls, or rises again behind its second limit point.
FALLING, RISING = (1.0, 0.5), (1.0, 0.8)


@pytest.mark.parametrize("half_angle, depth", [FALLING, RISING])
@pytest.mark.parametrize("method, mesh", [("CYLINDRICAL", {}), ("SPHERICAL", {}), ("LINEARISED", {"count": ", 12", "accuracy": ""}),
                                          ("CYLINDRICAL", {"count": ", 48", "accuracy": "", "element": "GE4"})],
                         ids=["asked", "spherical", "given", "GE4"])
def test_a_load_on_a_contact_of_its_own(half_angle, depth, method, mesh):
    """The free arch has the load of the touch. Behind it nothing moves, and what the load grows by is the floor's."""
    free = dr.run_deck(arch(half_angle, depth, floor=False, method=method, **mesh))
    run = dr.run_deck(arch(half_angle, depth, method=method, **mesh))
    touch, end = run.only("C+"), run.only("EP")
    assert abs(touch.load_factor - free.only("EP").load_factor) <= touch.error + free.only("EP").error
    # Where the load of the free arch falls it is least at the touch.
    least = [touch.load_factor] if (half_angle, depth) == FALLING else []
    assert [c.load_factor for c in run.labelled("LP")] == pytest.approx([c.load_factor for c in free.labelled("LP")] + least, rel=1e-5)
    dr.assert_close(end.load_factor, 40.0, relative=1e-12)
    pressed = slice(touch.point, None)
    v, push, load = (run.column(name)[pressed] for name in ("v", "push", "load_factor"))
    assert len(v) > 2
    assert abs(v - depth).max() <= 1e-9
    assert abs(push - (load - touch.load_factor)).max() <= touch.error + end.monitor_errors["push"]


PIPE = """*HEADING
Pipe on a rigid bed, pushed down at a node
*NODE
1, 0., 0.
2, 2., 0.
3, 5., 0.
*LINE, ELSET=PIPE, NSET=PIPE, TYPE=GE8
1, 2
2, 3
*BEAM SECTION, ELSET=PIPE, SECTION=STIFFNESS
1E5, 1.
*BOUNDARY
2, 1
*OBSTACLE, NAME=BED, TYPE=LINE
0., 0., 1., 0.
*CONTACT, OBSTACLE=BED, NSET=PIPE
*MONITOR, NAME=push, OBSTACLE=BED
RN
*STEP
*ACCURACY, TOLERANCE=1E-6
*STATIC, METHOD=LOAD
1.
*DLOAD
PIPE, PY, -0.5
*END STEP
*STEP
*STATIC
0.1
*CLOAD
2, 2, -7.
*STOP
LOAD, ABOVE, 1.
*END STEP
"""


def test_a_load_that_moves_nothing():
    """By arc length, too, the bed takes all of it: the weight, and then the load."""
    run = dr.run_deck(PIPE)
    weight, end = run.labelled("EP")
    assert run.labelled("C-") == []
    dr.assert_close(weight.monitors["push"], 2.5, relative=1e-9)
    dr.assert_close(end.load_factor, 1.0, relative=1e-12)
    dr.assert_close(end.monitors["push"], 9.5, relative=1e-9)


SOIL = """*HEADING
Shallow arch over soil
*NODE
1, -0.5, 0.
2, 0., 0.1
3, 0.5, 0.
*ARC, ELSET=ARCH, NSET=ARCH, TYPE=GE8, DIRECTION=CLOCKWISE
1, 2, 0., -1.2, 6
2, 3, 0., -1.2, 6
*BEAM SECTION, ELSET=ARCH, SECTION=STIFFNESS
3600., 1.
*BOUNDARY
1, PINNED
3, PINNED
2, 1
2, 6
*OBSTACLE, NAME=SOIL, TYPE=LINE, FOUNDATION=WINKLER, MODULUS=1E5
-2., {height}, 2., {height}
*CONTACT, OBSTACLE=SOIL, NSET=ARCH
*MONITOR, NAME=v
2, U2, -1.
*STEP
*STATIC, METHOD={method}
{first}
*CLOAD
2, 2, -20.
*STOP
{stop}
*END STEP
"""


@pytest.mark.parametrize("height", [-0.06, -0.03, -0.001])
@pytest.mark.parametrize("first", [0.01, 0.1, 1.0])
def test_a_snap_onto_soil_is_no_corner_of_the_path(height, first):
    """Under load control the equilibrium that Newton's method finds beyond the limit point rests on the soil: another contact set, as
    at a corner. The run stops at the limit point of the arch, and says so."""
    run = dr.run_deck(SOIL.format(height=height, method="LOAD", first=first, stop="LOAD, ABOVE, 1."), code=2)
    point = dr.run_deck(SOIL.format(height=height, method="CYLINDRICAL", first="0.1, , 0.01", stop="v, ABOVE, 0.06")).only("LP")
    assert run.column("load_factor").max() <= point.load_factor * (1.0 + 1e-9)
    dr.assert_close(run.column("load_factor")[-1], point.load_factor, relative=1e-4)
    assert not run.labelled("C+")

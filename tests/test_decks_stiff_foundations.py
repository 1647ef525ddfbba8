"""The ring on foundations from soft to as good as rigid: frozen tangents, tiny first increments, and where elements end.

From the start every gap is zero, so that to first order the first increment has no scale: whatever its length, the same elements
touch, and a Newton iteration that is too slow for one length is for all.
"""
import functools

import pytest

import deck_runner as dr

# 160 GE4 of h = pi/160: k h^4/EI = 144, what the stability function of order 4 follows, at k R^4/EI = 9.7e8
RING = """*HEADING
ring on a foundation
*NODE
1, 0., 1.
2, 0., -1.
*ARC, ELSET=RING, NSET=RING, TYPE={element}
1, 2, 0., 0., 160
*BEAM SECTION, ELSET=RING, SECTION=STIFFNESS
120000., 1.
*BOUNDARY
1, XSYMM
2, XSYMM
*OBSTACLE, NAME=MEDIUM, TYPE=CIRCLE, SIDE=INSIDE{foundation}
0., 0., 1.
*CONTACT, OBSTACLE=MEDIUM, NSET=RING, POINTS={points}
*MONITOR, NAME=v
1, U2, -1.
*STEP
*STATIC, METHOD={method}
{first!r}, 1E-9, 0.02
*DLOAD
RING, PY, -1.
*STOP
v, ABOVE, {stop}
*END STEP
"""


def ring(k, method="CYLINDRICAL", first=1.0, points="ALONG", element="GE4", code=0):
    foundation = "" if k is None else f", FOUNDATION=WINKLER, MODULUS={k!r}"
    return dr.run_deck(RING.format(foundation=foundation, points=points, method=method, first=first, element=element,
                               stop=0.04 if k is None or k > 1e5 else 0.2), code=code)


@functools.cache
def limit_load(k, **options):
    return ring(k, **options).load("LP")


@pytest.mark.parametrize("k, newton", [(1e4, "ONCE"), (1e7, "MODIFIED")])
def test_frozen_tangents(k, newton):
    """The ends of contact move while Newton's method goes on; located limit points are those of the full one."""
    frozen = ring(k, f"CYLINDRICAL, NEWTON={newton}", element="GE6")
    dr.assert_close(frozen.load("LP"), limit_load(k, element="GE6"), relative=1e-8)


@pytest.mark.parametrize("k, first", [(1e4, 1e-8), (1e6, 1e-4), (1e8, 1e-8)])
def test_first_increments(k, first):
    """k times the rounding of positions is up to 1e-8 of forces: all of the first load. Gaps come from displacements."""
    run = ring(k, first=first)
    dr.assert_close(run.column("load_factor")[1], first, relative=1e-12)
    dr.assert_close(run.load("LP"), limit_load(k), relative=1e-8)


@pytest.mark.parametrize("method", ["SPHERICAL", "LINEARISED", "LARGEST DISPLACEMENT"])
def test_first_increments_of_other_strategies(method):
    dr.assert_close(ring(1e6, method, first=1e-6).load("LP"), limit_load(1e6), relative=1e-8)


@pytest.mark.parametrize("points", ["ALONG", "NODES"])
def test_the_first_increment_has_no_scale(points):
    """The displacements of two tiny loads are in their ratio, but for the path's curvature over the larger one."""
    larger, smaller = (ring(1e6, first=first, points=points).column("v")[1] for first in (1e-3, 1e-6))
    dr.assert_close(larger / smaller, 1e3, relative=1e-5)


@pytest.mark.parametrize("k", [1e12, 1e16])
def test_nodes_tend_to_the_rigid_ring(k):
    """p R/k of penetration, 1e-10 R and less, beside v = 0.036 R: the rigid limit load to 1e-6."""
    dr.assert_close(limit_load(k, points="NODES"), limit_load(None, points="NODES"), relative=1e-6)


# A ring shrinks away from stiff ground, and its own weight and a force press it to the bottom: the ends of contact are far from the
# first guess, and the first point is found on softer ground.
SHRINKING = """*HEADING
ring that shrinks on stiff ground
*NODE
1, 0., 1.
2, 0., -1.
*ARC, ELSET=RING, NSET=RING
1, 2, 0., 0.
*BEAM SECTION, ELSET=RING, SECTION=STIFFNESS
4800., 1.
*BOUNDARY
1, XSYMM
2, XSYMM
*OBSTACLE, NAME=BED, TYPE=CIRCLE, FOUNDATION=WINKLER, MODULUS=24000
0., 0., 1.
*CONTACT, OBSTACLE=BED, NSET=RING
*MONITOR, NAME=v
1, U2, -1.
*STEP
*STATIC
{first!r}, , 0.05
*DLOAD
RING, P, 300.
*CLOAD
1, 2, -2.58
*STOP
v, ABOVE, 0.3
*END STEP
"""


@pytest.mark.parametrize("first", [0.1, 0.05])
def test_a_first_increment_that_is_too_long_is_repeated_from_softer_ground(first):
    """A first increment that has to be cut begins as a shorter one does; the mesh of the long one has its ends of contact elsewhere."""
    short = dr.run_deck(SHRINKING.format(first=0.01))
    long = dr.run_deck(SHRINKING.format(first=first))
    assert [row.label for row in long.results.critical] == [row.label for row in short.results.critical]
    dr.assert_close(long.load("EP"), short.load("EP"), relative=2e-6)   # TOLERANCE, twice

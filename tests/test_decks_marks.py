"""The ring in a tensionless medium with the ends of its contact, and the corners of the medium's law, as points of the mesh:
order, bars, meshes made for a tolerance.

Exact: extrema of the load on k R^4/EI = 1e3 to 1e8, R/h = 100, to eleven digits (reference/ring_winkler_critical.csv). The elements
that the program adds beside an end of contact are not those of the deck: orders are measured where it adds none.
"""
import functools
import math

import h5py
import numpy as np
import pytest

import deck_runner as dr

RIGID = 81.557427564661
LIMIT = {1e3: 13.28648196568, 1e5: 58.99056700141, 3.6e6: 80.35789295248, 1e8: 81.50496807413}
RING = """*HEADING
ring on a foundation, equal elements or none given
*NODE
1, 0., 1.
2, 0., -1.
*ARC, ELSET=RING, NSET=RING, TYPE={element}
1, 2, 0., 0.{count}
*BEAM SECTION, ELSET=RING, SECTION=STIFFNESS
120000., 1.
*BOUNDARY
1, XSYMM
2, XSYMM
*OBSTACLE, NAME=MEDIUM, TYPE=CIRCLE, SIDE=INSIDE, FOUNDATION=WINKLER, MODULUS={k!r}
0., 0., 1.
*CONTACT, OBSTACLE=MEDIUM, NSET=RING
*MONITOR, NAME=v
1, U2, -1.
*STEP
*STATIC, METHOD=CYLINDRICAL
1., 1E-9, 0.02
*DLOAD
RING, PY, -1.
{accuracy}*STOP
v, ABOVE, {stop}
*END STEP
"""


# Where contact splits on very stiff ground given meshes may tell by wide bars only; limit points are what is asked of them.
WIDE = "*ACCURACY, WIDEST=1\n"


@functools.cache
def limit(k, elements=None, element="GE8", tolerance=None):
    text = RING.format(k=k, element=element, count=f", {elements}" if elements else "", stop=0.3 if k < 1e4 else 0.06,
                       accuracy=f"*ACCURACY, TOLERANCE={tolerance}\n" if tolerance else WIDE)
    points = dr.run_deck(text).labelled("LP")
    assert len(points) == 1
    return points[0]


@pytest.mark.parametrize("k, elements", [(1e5, 16), (1e5, 32), (3.6e6, 16), (3.6e6, 32), (1e8, 16), (1e8, 32)])
def test_bars_hold(k, elements):
    """Each critical load has a bar, which its error keeps; the corrected value is a hundred times better."""
    point = limit(k, elements)
    error = abs(point.load_factor - LIMIT[k])
    assert 0.0 < error <= point.error < 1e-5 * LIMIT[k]
    assert abs(point.corrected - LIMIT[k]) <= 0.01 * error + 1e-10 * LIMIT[k]


@dr.release_only
@pytest.mark.parametrize("element, order, counts", [("GE4", 4.0, (32, 64, 128)), ("GE6", 6.0, (16, 32, 64)), ("GE8", 8.0, (16, 32, 64))])
def test_order(element, order, counts):
    """With a kink inside an element the fifth derivative would jump there: no more than the fifth order, and no steady one. The
    last error of GE8 is that of the reference's digits."""
    errors = [limit(1e3, n, element).load_factor / LIMIT[1e3] - 1.0 for n in counts]
    dr.assert_mean_order(errors, order, below=0.5, above=2.0 if element == "GE8" else 0.7)


@pytest.mark.parametrize("k", [1e5, 3.6e6, 1e8])
def test_no_elements_given(k):
    point = limit(k, tolerance=1e-6)
    assert abs(point.load_factor - LIMIT[k]) <= point.error <= 1e-6 * LIMIT[k]
    np.testing.assert_allclose(point.load_factor, LIMIT[k], rtol=1e-6)


@dr.release_only
def test_stiffer_ground_tends_to_the_rigid_cavity():
    """k R^4/EI = 1e12 and 1e14: monotone to the rigid load, each within its bar of what another mesh says. What is missing there falls with
    the layer's stiffness EI/l^3, that is with k^(3/4)."""
    stiffness = np.array([1e12, 1e14])
    values = []
    for k in stiffness:
        one, other = limit(k, 32), limit(k, 48)
        assert abs(one.load_factor - other.corrected) <= one.error < 1e-7 * RIGID
        assert abs(one.corrected - other.corrected) < 2e-10 * RIGID
        values.append(other.corrected)
    dr.assert_monotone([LIMIT[1e8], *values, RIGID], rising=True)
    lack = RIGID - np.array(values)
    np.testing.assert_allclose(lack[-1] / lack[-2], 100.0**-0.75, rtol=0.3)


@dr.release_only
@pytest.mark.parametrize("k, elements", [(1e15, 48), (1e16, None)])
def test_the_stiffest_ground(k, elements):
    """All is delivered as it is asked, the displacement at the limit point, too, which is located on the tangent: to 1e-5, as rounding
    takes 3e-6 of it. What the load lacks of the rigid one is the layer's."""
    point = limit(k, elements, tolerance=None if elements else 1e-5)
    expected = (RIGID - limit(1e14, 48).corrected) * (k / 1e14)**-0.75
    assert point.error < 1e-6 * RIGID
    np.testing.assert_allclose(RIGID - point.corrected, expected, rtol=0.05 if elements else 0.1)


def test_contact_that_splits_behind_its_end_is_told_as_that():
    """The end of contact moves by more than the length of what splits off: regions are compared where the mesh has taken them.
    65.91675634 is what meshes for 1e-3 to 1e-8 agree in. (Given meshes share the elements beside the mark, and what these err by.)"""
    run = dr.run_deck(RING.format(k=3e9, element="GE8", count=", 24", stop=0.03, accuracy=""))
    assert not run.labelled("C+") and len(run.labelled("C-")) == 1
    point, = run.labelled("C-")
    assert point.note == "a contact region splits"
    assert abs(point.load_factor - 65.91675634) <= point.error <= 0.02


@dr.release_only
@pytest.mark.parametrize("tolerance", [1e-5, 1e-7])
def test_splits_of_contact_are_as_good_as_asked(tolerance):
    """The gap is least inside an element, several layers from the end of contact, and opens by little per load. A bar that is narrow
    enough, but has no bounds, ends with inf."""
    run = dr.run_deck(RING.format(k=3e9, element="GE8", count="", stop=0.02, accuracy=f"*ACCURACY, TOLERANCE={tolerance}\n"))
    point = run.only("C-")
    assert abs(point.load_factor - 65.91675634) <= min(point.error + 1e-8, tolerance * point.load_factor)
    assert point.error <= tolerance * point.load_factor or math.isinf(point.error)


@pytest.mark.parametrize("increments, before", [(9, 3e-4), (9, 1e-4), (6, 3e-5)])
def test_a_point_of_the_path_just_before_a_split(increments, before):
    """The mesh that is good enough for the split is another one than that of the point: from this Newton's method may not settle on
    it, but does on a finer one."""
    first = 65.91675634 * (1.0 - before) / increments
    text = RING.format(k=3e9, element="GE8", count="", stop=0.02, accuracy="*ACCURACY, TOLERANCE=1E-5\n")
    run = dr.run_deck(dr.changed(text, ("METHOD=CYLINDRICAL", "METHOD=LOAD"), ("1., 1E-9, 0.02", f"{first!r}, 1E-9, {first!r}")))
    point = run.only("C-")
    # The remainder of Newton's iteration, a few 1e-9 of the load, is not in the bar.
    assert abs(point.load_factor - 65.91675634) <= min(point.error + 3e-9 * point.load_factor, 1e-5 * point.load_factor)


@dr.release_only
@pytest.mark.parametrize("k", [1e12])
def test_no_elements_given_on_stiff_ground(k):
    """The corrected load is within its bar of that of a given mesh."""
    point, other = limit(k, tolerance=1e-6), limit(k, 32)
    assert abs(point.load_factor - other.corrected) <= point.error <= 1e-6 * RIGID


@pytest.mark.parametrize("stop", [1e-4, 3e-4])
def test_a_start_on_ground_of_any_stiffness(stop):
    """Elements that are too long for it tell nothing of stability there: that on softer ground does. Of the first increments a ring
    feels no softness: R/h = 100 on ground of 1e15 and on rigid ground. The stop may lie inside the first increment."""
    text = RING.format(k=1e15, element="GE8", count="", stop=stop, accuracy="*ACCURACY, TOLERANCE=1E-6\n")
    rigid = text.replace(", FOUNDATION=WINKLER, MODULUS=1000000000000000.0", "")
    ends = [dr.run_deck(deck).only("EP") for deck in (text, rigid)]
    assert abs(ends[0].load_factor - ends[1].load_factor) < 1e-6 * ends[1].load_factor


# Pressure over penetration: it yields, hardens, has three stiffnesses.
LAWS = {"yields": "1e-2, 1e2\n2e-2, 1.2e2", "hardens": "5e-3, 10.\n1e-2, 110.", "three": "2e-3, 40.\n1e-2, 80.\n2e-2, 90."}


def law_ring(law, count="", accuracy=""):
    text = RING.format(k=1.0, element="GE8", count=count, stop=0.15, accuracy=accuracy)
    return dr.run_deck(dr.changed(text, ("FOUNDATION=WINKLER, MODULUS=1.0", "FOUNDATION=LAW, LAW=SOIL"),
                                  ("*OBSTACLE", f"*FOUNDATION LAW, NAME=SOIL\n0., 0.\n{LAWS[law]}\n*OBSTACLE")))


@pytest.mark.parametrize("law", [pytest.param(law, marks=dr.release_only) if law == "three" else law for law in LAWS])
def test_corners_of_laws_are_points_of_the_mesh(law):
    """The extrema on two meshes agree to 1e-9 where their bars say so, and the mesh that the program makes delivers 1e-6."""
    coarse, fine = (law_ring(law, f", {n}") for n in (32, 48))
    asked = law_ring(law, accuracy="*ACCURACY, TOLERANCE=1E-6\n")
    for label in ("LP", "C-", "EP"):
        ends = [run.labelled(label) for run in (coarse, fine, asked)]
        assert len(ends[0]) == len(ends[1]) == len(ends[2])
        for one, two, made in zip(*ends):
            assert 0.0 < two.error < 1e-6 * two.load_factor
            for run in (one, made):
                # Newton's method stops at 1e-9.
                assert abs(run.load_factor - two.load_factor) <= run.error + two.error + 1e-10 * two.load_factor
            assert made.error <= 1e-6 * max(end.load_factor for end in asked.results.critical)


def test_reactions_at_the_nodes_of_the_deck():
    """They add up to the whole of the contact, and at the limit point the largest of them, at the bottom, is the exact 340.133172173 to what
    a millionth of the largest displacement is worth on this ground, 3.6e6 * 1e-6 * 0.036."""
    run = dr.run_deck(dr.example("ring-winkler"))
    with h5py.File(run.results.filename) as file:
        point = file["fields/point"][:] - 1
        np.testing.assert_allclose(file["fields/reaction"][:].sum(1), file["contact/reaction_total"][:, 0][point], rtol=1e-12, atol=1e-12)
        (row,) = np.flatnonzero(point == run.only("LP").point - 1)
        density = file["fields/reaction_density"][row]
    np.testing.assert_allclose(np.nanmax(density), 340.133172173, atol=0.13)
    assert np.nanargmax(density) == density.size - 1


ARCH_IN_ITS_BED = """*HEADING
Arch that fits its soil, loaded off the middle
*NODE
1, -0.5, 0.
2, 0.1, 0.19307033081725355
3, 0.5, 0.
*ARC, ELSET=ARCH, NSET=ARCH, TYPE=GE8, DIRECTION=CLOCKWISE
1, 2, 0., -0.525
2, 3, 0., -0.525
*BEAM SECTION, ELSET=ARCH, SECTION=STIFFNESS
6000., 1.
*BOUNDARY
1, PINNED
3, PINNED
*OBSTACLE, NAME=SOIL, TYPE=CIRCLE, SIDE=INSIDE, FOUNDATION=WINKLER, MODULUS=3000.
0., -0.525, 0.725
*CONTACT, OBSTACLE=SOIL, NSET=ARCH
*MONITOR, NAME=v
2, U2, -1.
*STEP
*ACCURACY, TOLERANCE={tolerance}
*STATIC, METHOD=CYLINDRICAL
0.5, , 0.02
*CLOAD
2, 2, -1.
*STOP
v, ABOVE, 0.1
*END STEP
"""


@pytest.mark.parametrize("tolerance", [1e-2, 1e-4])
def test_contact_that_ends_where_the_last_point_got_another_mesh(tolerance):
    """What is told of it may not do, and the run says so; the limit point is right."""
    run = dr.run_deck(ARCH_IN_ITS_BED.format(tolerance=tolerance), code=None)
    assert run.code in (0, 2)
    dr.assert_close(run.load("LP"), 25.753654836, relative=tolerance)

"""Rough imperfections beside walls and in cavities: many contacts, which come, divide, come together and go.

Every run has to come to its end with contact spans; their own checks tell penetration, pull and balance. Events do not hang on
the order of the elements.
"""
import functools
import random

import numpy as np
import pytest

import deck_runner as dr

pytestmark = dr.once_in_release

COLUMN = """*HEADING
Rough column beside walls
*NODE
1, 0., 0.
2, 1., 0.
*LINE, ELSET=S, NSET=S, TYPE={kind}
1, 2, {elements}
*BEAM SECTION, ELSET=S, SECTION=STIFFNESS
1e6, 1.
*IMPERFECTION, ELSET=S, SHAPE={shape}
{imperfection}
*BOUNDARY
{supports}
*OBSTACLE, NAME=UPPER, TYPE=LINE
1., 0.02, 0., 0.02
*CONTACT, OBSTACLE=UPPER, NSET=S
*OBSTACLE, NAME=LOWER, TYPE=LINE
0., -0.02, 1., -0.02
*CONTACT, OBSTACLE=LOWER, NSET=S
*STEP
*STATIC
0.05
** The paths are looked at here, not what the mesh is worth beside limit points.
*ACCURACY, POINTS=NONE
*CLOAD
2, 1, -9.8696044
*STOP
LOAD, ABOVE, 20.
*END STEP
"""
HINGED, CLAMPED = "1, PINNED\n2, 2", "1, ENCASTRE\n2, YSYMM"
LINER = """*HEADING
Rough liner, held at its bottom
*NODE
1, 0., 1.
2, 0., -1.
*ARC, ELSET=RING, NSET=LINER, TYPE=GE8
1, 2, 0., 0., 24
*BEAM SECTION, ELSET=RING, SECTION=STIFFNESS
30000., 1.
*IMPERFECTION, ELSET=RING, SHAPE=COSINE
{imperfection}
*BOUNDARY
1, XSYMM
2, ENCASTRE
*OBSTACLE, NAME=HOST, TYPE=CIRCLE, SIDE=INSIDE
0., 0., {radius!r}
*CONTACT, OBSTACLE=HOST, NSET=LINER
*MONITOR, NAME=v
1, U2, -1.
*STEP
*STATIC
1.
*CLOAD
1, 2, -1e-3
*DLOAD
RING, PY, -1.
*STOP
v, ABOVE, 0.3
*END STEP
"""


def waves(seed, amplitude):
    """Six sines of random amplitudes, which fall with their number."""
    draw = random.Random(seed)
    return "\n".join(f"{amplitude * draw.uniform(-1, 1) / n!r}, {n}" for n in range(1, 7))


@functools.cache
def column(seed, amplitude, supports=HINGED, kind="GE8", elements=16):
    run = dr.run_deck(COLUMN.format(kind=kind, elements=elements, shape="SINE", imperfection=waves(seed, amplitude),
                                    supports=supports))
    assert "do not get on" not in run.stdout
    return run


@pytest.mark.parametrize("seed, amplitude, supports", [(2, 0.002, HINGED), (3, 0.002, HINGED), (3, 0.002, CLAMPED),
                                                       (4, 0.008, CLAMPED)])
def test_columns(seed, amplitude, supports):
    """To 20 Pcr."""
    assert column(seed, amplitude, supports).results.complete


def test_a_contact_that_is_lost_beside_another():
    """The other point keeps its force, which holds it from turning: the load falls from there at the rate at which it goes on."""
    run = dr.run_deck(COLUMN.format(kind="GE8", elements=16, shape="RANDOM, SEED=1", imperfection="0.001", supports=CLAMPED))
    assert "do not get on" not in run.stdout
    lost = run.labelled("C-")[0]
    assert run.results.contact.count[lost.point - 1] == 2 and run.results.contact.count[lost.point] == 1
    assert run.column("load_factor")[lost.point] < lost.load_factor


def random_column(seed, amplitude, supports, first=0.05):
    run = dr.run_deck(COLUMN.format(kind="GE8", elements=16, shape=f"RANDOM, SEED={seed}", imperfection=amplitude,
                                    supports=supports).replace("0.05\n", f"{first}\n", 1))
    assert run.results.complete and "do not get on" not in run.stdout
    return run


@pytest.mark.parametrize("seed, amplitude, supports", [(1012, 0.0005, CLAMPED), (2004, 0.0005, HINGED), (2005, 0.0005, HINGED), (5022, 0.002, CLAMPED),
                                                       (1014, 0.002, CLAMPED), (1034, 0.002, HINGED)])
@dr.release_only
def test_contact_begins_next_to_a_point(seed, amplitude, supports):
    """A point that is about to become as curved as its wall, with the rod inside the wall on one side of it before that."""
    random_column(seed, amplitude, supports)


@pytest.mark.parametrize("seed, amplitude, supports", [(2007, 0.0005, CLAMPED), (2010, 0.002, CLAMPED), (5028, 0.0005, CLAMPED)])
@dr.release_only
def test_lines_on_rough_rods(seed, amplitude, supports):
    """A spline whose third derivative jumps has forces at its knots where it lies straight, to either side, and none between."""
    random_column(seed, amplitude, supports)


@pytest.mark.parametrize("seed, amplitude, supports", [(2006, 0.0005, CLAMPED), (5020, 0.002, HINGED)])
@dr.release_only
def test_points_of_a_divided_one_that_would_pull(seed, amplitude, supports):
    """The rod comes down beside a point just before that is flat, by less than is told: two points begin where both push. Nearer to
    one another one of them pulls, and the path led back over the points that it had come from."""
    random_column(seed, amplitude, supports)


def test_a_limit_point_just_behind_a_spreading_contact():
    """The first length that has an equilibrium lies behind the limit point, a shorter one before it. The load with its bar is that of
    the same deck with error bars."""
    first = random_column(2007, 0.0005, CLAMPED).labelled("LP")[0]
    dr.assert_close(first.load_factor, 19.5456223, absolute=1.5e-6)


def test_gaps_between_samples():
    """Where the gap beside a point is largest and least, samples that halve the way had the same gap on both sides."""
    random_column(2013, 0.002, HINGED)


def test_a_force_that_begins_and_goes_on_the_same_increment():
    """It grows at first, so the place where it is gone is not the one where it began, from which the path led back to no load."""
    loads = random_column(2011, 0.002, HINGED).column("load_factor")
    assert np.all(loads[16:] > 3.0)


@dr.release_only
def test_events_do_not_hang_on_increments():
    """A point that is lost and regained, a point that is lost while contact begins further on: longer increments passed them, for at
    both ends all was well."""
    events = [[(c.label, c.load_factor) for c in random_column(106, 0.002, HINGED, first).results.critical]
              for first in (0.02, 0.05, 0.2)]
    for other in events[1:]:
        assert [label for label, _ in other] == [label for label, _ in events[0]]
        dr.assert_close([load for _, load in other], [load for _, load in events[0]], relative=1e-4)


def come_together(run):
    """The first place where two neighbouring points are one afterwards."""
    contact = run.results.contact
    for critical in run.labelled("C+"):
        row = critical.point - 1
        if contact.count[row] == contact.count[row - 1] - 1 and np.all(contact.start[row] == contact.end[row], where=np.arange(
                contact.start.shape[1]) < contact.count[row]):
            return critical, row
    raise AssertionError("no two points have come together")


@dr.release_only
def test_two_points_come_together():
    """At a load and a place that are those of other meshes, where one point has been two; the path goes on with the one."""
    critical, row = come_together(column(3, 0.008))
    contact = column(3, 0.008).results.contact
    assert contact.count[row + 1] == contact.count[row]
    for kind, elements in (("GE8", 40), ("GE6", 32)):
        run = column(3, 0.008, HINGED, kind, elements)
        other, there = come_together(run)
        dr.assert_close(other.load_factor, critical.load_factor, relative=1e-6)
        dr.assert_close(run.results.contact.start[there, 0], contact.start[row, 0], absolute=1e-5)


def assert_changes_are_told(run):
    """The number of contacts changes at events only."""
    count = run.results.contact.count
    told = {critical.point for critical in run.results.critical if critical.label in ("C+", "C-")}
    untold = [row for row in range(1, len(count)) if count[row] != count[row - 1] and not told & {row, row + 1}]
    assert not untold, f"{[(int(count[row - 1]), int(count[row])) for row in untold]} contacts before and at rows {untold}"


@functools.cache
def rough_liner(seed, scale, elements):
    draw = random.Random(seed)
    amplitude = [scale * draw.uniform(-1, 1) / np.sqrt(1.0 + n) for n in range(8)]
    text = LINER.format(imperfection="\n".join(f"{a!r}, {n}" for n, a in enumerate(amplitude, 2)),
                        radius=1.001 + sum(map(abs, amplitude)))
    run = dr.run_deck(dr.changed(text, ("0., 0., 24", f"0., 0., {elements}")))
    assert run.results.complete and "do not get on" not in run.stdout
    assert_changes_are_told(run)
    return run


@dr.release_only
@pytest.mark.parametrize("seed, scale", [(1, 5e-4), (4, 5e-4), (15, 5e-4), (5026, 1e-3), (1013, 2e-3), (5020, 1e-3)])
def test_rough_liners(seed, scale):
    """Eight waves against the host; in contact the pressure follows them, and balances the loads.

    The last two have short spans between two lines, whose ends hold next to nothing: the line of both presses from there on.
    """
    rough_liner(seed, scale, 24)


def test_spans_close_between_two_lines():
    """A span that has nearly gone holds nothing by its ends, wherever they are: it is none, and lines become one where the pressure is
    above zero all along, between the nodes, too: at the same loads whatever the elements. With the pressure at five places of each of
    24, 48, 96 and 192 elements it seemed to be so from 1.38626, 1.39478, 1.39822 and 1.39927 on."""
    loads = [[c.load_factor for c in rough_liner(5003, 2e-3, elements).labelled("C+")] for elements in (24, 48)]
    dr.assert_close(loads[0], loads[1], relative=1e-7)
    dr.assert_close(loads[0][2:], [1.39928143, 1.45010336], relative=1e-7)


@pytest.mark.parametrize("seed, scale, elements", [(5026, 1e-3, (24, 48)), (5027, 2e-3, (24, 48))])
def test_a_span_closes_at_a_load_with_a_bar(seed, scale, elements):
    """The set without a closing span is followed back to the load at which its pressure is zero. This load has an error bar, and other
    meshes have it within the sum of both bars. The lost contact of the second liner comes back at 7.35724; its pressure is least beside
    an end of the line, nearer to it than a quarter of one of 24 elements."""
    coarse, fine = ([c for c in rough_liner(seed, scale, n).results.critical if c.label in ("C+", "C-")] for n in elements)
    assert [c.label for c in coarse] == [c.label for c in fine]
    for one, other in zip(coarse, fine):
        assert 0.0 < one.error < 1e-6 * one.load_factor
        dr.assert_close(one.load_factor, other.load_factor, absolute=one.error + other.error)


FLOOR = """*HEADING
Wavy rod on a floor
*NODE
1, 0., 0.
2, 1., 0.
*LINE, ELSET=S, NSET=S, TYPE=GE8
1, 2, {elements}
*BEAM SECTION, ELSET=S, SECTION=STIFFNESS
1e7, 1.
*IMPERFECTION, ELSET=S, SHAPE=SINE
{waves}
*BOUNDARY
1, PINNED
2, 2
*OBSTACLE, NAME=FLOOR, TYPE=LINE
0., -0.008, 1., -0.008
*CONTACT, OBSTACLE=FLOOR, NSET=S
*STEP
*STATIC
0.1
*DLOAD
S, PY, -1.
*STOP
LOAD, ABOVE, 1000.
*END STEP
"""


@dr.release_only
def test_waves_shorter_than_elements():
    """A rod on its obstacle needs no short elements: several waves of its stress-free shape lie on one, and the pressure has as many
    minima. With five places of each of six elements the last spans closed at 628.2, 713.4, 731.0 and 829.4, two of them together."""
    draw = random.Random(3)
    waves = "\n".join(f"{5e-4 * draw.uniform(-1, 1) * (9.0 / n)**4!r}, {n}" for n in range(14, 22))
    loads = [c.load_factor for c in dr.run_deck(FLOOR.format(elements=6, waves=waves)).labelled("C+") if c.load_factor > 300.0]
    # The same with 48 elements.
    dr.assert_close(loads, [360.443358, 463.766267, 609.797904, 628.077499, 707.762663, 731.011617], relative=1e-7)


@pytest.mark.parametrize("elements", [24, 48])
def test_a_point_spreads_before_the_first_increment_behind_a_change(elements):
    """Soon after the line opens at 88.165 a point spreads, nearer than the equilibrium from which increments go on. A neighbour moves
    meanwhile by more than a new contact is long: no contact is gained."""
    draw = random.Random(3)
    waves = "\n".join(f"{5e-4 * draw.uniform(-1, 1) * (9.0 / n)**4!r}, {n}" for n in range(14, 22))
    run = dr.run_deck(dr.changed(FLOOR.format(elements=elements, waves=waves), ("LOAD, ABOVE, 1000.", "LOAD, ABOVE, 120.")))
    assert [c.label for c in run.results.critical if c.load_factor > 60.0] == ["C-", "EP"]
    loads, count = run.column("load_factor"), run.results.contact.count
    spreads = np.argmin(abs(loads - 91.29307666))
    dr.assert_close(loads[spreads], 91.29307666, relative=1e-8)
    # The line that divides at the point before makes one contact two.
    assert count[spreads - 1] + 1 == count[spreads] == count[spreads + 1]


def test_no_increment_gets_on_with_a_span_as_good_as_gone():
    dr.assert_close(rough_liner(5027, 2e-3, 24).load("LP"), 30.89913737228, relative=1e-9)


LOBES = """*HEADING
Half of a liner with lobes in a host pipe, pushed against its springing bottom
*NODE
1, 0., 1.
2, 0., -1.
*ARC, ELSET=R, NSET=R, TYPE=GE8, DIRECTION=ANTICLOCKWISE
1, 2, 0., 0.
*BEAM SECTION, ELSET=R, SECTION=STIFFNESS
120000., 1.
*BOUNDARY
1, XSYMM
2, XSYMM
*IMPERFECTION, ELSET=R, SHAPE=COSINE
0.004, 4
*OBSTACLE, NAME=HOST, TYPE=CIRCLE, SIDE=INSIDE
0., 0., 1.
*CONTACT, OBSTACLE=HOST, NSET=R, GAP=0.01
*SPRING
2, 2, 1.
*MONITOR, NAME=v
1, U2, -1.
*STEP
*ACCURACY, TOLERANCE=1E-6
*STATIC
0.2, , 0.01
*DLOAD
R, P, 1.
*CLOAD
1, 2, -0.01
*STOP
v, ABOVE, 0.3
*END STEP
"""


def test_lobes_on_long_elements():
    """Lines of contact as long as the waves of the liner: moment, shear force and pressure of what lies on the wall follow from the
    stress-free curvature itself. So the mesh that the limit load needs is enough, and the forces at every node are in balance."""
    run = dr.run_deck(LOBES)
    # The same with 24 and with 60 elements.
    dr.assert_close(run.load("LP"), 23.59058549, relative=1e-6)
    assert float(run.results.accuracy["node_balance"]) < 1e-7

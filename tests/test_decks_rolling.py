"""Contact points at breakpoints of smooth rods: a load, a spring or another section there holds no contact; its force goes along as
the rod turns. And contacts that begin at one place of the path.

Exact are small deflections of beams: with gaps of 1e-4 of the length rotations of 3e-4 change loads by 1e-7.
"""
import functools
import math

import numpy as np
import pytest

import deck_runner as dr

GAP, SIDE = 1e-4, 1e-3
COLUMN = """*HEADING
Clamped column between two walls, pushed up by a side load, then compressed
*NODE
1, 0., 0.
2, 0.5, 0.
3, 1., 0.
*LINE, ELSET=S, NSET=S, TYPE=GE8
1, 2, {elements[0]}
2, 3, {elements[1]}
*BEAM SECTION, ELSET=S, SECTION=STIFFNESS
1e10, 1.
*BOUNDARY
1, ENCASTRE
3, 2
3, 6
*OBSTACLE, NAME=UPPER, TYPE=LINE
1., {gap}, 0., {gap}
*OBSTACLE, NAME=LOWER, TYPE=LINE
0., -{gap}, 1., -{gap}
*CONTACT, OBSTACLE=UPPER, NSET=S
*CONTACT, OBSTACLE=LOWER, NSET=S
*MONITOR, NAME=middle
2, U2
*MONITOR, NAME=push, OBSTACLE=UPPER
RN
*STEP
*STATIC, METHOD=LOAD
0.5
*DLOAD
S, PY, {side!r}
*END STEP
*STEP
*STATIC
1., 1e-12, 2e-5
*CLOAD
3, 1, -1.
*STOP
LOAD, ABOVE, 60.
*END STEP
*STEP
*STATIC
1., 1e-12, 2e-5
*CLOAD
3, 1, -1.
{middle}*STOP
LOAD, ABOVE, {stop}
*END STEP
"""


@functools.cache
def column(middle=None, stop=90.0, elements=(8, 8)):
    """Thrust 60 + P, and P times a load at midspan."""
    middle = "" if middle is None else f"2, 2, {middle!r}\n"
    return dr.run_deck(COLUMN.format(gap=GAP, side=SIDE, middle=middle, stop=stop, elements=elements))


def labels(run):
    return [c.label for c in run.results.critical]


def free_half(k):
    """Moment and shear force at midspan, in contact, of w = c0 + c1 x + c2 cos kx + c3 sin kx + side x^2/(2 k^2)."""
    def rows(x):
        return np.array([[1.0, x, math.cos(k * x), math.sin(k * x)], [0.0, 1.0, -k * math.sin(k * x), k * math.cos(k * x)]])

    x = 0.5
    c = np.linalg.solve(np.vstack([rows(0.0), rows(x)]), [0.0, 0.0, GAP - 0.5 * SIDE * x**2 / k**2, -SIDE * x / k**2])
    bend = -k**2 * (c[2] * math.cos(k * x) + c[3] * math.sin(k * x)) + SIDE / k**2
    return bend, k**3 * (c[2] * math.sin(k * x) - c[3] * math.cos(k * x))


def turning(thrust, force):
    """Zero where both halves may turn at midspan, the contact's force rolling along: 2 w'' + T/g'' w' = 0, w = 0 there."""
    k, a = math.sqrt(thrust), 0.5
    bend, shear = free_half(k)
    push = 2.0 * shear + force                   # of the wall, downwards: what cuts and the load leave over
    c = [k * a - math.sin(k * a), math.cos(k * a) - 1.0] # w = c0 (1 - cos kx) + c1 (kx - sin kx)
    slope = k * (c[0] * math.sin(k * a) + c[1] * (1.0 - math.cos(k * a)))
    curvature = k**2 * (c[0] * math.cos(k * a) + c[1] * math.sin(k * a))
    return 2.0 * curvature + push / -bend * slope


def bisected(f, low, high):
    assert f(low) * f(high) < 0.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if f(low) * f(middle) > 0.0 else (low, middle)
    return 0.5 * (low + high)


def test_a_load_is_no_hold():
    """A load at the place that touches, as small as rounding, changes nothing: without it the path has no bifurcation here."""
    plain, loaded = column(), column(1e-14)
    assert labels(plain) == labels(loaded) == ["EP", "C+", "EP", "EP"]
    for a, b in zip(plain.results.critical, loaded.results.critical):
        dr.assert_close(a.load_factor, b.load_factor, relative=1e-8)
    dr.assert_close(plain.column("push")[-1], loaded.column("push")[-1], relative=1e-7)


@pytest.mark.parametrize("middle", [-6.4e-4, -7e-4])
def test_halves_turn_about_a_contact_that_rolls(middle):
    """A load that pulls off the wall leaves less force there to hold the rod from turning: it buckles between the load of halves
    hinged at midspan, 80.76, and that where the contact is flat, 148.4."""
    exact = bisected(lambda thrust: turning(thrust, middle * (thrust - 60.0)), 81.0, 110.0)
    assert 84.0 < exact < 109.0
    dr.assert_close(60.0 + column(middle).labelled("BP")[0].load_factor, exact, relative=1e-6)


BEAM = """*HEADING
Clamped beam pressed on a floor by a symmetric load, then by a skew one
*NODE
1, 0., 0.
2, 0.5, 0.
3, 1., 0.
*LINE, ELSET=A, NSET=S, TYPE=GE8
1, 2, 8
*LINE, ELSET=B, NSET=S, TYPE=GE8
2, 3, 8
*ELSET, ELSET=S
A, B
*BEAM SECTION, ELSET=S, SECTION=STIFFNESS
1e10, 1.
*BOUNDARY
1, ENCASTRE
3, 2
3, 6
*OBSTACLE, NAME=FLOOR, TYPE=LINE
0., -1e-4, 1., -1e-4
*CONTACT, OBSTACLE=FLOOR, NSET=S
*MONITOR, NAME=push, OBSTACLE=FLOOR
RN
*STEP
*DLOAD
S, PY, -0.08
*STATIC, METHOD=LOAD
0.5
*END STEP
*STEP
*STATIC, METHOD=LOAD
{first}
*DLOAD
A, PY, {skew}
B, PY, {minus}
*LOCATE
LOAD, 0.25, 0.5, 0.75
*END STEP
"""


def sag(x, a):
    """Deflection at x of a clamped beam, L = EI = 1, by a unit force at a."""
    if x > a:
        x, a = 1.0 - x, 1.0 - a
    b = 1.0 - a
    return (b * x)**2 / 6.0 * (3.0 * a - x * (3.0 * a + b))


def loaded_sag(x, skew):
    points, weights = np.polynomial.legendre.leggauss(4)
    total = 0.0
    for low, high, load in ((0.0, 0.5, -0.08 + skew), (0.5, 1.0, -0.08 - skew)):
        for a, b in ((low, min(max(x, low), high)), (min(max(x, low), high), high)):
            total += load * sum(0.5 * (b - a) * w * sag(x, 0.5 * (a + b) + 0.5 * (b - a) * t) for t, w in zip(points, weights))
    return total


def contact_of_beam(skew):
    """Where and with what force it touches: there both gap and slope vanish."""
    step = 1e-4

    def force(c):
        return (-1e-4 - loaded_sag(c, skew)) / sag(c, c)

    def slope(c):
        ends = [loaded_sag(x, skew) + force(c) * sag(x, c) for x in (c - step, c + step)]
        return ends[1] - ends[0]

    place = bisected(slope, 0.4, 0.6)
    return place, force(place)


@pytest.mark.parametrize("first", [0.02, 0.5])
@pytest.mark.parametrize("skew", [0.003, -0.003])
def test_a_contact_rolls_off_the_place_where_it_began(skew, first):
    """It begins at midspan, where the load jumps, and goes away from the heavier side's clamp."""
    run = dr.run_deck(BEAM.format(skew=skew, minus=-skew, first=first))
    assert labels(run) == ["C+", "EP", "UZ", "UZ", "UZ", "EP"]
    for event in run.results.critical[2:]:
        place, force = contact_of_beam(event.load_factor * skew)
        row = event.point - 1
        dr.assert_close(run.results.contact.start[row, 0], place, absolute=2e-7)
        dr.assert_close(run.column("push")[row], force, relative=1e-6)
    assert abs(run.results.contact.start[-1, 0] - 0.5) > 1e-3


TWO_AT_ONCE = """*HEADING
Clamped column on a wall at midspan, whose halves come to the other wall
*NODE
1, 0., 0.
2, 0.5, 0.
{nodes}*BEAM SECTION, ELSET=S, SECTION=STIFFNESS
1e6, 1.
*BOUNDARY
{supports}*OBSTACLE, NAME=UPPER, TYPE=LINE
1., 0.1, 0., 0.1
*OBSTACLE, NAME=LOWER, TYPE=LINE
0., -0.1, 1., -0.1
*CONTACT, OBSTACLE=UPPER, NSET=S
*CONTACT, OBSTACLE=LOWER, NSET=S
*MONITOR, NAME=d
1, U1, {share}
*MONITOR, NAME=m
2, U2
*STEP
*DLOAD
S, PY, 1e-2
*STATIC, METHOD=LOAD
0.5
*END STEP
*STEP
*STATIC
1., 1e-9, 0.02
*CLOAD
1, 1, 1.
2, 2, {middle}
*STOP
d, ABOVE, 0.3
*END STEP
"""


@dr.release_only
def test_contacts_of_both_halves_begin_together():
    """What a mirror makes one of the other neither begins first: the whole column goes where its half does."""
    whole = dr.run_deck(TWO_AT_ONCE.format(
        nodes="3, 1., 0.\n*LINE, ELSET=S, NSET=S, TYPE=GE8\n1, 2, 12\n2, 3, 12\n", supports="1, YSYMM\n3, ENCASTRE\n", share=1.0, middle=-0.1))
    half = dr.run_deck(TWO_AT_ONCE.format(
        nodes="*LINE, ELSET=S, NSET=S, TYPE=GE8\n1, 2, 12\n", supports="1, YSYMM\n2, XSYMM\n", share=2.0, middle=-0.05))
    assert labels(half) == ["EP", "C+", "C+", "EP"]
    assert [label for label in labels(whole) if label != "BP"] == labels(half)
    for a, b in zip((c for c in whole.results.critical if c.label != "BP"), half.results.critical):
        dr.assert_close(a.load_factor, b.load_factor, relative=1e-8)
    assert whole.results.contact.count[-1] == 3 and half.results.contact.count[-1] == 2


ROLLING = """*HEADING
Clamped beam under two loads, pressed on a floor at its middle node
*NODE
1, 0., 0.
2, .5, 0.
3, 1., 0.
*LINE, ELSET=A, NSET=S, TYPE={kind}
1, 2, {elements}
*LINE, ELSET=B, NSET=S, TYPE={kind}
2, 3, {elements}
*BEAM SECTION, ELSET=A, SECTION=STIFFNESS
1e6, 1.
*BEAM SECTION, ELSET=B, SECTION=STIFFNESS
1e6, 1.
*BOUNDARY
1, ENCASTRE
3, ENCASTRE
*OBSTACLE, NAME=O, TYPE=LINE
0., -0.00004, 1., -0.00004
*CONTACT, OBSTACLE=O, NSET=S
*STEP
*ACCURACY, WIDEST=1E9
*STATIC, METHOD=LOAD
0.2
*DLOAD
A, PY, -0.3
B, PY, -0.30003
*CLOAD
2, 2, -0.2
*STOP
LOAD, ABOVE, 0.12
*END STEP
"""


def rolled_place(load=0.12, gap=4e-5, left=0.3, right=0.30003, force=0.2):
    """Where the beam is lowest: there the floor pushes. Powers of the distance from the left clamp, the middle and that place."""
    def slope_there(place):
        # Unknown: the coefficients of x^2 and x^3, and the floor's force.
        def given(x, n):
            span = max(x - 0.5, 0.0)
            return load * (-left * x**(4 - n) / math.factorial(4 - n) - (right - left) * span**(4 - n) / math.factorial(4 - n)
                           - force * span**(3 - n) / math.factorial(3 - n))

        def row(x, n):
            return [[x**2, 2.0 * x][n], [x**3, 3.0 * x**2][n], max(x - place, 0.0)**(3 - n) / math.factorial(3 - n)]

        unknown = np.linalg.solve([row(1.0, 0), row(1.0, 1), row(place, 0)], [-given(1.0, 0), -given(1.0, 1), -gap - given(place, 0)])
        return unknown @ row(place, 1) + given(place, 1)

    places = [0.5, 0.5001]
    for _ in range(4):
        slopes = [slope_there(place) for place in places]
        places = [places[1], places[1] - slopes[1] * (places[1] - places[0]) / (slopes[1] - slopes[0])]
        if abs(places[1] - places[0]) < 1e-13:
            break
    return places[1]


@pytest.mark.parametrize("kind, elements", [("GE4", 1), ("GE4", 2), ("GE4", 4), ("GE8", 1)])
def test_the_place_of_a_contact_that_rolls_has_a_bar(kind, elements):
    """It is where the beam is lowest, beside a node, and errs as the node's turn does. Squares of rotations of 1e-4 change it by 1e-6 of
    the way, thrust by as much as EA (gap/length)^2/EI = 2e-3 of 1e-3."""
    run = dr.run_deck(ROLLING.format(kind=kind, elements=elements))
    region, = run.results.contact.regions(run.only("EP").point)
    exact = rolled_place()
    assert 1e-7 < abs(exact - 0.5) < 1e-4
    assert abs(region.start - exact) <= region.start_error + 1e-5 * abs(exact - 0.5)
    assert 0.0 < region.start_error < 1e-7 and region.end_error == region.start_error


PRESSED = """*HEADING
Beam pressed down on a floor by a force that turns it a little
*NODE
1, 0., 0.
2, 0.5, 0.
3, 1., 0.
*LINE, ELSET=B, NSET=B, TYPE=GE8
1, 2
2, 3
*BEAM SECTION, ELSET=B, SECTION=STIFFNESS
1e4, 1.
*BOUNDARY
1, ENCASTRE
3, ENCASTRE
*OBSTACLE, NAME=FLOOR, TYPE=LINE
0., -0.001, 1., -0.001
*CONTACT, OBSTACLE=FLOOR, NSET=B
*MONITOR, NAME=push, OBSTACLE=FLOOR
RN
*STEP
*ACCURACY, TOLERANCE=1E-6
*STATIC, METHOD={method}
0.1
*CLOAD
2, 2, -1.
2, 6, 1e-5
*STOP
LOAD, ABOVE, 100.
*END STEP
"""


@pytest.mark.parametrize("method", ["SPHERICAL", "LOAD"])
def test_a_force_beside_its_node_is_known_to_the_tangent(method):
    """All that is added to the force goes into the floor, beside its node, and turns that: increments grow as long as they may."""
    run = dr.run_deck(PRESSED.format(method=method))
    assert [c.label for c in run.results.critical] == ["C+", "EP"]
    load = run.column("load_factor")
    after = load > run.load("C+")
    dr.assert_close(run.column("push")[after] + run.load("C+"), load[after], relative=1e-6)
    assert after.sum() <= 40

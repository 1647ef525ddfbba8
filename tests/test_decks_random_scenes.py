"""What random scenes have brought up: each was wrong in silence, endless or stopped for no reason. What another mesh, another
increment or another strategy finds is the reference; where there is a closed form, that."""
import functools
import math

import numpy as np
import pytest

import deck_runner as dr

pytestmark = dr.once_in_release

LINER = """*HEADING
Half liner with a gap, oval; its contact point leaves the axis of symmetry and comes back to it
*NODE
1, 0., 1.
2, 0., -1.
*ARC, ELSET=ROD, NSET=ROD, TYPE=GE8, DIRECTION=ANTICLOCKWISE
1, 2, 0., 0.{elements}
*IMPERFECTION, ELSET=ROD, SHAPE=COSINE
{oval}
*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS
{axial}., 1.
*BOUNDARY
1, XSYMM
2, ENCASTRE
*OBSTACLE, NAME=HOST, TYPE=CIRCLE, SIDE=INSIDE, REFERENCE=90.
0., 0., 1.
*CONTACT, OBSTACLE=HOST, NSET=ROD, GAP={gap}
*MONITOR, NAME=v
1, U2, -1.
*MONITOR, NAME=push, OBSTACLE=HOST
RN
*STEP
*ACCURACY, TOLERANCE={asked}
*STATIC
0.3, , 0.02
*DLOAD
ROD, P, 1.
*CLOAD
1, 2, {force}
*STOP
LOAD, ABOVE, {last}.
v, ABOVE, 0.2
LOAD, BELOW, -1.
*END STEP
"""
OVALS = [
    dict(oval="-0.00078169, 2.", axial=43074, gap=0.0013795, force=-0.0003, last=58),
    dict(oval="-0.0051286, 2.", axial=98306, gap=0.0068879, force=-0.00099639, last=40),
    dict(oval="-0.002034, 2.", axial=91735, gap=0.0024228, force=-0.00054447, last=60),
]


def within_bars(one, other, monitor=None):
    """Two runs' critical points agree as far as both are known."""
    if monitor is None:
        bars = one.error + other.error
        assert abs(one.load_factor - other.load_factor) <= bars, (one.label, one.load_factor, other.load_factor, bars)
        return
    bars = one.monitor_errors[monitor] + other.monitor_errors[monitor]
    assert abs(one.monitors[monitor] - other.monitors[monitor]) <= bars, (one.label, one.monitors, other.monitors, bars)


# A point that comes to the axis has a pivot of rounding there: at a third of all tolerances around 1e-5 a bifurcation is bracketed and
# not located, which the run says. The last oval is such a case.
@pytest.mark.parametrize("oval", [pytest.param(o, id=f"{o['axial']}", marks=pytest.mark.xfail(strict=False) if o is OVALS[-1] else ())
                                  for o in OVALS])
def test_a_contact_point_comes_back_to_the_axis(oval):
    runs = [dr.run_deck(LINER.format(asked=asked, elements="", **oval)) for asked in (1e-5, 1e-7)]
    for run in runs:
        first, second = run.labelled("C+")
        assert first.load_factor < 1.0 and second.load_factor == pytest.approx(8.0, rel=0.02)
        assert not run.labelled("C-") and not run.labelled("BP")
        assert run.results.critical[-1].load_factor == pytest.approx(oval["last"], rel=1e-12)
    within_bars(*(run.labelled("C+")[1] for run in runs))
    within_bars(*(run.results.critical[-1] for run in runs), "push")


def test_a_force_pulls_the_apex_off_where_its_sides_are_pressed():
    """The line begins behind what the force lifts, and that is soon so little that it is taken for none."""
    waves = dict(oval="-0.0049192, 6.\n0.00026376, 7.", axial=11608, gap=0.0063211, force=-0.00017904, last=33)
    one = dr.run_deck(LINER.format(asked=1e-5, elements="", **waves))
    other = dr.run_deck(LINER.format(asked=1e-5, elements=", 24", **waves))
    for found, same in zip(one.labelled("C+")[:3], other.labelled("C+")[:3]):
        within_bars(found, same)
    for run in (one, other):
        assert [c.label for c in run.results.critical] == ["C+"] * 5 + ["EP"]
    within_bars(one.results.critical[-1], other.results.critical[-1], "push")


LYING = """*HEADING
Clamped strip pushed together beside a wall, its middle pressed against that
*NODE
1, 0., 0.
2, 0.5, 0.
3, 1., 0.
*LINE, ELSET=S, NSET=S, TYPE=GE8
1, 2
2, 3
*BEAM SECTION, ELSET=S, SECTION=STIFFNESS
1e6, 1.
*BOUNDARY
1, ENCASTRE
3, YSYMM
*OBSTACLE, NAME=WALL, TYPE=LINE
1., 0.1, 0., 0.1
*CONTACT, OBSTACLE=WALL, NSET=S
*MONITOR, NAME=push, OBSTACLE=WALL
RN
*STEP
*ACCURACY, TOLERANCE=1E-6
*STATIC
1., 1e-9, 0.02
*CLOAD
3, 1, -1.
2, 2, {force}
*STOP
LOAD, ABOVE, 700.
*END STEP
"""


@functools.cache
def lying_strip_buckles(height=0.1, axial=1e6):
    """Load at which the halves of the part that lies on the wall buckle between its middle and its ends: elastica from the clamp
    to where it lies down, and P (1 - P/EA) l^2 = 4 pi^2 for what is left of the half. By the first integral its curvature is the same
    where it is level: none at the clamp, as none is at the other end, where it is level as soon as the curvature is gone."""
    def end(unknown, steps=400):
        across, length, load = unknown
        step = length / steps

        def rate(angle, bend):
            sine, cosine = math.sin(angle), math.cos(angle)
            stretch = 1.0 + (across * sine - load * cosine) / axial
            return stretch * sine, bend, -stretch * (across * cosine + load * sine)

        rise = angle = bend = 0.0
        for _ in range(steps):
            a = rate(angle, bend)
            b = rate(angle + 0.5 * step * a[1], bend + 0.5 * step * a[2])
            c = rate(angle + 0.5 * step * b[1], bend + 0.5 * step * b[2])
            d = rate(angle + step * c[1], bend + step * c[2])
            rise, angle, bend = (value + step / 6.0 * (a[k] + 2.0 * b[k] + 2.0 * c[k] + d[k])
                                 for k, value in enumerate((rise, angle, bend)))
        return np.array([rise - height, bend, load * (1.0 - load / axial) * (0.5 - length)**2 - 4.0 * math.pi**2])

    unknown = np.array([-608.0 * height / 0.2453, 0.2453, 608.0])
    for _ in range(8):
        base = end(unknown)
        tangent = np.array([(end(unknown + 1e-7 * unknown * (np.arange(3) == k)) - base) / (1e-7 * unknown[k]) for k in range(3)]).T
        unknown = unknown - np.linalg.solve(tangent, base)
    return unknown[2]


@pytest.mark.parametrize("force", [1e-3, 0.1])
def test_bars_where_a_pressed_line_lets_go(force):
    """What presses the middle is not forgotten where the rod is looked at without the line: meshes grew without end."""
    run = dr.run_deck(LYING.format(force=force))
    exact = lying_strip_buckles()
    assert exact == pytest.approx(608.4031026, rel=1e-8)
    for bifurcation in run.labelled("BP"):
        assert bifurcation.load_factor == pytest.approx(exact, rel=1e-6)
        assert abs(bifurcation.load_factor - exact) <= bifurcation.error + 1e-9 * exact
        assert bifurcation.monitor_errors["push"] <= 1e-4 * bifurcation.monitors["push"]
    assert len(run.labelled("BP")) == 2


def hump(height, width, middle, knots=33):
    """Points of a bell curve, as far as it is higher than nothing, from the left to the right."""
    return "\n".join(f"{middle + 0.25 * width * k!r}, {height * math.exp(-(0.25 * k)**2)!r}" for k in range(-(knots // 2), knots // 2 + 1))


PIPE = """*HEADING
Half of a pipe over a hump
*NODE
1, 0., {height}
2, {length}, {height}
*LINE, ELSET=ROD, NSET=ROD, TYPE=GE8
1, 2{elements}
*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS
{axial}, 1.
*BOUNDARY
1, XSYMM
*OBSTACLE, NAME=GROUND, TYPE=SPLINE{foundation}
{ground}
*CONTACT, OBSTACLE=GROUND, NSET=ROD
*MONITOR, NAME=mid
1, U2
*MONITOR, NAME=push, OBSTACLE=GROUND
RN
*STEP
*ACCURACY, TOLERANCE=1E-5
*STATIC, METHOD=LOAD
{first}, , {largest}
*DLOAD
ROD, PY, {weight}
*STOP
LOAD, ABOVE, {last}
*END STEP
"""


def test_contact_with_a_foundation_begins_in_the_first_increment():
    """A region that is long at the end of the increment was looked for where another one had been from the start."""
    scene = dict(height=0.09, length=12.5, elements="", axial=7e6, foundation=", FOUNDATION=WINKLER, MODULUS=180.",
                 ground=hump(0.09, 0.92, 0.0), largest=0.2, weight=-0.8, last=0.01)
    one, other = (dr.run_deck(PIPE.format(first=first, **scene)).labelled("C+")[0] for first in (0.01, 1e-5))
    assert other.load_factor < 1e-4
    within_bars(one, other)


def test_contact_begins_near_the_end_of_a_long_span():
    """Two elements know their gap next to a touch better than by all that mending makes of it, and lines on splines end: densities
    have kinks where the pieces of a spline meet."""
    scene = dict(height=0.0940626, length=4.352757, axial=3e7, foundation="", ground=hump(0.0940626, 1.1795182, 1.395318), first=0.001,
                 largest=0.05, weight=-0.70658, last=1.0)
    run = dr.run_deck(PIPE.format(elements="", **scene))
    fine = dr.run_deck(PIPE.format(elements=", 24", **scene), code=None)
    assert [c.label for c in run.results.critical] == ["C+", "C+", "C+", "EP"]
    exact = fine.labelled("C+")[1]
    assert exact.load_factor == pytest.approx(0.1159, rel=0.01) and exact.error < 1e-11
    within_bars(run.labelled("C+")[1], exact)
    elements = int(next(line.split()[-1] for line in run.stdout.splitlines() if "elements at the most" in line))
    assert elements <= 160


DOME = """*HEADING
Deep arch pushed onto a dome beside its middle: the contact point becomes two
*NODE
1, -0.5, 0.
2, 0., 0.1
3, 0.5, 0.
*ARC, ELSET=ROD, NSET=ROD, TYPE=GE8, DIRECTION=CLOCKWISE
1, 2, 0., -1.2, 10
2, 3, 0., -1.2, 10
*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS
2.7e7, 1.
*BOUNDARY
1, PINNED
3, ENCASTRE
*OBSTACLE, NAME=DOME, TYPE=CIRCLE, SIDE=OUTSIDE
0.097, -0.606, 0.5938
*CONTACT, OBSTACLE=DOME, NSET=ROD
*MONITOR, NAME=v
2, U2, -1.
*STEP
*STATIC
0.05, , 0.01
*CLOAD
2, 2, -5.
*LOCATE
LOAD, {asked}
*STOP
v, ABOVE, 0.15
LOAD, ABOVE, {last}
*END STEP
"""


def test_values_behind_a_point_that_divides():
    """Two points begin at a distance, at another load than where the one divides: what is asked for lies between."""
    run = dr.run_deck(DOME.format(asked=59.5, last=60.0))
    assert 56.0 < run.labelled("C-")[-1].load_factor < 58.0
    assert [c.label for c in run.results.critical[-3:]] == ["C-", "UZ", "EP"]
    assert run.results.critical[-2].load_factor == pytest.approx(59.5, rel=1e-12)
    assert run.results.critical[-1].load_factor == pytest.approx(60.0, rel=1e-12)


SOIL = """*HEADING
Clamped arch that snaps onto soil
*NODE
1, -0.5, 0.
2, 0., 0.0894
3, 0.5, 0.
*ARC, ELSET=ROD, NSET=ROD, TYPE=GE8, DIRECTION=CLOCKWISE
1, 2, 0., {centre!r}
2, 3, 0., {centre!r}
*IMPERFECTION, ELSET=ROD, SHAPE=SINE
9.1e-05, 2.
4.6e-05, 1.
*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS
593000., 1.
*BOUNDARY
1, ENCASTRE
3, ENCASTRE
*OBSTACLE, NAME=SOIL, TYPE=LINE, FOUNDATION=WINKLER, MODULUS=238000.
-0.5, -0.0166, 0.5, -0.0166
*CONTACT, OBSTACLE=SOIL, NSET=ROD
*MONITOR, NAME=v
2, U2, -1.
*STEP
*ACCURACY, TOLERANCE=1E-4
*STATIC
0.05, , {largest}
*DLOAD
ROD, PY, -8.94
*STOP
v, ABOVE, 0.104
*END STEP
"""


def test_limit_point_just_behind_where_soil_takes_hold():
    centre = (0.0894**2 - 0.25) / (2.0 * 0.0894)
    one, other = (dr.run_deck(SOIL.format(centre=centre, largest=largest)) for largest in (0.02, 0.0005))
    for run in (one, other):
        touches, turns = run.only("C+"), run.labelled("LP")[-1]
        assert 0.0 < touches.load_factor - turns.load_factor < 1e-4 * touches.load_factor
    within_bars(one.labelled("LP")[-1], other.labelled("LP")[-1])


INDENTER = """*HEADING
Shallow arch under a circle that comes down
*NODE
1, -0.5, 0.
2, 0., 0.1
3, 0.5, 0.
*ARC, ELSET=ROD, NSET=ROD, TYPE=GE8, DIRECTION=CLOCKWISE
1, 2, 0., -1.2
2, 3, 0., -1.2
*IMPERFECTION, ELSET=ROD, SHAPE=SINE
0.0014, 1.
*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS
32000., 1.
*BOUNDARY
1, PINNED
3, PINNED
*OBSTACLE, NAME=CIRCLE, TYPE=CIRCLE, SIDE=OUTSIDE
-0.0075, 0.31, 0.2
*CONTACT, OBSTACLE=CIRCLE, NSET=ROD
*MONITOR, NAME=push, OBSTACLE=CIRCLE
RN
*STEP
*ACCURACY, TOLERANCE=1E-5
*STATIC, METHOD=LOAD
0.01, , 0.03
*OBSTACLE MOTION
CIRCLE, 0., -0.05
*END STEP
"""


def test_a_force_of_nothing_has_no_relative_error():
    """Where an unstressed rod is touched first its forces are rounding, and so are their errors."""
    run = dr.run_deck(INDENTER)
    assert abs(run.only("C+").monitors["push"]) < 1e-9


DITCH = """*HEADING
Pipe on soft ground with a shallow ditch, its weight in one go
*NODE
1, 0., 0.
3, 1.224, 0.
2, 4.4, 0.
*LINE, ELSET=ROD, NSET=ROD, TYPE=GE8
1, 3
3, 2
*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS
334000., 1.
*BOUNDARY
1, XSYMM
*OBSTACLE, NAME=GROUND, TYPE=POLYLINE, FOUNDATION=WINKLER, MODULUS=1245.
-2., 0.
1.54, 0.
1.98, -0.01
2.64, -0.01
3.08, -0.005
6.4, -0.005
*CONTACT, OBSTACLE=GROUND, NSET=ROD
*MONITOR, NAME=u
1, U2
*STEP
*ACCURACY, TOLERANCE=1e-05
*STATIC, METHOD=LOAD
0.2, , 0.2
*DLOAD
ROD, PY, -1.826
*END STEP
"""


def test_a_first_increment_does_not_fold_a_rod():
    """It may not be gone through, but what is told is the pipe on its ground."""
    run = dr.run_deck(DITCH, code=None)
    assert np.all(np.abs(run.column("u")) < 0.1)
    if run.code == 0:
        assert run.column("u")[-1] == pytest.approx(-0.00147, rel=0.01)


TILTED = """*HEADING
Half of a beam over two walls that make a V upside down
*NODE
1, 0., 0.
2, 0.5, 0.
3, 1., 0.
*LINE, ELSET=ROD, NSET=ROD, TYPE=GE8
1, 2{elements}
2, 3{elements}
*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS
8.5e6, 1.
*BOUNDARY
1, XSYMM
3, 2
*OBSTACLE, NAME=WALL, TYPE=LINE
0., -0.03, 1., -0.0356
*CONTACT, OBSTACLE=WALL, NSET=ROD, POINTS={points}
*MONITOR, NAME=mid
2, U2
*STEP
*ACCURACY, TOLERANCE=1E-6
*STATIC, METHOD=LOAD
0.05, , 0.1
*DLOAD
ROD, PY, -5.18
*END STEP
"""


def test_a_wall_that_is_no_right_angle_to_the_mirror():
    """The rod, level on the mirror, comes down on the wall further on: contact does not spread from there."""
    run = dr.run_deck(TILTED.format(elements="", points="ALONG"))
    nodes = dr.run_deck(TILTED.format(elements=", 100", points="NODES"), code=None)
    assert [c.label for c in run.results.critical] == ["C+", "C+", "EP"]
    for found, near in zip(run.labelled("C+"), nodes.labelled("C+")):
        assert found.load_factor == pytest.approx(near.load_factor, rel=1e-3)
    assert run.column("mid")[-1] == pytest.approx(nodes.column("mid")[-1], rel=1e-4)


UPHEAVAL = """*HEADING
Half of a pipe laid over a hill, then pushed together until it rises
*NODE
1, 0., {top}
2, {length}, {top}
*LINE, ELSET=ROD, NSET=ROD, TYPE=GE8
1, 2{elements}
*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS
{axial}, 1.
*BOUNDARY
1, XSYMM
*OBSTACLE, NAME=GROUND, TYPE=SPLINE{soil}
{hill}
*CONTACT, OBSTACLE=GROUND, NSET=ROD
*MONITOR, NAME=mid
1, U2
*STEP
{accuracy}*STATIC, METHOD=LOAD
0.01, , 0.2
*DLOAD
ROD, PY, {weight}
*END STEP
*STEP
{accuracy}*STATIC
0.05, , 0.01
*CLOAD
2, 1, {thrust}
*STOP
mid, ABOVE, {last}
*END STEP
"""
HILLS = [  # height, width, what opens before the limit point
    dict(top=0.0267, width=0.84, length=5.5, axial=3.4e6, weight=-0.125, thrust=-7.1, last=0.13, opens=["C-", "C-"]),
    dict(top=0.0084, width=1.7, length=11.3, axial=1.7e6, weight=-0.538, thrust=-14.7, last=0.042, opens=[]),
    dict(top=0.0042, width=0.77, length=4.94, axial=6e5, weight=-0.04, thrust=-7.0, last=0.013, opens=["C-", "C-"]),
    dict(top=0.0044, width=0.63, length=3.82, axial=1.3e6, weight=-0.08, thrust=-4.7, last=0.02, opens=["C-", "C-"]),
]


def bell(hill, half):
    """Points of y = top exp(-x^2/2 width^2)."""
    spaced = 0.35 * hill["width"]
    return "\n".join(f"{spaced * k!r}, {hill['top'] * math.exp(-0.5 * (0.35 * k)**2)!r}" for k in range(-half, half + 1))


def largest_thrust(top, width, weight):
    """Of a pipe, EI = 1, on a hill y = top exp(-x^2/2 width^2), small slopes. The span that has risen is A + B cos(k x) - w x^2/2 N,
    k^2 = N, and has place, slope and curvature of the hill at its end a. N(a) is largest where k a = pi: there y' = -w a/N."""
    low, high = 1e-3 * width, 10.0 * width
    while high - low > 1e-13 * width:
        end = 0.5 * (low + high)
        steeper = top / width**2 * math.exp(-0.5 * (end / width)**2) > weight * (end / math.pi)**2
        low, high = (end, high) if steeper else (low, end)
    return (math.pi / low)**2


@pytest.mark.parametrize("hill", HILLS, ids=lambda hill: f"{hill['top']}")
def test_a_pipe_rises_off_a_hill(hill):
    """Where pressure vanishes a span opens, and soon the load turns back. Equilibria far away are not taken for what opens."""
    fields = dict(hill, soil="", hill=bell(hill, 16))
    runs = [dr.run_deck(UPHEAVAL.format(elements="", accuracy=f"*ACCURACY, TOLERANCE={asked}\n", **fields)) for asked in (1e-5, 1e-7)]
    runs.append(dr.run_deck(UPHEAVAL.format(elements=", 30", accuracy="", **fields)))
    # What the theory of small slopes leaves is their square.
    slopes = (hill["top"] / hill["width"])**2
    for run in runs:
        rising = [c for c in run.results.critical if c.step == 2]
        assert [c.label for c in rising] == hill["opens"] + ["LP", "EP"]
        thrust = -hill["thrust"] * rising[-2].load_factor
        assert thrust == pytest.approx(largest_thrust(hill["top"], hill["width"], -hill["weight"]), rel=slopes)
        # Nothing but the limit point changes stability.
        pivots = run.column("negative_pivots")[run.column("step") == 2]
        assert np.count_nonzero(np.diff(pivots)) == 1 and pivots[-1] == 1
        within_bars(run.labelled("LP")[0], runs[0].labelled("LP")[0])
        within_bars(rising[-1], runs[0].results.critical[-1])


SOFT_HILLS = [  # by moduli of 80 and 9 times the square of the thrust, with the elements of one run; none: a tolerance
    (dict(top=0.00508, width=1.39, length=9.67, axial=4.16e5, weight=-0.015, thrust=-6.73, last=0.001, modulus=5060.0), ""),
    (dict(top=0.00578, width=1.73, length=12.05, axial=2.01e6, weight=-0.0448, thrust=-21.0, last=0.001, modulus=5840.0), ", 30"),
]


@dr.release_only
@pytest.mark.parametrize("hill, elements", SOFT_HILLS, ids=["0.00508", "0.00578"])
def test_a_pipe_rises_off_a_hill_of_soil(hill, elements):
    """First its tip comes down, and the path has a corner; then contact spreads from the top and from the tip until it is one."""
    fields = dict(hill, soil=f", FOUNDATION=WINKLER, MODULUS={hill['modulus']}", hill=bell(hill, 21))
    runs = [dr.run_deck(UPHEAVAL.format(elements=elements, accuracy="" if elements else "*ACCURACY, TOLERANCE=1E-5\n", **fields)),
            dr.run_deck(UPHEAVAL.format(elements=", 30", accuracy="", **fields))]
    for run in runs:
        assert [c.label for c in run.results.critical] == ["C+", "C+", "EP", "LP", "EP"]
        for found, other in zip(run.results.critical, runs[0].results.critical):
            within_bars(found, other)


LOBES = """*HEADING
Liner with a push at both poles
*NODE
1, 0., 1.
2, 0., -1.
*ARC, ELSET=RING, NSET=RING, TYPE=GE8
1, 2, 0., 0.
*BEAM SECTION, ELSET=RING, SECTION=STIFFNESS
30000., 1.
*BOUNDARY
1, XSYMM
2, XSYMM
*OBSTACLE, NAME=HOST, TYPE=CIRCLE, SIDE=INSIDE
0., 0., 1.
*CONTACT, OBSTACLE=HOST, NSET=RING
*MONITOR, NAME=v
1, U2, -1.
*STEP
*ACCURACY, TOLERANCE={tolerance}
*STATIC
0.2, 1E-9, 0.01
*DLOAD
RING, P, 1.
*CLOAD
1, 2, -0.0002407
2, 2, 0.00012035
*STOP
v, ABOVE, 0.3
*END STEP
"""


def test_a_limit_point_before_a_span_vanishes():
    """What lifts off at the lower pole lies down again just behind the limit point, within one increment of the coarse mesh."""
    runs = [dr.run_deck(LOBES.format(tolerance=tolerance)) for tolerance in ("1E-4", "1E-6")]
    for run in runs:
        assert [c.label for c in run.results.critical] == ["LP", "EP"]
        for found, other in zip(run.results.critical, runs[1].results.critical):
            within_bars(found, other)


WAVES = """*HEADING
Hinged column with an imperfection of four half waves, between walls
*NODE
1, 0., 0.
2, 1., 0.
*LINE, ELSET=COLUMN, NSET=COLUMN, TYPE=GE8
1, 2{count}
*IMPERFECTION, ELSET=COLUMN, SHAPE=SINE
{amplitude}, 4
*BEAM SECTION, ELSET=COLUMN, SECTION=STIFFNESS
{ea}, 1.
*BOUNDARY
1, PINNED
2, 2
*OBSTACLE, NAME=TOP, TYPE=LINE
1., {gap}, 0., {gap}
*OBSTACLE, NAME=BOTTOM, TYPE=LINE
0., -{gap}, 1., -{gap}
*CONTACT, OBSTACLE=TOP, NSET=COLUMN
*CONTACT, OBSTACLE=BOTTOM, NSET=COLUMN
*MONITOR, NAME=short
2, U1, -1.
*STEP
{accuracy}*STATIC
0.3, 1E-12, {largest}
*CLOAD
2, 1, -9.869604401089358
*STOP
LOAD, ABOVE, 18.
*END STEP
"""


@pytest.mark.parametrize("amplitude, gap, ea, accuracy", [(-9.56e-6, 0.01464, 8.57e7, "1E-4"), (2.84e-8, 0.00762, 6.19e9, "1E-6")])
def test_a_coarse_mesh_does_not_turn_the_path(amplitude, gap, ea, accuracy):
    """The first mesh does not see four half waves. On a finer one the path goes on in the sense in which it came: to n^2 times Euler's
    load, n = 1, 2, 3, where the deflection of the imperfection is a/(16 - n^2) n^2 and counts with its square."""
    fields = dict(amplitude=amplitude, gap=gap, ea=ea, largest=gap / 2)
    run = dr.run_deck(WAVES.format(count="", accuracy=f"*ACCURACY, TOLERANCE={accuracy}\n", **fields))
    given = dr.run_deck(WAVES.format(count=", 24", accuracy="", **fields))
    assert [c.label for c in run.results.critical][:3] == ["BP"] * 3
    assert [c.label for c in run.results.critical] == [c.label for c in given.results.critical]
    for n, found, other in zip((1, 2, 3), run.results.critical, given.results.critical):
        within_bars(found, other)
        waves = 4.0 * math.pi * amplitude * 16.0 / (16.0 - n**2)
        assert found.load_factor == pytest.approx(n**2, rel=waves**2 + 40.0 * n**2 / ea + float(accuracy))
    assert (np.diff(run.column("load_factor")) > 0.0).all()


LIFTED = """*HEADING
Pipe lifted at its end off stiff soil
*NODE
1, 0., 0.
2, 3.38182, 0.
3, 6.76364, 0.
*LINE, ELSET=PIPE, NSET=PIPE, TYPE=GE8
1, 2{count}
2, 3{count}
*BEAM SECTION, ELSET=PIPE, SECTION=STIFFNESS
67709., 1.
*BOUNDARY
1, 1
*OBSTACLE, NAME=GROUND, TYPE=LINE, FOUNDATION=WINKLER, MODULUS=6547391.061493798
-1., 0., 7.763639463695306, 0.
*CONTACT, OBSTACLE=GROUND, NSET=PIPE
*MONITOR, NAME=a
3, U2
*STEP
{accuracy}*STATIC, METHOD=LOAD
0.25
*DLOAD
PIPE, PY, -0.8202182614912022
*END STEP
*STEP
{accuracy}*STATIC
0.05, , 0.05
*CLOAD
3, 2, 2.7738303011327257
*STOP
a, ABOVE, 0.8745679239140121
*END STEP
"""


@pytest.mark.parametrize("tolerance", ["1E-4", "1E-5", "1E-6"])
def test_contact_that_divides_just_behind_a_point(tolerance):
    """The mesh that the end of the increment wants is none that the point in front of the event is in equilibrium on."""
    run = dr.run_deck(LIFTED.format(count="", accuracy=f"*ACCURACY, TOLERANCE={tolerance}\n"))
    given = dr.run_deck(LIFTED.format(count=", 24", accuracy=""))
    assert [c.label for c in run.results.critical] == [c.label for c in given.results.critical]
    for found, other in zip(run.results.critical, given.results.critical):
        within_bars(found, other)


PRESSED_LINER = """*HEADING
Liner with a gap under pressure
*NODE
1, 0., 1.
2, 0., -1.
*ARC, ELSET=RING, NSET=RING, TYPE=GE8
1, 2, 0., 0.{count}
*BEAM SECTION, ELSET=RING, SECTION=STIFFNESS
120000.0, 1.
*BOUNDARY
1, XSYMM
2, XSYMM
*OBSTACLE, NAME=HOST, TYPE=CIRCLE, SIDE=INSIDE, REFERENCE=90.
0., 0.006904149129439708, 1.0069041491294397
*CONTACT, OBSTACLE=HOST, NSET=RING
*MONITOR, NAME=v
1, U2, -1.
*STEP
{accuracy}*STATIC
0.2, 1E-9, 0.01
*DLOAD
RING, P, 1.
*CLOAD
1, 2, -0.0012883308589962611
*STOP
v, ABOVE, 0.3
*END STEP
"""


def test_a_point_beside_a_span_that_lies_down_does_not_divide():
    """The span beyond the point closes where the point is as curved as the host, all the way to the mirror; what a mesh errs by has the
    one or the other first, and nothing splits."""
    given = dr.run_deck(PRESSED_LINER.format(count=", 24", accuracy=""))
    run = dr.run_deck(PRESSED_LINER.format(count="", accuracy="*ACCURACY, TOLERANCE=1E-6\n"))
    for found in (given, run):
        assert [c.label for c in found.results.critical] == ["LP", "EP"]
        assert np.all(found.results.contact.count <= 1)
    within_bars(given.results.critical[0], run.results.critical[0])
    length = given.results.contact.end[:, 0] - given.results.contact.start[:, 0]
    assert np.nanmax(length) > 1.5


@dr.release_only
@pytest.mark.parametrize("axial, host, forces", [
    ("30000.0", "0.0009083402868857271, 1.0009083402868857", "1, 2, -0.00010694934216911198\n2, 2, 5.347467108455599e-05"),
    ("7500.0", "0.005098185454337521, 1.0050981854543375", "1, 2, -0.00024317659476365958\n2, 2, 7.295297842909788e-05"),
])
def test_a_span_that_is_gone_on_both_sides_of_a_limit_point(axial, host, forces):
    """What is left between a line and the mirror has no gap. The set without it holds where the run stands, and at the same load, or one just
    ahead, behind the limit point, where it was found first."""
    changes = [("120000.0", axial), ("0.006904149129439708, 1.0069041491294397", host), ("1, 2, -0.0012883308589962611", forces)]
    given = dr.run_deck(dr.changed(PRESSED_LINER.format(count=", 24", accuracy=""), *changes))
    run = dr.run_deck(dr.changed(PRESSED_LINER.format(count="", accuracy="*ACCURACY, TOLERANCE=1E-4\n"), *changes))
    for found in (given, run):
        assert [c.label for c in found.results.critical] == ["LP", "EP"]
    within_bars(given.results.critical[0], run.results.critical[0])


THREE_WAVES = """*HEADING
Column, clamped and hinged, with an imperfection of three half waves, between walls
*NODE
1, 0., 0.
2, 1., 0.
*LINE, ELSET=COLUMN, NSET=COLUMN, TYPE=GE8
1, 2{count}
*IMPERFECTION, ELSET=COLUMN, SHAPE=SINE
-0.0017619193674254295, 3
*BEAM SECTION, ELSET=COLUMN, SECTION=STIFFNESS
2294958644.332778, 1.
*BOUNDARY
{supports}
*OBSTACLE, NAME=TOP, TYPE=LINE
1., 0.0071057202493371085, 0., 0.0071057202493371085
*OBSTACLE, NAME=BOTTOM, TYPE=LINE
0., -0.020717616284337343, 1., -0.020717616284337343
*CONTACT, OBSTACLE=TOP, NSET=COLUMN
*CONTACT, OBSTACLE=BOTTOM, NSET=COLUMN
*MONITOR, NAME=short
2, U1, -1.
*STEP
{accuracy}*STATIC
{increments}
*CLOAD
2, 1, -9.869604401089358
*STOP
LOAD, ABOVE, 20.
*END STEP
"""


@dr.release_only
@pytest.mark.parametrize("supports, increments, accuracy", [
    ("1, PINNED\n2, 2\n2, 6", "0.3, 1E-12, 0.0035528601246685543", "1E-4"),
    ("1, ENCASTRE\n2, 2", "0.2045748", "1E-6"),
])
def test_what_a_short_line_becomes_begins_further_on(supports, increments, accuracy):
    """A line that is taken for none has a length still: the point holds from 5E-5 of the load on, where its curvature is that of the
    wall. Before, it would lie down again, and the path go back to where the line came from."""
    run = dr.run_deck(THREE_WAVES.format(count="", supports=supports, increments=increments,
                                         accuracy=f"*ACCURACY, TOLERANCE={accuracy}\n"))
    given = dr.run_deck(THREE_WAVES.format(count=", 24", supports=supports, increments=increments, accuracy=""))
    assert [c.label for c in run.results.critical] == [c.label for c in given.results.critical]
    assert [c.label for c in run.results.critical][:7] == ["C+", "LP", "C-", "C+", "LP", "C-", "LP"]
    for found, other in zip(run.results.critical, given.results.critical):
        within_bars(found, other)


PRESSED_DOWN = """*HEADING
Clamped arch that snaps until the node with the load comes down on a floor
*NODE
1, -0.6964012480165627, 0.7176526330760405
2, 0.1553199954193159, 0.9878642108219853
3, 0.6964012480165627, 0.7176526330760405
*ARC, ELSET=ARCH, NSET=ARCH, DIRECTION=CLOCKWISE, TYPE=GE8
1, 2, 0., 0.{count}
2, 3, 0., 0.{count}
*BEAM SECTION, ELSET=ARCH, SECTION=STIFFNESS
2423.35, 1.
*BOUNDARY
1, ENCASTRE
3, ENCASTRE
*MONITOR, NAME=v
2, U2, -1.
*MONITOR, NAME=push, OBSTACLE=FLOOR
RN
*OBSTACLE, NAME=FLOOR, TYPE=LINE
-3., {floor}, 3., {floor}
*CONTACT, OBSTACLE=FLOOR, NSET=ARCH
*STEP
{accuracy}*STATIC
0.5, 1E-10, 0.0141
*CLOAD
2, 2, -1.
*STOP
LOAD, ABOVE, 140.
*CONTROLS, POINTS=200
*END STEP
"""


@pytest.mark.parametrize("floor", [0.69769, 0.697])
@pytest.mark.parametrize("count, accuracy", [(", 12", ""), ("", "*ACCURACY, TOLERANCE=1E-6\n")])
def test_a_load_comes_down_on_a_floor(floor, count, accuracy):
    """From there on nothing moves that the load does not push along the floor, and all that it grows by goes straight into that. The
    rod comes down up to 5E-4 beside the node, where it is curved by 4.7 more than the floor, and rolls on to it, but never over."""
    run = dr.run_deck(PRESSED_DOWN.format(floor=floor, count=count, accuracy=accuracy))
    labels = [c.label for c in run.results.critical]
    assert labels == ["LP", "C+", "LP", "EP"]
    touch, least, end = run.results.critical[1:]
    assert least.point == touch.point
    rise = 0.5 * 4.8 * 5e-4**2
    assert touch.monitors["v"] == pytest.approx(0.9878642108219853 - floor, abs=rise)
    assert end.monitors["v"] == pytest.approx(0.9878642108219853 - floor, abs=1e-8)
    assert end.monitors["push"] == pytest.approx(end.load_factor - touch.load_factor, rel=2e-3)


def test_no_arc_is_too_long_where_nothing_moves():
    """A shallow arch pressed down on a floor by its middle stands there up to fifty times the load: increments double on the way, whatever
    the largest arc length."""
    text = PRESSED_DOWN.format(floor=0.9609246887716418, count=", 12", accuracy="")
    run = dr.run_deck(dr.changed(text, ("-0.6964012480165627, 0.7176526330760405", "-0.24028120770473685, 0.9707033229694607"),
                                 ("0.6964012480165627, 0.7176526330760405", "0.24028120770473685, 0.9707033229694607"),
                                 ("0.1553199954193159, 0.9878642108219853", "0., 1."), ("2423.35", "5506.19"), ("1E-10, 0.0141", "1E-10, 0.001465"),
                                 ("ABOVE, 140.", "ABOVE, 3300.")))
    touch, end = run.results.critical
    assert [touch.label, end.label] == ["C+", "EP"]
    assert end.point - touch.point <= 2 + math.log2(3300.0)
    dr.assert_close(touch.monitors["v"], 1.0 - 0.9609246887716418, relative=1e-9)
    dr.assert_close(end.monitors["push"], end.load_factor - touch.load_factor, relative=1e-9)


JACKED = """*HEADING
Half of a pipe on a floor, lifted by a jack and then pushed where it stands on it
*NODE
1, 0., 0.
2, {length}, 0.
*LINE, ELSET=P, NSET=P, TYPE=GE8
1, 2, {elements}
*BEAM SECTION, ELSET=P, SECTION=STIFFNESS
{section}
*BOUNDARY
1, XSYMM
2, ENCASTRE
*OBSTACLE, NAME=FLOOR, TYPE=LINE
-50., 0., 50., 0.
*CONTACT, OBSTACLE=FLOOR, NSET=P
*GAP, NAME=JACK
1
*MONITOR, NAME=height
1, U2
*STEP
*STATIC, METHOD=LOAD
1.
*DLOAD
P, PY, {weight}
*END STEP
*STEP
*STATIC, METHOD=LOAD
0.02, , 0.1
*OBSTACLE MOTION
JACK, 0., {lift}
*END STEP
"""
PUSHED = """*STEP
*STATIC
0.1, , 0.1
*CLOAD
1, 2, {push}
*STOP
LOAD, ABOVE, 1.
*END STEP
"""


@pytest.mark.parametrize("deck", [
    dict(length=4.2188, elements=6, section="1.1959e+08, 7947.2", weight=-77.485, lift=0.003075, push=47.912),
    dict(length=4.8944, elements=10, section="8951.3, 29.82", weight=-0.15052, lift=0.0010244, push=0.1),
    dict(length=6.0, elements=20, section="1e6, 100.", weight=-1.0, lift=0.01, push=-5.0)])
def test_a_push_that_the_jack_carries_alone_moves_nothing(deck):
    """The arc length of what an increment of the load left of its convergence error is none: increments stay increments of the load."""
    run = dr.run_deck((JACKED + PUSHED).format(**deck))
    assert [c.label for c in run.results.critical] == ["EP", "C+", "EP", "EP"]
    end = run.results.critical[-1]
    dr.assert_close(end.load_factor, 1.0, relative=1e-12)
    dr.assert_close(end.monitors["height"], deck["lift"], relative=1e-12)


@pytest.mark.parametrize("length, elements, section, weight, lift, down", [
    (4.223, 10, "2.4863e+07, 54537", -1806.7, 0.00099314, 0.0014453), (6.0, 20, "1e6, 100.", -1.0, 0.01, 0.015),
    (6.0, 20, "1e6, 100.", -1.0, 0.03, 0.04), (5.0, 12, "1e7, 1000.", -20.0, 0.002, 0.0021)])
def test_a_pipe_that_its_jack_lowers_on_to_the_floor(length, elements, section, weight, lift, down):
    """Its free part vanishes with the fourth root of the height, which no increment follows. As the pipe comes to lie on the floor the
    jack leaves it, and goes on alone."""
    lower = f"*STEP\n*STATIC, METHOD=LOAD\n0.1\n*OBSTACLE MOTION\nJACK, 0., {-down}\n*END STEP\n"
    run = dr.run_deck(JACKED.format(length=length, elements=elements, section=section, weight=weight, lift=lift) + lower)
    assert [c.label for c in run.results.critical] == ["EP", "C+", "EP", "C-", "EP"]
    leaves, end = run.results.critical[-2:]
    dr.assert_close(leaves.load_factor, lift / down, relative=1e-6)
    assert abs(end.monitors["height"]) <= 1e-12 * length
    contact = run.results.contact
    assert contact.count[-1] == 1
    dr.assert_close([contact.start[-1][0], contact.end[-1][0]], [0.0, length], absolute=1e-9)


EGG = """*HEADING
Half of a ring on a spring in an egg, pressed at its apex: it lies down on the wall at gaps of 1e-8 of its size
*NODE
1, 0., 1.
2, -0.6, -0.8
3, 0., -1.
*ARC, ELSET=ROD, NSET=ROD
1, 2, 0., 0.
2, 3, 0., 0.
*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS
52302., 1.
*BOUNDARY
1, XSYMM
3, XSYMM
*SPRING
3, 2, 0.441
*OBSTACLE, NAME=HOST, TYPE=SPLINE, ENDS=CLOSED
{egg}
*CONTACT, OBSTACLE=HOST, NSET=ROD
*MONITOR, NAME=push, OBSTACLE=HOST
RN
*STEP
*ACCURACY, TOLERANCE=1E-5
*STATIC
{first}, , {largest}
*CLOAD
1, 2, -0.5288
*DLOAD
ROD, P, 1.
*STOP
LOAD, ABOVE, 0.75
*END STEP
"""


def egg(room=0.009324127503247055, oval=0.011099273476526996):
    """Points of an egg, anticlockwise from its blunt end."""
    turn = [2.0 * math.pi * k / 16 for k in range(16)]
    radius = [1.0 + room + oval * (1.0 + 0.5 * math.cos(3.0 * t) + 0.5 * math.cos(t)) for t in turn]
    return "\n".join(f"{-r * math.sin(t)!r}, {r * math.cos(t)!r}" for t, r in zip(turn, radius))


@functools.cache
def ring_in_egg(first, largest, code=0):
    run = dr.run_deck(EGG.format(egg=egg(), first=first, largest=largest), code=code)
    return run.labelled("C+")


@pytest.mark.parametrize("first, largest", [(0.3, 0.01), (0.05, 0.004)])
def test_a_span_that_lies_down_is_no_contact_that_begins(first, largest):
    """The last free span before the plane of symmetry is closed, and need not open where a contact begins elsewhere: without the set of
    this contact the path jumped over the next one."""
    for found, same in zip(ring_in_egg(first, largest), ring_in_egg(0.14, 0.006226), strict=True):
        within_bars(found, same)


def test_contact_that_began_before_the_last_point():
    """The gap's error hides that contact has begun 3e-4 of the load before: the bar of what is found says so, and what comes next is
    found with the contact at its place."""
    for found, same in zip(ring_in_egg(0.14, 0.003, code=None), ring_in_egg(0.14, 0.006226), strict=True):
        assert found.error > 0.0
        within_bars(found, same)


@pytest.mark.parametrize("first, largest", [(0.4666, 0.02075), (0.2, 0.006)])
def test_a_coarse_mesh_knows_that_it_may_hide_a_contact(first, largest):
    """Two elements between the apex and the contact: the gap was off by 2e-4 where 4e-6 was taken for its error, and the runs stopped
    beyond where contact begins."""
    for found, same in zip(ring_in_egg(first, largest), ring_in_egg(0.14, 0.006226), strict=True):
        within_bars(found, same)


BETWEEN = """*HEADING
Arch between a floor that rises and a dome that comes down, on which it nearly lies
*NODE
1, -1., 0.
2, 0., 0.78
3, 1., 0.
*ARC, ELSET=ROD, NSET=ROD, DIRECTION=CLOCKWISE
1, 2, 0., -0.251025641025641
2, 3, 0., -0.251025641025641
*IMPERFECTION, ELSET=ROD, SHAPE=SINE
-0.00175, 3.
0.00395, 2.
-0.00178, 5.
*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS
870000., 1.
*BOUNDARY
2, 1
*SPRING
2, 2, 0.0186
2, 6, 0.109
*OBSTACLE, NAME=DOME, TYPE=CIRCLE, SIDE=OUTSIDE
-0.0974, 5.4511, 4.6617
*OBSTACLE, NAME=FLOOR, TYPE=LINE
-3., -0.009, 3., -0.009
*CONTACT, OBSTACLE=DOME, NSET=ROD
*CONTACT, OBSTACLE=FLOOR, NSET=ROD
*MONITOR, NAME=push, OBSTACLE=DOME
RN
*STEP
*ACCURACY, TOLERANCE=1E-5
*STATIC
{first}, , {largest}
*DLOAD
ROD, P, 0.666
*OBSTACLE MOTION
DOME, 0., -0.4793
FLOOR, 0., 0.1818
*STOP
LOAD, ABOVE, 0.92
*END STEP
"""


@pytest.mark.parametrize("first, largest, code", [(0.0027, 0.044, 0), (0.0008, 0.0133, 2)])
def test_bars_of_contact_that_began_before_the_last_point(first, largest, code):
    """Its error makes the mesh finer, and is told where that does not help. The load was off by up to 3e-4, without an estimate."""
    exact = dr.run_deck(BETWEEN.format(first=0.003, largest=0.05)).labelled("C+")[3]
    found = dr.run_deck(BETWEEN.format(first=first, largest=largest), code=code).labelled("C+")[3]
    assert exact.load_factor == pytest.approx(0.864178127, abs=2e-9) and exact.error < 1e-8
    within_bars(found, exact)


OCTAGON = """*HEADING
Ring that touches the eight sides of its cavity, clamped at one, under pressure and a force
*NODE
1, {clamp}
2, {top}
*ARC, ELSET=ROD, NSET=ROD
1, 2, 0., 0.
2, 1, 0., 0.
*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS
8150., 1.
*BOUNDARY
1, ENCASTRE
*OBSTACLE, NAME=HOST, TYPE=POLYLINE, ENDS=CLOSED, RADIUS=0.3257
{corners}
*CONTACT, OBSTACLE=HOST, NSET=ROD
*MONITOR, NAME=push, OBSTACLE=HOST
RN
*STEP
*ACCURACY, TOLERANCE=1E-5
*STATIC
{first}, , 0.007
*CLOAD
2, 2, -0.3928
*DLOAD
ROD, P, 1.
*STOP
LOAD, ABOVE, 0.4
*END STEP
"""


def test_contact_at_the_start_that_opens_and_comes_back():
    """Within the first increment: a contact that touches at the start and at its end pulls between."""
    def on_circle(turn, radius=1.0):
        return f"{radius * math.cos(turn)!r}, {radius * math.sin(turn)!r}"
    corners = "\n".join(on_circle(0.86932 + 0.25 * math.pi * k, 1.0 / math.cos(math.pi / 8.0)) for k in range(8))
    one, other = (dr.run_deck(OCTAGON.format(first=first, clamp=on_circle(-0.74745), top=on_circle(1.76703), corners=corners)).only("C+")
                  for first in (0.178, 0.01))
    assert other.load_factor == pytest.approx(0.1508, rel=1e-3)
    within_bars(one, other)


HEAVY = """*HEADING
Half of a heavy ring in an egg, clamped where it touches, a force on its apex
*NODE
1, 0., 1.
2, -0.99997412, -0.0071939
3, 0., -1.
*ARC, ELSET=ROD, NSET=ROD
1, 2, 0., 0.
2, 3, 0., 0.
*IMPERFECTION, ELSET=ROD, SHAPE=COSINE
-0.000175, 3.
*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS
4769.4, 1.
*BOUNDARY
1, XSYMM
3, ENCASTRE
*OBSTACLE, NAME=HOST, TYPE=SPLINE, ENDS=CLOSED
{egg}
*CONTACT, OBSTACLE=HOST, NSET=ROD
*MONITOR, NAME=push, OBSTACLE=HOST
RN
*STEP
*ACCURACY, TOLERANCE=1E-5
*STATIC
{first}, , {largest}
*CLOAD
1, 2, -0.09534
*DLOAD
ROD, PY, -1.
*STOP
LOAD, ABOVE, 0.45
*END STEP
"""


def test_a_flat_point_far_ahead_is_behind_other_changes():
    """At 0.40 a point is as curved as the wall. From 0.23 it was found, and two changes between were passed."""
    one, other = (dr.run_deck(HEAVY.format(egg=egg(0.000175, 0.03186), first=first, largest=largest)).labelled("C+")
                  for first, largest in ((0.1388, 0.0039), (0.4628, 0.013)))
    for found, same in zip(one, other, strict=True):
        within_bars(found, same)
    assert len(one) == 4


STRUT = """*HEADING
Clamped heavy strut between a floor and an inclined wall
*NODE
1, 0., 0.
2, 0.71248, 0.
3, 1., 0.
*LINE, ELSET=ROD, NSET=ROD, TYPE=GE8
1, 2
2, 3
*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS
2776181.8, 1., , 0., 0.
*IMPERFECTION, ELSET=ROD, SHAPE=SINE
-0.0007219, 6.
0.0010508, 5.
*BOUNDARY
1, ENCASTRE
3, 2
*OBSTACLE, NAME=UP, TYPE=LINE
1., 0.011851766, 0., 0.0109393
*CONTACT, OBSTACLE=UP, NSET=ROD
*OBSTACLE, NAME=LOW, TYPE=LINE
0., -0.0298823, 1., -0.0298823
*CONTACT, OBSTACLE=LOW, NSET=ROD
*MONITOR, NAME=short
3, U1, -1.
*STEP
*ACCURACY, TOLERANCE=1E-5
*STATIC, METHOD=CYLINDRICAL
{first}, , {largest}
*CLOAD
3, 1, -9.869604401089358
2, 2, 0.13827
*DLOAD
ROD, PY, 0.49652
*STOP
LOAD, ABOVE, 13.959
short, ABOVE, 0.2
*END STEP
"""


def test_a_set_that_is_valid_only_far_behind_a_change_does_not_follow_it():
    """At 8.51 a contact is lost; a set with one contact more satisfies all tests, too, but only further on."""
    one, other = (dr.run_deck(STRUT.format(first=first, largest=largest)).results.critical
                  for first, largest in ((0.032016, 0.0058456), (0.0096, 0.00175)))
    assert [c.label for c in one] == [c.label for c in other]
    for found, same in zip(one, other):
        within_bars(found, same)


HALF_RING = """*HEADING
Half of a ring in a host of another shape, pressed from outside and lifted a little at its crown
*NODE
1, 0., 1.
2, -0.511506, 0.8592797
3, 0., -1.
*ARC, ELSET=ROD, NSET=ROD, TYPE=GE8
1, 2, 0., 0.
2, 3, 0., 0.
*IMPERFECTION, ELSET=ROD, SHAPE=COSINE
0.000100545, 3.
*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS
130293.33, 1., , 0., 1.
*BOUNDARY
1, XSYMM
3, ENCASTRE
*OBSTACLE, NAME=HOST, TYPE=SPLINE, ENDS=CLOSED
0.0000000, 1.0064495
-0.3847304, 0.9288212
-0.7094226, 0.7094226
-0.9261116, 0.3836080
-1.0032750, 0.0000000
-0.9276989, -0.3842655
-0.7094226, -0.7094226
-0.3831431, -0.9249893
-0.0000000, -1.0001005
0.3831431, -0.9249893
0.7094226, -0.7094226
0.9276989, -0.3842655
1.0032750, -0.0000000
0.9261116, 0.3836080
0.7094226, 0.7094226
0.3847304, 0.9288212
*CONTACT, OBSTACLE=HOST, NSET=ROD
*STEP
*ACCURACY, TOLERANCE=1E-5
*STATIC, METHOD=CYLINDRICAL
{first}, , {largest}
*CLOAD
1, 2, -0.00116834
*DLOAD
ROD, P, 1.
*STOP
LOAD, ABOVE, 15.
*END STEP
"""


def test_spans_are_not_sought_further_ahead_than_the_last_increment_shows():
    """At 6.59 the rod lies down beside its clamp, at 9.60 its two contacts merge. From 2.61 both spans seemed to close at 9.60 only."""
    one, other = (dr.run_deck(HALF_RING.format(first=first, largest=largest)).labelled("C+")
                  for first, largest in ((0.242, 0.03043), (0.0726, 0.00913)))
    for found, same in zip(one, other, strict=True):
        within_bars(found, same)
    assert len(one) == 6


LEAVING = """*HEADING
Half of a heavy ring in a host, pressed onto its crown, whose contact leaves the plane of symmetry
*NODE
1, 0., 1.
2, -0.5398904741530476, 0.8417352766272763
3, 0., -1.
*ARC, ELSET=ROD, NSET=ROD, TYPE=GE8
1, 2, 0., 0.
2, 3, 0., 0.
*IMPERFECTION, ELSET=ROD, SHAPE=COSINE
4.9857973817045916e-05, 3.
-0.00036225197264807364, 6.
*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS
163273.02067987475, 1., , 0., 1.
*BOUNDARY
1, XSYMM
3, ENCASTRE
*OBSTACLE, NAME=HOST, TYPE=CIRCLE, SIDE=INSIDE
0., 0., 1.0004121099464651
*CONTACT, OBSTACLE=HOST, NSET=ROD
*MONITOR, NAME=push, OBSTACLE=HOST
RN
*MONITOR, NAME=v
1, U2, -1.
*MONITOR, NAME=u
2, U1, 1.
*STEP
*ACCURACY, TOLERANCE=1E-5
*STATIC, METHOD=CYLINDRICAL
{first}, , {largest}
*CLOAD
1, 2, -0.08362222965041548
*DLOAD
ROD, PY, 1.
*STOP
LOAD, ABOVE, 0.1
*END STEP
"""


def test_a_point_that_has_left_a_plane_of_symmetry_gains_no_contact():
    """The gap between the point and the plane is below zero by what a mesh errs by; the point becomes a line, which is no gain."""
    for first, largest in ((0.03771872930195382, 0.014757498054779892), (0.011315618790586146, 0.0044272494164339675)):
        run = dr.run_deck(LEAVING.format(first=first, largest=largest))
        assert [c.label for c in run.results.critical] == ["C+", "EP"]


SNAPPED_ARCH = """*HEADING
Imperfect arch that snaps onto an inclined bed
*NODE
1, -0.5, 0.
2, -0.23198145, 0.26862655
3, 0.5, 0.
*ARC, ELSET=ROD, NSET=ROD, TYPE=GE8, DIRECTION=CLOCKWISE
1, 2, 0., -0.230849081
*ARC, ELSET=ROD, NSET=ROD, TYPE=GE8, DIRECTION=CLOCKWISE
2, 3, 0., -0.230849081
*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS
176779.24, 1., , 0., 0.
*IMPERFECTION, ELSET=ROD, SHAPE=SINE
-0.0025879, 5.
-0.0048542, 4.
-0.0035371, 2.
*BOUNDARY
1, PINNED
3, PINNED
*OBSTACLE, NAME=BED, TYPE=LINE
-1., -0.04028, 1., -0.02028
*CONTACT, OBSTACLE=BED, NSET=ROD
*MONITOR, NAME=v
2, U2, -1.
*STEP
*ACCURACY, TOLERANCE=1E-5
*STATIC, METHOD=CYLINDRICAL
{first}, , {largest}
*DLOAD
ROD, PY, -40.
*STOP
v, ABOVE, 0.32
LOAD, ABOVE, 5.
*END STEP
"""


@pytest.mark.parametrize("first, largest", [(0.0154, 0.0416), (0.02, 0.05), (0.0046, 0.0125)])
def test_a_line_that_opens_and_closes_within_an_increment(first, largest):
    """Its least pressure falls below zero and is found at another place, greater than zero, at the end of the increment."""
    run = dr.run_deck(SNAPPED_ARCH.format(first=first, largest=largest))
    changes = [c for c in run.results.critical if c.label in ("C+", "C-")]
    assert [c.label for c in changes] == ["C+", "C-", "C+"]
    for change, load in zip(changes, (0.82737, 1.98620, 2.25504)):
        assert change.load_factor == pytest.approx(load, rel=1e-3)

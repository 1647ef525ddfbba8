"""Obstacles that are curves or move: the same surface said in different ways, closed forms, and separate solutions.

The exact solutions of the indenter and the cradle come from the elastica beside the contact arc, integrated here: on the
arc the rod has the obstacle's curvature, so that moment and direction at its end are known; beyond it only the supports
or the dead force act. The rod there is inextensible, that of the decks nearly (EA = 1e8).
"""
import functools
import math

import numpy as np
import pytest

import deck_runner as dr

STRETCH = 1e-6      # of everything in the decks indenter and cradle: forces up to 25 over EA, and what it does to angles


# The same surface, said in different ways ------------------------------------------------------------------------

def on_an_obstacle(obstacle, elements=20):
    """The column of column.inp beside another wall."""
    text = dr.on_given_mesh("column")
    text = text[:text.index("*OBSTACLE")] + obstacle + text[text.index("*CONTACT"):]
    return dr.changed(text, ("1, 2, 40", f"1, 2, {elements}"), ("2, 3, 40", f"2, 3, {elements}"))


def drum(kind, points=0):
    """A drum of radius 2 above the column; from right to left, so that the column is on the left."""
    if kind == "CIRCLE":
        return "*OBSTACLE, NAME=WALL, TYPE=CIRCLE, SIDE=OUTSIDE\n0.5, 2.02, 2.\n"
    if kind == "ARC":
        return "*OBSTACLE, NAME=WALL, TYPE=ARC\n0.5, 2.02, 2., -60., -120.\n"
    angles = np.radians(np.linspace(-60.0, -120.0, points + 1))
    return "*OBSTACLE, NAME=WALL, TYPE=SPLINE\n" + "".join(
        f"{0.5 + 2.0 * math.cos(angle):.15g}, {2.02 + 2.0 * math.sin(angle):.15g}\n" for angle in angles)


@functools.cache
def beside_drum(kind, points=0, elements=20):
    return dr.run_deck(dr.changed(on_an_obstacle(drum(kind, points), elements), ("TYPE=GE6", "TYPE=GE4")),
                       code=0)


def events(run):
    return [critical.label for critical in run.results.critical], np.array([c.load_factor for c in run.results.critical])


def test_arc_and_circle_are_the_same():
    labels, loads = events(beside_drum("ARC"))
    assert labels == ["C+", "LP", "C-", "LP", "EP"]
    assert labels == events(beside_drum("CIRCLE"))[0]
    # Located to 1e-8, both by the same steps but for rounding.
    dr.assert_close(loads, events(beside_drum("CIRCLE"))[1], relative=1e-8)


@pytest.mark.parametrize("points, close", [(40, 1e-6), (160, 1e-8)])
def test_spline_through_points_of_a_circle(points, close):
    """Its place errs by the fourth power of the angle between points over 384 (1e-10 radii, gap 0.01), its curvature
    by the square of it over 12, which the rod beside the contact point hardly sees."""
    labels, loads = events(beside_drum("SPLINE", points))
    assert labels == events(beside_drum("CIRCLE"))[0]
    dr.assert_close(loads, events(beside_drum("CIRCLE"))[1], relative=close)


@dr.release_only
@pytest.mark.parametrize("number", [0, 1, 2])
def test_events_on_a_spline_converge_at_fourth_order(number):
    """Against the next finer mesh: differences fall by 16."""
    loads = [events(beside_drum("SPLINE", 160, n))[1][number] for n in (10, 20, 40, 80)]
    dr.assert_mean_order(np.diff(loads), 4.0, below=0.5, above=1.5)


def test_polyline_with_corners_out_of_reach_is_a_line():
    polyline = "*OBSTACLE, NAME=WALL, TYPE=POLYLINE, RADIUS=0.1\n2., -0.5\n1.5, 0.02\n-0.5, 0.02\n-1., -0.5\n"
    line = dr.run_deck(on_an_obstacle("*OBSTACLE, NAME=WALL, TYPE=LINE\n1., 0.02, 0., 0.02\n"))
    labels, loads = events(dr.run_deck(on_an_obstacle(polyline)))
    assert labels == events(line)[0]
    dr.assert_close(loads, events(line)[1], relative=1e-8)


def test_contact_angles_on_an_arc():
    run = dr.run_deck(dr.changed(dr.on_given_mesh("ring"), ("RING, NSET=RING, TYPE=GE4", "RING, NSET=RING, TYPE=GE4"),
                                 ("TYPE=CIRCLE, SIDE=INSIDE, REFERENCE=90.", "TYPE=ARC, REFERENCE=90."),
                                 ("0., 0., 1.\n*CONTACT", "0., 0., 1., 90., 270.\n*CONTACT"), ("0., 160, 6.", "0., 40")))
    circle = dr.run_deck(dr.changed(dr.on_given_mesh("ring"), ("0., 160, 6.", "0., 40")))
    dr.assert_close(run.load("LP"), circle.load("LP"), relative=1e-7)
    rows = run.labelled("LP")[0].point - 1, circle.labelled("LP")[0].point - 1
    dr.assert_close(dr.regions(run, "angle_start")[rows[0]], dr.regions(circle, "angle_start")[rows[1]], absolute=1e-4)


# A moving roller ---------------------------------------------------------------------------------------------------

def elastica(start, length, slope, push, steps=400):
    """x, y, direction and curvature at the end of a rod, from `start`, under vertical forces: EI k' = slope(direction)."""
    h = length / steps
    y = np.array(start, float)

    def rate(state):
        return np.array([math.cos(state[2]), math.sin(state[2]), state[3], slope * push * math.cos(state[2])])

    for _ in range(steps):
        a = rate(y)
        b = rate(y + h / 2 * a)
        c = rate(y + h / 2 * b)
        y = y + h / 6 * (a + 2 * b + 2 * c + rate(y + h * c))
    return y


def secant(function, first, second):
    values = function(first), function(second)
    for _ in range(60):
        first, second = second, second - values[1] * (second - first) / (values[1] - values[0])
        values = values[1], function(second)
        if abs(values[1]) < 1e-13 or second == first:
            return second
    raise AssertionError("no zero found")


def roller(angle, radius=0.4, half=0.5):
    """Force on the whole beam and deflection of its middle when it leaves the roller at this angle."""
    free = half - radius * angle
    start = (radius * math.sin(angle), radius * (1.0 - math.cos(angle)), angle, 1.0 / radius)
    push = secant(lambda v: elastica(start, free, -1.0, v)[3], 1.0 / (radius * free), 1.05 / (radius * free))
    return 2.0 * push, elastica(start, free, -1.0, push)[1]


def roller_at(deflection):
    angle = secant(lambda phi: roller(phi)[1] - deflection, 0.2, 0.3)
    return angle, roller(angle)[0]


@functools.cache
def indenter(elements, locate="w, 0.001, 0.225, 0.235"):
    return dr.run_deck(dr.changed(dr.on_given_mesh("indenter"), ("1, 2, 40", f"1, 2, {elements}"), ("force, 5., 15.", locate)))


def located(run, monitor, value):
    found = [c for c in run.labelled("UZ") if c.located and abs(c.monitors[monitor] - value) <= 1e-7 * abs(value)]
    assert len(found) == 1, f"{monitor} = {value}: {len(found)} points"
    return found[0]


def test_point_force_while_deflections_are_small():
    """F = 48 EI w/L^3; large rotations add terms of (w/L)^2 = 1e-6, of which there are some."""
    dr.assert_close(located(indenter(20), "w", 0.001).monitors["force"], 0.048, relative=1e-5)


@pytest.mark.parametrize("w", [0.225, 0.235])
def test_beam_around_a_roller(w):
    angle, force = roller_at(w)
    run = indenter(40)
    point = located(run, "w", w)
    dr.assert_close(point.monitors["force"], force, relative=STRETCH)
    region, = run.results.contact.regions(point.point)
    dr.assert_close([np.radians(region.angle_end), region.end / 0.4], [angle, angle], relative=2 * STRETCH)
    dr.assert_close([region.start, region.angle_start], [0.0, 0.0], absolute=1e-9)


def test_indenter_converges():
    """Against 80 elements; the contact point lies anywhere between the nodes, so errors jump a little."""
    forces = [located(indenter(n), "w", 0.235).monitors["force"] for n in (10, 20, 40, 80)]
    dr.assert_mean_order(np.array(forces[:3]) - forces[3], 4.0, below=0.5, above=2.5)


def test_force_of_the_indenter_is_located():
    run = indenter(40, "force, 5., 15.")
    for force in (5.0, 15.0):
        dr.assert_close(located(run, "force", force).monitors["force"], force, relative=1e-7)


def test_path_may_stop_at_a_force():
    run = dr.run_deck(dr.changed(dr.on_given_mesh("indenter"), ("*FIELD", "*STOP\nforce, ABOVE, 10.\n*FIELD")))
    dr.assert_close(run.only("EP").monitors["force"], 10.0, relative=1e-7)
    assert run.results.column("force").values[-1] == run.only("EP").monitors["force"]


def test_moving_the_supports_instead():
    """The roller stays and the beam comes: the same forces at the same distance."""
    still = dr.changed(dr.on_given_mesh("indenter"), ("*OBSTACLE MOTION\nROLLER, 0., -0.25", "*BOUNDARY\n2, 2, 2, 0.25"),
                       ("force, 5., 15.", "LOAD, 0.3, 0.95"))
    moved = dr.run_deck(dr.changed(dr.on_given_mesh("indenter"), ("force, 5., 15.", "LOAD, 0.3, 0.95")))
    still = dr.run_deck(still)
    for k in range(2):
        dr.assert_close(still.labelled("UZ")[k].monitors["force"], moved.labelled("UZ")[k].monitors["force"], relative=1e-8)
    assert still.results.contact.obstacle_shift is None


@pytest.mark.parametrize("method, data", [("CYLINDRICAL", "0.04, 1e-9, 0.05"), ("SPHERICAL", "0.04, 1e-9, 0.05"),
                                          ("DISPLACEMENT, MONITOR=w", "0.01, 1e-7, 0.02")])
@pytest.mark.parametrize("foundation", ["", ", FOUNDATION=WINKLER, MODULUS=1e5"])
def test_strategies_follow_a_moving_roller(method, data, foundation):
    text = dr.changed(dr.on_given_mesh("indenter"), ("force, 5., 15.", "LOAD, 0.3, 0.6"), ("REFERENCE=-90.", "REFERENCE=-90." + foundation),
                      ("POINTS=ALONG", "POINTS=AUTO"))
    loads = dr.run_deck(text).labelled("UZ")
    others = dr.run_deck(dr.with_static(dr.changed(text, ("*FIELD", "*STOP\nLOAD, ABOVE, 0.7\n*FIELD")), f"METHOD={method}",
                                        data)).labelled("UZ")
    dr.assert_close([c.monitors["force"] for c in others], [c.monitors["force"] for c in loads], relative=1e-7)


def test_motions_of_steps_add_up():
    """Down in one step, a load in the next while the roller stays, then up again: the beam is free and straight. With contact
    at nodes: spans find no way on behind the point where the beam slides along the roller and lifts off."""
    text = dr.on_given_mesh("indenter").replace("POINTS=ALONG", "POINTS=NODES")
    text = text[:text.index("*LOCATE")].replace("ROLLER, 0., -0.25", "ROLLER, 0., -0.1") + "*END STEP\n"
    text += "*STEP\n*STATIC, METHOD=LOAD\n0.5\n*CLOAD\n2, 6, 0.1\n*END STEP\n"
    text += "*STEP\n*STATIC, METHOD=LOAD\n0.1\n*OBSTACLE MOTION\nROLLER, 0., 0.15\nROLLER, 0.05, 0.\n*CLOAD\n2, 6, -0.1\n*END STEP\n"
    run = dr.run_deck(text)
    step = run.column("step")
    shift = run.results.contact.obstacle_shift[:, 0, :]
    last = [np.flatnonzero(step == k)[-1] for k in (1, 2, 3)]
    dr.assert_close(shift[last], [(0.0, -0.1), (0.0, -0.1), (0.05, 0.05)], absolute=1e-14)
    dr.assert_close(run.column("w")[last[0]], 0.1, relative=1e-9)
    assert run.column("force")[last[1]] != run.column("force")[last[0]]
    assert run.only("C-").step == 3
    dr.assert_close([run.column("force")[-1], run.column("w")[-1]], [0.0, 0.0], absolute=1e-9)
    assert run.results.obstacles_at(run.results.n_points)[0].centre == pytest.approx((0.05, 0.45))


def test_roller_that_comes_from_afar():
    """Nothing happens until it touches, which is found where it must be."""
    run = dr.run_deck(dr.changed(dr.on_given_mesh("indenter"), ("0., 0.4, 0.4", "0., 0.5, 0.4"),
                                 ("force, 5., 15.", "w, 0.1"), ("*LOCATE", "*CONTROLS, LOCATE=1e-9\n*LOCATE")))
    dr.assert_close(run.only("C+").load_factor, 0.1 / 0.25, relative=1e-8)
    dr.assert_close(located(run, "w", 0.1).load_factor, 0.2 / 0.25, relative=1e-8)


# A rod in a cradle --------------------------------------------------------------------------------------------------

def cradle(angle, radius=1.0, own=0.5, half=0.6):
    """Dead force at each end that spreads the contact to this angle."""
    free = half - radius * angle
    start = (radius * math.sin(angle), radius * (1.0 - math.cos(angle)), angle, 1.0 / radius)
    guess = (1.0 / own - 1.0 / radius) / free
    return secant(lambda p: elastica(start, free, 1.0, p)[3] - 1.0 / own, guess, 1.05 * guess)


@pytest.mark.parametrize("force", [3.0, 4.0])
def test_contact_spreads_in_a_cradle(force):
    angle = secant(lambda phi: cradle(phi) - force, 0.2, 0.25)
    run = dr.run_deck(dr.on_given_mesh("cradle"))
    point = located_load(run, force)
    region, = run.results.contact.regions(point.point)
    dr.assert_close([np.radians(region.angle_end), region.end], [angle, angle], relative=2e-6)
    dr.assert_close(point.monitors["thrust"], force, relative=1e-9)


def located_load(run, value):
    found = [c for c in run.labelled("UZ") if c.located and abs(c.load_factor - value) <= 1e-7 * abs(value)]
    assert len(found) == 1
    return found[0]


# A pipe over two humps ---------------------------------------------------------------------------------------------

@functools.cache
def pipe(elements):
    return dr.run_deck(dr.changed(dr.on_given_mesh("pipe-humps"), ("1, 2, 80", f"1, 2, {elements}")))


def test_ground_carries_the_pipe():
    run = pipe(80)
    dr.assert_close(run.column("ground"), 20.0 * run.column("load_factor"), absolute=1e-7)


def test_pipe_lies_down_from_its_end_then_in_the_valley():
    run = pipe(80)
    assert [c.label for c in run.results.critical][-2:] == ["C+", "EP"]
    assert len(run.results.contact.regions(run.results.n_points)) == 3
    valley = run.labelled("C+")[-1]
    # The ground in the middle: 0.2 exp(-1/0.45^2), the pipe began on the humps.
    top, bottom = 0.1 * (1.0 + math.exp(-(2.0 / 0.45)**2)), 0.2 * math.exp(-(1.0 / 0.45)**2)
    dr.assert_close(valley.monitors["valley"], bottom - top, absolute=1e-6)


@dr.release_only
@pytest.mark.parametrize("elements, error", [(80, 2e-7), (160, 4e-8), (320, 1e-8)])
def test_valley_load_on_any_mesh(elements, error):
    """The spline's curvature has kinks inside the elements, and meshes are made anew as spans grow: orders are not clean."""
    dr.assert_close(pipe(elements).labelled("C+")[-1].load_factor, pipe(640).labelled("C+")[-1].load_factor, relative=error)


def test_whole_pipe_is_symmetric():
    text = dr.on_given_mesh("pipe-humps")
    lines = [line for line in text.splitlines() if line.startswith(("1, 0.,", "2, 4.,"))]
    top = lines[0].split(",")[2]
    whole = dr.run_deck(dr.changed(
        text, (lines[0], f"1, 0.,{top}\n3, -4.,{top}"), ("1, 2, 80", "3, 1, 40\n1, 2, 40"), ("1, XSYMM", "1, 1"),
        ("*STEP", "*MONITOR, NAME=left\n3, U2\n*MONITOR, NAME=right\n2, U2\n*MONITOR, NAME=sideways, OBSTACLE=GROUND\nRF1\n*STEP")))
    half = pipe(40)
    dr.assert_close(whole.column("left"), whole.column("right"), absolute=1e-8)
    dr.assert_close(whole.column("sideways"), 0.0 * whole.column("left"), absolute=1e-7)
    dr.assert_close(whole.labelled("C+")[-1].load_factor, half.labelled("C+")[-1].load_factor, relative=1e-7)
    for region, mirror in zip(whole.results.contact.regions(whole.results.n_points),
                              whole.results.contact.regions(whole.results.n_points)[::-1]):
        dr.assert_close([region.start, region.end], [8.0 - mirror.end, 8.0 - mirror.start], absolute=1e-6)


# The result file -----------------------------------------------------------------------------------------------------

def test_obstacles_of_the_result_file():
    arc = beside_drum("ARC").results.obstacles["WALL"]
    assert (arc.kind, arc.side, arc.number, arc.radius) == ("arc", "left", 1, 2.0)
    dr.assert_close(arc.angles, [-60.0, -120.0], relative=1e-14)
    dr.assert_close(np.hypot(*(arc.surface - arc.centre).T), np.full(len(arc.surface), 2.0), relative=1e-14)
    spline = beside_drum("SPLINE", 40).results.obstacles["WALL"]
    assert (spline.kind, spline.points.shape) == ("spline", (41, 2))
    dr.assert_close(np.hypot(*(spline.surface - (0.5, 2.02)).T), np.full(len(spline.surface), 2.0), absolute=1e-4)


# A trench whose bottom nothing reaches ------------------------------------------------------------------------------------------

TRENCH = """*HEADING
Pipe over half of a trench
*NODE
1, 0., 0.
2, 3., 0.
*LINE, ELSET=PIPE, NSET=PIPE, TYPE=GE8
1, 2{elements}
*BEAM SECTION, ELSET=PIPE, SECTION=STIFFNESS
1e6, 1.
*BOUNDARY
1, 1
1, 6
*OBSTACLE, NAME=GROUND, TYPE=POLYLINE, RADIUS=0.1
-5., {floor}
0.3, {floor}
0.5, 0.
4., 0.
*CONTACT, OBSTACLE=GROUND, NSET=PIPE, POINTS={points}
*MONITOR, NAME=sag
1, U2, -1.
*STEP
*STATIC, METHOD=LOAD
0.1
*DLOAD
PIPE, PY, -1.
*END STEP
"""


@pytest.mark.parametrize("floor", [-0.1, -0.3])
def test_no_rod_lies_in_a_hollow_corner(floor):
    """It would have to bend at once. The sag is that over the same trench with contact at nodes, and proportional to the load."""
    run = dr.run_deck(TRENCH.format(elements=", 32", floor=floor, points="ALONG"))
    nodes = dr.run_deck(TRENCH.format(elements=", 240", floor=floor, points="NODES"))
    dr.assert_close(run.column("sag")[-1], nodes.column("sag")[-1], relative=2e-2)
    dr.assert_close(run.column("sag")[1] / run.column("sag")[-1], run.column("load_factor")[1], relative=2e-2)
    assert np.all(run.column("sag") < 0.1 * abs(floor))

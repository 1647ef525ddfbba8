"""Heavy rods on uneven ground: pipelines over humps, hollows and trenches, which touch from the start or come down on the way."""
import math

import numpy as np
import pytest

import deck_runner as dr

MESHES = ["", ", 8"]


def pipe(nodes, obstacles, boundary, steps, elements="", axial=1e6, monitors=""):
    """A rod of EI = 1 through nodes (x, y), on obstacles (TYPE and what follows, data lines)."""
    lines = "".join(f"{k}, {k + 1}{elements}\n" for k in range(1, len(nodes)))
    ground = "".join(f"*OBSTACLE, NAME=GROUND{k}, TYPE={kind}\n{data}*CONTACT, OBSTACLE=GROUND{k}, NSET=PIPE\n"
                     f"*MONITOR, NAME=ground{k}, OBSTACLE=GROUND{k}\nRF2\n" for k, (kind, data) in enumerate(obstacles))
    return ("*HEADING\nA pipe\n*NODE\n" + "".join(f"{k}, {x:.15g}, {y:.15g}\n" for k, (x, y) in enumerate(nodes, 1))
            + f"*LINE, ELSET=PIPE, NSET=PIPE, TYPE=GE8\n{lines}*BEAM SECTION, ELSET=PIPE, SECTION=STIFFNESS\n{axial}, 1.\n"
            + f"*BOUNDARY\n{boundary}{ground}{monitors}" + "".join(
                "*STEP\n" + ("" if elements else "*ACCURACY, TOLERANCE=1E-6\n") + f"*STATIC, METHOD=LOAD\n0.05, 1e-6, 0.1\n{loads}*END STEP\n"
                for loads in steps))


def weight(q):
    return f"*DLOAD\nPIPE, PY, {-q}\n"


def points(values):
    return "".join(f"{x:.15g}, {y:.15g}\n" for x, y in values)


def only_real_root(coefficients):
    return [root.real for root in np.roots(coefficients) if abs(root.imag) < 1e-9 and root.real > 0.0][0]


# Trenches ---------------------------------------------------------------------------------------------------------------------------

@pytest.mark.parametrize("mirror", [1.0, -1.0])
@pytest.mark.parametrize("elements", MESHES)
def test_free_span_over_a_trench(elements, mirror):
    """It rests on both edges, 2 c apart, and is lifted from the ground behind them over the length a: there it is
    q x^3 (a - x)/(24 EI) above, x from where it leaves the ground, at the edge its moment is q a^2/4 and its slope q a^3/(24 EI). In the
    middle it is level: (a/c)^3 + 6 (a/c)^2 = 8. An edge carries q (c + 3 a/4)."""
    q, c, radius = 2e-5, 3.0, 0.1
    turn = math.atan2(0.2, 0.5)
    cut = radius * math.tan(0.5 * turn)          # from the end of the flat to the corner
    edges = 8.0, 8.0 + 2.0 * c
    ground = [(-9.0, 0.0), (edges[0] + cut, 0.0), (edges[0] + cut + 0.5, -0.2), (edges[1] - cut - 0.5, -0.2), (edges[1] - cut, 0.0), (40.0, 0.0)]
    text = pipe([(0.0, 0.0), (mirror * (8.0 + c), 0.0), (mirror * 23.0, 0.0)],
                [(f"POLYLINE, RADIUS={radius}", points([(mirror * x, y) for x, y in ground][::int(mirror)]))], "1, 1\n", [weight(q)],
                elements=elements, monitors="*MONITOR, NAME=sag\n2, U2, -1\n")
    run = dr.run_deck(text)
    a = c * only_real_root([1.0, 6.0, 0.0, -8.0])
    sag = q * (a**3 * c / 24.0 + a**2 * c**2 / 8.0 - c**4 / 8.0)
    # Slopes are below 1e-3, and the edges round by as much of their radius.
    dr.assert_close(run.column("sag")[-1], sag, relative=1e-5)
    spans = sorted((region.start, region.end) for region in run.results.contact.regions(run.results.n_points))
    dr.assert_close(np.array(spans), np.array([(0.0, edges[0] - a), (edges[0], edges[0]), (edges[1], edges[1]), (edges[1] + a, 23.0)]),
                    absolute=1e-3)
    dr.assert_close(run.column("ground0")[-1], 23.0 * q, relative=1e-6)


# What touches between nodes at the start -----------------------------------------------------------------------------------------------

@pytest.mark.parametrize("elements", MESHES)
def test_pipe_on_one_pile(elements):
    """Guided at one end (a symmetry), it rests on a pile at x = a, where no node is: it carries everything. M = M0 - q x^2/2 up to there,
    -q (L - x)^2/2 behind."""
    q, length, a = 1e-6, 10.0, 6.1
    run = dr.run_deck(pipe([(0.0, 5.0), (length, 5.0)], [("CIRCLE, SIDE=OUTSIDE", f"{a}, 0., 5.\n")], "1, XSYMM\n", [weight(q)],
                           elements=elements, monitors="*MONITOR, NAME=guide\n1, U2\n*MONITOR, NAME=end\n2, U2\n"))
    b = length - a
    moment = 0.5 * q * (a**2 - b**2)
    slope = moment * a - q * a**3 / 6.0
    dr.assert_close(run.column("ground0")[-1], q * length, relative=1e-6)
    dr.assert_close(run.column("guide")[-1], q * a**4 / 24.0 - 0.5 * moment * a**2, relative=1e-3)
    dr.assert_close(run.column("end")[-1], slope * b - q * b**4 / 8.0, relative=1e-3)


# A hinge on the ground -----------------------------------------------------------------------------------------------------------------

@pytest.mark.parametrize("elements", MESHES)
def test_pipe_lifted_off_its_hinge_and_laid_down_again(elements):
    """Lifted by h at its end a pipe is suspended over s, h = q s^4/(24 EI): contact ends at its hinge, and begins there again, where
    s is all of it."""
    q, length = 1e-5, 10.0
    height = q * length**4 / 24.0
    run = dr.run_deck(pipe([(0.0, 0.0), (length, 0.0)], [("LINE", "0., 0., 1., 0.\n")], "1, PINNED\n2, 2\n",
                           [weight(q), f"*BOUNDARY\n2, 2, 2, {2.0 * height}\n", f"*BOUNDARY\n2, 2, 2, {-1.25 * height}\n"], elements=elements))
    lost, gained = run.labelled("C-"), run.labelled("C+")
    assert [critical.step for critical in lost + gained] == [2, 3]
    # Squares of slopes are 4e-6.
    dr.assert_close(lost[0].load_factor, 0.5, relative=4e-6)
    assert lost[0].error < 1e-6
    dr.assert_close(gained[0].load_factor, 0.8, relative=1e-5)


def test_a_long_pipe_lifted_by_little():
    """Lifted by h = q s^4/(24 EI) at its end it is suspended over s, less than a thousandth of it. What still lies does not move, however
    long it is: increments are those of a short pipe."""
    length, height = 1000.0, 0.01
    text = pipe([(0.0, 0.0), (length, 0.0)], [("LINE", "0., 0., 1., 0.\n")], "1, 1\n2, 2\n",
                [weight(1.0), f"*BOUNDARY\n2, 2, 2, {height}\n"], elements=", 100")
    run = dr.run_deck(dr.changed(text, ("GE8", "GE4")))
    assert run.results.n_points <= 40
    lying, = run.results.contact.regions(run.results.n_points)
    dr.assert_close(length - lying.end, (24.0 * height) ** 0.25, relative=1e-3)


# Splines ---------------------------------------------------------------------------------------------------------------------------------

@pytest.mark.parametrize("number, close", [(20, 1e-4), (40, 1e-5)])
def test_rod_in_a_hollow_spline(number, close):
    """A spline through points of a circle presses a heavy rod that lies along it all along, as the circle does: their curvatures
    differ by the fourth power of the angle between points, their curvatures' second derivatives, times EI a part of the pressure,
    by the square of it."""
    angles = np.radians(np.linspace(200.0, 340.0, number + 1))
    text = dr.changed(dr.example("cradle"), ("2, 2, -1.\n", "2, 2, -1.\n*DLOAD\nROD, PY, -1.\n"))
    start = text.index("*OBSTACLE")
    hollow = "*OBSTACLE, NAME=CRADLE, TYPE=SPLINE\n" + points((math.cos(a), 1.0 + math.sin(a)) for a in angles)
    spline, circle = dr.run_deck(text[:start] + hollow + text[text.index("*CONTACT"):]), dr.run_deck(text)
    for one, other in zip(spline.labelled("UZ"), circle.labelled("UZ"), strict=True):
        dr.assert_close(one.monitors["thrust"], other.monitors["thrust"], relative=1e-6)
        dr.assert_close(one.monitors["spread"], other.monitors["spread"], relative=close)
    assert spline.results.accuracy["tension"] <= 0.0


def lying_beam(ground, length, q, parts):
    """Heights at equal distances of a beam of small slopes on a ground, level and held at x = 0, held at its other end, with the forces
    on it: its energy is least. One node after another joins or leaves what touches, the worst first."""
    h = length / parts
    n = parts + 1
    bend = np.zeros((parts, n))
    # Curvatures at nodes; the node before the first is its mirror image, at the last there is none.
    bend[0, :2] = -2.0, 2.0
    for k in range(1, parts):
        bend[k, k - 1:k + 2] = 1.0, -2.0, 1.0
    share = np.full(parts, h)
    share[0] = 0.5 * h
    stiffness = bend.T @ (share[:, None] * bend) / h**4
    load = np.full(n, -q * h)
    floor = ground(np.linspace(0.0, length, n))
    floor[[0, -1]] = ground.height
    held = np.zeros(n, bool)
    held[[0, -1]] = True
    for _ in range(5 * parts):
        w = np.where(held, floor, 0.0)
        w[~held] = np.linalg.solve(stiffness[np.ix_(~held, ~held)], load[~held] - stiffness[np.ix_(~held, held)] @ w[held])
        force = stiffness @ w - load
        pulled = np.where(held, -force, 0.0)
        pulled[[0, -1]] = 0.0
        if pulled.max() > 1e-12 * q * length:
            held[np.argmax(pulled)] = False
        elif (floor - w).max() > 1e-12:
            held[np.argmax(floor - w)] = True
        else:
            return w, force
    raise AssertionError("what touches does not settle")


class Humps:
    """Two humps of the ground, and the height at which a pipe is clamped."""
    height = 0.02

    def __call__(self, x):
        return 0.015 * np.exp(-((x - 5.0) / 2.0)**2) + 0.012 * np.exp(-((x - 11.0) / 1.6)**2) - 0.004 * np.exp(-((x - 8.0) / 1.2)**2)


@dr.release_only
@pytest.mark.parametrize("q", [2e-3, 2e-2])
def test_pipe_laid_on_humps(q):
    """Against a beam of small slopes on a fine grid: it errs by its squares, 1e-4, and its grid by the square of that."""
    ground = Humps()
    length = 16.0
    run = dr.run_deck(pipe([(0.0, ground.height), (8.0, ground.height), (length, ground.height)],
                           [("SPLINE", points((x, float(ground(np.array(x)))) for x in np.arange(-2.0, 18.25, 0.5)))], "1, ENCASTRE\n3, 2\n",
                           [weight(q)], monitors="*MONITOR, NAME=middle\n2, U2\n"))
    parts = 320
    w, force = lying_beam(ground, length, q, parts)
    dr.assert_close(run.column("middle")[-1], w[parts // 2] - ground.height, absolute=2e-3 * ground.height)
    dr.assert_close(run.column("ground0")[-1], force[1:-1].sum(), relative=2e-3)

"""*AXIAL SOIL: soil that holds a straight rod along its axis, elastic with a limit.

References: the pull-out of an elastic bar, EA u'' = min(k u, t), in closed form, free and pressed flat on a bed; a pipe lifted off
its bed by integration of its differential equations, by finer meshes, and (beside linear soil) with contact at nodes."""
import math
import re

import numpy as np
import pytest

import deck_runner as dr

K, T, EA, LENGTH = 2000.0, 1.0, 5e4, 30.0


def pulled_end(load, k=K, t=T, ea=EA, length=LENGTH):
    """Displacement of the pulled end; t: limit of the soil's force."""
    rate = math.sqrt(k / ea)

    def holding(part):
        return ea * rate * t / k * math.tanh(rate * part)
    if math.isinf(t) or load <= holding(length):
        return load / (ea * rate * math.tanh(rate * length))
    low, high = 0.0, length
    for _ in range(200):
        slip = (low + high) / 2
        low, high = (slip, high) if holding(length - slip) + t * slip < load else (low, slip)
    return t / k + holding(length - low) * low / ea + t * low**2 / (2 * ea)


def pull(*changes, options=(), code=0):
    return dr.run_deck(dr.changed(dr.example("pull-out"), *changes), *options, code=code)


@pytest.mark.parametrize("load", [3.0, 8.0, 15.0])
@pytest.mark.parametrize("sign", [1, -1])
def test_pull_out(load, sign):
    """Before and after slip has begun, pulled and pushed: the law's corner inside an element is found."""
    # EI = 1e4: the bar that is pushed does not buckle.
    run = pull(("2, 1, 1\n", f"2, 1, {sign}\n"), ("ABOVE, 15", f"ABOVE, {load}"), ("${EA}, 1\n", "${EA}, 1e4\n"))
    dr.assert_close(sign * run.column("u")[-1], pulled_end(load), relative=1e-9)
    dr.assert_close(sign * run.column("soil")[-1], -load, relative=1e-9)


def test_pull_out_in_any_direction():
    """On a rail, along the x axis and turned by 37 degrees."""
    along = []
    for angle in 0.0, math.radians(37):
        c, s = math.cos(angle), math.sin(angle)
        rail = f"*OBSTACLE, NAME=RAIL, TYPE=LINE, BILATERAL\n0, 0, {c!r}, {s!r}\n*CONTACT, OBSTACLE=RAIL, NSET=BAR\n"
        run = pull(("2, ${L}, 0", f"2, ${{{c!r}*L}}, ${{{s!r}*L}}"), ("2, 1, 1\n", f"2, 1, {c!r}\n2, 2, {s!r}\n"),
                   ("*BOUNDARY\n1, 2, 6\n2, 2\n", rail))
        along.append(run.column("u")[-1] / c)
    dr.assert_close(along[1], along[0], relative=1e-9)
    dr.assert_close(along[0], pulled_end(15.0), relative=1e-7)      # no node moves with the end of slip beside contact at nodes


@pytest.mark.parametrize("load", [5.03, 5.2, 5.45, 8.0])
def test_bars(load):
    """Error bars contain the error, also while slip has begun on a short part next to the end."""
    run = pull(("1, 2, 20", "1, 2, 5"), ("ABOVE, 15", f"ABOVE, {load}"))
    end = run.only("EP")
    assert abs(end.monitors["u"] - pulled_end(load)) <= end.monitor_errors["u"] <= 1e-6 * pulled_end(load)


@pytest.mark.parametrize("force", ["STIFFNESS=${k}", "LAW=L"])
def test_without_limit(force):
    """A stiffness alone, and a law of one straight line."""
    law = "*FOUNDATION LAW, NAME=L\n0, 0\n1, ${k}\n" if "LAW" in force else ""
    run = pull(("*AXIAL SOIL", law + "*AXIAL SOIL"), ("STIFFNESS=${k}, LIMIT=${t}", force))
    dr.assert_close(run.column("u")[-1], pulled_end(15.0, t=math.inf), relative=1e-9)


@pytest.mark.parametrize("kind, order", [("GE2", 2), ("GE4", 4)])
def test_order(kind, order):
    """Errors before slip fall with the order of the elements."""
    error = [abs(pull(("ELSET=BAR, NSET=BAR", f"ELSET=BAR, NSET=BAR, TYPE={kind}"), ("1, 2, 20", f"1, 2, {n}"), ("ABOVE, 15", "ABOVE, 3"),
                      code=None).column("u")[-1] - pulled_end(3.0)) for n in (15, 30)]
    assert error[0] / error[1] > 2**(order - 0.5)


BED = """*OBSTACLE, NAME=BED, TYPE=LINE
0, 0, {c}, {s}
*CONTACT, OBSTACLE=BED, NSET=BAR, POINTS={points}
"""
WEIGHT = """*STEP
*STATIC, METHOD=LOAD
1
*DLOAD
BAR, GRAV, 1, {s}, -{c}
*END STEP
"""


def on_bed(*changes, angle=0.0, points="ALONG", code=0):
    """The bar without supports, pressed on a rigid bed by its weight 1 before the step of the deck; in a direction."""
    c, s = math.cos(angle), math.sin(angle)
    return pull(("*BOUNDARY\n1, 2, 6\n2, 2\n", BED.format(c=c, s=s, points=points)), ("${EA}, 1\n", "${EA}, 1, , 1\n"),
                ("*STEP\n", WEIGHT.format(c=c, s=s) + "*STEP\n"), ("2, ${L}, 0", f"2, ${{{c!r}*L}}, ${{{s!r}*L}}"), *changes, code=code)


def test_flat_on_a_bed():
    """The line contact has the closed form of the free bar, and the bed carries the weight."""
    run = on_bed(("STIFFNESS=${k}, LIMIT=${t}", "STIFFNESS=${k}"), ("ABOVE, 15", "ABOVE, 8"),
                 ("*MONITOR, NAME=soil", "*MONITOR, NAME=bed, OBSTACLE=BED\nRN\n*MONITOR, NAME=soil"))
    dr.assert_close(run.column("u")[-1], pulled_end(8.0, t=math.inf), relative=1e-9)
    dr.assert_close(run.column("soil")[-1], -8.0, relative=1e-9)
    dr.assert_close(run.column("bed")[-1], LENGTH, relative=1e-9)


@pytest.mark.parametrize("load", [3.0, 8.0, 15.0])
def test_limit_on_a_bed(load):
    """Slip inside a line contact."""
    run = on_bed(("ABOVE, 15", f"ABOVE, {load}"), ("*MONITOR, NAME=soil", "*MONITOR, NAME=bed, OBSTACLE=BED\nRN\n*MONITOR, NAME=soil"))
    dr.assert_close(run.column("u")[-1], pulled_end(load), relative=1e-9)
    dr.assert_close(run.column("soil")[-1], -load, relative=1e-9)
    dr.assert_close(run.column("bed")[-1], LENGTH, relative=1e-9)


def lifted(kind="GE4", elements=40, angle=0.0, points="ALONG"):
    """Height to which a pipe of EA = 1000, EI = 1 and length 6 is lifted and pulled by (1, 0.5) at its end, from a bed with soil of
    stiffness 50 along it."""
    c, s = math.cos(angle), math.sin(angle)
    run = on_bed(("k = 2000\nt = 1\nEA = 5e4\nL = 30", "k = 50\nEA = 1000\nL = 6"), ("STIFFNESS=${k}, LIMIT=${t}", "STIFFNESS=${k}"),
                 ("NSET=BAR\n1, 2, 20", f"NSET=BAR, TYPE={kind}\n1, 2, {elements}"), ("0.5, , 1", "0.1, 1e-7, 0.1"),
                 ("2, 1, 1\n", f"2, 1, {c - 0.5 * s!r}\n2, 2, {s + 0.5 * c!r}\n"), ("*STOP\nLOAD, ABOVE, 15\n", ""),
                 ("*MONITOR, NAME=soil", "*MONITOR, NAME=v\n2, U2\n*MONITOR, NAME=soil"), angle=angle, points=points)
    return c * run.column("v")[-1] - s * run.column("u")[-1]


def test_lifted_off_a_bed():
    """The error falls with the order of the elements, and contact at nodes tends to the same height, at least with order 2 in steps
    of 4 in which its last node in contact may lie anywhere; the height does not depend on the direction."""
    exact = lifted("GE8", 80)
    error = [abs(lifted(elements=n) - exact) for n in (20, 40)]
    assert error[0] / error[1] > 2**3.5
    error = [abs(lifted(elements=n, points="NODES") - exact) for n in (40, 160)]
    assert error[0] / error[1] > 4**1.5
    dr.assert_close(lifted(angle=0.5), lifted(), relative=1e-9)


@dr.once_in_release
@pytest.mark.parametrize("k", [50, 500, 2000])
def test_lifted_with_tolerance(k):
    """The mesh is made for the tolerance at every point, also at the first one behind the lift of the end: a long pipe needs more
    elements on the bed there than it had under its weight. Heights against a fine given mesh."""
    def height(line, accuracy):
        run = on_bed(("k = 2000\nt = 1\nEA = 5e4\nL = 30", f"k = {k}\nEA = 1000\nL = 30"), ("STIFFNESS=${k}, LIMIT=${t}", "STIFFNESS=${k}"),
                     ("NSET=BAR\n1, 2, 20", line), ("0.5, , 1", "0.1, 1e-7, 0.1" + accuracy), ("2, 1, 1\n", "2, 1, 0.5\n2, 2, 1\n"),
                     ("*STOP\nLOAD, ABOVE, 15\n", ""), ("*MONITOR, NAME=soil", "*MONITOR, NAME=v\n2, U2\n*MONITOR, NAME=soil"))
        return run.column("v")[-1]
    dr.assert_close(height("NSET=BAR\n1, 2", "\n*ACCURACY, TOLERANCE=1E-6"), height("NSET=BAR\n1, 2, 300", ""), relative=1e-6)


def slipping(k, limit, *changes, kind="GE4", elements=40, angle=0.0, points="ALONG", scale=1.0, length=6, step="0.1, 1e-7, 0.1"):
    """A pipe of EA = 1000, EI = 1 and weight 1 that is lifted off its bed and pulled by scale (0.05, 1) at its end: displacement of the
    end along the bed and its height. The end first moves ahead; when the pipe rises, the end moves back, so that soil slips on either
    way, and the places where it begins to slip pass the touchdown point."""
    c, s = math.cos(angle), math.sin(angle)
    run = on_bed(("k = 2000\nt = 1\nEA = 5e4\nL = 30", f"k = {k}\nt = {limit}\nEA = 1000\nL = {length}"),
                 ("NSET=BAR\n1, 2, 20", f"NSET=BAR, TYPE={kind}\n1, 2" + (f", {elements}" if elements else "")),
                 ("2, 1, 1\n", f"2, 1, {scale * (0.05 * c - s)!r}\n2, 2, {scale * (0.05 * s + c)!r}\n"), ("*STOP\nLOAD, ABOVE, 15\n", ""),
                 ("0.5, , 1", step), ("*MONITOR, NAME=soil", "*MONITOR, NAME=v\n2, U2\n*MONITOR, NAME=soil"), *changes,
                 angle=angle, points=points)
    u, v = run.column("u")[-1], run.column("v")[-1]
    return np.array([c * u + s * v, c * v - s * u]), run


def integrated(k, t, scale, length=6.0, ea=1000.0, steps=1000):
    """The same by the differential equations: the flat part in closed form, the lifted part by Runge-Kutta steps from the touchdown
    point. Its place and the pull there follow from the moment 0 and the pull at the end."""
    across = scale

    def rates(s, x, angle, moment, pull):
        up, c, d = across - (length - s), math.cos(angle), math.sin(angle)
        stretch = 1.0 + (pull * c + up * d) / ea
        return stretch * c, stretch * d, moment, -stretch * (up * c - pull * d), min(max(k * (x - s), -t), t)

    def end(place, pull):
        x, y, angle, moment = place + math.copysign(pulled_end(abs(pull), k, t, ea, place), pull), 0.0, 0.0, 0.0
        h = (length - place) / steps
        for n in range(steps):
            s = place + h * n
            one = rates(s, x, angle, moment, pull)
            two = rates(s + h / 2, x + h / 2 * one[0], angle + h / 2 * one[2], moment + h / 2 * one[3], pull + h / 2 * one[4])
            three = rates(s + h / 2, x + h / 2 * two[0], angle + h / 2 * two[2], moment + h / 2 * two[3], pull + h / 2 * two[4])
            four = rates(s + h, x + h * three[0], angle + h * three[2], moment + h * three[3], pull + h * three[4])
            x, y, angle, moment, pull = (value + h / 6 * (p + 2 * q + 2 * r + v)
                                         for value, p, q, r, v in zip((x, y, angle, moment, pull), one, two, three, four))
        return np.array([x, y, angle, moment, pull])

    def misfit(unknown):
        return end(*unknown)[3:] - [0.0, 0.05 * scale]
    unknown = np.array([length - 1.9 * across, 0.05 * scale])
    for _ in range(6):
        slope = np.array([misfit(unknown + step) - misfit(unknown - step) for step in 1e-5 * np.eye(2)]).T / 2e-5
        unknown = unknown - np.linalg.solve(slope, misfit(unknown))
    assert abs(misfit(unknown)).max() < 1e-10
    return end(*unknown)[:2] - [length, 0.0]


@pytest.mark.parametrize("k, limit, scale", [(50, 0.1, 1.0), (2000, 0.1, 1.0), (500, 0.02, 1.0), (2000, 0.1, 0.6)])
def test_slip_and_touchdown(k, limit, scale):
    """Against the differential equations; a kink of the soil's force inside a Runge-Kutta step costs 1e-9 there."""
    np.testing.assert_allclose(slipping(k, limit, kind="GE8", elements=80, scale=scale)[0], integrated(k, limit, scale), rtol=1e-7, atol=2e-9)


@dr.once_in_release
def test_slip_and_touchdown_order():
    """The error falls with the order of the elements, although corners of the soil's law lie in line contacts and beside them."""
    exact, _ = slipping(2000, 0.1, kind="GE8", elements=80)
    error = [abs(slipping(2000, 0.1, elements=n)[0] - exact) for n in (40, 80)]
    assert (error[0] / error[1] > 2**3.5).all()


def test_slip_and_touchdown_in_any_direction():
    np.testing.assert_allclose(slipping(500, 0.02, angle=0.5)[0], slipping(500, 0.02)[0], rtol=1e-8)


@pytest.mark.parametrize("k, limit, length", [(2000, 0.02, 6), (500, 0.02, 30), (2000, 0.2, 30)])
def test_slip_passes_touchdown(k, limit, length):
    """With a mesh made for a tolerance, too. A node could not pass: thousands of iterations were needed where the two places meet."""
    fine, _ = slipping(k, limit, kind="GE8", elements=8 * length, length=length)
    found, run = slipping(k, limit, kind="GE8", elements=0, length=length, step="0.1, 1e-7, 0.1\n*ACCURACY, TOLERANCE=1E-6")
    assert abs(found - fine).max() <= 1e-6 * abs(fine).max()
    assert int(re.search(r"Newton iterations +(\d+)", run.stdout)[1]) < 1000


def test_curved_bed():
    """Over the humps of a curved bed, with soil along the chord: meshes for two tolerances agree within the larger."""
    def valley(tolerance):
        soil = "*AXIAL SOIL, NAME=SOIL, ELSET=PIPE, STIFFNESS=500\n*STEP\n"
        run = dr.run_deck(dr.changed(dr.example("pipe-humps"), ("1E-6", tolerance), ("*STEP\n", soil), ("1e6, 1.", "1e3, 1.")))
        return run.column("valley")[-1]
    dr.assert_close(valley("1E-4"), valley("1E-7"), relative=1e-4)


def hot_pipe(*changes):
    return dr.changed(dr.example("pipe-friction"), ("*LOCATE\nheight, 0.25, 0.5\n", ""), *changes)


def test_hot_pipe():
    """Upheaval of a pipe with friction on a rigid bed: contact anywhere along the rod, with bars, on the mesh of the program and on
    given ones. The soil as a two-sided foundation by a law across the axis is the same model."""
    deck = hot_pipe(("jack = 0.3", "jack = 0.6"), ("ABOVE, 1", "ABOVE, 3"))
    given = deck.replace("*ACCURACY, TOLERANCE=1E-6\n", "")
    soil = "*AXIAL SOIL, NAME=FRICTION, ELSET=PIPE, STIFFNESS=${mu/slip}, LIMIT=${mu}\n"
    law = ("*FOUNDATION LAW, NAME=SLIDE\n0, 0\n${slip}, ${mu}\n1, ${mu}\n*OBSTACLE, NAME=FRICTION, TYPE=LINE, FOUNDATION=LAW, LAW=SLIDE, "
           "BILATERAL\n0, 0, 0, 1\n*CONTACT, OBSTACLE=FRICTION, NSET=PIPE\n")
    at = []
    for text in (deck, dr.changed(given, ("1, 2\n*BEAM", "1, 2, 80\n*BEAM")),
                 dr.changed(given, (soil, law), ("1, 2\n*BEAM", "1, 2, 160\n*BEAM"))):
        run = dr.run_deck(text)
        at.append((run.labelled("EP")[-1].load_factor, run.column("thrust")[-1]))
        assert "acts at nodes" not in run.stdout
    np.testing.assert_allclose(at[1], at[0], rtol=1e-6)
    np.testing.assert_allclose(at[2], at[0], rtol=1e-6)


@dr.once_in_release
def test_hot_pipe_comes_back():
    """Lifted less, the pipe jumps up. Where heat has its maximum the soil's slip turns round almost everywhere at once: corners of the
    law appear, jump and meet. Meshes for two tolerances have the same limit points within their bars."""
    deck = hot_pipe(("ABOVE, 1", "BELOW, 1"))
    one, two = (dr.run_deck(deck.replace("TOLERANCE=1E-6", f"TOLERANCE={tolerance}")).labelled("LP") for tolerance in ("1E-5", "1E-6"))
    assert len(one) == len(two) == 3
    for a, b in zip(one, two):
        assert abs(a.load_factor - b.load_factor) <= a.error + b.error <= 2e-5 * abs(b.load_factor)


def test_a_line_of_contact_that_a_force_splits_at_once_is_no_fault_on_soil_along_the_rod():
    """A force lifts a pipe off its rigid bed from the first increment on. The C- at load 0 has no estimate, as nothing moves there, and
    needs none, with soil along the pipe or without: its place and load are those of the deck."""
    text = """*HEADING
pipe lifted at a node
*NODE
1, 0, 0
2, 14, 0
3, 30, 0
*LINE, ELSET=PIPE, NSET=PIPE
1, 2
2, 3
*BEAM SECTION, ELSET=PIPE, SECTION=STIFFNESS
100000., 1., , 0.11
*BOUNDARY
1, 1
*OBSTACLE, NAME=BED, TYPE=LINE
-30, 0, 60, 0
*CONTACT, OBSTACLE=BED, NSET=PIPE
{soil}*MONITOR, NAME=lift
2, U2
*STEP
*STATIC, METHOD=LOAD
0.5
*DLOAD
PIPE, GRAV, 1., 0., -1.
*END STEP
*STEP
*STATIC
0.05, , 0.1
*CLOAD
2, 2, 0.84
*STOP
lift, ABOVE, 0.02
*END STEP
"""
    run = dr.run_deck(text.format(soil="*AXIAL SOIL, NAME=SOIL, ELSET=PIPE, STIFFNESS=12.57\n"))
    assert run.labelled("C-")[0].load_factor == 0.0
    assert [row.label for row in run.results.critical] == [row.label for row in dr.run_deck(text.format(soil="")).results.critical]

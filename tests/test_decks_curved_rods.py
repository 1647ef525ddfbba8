"""Rods along ellipses and splines: circles said as either, deflections by quadrature along the true curve, order of convergence."""
import functools
import math

import numpy as np
import pytest

import deck_runner as dr
from unilat.results.obstacle_surface import surfaces

LINER = """*HEADING
Liner with room in a round host, half of it
*NODE
1, 0, 1
2, 0, -1
{nodes}{curve}*BEAM SECTION, ELSET=LINER, SECTION=STIFFNESS
19200, 1
{imperfection}*BOUNDARY
1, XSYMM
2, ENCASTRE
*OBSTACLE, NAME=HOST, TYPE=CIRCLE
0, 0, 1
*CONTACT, OBSTACLE=HOST, NSET=LINER, GAP=0.0005, POINTS=ALONG
*MONITOR, NAME=v
1, U2, -1
*STEP
*STATIC
0.5, , 0.005
*DLOAD
LINER, P, 1
*CLOAD
1, 2, -0.002
*STOP
v, ABOVE, 0.08
*END STEP
"""
ARC = "*ARC, ELSET=LINER, NSET=LINER\n1, 2, 0, 0, 24\n"
WAVE = "*IMPERFECTION, ELSET=LINER, SHAPE=COSINE\n-0.0004, 2\n"


def liner(curve=ARC, nodes="", imperfection=""):
    return dr.run_deck(LINER.format(curve=curve, nodes=nodes, imperfection=imperfection)).only("LP")


@functools.cache
def on_an_arc(imperfection):
    return liner(imperfection=imperfection)


@pytest.mark.parametrize("angle", [0, 30, 90])
@pytest.mark.parametrize("imperfection", ["", WAVE], ids=["perfect", "wave"])
def test_ellipse_with_equal_axes_is_an_arc(angle, imperfection):
    """Wherever its first axis is, and with an imperfection, whose lengths are then measured along a spline."""
    point, arc = liner(f"*ELLIPSE, ELSET=LINER, NSET=LINER\n1, 2, 0, 0, 1, 1, {angle}, 24\n", imperfection=imperfection), on_an_arc(imperfection)
    assert abs(point.corrected - arc.corrected) < 1e-10 * arc.corrected


def test_chain_of_an_imperfection_goes_on_from_ellipse_to_ellipse():
    """The same arc as one ellipse or as two that meet in one direction: the same limit load. Two that meet at a right angle, both with the
    same direction at their beginnings, are no smooth chain."""
    halves = "*ELLIPSE, ELSET=LINER, NSET=LINER\n1, 3, 0, 0, 1, 1, 0, 12\n3, 2, 0, 0, 1, 1, 0, 12\n"
    point, arc = liner(halves, nodes="3, -1, 0\n", imperfection=WAVE), on_an_arc(WAVE)
    assert abs(point.corrected - arc.corrected) < 1e-10 * arc.corrected
    corner = "*ELLIPSE, ELSET=LINER, NSET=LINER\n1, 3, 0, 0, 1, 1, 0, 12\n3, 4, -1, -1, 1, 1, 0, 12\n"
    refused = dr.run_deck(LINER.format(curve=corner, nodes="3, -1, 0\n4, -2, -1\n", imperfection=WAVE), code=1)
    assert "the chain has a corner between the elements 12 and 13" in refused.stderr


def test_spline_tends_to_an_arc():
    """Points every 12 and every 6 degrees, directions at both ends: the error falls with the sixth power of their distance."""
    error = []
    for n in 15, 30:
        nodes = "".join(f"{i + 2}, ${{-sin(pi*{i}/{n})}}, ${{cos(pi*{i}/{n})}}\n" for i in range(1, n))
        lines = "1, 2\n" + "".join(f"{i + 2}, 2\n" for i in range(1, n)) + "2\n"
        error.append(abs(liner("*SPLINE, ELSET=LINER, NSET=LINER, START=180, END=0\n" + lines, nodes).corrected - on_an_arc("").corrected))
    assert error[0] < 1e-4
    assert error[1] < error[0] / 2**5


A, B, LOAD = 2.0, 1.0, 1e-7


def quarter(element, elements, amplitude=0.0, clockwise=False):
    """Sinking of the tip of a quarter of an ellipse, clamped at the end of its long axis, for a force of 1 down."""
    ends = (f"1, 0, {B}\n2, {A}, 0\n", "1, 2") if clockwise else (f"1, {A}, 0\n2, 0, {B}\n", "1, 2")
    imperfection = f"*IMPERFECTION, ELSET=ROD, SHAPE=SINE\n{-amplitude if clockwise else amplitude!r}, 3\n" if amplitude else ""
    clamped, tip = (2, 1) if clockwise else (1, 2)
    return dr.run_deck(f"""*HEADING
Quarter of an ellipse
*NODE
{ends[0]}*ELLIPSE, ELSET=ROD, TYPE={element}, DIRECTION={"CLOCKWISE" if clockwise else "ANTICLOCKWISE"}
{ends[1]}, 0, 0, {A}, {B}, 0, {elements}
*BEAM SECTION, ELSET=ROD, SECTION=INEXTENSIBLE
1
{imperfection}*BOUNDARY
{clamped}, ENCASTRE
*MONITOR, NAME=v
{tip}, U2, {-1 / LOAD!r}
*STEP
*STATIC, METHOD=LOAD
1
*CLOAD
{tip}, 2, {-LOAD!r}
*STOP
LOAD, ABOVE, 1
*CONTROLS, TOLERANCE=1e-13
*END STEP
""", code=None).column("v")[-1]


@functools.cache
def by_quadrature(amplitude):
    """The integral of (lever arm)^2 along the true curve: an ellipse with w = a sin(3 pi s/L) to its left."""
    n = 200001
    t = np.linspace(0, math.pi / 2, n)
    speed = np.hypot(A * np.sin(t), B * np.cos(t))
    s = np.concatenate(([0], np.cumsum((speed[1:] + speed[:-1]) / 2 * np.diff(t))))
    w = amplitude * np.sin(3 * math.pi * s / s[-1])
    x, y = A * np.cos(t) - w * B * np.cos(t) / speed, B * np.sin(t) - w * A * np.sin(t) / speed
    length = np.hypot(np.diff(x), np.diff(y))
    return np.sum(length * ((x[1:] + x[:-1]) / 2)**2)


@pytest.mark.parametrize("clockwise", [False, True])
@pytest.mark.parametrize("amplitude", [0.0, 0.1])
def test_flexibility_of_a_quarter(amplitude, clockwise):
    """The quadrature's chords are off by 1E-10, the load's second order by 1E-7."""
    dr.assert_close(quarter("GE8", 16, amplitude, clockwise), by_quadrature(amplitude), relative=1e-6)


@pytest.mark.parametrize("amplitude", [0.0, 0.1])
@pytest.mark.parametrize("element, order", [("GE2", 2), ("GE4", 4), ("GE6", 6)])
def test_order_along_an_ellipse(element, order, amplitude):
    best = quarter("GE8", 32, amplitude)
    error = [abs(quarter(element, n, amplitude) - best) for n in (4, 8)]
    assert error[0] / error[1] > 2**(order - 0.7)


@dr.once_in_release
def test_liner_along_its_oval_wall():
    """A liner whose axis is the ellipse of its wall, turned by 90 degrees, and with contact at many nodes."""
    def oval(turned, points="ALONG", elements="24"):
        x = ("1, -1, 0\n", "2, 1, 0\n") if turned else ("1, 0, 1\n", "2, 0, -1\n")
        axes = "0, 0, 1.01, ${1/1.01}, " + ("0" if not turned else "90")
        deck = LINER.format(nodes="", imperfection="", curve=f"*ELLIPSE, ELSET=LINER, NSET=LINER\n1, 2, {axes}, {elements}\n")
        at = "${1/1.01}"
        deck = dr.changed(deck, ("1, 0, 1\n", x[0].replace("1, -1", "1, -" + at) if turned else f"1, 0, {at}\n"),
                          ("2, 0, -1\n", f"2, {at}, 0\n" if turned else f"2, 0, -{at}\n"), ("CIRCLE\n0, 0, 1", "ELLIPSE\n" + axes), ("ALONG", points))
        if turned:
            deck = dr.changed(deck, ("XSYMM", "YSYMM"), ("1, U2, -1", "1, U1"), ("1, 2, -0.002", "1, 1, 0.002"))
        return dr.run_deck(deck).only("LP")
    upright, turned, nodes = oval(False), oval(True), oval(False, "NODES", 400)
    assert abs(upright.corrected - turned.corrected) < 1e-9 * upright.corrected
    assert upright.load_factor < 0.97 * on_an_arc("").load_factor
    assert abs(upright.load_factor - nodes.load_factor) < 1e-3 * nodes.load_factor


@pytest.mark.parametrize("elements", ["", ", 40"])
def test_ellipse_back_to_its_node_is_a_ring(elements):
    """input/ring-full.inp as one closed curve from its lowest point, node 2, on a mesh of the program or of 40 elements."""
    top = 34 if elements == "" else 22
    run = dr.run_deck(dr.changed(dr.example("ring-full"), ("*ARC", "*ELLIPSE"), ("1, 2, 0., 0.\n2, 1, 0., 0.", "2, 2, 0, 0, 1, 1, 20" + elements),
                                 ("1, 0., 1.\n", ""), ("1, U2", f"{top}, U2"), ("1, U1", f"{top}, U1"), ("57., 62., 28.", "57."),
                                 ("v, ABOVE, 0.6", "v, ABOVE, 0.1")))
    assert abs(run.only("LP").load_factor - 81.557427564661) < run.only("LP").error + 1e-9
    assert abs(run.column("sway")).max() < 1e-9


def test_closed_spline_is_a_ring():
    """The same of 40 points of the circle."""
    nodes = "".join(f"{i}, ${{sin(2*pi*{i - 2}/40)}}, ${{-cos(2*pi*{i - 2}/40)}}\n" for i in range(2, 42))
    lines = "".join(f"{i}, 1\n" for i in range(2, 42))
    run = dr.run_deck(dr.changed(dr.example("ring-full"), ("*ARC", "*SPLINE, ENDS=CLOSED"), ("1, 2, 0., 0.\n2, 1, 0., 0.\n", lines),
                                 ("1, 0., 1.\n2, 0., -1.\n", nodes), ("1, U2", "22, U2"), ("1, U1", "22, U1"), ("57., 62., 28.", "57."),
                                 ("v, ABOVE, 0.6", "v, ABOVE, 0.1")))
    assert abs(run.only("LP").load_factor - 81.557427564661) < 1e-4


def test_elliptic_spring():
    """input/oval-spring.inp: at the start F/v is one over the least of the integrals of (x - c)^2 along the quarter."""
    n = 200001
    t = np.linspace(0, math.pi / 2, n)
    length = np.hypot(np.diff(2 * np.cos(t)), np.diff(np.sin(t)))
    x = np.cos(t)[1:] + np.cos(t)[:-1]
    stiffness = 1 / (np.sum(length * x**2) - np.sum(length * x)**2 / np.sum(length))
    run = dr.run_deck(dr.changed(dr.example("oval-spring"), ("0.01, , 0.1", "1E-7, , 1E-7"), ("v, ABOVE, 0.9", "LOAD, ABOVE, 1E-7"), ("*STATIC", "*STATIC, METHOD=LOAD")))
    dr.assert_close(run.column("load_factor")[-1] / run.column("v")[-1], stiffness, relative=1e-6)


def test_egg():
    """input/liner-egg.inp turned by 90 degrees has the same limit."""
    deck = dr.example("liner-egg")
    rows = deck.splitlines()
    turned = "\n".join(turned_point(row) for row in rows) + "\n"
    turned = dr.changed(turned, ("*SPLINE, ELSET=LINER, NSET=LINER, START=180, END=0", "*SPLINE, ELSET=LINER, NSET=LINER, START=270, END=90"),
                        ("TYPE=SPLINE, START=180, END=0", "TYPE=SPLINE, START=270, END=90"), ("1, XSYMM", "1, YSYMM"), ("9, U1", "9, U2"))
    run = dr.run_deck(deck)
    upright, lying = run.only("LP"), dr.run_deck(turned).only("LP")
    (drawn, solid), = surfaces(run.results.obstacles["SEWER"], np.array([[-1.0, -1.2], [1.0, 1.2]]))
    assert solid == -1.0 and np.abs(drawn).max() < 1.3       # a closed wall has no ends that go on straight
    assert abs(upright.corrected - lying.corrected) < upright.error + lying.error


def turned_point(row):
    """A line with formulas of x and y, turned by 90 degrees."""
    fields = [field.strip() for field in row.split(",")]
    if "${" not in fields[-1] or "GAP" in row:
        return row
    return ", ".join([*fields[:-2], "${-(" + fields[-1].strip("${}") + ")}", fields[-2]])


ELLIPSE_BETWEEN_PLATES = """*HEADING
Half an elliptic ring that two plates press flat
*NODE
1, 0, -1.4
2, 0, 1.4
*ELLIPSE, ELSET=ROD, NSET=ROD, TYPE={family}, DIRECTION=ANTICLOCKWISE
1, 2, 0, 0, 1, 1.4, 0, {elements}
*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS
1200, 1
*BOUNDARY
1, 1
1, 6
2, 1
2, 6
*SPRING
1, 2, 0.4
*OBSTACLE, NAME=TOP, TYPE=LINE
3, 1.41, -3, 1.41
*CONTACT, OBSTACLE=TOP, NSET=ROD
*OBSTACLE, NAME=LOW, TYPE=LINE
-3, -1.43, 3, -1.43
*CONTACT, OBSTACLE=LOW, NSET=ROD
*MONITOR, NAME=normal, OBSTACLE=TOP
RN
*MONITOR, NAME=vertical, OBSTACLE=TOP
RF2
*STEP
*STATIC, METHOD=CYLINDRICAL
0.005, , 0.025
*OBSTACLE MOTION
TOP, 0, -1.31
LOW, 0, 0.55
*STOP
LOAD, ABOVE, 0.75
*END STEP
"""


def test_contact_force_where_the_curvature_of_a_rod_varies_along_its_line_contact():
    """On a straight wall the sum of normal forces is the resultant. It was the integral of the pressure, which has the second derivative
    of a spline's curvature: it was some 1E-5 off on any mesh, and its error bar was up to a hundred times wider or narrower."""
    fine = dr.run_deck(ELLIPSE_BETWEEN_PLATES.format(family="GE8", elements=32)).only("EP")
    assert fine.monitor_errors["normal"] < 1e-9
    for family, elements in (("GE4", 16), ("GE4", 32), ("GE8", 8)):
        end = dr.run_deck(ELLIPSE_BETWEEN_PLATES.format(family=family, elements=elements)).only("EP")
        assert end.monitors["normal"] == pytest.approx(-end.monitors["vertical"], rel=1e-12)
        assert abs(end.monitors["normal"] - fine.monitors["normal"]) < end.monitor_errors["normal"]

"""*DISTRIBUTION, *DLOAD, *LIQUID: loads and sections that vary along the rods.

References: integrals of the linear beam; the elastica by Runge-Kutta shooting, for a dead load a problem with one unknown; closed forms of
buckling (Timoshenko & Gere, Theory of Elastic Stability, 2.11 to 2.13, 7.5; Diamant & Witten, Phys. Rev. Lett. 107 (2011) 164302)."""
import functools
import math

import numpy as np
import pytest

import deck_runner as dr

ORDERS = {"GE2": 2, "GE4": 4, "GE6": 6, "GE8": 8}
TIGHT = "*ACCURACY, TOLERANCE=1E-8, WIDEST=1\n"


def rod(kind="GE8", elements="", section="STIFFNESS\n1e9, 1.", more="", nodes="1, 0., 0.\n2, 1., 0.\n"):
    """A line from node 1 to node 2 with its section; what more the model part has stands before the section."""
    return (f"*HEADING\nvarying\n*NODE\n{nodes}*LINE, ELSET=ROD, NSET=ROD, TYPE={kind}\n1, 2{elements}\n{more}"
            f"*BEAM SECTION, ELSET=ROD, SECTION={section}\n")


def step(loads, end, first, method="LOAD", more="", accuracy=TIGHT):
    return f"*STEP\n{accuracy}*STATIC, METHOD={method}\n{first!r}\n{loads}*STOP\nLOAD, ABOVE, {end!r}\n{more}*END STEP\n"


CLAMPED = "*BOUNDARY\n1, ENCASTRE\n*MONITOR, NAME=u\n2, U1\n*MONITOR, NAME=v\n2, U2\n*MONITOR, NAME=turn\n2, UR\n"


def table(name, *lines):
    return f"*DISTRIBUTION, NAME={name}, ELSET=ROD\n" + "".join(f"{s!r}, {value!r}\n" for s, value in lines)


def formula(name, text):
    return f"*DISTRIBUTION, NAME={name}, ELSET=ROD, FORMULA\n{text}\n"


def gauss(f, *breaks, n=24):
    """Integral of a function that is smooth between the breaks."""
    x, w = np.polynomial.legendre.leggauss(n)
    return sum(0.5 * (b - a) * np.dot(w, [f(0.5 * (a + b) + 0.5 * (b - a) * t) for t in x]) for a, b in zip(breaks, breaks[1:]))


# --- small deflections: sums over the rod --------------------------------------------------------------------------------------------

def test_a_stepped_table_bends_a_stepped_cantilever():
    """Load and stiffness have jumps and corners where the deck has no nodes; the program puts some there, and is exact between them."""
    load = table("q", (0, 0), (0.3, 0), (0.3, 1), (0.71, 2), (1, 0))
    ei = table("EI", (0, 3), (0.4, 3), (0.4, 1), (1, 1))
    small = 1e-6
    text = rod(more=load + ei, section="STIFFNESS\n1e9, EI") + CLAMPED + step("*DLOAD\nROD, PY, q\n", small, small)
    run = dr.run_deck(text)

    def q(s):
        return 0 if s < 0.3 else 1 + (s - 0.3) / 0.41 if s < 0.71 else 2 * (1 - s) / 0.29

    def moment(s):
        return gauss(lambda t: q(t) * (t - s), *[s, *[b for b in (0.3, 0.71, 1) if b > s]])
    tip = gauss(lambda s: (1 - s) * moment(s) / (3 if s < 0.4 else 1), 0, 0.3, 0.4, 0.71, 1)
    dr.assert_close(run.column("v")[-1], small * tip, relative=1e-10)   # the square of the slope is 1e-13
    x = run.results.mesh.coordinates[:, 0]
    for place in (0.3, 0.4, 0.71):
        assert np.min(np.abs(x - place)) < 1e-12


def test_given_elements_are_divided_at_corners_too():
    load = table("q", (0, -1), (1 / 3, 2), (1, 0))
    text = rod(elements=", 2", more=load) + CLAMPED + step("*DLOAD\nROD, PY, q\n", 1e-6, 1e-6)
    run = dr.run_deck(text)
    assert len(run.results.mesh.coordinates) == 4
    tip = gauss(lambda t: (-1 + 9 * t if t < 1 / 3 else 3 * (1 - t)) * (t**2 / 2 - t**3 / 6), 0, 1 / 3, 1)   # unit load at t: its deflection
    dr.assert_close(run.column("v")[-1], 1e-6 * tip, relative=1e-10)


def test_the_mast_of_the_examples():
    """Linear beam under wind and without its weight, for a small wind: tip and moment of the foot."""
    text = dr.changed(dr.example("tapered-mast"), ("*STEP, NAME=WEIGHT\n*STATIC, METHOD=LOAD\n1.\n", "*STEP, NAME=WEIGHT\n*STATIC, METHOD=LOAD\n1e-6\n"),
                      ("LOAD, ABOVE, 1.\n", "LOAD, ABOVE, 1e-6\n"), ("0.25, 1e-6, 0.5", "1e-3, 1e-6, 1e-3"), ("stress, ABOVE, 240.\n", "LOAD, ABOVE, 1e-3\n"))
    run = dr.run_deck(text)

    def wind(s):
        return 1.2 * 2 * (0.20 - 0.006 * s) * (0.5 + 0.03 * s)

    def ei(s):
        r, t = 0.20 - 0.006 * s, 0.008 if s < 8 else 0.005
        return 210e6 * math.pi / 4 * (r**4 - (r - t)**4)

    def moment(s):
        return gauss(lambda t: wind(t) * (t - s), s, 20)
    tip = gauss(lambda s: (20 - s) * moment(s) / ei(s), 0, 8, 20)
    dr.assert_close(run.column("tip")[-1], 1e-3 * tip, relative=1e-6)         # N L^2/EI of the weight is 7e-7
    dr.assert_close(run.column("moment")[-1], 1e-3 * moment(0), relative=1e-6)


def test_weight_of_a_wedge_pulls_it():
    """A wedge hangs from its thick end: N = rho g b (mean height) (rest), and its own stretch."""
    text = (rod(more="*MATERIAL, NAME=M\n*ELASTIC\n1e6\n*DENSITY\n2.\n" + table("h", (0, 1), (1, 0.5)), section="RECT, MATERIAL=M\n0.1, h")
            + "*BOUNDARY\n1, ENCASTRE\n*MONITOR, NAME=u\n2, U1\n*MONITOR, NAME=hold\n1, RF1\n"
            + step("*DLOAD\nROD, GRAV, 10., 3., 0.\n", 1.0, 1.0))
    run = dr.run_deck(text)
    dr.assert_close(run.column("hold")[-1], -2 * 10 * 0.1 * 0.75, relative=1e-12)

    def hangs(s):
        return 2 * 10 * 0.1 * (1 - s) * (1 - s / 2 + 0.5) / 2
    stretch = gauss(lambda s: hangs(s) / (1e6 * 0.1 * (1 - s / 2)), 0, 1)
    dr.assert_close(run.column("u")[-1], stretch, relative=1e-9)


# --- large deflections: order, bars, the same by other words --------------------------------------------------------------------------

@functools.cache
def elastica(load, stiffness, steps=4000):
    """Tip of an inextensible cantilever from x = 0 to 1 under a dead load along y: (x, y, rotation), by shooting for the moment of the
    foot. load(s), stiffness(s): functions."""
    s = np.linspace(0, 1, 2 * steps + 1)
    # the force of the section from the tip: Simpson's rule on the grid of half steps, exact for the cubic loads used here
    q = np.array([load(v) for v in s])
    n = np.zeros(2 * steps + 1)
    half = s[1] - s[0]
    for i in range(2 * steps - 1, -1, -1):
        n[i] = n[i + 1] + half / 6 * (q[i] + 4 * load(s[i] + half / 2) + q[i + 1])
    ei = np.array([stiffness(v) for v in s])

    def shoot(foot):
        y = np.array([0.0, 0.0, 0.0, foot])
        h = 2 * half
        for k in range(steps):
            def rate(y, i):
                return np.array([math.cos(y[2]), math.sin(y[2]), y[3] / ei[i], -math.cos(y[2]) * n[i]])
            i = 2 * k
            a = rate(y, i)
            b = rate(y + h / 2 * a, i + 1)
            c = rate(y + h / 2 * b, i + 1)
            d = rate(y + h * c, i + 2)
            y = y + h / 6 * (a + 2 * b + 2 * c + d)
        return y
    low, high = 0.5, 0.6
    f_low, f_high = shoot(low)[3], shoot(high)[3]
    for _ in range(30):
        if abs(f_high) < 1e-13:
            break
        low, high, f_low = high, high - f_high * (high - low) / (f_high - f_low), f_high
        f_high = shoot(high)[3]
    return shoot(high)[:3]


def tilted_load(s):
    return 2 * (1 + 2 * s - s**2)


def tapered(s):
    return 1 - 0.6 * s


@functools.cache
def bent(kind, elements):
    """A tapered cantilever under a load with a formula, bent by about a radian: errors of tip and rotation."""
    text = (rod(kind, elements, "INEXTENSIBLE\nEI", formula("q", "2*(1 + 2*s - s**2)") + table("EI", (0, 1), (1, 0.4))) + CLAMPED
            + step("*DLOAD\nROD, PY, q\n", 1.0, 0.25, accuracy="*ACCURACY, TOLERANCE=1E-10, WIDEST=1\n" if elements else "*ACCURACY, TOLERANCE=1E-8\n"))
    run = dr.run_deck(text, code=None if elements else 0)
    x, y, turn = elastica(tilted_load, tapered)
    errors = np.array([run.column("u")[-1] - (x - 1), run.column("v")[-1] - y, run.column("turn")[-1] - turn])
    return np.abs(errors)


def test_an_adapted_mesh_bends_as_shooting_does():
    dr.assert_close(bent("GE8", ""), np.zeros(3), absolute=1e-8)       # the tolerance, of values below 1


@pytest.mark.parametrize("kind", ORDERS)
def test_order(kind):
    counts = {"GE2": (8, 16, 32), "GE4": (4, 8, 16), "GE6": (2, 4, 8), "GE8": (2, 4, 8)}[kind]
    errors = [np.linalg.norm(bent(kind, f", {n}")) for n in counts]
    dr.assert_order(errors, ORDERS[kind])


@pytest.mark.parametrize("words", ["1.5", "table", "formula", "two loads", "two lines"])
def test_the_same_by_other_words(words):
    """A number, a table and a formula of one value, two loads that add up, two lines instead of one: the same cantilever."""
    more = {"table": table("q", (0, 1.5), (1, 1.5)), "formula": formula("q", "1.5 + 0*x"), "two loads": table("q", (0, 1), (1, 0)) +
            table("r", (0, 0.5), (1, 1.5)), "two lines": table("q", (0, 1.5), (1, 1.5))}.get(words, "")
    loads = {"1.5": "ROD, PY, 1.5\n", "two loads": "ROD, PY, q\nROD, PY, r\n"}.get(words, "ROD, PY, q\n")
    text = rod(elements=", 4", more=more) + CLAMPED + step("*DLOAD\n" + loads, 2.0, 0.5)
    if words == "two lines":
        text = dr.changed(text, ("2, 1., 0.\n", "2, 1., 0.\n3, 0.5, 0.\n"), ("1, 2, 4\n", "1, 3, 2\n3, 2, 2\n"))
    base = dr.run_deck(rod(elements=", 4") + CLAMPED + step("*DLOAD\nROD, PY, 1.5\n", 2.0, 0.5))
    run = dr.run_deck(text)
    for name in ("u", "v", "turn"):
        dr.assert_close(run.column(name)[-1], base.column(name)[-1], relative=1e-10)


@pytest.mark.parametrize("turned", [0.7, 3.0])
def test_loads_across_and_along_the_axis_turn_with_the_structure(turned):
    """PN and PT on an arc, in any direction of the arc: the same tip in its own axes."""
    def tip(turned):
        c, s = math.cos(turned), math.sin(turned)

        def place(x, y):
            return f"{c * x - s * y!r}, {s * x + c * y!r}"
        run = dr.run_deck(f"*HEADING\nvarying\n*NODE\n1, {place(1, 0)}\n2, {place(0, 1)}\n*ARC, ELSET=ROD, TYPE=GE8\n1, 2, 0., 0., 4\n"
                          + table("q", (0, 0.5), (math.pi / 2, 2.0)) + formula("r", "1 + s")
                          + "*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS\n1e6, 1.\n"
                          + CLAMPED + step("*DLOAD\nROD, PN, q\nROD, PT, r\n", 1.0, 0.25))
        u, v, turn = (run.column(name)[-1] for name in ("u", "v", "turn"))
        return [c * u + s * v, c * v - s * u, turn]
    own = tip(0.0)
    assert np.max(np.abs(own)) > 0.3
    dr.assert_close(tip(turned), own, absolute=1e-9)


# --- buckling --------------------------------------------------------------------------------------------------------------------------

def bessel(order, x):
    return sum((-1)**k / (math.factorial(k) * math.gamma(k + order + 1)) * (x / 2)**(2 * k + order) for k in range(40))


def test_column_under_a_weight_that_grows_to_its_foot():
    """EI theta'' + q t^2/2 theta = 0 from the tip, t the distance from it: J_-1/4 is zero, total weight 16.10 EI/L^2."""
    low, high = 1.5, 2.5
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if bessel(-0.25, low) * bessel(-0.25, middle) <= 0 else (middle, high)
    text = rod(section="INEXTENSIBLE\n1.", more=table("q", (0, -2), (1, 0))) + CLAMPED
    run = dr.run_deck(text + step("*DLOAD\nROD, PX, q\n", 20.0, 4.0, "CYLINDRICAL", accuracy="*ACCURACY, TOLERANCE=1E-6\n"))
    dr.assert_close(run.load("BP"), 4 * low**2, relative=1e-6)
    text = dr.changed(text, ("1, 2\n", "1, 2, 16\n"))
    buckled = dr.run_deck(text + "*STEP, NAME=B\n*BUCKLE\n1\n*DLOAD\nROD, PX, q\n*END STEP\n")
    dr.assert_close(buckled.results.buckling["B"].load_factor, [4 * low**2], relative=1e-5)      # (q/n)^4/360 with q^2 = 16


def cone(kind="GE8", elements="", radius=None, accuracy="*ACCURACY, TOLERANCE=1E-7\n", code=0):
    """Critical load of a hinged column whose radius grows from r to 2 r: I grows with the fourth power, w = x sin(k/x + c), and
    P = pi^2 E sqrt(I1 I2)/L^2 exactly; with I1 = 1, I2 = 16. The radius is so small that P/EA is 1e-11."""
    r = 1e-6
    text = (rod(kind, elements, "CIRC, MATERIAL=M\nr", f"*MATERIAL, NAME=M\n*ELASTIC\n{4 / math.pi / r**4!r}\n"
                + (radius or table("r", (0, r), (1, 2 * r)))) + "*BOUNDARY\n1, 1, 2\n2, 2\n"
            + step("*CLOAD\n2, 1, -1.\n", 45.0, 10.0, "CYLINDRICAL", accuracy=accuracy))
    return dr.run_deck(text, code=code)


CONE = 4 * math.pi**2


@pytest.mark.parametrize("radius", ["table", "formula"])
def test_cone_column(radius):
    run = cone(radius=None if radius == "table" else formula("r", "1e-6*(1 + s)"))
    dr.assert_close(run.load("BP"), CONE, relative=1e-7)


@pytest.mark.parametrize("kind, counts", [("GE2", (16, 32, 64)), ("GE4", (8, 16, 32)), ("GE6", (4, 8, 16)), ("GE8", (2, 4))])
def test_order_of_the_cone(kind, counts):
    runs = [cone(kind, f", {n}", accuracy="*ACCURACY, TOLERANCE=1E-9, WIDEST=1\n", code=None) for n in counts]
    found = [run.only("BP") for run in runs]
    errors = [abs(point.load_factor - CONE) for point in found]
    if kind == "GE8":       # between 2 and 4 elements the order is still to come: 3E-3 and 1E-6
        assert errors[1] < errors[0] / 2**7
    else:
        dr.assert_order(errors, ORDERS[kind])
    for point, error in zip(found, errors):
        assert error <= point.error, (kind, error, point.error)


def quarter(loads, end):
    return ("*HEADING\nring\n*NODE\n1, 1., 0.\n2, 0., 1.\n*ARC, ELSET=RING, TYPE=GE8\n1, 2, 0., 0.\n"
            "*BEAM SECTION, ELSET=RING, SECTION=STIFFNESS\n1e8, 1.\n*BOUNDARY\n1, 2\n1, 6\n2, 1\n2, 6\n*MONITOR, NAME=u\n1, U1\n"
            + step(loads, end, 0.5, "CYLINDRICAL", accuracy="*ACCURACY, TOLERANCE=1E-6\n"))


@pytest.mark.parametrize("kind, exact", [("P", 3.0), ("PN", 4.0)])
def test_ring_under_pressures(kind, exact):
    """A quarter of a ring, symmetric: a pressure that follows buckles it at 3 EI/R^3, dead forces along the normals at 4. The ring
    becomes smaller by q/EA first, so that the load grows by a factor of about 1 + 2 q/EA."""
    text = quarter(f"*DLOAD\nRING, {kind}, 1.\n", 5.0)
    run = dr.run_deck(text)
    assert run.labelled("BP")[0].load_factor == pytest.approx(exact, rel=2e-6)
    text = dr.changed(text, ("1, 2, 0., 0.\n", "1, 2, 0., 0., 6\n"))
    buckled = dr.run_deck(text[:text.index("*STEP")] + f"*STEP, NAME=B\n*BUCKLE\n1\n*DLOAD\nRING, {kind}, 1.\n*END STEP\n")
    dr.assert_close(buckled.results.buckling["B"].load_factor, [exact], relative=2e-4)      # an element turns the mode by pi/6: (pi/6)^4/360 is 2e-4


# --- liquids -----------------------------------------------------------------------------------------------------------------------------

def folds(run):
    """The located points of the fold."""
    branch, = run.results.branches.values()
    return [point for point in branch.critical if point.label == "UZ"]


def test_sheet_on_a_liquid():
    """Pushed together by D: the force is 2 - D^2/16, the fold D/2 deep; half of the sheet moves by D/2. At D = 2 the sheet of finite
    length feels its end by exp(-40/4)^2 = 2e-9."""
    run = dr.run_deck(dr.example("sheet-on-liquid"))
    found = {round(point.monitors["push"]): point for point in folds(run)}
    for push, exact in ((1, 1.75), (2, 1.0)):
        error = abs(found[push].load_factor - exact)
        assert error <= found[push].error + 1e-7
        assert error < 1e-6
        dr.assert_close(found[push].monitors["depth"], push, relative=1e-6)


def test_sheet_of_other_meshes_has_the_bars_it_says():
    for elements in (24, 32, 48):
        run = dr.run_deck(dr.changed(dr.example("sheet-on-liquid"), ("1, 2, 64", f"1, 2, {elements}"), ("*STATIC, METHOD=CYL", "*ACCURACY, WIDEST=1\n*STATIC, METHOD=CYL")), code=None)
        for point in folds(run):
            exact = 2 - point.monitors["push"]**2 / 4
            assert abs(point.load_factor - exact) <= point.error + 1e-7, (elements, point)


def test_a_floating_sheet_buckles_linearly_as_on_its_path():
    """K = 1: the linear problem is that of a Winkler bed."""
    text = dr.example("sheet-on-liquid")
    text = text[:text.index("*STEP, NAME=PUSH")] + "*STEP, NAME=B\n*BUCKLE\n1\n*CLOAD\n2, 1, -1.\n*END STEP\n"
    dr.assert_close(dr.run_deck(text).results.buckling["B"].load_factor, [2.006017397777], relative=1e-5)


def test_a_ring_in_a_deep_liquid_buckles_as_under_pressure():
    """The level is a million radii above: the pressure differs by 1E-6 from 1."""
    text = dr.changed(quarter("", 4.0), ("1, 2, 0., 0.\n", "1, 2, 0., 0., 6\n"))
    buckled = dr.run_deck(text[:text.index("*STEP")] + "*STEP, NAME=B\n*BUCKLE\n1\n*LIQUID\nRING, 1e-6, 1e6\n*END STEP\n")
    dr.assert_close(buckled.results.buckling["B"].load_factor, [3.0], relative=2e-4)


def test_archimedes():
    """A stiff ring in a liquid is lifted by the weight of what it displaces, and a deeper one by the same."""
    for level in (1.0, 7.0):
        text = ("*HEADING\nring\n*NODE\n1, 1., 0.\n*RING, ELSET=RING, TYPE=GE8\n1, 0., 0., 6\n"
                "*BEAM SECTION, ELSET=RING, SECTION=STIFFNESS\n1e9, 1e9\n*BOUNDARY\n1, ENCASTRE\n*MONITOR, NAME=lift\n1, RF2, -1.\n"
                "*MONITOR, NAME=side\n1, RF1\n*MONITOR, NAME=turn\n1, RM\n" + step(f"*LIQUID\nRING, 2., {level!r}\n", 1.0, 1.0))
        run = dr.run_deck(text)
        # area of the ring whose radius became smaller by the pressure over EA; shapes change by 1E-8
        dr.assert_close(run.column("lift")[-1], 2 * math.pi, relative=1e-7)
        dr.assert_close(run.column("side")[-1], 0, absolute=1e-6)
        dr.assert_close(run.column("turn")[-1], 2 * math.pi, relative=1e-7)      # against the buoyancy, a radius away


# --- contact, restart -----------------------------------------------------------------------------------------------------------------------

def test_a_strip_whose_weight_grows_is_lifted():
    """Small deflections: with the weight q(t) at t from the lifted end the moment is F t - int q (t - t'), zero with slope and deflection
    where the strip lies, at t = a; the height of the end is int M t / EI."""
    small = 1e-7

    def q(t):
        return 1 + (2 - t)

    def height(a):
        force = gauss(lambda t: q(t) * (a - t), 0, a) / a
        return force, gauss(lambda t: t * (force * t - gauss(lambda p: q(p) * (t - p), 0, t)), 0, a)
    force, _ = height(0.8)
    text = (rod(more=table("q", (0, -1), (2, -3)), nodes="1, 0., 0.\n2, 2., 0.\n")
            + "*BOUNDARY\n1, 1\n*OBSTACLE, NAME=TABLE, TYPE=LINE\n0., 0., 1., 0.\n*CONTACT, OBSTACLE=TABLE, NSET=ROD\n"
            "*MONITOR, NAME=v\n2, U2\n*MONITOR, NAME=table, OBSTACLE=TABLE\nRN\n"
            + step(f"*DLOAD\nROD, PY, q\n", small, small, accuracy="*ACCURACY, TOLERANCE=1E-7\n")
            + step(f"*CLOAD\n2, 2, {force * small!r}\n", 1.0, 0.5, accuracy="*ACCURACY, TOLERANCE=1E-7\n"))
    run = dr.run_deck(text)
    dr.assert_close(run.column("v")[-1], small * height(0.8)[1], relative=1e-6)
    dr.assert_close(run.column("table")[-1], small * (4 - force), relative=1e-9)


def test_contact_of_tapered_rods_is_at_nodes_and_told():
    text = (rod(more=table("EI", (0, 1), (1, 2)), section="STIFFNESS\n1e6, EI", elements=", 8")
            + "*BOUNDARY\n1, ENCASTRE\n*OBSTACLE, NAME=WALL, TYPE=LINE\n0., -0.1, 1., -0.1\n*CONTACT, OBSTACLE=WALL, NSET=ROD\n"
            "*MONITOR, NAME=v\n2, U2\n" + step("*DLOAD\nROD, PY, -1.\n", 1.0, 0.5))
    run = dr.run_deck(text, code=None)
    assert "sections that do not vary" in run.stdout
    dr.assert_close(run.column("v")[-1], -0.1, absolute=1e-12)


def test_a_run_goes_on_with_its_distributions(tmp_path):
    """The state of a run has the distributions and what they gave: a second half is that of the run in one go."""
    import os
    import subprocess
    from unilat.results import read_results
    text = dr.example("tapered-mast")
    half = dr.changed(text, ("stress, ABOVE, 240.\n", "stress, ABOVE, 120.\n"))
    (tmp_path / "half.inp").write_text(half, encoding="utf-8")
    (tmp_path / "whole.inp").write_text(text, encoding="utf-8")
    for arguments in (["half.inp", "-o", "half.h5"], ["--restart", "half.h5", "whole.inp", "-o", "more.h5"], ["whole.inp", "-o", "whole.h5"]):
        subprocess.run([os.environ["UNILAT"], "--quiet", *arguments], cwd=tmp_path, check=True, timeout=60)
    more, whole = (read_results(str(tmp_path / f"{name}.h5")) for name in ("more", "whole"))
    dr.assert_close(more.column("tip").values[-1], whole.column("tip").values[-1], relative=1e-8)


# --- joints of curves inside a chain ---------------------------------------------------------------------------------------------------

TWO_LINES = ("*HEADING\njoined\n*NODE\n1, 0., 0.\n2, {join}, 0.\n3, 1., 0.\n*LINE, ELSET=ROD, NSET=ROD\n1, 2\n2, 3\n"
             "*MONITOR, NAME=v\n3, U2\n*BOUNDARY\n1, ENCASTRE\n")


@pytest.mark.parametrize("join", [0.51, 0.9, 0.13])
def test_an_element_over_the_joint_of_two_lines_has_the_values_of_its_chain(join):
    """A straight rod of two lines has no breakpoint at their joint; most of an element across it may lie on the second line. Load and
    stiffness reach from line to line: v = q L^4/(8 EI) for constant ones, and an integral for a stiffness that falls linearly."""
    small = 1e-6
    constant = table("q", (0, 1), (1, 1))
    falling = table("EI", (0, 1.5), (1, 0.5))
    text = TWO_LINES.format(join=join) + constant + falling + "*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS\n1e9, {}\n"
    for stiffness, exact in (("1.", 1 / 8), ("EI", gauss(lambda s: (1 - s) * (1 - s)**2 / 2 / (1.5 - s), 0, 1))):
        run = dr.run_deck(text.format(stiffness) + step("*DLOAD\nROD, PY, q\n", small, small))
        dr.assert_close(run.column("v")[-1], small * exact, relative=1e-8)   # TIGHT


def test_a_formula_jumps_where_a_closed_chain_begins():
    """A ring of two arcs carries a load that grows with the arc length from its crown all round to it: the sum of a vertical load is
    its integral, 2 pi^2, however the mesh divides the ring. The reaction at the foot has it to the digits of rounding."""
    text = ("*HEADING\nclosed\n*NODE\n1, 0., 1.\n2, 0., -1.\n*ARC, ELSET=ROD, NSET=ROD\n1, 2, 0., 0.\n2, 1, 0., 0.\n"
            "*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS\n1e6, 1.\n*BOUNDARY\n2, ENCASTRE\n*MONITOR, NAME=R\n2, RF2\n"
            "*MONITOR, NAME=u\n1, U1\n") + formula("q", "s")
    small = 1e-6
    run = dr.run_deck(text + step("*DLOAD\nROD, PY, q\n", small, small))
    given = dr.run_deck(text.replace("1, 2, 0., 0.", "1, 2, 0., 0., 24").replace("2, 1, 0., 0.", "2, 1, 0., 0., 24")
                        + step("*DLOAD\nROD, PY, q\n", small, small))
    dr.assert_close(run.column("R")[-1], -small * 2 * math.pi**2, relative=1e-9)
    dr.assert_close(given.column("R")[-1], -small * 2 * math.pi**2, relative=1e-9)
    dr.assert_close(run.column("u")[-1], given.column("u")[-1], relative=1e-7)


def gust_on_a_strip(width, elements=""):
    """Strip on a floor, weight 1 by length; then a load lifts a stretch of this width, with three times the weight at its middle."""
    return f"""*HEADING
Load that lifts a part of a lying strip
*NODE
1, 0, 0
2, 10, 0
*LINE, ELSET=STRIP, NSET=STRIP
1, 2{elements}
*DISTRIBUTION, NAME=gust, ELSET=STRIP, FORMULA
3*exp(-((s - 6.3)/{width})**2)
*BEAM SECTION, ELSET=STRIP, SECTION=STIFFNESS
1e5, 1, , 1
*BOUNDARY
1, ENCASTRE
*OBSTACLE, NAME=FLOOR, TYPE=LINE
-20, 0, 20, 0
*CONTACT, OBSTACLE=FLOOR, NSET=STRIP
*STEP, NAME=WEIGHT
*STATIC, METHOD=LOAD
0.5
*DLOAD
STRIP, GRAV, 1, 0, -1
*END STEP
*STEP, NAME=GUST
*STATIC, METHOD=LOAD
0.1, , 0.2
*DLOAD
STRIP, PY, gust
*END STEP
"""


@pytest.mark.parametrize("elements, length", [("", 10 / 64), (", 40", 0.25), (", 200", 0.05)])
@pytest.mark.parametrize("width", [1.0, 0.5, 0.2])
def test_varying_load_opens_a_line_contact(width, elements, length):
    """The pressure is the weight minus the load, zero at s = 6.3 at load factor 1/3. Line contacts had elements that did not see the load:
    they opened at 0.537 (width 0.5) or not at all. Elements interpolate loads between four Gauss points, with an error of at most
    f''''/4! times the polynomial with these zeros, 8/35 (h/2)^4; f'''' is 12/width^4 at the middle."""
    run = dr.run_deck(gust_on_a_strip(width, elements), code=None)
    (opened,) = run.labelled("C-")
    dr.assert_close(opened.load_factor, 1 / 3, relative=12 / 24 * 8 / 35 * (length / 2 / width)**4 + 1e-6)


@pytest.mark.parametrize("width", [1.0, 0.5, 0.2, 0.1])
def test_error_bar_of_the_load_that_opens_a_line_contact(width):
    """Nothing moves before the line opens; the interpolated load has an error all the same. It is bounded, or the run says that the mesh
    is too coarse for a bound."""
    deck = gust_on_a_strip(width).replace("*STATIC, METHOD=LOAD\n0.1", "*ACCURACY, TOLERANCE=1E-6\n*STATIC, METHOD=LOAD\n0.1")
    run = dr.run_deck(deck, code=None)
    (opened,) = run.labelled("C-")
    assert opened.error > 0.0 and abs(opened.load_factor - 1 / 3) <= opened.error
    assert run.results.complete == (opened.error <= 1e-6)

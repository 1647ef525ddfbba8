"""Heat: *TEMPERATURE gives strain and curvature without stress.

References: closed forms; the heated column beyond buckling by shooting, written here; and the exact similarity of a rod
heated by the strain e to a cold one that is 1 + e times as large: r' = (1 + e + N/EA) t ... per stress-free length is, per
length of the larger rod, r' = (1 + N/EA') t ... with EA' = (1 + e) EA, EI' = (1 + e) EI, GA' = (1 + e) GA.
"""
import math

import numpy as np
import pytest

import deck_runner as dr

# Without stress --------------------------------------------------------------------------------------------------

RING = """*HEADING
Free ring
*NODE
1, 2, 1
*RING, ELSET=RING, NSET=RING, TYPE={kind}
1, 0, 1, 32
*MATERIAL, NAME=M
*ELASTIC
1e7
*EXPANSION
1e-5
*BEAM SECTION, ELSET=RING, SECTION=RECT, MATERIAL=M
1, 0.05
*BOUNDARY
1, ENCASTRE
*MONITOR, NAME=D
17, U1
*STEP
*STATIC, METHOD=LOAD
0.25
*TEMPERATURE
RING, 2000
*FIELD OUTPUT
DISPLACEMENT, SECTION FORCES
*END STEP
"""


@pytest.mark.parametrize("kind", ["GE2", "GE4", "GE6", "GE8", "UL2"])
def test_free_ring_grows_without_stress(kind):
    """Every point moves by e = alpha T = 0.02 times its distance from the held node."""
    run = dr.run_deck(RING.format(kind=kind))
    x = run.results.mesh.coordinates
    moved = run.results.field("displacement", run.results.n_points)
    dr.assert_close(moved[:, :2], 0.02 * (x - x[0]), absolute=1e-12)
    dr.assert_close(moved[:, 2], np.zeros(len(x)), absolute=1e-12)
    # EA alpha T = 1e4 were it blocked; what is left comes from the rounding of the positions.
    assert np.max(np.abs(run.results.field("section_forces", run.results.n_points))) < 1e-8 * 1e4


STRIP = """*HEADING
Strip, hot on one side
*NODE
1, 0, 0
2, 1, 0
*LINE, ELSET=STRIP, TYPE={kind}
1, 2, {elements}
*BEAM SECTION, ELSET=STRIP, SECTION=STIFFNESS
1e5, 1, , , 1e-3
*BOUNDARY
1, ENCASTRE
*MONITOR, NAME=U
2, U1
*MONITOR, NAME=V
2, U2
*MONITOR, NAME=T
2, UR
*STEP
*STATIC, METHOD=LOAD
0.5
*TEMPERATURE
STRIP, 100, 2000
*END STEP
"""


def test_gradient_bends_a_free_strip():
    """Left side hotter: bends to the right, into an arc of curvature -alpha G per stress-free length, stretched by 1 + e."""
    strain, curvature = 0.1, -2.0
    u = (1 + strain) * math.sin(curvature) / curvature - 1
    v = (1 + strain) * (1 - math.cos(curvature)) / curvature
    errors = {}
    for kind, order in (("GE2", 2), ("GE4", 4), ("GE6", 6), ("GE8", 8), ("UL2", 2)):
        errors[kind] = []
        for elements in ((8, 16) if order < 8 else (2, 4)):
            run = dr.run_deck(STRIP.format(kind=kind, elements=elements))
            dr.assert_close(run.column("T")[-1], curvature, absolute=1e-12)
            errors[kind].append(math.hypot(run.column("U")[-1] - u, run.column("V")[-1] - v))
        dr.assert_order(errors[kind], order, below=0.2, above=0.2)


# Blocked ---------------------------------------------------------------------------------------------------------

HELD = """*HEADING
Heated beam between supports
*NODE
1, 0, 0
2, 2, 0
*LINE, ELSET=BEAM, TYPE={kind}
1, 2, 16
*BEAM SECTION, ELSET=BEAM, SECTION=STIFFNESS
1e4, 3, , , 1e-5
*BOUNDARY
{supports}
*MONITOR, NAME=R
2, RF2
*STEP
*STATIC, METHOD=LOAD
1
*TEMPERATURE
BEAM, {change}, {gradient}
*FIELD OUTPUT
SECTION FORCES, DISPLACEMENT
*END STEP
"""


@pytest.mark.parametrize("kind", ["GE2", "GE4", "GE8", "UL2"])
def test_heat_between_two_walls(kind):
    """Nothing moves: N = -EA alpha T, M = EI alpha G, without shear force."""
    run = dr.run_deck(HELD.format(kind=kind, supports="1, ENCASTRE\n2, ENCASTRE", change=5, gradient=7))
    force = run.results.field("section_forces", run.results.n_points)
    expected = np.zeros_like(force)
    expected[..., 0] = -1e4 * 5e-5
    expected[..., 2] = 3 * 7e-5
    dr.assert_close(force, expected, absolute=1e-12)
    dr.assert_close(run.results.field("displacement", run.results.n_points), np.zeros((17, 3)), absolute=1e-15)


@pytest.mark.parametrize("kind", ["GE2", "GE4", "GE8", "UL2"])
def test_propped_cantilever_hot_above(kind):
    """Linear theory: hot above it bends down onto the prop, R = 3 EI alpha G/2 L. The error is (alpha G L)^2, 4e-10."""
    run = dr.run_deck(HELD.format(kind=kind, supports="1, ENCASTRE\n2, 2", change=0, gradient=1))
    dr.assert_close(run.column("R")[-1], 1.5 * 3 * 1e-5 / 2, relative=1e-8)


# Columns ---------------------------------------------------------------------------------------------------------

COLUMN = """*HEADING
Heated column between two walls
*NODE
1, 0, 0
2, 0.5, 0
3, 1, 0
*LINE, ELSET=COLUMN, TYPE={kind}
1, 2, {elements}
2, 3, {elements}
*BEAM SECTION, ELSET=COLUMN, SECTION=STIFFNESS
4000, 1, , , 1e-3
*BOUNDARY
1, ENCASTRE
3, ENCASTRE
*MONITOR, NAME=W
2, U2
*MONITOR, NAME=P
1, RF1
*STEP, NAME=MODES
*BUCKLE
2
*TEMPERATURE
COLUMN, 1
*END STEP
*STEP, NAME=HEAT
*STATIC, METHOD=LOAD
4
*TEMPERATURE
COLUMN, 1
*CONTROLS, LOCATE=1e-10
*STOP
LOAD, ABOVE, 15
*BRANCH, NAME=BUCKLED, SIDE=PLUS
W, ABOVE, 0.15
*END STEP
"""
EA = 4000.0


@pytest.mark.parametrize("kind, elements, error", [("GE4", 40, 2e-7), ("GE8", 10, 1e-8), ("UL2", 40, 1e-3)])
def test_heated_column_buckles(kind, elements, error):
    """Between walls the column keeps its length, so its force is EA e and it buckles at 4 pi^2 EI/L^2 without any
    correction for its shortening: e = 4 pi^2 EI/(EA L^2), whatever the slenderness. Linear buckling says the same, but for
    its stress stiffness, which is linear in the force of an element: k^4 h^4/720 with k = 2 pi/L."""
    run = dr.run_deck(COLUMN.format(kind=kind, elements=elements))
    exact = 4 * math.pi**2 / EA / 1e-3
    dr.assert_close(run.labelled("BP")[0].load_factor, exact, relative=error)
    linear = (math.pi / elements)**4 / 720
    dr.assert_close(run.results.buckling["MODES"].load_factor[0], exact, relative=error + 1.1 * linear)


def shoot(amplitude, steps=400):
    """Heat strain, force and deflection of the buckled column of length 1 whose largest angle is `amplitude`.

    A quarter of it from the inflection (angle a, no moment) to the wall: (EI theta')' = -P (1 + e - P cos/EA) sin."""
    def quarter(p, e):  # numbers, or many of them at once
        h = -0.25 / steps
        y = np.array([amplitude, 0.0, 0.0, 0.0])[:, None] + 0.0 * (p + e)       # theta, m, x, y

        def slope(v):
            c, s = np.cos(v[0]), np.sin(v[0])
            stretch = 1 + e - p * c / EA
            return np.array([v[1], -p * stretch * s, stretch * c, stretch * s])
        for _ in range(steps):
            a = slope(y)
            b = slope(y + 0.5 * h * a)
            c = slope(y + 0.5 * h * b)
            d = slope(y + h * c)
            y = y + h / 6 * (a + 2 * b + 2 * c + d)
        return y
    p, e = 4 * math.pi**2, 4 * math.pi**2 / EA + amplitude**2 / 4
    for _ in range(20):
        y = quarter(p + 1e-5 * np.array([0, 1, -1, 0, 0]), e + 1e-6 * np.array([0, 0, 0, 1, -1]))
        miss = np.array([y[0], y[2] + 0.25])
        r, j = miss[:, 0], np.column_stack([(miss[:, 1] - miss[:, 2]) / 2e-5, (miss[:, 3] - miss[:, 4]) / 2e-6])
        dp, de = np.linalg.solve(j, -r)
        p, e = p + dp, e + de
        if abs(dp) < 1e-11 * p:
            break
    return e, p, -2 * quarter(p, e)[3, 0]


@dr.release_only
def test_heated_column_beyond_buckling():
    """The whole branch against shooting."""
    run = dr.run_deck(COLUMN.format(kind="GE6", elements=20))
    branch = run.results.branches[1]
    strain = 1e-3 * branch.column("load_factor").values
    w, p = branch.column("W").values, branch.column("P").values
    for amplitude in (0.1, 0.3, 0.45):
        e, force, deflection = shoot(amplitude)
        at = np.argsort(np.abs(np.abs(w) - deflection))[:6]
        fit = np.polynomial.Polynomial.fit(np.abs(w[at]), strain[at], 5)
        dr.assert_close(fit(deflection), e, relative=1e-6)
        fit = np.polynomial.Polynomial.fit(np.abs(w[at]), p[at], 5)
        dr.assert_close(fit(deflection), force, relative=1e-6)


# Similarity ------------------------------------------------------------------------------------------------------

E = 0.05


def test_similar_column_beside_a_wall():
    """The column of input/column.inp, heated before it is loaded, against the larger cold one: critical loads, and where
    it touches. Discretised alike, but for which node slides, they agree far below the error of 80 GE4 elements."""
    text = dr.on_given_mesh("column")
    hot = dr.run_deck(dr.changed(text, ("480000., 1.", "480000., 1., , , 1e-3"), ("*STEP\n", f"""*STEP
*STATIC, METHOD=LOAD
1
*TEMPERATURE
COLUMN, {E * 1e3}
*END STEP
*STEP
"""), ("shortening, ABOVE, 0.05", f"shortening, ABOVE, {0.05 - E}")))
    g = 1 + E
    cold = dr.run_deck(dr.changed(text, ("480000., 1.", f"{480000 * g}, {g}"), ("2, 0.5, 0.", f"2, {0.5 * g}, 0."),
                                  ("3, 1., 0.", f"3, {g}, 0."), ("0.0014, 0.00105", f"{0.0014 * g}, {0.00105 * g}")))
    for label in ("C+", "LP", "C-"):
        assert len(hot.labelled(label)) == len(cold.labelled(label)) > 0
        for a, b in zip(hot.labelled(label), cold.labelled(label)):
            dr.assert_close(a.load_factor, b.load_factor, relative=1e-6)
            touch = [run.results.contact.start[c.point - 1, 0] for run, c in ((hot, a), (cold, b))]
            if np.isfinite(touch[1]):
                dr.assert_close(touch[0] * g, touch[1], absolute=1e-5)


ARCH = """*HEADING
Shear-flexible arch under pressure on a foundation
*NODE
1, {r}, 0
2, 0, {r}
*ARC, ELSET=ARCH, NSET=ARCH, TYPE={kind}
1, 2, 0, 0, 12
*BEAM SECTION, ELSET=ARCH, SECTION=STIFFNESS
{ea}, {ei}, {ga}, , 1e-3
*BOUNDARY
1, ENCASTRE
2, ENCASTRE
*OBSTACLE, NAME=GROUND, TYPE=CIRCLE, SIDE=INSIDE, FOUNDATION=WINKLER, MODULUS={k}
0, 0, 1.06
*CONTACT, OBSTACLE=GROUND, NSET=ARCH{points}
*MONITOR, NAME=U
8, U1
*MONITOR, NAME=V
8, U2
*MONITOR, NAME=N
1, RF1
*MONITOR, NAME=M
1, RM
*MONITOR, NAME=G, OBSTACLE=GROUND
RN
{hot}*STEP
*STATIC, METHOD=LOAD
0.2
*CONTROLS, TOLERANCE=1e-12
*DLOAD
ARCH, P, -20
ARCH, PX, {q}
*END STEP
"""


@pytest.mark.parametrize("kind, shear", [("GE4", "30"), ("GE6", ""), ("GE8", "30"), ("UL2", "")])
def test_similar_arch(kind, shear):
    """Heat, follower pressure, dead load, shear and a foundation at once: discretised alike, so they agree to rounding.
    (GE2 does not: its residual bending flexibility h^2/12EI does not grow with the heat.)"""
    g = 1 + E
    points = ", POINTS=NODES" if kind == "UL2" else ""
    hot = dr.run_deck(ARCH.format(kind=kind, points=points, r=1, ea=100, ei=1, ga=shear, k=50 * g, q=3 * g, hot=f"""*STEP
*STATIC, METHOD=LOAD
0.5
*TEMPERATURE
ARCH, {E * 1e3}
*BOUNDARY
1, 1, 1, {E}
2, 2, 2, {E}
*END STEP
"""))
    cold = dr.run_deck(ARCH.format(kind=kind, points=points, r=g, ea=100 * g, ei=g, ga=float(shear) * g if shear else "", k=50, q=3,
                                   hot=""))
    x = [run.results.mesh.coordinates[7] for run in (hot, cold)]
    for i, name in enumerate("UV"):
        dr.assert_close(hot.column(name)[-1] + x[0][i], cold.column(name)[-1] + x[1][i], absolute=1e-8)
    for name in "NMG":
        dr.assert_close(hot.column(name)[-1], cold.column(name)[-1], relative=1e-8)


# What else must know of it ---------------------------------------------------------------------------------------

def test_constant_heat_as_the_second_parameter():
    """The limit point of a heated arch over the heat: the curve ends where a run with that heat has its limit point."""
    text = dr.changed(dr.on_given_mesh("arch-shallow-hinged"), ("*STEP\n", """*STEP
*STATIC, METHOD=LOAD
1
*TEMPERATURE
ARCH, {heat}
*END STEP
*STEP
"""))
    text = text[:text.index("*BRANCH")] + "*STOP\nv, ABOVE, 0.07\n"
    lines = text.splitlines()
    k = next(i for i, line in enumerate(lines) if line.upper().startswith("*BEAM SECTION"))
    assert "STIFFNESS" in lines[k]
    lines[k + 1] = lines[k + 1].rstrip().rstrip(",") + ", , , 1e-6"
    text = "\n".join(lines) + "\n"
    curve = dr.run_deck(text.format(heat=100) + "*LIMIT CURVE, PARAMETER=CONSTANT LOAD\n0.25, 2.\n*END STEP\n")
    direct = dr.run_deck(text.format(heat=200) + "*END STEP\n")
    first = dr.run_deck(text.format(heat=100) + "*END STEP\n")
    load = curve.results.limit_curves["Curve-1"].column("load_factor").values
    assert abs(direct.labelled("LP")[0].load_factor / first.labelled("LP")[0].load_factor - 1) > 1e-3
    dr.assert_close(load[-1], direct.labelled("LP")[0].load_factor, relative=1e-6)
    dr.assert_close(load[0], first.labelled("LP")[0].load_factor, relative=1e-6)


# Against a flat ceiling ------------------------------------------------------------------------------------------

UNDER_A_CEILING = """*HEADING
Heated arch under a flat ceiling, pushed aside at the crown
*NODE
1, 0.22497566339029, 0.26811555509164
2, 0, 0.35
3, -0.22497566339029, 0.26811555509164
*ARC, ELSET=B, NSET=B, DIRECTION=ANTICLOCKWISE
1, 2, 0, 0
*ARC, ELSET=B, NSET=B, DIRECTION=ANTICLOCKWISE
2, 3, 0, 0
*BEAM SECTION, ELSET=B, SECTION=STIFFNESS
493920000, 257.25, , 6000, 1e-05
*BOUNDARY
1, 1
*BOUNDARY
1, 2
*BOUNDARY
3, 1
*BOUNDARY
3, 2
*OBSTACLE, NAME=CEILING, TYPE=LINE
1.05, 0.351645, -1.05, 0.351645
*CONTACT, OBSTACLE=CEILING, NSET=B
*IMPERFECTION, ELSET=B, SHAPE=SINE
7e-06, 2
*MONITOR, NAME=uv
2, U2, 1
*MONITOR, NAME=uw
2, U1, -1
*MONITOR, NAME=fN, ELSET=B
N, 0.035
*STEP
*ACCURACY, TOLERANCE=1E-6
*STATIC, METHOD=SPHERICAL
0.05, , 0.05
*CONTROLS, POINTS=400
*TEMPERATURE
B, 2961
*CLOAD
2, 1, 186.9
*STOP
LOAD, ABOVE, 1
uv, ABOVE, 0.175
uw, ABOVE, 0.175
uw, BELOW, -0.175
*END STEP
"""


@dr.release_only
def test_a_contact_that_moves_far_is_the_same():
    """The point at the crown divides, and one of both points becomes a line: the shortest line whose length the mesh resolves belongs to
    a load 7 % larger, at which the other point is far from where it was. It is no new contact: their number is two all the while.
    Compiled with run-time checks, the program makes other increments behind the division and passes the end of the step unnoticed."""
    run = dr.run_deck(UNDER_A_CEILING)
    assert [c.label for c in run.results.critical] == ["C+", "C-", "EP"]
    count, divides = run.results.contact.count, run.only("C-").point
    assert set(count[divides:]) == {2}

"""What foundations do: bilateral ones, against closed forms of beams on elastic foundations.

Loads are so small, or rods so stiff along their axis, that the linear theory of the closed forms holds.
"""
import functools
import math

import numpy as np
import pytest

import deck_runner as dr

# Bilateral foundations -------------------------------------------------------------------------------------------

K, EI, LAMBDA = 64.0, 1.0, 2.0          # modulus, stiffness, (K/4 EI)^(1/4)
FORCE = 1e-4


@functools.cache
def beam(elements, points="ALONG"):
    """Twenty times 1/LAMBDA on either side of a force: exp(-20) = 2e-9 is left at the ends."""
    return dr.run_deck(f"""*HEADING
Beam on a bilateral foundation
*NODE
1, -10, 0
2, 0, 0
3, 10, 0
*LINE, ELSET=BEAM, NSET=BEAM, TYPE=GE4
1, 2, {elements}
2, 3, {elements}
*BEAM SECTION, ELSET=BEAM, SECTION=STIFFNESS
1e6, 1
*BOUNDARY
2, 1
*OBSTACLE, NAME=GROUND, TYPE=LINE, FOUNDATION=WINKLER, MODULUS=32, WIDTH=2, BILATERAL
-20, -3, 20, -3
*CONTACT, OBSTACLE=GROUND, NSET=BEAM, POINTS={points}
*MONITOR, NAME=W
2, U2
*MONITOR, NAME=RN, OBSTACLE=GROUND
RN
*STEP
*STATIC, METHOD=LOAD
1
*CLOAD
2, 2, {-FORCE}
*FIELD OUTPUT
SECTION FORCES
*END STEP
""")


def middle_moment(run):
    nodes, elements = run.results.mesh.coordinates, run.results.mesh.elements
    left = np.flatnonzero(np.abs(nodes[elements[:, 1], 0]) < 1e-12)
    assert len(left) == 1
    return run.results.field("section_forces", run.results.n_points)[left[0], 1, 2]


def middle_errors(points, meshes):
    """Hetenyi 1946: w0 = F lambda/2k, M0 = F/4 lambda. Relative errors of both."""
    w0, m0 = -FORCE * LAMBDA / (2.0 * K), FORCE / (4.0 * LAMBDA)
    runs = [beam(n, points) for n in meshes]
    return (np.array([run.column("W")[-1] / w0 - 1.0 for run in runs]),
            np.array([middle_moment(run) / m0 - 1.0 for run in runs]))


def test_force_on_a_beam_that_the_ground_holds():
    """Forces inside the elements: all of GE4's order. lambda h is 1/2 on the coarsest mesh, 1/16 on the finest; the
    error of a mesh is about (lambda h)^4/720."""
    w, m = middle_errors("ALONG", (40, 80, 160, 320))
    dr.assert_order(w, 4, below=0.3, above=0.3)
    dr.assert_order(m, 4, below=0.3, above=0.3)
    assert abs(w[-1]) < 5e-8 and abs(m[-1]) < 5e-8


def test_springs_at_nodes_under_a_force():
    """Springs at nodes are the trapezoidal rule, which misses w0 by the fourth order only: the slope of the reaction
    has no jump, other than that of the shear force."""
    w, m = middle_errors("NODES", (40, 80, 160, 320))
    dr.assert_order(w, 4, below=0.3, above=0.3)
    dr.assert_order(m, 2, below=0.3, above=0.3)
    assert abs(w[-1]) < 2e-7 and abs(m[-1]) < 2e-3


def held(obstacle, load, reaction_of="RN", motion=""):
    """A clamped rod of length 1, its tip held by an obstacle in y."""
    return dr.run_deck(f"""*HEADING
Propped cantilever
*NODE
1, 0, 0
2, 1, 0
*LINE, ELSET=ROD, NSET=ROD, TYPE=GE4
1, 2, 8
*NSET, NSET=TIP
2
*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS
1e6, 1
*BOUNDARY
1, ENCASTRE
*OBSTACLE, NAME=PROP, {obstacle}
*CONTACT, OBSTACLE=PROP, NSET=TIP
*MONITOR, NAME=V
2, U2
*MONITOR, NAME=R, OBSTACLE=PROP
{reaction_of}
*STEP
*STATIC, METHOD=LOAD
1
{load}
*END STEP
""")


@pytest.mark.parametrize("sense", [1, -1])
@pytest.mark.parametrize("line", ["0, 0, 2, 0", "2, 0.5, 0, 0.5"])
def test_rigid_bilateral_prop_pushes_and_pulls(sense, line):
    """3/8 of an even load; the obstacle may lie anywhere, on either side: only its direction counts."""
    run = held(f"TYPE=LINE, BILATERAL\n{line}", f"*DLOAD\nROD, PY, {sense * 1e-3}", "RF2")
    dr.assert_close(run.column("V")[-1], 0.0, absolute=1e-15)
    dr.assert_close(run.column("R")[-1], -sense * 3e-3 / 8.0, relative=1e-6)
    assert run.results.accuracy["penetration"] < 1e-13 and run.results.accuracy["tension"] == 0.0


@pytest.mark.parametrize("dy", [1e-3, -1e-3])
def test_bilateral_obstacle_takes_the_tip_along(dy):
    run = held("TYPE=LINE, BILATERAL\n0, 0, 2, 0", f"*OBSTACLE MOTION\nPROP, 0, {dy}", "RF2")
    dr.assert_close(run.column("V")[-1], dy, absolute=1e-15)
    dr.assert_close(run.column("R")[-1], 3.0 * dy, relative=2e-6)      # w'^2 is 1e-6


@functools.cache
def rail(elements, step):
    """A weightless rail, hinged at its ends, on ground that holds it; modulus K, EI 1."""
    return dr.run_deck(f"""*HEADING
Buckling of a rail
*NODE
1, 0, 0
2, 5, 0
*LINE, ELSET=RAIL, NSET=RAIL, TYPE=GE4
1, 2, {elements}
*BEAM SECTION, ELSET=RAIL, SECTION=STIFFNESS
1e8, 1
*BOUNDARY
1, PINNED
2, 2
*OBSTACLE, NAME=GROUND, TYPE=LINE, FOUNDATION=WINKLER, MODULUS=64, BILATERAL
0, 0, 5, 0
*CONTACT, OBSTACLE=GROUND, NSET=RAIL
*MONITOR, NAME=END
2, U1
*STEP
{step}
*CLOAD
2, 1, -1
*END STEP
""")


def rail_loads():
    """Hetenyi 1946: (m pi/L)^2 EI + k (L/m pi)^2, m half-waves."""
    a = (np.arange(1, 12) * math.pi / 5.0)**2
    return np.sort(a + K / a)


def test_rail_buckles_up_and_down():
    """The modes are sines, also with springs at the nodes: K/a is exact, and only the rod has errors, of its order 4."""
    errors = []
    for elements in (20, 40, 80, 160):
        buckling = rail(elements, "*BUCKLE\n3").results.buckling["Step-1"]
        errors.append(np.max(np.abs(np.sort(buckling.load_factor) / rail_loads()[:3] - 1.0)))
    dr.assert_order(errors, 4, below=0.3, above=0.3)
    assert errors[-1] < 1e-6, errors
    # The path finds the first two bifurcations; the prebuckling compression is 1.6e-7. One region all along, no events.
    path = rail(80, f"*STATIC, METHOD=LOAD\n1, , 1\n*STOP\nLOAD, ABOVE, {rail_loads()[1] * 1.01}")
    dr.assert_close([point.load_factor for point in path.labelled("BP")], rail_loads()[:2], relative=1e-5)
    assert np.all(path.results.contact.count == 1) and not path.labelled("C+") and not path.labelled("C-")


# Multi-linear laws -----------------------------------------------------------------------------------------------

SOIL = ((0.0, 0.0), (0.1, 10.0), (0.3, 20.0), (0.4, 20.0), (0.5, 60.0))


def sinking(step, bilateral=False, load=-50.0, points_at="AUTO"):
    """A stiff rod of length 1 and width 3 that only moves in y: one unknown."""
    points = "\n".join(f"{p}, {f}" for p, f in SOIL)
    return dr.run_deck(f"""*HEADING
A block on a multi-linear ground
*NODE
1, 0, 0
2, 1, 0
*LINE, ELSET=ROD, NSET=ROD, TYPE=GE4
1, 2, 1
*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS
1e6, 1e3
*BOUNDARY
1, 1
1, 6
2, 6
*FOUNDATION LAW, NAME=SOIL
{points}
*OBSTACLE, NAME=GROUND, TYPE=LINE, FOUNDATION=LAW, LAW=soil, WIDTH=3{", BILATERAL" if bilateral else ""}
0, 0, 2, 0
*CONTACT, OBSTACLE=GROUND, NSET=ROD, POINTS={points_at}
*MONITOR, NAME=W
2, U2
*MONITOR, NAME=R, OBSTACLE=GROUND
RN
*STEP
{step}
*CLOAD
ROD, 2, {load}
*FIELD OUTPUT
REACTION, GAP
*END STEP
""")


def law_force(penetration):
    """3 times the law; beyond the last point its last slope."""
    p, f = np.array(SOIL).T
    beyond = 3.0 * (60.0 + 400.0 * (np.abs(penetration) - 0.5))
    return np.sign(penetration) * np.where(np.abs(penetration) > 0.5, beyond, 3.0 * np.interp(np.abs(penetration), p, f))


def test_block_follows_the_law():
    """Displacement control across all kinks and along the level stretch, where nothing but rounding makes the tangent regular
    (so springs at the nodes; distributed, whether Newton's method gets along it is up to the rounding)."""
    run = sinking("*STATIC, METHOD=DISPLACEMENT, MONITOR=W\n-0.07, , 0.07\n*STOP\nW, BELOW, -0.63", points_at="NODES")
    w = run.column("W")
    assert len(w) > 9 and w[-1] == pytest.approx(-0.63)
    dr.assert_close(run.column("R"), law_force(-w), absolute=1e-9)
    dr.assert_close(100.0 * run.column("load_factor"), law_force(-w), absolute=1e-6)
    assert all(value < 1e-9 for value in run.results.accuracy.values())
    assert run.results.obstacles["GROUND"].foundation == "law"


def test_block_jumps_over_kinks():
    """Newton crosses two kinks and the level stretch within an increment of load."""
    run = sinking("*STATIC, METHOD=LOAD\n0.5, , 3\n*LOCATE\nLOAD, 1.2", load=-150.0)
    dr.assert_close(run.column("R"), 300.0 * run.column("load_factor"), absolute=1e-9)
    dr.assert_close(law_force(-run.column("W")), 300.0 * run.column("load_factor"), absolute=1e-6)


@pytest.mark.parametrize("load", [-20.0, 20.0])
def test_bilateral_law_pulls_as_it_pushes(load):
    run = sinking("*STATIC, METHOD=LOAD\n0.3", bilateral=True, load=load)
    dr.assert_close(run.column("R"), -2.0 * load * run.column("load_factor"), absolute=1e-9)
    dr.assert_close(law_force(-run.column("W")), run.column("R"), absolute=1e-6)


P1, K1, K2 = 1e-5, 64.0, 8.0        # of a bilinear ground: kink, stiffness before and beyond
SINKING_FORCE = 0.002               # takes the middle of the beam to six times the kink; rotations of 1e-4 count 1e-9


@functools.cache
def exact_sinking():
    """Deflection, moment under the force, and half the length beyond the kink, from the beam's equation in both zones."""
    inner, outer = (K2 / 4.0)**0.25, (K1 / 4.0)**0.25
    # EI w'''' + k2 w = -(k1 - k2) p1 inside, roots (+-1 +-i) inner; EI w'''' + k1 w = 0 outside, decaying roots.
    roots = [r * inner for r in (1 + 1j, -1 + 1j)]

    def row(x, order):
        """Derivative of the four real inner functions."""
        values = [r**order * np.exp(r * x) for r in roots]
        return np.array([part for v in values for part in (v.real, v.imag)])

    def outer_row(order):
        value = (outer * (-1 + 1j))**order
        return np.array([value.real, value.imag])

    def solve(a):
        matrix, rhs = np.zeros((6, 6)), np.zeros(6)
        matrix[0, :4] = row(0.0, 1)
        matrix[1, :4], rhs[1] = row(0.0, 3), SINKING_FORCE / 2.0      # penetration downwards: EI p''' = F/2 beyond the force
        for order in range(4):
            matrix[2 + order, :4] = row(a, order)
            matrix[2 + order, 4:] = -outer_row(order)
            rhs[2 + order] = (K1 - K2) * P1 / K2 if order == 0 else 0.0
        return np.linalg.solve(matrix, rhs)

    low, high = 1e-3, 3.0
    for _ in range(80):
        a = 0.5 * (low + high)
        low, high = (a, high) if solve(a)[4] > P1 else (low, a)
    c = solve(a)
    return row(0.0, 0) @ c[:4] - (K1 - K2) * P1 / K2, -(row(0.0, 2) @ c[:4]), a


@functools.cache
def beam_on_bilinear_ground(elements, points="ALONG", static="METHOD=LOAD", element="GE4"):
    return dr.run_deck(f"""*HEADING
Half of a beam sinking into a bilinear ground
*NODE
1, 0, 0
2, 10, 0
*LINE, ELSET=BEAM, NSET=BEAM, TYPE={element}
1, 2, {elements}
*BEAM SECTION, ELSET=BEAM, SECTION=STIFFNESS
1e6, 1
*BOUNDARY
1, XSYMM
*FOUNDATION LAW, NAME=SOIL
0, 0
{P1}, {K1 * P1}
{2 * P1}, {(K1 + K2) * P1}
*OBSTACLE, NAME=GROUND, TYPE=LINE, FOUNDATION=LAW, LAW=SOIL, BILATERAL
0, 0, 2, 0
*CONTACT, OBSTACLE=GROUND, NSET=BEAM, POINTS={points}
*MONITOR, NAME=W
1, U2
*STEP
*STATIC, {static}
0.25, , 0.25
*STOP
LOAD, ABOVE, 1
*CLOAD
1, 2, {-SINKING_FORCE / 2.0}
*FIELD OUTPUT
SECTION FORCES, GAP
*END STEP
""")


def sinking_errors(points, meshes=(40, 80, 160, 320), element="GE4"):
    """Relative errors of the deflection and the moment under the force."""
    p0, m0, a = exact_sinking()
    assert p0 > 5.0 * P1 and 0.5 < a < 2.0
    runs = [beam_on_bilinear_ground(elements, points, element=element) for elements in meshes]
    return (np.array([-run.column("W")[-1] / p0 - 1.0 for run in runs]),
            np.array([run.results.field("section_forces", run.results.n_points)[0, 0, 2] / m0 - 1.0 for run in runs]))


def test_beam_sinks_into_a_bilinear_ground():
    """A node goes where the kink of the law lies: the order of the elements, wherever that is."""
    w, m = sinking_errors("ALONG")
    dr.assert_order(w, 4, below=0.5, above=0.5)
    # The error of the moment changes its sign with lambda h near 1/2.
    assert abs(w[-1]) < 2e-8 and np.max(np.abs(m)) < 1e-5 and abs(m[-1]) < 2e-8, m
    # Rotations of 1e-4 count 1e-8.
    w, m = sinking_errors("ALONG", (40, 80), "GE8")
    assert np.max(np.abs(w)) < 1e-8 and np.max(np.abs(m)) < 1e-8, (w, m)


def test_beam_sinks_into_a_bilinear_ground_at_nodes():
    """Second order: the moment steadily; the deflection errs less, and by how far the kink is from a node."""
    w, m = sinking_errors("NODES")
    dr.assert_order(m, 2, below=0.3, above=0.3)
    assert abs(m[-1]) < 3e-4 and np.max(np.abs(w)) < 2e-3 and np.max(np.abs(w[2:])) < 2e-4, w


@pytest.mark.parametrize("points", ["ALONG", "NODES"])
@pytest.mark.parametrize("static", ["METHOD=CYLINDRICAL", "METHOD=LOAD, NEWTON=MODIFIED", "METHOD=LOAD, NEWTON=ONCE",
                                    "METHOD=LOAD, LOOP=PAPER"])
def test_other_ways_meet_the_same_kinks(static, points):
    run, same = beam_on_bilinear_ground(80, points, static), beam_on_bilinear_ground(80, points)
    # The marks of other paths come from other points: along the rod the meshes differ, and so their errors do.
    dr.assert_close(run.column("W")[-1], same.column("W")[-1], relative=1e-7 if points == "NODES" else 1e-6)


# Springs at nodes ------------------------------------------------------------------------------------------------

def on_springs(springs, load, supports="", monitors="", step="*STATIC, METHOD=LOAD\n1", more=""):
    """A rod of length 1 and EI 1 from (0, 0) to (1, 0)."""
    supports = f"*BOUNDARY\n{supports}\n" if supports else ""
    return dr.run_deck(f"""*HEADING
Rod on springs
*NODE
1, 0, 0
2, 1, 0
*LINE, ELSET=ROD, NSET=ROD, TYPE=GE4
1, 2, 8
*NSET, NSET=ENDS
1, 2
*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS
1e6, 1
{supports}*SPRING
{springs}
*MONITOR, NAME=U
2, U1
*MONITOR, NAME=V
2, U2
*MONITOR, NAME=PHI
2, UR
{monitors}*STEP
{step}
*CLOAD
{load}
{more}*END STEP
""")


def test_springs_alone_hold_a_rod():
    """An axial force, a force across and a moment at the end of a rod that stands on springs at its other end."""
    run = on_springs("1, 1, 2\n1, 2, 4\n1, 6, 5", "2, 1, 1e-3\n2, 2, 1e-6\n2, 6, 1e-6", monitors="""*MONITOR, NAME=RF1
1, RF1
*MONITOR, NAME=RF2
ENDS, RF2
*MONITOR, NAME=RM
1, RM
""")
    # Of the first order in the small force and moment; the axial force moves all by 1/2000.
    moment = 1e-6 + 1e-6 * 1.0
    angle, force = moment / 5.0, 1e-6
    dr.assert_close(run.column("U")[-1], 1e-3 / 2.0 + 1e-9, relative=1e-8)
    dr.assert_close(run.column("V")[-1], force / 4.0 + angle + force / 3.0 + 1e-6 / 2.0, relative=1e-3)
    dr.assert_close([run.column(name)[-1] for name in ("RF1", "RF2")], [-1e-3, -1e-6], relative=1e-9)
    dr.assert_close(run.column("RM")[-1], -moment, relative=2e-3)
    assert run.results.accuracy["force_balance"] < 1e-12 and run.results.accuracy["moment_balance"] < 1e-12


def test_spring_at_the_tip_of_a_cantilever():
    """Closed form: tip under q and springs k, c: 3 EI + k, c + EI; both springs of a dof add up."""
    k = 7.0
    run = on_springs("2, 2, 3\n2, 2, 4", "2, 2, -1e-4", "1, ENCASTRE", "*MONITOR, NAME=R\n2, RF2\n")
    dr.assert_close(run.column("V")[-1], -1e-4 / (3.0 + k), relative=1e-6)
    dr.assert_close(run.column("R")[-1], k * 1e-4 / (3.0 + k), relative=1e-6)
    run = on_springs("2, 6, 3", "2, 6, 1e-4", "1, ENCASTRE")
    dr.assert_close(run.column("PHI")[-1], 1e-4 / (3.0 + 1.0), relative=1e-6)


@pytest.mark.parametrize("stiffness", [0.5, 20.0])
def test_column_with_an_elastic_side_support(stiffness):
    """Clamped-free column, a side spring at its top: tan(a) = a (1 - a^2/k), P = a^2 (Timoshenko & Gere 1961). Buckling
    and the bifurcation on the path agree with it."""
    def equation(a):
        return math.sin(a) - a * (1.0 - a * a / stiffness) * math.cos(a)

    low, high = math.pi / 2.0, 4.49
    assert equation(low) * equation(high) < 0.0
    for _ in range(80):
        a = 0.5 * (low + high)
        low, high = (a, high) if equation(a) * equation(low) > 0.0 else (low, a)
    run = on_springs(f"2, 2, {stiffness}", "2, 1, -1", "1, ENCASTRE", step="*STATIC, METHOD=LOAD\n0.2, , 1",
                     more=f"*STOP\nLOAD, ABOVE, {1.05 * a * a}\n")
    # GE4 with h = 1/8: (a h)^4/720, and the shortening by P/EA.
    dr.assert_close(run.load("BP"), a * a, relative=2e-4)
    modes = on_springs(f"2, 2, {stiffness}", "2, 1, -1", "1, ENCASTRE", step="*BUCKLE\n1").results.buckling["Step-1"]
    dr.assert_close(modes.load_factor, [a * a], relative=2e-4)
    assert modes.residual[0] < 1e-7


def test_spring_at_a_node_in_contact():
    """A node on an inclined wall, a side spring across it: the node's axes are turned, the spring's are not."""
    text = """*HEADING
A block between springs slides down a wall
*NODE
1, 0, 0
2, 1, 0
*LINE, ELSET=ROD, NSET=ROD, TYPE=GE4
1, 2, 1
*NSET, NSET=TIP
2
*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS
1e6, 1
*BOUNDARY
1, 6
2, 6
*SPRING
1, 1, 3
1, 2, 5
2, 2, 2
*OBSTACLE, NAME=WALL, TYPE=LINE
0, -1, 2, 1
*CONTACT, OBSTACLE=WALL, NSET=TIP
*MONITOR, NAME=U
2, U1
*MONITOR, NAME=V
2, U2
*MONITOR, NAME=R, OBSTACLE=WALL
RN
*STEP
*STATIC, METHOD=LOAD
1
*CLOAD
2, 2, -1e-3
*END STEP
"""
    run = dr.run_deck(text)
    # Along (1, 1)/sqrt 2: (kx + ky) u = -F, EA and the bending stiffness 12 EI of the guided rod in between.
    along_x, across = 1.0 / (1.0 / 3.0 + 1e-6), 2.0 + 1.0 / (1.0 / 5.0 + 1.0 / 12.0)
    dr.assert_close(run.column("U")[-1], -1e-3 / (along_x + across), relative=1e-3)
    dr.assert_close(run.column("V")[-1], run.column("U")[-1], relative=1e-9)
    assert run.results.accuracy["force_balance"] < 1e-12

"""Ground that carries load sideways: Pasternak foundations and the elastic half-space, against ground_reference.

The ground acts at nodes, as a Winkler foundation does: second order, where nothing else limits it. Loads are so small, or rods
so stiff along their axis, that the linear theory of the references holds.
"""
import functools

import numpy as np
import pytest

import deck_runner as dr
import ground_reference as gr

K, G = 64.0, 16.0
YOUNG, POISSON = 32.0, 0.3
PASTERNAK = "PASTERNAK, MODULUS=32, SHEAR=8, WIDTH=2"           # k = 64, G = 16 per length of rod
FORCE = 1e-4


def half_space(width, young=YOUNG):
    return f"HALF SPACE, YOUNG={young}, POISSON={POISSON}, WIDTH={width}"


@functools.cache
def beam(ground, elements, half=10.0, bilateral=True, ei=1.0, force=FORCE, kind="GE4", step=None, extra=""):
    """A weightless beam under a force in its middle, `elements` on either side."""
    if step is None:
        step = f"*STATIC, METHOD=LOAD\n1\n*CLOAD\n2, 2, {-force}\n*FIELD OUTPUT\nDISPLACEMENT, SECTION FORCES, REACTION, GAP\n"
    return dr.run_deck(f"""*HEADING
Beam on ground
*NODE
1, {-half}, 0
2, 0, 0
3, {half}, 0
*LINE, ELSET=BEAM, NSET=BEAM, TYPE={kind}
1, 2, {elements}
2, 3, {elements}
*BEAM SECTION, ELSET=BEAM, SECTION=STIFFNESS
1e8, {ei}
*BOUNDARY
2, 1
*OBSTACLE, NAME=GROUND, TYPE=LINE, FOUNDATION={ground}{", BILATERAL" if bilateral else ""}
-20, 0, 20, 0
*CONTACT, OBSTACLE=GROUND, NSET=BEAM, POINTS=NODES
*MONITOR, NAME=W
2, U2, -1
*MONITOR, NAME=RN, OBSTACLE=GROUND
RN
{extra}*STEP
{step}*END STEP
""")


def sinking(run):
    return run.column("W")[-1] / FORCE


def middle_moment(run):
    nodes, elements = run.results.mesh.coordinates, run.results.mesh.elements
    left = np.flatnonzero(np.abs(nodes[elements[:, 1], 0]) < 1e-12)
    assert len(left) == 1
    return run.results.field("section_forces", run.results.n_points)[left[0], 1, 2] / FORCE


def along(run, name):
    """Places of the candidates, and a field of theirs at the last point, from left to right."""
    place = run.results.mesh.coordinates[run.results.contact.candidates, 0]
    order = np.argsort(place)
    return place[order], run.results.field(name, run.results.n_points)[order]


def half_length(run):
    """Of the contact, the same on both sides of the force."""
    start, end = dr.regions(run, "start")[-1], dr.regions(run, "end")[-1]
    middle = 0.5 * (np.max(run.results.mesh.coordinates[:, 0]) - np.min(run.results.mesh.coordinates[:, 0]))
    dr.assert_close(middle - start, end - middle, absolute=1e-7)
    return end - middle


def sound(run):
    """The program's own measures: they sum T r of the law from the reactions, and forces from their definitions."""
    accuracy = run.results.accuracy
    for name in ("penetration", "complementarity", "tension"):
        assert accuracy[name] <= 1e-12, f"{name} {accuracy[name]}"
    # The tolerance of Newton, 1e-9, at some hundred nodes.
    assert accuracy["force_balance"] <= 1e-7 and accuracy["moment_balance"] <= 1e-7, accuracy


# Beams that the ground holds -----------------------------------------------------------------------------------------

# Ends at 17/root: less than 1e-6 of the deflection in the middle is left there.
FAR = 6.0
MESHES = (30, 60, 120, 240)


def test_force_on_a_beam_on_a_pasternak_foundation():
    """Roots of the characteristic equation (Hetenyi 1946, Selvadurai 1979)."""
    w, m = (value[0] for value in gr.pasternak_infinite(K, G, 1.0, 0.0))
    runs = [beam(PASTERNAK, n, half=FAR) for n in MESHES]
    errors = np.array([[sinking(run) / w, abs(middle_moment(run)) / m] for run in runs]).T - 1.0
    for error in errors:
        dr.assert_order(error, 2, below=0.2, above=0.3)
    assert abs(errors[0, -1]) < 2e-4 and abs(errors[1, -1]) < 1e-3
    dr.assert_close(runs[-1].column("RN")[-1], FORCE, relative=1e-9)


def test_deflections_and_moments_along_a_pasternak_foundation():
    run = beam(PASTERNAK, MESHES[-1], half=FAR)
    place, gap = along(run, "gap")
    w, m = gr.pasternak_infinite(K, G, 1.0, np.abs(place))
    dr.assert_close(-gap / FORCE, w, absolute=2e-4 * np.max(w))
    elements = run.results.mesh.elements
    ends = run.results.mesh.coordinates[elements, 0]
    inner = run.results.field("section_forces", run.results.n_points)[:, :, 2] / FORCE
    dr.assert_close(np.abs(inner), np.abs(np.interp(ends, place, m)), absolute=2e-3 * np.max(m))


@pytest.mark.parametrize("width", [0.2, 1.0])
def test_force_on_a_beam_on_the_half_space(width):
    """Biot's integral. Beyond the ends the ground would go on: that is the fourth power of 1/10 here."""
    w, m = gr.half_space_infinite(YOUNG, POISSON, width, 1.0)
    runs = [beam(half_space(width), n) for n in (50, 100, 200)]
    errors = np.array([[sinking(run) / w, abs(middle_moment(run)) / m] for run in runs]).T - 1.0
    for error in errors:
        dr.assert_order(error, 2, below=0.2, above=0.3)
    # What the meshes tend to: a finer one, with its full matrices, takes eight times as long as this one.
    limits = (4.0 * errors[:, -1] - errors[:, -2]) / 3.0
    assert abs(limits[0]) < 1e-4 and abs(limits[1]) < 6e-4
    # His own approximation, for the half width c: 0.332 P c (EI (1 - nu^2)/(E c^4))^0.277.
    c = 0.5 * width
    dr.assert_close(m, 0.332 * c * ((1.0 - POISSON**2) / (YOUNG * c**4)) ** 0.277, relative=0.05)


# Beams that the ground does not hold: contact alone carries them -------------------------------------------------------

def lift_off_errors(exact, runs):
    errors = np.array([[sinking(run) / exact[1], abs(middle_moment(run)) / exact[2]] for run in runs]).T - 1.0
    for error in errors:
        dr.assert_mean_order(error, 2, below=0.25, above=0.4)
    for run in runs:
        sound(run)
        dr.assert_close(run.column("RN")[-1], FORCE, relative=1e-8)
    return errors


@pytest.mark.parametrize("g", [1.0, 160.0])
def test_lift_off_from_a_pasternak_foundation(g):
    exact = gr.pasternak_lift_off(K, g, 1.0)
    meshes = (20, 40, 80, 160)
    runs = [beam(f"PASTERNAK, MODULUS={K}, SHEAR={g}", n, half=2.0, bilateral=False) for n in meshes]
    errors = lift_off_errors(exact, runs)
    assert abs(errors[0, -1]) < 1e-4 and abs(errors[1, -1]) < 2e-3
    # The end of contact from the pressure, which is k w there: to 2 % of an element where some ten elements touch.
    for n, run in zip(meshes[2:], runs[2:]):
        dr.assert_close(half_length(run), exact[0], absolute=0.02 * 2.0 / n)


def test_half_length_on_a_pasternak_foundation_is_one_half():
    dr.assert_close(gr.pasternak_lift_off(K, G, 1.0)[0], 0.5, absolute=1e-7)
    run = dr.run_deck(dr.on_given_mesh("pasternak-point"))
    middle = 2.0
    loaded = run.column("load_factor") > 0.0
    dr.assert_close(dr.regions(run, "end")[loaded] - middle, np.full(np.sum(loaded), 0.5), absolute=5e-4)
    dr.assert_close(run.column("sinking")[-1], 1.12749245e-6, relative=2e-4)
    dr.assert_close(abs(middle_moment(run)), 9.01993960e-2, relative=1e-3)
    dr.assert_close(run.column("ground")[1:], FORCE * run.column("load_factor")[1:], relative=1e-9)
    # All but linear: the first step finds the contact set and the deflections, the second one what the rotations add.
    assert np.all(run.column("iterations") <= 2)
    sound(run)


def test_without_shear_pasternaks_foundation_is_winklers():
    """What is left: the free ground beside the contact, root(k G) at each end, 1e-4 of what carries."""
    winkler = beam(f"WINKLER, MODULUS={K}", 60, half=2.0, bilateral=False)
    pasternak = beam(f"PASTERNAK, MODULUS={K}, SHEAR=1e-9", 60, half=2.0, bilateral=False)
    dr.assert_close(pasternak.column("W")[-1], winkler.column("W")[-1], relative=1e-4)
    dr.assert_close(along(pasternak, "reaction")[1], along(winkler, "reaction")[1], absolute=2e-4 * FORCE)
    shared = beam(f"PASTERNAK, MODULUS={K}, SHEAR=1", 60, half=2.0, bilateral=False)
    assert shared.column("W")[-1] < 0.98 * winkler.column("W")[-1]


@pytest.mark.parametrize("width", [0.2, 1.0])
def test_lift_off_from_the_half_space(width):
    exact = gr.half_space_lift_off(YOUNG, POISSON, width, 1.0)
    meshes = (20, 40, 80, 160)
    runs = [beam(half_space(width), n, half=3.0, bilateral=False) for n in meshes]
    errors = lift_off_errors(exact, runs)
    assert abs(errors[0, -1]) < 1e-4 and abs(errors[1, -1]) < 5e-4
    # The pressure ends with a root: to 2/5 of an element, and always short of the end.
    for n, run in zip(meshes, runs):
        assert -0.4 * 3.0 / n < half_length(run) - exact[0] < 0.0


@pytest.mark.parametrize("ground", [f"PASTERNAK, MODULUS={K}, SHEAR={G}", half_space(0.5)])
@pytest.mark.parametrize("force", [1e-8, 1e-2])
def test_contact_is_independent_of_the_load(ground, force):
    """Rotations are a tenth of the force on EI = 1, what they do is of second order."""
    plain, other = (beam(ground, 60, half=2.0, bilateral=False, force=f) for f in (FORCE, force))
    dr.assert_close(half_length(other), half_length(plain), absolute=1e-6 + force**2)
    dr.assert_close(other.column("W")[-1] / force, sinking(plain), relative=1e-7 + force**2)


def test_a_graded_mesh():
    """Elements from 1 to 20: the same answer to the second order of the longest, 0.09, at the force 0.005."""
    deck = dr.changed(dr.on_given_mesh("pasternak-point"), ("1, 2, 80\n", "1, 2, 80, 0.05\n"), ("2, 3, 80\n", "2, 3, 80, 20\n"))
    run = dr.run_deck(deck)
    dr.assert_close(run.column("sinking")[-1], 1.12749245e-6, relative=1e-3)
    sound(run)
    strip = dr.changed(dr.on_given_mesh("half-space-strip"), ("1, 2, 50\n", "1, 2, 50, 0.05\n"), ("2, 3, 50\n", "2, 3, 50, 20\n"))
    even, graded = dr.run_deck(dr.on_given_mesh("half-space-strip")), dr.run_deck(strip)
    dr.assert_close(graded.column("sinking")[-1], even.column("sinking")[-1], relative=3e-3)
    sound(graded)


@pytest.mark.parametrize("ground", [f"WINKLER, MODULUS={K}", f"PASTERNAK, MODULUS={K}, SHEAR={G}", half_space(0.5)])
def test_touching_without_force_is_no_contact_to_lose(ground):
    """A weightless beam under two forces: it lies on all of the ground at first, and on two parts of it under any load."""
    step = f"*STATIC, METHOD=LOAD\n0.5\n*CLOAD\n1, 2, {-FORCE}\n3, 2, {-FORCE}\n"
    run = beam(ground, 60, half=4.0, bilateral=False, step=step)
    assert not run.labelled("C-") and not run.labelled("C+")
    assert list(run.results.contact.count[1:]) == [2, 2]
    sound(run)


# A strip ----------------------------------------------------------------------------------------------------------------

def test_strip_on_the_half_space():
    run = dr.run_deck(dr.on_given_mesh("half-space-strip"))
    step, load = run.column("step"), run.column("load_factor")
    length = dr.regions(run, "end") - dr.regions(run, "start")
    # Under its weight, and under 100 kN, the whole strip presses; from 200 kN on ever less of it.
    full = (step == 1) | (load <= 100.0)
    dr.assert_close(length[full], np.full(np.sum(full), 10.0), absolute=1e-12)
    assert np.all(np.diff(length[(step == 2) & (load >= 200.0)]) <= 1e-9)
    half, rate, _ = gr.half_space_lift_off(50e3, 0.3, 1.0, 30e6 * 0.5**3 / 12.0)
    assert half < 0.5 * length[-1] < 1.06 * half
    # The weight's share of the load has become 6 %; the mesh is good for 1e-3.
    dr.assert_close(np.diff(run.column("sinking"))[-1] / np.diff(load)[-1], rate, relative=2e-3)
    dr.assert_close(run.column("soil")[step == 2], 2.5 * 9.81 * 5.0 + load[step == 2], relative=1e-9)
    sound(run)


@pytest.mark.parametrize("length, width", [(1.0, 1.0), (10.0, 1.0), (2.0, 5.0)])
def test_stiff_strip_is_a_punch(length, width):
    """Pressures grow towards the edges without limit, so equal elements give the first order; the middle is better."""
    stiffness, pressure = gr.rigid_strip(length, 1.0, 0.0, width)
    runs = [beam(f"HALF SPACE, YOUNG=1, POISSON=0, WIDTH={width}", n, half=0.5 * length, bilateral=False,
                 ei=1e3 * length**4) for n in (8, 16, 32, 64)]
    errors = [1.0 / sinking(run) / stiffness - 1.0 for run in runs]
    # What is left of bending is some 1e-5.
    dr.assert_order(np.array(errors[:3]) - 1e-5, 1, below=0.2, above=0.2)
    place, reaction = along(runs[-1], "reaction")
    h = 0.5 * length / 64
    inner = np.abs(place) < 0.4 * length
    dr.assert_close(reaction[inner] / h / FORCE, pressure(place[inner]) / stiffness, relative=4e-3)
    assert reaction[0] / (0.5 * h) > 3.0 * reaction[64] / h


def test_a_loaded_rod_takes_its_neighbour_down():
    """Two short strips on one half-space, 6 apart: the other one, loaded by 1e-6 of it, sinks as under a point load."""
    def deck(second):
        return f"""*HEADING
Neighbours
*NODE
1, -0.25, 0
2, 0.25, 0
3, 5.75, 0
4, 6.25, 0
*LINE, ELSET=BOTH, NSET=FIRST
1, 2, 8
*LINE, ELSET=BOTH, NSET=SECOND
{"3, 4" if second == "GROUND" else "4, 3"}, 8
*NSET, NSET=ALL
FIRST, SECOND
*BEAM SECTION, ELSET=BOTH, SECTION=STIFFNESS
1e4, 1e2
*BOUNDARY
1, 1
3, 1
*OBSTACLE, NAME=GROUND, TYPE=LINE, FOUNDATION=HALF SPACE, YOUNG=2, POISSON=0.25, WIDTH=0.4
-1, 0, 9, 0
*OBSTACLE, NAME=OTHER, TYPE=LINE, FOUNDATION=HALF SPACE, YOUNG=2, POISSON=0.25, WIDTH=0.4
-1, 0, 9, 0
*CONTACT, OBSTACLE=GROUND, NSET=FIRST
*CONTACT, OBSTACLE={second}, NSET=SECOND
*MONITOR, NAME=A
FIRST, U2, -1
*MONITOR, NAME=B
SECOND, U2, -1
*MONITOR, NAME=TILT
SECOND, UR
*STEP
*STATIC, METHOD=LOAD
1
*CLOAD
FIRST, 2, -1e-4
SECOND, 2, -1e-10
*END STEP
"""
    together, apart = dr.run_deck(deck("GROUND")), dr.run_deck(deck("OTHER"))
    total, soft = 9e-4, (1.0 - 0.25**2) / (2.0 * np.pi)
    # 1/d over both strips: variances 2 (0.5^2/12) along, or a bit more, and 0.4^2/6 across; half of their share of 6^2.
    dr.assert_close(together.column("B")[-1], total * soft / 6.0, relative=3e-3)
    # It rests on the two nodes about its middle, 0.06 apart, on ground that is curved by 2/d.
    dr.assert_close(together.column("TILT")[-1], total * soft / 36.0, relative=0.06 * 2.0 / 6.0 + 1e-2)
    assert apart.column("B")[-1] < 1e-4 * together.column("B")[-1]
    dr.assert_close(apart.column("A")[-1], together.column("A")[-1], relative=1e-5)
    assert together.results.accuracy["penetration"] < 1e-12


# Between an indenter and the ground -----------------------------------------------------------------------------------

INDENTER = """*HEADING
A rigid disc presses a beam onto ground
*NODE
1, -2., 0.
2, 0., 0.
3, 2., 0.
*LINE, ELSET=BEAM, NSET=BEAM, TYPE=GE4
1, 2, 40
2, 3, 40
*BEAM SECTION, ELSET=BEAM, SECTION=STIFFNESS
1e6, 1., , 1.
*BOUNDARY
2, 1
*OBSTACLE, NAME=GROUND, TYPE=LINE, FOUNDATION={ground}
-5., 0., 5., 0.
*OBSTACLE, NAME=DISC, TYPE=CIRCLE, SIDE=OUTSIDE
0., 1.00001, 1.
*CONTACT, OBSTACLE=GROUND, NSET=BEAM, POINTS=NODES
*CONTACT, OBSTACLE=DISC, NSET=BEAM, POINTS=NODES
*MONITOR, NAME=W
2, U2, -1.
*MONITOR, NAME=UP, OBSTACLE=GROUND
RF2
*MONITOR, NAME=DOWN, OBSTACLE=DISC
RF2
*STEP
*STATIC, METHOD=LOAD
1.
*DLOAD
BEAM, GRAV, 1e-3, 0., -1.
*END STEP
*STEP
*STATIC, METHOD=LOAD
0.1, 1e-6, 0.1
*CONTROLS, TOLERANCE=1e-11
*OBSTACLE MOTION
DISC, 0., -0.02
*END STEP
"""


@pytest.mark.parametrize("ground", [f"PASTERNAK, MODULUS={K}, SHEAR={G}", half_space(0.5)])
def test_indenter_beam_and_ground(ground):
    """Rigid contact at nodes that the ground carries, too, with the disc moving: what is between them is in balance."""
    run = dr.run_deck(INDENTER.format(ground=ground))
    pressed = run.column("DOWN") < 0.0
    assert np.sum(pressed) >= 9
    dr.assert_close(run.column("UP")[1:] + run.column("DOWN")[1:],
                    np.where(run.column("step") == 1, run.column("load_factor"), 1.0)[1:] * 4e-3, absolute=1e-10)
    # In the middle the beam follows the disc.
    gap = 1e-5 + run.column("W")[-1] - 0.02
    dr.assert_close(gap, 0.0, absolute=1e-9)
    # Quadratic: three iterations an increment, more where the contact set changes.
    assert np.median(run.column("iterations")[pressed]) <= 4
    sound(run)


def test_the_ground_moves_instead():
    """Lifting the ground by 0.02 is lowering the disc by as much, but for where everything ends up."""
    text = dr.changed(INDENTER.format(ground=half_space(0.5)), ("DISC, 0., -0.02\n", "DISC, 0., -0.02\n*LOCATE\nLOAD, 0.2, 0.4, 0.6, 0.8\n"))
    lowered = dr.run_deck(text)
    lifted = dr.run_deck(dr.changed(text, ("DISC, 0., -0.02", "GROUND, 0., 0.02")))
    # The path is another one, and so are the points between.
    rows = [[c.point - 1 for c in run.results.critical if c.label in ("UZ", "EP")] for run in (lowered, lifted)]
    assert [len(found) for found in rows] == [6, 6]
    load, up, contacts, w = ([run.column(name)[found] for run, found in zip((lowered, lifted), rows)]
                             for name in ("load_factor", "UP", "active_contacts", "W"))
    dr.assert_close(load[1], load[0], absolute=1e-9)
    dr.assert_close(up[1], up[0], absolute=1e-8 * np.max(up[0]))
    dr.assert_close(contacts[1], contacts[0])
    motion = np.where(np.arange(6) == 0, 0.0, 0.02 * load[1])
    dr.assert_close(w[1], w[0] - motion, absolute=1e-9)


# Stability ---------------------------------------------------------------------------------------------------------------

HELD = "*BOUNDARY\n1, 6\n3, 6\n"
BUCKLE = "*BUCKLE\n3\n*CLOAD\n1, 1, 1\n3, 1, -1\n"
THRUST = """*STATIC, METHOD=LOAD
0.07, 1e-6, 0.07
*CLOAD
1, 1, {force}
3, 1, {minus}
*STOP
LOAD, ABOVE, {end}
"""


def load_factors(run):
    return np.array(next(iter(run.results.buckling.values())).load_factor)


@pytest.mark.parametrize("ground", ["pasternak", "half-space"])
def test_buckling_against_dense_matrices(ground):
    """Cubic beam elements on the same nodes; both kinds of elements are of the fourth order."""
    errors = []
    for n in (20, 40, 80):
        places = np.linspace(-10.0, 10.0, 2 * n + 1)
        edges = np.concatenate(([-10.0], 0.5 * (places[1:] + places[:-1]), [10.0]))
        compliance = gr.layer_matrix(places, K, G) if ground == "pasternak" else gr.half_space_matrix(edges, YOUNG, POISSON, 0.5)
        found = load_factors(beam(PASTERNAK if ground == "pasternak" else half_space(0.5), n, step=BUCKLE))
        errors.append(np.max(np.abs(found / gr.beam_buckling(places, 1.0, compliance, 3) - 1.0)))
    assert errors[-1] < 3e-5
    assert np.log2(errors[0] / errors[-1]) / 2 > 3.0


def test_buckling_of_a_long_held_rail():
    """Rotations held at the ends: waves of an infinite beam, 2 root(k EI) + G and Biot's ground; the ends add some (pi/L q)^2."""
    for ground, exact in ((PASTERNAK, 2.0 * np.sqrt(K) + G), (half_space(0.5), gr.half_space_buckling(YOUNG, POISSON, 0.5, 1.0))):
        values = [load_factors(beam(ground, n, step=BUCKLE, extra=HELD))[0] / exact - 1.0 for n in (50, 100)]
        assert 0.0 < (4.0 * values[-1] - values[-2]) / 3.0 < 8e-3


@pytest.mark.parametrize("ground", [PASTERNAK, half_space(0.5)])
def test_bifurcations_of_the_path_are_the_buckling_loads(ground):
    """Pivots count the negative eigenvalues of the dense tangent: every one of them is met, in order."""
    exact = load_factors(beam(ground, 40, step=BUCKLE, extra=HELD))
    run = beam(ground, 40, step=THRUST.format(force=exact[0], minus=-exact[0], end=1.3), extra=HELD)
    found = np.array([c.load_factor for c in run.labelled("BP")]) * exact[0]
    # EA = 1e8: the thrust shortens the rod by 3e-7, as much as it changes the load.
    dr.assert_close(found[:3], exact, relative=2e-6)
    assert all(c.located for c in run.labelled("BP"))
    assert run.column("negative_pivots")[-1] == len(found) and run.column("negative_pivots")[0] == 0


@pytest.mark.parametrize("ground", [PASTERNAK, half_space(0.5)])
def test_a_branch_leaves_at_the_first_buckling_load(ground):
    first = load_factors(beam(ground, 40, step=BUCKLE, extra=HELD))[0]
    step = THRUST.format(force=first, minus=-first, end=1.02) + "*BRANCH, NAME=POST\nLOAD, BELOW, 0.98\n"
    run = beam(ground, 40, step=step, extra=HELD)
    there, back = run.results.branches.values()
    load = there.column("load_factor").values
    dr.assert_close(load[0], 1.0, absolute=1e-4)
    dr.assert_close(load[-1], 0.98, absolute=1e-9)
    dr.assert_monotone(load, rising=False)
    dr.assert_close(back.column("load_factor").values[-1], 0.98, absolute=1e-9)


# What must not change the answer --------------------------------------------------------------------------------------

def scene(ground, length=1.0, force=1.0, angle=0.0, mirror=1.0, mesh="line", seed=3, line=1.0):
    """A heavy rod with an eccentric force: contact at one side only, a free end in the air. Units of length and force."""
    c, s = np.cos(angle), np.sin(angle)
    n = 40

    def turned(x, y):
        return f"{c * mirror * x - s * y:.17g}, {s * mirror * x + c * y:.17g}"

    def place(x, y):
        return turned(length * x, length * y)

    at = np.linspace(-2.0, 2.0, n + 1)
    if mesh == "line":
        text = f"*NODE\n1, {place(-2, 0)}\n2, {place(1, 0)}\n3, {place(2, 0)}\n*LINE, ELSET=ROD, NSET=ROD\n1, 2, 30\n2, 3, 10\n"
        held, loaded = 1, 2
    else:
        random = np.random.default_rng(seed)
        labels = random.choice(np.arange(10, 5000), n + 1, replace=False)
        order = random.permutation(n + 1)
        ends = [(labels[k], labels[k + 1]) for k in range(n)]
        if mesh == "backwards":
            ends = [pair[::-1] for pair in ends]
        text = "*NODE\n" + "".join(f"{labels[k]}, {place(at[k], 0.0)}\n" for k in order) + "*ELEMENT, ELSET=ROD\n"
        text += "".join(f"{i + 1}, {ends[k][0]}, {ends[k][1]}\n" for i, k in enumerate(random.permutation(n)))
        text += "*NSET, NSET=ROD\n" + "".join(f"{labels[k]}\n" for k in (range(n, -1, -1) if mesh == "backwards" else range(n + 1)))
        held, loaded = labels[0], labels[30]
    fx, fy = turned(0.0, -4e-2 * force).split(", ")
    gx, gy = turned(0.0, -1e-3 * force / length).split(", ")
    first, second = (place(-5 * mirror, 0), place(5 * mirror, 0))
    support = f"*BOUNDARY\n{held}, 1\n" if abs(s) < 1e-12 else f"*BOUNDARY\n{held}, 2\n"
    return f"""*HEADING
Scene
{text}*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS
{1e4 * force:.17g}, {force * length**2:.17g}
{support}*OBSTACLE, NAME=GROUND, TYPE=LINE, FOUNDATION={ground(length, force)}
{first}, {second}
*CONTACT, OBSTACLE=GROUND, NSET=ROD
*STEP
*STATIC, METHOD=LOAD
0.1, 1e-6, 0.1
*CONTROLS, TOLERANCE=1e-11
*DLOAD
ROD, PX, {gx}
ROD, PY, {gy}
*CLOAD
{loaded}, 1, {fx}
{loaded}, 2, {fy}
*FIELD OUTPUT
REACTION, GAP
*END STEP
"""


def scaled_pasternak(length, force):
    return f"PASTERNAK, MODULUS={64 * force / length**3:.17g}, SHEAR={8 * force / length:.17g}, WIDTH={0.5 * length:.17g}"


def scaled_half_space(length, force):
    return f"HALF SPACE, YOUNG={32 * force / length**2:.17g}, WIDTH={0.5 * length:.17g}"


@functools.cache
def reactions(ground, **options):
    """From one end of the rod to the other, in units of the force."""
    run = dr.run_deck(scene(ground, **options))
    sound(run)
    coordinates = run.results.mesh.coordinates[run.results.contact.candidates]
    angle, mirror = options.get("angle", 0.0), options.get("mirror", 1.0)
    place = mirror * (coordinates @ [np.cos(angle), np.sin(angle)])
    order = np.argsort(place)
    last = run.results.n_points
    assert run.results.contact.count[last - 1] == 1
    return (run.results.field("reaction", last)[order] / options.get("force", 1.0),
            run.results.field("gap", last)[order] / options.get("length", 1.0))


@pytest.mark.parametrize("ground", [scaled_pasternak, scaled_half_space])
@pytest.mark.parametrize("options", [dict(length=1e3), dict(length=1e3, force=1e-3), dict(length=0.0254, force=4.448),
                                     dict(angle=np.pi / 2), dict(mirror=-1.0), dict(mirror=-1.0, angle=np.pi / 2),
                                     dict(mesh="shuffled"), dict(mesh="shuffled", seed=8), dict(mesh="backwards")],
                         ids=lambda options: "-".join(f"{k}={v:.4g}" if isinstance(v, float) else f"{k}={v}"
                                                      for k, v in options.items()))
def test_invariance(ground, options):
    plain, other = reactions(ground), reactions(ground, **options)
    assert 3 < np.sum(plain[0] > 0.0) < 41
    for one, same in zip(plain, other):
        dr.assert_close(same, one, absolute=1e-8 * np.max(np.abs(one)))


# Paths ------------------------------------------------------------------------------------------------------------------

def test_limit_curve_over_the_modulus_of_a_pasternak_foundation():
    """A shallow arch on a bed that holds it: the points of the curve are limit points of ordinary runs."""
    def deck(modulus, curve=""):
        arch = dr.changed(dr.on_given_mesh("arch-shallow-hinged"), ("*ARC, ELSET=ARCH,", "*ARC, ELSET=ARCH, NSET=ARCH,"),
                          ("*BRANCH, NAME=SWAY, SIDE=BOTH, INCREMENT=0.002\nLOAD, BELOW, -6.2\n", ""),
                          ("*CLOAD", "*CONTROLS, LOCATE=1e-8\n*CLOAD"), ("*STOP", f"{curve}*STOP"))
        head, tail = arch.split("*MONITOR, NAME=v\n")
        return (f"{head}*OBSTACLE, NAME=BED, TYPE=LINE, FOUNDATION=PASTERNAK, MODULUS={modulus}, SHEAR=2, BILATERAL\n"
                f"-5, -3, 5, -3\n*CONTACT, OBSTACLE=BED, NSET=ARCH\n*MONITOR, NAME=v\n{tail}")

    card = "*LIMIT CURVE, NAME=BED, PARAMETER=MODULUS, OBSTACLE=BED\n50., 300., 50., 200.\n"
    curve = dr.run_deck(deck(50.0, card)).results.limit_curves["BED"]
    modulus, load = curve.column("parameter").values, curve.column("load_factor").values
    assert modulus[-1] == 300.0 and np.sum(modulus == 200.0) == 1
    for value in (50.0, 200.0):
        first = dr.run_deck(deck(value)).labelled("LP")[0].load_factor
        dr.assert_close(load[modulus == value], [first], relative=1e-8)

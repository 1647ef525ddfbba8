"""What must not change the answer: units, rotation, reflection, labels, the scale of loads, steps; and equal loads.

The scene is a cantilever that a dead load bends over a rigid disc. Newton stops at a residual of TOLERANCE; two ways to
the same point agree to LIMIT, which is TOLERANCE times 1e4: the rod is that much softer than one of its elements.
"""
import functools
import math

import numpy as np
import pytest

import deck_runner as dr

TOLERANCE = "1E-11"
LIMIT = 1e-7
ELEMENTS = 24


def scene(length=1.0, force=1.0, angle=0.0, mirror=1.0, load=12.0, factor=1.0, mesh=None, steps=None, points="NODES",
          method="LOAD", line=2.0):
    """Deck of the scene in units of `length` and `force`, turned by `angle` after a reflection in x."""
    c, s = np.cos(angle), np.sin(angle)

    def turned(x, y):
        return f"{c * x - s * mirror * y:.17g}, {s * x + c * mirror * y:.17g}"

    def place(x, y):
        return turned(length * x, length * y)

    if mesh is None:
        mesh = f"*NODE\n1, {place(0, 0)}\n2, {place(1, 0)}\n*LINE, ELSET=ROD, NSET=ROD\n1, 2, {ELEMENTS}\n"
    px, py = turned(0.0, -load * force / factor).split(", ")
    qx, qy = turned(0.3 * line * force / length / factor, -line * force / length / factor).split(", ")
    loads = f"*CLOAD\n2, 1, {px}\n2, 2, {py}\n*DLOAD\nROD, PX, {qx}\nROD, PY, {qy}\n"
    if steps is None:
        steps = [factor]
    text = f"""*HEADING, JOB=scene
Cantilever over a disc
{mesh}*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS
{force * 1e4:.17g}, {force * length**2:.17g}
*BOUNDARY
1, ENCASTRE
*OBSTACLE, NAME=DISC, TYPE=CIRCLE, SIDE=OUTSIDE
{place(0.5, -0.36)}, {0.3 * length:.17g}
*CONTACT, OBSTACLE=DISC, NSET=ROD, POINTS={points}
*MONITOR, NAME=ux
2, U1, {1 / length:.17g}
*MONITOR, NAME=uy
2, U2, {1 / length:.17g}
*MONITOR, NAME=rotation
2, UR
*MONITOR, NAME=fx
1, RF1, {1 / force:.17g}
*MONITOR, NAME=fy
1, RF2, {1 / force:.17g}
*MONITOR, NAME=fm
1, RM, {1 / (force * length):.17g}
"""
    for end in steps:
        stop = f"LOAD, ABOVE, {end:.17g}"
        first = 0.1 * factor
        text += f"""*STEP
*STATIC, METHOD={method}
{first:.17g}, {1e-6 if method != 'LOAD' else 1e-6 * factor:.17g}, {0.1 if method != 'LOAD' else first:.17g}
*CONTROLS, TOLERANCE={TOLERANCE}, DESIRED=15
{loads}*STOP
{stop}
*FIELD OUTPUT
DISPLACEMENT, SECTION FORCES, REACTION
*END STEP
"""
    return text


@functools.cache
def run(**options):
    return dr.run_deck(scene(**options))


def rows(run_, angle=0.0, mirror=1.0):
    """Load factors, tip and reactions of all points, turned back into the axes of the plain scene."""
    c, s = np.cos(angle), np.sin(angle)
    x, y, m, fx, fy, fm = (run_.column(name) for name in ("ux", "uy", "rotation", "fx", "fy", "fm"))
    return np.array([c * x + s * y, mirror * (c * y - s * x), mirror * m,
                     c * fx + s * fy, mirror * (c * fy - s * fx), mirror * fm])


def assert_same(other, load_scale=1.0, limit=LIMIT, **axes):
    plain = run()
    assert list(other.results.path["label"].values) == list(plain.results.path["label"].values)
    dr.assert_close(other.column("load_factor") / load_scale, plain.column("load_factor"), absolute=LIMIT)
    dr.assert_close(rows(other, **axes), rows(plain), absolute=limit, relative=limit)
    dr.assert_close(other.column("active_contacts"), plain.column("active_contacts"))
    dr.assert_close(other.results.contact.count, plain.results.contact.count)


def test_the_scene_has_what_it_takes():
    """Contact is gained on the way, several nodes touch, deflections are large."""
    plain = run()
    # Ten increments; one that meets the disc is divided where it does.
    assert 11 <= plain.results.n_points - len(plain.labelled("C+")) - len(plain.labelled("C-")) <= 12
    assert plain.results.contact.count[0] == 0 and plain.results.contact.count[-1] == 1
    assert plain.column("active_contacts")[-1] >= 2
    assert np.min(plain.column("uy")) < -0.3


def test_supports_and_disc_carry_the_load():
    plain = run()
    forces = plain.results
    last = forces.n_points
    away = forces.field("contact_point", last) - np.array([0.5, -0.36])
    away /= np.linalg.norm(away, axis=1)[:, None]
    total = np.sum(forces.field("reaction", last)[:, None] * away, axis=0)
    total += [plain.column("fx")[-1], plain.column("fy")[-1]]
    dr.assert_close(total, [-0.6, 14.0], absolute=1e-8)


@pytest.mark.parametrize("length, force", [(1e3, 1.0), (1e3, 1e-3), (1e-3, 1e6), (0.0254, 4.4482216152605)])
def test_units(length, force):
    """N and mm, kN and mm, odd ones: the same points, in the same numbers of increments."""
    assert_same(run(length=length, force=force))


@pytest.mark.parametrize("angle", [0.3, np.pi / 2, 2.0, -1.1])
def test_rotation(angle):
    other = run(angle=angle)
    assert_same(other, angle=angle)
    last = other.results.n_points
    for name in ("section_forces", "reaction"):
        dr.assert_close(other.results.field(name, last), run().results.field(name, last), absolute=20 * LIMIT)


def test_reflection():
    assert_same(run(mirror=-1.0), mirror=-1.0)


def test_reflection_and_rotation():
    assert_same(run(mirror=-1.0, angle=0.7), mirror=-1.0, angle=0.7)


@pytest.mark.parametrize("factor", [100.0, 1e-3])
def test_scale_of_the_loads(factor):
    """A load of 1 N to a factor of 100 is one of 100 N to a factor of 1."""
    assert_same(run(factor=factor), load_scale=factor)


def labelled_mesh(order, labels, flipped):
    """The line as single nodes and elements, in any order, with any labels, some elements the other way round."""
    nodes = [f"{labels[k]}, {k / ELEMENTS:.17g}, 0." for k in range(ELEMENTS + 1)]
    ends = [(labels[k + 1], labels[k]) if flipped[k] else (labels[k], labels[k + 1]) for k in range(ELEMENTS)]
    elements = [f"{7 * k + 3}, {first}, {second}" for k, (first, second) in enumerate(ends)]
    rod = "\n".join(str(label) for label in labels)
    return ("*NODE\n" + "\n".join(nodes[k] for k in np.argsort(order)) + "\n*ELEMENT, ELSET=ROD\n"
            + "\n".join(elements[k] for k in np.argsort(order[:-1])) + f"\n*NSET, NSET=ROD\n{rod}\n")


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("turned_round", [False, True])
def test_labels_and_order(seed, turned_round):
    random = np.random.default_rng(seed)
    labels = random.choice(np.arange(10, 5000), ELEMENTS + 1, replace=False)
    labels[0], labels[-1] = 1, 2
    flipped = random.random(ELEMENTS) < 0.5 if turned_round else np.zeros(ELEMENTS, bool)
    deck = scene(mesh=labelled_mesh(random.random(ELEMENTS + 1), labels, flipped))
    if turned_round:
        refused = dr.run_deck(deck, code=1)
        assert "two elements run against each other" in refused.stderr
    else:
        assert_same(dr.run_deck(deck))


def test_two_steps_of_half_the_load_make_one_of_all():
    """What the first step leaves behind stays; the load factor starts anew."""
    split = dr.run_deck(scene(steps=[0.5, 0.5]))
    dr.assert_close(rows(split)[:, -1], rows(run())[:, -1], absolute=LIMIT)
    dr.assert_close(split.column("load_factor")[-1], 0.5, absolute=1e-12)
    assert sorted(set(split.column("step"))) == [1, 2]


def test_arc_length_does_not_depend_on_units_or_axes():
    """Cylindrical increments are dimensionless: the same points in any units and axes."""
    plain = run(method="CYLINDRICAL")
    for axes, units in (({}, dict(length=1e3, force=1e-3)), (dict(angle=0.4), {}), (dict(mirror=-1.0), {})):
        other = run(method="CYLINDRICAL", **axes, **units)
        dr.assert_close(other.column("load_factor"), plain.column("load_factor"), relative=1e-6)
        dr.assert_close(rows(other, **axes), rows(plain), absolute=1e-6, relative=1e-6)
        dr.assert_close(other.column("arc_length"), plain.column("arc_length"), absolute=1e-6)


def test_arc_length_meets_the_load_controlled_end():
    dr.assert_close(rows(run(method="CYLINDRICAL"))[:, -1], rows(run())[:, -1], absolute=10 * LIMIT,
                    relative=10 * LIMIT)


def test_sliding_contact_is_turned_with_everything():
    plain = run(points="ALONG")
    other = run(points="ALONG", angle=0.9)
    dr.assert_close(rows(other, angle=0.9), rows(plain), absolute=LIMIT, relative=LIMIT)
    dr.assert_close(dr.regions(other, "start")[-1], dr.regions(plain, "start")[-1], absolute=1e-6)


# ---- equal loads ----

ROD = """*HEADING, JOB=rod
rod
*NODE
1, 0., 0.
2, 0.8, 0.6
*LINE, ELSET=ROD, NSET=ROD, TYPE=GE6
1, 2, 12
*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS
1E4, 1., 5E3, 2.5
*BOUNDARY
1, ENCASTRE
*MONITOR, NAME=ux
2, U1
*MONITOR, NAME=uy
2, U2
*MONITOR, NAME=rotation
2, UR
*STEP
*STATIC, METHOD=LOAD
0.25, 1E-6, 0.25
*CONTROLS, TOLERANCE=1E-11
{loads}
*END STEP
"""


def tip(loads, deck=ROD):
    result = dr.run_deck(deck.format(loads=loads))
    return np.array([result.column(name)[-1] for name in ("ux", "uy", "rotation")])


def test_self_weight_is_mass_times_acceleration():
    """Direction (3, -4) normalised, 2.5 * 2 = 5 along it."""
    dr.assert_close(tip("*DLOAD\nROD, GRAV, 2., 3., -4."), tip("*DLOAD\nROD, PX, 3.\nROD, PY, -4."), absolute=LIMIT)


def test_self_weight_of_a_material():
    """A circular rod of density 500: rho pi r^2 g per length; the section as numbers."""
    by_card = dr.changed(ROD, ("*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS\n1E4, 1., 5E3, 2.5",
                               "*MATERIAL, NAME=M\n*ELASTIC\n1E5, 0.25\n*DENSITY\n500.\n"
                               "*BEAM SECTION, ELSET=ROD, SECTION=CIRC, MATERIAL=M, SHEAR=FLEXIBLE\n0.05"))
    area = np.pi * 0.05**2
    by_number = dr.changed(ROD, ("1E4, 1., 5E3, 2.5", f"{1e5 * area:.17g}, {1e5 * np.pi * 0.05**4 / 4:.17g}, "
                                 f"{0.9 * area * 1e5 / 2.5:.17g}, {500 * area:.17g}"))
    load = "*DLOAD\nROD, GRAV, 0.1, 0., -1."
    dr.assert_close(tip(load, by_card), tip(load, by_number), absolute=LIMIT)
    assert abs(tip(load, by_card)[1]) > 1e-2


def test_loads_of_a_set_are_those_of_its_members():
    dr.assert_close(tip("*DLOAD\nROD, PY, -3."), tip("*DLOAD\n" + "".join(f"{k}, PY, -3.\n" for k in range(1, 13))),
                    absolute=LIMIT)


def test_repeated_loads_add_up():
    dr.assert_close(tip("*CLOAD\n2, 2, -1.\n2, 2, -2."), tip("*CLOAD\n2, 2, -3."), absolute=LIMIT)


def test_pressure_on_an_almost_rigid_rod_is_a_dead_load_across_it():
    """Follower pressure turns with the rod, here by 1e-3: so much may the two differ, of 1e-3."""
    small = ROD.replace("1E4, 1., 5E3, 2.5", "1E7, 1E3")
    follower, dead = tip("*DLOAD\nROD, P, 5.", small), tip("*DLOAD\nROD, PX, -3.\nROD, PY, 4.", small)
    dr.assert_close(follower, dead, absolute=2e-6)
    assert np.linalg.norm(dead[:2]) > 5e-4


def test_pressure_is_normal_to_the_deformed_rod():
    """At large rotations the work of both differs; the closed ring below tells that the pressure is right."""
    assert np.max(np.abs(tip("*DLOAD\nROD, P, 5.") - tip("*DLOAD\nROD, PX, -3.\nROD, PY, 4."))) > 0.01


def test_prescribed_displacement_equals_load_control():
    held = ROD.replace("*STEP", "*BOUNDARY\n2, 2\n*MONITOR, NAME=force\n2, RF2\n*STEP")
    result = dr.run_deck(held.format(loads="*BOUNDARY\n2, 2, , -0.3"))
    force = result.column("force")[-1]
    dr.assert_close(result.column("uy")[-1], -0.3, absolute=1e-12)
    driven = tip(f"*CLOAD\n2, 2, {force:.17g}")
    dr.assert_close(driven, [result.column(name)[-1] for name in ("ux", "uy", "rotation")], absolute=LIMIT)


def test_displacement_control_equals_load_control():
    driven = ROD.replace("METHOD=LOAD\n0.25, 1E-6, 0.25", "METHOD=DISPLACEMENT, MONITOR=uy\n-0.1, 1E-6, 0.1")
    result = dr.run_deck(driven.format(loads="*CLOAD\n2, 2, -1.\n*STOP\nuy, BELOW, -0.3"))
    dr.assert_close(result.column("uy")[-1], -0.3, relative=1e-8)
    same = tip(f"*CLOAD\n2, 2, {-result.column('load_factor')[-1]:.17g}")
    dr.assert_close([result.column(name)[-1] for name in ("ux", "uy", "rotation")], same, absolute=LIMIT)


# ---- a free ring under pressure ----

RING = """*HEADING, JOB=free-ring
Free ring under pressure
*NODE
1, 0., -1.
2, 0., 1.
*ARC, ELSET=RING, NSET=RING, TYPE={element}
1, 2, 0., 0., {half}
2, 1, 0., 0., {half}
*BEAM SECTION, ELSET=RING, SECTION=STIFFNESS
{ea}, 1.
*BOUNDARY
1, 1, 2
2, 1
*MONITOR, NAME=v
2, U2
*STEP
*ACCURACY
LOAD
** EA = 1E8 moves the ring by less than chords of GE4 err by
*STATIC, METHOD=LOAD
0.3, 1E-6, 0.3
{loads}
*STOP
LOAD, ABOVE, {end}
*END STEP
"""
PRESSURE = "*DLOAD\nRING, P, 1."


def free_ring(**options):
    return dr.run_deck(RING.format(**{**dict(element="GE4", half=20, ea="1E4", loads=PRESSURE, end=4.5), **options}))


@pytest.mark.parametrize("element", ["GE2", "GE4", "GE6", "GE8"])
def test_a_ring_under_pressure_stays_a_circle(element):
    """N = -p r on the deformed radius r: r/R = 1/(1 + p R/EA), no bending, exact for any number of arc elements."""
    result = free_ring(element=element, ea="1E2", end=2.4)
    loads = result.column("load_factor")
    h, order = np.pi / 20, int(element[2])
    limit = h**order / math.factorial(order) + 1e-8     # of a chord, and what Newton leaves
    dr.assert_close(result.column("v"), 2.0 / (1.0 + loads / 1e2) - 2.0, absolute=limit * 0.05)


def test_a_ring_under_pressure_buckles_at_three():
    """p R^3/EI = 3 of an inextensible ring; EA R^2/EI = 1E8 changes it by 1e-7, 40 elements by (2 h)^4/720 or so."""
    first = [c for c in free_ring(ea="1E8").results.critical if c.label == "BP"][0]
    dr.assert_close(first.load_factor, 3.0, relative=2e-5)
    assert first.located


def test_buckling_pressure_converges_at_order_4():
    errors = [free_ring(ea="1E8", half=n).labelled("BP")[0].load_factor - 3.0 for n in (6, 12, 24)]
    dr.assert_order(errors, 4, below=0.5, above=1.0)


HALF_RING = """*HEADING, JOB=half-ring
Half of a free ring, symmetric to the y axis
*NODE
1, 0., -1.
2, 0., 1.
*ARC, ELSET=RING, NSET=RING
1, 2, 0., 0., {half}
*BEAM SECTION, ELSET=RING, SECTION=STIFFNESS
1E8, 1.
*BOUNDARY
1, 1, 6
2, XSYMM
*STEP
*STATIC, METHOD=LOAD
0.3, 1E-6, 0.3
{loads}
*STOP
LOAD, ABOVE, 4.5
*END STEP
"""


def test_pressure_and_dead_radial_loads_differ():
    """Symmetric buckling of a ring: p R^3/EI = 3 where the load turns with it, 4 where it keeps its direction."""
    half = 40
    h = np.pi / half
    nodes = [(1, -np.pi / 2, 0.5), (2, np.pi / 2, 0.5)]
    nodes += [(2 + k, -np.pi / 2 + k * h, 1.0) for k in range(1, half)]
    dead = "*CLOAD\n" + "".join(f"{label}, 1, {-share * h * np.cos(a):.17g}\n"
                                f"{label}, 2, {-share * h * np.sin(a):.17g}\n" for label, a, share in nodes)
    first = [dr.run_deck(HALF_RING.format(half=half, loads=loads)).labelled("BP")[0] for loads in (PRESSURE, dead)]
    dr.assert_close(first[0].load_factor, 3.0, relative=2e-5)
    dr.assert_close(first[1].load_factor, 4.0, relative=h**2 / 6.0)     # lumped on nodes


# ---- imperfections ----

COLUMN = """*HEADING, JOB=hinged
Hinged column
*NODE
1, 0., 0.
2, 0.5, 0.
3, 1., 0.
*LINE, ELSET=ROD, NSET=ROD, TYPE=GE6
1, 2, 10
2, 3, 10
*IMPERFECTION, ELSET=ROD, {shape}
*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS
1E8, 1.
*BOUNDARY
1, PINNED
3, 2
*MONITOR, NAME=w
2, U2
*STEP
*STATIC, METHOD=LOAD
0.1, 1E-6, 0.1
*CLOAD
3, 1, -9.869604401089358
*STOP
LOAD, ABOVE, {end}
*END STEP
"""


def hinged(shape, end=0.8):
    return dr.run_deck(COLUMN.format(shape=shape, end=end))


@pytest.mark.parametrize("amplitude", [1e-4, -1e-4])
def test_an_initial_sine_grows_by_the_amplification_factor(amplitude):
    """w = a P/(Pcr - P), to the left of the rod (upwards); the next term is a^2 k^2 amplification^3, 1e-5 of it."""
    result = hinged(f"SHAPE=SINE\n{amplitude}, 1")
    p = result.column("load_factor")[1:]
    dr.assert_close(result.column("w")[1:] / amplitude, p / (1.0 - p), relative=1e-5)


def test_an_initial_cosine_with_a_phase_is_a_sine():
    sine, cosine = hinged("SHAPE=SINE\n1E-3, 1"), hinged("SHAPE=COSINE\n1E-3, 1, -90.")
    dr.assert_close(cosine.column("w"), sine.column("w"), absolute=1e-12)


def test_nodal_offsets_through_a_sine_are_that_sine():
    """Spline through 21 points: its curvature is off by (pi h)^2/12 = 2e-3."""
    offsets = "".join(f"{label}, {1e-3 * np.sin(np.pi * s):.17g}\n"
                      for label, s in [(2, 0.5)] + [(4 + k, (k + 1) / 20) for k in range(9)]
                      + [(13 + k, 0.5 + (k + 1) / 20) for k in range(9)])
    sine, nodal = hinged("SHAPE=SINE\n1E-3, 1"), hinged("SHAPE=NODAL\n" + offsets)
    dr.assert_close(nodal.column("w")[1:], sine.column("w")[1:], relative=2e-3)


def test_random_imperfections_repeat_with_their_seed():
    first, again, other = (hinged(f"SHAPE=RANDOM, SEED={seed}\n1E-3") for seed in (5, 5, 6))
    assert np.array_equal(first.column("w"), again.column("w"))
    assert not np.any(first.column("w")[1:] == other.column("w")[1:])
    offset = first.results.mesh.coordinates[:, 1]
    assert 0.0 < np.max(np.abs(offset)) <= 1e-3
    dr.assert_close(offset[[0, 2]], [0.0, 0.0], absolute=1e-15)

"""*POLE LOAD: forces whose line of action passes through a fixed point.

Reference: a clamped column of length L, pulled at its tip towards a point of its axis at the distance a from the tip
(Timoshenko & Gere, Theory of Elastic Stability, section 2.21: force through a fixed point). With EI w'' = P (d - w) - (P d/a) (L - x)
and d the deflection of the tip, tan(k L) = k (L - a), k^2 = P/EI: a = L gives Euler's column with both ends pinned, a far away
point the dead load.
"""
import numpy as np
import pytest

import deck_runner as dr

# first roots of tan q = q (1 - a/L)
ROOTS = {1.0: np.pi, 0.5: 4.274782271458127, 2.0: 2.028757838110434}
# and of tanh q = q (1 - a/L): pushed away from a near point, which turns the force more than the column
PUSHED = {0.5: 1.9150080481545373}


def column(*steps, elements=8, kind="GE8", ea=1e8):
    return ("*HEADING\npole load\n*NODE\n1, 0, 0\n2, 1, 0\n"
            f"*LINE, ELSET=ROD, NSET=ROD, TYPE={kind}\n1, 2, {elements}\n"
            f"*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS\n{ea!r}, 1.\n*BOUNDARY\n1, ENCASTRE\n"
            "*MONITOR, NAME=U\n2, U1\n*MONITOR, NAME=V\n2, U2\n" + "".join(steps))


def load_step(loads, method="LOAD", end=1.0, first=0.25, name="LOADED"):
    return (f"*STEP, NAME={name}\n*STATIC, METHOD={method}\n{first!r}\n{loads}*STOP\nLOAD, ABOVE, {end!r}\n"
            "*FIELD OUTPUT\nDISPLACEMENT\n*END STEP\n")


def tip(text, **options):
    run = dr.run_deck(text, **options)
    return run.results.field("displacement", run.results.n_points)[1]


def test_roots():
    for a, q in ROOTS.items():
        assert abs(np.tan(q) - q * (1 - a)) < 1e-12
    for a, q in PUSHED.items():
        assert abs(np.tanh(q) - q * (1 - a)) < 1e-12


@pytest.mark.parametrize("a", ROOTS)
@pytest.mark.parametrize("kind, elements", [("GE8", 8), ("GE4", 16), ("UL2", 32)])
def test_buckling(a, kind, elements):
    """Errors of cubic deflections, (q/n)^4/720 (see test_decks_buckling), to which collocation of order 4 adds as much; twice that
    allowed. UL2: (q/n)^2/12."""
    exact = [ROOTS[a]**2] + [-q**2 for near, q in PUSHED.items() if near == a]
    exact.sort(key=abs)
    ea = 1e6 if kind == "UL2" else 1e8
    step = f"*STEP, NAME=BUCKLE\n*BUCKLE\n{len(exact)}\n*POLE LOAD\n2, 1., {1 - a!r}, 0.\n*END STEP\n"
    run = dr.run_deck(column(step, elements=elements, kind=kind, ea=ea))
    part = ROOTS[a] / elements
    below = {"GE8": part**4 / 360, "GE4": part**4 / 180, "UL2": part**2 / 6}[kind]
    dr.assert_close(run.results.buckling["BUCKLE"].load_factor, exact, relative=below)


@pytest.mark.parametrize("a", ROOTS)
def test_bifurcation_on_the_path(a):
    """The straight column is shorter by P/EA, 2e-7 at most, and so is the distance of the pole."""
    step = load_step(f"*POLE LOAD\n2, 1., {1 - a!r}, 0.\n", method="CYLINDRICAL", end=1.1 * ROOTS[a]**2, first=2.0)
    run = dr.run_deck(column(step))
    points = run.results.critical
    assert [p.label for p in points if p.label == "BP"] == ["BP"]
    found = [p.load_factor for p in points if p.label == "BP"]
    dr.assert_close(found, [ROOTS[a]**2], relative=1e-6)


def test_equals_the_dead_load_of_the_same_direction():
    """A state in balance does not know where a force comes from. Rounding times the length over the deflection."""
    pole = np.array([0.3, -0.8])
    u = tip(column(load_step(f"*POLE LOAD\n2, 1.5, {pole[0]!r}, {pole[1]!r}\n"), ea=1e4))
    d = pole - (np.array([1., 0.]) + u[:2])
    force = 1.5 * d / np.hypot(*d)
    assert abs(u[1]) > 0.3
    dead = tip(column(load_step(f"*CLOAD\n2, 1, {float(force[0])!r}\n2, 2, {float(force[1])!r}\n"), ea=1e4))
    dr.assert_close(u, dead, relative=1e-8)


def test_stays_when_the_step_ends():
    """The order of loads does not matter to an elastic rod: both at once, or one after the other."""
    pole, dead = "*POLE LOAD\n2, 2., 0.5, 1.5\n", "*CLOAD\n2, 6, -1.\n"
    at_once = tip(column(load_step(pole + dead), ea=1e4))
    after = tip(column(load_step(pole), load_step(dead, name="THEN"), ea=1e4))
    dr.assert_close(after, at_once, relative=1e-8)


def test_two_halves_make_a_whole():
    whole = tip(column(load_step("*POLE LOAD\n2, 2., 0.5, 1.5\n"), ea=1e4))
    halves = tip(column(load_step("*POLE LOAD\n2, 1., 0.5, 1.5\n2, 1., 0.5, 1.5\n"), ea=1e4))
    dr.assert_close(halves, whole, relative=1e-8)


def test_is_the_limit_of_a_dead_load():
    """Seen from a far away pole the tip hardly moves: the angle changes by v/a, here 1e-6."""
    far = tip(column(load_step("*POLE LOAD\n2, 1., 1., -1e6\n"), ea=1e4))
    dead = tip(column(load_step("*CLOAD\n2, 2, -1.\n"), ea=1e4))
    dr.assert_close(far, dead, absolute=1e-6)


def test_the_mesh_of_contact_spans_carries_it():
    """Contact spans lay a mesh of their own: the node and its load stay. The wall is never touched."""
    wall = ("*OBSTACLE, NAME=WALL, TYPE=LINE\n-1, -3, 3, -3\n*CONTACT, OBSTACLE=WALL, NSET=ROD\n")
    pole = load_step("*POLE LOAD\n2, 2., 0.5, 1.5\n")
    dr.assert_close(tip(column(wall, pole, ea=1e4)), tip(column(pole, ea=1e4)), relative=1e-7)

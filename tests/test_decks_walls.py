"""Columns between two walls, constrained Euler buckling: closed forms of small rotations (gap/L = 1e-4).

Deflections are those of k^2 = P/EI between the supports and where the column touches. Hinged ends, k L = pi (P/Pcr)^(1/2):
one point touches up to P/Pcr = 4, then a line of length L (1 - 2 (Pcr/P)^(1/2)). The ends of the line push with k^3 d/pi each,
the rest of it not at all. Clamped ends are in tests of their own: there the free parts of a line contact, a wave length each,
have no moment at either end and move along the column at no cost to first order, so that nothing holds the line beyond 4.
"""
import functools
import math

import numpy as np
import pytest

import deck_runner as dr

GAP = 1e-4
PERFECT = "1e-11"       # imperfection: what it does is 1e-7 of the gap; of much less equilibrium itself cannot tell
LOADS = (4.2, 5.0, 7.0, 9.0, 12.0, 15.0, 19.0)


def hinged(elements=40, imperfection="1e-8, 1", stop="LOAD, ABOVE, 20.", locate="1.5, 3.5, 9.", branch=True,
           code=0):
    """The deck with other meshes (elements of a half), imperfections and ends."""
    text = dr.changed(dr.on_given_mesh("column-walls"), ("1, 2, 40", f"1, 2, {elements}"), ("2, 3, 40", f"2, 3, {elements}"),
                      ("1e-8, 1\n", f"{imperfection}\n"), ("LOAD, ABOVE, 20.", stop), ("1.5, 3.5, 9.", locate))
    if not branch:
        text = dr.changed(text, ("*BRANCH, NAME=HUMP, SIDE=MINUS\nmidspan, BELOW, -0.00009\n", ""))
    return dr.run_deck(text, code=code)


@functools.cache
def example():
    return hinged()


@functools.cache
def perfect(elements):
    return hinged(elements, f"{PERFECT}, 1", locate=", ".join(str(load) for load in LOADS), branch=False)


def wave(load):
    return math.pi * np.sqrt(load)


def at(run, load):
    """Row of the point located at a load."""
    point, = [c for c in run.labelled("UZ") if abs(c.load_factor - load) < 1e-7 * load]
    return point.point - 1


# Point contact ---------------------------------------------------------------------------------------------------------

def test_first_contact():
    """Of a/(1 - P/Pcr) = d."""
    dr.assert_close(example().load("C+"), 0.9999, relative=1e-7)


@pytest.mark.parametrize("load", [1.5, 3.5])
def test_point_contact(load):
    """With the halves' shear k^3 d/(k l - tan(k l)), l = L/2, one of them at each side of the point."""
    run, k = example(), wave(load)
    row = at(run, load)
    dr.assert_close(run.column("push")[row], 2.0 * k**3 * GAP / (k / 2 - math.tan(k / 2)), relative=5e-4)
    assert run.results.contact.count[row] == 1
    dr.assert_close(run.results.contact.start[row, 0], 0.5, absolute=1e-12)
    dr.assert_close(run.results.contact.end[row, 0], 0.5, absolute=1e-12)


# Line contact ----------------------------------------------------------------------------------------------------------

def line_errors(run):
    """Of both ends and of the push, over all loads, the worst."""
    ends, push = [], []
    for load in LOADS:
        row, k = at(run, load), wave(load)
        contact = run.results.contact
        assert contact.count[row] == 1
        ends += [contact.start[row, 0] - math.pi / k, contact.end[row, 0] - (1.0 - math.pi / k)]
        push.append(run.column("push")[row] / (2.0 * k**3 * GAP / math.pi) - 1.0)
    return np.max(np.abs(ends)), np.max(np.abs(push))


def test_line_contact():
    """h k is 0.17 at the highest load: (h k)^4/720 and less."""
    dr.assert_close(line_errors(perfect(40)), (0.0, 0.0), absolute=2e-6)


@pytest.mark.parametrize("quantity", [0, 1])
def test_line_contact_converges_at_fourth_order(quantity):
    """Below 8 elements a span the mesh is no coarser; finer ones are down to what the closed form errs by, 1e-7."""
    dr.assert_mean_order([line_errors(perfect(n))[quantity] for n in (10, 20)], 4.0, below=0.5, above=1.0)


def test_ends_move_smoothly():
    """At every point beyond the onset: places of both ends, and their bends, to a thousandth of an element."""
    run = perfect(40)
    rows = np.flatnonzero(run.column("load_factor") > 4.05)
    contact, load = run.results.contact, run.column("load_factor")[rows]
    assert len(rows) > 10 and np.all(contact.count[rows] == 1)
    for values, exact in ((contact.start[rows, 0], 1.0 / np.sqrt(load)), (contact.end[rows, 0], 1.0 - 1.0 / np.sqrt(load))):
        dr.assert_close(values, exact, absolute=1e-5)
        dr.assert_close(dr.bends(load, values), dr.bends(load, exact), absolute=1e-5)
    dr.assert_monotone(contact.start[rows, 0], rising=False)


@pytest.mark.parametrize("elements", [5, 10, 20, 40])
def test_a_point_becomes_a_line_on_any_mesh(elements):
    """No point is left on the wall alone when the line is longer than an element and a half."""
    run = perfect(elements)
    load, contact = run.column("load_factor"), run.results.contact
    long = (load > 4.0) & (1.0 - 2.0 / np.sqrt(np.maximum(load, 4.0)) > 0.75 / elements)
    assert np.all(contact.end[long, 0] - contact.start[long, 0] > 0.5 / elements)
    short = (contact.count == 1) & (load < 4.0)
    assert np.all(contact.end[short, 0] == contact.start[short, 0])


# The flat part lets go -------------------------------------------------------------------------------------------------

def letting_go(run):
    return [c for c in run.labelled("BP") if "one-sided" in c.note]


def test_one_sided_bifurcation():
    event, = letting_go(example())
    assert event.located
    dr.assert_close(event.load_factor, 16.0, relative=1e-5)


def test_one_sided_bifurcation_converges_at_fourth_order():
    loads = [letting_go(perfect(n))[0].load_factor for n in (10, 20, 40)]
    dr.assert_order(np.array(loads) - 16.0, 4.0, below=0.5)


def test_pivots_without_contacts_that_carry_no_force():
    """The tangent of the contact set never tells: nothing but the wall holds the flat part, which is held either way."""
    run = perfect(40)
    load, pivots, free = (run.column(name) for name in ("load_factor", "negative_pivots", "free_pivots"))
    assert np.all(pivots[load > 4.05] == 0)
    assert np.all(free[(load > 4.05) & (load < 15.99)] == 0)
    assert np.all(free[(load > 16.01)] == 1)


def test_higher_modes_of_the_flat_part():
    """Clamped, of length l: k l = 2 pi n opens everywhere; tan(k l/2) = k l/2 opens one half and would press the other."""
    run = hinged(40, f"{PERFECT}, 1", stop="LOAD, ABOVE, 37.", branch=False)
    found = [c for c in run.labelled("BP") if c.load_factor > 5.0]
    dr.assert_close([c.load_factor for c in found], [16.0, (2.0 + 2.0 * 4.493409457909064 / math.pi) ** 2, 36.0], relative=1e-4)
    assert ["one-sided" in c.note for c in found] == [True, False, True]


def hump(load):
    """Midspan on the branch: between two points the column is a clamped one at its Euler load."""
    k = wave(load)
    free = k / 2 - math.pi
    return GAP * (1.0 - 2.0 * np.sin(free) / (np.sin(free) - free * np.cos(free)))


def test_branch_along_a_hump():
    """Down from the bifurcation; the deck's imperfection is 1e-4 of the gap."""
    branch = example().results.branches[1]
    load = branch.column("load_factor").values
    assert len(load) > 8 and load[-1] < 9.2
    dr.assert_monotone(load, rising=False)
    dr.assert_close(branch.column("midspan").values, hump(load), absolute=3e-4 * GAP)
    assert np.all(branch.contact.count == 2)
    dr.assert_close(branch.contact.start[:, 0], 0.5 - math.pi / wave(load), absolute=1e-5)
    dr.assert_close(branch.contact.start[:, 1], 0.5 + math.pi / wave(load), absolute=1e-5)
    dr.assert_close(branch.contact.end, branch.contact.start, absolute=1e-12)


def load_between(points, amplitude):
    """P/Pcr at which a column with the stress-free shape 1e-8 sin(pi x) + amplitude sin(3 pi x) touches at two points.

    `points`: their distance from the ends. Closed forms in the free parts (hinged at the end) and in the hump (symmetric), both
    with value and slope at the point; bisection on the jump of the moment there, times what has a zero at the load of a perfect
    column, below which the answer is.
    """
    def jump(p):
        k, n = math.pi * math.sqrt(p), math.pi * np.array([1.0, 3.0])
        c = np.array([1e-8 / (1.0 - p), amplitude / (1.0 - p / 9.0)])
        value, slope = GAP - np.sum(c * np.sin(n * points)), -np.sum(c * n * np.cos(n * points))
        _, d = np.linalg.solve([[points, math.sin(k * points)], [1.0, k * math.cos(k * points)]], [value, slope])
        return d * math.sin(k * points) * math.sin(k * (0.5 - points)) - slope / k * math.cos(k * (0.5 - points))
    low, high = 9.01, 1.0 / (0.5 - points) ** 2
    sign = math.copysign(1.0, jump(low))
    assert sign * jump(high) < 0.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if sign * jump(middle) > 0.0 else (low, middle)
    return low


@dr.release_only
@pytest.mark.parametrize("amplitude", [1e-6, 1e-7])
def test_an_imperfect_column_jumps(amplitude):
    """A wave of the middle away from the wall: two points touch instead of a line, and the load has a maximum below 16."""
    run = hinged(40, f"1e-8, 1\n{amplitude}, 3", stop="midspan, BELOW, -0.00009", branch=False)
    assert [c.label for c in run.results.critical if c.label != "UZ"] == ["C+", "C-", "LP", "EP"]
    exact = max(load_between(s, amplitude) for s in np.linspace(0.24, 0.256, 400))
    dr.assert_close(run.load("LP"), exact, relative=5e-6)
    # Contact points there, and where they are on the way down.
    rows = np.arange(run.only("LP").point - 1, run.results.n_points)
    rows = rows[run.column("load_factor")[rows] > 11.0]
    start = run.results.contact.start[rows, 0]
    dr.assert_close([load_between(s, amplitude) for s in start], run.column("load_factor")[rows], relative=1e-4)


def test_a_point_divides_where_a_support_holds_its_rotation():
    """By symmetry nothing changes; but there the rod has a breakpoint, and each point leaves it on its own side."""
    text = dr.changed(dr.on_given_mesh("column-walls"), ("1, 2, 40", "1, 2, 10"), ("2, 3, 40", "2, 3, 10"), ("TYPE=GE4", "TYPE=GE8"),
                      ("1e-8, 1\n", "1e-8, 1\n1e-7, 3\n"), ("LOAD, ABOVE, 20.", "midspan, BELOW, -0.00009"),
                      ("*BRANCH, NAME=HUMP, SIDE=MINUS\nmidspan, BELOW, -0.00009\n", ""))
    free, held = dr.run_deck(text), dr.run_deck(dr.changed(text, ("1, PINNED", "1, PINNED\n2, 6")))
    assert "do not get on" not in held.stdout and [c.note for c in held.labelled("C-")] == ["a contact region splits"]
    dr.assert_close(held.load("LP"), free.load("LP"), relative=1e-6)


@dr.release_only
def test_what_is_lost_goes_with_the_root_of_the_imperfection():
    """As at every unsymmetric bifurcation (Koiter). What the mesh is worth at contact that is lost with next to no force is not
    asked here."""
    lost = [16.0 - hinged(40, f"1e-8, 1\n{a}, 3", stop="midspan, BELOW, -0.00009\n*ACCURACY, WIDEST=100", branch=False).load("LP") for a in (1e-7, 1e-8)]
    dr.assert_close(lost[0] / lost[1], math.sqrt(10.0), relative=0.05)


# Clamped ends ----------------------------------------------------------------------------------------------------------

@functools.cache
def clamped(elements, points="NODES", most=4.01):
    """P/Pcr with Pcr = 4 pi^2 EI/L^2."""
    text = dr.on_given_mesh("column-walls").replace("POINTS=ALONG", f"POINTS={points}")
    return dr.run_deck(dr.changed(
        text, ("1, 2, 40", f"1, 2, {elements}"), ("2, 3, 40", f"2, 3, {elements}"), ("SHAPE=SINE\n1e-8, 1", "SHAPE=CLAMPED\n1e-7"),
        ("1, PINNED\n3, 2", "1, ENCASTRE\n3, YSYMM"), ("-9.869604401089358", "-39.478417604357434"), ("1.5, 3.5, 9.", "1.5, 3.5"),
        ("LOAD, ABOVE, 20.\n*BRANCH, NAME=HUMP, SIDE=MINUS\nmidspan, BELOW, -0.00009", f"LOAD, ABOVE, {most}")))


# Contact of a column with the imperfection a = gap/1000; a half that sways, clamped and rolling on the wall: tan y = y with
# P (L/2)^2/EI = y^2; a half that lies down, both ends clamped.
SWAY = (4.493409457909064 / math.pi) ** 2
ONSETS = np.array([0.999, SWAY, 4.0])


def onsets(run):
    assert [c.label for c in run.results.critical] == ["C+", "UZ", "BP", "UZ", "BP", "EP"]
    return np.array([run.load("C+"), *(c.load_factor for c in run.labelled("BP"))])


def test_clamped_column():
    dr.assert_close(onsets(clamped(40)), ONSETS, relative=2e-6)


def test_clamped_column_with_a_point_that_may_slide():
    """Where the halves sway the contact point moves along the rod instead: the path stays stable up to 4."""
    run = clamped(40, "ALONG", 3.99)
    assert [c.label for c in run.results.critical] == ["C+", "UZ", "UZ", "EP"]
    dr.assert_close(run.load("C+"), ONSETS[0], relative=2e-6)


@pytest.mark.parametrize("number", [0, 1, 2])
def test_clamped_column_converges_at_fourth_order(number):
    dr.assert_order([onsets(clamped(n))[number] - ONSETS[number] for n in (8, 16, 32, 64)], 4.0, below=1.0)


@pytest.mark.parametrize("share", [1.5, 3.5])
def test_force_of_a_clamped_column_on_the_wall(share):
    """Both halves are clamped at their ends and moved by the gap: with k^2 = P, l = 1/2 each gives k^3 gap/(k l - 2 tan(k l/2)).
    The imperfection, a thousandth of the gap, is left out."""
    run = clamped(40)
    k = 2.0 * math.pi * math.sqrt(share)
    row = at(run, share)
    dr.assert_close(run.column("push")[row], 2.0 * k**3 * GAP / (k / 2 - 2.0 * math.tan(k / 4)), relative=2e-3)
    dr.assert_close(run.column("midspan")[row], GAP - 1e-7, relative=1e-9)


# A line lifted at a breakpoint ------------------------------------------------------------------------------------------------

LIFTED = """*HEADING
A heavy rod on a bed, lifted by a force
*NODE
1, 0., 0.
2, 2., 0.
3, 4., 0.
*LINE, ELSET=P, NSET=P, TYPE=GE8
1, 2, 6
2, 3, 6
*BEAM SECTION, ELSET=P, SECTION=STIFFNESS
1e4, 1., , 1.
*BOUNDARY
{supports}
*OBSTACLE, NAME=BED, TYPE=LINE
0., 0., 1., 0.
*CONTACT, OBSTACLE=BED, NSET=P
*MONITOR, NAME=up
{node}, U2
*STEP, NAME=WEIGHT
*STATIC, METHOD=LOAD
1.
*DLOAD
P, GRAV, 0.01, 0., -1.
*END STEP
*STEP, NAME=LIFT
*STATIC, METHOD=LOAD
0.1
*CLOAD
{node}, 2, {force!r}
*END STEP
"""


@pytest.mark.parametrize("where, node, supports, force, length, factor", [
    ("mirror", 1, "1, XSYMM\n3, ENCASTRE", 2e-4, 1.5, 1.0), ("tip", 1, "3, ENCASTRE", 2e-4, 2.0, 2.0),
    ("inside", 2, "1, ENCASTRE\n3, ENCASTRE", 4e-4, 1.5, 1.0)])
def test_a_line_lifted_at_a_breakpoint(where, node, supports, force, length, factor):
    """Small deflections: w = T x^3/6 - r x^4/24 from the end of the line, l = 3 F/(2 r), T = F/2 beside a mirror, l = 2 F/r, T = F at
    a free end. Rotations are below 1e-6, their squares are nothing."""
    run = dr.run_deck(LIFTED.format(supports=supports, node=node, force=force))
    assert "do not get on" not in run.stdout
    half, weight = (0.5 * force if where == "inside" else force), 0.01
    long = length * half / weight
    dr.assert_close(run.column("up")[-1], 0.5 * factor * half * long**3 / 6.0 - weight * long**4 / 24.0, relative=1e-6)
    at = 2.0 if where == "inside" else 0.0
    regions = run.results.contact.regions(run.results.n_points)
    if where == "inside":
        dr.assert_close(regions[0].end, at - long, absolute=1e-6)
    dr.assert_close(regions[-1].start, at + long, absolute=1e-6)


ROUGH = """*HEADING
Clamped column with a random imperfection beside a wall
*NODE
1, 0., 0.
2, 0.5, 0.
3, 1., 0.
*LINE, ELSET=COLUMN, NSET=COLUMN, TYPE=GE8
1, 2, 5
2, 3, 5
*IMPERFECTION, ELSET=COLUMN, SHAPE=RANDOM, SEED=8
0.001
*BEAM SECTION, ELSET=COLUMN, SECTION=STIFFNESS
480000., 1.
*BOUNDARY
1, ENCASTRE
3, YSYMM
*OBSTACLE, NAME=BELOW, TYPE=LINE
0., -0.02, 1., -0.02
*CONTACT, OBSTACLE=BELOW, NSET=COLUMN
*MONITOR, NAME=shortening
3, U1, -1.
*STEP
*STATIC, METHOD=CYLINDRICAL
0.1, 1E-9, 0.003
*CLOAD
3, 1, -39.478417604357434
*STOP
LOAD, ABOVE, 3.
*END STEP
"""


def test_after_a_touch_the_path_goes_on():
    """Held by the wall the column carries more: from the touch on the load rises, and never does the path lead back."""
    run = dr.run_deck(ROUGH)
    assert "do not get on" not in run.stdout
    assert [c.label for c in run.results.critical] == ["C+", "C+", "EP"]
    touch = run.results.critical[0].point - 1
    dr.assert_monotone(run.column("load_factor")[touch:], rising=True)
    dr.assert_monotone(run.column("shortening"), rising=True)

"""Branches at bifurcations: Euler's column and hinged arches, against exact solutions.

reference/bench_c_*.csv: elliptic integrals, inextensible; EA L^2/EI = 1E9 moves loads by 2.5e-9. reference/arch_*_branch.csv:
boundary value problems of the exact rod with the EA of the decks, 12 digits.
"""
import functools

import numpy as np
import pytest

import deck_runner as dr

PCR_OVER_EA = 2.4674011002723395e-9


@functools.cache
def euler(stop="rotation, ABOVE, 3.0543\nrotation, BELOW, -3.0543\n", element="TYPE=GE8"):
    """The column with the table's tip angles located on both branches."""
    table = dr.reference("bench_c_euler_postbuckling")
    angles = np.radians(table["alpha_deg"])
    asked = "".join(f"rotation, {angle:.15g}, {-angle:.15g}\n" for angle in angles[:-1])
    text = dr.changed(dr.on_given_mesh("euler"), ("TYPE=GE6", element), ("1, 2, 20", "1, 2, 32"),
                      ("*STOP\n", f"*LOCATE\n{asked}*STOP\n"))
    return dr.run_deck(dr.changed(text, ("rotation, ABOVE, 3.0543\nrotation, BELOW, -3.0543\n", stop)))


@functools.cache
def plain(name):
    return dr.run_deck(dr.on_given_mesh(name))


def sides(run):
    """The two branches, the one along the null vector first."""
    found = list(run.results.branches.values())
    assert [branch.side for branch in found] == [1, -1]
    assert found[0].name == found[1].name
    return found


def labelled(path, label):
    return [c for c in path.critical if c.label == label]


def points_on(path, names, table, columns, sign, every=1, limit=1e-6):
    """Nearest located points of a branch to the table's rows; `sign` +-1 for each column."""
    found = labelled(path, "UZ")
    values = np.array([[c.load_factor] + [c.monitors[name] for name in names] for c in found]) * sign
    exact = np.transpose([table[column] for column in columns])
    size = np.ptp(exact, axis=0)
    rows = range(every, len(exact) - 1, every)
    for row in rows:
        miss = np.abs(values - exact[row]) / size
        nearest = miss[np.argmin(np.max(miss, axis=1))]
        assert np.max(nearest) <= limit, f"row {row}, {exact[row]}: missed by {nearest} of {size}"


# ---- Euler's column ----

@pytest.mark.parametrize("side", [1, -1])
def test_euler_follows_the_elliptic_integrals(side):
    """Angles are located to 1e-8; with 32 GE8 elements no more is lost, but where the load is steep, above 160 degrees."""
    table, run = dr.reference("bench_c_euler_postbuckling"), euler()
    branch = sides(run)[0 if side == 1 else 1]
    found = labelled(branch, "UZ")
    assert len(found) == len(table["alpha_deg"]) - 1
    dr.assert_close([side * c.monitors["rotation"] for c in found], np.radians(table["alpha_deg"][:-1]), relative=1e-7)
    dr.assert_close([c.load_factor for c in found], table["P_over_Pcr"][:-1], relative=5e-7)
    dr.assert_close([c.monitors["x"] for c in found], table["x"][:-1], absolute=5e-7)
    dr.assert_close([side * c.monitors["y"] for c in found], table["y"][:-1], absolute=5e-7)


def test_euler_leaves_at_the_first_bifurcation():
    """The first point of a branch is beyond the critical load by at most the parabola's rise, 1 + rotation^2/8."""
    run = euler()
    first = [c for c in run.results.critical if c.label == "BP"][0]
    dr.assert_close(first.load_factor, 1.0 + PCR_OVER_EA, relative=2e-8)
    for branch in sides(run):
        assert (branch.of, branch.bifurcation, branch.mode, branch.point) == (0, 1, 1, first.point)
        rotation, load = branch.column("rotation").values, branch.column("load_factor").values
        # the series of elliptic integrals: P/Pcr = 1 + a^2/8 + 7 a^4/1536 ...
        small = np.abs(rotation) < 0.3
        assert np.count_nonzero(small) >= 2
        dr.assert_close(load[small], 1.0 + PCR_OVER_EA + rotation[small]**2 / 8.0,
                        absolute=2e-8 + 2.0 * 7.0 / 1536.0 * 0.3**4)
        dr.assert_monotone(branch.side * rotation, rising=True)
        assert np.all(branch.column("negative_pivots").values[2:] == 0)


def test_euler_sides_are_mirror_images():
    plus, minus = sides(euler())
    assert plus.column("y").values[-1] * minus.column("y").values[-1] < 0.0
    for a, b in zip(labelled(plus, "UZ"), labelled(minus, "UZ"), strict=True):
        dr.assert_close(a.load_factor, b.load_factor, relative=1e-7)
        dr.assert_close(a.monitors["y"], -b.monitors["y"], absolute=1e-7)


def test_euler_null_vector_is_the_sine():
    """v = 1 - cos(pi x/2), largest 1 at the tip; rotation pi/2 sin(pi x/2)."""
    run = euler()
    first = [c for c in run.results.critical if c.label == "BP"][0]
    null = run.results.null_vectors(first)
    x = run.results.mesh.coordinates[:, 0]
    assert null.shape == (1, len(x), 3)
    dr.assert_close(null[0, :, 1], 1.0 - np.cos(0.5 * np.pi * x), absolute=1e-6)
    dr.assert_close(null[0, :, 0], 0.0 * x, absolute=1e-6)
    dr.assert_close(null[0, :, 2], 0.5 * np.pi * np.sin(0.5 * np.pi * x), absolute=1e-6)


def test_euler_second_bifurcation():
    """Clamped-free: the second branch starts at 9 Pcr and bends up; similar to the first with a third of the length.

    Folded into thirds the second mode is the first: P/Pcr is 9 times that of the first branch at the same tip angle.
    """
    table = dr.reference("bench_c_euler_postbuckling")
    angles = np.radians(table["alpha_deg"][:4])
    asked = "".join(f"rotation, {angle:.15g}\n" for angle in angles)
    text = dr.changed(dr.on_given_mesh("euler"), ("TYPE=GE6", "TYPE=GE8"), ("1, 2, 20", "1, 2, 30"),
                      ("*BRANCH, NAME=BUCKLED, SIDE=BOTH", "*BRANCH, NAME=BUCKLED, BIFURCATION=2, SIDE=BOTH"),
                      ("*STOP\n", f"*LOCATE\n{asked}*STOP\n"),
                      ("rotation, ABOVE, 3.0543\nrotation, BELOW, -3.0543\n", "rotation, ABOVE, 1.1\nrotation, BELOW, -1.1\n"))
    run = dr.run_deck(text)
    branch, = [b for b in sides(run) if b.column("rotation").values[-1] > 0.0]
    found = labelled(branch, "UZ")
    dr.assert_close([c.load_factor for c in found], 9.0 * table["P_over_Pcr"][:4], relative=1e-6)
    # two thirds of the rod are hinged-hinged arcs about the line of thrust, the last third is the small column
    dr.assert_close([c.monitors["x"] for c in found], table["x"][:4], absolute=1e-6)


# ---- hinged arches ----

def with_points(name, table, column, quantity, every, stop=None):
    rows = range(every, len(table[column]) - 1, every)
    both = sorted({sign * float(f"{table[column][row]:.15g}") for row in rows for sign in (1, -1)}) \
        if quantity in ("u", "rotation") else [table[column][row] for row in rows]
    asked = "".join(f"{quantity}, {value:.15g}\n" for value in both)
    text = dr.changed(dr.on_given_mesh(name), ("*STOP\n", f"*LOCATE\n{asked}*STOP\n"),
                      ("*CLOAD\n", "*CONTROLS, LOCATE=1E-11\n*CLOAD\n"))
    return dr.run_deck(text if stop is None else dr.changed(text, stop))


def test_shallow_arch_branch_follows_the_table():
    """Both sides; v grows all along."""
    table = dr.reference("arch_shallow_hinged_branch")
    run = with_points("arch-shallow-hinged", table, "v", "v", 4)
    for branch in sides(run):
        lean = np.sign(branch.column("rotation").values[-1])
        dr.assert_monotone(branch.column("v").values, rising=True)
        points_on(branch, ("v", "u", "rotation"), table, ("P", "v", "u", "rotation"), (1.0, 1.0, lean, lean), every=4)
        dr.assert_close(branch.column("load_factor").values[-1], -6.2, relative=1e-8)
        assert not labelled(branch, "LP")
    plus, minus = sides(run)
    assert plus.column("rotation").values[-1] * minus.column("rotation").values[-1] < 0.0


@pytest.mark.parametrize("ea, ei", [(None, None), (3385.4193, 1.1132538), (4100.0, 0.9), (3000.0, 1.0)])
@pytest.mark.parametrize("side", ["PLUS", "MINUS"])
def test_shallow_arch_branch_joins_the_bifurcations(ea, ei, side):
    """It ends at the second bifurcation, where its load is least; beyond, it would be its own mirror image."""
    text = dr.changed(dr.on_given_mesh("arch-shallow-hinged"), ("LOAD, BELOW, -6.2", "LOAD, ABOVE, -4."), ("SIDE=BOTH", f"SIDE={side}"))
    if ea is not None:
        text = dr.changed(text, ("3600., 1.", f"{ea}, {ei}"))
    run = dr.run_deck(text)
    branch, = run.results.branches.values()
    home, = labelled(branch, "BP")
    assert not labelled(branch, "LP")
    end, = labelled(branch, "EP")
    assert end.point == home.point == len(branch.column("v").values) and "at a bifurcation" in end.note
    # the other end is the second bifurcation of the step's path, to all its digits
    other = [c for c in run.results.critical if c.label == "BP"][1]
    assert home.load_factor == other.load_factor and home.error == other.error
    for name in ("v", "u", "rotation"):
        dr.assert_close(home.monitors[name], other.monitors[name], absolute=1e-12)
    # it comes there with increments as long as before
    lengths = np.diff(branch.column("arc_length").values)
    assert len(lengths) < 40 and np.min(lengths[2:-1]) > 0.1 * np.max(lengths)
    if ea is None:
        dr.assert_close(home.load_factor, -6.2196423013, relative=1e-9)
        dr.assert_close(home.monitors["v"], 0.1815730429, absolute=1e-9)


def test_shallow_arch_from_the_other_end():
    """The branch from the second bifurcation is the same: at the same v the same load."""
    table = dr.reference("arch_shallow_hinged_branch")
    run = with_points("arch-shallow-hinged", table, "v", "v", 6,
                      ("*BRANCH, NAME=SWAY, SIDE=BOTH, INCREMENT=0.002\nLOAD, BELOW, -6.2",
                       "*BRANCH, NAME=SWAY, SIDE=BOTH, BIFURCATION=2, INCREMENT=0.002\nLOAD, ABOVE, 14.3"))
    for branch in sides(run):
        lean = np.sign(branch.column("rotation").values[-1])
        points_on(branch, ("v", "u", "rotation"), table, ("P", "v", "u", "rotation"), (1.0, 1.0, lean, lean), every=6)


def test_deep_arch_branch_follows_the_table():
    """u and v go up and down again, the rotation only down past its first maximum: points are asked for by rotation."""
    table = dr.reference("arch_deep_hinged_branch")
    run = with_points("arch-deep-hinged", table, "rotation", "rotation", 4)
    branch, = run.results.branches.values()
    lean = np.sign(branch.column("u").values[len(branch.column("u").values) // 2])
    found = labelled(branch, "UZ")
    last = max(np.abs([c.monitors["rotation"] for c in found]))
    keep = np.abs(table["rotation"]) <= last + 1e-9
    points_on(branch, ("v", "u", "rotation"), {name: column[keep] for name, column in table.items()},
              ("P", "v", "u", "rotation"), (1.0, 1.0, lean, lean), every=4)
    dr.assert_close(branch.column("v").values[-1], 2.02, relative=1e-8)
    assert np.count_nonzero(keep) > 60


def test_deep_arch_limit_points_of_the_branch():
    branch, = plain("arch-deep-hinged").results.branches.values()
    limits = labelled(branch, "LP")
    dr.assert_close([c.load_factor for c in limits], [4.1108029233, -0.4506268364], relative=2e-7)
    dr.assert_close(np.abs([c.monitors["u"] for c in limits]), [0.8439776, 0.7825205], absolute=1e-5)


@pytest.mark.parametrize("name", ["euler", "arch-deep-hinged", "arch-shallow-hinged"])
def test_branches_do_not_change_the_path(name):
    """The step's own path is the same number for number with and without branches."""
    text = dr.on_given_mesh(name)
    start = text.index("*BRANCH")
    without = text[:start] + text[text.index("*STOP", start):]
    assert "*BRANCH" not in without
    one, two = plain(name), dr.run_deck(without)
    for column in ("load_factor", *one.results.monitors):
        assert np.array_equal(one.column(column), two.column(column))
    assert not two.results.branches


@pytest.mark.parametrize("method", ["SPHERICAL", "LINEARISED", "MINIMUM RESIDUAL"])
def test_strategies_follow_the_same_branch(method):
    deck = dr.with_static(dr.on_given_mesh("arch-shallow-hinged"), f"METHOD={method}", "0.5, 1E-9, 0.005")
    runs = [dr.run_deck(dr.changed(text, ("*STOP\n", "*LOCATE\nLOAD, 8., -2.\n*STOP\n")))
            for text in (deck, dr.on_given_mesh("arch-shallow-hinged"))]
    for one, two in zip(sides(runs[0]), sides(runs[1])):
        assert [c.label for c in one.critical] == [c.label for c in two.critical]
        dr.assert_close([c.load_factor for c in one.critical], [c.load_factor for c in two.critical], relative=1e-7)
        dr.assert_close([c.monitors["rotation"] for c in one.critical if c.label != "BP"],
                        [c.monitors["rotation"] for c in two.critical if c.label != "BP"], absolute=1e-6)


# A branch that ends on another path -----------------------------------------------------------------------------------

SHALLOW_ARCH = """*HEADING, JOB=deck
Half of a shallow cosine arch, clamped, apex 3 times as high as the rod is thick
*NODE
1, 0, 0
2, 0.5, 0
*LINE, ELSET=BEAM
1, 2{elements}
*IMPERFECTION, ELSET=BEAM, SHAPE=COSINE
0.005, 0
-0.005, 1
*BEAM SECTION, ELSET=BEAM, SECTION=STIFFNESS
${{12/(0.01/3)**2}}, 1
*BOUNDARY
1, ENCASTRE
2, XSYMM
*MONITOR, NAME=d
2, U2, -100
*STEP
*STATIC
1, , 0.0005
*CLOAD
2, 2, -0.005
*STOP
d, ABOVE, {end}
{branch}*END STEP
"""


@pytest.mark.parametrize("elements", ["", ", 8", ", 12", ", 24"])
def test_a_branch_ends_where_it_meets_the_path_it_left(elements):
    """The load of the branch has an extremum there, an eigenvalue of the path changes its sign."""
    path = dr.run_deck(SHALLOW_ARCH.format(elements=elements, end=2.05, branch=""))
    first, last = path.labelled("BP")
    run = dr.run_deck(SHALLOW_ARCH.format(elements=elements, end=0.6, branch="*BRANCH\nd, ABOVE, 2.05\n"))
    for branch in run.results.branches.values():
        found = branch.critical
        assert [c.label for c in found] == ["BP", "EP"] and "meets" in found[0].note
        bar = branch.errors["load_factor"].values[found[0].point - 1] + path.results.errors["load_factor"].values[last.point - 1]
        dr.assert_close(found[0].load_factor, last.load_factor, absolute=bar)
        if elements:
            dr.assert_close(found[0].load_factor, last.load_factor, relative=1e-7)
            dr.assert_close(found[0].monitors["d"], last.monitors["d"], relative=1e-7)
    assert sorted(branch.side for branch in run.results.branches.values()) == [-1, 1]


@dr.once_in_release
def test_several_ways_on_without_error_bars_end_no_run():
    """A branch of an arch under pressure comes to a floor at a load of nearly zero, where nothing has a bar and several contacts change at
    once. The run may end early there, but not by a memory fault."""
    run = dr.run_deck("""*HEADING
arch on a floor
*NODE
1, -0.70710678118655, 0.70710678118655
2, 0, 1
3, 0.70710678118655, 0.70710678118655
*ARC, ELSET=B, NSET=B, DIRECTION=CLOCKWISE
1, 2, 0, 0
2, 3, 0, 0
*BEAM SECTION, ELSET=B, SECTION=STIFFNESS
30000, 1
*BOUNDARY
1, PINNED
3, PINNED
*OBSTACLE, NAME=FLOOR, TYPE=LINE
-2, 0.61923881554251, 2, 0.61923881554251
*CONTACT, OBSTACLE=FLOOR, NSET=B
*MONITOR, NAME=v
2, U2, -1
*MONITOR, NAME=h
2, U1
*STEP
*ACCURACY, TOLERANCE=1E-6
*STATIC
0.5, , 0.03
*CONTROLS, POINTS=400
*DLOAD
B, P, -1
*STOP
v, ABOVE, 0.52720779386421
LOAD, ABOVE, 2000
LOAD, BELOW, -500
*BRANCH, NAME=A, SIDE=BOTH
*END STEP
""", code=None)
    assert run.code in (0, 2), run.stderr
    assert run.results.critical

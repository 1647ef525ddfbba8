"""Bifurcations of the path: simple and multiple ones, their null vectors, several events in one increment.

Euler's columns: EA L^2/EI = 1E9 moves loads by P/EA, the meshes by less. A bifurcation is located to LOCATE = 1e-8 of what its
eigenvalue changes in the increment.
"""
import functools

import numpy as np
import pytest

import deck_runner as dr

PI2 = np.pi**2
LOCATE = 1e-8


def deck(model, step):
    return f"*HEADING\nbifurcations\n{model}*STEP\n{step}*FIELD OUTPUT\nDISPLACEMENT\n*END STEP\n"


def rod(number, start, end, elements=24, kind="GE8", ends=""):
    """A rod from node 1000 number + 1 to 1000 number + 2 of element set ROD<number>, with its supports."""
    a, b = 1000 * number + 1, 1000 * number + 2
    return (f"*NODE\n{a}, {start}\n{b}, {end}\n*LINE, ELSET=ROD{number}, NSET=ROD{number}, TYPE={kind}\n{a}, {b}, {elements}\n"
            f"*BEAM SECTION, ELSET=ROD{number}, SECTION=STIFFNESS\n1E9, 1.\n*BOUNDARY\n{ends.format(a=a, b=b)}\n")


def without_branches(name):
    text = dr.on_given_mesh(name)
    start = text.index("*BRANCH")
    return text[:start] + text[text.index("*STOP", start):]


def bifurcations(run):
    found = run.labelled("BP")
    assert all(c.located for c in found)
    for c in found:
        null = run.results.null_vectors(c)
        assert null.shape == (c.multiplicity, len(run.results.mesh.coordinates), 3)
        # largest translation 1; the first node that moves by half of that moves in the positive sense of its larger component
        size = np.hypot(null[:, :, 0], null[:, :, 1])
        dr.assert_close(np.max(size, axis=1), np.ones(c.multiplicity), absolute=1e-12)
        for vector, moves in zip(null, size):
            first = vector[np.argmax(moves >= 0.5), :2]
            assert first[np.argmax(np.abs(first))] > 0.0
    return found


def told_twice(path, near=1e-6):
    """Pairs of critical points of one label at one place."""
    points = path.critical
    length = path.column("arc_length").values
    return [(a, b) for k, a in enumerate(points) for b in points[k + 1:]
            if a.label == b.label and abs(length[a.point - 1] - length[b.point - 1]) < near
            and abs(a.load_factor - b.load_factor) <= near * abs(a.load_factor)]


# ---- null vectors ----

@pytest.mark.parametrize("ends, loads, shapes", [
    ("{a}, PINNED\n{b}, 2", [1, 4, 9], [lambda x, k=k: np.sin(k * np.pi * x) for k in (1, 2, 3)]),
    ("{a}, ENCASTRE\n{b}, YSYMM", [4, 4 * 4.493409457909064**2 / PI2, 16], None),
    ("{a}, ENCASTRE", [1 / 4, 9 / 4, 25 / 4], [lambda x, k=k: 1 - np.cos((k - 0.5) * np.pi * x) for k in (1, 2, 3)])])
def test_null_vectors_of_columns(ends, loads, shapes):
    """Euler's modes; in between the count of negative pivots is that of the bifurcations behind."""
    run = dr.run_deck(deck(rod(1, "0., 0.", "1., 0.", ends=ends), f"*STATIC\n0.1, 1E-12, 0.05\n*CLOAD\n1002, 1, {-PI2!r}\n"
                                                                   f"*STOP\nLOAD, ABOVE, {loads[-1] * 1.1!r}\n"))
    found = bifurcations(run)
    assert [c.multiplicity for c in found] == [1, 1, 1]
    dr.assert_close([c.load_factor for c in found], loads, relative=2e-6)
    x = run.results.mesh.coordinates[:, 0]
    for k, c in enumerate(found):
        null = run.results.null_vectors(c)[0]
        dr.assert_close(null[:, 0], 0.0 * x, absolute=1e-6)
        if shapes:
            shape = shapes[k](x)
            dr.assert_close(null[:, 1], shape / np.max(np.abs(shape)), absolute=1e-5)
    pivots = run.column("negative_pivots")
    assert (pivots[0], pivots[-1]) == (0, 3) and np.all(np.diff(pivots) >= 0)


def test_clamped_column_null_vectors():
    """Symmetric 1 - cos(2 pi x), antisymmetric, symmetric 1 - cos(4 pi x)."""
    run = dr.run_deck(deck(rod(1, "0., 0.", "1., 0.", 32, ends="{a}, ENCASTRE\n{b}, YSYMM"),
                           f"*STATIC, METHOD=LOAD\n1.\n*CLOAD\n1002, 1, {-PI2!r}\n*STOP\nLOAD, ABOVE, 17.\n"))
    null = [run.results.null_vectors(c)[0][:, 1] for c in bifurcations(run)]
    x = run.results.mesh.coordinates[:, 0]
    order = np.argsort(x)
    dr.assert_close(null[0], 0.5 - 0.5 * np.cos(2 * np.pi * x), absolute=1e-5)
    dr.assert_close(null[1][order], -null[1][order][::-1], absolute=1e-5)
    dr.assert_close(null[2], 0.5 - 0.5 * np.cos(4 * np.pi * x), absolute=1e-5)


# ---- multiple bifurcations ----

def two_columns(ratio, method="*STATIC\n0.05, 1E-12, 0.01\n", end=1.1):
    """Clamped columns side by side that know nothing of each other; the load on the second is `ratio` times that on the first."""
    model = rod(1, "0., 0.", "0., 1.", ends="{a}, ENCASTRE") + rod(2, "1., 0.", "1., 1.", ends="{a}, ENCASTRE")
    loads = f"*CLOAD\n1002, 2, {-PI2 / 4!r}\n2002, 2, {-PI2 / 4 * ratio!r}\n"
    return dr.run_deck(deck(model, f"{method}{loads}*STOP\nLOAD, ABOVE, {end!r}\n"))


def parts(run, critical):
    """How much of each null vector is in the first and in the second column."""
    null, x = run.results.null_vectors(critical), np.round(run.results.mesh.coordinates[:, 0])
    return np.array([[np.max(np.abs(vector[x == place, 0])) for place in (0.0, 1.0)] for vector in null])


@pytest.mark.parametrize("method", ["*STATIC\n0.05, 1E-12, 0.01\n", "*STATIC, METHOD=LOAD\n0.3\n",
                                    "*STATIC, METHOD=SPHERICAL\n2.\n"])
def test_equal_columns_buckle_at_once(method):
    """One bifurcation, double; its two null vectors span those of both columns: 1 - cos(pi y/2)."""
    run = two_columns(1.0, method)
    only, = bifurcations(run)
    assert (only.multiplicity, only.note) == (2, "bifurcation, double")
    dr.assert_close(only.load_factor, 1.0 + 2.5e-9, relative=1e-7)
    null, mesh = run.results.null_vectors(only), run.results.mesh
    shape = 1.0 - np.cos(0.5 * np.pi * mesh.coordinates[:, 1])
    basis = np.array([shape * (np.round(mesh.coordinates[:, 0]) == place) for place in (0.0, 1.0)]).T
    shares = [np.linalg.lstsq(basis, vector[:, 0], rcond=None)[0] for vector in null]
    for vector, share in zip(null, shares):
        dr.assert_close(vector[:, 0], basis @ share, absolute=1e-6)
    assert abs(np.linalg.det(shares)) > 0.1
    assert list(run.column("negative_pivots")[[0, -1]]) == [0, 2]


@pytest.mark.parametrize("apart", [1e-1, 1e-3])
def test_nearly_equal_columns_buckle_one_by_one(apart):
    """Each bifurcation simple, its null vector in one column, within one increment or not."""
    run = two_columns(1.0 / (1.0 + apart), "*STATIC, METHOD=LOAD\n0.4\n", 1.3)
    first, second = bifurcations(run)
    assert (first.multiplicity, second.multiplicity) == (1, 1)
    dr.assert_close([first.load_factor, second.load_factor], [1.0, 1.0 + apart], relative=2e-7)
    dr.assert_close(parts(run, first), [[1.0, 0.0]], absolute=1e-3)
    dr.assert_close(parts(run, second), [[0.0, 1.0]], absolute=1e-3)


def test_three_equal_columns():
    model = "".join(rod(k, f"{k}., 0.", f"{k}., 1.", 8, ends="{a}, ENCASTRE") for k in (1, 2, 3))
    run = dr.run_deck(deck(model, "*STATIC, METHOD=LOAD\n0.3\n*CLOAD\n" + "".join(f"{k}002, 2, {-PI2 / 4!r}\n" for k in (1, 2, 3))
                           + "*STOP\nLOAD, ABOVE, 1.2\n"))
    only, = bifurcations(run)
    assert (only.multiplicity, only.note) == (3, "bifurcation, 3-fold")
    assert not told_twice(run.results)


RING = """*NODE
1, 1., 0.
2, -1., 0.
*ARC, ELSET=RING, TYPE=GE8
1, 2, 0., 0., 12
2, 1, 0., 0., 12
*BEAM SECTION, ELSET=RING, SECTION=STIFFNESS
1E7, 1.
*BOUNDARY
"""


@functools.cache
def ring(ends, step="*STATIC, METHOD=LOAD\n0.7\n", more="", end=16.0):
    return dr.run_deck(deck(RING + ends + "\n", f"{step}*DLOAD\nRING, P, 1.\n*STOP\nLOAD, ABOVE, {end!r}\n{more}"))


@pytest.mark.parametrize("ends", ["1, PINNED\n2, 2", "1, XSYMM\n2, 2", "1, ENCASTRE"])
@pytest.mark.parametrize("step", ["*STATIC, METHOD=LOAD\n0.7\n", "*STATIC, METHOD=SPHERICAL\n0.5, 1E-12, 1.\n"])
def test_ring_under_pressure(ends, step):
    """p R^3/EI = n^2 - 1, each double: ovals in two directions, wherever the supports are. EA makes it softer by 1e-6."""
    run = ring(ends, step)
    found = bifurcations(run)
    assert [c.multiplicity for c in found] == [2, 2, 2]
    dr.assert_close([c.load_factor for c in found], [3.0, 8.0, 15.0], relative=1e-5)
    assert not told_twice(run.results)
    angle = np.arctan2(*run.results.mesh.coordinates[:, ::-1].T)
    for n, c in zip((2, 3, 4), found):
        waves = np.array([np.cos(n * angle), np.sin(n * angle), np.cos(angle), np.sin(angle), 1.0 + 0.0 * angle]).T
        shares = []
        for vector in run.results.null_vectors(c):
            outwards = vector[:, 0] * np.cos(angle) + vector[:, 1] * np.sin(angle)
            share = np.linalg.lstsq(waves, outwards, rcond=None)[0]
            # n waves and a motion of the plane that the supports ask for
            dr.assert_close(outwards, waves @ share, absolute=1e-5)
            shares.append(share[:2])
        assert abs(np.linalg.det(shares)) > 1e-2


def ring_in_a_wider_host(stiffness, side, count, accuracy, step, end):
    """Half a ring that touches its host at the bottom, under pressure."""
    return dr.run_deck(f"""*HEADING
ring in a wider host
*NODE
1, 0., 1.
2, {side}., 0.
3, 0., -1.
*ARC, ELSET=RING, NSET=RING, TYPE=GE8, DIRECTION={"CLOCKWISE" if side > 0 else "ANTICLOCKWISE"}
1, 2, 0., 0.{count}
2, 3, 0., 0.{count}
*BEAM SECTION, ELSET=RING, SECTION=STIFFNESS
{stiffness}, 1.
*BOUNDARY
1, XSYMM
3, XSYMM
*OBSTACLE, NAME=HOST, TYPE=CIRCLE, SIDE=INSIDE
0., 0.02, 1.02
*CONTACT, OBSTACLE=HOST, NSET=RING
*STEP
{accuracy}{step}*DLOAD
RING, P, {-side}.
*STOP
LOAD, ABOVE, {end}
*END STEP
""")


def pressure_of_waves(n, stiffness):
    """A motion rho = cos(n s) of the radius 1/(1 + p/EA) turns the tangent by (n^2 - 1 - p/EA) rho per length, and
    p rho/(1 + p/EA)^2 bends."""
    p = n * n - 1.0
    for _ in range(20):
        p = (n * n - 1.0 - p / stiffness) * (1.0 + p / stiffness)**2
    return p


@pytest.mark.parametrize("stiffness", ["14000.", "14700.000000000002", "15000.", "30000."])
@pytest.mark.parametrize("side", [1, -1])
def test_ring_that_stands_on_a_point_without_a_force(stiffness, side):
    """Pressure all round leaves nothing for the obstacle: the sign of its force is rounding, and the ring stays where it stands."""
    run = ring_in_a_wider_host(stiffness, side, ", 6", "", "*STATIC, METHOD=CYLINDRICAL\n0.1, 1E-9, 0.05\n", 16.0)
    # elements of order 8, three to a half wave of n = 4
    dr.assert_close([c.load_factor for c in bifurcations(run)], [pressure_of_waves(n, float(stiffness)) for n in (2, 3, 4)],
                    relative=1e-6)
    assert [c.label for c in run.results.critical] == ["BP", "BP", "BP", "EP"]


@pytest.mark.parametrize("asked", ["1E-3", "1E-4", "1E-6"])
@pytest.mark.parametrize("step", ["*STATIC, METHOD=SPHERICAL\n0.1, 1E-9, 0.05\n", "*STATIC, METHOD=LOAD\n0.1, 1E-9, 0.3\n"])
def test_compressed_ring_whose_bending_is_what_iterations_leave(asked, step):
    """A ring that only gets shorter has no rotations but those of the iteration, which say nothing about the path."""
    run = ring_in_a_wider_host("76800.", 1, "", f"*ACCURACY, TOLERANCE={asked}\n", step, 5.0)
    dr.assert_close(run.load("BP"), pressure_of_waves(2, 76800.0), relative=float(asked))
    assert [c.label for c in run.results.critical] == ["BP", "EP"]


def test_branches_of_equal_columns():
    """Along either null vector and to either side: a column that leans does so as Euler's elastica, or it stands."""
    table = dr.reference("bench_c_euler_postbuckling")
    model = "".join(rod(k, f"{k}., 0.", f"{k}., 1.", ends="{a}, ENCASTRE") + f"*MONITOR, NAME=TIP{k}\n{k}002, UR\n" for k in (1, 2))
    more = "".join(f"*BRANCH, NAME=MODE{mode}, MODE={mode}\nLOAD, ABOVE, {table['P_over_Pcr'][1]!r}\n" for mode in (1, 2))
    run = dr.run_deck(deck(model, f"*STATIC\n0.4, 1E-12, 0.05\n*CLOAD\n1002, 2, {-PI2 / 4!r}\n2002, 2, {-PI2 / 4!r}\n"
                           f"*STOP\nLOAD, ABOVE, 1.1\n{more}"))
    branches = list(run.results.branches.values())
    assert [(b.name, b.mode, b.side) for b in branches] == [(f"MODE{mode}", mode, side) for mode in (1, 2) for side in (1, -1)]
    angle = np.radians(table["alpha_deg"][1])
    leaning = [[branch.column(f"TIP{k}").values[-1] / angle for k in (1, 2)] for branch in branches]
    for tips in np.abs(leaning):
        assert np.max(tips) > 0.9
        dr.assert_close(tips, np.round(tips), absolute=1e-5)
    # the two sides of a mode lean to opposite sides, the two modes differ
    dr.assert_close(leaning[::2], -np.array(leaning[1::2]), absolute=2e-5)
    assert np.max(np.abs(np.array(leaning[0]) - leaning[2])) > 0.5 and np.max(np.abs(np.array(leaning[0]) + leaning[2])) > 0.5


# ---- several events in one increment ----

@pytest.mark.parametrize("method, data", [
    ("METHOD=LOAD", "20."), ("METHOD=LOAD", "60."),
    ("METHOD=CYLINDRICAL", "20., 1E-12, 10."), ("METHOD=SPHERICAL", "20., 1E-12, 10."),
    ("METHOD=LINEARISED", "20., 1E-12, 10."), ("METHOD=MINIMUM RESIDUAL", "20., 1E-12, 10."),
    ("METHOD=VARIABLE LOAD", "20., 1E-12, 10."), ("METHOD=GENERALISED DISPLACEMENT", "20., 1E-12, 10.")])
def test_euler_in_one_stride(method, data):
    """1, 9 and 25 times the critical load: two or all three within the first increment."""
    text = dr.with_static(without_branches("euler"), method, data)
    run = dr.run_deck(dr.changed(text, ("LOAD, ABOVE, 10.", "LOAD, ABOVE, 30.")))
    found = bifurcations(run)
    assert [c.multiplicity for c in found] == [1, 1, 1]
    dr.assert_close([c.load_factor for c in found], [1.0, 9.0 + 2e-7, 25.0 + 1.6e-6], absolute=10 * LOCATE * 60.0)
    first = [c.point for c in found][:2]
    assert first == [2, 3], "both between the start and the point after it"
    assert not told_twice(run.results)
    x = run.results.mesh.coordinates[:, 0]
    for k, c in enumerate(found):
        shape = 1.0 - np.cos((k + 0.5) * np.pi * x)
        dr.assert_close(run.results.null_vectors(c)[0, :, 1], shape / np.max(np.abs(shape)), absolute=2e-5)


@pytest.mark.parametrize("method, data", [
    ("METHOD=DISPLACEMENT, MONITOR=v", "0.02, 1E-6, 0.02"), ("METHOD=DISPLACEMENT, MONITOR=v", "0.03, 1E-6, 0.03"),
    ("METHOD=DISPLACEMENT, MONITOR=v", "0.0052, 1E-6, 0.0052"), ("METHOD=CYLINDRICAL", "5., 1E-9, 0.1"),
    ("METHOD=SPHERICAL", "5., 1E-9, 0.1"), ("METHOD=LINEARISED", "5., 1E-9, 0.1"), ("METHOD=MINIMUM RESIDUAL", "5., 1E-9, 0.1"),
    ("METHOD=VARIABLE LOAD", "5., 1E-9, 0.1"), ("METHOD=GENERALISED DISPLACEMENT", "5., 1E-9, 0.1")])
def test_shallow_arch_whatever_the_increments(method, data):
    """Limit point and bifurcation in one increment of 0.02 in v: 0.0460 and 0.0562, then 0.1606 and 0.1816."""
    run = dr.run_deck(dr.with_static(without_branches("arch-shallow-hinged"), method, data))
    events = [c for c in run.results.critical if c.label != "EP"]
    assert [c.label for c in events] == ["BP", "LP", "LP", "BP"]
    assert [c.multiplicity for c in events] == [1, 0, 0, 1]
    dr.assert_close([c.load_factor for c in events], [14.3595205986, 14.7083255434, -10.1496812160, -6.2196423013], relative=5e-7)
    dr.assert_close([c.monitors["v"] for c in events], [0.0460440491, 0.0561532126, 0.1606071614, 0.1815730430], absolute=2e-7)
    bifurcations(run)


@pytest.mark.parametrize("name", ["euler", "arch-deep-hinged", "arch-shallow-hinged", "lee-frame", "arch-clamped-hinged", "ring"])
@pytest.mark.parametrize("largest", ["0.003", "0.03"])
def test_nothing_is_told_twice(name, largest):
    """On the path and on its branches, with short and long increments."""
    text = dr.on_given_mesh(name)
    line = text.splitlines()[[k for k, line in enumerate(text.splitlines()) if line.startswith("*STATIC")][0] + 1]
    first = line.split(",")[0]
    text = dr.with_static(text, "METHOD=CYLINDRICAL", f"{first}, 1E-12, {largest}")
    run = dr.run_deck(text.replace("INCREMENT=0.01", "INCREMENT=0.002"))
    for path in (run.results, *run.results.branches.values()):
        assert not told_twice(path)
        assert all(c.located for c in path.critical)

"""Linear buckling (*BUCKLE) against closed forms.

Factors converge with the order of the element, the straight UL2 with the second: the stresses act within the element, too, not
only on the displacements of its nodes, where linearised stiffness has the fourth order at most.
"""
import functools

import numpy as np
import pytest

import deck_runner as dr

PI2 = np.pi**2
TAN_X_IS_X = 4.493409457909064   # clamped at one end, pinned at the other


def deck(model, *steps):
    return "*HEADING\nbuckling\n" + model + "".join(steps)


def column(ends, elements=32, kind="GE4", ea=1e6, shape="1, 0., 0.\n2, 1., 0.", extra=""):
    """EI = 1; the nodes 1 and 2 at its ends."""
    return (f"*NODE\n{shape}\n*LINE, ELSET=ROD, NSET=ROD, TYPE={kind}\n1, 2, {elements}\n"
            f"*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS\n{ea!r}, 1.\n*BOUNDARY\n{ends}\n{extra}")


def buckle(modes, loads="*CLOAD\n2, 1, -1.\n", name="BUCKLE", widest=0.01):
    return f"*STEP, NAME={name}\n*BUCKLE\n{modes}\n*ACCURACY, WIDEST={widest}\n{loads}*END STEP\n"


def load_step(loads, end=1.0):
    return (f"*STEP\n*STATIC, METHOD=LOAD\n{end / 4!r}\n{loads}*STOP\nLOAD, ABOVE, {end!r}\n*FIELD OUTPUT\nDISPLACEMENT\n"
            "*END STEP\n")


def modes_of(text, code=0, name="BUCKLE"):
    return dr.run_deck(text, code=code).results.buckling[name]


def factors(text):
    found = modes_of(text)
    # rounding of the tangent, EA h^2/EI times 1e-16, over the small part of it that bends
    assert np.all(found.residual < 1e-4), f"residuals {found.residual}"
    return found.load_factor


COLUMNS = {"clamped, free": ("1, ENCASTRE", [PI2 / 4, 9 * PI2 / 4, 25 * PI2 / 4]),
           "pinned, pinned": ("1, PINNED\n2, 2", [PI2, 4 * PI2, 9 * PI2]),
           "clamped, clamped": ("1, ENCASTRE\n2, YSYMM", [4 * PI2, 4 * TAN_X_IS_X**2, 16 * PI2]),
           "clamped, pinned": ("1, ENCASTRE\n2, 2", [TAN_X_IS_X**2])}


# ---- columns ----

@pytest.mark.parametrize("ends", COLUMNS)
@pytest.mark.parametrize("kind, order", [("GE2", 2), ("UL2", 2), ("GE4", 4), ("GE6", 6), ("GE8", 8)])
def test_columns_converge_to_euler(ends, kind, order):
    support, exact = COLUMNS[ends]
    meshes = (4, 8, 16) if order > 4 else (8, 16, 32) if order == 4 else (16, 32, 64)
    runs = [modes_of(deck(column(support, n, kind), buckle(len(exact), widest=10))) for n in meshes]
    errors = np.array([run.load_factor for run in runs]) / exact - 1.0
    for mode in range(len(exact)):
        # Rounding of the tangent ends it.
        seen = (np.abs(errors[:, mode]) > 1e-12) & (np.abs(errors[:, mode]) < (0.5 if order == 2 else 1e-2))
        if np.sum(seen) > 1:
            dr.assert_order(errors[seen, mode], order, below=0.35, above=0.9)
    # second order: (k h)^2/12 or less with k^2 = P, and so on
    wave = np.sqrt(exact) / meshes[-1]
    least = {2: wave**2 / 6, 4: wave**4 / 360, 6: wave**6 / 2e4, 8: wave**8 / 1e6}[order]
    assert np.all(np.abs(errors[-1]) < 1.5 * np.max(least) + 1e-12)


@dr.release_only
def test_a_tangent_that_is_rounding_is_told():
    """Rounding grows with the fourth power of the number of elements: nothing of a column of 30000 is left, and of 100000 not even
    the signs of the pivots."""
    run = dr.run_deck(deck(column("1, PINNED\n2, 2", 30000), buckle(1)), code=2)
    assert run.results.status == "stopped: step BUCKLE: the tangent is nothing but rounding: fewer elements are needed"
    run = dr.run_deck(deck(column("1, PINNED\n2, 2", 100000, kind="GE8"), buckle(1)), code=2)
    assert "nothing but rounding: fewer elements" in run.results.status


def test_pulled_instead_of_pushed():
    """The factors of the reversed load are the negative ones."""
    pushed = factors(deck(column("1, ENCASTRE"), buckle(3)))
    pulled = factors(deck(column("1, ENCASTRE"), buckle(3, "*CLOAD\n2, 1, 5.\n")))
    dr.assert_close(-5.0 * pulled, pushed, relative=1e-9)


def test_modes_are_euler_s():
    """1 - cos and sines, largest 1, positive where they first are large; slopes to match."""
    for ends, shape, slope in (
            ("clamped, free", lambda x, k: 1 - np.cos((k - 0.5) * np.pi * x),
             lambda x, k: (k - 0.5) * np.pi * np.sin((k - 0.5) * np.pi * x)),
            ("pinned, pinned", lambda x, k: np.sin(k * np.pi * x), lambda x, k: k * np.pi * np.cos(k * np.pi * x))):
        text = deck(column(COLUMNS[ends][0], 64), buckle(3), load_step("*CLOAD\n2, 1, -1.\n"))
        run = dr.run_deck(text)
        x = run.results.mesh.coordinates[:, 0]
        mode = run.results.buckling["BUCKLE"].mode
        assert mode.shape == (3, len(x), 3)
        for k in (1, 2, 3):
            size = np.max(np.abs(shape(x, k)))
            dr.assert_close(mode[k - 1, :, 1], shape(x, k) / size, absolute=2e-5)
            dr.assert_close(mode[k - 1, :, 2], slope(x, k) / size, absolute=2e-4)
            dr.assert_close(mode[k - 1, :, 0], 0.0 * x, absolute=1e-7)


def test_heavy_column():
    """Greenhill 1881: q L^3/EI = 7.8373474, with Bessel's functions; the normal force varies within the elements."""
    errors = []
    for n in (4, 8, 16):
        upright = column("1, ENCASTRE", n, shape="1, 0., 0.\n2, 0., 1.")
        errors.append(factors(deck(upright, buckle(1, "*DLOAD\nROD, PY, -1.\n")))[0] / 7.837347438943 - 1.0)
    dr.assert_order(errors, 4, below=0.4, above=0.5)
    assert abs(errors[-1]) < 1e-5


def test_prescribed_shortening():
    """The end is moved: N = -EA times the factor, and the column buckles at Euler's load."""
    run = factors(deck(column("1, ENCASTRE\n2, YSYMM\n2, 1", 32, ea=1e4), buckle(1, "*BOUNDARY\n2, 1, 1, -1.\n")))
    dr.assert_close(run, [4 * PI2 / 1e4], relative=5e-6 * 4)


# ---- about loaded states ----

@pytest.mark.parametrize("share", [0.5, 0.9, 2.0, 12.0])
def test_loaded_column_has_the_rest_left(share):
    """share Pcr stands on it: 1 - share and 9 - share are left, where the state is past one of them with a minus."""
    pcr = PI2 / 4
    model = column("1, ENCASTRE", 32, ea=1e9)
    text = deck(model, load_step(f"*CLOAD\n2, 1, {-pcr!r}\n", share), buckle(2, f"*CLOAD\n2, 1, {-pcr!r}\n"))
    left = np.array([1.0 - share, 9.0 - share])
    # Hermite's error at 32 elements, for the second mode 81 times that of the first: (k h)^4/720 = 8.3e-9
    found = np.sort(factors(text))
    dr.assert_close(found, np.sort(left), absolute=2e-5)
    assert list(modes_of(text).load_factor) == sorted(found, key=abs)


def test_the_nearer_the_state_the_better():
    """Two GE8 elements are right to 1e-6; what is left is the shortening, 2.5e-6, which the step leaves out."""
    path = dr.run_deck(deck(column("1, ENCASTRE", 2, "GE8"), "*STEP\n*STATIC, METHOD=LOAD\n0.5\n*CLOAD\n2, 1, -1.\n*STOP\n"
                                                             "LOAD, ABOVE, 3.\n*END STEP\n"))
    bifurcation = path.load("BP")
    errors = []
    for share in (0.0, 1.0, 2.0, 2.4):
        first = load_step("*CLOAD\n2, 1, -1.\n", share) if share > 0.0 else ""
        errors.append(abs(share + factors(deck(column("1, ENCASTRE", 2, "GE8"), first, buckle(1)))[0] - bifurcation))
    # in proportion to the distance from the bifurcation, here 2.467, 1.467, 0.467 and 0.067
    assert 1e-6 < errors[0] < 2e-5
    dr.assert_monotone(errors, rising=False)


def test_the_path_does_not_notice():
    """A step with *BUCKLE between two others changes nothing of them."""
    one, two = load_step("*CLOAD\n2, 1, -1.\n2, 2, 0.1\n"), load_step("*CLOAD\n2, 2, 1.\n")
    model = column("1, ENCASTRE", 8, extra="*MONITOR, NAME=v\n2, U2\n")
    plain, other = dr.run_deck(deck(model, one, two)), dr.run_deck(deck(model, one, buckle(2), two))
    for name in ("v", "load_factor", "negative_pivots"):
        assert np.array_equal(plain.column(name), other.column(name))


# ---- in contact ----

def rail(elements, modulus, ends="1, PINNED\n2, 2", gap=0.0, kind="GE4", points="AUTO"):
    """A rod of unit length on a Winkler foundation below it."""
    return column(ends, elements, kind, extra=(
        f"*OBSTACLE, NAME=BED, TYPE=LINE, FOUNDATION=WINKLER, MODULUS={modulus!r}\n0., 0., 1., 0.\n"
        f"*CONTACT, OBSTACLE=BED, NSET=ROD, GAP={gap!r}, POINTS={points}\n"))


WEIGHT = load_step("*DLOAD\nROD, PY, -1E-4\n")


@pytest.mark.parametrize("points", ["ALONG", "NODES"])
@pytest.mark.parametrize("modulus", [1e2, 4 * PI2**2, 1e4, 36 * PI2**2], ids=["1e2", "double", "1e4", "double again"])
def test_hinged_rail(modulus, points):
    """P = (m pi)^2 + k/(m pi)^2 (Hetenyi): exactly double where k = m^2 (m + 1)^2 pi^4. Nodal springs take nothing of sines."""
    every = np.arange(1, 20)**2 * PI2
    exact = np.sort(every + modulus / every)[:3]
    errors = np.array([factors(deck(rail(n, modulus, points=points), WEIGHT, buckle(3))) / exact - 1.0 for n in (16, 32, 64)])
    for mode in range(3):
        dr.assert_order(errors[:, mode], 4, below=0.4, above=0.4)
    dr.assert_close(errors[-1], 0.0 * errors[-1], absolute=2e-5)


def test_double_modes_are_independent():
    """k = 4 pi^4: sines of one and two half waves buckle at once; the modes span them."""
    text = deck(rail(32, 4 * PI2**2), WEIGHT, buckle(3))
    run = dr.run_deck(text)
    x = run.results.mesh.coordinates[:, 0]
    first, second, third = run.results.buckling["BUCKLE"].mode[:, :, 1]
    dr.assert_close(run.results.buckling["BUCKLE"].load_factor[:2], [5 * PI2] * 2, relative=1e-5)
    sines = np.array([np.sin(m * np.pi * x) for m in (1, 2)]).T
    for mode in (first, second):
        assert np.max(np.abs(mode - sines @ np.linalg.lstsq(sines, mode, rcond=None)[0])) < 1e-4
    assert abs(np.linalg.det([np.linalg.lstsq(sines, mode, rcond=None)[0] for mode in (first, second)])) > 0.1
    dr.assert_close(np.abs(third), np.abs(np.sin(3 * np.pi * x)), absolute=1e-4)


@dr.release_only
def test_long_rail():
    """2 root(k EI) where the ends are hinged, half of it where they are free: they buckle first, both at once."""
    k = 1e6
    every = np.arange(1, 20)**2 * PI2
    hinged = [factors(deck(rail(n, k), WEIGHT, buckle(1)))[0] / np.min(every + k / every) - 1.0 for n in (32, 64, 128)]
    dr.assert_order(hinged, 4, below=0.3, above=0.3)
    assert abs(hinged[-1]) < 5e-6
    # Both ends, up and down alike: they feel each other with exp(-k^(1/4)/2) = 1.4e-7, which splits the two.
    errors = [factors(deck(rail(n, k, "1, 1"), WEIGHT, buckle(2))) / np.sqrt(k) - 1.0 for n in (32, 64, 128)]
    dr.assert_order([np.mean(e) for e in errors], 4, below=0.3, above=0.3)
    dr.assert_close([e[1] for e in errors], [e[0] for e in errors], absolute=1e-6)
    assert np.max(np.abs(errors[-1])) < 5e-6


def test_long_rail_on_springs_at_nodes():
    """The spring of the end node: trapezoidal rule."""
    k = 1e6
    errors = [factors(deck(rail(n, k, "1, 1", points="NODES"), WEIGHT, buckle(2))) / np.sqrt(k) - 1.0 for n in (64, 128, 256)]
    dr.assert_order([e[0] for e in errors], 2, below=0.1, above=0.1)
    dr.assert_close([e[1] for e in errors], [e[0] for e in errors], absolute=2e-6)
    assert abs(errors[-1][0]) < 5e-3


def test_example_of_the_rail():
    """The numbers of the deck's comments: 3, 4, 5 and 2 half waves."""
    run = dr.run_deck(dr.on_given_mesh("rail-buckling"))
    dr.assert_close(run.results.buckling["HEAT"].load_factor, [201.405, 221.240, 287.268, 292.781], relative=2e-5)
    assert np.all(run.column("active_contacts")[1:] == 64)   # elements
    x = run.results.mesh.coordinates[:, 0]
    for waves, mode in zip((3, 4, 5, 2), run.results.buckling["HEAT"].mode[:, :, 1]):
        dr.assert_close(np.abs(mode), np.abs(np.sin(waves * np.pi * x)), absolute=5e-3)


def test_rail_above_its_bed():
    """A bed that is not touched holds nothing: Euler's load."""
    dr.assert_close(factors(deck(rail(32, 1e4, gap=0.01), buckle(2))), [PI2, 4 * PI2], relative=1e-4)


def test_rigid_prop():
    """Pressed against a rigid prop at midspan, the column buckles in two spans: 4 pi^2, then 8.18 pi^2; before, in one."""
    model = ("*NODE\n1, 0., 0.\n3, 0.5, 0.\n2, 1., 0.\n*LINE, ELSET=ROD\n1, 3, 16\n3, 2, 16\n*NSET, NSET=MID\n3\n"
             "*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS\n1e9, 1.\n*BOUNDARY\n1, PINNED\n2, 2\n"
             "*OBSTACLE, NAME=PROP, TYPE=LINE\n0., 0., 1., 0.\n*CONTACT, OBSTACLE=PROP, NSET=MID, GAP={}\n")
    found = factors(deck(model.format(0.0), load_step("*CLOAD\n3, 2, -1.\n"), buckle(2)))
    dr.assert_close(found, [4 * PI2, 4 * TAN_X_IS_X**2], relative=1e-4)
    dr.assert_close(factors(deck(model.format(0.01), buckle(2))), [PI2, 4 * PI2], relative=1e-4)


@dr.release_only
def test_ring_in_its_cavity():
    """The limit point of the paper's ring from states on the path: the nearer, the better, and right in the limit."""
    estimates, loads = [], (70.0, 80.0, 81.5)
    for load in loads:
        text = dr.changed(dr.on_given_mesh("ring"), ("0., 160, 6.", "0., 160"), ("LOAD, 34., 57., 62., 28.\n", f"LOAD, {load}\n"),
                          ("v, ABOVE, 0.6", f"LOAD, ABOVE, {load}"))
        found = factors(text + buckle(3, "*DLOAD\nRING, PY, -1.\n"))
        estimates.append(load + np.min(found[found > 0.0]))
    # the stresses alone, without the displacements, tell too much by a multiple of the rest of the way
    errors, rest = np.array(estimates) - 81.55745, 81.55745 - np.array(loads)
    dr.assert_monotone(errors, rising=False)
    assert np.all(errors > 0.0) and np.all(errors < 6.0 * rest)


# ---- follower pressure ----

PRESSURE = "*DLOAD\nRING, P, 1.\n"


def ring(elements, kind="GE4", ends="1, PINNED\n2, 2"):
    return (f"*NODE\n1, 1., 0.\n2, -1., 0.\n*ARC, ELSET=RING, TYPE={kind}\n1, 2, 0., 0., {elements // 2}\n"
            f"2, 1, 0., 0., {elements // 2}\n*BEAM SECTION, ELSET=RING, SECTION=STIFFNESS\n1e7, 1.\n*BOUNDARY\n{ends}\n")


@pytest.mark.parametrize("ends", ["1, PINNED\n2, 2", "1, XSYMM\n2, 2", "1, ENCASTRE"])
def test_ring_under_pressure(ends):
    """p R^3/EI = n^2 - 1, each twice; the supports hold the plane only, wherever they are. EA: 1e-7 of the factors."""
    exact = np.array([3.0, 3.0, 8.0, 8.0, 15.0, 15.0])
    errors = np.array([factors(deck(ring(n, "GE4", ends), buckle(6, PRESSURE, widest=10))) / exact - 1.0 for n in (12, 24, 48)])
    for mode in range(6):
        dr.assert_order(errors[:, mode], 4, below=0.4, above=0.4)
    dr.assert_close(errors[:, ::2], errors[:, 1::2], absolute=1e-6)
    assert np.max(np.abs(errors[-1])) < 2e-4


@pytest.mark.parametrize("kind, elements, order", [("GE6", 24, 6), ("GE8", 12, 8)])
def test_ring_of_other_elements(kind, elements, order):
    """EA = 1e7: its compression lowers the factors p R^3/EI by p R^2/EA of themselves."""
    exact = np.array([3.0, 3.0, 8.0, 8.0, 15.0, 15.0])
    errors = [factors(deck(ring(n, kind), buckle(6, PRESSURE, widest=10))) / (exact * (1.0 - 1e-7)) - 1.0 for n in (elements, 2 * elements)]
    assert np.all(np.abs(errors[1]) < 1.5 * 0.5**order * np.abs(errors[0]) + 1e-9)


def test_ring_of_straight_elements():
    """The error grows with n^2 - 1 where the order is 2."""
    exact = np.array([3.0, 3.0, 8.0, 8.0, 15.0, 15.0])
    errors = np.abs(factors(deck(ring(96, "UL2"), buckle(6, PRESSURE))) / exact - 1.0)
    assert np.all(errors < 4e-3 * exact / 3.0)


@dr.release_only
@pytest.mark.parametrize("kind", ["GE2", "GE4", "GE6", "GE8"])
def test_error_bars_of_columns(kind):
    """Bars hold the error where they are told, and the estimate is most of it."""
    for ends, (support, exact) in COLUMNS.items():
        for n in (6, 11, 21):
            run = modes_of(deck(column(support, n, kind, ea=1e12), buckle(len(exact), widest=10)))
            error, told = np.array(exact) - run.load_factor, np.isfinite(run.error)
            assert np.all(np.abs(error[told]) <= run.error[told] + 1e-10 * np.array(exact)[told])
            clear = told & (np.abs(error) > 1e-9 * run.load_factor) & (np.abs(error) < 0.05 * run.load_factor)
            np.testing.assert_allclose((run.corrected - run.load_factor)[clear], error[clear], rtol=0.3)


# ---- what cannot be ----

@pytest.mark.parametrize("loads", ["*CLOAD\n2, 2, -1.\n", "*CLOAD\n2, 6, 1.\n", "*DLOAD\nROD, PY, 1.\n"])
def test_loads_that_only_bend(loads):
    run = dr.run_deck(deck(column("1, ENCASTRE", 8), buckle(1, loads)), code=2)
    assert "they cannot make anything buckle" in run.results.status
    assert not run.results.buckling


def test_fewer_modes_than_asked_for():
    """A rod of one element that is pushed has two modes, that of the axial displacement does not count."""
    run = dr.run_deck(deck(column("1, ENCASTRE", 1), buckle(3)), code=2)
    assert "there are only 2 buckling modes" in run.results.status
    assert len(run.results.buckling["BUCKLE"].load_factor) == 2
    more = dr.run_deck(deck(column("1, ENCASTRE", 1), buckle(4)), code=1)
    assert "there are only 3 free degrees of freedom" in more.stderr


def test_ul2_and_ge_modes_of_a_frame():
    """A portal that sways: P (per column) between those of a hinged and a clamped head; both families converge to it."""
    def portal(kind, n):
        return ("*NODE\n1, 0., 0.\n2, 0., 1.\n3, 1., 1.\n4, 1., 0.\n"
                f"*LINE, ELSET=FRAME, TYPE={kind}\n1, 2, {n}\n2, 3, {n}\n3, 4, {n}\n"
                "*BEAM SECTION, ELSET=FRAME, SECTION=STIFFNESS\n1e7, 1.\n*BOUNDARY\n1, ENCASTRE\n4, ENCASTRE\n")
    loads = "*CLOAD\n2, 2, -1.\n3, 2, -1.\n"
    exact = portal_load()
    fine = factors(deck(portal("GE4", 32), buckle(1, loads)))[0]
    errors = [factors(deck(portal("UL2", n), buckle(1, loads)))[0] - exact for n in (16, 32, 64)]
    dr.assert_close(fine, exact, relative=2e-6)
    dr.assert_order(errors, 2, below=0.2, above=0.2)


@functools.cache
def portal_load():
    """Root of k cot k = -6: sway of a portal with a beam like its columns, inextensible; P = k^2."""
    low, high = np.pi / 2 + 1e-6, np.pi - 1e-6
    for _ in range(80):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if middle / np.tan(middle) > -6.0 else (low, middle)
    return low**2


@pytest.mark.parametrize("tolerance", [1e-2, 1e-4])
def test_heavy_rod_on_a_mesh_made_for_its_rest(tolerance):
    """A mesh that is good for a rod at rest on Winkler ground has no modes to tell: it is refined until it has.

    P = n^2 pi^2 EI/L^2 + k L^2/(n^2 pi^2) of a straight rod; this one has sunk by w = 0.005 between its ends, which changes it in
    proportion to (pi w/L)^2, 3E-5.
    """
    run = dr.run_deck(f"""*HEADING
Heavy rod on ground that only pushes
*NODE
1, 0.0, 0.0
2, 3.0, 0.0
*LINE, ELSET=R, NSET=R, TYPE=GE8
1, 2
*BEAM SECTION, ELSET=R, SECTION=STIFFNESS
1.0e6, 1.0
*BOUNDARY
1, PINNED
2, 2
*OBSTACLE, NAME=G, TYPE=LINE, FOUNDATION=WINKLER, MODULUS=100.0
-1.0, 0.0, 9.0, 0.0
*CONTACT, OBSTACLE=G, NSET=R
*STEP
*STATIC, METHOD=LOAD
0.5
*ACCURACY, TOLERANCE={tolerance!r}
*DLOAD
R, PY, -0.5
*END STEP
*STEP
*BUCKLE
3
*ACCURACY, TOLERANCE={tolerance!r}
*CLOAD
2, 1, -1.0
*END STEP
""")
    waves = np.array([n**2 * np.pi**2 / 9.0 for n in (1, 2, 3, 4)])
    exact = np.sort(waves + 100.0 / waves)[:3]
    dr.assert_close(next(iter(run.results.buckling.values())).load_factor, exact, relative=tolerance + 1e-4)

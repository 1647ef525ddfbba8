"""Branches, buckling, modes as imperfections and limit curves do not know of units: one deck in N and mm, in kN and m, and
without dimensions gives the same points, to rounding, and results that scale as their units do."""
import functools

import numpy as np
import pytest

import deck_runner as dr


def arch(length, force):
    """The shallow arch: EI = 1, L = 1 in other units; the load factor is P L^2/EI in all of them."""
    def n(*values):
        return ", ".join(repr(float(value)) for value in values)
    steps = "*STEP, NAME={}\n{}*CLOAD\n2, 2, " + n(-force) + "\n{}*END STEP\n"
    fields = "*FIELD OUTPUT\nDISPLACEMENT, SECTION FORCES\n"
    path = "*STATIC\n0.5, 1E-9, 0.005\n"
    stop = f"*STOP\nv, ABOVE, {n(0.09 * length)}\n"
    return (f"*HEADING\nunits\n*NODE\n1, {n(-0.5 * length, 0)}\n2, {n(0, 0.1 * length)}\n3, {n(0.5 * length, 0)}\n"
            "*ARC, ELSET=ARCH, NSET=ARCH, TYPE=GE6, DIRECTION=CLOCKWISE\n"
            f"1, 2, {n(0, -1.2 * length)}, 8\n2, 3, {n(0, -1.2 * length)}, 8\n"
            f"*BEAM SECTION, ELSET=ARCH, SECTION=STIFFNESS\n{n(3600 * force, force * length**2)}\n*BOUNDARY\n1, PINNED\n3, PINNED\n"
            "*MONITOR, NAME=v\n2, U2, -1.\n*MONITOR, NAME=THRUST\n1, RF1\n"
            + steps.format("MODES", "*BUCKLE\n3\n", "")
            + steps.format("PERFECT", path, f"*TURNING POINTS\nv\n*BRANCH, NAME=SWAY, INCREMENT=0.002\n{stop[6:]}{stop}{fields}"
                           "*LIMIT CURVE, NAME=EI, PARAMETER=EI, ELSET=ARCH\n"
                           f"{n(0.1 * force * length**2, 1.5 * force * length**2)}\n")
            + steps.format("IMPERFECT", path, "*IMPERFECTION, SHAPE=MODE, ELSET=ARCH, STEP=MODES\n"
                           f"1, {n(1e-3 * length)}\n{stop}{fields}"
                           "*LIMIT CURVE, NAME=AMPLITUDE, PARAMETER=IMPERFECTION, ELSET=ARCH, SCALE=LOG\n-0.1, 0.01\n"))


def rail(length, force):
    """The example deck in other units."""
    text = dr.on_given_mesh("rail-buckling")
    return dr.changed(text, ("2, 1., 0.", f"2, {length!r}, 0."), ("1E6, 1.\n", f"{1e6 * force!r}, {force * length**2!r}\n"),
                      ("MODULUS=1E4", f"MODULUS={1e4 * force / length**2!r}"), ("0., 0., 1., 0.", f"0., 0., {length!r}, 0."),
                      ("RAIL, PY, -0.01", f"RAIL, PY, {-0.01 * force / length!r}"), ("2, 1, -1.\n", f"2, 1, {-force!r}\n"))


@functools.cache
def arch_run(length, force):
    return dr.run_deck(arch(length, force))


@functools.cache
def rail_run(length, force):
    return dr.run_deck(rail(length, force))


UNITS = [(1000.0, 2.7e5), (0.3048, 4.448e-3), (1e-6, 1e9)]
# what iterations and locating leave where the path is steep: TOLERANCE, and LOCATE of the increments
SMALL = 1e-7


def same_path(one, two, length, force, small=SMALL):
    assert one.n_points == two.n_points
    for name, unit in (("load_factor", 1.0), ("arc_length", 1.0), ("v", length), ("THRUST", force)):
        a, b = one.column(name).values, two.column(name).values / unit
        dr.assert_close(b, a, absolute=small * np.max(np.abs(a)))
    # at a critical point an eigenvalue is zero, its sign that of rounding
    others = [k for k in range(one.n_points) if k + 1 not in [c.point for c in one.critical]]
    for name in ("step", "negative_pivots"):
        assert np.array_equal(one.column(name).values[others], two.column(name).values[others])
    assert [(c.label, c.point, c.multiplicity, c.note) for c in one.critical] == \
        [(c.label, c.point, c.multiplicity, c.note) for c in two.critical]


@pytest.mark.parametrize("length, force", UNITS)
def test_path_and_branches(length, force):
    one, two = arch_run(1.0, 1.0).results, arch_run(length, force).results
    same_path(one, two, length, force)
    assert len(two.branches) == 2
    for a, b in zip(one.branches.values(), two.branches.values(), strict=True):
        assert (a.name, a.side, a.point) == (b.name, b.side, b.point)
        # a bifurcation's state has a share of the null vector, by which the points of a branch are shifted along it
        same_path(a, b, length, force, 1e-5)
        dr.assert_close(b.column("load_factor").values[-1], a.column("load_factor").values[-1], relative=SMALL)
    found = [c for c in one.critical if c.label == "BP"]
    for a, b in zip(found, [c for c in two.critical if c.label == "BP"], strict=True):
        vectors = one.null_vectors(a), two.null_vectors(b)
        dr.assert_close(vectors[1][:, :, :2], vectors[0][:, :, :2], absolute=2e-3)
        dr.assert_close(vectors[1][:, :, 2] * length, vectors[0][:, :, 2], absolute=2e-2)


@pytest.mark.parametrize("length, force", UNITS)
def test_buckling(length, force):
    for run, name, modes in ((arch_run, "MODES", 3), (rail_run, "HEAT", 4)):
        one, two = (run(*units).results.buckling[name] for units in ((1.0, 1.0), (length, force)))
        assert len(two.load_factor) == modes
        dr.assert_close(two.load_factor, one.load_factor, relative=SMALL)
        dr.assert_close(two.mode[:, :, :2], one.mode[:, :, :2], absolute=1e-6)
        dr.assert_close(two.mode[:, :, 2] * length, one.mode[:, :, 2], absolute=1e-5)


@pytest.mark.parametrize("length, force", UNITS)
def test_limit_curves(length, force):
    one, two = arch_run(1.0, 1.0).results.limit_curves, arch_run(length, force).results.limit_curves
    assert sorted(one) == sorted(two) == ["AMPLITUDE", "EI"]
    for name, unit in (("EI", force * length**2), ("AMPLITUDE", 1.0)):
        a, b = one[name], two[name]
        assert [str(label) for label in a.column("label").values] == [str(label) for label in b.column("label").values]
        # a point may lie elsewhere along the curve by what the search leaves open
        dr.assert_close(b.column("parameter").values / unit, a.column("parameter").values, relative=1e-4)
        dr.assert_close(b.column("load_factor").values, a.column("load_factor").values, relative=1e-4)
        dr.assert_close(b.column("load_factor").values[[0, -1]], a.column("load_factor").values[[0, -1]], relative=SMALL)
        dr.assert_close(b.column("v").values / length, a.column("v").values, relative=1e-3)


def column(length, force):
    """The example deck in other units."""
    def n(*values):
        return ", ".join(repr(float(value)) for value in values)
    return dr.changed(dr.on_given_mesh("column"), ("2, 0.5, 0.\n3, 1., 0.", f"2, {n(0.5 * length, 0)}\n3, {n(length, 0)}"),
                      ("0.0014, 0.00105", n(0.0014 * length, 0.00105 * length)), ("480000., 1.", n(480000 * force, force * length**2)),
                      ("1., 0.02, 0., 0.02", n(length, 0.02 * length, 0, 0.02 * length)),
                      ("2, U2, 200., 0.28", f"2, U2, {200 / length!r}, 0.28"),
                      ("-39.478417604357434", n(-39.478417604357434 * force)), ("ABOVE, 0.05", f"ABOVE, {n(0.05 * length)}"))


@functools.cache
def in_ordinary_units():
    return dr.run_deck(column(1.0, 1.0))


@dr.release_only
@pytest.mark.parametrize("length, force", [(1e-10, 1.0), (1e10, 1.0), (1e-12, 1e12), (1e12, 1e-12)])
def test_units_far_from_one(length, force):
    """Rows of forces and of moments, 1e12 apart in numbers: which is the pivot must not depend on that, or Newton's method gets
    a tangent without digits. Same points, same iterations but for one here and there, which rounding decides."""
    one, two = in_ordinary_units(), dr.run_deck(column(length, force))
    assert one.results.n_points == two.results.n_points
    assert abs(sum(one.column("iterations")) - sum(two.column("iterations"))) <= 0.05 * sum(one.column("iterations"))
    dr.assert_close([c.load_factor for c in two.labelled("LP")], [c.load_factor for c in one.labelled("LP")], relative=SMALL)
    dr.assert_close(two.column("midspan"), one.column("midspan"), absolute=1e-5)

"""Turning points of monitors (*TURNING POINTS): where a displacement or a reaction has a maximum or minimum along the path."""
import numpy as np
import pytest

import deck_runner as dr


def with_turning(text, names, data=None):
    text = dr.changed(text, ("*STOP\n", f"*TURNING POINTS\n{names}\n*STOP\n"))
    return dr.run_deck(text if data is None else dr.with_static(text, "METHOD=CYLINDRICAL", data))


def extrema(x):
    """Rows at which x has a maximum or minimum."""
    rise = np.diff(x)
    return 1 + np.flatnonzero(rise[1:] * rise[:-1] < 0.0)


def extremum(s, x, k, points=7):
    """That of the polynomial through the points about row k; a step h leaves h^points, and rounding."""
    near = slice(k - points // 2, k + points // 2 + 1)
    t = (s[near] - s[k]) / (s[k + 1] - s[k - 1])
    polynomial = np.polynomial.Polynomial.fit(t, x[near] - x[k], points - 1)
    at = min((root.real for root in polynomial.deriv().roots() if abs(root.imag) < 1e-9), key=abs)
    return x[k] + polynomial(at)


def test_lee_frame_against_a_fine_path():
    """v and then u turn back between the limit points."""
    run = with_turning(dr.on_given_mesh("lee-frame"), "v, u")
    fine = dr.run_deck(dr.changed(dr.with_static(dr.on_given_mesh("lee-frame"), "METHOD=CYLINDRICAL", "0.01, 1E-9, 0.001"),
                                  ("*CLOAD\n", "*CONTROLS, POINTS=5000\n*CLOAD\n")))
    length = fine.column("arc_length")
    expected = []
    for name in ("v", "u"):
        x = fine.column(name)
        expected += [(length[k], name, extremum(length, x, k)) for k in extrema(x)]
    expected.sort()
    found = run.labelled("TP")
    assert [c.note for c in found] == [f"turning point of {name}" for _, name, _ in expected]
    for c, (_, name, value) in zip(found, expected):
        assert c.located
        dr.assert_close(c.monitors[name], value, absolute=1e-8)


@pytest.mark.parametrize("data", ["0.3, 1E-9, 0.005", "0.3, 1E-9, 0.05", "1., 1E-9, 0.1"])
def test_whatever_the_increments(data):
    plain, run = (with_turning(dr.on_given_mesh("lee-frame"), "v, u", d) for d in (None, data))
    assert [c.note for c in run.results.critical] == [c.note for c in plain.results.critical]
    for one, two in zip(run.labelled("TP"), plain.labelled("TP"), strict=True):
        name = one.note.split()[-1]
        dr.assert_close(one.monitors[name], two.monitors[name], absolute=1e-9)
        dr.assert_close(one.load_factor, two.load_factor, absolute=2e-5)


def test_extremum_of_the_path():
    """No point of the path is beyond a turning point before the next one."""
    run = with_turning(dr.on_given_mesh("lee-frame"), "v")
    v, ends = run.column("v"), [c.point - 1 for c in run.labelled("TP")]
    for a, b in zip([0, *ends], [*ends, len(v) - 1]):
        dr.assert_monotone(v[a:b + 1], rising=v[b] > v[a])


def test_turning_points_of_a_branch():
    """The deep arch sways out to u = 0.85 and back: exact table of its branch."""
    table = dr.reference("arch_deep_hinged_branch")
    run = with_turning(dr.on_given_mesh("arch-deep-hinged"), "u, v")
    branch, = run.results.branches.values()
    found = [c for c in branch.critical if c.label == "TP"]
    u = np.abs(table["u"])
    for k in extrema(u):
        s = np.cumsum(np.hypot(np.diff(table["u"], prepend=0.0), np.diff(table["v"], prepend=0.0)))
        nearest = min((abs(abs(c.monitors["u"]) - extremum(s, u, k)) for c in found if c.note.endswith(" u")), default=np.inf)
        assert nearest < 1e-8, f"u = {u[k]}"
    assert found


def test_support_reaction():
    """The thrust of the shallow arch grows, and falls again."""
    text = dr.changed(dr.on_given_mesh("arch-shallow-hinged"), ("*STEP\n", "*MONITOR, NAME=THRUST\n1, RF1\n*STEP\n"))
    start = text.index("*BRANCH")
    text = text[:start] + text[text.index("*STOP", start):]
    run = with_turning(text, "THRUST")
    fine = dr.run_deck(dr.with_static(text, "METHOD=CYLINDRICAL", "0.05, 1E-9, 0.0002"))
    x, s = fine.column("THRUST"), fine.column("arc_length")
    expected = [extremum(s, x, k) for k in extrema(x)]
    assert len(expected) > 0
    dr.assert_close([c.monitors["THRUST"] for c in run.labelled("TP")], expected, relative=1e-7)


def test_monotone_monitor_has_none():
    """The apex of the shallow arch goes down all the way."""
    run = with_turning(dr.on_given_mesh("arch-shallow-hinged"), "v")
    assert not run.labelled("TP")
    for branch in run.results.branches.values():
        assert not [c for c in branch.critical if c.label == "TP"]


def test_what_symmetry_holds_does_not_turn():
    """The deep arch goes down upright before it sways: u is rounding, which changes its sign all the time."""
    run = with_turning(dr.on_given_mesh("arch-deep-hinged"), "u, v")
    assert [c.note for c in run.labelled("TP")] == ["turning point of v"]
    branch, = run.results.branches.values()
    assert "turning point of u" in [c.note for c in branch.critical]


def test_turning_points_do_not_change_the_path():
    plain, run = dr.run_deck(dr.on_given_mesh("lee-frame")), with_turning(dr.on_given_mesh("lee-frame"), "v, u")
    taken = [k for k in range(run.results.n_points) if k + 1 not in [c.point for c in run.labelled("TP")]]
    for name in ("load_factor", "v", "u"):
        assert np.array_equal(plain.column(name), run.column(name)[taken])

"""The boundary-value solver of contact_reference.py and its cases, against numbers of other solvers and closed forms."""
import math

import numpy as np
import pytest

import contact_cases as cases
import contact_reference as reference


def close(value, exact, relative):
    assert abs(float(value) - exact) <= relative * abs(exact), f"{value:.15g}, expected {exact:.15g}"


@pytest.mark.parametrize("slenderness, load, relative", [(1e2, 81.557427564661, 1e-13), (1e3, 501.56075880248, 1e-12),
                                                         (1e4, 3151.595, 1e-6), (1e5, 19872.04, 1e-6)])
def test_ring(slenderness, load, relative):
    """The first and the last two from other solvers, to the digits known."""
    close(cases.ring_limit(slenderness).load, load, relative)


def test_ring_does_not_depend_on_the_polynomials(monkeypatch):
    """Where EA is largest, on which the digits of everything else depend."""
    loads = [cases.ring_limit(1e5).load]
    monkeypatch.setattr(reference.Problem.__init__, "__defaults__", (1.0, 5, 16))
    for function in (cases.ring_start, cases.ring_limit):
        function.cache_clear()
    loads.append(cases.ring_limit(1e5).load)
    for function in (cases.ring_start, cases.ring_limit):
        function.cache_clear()
    close(loads[1], loads[0], 1e-11)


def test_path_of_the_ring():
    """Against the stored table, written by another solver to 12 digits."""
    rows = cases.ring_path(100.0, [0.00215443469, 0.01, 0.0358697377])
    for row, load, angle in zip(rows, (11.7128432776, 44.9684992371, 81.557427564661), (35.1040112844, 31.6833976779, 25.1202867)):
        close(row[1], load, 1e-8)          # v has ten digits
        close(row[2], angle, 1e-8)


def test_liners():
    close(cases.liner_limit(50.0, 0.004, 1e-3).load, 36.277500542, 1e-10)
    close(cases.liner_limit(50.0, 0.0, 2e-4).load, 59.49696, 1e-7)
    table = cases.liner_table()
    close(table[50, 1, 1e-3, 0.004], 36.277500542, 1e-10)
    assert len(table) == len(cases.SLENDERNESS) * len(cases.LOBES) * len(cases.DISTURBANCES) * len(cases.GAPS)


def test_column():
    events = cases.column_events()
    for name, load in (("onset", 0.9294732313), ("limit", 2.4840360971), ("loss", 1.9467900724), ("least", 1.0256469437)):
        close(events[name]["P"], load, 1e-10)
        close(events[name]["P"], cases.COLUMN[name], 1e-11)


def test_column_beside_a_drum():
    events = cases.column_events(2.0)
    for name, load in cases.COLUMN_AT_DRUM.items():
        close(events[name]["P"], load, 1e-11)


def test_pinned_column():
    events = cases.pinned_events()
    close(events["spread"]["P"], 3.974122318, 1e-10)
    close(events["opening"]["P"], 4.804326, 1e-7)
    close(events["opening"]["second"], 0.534878, 1e-6)
    # Its end is then at the zero of kappa0'': cos(pi x) = -7/64 but for the arc length.
    close(events["opening"]["second"], math.acos(-7.0 / 64.0) / math.pi, 1e-4)
    close(cases.pinned_limit()["P"], cases.PINNED["limit"], 1e-11)


def test_tube():
    close(cases.tube_force(0.5), 5.7421601, 5e-9)
    close(cases.tube_force(0.7), 15.950445, 2e-8)


def test_strip():
    """Line contact begins at 155.482, when the free parts are as long as the halves."""
    close(1.0 - 2.0 * cases.clamped_strip(160.0).end(1).x, 0.0313907, 2e-6)
    close(cases.clamped_strip(155.483)["mark"], 0.5, 5e-6)


def test_pipe_lift():
    """The table is of an inextensible pipe, here EA = 1e8."""
    for length, height, lift in ((1, 0.041582882044509, 0.5003464622674), (3, 1.7463390451712, 1.8251675617968)):
        state = cases.pipe_lift(height)
        close(state.end(1).fy, lift, 1e-8)
        close(6.0 - state["mark"], length, 1e-8)


def test_cradle_and_indenter():
    """Integrated in test_decks_obstacles.py without extension."""
    for force, angle in ((3.0, 0.21927007016811814), (4.0, 0.31174420752813153)):
        close(cases.cradle(force)["mark"], angle, 5e-8)
    for w, angle, force in ((0.225, 0.23659916962632951, 14.727655798129833), (0.235, 0.3293924151147048, 16.877295738958626)):
        state = cases.indenter(w)
        close(state["mark"] / 0.4, angle, 1e-6)
        close(2.0 * state.end(1).fy, force, 5e-7)


# A wrong pattern fails -----------------------------------------------------------------------------------------------------

def test_a_line_beyond_its_opening_is_none():
    opening = cases.pinned_events()["opening"]
    beyond = opening.problem.go(opening, "P", 5.0, {})
    with pytest.raises(AssertionError, match="pulls"):
        cases.assert_admissible(beyond, {}, on_left=True)


def test_a_line_that_has_shrunk_is_none():
    limit = cases.pinned_limit()
    beyond = limit.problem.go(limit, cases.hump, 0.55, {})
    with pytest.raises(AssertionError, match="negative length"):
        cases.assert_admissible(beyond, {}, on_left=True)


def test_a_point_beyond_the_load_where_it_spreads_is_none():
    """The column gets behind the wall on both sides of it."""
    spread = cases.pinned_events()["spread"]
    wall = reference.Line(0.0, 0.02, 0.0)

    def clear(state):
        return reference.gap(state.end(0), wall, state["sigma"], on_left=True)

    beyond = spread.problem.go(spread, "P", 4.05, {clear: 0.0})
    with pytest.raises(AssertionError, match="penetrates"):
        cases.assert_admissible(beyond, {0: wall, 1: wall}, on_left=True)


def test_a_touchdown_point_that_is_held_needs_a_couple():
    state, held = cases.ring_start(100.0)
    free = {name: value for name, value in held.items() if name != "couple"} | {"p": state["p"]}
    assert abs(state.problem.go(state, "mark", 0.7, free)["couple"]) > 1e-4


def test_what_cannot_be_solved_says_so():
    state, held = cases.ring_start(100.0)
    with pytest.raises(ArithmeticError):
        state.problem.solve(state, held, {"p": 100.0})          # above the limit load
    with pytest.raises(AssertionError, match="equations"):
        state.problem.solve(state, held)


# Parts ---------------------------------------------------------------------------------------------------------------------

def test_polynomials():
    grid, tau = reference.Grid(3, 6), np.linspace(0.0, 1.0, 17)
    values = grid.nodes**6 - grid.nodes
    assert np.max(np.abs(grid.interpolation(tau) @ values - (tau**6 - tau))) < 1e-15
    assert np.max(np.abs(grid.interpolation(tau, derivative=True) @ values - (6.0 * tau**5 - 1.0))) < 1e-13


@pytest.mark.parametrize("curve", [reference.Line(0.3, -0.2, 0.7), reference.Circle(0.3, -0.2, -1.7, 0.7)])
def test_curves(curve):
    sigma, step = 0.6, 1e-30
    x, y = curve.place(sigma + 1j * step)
    assert abs(x.imag / step - math.cos(curve.angle(sigma))) < 1e-14
    assert abs(y.imag / step - math.sin(curve.angle(sigma))) < 1e-14
    assert abs(curve.angle(sigma + 1j * step).imag / step - curve.curvature(sigma)) < 1e-14


def test_shape_of_a_wave():
    wave, x, step = cases.Wave(sines=((0.1, 2.0),), cosines=((0.05, 3.0),)), 0.4, 1e-30
    for order in range(3):
        assert abs(wave.derivative(x + 1j * step, order).imag / step - wave.derivative(x, order + 1)) < 1e-14
    assert abs(wave.curvature(x + 1j * step).imag / step / wave.rate(x) - wave.slope(x)) < 1e-13


@pytest.mark.parametrize("force", [1.0, 2.0, 5.0])
def test_drum(force):
    """M^2/2 + n.t is the same all along the elastica: M = 1 at the touchdown point, 0 at the end."""
    state = cases.drum(force, 0.0)
    assert abs(force * (math.sin(-state["mark"]) - math.sin(state.end(1).angle)) - 0.5) < 1e-12

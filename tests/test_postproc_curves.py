"""Curves through computed points: smooth between them, with their kinks."""

import numpy as np
import pytest

from unilat.plot.smooth_curve import through


def curve(x, y, corner=(), smooth=(), **told):
    rows = np.arange(len(x))
    return through(np.asarray(x, float), np.asarray(y, float), np.isin(rows, corner), np.isin(rows, smooth), **told)


def test_goes_through_its_points():
    x, y = np.array([0.0, 1.0, 3.0, 3.5, 2.0]), np.array([0.0, 2.0, 2.5, 1.0, -1.0])
    along_x, along_y, place = curve(x, y)
    assert np.array_equal(along_x[place], x) and np.array_equal(along_y[place], y)


@pytest.mark.parametrize("parts, error", [(8, 4e-3), (16, 3e-4)])
def test_a_circle_stays_round(parts, error):
    angle = np.linspace(0.0, 2.0 * np.pi, parts + 1)
    x, y, place = curve(np.cos(angle), np.sin(angle))
    inside = slice(place[1], place[-2])
    assert np.max(np.abs(np.hypot(x, y)[inside] - 1.0)) < error


def test_units_do_not_matter():
    x, y = np.array([0.0, 1.0, 2.0, 2.5]), np.array([0.0, 1.0, 0.5, 3.0])
    first, second = curve(x, y), curve(1e6 * x, 1e-9 * y)
    assert np.allclose(first[0], 1e-6 * second[0]) and np.allclose(first[1], 1e9 * second[1])


def test_corners_stay_sharp():
    """What comes before a corner does not know of what follows; a sudden turn is a corner of its own."""
    x = np.linspace(0.0, 8.0, 9)
    for corner in ((), (4,)):
        along, y, _ = curve(x, np.abs(x - 4.0), corner)
        assert np.allclose(y, np.abs(along - 4.0))


def test_tangents_of_the_path_are_kept():
    """A limit point is level, and a circle is round to its last point."""
    x = np.array([-1.0, -0.3, 0.0, 0.8, 2.0])
    along, y, place = curve(x, -x**2, smooth=(2,), rates=(np.ones(5), -2.0 * x))
    assert np.max(y) <= 1e-12
    assert np.ptp(curve(x, -x**2, smooth=(2,))[1] - y) > 1e-3        # the points alone do not tell
    angle = np.linspace(0.0, 2.0 * np.pi, 9)
    x, y, _ = curve(np.cos(angle), np.sin(angle), rates=(-np.sin(angle), np.cos(angle)))
    assert np.max(np.abs(np.hypot(x, y) - 1.0)) < 4e-3


@pytest.mark.parametrize("parts", [8, 16])
def test_what_has_no_tangent_is_taken_over_the_length(parts):
    """Three points beside the top of a load whose rate is known: a quantity that is even over the arc length stays so."""
    s = np.linspace(-1.0, 1.0, parts + 1)
    load, quantity = 1.0 - s**2, 3.0 * s + 0.2 * s**2
    x, y, _ = curve(load, quantity, length=s, rates=(-2.0 * s, None))
    inside = np.abs(y) < 2.0
    at = (-3.0 + np.sqrt(9.0 + 0.8 * y)) / 0.4
    assert np.max(np.abs(x - (1.0 - at**2))[inside]) < 0.02 * (8 / parts)**3


def test_what_is_not_known_breaks_the_curve():
    y = np.array([0.0, 1.0, np.nan, 1.0, 2.0, 2.2])
    _, values, place = curve(np.arange(6.0), y)
    assert np.isnan(values[place[2]]) and np.all(np.isfinite(values[place[3]:]))


def test_rounding_stays_where_it_is():
    """A path along which nothing moves but by rounding ends where it ends."""
    load = np.linspace(0.0, 15.0, 12)
    none = np.zeros(12, dtype=bool)
    _, y, _ = through(1e-17 * np.sin(40.0 * np.arange(12.0)**2), load, none, none, spans=(1.0, 15.0))
    assert np.all(np.diff(y) >= 0.0)


def test_a_quantity_that_stands_still_turns_back_on_itself():
    """As the angle of a symmetric contact's end over a load with a limit point."""
    load = np.array([14.8, 23.6, 27.4, 27.8, 28.24, 28.25, 28.05, 26.5, 24.0])
    angle = 180.0 + 1e-12 * np.array([3, -2, 5, 40, -4, 0, 2, -3, 1])
    top = np.arange(9) == 5
    rate = np.array([4.0, 2.0, 1.0, 0.9, 0.1, 0.0, -0.5, -1.5, -2.0])
    x, y, _ = through(load, angle, np.zeros(9, bool), top, np.arange(9.0), (rate, None))
    assert x.max() <= load.max() + 1e-3 and x.min() >= load.min()
    assert np.ptp(y) < 1e-9

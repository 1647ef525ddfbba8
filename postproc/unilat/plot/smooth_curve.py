"""A smooth curve through computed points of a path: the program takes increments as long as it can, so points are few.

Between two points the curve is the cubic with the path's direction at both. The result file has the tangents of load
factor and monitors; the rate of another quantity is that of the parabola through the point and its two neighbours over
the arc length. At corners each side has a direction of its own, and none of the two knows of the other. Lengths are
measured in the ranges of the two quantities, as they are drawn.
"""

from __future__ import annotations

import numpy as np

BETWEEN = 12             # parts of the curve between two points
SHARPEST = np.pi / 18    # a turn beyond this that neither neighbour announces is a corner
ANNOUNCED = 0.25         # of the turn: what a neighbour on a smooth curve turns at least
ROUNDING = 1e-9          # of a quantity's size: what changes by less stands still


def through(x: np.ndarray, y: np.ndarray, corner: np.ndarray, smooth: np.ndarray, length: np.ndarray | None = None,
            rates: tuple[np.ndarray | None, np.ndarray | None] = (None, None),
            spans: tuple[float, float] = (0.0, 0.0)) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The curve, and where on it the points are: x, y, place, so that x[place] are the points.

    `corner`: where the path has a kink, such as at contact events; `smooth`: where it has none for sure, however it
    turns, such as at limit points. Points without values break the curve. `length`: along the path up to every point;
    None: that of the polygon. `rates`: d/d(length) of x and y, None or NaN where they are not known. `spans`: of the
    picture along x and y; what is small beside them is small, as rounding is.
    """
    points = np.column_stack((x, y)).astype(float)
    known = np.all(np.isfinite(points), axis=1)
    scale = np.maximum(np.ptp(points[known], axis=0) if known.any() else np.ones(2), spans)
    if known.any():
        scale = np.maximum(scale, ROUNDING * np.max(np.abs(points[known]), axis=0))
    scale = np.where(scale > 0.0, scale, 1.0)
    scaled = points / scale
    rate = np.column_stack([np.full(len(points), np.nan) if each is None else each for each in rates]) / scale
    corner = corner | (_unannounced(scaled) & ~smooth & ~np.all(np.isfinite(rate), axis=1))
    pieces, place, count = [], [0], 1
    cuts = [0, *(np.flatnonzero(corner[1:-1] | ~known[1:-1]) + 1), len(points) - 1]
    for first, last in zip(cuts, cuts[1:]):
        part = slice(first, last + 1)
        piece = _blended(scaled[part], None if length is None else length[part], rate[part])
        pieces += piece
        for between in piece:
            count += len(between)
            place.append(count - 1)
    curve = np.concatenate([scaled[:1], *pieces])
    place = np.array(place)
    curve[place] = scaled
    return (*(curve * scale).T, place)


def _unannounced(points: np.ndarray) -> np.ndarray:
    """Where the polygon turns all of a sudden."""
    with np.errstate(invalid="ignore"):
        direction = np.unwrap(np.arctan2(*np.diff(points, axis=0).T[::-1]))
        turn = np.zeros(len(points))
        turn[1:-1] = np.abs(np.diff(direction))
        before, after = np.roll(turn, 1), np.roll(turn, -1)
        return (turn > SHARPEST) & (np.maximum(before, after) < ANNOUNCED * turn)


def _blended(points: np.ndarray, length: np.ndarray | None, rate: np.ndarray) -> list[np.ndarray]:
    """The curve behind each point but the last one, up to the next; straight where nothing tells how it bends."""
    chords = np.diff(points, axis=0)
    t = np.linspace(0.0, 1.0, BETWEEN + 1)[1:, None]
    if not np.all(np.isfinite(points)) or not np.all(np.any(chords != 0.0, axis=1)):
        return [points[k] + t * chords[k] for k in range(len(chords))]     # as dense: legends keep off points
    rate = _all_rates(points, length, rate)
    pieces = []
    for k, chord in enumerate(chords):
        first, last = rate[k], rate[k + 1]
        known = [bool(np.all(np.isfinite(each))) for each in (first, last)]
        if not any(known):
            first = last = chord
        elif not all(known):        # a parabola
            way = chord @ (first if known[0] else last) / np.sum((first if known[0] else last)**2)
            first, last = (first, 2.0 * chord / way - first) if known[0] else (2.0 * chord / way - last, last)
        mean = 0.5 * (first + last)
        # Lengths of different meshes differ a little: the chord tells how long the piece is.
        way = chord @ mean / np.sum(mean**2) if np.any(mean != 0.0) else 0.0
        way = way if way > 0.0 else 0.0
        pieces.append(points[k] + chord * t**2 * (3.0 - 2.0 * t) + way * (t * (1.0 - t)**2 * first - t**2 * (1.0 - t) * last))
    return pieces


def _all_rates(points: np.ndarray, length: np.ndarray | None, rate: np.ndarray) -> np.ndarray:
    """Rates at every point over one length; NaN at ends where they are not known."""
    told = length is not None and np.all(np.isfinite(length)) and np.all(np.diff(length) > 0.0)
    if told:
        return np.where(np.isfinite(rate), rate, _parabolas(points, length))
    # Without it the tangents' directions stay.
    polygon = np.append(0.0, np.cumsum(np.hypot(*np.diff(points, axis=0).T)))
    found, both = _parabolas(points, polygon), np.all(np.isfinite(rate), axis=1)
    found[both] = rate[both] / np.hypot(*rate[both].T)[:, None]
    return found


def _parabolas(points: np.ndarray, length: np.ndarray) -> np.ndarray:
    """Rates of the parabolas through each point and its two neighbours; NaN at both ends."""
    found = np.full(points.shape, np.nan)
    step = np.diff(length)[:, None]
    slope = np.diff(points, axis=0) / step
    found[1:-1] = (slope[:-1] * step[1:] + slope[1:] * step[:-1]) / (step[:-1] + step[1:])
    return found

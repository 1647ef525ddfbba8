"""A smooth curve through computed points of a path: the program takes increments as long as it can, so points are few.

The direction at a point is about that of the circle through it and its two neighbours, so that equal steps of a circle
stay a circle; between two points the curve is the cubic with both directions. At corners each side has a direction of
its own, and none of the two knows of the other. Lengths are measured in the ranges of the two quantities, as they are
drawn.
"""

from __future__ import annotations

import numpy as np

BETWEEN = 12             # parts of the curve between two points
SHARPEST = np.pi / 18    # a turn beyond this that neither neighbour announces is a corner
ANNOUNCED = 0.25         # of the turn: what a neighbour on a smooth curve turns at least
ROUNDING = 1e-9          # of a quantity's size: what changes by less stands still


def through(x: np.ndarray, y: np.ndarray, corner: np.ndarray, smooth: np.ndarray,
            still: int | None = None, spans: tuple[float, float] = (0.0, 0.0)) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The curve, and where on it the points are: x, y, place, so that x[place] are the points.

    `corner`: where the path has a kink, such as at contact events; `smooth`: where it has none for sure, however it
    turns, such as at limit points, and where the quantity `still` (0: x, 1: y) stands still. Points without values
    break the curve. `spans`: of the picture along x and y; what is small beside them is small, as rounding is.
    """
    points = np.column_stack((x, y)).astype(float)
    known = np.all(np.isfinite(points), axis=1)
    scale = np.maximum(np.ptp(points[known], axis=0) if known.any() else np.ones(2), spans)
    if known.any():
        scale = np.maximum(scale, ROUNDING * np.max(np.abs(points[known]), axis=0))
    scaled = points / np.where(scale > 0.0, scale, 1.0)
    corner = corner | (_unannounced(scaled) & ~smooth)
    pieces, place, count = [], [0], 1
    cuts = [0, *(np.flatnonzero(corner[1:-1] | ~known[1:-1]) + 1), len(points) - 1]
    for first, last in zip(cuts, cuts[1:]):
        fixed = smooth[first:last + 1] if still is not None else np.zeros(last + 1 - first, dtype=bool)
        piece = _blended(scaled[first:last + 1], fixed, still == 0)
        pieces += piece
        for part in piece:
            count += len(part)
            place.append(count - 1)
    curve = np.concatenate([scaled[:1], *pieces])
    place = np.array(place)
    curve[place] = scaled
    return (*(curve * np.where(scale > 0.0, scale, 1.0)).T, place)


def _unannounced(points: np.ndarray) -> np.ndarray:
    """Where the polygon turns all of a sudden."""
    with np.errstate(invalid="ignore"):
        direction = np.unwrap(np.arctan2(*np.diff(points, axis=0).T[::-1]))
        turn = np.zeros(len(points))
        turn[1:-1] = np.abs(np.diff(direction))
        before, after = np.roll(turn, 1), np.roll(turn, -1)
        return (turn > SHARPEST) & (np.maximum(before, after) < ANNOUNCED * turn)


def _blended(points: np.ndarray, fixed: np.ndarray, upright: bool) -> list[np.ndarray]:
    """The curve behind each point but the last one, up to the next; a straight line where there are two points.

    Where it is `fixed` the direction is that of x, or of y when `upright`.
    """
    chords = np.diff(points, axis=0)
    t = np.linspace(0.0, 1.0, BETWEEN + 1)[1:, None]
    if len(points) < 3 or not np.all(np.isfinite(points)):
        return [points[k] + t * chords[k] for k in range(len(chords))]     # as dense: legends keep off points
    length = np.hypot(*chords.T)
    angle = np.unwrap(np.arctan2(chords[:, 1], chords[:, 0]))
    weight = length[1:] / np.maximum(length[:-1] + length[1:], np.finfo(float).tiny)
    at = np.empty(len(points))
    at[1:-1] = weight * angle[:-1] + (1.0 - weight) * angle[1:]
    quarter = np.pi / 2.0 if upright else 0.0
    at = np.where(fixed, quarter + np.pi * np.round((at - quarter) / np.pi), at)
    at[0], at[-1] = 2.0 * angle[0] - at[1], 2.0 * angle[-1] - at[-2]
    # A cubic that goes through the middle of a circle's arc of this turn has these end slopes.
    slope = length / np.cos(np.clip(np.diff(at), -np.pi, np.pi) / 4.0)**2
    tangent = np.column_stack((np.cos(at), np.sin(at)))
    return [points[k] + chords[k] * t**2 * (3.0 - 2.0 * t)
            + slope[k] * (t * (1.0 - t)**2 * tangent[k] - t**2 * (1.0 - t) * tangent[k + 1]) for k in range(len(chords))]

"""Surfaces of obstacles as far as a picture reaches, and the strokes that show their solid side."""

from __future__ import annotations

import numpy as np

from .types import Obstacle


def surfaces(obstacle: Obstacle, limits: np.ndarray, stretch: float = 1.0) -> list[tuple[np.ndarray, float]]:
    """Polylines (n, 2), and which side of each is solid: left (+1) or right (-1).

    `limits` (2, 2): lower left and upper right corner of the picture, which has y drawn `stretch` times larger.
    """
    if obstacle.kind == "soil":
        return []
    if obstacle.kind == "gap":
        unit = np.array((1.0, stretch))
        across = 0.02 * max((limits[1] - limits[0]) * unit) * np.array((obstacle.normal[1], -obstacle.normal[0])) / unit
        return [(np.vstack((stop - across, stop + across)), -1.0) for stop in obstacle.points]
    return [{"line": line_surface, "circle": circle_surface}.get(obstacle.kind, curve_surface)(obstacle, limits)]


def strokes(surface: np.ndarray, solid: float, unit: np.ndarray, size: float) -> np.ndarray:
    """Short strokes (n, 2, 2) into the solid side; `unit` (2): data to picture, `size`: of the picture, in its own units."""
    picture = surface * unit
    along = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(picture, axis=0).T))))
    spacing = along[-1] / max(round(along[-1] / (0.018 * size)), 1)
    at = np.arange(0.5 * spacing, along[-1], spacing)
    feet, tangent = (np.column_stack([np.interp(at, along, values[:, k]) for k in (0, 1)])
                     for values in (picture, np.gradient(picture, along, axis=0)))
    tangent /= np.hypot(*tangent.T)[:, None]
    inwards = solid * np.column_stack((-tangent[:, 1], tangent[:, 0]))
    tips = feet + 0.02 * size * (inwards - tangent)
    return np.stack((feet / unit, tips / unit), axis=1)


def line_surface(obstacle: Obstacle, limits: np.ndarray):
    """The line as far as the picture reaches, and the side (+1 left, -1 right) that is solid."""
    first, second = obstacle.points
    direction = (second - first) / np.hypot(*(second - first))
    reach = (corners(limits) - first) @ direction
    return first + np.outer((reach.min(), reach.max()), direction), -1.0


def curve_surface(obstacle: Obstacle, limits: np.ndarray):
    """The curve with its straight continuations as far as the picture reaches, unless its ends meet; its right side is solid."""
    surface = obstacle.surface
    if np.hypot(*(surface[-1] - surface[0])) < 1e-9 * np.max(np.ptp(surface, axis=0)):
        return surface, -1.0
    reach = np.hypot(*(limits[1] - limits[0])) + np.max(np.hypot(*(surface - limits.mean(axis=0)).T))
    ends = []
    for end, before in ((surface[0], surface[1]), (surface[-1], surface[-2])):
        direction = (end - before) / np.hypot(*(end - before))
        if obstacle.kind == "arc":      # the samples are chords, the continuation is a tangent
            arm = (end - obstacle.centre) / np.hypot(*(end - obstacle.centre))
            direction -= (direction @ arm) * arm
        ends.append(end + reach * direction / np.hypot(*direction))
    return np.vstack((ends[0], surface, ends[1])), -1.0


def circle_surface(obstacle: Obstacle, limits: np.ndarray):
    """The circle, or of one much larger than the picture the arc before it; and its solid side."""
    span = np.array((0.0, 2.0 * np.pi))
    if obstacle.radius > 3.0 * max(limits[1] - limits[0]):
        arms = corners(limits) - obstacle.centre
        middle = np.arctan2(*arms.mean(axis=0)[::-1])
        angles = (np.arctan2(arms[:, 1], arms[:, 0]) - middle + np.pi) % (2.0 * np.pi) - np.pi
        span = middle + np.array((angles.min(), angles.max()))
    angle = np.linspace(*span, 721)
    points = obstacle.centre + obstacle.radius * np.column_stack((np.cos(angle), np.sin(angle)))
    return points, 1.0 if obstacle.side == "outside" else -1.0


def corners(limits: np.ndarray) -> np.ndarray:
    return np.array([(x, y) for x in limits[:, 0] for y in limits[:, 1]])

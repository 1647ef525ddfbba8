"""Section forces between the ends of elements, where the result file has them.

Between its ends an element is in equilibrium. The force on the cut goes from that of one end to that of the other as under a
load that is uniform along the axis; N and Q are its parts along the axis, which turns on the way, and M is what that force
does on its way along the deformed axis. Without distributed load this is exact for the drawn axis. What M then lacks at the
second end, as from a load that is not uniform, is spread evenly.
"""

from __future__ import annotations

import numpy as np

from .rod_shape import Shape
from .types import Path


def shape_at(path: Path, point: int) -> Shape | None:
    """The deformed rods at a point of the path; None where displacements are not stored."""
    stored = "displacement" in path.field_names and point in path.points_with("displacement")
    return Shape(path.mesh, path.field("displacement", point)) if stored else None


def between_ends(shape: Shape | None, forces: np.ndarray, parts: int) -> np.ndarray:
    """N, Q, M (elements, parts + 1, 3) at equal distances along every element, of those (elements, 2, 3) at both ends.

    Without a shape they are joined by straight lines.
    """
    t = np.linspace(0.0, 1.0, 2 * parts + 1)                # middles of the parts, too, for Simpson's rule
    if shape is None:
        return forces[:, :1] + t[::2, None] * (forces[:, 1:] - forces[:, :1])
    rate = shape.motion(t)[1]
    speed = np.hypot(rate[..., 0], rate[..., 1])[..., None]
    along = rate / np.where(speed > 0.0, speed, 1.0)
    across = np.stack((-along[..., 1], along[..., 0]), axis=-1)
    ends = forces[:, :, :1] * along[:, [0, -1]] + forces[:, :, 1:2] * across[:, [0, -1]]
    force = ends[:, :1] + t[:, None] * (ends[:, 1:] - ends[:, :1])
    lever = rate[..., 0] * force[..., 1] - rate[..., 1] * force[..., 0]
    parts_of_moment = (lever[:, :-1:2] + 4.0 * lever[:, 1::2] + lever[:, 2::2]) / (6.0 * parts)
    moment = forces[:, :1, 2] - np.concatenate((np.zeros((len(forces), 1)), np.cumsum(parts_of_moment, axis=1)), axis=1)
    moment += t[::2] * (forces[:, 1:, 2] - moment[:, -1:])
    return np.stack((np.sum(force * along, axis=-1)[:, ::2], np.sum(force * across, axis=-1)[:, ::2], moment), axis=-1)

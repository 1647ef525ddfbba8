"""Obstacles in pictures of shapes."""

from __future__ import annotations

import numpy as np
from matplotlib.collections import LineCollection

from ..results import Obstacle
from ..results.obstacle_surface import strokes, surfaces
from . import style


def draw_obstacle(axes, obstacle: Obstacle, limits: np.ndarray, stretch: float, colour=style.INK, hatched: bool = True):
    """The surface as a line, its solid side hatched with short strokes."""
    unit = np.array((1.0, stretch))     # data to picture
    size = max((limits[1] - limits[0]) * unit)
    for surface, solid in surfaces(obstacle, limits, stretch):
        _draw_surface(axes, surface, solid, unit, size, colour, hatched)


def _draw_surface(axes, surface: np.ndarray, solid: float, unit: np.ndarray, size: float, colour, hatched: bool):
    """A line with strokes on its solid side: left (+1) or right (-1)."""
    axes.plot(*surface.T, color=colour, linewidth=0.9, zorder=1.5, solid_capstyle="butt")
    if hatched:
        axes.add_collection(LineCollection(strokes(surface, solid, unit, size), colors=[colour], linewidths=0.45, zorder=1),
                            autolim=False)

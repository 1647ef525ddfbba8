"""Arrows, bands and their values in pictures of shapes."""

from __future__ import annotations

import matplotlib.patheffects as patheffects
import numpy as np
from matplotlib.patches import FancyArrowPatch, Polygon

from ..results.force_glyphs import Glyphs, value_text
from ..results.mirror import mirrored
from . import style

MOST_VALUES = 8     # more arrows than this have values at the largest ones only


def draw_glyphs(axes, glyphs: Glyphs, colour: str = style.CONTACT, mirror=None, values: bool = True, layer: float = 6.5):
    """Draws forces and pressures with their values."""
    for band in glyphs.bands:
        for outline in mirrored([band.outline], mirror):
            axes.add_patch(Polygon(outline, closed=True, facecolor=colour, edgecolor=colour, alpha=0.28, linewidth=0.6,
                                   zorder=layer - 3.0))
        if values:
            write(axes, band.top, band.foot, band.value, colour, layer)
    for arrow in glyphs.arrows:
        for tail, tip in mirrored([np.vstack((arrow.tail, arrow.tip))], mirror):
            draw_arrow(axes, tail, tip, colour, layer)
    if values:
        for arrow in sorted(glyphs.arrows, key=lambda arrow: -arrow.value)[:MOST_VALUES]:
            write(axes, arrow.tail, arrow.tip, arrow.value, colour, layer)


def draw_arrow(axes, tail, tip, colour: str, layer: float = 6.5, width: float = 1.1, head: float = 7.0, style_of: str = "-|>"):
    """An arrow between two places of the picture."""
    axes.add_patch(FancyArrowPatch(tail, tip, arrowstyle=style_of, mutation_scale=head, color=colour, linewidth=width, shrinkA=0.0,
                                   shrinkB=0.0, zorder=layer, clip_on=True, joinstyle="miter"))


def write(axes, place: np.ndarray, away_from: np.ndarray, value: float | str, colour: str, layer: float):
    """A value beside the tail of an arrow, on the far side of what it acts on."""
    # A stretched picture has other directions than the data.
    stretch = 1.0 if axes.get_aspect() == "auto" else float(axes.get_aspect())
    away = (np.asarray(place) - away_from) * (1.0, stretch)
    away = away / (np.hypot(*away) or 1.0)
    text = value if isinstance(value, str) else value_text(value)
    beside = abs(away[0]) > 0.8
    note = axes.annotate(text, place, xytext=(away[0] * (3.0 if beside else 3.0 + 2.0 * len(text)), 6.0 * away[1]),
                         textcoords="offset points", ha="center" if not beside else "left" if away[0] > 0.0 else "right", va="center", fontsize=7.5, color=colour, zorder=layer + 1.0, annotation_clip=True)
    note.set_path_effects([patheffects.withStroke(linewidth=1.6, foreground="white")])
    note.set_in_layout(False)


__all__ = ["draw_arrow", "draw_glyphs", "write"]

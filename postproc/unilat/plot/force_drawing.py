"""Arrows, bands and their values in pictures of shapes."""

from __future__ import annotations

import matplotlib.patheffects as patheffects
import numpy as np
from matplotlib.patches import FancyArrowPatch, Polygon

from ..results.force_glyphs import Arrow, Glyphs, value_text
from ..results.mirror import mirrored
from . import style

BESIDE = 0.1        # of the picture's size: arrows closer than this have values in rows
ROW = 8.5           # [pt] of these
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
        for arrow, text, level in named(glyphs):
            write(axes, arrow.tail, arrow.tip, text, colour, layer, level)


def named(glyphs: Glyphs) -> list[tuple[Arrow, str, int]]:
    """The largest arrows with their values; side by side the same one is written once, others in rows: 0, 1, ..."""
    found: list[list] = []
    for arrow in sorted(glyphs.arrows, key=lambda arrow: -arrow.value)[:MOST_VALUES]:
        text, level = value_text(arrow.value), 0
        for other in found:
            if np.hypot(*((arrow.tail - other[0].tail) * (1.0, glyphs.stretch))) < BESIDE * glyphs.size:
                if text == other[1]:
                    other[3] += 1
                    break
                level = max(level, other[2] + 1)
        else:
            found.append([arrow, text, level, 1])
    return [(arrow, text if n == 1 else f"{n} \N{MULTIPLICATION SIGN} {text}", level) for arrow, text, level, n in found]


def draw_arrow(axes, tail, tip, colour: str, layer: float = 6.5, width: float = 1.1, head: float = 7.0, style_of: str = "-|>"):
    """An arrow between two places of the picture."""
    axes.add_patch(FancyArrowPatch(tail, tip, arrowstyle=style_of, mutation_scale=head, color=colour, linewidth=width, shrinkA=0.0,
                                   shrinkB=0.0, zorder=layer, clip_on=True, joinstyle="miter"))


def write(axes, place: np.ndarray, away_from: np.ndarray, value: float | str, colour: str, layer: float, level: int = 0):
    """A value beside the tail of an arrow, on the far side of what it acts on."""
    # A stretched picture has other directions than the data.
    stretch = 1.0 if axes.get_aspect() == "auto" else float(axes.get_aspect())
    away = (np.asarray(place) - away_from) * (1.0, stretch)
    away = away / (np.hypot(*away) or 1.0)
    text = value if isinstance(value, str) else value_text(value)
    beside = abs(away[0]) > 0.8
    note = axes.annotate(text, place, xytext=(away[0] * (3.0 if beside else 3.0 + 2.0 * len(text)), 6.0 * away[1] +
                                                np.copysign(ROW * level, away[1])),
                         textcoords="offset points", ha="center" if not beside else "left" if away[0] > 0.0 else "right", va="center", fontsize=7.5, color=colour, zorder=layer + 1.0, annotation_clip=True)
    note.set_path_effects([patheffects.withStroke(linewidth=1.6, foreground="white")])
    note.set_in_layout(False)


__all__ = ["draw_arrow", "draw_glyphs", "write"]

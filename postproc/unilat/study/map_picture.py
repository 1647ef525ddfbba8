"""The picture of a map: a coloured field for each cell with the power of ten of its error."""

from __future__ import annotations

import math

from matplotlib.patches import Patch, Rectangle

from ..captions import escape
from ..plot import style
from .map_file import Map
from .map_table import Cell
from .verdict import CLASSES

FILL = {"right": "#7fc8ac", "told": "#f3d27a", "stopped": "#d0d0d0", "untold": "#e8965a", "wrong": "#d6452b", "missing": "#ffffff"}
CELL = 8.5          # [mm]
NARROWEST = 62.0    # [mm] a picture: the legend and an axis label must have room
ENTRY, ROW = 21.0, 4.5      # [mm] of the legend


@style.drawing
def draw_map(checked: Map, rows: list[Cell], filename: str):
    x, y = checked.look["x"], checked.look["y"]
    columns, lines = (list(dict.fromkeys(cell.values[name] for cell in rows)) for name in (x, y))
    legend = [Patch(facecolor=FILL[name], label=f"{sum(cell.verdict == name for cell in rows)} {name}") for name in CLASSES
              if name != "untold" or any(cell.verdict == name for cell in rows)]
    width = max(30.0 + CELL * len(columns), NARROWEST)
    across = max(1, min(len(legend), int(width / ENTRY)))
    above, below = ROW * (1 - (-len(legend) // across)), 22.0 + CELL * len(lines)
    figure = style.new_figure(width, above + below, 200.0, constrained_layout=True)
    head, axes = figure.subplots(2, 1, gridspec_kw={"height_ratios": (above, below)})
    head.set_axis_off()
    head.legend(handles=legend, loc="center", ncol=across, frameon=False, handlelength=1.0, columnspacing=1.0, borderaxespad=0.0,
                borderpad=0.0, title="cells: power of ten of the error", title_fontsize=8.5)
    for cell in rows:
        column, line = columns.index(cell.values[x]), lines.index(cell.values[y])
        axes.add_patch(Rectangle((column - 0.5, line - 0.5), 1.0, 1.0, facecolor=FILL[cell.verdict], edgecolor="white", linewidth=0.8))
        axes.text(column, line, _power(cell), ha="center", va="center", fontsize=6.5,
                  color="white" if cell.verdict == "wrong" else style.INK)
    axes.set(xlim=(-0.5, len(columns) - 0.5), ylim=(-0.5, len(lines) - 0.5), xlabel=_label(checked.look, "x"),
             ylabel=_label(checked.look, "y"))
    axes.set_xticks(range(len(columns)), [_short(value) for value in columns], rotation=90 if len(columns) > 8 else 0)
    axes.set_yticks(range(len(lines)), [_short(value) for value in lines])
    axes.tick_params(which="both", length=0)
    axes.minorticks_off()
    style.lay_out(figure)
    figure.savefig(filename)


def _power(cell: Cell) -> str:
    """The error as a power of ten; nothing where there is no value."""
    if math.isnan(cell.error):
        return ""
    return f"{round(math.log10(max(cell.error, 1e-16)))}".replace("-", "\N{MINUS SIGN}")


def _label(look: dict, axis: str) -> str:
    return look.get(f"{axis}_label", escape(look[axis].replace("_", " ")))


def _short(value) -> str:
    return f"{value:g}" if isinstance(value, (int, float)) else str(value)

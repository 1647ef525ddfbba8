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


@style.drawing
def draw_map(checked: Map, rows: list[Cell], filename: str):
    x, y = checked.look["x"], checked.look["y"]
    columns, lines = (list(dict.fromkeys(cell.values[name] for cell in rows)) for name in (x, y))
    figure = style.new_figure(30.0 + CELL * len(columns), 26.0 + CELL * len(lines), 200.0, constrained_layout=True)
    axes = figure.add_subplot()
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
    legend = [Patch(facecolor=FILL[name], label=f"{sum(cell.verdict == name for cell in rows)} {name}") for name in CLASSES
              if name != "untold" or any(cell.verdict == name for cell in rows)]
    axes.legend(handles=legend, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncol=len(legend), frameon=False, handlelength=1.0,
                columnspacing=1.0)
    style.lay_out(figure)
    figure.savefig(filename)


def _power(cell: Cell) -> str:
    """The error as a power of ten; nothing where there is no value."""
    if math.isnan(cell.error):
        return ""
    return f"{math.log10(max(cell.error, 1e-16)):.0f}"


def _label(look: dict, axis: str) -> str:
    return look.get(f"{axis}_label", escape(look[axis].replace("_", " ")))


def _short(value) -> str:
    return f"{value:g}" if isinstance(value, (int, float)) else str(value)

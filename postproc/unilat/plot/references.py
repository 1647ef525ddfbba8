"""Reference curves from CSV files in a picture."""

from __future__ import annotations

import os

import numpy as np
from matplotlib.lines import Line2D

from ..captions import escape
from ..options import Parser, nonzero
from ..results import ResultsError
from ..results.reference_table import read_table
from .style import label_text


def add_reference(parser: Parser):
    group = parser.add_argument_group("reference curve from a CSV file ('#' lines are comments)")
    group.add_argument("--reference", action="append", default=[], metavar="FILE", help="CSV file (may be repeated)")
    group.add_argument("--ref-x", metavar="COLUMN", help="its column for x")
    group.add_argument("--ref-y", metavar="COLUMN", help="its column for y")
    group.add_argument("--ref-x-scale", type=nonzero, default=1.0, metavar="F", help="factor on its x")
    group.add_argument("--ref-y-scale", type=nonzero, default=1.0, metavar="F", help="factor on its y")
    group.add_argument("--ref-name", action="append", default=[], type=label_text, metavar="TEXT",
                       help="its name in the legend (default: file name)")
    group.add_argument("--ref-style", choices=("line", "points"),
                       help="how it is drawn (default: points up to 25 rows, else a line)")


def draw_references(axes, args) -> list[Line2D]:
    """The reference curves behind the results; their legend entries."""
    if not args.reference:
        if args.ref_x or args.ref_y:
            raise ResultsError("--ref-x and --ref-y need --reference")
        return []
    if not (args.ref_x and args.ref_y):
        raise ResultsError("--reference needs --ref-x and --ref-y")
    handles = []
    for k, filename in enumerate(args.reference):
        x, y = read_table(filename, args.ref_x, args.ref_y)
        if not np.any(np.isfinite(x + y)):
            raise ResultsError(f"{filename}: columns '{args.ref_x}' and '{args.ref_y}' share no numbers")
        style = args.ref_style or ("points" if len(x) <= 25 else "line")
        name = args.ref_name[k] if k < len(args.ref_name) else escape(os.path.splitext(os.path.basename(filename))[0])
        shade = ("#b5b5b5", "#7d7d7d", "#d2d2d2")[k % 3]
        look = ({"color": shade, "linewidth": 3.2, "linestyle": "-", "solid_capstyle": "butt"} if style == "line"
                else {"color": "#555555", "linestyle": "none", "marker": "osD"[k % 3], "markerfacecolor": "white",
                      "markersize": 4.2, "markeredgewidth": 0.8})
        handles += axes.plot(args.ref_x_scale * x, args.ref_y_scale * y, zorder=2 if style == "line" else 4,
                             label=name, **look)
    return handles

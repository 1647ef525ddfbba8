"""How pictures look: size, fonts, colours, axes; and how they are written."""

from __future__ import annotations

import argparse
import functools
import os

import matplotlib
import matplotlib.patheffects as patheffects
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.mathtext import MathTextParser
from matplotlib.ticker import ScalarFormatter

from .. import options
from ..captions import escape
from ..options import Parser, nonzero, positive
from ..results import Results, ResultsError

# Okabe and Ito's colours without the pale ones, and four dark ones that lie as far from them, as seen with normal vision
# and without each of the three kinds of cones (CIEDE2000 difference of any two: 10 at least).
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#882200", "#0000AA", "#774466", "#441144")
INK = "#1a1a1a"
REFERENCE = "#9a9a9a"
CONTACT = "#D55E00"
FORMATS = ("png", "pdf", "svg")
HINGE = {"marker": "o", "markersize": 3.6, "markerfacecolor": "white", "markeredgewidth": 0.9, "linestyle": "none"}
STRESS_FREE = {"color": "#666666", "linewidth": 0.6, "linestyle": (0, (5, 3))}
ENTRY, LETTER = 24.0, 1.35      # [mm] a legend entry at least, one of its letters
MILLIMETRE = 1.0 / 25.4    # inches
# Serif text of paper size, thin lines; the same bytes for the same data.
LOOK = {
    "font.family": ["STIXGeneral", "DejaVu Sans"], "mathtext.fontset": "stix", "font.size": 9.0,
    "axes.labelsize": 9.5, "axes.titlesize": 9.5, "xtick.labelsize": 8.5, "ytick.labelsize": 8.5,
    "legend.fontsize": 8.5, "axes.linewidth": 0.6, "lines.linewidth": 1.2, "lines.markersize": 4.0,
    "axes.edgecolor": INK, "axes.labelcolor": INK, "text.color": INK, "xtick.color": INK, "ytick.color": INK,
    "xtick.direction": "in", "ytick.direction": "in", "xtick.top": True, "ytick.right": True,
    "xtick.minor.visible": True, "ytick.minor.visible": True, "xtick.major.width": 0.6, "ytick.major.width": 0.6,
    "xtick.minor.width": 0.4, "ytick.minor.width": 0.4, "xtick.major.size": 3.5, "ytick.major.size": 3.5,
    "xtick.minor.size": 1.8, "ytick.minor.size": 1.8, "legend.facecolor": "white", "legend.edgecolor": "none",
    "legend.framealpha": 0.8, "legend.handlelength": 2.4, "legend.borderaxespad": 0.4, "legend.labelspacing": 0.35,
    "axes.xmargin": 0.03, "axes.ymargin": 0.05,
    "axes.formatter.useoffset": False, "axes.formatter.limits": (-3, 5), "axes.formatter.use_mathtext": True,
    "pdf.fonttype": 42, "svg.hashsalt": "unilat", "path.simplify_threshold": 0.05,
}


def add_files(parser: Parser):
    options.add_files(parser)
    parser.add_argument("--name", action="append", default=[], type=label_text, metavar="TEXT",
                        help="name of a result file in the legend, once per file in their order (default: file name)")


def add_output(parser: Parser, width: float, height: float | None):
    shape = f"{height:g}" if height else "to fit"
    group = parser.add_argument_group("picture")
    group.add_argument("-o", "--output", metavar="FILE",
                       help="picture to write, .png, .pdf or .svg (default: named after the first result file, "
                            "in the current folder)")
    group.add_argument("--format", choices=FORMATS, help="kind of picture (default: by the ending, else png)")
    group.add_argument("--width", type=positive, default=width, metavar="MM",
                       help=f"width in millimetres (default {width:g})")
    group.add_argument("--height", type=positive, default=height, metavar="MM",
                       help=f"height in millimetres (default {shape})")
    group.add_argument("--dpi", type=positive, default=300.0, help="resolution of a PNG (default 300)")
    group.add_argument("--title", type=label_text, metavar="TEXT", help="title over the picture (default: none)")


def add_axes(parser: Parser, scales: bool = True):
    group = parser.add_argument_group("axes")
    for axis in "xy":
        if scales:
            group.add_argument(f"--{axis}-scale", type=nonzero, default=1.0, metavar="F", help=f"factor on {axis}")
        group.add_argument(f"--{axis}-label", type=label_text, metavar="TEXT",
                           help=f"label of the {axis} axis; $...$ is mathematics")
        group.add_argument(f"--{axis}-range", type=float, nargs=2, metavar=("FROM", "TO"),
                           help=f"range of the {axis} axis")


def label_text(text: str) -> str:
    """Text for the picture, its mathematics checked before anything is drawn."""
    try:
        if text.count("$") >= 2:
            MathTextParser("path").parse(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"the mathematics in '{text}' is not well-formed") from None
    return text


def names(args, everything: list[Results]) -> list[str]:
    """Legend names of the result files."""
    given = [escape(os.path.splitext(os.path.basename(r.filename))[0]) for r in everything]
    given[:len(args.name)] = args.name[:len(given)]
    return given


def look(number: int) -> dict:
    """How the curve with this number is drawn, from 0: a colour each; when they are used up, once more as hollow lines."""
    colour = {"color": COLOURS[number % len(COLOURS)]}
    if number % (2 * len(COLOURS)) < len(COLOURS):
        return colour
    return colour | {"path_effects": [patheffects.Stroke(linewidth=2.2),
                                      patheffects.Stroke(linewidth=0.8, foreground="white")]}


def drawing(function):
    """Makes a function draw with the look of this module, whatever matplotlib is set to."""
    @functools.wraps(function)
    def drawn(*arguments):
        with matplotlib.rc_context(LOOK):
            return function(*arguments)
    return drawn


def new_figure(width: float, height: float, dpi: float, **options) -> Figure:
    """An empty figure of this size [mm], on no screen."""
    figure = Figure(figsize=(width * MILLIMETRE, height * MILLIMETRE), dpi=dpi, **options)
    FigureCanvasAgg(figure)
    return figure


def new_axes(args):
    """A figure of the wanted size and its axes."""
    figure = new_figure(args.width, args.height, args.dpi, constrained_layout=True)
    return figure, figure.add_subplot()


class Numbers(ScalarFormatter):
    """Numbers at an axis as text: matplotlib sets each as mathematics, which takes a tenth of the time of a picture, where only the
    power of ten beside the axis needs it."""

    def __init__(self):
        super().__init__(useMathText=False)

    def get_offset(self) -> str:
        self.set_useMathText(True)
        try:
            return super().get_offset()
        finally:
            self.set_useMathText(False)


def lay_out(figure):
    """Gives axes and their labels their places for good; matplotlib would find them anew, and draw twice, when it saves."""
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            if type(axis.get_major_formatter()) is ScalarFormatter:
                axis.set_major_formatter(Numbers())
    engine = figure.get_layout_engine() if hasattr(figure, "get_layout_engine") else None     # matplotlib 3.6
    if engine is not None:
        engine.execute(figure)
        figure.set_layout_engine(None)


def save(figure, args, everything: list[Results], ending: str, unfinished: bool = True) -> int:
    """Write the picture and say so; the exit code of the script."""
    stem = os.path.splitext(os.path.basename(everything[0].filename))[0]
    output = args.output or f"{stem}-{ending}.{args.format or 'png'}"
    kind = args.format or os.path.splitext(output)[1].lstrip(".").lower()
    if kind not in FORMATS:
        raise ResultsError(f"{output}: the picture must end in .png, .pdf or .svg, or give --format")
    undated = {"png": None, "pdf": {"CreationDate": None}, "svg": {"Date": None}}[kind]
    lay_out(figure)
    try:
        figure.savefig(output, format=kind, metadata=undated)
    except OSError as problem:
        raise ResultsError(f"{output}: cannot be written: {problem.strerror or problem}") from problem
    print(f"wrote {output}")
    if unfinished:
        options.tell_unfinished(everything)
    return 0


def finish_axes(axes, args, x_label: str, y_label: str):
    axes.set_xlabel(args.x_label or x_label)
    axes.set_ylabel(args.y_label or y_label)
    if args.x_range:
        axes.set_xlim(args.x_range)
    if args.y_range:
        axes.set_ylim(args.y_range)
    if args.title:
        axes.set_title(args.title)


def entry_width(texts: list[str]) -> float:
    """Width [mm] of a column of legend entries."""
    return max(ENTRY, LETTER * max(map(len, texts), default=0) + 9.0)


def legend(axes, handles, **options):
    """A legend, when there is something to tell apart."""
    if handles:
        axes.legend(handles=handles, **options)

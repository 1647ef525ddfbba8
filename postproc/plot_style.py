"""What the plot scripts share: look, command line, output, curves along a path and their marks."""

from __future__ import annotations

import argparse
import os
import re
import sys

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt  # noqa: E402  (the backend comes first)
import matplotlib.patheffects as patheffects  # noqa: E402
import numpy as np  # noqa: E402
from matplotlib.lines import Line2D  # noqa: E402
from matplotlib.mathtext import MathTextParser  # noqa: E402

from reference_table import read_table  # noqa: E402
from unilat_results import Column, Critical, LimitCurve, Path, Results, ResultsError, read_results  # noqa: E402

# Okabe and Ito's colours without the pale ones, and four dark ones that lie as far from them, as seen with normal vision
# and without each of the three kinds of cones (CIEDE2000 difference of any two: 10 at least).
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#882200", "#0000AA", "#774466", "#441144")
INK = "#1a1a1a"
REFERENCE = "#9a9a9a"
CONTACT = "#D55E00"
FORMATS = ("png", "pdf", "svg")
MARKERS = {"LP": "o", "BP": "D", "TP": "p", "C+": "^", "C-": "v", "UZ": "x", "EP": "s"}
UNSTABLE = (0, (4.5, 1.8))
STRESS_FREE = {"color": "#666666", "linewidth": 0.6, "linestyle": (0, (5, 3))}
WORDS = {"degree": "degrees", "radian": "radians", "second": "seconds"}
MILLIMETRE = 1.0 / 25.4    # inches
MOST_LABELS = 8            # more points of one kind than this are marked without text


class Parser(argparse.ArgumentParser):
    """An argument parser whose errors are one line."""

    def __init__(self, **options):
        super().__init__(formatter_class=argparse.RawDescriptionHelpFormatter, **options)
        self._negative_number_matcher = re.compile(r"^-\.?\d")     # lists such as -1,3 are no options

    def error(self, message):
        self.exit(2, f"{self.prog}: error: {message} (see --help)\n")


def run(main):
    """Run a script's main; wrong input ends in one line and exit code 2."""
    try:
        sys.exit(main())
    except ResultsError as problem:
        sys.exit(complain(problem))


def complain(problem: Exception) -> int:
    print(f"{os.path.basename(sys.argv[0])}: error: {problem}", file=sys.stderr)
    return 2


def add_files(parser: Parser):
    parser.add_argument("files", nargs="+", metavar="RESULTS", help="result file(s) of unilat (HDF5)")
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


def add_marks(parser: Parser, default: str):
    parser.add_argument("--mark", metavar="LABELS", type=mark_list, default=mark_list(default),
                        help=f"critical points to mark: some of {','.join(MARKERS)}, or all, or none "
                             f"(default {default}); hollow: bracketed, not located")


def positive(text: str) -> float:
    value = float(text)
    if not 0.0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text} is not a positive number")
    return value


def nonzero(text: str) -> float:
    value = float(text)
    if value == 0.0 or not np.isfinite(value):
        raise argparse.ArgumentTypeError("a factor must be a number other than zero")
    return value


def label_text(text: str) -> str:
    """Text for the picture, its mathematics checked before anything is drawn."""
    try:
        if text.count("$") >= 2:
            MathTextParser("path").parse(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"the mathematics in '{text}' is not well-formed") from None
    return text


def mark_list(text: str) -> list[str]:
    words = [word.strip().upper() for word in text.split(",") if word.strip()]
    if words == ["ALL"]:
        return list(MARKERS)
    if words == ["NONE"]:
        return []
    unknown = [word for word in words if word not in MARKERS]
    if unknown:
        raise argparse.ArgumentTypeError(f"unknown label {unknown[0]} (known: {', '.join(MARKERS)}, all, none)")
    return words


def load(args, points: bool = True) -> list[Results]:
    """Read every result file; each must hold a point, unless `points` are not asked for."""
    everything = [read_results(name) for name in args.files]
    for results in everything:
        if points and results.n_points == 0:
            raise ResultsError(f"{results.filename}: holds no points yet (status: {results.status})")
    return everything


def names(args, everything: list[Results]) -> list[str]:
    """Legend names of the result files."""
    given = [escape(os.path.splitext(os.path.basename(r.filename))[0]) for r in everything]
    given[:len(args.name)] = args.name[:len(given)]
    return given


def numbers(results: Path | LimitCurve, name: str) -> Column:
    """A quantity that can be drawn."""
    column = results.column(name)
    if column.values.dtype.kind not in "biuf":
        raise ResultsError(f"{results.filename}: '{name}' is text, not numbers")
    return column


def critical_value(results: Path, critical: Critical, column: Column) -> float:
    """The quantity at a critical point; NaN when the file does not tell."""
    if 1 <= critical.point <= results.n_points:
        return float(column.values[critical.point - 1])
    if column.name == "load_factor":
        return critical.load_factor
    return critical.monitors.get(column.name, float("nan"))


# The picture


def look(number: int) -> dict:
    """How the curve with this number is drawn, from 0: a colour each; when they are used up, once more as hollow lines."""
    colour = {"color": COLOURS[number % len(COLOURS)]}
    if number % (2 * len(COLOURS)) < len(COLOURS):
        return colour
    return colour | {"path_effects": [patheffects.Stroke(linewidth=2.2),
                                      patheffects.Stroke(linewidth=0.8, foreground="white")]}


def set_look():
    """Serif text of paper size, thin lines; the same bytes for the same data."""
    plt.rcParams.update({
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
    })


def new_figure(args, height: float, **options):
    """A figure of the wanted size; `height` [mm] is used when none was given."""
    set_look()
    size = (args.width * MILLIMETRE, (args.height or height) * MILLIMETRE)
    return plt.subplots(figsize=size, dpi=args.dpi, constrained_layout=True, **options)


def save(figure, args, everything: list[Results], ending: str) -> int:
    """Write the picture and say so; the exit code of the script."""
    stem = os.path.splitext(os.path.basename(everything[0].filename))[0]
    output = args.output or f"{stem}-{ending}.{args.format or 'png'}"
    kind = args.format or os.path.splitext(output)[1].lstrip(".").lower()
    if kind not in FORMATS:
        raise ResultsError(f"{output}: the picture must end in .png, .pdf or .svg, or give --format")
    undated = {"png": None, "pdf": {"CreationDate": None}, "svg": {"Date": None}}[kind]
    try:
        figure.savefig(output, format=kind, metadata=undated)
    except OSError as problem:
        raise ResultsError(f"{output}: cannot be written: {problem.strerror or problem}") from problem
    finally:
        plt.close(figure)
    print(f"wrote {output}")
    for results in everything:
        if not results.complete:
            print(f"note: {results.filename} has {results.n_points} points, status: {results.status or 'unknown'}")
    return 0


def escape(text: str) -> str:
    """Text from a file as it is: no mathematics."""
    return text.replace("$", r"\$")


def column_label(column: Column, scale: float = 1.0) -> str:
    """Axis label of a quantity: its name and its units in words."""
    name = escape(column.name if column.units != "1" or "_" not in column.name else column.name.replace("_", " "))
    units = "" if column.units.startswith("scaled ") else column.units.strip()     # by a factor of the deck
    factor = "" if scale == 1.0 else f"{scale:g} × "
    return factor + name + ("" if units in ("", "1") else f" ({escape(WORDS.get(units, units))})")


def finish_axes(axes, args, x_label: str, y_label: str):
    axes.set_xlabel(args.x_label or x_label)
    axes.set_ylabel(args.y_label or y_label)
    if args.x_range:
        axes.set_xlim(args.x_range)
    if args.y_range:
        axes.set_ylim(args.y_range)
    if args.title:
        axes.set_title(args.title)


def stretches(results: Path, breaks: bool) -> list[tuple[np.ndarray, bool]]:
    """The path cut into rows of one stability: (rows, stable), neighbours sharing their end row.

    The part between two points is stable when both have no negative pivot. A located limit or bifurcation point is
    itself singular, so there the other point decides. With `breaks` steps are not joined (the load factor starts
    again).
    """
    n = results.n_points
    pivots = results.path["negative_pivots"].values if "negative_pivots" in results.path else np.zeros(n, dtype=int)
    steps = results.path["step"].values if "step" in results.path else np.ones(n, dtype=int)
    labels = results.path["label"].values if "label" in results.path else np.full(n, "")
    negative, singular = pivots > 0, np.isin(labels, ("LP", "BP"))
    pieces: list[tuple[list[int], bool]] = []
    for row in range(n - 1):
        ends = [k for k in (row, row + 1) if not singular[k]] or [row, row + 1]
        stable = not any(negative[k] for k in ends)
        if breaks and steps[row + 1] != steps[row]:
            continue
        if pieces and pieces[-1][1] == stable and pieces[-1][0][-1] == row:
            pieces[-1][0].append(row + 1)
        else:
            pieces.append(([row, row + 1], stable))
    return [(np.array(rows), stable) for rows, stable in pieces]


def draw_path(axes, results: Path, x: np.ndarray, y: np.ndarray, line: dict, breaks: bool, first: int = 0,
              root: tuple[float, float] | None = None) -> bool:
    """A curve along the path, stable parts solid, unstable ones dashed; True when there is an unstable part.

    `line` says how it is drawn otherwise (see look). `first` is the row of x[0]: the curve may be there for a part of
    the path only. `root` is where a branch leaves the other path; what joins it to x[0] is as stable as the first part
    of the branch.
    """
    last, unstable = first + len(x) - 1, False
    if root is not None:
        pieces = stretches(results, breaks)
        stable = pieces[0][1] if pieces else "negative_pivots" not in results.path or \
            not results.path["negative_pivots"].values[0] > 0
        axes.plot((root[0], x[0]), (root[1], y[0]), linestyle="-" if stable else UNSTABLE, zorder=3, **line,
                  solid_capstyle="round", dash_capstyle="butt")
        unstable = not stable
    for rows, stable in stretches(results, breaks):
        rows = rows[(rows >= first) & (rows <= last)] - first
        if rows.size < 2 or not np.any(np.isfinite(x[rows] + y[rows])):
            continue
        unstable = unstable or not stable
        axes.plot(x[rows], y[rows], linestyle="-" if stable else UNSTABLE, zorder=3, **line,
                  solid_capstyle="round", dash_capstyle="butt")
    if len(x) == 1 and root is None:
        axes.plot(x, y, marker=".", zorder=3, **line)
    return unstable


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


def draw_marks(axes, results: Path, wanted: list[str], place, colour: str, value_of=None) -> list[tuple]:
    """Mark critical points; `place(critical)` gives (x, y). The labels still to be placed: (x, y, text, colour).

    `value_of(critical)` gives the number to write beside a label, None for no number.
    """
    texts = []
    for label in wanted:
        points = [critical for critical in results.critical if critical.label == label]
        dense = len(points) > MOST_LABELS
        for critical in points:
            x, y = place(critical)
            if not np.isfinite(x + y):
                continue
            size = 2.4 if dense else 3.8
            face = colour if critical.located else "white"
            axes.plot(x, y, marker=MARKERS[label], markersize=size, color=colour, markerfacecolor=face,
                      markeredgewidth=0.5 if dense else 0.9, linestyle="none", zorder=6)
            if not dense:
                value = value_of(critical) if value_of else None
                text = label if value is None else f"{label} {value:.5g}"
                texts.append((x, y, text.replace("-", "\N{MINUS SIGN}"), colour))
    return texts


def legend(axes, handles, **options):
    """A legend, when there is something to tell apart."""
    if handles:
        axes.legend(handles=handles, **options)

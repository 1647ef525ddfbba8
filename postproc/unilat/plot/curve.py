"""Draw limit curves: the limit load over a second parameter."""

from __future__ import annotations

import numpy as np
from matplotlib.lines import Line2D

from .. import captions, options
from ..results import Column, LimitCurve, ResultsError
from . import path_curves, references, smooth_curve, style
from .label_placing import place_labels

DESCRIPTION = """\
Draw the limit curves of one or more result files: the load factor (or a monitor) at a limit point over the parameter
that the deck varies. The axis of the parameter is logarithmic when its values span more than two decades. The limit
point with a rigid obstacle is a horizontal line. Points where the parameter turns back are marked TP."""

EXAMPLES = """\
examples:
  unilat-plot curve ring.h5
  unilat-plot curve ring.h5 --curve stiffness --x-label '$k R^4/EI$' --x-scale 2.5e-5
  unilat-plot curve ring.h5 --reference ring.csv --ref-x k --ref-y p --ref-name exact
  unilat-plot curve ring.h5 --y v --axis linear
  unilat-plot curve ring.h5 --list
"""

RIGID = {"linestyle": (0, (1, 1.5)), "linewidth": 1.0}
DECADES = 2.0      # more than these, and the axis is logarithmic
WORDS = {"MODULUS": "foundation modulus", "GAP": "gap", "IMPERFECTION": "factor on the imperfection", "EA": "EA",
         "EI": "EI", "CONSTANT LOAD": "factor on the constant loads"}


@style.drawing
def main(argv=None) -> int:
    parser = options.Parser("unilat-plot curve", DESCRIPTION, EXAMPLES)
    style.add_files(parser)
    parser.add_argument("--curve", action="append", default=[], metavar="NAME",
                        help="limit curve to draw, may be repeated (default: all that vary the same parameter as the "
                             "first one)")
    parser.add_argument("--y", metavar="NAME", default="load_factor", help="load_factor (default) or a monitor")
    parser.add_argument("--axis", choices=("auto", "linear", "log"), default="auto",
                        help="axis of the parameter (default auto)")
    parser.add_argument("--list", action="store_true", help="list the limit curves of the files and stop")
    parser.add_argument("--points", action="store_true", help="show every computed point as a dot")
    style.add_axes(parser)
    references.add_reference(parser)
    style.add_output(parser, width=89, height=70)
    args = parser.parse_args(argv)
    everything = options.load(args, points=False)
    if args.list:
        return list_curves(everything)

    chosen = [choose(results, args.curve) for results in everything]
    curves = [curve for group in chosen for curve in group]
    if len({curve.parameter for curve in curves}) > 1:
        raise ResultsError(f"{everything[0].filename}: the curves vary different parameters "
                           f"({', '.join(f'{curve.name}: {curve.parameter}' for curve in curves)})")
    figure, axes = style.new_axes(args)
    published = references.draw_references(axes, args)
    names = [(name, curve) for group, name in zip(chosen, style.names(args, everything)) for curve in group]
    handles, texts, quantity = [], [], options.numbers(curves[0], args.y)
    for k, (name, curve) in enumerate(names):
        look = style.look(k)
        texts += draw_curve(axes, curve, args, look)
        several = len(chosen) < len(curves)
        title = captions.escape(curve.name) if several else name
        if several and len(chosen) > 1:
            title = f"{name}, {title}"
        handles.append(Line2D([], [], label=title, **look))
        if np.any(curve.rigid):
            title = "rigid" if len(curves) == 1 else f"{title}, rigid"
            handles.append(Line2D([], [], label=title, **look, **RIGID))
    parameter = np.concatenate([args.x_scale * curve.column("parameter").values[~curve.rigid] for curve in curves])
    if logarithmic(parameter, args.axis, curves[0]):
        axes.set_xscale("log")
    style.finish_axes(axes, args, parameter_label(curves[0], args.x_scale),
                      captions.column_label(quantity, args.y_scale))
    style.legend(axes, (handles if len(handles) > 1 or published else []) + published, loc="best")
    place_labels(axes, texts)
    return style.save(figure, args, everything, "curve")


def choose(results, wanted: list[str]) -> list[LimitCurve]:
    """The curves to draw of a file."""
    known = {name.lower(): curve for name, curve in results.limit_curves.items()}
    if not known:
        raise ResultsError(f"{results.filename}: holds no limit curves (*LIMIT CURVE)")
    for name in wanted:
        if name.lower() not in known:
            raise ResultsError(f"{results.filename}: no limit curve '{name}' "
                               f"(known: {', '.join(results.limit_curves)})")
    found = [known[name.lower()] for name in wanted]
    if not wanted:
        found = [curve for curve in known.values() if curve.n_points > 0]
        found = [curve for curve in found if curve.parameter == found[0].parameter]
    if not found or any(curve.n_points == 0 for curve in found):
        raise ResultsError(f"{results.filename}: a limit curve holds no points (status: {results.status})")
    return found


def draw_curve(axes, curve: LimitCurve, args, look: dict) -> list[tuple]:
    """The curve, and its rigid limit across the whole picture; labels to place: (x, y, text, colour)."""
    x = args.x_scale * curve.column("parameter").values
    y = args.y_scale * options.numbers(curve, args.y).values
    soft = ~curve.rigid
    alone = np.sum(soft) == 1
    smooth_x, smooth_y = smoothed(x[soft], y[soft])
    axes.plot(smooth_x, smooth_y, zorder=3, **look)
    if args.points or alone:
        axes.plot(x[soft], y[soft], marker=".", markersize=2.6, zorder=3, **look | {"linestyle": "none"})
    for value in y[curve.rigid]:
        axes.axhline(value, zorder=2.5, **look, **RIGID)
    texts = []
    for row in np.flatnonzero(curve.columns["label"].values == "TP") if "label" in curve.columns else ():
        axes.plot(x[row], y[row], marker=path_curves.MARKERS["TP"], markersize=3.8, color=look["color"], linestyle="none", zorder=6)
        texts.append((x[row], y[row], "TP", look["color"]))
    return texts


def smoothed(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A curve without corners through the points; of a parameter over decades, through its logarithm."""
    if len(x) < 3:
        return x, y
    decades = bool(np.all(x > 0.0) and np.log10(x.max() / x.min()) > DECADES)
    nothing = np.zeros(len(x), dtype=bool)
    curve_x, curve_y, _ = smooth_curve.through(np.log(x) if decades else x, y, nothing, ~nothing)
    return (np.exp(curve_x) if decades else curve_x), curve_y


def logarithmic(values: np.ndarray, wanted: str, curve: LimitCurve) -> bool:
    """Whether the axis is to be logarithmic."""
    positive = values.size > 0 and np.all(values > 0.0)
    if wanted == "log" and not positive:
        raise ResultsError(f"{curve.filename}: values of {curve.parameter} are not all positive (use --axis linear)")
    if wanted != "auto":
        return wanted == "log"
    return bool(positive and np.log10(values.max() / values.min()) > DECADES)


def parameter_label(curve: LimitCurve, scale: float) -> str:
    """Axis label: what varies, and of what."""
    name = WORDS.get(curve.parameter, curve.parameter.lower())
    column = Column(f"{name} of {curve.of}" if curve.of else name, np.zeros(0))
    units = curve.column("parameter").units.replace("^2", "$^2$")
    return captions.column_label(column, scale) + (f" ({units})" if units != "1" else "")


def list_curves(everything) -> int:
    for results in everything:
        print(f"{results.filename}: {len(results.limit_curves)} limit curves, {results.status}")
        for curve in results.limit_curves.values():
            of = f" of {curve.of}" if curve.of else ""
            print(f"   {curve.name:<20} {curve.parameter}{of}: {curve.n_points} points, "
                  f"limit point {curve.limit_point} of step {curve.step}")
    return 0

"""Draw buckling modes on the structure."""

from __future__ import annotations

import argparse

import numpy as np

from .. import options
from ..results import Buckling, Results, ResultsError
from ..results.rod_shape import Shape
from . import style
from .obstacle_drawing import draw_obstacle

DESCRIPTION = """\
Draw the modes of a buckling step (*BUCKLE), one panel a mode with its load factor. The stress-free structure is thin
and dashed; a mode has no size of its own and is drawn as large as --amplitude says. Axes have equal scales."""

EXAMPLES = """\
examples:
  unilat-plot modes column.h5
  unilat-plot modes column.h5 --modes 1,2 --amplitude 0.1
  unilat-plot modes arch.h5 --step buckle --both -o arch-modes.pdf
"""

MOST_MODES = 12        # drawn when none are named
TITLE = 5.5            # [mm] over a panel
GAP = 3.0              # [mm] between panels
TITLED = 26.0          # [mm] width of a title
TALLEST = 110.0        # [mm] panels, unless the figure has a given height


@style.drawing
def main(argv=None) -> int:
    parser = options.Parser("unilat-plot modes", DESCRIPTION, EXAMPLES)
    style.add_files(parser)
    parser.add_argument("--step", metavar="NAME", help="buckling step to draw (default: the first one)")
    parser.add_argument("--modes", type=mode_list, default=[], metavar="N,N,...",
                        help=f"numbers of modes, from 1 (default: all, {MOST_MODES} at most)")
    parser.add_argument("--amplitude", type=options.nonzero, default=0.15, metavar="F",
                        help="largest translation over the size of the structure; negative: the other way "
                             "(default 0.15)")
    parser.add_argument("--both", action="store_true", help="draw the opposite of each mode, too, in grey")
    parser.add_argument("--load-scale", type=options.nonzero, default=1.0, metavar="F",
                        help="factor on the load factors")
    parser.add_argument("--columns", type=int, choices=range(1, 7), metavar="N",
                        help="panels side by side (default: as they fit)")
    parser.add_argument("--no-obstacles", action="store_true", help="leave out the obstacles")
    style.add_output(parser, width=89, height=None)
    args = parser.parse_args(argv)
    if len(args.files) > 1:
        raise ResultsError("unilat-plot modes draws one result file")
    (results,) = everything = options.load(args, points=False)
    buckling = choose_step(results, args.step)
    modes = choose_modes(results, buckling, args.modes)

    stress_free = Shape(results.mesh)
    curves = stress_free.curves()
    everywhere = np.concatenate(curves)
    size = np.hypot(*(everywhere.max(axis=0) - everywhere.min(axis=0)))
    shapes = [[Shape(results.mesh, buckling.mode[mode - 1], sign * args.amplitude * size, linear=True).curves()
               for sign in ((-1.0, 1.0) if args.both else (1.0,))] for mode in modes]
    limits = frame([curve for panel in shapes for shape in panel for curve in shape] + curves)
    figure, panels = layout(args, limits, len(modes))
    for axes, mode, panel in zip(panels, modes, shapes):
        if not args.no_obstacles:
            for obstacle in results.obstacles.values():
                draw_obstacle(axes, obstacle, limits, 1.0)
        for curve in curves:
            axes.plot(*curve.T, zorder=2, **style.STRESS_FREE)
        for shape, colour in zip(panel[::-1], (style.COLOURS[0], style.REFERENCE)):
            for curve in shape:
                axes.plot(*curve.T, color=colour, linewidth=1.3, zorder=3 if colour == style.COLOURS[0] else 2.5)
        factor = f"{args.load_scale * buckling.load_factor[mode - 1]:.5g}".replace("-", "\N{MINUS SIGN}")
        axes.set_title(f"mode {mode}:  {factor}", pad=2.5)
        axes.set_xlim(limits[:, 0])
        axes.set_ylim(limits[:, 1])
        axes.set_axis_off()
    return style.save(figure, args, everything, "modes")


def choose_step(results: Results, name: str | None) -> Buckling:
    """The buckling step to draw; it must have modes."""
    known = {step.lower(): buckling for step, buckling in results.buckling.items()}
    if not known:
        raise ResultsError(f"{results.filename}: holds no buckling modes (*BUCKLE)")
    if name is not None and name.lower() not in known:
        raise ResultsError(f"{results.filename}: no buckling step '{name}' (known: {', '.join(results.buckling)})")
    buckling = known[name.lower()] if name is not None else min(known.values(), key=lambda item: item.step)
    if len(buckling.load_factor) == 0:
        raise ResultsError(f"{results.filename}: buckling step '{buckling.name}' found no modes")
    return buckling


def choose_modes(results: Results, buckling: Buckling, wanted: list[int]) -> list[int]:
    """Numbers of the modes to draw."""
    n = len(buckling.load_factor)
    for mode in wanted:
        if not 1 <= mode <= n:
            raise ResultsError(f"{results.filename}: no mode {mode} (they run from 1 to {n})")
    return wanted or list(range(1, min(n, MOST_MODES) + 1))


def frame(curves: list[np.ndarray]) -> np.ndarray:
    """Lower left and upper right corner of all panels: everything and a margin."""
    low = np.min([curve.min(axis=0) for curve in curves], axis=0)
    high = np.max([curve.max(axis=0) for curve in curves], axis=0)
    margin = 0.04 * max(high - low)
    return np.array((low - margin, high + margin))


def layout(args, limits: np.ndarray, n: int):
    """A figure and n panels of the shape of the limits, read row by row."""
    wide, tall = limits[1] - limits[0]
    most = 1 if tall < 0.3 * wide else 2 if tall < 0.6 * wide else 3 if tall < 1.2 * wide else 5
    columns = args.columns or min(n, max(1, round(most * args.width / 89.0)), max(1, int(args.width / (TITLED + GAP))))
    rows = -(-n // columns)
    above = 7.0 if args.title else 1.0
    width = (args.width - GAP * (columns + 1)) / columns
    height = min(width * tall / wide, (args.height - above - GAP) / rows - TITLE - GAP if args.height else TALLEST)
    width = height * wide / tall
    if min(width, height) < 2.0:
        raise ResultsError("no room for the modes; give another --width, --height or --columns")
    total = args.height or rows * (height + TITLE + GAP) + above + GAP
    figure = style.new_figure(args.width, total, args.dpi)
    pitch = min(max(width, TITLED) + GAP, args.width / columns)
    left = 0.5 * (args.width - (columns - 1) * pitch - width)
    panels = []
    for k in range(n):
        row, column = divmod(k, columns)
        x, y = left + column * pitch, total - above - (row + 1) * (TITLE + height) - row * GAP
        panels.append(figure.add_axes((x / args.width, y / total, width / args.width, height / total)))
    if args.title:
        figure.text(0.5, 1.0 - 1.5 / total, args.title, fontsize=9.5, ha="center", va="top")
    return figure, panels


def mode_list(text: str) -> list[int]:
    try:
        return [int(word) for word in text.split(",") if word.strip()]
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is not a list of modes such as 1,2,3") from None

"""The shape beside the path as a film: GIF or MP4."""

from __future__ import annotations

import os

import numpy as np
from matplotlib import animation

from .. import captions, options
from ..chosen_points import branch_number
from ..results import Path, ResultsError
from ..results.mirror import mirror_line, mirrored
from ..results.rod_shape import Shape, contact_curves
from . import path_curves, style
from .obstacle_drawing import draw_obstacle
from .shape import with_displacement

DESCRIPTION = """\
Write a film of the deformed shape beside the path on which a dot moves: a GIF, which needs nothing but matplotlib, or an MP4, which
needs the program ffmpeg. A frame is drawn for every stored point; the deck must have asked for *FIELD OUTPUT with DISPLACEMENT."""

EXAMPLES = """\
examples:
  unilat-plot animate ring.h5 --mirror x=0          writes ring.gif
  unilat-plot animate column.h5 --x midspan --stretch-y 5 -o column.mp4
"""


@style.drawing
def main(argv=None) -> int:
    parser = options.Parser("unilat-plot animate", DESCRIPTION, EXAMPLES)
    options.add_files(parser)
    parser.add_argument("--branch", type=branch_number, default=0, metavar="K", help="branch K instead of the path of the steps")
    parser.add_argument("--x", metavar="NAME", help="quantity along x of the path (default: the first monitor, else point)")
    parser.add_argument("--y", metavar="NAME", default="load_factor", help="quantity along y (default load_factor)")
    parser.add_argument("--mirror", type=mirror_line, metavar="x=X|y=Y", help="add the mirror image over this line")
    parser.add_argument("--stretch-y", type=options.positive, default=1.0, metavar="F",
                        help="draw shapes with y F times larger (default 1: equal scales)")
    parser.add_argument("--seconds", type=options.positive, metavar="F", help="length of the film (default: 12 frames a second)")
    parser.add_argument("--width", type=options.positive, default=200.0, metavar="MM", help="width in millimetres (default 200)")
    parser.add_argument("--dpi", type=options.positive, default=120.0, help="resolution (default 120)")
    parser.add_argument("-o", "--output", metavar="FILE", help=".gif or .mp4 (default: a GIF named after the result file)")
    args = parser.parse_args(argv)
    if len(args.files) > 1:
        raise ResultsError("unilat-plot animate draws one result file")
    (results,) = options.load(args)
    path = results.path_number(args.branch)
    output = args.output or f"{os.path.splitext(os.path.basename(args.files[0]))[0]}.gif"
    writer = film_writer(output, 1.0)       # refuses before the work
    points = with_displacement(path)
    if points.size == 0:
        raise ResultsError(f"{path.filename}: no displacements are stored (*FIELD OUTPUT)")
    writer = film_writer(output, len(points) / args.seconds if args.seconds else 12.0)
    film = Film(path, points, args)
    try:
        with writer.saving(film.figure, output, args.dpi):
            for point in points:
                film.draw(int(point))
                writer.grab_frame()
    except OSError as problem:
        raise ResultsError(f"{output}: cannot be written: {problem.strerror or problem}") from problem
    print(f"wrote {output} ({len(points)} frames)")
    options.tell_unfinished([results])
    return 0


def film_writer(output: str, rate: float):
    """The writer for this kind of file, with frames a second."""
    if output.lower().endswith(".gif"):
        return animation.PillowWriter(fps=rate)
    if output.lower().endswith(".mp4"):
        if not animation.FFMpegWriter.isAvailable():
            raise ResultsError(f"{output}: MP4 needs the program ffmpeg (apt-get install ffmpeg); a .gif does without")
        # H.264 in the form that browsers play needs even numbers of pixels
        return animation.FFMpegWriter(fps=rate, extra_args=["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p"])
    raise ResultsError(f"{output}: the film must end in .gif or .mp4")


class Film:
    """The figure, whose left panel is drawn anew for every frame."""

    def __init__(self, path: Path, points: np.ndarray, args):
        self.path, self.args = path, args
        self.shapes = {int(point): Shape(path.mesh, path.field("displacement", point)) for point in points}
        self.home = Shape(path.mesh)
        everything = np.concatenate([curve for shape in (self.home, *self.shapes.values())
                                     for curve in mirrored(shape.curves(), args.mirror)])
        unit = np.array((1.0, args.stretch_y))
        low, high = everything.min(axis=0), everything.max(axis=0)
        margin = 0.05 * max((high - low) * unit) / unit
        self.limits = np.array((low - margin, high + margin))
        wide, tall = (self.limits[1] - self.limits[0]) * unit
        beside = tall > 0.3 * wide          # a flat structure lies above its path
        part = args.width / 2.0
        below = 0.45 * args.width
        height = float(np.clip(part * tall / wide, 0.6 * part, 1.4 * part)) if beside else args.width * tall / wide + below
        self.figure = style.new_figure(args.width, height + 12.0, args.dpi, constrained_layout=True)
        shares = {} if beside else {"height_ratios": (args.width * tall / wide, below)}
        self.left, right = self.figure.subplots(1, 2) if beside else self.figure.subplots(2, 1, gridspec_kw=shares)
        self.x, self.y = (options.numbers(path, name) for name in (args.x or next(iter(path.monitors), "point"), args.y))
        path_curves.draw_path(right, path, self.x, self.y, style.look(0))
        path_curves.draw_marks(right, path, ["LP", "BP"], lambda critical: tuple(
            path_curves.critical_value(path, critical, column) for column in (self.x, self.y)), style.COLOURS[0])
        right.set_xlabel(captions.column_label(self.x))
        right.set_ylabel(captions.column_label(self.y))
        (self.dot,) = right.plot([], [], "o", color=style.CONTACT, markersize=6.0, zorder=8)

    def draw(self, point: int):
        axes, args = self.left, self.args
        axes.clear()
        for obstacle in self.path.obstacles_at(point):
            draw_obstacle(axes, obstacle, self.limits, args.stretch_y)
        for curve in mirrored(self.home.curves(), args.mirror):
            axes.plot(*curve.T, zorder=2, **style.STRESS_FREE)
        shape = self.shapes[point]
        for curve in mirrored(shape.curves(), args.mirror):
            axes.plot(*curve.T, color=style.COLOURS[0], linewidth=1.6, zorder=4)
        lines, spots = contact_curves(self.path, point, shape)
        for curve in mirrored(lines, args.mirror):
            axes.plot(*curve.T, color=style.CONTACT, linewidth=2.2, zorder=5, solid_capstyle="butt")
        for spot in mirrored([spot[None, :] for spot in spots], args.mirror):
            axes.plot(*spot.T, color=style.CONTACT, marker="o", markersize=4.5, linestyle="none", zorder=6)
        axes.set_xlim(self.limits[:, 0])
        axes.set_ylim(self.limits[:, 1])
        axes.set_aspect(args.stretch_y)
        axes.set_xlabel(f"x ({args.units.length})" + ("" if args.stretch_y == 1.0 else f"; y is drawn {args.stretch_y:g} times larger"))
        axes.set_ylabel(f"y ({args.units.length})")
        row = point - 1
        self.dot.set_data([self.x.values[row]], [self.y.values[row]])
        label = str(self.path.path["label"].values[row]) if "label" in self.path.path else ""
        axes.set_title(f"{captions.escape(self.y.name.replace('_', ' '))} {self.y.values[row]:.4g}  {label}".rstrip()
                       .replace("-", "\N{MINUS SIGN}"))

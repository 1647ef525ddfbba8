"""The shape beside the path as a film: GIF or MP4."""

from __future__ import annotations

import os

import numpy as np
from matplotlib import animation

from .. import captions, options
from ..chosen_points import branch_number, count
from ..results import Path, ResultsError
from ..results.force_glyphs import Scales, glyphs
from ..results.mirror import mirror_line, mirrored
from ..results.motion import Frame, Motion
from ..results.rod_shape import Shape, contact_pieces, join
from . import path_curves, style
from .force_drawing import draw_glyphs
from .obstacle_drawing import draw_obstacle
from .shape import with_displacement

DESCRIPTION = """\
Write a film of the deformed shape beside the path on which a dot moves: a GIF, which needs nothing but matplotlib, or an MP4, which
needs the program ffmpeg. The deck must have asked for *FIELD OUTPUT with DISPLACEMENT; between the stored points the structure moves
on along smooth curves, with a frame at every stored point, too. Contact forces are arrows with their values, pressure is a band."""

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
    parser.add_argument("--frames", type=count, default=60, metavar="N", help="about as many frames, at equal distances along the path, "
                        "and one at every stored point (default 60; 1: the stored points alone)")
    parser.add_argument("--forces", choices=("all", "none"), default="all", help="draw contact forces (default) or not")
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
    frames = Motion(path, args.forces == "all").frames(args.frames)
    writer = film_writer(output, len(frames) / args.seconds if args.seconds else 12.0)
    film = Film(path, frames, args)
    try:
        with writer.saving(film.figure, output, args.dpi):
            for frame in frames:
                film.draw(frame)
                writer.grab_frame()
    except OSError as problem:
        raise ResultsError(f"{output}: cannot be written: {problem.strerror or problem}") from problem
    print(f"wrote {output} ({len(frames)} frames)")
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

    def __init__(self, path: Path, frames: list[Frame], args):
        self.path, self.args = path, args
        self.home = Shape(path.mesh)
        everything = np.concatenate([curve for shape in (self.home, *(frame.shape for frame in frames))
                                     for curve in mirrored(shape.curves(), args.mirror)])
        self.size = float(max(np.ptp(everything, axis=0) * (1.0, args.stretch_y)))
        self.scales = Scales.of([(frame.forces, frame.pressures) for frame in frames])
        corners = [self.glyphs(frame).corners() for frame in frames]
        everything = np.concatenate([everything, *mirrored([each for each in corners if len(each)], args.mirror)])
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
        self.way = path_curves.smoothed(path, self.x, self.y)
        path_curves.draw_marks(right, path, ["LP", "BP"], lambda critical: tuple(
            path_curves.critical_value(path, critical, column) for column in (self.x, self.y)), style.COLOURS[0])
        right.set_xlabel(captions.column_label(self.x))
        right.set_ylabel(captions.column_label(self.y))
        (self.dot,) = right.plot([], [], "o", color=style.CONTACT, markersize=6.0, zorder=8)
        self.draw(frames[0])
        style.lay_out(self.figure)      # once: all frames have the same limits

    def glyphs(self, frame: Frame):
        """What contact pushes with in a frame; the longest arrow is the same in all."""
        return glyphs(frame.forces, frame.pressures, self.scales, self.size, self.args.stretch_y)

    def draw(self, frame: Frame):
        axes, args = self.left, self.args
        axes.clear()
        for obstacle in self.path.obstacles_between(frame.row):
            draw_obstacle(axes, obstacle, self.limits, args.stretch_y)
        for curve in mirrored(self.home.curves(), args.mirror):
            axes.plot(*curve.T, zorder=2, **style.STRESS_FREE)
        shape = frame.shape
        for curve in mirrored(shape.curves(), args.mirror):
            axes.plot(*curve.T, color=style.COLOURS[0], linewidth=1.6, zorder=4)
        pieces, spots = contact_pieces(self.path, frame.nearest, shape, frame.regions)
        for curve in mirrored(join(pieces, shape), args.mirror):
            axes.plot(*curve.T, color=style.CONTACT, linewidth=2.2, zorder=5, solid_capstyle="butt")
        for spot in mirrored([spot[None, :] for spot in spots], args.mirror):
            axes.plot(*spot.T, color=style.CONTACT, marker="o", markersize=4.5, linestyle="none", zorder=6)
        axes.set_aspect(args.stretch_y)
        draw_glyphs(axes, self.glyphs(frame), mirror=args.mirror)
        axes.set_xlim(self.limits[:, 0])
        axes.set_ylim(self.limits[:, 1])
        axes.set_xlabel(f"x ({captions.escape(self.path.unit('length'))})" + ("" if args.stretch_y == 1.0 else f"; y is drawn {args.stretch_y:g} times larger"))
        axes.set_ylabel(f"y ({captions.escape(self.path.unit('length'))})")
        at = np.interp(frame.row, np.arange(self.path.n_points), self.way[2])
        x, y = (float(np.interp(at, np.arange(len(values)), values)) for values in self.way[:2])
        self.dot.set_data([x], [y])
        row = int(round(frame.row))
        label = str(self.path.path["label"].values[row]) if "label" in self.path.path and row == frame.row else ""
        axes.set_title(f"{captions.escape(self.y.name.replace('_', ' '))} {y:.4g}  {label}".rstrip()
                       .replace("-", "\N{MINUS SIGN}"))

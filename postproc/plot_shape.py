#!/usr/bin/env python3
"""Draw deformed shapes, the part in contact and the obstacles."""

from __future__ import annotations

import argparse

import numpy as np

import plot_style as style  # before matplotlib's own modules: it chooses the backend
import matplotlib.pyplot as plt
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator, MultipleLocator

from obstacle_drawing import draw_obstacle
from rod_shape import Shape, contact_curves
from unilat_results import Path, ResultsError

DESCRIPTION = """\
Draw deformed shapes at chosen points of the path; the deck must have asked for *FIELD OUTPUT with DISPLACEMENT.
The stress-free shape is thin and dashed, the part in contact thick and coloured (nodes with a reaction when the
reactions are stored, else the contact regions), the solid side of obstacles hatched. Axes have equal scales.
Several files are drawn side by side."""

EXAMPLES = """\
examples:
  plot_shape.py ring.h5                          five shapes evenly spaced along the path
  plot_shape.py ring.h5 --label LP --mirror x=0  the limit point, the half ring completed
  plot_shape.py ring.h5 --rows 1,20,57 --caption v
  plot_shape.py column.h5 --evenly 4 --stretch-y 10 -o column.pdf
  plot_shape.py arch.h5 --branch 2 --evenly 3    along the second branch
  plot_shape.py rigid.h5 winkler.h5 --label LP --width 180
"""

# From pale to dark: the order of the shapes is seen without colour, too.
PALE, DARK = np.array([0.64, 0.76, 0.87]), np.array([0.03, 0.15, 0.35])
LEGEND_WIDTH = 27.0     # [mm] beside a panel


def main(argv=None) -> int:
    parser = style.Parser(description=DESCRIPTION, epilog=EXAMPLES)
    style.add_files(parser)
    parser.add_argument("--branch", type=branch_number, default=0, metavar="K",
                        help="shapes of branch K instead of the path of the steps")
    chosen = parser.add_argument_group("points to draw (together, when several are given; default --evenly 5)")
    chosen.add_argument("--rows", type=row_list, default=[], metavar="N,N,...",
                        help="numbers of points, from 1 as in the listing; -1 is the last stored one")
    chosen.add_argument("--label", type=style.mark_list, default=[], metavar="LABELS",
                        help=f"points with these labels: some of {','.join(style.MARKERS)}, or all")
    chosen.add_argument("--evenly", type=count, metavar="N",
                        help="N points evenly spaced along the path, first and last included")
    parser.add_argument("--caption", metavar="NAME", default="load_factor",
                        help="path quantity or monitor that names the shapes (default load_factor)")
    parser.add_argument("--caption-scale", type=style.nonzero, default=1.0, metavar="F", help="factor on it")
    parser.add_argument("--scale", type=style.nonzero, default=1.0, metavar="F",
                        help="magnify displacements (obstacles stay where they are; default 1)")
    parser.add_argument("--stretch-y", type=style.positive, default=1.0, metavar="F",
                        help="draw y F times larger than x, for slender pictures (default 1: equal scales)")
    parser.add_argument("--mirror", type=mirror_line, metavar="x=X|y=Y",
                        help="add the mirror image over this line, when symmetry was used")
    parser.add_argument("--no-axes", action="store_true", help="leave out axes and frame")
    parser.add_argument("--no-stress-free", action="store_true", help="leave out the stress-free shape")
    style.add_axes(parser, scales=False)
    style.add_output(parser, width=89, height=None)
    args = parser.parse_args(argv)
    everything = style.load(args)

    paths = [results.path_number(args.branch) for results in everything]
    pictures = [Picture(path, choose(path, args), args) for path in paths]
    low = np.min([picture.low for picture in pictures], axis=0)
    high = np.max([picture.high for picture in pictures], axis=0)
    margin = 0.05 * max((high - low) * (1.0, args.stretch_y)) * np.array((1.0, 1.0 / args.stretch_y))
    limits = np.array((low - margin, high + margin))     # lower left and upper right corner
    for axis, wanted in enumerate((args.x_range, args.y_range)):
        limits[:, axis] = wanted or limits[:, axis]

    style.set_look()
    entries = max(len(picture.points) for picture in pictures) + 2
    layout = Layout(args, limits, len(pictures), entries)
    figure = plt.figure(dpi=args.dpi)
    panels = [figure.add_axes((0.1, 0.1, 0.8, 0.8)) for _ in pictures]
    for k, (axes, picture) in enumerate(zip(panels, pictures)):
        picture.draw(axes, limits)
        finish(axes, args, limits, first=k == 0)
    layout.place(figure, panels)
    for axes, picture, name in zip(panels, pictures, style.names(args, everything)):
        if len(pictures) > 1:
            axes.set_title(name)
        layout.legend(axes, picture)
    if args.title:
        figure.text(0.5, 1.0 - 1.5 / layout.height, args.title, fontsize=9.5, ha="center", va="top")
    return style.save(figure, args, everything, "shape")


class Picture:
    """The shapes of one file."""

    def __init__(self, results: Path, points: list[int], args):
        self.results, self.points, self.args = results, points, args
        self.shapes = [Shape(results.mesh, results.field("displacement", point), args.scale) for point in points]
        self.stress_free = Shape(results.mesh)
        curves = [curve for shape in (self.stress_free, *self.shapes) for curve in self._mirrored(shape.curves())]
        self.low = np.min([curve.min(axis=0) for curve in curves], axis=0)
        self.high = np.max([curve.max(axis=0) for curve in curves], axis=0)
        self.handles: list[Line2D] = []
        self.caption = ""

    def draw(self, axes, limits: np.ndarray):
        results, args = self.results, self.args
        moving = results.contact is not None and results.contact.obstacle_shift is not None
        for point in self.points if moving else self.points[:1]:
            for obstacle in results.obstacles_at(point):
                draw_obstacle(axes, obstacle, limits, args.stretch_y)
        if not args.no_stress_free:
            for curve in self._mirrored(self.stress_free.curves()):
                axes.plot(*curve.T, zorder=2, **style.STRESS_FREE)
        caption = style.numbers(results, args.caption)
        labels = {critical.point: critical.label.replace("-", "\N{MINUS SIGN}") for critical in results.critical}
        touching = False
        for k, (point, shape) in enumerate(zip(self.points, self.shapes)):
            share = k / (len(self.points) - 1) if len(self.points) > 1 else 1.0
            colour, layer = tuple(PALE + share * (DARK - PALE)), 4.0 + k / len(self.points)
            for curve in self._mirrored(shape.curves()):
                axes.plot(*curve.T, color=colour, linewidth=1.3, zorder=layer)
            lines, spots = contact_curves(results, point, shape)
            for curve in self._mirrored(lines):
                axes.plot(*curve.T, color=style.CONTACT, linewidth=1.9, zorder=layer, solid_capstyle="butt")
            for spot in self._mirrored([spot[None, :] for spot in spots]):
                axes.plot(*spot.T, color=style.CONTACT, marker="o", markersize=3.6, linestyle="none", zorder=6)
            touching = touching or bool(lines) or len(spots) > 0
            value = args.caption_scale * caption.values[point - 1]
            text = f"{value:.4g}" + (f"  {labels[point]}" if point in labels else "")
            self.handles.append(Line2D([], [], color=colour, linewidth=1.3, label=text.replace("-", "\N{MINUS SIGN}")))
        if touching:
            self.handles.append(Line2D([], [], color=style.CONTACT, linewidth=1.9, label="contact"))
        if not args.no_stress_free:
            self.handles.append(Line2D([], [], label="stress-free", **style.STRESS_FREE))
        self.caption = style.column_label(caption, args.caption_scale)

    def _mirrored(self, curves: list[np.ndarray]) -> list[np.ndarray]:
        if self.args.mirror is None:
            return list(curves)
        axis, at = self.args.mirror
        images = [curve.copy() for curve in curves]
        for image in images:
            image[:, axis] = 2.0 * at - image[:, axis]
        return list(curves) + images


def choose(results: Path, args) -> list[int]:
    """Numbers of the points to draw, in the order of the path."""
    stored = results.points_with("displacement") if "displacement" in results.field_names else np.zeros(0, dtype=int)
    if stored.size == 0:
        raise ResultsError(f"{results.filename}: no displacements are stored (*FIELD OUTPUT, DISPLACEMENT)")
    points = [int(stored[-1]) if row == -1 else row for row in args.rows]
    if args.label:
        labelled = {critical.point for critical in results.critical if critical.label in args.label}
        found = sorted(labelled & set(stored.tolist()))
        if not found:
            why = "no displacements are stored there" if labelled else "no such point"
            raise ResultsError(f"{results.filename}: label {', '.join(args.label)}: {why}")
        points += found
    for point in points:
        if not 1 <= point <= results.n_points:
            raise ResultsError(f"{results.filename}: no point {point} (they run from 1 to {results.n_points})")
    if args.evenly or not points:
        points += evenly(results, stored, args.evenly or 5)
    return sorted(set(points))


def evenly(results: Path, stored: np.ndarray, number: int) -> list[int]:
    """Stored points at about equal distances of arc length (of the row, should the file have none)."""
    arc = results.path["arc_length"].values[stored - 1] if "arc_length" in results.path else np.zeros(len(stored))
    if len(stored) > 1 and not np.all(np.diff(arc) > 0.0):
        arc = stored.astype(float)
    return [int(stored[np.argmin(np.abs(arc - at))]) for at in np.linspace(arc[0], arc[-1], number)]


class Layout:
    """Sizes [mm] of the panels and their legends: beside a single tall panel, else below."""

    def __init__(self, args, limits: np.ndarray, n_panels: int, entries: int):
        wide, tall = (limits[1] - limits[0]) * (1.0, args.stretch_y)
        self.args, self.shape, self.n, self.entries = args, tall / wide, n_panels, entries
        self.beside = n_panels == 1 and self.shape > 1.25
        self.left, self.below = (1.0, 1.0) if args.no_axes else (12.0, 9.0)
        self.above = 2.0 + (5.0 if args.title else 0.0) + (5.0 if n_panels > 1 else 0.0)
        self.gap, self.columns, self.height = 4.0, 1, 0.0

    def place(self, figure, panels):
        """Give figure and panels their sizes; done twice, as the axis labels are known after the first time."""
        self._place(figure, panels)
        if not self.args.no_axes:
            figure.canvas.draw()
            frame, around = (box(figure.canvas.get_renderer()) for box in
                             (panels[0].get_window_extent, panels[0].get_tightbbox))
            millimetre = figure.dpi * style.MILLIMETRE
            self.left, self.below = (frame.x0 - around.x0) / millimetre + 1.0, (frame.y0 - around.y0) / millimetre + 1.0
            self._place(figure, panels)

    def _place(self, figure, panels):
        width, most = self.args.width, self.args.height or 2.2 * self.args.width
        aside = LEGEND_WIDTH if self.beside else 2.0
        panel = (width - self.left - aside - self.gap * (self.n - 1)) / self.n
        self.columns = 1 if self.beside else int(np.clip(panel // 24.0, 1, 4))
        rows = 0 if self.beside else 1 - (-self.entries // self.columns)
        under = self.below + 4.1 * rows + (1.0 if rows else 0.0)
        tall = min(panel * self.shape, most - under - self.above)
        panel = tall / self.shape
        if min(panel, tall) < 4.0:
            raise ResultsError(f"no room for the shapes in {width:g} x {most:g} mm; give another --width or --height")
        self.height = self.args.height or tall + under + self.above
        figure.set_size_inches(width * style.MILLIMETRE, self.height * style.MILLIMETRE)
        first = self.left + 0.5 * (width - self.left - aside - self.gap * (self.n - 1) - self.n * panel)
        for k, axes in enumerate(panels):
            axes.set_position(((first + k * (panel + self.gap)) / width, 1.0 - (self.above + tall) / self.height,
                               panel / width, tall / self.height))
        self.panel, self.tall = panel, tall

    def legend(self, axes, picture):
        place = ({"loc": "center left", "bbox_to_anchor": (1.0 + 2.5 / self.panel, 0.5)} if self.beside else
                 {"loc": "upper center", "bbox_to_anchor": (0.5, -(self.below + 0.5) / self.tall)})
        axes.legend(handles=picture.handles, title=picture.caption, title_fontsize=8.5, alignment="left",
                    ncol=self.columns, borderaxespad=0.0, borderpad=0.0, frameon=False, handlelength=1.8,
                    columnspacing=1.4, **place)


def finish(axes, args, limits: np.ndarray, first: bool):
    """Limits, ticks and labels; equal scales get equal ticks. The panel has the shape that makes them equal."""
    axes.set_xlim(limits[:, 0])
    axes.set_ylim(limits[:, 1])
    if args.stretch_y == 1.0:
        steps = MaxNLocator(5, steps=(1, 2, 2.5, 5, 10)).tick_values(*limits[:, np.argmax(limits[1] - limits[0])])
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_locator(MultipleLocator(steps[1] - steps[0]))
    axes.set_xlabel(args.x_label or "x (length)")
    axes.set_ylabel((args.y_label or "y (length)") if first else "")
    axes.tick_params(labelleft=first)
    if args.no_axes:
        axes.set_axis_off()


def row_list(text: str) -> list[int]:
    try:
        return [int(word) for word in text.split(",") if word.strip()]
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is not a list of point numbers such as 1,20,57") from None


def branch_number(text: str) -> int:
    if not text.isdigit() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"'{text}' is not the number of a branch (from 1)")
    return int(text)


def count(text: str) -> int:
    if not text.isdigit() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"'{text}' is not a number of shapes")
    return int(text)


def mirror_line(text: str) -> tuple[int, float]:
    axis, _, at = text.replace(" ", "").partition("=")
    try:
        return "xy".index(axis.lower() or "?"), float(at)
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is not a line such as x=0 or y=1.5") from None


if __name__ == "__main__":
    style.run(main)

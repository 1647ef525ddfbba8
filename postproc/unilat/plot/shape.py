"""Draw deformed shapes, the part in contact and the obstacles."""

from __future__ import annotations

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator, MultipleLocator

from .. import captions, options
from ..chosen_points import add_points, choose, names, shade
from ..results import Path, ResultsError
from ..results.mirror import mirror_line, mirrored
from ..results.contact_forces import contact_forces
from ..results.force_glyphs import Glyphs, Scales, glyphs
from ..results.model_parts import loads_at
from ..results.rod_shape import Shape, contact_curves
from . import style
from .force_drawing import draw_glyphs
from .label_placing import uncover
from .model_drawing import LOAD, draw_loads, draw_supports, hide_outside, load_corners, load_names
from .obstacle_drawing import draw_obstacle

DESCRIPTION = """\
Draw deformed shapes at chosen points of the path; the deck must have asked for *FIELD OUTPUT with DISPLACEMENT.
The stress-free shape is thin and dashed, the part in contact thick and coloured (nodes with a reaction when the
reactions are stored, else the contact regions), the solid side of obstacles hatched. At the last shape that has any,
contact forces are arrows with their values and pressure along lines is a band; its loads are arrows, too, at their
values there, and supports are symbols. Small displacements of structures without obstacles are magnified. Axes have equal
scales, or the picture says that they have not. Several files are drawn side by side."""

EXAMPLES = """\
examples:
  unilat-plot shape ring.h5                          five shapes evenly spaced along the path
  unilat-plot shape ring.h5 --label LP --mirror x=0  the limit point, the half ring completed
  unilat-plot shape ring.h5 --rows 1,20,57 --caption v
  unilat-plot shape column.h5 --evenly 4 --stretch-y 10 -o column.pdf
  unilat-plot shape arch.h5 --branch 2 --evenly 3    along the second branch
  unilat-plot shape rigid.h5 winkler.h5 --label LP --width 180
"""

LEGEND_WIDTH = 27.0     # [mm] beside a panel
ROUNDING = 1e-9         # of the structure's size: no displacement
TOO_SMALL = 0.02        # of the structure's size: displacements below are magnified
SEEN = 0.1              # to this part of it


@style.drawing
def main(argv=None) -> int:
    parser = options.Parser("unilat-plot shape", DESCRIPTION, EXAMPLES)
    style.add_files(parser)
    add_points(parser, "shapes")
    parser.add_argument("--scale", type=scale_factor, default=None, metavar="F",
                        help="magnify displacements (obstacles stay where they are; default: 1, or what makes small displacements "
                             "visible where there are no obstacles)")
    parser.add_argument("--stretch-y", type=options.positive, default=1.0, metavar="F",
                        help="draw y F times larger than x, for slender pictures (default 1: equal scales)")
    parser.add_argument("--mirror", type=mirror_line, metavar="x=X|y=Y",
                        help="add the mirror image over this line, when symmetry was used")
    parser.add_argument("--no-axes", action="store_true", help="leave out axes and frame")
    parser.add_argument("--no-stress-free", action="store_true", help="leave out the stress-free shape")
    parser.add_argument("--forces", choices=("last", "all", "none"), default="last",
                        help="contact forces at the last shape that has any (default), at all shapes, or at none")
    parser.add_argument("--no-loads", action="store_true", help="leave out the loads")
    parser.add_argument("--no-supports", action="store_true", help="leave out the supports")
    style.add_axes(parser, scales=False)
    style.add_output(parser, width=89, height=None)
    args = parser.parse_args(argv)
    everything = options.load(args)

    paths = [results.path_number(args.branch) for results in everything]
    chosen = [choose(path, args, with_displacement(path), "displacements") for path in paths]
    args.scale = args.scale or min(fitting_scale(path, points) for path, points in zip(paths, chosen))
    pictures = [Picture(path, points, args) for path, points in zip(paths, chosen)]
    low = np.min([picture.low for picture in pictures], axis=0)
    high = np.max([picture.high for picture in pictures], axis=0)
    margin = 0.05 * max((high - low) * (1.0, args.stretch_y)) * np.array((1.0, 1.0 / args.stretch_y))
    limits = np.array((low - margin, high + margin))     # lower left and upper right corner
    for axis, wanted in enumerate((args.x_range, args.y_range)):
        limits[:, axis] = wanted or limits[:, axis]

    entries = max(len(picture.points) + picture.n_more for picture in pictures) + 2 + (len(scale_notes(args)) if args.no_axes else 0)
    layout = Layout(args, limits, len(pictures), entries)
    figure = style.new_figure(args.width, args.width, args.dpi)
    panels = [figure.add_axes((0.1, 0.1, 0.8, 0.8)) for _ in pictures]
    for k, (axes, picture) in enumerate(zip(panels, pictures)):
        picture.draw(axes, limits)
        hide_outside(finish(axes, args, limits, first=k == 0, unit=picture.results.unit("length")))
    layout.measure([handle for picture in pictures for handle in picture.handles], max(len(picture.handles) for picture in pictures))
    layout.place(figure, panels)
    for axes, picture, name in zip(panels, pictures, style.names(args, everything)):
        if len(pictures) > 1:
            axes.set_title(name)
        layout.legend(axes, picture)
        uncover(axes)
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
        self.size = float(max((self.high - self.low) * (1.0, args.stretch_y)))
        self.glyphs = self._glyphs()
        self.loads = None if args.no_loads else loads_at(results, points[-1])
        self.n_more = int(bool(self.glyphs)) + (len(load_names(self.loads)) if self.loads else 0) + 1
        corners = [glyphs.corners() for glyphs in self.glyphs.values()]
        if self.loads is not None:
            corners.append(load_corners(results, self.loads, self.shapes[-1], self.size, args.stretch_y))
        for corner in self._mirrored([each for each in corners if len(each)]):
            self.low, self.high = np.minimum(self.low, corner.min(axis=0)), np.maximum(self.high, corner.max(axis=0))
        self.handles: list[Line2D] = []
        self.caption = ""

    def draw(self, axes, limits: np.ndarray):
        results, args = self.results, self.args
        moving = results.contact is not None and results.contact.obstacle_shift is not None
        n = len(self.points)
        for k, point in enumerate(self.points if moving else self.points[:1]):
            last = not moving or k == n - 1
            for obstacle in results.obstacles_at(point):
                draw_obstacle(axes, obstacle, limits, args.stretch_y, style.INK if last else shade(k, n), last)
        if not args.no_stress_free:
            for curve in self._mirrored(self.stress_free.curves()):
                axes.plot(*curve.T, zorder=2, **style.STRESS_FREE)
        self.caption, texts = names(results, self.points, args)
        touching = False
        for k, (point, shape) in enumerate(zip(self.points, self.shapes)):
            colour, layer = shade(k, n), 4.0 + k / n
            for curve in self._mirrored(shape.curves()):
                axes.plot(*curve.T, color=colour, linewidth=1.3, zorder=layer)
            for curve in self._mirrored(list(shape.nodes[results.mesh.links])):
                axes.plot(*curve.T, color=colour, linewidth=2.6, zorder=layer)
            for spot in self._mirrored([spot[None, :] for spot in shape.nodes[results.mesh.hinges]]):
                axes.plot(*spot.T, color=colour, zorder=6, **style.HINGE)
            lines, spots = contact_curves(results, point, shape)
            for curve in self._mirrored(lines):
                axes.plot(*curve.T, color=style.CONTACT, linewidth=1.9, zorder=layer, solid_capstyle="butt")
            for spot in self._mirrored([spot[None, :] for spot in spots]):
                axes.plot(*spot.T, color=style.CONTACT, marker="o", markersize=3.6, linestyle="none", zorder=6)
            touching = touching or bool(lines) or len(spots) > 0
            self.handles.append(Line2D([], [], color=colour, linewidth=1.3, label=texts[k]))
        for pushed in self.glyphs.values():
            draw_glyphs(axes, pushed, mirror=args.mirror, values=len(self.glyphs) == 1)
        if self.loads is not None:
            drawn = draw_loads(axes, results, self.loads, self.shapes[-1], self.size, 1.0, args.stretch_y, args.mirror)
            self.handles += [Line2D([], [], color=LOAD, linewidth=0.8, label=text) for text in load_names(self.loads) or
                             (["loads"] if drawn else [])]
        if not args.no_supports:
            draw_supports(axes, results, self.shapes[-1].nodes, mirror=args.mirror)
        if self.glyphs:
            self.handles.append(Line2D([], [], color=style.CONTACT, linewidth=0.9, marker=">", markersize=3.5, label="contact force"))
        if touching:
            self.handles.append(Line2D([], [], color=style.CONTACT, linewidth=1.9, label="contact"))
        if not args.no_stress_free:
            self.handles.append(Line2D([], [], label="stress-free", **style.STRESS_FREE))
        if args.no_axes:    # no axis is there to say so
            self.handles += [Line2D([], [], linestyle="none", label=note) for note in scale_notes(args)]

    def _mirrored(self, curves: list[np.ndarray]) -> list[np.ndarray]:
        return mirrored(curves, self.args.mirror)

    def _glyphs(self) -> dict[int, Glyphs]:
        """What contact pushes with, by the number of the shape; the longest arrow of the picture is the same for all."""
        if self.args.forces == "none" or self.args.scale != 1.0:      # forces act where the rod is, not where it is drawn
            return {}
        forces = {k: contact_forces(self.results, point) for k, point in enumerate(self.points)}
        found = {k: each for k, each in forces.items() if each[0] or each[1]}
        if self.args.forces == "last":
            found = dict(list(found.items())[-1:])
        scales = Scales.of(list(found.values()))
        return {k: glyphs(*each, scales, self.size, self.args.stretch_y) for k, each in found.items()}


def fitting_scale(path: Path, points: list[int]) -> float:
    """What displacements have to be magnified by to be seen, a round number; 1 where they can be, or where there are obstacles."""
    moved = max(float(np.max(np.hypot(*path.field("displacement", point)[:, :2].T))) for point in points)
    size = float(np.max(np.ptp(path.mesh.coordinates, axis=0)))
    if path.obstacles or not ROUNDING * size < moved <= TOO_SMALL * size:
        return 1.0
    wanted = SEEN * size / moved
    power = 10.0 ** np.floor(np.log10(wanted))
    return float(max(factor * power for factor in (1.0, 2.0, 5.0) if factor * power <= wanted))


def with_displacement(path: Path) -> np.ndarray:
    return path.points_with("displacement") if "displacement" in path.field_names else np.zeros(0, dtype=int)


class Layout:
    """Sizes [mm] of the panels and their legends: beside a single tall panel, else below."""

    def __init__(self, args, limits: np.ndarray, n_panels: int, entries: int):
        wide, tall = (limits[1] - limits[0]) * (1.0, args.stretch_y)
        self.args, self.shape, self.n, self.entries = args, tall / wide, n_panels, entries
        self.beside = n_panels == 1 and self.shape > 1.25
        self.left, self.below = (1.0, 1.0) if args.no_axes else (12.0, 9.0)
        self.above = 2.0 + (5.0 if args.title else 0.0) + (5.0 if n_panels > 1 else 0.0)
        self.gap, self.columns, self.height, self.entry = 4.0, 1, 0.0, style.ENTRY

    def measure(self, handles: list, entries: int):
        """Room for legend entries, now that they are known."""
        self.entries = entries
        self.entry = style.entry_width([handle.get_label() for handle in handles])

    def place(self, figure, panels):
        """Give figure and panels their sizes; done twice, as the axis labels are known after the first time."""
        self._place(figure, panels)
        if not self.args.no_axes:
            figure.canvas.draw()
            frame, around = (box(figure.canvas.get_renderer()) for box in
                             (panels[0].get_window_extent, panels[0].get_tightbbox))
            millimetre = figure.dpi * style.MILLIMETRE
            self.left, self.below = (frame.x0 - around.x0) / millimetre + 1.0, (frame.y0 - around.y0) / millimetre + 1.0
            self.above += max(0.0, (around.y1 - frame.y1) / millimetre - 1.0)    # a power of ten, a long label
            self._place(figure, panels)

    def _place(self, figure, panels):
        width, most = self.args.width, self.args.height or 2.2 * self.args.width
        aside = max(LEGEND_WIDTH, self.entry + 3.0) if self.beside else 2.0
        panel = (width - self.left - aside - self.gap * (self.n - 1)) / self.n
        self.columns = 1 if self.beside else int(np.clip(panel // self.entry, 1, 4))
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


def finish(axes, args, limits: np.ndarray, first: bool, unit: str = "length"):
    """Limits, ticks and labels; the axes. Equal scales get equal ticks. The panel has the shape that makes them equal."""
    axes.set_xlim(limits[:, 0])
    axes.set_ylim(limits[:, 1])
    wide, tall = limits[1] - limits[0]
    if args.stretch_y == 1.0:
        steps = MaxNLocator(5, steps=(1, 2, 2.5, 5, 10)).tick_values(*limits[:, 0 if wide > tall else 1])
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_locator(MultipleLocator(steps[1] - steps[0]))
    for axis, (low, high) in zip((axes.xaxis, axes.yaxis), limits.T):
        ticks = axis.get_major_locator().tick_values(low, high)
        if np.sum((ticks >= low) & (ticks <= high)) < 2:      # across a slender picture
            axis.set_major_locator(MaxNLocator(2, steps=(1, 2, 2.5, 5, 10)))
    axes.set_xlabel("; ".join([args.x_label or f"x ({captions.escape(unit)})"] + scale_notes(args)))
    axes.set_ylabel((args.y_label or f"y ({captions.escape(unit)})") if first else "")
    axes.tick_params(labelleft=first)
    if args.no_axes:
        axes.set_axis_off()
    return axes


def scale_notes(args) -> list[str]:
    """What is not drawn to the same scale as the rest."""
    return ([f"y is drawn {args.stretch_y:g} times larger"] if args.stretch_y != 1.0 else []) + \
        ([f"displacements times {args.scale:g}"] if args.scale != 1.0 else [])


def scale_factor(text: str) -> float | None:
    """A factor, or `auto` for the one that fits."""
    return None if text == "auto" else options.nonzero(text)

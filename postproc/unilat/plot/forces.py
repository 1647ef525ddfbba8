"""Draw normal force, shear force and bending moment along the rods."""

from __future__ import annotations

import argparse

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon

from .. import captions, options
from ..chosen_points import add_points, choose, names, shade
from ..results import Column, Path, ResultsError
from ..results.rod_chains import along_chain, rod_chains
from ..results.rod_shape import Shape
from ..results.section_curves import between_ends, shape_at
from . import style
from .label_placing import place_labels
from .obstacle_drawing import draw_obstacle

DESCRIPTION = """\
Draw section forces at chosen points of the path; the deck must have asked for *FIELD OUTPUT with SECTION FORCES. Over the arc
length (stress-free, along the chords of the elements), one panel each, for structures of one rod; on the deformed structure, of
one point (the last stored one), for others. N is positive in tension, Q acts along the left normal of the cut that faces the
second node, M is positive where it turns the rod to the left. On the structure N and Q are drawn to the left of the elements
when they are positive, M on the side in tension; the largest values are written. The file holds values at both ends of each
element. Between them curves are those of equilibrium under a load that is uniform along the element, where displacements are
stored at the same points, else straight."""

EXAMPLES = """\
examples:
  unilat-plot forces pipe.h5                        five points evenly spaced along the path
  unilat-plot forces pipe.h5 --label LP --quantities M
  unilat-plot forces frame.h5 --on structure --rows -1
"""

UNITS = {"N": "force", "Q": "force", "M": "moment"}
WORDS = {"N": "normal force N", "Q": "shear force Q", "M": "bending moment M"}
SIDE = {"N": 1.0, "Q": 1.0, "M": -1.0}      # of the element on which positive values are drawn: left +1
LARGEST = 0.18       # of the structure's size: the largest value of a diagram on it
ALIKE = 1e-3         # of the largest value: differences that a reader does not see
ROUNDING = 1e-6      # of the largest value: not worth a number
NOTHING = 1e-12      # of what the other section forces are: rounding, drawn as nothing
PARTS = 200          # of a structure, with values at their ends: at least 8 and at most 32 an element
STAIRS = 8           # elements at least
FLAT = 0.5           # an element's own change beside the jump to the next: less is a step of stairs
STANDS_OUT = 12.0    # times the usual jump: one of its own
NARROWEST = 55.0     # [mm] a panel with numbers
LEGEND_ROW = 4.1     # [mm]


@style.drawing
def main(argv=None) -> int:
    parser = options.Parser("unilat-plot forces", DESCRIPTION, EXAMPLES)
    style.add_files(parser)
    add_points(parser, "curves")
    parser.add_argument("--quantities", type=quantity_list, default=list(UNITS), metavar="N,Q,M", help="which ones (default all)")
    parser.add_argument("--on", choices=("arc", "structure"), help="over the arc length, or on the deformed structure "
                        "(default: arc for structures of one rod)")
    style.add_axes(parser)
    style.add_output(parser, width=89, height=None)
    args = parser.parse_args(argv)
    if len(args.files) > 1:
        raise ResultsError("unilat-plot forces draws one result file")
    (results,) = everything = options.load(args)
    path = results.path_number(args.branch)
    stored = path.points_with("section_forces") if "section_forces" in path.field_names else np.zeros(0, dtype=int)
    chains = rod_chains(path.mesh)
    structure = args.on == "structure" or (args.on is None and len(chains) > 1)
    if structure:
        args.rows = args.rows or ([] if args.label or args.at or args.evenly else [-1])
        points = choose(path, args, stored, "section forces")
        if len(points) > 1:
            raise ResultsError(f"{path.filename}: on the structure one point is drawn, not {len(points)} (use --rows)")
        figure = on_structure(path, points[0], args)
    else:
        figure = over_arc(path, choose(path, args, stored, "section forces"), chains, args)
    return style.save(figure, args, everything, "forces")


def over_arc(path: Path, points: list[int], chains, args):
    """A panel a quantity, over the arc length; several rods one after the other."""
    caption, texts = names(path, points, args)
    columns = int(np.clip(args.width // style.entry_width(texts), 1, 4))
    below = LEGEND_ROW * (1 - (-len(points) // columns)) + 1.0
    heights = [34.0 if len(args.quantities) > 1 else 58.0] * len(args.quantities) + [below]
    total = args.height or sum(heights) + 12.0
    figure = style.new_figure(args.width, total, args.dpi, constrained_layout=True)
    outer = figure.add_gridspec(2, 1, height_ratios=(sum(heights[:-1]), below))
    panels = outer[0].subgridspec(len(args.quantities), 1).subplots(sharex=True, squeeze=False)[:, 0]
    starts = np.concatenate(([0.0], np.cumsum([chain.arc[-1, 1] for chain in chains])))
    everything = np.array([between_ends(shape_at(path, point), path.field("section_forces", point), parts(path)) for point in points])
    largest, usual = sizes(path, everything, starts[-1])
    for k, forces in enumerate(everything):
        for chain, start in zip(chains, starts):
            values, arc = along_chain(chain, forces), args.x_scale * (start + chain.arc)
            runs = stairs(values[:, :, :2])
            for axes, quantity in zip(panels, args.quantities):
                at, value = without_stairs(arc, args.y_scale * values[:, :, "NQM".index(quantity)], runs if quantity != "M" else [])
                axes.plot(at, value, color=shade(k, len(points)), linewidth=1.1, zorder=3)
    for axes, quantity in zip(panels, args.quantities):
        axes.axhline(0.0, color=style.REFERENCE, linewidth=0.5, zorder=1)
        for start in starts[1:-1]:
            axes.axvline(args.x_scale * start, color=style.REFERENCE, linewidth=0.5, linestyle=":", zorder=1)
        axes.set_ylabel(args.y_label or captions.column_label(Column(quantity, np.zeros(0), path.unit(UNITS[quantity])), args.y_scale))
        axes.margins(x=0.0)
        one = "NQM".index(quantity)
        if args.y_range:
            axes.set_ylim(args.y_range)
        elif largest[one] <= NOTHING * usual[one]:
            axes.set_ylim(-abs(args.y_scale) * usual[one] or -1.0, abs(args.y_scale) * usual[one] or 1.0)
    panels[-1].set_xlabel(args.x_label or captions.column_label(Column("arc length", np.zeros(0), path.unit("length")), args.x_scale))
    if args.x_range:
        panels[-1].set_xlim(args.x_range)
    if args.title:
        panels[0].set_title(args.title)
    legend = figure.add_subplot(outer[1])
    legend.set_axis_off()
    legend.legend(handles=[Line2D([], [], color=shade(k, len(points)), label=text) for k, text in enumerate(texts)], title=caption,
                  title_fontsize=8.5, alignment="left", ncol=columns, loc="center", borderaxespad=0.0, borderpad=0.0,
                  frameon=False, handlelength=1.8, columnspacing=1.4)
    return figure


def sizes(path: Path, forces: np.ndarray, length: float) -> tuple[np.ndarray, np.ndarray]:
    """Largest N, Q and M of section forces (..., 3), and what they are measured by: forces and a moment over the length are of one
    size, and of the size of EI over its square where nothing is stressed."""
    largest = np.max(np.abs(forces.reshape(-1, 3)), axis=0, initial=0.0)
    lever = np.array((1.0, 1.0, length))
    stiffness = path.mesh.bending_stiffness
    least = 0.0 if stiffness is None else float(np.min(stiffness, initial=np.inf)) / length**2
    return largest, max(np.max(largest / lever), least) * lever


def parts(path: Path) -> int:
    """Of an element: few elements are long."""
    return int(np.clip(PARTS // max(len(path.mesh.elements), 1), 8, 32))


def stairs(values: np.ndarray) -> list[np.ndarray]:
    """Runs of elements with about one value each of the forces (n, m, 2) at equal distances along them: every node between them takes
    a part of what changes, as of a foundation at nodes. A run ends at a jump that stands out, as of a load at a node."""
    inside = np.hypot(*(values[:, -1] - values[:, 0]).T)
    jumps = np.hypot(*(values[1:, 0] - values[:-1, -1]).T)
    steps = (FLAT * jumps > np.maximum(inside[1:], inside[:-1])) & (jumps > ROUNDING * np.max(np.abs(values), initial=0.0))
    runs = []
    for run in np.split(np.arange(len(values)), np.flatnonzero(~steps) + 1):
        if len(run) >= STAIRS:
            runs += np.split(run, np.flatnonzero(jumps[run[:-1]] > STANDS_OUT * np.median(jumps[run[:-1]])) + 1)
    return runs


def without_stairs(arc: np.ndarray, values: np.ndarray, runs: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Places and values of a curve, of arc lengths (n, 2) at both ends and values (n, m) at equal distances along elements. Through
    runs of stairs the curve goes by the middles of the elements."""
    at = list(np.linspace(arc[:, 0], arc[:, 1], values.shape[1], axis=1))
    found = list(values)
    for run in runs:
        for element in run:
            at[element], found[element] = arc[element].mean(keepdims=True), values[element, [0, -1]].mean(keepdims=True)
        first, last = run[0], run[-1]
        at[first], found[first] = np.append(arc[first, 0], at[first]), np.append(values[first, 0], found[first])
        at[last], found[last] = np.append(at[last], arc[last, 1]), np.append(found[last], values[last, -1])
    return np.concatenate(at), np.concatenate(found)


def on_structure(path: Path, point: int, args):
    """A panel a quantity: the diagram beside the axis of the deformed rods."""
    moved = shape_at(path, point)
    shape = moved or Shape(path.mesh)
    forces = between_ends(moved, path.field("section_forces", point), parts(path))
    nodes = shape.nodes
    size = float(np.hypot(*(nodes.max(axis=0) - nodes.min(axis=0))))
    largest, usual = sizes(path, forces, size)
    forces = np.where(largest <= NOTHING * usual, 0.0, forces)
    diagrams = {quantity: [diagram(shape, element, SIDE[quantity] * LARGEST * size * values / scale)
                           for element, values in enumerate(forces[:, :, "NQM".index(quantity)])]
                for quantity in args.quantities
                for scale in [np.max(np.abs(forces[:, :, "NQM".index(quantity)])) or 1.0]}
    everywhere = np.concatenate([nodes] + [piece for pieces in diagrams.values() for piece in pieces])
    margin = 0.14 * size
    limits = np.array((everywhere.min(axis=0) - margin, everywhere.max(axis=0) + margin))
    wide, tall = limits[1] - limits[0]
    n = len(args.quantities)
    columns = min(n, max(1, int(args.width // NARROWEST))) if tall > 0.6 * wide else 1
    rows = -(-n // columns)
    panel = (args.width - 3.0 * (columns + 1)) / columns
    total = args.height or rows * (panel * tall / wide + 6.0) + 8.0
    figure = style.new_figure(args.width, total, args.dpi, constrained_layout=True)
    caption, (text,) = names(path, [point], args)
    figure.suptitle(args.title or f"{caption} {text}", fontsize=9.5)
    texts = []
    for k, (quantity, pieces) in enumerate(diagrams.items()):
        axes = figure.add_subplot(rows, columns, k + 1)
        for obstacle in path.obstacles_at(point):
            draw_obstacle(axes, obstacle, limits, 1.0)
        for piece in pieces:
            axes.add_patch(Polygon(piece, closed=True, facecolor=style.COLOURS[0], alpha=0.25, linewidth=0))
            half = len(piece) // 2
            axes.plot(*piece[:half].T, color=style.COLOURS[0], linewidth=0.7, zorder=3)
        for curve in shape.curves():
            axes.plot(*curve.T, color=style.INK, linewidth=1.2, zorder=4)
        values = args.y_scale * forces[:, :, "NQM".index(quantity)]
        power = power_of_ten(values)
        texts.append((axes, largest_values(values / 10.0**power, pieces)))
        axes.set_xlim(limits[:, 0])
        axes.set_ylim(limits[:, 1])
        axes.set_aspect("equal")
        axes.set_axis_off()
        unit = f" {captions.escape(path.unit(UNITS[quantity]))}" if path.units else ""
        factor = f"$10^{{{power}}}$" if power else ""
        axes.set_title(WORDS[quantity] + (f" ({(factor + unit).strip()})" if factor or unit else ""), pad=2.0)
    for axes, values in texts:
        place_labels(axes, values)
    return figure


def diagram(shape: Shape, element: int, offsets: np.ndarray) -> np.ndarray:
    """Closed polygon between the axis of an element and its offsets to the left at equal distances: first the offset curve."""
    t = np.linspace(0.0, 1.0, len(offsets))
    axis = shape.piece(element, t)
    tangent = np.gradient(axis, axis=0)
    tangent /= np.hypot(*tangent.T)[:, None]
    left = np.column_stack((-tangent[:, 1], tangent[:, 0]))
    return np.concatenate((axis + offsets[:, None] * left, axis[::-1]))


def power_of_ten(values: np.ndarray) -> int:
    """A factor in thousands that leaves numbers short; 0 where they are."""
    largest = np.max(np.abs(values), initial=0.0)
    if largest == 0.0 or 1e-2 <= largest < 1e5:
        return 0
    return int(3 * np.floor(np.log10(largest) / 3.0))


def largest_values(values: np.ndarray, pieces: list[np.ndarray]) -> list[tuple]:
    """Largest and least value, to be written at the diagram: (x, y, text, colour)."""
    found = []
    flat, largest = values.ravel(), np.max(np.abs(values))
    for extreme in (np.max(flat), np.min(flat)):
        alike = np.flatnonzero(np.abs(flat - extreme) <= ALIKE * largest)      # of a rod with one value, in its middle
        at = int(alike[len(alike) // 2])
        element, place = divmod(at, values.shape[1])
        if abs(values[element, place]) <= ROUNDING * np.max(np.abs(values)):
            continue
        tip = pieces[element][place]
        found.append((float(tip[0]), float(tip[1]), f"{values[element, place]:.4g}".replace("-", "\N{MINUS SIGN}"), style.INK))
    return found


def quantity_list(text: str) -> list[str]:
    words = [word.strip().upper() for word in text.split(",") if word.strip()]
    if not words or any(word not in UNITS for word in words):
        raise argparse.ArgumentTypeError(f"'{text}' is not a list of some of N,Q,M")
    return list(dict.fromkeys(words))

"""Draw the model of a deck before it is run: rods, nodes, supports, loads, hinges, obstacles, sets."""

from __future__ import annotations

import os
import tempfile

import matplotlib.patheffects as patheffects
import numpy as np
from matplotlib.lines import Line2D

from .. import options
from ..program import find_program, write_model
from ..results import Results, ResultsError, read_results
from ..results.mirror import mirror_line, mirrored
from ..results.model_parts import times
from ..results.rod_chains import rod_chains
from ..results.rod_shape import Shape
from . import shape, style
from .force_drawing import draw_arrow
from .label_placing import uncover
from .model_drawing import ARROW, LOAD, draw_loads, draw_supports, hide_outside, load_corners, load_names
from .obstacle_drawing import draw_obstacle

DESCRIPTION = """\
Draw the model of a deck before it is run: the rods with their nodes, supports, springs, hinges, rigid bars, obstacles, and the loads
of a step at load factor 1 (of the first step that has loads, when none is named). The program reads the deck, so whatever is wrong
with it is told as in a run. A result file is drawn as well."""

EXAMPLES = """\
examples:
  unilat-plot model ring.inp
  unilat-plot model frame.inp --labels nodes --set H=2
  unilat-plot model beam.inp --step 2 --nset TIP -o beam.pdf
"""

MOST_LABELS = 40        # nodes that are numbered without being asked for
SET_COLOURS = style.COLOURS[3:]


@style.drawing
def main(argv=None) -> int:
    parser = options.Parser("unilat-plot model", DESCRIPTION, EXAMPLES)
    parser.add_argument("file", metavar="DECK", help="deck, or result file of unilat (HDF5)")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", dest="settings",
                        help="another value for a *PARAMETER of the deck; may be repeated")
    parser.add_argument("--program", metavar="FILE", help="unilat (default: the variable UNILAT, else on the PATH)")
    parser.add_argument("--step", type=int, metavar="N", help="loads of the N-th step (default: the first that has loads)")
    parser.add_argument("--labels", choices=("ends", "nodes", "elements", "none"), default="ends",
                        help="numbers: of the nodes where rods begin, end or are held (default), of all nodes, of elements, or none")
    parser.add_argument("--nset", action="append", default=[], metavar="NAME", help="show the nodes of a set; may be repeated; `all`")
    parser.add_argument("--mirror", type=mirror_line, metavar="x=X|y=Y", help="add the mirror image over this line")
    parser.add_argument("--stretch-y", type=options.positive, default=1.0, metavar="F", help="draw y F times larger than x")
    parser.add_argument("--no-axes", action="store_true", help="leave out axes and frame")
    style.add_axes(parser, scales=False)
    style.add_output(parser, width=120, height=None)
    args = parser.parse_args(argv)
    args.scale = 1.0
    results = model_of(args.file, args.settings, args.program)
    figure = picture(results, args)
    args.output = args.output or f"{os.path.splitext(os.path.basename(args.file))[0]}-model.{args.format or 'png'}"
    return style.save(figure, args, [results], "model", False)


def model_of(filename: str, settings: list[str], program: str | None = None) -> Results:
    """The model of a deck as the program understands it, or that of a result file."""
    try:
        with open(filename, "rb") as file:
            is_hdf5 = file.read(8) == b"\x89HDF\r\n\x1a\n"
    except OSError as problem:
        raise ResultsError(f"{filename}: cannot be read: {problem.strerror or problem}") from problem
    if is_hdf5:
        return read_results(filename)
    with tempfile.TemporaryDirectory() as folder:
        name = os.path.join(folder, "model.h5")
        write_model(find_program(program), filename, settings, name)
        return read_results(name)


def picture(results: Results, args):
    """The figure."""
    home = Shape(results.mesh)
    step = step_to_draw(results, args.step)
    loads = times(results.loads[step], 1.0) if step else None
    curves = mirrored(home.curves(), args.mirror)
    everything = np.concatenate(curves + [home.nodes])
    low, high = everything.min(axis=0), everything.max(axis=0)
    size = float(max((high - low) * (1.0, args.stretch_y)))
    if loads is not None:
        corners = load_corners(results, loads, home, size, args.stretch_y)
        everything = np.concatenate([everything, *mirrored([corners], args.mirror)])
        low, high = everything.min(axis=0), everything.max(axis=0)
    for _ in range(2):      # obstacles that can be touched belong to the picture, as far as they are not large beside it
        for obstacle in results.obstacles.values():
            near = nearest(obstacle, 0.5 * (low + high), size)
            low, high = np.minimum(low, near.min(axis=0)), np.maximum(high, near.max(axis=0))
    margin = 0.09 * max((high - low) * (1.0, args.stretch_y)) * np.array((1.0, 1.0 / args.stretch_y))
    limits = np.array((low - margin, high + margin))
    for axis, wanted in enumerate((args.x_range, args.y_range)):
        limits[:, axis] = wanted or limits[:, axis]

    sets = chosen_sets(results, args.nset)
    handles = [Line2D([], [], color=style.INK, linewidth=1.4, label="rods")]
    layout = shape.Layout(args, limits, 1, 5 + len(sets) + len(results.loads))
    figure = style.new_figure(args.width, args.width, args.dpi)
    axes = figure.add_axes((0.1, 0.1, 0.8, 0.8))
    for obstacle in results.obstacles.values():
        draw_obstacle(axes, obstacle, limits, args.stretch_y, style.CONTACT)
    if results.obstacles:
        names = ", ".join(results.obstacles)
        handles.append(Line2D([], [], color=style.CONTACT, linewidth=0.9, label=names if len(names) < 28 else "obstacles"))
    for curve in curves:
        axes.plot(*curve.T, color=style.INK, linewidth=1.4, zorder=4)
    many = len(home.nodes) > 60
    for spot in mirrored([home.nodes], args.mirror):
        axes.plot(*spot.T, ".", color=style.INK, markersize=2.2 if many else 3.4, zorder=5)
    for bar in mirrored(list(home.nodes[results.mesh.links]), args.mirror):
        axes.plot(*bar.T, color=style.INK, linewidth=2.8, zorder=4)
    for spot in mirrored([home.nodes[results.mesh.hinges]], args.mirror):
        axes.plot(*spot.T, color=style.INK, zorder=6.2, **style.HINGE)
    if len(results.mesh.hinges):
        handles.append(Line2D([], [], color=style.INK, label="hinge", **style.HINGE))
    draw_supports(axes, results, home.nodes, mirror=args.mirror, size=8.0)
    for number, (name, nodes) in enumerate(sets.items()):
        colour = SET_COLOURS[number % len(SET_COLOURS)]
        for spot in mirrored([home.nodes[nodes]], args.mirror):
            axes.plot(*spot.T, "o", markersize=6.5, markerfacecolor="none", markeredgecolor=colour, markeredgewidth=1.0, zorder=5.5)
        handles.append(Line2D([], [], marker="o", markerfacecolor="none", color=colour, linestyle="none", label=f"set {name}"))
    if loads is not None:
        drawn = draw_loads(axes, results, loads, home, size, 1.0, args.stretch_y, args.mirror)
        for number, motion in zip(loads.moved_obstacle, loads.motion):
            obstacle = next(each for each in results.obstacles.values() if each.number == number)
            start = nearest(obstacle, 0.5 * (low + high), size).mean(axis=0)
            draw_arrow(axes, start, start + ARROW * size * motion / np.hypot(*motion), LOAD, style_of="->", width=0.9)
            drawn = True
        handles += [Line2D([], [], color=LOAD, linewidth=0.8, label=text) for text in load_names(loads) or (["loads"] if drawn else [])]
    hide_outside(shape.finish(axes, args, limits, first=True, unit=results.unit("length")))
    layout.measure(handles, len(handles))
    layout.place(figure, [axes])
    write_labels(axes, results, home, args)
    uncover(axes)
    title = f"step {step}: {results.loads[step].name}" if step and len(results.loads) > 1 else None
    layout.legend(axes, Legend(handles, title))
    if args.title:
        figure.text(0.5, 1.0 - 1.5 / layout.height, args.title, fontsize=9.5, ha="center", va="top")
    return figure


class Legend:
    """What a layout needs to know of the picture for its legend."""

    def __init__(self, handles: list, caption: str | None):
        self.handles, self.caption = handles, caption


def nearest(obstacle, middle: np.ndarray, size: float) -> np.ndarray:
    """Points (n, 2) of an obstacle's surface near a place."""
    if obstacle.kind == "circle":
        angle = np.linspace(0.0, 2.0 * np.pi, 91)
        points = obstacle.centre + obstacle.radius * np.column_stack((np.cos(angle), np.sin(angle)))
    elif obstacle.kind in ("line", "soil"):
        along = (obstacle.points[1] - obstacle.points[0]) / np.hypot(*(obstacle.points[1] - obstacle.points[0]))
        points = (obstacle.points[0] + ((middle - obstacle.points[0]) @ along) * along)[None, :]
    else:
        points = obstacle.surface if obstacle.surface is not None else obstacle.points
    near = points[np.hypot(*(points - middle).T) < 1.6 * size]
    return near if len(near) else middle[None, :]


def step_to_draw(results: Results, wanted: int | None) -> int | None:
    """Number of the step whose loads are drawn; None when there is none."""
    if wanted is not None:
        if wanted not in results.loads:
            raise ResultsError(f"{results.filename}: no step {wanted} (it has {len(results.loads)})")
        return wanted
    some = [step for step, loads in results.loads.items()
            if any(len(getattr(loads, name)) for name in ("force", "line_force", "pressure", "strain", "displacement", "motion", "pole"))]
    return some[0] if some else None


def chosen_sets(results: Results, wanted: list[str]) -> dict[str, np.ndarray]:
    """The node sets to show."""
    known = {name.lower(): name for name in results.sets}
    if wanted == ["all"]:
        return results.sets
    for name in wanted:
        if name.lower() not in known:
            raise ResultsError(f"no node set '{name}' (known: {', '.join(results.sets) or 'none'})")
    return {known[name.lower()]: results.sets[known[name.lower()]] for name in wanted}


def write_labels(axes, results: Results, home: Shape, args):
    """Numbers of nodes or elements."""
    if args.labels == "none":
        return
    mesh = results.mesh
    if args.labels == "elements":
        spots = [(home.piece(element, np.array([0.5]))[0], str(label)) for element, label in enumerate(mesh.element_label)]
    else:
        rows = np.arange(len(mesh.node_label))
        if args.labels == "ends":
            ends = {int(node) for chain in rod_chains(mesh) for element in chain.elements[[0, -1]] for node in mesh.elements[element]
                    if np.sum(mesh.elements == node) != 2}
            ends |= set(results.supports.node.tolist()) | {int(node) for loads in results.loads.values() for node in loads.node}
            ends -= set(mesh.releases[:, 1].tolist())       # of a joint the node that the deck knows
            rows = np.array(sorted(ends) if len(ends) <= MOST_LABELS else [], dtype=int)
        spots = [(home.nodes[row], str(mesh.node_label[row])) for row in rows]
    for place, text in spots:
        note = axes.annotate(text, place, xytext=(4.0, 4.0), textcoords="offset points", fontsize=7.0, color=style.COLOURS[0], zorder=7,
                             annotation_clip=True)
        note.set_path_effects([patheffects.withStroke(linewidth=1.6, foreground="white")])


__all__ = ["main", "model_of", "picture"]

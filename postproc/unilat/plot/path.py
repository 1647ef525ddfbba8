"""Draw load paths and their branches: any path quantity or monitor against any other."""

from __future__ import annotations

import numpy as np
from matplotlib.lines import Line2D

from .. import captions, options
from ..results import Branch, Column, Path, Results
from . import path_curves, references, style
from .label_placing import place_labels

DESCRIPTION = """\
Draw a path of equilibrium points of one or more result files: any path quantity or monitor against any other,
the load factor over the first monitor when nothing else is asked. Branches are drawn with the path that they leave: a
bifurcation diagram. Stable parts (no unstable direction) are solid, unstable ones dashed; critical points
are marked by their labels, LP and BP with their load factor: LP limit point, BP bifurcation, TP turning point of a
monitor, C+ contact gained, C- contact lost, UZ user value, EP end. Error bars of the discretisation are drawn where the
file has them, between neighbouring points as a band. Between computed points the curve follows the tangents of the
path; it has kinks at contact events, bifurcations, new steps, sudden turns. --points shows what was computed."""

EXAMPLES = """\
examples:
  unilat-plot path ring.h5
  unilat-plot path ring.h5 --x v --y load_factor --reference ring.csv --ref-x v --ref-y p --ref-name exact
  unilat-plot path coarse.h5 fine.h5 --name "40 elements" --name "320 elements" -o ring.pdf
  unilat-plot path column.h5 --x mid --x-scale 50 --x-label '$y/d$' --y-scale 0.02533 --mark LP,C+,C- --values
  unilat-plot path arch.h5 --x u --branches none
  unilat-plot path ring.h5 --list
"""

THINNEST_BAR = 0.002   # of what the path spans along y: half a line's width
MOST_OF_A_KIND = 4  # labels of the paths of several files
MOST_NAMED = 8     # branches with a colour and a legend entry of their own


@style.drawing
def main(argv=None) -> int:
    parser = options.Parser("unilat-plot path", DESCRIPTION, EXAMPLES)
    style.add_files(parser)
    parser.add_argument("--x", metavar="NAME", help="quantity along x (default: the first monitor, else point)")
    parser.add_argument("--y", metavar="NAME", default="load_factor", help="quantity along y (default load_factor)")
    parser.add_argument("--list", action="store_true", help="list the quantities of the files and stop")
    parser.add_argument("--branches", choices=("all", "none"), default="all",
                        help="draw the branches of the path, too (default), or the path of the steps alone")
    path_curves.add_step(parser)
    path_curves.add_marks(parser, "LP,BP,TP,C+,C-,UZ")
    parser.add_argument("--values", action="store_true", help="write the value of y beside all labels")
    parser.add_argument("--points", action="store_true", help="show every computed point as a dot")
    style.add_axes(parser)
    references.add_reference(parser)
    style.add_output(parser, width=89, height=70)
    args = parser.parse_args(argv)
    everything = options.load(args)
    if args.list:
        return list_quantities(everything)

    figure, axes = style.new_axes(args)
    published = references.draw_references(axes, args)
    diagram = Diagram(axes, args)
    handles = []
    for k, (results, name) in enumerate(zip(everything, style.names(args, everything))):
        branches = list(results.branches.values()) if args.branches == "all" else []
        branches = [branch for branch in branches if branch.n_points > 0]
        steps = diagram.steps(results) if len(everything) == 1 else []
        others = max(len(steps), 1)      # colours that branches do not have
        looks = branch_looks(branches, others) if len(everything) == 1 else {}
        look = style.look(k)
        by_step = {step: style.look(number) for number, step in enumerate(steps)}
        diagram.draw(results, results, look, by_step)
        for branch in branches:
            other = style.look(others) if len(everything) == 1 else look
            diagram.draw(results, branch, looks.get(branch.name, other))
        alone = len(everything) == 1 and not published and not args.name
        if steps:
            handles += [Line2D([], [], label=path_curves.step_name(results, step), **each) for step, each in by_step.items()]
        else:
            handles.append(Line2D([], [], label="main path" if alone and branches else name, **look))
        handles += [Line2D([], [], label=captions.escape(title), **other) for title, other in looks.items()]
        if branches and len(everything) == 1 and not looks:
            handles.append(Line2D([], [], label="branches", **style.look(others)))
    handles += diagram.crowded(len(everything))
    if len(handles) == 1 and not published:
        handles = [Line2D([], [], color=style.COLOURS[0], label="stable")] if diagram.unstable else []
    if diagram.unstable:
        colour = style.COLOURS[0] if len(handles) <= 1 else style.INK
        handles.append(Line2D([], [], color=colour, linestyle=path_curves.UNSTABLE, label="unstable"))
    style.finish_axes(axes, args, captions.column_label(diagram.x, args.x_scale),
                      captions.column_label(diagram.y, args.y_scale))
    style.legend(axes, handles + published, loc="best")
    place_labels(axes, diagram.texts)
    return style.save(figure, args, everything, "path")


class Diagram:
    """The curves of one picture, and the labels that are still to be placed."""

    def __init__(self, axes, args):
        self.axes, self.args, self.unstable, self.texts = axes, args, False, []
        self.x: Column | None = None       # of the first path drawn
        self.y: Column | None = None

    def crowded(self, files: int) -> list[Line2D]:
        """Of several files, labels of one kind that would be a heap are left to their marks; legend entries that say what these are."""
        kinds = [str(text).split()[0] for _, _, text, _ in self.texts]
        heaps = [kind for kind in dict.fromkeys(kinds) if files > 1 and kinds.count(kind) > MOST_OF_A_KIND]
        self.texts = [text for text, kind in zip(self.texts, kinds) if kind not in heaps]
        return [Line2D([], [], marker=path_curves.MARKERS.get(kind.replace("\N{MINUS SIGN}", "-"), "o"), color=style.INK, linestyle="none", markersize=3.8,
                       label=kind) for kind in heaps]

    def steps(self, results: Results) -> list[int]:
        """Numbers of the steps that are told apart: several over the same load factor."""
        args = self.args
        names = (args.x or next(iter(results.monitors), "point"), args.y)
        if args.step is not None or not any(options.numbers(results, name).name == "load_factor" for name in names):
            return []
        return path_curves.drawn_steps(results)

    def draw(self, results: Results, path: Path, look: dict, by_step: dict[int, dict] | None = None):
        """The path of the steps of a file, or one of its branches, with marks; `by_step`: looks of steps that have their own."""
        args = self.args
        step = path_curves.step_number(results, args.step)
        x_name = args.x or next(iter(results.monitors), "point")
        x, y = options.numbers(path, x_name), options.numbers(path, args.y)
        self.x, self.y = self.x or x, self.y or y
        # All paths of a file are drawn together.
        spans = tuple(scale * max(np.ptp(options.numbers(each, name).values) for each in (results, *results.branches.values())
                                  if each.n_points > 0) for scale, name in ((abs(args.x_scale), x_name), (abs(args.y_scale), args.y)))
        root = None
        if isinstance(path, Branch):
            parent, row = results.path_number(path.of), path.point - 1
            if 0 <= row < parent.n_points and x.name != "point" and y.name != "point":
                root = tuple(scale * options.numbers(parent, name).values[row]
                             for scale, name in ((args.x_scale, x_name), (args.y_scale, args.y)))
        self.unstable |= path_curves.draw_path(self.axes, path, path_curves.scaled(x, args.x_scale), path_curves.scaled(y, args.y_scale),
                                               (lambda number: by_step[number]) if by_step else look, root=root, step=step,
                                               spans=spans)
        if args.points:
            own = path_curves.rows_of_step(path, step)
            self.axes.plot(args.x_scale * x.values[own], args.y_scale * y.values[own], ".", color=look["color"], markersize=2.6,
                           zorder=5)

        def place(critical):
            return (args.x_scale * path_curves.critical_value(path, critical, x),
                    args.y_scale * path_curves.critical_value(path, critical, y))

        def value(critical):
            if args.values:
                return place(critical)[1]
            if critical.label not in ("LP", "BP"):
                return None
            factor = {x.name: args.x_scale, y.name: args.y_scale}.get("load_factor", 1.0)
            return factor * critical.load_factor

        self.draw_errors(path, x, y, look["color"], step)
        for number, each in (by_step or {step: look}).items():
            self.texts += path_curves.draw_marks(self.axes, path, args.mark, place, each["color"], value, number)

    def draw_errors(self, path: Path, x: Column, y: Column, colour: str, step: int | None):
        """Error bars at critical points that are not as thin as a line, a band between points that have them."""
        args = self.args
        if y.name not in path.errors:
            return
        error = abs(args.y_scale) * path.errors[y.name].values
        known = np.isfinite(error) & path_curves.rows_of_step(path, step)
        at, value = args.x_scale * x.values, args.y_scale * y.values
        seen = known & (error > THINNEST_BAR * np.ptp(value))
        if not seen.any():
            return
        marked = [critical.point - 1 for critical in path.critical if seen[critical.point - 1]]
        # The path sets the scale: bars that are wider than the picture go through it.
        limits = self.axes.dataLim.frozen()
        self.axes.errorbar(at[marked], value[marked], yerr=error[marked], fmt="none", ecolor=colour, elinewidth=0.7,
                           capsize=2.0, zorder=4)
        self.axes.fill_between(at, value - error, value + error, where=known, color=colour, alpha=0.2, linewidth=0.0,
                               zorder=1)
        self.axes.dataLim.set(limits)


def branch_looks(branches: list[Branch], first: int = 1) -> dict[str, dict]:
    """A look for every name of branches (both sides have the same), from a number on; none at all when they are too many."""
    names = list(dict.fromkeys(branch.name for branch in branches))
    if len(names) > MOST_NAMED:
        return {}
    return {name: style.look(k + first) for k, name in enumerate(names)}


def list_quantities(everything) -> int:
    for results in everything:
        print(f"{results.filename}: {results.n_points} points, {results.status}")
        for name in results.column_names():
            column = results.column(name)
            print(f"   {name:<20} {column.units:<10} {column.description}".rstrip())
        for branch in results.branches.values():
            side = "plus" if branch.side > 0 else "minus"
            print(f"   branch {branch.number:<13} {branch.name}, {side}: {branch.n_points} points from point "
                  f"{branch.point} of {f'branch {branch.of}' if branch.of else 'the path'}")
    return 0

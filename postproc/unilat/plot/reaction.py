"""Draw contact reactions and gaps along the rod."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.ticker import NullLocator

from .. import captions, options
from ..chosen_points import add_points, choose, names, shade
from ..results import Column, Path, ResultsError
from ..results.candidate_chain import Chain, ChainState
from ..results.contact_forces import contact_forces
from ..results.force_glyphs import value_text
from . import style
from .contact import contact_name
from .force_drawing import draw_arrow
from .label_placing import place_labels

DESCRIPTION = """\
Draw what contact presses along the rod at chosen points of the path, the gap below it and the contact regions as bars
above it. The deck must have asked for *FIELD OUTPUT with REACTION, and with GAP for the gap. Reactions that act all along
the elements are bands; forces at touched points and at the ends of lines are arrows with their values, on an axis of their own
where there is pressure, too. Reactions at nodes are markers on stems, their density is the reaction over half of both elements
beside the node. Arc lengths are stress-free ones along the candidates of the contact, angles are those of the nodes about
the centre of the obstacle and count from its reference direction. Contacts and files are drawn side by side; options for
the y axis are for the reaction, or for the gap when it is drawn alone."""

EXAMPLES = """\
examples:
  unilat-plot reaction ring.h5                             five points evenly spaced along the path
  unilat-plot reaction ring.h5 --label LP --against angle  at the limit point
  unilat-plot reaction beam.h5 --at 0.5,1,2 --no-gap       where the load factor is about that
  unilat-plot reaction pipe.h5 --quantity reaction --evenly 3
  unilat-plot reaction column.h5 --contact 2 --rows 10,20 -o column.pdf
  unilat-plot reaction soft.h5 hard.h5 --label LP --width 180
"""

FIELDS = {"density": ("reaction_density", Column("reaction", np.zeros(0), "force/length"), "reactions"),
          "reaction": ("reaction", Column("reaction", np.zeros(0), "force"), "reactions"),
          "gap": ("gap", Column("gap", np.zeros(0), "length"), "gaps")}
FORCE = Column("contact force", np.zeros(0), "force")
MOST_VALUES = 12     # forces with their values,
NAMED = 1e-3         # of the largest one at least
NO_FORCE = 1e-6      # of the largest one: rounding
MOST_STEMS = 25      # nodes that press at one point of the path; of more those between two others have no stems
BAR = 1.3            # [mm] of the picture's height
LEGEND_ROW = 4.1


@style.drawing
def main(argv=None) -> int:
    parser = options.Parser("unilat-plot reaction", DESCRIPTION, EXAMPLES)
    style.add_files(parser)
    parser.add_argument("--quantity", choices=tuple(FIELDS),
                        help="reaction per stress-free length with the forces at points, reaction of each node (its share where "
                             "reactions are distributed; the forces alone of contact anywhere along the rod), or the gap alone "
                             "(default: density, where reactions are stored)")
    parser.add_argument("--no-gap", action="store_true", help="leave out the gap below the reactions")
    parser.add_argument("--contact", type=int, metavar="N", help="only the N-th *CONTACT of the deck")
    parser.add_argument("--against", choices=("arc", "angle"), default="arc",
                        help="arc length (default) or the angle about the centre of a circle or arc")
    add_points(parser, "curves")
    style.add_axes(parser)
    style.add_output(parser, width=89, height=None)
    args = parser.parse_args(argv)
    everything = options.load(args)

    paths = [results.path_number(args.branch) for results in everything]
    quantities = choose_quantities(paths, args)
    field, _, what = FIELDS[quantities[0]]
    columns, titles, handles = [], [], []
    for path, name in zip(paths, style.names(args, everything)):
        points = choose(path, args, path.points_with(field), what)
        chains = choose_contacts(path, args)
        columns += [(path, points, chain) for chain in chains]
        titles += [", ".join(([name] if len(paths) > 1 else []) +
                             ([contact_name(path, chain.number)] if len(chains) > 1 else [])) for chain in chains]
        caption, texts = names(path, points, args)
        handles.append((caption, [Line2D([], [], color=shade(k, len(points)), label=text) for k, text in enumerate(texts)]))

    figure, panels = layout(args, len(columns), len(quantities), handles)
    labels = []
    for column, (path, points, chain), title in zip(panels.T, columns, titles):
        pushes = Pushes(column[1], chain, quantities[0], args)
        for k, point in enumerate(points):
            state, colour = ChainState(chain, point, args.against == "angle"), shade(k, len(points))
            draw_regions(column[0], state, k, colour, args.x_scale)
            for quantity, axes in zip(quantities, column[1:]):
                if quantity == "gap" or not pushes.known:
                    draw_curve(axes, state, quantity, colour, args.x_scale, args.y_scale if axes is column[1] else 1.0)
                else:
                    pushes.add(state, colour)
        labels.append(pushes)
        column[0].set_title(title, pad=3.0)
        column[0].set_ylim(len(points) - 0.5, -0.5)
    finish(panels, quantities, args, paths[0])
    for axes, (_, _, chain) in zip(panels[-1], columns):
        if len(chain.home) == 1:        # a stop of a node: there is no other place
            axes.set_xlabel("")
            axes.xaxis.set_major_locator(NullLocator())
            axes.xaxis.set_minor_locator(NullLocator())
    for pushes in labels:
        pushes.draw(alone=not any(each.pressures for each in labels), last=pushes is labels[-1])
    return style.save(figure, args, everything, "reaction")


class Pushes:
    """What a contact anywhere along the rods pushes with, in one panel: pressures as bands, forces as arrows with their values."""

    def __init__(self, axes, chain: Chain, quantity: str, args):
        self.axes, self.chain, self.args, self.quantity = axes, chain, args, quantity
        self.stops = chain.known_obstacle and chain.path.obstacles[chain.obstacle_name.replace("/", "_")].kind == "gap"
        self.known = quantity != "gap" and (chain.points == "spans" and chain.path.has_force_lists or self.stops)
        self.forces: list[tuple[float, float, tuple]] = []      # place, value, colour
        self.pressures = False

    def add(self, state: ChainState, colour):
        forces, pressures = contact_forces(self.chain.path, state.point)
        at, scale = self.args.x_scale, self.args.y_scale
        around = self.chain.around
        for pressure in pressures:
            if pressure.contact != self.chain.number or self.quantity == "reaction":
                continue
            for turn in (0.0, around) if around > 0.0 else (0.0,):
                inside = (pressure.arc - turn >= 0.0) & ((around == 0.0) | (pressure.arc - turn <= around))
                if np.sum(inside) > 1:
                    x, y = at * state.place(pressure.arc[inside] - turn), scale * pressure.size[inside]
                    self.axes.plot(x, y, color=colour, linewidth=1.1, zorder=3)
                    self.axes.fill_between(x, 0.0, y, color=colour, alpha=0.16, linewidth=0.0, zorder=2)
                    self.pressures = True
        factor = scale if self.quantity == "reaction" else 1.0
        self.forces += [(at * float(state.place(force.arc % around if around > 0.0 else force.arc)), factor * force.size, colour) for force in forces
                        if force.contact == self.chain.number]

    def draw(self, alone: bool, last: bool):
        """The arrows; where there is pressure in a panel (not `alone`), over an axis of their own, with a label in the last one."""
        largest = max((value for _, value, _ in self.forces), default=0.0)
        self.forces = [force for force in self.forces if force[1] > NO_FORCE * largest]
        if not self.forces:
            if self.known and not self.pressures:
                self.axes.text(0.5, 0.5, "no contact force", transform=self.axes.transAxes, ha="center", va="center",
                               color=style.REFERENCE)
            return
        axes = self.axes if alone else self.axes.twinx()
        label = captions.column_label(in_units(FORCE, self.chain.path), self.args.y_scale if alone and self.quantity == "reaction" else 1.0)
        if last if not alone else not self.args.y_label and self.axes.get_ylabel():
            axes.set_ylabel(label)
        if not alone:
            axes.tick_params(axis="y", which="both", left=False)
            self.axes.tick_params(axis="y", which="both", right=False)
        top = max(value for _, value, _ in self.forces)
        for x, value, colour in self.forces:
            draw_arrow(axes, (x, value), (x, 0.0), colour, width=0.9, head=6.0)
        if not (self.args.y_range and alone):
            axes.set_ylim(0.0 if alone else -0.05 * top, 1.22 * top)
            if alone:
                axes.set_ylim(bottom=-0.05 * top)
        if not alone and not self.args.y_range:      # one zero line
            high = self.axes.get_ylim()[1]
            self.axes.set_ylim(-0.05 * high / 1.22, high)
        low, high = axes.get_xlim()
        if not self.pressures:       # arrows do not move limits
            xs = [x for x, _, _ in self.forces]
            home = self.args.x_scale * self.chain.home if self.args.against == "arc" else np.array(xs)
            low, high = min(min(xs), float(home.min())), max(max(xs), float(home.max()))
            margin = 0.03 * ((high - low) or 1.0)
            if not self.args.x_range:
                axes.set_xlim(low - margin, high + margin)
        named = sorted((force for force in self.forces if force[1] > NAMED * largest), key=lambda force: -force[1])[:MOST_VALUES]
        place_labels(axes, [(x, value, value_text(value), colour) for x, value, colour in named])


def in_units(column: Column, path: Path) -> Column:
    """A quantity in the units of the deck."""
    return replace(column, units=path.unit(column.units))


def choose_quantities(paths: list[Path], args) -> list[str]:
    """What the panels show, from top to bottom; every file must have it."""
    def stored(quantity: str) -> bool:
        return all(FIELDS[quantity][0] in path.field_names for path in paths)

    for path in paths:
        if path.contact is None:
            raise ResultsError(f"{path.filename}: the model has no contact")
    first = args.quantity or ("gap" if stored("gap") and not stored("density") else "density")
    for path in paths:
        if FIELDS[first][0] not in path.field_names:
            raise ResultsError(f"{path.filename}: no {FIELDS[first][2]} are stored (*FIELD OUTPUT, "
                               f"{'GAP' if first == 'gap' else 'REACTION'})")
    return [first] + (["gap"] if first != "gap" and stored("gap") and not args.no_gap else [])


def choose_contacts(path: Path, args) -> list[Chain]:
    """The contacts to draw."""
    n = len(path.contact.points)
    if args.contact is not None and not 1 <= args.contact <= n:
        raise ResultsError(f"{path.filename}: no contact {args.contact} (they run from 1 to {n})")
    return [Chain(path, number) for number in ([args.contact] if args.contact else range(1, n + 1))]


def layout(args, n_columns: int, n_panels: int, legends: list[tuple]):
    """A figure; its panels (1 for the bars and n_panels, n_columns); legends below, one for each file."""
    most = max(len(lines) for _, lines in legends)
    entry = style.entry_width([line.get_label() for _, lines in legends for line in lines])
    across = int(np.clip(args.width / len(legends) // entry, 1, 4))
    below = LEGEND_ROW * (1 - (-most // across)) + 1.0
    heights = [BAR * most + 1.0, *((48.0, 26.0)[:n_panels] if n_panels > 1 else (58.0,)), below]
    total = args.height or sum(heights) + 16.0
    figure = style.new_figure(args.width, total, args.dpi, constrained_layout=True)
    outer = figure.add_gridspec(2, 1, height_ratios=(sum(heights[:-1]), below))
    panels = outer[0].subgridspec(n_panels + 1, n_columns, height_ratios=heights[:-1]).subplots(
        sharex="col", sharey="row", squeeze=False)
    for k, (caption, lines) in enumerate(legends):
        axes = figure.add_subplot(outer[1].subgridspec(1, len(legends))[k])
        axes.set_axis_off()
        axes.legend(handles=lines, title=caption, title_fontsize=8.5, alignment="left", ncol=across, loc="center",
                    borderaxespad=0.0, borderpad=0.0, frameon=False, handlelength=1.8, columnspacing=1.4)
    return figure, panels


def draw_regions(axes, state: ChainState, row: int, colour, scale: float):
    """The contact regions at one point of the path: bars, and dots where contact is at one point of the rod."""
    for low, high in state.regions:
        ends = scale * state.place((low, high))
        if low == high:
            axes.plot(ends[:1], [row], ".", color=colour, markersize=3.0)
        else:
            axes.fill_between(ends, row - 0.36, row + 0.36, color=colour, linewidth=0)


def draw_curve(axes, state: ChainState, quantity: str, colour, x_scale: float, y_scale: float):
    """One quantity at one point of the path."""
    values = state.values(FIELDS[quantity][0])
    if values is None:      # its step asked for other fields
        return
    distributed = state.chain.points == "distributed"
    if quantity != "gap" and not (distributed and quantity == "density"):
        pressing = values != 0.0
        x, y = x_scale * state.x, y_scale * values
        between = np.convolve(pressing, (1, 1, 1))[1:-1] == 3
        stems = pressing & ~(between & (np.sum(pressing) > MOST_STEMS))
        axes.vlines(x[stems], 0.0, y[stems], color=colour, linewidth=0.6, zorder=3)
        axes.plot(x[pressing], y[pressing], ".", color=colour, markersize=3.2, zorder=4)
        return
    curves = state.within_regions(values) if quantity == "density" else [
        state.with_ends(values) if distributed else (state.arc, values)]
    for arc, y in curves:
        axes.plot(x_scale * state.place(arc), y_scale * y, color=colour, linewidth=1.1, zorder=3)


def finish(panels, quantities: list[str], args, path: Path):
    """Labels, limits and a line at zero."""
    angle = args.against == "angle"
    along = Column("angle" if angle else "arc length", np.zeros(0), "degree" if angle else path.unit("length"))
    for column, axes in np.ndenumerate(panels[0]):
        axes.tick_params(which="both", left=False, right=False, bottom=False, top=False, labelleft=False)
        axes.spines[:].set_visible(False)
        if column == (0,):
            axes.set_ylabel("contact", rotation=0, ha="right", va="center", fontsize=8.5)
    for row, quantity in enumerate(quantities, start=1):
        scale = args.y_scale if row == 1 else 1.0
        label = captions.column_label(in_units(FIELDS[quantity][1], path), scale)
        panels[row, 0].set_ylabel((args.y_label if row == 1 else None) or label)
        for axes in panels[row]:
            axes.axhline(0.0, color=style.REFERENCE, linewidth=0.5, zorder=1)
    if args.y_range:
        panels[1, 0].set_ylim(args.y_range)
    for axes in panels[-1]:
        axes.set_xlabel(args.x_label or captions.column_label(along, args.x_scale))
        if args.x_range:
            axes.set_xlim(args.x_range)
    if args.title:
        panels[0, 0].figure.suptitle(args.title, fontsize=9.5)

"""Draw where the contact begins and ends along the path."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from matplotlib.lines import Line2D

from .. import captions, options
from ..results import Column, ResultsError
from ..results.contact_history import End, ends, presses
from . import path_curves, references, style
from .label_placing import place_labels

DESCRIPTION = """\
Draw the history of every contact region: the angles (or arc lengths) at which it begins and ends, against the load
factor, a monitor or the number of the point. Unstable parts of the path are dashed. Angles count from the obstacle's
reference direction; arc lengths are stress-free ones along the candidates of the contact. A region that is one point
has one line. Where regions split or merge the ends between them begin or end. Contact without force, as of a rod that
lies in its cavity before any load, is left out when the first load ends it. With both ends of a single file as arc
lengths over a quantity that only grows (or falls), such as point, the region itself is tinted. Between computed points curves
are smooth as in unilat-plot path."""

EXAMPLES = """\
examples:
  unilat-plot contact ring.h5 --end start
  unilat-plot contact ring.h5 --end start --reference ring.csv --ref-x p --ref-y phi_deg --ref-name exact
  unilat-plot contact column.h5 --quantity arc --against point
  unilat-plot contact rigid.h5 winkler.h5 --against v --end start -o angles.pdf
"""

MOST_COLOURS = 6   # more ends than this share one colour
MOST_ENTRIES = 6   # in the legend, of ends or contacts in every step; of more the steps alone


@style.drawing
def main(argv=None) -> int:
    parser = options.Parser("unilat-plot contact", DESCRIPTION, EXAMPLES)
    style.add_files(parser)
    parser.add_argument("--quantity", choices=("angle", "arc"),
                        help="contact angle or arc length (default: angle, where no obstacle has one arc)")
    parser.add_argument("--end", choices=("start", "end", "both"), default="both",
                        help="which end of the regions (default both)")
    parser.add_argument("--against", metavar="NAME", default="load_factor",
                        help="load_factor (default), a monitor, point, or any path quantity")
    path_curves.add_step(parser)
    parser.add_argument("--contact", type=int, metavar="N", help="only the N-th *CONTACT of the deck")
    path_curves.add_marks(parser, "LP,BP")
    style.add_axes(parser)
    references.add_reference(parser)
    style.add_output(parser, width=89, height=70)
    args = parser.parse_args(argv)
    everything = options.load(args)

    found = [histories(results, args.contact) for results in everything]
    lines = [ends(group) for group in found]
    angle = choose_angle(everything, lines, args.quantity)
    sides = {"both": ("start", "end")}.get(args.end, (args.end,))
    figure, axes = style.new_axes(args)
    published = references.draw_references(axes, args)
    texts, handles, used, unstable, label = [], [], set(), False, None
    for k, (results, name) in enumerate(zip(everything, style.names(args, everything))):
        against = options.numbers(results, args.against)
        label = label or captions.column_label(against, args.x_scale)
        shown = path_curves.scaled(against, args.x_scale)
        x = shown.values
        step = path_curves.step_number(results, args.step)
        drawn = [line for line in lines[k] if line.side in sides and np.any(np.isfinite(curve(line, angle)))]
        looks = {line: style.look(k) for line in lines[k]} if len(everything) > 1 else end_looks(drawn)
        steps = several_steps(results, against, step, looks) if len(everything) == 1 else []
        opened = openings(lines[k]) if len(sides) == 2 else {}
        if len(everything) == 1 and not angle and len(sides) == 2:
            for history in found[0]:
                tint(axes, results, history, shown, args.y_scale, looks, step, opened)
        for line in lasting(without_twins(drawn)):
            rows, y = line.points - 1, args.y_scale * curve(line, angle)
            if line.line in opened and not angle:
                rows, y = np.append(rows[0] - 1, rows), np.append(args.y_scale * opened[line.line], y)
            look = step_look(looks, line, steps) if steps else looks[line]
            unstable |= path_curves.draw_path(axes, results, at_rows(shown, rows), Column("contact", y), look, first=rows[0], step=step)

            def place(critical, rows=rows, y=y):
                at = critical.point - 1 - rows[0]
                return (x[rows[at]], y[at]) if 0 <= at < len(rows) else (np.nan, np.nan)

            for number in steps or [step]:
                colour = (look(number) if steps else looks[line])["color"]
                texts += path_curves.draw_marks(axes, results, args.mark, place, colour, step=number)
        contacts = {line.contact: looks[line] for line in drawn}
        used |= {looks[line]["color"] for line in drawn}
        if len(everything) > 1 or published:
            handles.append(Line2D([], [], label=name, **style.look(k)))
        elif len(contacts) > 1:
            names = [(contact_name(results, contact), next(line for line in drawn if line.contact == contact)) for contact in contacts]
            handles += entries(results, names, looks, steps)
        else:
            handles += entries(results, end_names(drawn), looks, steps)
    if unstable:
        colour = style.COLOURS[0] if used == {style.COLOURS[0]} else style.INK
        if not handles:
            handles.append(Line2D([], [], color=colour, label="stable"))
        handles.append(Line2D([], [], color=colour, linestyle=path_curves.UNSTABLE, label="unstable"))
    what = "angle" if angle else "arc length"
    name = f"contact {what}" if args.end == "both" else f"{what} at the {args.end} of contact"
    quantity = Column(name, np.zeros(0), "degree" if angle else everything[0].unit("length"))
    style.finish_axes(axes, args, label, captions.column_label(quantity, args.y_scale))
    style.legend(axes, handles + published, loc="best")
    place_labels(axes, texts)
    return style.save(figure, args, everything, "contact")


def histories(results, number):
    """The histories to draw, none without force; an error when there are none."""
    if results.contact is None:
        raise ResultsError(f"{results.filename}: the model has no contact")
    found = results.contact.histories()
    if number is not None:
        n_contacts = results.contact.reaction_total.shape[1]
        if not 1 <= number <= n_contacts:
            raise ResultsError(f"{results.filename}: no contact {number} (they run from 1 to {n_contacts})")
        found = [history for history in found if history.contact == number]
    if not found:
        raise ResultsError(f"{results.filename}: nothing is in contact at any point")
    pressed = presses(results.contact)
    return [history for history in found if np.any(pressed[history.points - 1, history.contact - 1])] or found


def choose_angle(everything, lines, quantity) -> bool:
    """Whether angles are drawn, not arc lengths."""
    with_angle = [any(np.any(np.isfinite(line.angle)) for line in group) for group in lines]
    if quantity == "angle" and not all(with_angle):
        name = everything[with_angle.index(False)].filename
        raise ResultsError(f"{name}: no contact angles, the obstacle has no centre (use --quantity arc)")
    return all(with_angle) if quantity is None else quantity == "angle"


def end_looks(drawn: list[End]) -> dict[End, dict]:
    """In a single file contacts differ in colour; of a single contact the ends, when they are few."""
    keys = [line.contact for line in drawn]
    if len(set(keys)) == 1:
        keys = [line.line for line in drawn]
    numbers = {key: number for number, key in enumerate(dict.fromkeys(keys))}
    if len(numbers) > MOST_COLOURS and len({line.contact for line in drawn}) == 1:
        numbers = dict.fromkeys(numbers, 0)
    return {line: style.look(numbers[key]) for line, key in zip(drawn, keys)}


def several_steps(results, against: Column, wanted: int | None, looks: dict[End, dict]) -> list[int]:
    """Numbers of the steps that are told apart by colour: several over the same load factor."""
    if wanted is not None or against.name != "load_factor":
        return []
    found = path_curves.drawn_steps(results)
    return found if len(found) <= len(style.COLOURS) else []


def step_look(looks: dict[End, dict], line: End, steps: list[int]):
    """The look of an end in every step."""
    colours = list(dict.fromkeys(look["color"] for look in looks.values()))
    if len(colours) * len(steps) > MOST_ENTRIES:
        return lambda step: style.look(steps.index(step) if step in steps else 0)
    own = colours.index(looks[line]["color"])
    return lambda step: style.look(own + len(colours) * (steps.index(step) if step in steps else 0))


def entries(results, names: list[tuple[str, End]], looks: dict[End, dict], steps: list[int]) -> list[Line2D]:
    """Legend entries, when there is something to tell apart; of every step, where steps have looks of their own."""
    if steps and len(names) * len(steps) > MOST_ENTRIES:
        names = names[:1]
    if steps:
        return [Line2D([], [], label=", ".join(([name] if len(names) > 1 else []) + [path_curves.step_name(results, step)]),
                       **step_look(looks, line, steps)(step)) for step in steps for name, line in names
                if np.any(results.path["step"].values[line.points - 1] == step)]
    return [Line2D([], [], label=name, **looks[line]) for name, line in names] if len(names) > 1 else []


def between(number: int, drawn: list[End]) -> str:
    """What lies between both sides of a line when they first differ."""
    start, end = (next(line for line in drawn if line.line == number and line.side == side) for side in ("start", "end"))
    common = np.intersect1d(start.points, end.points)
    apart = [float(end.arc[end.points == point][0] - start.arc[start.points == point][0]) for point in common]
    if apart and apart[0] == 0.0 and not any(apart):
        return "contact at a point"
    differ = next((each for each in apart if each != 0.0), 0.0)
    return "ends of a gap" if differ < 0.0 else "ends of contact"


def end_names(drawn: list[End]) -> list[tuple[str, End]]:
    """What the lines of a single contact are: one entry for each that has a number of its own."""
    first: dict[int, End] = {}
    sides: dict[int, set] = {}
    for line in drawn:
        first.setdefault(line.line, line)
        sides.setdefault(line.line, set()).add(line.side)
    if len(first) > MOST_COLOURS:
        return []
    names = [("contact begins" if sides[line] == {"start"} else "contact ends" if sides[line] == {"end"} else between(line, drawn), end)
             for line, end in first.items()]
    count: dict[str, int] = {}
    found = []
    for name, end in names:
        count[name] = count.get(name, 0) + 1
        found.append((name if count[name] == 1 else f"{name} ({count[name]})", end))
    return found


def lasting(drawn: list[End]) -> list[End]:
    """Without those that are there at one computed point only, when they are many: at foundations without a load yet, and where
    contact comes node by node."""
    long = [line for line in drawn if len(line.points) > 1]
    return long if long and len(drawn) - len(long) > MOST_COLOURS else drawn


def without_twins(drawn: list[End]) -> list[End]:
    """Ends without those that are where the other end of the same region is: contact at one point."""
    starts = {(line.contact, line.points[0], tuple(line.arc)) for line in drawn if line.side == "start"}
    return [line for line in drawn if line.side == "start" or (line.contact, line.points[0], tuple(line.arc)) not in starts]


def at_rows(column: Column, rows: np.ndarray) -> Column:
    """The quantity at some points."""
    return replace(column, values=column.values[rows], rate=None if column.rate is None else column.rate[rows])


def openings(drawn: list[End]) -> dict[int, float]:
    """Where gaps open inside a region from one point to the next: in the middle of what they are first seen as, at the point before."""
    found = {}
    for number in dict.fromkeys(line.line for line in drawn):
        pair = {line.side: line for line in drawn if line.line == number}
        if set(pair) != {"start", "end"}:
            continue
        start, end = pair["start"], pair["end"]
        if start.points[0] == end.points[0] > 1 and start.arc[0] > end.arc[0]:
            found[number] = 0.5 * float(start.arc[0] + end.arc[0])
    return found


def tint(axes, results, history, shown, scale, looks, wanted, opened):
    """The region itself, when it is drawn over something that only grows or falls in a step.

    Of steps that go over the same values the last one, when none is `wanted`.
    """
    x = shown.values
    steps = results.path["step"].values if "step" in results.path else np.ones(results.n_points, dtype=int)
    colour = next((look["color"] for line, look in looks.items() if line.contact == history.contact
                   and line.line == history.start_line and line.side == "start"), style.COLOURS[0])
    points, start, end = joined(history, [line for line in looks if line.contact == history.contact], opened)
    for step in np.unique(steps[points - 1]) if wanted is None else [wanted]:
        whole, later, part = x[steps == step], x[steps > step], steps[points - 1] == step
        way = np.diff(whole)
        again = wanted is None and later.size and min(later.max(), whole.max()) > max(later.min(), whole.min())
        if part.any() and (np.all(way > 0.0) or np.all(way < 0.0)) and not again:
            inside = np.flatnonzero(part & (end >= start))
            for run in np.split(inside, np.flatnonzero(np.diff(inside) > 1) + 1):
                rows = points[run] - 1
                lower, upper = (path_curves.smoothed(results, at_rows(shown, rows), Column("contact", scale * side[run]), rows[0])
                                for side in (start, end))
                axes.fill(np.append(lower[0], upper[0][::-1]), np.append(lower[1], upper[1][::-1]), color=colour,
                          alpha=0.10, linewidth=0, zorder=1)


def joined(history, lines: list[End], opened: dict[int, float]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points, starts and ends of a stretch, and of the point before (after) it where one of its ends was (will be) there.

    So the parts of a split begin where the whole ends: one end of theirs was there, the other one is new, and where the gap opens
    that is known from its line.
    """
    points, start, end = history.points, history.start, history.end
    for beyond, own, place in ((points[-1] + 1, -1, len(points)), (points[0] - 1, 0, 0)):
        there = {line.side: float(line.arc[line.points == beyond][0]) for line in lines if beyond in line.points
                 and line.line == (history.start_line if line.side == "start" else history.end_line)}
        if len(there) == 1:
            before = opened if beyond < points[0] else {}
            start = np.insert(start, place, there.get("start", before.get(history.start_line, history.start[own])))
            end = np.insert(end, place, there.get("end", before.get(history.end_line, history.end[own])))
            points = np.insert(points, place, beyond)
    return points, start, end


def contact_name(results, contact: int) -> str:
    """The obstacle of a contact, with the number of the contact when others have the same one."""
    names = results.contact.obstacles
    name = captions.escape(names[contact - 1])
    return name if names.count(names[contact - 1]) == 1 else f"{name} ({contact})"


def curve(line: End, angle: bool) -> np.ndarray:
    """One end of contact; angles without jumps of a whole turn."""
    if not angle:
        return line.arc
    return np.unwrap(line.angle, period=360.0) if np.all(np.isfinite(line.angle)) else line.angle

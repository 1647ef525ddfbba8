#!/usr/bin/env python3
"""Draw where the contact begins and ends along the path."""

from __future__ import annotations

import numpy as np

import plot_style as style  # before matplotlib's own modules: it chooses the backend
from matplotlib.lines import Line2D

from unilat_results import Column, ResultsError

DESCRIPTION = """\
Draw the history of every contact region: the angles (or arc lengths) at which it begins and ends, against the load
factor, a monitor or the number of the point. Unstable parts of the path are dashed. Angles count from the obstacle's
reference direction; arc lengths are stress-free ones along the candidates of the contact. A region that is one point
has one line. With both ends of a single file as arc lengths over a quantity that only grows (or falls), such as point,
the region itself is tinted."""

EXAMPLES = """\
examples:
  plot_contact.py ring.h5 --end start
  plot_contact.py ring.h5 --end start --reference ring.csv --ref-x p --ref-y phi_deg --ref-name exact
  plot_contact.py column.h5 --quantity arc --against point
  plot_contact.py rigid.h5 winkler.h5 --against v --end start -o angles.pdf
"""

MOST_NAMED = 6     # regions with a colour and a legend entry of their own


def main(argv=None) -> int:
    parser = style.Parser(description=DESCRIPTION, epilog=EXAMPLES)
    style.add_files(parser)
    parser.add_argument("--quantity", choices=("angle", "arc"),
                        help="contact angle or arc length (default: angle, where no obstacle has one arc)")
    parser.add_argument("--end", choices=("start", "end", "both"), default="both",
                        help="which end of the regions (default both)")
    parser.add_argument("--against", metavar="NAME", default="load_factor",
                        help="load_factor (default), a monitor, point, or any path quantity")
    parser.add_argument("--contact", type=int, metavar="N", help="only the N-th *CONTACT of the deck")
    style.add_marks(parser, "LP,BP")
    style.add_axes(parser)
    style.add_reference(parser)
    style.add_output(parser, width=89, height=70)
    args = parser.parse_args(argv)
    everything = style.load(args)

    found = [histories(results, args.contact) for results in everything]
    angle = choose_angle(everything, found, args.quantity)
    ends = {"both": ("start", "end")}.get(args.end, (args.end,))
    figure, axes = style.new_figure(args, args.height)
    references = style.draw_references(axes, args)
    texts, handles, unstable, label = [], [], False, None
    for k, (results, name) in enumerate(zip(everything, style.names(args, everything))):
        against = style.numbers(results, args.against)
        label = label or style.column_label(against, args.x_scale)
        breaks = against.name == "load_factor"
        for m, history in enumerate(found[k]):
            colour = style.COLOURS[colour_number(len(everything), k, len(found[k]), m, history) % len(style.COLOURS)]
            rows = history.points - 1
            x = args.x_scale * against.values[rows]
            curves = [args.y_scale * curve(history, end, angle) for end in ends]
            monotonic = np.all(np.diff(x) > 0.0) or np.all(np.diff(x) < 0.0)
            if len(curves) == 2 and not angle and len(everything) == 1 and monotonic:
                axes.fill_between(x, *curves, where=history.end >= history.start, color=colour, alpha=0.10,
                                  linewidth=0, zorder=1)
            if len(curves) == 2 and np.array_equal(*curves, equal_nan=True):
                curves.pop()
            for y in curves:
                unstable |= style.draw_path(axes, results, x, y, colour, breaks, first=rows[0])

                def place(critical, rows=rows, x=x, y=y):
                    at = critical.point - 1 - rows[0]
                    return (x[at], y[at]) if 0 <= at < len(rows) else (np.nan, np.nan)

                texts += style.draw_marks(axes, results, args.mark, place, colour)
            if len(everything) == 1 and 1 < len(found[k]) <= MOST_NAMED:
                handles.append(Line2D([], [], color=colour, label=f"region {m + 1}"))
        if len(everything) > 1 or references:
            handles.append(Line2D([], [], color=style.COLOURS[k % len(style.COLOURS)], label=name))
    if unstable:
        alone = len(everything) == 1 and len(found[0]) == 1
        colour = style.COLOURS[0] if alone else style.INK
        if alone and not handles:
            handles.append(Line2D([], [], color=colour, label="stable"))
        handles.append(Line2D([], [], color=colour, linestyle=style.UNSTABLE, label="unstable"))
    what = "angle" if angle else "arc length"
    name = f"contact {what}" if args.end == "both" else f"{what} at the {args.end} of contact"
    quantity = Column(name, np.zeros(0), "degree" if angle else "length")
    style.finish_axes(axes, args, label, style.column_label(quantity, args.y_scale))
    style.legend(axes, handles + references, loc="best")
    style.place_labels(axes, texts)
    return style.save(figure, args, everything, "contact")


def histories(results, number):
    """The histories to draw; an error when there are none."""
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
    return found


def choose_angle(everything, found, quantity) -> bool:
    """Whether angles are drawn, not arc lengths."""
    with_angle = [any(np.any(np.isfinite(history.angle_start)) for history in group) for group in found]
    if quantity == "angle" and not all(with_angle):
        name = everything[with_angle.index(False)].filename
        raise ResultsError(f"{name}: no contact angles, the obstacle has no centre (use --quantity arc)")
    return all(with_angle) if quantity is None else quantity == "angle"


def colour_number(n_files, file, n_histories, number, history) -> int:
    """Files differ in colour; in a single file regions do, or contacts when the regions are many."""
    if n_files > 1:
        return file
    return number if n_histories <= MOST_NAMED else history.contact - 1


def curve(history, end, angle) -> np.ndarray:
    """One end of a region; angles without jumps of a whole turn."""
    values = getattr(history, f"angle_{end}" if angle else end)
    if angle and np.all(np.isfinite(values)):
        return np.unwrap(values, period=360.0)
    return values


if __name__ == "__main__":
    style.run(main)

"""Points of a path that a picture shows: options to choose them, their shades and their names."""

from __future__ import annotations

import argparse

import numpy as np

from . import captions, options
from .results import Path, ResultsError

# From pale to dark: the order of the points is seen without colour, too.
PALE, DARK = np.array([0.64, 0.76, 0.87]), np.array([0.03, 0.15, 0.35])
DEFAULT = 5


def add_points(parser: options.Parser, what: str, default: int = DEFAULT):
    """Options for the points and their names; `what` is drawn of them, in the plural."""
    parser.add_argument("--branch", type=branch_number, default=0, metavar="K",
                        help=f"{what} of branch K instead of the path of the steps")
    chosen = parser.add_argument_group(f"points to draw (together, when several are given; default --evenly {default})")
    chosen.add_argument("--rows", type=row_list, default=[], metavar="N,N,...",
                        help="numbers of points, from 1 as in the listing; -1 is the last stored one")
    chosen.add_argument("--label", type=options.mark_list, default=[], metavar="LABELS",
                        help=f"points with these labels: some of {','.join(options.LABELS)}, or all")
    chosen.add_argument("--at", type=value_list, default=[], metavar="F,F,...",
                        help="the stored points whose --caption is nearest to these values")
    chosen.add_argument("--evenly", type=count, metavar="N",
                        help="N points evenly spaced along the path, first and last included")
    parser.add_argument("--caption", metavar="NAME", default="load_factor",
                        help=f"path quantity or monitor that names the {what} (default load_factor)")
    parser.add_argument("--caption-scale", type=options.nonzero, default=1.0, metavar="F", help="factor on it")


def choose(results: Path, args, stored: np.ndarray, field: str, default: int = DEFAULT) -> list[int]:
    """Numbers of the points to draw, in the order of the path; `stored` are those that hold the field."""
    if stored.size == 0:
        raise ResultsError(f"{results.filename}: no {field} are stored (*FIELD OUTPUT)")
    points = [int(stored[-1]) if row == -1 else row for row in args.rows]
    if args.label:
        labelled = {critical.point for critical in results.critical if critical.label in args.label}
        found = sorted(labelled & set(stored.tolist()))
        if not found:
            why = f"no {field} are stored there" if labelled else "no such point"
            raise ResultsError(f"{results.filename}: label {', '.join(args.label)}: {why}")
        points += found
    if args.at:
        values = args.caption_scale * options.numbers(results, args.caption).values[stored - 1]
        points += [int(stored[np.argmin(np.abs(values - wanted))]) for wanted in args.at]
    for point in points:
        if not 1 <= point <= results.n_points:
            raise ResultsError(f"{results.filename}: no point {point} (they run from 1 to {results.n_points})")
    if args.evenly or not points:
        points += evenly(results, stored, args.evenly or default)
    return sorted(set(points))


def evenly(results: Path, stored: np.ndarray, number: int) -> list[int]:
    """As many different stored points at about equal distances of arc length (of the row, should the file have none)."""
    arc = results.path["arc_length"].values[stored - 1] if "arc_length" in results.path else np.zeros(len(stored))
    if len(stored) > 1 and not np.all(np.diff(arc) > 0.0):
        arc = stored.astype(float)
    free = np.ones(len(stored), dtype=bool)
    places = np.linspace(arc[0], arc[-1], number)
    for at in [*places[:1], *places[:0:-1]]:        # the ends of the path before the others
        if np.any(free):
            free[np.argmin(np.where(free, np.abs(arc - at), np.inf))] = False
    return stored[~free].tolist()


def shade(number: int, n: int) -> tuple:
    """Colour of one of n points, from 0."""
    share = number / (n - 1) if n > 1 else 1.0
    return tuple(PALE + share * (DARK - PALE))


def names(results: Path, points: list[int], args) -> tuple[str, list[str]]:
    """What names the points, and the name of each: the value with the label of a critical point."""
    caption = options.numbers(results, args.caption)
    labels = {critical.point: critical.label for critical in results.critical}
    steps = {point: int(results.path["step"].values[point - 1]) for point in points} if "step" in results.path else {}
    several = len(set(steps.values())) > 1 and caption.name == "load_factor"      # it starts again in every step
    texts = [f"{args.caption_scale * caption.values[point - 1]:.4g}" + (f"  {labels[point]}" if point in labels else "")
             + (f"  (step {steps[point]})" if several else "") for point in points]
    return (captions.column_label(caption, args.caption_scale),
            [text.replace("-", "\N{MINUS SIGN}") for text in texts])


# Readers of options


def row_list(text: str) -> list[int]:
    try:
        return [int(word) for word in text.split(",") if word.strip()]
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is not a list of point numbers such as 1,20,57") from None


def value_list(text: str) -> list[float]:
    try:
        return [float(word) for word in text.split(",") if word.strip()]
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is not a list of numbers such as 0.5,2") from None


def branch_number(text: str) -> int:
    if not text.isdigit() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"'{text}' is not the number of a branch (from 1)")
    return int(text)


def count(text: str) -> int:
    if not text.isdigit() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"'{text}' is not a number of points")
    return int(text)

"""Curves along a path, stable and unstable parts told apart, and the marks of critical points."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..captions import escape
from ..options import LABELS, Parser, mark_list
from ..results import Column, Critical, Path, Results, ResultsError
from . import smooth_curve

MARKERS = {"LP": "o", "BP": "D", "TP": "p", "C+": "^", "C-": "v", "UZ": "x", "EP": "s"}
UNSTABLE = (0, (4.5, 1.8))
MOST_LABELS = 8            # more points of one kind than this are marked without text


def add_marks(parser: Parser, default: str):
    parser.add_argument("--mark", metavar="LABELS", type=mark_list, default=mark_list(default),
                        help=f"critical points to mark: some of {','.join(LABELS)}, or all, or none "
                             f"(default {default}); hollow: bracketed, not located")


def add_step(parser: Parser):
    parser.add_argument("--step", metavar="N", type=int, help="only the N-th step of the deck (default: all)")


def step_number(results: Results, wanted: int | None) -> int | None:
    """The step to draw, None for all; an error when the path has no point of it."""
    if wanted is not None and not np.any(rows_of_step(results, wanted)):
        raise ResultsError(f"{results.filename}: no points of step {wanted}")
    return wanted


def rows_of_step(results: Path, step: int | None) -> np.ndarray:
    """Which points belong to a step; all when it is None."""
    if step is None or "step" not in results.path:
        return np.full(results.n_points, step in (None, 1))
    return results.path["step"].values[:results.n_points] == step


def critical_value(results: Path, critical: Critical, column: Column) -> float:
    """The quantity at a critical point; NaN when the file does not tell."""
    if 1 <= critical.point <= results.n_points:
        return float(column.values[critical.point - 1])
    if column.name == "load_factor":
        return critical.load_factor
    return critical.monitors.get(column.name, float("nan"))


def stretches(results: Path, breaks: bool) -> list[tuple[np.ndarray, bool]]:
    """The path cut into rows of one stability: (rows, stable), neighbours sharing their end row.

    The part between two points is stable when both have no unstable direction. A located limit or bifurcation point is
    itself singular, so there the other point decides. With `breaks` steps are not joined (the load factor starts
    again).
    """
    n = results.n_points
    steps = results.path["step"].values if "step" in results.path else np.ones(n, dtype=int)
    labels = results.path["label"].values if "label" in results.path else np.full(n, "")
    unstable, singular, corner = results.unstable(), np.isin(labels, ("LP", "BP")), np.isin(labels, ("C+", "C-"))
    pieces: list[tuple[list[int], bool]] = []
    for row in range(n - 1):
        # What is stored of a contact change is the stability before it.
        ends = [k for k in (row, row + 1) if not (singular[k] or (k == row and corner[k]))] or [row, row + 1]
        stable = not any(unstable[k] for k in ends)
        if breaks and steps[row + 1] != steps[row]:
            continue
        if pieces and pieces[-1][1] == stable and pieces[-1][0][-1] == row:
            pieces[-1][0].append(row + 1)
        else:
            pieces.append(([row, row + 1], stable))
    return [(np.array(rows), stable) for rows, stable in pieces]


def scaled(column: Column, factor: float) -> Column:
    """A quantity as it is drawn."""
    return replace(column, values=factor * column.values, rate=None if column.rate is None else factor * column.rate)


def draw_path(axes, results: Path, x: Column, y: Column, line: dict | Callable[[int], dict], first: int = 0,
              root: tuple[float, float] | None = None, step: int | None = None,
              spans: tuple[float, float] = (0.0, 0.0)) -> bool:
    """A curve along the path, stable parts solid, unstable ones dashed; True when there is an unstable part.

    `line` says how it is drawn otherwise (see look), or gives that for a step. `first` is the row of the first value: the curve
    may be there for a part of the path only. `root` is where a branch leaves the other path; what joins it to the first point is
    as stable as the first part of the branch. `step`: only the part of this step. `spans`: see smooth_curve. Over the load factor
    every step is a curve of its own, from where the step before it ended: its load factor is zero there.
    """
    unstable = False
    parts = step_rows(results, "load_factor" in (x.name, y.name), first, len(x.values))
    for number, rows in parts:
        if len(parts) > 1 and len(rows) == 1 and rows[0] == first and root is None and first == 0:
            continue        # a step that only looks for modes begins and ends there
        if step not in (None, number) and not np.any(rows_of_step(results, step)[rows]):
            continue
        if step is not None:
            rows = rows[rows_of_step(results, step)[rows]]
        start = root if rows[0] == first else step_start(results, x, y, rows[0], first)
        here = slice(rows[0] - first, rows[-1] - first + 1)
        unstable |= _draw_part(axes, results, _part(x, here), _part(y, here), line(number) if callable(line) else line, int(rows[0]), start,
                               spans)
    return unstable


def step_rows(results: Path, apart: bool, first: int = 0, count: int | None = None) -> list[tuple[int, np.ndarray]]:
    """Number of the step and its rows, from row `first` on; all rows as those of the first step where steps are not `apart`."""
    rows = np.arange(first, first + (results.n_points if count is None else count))
    steps = results.path["step"].values[rows] if "step" in results.path else np.ones(len(rows), dtype=int)
    if not apart:
        return [(int(steps[0]), rows)] if len(rows) else []
    cuts = np.flatnonzero(np.diff(steps)) + 1
    return [(int(results.path["step"].values[part[0]]) if "step" in results.path else 1, part) for part in np.split(rows, cuts) if len(part)]


def drawn_steps(results: Path) -> list[int]:
    """Numbers of the steps that have a curve, where they are several; those that only look for modes have a point at most."""
    found = [number for number, rows in step_rows(results, apart=True) if len(rows) > 1 or step_start(
        results, results.path["load_factor"], results.path["load_factor"], int(rows[0])) is not None]
    return list(dict.fromkeys(found)) if len(set(found)) > 1 else []


def step_start(results: Path, x: Column, y: Column, row: int, first: int = 0) -> tuple[float, float] | None:
    """Where the step of a row begins: load factor zero, the rest as the step before has left it. None where that is not known."""
    if row <= first or "step" not in results.path or results.path["step"].values[row] == results.path["step"].values[row - 1]:
        return None
    step = int(results.path["step"].values[row])
    if step in results.loads and results.loads[step].stress_free_start:
        return None
    if results.path["load_factor"].values[row] == 0.0:      # the file has it
        return None
    return tuple(0.0 if column.name == "load_factor" else float(column.values[row - 1 - first]) for column in (x, y))


def step_name(results: Path, step: int) -> str:
    """What the legend calls a step."""
    name = results.loads[step].name if step in results.loads else ""
    return f"step {step}" if name in ("", f"Step-{step}") else f"step {step}: {escape(name)}"


def _part(column: Column, rows: slice) -> Column:
    return replace(column, values=column.values[rows], rate=None if column.rate is None else column.rate[rows])


def _draw_part(axes, results: Path, x: Column, y: Column, line: dict, first: int, root: tuple[float, float] | None,
               spans: tuple[float, float]) -> bool:
    """One curve without a break; see draw_path."""
    last, unstable = first + len(x.values) - 1, False
    curve_x, curve_y, place = smoothed(results, x, y, first, root, spans)
    before = 0 if root is None else 1       # points of the curve before x[0]
    pieces = [(rows[(rows >= first) & (rows <= last)] - first + before, stable)
              for rows, stable in stretches(results, "load_factor" in (x.name, y.name))]
    pieces = [(rows, stable) for rows, stable in pieces if rows.size > 1]
    if root is not None:
        stable = pieces[0][1] if pieces else not results.unstable()[first]
        pieces.insert(0, (np.array((0, 1)), stable))
        if len(pieces) > 1 and pieces[1][1] == stable and pieces[1][0][0] == 1:
            pieces[:2] = [(np.insert(pieces[1][0], 0, 0), stable)]
    for rows, stable in pieces:
        part = slice(place[rows[0]], place[rows[-1]] + 1)
        if not np.any(np.isfinite(curve_x[part] + curve_y[part])):
            continue
        unstable = unstable or not stable
        axes.plot(curve_x[part], curve_y[part], linestyle="-" if stable else UNSTABLE, zorder=3, **line,
                  solid_capstyle="round", dash_capstyle="butt")
    if len(x.values) == 1 and root is None:
        axes.plot(x.values, y.values, marker=".", zorder=3, **line)
    return unstable


def smoothed(results: Path, x: Column, y: Column, first: int = 0, root: tuple[float, float] | None = None,
             spans: tuple[float, float] = (0.0, 0.0)) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The curve drawn through points of the path, from row `first` on, and where on it they are; see smooth_curve.

    A `root` is a point before them.
    """
    part = slice(first, first + len(x.values))
    corner, smooth = (bend[part] for bend in bends(results))
    length = results.path["arc_length"].values[part] if "arc_length" in results.path else None
    values, rates = [x.values, y.values], [x.rate, y.rate]
    if root is not None:
        values = [np.insert(each, 0, start) for each, start in zip(values, root)]
        rates = [None if each is None else np.insert(each, 0, np.nan) for each in rates]
        corner, smooth = np.insert(corner, 0, False), np.insert(smooth, 0, False)
        length = None
    return smooth_curve.through(*values, corner, smooth, length, tuple(rates), spans)


def bends(results: Path) -> tuple[np.ndarray, np.ndarray]:
    """Where the path has a kink, and where it has none for sure: contact and new loads make kinks, limit points do not.

    A limit point without a rate of the load is one at a kink: what a stop pushes with comes to a corner of its law.
    """
    n = results.n_points
    labels = results.path["label"].values if "label" in results.path else np.full(n, "")
    steps = results.path["step"].values if "step" in results.path else np.ones(n, dtype=int)
    ends = np.append(steps[1:] != steps[:-1], False)
    rate = results.path["load_factor"].rate
    kinks = (labels == "LP") & (False if rate is None else ~np.isfinite(rate[:n]))
    return ends | np.isin(labels, ("C+", "C-")) | kinks, np.isin(labels, ("LP", "TP")) & ~kinks


def draw_marks(axes, results: Path, wanted: list[str], place, colour: str, value_of=None,
               step: int | None = None) -> list[tuple]:
    """Mark critical points; `place(critical)` gives (x, y). The labels still to be placed: (x, y, text, colour).

    `value_of(critical)` gives the number to write beside a label, None for no number.
    `step`: only those of this step.
    """
    texts = []
    for label in wanted:
        points = [critical for critical in results.critical if critical.label == label and step in (None, critical.step)]
        dense = len(points) > MOST_LABELS
        for critical in points:
            x, y = place(critical)
            if not np.isfinite(x + y):
                continue
            size = 2.4 if dense else 3.8
            face = colour if critical.located else "white"
            axes.plot(x, y, marker=MARKERS[label], markersize=size, color=colour, markerfacecolor=face,
                      markeredgewidth=0.5 if dense else 0.9, linestyle="none", zorder=6)
            if not dense:
                value = value_of(critical) if value_of else None
                text = label if value is None else f"{label} {value:.5g}"
                texts.append((x, y, text.replace("-", "\N{MINUS SIGN}"), colour))
    return texts

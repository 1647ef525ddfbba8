"""Digests: the numbers of a run that a change of the sources must leave as they are, and the comparison of two of them.

A digest is a tree of dictionaries and lists:

    exit, status, reason         exit code of the program; status of the result file, and why it is that
    scales/QUANTITY              largest value of the quantity, or of another one with the same units, anywhere in the run
    paths/NAME                   the path of the steps, and each branch
        labels                   of its critical points, along the path
        rows/STEP                points of each step
        unstable, regions        points that are unstable; regions of contact at all points together
        mean, rms /QUANTITY      over all points of the path: any point that moves changes them
        critical/K/...           label, step, located, multiplicity, quantities and their error bars ("bar of QUANTITY")
    buckling/STEP/load_factor    of each mode
    curves/NAME                  limit curves: labels, rows, mean, rms

Quantities are load_factor, "monitor NAME", and start and end: the places where regions of contact begin and end along the rods.
"""

from __future__ import annotations

import math
import re
from typing import NamedTuple

import numpy as np
from unilat.results import Path, Results

TOLERANCE = 1e-9          # relative to the quantity's scale
SPREADS = 10.0            # times what rounding changes: what a quantity without an error bar may differ by
CAUSES = {"labels": ("critical",), "rows": ("mean", "rms")}    # what cannot be the same where these are not


class Difference(NamedTuple):
    """Of a leaf in two digests; None: it is not there."""

    old: object
    new: object
    by: float | None     # None: not of two numbers


def digest(code: int | str, results: Results | None) -> dict:
    """Digest of a run with this exit code (a word: why it has none); results: None without a result file."""
    if results is None:
        return {"exit": code, "scales": {}}
    paths = {"steps": results} | {f"{branch.name} {'+' if branch.side > 0 else '-'} ({number})": branch
                                  for number, branch in results.branches.items()}
    found = {"exit": code, "status": results.status.split(":")[0], "reason": results.status.partition(": ")[2],
             "scales": _scales(list(paths.values())),
             "paths": {name: _path(path) for name, path in paths.items()}}
    if results.buckling:
        found["buckling"] = {name: {"load_factor": _numbers(modes.load_factor)} for name, modes in results.buckling.items()}
    if results.limit_curves:
        found["curves"] = {name: {"labels": " ".join(str(label) for label in curve.columns["label"].values if label),
                                  "rows": curve.n_points}
                           | _moments({key: curve.columns[key].values for key in ("parameter", "load_factor")}
                                      | {f"monitor {key}": column.values for key, column in curve.monitors.items()})
                           for name, curve in results.limit_curves.items()}
    return found


def _quantities(path: Path) -> dict[str, np.ndarray]:
    """Quantities along a path; one row a point."""
    found = {"load_factor": path.path["load_factor"].values}
    found |= {f"monitor {name}": column.values for name, column in path.monitors.items()}
    if path.contact is not None and path.contact.start.shape[1] > 0:
        found |= {"start": path.contact.start, "end": path.contact.end}
    return found


def _scales(paths: list[Path]) -> dict[str, float]:
    """Zero for what is nowhere anything but zero."""
    units = {"load_factor": "load", "start": "place", "end": "place"}
    units |= {f"monitor {name}": column.units for name, column in paths[0].monitors.items()}
    largest: dict[str, float] = {}
    for path in paths:
        for name, values in _quantities(path).items():
            finite = np.abs(values[np.isfinite(values)])
            largest[units[name]] = max(largest.get(units[name], 0.0), float(np.max(finite, initial=0.0)))
    return {name: _number(largest[unit]) for name, unit in units.items() if unit in largest}


def _path(path: Path) -> dict:
    quantities = _quantities(path)
    steps, counts = np.unique(path.path["step"].values, return_counts=True)
    found = {"labels": " ".join(critical.label for critical in path.critical),
             "rows": {str(step): int(count) for step, count in zip(steps, counts)},
             "unstable": int(np.count_nonzero(path.path["negative_pivots"].values > 0))}
    if path.contact is not None:
        found["regions"] = int(np.sum(path.contact.count))
    return found | _moments(quantities) | {"critical": [_critical(path, critical) for critical in path.critical]}


def _critical(path: Path, critical) -> dict:
    found = {"label": critical.label, "step": critical.step, "located": critical.located,
             "multiplicity": critical.multiplicity, "load_factor": _number(critical.load_factor)}
    found |= {f"monitor {name}": _number(value) for name, value in critical.monitors.items()}
    bars = {"load_factor": critical.error} | {f"monitor {name}": bar for name, bar in critical.monitor_errors.items()}
    contact = path.contact
    row = critical.point - 1
    if contact is not None and row < path.n_points and contact.count[row] > 0:
        there = slice(contact.count[row])
        found |= {"start": _numbers(contact.start[row, there]), "end": _numbers(contact.end[row, there])}
        if contact.bars is not None:
            found |= {f"bar of {name}": _numbers(contact.bars[k, row, there]) for k, name in enumerate(("start", "end"))}
    return found | {f"bar of {name}": _number(bar) for name, bar in bars.items() if not math.isnan(bar)}


def _moments(quantities: dict[str, np.ndarray]) -> dict:
    """Mean and root mean square of what is finite."""
    finite = {name: values[np.isfinite(values)] for name, values in quantities.items()}
    finite = {name: values for name, values in finite.items() if values.size > 0}
    return {"mean": {name: _number(np.mean(values)) for name, values in finite.items()},
            "rms": {name: _number(np.sqrt(np.mean(values**2))) for name, values in finite.items()}}


def _number(value) -> float | str:
    """With two digits more than are compared; what is not finite as a word."""
    return float(f"{value:.11e}") if math.isfinite(value) else str(float(value))


def _numbers(values) -> list:
    return [_number(value) for value in values]


def leaves(tree, key: str = "") -> dict[str, object]:
    """Everything of a digest that is a number or a word, by its place in the tree: "paths/steps/critical/1/load_factor"."""
    if not isinstance(tree, (dict, list)):
        return {key: tree}
    items = tree.items() if isinstance(tree, dict) else ((str(k), item) for k, item in enumerate(tree, 1))
    return {found: leaf for name, item in items for found, leaf in leaves(item, f"{key}/{name}" if key else name).items()}


def differences(old: dict, new: dict, tolerance: float = TOLERANCE) -> dict[str, Difference]:
    """Leaves that are not the same, by their place. Numbers may differ by the tolerance times the scale of their quantity in `old`."""
    first, second = leaves(old), leaves(new)
    found = {}
    for key in [*first, *(key for key in second if key not in first)]:
        x, y = first.get(key), second.get(key)
        by = abs(y - x) if isinstance(x, float) and isinstance(y, float) else None
        same = x == y if by is None else by <= tolerance * max(old["scales"].get(_split(key)[1], 0.0), abs(x))
        if not same and not key.startswith("scales/"):
            found[key] = Difference(x, y, by)
    return {key: what for key, what in found.items() if not _follows(key, found)}


def may_differ(runs: list[dict]) -> dict[str, float | None]:
    """Leaves that differ between digests of one deck and the same sources (other kernels of the BLAS, other builds), and by how much they
    may: the error bar, or SPREADS times the difference where there is no bar, or a smaller one. None: anything may stand there."""
    first = leaves(runs[0])
    found: dict[str, float | None] = {}
    for other in runs[1:]:
        for key, what in differences(runs[0], other, TOLERANCE / SPREADS).items():
            place, name, index = _split(key)
            bar = first.get(f"{place}bar of {name}{index}") if "/bar of " not in key else None
            if what.by is None or found.get(key, 0.0) is None:
                found[key] = None
            else:
                found[key] = max(found.get(key, 0.0), bar if isinstance(bar, float) and bar >= what.by else SPREADS * what.by)
    return found


def compare(old: dict, new: dict, loose: dict[str, float | None]) -> tuple[dict[str, Difference], dict[str, Difference]]:
    """Differences that must not be, and those that `loose` (of may_differ) allows; the words of a reason always may change."""
    free = {key for key, allowed in loose.items() if allowed is None} | {"reason"}
    found = differences(old, new)
    within = {key: what for key, what in found.items()
              if key in free or _follows(key, free) or (what.by is not None and what.by <= loose.get(key, 0.0))}
    return {key: what for key, what in found.items() if key not in within}, within


def _split(key: str) -> tuple[str, str, str]:
    """Where a leaf is, its quantity (also of a bar), its number in a list: "paths/steps/critical/1/", "start", "/2"."""
    place, name, index = re.fullmatch(r"(.*/|)([^/]*[^/\d][^/]*)((?:/\d+)?)", key).groups()
    return place, name.removeprefix("bar of "), index


def _follows(key: str, changed) -> bool:
    """Whether a leaf cannot be the same because of a changed one: the first of many differences says all."""
    return any(key.startswith(f"{place}/{below}/") for word, belows in CAUSES.items() for other in changed
               if f"/{word}" in other and other != key for place in [other.rsplit(f"/{word}", 1)[0]] for below in belows)

"""Bars and estimates over true errors, of all values of several maps: are the program's error bars right?

A case is a value with an exact one, on one mesh. What is below the last digits of the exact value, or rounding, is none.
"""

from __future__ import annotations

import math
import re
import statistics
from dataclasses import dataclass

from ..plot import style
from ..sweep.run_folder import RunFolder
from . import several_maps
from .map_file import Map
from .map_table import cells

LEAST, LARGEST = 1e-10, 0.1     # errors that are looked at, over the exact value
DIGITS = 20.0                   # times half of the last digit of an exact value: an error that it tells


@dataclass(frozen=True)
class Case:
    scene: str
    values: dict        # parameters of the run
    quantity: str
    exact: float
    value: float
    error: float        # value less exact, over the size of the exact one, as bar and estimate are
    bar: float          # inf: the mesh is too coarse to tell
    estimate: float


def is_effectivity(filename: str) -> bool:
    return several_maps.names_maps(filename, "maps")


def study_bars(filename: str, folder: RunFolder, jobs: int) -> int:
    """1: there are no cases."""
    return int(not several_maps.make_study(
        filename, "maps", folder, jobs, _cases, summary, "error, bar and estimate over the size of the exact value", COLUMNS, draw_cases))


def _cases(checked: Map, folder: RunFolder, keys: list[str]) -> list[Case]:
    found = []
    for cell in cells(checked, folder, keys):
        for check, each in zip(checked.checks, cell.findings):
            scale = abs(each.exact) or 1.0
            error = (each.value - each.exact) / scale
            if max(LEAST, told_to(check.exact) / scale) < abs(error) < LARGEST and not math.isnan(each.bar):
                found.append(Case(checked.sweep.name, cell.values, check.name, each.exact, each.value, error, each.bar, each.estimate))
    return found


def told_to(text: str) -> float:
    """The smallest error that an exact value of so many digits tells; 0 of a name or a formula."""
    match = re.fullmatch(r"-?(\d+)(?:\.(\d*))?", text)
    return 0.5 * DIGITS * 10.0 ** -len(match.group(2) or "") if match else 0.0


def summary(cases: list[Case]) -> str:
    """A line a map, the last of all."""
    lines = ["| map | cases | estimate / error: 5 %, median, 95 % | bar / error: smallest, median, largest | bars below the error | "
             "`>` of errors below 1 % |", "|---|---|---|---|---|---|"]
    for name in (*several_maps.scenes_of(cases), "all"):
        lines.append(_line(name, [case for case in cases if name in (case.scene, "all")]))
    return "\n".join(lines) + "\n"


def _line(name: str, cases: list[Case]) -> str:
    bounded = sorted(case.bar / abs(case.error) for case in cases if math.isfinite(case.bar))
    told = sorted(-case.estimate / case.error for case in cases if math.isfinite(case.bar) and not math.isnan(case.estimate))
    small = [case for case in cases if abs(case.error) < 0.01]
    open_bars = sum(math.isinf(case.bar) for case in small)
    if not bounded:
        return f"| {name} | {len(cases)} | | | | |"
    estimates = ", ".join(f"{told[int(part * (len(told) - 1))]:.3g}" for part in (0.05, 0.5, 0.95))
    return (f"| {name} | {len(cases)} | {estimates} | {bounded[0]:.2f}, {statistics.median(bounded):.2f}, {bounded[-1]:.3g} | "
            f"{sum(one < 1.0 for one in bounded)} | {100.0 * open_bars / max(len(small), 1):.1f} % |")


COLUMNS = {"quantity": lambda case: case.quantity, "exact": lambda case: repr(case.exact), "value": lambda case: repr(case.value),
           "error": lambda case: f"{case.error:.4g}", "bar": lambda case: f"{case.bar:.4g}",
           "estimate": lambda case: f"{case.estimate:.4g}", "bar over error": lambda case: f"{case.bar / abs(case.error):.4g}"}


def draw_cases(axes, cases: list[Case], colours: dict[str, str]):
    """Bar over error above the error: below one a bar is too small. Open bars stand at the top."""
    top = 10.0 * max((case.bar / abs(case.error) for case in cases if math.isfinite(case.bar)), default=1.0)
    for name, colour in colours.items():
        own = [case for case in cases if case.scene == name]
        closed = [case for case in own if math.isfinite(case.bar)]
        opened = [case for case in own if math.isinf(case.bar)]
        axes.plot([abs(case.error) for case in closed], [case.bar / abs(case.error) for case in closed], marker="o", markersize=2.0,
                  linestyle="none", color=colour, markeredgewidth=0.0)
        axes.plot([abs(case.error) for case in opened], [top] * len(opened), marker="^", markersize=2.5, linestyle="none", color=colour,
                  markerfacecolor="none", markeredgewidth=0.5)
    axes.axhline(1.0, color=style.REFERENCE, linewidth=0.8)
    axes.set(xlabel="relative error", ylabel="bar / error (triangles: open bars)")

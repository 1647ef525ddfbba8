"""Asked and delivered: meshes made for a tolerance, of all runs of several maps, held against exact values.

A case is a value with an exact one. What was asked of it is the tolerance of its check: relative to it, as its error and bar are.
"""

from __future__ import annotations

import math
import os
import statistics
from dataclasses import dataclass

from ..plot import style
from ..results import Results, read_results
from ..sweep.run_folder import RunFolder
from . import several_maps
from .effectivity import told_to
from .map_file import Map
from .verdict import asked_of, finding

LEAST = 1e-14       # errors below are drawn there


@dataclass(frozen=True)
class Case:
    scene: str
    values: dict        # parameters of the run
    quantity: str
    asked: float
    error: float        # NaN: the run has no such value
    told: float         # errors below this the exact value does not tell
    bar: float          # inf: the mesh is too coarse to tell
    elements: float     # of the largest mesh
    seconds: float      # of the program's own phases
    of_bars: float      # their part of these
    code: int
    message: str

    @property
    def within(self) -> bool:
        return self.error <= self.asked

    @property
    def better(self) -> float:
        """Asked over delivered."""
        return self.asked / max(self.error, self.told, LEAST)


def is_delivered(filename: str) -> bool:
    return several_maps.names_maps(filename, "asked")


def study_delivered(filename: str, folder: RunFolder, jobs: int) -> int:
    """1: a run has no value, or an error larger than asked, without a word."""
    cases = several_maps.make_study(
        filename, "asked", folder, jobs, _cases, summary, "tolerance, error and bar over the size of the exact value", COLUMNS, draw_cases)
    return int(any(not case.within and case.code == 0 for case in cases))


def _cases(checked: Map, folder: RunFolder, keys: list[str]) -> list[Case]:
    found = []
    for values, known, key in zip(checked.sweep.values, checked.known, keys):
        record = folder.record(key)
        if record is None:
            continue
        results = read_results(folder.results(key)) if record.code in (0, 2) and os.path.exists(folder.results(key)) else None
        elements, seconds, of_bars = _work(results)
        for check in checked.checks:
            each = finding(check, known, record.code, results, checked.sweep.name)
            # There is no such quantity; a run without results may not know.
            if math.isnan(each.exact) and results is not None:
                continue
            found.append(Case(checked.sweep.name.removeprefix("asked-"), values, check.name,
                              asked_of(check, known, results, checked.sweep.name), each.error, told_to(check.exact) / (abs(each.exact) or 1.0),
                              each.bar, elements, seconds, of_bars, record.code, record.message))
    return found


def _work(results: Results | None) -> tuple[float, float, float]:
    """Elements of the largest mesh, seconds, the bars' part of them."""
    if results is None:
        return (math.nan,) * 3
    counters = dict(zip(results.performance["counter"], results.performance["value"]))
    seconds = dict(zip(results.performance["phase"], results.performance["seconds"]))
    whole = sum(seconds.values())
    return counters["elements at the most"], whole, seconds["error bars"] / whole


def summary(cases: list[Case]) -> str:
    """A line a scene and a tolerance asked, the last of all."""
    lines = ["| scene | asked | values | delivered | median of asked / delivered | bar / error, median | exit code 0 | elements | ms | of it bars |",
             "|---|---|---|---|---|---|---|---|---|---|"]
    scenes = several_maps.scenes_of(cases)
    tolerances = sorted({case.values["asked"] for case in cases}, reverse=True)
    for scene in scenes:
        for asked in tolerances:
            lines.append(_line(scene, f"{asked:.0e}", [case for case in cases if (case.scene, case.values["asked"]) == (scene, asked)]))
    for asked in tolerances:
        lines.append(_line("all", f"{asked:.0e}", [case for case in cases if case.values["asked"] == asked]))
    lines.append(_line("all", "", cases))
    return "\n".join(lines) + "\n"


def _line(scene: str, asked: str, cases: list[Case]) -> str:
    there = [case for case in cases if not math.isnan(case.error)]
    if not there:
        return f"| {scene} | {asked} | {len(cases)} | 0 | | | | | | |"

    def middle(values) -> str:
        return f"{statistics.median(values):.3g}" if values else ""

    ratios = [case.bar / case.error for case in there if math.isfinite(case.bar) and case.error > max(case.told, 1e-11)]
    return (f"| {scene} | {asked} | {len(cases)} | {sum(case.within for case in there)} | {middle([case.better for case in there])} | "
            f"{middle(ratios)} | {sum(case.code == 0 for case in cases)} | {middle([case.elements for case in there])} | "
            f"{middle([1e3 * case.seconds for case in there])} | {100.0 * statistics.median(case.of_bars for case in there):.0f} % |")


COLUMNS = {"quantity": lambda case: case.quantity, "tolerance": lambda case: f"{case.asked:.4g}", "error": lambda case: f"{case.error:.4g}",
           "bar": lambda case: f"{case.bar:.4g}", "asked over delivered": lambda case: f"{case.better:.4g}",
           "elements": lambda case: case.elements, "seconds": lambda case: f"{case.seconds:.5f}",
           "part of bars": lambda case: f"{case.of_bars:.3f}", "code": lambda case: case.code, "message": lambda case: case.message}


def draw_cases(axes, cases: list[Case], colours: dict[str, str]):
    """Delivered over asked. Hollow: the run ended with 2. The line: as good as asked; the dashed one: ten times better."""
    ends = [min(case.asked for case in cases) / 3.0, 3.0 * max(case.asked for case in cases)]
    axes.plot(ends, ends, color=style.REFERENCE, linewidth=0.8)
    axes.plot(ends, [0.1 * end for end in ends], color=style.REFERENCE, linewidth=0.8, linestyle="--")
    for number, (name, colour) in enumerate(colours.items()):
        # Side by side.
        aside = 1.12 ** (number - 0.5 * len(colours))
        for case in cases:
            if case.scene == name and not math.isnan(case.error):
                axes.plot(aside * case.asked, max(case.error, LEAST), marker="o", markersize=2.2, linestyle="none", color=colour,
                          markerfacecolor="white" if case.code else colour, markeredgewidth=0.5)
    axes.set(xlabel="asked", ylabel="delivered")

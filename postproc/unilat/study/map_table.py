"""The cells of a map: what every run is worth, as a table, in figures, and what is wrong."""

from __future__ import annotations

import csv
import math
import os
import statistics
from collections import Counter
from dataclasses import dataclass

from ..results import read_results
from ..sweep.run_folder import RunFolder
from .map_file import Map
from .verdict import CLASSES, Finding, finding, worst

SHOWN = 10      # wrong cells that are listed


@dataclass(frozen=True)
class Cell:
    values: dict            # its parameters
    verdict: str            # of CLASSES; "missing": not run yet
    findings: list[Finding]
    code: int
    message: str
    seconds: float

    @property
    def error(self) -> float:
        """The largest of its checks; NaN: none has a value."""
        errors = [each.error for each in self.findings if each.error == each.error]
        return max(errors) if errors else float("nan")


def cells(checked: Map, folder: RunFolder, keys: list[str]) -> list[Cell]:
    """One for each run, in their order."""
    rows = []
    for values, known, key in zip(checked.sweep.values, checked.known, keys):
        record = folder.record(key)
        if record is None:
            rows.append(Cell(values, "missing", [], -999, "missing", float("nan")))
            continue
        there = record.code in (0, 2) and os.path.exists(folder.results(key))
        results = read_results(folder.results(key)) if there else None
        findings = [finding(check, known, record.code, results, checked.sweep.name) for check in checked.checks]
        rows.append(Cell(values, worst([each.verdict for each in findings]), findings, record.code, record.message, record.seconds))
    return rows


def counts(rows: list[Cell]) -> str:
    """How many cells of each class, in words."""
    number = Counter(cell.verdict for cell in rows)
    told = [f"{number[name]} {name}" for name in (*CLASSES, "missing") if number[name] or name not in ("untold", "missing")]
    needless = sum(cell.verdict == "told" and all(each.verdict == "right" or each.error <= 1e-9 for each in cell.findings)
                   for cell in rows)
    slow = sum(cell.code == 124 for cell in rows)
    return (f"{len(rows)} cells: {', '.join(told)}" + (f"; told though right to 1e-9: {needless}" if needless else "")
            + (f"; out of time: {slow}" if slow else ""))


def bars(rows: list[Cell], noise: float = 1e-9) -> str:
    """Bars over errors, where these are above what exact values and rounding leave; '' where there are none."""
    findings = [each for cell in rows for each in cell.findings if noise < each.error < 0.1 and not math.isnan(each.bar)]
    ratio = sorted(each.bar / each.error for each in findings if math.isfinite(each.bar))
    if not ratio:
        return ""
    small = [each for each in findings if each.error < 0.01]
    share = sum(math.isinf(each.bar) for each in small) / max(len(small), 1)
    return (f"bar over error of {len(ratio)} values with errors of {noise:g} to 0.1: smallest {ratio[0]:.2g}, median "
            f"{statistics.median(ratio):.2g}, largest {ratio[-1]:.2g}; {sum(one < 1.0 for one in ratio)} below 1; open bars of those below "
            f"1 %: {100.0 * share:.1f} %")


def wrong_cells(checked: Map, rows: list[Cell]) -> list[str]:
    """A line for each."""
    lines = []
    for number, cell in enumerate(rows, start=1):
        if cell.verdict == "wrong":
            values = ", ".join(f"{name} = {cell.values[name]}" for name in (checked.look["x"], checked.look["y"]))
            parts = [f"{check.name} {each.value:.10g} for {each.exact:.10g}, error {each.error:.1e}, bar {each.bar:.1e}"
                     for check, each in zip(checked.checks, cell.findings) if each.verdict == "wrong"]
            lines.append(f"run {number} ({values}): {'; '.join(parts)}")
    return lines


def write_table(checked: Map, rows: list[Cell], filename: str):
    """A row a cell. It holds no times: the same program gives the same bytes."""
    sweep = checked.sweep
    with open(f"{filename}.part", "w", newline="", encoding="utf-8") as file:
        file.write(f"# {sweep.title or sweep.name}\n# {counts(rows)}\n"
                   "# error and bar relative to the exact value; bar inf: the mesh is too coarse to tell, nan: no estimate\n")
        table = csv.writer(file, lineterminator="\n")
        checks = [f"{check.name} {what}" for check in checked.checks for what in ("exact", "value", "error", "bar", "class")]
        table.writerow(["run", *sweep.values[0], "class", *checks, "code", "message"])
        for number, cell in enumerate(rows, start=1):
            found = [part for each in cell.findings for part in (repr(each.exact), repr(each.value), f"{each.error:.3g}",
                                                                 f"{each.bar:.3g}", each.verdict)]
            table.writerow([number, *cell.values.values(), cell.verdict, *(found or [""] * len(checks)), cell.code, cell.message])
    os.replace(f"{filename}.part", filename)

"""The paper's Tables 1 and 2, and the loads of its column, beside the exact numbers."""

from __future__ import annotations

import csv
import math
import os

import numpy as np

from ..results import Results, ResultsError
from ..results.file import reason

PIAN, STEIN, PAPER, EXACT = "Pian et al. (1967)", "Stein & Wriggers (1984)", "Silveira & Goncalves (2001)", "exact"
# Column of the exact table for each row of Table 2, and the point of the path: on the way up, the limit point, on the way down.
ANGLES = (("phi_34", "up", 34.0), ("phi_57", "up", 57.0), ("phi_cr", "critical", None), ("phi_62", "down", 62.0),
          ("phi_28", "down", 28.0))
COLUMN = {"a1": "C+", "a2": "LP", "a4": "C-"}


class Sources:
    """Published numbers and exact ones."""

    def __init__(self, root: str):
        self.root = root
        self.published = self._rows("input/paper/numbers.csv")
        self.angles = {row["medium"]: row for row in self._rows("tests/reference/ring_angles.csv")}
        self.critical = {float(row["kbar"]): float(row["p"]) for row in self._rows("tests/reference/ring_winkler_critical.csv")}

    def print_of(self, where: str, by: str, point: str, load: float | None = None) -> dict[str, str]:
        """The one row of the paper's numbers."""
        found = [row for row in self.published if (row["where"], row["by"], row["point"]) == (where, by, point)
                 and (load is None or float(row["load"]) == load)]
        if len(found) != 1:
            raise ResultsError(f"input/paper/numbers.csv: {len(found)} rows for {where}, {by}, {point}")
        return found[0]

    def curve(self, name: str, x: str, y: str) -> tuple[np.ndarray, np.ndarray]:
        rows = self._rows(f"tests/reference/{name}.csv")
        return tuple(np.array([float(row[key] or "nan") for row in rows]) for key in (x, y))

    def _rows(self, name: str) -> list[dict[str, str]]:
        try:
            with open(os.path.join(self.root, name), newline="", encoding="utf-8") as file:
                return list(csv.DictReader(line for line in file if not line.startswith("#")))
        except OSError as problem:
            raise ResultsError(f"{name}: cannot be read: {reason(problem)}") from problem


def separation_angle(results: Results, way: str, load: float | None) -> float:
    """Where contact begins, from the apex [degrees], at a load on the way up or down, or at the limit point."""
    return min(region.angle_start for region in results.contact.regions(point_at(results, way, load)))


def point_at(results: Results, way: str, load: float | None) -> int:
    """Number of the point where *LOCATE has put this load, on the way up or down; or of the limit point."""
    limit = next(critical.point for critical in results.critical if critical.label == "LP")
    if way == "critical":
        return limit
    return next(critical.point for critical in results.critical if critical.label == "UZ"
                and abs(critical.load_factor - load) < 1e-6 * load and (critical.point < limit) == (way == "up"))


def with_bar(fine: float, coarse: float, digits: int = 6) -> str:
    """A number and how much it changes on a coarser mesh."""
    return f"{fine:.{digits}f} +- {abs(fine - coarse):.0e}"


def load_with_bar(fine: Results, coarse: Results, label: str, digits: int = 6) -> str:
    """The first critical load of a label with the program's own bar; where it has none, with the change on a coarser mesh."""
    one, other = (next(critical for critical in results.critical if critical.label == label) for results in (fine, coarse))
    if math.isfinite(one.error):
        return f"{one.load_factor:.{digits}f} +- {one.error:.0e}"
    return with_bar(one.load_factor, other.load_factor, digits)


def table_1(runs, sources: Sources) -> str:
    """Critical load of the ring."""
    told = {by: sources.print_of("Table 1", by, "critical load")["load"] for by in (PIAN, STEIN, PAPER, EXACT)}
    rows = [("who", "p R^3/EI"), *((by, told[by]) for by in (PIAN, STEIN, PAPER)),
            ("unilat, rigid cavity", load_with_bar(runs["ring"], runs["ring-coarse"], "LP", 8)),
            ("exact, rigid cavity", f"{float(told[EXACT]):.8f}"),
            ("unilat, the paper's foundation", load_with_bar(runs["medium-3.6E6"], runs["medium-coarse"], "LP")),
            ("exact, the paper's foundation", f"{sources.critical[3.6e6]:.8f}"),
            ("unilat, the paper's element and loop",
             load_with_bar(runs["ring-ul2"], runs["ring-ul2-coarse"], "LP", 4))]
    return "Table 1: critical load of the ring in a rigid cavity\n" + laid_out(rows)


def table_2(runs, sources: Sources) -> str:
    """Angle of separation at given loads."""
    rows = [("p R^3/EI", "Pian", "paper", "unilat, rigid", "exact", "unilat, K = 36E5", "exact")]
    for name, way, load in ANGLES:
        published = [sources.print_of("Table 2", by, way, load)["value"] for by in (PIAN, PAPER)]
        ours = [with_bar(*(separation_angle(runs[run], way, load) for run in pair), 5)
                for pair in (("ring", "ring-coarse"), ("medium-3.6E6", "medium-coarse"))]
        exact = [f"{float(sources.angles[medium][name]):.5f}" for medium in ("rigid", "3.60e+06")]
        rows.append((f"{load:g} {way}" if load else "critical", *published, ours[0], exact[0], ours[1], exact[1]))
    return "Table 2: angle of separation [degrees]\n" + laid_out(rows)


def table_column(runs, sources: Sources) -> str:
    """The loads that the paper's text gives for the column."""
    rows = [("P/Pcr of the column", "paper", "unilat", "exact")]
    for point, label in COLUMN.items():
        row = sources.print_of("Fig. 9", PAPER, point)
        exact = float(sources.print_of("Fig. 9", EXACT, point)["load"])
        rows.append((f"{point}: {row['remark']}", row["load"], load_with_bar(runs["column"], runs["column-coarse"], label, 9), f"{exact:.9f}"))
    return "Figs. 9 to 11: loads of the column\n" + laid_out(rows)


def laid_out(rows: list[tuple]) -> str:
    """Columns side by side, a line below the head."""
    widths = [max(len(str(row[k])) for row in rows) for k in range(len(rows[0]))]
    lines = ["   " + "  ".join(str(cell).ljust(width) if k == 0 else str(cell).rjust(width)
                               for k, (cell, width) in enumerate(zip(row, widths))) for row in rows]
    lines.insert(1, "   " + "-" * (sum(widths) + 2 * (len(widths) - 1)))
    return "\n".join(lines) + "\n"

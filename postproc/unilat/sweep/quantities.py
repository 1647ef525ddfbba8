"""What is gathered of a run: a quantity at a critical point, or the largest, least, first or last one along the path."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from ..options import LABELS
from ..results import Critical, Results, ResultsError

AT = re.compile(rf"^({'|'.join(map(re.escape, LABELS))})(\d*)(?:\.(.+))?$")
ALONG = {"max": np.max, "min": np.min, "first": lambda values: values[0], "last": lambda values: values[-1]}


@dataclass(frozen=True)
class Quantity:
    word: str                  # as the sweep file has it
    label: str | None          # of a critical point; None: along the path
    number: int                # which of them, from 1
    how: str                   # of ALONG
    name: str                  # of the quantity

    def of(self, results: Results) -> float:
        """NaN where the path has no such point."""
        if self.label is None:
            values = results.column(self.name).values
            return float(ALONG[self.how](values)) if len(values) else float("nan")
        critical = self.point(results)
        if critical is None:
            return float("nan")
        if self.name == "load_factor":
            return critical.load_factor
        return float(results.column(self.name).values[critical.point - 1])

    def point(self, results: Results) -> Critical | None:
        """The critical point that it is taken at."""
        found = [critical for critical in results.critical if critical.label == self.label]
        return found[self.number - 1] if 0 < self.number <= len(found) else None

    def bar(self, results: Results) -> float:
        """The program's own error bar of it: infinite where the mesh is too coarse to tell, NaN where it is not told."""
        critical = self.point(results)
        if critical is None:
            return float("nan")
        return critical.error if self.name == "load_factor" else critical.monitor_errors.get(self.name, float("nan"))

    def corrected(self, results: Results) -> float:
        """It less its estimated error; NaN where there is no estimate."""
        critical = self.point(results)
        if critical is None:
            return float("nan")
        return critical.corrected if self.name == "load_factor" else critical.monitor_corrected.get(self.name, float("nan"))


def read_quantity(word, filename: str) -> Quantity:
    """`LP`, `LP2`, `C+.shortening`: the load factor, or another quantity, at a critical point; `max v`, `last load_factor`."""
    match = AT.match(word) if isinstance(word, str) else None
    if match:
        return Quantity(word, match.group(1), int(match.group(2) or 1), "", match.group(3) or "load_factor")
    how, _, name = word.partition(" ") if isinstance(word, str) else ("", "", "")
    if how in ALONG and name.strip():
        return Quantity(word, None, 0, how, name.strip())
    raise ResultsError(f"{filename}: [gather]: '{word}' is neither a label ({', '.join(LABELS)}) with a number and .quantity "
                       f"behind, nor {', '.join(ALONG)} and a quantity")

"""Tables of exact values: a CSV file whose columns are parameters and quantities, with their source in its comments."""

from __future__ import annotations

import csv
import math
import os

from ..results import ResultsError

SAME = 1e-9     # two values of a parameter are the same: what printing leaves


class ExactTable:
    """Rows are found by the parameters that the table and a run have in common."""

    def __init__(self, filename: str):
        self.filename = filename
        try:
            with open(filename, newline="", encoding="utf-8") as file:
                names, *rows = csv.reader(line for line in file if not line.startswith("#"))
        except (OSError, ValueError) as problem:
            raise ResultsError(f"{filename}: cannot be read: {getattr(problem, 'strerror', None) or problem}") from problem
        if any(len(row) != len(names) for row in rows):
            raise ResultsError(f"{filename}: not a table")
        self.names = names
        self.rows = [{name: _value(cell) for name, cell in zip(names, row)} for row in rows]

    def row(self, values: dict) -> dict:
        """All columns of the row of a run. An empty cell is NaN: there is no such quantity."""
        common = [name for name in self.names if name in values]
        found = [row for row in self.rows if all(_same(row[name], values[name]) for name in common)]
        if len(found) != 1:
            wanted = ", ".join(f"{name} = {values[name]}" for name in common)
            raise ResultsError(f"{os.path.basename(self.filename)}: {len(found)} rows with {wanted or 'no parameter in common'}")
        return found[0]


def _value(cell: str):
    try:
        return float(cell) if cell else math.nan
    except ValueError:
        return cell


def _same(one, two) -> bool:
    if isinstance(one, str) or isinstance(two, str):
        return str(one) == str(two)
    return math.isclose(one, two, rel_tol=SAME)

"""Reference curves: tables of numbers in CSV files."""

from __future__ import annotations

import csv
import os

import numpy as np

from .file import ResultsError, reason


def read_table(filename: str | os.PathLike, x: str, y: str) -> tuple[np.ndarray, np.ndarray]:
    """Two columns of a reference table: CSV, `#` comment lines, one line of names, then numbers.

    Empty cells and `nan` become NaN; other columns may hold text.
    """
    filename = os.fspath(filename)
    try:
        with open(filename, newline="", encoding="utf-8") as file:
            rows = list(_numbered_rows(file))
    except (OSError, UnicodeDecodeError, csv.Error) as problem:
        raise ResultsError(f"{filename}: cannot be read: {reason(problem)}") from problem
    if not rows:
        raise ResultsError(f"{filename}: holds no table")
    names = [name.strip() for name in rows[0][1]]
    picked = []
    for name in (x, y):
        if name not in names:
            raise ResultsError(f"{filename}: no column '{name}' (known: {', '.join(names)})")
        at = names.index(name)
        picked.append(np.array([_number(row, at, name, filename, number) for number, row in rows[1:]]))
    return picked[0], picked[1]


def _numbered_rows(file):
    reader = csv.reader(line if not line.lstrip().startswith("#") else "\n" for line in file)
    for row in reader:
        if any(cell.strip() for cell in row):
            yield reader.line_num, row


def _number(row: list[str], at: int, name: str, filename: str, line: int) -> float:
    cell = row[at].strip() if at < len(row) else ""
    try:
        return float(cell) if cell else float("nan")
    except ValueError:
        raise ResultsError(f"{filename}:{line}: column '{name}': '{cell}' is not a number") from None

"""A map: a sweep over two parameters whose every run is held against exact values."""

from __future__ import annotations

import os
from dataclasses import dataclass

from ..results import ResultsError
from ..sweep.run_deck import RunDeck, read_decks
from ..sweep.sweep_file import Sweep, read_sweep
from .exact_table import ExactTable
from .verdict import Check, read_checks

KEYS = ("exact", "check", "map")
LOOK = {"x", "y", "x_label", "y_label"}


@dataclass(frozen=True)
class Map:
    sweep: Sweep
    decks: list[RunDeck]
    checks: list[Check]
    known: list[dict]       # of each run: parameters and exact values
    look: dict              # x, y: parameters; x_label, y_label


def read_map(filename: str, program: str) -> Map:
    """`exact` names the table of exact values, [[check]] what is compared, [map] the axes of the picture.
    `program` reads the deck."""
    sweep = read_sweep(filename, KEYS)
    table = ExactTable(os.path.join(os.path.dirname(filename), sweep.more["exact"])) if "exact" in sweep.more else None
    known = [{**({} if table is None else table.row(values)), **values} for values in sweep.values]
    look = sweep.more.get("map", {})
    if set(look) - LOOK or not {"x", "y"} <= set(look):
        raise ResultsError(f"{filename}: [map] has x, y, x_label and y_label")
    for axis in "xy":
        if look[axis] not in sweep.values[0]:
            raise ResultsError(f"{filename}: [map]: no parameter '{look[axis]}' (known: {', '.join(sweep.values[0])})")
    return Map(sweep, read_decks(program, sweep.deck_path, sweep.settings), read_checks(sweep.more.get("check", []), filename), known, look)

"""Names of quantities as they stand in pictures."""

from __future__ import annotations

from .results import Column

WORDS = {"degree": "degrees", "radian": "radians", "second": "seconds"}


def escape(text: str) -> str:
    """Text from a file as it is: no mathematics."""
    return text.replace("$", r"\$")


def column_label(column: Column, scale: float = 1.0) -> str:
    """Axis label of a quantity: its name and its units."""
    name = escape(column.name if column.units != "1" or "_" not in column.name else column.name.replace("_", " "))
    units = "" if column.units.startswith("scaled ") else column.units.strip()     # by a factor of the deck
    factor = "" if scale == 1.0 else f"{scale:g} × "
    return factor + name + ("" if units in ("", "1") else f" ({escape(WORDS.get(units, units))})")

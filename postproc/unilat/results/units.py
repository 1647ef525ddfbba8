"""Units of a deck: a comment such as `** units: m, kN` says what its lengths and forces are, and labels and tables say so, too."""

from __future__ import annotations

import re

# "** units: m, kN", or a card *UNITS with the same line below.
NOTE = re.compile(r"^\*{2}\s*units\s*:\s*([^,\n]+),\s*([^,\n]+?)\s*$|^\*UNITS\b[^\n]*\n\s*([^,\n]+),\s*([^,\n]+?)\s*(?:,[^\n]*)?$",
                  re.MULTILINE | re.IGNORECASE)


def deck_units(deck: str) -> dict[str, str]:
    """What the words of the file are in the units of its deck; nothing where the deck does not say."""
    match = NOTE.search(deck)
    if not match:
        return {}
    length, force = (match[1] or match[3]).strip(), (match[2] or match[4]).strip()
    return {"length": length, "force": force, "moment": f"{force} {length}", "force/length": f"{force}/{length}",
            "force / length": f"{force}/{length}", "force / length^2": f"{force}/{length}^2", "1/length": f"1/{length}"}

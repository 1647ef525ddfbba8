"""The card table of the program, as `unilat --cards` prints it."""

from __future__ import annotations

import re
import subprocess
from dataclasses import dataclass, field

SECTION = re.compile(r"^### `\*([^`]+)`$", re.MULTILINE)
DATA_LINES = re.compile(r"^(?:One data line|Data lines)([^:]*): `([^`]+)`$", re.MULTILINE)
PLACE = re.compile(r" \*((?:[^*`]|`[^`]*`)+)\.\*\s*$")


@dataclass(frozen=True)
class Parameter:
    """A parameter of a card."""

    name: str
    value: str                # what may be typed, in words of the table; "(flag)": no value
    required: bool
    words: tuple[str, ...]    # the values that are accepted; empty: others


@dataclass(frozen=True)
class Card:
    """A card and what the table says of it."""

    keyword: str              # without the star
    text: str                 # its section of the reference without the heading (Markdown)
    purpose: str              # what it is for
    place: str                # where it may stand
    parameters: tuple[Parameter, ...] = ()
    words: frozenset[str] = field(default_factory=frozenset)     # that its parameters and data lines accept
    data_lines: tuple[tuple[str, str], ...] = ()                 # of its forms: when it holds, the fields

    @property
    def anchor(self) -> str:
        return self.keyword.lower().replace(" ", "-")


def read_cards(program: str) -> list[Card]:
    """The cards of a unilat, in the table's order; CalledProcessError when it does not print them."""
    printed = subprocess.run([program, "--cards"], check=True, capture_output=True, text=True, encoding="utf-8").stdout
    parts = SECTION.split(printed)[1:]
    return [_card(keyword, text.strip("\n")) for keyword, text in zip(parts[::2], parts[1::2])]


def _card(keyword: str, text: str) -> Card:
    first = text.split("\n\n")[0]
    place = PLACE.search(first)
    rows = [[cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]] for line in text.splitlines() if line.startswith("| ")]
    parameters = tuple(Parameter(re.sub(r"[`*]", "", row[0]), row[1], row[2] == "required" and row[0].startswith("**"), _words(row[1]))
                       for row in rows if len(row) == 4 and row[0] != "parameter")
    words = frozenset(word for row in rows for word in _words(row[1]))
    data = tuple((when.replace(", which may be left out", "").strip(), fields) for when, fields in DATA_LINES.findall(text))
    return Card(keyword, text, first[:place.start()] if place else first, place[1] if place else "", parameters, words, data)


def _words(cell: str) -> tuple[str, ...]:
    return tuple(re.findall(r"`([A-Z][A-Z0-9 ]*)`", cell))

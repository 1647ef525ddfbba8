"""One card of a deck: keyword, parameters, data lines, as text that the program reads."""

from __future__ import annotations

import difflib
import html
import re
from collections.abc import Iterable

import numpy as np

NUMBER = re.compile(r"^[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?$")
FREE_TEXT = "free text"


class Card:
    """A card. Every card of the program has a class of its own in unilat.cards, with what it takes in its docstring.

    `lines`: rows of numbers and names, a row a data line (one row may be given without brackets); text stands as it is, so
    "${gap}" writes a parameter of the deck.
    """

    spec: dict = {}
    keyword = ""
    names: dict[str, str] = {}       # of the parameters, by their names in Python

    def __init__(self, *lines, **parameters):
        self.comments: list[str] = []            # lines above it
        self.parameters: dict[str, object] = {}
        takes_values = any(field["kind"] == "name = value" for layout in self.spec.get("lines", ()) for field in layout["fields"])
        for name, value in parameters.items():
            if name in self.names:
                self.parameters[self.names[name]] = value
            elif takes_values:
                lines = (*lines, f"{name} = {written(value)}")
            else:
                near = difflib.get_close_matches(name, self.names, 1)
                known = f"known: {', '.join(self.names)}" if self.names else "it has none"
                raise TypeError(f"*{self.keyword} has no parameter '{name}' ({f'did you mean {near[0]}? ' if near else ''}{known})")
        self.lines = rows_of(lines, free_text=takes_values or self.spec.get("free_text", False))

    def text(self) -> str:
        """As it stands in the deck."""
        return "".join(f"{line}\n" for line in (*self.comments, self.head(), *(row_text(row) for row in self.lines)))

    def head(self) -> str:
        """The keyword line."""
        words = [f"*{self.keyword}"]
        for name, value in self.parameters.items():
            if value is None or value is False:
                continue
            words.append(name if value is True else f"{name}={written(value)}")
        return ", ".join(words)

    def __getitem__(self, name: str):
        """A parameter by its name in the deck or in Python."""
        return self.parameters[self._known(name)]

    def __setitem__(self, name: str, value):
        self.parameters[self._known(name)] = value

    def get(self, name: str, default=None):
        """A parameter, or the default where the card does not have it."""
        return self.parameters.get(self._known(name), default)

    def _known(self, name: str) -> str:
        return self.names.get(name, name.upper().replace("_", " ") if name.islower() else name)

    def __repr__(self) -> str:
        return f"<{self.head()}{f', {len(self.lines)} lines' if self.lines else ''}>"

    def _repr_html_(self) -> str:
        return f"<pre>{html.escape(self.text())}</pre>"


def rows_of(lines, free_text: bool = False) -> list:
    """Data lines from what was given: rows, one row without brackets, or an array."""
    if free_text:
        return [line for each in lines for line in (str(each).splitlines() or [""])]
    if len(lines) == 1 and not isinstance(lines[0], str) and isinstance(lines[0], Iterable):
        first = list(lines[0])
        if first and all(_is_row(each) for each in first):
            return [list(row) for row in first]
    if lines and all(_is_row(line) for line in lines):
        return [list(row) for row in lines]
    if len(lines) == 1 and isinstance(lines[0], str):
        return [line if "," in line else [line] for line in lines[0].splitlines()]
    return [list(lines)] if lines else []


def _is_row(value) -> bool:
    return not isinstance(value, str) and isinstance(value, Iterable)


def row_text(row) -> str:
    """A data line; text as it is."""
    return row if isinstance(row, str) else ", ".join(written(value) for value in row)


def written(value) -> str:
    """A value as the program reads it."""
    if value is None:
        return ""
    if isinstance(value, (bool, np.bool_)):
        return str(value).upper()
    if isinstance(value, (int, np.integer)):
        return str(int(value))
    if isinstance(value, (float, np.floating)):
        return repr(float(value))
    return str(value)


def value_of(word: str):
    """A word of a deck as a number where it is one."""
    word = word.strip()
    if not word:
        return None
    if NUMBER.match(word):
        return int(word) if re.fullmatch(r"[+-]?\d+", word) else float(word)
    return word

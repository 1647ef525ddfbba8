"""What the card *UNITS names lengths and forces; without it the words stand for themselves."""

from __future__ import annotations

import re
from dataclasses import dataclass

import h5py

from .file import text


@dataclass(frozen=True)
class Units:
    length: str = "length"
    force: str = "force"

    def __bool__(self) -> bool:
        """True where the deck names them."""
        return (self.length, self.force) != ("length", "force")

    def of(self, words: str) -> str:
        """Units in words, such as "force/length", with the deck's names in them."""
        names = {"length": self.length, "force": self.force}
        if self.force != "force":
            names["moment"] = f"{self.force} {self.length}"
        return re.sub(r"\b(length|force|moment)\b", lambda word: names.get(word[0], word[0]), words)


def read_units(file: h5py.File) -> Units:
    return Units(**{kind: text(file.attrs[f"{kind}_unit"]) for kind in ("length", "force") if f"{kind}_unit" in file.attrs})

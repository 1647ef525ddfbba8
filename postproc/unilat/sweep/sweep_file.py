"""A sweep file (TOML) and its deck: which runs there are, what is gathered of them, which pictures are drawn."""

from __future__ import annotations

import os
from dataclasses import dataclass

from ..plain_text import printable
from ..results import ResultsError
from .quantities import Quantity, read_quantity
from .sampling import GROUPS, samples

KNOWN = {"title", "deck", "timeout", "gather", "picture", *GROUPS}
KINDS = (("title", str, "text"), ("deck", str, "the name of a deck"), ("gather", dict, "a table, [gather]"),
         ("picture", list, "a list of tables, [[picture]]"), *((group, dict, f"a table, [{group}]") for group in GROUPS))
DEFAULT = {"limit_load": "LP"}
OWN_COLUMNS = {"run", "points", "code", "message", "seconds", "key"}


@dataclass(frozen=True)
class Sweep:
    name: str                  # of the file, without folder and ending
    title: str
    text: str                  # of the sweep file
    deck_path: str
    values: list[dict]         # parameters of every run
    group: dict[str, str]      # which of GROUPS each parameter is in
    gather: dict[str, Quantity]
    pictures: list[dict]
    timeout: float | None      # [s] a run
    more: dict                 # what else was asked for, see read_sweep

    @property
    def settings(self) -> list[tuple[str, ...]]:
        """Of every run, what the program gets with --set."""
        return [settings_of(each) for each in self.values]


def read_sweep(filename: str, also: tuple[str, ...] = ()) -> Sweep:
    """Everything checked that can be checked before the first run. `also`: further keys that the file may have."""
    text = read_text(filename)
    content = read_toml(text, filename)
    known = KNOWN | set(also)
    unknown = set(content) - known
    if unknown:
        raise ResultsError(f"{filename}: '{min(unknown)}' is not known (known: {', '.join(sorted(known))})")
    for key, kind, words in KINDS:
        if not isinstance(content.get(key, kind()), kind):
            raise ResultsError(f"{filename}: {key} must be {words}")
    if "deck" not in content:
        raise ResultsError(f"{filename}: deck is missing: deck = \"NAME.inp\"")
    for what, name in (("a sweep file", os.path.splitext(os.path.basename(filename))[0]), ("the deck", content["deck"])):
        if not name.isprintable():
            raise ResultsError(f"{printable(filename)}: the name of {what} may have no control characters")
    deck_path = os.path.join(os.path.dirname(filename), content["deck"])
    if not os.path.exists(deck_path):
        raise ResultsError(f"{filename}: there is no deck {deck_path}")
    values = samples({name: content[name] for name in GROUPS if name in content}, filename)
    timeout = content.get("timeout")
    if timeout is not None and not (isinstance(timeout, (int, float)) and not isinstance(timeout, bool) and timeout > 0):
        raise ResultsError(f"{filename}: timeout must be a positive number of seconds")
    gather = {name: read_quantity(word, filename) for name, word in content.get("gather", DEFAULT).items()}
    clash = set(gather) & set(values[0])
    if clash:
        raise ResultsError(f"{filename}: '{min(clash)}' is a parameter and in [gather]")
    taken = OWN_COLUMNS & (set(gather) | set(values[0]))
    if taken:
        raise ResultsError(f"{filename}: '{min(taken)}' is a column of every sweep; choose another name")
    return Sweep(os.path.splitext(os.path.basename(filename))[0], content.get("title", ""), text, deck_path,
                 values, {name: word for word in GROUPS for name in content.get(word, {}) if name in values[0]},
                 gather, _pictures(content, filename, gather, values[0]), timeout,
                 {key: content[key] for key in also if key in content})


def settings_of(values: dict) -> tuple[str, ...]:
    """What the program gets with --set."""
    return tuple(f"{name}={_written(value)}" for name, value in values.items())


def _written(value) -> str:
    return repr(float(value)) if isinstance(value, float) else f'"{value}"' if isinstance(value, str) else str(value)


def _pictures(content: dict, filename: str, gather: dict, values: dict) -> list[dict]:
    known = [*values, *gather]
    for picture in content.get("picture", []):
        for key in ("x", "y", "value", "over"):
            if key in picture and picture[key] not in known:
                raise ResultsError(f"{filename}: picture: no parameter or gathered quantity '{picture[key]}' "
                                   f"(known: {', '.join(known)})")
    return content.get("picture", [])


def read_text(filename: str) -> str:
    """A text file; what goes wrong is told with its name."""
    try:
        with open(filename, encoding="utf-8") as file:
            return file.read()
    except (OSError, UnicodeDecodeError) as problem:
        raise ResultsError(f"{filename}: cannot be read: {getattr(problem, 'strerror', None) or problem}") from problem


def read_toml(text: str, filename: str) -> dict:
    """Its content."""
    try:
        import tomllib
    except ModuleNotFoundError:     # Python 3.10
        try:
            import tomli as tomllib
        except ModuleNotFoundError:
            raise ResultsError("sweep files need Python 3.11, or the package tomli: apt-get install python3-tomli, "
                               "or pip install tomli") from None
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as problem:
        raise ResultsError(f"{filename}: {problem}") from problem

"""A study: one scene by several methods, each over meshes from coarse to fine, its error held against what it takes."""

from __future__ import annotations

import os
from dataclasses import dataclass

from ..results import ResultsError
from ..sweep.run_deck import RunDeck, read_decks
from ..sweep.sweep_file import read_text, read_toml, settings_of
from .peer import SETTINGS
from .verdict import Check, read_checks

KNOWN = {"title", "deck", "repeats", "timeout", "fixed", "check", "curve"}


@dataclass(frozen=True)
class Study:
    name: str
    title: str
    repeats: int
    timeout: float
    checks: list[Check]
    runs: list[tuple[str, dict, RunDeck, dict | None]]  # name of the curve, parameters, deck, settings of OpenSees or None: unilat


def read_study(filename: str, program: str) -> Study:
    """`program` reads the decks. [fixed]: parameters of all runs; [[curve]]: name, and parameters of its own, lists of which make its runs, side by side.

    A curve with program = "opensees" is one of OpenSees; `control`, `increment` and `penalty` are its options then (unilat.opensees).
    """
    content = read_toml(read_text(filename), filename)
    if set(content) - KNOWN:
        raise ResultsError(f"{filename}: '{min(set(content) - KNOWN)}' is not known (known: {', '.join(sorted(KNOWN))})")
    if "deck" not in content or not content.get("curve"):
        raise ResultsError(f"{filename}: deck and [[curve]] are needed")
    deck_name = os.path.join(os.path.dirname(filename), content["deck"])
    runs = []
    for curve in content["curve"]:
        values = {**content.get("fixed", {}), **curve}
        name = str(values.pop("name", f"curve {len(runs) + 1}"))
        other = values.pop("program", "unilat")
        if other not in ("unilat", "opensees"):
            raise ResultsError(f"{filename}: {name}: program = \"{other}\" is neither unilat nor opensees")
        settings = {key: values.pop(key) for key in SETTINGS if key in values} if other == "opensees" else None
        lengths = {len(value) for value in values.values() if isinstance(value, list)}
        if len(lengths) > 1:
            raise ResultsError(f"{filename}: {name}: lists must have the same length")
        chosen = [{key: value[k] if isinstance(value, list) else value for key, value in values.items()}
                  for k in range(max(lengths, default=1))]
        try:
            decks = read_decks(program, deck_name, [settings_of(each) for each in chosen])
        except ResultsError as problem:
            raise ResultsError(f"{filename}: {name}: {problem}") from None
        runs += [(name, each, deck, settings) for each, deck in zip(chosen, decks)]
    return Study(os.path.splitext(os.path.basename(filename))[0], content.get("title", ""), int(content.get("repeats", 3)),
                 float(content.get("timeout", 60.0)), read_checks(content.get("check", []), filename), runs)

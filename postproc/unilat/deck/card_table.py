"""The program's own table of cards (unilat --cards=json), and a class for each card, made from it."""

from __future__ import annotations

import difflib
import functools
import inspect
import json
import keyword as python
import os
import textwrap

from .. import program
from ..results import ResultsError
from .card import Card

WIDTH = 100


@functools.lru_cache(maxsize=4)
def _table(name: str, modified: float) -> dict[str, dict]:
    done = program.ask(name, ["--cards=json"])
    try:
        cards = json.loads(done.stdout)["cards"]
    except (ValueError, KeyError):
        raise ResultsError(f"{name}: does not say which cards it has ({done.stderr.strip() or 'no answer to --cards=json'}); it is older "
                           "than this package, or not unilat") from None
    return {card["keyword"]: card for card in cards}


def table() -> dict[str, dict]:
    """The cards by keyword, as the program has them."""
    name = program.find_program()
    try:
        return _table(name, os.stat(name).st_mtime if os.path.exists(name) else 0.0)
    except OSError as problem:
        raise ResultsError(f"{name}: {problem.strerror}") from problem


def python_name(name: str) -> str:
    """BEAM SECTION -> beam_section; words of Python itself get an underscore."""
    name = name.lower().replace(" ", "_").replace("-", "_")
    return f"{name}_" if python.iskeyword(name) else name


def class_name(keyword: str) -> str:
    """BEAM SECTION -> BeamSection."""
    return "".join(word.capitalize() for word in keyword.split())


def card_class(keyword: str) -> type[Card]:
    """The class of a card."""
    known = table()
    key = " ".join(keyword.upper().split())
    if key not in known:
        near = difflib.get_close_matches(key, known, 1)
        raise ResultsError(f"no card *{key}{f' (did you mean *{near[0]}?)' if near else ''}; unilat.cards lists them")
    return _class(json.dumps(known[key]))


@functools.lru_cache(maxsize=256)
def _class(spec: str) -> type[Card]:
    spec = json.loads(spec)
    parameters = [inspect.Parameter("lines", inspect.Parameter.VAR_POSITIONAL)]
    if any(field["kind"] == "name = value" for layout in spec["lines"] for field in layout["fields"]):
        parameters.append(inspect.Parameter("values", inspect.Parameter.VAR_KEYWORD))
    names = {python_name(item["name"]): item["name"] for item in spec["parameters"]}
    for name, item in zip(names, spec["parameters"]):
        needed = item["required"] and not item["only"]
        default = inspect.Parameter.empty if needed else item["default"] or None
        parameters.insert(len([each for each in parameters if each.kind != inspect.Parameter.VAR_KEYWORD]),
                          inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default))
    return type(class_name(spec["keyword"]), (Card,), {
        "__doc__": docstring(spec), "__module__": "unilat.cards", "spec": spec, "keyword": spec["keyword"], "names": names,
        "__signature__": inspect.Signature(parameters)})


def docstring(spec: dict) -> str:
    """What help() says: purpose, place, parameters, data lines."""
    place = {"model": "Model part", "step": "In a step", "anywhere": "Model part or in a step"}.get(spec["where"], "Outside steps")
    place += f", below *{spec['follows']}" if spec["follows"] else ""
    place += ", once." if spec["once"] else "."
    parts = [f"*{spec['keyword']}: {spec['meaning']}", place]
    if spec["parameters"]:
        parts.append("Parameters:\n" + "\n".join(_item(item, python_name(item["name"])) for item in spec["parameters"]))
    for layout in spec["lines"]:
        if not layout["fields"]:
            continue
        head = "One line" if layout.get("most") == 1 else "Lines"
        head += f" with {layout['when']}" if layout["when"] else " otherwise" if len(spec["lines"]) > 1 else ""
        head += ": " + ", ".join(field["name"] for field in layout["fields"]) + (", ..." if layout["last_repeats"] else "")
        parts.append(head + "\n" + "\n".join(_item(field, field["name"]) for field in layout["fields"]))
    if not spec["lines"]:
        parts.append("No lines.")
    return "\n\n".join(textwrap.fill(part, WIDTH, break_on_hyphens=False) if "\n" not in part else part for part in parts)


def _item(item: dict, name: str) -> str:
    kind = " | ".join(item["words"]) if item["kind"] == "word" else item["kind"] + (f" or {', '.join(item['words'])}" if item["words"] else "")
    notes = [kind, item["bound"], item["unit"], "required" if item["required"] and not item["only"] else
             f"default {item['default']}" if item["default"] else "", f"with {item['only']} only" if item["only"] else ""]
    return textwrap.fill(f"{name} ({', '.join(note for note in notes if note)}): {item['meaning']}", WIDTH, initial_indent="    ",
                         subsequent_indent="        ", break_on_hyphens=False)

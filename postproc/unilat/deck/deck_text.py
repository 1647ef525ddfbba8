"""The text of a deck as cards: keyword lines, data lines, comments. What they mean is the program's affair."""

from __future__ import annotations

from ..results import ResultsError
from . import card_table
from .card import Card, value_of


class Unknown(Card):
    """A card that the program does not have."""


def cards_of(text: str) -> tuple[list[Card], list[str]]:
    """The cards in their order, and comments behind the last one."""
    found: list[Card] = []
    comments: list[str] = []
    lines = iter(text.splitlines())
    for line in lines:
        if line.lstrip().startswith("**") or not line.strip():
            comments.append(line)
        elif line.lstrip().startswith("*"):
            while line.rstrip().endswith(","):        # goes on in the next line, past comments
                more = next((each for each in lines if each.strip() and not each.lstrip().startswith("**")), None)
                if more is None:
                    break
                line = f"{line.rstrip()} {more.strip()}"
            found.append(_card(line))
            found[-1].comments, comments = comments, []
        elif not found:
            raise ResultsError(f"no card stands above the line '{line.strip()}'")
        else:
            found[-1].lines += [*comments, _row(found[-1], line)]
            comments = []
    return found, comments


def _card(line: str) -> Card:
    keyword, *words = (word.strip() for word in line.lstrip()[1:].split(","))
    try:
        made = card_table.card_class(keyword)
    except ResultsError:
        made = Unknown
    card = made.__new__(made)
    card.comments, card.parameters, card.lines = [], {}, []
    if made is Unknown:
        card.keyword = keyword
    if made.keyword == "INCLUDE":       # the rest of the line is the name of a file
        words = [line.lstrip()[1:].split(",", 1)[1].strip()] if words else []
    for word in words:
        name, equals, value = word.partition("=")
        name = name.strip()
        known = {"".join(each.split()).upper(): each for each in made.names.values()}
        card.parameters[known.get("".join(name.split()).upper(), name)] = value_of(value) if equals else True
    return card


def _row(card: Card, line: str):
    """A data line as values; of free text as it is."""
    if card.spec.get("free_text", True):
        return line
    return [value_of(word) for word in line.split(",")]

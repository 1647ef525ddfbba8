"""The manual's page of cards, A to Z: what the program's table says, an example from a deck that the tests run, the decks that use it."""

from __future__ import annotations

import pathlib
import re
from collections.abc import Iterable

from .card_table import Card

HEAD = """<!-- Written by `input/run manual --pages` from the program's card table and the decks of input. Changes here do not last. -->
# Cards A to Z

A card begins with a star and its keyword. Parameters follow on the same line, data lines below it;
[how a deck is written](guide.md#how-a-deck-is-written) has the rules. The tables below are those by which the program reads decks:
`unilat --cards` prints them.

* Names of required parameters are bold. A field without a default that is not required may be left out.
* "Model part" is all before the first `*STEP`. "In a step" is between `*STEP` and `*END STEP`.
* Every example is part of the deck that is named beside it. The tests run these decks.

| card | what it is for |
|---|---|
"""
MOST_LINES = 6       # of an example
MOST_DECKS = 8       # that are named


def cards_page(cards: list[Card], input_folder: pathlib.Path) -> str:
    """The whole page (Markdown); KeyError when no deck of the folder uses a card."""
    decks = {path.relative_to(input_folder).as_posix(): path.read_text(encoding="utf-8")
             for path in [*sorted(input_folder.glob("*.inp")), *sorted(input_folder.glob("materials/*.inp"))]}     # and what they include
    chapters = _chapters((input_folder / "manual" / "guide.md").read_text(encoding="utf-8"))
    lessons = _lessons((input_folder / "manual" / "tutorial.md").read_text(encoding="utf-8"))
    ordered = sorted(cards, key=lambda card: card.keyword)
    rows = "".join(f"| [`*{card.keyword}`](#{card.anchor}) | {_first_sentence(card.purpose)} |\n" for card in ordered)
    return HEAD + rows + "".join(_section(card, decks, chapters, lessons) for card in ordered)


def _first_sentence(text: str) -> str:
    return re.split(r"(?<=[.]) (?=[A-Z`])", text)[0]


def _section(card: Card, decks: dict[str, str], chapters: dict[str, str], lessons: dict[str, str]) -> str:
    deck, lines = example(card, decks)
    users = [name for name, text in decks.items() if blocks(text, card.keyword)]
    named = ", ".join(f"[{name}](../{name})" for name in _spread(users, deck))
    more = f" and {len(users) - MOST_DECKS} more" if len(users) > MOST_DECKS else ""
    taught = [f"[{title.split('.')[0]}](tutorial.md#{slug(title)})" for title, text in lessons.items() if blocks(text, card.keyword)]
    lesson = f"; {'lesson' if len(taught) == 1 else 'lessons'} {', '.join(taught)} of the tutorial" if taught else ""
    about = [f"[{title}](guide.md#{slug(title)})" for title, text in chapters.items() if re.search(rf"`\*{card.keyword}[`,]", text)]
    see = f"\n\nMore: {', '.join(about)}." if about else ""
    return (f"\n## `*{card.keyword}`\n\n{card.text}\n\nExample, from [{deck}](../{deck}):\n\n```inp-part\n" + "\n".join(lines)
            + f"\n```\n\nUsed in {named}{more}{lesson}.{see}\n")


def _spread(users: list[str], deck: str) -> list[str]:
    """Some of the decks, that of the example first."""
    others = [name for name in users if name != deck]
    step = max(1, -(-len(others) // (MOST_DECKS - 1)))
    return [deck, *(others if len(users) <= MOST_DECKS else others[::step])][:MOST_DECKS]


def blocks(deck: str, keyword: str) -> list[list[str]]:
    """The cards of a deck with this keyword, each with its data lines; comments are left out."""
    found, block = [], None
    for line in deck.splitlines():
        if line.startswith("**") or not line.strip():
            continue
        if line.startswith("*"):
            block = None
            if line[1:].split(",")[0].strip().upper() == keyword:
                block = []
                found.append(block)
        if block is not None:
            block.append(line)
    return found


def example(card: Card, decks: dict[str, str]) -> tuple[str, list[str]]:
    """The deck and the lines that show a card best: short, and with many of its parameters."""
    there = [(name, block) for name, text in decks.items() for block in blocks(text, card.keyword)]
    if not there:
        raise KeyError(f"no deck of input uses *{card.keyword}; every card needs an example")
    name, block = min(there, key=lambda item: (len(item[1]) > MOST_LINES, -item[1][0].count(","), len(item[1]), item[0]))
    return name, block if len(block) <= MOST_LINES else block[:MOST_LINES]


def slug(title: str) -> str:
    """The anchor of a heading."""
    return re.sub(r"[^a-z0-9 _-]", "", title.lower()).replace(" ", "-")


def _chapters(page: str) -> dict[str, str]:
    return dict(_parts(page, re.compile(r"^##+ (.*)$", re.MULTILINE)))


def _lessons(page: str) -> dict[str, str]:
    return {title: text for title, text in _parts(page, re.compile(r"^##+ (.*)$", re.MULTILINE)) if title[0].isdigit()}


def _parts(page: str, heading: re.Pattern[str]) -> Iterable[tuple[str, str]]:
    parts = heading.split(page)[1:]
    return zip(parts[::2], parts[1::2])

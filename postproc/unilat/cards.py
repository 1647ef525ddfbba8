"""A class for every card of the program, made from its own table: unilat.cards.BeamSection, unilat.cards.Static, ...

Their docstrings say what the manual says. Deck has a method for each, which makes the card and puts it into the deck.
"""

from .deck import card_table


def __getattr__(name: str):
    if name.startswith("_"):
        raise AttributeError(name)
    for keyword in card_table.table():
        if card_table.class_name(keyword) == name:
            return card_table.card_class(keyword)
    raise AttributeError(f"no card has the class '{name}' (known: {', '.join(__dir__())})")


def __dir__() -> list[str]:
    return [card_table.class_name(keyword) for keyword in card_table.table()]

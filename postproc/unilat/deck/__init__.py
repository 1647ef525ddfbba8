"""Decks as Python objects: built, read, written, run, varied."""

from .deck import Deck, Step
from .errors import DeckError, PathStopped, Place, ProgramError

__all__ = ["Deck", "DeckError", "PathStopped", "Place", "ProgramError", "Step"]

"""Decks and results of unilat in Python.

    from unilat import Deck, read_results, to_pandas, to_xarray

    deck = Deck.read("ring.inp")            # or built card by card, see unilat.deck.deck
    ring = deck.run()                       # its results; errors of the deck are exceptions with line and column
    ring = read_results("ring.h5")          # the same of a file: numpy arrays, see unilat.results.reader
    ring.plot.shape(label="LP")             # pictures, shown by notebooks
    table = deck.sweep(grid={"gap": [0.01, 0.02]}, gather={"limit": "LP"})
    frame = to_pandas(ring, "path")         # a pandas.DataFrame, when pandas is installed
    data = to_xarray(ring)                  # an xarray.Dataset, when xarray is installed

The commands are unilat-plot (or python3 -m unilat) and unilat-sweep (or python3 -m unilat.sweep).
"""

import importlib

_WHERE = {"Deck": "deck", "DeckError": "deck", "PathStopped": "deck", "ProgramError": "deck", "Step": "deck", "cards": None,
          "read_results": "results", "ResultsError": "results", "to_pandas": "tables", "to_xarray": "tables"}
__all__ = list(_WHERE)


def __getattr__(name: str):
    """Imported when asked for, so that the commands can say which package is missing."""
    if name not in _WHERE:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    if _WHERE[name] is None:
        return importlib.import_module(f".{name}", __name__)
    return getattr(importlib.import_module(f".{_WHERE[name]}", __name__), name)


def __dir__() -> list[str]:
    return sorted({*__all__, "__doc__", "__name__", "__path__"})

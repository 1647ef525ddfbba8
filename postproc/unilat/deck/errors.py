"""What goes wrong with a deck or a run, as exceptions with the program's own words."""

from __future__ import annotations

import re
from dataclasses import dataclass

from ..results import Results, ResultsError

PLACE = re.compile(r"^(?P<file>.+?):(?P<line>\d+):(?P<column>\d+): (?P<message>.*)$")


@dataclass(frozen=True)
class Place:
    """One error of a deck."""

    file: str                 # of the deck, or of one that it includes
    line: int                 # from 1
    column: int               # from 1
    message: str
    card: object | None = None      # the Card that wrote the line; None: of an included deck, or read as text


class DeckError(ResultsError):
    """The program does not accept the deck. The text is what it prints: the message, the line, carets under the place."""

    def __init__(self, report: str, places: list[Place]):
        super().__init__(report)
        self.report, self.places = report, places
        first = places[0] if places else Place("", 0, 0, report)
        self.file, self.line, self.column, self.message, self.card = first.file, first.line, first.column, first.message, first.card


class PathStopped(ResultsError):
    """The path ended before what the deck asks for; `results` has it up to there."""

    def __init__(self, why: str, results: Results):
        super().__init__(why)
        self.results = results


class ProgramError(ResultsError):
    """The program itself failed, or was ended."""


def places_of(report: str, card_of=lambda file, line: None) -> list[Place]:
    """The errors of a report; `card_of(file, line)`: which card wrote a line."""
    found = [match for match in map(PLACE.match, report.splitlines()) if match]
    return [Place(match["file"], int(match["line"]), int(match["column"]), match["message"], card_of(match["file"], int(match["line"])))
            for match in found]

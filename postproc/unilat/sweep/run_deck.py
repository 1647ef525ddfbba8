"""What the runs of a sweep run: a deck, and values for its parameters."""

from __future__ import annotations

import re
import subprocess
from dataclasses import dataclass

from ..results import ResultsError


@dataclass(frozen=True)
class RunDeck:
    text: str                      # with included decks in their place
    settings: tuple[str, ...]      # name=value

    @property
    def options(self) -> list[str]:
        """Of the command line."""
        return [word for setting in self.settings for word in ("--set", setting)]


def read_decks(program: str, path: str, settings: list[tuple[str, ...]]) -> list[RunDeck]:
    """The deck with the values of every run. The program reads it, and says what is wrong with it or with the names."""
    text = _expanded(program, path, settings[0])
    includes = [line for line in text.splitlines() if re.match(r"\*\* \*\s*INCLUDE\b", line, re.IGNORECASE)]
    if any("${" in line for line in includes):     # which decks are included depends on the values
        return [RunDeck(_expanded(program, path, each), each) for each in settings]
    return [RunDeck(text, each) for each in settings]


def _expanded(program: str, path: str, settings: tuple[str, ...]) -> str:
    try:
        done = subprocess.run([program, "--expand", *RunDeck("", settings).options, path], capture_output=True, encoding="utf-8",
                              errors="replace", check=False)
    except OSError as problem:
        raise ResultsError(f"{program}: {problem.strerror}") from problem
    if done.returncode:
        said = done.stderr.strip().splitlines() or [f"{program} cannot read {path}"]
        raise ResultsError("\n".join(said[:-1] or said))       # the last line counts the errors
    return done.stdout

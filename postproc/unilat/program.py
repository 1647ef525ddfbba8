"""The program unilat: where it is, and what it says of a deck."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys

from .results import ResultsError

MISSING = "the program unilat is not on the PATH; name it with --program, or in the variable UNILAT"


def find_program(given: str | os.PathLike | None = None) -> str:
    """The named one, that of the variable UNILAT, that of this package (a wheel brings it), or the one on the PATH."""
    own = os.path.join(os.path.dirname(os.path.abspath(__file__)), "bin", "unilat")
    program = given or os.environ.get("UNILAT") or (own if os.path.exists(own) else None) or shutil.which("unilat")
    if not program:
        raise ResultsError(MISSING)
    return os.fspath(program)


def environment() -> dict[str, str]:
    """Threads only cost time on matrices as small as these."""
    return {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}


def ask(program: str, arguments: list[str], deck: str | None = None) -> subprocess.CompletedProcess:
    """Runs the program to its end; `deck`: text for its standard input."""
    try:
        return subprocess.run([program, *arguments], input=deck, stdin=subprocess.DEVNULL if deck is None else None, capture_output=True,
                              encoding="utf-8", errors="replace", env=environment(), check=False)
    except OSError as problem:
        raise ResultsError(f"{program}: cannot be started: {problem.strerror or problem}; name the program unilat with --program, or in "
                           "the variable UNILAT") from problem


def write_model(program: str, deck: str, settings: list[str], output: str):
    """A result file that has the model of a deck and no path; what is wrong with the deck is raised as the program says it."""
    done = ask(program, ["--model", "-o", output, *(word for setting in settings for word in ("--set", setting)), deck])
    if done.returncode:
        raise ResultsError(done.stderr.strip() or f"{program} ended with code {done.returncode} and no message")


def main() -> int:
    """The command `unilat` of a wheel: the program itself takes the place of this process."""
    program = find_program()
    os.execv(program, ["unilat", *sys.argv[1:]])
    return 0

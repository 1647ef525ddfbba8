"""The folder of a sweep: its state. Every finished run has a record there, and nothing else counts."""

from __future__ import annotations

import hashlib
import json
import os
import socket
import subprocess
import time
from dataclasses import dataclass

from ..results import ResultsError
from .run_deck import RunDeck

TIMED_OUT = 124      # exit code of a run that took too long, as `timeout` has it
LAST = 2000          # characters of a message


@dataclass(frozen=True)
class Record:
    """What became of a run."""

    code: int                 # of unilat; negative: ended by this signal
    message: str              # of a run that did not end well
    seconds: float


class RunFolder:
    """Runs are known by a key of program, deck and values: the same one is never run twice, and a changed one always."""

    def __init__(self, folder: str, program: str):
        self.folder, self.runs = folder, os.path.join(folder, "runs")
        self.program = os.path.abspath(program)
        self.command = [self.program]
        try:
            os.makedirs(self.runs, exist_ok=True)
            with open(self.program, "rb") as file:
                self.program_hash = hashlib.sha256(file.read()).hexdigest()
        except OSError as problem:
            raise ResultsError(f"{problem.filename}: {problem.strerror}") from problem

    def key(self, deck: RunDeck) -> str:
        told = "\n".join((self.program_hash, *deck.settings, deck.text))
        return hashlib.sha256(told.encode()).hexdigest()[:24]

    def results(self, key: str) -> str:
        """Result file of a finished run; there when its code is 0 or 2."""
        return os.path.join(self.runs, f"{key}.h5")

    def listing(self, key: str) -> str:
        """Deck and listing of a run that did not end well."""
        return os.path.join(self.runs, f"{key}.failed")

    def record(self, key: str) -> Record | None:
        try:
            with open(os.path.join(self.runs, f"{key}.json"), encoding="utf-8") as file:
                return Record(**json.load(file))
        except FileNotFoundError:
            return None

    def finished(self) -> set[str]:
        """Keys of all runs with a record: one look at the folder."""
        return {name[:-5] for name in os.listdir(self.runs) if name.endswith(".json")}

    def run(self, key: str, deck: RunDeck, timeout: float | None) -> Record:
        """Runs a deck. Files get their names when they are whole, the record last: a kill leaves a run undone, never half."""
        mark = f"{socket.gethostname()}-{os.getpid()}"
        part = os.path.join(self.runs, f"{key}.{mark}.part")
        start = time.perf_counter()
        environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
        try:
            done = subprocess.run([*self.command, "-o", part, *deck.options], input=deck.text, capture_output=True,
                                  encoding="utf-8", errors="replace", timeout=timeout, env=environment, check=False)
            code, said, wrong = done.returncode, done.stdout, done.stderr
        except subprocess.TimeoutExpired:
            code, said, wrong = TIMED_OUT, "", f"took longer than {timeout:g} s"
        record = Record(code, _message(code, wrong, said) if code else "", round(time.perf_counter() - start, 4))
        if code in (0, 2) and os.path.exists(part):
            os.replace(part, self.results(key))
        elif os.path.exists(part):
            os.remove(part)
        if code:
            self._write(self.listing(key), f"{deck.text}\n---- {' '.join(deck.settings)}\n---- exit code {code}\n{said}\n{wrong}\n", mark)
        self._write(os.path.join(self.runs, f"{key}.json"), json.dumps(record.__dict__), mark)
        return record

    def sweep_up(self):
        """Removes what runs left behind that were killed; only when nothing runs."""
        for name in os.listdir(self.runs):
            if name.endswith(".part"):
                os.remove(os.path.join(self.runs, name))

    def _write(self, name: str, text: str, mark: str):
        with open(f"{name}.{mark}.part", "w", encoding="utf-8") as file:
            file.write(text)
        os.replace(f"{name}.{mark}.part", name)


def _message(code: int, wrong: str, said: str) -> str:
    """The last lines that say why, in one line."""
    lines = [line.strip() for line in (wrong or said).splitlines() if line.strip()]
    first = lines[0] if lines and code == 1 else lines[-1] if lines else f"ended with code {code} and no message"
    return first.removeprefix("unilat: ")[:LAST]

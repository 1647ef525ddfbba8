"""The folder of a sweep: its state. Every finished run has a record there, and nothing else counts."""

from __future__ import annotations

import hashlib
import json
import os
import socket
import subprocess
import time
from dataclasses import dataclass

import h5py

from ..results import ResultsError
from .locks import inherited
from .processes import Processes
from .run_deck import RunDeck

REFUSED, ENDED = 5, 6      # exit codes of unilat: a full disk and its like; ended from outside
TIMED_OUT = 124      # exit code of a run that took too long, as `timeout` has it
LAST = 2000          # characters of a message


@dataclass(frozen=True)
class Record:
    """What became of a run."""

    code: int                 # of unilat; negative: ended by this signal
    message: str              # of a run that did not end well
    seconds: float

    @property
    def counts(self) -> bool:
        return counts(self.code)


def counts(code: int) -> bool:
    """False where it was not the run that failed, but what was around it: a signal, a full disk."""
    return code >= 0 and code not in (REFUSED, ENDED)


class RunFolder:
    """Runs are known by a key of program, deck and values: the same one is never run twice, and a changed one always."""

    def __init__(self, folder: str, program: str):
        self.folder, self.runs = folder, os.path.join(folder, "runs")
        self.program = os.path.abspath(program)
        self.command = [self.program]
        self.processes = Processes()
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
        """None: there is none, it is broken, or the result file that belongs to it is gone."""
        try:
            with open(os.path.join(self.runs, f"{key}.json"), encoding="utf-8") as file:
                record = Record(**json.load(file))
        except (OSError, ValueError, TypeError):
            return None
        if not isinstance(record.code, int) or not isinstance(record.message, str):
            return None
        return record if record.code not in (0, 2) or os.path.exists(self.results(key)) else None

    def is_whole(self, key: str) -> bool:
        """True where the result file of a finished run can be opened."""
        try:
            with h5py.File(self.results(key), "r", locking=False) as file:
                return "status" in file.attrs and "path" in file
        except OSError:
            return False

    def finished(self) -> set[str]:
        """Keys of all runs with a record: one look at the folder."""
        return {name[:-5] for name in os.listdir(self.runs) if name.endswith(".json")}

    def run(self, key: str, deck: RunDeck, timeout: float | None) -> Record:
        """Runs a deck. Files get their names when they are whole, the record last: a kill leaves a run undone, never half.

        Raises Stopped when the sweep ends first.
        """
        start = time.perf_counter()
        end = start + (timeout or float("inf"))

        def waits():        # for a run that a killed sweep left behind: it ends, and its file is gone on from
            self.processes.check()
            if time.perf_counter() > end:
                raise subprocess.TimeoutExpired(self.command, timeout)

        try:
            with inherited(os.path.join(self.runs, f"{key}.run.lock"), waits) as lock:
                return self._run_alone(key, deck, timeout, start, lock)
        except subprocess.TimeoutExpired:
            return self._finish(key, deck, TIMED_OUT, "", f"a run that an ended sweep left behind did not end in {timeout:g} s", start)

    def _run_alone(self, key: str, deck: RunDeck, timeout: float | None, start: float, lock: int) -> Record:
        part = os.path.join(self.runs, f"{key}.part")
        environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
        try:
            code = 1
            if os.path.exists(part):        # a run that was ended: it goes on, unless it has not come so far
                code, said, wrong = self.processes.run([*self.command, "-o", part, "--restart", part], "", timeout, environment, lock)
            if code == 1:
                code, said, wrong = self.processes.run([*self.command, "-o", part, *deck.options], deck.text, timeout, environment, lock)
        except subprocess.TimeoutExpired:
            code, said, wrong = TIMED_OUT, "", f"took longer than {timeout:g} s"
        if code in (0, 2) and os.path.exists(part):
            os.replace(part, self.results(key))
        elif os.path.exists(part) and counts(code):
            os.remove(part)
        return self._finish(key, deck, code, said, wrong, start)

    def _finish(self, key: str, deck: RunDeck, code: int, said: str, wrong: str, start: float) -> Record:
        """Writes the record of a run that has ended."""
        mark = f"{socket.gethostname()}-{os.getpid()}"
        record = Record(code, _message(code, wrong, said) if code else "", round(time.perf_counter() - start, 4))
        if code:
            self._write(self.listing(key), f"{deck.text}\n---- {' '.join(deck.settings)}\n---- exit code {code}\n{said}\n{wrong}\n", mark)
        self._write(os.path.join(self.runs, f"{key}.json"), json.dumps(record.__dict__), mark)
        return record

    def sweep_up(self):
        """Removes what runs left behind that were killed; only when nothing runs."""
        for name in os.listdir(self.runs):
            if name.endswith((".part", ".lock")):
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

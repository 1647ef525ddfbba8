"""A run of the program, with its progress."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
import threading
import time
import warnings
import weakref

from .. import program
from ..results import Results, read_results
from .card import written
from .errors import PathStopped, ProgramError

POINT = re.compile(r"^ {0,12}(\d+)(?: [A-Z][A-Z+-])? +(-?\d[\d.Ee+-]*)")     # of the listing: number, label, load factor
SHOW_EVERY = 0.3      # [s]


def settings(values: dict) -> list[str]:
    """Options that give the deck's parameters other values."""
    return [word for name, value in values.items()
            for word in ("--set", f"{name}=" + (f'"{value}"' if isinstance(value, str) and not value.startswith('"') else written(value)))]


def run(deck, folder, name: str, progress, partial: bool, timeout: float | None, values: dict) -> Results:
    """See Deck.run."""
    temporary = folder is None
    folder = tempfile.mkdtemp(prefix="unilat-") if temporary else os.fspath(folder)
    kept = False
    try:
        os.makedirs(folder, exist_ok=True)
        stem = os.path.join(folder, name)
        deck.write(f"{stem}.inp")
        shown = Progress(progress)
        command = [program.find_program(), "-o", f"{stem}.h5", *settings(values), f"{stem}.inp"]
        code, listing, report = follow(command, shown, timeout)
        shown.close()
        with open(f"{stem}.lst", "w", encoding="utf-8") as file:
            file.write(listing)
        deck._raise_error(code, report.replace(f"{folder}{os.sep}", "") if temporary else report)
        results = read_results(f"{stem}.h5")
        object.__setattr__(results, "listing", listing)
        if temporary:
            weakref.finalize(results, shutil.rmtree, folder, True)
            kept = True
        if code == 2:
            why = report.strip().removeprefix("unilat: ") or results.status
            if not partial:
                raise PathStopped(why, results)
            warnings.warn(why, stacklevel=3)
        return results
    finally:
        if temporary and not kept:
            shutil.rmtree(folder, True)


def follow(command: list[str], shown: Progress, timeout: float | None) -> tuple[int, str, str]:
    """Runs the program to its end; exit code, listing, messages. An interruption ends it, too."""
    try:
        process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, encoding="utf-8",
                                   errors="replace", env=program.environment())
    except OSError as problem:
        raise ProgramError(f"{command[0]}: cannot be started: {problem.strerror}; name the program unilat in the variable "
                           "UNILAT") from problem
    said: list[str] = []
    reader = threading.Thread(target=lambda: said.append(process.stderr.read()), daemon=True)
    reader.start()
    late = threading.Event()
    timer = threading.Timer(timeout, lambda: (late.set(), process.kill())) if timeout else None
    lines = []
    try:
        if timer:
            timer.start()
        for line in process.stdout:
            lines.append(line)
            match = POINT.match(line)
            if match:
                shown.point(int(match[1]), float(match[2]))
        process.wait()
    except BaseException:
        process.kill()
        process.wait()
        raise
    finally:
        if timer:
            timer.cancel()
        reader.join()
        process.stdout.close()
        process.stderr.close()
    if late.is_set():
        raise ProgramError(f"the run took longer than {timeout:g} s and was ended")
    return process.returncode, "".join(lines), "".join(said)


def failed(code: int, report: str) -> ProgramError:
    """What a run says that ended with neither a path nor an error in the deck."""
    how = f"was ended by signal {-code}" if code < 0 else f"ended with code {code}"
    return ProgramError(f"the program {how}: {report.strip() or 'no message'}")


class Progress:
    """How far a run is: a line that is overwritten, or calls of a function."""

    def __init__(self, wanted):
        self.function = wanted if callable(wanted) else None
        self.shown = wanted is True and (sys.stderr.isatty() or "ipykernel" in sys.modules)
        self.started, self.last, self.points, self.written = time.monotonic(), 0.0, 0, False

    def point(self, number: int, load_factor: float):
        self.points += 1
        if self.function:
            self.function(number, load_factor)
        now = time.monotonic()
        if self.shown and now - self.last > SHOW_EVERY and now - self.started > SHOW_EVERY:
            self.last, self.written = now, True
            print(f"\r{self.points} points, load factor {load_factor:.6g}, {now - self.started:.0f} s   ", end="", file=sys.stderr, flush=True)

    def close(self):
        if self.written:
            print("\r" + " " * 60 + "\r", end="", file=sys.stderr, flush=True)

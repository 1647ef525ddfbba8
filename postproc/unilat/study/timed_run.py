"""Runs of a study: what they take, the least of several, and what stays of them."""

from __future__ import annotations

import json
import os
import subprocess
import time
from dataclasses import dataclass

from ..results import read_results
from ..sweep.run_deck import RunDeck
from ..sweep.run_folder import RunFolder


@dataclass(frozen=True)
class Timed:
    """What a run took."""

    code: int           # of unilat; 124: out of time
    message: str        # of a run that did not end well
    wall: float         # [s] the whole process, least of the repeats
    solver: float       # [s] the program's own phases, least of the repeats; NaN without results
    megabytes: float    # largest resident memory


def timed(folder: RunFolder, deck: RunDeck, repeats: int, timeout: float) -> Timed:
    """The record of a deck, of its runs now if there is none. A kill leaves it undone, never half."""
    key = folder.key(deck)
    name = os.path.join(folder.runs, f"{key}.time.json")
    if os.path.exists(name):
        with open(name, encoding="utf-8") as file:
            return Timed(**json.load(file))
    runs = [_once(folder, key, deck, timeout)]
    # What fails once fails again.
    while len(runs) < repeats and runs[-1].code == 0:
        runs.append(_once(folder, key, deck, timeout))
    found = Timed(runs[-1].code, runs[-1].message, min(run.wall for run in runs), min(run.solver for run in runs),
                  max(run.megabytes for run in runs))
    with open(f"{name}.part", "w", encoding="utf-8") as file:
        json.dump(found.__dict__, file)
    os.replace(f"{name}.part", name)
    return found


def _once(folder: RunFolder, key: str, deck: RunDeck, timeout: float) -> Timed:
    stem = os.path.join(folder.runs, key)
    with open(f"{stem}.inp", "w", encoding="utf-8") as file:
        file.write(deck.text)
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    with open(f"{stem}.err", "w+", encoding="utf-8") as errors:
        start = time.perf_counter()
        process = subprocess.Popen([*folder.command, "-o", folder.results(key), *deck.options, f"{stem}.inp"], stdout=subprocess.DEVNULL, stderr=errors,
                                   env=environment)
        code, used = _wait(process, start + timeout)
        wall = time.perf_counter() - start
        errors.seek(0)
        said = errors.read().strip().splitlines()
    solver = float("nan")
    if code in (0, 2) and os.path.exists(folder.results(key)):
        solver = sum(read_results(folder.results(key)).performance.get("seconds", []))
    return Timed(code, said[-1].removeprefix("unilat: ") if code and said else "", wall, solver, used)


def _wait(process: subprocess.Popen, end: float) -> tuple[int, float]:
    """Exit code and megabytes of a process, which is killed at the end of its time.

    Its memory is asked for while it runs: what the system adds up for a process counts its parent's before the start.
    """
    memory = 0.0
    while True:
        memory = max(memory, _memory(process.pid))
        ended, status = os.waitpid(process.pid, os.WNOHANG)
        if ended:
            process.returncode = os.waitstatus_to_exitcode(status)
            return process.returncode, memory
        if time.perf_counter() > end:
            process.kill()
            process.wait()
            return 124, memory
        time.sleep(0.0005)


def _memory(number: int) -> float:
    """Largest resident memory of a process so far [MB]; 0 where the system does not tell."""
    try:
        with open(f"/proc/{number}/status", encoding="ascii") as file:
            return next(float(line.split()[1]) / 1024.0 for line in file if line.startswith("VmHWM"))
    except (OSError, StopIteration):
        return 0.0

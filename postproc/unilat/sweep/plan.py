"""What a sweep will take, from some of its runs: how many, how long, how large."""

from __future__ import annotations

import math
import os
import resource
from dataclasses import dataclass

from .pool import Progress, run_pool
from .run_deck import RunDeck
from .run_folder import RunFolder

SAMPLE = 5      # runs that are made where fewer are finished


@dataclass(frozen=True)
class Plan:
    runs: int                  # different ones
    finished: int
    seconds: list[float]       # of finished runs
    sizes: list[int]           # [bytes] of their result files
    memory: int                # [bytes] of the largest run made here; 0: none was

    def words(self, jobs: int) -> str:
        lines = [f"{self.runs} different runs, {self.finished} of them finished"]
        if self.seconds:
            left = self.runs - self.finished
            mean = sum(self.seconds) / len(self.seconds)
            lines.append(f"a run takes {mean:.3g} s ({min(self.seconds):.3g} to {max(self.seconds):.3g}), by {len(self.seconds)} of them")
            lines.append(f"the other {left} take about {duration(mean * left / jobs)}, {jobs} at a time")
        if self.sizes:
            mean = sum(self.sizes) / len(self.sizes)
            lines.append(f"result files: {size(mean)} each, all {size(mean * self.runs)}")
        if self.memory:
            lines.append(f"memory of a run: {size(self.memory)} at the most")
        return "\n".join(lines)


def make_plan(folder: RunFolder, decks: dict[str, RunDeck], missing: dict[str, RunDeck], jobs: int, timeout: float | None) -> Plan:
    """Makes some of the missing runs, evenly spread, where too few are finished to tell; they count as finished."""
    wanted = min(max(SAMPLE - (len(decks) - len(missing)), 0), len(missing))
    keys = list(missing)
    chosen = {keys[(2 * k + 1) * len(keys) // (2 * wanted)]: None for k in range(wanted)}
    run_pool(folder, {key: missing[key] for key in chosen}, jobs, timeout, Progress(len(chosen)))
    records = {key: folder.record(key) for key in decks}
    done = [key for key, record in records.items() if record is not None]
    sizes = [os.path.getsize(folder.results(key)) for key in done if os.path.exists(folder.results(key))]
    memory = 1024 * resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss if chosen else 0
    return Plan(len(decks), len(done), [records[key].seconds for key in done], sizes, memory)


def duration(seconds: float) -> str:
    if seconds < 60.0:
        return f"{seconds:.2g} s"
    minutes = math.ceil(seconds / 60.0)
    return f"{minutes} min" if minutes < 120 else f"{minutes / 60.0:.1f} h"


def size(n: float) -> str:
    for unit in ("bytes", "kB", "MB", "GB"):
        if n < 1000.0 or unit == "GB":
            return f"{n:.3g} {unit}"
        n /= 1000.0
    return ""

"""Running decks side by side on this machine, with a progress bar."""

from __future__ import annotations

import itertools
import sys
import time
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait

from .processes import signals_interrupt
from .run_deck import RunDeck
from .run_folder import RunFolder

WIDTH = 30      # characters of the bar
AWAKE = 0.2     # [s] that the main thread waits at most: a signal that another thread gets, or that comes as a wait begins, ends no wait


def run_pool(folder: RunFolder, decks: dict[str, RunDeck], n: int, timeout: float | None, progress: Progress):
    """Runs decks (by key), n at a time. Whatever interrupts it, finished runs stay, and the others end."""
    with signals_interrupt(), ThreadPoolExecutor(n) as pool:     # each thread only waits for its own process
        try:
            left = iter(decks.items())
            under_way = {pool.submit(folder.run, key, deck, timeout) for key, deck in itertools.islice(left, n)}
            while under_way:
                done, under_way = wait(under_way, AWAKE, FIRST_COMPLETED)
                for future in done:
                    progress.add(future.result().code)
                    item = next(left, None)
                    if item is not None:
                        under_way.add(pool.submit(folder.run, *item, timeout))
        except BaseException:
            folder.processes.stop()
            raise


class Progress:
    """A bar on a terminal, else a line after every tenth."""

    def __init__(self, total: int, stream=None):
        self.total, self.done, self.failed = total, 0, 0
        self.stream = stream or sys.stderr
        self.start, self.shown, self.tenth = time.monotonic(), 0.0, 0

    def add(self, code: int):
        self.set(self.done + 1, self.failed + (code != 0))

    def set(self, done: int, failed: int):
        self.done, self.failed = done, failed
        now = time.monotonic()
        if self.stream.isatty():
            if now - self.shown > 0.1 or done == self.total:
                self.shown = now
                full = WIDTH * done // max(self.total, 1)
                end = "\n" if done == self.total else ""
                self.stream.write(f"\r[{'#' * full}{'.' * (WIDTH - full)}] {self._told(now)}\033[K{end}")
                self.stream.flush()
        elif 10 * done // max(self.total, 1) > self.tenth:
            self.tenth = 10 * done // max(self.total, 1)
            print(self._told(now), file=self.stream, flush=True)

    def _told(self, now: float) -> str:
        spent = now - self.start
        left = f", {spent / self.done * (self.total - self.done):.0f} s left" if 0 < self.done < self.total else f", {spent:.1f} s"
        return f"{self.done} of {self.total} runs" + (f", {self.failed} not complete" if self.failed else "") + left

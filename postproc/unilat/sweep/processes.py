"""Programs that a sweep has started, and that end with it."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import threading
import time

PATIENCE = 5.0      # [s] that a program has to end by itself


class Stopped(Exception):
    """The sweep ends: what was under way does not count."""


class Processes:
    """Runs programs from several threads; `stop` ends them all. Each has a group of its own, so that what it started ends, too."""

    def __init__(self):
        self._guard = threading.Lock()
        self._running: set[subprocess.Popen] = set()
        self._stopped = False

    def check(self):
        """Raises Stopped once `stop` was called."""
        if self._stopped:
            raise Stopped

    def run(self, command: list[str], text: str, timeout: float | None, environment: dict, inherits: int) -> tuple[int, str, str]:
        """Exit code, standard output and standard error of a program that reads `text`; TimeoutExpired when it takes too long.

        The program and what it starts inherit the open descriptor `inherits`.
        """
        with self._guard:
            self.check()
            process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, encoding="utf-8",
                                       errors="replace", env=environment, start_new_session=True, pass_fds=(inherits,))
            self._running.add(process)
        try:
            said, wrong = process.communicate(text, timeout=timeout)
        except subprocess.TimeoutExpired:
            _end(process, signal.SIGKILL)
            process.communicate()
            raise
        finally:
            with self._guard:
                self._running.discard(process)
        self.check()
        return process.returncode, said, wrong

    def stop(self):
        """Ends all programs, the patient way first; no other begins."""
        with self._guard:
            self._stopped = True
            running = list(self._running)
        for process in running:
            _end(process, signal.SIGTERM)
        end = time.monotonic() + PATIENCE
        while any(process.poll() is None for process in running) and time.monotonic() < end:
            time.sleep(0.01)
        for process in running:
            _end(process, signal.SIGKILL)


def _end(process: subprocess.Popen, number: int):
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, number)


@contextlib.contextmanager
def signals_interrupt():
    """TERM and HUP end what is inside as Ctrl-C does, so that it can end its programs; then the exit code is that of the signal."""

    def interrupt(number, _frame):
        raise SystemExit(128 + number)

    watched = [number for number in (signal.SIGTERM, signal.SIGHUP) if signal.getsignal(number) == signal.SIG_DFL]
    for number in watched:
        signal.signal(number, interrupt)
    try:
        yield
    finally:
        for number in watched:
            signal.signal(number, signal.SIG_DFL)

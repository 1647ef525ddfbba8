"""One sweep at a time in a folder: locks that end with the process that has them, whatever ends it."""

from __future__ import annotations

import contextlib
import fcntl
import os
import socket

from ..results import ResultsError


@contextlib.contextmanager
def only_one(name: str, wait: bool):
    """Has the lock of a file for as long as what is inside takes. Another process that has it: waits for it, or raises ResultsError."""
    try:
        file = open(name, "a+", encoding="utf-8")      # noqa: SIM115
    except OSError as problem:
        raise ResultsError(f"{name}: {problem.strerror}") from problem
    with file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
        except BlockingIOError:
            file.seek(0)
            raise ResultsError(f"another unilat-sweep is at work in {os.path.dirname(name) or '.'} ({file.read().strip()}); "
                               "wait for it, or end it") from None
        except OSError:      # a file system that knows no locks
            pass
        file.truncate(0)
        file.write(f"process {os.getpid()} on {socket.gethostname()}\n")
        file.flush()
        yield

"""Locks that end with the processes that have them, whatever ends these: one sweep at a time in a folder, one run of a key."""

from __future__ import annotations

import contextlib
import fcntl
import os
import socket
import time
from collections.abc import Callable

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


AGAIN = 0.05      # [s] between two looks at a lock that another process has


@contextlib.contextmanager
def inherited(name: str, waits: Callable[[], None]):
    """Has the lock of a file that is there for so long; yields its descriptor, for programs that are started to inherit.

    A program that inherits the descriptor has the lock, too, and keeps it when this process is killed. Whoever comes then waits for
    the program to end; `waits` is called while it does, and raises what ends the waiting. A file system that knows no locks: no wait.
    """
    while True:
        descriptor = os.open(name, os.O_RDWR | os.O_CREAT, 0o644)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if os.fstat(descriptor).st_ino == _inode(name):      # else whoever had it has removed the file
                break
        except BlockingIOError:
            pass
        except OSError:
            break
        os.close(descriptor)
        waits()
        time.sleep(AGAIN)
    try:
        yield descriptor
    finally:
        with contextlib.suppress(FileNotFoundError):
            os.remove(name)
        os.close(descriptor)


def _inode(name: str) -> int | None:
    try:
        return os.stat(name).st_ino
    except FileNotFoundError:
        return None

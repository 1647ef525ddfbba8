"""What the commands share: their command line, result files, quantities."""

from __future__ import annotations

import argparse
import functools
import os
import re

import numpy as np

from .plain_text import printable
from .results import Column, LimitCurve, Path, Results, ResultsError, read_results

LABELS = ("LP", "BP", "TP", "C+", "C-", "UZ", "EP")


class Parser(argparse.ArgumentParser):
    """An argument parser whose errors are one line."""

    def __init__(self, command: str, description: str, examples: str):
        """`command`: as it is typed, such as "unilat-plot path"."""
        super().__init__(command, description=description, epilog=examples,
                         formatter_class=argparse.RawDescriptionHelpFormatter)
        self._negative_number_matcher = re.compile(r"^-\.?\d")     # lists such as -1,3 are no options

    def error(self, message):
        self.exit(2, f"{self.prog}: error: {message} (see --help)\n")


def add_files(parser: Parser):
    parser.add_argument("files", nargs="+", metavar="RESULTS", help="result file(s) of unilat (HDF5)")


def positive(text: str) -> float:
    value = float(text)
    if not 0.0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text} is not a positive number")
    return value


def nonzero(text: str) -> float:
    value = float(text)
    if value == 0.0 or not np.isfinite(value):
        raise argparse.ArgumentTypeError("a factor must be a number other than zero")
    return value


def mark_list(text: str) -> list[str]:
    words = [word.strip().upper() for word in text.split(",") if word.strip()]
    if words == ["ALL"]:
        return list(LABELS)
    if words == ["NONE"]:
        return []
    unknown = [word for word in words if word not in LABELS]
    if unknown:
        raise argparse.ArgumentTypeError(f"unknown label {unknown[0]} (known: {', '.join(LABELS)}, all, none)")
    return words


def load(args, points: bool = True) -> list[Results]:
    """Read every result file; each must hold a point, unless `points` are not asked for."""
    everything = [read_once(name) for name in args.files]
    for results in everything:
        if points and results.n_points == 0:
            raise ResultsError(f"{results.filename}: holds no points yet (status: {results.status})")
    return everything


def read_once(name: str) -> Results:
    """A result file; that of the last call is not read again while it is the same, for several pictures of one run."""
    try:
        stamp = os.stat(name)
    except OSError:
        return read_results(name)       # which says what is wrong
    return _read(os.path.abspath(name), name, stamp.st_ino, stamp.st_mtime_ns, stamp.st_size)


@functools.lru_cache(maxsize=1)
def _read(_place: str, name: str, *_stamp: int) -> Results:
    return read_results(name)


def tell_unfinished(everything: list[Results]):
    """Says which files are of runs that did not come to their end."""
    for results in everything:
        if not results.complete:
            print(f"note: {results.filename} has {results.n_points} points, status: {printable(results.status or 'unknown')}")


def numbers(results: Path | LimitCurve, name: str) -> Column:
    """A quantity that can be drawn."""
    column = results.column(name)
    if column.values.dtype.kind not in "biuf":
        raise ResultsError(f"{results.filename}: '{name}' is text, not numbers")
    return column

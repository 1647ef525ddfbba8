"""Opening an HDF5 file and taking single values out of it."""

from __future__ import annotations

import os

import h5py
import numpy as np


class ResultsError(Exception):
    """A file that cannot be read as asked; the message is one line and names the file."""


def open_file(filename: str) -> h5py.File:
    """Open a result file for reading, also one that is being written."""
    if not os.path.exists(filename):
        raise ResultsError(f"{filename}: no such file; a run writes it: unilat DECK.inp -o {filename}")
    if not os.path.isfile(filename):
        raise ResultsError(f"{filename}: not a file")
    try:
        if not h5py.is_hdf5(filename):
            raise ResultsError(f"{filename}: not an HDF5 file")
        return h5py.File(filename, "r", locking=False)    # no lock: a run may still be writing
    except OSError as problem:
        raise ResultsError(f"{filename}: cannot be opened: {reason(problem)}") from problem


def dataset(group: h5py.Group, name: str, filename: str) -> h5py.Dataset:
    """A dataset that must be there."""
    item = group.get(name)
    if not isinstance(item, h5py.Dataset):
        raise ResultsError(f"{filename}: {group.name.rstrip('/')}/{name} is missing")
    return item


def text(value) -> str:
    """Text however it was stored: fixed or variable length, blank or null padded, scalar or one-element array."""
    if isinstance(value, np.ndarray):
        value = value.ravel()[0] if value.size else ""
    if isinstance(value, bytes):
        value = value.decode("utf-8", "replace")
    return str(value).rstrip("\0 ")


def scalar(value) -> float:
    return float(np.ravel(value)[0])


def reason(problem: Exception) -> str:
    return getattr(problem, "strerror", None) or one_line(problem)


def one_line(problem: Exception) -> str:
    return " ".join(str(problem).split()) or type(problem).__name__

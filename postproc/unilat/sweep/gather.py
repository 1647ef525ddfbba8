"""All results of a sweep in one HDF5 file and one CSV, with where they come from."""

from __future__ import annotations

import csv
import datetime
import hashlib
import os

import h5py
import numpy as np

from ..plain_text import cell, printable
from ..results import ResultsError
from ..results.reader import read_short
from .run_folder import RunFolder
from .sweep_file import Sweep

OF_PATH = ("load_factor", "arc_length", "negative_pivots", "label")     # columns gathered of every path


def gather(sweep: Sweep, folder: RunFolder, deck: str, keys: list[str]) -> str:
    """Writes NAME.h5 and NAME.csv; a sentence that says so. `deck`: text of the deck. Runs that are not complete have what their path gives.

    The CSV holds no times, so the same runs give the same bytes, however often they were interrupted.
    """
    rows, paths, critical, version = [], [], [], ""
    wanted = {*OF_PATH, *(quantity.name.lower() for quantity in sweep.gather.values())}
    for number, key in enumerate(keys, start=1):
        record = folder.record(key)
        row = {"code": -999 if record is None else record.code, "message": "missing" if record is None else record.message,
               "seconds": float("nan") if record is None else record.seconds, "points": 0}
        row |= dict.fromkeys(sweep.gather, float("nan"))
        if record is not None and record.code in (0, 2):
            try:
                results = read_short(folder.results(key), wanted)
            except ResultsError as problem:
                row |= {"code": -999, "message": f"its result file is damaged, run the sweep again: {problem}"}
                rows.append(row)
                continue
            try:
                row["points"] = results.n_points
                row |= {name: quantity.of(results) for name, quantity in sweep.gather.items() if results.n_points}
            except ResultsError as problem:
                raise ResultsError(f"run {number}: {problem}") from problem
            version = f"{results.program} {results.version}"
            paths.append((number, {name: results.column(name) for name in (*OF_PATH, *results.monitors)
                                   if name in results.path or name in results.monitors}, list(results.monitors)))
            critical += [(number, point) for point in results.critical]
        rows.append(row)
    stem = os.path.join(folder.folder, sweep.name)
    _write_csv(f"{stem}.csv", sweep, folder, deck, version, rows)
    _write_hdf5(f"{stem}.h5", sweep, folder, deck, version, rows, paths, critical, keys)
    return f"gathered: {stem}.h5, {stem}.csv"


def _write_csv(filename: str, sweep: Sweep, folder: RunFolder, deck: str, version: str, rows: list[dict]):
    with open(f"{filename}.part", "w", newline="", encoding="utf-8") as file:
        file.write(f"# {printable(sweep.title or sweep.name)}\n# sweep {sweep.name}.toml (sha256 {_hash(sweep.text)}), deck {os.path.basename(sweep.deck_path)} "
                   f"(sha256 {_hash(deck)})\n# {version or 'unilat'} (sha256 of the program {folder.program_hash[:16]})\n")
        file.write("".join(f"# {name}: {quantity.word}\n" for name, quantity in sweep.gather.items()))
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["run", *sweep.values[0], *sweep.gather, "points", "code", "message"])
        for number, (values, row) in enumerate(zip(sweep.values, rows), start=1):
            table.writerow([cell(each) for each in (number, *values.values(), *(row[name] for name in (*sweep.gather, "points", "code", "message")))])
    os.replace(f"{filename}.part", filename)


def _write_hdf5(filename: str, sweep: Sweep, folder: RunFolder, deck: str, version: str, rows: list[dict],
                paths: list[tuple], critical: list, keys: list[str]):
    """`paths`: number of the run, columns of its path by name, names of its monitors. `critical`: number of the run, point."""
    with h5py.File(f"{filename}.part", "w") as file:
        for name, text in (("program", "unilat-sweep"), ("title", sweep.title), ("sweep", sweep.text), ("deck", deck),
                           ("deck_name", os.path.basename(sweep.deck_path)), ("unilat", version), ("program_sha256", folder.program_hash),
                           ("created", datetime.datetime.now(datetime.timezone.utc).isoformat(timespec="seconds"))):
            file.attrs[name] = text
        runs = file.create_group("runs", track_order=True)
        runs.attrs["description"] = "a row a run, from 1: parameters, gathered quantities, exit code (-999: missing), message"
        for name in sweep.values[0]:
            _put(runs, name, [values[name] for values in sweep.values]).attrs["parameter"] = 1
        for name, quantity in sweep.gather.items():
            _put(runs, name, [row[name] for row in rows]).attrs["quantity"] = quantity.word
        for name in ("points", "code", "message", "seconds"):
            _put(runs, name, [row[name] for row in rows])
        _put(runs, "key", keys)
        path = file.create_group("path", track_order=True)
        path.attrs["description"] = "the paths of all runs below each other; run: whose point it is"
        _put(path, "run", np.concatenate([np.full(len(columns["load_factor"].values), number) for number, columns, _ in paths]
                                         or [np.zeros(0, int)]))
        if paths:
            for name in [name for name in paths[0][1] if all(name in columns for _, columns, _ in paths)]:
                columns = [columns[name] for _, columns, _ in paths]
                item = _put(path, name, np.concatenate([column.values for column in columns]))
                item.attrs["units"], item.attrs["description"] = columns[0].units, columns[0].description
        points = file.create_group("critical", track_order=True)
        points.attrs["description"] = "the critical points of all runs below each other; point: number on the path of its run"
        _put(points, "run", np.array([number for number, _ in critical], dtype=int))
        for name in ("label", "point", "load_factor"):
            _put(points, name, [getattr(point, name) for _, point in critical])
        for name in paths[0][2] if paths else ():
            _put(points, name, np.array([point.monitors.get(name, np.nan) for _, point in critical], dtype=float))
    os.replace(f"{filename}.part", filename)


def _put(group: h5py.Group, name: str, values) -> h5py.Dataset:
    values = np.asarray(values)
    if values.dtype.kind in "US":
        return group.create_dataset(name, data=[str(value) for value in values], dtype=h5py.string_dtype())
    return group.create_dataset(name, data=values, compression="gzip" if values.size > 1000 else None)


def _hash(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:16]

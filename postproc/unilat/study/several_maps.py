"""Studies of all runs of several maps: the file that names them, and the runs."""

from __future__ import annotations

import os

from ..results import ResultsError
from ..sweep.pool import Progress, run_pool
from ..sweep.run_folder import RunFolder
from ..sweep.sweep_file import read_text, read_toml
from ..sweep.work import to_do
from .map_file import Map, read_map


def names_maps(filename: str, key: str) -> bool:
    """Whether the study is of the kind that names its maps under `key`."""
    return key in read_toml(read_text(filename), filename)


def read_maps(filename: str, key: str, program: str) -> list[Map]:
    """`program` reads their decks."""
    content = read_toml(read_text(filename), filename)
    if set(content) - {"title", key}:
        raise ResultsError(f"{filename}: such a study has title and {key} only, a list of maps")
    return [read_map(os.path.join(os.path.dirname(filename), name), program) for name in content[key]]


def make_runs(maps: list[Map], folder: RunFolder, jobs: int) -> list[list[str]]:
    """Makes what is not there yet; the keys of the runs, map by map."""
    keys = [[folder.key(deck) for deck in each.decks] for each in maps]
    missing = to_do(folder, {key: deck for each, own in zip(maps, keys) for key, deck in zip(own, each.decks)}, retry=False)
    run_pool(folder, missing, jobs, max(each.sweep.timeout or 60.0 for each in maps), Progress(len(missing)))
    folder.sweep_up()
    return keys

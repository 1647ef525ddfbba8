"""Sweeps and optimisation from Python: the runs are those of unilat-sweep, on this machine's cores or as a Slurm job array.

    table = deck.sweep(grid={"gap": [0.01, 0.02, 0.05]}, random={"runs": 50, "seed": 1, "a": {"mean": 0, "deviation": 0.01}},
                       gather={"limit": "LP", "sway": "max sway"})
    table["limit"]; table.to_pandas(); table.results(3).plot.shape(label="LP"); table.pictures()

    best = deck.maximise("LP", {"width": (0.1, 0.5)})
    best.values, best.value

Which groups there are (grid, list, latin, random, seeds), what their values look like and what can be gathered is said in the manual
under Sweeps. Deck, sweep file and results lie in a folder; a run that is there is not made again, so a sweep that was stopped goes
on and an optimisation that is called once more takes no time.
"""

from __future__ import annotations

import csv
import html
import os
import sys
from dataclasses import dataclass, field
from types import SimpleNamespace

import h5py
import numpy as np

from .. import program
from ..results import Results, ResultsError, read_results
from ..results.words import SHOWN, short
from ..sweep import gather as gathering
from ..sweep.run_deck import read_decks
from ..sweep.run_folder import RunFolder
from ..sweep.sampling import GROUPS
from ..sweep.sweep_file import read_sweep
from ..sweep.work import make_runs
from .errors import DeckError, places_of

QUANTITY = "value"      # what an optimisation gathers


class SweepTable:
    """What a sweep has gathered: a column a parameter or quantity, a row a run."""

    def __init__(self, stem: str, files: list[str]):
        self.file, self._files = f"{stem}.h5", files
        with h5py.File(self.file) as file:
            columns = {name: item[()] for name, item in file["runs"].items()}
        self.columns = {name: np.array([each.decode() for each in values]) if values.dtype.kind in "SO" else values
                        for name, values in columns.items() if name not in ("seconds", "key")}

    def __getitem__(self, name: str) -> np.ndarray:
        if name not in self.columns:
            raise KeyError(f"no column '{name}' (known: {', '.join(self.columns)})")
        return self.columns[name]

    def __len__(self) -> int:
        return len(self.columns["code"])

    def _ipython_key_completions_(self) -> list[str]:
        return list(self.columns)

    @property
    def complete(self) -> bool:
        """Whether every run came to its end."""
        return bool(np.all(self.columns["code"] == 0))

    def results(self, run: int) -> Results:
        """The results of a run, from 1."""
        if not 1 <= run <= len(self):
            raise ResultsError(f"no run {run} (they run from 1 to {len(self)})")
        if not os.path.exists(self._files[run - 1]):
            raise ResultsError(f"run {run} has no results: {self.columns['message'][run - 1]}")
        return read_results(self._files[run - 1])

    def to_pandas(self):
        """The table as a pandas.DataFrame."""
        from ..tables import _package
        frame = _package("pandas").DataFrame(self.columns)
        frame.index = np.arange(1, len(self) + 1)
        frame.index.name = "run"
        return frame

    def to_csv(self, filename: str | os.PathLike):
        """Writes the table as text."""
        with open(filename, "w", newline="", encoding="utf-8") as file:
            table = csv.writer(file, lineterminator="\n")
            table.writerow(["run", *self.columns])
            table.writerows([number, *row] for number, row in enumerate(zip(*self.columns.values()), start=1))

    def pictures(self) -> list:
        """The pictures that unilat-sweep draws of it."""
        from ..pictures import Picture
        from ..sweep import pictures
        stem = os.path.splitext(self.file)[0]
        sweep = read_sweep(f"{stem}.toml")
        found = []
        for name in pictures.draw(sweep, os.path.dirname(self.file)):
            with open(name, "rb") as file:
                found.append(Picture("sweep", [name], [], file.read()))
        return found

    def __repr__(self) -> str:
        bad = int(np.sum(self.columns["code"] != 0))
        return f"<sweep: {len(self)} runs{f', {bad} not complete' if bad else ''}; {', '.join(self.columns)}>"

    def _repr_html_(self) -> str:
        names = [name for name in self.columns if name != "message" or not self.complete]
        head = "".join(f"<th>{html.escape(name)}</th>" for name in ["run", *names])
        rows = "".join("<tr>" + "".join(f"<td>{html.escape(short(value) if isinstance(value, float) else str(value))}</td>"
                                        for value in (number + 1, *(self.columns[name][number] for name in names))) + "</tr>"
                       for number in range(min(len(self), SHOWN)))
        more = f"<p>and {len(self) - SHOWN} more runs</p>" if len(self) > SHOWN else ""
        return f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>{more}"


def sweep(deck, gather: dict[str, str] | str = "LP", folder: str | os.PathLike | None = None, name: str | None = None,
          jobs: int | None = None, slurm: bool = False, tasks: int | None = None, sbatch: str = "", retry: bool = False,
          timeout: float | None = None, progress: bool = True, title: str = "", **groups) -> SweepTable:
    """Runs a deck with all values of its parameters.

    `groups`: grid, list, latin, random, seeds, as a sweep file has them. `gather`: names and what they are, such as
    {"limit": "LP", "sway": "max sway"}, or one of these. `folder`: where everything goes (default NAME-sweep in the working
    directory). `jobs`: runs at a time (default: all cores; with `slurm` of a task). `retry`: runs that were not complete are made
    again.
    """
    unknown = set(groups) - set(GROUPS)
    if unknown:
        raise ResultsError(f"'{min(unknown)}' is no group of values (known: {', '.join(GROUPS)})")
    name = name or deck._job()
    folder = os.path.abspath(folder or f"{name}-sweep")
    os.makedirs(folder, exist_ok=True)
    deck.write(os.path.join(folder, f"{name}.inp"))
    gather = {QUANTITY: gather} if isinstance(gather, str) else gather
    content = {"title": title or f"sweep of {name}", "deck": f"{name}.inp", **({"timeout": timeout} if timeout else {}), **groups,
               "gather": gather}
    toml = os.path.join(folder, f"{name}.toml")
    with open(toml, "w", encoding="utf-8") as file:
        file.write(toml_text(content))
    described = read_sweep(toml)
    runs = RunFolder(folder, program.find_program())
    try:
        decks = read_decks(runs.program, described.deck_path, described.settings)
    except ResultsError as problem:
        places = places_of(str(problem))
        raise DeckError(str(problem), places) from None if places else problem
    keys = [runs.key(each) for each in decks]
    args = SimpleNamespace(retry=retry, slurm=slurm, tasks=tasks, sbatch=sbatch, file=toml, quiet=not progress,
                           jobs=jobs or (1 if slurm else len(os.sched_getaffinity(0))))
    make_runs(runs, described, dict(zip(keys, decks)), args)
    gathering.gather(described, runs, decks[0].text, keys)
    return SweepTable(os.path.join(folder, name), [runs.results(key) for key in keys])


def evaluate(deck, values: list[dict], gather: dict[str, str] | str = "LP", **options) -> SweepTable:
    """Runs a deck with given values: a dictionary a run, all with the same parameters. Options are those of sweep."""
    values = list(values)
    if not values or any(set(each) != set(values[0]) for each in values):
        raise ResultsError("evaluate needs a list of dictionaries that all have the same parameters")
    return sweep(deck, gather, list={name: [each[name] for each in values] for name in values[0]}, **options)


@dataclass(frozen=True)
class Optimum:
    """Where a quantity is best."""

    values: dict[str, float]      # of the parameters
    value: float                  # of the quantity
    results: Results = field(repr=False)
    runs: int = 0                 # made or found
    step: float = 0.0             # last distance of the points around, over the intervals
    history: list[tuple[dict[str, float], float]] = field(default_factory=list, repr=False)    # all of them


def optimise(deck, quantity: str, between: dict[str, tuple[float, float]], least: bool = True, start: dict[str, float] | None = None,
             tolerance: float = 1e-3, most: int = 400, progress: bool = True, **options) -> Optimum:
    """The values between bounds where a quantity is best: a search by patterns (Torczon, SIAM J. Optim. 7, 1997), which needs no
    derivatives and asks for all points around the present best one at a time.

    It begins with `start` (default: the middle) and points between, goes to the best one while there is a better one, and halves
    the distance of the points around where there is none, until that is below `tolerance` of the intervals. Runs without the
    quantity are worse than all others. `most`: runs. It finds the nearest best point of several. Options are those of sweep.
    """
    names = list(between)
    low, high = (np.array([float(between[name][k]) for name in names]) for k in (0, 1))
    if not names or np.any(high <= low):
        raise ResultsError("optimisation needs for every parameter two bounds, the lower one first")
    sign = 1.0 if least else -1.0
    seen: dict[tuple, tuple[float, str]] = {}
    history: list[tuple[dict[str, float], float]] = []
    messages: list[str] = []

    def values_at(place: np.ndarray) -> dict[str, float]:
        return {name: float(value) for name, value in zip(names, low + place * (high - low))}

    def ask(places: list[np.ndarray]):
        new = {tuple(np.round(place, 12)): place for place in places if tuple(np.round(place, 12)) not in seen}
        if not new:
            return
        table = evaluate(deck, [values_at(place) for place in new.values()], quantity, progress=False, **options)
        for number, (key, place) in enumerate(new.items()):
            value = float(table[QUANTITY][number])
            seen[key] = (sign * value if np.isfinite(value) else np.inf, table._files[number])
            history.append((values_at(place), value))
            messages.append(str(table["message"][number]))

    shown = progress and (sys.stderr.isatty() or "ipykernel" in sys.modules)
    best = np.full(len(names), 0.5) if start is None else np.clip((np.array([float(start[name]) for name in names]) - low) / (high - low), 0.0, 1.0)
    step = 0.25
    directions = np.concatenate((np.eye(len(names)), -np.eye(len(names))))
    ask([best, *(np.clip(best + 2.0 * step * direction, 0.0, 1.0) for direction in directions)])
    best = np.array(min(seen, key=lambda key: seen[key][0]))
    while step > tolerance and len(seen) < most:
        ask([np.clip(best + step * direction, 0.0, 1.0) for direction in directions])
        found = np.array(min(seen, key=lambda key: seen[key][0]))
        if seen[tuple(found)][0] < seen[tuple(best)][0]:
            best = found
        else:
            step *= 0.5
        if shown:
            print(f"\r{len(seen)} runs, best {short(sign * seen[tuple(best)][0])}, points around at {step:.2g} of the intervals   ",
                  end="", file=sys.stderr, flush=True)
    if shown:
        print(file=sys.stderr)
    value, results = seen[tuple(best)]
    if not np.isfinite(value):
        why = next((f"; the first that failed says: {message}" for message in messages if message), "")
        raise ResultsError(f"no run has '{quantity}' with values between these bounds{why}")
    return Optimum(values_at(best), sign * value, read_results(results), len(seen), step, history)


def toml_text(content: dict) -> str:
    """A sweep file. Tables stand behind plain values."""
    plain = {key: value for key, value in content.items() if not isinstance(value, dict)}
    tables = {key: value for key, value in content.items() if isinstance(value, dict)}
    lines = [f"{key} = {_toml(value)}" for key, value in plain.items()]
    for key, table in tables.items():
        lines += ["", f"[{key}]", *(f"{_toml_key(name)} = {_toml(value)}" for name, value in table.items())]
    return "\n".join(lines) + "\n"


def _toml_key(name: str) -> str:
    return name if name.replace("_", "").replace("-", "").isalnum() and name.isascii() else _toml(str(name))


def _toml(value) -> str:
    if isinstance(value, (bool, np.bool_)):
        return str(bool(value)).lower()
    if isinstance(value, (int, np.integer)):
        return str(int(value))
    if isinstance(value, (float, np.floating)):
        return repr(float(value))
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n") + '"'
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_toml_key(name)} = {_toml(each)}" for name, each in value.items()) + "}"
    return "[" + ", ".join(_toml(each) for each in value) + "]"

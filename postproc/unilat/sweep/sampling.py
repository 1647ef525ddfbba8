"""The values of the parameters of every run: grids, lists, Latin hypercubes, random samples, seeds, and their products."""

from __future__ import annotations

import itertools
import math
import random
import statistics

from ..plain_text import control_place, control_words, printable
from ..results import ResultsError

MOST_RUNS = 1_000_000
GROUPS = ("grid", "list", "latin", "random", "seeds")


def samples(groups: dict[str, dict], name: str) -> list[dict]:
    """A dictionary of values for each run: every combination of the groups, the last one running fastest.

    `groups` as the sweep file has them; `name` of the file is for messages. The same file gives the same values on any machine.
    """
    seen: dict[str, str] = {}
    columns = []
    for group in GROUPS:
        if group not in groups:
            continue
        try:
            rows = _MAKERS[group](dict(groups[group]))
            _check_values(rows)
        except (ValueError, TypeError, KeyError) as problem:
            text = f"'{problem.args[0]}' is missing" if isinstance(problem, KeyError) else str(problem)
            raise ResultsError(f"{name}: [{group}]: {text}") from None
        for parameter in rows[0]:
            if parameter in seen:
                raise ResultsError(f"{name}: parameter '{parameter}' is in [{seen[parameter]}] and in [{group}]")
            seen[parameter] = group
        columns.append(rows)
    if not columns:
        raise ResultsError(f"{name}: no parameters (one of {', '.join(f'[{group}]' for group in GROUPS)} is needed)")
    if math.prod(len(rows) for rows in columns) > MOST_RUNS:
        raise ResultsError(f"{name}: {math.prod(len(rows) for rows in columns)} runs, but {MOST_RUNS} are the most")
    return [{key: value for part in parts for key, value in part.items()} for parts in itertools.product(*columns)]


def _limit(runs: int):
    """Asked before so many are made."""
    if runs > MOST_RUNS:
        raise ValueError(f"{runs} runs, but {MOST_RUNS} are the most")


def _check_values(rows: list[dict]):
    """Values are numbers, or text that a line of a deck may have."""
    for row in rows:
        for name, value in row.items():
            for what, text in (("the name", name), (f"{printable(name)}: a value", value)):
                place = control_place(text) if isinstance(text, str) else 0
                if place:
                    raise ValueError(f"{what} has {control_words(text[place - 1])} as its character {place}; names and values are "
                                     f"printable text")
            if isinstance(value, bool) or not isinstance(value, (int, float, str)):
                raise ValueError(f"{name}: {value} is neither a number nor text")
            if isinstance(value, float) and not math.isfinite(value):
                raise ValueError(f"{name}: {value} is no number")


def _grid(group: dict) -> list[dict]:
    axes = {name: _axis(name, values) for name, values in group.items()}
    _limit(math.prod(len(values) for values in axes.values()))
    return [dict(zip(axes, values)) for values in itertools.product(*axes.values())]


def _axis(name: str, values) -> list:
    if isinstance(values, list):
        if not values:
            raise ValueError(f"{name} has no values")
        return values
    if not isinstance(values, dict):
        return [values]
    low, high, count, log = _range(name, values, "count")
    if not isinstance(count, int) or count < 2:
        raise ValueError(f"{name}: count must be a whole number of 2 or more")
    _limit(count)
    shares = [k / (count - 1) for k in range(count)]
    return [low, *(_between(low, high, share, log) for share in shares[1:-1]), high]


def _list(group: dict) -> list[dict]:
    if not all(isinstance(values, list) for values in group.values()):
        raise ValueError("each parameter needs a list of values")
    lengths = {name: len(values) for name, values in group.items()}
    if not lengths or len(set(lengths.values())) != 1 or 0 in lengths.values():
        raise ValueError(f"lists must have the same length ({', '.join(f'{name} {n}' for name, n in lengths.items())})")
    return [dict(zip(group, values)) for values in zip(*group.values())]


def _latin(group: dict) -> list[dict]:
    """Each parameter falls once into each of `runs` equally probable classes."""
    runs, generator = _runs(group)
    columns = {}
    for name, distribution in group.items():
        keys = [generator.random() for _ in range(runs)]
        order = sorted(range(runs), key=keys.__getitem__)
        columns[name] = [_quantile(name, distribution, (place + generator.random()) / runs) for place in order]
    return [dict(zip(columns, values)) for values in zip(*columns.values())]


def _random(group: dict) -> list[dict]:
    runs, generator = _runs(group)
    return [{name: _quantile(name, distribution, generator.random()) for name, distribution in group.items()}
            for _ in range(runs)]


def _seeds(group: dict) -> list[dict]:
    if len(group) != 1:
        raise ValueError("one parameter, such as seed = 200")
    ((name, wanted),) = group.items()
    first, last = (wanted["from"], wanted["to"]) if isinstance(wanted, dict) else (1, wanted)
    if not (isinstance(first, int) and isinstance(last, int) and 1 <= first <= last):
        raise ValueError(f"{name} must be a number of seeds, or have whole numbers from and to")
    _limit(last - first + 1)
    return [{name: seed} for seed in range(first, last + 1)]


_MAKERS = {"grid": _grid, "list": _list, "latin": _latin, "random": _random, "seeds": _seeds}


def _runs(group: dict) -> tuple[int, random.Random]:
    """Takes `runs` and `seed` out of a group."""
    runs, seed = group.pop("runs"), group.pop("seed", 1)
    if not isinstance(runs, int) or runs < 1:
        raise ValueError("runs must be a whole number of 1 or more")
    if not group:
        raise ValueError("no parameters")
    _limit(runs)
    return runs, random.Random(seed)


def _range(name: str, values: dict, extra: str):
    unknown = set(values) - {"from", "to", "scale", extra}
    if unknown:
        raise ValueError(f"{name}: '{min(unknown)}' is not known")
    low, high, log = float(values["from"]), float(values["to"]), values.get("scale", "linear")
    if log not in ("linear", "log") or (log == "log" and not (low > 0.0 and high > 0.0)):
        raise ValueError(f"{name}: scale is linear, or log between positive numbers")
    return low, high, values.get(extra), log == "log"


def _between(low: float, high: float, share: float, log: bool) -> float:
    return math.exp(math.log(low) + share * (math.log(high) - math.log(low))) if log else low + share * (high - low)


def _quantile(name: str, distribution, share: float) -> float:
    """The value below which this share of a distribution lies."""
    if not isinstance(distribution, dict):
        raise ValueError(f"{name} must be {{from, to}} or {{mean, deviation}}")
    if "mean" in distribution:
        if set(distribution) != {"mean", "deviation"} or not distribution["deviation"] > 0.0:
            raise ValueError(f"{name}: a normal distribution has mean and deviation > 0")
        share = min(max(share, 2.0 ** -53), 1.0 - 2.0 ** -53)
        return statistics.NormalDist(distribution["mean"], distribution["deviation"]).inv_cdf(share)
    low, high, _, log = _range(name, distribution, "scale")
    return _between(low, high, share, log)

"""What a run is worth against exact values: right, told, stopped, untold or wrong."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..results import Results, ResultsError
from ..sweep.quantities import Quantity, read_quantity

# From the best to the worst; that of a run is the worst of its checks.
CLASSES = ("right", "told", "stopped", "untold", "wrong")
#   right    complete, and the error is not larger than asked
#   told     the error is larger than asked and within the printed bar, or the bar is open, or the run ended with 2
#   stopped  the value was not reached, and the exit code says so
#   untold   exit code 0, the error is larger than asked, and the run says that it has no estimate
#   wrong    exit code 0, and an error that the bar does not cover, or no such value: wrong in silence


@dataclass(frozen=True)
class Check:
    """A quantity that must have an exact value."""

    name: str
    quantity: Quantity
    exact: str          # number, column of the table of exact values, or parameter of the run or of its deck
    tolerance: str      # the same: relative error that is right


@dataclass(frozen=True)
class Finding:
    """A check of one run. Errors are relative to the exact value; NaN: none."""

    exact: float
    value: float
    error: float
    bar: float
    verdict: str
    estimate: float = math.nan      # of exact less value


def read_checks(content: list[dict], filename: str) -> list[Check]:
    """From [[check]] of a file."""
    checks = []
    for item in content:
        unknown = set(item) - {"name", "quantity", "exact", "tolerance"}
        if unknown or "quantity" not in item or "exact" not in item:
            raise ResultsError(f"{filename}: [[check]] has quantity, exact, tolerance and name"
                               + (f", not '{min(unknown)}'" if unknown else ""))
        name = item.get("name", item["quantity"])
        checks.append(Check(name, read_quantity(item["quantity"], filename), str(item["exact"]), str(item.get("tolerance", 1e-6))))
    if not checks:
        raise ResultsError(f"{filename}: [[check]] is missing: what is compared with what")
    return checks


def finding(check: Check, values: dict, code: int, results: Results | None, where: str) -> Finding:
    """`values`: parameters of the run and exact values; `code`: its exit code; `results`: None where there is no file."""
    exact, tolerance = (_number(text, values, results, where) for text in (check.exact, check.tolerance))
    there = results is not None and results.n_points > 0
    value = check.quantity.of(results) if there else math.nan
    bar = check.quantity.bar(results) if there else math.nan
    scale = abs(exact) if exact else 1.0
    error = abs(value - exact) / scale
    bar = abs(bar) / scale
    estimate = ((check.quantity.corrected(results) if there else math.nan) - value) / scale
    return Finding(exact, value, error, bar, verdict(code, value, error, bar, tolerance, math.isnan(exact)), estimate)


def asked_of(check: Check, values: dict, results: Results | None, where: str) -> float:
    """The tolerance of a check."""
    return _number(check.tolerance, values, results, where)


def verdict(code: int, value: float, error: float, bar: float, tolerance: float, none: bool) -> str:
    """The class of one quantity. `none`: there is no such quantity, a value is one too many."""
    if math.isnan(value):
        return "stopped" if code else "right" if none else "wrong"
    if not none and error <= tolerance:
        return "right" if code == 0 else "told"
    covered = math.isinf(bar) or (not none and error <= bar)
    if covered or code:
        return "told"
    return "untold" if math.isnan(bar) else "wrong"


def worst(verdicts: list[str]) -> str:
    return max(verdicts, key=CLASSES.index)


def _number(text: str, values: dict, results: Results | None, where: str) -> float:
    try:
        return float(text)
    except ValueError:
        pass
    if results is None:
        return float(values.get(text, math.nan))
    known = {**results.parameters, **values}
    if text not in known:
        raise ResultsError(f"{where}: no parameter or column '{text}' (known: {', '.join(known)}); a formula goes to *PARAMETER of the deck")
    return float(known[text])

"""Runs decks for the tests and compares what they give; every comparison raises AssertionError.

    run = run_deck(changed(on_given_mesh("ring"), ("ALONG", "NODES")))
    run.results                       # postproc's Results
    assert_close(run.load("LP"), 81.557427564661, relative=1e-4)

UNILAT names the program, UNILAT_SOURCE the project's folder. With UNILAT_COLLECT, a folder, every deck that is run is also stored there:
tests/digest runs them with two programs and compares what they give.
"""

from __future__ import annotations

import csv
import functools
import hashlib
import os
import pathlib
import re
import subprocess
import tempfile
from dataclasses import dataclass

import numpy as np
import pytest
from unilat.results import Results, read_results

REFERENCE = pathlib.Path(__file__).parent / "reference"
# Many runs, or large ones, of what smaller tests run too: the build with run-time checks would find nothing else in them.
release_only = pytest.mark.release_only
# Many decks for the numbers and events of what other tests run with these checks: where each case runs once, the other build does.
once_in_release = pytest.mark.once_in_release


@dataclass
class Run:
    """A finished run; its folder lives as long as this object."""

    code: int
    stdout: str
    stderr: str
    folder: tempfile.TemporaryDirectory

    @property
    def files(self) -> list[str]:
        return sorted(os.listdir(self.folder.name))

    @functools.cached_property
    def results(self) -> Results:
        """The only result file of the folder."""
        names = [name for name in self.files if name.endswith(".h5")]
        assert len(names) == 1, f"one result file expected, found {names}; {self.stderr}"
        return read_results(os.path.join(self.folder.name, names[0]))

    def column(self, name: str) -> np.ndarray:
        return self.results.column(name).values

    def labelled(self, label: str) -> list:
        """The critical points with this label, along the path."""
        return [critical for critical in self.results.critical if critical.label == label]

    def ways(self) -> list:
        """The contact changes behind which the path has several ways on: each is a BP besides."""
        found = [critical for critical in self.labelled("BP") if "ways on" in critical.note]
        assert {critical.point for critical in found} <= {critical.point for critical in self.labelled("C+") + self.labelled("C-")}
        return found

    def only(self, label: str):
        """The one critical point with this label."""
        found = self.labelled(label)
        assert len(found) == 1, f"one {label} expected, found {[(c.load_factor, c.note) for c in found]}"
        return found[0]

    def load(self, label: str) -> float:
        """Load factor of the one critical point with this label."""
        return self.only(label).load_factor


def example(name: str) -> str:
    """Text of a deck of input/, in one piece."""
    folder = pathlib.Path(os.environ["UNILAT_SOURCE"]) / "input"
    return re.sub(r"^\*INCLUDE, FILE=(.*)\n", lambda card: (folder / card[1]).read_text(encoding="utf-8"),
                  (folder / f"{name}.inp").read_text(encoding="utf-8"), flags=re.MULTILINE)


# Example decks leave numbers of elements to the program. Tests of elements, orders and pictures start from given meshes: the
# element, and the rest of the data lines of *LINE and *ARC in their order.
MESHES: dict[str, tuple[str, tuple[str, ...]]] = {
    "arch-clamped-hinged": ("GE8", ("16", "16")),
    "arch-deep-hinged": ("GE8", ("12", "12")),
    "arch-imperfect": ("GE8", ("8", "8")),
    "arch-shallow-hinged": ("GE8", ("8", "8")),
    "arch-soil": ("GE4", ("60",)),
    "beam-buffers": ("GE4", ("10",)),
    "beam-rollers": ("GE4", ("8", "8", "16")),
    "cantilever": ("GE4", ("16",)),
    "column": ("GE6", ("40", "40")),
    "column-walls": ("GE4", ("40", "40")),
    "cradle": ("GE4", ("40",)),
    "euler": ("GE6", ("20",)),
    "indenter": ("GE4", ("40",)),
    "lee-frame": ("GE8", ("10", "2", "8")),
    "liner": ("GE4", ("80", "60")),
    "pipe-heat": ("GE4", ("100",)),
    "pipe-humps": ("GE4", ("80",)),
    "pipe-lift": ("GE4", ("60",)),
    "rail-buckling": ("GE4", ("64",)),
    "ring": ("GE4", ("160, 6.",)),
    "ring-critical": ("GE4", ("448",)),
    "ring-full": ("GE4", ("160, 6.", "160, 0.16666666666666667")),
    "ring-shrink": ("GE8", ("40",)),
    "ring-stiffness": ("GE4", ("16", "160", "64")),
    "ring-winkler": ("GE4", ("32", "256", "64")),
    "rollup": ("GE4", ("16",)),
    "roorda-frame": ("GE8", ("8", "8")),
    "three-hinged-arch": ("GE8", ("4", "4")),
    "williams-toggle": ("GE6", ("8", "8")),
    "winkler-point": ("GE4", ("60",)),
    "winkler-weight": ("GE4", ("80",)),
}


def on_given_mesh(name: str) -> str:
    """Text of a deck of input/ with a given mesh, and no tolerance for it."""
    text = example(name)
    if name not in MESHES:
        return text
    element, numbers = MESHES[name]
    left = iter(numbers)
    lines, inside = [], False
    for line in text.splitlines(keepends=True):
        if line.startswith("*") and not line.startswith("**"):
            inside = re.match(r"\*(LINE|ARC)\b", line) is not None
        elif inside and not line.startswith("**"):
            line = f"{line.rstrip()}, {next(left)}\n"
        if not line.startswith("*ACCURACY"):
            lines.append(line.replace("TYPE=GE8", f"TYPE={element}") if inside else line)
    assert next(left, None) is None, f"{name} has other lines than its mesh"
    return "".join(lines)


def changed(text: str, *changes: tuple[str, str]) -> str:
    """The text with each old string, which must stand there exactly once, replaced by the new one. Without comments."""
    text = "".join(line for line in text.splitlines(keepends=True) if not line.startswith("**"))
    for old, new in changes:
        found = text.count(old)
        assert found == 1, f"'{old}' stands {found} times in the deck"
        text = text.replace(old, new)
    return text


def with_static(text: str, parameters: str, data: str) -> str:
    """The text with other parameters and data on its only *STATIC card."""
    lines = text.splitlines(keepends=True)
    found = [k for k, line in enumerate(lines) if line.upper().startswith("*STATIC")]
    assert len(found) == 1, f"{len(found)} *STATIC cards in the deck"
    assert not lines[found[0] + 1].startswith("*"), "no data line follows *STATIC"
    lines[found[0]:found[0] + 2] = [f"*STATIC, {parameters}\n{data}\n"]
    return "".join(lines)


def run_deck(text: str, *options: str, code: int | None = 0, name: str | None = "deck.inp") -> Run:
    """Runs a deck in a folder of its own and asks for the exit code; None: the caller looks.

    `name`: file the deck is written to; None: it goes to standard input.
    """
    if os.environ.get("UNILAT_COLLECT"):
        collect(text, options, pathlib.Path(os.environ["UNILAT_COLLECT"]))
    folder = tempfile.TemporaryDirectory(prefix="unilat-")
    command = [os.environ["UNILAT"], *options]
    if name is not None:
        (pathlib.Path(folder.name) / name).write_text(text, encoding="utf-8")
        command.append(name)
    done = subprocess.run(command, input=text if name is None else "", capture_output=True, encoding="utf-8",
                          cwd=folder.name, timeout=240, check=False)
    assert code in (None, done.returncode), (f"exit code {done.returncode} instead of {code}:\n"
                                     f"{done.stdout[-1500:]}{done.stderr}")
    return Run(done.returncode, done.stdout, done.stderr, folder)


def preload(library: pathlib.Path) -> str:
    """LD_PRELOAD with one library more: the tests with run-time checks have the reference BLAS there."""
    return " ".join(filter(None, (str(library), os.environ.get("LD_PRELOAD"))))


def collect(text: str, options: tuple[str, ...], folder: pathlib.Path) -> pathlib.Path:
    """Stores a deck as TEST-HASH.inp unless it is there; its options, if any, as TEST-HASH.options, one a line. Returns the deck's file.

    The hash is that of deck and options, so that what several tests run is stored once, with the name of the first.
    """
    number = hashlib.sha256("\0".join((text, *options)).encode()).hexdigest()[:10]
    folder.mkdir(parents=True, exist_ok=True)
    for stored in folder.glob(f"*-{number}.inp"):
        return stored
    test = re.match(r"(?:.*/)?(\w+)[.]py::(\w+)", os.environ.get("PYTEST_CURRENT_TEST", ""))
    deck = folder / f"{'-'.join(test.groups()) if test else 'deck'}-{number}.inp"
    if options:
        deck.with_suffix(".options").write_text("".join(f"{option}\n" for option in options), encoding="utf-8")
    deck.write_text(text, encoding="utf-8")
    return deck


def reference(name: str) -> dict[str, np.ndarray]:
    """Columns of a reference table; cells that are no numbers become NaN."""
    with open(REFERENCE / f"{name}.csv", newline="", encoding="utf-8") as file:
        names, *rows = csv.reader(line for line in file if not line.startswith("#"))
    assert rows and all(len(row) == len(names) for row in rows), f"{name}: not a table"
    return {column: np.array([_number(row[k]) for row in rows]) for k, column in enumerate(names)}


def interpolate(x: np.ndarray, y: np.ndarray, at, points: int = 6) -> np.ndarray:
    """The polynomial through the nearest `points` table points; the table covers all of `at`."""
    x, y, at = np.asarray(x, float), np.asarray(y, float), np.atleast_1d(np.asarray(at, float))
    assert np.all(np.diff(x) > 0), "the table must rise"
    assert np.all((at >= x[0]) & (at <= x[-1])), f"outside the table: {at[(at < x[0]) | (at > x[-1])]}"
    first = np.clip(np.searchsorted(x, at) - points // 2, 0, len(x) - points)
    value = np.zeros_like(at)
    for i in range(points):
        basis = np.ones_like(at)
        for j in range(points):
            if j != i:
                basis *= (at - x[first + j]) / (x[first + i] - x[first + j])
        value += basis * y[first + i]
    return value


def interpolation_error(x: np.ndarray, y: np.ndarray, points: int = 6) -> float:
    """How far a table of every second point misses the others: an upper bound, 2**points too large if smooth."""
    inner = slice(points + 1, len(x) - points - 1, 2)
    return float(np.max(np.abs(interpolate(x[::2], y[::2], x[inner], points) - y[inner])))


def assert_close(actual, expected, relative: float = 0.0, absolute: float = 0.0):
    """|actual - expected| <= absolute + relative |expected|, entry by entry; shapes agree, all is finite."""
    actual, expected = np.asarray(actual, float), np.asarray(expected, float)
    assert actual.shape == expected.shape, f"shape {actual.shape}, expected {expected.shape}"
    assert actual.size > 0, "nothing to compare"
    assert np.all(np.isfinite(actual)) and np.all(np.isfinite(expected)), "not all numbers are finite"
    excess = np.abs(actual - expected) - absolute - relative * np.abs(expected)
    worst = np.unravel_index(np.argmax(excess), excess.shape)
    assert excess[worst] <= 0.0, (f"entry {tuple(int(k) for k in worst)}: {actual[worst]:.15g}, expected "
                                  f"{expected[worst]:.15g} within {absolute + relative * abs(expected[worst]):.3g}, "
                                  f"off by {abs(actual[worst] - expected[worst]):.3g}")


def assert_order(errors, order: float, below: float = 0.5, above: float = 1.0):
    """Errors of meshes each twice as fine as the one before fall with this order, from mesh to mesh."""
    errors = np.abs(np.asarray(errors, float))
    assert errors.size >= 2 and np.all(np.isfinite(errors)), f"errors {errors}"
    rates = np.log2(errors[:-1] / errors[1:])
    assert np.all(rates >= order - below) and np.all(rates <= order + above), f"rates {rates} of errors {errors}"


def assert_mean_order(errors, order: float, below: float = 0.3, above: float = 0.7):
    """As assert_order, over the whole row of meshes: for errors that jump with the place of a contact end."""
    errors = np.abs(np.asarray(errors, float))
    assert errors.size >= 2 and np.all(np.isfinite(errors)), f"errors {errors}"
    rate = np.log2(errors[0] / errors[-1]) / (errors.size - 1)
    assert order - below <= rate <= order + above, f"rate {rate} of errors {errors}"


def assert_monotone(values, rising: bool):
    """Strictly monotone."""
    values = np.asarray(values, float)
    steps = np.diff(values) if rising else -np.diff(values)
    assert steps.size > 0 and np.all(np.isfinite(steps)), "nothing to compare"
    assert np.all(steps > 0.0), f"turns back after entry {int(np.argmin(steps))}: {values[np.argmin(steps):][:2]}"


def bends(x, y) -> np.ndarray:
    """Distance of each inner point of a curve y(x) from its neighbours' chord: what a jagged curve cannot hide."""
    x, y = np.asarray(x, float), np.asarray(y, float)
    share = (x[1:-1] - x[:-2]) / (x[2:] - x[:-2])
    return y[1:-1] - (1.0 - share) * y[:-2] - share * y[2:]


def regions(run: Run, name: str) -> np.ndarray:
    """`start`, `end`, `angle_start` or `angle_end` of the only contact region at every point; NaN without contact."""
    contact = run.results.contact
    assert np.all(contact.count <= 1), f"{int(np.max(contact.count))} regions at once"
    values = getattr(contact, name)
    first = values[:, 0] if values.shape[1] else np.full(len(contact.count), np.nan)
    return np.where(contact.count == 1, first, np.nan)


def _number(cell: str) -> float:
    try:
        return float(cell)
    except ValueError:
        return float("nan")

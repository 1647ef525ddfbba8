"""What `python3 -m unilat.opensees` does."""

from __future__ import annotations

import argparse
import atexit
import os
import sys

import h5py
import numpy as np

from ..results import ResultsError
from .scene import SceneReader


def main(argv: list[str] | None = None) -> int:
    """0: complete, 1: wrong input, 2: stopped early; as unilat."""
    parser = argparse.ArgumentParser("unilat.opensees", description="Follows the path of a deck with OpenSees.")
    parser.add_argument("deck", metavar="deck.inp")
    parser.add_argument("-o", metavar="FILE", dest="results", default="opensees.h5")
    parser.add_argument("--control", metavar="MONITOR", help="prescribe this displacement, which only grows, instead of the arc length")
    parser.add_argument("--increment", type=float, metavar="X",
                        help="of that displacement, or of the arc length (default: the largest of the deck)")
    parser.add_argument("--penalty", type=float, metavar="K", default=1e10,
                        help="stiffness of rigid obstacles per length, of EI/size^4 (default %(default)g)")
    parser.add_argument("--set", metavar="NAME=VALUE", dest="settings", action="append", default=[])
    args = parser.parse_args(argv)
    try:
        with open(args.deck, encoding="utf-8") as file:
            text = file.read()
        scene = SceneReader(text, dict(setting(word) for word in args.settings)).scene
        if args.control is not None and args.control not in scene.monitors:
            raise ResultsError(f"no monitor {args.control}")
        from .follow import follow
    except ImportError:
        return wrong("openseespy is not installed (pip install openseespy)")
    except (OSError, ResultsError) as problem:
        return wrong(f"{args.deck}: {problem}")
    atexit.register(os.dup2, os.open(os.devnull, os.O_WRONLY), 2)       # OpenSees says good-bye there
    path = follow(scene, args.control, args.increment, args.penalty)
    write(args.results, text, scene, path)
    if path.why:
        print(f"unilat.opensees: stopped: {path.why}", file=sys.stderr)
    return 2 if path.why else 0


def wrong(what: str) -> int:
    print(f"unilat.opensees: {what}", file=sys.stderr)
    return 1


def setting(word: str) -> tuple[str, float | int | str]:
    name, _, value = word.partition("=")
    for kind in (int, float):
        try:
            return name, kind(value)
        except ValueError:
            pass
    return name, value.strip('"')


def write(filename: str, text: str, scene, path):
    """A result file: the path, its limit points, its end."""
    columns = {"load_factor": np.array(path.load_factor), **{name: np.array(values) for name, values in path.monitors.items()}}
    found = [("LP", row, there) for row, there in limit_points(columns)]
    found += [("C+", row, there) for row, there in first_touch(columns, np.array(path.gap))]
    found.sort(key=lambda event: event[1])
    found.append(("EP", len(path.load_factor) - 1, {name: float(values[-1]) for name, values in columns.items()}))
    with h5py.File(filename, "w") as file:
        file.attrs.update(program="opensees", version=path.version, deck=text,
                          status=f"stopped: {path.why}" if path.why else "complete")
        file["mesh/coordinates"] = np.array(scene.nodes, dtype=float)
        file["mesh/elements"] = np.array([beam[:2] for beam in scene.beams], dtype=int)
        file["performance/seconds"] = np.array([path.seconds])
        for name, values in columns.items():
            file["path/load_factor" if name == "load_factor" else f"path/monitor/{name}"] = values
            file["critical/load_factor" if name == "load_factor" else f"critical/monitor/{name}"] = np.array([there[name] for _, _, there in found])
        file["critical/label"] = np.array([label for label, _, _ in found], dtype="S2")
        file["critical/point"] = np.array([row + 1 for _, row, _ in found])


def limit_points(columns: dict[str, np.ndarray]) -> list[tuple[int, dict[str, float]]]:
    """Where the load turns: the nearest point, and all quantities at the turn of the cubic through the four points around."""
    load, way, found = columns["load_factor"], travelled(columns), []
    step = np.diff(load)
    for row in np.flatnonzero(step[:-1] * step[1:] < 0.0) + 1:
        rows = np.arange(row - 1, row + 3) if row + 2 < len(load) else np.arange(row - 2, row + 2)
        if rows[0] < 0:
            continue
        turns = zeros(np.polyder(np.polyfit(way[rows] - way[row], load[rows], 3)), way[row - 1] - way[row], way[row + 1] - way[row])
        if turns:
            found.append((int(row), at(columns, way, rows, way[row] + min(turns, key=abs))))
    return found


def first_touch(columns: dict[str, np.ndarray], gap: np.ndarray) -> list[tuple[int, dict[str, float]]]:
    """Where the gap to a straight wall closes first: all quantities there, by the parabolas through the three points before."""
    closed = np.flatnonzero(gap <= 0.0)
    if not closed.size or closed[0] < 3:
        return []
    row, way = int(closed[0]), travelled(columns)
    rows = np.arange(row - 3, row)
    # Behind the touch the path goes on in another direction, and not as far.
    step = way[row] - way[row - 1]
    places = zeros(np.polyfit(way[rows] - way[row], gap[rows], 2), -step, step)
    return [(row, at(columns, way, rows, way[row] + min(places)))] if places else []


def travelled(columns: dict[str, np.ndarray]) -> np.ndarray:
    """What tells points of a path apart: the lengths that the monitors went."""
    moved = np.array([np.diff(values) for name, values in columns.items() if name != "load_factor"])
    return np.concatenate(([0.0], np.cumsum(np.sqrt(np.sum(moved**2, axis=0)))))


def zeros(polynomial: np.ndarray, least: float, most: float) -> list[float]:
    margin = 1e-9 * (most - least)
    return [float(root.real) for root in np.roots(polynomial) if root.imag == 0.0 and least - margin <= root.real <= most + margin]


def at(columns: dict[str, np.ndarray], way: np.ndarray, rows: np.ndarray, place: float) -> dict[str, float]:
    """All quantities at a place between the points of some rows."""
    return {name: float(np.polyval(np.polyfit(way[rows] - place, values[rows], len(rows) - 1), 0.0)) for name, values in columns.items()}

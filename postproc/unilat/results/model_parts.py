"""What holds and loads the structure, as a result file has it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import h5py
import numpy as np

from .file import scalar, text


def _none(*shape: int, kind: type = float):
    return field(default_factory=lambda: np.zeros((0, *shape), dtype=kind))


@dataclass(frozen=True)
class Supports:
    """Node rows count from 0."""

    node: np.ndarray = _none(kind=int)             # (n)
    fixed: np.ndarray = _none(3, kind=bool)        # (n, 3) u, v, rotation are held
    spring_node: np.ndarray = _none(kind=int)
    spring: np.ndarray = _none(3)                  # (n, 3) stiffness, 0: none
    joint_spring_node: np.ndarray = _none(2, kind=int)
    relative_node: np.ndarray = _none(2, kind=int) # (n, 2) the nodes of stops, springs by a law and members between two nodes


@dataclass(frozen=True)
class Loads:
    """What the load factor of one step multiplies. Rows of nodes and elements count from 0."""

    name: str = ""                                 # of the step
    stress_free_start: bool = False                # what earlier steps did does not count
    node: np.ndarray = _none(kind=int)
    force: np.ndarray = _none(3)                   # (n, 3) in x, in y, couple
    element: np.ndarray = _none(kind=int)
    line_force: np.ndarray = _none(2)              # (n, 2) per stress-free length
    pressed_element: np.ndarray = _none(kind=int)
    pressure: np.ndarray = _none()                 # (n) to the left of the element, follows it
    heated_element: np.ndarray = _none(kind=int)
    strain: np.ndarray = _none()
    curvature: np.ndarray = _none()
    displaced_node: np.ndarray = _none(kind=int)
    displacement: np.ndarray = _none(3)
    moved_obstacle: np.ndarray = _none(kind=int)   # from 1
    motion: np.ndarray = _none(2)
    pole: np.ndarray = _none(4)                    # (n, 4) node, the fixed point, force towards it


def read_supports(file: h5py.File) -> Supports:
    group = file.get("supports", {})
    values = {name: group[name][()] for name in Supports.__dataclass_fields__ if name in group}
    if "fixed" in values:
        values["fixed"] = values["fixed"] > 0
    return Supports(**values)


def read_loads(file: h5py.File) -> dict[int, Loads]:
    """By the number of the step."""
    return {int(step): Loads(text(group.attrs.get("name", "")), bool(scalar(group.attrs.get("stress_free_start", 0))),
                             **{name: group[name][()] for name in Loads.__dataclass_fields__ if name in group})
            for step, group in sorted(file.get("loads", {}).items(), key=lambda item: int(item[0]))}


def times(loads: Loads, factor: float) -> Loads:
    """The loads at a load factor."""
    poles = loads.pole * (1.0, 1.0, 1.0, factor)
    scaled = {name: factor * getattr(loads, name) for name in ("force", "line_force", "pressure", "strain", "curvature",
                                                               "displacement", "motion")}
    return replace(loads, **scaled, pole=poles)


def together(parts: list[Loads]) -> Loads:
    """The sum of loads; node by node and element by element."""
    if len(parts) == 1:
        return parts[0]
    sums = {}
    for rows, values in (("node", "force"), ("element", "line_force"), ("pressed_element", "pressure"), ("displaced_node", "displacement"),
                         ("moved_obstacle", "motion"), ("heated_element", "strain"), ("heated_element", "curvature")):
        at = np.concatenate([getattr(part, rows) for part in parts])
        added = np.concatenate([getattr(part, values) for part in parts])
        sums[rows], where = np.unique(at, return_inverse=True)
        sums[values] = np.zeros((len(sums[rows]), *added.shape[1:]))
        np.add.at(sums[values], where, added)
        sums[rows] = sums[rows].astype(int)
    return Loads(parts[-1].name, **sums, pole=np.concatenate([part.pole for part in parts]))


def loads_at(path, point: int) -> Loads | None:
    """All loads at a point of a path: those of its step at its load factor, those of earlier steps as they were left; None: the
    file does not say."""
    if not path.loads or "step" not in path.path:
        return None
    step, load = int(path.path["step"].values[point - 1]), path.path["load_factor"].values
    if step not in path.loads:
        return None
    parts = [times(path.loads[step], float(load[point - 1]))]
    before = path if not hasattr(path, "of") else None       # a branch does not have the steps before its own
    for earlier in range(step - 1, 0, -1):
        if path.loads[earlier + 1].stress_free_start or before is None:
            break
        rows = np.flatnonzero(before.path["step"].values == earlier)
        if rows.size:
            parts.insert(0, times(path.loads[earlier], float(load[rows[-1]])))
    return together(parts)


def read_sets(file: h5py.File) -> dict[str, np.ndarray]:
    """Node rows of every set."""
    return {name: item[()] for name, item in file.get("sets", {}).items()}

"""What holds and loads the structure, as a result file has it."""

from __future__ import annotations

from dataclasses import dataclass, field

import h5py
import numpy as np

from .file import text


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


@dataclass(frozen=True)
class Loads:
    """What the load factor of one step multiplies. Rows of nodes and elements count from 0."""

    name: str = ""                                 # of the step
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
    return {int(step): Loads(text(group.attrs.get("name", "")),
                             **{name: group[name][()] for name in Loads.__dataclass_fields__ if name != "name" and name in group})
            for step, group in sorted(file.get("loads", {}).items(), key=lambda item: int(item[0]))}


def read_sets(file: h5py.File) -> dict[str, np.ndarray]:
    """Node rows of every set."""
    return {name: item[()] for name, item in file.get("sets", {}).items()}

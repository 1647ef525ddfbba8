"""Elements in their order along the rods: unbranched chains, with arc lengths."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .types import Mesh


@dataclass(frozen=True)
class RodChain:
    """Elements that follow each other, up to free ends and to nodes where more than two meet."""

    elements: np.ndarray      # (n) rows of the mesh's elements
    turned: np.ndarray        # (n) True: the element runs against the chain
    arc: np.ndarray           # (n, 2) stress-free arc length at both ends of each, along its chord, from 0


def rod_chains(mesh: Mesh) -> list[RodChain]:
    """The chains of a mesh, each beginning with an end of it, or where it is closed with its first element."""
    meeting: dict[int, list[int]] = {}
    for element, nodes in enumerate(mesh.elements):
        for node in nodes:
            meeting.setdefault(int(node), []).append(element)
    free = set(range(len(mesh.elements)))
    length = np.hypot(*(mesh.coordinates[mesh.elements[:, 1]] - mesh.coordinates[mesh.elements[:, 0]]).T)
    chains = []

    def walk(element: int, start: int):
        row, turned = [], []
        while True:
            free.remove(element)
            first, second = (int(node) for node in mesh.elements[element])
            row.append(element)
            turned.append(first != start)
            start = second if first == start else first
            onwards = [other for other in meeting[start] if other in free]
            if len(meeting[start]) != 2 or not onwards:
                break
            element = onwards[0]
        ends = np.cumsum(length[row])
        chains.append(RodChain(np.array(row), np.array(turned), np.column_stack((ends - length[row], ends))))

    for closed in (False, True):
        for element, (first, second) in enumerate(mesh.elements):
            if element not in free:
                continue
            if closed or len(meeting[int(first)]) != 2:
                walk(element, int(first))
            elif len(meeting[int(second)]) != 2:
                walk(element, int(second))
    return chains


def along_chain(chain: RodChain, forces: np.ndarray) -> np.ndarray:
    """Section forces (elements, m, 3) as the chain runs: (n, m, 3). Turned elements have the other end first and M negative."""
    values = forces[chain.elements].copy()
    values[chain.turned] = values[chain.turned][:, ::-1] * (1.0, 1.0, -1.0)
    return values

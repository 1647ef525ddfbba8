"""Forces of obstacles on the structure at one point of the path: single ones, and pressures along lines.

Contacts anywhere along the rods (spans) have them in the file. Of the others they follow from the reactions of the nodes,
which act normal to the obstacle: nodes that press beside each other make a pressure, others single forces.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .candidate_chain import Chain, ChainState
from .rod_shape import Shape
from .types import Obstacle, Path

NO_FORCE = 1e-6     # of the largest force at the point: rounding
RUN = 3             # as many neighbours that press are a line
NUMBERS = 6         # of a force in the file: contact, arc length, place, force


@dataclass(frozen=True)
class Force:
    """A force at one place of the rod."""

    contact: int              # which *CONTACT, from 1
    arc: float                # stress-free arc length along the contact
    place: np.ndarray         # (2) where it acts, deformed
    force: np.ndarray         # (2) on the structure

    @property
    def size(self) -> float:
        return float(np.hypot(*self.force))


@dataclass(frozen=True)
class Pressure:
    """Forces per stress-free length along a line of contact."""

    contact: int
    arc: np.ndarray           # (n)
    place: np.ndarray         # (n, 2)
    force: np.ndarray         # (n, 2)

    @property
    def size(self) -> np.ndarray:
        return np.hypot(*self.force.T)


def contact_forces(path: Path, point: int) -> tuple[list[Force], list[Pressure]]:
    """What the obstacles push with; nothing where the file has no reactions for the point."""
    if path.contact is None:
        return [], []
    forces, pressures = stored_forces(path, point)
    told = {contact for contact, kind in enumerate(path.contact.points, start=1) if kind == "spans"} if path.has_force_lists else set()
    shape = Shape(path.mesh, path.field("displacement", point)) if "displacement" in path.field_names \
        and point in path.points_with("displacement") else None
    for contact in range(1, len(path.contact.points) + 1):
        if contact not in told:
            more, lines = _of_nodes(path, point, contact, shape)
            forces += more
            pressures += lines
    largest = max([force.size for force in forces], default=0.0)
    return [force for force in forces if force.size > NO_FORCE * largest], pressures


def stored_forces(path: Path, point: int) -> tuple[list[Force], list[Pressure]]:
    """Those that the file has: of contacts anywhere along the rods."""
    forces = [Force(int(row[0]), float(row[1]), row[2:4], row[4:]) for row in path.force_list("contact_force", point)]
    samples = path.force_list("contact_pressure", point)
    samples = samples[np.lexsort((samples[:, 1], samples[:, 0]))] if len(samples) else samples
    reach = np.hypot(*np.ptp(path.mesh.coordinates, axis=0))
    pressures = []
    if len(samples):
        gaps = np.diff(samples[:, 1])
        # Samples of one element are an eighth of it apart, and the next element begins where it ends.
        usual = np.median(gaps[gaps > 0.0]) if np.any(gaps > 0.0) else reach
        cuts = np.flatnonzero((np.diff(samples[:, 0]) != 0.0) | (gaps > 4.0 * usual) & (gaps > 1e-3 * reach)) + 1
        pressures = [Pressure(int(part[0, 0]), part[:, 1], part[:, 2:4], part[:, 4:]) for part in np.split(samples, cuts)]
    return forces, pressures


def normal_at(obstacle: Obstacle, place: np.ndarray) -> np.ndarray:
    """Unit vector from the surface at the point next to a place into the free side."""
    if obstacle.kind == "gap":
        return obstacle.normal / np.hypot(*obstacle.normal)
    if obstacle.kind == "circle":
        away = place - obstacle.centre
        away = away / (np.hypot(*away) or 1.0)
        return away if obstacle.side == "outside" else -away
    points = obstacle.points if obstacle.kind == "line" else obstacle.surface
    chord = np.diff(points, axis=0)
    share = np.einsum("ij,ij->i", place - points[:-1], chord) / np.einsum("ij,ij->i", chord, chord)
    near = points[:-1] + np.clip(share, 0.0, 1.0)[:, None] * chord
    along = chord[np.argmin(np.hypot(*(near - place).T))]
    return np.array((-along[1], along[0])) / np.hypot(*along)


def _of_nodes(path: Path, point: int, contact: int, shape: Shape | None):
    """From the reactions of the nodes of a contact."""
    chain = Chain(path, contact)
    state = ChainState(chain, point, angle=False)
    reaction, density = (state.values(name) for name in ("reaction", "reaction_density"))
    places = state.values("contact_point")
    if places is None and shape is not None:
        places = shape.nodes[path.contact.candidates[chain.rows]]
    if reaction is None or places is None or not chain.known_obstacle:
        return [], []
    obstacle = chain.obstacle(point)
    forces, pressures = [], []

    def line(arc: np.ndarray, values: np.ndarray):
        at = np.column_stack([np.interp(arc, state.arc, places[:, k]) for k in (0, 1)])
        normal = np.array([normal_at(obstacle, place) for place in at])
        pressures.append(Pressure(contact, arc, at, values[:, None] * normal))

    if chain.points == "distributed" and density is not None:
        for arc, values in state.within_regions(density):
            if len(arc) > 1 and np.any(values != 0.0):
                line(arc, values)
        return forces, pressures
    pressing = np.flatnonzero(reaction != 0.0)
    for run in np.split(pressing, np.flatnonzero(np.diff(pressing) > 1) + 1):
        if len(run) >= RUN and density is not None and chain.points != "spans" and obstacle.kind != "gap":
            line(state.arc[run], density[run])
            continue
        own = run[:-1] if chain.around > 0.0 and len(run) and run[-1] == len(chain.rows) - 1 else run     # the seam's node once
        forces += [Force(contact, float(state.arc[k]), places[k], reaction[k] * normal_at(obstacle, places[k])) for k in own]
    return forces, pressures

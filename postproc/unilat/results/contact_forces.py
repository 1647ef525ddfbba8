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

NO_FORCE = 1e-6     # of the largest force along the path: rounding
NO_LINE = 1e-4      # the same, of all that a line presses with: its pressure is a derivative, less exact
SAME = 1e-6         # of a region's length: less apart is the same place
SAMPLES = 5         # of a pressure, that the file has of a smooth part of a line
FINER = 13          # and as many are drawn
RUN = 3             # as many neighbours that press are a line
_KNOTS, _FINE = np.linspace(0.0, 1.0, SAMPLES), np.linspace(0.0, 1.0, FINER)
_LAGRANGE = np.array([[np.prod([(x - other) / (knot - other) for other in _KNOTS if other != knot]) for knot in _KNOTS] for x in _FINE])


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

    @property
    def total(self) -> float:
        """Of its size, all along."""
        return float(np.sum(0.5 * (self.size[1:] + self.size[:-1]) * np.diff(self.arc)))


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
    # What remains of a contact that ends is no force beside those of the path.
    largest = float(np.max(np.abs(path.contact.reaction_total), initial=0.0))
    pressures = [pressure for pressure in pressures if pressure.total > NO_LINE * largest]
    return [force for force in forces if force.size > NO_FORCE * largest], pressures


def stored_forces(path: Path, point: int) -> tuple[list[Force], list[Pressure]]:
    """Those that the file has: of contacts anywhere along the rods."""
    forces = [Force(int(row[0]), float(row[1]), row[2:4], row[4:]) for row in path.force_list("contact_force", point)]
    samples = _between(path.force_list("contact_pressure", point))
    pressures = []
    for region in path.contact.regions(point):
        around = float(path.contact.chain_length[region.contact - 1])
        end = region.end + (around if region.end < region.start else 0.0)
        same = SAME * max(end - region.start, around)
        mine = samples[np.rint(samples[:, 0]) == region.contact]
        arc = mine[:, 1] + np.where(mine[:, 1] < region.start - same, around, 0.0)      # over the seam of a ring
        order = np.argsort(arc, kind="stable")
        order = order[(arc[order] >= region.start - same) & (arc[order] <= end + same)]
        if len(order) > 1:
            pressures.append(Pressure(region.contact, arc[order], mine[order, 2:4], mine[order, 4:]))
    return forces, pressures


def _between(samples: np.ndarray) -> np.ndarray:
    """The samples with more between: a polynomial through those of each smooth part."""
    parts = samples[:len(samples) // SAMPLES * SAMPLES].reshape(-1, SAMPLES, samples.shape[1])
    return np.einsum("ij,pjk->pik", _LAGRANGE, parts).reshape(-1, samples.shape[1])


def normal_at(obstacle: Obstacle, place: np.ndarray) -> np.ndarray:
    """Unit vector from the surface at the point next to a place into the free side."""
    if obstacle.kind == "gap" and obstacle.end is None:
        return obstacle.normal / np.hypot(*obstacle.normal)
    if obstacle.kind in ("circle", "gap"):
        away = place - (obstacle.centre if obstacle.end is None else obstacle.end)
        away = away / (np.hypot(*away) or 1.0)
        return away if obstacle.side == "outside" else -away
    points = obstacle.points if obstacle.kind in ("line", "soil") else obstacle.surface
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

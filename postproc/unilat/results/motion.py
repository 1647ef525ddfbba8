"""The structure between the stored points of a path, for films and pages that move smoothly.

Displacements of every node follow cubics over the path's arc length, with the rates of parabolas through neighbouring stored points;
where the path has a kink (contact events, bifurcations, new steps) each side has rates of its own. Ends of contact and forces go on
linearly where both points have the same ones.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .contact_forces import Force, Pressure, contact_forces
from .rod_shape import Shape, places_along
from .types import Path, Region

SAMPLES = 25        # of a pressure between two points


@dataclass(frozen=True)
class Frame:
    """The structure at one place of the path."""

    row: float                # of the path, from 0: whole numbers are points
    nearest: int              # stored point, from 1
    shape: Shape
    regions: list[Region]
    forces: list[Force]
    pressures: list[Pressure]


class Motion:
    """Frames between the stored points of a path."""

    def __init__(self, path: Path, with_forces: bool = True):
        self.path = path
        self.points = path.points_with("displacement")
        self.moved = np.array([path.field("displacement", int(point)) for point in self.points])
        arc = path.path["arc_length"].values if "arc_length" in path.path else np.arange(float(path.n_points))
        if not np.all(np.diff(arc[self.points - 1]) > 0.0):      # a file without arc lengths
            arc = np.arange(float(path.n_points))
        self.arc = arc
        self.at = arc[self.points - 1]
        self.rates = self._rates()
        self.forces = [contact_forces(path, int(point)) if with_forces else ([], []) for point in self.points]

    def frames(self, number: int) -> list[Frame]:
        """About as many frames, at equal distances along the path; every stored point is one of them."""
        if len(self.points) < 2:
            return [self.stored(0)]
        found = []
        for k, length in enumerate(np.diff(self.at)):
            parts = max(1, int(round(number * length / (self.at[-1] - self.at[0]))))
            found += [self.stored(k), *(self.between(k, j / parts) for j in range(1, parts))]
        return [*found, self.stored(len(self.points) - 1)]

    def stored(self, k: int) -> Frame:
        """The frame of a stored point."""
        point = int(self.points[k])
        regions = self.path.contact.regions(point) if self.path.contact is not None else []
        return Frame(point - 1.0, point, Shape(self.path.mesh, self.moved[k]), regions, *self.forces[k])

    def between(self, k: int, t: float) -> Frame:
        """The frame between stored points k and k + 1, t from 0 to 1."""
        step = self.at[k + 1] - self.at[k]
        before, after = self.rates[k][1], self.rates[k + 1][0]
        moved = ((1 + 2 * t) * (1 - t)**2 * self.moved[k] + t**2 * (3 - 2 * t) * self.moved[k + 1]
                 + step * (t * (1 - t)**2 * before - t**2 * (1 - t) * after))
        shape = Shape(self.path.mesh, moved)
        row = float(np.interp(self.at[k] + t * step, self.arc[self.points[k] - 1:self.points[k + 1]],
                              np.arange(self.points[k] - 1, self.points[k + 1])))
        forces, pressures = self._forces_between(k, t, shape)
        return Frame(row, int(self.points[k if t < 0.5 else k + 1]), shape, self._regions_between(row), forces, pressures)

    def _rates(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Rates before and after every stored point."""
        n = len(self.points)
        if n < 2:
            return [(np.zeros_like(self.moved[0]),) * 2] * n
        step = np.diff(self.at)[:, None, None]
        slope = np.diff(self.moved, axis=0) / step
        kink = self._kinks()
        rates = []
        for k in range(n):
            left, right = slope[max(k - 1, 0)], slope[min(k, n - 2)]
            if k in (0, n - 1):
                rates.append((left, right))
            elif kink[k]:
                rates.append((left, right))
            else:
                mean = (left * step[k] + right * step[k - 1]) / (step[k - 1] + step[k])
                rates.append((mean, mean))
        # At ends and kinks the parabola that has the other end's rate.
        for k in range(n):
            before, after = rates[k]
            if k < n - 1 and (k == 0 or kink[k]) and not kink[k + 1] and k + 1 < n - 1:
                after = 2.0 * slope[k] - rates[k + 1][0]
            if k > 0 and (k == n - 1 or kink[k]) and not kink[k - 1] and k - 1 > 0:
                before = 2.0 * slope[k - 1] - rates[k - 1][1]
            rates[k] = (before, after)
        return rates

    def _kinks(self) -> np.ndarray:
        """Which stored points are kinks of the path, or have one between them and the next: there nothing is smooth."""
        path = self.path
        labels = path.path["label"].values if "label" in path.path else np.full(path.n_points, "")
        steps = path.path["step"].values if "step" in path.path else np.ones(path.n_points, dtype=int)
        corner = np.isin(labels, ("C+", "C-", "BP")) | np.append(steps[1:] != steps[:-1], False)
        return corner[self.points - 1]

    def _regions_between(self, row: float) -> list[Region]:
        contact = self.path.contact
        if contact is None:
            return []
        low, share = int(np.floor(row)), row - np.floor(row)
        first = contact.regions(low + 1)
        if share == 0.0 or low + 2 > self.path.n_points:
            return first
        second = contact.regions(low + 2)
        if [region.contact for region in first] != [region.contact for region in second]:
            return first if share < 0.5 else second
        return [replace(a, start=(1 - share) * a.start + share * b.start, end=(1 - share) * a.end + share * b.end)
                for a, b in zip(first, second)]

    def _forces_between(self, k: int, t: float, shape: Shape) -> tuple[list[Force], list[Pressure]]:
        (forces, pressures), (later, later_pressures) = self.forces[k], self.forces[k + 1]
        contact = self.path.contact

        def place(number: int, arc: np.ndarray, fallback: np.ndarray) -> np.ndarray:
            found = places_along(contact, number, shape, arc)
            return np.where(np.isfinite(found), found, fallback)

        if [force.contact for force in forces] == [force.contact for force in later]:
            arcs = [(1 - t) * a.arc + t * b.arc for a, b in zip(forces, later)]
            found = [Force(a.contact, arc, place(a.contact, np.array([arc]), (1 - t) * a.place + t * b.place)[0],
                           (1 - t) * a.force + t * b.force) for a, b, arc in zip(forces, later, arcs)]
        else:
            found = [replace(force, place=place(force.contact, np.array([force.arc]), force.place)[0])
                     for force in (forces if t < 0.5 else later)]
        lines = []
        if [line.contact for line in pressures] == [line.contact for line in later_pressures]:
            share = np.linspace(0.0, 1.0, SAMPLES)
            for a, b in zip(pressures, later_pressures):
                parts = [(line.arc[0] + share * (line.arc[-1] - line.arc[0]), line) for line in (a, b)]
                force = sum(weight * np.column_stack([np.interp(arc, line.arc, line.force[:, i]) for i in (0, 1)])
                            for weight, (arc, line) in zip((1 - t, t), parts))
                arc = (1 - t) * parts[0][0] + t * parts[1][0]
                own = np.column_stack([np.interp(share, np.linspace(0.0, 1.0, len(a.arc)), a.place[:, i]) for i in (0, 1)])
                lines.append(Pressure(a.contact, arc, place(a.contact, arc, own), force))
        else:
            lines = [replace(line, place=place(line.contact, line.arc, line.place)) for line in (pressures if t < 0.5 else later_pressures)]
        return found, lines

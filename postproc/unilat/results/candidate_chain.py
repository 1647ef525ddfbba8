"""The candidates of one contact in their order along the rod: where they are, what they carry, where contact ends."""

from __future__ import annotations

import numpy as np

from .types import Obstacle, Path, ResultsError

SAME = 1e-9     # of the length: less apart is the same place


class Chain:
    """The candidates of one contact of a path."""

    def __init__(self, path: Path, number: int):
        """`number`: which *CONTACT, from 1."""
        contact = path.contact
        mine = np.flatnonzero(contact.candidate_contact == number)
        self.path, self.number = path, number
        self.rows = mine[np.argsort(contact.arc_length[mine], kind="stable")]
        self.home = contact.arc_length[self.rows]
        self.around = float(contact.chain_length[number - 1])      # length of a closed chain, 0: open
        self.points = contact.points[number - 1]
        self.obstacle_name = contact.obstacles[number - 1] if contact.obstacles else f"contact {number}"
        if self.around > 0.0:       # the first one again at the end
            self.rows = np.append(self.rows, self.rows[0])
            self.home = np.append(self.home, self.home[0] + self.around)

    @property
    def known_obstacle(self) -> bool:
        """Whether the file has the obstacle of the contact."""
        return self.obstacle_name.replace("/", "_") in self.path.obstacles

    def obstacle(self, point: int) -> Obstacle:
        """The obstacle of the contact, where it is at a point of the path."""
        for obstacle in self.path.obstacles_at(point):
            if obstacle.name == self.obstacle_name.replace("/", "_"):       # '/' divides groups in the file
                return obstacle
        raise ResultsError(f"{self.path.filename}: no obstacle '{self.obstacle_name}'")


class ChainState:
    """The same at one point of the path."""

    def __init__(self, chain: Chain, point: int, angle: bool):
        """`angle`: places are angles about the centre of the obstacle [degrees], else stress-free arc lengths."""
        self.chain, self.point = chain, point
        self.regions = self._regions()                              # (low, high) arc lengths, cut at the seam of a ring
        self.arc = self._slid()                                     # (candidates)
        self.x = self._angles() if angle else self.arc              # (candidates) their places

    def values(self, field: str) -> np.ndarray | None:
        """A field of the candidates; None when the point has no such field."""
        path = self.chain.path
        if field not in path.field_names or self.point not in path.points_with(field):
            return None
        return path.field(field, self.point)[self.chain.rows]

    def place(self, arc) -> np.ndarray:
        """Place of any arc length."""
        return np.interp(arc, self.arc, self.x)

    def within_regions(self, values: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        """Curves (arc length, value) along the regions of something that vanishes where they end between candidates."""
        curves = []
        for low, high in self.regions:
            inside = (self.arc >= low - self._same) & (self.arc <= high + self._same)
            curves.append(self._with_zeros(self.arc[inside], values[inside], [low, high]))
        return curves

    def with_ends(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Curve (arc length, value) along all candidates, zero where regions end between them."""
        return self._with_zeros(self.arc, values, [end for region in self.regions for end in region])

    @property
    def _same(self) -> float:
        return SAME * (self.chain.home[-1] - self.chain.home[0])

    def _with_zeros(self, arc: np.ndarray, values: np.ndarray, ends: list[float]):
        new = [end for end in ends if not np.any(np.abs(self.arc - end) <= self._same)]
        arc, values = np.append(arc, new), np.append(values, np.zeros(len(new)))
        order = np.argsort(arc, kind="stable")
        return arc[order], values[order]

    def _regions(self) -> list[tuple[float, float]]:
        around, found = self.chain.around, []
        for region in self.chain.path.contact.regions(self.point):
            if region.contact != self.chain.number:
                continue
            if around == 0.0:
                found.append((region.start, region.end))
                continue
            end = region.end + (around if region.end < region.start else 0.0)
            parts = [(max(region.start - turn, 0.0), min(end - turn, around)) for turn in (-around, 0.0, around)]
            found += [(low, high) for low, high in parts if low < high or (low == high and region.start == end)]
        return found

    def _slid(self) -> np.ndarray:
        """Arc lengths of the candidates; one that touches alone may have slid to where its region is."""
        arc = self.chain.home.copy()
        spots = [low for low, high in self.regions if low == high]
        pressing, gap = (self.values(field) for field in ("reaction", "gap"))
        if self.chain.points != "spans" or not spots or (pressing is None and gap is None):
            return arc
        for spot in spots:
            near = np.argsort(np.abs(self.chain.home - spot), kind="stable")[:3]
            best = near[np.argmax(pressing[near]) if pressing is not None else np.argmin(np.abs(gap[near]))]
            arc[best] = spot
        return arc

    def _angles(self) -> np.ndarray:
        """As the contact regions of the file count them, without jumps of a whole turn along the rod."""
        path, obstacle = self.chain.path, self.chain.obstacle(self.point)
        if obstacle.centre is None:
            raise ResultsError(f"{path.filename}: {self.chain.obstacle_name} has no centre (use --against arc)")
        home, now = path.mesh.coordinates[path.contact.candidates[self.chain.rows]], self.values("contact_point")
        if now is None:
            raise ResultsError(f"{path.filename}: angles need the contact points (they come with *FIELD OUTPUT, REACTION or GAP), "
                               f"point {self.point} has none")
        before, after = (np.unwrap(np.degrees(np.arctan2(*(x - obstacle.centre).T[::-1])) - obstacle.reference_angle,
                                   period=360.0) for x in (home, now))
        first = before[0] - (before[0] + 180.0) % 360.0 + 180.0      # turns that bring the first into (-180, 180]
        return after - first + 360.0 * round(np.mean(before - after) / 360.0)

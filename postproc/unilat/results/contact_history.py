"""Contact regions followed along the path: stretches until they end, split or merge, and their ends on and on.

Regions open, close, split and merge, so that the same column of the file need not be the same region at two points of
the path. As many regions that overlap in their order go on one by one. Else a region goes on as the one of the same
contact that shares most of the shorter one's length, when both do so with no other; where one does with several, regions
split or merge: the stretches before end and those after begin. A region that shares with none (one point that wanders)
goes on as the one whose ends are nearest, each used once.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np

SAME_END = 1e-3     # of a region's length
SHARED = 0.5        # of the shorter region's length
NO_FORCE = 1e-6     # of the largest force of the contact: what elements make of a rod that fits its ground, rounding


@dataclass(frozen=True)
class History:
    """One stretch of contact followed along the path until it ends, splits or merges."""

    contact: int
    points: np.ndarray        # numbers of the points, from 1, consecutive
    start: np.ndarray         # at these points: stress-free arc length along the candidates
    end: np.ndarray
    angle_start: np.ndarray
    angle_end: np.ndarray
    start_line: int           # number of its start's line, see End
    end_line: int


@dataclass(frozen=True, eq=False)
class End:
    """One end of contact followed along the path, from stretch to stretch where they split and merge.

    When a stretch splits, its start goes on as that of its first part and its end as that of its last part; the ends
    between are new and have a number of their own, the same on both sides of the gap.
    """

    contact: int
    line: int                 # from 1; start and end of a region that opens have the same
    side: str                 # "start" or "end" of a stretch
    points: np.ndarray        # numbers of the points, from 1, consecutive
    arc: np.ndarray
    angle: np.ndarray


class _Stretch:
    """A history that is being followed."""

    def __init__(self, contact: int, lines: list[int]):
        self.contact, self.lines = contact, lines
        self.points: list[int] = []
        self.regions: list = []

    def add(self, point: int, region) -> _Stretch:
        self.points.append(point)
        self.regions.append(region)
        return self

    def finished(self) -> History:
        values = (np.array([getattr(region, name) for region in self.regions])
                  for name in ("start", "end", "angle_start", "angle_end"))
        return History(self.contact, np.array(self.points), *values, *self.lines)


def follow(contact) -> list[History]:
    """All stretches of a Contact, in order of appearance."""
    done: list[_Stretch] = []
    present: dict[int, list[_Stretch]] = {}         # by contact
    counter = Counter()
    pressed = presses(contact)
    for row in range(len(contact.count)):
        regions = contact.regions(row + 1)
        for c in range(pressed.shape[1]):
            now = [region for region in regions if region.contact == c + 1]
            first_force = row > 0 and pressed[row, c] and not pressed[row - 1, c]
            step = _Step(present.get(c, []), now, contact.chain_length[c], first_force, counter)
            present[c] = []
            for k, region in enumerate(now):
                stretch = step.continued(k)
                if stretch is None:
                    stretch = _Stretch(c + 1, step.lines(k))
                    done.append(stretch)
                present[c].append(stretch.add(row + 1, region))
    return [stretch.finished() for stretch in done]


def presses(contact) -> np.ndarray:
    """Whether there is force at each point in each contact, (points, contacts)."""
    total = np.abs(contact.reaction_total)
    return total > NO_FORCE * np.max(total, axis=0, initial=0.0)


def ends(histories: list[History]) -> list[End]:
    """The ends of all stretches, each joined with those that it goes on as; in order of appearance."""
    parts: dict[tuple, list] = {}
    for history in histories:
        for side in ("start", "end"):
            key = (history.contact, getattr(history, f"{side}_line"), side)
            parts.setdefault(key, []).append((history.points, getattr(history, side), getattr(history, f"angle_{side}")))
    return [End(*key, *(np.concatenate(values) for values in zip(*sorted(pieces, key=lambda piece: piece[0][0]))))
            for key, pieces in parts.items()]


class _Step:
    """What becomes of the regions of one contact from one point to the next."""

    def __init__(self, before: list[_Stretch], now: list, around: float, first_force: bool, counter: Counter):
        """`around`: length of a closed chain, 0: open; `first_force`: nothing pressed before, now something does."""
        self.before, self.now, self.around, self.counter = before, now, around, counter
        old = [stretch.regions[-1] for stretch in before]
        links = self._links(old, now)
        if first_force:
            links = self._without_jumps(old, links)
        self.parents = [self._in_order(region, [i for i, j in links if j == k], old) for k, region in enumerate(now)]
        self.children = [self._in_order(was, [k for j, k in links if j == i], now) for i, was in enumerate(old)]
        self.gaps: dict[tuple[int, int], int] = {}      # (parent, number of the gap between its children) -> line

    def continued(self, k: int) -> _Stretch | None:
        """The stretch that region k belongs to; None when it begins a new one."""
        if len(self.parents[k]) != 1 or len(self.children[self.parents[k][0]]) != 1:
            return None
        return self.before[self.parents[k][0]]

    def lines(self, k: int) -> list[int]:
        """Numbers of the lines of both ends of region k, which begins a new stretch."""
        if not self.parents[k]:
            return [self._new()] * 2
        return [self._line(k, "start", self.parents[k][0], -1), self._line(k, "end", self.parents[k][-1], 1)]

    def _line(self, k: int, side: str, parent: int, towards: int) -> int:
        place = self.children[parent].index(k)
        if 0 <= place + towards < len(self.children[parent]):
            gap = (parent, min(place, place + towards))
            if gap not in self.gaps:
                self.gaps[gap] = self._new()
            return self.gaps[gap]
        return self.before[parent].lines[0 if side == "start" else 1]

    def _links(self, old: list, now: list) -> list[tuple[int, int]]:
        """Which regions go on as which."""
        first, second = (sorted(range(len(regions)), key=lambda k, of=regions: of[k].start) for regions in (old, now))
        if len(old) == len(now) and all(self._shared(old[i], now[k]) >= 0.0 for i, k in zip(first, second)):
            return list(zip(first, second))
        links = [(i, k) for i, was in enumerate(old) for k, region in enumerate(now)
                 if self._shared(was, region) >= SHARED * min(self._length(was), self._length(region))]
        lone = sorted((self._moved(was, region), i, k) for i, was in enumerate(old) for k, region in enumerate(now)
                      if i not in (j for j, _ in links) and k not in (j for _, j in links))
        for _, i, k in lone:
            if all(i != j and k != m for j, m in links):
                links.append((i, k))
        return links

    def _without_jumps(self, old: list, links: list[tuple[int, int]]) -> list[tuple[int, int]]:
        """Where a rod touches without force, any force may lift a part of it off at once: what is left begins anew."""
        def stays(i: int) -> bool:
            was, parts = old[i], [self.now[k] for j, k in links if j == i]
            lost = max((max(part.start - was.start, was.end - part.end) for part in parts), default=0.0)
            return lost <= SAME_END * self._length(was)

        return [(i, k) for i, k in links if stays(i)]

    def _new(self) -> int:
        self.counter["lines"] += 1
        return self.counter["lines"]

    # Where regions are; on a closed chain also a turn before and after

    def _span(self, region) -> tuple[float, float]:
        return region.start, region.end + (self.around if region.end < region.start else 0.0)

    def _turns(self) -> tuple[float, ...]:
        return (-self.around, 0.0, self.around) if self.around > 0.0 else (0.0,)

    def _length(self, region) -> float:
        start, end = self._span(region)
        return end - start

    def _shared(self, one, other) -> float:
        """Length that two regions share; negative: how far they are apart."""
        (a, b), (c, d) = self._span(one), self._span(other)
        return max(min(b, d + turn) - max(a, c + turn) for turn in self._turns())

    def _moved(self, one, other) -> float:
        (a, b), (c, d) = self._span(one), self._span(other)
        return min(abs(c + turn - a) + abs(d + turn - b) for turn in self._turns())

    def _in_order(self, centre, chosen: list[int], regions: list) -> list[int]:
        """Numbers of regions in their order along the chain about another one."""
        middle = sum(self._span(centre)) / 2.0

        def along(number: int) -> float:
            offset = sum(self._span(regions[number])) / 2.0 - middle
            return offset - self.around * round(offset / self.around) if self.around > 0.0 else offset

        return sorted(chosen, key=along)

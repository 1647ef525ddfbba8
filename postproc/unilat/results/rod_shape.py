"""Smooth curves of a rod from its nodes: stress-free and deformed shape, and the part in contact.

A result file holds nodes and their rotations. Between two nodes the axis is drawn as the cubic that has the
directions of both ends (the stress-free direction turned by the node's rotation), so that a rod of few elements does
not look like a polygon. The cubic leaves its ends as fast as that of a circular arc that turns as much: a quarter of a circle
is drawn within 3e-4 of its radius.
"""

from __future__ import annotations

import numpy as np

from .contact_history import presses
from .types import Contact, Mesh, Path, ResultsError

SLIGHT = np.radians(3.0)       # a turn that is no corner, whatever the next nodes have
LIKE = 0.2                     # of a node's turn: what one of the next nodes has at least on a smooth curve
CORNER = np.radians(35.0)      # elements that meet at more than this are not one smooth curve
MOST_TURNED = np.radians(270.0)     # an element that turns further is not drawn as an arc
PIECES = 256                   # straight ones that a structure is drawn with, at least 8 and at most 32 an element


class Shape:
    """The axis of every element at one point of the path."""

    def __init__(self, mesh: Mesh, displacement: np.ndarray | None = None, scale: float = 1.0, linear: bool = False):
        """`displacement` (nodes, 3): u, v, rotation; None: the stress-free shape. `scale` magnifies it.

        With `linear` rotations are slopes, as in a buckling mode: its picture is the same at any scale.
        """
        self.pieces = int(np.clip(PIECES // max(len(mesh.elements), 1), 8, 32))
        moved = np.zeros((len(mesh.coordinates), 3)) if displacement is None else scale * displacement
        self.elements = mesh.elements
        self.nodes = mesh.coordinates + moved[:, :2]
        directions, turn = stress_free_directions(mesh), moved[mesh.elements, 2]
        if linear:
            chord = np.hypot(*(mesh.coordinates[mesh.elements[:, 1]] - mesh.coordinates[mesh.elements[:, 0]]).T)
            along, across = (np.stack((np.cos(angle), np.sin(angle)), axis=-1)
                             for angle in (directions, directions + 0.5 * np.pi))
            self._tangents = _speed(chord, directions)[:, None, None] * (along + turn[:, :, None] * across)
            return
        directions = directions + turn
        chord = np.hypot(*(self.nodes[mesh.elements[:, 1]] - self.nodes[mesh.elements[:, 0]]).T)
        self._tangents = _speed(chord, directions)[:, None, None] * np.stack((np.cos(directions), np.sin(directions)), axis=-1)

    def piece(self, element: int, t: np.ndarray) -> np.ndarray:
        """Points (len(t), 2) of an element's axis; t runs from 0 to 1."""
        (a, b), (p, q), t = self.nodes[self.elements[element]], self._tangents[element], np.asarray(t)[:, None]
        return ((1 + 2 * t) * (1 - t) ** 2 * a + t ** 2 * (3 - 2 * t) * b
                + t * (1 - t) ** 2 * p - t ** 2 * (1 - t) * q)

    def motion(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Points (elements, len(t), 2) of all axes, and their rates by t."""
        (a, b), (p, q), t = (self.nodes[self.elements[:, end], None] for end in (0, 1)), \
            (self._tangents[:, end, None] for end in (0, 1)), np.asarray(t)[:, None]
        return ((1 + 2 * t) * (1 - t) ** 2 * a + t ** 2 * (3 - 2 * t) * b + t * (1 - t) ** 2 * p - t ** 2 * (1 - t) * q,
                6 * t * (1 - t) * (b - a) + (1 - t) * (1 - 3 * t) * p + t * (3 * t - 2) * q)

    def curves(self, pieces: int | None = None) -> list[np.ndarray]:
        """The whole axis: one polyline (n, 2) for each chain of elements, of so many straight pieces an element; None: as look smooth."""
        return join([(element, 0.0, 1.0) for element in range(len(self.elements))], self, pieces)


def _speed(chord: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """How fast a cubic leaves its ends: as that which is nearest to the arc with these chords and this turn."""
    turn = np.clip(directions[:, 1] - directions[:, 0], -MOST_TURNED, MOST_TURNED)
    return chord / np.cos(0.25 * turn) ** 2


def stress_free_directions(mesh: Mesh) -> np.ndarray:
    """Direction [rad] of the stress-free axis at both ends of each element, (elements, 2).

    As the file has it, else taken from the chords: where two elements meet smoothly it is theirs weighted to fit a parabola (exact for a
    circle of equal elements), at a free end or corner it mirrors the other end's.
    """
    if mesh.direction is not None:
        return mesh.direction
    ends = mesh.coordinates[mesh.elements]
    chords = ends[:, 1] - ends[:, 0]
    length, angle = np.hypot(*chords.T), np.arctan2(chords[:, 1], chords[:, 0])
    meeting: dict[int, list[tuple[int, int]]] = {}
    for element, nodes in enumerate(mesh.elements):
        for end, node in enumerate(nodes):
            meeting.setdefault(node, []).append((element, end))
    turn = np.full((len(angle), 2), np.nan)     # end direction minus chord direction
    between_of = {}
    for node, pair in meeting.items():
        if len(pair) == 2:
            (e, i), (f, j) = pair
            onwards = 0.0 if i != j else np.pi      # both elements may start (or end) at the node
            between_of[node] = (angle[f] + onwards - angle[e] + np.pi) % (2.0 * np.pi) - np.pi
    for node, between in between_of.items():
        (e, i), (f, j) = meeting[node]
        beside = [abs(between_of[other]) for other in (mesh.elements[e, 1 - i], mesh.elements[f, 1 - j]) if other in between_of]
        # A turn that none of the next nodes has is a corner between straight rods.
        if abs(between) > CORNER or beside and abs(between) > SLIGHT and max(beside) < LIKE * abs(between):
            continue
        share = length[e] / (length[e] + length[f])
        turn[e, i] = between * share
        turn[f, j] = -between * (1.0 - share)
    for end in (0, 1):
        lone = np.isnan(turn[:, end])
        turn[lone, end] = -turn[lone, 1 - end]
    return angle[:, None] + np.nan_to_num(turn)


def join(pieces: list[tuple[int, float, float]], shape: Shape, straight: int | None = None) -> list[np.ndarray]:
    """Polylines of pieces (element, from, to); a piece that begins where the last one ended continues it."""
    lines: list[list[np.ndarray]] = []
    samples = np.linspace(0.0, 1.0, (straight or shape.pieces) + 1)
    for element, t_from, t_to in pieces:
        points = shape.piece(element, t_from + (t_to - t_from) * samples)
        if lines and np.array_equal(lines[-1][-1][-1], points[0]):
            lines[-1].append(points[1:])
        else:
            lines.append([points])
    return [np.concatenate(line) for line in lines]


def contact_curves(results: Path, point: int, shape: Shape) -> tuple[list[np.ndarray], np.ndarray]:
    """The part in contact at a point of the path: polylines, and single points (n, 2).

    Of contacts that only nodes of the deck can have, from the reactions where they are stored, else from the regions. Contact
    without force, as before any load, is left out.
    """
    pieces, spots = contact_pieces(results, point, shape)
    return join(pieces, shape), spots


def idle_pieces(results: Path, point: int, shape: Shape, regions: list | None = None) -> list[tuple[int, float, float]]:
    """Parts of elements that touch an obstacle without force."""
    contact = results.contact
    if contact is None:
        return []
    pressing = presses(contact)[point - 1]
    return sorted({piece for number in _with_surface(results) if not pressing[number - 1]
                   for piece in _from_regions(contact, number, point, shape, regions)[0]})


def contact_pieces(results: Path, point: int, shape: Shape, regions: list | None = None) -> tuple[list[tuple[int, float, float]], np.ndarray]:
    """The same as parts (element, from, to) of elements, each running from 0 to 1; `regions` instead of those of the point."""
    contact = results.contact
    if contact is None:
        return [], np.zeros((0, 2))
    reaction = None
    if "reaction" in results.field_names and point in results.points_with("reaction"):
        reaction = results.field("reaction", point)
        if len(reaction) != len(contact.candidates):
            raise ResultsError(f"/fields/reaction has {len(reaction)} values for {len(contact.candidates)} candidates")
    pieces, spots = set(), []
    for number in _with_surface(results):
        if not presses(contact)[point - 1, number - 1]:
            continue
        if reaction is not None and contact.points[number - 1] == "nodes":
            more, single = _from_reactions(contact, number, reaction, shape)
        else:
            more, single = _from_regions(contact, number, point, shape, regions)
        pieces |= set(more)
        spots += single
    return sorted(pieces), np.array(spots).reshape(-1, 2)


def _with_surface(results: Path) -> list[int]:
    """Numbers of the contacts with something that can be touched: soil along a rod holds it everywhere and has no surface."""
    soil = {name for name, obstacle in results.obstacles.items() if obstacle.kind == "soil"}
    names = results.contact.obstacles or ("",) * len(results.contact.points)
    return [number for number, name in enumerate(names, start=1) if name not in soil]


def _from_reactions(contact: Contact, number: int, reaction: np.ndarray, shape: Shape):
    """Elements between nodes that press, and nodes that press alone."""
    pressed = set(contact.candidates[(contact.candidate_contact == number) & (reaction != 0.0)])
    pieces = [(element, 0.0, 1.0) for element, (a, b) in enumerate(shape.elements) if a in pressed and b in pressed]
    lone = pressed - set(shape.elements[[element for element, _, _ in pieces]].ravel())
    return pieces, [shape.nodes[node] for node in sorted(lone)]


def contact_spans(contact: Contact, number: int, shape: Shape) -> list[tuple[int, float, float]]:
    """Elements that a contact covers, with the arc lengths along it at both ends of each."""
    mine = contact.candidate_contact == number
    along = dict(zip(contact.candidates[mine], contact.arc_length[mine]))
    around = contact.chain_length[number - 1]       # 0: open
    spans = []
    for element, (a, b) in enumerate(shape.elements):
        if a in along and b in along:
            s, t = along[a], along[b]
            if around > 0.0 and abs(t - s) > 0.5 * around:      # the element that closes a ring
                s, t = (s, t + around) if t < s else (s + around, t)
            spans.append((element, s, t))
    return spans


def places_along(contact: Contact, number: int, shape: Shape, arc: np.ndarray) -> np.ndarray:
    """Where arc lengths (n) along a contact are on a shape, (n, 2)."""
    spans = contact_spans(contact, number, shape)
    around = contact.chain_length[number - 1]
    found = np.full((len(arc), 2), np.nan)
    for k, at in enumerate(arc):
        for turn in (0.0, around, -around) if around > 0.0 else (0.0,):
            distance = [max(min(s, t) - at - turn, at + turn - max(s, t), 0.0) for _, s, t in spans]
            if distance and (min(distance) <= 1e-9 * max(abs(spans[-1][2]), 1e-300) or around == 0.0):
                element, s, t = spans[int(np.argmin(distance))]
                found[k] = shape.piece(element, np.array([np.clip((at + turn - s) / (t - s), 0.0, 1.0)]))[0]
                break
    return found


def _from_regions(contact: Contact, number: int, point: int, shape: Shape, regions: list | None = None):
    """Parts of elements between the ends of the regions."""
    around = contact.chain_length[number - 1]       # 0: open
    spans = contact_spans(contact, number, shape)
    pieces, spots = [], []
    for region in contact.regions(point) if regions is None else regions:
        if region.contact != number:
            continue
        end = region.end + (around if region.end < region.start else 0.0)
        for turn in (0.0, around) if around > 0.0 else (0.0,):
            low, high = region.start - turn, end - turn
            for element, s, t in spans:
                first, last = max(low, min(s, t)), min(high, max(s, t))
                if low == high and first == last:
                    spots.append(shape.piece(element, np.array([(low - s) / (t - s)]))[0])
                    break
                if last > first:
                    pieces.append((element, *sorted(((first - s) / (t - s), (last - s) / (t - s)))))
    return pieces, spots

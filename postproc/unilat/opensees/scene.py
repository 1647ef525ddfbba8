"""Reads the cards of a study's deck that OpenSees can carry over, into nodes, beams, supports, loads and gaps."""

from __future__ import annotations

import ast
import math
import operator
import re
from dataclasses import dataclass, field

import numpy as np

from ..results import ResultsError

WORDS = {"ENCASTRE": (1, 1, 1), "PINNED": (1, 1, 0), "XSYMM": (1, 0, 1), "YSYMM": (0, 1, 1)}
COMPONENTS = {"U1": 1, "U2": 2, "UR": 3}
FORMULA = {ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv, ast.Pow: operator.pow}
UNNEEDED = {"HEADING", "ACCURACY", "END STEP", "STEP", "PARAMETER", "FIELD OUTPUT", "LOCATE", "TURNING POINTS"}     # nothing that an equilibrium path of OpenSees depends on


@dataclass
class Monitor:
    node: int           # row, from 0
    component: int      # 1, 2: displacements, 3: rotation
    factor: float
    offset: float


@dataclass
class Obstacle:
    kind: str           # LINE, CIRCLE
    numbers: list[float]
    modulus: float      # of a Winkler foundation, infinite: rigid


@dataclass
class Scene:
    """Lengths, forces and angles are those of the deck."""

    nodes: list[tuple[float, float]] = field(default_factory=list)
    beams: list[tuple[int, int, float]] = field(default_factory=list)      # rows of its nodes, stress-free length
    stiffness: tuple[float, float] = (0.0, 0.0)                            # EA, EI
    fixed: dict[int, tuple[int, int, int]] = field(default_factory=dict)
    load: dict[int, np.ndarray] = field(default_factory=dict)              # forces and moment at load factor 1
    obstacles: list[tuple[Obstacle, dict[int, float]]] = field(default_factory=list)   # and lengths of the nodes that may touch
    monitors: dict[str, Monitor] = field(default_factory=dict)
    method: str = ""
    first: float = 0.0
    largest: float = 0.0
    stops: list[tuple[str, str, float]] = field(default_factory=list)      # quantity, ABOVE or BELOW, value

    @property
    def size(self) -> float:
        return float(np.max(np.ptp(np.array(self.nodes), axis=0)))


class SceneReader:
    """One deck. `values`: of its parameters."""

    def __init__(self, text: str, values: dict):
        self.values, self.scene = values, Scene()
        self.labels: dict[str, int] = {}           # of the deck's own nodes
        self.sets: dict[str, list[int]] = {}       # beams
        self.around: dict[str, Obstacle] = {}
        self.define(text)
        for card, options, lines in cards(self.filled(text)):
            if card in UNNEEDED:
                continue
            reader = getattr(self, "read_" + card.lower().replace(" ", "_"), None)
            if reader is None:
                raise ResultsError(f"*{card} is not carried over to OpenSees")
            try:
                reader(options, lines)
            except (KeyError, IndexError, ValueError) as problem:
                raise ResultsError(f"*{card} is not carried over to OpenSees: {problem}") from None

    def define(self, text: str):
        """Takes the parameters of the deck, those above first; given values replace them."""
        for card, _, lines in cards(text):
            for line in lines if card == "PARAMETER" else []:
                name, _, value = ",".join(line).partition("=")
                if name.strip() not in self.values:
                    self.values[name.strip()] = value.strip().strip('"') if '"' in value else formula(value, self.values)

    def filled(self, text: str) -> str:
        """The deck with values in the place of its formulas."""
        return re.sub(r"\$\{([^}]*)\}", lambda found: str(formula(found.group(1), self.values)), text)

    def lengths(self, beams: list[int]) -> dict[int, float]:
        """Of every node of a set: half the stress-free lengths of the beams beside it."""
        found: dict[int, float] = {}
        for i, j, length in (self.scene.beams[e] for e in beams):
            for node in (i, j):
                found[node] = found.get(node, 0.0) + 0.5 * length
        return found

    # The cards

    def read_node(self, _, lines):
        for label, x, y in lines:
            self.labels[label] = len(self.scene.nodes)
            self.scene.nodes.append((float(x), float(y)))

    def read_line(self, options, lines):
        for first, last, count in self.counted(lines, 3):
            start, end = (np.array(self.scene.nodes[self.labels[name]]) for name in (first, last))
            parts = np.linspace(0.0, 1.0, int(count) + 1)[1:-1]
            self.chain(options, first, last, [tuple(start + t * (end - start)) for t in parts], math.dist(start, end) / int(count))

    def read_arc(self, options, lines):
        sense = -1.0 if options.get("DIRECTION") == "CLOCKWISE" else 1.0
        for first, last, x, y, count in self.counted(lines, 5):
            centre = np.array((float(x), float(y)))
            start, end = (np.array(self.scene.nodes[self.labels[name]]) - centre for name in (first, last))
            radius = float(np.hypot(*start))
            angle = math.atan2(start[1], start[0])
            turn = (sense * (math.atan2(end[1], end[0]) - angle)) % (2.0 * math.pi)
            at = [angle + sense * turn * k / int(count) for k in range(1, int(count))]
            self.chain(options, first, last, [tuple(centre + radius * np.array((math.cos(t), math.sin(t)))) for t in at],
                       radius * turn / int(count))

    def counted(self, lines, fields: int):
        """Data lines that must say how many elements there are, evenly spaced."""
        for line in lines:
            if len(line) < fields or not line[fields - 1]:
                raise ValueError("the deck leaves the number of elements to unilat; OpenSees needs one")
            if len(line) > fields:
                raise ValueError("graded elements")
        return lines

    def chain(self, options, first: str, last: str, inside: list[tuple], length: float):
        new = range(len(self.scene.nodes), len(self.scene.nodes) + len(inside))
        self.scene.nodes += inside
        nodes = [self.labels[first], *new, self.labels[last]]
        members = range(len(self.scene.beams), len(self.scene.beams) + len(nodes) - 1)
        self.scene.beams += [(i, j, length) for i, j in zip(nodes, nodes[1:])]
        for name in {options["ELSET"], options.get("NSET", options["ELSET"])}:
            self.sets.setdefault(name, []).extend(members)

    def read_imperfection(self, options, lines):
        if options["SHAPE"] != "CLAMPED":
            raise ValueError(f"SHAPE={options['SHAPE']}")
        a1, a2 = (float(word) for word in (lines[0] + ["0"])[:2])
        beams = [self.scene.beams[e] for e in self.sets[options["ELSET"]]]
        whole, s, places = sum(length for _, _, length in beams), 0.0, {beams[0][0]: 0.0}
        for _, j, length in beams:
            s += length / whole
            places[j] = s
        first, last = self.scene.nodes[beams[0][0]], self.scene.nodes[beams[-1][1]]
        left = np.array((first[1] - last[1], last[0] - first[0])) / math.dist(first, last)
        for node, t in places.items():
            w = math.sin(math.pi * t)**2 * (a1 + a2 * 1.5 * math.sqrt(3.0) * math.cos(math.pi * t))
            self.scene.nodes[node] = tuple(np.array(self.scene.nodes[node]) + w * left)

    def read_beam_section(self, options, lines):
        if options.get("SECTION") != "STIFFNESS" or self.scene.stiffness[0] or len(lines[0]) != 2:
            raise ValueError("one section with SECTION=STIFFNESS, EA and EI")
        self.scene.stiffness = (float(lines[0][0]), float(lines[0][1]))

    def read_boundary(self, _, lines):
        for label, word in lines:
            self.scene.fixed[self.labels[label]] = WORDS[word]

    def read_obstacle(self, options, lines):
        foundation = options.get("FOUNDATION", "RIGID")
        if options["TYPE"] not in ("LINE", "CIRCLE") or foundation not in ("RIGID", "WINKLER") \
                or options["TYPE"] == "CIRCLE" and options.get("SIDE") != "INSIDE":
            raise ValueError("lines and the inside of circles, rigid or FOUNDATION=WINKLER")
        self.around[options["NAME"]] = Obstacle(options["TYPE"], [float(word) for word in lines[0]], float(options.get("MODULUS", "inf")))

    def read_contact(self, options, _):
        self.scene.obstacles.append((self.around[options["OBSTACLE"]], self.lengths(self.sets[options["NSET"]])))

    def read_monitor(self, options, lines):
        label, component, factor, offset = (lines[0] + ["1", "0"][len(lines[0]) - 2:])[:4]
        self.scene.monitors[options["NAME"]] = Monitor(self.labels[label], COMPONENTS[component], float(factor), float(offset))

    def read_static(self, options, lines):
        self.scene.method = options["METHOD"]
        self.scene.first, self.scene.largest = float(lines[0][0]), float(lines[0][2])

    def read_cload(self, _, lines):
        for label, component, value in lines:
            self.push(self.labels[label], int(component), float(value))

    def read_dload(self, _, lines):
        for name, kind, value in lines:
            component = {"PX": 1, "PY": 2}[kind]
            for node, length in self.lengths(self.sets[name]).items():
                self.push(node, component, float(value) * length)

    def push(self, node: int, component: int, value: float):
        self.scene.load.setdefault(node, np.zeros(3))[component - 1] += value

    def read_stop(self, _, lines):
        self.scene.stops += [(quantity, sense, float(value)) for quantity, sense, value in lines]


def cards(text: str):
    """Name, options and data lines (words) of every card."""
    found: list[tuple[str, dict, list]] = []
    for line in text.splitlines():
        words = [word.strip() for word in line.split(",")]
        if not line.strip() or line.startswith("**"):
            continue
        if line.startswith("*"):
            options = dict(map(str.strip, word.split("=", 1)) if "=" in word else (word, "") for word in words[1:])
            found.append((words[0][1:].upper(), {name.upper(): value for name, value in options.items()}, []))
        elif found:
            found[-1][2].append(words)
    return found


def formula(text: str, values: dict):
    """The value of an arithmetic formula of parameters."""

    def value(node):
        if isinstance(node, ast.Constant):
            return node.value
        if isinstance(node, ast.Name):
            if node.id not in values:
                raise ResultsError(f"no value for the parameter {node.id} (--set {node.id}=...)")
            return values[node.id]
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
            return -value(node.operand)
        if isinstance(node, ast.BinOp) and type(node.op) in FORMULA:
            return FORMULA[type(node.op)](value(node.left), value(node.right))
        raise ResultsError(f"${{{text}}} is not carried over to OpenSees")

    try:
        return value(ast.parse(text.strip(), mode="eval").body)
    except SyntaxError:
        raise ResultsError(f"${{{text}}} is not carried over to OpenSees") from None

"""Follows the equilibrium path of a scene with OpenSees."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, field

import numpy as np
import openseespy.opensees as ops

from .scene import Obstacle, Scene

CLOSE = 1e-10       # of the size: the last correction of a point
LEAST_PART = 1e-3   # of an increment
MOST_POINTS = 5000
NEVER = 1e30        # the force that a gap would yield at


@dataclass
class Followed:
    load_factor: list[float] = field(default_factory=lambda: [0.0])
    monitors: dict[str, list[float]] = field(default_factory=dict)
    gap: list[float] = field(default_factory=list)      # the least one to a straight wall; infinite without such
    seconds: float = 0.0
    why: str = ""           # it stopped early
    version: str = ""


def follow(scene: Scene, control: str | None = None, increment: float | None = None, penalty: float = 1e10) -> Followed:
    """All points up to the first stop of the deck; an increment that fails is halved, and grows again.

    `control`: the monitor of a displacement that only grows, where there is one. Without one the arc length is prescribed,
    and that of OpenSees may turn round on its path. `penalty`: stiffness of a rigid obstacle per length, of EI/size^4; with
    too much Newton's method does not get off.
    """
    begun = time.perf_counter()
    build(scene, penalty)
    path = Followed(monitors={name: [value(monitor)] for name, monitor in scene.monitors.items()},
                    gap=[least_gap(scene)], version=str(ops.version()))
    ops.constraints("Plain")
    ops.numberer("RCM")
    ops.system("ProfileSPD")
    # Forces are rounding where a rod hardly stretches.
    ops.test("NormDispIncr", CLOSE * scene.size * math.sqrt(len(scene.nodes)), 30, 0)
    ops.algorithm("Newton")
    whole = scene.first if scene.method == "LOAD" else increment if increment is not None else scene.largest * scene.size
    part = 1.0
    prescribe(scene, control, whole)
    ops.analysis("Static")
    while not reached(scene, path):
        if len(path.load_factor) == MOST_POINTS:
            path.why = f"{MOST_POINTS} points are not enough"
            break
        if ops.analyze(1):
            part *= 0.5
            if part < LEAST_PART:
                path.why = "no equilibrium was found for an increment"
                break
            prescribe(scene, control, whole * part)
            continue
        if part < 1.0:
            part *= 2.0
            prescribe(scene, control, whole * part)
        path.load_factor.append(ops.getTime())
        for name, monitor in scene.monitors.items():
            path.monitors[name].append(value(monitor))
        path.gap.append(least_gap(scene))
        if control is None and goes_back(path):
            path.why = "the path turns round and goes back"
            break
    path.seconds = time.perf_counter() - begun
    return path


def prescribe(scene: Scene, control: str | None, increment: float):
    """What the next increments add."""
    if scene.method == "LOAD":
        ops.integrator("LoadControl", increment)
    elif control is not None:
        monitor = scene.monitors[control]
        ops.integrator("DisplacementControl", monitor.node + 1, monitor.component, math.copysign(increment, monitor.factor))
    else:
        # The norm of OpenSees is the root of a sum over all degrees of freedom.
        ops.integrator("ArcLength", increment * math.sqrt(len(scene.nodes)), 0.0)


def build(scene: Scene, penalty: float):
    """The model. Nodes are numbered from 1."""
    ops.wipe()
    ops.model("basic", "-ndm", 2, "-ndf", 3)
    for number, (x, y) in enumerate(scene.nodes, start=1):
        ops.node(number, float(x), float(y))
    for node, held in scene.fixed.items():
        ops.fix(node + 1, *held)
    ops.geomTransf("Corotational", 1)
    for number, (i, j, _) in enumerate(scene.beams, start=1):
        ops.element("elasticBeamColumn", number, i + 1, j + 1, scene.stiffness[0], 1.0, scene.stiffness[1], 1)
    for obstacle, lengths in scene.obstacles:
        add_obstacle(scene, obstacle, lengths, penalty)
    ops.timeSeries("Linear", 1)
    ops.pattern("Plain", 1, 1)
    for node, force in scene.load.items():
        ops.load(node + 1, *map(float, force))


def add_obstacle(scene: Scene, obstacle: Obstacle, lengths: dict[int, float], penalty: float):
    """A gap spring a node. Against a circle it is a bar that turns about the centre, so that the wall is frictionless."""
    stiffness = min(obstacle.modulus, penalty * scene.stiffness[1] / scene.size**4)
    if obstacle.kind == "CIRCLE":
        centre = len(ops.getNodeTags()) + 1
        ops.node(centre, *obstacle.numbers[:2])
        ops.fix(centre, 1, 1, 1)
    for node, length in lengths.items():
        tag = 10**6 + len(ops.getEleTags())
        x, y = scene.nodes[node]
        if obstacle.kind == "CIRCLE":
            radius = math.dist((x, y), obstacle.numbers[:2])
            gap_material(tag, stiffness * length * radius, (obstacle.numbers[2] - radius) / radius)     # of strains
            ops.element("corotTruss", tag, centre, node + 1, 1.0, tag)
            continue
        into = direction(obstacle)
        gap_material(tag, stiffness * length, gap_to(obstacle, x, y))
        held = len(ops.getNodeTags()) + 1
        ops.node(held, x, y)
        ops.fix(held, 1, 1, 1)
        ops.element("zeroLength", tag, held, node + 1, "-mat", tag, "-dir", 1, "-orient", *into, 0.0, -into[1], into[0], 0.0)


def gap_material(tag: int, stiffness: float, gap: float):
    if gap > 1e-12:
        ops.uniaxialMaterial("ElasticPPGap", tag, stiffness, NEVER, gap)
    else:
        ops.uniaxialMaterial("Elastic", tag, stiffness, 0.0, 0.0)


def value(monitor) -> float:
    return monitor.offset + monitor.factor * ops.nodeDisp(monitor.node + 1, monitor.component)


def direction(wall: Obstacle) -> tuple[float, float]:
    """Into a straight wall: the free side is on the left of its two points."""
    x1, y1, x2, y2 = wall.numbers
    way = math.dist((x1, y1), (x2, y2))
    return (y2 - y1) / way, (x1 - x2) / way


def gap_to(wall: Obstacle, x: float, y: float) -> float:
    into = direction(wall)
    return (wall.numbers[0] - x) * into[0] + (wall.numbers[1] - y) * into[1]


def least_gap(scene: Scene) -> float:
    return min((gap_to(wall, scene.nodes[node][0] + ops.nodeDisp(node + 1, 1), scene.nodes[node][1] + ops.nodeDisp(node + 1, 2))
                for wall, lengths in scene.obstacles if wall.kind == "LINE" for node in lengths), default=math.inf)


def goes_back(path: Followed) -> bool:
    """True when the last two increments go against each other."""
    if len(path.load_factor) < 3:
        return False
    one, two = (np.array([values[k] - values[k - 1] for values in path.monitors.values()]) for k in (-2, -1))
    return float(one @ two) < 0.0


def reached(scene: Scene, path: Followed) -> bool:
    """True at the end of the deck's step."""
    for quantity, sense, limit in scene.stops:
        last = (path.load_factor if quantity == "LOAD" else path.monitors[quantity])[-1]
        if last >= limit * (1.0 - 1e-12) if sense == "ABOVE" else last <= limit * (1.0 + 1e-12):
            return True
    return False

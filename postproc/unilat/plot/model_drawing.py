"""Supports, springs and loads in pictures of shapes. Symbols have sizes of the picture, not of the structure."""

from __future__ import annotations

import numpy as np
from matplotlib.path import Path as Outline

from ..results import Path
from ..results.force_glyphs import across, value_text, with_value
from ..results.mirror import mirrored
from ..results.model_parts import Loads
from ..results.rod_shape import Shape
from . import style
from .force_drawing import draw_arrow, write

LOAD = "#009E73"
ARROW = 0.11        # of the picture's size: the largest force
ROW = 0.05          # the largest distributed load
SPACING = 0.045     # between the arrows of a distributed load, along the rod
LINES = Outline.LINETO, Outline.MOVETO


def _outline(*strokes) -> Outline:
    """Polylines as one marker."""
    codes = [code for stroke in strokes for code in [Outline.MOVETO] + [Outline.LINETO] * (len(stroke) - 1)]
    return Outline(np.concatenate([np.asarray(stroke, dtype=float) for stroke in strokes]), codes)


def _ground(y: float):
    """A line with strokes under it."""
    return [[(-1.0, y), (1.0, y)]] + [[(x, y), (x - 0.35, y - 0.45)] for x in (-0.6, -0.1, 0.4, 0.9)]


# Below the node at (0, 0), which they hold from falling; turned to where they are needed.
TRIANGLE = [(0.0, 0.0), (-0.75, -1.2), (0.75, -1.2), (0.0, 0.0)]
SYMBOLS = {
    "pin": _outline(TRIANGLE, *_ground(-1.2)),
    "roller": _outline(TRIANGLE, *_ground(-1.65)),
    "clamp": _outline(*_ground(0.0)),
    "guide": _outline([(-0.8, 0.0), (0.8, 0.0)], *_ground(-0.5)),
    "no turn": _outline([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5), (-0.5, -0.5)]),
    "spring": _outline([(0.0, 0.0), (0.0, -0.3), (0.4, -0.45), (-0.4, -0.75), (0.4, -1.05), (-0.4, -1.35), (0.0, -1.5), (0.0, -1.8)],
                       *_ground(-1.8)),
    "turn spring": _outline([(0.25 * k / 12 * np.cos(k / 2.2), 0.25 * k / 12 * np.sin(k / 2.2)) for k in range(40)]),
}


def draw_supports(axes, path: Path, nodes: np.ndarray, colour: str = style.INK, size: float = 7.0, mirror=None):
    """Symbols at the supported nodes; `nodes` (nodes, 2): where they are."""
    supports = path.supports
    inwards = _inwards(path, path.mesh.coordinates)     # the same side at every point of the path
    for node, fixed in zip(supports.node, supports.fixed):
        for name, angle in support_symbols(fixed, inwards[node]):
            _mark(axes, nodes[node], SYMBOLS[name], angle, colour, size, mirror)
    for node, stiffness in zip(supports.spring_node, supports.spring):
        for component in np.flatnonzero(stiffness > 0.0):
            if component == 2:
                _mark(axes, nodes[node], SYMBOLS["turn spring"], 0.0, colour, size, mirror)
            else:
                _mark(axes, nodes[node], SYMBOLS["spring"], _facing(component, inwards[node]), colour, size, mirror)
    for pair in (*supports.joint_spring_node, *supports.relative_node):
        for line in mirrored([nodes[pair]], mirror):
            axes.plot(*line.T, color=colour, linewidth=0.8, linestyle=":", marker=SYMBOLS["no turn"], markersize=3.0, zorder=6)


def support_symbols(fixed: np.ndarray, inwards: np.ndarray) -> list[tuple[str, float]]:
    """Names of symbols and how far each is turned [degrees]; `inwards`: from the node into the structure."""
    u, v, turn = (bool(each) for each in fixed)
    main = 0 if abs(inwards[0]) > abs(inwards[1]) else 1
    if u and v:
        return [("clamp", _facing(main, inwards))] if turn else [("pin", _facing(1, inwards))]
    if u or v:
        return [("guide" if turn else "roller", _facing(0 if u else 1, inwards))]
    return [("no turn", 0.0)] if turn else []


def _facing(component: int, inwards: np.ndarray) -> float:
    """The symbol stands on the side away from the structure."""
    if component == 0:
        return -90.0 if inwards[0] >= 0.0 else 90.0
    return 0.0 if inwards[1] >= -0.3 else 180.0


def _inwards(path: Path, nodes: np.ndarray) -> np.ndarray:
    """From every node, the mean direction of its elements."""
    total = np.zeros(nodes.shape)
    chord = nodes[path.mesh.elements[:, 1]] - nodes[path.mesh.elements[:, 0]]
    chord = chord / np.maximum(np.hypot(*chord.T), 1e-300)[:, None]
    np.add.at(total, path.mesh.elements[:, 0], chord)
    np.add.at(total, path.mesh.elements[:, 1], -chord)
    return total


def _mark(axes, place: np.ndarray, symbol: Outline, angle: float, colour: str, size: float, mirror):
    turned = np.radians(angle)
    matrix = np.array(((np.cos(turned), -np.sin(turned)), (np.sin(turned), np.cos(turned))))
    for k, spot in enumerate(mirrored([place[None, :]], mirror)):
        vertices = symbol.vertices @ matrix.T
        if k == 1:
            vertices[:, mirror[0]] *= -1.0
        # A marker is as large as its furthest vertex: these keep one scale.
        scale = np.max(np.abs(vertices))
        axes.plot(*spot.T, marker=Outline(vertices, symbol.codes), markersize=size * scale, markerfacecolor="none",
                  markeredgecolor=colour, markeredgewidth=0.7, linestyle="none", zorder=5.8, clip_on=False, gid="support")


def hide_outside(axes):
    """Symbols may lie over the frame of a picture, but not beside it."""
    (left, right), (low, high) = sorted(axes.get_xlim()), sorted(axes.get_ylim())
    for line in axes.get_lines():
        if line.get_gid() == "support":
            (x, y), = line.get_xydata()
            line.set_visible(bool(left <= x <= right and low <= y <= high))


def load_corners(path: Path, loads: Loads, shape: Shape, size: float, stretch: float = 1.0) -> np.ndarray:
    """Places (n, 2) that a picture of the loads must have room for."""
    parts = [with_value(tail, tip, size, stretch) for tail, tip, _ in node_arrows(loads, shape, size, stretch)]
    parts += [np.vstack((tails, tips)) for tails, tips in load_rows(path, loads, shape, size, stretch)]
    return np.concatenate(parts) if parts else np.zeros((0, 2))


def draw_loads(axes, path: Path, loads: Loads, shape: Shape, size: float, factor: float = 1.0, stretch: float = 1.0, mirror=None,
               values: bool = True) -> bool:
    """Loads of one step on a shape, with their values times a factor; True when there is one to name in the legend."""
    drawn = False
    for tail, tip, value in node_arrows(loads, shape, size, stretch):
        for one, two in mirrored([np.vstack((tail, tip))], mirror):
            draw_arrow(axes, one, two, LOAD)
        if values:
            write(axes, tail, tip, factor * value, LOAD, 6.5)
        drawn = True
    for node, force in zip(loads.node, loads.force):
        if force[2] != 0.0:
            symbol = "$\\circlearrowleft$" if force[2] > 0.0 else "$\\circlearrowright$"
            axes.plot(*shape.nodes[node], marker=symbol, markersize=13.0, color=LOAD, linestyle="none", zorder=6.6, gid="load")
            if values:
                write(axes, shape.nodes[node], shape.nodes[node] - (0.0, 0.05 * size), abs(factor * force[2]), LOAD, 6.5)
            drawn = True
    for tails, tips in load_rows(path, loads, shape, size, stretch):
        for one, two in zip(mirrored([tails], mirror), mirrored([tips], mirror)):
            axes.plot(*one.T, color=LOAD, linewidth=0.6, zorder=3.2, gid="load")
            for tail, tip in zip(one, two):
                draw_arrow(axes, tail, tip, LOAD, layer=3.2, width=0.5, head=4.0)
        drawn = True
    for node, moved in zip(loads.displaced_node, loads.displacement):
        away = np.asarray(moved[:2], dtype=float)
        if np.any(away != 0.0):
            tip = shape.nodes[node] + ARROW * size * across(away[None, :], stretch)[0]
            draw_arrow(axes, shape.nodes[node], tip, LOAD, style_of="->", width=0.8)
            drawn = True
    for element in loads.heated_element:
        for curve in mirrored([shape.piece(int(element), np.linspace(0.0, 1.0, 9))], mirror):
            axes.plot(*curve.T, color=LOAD, linewidth=3.4, alpha=0.35, zorder=3.0, solid_capstyle="butt", gid="load")
        drawn = True
    return drawn


def load_names(loads: Loads, factor: float = 1.0) -> list[str]:
    """What a legend says of loads that are no arrows with values."""
    found = []
    for values in (np.hypot(*loads.line_force.T) if len(loads.line_force) else np.zeros(0), np.abs(loads.pressure)):
        if len(values):
            found.append(f"line load {value_text(abs(factor) * float(np.max(values)))}")
    if len(loads.strain):
        found.append("change of temperature")
    return found


def node_arrows(loads: Loads, shape: Shape, size: float, stretch: float) -> list[tuple[np.ndarray, np.ndarray, float]]:
    """Tail, tip and value of every force at a node."""
    forces = [(int(node), np.asarray(force[:2])) for node, force in zip(loads.node, loads.force) if np.any(force[:2] != 0.0)]
    for node, x, y, value in loads.pole:
        away = np.array((x, y)) - shape.nodes[int(node)]
        forces.append((int(node), value * away / (np.hypot(*away) or 1.0)))
    largest = max((np.hypot(*force) for _, force in forces), default=0.0)
    return [(shape.nodes[node] - size * ARROW * max(np.hypot(*force) / largest, 0.4) * across(force[None, :], stretch)[0], shape.nodes[node],
             float(np.hypot(*force))) for node, force in forces]


def load_rows(path: Path, loads: Loads, shape: Shape, size: float, stretch: float) -> list[tuple[np.ndarray, np.ndarray]]:
    """Tails and tips of the arrows of distributed loads: a row for each element, at equal distances along it."""
    rows = []
    largest = max([*(np.hypot(*loads.line_force.T) if len(loads.line_force) else ()), *np.abs(loads.pressure)], default=0.0)
    unit, left_over, end = np.array((1.0, stretch)), 0.0, -1
    loaded = [(int(element), force, False) for element, force in zip(loads.element, loads.line_force)]
    loaded += [(int(element), value, True) for element, value in zip(loads.pressed_element, loads.pressure)]
    for element, force, follows in loaded:
        t = np.linspace(0.0, 1.0, 33)
        curve = shape.piece(element, t)
        along = np.concatenate(([0.0], np.cumsum(np.hypot(*(np.diff(curve, axis=0) * unit).T))))
        goes_on, end = path.mesh.elements[element, 0] == end, path.mesh.elements[element, 1]
        # From element to element as if it were one rod, so that short ones are not crowded.
        places = np.arange(left_over, along[-1] + 1e-9 * size, SPACING * size)
        left_over = left_over + len(places) * SPACING * size - along[-1]
        if len(places) == 0:
            continue
        at = np.interp(places, along, t)
        tips = shape.piece(element, at)
        if follows:
            tangent = np.column_stack([np.interp(at, t, np.gradient(curve[:, k], t)) for k in (0, 1)])
            vectors = force * np.column_stack((-tangent[:, 1], tangent[:, 0])) / np.hypot(*tangent.T)[:, None]
        else:
            vectors = np.repeat(np.asarray(force, dtype=float)[None, :], len(at), axis=0)
        length = size * ROW * np.hypot(*vectors.T) / largest
        tails = tips - length[:, None] * across(vectors, stretch)
        if rows and goes_on:      # one row along elements that follow each other
            rows[-1] = tuple(np.concatenate(pair) for pair in zip(rows[-1], (tails, tips)))
        else:
            rows.append((tails, tips))
    return rows

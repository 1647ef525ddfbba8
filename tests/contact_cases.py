"""Cases of contact_reference.py: what each pattern of contact must give. Loads and lengths are those of the decks; EI = 1.

    ring_limit(100.0).load, liner_limit(50.0, 0.004, 1e-3).load, column_events()["limit"], tube_force(0.5)

Every pattern is asked whether it is one: no penetration, no tension (`assert_admissible`).
As a program it writes reference/liner_limits.csv anew: python3 tests/contact_cases.py
"""

from __future__ import annotations

import csv
import functools
import math
import pathlib
from dataclasses import dataclass

import numpy as np

from contact_reference import (Circle, Conforming, Free, Line, Problem, Rod, State, concentrated, gap, joined, point_contact,
                               touchdown, value_of)

SLENDERNESS = (25, 50, 100)
LOBES = (1, 2)
DISTURBANCES = (1e-5, 2e-4, 1e-3, 2e-3, 5e-3)
GAPS = (0.0, 0.0005, 0.001, 0.002, 0.004, 0.006, 0.01, 0.02)
# Of the cases below that take long; test_contact_reference.py asks for them.
RING = {100: 81.557427564661, 1000: 501.56075880248, 10000: 3151.5952072571, 100000: 19872.0377418}
COLUMN = {"onset": 0.9294732313035899, "limit": 2.484036097050767, "loss": 1.9467900723576015, "least": 1.0256469437096027}
COLUMN_AT_DRUM = {"onset": 0.930101781189, "limit": 2.134883418679, "loss": 1.978314298134, "least": COLUMN["least"]}
PINNED = {"spread": 3.9741223179376663, "opening": 4.804325904305935, "place": 0.5348778480928181, "limit": 18.759385272732}
TABLE = pathlib.Path(__file__).parent / "reference" / "liner_limits.csv"


@dataclass(frozen=True)
class Limit:
    load: float
    monitor: float      # displacement that the case is followed by
    angle: float        # of the touchdown point from the apex, in degrees
    state: State


def assert_admissible(state: State, curves: dict, on_left: bool, room: float = 1e-9):
    """No span of negative length, no free one behind its curve {span: curve}, no conforming one or touchdown point that pulls.

    `room`: for penetration, over the size 1, and for tension over the largest density.
    """
    spans = state.problem.spans
    tau = np.linspace(0.0, 1.0, 201)
    for k, span in enumerate(spans):
        assert state.at(span.end) > state.at(span.start) - 1e-12, f"span {k} has a negative length"
        if isinstance(span, Free) and k in curves:
            _, section = state.inside(k, tau)
            least = np.min(_distance(section, curves[k], on_left))
            assert least > -room, f"span {k} penetrates by {-least:.2g}"
        if isinstance(span, Conforming):
            density = state.density(k)
            assert np.min(density) > -room * (1.0 + np.max(np.abs(density))), f"span {k} pulls: {np.min(density):.3g}"
    for k in range(len(spans) - 1):
        push = concentrated(state.end(k), state.start(k + 1), on_left)
        assert push > -room, f"touchdown point {k} pulls: {push:.3g}"


def _distance(section, curve, on_left):
    """Of places from a curve, positive on the rod's side."""
    c, d = math.cos(curve.direction), math.sin(curve.direction)
    if isinstance(curve, Line):
        left = (section.y - curve.y) * c - (section.x - curve.x) * d
    else:
        left = curve.radius - math.copysign(1.0, curve.radius) * np.hypot(section.x - curve.x + curve.radius * d,
                                                                          section.y - curve.y - curve.radius * c)
    return -left if on_left else left


# Rings in a cavity: one free span at the apex, which is the origin, all the rest conforms ------------------------------------

def _ring(half, size, dead, pressure, apex):
    """`apex`: shear force there; `half`: length of rod from the apex to the other plane of symmetry; `size`: of the load p."""
    rod = Rod(flexibility=lambda g: g["flexibility"], dead=dead, pressure=pressure, curvature=lambda s: 1.0 + 0.0 * s)

    def host(g):
        """Touches the stress-free rod at its end for half a ring; about the same centre for a quarter."""
        clear = g["gap"]
        return Circle(0.0, -2.0 * clear if half > 2.0 else -clear, 1.0 + clear, 0.0)

    def conditions(state):
        first, last = state.start(0), state.end(1)
        # The plane of symmetry stands at the angle `half` of the host.
        return ([first.x, first.angle, first.fy - apex(state)] + touchdown(state.end(0), state.start(1), state["couple"])
                + [last.sigma - half * (1.0 + state["gap"])])

    names = {"mark": 1.0, "p": size, "flexibility": 1e-6, "gap": 1e-2, "disturbance": 1e-3, "couple": 1.0}
    return Problem([Free(rod, 0.0, "mark"), Conforming(rod, "mark", half, host, on_left=False)], names, conditions,
                   force=size), host


def _depth(state):
    """Inward displacement of the apex."""
    return state.start(0).y


@functools.cache
def ring_start(slenderness: float) -> tuple[State, dict]:
    """Dead load p upwards (the apex at the origin, the centre above it) that hardly deforms the ring; its R/h.

    The angle of lift-off goes with (R/h)^-0.285 or so; Newton's method needs it to a fifth.
    """
    problem, _ = _ring(math.pi, slenderness, lambda g: (0.0, g["p"]), lambda g: 0.0, lambda g: 0.0)
    load = 0.001 * slenderness
    mark = 0.63 * (100.0 / slenderness)**0.285
    held = {"flexibility": 1.0 / (12.0 * slenderness**2), "gap": 0.0, "disturbance": 0.0, "couple": 0.0}
    start = problem.guess([lambda s: (np.sin(s), 2.0 * np.sin(0.5 * s)**2, s, 0.0, 0.0, 0.0), lambda s: (s, 0.0)],
                          mark=mark, p=load, **held)
    return problem.solve(start, held, {"p": load}), held


@functools.cache
def ring_limit(slenderness: float) -> Limit:
    start, held = ring_start(slenderness)
    state = start.problem.limit(start, _depth, 0.08 * (100.0 / slenderness)**0.6, "p", held, steps=40)
    assert_admissible(state, {0: Circle(0.0, 0.0, 1.0, 0.0)}, on_left=False)
    return Limit(float(state["p"]), float(_depth(state)), math.degrees(state.end(0).angle), state)


def ring_path(slenderness: float, displacements) -> np.ndarray:
    """Rows (v, p, angle in degrees) at rising displacements of the apex."""
    state, held = ring_start(slenderness)
    rows = []
    for v in displacements:
        state = state.problem.go(state, _depth, v, held, steps=4)
        rows.append((v, state["p"], math.degrees(state.end(0).angle)))
    return np.array(rows, float)


def _disturbed(state):
    """The dead force on the half at the apex, downwards in the deck, grows with the pressure."""
    return -state["disturbance"] * state["p"]


@functools.cache
def _tight_liner(half: float) -> State:
    """The limit point of a liner of R/t = 50 without a gap, disturbance 0.001; begun where the touchdown point lacks no couple."""
    problem, _ = _ring(half, 50.0, lambda g: (0.0, 0.0), lambda g: g["p"], _disturbed)
    held = {"flexibility": 1.0 / 30000.0, "gap": 0.0, "disturbance": 1e-3}
    state = problem.guess([lambda s: (np.sin(s), 2.0 * np.sin(0.5 * s)**2, s, 0.0, 0.0, 0.0), lambda s: (s, 0.0)],
                          mark=1.0, couple=0.0, p=0.5, **held)
    state = problem.solve(state, held, {"mark": 1.0, "p": 0.5})
    state = problem.zero(state, "mark", min(2.3, half - 0.01), lambda now, _: now["couple"], held | {"p": 0.5})
    return problem.limit(state, _depth, 0.3, "p", held | {"couple": 0.0}, steps=100)


def _liner(slenderness: float, gaps, disturbance: float, lobes: int):
    """Limit points at rising gaps, one after the other."""
    state = _tight_liner(math.pi / lobes)
    problem = state.problem
    held = {"flexibility": 1.0 / 30000.0, "gap": 0.0, "disturbance": 1e-3, "couple": 0.0}
    changes = [("disturbance", disturbance), ("flexibility", 1.0 / (12.0 * slenderness**2))] + [("gap", value) for value in gaps]
    for k, (name, value) in enumerate(changes):
        if value != held[name]:
            others = {what: x for what, x in held.items() if what != name}
            state = problem.go(state, name, value, others | {_depth: _depth(state)}, steps=4)
            held[name] = value
            # Still at the displacement of the limit point before: the new one is near, on the side where the load rises.
            rises = problem.tangent(state, _depth, held)["p"] > 0.0
            now = float(_depth(state))
            state = problem.limit(state, _depth, 4.0 * now if rises else 0.2 * now, "p", held, steps=30 if rises else 15)
        if k >= 2:
            assert_admissible(state, {0: problem.spans[1].obstacle(state.unknowns)}, on_left=False)
            yield Limit(float(state["p"]), float(_depth(state)), math.degrees(state.end(0).angle), state)


@functools.cache
def liner_limit(slenderness: float, liner_gap: float, disturbance: float, lobes: int = 1) -> Limit:
    """Follower pressure p R^3/EI on a liner of R/t in a host with R + gap, and the dead force p R disturbance at the apex.

    One lobe: half of the liner, which rests on the host opposite to the apex. Two: a quarter, about the host's centre.
    """
    return list(_liner(slenderness, [liner_gap], disturbance, lobes))[-1]


# Columns beside a wall ------------------------------------------------------------------------------------------------------

@dataclass(frozen=True)
class Wave:
    """Stress-free shape, a sum of a sin(k x) and of b (1 - cos(k x)); s is the abscissa x."""

    sines: tuple = ()
    cosines: tuple = ()

    def derivative(self, x, order):
        value = 0.0 * x
        for a, k in self.sines:
            value = value + a * k**order * np.sin(k * x + order * math.pi / 2)
        for b, k in self.cosines:
            value = value - b * (k**order * np.cos(k * x + order * math.pi / 2) - (1.0 if order == 0 else 0.0))
        return value

    def rate(self, x):
        return np.sqrt(1.0 + self.derivative(x, 1)**2)

    def curvature(self, x):
        return self.derivative(x, 2) / self.rate(x)**3

    def slope(self, x):
        w1, w2, w3 = (self.derivative(x, k) for k in (1, 2, 3))
        return w3 / self.rate(x)**4 - 3.0 * w1 * w2**2 / self.rate(x)**6


def _column(wave, clamped, unit, flexibility, wall, pattern):
    """Length 1, load `P` times `unit` at the end that slides; `wall`: a curve to its left.

    Pattern: free, point, line, or line and point, with the ends `first` and `second` of the line and the point `third`.
    """
    rod = Rod(flexibility=lambda g: flexibility, curvature=wave.curvature, slope=wave.slope, rate=wave.rate)

    def supports(state, last):
        a, b = state.start(0), state.end(last)
        both = [a.angle, b.angle] if clamped else [a.moment, b.moment]
        return both + [a.x, a.y, b.y, b.fx + state["P"] * unit]

    def point(state):
        return supports(state, 1) + point_contact(state.end(0), state.start(1), wall, state["sigma"], state["reaction"],
                                                  on_left=True)

    def lying(state):
        return supports(state, 2) + touchdown(state.end(0), state.start(1)) + touchdown(state.end(1), state.start(2))

    def lying_and_point(state):
        return (supports(state, 3) + touchdown(state.end(0), state.start(1)) + touchdown(state.end(1), state.start(2))
                + point_contact(state.end(2), state.start(3), wall, state["sigma"], state["reaction"], on_left=True)
                + [gap(state.end(2), wall, state["sigma"], on_left=True)])

    def free(state):
        return supports(state, 1) + joined(state.end(0), state.start(1))

    if pattern == "free":
        return Problem([Free(rod, 0.0, 0.5), Free(rod, 0.5, 1.0)], {"P": 1.0}, free, force=unit, elements=2)
    if pattern == "line":
        return Problem([Free(rod, 0.0, "first"), Conforming(rod, "first", "second", lambda g: wall, on_left=True),
                        Free(rod, "second", 1.0)], {"first": 1.0, "second": 1.0, "P": 1.0}, lying, force=unit, elements=2)
    if pattern == "line and point":
        spans = [Free(rod, 0.0, "first"), Conforming(rod, "first", "second", lambda g: wall, on_left=True),
                 Free(rod, "second", "third"), Free(rod, "third", 1.0)]
        names = {"first": 1.0, "second": 1.0, "third": 1.0, "P": 1.0, "reaction": unit, "sigma": 1.0}
        return Problem(spans, names, lying_and_point, force=unit, elements=2)
    return Problem([Free(rod, 0.0, "mark"), Free(rod, "mark", 1.0)],
                   {"mark": 1.0, "P": 1.0, "reaction": unit, "sigma": 1.0}, point, force=unit, elements=2)


def shortening(state):
    return 1.0 - state.end(len(state.problem.spans) - 1).x


def _to_the_wall(problem, wave, wall, mark):
    """The unloaded column, brought to where it touches; and its gap."""
    def shape(s):
        return s, wave.derivative(s, 0), np.arctan(wave.derivative(s, 1)), 0.0, 0.0, 0.0

    def clear(state):
        return gap(state.end(0), wall, state["sigma"], on_left=True)

    state = problem.guess([shape, shape], mark=mark, P=0.1, reaction=0.0, sigma=mark - wall.x)
    state = problem.solve(state, {"reaction": 0.0, "P": 0.1})
    return problem.zero(state, "P", 1.5, lambda now, _: clear(now), {"reaction": 0.0}, steps=40), clear


@functools.cache
def column_events(radius: float = 0.0) -> dict:
    """The column of column.inp: P/Pcr of first contact, of the limit point, of the loss of contact, least free load.

    `radius`: of a drum above its middle, which takes the wall's place; 0: a straight wall.
    """
    d = 0.02
    a2 = 0.0525 * d * 0.375 * math.sqrt(3.0)              # 3 sqrt(3)/2 sin^2 cos = 3 sqrt(3)/8 (cos pi x - cos 3 pi x)
    wave = Wave(cosines=((0.035 * d, 2.0 * math.pi), (-a2, math.pi), (a2, 3.0 * math.pi)))
    wall = Circle(0.5, d, radius, 0.0) if radius else Line(0.0, d, 0.0)
    problem = _column(wave, True, 4.0 * math.pi**2, 1.0 / 480000.0, wall, "point")
    onset, clear = _to_the_wall(problem, wave, wall, 0.45)
    limit = problem.limit(onset, shortening, 0.006, "P", {clear: 0.0}, steps=30)
    loss = problem.zero(limit, shortening, 0.02, lambda now, _: now["reaction"], {clear: 0.0}, steps=20)
    # Behind that the column goes through its second wave back under the first one: midspan goes one way only.
    problem = _column(wave, True, 4.0 * math.pi**2, 1.0 / 480000.0, wall, "free")
    free = problem.solve(problem.guess([_resampled(loss), _resampled(loss)], P=loss["P"]), {"P": loss["P"]})
    least = problem.limit(free, lambda state: state.end(0).y, -0.2, "P", steps=20)
    for state in (onset, limit, loss, least):
        assert_admissible(state, {0: wall, 1: wall}, on_left=True)
    return {"onset": onset, "limit": limit, "loss": loss, "least": least}


PINNED_WAVE, PINNED_WALL = Wave(sines=((0.0014, math.pi), (0.0004, 2.0 * math.pi))), Line(0.0, 0.02, 0.0)


def _pinned(pattern):
    return _column(PINNED_WAVE, False, math.pi**2, 1.0 / 480000.0, PINNED_WALL, pattern)


@functools.cache
def pinned_events() -> dict:
    """Pinned column beside a wall, a1/d = 0.07, a2/d = 0.02: first contact, point to line, opening of the line at its end."""
    wave, wall = PINNED_WAVE, PINNED_WALL
    problem = _pinned("point")
    onset, clear = _to_the_wall(problem, wave, wall, 0.45)

    def bend(state, _=None):
        return wave.curvature(state["mark"]) + state.end(0).moment

    spread = problem.zero(onset, "P", 5.0, bend, {clear: 0.0}, steps=16)
    # A line of no length is regular: it is opened by giving it one.
    problem, mark, half = _pinned("line"), spread["mark"], 0.005
    state = problem.guess([_resampled(spread), lambda s: (s, spread.end(0).normal_force), _resampled(spread)],
                          first=mark - half, second=mark + half, P=spread["P"])
    state = problem.solve(state, {_length: 2.0 * half})
    opening = problem.zero(state, "P", 6.0, lambda now, _: now.density(1, 1.0)[0], steps=8)
    for state, curves in ((onset, {0: wall, 1: wall}), (spread, {0: wall, 1: wall}), (opening, {0: wall, 2: wall})):
        assert_admissible(state, curves, on_left=True)
    return {"onset": onset, "spread": spread, "opening": opening}


@functools.cache
def pinned_split() -> State:
    """Behind the opening: the line ends before the place where its pressure would vanish, a point touches beyond.

    A line into the zone of length x0 where it pulls opens by a span of 5 x0/3 about its end, which is given that length.
    """
    opening, zone = pinned_events()["opening"], 0.018
    place = opening["second"]
    line = opening.problem.go(opening, "second", place + zone, {}, steps=3)
    problem = _pinned("line and point")

    def part(span):
        a, b = line.at(line.problem.spans[span].start), line.at(line.problem.spans[span].end)

        def fields(s):
            section = line.inside(span, np.clip(np.asarray((s - a) / (b - a), float), 0.0, 1.0))[1]
            return section.x, section.y, section.angle, section.moment, section.fx, section.fy
        return fields

    state = problem.guess([part(0), lambda s: (s, line.end(1).normal_force), part(1), part(2)], first=line["first"],
                          second=place - zone * 2.0 / 3.0, third=place + zone, P=line["P"], sigma=place + zone,
                          reaction=concentrated(line.end(1), line.start(2), on_left=True))
    state = problem.solve(state, {hump: zone * 5.0 / 3.0})
    _assert_split(state)
    return state


def _assert_split(state):
    assert_admissible(state, {0: PINNED_WALL, 2: PINNED_WALL, 3: PINNED_WALL}, on_left=True)


def hump(state):
    """Length of the free span between the line and the point."""
    return state["third"] - state["second"]


@functools.cache
def pinned_at(load: float) -> State:
    """On the rising path behind the opening, from P/Pcr = 5.18 to the limit load."""
    state = pinned_split()
    state = state.problem.go(state, "P", load, {}, steps=10)
    _assert_split(state)
    return state


@functools.cache
def pinned_limit() -> State:
    """The hump grows and the load falls; the line shrinks to a point later, at 17.6."""
    state = pinned_at(15.0)
    state = state.problem.limit(state, hump, 0.6, "P", steps=20)
    _assert_split(state)
    return state


def _length(state):
    return state["second"] - state["first"]


def _resampled(state):
    """Fields of two free spans as a function of s."""
    def fields(s):
        mark = state["mark"]
        parts = [state.inside(0, np.clip(s / mark, 0.0, 1.0))[1], state.inside(1, np.clip((s - mark) / (1.0 - mark), 0.0, 1.0))[1]]
        return [np.where(s <= mark, *(getattr(part, name) for part in parts)) for name in ("x", "y", "angle", "moment", "fx", "fy")]
    return fields


# A tube between plates ------------------------------------------------------------------------------------------------------

@functools.cache
def tube(flattening: float, flexibility: float = 0.0) -> State:
    """Quarter of a ring, R = 1, under a plate that comes down from y = 1 by `flattening`; the part beyond `mark` lies on it."""
    rod = Rod(flexibility=lambda g: flexibility, curvature=lambda s: 1.0 + 0.0 * s)

    def plate(g):
        return Line(0.0, 1.0 - g["down"], math.pi)

    def conditions(state):
        a, b = state.start(0), state.end(1)
        return [a.y, a.angle - math.pi / 2, a.fx] + touchdown(state.end(0), state.start(1), state["couple"]) + [b.sigma]

    problem = Problem([Free(rod, 0.0, "mark"), Conforming(rod, "mark", math.pi / 2, plate, on_left=False)],
                      {"mark": 1.0, "down": 1.0, "couple": 1.0}, conditions, force=10.0)
    # The touchdown point held at 0.3 R from the symmetry plane, about where it is at a flattening of 0.4.
    state = problem.guess([lambda s: (np.cos(s), np.sin(s) * (1.0 - 0.4 * s), s + math.pi / 2, 0.0, 0.0, -3.0),
                           lambda s: (s - math.pi / 2, 0.0)], mark=1.2, down=0.4, couple=0.0)
    state = problem.solve(state, {"mark": 1.2, "couple": 0.0})
    state = problem.go(state, "down", flattening, {"couple": 0.0}, steps=20)
    assert_admissible(state, {0: plate(state.unknowns)}, on_left=False)
    return state


def tube_force(flattening: float, flexibility: float = 0.0) -> float:
    """F of the whole tube: what lies flat is not pressed, all of it acts at the touchdown points."""
    state = tube(flattening, flexibility)
    return 2.0 * float(concentrated(state.end(0), state.start(1), on_left=False))


# Pipes and beams ------------------------------------------------------------------------------------------------------------

@functools.cache
def pipe_lift(height: float, flexibility: float = 1e-8) -> State:
    """Weight 1, length 6, held at the left end sideways, lifted at the other; `mark`: where it leaves the seabed."""
    rod = Rod(flexibility=lambda g: flexibility, dead=lambda g: (0.0, -1.0))
    seabed = Line(0.0, 0.0, 0.0)

    def conditions(state):
        a, b = state.start(0), state.end(1)
        return [a.sigma, b.moment, b.fx, b.y - state["height"]] + touchdown(state.end(0), state.start(1), state["couple"])

    problem = Problem([Conforming(rod, 0.0, "mark", lambda g: seabed, on_left=False), Free(rod, "mark", 6.0)],
                      {"mark": 1.0, "height": 1.0, "couple": 1.0}, conditions)
    state = problem.guess([lambda s: (s, 0.0), lambda s: (s, 0.0, 0.0, 0.0, 0.0, 0.0)], mark=5.0, height=0.05, couple=0.0)
    state = problem.solve(state, {"mark": 5.0, "height": 0.04})
    state = problem.solve(state, {"mark": 5.0, "couple": 0.0})
    state = problem.go(state, "height", height, {"couple": 0.0}, steps=10)
    assert_admissible(state, {1: seabed}, on_left=False)
    return state


def _wrapped(bed, rod_curvature, half, on_left, mark, force):
    """Half of a rod that lies on a circle from the plane of symmetry to `mark`, under a dead force at its end."""
    rod = Rod(flexibility=lambda g: g["flexibility"], curvature=lambda s: rod_curvature + 0.0 * s)

    def conditions(state):
        a, b = state.start(0), state.end(1)
        return [a.sigma, b.moment, b.fx, b.fy + state["force"]] + touchdown(state.end(0), state.start(1), state["couple"])

    problem = Problem([Conforming(rod, 0.0, "mark", lambda g: bed, on_left), Free(rod, "mark", half)],
                      {"mark": 1.0, "force": 1.0, "couple": 1.0, "flexibility": 1e-8}, conditions)
    k = 1.0 / bed.radius
    state = problem.guess([lambda s: (s, 0.0), lambda s: (s, 0.5 * k * s**2, k * s, k - rod_curvature, 0.0, -force)], mark=mark,
                          force=force, couple=0.0, flexibility=0.0)
    state = problem.solve(state, {"mark": mark, "force": force, "flexibility": 0.0})
    return problem.solve(state, {"mark": mark, "couple": 0.0, "flexibility": 0.0})


@functools.cache
def cradle(force: float, flexibility: float = 1e-8) -> State:
    """A rod of radius 0.5, half of it 0.6 long, in a cradle of radius 1; beyond `mark` it is free."""
    bed = Circle(0.0, 0.0, 1.0, 0.0)
    half = 0.5 * math.atan2(0.466019542983613, 0.5 - 0.318821122761663)
    return _loaded(_wrapped(bed, 2.0, half, False, 0.2, 3.0), force, flexibility, bed)


@functools.cache
def drum(force: float, flexibility: float = 1e-8) -> State:
    """A straight strip, half of it 2 long, over a drum of radius 1."""
    bed = Circle(0.0, 0.0, -1.0, 0.0)
    return _loaded(_wrapped(bed, 0.0, 2.0, False, 0.3, 0.6), force, flexibility, bed)


def _loaded(state, force, flexibility, bed):
    problem = state.problem
    state = problem.go(state, "flexibility", flexibility, {"force": state["force"], "couple": 0.0}, steps=1)
    state = problem.go(state, "force", force, {"flexibility": flexibility, "couple": 0.0}, steps=10)
    assert_admissible(state, {1: bed}, on_left=False)
    return state


@functools.cache
def indenter(w: float, flexibility: float = 1e-8) -> State:
    """Half of a beam of length 1 around a roller of radius 0.4: the middle fixed, the end on a support that has moved up by w."""
    rod = Rod(flexibility=lambda g: flexibility)
    roller = Circle(0.0, 0.0, 0.4, 0.0)

    def conditions(state):
        a, b = state.start(0), state.end(1)
        return [a.sigma, b.moment, b.fx, b.y - state["w"]] + touchdown(state.end(0), state.start(1), state["couple"])

    problem = Problem([Conforming(rod, 0.0, "mark", lambda g: roller, on_left=True), Free(rod, "mark", 0.5)],
                      {"mark": 1.0, "w": 1.0, "couple": 1.0}, conditions, force=10.0)
    state = problem.guess([lambda s: (s, 0.0), lambda s: (s, s**2, 2.0 * s, 1.0, 0.0, 5.0)], mark=0.05, w=0.23, couple=0.0)
    state = problem.solve(state, {"mark": 0.05, "w": 0.22})
    state = problem.solve(state, {"mark": 0.05, "couple": 0.0})
    state = problem.go(state, "w", w, {"couple": 0.0}, steps=10)
    assert_admissible(state, {1: roller}, on_left=True)
    return state


@functools.cache
def clamped_strip(load: float, flexibility: float = 1e-6) -> State:
    """Half of a strip of length 1, clamped, its half gap 0.1, lying on a straight wall beyond `mark` under the load P.

    A uniform rod between a clamp and a line may shift along itself, so the moment vanishes at the clamp as it does at the
    line. That takes the place of the angle at the line, which has a double root: `kink`, what is missing there, vanishes.
    """
    rod = Rod(flexibility=lambda g: flexibility)
    wall = Line(0.0, 0.1, 0.0)

    def conditions(state):
        a, b = state.start(0), state.end(1)
        lying = touchdown(state.end(0), state.start(1))
        lying[2] -= state["kink"]
        return [a.x, a.y, a.angle, a.moment, b.normal_force + state["P"]] + lying

    problem = Problem([Free(rod, 0.0, "mark"), Conforming(rod, "mark", 0.5, lambda g: wall, on_left=True)],
                      {"mark": 1.0, "P": 100.0, "kink": 1.0}, conditions, force=100.0)
    k = math.sqrt(160.0)
    mark = 2.0 * math.pi / k
    state = problem.guess([lambda s: (s, 0.1 * (s / mark - np.sin(k * s) / (2.0 * math.pi)), 0.1 / mark * (1.0 - np.cos(k * s)),
                                      0.1 / mark * k * np.sin(k * s), -160.0, -16.0 / mark), lambda s: (s, -160.0)],
                          mark=mark, P=160.0, kink=0.0)
    state = problem.solve(state, {"P": 160.0})
    state = problem.go(state, "P", load, {}, steps=10)
    assert abs(state["kink"]) < 1e-9
    assert_admissible(state, {0: wall}, on_left=True)
    return state


# The table of liners --------------------------------------------------------------------------------------------------------

def liner_table() -> dict[tuple[int, int, float, float], float]:
    """Stored limit loads by R/t, lobes, disturbance and gap."""
    with open(TABLE, newline="", encoding="utf-8") as file:
        rows = csv.DictReader(line for line in file if not line.startswith("#"))
        return {(int(row["R_t"]), int(row["lobes"]), float(row["disturbance"]), float(row["gap"])): float(row["p"]) for row in rows}


def main():
    with open(TABLE, "w", newline="", encoding="utf-8") as file:
        file.write("# Limit points of liners in a rigid host: follower pressure p R^3/EI, EA R^2/EI = 12 (R/t)^2; dead force\n"
                   "# p R disturbance on the half (quarter) at the apex; gap over R; v: displacement of the apex over R; angle:\n"
                   "# of the touchdown point in degrees. Written by tests/contact_cases.py\n")
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(["R_t", "lobes", "disturbance", "gap", "p", "v", "angle"])
        for slenderness in SLENDERNESS:
            for lobes in LOBES:
                for disturbance in DISTURBANCES:
                    for clear, limit in zip(GAPS, _liner(slenderness, GAPS, disturbance, lobes)):
                        rows.writerow([slenderness, lobes, disturbance, clear, f"{limit.load:.12g}", f"{limit.monitor:.8g}",
                                       f"{limit.angle:.8g}"])
                file.flush()


if __name__ == "__main__":
    main()

"""The ring in a tensionless Winkler medium, k R^4/EI from soft to as good as rigid: by the solver of contact_reference.py.

Half of it, R = EI = 1, dead load p; the medium pushes on the ring along the radius by k times the penetration, per stress-free
length. Lift-off points, where the gap is zero, are unknowns; behind the first one stiff media have further gaps.

    state = ring(1e4, 100.0, v=0.02); state["p"]
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from contact_reference import Free, Problem, Rod, joined


@dataclass(frozen=True)
class Resting(Free):
    """A span whose medium is compressed: the circle of radius 1 about (0, 1)."""

    def rates(self, s, u, g):
        x, y = u[0], u[1] - 1.0
        radius = np.sqrt(x * x + y * y)
        push = np.exp(g["log_k"]) * (radius - 1.0) / radius
        free = Free(self.rod, self.start, self.end).rates(s, u, g)
        free[4] += push * x
        free[5] += push * y
        return free


def clear(section):
    """Gap of a section, negative where the medium is compressed."""
    return 1.0 - np.sqrt(section.x**2 + (section.y - 1.0)**2)


def problem(gaps: int):
    """`gaps` free spans, the first at the apex; each is followed by one that rests."""
    rod = Rod(flexibility=lambda g: g["flexibility"], dead=lambda g: (0.0, g["p"]), curvature=lambda s: 1.0 + 0.0 * s)
    marks = [f"mark{k}" for k in range(2 * gaps - 1)]
    bounds = [0.0, *marks, "layer", math.pi]
    spans = [Free(rod, a, b) if k % 2 == 0 and k < 2 * gaps else Resting(rod, a, b)
             for k, (a, b) in enumerate(zip(bounds, bounds[1:]))]

    def conditions(state):
        first, last = state.start(0), state.end(len(spans) - 1)
        rows = [first.x, first.angle, first.fy, last.x, last.angle - math.pi, last.fy]
        for k in range(len(spans) - 1):
            rows += joined(state.end(k), state.start(k + 1))
        rows += [clear(state.end(k)) - (state["slack"] if k == 0 else 0.0) for k in range(len(marks))]
        # The medium's own length divides what rests behind the last gap.
        reach = 8.0 * np.exp(-0.25 * (state["log_k"] - math.log(4.0)))
        behind = math.pi - state[marks[-1]]
        return rows + [state["layer"] - state[marks[-1]] - behind * reach / (reach + behind)]

    names = {**dict.fromkeys(marks, 1.0), "layer": 1.0, "p": 10.0, "log_k": 1.0, "flexibility": 1e-5, "slack": 1e-3}
    return Problem(spans, names, conditions, force=10.0), marks


def depth(state):
    """How far the apex has moved inwards."""
    return state.start(0).y


def start(slenderness: float, k: float = 1e3):
    held = {"flexibility": 1.0 / (12.0 * slenderness**2), "log_k": math.log(k)}
    one, _ = problem(1)

    def shape(s):
        return np.sin(s), 2.0 * np.sin(0.5 * s)**2, s, 0.0, 0.0, 0.0

    state = one.guess([shape] * 3, mark0=0.8, layer=1.5, p=0.1, slack=0.0, **held)
    state = one.solve(state, held, {"mark0": 0.8, "p": 0.1})
    return one.zero(state, "mark0", 1.8, lambda now, _: now["slack"], held | {"p": 0.1}, steps=20), held


def _inside(state, s):
    """Fields at a material coordinate."""
    spans = state.problem.spans
    ends = np.array([float(state.at(span.end)) for span in spans])
    values = np.empty((6, np.size(s)))
    for j, at in enumerate(np.atleast_1d(s)):
        k = min(int(np.searchsorted(ends, at)), len(spans) - 1)
        a, b = float(state.at(spans[k].start)), ends[k]
        section = state.inside(k, np.array([(at - a) / (b - a)]))[1]
        values[:, j] = [float(part[0]) for part in (section.x, section.y, section.angle, section.moment, section.fx, section.fy)]
    return values


def lifted(state):
    """Where, behind the last gap, the medium pulls: (from, to); None: nowhere."""
    tau = np.linspace(0.001, 0.999, 2001)
    for k, span in enumerate(state.problem.spans):
        if isinstance(span, Resting):
            s, section = state.inside(k, tau)
            pulls = clear(section) > 0.0
            if np.any(pulls):
                return float(s[pulls][0]), float(s[pulls][-1])
    return None


def with_gap(state, stretch):
    """The same with one more gap there."""
    gaps = (len(state.problem.spans) - 1) // 2 + 1
    new, marks = problem(gaps)
    values = {name: state[name] for name in state.problem.names}
    values[marks[-2]], values[marks[-1]] = stretch
    values["layer"] = stretch[1] + (math.pi - stretch[1]) * 0.3
    guess = new.guess([lambda s: _inside(state, s)] * len(new.spans), **values)
    return guess


def ring(slenderness: float, k: float, v: float):
    """The state at a depth v of the apex, and its patterns of contact checked."""
    state, held = start(slenderness)
    held = held | {"slack": 0.0}
    free = {name: value for name, value in held.items() if name != "log_k"}
    state = state.problem.go(state, depth, 0.005, held, steps=10)
    goal = math.log(k)
    step = math.copysign(0.5, goal - state["log_k"])
    while abs(goal - state["log_k"]) > 1e-9:
        to = goal if abs(goal - state["log_k"]) < abs(step) else state["log_k"] + step
        state = settled(state.problem.go(state, "log_k", to, free | {depth: 0.005}, steps=2), free | {depth: 0.005, "log_k": to})
    held = free | {"log_k": goal}
    while abs(depth(state) - v) > 1e-12:
        to = min(v, float(depth(state)) + 0.0025)
        state = settled(state.problem.go(state, depth, to, held, steps=1), held | {depth: to})
    return state


def settled(state, constraints):
    """With as many gaps as it takes."""
    while (stretch := lifted(state)) is not None:
        state = with_gap(state, stretch)
        state = state.problem.solve(state, constraints)
    return state


def limit(state, to: float):
    """The limit load on the way from a state to a depth of the apex; None: the load only rises."""
    held = {name: state[name] for name in ("flexibility", "log_k", "slack")}
    while depth(state) < to - 1e-12:
        ahead = min(to, float(depth(state)) + 0.005)
        here = state.problem.tangent(state, depth, held)["p"]
        new = settled(state.problem.go(state, depth, ahead, held, steps=1), held | {depth: ahead})
        if here * new.problem.tangent(new, depth, held)["p"] < 0.0:
            # Both with the patterns of the later one, so that they are one problem.
            back = new.problem.go(new, depth, float(depth(state)), held, steps=1)
            found = new.problem.limit(back, depth, ahead, "p", held, steps=1)
            assert lifted(found) is None or len(found.problem.spans) > 3
            return found["p"]
        state = new
    return None

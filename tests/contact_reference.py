"""Rods in rigid contact whose pattern of contact is known: a boundary-value solver with touchdown points as unknowns, to 1e-11.

The exact shear-rigid, extensible rod of the material coordinate s, with N = n.t, Q = n.nu and the dead load q, pressure p (to the
left, per deformed length):

    r' = (1 + N/EA) t,  theta' = kappa0 + M/EI,  M' = -(1 + N/EA) Q,  n' = -q - p (1 + N/EA) nu        free span
    sigma' = 1 + N/EA,  theta' = k(sigma) sigma',  N' = theta' Q - q.t with Q = -M'/sigma'             conforming span

sigma is the arc length along the obstacle's curve in the rod's sense, k the curvature there. A rod is a chain of such spans,
each with polynomials at Chebyshev points; what holds at their ends, in terms of sections and named unknowns (places of
touchdown points, loads, ...), is said case by case in contact_cases.py. Collocation at Gauss points, Newton's method with
derivatives by complex steps: it shares nothing with the program. Residuals are summed with extended precision where the machine
has it: the normal force of a slender rod is EA times differences of lengths.

    state = problem.solve(problem.guess(...), {"p": 1.0}, {moment_jump: 0.0})      # a name or function of the state, its value
    limit = problem.limit(state, "v", to=0.05, load="p")
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable

import numpy as np

ELEMENTS = 4        # of a span
DEGREE = 14
STEP = 1e-30        # of complex differentiation: no difference is formed, so any tiny one does
FINE = 1e-13        # Newton's last correction, scaled; or where rounding stops it, if that is below COARSE
COARSE = 1e-7
QUADRATIC = 1e-4    # of the correction before: the next one would be smaller by the square of this, and so below FINE


# Obstacles ---------------------------------------------------------------------------------------------------------------

@dataclass(frozen=True)
class Line:
    """From (x, y), which is sigma = 0, in the direction `angle`."""

    x: complex
    y: complex
    direction: float

    def place(self, sigma):
        return self.x + sigma * np.cos(self.direction), self.y + sigma * np.sin(self.direction)

    def angle(self, sigma):
        return self.direction + 0.0 * sigma

    def curvature(self, sigma):
        return 0.0 * sigma

    slope = curvature


@dataclass(frozen=True)
class Circle:
    """From (x, y), which is sigma = 0, in the direction `direction`; the signed radius is positive where the curve turns left.

    Said by a point of it, not by its centre: positions beside that point keep all their digits.
    """

    x: complex
    y: complex
    radius: complex
    direction: float

    def angle(self, sigma):
        return self.direction + sigma / self.radius

    def place(self, sigma):
        along, left = self.radius * np.sin(sigma / self.radius), 2.0 * self.radius * np.sin(0.5 * sigma / self.radius)**2
        c, d = np.cos(self.direction), np.sin(self.direction)
        return self.x + along * c - left * d, self.y + along * d + left * c

    def curvature(self, sigma):
        return 1.0 / self.radius + 0.0 * sigma

    def slope(self, sigma):
        return 0.0 * sigma


# Rods and spans ----------------------------------------------------------------------------------------------------------

@dataclass(frozen=True)
class Rod:
    """Functions of the named unknowns g or of the material coordinate s. Where s is not the arc length, `rate` is its change."""

    flexibility: Callable = lambda g: 0.0            # 1/EA
    dead: Callable = lambda g: (0.0, 0.0)            # per stress-free length
    pressure: Callable = lambda g: 0.0
    curvature: Callable = lambda s: 0.0 * s          # stress-free
    slope: Callable = lambda s: 0.0 * s              # its derivative by the arc length
    rate: Callable = lambda s: 1.0 + 0.0 * s
    stiffness: float = 1.0                           # EI


@dataclass(frozen=True)
class Section:
    """Of a span, at one or many places."""

    x: np.ndarray
    y: np.ndarray
    angle: np.ndarray
    moment: np.ndarray
    fx: np.ndarray
    fy: np.ndarray
    sigma: np.ndarray | None = None

    @property
    def normal_force(self):
        return self.fx * np.cos(self.angle) + self.fy * np.sin(self.angle)

    @property
    def shear_force(self):
        return self.fy * np.cos(self.angle) - self.fx * np.sin(self.angle)


@dataclass(frozen=True)
class Free:
    """x, y, theta, M, n between two ends, each a number or the name of an unknown."""

    rod: Rod
    start: float | str
    end: float | str
    fields = 6

    def section(self, s, u, g):
        return Section(*u)

    def rates(self, s, u, g):
        rod, (_, _, angle, moment, fx, fy) = self.rod, u
        c, d = np.cos(angle), np.sin(angle)
        stretch = 1.0 + rod.flexibility(g) * (fx * c + fy * d)
        (qx, qy), p = rod.dead(g), rod.pressure(g) * stretch
        return rod.rate(s) * np.array([stretch * c, stretch * d, rod.curvature(s) + moment / rod.stiffness,
                                       stretch * (fx * d - fy * c), p * d - qx, -p * c - qy])


@dataclass(frozen=True)
class Conforming:
    """sigma and N between two ends on `obstacle(g)`, which lies to the left of the rod or to its right."""

    rod: Rod
    start: float | str
    end: float | str
    obstacle: Callable
    on_left: bool
    fields = 2

    def _forces(self, s, u, g):
        """Curve, stretch, M, N' and Q."""
        rod, curve, (sigma, normal) = self.rod, self.obstacle(g), u
        flexibility, (qx, qy) = rod.flexibility(g), rod.dead(g)
        angle, k = curve.angle(sigma), curve.curvature(sigma)
        stretch = 1.0 + flexibility * normal
        moment = rod.stiffness * (k * stretch - rod.curvature(s))
        bend = curve.slope(sigma) * stretch**2 - rod.slope(s)              # of theta'', without the part k N'/EA
        change = (-k * rod.stiffness * bend - qx * np.cos(angle) - qy * np.sin(angle)) / (1.0 + rod.stiffness * flexibility * k**2)
        return curve, stretch, moment, change, -rod.stiffness * (bend + k * flexibility * change) / stretch

    def section(self, s, u, g):
        curve, _, moment, _, shear = self._forces(s, u, g)
        angle = curve.angle(u[0])
        c, d = np.cos(angle), np.sin(angle)
        return Section(*curve.place(u[0]), angle, moment, u[1] * c - shear * d, u[1] * d + shear * c, u[0])

    def rates(self, s, u, g):
        _, stretch, _, change, _ = self._forces(s, u, g)
        return self.rod.rate(s) * np.array([stretch + 0.0 * change, change])


# Problems ----------------------------------------------------------------------------------------------------------------

class State:
    """Values of a problem's unknowns: `state["p"]`, or a section at an end: `state.start(0)`, `state.end(1)`."""

    def __init__(self, problem, fields, unknowns):
        self.problem, self.fields, self.unknowns = problem, fields, unknowns

    def __getitem__(self, name):
        return self.unknowns[name]

    def at(self, bound):
        return self.unknowns[bound] if isinstance(bound, str) else bound

    def start(self, span):
        part = self.problem.spans[span]
        return part.section(self.at(part.start), self.fields[span][:, 0], self.unknowns)

    def end(self, span):
        part = self.problem.spans[span]
        return part.section(self.at(part.end), self.fields[span][:, -1], self.unknowns)

    def inside(self, span, tau):
        """Material coordinates and sections at fractions of a span."""
        part = self.problem.spans[span]
        s = self.at(part.start) + (self.at(part.end) - self.at(part.start)) * tau
        return s, part.section(s, self.fields[span] @ self.problem.grid.interpolation(tau).T, self.unknowns)

    def density(self, span, tau=None):
        """Reaction per stress-free length at fractions of a conforming span (None: at its collocation points)."""
        part, grid, g = self.problem.spans[span], self.problem.grid, self.unknowns
        a, b = self.at(part.start), self.at(part.end)
        along = part.section(a + (b - a) * grid.nodes, self.fields[span], g)
        tau = grid.places if tau is None else np.atleast_1d(tau)
        s, section = self.inside(span, tau)
        slope = grid.interpolation(tau, derivative=True) / ((b - a) * part.rod.rate(s))[:, None]
        (qx, qy), stretch = part.rod.dead(g), 1.0 + part.rod.flexibility(g) * section.normal_force
        load = qy * np.cos(section.angle) - qx * np.sin(section.angle) + part.rod.pressure(g) * stretch
        left = -(slope @ along.shear_force) - (slope @ along.angle) * section.normal_force - load
        return -left if part.on_left else left


class Problem:
    """Spans, unknowns {name: typical size} and conditions: a function of the state that gives what must vanish.

    `force`: typical size of forces. As many constraints as the problem has degrees of freedom go with each solution:
    {name or function of the state: value}.
    """

    def __init__(self, spans, names, conditions, force=1.0, elements=ELEMENTS, degree=DEGREE):
        self.spans, self.names, self.conditions = spans, list(names), conditions
        self.grid = Grid(elements, degree)
        self.sizes = {6: np.array([1.0, 1.0, 1.0, 1.0, force, force]), 2: np.array([1.0, force])}
        self.scale = np.concatenate([np.repeat(self.sizes[span.fields], self.grid.size) for span in spans]
                                    + [np.array(list(names.values()), float)])

    def guess(self, fields, **unknowns) -> State:
        """From functions of s with a span's fields, or with the sections of another state's span."""
        values = {name: unknowns[name] for name in self.names}
        state = State(self, [], values)
        for span, function in zip(self.spans, fields):
            a, b = state.at(span.start), state.at(span.end)
            state.fields.append(np.array([f + 0.0 * self.grid.nodes for f in function(a + (b - a) * self.grid.nodes)]))
        return state

    def _pack(self, state):
        return np.concatenate([u.ravel() for u in state.fields] + [[state.unknowns[name] for name in self.names]])

    def _unpack(self, vector) -> State:
        fields, first = [], 0
        for span in self.spans:
            last = first + span.fields * self.grid.size
            fields.append(vector[first:last].reshape(span.fields, -1))
            first = last
        return State(self, fields, dict(zip(self.names, vector[first:])))

    def _changes(self, span, middle, g, places):
        """What the rates let a span's fields change by, per length of the span; `middle`: fields at the collocation points."""
        a, b = (g[bound] if isinstance(bound, str) else bound for bound in (span.start, span.end))
        return (b - a) * span.rates(a + (b - a) * places, middle, g)

    def _residual(self, state, constraints):
        """Of the rates, an array a span, and of the conditions and constraints."""
        grid = self.grid
        return ([u @ grid.derivative.T - self._changes(span, u @ grid.mean.T, state.unknowns, grid.places)
                 for span, u in zip(self.spans, state.fields)], self._tail(state, constraints))

    def _tail(self, state, constraints):
        return np.array(list(self.conditions(state)) + [value_of(state, what) - value for what, value in constraints.items()])

    def _by_fields(self, span, middle, g):
        """Derivatives of a span's residual: [element, equation, place, field, node of the element]."""
        grid, m = self.grid, span.fields
        moved = np.repeat(middle.astype(complex)[:, None, :], m, axis=1)
        moved[range(m), range(m)] += 1j * STEP
        by_field = self._changes(span, moved, g, grid.places_rounded).imag / STEP
        by_field = by_field.reshape(m, m, grid.elements, grid.degree).transpose(2, 0, 3, 1)
        blocks = -by_field[..., None] * grid.mean_rounded[:, None, :]
        blocks[:, range(m), :, range(m), :] += grid.derivative_rounded
        return blocks

    def _by_unknowns(self, span, middle, g):
        """Derivatives of a span's residual: [element, equation, place, unknown]."""
        grid, count = self.grid, len(self.names)
        moved = {name: np.full((count, 1), g[name], complex) for name in self.names}
        for k, name in enumerate(self.names):
            moved[name][k] += 1j * STEP
        change = self._changes(span, np.repeat(middle[:, None, :], count, axis=1), moved, grid.places_rounded)
        change = np.broadcast_to(change, (span.fields, count, len(grid.places))).imag / -STEP
        return change.reshape(span.fields, count, grid.elements, grid.degree).transpose(2, 0, 3, 1)

    def _tail_by_all(self, state, g, constraints):
        """Derivatives of conditions and constraints by the fields at the starts of spans, at their ends, and by the unknowns."""
        count, column, fields = 2 * sum(span.fields for span in self.spans) + len(self.names), 0, []
        for span, u in zip(self.spans, state.fields):
            moved = np.repeat(u[:, [0, -1]].astype(complex)[:, :, None], count, axis=2)
            for side in (0, 1):
                moved[range(span.fields), side, range(column, column + span.fields)] += 1j * STEP
                column += span.fields
            fields.append(moved)
        unknowns = {name: np.full(count, g[name], complex) for name in self.names}
        for k, name in enumerate(self.names):
            unknowns[name][column + k] += 1j * STEP
        other = State(self, fields, unknowns)
        rows = list(self.conditions(other)) + [value_of(other, what) for what in constraints]
        return np.array([np.broadcast_to(np.imag(row), count) for row in rows]) / STEP

    def _newton(self, state, constraints, residual, tail):
        """The scaled change that takes residual and tail away. Derivatives need no more than double precision.

        In each element the places after its first one are eliminated; what is left are the places between elements.
        """
        grid, count = self.grid, len(self.names)
        g = {name: float(value) for name, value in state.unknowns.items()}
        by_all = self._tail_by_all(state, g, constraints)
        unknown_scale, size = self.scale[len(self.scale) - count:], count + (grid.elements + 1) * sum(s.fields for s in self.spans)
        columns = sum(span.fields for span in self.spans) * grid.size + count
        equations = columns - count - sum(span.fields for span in self.spans) + len(tail)
        assert equations == columns, f"{equations} equations for {columns} unknowns"
        matrix, right = np.zeros((size, size)), np.zeros(size)
        last, parts, first, column = size - len(tail), [], 0, 0
        for span, u, missing in zip(self.spans, state.fields, residual):
            m, n = span.fields, grid.degree * span.fields
            middle = (u @ grid.mean.T).astype(float)
            scale = self.sizes[m]
            blocks = self._by_fields(span, middle, g) * scale[:, None]
            missing = missing.astype(float).reshape(m, grid.elements, grid.degree).transpose(1, 0, 2).reshape(grid.elements, n, 1)
            by_unknowns = (self._by_unknowns(span, middle, g) * unknown_scale).reshape(grid.elements, n, count)
            others = np.concatenate([blocks[..., 0].reshape(grid.elements, n, m), by_unknowns, missing], axis=2)
            part = -np.linalg.solve(blocks[..., 1:].reshape(grid.elements, n, n), others)
            part = part.reshape(grid.elements, m, grid.degree, m + count + 1)
            for k in range(grid.elements):
                here, there = slice(first + k * m, first + (k + 1) * m), slice(first + (k + 1) * m, first + (k + 2) * m)
                row = slice(first + k * m - column, first + (k + 1) * m - column)
                matrix[row, there] = np.eye(m)
                matrix[row, here] = -part[k, :, -1, :m]
                matrix[row, size - count:] = -part[k, :, -1, m:m + count]
                right[row] = part[k, :, -1, -1]
            at = 2 * column
            matrix[last:, first:first + m] = by_all[:, at:at + m] * scale
            matrix[last:, first + grid.elements * m:first + (grid.elements + 1) * m] = by_all[:, at + m:at + 2 * m] * scale
            parts.append((part, first))
            first, column = first + (grid.elements + 1) * m, column + m
        matrix[last:, size - count:] = by_all[:, 2 * column:] * unknown_scale
        right[last:] = -tail
        largest = np.max(np.abs(matrix), axis=1)
        between = np.linalg.solve(matrix / largest[:, None], right / largest)
        unknowns, pieces = between[size - count:], []
        for part, first in parts:
            m = part.shape[1]
            starts = between[first:first + grid.elements * m].reshape(grid.elements, m)
            along = np.concatenate([starts, np.tile(np.append(unknowns, 1.0), (grid.elements, 1))], axis=1)
            inside = np.einsum("emda,ea->med", part, along).reshape(m, -1)
            pieces.append(np.concatenate([starts[0][:, None], inside], axis=1).ravel())
        return np.concatenate(pieces + [unknowns])

    def solve(self, state: State, *constraints: dict, iterations: int = 25) -> State:
        """Newton's method; raises ArithmeticError where it does not converge."""
        wanted = {what: value for part in constraints for what, value in part.items()}
        vector, before = self._pack(state).astype(np.longdouble), np.inf
        for _ in range(iterations):
            now_at = self._unpack(vector)
            try:
                change = self._newton(now_at, wanted, *self._residual(now_at, wanted))
            except np.linalg.LinAlgError as singular:
                raise ArithmeticError("singular") from singular
            now = np.max(np.abs(change))
            if not np.isfinite(now) or now > 1e3:
                break
            vector = vector + self.scale * change
            if now < FINE or (now < COARSE and (now > 0.3 * before or now < QUADRATIC * before)):
                return self._unpack(vector)
            before = now
        raise ArithmeticError("Newton's method does not converge")

    def tangent(self, state: State, control, fixed: dict) -> State:
        """Derivatives by the control while the other constraints hold."""
        wanted = fixed | {control: value_of(state, control)}
        still = [np.zeros((span.fields, len(self.grid.places))) for span in self.spans]
        tail = np.zeros(len(self._tail(state, wanted)))
        tail[-1] = -1.0
        return self._unpack(self.scale * self._newton(state, wanted, still, tail))

    def walk(self, state: State, control, to: float, fixed: dict, steps: int = 10):
        """Yields (state, tangent) up to the control's value; steps are halved where Newton's method fails."""
        step = (to - value_of(state, control)) / steps
        tangent = self.tangent(state, control, fixed)
        while abs(to - value_of(state, control)) > 1e-12 * abs(to):
            now = value_of(state, control)
            length = step if abs(to - now) > 1.001 * abs(step) else to - now
            try:
                new = self.solve(self._unpack(self._pack(state) + length * self._pack(tangent)), fixed, {control: now + length},
                                 iterations=8)
                after = self.tangent(new, control, fixed)
            except ArithmeticError:
                step = 0.5 * length
                if abs(step) < 1e-9 * (abs(to) + abs(now)):
                    raise
                continue
            state, tangent = new, after
            yield state, tangent

    def go(self, state: State, control, to: float, fixed: dict, steps: int = 10) -> State:
        for state, _ in self.walk(state, control, to, fixed, steps):
            pass
        return state

    def limit(self, state: State, control, to: float, load, fixed: dict | None = None, steps: int = 20) -> State:
        """The first extremum of the load on the way of the control."""
        return self.zero(state, control, to, lambda _, tangent: tangent[load], fixed, steps)

    def zero(self, state: State, control, to: float, test, fixed: dict | None = None, steps: int = 20) -> State:
        """The first zero of test(state, tangent) on the way, by the Illinois rule."""
        fixed = fixed or {}
        low = state, self.tangent(state, control, fixed)
        for high in self.walk(state, control, to, fixed, steps):
            if test(*low) * test(*high) <= 0.0:
                break
            low = high
        else:
            raise ArithmeticError("the test function keeps its sign")
        a, b = value_of(low[0], control), value_of(high[0], control)
        fa, fb = test(*low), test(*high)
        for _ in range(60):
            middle = b - fb * (b - a) / (fb - fa)
            new = self.solve(high[0], fixed, {control: middle})
            f = test(new, self.tangent(new, control, fixed))
            if f * fb < 0.0:
                a, fa = b, fb
            else:
                fa *= 0.5
            done = abs(middle - b) < 1e-11 * abs(b) or f == 0.0
            b, fb, high = middle, f, (new, None)
            if done:
                break
        return high[0]


def value_of(state: State, what):
    return state[what] if isinstance(what, str) else what(state)


# What holds where spans meet ---------------------------------------------------------------------------------------------

def joined(left: Section, right: Section, fields=("x", "y", "angle", "moment", "fx", "fy")):
    return [getattr(left, field) - getattr(right, field) for field in fields]


def touchdown(left: Section, right: Section, couple=0.0):
    """Five conditions between a free span and a conforming one: the obstacle gives neither a couple nor a tangential force.

    `couple`: an unknown that takes it up where the touchdown point is held, to find a state to start from.
    """
    return joined(left, right, ("x", "y", "angle")) + [left.moment - right.moment - couple, left.normal_force - right.normal_force]


def point_contact(left: Section, right: Section, curve, sigma, reaction, on_left: bool):
    """Eight conditions between two free spans; a gap is not among them, so that the contact may be one to be."""
    x, y = curve.place(sigma)
    c, d = np.cos(left.angle), np.sin(left.angle)
    push = -reaction if on_left else reaction
    return joined(left, right, ("x", "y", "angle", "moment")) + [
        right.fx - left.fx - push * d, right.fy - left.fy + push * c,
        left.angle - curve.angle(sigma), (left.x - x) * c + (left.y - y) * d]


def gap(section: Section, curve, sigma, on_left: bool):
    """Distance of a section from the curve at sigma, where it is parallel to it; positive on the free side."""
    x, y = curve.place(sigma)
    left = (section.y - y) * np.cos(section.angle) - (section.x - x) * np.sin(section.angle)
    return -left if on_left else left


def concentrated(left: Section, right: Section, on_left: bool):
    """Reaction at a touchdown point, positive in compression."""
    jump = right.shear_force - left.shear_force
    return jump if on_left else -jump


# Polynomials -------------------------------------------------------------------------------------------------------------

class Grid:
    """Equal elements on [0, 1] with Chebyshev points, end points shared; collocation at Gauss points.

    `nodes`: places of the values; `places`: of collocation; `mean` and `derivative` lead from the first to the second.
    """

    def __init__(self, elements: int, degree: int):
        pi = np.arccos(np.longdouble(-1.0))
        x = np.sin(0.5 * pi * np.arange(degree + 1) / degree)**2
        gauss = 0.5 + 0.5 * np.polynomial.legendre.leggauss(degree)[0]
        self.elements, self.degree, self.x = elements, degree, x
        self.weights = np.where((np.arange(degree + 1) % degree) == 0, 0.5, 1.0) * (-1.0)**np.arange(degree + 1)
        self.size = elements * degree + 1
        self.nodes = np.append(np.concatenate([(k + x[:-1]) / elements for k in range(elements)]), 1.0)
        self.places = np.concatenate([(k + gauss) / elements for k in range(elements)])
        self.mean = self.interpolation(self.places)
        self.derivative = self.interpolation(self.places, derivative=True)
# Of one element: all of them are alike.
        self.places_rounded = self.places.astype(float)
        self.mean_rounded = self.mean[:degree, :degree + 1].astype(float)
        self.derivative_rounded = self.derivative[:degree, :degree + 1].astype(float)

    def _differentiation(self):
        difference = self.x[:, None] - self.x[None, :] + np.eye(self.degree + 1)
        d = self.weights[None, :] / self.weights[:, None] / difference
        d -= np.diag(np.diag(d))
        return d - np.diag(np.sum(d, axis=1))

    def _one(self, at):
        """Values at places of one element, by the barycentric formula."""
        difference = at[:, None] - self.x[None, :]
        exact = difference == 0.0
        b = self.weights / np.where(exact, 1.0, difference)
        b = np.where(np.any(exact, axis=1)[:, None], exact, b)
        return b / np.sum(b, axis=1)[:, None]

    def interpolation(self, tau, derivative=False):
        """Matrix from the values at the nodes to those, or the derivatives, at fractions of the span."""
        tau = np.atleast_1d(tau)
        matrix = np.zeros((len(tau), self.size), np.longdouble)
        element = np.clip((tau * self.elements).astype(int), 0, self.elements - 1)
        change = self.elements * self._differentiation() if derivative else np.eye(self.degree + 1)
        for k in range(self.elements):
            rows = np.flatnonzero(element == k)
            if rows.size:
                matrix[rows, k * self.degree:(k + 1) * self.degree + 1] = self._one(tau[rows] * self.elements - k) @ change
        return matrix

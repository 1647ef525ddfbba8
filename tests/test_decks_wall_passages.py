"""Columns beside walls, to 20 times their critical load: what opens, passes or shrinks where next to nothing holds it.

Spans from wall to wall, and from a clamp to a wall, may go along straight walls at no cost but for imperfections and side loads.
References are geometrically exact rods of their own: each span is integrated, and what its ends have to meet is solved for.
"""
import functools
import math
from collections.abc import Callable

import numpy as np
import pytest

import deck_runner as dr

pytestmark = dr.once_in_release

COLUMN = """*HEADING
Column beside a wall
*NODE
1, 0., 0.
3, 1., 0.
*LINE, ELSET=C, NSET=C, TYPE=GE8
1, 3{mesh}
{shape}*BEAM SECTION, ELSET=C, SECTION=STIFFNESS
{axial!r}, 1.
*BOUNDARY
{supports}
{walls}*MONITOR, NAME=shortening
3, U1, -1.
*STEP
*ACCURACY, {accuracy}
*STATIC{method}
*CLOAD
3, 1, {unit!r}
{across}*STOP
LOAD, ABOVE, 20.
*CONTROLS, POINTS=1000
*END STEP
"""
SUPPORTS = {"clamped-hinged": "1, ENCASTRE\n3, 2"}
UNIT = {"clamped-hinged": 2.0457483 * math.pi**2}
ABOVE = "*OBSTACLE, NAME=UP, TYPE=LINE\n1., {0!r}, 0., {0!r}\n*CONTACT, OBSTACLE=UP, NSET=C\n"
BELOW = "*OBSTACLE, NAME=LOW, TYPE=LINE\n0., {0!r}, 1., {0!r}\n*CONTACT, OBSTACLE=LOW, NSET=C\n"


@functools.cache
def column(ends, axial, above, below=None, waves=(), across=0.0, tolerance=None, elements=None, displacement=None, first=0.1, code=0):
    """The deck of a column with an imperfection of sine waves (amplitude, number), or a side load, and a mesh of its own or not."""
    unit = UNIT[ends]
    return dr.run_deck(COLUMN.format(
        mesh="" if elements is None else f", {elements}",
        shape="".join(["*IMPERFECTION, ELSET=C, SHAPE=SINE\n", *[f"{a!r}, {m}\n" for a, m in waves]]) if waves else "",
        axial=axial, supports=SUPPORTS[ends], unit=-unit, walls=ABOVE.format(above) + (BELOW.format(below) if below else ""),
        accuracy="POINTS=ALL, WIDEST=1." if tolerance is None else f"TOLERANCE={tolerance!r}, POINTS=ALL",
        method=f"\n{first}" if displacement is None else f", METHOD=DISPLACEMENT, MONITOR=shortening\n{displacement}",
        across=f"*DLOAD\nC, PY, {across!r}\n" if across else ""), code=code)


def labels(run):
    return [c.label for c in run.results.critical]


class Rod:
    """A rod of EI = 1 whose stress-free shape has sine waves, under thrust."""

    def __init__(self, axial, waves):
        self.axial, self.waves = axial, [(a, math.pi * m) for a, m in waves]

    def curvature(self, s):
        return -sum(a * m * m * np.sin(m * s) for a, m in self.waves)

    def slope(self, s):
        return sum(a * m * np.cos(m * s) for a, m in self.waves)

    def span(self, thrust, across, first, last, start, steps=200):
        """(y, rotation, moment, x) at the material coordinate `last`, from those at `first`; the force beyond is (-thrust, across).

        All of them numbers, or one for each of many rods, which takes hardly longer.
        """
        def rate(s, z):
            c, n = np.cos(z[1]), np.sin(z[1])
            stretch = 1.0 + (across * n - thrust * c) / self.axial
            return np.array([stretch * n, self.curvature(s) + z[2], -stretch * (thrust * n + across * c), stretch * c])
        z, h, s = np.array(np.broadcast_arrays(*start, 0.0 * (first + last + thrust + across))), (last - first) / steps, first
        for _ in range(steps):
            a = rate(s, z)
            b = rate(s + 0.5 * h, z + 0.5 * h * a)
            c = rate(s + 0.5 * h, z + 0.5 * h * b)
            z, s = z + h * (a + 2.0 * b + 2.0 * c + rate(s + h, z + h * c)) / 6.0, s + h
        return z


def solved(misfit: Callable, guess, steps=12):
    """Newton's method by differences, for many rods: the last index. What follows a change of 1e-8 is rounding."""
    x = np.array(np.broadcast_arrays(*guess), dtype=float)
    for _ in range(steps):
        f, small = np.array(misfit(x)), 1e-6 * np.maximum(np.abs(x), 1e-3)
        moved = np.eye(len(x))[:, :, None] * small[:, None, :]
        both = np.array(misfit(x[:, None, :] + np.concatenate([moved, -moved], axis=1)))
        slope = (both[:, :len(x)] - both[:, len(x):]) / (2.0 * small)
        change = np.linalg.solve(slope.transpose(2, 0, 1), f.T[:, :, None])[:, :, 0].T
        x = x - change
        if np.all(np.abs(change) < 1e-8 * np.maximum(np.abs(x), 1e-3)):
            break
    assert np.max(np.abs(misfit(x))) < 1e-10
    return x


# A line between a clamp and a wall, and one from wall to wall ------------------------------------------------------------------------

GAP, AXIAL, WAVES = 0.041935, 10872.12, ((6.54e-5, 2),)
LARGER = ((2e-4, 2),)  # holds spans between flat walls better: where they are hangs on nothing else


def lines_between_walls(loads):
    """Ends of the lines on both walls, a row for each load, and the column's shortening: each span meets its walls level and without a
    jump of the moment."""
    rod, thrust = Rod(AXIAL, WAVES), np.array(loads) * UNIT["clamped-hinged"]
    wave = 2.0 * math.pi / np.sqrt(thrust * (1.0 - thrust / AXIAL))

    def clamped(x):
        end = rod.span(thrust, x[1], 0.0, x[2], [0.0, rod.slope(0.0), x[0]])
        return [end[0] - GAP, end[1], end[2] + rod.curvature(x[2])]

    def across(x):
        # Half of it: turned round its middle it is itself.
        end = rod.span(thrust, x[0], x[1], 0.5, [GAP, 0.0, -rod.curvature(x[1])])
        return [end[0], end[2]]

    def hinged(x):
        end = rod.span(thrust, x[0], x[1], 1.0, [-GAP, 0.0, -rod.curvature(x[1])])
        return [end[0], end[2]]
    # Of the two lengths of the first span the path has the shorter one.
    first = solved(clamped, [0.2, -GAP * thrust / wave, 0.986 * wave])
    second = solved(across, [2.0 * GAP * thrust / wave, 0.5 - 0.5 * wave])
    third = solved(hinged, [-2.0 * GAP * thrust / wave, 1.0 - 0.5 * wave])
    ends = np.array([first[2], second[1], 1.0 - second[1], third[1]])
    x = rod.span(thrust, first[1], 0.0, first[2], [0.0, rod.slope(0.0), first[0]])[3] \
        + 2.0 * rod.span(thrust, second[0], second[1], 0.5, [GAP, 0.0, -rod.curvature(second[1])])[3] \
        + rod.span(thrust, third[0], third[1], 1.0, [-GAP, 0.0, -rod.curvature(third[1])])[3] \
        + (ends[1] - ends[0] + ends[3] - ends[2]) * (1.0 - thrust / AXIAL)
    return ends.T, 1.0 - x


@pytest.mark.parametrize("options, relative", [({"elements": 24}, 1e-6), ({"tolerance": 1e-4}, 1e-4), ({"tolerance": 1e-6}, 1e-6)])
def test_line_opens_beside_spans_that_may_go_along_the_walls(options, relative):
    """With its ends held there is no equilibrium: the span to the other wall ends where its imperfection lets it. The load falls until
    the column gets to that wall, and rises from there."""
    run = column("clamped-hinged", AXIAL, GAP, -GAP, WAVES, **options)
    assert labels(run) == ["C+", "LP", "C+", "LP", "EP"]
    assert run.labelled("LP")[1].point == run.labelled("C+")[1].point
    load, contact = run.column("load_factor"), run.results.contact
    rows = [k for k in range(len(load)) if load[k] > 17.7 and k % 4 == 0] + [len(load) - 1]
    assert len(rows) > 1
    near = [17.6, 17.65]
    all_ends, shortenings = lines_between_walls([*load[rows], *near])
    for row, ends, shortening in zip(rows, all_ends, shortenings):
        found, bars = np.array([*contact.start[row, :], *contact.end[row, :]]), contact.bars[:2, row, :].ravel()
        order = np.argsort(found)
        # What is asked for is a load; where spans next to nothing keeps from going along their walls end, bars tell. They are
        # linear: what is of second order is as large a part of them as the widest is of the line that has just opened.
        second_order = np.max(bars) / (found[order][1] - found[order][0])
        assert np.all(np.abs(found[order] - ends) <= (1.0 + second_order) * bars[order] + 1e-7), (found[order] - ends, bars[order])
        assert np.max(bars) < 10.0 * max(relative, 1e-5)
        dr.assert_close(run.column("shortening")[row], shortening, relative=max(relative, 1e-7))
    # The line begins where the first two of them are one.
    opening = all_ends[-2:] @ [-1.0, 1.0, 0.0, 0.0]
    flat = near[0] - (near[1] - near[0]) * opening[0] / (opening[1] - opening[0])
    assert min(abs(load - flat)) < max(relative, 1e-5) * flat


@pytest.mark.parametrize("first", [0.08, 0.11, 0.14, 0.2])
def test_a_finer_mesh_has_the_change_behind_the_point(first):
    """The point on a wall is as curved as that earlier on the finer mesh: it lies down at once. It was let go on less curved than the
    wall, and the load fell: a limit point that is none, at 17.6."""
    run = column("clamped-hinged", AXIAL, GAP, -GAP, LARGER, tolerance=1e-3, first=first, code=None)
    assert labels(run)[:4] == ["C+", "LP", "C+", "LP"] and labels(run)[4:] in ([], ["EP"])


@dr.release_only
@pytest.mark.parametrize("tolerance, first", [(9e-4, 0.09), (1.1e-3, 0.07), (1.2e-3, 0.1), (1.1e-3, 0.13), (1.2e-3, 0.15), (2e-3, 0.2)])
def test_a_mesh_gives_bounds_to_where_contact_ends(tolerance, first):
    """What makes a run incomplete is asked of its meshes, too, at every point. On some of them a point has become a line before the point
    of the path for which they are made."""
    run = column("clamped-hinged", AXIAL, GAP, -GAP, LARGER, tolerance=tolerance, first=first)
    assert labels(run) == ["C+", "LP", "C+", "LP", "EP"]
    contact = run.results.contact
    for row in range(1, run.results.n_points):
        told = np.isfinite(contact.start[row, :])
        assert np.all(np.isfinite(contact.bars[:2, row, told]))


# Two paths next to one another ------------------------------------------------------------------------------------------------------

def test_no_bifurcation_between_a_path_and_the_one_beside_it():
    """A clamp, a uniform rod, a line on a parallel wall: the clamp's moment is +-(2 q h)^(1/2), twice next to none where the side load
    q is. Newton's method may go from one to the other, and an eigenvalue from next to zero on one side to the other."""
    run = column("clamped-hinged", 2087668.92, 0.022682, -0.0385594, across=2.0796448217957106e-07, tolerance=1e-3, code=None)
    # Next to the other path a bar may be wider than asked, by how much the mesh there is as chance has it; then it is said.
    assert run.code == 0 or run.code == 2 and "error bar" in run.results.status, run.results.status
    assert labels(run) == ["C+", "BP", "BP", "EP"]
    assert all("one-sided" in c.note or "carry no force" in c.note for c in run.results.critical if c.label == "BP")

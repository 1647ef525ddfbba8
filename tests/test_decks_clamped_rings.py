"""Whole rings that a clamp holds on a wider host: contact begins beside the clamp, and a point comes back to it.

The reference of the first is a rod of its own, integrated from the crown; of the second, that elements of two orders and the mirror
image of the ring agree to their bars.
"""
import functools
import math

import numpy as np
import pytest

import deck_runner as dr

GAP = 0.1
DECK = """*HEADING
Whole ring, clamped on a wider host at the bottom
*NODE
1, 0., 1.
2, {side}., 0.
3, 0., -1.
4, {other}., 0.
*ARC, ELSET=RING, NSET=RING, TYPE={kind}, DIRECTION={sense}
1, 2, 0., 0.{count}
2, 3, 0., 0.{count}
3, 4, 0., 0.{count}
4, 1, 0., 0.{count}
*BEAM SECTION, ELSET=RING, SECTION=STIFFNESS
{axial}, 1.
*BOUNDARY
3, ENCASTRE
*OBSTACLE, NAME=HOST, TYPE=CIRCLE, SIDE=INSIDE
0., 0.1, 1.1
*CONTACT, OBSTACLE=HOST, NSET=RING
*MONITOR, NAME=v
1, U2, -1.
*STEP
*STATIC, METHOD=CYLINDRICAL
{first}, 1E-9, {largest}
*DLOAD
RING, {load}
{force}*STOP
{stop}
*END STEP
"""


def ring(axial, load, stop, side=1, kind="GE8", count=", 3", first=0.1, largest=0.02, force=""):
    return dr.run_deck(DECK.format(axial=axial, load=load, stop=stop, side=side, other=-side, kind=kind, count=count, first=first,
                                   largest=largest, force=force, sense="CLOCKWISE" if side > 0 else "ANTICLOCKWISE"))


@functools.cache
def load_of_first_contact(axial, steps=1000):
    """Weight per length at which the ring is as curved as the host beside its clamp. Half of it from the crown, where the force is
    (H, 0): F = (H, p s), M' = -r' x F, the tangent's angle turns by M - 1."""
    def bottom(unknown):  # one set of unknowns a column
        thrust, moment, p = unknown

        def rate(s, z):
            c, n = np.cos(z[2]), np.sin(z[2])
            stretch = 1.0 + (thrust * c + p * s * n) / axial
            return np.array([stretch * c, stretch * n, z[3] - 1.0, -stretch * (c * p * s - n * thrust)])
        z, h = np.array([0.0 * moment, 0.0 * moment, 0.0 * moment, moment]), math.pi / steps
        for k in range(steps):
            s = k * h
            a = rate(s, z)
            b = rate(s + 0.5 * h, z + 0.5 * h * a)
            c = rate(s + 0.5 * h, z + 0.5 * h * b)
            z = z + h * (a + 2.0 * b + 2.0 * c + rate(s + h, z + h * c)) / 6.0
        stretch = 1.0 + (thrust * np.cos(z[2]) + p * math.pi * np.sin(z[2])) / axial
        return np.array([z[0], z[2] + math.pi, z[3] - 1.0 + stretch / (1.0 + GAP)])
    x = np.array([0.0, 0.0, 0.06])
    moved = 1e-5 * np.hstack([np.eye(3), -np.eye(3), np.zeros((3, 1))])
    for _ in range(8):
        f = bottom(x[:, None] + moved)
        x = x - np.linalg.solve((f[:, :3] - f[:, 3:6]) / 2e-5, f[:, 6])
    assert np.max(np.abs(bottom(x))) < 1e-11
    return x[2]


@pytest.mark.parametrize("first", [0.05, 0.1, 0.3, 1.0])
def test_contact_begins_beside_the_clamp_whatever_the_first_increment(first):
    run = ring("120000.", "PY, -1.", "v, ABOVE, 0.1", first=first)
    dr.assert_close(run.load("C+"), load_of_first_contact(120000.0), relative=1e-7)
    assert [c.label for c in run.results.critical] == ["C+", "EP"]


def test_a_point_comes_back_to_the_clamp():
    """Under pressure a point of contact on each side moves away from the clamp; where the ring tips over one of them comes back."""
    def case(**options):
        side = options.get("side", 1)
        run = ring("4800.", f"P, {-side}.", "v, BELOW, 0.03", largest=0.05,
                   force=f"*CLOAD\n1, 2, -0.008693\n1, 1, {side * 0.001256}\n", **options)
        assert [c.label for c in run.results.critical] == ["C+", "C+", "LP", "C-", "EP"]
        return run.only("C-")
    cases = [case(count=", 4"), case(kind="GE6", count=", 8"), case(count=", 4", side=-1)]
    for one in cases:
        assert one.error < 1e-4
        for other in cases:
            assert abs(one.load_factor - other.load_factor) <= one.error + other.error + 1e-9

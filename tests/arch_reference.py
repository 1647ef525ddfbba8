"""Shallow hinged circular arches under a load at the crown: limit points and bifurcations of the symmetric path, to 1e-10.

The exact shear-rigid, extensible rod with R = EI = 1 and EA = 12 (R/h)^2; half of it, arc length s from the hinge to the
crown. The force in it is (H, -V) from end to end, with the load P = 2 V, so that all that is left is the direction t:

    t'' = (1 + N/EA) (H sin t + V cos t)      N = H cos t - V sin t
    t'(0) = -1, t(L) = 0, integral of (1 + N/EA) cos t = half the span       (no moment; crown stays upright, on its line)

Solved with one polynomial at Chebyshev points, followed by Keller's pseudo arc length: it shares nothing with the program.
Asymmetric bifurcations: changes of t and V with t'(0) = t'(L) = 0 (moments) that do not lower the crown, H the same.

    for point in special_points(half_angle=0.3, slenderness=50): print(point.label, point.load, point.crown)

As a program it writes reference/arch_shallow_special_points.csv anew and prints how far two sizes of the polynomial differ.
"""

from __future__ import annotations

import csv
import pathlib
from dataclasses import dataclass

import numpy as np

HALF_ANGLES = (0.2, 0.25, 0.3, 0.35)
SLENDERNESS = (50, 100)
DEGREE = 56
TABLE = pathlib.Path(__file__).parent / "reference" / "arch_shallow_special_points.csv"


@dataclass(frozen=True)
class SpecialPoint:
    """A point of the symmetric path, in its order."""

    label: str         # LP or BP
    load: float        # P R^2/EI
    crown: float       # displacement of the crown downwards, over R
    thrust: float      # H R^2/EI, negative in compression


class Arch:
    """Unknowns: t at the Chebyshev points, then H, then V."""

    def __init__(self, half_angle: float, slenderness: float, degree: int = DEGREE):
        self.angle, self.ea, self.size = half_angle, 12.0 * slenderness**2, degree + 1
        self.s, self.d, self.w = _chebyshev(degree, half_angle)
        self.d2 = self.d @ self.d
        self.scale = np.append(np.full(self.size, half_angle * np.sqrt(self.size)), [(np.pi / half_angle)**2] * 2)
        self.first = np.append(half_angle - self.s, [0.0, 0.0])
        self.determinant = (1.0, 0.0)
        self.determinant = np.linalg.slogdet(self._asymmetric(self.first))

    def load(self, u: np.ndarray) -> float:
        return 2.0 * u[-1]

    def crown(self, u: np.ndarray) -> float:
        stretch = 1.0 + self._forces(u)[0] / self.ea
        return 1.0 - np.cos(self.angle) - self.w @ (stretch * np.sin(u[:-2]))

    def _forces(self, u):
        """N and -Q."""
        c, s = np.cos(u[:-2]), np.sin(u[:-2])
        return u[-2] * c - u[-1] * s, u[-2] * s + u[-1] * c

    def equations(self, u: np.ndarray):
        """Residual and its derivative, one column more than rows."""
        t, m = u[:-2], self.size
        c, s = np.cos(t), np.sin(t)
        n, q = self._forces(u)
        stretch = 1.0 + n / self.ea
        residual, rows = np.zeros(m + 1), np.zeros((m + 1, m + 2))
        residual[:m] = self.d2 @ t - stretch * q
        rows[:m, :m] = self.d2 - np.diag(stretch * n - q * q / self.ea)
        rows[:m, m] = -(stretch * s + c * q / self.ea)
        rows[:m, m + 1] = -(stretch * c - s * q / self.ea)
        residual[0] = self.d[0] @ t + 1.0
        rows[0] = np.append(self.d[0], [0.0, 0.0])
        residual[m - 1] = t[-1]
        rows[m - 1] = np.eye(m + 2)[m - 1]
        residual[m] = self.w @ (stretch * c) - np.sin(self.angle)
        rows[m, :m] = -self.w * (stretch * s + q * c / self.ea)
        rows[m, m:] = self.w @ (c * c) / self.ea, -self.w @ (s * c) / self.ea
        return residual, rows

    def _asymmetric(self, u):
        """Matrix of the asymmetric changes of t and V, singular at a bifurcation."""
        _, rows = self.equations(u)
        c, s = np.cos(u[:-2]), np.sin(u[:-2])
        n, q = self._forces(u)
        matrix = np.delete(rows, self.size, axis=1)
        matrix[self.size - 1] = np.append(self.d[-1], 0.0)
        matrix[self.size] = np.append(self.w * ((1.0 + n / self.ea) * c - q * s / self.ea), -self.w @ (s * s) / self.ea)
        return matrix

    def asymmetric(self, u: np.ndarray) -> float:
        """Determinant of the asymmetric changes over that at the start."""
        sign, logarithm = np.linalg.slogdet(self._asymmetric(u))
        return sign * self.determinant[0] * np.exp(logarithm - self.determinant[1])

    def solve(self, u: np.ndarray, last: np.ndarray, right: np.ndarray) -> np.ndarray:
        """Scaled change for the residuals `right` with one more equation `last`."""
        matrix = np.vstack([self.equations(u)[1] * self.scale, last])
        size = np.max(np.abs(matrix), axis=1)
        return np.linalg.solve(matrix / size[:, None], right / size)

    def tangent(self, u: np.ndarray, before: np.ndarray) -> np.ndarray:
        """Scaled unit tangent in the sense of `before`."""
        t = self.solve(u, before, np.eye(self.size + 2)[-1])
        return t / np.linalg.norm(t)

    def correct(self, start: np.ndarray, tangent: np.ndarray, length: float):
        """The path's point in the plane normal to the tangent at this distance; None where Newton is not quick."""
        u, before = start + self.scale * tangent * length, np.inf
        for _ in range(8):
            miss = length - tangent @ ((u - start) / self.scale)
            change = self.solve(u, tangent, np.append(-self.equations(u)[0], miss))
            u, now = u + self.scale * change, np.linalg.norm(change)
            if now < 1e-11:
                return u
            if now > 0.5 * before or now > 0.2 * length:
                return None
            before = now
        return None


def special_points(half_angle: float, slenderness: float, degree: int = DEGREE, longest: float = 0.05,
                   most: int | None = None) -> list[SpecialPoint]:
    """All of the path until the arch hangs below its hinges and is stiffer than at the start, or the first `most` or some more;
    increments turn by 0.1 at most."""
    arch = Arch(half_angle, slenderness, degree)
    u, step, points = arch.first, 0.01, []
    tangent = arch.tangent(u, np.eye(arch.size + 2)[-1])
    stiffness = tangent[-1]
    while arch.crown(u) < 2.2 * (1.0 - np.cos(half_angle)) or tangent[-1] < stiffness:
        new = arch.correct(u, tangent, step)
        after = None if new is None else arch.tangent(new, tangent)
        if new is None or after @ tangent < np.cos(0.1):
            step *= 0.5
            assert step > 1e-8, "the path does not go on"
            continue
        found = []
        for label, test in (("LP", lambda x, direction: direction[-1]), ("BP", lambda x, direction: arch.asymmetric(x))):
            if test(u, tangent) * test(new, after) < 0.0:
                found.append(_located(arch, label, test, u, tangent, step))
        points += [point for _, point in sorted(found, key=lambda pair: pair[0])]
        if most is not None and len(points) >= most:
            break
        u, tangent, step = new, after, min(1.3 * step, longest)
    return points


def _located(arch, label, test, u, tangent, step):
    """The zero of a test function within an increment, by the Illinois rule."""
    def at(length):
        new = arch.correct(u, tangent, length) if length > 0.0 else u
        return new, test(new, arch.tangent(new, tangent))

    a, b = 0.0, step
    fa, fb = at(a)[1], at(b)[1]
    for _ in range(60):
        middle = b - fb * (b - a) / (fb - fa)
        new, f = at(middle)
        if f * fb < 0.0:
            a, fa = b, fb
        else:
            fa *= 0.5
        done = abs(middle - b) < 1e-13
        b, fb = middle, f
        if done or f == 0.0:
            break
    return b, SpecialPoint(label, arch.load(new), arch.crown(new), new[-2])


def _chebyshev(degree: int, length: float):
    """Points on [0, length], the matrix that differentiates there, and Clenshaw and Curtis' weights."""
    k = np.arange(degree + 1)
    x = -np.cos(np.pi * k / degree)
    c = np.where((k == 0) | (k == degree), 2.0, 1.0) * (-1.0)**k
    d = np.outer(c, 1.0 / c) / (x[:, None] - x[None, :] + np.eye(degree + 1))
    d -= np.diag(np.sum(d, axis=1))
    moments = np.where(k % 2 == 0, 2.0 / (1.0 - k**2 + (k == 1)), 0.0)
    weights = np.linalg.solve(np.cos(np.outer(k, np.arccos(x))), moments)
    return 0.5 * length * (x + 1.0), d * 2.0 / length, weights * 0.5 * length


def table() -> dict[tuple[float, int], list[SpecialPoint]]:
    """The stored points by half angle and R/h."""
    points: dict[tuple[float, int], list[SpecialPoint]] = {}
    with open(TABLE, newline="", encoding="utf-8") as file:
        for row in csv.DictReader(line for line in file if not line.startswith("#")):
            key = float(row["half_angle"]), int(row["R_h"])
            points.setdefault(key, []).append(SpecialPoint(row["label"], float(row["P"]), float(row["v"]), float(row["H"])))
    return points


def main():
    worst = 0.0
    with open(TABLE, "w", newline="", encoding="utf-8") as file:
        file.write("# Special points of the symmetric path of shallow hinged arches, load P R^2/EI at the crown,\n"
                   "# EA R^2/EI = 12 (R/h)^2; label LP: limit point, BP: asymmetric bifurcation; v: crown displacement over R,\n"
                   "# H: thrust. Written by tests/arch_reference.py\n")
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(["half_angle", "R_h", "label", "P", "v", "H"])
        for half_angle in HALF_ANGLES:
            for slenderness in SLENDERNESS:
                points = special_points(half_angle, slenderness)
                others = special_points(half_angle, slenderness, DEGREE + 12, 0.03)
                assert [p.label for p in points] == [p.label for p in others]
                for p, q in zip(points, others):
                    worst = max(worst, abs(p.load / q.load - 1.0), abs(p.crown / q.crown - 1.0))
                    rows.writerow([half_angle, slenderness, p.label, f"{p.load:.13g}", f"{p.crown:.13g}", f"{p.thrust:.13g}"])
    print(f"largest relative difference between two polynomials and increments: {worst:.1e}")


if __name__ == "__main__":
    main()

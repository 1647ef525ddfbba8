"""Beams on ground that carries load sideways, solved without the program: closed forms, Fourier integrals, Chebyshev series.

w and p count downwards and upwards on the beam; the half-space is loaded evenly across the width, w is the mean across it.
"""

from __future__ import annotations

import numpy as np

# Pasternak: EI w'''' - G w'' + k w = load ---------------------------------------------------------------------------


def pasternak_infinite(k, g, ei, x):
    """Deflection and moment at x >= 0 by a unit force at 0 on an infinite beam that the ground holds."""
    r = np.roots([ei, 0.0, -g, 0.0, k]).astype(complex)
    r = r[r.real < 0.0]
    c = np.linalg.solve(np.array([r, ei * r**3]), np.array([0.0, 0.5]))
    e = np.exp(np.outer(np.atleast_1d(x), r))
    return (e @ c).real, -ei * (e @ (c * r**2)).real


def pasternak_lift_off(k, g, ei):
    """Half-length of contact, deflection and moment at a unit force on a weightless beam that the ground does not hold.

    Within the contact as above; at its end no moment and no shear force in the beam, and the slope of the free ground,
    which falls with exp(-x/l), l^2 = G/k. Five conditions for four constants and the half-length.
    """
    r = np.roots([ei, 0.0, -g, 0.0, k]).astype(complex)

    def constants(a):
        e = np.exp(r * a)
        return np.linalg.solve(np.array([r, ei * r**3, r**2 * e, r**3 * e]), np.array([0.0, 0.5, 0.0, 0.0])), e

    def kink(a):
        c, e = constants(a)
        return (np.sum(c * r * e) + np.sum(c * e) * np.sqrt(k / g)).real

    lengths = np.linspace(0.02, 3.0, 600) * (4.0 * ei / k) ** 0.25
    signs = np.sign([kink(a) for a in lengths])
    first = int(np.flatnonzero(signs[:-1] * signs[1:] < 0.0)[0])
    a = bisect(kink, lengths[first], lengths[first + 1])
    c, _ = constants(a)
    return a, np.sum(c).real, -ei * np.sum(c * r**2).real


def bisect(function, low, high):
    sign = np.sign(function(low))
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if np.sign(function(middle)) == sign else (low, middle)
    return 0.5 * (low + high)


# Half-space -----------------------------------------------------------------------------------------------------------


def across(x, b):
    """Mean over the width b of 1/distance from points spread evenly over the width, at distance x along."""
    x = np.abs(x)
    return 2.0 / b**2 * (b * np.arcsinh(b / x) - b**2 / (np.hypot(x, b) + x))


def wave_compliance(q, young, poisson, b):
    """Settlement by a force cos(q x) per length. 1/distance has the transform 2 K0(q t), K0(z) the integral of
    exp(-z cosh u) over u > 0; its means across the width are elementary, and an even smooth integrand that dies out makes
    the trapezoidal rule exact to rounding."""
    u = np.arange(0.0, 45.0, 0.02)
    c = np.multiply.outer(q, np.cosh(u))
    z = c * b
    means = b**2 * np.where(z < 1e-4, 0.5 - z / 6.0 + z**2 / 24.0, (z + np.expm1(-z)) / np.maximum(z, 1e-4) ** 2)
    weight = np.full(u.size, 0.02)
    weight[0] = 0.01
    return (1.0 - poisson**2) / (np.pi * young) * 4.0 / b**2 * (means @ weight)


def half_space_infinite(young, poisson, b, ei):
    """Deflection and moment at a unit force on an infinite beam that the ground holds: the integral of M. A. Biot, J. Appl.
    Mech. 4 (1937) A1-A7, over waves of all lengths."""
    s = np.arange(-30.0, 12.0, 0.02)           # logarithm of the wave number, in 1/b
    q = np.exp(s) / b
    answer = 1.0 / (ei * q**4 + 1.0 / wave_compliance(q, young, poisson, b))
    return np.sum(answer * q) * 0.02 / np.pi, np.sum(ei * q**2 * answer * q) * 0.02 / np.pi


def half_space_buckling(young, poisson, b, ei):
    """Least axial force under which some wave of an infinite beam that the ground holds needs no other."""
    q = np.exp(np.linspace(-3.0, 5.0, 4001)) / b
    return np.min(ei * q**2 + 1.0 / (q**2 * wave_compliance(q, young, poisson, b)))


GAUSS_POINT, GAUSS_WEIGHT = np.polynomial.legendre.leggauss(60)


_S = 0.5 * (GAUSS_POINT + 1.0)
CLUSTERED_POINT = _S**4 * (35.0 - 84.0 * _S + 70.0 * _S**2 - 20.0 * _S**3)
CLUSTERED_WEIGHT = 0.5 * GAUSS_WEIGHT * 140.0 * _S**3 * (1.0 - _S) ** 3


def clustered(low, high):
    """Points and weights between two ends, or between many pairs of them, at both of which the integrand may be singular."""
    low, length = np.asarray(low)[..., None], np.asarray(high - low)[..., None]
    return low + length * CLUSTERED_POINT, length * CLUSTERED_WEIGHT


def pressure_equations(a, young, poisson, b, ei, terms, edge):
    """Collocation of settlement = deflection on (0, a), symmetric, at one point more than there are terms.

    Pressure: even Chebyshev polynomials times root(1 - (x/a)^2) to the power of edge: 1 where the beam leaves the ground, -1
    at the edges of a stiff one. Returns the rows for the terms and the deflection in the middle (right-hand side 0), and
    the force and the moment in the middle of each term.
    """
    soft = (1.0 - poisson**2) / (np.pi * young)

    def basis(t):
        angle = np.arccos(np.clip(t / a, -1.0, 1.0))
        return np.cos(np.multiply.outer(2 * np.arange(terms), angle)) * np.sin(angle) ** edge

    points = a * np.cos(np.pi * (2 * np.arange(terms + 1) + 1) / (4 * (terms + 1)))
    rows = np.full((terms + 1, terms + 1), -1.0)
    x = points[:, None]
    # On (-a, 0) the pressures are those of (0, a).
    near, far = clustered(0.0 * points, points), clustered(points, a + 0.0 * points)
    t, w = (np.concatenate(both, axis=1) for both in zip(near, far))
    m = np.minimum(x, t)
    # What a force at t lifts the point x by, the middle held and level.
    lift = (x * t * m - (x + t) * m**2 / 2.0 + m**3 / 3.0) / ei
    u, v = clustered(0.0, a)
    on_left = basis(u)
    rows[:, :-1] = (np.einsum("jpt,pt->pj", basis(t), (soft * across(x - t, b) + lift) * w)
                    + (soft * across(x + u, b) * v) @ on_left.T)
    return rows, 2.0 * on_left @ v, (on_left * u) @ v


def half_space_lift_off(young, poisson, b, ei, terms=20):
    """Half-length of contact, deflection and moment at a unit force on a weightless beam that the ground does not hold. The
    contact has the length for which the equations without a load have a solution; 1e-4, 1e-6, 1e-5 with 20 terms."""
    def sign(a):
        return np.linalg.slogdet(pressure_equations(a, young, poisson, b, ei, terms, 1)[0])[0]

    lengths = np.linspace(0.4, 4.0, 37) * (ei / young) ** 0.25
    signs = [sign(a) for a in lengths]
    first = next(i for i in range(36) if signs[i] != signs[i + 1])
    a = bisect(sign, lengths[first], lengths[first + 1])
    rows, force, moment = pressure_equations(a, young, poisson, b, ei, terms, 1)
    c = np.linalg.svd(rows)[2][-1]
    total = force @ c[:-1]
    return a, c[-1] / total, moment @ c[:-1] / total


def rigid_strip(length, young, poisson, b, terms=12):
    """Force by which a strip that does not bend sinks by 1, and its pressures: x -> force per length."""
    rows, force, _ = pressure_equations(0.5 * length, young, poisson, b, 1e30, terms, -1)
    c = np.linalg.lstsq(rows[:, :-1], np.ones(terms + 1), rcond=None)[0]

    def pressure(x):
        angle = np.arccos(2.0 * np.asarray(x) / length)
        return c @ np.array([np.cos(2 * j * angle) for j in range(terms)]) / np.sin(angle)
    return force @ c, pressure


# Matrices --------------------------------------------------------------------------------------------------------------


def half_space_matrix(edges, young, poisson, b):
    """Mean settlements of rectangles between neighbouring edges by unit forces on them: the logarithm and the distance in
    the kernel integrated exactly, what is left, which is smooth, by Gauss's rule."""
    def twice(function):
        table = function(edges[:, None] - edges[None, :])
        return -(table[1:, 1:] - table[1:, :-1] - table[:-1, 1:] + table[:-1, :-1])

    lengths = np.diff(edges)
    with np.errstate(divide="ignore", invalid="ignore"):
        logarithm = twice(lambda x: np.nan_to_num(0.5 * x**2 * np.log(np.abs(x))) - 0.75 * x**2)
    distance = twice(lambda x: np.abs(x) ** 3 / 6.0)
    s, w = np.polynomial.legendre.leggauss(6)
    at = edges[:-1, None] + lengths[:, None] * 0.5 * (s + 1.0)
    x = at[:, None, :, None] - at[None, :, None, :]
    root = np.hypot(x, b)
    rest = np.einsum("ijkl,k,l->ij", b * np.log(b + root) - root, 0.5 * w, 0.5 * w)
    means = (distance - b * logarithm) / np.outer(lengths, lengths) + rest
    return (1.0 - poisson**2) / (np.pi * young) * 2.0 / b**2 * means


def layer_matrix(places, k, g):
    """Pasternak's ground at the nodes of one rod: springs lumped there, the layer straight between them, beyond both ends the
    infinite rest."""
    h = np.diff(places)
    stiffness = np.diag(0.5 * k * (np.append(h, 0.0) + np.append(0.0, h)))
    for i, length in enumerate(h):
        stiffness[i:i + 2, i:i + 2] += g / length * np.array([[1.0, -1.0], [-1.0, 1.0]])
    stiffness[0, 0] += np.sqrt(k * g)
    stiffness[-1, -1] += np.sqrt(k * g)
    return np.linalg.inv(stiffness)


def beam_buckling(places, ei, compliance, count):
    """Least axial forces of a free beam with Hermite's elements on ground that holds its nodes."""
    n = len(places)
    bending, geometric = np.zeros((2 * n, 2 * n)), np.zeros((2 * n, 2 * n))
    for i, h in enumerate(np.diff(places)):
        part = np.s_[2 * i:2 * i + 4]
        bending[part, part] += ei / h**3 * np.array([[12, 6 * h, -12, 6 * h], [6 * h, 4 * h**2, -6 * h, 2 * h**2],
                                                     [-12, -6 * h, 12, -6 * h], [6 * h, 2 * h**2, -6 * h, 4 * h**2]])
        geometric[part, part] += 1 / (30 * h) * np.array([[36, 3 * h, -36, 3 * h], [3 * h, 4 * h**2, -3 * h, -h**2],
                                                          [-36, -3 * h, 36, -3 * h], [3 * h, -h**2, -3 * h, 4 * h**2]])
    bending[::2, ::2] += np.linalg.inv(compliance)
    root = np.linalg.inv(np.linalg.cholesky(bending))
    return 1.0 / np.linalg.eigvalsh(root @ geometric @ root.T)[::-1][:count]

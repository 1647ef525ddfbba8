"""Write a small result file with branches, buckling modes and limit curves in the program's layout.

A pinned rod of length 1 and EI = 1 under an end thrust: the straight path with bifurcations at pi^2 (located, simple)
and 4 pi^2 (bracketed), the two sides of the bent branch as far as P = pi^2 (1 + pi^2 w^2 / 8) holds, and a made-up
branch of one of them. The limit curve is made up, too.
"""

from __future__ import annotations

import h5py
import numpy as np

from make_result_file import put, write_root

N_ELEMENTS = 20
S = np.linspace(0.0, 1.0, N_ELEMENTS + 1)
STRAIGHT = np.array((2.0, 6.0, np.pi ** 2, 14.0, 30.0, 4.0 * np.pi ** 2, 45.0))     # loads; points 3 and 6 are BPs
PIVOTS = (0, 0, 1, 1, 1, 2, 2)
BENT = np.array((0.05, 0.1, 0.2, 0.3))     # deflections of both sides
MODULUS = 10.0 ** np.array((2.0, 3.0, 4.0, 5.0, 6.0, np.inf))
LIMIT_LOAD = np.append(60.0 + 20.0 * MODULUS[:-1] / (MODULUS[:-1] + 1e4), 80.0)


def bent_load(w):
    return np.pi ** 2 * (1.0 + np.pi ** 2 * w ** 2 / 8.0)


def mode(number):
    """Mode of the rod with `number` half waves, (nodes, 3)."""
    wave = number * np.pi
    return np.column_stack((0.0 * S, np.sin(wave * S), wave * np.cos(wave * S)))


def write_path(group, load, mid, end, pivots, labels, displacement, critical):
    """One path; `critical` has (label, point, located, null vectors or None)."""
    n = len(load)
    path = group.create_group("path")
    put(path, "load_factor", load)
    put(path, "arc_length", 0.1 * np.arange(n))
    put(path, "step", np.full(n, 2, dtype="i4"))
    put(path, "negative_pivots", np.array(pivots, dtype="i4"))
    put(path, "label", np.array(labels, dtype="S2"))
    monitor = path.create_group("monitor", track_order=True)
    put(monitor, "mid", mid, "length")
    put(monitor, "end", end, "length")
    fields = group.create_group("fields")
    put(fields, "point", np.arange(1, n + 1, dtype="i4"))
    put(fields, "displacement", displacement, "length")
    special = group.create_group("critical")
    put(special, "label", np.array([row[0] for row in critical], dtype="S2"))
    put(special, "point", np.array([row[1] for row in critical], dtype="i4"))
    put(special, "step", np.full(len(critical), 2, dtype="i4"))
    put(special, "load_factor", np.array([load[row[1] - 1] for row in critical], dtype=float))
    put(special, "located", np.array([row[2] for row in critical], dtype="i4"))
    put(special, "multiplicity", np.array([0 if row[3] is None else len(row[3]) for row in critical], dtype="i4"))
    put(special, "note", np.array([""] * len(critical), dtype="S120"))
    put(special, "monitor/mid", np.array([mid[row[1] - 1] for row in critical], dtype=float), "length")
    special.create_group("null_vector")
    for number, row in enumerate(critical, start=1):
        if row[3] is not None:
            put(special, f"null_vector/{number}", row[3])


def write_branched(filename, status="complete"):
    with h5py.File(filename, "w") as file:
        write_root(file, status)
        put(file, "mesh/coordinates", np.column_stack((S, 0.0 * S)), "length")
        put(file, "mesh/elements", np.column_stack((np.arange(N_ELEMENTS), np.arange(1, N_ELEMENTS + 1))))
        put(file, "mesh/node_label", np.arange(1, N_ELEMENTS + 2))
        put(file, "mesh/element_label", np.arange(1, N_ELEMENTS + 1))
        nothing = np.zeros((len(STRAIGHT), N_ELEMENTS + 1, 3))
        write_path(file, STRAIGHT, 0.0 * STRAIGHT, 1e-4 * STRAIGHT, PIVOTS, ["", "", "BP", "", "", "BP", "EP"], nothing,
                   [("BP", 3, True, mode(1)[None]), ("BP", 6, False, None), ("EP", 7, True, None)])
        for number, side in ((1, 1), (2, -1)):
            write_branch(file, number, "bow", of=0, side=side, point=3)
            w = side * BENT
            shape = w[:, None, None] * mode(1)
            write_path(file[f"branch/{number}"], bent_load(w), w, 2.0 * w ** 2, (0,) * 4, ["", "", "TP", "EP"], shape,
                       [("TP", 3, True, None), ("EP", 4, True, None)])
        write_branch(file, 3, "off", of=2, side=1, point=3)
        w = BENT[:3] - 0.25
        write_path(file["branch/3"], 8.0 + 4.0 * w, w, 2.0 * w ** 2, (2, 2, 3), ["", "LP", "EP"],
                   w[:, None, None] * mode(2), [("LP", 2, True, None)])
        buckle = file.create_group("buckling/buckle")
        buckle.attrs["step"] = 1
        put(buckle, "load_factor", np.pi ** 2 * np.array((1.0, 4.0, 9.0)))
        put(buckle, "residual", np.full(3, 1e-14))
        put(buckle, "mode", np.array([mode(k) / np.abs(mode(k)[:, 1]).max() for k in (1, 2, 3)]))
        curves = file.create_group("limit_curve", track_order=True)
        write_limit_curve(curves, "soil", "MODULUS", "ground", MODULUS, LIMIT_LOAD, ["", "", "TP", "", "", "EP"])
        write_limit_curve(curves, "dead", "CONSTANT LOAD", "", np.array((1.0, 0.5, 0.0)), np.array((80.0, 82.0, 84.0)),
                          ["", "", "EP"])


def write_branch(file, number, name, of, side, point):
    group = file.create_group(f"branch/{number}")
    group.attrs["name"] = np.bytes_(name)
    for word, value in (("step", 2), ("of", of), ("bifurcation", 1), ("mode", 1), ("side", side), ("point", point)):
        group.attrs[word] = value


def write_limit_curve(curves, name, parameter, of, values, load, labels):
    group = curves.create_group(name)
    group.attrs["step"], group.attrs["limit_point"] = 2, 1
    group.attrs["parameter"], group.attrs["of"] = np.bytes_(parameter), np.bytes_(of)
    put(group, "parameter", values, "force / length^2" if parameter == "MODULUS" else "1")
    put(group, "rigid", np.isinf(values).astype("i4"))
    put(group, "load_factor", load)
    put(group, "iterations", np.full(len(load), 4, dtype="i4"))
    put(group, "residual", np.full(len(load), 1e-12))
    put(group, "load_rate", np.full(len(load), 1e-10))
    put(group, "label", np.array(labels, dtype="S2"))
    put(group, "monitor/mid", 0.001 * load, "length")

"""Write small result files in the program's layout, for the tests of postproc.

The half ring is the left half of a ring (radius 1, EI = 1, EA = 120000) in a rigid circular cavity under its weight;
its path is the exact solution of the rod equations (a few points of it), its shapes follow from that by integration
from the apex. Everything else (iterations, arc length, reactions) is made up, but fits in size and sign.
"""

from __future__ import annotations

import functools

import h5py
import numpy as np

# v, p, angle of lift-off from the apex (degrees), section force and curvature at the apex; row 6 is the limit point.
RING = np.array([
    (0.0001, 0.568938782388, 36.0171295318, -0.52399461028, 0.998564849795),
    (0.000562341325, 3.16747915206, 35.8127778804, -2.92469486035, 0.991786435977),
    (0.00316227766, 16.7993973312, 34.6531676351, -15.7450264937, 0.948943227432),
    (0.016, 61.7315631642, 29.4422594063, -63.4232541311, 0.595380282251),
    (0.034, 81.4207132375, 25.3632241751, -100.945261487, -0.230125450238),
    (0.0358697377, 81.557427564661, 25.1202867, -103.4836, -0.32712),
    (0.052, 74.0187843284, 23.9366483253, -116.963897236, -1.15486472619),
    (0.07, 57.9127119582, 23.9424062042, -117.900936, -1.92230305662),
    (0.088, 43.593282415, 24.7423589944, -110.655280059, -2.45181449588),
    (0.13, 24.9014789599, 27.8108844823, -87.741046323, -3.05252516149),
    (0.22, 12.5941852169, 34.9750733892, -55.8649341515, -3.37424692185),
    (0.31, 8.61368218078, 41.3986598869, -40.2659295185, -3.44399831335),
    (0.4, 6.62420852085, 47.1518815942, -31.3787457657, -3.46804812522),
    (0.49, 5.41660542133, 52.4153967734, -25.6859183373, -3.47903250949),
    (0.58, 4.60160353442, 57.3157791565, -21.7384417894, -3.48517506121)])


def ring_shape(row, n_elements):
    """Displacements (nodes, 3), reactions, gaps (nodes) and arc length of lift-off of the half ring, apex first."""
    return _integrated(tuple(row), n_elements)


@functools.cache
def _integrated(row, n_elements):
    v, p, phi, h0, kap0 = row
    s = np.linspace(0.0, np.pi, n_elements + 1)

    def rate(s, y):     # y = position, direction, moment; n = (-h0, p s)
        t = np.array((np.cos(y[2]), np.sin(y[2])))
        n = np.array((-h0, p * s))
        d = (1.0 + n @ t / 120000.0) * t
        return np.array((d[0], d[1], 1.0 + y[3], n[0] * d[1] - n[1] * d[0]))

    y = np.array((0.0, 1.0 - v, np.pi, kap0 - 1.0))
    steps = 40
    nodes, lift = np.zeros((len(s), 3)), None
    nodes[0] = y[:3]
    h = np.pi / n_elements / steps
    for i in range(1, len(s)):
        for j in range(steps):
            if lift is not None:
                break
            at = s[i - 1] + j * h
            k1 = rate(at, y)
            k2 = rate(at + h / 2, y + h / 2 * k1)
            k3 = rate(at + h / 2, y + h / 2 * k2)
            k4 = rate(at + h, y + h * k3)
            y = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
            if np.degrees(np.arctan2(-y[0], y[1])) >= phi:
                lift = at + h
        nodes[i] = y[:3]
        if lift is not None:
            angle = np.radians(phi) + (np.pi - np.radians(phi)) * max(s[i] - lift, 0.0) / (np.pi - lift)
            nodes[i] = -np.sin(angle), np.cos(angle), np.pi + angle
    free = np.column_stack((-np.sin(s), np.cos(s), np.pi + s))
    reaction = np.where(s >= lift, 3.0 * p * np.pi / n_elements, 0.0)
    gap = np.where(s >= lift, 0.0, 1.0 - np.hypot(nodes[:, 0], nodes[:, 1]))
    return nodes - free, reaction, gap, lift


def put(group, name, data, units="1", description="", **options):
    item = group.create_dataset(name, data=data, **options)
    item.attrs["units"] = np.bytes_(units)
    item.attrs["description"] = np.bytes_(description or name.replace("_", " "))
    return item


def write_root(file, status):
    for name, text in (("title", "half ring in a rigid cavity"), ("program", "unilat"), ("version", "0.1.0"),
                       ("deck", "*HEADING\nhalf ring in a rigid cavity\n"), ("created", "2025-01-31T12:00:00"),
                       ("status", status)):
        file.attrs[name] = np.bytes_(text)


def write_ring(filename, ring=RING, n_elements=24, status="complete", every=1,
               fields=("displacement", "reaction", "reaction_density", "gap", "contact_point"), critical=True, shorter=(),
               reach=1.0, points="nodes"):
    """The half ring. `shorter` names datasets that lack the last row, as after a kill; `reach` is a factor on v."""
    ring = np.array(ring)
    n = len(ring)
    limit = int(np.argmax(ring[:, 1]))
    s = np.linspace(0.0, np.pi, n_elements + 1)
    shapes = [ring_shape(row, n_elements) for row in ring]

    def rows(name, data):
        return data[:-1] if name in shorter else data

    def grow(group, name, data, units="1", description=""):
        data = np.asarray(rows(group.name.strip("/") + "/" + name, data))
        put(group, name, data, units, description, maxshape=(None,) * data.ndim, chunks=True)

    with h5py.File(filename, "w") as file:
        write_root(file, status)
        mesh = file.create_group("mesh")
        put(mesh, "coordinates", np.column_stack((-np.sin(s), np.cos(s))), "length", "stress-free positions")
        put(mesh, "elements", np.column_stack((np.arange(n_elements), np.arange(1, n_elements + 1))).astype("i4"))
        put(mesh, "node_label", np.arange(101, 102 + n_elements, dtype="i4"))
        put(mesh, "element_label", np.arange(1, n_elements + 1, dtype="i4"))
        path = file.create_group("path")
        grow(path, "load_factor", ring[:, 1], "1", "load factor of the step")
        grow(path, "arc_length", np.arange(1.0, n + 1.0) / 20.0)
        for name, value in (("step", 1), ("iterations", 4), ("active_contacts", n_elements), ("lcp_size", 2),
                            ("lcp_pivots", 1)):
            grow(path, name, np.full(n, value, dtype="i4"))
        grow(path, "negative_pivots", (np.arange(n) >= limit).astype("i4"))
        grow(path, "residual", np.full(n, 1.0e-12))
        label = np.full(n, b"  ", dtype="S2")
        label[limit], label[-1] = b"LP", b"EP"
        grow(path, "label", label)
        monitor = path.create_group("monitor", track_order=True)
        grow(monitor, "v", reach * ring[:, 0], "length", "apex, downwards")
        grow(monitor, "H", -ring[:, 3], "force", "thrust at the apex")
        contact = file.create_group("contact")
        grow(contact, "count", np.ones(n, dtype="i4"))
        nothing = np.full((n, 1), np.nan)
        grow(contact, "start", np.column_stack(([shape[3] for shape in shapes], nothing)), "length")
        grow(contact, "end", np.column_stack((np.full(n, np.pi), nothing)), "length")
        grow(contact, "angle_start", np.column_stack((ring[:, 2], nothing)), "degree")
        grow(contact, "angle_end", np.column_stack((np.full(n, 180.0), nothing)), "degree")
        grow(contact, "contact", np.column_stack((np.ones(n), np.zeros(n))).astype("i4"))
        grow(contact, "reaction_total", np.array([[shape[1].sum()] for shape in shapes]), "force")
        put(contact, "candidates", np.arange(101, 102 + n_elements, dtype="i4"))
        put(contact, "candidate_contact", np.ones(n_elements + 1, dtype="i4"))
        put(contact, "arc_length", s, "length")
        put(contact, "chain_length", np.zeros(1), "length")
        put(contact, "points", np.array((points,), dtype="S11"))
        put(contact, "obstacle", np.array(("cavity",), dtype="S8"))
        if fields:
            stored = np.arange(0, n, every)
            group = file.create_group("fields")
            grow(group, "point", (stored + 1).astype("i4"))
            values = {"displacement": [shapes[k][0] for k in stored], "reaction": [shapes[k][1] for k in stored],
                      "section_forces": np.ones((len(stored), n_elements, 2, 3)),
                      "reaction_density": [shapes[k][1] * n_elements / np.pi for k in stored],
                      "gap": [shapes[k][2] for k in stored],
                      "contact_point": [shapes[k][0][:, :2] + np.column_stack((-np.sin(s), np.cos(s))) for k in stored]}
            for name in fields:
                grow(group, name, np.array(values[name]), "length")
        if critical:
            write_critical(file, [("LP", limit + 1, ring[limit, 1], True, ring[limit, 0]),
                                  ("EP", n, ring[-1, 1], True, ring[-1, 0])])
        cavity = file.create_group("obstacles/cavity")
        for name, value in (("type", "circle"), ("side", "inside"), ("foundation", "rigid")):
            cavity.attrs[name] = np.bytes_(value)
        cavity.attrs["centre"], cavity.attrs["radius"], cavity.attrs["reference_angle"] = np.zeros(2), 1.0, 90.0
        cavity.attrs["modulus"] = 0.0
        performance = file.create_group("performance")
        put(performance, "phase", np.array(("deck", "path"), dtype="S8"))
        put(performance, "seconds", np.array((0.01, 0.2)), "second")
        put(file, "accuracy/residual", 3.0e-13)


def write_critical(file, points):
    group = file.create_group("critical")
    put(group, "label", np.array([point[0] for point in points], dtype="S2"))
    put(group, "point", np.array([point[1] for point in points], dtype="i4"))
    put(group, "step", np.ones(len(points), dtype="i4"))
    put(group, "load_factor", np.array([point[2] for point in points]))
    put(group, "located", np.array([point[3] for point in points], dtype="i4"))
    group.create_dataset("note", data=["of the load"] * len(points), dtype=h5py.string_dtype())
    put(group, "monitor/v", np.array([point[4] for point in points]), "length")


def add_error_bars(filename):
    """Bars to a file of the half ring: a percent of the load and of v along the path, none at the first two points, none that is
    known at the last; the limit point has its own."""
    with h5py.File(filename, "r+") as file:
        for name, place, label in (("load_factor", "error", "corrected"), ("monitor/v", "monitor_error/v", "monitor_corrected/v")):
            value = file[f"path/{name}"][()]
            error = 0.01 * np.abs(value)
            error[:2], error[-1] = np.nan, np.inf
            put(file["path"], place, error)
            put(file["path"], label, value - 0.5 * error)
            value = file[f"critical/{name}"][()]
            error = np.array([0.03, np.inf]) * value
            put(file["critical"], place, error)
            put(file["critical"], label, np.where(np.isfinite(error), value - 0.5 * error, np.nan))


def write_column(filename, n=41, n_elements=30):
    """A bent rod of length 1 beside a wall at y = 0.02: a point of contact that wanders, then a stretch, then none."""
    s = np.linspace(0.0, 1.0, n_elements + 1)
    load = np.concatenate((np.linspace(0.1, 2.5, n // 2), np.linspace(2.45, 1.2, n - n // 2)))
    height = np.concatenate((np.linspace(0.001, 0.02, 10), np.full(n - 15, 0.02), np.linspace(0.019, 0.016, 5)))
    touch = np.isclose(height, 0.02)
    centre = 0.46 - 0.16 * np.linspace(0.0, 1.0, n)
    half = np.where(touch & (np.arange(n) > 20) & (np.arange(n) < 28), 0.05, 0.0)
    nan = np.full((n, 1), np.nan)
    with h5py.File(filename, "w") as file:
        write_root(file, "stopped: smallest increment reached")
        put(file, "mesh/coordinates", np.column_stack((s, 0.0 * s)), "length")
        put(file, "mesh/elements", np.column_stack((np.arange(n_elements), np.arange(1, n_elements + 1))))
        put(file, "mesh/node_label", np.arange(1, n_elements + 2))
        put(file, "mesh/element_label", np.arange(1, n_elements + 1))
        put(file, "path/load_factor", load)
        put(file, "path/arc_length", np.zeros(n))
        put(file, "path/step", np.ones(n, dtype=int))
        put(file, "path/negative_pivots", (np.arange(n) >= n // 2).astype(int))
        label = np.full(n, b"", dtype="S2")
        put(file, "path/label", label)
        put(file, "path/monitor/mid", height, "length")
        put(file, "contact/count", touch.astype(int))
        put(file, "contact/start", np.where(touch, centre - half, np.nan)[:, None], "length")
        put(file, "contact/end", np.where(touch, centre + half, np.nan)[:, None], "length")
        put(file, "contact/angle_start", nan, "degree")
        put(file, "contact/angle_end", nan, "degree")
        put(file, "contact/contact", touch.astype(int)[:, None])
        put(file, "contact/reaction_total", touch.astype(float)[:, None], "force")
        put(file, "contact/candidates", np.arange(1, n_elements + 2))
        put(file, "contact/candidate_contact", np.ones(n_elements + 1, dtype=int))
        put(file, "contact/arc_length", s, "length")
        put(file, "contact/chain_length", np.zeros(1), "length")
        put(file, "contact/points", np.array(("spans",), dtype="S11"))
        bump = np.sin(np.pi * s ** (np.log(0.5) / np.log(centre))[:, None]) ** 2
        slope = np.gradient(bump, s, axis=1)
        put(file, "fields/point", np.arange(1, n + 1))
        u = np.stack((0.0 * bump, height[:, None] * bump, np.arctan(height[:, None] * slope)), axis=-1)
        put(file, "fields/displacement", u, "length")
        on, off = np.flatnonzero(touch)[[0, -1]]
        write_critical(file, [("C+", on + 1, load[on], True, height[on]), ("LP", n // 2, load[n // 2 - 1], True, 0.02),
                              ("C-", off + 1, load[off], False, height[off])])
        wall = file.create_group("obstacles/wall")
        for name, value in (("type", "line"), ("side", ""), ("foundation", "rigid")):
            wall.attrs[name] = np.bytes_(value)
        wall.attrs["points"] = np.array(((1.0, 0.02), (0.0, 0.02)))


def write_cantilever(filename):
    """Two points, no contact, no fields, no critical points."""
    with h5py.File(filename, "w") as file:
        write_root(file, "running")
        put(file, "mesh/coordinates", np.array(((0.0, 0.0), (1.0, 0.0))), "length")
        put(file, "mesh/elements", np.array(((0, 1),)))
        put(file, "path/load_factor", np.array((0.5, 1.0)))
        put(file, "path/monitor/tip", np.array((0.15, 0.3)), "length")

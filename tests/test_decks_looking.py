"""Monitors, *LOCATE, *TURNING POINTS and output requests leave path and critical points as they are: to the last bit, for nothing
of them enters an equation. And what they see belongs to the deck's material points, wherever the nodes of a contact have gone."""
import functools

import numpy as np
import pytest

import deck_runner as dr

LOOKED = {"UZ", "TP"}      # labels of points that are on the path only because somebody asked


def without(text, *cards):
    """The deck without some of its cards and their data lines."""
    keep, lines = True, []
    for line in dr.changed(text).splitlines(keepends=True):
        if line.startswith("*"):
            keep = not line.upper().startswith(cards)
        lines += [line] if keep else []
    return "".join(lines)


def watch(*lines):
    return "".join(f"*MONITOR, NAME=watch{k}\n{line}\n" for k, line in enumerate(lines))


def own(run, name):
    """A column at the path's own points."""
    looked = [critical.point - 1 for critical in run.results.critical if critical.label in LOOKED]
    return np.delete(run.column(name), looked)


def same_path(run, quiet, names):
    for name in ("load_factor", "arc_length", "negative_pivots", "iterations", *names):
        assert np.array_equal(own(run, name), own(quiet, name)), name
    mine, plain = ([(c.label, c.load_factor, c.located) for c in r.results.critical if c.label not in LOOKED] for r in (run, quiet))
    assert mine == plain


def quiet_deck(name):
    return without(dr.on_given_mesh(name), "*LOCATE", "*FIELD OUTPUT")


@functools.cache
def quiet(name):
    return dr.run_deck(quiet_deck(name))


# Nodes that the contact passes: of the ring, beside its lift-off point at the limit load; of the column and the liner all of them.
SEEN = {"ring": ("v", ["49, U1", *(f"{node}, {u}" for node, u in zip(range(40, 60), 7 * ("U2", "UR", "U1"))), "RING, UR"]),
        "column": ("shortening", ["2, U1", "2, UR", "COLUMN, U2", *(f"{node}, U2" for node in range(30, 50))]),
        "liner": ("v", ["LINER, UR", "2, U1", *(f"{node}, U1" for node in range(20, 60))])}


@dr.release_only
@pytest.mark.parametrize("name", SEEN)
def test_a_monitor_changes_nothing(name):
    known, lines = SEEN[name]
    same_path(dr.run_deck(dr.changed(quiet_deck(name), ("*STEP", watch(*lines) + "*STEP"))), quiet(name), [known])


@pytest.mark.parametrize("node", [48, 49, 50, 51])
def test_one_monitor_beside_the_lift_off_point(node):
    """81.562949 with the one at 49, 290 times the error of the mesh, while such a monitor held its node."""
    run = dr.run_deck(dr.changed(quiet_deck("ring"), ("*STEP", watch(f"{node}, U1") + "*STEP")))
    assert run.load("LP") == quiet("ring").load("LP")


REQUESTS = {"ring": ("*LOCATE\nLOAD, 28., 34., 57., 62.\nwatch0, -0.002, -0.003, -0.0039, -0.01\n*TURNING POINTS\nwatch0, watch1\n",
                     ["50, U1", "45, UR"]),
            "column": ("*LOCATE\nwatch0, 0.001, -0.001, 0.01\nwatch1, 0.01, 0.018, 0.0015\n*TURNING POINTS\nwatch0, watch1\n",
                       ["35, UR", "38, U2"]),
            "liner": ("*LOCATE\nwatch0, 0.01, 0.02\nLOAD, 20., 40.\n*TURNING POINTS\nwatch0, watch1\n", ["30, UR", "40, U1"])}


@dr.release_only
@pytest.mark.parametrize("name", REQUESTS)
def test_requests_change_nothing(name):
    cards, lines = REQUESTS[name]
    output = "*FIELD OUTPUT, EVERY=3\nDISPLACEMENT, SECTION FORCES, REACTION, GAP\n"
    run = dr.run_deck(dr.changed(quiet_deck(name), ("*STEP\n" if name != "liner" else "*STEP, NAME=PRESSURE\n",
                                                    watch(*lines) + "*STEP\n"), ("*STOP", cards + output + "*STOP")))
    assert len(run.labelled("UZ")) >= 2 and len(run.labelled("TP")) >= 1
    same_path(run, quiet(name), [SEEN[name][0]])


CLAMPED = """*HEADING
Clamped column pressed on a wall at midspan
*NODE
1, 0., 0.
2, 0.5, 0.
3, 1.0, 0.
*LINE, ELSET=COLUMN, NSET=COLUMN, TYPE=GE6
1, 2, 40
2, 3, 40
*IMPERFECTION, ELSET=COLUMN, SHAPE=CLAMPED
1e-08, 0.0
*BEAM SECTION, ELSET=COLUMN, SECTION=STIFFNESS
1200000000.0, 1.0
*BOUNDARY
1, ENCASTRE
3, YSYMM
*OBSTACLE, NAME=WALL, TYPE=LINE
1.0, 0.0001, 0., 0.0001
*CONTACT, OBSTACLE=WALL, NSET=COLUMN
*MONITOR, NAME=shortening
3, U1, -1.0
*MONITOR, NAME=mid
2, U2, 1.0, 1e-08
*STEP
*STATIC, METHOD=CYLINDRICAL
0.1
*CLOAD
3, 1, -39.47841760435743
*STOP
LOAD, ABOVE, 3.9
*END STEP
"""


def test_a_monitor_at_the_contact_point_makes_no_bifurcation():
    """The symmetric path is stable up to 4 Pcr: held at its node, the contact point could not give way to a sway at 2.04575."""
    run = dr.run_deck(CLAMPED)
    assert [c.label for c in run.results.critical] == ["C+", "EP"]
    assert not np.any(run.column("negative_pivots"))
    same_path(run, dr.run_deck(dr.changed(CLAMPED, ("*MONITOR, NAME=mid\n2, U2, 1.0, 1e-08\n", ""))), ["shortening"])


# ---- what is seen ----

@functools.cache
def field_at(elements, element="GE4", load=57.0):
    """The ring on equal elements at a load before the limit point: outward and forward displacement, rotation (nodes, 3) along the
    arc; and the largest change of curvature per length."""
    text = dr.changed(without(dr.on_given_mesh("ring"), "*LOCATE"), ("0., 0., 160, 6.", f"0., 0., {elements}"),
                      ("TYPE=GE4", f"TYPE={element}"), ("v, ABOVE, 0.6", f"LOAD, ABOVE, {load}"), ("DISPLACEMENT, REACTION", "DISPLACEMENT, SECTION FORCES"))
    run = dr.run_deck(text)
    results = run.results
    x, u = results.mesh.coordinates, results.field("displacement", results.n_points)
    order = np.argsort(-x[:, 1])
    x, u = x[order], u[order]
    forward = np.column_stack((-x[:, 1], x[:, 0]))
    shear = np.max(np.abs(results.field("section_forces", results.n_points)[..., 1]))
    return np.column_stack((np.sum(u[:, :2] * x, axis=1), np.sum(u[:, :2] * forward, axis=1), u[:, 2])), shear


@pytest.mark.parametrize("elements", [40, 80, 160, 320])
def test_displacements_are_those_of_material_points(elements):
    """Inside an element of length l the collocation polynomial of GE4 misses place and rotation by at most
    |t^3/3 - t^2/2 + t/6|/2 = 0.0080 times the third derivative of the position, the curvature's change, times l^3, and of the
    moment's second derivative likewise, that is the normal force times the curvature's change. An element beside a contact
    point is at most 1.9 times as long as at home. (While the difference of two material points was stored: 3e-3 with 160.)"""
    (field, _), (exact, shear) = field_at(elements), field_at(640, "GE6")
    bound = 0.008 * shear * (1.9 * np.pi / elements) ** 3
    error = np.max(np.abs(field - exact[::640 // elements]), axis=0)
    # The nodes themselves: reactions at nodes, r h^4/384 EI.
    nodes = 57.0 * (np.pi / elements) ** 4
    assert np.all(error[:2] <= bound + nodes), (error, bound)
    assert error[2] <= 10.0 * bound + nodes, (error, bound)


@dr.release_only
def test_displacement_is_smooth_along_the_rod():
    """At every stored point of the shipped deck: along the rod a node leaves the cubic through its four neighbours by the fourth
    derivative over 24 times the product of the distances, where the displacement's fourth derivative is the curvature's change,
    and by what the profile misses at all five (weights 1, 1/6, 2/3, 2/3, 1/6). Its elements: equal parts of the free span, as many
    as the deck had where contact was found; they grow with the span, while the deck's stay at 0.45 degrees at the apex."""
    run = dr.run_deck(dr.changed(dr.on_given_mesh("ring"), ("DISPLACEMENT, REACTION", "DISPLACEMENT, SECTION FORCES")))
    results = run.results
    x = results.mesh.coordinates
    order = np.argsort(-x[:, 1])
    x = x[order]
    arc = np.arccos(np.clip(x[:, 1], -1.0, 1.0))
    forward = np.column_stack((-x[:, 1], x[:, 0]))
    angle = np.radians(dr.regions(run, "angle_start"))
    elements = np.count_nonzero(arc < angle[np.flatnonzero(np.isfinite(angle) & (angle > 0.0))[0]])
    for point in results.field_points:
        along = np.sum(results.field("displacement", point)[order, :2] * forward, axis=1)
        change = np.max(np.abs(results.field("section_forces", point)[..., 1]))
        for i in range(2, len(arc) - 2):
            near = [i - 2, i - 1, i + 1, i + 2]
            value = dr.interpolate(arc[near], along[near], arc[i], points=4)[0]
            longest = 1.9 * np.max(np.diff(arc[i - 2:i + 3]))
            if arc[i] < angle[point - 1]:
                longest = max(longest, angle[point - 1] / elements)
            bound = np.prod(np.abs(arc[i] - arc[near])) / 24.0 + 8.0 / 3.0 * 0.008 * longest**3
            assert abs(value - along[i]) <= change * bound + 1e-12, (point, i)

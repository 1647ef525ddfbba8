"""Cantilevers without contact against closed forms: elements of all orders, and no contact work at all.

Exact values: reference/bench_*.csv (elliptic integrals and circles), 14 digits, for inextensible rods.
"""
import functools
import os

import h5py
import numpy as np
import pytest

import deck_runner as dr

# EA L^2/EI = 1E12: the rod gets P/EA = 1e-11 longer at P = 10; Newton stops at a residual of 1e-9, quadratically.
STRETCH = 1e-11


@functools.cache
def cantilever(element="GE4", elements=16, load=10, tolerance="1E-12", stiffness="1E12"):
    """Tip values u, w, rotation at a load P L^2/EI; newly run with a firm tolerance."""
    run = dr.run_deck(dr.changed(
        dr.on_given_mesh("cantilever"), ("TYPE=GE4", f"TYPE={element}"), ("1, 2, 16", f"1, 2, {elements}"),
        ("1., 1E-3, 1.\n", f"1., 1E-3, 1.\n*CONTROLS, TOLERANCE={tolerance}\n"), ("ABOVE, 10.", f"ABOVE, {load}"),
        ("1E12, 1.", f"{stiffness}, 1.")))
    return np.array([run.column(name)[-1] for name in ("u", "w", "rotation")])


@functools.cache
def exact(load=10):
    table = dr.reference("bench_a_cantilever_tip_load")
    row = np.flatnonzero(table["PL2_over_EI"] == load)
    assert len(row) == 1
    return np.array([table[name][row[0]] for name in ("u", "w", "theta")])


def test_cantilever_deck_follows_the_table():
    """GE4, h = 1/16, wave number sqrt(10): (k h)^4/180 is 1e-5, of displacements of order 1."""
    run, table = dr.run_deck(dr.on_given_mesh("cantilever")), dr.reference("bench_a_cantilever_tip_load")
    loads = run.column("load_factor")[1:]
    dr.assert_close(loads, np.arange(1.0, 11.0), relative=1e-14)
    for name, header in (("u", "u"), ("w", "w"), ("rotation", "theta")):
        expected = table[header][:10]
        dr.assert_close(table["PL2_over_EI"][:10], loads, relative=1e-14)
        dr.assert_close(run.column(name)[1:], expected, absolute=1e-5)


@pytest.mark.parametrize("element, order, elements", [("GE2", 2, (16, 32, 64)), ("GE4", 4, (8, 16, 32)),
                                                      ("GE6", 6, (4, 8, 16)), ("GE8", 8, (2, 4))])
def test_order_at_the_nodes(element, order, elements):
    errors = [np.max(np.abs(cantilever(element, n, 4) - exact(4))) for n in elements]
    assert errors[-1] > 10 * STRETCH, "too fine to show the order"
    dr.assert_order(errors, order, below=0.7, above=1.0)


def test_order_of_ul2():
    """Its normal force is EA times a difference of coordinates, so EA must be moderate; GE8 solves the same rod."""
    same = cantilever("GE8", 64, 4, stiffness="1E5")
    errors = [np.max(np.abs(cantilever("UL2", n, 4, "1E-9", "1E5") - same)) for n in (16, 32, 64)]
    dr.assert_order(errors, 2, below=0.4, above=0.5)


@pytest.mark.parametrize("element, elements", [("GE6", 64), ("GE8", 32), ("GE8", 64)])
def test_down_to_rounding(element, elements):
    """What is left is the stretch by EA, and rounding: 1e-16 times the condition h^-2 and the root of n."""
    floor = 2.0 * STRETCH + 1e-16 * elements**2.5
    dr.assert_close(cantilever(element, elements), exact(), absolute=floor)


def test_very_many_elements_do_no_harm():
    """Stored resultants do not lose EA eps n, which would be 2e-5 of the load here; Newton stops at 1e-9."""
    dr.assert_close(cantilever("GE4", 2000, tolerance="1E-9", stiffness="1E8"),
                    cantilever("GE8", 32, stiffness="1E8"), absolute=1e-8)


def test_rollup_deck():
    """The tip's rotation is exact for elements of any order. Increments are cut to what the tangent of the path may turn, half
    a radian, and are planned to 0.7 of it; no faster than the tip does it turn."""
    run = dr.run_deck(dr.on_given_mesh("rollup"))
    load = run.column("load_factor")
    # TOLERANCE of the moment
    dr.assert_close(run.column("rotation"), 2.0 * np.pi * load, absolute=1e-9 * 4.0 * np.pi)
    angle = 2.0 * np.pi * load[1:]
    # Two Gauss points on an arc of an element's angle.
    limit = (4.0 * np.pi / 16.0)**4 / 4320.0
    dr.assert_close(run.column("x")[1:], np.sin(angle) / angle, absolute=limit)
    dr.assert_close(run.column("y")[1:], (1.0 - np.cos(angle)) / angle, absolute=limit)
    dr.assert_close(load[-1], 2.0, absolute=1e-14)
    assert len(load) <= 4.0 * np.pi / 0.35


@pytest.mark.parametrize("element", ["GE2", "GE4", "GE6", "GE8"])
def test_rollup_follows_the_table(element):
    """The tip's rotation is exact; its place on the circle as the order lets it: angle pi/4 an element at 2 turns."""
    table = dr.reference("bench_b_rollup")
    rows = np.flatnonzero((table["ML_over_2piEI"] < 2.0) & (table["ML_over_2piEI"] % 1.0 > 0.0))
    loads = "".join(f"LOAD, {load:.15g}\n" for load in table["ML_over_2piEI"][rows])
    run = dr.run_deck(dr.changed(dr.on_given_mesh("rollup"), ("TYPE=GE4", f"TYPE={element}"), ("1, 2, 16", "1, 2, 64"),
                                 ("*STOP", f"*LOCATE\n{loads}*STOP")))
    points = [c.point - 1 for c in run.labelled("UZ")]
    dr.assert_close(run.column("load_factor")[points], table["ML_over_2piEI"][rows], relative=1e-8)
    dr.assert_close(run.column("rotation")[points], table["theta"][rows], relative=1e-8)
    # LOCATE is 1e-8. Gauss points of order p integrate cos over an element of h = 4 pi/64 to h^p/(4 p!) or better, over
    # a circle of radius 1/4 pi.
    limit = {"GE2": 2e-3, "GE4": 2e-6, "GE6": 1e-8, "GE8": 1e-8}[element]
    dr.assert_close(run.column("x")[points], table["x"][rows], absolute=limit)
    dr.assert_close(run.column("y")[points], table["y"][rows], absolute=limit)


def test_section_forces_are_those_of_equilibrium():
    """The moment is P times the lever arm to the tip, normal and shear force the components of P, at both ends of all.

    Each node's balance is left open by up to 1e-9 P, so sums over 16 elements by 1e-8 P.
    """
    run = dr.run_deck(dr.on_given_mesh("cantilever"))
    results, point = run.results, run.results.n_points
    u = results.field("displacement", point)
    place = results.mesh.coordinates + u[:, :2]
    forces = results.field("section_forces", point)
    tip = np.argmax(results.mesh.coordinates[:, 0])
    for end in (0, 1):
        node = results.mesh.elements[:, end]
        angle = u[node, 2]
        dr.assert_close(forces[:, end, 2], 10.0 * (place[tip, 0] - place[node, 0]), absolute=1e-7)
        dr.assert_close(forces[:, end, 0], 10.0 * np.sin(angle), absolute=1e-7)
        dr.assert_close(forces[:, end, 1], 10.0 * np.cos(angle), absolute=1e-7)


@pytest.mark.parametrize("deck", ["cantilever", "rollup"])
def test_no_contact_work(deck):
    """No contact group, no columns, no counters of contact, no time spent on it."""
    run = dr.run_deck(dr.on_given_mesh(deck))
    with h5py.File(os.path.join(run.folder.name, f"{deck}.h5"), "r") as file:
        names = []
        file.visit(names.append)
        assert "contact" not in file and "obstacles" not in file
        assert not [name for name in names if "reaction" in name or "gap" in name or "candidate" in name]
        for name in ("active_contacts", "lcp_size", "lcp_pivots"):
            assert name not in file["path"] or not np.any(file[f"path/{name}"][()])
    cost = run.results.performance
    for phase, calls in zip(cost["phase"], cost["calls"]):
        assert "contact" not in str(phase) or calls == 0
    for counter, value in zip(cost["counter"], cost["value"]):
        assert not any(word in str(counter).lower() for word in ("lcp", "contact")) or value == 0
    assert "contact" not in run.stdout.lower() and "lcp" not in run.stdout.lower()


@pytest.mark.parametrize("deck", ["cantilever", "rollup"])
def test_the_last_point_is_labelled_as_the_end(deck):
    run = dr.run_deck(dr.on_given_mesh(deck))
    assert run.results.path["label"].values[-1] == "EP"
    assert run.only("EP").point == run.results.n_points


def test_euler_postbuckling():
    """A clamped column with a minute disturbance follows the elastica beyond Pcr = pi^2/4: tip place at tip angles."""
    table = dr.reference("bench_c_euler_postbuckling")
    keep = table["alpha_deg"] >= 20
    angles = np.radians(table["alpha_deg"][keep][:6])
    deck = dr.changed(dr.on_given_mesh("cantilever"), ("METHOD=LOAD\n1., 1E-3, 1.", "METHOD=CYLINDRICAL\n0.1, 1E-9, 0.05"),
                      ("TYPE=GE4", "TYPE=GE6"), ("2, 2, 1.\n*STOP\nLOAD, ABOVE, 10.",
                       "2, 1, -2.4674011002723395\n2, 2, 1E-7\n*LOCATE\n"
                       + "".join(f"rotation, {angle:.15g}\n" for angle in angles) + "*STOP\nrotation, ABOVE, 2.5"))
    points = dr.run_deck(deck).labelled("UZ")
    # The disturbance of 1e-7 P shifts the branch by about as much over the sine of the angle.
    dr.assert_close([c.load_factor for c in points], table["P_over_Pcr"][keep][:6], relative=1e-6)
    dr.assert_close([1.0 - c.monitors["u"] for c in points], table["x"][keep][:6], absolute=1e-6)
    dr.assert_close([c.monitors["w"] for c in points], table["y"][keep][:6], absolute=1e-6)

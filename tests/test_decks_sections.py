"""Monitors of sections: section forces, strain and stress at a place or the largest along a set, as *LOCATE and *STOP use them.

References: cantilevers, whose section forces are sums of loads; the column under an eccentric load, M = P d sec(k L)."""
import math

import numpy as np
import pytest

import deck_runner as dr

E, B, H = 2.1e5, 0.3, 0.5
AREA, INERTIA = B * H, B * H**3 / 12


def beam(monitors, loads, end=1.0, first=1.0, elements="", kind="GE8", more="", method="LOAD", nodes="1, 0., 0.\n2, 4., 0.\n"):
    text = (f"*HEADING\nsections\n*NODE\n{nodes}*LINE, ELSET=BEAM, NSET=BEAM, TYPE={kind}\n1, 2{elements}\n*MATERIAL, NAME=M\n*ELASTIC\n{E!r}\n"
            f"*BEAM SECTION, ELSET=BEAM, SECTION=RECT, MATERIAL=M\n{B!r}, {H!r}\n*BOUNDARY\n1, ENCASTRE\n*MONITOR, NAME=v\n2, U2\n")
    text += "".join(f"*MONITOR, NAME={name}, ELSET=BEAM\n{line}\n" for name, line in monitors.items())
    return text + f"*STEP\n*STATIC, METHOD={method}\n{first!r}\n{loads}{more}*STOP\nLOAD, ABOVE, {end!r}\n*END STEP\n"


@pytest.mark.parametrize("kind, elements", [("GE8", ""), ("GE4", ", 8"), ("UL2", ", 8")])
def test_forces_of_a_cantilever(kind, elements):
    """Small deflections under p downwards and a pull: N, Q, M at places and at both ends, the largest at the foot."""
    p, pull = 1e-4, 2e-4
    monitors = {"n0": "N, 0.", "q0": "Q, 0.", "m0": "M, 0.", "m1": "M, 1.", "q4": "Q, 4.", "m": "M", "at": "M AT", "e": "STRAIN", "sigma": "STRESS"}
    run = dr.run_deck(beam(monitors, f"*DLOAD\nBEAM, PY, {-p!r}\n*CLOAD\n2, 1, {pull!r}\n", elements=elements, kind=kind))
    last = {name: run.column(name)[-1] for name in monitors}
    small = 1e-4        # slopes of p L^3/EI = 1e-5; UL2 has linear moments: their mean differs by p h^2/12
    inside = p * (4 / 8)**2 / 8 if kind == "UL2" else 0
    dr.assert_close(last["n0"], pull, relative=small)
    dr.assert_close(last["q0"], -4 * p, relative=small, absolute=p / 4 if kind == "UL2" else 0)
    dr.assert_close(last["m0"], -8 * p, relative=small, absolute=2 * inside)
    dr.assert_close(last["m1"], -4.5 * p, relative=small, absolute=2 * inside)
    dr.assert_close(last["m"], 8 * p, relative=small, absolute=2 * inside)
    dr.assert_close(last["q4"], 0, absolute=p / 4 if kind == "UL2" else 1e-4 * p)
    assert last["at"] == 0
    stress = pull / AREA + 8 * p * H / 2 / INERTIA
    if kind != "UL2":
        dr.assert_close([last["sigma"], last["e"]], [stress, stress / E], relative=small)


def test_sides_of_a_node_are_sets():
    """A couple of 3 at the middle: the moment on its left and on its right, each the end of a set."""
    text = dr.changed(beam({}, "*CLOAD\n3, 6, 3e-4\n2, 2, 1e-4\n"), ("2, 4., 0.\n", "2, 4., 0.\n3, 2., 0.\n"), ("1, 2\n*MAT", "1, 3, 2\n3, 2, 2\n*MAT"),
                      ("*MONITOR, NAME=v", "*ELSET, ELSET=LEFT\n1, 2\n*ELSET, ELSET=RIGHT\n3, 4\n*MONITOR, NAME=left, ELSET=LEFT\nM, 2.\n"
                       "*MONITOR, NAME=right, ELSET=RIGHT\nM, 0.\n*MONITOR, NAME=v"))
    run = dr.run_deck(text)
    dr.assert_close(run.column("right")[-1], 2e-4, relative=1e-4)
    dr.assert_close(run.column("left")[-1], 5e-4, relative=1e-4)


def test_largest_moment_inside_the_span():
    """Hinged beam under a triangular load q s/L: the largest moment q L^2/(9 sqrt 3) at s = L/sqrt 3, not at a node."""
    q = 1e-4
    text = beam({"m": "M", "at": "M AT", "m2": "M, 1.1"}, "*DLOAD\nBEAM, PY, q\n", elements=", 3")
    text = dr.changed(text, ("1, ENCASTRE\n", "1, 1, 2\n2, 2\n"), ("*MATERIAL, NAME=M\n", f"*DISTRIBUTION, NAME=q, ELSET=BEAM\n0., 0.\n4., {-q!r}\n*MATERIAL, NAME=M\n"))
    run = dr.run_deck(text)
    dr.assert_close(run.column("m")[-1], q * 16 / (9 * math.sqrt(3)), relative=1e-6)
    dr.assert_close(run.column("at")[-1], 4 / math.sqrt(3), relative=1e-4)        # the value is flat there
    dr.assert_close(run.column("m2")[-1], q * 4 / 6 * 1.1 * (1 - (1.1 / 4)**2) * 1, relative=1e-6)


def test_first_yield_is_located():
    """Eccentrically loaded column, clamped below: stress P/A + (P d sec(k L)) H/2/I reaches the yield stress; P is told as UZ with its
    bar, and *STOP ends the path there. Second order in the slope: 1e-4."""
    length, d, sigma_y = 20.0, 0.002, 30.0

    def stress(p):
        return p / AREA + p * d / math.cos(length * math.sqrt(p / (E * INERTIA))) * (H / 2) / INERTIA
    low, high = 0.1, 0.999 * E * INERTIA * (math.pi / 2 / length)**2
    for _ in range(80):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if stress(middle) < sigma_y else (low, middle)
    text = beam({"sigma": "STRESS", "at": "STRESS AT"}, f"*CLOAD\n2, 1, -1.\n2, 6, {d!r}\n", end=50.0, first=1.0, more=f"*LOCATE\nsigma, {sigma_y!r}\n",
                method="CYLINDRICAL", nodes=f"1, 0., 0.\n2, {length!r}, 0.\n")
    run = dr.run_deck(dr.changed(text, ("LOAD, ABOVE, 50.0", f"sigma, ABOVE, {1.2 * sigma_y!r}\nLOAD, ABOVE, 50.0")))
    point = run.only("UZ")
    dr.assert_close(point.load_factor, low, relative=1e-3)
    assert point.error < 1e-5 * low
    dr.assert_close(point.monitors["sigma"], sigma_y, relative=1e-8)
    assert point.monitors["at"] < 0.01        # the moment is flat at the clamp
    dr.assert_close(run.column("sigma")[-1], 1.2 * sigma_y, relative=1e-8)


@pytest.mark.parametrize("elements", [2, 3, 4])
def test_bars_hold(elements):
    """A beam bent by a radian: moments and stresses of coarse meshes differ from those of a fine one by less than their bars."""
    monitors = {"m": "M, 1.3", "q": "Q, 2.7", "n": "N, 0.4", "largest": "M", "sigma": "STRESS"}
    loads = "*DLOAD\nBEAM, PY, -60.\n*CLOAD\n2, 1, 300.\n"
    deck = dr.changed(beam(monitors, loads, first=0.25), ("*STATIC", "*ACCURACY, TOLERANCE=1E-9, WIDEST=1\n*STATIC"))
    fine = dr.run_deck(dr.changed(deck, ("1, 2\n", "1, 2, 24\n"))).only("EP")
    coarse = dr.run_deck(dr.changed(deck, ("1, 2\n", f"1, 2, {elements}\n")), code=None).only("EP")
    for name in monitors:
        error = abs(coarse.monitors[name] - fine.monitors[name])
        assert error <= coarse.monitor_errors[name], (name, error, coarse.monitor_errors[name])
    assert max(coarse.monitor_errors.values()) < 0.05 * 2000


@pytest.mark.parametrize("kind, order", [("GE4", 2), ("GE6", 3), ("GE8", 4)])
def test_order_inside_and_at_the_foot(kind, order):
    """Moments inside elements have the order of the polynomial, s + 1 or better; at nodes that of the element, 2 s."""
    loads = "*DLOAD\nBEAM, PY, -60.\n*CLOAD\n2, 1, 300.\n"
    monitors = {"foot": "M, 0.", "inside": "M, 1.3"}
    deck = dr.changed(beam(monitors, loads, first=0.25, kind=kind), ("*STATIC", "*ACCURACY, POINTS=NONE\n*STATIC"))

    def values(n):
        run = dr.run_deck(dr.changed(deck, ("1, 2\n", f"1, 2, {n}\n")))
        return np.array([run.column(name)[-1] for name in monitors])
    exact = values(96)
    counts = {"GE4": (8, 16, 32), "GE6": (4, 8, 16), "GE8": (4, 8)}[kind]
    errors = np.abs([values(n) - exact for n in counts])
    dr.assert_mean_order(errors[:, 0], 2 * order)
    assert np.log2(errors[0, 1] / errors[-1, 1]) / (len(counts) - 1) > order


@pytest.mark.parametrize("kind, elements", [("GE8", ""), ("UL2", ", 8")])
def test_the_largest_strain_is_a_check(kind, elements):
    """A pulled bar has P/EA in every element: nothing is said at 4.9 %, the first point above 5 % says so, the exit code stays 0."""
    for end, large in (0.049, False), (0.06, True):
        run = dr.run_deck(beam({}, f"*CLOAD\n2, 1, {E * AREA!r}\n", end=end, first=0.007, elements=elements, kind=kind))
        dr.assert_close(run.results.accuracy["strain"], end, relative=1e-9)
        lines = run.stdout.splitlines()
        told = [k for k, line in enumerate(lines) if "! From here on strains are large" in line]
        assert len(told) == large
        if large:
            point = int(lines[told[0] - 1].split()[0])
            before, there = run.column("load_factor")[point - 2:point]
            assert before <= 0.05 < there
            assert "largest strain of the rods" in run.stdout


def test_the_largest_strain_is_that_of_the_outer_fibre():
    """M H/(2 EI) + N/EA at the foot, from a shape; EA and EI alone have the strain of the axis only."""
    pull, couple = 2e-4 * E * AREA, 3e-3 * E * INERTIA
    text = beam({}, f"*CLOAD\n2, 6, {couple!r}\n", elements=", 8")
    dr.assert_close(dr.run_deck(text).results.accuracy["strain"], 3e-3 * H / 2, relative=1e-9)
    text = dr.changed(beam({}, f"*CLOAD\n2, 1, {pull!r}\n2, 6, {couple!r}\n", elements=", 8"),
                      (f"SECTION=RECT, MATERIAL=M\n{B!r}, {H!r}", f"SECTION=STIFFNESS\n{E * AREA!r}, {E * INERTIA!r}"))
    dr.assert_close(dr.run_deck(text).results.accuracy["strain"], 2e-4, relative=1e-9)
    text = dr.changed(text, (f"SECTION=STIFFNESS\n{E * AREA!r}, ", "SECTION=INEXTENSIBLE\n"))
    assert "largest strain" not in dr.run_deck(text).stdout

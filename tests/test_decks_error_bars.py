"""Error bars against exact values: of many meshes that nobody tuned none is outside its bar, and the estimate is the error.

Exact loads: reference/ of the tests (arch-deep-hinged, the ring R/h = 100), Euler's columns with axial stiffness, limit loads
of the frame and the column beside a wall by meshes twelve times as fine whose own bars are far below what is compared.
"""
from __future__ import annotations

import functools
import math
import re

import numpy as np
import pytest

import deck_runner as dr

ORDERS = ("GE2", "GE4", "GE6", "GE8")
RING_100 = 81.557427564661
NOISE = 3e-11                    # over the largest load: what location and rounding leave of exact values


def remeshed(text, kind, n):
    """Another element, and n of them for every line or arc; bars of any width are fine."""
    text = dr.changed(text)
    text = re.sub(r"TYPE=GE\d", f"TYPE={kind}", text)
    rows = re.search(r"(\*(?:LINE|ARC)[^\n]*\n)((?:\d+,[^\n]*\n)+)", text)
    data = []
    for line in rows[2].splitlines():
        fields = line.split(",")
        data.append(", ".join([*(f.strip() for f in fields[:4 if "*ARC" in rows[1] else 2]), str(n)]))
    text = text.replace(rows[2], "\n".join(data) + "\n")
    text = re.sub(r"\*BRANCH[^*]*", "", text)
    return text.replace("*STEP\n", "*STEP\n*CONTROLS, LOCATE=1E-11\n*ACCURACY, WIDEST=1E9\n", 1)


def euler(kind, n):
    """A clamped column whose other end moves along its axis only: it buckles at 4 pi^2 EI, less what EA = 1E5 gives way by."""
    return (f"*NODE\n1, 0., 0.\n2, 1., 0.\n*LINE, ELSET=C, TYPE={kind}\n1, 2, {n}\n*BEAM SECTION, ELSET=C, SECTION=STIFFNESS\n1E5, 1.\n"
            "*BOUNDARY\n1, ENCASTRE\n2, YSYMM\n*MONITOR, NAME=x\n2, U1, -1.\n*STEP\n*CONTROLS, LOCATE=1E-11\n"
            "*ACCURACY, WIDEST=1E9\n*STATIC, METHOD=LOAD\n2., 1E-9, 3.\n*CLOAD\n2, 1, -10.\n*STOP\nLOAD, ABOVE, 5.\n")


def euler_load():
    """P (1 - P/EA) = 4 pi^2 EI in tenths: the column is shorter by P/EA, its sections turn with strain energy EI as before."""
    return 0.1 * 0.5 * (1.0 - math.sqrt(1.0 - 4.0 * 4.0 * math.pi**2 / 1e5)) * 1e5


# These do not have the bifurcation before the end, and elements of one order more do: the run says so.
MISSED = {("euler", "GE2", 3)}


@functools.cache
def critical(name, kind, n):
    text = euler(kind, n) if name == "euler" else remeshed(dr.on_given_mesh(name), kind, n)
    run = dr.run_deck(text + ("*END STEP\n" if name == "euler" else ""), code=2 if (name, kind, n) in MISSED else 0)
    return run.results.critical


@functools.cache
def exact(name):
    """Loads of the limit points, bifurcations and contact events of a scene, in order, by label."""
    if name == "euler":
        return {"BP": [euler_load()]}
    if name == "ring":
        return {"LP": [RING_100]}
    fine = [c for c in critical(name, "GE8", {"column": 90}.get(name, 32)) if c.label in ("LP", "BP", "C+", "C-")]
    found = {}
    for c in fine:
        assert c.error < 1e-8 * max(abs(d.load_factor) for d in fine), f"{name}: the reference has a bar of {c.error}"
        found.setdefault(c.label, []).append(c.load_factor)
    return found


def compared(name, kinds, meshes):
    """Rows (estimate, bar, true error, scale) of all critical loads whose error is above the noise; others must be within it."""
    rows = []
    scale = max(abs(load) for loads in exact(name).values() for load in loads)
    for kind in kinds:
        for n in meshes:
            number = {}
            for c in critical(name, kind, n):
                k = number[c.label] = number.get(c.label, -1) + 1
                if k >= len(exact(name).get(c.label, [])):
                    continue
                rows.append((c.corrected - c.load_factor, c.error, exact(name)[c.label][k] - c.load_factor, scale))
    return np.array(rows)


def assert_bars(rows, least, under=0):
    """No error outside its bar, those above the noise well estimated, and bars for nearly all below one percent."""
    estimate, bar, error, scale = rows.T
    size = np.abs(error)
    assert not np.any(np.isnan(bar)), "no estimate"
    small = size <= 1e-2 * scale
    unknown = np.isinf(bar)
    outside = ~unknown & (size > bar + NOISE * scale)
    assert np.count_nonzero(outside & small) <= under, f"outside their bars: {rows[outside]}"
    assert np.count_nonzero(unknown & small) <= max(1, 0.1 * np.count_nonzero(small)), f"without a bar: {rows[unknown & small]}"
    told = ~unknown & small & (size > 10.0 * NOISE * scale)
    assert np.count_nonzero(told) >= least
    ratio = estimate[told] / error[told]
    assert 0.95 < np.median(ratio) < 1.05, f"estimate over error {np.sort(ratio)}"
    assert 1.0 < np.median(bar[told] / size[told]) < 4.0, f"bar over error {np.sort(bar[told] / size[told])}"


@dr.release_only
@pytest.mark.parametrize("name, kinds, meshes, least", [
    pytest.param("lee-frame", ORDERS, (3, 5, 7, 11, 16), 18, marks=dr.release_only),
    ("arch-clamped-hinged", ORDERS[1:], (5, 7, 11, 16), 6),
    ("arch-deep-hinged", ORDERS[1:], (5, 7, 11, 16), 14),
    ("euler", ORDERS, (3, 5, 7, 11, 16, 23), 14),
    ("ring", ORDERS[1:], (5, 13, 21), 4),
    ("column", ORDERS[1:], (7, 11, 16), 20)])
def test_bars_of_critical_loads(name, kinds, meshes, least):
    """Limit points, bifurcations, contact that begins and ends; orders 2 to 8."""
    assert_bars(compared(name, kinds, meshes), least)


def test_estimates_fall_as_the_errors_do():
    """Order 4: both by 16 when the mesh is halved."""
    errors, estimates = [], []
    for n in (8, 16, 32):
        c = next(c for c in critical("euler", "GE4", n) if c.label == "BP")
        errors.append(euler_load() - c.load_factor)
        estimates.append(c.corrected - c.load_factor)
    dr.assert_order(errors, 4, below=0.5, above=0.5)
    dr.assert_order(estimates, 4, below=0.5, above=0.5)


# ---- points of the path ----

def test_every_point_of_a_path():
    """POINTS=ALL: the frame's load at given v, by two elements of order 4 for each half of it, and by twelve of order 8."""
    def frame(kind, n):
        text = dr.changed(remeshed(dr.on_given_mesh("lee-frame"), kind, n), ("WIDEST=1E9", "WIDEST=1E9, POINTS=ALL"),
                          ("METHOD=CYLINDRICAL\n0.3, 1E-9, 0.02", "METHOD=DISPLACEMENT, MONITOR=v\n0.02, 0.02, 0.02"),
                          ("LOAD, ABOVE, 40.", "v, ABOVE, 0.36"))
        return dr.run_deck(text).results
    coarse, fine = frame("GE4", 4), frame("GE8", 12)
    rows = slice(1, 17)
    v = coarse.column("v").values[rows]
    dr.assert_close(fine.column("v").values[rows], v, absolute=1e-12)
    load = coarse.column("load_factor").values[rows]
    error = fine.column("load_factor").values[rows] - load
    dr.assert_close(coarse.column("corrected").values[rows] - load, error, relative=0.2, absolute=1e-6)
    bar = coarse.errors["load_factor"].values[rows]
    assert np.all(np.abs(error) <= bar) and np.all(bar <= 10.0 * np.abs(error) + 1e-3)
    assert np.all(coarse.errors["v"].values[rows] == 0.0) and np.all(coarse.errors["u"].values[rows] > 0.0)


def test_monitors_at_a_given_load():
    """A cantilever that rolls far up: displacements and rotation of its tip, reactions of its clamp."""
    def tip(kind, n):
        text = (f"*NODE\n1, 0., 0.\n2, 1., 0.\n*LINE, ELSET=C, TYPE={kind}\n1, 2, {n}\n*BEAM SECTION, ELSET=C, SECTION=STIFFNESS\n1E4, 1.\n"
                "*BOUNDARY\n1, ENCASTRE\n*MONITOR, NAME=u\n2, U1\n*MONITOR, NAME=v\n2, U2\n*MONITOR, NAME=turn\n2, UR\n"
                "*MONITOR, NAME=push\n1, RF1\n*MONITOR, NAME=couple\n1, RM\n*STEP\n*STATIC, METHOD=LOAD\n0.1\n*CLOAD\n2, 2, 8.\n*END STEP\n")
        return dr.run_deck(text).only("EP")
    fine = tip("GE8", 40)
    for kind, n in (("GE2", 40), ("GE4", 6), ("GE6", 4), ("GE8", 3)):
        end = tip(kind, n)
        assert end.error == 0.0
        for name in ("u", "v", "turn", "couple"):
            error = abs(fine.monitors[name] - end.monitors[name])
            assert 1e-9 < error <= end.monitor_errors[name] <= 10.0 * error + 1e-9, f"{kind} {name}: {error}"


def test_sums_of_contact_forces():
    """What the cavity pushes the half ring with, normal, in x and in y, at given loads; in y it is the ring's own weight."""
    def ring(kind, n):
        watched = "".join(f"*MONITOR, NAME={q}, OBSTACLE=CAVITY\n{q}\n" for q in ("RN", "RF1", "RF2"))
        text = remeshed(dr.on_given_mesh("ring"), kind, n).replace("*STEP\n", watched + "*STEP\n", 1)
        return dr.run_deck(text).labelled("UZ")
    fine = ring("GE8", 40)
    for kind, n in (("GE4", 5), ("GE6", 5)):
        for end, exact in zip(ring(kind, n), fine):
            assert end.load_factor == pytest.approx(exact.load_factor, rel=1e-9)
            for name in ("RN", "RF1"):
                error = abs(exact.monitors[name] - end.monitors[name])
                assert error <= end.monitor_errors[name] + 1e-8 * abs(end.monitors[name])
                assert end.monitor_errors[name] <= 10.0 * error + 1e-6 * abs(end.monitors[name])


def test_the_force_of_a_contact_that_grows():
    """A roller pushes a beam down: first a point at the line of symmetry, then a line. EA is 1E8 times EI,
    and what it makes of the cuts beside the line cancels.
    """
    def roller(kind, n):
        return dr.run_deck(remeshed(dr.on_given_mesh("indenter"), kind, n)).only("EP")
    exact = roller("GE8", 24).monitors["force"]
    for kind, n in (("GE4", 6), ("GE4", 12), ("GE6", 4)):
        end = roller(kind, n)
        error = abs(end.monitors["force"] - exact)
        assert error <= end.monitor_errors["force"] + 1e-8 <= 2e-5, f"{kind} {n}: {error}"


# ---- what is not known, and what fails ----

def test_nothing_is_told_without_reason():
    """UL2 elements, contact at nodes, foundations at nodes: no estimate, and the listing says why."""
    texts = [dr.on_given_mesh("ring-ul2")] + [re.sub(r"(CONTACT, OBSTACLE=\w+)", r"\1, POINTS=NODES", dr.on_given_mesh(name))
                                              for name in ("arch-soil", "winkler-point")]
    for text in texts:
        run = dr.run_deck(text)
        assert run.results.critical
        assert all(math.isnan(c.error) and math.isnan(c.corrected) for c in run.results.critical)
        assert "no estimate" in run.stdout and "the nodes of the mesh" in run.stdout


def test_too_wide_a_bar_fails_the_run():
    """Code 2, and the status says which load; the path is there to its end. With a wider WIDEST all is well."""
    text = remeshed(dr.on_given_mesh("lee-frame"), "GE4", 2)
    wide = dr.run_deck(text.replace("WIDEST=1E9", "WIDEST=0.001"), code=2)
    good = dr.run_deck(text)
    assert "the mesh is too coarse for what was asked: v of LP at point" in wide.results.status
    assert wide.results.n_points == good.results.n_points and good.results.status == "complete"
    load = np.abs(good.column("load_factor"))
    worst = max(c.error / np.max(load[:c.point]) for c in good.results.critical)
    dr.assert_close(good.results.accuracy["error_bar"], worst, relative=1e-12)


def test_a_force_that_is_the_value_asked_for():
    """The roller's force on an arc of contact, with two to four elements: at the point where it has the value asked for, the load errs
    within its bar, and the force has a bound, which falls with the elements."""
    exact = 0.90595373152                                # 24 elements of order 8, their own bar 2.5e-9
    widest = math.inf
    for kind, n in (("GE4", 2), ("GE4", 3), ("GE4", 4), ("GE6", 4)):
        run = dr.run_deck(remeshed(dr.on_given_mesh("indenter"), kind, n).replace("*CONTROLS, LOCATE=1E-11\n*ACCURACY, WIDEST=1E9\n", ""))
        point = run.labelled("UZ")[1]
        dr.assert_close(point.monitors["force"], 15.0, relative=1e-9)
        assert abs(point.load_factor - exact) <= point.error <= 1e-4, (kind, n)
        assert point.monitor_errors["force"] < widest, (kind, n)
        widest = point.monitor_errors["force"]
    assert widest < 1e-6


BEAM_ON_POSTS = """*HEADING
A beam under load and thrust on two round posts
*NODE
1, 0, 0
2, 0.6, 0
3, 1, 0
*LINE, ELSET=BEAM, NSET=BEAM, TYPE=GE8
1, 2, {n}
2, 3, {n}
*BEAM SECTION, ELSET=BEAM, SECTION=STIFFNESS
1e5, 1
*BOUNDARY
1, PINNED
3, 2
*OBSTACLE, NAME=POST, TYPE=CIRCLE, SIDE=OUTSIDE
0.37, -0.21, 0.2
*OBSTACLE, NAME=OTHER, TYPE=CIRCLE, SIDE=OUTSIDE
0.8, -0.16, 0.15
*CONTACT, OBSTACLE=POST, NSET=BEAM
*CONTACT, OBSTACLE=OTHER, NSET=BEAM
*MONITOR, NAME=w
2, U2
*STEP
*STATIC, METHOD=LOAD
0.1
*CLOAD
3, 1, -4
*DLOAD
BEAM, PY, -10
*STOP
LOAD, ABOVE, 3
*END STEP
"""


def test_a_monitor_between_nodes_that_move():
    """Where it stands in its element every mesh has it elsewhere, and polynomials of two orders agree by chance at some places: the bar
    is that of all places as far from the nodes. The reference has 60 elements in each half and a bar of 2E-15."""
    fine = dr.run_deck(BEAM_ON_POSTS.format(n=60)).only("EP")
    for n in range(5, 18):
        point = dr.run_deck(BEAM_ON_POSTS.format(n=n)).only("EP")
        error = abs(point.monitors["w"] - fine.monitors["w"])
        assert error <= point.monitor_errors["w"] + fine.monitor_errors["w"], f"{n} elements: {error}"
        assert point.monitor_errors["w"] < 1e-8


def test_no_bars_when_none_are_wanted():
    text = dr.changed(dr.on_given_mesh("lee-frame"), ("*STEP\n", "*STEP\n*ACCURACY, POINTS=NONE\n"))
    run = dr.run_deck(text)
    assert "+-" not in run.stdout and "error bars" not in run.stdout
    assert all(math.isnan(c.error) for c in run.results.critical)


@pytest.mark.parametrize("name, kind", [("arch-deep-hinged", "GE2"), ("arch-clamped-hinged", "GE2"), ("arch-clamped-hinged", "GE4")])
def test_a_mesh_without_the_limit_points_is_told(name, kind):
    """One element each side: the load goes up to the end without a limit point. There the load is given; what moves tells, and what is unstable."""
    text = remeshed(dr.on_given_mesh(name), kind, 1).replace("*CONTROLS, LOCATE=1E-11\n*ACCURACY, WIDEST=1E9\n", "")
    run = dr.run_deck(text, code=2)
    assert not run.labelled("LP")
    assert "the mesh is too coarse for the bifurcations of EP at point" in run.results.status
    end, = run.labelled("EP")
    assert end.error == 0.0 and any(math.isinf(bar) for bar in end.monitor_errors.values())


def test_a_mesh_that_cannot_buckle_is_told():
    """Straight bars of one element of order 2 have exact displacements and forces, and no bifurcation."""
    text = dr.on_given_mesh("three-hinged-arch").replace("TYPE=GE8", "TYPE=GE2").replace(", 4\n", ", 1\n")
    run = dr.run_deck(text, code=2)
    assert not run.labelled("BP")
    assert "the mesh is too coarse for the bifurcations of LP" in run.results.status
    assert "2 more unstable directions" in run.results.status


@pytest.mark.parametrize("tolerance", ["1E-7", "1E-8"])
@pytest.mark.parametrize("strategy", ["METHOD=CYLINDRICAL\n0.1, 1E-9, 0.02", "METHOD=DISPLACEMENT, MONITOR=v\n0.002"])
def test_a_value_that_is_held_inside_an_element(strategy, tolerance):
    """The step ends at a displacement of the crown, which stands inside an element of few: what is held is its value there, not
    what elements of a higher order make of the same nodes. The reference has elements a thousand times better."""
    def arch(count, accuracy):
        run = dr.run_deck(f"""*HEADING
arch on a circle
*NODE
1, -0.3153902727332165, 0.9489620518573265
2, 0., 1.
3, 0.32896970451180346, 0.9443404754183825
*ARC, ELSET=A, NSET=A, TYPE=GE8, DIRECTION=CLOCKWISE
1, 2, 0., 0.{count}
2, 3, 0., 0.{count}
*BEAM SECTION, ELSET=A, SECTION=STIFFNESS
4829.3012399353, 1.
*BOUNDARY
1, ENCASTRE
3, PINNED
*OBSTACLE, NAME=O, TYPE=CIRCLE, SIDE=OUTSIDE
-0.10676926208097948, 0.6234699166011513, 0.3616811126431231
*CONTACT, OBSTACLE=O, NSET=A
*MONITOR, NAME=v
2, U2, -1.
*STEP
{accuracy}*STATIC, {strategy}
*CONTROLS, TOLERANCE={tolerance}
*DLOAD
A, PY, -1.
*STOP
v, ABOVE, 0.015532129917784188
*END STEP
""")
        return run.only("EP")
    reference = arch(", 40", "")
    end = arch("", "*ACCURACY, TOLERANCE=1E-4\n")
    assert reference.error < 1e-5
    assert abs(end.load_factor - reference.load_factor) <= end.error + reference.error
    dr.assert_close(end.load_factor, reference.load_factor, relative=1e-4)


@pytest.mark.parametrize("load", [0.9, 0.5])
def test_last_force_of_an_unstressed_beam(load):
    """A tool is pressed into a beam and withdrawn: its force ends where it touches the straight beam, at 1 less the room over the way.
    No force is left there to measure this one by."""
    room = 0.1 * (1.0 - load)
    motion = "*STEP\n*ACCURACY, TOLERANCE=1E-6\n*STATIC, METHOD=LOAD\n0.02, , 0.1\n*OBSTACLE MOTION\nTOOL, 0, {}\n*END STEP\n"
    lost = dr.run_deck("*HEADING\nTool\n*NODE\n1, 0, 0\n2, 1, 0\n*LINE, ELSET=B, NSET=B\n1, 2\n*BEAM SECTION, ELSET=B, SECTION=STIFFNESS\n"
                       "1e4, 1\n*BOUNDARY\n1, PINNED\n2, 2\n*OBSTACLE, NAME=TOOL, TYPE=CIRCLE, SIDE=OUTSIDE\n"
                       f"0.4, {0.2 + room!r}, 0.2\n*CONTACT, OBSTACLE=TOOL, NSET=B\n"
                       + motion.format(-0.1) + motion.format(0.1)).only("C-")
    assert lost.error < 1e-6
    dr.assert_close(lost.load_factor, load, absolute=1e-8)
    dr.assert_close(lost.corrected, load, absolute=1e-8)


def held_ring(elements=""):
    """An oval ring under pressure, held at one point that does not move whatever the mesh makes of the rest."""
    return (f"*NODE\n1, 1., 0.\n*RING, ELSET=R, NSET=R\n1, 0., 0.{elements}\n*IMPERFECTION, ELSET=R, SHAPE=COSINE\n-1E-4, 4, 42.\n"
            "*BEAM SECTION, ELSET=R, SECTION=STIFFNESS\n1E5, 1.\n*BOUNDARY\n1, ENCASTRE\n*MONITOR, NAME=held\n1, U1\n"
            "*OBSTACLE, NAME=HOST, TYPE=CIRCLE, SIDE=INSIDE\n0., 0., 1.007\n*CONTACT, OBSTACLE=HOST, NSET=R\n"
            "*STEP\n*ACCURACY, TOLERANCE=1E-6\n*STATIC, METHOD=CYLINDRICAL\n0.5, 1E-9, 0.05\n*DLOAD\nR, P, 1.\n"
            "*STOP\nLOAD, ABOVE, 2.99\n*END STEP\n")


def test_a_mesh_that_resolves_nothing_though_no_number_shows_it():
    """Two elements round the ring move by what is not theirs; load and monitor of the first increment are given, without error."""
    first, fine = (dr.run_deck(held_ring(elements)).labelled("C+")[0].load_factor for elements in ("", ", 48"))
    dr.assert_close(first, fine, relative=1e-6)

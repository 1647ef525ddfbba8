"""Snap-through and snap-back without contact: limit points, bifurcations and whole paths against exact solutions.

reference/bench_*.csv and arch_*.csv: boundary value problems of the exact rod, 12 digits. The decks have at most 64
elements; arch-clamped-hinged is stretched by EA R^2/EI = 1E10, which moves its limit loads by 5e-9 of their values.
"""
import functools
import re
from dataclasses import dataclass

import numpy as np
import pytest

import deck_runner as dr


@dataclass
class Scene:
    """Limit points (load, displacement v) in the order of the path; the table of exact points and its columns."""

    limits: tuple
    bifurcations: tuple
    table: str
    load: str
    columns: dict                # monitor: column
    size: float                  # of displacements
    load_control: tuple          # its data line, its smallest increment
    steady: str                  # a displacement that grows all along the path, as a monitor
    displacement: str            # data line of displacement control with it


SCENES = {
    "arch-clamped-hinged": Scene(
        ((8.97308996972, 1.137320631), (-0.730551307335, 1.220645415)), (), "bench_d_arch_clamped_hinged", "P",
        {"v": "v", "u": "u"}, 1.0, ("0.2, 1E-4, 0.5", 1e-4), "19, U2, -1.", "0.002, 1E-9, 0.05"),
    "lee-frame": Scene(
        ((18.5567275376, 0.4061261437), (-9.4144315556, 0.4851401277)), (), "bench_f_lee_frame", "P",
        {"v": "v", "u": "u"}, 1.0, ("0.5, 1E-4, 1.", 1e-4), "12, U2, -1.", "1E-4, 1E-9, 0.02"),
    "williams-toggle": Scene(
        ((33.8703851779, 0.2321568724), (31.2817744575, 0.3915942581)), (), "bench_g_williams_toggle", "P_lb",
        {"v": "v_in"}, 0.386, ("2., 1E-4, 5.", 1e-4), "2, U2, -1.", "0.02, 1E-6, 0.03"),
    "arch-shallow-hinged": Scene(
        ((14.7083255434, 0.0561532126), (-10.149681216, 0.1606071614)),
        ((14.3595205986, 0.0460440492), (-6.2196423013, 0.1815730429)), "arch_shallow_hinged_symmetric", "P",
        {"v": "v"}, 0.1, ("0.5, 1E-4, 1.", 1e-4), "2, U2, -1.", "0.002, 1E-9, 0.005"),
}
# No displacement grows all along this path: v goes to 2.58 and comes back to 0.32.
DEEP = Scene(((9.4631087348, 1.1187728335), (-23.631513896, 1.976509476)),
             ((3.276282198, 0.1667693996), (-13.205837158, 2.580166802)), "arch_deep_hinged_symmetric", "P", {"v": "v"},
             1.0, ("0.2, 1E-4, 0.5", 1e-4), "", "")
ALL = SCENES | {"arch-deep-hinged": DEEP}


@functools.cache
def plain(name):
    return dr.run_deck(dr.on_given_mesh(name))


def assert_special_points(run, scene, load_limit=1e-6):
    """Limit points and bifurcations are those of the table, in the right order, and there are no others.

    A limit load is met to second order in the place; a bifurcation to first order, in place by LOCATE and by the
    rounding of the pivots, which counts EA/EI times more.
    """
    limits, bifurcations = run.labelled("LP"), run.labelled("BP")
    assert all(point.located for point in limits + bifurcations)
    dr.assert_close([c.load_factor for c in limits], [load for load, _ in scene.limits], relative=load_limit)
    dr.assert_close([c.monitors["v"] for c in limits], [v for _, v in scene.limits], absolute=1e-5 * scene.size)
    assert len(bifurcations) == len(scene.bifurcations)
    for point, (load, v) in zip(bifurcations, scene.bifurcations):
        dr.assert_close(point.load_factor, load, relative=1e-7)
        dr.assert_close(point.monitors["v"], v, absolute=1e-7 * scene.size)


@pytest.mark.parametrize("name", ALL)
def test_limit_points_and_bifurcations(name):
    run = plain(name)
    assert len(run.results.mesh.elements) <= 64
    assert_special_points(run, ALL[name], load_limit=3e-7)


@pytest.mark.parametrize("name", ALL)
def test_pivots(name):
    """None is negative at first; one more or fewer beyond each limit point and each bifurcation."""
    run = plain(name)
    pivots = run.column("negative_pivots")
    special = sorted(c.point - 1 for label in ("LP", "BP") for c in run.labelled(label))
    assert pivots[0] == 0
    changes = np.flatnonzero(np.diff(pivots))
    assert len(changes) == len(special) and np.all(np.abs(np.diff(pivots)[changes]) == 1)
    assert all(change in (point - 1, point) for change, point in zip(changes, special))


@pytest.mark.parametrize("element, order, elements", [("GE2", 2, (8, 16, 32, 64)), ("GE4", 4, (4, 8, 16, 32)),
                                                      ("GE6", 6, (2, 4, 8, 16)), ("GE8", 8, (2, 4, 8))])
def test_order_of_the_limit_loads(element, order, elements):
    """Newton's tolerance is firm, so that the error is that of the mesh alone, down to 5e-10 of 33.9."""
    errors = []
    for n in elements:
        run = dr.run_deck(dr.changed(dr.on_given_mesh("williams-toggle"), ("TYPE=GE6", f"TYPE={element}"),
                                     ("1, 2, 8\n2, 3, 8\n", f"1, 2, {n}\n2, 3, {n}\n"),
                                     ("*CLOAD\n", "*CONTROLS, TOLERANCE=1E-12\n*ACCURACY, WIDEST=0.1\n*CLOAD\n")))
        errors.append([c.load_factor - load for c, (load, _) in zip(run.labelled("LP"), SCENES["williams-toggle"].limits)])
    assert np.shape(errors) == (len(elements), 2)
    for one in np.transpose(errors):
        dr.assert_order(one, order, below=0.5, above=0.5)


def rows_of(scene, every):
    """Every so many rows of the table between its first and last, and the column that changes most about them."""
    table = dr.reference(scene.table)
    names = {"LOAD": scene.load} | scene.columns
    rows = np.arange(every, len(table[scene.load]) - 1, every)
    rate = {name: np.abs(table[column][rows + 1] - table[column][rows - 1]) / np.ptp(table[column])
            for name, column in names.items()}
    best = [max(names, key=lambda name, k=k: rate[name][k]) for k in range(len(rows))]
    return table, names, rows, best


@pytest.mark.parametrize("name, every", [("arch-clamped-hinged", 9), ("lee-frame", 9), ("williams-toggle", 6),
                                         ("arch-shallow-hinged", 6), ("arch-deep-hinged", 9)])
def test_path_follows_the_table(name, every):
    """Points are asked for where the table has them, by the quantity that changes most there."""
    scene = ALL[name]
    table, names, rows, best = rows_of(scene, every)
    asked = "".join(f"{quantity}, {table[names[quantity]][row]:.15g}\n" for quantity, row in zip(best, rows))
    run = dr.run_deck(dr.changed(dr.on_given_mesh(name), ("*STOP\n", f"*LOCATE\n{asked}*STOP\n"),
                                 ("*CLOAD\n", "*CONTROLS, LOCATE=1E-11\n*CLOAD\n")))
    found = run.labelled("UZ")
    values = np.array([[c.load_factor] + [c.monitors[monitor] for monitor in scene.columns] for c in found])
    exact = np.transpose([table[column] for column in names.values()])
    size = np.ptp(exact, axis=0)
    for row in rows:
        miss = np.abs(values - exact[row]) / size
        nearest = miss[np.argmin(np.max(miss, axis=1))]
        assert np.max(nearest) <= 1e-6, f"row {row}, {dict(zip(names, exact[row]))}: missed by {nearest} of {size}"


@functools.cache
def strategy(name, method):
    """The scene's own path by another strategy, with loads located on the way."""
    scene = ALL[name]
    text = re.sub(r"^\*BRANCH.*\n([^*].*\n)*", "", dr.on_given_mesh(name), flags=re.MULTILINE)
    own = re.search(r"^\*STATIC.*\n(.*)\n", text, re.MULTILINE).group(1)
    asked = "".join(f"LOAD, {share * load:.15g}\n" for load, _ in scene.limits for share in (0.3, 0.8))
    text = dr.changed(text, ("*STOP\n", f"*LOCATE\n{asked}*STOP\n"))
    if method != "DISPLACEMENT":
        return dr.run_deck(dr.with_static(text, f"METHOD={method}", own))
    text = text.replace("*STEP\n", f"*MONITOR, NAME=steady\n{scene.steady}\n*STEP\n", 1)
    return dr.run_deck(dr.with_static(text, "METHOD=DISPLACEMENT, MONITOR=steady", scene.displacement))


@pytest.mark.parametrize("name, method", [(name, method) for name in ALL for method in (
    "SPHERICAL", "LINEARISED", "MINIMUM RESIDUAL", "VARIABLE LOAD", "GENERALISED DISPLACEMENT", "LARGEST DISPLACEMENT", "DISPLACEMENT") if method != "DISPLACEMENT" or ALL[name].steady])
def test_every_strategy_meets_the_same_points(name, method):
    """The end, limit points, bifurcations and places of given loads do not depend on the strategy.

    LOCATE is 1e-8 of the increment's change of the load.
    """
    scene, run, same = ALL[name], strategy(name, method), strategy(name, "CYLINDRICAL")
    assert_special_points(run, scene)
    assert len(same.labelled("UZ")) >= 4
    assert [c.label for c in run.results.critical] == [c.label for c in same.results.critical]
    dr.assert_close([c.load_factor for c in run.results.critical], [c.load_factor for c in same.results.critical],
                    relative=1e-7)
    others = [c for c in run.results.critical if c.label != "LP"]
    dr.assert_close([c.monitors["v"] for c in others],
                    [c.monitors["v"] for c in same.results.critical if c.label != "LP"], absolute=1e-6 * scene.size)


@pytest.mark.parametrize("name", ALL)
def test_load_control_stops_below_the_limit_point(name):
    """Exit code 2, the last load below the limit load by no more than Newton's trouble there: a few smallest increments."""
    scene = ALL[name]
    data, least = scene.load_control
    run = dr.run_deck(dr.with_static(dr.on_given_mesh(name), "METHOD=LOAD", data), code=2)
    limit, loads = scene.limits[0][0], run.column("load_factor")
    assert run.results.status.startswith("stopped: ")
    dr.assert_monotone(loads, rising=True)
    assert limit - 5.0 * least <= loads[-1] <= limit * (1.0 + 3e-7)
    assert run.column("v")[-1] < scene.limits[0][1]


def test_euler_straight():
    """P (1 - P/EA) = n Pcr with n = 1, 9: LOCATE is 1e-8 of an increment; GE6 with 20 elements is within 1e-7 for n = 9."""
    run = plain("euler")
    shortening = 4.0 * 2.4674011002723395 / 1e9
    expected = [2.0 * n / (1.0 + np.sqrt(1.0 - n * shortening)) for n in (1, 9)]
    points = run.labelled("BP")
    dr.assert_close([c.load_factor for c in points], expected, relative=1e-7)
    dr.assert_close(points[0].load_factor, expected[0], relative=2e-8)
    dr.assert_close(run.column("y"), 0.0 * run.column("y"), absolute=0.0)
    dr.assert_close([c.load_factor for c in run.labelled("EP")], [10.0], relative=1e-8)


def test_euler_of_a_soft_rod():
    """EA L^2/EI = 1E3 moves the bifurcations by 2.5e-3 and 2.3e-2: far more than the limit asked for."""
    run = dr.run_deck(dr.changed(dr.on_given_mesh("euler"), ("1E9, 1.", "1E3, 1.")))
    expected = [2.0 * n / (1.0 + np.sqrt(1.0 - 4.0 * n * 2.4674011002723395 / 1e3)) for n in (1, 9)]
    dr.assert_close([c.load_factor for c in run.labelled("BP")], expected, relative=2e-7)

"""The paper's ring on meshes that are finer where contact ends: what 160 elements of the fourth order can do.

Exact values: reference/ring_*.csv, from a separate boundary-value solver with about 1e-9 or better.
"""
import functools

import numpy as np
import pytest

import deck_runner as dr

RIGID = 81.557427564661
# k R^4/EI and the critical load, from ring_winkler_critical.csv
SOFT = {"1E3": 13.28648196568, "1E5": 58.99056700141, "3.6E6": 80.35789295248, "1E8": 81.50496807413}
AT_45 = "-0.70710678118654752, 0.70710678118654752"
AT_12 = "-0.20791169081775931, 0.97814760073380569"
AT_50 = "-0.76604444311897804, 0.64278760968653933"


@functools.cache
def rigid(fine, coarse, stop="0.6"):
    """`fine` elements up to 45 degrees from the apex, `coarse` beyond."""
    return dr.run_deck(dr.changed(dr.on_given_mesh("ring"), ("2, 0., -1.", f"3, {AT_45}\n2, 0., -1."),
                                  ("1, 2, 0., 0., 160, 6.", f"1, 3, 0., 0., {fine}\n3, 2, 0., 0., {coarse}"),
                                  ("v, ABOVE, 0.6", f"v, ABOVE, {stop}")))


@functools.cache
def soft(modulus, factor=1.0, kind="GE4", counts=(16, 110, 34), stop="0.6"):
    """Elements up to 12 degrees, up to 50 degrees and beyond."""
    deck = dr.changed(dr.on_given_mesh("ring"), ("2, 0., -1.", f"3, {AT_12}\n4, {AT_50}\n2, 0., -1."),
                      ("1, 2, 0., 0., 160, 6.", "\n".join(f"{a}, {b}, 0., 0., {int(factor * n)}" for (a, b), n in
                                                      zip(((1, 3), (3, 4), (4, 2)), counts))),
                      ("SIDE=INSIDE, REFERENCE=90.", f"SIDE=INSIDE, REFERENCE=90., FOUNDATION=WINKLER, MODULUS={modulus}"),
                      (", POINTS=ALONG", ""), ("TYPE=GE4", f"TYPE={kind}"), ("LOAD, 34., 57., 62., 28.", "v, 0.03"),
                      ("v, ABOVE, 0.6", f"v, ABOVE, {stop}\n*ACCURACY, WIDEST=0.1"))      # where elements are long contact splits, and ought not
    return dr.run_deck(deck)


def test_rigid_critical_load():
    dr.assert_close(rigid(100, 60).load("LP"), RIGID, relative=1e-6)


def angles_and_exact(run, table):
    """Angles of separation at all points that the table covers, and the exact ones at the same displacements."""
    v = run.column("v")
    inside = (v >= table["v"][0]) & (v <= table["v"][-1])
    assert np.count_nonzero(inside) > 15
    exact = dr.interpolate(np.log(table["v"]), table["phi_deg"], np.log(v[inside]))
    return dr.regions(run, "angle_start")[inside], exact


@pytest.mark.parametrize("name, run", [("ring_rigid_Rh100", lambda: rigid(100, 60)),
                                       ("ring_winkler_k3.6e06", lambda: soft("3.6E6", stop="0.2"))])
def test_angle_history(name, run):
    """Within 0.01 degree at every point, and smooth: the errors do not change from point to point by more than that, and
    the angle falls and rises where the exact one does. (On soft ground as long as contact ends where the mesh is fine.)"""
    found, exact = angles_and_exact(run(), dr.reference(name))
    dr.assert_close(found, exact, absolute=0.01)
    steps, exact_steps = np.diff(found), np.diff(exact)
    tell = np.abs(exact_steps) > 0.002
    assert np.all(np.sign(steps[tell]) == np.sign(exact_steps[tell]))
    assert np.max(np.abs(np.diff(found - exact))) < 0.01


@pytest.mark.parametrize("modulus, limit", [("1E3", 2e-6), ("1E5", 1e-6), ("3.6E6", 1e-6), ("1E8", 1e-6)])
def test_soft_critical_loads(modulus, limit):
    """160 elements of GE4; on the softest ground contact ends where the mesh is coarse."""
    dr.assert_close(soft(modulus, stop="0.2" if float(modulus) > 1e4 else "0.6").load("LP"), SOFT[modulus], relative=limit)


@pytest.mark.parametrize("kind, order, factors", [("GE2", 2.0, (1, 2, 4, 8)), ("GE4", 4.0, (0.5, 1, 2, 4))])
def test_order_on_stiff_ground(kind, order, factors):
    errors = [soft("3.6E6", factor, kind, (8, 40, 16), "0.06").load("LP") / SOFT["3.6E6"] - 1.0 for factor in factors]
    dr.assert_mean_order(errors, order, below=0.4)


def test_long_elements_may_hide_an_opening():
    with pytest.raises(AssertionError, match="too coarse to tell whether contact begins or ends inside its elements"):
        soft("3.6E6", 0.5, "GE2", (8, 40, 16), "0.06")


@pytest.mark.parametrize("modulus", ["3.6E6", "1E8"])
def test_high_order_elements(modulus):
    """64 elements of GE8 resolve what takes 1000 of GE4."""
    dr.assert_close(soft(modulus, 1, "GE8", (8, 40, 16), "0.06").load("LP"), SOFT[modulus], relative=1e-8)


def test_split_of_the_contact_on_very_stiff_ground():
    """Behind the end of contact the ring lifts off once more; located alike by both arc lengths but for their meshes, which follow the
    first end of contact, with the order 2 s of the nodes, the sixth with GE6."""
    def split(static, factor, element):
        deck = dr.changed(dr.on_given_mesh("ring-stiffness"), ("METHOD=CYLINDRICAL\n1., 1E-9, 0.02", static),
                          ("v, ABOVE, 0.6", "v, ABOVE, 0.16"), ("TYPE=GE4", f"TYPE={element}"), *((f"{line}, 0., 0., {n}\n", f"{line}, 0., 0., {int(factor * n)}\n")
                                                                 for line, n in (("1, 2", 16), ("2, 3", 160), ("3, 4", 64))))
        return dr.run_deck(deck).labelled("C-")[0].load_factor
    loads = [split(static, 1, "GE8") for static in ("METHOD=CYLINDRICAL\n1., 1E-9, 0.02", "METHOD=SPHERICAL\n1., 1E-9, 0.02")]
    dr.assert_close(loads, np.full(2, loads[0]), relative=1e-8)
    errors = [split("METHOD=CYLINDRICAL\n1., 1E-9, 0.02", factor, "GE6") - loads[0] for factor in (0.5, 1)]
    dr.assert_mean_order(errors, 6, below=0.7, above=1.3)

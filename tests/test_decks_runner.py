"""The helper of the deck tests, shown to fail on wrong answers and to pass right ones."""
import numpy as np
import pytest

import deck_runner as dr

ROD = """*NODE
1, 0, 0
2, 1, 0
*LINE, ELSET=ROD
1, 2, 2
*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS
1, 1
*BOUNDARY
1, ENCASTRE
*MONITOR, NAME=u
2, U1
*STEP
*STATIC, METHOD=LOAD
1
*CLOAD
2, 1, 0.1
*END STEP
"""


def fails(check, *arguments, **options):
    with pytest.raises(AssertionError):
        check(*arguments, **options)


def test_close_accepts_what_is_within():
    dr.assert_close([1.0, 2.0], [1.0, 2.0 + 1e-9], relative=1e-9)
    dr.assert_close(0.0, 1e-9, absolute=1e-9)


@pytest.mark.parametrize("actual, expected", [
    ([1.0, 2.1], [1.0, 2.0]), ([2.1, 1.0], [2.0, 1.0]), (1.9, 2.0), (-2.0, 2.0), ([1.0], [1.0, 1.0]), (1.0, [1.0]),
    ([1.0, np.nan], [1.0, 1.0]), ([1.0, 1.0], [1.0, np.nan]), ([np.inf], [np.inf]), ([], [])])
def test_close_refuses(actual, expected):
    fails(dr.assert_close, actual, expected, relative=0.01)


def test_order_accepts_and_refuses():
    dr.assert_order([1.0, 1 / 4, 1 / 16], 2)
    dr.assert_mean_order([1.0, 1 / 3, 1 / 16], 2)
    for check in (dr.assert_order, dr.assert_mean_order):
        for errors in ([1.0, 0.5, 0.25], [1.0, 1.0, 1.0], [1.0, 2.0, 4.0], [1.0, 1 / 16, 1 / 256], [1.0, np.nan, 1.0],
                       [1.0]):
            fails(check, errors, 2)
    fails(dr.assert_order, [1.0, 1 / 16, 1 / 16], 2)    # right on the whole, wrong from mesh to mesh


def test_monotone_accepts_and_refuses():
    dr.assert_monotone([1.0, 2.0, 5.0], rising=True)
    dr.assert_monotone([3.0, 2.0], rising=False)
    for values in ([1.0, 2.0, 2.0], [1.0, 3.0, 2.0], [1.0, np.nan, 3.0], [1.0], []):
        fails(dr.assert_monotone, values, rising=True)
    fails(dr.assert_monotone, [1.0, 2.0], rising=False)


def test_bends_of_a_line_a_parabola_and_a_saw():
    x = np.array([0.0, 1.0, 3.0, 4.0])
    dr.assert_close(dr.bends(x, 2.0 * x + 1.0), [0.0, 0.0], absolute=1e-15)
    dr.assert_close(dr.bends(x, x**2), [-2.0, -2.0], absolute=1e-14)
    assert np.max(np.abs(dr.bends(x, [0.0, 0.1, 0.0, 0.1]))) > 0.05


def test_interpolation_is_exact_for_quintics_only():
    x = np.linspace(0.0, 2.0, 13) ** 1.3
    at = np.array([0.0, 0.1, 1.0, 2.0, 2.3])
    dr.assert_close(dr.interpolate(x, x**5 - x, at), at**5 - at, absolute=1e-12)
    fails(dr.assert_close, dr.interpolate(x, x**7, at), at**7, absolute=1e-12)
    fails(dr.interpolate, x, x, [3.0])
    fails(dr.interpolate, x[::-1], x, [1.0])


def test_the_interpolation_error_is_seen():
    x = np.linspace(0.0, 10.0, 41)
    assert dr.interpolation_error(x, np.sin(x)) < 1e-3
    assert dr.interpolation_error(x, np.sin(12.0 * x)) > 0.1


def test_changes_must_hit_exactly_once():
    assert dr.changed("a b", ("a", "c"), ("b", "d")) == "c d"
    fails(dr.changed, "a b", ("x", "c"))
    fails(dr.changed, "a a", ("a", "c"))


def test_the_static_card_is_replaced():
    assert "*STATIC, METHOD=SPHERICAL\n2.\n*CLOAD" in dr.with_static(ROD, "METHOD=SPHERICAL", "2.")
    fails(dr.with_static, ROD.replace("*STATIC", "*STOP"), "METHOD=LOAD", "1")
    fails(dr.with_static, ROD + ROD, "METHOD=LOAD", "1")


def test_a_run_has_the_results_of_its_deck():
    run = dr.run_deck(ROD)
    dr.assert_close(run.column("u"), [0.0, 0.1], absolute=1e-12)
    fails(dr.assert_close, run.column("u"), [0.0, 0.11], relative=1e-3)
    assert run.files == ["deck.h5", "deck.inp"]
    fails(run.only, "LP")


def test_another_exit_code_is_a_failure():
    fails(dr.run_deck, ROD.replace("1, ENCASTRE", "7, ENCASTRE"))
    fails(dr.run_deck, ROD, code=2)
    assert "node 7" in dr.run_deck(ROD.replace("1, ENCASTRE", "7, ENCASTRE"), code=1).stderr


def test_results_that_are_not_there_are_a_failure():
    run = dr.run_deck(ROD, "--check")
    with pytest.raises(AssertionError, match="one result file expected"):
        run.results


def test_reference_tables_are_read():
    table = dr.reference("bench_a_cantilever_tip_load")
    dr.assert_close(table["w"][:2], [0.30172077379981, 0.49345748039671], absolute=1e-15)
    angles = dr.reference("ring_angles")
    dr.assert_close(angles["phi_cr"][:5], [23.1767889, 23.4443604, 23.7489673, 24.3181044, 25.1202867], absolute=0.0)
    assert np.all(np.isnan(angles["medium"][4:]))
    dr.assert_close(angles["phi_cr"][5:], [24.6, 24.7], absolute=0.0)

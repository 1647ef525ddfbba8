"""Small decks of input/ that show cards which no other one has, against closed forms.

UNILAT names the program.
"""
import math

import deck_runner as dr
import pytest

EVERY_PARAMETER = True


def test_a_mast_pulled_towards_its_foot_buckles_as_a_hinged_column():
    """Whatever the spring at its foot is; the clamped mast under a weight would carry a quarter."""
    text = dr.example("mast")
    for stiffness in ("2.5", "1e-3", "1e6"):
        (modes,) = dr.run_deck(dr.changed(text, ("FOOT, 6, 2.5", f"FOOT, 6, {stiffness}"))).results.buckling.values()
        assert modes.load_factor[0] == pytest.approx(math.pi**2, abs=float(modes.error[0]))


def test_a_free_ring_grows_by_heat():
    run = dr.run_deck(dr.example("heated-ring"))
    assert run.results.complete and run.results.monitors["growth"].values[-1] == pytest.approx(0.0048, rel=1e-12)
    stress = run.results.field("section_forces", run.results.n_points)
    assert abs(stress).max() < 1e-9 * 210e6 * 12e-4      # what the heat would be if it could not grow, per area
    assert run.results.monitors["growth"].units == "m"


def test_a_strip_rolled_up_by_a_rigid_arm():
    """The arm turns with the tip: it ends where it began after a full turn. The turning point is where tan(t) = t."""
    run = dr.run_deck(dr.example("rigid-arm"))
    t = 4.493409457909064
    (turn,) = (point for point in run.results.critical if point.label == "TP")
    assert turn.load_factor == pytest.approx(t / (2.0 * math.pi), rel=1e-8)
    assert turn.monitors["x"] == pytest.approx(math.sin(t) / t, rel=1e-8)
    assert turn.monitors["arm"] == pytest.approx(math.sin(t) / t - 0.2 * math.sin(t) - 1.0, rel=1e-8)
    assert run.results.monitors["arm"].values[-1] == pytest.approx(-1.0, abs=1e-8)


def test_a_bar_on_a_sloping_roller():
    """Its length gives the place of the roller."""
    run = dr.run_deck(dr.example("sloping-roller"))
    assert run.results.monitors["s"].values[-1] == pytest.approx((math.sqrt(4.0 + 5.0 * (1.1**2 - 1.0)) - 2.0) / 2.5, rel=1e-12)

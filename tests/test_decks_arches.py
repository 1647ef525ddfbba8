"""Shallow hinged arches by every strategy: each finds all special points of the path, in their order, and no others.

The reference is arch_reference.py, a boundary-value solver of its own, the whole study arch_study.py; here are one of its combinations in
401 and those that once went wrong, each in its own way.
"""
import numpy as np
import pytest

import arch_reference
import arch_study
import deck_runner as dr


@pytest.mark.parametrize("half_angle, slenderness", [(0.2, 50), (0.25, 100)])
def test_reference_is_that_of_another_polynomial(half_angle, slenderness):
    points = arch_reference.special_points(half_angle, slenderness, degree=44, longest=0.03)
    stored = arch_reference.table()[half_angle, slenderness]
    assert [p.label for p in points] == [p.label for p in stored]
    for name in ("load", "crown", "thrust"):
        dr.assert_close([getattr(p, name) for p in points], [getattr(p, name) for p in stored], relative=1e-10)


def test_reference_agrees_with_other_solvers():
    """Limit loads by another boundary-value solver, 12 digits; limit points and bifurcations by Taylor series, 10 digits after the point.

    The latter are those of arch-shallow-hinged: span 1, radius 1.3, EA L^2/EI = 3600.
    """
    limits = [p.load for p in arch_reference.table()[0.3, 50] if p.label == "LP"]
    dr.assert_close(limits, [37.4739891576, -44.8484695927, 24.3264493364, -39.1840130838], relative=2e-12)
    points = arch_reference.special_points(np.arcsin(0.5 / 1.3), np.sqrt(3600.0 * 1.3**2 / 12.0))
    assert [p.label for p in points] == ["BP", "LP", "LP", "BP"]
    dr.assert_close([p.load / 1.3**2 for p in points], [14.3595205986, 14.7083255434, -10.1496812160, -6.2196423013], absolute=1e-9)
    dr.assert_close([p.crown * 1.3 for p in points], [0.0460440491, 0.0561532126, 0.1606071614, 0.1815730430], absolute=1e-9)


SAMPLE = [case for case in arch_study.cases(401) if case.elements <= 160]
ONCE_WRONG = [
    # located where its neighbours are higher, beyond the increment
    arch_study.Case(0.3, 50, "full", 8, 80, "CYLINDRICAL", None),
    # two limit points of four, then another state
    arch_study.Case(0.3, 50, "full", 8, 80, "MINIMUM RESIDUAL", None),
    arch_study.Case(0.3, 50, "full", 8, 80, "VARIABLE LOAD", None),
    # from P = 78 to 105 over a loop
    arch_study.Case(0.25, 100, "full", 4, 160, "CYLINDRICAL", 0.01),
    arch_study.Case(0.35, 50, "full", 8, 10, "LARGEST DISPLACEMENT", 0.01),
    arch_study.Case(0.35, 50, "full", 8, 40, "GENERALISED DISPLACEMENT", 0.01),
    # past a narrow loop, with a limit point of nothing
    arch_study.Case(0.2, 100, "full", 6, 20, "SPHERICAL", 0.01),
    # back over its own path
    arch_study.Case(0.35, 50, "half", 4, 40, "LINEARISED", 0.01),
]


@pytest.mark.parametrize("case", SAMPLE + ONCE_WRONG, ids=lambda case: "-".join(str(case).split()))
def test_every_strategy_finds_the_special_points(case):
    outcome = arch_study.run(case)
    good = outcome.code == 0 and not outcome.bad
    assert good, arch_study.describe(outcome)


def test_the_comparison_sees_what_is_wrong():
    """A load that is off, one that comes twice, one that is left out, one that is not located."""
    class Point:
        def __init__(self, point, load=None, located=True):
            self.label, self.load_factor, self.located = point.label, point.load if load is None else load, located

    case = arch_study.Case(0.3, 50, "half", 6, 40, "SPHERICAL", None)
    points = [p for p in arch_reference.table()[0.3, 50] if p.label == "LP"]
    row = [Point(p) for p in points]

    def outcome(found, complete=True):
        result = arch_study.Outcome(case)
        arch_study.compare(case, found, complete, result)
        return len(result.wrong), len(result.missing), len(result.unlocated), result.limits

    assert outcome(row) == (0, 0, 0, 4)
    assert outcome(row[:2] + [Point(points[2], 17.899)] + row[3:]) == (1, 1, 0, 4)
    assert outcome(row[:3] + row[2:]) == (1, 0, 0, 4)
    assert outcome(row[:1] + row[2:]) == (0, 1, 0, 4)
    assert outcome(row[:2], complete=False) == (0, 0, 0, 2)
    assert outcome(row[:2]) == (0, 2, 0, 4)
    assert outcome(row[:3] + [Point(points[3], located=False)]) == (0, 0, 1, 4)

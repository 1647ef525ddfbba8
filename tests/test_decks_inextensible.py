"""SECTION=INEXTENSIBLE in contact along the rod: limits without EA, and error bars that the true errors stay within.

The exact values are those of contact_cases.py with 1/EA = 0, and a closed form for the strip between two rollers.
"""
import math

import numpy as np
import pytest

import contact_cases as cases
import deck_runner as dr
from test_decks_span_accuracy import DRUM, contact_end, located, tube_deck

FINE = "*CONTROLS, LOCATE=1e-11, TOLERANCE=1e-11\n"


def inextensible(text):
    """A deck whose one section is given by EA and EI, with EI alone."""
    lines = text.splitlines()
    at = next(i for i, line in enumerate(lines) if line.startswith("*BEAM SECTION"))
    lines[at] = lines[at].replace("STIFFNESS", "INEXTENSIBLE")
    lines[at + 1] = lines[at + 1].split(",", 1)[1]
    return "\n".join(lines) + "\n"


def tube():
    run = dr.run_deck(inextensible(tube_deck("LOAD", False)))
    return located(run, "LOAD", 0.7).monitors["F"], cases.tube_force(0.7, 0.0)


def drum():
    run = dr.run_deck(inextensible(DRUM.format(kind="GE8", elements=16, fine=FINE + "*ACCURACY, WIDEST=1\n")))
    return located(run, "LOAD", 5.0).monitors["down"], -float(cases.drum(5.0, 0.0).end(1).y)


def cradle():
    run = dr.run_deck(inextensible(dr.changed(dr.example("cradle"), ("*LOCATE", FINE + "*LOCATE"))))
    return contact_end(run, located(run, "LOAD", 4.0)), float(cases.cradle(4.0, 0.0)["mark"])


def indenter():
    run = dr.run_deck(inextensible(dr.changed(dr.example("indenter"), ("force, 5., 15.", "w, 0.235"))))
    return located(run, "w", 0.235).monitors["force"], 2.0 * float(cases.indenter(0.235, 0.0).end(1).fy)


@pytest.mark.parametrize("case", [tube, drum, cradle, indenter], ids=lambda case: case.__name__)
def test_lines_and_points_without_stretch(case):
    """Twenty times nearer than the same rods with EA = 1e8 EI/L^2 would be."""
    value, exact = case()
    dr.assert_close(value, exact, relative=2e-8)


# A strip between two rollers ----------------------------------------------------------------------------------------------

STRIP = """*HEADING
Strip on two round rollers, pressed down between them until it slips through; half of it
*NODE
1, 0., 0.
2, 2.5, 0.
*LINE, ELSET=STRIP, NSET=STRIP, TYPE={kind}
1, 2, {elements}
*BEAM SECTION, ELSET=STRIP, SECTION=INEXTENSIBLE
1.
*BOUNDARY
1, XSYMM
*OBSTACLE, NAME=ROLLER, TYPE=CIRCLE, SIDE=OUTSIDE
1., -{radius}, {radius}
*CONTACT, OBSTACLE=ROLLER, NSET=STRIP
*MONITOR, NAME=d
1, U2, -1.
*MONITOR, NAME=push, OBSTACLE=ROLLER
RF2
*STEP
*ACCURACY, POINTS=ALL, WIDEST=1
*STATIC
0.2, , 0.05
*CLOAD
1, 2, -1.
*STOP
d, ABOVE, 1.5
*END STEP
"""


def slipping_strip(radius=0.05):
    """Largest half load P of rollers 2 apart, EI = 1, and the depth of the middle there.

    Behind the roller the strip is free, so the force R there is normal to it and the moment is none: with the angle b against the
    tangent there (0 to a, that of the touchdown point) its curvature is sqrt(2 R sin b). Along that tangent and across to it the
    strip is sqrt(2 sin a/R) and (1/sqrt(2 R)) int_0^a sqrt(sin b) db long.
    """
    x, w = np.polynomial.legendre.leggauss(40)
    t, w = 0.5 * (x + 1.0), 0.5 * w

    def load_and_depth(a):
        b = a * t**2  # takes the root out of the integrand
        across = np.sum(w * 2.0 * a * t * np.sqrt(np.sin(b))) / math.sqrt(2.0)
        along = math.sqrt(2.0 * math.sin(a))
        root = (along * math.cos(a) + across * math.sin(a)) / (1.0 - radius * math.sin(a))
        depth = (along * math.sin(a) - across * math.cos(a)) / root + radius * (1.0 - math.cos(a))
        return root**2 * math.cos(a), depth

    low, high = 0.1, 1.4
    golden = 0.5 * (math.sqrt(5.0) - 1.0)
    while high - low > 1e-9:
        one, other = high - golden * (high - low), low + golden * (high - low)
        if load_and_depth(one)[0] > load_and_depth(other)[0]:
            high = other
        else:
            low = one
    return load_and_depth(0.5 * (low + high))


def test_the_closed_form_of_the_strip():
    """By shooting, another way: 0.888744885 at 0.48519084."""
    dr.assert_close(slipping_strip(), np.array([0.888744885, 0.48519084]), relative=1e-8)


def test_a_strip_that_slips_between_rollers():
    run = dr.run_deck(STRIP.format(kind="GE8", elements=60, radius=0.05))
    limit, (load, depth) = run.only("LP"), slipping_strip()
    dr.assert_close(limit.load_factor, load, relative=1e-9)
    dr.assert_close(limit.monitors["d"], depth, relative=1e-6)  # of a maximum: the root of its error
    assert "at the nodes" not in run.stdout


@pytest.mark.parametrize("elements", [6, 10, 16])
def test_bars_of_coarse_strips_hold(elements):
    run = dr.run_deck(STRIP.format(kind="GE4", elements=elements, radius=0.5), code=None)
    limit, (load, _) = run.only("LP"), slipping_strip(0.5)
    assert abs(limit.load_factor - load) <= limit.error
    assert limit.error < 100.0 * abs(limit.load_factor - load)


# Forces of supports -------------------------------------------------------------------------------------------------------

ARCH = """*HEADING
Arch clamped at one foot, hinged at the other, loaded at its crown
*NODE
1, -0.8660254037844386, 0.5
2, 0., 1.
3, 0.8660254037844386, 0.5
*ARC, ELSET=ROD, TYPE=GE4, DIRECTION=CLOCKWISE
1, 2, 0., 0., {elements}
2, 3, 0., 0., {elements}
*BEAM SECTION, ELSET=ROD, SECTION=INEXTENSIBLE
1.
*BOUNDARY
1, ENCASTRE
3, PINNED
*MONITOR, NAME=thrust
1, RF1
*MONITOR, NAME=lift
1, RF2
*MONITOR, NAME=crown
2, U2
*STEP
*ACCURACY, WIDEST=1
*STATIC, METHOD=LOAD
0.25, , 0.25
*CLOAD
2, 2, -4.
*END STEP
"""


def test_bars_of_reactions_hold():
    """Errors of order 4 beside a mesh of 40 elements of an arm; each within its bar, which is of their size."""
    exact = dr.run_deck(ARCH.format(elements=40)).only("EP")
    for elements in (3, 6):
        end = dr.run_deck(ARCH.format(elements=elements)).only("EP")
        for name in ("thrust", "lift", "crown"):
            error = abs(end.monitors[name] - exact.monitors[name])
            assert error <= end.monitor_errors[name] <= 5.0 * error, name


def test_rates_of_reactions():
    """Stored derivatives along the path are those of the reactions: by central differences of loads 0.05 apart."""
    run = dr.run_deck(dr.changed(ARCH.format(elements=6), ("0.25, , 0.25", "0.05, , 0.05")))
    loads, thrust = (run.results.column(name) for name in ("load_factor", "thrust"))
    slope = thrust.rate / loads.rate
    inner = slice(2, -1)
    difference = np.gradient(thrust.values, loads.values)
    dr.assert_close(slope[inner], difference[inner], absolute=0.05**2)  # of step^2 times the third derivative, 0.05 here

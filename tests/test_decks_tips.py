"""A contact that slides to the tip of its rod and stays there, and a couple that lifts a rod off its bed.

The exact tip states are those of an elastica, integrated here from the tip to the clamp by Runge and Kutta's method.
"""
import math

import numpy as np
import pytest

import deck_runner as dr

# A clamped rod, L = EI = 1 and inextensible. Its tip carries the couple C and the force F upwards, both times the load factor. The
# disc above it is frictionless: it pushes along the line from its centre to the contact.
TIP = """*NODE
1, 0, 0
2, 1, 0
*LINE, ELSET=B, NSET=B
1, 2
*BEAM SECTION, ELSET=B, SECTION=INEXTENSIBLE
1.
*BOUNDARY
1, ENCASTRE
*OBSTACLE, NAME=DISC, TYPE=CIRCLE, SIDE=OUTSIDE
{x}, {y}, {radius}
*CONTACT, OBSTACLE=DISC, NSET=B
*MONITOR, NAME=height
2, U2
*MONITOR, NAME=turn
2, UR
*MONITOR, NAME=push, OBSTACLE=DISC
RN
*STEP
*ACCURACY, TOLERANCE=1E-6
*STATIC, METHOD=CYLINDRICAL
0.05, , 0.05
*CLOAD
2, 6, {couple}
2, 2, {force}
*STOP
LOAD, ABOVE, 1.
LOAD, BELOW, -1.
*END STEP
"""


def clamp_from(tip, turn, couple, force, steps=400):
    """Position and rotation at the clamp of the rod whose tip, at `tip` with the rotation `turn`, carries a couple and a force."""
    def rates(state):
        x, y, angle = state
        moment = couple + (tip[0] - x) * force[1] - (tip[1] - y) * force[0]
        return -np.array([math.cos(angle), math.sin(angle), moment])
    state, h = np.array([*tip, turn]), 1.0 / steps
    for _ in range(steps):
        a = rates(state)
        b = rates(state + 0.5 * h * a)
        c = rates(state + 0.5 * h * b)
        state = state + h / 6.0 * (a + 2.0 * b + 2.0 * c + rates(state + h * c))
    return state


def solved(residual, guess):
    """Zero of three equations by Newton's method with differences."""
    at = np.array(guess, float)
    for _ in range(30):
        value = residual(at)
        slope = np.column_stack([(residual(at + d) - value) / 1e-7 for d in 1e-7 * np.eye(3)])
        at = at - np.linalg.solve(slope, value)
    assert np.max(np.abs(residual(at))) < 1e-10
    return at


def tip_state(disc, couple, force, place, turn, push, load):
    """What should vanish: position and rotation of the clamp of a rod whose tip the disc touches at the angle `place` from below."""
    x, y, radius = disc
    out = np.array([math.sin(place), -math.cos(place)])
    return clamp_from(np.array([x, y]) + radius * out, turn, load * couple, push * out + np.array([0.0, load * force]))


def test_the_load_turns_where_contact_comes_to_the_tip():
    """There the rod touches the disc, still without an angle; the load is largest."""
    disc, couple, force = (1.0, 0.25, 0.1), -3.0, 20.0
    run = dr.run_deck(TIP.format(x=disc[0], y=disc[1], radius=disc[2], couple=couple, force=force))
    corner = run.only("LP")
    exact = solved(lambda v: tip_state(disc, couple, force, v[0], v[0], v[1], v[2]),
                   (corner.monitors["turn"], corner.monitors["push"], corner.load_factor))
    bar = corner.error
    assert 0.0 < bar < 1e-6 and abs(corner.load_factor - exact[2]) <= bar + 1e-10   # of the integration
    dr.assert_close([corner.monitors["turn"], corner.monitors["push"]], exact[:2], relative=1e-5)
    assert np.max(run.column("load_factor")) <= corner.load_factor * (1.0 + 1e-12)


@pytest.mark.parametrize("disc, couple, force", [((0.9, 0.4, 0.2), 3.0, 10.0), ((0.9, 0.25, 0.1), 3.0, 10.0)])
def test_the_tip_slides_on_over_the_disc(disc, couple, force):
    """With the whole load the tip rests on the disc at some angle."""
    run = dr.run_deck(TIP.format(x=disc[0], y=disc[1], radius=disc[2], couple=couple, force=force))
    end = run.only("EP")
    assert end.load_factor == 1.0
    below = math.asin((end.monitors["height"] - disc[1]) / disc[2]) + 0.5 * math.pi
    found = [solved(lambda v: tip_state(disc, couple, force, v[0], v[1], v[2], 1.0),
                    (sign * below, end.monitors["turn"], end.monitors["push"]))
             for sign in (-1.0, 1.0) if abs(tip_state(disc, couple, force, sign * below, end.monitors["turn"],
                                                      end.monitors["push"], 1.0)[0]) < 1e-3]
    assert len(found) == 1
    dr.assert_close([end.monitors["turn"], end.monitors["push"]], found[0][1:], relative=1e-5)


BED = """*NODE
1, 0, 0
2, 10, 0
3, 20, 0
*LINE, ELSET=B, NSET=B
1, 2
2, 3
*BEAM SECTION, ELSET=B, SECTION=INEXTENSIBLE
10.
*BOUNDARY
1, 1
*OBSTACLE, NAME=BED, TYPE=LINE
-5, 0, 25, 0
*CONTACT, OBSTACLE=BED, NSET=B
*MONITOR, NAME=turn
2, UR
*STEP
*STATIC, METHOD=LOAD
0.5
*DLOAD
B, PY, -1.
*END STEP
*STEP
*ACCURACY, TOLERANCE=1E-6
*STATIC, METHOD=CYLINDRICAL
{first}, , 0.2
*CLOAD
2, 6, {couple}
*STOP
turn, ABOVE, 1.
*END STEP
"""


@pytest.mark.parametrize("couple", [20.0, 80.0, 200.0])
def test_a_couple_lifts_a_heavy_rod_in_a_first_increment_of_any_length(couple):
    """The couple that turns its node by one radian is the same, whatever part of it the load factor 1 is."""
    loads = [couple * dr.run_deck(BED.format(first=first, couple=couple)).labelled("EP")[-1].load_factor
             for first in (1.0 / couple, 0.2, 0.5)]
    dr.assert_close(loads, [loads[0]] * 3, relative=2e-6)          # each is within 1e-6

"""Contact at the corner of a frame, and at a free end that a moment turns.

A post of height 1, EI = 1, clamped below, stands a gap g from a wall. Its top is pushed to the wall by H and turned from it by M, both
in proportion 4 : 1. By small deflections the top touches at the load factor 1.2 g. At 6 g it is parallel to the wall; from there on
the contact is below the top, at the height s where the deflection is g and the slope 0:

    load factor * (M - H (1 - s)) = 6 g/s^2,  force = load factor * 2 (H (1 - s/2) - M)/s

With g = 1e-5 rotations of 1e-4 change this by 1e-8.
"""
import numpy as np
import pytest

import deck_runner as dr

GAP = 1e-5
DECK = """*HEADING
Post at a wall
*NODE
1, 0., 0.
2, 0., 1.
{node3}*LINE, ELSET=POST, NSET=POST, TYPE=GE8
{post}
{arm}*BEAM SECTION, ELSET=ALL, SECTION=STIFFNESS
1e12, 1.
*BOUNDARY
1, ENCASTRE
*OBSTACLE, NAME=WALL, TYPE=LINE
{wall}
*CONTACT, OBSTACLE=WALL, NSET=POST
*MONITOR, NAME=push, OBSTACLE=WALL
RN
*STEP
*ACCURACY, TOLERANCE=1E-6
*STATIC, METHOD={method}
3e-6, , {largest}
*CLOAD
2, 1, {push}
2, 6, {turn}
*STOP
LOAD, ABOVE, {stop!r}
*END STEP
"""
ARM = "*LINE, ELSET=ARM, TYPE=GE8\n2, 3\n*ELSET, ELSET=ALL\nPOST, ARM\n"
NO_ARM = "*ELSET, ELSET=ALL\nPOST\n"


def height(load, gap=GAP):
    """Where the contact is."""
    low, high = 0.75, 1.0
    for _ in range(200):
        s = 0.5 * (low + high)
        low, high = (low, s) if load * (1.0 - 4.0 * (1.0 - s)) > 6.0 * gap / s**2 else (s, high)
    return s


def force(load, s):
    return 2.0 * load * (4.0 * (1.0 - 0.5 * s) - 1.0) / s


@pytest.mark.parametrize("method", ["LOAD", "CYLINDRICAL"])
@pytest.mark.parametrize("down", [False, True], ids=["up", "down"])
@pytest.mark.parametrize("mirrored", [False, True], ids=["left", "right"])
@pytest.mark.parametrize("arm", [ARM, NO_ARM], ids=["corner", "end"])
def test_contact_leaves_the_top(arm, mirrored, down, method):
    sign = -1.0 if mirrored else 1.0
    run = dr.run_deck(DECK.format(
        node3="" if arm == NO_ARM else f"3, {sign}, 1.\n", post="2, 1" if down else "1, 2", arm=arm, push=-4.0 * sign, turn=-1.0 * sign,
        wall=f"{GAP!r}, 0., {GAP!r}, 1." if mirrored else f"-{GAP!r}, 1., -{GAP!r}, 0.", method=method,
        largest={"LOAD": 3e-5, "CYLINDRICAL": 1e-6}[method], stop=30.0 * GAP))
    contact = run.results.contact
    assert [c.label for c in run.results.critical] == ["C+", "EP"]
    dr.assert_close(run.load("C+"), 1.2 * GAP, relative=1e-6)
    load, push = run.column("load_factor"), run.column("push")
    place = 1.0 - contact.start[:, 0] if down else contact.start[:, 0]
    held = (load > 1.3 * GAP) & (load < 5.9 * GAP)
    left = load > 6.1 * GAP
    assert held.any() and left.sum() >= 3, load
    dr.assert_close(place[held], np.ones(held.sum()), absolute=1e-12)
    exact = np.array([height(x) for x in load[left]])
    dr.assert_close(place[left], exact, relative=1e-6)
    dr.assert_close(push[left], force(load[left], exact), relative=1e-6)

"""Contact at ends of rods and between lines: a free tip, a clamp on its obstacle, a hump that is pressed flat. Small rotations.

Rotations are below 1e-3 or 1e-5, their squares are what the closed forms err by.
"""
import math
import re

import numpy as np
import pytest

import deck_runner as dr

DECK = """*HEADING
{title}
*NODE
1, 0., {height}
2, {length}, {height}
*LINE, ELSET=B, NSET=B, TYPE=GE8
1, 2, {elements}
{imperfection}*BEAM SECTION, ELSET=B, SECTION=STIFFNESS
1e9, 1., , 1.
*BOUNDARY
{supports}
{obstacle}
*CONTACT, OBSTACLE=BED, NSET=B
*MONITOR, NAME=push, OBSTACLE=BED
RF2
*STEP
*STATIC, METHOD=LOAD
{first}
*CONTROLS, LOCATE=1e-10
{load}
*END STEP
"""
BED = "*OBSTACLE, NAME=BED, TYPE=LINE\n0., 0., 1., 0."


def run_deck(**fields):
    values = {"height": 0.0, "length": 1.0, "elements": 8, "imperfection": "", "supports": "1, ENCASTRE", "obstacle": BED}
    run = dr.run_deck(DECK.format(**(values | fields)))
    assert "do not get on" not in run.stdout
    return run, run.results.contact


def test_a_tip_lies_down():
    """Clamped at the height h above a bed, weight q: its tip touches at q L^4/8 = h. What does not lie on the bed in the end is
    s = (72 h/q)^(1/4), and the bed carries all but 2 q s/3."""
    run, contact = run_deck(title="A cantilever above a bed", height=1e-4, first=0.1, load="*DLOAD\nB, GRAV, 0.1, 0., -1.")
    assert [c.label for c in run.results.critical] == ["C+", "EP"]
    dr.assert_close(run.load("C+"), 8e-4 / 0.1, relative=1e-7)
    free = (72.0 * 1e-4 / 0.1) ** 0.25
    dr.assert_close((contact.start[-1, 0], contact.end[-1, 0]), (free, 1.0), absolute=1e-6)
    dr.assert_close(run.column("push")[-1], 0.1 * (1.0 - 2.0 * free / 3.0), relative=1e-6)


def test_contact_that_begins_at_a_clamp():
    """On a large drum, a force F at the tip: contact begins at F L = EI/R, and goes on to L - EI/(F R)."""
    run, contact = run_deck(title="A strip clamped on a drum", first=0.2, load="*CLOAD\n2, 2, -0.004",
                            obstacle="*OBSTACLE, NAME=BED, TYPE=CIRCLE, SIDE=OUTSIDE\n0., -1000., 1000.")
    assert [c.label for c in run.results.critical] == ["C+", "EP"]
    dr.assert_close(run.load("C+"), 0.25, relative=1e-6)
    load = run.column("load_factor")
    assert np.all(contact.count[load <= run.load("C+")] == 0)
    rows = load > 0.26
    dr.assert_close(contact.start[rows, 0], np.zeros(np.sum(rows)), absolute=1e-12)
    dr.assert_close(contact.end[rows, 0], 1.0 - 0.25 / load[rows], absolute=1e-6)


def test_a_hump_is_pressed_flat():
    """Stress-free shape a sin^2(pi x/L), clamped on the bed at both ends, one on rollers, weight q. Contact begins at both,
    where q L^2/24 = EI a pi^2/L^2, and all of it lies on the bed where the pressure is zero in the middle, at
    q = EI a/2 (2 pi/L)^4."""
    length, a = 4.0, 1e-5
    run, contact = run_deck(title="A hump is pressed flat", length=length, elements=32, supports="1, ENCASTRE\n2, YSYMM",
                            first=0.02, imperfection=f"*IMPERFECTION, ELSET=B, SHAPE=CLAMPED\n{a}\n",
                            load="*DLOAD\nB, GRAV, 1e-3, 0., -1.")
    assert [c.label for c in run.results.critical] == ["C+", "C+", "EP"]
    begins = 24.0 * a * math.pi**2 / length**4 / 1e-3
    flat = 0.5 * a * (2.0 * math.pi / length)**4 / 1e-3
    dr.assert_close([c.load_factor for c in run.labelled("C+")], [begins, flat], relative=1e-5)
    load = run.column("load_factor")
    assert np.all(contact.count[(load > begins * 1.001) & (load < flat * 0.999)] == 2)
    assert np.all(contact.count[load > flat * 0.999] == 1)
    dr.assert_close(run.column("push")[-1], length * 1e-3, relative=1e-8)


BACK = "*END STEP\n*STEP\n*STATIC, METHOD=LOAD\n0.1\n*CONTROLS, LOCATE=1e-10\n"


def test_a_tip_comes_up_again():
    """The weight is taken off again: the line becomes shorter, then the tip alone touches, down to the weight at which it began."""
    run, contact = run_deck(title="A cantilever above a bed", height=1e-4, first=0.1,
                            load="*DLOAD\nB, GRAV, 0.1, 0., -1.\n" + BACK + "*DLOAD\nB, GRAV, 0.1, 0., 1.")
    assert [c.label for c in run.results.critical] == ["C+", "EP", "C-", "EP"]
    dr.assert_close(run.load("C-"), 1.0 - 8e-4 / 0.1, relative=1e-7)
    assert contact.count[-1] == 0


def test_contact_that_ends_at_a_clamp():
    """The force is taken off a strip that lies on a drum from its clamp on, and lifts its tip in the end."""
    run, contact = run_deck(title="A strip clamped on a drum", first=0.2,
                            load="*CLOAD\n2, 2, -0.004\n" + BACK + "*CLOAD\n2, 2, 0.005",
                            obstacle="*OBSTACLE, NAME=BED, TYPE=CIRCLE, SIDE=OUTSIDE\n0., -1000., 1000.")
    assert [c.label for c in run.results.critical] == ["C+", "EP", "C-", "EP"]
    # The line ends where it is 1e-4 long.
    dr.assert_close(run.load("C-"), 0.6, absolute=1e-4)
    force = np.where(run.column("step") == 1, 0.004 * run.column("load_factor"), 0.004 - 0.005 * run.column("load_factor"))
    rows = (run.column("step") == 2) & (force > 0.0011)
    dr.assert_close(contact.end[rows, 0], 1.0 - 1e-3 / force[rows], absolute=1e-6)
    assert contact.count[-1] == 0


def test_a_support_that_is_lowered_again():
    """The pipe's end comes down the way it went up: with the same lifts at the same heights, to what is asked, and flat in the end."""
    text = dr.changed(dr.example("pipe-lift"), ("*FIELD OUTPUT, EVERY=5\nDISPLACEMENT, REACTION\n", ""))
    lift = text[text.index("*STEP, NAME=LIFT"):]
    run = dr.run_deck(text + dr.changed(lift, ("NAME=LIFT", "NAME=LOWER"), ("2, 2, 2, 2.28", "2, 2, 2, -2.28")))
    lifts = [c.monitors["lift"] for c in run.labelled("UZ")]
    assert len(lifts) == 6
    dr.assert_close(lifts[5:2:-1], lifts[:3], relative=1e-5)
    assert run.results.complete and abs(run.column("height")[-1]) < 1e-12


LIFTED = """*HEADING
Clamped beam on a floor, lifted from the line of contact at two nodes
*NODE
1, 0., 0.
2, 0.3, 0.
3, 0.6, 0.
4, 1., 0.
*LINE, ELSET=S, NSET=S, TYPE=GE8
1, 2, {elements}
2, 3, {elements}
3, 4, {elements}
*BEAM SECTION, ELSET=S, SECTION=STIFFNESS
1e6, 1.
*BOUNDARY
1, ENCASTRE
4, 2
4, 6
*OBSTACLE, NAME=O, TYPE=LINE
0., -0.002, 1., -0.002
*CONTACT, OBSTACLE=O, NSET=S
*STEP
*STATIC, METHOD=LOAD
0.1
*DLOAD
S, PY, -80.
*END STEP
*STEP
*ACCURACY
*STATIC, METHOD=LOAD
0.1
*CLOAD
2, 2, 4.
3, 2, 0.5
*END STEP
"""


@pytest.mark.parametrize("elements", [4, 6])
def test_what_nodes_find_lost_has_no_bar_that_it_is_not_within(elements):
    """Any force lifts a line at once: from two ends without moment 3 P/(2 q) of it, so that both are lifted from load factor 0 on. Where
    nodes are asked for the next set they may find one far beyond: what is lost lies between, and that is said."""
    run = dr.run_deck(LIFTED.format(elements=elements), code=None)
    lost = [c for c in run.results.critical if c.label == "C-"]
    assert lost
    for event in lost:
        assert np.isnan(event.error) or event.located and event.load_factor <= event.error
    if not all(event.located for event in lost):
        between = re.search(r"(?:contact lost|a contact region splits) between load factors (\S+) and (\S+) was not located", run.stdout)
        assert run.code == 2 and float(between[1]) <= 0.0 <= float(between[2])


PRESSED_TIP = """*HEADING
Beam of some weight on a rigid floor, its tip turned down
*NODE
1, 0., 0.
2, 3., 0.
*LINE, ELSET=BEAM, NSET=BEAM, TYPE=GE8
1, 2{count}
*BEAM SECTION, ELSET=BEAM, SECTION=STIFFNESS
1e7, 1.
*BOUNDARY
1, 1
*OBSTACLE, NAME=FLOOR, TYPE=LINE
-1., 0., 4., 0.
*CONTACT, OBSTACLE=FLOOR, NSET=BEAM
*MONITOR, NAME=turn
2, UR, -1.
*STEP
*STATIC, METHOD=LOAD
1.
*DLOAD
BEAM, PY, -0.3
*END STEP
*STEP
{accuracy}*STATIC
0.05, , 1E-3
*CLOAD
2, 6, {couple}
*STOP
LOAD, ABOVE, 1.
*END STEP
"""


@pytest.mark.parametrize("count, accuracy", [(", 24", ""), ("", "*ACCURACY, TOLERANCE=1E-6\n")])
def test_a_couple_presses_a_tip_down(count, accuracy):
    """The beam rises before it, from the first moment on: over l = 2 sqrt(C/q), with the slope C l/6 at the tip."""
    couple, weight = 0.01, 0.3
    run = dr.run_deck(PRESSED_TIP.format(count=count, accuracy=accuracy, couple=-couple))
    assert [c.label for c in run.results.critical] == ["EP", "C-", "EP"]
    split, end = run.results.critical[1:]
    assert split.load_factor == 0.0
    line, tip = run.results.contact.regions(end.point)
    length = 2.0 * math.sqrt(couple / weight)
    dr.assert_close([line.start, line.end, tip.start, tip.end], [0.0, 3.0 - length, 3.0, 3.0], absolute=1e-5 * length)
    dr.assert_close(end.monitors["turn"], couple * length / 6.0, relative=1e-5)

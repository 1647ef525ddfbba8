"""Springs and stops by a law: two-sided, falling, of rotations and between two nodes, against linear beam theory (displacements are
so small, or motions so simple, that it holds) or an integration of the beam's equation."""
import h5py
import numpy as np
import pytest

import deck_runner as dr
from unilat.results.contact_forces import contact_forces


def linear(points):
    """A piecewise linear function through points."""
    return lambda x: np.interp(x, *np.transpose(points))


def test_leaves_with_play_on_a_post_that_crushes():
    """input/leaf-springs.inp; deflections reach 4e-3 of the length, their square is the error."""
    run = dr.run_deck(dr.example("leaf-springs"))
    post = linear([(0.0005, 0.0), (0.001, 0.006), (0.0015, 0.002)])
    lower, upper, force = run.column("lower"), run.column("upper"), 0.02 * run.column("load_factor")
    meet = lower > 1e-9
    dr.assert_close(upper[meet], lower[meet] + 0.001, absolute=1e-12)
    dr.assert_close(force, 3.0 * (upper + lower) + post(lower), absolute=5e-5 * 0.02)
    dr.assert_close(run.column("post"), post(lower), absolute=1e-7)
    dr.assert_close(run.column("play"), 3.0 * lower + post(lower), absolute=5e-5 * 0.02)
    assert [c.label for c in run.results.critical] == ["C+", "C+", "LP", "LP", "EP"]
    dr.assert_close([0.02 * c.load_factor for c in run.results.critical], [0.003, 0.006, 0.015, 0.014, 0.02], relative=5e-5)
    with h5py.File(run.results.filename) as file:      # a row a point of the law, a row a check
        assert file["obstacles/POST/law"][0].tolist() == [0.0, 0.0] and file["obstacles/POST/law"].shape == (4, 2)
        assert file["accuracy/place"].shape == (len(file["accuracy/check"]), 5)


PAIR = """*HEADING
Two cantilevers of a frame that is turned by {turn} degrees
*PARAMETER
t = {turn}
*NODE
1, 0, 0
2, ${{cos(t*pi/180)}}, ${{sin(t*pi/180)}}
3, ${{2*cos(t*pi/180)}}, ${{2*sin(t*pi/180)}}
4, ${{cos(t*pi/180)}}, ${{sin(t*pi/180)}}
*LINE, ELSET=BEAM, TYPE=GE8
1, 2, 4
3, 4, 4
*BEAM SECTION, ELSET=BEAM, SECTION=STIFFNESS
1e6, 1
*BOUNDARY
1, ENCASTRE
3, ENCASTRE
*FOUNDATION LAW, NAME=BOTH
0, 0
1e-4, 6e-4
1, 2.5998
{joint}
*MONITOR, NAME=R, OBSTACLE=J
RN
*MONITOR, NAME=X
4, U1
*MONITOR, NAME=Y
4, U2
*STEP
*STATIC, METHOD=LOAD
0.2, , 0.2
*CLOAD
2, 1, ${{{load}*sin(t*pi/180)}}
2, 2, ${{-{load}*cos(t*pi/180)}}
*END STEP
"""


@pytest.mark.parametrize("turn", [0, 90, 217])
@pytest.mark.parametrize("more, spring", [("", None), (", STIFFNESS=6", 6.0)])
def test_gap_between_two_nodes_goes_with_the_frame(turn, more, spring):
    """The force F presses one tip on the other after 1e-4: F - R = 3 u, R = 3 w, R = spring (u - w - 1e-4); it is the same in all axes.
    Deflections are 1e-3, their square is the error."""
    joint = f"*GAP, NAME=J, DIRECTION={90 + turn}{more}\n2, 1e-4, 4"
    run = dr.run_deck(PAIR.format(turn=turn, joint=joint, load=0.003))
    soft = 0.0 if spring is None else 1.0 / spring
    force = 0.003 * run.column("load_factor")
    reaction = np.maximum(force / 3.0 - 1e-4, 0.0) / (2.0 / 3.0 + soft)
    dr.assert_close(run.column("R"), reaction, absolute=3e-9)
    along = np.array([np.sin(np.radians(turn)), -np.cos(np.radians(turn))])
    dr.assert_close(run.column("X") * along[0] + run.column("Y") * along[1], reaction / 3.0, absolute=1e-9)
    dr.assert_close(run.only("C+").load_factor, 0.1, relative=1e-5)
    assert all(value < 1e-9 for value in run.results.accuracy.values())


@pytest.mark.parametrize("load", [0.003, -0.003])
def test_spring_by_a_law_between_two_nodes(load):
    """Both senses alike: the stiffness is 6 up to 1e-4 and 2 beyond."""
    run = dr.run_deck(PAIR.format(turn=0, joint="*SPRING, LAW=BOTH, NAME=J\n2, 4", load=load))
    # With the force in the spring f: F - f = 3 u, f = 3 w, so u - w = (F - 2 f)/3.
    apart = np.linspace(0.0, 1e-3, 10001)
    slope = (2.5998 - 6e-4) / (1.0 - 1e-4)
    force = lambda x: np.where(x < 1e-4, 6.0 * x, 6e-4 + slope * (x - 1e-4))  # noqa: E731
    expected = np.interp(0.003 * run.column("load_factor"), 3.0 * apart + 2.0 * force(apart), force(apart))
    dr.assert_close(np.abs(run.column("R")), expected, absolute=3e-9)
    dr.assert_close(run.column("Y"), -np.sign(load) * expected / 3.0, absolute=1e-9)


HINGE = """*HEADING
Rod on a hinge with a law
*NODE
1, 0, 0
2, 1, 0
*LINE, ELSET=BEAM, TYPE=GE8
1, 2, 4
*BEAM SECTION, ELSET=BEAM, SECTION=STIFFNESS
1e8, 1e8
*BOUNDARY
1, PINNED
*FOUNDATION LAW, NAME=HINGE
0, 0
0.1, 6
0.3, 2
1, 9
{joint}
*MONITOR, NAME=M, OBSTACLE=J
RN
*MONITOR, NAME=TURN
2, UR
*STEP
*STATIC
0.1, , 0.1
*CLOAD
2, 6, {moment}
*STOP
TURN, {way}
*END STEP
"""


@pytest.mark.parametrize("sense", [1, -1])
def test_hinge_by_a_falling_law(sense):
    """A rod that hardly bends (1e-7 of the turn) and a moment at its end: the moment is that of the law, at large turns too."""
    way = "ABOVE, 0.6" if sense > 0 else "BELOW, -0.6"
    run = dr.run_deck(HINGE.format(joint="*SPRING, LAW=HINGE, NAME=J, ROTATION=ANTICLOCKWISE\n1", moment=10 * sense, way=way))
    law = linear([(0.0, 0.0), (0.1, 6.0), (0.3, 2.0), (1.0, 9.0)])
    dr.assert_close(10.0 * run.column("load_factor"), law(np.abs(run.column("TURN"))), absolute=1e-5)
    dr.assert_close(run.column("M"), -10.0 * sense * run.column("load_factor"), absolute=1e-8)
    dr.assert_close(run.results.critical[0].load_factor, 0.6, relative=1e-6)
    assert run.results.critical[0].label == "LP"


def test_post_on_a_hinge_that_fails():
    """The example: a post that hardly bends, so that the load is the law over the turn."""
    run = dr.run_deck(dr.example("failing-hinge"))
    assert [c.label for c in run.results.critical] == ["LP", "UZ", "LP", "EP"]
    dr.assert_close([c.load_factor for c in run.results.critical], [0.6, 0.4, 0.2, 0.5], relative=1e-6)
    dr.assert_close(run.column("couple"), -10.0 * run.column("load_factor"), absolute=1e-8)


@pytest.mark.parametrize("sense, word", [(1, "ANTICLOCKWISE"), (-1, "CLOCKWISE")])
def test_rigid_stop_of_a_rotation(sense, word):
    """A rod (EI = 1) on a hinge with a spring of 2 turns against a rigid stop at 0.2 that pushes in the sense of the card: from 0.4 on the
    moment goes into the stop."""
    joint = f"*SPRING\n1, 6, 2\n*GAP, NAME=J, ROTATION={word}\n1, 0.2"
    text = HINGE.format(joint=joint, moment=-sense, way=("BELOW" if sense > 0 else "ABOVE") + f", {-0.7 * sense}")
    run = dr.run_deck(dr.changed(text, ("1e8, 1e8", "1e8, 1")))
    moment = run.column("load_factor")
    dr.assert_close(run.column("M"), np.maximum(moment - 0.4, 0.0), absolute=1e-9)
    dr.assert_close(run.column("TURN"), -sense * (np.minimum(moment / 2.0, 0.2) + moment), absolute=1e-8)
    dr.assert_close(run.only("C+").load_factor, 0.4, relative=1e-9)


BED = dr.example("softening-ground")


def test_beam_on_ground_that_softens():
    """The force has a maximum and a minimum. Expected: w' = sin t, t' = M/EI, M' = -V cos t, V' = law(w) by shooting from an end (DOP853,
    1e-11; EA infinite, which makes 1e-8). The bar of the maximum falls with the order 8 of the elements. That of the end need not: which
    corners of the law have nodes there depends on where the points of the path lie."""
    bars = []
    for elements in (20, 40):
        run = dr.run_deck(dr.changed(BED, ("1, 2, 40", f"1, 2, {elements}"), ("NSET=MID\n22", f"NSET=MID\n{elements // 2 + 2}")))
        points = [c for c in run.results.critical]
        assert [c.label for c in points] == ["LP", "LP", "EP"]
        dr.assert_close([c.load_factor for c in points], [0.6379749554, 0.5417067550, 0.5631731545], relative=3e-8)
        bars.append(points[0].error)
    assert bars[1] < bars[0] / 2**7


# Members ------------------------------------------------------------------------------------------------------------


STAYS = dr.example("stays")


def test_one_of_two_stays_goes_slack():
    """A truss of straight bars: the forces of stay and strut at the place of their node balance the load. Their horizontal part is 99.36."""
    run = dr.run_deck(STAYS)
    x, y, pull = run.column("x")[-1], run.column("y")[-1], run.column("upper")[-1]
    stiffness = 29000 * 0.94
    stay, strut = np.array([100.0 + x, y - 10.0]), np.array([100.0 + x, y])
    force = -stiffness * (np.linalg.norm(stay) / np.hypot(100.0, 10.0) - 1.0) * stay / np.linalg.norm(stay)
    dr.assert_close(np.linalg.norm(force), pull, relative=1e-10)
    force -= stiffness * (np.linalg.norm(strut) / 100.0 - 1.0) * strut / np.linalg.norm(strut)
    dr.assert_close(force, [0.0, 10.0], absolute=1e-7)
    dr.assert_close(run.column("lower"), np.zeros(len(run.column("lower"))), absolute=1e-12)
    assert abs(pull * stay[0] / np.linalg.norm(stay) - 99.36) < 0.01
    assert all(value < 1e-8 for name, value in run.results.accuracy.items() if name != "strain")


TIP_MEMBER = """*HEADING
Cantilever with a bar at its tip, to a place that moves
*NODE
1, 0, 0
2, 1, 0
9, 1.2, -0.5
*LINE, ELSET=BEAM
1, 2, 4
*BEAM SECTION, ELSET=BEAM, SECTION=STIFFNESS
1e6, 1
*BOUNDARY
1, ENCASTRE
9, ENCASTRE
*FOUNDATION LAW, NAME=STRAIGHT
0, 0
0.05, 0.25
1, 5
{members}
*MONITOR, NAME=Y
2, U2
*STEP
*STATIC, METHOD=LOAD
0.2
{load}
*END STEP
"""


@pytest.mark.parametrize("load", ["*CLOAD\n2, 2, 2", "*CLOAD\n2, 2, -1.2", "*BOUNDARY\n9, 2, , 0.3", "*BOUNDARY\n9, 2, , -0.3"])
def test_pull_and_press_are_one_bar(load):
    """A bar by a law in both senses is one that pulls and one that presses; each alone acts in one sense only."""
    pull, press = ("*GAP, NAME=J{0}, MEMBER={0}, STIFFNESS=5\n2, 0, 9\n".format(way) for way in ("PULL", "PRESS"))
    both = "*SPRING, NAME=B, MEMBER, LAW=STRAIGHT\n2, 9\n"
    tip = [dr.run_deck(TIP_MEMBER.format(members=members, load=load)).column("Y")[-1] for members in (pull + press, both, pull, press)]
    assert abs(tip[0]) > 0.05
    assert abs(tip[1] - tip[0]) < 1e-9
    pulls = load.endswith(" 2") or load.endswith("-0.3")
    assert abs(tip[2 if pulls else 3] - tip[0]) < 1e-9
    assert abs(tip[3 if pulls else 2] - tip[0]) > 0.01


@pytest.mark.parametrize("load", ["*CLOAD\n2, 2, 2"])
def test_rope_has_a_length(load):
    """Without STIFFNESS the tip stays on the circle about the far end, once the slack is used up."""
    deck = TIP_MEMBER.format(members="*GAP, NAME=J, MEMBER=PULL\n2, 0.05, 9\n", load=load).replace("*STEP", "*MONITOR, NAME=X\n2, U1\n*STEP")
    run = dr.run_deck(deck)
    length = np.hypot(1.0 + run.column("X")[-1] - 1.2, run.column("Y")[-1] + 0.5)
    assert abs(length - np.hypot(0.2, 0.5) - 0.05) < 1e-10


def test_picture_of_a_stay():
    """It pulls along the bar, at the node where it is now."""
    run = dr.run_deck(STAYS)
    point = run.only("EP").point
    force, = contact_forces(run.results, point)[0]
    moved = run.results.field("displacement", point)[1, :2]
    bar = np.array([0.0, 10.0]) - (np.array([100.0, 0.0]) + moved)
    dr.assert_close(force.force, run.column("upper")[-1] * bar / np.hypot(*bar), relative=1e-9)


# --- corners of a law under a ring that is held on both sides --------------------------------------------------------------------------

HELD_RING = """*HEADING
ring that a law holds from both sides
*NODE
1, 0., 1.
2, 0., -1.
*ARC, ELSET=RING, NSET=RING
1, 2, 0., 0.
*BEAM SECTION, ELSET=RING, SECTION=STIFFNESS
4800., 1.
*BOUNDARY
1, XSYMM
2, XSYMM
*FOUNDATION LAW, NAME=CLAY
0., 0.
0.0051, 38.76
0.0153, 116.28
*OBSTACLE, NAME=BED, TYPE=CIRCLE, {bed}, BILATERAL
0., 0., 1.
*CONTACT, OBSTACLE=BED, NSET=RING
*MONITOR, NAME=v
1, U2, -1.
*STEP
*STATIC, METHOD=LOAD
0.1, , 0.1
*DLOAD
RING, PN, 106.
*CLOAD
1, 2, -9.
*END STEP
"""


def test_a_straight_law_is_a_modulus_on_a_curved_bed_that_pulls():
    """A law whose corner turns by nothing is a Winkler foundation of the same stiffness. The places where the ring passes the corner are
    found together with equilibrium: the slope of the gap is against the normal at the moved place and the one where the gap counts from."""
    law = dr.run_deck(HELD_RING.format(bed="FOUNDATION=LAW, LAW=CLAY"))
    modulus = dr.run_deck(HELD_RING.format(bed="FOUNDATION=WINKLER, MODULUS=7600.").replace(
        "*FOUNDATION LAW, NAME=CLAY\n0., 0.\n0.0051, 38.76\n0.0153, 116.28\n", ""))
    dr.assert_close(law.column("v")[-1], modulus.column("v")[-1], relative=2e-6)   # TOLERANCE, twice

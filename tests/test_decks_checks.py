"""What a run says of its own answer: checks that are not alarmed by rounding, meshes and numbers that carry too little.

Limit loads of rings in a cavity: 81.5574274 for R/h = 100 (test_decks_ring), 3151.6 for 10000, by finer meshes.
"""
import functools
import re

import deck_runner as dr
import pytest

# What carries next to nothing -------------------------------------------------------------------------------------------

LIFTED = """*HEADING
cantilever lifted against soft ground, with the C+ located where gap and reaction are rounding
*NODE
1, 0, 0
2, 1, 0
*LINE, ELSET=E, NSET=N
1, 2, 8
*BEAM SECTION, ELSET=E, SECTION=STIFFNESS
1e6, 1
*BOUNDARY
1, ENCASTRE
*OBSTACLE, NAME=O, TYPE=LINE, FOUNDATION=WINKLER, MODULUS=10
1, 0.003, 0, 0.003
*CONTACT, OBSTACLE=O, NSET=N, POINTS=NODES
*STEP
*STATIC
0.1
*DLOAD
E, PY, 0.1
*STOP
LOAD, ABOVE, 2
*END STEP
"""

IDLE = """*HEADING
shallow arch that touches soft ground, no load at all
*NODE
1, 0.39, 0.92
2, -0.39, 0.92
*ARC, ELSET=E, NSET=N
1, 2, 0, 0, 8
*BEAM SECTION, ELSET=E, SECTION=STIFFNESS
100, 1
*BOUNDARY
1, PINNED
2, PINNED
*OBSTACLE, NAME=O, TYPE=CIRCLE, FOUNDATION=WINKLER, MODULUS=200, SIDE=OUTSIDE
0, 0, 0.99924971853886422
*CONTACT, OBSTACLE=O, NSET=N
*STEP
*BUCKLE
2
*DLOAD
E, PY, -30
*END STEP
"""


SOFT = """*HEADING
ring on a foundation, k R^4/EI = 1
*NODE
1, 0., 1.
2, 0., -1.
*ARC, ELSET=RING, NSET=RING, TYPE=GE4
1, 2, 0., 0., 160
*BEAM SECTION, ELSET=RING, SECTION=STIFFNESS
120000., 1.
*BOUNDARY
1, XSYMM
2, XSYMM
*OBSTACLE, NAME=MEDIUM, TYPE=CIRCLE, SIDE=INSIDE, REFERENCE=90., FOUNDATION=WINKLER, MODULUS=1.0
0., 0., 1.
*CONTACT, OBSTACLE=MEDIUM, NSET=RING, POINTS=ALONG
*MONITOR, NAME=v
1, U2, -1.
*STEP
*STATIC, METHOD=CYLINDRICAL
0.01, 1E-9, 0.02
*DLOAD
RING, PY, -1.
*STOP
v, ABOVE, 1.7
*END STEP
"""


@pytest.mark.parametrize("deck", [LIFTED, IDLE], ids=["first contact", "buckling of the start"])
def test_rounding_is_no_error(deck):
    run = dr.run_deck(deck)
    assert run.results.status == "complete"


def test_ring_on_the_softest_ground():
    """k R^4/EI = 1: nothing but rounding pushes at the start. Load by GE4 with twice the elements and GE6: 0.794088363."""
    dr.assert_close(dr.run_deck(SOFT).load("EP"), 0.79408836258, relative=1e-8)


HELD_AGAINST_ITSELF = """*HEADING
strip beside an elastic half-space, pressed against it and then bent away by heat
*NODE
1, 0, 0
2, 0.5, 0
3, 1, 0
*LINE, ELSET=E, NSET=N, TYPE=UL2
1, 2, 6
2, 3, 6
*BEAM SECTION, ELSET=E, SECTION=STIFFNESS
156.960151563, 1, , , 2.67653583133e-05
*BOUNDARY
1, ENCASTRE
*OBSTACLE, NAME=O0, TYPE=LINE, FOUNDATION=HALF SPACE, YOUNG=334.680904928, POISSON=0.143327668766, WIDTH=0.0436531956745
1, 0.00023875555234885855, 0, 0.00023875555234885855
*CONTACT, OBSTACLE=O0, NSET=N, POINTS=AUTO
*STEP
*STATIC, METHOD=VARIABLE LOAD
0.02, , 0.087
*DLOAD
E, P, 0.234437684241
*STOP
LOAD, ABOVE, 2.89722756663
*END STEP
*STEP
*STATIC, METHOD=LARGEST DISPLACEMENT, LOOP=PAPER
0.165
*TEMPERATURE
E, 276.895185075, 32705.302035
*STOP
LOAD, ABOVE, 0.4
*FIELD OUTPUT
REACTION
*END STEP
"""


def test_contact_is_lost_where_the_last_node_lets_go():
    """Held while it is looked for, a region of two nodes pulls at one what it pushes at the other: not there."""
    run = dr.run_deck(HELD_AGAINST_ITSELF)
    assert run.labelled("C-")[-1].located
    assert run.results.accuracy["tension"] < 1e-8


# Meshes -----------------------------------------------------------------------------------------------------------------

@functools.cache
def ring(element, elements, points, code, stiffness="120000.", last=0.06):
    return dr.run_deck(dr.changed(dr.on_given_mesh("ring"), ("0., 0., 160, 6.", f"0., 0., {elements}"), ("TYPE=GE4", f"TYPE={element}"),
                                  ("POINTS=ALONG", f"POINTS={points}"), ("ABOVE, 0.6", f"ABOVE, {last}"),
                                  ("*LOCATE\nLOAD, 34., 57., 62., 28.\n", ""), ("120000.,", f"{stiffness},")), code=code)


def told(run):
    """Where it begins, which elements, why: from the status and from the line below the point of the listing."""
    found = re.search(r"the mesh is too coarse from point (\d+) \(load factor (\S+)\) on: (elements?) ([\d, .-]+) (.*): more elements are "
                      r"needed there", run.results.status)
    assert found, run.results.status
    lines = run.stdout.splitlines()
    at, = [k for k, line in enumerate(lines) if "! From here on the mesh is too coarse" in line]
    assert lines[at - 1].split()[0] == found[1]
    assert f"{found[3]} {found[4]}" in lines[at]
    return found


def test_order_two_elements_too_long_for_their_waves():
    """12 % off with 20 elements, by mu/12 at the limit point; 160 are right to 0.3 % and say nothing."""
    run = ring("UL2", 20, "NODES", 2)
    assert "waves of the compressed rod" in told(run)[5]
    assert float(told(run)[2]) < run.labelled("LP")[0].load_factor
    assert run.results.accuracy["mesh"] > 10.0
    fine = ring("UL2", 160, "NODES", 0)
    dr.assert_close(fine.load("LP"), 81.5574274, relative=4e-3)
    assert fine.results.accuracy["mesh"] < 1.0


def test_one_element_for_half_a_ring():
    """Its ends lean against each other, and between them it carries what the whole load presses: no limit point at all."""
    run = ring("GE2", 1, "NODES", 2)
    assert not run.labelled("LP")
    assert told(run)[4] == "1" and "waves of the compressed rod" in told(run)[5]


def test_a_wrong_point_is_the_last():
    """Newton's method may leave three tenths of the load out of balance: the check of every node finds the first such point."""
    run = dr.run_deck("""*NODE
1, 0., 0.
2, 1., 0.
*LINE, ELSET=ROD
1, 2, 8
*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS
1E4, 1.
*BOUNDARY
1, ENCASTRE
*STEP
*STATIC, METHOD=LOAD
0.1, , 0.1
*CLOAD
2, 2, 10.
*CONTROLS, TOLERANCE=0.3
*END STEP
*STEP
*STATIC, METHOD=LOAD
0.1, , 0.1
*CLOAD
2, 1, 1.
*END STEP
""", code=2)
    wrong = re.search(r"own checks found it wrong: balance of every node \S+ at point (\d+) \(load factor (\S+)\), node 2", run.stderr)
    assert int(wrong.group(1)) == run.results.n_points < 5 and set(run.column("step")) == {1}
    assert float(wrong.group(2)) == pytest.approx(run.column("load_factor")[-1], rel=1e-5)
    assert run.stderr.count("own checks") == 1 and "METHOD" not in run.stderr and "POINTS" not in run.stderr
    assert run.results.accuracy["node_balance"] > 1e-4


def test_slack_of_a_thin_ring():
    """R/h = 10000 on 80 GE8 held at their nodes: half of the limit load, because the elements bend through the wall as it pushes
    them. Contact spans have no such slack: test_decks_ring."""
    run = ring("GE8", 80, "NODES", 2, stiffness="1.2e9", last=0.004)
    assert "curved obstacle" in told(run)[5]
    assert run.labelled("LP")[0].load_factor < 0.6 * 3151.6


def test_elements_between_the_nodes_of_a_flat_bed():
    """Heated pipe with elements of 0.2 far away: at N h^2/EI = pi^2 they buckle between the nodes that the bed holds. (A contact
    span is held all along and has no such length.)"""
    text = """*HEADING
heated pipe on a rigid bed
*NODE
1, 0., 0.
2, 4., 0.
3, 20., 0.
*LINE, ELSET=P, NSET=P, TYPE=GE6
1, 2, 80
2, 3, 80
*BEAM SECTION, ELSET=P, SECTION=STIFFNESS
2e4, 1., , 1., 1e-3
*BOUNDARY
1, XSYMM
3, ENCASTRE
*OBSTACLE, NAME=BED, TYPE=LINE
0., 0., 1., 0.
*CONTACT, OBSTACLE=BED, NSET=P, POINTS=NODES
*STEP
*STATIC, METHOD=LOAD
1.
*DLOAD
P, GRAV, 0.05, 0., -1.
*END STEP
*STEP
*STATIC, METHOD=LOAD
0.5
*TEMPERATURE
P, 12.5
*END STEP
"""
    assert float(told(dr.run_deck(text, code=2))[2]) * 12.5 * 20.0 < 265.0
    dr.run_deck(dr.changed(text, ("2, 3, 80", "2, 3, 240")))


# Numbers ----------------------------------------------------------------------------------------------------------------

def arch(elements, stiffness, static="METHOD=CYLINDRICAL\n0.1, 1E-9, 0.02", stop="*STOP\nv, ABOVE, 1.19\nLOAD, ABOVE, 10.\n"):
    return f"""*HEADING
arch of 215 degrees, clamped and hinged
*NODE
1, -0.9537169507482269, -0.30070579950427295
2, 0., 1.
3, 0.9537169507482269, -0.30070579950427295
*ARC, ELSET=ARCH, TYPE=GE4, DIRECTION=CLOCKWISE
1, 2, 0., 0., {elements // 2}
2, 3, 0., 0., {elements // 2}
*BEAM SECTION, ELSET=ARCH, SECTION=STIFFNESS
{stiffness}, 1.
*BOUNDARY
1, ENCASTRE
3, PINNED
*MONITOR, NAME=v
2, U2, -1.
*STEP
*STATIC, {static}
*CLOAD
2, 2, -1.
{stop}*END STEP
"""


@dr.release_only
def test_rounding_of_stiff_elements_is_told():
    """EA L^2/EI n^2 of 1e18: nothing that the tangent tells is right; 1e12 is, and nothing is said."""
    run = dr.run_deck(arch(640, "1e12", stop="*STOP\nv, ABOVE, 0.7\n"), code=2)
    assert "rounding" in run.results.status and "a smaller EA" in run.results.status
    fine = dr.run_deck(arch(160, "1e6"))
    assert fine.results.accuracy["rounding"] < 1e-3
    dr.assert_close(fine.load("LP"), 8.972949, relative=1e-6)


@dr.release_only
def test_a_start_that_is_rounding_ends_at_once():
    """100000 elements, the fourth power of their number: no iteration is tried, and supports are not blamed."""
    run = dr.run_deck(arch(100000, "1e6", "METHOD=LOAD\n1.", ""), code=2)
    assert run.results.status.startswith("stopped: the tangent at the start is nothing but rounding: fewer elements")
    assert run.results.n_points == 0


def test_column_in_a_tiny_unit_of_length():
    """input/column.inp, lengths times 1e-10: EI/L is 1e-20 of EA, yet all is as it was."""
    one = dr.run_deck(dr.on_given_mesh("column"))
    text = """*HEADING
column, L = 1e-10
*NODE
1, 0., 0.
2, 5e-11, 0.
3, 1e-10, 0.
*LINE, ELSET=COLUMN, NSET=COLUMN, TYPE=GE6
1, 2, 40
2, 3, 40
*IMPERFECTION, ELSET=COLUMN, SHAPE=CLAMPED
1.4e-13, 1.05e-13
*BEAM SECTION, ELSET=COLUMN, SECTION=STIFFNESS
480000., 1e-20
*BOUNDARY
1, ENCASTRE
3, YSYMM
*OBSTACLE, NAME=WALL, TYPE=LINE
1e-10, 2e-12, 0., 2e-12
*CONTACT, OBSTACLE=WALL, NSET=COLUMN, POINTS=ALONG
*MONITOR, NAME=shortening
3, U1, -1.
*STEP
*STATIC, METHOD=CYLINDRICAL
0.1, 1E-12, 0.003
*CLOAD
3, 1, -39.47841760435743
*STOP
shortening, ABOVE, 5e-12
*END STEP
"""
    tiny = dr.run_deck(text)
    dr.assert_close([c.load_factor for c in tiny.labelled("LP")], [c.load_factor for c in one.labelled("LP")], relative=1e-8)

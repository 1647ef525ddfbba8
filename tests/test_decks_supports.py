"""One-sided supports of nodes (*GAP) and interferences, against linear beam theory: displacements are so small, or motions so
simple, that it holds."""
import itertools
import math

import numpy as np
import pytest

import deck_runner as dr

# Stops -----------------------------------------------------------------------------------------------------------


def test_beam_on_rollers():
    """The two spans of input/beam-rollers.inp, q = 1e-3; slopes reach 1e-3, their square is the error."""
    run = dr.run_deck(dr.on_given_mesh("beam-rollers"))
    q = 1e-3
    force = np.where(run.column("step") == 1, 0.0, run.column("load_factor"))[1:]
    first, second, last, rise = (run.column(name)[1:] for name in ("first", "second", "last", "rise"))
    lies = force < 4 * q
    assert 3 <= np.count_nonzero(lies) <= len(force) - 4
    r_c = np.where(lies, 3 / 8 * q - 3 / 32 * force, 0.0)
    dr.assert_close(last, r_c, absolute=1e-5 * q)
    dr.assert_close(second, np.where(lies, 10 / 8 * q + 22 / 32 * force, force / 2 + 2 * q), relative=1e-6)
    dr.assert_close(first, np.where(lies, 3 / 8 * q + 13 / 32 * force, force / 2), relative=1e-6)
    dr.assert_close(rise, np.where(lies, 0.0, force / 16 - q / 4), absolute=1e-5 * q)
    lost = run.only("C-")
    dr.assert_close(lost.load_factor, 4 * q, relative=1e-6)
    for name, x in (("A", 0.0), ("B", 1.0), ("C", 2.0)):
        stop = run.results.obstacles[name]
        assert stop.kind == "gap" and stop.foundation == "rigid"
        dr.assert_close(stop.points, [[x, 0.0]], absolute=1e-12)
        dr.assert_close(stop.normal, [0.0, 1.0])
    each = run.results.contact.obstacle_force[1:]
    dr.assert_close(each[:, :, 0], np.zeros((len(force), 3)), absolute=1e-15)
    dr.assert_close(each[:, :, 1], np.column_stack((first, second, last)), absolute=1e-15)


def test_beam_between_buffers():
    """The tip of input/beam-buffers.inp is a spring of stiffness 3, its deflection to 3e-3: the square is the error."""
    run = dr.run_deck(dr.on_given_mesh("beam-buffers"))
    applied = np.where(run.column("step") == 1, -0.01 * run.column("load_factor"), -0.01 + 0.043 * run.column("load_factor"))
    w = np.interp(applied, [-0.01, -0.006, 0.003, 0.012, 0.033], [-0.002, -0.002, 0.001, 0.002, 0.003])
    dr.assert_close(run.column("tip"), w, absolute=3e-3 * 1e-5)
    dr.assert_close(run.column("stop"), np.maximum(-0.006 - applied, 0.0), absolute=1e-7)
    dr.assert_close(run.column("buffer"), np.interp(w, [0.001, 0.002, 0.003], [0.0, 0.006, 0.024]), absolute=1e-6)
    assert [c.label for c in run.results.critical if c.label[0] == "C"] == ["C+", "C-", "C+"]


TIP = """*HEADING
Cantilever whose tip meets stops
*NODE
1, 0, 0
2, 1, 0
*LINE, ELSET=BEAM, TYPE={kind}
1, 2, 8
*BEAM SECTION, ELSET=BEAM, SECTION=STIFFNESS
10, 1
*BOUNDARY
1, ENCASTRE
{stops}
*MONITOR, NAME=U
2, U1
*MONITOR, NAME=V
2, U2
{steps}"""


def tip_step(x, y, more=""):
    return f"*STEP\n*STATIC, METHOD=LOAD\n0.2, , 0.2\n*CLOAD\n2, 1, {x}\n2, 2, {y}\n{more}*FIELD OUTPUT\nREACTION, GAP\n*END STEP\n"


def corner_answer(force, normals, clearance):
    """Tip displacement and reactions: stiffness 10 along, 3 across; the contact set by trying all."""
    k = np.diag([10.0, 3.0])
    for n in range(len(normals) + 1):
        for active in itertools.combinations(range(len(normals)), n):
            a = np.array([normals[i] for i in active]).reshape(n, 2)
            system = np.block([[k, -a.T], [a, np.zeros((n, n))]])
            if n > 2 or (n and np.linalg.matrix_rank(a) < n):
                continue
            answer = np.linalg.solve(system, np.concatenate((force, [-clearance[i] for i in active])))
            gaps = [normals[i] @ answer[:2] + clearance[i] for i in range(len(normals))]
            if min(gaps) > -1e-12 and all(answer[2:] > -1e-12):
                reaction = np.zeros(len(normals))
                reaction[list(active)] = answer[2:]
                return answer[:2], reaction
    raise AssertionError("no contact set")


@pytest.mark.parametrize("loop", ["NEWTON", "PAPER"])
def test_corner_of_two_rigid_stops(loop):
    """A node that two stops hold at once, reached and left from both sides."""
    angles = (180.0, 100.0)
    normals = [np.array([math.cos(math.radians(a)), math.sin(math.radians(a))]) for a in angles]
    loads = [(4e-4, -6e-5), (-4e-4, -1e-4), (1e-4, 3e-4), (3e-4, -4e-4), (0.0, 5e-4), (0.0, -8e-4), (-6e-4, 0.0)]
    run = dr.run_deck(TIP.format(
        kind="GE4", stops="*GAP, NAME=RIGHT, DIRECTION=180\n2, 1e-5\n*GAP, NAME=BELOW, DIRECTION=100\n2, 1e-5",
        steps="".join(tip_step(*load) for load in loads)).replace("METHOD=LOAD", f"METHOD=LOAD, LOOP={loop}"))
    done = np.vstack((np.zeros(2), np.cumsum(loads, axis=0)))
    corner = 0
    for row in range(1, run.results.n_points):
        step = int(run.column("step")[row])
        force = done[step - 1] + run.column("load_factor")[row] * np.array(loads[step - 1])
        u, r = corner_answer(force, normals, (1e-5, 1e-5))
        # rotations of 1e-4 turn forces of 1e-3 in the stiffness by 1e-7
        dr.assert_close([run.column("U")[row], run.column("V")[row]], u, absolute=2e-8)
        dr.assert_close(run.results.field("reaction", row + 1), r, absolute=3e-7)
        corner += np.all(r > 1e-6)
    assert corner >= 3
    assert run.results.accuracy["penetration"] < 1e-13


def test_stops_in_a_row_do_not_share_contact():
    """Neighbours on the rod are stops of their own: each region is a point, whatever lies between them."""
    run = dr.run_deck(TIP.format(kind="GE4", stops="*NSET, NSET=ROW\n2, 9, 8\n*GAP, NAME=ROW, STIFFNESS=5\nROW",
                                 steps=tip_step(0.0, -1e-4)).replace("REACTION, GAP", "REACTION, GAP, DISPLACEMENT"))
    contact = run.results.contact
    assert contact.count[-1] == 3
    v = run.results.field("displacement", run.results.n_points)[contact.candidates, 1]
    # the stiffness is that of a stop, whatever length of rod belongs to it
    dr.assert_close(run.results.field("reaction", run.results.n_points), -5.0 * v, relative=1e-9)


def test_stop_that_moves():
    """*OBSTACLE MOTION lifts the stop by 2e-4 under the tip: R = 3 (2e-4 - clearance), for an elastic one in series."""
    for stiffness, k in (("", 3.0), (", STIFFNESS=6", 2.0)):
        run = dr.run_deck(TIP.format(kind="GE4", stops=f"*GAP, NAME=JACK{stiffness}\n2, 1e-4\n*MONITOR, NAME=R, OBSTACLE=JACK\nRF2",
                                     steps="*STEP\n*STATIC, METHOD=LOAD\n0.1\n*OBSTACLE MOTION\nJACK, 0, 2e-4\n*END STEP\n"))
        dr.assert_close(run.column("R")[-1], k * 1e-4, relative=1e-6)
        jack = next(o for o in run.results.obstacles_at(run.results.n_points) if o.name == "JACK")
        dr.assert_close(jack.points, [[1.0, 1e-4]], absolute=1e-15)


JACK = """*HEADING
Beam on a floor, lifted by a stop from below, pressed by one from above
*NODE
1, 0., 0.
2, 1., 0.
3, 2., 0.
*LINE, ELSET=BEAM, NSET=BEAM, TYPE=GE4
1, 2, 10
2, 3, 10
*BEAM SECTION, ELSET=BEAM, SECTION=STIFFNESS
1., 1.
*BOUNDARY
1, ENCASTRE
3, ENCASTRE
*OBSTACLE, NAME=FLOOR, TYPE=LINE
0, 0, 2, 0
*CONTACT, OBSTACLE=FLOOR, NSET=BEAM, POINTS=NODES
*GAP, NAME=JACK
2, 0
*GAP, NAME=LID, DIRECTION=-90
2, 0
*MONITOR, NAME=v
2, U2
*MONITOR, NAME=jack, OBSTACLE=JACK
RN
*MONITOR, NAME=lid, OBSTACLE=LID
RN
*MONITOR, NAME=floor, OBSTACLE=FLOOR
RN
*STEP
*STATIC, METHOD=LOAD
0.5, , 0.5
*DLOAD
BEAM, PY, -0.01
*END STEP
*STEP
*STATIC, METHOD=LOAD
0.5, , 0.5
*OBSTACLE MOTION
JACK, 0, 1e-3
LID, 0, 2e-3
*END STEP
*STEP
*STATIC, METHOD=LOAD
0.25, , 0.25
*OBSTACLE MOTION
JACK, 0, -1e-3
LID, 0, -2e-3
*END STEP
*STEP
*STATIC, METHOD=LOAD
0.5, , 0.5
*CLOAD
2, 2, 0.1
*END STEP
*STEP
*STATIC, METHOD=LOAD
0.25, , 0.25
*CLOAD
2, 2, -0.2
*END STEP
"""


def test_obstacles_hand_a_node_over():
    """A node on a floor, with a stop below and one above that touch it, too: the stop below lifts it off the floor and sets
    it down, then a force presses it to the one above, and back. Clamped beam 2L = 2, weight q = 0.01, elements of 0.1:
    F = 192 EI/L^3 (v + q L^4/384 EI) with L = 2."""
    run = dr.run_deck(JACK)
    q, h = 0.01, 0.1

    def end(name):
        return np.array([run.column(name)[np.flatnonzero(run.column("step") == k)[-1]] for k in range(1, 6)])
    lift = 24 * (1e-3 + 16 * q / 384)
    dr.assert_close(end("v"), [0, 1e-3, 0, 0, 0], absolute=1e-12)
    # what axial force does: EA (v/L)^2 against 24 EI
    dr.assert_close(end("jack"), [0, lift, q * h, 0, 0.1 + q * h], relative=1e-5, absolute=1e-12)
    dr.assert_close(end("lid"), [0, 0, 0, 0.1 - q * h, 0], relative=1e-9)
    dr.assert_close(end("floor"), [19 * q * h, 0, 18 * q * h, 18 * q * h, 18 * q * h], relative=1e-9)
    # where the stops exchange the node
    lost = [c.load_factor for c in run.labelled("C-") if c.step > 3]
    dr.assert_close(lost, [0.01, 0.495], relative=1e-6)


def test_limit_point_over_the_stiffness_of_a_stop():
    """The stop's modulus as second parameter: the curve ends where a run with that stiffness has its limit point."""
    text = dr.changed(dr.on_given_mesh("arch-shallow-hinged"), ("*MONITOR, NAME=v\n", "*GAP, NAME=PROP, STIFFNESS={k}\n2, 0.02\n*MONITOR, NAME=v\n"))
    text = text[:text.index("*BRANCH")] + "*STOP\nv, ABOVE, 0.08\n"
    curve = dr.run_deck(text.format(k=10) + "*LIMIT CURVE, PARAMETER=MODULUS, OBSTACLE=PROP\n5, 40.\n*END STEP\n")
    load = curve.results.limit_curves["Curve-1"].column("load_factor").values
    for k, value in ((10, load[0]), (40, load[-1])):
        dr.assert_close(value, dr.run_deck(text.format(k=k) + "*END STEP\n").labelled("LP")[0].load_factor, relative=1e-6)


# Interference ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["GE4", "UL2"])
@pytest.mark.parametrize("stiffness, k", [("", 3.0), (", STIFFNESS=6", 2.0)])
def test_prescribed_interference(kind, stiffness, k):
    """A stop 1e-4 below the tip grows by 3e-4: it lifts the tip, as a spring 3 in series with its own. What the first step
    closed stays closed in the second, where a force pushes on."""
    run = dr.run_deck(TIP.format(kind=kind, stops=f"*GAP, NAME=S{stiffness}\n2, 1e-4\n*MONITOR, NAME=R, OBSTACLE=S\nRN",
                                 steps="*STEP\n*STATIC, METHOD=LOAD\n0.1\n*CONTACT INTERFERENCE\nS, 3e-4\n*END STEP\n" +
                                 tip_step(0.0, -3e-4)))
    one = run.column("step") == 1
    factor = run.column("load_factor")
    dr.assert_close(run.column("R")[one], k * np.maximum(3e-4 * factor[one] - 1e-4, 0.0), absolute=1e-10)
    share = 1.0 if k == 3.0 else 6.0 / 9.0
    dr.assert_close(run.column("R")[~one], k * 2e-4 + share * 3e-4 * factor[~one], absolute=2e-10)


def test_shrink_pushes_out_what_penetrates():
    """Three stops begin at different depths above a cantilever's axis, one below it: each is pushed out by its own amount."""
    stops = "*NSET, NSET=N\n6, 9\n*GAP, NAME=S\n2, -3e-5\n6, -1e-5\n9, 4e-5"
    run = dr.run_deck(TIP.format(kind="GE4", stops=stops, steps="*STEP\n*STATIC, METHOD=LOAD\n0.25, , 0.25\n"
                                 "*CONTACT INTERFERENCE, SHRINK\nS\n*FIELD OUTPUT\nGAP, REACTION, DISPLACEMENT\n*END STEP\n"))
    x = run.results.mesh.coordinates[:, 0]
    rows = run.results.contact.candidates
    depth = np.array([3e-5, 1e-5, -4e-5])
    # flexibility of the cantilever between the stops
    a = x[rows]
    f = np.array([[min(p, q)**2 * (3 * max(p, q) - min(p, q)) / 6 for q in a] for p in a])
    for point in range(2, run.results.n_points + 1):
        factor = run.column("load_factor")[point - 1]
        v = run.results.field("displacement", point)[rows, 1]
        gap, r = run.results.field("gap", point), run.results.field("reaction", point)
        dr.assert_close(gap, v - np.where(depth > 0, factor * depth, depth), absolute=1e-15)
        assert np.all(gap > -1e-14) and np.all(r > -1e-13) and np.all(np.minimum(gap, r) < 1e-13)
        dr.assert_close(f @ r, v, absolute=1e-10)
    assert np.count_nonzero(run.results.field("reaction", run.results.n_points) > 0) >= 1


def test_imperfection_behind_a_rigid_wall():
    """A column whose imperfection begins behind the wall: pushed out, the wall's line is what it cannot pass, and the
    answer is that of a wall which moved there from outside."""
    text = """*HEADING
Imperfect column pressed against a wall
*NODE
1, 0, 0
2, 1, 0
*LINE, ELSET=COLUMN, NSET=COLUMN
1, 2, 20
*IMPERFECTION, ELSET=COLUMN, SHAPE=SINE
0.001, 1
*BEAM SECTION, ELSET=COLUMN, SECTION=STIFFNESS
1e4, 1
*BOUNDARY
1, PINNED
2, 2
*OBSTACLE, NAME=WALL, TYPE=LINE
1, {at}, 0, {at}
*CONTACT, OBSTACLE=WALL, NSET=COLUMN, POINTS=NODES
*MONITOR, NAME=R, OBSTACLE=WALL
RN
*MONITOR, NAME=END
2, U1
*STEP
*STATIC, METHOD=LOAD
0.25
{load}
*FIELD OUTPUT
DISPLACEMENT, REACTION
*END STEP
"""
    pushed = dr.run_deck(text.format(at=4e-4, load="*CONTACT INTERFERENCE, SHRINK\nWALL"))
    moved = dr.run_deck(text.format(at=2e-3, load="*OBSTACLE MOTION\nWALL, 0, -1.6e-3"))
    assert pushed.column("R")[-1] > 1e-3
    for name in ("R", "END"):
        dr.assert_close(pushed.column(name)[-1], moved.column(name)[-1], relative=1e-8)
    for name in ("reaction", "displacement"):
        dr.assert_close(pushed.results.field(name, pushed.results.n_points), moved.results.field(name, moved.results.n_points),
                        absolute=1e-9)


RING = """*HEADING
Ring squeezed by a closing bed
*NODE
1, 0, -1
*RING, ELSET=RING, NSET=RING, TYPE=GE8
1, 0, 0, {elements}
*BEAM SECTION, ELSET=RING, SECTION=STIFFNESS
{ea}, 1
*OBSTACLE, NAME=BED, TYPE=CIRCLE, FOUNDATION=WINKLER, MODULUS={k}
0, 0, 1
*CONTACT, OBSTACLE=BED, NSET=RING
*BOUNDARY
1, 1
*MONITOR, NAME=P, OBSTACLE=BED
RN
*STEP, NAME=SQUEEZE
{how}
*CONTACT INTERFERENCE
BED, {s}
{output}*END STEP
"""

NODAL_RING = RING.replace("NSET=RING\n*", "NSET=RING, POINTS=NODES\n*")


def test_interference_squeezes_a_ring():
    """As a shrink fit by Lame: pressure p = k (s - w), hoop force -p R, shortening w = R p R/EA. Distributed, that is so to
    rounding. A bed that acts at the nodes bends the ring between them: by the fourth power of their distance."""
    k, ea, s = 50.0, 1e4, 0.001
    p = k * s / (1 + k / ea)
    error = []
    run = dr.run_deck(RING.format(elements=24, ea=ea, k=k, s=s, how="*STATIC, METHOD=LOAD\n0.5",
                                  output="*FIELD OUTPUT\nSECTION FORCES, REACTION\n"))
    dr.assert_close(run.results.field("reaction_density", run.results.n_points), np.full(24, p), relative=1e-9)
    dr.assert_close(run.results.field("section_forces", run.results.n_points)[..., 0], np.full((24, 2), -p), relative=1e-9)
    for n in (24, 48):
        run = dr.run_deck(NODAL_RING.format(elements=n, ea=ea, k=k, s=s, how="*STATIC, METHOD=LOAD\n0.5",
                                      output="*FIELD OUTPUT\nSECTION FORCES, REACTION\n"))
        reaction = run.results.field("reaction", run.results.n_points)
        dr.assert_close(reaction, np.full(n, np.mean(reaction)), relative=1e-9)
        error.append(np.sum(reaction) / (2 * math.pi * p) - 1)
        # n sides of a polygon under forces at its corners
        force = run.results.field("section_forces", run.results.n_points)
        along = np.hypot(force[..., 0], force[..., 1])
        dr.assert_close(along, np.full_like(along, np.mean(reaction) / (2 * math.sin(math.pi / n))), relative=1e-9)
    dr.assert_order(error, 4, below=0.1, above=0.1)
    assert abs(error[1]) < 3e-5


def test_interference_buckles_a_ring():
    """n waves of an inextensible ring under a pressure towards the centre, on a bed k: (n^2 - 2) p = (n^2 - 1)^2 EI/R^3 + k R
    (without a bed 4.5 EI/R^3). With k = 50: n = 3 first, then 4; s = (p/k)(1 + k/EA)."""
    run = dr.run_deck(RING.format(elements=96, ea=1e6, k=50, s=1, how="*BUCKLE\n4", output=""))
    exact = [((n * n - 1)**2 + 50) / (n * n - 2) / 50 * (1 + 50 / 1e6) for n in (3, 3, 4, 4)]
    # EA R^2/EI = 1e6 leaves the inextensible ring by 1e-5.
    dr.assert_close(run.results.buckling["SQUEEZE"].load_factor, exact, relative=2e-5)


@pytest.mark.parametrize("bilateral", ["", ", BILATERAL"])
def test_ground_that_moves_under_a_supported_node(bilateral):
    """Ground rises by 0.01 under a clamped cantilever: springs k h/2 at both end nodes, the clamped one's too, are pressed. With
    soft ground each gives k times its length times 0.01, less what the cantilever yields (1.276e-3 k L^4/EI/0.01 of it at its tip)."""
    run = dr.run_deck(f"""*HEADING
ground that moves
*NODE
1, 0, 0
2, 1, 0
*LINE, ELSET=E, NSET=N, TYPE=GE4
1, 2, 4
*BEAM SECTION, ELSET=E, SECTION=STIFFNESS
1000, 1
*BOUNDARY
1, ENCASTRE
*OBSTACLE, NAME=O, TYPE=LINE, FOUNDATION=WINKLER, MODULUS=0.01{bilateral}
0, 0, 1, 0
*CONTACT, OBSTACLE=O, NSET=N, POINTS=NODES
*MONITOR, NAME=SUPPORT
1, RF2
*MONITOR, NAME=GROUND, OBSTACLE=O
RF2
*STEP
*STATIC, METHOD=LOAD
0.5
*OBSTACLE MOTION
O, 0, 0.01
*FIELD OUTPUT
REACTION
*END STEP
""")
    dr.assert_close(run.column("GROUND")[-1], 1e-4, relative=1.28e-3)
    # nothing else loads the cantilever
    dr.assert_close(run.column("SUPPORT")[-1], -run.column("GROUND")[-1], relative=1e-7)
    reaction = run.results.field("reaction", run.results.field_points[-1])
    dr.assert_close(reaction / 1e-4, [0.125, 0.25, 0.25, 0.25, 0.125], relative=1.28e-3)


BENT_AWAY = """*HEADING
Beam under a wall: its axis without the imperfection lies 0.02 behind the wall, its middle begins 0.03 below that
*NODE
1, 0, 0
2, 1, 0
*LINE, ELSET=C, NSET=C
1, 2, 8
*NSET, NSET=MIDDLE
4, 5, 6, 7, 8
*IMPERFECTION, ELSET=C, SHAPE={shape}
*BEAM SECTION, ELSET=C, SECTION=STIFFNESS
1e6, 1
*BOUNDARY
1, PINNED
2, 2
*OBSTACLE, NAME=WALL, TYPE=LINE
1, -0.02, 0, -0.02
*CONTACT, OBSTACLE=WALL, NSET=MIDDLE{points}
*STEP
*STATIC, METHOD=LOAD
0.5
*CLOAD
6, 2, 1
*STOP
LOAD, ABOVE, 2
*END STEP
"""


@pytest.mark.parametrize("points", ["", ", POINTS=NODES"])
@pytest.mark.parametrize("shape, quarter", [
    ("SINE\n-0.05, 1", math.sqrt(0.5)), ("COSINE\n-0.05, 1, -90", math.sqrt(0.5)), ("CLAMPED\n-0.05", 0.5),
    ("NODAL\n" + "\n".join(f"{node}, {-0.05 * math.sin(math.pi * (node - 2) / 8)}" for node in range(3, 10)), math.sqrt(0.5))],
    ids=["sine", "cosine", "clamped", "nodal"])
def test_imperfection_away_from_a_wall(shape, quarter, points):
    """What begins stress-free is the imperfect axis. A quarter from either end, at 11/16 of the middle's P/48, the beam touches
    first; its slopes are 0.16 at most."""
    run = dr.run_deck(BENT_AWAY.format(shape=shape, points=points))
    dr.assert_close(run.load("C+"), 48 / (11 / 16) * (0.05 * quarter - 0.02), relative=0.16**2)


@pytest.mark.parametrize("dof", [1, 2])
def test_support_that_moves_a_rod_along_a_slope(dof):
    """A straight rod that lies on a rigid slope 4:3 slides along it without strain: (0.2, 0.15) at load factor 1."""
    run = dr.run_deck(f"""*HEADING
Rod on a slope
*NODE
1, 0, 0
2, 0.8, 0.6
*LINE, ELSET=ROD, NSET=ROD, TYPE=GE8
1, 2, 8
*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS
1e3, 1
*BOUNDARY
1, {dof}
*OBSTACLE, NAME=SLOPE, TYPE=LINE
-1.6, -1.2, 1.6, 1.2
*CONTACT, OBSTACLE=SLOPE, NSET=ROD, POINTS=ALONG
*MONITOR, NAME=X
2, U1
*MONITOR, NAME=Y
1, U2
*MONITOR, NAME=PUSH, OBSTACLE=SLOPE
RN
*STEP
*STATIC, METHOD=LOAD
0.5
*DLOAD
ROD, PN, -1
*STOP
LOAD, ABOVE, 1
*END STEP
*STEP
*STATIC, METHOD=LOAD
0.25
*BOUNDARY
1, {dof}, , {(0.2, 0.15)[dof - 1]}
*STOP
LOAD, ABOVE, 1
*END STEP
""")
    dr.assert_close([run.column(name)[-1] for name in ("X", "Y", "PUSH")], [0.2, 0.15, 1.0], relative=1e-9)


def test_support_that_moves_an_arc_along_a_bowl():
    """An arc in a bowl of its own radius, under uniform pressure, turns about the centre without strain: its first node goes from
    (-0.6, -0.8) to (-0.8, -0.6), its last one from (0.8, -0.6) to (0.6, -0.8)."""
    run = dr.run_deck("""*HEADING
Arc in a bowl
*NODE
1, -0.6, -0.8
2, 0.8, -0.6
*ARC, ELSET=ROD, NSET=ROD, TYPE=GE8
1, 2, 0, 0, 8
*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS
1e3, 1
*BOUNDARY
1, 1
*OBSTACLE, NAME=BOWL, TYPE=CIRCLE, SIDE=INSIDE
0, 0, 1
*CONTACT, OBSTACLE=BOWL, NSET=ROD, POINTS=ALONG
*MONITOR, NAME=FIRST_Y
1, U2
*MONITOR, NAME=LAST_X
2, U1
*MONITOR, NAME=LAST_Y
2, U2
*STEP
*STATIC, METHOD=LOAD
0.5
*DLOAD
ROD, P, -1
*STOP
LOAD, ABOVE, 1
*END STEP
*STEP
*STATIC, METHOD=LOAD
0.25
*BOUNDARY
1, 1, , -0.2
*STOP
LOAD, ABOVE, 1
*END STEP
""")
    dr.assert_close([run.column(name)[-1] for name in ("FIRST_Y", "LAST_X", "LAST_Y")], [0.2, -0.2, -0.2], relative=1e-8)

"""Rings in a cavity (Silveira & Goncalves 2001, section 4) against exact solutions of the rod equations.

Exact values: reference/ring_*.csv, from a separate boundary-value solver with about 1e-9 or better. The load factor
is p R^3/EI, v the inward displacement of the apex over R, angles are those of the lift-off point from the apex.
"""
import functools

import numpy as np
import pytest

import deck_runner as dr

CRITICAL_LOAD = 81.557427564661
CRITICAL_V = 0.0358697377
WINKLER_LOAD = 80.35789295248      # k R^4/EI = 3.6E6
GRADED = "0., 0., 160, 6."         # elements of ring.inp: 0.45 degrees at the apex, 2.7 at the bottom
TOLERANCE = 1e-9                   # default of *CONTROLS, relative residual
LOCATE = 1e-8                      # default of *CONTROLS, relative
# Elements of order 4 and 0.7 degrees where the lift-off point travels: (h/R)^4 = 2e-8 times 30 from the loads of pR^3/EI = 80,
# in radians; the place of the node that slides goes in with (p R^3/EI) (h/R)^4/12. One element is 5000 times as much.
ANGLE_LIMIT = 1e-4
LONGEST = np.radians(2.7)          # element of ring.inp
ANGLES = dr.reference("ring_angles")


@functools.cache
def ring():
    return dr.run_deck(dr.on_given_mesh("ring"))


@functools.cache
def full():
    return dr.run_deck(dr.on_given_mesh("ring-full"))


@functools.cache
def winkler():
    return dr.run_deck(dr.on_given_mesh("ring-winkler"))


@functools.cache
def ul2():
    return dr.run_deck(dr.on_given_mesh("ring-ul2"))


@functools.cache
def critical(elements, element="GE4", points="ALONG", code=0):
    """Limit point on a uniform mesh; the path ends soon after it."""
    run = dr.run_deck(dr.changed(dr.on_given_mesh("ring"), (GRADED, f"0., 0., {elements}"), ("TYPE=GE4", f"TYPE={element}"),
                                 ("POINTS=ALONG", f"POINTS={points}"), ("ABOVE, 0.6", "ABOVE, 0.045")), code=code)
    return run.only("LP")


def load_of(table, v):
    return np.exp(dr.interpolate(np.log(table["v"]), np.log(table["p"]), np.log(v)))


def angle_of(table, v):
    return dr.interpolate(np.log(table["v"]), table["phi_deg"], np.log(v))


def on_table(run, table):
    """Points that the table covers, and how many."""
    v = run.column("v")
    # A stop value is met to LOCATE.
    inside = (v >= table["v"][0]) & (v <= table["v"][-1])
    assert np.count_nonzero(inside) >= len(v) - 5
    return inside


def the_angle(run, load, rising):
    """Angle at the located point of this load, before or after the limit point."""
    limit = run.only("LP").point
    found = [c for c in run.labelled("UZ") if abs(c.load_factor - load) < 1e-6 * load and (c.point < limit) == rising]
    assert len(found) == 1
    return dr.regions(run, "angle_start")[found[0].point - 1], found[0].monitors["v"]


# ---- the half ring in a rigid cavity ----


def test_reference_interpolation_is_good_enough():
    """Halving the table costs this much, so the table itself is better by about 2^6."""
    for name in ("ring_rigid_Rh100", "ring_winkler_k3.6e06"):
        table = dr.reference(name)
        assert dr.interpolation_error(np.log(table["v"]), np.log(table["p"])) / 2**6 < 1e-6
        assert dr.interpolation_error(np.log(table["v"]), table["phi_deg"]) / 2**6 < 0.2 * ANGLE_LIMIT


def test_critical_load():
    dr.assert_close(ring().load("LP"), CRITICAL_LOAD, relative=1e-6)


def test_displacement_at_the_critical_load():
    dr.assert_close(ring().only("LP").monitors["v"], CRITICAL_V, relative=1e-5)


def test_limit_point_is_the_highest_of_the_path():
    """A limit point located to LOCATE lies above all others; the load is stationary there."""
    run = ring()
    assert np.max(run.column("load_factor")) <= run.load("LP") * (1.0 + LOCATE)


@dr.release_only
@pytest.mark.parametrize("load", [81.5, 81.55])
def test_a_load_just_below_the_limit_is_met_on_both_sides(load):
    """However long the increments: that one passes it on the way up and on the way back."""
    run = dr.run_deck(dr.changed(dr.on_given_mesh("ring"), ("LOAD, 34., 57., 62., 28.", f"LOAD, {load}"), ("ABOVE, 0.6", "ABOVE, 0.045")))
    limit = run.only("LP").point
    assert [c.point < limit for c in run.labelled("UZ")] == [True, False]
    stopped = dr.run_deck(dr.changed(dr.on_given_mesh("ring"), ("v, ABOVE, 0.6", f"LOAD, ABOVE, {load}")))
    dr.assert_close(stopped.load("EP"), load, relative=LOCATE)
    assert not stopped.labelled("LP")


def test_limit_point_is_the_vertex_of_its_neighbourhood():
    """The path around the limit point, walked with small increments, has its top where the LP says.

    Points on both sides within 1e-3 R, a parabola through them (the next term of the path changes the vertex by less
    than (1e-3/0.0359)^2 of v).
    """
    v = CRITICAL_V
    locate = ", ".join(f"{v + dv:.10f}" for dv in (-1e-3, -5e-4, 5e-4, 1e-3))
    run = dr.run_deck(dr.changed(dr.on_given_mesh("ring"), ("LOAD, 34., 57., 62., 28.", f"v, {locate}"),
                                 ("ABOVE, 0.6", "ABOVE, 0.045")))
    near = run.labelled("UZ")
    assert len(near) == 4
    x = np.array([c.monitors["v"] for c in near]) - v
    a, b, c = np.polyfit(x, [c.load_factor for c in near], 2)
    dr.assert_close(run.only("LP").monitors["v"], v - b / (2.0 * a), relative=1e-3)
    dr.assert_close(run.load("LP"), c - b**2 / (4.0 * a), relative=1e-6)


@pytest.mark.parametrize("load, rising, column", [(34, True, "phi_34"), (57, True, "phi_57"),
                                                  (62, False, "phi_62"), (28, False, "phi_28")])
def test_angles_of_the_table(load, rising, column):
    angle, v = the_angle(ring(), load, rising)
    dr.assert_close(angle, ANGLES[column][4], absolute=ANGLE_LIMIT)
    dr.assert_close(v, ANGLES[column.replace("phi", "v")][4], relative=1e-5)


def test_angle_at_the_critical_load():
    """Where the load is stationary v, and with it the angle, is known to the root of what the load is."""
    run = ring()
    dr.assert_close(dr.regions(run, "angle_start")[run.only("LP").point - 1], ANGLES["phi_cr"][4], absolute=10.0 * ANGLE_LIMIT)


def test_path_is_exact_to_the_end():
    run, table = ring(), dr.reference("ring_rigid_Rh100")
    inside = on_table(run, table)
    v = run.column("v")[inside]
    dr.assert_close(run.column("load_factor")[inside], load_of(table, v), relative=5e-6)


def test_path_ends_at_the_asked_displacement():
    run = ring()
    dr.assert_close(run.column("v")[-1], 0.6, relative=LOCATE)
    assert run.results.path["label"].values[-1] == "EP"
    assert run.results.complete


def test_load_rises_to_the_limit_and_falls_after_it():
    run = ring()
    p, limit = run.column("load_factor"), run.only("LP").point
    dr.assert_monotone(p[:limit], rising=True)
    dr.assert_monotone(p[limit - 1:], rising=False)
    dr.assert_monotone(run.column("v"), rising=True)
    dr.assert_monotone(run.column("arc_length"), rising=True)


def test_angle_history_is_smooth():
    """Against the exact one: the same angle at every point, the same difference from point to point, the same bends."""
    run, table = ring(), dr.reference("ring_rigid_Rh100")
    inside = on_table(run, table)
    v, angle = run.column("v")[inside], dr.regions(run, "angle_start")[inside]
    exact = angle_of(table, v)
    dr.assert_close(angle, exact, absolute=ANGLE_LIMIT)
    dr.assert_close(dr.bends(v, angle), dr.bends(v, exact), absolute=ANGLE_LIMIT)
    moving = np.abs(np.diff(exact)) > 100.0 * ANGLE_LIMIT
    assert np.count_nonzero(moving) > len(v) - 8         # those at the least angle
    dr.assert_close((np.diff(angle) / np.diff(exact))[moving], np.ones(np.count_nonzero(moving)), absolute=1e-2)
    least = int(np.argmin(angle))
    dr.assert_monotone(angle[:least + 1], rising=False)
    dr.assert_monotone(angle[least:], rising=True)


def test_load_history_is_smooth():
    run, table = ring(), dr.reference("ring_rigid_Rh100")
    inside = on_table(run, table)
    v, p = run.column("v")[inside], run.column("load_factor")[inside]
    dr.assert_close(dr.bends(v, p), dr.bends(v, load_of(table, v)), absolute=5e-6 * CRITICAL_LOAD)


def test_contact_reaches_the_bottom_at_every_point():
    run = ring()
    assert np.all(run.results.contact.count == 1)
    dr.assert_close(np.abs(dr.regions(run, "angle_end")), np.full(run.results.n_points, 180.0), absolute=1e-9)


def places(run, point):
    """Where the candidates press at a point of the path: the node at the lift-off point moves along the rod."""
    return run.results.field("contact_point", point)


@dr.release_only
@pytest.mark.parametrize("run", [ring, full], ids=lambda run: run.__name__)
def test_reactions_act_on_the_cavity(run):
    """What the nodes of the deck show of it: the force at the lift-off point, between two of them, goes to both by the lever rule,
    so that the last node with a force is a free one."""
    for point in run().results.field_points:
        share = run().results.field("reaction", point) > 0.0
        touching = share & np.roll(share, 1) & np.roll(share, -1)
        assert np.any(touching) or point == 1
        # The free neighbours, and the half ring's last node, whose neighbour on the list is the apex.
        assert np.count_nonzero(share & ~touching) <= 2
        radius = np.hypot(*places(run(), point).T)
        dr.assert_close(np.max(np.abs(radius - 1.0), where=touching, initial=0.0), 0.0, absolute=TOLERANCE)


def test_reactions_carry_the_load():
    """The rollers on the axis of symmetry hold nothing vertically: all of p pi R goes into the cavity.

    The shares of the deck's nodes add up to the size of the reaction along the axis. Their directions are those at the nodes: the
    lever rule, linear between them, is off by h^2/8 at most. The sum along the axis differs by the rule of two points between the
    deck's nodes, h^4/4320 times the density's fourth derivative, some units of it.
    """
    run = ring()
    for point in run.results.field_points[1:]:
        carried = np.pi * run.column("load_factor")[point - 1]
        dr.assert_close(run.results.contact.obstacle_force[point - 1, 0, 1], carried, relative=10 * TOLERANCE)
        place, reaction = places(run, point), run.results.field("reaction", point)
        dr.assert_close(np.sum(reaction), run.results.contact.reaction_total[point - 1, 0], relative=LONGEST**4 / 1000.0)
        vertical = np.sum(-reaction * place[:, 1] / np.hypot(place[:, 0], place[:, 1]))
        dr.assert_close(vertical, carried, relative=LONGEST**2 / 8.0)


@pytest.mark.parametrize("run", [ring, full, winkler, ul2], ids=lambda run: run.__name__)
def test_accuracy_block(run):
    accuracy = run().results.accuracy
    assert accuracy["residual"] <= TOLERANCE
    assert accuracy["penetration"] <= TOLERANCE
    assert accuracy["tension"] <= TOLERANCE
    assert accuracy["complementarity"] <= TOLERANCE
    # Sums over the nodes of what the residual allows at each.
    assert accuracy["force_balance"] <= 10 * TOLERANCE
    assert accuracy["moment_balance"] <= 10 * TOLERANCE


# ---- meshes in pieces ----

POINT = "3, -0.5, 0.86602540378443864676\n4, -0.90630778703664996324, 0.42261826174069943619\n"


@functools.cache
def pieces(loaded=False):
    """Three arcs with elements of their own; the lift-off point, from 58 to 24 degrees and back, passes 30. With a load, as good
    as none, the node there keeps its place."""
    text = dr.changed(dr.on_given_mesh("ring"), ("2, 0., -1.\n", "2, 0., -1.\n" + POINT),
                      ("1, 2, " + GRADED, "1, 3, 0., 0., 45\n3, 4, 0., 0., 60\n4, 2, 0., 0., 55"))
    if loaded:
        text = dr.changed(text, ("*LOCATE", "*CLOAD\n3, 2, 1E-15\n*LOCATE"))
    return dr.run_deck(text)


def test_contact_slides_on_from_arc_to_arc():
    run, table = pieces(), dr.reference("ring_rigid_Rh100")
    dr.assert_close(run.load("LP"), CRITICAL_LOAD, relative=1e-6)
    inside = on_table(run, table)
    v, angle = run.column("v")[inside], dr.regions(run, "angle_start")[inside]
    assert np.min(angle) < 30.0 < np.max(angle)
    dr.assert_close(angle, angle_of(table, v), absolute=ANGLE_LIMIT)
    dr.assert_close(dr.bends(v, angle), dr.bends(v, angle_of(table, v)), absolute=ANGLE_LIMIT)


def test_arcs_of_one_mesh_are_one_arc():
    """Cut in two or not, the same nodes."""
    whole = critical(80)
    text = dr.changed(dr.on_given_mesh("ring"), ("2, 0., -1.\n", "2, 0., -1.\n3, -0.70710678118654752440, 0.70710678118654752440\n"),
                      ("1, 2, " + GRADED, "1, 3, 0., 0., 20\n3, 2, 0., 0., 60"), ("ABOVE, 0.6", "ABOVE, 0.045"))
    cut = dr.run_deck(text).only("LP")
    dr.assert_close([cut.load_factor, cut.monitors["v"]], [whole.load_factor, whole.monitors["v"]], relative=1e-9)


def test_contact_passes_a_node_that_stays():
    """The end of contact is no more than a fifth of an element from where it should be: (p R^3/EI) (h/R)^3 of an angle."""
    run, table = pieces(loaded=True), dr.reference("ring_rigid_Rh100")
    dr.assert_close(run.load("LP"), CRITICAL_LOAD, relative=1e-6)
    assert [c.label for c in run.results.critical].count("LP") == 1
    inside = on_table(run, table)
    v, angle = run.column("v")[inside], dr.regions(run, "angle_start")[inside]
    dr.assert_close(angle, angle_of(table, v), absolute=0.01)
    far = np.abs(angle - 30.0) > 0.5
    dr.assert_close(angle[far], angle_of(table, v)[far], absolute=ANGLE_LIMIT)


def test_contact_slides_past_the_seam_of_a_ring():
    """A whole ring whose first and last node is the one at 30 degrees: the same to the left and to the right."""
    text = dr.on_given_mesh("ring-full")
    start, end = text.index("*NODE"), text.index("*BEAM SECTION")
    apex, bottom = 1 + 220, 1 + 100        # 1.5 degrees a label, anticlockwise from 30 degrees
    text = text[:start] + "*NODE\n1, -0.5, 0.86602540378443864676\n*RING, ELSET=RING, NSET=RING\n1, 0., 0., 240\n" + text[end:]
    run = dr.run_deck(dr.changed(text, ("*BOUNDARY\n2, 1", f"*BOUNDARY\n{bottom}, 1"), ("1, U2, -1.", f"{apex}, U2, -1."),
                                 ("1, U1\n", f"{apex}, U1\n")))
    dr.assert_close(run.load("LP"), CRITICAL_LOAD, relative=3e-5)
    table = dr.reference("ring_rigid_Rh100")
    inside = on_table(run, table)
    exact = angle_of(table, run.column("v")[inside])
    left, right = (dr.regions(run, name)[inside] % 360.0 for name in ("angle_start", "angle_end"))
    dr.assert_close(left, exact, absolute=2e-3)
    dr.assert_close((left + right + 180.0) % 360.0, np.full(len(left), 180.0), absolute=1e-5)
    assert np.min(left) < 30.0 < np.max(left)


def from_bottom():
    """ring-full with its first node at the bottom: the chain of the contact closes inside the contact, not opposite to it."""
    return dr.run_deck(dr.changed(dr.on_given_mesh("ring-full"), ("1, 0., 1.\n2, 0., -1.", "1, 0., -1.\n2, 0., 1."),
                                  ("*BOUNDARY\n2, 1", "*BOUNDARY\n1, 1"), ("1, U2, -1.", "2, U2, -1."), ("1, U1\n", "2, U1\n")))


@pytest.mark.parametrize("ring_deck, middle", ((full, np.pi), (from_bottom, 2.0 * np.pi)))
def test_contact_of_a_closed_chain_begins_within_one_round(ring_deck, middle):
    """Places along a whole ring, wherever its chain closes: the contact lies on both sides of the bottom."""
    run = ring_deck()
    results = run.results           # read as long as the run's folder is there
    around = float(results.contact.chain_length[0])
    dr.assert_close(around, 2.0 * np.pi, relative=1e-12)
    bars = 0
    for point in range(1, len(results.contact.count) + 1):
        region = results.contact.regions(point)[0]
        assert 0.0 <= region.start < around and region.start < region.end
        if region.end - region.start >= around * (1.0 - 1e-12):     # all round, at the start
            continue
        for force in results.force_list("contact_force", point):
            assert 0.0 <= force[1] <= around * (1.0 + 1e-12)
        if not np.isfinite(region.start_error):
            continue
        bars += 1
        dr.assert_close(region.start + region.end, 2.0 * middle, absolute=region.start_error + region.end_error)
        for place, corrected, bar in ((region.start, region.start_corrected, region.start_error),
                                      (region.end, region.end_corrected, region.end_error)):
            assert abs(corrected - place) <= bar < ANGLE_LIMIT
    assert bars > 0


# ---- convergence ----


@dr.release_only
def test_ul2_converges_at_second_order():
    # 80 elements are 1 % off, and it says so
    errors = [critical(n, "UL2", "NODES", 2 if n == 80 else 0).load_factor - CRITICAL_LOAD for n in (80, 160, 320, 640)]
    dr.assert_mean_order(errors, 2)
    assert abs(errors[-1]) < 2.5e-4 * CRITICAL_LOAD


@dr.release_only
def test_nodal_reactions_keep_ge4_at_second_order():
    """Reactions at nodes make the moment at the lift-off point wrong by r h^2/12, whatever the element."""
    errors = [critical(n, points="NODES").load_factor - CRITICAL_LOAD for n in (80, 160, 320, 640)]
    dr.assert_mean_order(errors, 2, below=0.5)
    assert abs(errors[-1]) < 2.5e-5 * CRITICAL_LOAD


@dr.release_only
def test_a_sliding_lift_off_point_restores_order_4():
    limits = [critical(n) for n in (40, 80, 160, 320)]
    dr.assert_mean_order([c.load_factor - CRITICAL_LOAD for c in limits], 4, below=0.5)
    dr.assert_close(limits[-1].load_factor, CRITICAL_LOAD, relative=1e-6)
    dr.assert_close(limits[-1].monitors["v"], CRITICAL_V, relative=1e-5)


@pytest.mark.parametrize("element", ["GE6", "GE8"])
def test_higher_elements_have_their_own_order(element):
    """The rod in the cavity follows it all along, so nothing of fourth order is left (reactions at nodes had r h^4/384 EI): order 6
    is as exact as the free part's elements, order 8 down to what is located, LOCATE."""
    errors = np.array([critical(n, element).load_factor / CRITICAL_LOAD - 1.0 for n in (5, 10, 20, 40)])
    if element == "GE6":
        dr.assert_mean_order(errors, 6)
    else:
        dr.assert_close(errors[1:], np.zeros(3), absolute=LOCATE)
    dr.assert_close(errors[2:], np.zeros(2), absolute=2e-8 if element == "GE6" else 1e-10)


@dr.release_only
@pytest.mark.parametrize("element, elements", [("GE2", 640), ("GE6", 160), ("GE8", 160)])
def test_other_orders_find_the_same_limit_point(element, elements):
    """Order 2: (pi/640)^2 h^2 in the buckled arc, about 2e-4; higher ones as the contact lets them."""
    points = "NODES" if element == "GE2" else "ALONG"
    dr.assert_close(critical(elements, element, points=points).load_factor, CRITICAL_LOAD,
                    relative=2e-4 if element == "GE2" else 1e-5)


# 320 elements of second order; the coarser meshes say at most 16 (h/R)^2 = 1.5e-3 for the limit load. Three times as
# much along the path, where the curvature at the ends of the contact is larger.
def test_paper_deck():
    dr.assert_close(ul2().load("LP"), CRITICAL_LOAD, relative=16 * (np.pi / 320) ** 2)


def test_paper_deck_path():
    table, run = dr.reference("ring_rigid_Rh100"), ul2()
    inside = run.column("v") >= table["v"][0]
    v = run.column("v")[inside]
    dr.assert_close(run.column("load_factor")[inside], load_of(table, v), relative=5e-3)


def test_paper_deck_has_one_contact_region():
    """The exact ring neither splits nor merges its contact."""
    assert [c.label for c in ul2().results.critical] == ["LP", "EP"]
    assert np.all(ul2().results.contact.count == 1)


# ---- the Winkler medium ----


@dr.release_only
def test_winkler_critical_load():
    dr.assert_close(winkler().load("LP"), WINKLER_LOAD, relative=1e-4)


@pytest.mark.parametrize("load, rising, column", [(34, True, "phi_34"), (57, True, "phi_57"),
                                                  (62, False, "phi_62"), (28, False, "phi_28")])
def test_winkler_angles(load, rising, column):
    angle, v = the_angle(winkler(), load, rising)
    dr.assert_close(angle, ANGLES[column][1], absolute=0.1)
    dr.assert_close(v, ANGLES[column.replace("phi", "v")][1], relative=5e-4)


def test_winkler_angle_at_the_critical_load():
    run = winkler()
    dr.assert_close(dr.regions(run, "angle_start")[run.only("LP").point - 1], ANGLES["phi_cr"][1], absolute=0.1)


def test_winkler_path():
    run, table = winkler(), dr.reference("ring_winkler_k3.6e06")
    inside = on_table(run, table)
    v, p, limit = run.column("v"), run.column("load_factor"), run.only("LP").point
    dr.assert_close(p[inside], load_of(table, v[inside]), relative=5e-4)
    dr.assert_monotone(p[:limit], rising=True)
    dr.assert_monotone(p[limit - 1:], rising=False)


def test_winkler_angle_history():
    """The exact one has gaps next to the contact end late on the path; the end nearest the apex is compared."""
    run, table = winkler(), dr.reference("ring_winkler_k3.6e06")
    inside = on_table(run, table)
    v = run.column("v")[inside]
    angle = np.nanmin(np.abs(run.results.contact.angle_start), axis=1)[inside]
    dr.assert_close(angle, angle_of(table, v), absolute=0.1)


# ---- the whole ring ----


def test_full_ring_follows_the_path_of_the_half_ring():
    """Same mesh, same equations: all located points agree to what *CONTROLS asks for (v by the slope of the path)."""
    half, whole = ring(), full()
    assert [c.label for c in whole.results.critical] == [c.label for c in half.results.critical]
    dr.assert_close([c.load_factor for c in whole.results.critical], [c.load_factor for c in half.results.critical],
                    relative=10 * LOCATE)
    dr.assert_close([c.monitors["v"] for c in whole.results.critical], [c.monitors["v"] for c in half.results.critical],
                    relative=1e-6)


def test_full_ring_stays_symmetric():
    """Newton leaves residuals of 1e-9 p, the whole ring gives way sideways by about R^3/(10 EI): 1e-9 * 81.6 / 10."""
    run = full()
    assert np.max(np.abs(run.column("sway"))) < 1e-8
    first, second = dr.regions(run, "angle_start")[1:], dr.regions(run, "angle_end")[1:]
    dr.assert_close((first + second + 180.0) % 360.0, np.full_like(first, 180.0), absolute=1e-5)


def test_full_ring_has_the_angles_of_the_half_ring():
    half, whole = ring(), full()
    of_half, of_whole = (np.abs(dr.regions(run, "angle_start")[[c.point - 1 for c in run.results.critical]])
                         for run in (half, whole))
    dr.assert_close(of_whole, of_half, absolute=1e-4)


def test_full_ring_needs_nothing_at_its_tangential_support():
    run = dr.run_deck(dr.changed(dr.on_given_mesh("ring-full"), ("*STEP", "*MONITOR, NAME=held\n2, RF1\n*STEP"),
                                 ("ABOVE, 0.6", "ABOVE, 0.045")))
    assert np.max(np.abs(run.column("held"))) < 1e-6 * CRITICAL_LOAD

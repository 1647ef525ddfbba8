"""The column beside a wall (Silveira & Goncalves 2001, Figs. 7 to 11) against the exact solution.

Exact values: reference/column_clamped.csv, from a separate boundary-value solver with about 1e-10. The load factor is
P/Pcr; the contact is one point of the rod, which wanders along it.
"""
import functools
import math

import numpy as np
import pytest

import deck_runner as dr

ELEMENT = 1.0 / 80                 # of column.inp
LOCATE = 1e-8                      # default of *CONTROLS
EVENTS = [("C+", 0.9294732313, 0.46149664), ("LP", 2.484036097, 0.41847844), ("C-", 1.946790072, 0.29730428),
          ("LP", 1.025646944, np.nan)]
# The loaded column bends with wave numbers k = sqrt(P/EI) up to 3 pi/L or so, h/L = 1/80: elements of order 6 err by less than
# (k h)^6/100 = 3e-8, those of order 4 by (k h)^4/100 = 2e-6. The table has loads of ten digits.
ORDER_LIMIT = 1e-7
FOURTH_ORDER = 2e-6


@functools.cache
def column(elements=40, kind="GE6"):
    return dr.run_deck(dr.changed(dr.on_given_mesh("column"), ("1, 2, 40", f"1, 2, {elements}"),
                                  ("2, 3, 40", f"2, 3, {elements}"), ("TYPE=GE6", f"TYPE={kind}")))


@functools.cache
def table():
    return dr.reference("column_clamped")


def phases(run):
    """Rows of the path before contact, in contact and after it, the events on both sides."""
    gained, lost = run.only("C+").point, run.only("C-").point
    return {"before": slice(0, gained), "contact": slice(gained - 1, lost), "after": slice(lost - 1, None)}


def branch(phase):
    """Rows of the table; the points of first and last contact belong to the phases on both sides."""
    first, last = np.flatnonzero(np.isfinite(table()["contact_from_over_L"]))[[0, -1]]
    return {"before": slice(0, first + 1), "contact": slice(first, last + 1), "after": slice(last + 1, None)}[phase]


# What fixes the place on the path well: off the wall midspan, which follows 1/(1 - P/Pcr); in contact the load, except
# near its largest value.
PLACED_BY = {"before": ("midspan", "mid_over_h"), "contact": ("LOAD", "P_over_Pcr"),
             "after": ("midspan", "mid_over_h")}


@functools.cache
def at_table_rows(phase):
    """Points of the path at a dozen places of the table, by *LOCATE: nothing is interpolated.

    Returns the run, the rows of its points and those of the table.
    """
    monitor, header = PLACED_BY[phase]
    rows = np.arange(len(table()[header]))[branch(phase)]
    rows = rows[np.linspace(2 if phase != "contact" else 30, len(rows) - 3, 12).astype(int)]
    # The deck ends at 0.05 L of shortening, where the table does.
    rows = rows[(table()["shortening_over_L"][rows] < 0.049) & (table()["P_over_Pcr"][rows] < 0.98 * EVENTS[1][1])]
    values, shortening = table()[header][rows], table()["shortening_over_L"][rows]
    cards = "".join(f"{monitor}, {value:.12g}\n" for value in values)
    run = dr.run_deck(dr.changed(dr.on_given_mesh("column"), ("*STOP", f"*LOCATE\n{cards}*STOP")))
    inside = np.arange(run.results.n_points)[phases(run)[phase]]
    found = [c for c in run.labelled("UZ") if c.point - 1 in inside]
    points = []
    for value, place in zip(values, shortening):
        same = [c for c in found
                if abs((c.load_factor if monitor == "LOAD" else c.monitors[monitor]) / value - 1.0) < 1e-6]
        assert same, f"{monitor} = {value} was not met {phase}"
        points.append(min(same, key=lambda c: abs(c.monitors["shortening"] - place)).point - 1)
    return run, np.array(points), rows


def test_a_value_just_behind_first_contact_is_located():
    run = dr.run_deck(dr.changed(dr.on_given_mesh("column"), ("*STOP", "*LOCATE\nLOAD, 0.9306\n*STOP"),
                                 ("ABOVE, 0.05", "ABOVE, 0.0012")))
    dr.assert_close(run.load("UZ"), 0.9306, relative=LOCATE)


def contact_history(run):
    """Shortening and contact point between C+ and C-, and the exact place at that shortening."""
    rows = np.arange(run.results.n_points)[phases(run)["contact"]][1:-1]     # at C+ and C- themselves there is none
    x, y = table()["shortening_over_L"][branch("contact")], table()["contact_from_over_L"][branch("contact")]
    assert dr.interpolation_error(x, y) / 2**6 < 2e-9
    at = run.column("shortening")[rows]
    rows, at = rows[at >= x[0]], at[at >= x[0]]
    return rows, at, along_the_rod(dr.interpolate(x, y, at))


def along_the_rod(x):
    """Arc length of the imperfect axis, which results count, where the table has its projection x."""
    at = np.linspace(0.0, 1.0, 4001)
    s, c = np.sin(np.pi * at), np.cos(np.pi * at)
    a1, a2 = 0.0014, 0.00105 * 1.5 * math.sqrt(3.0)
    slope = np.pi * s * (2.0 * c * (a1 + a2 * c) - a2 * s * s)
    speed = np.sqrt(1.0 + slope**2)
    return np.interp(x, at, np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(at))]))


def test_events_come_in_the_order_of_the_exact_path():
    found = [c.label for c in column().results.critical]
    assert found == ["C+", "LP", "C-", "LP", "EP"]


@pytest.mark.parametrize("number", range(4))
def test_loads_of_the_events(number):
    label, load, _ = EVENTS[number]
    event = column().results.critical[number]
    assert event.label == label and event.located
    dr.assert_close(event.load_factor, load, relative=ORDER_LIMIT)


def test_place_of_contact_at_the_limit_load():
    """Where the load is stationary, the place is known to the root of what the load is."""
    run = column()
    spot = dr.regions(run, "start")[run.labelled("LP")[0].point - 1]
    dr.assert_close(spot, along_the_rod(EVENTS[1][2]), absolute=1e-5)


@pytest.mark.parametrize("number", range(4))
def test_fourth_order_elements(number):
    dr.assert_close(column(40, "GE4").results.critical[number].load_factor, EVENTS[number][1], relative=1e-6)


@dr.release_only
@pytest.mark.parametrize("kind, order, number, meshes", [
    ("GE4", 4, 0, (10, 20, 40)), ("GE4", 4, 1, (10, 20, 40)), ("GE4", 4, 2, (10, 20, 40)), ("GE4", 4, 3, (10, 20, 40)),
    ("GE6", 6, 1, (7, 14, 28)), ("GE6", 6, 2, (7, 14, 28)), ("GE6", 6, 3, (5, 10))])
def test_events_converge_with_the_order_of_the_elements(kind, order, number, meshes):
    """A contact point takes nothing from it, wherever it lies between the nodes."""
    label, load, _ = EVENTS[number]
    events = [column(half, kind).results.critical[number] for half in meshes]
    assert all(event.label == label for event in events)
    dr.assert_mean_order([event.load_factor / load - 1.0 for event in events], order, below=1.0, above=1.5)


@pytest.mark.parametrize("half", [4, 8, 16])
@pytest.mark.parametrize("number", range(4))
def test_coarse_meshes_of_order_8(number, half):
    """Free spans share all elements. n of them in a length l err by (k l/n)^8/(8! sqrt(8!)), before contact with k l = 1.93 pi, at the
    limit point with 3.15 pi in each of two halves, where a load moves by that of the softer one twice. *CONTROLS locates 1e-8."""
    event = column(half, "GE8").results.critical[number]
    assert event.label == EVENTS[number][0] and event.located
    phase = {0: 1.93, 3: 1.93}.get(number, 3.15) * math.pi
    mesh = (phase / (2 * half if number in (0, 3) else half)) ** 8 / (math.factorial(8) * math.sqrt(math.factorial(8)))
    dr.assert_close(event.load_factor, EVENTS[number][1], relative=3.0 * (LOCATE + mesh))


@pytest.mark.parametrize("half, close", [(6, 1e-6), (12, 1e-7), (24, 2e-8)])
def test_first_contact_of_order_6(half, close):
    """One free span of 2*half elements. The gap touches zero between their nodes, where the error of the polynomial, one order more
    than that of the nodes with a sign that hangs on the place in the element, is added: bounds instead of an order."""
    dr.assert_close(column(half, "GE6").results.critical[0].load_factor, EVENTS[0][1], relative=close)


@pytest.mark.parametrize("kind", ["GE4", "GE6"])
@pytest.mark.parametrize("half", [7, 8, 10, 12, 16, 21, 24, 33])
def test_any_mesh_goes_all_the_way(half, kind):
    """No step of the path hangs on where the contact point lies between the nodes; errors fall at least as h^4."""
    run = column(half, kind)
    assert [c.label for c in run.results.critical] == ["C+", "LP", "C-", "LP", "EP"]
    assert all(c.located for c in run.results.critical)
    dr.assert_close(run.only("C-").load_factor, EVENTS[2][1], relative=FOURTH_ORDER * (40 / half) ** 4)


@pytest.mark.parametrize("phase, name, header", [
    ("before", "load_factor", "P_over_Pcr"), ("before", "shortening", "shortening_over_L"),
    ("contact", "load_factor", "P_over_Pcr"), ("contact", "midspan", "mid_over_h"),
    ("after", "load_factor", "P_over_Pcr"), ("after", "shortening", "shortening_over_L")])
def test_path(phase, name, header):
    run, points, rows = at_table_rows(phase)
    exact = table()[header][rows]
    dr.assert_close(run.column(name)[points], exact, absolute=ORDER_LIMIT * np.max(np.abs(exact)))


def test_wall_reaction():
    run, points, rows = at_table_rows("contact")
    exact = table()["R_total_L2_over_EI"][rows]
    dr.assert_close(run.results.contact.reaction_total[points, 0], exact, absolute=ORDER_LIMIT * np.max(exact))
    for phase in ("before", "after"):
        # Contact begins where it is located.
        assert np.all(run.results.contact.reaction_total[phases(run)[phase], 0] < LOCATE * np.max(exact))


def test_contact_point():
    run, points, rows = at_table_rows("contact")
    for name in ("start", "end"):
        dr.assert_close(dr.regions(run, name)[points], along_the_rod(table()["contact_from_over_L"][rows]), absolute=1e-8)


@pytest.mark.parametrize("kind, close", [("GE6", 1e-8), ("GE4", 2e-6)])
def test_contact_point_along_all_its_way(kind, close):
    """At every point between first contact and last, from x/L = 0.461 to 0.297."""
    run = column(40, kind)
    rows, _, exact = contact_history(run)
    start, end = dr.regions(run, "start")[rows], dr.regions(run, "end")[rows]
    # How many and where is the affair of the increments; C+ and C- are left out.
    assert len(rows) > 5 and exact[0] - exact[-1] > 0.75 * (EVENTS[0][2] - EVENTS[2][2])
    dr.assert_close(start, exact, absolute=close)
    dr.assert_close(end, start, absolute=1e-12)


@pytest.mark.parametrize("kind, close", [("GE6", 1e-5), ("GE4", 2e-3)])
def test_contact_point_wanders_smoothly(kind, close):
    """It never hops from node to node: from point to point it moves as far as it should. The smallest move is 1e-4 L."""
    run = column(40, kind)
    rows, shortening, exact = contact_history(run)
    start = dr.regions(run, "start")[rows]
    dr.assert_monotone(start, rising=False)
    dr.assert_close(np.diff(start) / np.diff(exact), np.ones(len(rows) - 1), absolute=close)
    dr.assert_close(dr.bends(shortening, start), dr.bends(shortening, exact), absolute=1e-4 * ELEMENT)


def test_points_right_after_first_contact():
    """The column is hundreds of times stiffer there. Increments are as long as the path is straight: it turns by 0.5 in each at most,
    and an arc that turns by that is 0.5/8 of its chord away from it."""
    run = column()
    first, top = run.only("C+").point - 1, run.labelled("LP")[0].point - 1
    points = np.column_stack([run.column("midspan"), run.column("load_factor")])[first:top + 1]
    rising = branch("contact")
    exact = np.column_stack([table()["mid_over_h"][rising], table()["P_over_Pcr"][rising]])
    exact = exact[:int(np.argmax(exact[:, 1])) + 1]
    scale = np.ptp(exact, axis=0)
    points, exact = points / scale, exact / scale
    start, chord = points[:-1], np.diff(points, axis=0)
    along = np.clip(np.sum((exact[:, None] - start) * chord, axis=2) / np.sum(chord**2, axis=1), 0.0, 1.0)
    distance = np.min(np.linalg.norm(exact[:, None] - start - along[:, :, None] * chord, axis=2), axis=1)
    assert np.max(distance) <= 0.5 / 8.0 * np.max(np.linalg.norm(chord, axis=1))


def test_path_turns_at_its_limit_points_only():
    run = column()
    p, (top, bottom) = run.column("load_factor"), [c.point for c in run.labelled("LP")]
    dr.assert_close(np.max(p[:bottom]), p[top - 1], relative=LOCATE)
    dr.assert_monotone(p[:top], rising=True)
    dr.assert_monotone(p[top - 1:bottom], rising=False)
    dr.assert_monotone(p[bottom - 1:], rising=True)
    gained = run.only("C+").point
    dr.assert_monotone(run.column("midspan")[:gained], rising=True)
    dr.assert_monotone(run.column("midspan")[gained - 1:], rising=False)


def test_accuracy_block():
    accuracy = column().results.accuracy
    for name in ("residual", "penetration", "tension", "complementarity"):
        assert accuracy[name] <= 1e-9, name
    assert accuracy["force_balance"] <= 1e-8
    assert accuracy["moment_balance"] <= 1e-8


def test_contact_at_nodes_finds_the_same_loads_at_second_order():
    """Without the sliding point the contact is at one of two nodes, at most h/2 away: loads off by some h^2."""
    run = dr.run_deck(dr.changed(dr.on_given_mesh("column"), (", POINTS=ALONG", "")))
    first = [c for c in run.results.critical if c.label == "C+"][0].load_factor
    dr.assert_close(first, EVENTS[0][1], relative=1e-3)
    dr.assert_close(np.max(run.column("load_factor")), EVENTS[1][1], relative=5e-3)


def test_a_contact_that_is_gained_has_its_place():
    """It carries no force yet, but stands where the exact column touches."""
    run = dr.run_deck(dr.on_given_mesh("column"))
    row = run.only("C+").point - 1
    contact = run.results.contact
    assert contact.count[row] == 1 and contact.count[row - 1] == 0
    assert contact.start[row, 0] == contact.end[row, 0]
    dr.assert_close(contact.start[row, 0], along_the_rod(EVENTS[0][2]), absolute=1e-7)

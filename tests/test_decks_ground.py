"""Beams, pipes and liners that the ground or a host let go: closed forms, and elastica solutions of tests/reference.

The order: the fourth of GE4, with foundations inside the elements, rigid contact with sliding points, and all that
happens before nodes part. Springs at the nodes (POINTS=NODES): their reactions and the end of contact have the second.
"""
import functools
import math

import numpy as np
import pytest

import deck_runner as dr


# A weightless beam under a point load ----------------------------------------------------------------------------

@functools.cache
def point_load(elements, load="1e-5", points="ALONG"):
    return dr.run_deck(dr.changed(dr.on_given_mesh("winkler-point"), ("1, 2, 60", f"1, 2, {elements}"), ("-1e-5", f"-{load}"),
                                  ("NSET=BEAM\n*MONITOR", f"NSET=BEAM, POINTS={points}\n*MONITOR")))


def half_length(run, row=-1):
    return dr.regions(run, "end")[row]


SINKING = 0.25 / math.tanh(math.pi / 2)     # of the force 2 on EI = 1, k = 4


def test_contact_length_under_a_point_load():
    run = point_load(60)
    # GE4 with lambda h = 1/20: (lambda h)^4/720 = 9e-9; the end moves by a few times that.
    dr.assert_close(half_length(run), math.pi / 2, absolute=1e-7)
    dr.assert_close(run.column("sinking")[-1] / 1e-5, SINKING, relative=2e-8)


def test_contact_length_and_sinking_converge_at_fourth_order():
    """The end of contact lies at 0.85, 0.71, 0.42, 0.83 and 0.66 of an element."""
    runs = [point_load(n) for n in (15, 30, 60, 120, 240)]
    dr.assert_order([half_length(run) - math.pi / 2 for run in runs], 4.0, below=0.3, above=0.3)
    dr.assert_order([run.column("sinking")[-1] / 1e-5 / SINKING - 1.0 for run in runs[:4]], 4.0, below=0.3, above=0.3)


def test_contact_length_with_springs_at_nodes():
    """Second order; the sinking is better: where the beam lets go it hardly presses."""
    runs = [point_load(n, points="NODES") for n in (15, 30, 60, 120, 240, 480)]
    dr.assert_mean_order([half_length(run) - math.pi / 2 for run in runs], 2.0)
    dr.assert_close(half_length(runs[2]), math.pi / 2, absolute=3e-4)
    errors = [run.column("sinking")[-1] / 1e-5 / SINKING - 1.0 for run in runs[:4]]
    assert np.log2(abs(errors[0] / errors[-1])) / 3 > 2.0, errors
    dr.assert_close(errors[-1], 0.0, absolute=1e-6)


@pytest.mark.parametrize("load", ["1e-9", "1e-7", "1e-3"])
def test_contact_length_is_independent_of_the_load(load):
    """Along a path and between decks; rotations are a quarter of the load, what they do is of second order."""
    run = point_load(60, load)
    along = dr.regions(run, "end")[1:]
    dr.assert_close(along, np.full(len(along), half_length(point_load(60))), absolute=1e-8 + 0.1 * float(load))
    dr.assert_close(run.column("sinking")[-1] / float(load), point_load(60).column("sinking")[-1] / 1e-5, relative=1e-7)


# A heavy beam under a point load -------------------------------------------------------------------------------------

@functools.cache
def heavy_beam(elements, points="ALONG"):
    return dr.run_deck(dr.changed(dr.on_given_mesh("winkler-weight"), ("1, 2, 80", f"1, 2, {elements}"),
                                  ("*STEP, NAME=LOAD\n", "*STEP, NAME=LOAD\n*ACCURACY, WIDEST=0.1\n"),
                                  ("NSET=BEAM\n*MONITOR", f"NSET=BEAM, POINTS={points}\n*MONITOR")))


def first_gap(run):
    """Load at which the first reaction vanishes and its place, from two points with all of the beam in contact."""
    results = run.results
    load, step = run.column("load_factor"), run.column("step")
    rows = [int(p) for p in results.field_points if step[p - 1] == 2 and 0.4 < load[p - 1] < 0.95]
    first, second = (results.field("reaction", p) for p in (rows[0], rows[-1]))
    rate = (second - first) / (load[rows[-1] - 1] - load[rows[0] - 1])
    zero = np.full(len(first), np.inf)
    zero[rate < 0.0] = load[rows[0] - 1] - first[rate < 0.0] / rate[rate < 0.0]
    place = int(np.argmin(zero))
    return zero[place], 4.0 * math.pi * place / (len(first) - 1)


@pytest.mark.parametrize("elements", [20, 40, 80, 160])
def test_lift_off_is_where_weitsman_says(elements):
    dr.assert_close(first_gap(heavy_beam(elements, "NODES"))[1], math.pi, absolute=1e-12)


def test_lift_off_load_of_nodes_converges_at_fourth_order():
    """Equal weights are a good rule for a smooth reaction. Down to 3e-8, where the rotations of the deck begin to count."""
    dr.assert_order([first_gap(heavy_beam(n, "NODES"))[0] - 1.0 for n in (20, 40, 80, 160)], 4.0, below=0.4)


@pytest.mark.parametrize("elements, close", [(40, 1e-4), (80, 6e-6)])
def test_lift_off_of_nodes_is_an_event(elements, close):
    event = heavy_beam(elements, "NODES").labelled("C-")[0]
    dr.assert_close(event.load_factor, first_gap(heavy_beam(elements, "NODES"))[0], absolute=1e-8)
    dr.assert_close(event.load_factor, 1.0, absolute=close)


@dr.release_only
def test_lift_off_load_converges_at_fourth_order():
    """The load at which the region splits. What vanishes there is a reaction e^pi times smaller than the one under the
    load, of whose errors, (lambda h)^4/720, more than a tenth never gets there. Between the nodes the gap errs by less."""
    events = [heavy_beam(n).only("C-") for n in (20, 40, 80, 160)]
    assert [event.note for event in events] == ["a contact region splits"] * 4
    errors = np.array([event.load_factor - 1.0 for event in events])
    lambda_h = 4.0 * math.pi / np.array([20, 40, 80, 160])
    assert np.all(np.abs(errors) < 0.1 * math.exp(math.pi) * lambda_h**4 / 720), errors
    dr.assert_order(errors[1:], 4.0, below=0.7, above=0.3)


def test_no_lift_off_below_and_two_regions_above():
    run = heavy_beam(80)
    load, step, count = run.column("load_factor"), run.column("step"), run.results.contact.count
    assert np.all(count[(step == 1) & (load > 0.0)] == 1) and np.all(count[(step == 2) & (load < 1.0)] == 1)
    assert np.all(count[(step == 2) & (load > 1.02)] == 2)
    # All weight and half of the load.
    dr.assert_close(run.column("ground")[-1], 4e-4 * math.pi + 3.0 * 1e-4 * math.exp(math.pi), relative=1e-9)


# A pipe lifted off the seabed ----------------------------------------------------------------------------------------

@functools.cache
def lifted(elements, kind="GE4", ea="1e8"):
    return dr.run_deck(dr.changed(dr.on_given_mesh("pipe-lift"), ("1, 2, 60", f"1, 2, {elements}"), ("TYPE=GE4", f"TYPE={kind}"),
                                  ("1e8, 1.", f"{ea}, 1."), ("1e-7, 0.05\n", "1e-7, 0.05\n*CONTROLS, LOCATE=1e-12\n*ACCURACY, WIDEST=1\n")))


def lift_errors(run):
    """Of the touchdown points and of the lifts, where the lengths 1, 2, 3 are suspended."""
    exact = dr.reference("pipe_lift")
    points = run.labelled("UZ")
    assert len(points) == 3
    touchdown, lift = [], []
    for length, point in zip((1.0, 2.0, 3.0), points):
        row, = np.flatnonzero(exact["length"] == length)
        dr.assert_close(point.monitors["height"], exact["height"][row], relative=1e-8)
        touchdown.append(dr.regions(run, "end")[point.point - 1] - (6.0 - length))
        lift.append(point.monitors["lift"] - exact["lift"][row])
    return np.array(touchdown), np.array(lift)


def test_lifted_pipe_against_the_elastica():
    touchdown, lift = lift_errors(lifted(120))
    dr.assert_close(touchdown, np.zeros(3), absolute=5e-7)
    dr.assert_close(lift, np.zeros(3), absolute=2.5e-7)


@dr.release_only
@pytest.mark.parametrize("quantity", [0, 1])
def test_lifted_pipe_converges_at_fourth_order(quantity):
    """The worst of three lengths, touchdown and lift. With EA = 1e11 the pipe is as inextensible as that of the table, to 1e-11."""
    errors = [float(np.max(np.abs(lift_errors(lifted(n, "GE4", "1e11"))[quantity]))) for n in (10, 20, 40, 80, 160)]
    dr.assert_mean_order(errors, 4.0)


@dr.release_only
def test_lifted_pipe_of_many_elements():
    """The path is that of few elements, point by point; what lies on the seabed has no more elements than it needs, and what is
    lifted no more than rounding allows."""
    few, many = (dr.run_deck(dr.changed(dr.on_given_mesh("pipe-lift"), ("1, 2, 60", f"1, 2, {n}")))
                 for n in (300, 20000))
    assert "do not get on" not in many.stdout
    assert abs(many.results.n_points - few.results.n_points) <= 1
    dr.assert_close([point.monitors["lift"] for point in many.labelled("UZ")],
                    [point.monitors["lift"] for point in few.labelled("UZ")], relative=1e-7)


# 60 elements: 4e-6 with length 1, less with 2 and 3, twice that between; the table is good for 1e-6 between its rows. Short
# lengths have the fourth power of elements to the length.
ALONG = 1e-5


def test_lift_along_the_whole_path():
    exact = dr.reference("pipe_lift")
    run = lifted(60)
    height, lift = run.column("height"), run.column("lift")
    known = (height >= exact["height"][0]) & (height <= exact["height"][-1])
    # The fourth root of the height is nearly the length, and so even in the table.
    length = dr.interpolate(exact["height"] ** 0.25, exact["length"], height[known] ** 0.25)
    short = np.minimum(length, 1.0) ** 4
    dr.assert_close(short * (6.0 - dr.regions(run, "end")[known]), short * length, absolute=ALONG)
    dr.assert_close(short * lift[known], short * dr.interpolate(exact["length"], exact["lift"], length), absolute=ALONG)


def test_seabed_and_lift_carry_the_pipe():
    run = lifted(60)
    step = run.column("step")
    total = run.results.contact.reaction_total[:, 0] + run.column("lift")
    dr.assert_close(total[step == 2], np.full(np.sum(step == 2), 6.0), absolute=1e-8)


# A liner in a rigid host -----------------------------------------------------------------------------------------------

GLOCK = 12.0 * 50.0**3 / 100.0**2.2


def liner(force="0.001", times=1):
    text = dr.changed(dr.on_given_mesh("liner"), ("1, 2, -0.001", f"1, 2, -{force}"), ("0., 80", f"0., {80 * times}"),
                      ("0., 60", f"0., {60 * times}"), ("v, ABOVE, 0.4", "v, ABOVE, 0.07"))
    return dr.run_deck(text).labelled("LP")[0].load_factor


@dr.release_only
def test_liner_against_glock():
    """Without the force at the apex: the load falls linearly with small forces."""
    load = [liner("0.002"), liner()]
    dr.assert_close(2.0 * load[1] - load[0], GLOCK, relative=5e-3)


@dr.release_only
def test_liner_on_a_finer_mesh():
    """Fourth order: four times the elements of the coarser deck are 256 times better."""
    dr.assert_close(liner(times=2), liner(), relative=2e-7)


@dr.release_only
def test_liner_lifts_off_smoothly():
    """The end of contact travels over elements of two lengths; the deck against a mesh twice as fine and shorter increments, between
    which the cubic errs less. In the fine part to a millionth of a radian, in the coarse one to a thousandth of an element."""
    deck = dr.run_deck(dr.on_given_mesh("liner"))
    fine = dr.run_deck(dr.changed(dr.on_given_mesh("liner"), ("0., 80", "0., 160"), ("0., 60", "0., 120"), ("1E-9, 0.01", "1E-9, 0.002")))
    v, angle = deck.column("v")[2:-1], dr.regions(deck, "angle_start")[2:-1]
    at, other = fine.column("v")[2:], dr.regions(fine, "angle_start")[2:]
    inside = v > at[0]
    v, angle = v[inside], angle[inside]
    error = angle - dr.interpolate(np.log(at), other, np.log(v))
    close = angle < 38.0
    assert np.count_nonzero(close) > 5 and np.max(angle) > 90.0
    dr.assert_close(error[close], 0.0 * error[close], absolute=6e-5)
    dr.assert_close(error[~close], 0.0 * error[~close], absolute=1e-3 * 140.0 / 60.0)
    least = int(np.argmin(angle))
    dr.assert_monotone(angle[:least], rising=False)
    dr.assert_monotone(angle[least + 1:], rising=True)


def test_end_of_contact_beside_a_short_span():
    """The pipe just lifted, free over up to three elements: the end moves inwards steadily, never to the next node."""
    text = dr.changed(dr.on_given_mesh("pipe-lift"), ("1, 2, 60", "1, 2, 30"), ("2, 2, 2, 2.2830889633098", "2, 2, 2, 0.02"),
                      ("height, 0.041582882044509, 0.59486643521603, 1.7463390451712", "height, 0.003425"))
    end = dr.regions(dr.run_deck(text), "end")[1:]
    assert len(end) > 10
    dr.assert_monotone(end, rising=False)
    assert np.max(-np.diff(end)) < 0.2          # an element

"""postproc: contact regions followed along the path, through splits, merges and the first load; how plot_contact draws them."""

from __future__ import annotations

import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

sys.path[:0] = [str(Path(__file__).resolve().parent)]

import make_result_file as make  # noqa: E402
from postproc_runner import axes_of  # noqa: E402  (makes postproc known)
from unilat.results.contact_history import ends, presses  # noqa: E402
from unilat.results import Contact  # noqa: E402


def contact_of(points, around=0.0, force=None):
    """A contact whose regions [(start, end), ...] at each point are given; angles are ten times the arc lengths."""
    width = max(len(regions) for regions in points)
    spans = np.full((len(points), width, 2), np.nan)
    for row, regions in enumerate(points):
        spans[row, :len(regions)] = np.array(regions).reshape(-1, 2)
    count = np.array([len(regions) for regions in points])
    number = np.where(np.arange(width) < count[:, None], 1, 0)
    force = np.ones(len(points)) if force is None else np.array(force, dtype=float)
    return Contact(count, spans[:, :, 0], spans[:, :, 1], 10.0 * spans[:, :, 0], 10.0 * spans[:, :, 1], number,
                   force[:, None], np.arange(2), np.ones(2, dtype=int), np.array((0.0, 10.0)), np.array([around]),
                   ("distributed",))


def followed(contact):
    """Points and starts of every stretch."""
    return [(history.points.tolist(), history.start.tolist()) for history in contact.histories()]


def lines(contact):
    """Ends of contact: side -> line -> (points, arc lengths)."""
    found = {"start": {}, "end": {}}
    for end in ends(contact.histories()):
        found[end.side][end.line] = (end.points.tolist(), end.arc.tolist())
        np.testing.assert_allclose(end.angle, 10.0 * end.arc)
    return found


SPLIT = [[(0.0, 10.0)], [(0.0, 9.9)], [(0.1, 3.0), (5.0, 9.8)], [(0.2, 2.5), (5.5, 9.8)]]


def test_a_split_ends_the_stretch_and_begins_two():
    assert followed(contact_of(SPLIT)) == [([1, 2], [0.0, 0.0]), ([3, 4], [0.1, 0.2]), ([3, 4], [5.0, 5.5])]


def test_the_outer_ends_go_on_through_a_split_and_the_inner_ones_are_new():
    found = lines(contact_of(SPLIT))
    assert found["start"] == {1: ([1, 2, 3, 4], [0.0, 0.0, 0.1, 0.2]), 2: ([3, 4], [5.0, 5.5])}
    assert found["end"] == {1: ([1, 2, 3, 4], [10.0, 9.9, 9.8, 9.8]), 2: ([3, 4], [3.0, 2.5])}


def test_the_outer_ends_go_on_through_a_merge():
    found = lines(contact_of(SPLIT[::-1]))
    first, last = sorted(found["start"].values()), sorted(found["end"].values())
    assert first == [([1, 2], [5.5, 5.0]), ([1, 2, 3, 4], [0.2, 0.1, 0.0, 0.0])]
    assert last == [([1, 2], [2.5, 3.0]), ([1, 2, 3, 4], [9.8, 9.8, 9.9, 10.0])]


def test_the_part_in_the_middle_of_a_split_has_two_gaps():
    found = lines(contact_of([[(0.0, 9.0)], [(0.0, 2.0), (3.0, 5.0), (6.0, 9.0)]]))
    assert found["start"] == {1: ([1, 2], [0.0, 0.0]), 2: ([2], [3.0]), 3: ([2], [6.0])}
    assert found["end"] == {1: ([1, 2], [9.0, 9.0]), 2: ([2], [2.0]), 3: ([2], [5.0])}


def test_a_narrow_gap_that_wanders_by_more_than_its_width_is_no_split():
    gap = [[(28.7, 31.8), (32.0, 180.0)], [(29.1, 32.15), (32.5, 180.0)], [(29.5, 32.5), (32.9, 180.0)]]
    assert followed(contact_of(gap)) == [([1, 2, 3], [28.7, 29.1, 29.5]), ([1, 2, 3], [32.0, 32.5, 32.9])]


def test_regions_that_move_by_their_length_go_on_in_their_order():
    """The second one as it was shares more with the first one as it is than the first one does."""
    moved = [[(28.7, 31.8), (32.0, 180.0)], [(31.0, 34.0), (34.2, 180.0)]]
    assert followed(contact_of(moved)) == [([1, 2], [28.7, 31.0]), ([1, 2], [32.0, 34.2])]


def test_points_of_contact_that_wander_go_on_as_the_nearest():
    wandering = [[0.3, 0.7], [0.35, 0.72], [0.74], [0.1, 0.75]]
    assert followed(contact_of([[(s, s) for s in places] for places in wandering])) == [
        ([1, 2], [0.3, 0.35]), ([1, 2, 3, 4], [0.7, 0.72, 0.74, 0.75]), ([4], [0.1])]


def test_a_point_that_becomes_a_stretch_goes_on():
    assert followed(contact_of([[(1.0, 1.0)], [(0.9, 1.1)], [(0.8, 1.3)]])) == [([1, 2, 3], [1.0, 0.9, 0.8])]


def test_contact_without_force_ends_when_the_first_force_lifts_a_part_off():
    """A ring that lies in its cavity: under the first load contact ends elsewhere at once."""
    contact = contact_of([[(0.0, 10.0)], [(3.6, 10.0)], [(3.5, 10.0)]], force=(-1e-9, 5.0, 100.0))
    assert presses(contact)[:, 0].tolist() == [False, True, True]
    assert followed(contact) == [([1], [0.0]), ([2, 3], [3.6, 3.5])]
    assert {line for side in lines(contact).values() for line in side} == {1, 2}


@pytest.mark.parametrize("first", [(4.0, 4.0), (3.99, 4.01), (0.0, 8.0)])
def test_contact_that_only_grows_with_the_first_force_goes_on(first):
    contact = contact_of([[first], [(first[0] - 0.5, first[1])], [(first[0] - 0.7, 9.0)]], force=(0.0, 1.0, 2.0))
    assert [points for points, _ in followed(contact)] == [[1, 2, 3]]


def test_the_same_contact_with_force_goes_on():
    assert len(contact_of([[(0.0, 10.0)], [(3.6, 10.0)]], force=(1.0, 5.0)).histories()) == 1


def test_a_contact_that_never_carries_force_is_followed_all_the_same():
    assert len(contact_of([[(0.0, 10.0)], [(3.6, 10.0)]], force=(0.0, 0.0)).histories()) == 1


def test_a_region_goes_over_the_seam_of_a_ring():
    """Length 10 once round; the file may count the end on or begin again at 0."""
    contact = contact_of([[(7.0, 9.5)], [(8.0, 10.5)], [(9.0, 1.5)], [(0.2, 2.5)]], around=10.0)
    assert followed(contact) == [([1, 2, 3, 4], [7.0, 8.0, 9.0, 0.2])]


def test_parts_of_a_split_over_the_seam_are_in_order():
    for end in (13.0, 3.0):
        found = lines(contact_of([[(6.0, end)], [(1.0, 3.0), (6.0, 9.0)]], around=10.0))
        assert found["start"] == {1: ([1, 2], [6.0, 6.0]), 2: ([2], [1.0])}
        assert found["end"] == {1: ([1, 2], [end, 3.0]), 2: ([2], [9.0])}


def test_contacts_are_followed_one_by_one():
    both = contact_of([[(1.0, 2.0), (1.0, 2.0)], [(1.1, 2.0), (1.2, 2.0)]])
    numbers = np.array([[1, 2], [1, 2]])
    contact = Contact(both.count, both.start, both.end, both.angle_start, both.angle_end, numbers, np.ones((2, 2)),
                      both.candidates, both.candidate_contact, both.arc_length, np.zeros(2), ("nodes", "nodes"))
    assert [(history.contact, history.start.tolist()) for history in contact.histories()] == [(1, [1.0, 1.1]), (2, [1.0, 1.2])]


# The picture


@pytest.fixture
def ring(tmp_path):
    name = tmp_path / "ring.h5"
    make.write_ring(name)
    return name


def drawn(axes):
    return [np.column_stack(line.get_data()) for line in axes.get_lines() if line.get_linestyle() != "None"]


def test_no_line_from_contact_without_force(ring, axes_of):
    with h5py.File(ring, "a") as file:
        file["contact/reaction_total"][0] = 0.0
        file["contact/start"][0, 0] = 0.0
        file["contact/angle_start"][0, 0] = 0.0
    (axes,) = axes_of("contact", ring, "--end", "start")
    curves = drawn(axes)
    assert not [curve for curve in curves if np.any(np.all(curve == make.RING[0, 1:3], axis=1))]
    np.testing.assert_allclose(curves[0][0], (make.RING[1, 1], make.RING[1, 2]))


def split_ring(name):
    """From point 8 on a gap of 10 degrees that begins 5 degrees after the start of contact."""
    with h5py.File(name, "a") as file:
        contact = file["contact"]
        contact["count"][7:] = 2
        contact["contact"][7:, 1] = 1
        for prefix, unit in (("angle_", 1.0), ("", np.pi / 180.0)):
            start, end = contact[f"{prefix}start"], contact[f"{prefix}end"]
            end[7:, 1] = end[7:, 0]
            end[7:, 0] = start[7:, 0] + 5.0 * unit
            start[7:, 1] = start[7:, 0] + 15.0 * unit


def test_a_split_draws_no_jump_and_keeps_the_colour(ring, axes_of):
    split_ring(ring)
    (axes,) = axes_of("contact", ring, "--end", "start", "--against", "point", "--mark", "none")
    colours = {}
    for line in axes.get_lines():
        colours.setdefault(line.get_color(), []).append(np.column_stack(line.get_data()))
    (first, second) = (np.unique(np.concatenate(curves), axis=0) for curves in colours.values())
    for points, curve, values in (np.arange(1, 16), first, make.RING[:, 2]), (np.arange(8, 16), second, make.RING[7:, 2] + 15.0):
        assert all(np.any(np.all(np.isclose(curve, point), axis=1)) for point in zip(points, values))
        np.testing.assert_allclose(curve[[0, -1], 0], points[[0, -1]])


def test_the_tint_covers_the_regions(ring, axes_of):
    split_ring(ring)
    (axes,) = axes_of("contact", ring, "--quantity", "arc", "--against", "point")
    height = [np.ptp(path.vertices[:, 1]) for patch in axes.patches for path in [patch.get_path()]]
    assert len(height) == 3
    (axes,) = axes_of("contact", ring, "--quantity", "arc")        # the load factor goes up and down
    assert len(axes.patches) == 0


def test_of_steps_over_the_same_loads_the_last_is_tinted(ring, axes_of):
    with h5py.File(ring, "a") as file:
        file["path/step"][8:] = 2
        file["path/load_factor"][...] = [*np.arange(8.0), *np.arange(7.0)]
    (axes,) = axes_of("contact", ring, "--quantity", "arc")
    (tint,) = axes.patches
    vertices = tint.get_path().vertices
    assert (vertices[:, 0].min(), vertices[:, 0].max()) == (0.0, 6.0)


def test_several_contacts_have_their_obstacles_in_the_legend(ring, axes_of):
    with h5py.File(ring, "a") as file:
        contact = file["contact"]
        contact["count"][...] = 2
        contact["contact"][...] = (1, 2)
        for name in ("start", "end", "angle_start", "angle_end"):
            contact[name][:, 1] = contact[name][:, 0] - 1.0
        total = contact["reaction_total"][()]
        del contact["reaction_total"], contact["chain_length"], contact["points"], contact["obstacle"]
        make.put(contact, "reaction_total", np.column_stack((total, total)), "force")
        make.put(contact, "chain_length", np.zeros(2), "length")
        make.put(contact, "points", np.array(("nodes", "nodes"), dtype="S11"))
        make.put(contact, "obstacle", np.array(("cavity", "cavity"), dtype="S8"))
    (axes,) = axes_of("contact", ring, "--mark", "none")
    legend = axes.get_legend()
    assert [text.get_text() for text in legend.get_texts()] == ["cavity (1)", "cavity (2)", "unstable"]
    assert len({line.get_color() for line in legend.get_lines()[:2]}) == 2


def test_the_parts_of_a_split_are_tinted_from_where_the_whole_ends(ring, axes_of):
    """Point 7 is the last one of the whole: the parts reach back to it, with the outer ends that it has there, and with inner ones
    that meet there, in the middle of the gap as it is first seen."""
    split_ring(ring)
    (axes,) = axes_of("contact", ring, "--quantity", "arc", "--against", "point")
    whole, *parts = ({tuple(vertex) for vertex in path.vertices.tolist()} for patch in axes.patches
                     for path in [patch.get_path()])
    with h5py.File(ring) as file:
        start, end = file["contact/start"][()], file["contact/end"][()]
    assert (7.0, start[6, 0]) in whole and (7.0, end[6, 0]) in whole and max(vertex[0] for vertex in whole) == 7.0
    middle = 0.5 * (end[7, 0] + start[7, 1])
    for part, outer in zip(parts, (start[6, 0], end[6, 0])):
        at_seven = sorted(y for x, y in part if x == 7.0)
        np.testing.assert_allclose(at_seven, sorted((outer, middle)))

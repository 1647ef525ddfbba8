"""postproc: reactions and gaps along the rod, and which points of the path are drawn."""

from __future__ import annotations

import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

sys.path[:0] = [str(Path(__file__).resolve().parent)]

import make_result_file as make  # noqa: E402
from postproc_runner import axes_of, draw, drawn_share, png_size  # noqa: E402  (makes postproc known)
from unilat import chosen_points  # noqa: E402
from unilat.options import Parser  # noqa: E402
from unilat.plot import reaction as reaction_plot  # noqa: E402
from unilat.results.candidate_chain import Chain, ChainState  # noqa: E402
from unilat.results import read_results  # noqa: E402

N = 24          # elements of the half ring
LIMIT = 6


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("results")
    make.write_ring(folder / "nodes.h5", n_elements=N)
    make.write_ring(folder / "distributed.h5", n_elements=N, points="distributed")
    make.write_ring(folder / "reactions.h5", n_elements=N, fields=("displacement", "reaction", "reaction_density"))
    make.write_ring(folder / "gaps.h5", n_elements=N, fields=("gap",))
    make.write_ring(folder / "shapes.h5", n_elements=N, fields=("displacement",))
    make.write_column(folder / "column.h5")
    make.write_cantilever(folder / "cantilever.h5")
    write_closed(folder / "closed.h5")
    return folder


def write_closed(name):
    """A closed ring of 24 nodes about 0 with contact from 300 over 360 to 60 degrees, pressure cos(angle)."""
    make.write_ring(name, ring=make.RING[:7], n_elements=N - 1, points="distributed")
    angle = 2.0 * np.pi * np.arange(N) / N
    with h5py.File(name, "a") as file:
        del file["mesh/elements"], file["mesh/coordinates"], file["contact/arc_length"], file["contact/chain_length"]
        make.put(file, "mesh/coordinates", np.column_stack((np.cos(angle), np.sin(angle))), "length")
        make.put(file, "mesh/elements", np.column_stack((np.arange(N), (np.arange(N) + 1) % N)))
        make.put(file, "contact/arc_length", angle, "length")
        make.put(file, "contact/chain_length", np.array([2.0 * np.pi]), "length")
        file["contact/start"][:, 0], file["contact/end"][:, 0] = np.radians(305.0), np.radians(360.0 + 55.0)
        file["fields/contact_point"][...] = file["mesh/coordinates"][()]
        file["fields/reaction_density"][...] = np.maximum(np.cos(angle), 0.5) - 0.5
        file["obstacles/cavity"].attrs["reference_angle"] = 0.0


@pytest.fixture
def panels(axes_of):
    """Gives the axes of the picture without those of the legend: bars, then the quantities."""
    return lambda *arguments: [axes for axes in axes_of("reaction", *arguments) if axes.get_legend() is None]


def curves(axes):
    """Lines (n, 2) without the one at zero across the panel, which has axes coordinates."""
    return [np.column_stack(line.get_data()) for line in axes.get_lines()
            if line.get_linestyle() != "None" and line.get_transform() == axes.transData]


def markers(axes):
    return [np.column_stack(line.get_data()) for line in axes.get_lines() if line.get_linestyle() == "None"]


def bars(axes):
    """Extents along x of the contact regions."""
    return sorted((path.vertices[:, 0].min(), path.vertices[:, 0].max()) for patch in axes.collections
                  for path in patch.get_paths())


# What is drawn


def test_reactions_at_nodes_are_markers_on_stems(files, panels):
    regions, density, gap = panels(files / "nodes.h5", "--label", "LP")
    _, reaction, distance, lift = make.ring_shape(make.RING[LIMIT - 1], N)
    s = np.linspace(0.0, np.pi, N + 1)
    (points,) = markers(density)
    np.testing.assert_allclose(points, np.column_stack((s, reaction * N / np.pi))[reaction > 0.0])
    (stems,) = density.collections
    np.testing.assert_allclose([stem[:, 1] for stem in stems.get_segments()], [(0.0, y) for y in points[:, 1]])
    (line,) = curves(gap)
    np.testing.assert_allclose(line, np.column_stack((s, distance)))
    np.testing.assert_allclose(bars(regions), [(lift, np.pi)])


def test_many_nodes_have_stems_at_the_ends_only(tmp_path, panels):
    make.write_ring(tmp_path / "fine.h5", ring=make.RING[4:7], n_elements=100)
    _, density, _ = panels(tmp_path / "fine.h5", "--label", "LP")
    (points,), (stems,) = markers(density), density.collections
    assert len(points) > reaction_plot.MOST_STEMS
    np.testing.assert_allclose([stem[1] for stem in stems.get_segments()], points[[0, -1]])


def test_distributed_reactions_are_lines_to_the_end_of_contact(files, panels):
    """Zero where contact ends inside an element, and no line beyond; the gap is zero there, too."""
    _, density, gap = panels(files / "distributed.h5", "--label", "LP")
    _, reaction, distance, lift = make.ring_shape(make.RING[LIMIT - 1], N)
    s = np.linspace(0.0, np.pi, N + 1)
    expected = np.column_stack((s, reaction * N / np.pi))[reaction > 0.0]
    (line,) = curves(density)
    np.testing.assert_allclose(line, np.vstack(((lift, 0.0), expected)))
    assert markers(density) == []
    (line,) = curves(gap)
    np.testing.assert_allclose(line, sorted([*zip(s, distance), (lift, 0.0)]))


def test_the_share_of_the_nodes_is_drawn_with_markers(files, panels):
    _, reaction, _ = panels(files / "distributed.h5", "--label", "LP", "--quantity", "reaction")
    assert curves(reaction) == []
    np.testing.assert_allclose(markers(reaction)[0][0, 1], 3.0 * make.RING[LIMIT - 1, 1] * np.pi / N)
    assert reaction.get_ylabel() == "reaction (force)"


def test_angles_are_those_of_the_contact_regions(files, panels):
    regions, density, _ = panels(files / "nodes.h5", "--label", "LP", "--against", "angle")
    (bar,) = bars(regions)
    assert bar[0] == pytest.approx(make.RING[LIMIT - 1, 2], abs=0.05)       # between two nodes: interpolated
    assert bar[1] == pytest.approx(180.0, abs=1e-6)
    u, reaction, *_ = make.ring_shape(make.RING[LIMIT - 1], N)
    s = np.linspace(0.0, np.pi, N + 1)
    x, y = -np.sin(s) + u[:, 0], np.cos(s) + u[:, 1]
    np.testing.assert_allclose(markers(density)[0][:, 0], np.degrees(np.arctan2(-x, y))[reaction > 0.0] % 360.0, atol=1e-9)
    assert density.get_shared_x_axes().joined(density, regions) and regions.get_xlim() == density.get_xlim()


def test_a_closed_ring_goes_on_over_its_seam(files, panels):
    """24 nodes, contact from 305 to 415 degrees: two bars and two curves, both with the first node at both ends."""
    regions, density = panels(files / "closed.h5", "--rows", "-1", "--no-gap")
    turn = 2.0 * np.pi
    np.testing.assert_allclose(bars(regions), [(0.0, np.radians(55.0)), (np.radians(305.0), turn)])
    after, before = sorted(curves(density), key=lambda curve: curve[0, 0])
    angle = np.radians(np.arange(0.0, 46.0, 15.0))
    np.testing.assert_allclose(after, [*zip(angle, np.cos(angle) - 0.5), (np.radians(55.0), 0.0)])
    np.testing.assert_allclose(before, np.column_stack((turn - after[::-1, 0], after[::-1, 1])))


def test_angles_of_a_closed_ring_do_not_jump(files):
    state = ChainState(Chain(read_results(files / "closed.h5"), 1), 3, angle=True)
    np.testing.assert_allclose(state.x, 15.0 * np.arange(N + 1), atol=1e-9)


def test_a_point_that_slid_is_where_its_region_is(files, tmp_path):
    """Point 12 of the column touches between its nodes; the reaction is that of the nearest pressing one."""
    name = tmp_path / "column.h5"
    name.write_bytes((files / "column.h5").read_bytes())
    place = read_results(name).contact.start[11, 0]
    nodes = np.linspace(0.0, 1.0, 31)
    near = int(np.argsort(np.abs(nodes - place))[1])        # the second nearest has come over
    with h5py.File(name, "a") as file:
        reaction = np.zeros((41, 31))
        reaction[11, near] = 5.0
        make.put(file, "fields/reaction", reaction, "force")
    state = ChainState(Chain(read_results(name), 1), 12, angle=False)
    assert state.regions == [(place, place)]
    assert state.x[near] == place and np.array_equal(np.delete(state.x, near), np.delete(nodes, near))


def test_factors_and_ranges(files, panels):
    _, density, gap = panels(files / "nodes.h5", "--label", "LP", "--x-scale", 2, "--y-scale", 0.5,
                             "--y-range", 0, 200, "--y-label", "$pR^3/EI$")
    np.testing.assert_allclose(markers(density)[0][-1], (2.0 * np.pi, 1.5 * make.RING[LIMIT - 1, 1]))
    np.testing.assert_allclose(curves(gap)[0][0], (0.0, make.RING[LIMIT - 1, 0]))
    assert density.get_ylim() == (0.0, 200.0) and density.get_ylabel() == "$pR^3/EI$" and gap.get_ylabel() == "gap (length)"


def test_what_is_stored_is_drawn(files, panels):
    assert len(panels(files / "reactions.h5")) == 2
    assert [axes.get_ylabel() for axes in panels(files / "gaps.h5")] == ["contact", "gap (length)"]
    assert len(panels(files / "nodes.h5", "--quantity", "gap")) == 2
    assert len(panels(files / "nodes.h5", files / "distributed.h5", "--width", 180)) == 6


def test_shades_and_names(files, axes_of):
    everything = axes_of("reaction", files / "distributed.h5", "--rows", "3,6,9", "--caption", "v")
    (legend,) = (axes.get_legend() for axes in everything if axes.get_legend() is not None)
    assert legend.get_title().get_text() == "v (length)"
    assert [text.get_text() for text in legend.get_texts()] == ["0.003162", "0.03587  LP", "0.088"]
    wanted = [line.get_color() for line in legend.get_lines()]
    assert len(set(wanted)) == 3 and np.all(np.diff([sum(colour) for colour in wanted]) < 0.0)     # from pale to dark
    density = everything[1]
    assert [line.get_color() for line in density.get_lines() if line.get_transform() == density.transData] == wanted


@pytest.mark.parametrize("arguments", [
    ["nodes.h5"], ["distributed.h5", "--against", "angle", "--label", "LP", "--title", "a ring", "--no-gap"],
    ["nodes.h5", "distributed.h5", "--width", "180", "--name", "A", "--name", "B"], ["closed.h5", "--contact", "1"],
    ["gaps.h5", "--height", "60"]])
def test_picture(files, tmp_path, arguments):
    arguments = [str(files / a) if a.endswith(".h5") else a for a in arguments]
    assert draw("reaction", *arguments, "-o", tmp_path / "a.png") == 0
    assert png_size(tmp_path / "a.png")[0] >= 1000 and 0.005 < drawn_share(tmp_path / "a.png") < 0.5


@pytest.mark.parametrize("arguments, message", [
    (["cantilever.h5"], "the model has no contact"),
    (["shapes.h5"], "no reactions are stored (*FIELD OUTPUT, REACTION)"),
    (["reactions.h5", "--quantity", "gap"], "no gaps are stored (*FIELD OUTPUT, GAP)"),
    (["nodes.h5", "--contact", "2"], "no contact 2 (they run from 1 to 1)"),
    (["nodes.h5", "--rows", "16"], "no point 16 (they run from 1 to 15)"),
    (["nodes.h5", "--at", "1,x"], "'1,x' is not a list of numbers"),
    (["nodes.h5", "--branch", "1"], "no branch 1 (it has none)"),
    (["gaps.h5", "--against", "angle"],
     "angles need the contact points (they come with *FIELD OUTPUT, REACTION or GAP), point 1 has none"),
    (["nodes.h5", "--label", "BP"], "label BP: no such point")])
def test_wrong_input_is_one_line(files, monkeypatch, capsys, arguments, message):
    monkeypatch.chdir(files)
    assert draw("reaction", *arguments) == 2
    printed = capsys.readouterr().err
    assert message in printed and printed.count("\n") == 1


def test_a_line_has_no_angles(files, tmp_path, capsys):
    name = tmp_path / "column.h5"
    name.write_bytes((files / "column.h5").read_bytes())
    with h5py.File(name, "a") as file:
        make.put(file, "fields/gap", np.zeros((41, 31)), "length")
        make.put(file, "contact/obstacle", np.array(("wall",), dtype="S8"))
    assert draw("reaction", name, "--against", "angle") == 2
    assert "wall has no centre (use --against arc)" in capsys.readouterr().err


# Which points


def chosen(results, *arguments):
    parser = Parser("test", "", "")
    chosen_points.add_points(parser, "curves")
    return chosen_points.choose(results, parser.parse_args(arguments), results.points_with("gap"), "gaps")


def test_points_by_row_label_and_value(files):
    ring = read_results(files / "nodes.h5")
    assert chosen(ring, "--rows", "-1,3", "--label", "LP") == [3, 6, 15]
    assert chosen(ring, "--at", "17,4.7") == [3, 15]
    assert chosen(ring, "--at", "0.1,0.4", "--caption", "v") == [9, 13]
    assert chosen(ring, "--at", "-40", "--caption", "v", "--caption-scale", "-100") == [13]


def test_evenly_spaced_points_are_different_ones(tmp_path):
    """Arc lengths 1, 1.01, 1.02, ..., then 100: three of them, not two."""
    make.write_ring(tmp_path / "ring.h5", ring=make.RING[:7])
    with h5py.File(tmp_path / "ring.h5", "a") as file:
        file["path/arc_length"][...] = [1.0, 1.01, 1.02, 1.03, 1.04, 1.05, 100.0]
    ring = read_results(tmp_path / "ring.h5")
    assert chosen(ring, "--evenly", "3") == [1, 6, 7]
    assert chosen(ring, "--evenly", "9") == [1, 2, 3, 4, 5, 6, 7]

"""postproc: the reader's values, and pictures and errors of the plot scripts."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from matplotlib.collections import LineCollection, PolyCollection

TESTS = Path(__file__).resolve().parent
POSTPROC = TESTS.parent / "postproc"
sys.path[:0] = [str(TESTS), str(POSTPROC)]

import make_result_file as make  # noqa: E402
from postproc_runner import axes_of, command_line, draw, drawn_share, empty_axes, module_run, png_size  # noqa: E402,F401
from unilat.plot import path_curves, style  # noqa: E402
from unilat.plot.force_drawing import write  # noqa: E402
from unilat.plot.label_placing import place_labels, uncover  # noqa: E402
from unilat.plot.obstacle_drawing import draw_obstacle  # noqa: E402
from unilat.results import Contact, Mesh, Obstacle, ResultsError, read_results, rod_shape  # noqa: E402
from unilat.results.reference_table import read_table  # noqa: E402

COMMANDS = ("path", "contact", "shape", "reaction")
LIMIT = 6       # the ring's limit point, counted from 1


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("results")
    make.write_ring(folder / "ring.h5")
    make.write_ring(folder / "killed.h5", status="running", critical=False, every=2,
                    shorter=("path/monitor/H", "contact/end", "fields/displacement"))
    make.write_ring(folder / "regions.h5", fields=("displacement",))
    make.write_column(folder / "column.h5")
    make.write_cantilever(folder / "cantilever.h5")
    (folder / "exact.csv").write_text("# exact path\n# R = 1\nphase,v,p,phi\nup,0.01,45,31.5\nup,0.0358,81.5,\n"
                                      '"down, far",0.3,9,nan\n')
    return folder


# The reader


def test_root_and_columns(files):
    ring = read_results(files / "ring.h5")
    assert (ring.program, ring.title, ring.status) == ("unilat", "half ring in a rigid cavity", "complete")
    assert ring.complete and ring.deck.startswith("*HEADING") and ring.n_points == len(make.RING)
    np.testing.assert_array_equal(ring.path["load_factor"].values, make.RING[:, 1])
    np.testing.assert_array_equal(ring.column("V").values, make.RING[:, 0])
    assert (ring.column("v").units, ring.column("v").description) == ("length", "apex, downwards")
    np.testing.assert_array_equal(ring.column("point").values, np.arange(1, 16))
    np.testing.assert_array_equal(ring.column("monitor/h").values, -make.RING[:, 3])
    assert ring.path["label"].values[LIMIT - 1] == "LP" and ring.path["label"].values[0] == ""


def test_monitors_keep_the_order_of_the_file(files):
    assert list(read_results(files / "ring.h5").monitors) == ["v", "H"]


def test_unknown_column_is_named_with_a_hint(files):
    ring = read_results(files / "ring.h5")
    with pytest.raises(ResultsError, match="ring.h5: no path quantity or monitor 'load_facto'.*mean load_factor"):
        ring.column("load_facto")


def test_mesh_and_obstacle(files):
    ring = read_results(files / "ring.h5")
    assert ring.mesh.coordinates.shape == (25, 2) and ring.mesh.elements[-1].tolist() == [23, 24]
    assert ring.mesh.node_label[0] == 101
    cavity = ring.obstacles["cavity"]
    assert (cavity.kind, cavity.side, cavity.radius, cavity.reference_angle) == ("circle", "inside", 1.0, 90.0)
    wall = read_results(files / "column.h5").obstacles["wall"]
    assert wall.kind == "line" and wall.points.tolist() == [[1.0, 0.02], [0.0, 0.02]] and wall.radius is None


def test_contact_regions(files):
    ring = read_results(files / "ring.h5")
    (region,) = ring.contact.regions(LIMIT)
    assert region.contact == 1 and region.angle_start == make.RING[LIMIT - 1, 2] and region.angle_end == 180.0
    assert region.end == np.pi
    assert ring.contact.candidates.tolist() == list(range(25))
    (history,) = ring.contact.histories()
    np.testing.assert_array_equal(history.angle_start, make.RING[:, 2])
    np.testing.assert_array_equal(history.points, np.arange(1, 16))


def test_history_follows_regions_that_change_their_column():
    """Point 1: one region at 5; point 2: a new one before it, at 1; point 3: the old one is gone."""
    nan = np.nan
    start = np.array([[5.0, nan], [1.0, 5.1], [1.1, nan]])
    zero = np.zeros((3, 2))
    contact = Contact(
        np.array([1, 2, 1]), start, start + 0.5, zero, zero, np.ones((3, 2), dtype=int), zero[:, :1],
        np.arange(2), np.ones(2, dtype=int), np.array((0.0, 9.0)), np.zeros(1), ("nodes",))
    old, new = contact.histories()
    assert (old.points.tolist(), old.start.tolist()) == ([1, 2], [5.0, 5.1])
    assert (new.points.tolist(), new.start.tolist()) == ([2, 3], [1.0, 1.1])


def test_history_ends_where_contact_is_lost(files):
    column = read_results(files / "column.h5")
    (history,) = column.contact.histories()
    assert history.points[0] == 10 and history.points[-1] == 36 and np.all(np.isfinite(history.start))


def test_cost_and_accuracy(files):
    ring = read_results(files / "ring.h5")
    assert ring.performance == {"phase": ["deck", "path"], "seconds": [0.01, 0.2]}
    assert ring.accuracy == {"residual": 3.0e-13} and ring.contact.obstacles == ("cavity",)


def test_critical_points(files):
    limit, end = read_results(files / "ring.h5").critical
    assert (limit.label, limit.point, limit.step, limit.located, limit.note) == ("LP", LIMIT, 1, True, "of the load")
    assert limit.load_factor == make.RING[LIMIT - 1, 1] and limit.monitors == {"v": make.RING[LIMIT - 1, 0]}
    assert end.label == "EP"
    assert [c.located for c in read_results(files / "column.h5").critical] == [True, True, False]


def test_error_bars(files, tmp_path, axes_of):
    """Those of the load and of monitors, at critical points and along the path; a band is drawn where they can be seen."""
    ring = read_results(files / "ring.h5")
    assert all(np.isnan(c.error) and np.isnan(c.corrected) and not c.monitor_errors for c in ring.critical) and not ring.errors
    make.write_ring(tmp_path / "ring.h5")
    make.add_error_bars(tmp_path / "ring.h5")
    ring = read_results(tmp_path / "ring.h5")
    limit, end = ring.critical
    assert limit.error == pytest.approx(0.03 * limit.load_factor) and limit.corrected == pytest.approx(0.985 * limit.load_factor)
    assert limit.monitor_errors["v"] == pytest.approx(0.03 * limit.monitors["v"])
    assert np.isinf(end.error) and np.isnan(end.corrected)
    load = ring.column("load_factor").values
    assert np.all(np.isnan(ring.errors["load_factor"].values[:2]))
    np.testing.assert_allclose(ring.errors["load_factor"].values[2:-1], 0.01 * load[2:-1])
    np.testing.assert_allclose(ring.column("corrected").values[2:-1], 0.995 * load[2:-1])
    axes, = axes_of("path", tmp_path / "ring.h5", "--x", "v", "--y", "load_factor", "--y-scale", "2")
    band, = (c for c in axes.collections if isinstance(c, PolyCollection))
    corners = band.get_paths()[0].vertices
    assert corners[:, 1].max() == pytest.approx(2.0 * 1.01 * load[2:-1].max())
    whiskers = [c for c in axes.collections if isinstance(c, LineCollection) and len(c.get_segments()) == 1]
    assert any(np.ptp(c.get_segments()[0][:, 1]) == pytest.approx(2.0 * 2.0 * 0.01 * limit.load_factor) for c in whiskers)
    axes, = axes_of("path", files / "ring.h5", "--x", "v")
    assert not any(isinstance(c, PolyCollection) for c in axes.collections)


def test_fields(files):
    ring = read_results(files / "ring.h5")
    u = ring.field("displacement", LIMIT)
    assert ring.field_names == ("displacement", "reaction", "reaction_density", "gap", "contact_point") and u.shape == (25, 3)
    np.testing.assert_allclose(u[0], (0.0, -make.RING[LIMIT - 1, 0], 0.0), atol=1e-14)
    with pytest.raises(ResultsError, match="field 'section_forces' is not in the file"):
        ring.field("section_forces", 1)


def test_field_of_some_steps_only(files, tmp_path):
    """Rows of a step that did not ask for a field are NaN: no shape there, contact from the regions."""
    name = tmp_path / "partly.h5"
    name.write_bytes((files / "ring.h5").read_bytes())
    with h5py.File(name, "a") as file:
        file["fields/displacement"][:10] = np.nan
        for field in ("reaction", "reaction_density", "gap"):
            file[f"fields/{field}"][:] = np.nan
    ring = read_results(name)
    assert ring.points_with("displacement").tolist() == [11, 12, 13, 14, 15]
    assert ring.points_with("reaction").size == 0
    with pytest.raises(ResultsError, match="field 'displacement' is not stored at point 3"):
        ring.field("displacement", 3)
    assert draw("shape", name, "-o", tmp_path / "a.png") == 0
    assert draw("shape", name, "--rows", "3", "-o", tmp_path / "b.png") == 2
    assert not (tmp_path / "b.png").exists()


def test_no_contact_no_fields(files):
    cantilever = read_results(files / "cantilever.h5")
    assert cantilever.contact is None and cantilever.field_names == () and cantilever.critical == []
    assert cantilever.status == "running" and cantilever.n_points == 2


def test_killed_run_is_cut_to_whole_points(files):
    """15 rows, some datasets hold 14; fields at points 1, 3, ..., 15 of which the last lacks its displacement."""
    ring = read_results(files / "killed.h5")
    assert ring.n_points == 14
    assert {len(c.values) for c in (*ring.path.values(), *ring.monitors.values())} == {14}
    assert len(ring.contact.count) == len(ring.contact.start) == len(ring.contact.reaction_total) == 14
    assert ring.field_points.tolist() == [1, 3, 5, 7, 9, 11, 13]
    assert [(c.label, c.point) for c in ring.critical] == [("LP", LIMIT)]      # from the labels of the path
    with pytest.raises(ResultsError, match=r"no fields are stored at point 6 \(nearest: 5, 7\)"):
        ring.field("displacement", 6)


def test_file_that_is_being_written(tmp_path):
    name = tmp_path / "open.h5"
    make.write_ring(name)
    reader = "import sys; from unilat import read_results; print(read_results(sys.argv[1]).n_points)"
    with h5py.File(name, "a"):
        done = subprocess.run([sys.executable, "-B", "-c", reader, str(name)], capture_output=True, text=True,
                              check=False, env={**os.environ, "PYTHONPATH": str(POSTPROC)})
    assert (done.stdout, done.stderr) == ("15\n", "")


@pytest.mark.parametrize("content, message", [
    (None, "no such file"), (b"", "not an HDF5 file"), (b"not a result file\n", "not an HDF5 file")])
def test_wrong_file(tmp_path, content, message):
    name = tmp_path / "wrong.h5"
    if content is not None:
        name.write_bytes(content)
    with pytest.raises(ResultsError, match=message):
        read_results(name)


def test_truncated_file(files, tmp_path):
    name = tmp_path / "half.h5"
    name.write_bytes((files / "ring.h5").read_bytes()[:4000])
    with pytest.raises(ResultsError) as caught:
        read_results(name)
    assert "half.h5" in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize("missing", ["path", "path/load_factor", "mesh/elements", "contact/start"])
def test_missing_dataset(files, tmp_path, missing):
    name = tmp_path / "less.h5"
    name.write_bytes((files / "ring.h5").read_bytes())
    with h5py.File(name, "a") as file:
        del file[missing]
    with pytest.raises(ResultsError, match="not a result file" if missing == "path" else f"/{missing} is missing"):
        read_results(name)


def test_reference_table(files):
    x, y = read_table(files / "exact.csv", "v", "phi")
    np.testing.assert_array_equal(x, (0.01, 0.0358, 0.3))
    np.testing.assert_array_equal(y, (31.5, np.nan, np.nan))
    with pytest.raises(ResultsError, match=r"no column 'w' \(known: phase, v, p, phi\)"):
        read_table(files / "exact.csv", "v", "w")
    with pytest.raises(ResultsError, match="exact.csv:4: column 'phase': 'up' is not a number"):
        read_table(files / "exact.csv", "v", "phase")


# Shapes


def circle_mesh(n, closed=False):
    """n elements on a half circle, or on a whole one whose last element ends at the first node."""
    angle = np.linspace(0.0, 2.0 * np.pi if closed else np.pi, n + 1)[:n if closed else n + 1]
    elements = np.column_stack((np.arange(n), np.arange(1, n + 1) % len(angle)))
    return Mesh(np.column_stack((np.cos(angle), np.sin(angle))), elements, np.arange(len(angle)), np.arange(n)), angle


def test_directions_of_a_circle_are_exact():
    mesh, angle = circle_mesh(12)
    directions = rod_shape.stress_free_directions(mesh)
    np.testing.assert_allclose(np.cos(directions[:, 0]), np.cos(angle[:-1] + np.pi / 2), atol=1e-12)
    np.testing.assert_allclose(np.sin(directions[:, 1]), np.sin(angle[1:] + np.pi / 2), atol=1e-12)


def test_corner_stays_a_corner():
    mesh = Mesh(np.array(((0.0, 0.0), (0.0, 1.0), (1.0, 1.0))), np.array(((0, 1), (1, 2))), np.arange(3), np.arange(2))
    np.testing.assert_allclose(rod_shape.stress_free_directions(mesh), [[np.pi / 2] * 2, [0.0] * 2], atol=1e-12)


def test_elements_that_meet_head_to_head_are_smooth():
    """The second element of a straight rod runs backwards."""
    mesh = Mesh(np.array(((0.0, 0.0), (1.0, 0.0), (2.0, 0.1))), np.array(((0, 1), (2, 1))), np.arange(3), np.arange(2))
    first, second = rod_shape.stress_free_directions(mesh)
    assert first[1] == pytest.approx(np.mod(second[1] + np.pi, 2 * np.pi), abs=1e-12)


def test_shape_bends_with_the_rotations():
    """A straight rod of 4 elements rolled to a half circle: cubics of 45 degrees stay on it within 1e-5."""
    s = np.linspace(0.0, 1.0, 5)
    mesh = Mesh(np.column_stack((s, 0.0 * s)), np.column_stack((np.arange(4), np.arange(1, 5))), s, s)
    r = 1.0 / np.pi
    u = np.column_stack((r * np.sin(np.pi * s) - s, r * (1.0 - np.cos(np.pi * s)), np.pi * s))
    (curve,) = rod_shape.Shape(mesh, u).curves()
    np.testing.assert_allclose(np.hypot(curve[:, 0], curve[:, 1] - r), r, rtol=1e-5)
    assert len(curve) == 4 * 32 + 1


def test_directions_of_the_file_make_a_circle_of_four_elements_and_corners_of_others():
    """The nodes alone are those of a square."""
    mesh, angle = circle_mesh(4, closed=True)
    square = np.concatenate(rod_shape.Shape(mesh).curves())
    assert np.hypot(*square.T).min() == pytest.approx(np.sqrt(0.5))
    ends = np.column_stack((angle, angle + 0.5 * np.pi)) + 0.5 * np.pi
    circle = np.concatenate(rod_shape.Shape(replace(mesh, direction=ends)).curves())
    np.testing.assert_allclose(np.hypot(*circle.T), 1.0, rtol=3e-4)


def test_contact_part_from_reactions_and_regions(files):
    """Reactions colour whole elements between pressed nodes, regions cut inside an element."""
    for name, finest in (("ring.h5", np.pi / 24), ("regions.h5", 2e-3)):
        ring = read_results(files / name)
        shape = rod_shape.Shape(ring.mesh, ring.field("displacement", LIMIT))
        (line,), spots = rod_shape.contact_curves(ring, LIMIT, shape)
        assert len(spots) == 0
        lift = ring.contact.start[LIMIT - 1, 0]
        begins = np.arctan2(-line[0, 0], line[0, 1])
        assert abs(begins - np.radians(make.RING[LIMIT - 1, 2])) <= finest, (name, lift)
        np.testing.assert_allclose(line[-1], (0.0, -1.0), atol=1e-6)


def test_point_contact_is_a_spot(files):
    column = read_results(files / "column.h5")
    lines, spots = rod_shape.contact_curves(column, 12, rod_shape.Shape(column.mesh))
    assert lines == [] and spots.shape == (1, 2)
    assert spots[0, 0] == pytest.approx(column.contact.start[11, 0], abs=1e-12)


@pytest.mark.parametrize("end", [0.5, 0.5 + 80 * np.sin(np.pi / 40)])
def test_region_over_the_seam_of_a_closed_ring(end):
    mesh, _ = circle_mesh(40, closed=True)
    one = np.array([[1.0]])
    shape = rod_shape.Shape(mesh)
    contact = one_region(mesh, start=5.5 * one, end=end * one)
    pieces, spots = rod_shape._from_regions(contact, 1, 1, shape)
    assert spots == []
    length = sum(b - a for _, a, b in pieces) * 2 * np.sin(np.pi / 40)
    assert length == pytest.approx(80 * np.sin(np.pi / 40) - 5.0, abs=1e-9)     # perimeter of the polygon - 5.5 + 0.5


def one_region(mesh, start, end):
    n = len(mesh.coordinates)
    nan = np.full_like(start, np.nan)
    return Contact(np.array([1]), start, end, nan, nan, np.array([[1]]), np.ones((1, 1)), np.arange(n),
                   np.ones(n, dtype=int), np.arange(n) * 2 * np.sin(np.pi / n), np.array([2 * n * np.sin(np.pi / n)]), ("nodes",))


def test_stability_changes_at_the_limit_point(files):
    """The located limit point has a negative pivot already; the part that ends there is stable all the same."""
    stable, unstable = path_curves.stretches(read_results(files / "ring.h5"), breaks=True)
    assert stable[1] and stable[0].tolist() == list(range(0, LIMIT))
    assert not unstable[1] and unstable[0].tolist() == list(range(LIMIT - 1, 15))


# The pictures


PICTURES = [
    ("path", ["ring.h5"]),
    ("path", ["ring.h5", "killed.h5", "--name", "whole", "--x", "H", "--y", "v", "--x-scale", "-2", "--values"]),
    ("path", ["ring.h5", "--reference", "exact.csv", "--ref-x", "v", "--ref-y", "p", "--ref-name", "exact"]),
    ("path", ["column.h5", "--mark", "all", "--points", "--x-label", "$y/d$", "--title", "a path"]),
    ("path", ["cantilever.h5"]),
    ("path", ["ring.h5", "--x", "point", "--y", "residual", "--x-range", "1", "5"]),
    ("contact", ["ring.h5"]),
    ("contact", ["ring.h5", "--end", "start", "--reference", "exact.csv", "--ref-x", "p", "--ref-y", "phi"]),
    ("contact", ["column.h5", "--against", "point", "--mark", "none"]),
    ("contact", ["ring.h5", "killed.h5", "--quantity", "arc", "--against", "v", "--contact", "1"]),
    ("contact", ["ring.h5", "column.h5"]),
    ("shape", ["ring.h5"]),
    ("shape", ["ring.h5", "--label", "LP", "--mirror", "x=0", "--caption", "v", "--no-axes"]),
    ("shape", ["ring.h5", "killed.h5", "--rows", "1,5,-1", "--width", "180", "--title", "two rings"]),
    ("shape", ["column.h5", "--evenly", "4", "--stretch-y", "10", "--no-stress-free"]),
    ("shape", ["column.h5", "--scale", "2", "--height", "60"]),
]


@pytest.mark.parametrize("name, arguments", PICTURES)
def test_picture(files, tmp_path, capsys, name, arguments):
    arguments = [str(files / a) if a.endswith((".h5", ".csv")) else a for a in arguments]
    output = tmp_path / "picture.png"
    assert draw(name, *arguments, "-o", output) == 0
    width, height = png_size(output)
    assert 1000 <= width <= 2200 and 200 <= height <= 2500
    assert 0.005 < drawn_share(output) < 0.5
    printed = capsys.readouterr()
    assert printed.out.startswith(f"wrote {output}") and printed.err == ""


@pytest.mark.parametrize("name, kind, start", [("path", "pdf", b"%PDF"), ("shape", "pdf", b"%PDF"), ("contact", "svg", b"<?xml"),
                                               ("reaction", "svg", b"<?xml")])
def test_vector_formats_repeat_byte_for_byte(files, tmp_path, name, kind, start):
    first, second = tmp_path / f"a.{kind}", tmp_path / "b.picture"
    assert draw(name, files / "ring.h5", "-o", first) == 0
    assert draw(name, files / "ring.h5", "-o", second, "--format", kind) == 0
    assert first.read_bytes().startswith(start) and first.read_bytes() == second.read_bytes()


def test_size_in_millimetres(files, tmp_path):
    size = ["--width", 127, "--height", 50.8, "--dpi", 100]
    assert draw("path", files / "ring.h5", "-o", tmp_path / "a.png", *size) == 0
    assert png_size(tmp_path / "a.png") == pytest.approx((500, 200), abs=1)     # whole pixels


def test_shapes_have_equal_scales(files, axes_of):
    ratios = []
    for arguments in ((files / "ring.h5",), (files / "column.h5", "--stretch-y", 10)):
        for axes in axes_of("shape", *arguments):
            box, x, y = axes.get_window_extent(), axes.get_xlim(), axes.get_ylim()
            ratios.append((box.height / (y[1] - y[0])) / (box.width / (x[1] - x[0])))
    assert ratios == pytest.approx([1.0, 10.0], rel=1e-6)


@pytest.mark.parametrize("obstacle, depth", [
    (Obstacle("wall", "line", "left", np.array(((1.0, 0.1), (0.0, 0.1))), None, None, 0.0, "rigid", 0.0),
     lambda tips: tips[:, 1] - 0.1),
    (Obstacle("cavity", "circle", "inside", None, np.zeros(2), 1.0, 90.0, "rigid", 0.0),
     lambda tips: np.hypot(*tips.T) - 1.0),
    (Obstacle("drum", "circle", "outside", None, np.array((0.0, -50.0)), 50.0, 0.0, "rigid", 0.0),
     lambda tips: 50.0 - np.hypot(tips[:, 0], tips[:, 1] + 50.0)),
    (Obstacle("ceiling", "spline", "left", None, None, None, 0.0, "rigid", 0.0,
              surface=np.array(((0.5, 0.1), (0.0, 0.1), (-0.2, 0.1)))), lambda tips: tips[:, 1] - 0.1)])
def test_hatching_is_on_the_solid_side(obstacle, depth):
    """The free side of a line is on its left; strokes are 1/50 of the picture deep (the arc bends away a little)."""
    figure, axes = empty_axes()
    draw_obstacle(axes, obstacle, np.array(((-1.0, -1.0), (1.0, 1.0))), 1.0)
    strokes = np.array(axes.collections[0].get_segments())
    np.testing.assert_allclose(depth(strokes[:, 0]), 0.0, atol=1e-4)
    np.testing.assert_allclose(depth(strokes[:, 1]), 0.04, rtol=0.03)


def test_list_of_quantities(files, capsys):
    assert draw("path", files / "ring.h5", "--list") == 0
    listed = capsys.readouterr().out
    assert "ring.h5: 15 points, complete" in listed and "apex, downwards" in listed and "negative_pivots" in listed


def test_unfinished_run_is_told(files, tmp_path, capsys):
    assert draw("path", files / "column.h5", "-o", tmp_path / "a.png") == 0
    assert "41 points, status: stopped: smallest increment reached" in capsys.readouterr().out


ERRORS = [
    ("path", [], "the following arguments are required: RESULTS"),
    ("path", ["none.h5"], "none.h5: no such file"),
    ("path", ["exact.csv"], "exact.csv: not an HDF5 file"),
    ("path", ["ring.h5", "--x", "w"], "no path quantity or monitor 'w'"),
    ("path", ["ring.h5", "--y", "label"], "'label' is text, not numbers"),
    ("path", ["ring.h5", "--mark", "LQ"], "unknown label LQ"),
    ("path", ["ring.h5", "--reference", "exact.csv"], "--reference needs --ref-x and --ref-y"),
    ("path", ["ring.h5", "--ref-x", "v"], "--ref-x and --ref-y need --reference"),
    ("path", ["ring.h5", "--reference", "exact.csv", "--ref-x", "v", "--ref-y", "q"], "no column 'q'"),
    ("path", ["ring.h5", "--reference", "none.csv", "--ref-x", "v", "--ref-y", "p"], "none.csv: cannot be read"),
    ("path", ["ring.h5", "-o", "picture.bmp"], "must end in .png, .pdf or .svg"),
    ("path", ["ring.h5", "-o", "nowhere/picture.png"], "cannot be written: No such file or directory"),
    ("path", ["ring.h5", "--width", "-1"], "-1 is not a positive number"),
    ("path", ["ring.h5", "--x-label", "$\\frac{$"], "not well-formed"),
    ("contact", ["cantilever.h5"], "the model has no contact"),
    ("contact", ["column.h5", "--quantity", "angle"], "the obstacle has no centre (use --quantity arc)"),
    ("contact", ["ring.h5", "--contact", "2"], "no contact 2 (they run from 1 to 1)"),
    ("shape", ["cantilever.h5"], "no displacements are stored"),
    ("shape", ["ring.h5", "--rows", "16"], "no point 16 (they run from 1 to 15)"),
    ("shape", ["killed.h5", "--rows", "4"], "no fields are stored at point 4 (nearest: 3, 5)"),
    ("shape", ["killed.h5", "--label", "LP"], "label LP: no displacements are stored there"),
    ("shape", ["ring.h5", "--label", "BP"], "label BP: no such point"),
    ("shape", ["ring.h5", "--rows", "1,x"], "'1,x' is not a list of point numbers"),
    ("shape", ["ring.h5", "--mirror", "z=0"], "'z=0' is not a line such as x=0"),
    ("shape", ["ring.h5", "--height", "10"], "no room for the shapes"),
]


@pytest.mark.parametrize("name, arguments, message", ERRORS)
def test_wrong_input_is_one_line(files, monkeypatch, capsys, name, arguments, message):
    monkeypatch.chdir(files)
    before = sorted(os.listdir(files))
    assert draw(name, *arguments) == 2
    printed = capsys.readouterr()
    assert printed.out == "" and message in printed.err
    assert printed.err.endswith("\n") and printed.err.count("\n") == 1
    assert sorted(os.listdir(files)) == before


@pytest.mark.parametrize("name", COMMANDS)
def test_command_line(files, tmp_path, name):
    """By itself, with no display: help, a picture in the current folder, an error."""
    helped = module_run(tmp_path, "unilat", name, "--help")
    assert helped.returncode == 0 and "examples:" in helped.stdout and f"unilat-plot {name} ring.h5" in helped.stdout
    drawn = command_line(tmp_path, name, files / "ring.h5")
    assert (drawn.returncode, drawn.stdout, drawn.stderr) == (0, f"wrote ring-{name}.png\n", "")
    assert png_size(tmp_path / f"ring-{name}.png")[0] > 1000
    wrong = module_run(tmp_path, "unilat", name, "none.h5")
    assert (wrong.returncode, wrong.stderr) == (2, f"unilat-plot {name}: error: none.h5: no such file; a run writes it: unilat DECK.inp "
                                                     "-o none.h5\n")


# Curves that are told apart


def test_twenty_curves_look_different(files, axes_of):
    """Ten colours, then the same as hollow lines, solid or dashed as before."""
    (axes,) = axes_of("path", *[files / "ring.h5"] * 12)
    seen = [(line.get_color(), len(line.get_path_effects()), line.get_linestyle()) for line in axes.get_lines()
            if line.get_linestyle() != "None"]
    assert len(seen) == 24 and len(set(seen)) == 24 and {dashes for _, _, dashes in seen} == {"-", "--"}
    handles = axes.get_legend().get_lines()[:12]
    assert len({(line.get_color(), len(line.get_path_effects())) for line in handles}) == 12
    assert len(set(style.COLOURS)) == 10


def test_labels_of_marks_close_together_do_not_overlap():
    figure, axes = empty_axes(width=88.9, height=71.1, dpi=200)
    x = np.linspace(0.0, 1.0, 50)
    axes.plot(x, 1.0 - x ** 2)
    marks = [(0.1, 0.99), (0.11, 0.97), (0.12, 0.96), (0.13, 0.93)]
    place_labels(axes, [(*mark, f"LP {k}.2345", "k") for k, mark in enumerate(marks)])
    written = [text for text in axes.texts if text.get_text()]
    boxes = [text.get_window_extent(figure.canvas.get_renderer()) for text in written]
    assert sorted(text.xy for text in written) == marks
    assert not any(a.overlaps(b) for k, a in enumerate(boxes) for b in boxes[:k])
    assert all(axes.get_window_extent().contains(*corner) for box in boxes for corner in box.corners())
    joined = [text for text in axes.texts if not text.get_text()]
    assert joined and all(line.xy in marks for line in joined)


def test_labels_are_beside_wide_lines():
    """A label below a mark on a line 20 points wide is at least as far away as the line's edge."""
    figure, axes = empty_axes(width=88.9, height=71.1, dpi=200)
    axes.plot((0.0, 1.0), (0.5, 0.5), linewidth=20.0)
    place_labels(axes, [(0.5, 0.5, "LP 1.2345", "k")])
    box = axes.texts[0].get_window_extent(figure.canvas.get_renderer())
    middle = axes.transData.transform((0.5, 0.5))[1]
    assert min(abs(box.y0 - middle), abs(box.y1 - middle)) > 10.0 * figure.dpi / 72.0


def test_a_value_on_a_line_moves_beside_it():
    figure, axes = empty_axes(width=88.9, height=71.1, dpi=200)
    axes.set_xlim(0.0, 1.0)
    axes.set_ylim(0.0, 1.0)
    axes.plot((0.0, 1.0), (0.5, 0.5))
    write(axes, np.array((0.6, 0.5)), np.array((0.4, 0.5)), 9.87, "k", 6.5)
    write(axes, np.array((0.6, 0.8)), np.array((0.4, 0.8)), 9.87, "k", 6.5)
    figure.canvas.draw()
    stays = axes.texts[1].get_window_extent().bounds
    uncover(axes)
    box = axes.texts[0].get_window_extent(figure.canvas.get_renderer())
    assert not box.y0 < axes.transData.transform((0.0, 0.5))[1] < box.y1
    assert axes.texts[1].get_window_extent(figure.canvas.get_renderer()).bounds == stays


def test_labels_of_one_place_stand_in_one_row():
    """And those of another colour, as of another curve, by themselves."""
    _, axes = empty_axes(width=88.9, height=71.1, dpi=200)
    axes.plot((0.0, 1.0), (0.0, 1.0))
    place_labels(axes, [(0.5, 0.5, "C+", "k"), (0.5, 0.5, "C-", "k"), (0.5, 0.5, "LP", "r"), (0.52, 0.52, "C+", "k")])
    assert sorted(text.get_text() for text in axes.texts if text.get_text()) == ["C+ (2), C-", "LP"]


def test_numbers_at_axes_are_text_with_a_power_of_ten():
    figure, axes = empty_axes(width=88.9, height=71.1, dpi=200)
    axes.plot((0.0, 1.0), (-2e-6, 2e-6))
    style.lay_out(figure)
    figure.canvas.draw()
    assert "\N{MINUS SIGN}2" in [text.get_text().removesuffix(".0") for text in axes.get_yticklabels()]
    assert "10^{" in axes.yaxis.get_offset_text().get_text()


def test_a_label_is_nearest_to_its_own_mark():
    """The first mark's best place by itself, on its right, is just above the second one."""
    figure, axes = empty_axes(width=88.9, height=71.1, dpi=200)
    axes.set_xlim(0.0, 1.0)
    axes.set_ylim(0.0, 1.0)
    marks = [(0.5, 0.55), (0.56, 0.5)]
    place_labels(axes, [(*mark, f"BP {k}.2345", "k") for k, mark in enumerate(marks)])
    for text in axes.texts:
        box, at = text.get_window_extent(figure.canvas.get_renderer()), axes.transData.transform(marks)
        away = np.hypot(*np.maximum(np.maximum(box.min - at, at - box.max), 0.0).T)
        assert marks[int(np.argmin(away))] == text.xy


# What annoyed in pictures of shapes


def test_nothing_of_a_slender_picture_is_cut_off(files, tmp_path, axes_of):
    """Heights of 1e-5: a power of ten above the axis, an axis label that is longer than the axis."""
    name = tmp_path / "flat.h5"
    name.write_bytes((files / "column.h5").read_bytes())
    with h5py.File(name, "a") as file:
        file["fields/displacement"][...] *= 1e-3
        file["obstacles/wall"].attrs["points"] = np.array(((1.0, 2e-5), (0.0, 2e-5)))
    for stretch in (1, 2000):
        axes = axes_of("shape", name, "--stretch-y", stretch)[0]
        figure = axes.figure
        figure.canvas.draw()
        around = axes.get_tightbbox(figure.canvas.get_renderer())
        assert around.y1 <= figure.bbox.y1 and around.y0 >= 0.0 and around.x0 >= 0.0
        assert sum(axes.get_ylim()[0] <= tick <= axes.get_ylim()[1] for tick in axes.get_yticks()) >= 2
    assert axes.yaxis.get_offset_text().get_text() != ""


def test_only_the_last_place_of_a_moving_obstacle_is_hatched(files, tmp_path, axes_of):
    name = tmp_path / "moving.h5"
    name.write_bytes((files / "column.h5").read_bytes())
    with h5py.File(name, "a") as file:
        file["obstacles/wall"].attrs["number"] = 1
        make.put(file, "contact/obstacle_shift", np.linspace(0.0, -0.01, 41)[:, None, None] * np.array((0.0, 1.0)), "length")
    axes = axes_of("shape", name, "--rows", "1,21,41", "--stretch-y", 10)[0]
    (strokes,) = axes.collections
    np.testing.assert_allclose([stroke[0, 1] for stroke in strokes.get_segments()], 0.01)
    assert [line.get_ydata()[0] for line in axes.get_lines()[:3]] == pytest.approx([0.02, 0.015, 0.01])


def test_contact_without_force_is_not_coloured(files, tmp_path):
    name = tmp_path / "rest.h5"
    name.write_bytes((files / "regions.h5").read_bytes())
    with h5py.File(name, "a") as file:
        file["contact/reaction_total"][0] = 1e-9
    ring = read_results(name)
    shape = rod_shape.Shape(ring.mesh)
    assert rod_shape.contact_curves(ring, 1, shape)[0] == []
    assert len(rod_shape.contact_curves(ring, 2, shape)[0]) == 1


def test_distributed_contact_is_coloured_to_its_end(files, tmp_path):
    """The reactions are shares of the nodes there; the region ends inside an element."""
    make.write_ring(tmp_path / "soft.h5", points="distributed")
    ring = read_results(tmp_path / "soft.h5")
    ((line,), spots) = rod_shape.contact_curves(ring, LIMIT, rod_shape.Shape(ring.mesh, ring.field("displacement", LIMIT)))
    assert np.degrees(np.arctan2(-line[0, 0], line[0, 1])) == pytest.approx(make.RING[LIMIT - 1, 2], abs=0.1)

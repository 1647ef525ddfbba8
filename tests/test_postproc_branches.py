"""postproc: branches, buckling modes and limit curves; what is drawn is looked at line by line."""

from __future__ import annotations

import argparse
import shutil
import sys
from pathlib import Path

import h5py
import matplotlib
import numpy as np
import pytest

TESTS = Path(__file__).resolve().parent
POSTPROC = TESTS.parent / "postproc"
sys.path[:0] = [str(TESTS), str(POSTPROC)]

import make_branch_file as make  # noqa: E402
import make_result_file  # noqa: E402
from postproc_runner import axes_of as pictures, command_line, draw, module_run  # noqa: E402,F401
from unilat.plot import modes, style  # noqa: E402
from unilat.results import ResultsError, read_results  # noqa: E402


@pytest.fixture(scope="module")
def rod(tmp_path_factory):
    name = tmp_path_factory.mktemp("results") / "rod.h5"
    make.write_branched(name)
    return name


@pytest.fixture
def axes_of(rod, pictures):
    """The axes of a picture of the rod."""
    return lambda name, *arguments: pictures(name, rod, *arguments)


def curves(axes, dashed):
    """The (x, y) of all curves that are (not) dashed; markers are left out."""
    lines = [line for line in axes.get_lines() if line.get_linestyle() != "None" and len(line.get_xdata()) > 1]
    return [np.column_stack(line.get_data()) for line in lines if (line.get_linestyle() == "--") == dashed]


def markers(axes):
    """Where which markers are: (marker, filled) -> points."""
    found = {}
    for line in axes.get_lines():
        if line.get_linestyle() == "None":
            key = (line.get_marker(), line.get_markerfacecolor() != "white")
            found.setdefault(key, []).append(tuple(float(v[0]) for v in line.get_data()))
    return found


def texts(axes):
    return {text.get_text(): text.xy for text in axes.texts if text.get_text()}      # without lines to their points


def has_curve(group, points):
    """Whether a curve goes from the first of these points through all of them to the last."""
    points = np.asarray(points)
    return any(np.allclose(curve[[0, -1]], points[[0, -1]])
               and all(np.any(np.all(np.isclose(curve, point), axis=1)) for point in points) for curve in group)


# The reader


def test_branches(rod):
    results = read_results(rod)
    assert list(results.branches) == [1, 2, 3]
    bow = results.branches[2]
    assert (bow.number, bow.name, bow.step, bow.of, bow.bifurcation, bow.mode, bow.side, bow.point) == (
        2, "bow", 2, 0, 1, 1, -1, 3)
    np.testing.assert_array_equal(bow.column("mid").values, -make.BENT)
    np.testing.assert_array_equal(results.column("load_factor").values, make.STRAIGHT)
    assert bow.critical[0].label == "TP" and bow.n_points == 4 and results.branches[3].of == 2
    np.testing.assert_allclose(bow.field("displacement", 4), -0.3 * make.mode(1))
    np.testing.assert_array_equal(results.field("displacement", 4), 0.0)
    assert results.path_number(0) is results and results.path_number(3) is results.branches[3]
    with pytest.raises(ResultsError, match=r"no branch 4 \(it has 1, 2, 3\)"):
        results.path_number(4)


def test_null_vectors(rod):
    results = read_results(rod)
    assert [(c.label, c.multiplicity, c.row) for c in results.critical] == [("BP", 1, 1), ("BP", 0, 2), ("EP", 0, 3)]
    np.testing.assert_array_equal(results.null_vectors(results.critical[0]), [make.mode(1)])
    with pytest.raises(ResultsError, match="no null vectors are stored for BP at point 6"):
        results.null_vectors(results.critical[1])


def test_buckling(rod):
    (buckle,) = read_results(rod).buckling.values()
    assert (buckle.name, buckle.step, buckle.mode.shape) == ("buckle", 1, (3, 21, 3))
    np.testing.assert_allclose(buckle.load_factor / np.pi ** 2, (1.0, 4.0, 9.0))


def test_limit_curves(rod):
    curves_in_file = read_results(rod).limit_curves
    soil = curves_in_file["soil"]
    assert set(curves_in_file) == {"soil", "dead"}
    assert (soil.parameter, soil.of, soil.step, soil.limit_point, soil.n_points) == ("MODULUS", "ground", 2, 1, 6)
    np.testing.assert_array_equal(soil.column("load_factor").values, make.LIMIT_LOAD)
    assert soil.rigid.tolist() == [False] * 5 + [True] and soil.column("MID").units == "length"
    with pytest.raises(ResultsError, match="no quantity of limit curves or monitor 'midd'.*mean mid"):
        soil.column("midd")


def test_killed_run(rod, tmp_path):
    """A branch and a curve that lack a row somewhere are cut by themselves; a branch without its groups is left out."""
    name = tmp_path / "killed.h5"
    shutil.copy(rod, name)
    with h5py.File(name, "a") as file:
        for short in ("branch/2/path/label", "limit_curve/soil/residual"):
            values = file[short][:-1]
            del file[short]
            file[short] = values
        file.create_group("branch/4")
    results = read_results(name)
    assert [results.n_points, results.branches[1].n_points, results.branches[2].n_points] == [7, 4, 3]
    assert results.branches[2].field_points.tolist() == [1, 2, 3]
    assert results.limit_curves["soil"].n_points == 5 and list(results.branches) == [1, 2, 3]


# Bifurcation diagrams


def test_stable_parts_are_solid_and_unstable_ones_dashed(axes_of):
    (axes,) = axes_of("path", "--x", "mid")
    solid, dashed = curves(axes, False), curves(axes, True)
    zero = np.zeros(7)
    assert has_curve(solid, np.column_stack((zero[:3], make.STRAIGHT[:3])))
    assert has_curve(dashed, np.column_stack((zero[2:], make.STRAIGHT[2:])))
    for side in (1.0, -1.0):
        w = side * make.BENT
        assert has_curve(solid, np.column_stack(((0.0, *w), (np.pi ** 2, *make.bent_load(w)))))     # from the bifurcation
    w = make.BENT[:3] - 0.25
    assert has_curve(dashed, np.column_stack(((-0.2, *w), (make.bent_load(0.2), *(8.0 + 4.0 * w)))))    # from point 3 of branch 2
    assert len(solid) == 3 and len(dashed) == 2


def test_special_points_are_marked(axes_of):
    (axes,) = axes_of("path", "--x", "mid")
    found = markers(axes)
    assert found.pop(("D", True)) == [(0.0, pytest.approx(np.pi ** 2))]
    assert found.pop(("D", False)) == [(0.0, pytest.approx(4.0 * np.pi ** 2))]           # bracketed: hollow
    assert found.pop(("p", True)) == [(w, pytest.approx(make.bent_load(0.2))) for w in (0.2, -0.2)]
    assert found.pop(("o", True)) == [(pytest.approx(-0.15), pytest.approx(7.4))]
    assert found == {}
    assert set(texts(axes)) == {"BP 9.8696", "BP 39.478", "LP 7.4", "TP"}
    assert texts(axes)["BP 39.478"] == (0.0, pytest.approx(4.0 * np.pi ** 2))


def test_loads_at_marks_have_the_scale_of_their_axis(axes_of):
    (axes,) = axes_of("path", "--x", "end", "--y", "mid", "--mark", "BP")
    assert set(texts(axes)) == {"BP 9.8696", "BP 39.478"}
    (axes,) = axes_of("path", "--x", "mid", "--y-scale", "0.5", "--mark", "BP")
    assert set(texts(axes)) == {"BP 4.9348", "BP 19.739"}
    (axes,) = axes_of("path", "--x", "mid", "--values", "--mark", "TP")
    assert set(texts(axes)) == {f"TP {make.bent_load(0.2):.5g}"}


def test_legend_of_a_bifurcation_diagram(axes_of):
    (axes,) = axes_of("path", "--x", "mid")
    colours = {text.get_text(): line.get_color()
               for text, line in zip(axes.get_legend().get_texts(), axes.get_legend().get_lines())}
    assert list(colours) == ["main path", "bow", "off", "unstable"]
    assert len({colours["main path"], colours["bow"], colours["off"]}) == 3
    drawn = {line.get_color() for line in axes.get_lines() if np.isclose(np.abs(line.get_xdata()[-1]), make.BENT[-1])}
    assert drawn == {colours["bow"]}


def test_main_path_alone(axes_of):
    (axes,) = axes_of("path", "--x", "mid", "--branches", "none")
    assert len(curves(axes, False)) == 1 and len(curves(axes, True)) == 1
    assert set(texts(axes)) == {"BP 9.8696", "BP 39.478"}
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["stable", "unstable"]


def test_branches_are_listed(rod, capsys):
    assert draw("path", rod, "--list") == 0
    listed = capsys.readouterr().out
    assert "bow, minus: 4 points from point 3 of the path" in listed
    assert "off, plus: 3 points from point 3 of branch 2" in listed


# Shapes of a branch


def test_shapes_of_a_branch(axes_of):
    (axes,) = axes_of("shape", "--branch", "2", "--label", "TP", "--no-stress-free")
    (line,) = axes.get_lines()
    assert line.get_ydata().min() == pytest.approx(-0.2, rel=1e-6)
    (axes,) = axes_of("shape", "--label", "BP", "--no-stress-free")
    assert all(np.all(line.get_ydata() == 0.0) for line in axes.get_lines())


# Limit curves


def passes_through(line, points):
    """Whether every point is one of the line's."""
    curve = np.column_stack(line.get_data())
    return all(np.any(np.all(np.isclose(curve, point), axis=1)) for point in points)


def test_limit_curve(axes_of):
    (axes,) = axes_of("curve")
    (curve, rigid) = [line for line in axes.get_lines() if line.get_linestyle() != "None"]
    assert passes_through(curve, np.column_stack((make.MODULUS[:5], make.LIMIT_LOAD[:5])))
    x, y = np.log(curve.get_xdata()), curve.get_ydata()
    turns = np.diff(np.unwrap(np.arctan2(np.diff(y) / np.ptp(y), np.diff(x) / np.ptp(x))))
    assert len(x) > 30 and np.max(np.abs(turns)) < np.radians(20.0)      # no corners
    assert list(rigid.get_ydata()) == [80.0, 80.0] and rigid.get_linestyle() != "-"
    assert list(rigid.get_xdata()) == [0.0, 1.0]                                         # of the picture's width
    assert axes.get_xscale() == "log" and axes.get_yscale() == "linear"
    assert axes.get_xlabel() == "foundation modulus of ground (force / length$^2$)"
    assert texts(axes) == {"TP": (1e4, 70.0)}
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["rod", "rigid"]


def test_limit_curve_of_few_decades_is_linear(axes_of):
    (axes,) = axes_of("curve", "--curve", "dead")
    assert axes.get_xscale() == "linear" and axes.get_xlabel() == "factor on the constant loads"
    assert set(axes.get_lines()[0].get_xdata()) >= {1.0, 0.5, 0.0}
    assert axes.get_legend() is None
    (axes,) = axes_of("curve", "--curve", "SOIL", "--axis", "linear", "--x-scale", "0.5")
    assert axes.get_xscale() == "linear"
    assert passes_through(axes.get_lines()[0], np.column_stack((0.5 * make.MODULUS[:5], make.LIMIT_LOAD[:5])))


@pytest.mark.parametrize("top, scale", [(0.99e4, "linear"), (1.01e4, "log")])
def test_two_decades_are_the_limit(rod, tmp_path, monkeypatch, top, scale):
    name = tmp_path / "two.h5"
    shutil.copy(rod, name)
    with h5py.File(name, "a") as file:
        file["limit_curve/soil/parameter"][:5] = np.linspace(100.0, top, 5)
    seen = []
    monkeypatch.setattr(style, "save", lambda figure, *_: seen.extend(figure.axes) or 0)
    assert draw("curve", name) == 0
    assert seen[0].get_xscale() == scale


def test_limit_curve_with_reference(axes_of, tmp_path):
    table = tmp_path / "exact.csv"
    table.write_text("# made up\nk,p\n100,60.5\n1e5,78\n")
    (axes,) = axes_of("curve", "--reference", table, "--ref-x", "k", "--ref-y", "p", "--ref-name", "exact",
                      "--ref-y-scale", "2")
    assert markers(axes)[("o", False)] == [(100.0, 121.0)]     # the first of its points
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["rod", "rigid", "exact"]


def test_limit_curves_are_listed(rod, capsys):
    assert draw("curve", rod, "--list") == 0
    assert "soil                 MODULUS of ground: 6 points, limit point 1 of step 2" in capsys.readouterr().out


# Buckling modes


def test_modes(axes_of):
    panels = axes_of("modes")
    assert [axes.get_title() for axes in panels] == ["mode 1:  9.8696", "mode 2:  39.478", "mode 3:  88.826"]
    for number, axes in enumerate(panels, start=1):
        straight, shape = axes.get_lines()
        np.testing.assert_array_equal(straight.get_ydata(), 0.0)
        x, y = shape.get_data()
        np.testing.assert_allclose(y, 0.15 * np.sin(number * np.pi * x), atol=2e-4)
        box, (left, right), (bottom, top) = axes.get_window_extent(), axes.get_xlim(), axes.get_ylim()
        assert (box.height / (top - bottom)) / (box.width / (right - left)) == pytest.approx(1.0, rel=1e-6)


def test_modes_chosen(axes_of):
    (axes,) = axes_of("modes", "--modes", "2", "--amplitude", "-0.05", "--both", "--load-scale", "0.1")
    assert axes.get_title() == "mode 2:  3.9478"
    _, shape, opposite = axes.get_lines()
    x, y = shape.get_data()
    np.testing.assert_allclose(y, -0.05 * np.sin(2.0 * np.pi * x), atol=2e-4)
    np.testing.assert_allclose(opposite.get_ydata(), -y)


def test_panels_of_a_tall_structure_are_no_taller_than_a_page_and_as_far_apart_as_their_titles():
    limits = np.array(((0.0, 0.0), (0.1, 1.0)))
    with matplotlib.rc_context(style.LOOK):
        figure, panels = modes.layout(argparse.Namespace(width=89.0, height=None, dpi=100, columns=None, title=None), limits, 2)
    assert figure.get_size_inches()[1] * 25.4 < modes.TALLEST + 15.0
    left, right = (panel.get_position() for panel in panels)
    assert (right.x0 - left.x0) * 89.0 > modes.TITLED


# Pictures and errors


@pytest.mark.parametrize("name, arguments", [
    ("path", ["--x", "mid"]), ("path", ["--points", "--mark", "all"]), ("shape", ["--branch", "1"]),
    ("curve", []), ("curve", ["--curve", "dead", "--y", "mid", "--points"]), ("modes", []),
    ("modes", ["--columns", "3", "--width", "180", "--height", "60", "--title", "modes"])])
def test_picture(rod, tmp_path, name, arguments):
    assert draw(name, rod, *arguments, "-o", tmp_path / "c.png") == 0
    assert (tmp_path / "c.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("name, arguments", [("path", ["--points", "--mark", "all"]), ("shape", ["--branch", "1"]), ("curve", []),
                                             ("modes", [])])
def test_pictures_repeat_byte_for_byte(rod, tmp_path, name, arguments):
    first, second = tmp_path / "a.svg", tmp_path / "b.svg"
    for output in (first, second):
        assert draw(name, rod, *arguments, "-o", output) == 0
    assert first.read_bytes().startswith(b"<?xml") and first.read_bytes() == second.read_bytes()


@pytest.mark.parametrize("name, arguments, message", [
    ("path", ["rod.h5", "--branches", "2"], "invalid choice: '2'"),
    ("shape", ["rod.h5", "--branch", "4"], "no branch 4 (it has 1, 2, 3)"),
    ("shape", ["ring.h5", "--branch", "1"], "no branch 1 (it has none)"),
    ("shape", ["rod.h5", "--branch", "0"], "'0' is not the number of a branch"),
    ("curve", ["ring.h5"], "holds no limit curves (*LIMIT CURVE)"),
    ("curve", ["rod.h5", "--curve", "sail"], "no limit curve 'sail' (known: "),
    ("curve", ["rod.h5", "--curve", "soil", "--curve", "dead"], "the curves vary different parameters"),
    ("curve", ["rod.h5", "--curve", "dead", "--axis", "log"], "not all positive (use --axis linear)"),
    ("curve", ["rod.h5", "--y", "label"], "'label' is text, not numbers"),
    ("modes", ["ring.h5"], "holds no buckling modes (*BUCKLE)"),
    ("modes", ["rod.h5", "--step", "shake"], "no buckling step 'shake' (known: buckle)"),
    ("modes", ["rod.h5", "--modes", "1,4"], "no mode 4 (they run from 1 to 3)"),
    ("modes", ["rod.h5", "--modes", "a"], "'a' is not a list of modes"),
    ("modes", ["rod.h5", "--height", "10"], "no room for the modes")])
def test_wrong_input_is_one_line(rod, monkeypatch, capsys, name, arguments, message):
    monkeypatch.chdir(rod.parent)
    if not Path("ring.h5").exists():
        make_result_file.write_ring("ring.h5")
    assert draw(name, *arguments) == 2
    printed = capsys.readouterr()
    assert printed.out == "" and message in printed.err and printed.err.count("\n") == 1


@pytest.mark.parametrize("name", ["curve", "modes"])
def test_command_line(rod, tmp_path, name):
    helped = module_run(tmp_path, "unilat", name, "--help")
    assert helped.returncode == 0 and "examples:" in helped.stdout
    drawn = command_line(tmp_path, name, rod)
    assert (drawn.returncode, drawn.stdout, drawn.stderr) == (0, f"wrote rod-{name}.png\n", "")

"""postproc: tables, CSV, ParaView files read back, the page with a slider, films; and what is said when a package is missing."""

from __future__ import annotations

import csv
import importlib
import io
import json
import re
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

sys.path[:0] = [str(Path(__file__).resolve().parent)]

import make_branch_file  # noqa: E402
import make_result_file as make  # noqa: E402
from postproc_runner import POSTPROC, command_line, draw  # noqa: E402
from unilat import tables  # noqa: E402
from unilat.results import ResultsError, read_results  # noqa: E402
from unilat.results.rod_shape import Shape  # noqa: E402

LIMIT = 6
ALL = ("displacement", "section_forces", "reaction", "reaction_density", "gap", "contact_point")


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("results")
    make.write_ring(folder / "ring.h5", fields=ALL)
    make.write_ring(folder / "killed.h5", status="running", critical=False, every=2,
                    shorter=("path/monitor/H", "fields/displacement"))
    make.write_column(folder / "column.h5")
    make.write_cantilever(folder / "cantilever.h5")
    make_branch_file.write_branched(folder / "rod.h5")
    with h5py.File(folder / "ring.h5", "a") as file:      # something that differs from row to row
        forces = file["fields/section_forces"]
        forces[...] = np.arange(forces.size, dtype=float).reshape(forces.shape)
    return folder


def columns(results, name, branch=0):
    return {column.name: column.values for column in tables.table(results, name, branch)}


# Tables


def test_the_path_as_a_table(files):
    ring = read_results(files / "ring.h5")
    path = columns(ring, "path")
    assert list(path)[:6] == ["point", "step", "label", "load_factor", "arc_length", "v"]
    np.testing.assert_array_equal(path["point"], np.arange(1, 16))
    np.testing.assert_array_equal(path["load_factor"], make.RING[:, 1])
    np.testing.assert_array_equal(path["v"], make.RING[:, 0])


def test_fields_as_tables_have_a_row_an_item_and_point(files):
    ring = read_results(files / "ring.h5")
    nodes, forces, candidates = (columns(ring, name) for name in ("displacement", "forces", "candidates"))
    at = (nodes["point"] == LIMIT) & (nodes["node"] == 105)
    np.testing.assert_array_equal([nodes[name][at][0] for name in ("u", "v", "rotation")], ring.field("displacement", LIMIT)[4])
    at = (forces["point"] == LIMIT) & (forces["element"] == 3)
    assert forces["node"][at].tolist() == [103, 104]
    np.testing.assert_array_equal(np.column_stack([forces[name][at] for name in "NQM"]), ring.field("section_forces", LIMIT)[2])
    at = candidates["point"] == LIMIT
    np.testing.assert_array_equal(candidates["reaction"][at], ring.field("reaction", LIMIT))
    np.testing.assert_array_equal(candidates["gap"][at], ring.field("gap", LIMIT))


def test_a_field_of_some_points_only_is_nan_elsewhere(files, tmp_path):
    name = tmp_path / "steps.h5"
    name.write_bytes((files / "ring.h5").read_bytes())
    with h5py.File(name, "a") as file:
        file["fields/gap"][:3] = np.nan
    found = columns(read_results(name), "candidates")
    assert np.all(np.isnan(found["gap"][found["point"] <= 3])) and np.all(np.isfinite(found["gap"][found["point"] > 3]))
    assert np.all(np.isfinite(found["reaction"]))


def test_critical_points_contact_modes_and_curves_as_tables(files):
    ring, rod = read_results(files / "ring.h5"), read_results(files / "rod.h5")
    assert columns(ring, "critical")["label"].tolist() == ["LP", "EP"]
    contact = columns(ring, "contact")
    assert len(contact["point"]) == 15
    np.testing.assert_array_equal(contact["angle_start"], make.RING[:, 2])
    modes = columns(rod, "modes")
    step = next(iter(rod.buckling.values()))
    assert len(modes["mode"]) == len(step.load_factor) * len(rod.mesh.node_label)
    np.testing.assert_array_equal(modes["v"][modes["mode"] == 2], step.mode[1][:, 1])
    curves = columns(rod, "curves")
    assert list(dict.fromkeys(curves["curve"])) == list(rod.limit_curves)
    branch = columns(rod, "path", 1)
    np.testing.assert_array_equal(branch["load_factor"], rod.branches[1].column("load_factor").values)


@pytest.mark.parametrize("file, name, message", [
    ("cantilever.h5", "displacement", "field 'displacement' is not in the file"), ("cantilever.h5", "contact", "has no contact"),
    ("ring.h5", "modes", "no buckling modes"), ("ring.h5", "curves", "no limit curves"), ("cantilever.h5", "critical", "empty"),
    ("cantilever.h5", "candidates", "no reactions or gaps"), ("ring.h5", "tables", "no table 'tables'")])
def test_a_table_that_is_not_there(files, file, name, message):
    with pytest.raises(ResultsError, match=message):
        tables.table(read_results(files / file), name)


def test_csv_keeps_every_digit(files, tmp_path, capsys):
    output = tmp_path / "path.csv"
    assert draw("csv", files / "ring.h5", "-o", output) == 0
    assert capsys.readouterr().out == f"wrote {output} (15 rows)\n"
    head = [line for line in output.read_text().splitlines() if line.startswith("#")]
    assert head[0] == "# half ring in a rigid cavity" and "status: complete" in head[1] and "v: length" in head[2]
    names, *rows = csv.reader(line for line in output.read_text().splitlines() if not line.startswith("#"))
    assert [float(row[names.index("load_factor")]) for row in rows] == make.RING[:, 1].tolist()
    assert [row[names.index("label")] for row in rows][LIMIT - 1] == "LP"


def test_csv_to_the_terminal_and_of_a_run_that_was_killed(files, capsys):
    assert draw("csv", files / "killed.h5", "-o", "-") == 0
    text = capsys.readouterr().out
    assert "status: running" in text and len(list(csv.reader(io.StringIO(text)))) == 3 + 1 + 14


def test_pandas(files):
    pandas = pytest.importorskip("pandas")
    frame = tables.to_pandas(read_results(files / "ring.h5"))
    assert isinstance(frame, pandas.DataFrame) and frame.attrs["units"]["v"] == "length" and frame.attrs["status"] == "complete"
    np.testing.assert_array_equal(frame["load_factor"], make.RING[:, 1])


def test_xarray(files):
    pytest.importorskip("xarray")
    ring = read_results(files / "ring.h5")
    data = tables.to_xarray(ring)
    np.testing.assert_array_equal(data["displacement"].sel(point=LIMIT, node=105), ring.field("displacement", LIMIT)[4])
    np.testing.assert_array_equal(data["section_forces"].sel(point=LIMIT, element=3), ring.field("section_forces", LIMIT)[2])
    assert data["v"].attrs["units"] == "length"
    killed = tables.to_xarray(read_results(files / "killed.h5"))
    assert np.all(np.isnan(killed["displacement"].sel(point=2))) and np.all(np.isfinite(killed["displacement"].sel(point=3)))


# ParaView


def sampled(path, point, pieces):
    shape = Shape(path.mesh, path.field("displacement", point))
    t = np.linspace(0.0, 1.0, pieces + 1)
    return np.concatenate([shape.piece(element, t) for element in range(len(path.mesh.elements))])


def test_vtk_read_back(files, tmp_path):
    """By VTK's own reader: places, fields and times of every stored point."""
    vtk = pytest.importorskip("vtk")
    from vtk.util.numpy_support import vtk_to_numpy
    assert draw("vtk", files / "ring.h5", "--pieces", 3, "-o", tmp_path / "ring.vtkhdf") == 0
    ring = read_results(files / "ring.h5")
    reader = vtk.vtkHDFReader()
    reader.SetFileName(str(tmp_path / "ring.vtkhdf"))
    reader.UpdateInformation()
    assert reader.GetNumberOfSteps() == 15
    for point in (1, LIMIT, 15):
        reader.UpdateTimeStep(float(point))
        grid = reader.GetOutput()
        assert grid.GetNumberOfCells() == 24 and grid.GetCell(5).GetCellType() == vtk.VTK_POLY_LINE
        np.testing.assert_array_equal(vtk_to_numpy(grid.GetPoints().GetData())[:, :2], sampled(ring, point, 3))
        data = {name: vtk_to_numpy(grid.GetPointData().GetArray(name)) for name in ("M", "gap", "displacement", "contact")}
        np.testing.assert_array_equal(data["M"].reshape(24, 4)[:, [0, 3]], ring.field("section_forces", point)[:, :, 2])
        np.testing.assert_array_equal(data["gap"].reshape(24, 4)[:, 0], ring.field("gap", point)[:-1])
        np.testing.assert_allclose(data["displacement"].reshape(24, 4, 3)[:, 0, :2], ring.field("displacement", point)[:-1, :2],
                                   atol=1e-15)
        assert data["contact"][0] == 0.0 and data["contact"][-1] == 1.0
        assert grid.GetFieldData().GetArray("load_factor").GetTuple(0) == (make.RING[point - 1, 1],)
    reader.SetFileName(str(tmp_path / "ring-obstacles.vtkhdf"))
    reader.Update()
    surface = vtk_to_numpy(reader.GetOutput().GetPoints().GetData())
    np.testing.assert_allclose(np.hypot(surface[:, 0], surface[:, 1]), 1.0, rtol=1e-12)


def test_vtk_without_vtk(files, tmp_path):
    """What the file holds, whoever reads it."""
    assert draw("vtk", files / "killed.h5", "--pieces", 2, "-o", tmp_path / "k.vtkhdf") == 0
    killed = read_results(files / "killed.h5")
    with h5py.File(tmp_path / "k.vtkhdf") as file:
        root, size = file["VTKHDF"], 24 * 3
        assert root.attrs["Type"] == b"UnstructuredGrid" and root["Steps"].attrs["NSteps"] == 7
        assert root["Steps/Values"][()].tolist() == killed.points_with("displacement").tolist()
        assert root["Steps/PointOffsets"][()].tolist() == [size * k for k in range(7)]
        np.testing.assert_array_equal(root["Points"][size:2 * size, :2], sampled(killed, 3, 2))
        assert root["Connectivity"].shape == (size,) and root["Offsets"][-1] == size


# The page


def page_data(name):
    text = Path(name).read_text(encoding="utf-8")
    assert not re.search(r"(src|href)\s*=|https?:", text)         # nothing from elsewhere
    return json.loads(re.search(r"^const data = (.*);$", text, re.MULTILINE).group(1))


def test_page_with_a_slider(files, tmp_path):
    output = tmp_path / "ring.html"
    assert draw("html", files / "ring.h5", "-o", output) == 0
    data, ring = page_data(output), read_results(files / "ring.h5")
    assert [frame["point"] for frame in data["frames"]] == list(range(1, 16)) and (data["x"], data["y"]) == ("v", "load_factor")
    np.testing.assert_array_equal(data["columns"]["load_factor"]["values"], make.RING[:, 1])
    (curve,) = data["frames"][LIMIT - 1]["rods"]
    shape = Shape(ring.mesh, ring.field("displacement", LIMIT))
    np.testing.assert_allclose(np.array(curve) * data["step"], shape.curves(data["samples"])[0], atol=0.51 * data["step"])
    assert data["step"] <= 1e-5 * 2.2
    assert data["note"] == "" and data["frames"][LIMIT - 1]["contact"]


def test_the_page_of_half_a_ring_shows_the_whole(files, tmp_path):
    output = tmp_path / "ring.html"
    assert draw("html", files / "ring.h5", "--mirror", "x=0", "-o", output) == 0
    data = page_data(output)
    left, right = (np.array(curve) for curve in data["frames"][LIMIT - 1]["rods"])
    np.testing.assert_array_equal(left * (-1, 1), right)
    assert data["limits"][1][0] > 0.99 / data["step"] and len(data["home"]) == 2


def test_the_page_says_that_the_run_stopped_and_that_scales_differ(files, tmp_path):
    output = tmp_path / "column.html"
    assert draw("html", files / "column.h5", "--stretch-y", 5, "-o", output) == 0
    assert page_data(output)["note"] == ("The run did not come to its end: stopped: smallest increment reached. "
                                         "y is drawn 5 times larger than x.")


def test_a_title_cannot_break_the_page(files, tmp_path):
    name = tmp_path / "odd.h5"
    name.write_bytes((files / "column.h5").read_bytes())
    with h5py.File(name, "a") as file:
        file.attrs["title"] = np.bytes_("</script><b>a & b")
    assert draw("html", name, "-o", tmp_path / "odd.html") == 0
    text = (tmp_path / "odd.html").read_text()
    assert "&lt;/script&gt;&lt;b&gt;a &amp; b" in text and text.count("</script>") == 1


# Films


def test_film(files, tmp_path):
    from PIL import Image
    output = tmp_path / "ring.gif"
    assert draw("animate", files / "killed.h5", "--mirror", "x=0", "--dpi", 40, "--width", 100, "--frames", 14, "-o", output) == 0
    with Image.open(output) as film:
        assert 12 <= film.n_frames <= 18        # 7 stored points and as many between
        frames = []
        for k in range(film.n_frames):
            film.seek(k)
            frames.append(np.asarray(film.convert("RGB")).copy())
    assert all(np.any(first != second) for first, second in zip(frames, frames[1:]))


ERRORS = [
    ("animate", ["ring.h5", "-o", "ring.avi"], "must end in .gif or .mp4"),
    ("animate", ["cantilever.h5"], "no displacements are stored"),
    ("animate", ["none.h5"], "none.h5: no such file"),
    ("vtk", ["cantilever.h5"], "no displacements are stored"),
    ("vtk", ["ring.h5", "-o", "nowhere/ring.vtkhdf"], "nowhere/ring.vtkhdf: cannot be written"),
    ("html", ["cantilever.h5"], "no displacements are stored"),
    ("html", ["ring.h5", "--x", "w"], "no path quantity or monitor 'w'"),
    ("csv", ["ring.h5", "--branch", "1"], "no branch 1 (it has none)"),
    ("csv", ["ring.h5", "--table", "shapes"], "invalid choice: 'shapes'"),
    ("csv", ["ring.h5", "-o", "nowhere/ring.csv"], "cannot be written: No such file or directory"),
    ("paths", ["ring.h5"], "no command 'paths' (known: path, shape,"),
]


@pytest.mark.parametrize("name, arguments, message", ERRORS)
def test_wrong_input_is_one_line(files, monkeypatch, capsys, name, arguments, message):
    monkeypatch.chdir(files)
    assert draw(name, *arguments) == 2
    printed = capsys.readouterr()
    assert printed.out == "" and message in printed.err and printed.err.count("\n") == 1


def test_mp4_without_ffmpeg(files, monkeypatch, capsys):
    from matplotlib import animation
    monkeypatch.setattr(animation.FFMpegWriter, "isAvailable", classmethod(lambda cls: False))
    assert draw("animate", files / "ring.h5", "-o", "ring.mp4") == 2
    assert "MP4 needs the program ffmpeg (apt-get install ffmpeg); a .gif does without" in capsys.readouterr().err


@pytest.mark.parametrize("name, ending, options", [("csv", "csv", []), ("vtk", "vtkhdf", []), ("html", "html", []),
                                                   ("animate", "gif", ["--dpi", 40, "--width", 100, "--frames", 1])])
def test_of_a_run_that_stopped_it_is_said(files, tmp_path, capsys, name, ending, options):
    assert draw(name, files / "killed.h5", *options, "-o", tmp_path / f"a.{ending}") == 0
    assert capsys.readouterr().out.endswith("killed.h5 has 14 points, status: running\n")


# What is said when a package is missing


@pytest.mark.parametrize("package, name, code", [("matplotlib", "path", 2), ("matplotlib", "csv", 0), ("matplotlib", "html", 0),
                                                 ("matplotlib", "vtk", 0), ("h5py", "path", 2)])
def test_a_missing_package_is_one_sentence(files, tmp_path, package, name, code):
    """A module of that name which cannot be found, before the real one on the path."""
    (tmp_path / "sitecustomize.py").write_text(
        "import sys\nclass Gone:\n    def find_spec(self, name, *rest):\n"
        f"        if name.split('.')[0] == '{package}':\n"
        "            raise ModuleNotFoundError(f\"No module named '{name}'\", name=name)\n"
        "sys.meta_path.insert(0, Gone())\n")
    done = command_line(tmp_path, name, files / "ring.h5", PYTHONPATH=f"{tmp_path}:{POSTPROC}")
    assert done.returncode == code, done.stderr
    if code:
        also = "; csv, vtk and html do without" if package == "matplotlib" else ""
        assert done.stderr == (f"unilat-plot {name}: error: needs the Python package {package}: apt-get install python3-{package}, "
                               f"or pip install {package}{also}\n")


def test_usage_lists_the_commands(tmp_path):
    for arguments, code in (([], 2), (["--help"], 0)):
        done = command_line(tmp_path, *arguments)
        assert done.returncode == code and "\n   animate " in done.stdout


def test_the_package_is_whole():
    """The version is that of the program, every folder with modules is a package, commands and other files are named."""
    text = (POSTPROC / "pyproject.toml").read_text()
    program = re.search(r"project\(unilat VERSION ([0-9.]+)", (POSTPROC.parent / "CMakeLists.txt").read_text()).group(1)
    assert re.search(r'^version = "(.*)"$', text, re.MULTILINE).group(1) == program
    modules = [path for path in (POSTPROC / "unilat").rglob("*.py") if "__pycache__" not in path.parts]
    assert all((path.parent / "__init__.py").exists() for path in modules)
    for module, function in re.findall(r'= "(unilat[a-z_.]*):([a-z_]+)"', text):
        assert callable(getattr(importlib.import_module(module), function))
    others = [path for path in (POSTPROC / "unilat").rglob("*") if path.is_file() and path.suffix not in (".py", ".pyc")]
    assert others and 'wheel.packages = ["unilat"]' in text      # with whatever lies in its folders
    assert 'cmake.source-dir = ".."' in text and (POSTPROC.parent / "CMakeLists.txt").exists()

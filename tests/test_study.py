"""Maps and studies: what counts as right, told, stopped, untold and wrong; tables of exact values; counting, drawing, going on after a kill.

UNILAT names the program.
"""

from __future__ import annotations

import csv
import math
import os
import subprocess
import sys
import warnings
from pathlib import Path
from types import SimpleNamespace

import pytest
from matplotlib.figure import Figure

TESTS = Path(__file__).resolve().parent
ROOT = TESTS.parent
sys.path[:0] = [str(TESTS), str(ROOT / "postproc")]

from postproc_runner import drawn_share, module_run  # noqa: E402
from unilat.results import ResultsError  # noqa: E402
from unilat.study import delivered, several_maps  # noqa: E402
from unilat.study.effectivity import Case, is_effectivity, summary, told_to  # noqa: E402
from unilat.study.exact_table import ExactTable  # noqa: E402
from unilat.study.map_file import read_map  # noqa: E402
from unilat.study.map_picture import draw_map  # noqa: E402
from unilat.study.map_table import Cell  # noqa: E402
from unilat.study.study_file import read_study  # noqa: E402
from unilat.study.verdict import verdict, worst  # noqa: E402

NAN, INF = math.nan, math.inf

# A clamped column that can only move along its axis buckles at 4 pi^2 EI, less what EA gives way by.
DECK = """*PARAMETER
load = 0.05*(1 - sqrt(1 - 16*pi**2/ea))*ea
*NODE
1, 0., 0.
2, 1., 0.
*LINE, ELSET=C, TYPE=GE4
1, 2, ${elements}
*BEAM SECTION, ELSET=C, SECTION=STIFFNESS
${ea}, 1.
*BOUNDARY
1, ENCASTRE
2, YSYMM
*STEP
*STATIC, METHOD=LOAD
2., 1E-9, 3.
*CLOAD
2, 1, -10.
*STOP
LOAD, ABOVE, ${last}
*END STEP
"""
MAP = """title = "buckling"
deck = "column.inp"
exact = "loads.csv"
[grid]
elements = [2, 3, 16]
ea = [1e4, 1e6]
last = 5.0
[[check]]
quantity = "BP"
exact = "tenth"
tolerance = 1e-4
[map]
x = "elements"
y = "ea"
"""


def buckling_load(ea):
    return 0.5 * (1.0 - math.sqrt(1.0 - 16.0 * math.pi**2 / ea)) * ea


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "column.inp").write_text(DECK)
    (tmp_path / "column.toml").write_text(MAP)
    (tmp_path / "loads.csv").write_text("# closed form\nea,tenth\n" + "".join(f"{ea},{0.1 * buckling_load(ea)!r}\n" for ea in (1e4, 1e6)))
    return tmp_path


def run(folder, what="map", file="column.toml"):
    return module_run(folder, "unilat.study", what, file, "-j", "2", "--program", os.environ["UNILAT"])


def table(folder):
    with open(folder / "column-map" / "column.csv", newline="") as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


@pytest.mark.parametrize("code, value, error, bar, none, expected", [
    (0, 1.0, 1e-7, NAN, False, "right"),        # right to what was asked, bar or no bar
    (0, 1.0, 1e-3, 2e-3, False, "told"),
    (0, 1.0, 1e-3, INF, False, "told"),
    (0, 1.0, 1e-3, 5e-4, False, "wrong"),       # the bar is too small
    (0, 1.0, 1e-3, NAN, False, "untold"),       # no estimate
    (0, NAN, NAN, NAN, False, "wrong"),         # there is such a point, and the run passed it by
    (2, NAN, NAN, NAN, False, "stopped"),
    (1, NAN, NAN, NAN, False, "stopped"),
    (2, 1.0, 1e-7, 1e-7, False, "told"),
    (2, 1.0, 1e-1, NAN, False, "told"),
    (0, NAN, NAN, NAN, True, "right"),          # there is no such point
    (0, 1.0, NAN, 1e-9, True, "wrong"),         # ... and the run has one
    (0, 1.0, NAN, INF, True, "told"),
    (0, 1.0, NAN, NAN, True, "untold")])
def test_verdicts(code, value, error, bar, none, expected):
    assert verdict(code, value, error, bar, 1e-6, none) == expected


def test_a_run_is_worth_what_its_worst_check_is():
    assert worst(["right", "told", "right"]) == "told" and worst(["stopped", "wrong", "untold"]) == "wrong"


def test_exact_values_are_found_by_the_parameters(tmp_path):
    (tmp_path / "a.csv").write_text("# source\na,kind,load\n1e4,GE4,2.5\n0.3,GE4,\n0.3,GE8,3\n")
    exact = ExactTable(str(tmp_path / "a.csv"))
    assert exact.row({"a": 10000.000000001, "kind": "GE4", "n": 5})["load"] == 2.5
    assert math.isnan(exact.row({"a": 0.1 + 0.2, "kind": "GE4"})["load"])
    with pytest.raises(ResultsError, match="0 rows with a = 2.0"):
        exact.row({"a": 2.0, "kind": "GE4"})
    with pytest.raises(ResultsError, match="2 rows with a = 0.3"):
        exact.row({"a": 0.3})


def test_a_map_counts_and_draws(folder):
    done = run(folder)
    assert done.returncode == 0 and "6 cells: 2 right, 4 told, 0 stopped, 0 wrong" in done.stdout, done.stdout + done.stderr
    rows = table(folder)
    for row in rows:
        load = 0.1 * buckling_load(float(row["ea"]))
        assert float(row["BP exact"]) == load
        assert float(row["BP error"]) == pytest.approx(abs(float(row["BP value"]) / load - 1.0), rel=1e-2)
        assert row["class"] == ("right" if row["elements"] == "16" else "told")
    assert drawn_share(folder / "column-map" / "column.png") > 0.1


def test_what_is_wrong_is_counted_and_its_deck_kept(folder):
    """An exact value that is none, for one of the stiffnesses."""
    text = (folder / "loads.csv").read_text()
    (folder / "loads.csv").write_text(text.replace(repr(0.1 * buckling_load(1e6)), "5."))
    done = run(folder)
    assert done.returncode == 1 and "1 wrong" in done.stdout, done.stdout
    assert "wrong: run 6 (elements = 16, ea = 1000000.0): BP 3.94" in done.stdout
    # The deck in one piece gives the same run.
    deck = folder / "column-map" / "column-wrong-6.inp"
    assert "ea = 1000000" in deck.read_text()
    subprocess.run([os.environ["UNILAT"], "--check", str(deck)], capture_output=True, check=True)
    # Without that error nothing runs again, and no deck is left.
    (folder / "loads.csv").write_text(text)
    done = run(folder)
    assert "6 cells, 6 finished before" in done.stdout and done.returncode == 0
    assert not list((folder / "column-map").glob("*wrong*"))


def test_what_the_run_does_not_reach_is_stopped_or_wrong(folder):
    """A step that ends before the bifurcation is complete: nothing says that there is none."""
    (folder / "column.toml").write_text(MAP.replace("last = 5.0", "last = 3.0"))
    done = run(folder)
    assert done.returncode == 1 and "6 cells: 0 right, 0 told, 0 stopped, 6 wrong" in done.stdout
    (folder / "column.inp").write_text(DECK.replace("*STEP", "*STEP\n*CONTROLS, POINTS=1"))
    done = run(folder)
    assert done.returncode == 0 and "6 cells: 0 right, 0 told, 6 stopped, 0 wrong" in done.stdout


def test_runs_that_are_finished_stay(folder):
    """The second half after the first; then with other values only what is new."""
    (folder / "column.toml").write_text(MAP.replace("[2, 3, 16]", "[2, 3]"))
    assert "4 cells, 0 finished before" in run(folder).stdout
    (folder / "column.toml").write_text(MAP)
    assert "6 cells, 4 finished before" in run(folder).stdout
    assert "6 cells, 6 finished before" in run(folder).stdout


@pytest.mark.parametrize("old, new, message", [
    ('x = "elements"', 'x = "count"', "no parameter 'count'"),
    ('y = "ea"', 'z = "ea"', "[map] has x, y"),
    ('quantity = "BP"', 'quantity = "XY"', "'XY' is neither a label"),
    ('quantity = "BP"', 'quality = "BP"', "[[check]] has quantity"),
    ("[[check]]", "[[checks]]", "'checks' is not known"),
    ('"tenth"', '"0.1*lod"', "no parameter or column '0.1*lod'"),
    ("ea = [1e4, 1e6]", "ea = [1e4, 1e6]\neb = [1.0]", "--set eb: the deck has no such parameter"),
    ("1e4", "2e4", "0 rows with ea = 20000"),
    ('exact = "loads.csv"', 'exact = "none.csv"', "none.csv: cannot be read")])
def test_wrong_files_are_refused(folder, old, new, message):
    (folder / "column.toml").write_text(MAP.replace(old, new, 1))
    done = run(folder)
    assert done.returncode == 2 and message in done.stderr and "Traceback" not in done.stderr, done.stderr


def test_the_legend_of_a_narrow_map_is_whole(monkeypatch, tmp_path):
    """Of one column: the legend has rows, in a picture that is wide enough for one of its entries and a label."""
    drawn = []
    monkeypatch.setattr(Figure, "savefig", lambda figure, *_: drawn.append(figure))
    rows = [Cell({"a": 1.0, "b": b}, "right", [], 0, "", 0.0) for b in (1, 2)]
    with warnings.catch_warnings():
        warnings.simplefilter("error")          # such as matplotlib's, that nothing has room
        draw_map(SimpleNamespace(look={"x": "a", "y": "b"}), rows, str(tmp_path / "map.png"))
    (figure,) = drawn
    legend = figure.axes[0].get_legend()
    assert [text.get_text() for text in legend.get_texts()] == ["2 right", "0 told", "0 stopped", "0 wrong"]
    box = legend.get_window_extent(figure.canvas.get_renderer())
    assert figure.bbox.contains(*box.min) and figure.bbox.contains(*box.max) and box.y0 >= figure.axes[1].get_window_extent().y1


@pytest.mark.parametrize("path", sorted((ROOT / "input" / "maps").glob("*.toml")), ids=lambda path: path.stem)
def test_shipped_maps_have_exact_values_in_every_cell(path):
    checked = read_map(str(path), os.environ["UNILAT"])
    # Those of tolerances are parts of one study.
    least = 8 if path.stem.startswith("asked-") else 60
    assert least <= len(checked.decks) <= 120 and checked.sweep.title


# Error against run time

STUDY = """title = "buckling"
deck = "column.inp"
repeats = 2
[fixed]
ea = 1e6
last = 5.0
[[check]]
quantity = "BP"
exact = "load"
[[curve]]
name = "few"
elements = [2, 4, 8]
[[curve]]
name = "soft"
elements = 8
ea = [1e3, 1e4]
"""


def test_a_study_measures_and_draws(folder):
    (folder / "study.toml").write_text(STUDY)
    done = run(folder, "time", "study.toml")
    assert done.returncode == 0 and "5 runs" in done.stdout, done.stdout + done.stderr
    name = folder / "study-time" / "study.csv"
    with open(name, newline="") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    assert [(row["curve"], row["elements"], row["ea"]) for row in rows] == [
        ("few", "2", "1000000.0"), ("few", "4", "1000000.0"), ("few", "8", "1000000.0"), ("soft", "8", "1000.0"), ("soft", "8", "10000.0")]
    for row in rows:
        assert 0.0 < float(row["solver_seconds"]) <= float(row["process_seconds"]) < 10.0 and 1.0 < float(row["megabytes"]) < 1e3
        load = 0.1 * buckling_load(float(row["ea"]))
        error = abs(float(row["BP value"]) / load - 1.0)
        assert float(row["BP error"]) == pytest.approx(error, rel=1e-2)
        assert float(row["BP bar over error"]) == pytest.approx(float(row["BP bar"]) / error, rel=2e-2) and float(row["BP bar"]) > error
    assert drawn_share(folder / "study-time" / "study.png") > 0.01
    # What is measured stays, to the last digit.
    before = name.read_bytes()
    assert run(folder, "time", "study.toml").returncode == 0 and name.read_bytes() == before


@pytest.mark.parametrize("old, new, message", [
    ("[[curve]]", "[[curves]]", "'curves' is not known"),
    ("elements = 8", "count = 8", "soft: "),
    ("ea = [1e3, 1e4]", "ea = [1e3, 1e4]\nlast = [1.0]", "lists must have the same length")])
def test_wrong_studies_are_refused(folder, old, new, message):
    (folder / "study.toml").write_text(STUDY.replace(old, new))
    done = run(folder, "time", "study.toml")
    assert done.returncode == 2 and message in done.stderr and "Traceback" not in done.stderr, done.stderr


@pytest.mark.parametrize("path", sorted((ROOT / "input" / "studies").glob("*.toml")), ids=lambda path: path.stem)
def test_shipped_studies_can_be_read(path):
    if delivered.is_delivered(str(path)):
        maps = several_maps.read_maps(str(path), "asked", os.environ["UNILAT"])
        assert sum(len(each.decks) * len(each.checks) for each in maps) >= 300
        assert all({values["asked"] for values in each.sweep.values} == {1e-3, 1e-5, 1e-7, 1e-9} for each in maps)
        return
    if is_effectivity(str(path)):
        assert sum(len(each.decks) * len(each.checks) for each
                   in several_maps.read_maps(str(path), "maps", os.environ["UNILAT"])) >= 1000
        return
    study = read_study(str(path), os.environ["UNILAT"])
    assert study.title and study.checks and len(study.runs) >= 10


def test_what_digits_of_an_exact_value_tell():
    assert told_to("3.276282198") == pytest.approx(1e-8) and told_to("-0.5") == pytest.approx(1.0)
    assert told_to("limit_load") == 0.0 == told_to("0.1*load")


def test_bars_are_summed_up():
    """Bars 2, 0.5 and open, estimates 1 and 0.8 times the error; errors are value less exact, estimates the other way round."""
    cases = [Case("a", {}, "LP", 1.0, 1.001, 1e-3, 2e-3, -1e-3), Case("a", {}, "LP", 1.0, 0.999, -1e-3, 5e-4, 8e-4),
             Case("b", {}, "LP", 1.0, 1.001, 1e-3, INF, -1e-3), Case("b", {}, "LP", 1.0, 1.05, 5e-2, INF, -1e-3)]
    lines = summary(cases).splitlines()
    assert lines[2] == "| a | 2 | 0.8, 0.8, 0.8 | 0.50, 1.25, 2 | 1 | 0.0 % |"
    assert lines[3].startswith("| b | 2 |") and lines[4].startswith("| all | 4 |") and lines[4].endswith("| 1 | 33.3 % |")


def test_a_study_of_bars(folder):
    (folder / "bars.toml").write_text('title = "bars"\nmaps = ["column.toml"]\n')
    done = run(folder, "time", "bars.toml")
    assert done.returncode == 0 and "| all |" in done.stdout, done.stdout + done.stderr
    with open(folder / "bars-bars" / "bars.csv", newline="") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    assert {row["map"] for row in rows} == {"column"} and len(rows) >= 4
    for row in rows:
        load = 0.1 * buckling_load(float(row["ea"]))
        assert float(row["error"]) == pytest.approx(float(row["value"]) / load - 1.0, rel=1e-3)
        assert float(row["bar"]) > abs(float(row["error"]))
        assert float(row["estimate"]) == pytest.approx(-float(row["error"]), rel=0.5)
    assert drawn_share(folder / "bars-bars" / "bars.png") > 0.001


ASKED = """*NODE
1, 0., 0.
2, 1., 0.
*LINE, ELSET=C
1, 2
*BEAM SECTION, ELSET=C, SECTION=STIFFNESS
${ea}, 1.
*BOUNDARY
1, ENCASTRE
2, YSYMM
*MONITOR, NAME=x
2, U1, -1.
*STEP
*ACCURACY, TOLERANCE=${asked}
*STATIC, METHOD=LOAD
2., 1E-9, 3.
*CLOAD
2, 1, -10.
*STOP
LOAD, ABOVE, 5.
*END STEP
"""


def test_asked_and_delivered(folder):
    """The column of the maps on meshes for tolerances; what is asked is of the largest load so far, which is the exact one."""
    (folder / "column-asked.inp").write_text(ASKED)
    (folder / "asked-column.toml").write_text(MAP.replace("column.inp", "column-asked.inp").replace("tolerance = 1e-4", 'tolerance = "asked"')
                                              .replace("elements = [2, 3, 16]", "asked = [1e-3, 1e-7]").replace("last = 5.0\n", "")
                                              .replace('x = "elements"', 'x = "asked"'))
    (folder / "asked.toml").write_text('title = "asked"\nasked = ["asked-column.toml"]\n')
    done = run(folder, "time", "asked.toml")
    assert done.returncode == 0, done.stdout + done.stderr
    with open(folder / "asked-asked" / "asked.csv", newline="") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    assert {float(row["asked"]) for row in rows} == {1e-3, 1e-7} and len(rows) >= 4
    for row in rows:
        assert float(row["tolerance"]) == float(row["asked"]) and row["code"] == "0"
        assert float(row["error"]) <= float(row["bar"]) <= 1.001 * float(row["tolerance"])
    assert "| column | 1e-03 | 2 | 2 |" in done.stdout and "| all |  | 4 | 4 |" in done.stdout


def test_delivered_values_are_summed_up():
    """Errors of half of what was asked, of ten times that, and none."""
    cases = [delivered.Case("a", {"asked": 1e-3}, "LP", 1e-3, error, 0.0, bar, 4.0, 0.01, 0.1, code, "")
             for error, bar, code in ((5e-4, 1e-3, 0), (1e-2, 2e-2, 2), (float("nan"), float("nan"), 2))]
    assert delivered.summary(cases).splitlines()[2] == "| a | 1e-03 | 3 | 1 | 1.05 | 2 | 1 | 4 | 10 | 10 % |"

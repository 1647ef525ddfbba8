"""Decks in Python: cards from the program's own table, text, runs, errors as exceptions, sweeps and optimisation, the example notebook.

UNILAT names the program.
"""

from __future__ import annotations

import ast
import gc
import json
import os
import pathlib
import re
import subprocess

import deck_runner as dr
import numpy as np
import pytest
import unilat
from unilat import Deck, DeckError, PathStopped, ResultsError, cards
from unilat.deck import card_table, varying
from unilat.deck.card import value_of, written
from unilat.pictures import arguments_of
from unilat.sweep.sweep_file import read_toml

SOURCE = pathlib.Path(os.environ["UNILAT_SOURCE"])
NOTEBOOKS = sorted((SOURCE / "postproc" / "examples").glob("*.ipynb"))
EULER = np.pi**2


def column(**heading) -> Deck:
    """Euler's column of length and stiffness 1."""
    deck = Deck("a column", **heading)
    deck.parameter(EI=1.0)
    deck.node((1, 0.0, 0.0), (2, 1.0, 0.0))
    deck.line((1, 2, 4), elset="COLUMN")
    deck.beam_section((1e6, "${EI}"), elset="COLUMN", section="STIFFNESS")
    deck.boundary((1, "PINNED"), (2, 2))
    deck.monitor((2, "U1", -1), name="shortening")
    with deck.step(name="PRESS") as step:
        step.static((0.5, 1e-6, 4.0), method="LOAD")
        step.cload((2, 1, -1.0))
        step.stop(("LOAD", "ABOVE", "${12*EI}"))
    return deck


def summary(*words: str) -> str:
    done = subprocess.run([os.environ["UNILAT"], "--check", *words], capture_output=True, encoding="utf-8", check=False)
    assert done.returncode == 0, done.stderr
    return "\n".join(line for line in done.stdout.splitlines() if not line.startswith("deck "))


# Cards


def test_every_card_has_a_class_with_what_the_table_says():
    done = subprocess.run([os.environ["UNILAT"], "--cards=json"], capture_output=True, encoding="utf-8", check=True)
    told = json.loads(done.stdout)["cards"]
    manual = subprocess.run([os.environ["UNILAT"], "--cards"], capture_output=True, encoding="utf-8", check=True).stdout
    assert [f"### `*{card['keyword']}`" for card in told] == [line for line in manual.splitlines() if line.startswith("### ")]
    for card in told:
        made = getattr(cards, card_table.class_name(card["keyword"]))
        flat = " ".join(made.__doc__.split())
        assert " ".join(card["meaning"].split()) in flat
        for item in [*card["parameters"], *(field for layout in card["lines"] for field in layout["fields"])]:
            assert " ".join(item["meaning"].split()) in flat and all(word in flat for word in item["words"]), (card["keyword"], item["name"])
        assert set(made.names.values()) == {item["name"] for item in card["parameters"]}
    assert "BeamSection" in dir(cards) and "lines" in str(cards.Node.__signature__) and "elset" in str(cards.Line.__signature__)


def test_tab_completion_finds_cards_where_they_belong():
    deck = Deck()
    assert {"beam_section", "node", "run", "sweep"} <= set(dir(deck)) and "static" not in dir(deck)
    assert {"static", "cload"} <= set(dir(deck.step())) and "node" not in dir(deck.step())
    assert {"Deck", "cards", "read_results", "DeckError"} <= set(dir(unilat))
    assert deck.static.__doc__ == cards.Static.__doc__


@pytest.mark.parametrize("wrong, message", [
    (lambda deck: deck.line((1, 2), elst="A"), "*LINE has no parameter 'elst' (did you mean elset? known: type, elset, nset)"),
    (lambda deck: deck.lines((1, 2)), "Deck has no 'lines', and the program no such card"),
    (lambda deck: cards.Sttic, "no card has the class 'Sttic' (known: Heading,")])
def test_what_no_card_has_is_told_at_once(wrong, message):
    with pytest.raises((TypeError, AttributeError)) as told:
        wrong(Deck())
    assert message in str(told.value)


def test_values_are_written_as_the_program_reads_them():
    assert [written(value) for value in (1, 2.5, np.float64(1e-7), np.int32(3), True, None, "${a*2}", "U1")] == [
        "1", "2.5", "1e-07", "3", "TRUE", "", "${a*2}", "U1"]
    assert [value_of(word) for word in ("12", "1.5E3", "-.5", "", "1_0", "nan", "A1")] == [12, 1500.0, -0.5, None, "1_0", "nan", "A1"]
    card = cards.Node(np.array([[1, 0.0, 0.5], [2, 1.0, 0.0]]))
    assert card.text() == "*NODE\n1.0, 0.0, 0.5\n2.0, 1.0, 0.0\n"
    assert cards.Nset((1, 5, 2), nset="A", generate=True).text() == "*NSET, NSET=A, GENERATE\n1, 5, 2\n"
    assert cards.Parameter(gap=0.1, name='"x"').text() == '*PARAMETER\ngap = 0.1\nname = "x"\n'


# Text


@pytest.mark.parametrize("name", sorted(path.stem for path in (SOURCE / "input").glob("*.inp")))
def test_a_deck_that_is_read_and_written_is_the_same(name, tmp_path):
    file = SOURCE / "input" / f"{name}.inp"
    deck = Deck.read(file)
    written_to = deck.write(tmp_path / "deck.inp")
    assert summary(written_to) == summary(str(file))
    assert Deck.from_text(deck.text()).text() == deck.text()
    comments = [line for line in file.read_text().splitlines() if line.startswith("**")]
    assert [line for line in deck.text().splitlines() if line.startswith("**")] == comments


def test_a_keyword_line_goes_on_past_comments_and_a_name_may_be_written_loosely():
    deck = Deck.from_text("*LINE,\n** a comment\n e l s e t = A,\nNSET=B\n1, 2, , 3.\n*beam  section, elset=A\n1., 2.\n** the end\n")
    line, section = deck.cards
    assert line.parameters == {"ELSET": "A", "NSET": "B"} and line.lines == [[1, 2, None, 3.0]]
    assert section.keyword == "BEAM SECTION" and deck.comments == ["** the end"]
    assert deck.text() == "*LINE, ELSET=A, NSET=B\n1, 2, , 3.0\n*BEAM SECTION, ELSET=A\n1.0, 2.0\n** the end\n"
    with pytest.raises(ResultsError, match="no card stands above the line '1, 2'"):
        Deck.from_text("1, 2\n*NODE\n")
    unknown = Deck.from_text("*NODE\n1, 0, 0\n*FOO, BAR=1\n2, x\n")
    assert "*FOO, BAR=1\n2, x\n" in unknown.text()


def test_an_included_deck_is_found_from_anywhere(tmp_path, monkeypatch):
    (tmp_path / "here").mkdir()
    (tmp_path / "there").mkdir()
    text = column().text()
    nodes = text[text.index("*NODE"):text.index("*LINE")]
    (tmp_path / "here" / "nodes.inp").write_text(nodes)
    (tmp_path / "here" / "deck.inp").write_text(text.replace(nodes, "*INCLUDE, FILE=nodes.inp\n"))
    deck = Deck.read(tmp_path / "here" / "deck.inp")
    monkeypatch.chdir(tmp_path / "there")
    assert summary(deck.write("moved.inp")) == summary(str(tmp_path / "here" / "deck.inp"))
    assert deck.run(progress=False).complete
    assert "FILE=nodes.inp" in deck.text()


def test_cards_are_found_and_changed():
    deck = Deck.from_text(column().text())
    (section,) = deck.find("beam section", elset="column")
    assert section["elset"] == "COLUMN" and section.lines == [[1e6, "${EI}"]]
    deck.find("static")[0]["method"] = "SPHERICAL"
    deck.find("static")[0].lines = [[1.0]]
    assert "*STATIC, METHOD=SPHERICAL\n1.0\n" in deck.text()
    assert repr(deck) == "<Deck 'a column': 12 cards, 1 steps>" and "&lt;Deck" in deck._repr_html_()


# The model


def test_the_program_writes_the_model_without_a_path(tmp_path):
    name = column().write(tmp_path / "strut.inp")
    done = subprocess.run([os.environ["UNILAT"], "--model", "--set", "EI=2", name], cwd=tmp_path, capture_output=True, encoding="utf-8",
                          check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    results = unilat.read_results(tmp_path / "strut-model.h5")
    assert (results.status, results.n_points, results.parameters) == ("model", 0, {"EI": 2.0})
    assert results.supports.fixed.tolist() == [[True, True, False], [False, True, False]] and results.loads[1].name == "PRESS"
    same = column().model(EI=2.0)
    assert same.loads[1].force.tolist() == [[-1.0, 0.0, 0.0]] and len(same.mesh.elements) == 4
    assert column().plot(labels="nodes")._repr_png_()[:4] == b"\x89PNG"
    done = subprocess.run([os.environ["UNILAT"], "--model", "--check", name], capture_output=True, encoding="utf-8", check=False)
    assert done.returncode == 1 and "either --model or --check or --expand" in done.stderr


def test_pictures_have_the_options_of_the_commands():
    results = column().run(progress=False)
    assert {"path", "shape", "reaction", "forces"} <= set(dir(results.plot)) and "model" not in dir(results.plot)
    assert arguments_of({"label": ["LP", "EP"], "no_gap": True, "x_range": (0, 1), "name": ["a", "b"], "mirror": None}) == [
        "--label", "LP,EP", "--no-gap", "--x-range", "0", "1", "--name", "a", "--name", "b"]
    with pytest.raises(ResultsError, match="no displacements are stored"):
        results.plot.shape()
    with pytest.raises(ResultsError, match="unrecognized arguments: --lable"):
        results.plot.path(lable="LP")
    with pytest.raises(AttributeError, match="no picture 'shap'"):
        results.plot.shap()


# Runs


def test_a_run_gives_results_that_show_themselves():
    points = []
    results = column(job="euler").run(progress=lambda point, load: points.append((point, load)))
    (critical,) = (each for each in results.critical if each.label == "BP")
    assert abs(critical.load_factor - EULER) < 1e-3 and os.path.basename(results.filename) == "euler.h5"
    assert [load for _, load in points] == pytest.approx(results["load_factor"][:len(points)]) and len(points) == results.n_points
    assert repr(results) == f"<Results 'a column': {results.n_points} points, load factor 0 to 12, 1 BP, monitors shortening, complete>"
    assert "<td>BP</td>" in results._repr_html_() and "± " in results._repr_html_()
    assert "Path complete" in results.listing and len(repr(results.mesh)) < 400 and len(repr(results.column("shortening"))) < 100
    assert results._ipython_key_completions_()[:2] == ["point", "shortening"]
    folder = os.path.dirname(results.filename)
    assert os.path.exists(folder)
    del results
    gc.collect()
    assert not os.path.exists(folder)


def test_a_run_in_a_folder_leaves_deck_listing_and_results(tmp_path):
    results = column().run(tmp_path / "new", name="strut", progress=False, EI=4.0)
    assert sorted(os.listdir(tmp_path / "new")) == ["strut.h5", "strut.inp", "strut.lst"]
    assert [each.load_factor for each in results.critical if each.label == "BP"] == pytest.approx([4.0 * EULER], rel=1e-4)


def test_an_error_of_the_deck_is_an_exception_with_its_place():
    deck = column()
    wrong = deck.steps[0].stop(("LOD", "ABOVE", 3))
    wrong.comments = ["** a comment above"]
    line = deck.text().splitlines().index("LOD, ABOVE, 3") + 1
    for work in (deck.check, deck.run, deck.model):
        with pytest.raises(DeckError) as told:
            work()
        error = told.value
        assert (error.file, error.line, error.column, error.card) == ("deck.inp", line, 1, wrong)
        assert error.message.startswith("*STOP: monitor LOD is not defined")
        assert str(error).splitlines()[1:3] == [f"{line:8} | LOD, ABOVE, 3", f"{'':8} | ^^^"]
    assert isinstance(error, ResultsError)


def test_all_errors_of_a_deck_have_their_places():
    deck = column()
    deck.find("node")[0].lines[1] = [2, 1.0]
    deck.find("boundary")[0].lines[0] = [1, "PINED"]
    with pytest.raises(DeckError) as told:
        deck.check()
    assert [place.card.keyword for place in told.value.places][:2] == ["NODE", "BOUNDARY"]


def test_a_path_that_stops_early_is_an_exception_with_its_results():
    deck = Deck.from_text(dr.changed(dr.on_given_mesh("arch-shallow-hinged")))
    static = deck.find("static")[0]
    static["method"], static.lines = "LOAD", [[1.0, 0.1, 4.0]]
    with pytest.raises(PathStopped) as told:
        deck.run(progress=False)
    assert told.value.results.n_points > 2 and str(told.value).startswith("stopped: ")
    assert told.value.results.status == str(told.value)
    with pytest.warns(UserWarning, match="stopped"):
        results = deck.run(progress=False, partial=True)
    assert results.n_points == told.value.results.n_points


@pytest.mark.parametrize("program, message", [
    ("/nowhere/unilat", "cannot be started: No such file or directory; name the program unilat"),
    (None, "the program unilat is not on the PATH; name it with --program, or in the variable UNILAT")])
def test_a_missing_program_is_told(monkeypatch, program, message):
    deck = column()
    monkeypatch.setenv("PATH", "")
    if program is None:
        monkeypatch.delenv("UNILAT")
    else:
        monkeypatch.setenv("UNILAT", program)
    with pytest.raises(ResultsError) as told:
        deck.run()
    assert message in str(told.value)


def test_missing_results_are_told_with_what_to_do():
    with pytest.raises(ResultsError, match=r"^none.h5: no such file; a run writes it: unilat DECK.inp -o none.h5$"):
        unilat.read_results("none.h5")


def test_a_run_can_be_ended_by_time():
    with pytest.raises(ResultsError, match="took longer than 1e-06 s and was ended"):
        column().run(progress=False, timeout=1e-6)


# Sweeps and optimisation


@pytest.fixture
def offset_deck():
    """Euler's column, whose monitor has an offset that is least at x = 0.3, y = -0.2."""
    deck = column()
    deck.find("parameter")[0].lines += ["x = 0", "y = 0"]
    deck.monitor((1, "U1", 1.0, "${2 + (x - 0.3)**2 + 3*(y + 0.2)**2}"), name="bowl")
    deck.find("stop")[0].lines = [["LOAD", "ABOVE", 1.0]]
    return deck


@dr.release_only
def test_a_sweep_is_gathered_and_not_repeated(tmp_path, capfd):
    deck = column()
    table = deck.sweep(grid={"EI": [1.0, 2.0]}, gather={"load": "BP", "last": "last shortening"}, folder=tmp_path / "s", jobs=2)
    assert table["load"] == pytest.approx(EULER * table["EI"], rel=1e-4) and table.complete and len(table) == 2
    assert table.results(2).parameters["EI"] == 2.0
    again = deck.sweep(grid={"EI": [1.0, 2.0, 3.0]}, gather={"load": "BP"}, folder=tmp_path / "s")
    assert "3 runs, 2 finished before" in capfd.readouterr().out and len(again) == 3
    assert "<td>2</td>" in again._repr_html_() and repr(again) == "<sweep: 3 runs; EI, load, points, code, message>"
    again.to_csv(tmp_path / "table.csv")
    assert (tmp_path / "table.csv").read_text().splitlines()[0] == "run,EI,load,points,code,message"
    with pytest.raises(KeyError, match="no column 'lod'"):
        again["lod"]


@dr.release_only
def test_the_best_values_are_found(offset_deck, tmp_path):
    """The least place of a paraboloid: the search ends where no point at the last distance is better, so as near as twice that."""
    best = offset_deck.minimise("max bowl", {"x": (0.0, 1.0), "y": (-1.0, 1.0)}, folder=tmp_path / "s", tolerance=0.01, progress=False)
    assert best.step <= 0.01
    assert abs(best.values["x"] - 0.3) <= 2.0 * best.step and abs(best.values["y"] + 0.2) <= 2.0 * best.step * 2.0
    assert best.value == pytest.approx(2.0, abs=5e-3) and best.runs == len(best.history) and best.results.complete
    least = min(value for _, value in best.history)
    assert best.value == least


def test_wrong_sweeps_are_told(tmp_path):
    deck = column()
    with pytest.raises(DeckError, match="the deck has no such parameter"):
        deck.sweep(grid={"EJ": [1.0]}, folder=tmp_path / "a")
    with pytest.raises(ResultsError, match="'gird' is no group of values"):
        deck.sweep(gird={"EI": [1.0]}, folder=tmp_path / "a")
    with pytest.raises(ResultsError, match="all have the same parameters"):
        deck.evaluate([{"EI": 1.0}, {"x": 1.0}], folder=tmp_path / "a")
    with pytest.raises(ResultsError, match="two bounds, the lower one first"):
        deck.minimise("BP", {"EI": (2.0, 1.0)}, folder=tmp_path / "a")


def test_a_sweep_file_written_from_python_says_the_same():
    content = {"title": 'a "b" \\ c', "deck": "a.inp", "grid": {"a": [1, 2.5], "b": {"from": 0.1, "to": 1e-7, "count": 3}},
               "latin": {"runs": 4, "seed": 1, "c": {"mean": 0.0, "deviation": 2.0}}, "gather": {"x": "LP", "y": "max v"}}
    assert read_toml(varying.toml_text(content), "x") == content


# The manual and the notebook


@dr.release_only
def test_what_the_manual_does_in_python_can_be_done(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    blocks = [block for page in sorted((SOURCE / "input").glob("**/*.md"))
              for block in re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)]
    first = next(block for block in blocks if "from unilat import Deck" in block)
    names: dict = {}
    for block in (first, next(block for block in blocks if "deck.sweep(" in block)):
        exec(compile(block.replace(", table.to_pandas()", ""), "manual", "exec"), names)      # noqa: S102  pandas need not be there
    assert abs(names["best"].value - 2.0 * EULER) < 1e-2 and names["column"].complete



@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
@dr.release_only
def test_the_cells_of_the_notebook_run_and_show_something(notebook, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names: dict = {}
    pictures = tables = 0
    for cell in json.loads(notebook.read_text(encoding="utf-8"))["cells"]:
        assert cell["cell_type"] == "markdown" or (cell["outputs"] == [] and cell["execution_count"] is None)
        if cell["cell_type"] != "code":
            continue
        tree = ast.parse("".join(cell["source"]))
        last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
        exec(compile(tree, notebook.name, "exec"), names)      # noqa: S102  a cell as Jupyter runs it
        shown = eval(compile(ast.Expression(last.value), notebook.name, "eval"), names) if last is not None else None      # noqa: S307
        pictures += hasattr(shown, "_repr_png_") and shown._repr_png_()[:4] == b"\x89PNG"
        tables += hasattr(shown, "_repr_html_") and len(shown._repr_html_()) > 100
    assert pictures >= 4 and tables >= 3


def test_there_is_a_notebook():
    assert NOTEBOOKS

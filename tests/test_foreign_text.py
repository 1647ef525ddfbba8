"""Decks, sweep files and result files of somebody else: what they ask for is drawn and tabulated, but no file is written or read
that they name, and their text is text: no formula of a spreadsheet, no command to a terminal."""

from __future__ import annotations

import csv
import os
import re
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

sys.path[:0] = [str(Path(__file__).resolve().parent)]

import make_result_file as make  # noqa: E402
from postproc_runner import command_line, draw  # noqa: E402
from unilat import deck_pictures, plain_text  # noqa: E402
from unilat.results import ResultsError, read_results  # noqa: E402
from unilat.results.reader import read_short  # noqa: E402
from unilat.sweep.gather import _write_csv  # noqa: E402
from unilat.sweep.sampling import samples  # noqa: E402
from unilat.sweep.sweep_file import Sweep, read_sweep  # noqa: E402

TERMINAL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]")


# Pictures that comments of a deck ask for


@pytest.fixture
def run(tmp_path):
    make.write_cantilever(tmp_path / "run.h5")
    (tmp_path / "elsewhere").mkdir()
    return tmp_path


def pictures(folder, comment):
    (folder / "deck.inp").write_bytes(f"** plot_path: {comment}\n*HEADING\n".encode("latin-1"))
    return deck_pictures.main([str(folder / "deck.inp"), str(folder / "run.h5")])


@pytest.mark.parametrize("option", ["-o {}", "-o{}", "--output {}", "--output={}", "--out {}", "--o={}", "'-o' {}", "\"--outp\" {}"])
def test_comments_name_no_file(run, capsys, option):
    target = run / "elsewhere" / "precious.svg"
    target.write_text("precious")
    assert pictures(run, option.format(target)) == 5
    assert "pictures are written beside the results; leave out -" in capsys.readouterr().err
    assert target.read_text() == "precious" and not list(run.glob("*.png"))


def test_words_behind_a_double_dash_name_no_file(run, capsys):
    assert pictures(run, f"-- {run / 'elsewhere' / 'x.svg'}") == 5
    assert not list((run / "elsewhere").iterdir())
    assert "unilat-plot path failed" in capsys.readouterr().err


@pytest.mark.parametrize("comment", ['"unclosed', "--x 'load", "--x load\\"])
def test_quotes_that_are_not_closed(run, capsys, comment):
    assert pictures(run, comment) == 5
    said = capsys.readouterr().err
    assert "deck.inp: comment '" in said and re.search("no closing quotation|no escaped character", said) and said.count("\n") == 1


def test_messages_about_comments_move_no_terminal(run, capsys):
    assert pictures(run, "--x \x1b[31mred\x9b") == 5
    assert not TERMINAL.search(capsys.readouterr().err)


def test_other_pictures_are_drawn(run, capsys):
    """One comment that cannot be followed leaves the rest as it is; bytes that are no text are no hindrance."""
    (run / "deck.inp").write_bytes(b"** plot_path: -o x\n** plot_shape:\n** caf\xe9\n")
    make.write_ring(run / "run.h5", fields=("displacement",))
    assert deck_pictures.main([str(run / "deck.inp"), str(run / "run.h5")]) == 5
    assert "run_shape.png" in capsys.readouterr().out and (run / "run_shape.png").exists() and not (run / "run_path.png").exists()


@pytest.fixture
def ring(tmp_path):
    make.write_ring(tmp_path / "ring.h5")
    return tmp_path


# Result files that point to other files


def outside(folder):
    with h5py.File(folder / "secret.h5", "w") as file:
        file["numbers"] = np.arange(20.0)
    (folder / "secret.bin").write_bytes(np.arange(20.0).tobytes())


def link_to_dataset(file, folder):
    del file["path/monitor/v"]
    file["path/monitor/v"] = h5py.ExternalLink(str(folder / "secret.h5"), "/numbers")


def link_to_group(file, folder):
    del file["contact"]
    file["contact"] = h5py.ExternalLink(str(folder / "secret.h5"), "/")


def raw_numbers(file, folder):
    units = dict(file["path/monitor/v"].attrs)
    n = len(file["path/load_factor"])
    del file["path/monitor/v"]
    item = file.create_dataset("path/monitor/v", (n,), dtype=float, external=[(str(folder / "secret.bin"), 0, 8 * n)])
    item.attrs.update(units)


def virtual_numbers(file, folder):
    n = len(file["path/load_factor"])
    del file["path/monitor/v"]
    layout = h5py.VirtualLayout((n,), dtype=float)
    layout[:] = h5py.VirtualSource(str(folder / "secret.h5"), "numbers", shape=(20,))[:n]
    file["path/monitor"].create_virtual_dataset("v", layout)


def link_in_a_loop(file, folder):
    file["path/again"] = file["path"]
    file["path/monitor/again"] = file["/"]
    link_to_dataset(file, folder)


@pytest.mark.parametrize("point_to", [link_to_dataset, link_to_group, raw_numbers, virtual_numbers, link_in_a_loop])
def test_other_files_are_not_read(ring, point_to, capsys):
    outside(ring)
    assert "v" in read_results(ring / "ring.h5").monitors
    with h5py.File(ring / "ring.h5", "r+") as file:
        point_to(file, ring)
    with pytest.raises(ResultsError, match="another file"):
        read_results(ring / "ring.h5")
    if point_to is not link_to_group:        # it reads nothing of contact
        with pytest.raises(ResultsError, match="another file"):
            read_short(str(ring / "ring.h5"), {"load_factor"})
    assert draw("csv", ring / "ring.h5", "-o", ring / "out.csv") == 2
    assert "another file" in capsys.readouterr().err and not (ring / "out.csv").exists()


def test_links_inside_a_file_are_followed(ring):
    with h5py.File(ring / "ring.h5", "r+") as file:
        file.move("path/monitor/v", "path/monitor/other")
        file["path/monitor/v"] = h5py.SoftLink("/path/monitor/other")
    results = read_results(ring / "ring.h5")
    np.testing.assert_array_equal(results.column("v").values, results.column("other").values)


# Tables


@pytest.mark.parametrize("text, shown", [("=cmd|calc!A1", "'=cmd|calc!A1"), ("+1", "'+1"), ("-1", "'-1"), ("@a", "'@a"), (" =a", "' =a"), ("\t=a", "'\u2409=a"),
                                         ("C+", "C+"), ("a=b", "a=b"), ("", ""), ("a\x1bb\n", "a\u241bb\u240a"), (-1.5, -1.5), (-3, -3), (True, True)])
def test_cells(text, shown):
    assert plain_text.cell(text) == shown


def test_no_formulas_in_tables_of_results(ring, capsys):
    with h5py.File(ring / "ring.h5", "r+") as file:
        file.move("path/monitor/v", "path/monitor/=cmd|calc!A1")
        n = len(file["path/load_factor"])
        del file["path/label"]
        file["path/label"] = np.array(["=1+1", "C-", "-x"] + [""] * (n - 3), dtype="S8")
        file.attrs["title"] = "a\x1b[31mb"
        file.attrs["status"] = "complete\n=1+1"
    assert draw("csv", ring / "ring.h5", "-o", "-") == 0
    said = capsys.readouterr().out
    assert not TERMINAL.search(said)
    rows = list(csv.reader(line for line in said.splitlines() if not line.startswith("#")))
    assert "'=cmd|calc!A1" in rows[0] and not any(cell.startswith("=") for row in rows for cell in row)
    label = rows[0].index("label")
    assert [row[label] for row in rows[1:4]] == ["'=1+1", "C-", "'-x"]
    load = [float(row[rows[0].index("load_factor")]) for row in rows[1:]]
    np.testing.assert_array_equal(load, read_results(ring / "ring.h5").column("load_factor").values)


def test_no_formulas_in_tables_of_sweeps(tmp_path):
    sweep = Sweep("a", "title\n=1", "text", "deck.inp", [{"kind": "=cmd", "x": -1.5}], {}, {}, [], None, {})
    folder = type("Folder", (), {"program_hash": "0" * 64})()
    _write_csv(str(tmp_path / "a.csv"), sweep, folder, "", "", [{"points": 0, "code": 1, "message": "-o failed\nand more"}])
    rows = [line for line in (tmp_path / "a.csv").read_text().splitlines() if not line.startswith("#")]
    assert rows == ["run,kind,x,points,code,message", "1,'=cmd,-1.5,0,1,'-o failed\u240aand more"]


# Sweep files


@pytest.mark.parametrize("group, message", [
    ({"kind": ["a", "a\nb"]}, r"a.toml: \[grid\]: kind: a value has a line feed as its character 2; names and values are printable text"),
    ({"kind": "\x1b[31m"}, r"kind: a value has an escape character as its character 1"), ({"a\nb": [1]}, "the name has a line feed as its character 2"),
    ({"kind": ["a\x9bb"]}, "the control character number 155"), ({"kind": [[1]]}, "kind: .* is neither a number nor text")])
def test_values_of_sweeps_are_printable(group, message):
    with pytest.raises(ResultsError, match=message) as wrong:
        samples({"grid": group}, "a.toml")
    assert not TERMINAL.search(str(wrong.value))


@pytest.mark.parametrize("text, message", [("deck = 3", "deck must be the name of a deck"), ('gather = 3', r"gather must be a table, \[gather\]"),
                                           ("picture = 3", "picture must be a list of tables"), ("title = 3", "title must be text"),
                                           ("grid = 3", r"grid must be a table, \[grid\]")])
def test_keys_of_sweeps_have_their_kind(tmp_path, text, message):
    (tmp_path / "deck.inp").write_text("*HEADING\n")
    (tmp_path / "a.toml").write_text(text + ("" if text.startswith("deck") else '\ndeck = "deck.inp"') + ("" if text.startswith("grid") else "\n[list]\nx = [1]\n"))
    with pytest.raises(ResultsError, match=f"a.toml: {message}"):
        read_sweep(str(tmp_path / "a.toml"))


def test_messages_of_the_commands_move_no_terminal(tmp_path):
    done = command_line(tmp_path, "csv", "a\x1b[31m.h5")
    assert done.returncode == 2 and "\u241b[31m" in done.stderr and not TERMINAL.search(done.stderr)
    assert os.listdir(tmp_path) == []

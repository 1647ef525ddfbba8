"""The decks that `unilat init` writes: each is a file of input/templates, complete, and good within its tolerance; and colours.

UNILAT names the program.
"""
import os
import pathlib
import subprocess

import deck_runner as dr
import pytest

EVERY_PARAMETER = True
TEMPLATES = pathlib.Path(__file__).parent.parent / "input" / "templates"
NAMES = sorted(path.stem for path in TEMPLATES.glob("*.inp"))
# What is known of them without the program: label, number, relative difference. The ring's is exact (tests/study_values.py), the
# column's that of lesson 8, the beam's force is that of its lesson, from small slopes good to some per cent.
KNOWN = {"ring": ("LP", 81.557427564661), "column": ("LP", 2.484036)}


def unilat(*words, folder, **environment):
    return subprocess.run([os.environ["UNILAT"], *words], cwd=folder, capture_output=True, text=True, timeout=60, check=False,
                          env={**{name: value for name, value in os.environ.items() if name not in ("NO_COLOR", "FORCE_COLOR")}, **environment})


def test_the_names_are_those_of_the_help(tmp_path):
    assert NAMES == ["beam", "column", "liner", "pipe", "ring"]
    said = " ".join(unilat("--help", folder=tmp_path).stdout.split())
    assert "NAME is beam, column, liner, pipe or ring" in said and "unilat init NAME" in said


@pytest.mark.parametrize("name", NAMES)
def test_a_template_is_written_and_runs(tmp_path, name):
    assert unilat("init", name, folder=tmp_path).returncode == 0
    text = (tmp_path / f"{name}.inp").read_text()
    assert text == (TEMPLATES / f"{name}.inp").read_text()
    assert max(map(len, text.splitlines())) <= 132 and sum(line.startswith("**") for line in text.splitlines()) >= 8
    run = dr.run_deck(text)
    assert run.results.complete
    if name in KNOWN:
        label, value = KNOWN[name]
        assert abs(run.load(label) - value) <= 1.0e-6 * value


def test_nothing_is_written_over(tmp_path):
    (tmp_path / "ring.inp").write_text("mine")
    done = unilat("init", "ring", folder=tmp_path)
    assert done.returncode == 1 and "ring.inp cannot be written" in done.stderr and (tmp_path / "ring.inp").read_text() == "mine"
    assert unilat("init", "ring", "-o", "other.inp", folder=tmp_path).returncode == 0 and (tmp_path / "other.inp").exists()


def test_an_unknown_name_is_told_with_those_there_are(tmp_path):
    done = unilat("init", "bridge", folder=tmp_path)
    assert done.returncode == 1 and "init takes beam, column, liner, pipe, ring" in done.stderr and not list(tmp_path.iterdir())


def test_colours_only_where_they_are_wanted(tmp_path):
    """Messages and critical points: not in a file, not with NO_COLOR."""
    (tmp_path / "wrong.inp").write_text("*NODES\n1, 0, 0\n")
    plain = unilat("wrong.inp", folder=tmp_path)
    coloured = unilat("wrong.inp", folder=tmp_path, FORCE_COLOR="1")
    assert "\x1b" not in plain.stderr and "\x1b[31m^^^^^^\x1b[0m" in coloured.stderr
    assert unilat("wrong.inp", folder=tmp_path, FORCE_COLOR="1", NO_COLOR="1").stderr == plain.stderr
    unilat("init", "beam", folder=tmp_path)
    listing = unilat("beam.inp", folder=tmp_path, FORCE_COLOR="1").stdout
    bold = [line for line in listing.splitlines() if line.startswith("\x1b[1m")]
    assert [line.split()[2] for line in bold] == ["C+", "EP"] and "\x1b[32mPath complete\x1b[0m" in listing
    assert "\x1b" not in unilat("beam.inp", folder=tmp_path).stdout


def test_units_label_tables_and_axes(tmp_path):
    """*UNITS changes no number; words become its names, in products and quotients, too."""
    from unilat import captions, tables
    from unilat.results import Column, Units, read_results
    text = (TEMPLATES / "beam.inp").read_text()
    plain, named = text.replace("*UNITS\nmm, N\n", ""), text
    files = []
    for name, deck in (("plain", plain), ("named", named)):
        (tmp_path / f"{name}.inp").write_text(deck)
        assert unilat(f"{name}.inp", folder=tmp_path).returncode == 0
        files.append(read_results(str(tmp_path / f"{name}.h5")))
    assert [file.units for file in files] == [Units(), Units("mm", "N")]
    for name in ("path", "critical", "contact", "displacement", "forces", "candidates"):
        for one, other in zip(*(tables.table(file, name) for file in files)):
            assert (one.values == other.values).all() or one.values.dtype.kind == "f"
            assert other.units == {"length": "mm", "force": "N", "moment": "N mm", "force/length": "N/mm"}.get(one.units, one.units)
    assert files[1].monitors["tip"].units == "mm" and captions.column_label(files[1].monitors["table"]) == "table (N)"
    assert captions.column_label(Column("M", None, files[1].units.of("moment"))) == "M (N mm)"

"""tests/digest: what it stores of a run, that each change of a run is seen, and that no other is."""
import json
import os
import pathlib
import shutil

import deck_digest
import deck_runner as dr
import digest_command as command
import h5py
import numpy as np
import pytest
from unilat.results import read_results

PROGRAM = os.environ["UNILAT"]
WALLS = "column-walls"        # has contact and a branch


@pytest.fixture(scope="module")
def walls():
    return dr.run_deck(dr.example(WALLS))


@pytest.fixture(scope="module")
def decks(tmp_path_factory):
    """Folder with a deck of input/, one with an option, one with an error; and their digests."""
    folder = tmp_path_factory.mktemp("decks")
    shutil.copy(command.INPUT / f"{WALLS}.inp", folder)
    beam = dr.on_given_mesh("beam-buffers")
    (folder / "checked.inp").write_text(beam, encoding="utf-8")
    (folder / "checked.options").write_text("--check\n", encoding="utf-8")
    (folder / "error.inp").write_text(beam.replace("1, ENCASTRE", "70, ENCASTRE"), encoding="utf-8")
    assert command.main(["write", str(folder), "--program", PROGRAM]) == 0
    return folder


def compared(decks, program, capsys):
    capsys.readouterr()
    code = command.main(["compare", str(decks), "--program", str(program)])
    return code, capsys.readouterr().out


def test_a_digest_has_what_the_run_has(decks, walls):
    digests = json.loads((decks / "digests.json").read_text(encoding="utf-8"))
    assert digests["error"] == {"exit": 1, "scales": {}} and digests["checked"] == {"exit": 0, "scales": {}}
    found = digests[WALLS]
    steps = found["paths"]["steps"]
    assert (found["exit"], found["status"]) == (0, "complete")
    assert steps["labels"] == " ".join(critical.label for critical in walls.results.critical)
    assert steps["rows"] == {"1": walls.results.n_points} and len(found["paths"]) == 1 + len(walls.results.branches)
    critical = walls.only("BP")
    found = steps["critical"][steps["labels"].split().index("BP")]
    dr.assert_close(found["load_factor"], critical.load_factor, relative=1e-8)
    dr.assert_close(found["monitor push"], critical.monitors["push"], relative=1e-8)
    dr.assert_close(found["start"], walls.results.contact.start[critical.point - 1, :1], relative=1e-8)
    dr.assert_close(steps["mean"]["monitor push"], walls.column("push").mean(), relative=1e-8)


def test_the_same_program_gives_the_same_digests(decks, capsys):
    code, out = compared(decks, PROGRAM, capsys)
    assert code == 0 and out.startswith("3 decks: 0 differ, 0 differ where they may")


def test_another_program_digest_or_deck_is_seen(decks, capsys, tmp_path):
    shutil.copytree(decks, tmp_path / "other")
    (tmp_path / "other" / "error.inp").rename(tmp_path / "other" / "new.inp")
    code, out = compared(tmp_path / "other", "/bin/false", capsys)
    assert code == 1 and "error: no deck of this name" in out and "new: no digest of this name" in out
    assert "checked: exit: 0 -> 1" in out and f"{WALLS}: paths/steps/labels: C+ UZ UZ UZ BP EP -> None" in out


def test_a_run_that_does_not_end_is_seen(decks, monkeypatch, tmp_path):
    program = tmp_path / "sleep"
    program.write_text("#!/bin/sh\nexec sleep 20\n", encoding="utf-8")
    program.chmod(0o755)
    monkeypatch.setattr(command, "TIMEOUT", 0.1)
    assert "none in 0.1 s" in command.run(str(program), decks / "error.inp")["exit"]


def put(file, key, values):
    """Another dataset in the place of one."""
    attributes = dict(file[key].attrs)
    del file[key]
    file[key] = values
    file[key].attrs.update(attributes)


def scaled(key, row, factor):
    """A change of one number of a result file."""
    def change(file):
        values = file[key][()]
        values[row] *= factor
        put(file, key, values)
    return change


def replaced(key, values):
    return lambda file: put(file, key, values(file[key][()]))


def without_the_first(file):
    for key in ("critical/label", "critical/load_factor"):
        put(file, key, file[key][1:])


def differences_of(walls, change, folder):
    """Those of the run's digest and that of its changed result file."""
    file = shutil.copy(walls.results.filename, folder)
    old = deck_digest.digest(0, read_results(file))
    with h5py.File(file, "r+") as changed:
        change(changed)
    return deck_digest.compare(old, deck_digest.digest(0, read_results(file)), {})


@pytest.mark.parametrize("key, change", [
    ("paths/steps/critical/1/load_factor", scaled("critical/load_factor", 0, 1.0 + 1e-7)),
    ("paths/steps/critical/6/monitor push", scaled("critical/monitor/push", -1, 1.0 + 1e-7)),
    ("paths/steps/critical/5/bar of load_factor", scaled("critical/error", 4, 2.0)),
    ("paths/steps/mean/load_factor", scaled("path/load_factor", 7, 1.0 + 1e-6)),
    ("paths/steps/mean/monitor midspan", scaled("path/monitor/midspan", -1, 1.0 + 1e-6)),
    ("paths/steps/critical/6/start/1", scaled("contact/start", -1, 1.0 + 1e-6)),
    ("paths/HUMP - (1)/critical/1/load_factor", scaled("branch/1/critical/load_factor", 0, 1.0 + 1e-7)),
    ("paths/steps/labels", replaced("critical/label", lambda labels: np.where(labels == b"BP", b"LP", labels))),
    ("paths/steps/labels", without_the_first),
    ("paths/steps/rows/1", replaced("path/load_factor", lambda values: values[:-1])),
    ("paths/steps/rows/2", replaced("path/step", lambda steps: np.where(np.arange(len(steps)) < 5, 1, 2))),
    ("paths/steps/unstable", replaced("path/negative_pivots", lambda pivots: np.where(np.arange(len(pivots)) == 3, 1, pivots))),
    ("paths/HUMP - (1)/labels", lambda file: file.pop("branch/1")),
    ("status", lambda file: file.attrs.modify("status", "stopped: no more"))])
def test_each_change_is_seen(walls, tmp_path, key, change):
    differs, _ = differences_of(walls, change, tmp_path)
    assert key in differs


@pytest.mark.parametrize("change", [scaled("critical/load_factor", 4, 1.0 + 5e-10), scaled("path/load_factor", -1, 1.0 + 5e-10),
                                    lambda file: file.pop("performance"), lambda file: file.attrs.modify("created", "today")])
def test_what_is_no_change_is_not_seen(walls, tmp_path, change):
    assert differences_of(walls, change, tmp_path) == ({}, {})


def run_of(load=2.0, bar=1e-5, push=3.0, labels="C+ LP", rows=9, mean=1.5):
    """A digest by hand."""
    critical = [{"label": label, "load_factor": load, "bar of load_factor": bar, "monitor push": push} for label in labels.split()]
    return {"exit": 0, "scales": {"load_factor": 2.0, "monitor push": 3.0},
            "paths": {"steps": {"labels": labels, "rows": {"1": rows}, "mean": {"load_factor": mean}, "critical": critical}}}


def test_what_rounding_moves_may_differ_by_its_bar_and_no_more():
    place = "paths/steps/critical/1/"
    loose = deck_digest.may_differ([run_of(), run_of(load=2.0 + 1e-7, push=3.0 + 2e-7), run_of(push=3.0 - 1e-7)])
    assert loose[place + "load_factor"] == 1e-5                   # its bar
    dr.assert_close(loose[place + "monitor push"], 2e-6, relative=1e-6)   # without a bar: ten times the largest difference
    assert len(loose) == 4                                        # of both critical points
    for new, wrong in ((run_of(load=2.0 + 9e-6, push=3.0 - 1.9e-6), False), (run_of(load=2.0 + 1.1e-5), True),
                       (run_of(push=3.0 + 2.1e-6), True), (run_of(mean=1.5 + 1e-8), True), (run_of(labels="LP C+"), True)):
        differs, within = deck_digest.compare(run_of(), new, loose)
        assert bool(differs) == wrong and bool(within) != wrong
    assert deck_digest.compare(run_of(), run_of(load=2.0 + 9e-6), {})[0]      # not on the list


def test_a_bar_that_rounding_exceeds_is_none():
    loose = deck_digest.may_differ([run_of(bar=1e-8), run_of(bar=1e-8, load=2.0 + 1e-7)])
    dr.assert_close(loose["paths/steps/critical/1/load_factor"], 1e-6, relative=1e-6)


def test_rows_that_rounding_changes_may_be_any():
    loose = deck_digest.may_differ([run_of(), run_of(rows=10, mean=1.6)])
    assert loose == {"paths/steps/rows/1": None}
    for new in (run_of(rows=8, mean=1.4), run_of(mean=1.55)):
        assert not deck_digest.compare(run_of(), new, loose)[0]
    assert deck_digest.compare(run_of(), run_of(load=2.1), loose)[0]


def test_the_first_of_many_differences_says_all():
    found = deck_digest.differences(run_of(), run_of(labels="C+ UZ LP", rows=8, mean=1.0))
    assert list(found) == ["paths/steps/labels", "paths/steps/rows/1"]


def test_text_is_the_tree():
    tree = {"a": [run_of(), run_of()], "b": {}, "c": [], "d": 1.25, "ä": "\n"}
    assert json.loads(command.as_text(tree)) == tree


def test_a_deck_is_collected_once(tmp_path, monkeypatch):
    monkeypatch.setenv("UNILAT_COLLECT", str(tmp_path))
    text = dr.on_given_mesh("cantilever")
    for options in ((), (), ("--check", "--quiet")):
        dr.run_deck(text, *options)
    stored = sorted(file.name for file in tmp_path.glob("test_digest-test_a_deck_is_collected_once-*"))
    assert len(stored) == 3 and [name.rsplit(".")[1] for name in stored].count("inp") == 2
    options = next(tmp_path.glob("*.options"))
    assert options.read_text(encoding="utf-8") == "--check\n--quiet\n"
    assert options.with_suffix(".inp").read_text(encoding="utf-8") == text


def test_each_deck_of_input_has_its_digest():
    digests = json.loads(command.REFERENCE.read_text(encoding="utf-8"))
    assert sorted(digests) == sorted(deck.stem for deck in command.INPUT.glob("*.inp")), "write them: tests/digest write"


def test_costs_are_summed_and_a_larger_sum_fails(decks, capsys, monkeypatch):
    each = {"old": {"checked": 100.0, "error": 300.0, WALLS: 600.0}, "more": {"checked": 110.0, "error": 310.0, WALLS: 590.0},
            "much": {"checked": 100.0, "error": 300.0, WALLS: 621.0}}
    monkeypatch.setattr(command, "counted", lambda program, deck: (each[pathlib.Path(program).name][deck.stem], 30.0))
    for program, code, ratio in (("old", 0, "1.0000"), ("more", 0, "1.0100"), ("much", 1, "1.0210")):
        assert command.main(["cost", str(decks), "--program", program, "--against", "old"]) == code
        assert f"ratio {ratio} 1.0000" in capsys.readouterr().out.splitlines()[-1]


@pytest.mark.skipif(not (shutil.which("valgrind") and shutil.which("cc")), reason="valgrind or cc is not installed")
def test_instructions_and_memory_are_counted(tmp_path):
    found = []
    for times in (5000, 10000, 15000, 15000):
        program = tmp_path / "loop"
        program.write_text(f"#!/bin/sh\ni=0\nwhile [ $i -lt {times} ]; do i=$((i + 1)); done\n", encoding="utf-8")
        program.chmod(0o755)
        found.append(command.counted(str(program), command.INPUT / "ring.inp"))
    dr.assert_close(found[2][0] - found[1][0], found[1][0] - found[0][0], relative=0.05)
    dr.assert_close(found[3][0], found[2][0], relative=1e-3)
    assert found[0][0] > 1.0 and all(0.5 < peak < 20.0 for _, peak in found)    # a shell's memory, not that of Python

"""Sweeps: values of the runs, decks with ${parameters}, the pool, kills and resumes, what is gathered, pictures, errors.

UNILAT names the program.
"""

from __future__ import annotations

import csv
import io
import os
import shutil
import signal
import statistics
import subprocess
import sys
import time
from pathlib import Path

import h5py
import numpy as np
import pytest

TESTS = Path(__file__).resolve().parent
sys.path[:0] = [str(TESTS), str(TESTS.parent / "postproc")]

from postproc_runner import POSTPROC, drawn_share, module_run  # noqa: E402
from unilat.results import ResultsError, read_results  # noqa: E402
from unilat.results.reader import read_short  # noqa: E402
from unilat.sweep.pool import WIDTH, Progress  # noqa: E402
from unilat.sweep.quantities import read_quantity  # noqa: E402
from unilat.sweep.run_deck import read_decks  # noqa: E402
from unilat.sweep.sampling import samples  # noqa: E402

# A clamped strip bent by a moment of 2 pi EI/L times turns: its end has turned by turns * 2 pi, whatever EI.
DECK = """*HEADING
roll-up of a strip
** ${comments} stay as they are
*NODE
1, 0, 0
2, 1, 0
*LINE, ELSET=STRIP, TYPE=GE8
1, 2, 4
*BEAM SECTION, ELSET=STRIP, SECTION=STIFFNESS
1e6, ${EI}
*BOUNDARY
1, ENCASTRE
*MONITOR, NAME=TURN
2, UR
*STEP
*STATIC, METHOD=LOAD
0.25
*CLOAD
2, 6, ${2*pi*EI*turns}
*END STEP
"""
SWEEP = """title = "strips"
deck = "strip.inp"
[grid]
turns = [0.25, 0.5]
[latin]
runs = 3
EI = { from = 1.0, to = 10.0, scale = "log" }
[gather]
turn = "last turn"
largest = "max load_factor"
limit = "LP"
"""
# Where pictures are not what is tested: one, instead of all that fit.
PLAIN = SWEEP + "[[picture]]\nkind = \"histogram\"\nx = \"turn\"\n"
N = 6


@pytest.fixture(scope="module")
def made_once(tmp_path_factory):
    """A folder with a sweep that is complete; tests change copies of it."""
    place = tmp_path_factory.mktemp("made-once")
    (place / "strip.inp").write_text(DECK)
    (place / "strip.toml").write_text(PLAIN)
    sweep(place)
    return place


@pytest.fixture
def complete(tmp_path, made_once):
    """The folder of a complete sweep, and the files of its runs with an ending."""
    folder = tmp_path / "complete"
    shutil.copytree(made_once, folder)
    return folder, lambda ending: sorted((folder / "strip-sweep" / "runs").glob(f"*{ending}"))


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "strip.inp").write_text(DECK)
    (tmp_path / "strip.toml").write_text(SWEEP)
    return tmp_path


def options(arguments, program):
    return [*map(str, arguments), "--program", str(program or os.environ["UNILAT"])]


def command(folder, *arguments, program=None):
    return [sys.executable, "-B", "-m", "unilat.sweep", *options(arguments, program)]


def environment():
    return {**os.environ, "PYTHONPATH": str(POSTPROC)}


def sweep(folder, what="run", *arguments, code=0, program=None):
    done = module_run(folder, "unilat.sweep", *options([what, "strip.toml", *arguments], program))
    assert done.returncode == code, done.stdout + done.stderr
    return done


def table(folder, name="strip"):
    with open(folder / f"{name}-sweep" / f"{name}.csv", newline="") as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


def slow_program(folder, seconds):
    """unilat that waits before it begins."""
    program = folder / "slow"
    program.write_text(f"#!/bin/sh\nsleep {seconds}\nexec '{os.environ['UNILAT']}' \"$@\"\n")
    program.chmod(0o755)
    return program


def holding_program(folder, runs, finished):
    """unilat that begins no run once so many are finished, until the file `hold` is removed: whoever comes late finds the same."""
    (folder / "hold").touch()
    program = folder / "holding"
    program.write_text(f"#!/bin/sh\ncase \"$*\" in *-o*) while [ -e '{folder}/hold' ] && [ $(ls '{runs}' 2> /dev/null | grep -c json) -ge {finished} ]; do sleep 0.05; done;; "
                       f"esac\nexec '{os.environ['UNILAT']}' \"$@\"\n")
    program.chmod(0o755)
    return program


def begun(folder, program):
    """A sweep in the background."""
    return subprocess.Popen(command(folder, "run", "strip.toml", "-j", "2", program=program), cwd=folder, env=environment(),
                            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)


def wait_for(there, running):
    """Until something is there; a process that makes it may not end before."""
    while True:
        ended = running.poll() is not None
        if there():
            return
        assert not ended
        time.sleep(0.01)


# Values of the runs


def values(**groups):
    return samples(groups, "a.toml")


def test_a_grid_is_every_combination():
    runs = values(grid={"a": [1, 2], "b": {"from": 1, "to": 100, "count": 3, "scale": "log"}, "c": 5})
    assert [(run["a"], run["c"]) for run in runs] == [(1, 5)] * 3 + [(2, 5)] * 3
    assert [run["b"] for run in runs[:3]] == pytest.approx([1.0, 10.0, 100.0]) and runs[0]["b"] == 1.0 and runs[2]["b"] == 100.0


def test_groups_multiply():
    runs = values(list={"a": [1, 2], "b": ["x", "y"]}, seeds={"seed": 3})
    assert [(run["a"], run["b"], run["seed"]) for run in runs] == [(1, "x", 1), (1, "x", 2), (1, "x", 3),
                                                                   (2, "y", 1), (2, "y", 2), (2, "y", 3)]
    assert [run["seed"] for run in values(seeds={"seed": {"from": 5, "to": 7}})] == [5, 6, 7]


def test_a_latin_hypercube_has_one_value_in_each_class():
    runs = values(latin={"runs": 50, "seed": 3, "a": {"from": 2.0, "to": 4.0}, "b": {"mean": 1.0, "deviation": 0.5}})
    a, b = (np.array([run[name] for run in runs]) for name in "ab")
    assert sorted(np.floor((a - 2.0) / 2.0 * 50).astype(int)) == list(range(50))
    shares = [statistics.NormalDist(1.0, 0.5).cdf(value) for value in b]
    assert sorted(int(share * 50) for share in shares) == list(range(50))
    assert abs(np.corrcoef(a, b)[0, 1]) < 0.4
    assert runs == values(latin={"runs": 50, "seed": 3, "a": {"from": 2.0, "to": 4.0}, "b": {"mean": 1.0, "deviation": 0.5}})


def test_random_samples_have_their_distribution_and_depend_on_the_seed():
    group = {"runs": 4000, "seed": 1, "a": {"mean": 3.0, "deviation": 2.0}, "b": {"from": 0.1, "to": 10.0, "scale": "log"}}
    a, b = (np.array([run[name] for run in values(random=group)]) for name in "ab")
    error = 5.0 / np.sqrt(4000)       # five standard errors
    assert abs(np.mean(a) - 3.0) < 2.0 * error and abs(np.std(a) - 2.0) < 2.0 * error
    assert abs(np.mean(b < 1.0) - 0.5) < 0.5 * error
    assert values(random=group | {"seed": 2}) != values(random=group)


@pytest.mark.parametrize("groups, message", [
    ({}, "no parameters"), ({"grid": {"a": []}}, r"\[grid\]: a has no values"), ({"list": {"a": [1], "b": [1, 2]}}, "same length"),
    ({"latin": {"a": {"from": 0, "to": 1}}}, "'runs' is missing"),
    ({"latin": {"runs": 3, "a": {"from": 0, "to": 1, "scale": "log"}}}, "positive"),
    ({"random": {"runs": 3, "a": {"mean": 0, "deviation": 0}}}, "deviation > 0"), ({"seeds": {"seed": 0}}, "number of seeds"),
    ({"grid": {"a": [1]}, "seeds": {"a": 3}}, "'a' is in .grid. and in .seeds."),
    ({"grid": {"a": {"from": 1, "to": 2, "step": 1}}}, "'step' is not known")])
def test_wrong_groups_are_told(groups, message):
    with pytest.raises(ResultsError, match=message):
        samples(groups, "a.toml")


# Runs


def test_all_runs_are_made_gathered_and_drawn(folder):
    done = sweep(folder, "run", "-j", 2)
    assert f"{N} of {N} runs complete" in done.stdout and f"{N} of {N} runs" in done.stderr
    rows = table(folder)
    assert [int(row["run"]) for row in rows] == list(range(1, N + 1)) and all(row["code"] == "0" for row in rows)
    for row in rows:
        assert float(row["turn"]) == pytest.approx(2.0 * np.pi * float(row["turns"]), rel=1e-9)
        assert float(row["largest"]) == 1.0 and row["limit"] == "nan"
    with h5py.File(folder / "strip-sweep" / "strip.h5") as file:
        assert file.attrs["deck"] == DECK and file.attrs["sweep"] == SWEEP and file.attrs["unilat"].startswith("unilat ")
        np.testing.assert_array_equal(file["runs/EI"][()], [float(row["EI"]) for row in rows])
        mine = file["path/run"][()] == 4
        np.testing.assert_allclose(file["path/TURN"][()][mine], np.pi * file["path/load_factor"][()][mine], rtol=1e-9)
    names = [line.removeprefix("picture: ") for line in done.stdout.splitlines() if line.startswith("picture: ")]
    assert names and all(0.005 < drawn_share(folder / name) < 0.9 for name in names)


def test_killed_and_resumed_is_the_same_as_in_one_go(folder):
    """kill -9 of the sweep and its runs, in the middle; the CSV then has the same bytes, and finished runs stay as they are."""
    (folder / "strip.toml").write_text(PLAIN)
    one_go = folder / "one-go"
    resumed = folder / "resumed"
    program = holding_program(folder, resumed / "runs", 2)
    sweep(folder, "run", "--folder", one_go, "-j", 2, program=program)
    running = subprocess.Popen(command(folder, "run", "strip.toml", "--folder", resumed, "-j", "1", program=program), cwd=folder,
                               env=environment(), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)
    wait_for(lambda: len(list((resumed / "runs").glob("*.json"))) == 2, running)
    os.killpg(running.pid, signal.SIGKILL)
    running.wait()
    (folder / "hold").unlink()
    before = {path.name: path.stat().st_mtime_ns for path in (resumed / "runs").glob("*.json")}
    assert len(before) == 2
    assert f"{len(before)} of {N} runs complete, {N - len(before)} missing" in sweep(folder, "status", "--folder", resumed, code=1,
                                                                                   program=program).stdout
    done = sweep(folder, "run", "--folder", resumed, "-j", 2, program=program)
    assert f"{len(before)} finished before" in done.stdout
    assert (resumed / "strip.csv").read_bytes() == (one_go / "strip.csv").read_bytes()
    assert all((resumed / "runs" / name).stat().st_mtime_ns == then for name, then in before.items())
    assert not list((resumed / "runs").glob("*.part"))
    with h5py.File(resumed / "strip.h5") as first, h5py.File(one_go / "strip.h5") as second:
        for group in ("path", "critical"):
            for name in first[group]:
                np.testing.assert_array_equal(first[group][name][()], second[group][name][()])


@pytest.mark.parametrize("timeout", [None, 1])
def test_a_run_that_a_killed_sweep_left_behind_is_waited_for(folder, timeout):
    """kill -9 of the sweep alone: its run goes on and may still write. The sweep that follows leaves this run's files alone until then."""
    (folder / "strip.toml").write_text(PLAIN if timeout is None else PLAIN.replace("[grid]", f"timeout = {timeout}\n[grid]"))
    sweep(folder, "run", "--folder", folder / "one-go")
    (folder / "hold").touch()
    program = folder / "first-holds"
    program.write_text(f"#!/bin/sh\ncase \"$*\" in *-o*) if mkdir '{folder}/begun' 2> /dev/null; then while [ -e '{folder}/hold' ]; do sleep 0.02; done; fi;; "
                       f"esac\nexec '{os.environ['UNILAT']}' \"$@\"\n")
    program.chmod(0o755)
    killed = begun(folder, program)
    wait_for((folder / "begun").exists, killed)
    killed.kill()
    killed.wait()
    second = begun(folder, program)
    runs = folder / "strip-sweep" / "runs"
    try:
        if timeout is None:
            wait_for(lambda: len(list(runs.glob("*.json"))) == N - 1, second)
            time.sleep(0.2)
            assert second.poll() is None and len(list(runs.glob("*.json"))) == N - 1
        else:
            assert second.wait() == 1 and "did not end in 1 s" in (folder / "strip-sweep" / "strip.csv").read_text()
    finally:
        (folder / "hold").unlink()
    if timeout is None:
        assert second.wait() == 0
        ours, theirs = ([line for line in (place / "strip.csv").read_text().splitlines() if not line.startswith("#")]
                        for place in (folder / "strip-sweep", folder / "one-go"))
        assert ours == theirs and not [*runs.glob("*.part"), *runs.glob("*.lock")]


def test_nothing_is_run_twice_and_a_changed_deck_is_run_again(folder):
    (folder / "strip.toml").write_text(PLAIN)
    sweep(folder)
    assert f"{N} finished before" in sweep(folder).stdout
    (folder / "strip.toml").write_text(PLAIN.replace("[0.25, 0.5]", "[0.25, 0.5, 0.75]"))
    assert f"9 runs, {N} finished before" in sweep(folder).stdout
    (folder / "strip.inp").write_text(DECK.replace("1, 2, 4", "1, 2, 5"))
    assert "9 runs, 0 finished before" in sweep(folder).stdout


def test_runs_that_fail_are_listed_with_their_message_and_the_others_go_on(folder):
    (folder / "strip.inp").write_text(DECK.replace("1e6, ${EI}", "1e6, ${EI - 2}"))
    (folder / "strip.toml").write_text('deck = "strip.inp"\n[grid]\nturns = 0.25\nEI = [1, 3, 4]\n[gather]\nturn = "last TURN"\n')
    done = sweep(folder, code=1)
    assert "2 of 3 runs complete, 1 not complete" in done.stdout and "run 1 (turns = 0.25, EI = 1): " in done.stdout
    assert "exit code 1; deck and listing: " in done.stdout
    listing = Path(next(line for line in done.stdout.splitlines() if "deck and listing" in line).split(": ")[-1])
    assert "1e6, ${EI - 2}" in (folder / listing).read_text() and "---- turns=0.25 EI=1\n" in (folder / listing).read_text()
    first, second, _ = table(folder)
    assert first["code"] == "1" and "*BEAM SECTION" in first["message"] and first["turn"] == "nan" and second["code"] == "0"
    assert "3 finished before" in sweep(folder, code=1).stdout          # the same deck fails again
    assert "2 finished before" in sweep(folder, "run", "--retry", code=1).stdout


def test_a_run_that_takes_too_long_and_one_that_is_killed(folder):
    program = folder / "odd"
    program.write_text(f"#!/bin/sh\n[ \"$1\" = --expand ] && exec '{os.environ['UNILAT']}' \"$@\"\n"
                       f"case \"$*\" in *EI=1*) exec sleep 20;; esac\n[ -e '{folder}/mended' ] || kill -9 $$\nexec '{os.environ['UNILAT']}' \"$@\"\n")
    program.chmod(0o755)
    (folder / "strip.toml").write_text("deck = \"strip.inp\"\ntimeout = 3\n[grid]\nturns = 0.25\nEI = [1, 2]\n")
    first, second = table_of(folder, sweep(folder, code=5, program=program))
    assert (first["code"], first["message"]) == ("124", "took longer than 3 s") and second["code"] == "-9"
    (folder / "mended").touch()
    assert "1 finished before" in sweep(folder, code=5, program=program).stdout     # what a signal ended is made again
    assert table(folder)[1]["code"] == "0"


def table_of(folder, done):
    assert "no run has limit_load" in done.stderr
    return table(folder)


def test_interrupted_by_hand(folder):
    """Ctrl-C: finished runs stay, the sweep ends without a traceback."""
    runs = folder / "strip-sweep" / "runs"
    running = subprocess.Popen(command(folder, "run", "strip.toml", "-j", "1", program=holding_program(folder, runs, 1)), cwd=folder,
                               env=environment(), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True)
    wait_for(lambda: list(runs.glob("*.json")), running)
    os.killpg(running.pid, signal.SIGINT)
    _, said = running.communicate(timeout=30)
    assert running.returncode == 130 and "Traceback" not in said and "run it again" in said


# What goes wrong around a sweep


def test_what_is_gathered_is_what_the_whole_file_says(complete):
    for name in map(str, complete[1](".h5")):
        whole, short = read_results(name), read_short(name, {"load_factor", "arc_length"})
        assert (short.n_points, set(short.path)) == (whole.n_points, {"load_factor", "arc_length"})
        for column in (*short.path, *whole.monitors):
            one, other = short.column(column), whole.column(column)
            assert np.array_equal(one.values, other.values) and (one.units, one.description) == (other.units, other.description)
        assert [(point.label, point.point, point.load_factor, point.monitors) for point in short.critical] == \
            [(point.label, point.point, point.load_factor, point.monitors) for point in whole.critical]
        assert set(read_short(name, {"lost"}).path) == set(whole.path)       # to say which columns there are


def test_a_record_without_its_file_is_no_record(complete):
    folder, files = complete
    files(".h5")[0].unlink()
    files(".h5")[-1].unlink()
    assert f"{N - 2} of {N} runs complete, 2 missing" in sweep(folder, "status", code=1).stdout
    sweep(folder, "gather", code=1)
    assert sorted(row["message"] for row in table(folder)) == [""] * (N - 2) + ["missing"] * 2
    assert f"{N - 2} finished before" in sweep(folder).stdout and len(files(".h5")) == N


def test_broken_records_are_made_again(complete):
    """No text, half a record, a list, a record without its message, a number that is text, a byte that is none of text."""
    folder, files = complete
    for file, content in zip(files(".json"), ("", "{", "[1]", '{"code": 0}', '{"code": "0", "message": "", "seconds": 1.0}', "\0"), strict=True):
        file.write_text(content)
    assert f"0 of {N} runs complete, {N} missing" in sweep(folder, "status", code=1).stdout
    assert "0 finished before" in sweep(folder).stdout
    assert f"{N} of {N} runs complete" in sweep(folder, "status").stdout


def test_a_damaged_result_stops_nobody_and_is_made_again(complete):
    folder, files = complete
    whole = files(".h5")[2].read_bytes()
    for file, damaged in zip(files(".h5")[1:], (b"", whole[:1000], b"x" * 1000)):
        file.write_bytes(damaged)
    sweep(folder, "gather")
    told = [row["message"] for row in table(folder) if row["code"] == "-999"]
    assert len(told) == 3 and all("damaged" in message for message in told)
    assert f"{N - 3} finished before" in sweep(folder).stdout
    assert [row["code"] for row in table(folder)] == ["0"] * N


def running_programs(name):
    """Command lines of all processes that have a word."""
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        try:
            words = (process / "cmdline").read_bytes().decode(errors="replace")
        except OSError:
            continue
        if name in words and "unilat.sweep" not in words:
            found.append(words)
    return found


def threads(process):
    """All but the main one."""
    return [int(thread.name) for thread in Path(f"/proc/{process.pid}/task").iterdir() if int(thread.name) != process.pid]


@pytest.mark.skipif(not os.path.isdir("/proc/self"), reason="no /proc here")
@pytest.mark.parametrize("name, to", [("TERM", "main"), ("HUP", "main"), ("INT", "main"), ("TERM", "other")])
def test_what_ends_a_sweep_ends_its_runs(folder, name, to):
    """At once, and also where the system gives the signal to a thread that waits for a run: Python handles it in the main one."""
    program = slow_program(folder, 20)
    program.write_text(program.read_text().replace("sleep 20", "[ \"$1\" = --expand ] || sleep 20"))
    running = subprocess.Popen(command(folder, "run", "strip.toml", "-j", "2", program=program), cwd=folder,
                               env=environment(), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True)
    # A run, not the reading of the deck before it.
    wait_for(lambda: [words for words in running_programs(str(program)) if "--expand" not in words], running)
    os.kill(running.pid if to == "main" else threads(running)[0], getattr(signal, f"SIG{name}"))
    _, said = running.communicate(timeout=30)
    assert running.returncode == (130 if name == "INT" else 128 + getattr(signal, f"SIG{name}"))
    assert "run it again" in said and "Traceback" not in said
    assert not running_programs(str(program))
    assert [path.read_text() for path in (folder / "strip-sweep" / "runs").glob("*.json")] == []


def test_a_run_that_was_ended_goes_on(folder):
    """Not from its beginning, and with the same points."""
    (folder / "strip.inp").write_text(DECK.replace("0.25\n*CLOAD", "2E-4, 1E-6, 2E-4\n*CONTROLS, POINTS=10000\n*CLOAD"))
    (folder / "strip.toml").write_text('deck = "strip.inp"\n[grid]\nturns = 0.5\nEI = 1\n[gather]\nturn = "last TURN"\n'
                                       '[[picture]]\nkind = "histogram"\nx = "turn"\n')
    sweep(folder, "run", "--folder", folder / "one-go")
    with h5py.File(next((folder / "one-go" / "runs").glob("*.h5"))) as file:
        points = len(file["path/load_factor"])
    running = subprocess.Popen(command(folder, "run", "strip.toml"), cwd=folder, env=environment(), stdout=subprocess.DEVNULL,
                               stderr=subprocess.DEVNULL)
    runs = folder / "strip-sweep" / "runs"
    wait_for(lambda: list(runs.glob("*.part")), running)
    running.send_signal(signal.SIGTERM)
    assert running.wait(timeout=60) == 128 + signal.SIGTERM
    (part,) = runs.glob("*.part")
    with h5py.File(part) as file:
        assert file.attrs["status"] == "stopped: ended by SIGTERM" and 0 < len(file["path/load_factor"]) < points
    sweep(folder)
    assert (folder / "strip-sweep" / "strip.csv").read_bytes() == (folder / "one-go" / "strip.csv").read_bytes()
    (result,) = runs.glob("*.h5")
    with h5py.File(result) as file:
        assert file["performance/value"][0] < len(file["path/load_factor"]) - 1      # it counts its own points
    assert not list(runs.glob("*.part*"))


def test_of_two_sweeps_in_a_folder_one_is_refused(folder):
    (folder / "strip.toml").write_text(PLAIN)
    program = holding_program(folder, folder / "strip-sweep" / "runs", 1)
    running = subprocess.Popen(command(folder, "run", "strip.toml", "-j", "1", program=program), cwd=folder,
                               env=environment(), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    wait_for(lambda: list((folder / "strip-sweep").glob("runs/*.json")), running)
    second = sweep(folder, code=2, program=program)
    assert f"another unilat-sweep is at work in strip-sweep (process {running.pid} on" in second.stderr and second.stderr.count("\n") == 1
    assert sweep(folder, "gather", code=1, program=program).returncode == 1        # what there is may be gathered
    (folder / "hold").unlink()
    running.wait(timeout=60)
    assert running.returncode == 0


@pytest.mark.parametrize("text, message", [
    ("deck = 3", "deck must be the name of a deck"), ('deck = "a\\nb.inp"', "control characters"), ('title = 3\ndeck = "strip.inp"', "title must be text"),
    ('deck = "strip.inp"\ngather = 3', "gather must be a table"), ('deck = "strip.inp"\npicture = 3', "picture must be a list"),
    ('deck = "strip.inp"\ngrid = 3', "grid must be a table"),
    ('deck = "strip.inp"\n[grid]\nEI = 2024-01-01\n', "EI: 2024-01-01 is neither a number nor text"),
    ('deck = "strip.inp"\n[grid]\nEI = [nan]\n', "EI: nan is no number"),
    ('deck = "strip.inp"\n[grid]\nEI = "a\\nb"\n', "EI: a value has a line feed as its character 2"),
    ('deck = "strip.inp"\n[list]\nEI = 3\n', "each parameter needs a list"),
    ('deck = "strip.inp"\n[seeds]\nEI = 1000000000\n', "are the most"),
    ('deck = "strip.inp"\n[grid]\nEI = {from = 1, to = 2, count = 1000000000}\n', "are the most"),
    ('deck = "strip.inp"\n[seeds]\nEI = 2000\n[grid]\nturns = {from = 1, to = 2, count = 2000}\n', "are the most")])
def test_wrong_kinds_are_told(folder, text, message):
    (folder / "strip.toml").write_text(text)
    done = sweep(folder, code=2)
    assert message in done.stderr and done.stderr.count("\n") == 1 and "Traceback" not in done.stderr


def test_names_with_newlines_are_refused(folder):
    name = "x\ntouch pwned\n#.toml"
    (folder / name).write_text(SWEEP)
    done = module_run(folder, "unilat.sweep", *options(["run", name], None))
    assert done.returncode == 2 and "control characters" in done.stderr and not (folder / "pwned").exists()


def test_a_plan_says_how_many_how_long_and_how_large(folder):
    done = sweep(folder, "plan", "-j", "2")
    assert "6 different runs, 5 of them finished" in done.stdout
    assert "a run takes " in done.stdout and "the other 1 take about " in done.stdout and "result files: " in done.stdout
    assert "memory of a run: " in done.stdout
    assert "6 runs, 5 finished before" in sweep(folder).stdout      # what the plan ran counts


def fake_slurm(folder):
    """sbatch and scontrol that only note what they are given."""
    place = folder / "fake slurm"
    place.mkdir()
    for name in ("sbatch", "scontrol"):
        (place / name).write_text(f"#!/bin/sh\nprintf '%s\\n' \"$@\" > '{place}/{name}.words'\necho 7\n")
        (place / name).chmod(0o755)
    (place / "squeue").write_text("#!/bin/sh\n")
    (place / "squeue").chmod(0o755)
    return place


def test_a_job_asks_for_what_it_needs_and_quotes_its_names(folder):
    place = fake_slurm(folder)
    where = folder / "a 'folder' with $(touch pwned) 5 %"
    (folder / "strip.toml").write_text(PLAIN.replace("title", "timeout = 100\ntitle"))
    done = subprocess.run(command(folder, "run", "strip.toml", "--folder", where, "--slurm", "-j", "2", "--sbatch=--partition=short"), cwd=folder,
                          env=environment() | {"PATH": f"{place}:{os.environ['PATH']}"}, capture_output=True, text=True, check=False)
    assert "6 missing" in done.stdout and "Traceback" not in done.stderr, done.stdout + done.stderr
    words = (place / "sbatch.words").read_text().splitlines()
    assert {"--mem=1000M", "--time=7", "--requeue", "--cpus-per-task=2", "--array=0-0", "--partition=short"} <= set(words)
    assert words[words.index("--output") + 1] == f"{where}/slurm-%a.log".replace("5 %/", "5 %%/")
    assert not list(folder.glob("**/pwned"))
    # The job itself: told that its time is up, it ends its runs and asks for another turn.
    slow = slow_program(folder, 20)
    slow.write_text(slow.read_text().replace("sleep 20", "[ \"$1\" = --expand ] || sleep 20"))
    script = (where / "job.sh").read_text().replace(os.environ["UNILAT"], str(slow))
    (where / "job.sh").write_text(script)
    job = subprocess.Popen(["bash", str(where / "job.sh")], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                           env=environment() | {"PATH": f"{place}:{os.environ['PATH']}", "SLURM_ARRAY_JOB_ID": "7", "SLURM_ARRAY_TASK_ID": "0"})
    # A run, not the reading of the deck before it.
    wait_for(lambda: [words for words in running_programs(str(slow)) if "-o" in words], job)
    job.send_signal(signal.SIGUSR1)
    job.wait(timeout=30)
    assert (place / "scontrol.words").read_text().split() == ["requeue", "7_0"] and not running_programs(str(slow))


class Screen(io.StringIO):
    """A terminal."""

    def isatty(self):
        return True


def test_the_bar_on_a_terminal_and_the_lines_elsewhere():
    screen, log = Screen(), io.StringIO()
    for stream in (screen, log):
        progress = Progress(40, stream)
        for number in range(40):
            progress.add(1 if number == 3 else 0)
    bars = screen.getvalue().split("\r")
    assert bars[-1].startswith(f"[{'#' * WIDTH}] 40 of 40 runs, 1 not complete, ") and bars[-1].endswith("\n")
    assert screen.getvalue().count("\n") == 1
    lines = log.getvalue().splitlines()
    assert len(lines) == 10 and lines[0].startswith("4 of 40 runs, 1 not complete, ") and lines[-1].startswith("40 of 40")


# What is gathered


def test_words_of_quantities():
    word = read_quantity("C+2.shortening", "a.toml")
    assert (word.label, word.number, word.name) == ("C+", 2, "shortening")
    assert read_quantity("LP", "a.toml").name == "load_factor" and read_quantity("max v", "a.toml").how == "max"
    for wrong in ("LQ", "v", "most v", "LP.", 3):
        with pytest.raises(ResultsError, match="neither a label"):
            read_quantity(wrong, "a.toml")


@pytest.mark.parametrize("change, message", [
    (("deck = \"strip.inp\"", "deck = \"none.inp\""), "strip.toml: there is no deck none.inp"),
    (("[gather]", "[gathers]"), "'gathers' is not known"),
    (("turns = [0.25, 0.5]", "turns = [0.25, 0.5]\nlost = [1]"), "strip.inp: --set lost: the deck has no such parameter (it has: turns, EI)"),
    (("[latin]", "[latin"), "strip.toml: "), (("limit = \"LP\"", "limit = \"LPX\""), "'LPX' is neither a label"),
    (('limit = "LP"', 'limit = "LP"\n[[picture]]\nkind = "line"\nx = "lost"\ny = "limit"'), "no parameter or gathered quantity"),
    (("limit = \"LP\"", "code = \"LP\""), "'code' is a column of every sweep"),
    (("limit = \"LP\"", "EI = \"LP\""), "'EI' is a parameter and in [gather]"),
    (("EI = { from = 1.0, to = 10.0, scale = \"log\" }", ""), "[latin]: no parameters")])
def test_wrong_sweep_files_are_one_line_before_anything_runs(folder, change, message):
    assert change[0] in SWEEP
    (folder / "strip.toml").write_text(SWEEP.replace(*change))
    done = sweep(folder, code=2)
    assert done.stdout == "" and message in done.stderr and done.stderr.count("\n") == 1
    assert not (folder / "strip-sweep").exists()


def test_no_slurm_here_is_told(folder):
    done = subprocess.run(command(folder, "run", "strip.toml", "--slurm"), cwd=folder, env=environment() | {"PATH": str(folder)},
                          capture_output=True, text=True, check=False)
    assert done.returncode == 2 and "there is no sbatch here" in done.stderr


PICTURES = """
[[picture]]
kind = "histogram"
x = "turn"
[[picture]]
kind = "scatter"
x = "EI"
y = "turn"
value = "turns"
[[picture]]
kind = "line"
x = "turns"
y = "turn"
[[picture]]
kind = "line"
x = "EI"
y = "turn"
over = "turns"
x_scale = "log"
[[picture]]
kind = "map"
x = "EI"
y = "turns"
value = "turn"
"""


def test_pictures(folder):
    (folder / "strip.toml").write_text(SWEEP + PICTURES)
    done = sweep(folder)
    names = [line.removeprefix("picture: ") for line in done.stdout.splitlines() if line.startswith("picture: ")]
    assert len(names) == 5 and all(0.005 < drawn_share(folder / name) < 0.95 for name in names)
    (folder / "strip.toml").write_text(SWEEP + "[[picture]]\nkind = \"pie\"\n")
    assert "kind is one of line, map" in sweep(folder, "draw", code=5).stderr


def test_example_sweeps_are_good():
    """Every sweep file of input/sweeps can be read, and its first and last deck are good decks."""
    from unilat.sweep.sweep_file import read_sweep
    files = sorted((TESTS.parent / "input" / "sweeps").glob("*.toml"))
    assert files
    for name in files:
        read = read_sweep(str(name))
        decks = read_decks(os.environ["UNILAT"], read.deck_path, read.settings)
        for deck in (decks[0], decks[-1]):
            done = subprocess.run([os.environ["UNILAT"], "--check", *deck.options], input=deck.text, capture_output=True, text=True,
                                  check=False)
            assert done.returncode == 0, done.stderr


def test_a_word_a_whole_number_and_every_digit_reach_the_deck(folder):
    (folder / "part.inp").write_text("1, 2, ${n}\n")
    (folder / "strip.inp").write_text(DECK.replace("TYPE=GE8\n1, 2, 4\n", "TYPE=${type}\n*INCLUDE, FILE=part.inp\n"))
    value = 0.1 + 0.2
    (folder / "strip.toml").write_text(f'deck = "strip.inp"\n[list]\nn = [3, 4]\ntype = ["GE6", "GE8"]\n[grid]\nturns = {value!r}\nEI = 1\n'
                                       '[gather]\nturn = "last TURN"\n'
                                       '[[picture]]\nkind = "line"\nx = "n"\ny = "turn"\n')
    sweep(folder)
    for key in (folder / "strip-sweep" / "runs").glob("*.h5"):
        with h5py.File(key) as file:
            assert file["parameters"].attrs["turns"] == value
            assert (int(file["parameters"].attrs["n"]), file["parameters"].attrs["type"]) in ((3, "GE6"), (4, "GE8"))
            assert len(file["mesh/elements"]) == file["parameters"].attrs["n"]


def test_included_decks_may_depend_on_the_values(folder):
    for n in (3, 5):
        (folder / f"part-{n}.inp").write_text(f"1, 2, {n}\n")
    (folder / "strip.inp").write_text(DECK.replace("1, 2, 4\n", "*INCLUDE, FILE=part-${n}.inp\n"))
    (folder / "strip.toml").write_text('deck = "strip.inp"\n[grid]\nn = [3, 5]\nturns = 0.25\nEI = 1\n[gather]\nturn = "last TURN"\n')
    sweep(folder)
    sizes = set()
    for key in (folder / "strip-sweep" / "runs").glob("*.h5"):
        with h5py.File(key) as file:
            sizes.add(len(file["mesh/elements"]))
    assert sizes == {3, 5}

"""Runs in pieces are the run in one go, to the last bit; and runs that go on with other steps."""
import os
import shutil
import signal
import subprocess
import time

import h5py
import numpy as np
import pytest

import deck_runner as dr

ENDED = 6
WAIT = 120.0
CANTILEVER = dr.on_given_mesh("cantilever")


def run(folder, *arguments, code=0):
    done = subprocess.run([os.environ["UNILAT"], "--quiet", *arguments], cwd=folder, capture_output=True, text=True, timeout=WAIT, check=False)
    assert done.returncode == code, f"{done.returncode} {done.stderr}"
    return done


def differences(first, second):
    """Names of what is not the same to the bit in two result files, but for what a run cost and where it stands."""
    found = []
    with h5py.File(first) as one, h5py.File(second) as other:
        names, more = set(), set()
        one.visit(names.add)
        other.visit(more.add)
        ours = {name for name in names ^ more if not name.startswith("restart")}
        for name in sorted(names & more):
            if name.startswith(("performance", "restart")):
                continue
            a, b = one[name], other[name]
            if isinstance(a, h5py.Dataset) and (a.shape != b.shape or a[()].tobytes() != b[()].tobytes()):
                found.append(name)
            found += [f"{name}@{key}" for key in a.attrs if np.any(a.attrs[key] != b.attrs[key])]
        if one.attrs["status"] != other.attrs["status"]:
            found.append("status")
    return sorted(ours) + found


def rows(path):
    with h5py.File(path) as file:
        return len(file["path/load_factor"])


@pytest.fixture(scope="module")
def ring_once(tmp_path_factory):
    """The deck `ring` and its run in one go."""
    folder = tmp_path_factory.mktemp("ring")
    (folder / "deck.inp").write_text(dr.example("ring"))
    run(folder, "-o", "whole.h5", "deck.inp")
    return folder


@pytest.fixture
def ring(tmp_path, ring_once):
    """A folder with a copy of both."""
    shutil.copytree(ring_once, tmp_path, dirs_exist_ok=True)
    return tmp_path


# spans, foundations that touch and leave, walls, steps, branches, modes as imperfections, corners
DECKS = ["ring", "ring-winkler", "column-walls", "euler", "pipe-lift", "arch-shallow-hinged", "roorda-frame", "column", "cradle", "beam-rollers",
         "cam"]


@pytest.mark.parametrize("name", DECKS)
def test_a_run_in_pieces_is_the_run_in_one_go(tmp_path, name):
    (tmp_path / "deck.inp").write_text(dr.example(name))
    start = time.monotonic()
    done = subprocess.run([os.environ["UNILAT"], "--quiet", "-o", "whole.h5", "deck.inp"], cwd=tmp_path, timeout=WAIT, check=False)
    length = time.monotonic() - start
    pieces = 0
    options = ["-o", "pieces.h5", "deck.inp"]
    limit = 0.4 * length
    code = ENDED
    while code == ENDED:
        pieces += 1
        code = subprocess.run([os.environ["UNILAT"], "--quiet", "--max-seconds", str(limit), *options], cwd=tmp_path, timeout=WAIT,
                              capture_output=True, check=False).returncode
        if (tmp_path / "pieces.h5").exists() and "restart" in h5py.File(tmp_path / "pieces.h5"):
            options = ["--restart", "pieces.h5"]
        limit *= 1.3 if pieces > 3 else 1.0
    assert code == done.returncode
    assert differences(tmp_path / "whole.h5", tmp_path / "pieces.h5") == []


@dr.release_only
def test_killed_at_once_and_gone_on(tmp_path):
    """What a kill leaves goes on, too; the rows behind where the run stood are made again."""
    text = dr.with_static(CANTILEVER, "METHOD=LOAD", "0.01, 1E-6, 0.01").replace("*CLOAD", "*CONTROLS, POINTS=6000\n*CLOAD")
    (tmp_path / "deck.inp").write_text(text)
    run(tmp_path, "-o", "whole.h5", "deck.inp")
    process = subprocess.Popen([os.environ["UNILAT"], "--quiet", "-o", "pieces.h5", "deck.inp"], cwd=tmp_path)
    while not (tmp_path / "pieces.h5").exists():
        if process.poll() is not None:
            pytest.skip("the run was over before it was flushed")
        time.sleep(0.005)
    process.send_signal(signal.SIGKILL)
    process.wait()
    if "restart" not in h5py.File(tmp_path / "pieces.h5"):
        pytest.skip("killed before it stood anywhere")
    run(tmp_path, "--restart", "pieces.h5")
    assert differences(tmp_path / "whole.h5", tmp_path / "pieces.h5") == []


def killed(folder, shim, at):
    """A run of deck.inp that is killed at a write, by a clock with which each point takes seconds; the number of writes."""
    (folder / "pieces.h5").unlink(missing_ok=True)
    environment = {**os.environ, "LD_PRELOAD": dr.preload(shim), "KILL_MODE": "before", "KILL_LOG": "count", "KILL_COPY": "flushed", "KILL_AT": str(at)}
    subprocess.run([os.environ["UNILAT"], "--quiet", "-o", "pieces.h5", "deck.inp"], cwd=folder, timeout=WAIT, capture_output=True, check=False, env=environment)
    return int((folder / "count").read_text())


@dr.release_only
@pytest.mark.parametrize("name", ["column-walls", "ring"])
def test_what_a_file_has_behind_where_its_run_stood_is_made_again(tmp_path, shim, name):
    """All the rest of the run: branches, null vectors, rows of every table."""
    (tmp_path / "deck.inp").write_text(dr.example(name))
    run(tmp_path, "-o", "whole.h5", "deck.inp")
    total = killed(tmp_path, shim, 0)
    for part in (0.3, 0.6):
        killed(tmp_path, shim, int(part * total))
        shutil.copy(tmp_path / "whole.h5", tmp_path / "mixed.h5")
        with h5py.File(tmp_path / "pieces.h5") as early, h5py.File(tmp_path / "mixed.h5", "a") as mixed:
            assert early["restart/rows"][0] < len(mixed["path/load_factor"])
            del mixed["restart"]
            early.copy("restart", mixed)
        run(tmp_path, "--restart", "mixed.h5")
        assert differences(tmp_path / "whole.h5", tmp_path / "mixed.h5") == []


@dr.release_only
def test_a_run_that_ends_in_its_first_buckling_step_begins_again(tmp_path):
    (tmp_path / "deck.inp").write_text(dr.example("arch-imperfect"))
    run(tmp_path, "-o", "whole.h5", "deck.inp")
    run(tmp_path, "--max-seconds", "0.000001", "-o", "pieces.h5", "deck.inp", code=ENDED)
    run(tmp_path, "--restart", "pieces.h5")
    assert differences(tmp_path / "whole.h5", tmp_path / "pieces.h5") == []


@pytest.mark.parametrize("name, curves", [("ring-critical", ["CRITICAL"]), ("arch-imperfect", ["SMALLER", "LARGER"])])
def test_limit_curves_go_on(tmp_path, shim, name, curves):
    """Killed at its writes, each run goes on with the limit point that was to come; those before are not sought again."""
    (tmp_path / "deck.inp").write_text(dr.example(name))
    run(tmp_path, "-o", "whole.h5", "deck.inp")
    total = killed(tmp_path, shim, 0)
    work, before = [], []
    for part in (0.45, 0.95):
        killed(tmp_path, shim, int(part * total))
        with h5py.File(tmp_path / "pieces.h5") as file:
            before.append(sum(len(file[f"limit_curve/{curve}"].get("parameter", ())) for curve in curves))
        run(tmp_path, "--restart", "pieces.h5")
        assert differences(tmp_path / "whole.h5", tmp_path / "pieces.h5") == []
        work.append(iterations(tmp_path / "pieces.h5"))
    assert before == sorted(before) and before[0] + 3 < before[-1], before
    assert work == sorted(work, reverse=True) and 3 * work[-1] < work[0], work


@dr.release_only
def test_points_that_take_long_are_not_sought_again(ring, shim):
    """Though each of them is flushed as soon as it is there, before the run stands behind it."""
    killed(ring, shim, int(0.9 * killed(ring, shim, 0)))
    run(ring, "--restart", "pieces.h5")
    assert differences(ring / "whole.h5", ring / "pieces.h5") == []
    assert 3 * iterations(ring / "pieces.h5") < iterations(ring / "whole.h5")


def iterations(path):
    """Newton iterations of the run that wrote a file last."""
    with h5py.File(path) as file:
        return dict(zip(file["performance/counter"].asstr(), file["performance/value"]))["Newton iterations"]


def test_more_points_are_as_if_they_had_been_asked_for(tmp_path):
    few = dr.changed(CANTILEVER, ("*CLOAD", "*CONTROLS, POINTS=3\n*CLOAD"))
    (tmp_path / "few.inp").write_text(few)
    (tmp_path / "all.inp").write_text(few.replace("POINTS=3", "POINTS=100"))
    run(tmp_path, "-o", "whole.h5", "all.inp")
    run(tmp_path, "-o", "few.h5", "few.inp", code=2)
    before = (tmp_path / "few.h5").read_bytes()
    run(tmp_path, "--restart", "few.h5", "-o", "pieces.h5", "all.inp")
    assert differences(tmp_path / "whole.h5", tmp_path / "pieces.h5") == []
    assert (tmp_path / "few.h5").read_bytes() == before          # the file that it began with stays
    run(tmp_path, "--restart", "few.h5", "all.inp")
    assert differences(tmp_path / "whole.h5", tmp_path / "few.h5") == []


@pytest.mark.parametrize("method", ["LOAD", "CYLINDRICAL", "LINEARISED"])
def test_another_end_and_another_strategy(tmp_path, method):
    """From the end of the path: its points stay, and those that follow are on the same path."""
    (tmp_path / "deck.inp").write_text(CANTILEVER)
    longer = dr.changed(CANTILEVER, ("LOAD, ABOVE, 10.", "LOAD, ABOVE, 14."))
    if method != "LOAD":
        longer = dr.with_static(longer, f"METHOD={method}", "1., 1E-6, 0.3")
    (tmp_path / "longer.inp").write_text(longer)
    run(tmp_path, "-o", "results.h5", "deck.inp")
    n = rows(tmp_path / "results.h5")
    with h5py.File(tmp_path / "results.h5") as file:
        first = file["path/load_factor"][()]
    run(tmp_path, "--restart", "results.h5", "longer.inp")
    with h5py.File(tmp_path / "results.h5") as file:
        load = file["path/load_factor"][()]
        assert np.array_equal(load[:n], first) and len(load) > n and np.all(np.diff(load) > 0.0)
        assert load[-1] == pytest.approx(14.0, rel=1e-6)
        last = file["path/monitor/w"][-1]
    run(tmp_path, "-o", "whole.h5", "longer.inp")
    with h5py.File(tmp_path / "whole.h5") as file:
        assert last == pytest.approx(file["path/monitor/w"][-1], rel=1e-6)


def test_a_complete_run_has_nothing_to_go_on_with(tmp_path):
    (tmp_path / "deck.inp").write_text(CANTILEVER)
    run(tmp_path, "-o", "whole.h5", "deck.inp")
    run(tmp_path, "--restart", "whole.h5", "-o", "again.h5")
    assert differences(tmp_path / "whole.h5", tmp_path / "again.h5") == []


def test_what_cannot_go_on_is_told(tmp_path):
    (tmp_path / "deck.inp").write_text(CANTILEVER)
    run(tmp_path, "-o", "whole.h5", "deck.inp")
    assert "there is no result file none.h5" in run(tmp_path, "--restart", "none.h5", code=1).stderr
    (tmp_path / "text.h5").write_text("notes")
    assert "is no result file" in run(tmp_path, "--restart", "text.h5", code=1).stderr
    with h5py.File(tmp_path / "foreign.h5", "w") as file:
        file.attrs["program"] = "another"
    assert "is no result file" in run(tmp_path, "--restart", "foreign.h5", code=1).stderr
    (tmp_path / "half.h5").write_bytes((tmp_path / "whole.h5").read_bytes()[:3000])
    assert "is no result file" in run(tmp_path, "--restart", "half.h5", code=1).stderr
    (tmp_path / "twice.inp").write_text(CANTILEVER + CANTILEVER[CANTILEVER.index("*STEP"):])
    assert "the deck has 2 steps" in run(tmp_path, "--restart", "whole.h5", "twice.inp", code=1).stderr
    (tmp_path / "finer.inp").write_text(CANTILEVER.replace(", 16\n", ", 17\n"))
    assert "another structure" in run(tmp_path, "--restart", "whole.h5", "finer.inp", code=1).stderr
    for name, change in (("old.h5", lambda file: file["restart"].attrs.__setitem__("layout", "0")), ("none-of-it.h5", lambda file: file.pop("restart"))):
        (tmp_path / name).write_bytes((tmp_path / "whole.h5").read_bytes())
        with h5py.File(tmp_path / name, "a") as file:
            change(file)
        assert "run its deck again" in run(tmp_path, "--restart", name, code=1).stderr
    (tmp_path / "cut.h5").write_bytes((tmp_path / "whole.h5").read_bytes())
    with h5py.File(tmp_path / "cut.h5", "a") as file:
        words = file["restart/state"][:100]
        del file["restart/state"]
        file["restart/state"] = words
    assert "damaged" in run(tmp_path, "--restart", "cut.h5", code=1).stderr
    assert "--restart" in run(tmp_path, "--restart", "whole.h5", "--check", "deck.inp", code=1).stderr


# ---- from a named point --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name, points", [("ring", ["LP", "uz3", "1", "8", "26"]), ("roorda-frame", ["2", "1:1", "2:6"]), ("column-walls", ["C+1", "14", "1:5"]),
                                          ("arch-imperfect", ["lp2"])])
def test_a_named_point_is_on_the_same_path(tmp_path, name, points):
    """Without a change the run from there is the run that there was, with its steps, branches and limit curves."""
    (tmp_path / "deck.inp").write_text(dr.example(name))
    run(tmp_path, "-o", "whole.h5", "deck.inp")
    for point in points:
        run(tmp_path, "--restart", "whole.h5", "--from", point, "-o", "again.h5")
        assert differences(tmp_path / "whole.h5", tmp_path / "again.h5") == []
    if points[0] != "LP":      # behind the end of a path there would be more of it
        run(tmp_path, "--restart", "whole.h5", "--from", points[0], "-o", "again.h5", "deck.inp")
        assert differences(tmp_path / "whole.h5", tmp_path / "again.h5") == []


def path_of(path):
    with h5py.File(path) as file:
        return file["path/load_factor"][()], file["path/label"].asstr()[()]


@pytest.mark.parametrize("method", ["CYLINDRICAL", "SPHERICAL", "LINEARISED", "MINIMUM RESIDUAL", "VARIABLE LOAD"])
def test_from_a_limit_point_with_another_strategy(ring, method):
    """The points before stay as they are; behind, where the load falls, the path is the same curve."""
    text = dr.example("ring")
    changes = (("METHOD=CYLINDRICAL", f"METHOD={method}"), ("1., 1E-9, 0.02", "1., 1E-9, 0.01"), ("v, ABOVE, 0.6", "v, ABOVE, 0.55"))
    (ring / "other.inp").write_text(dr.changed(text, *changes[method == "CYLINDRICAL":]))
    run(ring, "--restart", "whole.h5", "--from", "LP1", "-o", "other.h5", "other.inp")
    whole, labels = path_of(ring / "whole.h5")
    other, others = path_of(ring / "other.h5")
    n = list(labels).index("LP") + 1
    assert np.array_equal(whole[:n + 1], other[:n + 1]) and list(labels[:n]) == list(others[:n])
    assert len(other) > n + 5 and np.all(np.diff(other[n - 1:]) < 0.0) and others[-1] == "EP"
    with h5py.File(ring / "other.h5") as file:
        assert file["path/monitor/v"][-1] == pytest.approx(0.55, abs=1e-9)
    assert (path_of(ring / "whole.h5")[0] == whole).all()


def load_of_branch(path):
    with h5py.File(path) as file:
        return file["branch/1/path/load_factor"][()]


@dr.release_only
def test_from_a_limit_point_of_a_branch_with_another_strategy_and_another_end(tmp_path):
    """All before it stays as it is, and behind it is the same curve, up to the new end; what it leads to goes on by itself, too."""
    text = dr.example("arch-deep-hinged")
    (tmp_path / "deck.inp").write_text(text)
    (tmp_path / "other.inp").write_text(dr.changed(text, ("METHOD=CYLINDRICAL", "METHOD=SPHERICAL"), ("v, ABOVE, 2.02", "v, ABOVE, 1.5")))
    run(tmp_path, "-o", "whole.h5", "deck.inp")
    run(tmp_path, "--restart", "whole.h5", "--from", "1:LP1", "-o", "other.h5", "other.inp")
    assert np.array_equal(path_of(tmp_path / "whole.h5")[0], path_of(tmp_path / "other.h5")[0])
    whole, other = load_of_branch(tmp_path / "whole.h5"), load_of_branch(tmp_path / "other.h5")
    n = int(np.argmax(whole)) + 1
    assert np.array_equal(whole[:n + 1], other[:n + 1]) and not np.any(np.isin(other[n + 1:], whole))
    with h5py.File(tmp_path / "other.h5") as file, h5py.File(tmp_path / "whole.h5") as first:
        v = file["branch/1/path/monitor/v"][()]
        assert v[-1] == pytest.approx(1.5, abs=1e-9)
        assert np.allclose(other[n:], np.interp(v[n:], first["branch/1/path/monitor/v"][()], whole), atol=0.02)
    run(tmp_path, "--restart", "other.h5", "-o", "again.h5")
    assert differences(tmp_path / "other.h5", tmp_path / "again.h5") == []


@dr.release_only
def test_a_branch_goes_on_with_another_strategy(tmp_path, shim):
    """By load control, with the first increment of the step, where the run stood on the branch."""
    text = dr.example("arch-deep-hinged")
    (tmp_path / "deck.inp").write_text(text)
    (tmp_path / "other.inp").write_text(dr.changed(text, ("METHOD=CYLINDRICAL", "METHOD=LOAD"), ("0.1, 1E-9, 0.02", "0.01, 0.01, 0.01")))
    killed(tmp_path, shim, int(0.8 * killed(tmp_path, shim, 0)))
    n = len(load_of_branch(tmp_path / "pieces.h5"))
    run(tmp_path, "--restart", "pieces.h5", "other.inp", "-o", "other.h5", code=2)
    steps = np.diff(load_of_branch(tmp_path / "other.h5"))
    assert n > 10 and np.allclose(np.abs(steps[n + 1:n + 4]), 0.01)


@dr.release_only
def test_a_run_that_was_killed_before_its_point_does_not_go_on_as_another(ring, shim):
    environment = {**os.environ, "LD_PRELOAD": dr.preload(shim), "KILL_MODE": "before", "KILL_LOG": "count", "KILL_COPY": "flushed"}
    command = [os.environ["UNILAT"], "--quiet", "--restart", "whole.h5", "--from", "EP1", "-o", "pieces.h5"]
    for at in (0, 0.5):
        at = int(at and at * int((ring / "count").read_text()))
        subprocess.run(command, cwd=ring, timeout=WAIT, capture_output=True, check=False, env={**environment, "KILL_AT": str(at)})
    assert 2 < rows(ring / "pieces.h5") < rows(ring / "whole.h5")
    assert "does not say where its run stood" in run(ring, "--restart", "pieces.h5", code=1).stderr


def test_points_that_are_not_there_are_told(ring):
    for name in ("LP2", "LP0", "UZ", "BP1", "27", "0", "1.5", "LP1x", "99999999999", "C", "+", " "):
        said = run(ring, "--restart", "whole.h5", "--from", name, "-o", "other.h5", code=1).stderr
        if name.strip():
            assert "it has the points 1 to 26, of which some are UZ1 (7) UZ2 (9)" in said and "LP1 (14)" in said and "EP1 (26)" in said
    for name, said in (("1:LP1", "branch 1 of whole.h5 has no points"), ("x:LP1", "the number of a branch"), (":3", "the number of a branch")):
        assert said in run(ring, "--restart", "whole.h5", "--from", name, "-o", "other.h5", code=1).stderr
    for words in (["--from", "3"], ["--from", "3", "-o", "whole.h5"], ["--from"], ["--from", "3", "--from", "4", "-o", "other.h5"]):
        assert "--from" in run(ring, "--restart", "whole.h5", *words, code=1).stderr
    assert "--from without --restart" in run(ring, "--from", "3", "-o", "other.h5", "deck.inp", code=1).stderr
    assert not (ring / "other.h5").exists()
    run(ring, "--model", "-o", "model.h5", "deck.inp")
    assert "has no points" in run(ring, "--restart", "model.h5", "--from", "1", "-o", "other.h5", code=1).stderr


def test_points_that_are_not_found_again_are_told(ring):
    """A file made in pieces with two decks: the deck in it does not lead to its first points."""
    with h5py.File(ring / "whole.h5", "a") as file:
        file["path/load_factor"][4] += 1e-3
    said = run(ring, "--restart", "whole.h5", "--from", "5", "-o", "other.h5", code=2).stderr
    assert "does not find the points in the file" in said

"""Runs in pieces are the run in one go, to the last bit; and runs that go on with other steps."""
import os
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


# spans, foundations that touch and leave, walls, steps, branches, modes as imperfections, corners
DECKS = ["ring", "ring-winkler", "column-walls", "euler", "pipe-lift", "arch-shallow-hinged", "roorda-frame", "column", "cradle", "beam-rollers"]


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
        file["restart/state"].resize((100,))
    assert "damaged" in run(tmp_path, "--restart", "cut.h5", code=1).stderr
    assert "--restart" in run(tmp_path, "--restart", "whole.h5", "--check", "deck.inp", code=1).stderr

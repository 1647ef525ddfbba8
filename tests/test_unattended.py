"""Runs that nobody watches: kills, signals, limits, full disks, readers and other runs at the same time.

Whatever happens, the result file is that of the last flush or, before the first one, what was there before.
"""
import contextlib
import os
import random
import resource
import shutil
import signal
import subprocess
import time

import h5py
import pytest

import deck_runner as dr

REFUSED, ENDED = 5, 6
# Ends after a million points, or when somebody ends it: minutes later.
ENDLESS = dr.changed(dr.on_given_mesh("cantilever"), ("*CLOAD", "*CONTROLS, POINTS=1000000\n*CLOAD"), (", JOB=cantilever", ""))
ENDLESS = "".join("1E-5, 1E-6, 1E-5\n" if before.upper().startswith("*STATIC") else line
                  for before, line in zip(["", *ENDLESS.splitlines()], ENDLESS.splitlines(keepends=True)))
SHORT = dr.changed(dr.on_given_mesh("cantilever"), (", JOB=cantilever", ""))
WAIT = 60.0      # seconds for what takes a fraction of one


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "endless.inp").write_text(ENDLESS)
    (tmp_path / "short.inp").write_text(SHORT)
    return tmp_path


def start(folder, *arguments, **more):
    return subprocess.Popen([os.environ["UNILAT"], *arguments], cwd=folder, stdin=subprocess.DEVNULL, text=True,
                            **{"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE, **more})


def run(folder, *arguments, **more):
    process = start(folder, *arguments, **more)
    out, err = process.communicate(timeout=WAIT)
    return process.returncode, out, err


def lengths(path):
    """Numbers of rows of all datasets that have a row a point."""
    with h5py.File(path, "r") as file:
        file.visititems(lambda name, item: item[()] if isinstance(item, h5py.Dataset) else None)   # every byte can be read
        sets = [file["path"], file["path/monitor"], file["path/monitor_rate"]]
        return file.attrs["status"], {len(item) for group in sets for item in group.values() if isinstance(item, h5py.Dataset)}


def wait_for(path, process):
    """Until a run has flushed."""
    end = time.monotonic() + WAIT
    while True:
        ended = process.poll() is not None
        if path.exists() and path.stat().st_size > 0:
            return
        assert time.monotonic() < end and not ended, process.communicate()
        time.sleep(0.01)


def wait_for_another(path, process):
    """Until a run has flushed once more."""
    before = path.stat().st_ino
    end = time.monotonic() + WAIT
    while path.stat().st_ino == before:
        assert time.monotonic() < end and process.poll() is None, process.communicate()
        time.sleep(0.01)


# ---- kills ---------------------------------------------------------------------------------------------------------------


def killed_run(folder, shim, at, mode):
    """A run that is killed at an operation, over an earlier result; the number of operations."""
    for name in os.listdir(folder):
        if ".h5" in name or name in ("count", "flushed"):
            os.remove(folder / name)
    shutil.copy(folder / "former", folder / "short.h5")
    environment = {**os.environ, "LD_PRELOAD": dr.preload(shim), "KILL_AT": str(at), "KILL_MODE": mode, "KILL_LOG": "count",
                   "KILL_COPY": "flushed"}
    code, _, err = run(folder, "--quiet", "short.inp", env=environment)
    assert code == (0 if at == 0 else -signal.SIGKILL), err
    return int((folder / "count").read_text())


@dr.release_only
def test_killed_at_every_write(shim, folder):
    """The file is the one of the last flush to the bit, or the former one; the next run is not in the way of what is left."""
    assert run(folder, "--quiet", "short.inp")[0] == 0
    os.replace(folder / "short.h5", folder / "former")
    former = (folder / "former").read_bytes()
    total = killed_run(folder, shim, 0, "before")
    flushes, leftovers = set(), set()
    for mode in ("before", "half"):
        for at in range(1, total + 1):
            killed_run(folder, shim, at, mode)
            there = (folder / "short.h5").read_bytes()
            if (folder / "flushed").exists():
                assert there == (folder / "flushed").read_bytes(), f"{mode} {at}"
                status, rows = lengths(folder / "short.h5")
                assert len(rows) == 1 and status in ("running", "complete"), f"{mode} {at}: {rows}"
                flushes |= rows
            else:
                assert there == former, f"{mode} {at}: the former result was lost before the first flush"
            left = frozenset(name for name in os.listdir(folder) if ".h5" in name)
            if left not in leftovers:
                leftovers.add(left)
                assert run(folder, "--quiet", "short.inp")[0] == 0
                assert sorted(name for name in os.listdir(folder) if ".h5" in name) == ["short.h5"]
    assert total > 30 and len(flushes) > 5, f"{total} operations, rows {sorted(flushes)}"
    assert len(leftovers) > 1


@dr.release_only
def test_killed_at_random(folder):
    """50 kills at any time: every row that a reader has seen is there. The time grows where the machine needs longer for the first rows."""
    chance = random.Random(1)
    result = folder / "endless.h5"
    seen = 0
    longest = 0.3
    for _ in range(50):
        process = start(folder, "--quiet", "endless.inp")
        slept = chance.uniform(0.0, longest)
        time.sleep(slept)
        before = max(lengths(result)[1]) if result.exists() else 0
        process.kill()
        process.communicate()
        if result.exists():
            status, rows = lengths(result)
            assert len(rows) == 1 and status == "running"
            seen += before > 0
        elif slept > 0.5 * longest:
            longest *= 1.2
        if chance.random() < 0.3:
            result.unlink(missing_ok=True)
    assert seen > 5


# ---- signals and limits --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["TERM", "INT", "HUP", "XCPU", "XFSZ", "PIPE"])
def test_signals_end_a_run_with_its_points(folder, name):
    process = start(folder, "--quiet", "endless.inp")
    wait_for(folder / "endless.h5", process)
    process.send_signal(getattr(signal, f"SIG{name}"))
    _, err = process.communicate(timeout=WAIT)
    status, rows = lengths(folder / "endless.h5")
    assert process.returncode == ENDED and f"ended by SIG{name}" in err
    assert status.startswith(f"stopped: ended by SIG{name}") and len(rows) == 1
    assert sorted(os.listdir(folder)) == ["endless.h5", "endless.inp", "short.inp"]


def test_ignored_signals_stay_ignored(folder):
    """As under nohup."""
    process = start(folder, "--quiet", "endless.inp", preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN))
    wait_for(folder / "endless.h5", process)
    process.send_signal(signal.SIGHUP)
    wait_for_another(folder / "endless.h5", process)
    process.send_signal(signal.SIGTERM)
    process.communicate(timeout=WAIT)
    assert process.returncode == ENDED and lengths(folder / "endless.h5")[0].startswith("stopped: ended by SIGTERM")


def test_seconds_are_limited(folder):
    before = time.monotonic()
    code, _, err = run(folder, "--quiet", "--max-seconds", "0.5", "endless.inp")
    assert code == ENDED and "the seconds of --max-seconds are used up" in err and time.monotonic() - before >= 0.5
    assert lengths(folder / "endless.h5")[0] == "stopped: the seconds of --max-seconds are used up"
    for wrong in ("0", "-1", "soon", "1e400", ""):
        assert run(folder, "--max-seconds", wrong, "endless.inp")[0] == 1


# Two rollers pinch a rod with forces of a million times EI / L^2: at the last of some 25 points no increment converges, and trials of contact sets take a minute.
PINCHED = """*HEADING, JOB=pinched
Two rollers pinch a rod
*NODE
1, 0.0, 0.0
2, 1.6657223596215336, 0.0
3, 3.0, 0.0
*LINE, ELSET=ROD, NSET=ROD, TYPE=GE8
1, 2
*LINE, ELSET=ROD, NSET=ROD, TYPE=GE8
2, 3
*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS
859557.824459359, 1.0, , 1.0, 0.0
*IMPERFECTION, ELSET=ROD, SHAPE=SINE
6.3036836856800526e-06, 4.0, 0.0
*BOUNDARY
1, ENCASTRE
*OBSTACLE, NAME=LOWER, TYPE=CIRCLE, SIDE=OUTSIDE
0.9032249634584153, -0.42198971215616876, 0.40308005695514676
*CONTACT, OBSTACLE=LOWER, NSET=ROD
*OBSTACLE, NAME=UPPER, TYPE=CIRCLE, SIDE=OUTSIDE
1.1806199596093827, 0.7463300522169884, 0.7292354140638303
*CONTACT, OBSTACLE=UPPER, NSET=ROD
*MONITOR, NAME=push, OBSTACLE=LOWER
RN
*STEP
*ACCURACY, TOLERANCE=1e-05
*STATIC, METHOD=CYLINDRICAL
0.02, , 0.03
*OBSTACLE MOTION
LOWER, -0.1433414866834983, 0.2731540170849756
UPPER, 0.17632193057031265, -0.2234554726798125
*STOP
LOAD, ABOVE, 1.0
*END STEP
"""


@dr.release_only
def test_seconds_are_limited_inside_an_increment(tmp_path):
    """The trials of contact sets, in which the run is by then, end, too; the increment is dropped, and the run goes on from before it."""
    (tmp_path / "pinched.inp").write_text(PINCHED)
    limit = 4.0
    before = time.monotonic()
    code, _, err = run(tmp_path, "--quiet", "--max-seconds", str(limit), "pinched.inp")
    assert code == ENDED and "the seconds of --max-seconds are used up" in err and time.monotonic() - before < 2.0 * limit, err
    status, points = lengths(tmp_path / "pinched.h5")
    assert status.startswith("stopped: the seconds of --max-seconds are used up")
    code, _, err = run(tmp_path, "--quiet", "--max-seconds", "1", "--restart", "pinched.h5", "-o", "more.h5")
    assert code == ENDED, err
    with h5py.File(tmp_path / "pinched.h5") as one, h5py.File(tmp_path / "more.h5") as more:
        n = one["restart/rows"][0]
        assert n >= 20 and len(more["path/load_factor"]) >= n
        assert (one["path/load_factor"][:n] == more["path/load_factor"][:n]).all()


def test_branches_end_with_the_run(tmp_path):
    """What ends the run on a branch is no trouble of that branch: the others do not follow."""
    text = dr.on_given_mesh("euler")
    done = dr.run_deck(text, "--max-seconds", "0.000001", code=ENDED)
    assert done.results.status.endswith("the seconds of --max-seconds are used up")


def test_cpu_time_is_limited(folder):
    code, _, err = run(folder, "--quiet", "endless.inp", preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (1, 30)))
    assert code == ENDED and "the limit of CPU time is used up" in err
    assert lengths(folder / "endless.h5")[0].startswith("stopped: ended by SIGXCPU")


def often_flushed(shim):
    """Environment in which a run writes its result file at nearly every point, however fast the machine is."""
    return {**os.environ, "LD_PRELOAD": dr.preload(shim), "KILL_AT": "0", "KILL_LOG": "count", "KILL_COPY": "flushed"}


@pytest.mark.parametrize("kilobytes", [1, 300])
def test_files_are_limited(folder, shim, kilobytes):
    """The limit stops the file that is to come; the one that is there stays, says why, and is what a restart goes on from."""
    result = folder / "endless.h5"
    result.write_bytes(b"")
    code, _, err = run(folder, "--quiet", "endless.inp", env=often_flushed(shim),
                       preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (1024 * kilobytes,) * 2))
    assert code == REFUSED and "cannot write the result file endless.h5: File too large" in err
    assert not (folder / "endless.h5.part").exists()
    if kilobytes == 1:
        assert result.read_bytes() == b""
        return
    status, rows = lengths(result)
    assert status == "stopped: cannot write the result file endless.h5: File too large" and max(rows) > 5
    code, _, _ = run(folder, "--quiet", "--max-seconds", "0.5", "--restart", "endless.h5", "-o", "more.h5")
    assert code == ENDED and lengths(folder / "more.h5")[0].startswith("stopped: the seconds")


@pytest.mark.skipif(os.environ.get("UNILAT_CHECKED") == "1", reason="the same in either build")
@pytest.mark.parametrize("megabytes", [110, 150, 206, 210, 214, 300])
def test_memory_is_limited(folder, megabytes):
    """Too little is said at once; nothing hangs."""
    code, _, err = run(folder, "--quiet", "short.inp",
                       preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (megabytes << 20,) * 2))
    assert code in (0, REFUSED), f"{code} {err}"
    assert code == 0 or "not enough memory" in err
    assert code == REFUSED or megabytes > 200


def test_memory_that_runs_out_is_no_error_of_the_deck(folder):
    (folder / "long.inp").write_text("*HEADING\n" + f"{'x' * 9_000_000}\n" * 4)
    (folder / "many.inp").write_text("*INCLUDE, FILE=long.inp\n" * 20)
    code, _, err = run(folder, "many.inp", preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (300 << 20,) * 2))
    assert code == REFUSED, err
    assert err.endswith("there is not enough memory\n")


def test_stack_is_limited(folder):
    assert run(folder, "--quiet", "short.inp", preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_STACK, (256 << 10, 64 << 20)))[0] == 0
    code, _, err = run(folder, "--quiet", "short.inp", preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_STACK, (256 << 10,) * 2))
    assert code == REFUSED and "stack" in err


# ---- outputs that cannot be written --------------------------------------------------------------------------------------


def test_listing_that_cannot_be_written(folder):
    with open("/dev/full", "w", encoding="utf-8") as full:
        code, _, err = run(folder, "short.inp", stdout=full)
        assert code == REFUSED and "the listing cannot be written: No space left on device" in err
        assert lengths(folder / "short.h5")[0] == "complete"
        for words in (["--check", "short.inp"], ["--expand", "short.inp"], ["--cards"], ["--help"], ["--version"]):
            code, _, err = run(folder, *words, stdout=full)
            assert code == REFUSED and "cannot be written" in err, words


def test_reader_of_the_listing_leaves(folder):
    """As with `| head -1`: the run ends, and its points are in the result file."""
    process = start(folder, "endless.inp", stdout=subprocess.PIPE)
    process.stdout.readline()
    process.stdout.close()
    err = process.stderr.read()
    process.wait(timeout=WAIT)
    assert process.returncode == ENDED and "SIGPIPE" in err
    assert lengths(folder / "endless.h5")[0].startswith("stopped: ended by SIGPIPE")


def test_no_standard_output_at_all(folder):
    assert run(folder, "short.inp", preexec_fn=lambda: os.close(1))[0] == 0
    assert lengths(folder / "short.h5")[0] == "complete"


@pytest.fixture
def small_disk(tmp_path):
    """A file system of 1 MB; for root only."""
    place = tmp_path / "disk"
    place.mkdir()
    done = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", str(place)], capture_output=True, check=False)
    if done.returncode != 0:
        pytest.skip("no file system of its own here")
    yield place
    subprocess.run(["umount", str(place)], check=True)


def test_full_disk(folder, shim, small_disk):
    """The run ends; what was flushed is there, and its status says why no more is."""
    result = small_disk / "o.h5"
    code, _, err = run(folder, "--quiet", "-o", str(result), "endless.inp", env=often_flushed(shim))
    assert code == REFUSED and "No space left on device" in err
    status, rows = lengths(result)
    assert status == f"stopped: cannot write the result file {result}: No space left on device" and len(rows) == 1
    assert set(os.listdir(small_disk)) <= {"o.h5"}
    with contextlib.suppress(OSError), open(small_disk / "rest", "wb", buffering=0) as file:
        while True:
            file.write(b"x" * 4096)
    before = result.read_bytes()
    code, _, err = run(folder, "--quiet", "-o", str(result), "short.inp")
    assert code == REFUSED and "No space left on device" in err
    assert result.read_bytes() == before


# ---- names ---------------------------------------------------------------------------------------------------------------


def test_foreign_files_stay(folder):
    with h5py.File(folder / "foreign.h5", "w") as file:
        file["measured"] = [1.0, 2.0]
    (folder / "notes.h5").write_text("notes")
    for name, words in (("foreign.h5", "none of unilat's"), ("notes.h5", "no HDF5 file"), ("short.inp", "no HDF5 file")):
        before = (folder / name).read_bytes()
        code, _, err = run(folder, "--quiet", "-o", name, "short.inp")
        assert code == REFUSED and words in err and (folder / name).read_bytes() == before
    assert run(folder, "--quiet", "--force", "-o", "foreign.h5", "short.inp")[0] == 0
    assert lengths(folder / "foreign.h5")[0] == "complete"


def test_what_is_no_plain_file_stays(folder):
    os.mkfifo(folder / "fifo.h5")
    (folder / "folder.h5").mkdir()
    for name in ("fifo.h5", "folder.h5", "/dev/null", "/dev/full"):
        code, _, err = run(folder, "--quiet", "--force", "-o", name, "short.inp")
        assert code == REFUSED and ("not a plain file" in err or "directory" in err)


def test_links_are_followed(folder):
    (folder / "elsewhere").mkdir()
    os.symlink("elsewhere/real.h5", folder / "link.h5")
    os.symlink("link.h5", folder / "second.h5")
    for _ in range(2):      # to nothing yet, then to a result
        assert run(folder, "--quiet", "-o", "second.h5", "short.inp")[0] == 0
        assert os.path.islink(folder / "link.h5") and os.path.islink(folder / "second.h5")
        assert lengths(folder / "elsewhere" / "real.h5")[0] == "complete"
        os.utime(folder / "elsewhere" / "real.h5", (0, 0))
    assert os.stat(folder / "elsewhere" / "real.h5").st_mtime == 0
    assert run(folder, "--quiet", "-o", "second.h5", "short.inp")[0] == 0
    assert os.stat(folder / "elsewhere" / "real.h5").st_mtime > 0


def test_damaged_result_is_kept_and_blocks_nobody(folder):
    assert run(folder, "--quiet", "short.inp")[0] == 0
    half = (folder / "short.h5").read_bytes()[:2000]
    (folder / "short.h5").write_bytes(half)
    for name in ("short.h5.damaged", "short.h5.damaged-2"):
        (folder / "short.h5").write_bytes(half)
        code, _, err = run(folder, "--quiet", "short.inp")
        assert code == 0 and name in err
        assert (folder / name).read_bytes() == half and lengths(folder / "short.h5")[0] == "complete"


# ---- others at the same time ---------------------------------------------------------------------------------------------


def test_of_two_runs_one_is_refused(folder):
    for locks in ("TRUE", "FALSE"):
        for _ in range(3):
            both = [start(folder, "--quiet", "endless.inp", env={**os.environ, "HDF5_USE_FILE_LOCKING": locks}) for _ in range(2)]
            end = time.monotonic() + WAIT
            while all(process.poll() is None for process in both):
                assert time.monotonic() < end
                time.sleep(0.01)
            # The other one goes on until it is told to end, after its first rows: before, it could not know of the signal.
            (other,) = [process for process in both if process.poll() is None]
            wait_for(folder / "endless.h5", other)
            other.send_signal(signal.SIGTERM)
            told = [process.communicate(timeout=WAIT)[1] for process in both]
            codes = [process.returncode for process in both]
            assert sorted(codes) == [REFUSED, ENDED], told
            assert f"another run is writing it (process {both[codes.index(ENDED)].pid} on" in told[codes.index(REFUSED)]


def test_file_can_be_read_at_any_time(folder):
    """Plain h5py, with locks: no reading fails, however fast the machine reads or writes: readings go on until the file was replaced twice."""
    process = start(folder, "--quiet", "endless.inp")
    wait_for(folder / "endless.h5", process)
    rows, tries = set(), 0
    while process.poll() is None and (tries < 100 or len(rows) < 3):
        _, found = lengths(folder / "endless.h5")
        assert len(found) == 1
        rows |= found
        tries += 1
    ended = process.poll()
    process.kill()
    process.communicate()
    assert ended is None


def test_file_that_is_removed_or_cut_on_the_way(folder):
    for meddle, words in ((os.remove, "was removed"), (lambda name: os.truncate(name, 0), "was changed")):
        (folder / "endless.h5").unlink(missing_ok=True)
        process = start(folder, "--quiet", "endless.inp")
        wait_for(folder / "endless.h5", process)
        meddle(folder / "endless.h5")
        wait_for(folder / "endless.h5", process)
        process.send_signal(signal.SIGTERM)
        _, err = process.communicate(timeout=WAIT)
        assert process.returncode == REFUSED and words in err and "it was written again" in err
        status, rows = lengths(folder / "endless.h5")
        assert status.startswith("stopped: ") and len(rows) == 1

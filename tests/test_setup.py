"""The commands: what they say when something is missing, and what they refuse. Nothing is installed or built here."""

import dataclasses
import os
import pty
import re
import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "postproc")]

import make_branch_file  # noqa: E402
import make_result_file  # noqa: E402
from unilat import deck_pictures  # noqa: E402
from unilat.results import read_results  # noqa: E402

TOOLS = ("bash env dirname basename mkdir awk sed grep cat tail head rm mv tee nproc id find wc "
         "gfortran cmake ninja h5fc python3").split()


@pytest.fixture
def machine(tmp_path):
    """A PATH with the usual tools and no apt-get; tests take tools away or put false ones there."""
    folder = tmp_path / "bin"
    folder.mkdir()
    for tool in TOOLS:
        found = shutil.which(tool)
        assert found, tool
        (folder / tool).symlink_to(found)
    return folder


def fake(machine, name, text):
    tool = machine / name
    tool.unlink(missing_ok=True)
    tool.write_text(f"#!{shutil.which('bash')}\n{text}\n")
    tool.chmod(0o755)


def environment(machine, **more):
    """All there is, and matplotlib's list of the machine's fonts, which takes seconds to make."""
    return {"PATH": str(machine), "HOME": str(machine), "UNILAT_BUILD_ROOT": str(machine.parent / "build"), "UNILAT_PYTHON": sys.executable,
            "XDG_CACHE_HOME": os.environ.get("XDG_CACHE_HOME", str(Path.home() / ".cache")), **more}


def run(machine, command, *arguments):
    """Of python3 these tests need that it has the modules: empty ones do, and are imported in no time."""
    modules = machine.parent / "modules"
    modules.mkdir(exist_ok=True)
    for name in ("h5py", "numpy", "matplotlib", "pytest"):
        (modules / f"{name}.py").touch()
    done = subprocess.run([str(ROOT / command), *arguments], env=environment(machine, PYTHONPATH=str(modules)), text=True, timeout=120,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    return done.returncode, done.stdout


@pytest.fixture
def deck():
    decks = sorted(path.stem for path in (ROOT / "input").glob("*.inp"))
    if not decks:
        pytest.skip("no deck in input/")
    return decks[0]


@pytest.mark.parametrize("command", ["input/run", "tests/run", "tests/processors"])
def test_without_apt_the_exact_command_is_printed(machine, command, deck):
    for tool in ("gfortran", "ninja"):
        (machine / tool).unlink()
    status, text = run(machine, command, *([deck] if command == "input/run" else []))
    assert status == 4
    assert f"{command}: missing: gfortran ninja-build\n" in text
    assert "sudo apt-get update && sudo apt-get install -y --no-install-recommends gfortran ninja-build\n" in text


def test_a_user_without_sudo_gets_the_command_too(machine, deck):
    (machine / "gfortran").unlink()
    fake(machine, "apt-get", "echo must not run; exit 0")
    fake(machine, "id", "echo 1000")
    fake(machine, "sudo", "exit 1")
    status, text = run(machine, "input/run", deck)
    assert status == 4
    assert "installing" not in text
    assert "install -y --no-install-recommends gfortran\n" in text


@pytest.mark.parametrize("root", [True, False])
def test_failing_apt_is_reported_with_the_command(machine, deck, root):
    (machine / "gfortran").unlink()
    fake(machine, "apt-get", "echo E: no network; exit 100")
    fake(machine, "id", "echo 0" if root else "echo 1000")
    fake(machine, "sudo", 'if [[ $1 == -n ]]; then exit 0; fi; "$@"')
    status, text = run(machine, "input/run", deck)
    assert status == 4
    assert "input/run: installing gfortran\n" in text
    assert "E: no network" in text
    assert "install -y --no-install-recommends gfortran\n" in text


def test_apt_gets_what_is_missing_and_no_more(machine, deck):
    for tool in ("gfortran", "ninja"):
        (machine / tool).unlink()
    fake(machine, "id", "echo 0")
    fake(machine, "apt-get", f'echo "$@" >> "{machine}/calls"')
    run(machine, "input/run", deck)
    assert (machine / "calls").read_text().splitlines() == [
        "update -qq", "install -y -q --no-install-recommends gfortran ninja-build"]


def test_a_machine_without_python_needs_it_and_its_modules(tmp_path):
    """Each a package of its own, as apt-get wants them."""
    setup = tmp_path / "setup.sh"
    setup.write_text((ROOT / "input/setup.sh").read_text().replace("/usr/bin/python3", str(tmp_path / "no-python3")))
    script = f'root="{tmp_path}" me=me; source "{setup}"; mapfile -t need < <(missing_modules h5py numpy); printf "<%s>" "${{need[@]}}"'
    told = subprocess.run(["bash", "-c", script], capture_output=True, text=True, check=True).stdout
    assert told == "<python3><python3-h5py><python3-numpy>"


def test_decks_are_listed(machine):
    status, text = run(machine, "input/run")
    assert status == 0
    for path in (ROOT / "input").glob("*.inp"):
        assert f"\n   {path.stem} " in text


def test_unknown_deck_is_refused(machine):
    status, text = run(machine, "input/run", "no-such-deck")
    assert status == 1
    assert "there is no deck input/no-such-deck.inp" in text and len(text.splitlines()) == 1


@pytest.mark.parametrize("kind, folder", [("sweep", "sweeps"), ("map", "maps"), ("study", "studies")])
def test_sweeps_maps_and_studies_are_listed_and_an_unknown_one_is_refused(machine, kind, folder):
    status, text = run(machine, "input/run", f"--{kind}", "no-such-one")
    assert status == 1 and f"there is no {kind} input/{folder}/no-such-one.toml" in text
    for path in (ROOT / "input" / folder).glob("*.toml"):
        assert f"\n   {path.stem} " in text


def test_unknown_option_of_the_tests_is_refused(machine):
    status, text = run(machine, "tests/run", "--quick")
    assert status == 64
    assert "usage: tests/run" in text


@pytest.fixture
def copied(machine, tmp_path):
    """A copy of the project without its decks, and a unilat that only copies `made.h5`; nothing is built."""
    project = tmp_path / "project"
    for folder in ("input", "postproc", ".cmake"):
        shutil.copytree(ROOT / folder, project / folder, ignore=shutil.ignore_patterns("*.inp"))
    fake(machine, "cmake", "exit 0")
    (project / "src").mkdir()
    (project / "CMakeLists.txt").touch()
    (project / "src" / "unilat.f90").touch()
    (tmp_path / "build" / "release").mkdir(parents=True)
    fake(tmp_path / "build" / "release", "unilat", f'[ "$1" = --expand ] && {{ echo "*HEADING"; exit 0; }}\n{shutil.which("cp")} "{tmp_path}/made.h5" "$2"; exit 2')
    return project


def run_copied(machine, project, deck_text):
    (project / "input" / "rod.inp").write_text(deck_text)
    done = subprocess.run([str(project / "input/run"), "rod"], env=environment(machine), text=True, timeout=120,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    pictures = sorted(path.name for path in (machine.parent / "build" / "results" / "rod").glob("*.png"))
    return done.returncode, done.stdout, pictures


def test_pictures_of_what_the_results_have(machine, copied):
    """Two hints for one script give two pictures; the exit code is that of unilat."""
    make_branch_file.write_branched(machine.parent / "made.h5")
    status, text, pictures = run_copied(machine, copied, "*HEADING\n** plot_limit_curve: --curve soil\n"
                                        "** plot_limit_curve: --curve dead\n** plot_modes: --modes 1\nrod\n")
    assert status == 2, text
    assert pictures == ["rod_curve-2.png", "rod_curve.png", "rod_modes.png", "rod_path.png", "rod_shape.png"]


def test_reactions_are_drawn_when_the_deck_asks_and_others_left_out_when_it_says_none(machine, copied):
    make_result_file.write_ring(machine.parent / "made.h5")
    status, text, pictures = run_copied(machine, copied, "*HEADING\nrod\n")
    assert pictures == ["rod_contact.png", "rod_path.png", "rod_shape.png"], text
    status, text, pictures = run_copied(machine, copied, "*HEADING\n** plot_path: none\n** plot_reaction: --label LP\n"
                                        "** plot_reaction: --quantity gap\nrod\n")
    assert status == 2, text
    assert pictures == ["rod_contact.png", "rod_reaction-2.png", "rod_reaction.png", "rod_shape.png"]


def test_a_deck_anywhere_and_its_check(machine, copied, tmp_path):
    """By its path, from any folder; --check goes to unilat, without results."""
    make_result_file.write_ring(tmp_path / "made.h5")
    mine = tmp_path / "my decks"
    mine.mkdir()
    (mine / "rod.inp").write_text("*HEADING\n** plot_path: none\n** plot_shape: none\n** plot_contact: none\nrod\n")

    def run_here(*words):
        done = subprocess.run([str(copied / "input/run"), *words], env=environment(machine), cwd=mine, text=True, timeout=120,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        return done.returncode, done.stdout

    own = tmp_path / "build" / "results" / "own" / "rod"
    for name in ("rod.inp", "../my decks/rod.inp", str(mine / "rod.inp")):
        status, text = run_here(name)
        assert status == 2 and (own / "rod.h5").exists() and (own / "rod.lst").exists(), text
        shutil.rmtree(own)
    fake(tmp_path / "build" / "release", "unilat", 'echo "$@"')
    status, text = run_here("rod.inp", "--check")
    assert status == 0 and text == f"--check {mine}/rod.inp\n" and not own.exists()
    status, text = run_here("rod.inp", "-o", "x.h5")
    assert status == 1 and "leave out -o" in text


def test_results_stay_until_a_run_has_begun(machine, copied, tmp_path):
    """A call that fails before the run leaves what the last one made; one that begins leaves nothing of it."""
    make_result_file.write_ring(tmp_path / "made.h5")
    deck = "*HEADING\n** plot_shape: none\n** plot_contact: none\nrod\n"
    _, _, pictures = run_copied(machine, copied, deck)
    results = tmp_path / "build" / "results" / "rod"
    kept = {path.name: path.stat().st_mtime_ns for path in results.iterdir()}
    assert pictures and {"rod.h5", "rod.lst", *pictures} == set(kept)
    good = (tmp_path / "build" / "release" / "unilat").read_text()
    fake(tmp_path / "build" / "release", "unilat", 'echo "wrong deck" >&2; exit 1')
    status, _, _ = run_copied(machine, copied, deck)
    assert status == 1 and kept == {path.name: path.stat().st_mtime_ns for path in results.iterdir()}
    (tmp_path / "build" / "release" / "unilat").write_text(good)
    status, _, pictures = run_copied(machine, copied, "*HEADING\n** plot_path: none\n** plot_shape: none\n** plot_contact: none\nrod\n")
    assert status == 2 and not pictures


def test_cmake_runs_only_where_a_source_is_newer(machine, copied, tmp_path):
    calls = tmp_path / "calls"
    fake(machine, "cmake", f'echo "$@" >> "{calls}"')
    fake(tmp_path / "build" / "release", "unilat", "exit 1")      # nothing is drawn

    def builds():
        calls.unlink(missing_ok=True)
        run_copied(machine, copied, "*HEADING\nrod\n")
        return len(calls.read_text().splitlines()) if calls.exists() else 0

    assert [builds(), builds()] == [2, 0]
    (copied / "src" / "unilat.f90").touch()
    assert [builds(), builds()] == [2, 0]
    (copied / "src" / "new.f90").touch()
    assert [builds(), builds()] == [2, 0]
    (copied / "src" / "new.f90").unlink()
    assert [builds(), builds()] == [2, 0]
    fake(machine, "cmake", f'echo "$@" >> "{calls}"; exit 1')
    (copied / "src" / "unilat.f90").touch()
    assert [builds() > 0, builds() > 0] == [True, True]      # what failed is tried again


def test_progress_of_builds_tests_and_packages_on_a_terminal():
    """Steps done, all steps, and the time left, in one line that is wiped at the end."""
    lines = [*(f"[{k}/12] Generating Fortran dependencies for {k}.f90" for k in range(1, 7)), *(f"[{k}/12] Building {k}" for k in range(7, 13)),
             "  3/4 Test  #7: test_x .......   Passed    0.10 sec", "1 upgraded, 1 newly installed, 0 to remove and 7 not upgraded.",
             "Get:1 http://x x", "Get:2 http://x y", "Unpacking x (1-1) ...", "Setting up x (1-1) ..."]
    terminal, its_end = pty.openpty()
    subprocess.run(["bash", "-c", f'root={ROOT}; me=tests/run; source "$root/input/setup.sh"; show_progress building'], input="\n".join(lines) + "\n",
                   text=True, stderr=its_end, check=True, timeout=60)
    os.close(its_end)
    shown = os.read(terminal, 100000).decode()
    os.close(terminal)
    # On a busy machine the time left is known by then.
    assert re.search(r"tests/run: building \[6/12\](, about \d+ s left)?\x1b\[K", shown)
    assert "tests/run: building [12/12], about 0 s left" in shown and "[3/4]" in shown and "[4/6]" in shown
    assert shown.endswith("\r\x1b[K")


def test_a_sweep_runs_in_its_results_folder(machine, copied):
    """Every run of the false unilat stops early, with results."""
    make_result_file.write_cantilever(machine.parent / "made.h5")
    (copied / "input" / "sweeps" / "rods.inp").write_text("*HEADING\n${a}\n")
    (copied / "input" / "sweeps" / "rods.toml").write_text('deck = "rods.inp"\n[grid]\na = [1, 2, 3]\n[gather]\ntip = "last tip"\n')
    done = subprocess.run([str(copied / "input/run"), "--sweep", "rods", "-j", "2"], env=environment(machine), text=True, timeout=120,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    results = machine.parent / "build" / "results" / "rods"
    assert done.returncode == 1 and "0 of 3 runs complete, 3 not complete" in done.stdout, done.stdout
    assert (results / "rods.csv").read_text().splitlines()[-1].startswith("3,3,0.3,2,2,")
    assert list(results.glob("*.png"))


def test_no_pictures_of_what_is_empty(machine, copied):
    """A buckling step alone follows no path and stores no fields."""
    make_branch_file.write_branched(machine.parent / "made.h5")
    with h5py.File(machine.parent / "made.h5", "a") as file:
        for name in ("path", "fields", "branch", "limit_curve"):
            del file[name]
        file["path/load_factor"] = []
        file["fields/displacement"] = np.zeros((0, 21, 3))
        for name in ("parameter", "rigid", "load_factor"):
            file[f"limit_curve/soil/{name}"] = []
    status, text, pictures = run_copied(machine, copied, "*HEADING\nrod\n")
    assert status == 2, text
    assert pictures == ["rod_modes.png"]


def test_no_path_of_one_point(machine):
    """Such as the start of a buckling step: a dot says nothing."""
    made = machine.parent / "made.h5"
    make_result_file.write_cantilever(made)
    for points, drawn in ((2, True), (1, False)):
        assert ("path" in deck_pictures.pictures(dataclasses.replace(read_results(made), n_points=points))) == drawn

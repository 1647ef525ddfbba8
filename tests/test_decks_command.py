"""The command line with whole decks: exit codes, names of result files, what is printed and what is not."""
import os
import pathlib
import re
import subprocess

import h5py
import numpy as np
import pytest

import deck_runner as dr

# Load control into the limit point of a shallow arch of two rods (Williams' toggle, without bending at the apex).
TOGGLE = """*HEADING, JOB=toggle
Half of a shallow toggle frame under load control
*NODE
1, 0., 0.
2, 1., 0.05
*LINE, ELSET=ROD
1, 2, 8
*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS
1E4, 0.2
*BOUNDARY
1, ENCASTRE
2, XSYMM
*MONITOR, NAME=v
2, U2, -1.
*STEP
*STATIC, METHOD=LOAD
0.1, 1E-4, 0.1
*CLOAD
2, 2, -1.
*STOP
LOAD, ABOVE, 10.
*END STEP
"""
BAD = "*HEADING\nbad\n*NODE\n1, 0., 0.\n*BOUNDARY\n9, 1\n"


def without_job(text):
    return dr.changed(text, ("*HEADING, JOB=cantilever", "*HEADING"))


def test_0_complete():
    run = dr.run_deck(dr.on_given_mesh("cantilever"), code=0)
    assert run.results.status == "complete" and run.results.complete
    assert run.stderr == ""


def test_1_error_in_the_deck():
    run = dr.run_deck(BAD, code=1)
    assert run.files == ["deck.inp"] and run.stdout == ""
    assert "node 9" in run.stderr


@pytest.mark.parametrize("options", [["--wrong"], ["-o"], ["no-such-file.inp"], ["a.inp", "b.inp"],
                                     ["--check", "-o", "x.h5"]])
def test_1_error_in_the_command(options):
    run = dr.run_deck(dr.on_given_mesh("cantilever"), *options, code=1, name=None)
    assert run.files == [] and run.stdout == "" and run.stderr.startswith("unilat: ")


def test_2_stopped_early():
    """The path up to the limit point is in the file, which tells why it ends there, and so does standard error."""
    run = dr.run_deck(TOGGLE, code=2)
    results = run.results
    assert results.status.startswith("stopped: ") and len(results.status) > len("stopped: ")
    assert results.status in run.stderr and results.status[len("stopped: "):] in run.stdout
    assert not results.complete and results.n_points >= 3
    dr.assert_monotone(results.column("load_factor").values, rising=True)
    for column in (*results.path.values(), *results.monitors.values()):
        assert len(column.values) == results.n_points


def test_load_control_ends_next_to_the_limit_point():
    """Increments go down to 1E-4; displacement control passes the point and tells where it is."""
    stopped = dr.run_deck(TOGGLE, code=2)
    passed = dr.run_deck(dr.changed(dr.with_static(TOGGLE, "METHOD=DISPLACEMENT, MONITOR=v", "0.002, 1E-6, 0.002"),
                                    ("LOAD, ABOVE, 10.", "v, ABOVE, 0.05")))
    highest = passed.labelled("LP")[0].load_factor
    last = stopped.column("load_factor")[-1]
    assert highest - 2e-4 <= last <= highest


def test_2_points_used_up():
    run = dr.run_deck(dr.changed(dr.on_given_mesh("cantilever"), ("*CLOAD", "*CONTROLS, POINTS=3\n*CLOAD")), code=2)
    assert run.results.status.startswith("stopped: ")
    assert run.results.n_points == 4     # the start and three more


def test_2_nothing_holds_the_structure():
    run = dr.run_deck(dr.changed(dr.on_given_mesh("cantilever"), ("1, ENCASTRE", "1, PINNED"), ("1E12, 1.", "1E4, 1.")),
                      code=2)
    assert "hold" in run.results.status


def test_5_results_cannot_be_written():
    run = dr.run_deck(dr.on_given_mesh("cantilever"), "-o", os.path.join("no", "such", "folder.h5"), code=5)
    assert run.files == ["deck.inp"] and "no/such/folder.h5" in run.stderr


def test_name_from_option():
    assert dr.run_deck(dr.on_given_mesh("cantilever"), "-o", "other.h5").files == ["deck.inp", "other.h5"]


def test_name_from_job():
    assert dr.run_deck(dr.on_given_mesh("cantilever")).files == ["cantilever.h5", "deck.inp"]


def test_name_from_deck():
    run = dr.run_deck(without_job(dr.on_given_mesh("cantilever")), name="some.deck.inp")
    assert run.files == ["some.deck.h5", "some.deck.inp"]


def test_standard_input():
    run = dr.run_deck(dr.on_given_mesh("cantilever"), name=None)
    assert run.files == ["cantilever.h5"]
    same = dr.run_deck(dr.on_given_mesh("cantilever"))
    assert np.array_equal(run.column("w"), same.column("w"))


def test_standard_input_without_a_job():
    assert dr.run_deck(without_job(dr.on_given_mesh("cantilever")), name=None).files == ["unilat.h5"]


def test_check_computes_nothing():
    run = dr.run_deck(dr.on_given_mesh("ring"), "--check", "--", name=None)
    assert run.files == [] and run.stderr == ""
    assert "160 GE4" in run.stdout and "LP" not in run.stdout.split()


def test_check_of_a_deck_without_steps():
    model = dr.on_given_mesh("cantilever").split("*STEP")[0]
    assert dr.run_deck(model, "--check").files == ["deck.inp"]
    dr.run_deck(model, code=1)


RULER = """*NODE
1, 0., 0.
2, 300., 0.
*LINE, ELSET=RULER
1, 2, 4
*BEAM SECTION, ELSET=RULER, SECTION=STIFFNESS
5250000., 437500., , 0.2
{supports}*STEP
*STATIC, METHOD=LOAD
0.1
*CLOAD
{node}, 2, -10.
2, 6, 40.
*END STEP
*STEP
*STATIC, METHOD=LOAD
0.1
*DLOAD
RULER, GRAV, 3., 0., -1.
*POLE LOAD
2, 5., 300., -7.
*END STEP
"""
CLAMP = "*BOUNDARY\n1, ENCASTRE\n"


@pytest.mark.parametrize("options", [["--check"], []])
def test_supports_and_loads_are_listed(options):
    """A force on a node that *LINE has made stands where it acts; each step with the sums of its own loads."""
    run = dr.run_deck(RULER.format(supports=CLAMP, node=3), *options)
    lines = [line.strip() for line in run.stdout.splitlines()]
    assert "node 1 at (0, 0): u, v, rotation" in lines
    first, second = (k for k, line in enumerate(lines) if re.match(r"step \d ", line))
    end = next((k for k, line in enumerate(lines) if line.startswith("Step 1")), len(lines))
    assert [line for line in lines[first:second] if "load" in line.split() or "loads" in line][-3:] == [
        "load on node 2 at (300, 0): moment 40", "load on node 3 at (75, 0): (0, -10)",
        f"sum of all loads at load factor 1: force (0, -10), moment about the origin {40 - 75 * 10}"]
    # The weight is 0.2 x 3 per length; the pole pulls straight down. Nothing stays of the first step.
    assert [line for line in lines[second:end] if "load" in line.split() or "loads" in line][-3:] == [
        "load on node 2 at (300, 0): (0, -5) at the start, turning as the node moves", "load on 4 elements: force (0, -0.6) per length",
        f"sum of all loads at load factor 1: force (0, {-5 - 180}), moment about the origin {-5 * 300 - 180 * 150}"]


def test_sums_of_loads_along_an_arc():
    """Pressure on a quarter of a circle, by closed form: as if on its chord. And what it weighs, at its centroid."""
    arc = """*NODE
1, 2., 0.
2, 0., 2.
*ARC, ELSET=RING{count}
*BEAM SECTION, ELSET=RING, SECTION=STIFFNESS
1e6, 1., , 1.
*BOUNDARY
1, ENCASTRE
*STEP
*STATIC
0.1
*DLOAD
RING, {load}
*STOP
LOAD, ABOVE, 1.
*END STEP
"""
    for count in ("\n1, 2, 0., 0.", "\n1, 2, 0., 0., 8", ", TYPE=GE4\n1, 2, 0., 0., 40"):
        told = dr.run_deck(arc.format(count=count, load="P, 3."), "--check").stdout
        # To the left of the arc is its centre: the force on it is towards this, and has no moment about it.
        assert "sum of all loads at load factor 1: force (-6, -6), moment about the origin 0" in told, told
        told = dr.run_deck(arc.format(count=count, load="GRAV, 1., 0., -1."), "--check").stdout
        # pi down, at x = 4/pi.
        assert "sum of all loads at load factor 1: force (0, -3.14159), moment about the origin -4" in told, told


def test_springs_are_listed():
    springs = "*SPRING\n2, 2, 5.\n3, 2, 5.\n4, 6, 7.\n"
    told = dr.run_deck(RULER.format(supports=CLAMP + springs, node=3), "--check").stdout
    assert "springs       at 3 nodes: 0 u, 2 v, 1 rotations" in told
    assert "  spring on nodes 2, 3: each (0, 5)\n" in told and "  spring on node 4 at (150, 0): rotation 7\n" in told


@pytest.mark.parametrize("supports, part", [
    ("", "the part with node 1 can move as a rigid body: supports"),
    ("*BOUNDARY\n1, PINNED\n", "the part with node 1 can move as a rigid body, turning about (0, 0): supports"),
    ("*BOUNDARY\n1, 2\n3, 2\n", "the part with node 1 can move as a rigid body in x: supports"),
    ("*BOUNDARY\n1, 1\n2, 1\n", "the part with node 1 can move as a rigid body: supports"), ("*BOUNDARY\n1, PINNED\n2, 2\n", ""),
    ("*BOUNDARY\n1, 1\n*GAP, NAME=FEET\n1\n2\n", ""), ("*BOUNDARY\n1, 1\n*GAP, NAME=FEET\n1\n2, 0.1\n", "about (0, 0): supports")])
def test_check_of_supports(supports, part):
    """A check says what a run would say; and a deck without steps is judged, too."""
    text = RULER.format(supports=supports, node=3)
    for deck in (text, text.split("*STEP")[0]):
        checked = dr.run_deck(deck, "--check", code=1 if part else 0)
        assert part in checked.stderr and bool(checked.stderr) == bool(part)
        assert "supports      " in checked.stdout and checked.files == ["deck.inp"]
    if part:
        run = dr.run_deck(text, code=2)
        assert checked.stderr.split("deck.inp: ")[1] in run.stderr


def test_quiet():
    run = dr.run_deck(dr.on_given_mesh("cantilever"), "--quiet")
    assert run.stdout == "" and run.stderr == ""
    assert run.results.n_points == 11
    quiet_check = dr.run_deck(dr.on_given_mesh("cantilever"), "--quiet", "--check")
    assert quiet_check.stdout == "" and quiet_check.files == ["deck.inp"]


@pytest.mark.parametrize("said", [None, "OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"])
def test_one_thread_of_blas(said):
    """Small bands are not shared; what the environment says holds. Other libraries than OpenBLAS do not tell."""
    environment = {k: v for k, v in os.environ.items() if not k.endswith("_NUM_THREADS")}
    if said:
        environment[said] = "2"
    told = subprocess.run([os.environ["UNILAT"], "--version"], env=environment, capture_output=True, text=True, check=True).stdout
    if "threads of OpenBLAS" not in told:
        pytest.skip("BLAS is not OpenBLAS")
    assert f"threads of OpenBLAS: {min(2, os.cpu_count()) if said else 1}" in told


def test_a_static_program_loads_no_other_librarys_code():
    """No code for networks, which a shared HDF5 loads, and no threads of OpenBLAS."""
    told = subprocess.run([os.environ["UNILAT"], "--version"], capture_output=True, text=True, check=True).stdout
    if "LAPACK 3" not in told or "static" not in told:
        pytest.skip("the program is linked to shared libraries")
    loaded = subprocess.run(["ldd", os.environ["UNILAT"]], capture_output=True, text=True, check=True).stdout
    assert re.search(r"\blibc\.so", loaded)
    assert not re.search(r"curl|ssl|crypto|krb5|ldap|gnutls|ssh|hdf5|lapack|blas|gfortran", loaded), loaded


@pytest.mark.parametrize("option, words", [("--version", ["unilat", "compiler", "LAPACK", "HDF5"]),
                                           ("--help", ["usage:", "-o FILE", "--check", "--quiet", "exit codes"])])
def test_information(option, words):
    run = dr.run_deck("", option, name=None)
    assert all(word in run.stdout for word in words) and run.stderr == "" and run.files == []


def test_an_older_result_file_is_replaced():
    run = dr.run_deck(dr.on_given_mesh("cantilever"))
    again = subprocess.run([os.environ["UNILAT"], "--quiet", "deck.inp"], cwd=run.folder.name, check=False)
    assert again.returncode == 0 and run.files == ["cantilever.h5", "deck.inp"]
    assert run.results.n_points == 11


def test_the_file_holds_its_deck_and_where_it_comes_from():
    run = dr.run_deck(dr.on_given_mesh("cantilever"))
    results = run.results
    assert results.deck.strip() == dr.on_given_mesh("cantilever").strip()
    assert results.title == "Cantilever under a dead tip load" and results.program == "unilat"
    version = dr.run_deck("", "--version", name=None).stdout.split("\n")[0]
    assert version == f"unilat {results.version}"


def test_every_dataset_tells_its_units():
    run = dr.run_deck(dr.changed(dr.on_given_mesh("ring"), ("ABOVE, 0.6", "ABOVE, 0.002")))
    with h5py.File(pathlib.Path(run.folder.name) / "ring.h5", "r") as file:
        bare = []
        file.visititems(lambda name, item: bare.append(name) if isinstance(item, h5py.Dataset)
                        and not {"units", "description"} <= set(item.attrs) else None)
    assert bare == []


def test_listing_and_file_agree():
    """Every point of the file has its row in the listing, with the same load."""
    run = dr.run_deck(dr.on_given_mesh("column"))
    rows = {}
    for line in run.stdout.split("Critical points")[0].splitlines():
        words = line.split()
        if len(words) > 4 and words[0].isdigit():
            rows[int(words[0])] = float(words[2 if words[1][0].isalpha() else 1])
    assert sorted(rows) == list(range(1, run.results.n_points + 1))
    dr.assert_close([rows[k] for k in sorted(rows)], run.column("load_factor"), relative=1e-8, absolute=1e-12)

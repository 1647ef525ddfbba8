"""A sweep through a real Slurm on this machine, cancelled half-way and resumed; skipped where Slurm is not installed.

UNILAT names the program.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

TESTS = Path(__file__).resolve().parent
sys.path[:0] = [str(TESTS), str(TESTS.parent / "postproc")]

from slurm_machine import SlurmMachine, why_not  # noqa: E402
from test_sweep import N, command, environment, folder, holding_program, sweep, wait_for  # noqa: E402,F401

pytestmark = pytest.mark.skipif(bool(why_not()), reason=why_not())


@pytest.fixture
def slurm(tmp_path_factory):
    machine = SlurmMachine(tmp_path_factory.mktemp("slurm"))
    try:
        machine.start()
        yield machine
    finally:
        machine.stop()


def test_cancelled_half_way_and_resumed_is_the_same_as_on_the_pool(slurm, folder):  # noqa: F811
    program = holding_program(folder, folder / "an array, 50 %" / "runs", 2)
    sweep(folder, "run", "--folder", folder / "pool", program=program)
    here = environment() | slurm.environment | {"PYTHONPATH": environment()["PYTHONPATH"]}
    words = command(folder, "run", "strip.toml", "--folder", folder / "an array, 50 %", "--slurm", "--tasks", "2", program=program)
    running = subprocess.Popen(words, cwd=folder, env=here,
                               stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    told = ""
    while "job array" not in told:
        line = running.stdout.readline()
        assert line, told
        told += line
    job = re.search(r"Slurm job array (\d+): 2 tasks", told).group(1)
    wait_for(lambda: list((folder / "an array, 50 %" / "runs").glob("*.json")), running)
    subprocess.run(["scancel", job], env=slurm.environment, check=True)
    told += running.communicate(timeout=60)[0]
    (folder / "hold").unlink()
    assert running.returncode == 1 and re.search(r"[1-5] of 6 runs complete, [1-5] missing", told), told
    done = subprocess.run(words, cwd=folder, env=here,
                          capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0 and f"{N} of {N} runs complete" in done.stdout, done.stdout + done.stderr
    assert not re.search(r"runs, 0 finished before", done.stdout)
    assert (folder / "an array, 50 %" / "strip.csv").read_bytes() == (folder / "pool" / "strip.csv").read_bytes()
    assert os.path.exists(folder / "an array, 50 %" / "job.sh")


def test_a_sweep_from_python_is_the_same_on_the_cluster(slurm, tmp_path, monkeypatch):
    from unilat import Deck
    for name, value in slurm.environment.items():
        monkeypatch.setenv(name, value)
    deck = Deck("a column", job="strut")
    deck.parameter(EI=1.0)
    deck.node((1, 0.0, 0.0), (2, 1.0, 0.0))
    deck.line((1, 2, 4), elset="COLUMN")
    deck.beam_section((1e6, "${EI}"), elset="COLUMN", section="STIFFNESS")
    deck.boundary((1, "PINNED"), (2, 2))
    with deck.step() as step:
        step.static((0.5, 1e-6, 4.0), method="LOAD")
        step.cload((2, 1, -1.0))
        step.stop(("LOAD", "ABOVE", "${12*EI}"))
    values = {"EI": [1.0, 2.0, 3.0]}
    here = deck.sweep(grid=values, gather={"load": "BP"}, folder=tmp_path / "pool", progress=False)
    there = deck.sweep(grid=values, gather={"load": "BP"}, folder=tmp_path / "array", slurm=True, tasks=2, progress=False)
    assert there.complete and len(there) == 3
    for name in here.columns:
        assert here[name].tolist() == there[name].tolist()
    assert (tmp_path / "array" / "job.sh").exists()

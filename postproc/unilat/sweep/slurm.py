"""A sweep as a Slurm job array: each task runs every m-th deck with the same program as on a laptop."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import sys
import time

from ..results import ResultsError
from .pool import Progress

RUNS_A_TASK = 50
MOST_TASKS = 1000        # Slurm's own limit of array indices (MaxArraySize) is 1001 unless a cluster changed it
EVERY = 2.0              # [s] between two looks

JOB = """\
#!/bin/bash
#SBATCH --job-name={name}
#SBATCH --array=0-{last}
#SBATCH --cpus-per-task={cpus}
#SBATCH --output={log}
export PYTHONPATH={package}${{PYTHONPATH:+:$PYTHONPATH}}
exec {command} --slice "$SLURM_ARRAY_TASK_ID/{tasks}"
"""


def tasks_for(runs: int, wanted: int | None) -> int:
    """How many array tasks."""
    return min(wanted or -(-runs // RUNS_A_TASK), runs, MOST_TASKS)


def submit(folder: str, name: str, command: list[str], tasks: int, cpus: int, options: str) -> str:
    """Writes job.sh into the folder and submits it; the number of the job."""
    if shutil.which("sbatch") is None:
        raise ResultsError("there is no sbatch here: no Slurm; without --slurm the runs are made on this machine")
    script = os.path.join(folder, "job.sh")
    package = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
    with open(script, "w", encoding="utf-8") as file:
        file.write(JOB.format(name=shlex.quote(name), last=tasks - 1, cpus=cpus, log=os.path.join(folder, "slurm-%a.log"),
                              package=shlex.quote(package), command=shlex.join([sys.executable, "-m", "unilat.sweep", *command]),
                              tasks=tasks))
    done = subprocess.run(["sbatch", "--parsable", *shlex.split(options), script], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise ResultsError(f"sbatch: {done.stderr.strip() or done.stdout.strip()}")
    return done.stdout.strip().split(";")[0]


def wait_for(job: str, look, progress: Progress):
    """Waits until the array has left the queue; `look()` gives finished and not complete runs."""
    while True:
        queued = subprocess.run(["squeue", "-h", "-j", job, "-o", "%i"], capture_output=True, text=True, check=False)
        waiting = queued.returncode == 0 and queued.stdout.strip() != ""
        if queued.returncode != 0 and "Invalid job id" not in queued.stderr:
            raise ResultsError(f"squeue: {queued.stderr.strip()}; the array {job} goes on, the same command looks again")
        progress.set(*look())
        if not waiting:
            return
        time.sleep(EVERY)

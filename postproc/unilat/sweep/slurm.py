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

MEGABYTES_A_RUN = 500    # asked for; a run takes some 40, and its result file
MINUTES = 60             # asked for where the sweep file has no timeout
WARNING = 60             # [s] before the time is used up
RESTARTS = 20            # of a task whose time was used up

JOB = """\
#!/bin/bash
# {submitted}
# A task whose time is used up goes to the queue again and on with the runs that are missing.
export PYTHONPATH={package}${{PYTHONPATH:+:$PYTHONPATH}}
again() {{
   kill -TERM "$work"
   wait "$work"
   if ((${{SLURM_RESTART_COUNT:-0}} < {restarts})); then scontrol requeue "${{SLURM_ARRAY_JOB_ID}}_$SLURM_ARRAY_TASK_ID"; fi
   exit 1
}}
trap again USR1
{command} --slice "$SLURM_ARRAY_TASK_ID/{tasks}" &
work=$!
wait "$work"
"""


def tasks_for(runs: int, wanted: int | None) -> int:
    """How many array tasks."""
    return min(wanted or -(-runs // RUNS_A_TASK), runs, MOST_TASKS)


def minutes_for(runs: int, tasks: int, jobs: int, timeout: float | None) -> int:
    """Time to ask for a task: all of its runs as long as they may be, and the warning."""
    if timeout is None:
        return MINUTES
    return max(2, -(-int(-(-runs // tasks) / jobs * timeout + WARNING + 60.0) // 60))


def submit(folder: str, name: str, command: list[str], tasks: int, cpus: int, minutes: int, options: str) -> str:
    """Writes job.sh into the folder and submits it; the number of the job. `options` of the user's win."""
    if shutil.which("sbatch") is None:
        raise ResultsError("there is no sbatch here: no Slurm; without --slurm the runs are made on this machine")
    script = os.path.join(folder, "job.sh")
    package = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
    # Names stand on the command line, where they may have blanks; a percent sign is Slurm's own.
    words = ["sbatch", "--parsable", "--job-name", name, f"--array=0-{tasks - 1}", f"--cpus-per-task={cpus}",
             "--output", os.path.join(folder, "slurm-%a.log").replace("%", "%%").replace("%%a", "%a"), "--open-mode=append",
             f"--mem={MEGABYTES_A_RUN * cpus}M", f"--time={minutes}", "--requeue", f"--signal=B:USR1@{WARNING}", *shlex.split(options), script]
    with open(script, "w", encoding="utf-8") as file:
        file.write(JOB.format(submitted=shlex.join(words), package=shlex.quote(package), tasks=tasks, restarts=RESTARTS,
                              command=shlex.join([sys.executable, "-m", "unilat.sweep", *command])))
    done = subprocess.run(words, capture_output=True, text=True, check=False)
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

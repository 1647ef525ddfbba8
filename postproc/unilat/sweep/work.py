"""What unilat-sweep does: plan, run, status, gather, draw."""

from __future__ import annotations

import argparse
import importlib
import io
import os
import sys

from .. import command
from ..program import find_program
from ..results import ResultsError
from . import gather, slurm
from .locks import only_one
from .plan import make_plan
from .pool import Progress, run_pool
from .run_deck import RunDeck, read_decks
from .run_folder import RunFolder
from .sweep_file import Sweep, read_sweep

DESCRIPTION = """\
Runs a deck with ${parameters} for all their values in a sweep file (TOML), a few at a time on this machine or as a Slurm job array,
gathers all results into NAME.h5 and NAME.csv and draws them. Run it again after a kill: finished runs are not repeated. The manual
(input/manual/output.md) says what stands in a sweep file.

   plan     says how many runs there are, and from some of them how long they take and how large their files are
   run      makes the runs that are missing, gathers and draws
   status   says how many are finished, and why others are not complete
   gather   gathers what there is
   draw     draws the pictures of the sweep file from what was gathered"""

EXAMPLES = """\
examples:
  unilat-sweep plan column-random.toml -j 4
  unilat-sweep run column-random.toml -j 4
  unilat-sweep run column-random.toml --slurm --sbatch "--time=10 --partition=short"
  unilat-sweep status column-random.toml
"""

SHOWN = 10      # messages of runs that are not complete
PICTURE_FAILED = 5


def main(argv=None) -> int:
    parser = argparse.ArgumentParser("unilat-sweep", description=DESCRIPTION, epilog=EXAMPLES,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("plan", "run", "status", "gather", "draw"))
    parser.add_argument("file", metavar="SWEEP.toml")
    parser.add_argument("--folder", metavar="DIR", help="where everything goes (default: NAME-sweep in the current folder)")
    parser.add_argument("--program", metavar="FILE", help="unilat (default: the variable UNILAT, else on the PATH)")
    parser.add_argument("-j", type=whole, metavar="N", dest="jobs", help="runs at a time (default: all cores); with --slurm: of a "
                        "task, which gets as many cores (default there 1)")
    parser.add_argument("--retry", action="store_true", help="repeat runs that were not complete, too")
    parser.add_argument("--slurm", action="store_true", help="as a job array of a cluster")
    parser.add_argument("--tasks", type=whole, metavar="M", help=f"array tasks (default: one for {slurm.RUNS_A_TASK} runs)")
    parser.add_argument("--sbatch", default="", metavar="OPTIONS", help="options for sbatch, such as \"--time=10\"")
    parser.add_argument("--slice", type=part, metavar="K/M", help=argparse.SUPPRESS)      # what a task of the array runs
    args = parser.parse_args(argv)
    args.jobs = args.jobs or (1 if args.slurm else len(os.sched_getaffinity(0)))
    sweep = read_sweep(args.file)
    program = find_program(args.program)
    all_decks = read_decks(program, sweep.deck_path, sweep.settings)
    folder = RunFolder(args.folder or f"{sweep.name}-sweep", program)
    keys = [folder.key(deck) for deck in all_decks]
    decks = dict(zip(keys, all_decks))          # equal ones once
    if args.slice is not None:
        return run_slice(folder, sweep, decks, args)
    if args.what in ("plan", "run"):
        try:
            with only_one(os.path.join(folder.folder, "run.lock"), wait=False):
                if args.what == "plan":
                    print(make_plan(folder, decks, to_do(folder, decks, args.retry), args.jobs, sweep.timeout).words(args.jobs))
                    return 0
                make_runs(folder, sweep, decks, args)
        except (KeyboardInterrupt, SystemExit):
            print("\nfinished runs stay; run it again to go on", file=sys.stderr)
            raise
    if args.what in ("run", "gather"):
        with only_one(os.path.join(folder.folder, "gather.lock"), wait=True):
            print(gather.gather(sweep, folder, all_decks[0].text, keys))
    code = report(folder, sweep, keys)
    return draw(sweep, folder) or code if args.what in ("run", "draw") else code


def make_runs(folder: RunFolder, sweep: Sweep, decks: dict[str, RunDeck], args):
    """The runs that are missing, here or on the cluster."""
    missing = to_do(folder, decks, args.retry)
    quiet = getattr(args, "quiet", False)
    if not quiet:
        print(f"{sweep.name}: {len(sweep.values)} runs, {len(decks) - len(missing)} finished before", flush=True)
    if not missing:
        return
    progress = Progress(len(missing), io.StringIO() if quiet else None)
    if not args.slurm:
        run_pool(folder, missing, args.jobs, sweep.timeout, progress)
        folder.sweep_up()
        return
    tasks = slurm.tasks_for(len(missing), args.tasks)
    again = ["run", os.path.abspath(args.file), "--folder", os.path.abspath(folder.folder), "--program", folder.program,
             "-j", str(args.jobs), *(["--retry"] if args.retry else [])]
    for key in missing.keys() & folder.finished():      # so that every record is a new one
        os.remove(os.path.join(folder.runs, f"{key}.json"))
    job = slurm.submit(os.path.abspath(folder.folder), sweep.name, again, tasks, args.jobs,
                       slurm.minutes_for(len(missing), tasks, args.jobs, sweep.timeout), args.sbatch)
    print(f"Slurm job array {job}: {tasks} tasks; log files in {folder.folder}", flush=True)

    codes: dict[str, int] = {}

    def look() -> tuple[int, int]:
        for key in (folder.finished() & missing.keys()) - codes.keys():
            record = folder.record(key)
            if record is not None:
                codes[key] = record.code
        return len(codes), sum(code != 0 for code in codes.values())

    slurm.wait_for(job, look, progress)


def run_slice(folder: RunFolder, sweep: Sweep, decks: dict[str, RunDeck], args) -> int:
    """Every m-th deck of the whole list, so that tasks agree on who runs what; without those that are finished."""
    number, tasks = args.slice
    mine = dict(list(decks.items())[number::tasks])
    missing = to_do(folder, mine, args.retry)
    run_pool(folder, missing, args.jobs, sweep.timeout, Progress(len(missing)))
    return 0


def to_do(folder: RunFolder, decks: dict[str, RunDeck], retry: bool) -> dict[str, RunDeck]:
    """Decks without a record or a whole result file, or whose run was ended by a signal or a full disk; with `retry` all that are
    not complete."""
    finished = folder.finished()

    def again(key: str) -> bool:
        if key not in finished:
            return True
        record = folder.record(key)
        if record is None or not record.counts or (retry and record.code != 0):
            return True
        return record.code in (0, 2) and not folder.is_whole(key)

    return {key: deck for key, deck in decks.items() if again(key)}


def report(folder: RunFolder, sweep: Sweep, keys: list[str]) -> int:
    """How many runs are complete, and what the others say; 0 when all are."""
    records = {key: folder.record(key) for key in set(keys)}
    bad = [(number, key, records[key]) for number, key in enumerate(keys, start=1) if records[key] and records[key].code]
    missing = sum(records[key] is None for key in keys)
    print(f"{len(keys) - len(bad) - missing} of {len(keys)} runs complete"
          + (f", {len(bad)} not complete" if bad else "") + (f", {missing} missing" if missing else ""))
    for number, key, record in bad[:SHOWN]:
        told = ", ".join(f"{name} = {value}" for name, value in sweep.values[number - 1].items())
        print(f"   run {number} ({told}): {record.message}\n      exit code {record.code}; deck and listing: {folder.listing(key)}")
    if len(bad) > SHOWN:
        print(f"   and {len(bad) - SHOWN} more: column message of {sweep.name}.csv")
    return 1 if bad or missing else 0


def draw(sweep: Sweep, folder: RunFolder) -> int:
    """The pictures; without matplotlib the sweep is as good."""
    try:
        pictures = importlib.import_module(".pictures", __package__)
        for name in pictures.draw(sweep, folder.folder):
            print(f"picture: {name}")
    except ModuleNotFoundError as problem:
        print(f"no pictures: {problem.name} is missing (apt-get install python3-matplotlib)", file=sys.stderr)
    except ResultsError as problem:
        command.complain("unilat-sweep", problem)
        return PICTURE_FAILED
    return 0


def whole(text: str) -> int:
    if not text.isdigit() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"'{text}' is not a whole number of 1 or more")
    return int(text)


def part(text: str) -> tuple[int, int]:
    number, tasks = text.split("/")
    return int(number), int(tasks)

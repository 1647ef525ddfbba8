"""What `input/run --map` and `input/run --study` do."""

from __future__ import annotations

import argparse
import os

from ..results import read_results
from ..sweep.pool import Progress, run_pool
from ..sweep.run_folder import RunFolder
from ..program import find_program
from ..sweep.work import to_do, whole
from .map_file import read_map
from .study_file import read_study
from .map_table import SHOWN, bars, cells, counts, write_table, wrong_cells


def main(argv: list[str]) -> int:
    parser = argparse.ArgumentParser("unilat.study", description="Runs held against exact values. Run it again after a kill: finished "
                                     "runs are not repeated. The manual (input/manual/verification.md) says what stands in the files.")
    parser.add_argument("what", choices=("map", "time"))
    parser.add_argument("file", metavar="FILE.toml")
    parser.add_argument("--folder", metavar="DIR", help="where everything goes (default: NAME-map, NAME-time in the current folder)")
    parser.add_argument("--program", metavar="FILE", help="unilat (default: the variable UNILAT, else on the PATH)")
    parser.add_argument("-j", type=whole, metavar="N", dest="jobs", default=len(os.sched_getaffinity(0)), help="runs of a map at a time")
    args = parser.parse_args(argv)
    return make_map(args) if args.what == "map" else time_study(args)


def make_map(args) -> int:
    """0: every cell is right, told or stopped with a reason; 1: some are wrong."""
    program = find_program(args.program)
    checked = read_map(args.file, program)
    sweep = checked.sweep
    folder = RunFolder(args.folder or f"{sweep.name}-map", program)
    keys = [folder.key(deck) for deck in checked.decks]
    decks = dict(zip(keys, checked.decks))
    missing = to_do(folder, decks, retry=False)
    print(f"{sweep.name}: {len(decks)} cells, {len(decks) - len(missing)} finished before", flush=True)
    run_pool(folder, missing, args.jobs, sweep.timeout, Progress(len(missing)))
    folder.sweep_up()
    rows = cells(checked, folder, keys)
    stem = os.path.join(folder.folder, sweep.name)
    write_table(checked, rows, f"{stem}.csv")
    print(f"table: {stem}.csv\n{counts(rows)}")
    if bars(rows):
        print(bars(rows))
    wrong = wrong_cells(checked, rows)
    for number, key in enumerate(keys, start=1):
        name = f"{stem}-wrong-{number}.inp"
        if rows[number - 1].verdict == "wrong":
            with open(name, "w", encoding="utf-8") as file:
                file.write(read_results(folder.results(key)).deck)
        elif os.path.exists(name):
            os.remove(name)
    for line in wrong[:SHOWN]:
        print(f"   wrong: {line}")
    if wrong:
        print(f"   decks of wrong cells: {stem}-wrong-*.inp")
    from .map_picture import draw_map       # only this needs matplotlib
    draw_map(checked, rows, f"{stem}.png")
    print(f"picture: {stem}.png")
    return 1 if wrong else 0


def time_study(args) -> int:
    """0: all runs have their values; 1: some have not."""
    from .effectivity import is_effectivity, study_bars
    if is_effectivity(args.file):
        name = os.path.splitext(os.path.basename(args.file))[0]
        return study_bars(args.file, RunFolder(args.folder or f"{name}-bars", find_program(args.program)), args.jobs)
    from .delivered import is_delivered, study_delivered
    if is_delivered(args.file):
        name = os.path.splitext(os.path.basename(args.file))[0]
        return study_delivered(args.file, RunFolder(args.folder or f"{name}-asked", find_program(args.program)), args.jobs)
    from .study_work import draw_study, make_study, write_study
    program = find_program(args.program)
    study = read_study(args.file, program)
    folder = RunFolder(args.folder or f"{study.name}-time", program)
    rows = make_study(study, folder)
    stem = os.path.join(folder.folder, study.name)
    write_study(study, rows, f"{stem}.csv")
    draw_study(study, rows, f"{stem}.png")
    missing = sum(any(each.value != each.value for each in findings) for _, _, _, findings in rows)
    print(f"table: {stem}.csv\npicture: {stem}.png\n{len(rows)} runs" + (f", {missing} without a value" if missing else ""))
    return 1 if missing else 0

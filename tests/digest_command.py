"""tests/digest: writes and compares digests of decks (deck_digest), collects the decks of the tests, counts what decks cost."""

from __future__ import annotations

import argparse
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor

import deck_digest
from unilat.results import read_results

ROOT = pathlib.Path(__file__).resolve().parent.parent
INPUT = ROOT / "input"
REFERENCE = ROOT / "tests" / "reference" / "digests.json"    # of the decks in INPUT
KERNELS = ("Haswell", "Prescott", "Sandybridge")             # of OPENBLAS_CORETYPE; the first one's numbers are the digest's
TIMEOUT = 600             # [s] of a run
AT_MOST = 1.02            # ratio of instructions that `cost` lets pass
# A process that is started by a large one counts that one's memory as its own; this one is small.
PEAK_MEMORY = ("import resource, subprocess, sys; code = subprocess.run(sys.argv[1:], stdout=2).returncode; "
               "print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss); sys.exit(code)")
# The result file is flushed every 0.2 s. With a clock that stands still the number of instructions does not depend on the speed of a run.
STANDING_CLOCK = """#include <sys/time.h>
#include <time.h>
int clock_gettime(clockid_t clock, struct timespec *time) { time->tv_sec = 1; time->tv_nsec = 0; return 0; }
int gettimeofday(struct timeval *time, void *zone) { time->tv_sec = 1; time->tv_usec = 0; return 0; }
"""
COUNTING = ("valgrind", "--tool=cachegrind", "--cache-sim=no", "--cachegrind-out-file=/dev/null")


def environment(kernel: str = KERNELS[0]) -> dict[str, str]:
    return os.environ | {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "OPENBLAS_CORETYPE": kernel}


def run(program: str, deck: pathlib.Path, kernel: str = KERNELS[0]) -> dict:
    """Digest of a deck, with its options in a file beside it (deck_runner.collect)."""
    beside = deck.with_suffix(".options")
    options = beside.read_text(encoding="utf-8").splitlines() if beside.exists() else []
    with tempfile.TemporaryDirectory(prefix="unilat-") as folder:
        try:
            code = subprocess.run([program, *options, str(deck.resolve())], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                                  cwd=folder, env=environment(kernel), timeout=TIMEOUT, check=False).returncode     # what it includes is beside it
        except subprocess.TimeoutExpired:
            return deck_digest.digest(f"none in {TIMEOUT} s", None)
        files = sorted(pathlib.Path(folder).glob("**/*.h5"))
        return deck_digest.digest(code, read_results(str(files[0])) if files else None)


def over_decks(jobs: int, action, folder: pathlib.Path) -> dict:
    """What an action gives for every deck of a folder, by the deck's name."""
    decks = sorted(folder.glob("*.inp"))
    if not decks:
        sys.exit(f"tests/digest: {folder} has no decks")
    found = {}
    with ThreadPoolExecutor(jobs) as pool:
        for deck, result in zip(decks, pool.map(action, decks)):
            found[deck.stem] = result
            if sys.stderr.isatty():
                print(f"\r{len(found)} of {len(decks)} decks", end="\n" if len(found) == len(decks) else "", file=sys.stderr)
    return found


def has_kernels(program: str) -> bool:
    """Whether the program is linked to a shared OpenBLAS, which has kernels for several processors."""
    return "OpenBLAS" in subprocess.run([program, "--version"], capture_output=True, encoding="utf-8", check=False).stdout


def write(arguments) -> int:
    programs = [arguments.program, *arguments.variant]
    with_kernels = [program for program in programs if has_kernels(program)]
    if not with_kernels:
        print("tests/digest: neither the program nor a --variant uses a shared OpenBLAS (UNILAT_STATIC=OFF): one kernel only", file=sys.stderr)

    def both(deck):
        runs = [run(program, deck, kernel) for program in programs for kernel in (KERNELS if program in with_kernels else KERNELS[:1])]
        loose = deck_digest.may_differ(runs)
        return runs[0] | ({"may differ": loose} if loose else {})

    found = over_decks(arguments.jobs, both, arguments.folder)
    arguments.file.write_text(as_text(found) + "\n", encoding="utf-8")
    loose = {name: len(each["may differ"]) for name, each in found.items() if "may differ" in each}
    print(f"{len(found)} decks in {arguments.file}; with other rounding {len(loose)} of them have other digits: "
          + ", ".join(f"{name} {count}" for name, count in loose.items()))
    return 0


def as_text(tree, indent: str = "") -> str:
    """JSON with a line for everything that fits into a long one: a critical point, not a path."""
    line = json.dumps(tree, ensure_ascii=False)
    if not isinstance(tree, (dict, list)) or not tree or len(line) <= 400:
        return line
    inner = indent + " "
    if isinstance(tree, dict):
        items = [f"{json.dumps(key, ensure_ascii=False)}: {as_text(item, inner)}" for key, item in tree.items()]
    else:
        items = [as_text(item, inner) for item in tree]
    first, last = "{}" if isinstance(tree, dict) else "[]"
    return first + "\n" + ",\n".join(inner + item for item in items) + "\n" + indent + last


def compare(arguments) -> int:
    old = json.loads(arguments.file.read_text(encoding="utf-8"))
    new = over_decks(arguments.jobs, lambda deck: run(arguments.program, deck), arguments.folder)
    wrong, allowed = [], []
    for name in [*old, *(name for name in new if name not in old)]:
        if name not in old or name not in new:
            print(f"{name}: {'no deck' if name in old else 'no digest'} of this name")
            wrong.append(name)
            continue
        known = dict(old[name])
        differs, within = deck_digest.compare(known, new[name], known.pop("may differ", {}))
        for what, found in (("", differs), ("may differ: ", within)):
            for key, each in list(found.items())[:arguments.lines]:
                print(f"{name}: {what}{key}: {each.old} -> {each.new}" + ("" if each.by is None else f", by {each.by:.1e}"))
            if len(found) > arguments.lines:
                print(f"{name}: {what}{len(found) - arguments.lines} more")
        wrong += [name] if differs else []
        allowed += [name] if within and not differs else []
    print(f"{len(old)} decks: {len(wrong)} differ, {len(allowed)} differ where they may, the others are the same to "
          f"{deck_digest.TOLERANCE:.0e}")
    return 1 if wrong else 0


def collect(arguments) -> int:
    tests = sorted(str(file) for file in (ROOT / "tests").glob("test_decks_*.py"))
    settings = environment() | {"UNILAT": arguments.program, "UNILAT_COLLECT": str(arguments.folder)}
    with tempfile.TemporaryDirectory(prefix="unilat-") as folder:
        code = subprocess.run([sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *tests], cwd=folder, env=settings,
                              check=False).returncode
    print(f"{len(list(arguments.folder.glob('*.inp')))} decks in {arguments.folder}")
    return code


def cost(arguments) -> int:
    for needed in (COUNTING[0], "cc"):
        if shutil.which(needed) is None:
            sys.exit(f"tests/digest: {needed} is not installed")
    programs = [program for program in (arguments.program, arguments.against) if program]
    columns = [over_decks(arguments.jobs, lambda deck, program=program: counted(program, deck), arguments.folder)
               for program in programs]
    print(f"{'million instructions, peak memory in MB':40}" + "".join(f"{name:>20}" for name in ("", "against")[:len(programs)]))
    for name in columns[0]:
        print(cost_line(name, [column[name] for column in columns]))
    sums = [(sum(count for count, _ in column.values()), max(peak for _, peak in column.values())) for column in columns]
    print(cost_line(f"{len(columns[0])} decks: sum, maximum", sums))
    return 1 if len(sums) == 2 and sums[0][0] > AT_MOST * sums[1][0] else 0


def counted(program: str, deck: pathlib.Path) -> tuple[float, float]:
    """Million instructions, and peak memory [MB] of a run without valgrind."""
    with tempfile.TemporaryDirectory(prefix="unilat-") as folder:
        clock = os.path.join(folder, "clock.so")
        subprocess.run(["cc", "-shared", "-fPIC", "-x", "c", "-", "-o", clock], input=STANDING_CLOCK, encoding="utf-8", check=True)
        command = [os.path.abspath(program), "--quiet", "-o", "run.h5", str(deck.resolve())]
        peak, count = (subprocess.run(call, cwd=folder, env=environment() | more, capture_output=True, encoding="utf-8", check=False)
                       for call, more in (([sys.executable, "-S", "-E", "-c", PEAK_MEMORY, *command], {}),
                                          ([*COUNTING, *command], {"LD_PRELOAD": clock})))
    found = re.search(r"I +refs: +([\d,]+)", count.stderr)
    if peak.returncode not in (0, 2) or not found:
        sys.exit(f"tests/digest: {deck.stem} was not counted:\n{peak.stderr[-500:]}{count.stderr[-500:]}")
    return int(found[1].replace(",", "")) / 1e6, int(peak.stdout) / 1024


def cost_line(name: str, each: list[tuple[float, float]]) -> str:
    line = f"{name:40}" + "".join(f"{count:12.1f}{peak:8.1f}" for count, peak in each)
    return line if len(each) == 1 else f"{line}  ratio {each[0][0] / each[1][0]:.4f} {each[0][1] / each[1][1]:.4f}"


def main(words: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="tests/digest", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter,
                                     epilog="""
What a change of the sources may not change: first `collect` and `write` with the program from before it, then `compare`. The digests of
input/ are in tests/reference/digests.json, so that these decks need `compare` only. "may differ" lists the numbers of a deck that
differ with other kernels of OpenBLAS and in other builds: rounding moves them, and they may differ by their error bars. `cost`
counts instructions with valgrind and with a clock that stands still, so that a busy machine counts the same.

Exit code: 0, or 1 when digests differ, tests failed or the sum of instructions is more than 2 % above that of the other program.""")
    commands = parser.add_subparsers(dest="command", required=True)
    for action, text in ((write, "run decks with each kernel and write their digests"), (compare, "run decks and compare with their digests"),
                         (collect, "run the tests of decks and store every deck in FOLDER"), (cost, "count instructions and peak memory")):
        command = commands.add_parser(action.__name__, help=text, description=text)
        command.set_defaults(action=action)
        command.add_argument("folder", nargs="?", type=pathlib.Path, metavar="FOLDER",
                             default=ROOT / ".build" / "decks" if action is collect else INPUT, help="of the decks (default: %(default)s)")
        command.add_argument("--program", required=True, type=os.path.abspath, help="unilat (default: this repository's, built before)")
        command.add_argument("--jobs", "-j", type=int, default=os.cpu_count(), help="runs at a time (default: %(default)s)")
        if action in (write, compare):
            command.add_argument("--file", type=pathlib.Path, help="of the digests (default: digests.json in FOLDER; for input/ in tests/reference)")
        if action is write:
            command.add_argument("--variant", action="append", default=[], type=os.path.abspath,
                                 help="the same sources in another build, for instance -march=haswell: finds more of what rounding moves")
        if action is compare:
            command.add_argument("--lines", type=int, default=10, help="differences of a deck to print (default: %(default)s)")
        if action is cost:
            command.add_argument("--against", type=os.path.abspath, help="another unilat")
    arguments = parser.parse_args(words)
    arguments.folder = arguments.folder.resolve()
    if getattr(arguments, "file", 0) is None:
        arguments.file = REFERENCE if arguments.folder == INPUT else arguments.folder / "digests.json"
    return arguments.action(arguments)


if __name__ == "__main__":
    sys.exit(main())

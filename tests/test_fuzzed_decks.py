"""Decks with mistakes that nobody would think of: the program ends by itself, with one of its exit codes, in a limited time.

Each deck is one of input/ with a few random changes. What the change is follows from the number of the case alone, so that a case that
fails is the same in the next run. Time is that of the processor: a loaded machine changes nothing.
"""
import functools
import json
import os
import pathlib
import random
import re
import resource
import subprocess

import h5py
import pytest

import deck_runner as dr

pytestmark = dr.release_only     # run-time checks stop at what overflows, which a deck of extreme numbers may
READ, FOLLOWED = 320, 40         # cases that are only read, and that are followed
SECONDS = 20                     # of the processor, for what takes a hundredth of one; and half a second more of a path
MEMORY = 2 << 30                 # bytes
NUMBERS = ["0", "-1", "1", "2", "0.5", "1e300", "-1e300", "1e-300", "1e400", "nan", "inf", "2147483647", "2147483648", "-2147483648", "9" * 20,
           "1e5", "1e-12", "1D5", "1.e", ".", "+-1", "1e", "0x10", "", " ", "1 2", "100", "-0", "2*3", "1/2", "${p}", "${", "${1/0}", "é"]
WORDS = ["FOO", "LOAD", "GE8", "UL2", "CIRCLE", "SPLINE", "INSIDE", "YES", "", " ", "a" * 81, "x" * 3000, "日本", "*", "==", "-", "..", "\t", "\0", "'", '"']
CODES = {0, 1, 2, 5, 6}


@functools.cache
def corpus():
    folder = pathlib.Path(os.environ["UNILAT_SOURCE"]) / "input"
    return [dr.example(path.stem) for path in sorted(folder.glob("*.inp"))]


@functools.cache
def cards():
    """Names of all cards, with the names and words of their parameters."""
    table = json.loads(subprocess.run([os.environ["UNILAT"], "--cards=json"], capture_output=True, text=True, check=True).stdout)
    return [("*" + card["keyword"], [(given["name"], given.get("words") or []) for given in card["parameters"]]) for card in table["cards"]]


def some_number(chance, lines):
    """Another number in a data line."""
    k = chance.randrange(len(lines))
    found = list(re.finditer(r"(?<![A-Za-z_0-9.])[-+]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][-+]?\d+)?", lines[k]))
    if found:
        number = chance.choice(found)
        new = chance.choice(NUMBERS)
        if chance.random() < 0.5:      # one that is nearly right
            new = f"{float(number.group().lower().replace('d', 'e')) * chance.choice([-1, 0, 0.1, 0.5, 1.001, 2, 10, 1000]):.9g}"
        lines[k] = lines[k][:number.start()] + new + lines[k][number.end():]


def some_parameter(chance, lines):
    """A parameter of the table, or of none, on a card."""
    heads = [k for k, line in enumerate(lines) if re.match(r"\*[A-Za-z]", line)]
    if heads:
        k = chance.choice(heads)
        name, parameters = chance.choice(cards())
        given, words = chance.choice(parameters or [("FOO", [])])
        if chance.random() < 0.3:
            lines[k] = re.sub(r"=[^,]*", lambda _: f"={chance.choice(words or WORDS + NUMBERS)}", lines[k], count=1)
        else:
            lines[k] += f", {given}={chance.choice(words or WORDS + NUMBERS)}"


def some_card(chance, lines):
    """A card that is new, comes twice, is missing, or is another deck's."""
    heads = [k for k, line in enumerate(lines) if line.startswith("*")] + [len(lines)]
    k = chance.randrange(len(heads) - 1) if len(heads) > 1 else 0
    here = slice(heads[k], heads[min(k + 1, len(heads) - 1)])
    what = chance.randrange(4)
    if what == 0:
        del lines[here]
    elif what == 1:
        lines[here.start:here.start] = lines[here]
    elif what == 2:
        lines[here.start:here.start] = [chance.choice(cards())[0], ", ".join(chance.choice(NUMBERS + WORDS) for _ in range(chance.randrange(5)))]
    else:
        other = chance.choice(corpus()).splitlines()
        at = chance.randrange(len(other))
        lines[here.start:here.start] = other[at:at + chance.randrange(1, 6)]


def some_text(chance, lines):
    """Text that is cut, out of its order, or no text."""
    k = chance.randrange(len(lines))
    what = chance.randrange(5)
    if what == 0:
        del lines[k:]
    elif what == 1:
        lines[k] = lines[k][:chance.randrange(len(lines[k]) + 1)]
    elif what == 2:
        lines.insert(chance.randrange(len(lines)), lines.pop(k))
    elif what == 3:
        at = chance.randrange(len(lines[k]) + 1)
        lines[k] = lines[k][:at] + chance.choice(WORDS + NUMBERS + [",", ",,,", "*"]) + lines[k][at:]
    else:
        lines[k:k] = ["*PARAMETER", f"p = {chance.choice(NUMBERS + ['(' * 50 + '1' + ')' * 50, 'sqrt(-1)', '10**10**10', 'p', 'pi', 'foo(1)'])}"]


def deck(case):
    chance = random.Random(case)
    lines = [line for line in chance.choice(corpus()).splitlines() if not line.startswith("**")]
    for _ in range(chance.choice([1, 1, 2, 3])):
        if lines:
            chance.choice([some_number, some_number, some_parameter, some_card, some_text])(chance, lines)
    return "\n".join(lines) + "\n"


def run(folder, case, *options):
    """Exit code and messages of the program with a case; it may not take more time and memory than there is."""
    (folder / "deck.inp").write_text(deck(case), encoding="utf-8")
    done = subprocess.run([os.environ["UNILAT"], *options, "deck.inp"], cwd=folder, stdin=subprocess.DEVNULL, capture_output=True, check=False,
                          preexec_fn=lambda: (resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS + 5)),
                                              resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))))
    said = done.stderr.decode(errors="replace")
    assert done.returncode in CODES, f"case {case}: exit code {done.returncode}\n{said[-2000:]}\n{deck(case)}"
    assert "limit of CPU time" not in said and "runtime error" not in said, f"case {case}: {said[-2000:]}\n{deck(case)}"
    if done.returncode != 0:
        assert said.startswith(("deck.inp:", "unilat:")) and len(said) < 20000, f"case {case}: {said[:2000]}"
    return done.returncode, said


def test_they_are_read(tmp_path):
    codes = [run(tmp_path, case, "--check", "--quiet")[0] for case in range(READ)]
    assert set(codes) <= {0, 1}
    assert READ / 5 < codes.count(1) < READ          # changes that are none, or nothing but mistakes, would test little


def test_they_are_followed(tmp_path):
    """What the status says is what the exit code says."""
    codes = []
    for case in range(READ, READ + FOLLOWED):
        result = tmp_path / f"{case}.h5"
        code, said = run(tmp_path, case, "--quiet", "--max-seconds", "0.1", "-o", result.name)
        codes.append(code)
        if result.exists():
            with h5py.File(result) as file:
                status = file.attrs["status"]
                rows = {len(file["path"][name]) for name in ("load_factor", "label", "step")}
            assert len(rows) == 1 and status.startswith({0: "complete"}.get(code, "stopped: ")), f"case {case}: {code} {status} {said}"
        else:
            assert code == 1, f"case {case}: {code} {said}"
    assert any(code != 1 for code in codes)

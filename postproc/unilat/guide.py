"""The guide of the manual: its decks are typed from the page, its commands are run as they stand there."""

from __future__ import annotations

import argparse
import contextlib
import io
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
from dataclasses import dataclass

from . import command
from .results import ResultsError, read_results
from .sweep.command import main as sweep_main
from .sweep.quantities import read_quantity

DESCRIPTION = """Runs the decks of the guide (input/manual/tutorial.md) and draws its pictures."""
BLOCK = re.compile(r"^```(\w+)(?: (\S+))?\n(.*?)^```$", re.MULTILINE | re.DOTALL)
PICTURE = re.compile(r"!\[[^\]]*\]\(\.\./pictures/(\S+?)\)")
QUANTITY = re.compile(r"^\| `([^`]+)` \| (\S+) \|", re.MULTILINE)


@dataclass(frozen=True)
class Lesson:
    title: str
    text: str

    @property
    def files(self) -> dict[str, str]:
        """What the reader writes: name of the file and its text."""
        return {name: text for _, name, text in BLOCK.findall(self.text) if name}

    @property
    def commands(self) -> list[list[str]]:
        return [shlex.split(line) for kind, _, text in BLOCK.findall(self.text) if kind == "sh" for line in text.splitlines()]

    @property
    def listing(self) -> list[str]:
        """Lines of the listing that the page shows."""
        return [line for kind, _, text in BLOCK.findall(self.text) if kind == "listing" for line in text.splitlines()]

    @property
    def pictures(self) -> list[str]:
        return PICTURE.findall(self.text)

    @property
    def quantities(self) -> list[tuple[str, str]]:
        """Quantities of the results, in the words of sweeps, and their values on the page."""
        return QUANTITY.findall(self.text)


def lessons(page: str) -> list[Lesson]:
    """The numbered sections of the chapter "Ten decks"."""
    chapter = page.split("\n## Ten decks\n")[1].split("\n## ")[0]
    parts = re.split(r"^### (\d+\. .*)$", chapter, flags=re.MULTILINE)
    return [Lesson(title, text.split("\n### ")[0]) for title, text in zip(parts[1::2], parts[2::2])]


def run(lesson: Lesson, program: str, folder: str) -> str:
    """Does what the lesson says in a folder; what unilat printed at its last run without an option. An error when a command fails."""
    os.makedirs(folder, exist_ok=True)
    for name, text in lesson.files.items():
        with open(os.path.join(folder, name), "w", encoding="utf-8") as file:
            file.write(text)
    listing = ""
    for words in lesson.commands:
        code, said = _run(words, program, folder)
        if code:
            raise ResultsError(f"{lesson.title}: {' '.join(words)}: exit code {code}\n{said}")
        if words[0] == "unilat" and len(words) == 2:
            listing = said
    for name in lesson.pictures:        # a sweep draws into its own folder
        if not os.path.exists(os.path.join(folder, name)):
            shutil.copy(next(pathlib.Path(folder).glob(f"*/{name}")), folder)
    return listing


def compared(lesson: Lesson, folder: str) -> list[str]:
    """Each quantity of the page with its value in the results of the lesson that was run: a line, in words."""
    name = next(iter(lesson.files))
    results = read_results(os.path.join(folder, name.replace(".inp", ".h5")))
    lines = []
    for word, value in lesson.quantities:
        found = read_quantity(word, name).of(results)
        mantissa, _, exponent = value.partition("E")
        digit = 10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2]))      # one in the last digit of the page
        same = abs(found - float(value)) <= 1.01 * digit
        lines.append(f"{word} {found:.10g}, " + ("as on the page" if same else f"on the page {value}"))
    return lines


def _run(words: list[str], program: str, folder: str) -> tuple[int, str]:
    """A command in a folder: exit code and what it said."""
    if words[0] == "unilat":
        done = subprocess.run([program, *words[1:]], cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
        return done.returncode, done.stdout
    said, here = io.StringIO(), os.getcwd()
    os.chdir(folder)
    try:
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            if words[0] == "unilat-plot":
                code = command.main(words[1:])
            else:
                code = sweep_main([*words[1:], "--program", program])
    except SystemExit as ended:         # wrong options
        code = ended.code
    finally:
        os.chdir(here)
    return code, said.getvalue()


def main(argv=None) -> int:
    """The exit code: 0, or 2 when something fails."""
    parser = argparse.ArgumentParser("python3 -m unilat.guide", description=DESCRIPTION)
    parser.add_argument("--page", required=True, help="the tutorial, a page of the manual")
    parser.add_argument("--program", required=True, help="unilat")
    parser.add_argument("--folder", required=True, help="where everything goes")
    args = parser.parse_args(argv)
    try:
        with open(args.page, encoding="utf-8") as file:
            page = file.read()
        for lesson in lessons(page):
            print(lesson.title, flush=True)
            listing = run(lesson, args.program, args.folder)
            with open(os.path.join(args.folder, next(iter(lesson.files)).replace(".inp", ".lst")), "w", encoding="utf-8") as file:
                file.write(listing)
            print("".join(f"   {line}\n" for line in compared(lesson, args.folder))
                  + "".join(f"   {os.path.join(args.folder, name)}\n" for name in lesson.pictures), end="")
    except (OSError, ResultsError) as problem:
        print(f"guide: {problem}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())

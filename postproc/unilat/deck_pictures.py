"""The pictures of a run: what the results have, drawn as comments of the deck ask for it."""

from __future__ import annotations

import argparse
import contextlib
import io
import os
import re
import shlex
import sys

from . import command
from .options import read_once
from .plain_text import printable, printable_lines
from .results import Results, ResultsError

# A comment of the deck names a picture by its command, or by a longer name that older decks have.
NAMES = {"limit_curve": "curve"}
ASKED_FOR = ("model", "reaction", "forces")      # drawn only when the deck asks
COMMENT = re.compile(r"^\*\* plot_(\w+):(.*)$", re.MULTILINE)


def main(argv=None) -> int:
    """The exit code: 0, or 5 when a picture failed."""
    parser = argparse.ArgumentParser("python3 -m unilat.deck_pictures", description=__doc__)
    parser.add_argument("deck", help="the deck, whose comments say how it is best drawn")
    parser.add_argument("results", help="result file; pictures are written beside it")
    parser.add_argument("--variant", action="append", default=[], help="the path is drawn of these runs instead")
    args = parser.parse_args(argv)
    try:
        with open(args.deck, encoding="utf-8", errors="replace") as file:
            deck = file.read()
        there = pictures(read_once(args.results))
    except (OSError, ResultsError) as problem:
        return failed("no picture", str(problem))
    code = 0
    for name in there:
        try:
            asked = wishes(deck, name)
        except ValueError as problem:
            code = failed(f"no picture {name}", f"{args.deck}: {problem}")
            continue
        for number, options in enumerate(asked, start=1):
            code = draw(name, number, options, args) or code
    return code


def pictures(results: Results) -> list[str]:
    """The commands whose picture would not be empty; stops of single nodes have no ends of contact to draw."""
    contact = results.contact
    fields = [name for name in results.field_names if results.field_points.size]
    there = {"model": True, "path": results.n_points > 1, "shape": "displacement" in fields,
             "contact": contact is not None and bool(contact.count.any() and contact.arc_length.any()), "forces": "section_forces" in fields,
             "modes": any(len(step.load_factor) for step in results.buckling.values()),
             "reaction": any(name in fields for name in ("reaction_density", "reaction", "gap")),
             "curve": any(curve.n_points for curve in results.limit_curves.values())}
    return [name for name, has in there.items() if has]


def wishes(deck: str, name: str) -> list[list[str]]:
    """Options for each picture of this kind that the deck wants; `none` wants none. ValueError for a comment that cannot be followed."""
    found = [text.strip() for word, text in COMMENT.findall(deck) if NAMES.get(word, word) == name]
    if "none" in found:
        return []
    return [_options(text) for text in found] or ([] if name in ASKED_FOR else [[]])


def _options(text: str) -> list[str]:
    """The words of a comment. A deck may be anybody's: it says how it is drawn, not which file is written."""
    try:
        words = shlex.split(text)
    except ValueError as problem:       # such as a quote that is not closed
        raise ValueError(f"comment '{printable(text)}': {str(problem).lower()}") from None
    for word in words:
        if word.startswith("-o") or (len(word) > 2 and "--output".startswith(word.split("=")[0])):
            raise ValueError(f"comment '{printable(text)}': pictures are written beside the results; leave out {printable(word)}")
    return words


def draw(name: str, number: int, options: list[str], args) -> int:
    """One picture beside the results; the exit code."""
    stem = os.path.splitext(args.results)[0]
    output = f"{stem}_{name}{'' if number == 1 else f'-{number}'}.png"
    files = [args.results]
    if name == "path" and args.variant:
        files = [f"{stem}-{variant}.h5" for variant in args.variant]
        options = options + [word for variant in args.variant for word in ("--name", variant)]
    said = io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
        try:
            code = command.main([name, *files, "-o", output, *options])
        except SystemExit as ended:     # wrong options
            code = ended.code
    if code:
        return failed(f"unilat-plot {name} failed", said.getvalue().strip())
    print(f"picture: {output}")
    return 0


def failed(what: str, why: str) -> int:
    print(f"{what}: {printable_lines(why.rstrip())}", file=sys.stderr)
    return 5


if __name__ == "__main__":
    sys.exit(main())

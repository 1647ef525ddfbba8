"""`python3 -m unilat.manual`: writes what is generated of the manual, or the site and the PDF."""

from __future__ import annotations

import argparse
import pathlib
import re
import subprocess
import sys

from . import book, grammars
from .card_table import read_cards
from .cards_page import cards_page
from .columns_table import with_columns


def generated(root: pathlib.Path, program: str) -> dict[pathlib.Path, str]:
    """Every file of the repository that the program's tables of cards and of columns make, and its text."""
    cards = read_cards(program)
    output = root / "input/manual/output.md"
    return {root / "input/manual/cards.md": cards_page(cards, root / "input"),
            output: with_columns(output.read_text(encoding="utf-8"), program, root / "input"),
            **{root / ".editors" / name: text for name, text in grammars.files(cards, version(root)).items()}}


def version(root: pathlib.Path) -> str:
    """That of the program, from its one place."""
    return re.search(r"VERSION ([\d.]+) DESCRIPTION", (root / "CMakeLists.txt").read_text(encoding="utf-8"))[1]


def main(argv=None) -> int:
    """The exit code: 0, or 2 when something fails."""
    parser = argparse.ArgumentParser("python3 -m unilat.manual", description=__doc__)
    parser.add_argument("what", choices=("pages", "book"), help="pages: the page of cards, the table of columns and the grammars; book: site and PDF")
    parser.add_argument("--root", type=pathlib.Path, required=True, help="the repository")
    parser.add_argument("--program", help="unilat, for pages")
    parser.add_argument("--folder", type=pathlib.Path, help="where site and PDF go")
    args = parser.parse_args(argv)
    try:
        if args.what == "pages":
            for file, text in generated(args.root, args.program).items():
                file.parent.mkdir(parents=True, exist_ok=True)
                file.write_text(text, encoding="utf-8")
            return 0
        args.folder.mkdir(parents=True, exist_ok=True)
        book.write_site(args.root, args.folder / "site")
        book.write_pdf(args.root, args.folder / "pages", args.folder / "unilat.pdf", version(args.root))
        print(f"site: {args.folder / 'site' / 'index.html'}\nPDF: {args.folder / 'unilat.pdf'}")
    except (OSError, KeyError, ImportError, subprocess.CalledProcessError) as problem:
        print(f"manual: {problem}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())

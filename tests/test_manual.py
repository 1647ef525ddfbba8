"""The manual, input/README.md: its card reference is what the program prints, its decks are good decks.

UNILAT names the program.
"""
import os
import pathlib
import re
import subprocess

MANUAL = pathlib.Path(__file__).parent.parent / "input" / "README.md"
BEGIN = "<!-- cards: begin; written by `unilat --cards` -->\n"
END = "<!-- cards: end -->\n"


def unilat(*arguments, stdin=""):
    return subprocess.run([os.environ["UNILAT"], *arguments], input=stdin, capture_output=True, text=True,
                          encoding="utf-8", timeout=60)


def test_card_reference_is_the_programs_own():
    text = MANUAL.read_text(encoding="utf-8")
    assert text.count(BEGIN) == 1 and text.count(END) == 1
    reference = text.split(BEGIN)[1].split(END)[0]
    printed = unilat("--cards")
    assert printed.returncode == 0
    assert reference.strip() == printed.stdout.strip()


def test_links_of_the_index_lead_to_a_card():
    printed = unilat("--cards").stdout
    links = re.findall(r"\[`\*([A-Z ]+)`\]\(#([a-z-]+)\)", printed)
    headings = re.findall(r"^### `\*([A-Z ]+)`$", printed, re.MULTILINE)
    assert [keyword for keyword, _ in links] == headings
    assert all(anchor == keyword.lower().replace(" ", "-") for keyword, anchor in links)


def test_decks_of_the_manual_are_good():
    decks = re.findall(r"```inp\n(.*?)```", MANUAL.read_text(encoding="utf-8"), re.DOTALL)
    assert decks
    for deck in decks:
        run = unilat("--check", stdin=deck)
        assert run.returncode == 0, run.stderr


def test_help_is_in_the_manual():
    """Exit codes are told twice, and must agree: each number with the first words of its meaning."""
    told = re.findall(r"([0-3]) ((?:path complete|error in the deck|stopped early|internal error))",
                      unilat("--help").stdout)
    assert [code for code, _ in told] == ["0", "1", "2", "3"]
    text = MANUAL.read_text(encoding="utf-8")
    for code, meaning in told:
        assert re.search(rf"^\| {code} \| {meaning}", text, re.MULTILINE)

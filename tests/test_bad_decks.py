"""Every deck in decks_bad has errors, and `unilat --check` reports exactly those its first comment lines announce:

    ** expect: LINE:COLUMN: *KEYWORD: message        (an error with its place)
    ** expect: message                               (an error of the deck as a whole)
    ** expect: and 5 more                            (what is above the cap)

in the order of the report. Nothing else may be reported: consequences of an error are no errors.
UNILAT names the program.
"""
import functools
import os
import pathlib
import re
import subprocess

import pytest

DECKS = sorted((pathlib.Path(__file__).parent / "decks_bad").glob("*.inp"))
MARK = "** expect: "
EVERY_PARAMETER = True   # with run-time checks, too: see conftest


@functools.cache
def check(deck, stdin=None):
    """Runs `unilat --check`; returns exit code and what it wrote to standard error."""
    command = [os.environ["UNILAT"], "--check"] + ([str(deck)] if stdin is None else [])
    run = subprocess.run(command, input=stdin, capture_output=True, text=True, encoding="utf-8", timeout=60)
    return run.returncode, run.stderr


def expected(deck):
    messages = []
    for line in deck.read_text(encoding="utf-8").splitlines():
        if not line.startswith(MARK):
            break
        messages.append(line[len(MARK):])
    return messages


def reported(stderr, name):
    """The messages of a report, without the file's name and the quoted lines."""
    heads = []
    for line in stderr.splitlines():
        if line.startswith(name + ":"):
            heads.append(line[len(name) + 1:].lstrip())
        elif re.fullmatch(r"and \d+ more", line):
            heads.append(line)
    return heads


def test_there_are_decks():
    assert len(DECKS) >= 100


@pytest.mark.parametrize("deck", DECKS, ids=lambda deck: deck.stem)
def test_bad_deck(deck):
    messages = expected(deck)
    assert messages, "the deck announces no error"
    code, stderr = check(deck)
    assert reported(stderr, str(deck)) == messages
    assert code == 1


@pytest.mark.parametrize("deck", DECKS, ids=lambda deck: deck.stem)
def test_carets_stand_under_the_place(deck):
    """Each message with a place is followed by that line of the deck, and by carets that begin in that column."""
    lines = deck.read_text(encoding="utf-8").splitlines()
    report = check(deck)[1].splitlines()
    for number, head in enumerate(report):
        place = re.match(re.escape(str(deck)) + r":(\d+):(\d+): ", head)
        if not place:
            continue
        line, column = int(place[1]), int(place[2])
        quoted, carets = report[number + 1], report[number + 2]
        assert quoted == f"{line:8d} | {lines[line - 1]}"
        assert re.fullmatch(r" {8} \| *\^+", carets)
        assert carets.index("^") == len(" " * 8 + " | ") + column - 1


def test_the_report_ends_with_the_number_of_errors():
    deck = DECKS[0].parent / "more_than_twenty.inp"
    assert check(deck)[1].splitlines()[-1] == f"25 errors in {deck}"


def test_standard_input_has_a_name():
    code, stderr = check(None, stdin="*HEADING\ntitle\n*NDOE\n")
    assert reported(stderr, "<stdin>") == ["3:1: unknown keyword *NDOE; did you mean *NODE?"]
    assert code == 1


def test_a_missing_deck_is_named():
    code, stderr = check("no-such-deck.inp")
    assert "no-such-deck.inp" in stderr
    assert code == 1


def test_messages_about_long_lines(tmp_path):
    """Half a million characters in a field and messages behind it: no time. Time that goes with the square takes minutes."""
    deck = tmp_path / "long.inp"
    deck.write_text("*NODE\n" + 500000 * "A" + "\n*" + 500000 * "B" + "\n", encoding="utf-8")
    code, stderr = check(deck)
    assert code == 1
    assert "long.inp:2:500001: *NODE: x is missing" in stderr and "long.inp:3:1: unknown keyword" in stderr

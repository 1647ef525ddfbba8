"""Text of files that others wrote, as it may stand in a table, a message, or on a terminal."""

from __future__ import annotations

FORMULA = ("=", "+", "-", "@")      # what a spreadsheet takes for the beginning of a formula


def control_place(text: str) -> int:
    """Position (from 1) of the first control character but the tab; 0 when there is none."""
    return next((place for place, letter in enumerate(text, start=1) if _is_control(letter) and letter != "\t"), 0)


def control_words(letter: str) -> str:
    return {"\n": "a line feed", "\r": "a carriage return", "\x1b": "an escape character", "\0": "a null character"}.get(
        letter, f"the control character number {ord(letter)}")


def printable(text: str) -> str:
    """The text in one line: control characters are the signs of Unicode for them, which no terminal obeys."""
    return "".join(_sign(letter) if _is_control(letter) else letter for letter in text)


def printable_lines(text: str) -> str:
    """The text with the lines that it has, each of them printable."""
    return "\n".join(printable(line) for line in text.split("\n"))


def cell(value):
    """A value of a CSV table: text that a spreadsheet would take for a formula begins with an apostrophe, as is usual there."""
    if not isinstance(value, str):
        return value
    text = printable(value)
    return f"'{text}" if value.lstrip().startswith(FORMULA) else text


def _is_control(letter: str) -> bool:
    return letter < " " or "\x7f" <= letter <= "\x9f"


def _sign(letter: str) -> str:
    return chr(0x2400 + ord(letter)) if letter < " " else "\u2421" if letter == "\x7f" else "\ufffd"

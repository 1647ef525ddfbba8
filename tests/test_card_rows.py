"""The table of cards, src/deck/cards.txt, as .cmake/make_cards.py reads it."""
import pathlib
import re
import subprocess
import sys

import pytest

SOURCE = pathlib.Path(__file__).parent.parent
SOUND = """
rows spot
   x, y | real [length] | | position

*THING | step; once; below OTHER
What it does.
   KIND | ROUND|FLAT | default ROUND | its shape
   lines; with KIND=ROUND; at most 1
      as spot
      size | real > 0 [length] | default 2; times x | its size
   lines; last repeats
      label | label or set | | where

foreign parameter of THING | SHAPE|FORM | here KIND
former value of KIND | OVAL | write ROUND
"""


def made(folder, rows):
    """What is made of some rows: the module, and messages."""
    (folder / "model").mkdir()
    (folder / "model" / "model.f90").write_text("")
    (folder / "deck").mkdir()
    (folder / "deck" / "cards.txt").write_text(rows)
    run = subprocess.run([sys.executable, SOURCE / ".cmake" / "make_cards.py", folder / "deck" / "cards.txt", folder / "rows.f90"],
                         capture_output=True, text=True)
    return (folder / "rows.f90").read_text() if run.returncode == 0 else "", run.stderr


def test_rows_become_entries(tmp_path):
    """Parameters and fields in their order; a group is put in its place, a point becomes two fields, a factor the number of its field."""
    module, _ = made(tmp_path, SOUND)
    assert re.findall(r"data (\w+)\((\d)\) /\w+\('(\w*=?\w*)'", module) == [
        ("cards", "1", "THING"), ("layouts", "1", "KIND=ROUND"), ("layouts", "2", ""),
        ("items", "1", "KIND"), ("items", "2", "x"), ("items", "3", "y"), ("items", "4", "size"), ("items", "5", "label")]
    assert "card_spec_t('THING', 'THING', in_step, .true., .false., 'OTHER', 1, 1, 1, 2, 'KIND')" in module
    assert "layout_t('KIND=ROUND', 1, 1, .false., 2, 4, 'x|y|size')" in module
    assert "item_t('size', kind_real, .false., '2', '', '', positive, usual_most, 1)" in module
    assert "call take('KIND|ROUND|FLAT', '*THING, KIND: its shape', '')" in module
    assert "call take('OVAL', 'KIND '//topic, ': a word of earlier versions; write ROUND')" in module
    assert "call take('parameter', 'THING', 'SHAPE|FORM', '; a word of Abaqus and CalculiX; here KIND')" in module
    assert "call take('value', 'KIND', 'OVAL', '; a word of earlier versions; write ROUND')" in module
    assert "'| size | real > 0 | length | 2 times the size of x | its size |'" in module


@pytest.mark.parametrize("row, message", [
    ("label | label or set | | where", ("label | label or set | where", "four columns")),
    ("size | real > 0 [length]", ("size | real >> 0 [length]", "'>> 0' is no bound")),
    ("default ROUND |", ("defaults ROUND |", "'defaults ROUND' is none of: default")),
    ("step; once;", ("stop; once;", "'stop' is none of: model, step")), ("step; once;", ("once;", "the part of the deck is missing"))])
def test_a_bad_row_is_told_with_its_line(tmp_path, row, message):
    module, error = made(tmp_path, SOUND.replace(row, message[0]))
    assert module == "" and message[1] in error and re.search(r"cards\.txt:\d+: ", error)

"""What the reader does with decks that nobody would write on purpose, or that somebody wrote on purpose: control characters, long
fields, endless files, many lines, numbers without bounds, words of other programs. Each is read, or refused with its place and
the limit that it has passed.

UNILAT names the program.
"""
import os
import pty
import re
import subprocess

import deck_runner as dr
import pytest

DECK = """*HEADING
x
*NODE
1, 0, 0
2, 1, 0
*LINE, ELSET=R, TYPE=GE8
1, 2, 2
*BEAM SECTION, ELSET=R, SECTION=STIFFNESS
1e6, 1
*BOUNDARY
1, ENCASTRE
*MONITOR, NAME=w
2, U2
*STEP
*STATIC, METHOD=LOAD
1
*CLOAD
2, 2, 1
*END STEP
"""
WITH_TEXT = "*PARAMETER\nkind = \"x\"\n" + DECK.replace("\nx\n", "\n${kind}\n")
LONG = 1000000
TERMINAL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f\x80-\x9f]")     # what a terminal may obey


def unilat(folder, *arguments, stdin="", code=0):
    """Output and messages of a run, which takes no more than a minute. What takes time with the square of its size takes more."""
    done = subprocess.run([os.environ["UNILAT"], *map(str, arguments)], input=stdin.encode(), capture_output=True, cwd=folder, timeout=60,
                          check=False)
    assert done.returncode == code, done.stderr[-2000:]
    return done.stdout.decode(), done.stderr.decode()


def refused(folder, text, *arguments):
    """The messages about a deck, each with its place; none is longer than 2 kB, and none moves a terminal."""
    (folder / "deck.inp").write_bytes(text if isinstance(text, bytes) else text.encode())
    said = unilat(folder, "--check", "deck.inp", *arguments, code=1)[1]
    assert not TERMINAL.search(said), repr(said[:300])
    parts = re.split(r"^(?=\S+:\d+:\d+: |deck.inp: )", said, flags=re.MULTILINE)[1:]
    assert parts and all(len(part.encode()) < 2048 for part in parts)
    return said


# Control characters


@pytest.mark.parametrize("value, place, what", [("a\nb", 8, "a line feed"), ("a\x1b[31mb", 8, "an escape character"), ("\rab", 7, "a carriage return"),
                                                ("*NODE\n1, 0, 0", 12, "a line feed"), ("\x07", 7, "the control character number 7")])
def test_control_characters_in_values_are_errors(tmp_path, value, place, what):
    """Lines would come in that nobody counts, and cards."""
    said = refused(tmp_path, WITH_TEXT, "--set", f'kind="{value}"')
    assert f": character {place} is {what}; names and values are printable text" in said and "1 error in deck.inp" in said


def test_control_characters_on_parameter_cards(tmp_path):
    said = refused(tmp_path, WITH_TEXT.replace('"x"', '"a\x1bb"'))
    assert "deck.inp:2:1: *PARAMETER: character 10 is an escape character" in said


@pytest.mark.parametrize("text", ["*FOO\x1b[2J\n", "*NODE\n1, \x1b]0;a\x07, 0\n", "*NODE\n1, \x9b31m, 0\n", "*NODE\n1, \xc2\x9b31m, 0\n",
                                  "*INCLUDE, FILE=\x1b[31m\n", "*PARAMETER\n\x1b = 1\n", "*HEADING, JOB=\x1bx\n", "${\x1b}\n"])
def test_messages_move_no_terminal(tmp_path, text):
    refused(tmp_path, text.encode("latin-1"))


def test_listing_and_name_move_no_terminal(tmp_path):
    """The title is stored as it is; the listing shows signs for what is no text."""
    (tmp_path / "a\x1b[31m.inp").write_bytes(DECK.replace("\nx\n", "\n\x1b]0;pwned\x07\x1b[31mred \xc3\xa9\n").encode("latin-1"))
    said = unilat(tmp_path, "--check", "a\x1b[31m.inp")[0]
    assert not TERMINAL.search(said.replace("\n", "")) and "\u241b]0;pwned\u2407\u241b[31mred \xe9" in said


def at_terminal(folder, *arguments):
    """Exit code and all that a run writes where its streams are a terminal."""
    ours, its = pty.openpty()
    run = subprocess.Popen([os.environ["UNILAT"], *arguments], cwd=folder, stdin=its, stdout=its, stderr=its)
    os.close(its)
    said = b""
    while True:
        try:
            piece = os.read(ours, 65536)
        except OSError:         # the other end is closed
            break
        if not piece:
            break
        said += piece
    os.close(ours)
    return run.wait(60), said.decode()


def test_expanded_decks_move_no_terminal(tmp_path):
    text = DECK.replace("\nx\n", "\n\x1b[31mred\n")
    (tmp_path / "deck.inp").write_text(text)
    assert unilat(tmp_path, "--expand", "deck.inp")[0] == text
    code, said = at_terminal(tmp_path, "--expand", "deck.inp")
    assert code == 0 and said.replace("\r\n", "\n") == text.replace("\x1b", "\u241b")


# Long fields


@pytest.mark.parametrize("text", [
    "*" + LONG * "B" + "\n", "*NODE, " + LONG * "B" + "\n1, 0, 0\n", "*NODE, NSET=" + LONG * "B" + "\n1, 0, 0\n", "*NODE\n1, " + LONG * "1" + "x, 0\n",
    "*NODE\n1, " + LONG * "1" + ", 0\n", "*NODE\n" + LONG * "1" + ", 0, 0\n", "*NODE\n1, 0, 0, " + LONG * "1" + "\n",
    "*NSET, NSET=A\n" + LONG * "1" + "\n", "*NSET, NSET=A\n" + LONG * "A" + "\n", "*BOUNDARY\n1, " + LONG * "A" + "\n", "*LINE, TYPE=" + LONG * "A" + "\n1, 2, 3\n",
    "*PARAMETER\n" + LONG * "a" + " = 1\n", "*PARAMETER\na = \"" + LONG * "a" + "\n", "*PARAMETER\na = " + LONG * "b" + "\n",
    "*PARAMETER\na = " + LONG * "1" + "\n", "*PARAMETER\na = " + (LONG // 2) * "1+" + "\n", "*PARAMETER\n" + LONG * "a" + "\n", "${" + LONG * "b" + "}\n", "${" + LONG * "b" + "\n",
    "*INCLUDE, FILE=" + LONG * "b" + "\n", "*INCLUDE, FILE=" + (LONG // 2) * "./" + "b\n", "*INCLUDE, FILE=" + 3000 * "b" + "\n", "*INCLUDE, " + LONG * "b" + "\n",
    "*HEADING, JOB=" + LONG * "é" + "\n", LONG * "é" + "\n"], ids=lambda text: re.sub(r"(.)\1{20,}", r"\1..", text[:40] + text[-40:]).replace("\n", "|")[:60])
def test_long_fields_are_shortened(tmp_path, text):
    refused(tmp_path, text)


@pytest.mark.parametrize("text", ["*{}\n", "*NODE, {}\n1, 0, 0\n", "*CONTACT, POINTS={}\n", "*BOUNDARY\n1, {}\n", "*NSET, NSET={}\n1\n", "*INCLUDE, {}=a\n",
                                  "*PARAMETER\na = {}\n"])
def test_fields_longer_than_the_stack(tmp_path, text):
    refused(tmp_path, text.format(9000000 * "a"))


def test_what_a_short_quote_says(tmp_path):
    """The beginning, the size, and of the line the part around the place, with carets below it."""
    lines = refused(tmp_path, f"*NODE\n1, 0, {LONG * 'A'}, {LONG * 'B'}\n").splitlines()
    assert lines[0] == f"deck.inp:2:7: *NODE: y must be a number, not {60 * 'A'}... ({LONG} characters)"
    assert lines[1].startswith("       2 | 1, 0, AAA") and lines[1].endswith("A...") and lines[2].index("^") == lines[1].index("A")
    assert lines[3].startswith(f"deck.inp:2:{LONG + 9}: *NODE: a field too many")
    assert lines[4].startswith("       2 | ...AAA") and lines[5].index("^") == lines[4].index("B")


def test_a_list_of_many_names_is_short(tmp_path):
    said = refused(tmp_path, "*PARAMETER\n" + "".join(f"p{i} = {i}\n" for i in range(5000)) + DECK, "--set", "q=1")
    assert "--set q: the deck has no such parameter (it has: p0, p1, " in said and "p19 and 4980 more)" in said


# What is no file, or never ends


def test_a_folder_is_told(tmp_path):
    (tmp_path / "parts").mkdir()
    assert unilat(tmp_path, "--check", "parts", code=1)[1] == "unilat: parts is a folder; a deck is a file\n"
    assert "deck.inp:1:1: *INCLUDE: parts is a folder" in refused(tmp_path, "*INCLUDE, FILE=parts\n" + DECK)
    assert "deck.inp:1:1: *INCLUDE: . is a folder" in refused(tmp_path, "*INCLUDE, FILE=.\n" + DECK)


def test_a_pipe_that_nobody_writes_to(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    assert "pipe is empty, or a pipe" in unilat(tmp_path, "--check", "pipe", code=1)[1]
    assert "deck.inp:1:1: *INCLUDE: pipe is empty, or a pipe" in refused(tmp_path, "*INCLUDE, FILE=pipe\n" + DECK)


def test_pipes_of_the_shell_are_read(tmp_path):
    (tmp_path / "deck.inp").write_text(DECK)
    for command in ('"$UNILAT" --check <(cat deck.inp)', 'cat deck.inp | "$UNILAT" --check /dev/stdin', 'cat deck.inp | "$UNILAT" --check'):
        done = subprocess.run(["bash", "-c", command], cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False)
        assert done.returncode == 0 and "GE8" in done.stdout, command + done.stderr


def test_empty_files_are_read(tmp_path):
    """They are no pipes: an empty deck has a place, an empty one that is included changes nothing."""
    assert "deck.inp:1:1: the deck is empty" in refused(tmp_path, "")
    assert "deck.inp:2:1: the deck is empty" in refused(tmp_path, "\n** nothing\n")
    (tmp_path / "none.inp").write_text("")
    (tmp_path / "deck.inp").write_text("*INCLUDE, FILE=none.inp\n" + DECK)
    unilat(tmp_path, "--check", "deck.inp")


def test_a_device_without_an_end(tmp_path):
    said = unilat(tmp_path, "--check", "/dev/zero", code=1)[1]
    assert said == "unilat: cannot read the deck /dev/zero: line 1 has more than 10000000 characters; is that a deck?\n"
    assert "*INCLUDE: cannot read the deck /dev/zero: line 1 has more than 10000000 characters" in refused(tmp_path, "*INCLUDE, FILE=/dev/zero\n" + DECK)


@dr.release_only
def test_too_many_lines(tmp_path):
    """Ten million, of one file, or of a deck with what it includes."""
    half = "\n" * 5000000
    assert "more than 10000000 lines" in unilat(tmp_path, "--check", stdin=half + half + "\n", code=1)[1]
    (tmp_path / "half.inp").write_text(half)
    said = refused(tmp_path, "*INCLUDE, FILE=half.inp\n*INCLUDE, FILE=half.inp\n" + DECK)
    assert "half.inp:4999998:1: the deck has more than 10000000 lines with all that it includes" in said


def test_too_many_files(tmp_path):
    """Ten times ten times ... lines of small files."""
    for k in range(20):
        (tmp_path / f"laughs{k}.inp").write_text(f"*INCLUDE, FILE=laughs{k + 1}.inp\n" * 10)
    (tmp_path / "laughs20.inp").write_text("** x\n")
    said = refused(tmp_path, "*INCLUDE, FILE=laughs0.inp\n" + DECK)
    assert "*INCLUDE: the deck includes more than 10000 files" in said and "1 error in deck.inp" in said


def test_too_deep(tmp_path):
    for k in range(101):
        (tmp_path / f"deep{k}.inp").write_text(f"*INCLUDE, FILE=deep{k + 1}.inp\n")
    assert "more than 100 decks include each other" in refused(tmp_path, "*INCLUDE, FILE=deep0.inp\n" + DECK)


# Time that grows with the size of the deck, not with its square


def spline(n, kind):
    points = "".join(f"{i / n * 3 - 1}, {-1 - (i % 2) * 0.001}\n" for i in range(n))
    return DECK.replace("*STEP", f"*OBSTACLE, NAME=O, TYPE={kind}\n{points}*STEP")


@pytest.mark.parametrize("text", [
    "*PARAMETER\n" + "".join(f"p{i} = {i}\n" for i in range(50000)) + DECK,
    "*PARAMETER\np0 = 1\n" + "".join(f"p{i} = p{i - 1}+1\n" for i in range(1, 20000)) + DECK,
    "*PARAMETER\nL = 1\n" + DECK.replace("*STEP", "*NSET, NSET=MANY\n" + "${L}\n" * 50000 + "*STEP", 1),
    "*PARAMETER\nL = 1\n" + DECK.replace("\nx\n", "\n" + "${L}" * 200000 + "\n"),
    DECK.replace("\nx\n", "\n" + "t\n" * LONG), spline(5000, "SPLINE"), spline(10000, "POLYLINE"),
    DECK.replace("1, 2, 2\n", "1, 2, 30000\n").replace("*BEAM", "*IMPERFECTION, ELSET=R, SHAPE=RANDOM\n1e-12\n*BEAM"),
    DECK.replace("1, 2, 2\n", "1, 2, 2500\n").replace("*BEAM", "*IMPERFECTION, ELSET=R, SHAPE=SINE\n1e-8, 10000\n*BEAM"),
    DECK.replace("*BEAM", "*IMPERFECTION, ELSET=R, SHAPE=SINE\n" + "1e-8, 1\n" * 1000 + "*BEAM")],
    ids=["parameters", "chain", "lines with ${}", "line with many ${}", "title", "spline", "polyline", "random", "half waves", "terms"])
def test_large_decks(tmp_path, text):
    (tmp_path / "deck.inp").write_text(text)
    unilat(tmp_path, "--check", "--quiet", "deck.inp")


def test_many_wrong_formulas(tmp_path):
    """Each of them may be one of many names that is misspelt."""
    refused(tmp_path, "*PARAMETER\n" + "".join(f"p{i} = {i}\n" for i in range(20000)) + "".join(f"q{i} = pp{i}\n" for i in range(20000)) + DECK)


# Limits


@pytest.mark.parametrize("number", ["1e101", "-1e101", "1e154", "1e308", "1e400", "-1e400", "1e99999999999", "1" + 150 * "0"])
def test_large_numbers(tmp_path, number):
    assert f"x is too large: {number if len(number) < 80 else number[:60]}" in refused(tmp_path, DECK.replace("2, 1, 0", f"2, {number}, 0"))
    said = refused(tmp_path, "*PARAMETER\nL = 1e200\n" + DECK.replace("2, 1, 0", "2, ${L}, 0"))
    assert "x is too large: 1e200; numbers are at most 1e100 in size" in said


def test_large_numbers_in_formulas(tmp_path):
    assert "1e308 is too large; numbers are below 1e308" in refused(tmp_path, "*PARAMETER\nL = 1e308\n" + DECK)


@pytest.mark.parametrize("number", ["1000000001", "2147483646", "2147483647", "2147483648", "99999999999999999999"])
@pytest.mark.parametrize("name, most", [("ITERATIONS", 1000000), ("DESIRED", 1000000), ("POINTS", 1000000000)])
def test_large_integers(tmp_path, name, most, number):
    said = refused(tmp_path, DECK.replace("*CLOAD", f"*CONTROLS, {name}={number}\n*CLOAD"))
    assert f"{name} is too large: {number}; at most {most}\n" in said


def test_largest_numbers_are_of_use():
    """Nothing overflows at the limits: w = P L^3/(3 EI) of the cantilever, in units that make its stiffness 1e100."""
    text = DECK.replace("1e6, 1\n", "1e100, 1e100\n").replace("2, 2, 1\n", "2, 2, 1e97\n").replace("*CLOAD", "*CONTROLS, ITERATIONS=1000000, DESIRED=999999, POINTS=1000000000\n*CLOAD")
    assert dr.run_deck(text).column("w")[-1] == pytest.approx(1e-3 / 3, rel=1e-5)


def test_large_labels(tmp_path):
    assert "label must be a positive integer below 2147483647, not 2147483647" in refused(tmp_path, DECK.replace("2, 1, 0", "2147483647, 1, 0"))


@pytest.mark.parametrize("kind, elements, most", [("GE8", "2", 8), ("GE4", "3", 6), ("UL2", "5", 5), ("GE8", "", 1000)])
@pytest.mark.parametrize("shape", ["SINE", "COSINE"])
def test_half_waves(tmp_path, kind, elements, most, shape):
    """As many as the elements have points to see them with; a thousand where the number of elements is left out."""
    def text(waves):
        return DECK.replace("GE8", kind).replace("1, 2, 2\n", f"1, 2, {elements}\n").replace("*BEAM", f"*IMPERFECTION, ELSET=R, SHAPE={shape}\n1e-8, {waves}\n*BEAM")
    (tmp_path / "deck.inp").write_text(text(most))
    unilat(tmp_path, "--check", "deck.inp")
    for waves in (most + 1, "1e12"):
        assert f":9:7: *IMPERFECTION: {waves} half waves are more than {most}, the most that" in refused(tmp_path, text(waves)).replace(":9:7", ":9:7")


# Places


@pytest.mark.parametrize("text, message", [
    (DECK.replace("*BEAM SECTION, ELSET=R, SECTION=STIFFNESS\n1e6, 1\n", ""), "deck.inp:7:1: 2 elements have no *BEAM SECTION, the first is element 1"),
    (DECK.split("*LINE")[0], "deck.inp:5:1: the deck ends here and has no elements"),
    ("** x\n\n", "deck.inp:1:1: the deck is empty")])
def test_every_message_has_a_place(tmp_path, text, message):
    assert message in refused(tmp_path, text)


def test_a_deck_without_steps(tmp_path):
    (tmp_path / "deck.inp").write_text(DECK.split("*STEP")[0] + "\n")
    assert "deck.inp:13:1: the deck ends here and has no *STEP" in unilat(tmp_path, "deck.inp", code=1)[1]


# Titles are of the deck


def test_no_file_becomes_the_title(tmp_path):
    (tmp_path / "secret").write_text("\n** of nobody\nsecret\n")
    (tmp_path / "outer.inp").write_text("** x\n*INCLUDE, FILE=secret\n")
    head = "*HEADING\nmine\n*INCLUDE, FILE={}\n" + DECK.split("x\n", 1)[1]
    for name in ("secret", "outer.inp"):
        said = refused(tmp_path, head.format(name))
        assert "deck.inp:3:1: *INCLUDE: below *HEADING a deck that begins with a keyword" in said and "\nsecret" not in said and "1 error" in said
    # Beside a heading that is itself of an included deck.
    (tmp_path / "head.inp").write_text("*HEADING\nmine\n")
    said = refused(tmp_path, "*INCLUDE, FILE=head.inp\nmine, too\n*INCLUDE, FILE=secret\n" + DECK.split("x\n", 1)[1])
    assert "deck.inp:3:1: *INCLUDE: below *HEADING" in said


def test_included_cards_may_follow_the_title(tmp_path):
    (tmp_path / "head.inp").write_text("*HEADING\nmine\n")
    (tmp_path / "nodes.inp").write_text("** nodes\n*NODE\n1, 0, 0\n2, 1, 0\n")
    (tmp_path / "deck.inp").write_text("*INCLUDE, FILE=head.inp\nmine, too\n*INCLUDE, FILE=nodes.inp\n" + DECK[DECK.index("*LINE"):])
    assert "mine\nmine, too\n\n" in unilat(tmp_path, "--check", "deck.inp")[0]


# Words of Abaqus and CalculiX, and words that are nearly right


@pytest.mark.parametrize("card, words", [
    ("PART, NAME=A", "not needed: a deck is one structure"), ("ASSEMBLY", "not needed: a deck is one structure"), ("INSTANCE", "not needed: a deck is one structure"),
    ("CONTACT PAIR", "here *OBSTACLE and *CONTACT"), ("SURFACE, NAME=S", "here *OBSTACLE is what nodes may touch"), ("PLASTIC", "not available: rods are elastic"),
    ("NODE PRINT", "here *FIELD OUTPUT stores fields"), ("EL FILE", "here *FIELD OUTPUT stores fields"), ("Friction", "not available: contact is without friction"),
    ("STEP, NLGEOM", "not needed: displacements and rotations are large"), ("STATIC, RIKS", "here METHOD=CYLINDRICAL"),
    ("STATIC, METHOD=RIKS", "here CYLINDRICAL, the default"), ("BOUNDARY, OP=NEW", "not available: what earlier steps"),
    ("ELEMENT, TYPE=B21", "for beams here GE8"), ("ELEMENT, TYPE=B22", "for beams here GE8"), ("ELEMENT, TYPE=B31", "for beams here GE8"),
    ("ELEMENT, TYPE=b32", "for beams here GE8"), ("ELEMENT, TYPE=T2D2", "for trusses here GE8"), ("ELEMENT, TYPE=S4R", "shells and solids are not available"),
    ("FIELD OUTPUT\nU", "here DISPLACEMENT"), ("FIELD OUTPUT\nSF", "here SECTION FORCES"), ("FIELD OUTPUT\nRF", "here *MONITOR with RF1, RF2, RM"),
    ("NODE\n7, 0, 0, 0", "a third coordinate is not available: rods lie in the plane"), ("BOUNDARY\n1, ZSYMM", "not available: rods lie in the plane"),
    ("BEAM SECTION, SECTION=BOX, ELSET=R\n1, 1", "here GENERAL, with A and I")])
def test_words_of_other_programs(tmp_path, card, words):
    said = refused(tmp_path, DECK.replace("*BEAM", f"*{card}\n*BEAM") if not card.startswith(("STEP", "STATIC", "FIELD")) else
                   re.sub(r"\*STEP\n\*STATIC.*\n1\n", f"*STEP\n*{card}\n" + ("" if card.startswith("STATIC") else "*STATIC\n") + "1\n", DECK)
                   if card.startswith("STATIC") else DECK.replace("*STEP\n", f"*{card}\n" if card.startswith("STEP") else f"*STEP\n*{card}\n"))
    assert words in said


@pytest.mark.parametrize("change, words", [
    (("ENCASTRE", "ENCASTER"), "dof cannot be ENCASTER; did you mean ENCASTRE?"), (("ENCASTRE", "pined"), "did you mean PINNED?"),
    (("2, U2", "2, U22"), "did you mean U2?"), (("*CLOAD", "*STOP\nLAOD, ABOVE, 1\n*CLOAD"), "monitor LAOD is not defined; did you mean LOAD?"),
    (("*CLOAD", "*STOP\nLOAD, ABOV, 1\n*CLOAD"), "did you mean ABOVE?"), (("*CLOAD", "*FIELD OUTPUT\nDISPLACEMENTS\n*CLOAD"), "did you mean DISPLACEMENT?"),
    (("*NODE", "*NDOE"), "unknown keyword *NDOE; did you mean *NODE?"), (("*NODE", "*XYZZY"), "unknown keyword *XYZZY; unilat --cards lists the keywords there are")])
def test_words_that_are_nearly_right(tmp_path, change, words):
    assert words in refused(tmp_path, dr.changed(DECK, change))


# The command


def test_alone_at_a_terminal(tmp_path):
    code, said = at_terminal(tmp_path)
    assert code == 1 and "usage: unilat [options] [deck.inp]" in said and "no deck is named, and standard input is a terminal" in said
    assert unilat(tmp_path, "--check", stdin=DECK)[1] == ""


def test_one_card(tmp_path):
    every = unilat(tmp_path, "--cards")[0]
    for name in ("BOUNDARY", "*boundary", "BEAM SECTION", "beamsection"):
        section = unilat(tmp_path, "--cards", name)[0]
        assert section in every and section.count("### ") == 1 and section.startswith("\n### `*B")
    assert unilat(tmp_path, "--cards", "BONDARY", code=1)[1] == "unilat: no card *BONDARY; did you mean *BOUNDARY?\n"
    assert "here *OBSTACLE and *CONTACT" in unilat(tmp_path, "--cards", "CONTACT PAIR", code=1)[1]


@pytest.mark.parametrize("word, answer", [("*BOUNDARY", "### `*BOUNDARY`"), ("--set", "--set NAME=VALUE\n"), ("set", "--set NAME=VALUE\n"), ("-o", "result file (HDF5)"),
                                          ("METHOD", "*STATIC, METHOD: what an increment prescribes"), ("ENCASTRE", "*BOUNDARY, field dof: "),
                                          ("RIKS", "METHOD=CYLINDRICAL"), ("B31", "GE8"), ("NLGEOM", "*STEP, NLGEOM: "), ("CONTACT PAIR", "*OBSTACLE and *CONTACT"),
                                          ("U", "DISPLACEMENT")])
def test_help_about_a_word(tmp_path, word, answer):
    said = unilat(tmp_path, "--help", word)[0]
    assert answer in said and "usage:" not in said


def test_help_about_nothing(tmp_path):
    assert unilat(tmp_path, "--help", "ENCASTER", code=1)[1] == "unilat: nothing is known of ENCASTER; did you mean ENCASTRE?\n"
    assert "unilat --help lists the options, unilat --cards the cards" in unilat(tmp_path, "--help", "xyzzy", code=1)[1]


# What traps of floating-point numbers found, in builds that have them


def test_a_polyline_of_two_points(tmp_path):
    (tmp_path / "deck.inp").write_text(DECK.replace("*STEP", "*OBSTACLE, NAME=WALL, TYPE=POLYLINE\n-1, 1\n-2, -1\n*STEP"))
    unilat(tmp_path, "--check", "deck.inp")


@pytest.mark.parametrize("formula, value", [("1e-300**1e307", 0), ("1e300**(-1e307)", 0), ("1**1e307", 1), ("2**(-1e-300)", 1)])
def test_powers_far_out(tmp_path, formula, value):
    (tmp_path / "deck.inp").write_text(f"*PARAMETER\na = {formula}\n" + DECK.replace("\nx\n", "\na is ${a}\n"))
    assert f"a is {value}\n" in unilat(tmp_path, "--check", "deck.inp")[0]


@pytest.mark.parametrize("formula", ["1e300**1e307", "1e-300**(-1e307)", "10**309", "2**1e300"])
def test_powers_that_are_too_large(tmp_path, formula):
    assert "the power is too large" in refused(tmp_path, f"*PARAMETER\na = {formula}\n" + DECK)

"""Decks of several files and with parameters: *INCLUDE, *PARAMETER, ${...}, --set, --expand.

The strip is bent by an end moment of 2 pi EI/L times turns: its end turns by 2 pi times turns, whatever EI and L.
UNILAT names the program.
"""
import os
import subprocess

import h5py
import numpy as np
import pytest

DECK = """*PARAMETER
kind = "GE8"
EI = 2e2/3
L = 1.5
n = 2*2
turns = 0.25
moment = 2*pi*turns*EI/L
*HEADING
A ${kind} strip of ${n} elements
** ${nothing} in comments
*NODE
*INCLUDE, FILE=parts/nodes.inp
*LINE, ELSET=STRIP, TYPE=${kind}
1, 2, ${n}
*BEAM SECTION, ELSET=STRIP, SECTION=STIFFNESS
1e6, ${EI}
*BOUNDARY
1, ENCASTRE
*MONITOR, NAME=TURN
2, UR
*INCLUDE, FILE=parts/../parts/./step.inp
"""
NODES = "1, 0, 0\n*INCLUDE, FILE=end.inp\n"
END = "** the end\n2, ${L}, 0"
STEP = "*STEP\n*STATIC, METHOD=LOAD\n0.25\n*CLOAD\n2, 6, ${moment}\n*END STEP\n"


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "parts").mkdir()
    (tmp_path / "strip.inp").write_text(DECK)
    (tmp_path / "parts" / "nodes.inp").write_text(NODES)
    (tmp_path / "parts" / "end.inp").write_text(END)
    (tmp_path / "parts" / "step.inp").write_text(STEP)
    return tmp_path


def unilat(folder, *arguments, stdin="", code=0):
    done = subprocess.run([os.environ["UNILAT"], *arguments], input=stdin, capture_output=True, text=True, cwd=folder, timeout=60,
                          check=False)
    assert done.returncode == code, done.stdout + done.stderr
    return done


def run(folder, *arguments, stdin=""):
    """The turn at the end of the path, the number of elements, attributes of the file and parameters."""
    said = unilat(folder, *arguments, "-o", "results.h5", stdin=stdin).stdout
    with h5py.File(folder / "results.h5") as file:
        parameters = dict(file["parameters"].attrs) if "parameters" in file else {}
        return file["path/monitor/TURN"][-1], len(file["mesh/elements"]), dict(file.attrs), parameters, said


def test_a_deck_of_parts(folder):
    turn, n, root, parameters, said = run(folder, "strip.inp")
    assert turn == pytest.approx(np.pi / 2, rel=1e-9) and n == 4 and root["title"] == "A GE8 strip of 4 elements"
    assert parameters == {"kind": "GE8", "EI": 2e2 / 3, "L": 1.5, "n": 4.0, "turns": 0.25, "moment": pytest.approx(np.pi * 100 / 4.5)}
    assert "\ndeck          strip.inp\n" in said


def test_the_command_line_sets_values_and_the_formulas_follow(folder):
    turn, n, _, parameters, said = run(folder, "strip.inp", "--set", "turns=0.5", "--set", "N = 3*2", "--set", "kind='GE6'")
    assert turn == pytest.approx(np.pi, rel=1e-6) and n == 6
    assert (parameters["turns"], parameters["N"], parameters["kind"]) == (0.5, 6.0, "GE6")
    assert "deck          strip.inp, turns = 0.5, N = 6, kind = \"GE6\"\n" in said and "6 GE6" in said


def test_the_deck_in_the_results_gives_the_same_run_by_itself(folder, tmp_path_factory):
    first = run(folder, "strip.inp", "--set", "turns=0.5", "--set", "L=1/3")
    elsewhere = tmp_path_factory.mktemp("elsewhere")
    (elsewhere / "strip.inp").write_text(first[2]["deck"])
    second = run(elsewhere, "strip.inp")
    assert second[0] == first[0] and second[3] == first[3]
    assert second[2]["deck"] == first[2]["deck"]            # and is stored as it is
    assert "** turns = 0.25\nturns = 0.5\n" in first[2]["deck"] and "** *INCLUDE, FILE=end.inp\n** the end\n2, ${L}, 0\n" in first[2]["deck"]


def test_what_has_no_default_is_stored_with_its_value(folder):
    (folder / "strip.inp").write_text(DECK.replace("turns = 0.25\n", ""))
    turn, _, root, _, _ = run(folder, "strip.inp", "--set", "turns=0.5")
    assert turn == pytest.approx(np.pi, rel=1e-9) and root["deck"].startswith("*PARAMETER\nturns = 0.5\n*PARAMETER\nkind")
    assert "strip.inp:6:1: *PARAMETER: no parameter 'turns' stands above" in unilat(folder, "strip.inp", code=1).stderr


def test_a_deck_without_parts_is_stored_byte_for_byte(folder):
    text = "*NODE\n1, 0, 0\n2, 1, 0\n*LINE, ELSET=S\n1, 2, 2\n*BEAM SECTION, ELSET=S, SECTION=STIFFNESS\n1e3, 1\n*BOUNDARY\n1, ENCASTRE\n" \
           "*MONITOR, NAME=TURN\n2, UR\n*STEP\n*STATIC, METHOD=LOAD\n1.\n*CLOAD\n2, 6, 1\n*END STEP\n"
    _, _, root, parameters, _ = run(folder, stdin=text)
    assert root["deck"] == text and parameters == {}


def test_from_standard_input_files_are_beside_the_working_directory(folder):
    assert run(folder, stdin=DECK)[0] == pytest.approx(np.pi / 2, rel=1e-9)
    said = unilat(folder / "parts", stdin=DECK, code=1).stderr
    assert said.startswith("<stdin>:12:1: *INCLUDE: cannot open the deck parts/nodes.inp: ")


def test_expand_is_the_deck_with_its_parts_and_its_own_values(folder):
    done = unilat(folder, "--expand", "strip.inp", "--set", "turns=0.5").stdout
    assert "turns = 0.25\n" in done and "1, 0, 0\n** *INCLUDE, FILE=end.inp\n** the end\n2, ${L}, 0\n" in done
    assert unilat(folder, "--expand", stdin=done).stdout == done


def test_an_absolute_name_and_one_from_a_parameter(folder):
    (folder / "strip.inp").write_text(DECK.replace("parts/nodes.inp", "${part}.inp").replace("*PARAMETER\n", f"*PARAMETER\npart = \"{folder}/parts/nodes\"\n"))
    assert run(folder, "strip.inp")[0] == pytest.approx(np.pi / 2, rel=1e-9)


# What is told


def told(folder, *arguments):
    return unilat(folder, "--check", "strip.inp", *arguments, code=1).stderr


def test_errors_name_the_file_and_show_the_line_as_typed(folder):
    (folder / "parts" / "end.inp").write_text("2, ${L}, q${n}, 7\n1, 0, 0\n")
    assert told(folder) == """parts/end.inp:1:10: *NODE: y must be a number, not q4
       1 | 2, ${L}, q${n}, 7
         |          ^^^^^
parts/end.inp:1:17: *NODE: a field too many; the line reads: label, x, y; a third coordinate is not available: rods lie in the plane of x and y
       1 | 2, ${L}, q${n}, 7
         |                 ^
parts/end.inp:2:1: *NODE: node 1 was defined in line 1 of parts/nodes.inp
       2 | 1, 0, 0
         | ^
3 errors in strip.inp
"""


def test_a_place_behind_the_end_and_inside_a_value(folder):
    (folder / "strip.inp").write_text(DECK.replace("1e6, ${EI}", "${ea}").replace("kind =", "ea = \"0, 2\"\nkind ="))
    assert told(folder).startswith("strip.inp:17:1: *BEAM SECTION: EA must be positive, not 0\n      17 | ${ea}\n         | ^^^^^\n")
    (folder / "strip.inp").write_text(DECK.replace("1e6, ${EI}", "${EI}"))
    assert told(folder).startswith("strip.inp:16:6: *BEAM SECTION: EI is missing; ")


def test_circles(folder):
    (folder / "parts" / "end.inp").write_text("*INCLUDE, FILE=../parts/nodes.inp\n")
    assert "parts/end.inp:1:1: *INCLUDE: parts/nodes.inp includes itself: parts/nodes.inp, parts/end.inp, parts/nodes.inp\n" in told(folder)
    (folder / "parts" / "end.inp").write_text("*INCLUDE, FILE=./end.inp\n")
    assert "parts/end.inp:1:1: *INCLUDE: parts/end.inp includes itself\n" in told(folder)


def test_a_circle_through_a_link_ends(folder):
    (folder / "parts" / "more").symlink_to(folder / "parts")
    (folder / "parts" / "end.inp").write_text("*INCLUDE, FILE=more/end.inp\n")
    assert "*INCLUDE: cannot open the deck parts/more/" in told(folder) and told(folder).count("*INCLUDE: ") == 1


def test_so_many_parts_that_it_must_be_a_mistake(folder):
    for k in range(110):
        (folder / f"part{k}.inp").write_text(f"*INCLUDE, FILE=part{k + 1}.inp\n")
    (folder / "strip.inp").write_text("*INCLUDE, FILE=part0.inp\n")
    assert told(folder).startswith("part98.inp:1:1: *INCLUDE: more than 100 decks include each other\n")


def test_a_name_used_in_two_files(folder):
    (folder / "parts" / "step.inp").write_text("*PARAMETER\nl = 3\n" + STEP)
    assert told(folder).startswith("parts/step.inp:2:1: *PARAMETER: the name was used in line 4 of strip.inp\n")


@pytest.mark.parametrize("setting, message", [
    ("lost=1", "--set lost: the deck has no such parameter (it has: kind, EI, L, n, turns, moment)"),
    ("L=", "--set L=: L has no value"), ("L=q", "--set L=q: no parameter 'q' stands above"),
    ("pi=3", "--set pi=3: pi means something in formulas; choose another name"),
    ("L='a", "--set L='a: text stands in a pair of quotes and has none inside: 'a")])
def test_wrong_settings(folder, setting, message):
    assert told(folder, "--set", setting) == f"strip.inp: {message}\n1 error in strip.inp\n"


def test_set_twice(folder):
    assert told(folder, "--set", "L=1", "--set", "l=2").startswith("strip.inp: --set l=2: set twice\n")



"""A tolerance instead of a mesh: decks without numbers of elements deliver the error that they ask for, or say that they do not.

Exact values: the ring's critical loads (tests/reference), Euler's column, the cantilever by elliptic integrals (many elements),
the deep arch by its reference; others by the same program with a given mesh many times as fine.
"""
from __future__ import annotations

import csv
import functools
import math
import pathlib
import re

import numpy as np
import pytest

import deck_runner as dr

pytestmark = dr.once_in_release

ROOT = pathlib.Path(__file__).resolve().parent.parent
RING_100 = 81.557427564661
TOLERANCES = (1e-3, 1e-5, 1e-7, 1e-9)


def without_counts(text):
    """The deck with elements of order 8 and their numbers left out."""
    text = re.sub(r"TYPE=GE\d", "TYPE=GE8", text)

    def rows(match):
        keep = 4 if "*ARC" in match[1] else 2
        lines = [", ".join(field.strip() for field in line.split(",")[:keep]) for line in match[2].splitlines()]
        return match[1] + "\n".join(lines) + "\n"
    return re.sub(r"(\*(?:LINE|ARC)[^\n]*\n)((?:\d+,[^\n]*\n)+)", rows, text)


def asking(name, tolerance, *changes):
    """An example deck, or a text, that asks for a tolerance."""
    text = without_counts(dr.example(name) if "\n" not in name else name)
    text = re.sub(r"\*ACCURACY[^\n]*\n", "", text)
    text = re.sub(r"\*STEP([^\n]*)\n", rf"*STEP\1\n*ACCURACY, TOLERANCE={tolerance}\n", text)
    return dr.changed(text, *changes)


def loads(run, label):
    return [c.load_factor for c in run.results.critical if c.label == label]


@functools.cache
def fine(name, n):
    """Limit loads of the same deck with n given elements of order 8 on every line or arc."""
    text = without_counts(dr.example(name))
    text = re.sub(r"(\*(?:LINE|ARC)[^\n]*\n)((?:\d+,[^\n]*\n)+)",
                  lambda m: m[1] + "".join(f"{line}, {n}\n" for line in m[2].splitlines()), text)
    return loads(dr.run_deck(re.sub(r"\*ACCURACY[^\n]*\n", "", text)), "LP")


@pytest.mark.parametrize("tolerance", TOLERANCES)
def test_ring_delivers_what_is_asked(tolerance):
    run = dr.run_deck(asking("ring", tolerance))
    (load,) = loads(run, "LP")
    assert abs(load - RING_100) <= tolerance * RING_100
    (bar,) = [c.error for c in run.results.critical if c.label == "LP"]
    assert abs(load - RING_100) <= bar <= tolerance * RING_100


@pytest.mark.parametrize("name", ["lee-frame", "column", "arch-shallow-hinged"])
@pytest.mark.parametrize("tolerance", [1e-3, 1e-6])
def test_limit_loads_deliver_what_is_asked(name, tolerance):
    expected = fine(name, 24)
    got = loads(dr.run_deck(asking(name, tolerance)), "LP")
    largest = max(abs(load) for load in expected)
    assert len(got) == len(expected)
    assert all(abs(a - b) <= tolerance * largest for a, b in zip(got, expected))


def test_a_smaller_tolerance_takes_more_elements_of_the_ring():
    """What is delivered follows what is asked: one mesh for all would be as good for each."""
    errors = [abs(loads(dr.run_deck(asking("ring", t)), "LP")[0] - RING_100) for t in (1e-2, 1e-9)]
    assert errors[0] > 1e2 * errors[1]


EULER = ("*HEADING, JOB=euler\n*NODE\n1, 0., 0.\n2, 1., 0.\n*LINE, ELSET=C\n1, 2\n*BEAM SECTION, ELSET=C, SECTION=STIFFNESS\n"
         "1E5, 1.\n*BOUNDARY\n1, ENCASTRE\n2, YSYMM\n*MONITOR, NAME=x\n2, U1, -1.\n*STEP\n*STATIC, METHOD=LOAD\n2., 1E-9, 3.\n"
         "*CLOAD\n2, 1, -10.\n*STOP\nLOAD, ABOVE, 5.\n*END STEP\n")


@pytest.mark.parametrize("tolerance", [1e-3, 1e-6])
def test_bifurcation_of_a_clamped_column(tolerance):
    """P (1 - P/EA) = 4 pi^2 EI in tenths."""
    exact = 0.1 * 0.5 * (1.0 - math.sqrt(1.0 - 4.0 * 4.0 * math.pi**2 / 1e5)) * 1e5
    (load,) = loads(dr.run_deck(asking(EULER, tolerance)), "BP")
    assert abs(load - exact) <= tolerance * 5.0


def test_a_given_number_stays_and_its_bar_tells():
    """Two elements of order 4 for the frame's lines: far from 1e-6, which the run says."""
    text = re.sub(r"TYPE=GE\d", "TYPE=GE4", dr.on_given_mesh("lee-frame"))
    text = re.sub(r"(\d, \d), \d+\n", r"\1, 2\n", text).replace("*STEP\n", "*STEP\n*ACCURACY, TOLERANCE=1E-6\n")
    run = dr.run_deck(text, code=2)
    assert "1E-06" in run.stderr and "WIDEST" in run.stderr


def test_without_the_card_a_millionth_is_asked_for():
    run = dr.run_deck(without_counts(dr.example("ring")))
    (load,) = loads(run, "LP")
    assert abs(load - RING_100) <= 1e-6 * RING_100


def test_an_error_that_rounding_does_not_allow_is_said():
    run = dr.run_deck(asking("arch-deep-hinged", "1E-15"), code=2)
    assert "the errors asked for are not reached" in run.stderr


@dr.release_only
@pytest.mark.parametrize("name", sorted(dr.MESHES))
def test_shipped_decks_keep_what_they_ask_for(name):
    """Code 0, and every closed bar of a critical load within the tolerance of the largest load of its step so far. Whether the bar
    of the deep arch's second bifurcation closes depends on rounding; its load is held against the exact one below."""
    run = dr.run_deck(dr.example(name))
    assert "do not get on" not in run.stdout   # no contact at nodes instead of spans
    largest = {}
    for c in run.results.critical:
        largest[c.step] = max(largest.get(c.step, 0.0), float(np.max(np.abs(run.column("load_factor")[
            (run.column("step") == c.step) & (np.arange(1, len(run.column("step")) + 1) <= c.point)]))))
        if c.label in ("LP", "BP", "EP") and math.isfinite(c.error):
            assert c.error <= 1e-6 * largest[c.step] * (1.0 + 1e-9), c


@dr.release_only
def test_shipped_decks_are_right():
    """Exact values of the decks' comments, to the digits that are asked for."""
    for name, label, exact in (("ring", "LP", [RING_100]), ("lee-frame", "LP", [18.5567275376, -9.4144315556]),
                               ("arch-deep-hinged", "BP", [3.2762821980, -13.205837158]), ("column", "LP", [2.484036097, 1.025646944])):
        found = loads(dr.run_deck(dr.example(name)), label)
        assert len(found) == len(exact), name
        for load, value in zip(found, exact):
            assert abs(load - value) <= 1e-6 * max(abs(one) for one in exact), name


def counted(run, name):
    """A counter at the end of the listing."""
    return int(re.search(rf"^   {name} +(\d+)$", run.stdout, re.MULTILINE)[1])


def test_what_a_scene_does_not_need_is_left_out():
    """Work follows the tolerance: the ring's meshes and iterations for 1e-3 and for 1e-9."""
    coarse, fine = (dr.run_deck(asking("ring", tolerance)) for tolerance in (1e-3, 1e-9))
    assert counted(coarse, "elements at the most") <= 5 < counted(fine, "elements at the most") <= 32
    assert 3 * counted(coarse, "elements evaluated") < counted(fine, "elements evaluated")
    assert counted(coarse, "Newton iterations") < 0.8 * counted(fine, "Newton iterations")


def test_meshes_become_coarser_where_less_is_needed():
    """Behind the deep arch's second bifurcation (-13.2058) the systems have on average fewer elements than the largest up to there."""
    without_branch = ("*BRANCH, NAME=SWAY, SIDE=PLUS, INCREMENT=0.01\nv, ABOVE, 2.02\n", "")
    there, behind = (dr.run_deck(asking("arch-deep-hinged", 1e-6, without_branch, ("LOAD, ABOVE, 30.", f"LOAD, BELOW, {load}")))
                     for load in (-13.3, -20.))
    evaluated, systems = (counted(behind, name) - counted(there, name) for name in ("elements evaluated", "factorisations"))
    assert 0 < evaluated < systems * counted(there, "elements at the most")


# One deck each, with nothing but a parameter changed: the maps' own decks

def asked_deck(name, asked, **values):
    """A deck of the study of tolerances."""
    options = [part for key, value in {"asked": asked, **values}.items() for part in ("--set", f"{key}={value!r}")]
    return dr.run_deck((ROOT / "input" / "maps" / f"asked-{name}.inp").read_text(encoding="utf-8"), *options)


def exact_value(name, column, **values):
    """Of the tables of exact values."""
    with open(ROOT / "input" / "maps" / "exact" / f"{name}.csv", newline="", encoding="utf-8") as file:
        rows = [{key: float(cell or "nan") for key, cell in row.items()}
                for row in csv.DictReader(line for line in file if not line.startswith("#"))]
    (row,) = [row for row in rows if all(math.isclose(row[key], value) for key, value in values.items() if key in row)]
    return row[column]


@pytest.mark.parametrize("slenderness", [10.0, 1e3, 1e4, 1e5, 1e6])
@pytest.mark.parametrize("asked", [1e-3, 1e-6])
def test_rings_from_thick_to_thin(slenderness, asked):
    """R/h over five decades: the free part is 2 rad long or 0.02, the apex moves by a fourth of the radius or by 2e-5. The mesh goes with
    them: where rounding was
    taken for a lack of elements there were hundreds."""
    run = asked_deck("ring", asked, slenderness=slenderness)
    (load,) = loads(run, "LP")
    dr.assert_close(load, exact_value("ring", "limit_load", slenderness=slenderness), relative=asked)
    assert counted(run, "elements at the most") <= 64


@pytest.mark.parametrize("asked, slenderness", [(1e-3, 20.0), (1e-3, 200.0), (1e-3, 1e5), (1e-5, 20.0), (1e-5, 200.0), (1e-5, 1e5),
                                                (1e-7, 20.0), (1e-7, 200.0), (1e-6, 1e5)])
def test_columns_beside_a_wall(slenderness, asked):
    """Of the most slender one rounding allows 3e-7 of what the end moves."""
    run = asked_deck("column", asked, slenderness=slenderness, gap=0.02)
    dr.assert_close(loads(run, "C+")[0], exact_value("column", "contact", slenderness=slenderness, gap=0.02), relative=asked)
    dr.assert_close(loads(run, "LP")[0], exact_value("column", "limit_load", slenderness=slenderness, gap=0.02), relative=asked)


@pytest.mark.parametrize("slenderness", [20.0, 1e3, 1e5])
@pytest.mark.parametrize("asked", [1e-5, 1e-7])
def test_a_bifurcation_on_a_straight_path(slenderness, asked):
    """The path is exact on any mesh; only the eigenvalue asks for elements, and of the mode alone. P (1 - P/EA) = 4 pi^2 EI."""
    run = asked_deck("euler", asked, slenderness=slenderness)
    ea = 12.0 * slenderness**2
    exact = 0.2 * math.pi**2 / (1.0 + math.sqrt(1.0 - 16.0 * math.pi**2 / ea))
    dr.assert_close(loads(run, "BP")[0], exact, relative=asked)
    assert counted(run, "elements at the most") <= 16


@pytest.mark.parametrize("gap", [0.0, 0.001, 0.01])
@pytest.mark.parametrize("asked", [1e-3, 1e-5, 1e-7, 1e-9])
def test_liners_with_a_gap(gap, asked):
    """The bottom lies down all at once on the way: of the neutral span there nothing is asked."""
    run = asked_deck("liner", asked, R_t=50, disturbance=0.001, gap=gap)
    dr.assert_close(loads(run, "LP")[0], exact_value("liner", "p", R_t=50, disturbance=0.001, gap=gap), relative=asked)
    assert counted(run, "elements at the most") <= 40


def test_limit_curves_have_meshes_of_their_own():
    """Ten times the imperfection asks for more elements than the path's limit point: every bar within what is asked."""
    text = dr.example("arch-imperfect")
    kept = dr.run_deck(text)
    told = [float(bar) for bar in re.findall(r"^ +\d+ .*\+- +(\S+)", kept.stdout[kept.stdout.index("Limit curve LARGER"):], re.MULTILINE)]
    assert len(told) > 10 and max(told) <= 1e-6 * 13.5


def test_rounding_is_told_once_and_in_words():
    """A millionth of a millionth of a place at a limit point of EA R^2/EI = 1e12: no mesh has that."""
    text = (ROOT / "input" / "maps" / "asked-arch.inp").read_text(encoding="utf-8")
    run = dr.run_deck(text, "--set", "asked=1e-12", "--set", "ea=1e12", code=2)
    assert run.stderr.count("rounding does not allow more than") == 1


@pytest.mark.parametrize("flattening", [0.5, 0.7])
@pytest.mark.parametrize("asked", [1e-3, 1e-5, 1e-7])
def test_tubes_between_plates(flattening, asked):
    """Where contact has just spread from a point to a line of no length a finer mesh begins at the increment's end."""
    run = asked_deck("tube", asked, flattening=flattening)
    dr.assert_close(run.column("F")[-1], exact_value("tube", "F", flattening=flattening), relative=asked)
    assert counted(run, "elements at the most") <= (20 if asked > 1e-6 else 48)


@pytest.mark.parametrize("largest", [0.006, 0.01])
def test_symmetric_structures_keep_symmetric_meshes(largest):
    """Both halves of the deep arch have the same elements: rounding that grew from mesh to mesh made an imperfection of its own, and
    the path followed a branch of the first bifurcation, or of the second."""
    run = asked_deck("arch-deep", 1e-3, largest=largest)
    assert [c.label for c in run.results.critical] == ["BP", "LP", "BP", "LP", "EP"]
    assert np.abs(run.column("u")).max() < 1e-6


@pytest.mark.parametrize("tolerance", [1e-6, 1e-8, 1e-9])
def test_bending_beside_much_shortening(tolerance):
    """A stocky column a millionth of its length from the wall: it bends by a thousandth of what it is shortened by. Where the path is
    left beside its limit point that is told."""
    text = (ROOT / "input" / "maps" / "column.inp").read_text(encoding="utf-8")
    values = {"slenderness": 50.0, "gap": 1e-6, "length": 1.0, "force": 1.0, "kind": "GE8", "elements": 6, "first": 0.1,
              "largest": 0.1, "tolerance": tolerance, "desired": 5, "locate": 1e-8}
    for name, value in values.items():
        text = "*PARAMETER\n" + f'{name} = {value!r}\n'.replace("'", '"') + text
    run = dr.run_deck(text, code=None)
    limits = [c for c in run.results.critical if c.label == "LP" and c.located]
    assert run.code in (0, 2)
    if run.code == 0:
        exact = exact_value("column", "limit_load", slenderness=50.0, gap=1e-6)
        assert abs(limits[0].load_factor - exact) <= max(limits[0].error, 1e-9)


def test_modes_as_imperfections_do_not_hang_on_the_mesh():
    """The limit load with a mode as imperfection, asked 1e-4 and 1e-6: each within its bar of the finer one. Between the nodes of a
    coarse mesh modes were wrong by a thousandth."""
    text = dr.example("arch-imperfect")
    text = re.sub(r"\*LIMIT CURVE.*?(?=\*STOP)", "", text[:text.index("*STEP, NAME=PERFECT")] +
                  text[text.index("*STEP, NAME=IMPERFECT"):], flags=re.DOTALL)
    coarse, fine = (dr.run_deck(text.replace("TOLERANCE=1E-6", f"TOLERANCE={asked}")).labelled("LP")[0] for asked in ("1E-4", "1E-6"))
    assert abs(coarse.load_factor - fine.load_factor) <= coarse.error + fine.error
    assert abs(coarse.corrected - fine.corrected) <= 0.1 * coarse.error


THICK = ("30000., 1.\n", "1981.04, 0.56\n")


@functools.cache
def thick_liner():
    """Limit load of a thick liner with 8 and 16 given elements, to 1E-12."""
    text = dr.changed(dr.example("liner"), THICK, ("1, 2, 0., 0.\n", "1, 2, 0., 0., 8\n"), ("2, 3, 0., 0.\n", "2, 3, 0., 0., 16\n"))
    return loads(dr.run_deck(re.sub(r"\*ACCURACY[^\n]*\n", "", text)), "LP")


HEATED = """*HEADING
Column heated between clamps: nothing moves until it buckles
*NODE
1, 0., 0.
2, 0.5, 0.
3, 1., 0.
*LINE, ELSET=COLUMN, NSET=COLUMN, TYPE=GE8
1, 2
2, 3
*BEAM SECTION, ELSET=COLUMN, SECTION=STIFFNESS
1e5, 1., , , 0.001
*BOUNDARY
1, ENCASTRE
3, ENCASTRE
*MONITOR, NAME=midspan
2, U2
*STEP
*ACCURACY, TOLERANCE={tolerance}
*STATIC, METHOD=LOAD
0.1, , 0.1
*TEMPERATURE
COLUMN, 1.
*STOP
LOAD, ABOVE, 0.7
*END STEP
"""


@pytest.mark.parametrize("tolerance", [1e-3, 1e-6, 1e-9])
def test_buckling_where_nothing_moves(tolerance):
    """EA alpha T = 4 pi^2 EI/L^2."""
    bifurcation = dr.run_deck(HEATED.format(tolerance=tolerance)).only("BP")
    exact = 4.0 * math.pi**2 / 100.0
    dr.assert_close(bifurcation.load_factor, exact, relative=tolerance)
    assert abs(bifurcation.load_factor - exact) <= bifurcation.error


def test_one_sided_bifurcation():
    """A line without pressure lets go at 16 Pcr; its bar is as wide as the error. The line is half as long as the column then, and
    both its ends have bars."""
    runs = [dr.run_deck(asking("column-walls", t)).results for t in (1e-4, 1e-6)]
    coarse, fine = (next(c for c in run.critical if c.label == "BP") for run in runs)
    for run, bifurcation in zip(runs, (coarse, fine)):
        there = bifurcation.point - 1
        ends = np.array([run.contact.start[there, 0], run.contact.end[there, 0]])
        assert np.all(abs(ends - [0.25, 0.75]) <= run.contact.bars[:2, there, 0])
    dr.assert_close(fine.load_factor, 16.0, relative=1e-6)
    error = abs(coarse.load_factor - fine.load_factor)
    assert error <= coarse.error + fine.error
    assert coarse.error <= 2.0 * error
    dr.assert_close(coarse.corrected, fine.load_factor, absolute=0.1 * error)


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3])
@pytest.mark.parametrize("name", ["pipe-heat", "column", "ring-full"])
def test_coarse_meshes_do_what_is_asked(name, tolerance):
    """Long elements beside touchdown points that travel; a pipe on the ground that a jack takes along; and checks that ask for no
    more than the deck."""
    coarse, fine = (dr.run_deck(asking(name, t)).results.critical for t in (tolerance, 1e-6))
    told = [[c for c in run if c.label in ("C+", "C-", "LP")] for run in (coarse, fine)]
    assert [c.label for c in told[0]] == [c.label for c in told[1]]
    largest = max(abs(c.load_factor) for c in told[1])
    for a, b in zip(*told):
        dr.assert_close(a.load_factor, b.load_factor, absolute=tolerance * largest)


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3, 1e-4, 1e-5, 1e-7])
def test_a_line_that_lifts_off_at_once(tolerance):
    """The line below the liner lifts off all at once and leaves the point at its end, from which a span lies down later. Both sets have
    one equilibrium there, on two meshes: what these differ by is neither another path nor a limit point."""
    run = dr.run_deck(asking("liner", tolerance, THICK))
    dr.assert_close(loads(run, "LP"), thick_liner(), relative=tolerance)
    contact = run.results.contact
    points = np.flatnonzero(contact.start[:, 0] == contact.end[:, 0])
    assert 2 <= len(points) <= 8 and contact.end[points[0] - 1, 0] > 3.14 and contact.end[points[-1] + 1, 0] > 3.14


# What a few elements hide ------------------------------------------------------------------------------------------------

DENTED = """*NODE
1, 0.0, 1.0
*NODE
2, 0.0, -1.0
*ARC, ELSET=R, NSET=R, TYPE=GE8, DIRECTION=ANTICLOCKWISE
1, 2, 0.0, 0.0
*BEAM SECTION, ELSET=R, SECTION=STIFFNESS
43200.0, 1.0
*BOUNDARY
1, 1
1, 6
*BOUNDARY
2, 1, 2
2, 6
*IMPERFECTION, ELSET=R, SHAPE=NODAL
1, 0.01
*OBSTACLE, NAME=C, TYPE=CIRCLE, SIDE=INSIDE
0.0, 0.0, 1.0
*CONTACT, OBSTACLE=C, NSET=R, GAP=0.01
*MONITOR, NAME=v
1, U2, -1.0
*STEP
*ACCURACY, TOLERANCE={tolerance}
*STATIC, METHOD=CYLINDRICAL
0.3, , 0.01
*DLOAD
R, P, 1.0
*CLOAD
1, 2, -0.02
*STOP
v, ABOVE, 0.3
*END STEP
"""

SHORTENED = """*NODE
1, 0.0, 0.0
*NODE
2, 0.5, 0.0
*NODE
3, 1.0, 0.0
*LINE, ELSET=R, NSET=R, TYPE=GE8
1, 2
*LINE, ELSET=R, NSET=R, TYPE=GE8
2, 3
*IMPERFECTION, ELSET=R, SHAPE=CLAMPED
0.004, 0.002
*BEAM SECTION, ELSET=R, SECTION=STIFFNESS
100000.0, 1.0
*BOUNDARY
1, 1, 2
1, 6
*BOUNDARY
3, 1, 2
3, 6
*OBSTACLE, NAME=T, TYPE=LINE
1.0, 0.05, 0.0, 0.05
*OBSTACLE, NAME=B, TYPE=LINE
0.0, -0.05, 1.0, -0.05
*CONTACT, OBSTACLE=T, NSET=R
*CONTACT, OBSTACLE=B, NSET=R
*MONITOR, NAME=P
1, RF1, 1.0
*STEP
*ACCURACY, TOLERANCE={tolerance}
*STATIC, METHOD=CYLINDRICAL
0.02, , 0.05
*BOUNDARY
3, 1, , -0.05
*STOP
LOAD, ABOVE, 1.
*END STEP
"""


@pytest.mark.parametrize("tolerance", [0.1, 0.03, 0.02, 0.01, 0.005])
@pytest.mark.parametrize("deck, label, exact", [(DENTED, "C+", 1.523086579), (SHORTENED, "LP", 0.7339073548)], ids=["dented", "shortened"])
def test_bars_of_a_few_elements(deck, label, exact, tolerance):
    """A dent between the points that the elements look at, and shares that cancel: elements of one order more were wrong together with
    the elements (errors of 24 and 2 bars). What those of two orders more say is in the bar, or there is none. Exact: asked 1E-8."""
    point = dr.run_deck(deck.format(tolerance=tolerance)).labelled(label)[-1]
    assert abs(point.load_factor - exact) <= point.error


PRESSED = """*NODE
1, 0.0, 0.1
*NODE
2, 1.0, 0.1
*LINE, ELSET=R, NSET=R, TYPE=GE8
1, 2
*BEAM SECTION, ELSET=R, SECTION=STIFFNESS
10000.0, 1.0
*BOUNDARY
1, 1, 2
1, 6
*OBSTACLE, NAME=T, TYPE=LINE
0.0, 0.0, 1.0, 0.02
*CONTACT, OBSTACLE=T, NSET=R
*MONITOR, NAME=t
2, U2, 1.0
*STEP
*ACCURACY, TOLERANCE={tolerance}
*STATIC, METHOD=LOAD
0.05
*DLOAD
R, PY, -30.0
*LOCATE
t, -0.05
*END STEP
*STEP
*ACCURACY, TOLERANCE={tolerance}
*STATIC, METHOD=LOAD
0.05
*DLOAD
R, PY, 30.0
*END STEP
"""


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3])
def test_places_are_located_within_their_bars(tolerance):
    """The tip lets go where it has touched: both loads add up to 1 within their bars. A value that was asked for is met by prescribing
    it, not next to it."""
    run = dr.run_deck(PRESSED.format(tolerance=tolerance))
    gained, lost = run.only("C+"), run.only("C-")
    assert abs(gained.load_factor + lost.load_factor - 1.0) <= gained.error + lost.error
    assert abs(gained.load_factor - 0.0214630196) <= gained.error
    assert abs(run.only("UZ").monitors["t"] + 0.05) <= 1e-15


STOPS = """*NODE
1, 0, 0
2, 1.0, 0
3, 1.6, 0
4, 2.5, 0
5, 3.5, 0
*LINE, ELSET=A, TYPE=GE8
1, 2{n}
2, 3{n}
*LINE, ELSET=B, TYPE=GE8
3, 4{n}
4, 5{n}
*BEAM SECTION, ELSET=A, SECTION=STIFFNESS
1e5, 1.0, , , 1e-3
*BEAM SECTION, ELSET=B, SECTION=STIFFNESS
1e5, 2.0, , , 1e-3
*RELEASE
3, B
*BOUNDARY
1, ENCASTRE
5, PINNED
*GAP, NAME=S2
2, 0.01
*GAP, NAME=S4
4, 0.02
*GAP, NAME=T3, DIRECTION=-90, STIFFNESS=100.0
3, 0.001
*MONITOR, NAME=h
3, U2
*MONITOR, NAME=s2, OBSTACLE=S2
RN
*MONITOR, NAME=s4, OBSTACLE=S4
RN
*MONITOR, NAME=t3, OBSTACLE=T3
RF2
"""
STOPS_STEP = """*STEP
*STATIC, METHOD=LOAD
{first}
*ACCURACY{asked}
{loads}
*END STEP
"""
THRUST = 10.0  # of the heated rods, what forces are measured against
STOPS_LOADS = ("*DLOAD\nA, PY, -1.0\nB, PY, -1.0", "*TEMPERATURE\nA, .1, 400.0\nB, -1., -300.0", "*CLOAD\n3, 2, 4")


@functools.cache
def stops(asked="", n="", first=0.1):
    """Two hinged beams over stops: load, heat, lift. Each stop is met or left."""
    steps = "".join(STOPS_STEP.format(first=first, asked=asked, loads=loads_) for loads_ in STOPS_LOADS)
    return [c for c in dr.run_deck(STOPS.format(n=n) + steps).results.critical if c.label in ("C+", "C-", "EP")]


@pytest.mark.parametrize("tolerance", (1e-3, 1e-5, 1e-7))
def test_stops_at_nodes_have_bars_and_the_mesh_that_is_asked_for(tolerance):
    """Gap and reaction of a stop tell where it is met and left, and its force is known as those of supports are."""
    right = stops(n=", 12", first=0.02)
    told = stops(asked=f", TOLERANCE={tolerance}")
    assert [c.label for c in told] == [c.label for c in right] == ["C+", "C+", "EP", "EP", "C-", "C-", "C+", "EP"]
    for here, exact in zip(told, right):
        assert abs(here.load_factor - exact.load_factor) <= min(here.error, tolerance) + exact.error
        if here.label != "EP":
            assert abs(here.corrected - exact.load_factor) <= 0.3 * here.error + exact.error
        for name, scale in (("h", 0.03), ("s2", THRUST), ("s4", THRUST), ("t3", THRUST)):
            error = abs(here.monitors[name] - exact.monitors[name])
            assert error <= here.monitor_errors[name] + exact.monitor_errors[name] + 1e-11, name
            assert here.monitor_errors[name] <= tolerance * scale, name


def test_limit_point_among_points_known_to_the_tolerance():
    """Small increments around the limit point of a liner: loads beside it, known to the tolerance of the iteration, may be above
    its own. The reference is the same liner on elements that are a hundred times better."""
    def liner(asked):
        return dr.run_deck(f"""*HEADING
liner with a gap and a small force at the crown
*NODE
1, 0., 1.
2, 1., 0.
3, 0., -1.
*ARC, ELSET=RING, NSET=RING, TYPE=GE8, DIRECTION=CLOCKWISE
1, 2, 0., 0.
2, 3, 0., 0.
*BEAM SECTION, ELSET=RING, SECTION=STIFFNESS
30000., 1.
*BOUNDARY
1, XSYMM
3, XSYMM
*OBSTACLE, NAME=HOST, TYPE=CIRCLE, SIDE=INSIDE
0., 0.004, 1.004
*CONTACT, OBSTACLE=HOST, NSET=RING
*MONITOR, NAME=v
1, U2, -1.
*MONITOR, NAME=h
2, U1
*STEP
*ACCURACY, TOLERANCE={asked}
*STATIC, METHOD=SPHERICAL
0.1, 1E-9, 0.05
*DLOAD
RING, PY, -1.
*CLOAD
1, 2, -0.001
*STOP
v, ABOVE, 0.1
*END STEP
""")
    dr.assert_close(liner(1e-4).load("LP"), liner(1e-6).load("LP"), relative=1e-4)

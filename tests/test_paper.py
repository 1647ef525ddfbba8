"""input/run paper: its tables agree with the exact numbers within their bars, its figures are drawn.

UNILAT names the program.
"""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path

import pytest

TESTS = Path(__file__).resolve().parent
ROOT = TESTS.parent
sys.path[:0] = [str(TESTS), str(ROOT / "postproc")]

from postproc_runner import drawn_share  # noqa: E402
from unilat.paper import figures  # noqa: E402
from unilat.paper.runs import RUNS, Runs, changed_deck  # noqa: E402
from unilat.paper.tables import EXACT, PAPER, PIAN, STEIN, Sources, table_1, table_2, table_column  # noqa: E402
from unilat.results import ResultsError  # noqa: E402

ANGLES_TOLD = 5.1e-8       # ring_angles.csv has seven decimals


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    made = Runs(str(ROOT), os.environ["UNILAT"], str(tmp_path_factory.mktemp("paper")))
    made.make(2)
    return made


@pytest.fixture(scope="module")
def sources():
    return Sources(str(ROOT))


def cells(table):
    """Rows of numbers and their bars; the label first."""
    for line in table.splitlines()[3:]:
        label, *rest = re.split(r"\s{2,}", line.strip())
        yield label, [tuple(float(part) for part in cell.split("+-")) for cell in rest]


def test_table_1(runs, sources):
    rows = dict(cells(table_1(runs, sources)))
    assert [rows[by] for by in (PIAN, STEIN, PAPER)] == [[(81.5,)], [(79.9,)], [(80.3,)]]
    for ours, exact, rounded in (("unilat, rigid cavity", "exact, rigid cavity", 1e-8),
                                 ("unilat, the paper's foundation", "exact, the paper's foundation", 1e-6)):
        (((value, bar),), ((true,),)) = rows[ours], rows[exact]
        assert abs(value - true) <= bar + rounded
        assert bar < 1e-5 * true
    ((value, bar),) = rows["unilat, the paper's element and loop"]
    assert abs(value - rows["exact, rigid cavity"][0][0]) <= bar


def test_table_2(runs, sources):
    rows = list(cells(table_2(runs, sources)))
    assert [label for label, _ in rows] == ["34 up", "57 up", "critical", "62 down", "28 down"]
    assert [row[0][0] for _, row in rows] == [32.9, 30.1, 24.6, 23.9, 27.2]
    assert [row[1][0] for _, row in rows] == [32.2, 28.4, 24.7, 22.6, 26.1]
    for _, (_, _, rigid, exact, medium, exact_medium) in rows:
        for (value, bar), (true,) in ((rigid, exact), (medium, exact_medium)):
            assert abs(value - true) <= bar + 1.1e-5 + ANGLES_TOLD      # printed with five decimals, both
            assert bar < 5e-3       # a twentieth of the last digit that the paper prints


def test_loads_of_the_column(runs, sources):
    rows = cells(table_column(runs, sources))
    for (label, ((paper,), (value, bar), (exact,))), printed in zip(rows, (0.93, 2.5, 1.94), strict=True):
        assert paper == printed and abs(paper - exact) < 0.02, label
        assert abs(value - exact) <= bar + 1.1e-9                       # printed with nine decimals, both


def test_figures(runs, sources, tmp_path):
    names = figures.draw(runs, sources, str(tmp_path))
    assert [Path(name).name for name in names] == [f"figure-{k}.png" for k in (5, 6, 9, 10, 11)]
    assert all(0.01 < drawn_share(name) < 0.5 for name in names)


def test_stages_of_the_column_come_in_their_order(runs):
    points = figures.stages(runs["column"])
    assert list(points) == ["a0", "a1", "a2", "a3", "a4", "a5"] and list(points.values()) == sorted(points.values())
    load = runs["column"].column("load_factor").values
    assert load[points["a2"] - 1] > load[points["a3"] - 1] > load[points["a4"] - 1] > load[points["a5"] - 1]


def test_numbers_are_there_once(sources):
    assert sources.print_of("Table 2", PIAN, "down", 28.0)["value"] == "27.2"
    assert float(sources.print_of("Fig. 9", EXACT, "a2")["load"]) > 2.48
    with pytest.raises(ResultsError, match="0 rows for Table 3"):
        sources.print_of("Table 3", PAPER, "critical load")


def test_a_deck_that_was_rewritten_is_told(tmp_path):
    deck = tmp_path / "ring.inp"
    deck.write_text("*HEADING\n** TYPE=GE4\nring, ring\n")
    for old, times in (("TYPE=GE4", 0), ("ring", 2)):
        with pytest.raises(ResultsError, match=f"'{old}' stands {times} times"):
            changed_deck(str(deck), ((old, "x"),))
    assert {deck for deck, _ in RUNS.values()} == {"ring", "ring-ul2", "ring-stiffness", "column"}

"""The guide of the manual, typed as it stands: every command works, every number of the page comes out, pictures are there.

UNILAT names the program.
"""
import math
import os
import pathlib
import re

import deck_runner as dr
import pytest
from postproc_runner import drawn_share
from unilat import guide
from unilat.results import read_results
from unilat.sweep.quantities import read_quantity

PAGE = pathlib.Path(__file__).parent.parent / "input" / "manual" / "tutorial.md"
LESSONS = guide.lessons(PAGE.read_text(encoding="utf-8"))
NUMBER = re.compile(r"[-+]?\d+(?:\.\d*)?(?:E[-+]\d+)?$")
# Numbers of the page that are formulas: lesson, text, value.
BY_HAND = (
    (1, "205.7", 10 * 300**3 / (3 * 210000 * 25 / 12)), (2, "1.5707963", math.pi / 2), (2, "190.98593", 600 / math.pi),
    (2, "6.2831853", 2 * math.pi), (3, "9.869604", math.pi**2), (3, "39.478418", 4 * math.pi**2),
    (3, "9.869702", 5e5 * (1 - math.sqrt(1 - 4e-6 * math.pi**2))), (3, "39.479977", 5e5 * (1 - math.sqrt(1 - 16e-6 * math.pi**2))),
    (6, "0.0341", 8 * 437500 * 39.5 / (0.5 * 300**4)), (6, "223", (72 * 437500 * 39.5 / 0.5) ** 0.25),
    (6, "75.5", 0.5 * (300 - 2 / 3 * (72 * 437500 * 39.5 / 0.5) ** 0.25)),
    (7, "6.03517E-4", 1e-4 / 4 + 2e-4 * math.exp(math.pi) / 8))


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """Every lesson done once: its folder and its listing."""
    kept = {}

    def do(number):
        if number not in kept:
            folder = tmp_path_factory.mktemp(f"lesson{number}")
            kept[number] = folder, guide.run(LESSONS[number - 1], os.environ["UNILAT"], str(folder))
        return kept[number]

    return do


def digit(text: str) -> float:
    """One in the last digit of a number as it is written."""
    mantissa, _, exponent = text.partition("E")
    return 10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2]))


def same(here: str, there: str) -> bool:
    """Words are the same; a number differs by three in the last digit of the page, an error bar by its half, a residual is rounding."""
    if not (NUMBER.match(here) and NUMBER.match(there)):
        return here == there
    if "." in here and len(here.partition("E")[0].lstrip("-0.")) <= 3:
        return float(there) < 1e-12 or 0.5 * float(here) < float(there) < 2.0 * float(here)
    return abs(float(here) - float(there)) <= 3.0 * digit(here)


def test_there_are_ten():
    assert [lesson.title.partition(".")[0] for lesson in LESSONS] == [str(k) for k in range(1, 11)]
    for lesson in LESSONS:
        assert lesson.files and lesson.pictures and lesson.quantities
        assert "**What to look at.**" in lesson.text and "**What to trust.**" in lesson.text


@pytest.mark.parametrize("number", range(1, 11))
def test_a_lesson_as_it_stands(done, number):
    folder, listing = done(number)
    lesson = LESSONS[number - 1]
    name = next(iter(lesson.files))
    for picture in lesson.pictures:
        assert 0.002 < drawn_share(folder / picture) < 0.9 and (PAGE.parent.parent / "pictures" / picture).exists(), picture
    results = read_results(str(folder / name.replace(".inp", ".h5")))
    assert results.complete
    for word, value in lesson.quantities:
        assert abs(read_quantity(word, name).of(results) - float(value)) <= 1.01 * digit(value), (word, value)
    said = guide.compared(lesson, str(folder))
    assert len(said) == len(lesson.quantities) and all(line.endswith(", as on the page") for line in said)


@pytest.mark.parametrize("number", [k for k, lesson in enumerate(LESSONS, start=1) if lesson.listing])
def test_lines_of_the_listing(done, number):
    _, listing = done(number)
    printed = [line.split() for line in listing.splitlines()]
    for line in LESSONS[number - 1].listing:
        shown = line.split()
        assert any(len(words) >= len(shown) and all(map(same, shown, words)) for words in printed), line


@pytest.mark.parametrize("number, text, value", BY_HAND)
def test_what_is_said_to_come_out_by_hand(number, text, value):
    assert text in LESSONS[number - 1].text and abs(float(text) - value) <= digit(text)


def test_a_value_that_is_another_one_is_told_with_that_of_the_page(done):
    folder, _ = done(1)
    other = guide.Lesson("1. A ruler", LESSONS[0].text.replace("| `last drop` | 150.44211 |", "| `last drop` | 150.50000 |"))
    assert guide.compared(other, str(folder))[1].endswith(", on the page 150.50000")


@pytest.mark.parametrize("number, label", [(lesson, label) for lesson, page in enumerate(LESSONS, start=1)
                                           for label in re.findall(r"bound of `(\S+)` is \d", page.text)])
def test_bounds_in_the_text(done, number, label):
    """To the digits that the page has; where it says "of its value", over the load."""
    size, relative = re.search(rf"bound of `{re.escape(label)}` is (\S+?)(?:\.\s|,\s|\s)(of its value)?", LESSONS[number - 1].text).groups()
    name = next(iter(LESSONS[number - 1].files))
    results = read_results(str(done(number)[0] / name.replace(".inp", ".h5")))
    point = next(point for point in results.critical if point.label == label)
    bound = point.error / abs(point.load_factor) if relative else point.error
    assert abs(bound - float(size)) <= 0.51 * digit(size), f"{bound}"


def test_figures_in_the_text(done):
    """What the page says of other runs."""
    folder, _ = done(1)
    assert "2E-8 mm" in LESSONS[0].text
    assert float((folder / "ruler.csv").read_text().splitlines()[-1].split(",")[-1]) < 1e-7
    (modes,) = read_results(str(done(3)[0] / "strut.h5")).buckling.values()
    assert "9.869604402" in LESSONS[2].text and modes.load_factor[0] == pytest.approx(math.pi**2, rel=1e-9)
    cavity = read_results(str(done(9)[0] / "cavity.h5"))
    snap = next(point for point in cavity.critical if point.label == "LP")
    assert "the exact value lies within it" in LESSONS[8].text and abs(snap.load_factor - 81.557427564661) <= snap.error
    bifurcations = [point for point in read_results(str(done(3)[0] / "strut.h5")).critical if point.label == "BP"]
    assert "have error bounds of 1E-8 of their value or less" in LESSONS[2].text
    assert all(point.error <= 1.6e-8 * point.load_factor for point in bifurcations)
    ground = LESSONS[6].files["ground.inp"]
    for n, text in ((12, "1.0000009"), (48, "1.000000004")):
        found = dr.run_deck(dr.changed(ground, ("1, 2, 24", f"1, 2, {n}"))).load("C-")
        assert text in LESSONS[6].text and abs(found - float(text)) <= 2.0 * digit(text)
    lining = LESSONS[9].files["lining.inp"]
    lies = dr.changed(lining[:lining.index("*LIMIT CURVE")] + "*END STEP\n", ("GAP=${gap}", "GAP=0"), ("0, 0, 1\n", "0, ${gap}, ${1 + gap}\n"),
                      ("2, ENCASTRE", "2, XSYMM"))
    assert "51.133" in LESSONS[9].text and dr.run_deck(lies).load("LP") == pytest.approx(51.1332659287, rel=1e-6)
    arch = LESSONS[4].text
    curve = read_results(str(done(5)[0] / "bent-arch.h5")).limit_curves["LARGER"]
    perfect = 14.35952061
    assert "takes 4 % away, ten times as much 20 %" in arch
    assert [round(100 * (1 - load / perfect)) for load in curve.column("load_factor").values[[0, -1]]] == [4, 20]

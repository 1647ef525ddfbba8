"""OpenSees as the other program of a study: what it is given is the scene of the deck, and what it tells is taken from its points as it should be.

openseespy need not be there; where it is, a run of it is compared, too. UNILAT names the program.
"""

from __future__ import annotations

import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

TESTS = Path(__file__).resolve().parent
ROOT = TESTS.parent
sys.path[:0] = [str(TESTS), str(ROOT / "postproc")]

from unilat.opensees.command import first_touch, limit_points, setting  # noqa: E402
from unilat.opensees.scene import SceneReader, formula  # noqa: E402
from unilat.results import ResultsError, read_results  # noqa: E402
from unilat.study import peer  # noqa: E402
from unilat.study.study_file import read_study  # noqa: E402

STUDIES = ROOT / "input" / "studies"


def scene_of(name: str, **values):
    text = (STUDIES / f"{name}.inp").read_text()
    return SceneReader(text, {"kind": "GE2", "points": "NODES", "loop": "NEWTON", "asked": 0.01, "slenderness": 100, **values}).scene


def test_the_ring_is_the_ring_of_the_deck():
    ring = scene_of("ring", elements=40)
    assert len(ring.nodes) == 41 and len(ring.beams) == 40 and ring.stiffness == (120000.0, 1.0)
    assert sum(length for _, _, length in ring.beams) == pytest.approx(math.pi, rel=1e-14)
    assert np.hypot(*np.array(ring.nodes).T) == pytest.approx(np.ones(41), rel=1e-14)
    assert sum(ring.load.values()) == pytest.approx((0.0, -math.pi, 0.0), rel=1e-14)
    assert min(x for x, _ in ring.nodes) < -0.99            # the half that the deck has
    assert ring.fixed == {0: (1, 0, 1), 1: (1, 0, 1)}
    (obstacle, lengths), = ring.obstacles
    assert obstacle.numbers[2] == 1.0 and math.isinf(obstacle.modulus) and sum(lengths.values()) == pytest.approx(math.pi, rel=1e-14)


def test_the_parameters_of_the_deck_count_and_given_ones_replace_them():
    text = """*PARAMETER
H = 2.0
L = ${3*H}
*NODE
1, 0., 0.
2, ${L}, ${H}
*LINE, ELSET=A
1, 2, 3
"""
    assert SceneReader(text.replace("${3*H}", "3*H"), {}).scene.nodes[1] == (6.0, 2.0)
    assert SceneReader(text.replace("${3*H}", "3*H"), {"H": 1.0}).scene.nodes[1] == (3.0, 1.0)
    with pytest.raises(ResultsError, match="leaves the number of elements to unilat; OpenSees needs one"):
        SceneReader(text.replace("${3*H}", "3*H").replace("1, 2, 3", "1, 2"), {})


def test_the_column_is_imperfect_and_beside_its_wall():
    column = scene_of("column", elements=8)
    places = np.array(column.nodes)
    at = places[np.argsort(places[:, 0])]
    s = at[:, 0]
    w = np.sin(math.pi * s)**2 * (0.0014 + 0.00105 * 1.5 * math.sqrt(3.0) * np.cos(math.pi * s))
    assert s == pytest.approx(np.linspace(0.0, 1.0, 17), abs=1e-15) and at[:, 1] == pytest.approx(w, abs=1e-17)
    monitor = column.monitors["midspan"]
    assert (monitor.component, monitor.factor, monitor.offset) == (2, 200.0, 0.28) and column.nodes[monitor.node][0] == 0.5


@pytest.mark.parametrize("path", sorted(STUDIES.glob("*.toml")), ids=lambda path: path.stem)
def test_decks_of_its_curves_are_carried_over(path):
    if "opensees" not in path.read_text():
        pytest.skip("a study without OpenSees")
    runs = [run for run in read_study(str(path), os.environ["UNILAT"]).runs if run[3] is not None]
    assert len(runs) >= 3
    for _, values, deck, settings in runs:
        scene = SceneReader(deck.text, dict(setting(word) for word in deck.settings)).scene
        assert len(scene.beams) >= values["elements"] and scene.load and scene.stops
        assert settings.get("control") in (None, *scene.monitors)


@pytest.mark.parametrize("old, new, message", [
    ("*MONITOR, NAME=w", "*SPRING", "*SPRING is not carried over"), ("*LINE", "*RING", "*RING is not carried over"),
    ("2, 2, 1.", "2, 2", "*CLOAD is not carried over"), ("${elements}", "${sqrt(4)}", "${sqrt(4)} is not carried over"),
    ("1, ENCASTRE", "1, 1, 2", "*BOUNDARY is not carried over")])
def test_what_cannot_be_carried_over_is_refused(tmp_path, old, new, message):
    deck = (STUDIES / "cantilever.inp").read_text()
    assert old in deck
    (tmp_path / "c.inp").write_text(deck.replace(old, new))
    done = subprocess.run([sys.executable, "-m", "unilat.opensees", "--set", "kind=GE2", "--set", "elements=4", "c.inp"], cwd=tmp_path, capture_output=True,
                          text=True, check=False)
    assert done.returncode == 1 and message in done.stderr and "Traceback" not in done.stderr, done.stderr


def test_formulas():
    assert formula("12.0*slenderness**2 - (a+1)/2", {"slenderness": 10, "a": 3}) == 1198.0
    with pytest.raises(ResultsError, match="not carried over"):
        formula("__import__('os')", {})
    with pytest.raises(ResultsError, match="no value for the parameter b"):
        formula("2*b", {"a": 1})


def test_limit_points_are_those_of_the_path():
    """Points at unequal distances, whatever these are: a cubic is met exactly."""
    v = np.array([0.0, 0.2, 0.45, 0.5, 0.9, 1.3, 1.4, 2.0])
    load = v * (v - 1.1) * (v - 3.0)
    exact = (8.2 - math.sqrt(8.2**2 - 12.0 * 3.3)) / 6.0
    (_, top), = limit_points({"load_factor": load, "v": v})
    assert top["v"] == pytest.approx(exact, rel=1e-12)
    assert top["load_factor"] == pytest.approx(exact * (exact - 1.1) * (exact - 3.0), rel=1e-12)
    assert limit_points({"load_factor": v, "v": v}) == []


def test_the_first_touch_is_where_the_gap_closes():
    v = np.array([0.0, 0.3, 0.5, 0.8, 1.1])
    (_, touch), = first_touch({"load_factor": v + v**2, "v": v}, 1.0 - v**2)
    assert touch["v"] == pytest.approx(1.0, rel=1e-12) and touch["load_factor"] == pytest.approx(2.0, rel=1e-12)
    assert first_touch({"load_factor": v, "v": v}, 2.0 - v) == []


STUDY = """title = "two programs"
deck = "cantilever.inp"
repeats = 1
[[check]]
quantity = "EP.w"
exact = 0.8106090248803
[[curve]]
name = "unilat"
kind = "GE8"
elements = 4
[[curve]]
name = "OpenSees"
program = "opensees"
kind = "GE2"
elements = [16, 32]
"""


def test_a_study_of_both(tmp_path):
    (tmp_path / "cantilever.inp").write_text((STUDIES / "cantilever.inp").read_text())
    (tmp_path / "s.toml").write_text(STUDY)
    done = subprocess.run([sys.executable, "-m", "unilat.study", "time", "s.toml", "--folder", "f", "--program", os.environ["UNILAT"]],
                          cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    rows = [line.split(",") for line in (tmp_path / "f" / "s.csv").read_text().splitlines() if line.startswith("OpenSees")]
    if not peer.is_there():
        assert "left out: OpenSees: openseespy is not installed" in done.stdout and not rows
        return
    found = [read_results(name) for name in (tmp_path / "f" / "runs").glob("*.h5")]
    assert sorted(each.program for each in found) == ["opensees", "opensees", "unilat"]
    errors = [float(row[7]) for row in rows]
    assert errors[0] < 1e-3 and errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)      # corotational beams: h^2


def test_an_unknown_program_is_refused(tmp_path):
    (tmp_path / "cantilever.inp").write_text((STUDIES / "cantilever.inp").read_text())
    (tmp_path / "s.toml").write_text(STUDY.replace('"opensees"', '"ansys"'))
    with pytest.raises(ResultsError, match="neither unilat nor opensees"):
        read_study(str(tmp_path / "s.toml"), os.environ["UNILAT"])

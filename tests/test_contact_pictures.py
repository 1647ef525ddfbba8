"""Contact forces, loads, supports and steps in the pictures of real runs.

UNILAT names the program.
"""

from __future__ import annotations

import json
import os
import pathlib
import re

import deck_runner as dr
import numpy as np
import pytest
from matplotlib.colors import to_rgba
from matplotlib.patches import FancyArrowPatch, Polygon
from postproc_runner import axes_of, draw, png_size  # noqa: F401
from unilat import Deck
from unilat.plot import model_drawing, path_curves, style
from unilat.results.contact_forces import contact_forces, normal_at
from unilat.results.force_glyphs import Scales, glyphs
from unilat.results.model_parts import loads_at
from unilat.results.motion import Motion
from unilat.results.types import Obstacle

# A portal frame beside a rigid wall: weight, then a push that brings the far corner to the wall.
FRAME = """\
*HEADING
portal frame
*NODE
1, 0., 0.
2, 0., 4.
3, 6., 4.
4, 6., 0.
*LINE, ELSET=FRAME, NSET=FRAME
1, 2, 6
2, 3, 6
3, 4, 6
*BEAM SECTION, ELSET=FRAME, SECTION=STIFFNESS
1.1E6, 1.2E4
*BOUNDARY
1, ENCASTRE
4, PINNED
*OBSTACLE, NAME=WALL, TYPE=LINE
6.02, 0., 6.02, 5.
*CONTACT, NSET=FRAME, OBSTACLE=WALL
*MONITOR, NAME=sway
3, U1
*STEP, NAME=WEIGHT
*STATIC, METHOD=LOAD
0.5, 1E-6, 1.
*CLOAD
2, 2, -50.
*STOP
LOAD, ABOVE, 1.
*FIELD OUTPUT, EVERY=1
DISPLACEMENT, SECTION FORCES, REACTION, GAP
*END STEP
*STEP, NAME=PUSH
*STATIC, METHOD=LOAD
0.1, 1E-6, 1.
*CLOAD
2, 1, 100.
*STOP
LOAD, ABOVE, 1.
*FIELD OUTPUT, EVERY=1
DISPLACEMENT, SECTION FORCES, REACTION, GAP
*END STEP
"""


@pytest.fixture(scope="module")
def frame():
    return dr.run_deck(FRAME)


@pytest.fixture(scope="module")
def ring():
    return dr.run_deck(dr.on_given_mesh("ring"))


def arrows(axes) -> list[FancyArrowPatch]:
    return [patch for patch in axes.patches if isinstance(patch, FancyArrowPatch)]


def texts(axes) -> list[str]:
    return [text.get_text() for text in axes.texts]


# What the file has


def total(path, point: int) -> np.ndarray:
    """Sum of all contact forces; along lines by Boole's rule, for which the file has five places of each smooth part."""
    weights = np.array((7.0, 32.0, 12.0, 32.0, 7.0)) / 90.0
    found = path.force_list("contact_force", point)[:, 4:].sum(axis=0)
    for part in path.force_list("contact_pressure", point).reshape(-1, 5, 6):
        found = found + (part[-1, 1] - part[0, 1]) * weights @ part[:, 4:]
    return found


@pytest.mark.parametrize("name", ["ring", "column-walls", "cradle", "pipe-humps", "pipe-lift", "liner"])
def test_single_forces_and_pressures_make_the_force_of_the_obstacle(name):
    """Boole's rule over an element of length h errs by h^7 times the sixth derivative: far below 1e-4 of the force for elements
    that the program itself takes for fine enough."""
    run = dr.run_deck(dr.on_given_mesh(name))
    results = run.results
    assert results.has_force_lists
    seen = 0
    for point in results.points_with("reaction"):
        expected = results.contact.obstacle_force[point - 1].sum(axis=0)
        size = np.max(np.abs(results.contact.reaction_total))
        assert np.max(np.abs(total(results, int(point)) - expected)) <= 1e-4 * size, point
        seen += len(results.force_list("contact_force", int(point)))
    assert seen > 0


def test_the_one_force_of_a_corner_is_one_force(frame):
    results = frame.results
    forces, pressures = contact_forces(results, results.n_points)
    (force,) = forces
    assert pressures == [] and abs(force.force[1]) <= 1e-9 * force.size
    assert force.force[0] == pytest.approx(-results.contact.reaction_total[-1, 0], rel=1e-9)
    assert force.place == pytest.approx((6.02, 4.0), abs=2e-3) and force.arc == pytest.approx(10.0, abs=1e-9)


def test_forces_of_nodes_act_normal_to_the_obstacle(ring):
    """The ring in contact at its nodes: what they press with is radial, and sums up to the force of the cavity."""
    text = dr.changed(dr.on_given_mesh("ring-ul2"))
    run = dr.run_deck(text)
    results = run.results
    point = int(results.points_with("reaction")[-1])
    forces, pressures = contact_forces(results, point)
    for each in (*forces, *pressures):
        places, vectors = np.atleast_2d(each.place), np.atleast_2d(each.force)
        cross = places[:, 0] * vectors[:, 1] - places[:, 1] * vectors[:, 0]
        assert np.all(np.abs(cross) <= 1e-9 * np.max(np.hypot(*vectors.T)) * np.hypot(*places.T))
        assert np.all(np.einsum("ij,ij->i", places, vectors) <= 0.0)       # inwards


@pytest.mark.parametrize("obstacle, place, expected", [
    (Obstacle("a", "line", "left", np.array([(0.0, 0.0), (2.0, 0.0)]), None, None, 0.0, "rigid", 0.0), (1.0, 0.1), (0.0, 1.0)),
    (Obstacle("a", "circle", "outside", None, np.zeros(2), 1.0, 0.0, "rigid", 0.0), (0.0, -2.0), (0.0, -1.0)),
    (Obstacle("a", "circle", "inside", None, np.zeros(2), 1.0, 0.0, "rigid", 0.0), (0.5, 0.0), (-1.0, 0.0)),
    (Obstacle("a", "polyline", "left", None, None, 0.0, 0.0, "rigid", 0.0, surface=np.array([(0, 0), (1, 0), (1, 1.0)])), (0.9, 0.7), (-1.0, 0.0)),
    (Obstacle("a", "gap", "left", np.zeros((1, 2)), None, None, 0.0, "rigid", 0.0, normal=np.array((0.0, -2.0))), (0.0, 0.0), (0.0, -1.0))])
def test_normals_point_into_the_free_side(obstacle, place, expected):
    np.testing.assert_allclose(normal_at(obstacle, np.array(place)), expected, atol=1e-12)


def test_loads_at_a_point_are_those_of_all_steps(frame):
    results = frame.results
    assert [loads.name for loads in results.loads.values()] == ["WEIGHT", "PUSH"]
    last = loads_at(results, results.n_points)
    assert last.node.tolist() == [1] and last.force.tolist() == [[100.0, -50.0, 0.0]]
    first = int(np.flatnonzero(results["step"] == 2)[0]) + 1
    np.testing.assert_allclose(loads_at(results, first).force, [[100.0 * results["load_factor"][first - 1], -50.0, 0.0]])
    assert results.supports.node.tolist() == [0, 3] and results.supports.fixed.tolist() == [[True] * 3, [True, True, False]]
    assert results.sets["FRAME"].size == 19


# Pictures


def test_the_default_reaction_of_a_rigid_contact_is_an_arrow_with_its_value(frame, axes_of):  # noqa: F811
    results = frame.results
    axes = axes_of("reaction", results.filename, "--rows", "-1")
    panel = axes[1]
    (arrow,) = arrows(panel)
    value = results.contact.reaction_total[-1, 0]
    tail, tip = arrow._posA_posB
    assert tail == pytest.approx((10.0, value)) and tip == pytest.approx((10.0, 0.0), abs=1e-9)
    assert texts(panel) == [f"{value:.4g}"] and panel.get_ylabel() == "contact force (force)"
    assert panel.get_ylim()[1] > value


def test_pressure_is_a_band_and_the_end_of_a_line_an_arrow_on_its_own_axis(ring, axes_of):  # noqa: F811
    results = ring.results
    axes = axes_of("reaction", results.filename, "--label", "LP", "--no-gap")
    pressed, (twin,) = axes[1], [each for each in axes if each.get_ylabel() == "contact force (force)"]
    point = next(critical.point for critical in results.critical if critical.label == "LP")
    forces, pressures = contact_forces(results, point)
    (line,) = [line for line in pressed.get_lines() if line.get_transform() == pressed.transData]
    np.testing.assert_allclose(line.get_ydata(), pressures[0].size)
    assert len(pressed.collections) == 1 and len(arrows(twin)) == len(forces) == 1
    assert texts(twin) == [f"{forces[0].size:.4g}"]


def test_where_nothing_presses_the_picture_says_so(axes_of):  # noqa: F811
    run = dr.run_deck(dr.on_given_mesh("column"))
    axes = axes_of("reaction", run.results.filename, "--rows", "1")
    assert texts(axes[1]) == ["no contact force"]


def test_shapes_have_forces_loads_and_supports(frame, axes_of):  # noqa: F811
    results = frame.results
    (axes,) = axes_of("shape", results.filename, "--rows", "-1")
    value = results.contact.reaction_total[-1, 0]
    assert len(arrows(axes)) == 2 and {f"{value:.4g}", f"{np.hypot(100.0, 50.0):.4g}"} == set(texts(axes))
    (pushed,) = [arrow for arrow in arrows(axes) if arrow.get_edgecolor() == to_rgba(style.CONTACT)]
    tail, tip = pushed._posA_posB
    assert tip == pytest.approx((6.02, 4.0), abs=2e-3) and tail[0] > tip[0] and tail[1] == pytest.approx(tip[1])
    assert len([line for line in axes.get_lines() if line.get_gid() == "support"]) == 2
    limits = np.array((axes.get_xlim(), axes.get_ylim()))
    for arrow in arrows(axes):
        assert np.all(limits[:, 0] <= arrow._posA_posB[0]) and np.all(arrow._posA_posB[0] <= limits[:, 1])
    (bare,) = axes_of("shape", results.filename, "--rows", "-1", "--forces", "none", "--no-loads", "--no-supports")
    assert arrows(bare) == [] and not [line for line in bare.get_lines() if line.get_gid() == "support"]


def test_pressure_in_a_shape_is_a_band_on_the_far_side(ring, axes_of):  # noqa: F811
    (axes,) = axes_of("shape", ring.results.filename, "--label", "LP")
    (band,) = [patch for patch in axes.patches if isinstance(patch, Polygon)]
    radius = np.hypot(*band.get_xy().T)
    assert np.all(radius > 1.0 - 1e-6) and radius.max() > 1.05


def test_arrows_of_a_picture_are_as_long_as_their_forces(ring):
    results = ring.results
    everything = [contact_forces(results, int(point)) for point in results.points_with("reaction")]
    scales = Scales.of(everything)
    drawn = [(arrow, force.size) for forces, pressures in everything if forces
             for arrow, force in zip(glyphs(forces, pressures, scales, 2.0).arrows, forces)]
    long = [(np.hypot(*(arrow.tip - arrow.tail)), size) for arrow, size in drawn if size > 0.5 * scales.force]
    assert len(long) > 2 and np.ptp([length / size for length, size in long]) <= 1e-12


def test_small_displacements_are_magnified_where_nothing_is_in_the_way(frame, axes_of, tmp_path):  # noqa: F811
    free = FRAME.replace(FRAME[FRAME.index("*OBSTACLE"):FRAME.index("*MONITOR")], "")
    run = dr.run_deck(free.replace(", REACTION, GAP", "").replace("100.", "10."))
    small = run.results
    (axes,) = axes_of("shape", small.filename, "--rows", "-1")
    match = re.search(r"displacements times (\d+)", axes.get_xlabel())
    assert match and 0.02 < int(match[1]) * np.max(np.abs(small["sway"])) / 6.0 <= 0.1
    (axes,) = axes_of("shape", frame.results.filename, "--rows", "-1")
    assert "displacements times" not in axes.get_xlabel()


def test_the_model_of_a_deck_is_drawn_before_it_is_run(tmp_path, axes_of):  # noqa: F811
    deck = tmp_path / "frame.inp"
    deck.write_text(FRAME)
    (axes,) = axes_of("model", deck, "--nset", "frame")
    (arrow,) = arrows(axes)
    assert arrow._posA_posB[1] == pytest.approx((0.0, 4.0)) and arrow._posA_posB[0][1] > 4.0 and "50" in texts(axes)
    assert len([line for line in axes.get_lines() if line.get_gid() == "support"]) == 2
    assert {"1", "2", "3", "4"} & set(texts(axes)) >= {"1", "4"}
    legend = axes.get_legend()
    assert legend.get_title().get_text() == "step 1: WEIGHT"
    assert {"rods", "WALL", "loads", "set FRAME"} <= {text.get_text() for text in legend.get_texts()}
    (second,) = axes_of("model", deck, "--step", "2")
    assert "100" in texts(second)


def test_what_is_wrong_with_a_deck_is_told_instead_of_a_picture(tmp_path, capsys):
    deck = tmp_path / "frame.inp"
    deck.write_text(FRAME.replace("4, PINNED", "99, PINNED"))
    assert draw("model", deck) == 2
    assert re.search(r"frame\.inp:16:1: .*\n +16 \| 99, PINNED\n +\| \^\^", capsys.readouterr().err)
    assert draw("model", tmp_path / "none.inp") == 2 and "none.inp: cannot be read" in capsys.readouterr().err
    deck.write_text(FRAME)
    assert draw("model", deck, "--step", "3") == 2 and "no step 3 (it has 2)" in capsys.readouterr().err
    assert draw("model", deck, "--nset", "WALL") == 2 and "no node set 'WALL' (known: FRAME)" in capsys.readouterr().err


@pytest.mark.parametrize("fixed, symbols", [((1, 1, 1), "clamp"), ((1, 1, 0), "pin"), ((0, 1, 0), "roller"), ((1, 0, 1), "guide"),
                                            ((0, 0, 1), "no turn")])
def test_supports_have_their_symbols(fixed, symbols):
    ((name, angle),) = model_drawing.support_symbols(np.array(fixed, dtype=bool), np.array((0.0, 1.0)))
    assert name == symbols and (angle == 0.0 or name == "guide")


def test_steps_are_told_apart_and_begin_where_the_last_one_ended(frame, axes_of):  # noqa: F811
    results = frame.results
    (axes,) = axes_of("path", results.filename, "--mark", "none")
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["step 1: WEIGHT", "step 2: PUSH"]
    first, second = axes.get_lines()
    assert first.get_color() != second.get_color()
    end = int(np.flatnonzero(results["step"] == 1)[-1])
    assert (second.get_xdata()[0], second.get_ydata()[0]) == (results["sway"][end], 0.0)
    assert first.get_ydata()[-1] == 1.0
    (axes,) = axes_of("path", results.filename, "--x", "point", "--y", "sway")       # no load factor: one curve
    assert axes.get_legend() is None


def test_a_step_that_begins_without_the_last_one_is_drawn_as_it_is():
    run = dr.run_deck(dr.on_given_mesh("arch-imperfect"))
    results = run.results
    anew = [step for step, loads in results.loads.items() if loads.stress_free_start]
    assert anew
    row = int(np.flatnonzero(results["step"] == anew[-1])[0])
    assert path_curves.step_start(results, results.column("v"), results.column("load_factor"), row) is None


def test_a_deck_says_what_its_lengths_and_forces_are(tmp_path, axes_of):  # noqa: F811
    run = dr.run_deck("*UNITS\nm, kN\n" + FRAME)
    results = run.results
    assert results.column("sway").units == "m" and results.unit("moment") == "kN m" and results.unit("radian") == "radian"
    assert axes_of("path", results.filename)[0].get_xlabel() == "sway (m)"
    assert axes_of("shape", results.filename, "--rows", "-1")[0].get_xlabel() == "x (m)"
    axes = axes_of("reaction", results.filename, "--rows", "-1")
    assert axes[1].get_ylabel() == "contact force (kN)" and axes[2].get_ylabel() == "gap (m)"
    assert axes_of("forces", results.filename, "--rows", "-1", "--quantities", "M")[0].get_ylabel() == "M (kN m)"


def test_a_gap_inside_contact_opens_where_both_ends_meet(axes_of, tmp_path):  # noqa: F811
    text = re.search(r"```inp ground.inp\n(.*?)```", "\n".join(page.read_text() for page in sorted((pathlib.Path(
        os.environ["UNILAT_SOURCE"]) / "input").glob("**/*.md"))), re.DOTALL)
    run = dr.run_deck(text[1])
    (axes,) = axes_of("contact", run.results.filename, "--step", "2", "--mark", "none")
    assert [entry.get_text() for entry in axes.get_legend().get_texts()] == ["ends of contact", "ends of a gap"]
    colour = axes.get_legend().get_lines()[1].get_color()
    upper, lower = [line.get_xydata() for line in axes.get_lines() if line.get_color() == colour]
    assert upper[0] == pytest.approx(lower[0]) and abs(upper[-1, 1] - lower[-1, 1]) > 1.0


def test_labels_of_many_paths_are_left_to_their_marks(ring, axes_of):  # noqa: F811
    name = ring.results.filename
    (axes,) = axes_of("path", *[name] * 6, "--mark", "LP")
    assert texts(axes) == [] and "LP" in [text.get_text() for text in axes.get_legend().get_texts()]
    (axes,) = axes_of("path", name, name, "--mark", "LP")
    assert any(text.startswith("LP") for text in texts(axes))


# Between stored points


@dr.release_only
def test_between_stored_points_the_structure_is_nearly_where_it_is():
    """Every third point of a path against all of them: cubics are nearer than straight lines by far."""
    deck = Deck.from_text(dr.on_given_mesh("ring"))
    deck.find("field output")[0]["every"] = 1
    whole = deck.run(progress=False)
    stored = whole.points_with("displacement")
    keep = sorted({*stored[::2].tolist(), int(stored[-1])})
    motion = Motion(whole, with_forces=False)
    coarse = Motion(whole, with_forces=False)
    coarse.points = np.array(keep)
    coarse.moved = np.array([whole.field("displacement", point) for point in keep])
    coarse.at = coarse.arc[coarse.points - 1]
    coarse.rates = coarse._rates()
    coarse.forces = [([], [])] * len(keep)
    error, straight = [], []
    for k, (first, second) in enumerate(zip(keep, keep[1:])):
        for point in range(first + 1, second):
            t = (motion.arc[point - 1] - coarse.at[k]) / (coarse.at[k + 1] - coarse.at[k])
            there = whole.mesh.coordinates + whole.field("displacement", point)[:, :2]
            line = whole.mesh.coordinates + ((1 - t) * coarse.moved[k] + t * coarse.moved[k + 1])[:, :2]
            error.append(np.max(np.abs(coarse.between(k, t).shape.nodes - there)))
            straight.append(np.max(np.abs(line - there)))
    assert len(error) > 5 and np.sum(error) < 0.4 * np.sum(straight)


def test_frames_pass_through_the_stored_points(frame):
    motion = Motion(frame.results)
    frames = motion.frames(30)
    stored = [each for each in frames if each.row == each.nearest - 1]
    assert [each.nearest for each in stored] == frame.results.points_with("displacement").tolist() and 25 <= len(frames) <= 45
    assert np.all(np.diff([each.row for each in frames]) > 0.0)
    forces = [each.forces[0].size for each in frames if each.forces]
    assert np.all(np.diff(forces) > 0.0) and forces[-1] == pytest.approx(frame.results.contact.reaction_total[-1, 0])


def page(name: pathlib.Path) -> dict:
    return json.loads(re.search(r"const data = (\{.*\});\n", name.read_text(encoding="utf-8"))[1].replace("\\u003c", "<"))


def test_the_page_has_forces_sections_and_shapes_between(frame, tmp_path):
    output = tmp_path / "frame.html"
    assert draw("html", frame.results.filename, "-o", output) == 0
    data = page(output)
    assert len(data["between"]) == len(data["frames"]) - 1 and sum(map(len, data["between"])) > 40
    last = data["frames"][-1]
    assert [value for _, value in last["arrows"]] == [f"{frame.results.contact.reaction_total[-1, 0]:.4g}"]
    sections = np.array(last["sections"])       # at the corners of the polylines that draw the elements
    assert sections.shape[1] == data["samples"] + 1
    np.testing.assert_allclose(sections[:, [0, -1]], frame.results.field("section_forces", frame.results.n_points), rtol=1e-4, atol=1e-3)
    assert data["columns"]["sway"]["rate"] and data["steps"][0] == 1 and data["anew"] == []


def test_the_page_has_the_branches(tmp_path):
    run = dr.run_deck(dr.changed(dr.on_given_mesh("arch-shallow-hinged")))
    output = tmp_path / "arch.html"
    assert draw("html", run.results.filename, "-o", output) == 0
    names = [branch["name"] for branch in page(output)["branches"]]
    assert len(names) == len([branch for branch in run.results.branches.values() if "displacement" in branch.field_names]) > 0
    assert names[0].startswith("branch 1: ")


def test_the_picture_is_a_picture(frame, tmp_path):
    for name in ("shape", "reaction", "model"):
        assert draw(name, frame.results.filename, "-o", tmp_path / f"{name}.png") == 0
        assert png_size(tmp_path / f"{name}.png")[0] > 800
    assert os.path.getsize(tmp_path / "model.png") > 10000

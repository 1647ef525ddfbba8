"""postproc: section forces along the rods, over the arc length and on the structure; notes on scales that differ."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

sys.path[:0] = [str(Path(__file__).resolve().parent)]

import make_result_file as make  # noqa: E402
from postproc_runner import axes_of, draw, drawn_share  # noqa: E402,F401
from unilat.plot import forces as forces_plot  # noqa: E402
from unilat.results import Mesh, read_results  # noqa: E402
from unilat.results.rod_chains import along_chain, rod_chains  # noqa: E402
from unilat.results.section_curves import between_ends, shape_at  # noqa: E402

S = np.linspace(0.0, np.pi, 25)


@pytest.fixture(scope="module")
def ring(tmp_path_factory):
    """N = -2, Q = cos s, M = sin s along a half ring whose third element runs backwards; without displacements, so straight between."""
    name = tmp_path_factory.mktemp("results") / "ring.h5"
    make.write_ring(name, fields=("section_forces",))
    ends = np.column_stack((S[:-1], S[1:]))
    forces = np.stack((np.full(ends.shape, -2.0), np.cos(ends), np.sin(ends)), axis=-1)
    forces[2] = forces[2, ::-1] * (1.0, 1.0, -1.0)
    with h5py.File(name, "a") as file:
        file["fields/section_forces"][...] = forces
        file["mesh/elements"][2] = file["mesh/elements"][2][::-1]
    return name


def mesh(coordinates, elements):
    coordinates, elements = np.array(coordinates, dtype=float), np.array(elements)
    return Mesh(coordinates, elements, np.arange(len(coordinates)), np.arange(len(elements)))


def test_a_chain_runs_from_end_to_end_whatever_the_order_of_its_elements():
    (chain,) = rod_chains(mesh([(0, 0), (1, 0), (3, 0), (6, 0)], [(2, 1), (3, 2), (0, 1)]))
    assert chain.elements.tolist() in ([1, 0, 2], [2, 0, 1])
    lengths = np.diff(chain.arc, axis=1).ravel()
    assert lengths.tolist() in ([3.0, 2.0, 1.0], [1.0, 2.0, 3.0]) and chain.arc[-1, 1] == 6.0


def test_chains_end_where_three_elements_meet_and_a_ring_is_one():
    chains = rod_chains(mesh([(0, 0), (1, 0), (2, 0), (1, 1), (1, 2)], [(0, 1), (1, 2), (1, 3), (3, 4)]))
    assert sorted(sorted(chain.elements.tolist()) for chain in chains) == [[0], [1], [2, 3]]
    (ring,) = rod_chains(mesh([(0, 0), (1, 0), (0, 1)], [(0, 1), (1, 2), (2, 0)]))
    assert ring.elements.tolist() == [0, 1, 2] and not ring.turned.any()


def test_a_turned_element_keeps_n_and_q_and_changes_the_sign_of_m():
    (chain,) = rod_chains(mesh([(0, 0), (1, 0), (2, 0)], [(0, 1), (2, 1)]))
    forces = np.array([[(1, 2, 3), (4, 5, 6)], [(7, 8, -9), (4, 5, -6)]], dtype=float)
    np.testing.assert_array_equal(along_chain(chain, forces).reshape(-1, 3), [(1, 2, 3), (4, 5, 6), (4, 5, 6), (7, 8, 9)])


def test_forces_over_the_arc_length(ring, axes_of):
    *panels, _ = axes_of("forces", ring, "--label", "LP", "--y-scale", 2)
    chord = 2.0 * np.sin(0.5 * np.pi / 24.0)      # arc lengths are along the chords
    for axes, name, exact in zip(panels, "NQM", (lambda s: -4.0 + 0.0 * s, lambda s: 2.0 * np.cos(s), lambda s: 2.0 * np.sin(s))):
        x, y = next(np.array(line.get_data()) for line in axes.get_lines() if len(line.get_xdata()) == 24 * 9)
        x, y = (np.column_stack((each[::9], each[8::9])) for each in (x, y))
        np.testing.assert_allclose(y, exact(x / chord * np.pi / 24.0), atol=1e-12)
        assert axes.get_ylabel() == f"2 × {name} ({'moment' if name == 'M' else 'force'})"


def test_rounding_is_drawn_as_nothing(ring, tmp_path, axes_of):
    """N of 1e-13 beside Q and M of 1: a line at zero, in an axis of their size."""
    name = tmp_path / "noise.h5"
    name.write_bytes(ring.read_bytes())
    with h5py.File(name, "a") as file:
        file["fields/section_forces"][..., 0] = 1e-13 * np.cos(np.arange(48.0).reshape(24, 2))
    axes_n, axes_q, *_ = axes_of("forces", name, "--label", "LP")
    assert axes_n.get_ylim()[1] == pytest.approx(1.0, rel=1e-3) and axes_q.get_ylim()[1] > 1.0


@pytest.mark.parametrize("on", ["arc", "structure"])
def test_rounding_alone_is_drawn_as_nothing(ring, tmp_path, axes_of, on):
    """Where nothing is stressed there is no other force to compare with, but EI is."""
    name = tmp_path / "noise.h5"
    name.write_bytes(ring.read_bytes())
    with h5py.File(name, "a") as file:
        file["fields/section_forces"][...] *= 1e-14
        file["mesh/bending_stiffness"] = np.full(len(file["mesh/elements"]), 1.0)
    axes_n, axes_q, axes_m, *_ = axes_of("forces", name, "--label", "LP", "--on", on)
    if on == "arc":
        assert min(axes.get_ylim()[1] for axes in (axes_n, axes_q, axes_m)) > 0.05
    else:
        assert not any(text.get_text() for axes in (axes_n, axes_q, axes_m) for text in axes.texts)


def test_forces_on_the_structure(ring, axes_of):
    """Q is positive to the left, which is inside the ring at its start; M is drawn on the side in tension."""
    axes_q, axes_m = axes_of("forces", ring, "--on", "structure", "--rows", "1", "--quantities", "Q,M")
    tips = np.array([line.get_xydata()[0] for line in axes_q.get_lines() if len(line.get_xdata()) == 9])
    assert np.hypot(*tips[0]) < 0.8                     # cos 0 = 1
    bent = [line.get_xydata()[4] for line in axes_m.get_lines() if len(line.get_xdata()) == 9]
    assert np.hypot(*bent[12]) > 1.2                    # M > 0 bends to the left: tension on the right, outside


def test_pictures_and_errors(ring, tmp_path, capsys):
    for arguments in ([], ["--on", "structure"], ["--quantities", "m", "--rows", "1,-1"]):
        assert draw("forces", ring, *arguments, "-o", tmp_path / "a.png") == 0
        assert 0.005 < drawn_share(tmp_path / "a.png") < 0.5
    capsys.readouterr()
    make.write_ring(tmp_path / "no.h5", fields=("displacement",))
    for arguments, message in (([tmp_path / "no.h5"], "no section forces are stored"),
                               ([ring, "--quantities", "N,T"], "list of some of N,Q,M"),
                               ([ring, "--on", "structure", "--evenly", "2"], "one point is drawn, not 2")):
        assert draw("forces", *arguments) == 2
        assert message in capsys.readouterr().err


def test_stairs_of_reactions_at_nodes_are_a_curve_but_jumps_of_loads_stay():
    arc = np.column_stack((np.arange(40.0), np.arange(1.0, 41.0)))
    middle = arc.mean(axis=1)
    level = np.where(middle < 20.0, middle, middle + 100.0)
    at, values = curve(arc, np.column_stack((level, level)))
    assert np.max(np.abs(np.diff(values)[np.diff(at) > 0.0])) < 1.5 and np.sum(np.diff(at) == 0.0) == 1
    np.testing.assert_allclose(np.interp(middle, at, values), level)
    smooth = np.sin(arc)
    at, values = curve(arc, smooth)
    np.testing.assert_array_equal(values, smooth.ravel())


def test_stairs_are_a_curve_where_only_a_part_of_the_rod_is_in_contact():
    """Elsewhere values stay, and so does a moment. The other force follows, though its own changes are as large as its jumps."""
    arc = np.column_stack((np.arange(40.0), np.arange(1.0, 41.0)))
    level = np.clip(arc.mean(axis=1), 25.5, 37.5) - 25.5
    forces = np.stack((np.column_stack((level, level - 0.1)), np.column_stack((level, level))), axis=-1)
    runs = forces_plot.stairs(forces)
    assert [(run[0], run[-1]) for run in runs] == [(25, 37)]
    at, values = forces_plot.without_stairs(arc, forces[:, :, 1], runs)
    np.testing.assert_allclose(np.interp(arc.mean(axis=1), at, values), level)
    assert np.max(np.abs(np.diff(values)[np.diff(at) > 0.0])) < 1.01 and np.min(np.diff(values)) >= 0.0


def curve(arc, values):
    """Without stairs, where there are some."""
    return forces_plot.without_stairs(arc, values, forces_plot.stairs(np.stack((0.0 * values, values), axis=-1)))


ROD = """*NODE
1, 0, 0
2, 1, 0
*LINE, ELSET=ROD
1, 2, {elements}
*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS
1e4, 1
*BOUNDARY
1, ENCASTRE
*STEP
*STATIC, METHOD=LOAD
1
*CLOAD
2, 1, -1
2, 2, 3
*DLOAD
ROD, PY, {load}
*FIELD OUTPUT
DISPLACEMENT, SECTION FORCES
*END STEP
"""


@pytest.mark.parametrize("load, allowed", [(0, (4e-3, 6e-3, 4e-3)), (-8, (6e-2, 2e-3, 1e-3))])
def test_two_elements_have_the_section_forces_of_many(tmp_path, load, allowed):
    """A rod bent far round, over the largest difference along it; straight lines miss N by 0.1 and 0.6, M by 0.16."""
    found = {}
    for elements in (2, 64):
        (tmp_path / "rod.inp").write_text(ROD.format(elements=elements, load=load))
        subprocess.run([os.environ["UNILAT"], "rod.inp"], cwd=tmp_path, check=True, capture_output=True)
        rod = read_results(tmp_path / "rod.h5")
        last = rod.n_points
        found[elements] = between_ends(shape_at(rod, last), rod.field("section_forces", last), 64 // elements)
    fine = np.concatenate((found[64][:, 0], found[64][-1:, -1]))
    for element, values in enumerate(found[2]):
        assert np.all(np.max(np.abs(values - fine[32 * element:32 * element + 33]), axis=0) < np.ptp(fine, axis=0) * allowed)


def test_numbers_on_the_structure_are_short_and_in_the_middle_of_what_is_even(ring, axes_of):
    axes_n, axes_m = axes_of("forces", ring, "--on", "structure", "--rows", "1", "--quantities", "N,M", "--y-scale", "1e7")
    assert axes_n.get_title().endswith("($10^{6}$)")
    assert [text.get_text() for text in axes_n.texts] == ["\N{MINUS SIGN}20"]
    assert abs(axes_n.texts[0].xy[1]) < 0.2         # the middle of the half ring, not its end
    assert [forces_plot.power_of_ten(np.array(values)) for values in ([0.0], [99999.0], [1e5, -2.0], [5e-3], [-3e-7])] == [0, 0, 3, -3, -9]


# Scales that differ are told


def test_the_picture_says_that_y_is_stretched(tmp_path, axes_of):
    ring = tmp_path / "ring.h5"
    make.write_ring(ring, fields=("displacement",))
    assert axes_of("shape", ring)[0].get_xlabel() == "x (length)"
    (axes,) = axes_of("shape", ring, "--stretch-y", 5, "--scale", 2)
    assert axes.get_xlabel() == "x (length); y is drawn 5 times larger; displacements times 2"
    (axes,) = axes_of("shape", ring, "--stretch-y", 5, "--no-axes")
    assert "y is drawn 5 times larger" in [text.get_text() for text in axes.get_legend().get_texts()]

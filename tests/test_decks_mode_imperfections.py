"""Buckling modes as imperfections: the path near the perfect structure's, and the price of an imperfection after Koiter.

Koiter 1945: where the branch of the perfect structure falls to both sides, a small imperfection a lowers the limit load by
c a^(2/3) + O(a); where it rises there is no limit point.
"""
import functools

import numpy as np
import pytest

import deck_runner as dr

BIFURCATION = 14.3595205986   # of the shallow arch; its branch falls to both sides
PI2 = np.pi**2


def arch(*steps, mode="1", data="0.5, 1E-9, 0.005", stop="v, ABOVE, 0.08", more=""):
    """The shallow arch: its modes, then one step for each list of (mode, amplitude) lines."""
    text = dr.on_given_mesh("arch-shallow-hinged")
    load = "*CLOAD\n2, 2, -1.\n"
    out = text[:text.index("*STEP")] + f"*STEP, NAME=MODES\n*BUCKLE\n3\n{load}*END STEP\n"
    for lines in steps:
        card = f"*IMPERFECTION, SHAPE=MODE, ELSET=ARCH, STEP=MODES\n{lines}\n" if lines else ""
        out += f"*STEP\n*STATIC\n{data}\n{card}{load}*STOP\n{stop}\n{more}*FIELD OUTPUT\nDISPLACEMENT\n*END STEP\n"
    return out


def limit_loads(run):
    return [c.load_factor for c in run.labelled("LP")]


def test_the_perfect_structure_follows_when_asked_for():
    """A step without imperfection after one with goes on from there; with one, it begins again, as in a deck of its own."""
    both, second = dr.run_deck(arch("1, 0.001", "1, 0.0005")), dr.run_deck(arch("1, 0.0005"))
    rows = both.column("step") == 3
    for name in ("load_factor", "v", "rotation"):
        assert np.array_equal(both.column(name)[rows], second.column(name)[second.column("step") == 2])
    assert both.column("load_factor")[rows][0] == 0.0


def test_lines_and_cards_add_up():
    once = limit_loads(dr.run_deck(arch("1, 0.001")))
    for lines in ("1, 0.0004\n1, 0.0006", "1, 0.0004\n*IMPERFECTION, SHAPE=MODE, ELSET=ARCH, STEP=MODES\n1, 0.0006",
                  "1, 0.001\n2, 0.002\n2, -0.002"):
        dr.assert_close(limit_loads(dr.run_deck(arch(lines))), once, relative=1e-8)
    assert abs(limit_loads(dr.run_deck(arch("1, 0.001\n2, 0.002")))[0] / once[0] - 1.0) > 1e-3


def test_sign_of_the_amplitude():
    """The mode sways: the other way the same, mirrored."""
    plus, minus = dr.run_deck(arch("1, 0.001")), dr.run_deck(arch("1, -0.001"))
    dr.assert_close(limit_loads(plus), limit_loads(minus), relative=1e-7)
    dr.assert_close(plus.column("rotation")[-1], -minus.column("rotation")[-1], relative=1e-6)


@dr.release_only
def test_koiter():
    """The drop grows with the power 2/3 of the amplitude; the straight line behind it fades."""
    amplitudes = 1e-3 * 0.5**np.arange(7)
    drops = [BIFURCATION - limit_loads(dr.run_deck(arch(f"1, {a!r}", data="0.5, 1E-9, 0.0005")))[0] for a in amplitudes]
    powers = np.log2(np.array(drops[:-1]) / drops[1:])
    # c a^(2/3) (1 + d a^(1/3) ...): what is over 2/3 falls by 2^(1/3) or more from one to the next
    assert np.all(powers > 2 / 3) and np.all(np.diff(powers) < 0.0)
    dr.assert_close(powers[-1], 2 / 3, absolute=0.02)


def test_koiter_by_the_limit_curve():
    """The same law along one curve, over six decades of the amplitude."""
    run = dr.run_deck(arch("1, 0.001", more="*LIMIT CURVE, PARAMETER=IMPERFECTION, ELSET=ARCH, SCALE=LOG\n"
                           "-0.1, 1E-6, 0.5, 0.5, 0.1, 1E-2, 1E-3, 1E-4, 1E-5\n"))
    curve = run.results.limit_curves["Curve-1"]
    factor, drop = curve.column("parameter").values, BIFURCATION - curve.column("load_factor").values
    assert np.all(drop > 0.0)
    rows = [int(np.argmin(np.abs(np.log10(factor) + k))) for k in range(1, 7)]
    dr.assert_close(factor[rows], 10.0**-np.arange(1, 7), relative=1e-9)
    powers = np.log10(drop[rows][:-1] / drop[rows][1:])
    # c a^(2/3) (1 + d a^(1/3) ...): what is over 2/3 falls by 10^(1/3) = 2.2 from one to the next
    assert np.all(powers > 2 / 3) and np.all(np.diff(powers) < 0.0)
    dr.assert_close(powers[-1], 2 / 3, absolute=1e-3)
    for k, factor in ((rows[0], 0.1),):
        dr.assert_close(BIFURCATION - drop[k], limit_loads(dr.run_deck(arch(f"1, {1e-3 * factor!r}", data="0.5, 1E-9, 0.0005")))[0],
                        relative=1e-8)


def test_a_symmetric_mode_moves_the_bifurcation():
    """The second mode has no node at the apex: the arch stays symmetric, only of another shape."""
    run = dr.run_deck(arch("2, 0.002"))
    modes = run.results.buckling["MODES"].mode
    assert abs(modes[1, 1, 0]) < 1e-6 and abs(modes[1, 1, 1]) > 1e-2
    labels = [c.label for c in run.results.critical if c.label != "EP"]
    assert labels == ["BP", "LP"]
    # at the bifurcation itself the tangent says nothing about the null vector's share
    others = np.arange(run.results.n_points) + 1 != run.only("BP").point
    assert np.max(np.abs(run.column("rotation")[others])) < 1e-7


# ---- Euler's column ----

def column(amplitude, elements=32):
    return f"""*HEADING
column
*NODE
1, 0., 0.
2, 0.5, 0.
3, 1., 0.
*LINE, ELSET=ROD, TYPE=GE6
1, 2, {elements // 2}
2, 3, {elements // 2}
*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS
1E8, 1.
*BOUNDARY
1, PINNED
3, 2
*MONITOR, NAME=MID
2, U2
*STEP, NAME=EULER
*BUCKLE
2
*CLOAD
3, 1, {-PI2!r}
*END STEP
*STEP
*STATIC
0.2, 1E-12, 0.01
*IMPERFECTION, SHAPE=MODE, ELSET=ROD, STEP=EULER
1, {amplitude!r}
*CLOAD
3, 1, {-PI2!r}
*LOCATE
LOAD, 0.5, 0.8, 0.9
*STOP
MID, ABOVE, 0.2
*FIELD OUTPUT
DISPLACEMENT
*END STEP
"""


@functools.cache
def bent(amplitude):
    return dr.run_deck(column(amplitude))


def test_column_grows_as_ayrton_and_perry_say():
    """v = a p/(1 - p) where it is small: an exact amplification for a sine, up to the square of its slope."""
    amplitude = 1e-4
    for c in bent(amplitude).labelled("UZ"):
        dr.assert_close(c.monitors["MID"], amplitude * c.load_factor / (1.0 - c.load_factor), relative=1e-4)


def test_imperfect_column_nears_the_branch():
    """At the deflection 0.2, the load comes down to the perfect branch's as the imperfection goes; there is no limit point."""
    perfect = dr.changed(column(1e-3), ("*IMPERFECTION, SHAPE=MODE, ELSET=ROD, STEP=EULER\n1, 0.001\n", ""),
                         ("*STOP\nMID, ABOVE, 0.2\n", "*STOP\nLOAD, ABOVE, 1.05\n*BRANCH, SIDE=PLUS\nMID, ABOVE, 0.2\n"))
    branch, = dr.run_deck(perfect).results.branches.values()
    end = branch.column("load_factor").values[-1]
    distance = []
    for amplitude in (2e-3, 1e-3, 5e-4):
        assert not bent(amplitude).labelled("LP")
        distance.append(end - bent(amplitude).column("load_factor")[-1])
    # to the first order in the amplitude: a/(a + v) of the load
    assert np.all(np.array(distance) > 0.0)
    dr.assert_close(np.array(distance[:-1]) / distance[1:], [2.0, 2.0], relative=0.02)
    dr.assert_close(distance[-1], 5e-4 / 0.2, relative=0.15)


def test_the_other_way():
    up, down = bent(1e-3), dr.run_deck(dr.changed(column(-1e-3), ("MID, ABOVE, 0.2", "MID, BELOW, -0.2")))
    dr.assert_close(up.column("load_factor")[-1], down.column("load_factor")[-1], relative=1e-7)


def test_coordinates_are_those_of_the_perfect_structure():
    """Displacements in the file count from the deck's geometry: at no load they are the imperfection, a sine."""
    run = bent(1e-3)
    first = run.results.field_points[0]
    x, u = run.results.mesh.coordinates, run.results.field("displacement", first)
    dr.assert_close(x[:, 1], 0.0 * x[:, 1], absolute=1e-15)
    dr.assert_close(u[:, 1], 1e-3 * np.sin(np.pi * x[:, 0]), absolute=1e-8)


def test_a_mode_that_was_not_found():
    """Exit code 2 with the reason; a mode that does not bend the set is no imperfection either."""
    run = dr.run_deck(dr.changed(column(1e-3), ("*CLOAD\n3, 1, -9.869604401089358\n*END STEP\n*STEP\n",
                                               "*CLOAD\n2, 6, -1.\n*END STEP\n*STEP\n")), code=2)
    assert "they cannot make anything buckle" in run.results.status and "found no modes" in run.results.status


@pytest.mark.parametrize("foundation, points", [("", "ALONG"), ("", "NODES"), (", FOUNDATION=WINKLER, MODULUS=100.", "NODES"),
                                                (", FOUNDATION=WINKLER, MODULUS=100.", "ALONG")])
def test_behind_an_obstacle(foundation, points):
    """An error of the deck, told with its line as those found in reading are: nothing could be stress-free there."""
    def deck(amplitude, more=""):
        obstacle = (f"*OBSTACLE, NAME=GROUND, TYPE=LINE{foundation}\n0., -0.005, 2., -0.005\n"
                    f"*CONTACT, OBSTACLE=GROUND, NSET=ROD, POINTS={points}\n*STEP, NAME=EULER\n")
        text = dr.changed(column(-amplitude), ("ELSET=ROD, TYPE", "ELSET=ROD, NSET=ROD, TYPE"), ("*STEP, NAME=EULER\n", obstacle),
                          ("MID, ABOVE, 0.2", "LOAD, ABOVE, 0.3"))
        return text.replace("*STEP\n*STATIC", f"*STEP\n{more}*STATIC")
    text = deck(0.01)
    run = dr.run_deck(text, code=1)
    line = text.splitlines().index("*IMPERFECTION, SHAPE=MODE, ELSET=ROD, STEP=EULER") + 1
    assert f"deck.inp:{line}:1: step" in run.stderr and "contact with GROUND: the imperfection puts node" in run.stderr
    assert "0.005 behind the obstacle; leave it room with GAP" in run.stderr and "1 error in deck.inp" in run.stderr
    # the modes found before are in the file
    assert run.results.status.startswith("stopped: step") and len(run.results.buckling["EULER"].load_factor) > 0
    dr.run_deck(deck(0.004))
    dr.run_deck(deck(0.01, "*CONTACT INTERFERENCE, SHRINK\nGROUND\n"))


def test_example():
    """What the comments of the deck say: limit loads over six decades of the amplitude, the largest a tenth of the rise."""
    run = dr.run_deck(dr.on_given_mesh("arch-imperfect"))
    smaller, larger = (run.results.limit_curves[name] for name in ("SMALLER", "LARGER"))
    assert (smaller.parameter, smaller.of, smaller.step) == ("IMPERFECTION", "ARCH", 3)
    loads = {round(np.log10(value)): load for value, load, label in
             zip(*(smaller.column(name).values for name in ("parameter", "load_factor", "label"))) if str(label) in ("UZ", "EP")}
    dr.assert_close([loads[-k] for k in (1, 2, 3)], [14.1710, 14.3199, 14.3510], absolute=1e-4)
    assert 0.0 < BIFURCATION - loads[-5] < 1e-3
    dr.assert_close([curve.column("load_factor").values[0] for curve in (smaller, larger)], [13.413] * 2, absolute=1e-3)
    dr.assert_monotone(larger.column("load_factor").values, rising=False)
    branch, = run.results.branches.values()
    assert branch.name == "SWAY" and branch.step == 2

"""The load has its extreme at a corner of the path: where a contact is lost or gained, or a stop comes to a corner of its law.

A frame of a base from -B to B on two feet and a column of height H carries the weight W = 1 on its top, and is pushed there by the load
factor times W to the right. By moments about the right foot, with the top at (B + x, H - y) from the left one,

    load (H - y) = W (B - x) - 2 B cos(turn) left

where x, y are what the top has gone, and left is what the left foot pushes with. With rigid feet the base lies flat until the left foot
lifts off, left = 0; from there on the load falls. On feet that push with K times what they sink, up to 0.7 W, and from there on with
SOFT times that, the frame has lost its stiffness, but for its sign, where the right foot yields: its moment grows by less than W H then.
"""
import math
import os
import re
import subprocess
import sys

import numpy as np
import pytest
from unilat.plot.path_curves import bends
from unilat.sweep.quantities import read_quantity

import deck_runner as dr

B, H, W = 1.0, 5.0, 1.0
K, SOFT, YIELDS = 50.0, 1.0, 0.7
FRAME = """*HEADING
Frame on two feet
*NODE
1, {left!r}, 0.
2, 0., 0.
3, {right!r}, 0.
4, 0., {height!r}
*LINE, ELSET=FRAME
1, 2, 2
2, 3, 2
2, 4, 4
*BEAM SECTION, ELSET=FRAME, SECTION=STIFFNESS
{stiff}
*BOUNDARY
3, 1
{feet}1
3
*MONITOR, NAME=sway
4, U1
*MONITOR, NAME=drop
4, U2, -1.
*STEP
*STATIC, METHOD=LOAD
1.
*CLOAD
4, 2, {weight!r}
*END STEP
*STEP
*STATIC{method}
{increments}
*CLOAD
4, 1, {push!r}
*STOP
{stop}
{more}*END STEP
"""
RIGID = "*GAP, NAME=FEET\n"
YIELDING = f"*FOUNDATION LAW, NAME=YIELDS\n0., 0.\n{YIELDS / K!r}, {YIELDS!r}\n{YIELDS / K + 10.0 / SOFT!r}, {YIELDS + 10.0!r}\n" \
    "*GAP, NAME=FEET, LAW=YIELDS\n"


def frame(feet=RIGID, stiff="1e6, 1e4", method="", increments="0.02, , 0.02", stop="sway, ABOVE, 1.1", more="", code=0):
    return dr.run_deck(FRAME.format(left=-B, right=B, height=H, weight=-W, push=W, feet=feet, stiff=stiff, method=method,
                                    increments=increments, stop=stop, more=more), code=code)


def yielding(**options):
    return frame(YIELDING, "1e9, 1e9", increments="0.01, , 0.005", **{"stop": "sway, ABOVE, 0.3", **options})


def at_yield():
    """The load where the right foot comes to the corner of its law, as a rigid body: the left one then pushes with W - YIELDS."""
    turn = math.asin((YIELDS - (W - YIELDS)) / K / (2.0 * B))
    c, s = math.cos(turn), math.sin(turn)
    return (W * (B * c - H * s) - 2.0 * B * c * (W - YIELDS)) / (B * s + H * c)


def labels(run):
    return [c.label for c in run.results.critical if c.step == 2]


@pytest.mark.parametrize("method, increments", [("", "0.02, , 0.02"), (", METHOD=SPHERICAL", "0.02, , 0.05"),
                                                (", METHOD=DISPLACEMENT, MONITOR=sway", "1e-4, , 0.02")])
def test_a_foot_lifts_off(method, increments):
    run = frame(method=method, increments=increments)
    assert labels(run) == ["C-", "LP", "EP"]
    lost, top = run.only("C-"), run.only("LP")
    assert top.point == lost.point and top.load_factor == lost.load_factor and top.located
    dr.assert_close(top.load_factor, W * (B - top.monitors["sway"]) / (H - top.monitors["drop"]), relative=1e-9)
    load = run.column("load_factor")[run.column("step") == 2]
    assert np.max(load) == top.load_factor
    # In the results the point is the change of contact, and the listing has both.
    assert run.column("label")[top.point - 1] == "C-"
    assert re.search(r"^ LP +\d+ .* at a corner of the path$", run.stdout, re.M)


def test_load_control_ends_at_the_corner():
    """The maximum is told though nothing follows, and the message names a METHOD that gets on."""
    run = frame(method=", METHOD=LOAD", code=2)
    assert labels(run) == ["C-", "LP"]
    assert "turns back where the contact changes, at load factor 0.1998" in run.stderr
    assert "METHOD=CYLINDRICAL can" in run.stderr and "ahead" not in run.stderr
    dr.assert_close(run.load("LP"), frame().load("LP"), relative=1e-9)


def test_a_stop_yields():
    run = yielding()
    assert labels(run) == ["LP", "EP"]
    top = run.only("LP")
    # EI = 1e9 bends the column by 1e-9 and less of its height.
    dr.assert_close(top.load_factor, at_yield(), relative=1e-7)
    assert top.error < 1e-9 and np.isnan(run.results.path["load_factor"].rate[top.point - 1])
    pivots = run.column("negative_pivots")
    assert np.all(pivots[:top.point] == 0) and np.all(pivots[top.point:] == 1)


@pytest.mark.parametrize("part", [0.999, 0.9999999])
def test_the_end_of_a_step_just_below_the_corner(part):
    """The increment goes past the corner, and its end is below the load where the step ends."""
    top = at_yield()
    run = yielding(stop=f"LOAD, ABOVE, {part * top!r}")
    assert labels(run) == ["EP"]
    dr.assert_close(run.column("load_factor")[-1], part * top, relative=1e-12)
    behind = yielding(stop=f"LOAD, BELOW, {part * top!r}")
    assert labels(behind) == ["LP", "EP"]


def test_the_end_of_a_step_just_behind_a_smooth_limit_point():
    """The same where no corner is: the load passes its bound upwards and downwards within one increment."""
    text = dr.on_given_mesh("lee-frame")
    top = dr.run_deck(text).labelled("LP")[0].load_factor
    run = dr.run_deck(dr.changed(text, ("LOAD, ABOVE, 40.", f"LOAD, BELOW, {0.9999999 * top!r}")))
    assert [c.label for c in run.results.critical] == ["LP", "EP"]
    dr.assert_close(run.column("load_factor")[-1], 0.9999999 * top, relative=1e-10)


def test_values_on_both_sides_of_the_corner():
    value = 0.9999 * at_yield()
    run = yielding(more=f"*LOCATE\nLOAD, {value!r}\n")
    assert labels(run) == ["UZ", "LP", "UZ", "EP"]


def test_a_limit_curve_begins_at_no_corner():
    run = yielding(more="*LIMIT CURVE, PARAMETER=EI, ELSET=FRAME\n1., 2e9\n", code=2)
    assert "the path has 0 limit point(s), not 1; those at corners of the path do not count" in run.stderr


@dr.once_in_release
def test_sweeps_and_pictures(tmp_path):
    """`limit_load` of a sweep is the maximum; curves have a corner there, and stability changes where it does."""
    for run in (frame(), yielding()):
        top = run.only("LP")
        assert read_quantity("LP", "sweep").of(run.results) == top.load_factor
        assert read_quantity("LP.sway", "sweep").of(run.results) == pytest.approx(top.monitors["sway"], rel=1e-12)
        corner, smooth = bends(run.results)
        assert corner[top.point - 1] and not smooth[top.point - 1]
        done = subprocess.run([sys.executable, "-m", "unilat", "path", run.results.filename, "--x", "sway", "--step", "2", "-o", "frame.png"],
                              cwd=tmp_path, env=os.environ, capture_output=True, encoding="utf-8", check=False)
        assert done.returncode == 0 and done.stderr == "", done.stderr

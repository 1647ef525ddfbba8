"""Columns, strips and edges far beyond first contact: the events of a path do not hang on its increments.

What is known exactly: flats between clamped ends, whose free parts are 2 pi (EI/P)^(1/2) long, buckle by themselves; half a strip
against a wall is an elastica that ends in a point.
"""
import functools
import math
import re

import numpy as np
import pytest

import deck_runner as dr

COLUMN = """*HEADING
Column beside a wall
*NODE
1, 0., 0.
{nodes}
*IMPERFECTION, ELSET=COLUMN, SHAPE=SINE
{waves}
*BEAM SECTION, ELSET=COLUMN, SECTION=STIFFNESS
480000.0, 1.0
*BOUNDARY
{supports}
*OBSTACLE, NAME=WALL, TYPE=LINE
1.0, 0.02, 0., 0.02
*OBSTACLE, NAME=LOWER, TYPE=LINE
0., -0.02, 1., -0.02
*CONTACT, OBSTACLE=WALL, NSET=COLUMN
*CONTACT, OBSTACLE=LOWER, NSET=COLUMN
*MONITOR, NAME=shortening
3, U1, -1.0
*STEP
{accuracy}*STATIC
{increments}
*CLOAD
3, 1, {unit!r}
{across}*STOP
LOAD, ABOVE, {stop!r}
*CONTROLS, POINTS=1000
*END STEP
"""
PLAIN = "3, 1.0, 0.\n*LINE, ELSET=COLUMN, NSET=COLUMN, TYPE=GE8\n1, 3, 24"
PARTED = "2, 0.4, 0.\n3, 1.0, 0.\n*LINE, ELSET=COLUMN, NSET=COLUMN, TYPE=GE8\n1, 2, 16\n2, 3, 24"

HALVES = "2, 0.6, 0.\n3, 1.0, 0.\n*LINE, ELSET=COLUMN, NSET=LEFT, TYPE=GE8\n1, 2, 15\n*LINE, ELSET=COLUMN, NSET=RIGHT, TYPE=GE8\n2, 3, 10\n" \
    "*NSET, NSET=COLUMN\nLEFT, RIGHT"


@functools.cache
def column(ends, waves="", increments="0.1", across="", accuracy="", stop=20.0, code=0):
    text = COLUMN.format(nodes=PARTED if across else PLAIN, waves=waves, increments=increments, across=across, accuracy=accuracy, stop=stop,
                         supports="1, PINNED\n3, 2" if ends == "hinged" else "1, ENCASTRE\n3, YSYMM",
                         unit=-math.pi**2 if ends == "hinged" else -4.0 * math.pi**2)
    if not waves:
        text = dr.changed(text, ("*IMPERFECTION, ELSET=COLUMN, SHAPE=SINE\n\n", ""))
    return dr.run_deck(text, code=code)


def events(run):
    return [c.label for c in run.results.critical]


@dr.release_only
@pytest.mark.parametrize("ends, waves", [("clamped", "0.002, 1\n0.001, 2\n0.0005, 3"), ("clamped", "0.0001, 1\n0.001, 2"),
                                         ("hinged", "0.0014, 1\n-0.0004, 3")])
def test_long_increments_find_the_same_events(ends, waves):
    """An equilibrium found ahead may be one of another path, and a line that begins too long may hide the next event.

    Loads agree as well as events are located; where contact parts next to another one that is known less well, and its bar may be
    wide.
    """
    wide = "*ACCURACY, WIDEST=1.\n"
    long, short = column(ends, waves, accuracy=wide), column(ends, waves, "0.1, 1e-9, 1e-3", accuracy=wide)
    assert events(long) == events(short)
    dr.assert_close([c.load_factor for c in long.results.critical], [c.load_factor for c in short.results.critical], relative=1e-7)


def test_a_span_that_is_born_short_grows_at_once():
    """Behind the end of a line that splits, and where a point divides, the new points have forces, but hardly a curvature against the
    wall: the moment tells where they are. On the next increment they go as far as any."""
    run = column("clamped", "0.002, 1\n0.001, 2\n0.0005, 3", accuracy="*ACCURACY, WIDEST=1.\n")
    divides, _, splits = (c for c in run.labelled("C-")[:3])
    assert divides.error < 1e-6 and splits.error < 1e-6
    loads, contact = run.column("load_factor"), run.results.contact
    # The first point behind a split is where the increment would have ended.
    for born, row, first in ((divides, divides.point, 0), (splits, splits.point + 1, 0)):
        assert contact.count[row] == 2
        assert loads[row] > 1.03 * born.load_factor
        assert contact.start[row, first + 1] - contact.end[row, first] > 0.01


def test_two_places_open_at_once():
    """A symmetric line does not part at one of them before the other."""
    run = column("hinged", "0.0014, 1\n-0.0004, 3")
    assert events(run) == ["C+", "C-", "EP"]
    parted, contact = run.only("C-").point, run.results.contact
    assert np.all(contact.count[parted:] == 3)
    length = 1.0 + 0.25 * math.pi**2 * (0.0014**2 + 9.0 * 0.0004**2)
    # Where a gap of 1e-8 is least residuals do not tell to many digits.
    dr.assert_close(np.sort(contact.start[parted:, :3], axis=1), length - np.sort(contact.end[parted:, :3], axis=1)[:, ::-1],
                    absolute=1e-4)


def test_a_path_back_at_its_own_bifurcation():
    """Waves of the second mode cross the path at 3.48; where only one half of the column has a lower wall the path comes back there on
    them, and what follows it has passed."""
    text = COLUMN.format(nodes=HALVES, waves="0.0014, 1\n-0.0004, 3", increments="0.1", across="", accuracy="", stop=20.0,
                         supports="1, ENCASTRE\n3, YSYMM", unit=-4.0 * math.pi**2)
    run = dr.run_deck(dr.changed(text, ("OBSTACLE=LOWER, NSET=COLUMN", "OBSTACLE=LOWER, NSET=LEFT")), code=2)
    assert events(run) == ["C+", "BP", "C+", "LP", "C-", "LP"]
    told = re.search(r"comes back to a bifurcation of its own at load factor (\S+):", run.stderr)
    dr.assert_close(float(told.group(1)), run.only("BP").load_factor, relative=1e-9)
    assert "POINTS=NODES" not in run.stderr


@pytest.mark.parametrize("ends", ["hinged", "clamped"])
def test_a_load_beside_the_line(ends):
    """The line that begins at a point does not reach for the load's place, where the rod bends; it grows past it.

    Free parts are (Pcr/P)^(1/2) long, and the load presses the flat between them at 0.4, which stays there. The longer part beside it
    buckles at 0.6 (P/Pcr)^(1/2) = 1 + q m with q = 1 and the root of tan(pi q) = pi q, m = 2 where Pcr is that of hinged ends, 1 where
    of clamped ones. P/EA is 1.3e-3 at most.
    """
    run = column(ends, across="2, 2, 1e-5\n")
    assert events(run)[0] == "C+" and events(run)[-1] == "EP"
    buckled = [2.0 * 1.0, 2.0 * 1.4302966531] if ends == "hinged" else [1.0, 1.4302966531, 2.0]
    loads = [p for p in (((1.0 + q) / 0.6)**2 for q in buckled) if p < 20.0]
    # Up to (1/0.4)^2 next to nothing keeps the clamped column's free parts from moving along themselves: there two paths meet.
    late = [c for c in run.labelled("BP") if c.load_factor > 6.25]
    assert len(late) == len(loads)
    for bifurcation, load in zip(late, loads):
        dr.assert_close(bifurcation.load_factor, load, relative=1.3e-3)
    assert all("imperfection too small to tell" in c.note for c in run.labelled("BP") if c.load_factor <= 6.25)
    assert not any("imperfection" in c.note for c in late)


BETWEEN = """*HEADING
Hinged column with two waves between walls
*NODE
1, 0., 0.
3, 1.0, 0.
*LINE, ELSET=COLUMN, NSET=COLUMN, TYPE=GE8
1, 3, 24
*IMPERFECTION, ELSET=COLUMN, SHAPE=SINE
0.0005, 3
0.0003, 2
*BEAM SECTION, ELSET=COLUMN, SECTION=STIFFNESS
1e5, 1.
*BOUNDARY
1, PINNED
3, 2
*OBSTACLE, NAME=UPPER, TYPE=LINE
1., 0.01, 0., 0.01
*OBSTACLE, NAME=LOWER, TYPE=LINE
0., -0.02, 1., -0.02
*CONTACT, OBSTACLE=UPPER, NSET=COLUMN
*CONTACT, OBSTACLE=LOWER, NSET=COLUMN
*STEP
*STATIC
0.5, , 0.002
*CLOAD
3, 1, -1.
*STOP
LOAD, ABOVE, 215.
*END STEP
"""


def test_increments_that_land_on_another_path():
    """Where contact changes at the end of an increment its tangent has the pivots of another path: shorter ones stay on their own.

    Along a path without bifurcations the load grows where the number of negative pivots is even, and falls where it is odd (the index
    of a path of complementarity problems), and without events it stays: a column with one wave lies down on the wall as it came.
    """
    run = dr.run_deck(BETWEEN)
    assert events(run) == ["C+", "C-", "LP", "C-", "LP", "C-", "EP"]
    # The same on 60 elements, and with increments of 0.0005.
    dr.assert_close(run.labelled("C-")[-1].load_factor, 206.94927, relative=1e-7)
    row, load, pivots = np.arange(run.results.n_points - 1), run.column("load_factor"), run.column("negative_pivots")
    assert np.all(np.sign(np.diff(load)) == (-1)**pivots[row + 1])
    # Wherever the load turns there is a limit point, and nowhere else.
    turns = np.sign(np.diff(load)[1:]) != np.sign(np.diff(load)[:-1])
    assert [c.point for c in run.labelled("LP")] == list(np.flatnonzero(turns) + 2)
    stays = column("clamped", "0.00001, 1")
    assert not np.any(stays.column("negative_pivots"))
    # Free parts are (Pcr/P)^(1/2) long but for the square of their slopes, 0.3 at the most.
    dr.assert_close(stays.results.contact.start[-1, 0], 20.0**-0.5, relative=0.3**2)


def test_paths_that_pass_each_other_closely():
    """A load across keeps the path that bends away from that of the straight column, by far less than an increment; where it
    touches is a straight line in that load."""
    touch = {}
    for load in (1e-6, 1e-7, 1e-8):
        run = column("clamped", across=f"2, 2, {load}\n", stop=2.0)
        assert events(run) == ["C+", "EP"]
        touch[load] = run.only("C+").load_factor
    dr.assert_close(touch[1e-8], touch[1e-7] + 0.1 * (touch[1e-7] - touch[1e-6]), relative=1e-11)


SLENDER = """*HEADING
Hinged column between two walls
*NODE
1, 0., 0.
2, 1., 0.
*LINE, ELSET=COLUMN, NSET=COLUMN, TYPE=GE8
1, 2, {elements}
*IMPERFECTION, ELSET=COLUMN, SHAPE=SINE
1.685e-06, 3
-4.913e-07, 2
*BEAM SECTION, ELSET=COLUMN, SECTION=STIFFNESS
5.3e9, 1.
*BOUNDARY
1, PINNED
2, 2
*OBSTACLE, NAME=TOP, TYPE=LINE
2., 0.001327, -1., 0.001327
*OBSTACLE, NAME=BOTTOM, TYPE=LINE
-1., -0.0035, 2., -0.0035
*CONTACT, OBSTACLE=TOP, NSET=COLUMN
*CONTACT, OBSTACLE=BOTTOM, NSET=COLUMN
*MONITOR, NAME=shortening
2, U1, -1.
*STEP
*STATIC
0.3, 1E-12, 0.00066
*CLOAD
2, 1, {load!r}
*STOP
LOAD, ABOVE, {stop!r}
*END STEP
"""


def about_to_open(elements):
    run = dr.run_deck(SLENDER.format(elements=elements, load=-math.pi**2, stop=9.225))
    assert events(run) == ["BP", "C+", "C-", "EP"]
    dr.assert_close(run.load("EP"), 9.225, relative=1e-12)
    assert run.results.contact.count[-1] == 2
    return run.only("EP").monitors["shortening"]


@pytest.mark.xfail(reason="the short span does not always follow the load back to the end of the step: the run stops and says so",
                   strict=False)
def test_a_step_ends_where_a_span_is_about_to_open():
    """A line parts at 9.2108; the span is known from a little further on, and the end of the step lies before that."""
    dr.assert_close(about_to_open(24), about_to_open(36), relative=1e-9)


def test_the_end_of_a_line_behind_a_span_that_hardly_opens():
    """Its gap is some 1e-15 and its point as good as flat: the rod touches there, and does not turn against the wall, all the same."""
    text = dr.changed(SLENDER, ("1.685e-06, 3", "1.685e-05, 3"), ("-4.913e-07, 2", "-4.913e-06, 2"), ("5.3e9", "5.3e5"),
                      ("0.3, 1E-12, 0.00066", "0.3, 1E-12, 0.0066"), ("2., 0.001327, -1., 0.001327", "2., 0.01327, -1., 0.01327"),
                      ("-1., -0.0035, 2., -0.0035", "-1., -0.035, 2., -0.035"))
    runs = [dr.run_deck(text.format(elements=elements, load=-math.pi**2, stop=9.3)) for elements in (24, 36, 48)]
    lines = [run.results.contact.regions(run.only("EP").point)[1] for run in runs]
    for line in lines:
        dr.assert_close(line.start, lines[0].start, absolute=line.start_error + lines[0].start_error)
        assert line.end > line.start and line.start_error < 1e-5


STRIP = """*HEADING
Half of a clamped strip at a wall
*NODE
1, 0., 0.
2, 0.5, 0.
*LINE, ELSET=S, NSET=S, TYPE=GE8
1, 2, 30
*BEAM SECTION, ELSET=S, SECTION=STIFFNESS
1e6, 1.
*BOUNDARY
1, ENCASTRE
2, 6
*OBSTACLE, NAME=UPPER, TYPE=LINE
1., 0.1, 0., 0.1
*CONTACT, OBSTACLE=UPPER, NSET=S
*MONITOR, NAME=d
2, U1, -2.
*MONITOR, NAME=UP, OBSTACLE=UPPER
RN, 2.
*STEP
*STATIC
1., 1e-9, 0.02
*CLOAD
2, 1, -1.
2, 2, {lift}
*STOP
d, ABOVE, 0.5
*CONTROLS, POINTS=300
*END STEP
"""


def elastica(load, length, force, ea=1e6, steps=400):
    """(x, y, rotation, moment) at the end of a rod that leaves a clamp without moment, pulled by -load, pushed down by a force there."""
    def rate(y):
        c, s = np.cos(y[2]), np.sin(y[2])
        stretch = 1.0 - (load * c + force * s) / ea
        return np.array([stretch * c, stretch * s, y[3], (force * c - load * s) * stretch])
    y, h = np.zeros(4), length / steps
    for _ in range(steps):
        a = rate(y)
        b = rate(y + 0.5 * h * a)
        c = rate(y + 0.5 * h * b)
        y = y + h / 6.0 * (a + 2.0 * b + 2.0 * c + rate(y + h * c))
    return y


def test_a_line_that_little_presses_leaves_at_once():
    """Pulled in the end, the force in the middle turned round: the flat leaves the wall, but for the point where it began.

    What lifts it are 1e-3 and 2e-3 of the load; all is linear in so small a force. Without it the rod is level and without moment where
    it touches, and by its first integral at the clamp, too: length and force of the free part follow from its two other ends'
    conditions.
    """
    values = []
    for lift in (1e-3, 2e-3):
        run = dr.run_deck(STRIP.format(lift=lift))
        last, contact = run.results.critical[-1], run.results.contact
        assert last.label == "EP" and last.load_factor < -50.0 and contact.count[-1] == 1
        values.append([last.load_factor, contact.start[-1, 0], last.monitors["UP"], last.monitors["d"]])
    load, start, up, shortening = 2.0 * np.array(values[0]) - values[1]
    x = np.array([start, 0.5 * up])

    def misfit(x):
        return elastica(load, *x)[1:3] - [0.1, 0.0]
    for _ in range(4):
        f = misfit(x)
        slope = np.array([(misfit(x + dx) - f) / dx.sum() for dx in np.diag(1e-6 * x)]).T
        x = x - np.linalg.solve(slope, f)
    end = elastica(load, *x)
    # The iteration ends at 1e-9 of the forces, and the extrapolation to no lift multiplies this by 2 + 1.
    assert np.max(np.abs(misfit(x))) < 3e-9 and abs(end[3]) < 1e-2
    tail = (0.5 - x[0]) * (1.0 - load / 1e6)
    dr.assert_close(2.0 * x[1], up, relative=1e-5)
    dr.assert_close(1.0 - 2.0 * (end[0] + tail), shortening, relative=1e-5)


# Edges of tables -------------------------------------------------------------------------------------------------------------------

TABLE = """*HEADING
Strip over the rounded edge of a table: flat, arc and flank
*NODE
1, 0., 0.
2, 1., 0.
*LINE, ELSET=S, NSET=S, TYPE=GE8
1, 2, 24
*BEAM SECTION, ELSET=S, SECTION=STIFFNESS
1e6, 1., , 1.
*BOUNDARY
1, ENCASTRE
*OBSTACLE, NAME=TABLE, TYPE=POLYLINE, RADIUS=0.5
-1., 0.
{edge}
*CONTACT, OBSTACLE=TABLE, NSET=S
*MONITOR, NAME=down
2, U2, -1.
*STEP
*STATIC
{first}
{load}
*STOP
LOAD, ABOVE, {stop!r}
*CONTROLS, POINTS=200
*END STEP
"""


def over_table(edge, load, stop, first):
    return dr.run_deck(TABLE.format(edge=edge, load=load, stop=stop, first=first))


@pytest.mark.parametrize("edge, labels", [("0.6, 0.\n1.2, -1.", ["C+", "C+"]), ("0.4, 0.\n1.0, -0.5", ["C+", "C+"]),
                                          ("0.5, 0.\n1.1, -0.1", ["C+", "C+"]), ("0.8, 0.\n1.4, -2.", ["C+"])])
def test_weight_over_an_edge(edge, labels):
    """Contact passes the joints of flat, arc and flank, and the tip comes down: at weights that increments change nothing about."""
    loads = []
    for weight, first in ((10.0, 0.02), (50.0, 0.02), (50.0, 0.005)):
        run = over_table(edge, f"*DLOAD\nS, GRAV, {weight!r}, 0., -1.", 150.0 / weight, first)
        found = [c for c in run.results.critical if c.label != "EP"]
        assert [c.label for c in found] == labels
        loads.append([weight * c.load_factor for c in found])
    dr.assert_close(loads[1:], [loads[0], loads[0]], relative=1e-7)


def test_the_first_point_over_an_edge():
    """Nodes, however near, are not where the arc begins: the first point has contact spans already, and is that of a beam clamped at
    its end and propped there."""
    propped = 0.5 - 0.5 * np.tan(0.5 * np.arctan2(0.1, 0.6))
    over = 1.0 - propped
    tip = (0.5 * over**2 * propped / 4.0 - propped**3 / 48.0) * over + over**4 / 8.0
    first = 1e-6
    run = over_table("0.5, 0.\n1.1, -0.1", "*DLOAD\nS, GRAV, 10., 0., -1.", first, first)
    dr.assert_close(run.column("down")[-1], 10.0 * first * tip, relative=1e-6)


def test_a_tip_that_touches_the_flank():
    """The span before it keeps its gap: it is straight there, as the flank is, but does not lie on it."""
    run = over_table("0.6, 0.\n1.2, -1.", "*CLOAD\n2, 2, -1.", 40.0, 0.1)
    touch, = [c for c in run.results.critical if c.label == "C+" and c.load_factor > 5.0]
    assert run.results.contact.count[-1] == 3 or np.nanmax(run.results.contact.end[-1]) > 1.0 - 1e-9
    down = run.column("down")
    dr.assert_close(down[-1], down[touch.point - 1], relative=1e-3)


SYMMETRIC = """*HEADING
Clamped column beside one wall, symmetric
*NODE
1, 0., 0.
2, 0.5, 0.
3, 1.0, 0.
*LINE, ELSET=COLUMN, NSET=COLUMN, TYPE=GE8
1, 2, 16
2, 3, 16
*IMPERFECTION, ELSET=COLUMN, SHAPE=CLAMPED
0.0035
*BEAM SECTION, ELSET=COLUMN, SECTION=STIFFNESS
480000.0, 1.0
*BOUNDARY
1, ENCASTRE
3, YSYMM
*OBSTACLE, NAME=WALL, TYPE=LINE
1.0, 0.05, 0., 0.05
*CONTACT, OBSTACLE=WALL, NSET=COLUMN
*MONITOR, NAME=shortening
3, U1, -1.0
*STEP
*STATIC
0.1, 1E-9, 0.003
*CLOAD
3, 1, -39.478417604357434
*STOP
shortening, ABOVE, 0.05
*END STEP
"""


def test_a_line_vanishes_as_the_halves_beside_it_buckle():
    """The line that the point at the middle has become is gone where both halves, 2 pi (EI/P)^(1/2) long, buckle between their
    clamped ends: there equilibria differ by far at one load. The path goes on as they bow, the point pressed, the load as good as
    that.

    The load at the end from 32 elements GE6, its estimated error taken off.
    """
    run = dr.run_deck(SYMMETRIC)
    assert events(run) == ["C+", "BP", "EP"]
    buckled = run.column("shortening") > run.only("BP").monitors["shortening"]
    assert (np.diff(run.column("shortening")) > 0.0).all()
    assert (np.diff(run.column("load_factor")[buckled]) > 0.0).all()
    dr.assert_close(run.load("EP"), 4.068776678043, relative=1e-9)


@dr.release_only
@pytest.mark.parametrize("kind, count", [("GE4", 16), ("GE6", 10), ("GE8", 6)])
@pytest.mark.parametrize("amplitude, gap, slenderness, arc", [(0.0035, 0.05, 200.0, 0.003), (0.0007, 0.01, 50.0, 0.01)])
def test_halves_buckle_on_every_mesh(kind, count, amplitude, gap, slenderness, arc):
    """No mesh of a symmetric column stops where the line is gone, or leads back from there; its bars tell meshes apart.

    The smaller the imperfection, the nearer are the line's end, its halves' buckling and the limit of what Newton's method tells.
    """
    def run(kind, count):
        return dr.run_deck(dr.changed(SYMMETRIC, ("TYPE=GE8\n1, 2, 16\n2, 3, 16", f"TYPE={kind}\n1, 2, {count}\n2, 3, {count}"),
                                      ("\n0.0035\n", f"\n{amplitude!r}\n"), ("480000.0", f"{12.0 * slenderness**2!r}"),
                                      ("0.1, 1E-9, 0.003", f"0.1, 1E-9, {arc!r}"), ("1.0, 0.05, 0., 0.05", f"1.0, {gap!r}, 0., {gap!r}"),
                                      ("shortening, ABOVE, 0.05", "LOAD, ABOVE, 4.03")))
    coarse, fine = run(kind, count), functools.cache(run)("GE8", 20)
    assert events(coarse) == events(fine) == ["C+", "BP", "EP"]
    for label in ("C+", "BP"):
        assert abs(coarse.load(label) - fine.load(label)) <= coarse.only(label).error + fine.only(label).error


PUNCHES = """*HEADING
Beam on a punch that touches it at the start, another one comes down beside it
*NODE
1, 0.0, 0.0
2, 2.0, 0.0
3, 1.0, 0.0
*LINE, ELSET=R, NSET=R, TYPE=GE8
1, 3, 8
3, 2, 8
*BEAM SECTION, ELSET=R, SECTION=STIFFNESS
10000.0, 1.0
*BOUNDARY
1, PINNED
2, PINNED
*OBSTACLE, NAME=LOWER, TYPE=CIRCLE, SIDE=OUTSIDE
0.5, -0.5, 0.5
*CONTACT, OBSTACLE=LOWER, NSET=R
*OBSTACLE, NAME=UPPER, TYPE=CIRCLE, SIDE=OUTSIDE
1.5, 0.52, 0.5
*CONTACT, OBSTACLE=UPPER, NSET=R
*STEP
*STATIC, METHOD=LOAD
{first!r}
*ACCURACY
*OBSTACLE MOTION
UPPER, 0.0, -0.3
*END STEP
"""


@pytest.mark.parametrize("first", [0.04, 0.1, 0.25])
def test_contact_that_begins_in_the_first_increment(first):
    """What touches without a force at the start hides no contact that begins a little later, at 0.02/0.3."""
    run = dr.run_deck(PUNCHES.format(first=first))
    assert events(run)[0] == "C+"
    dr.assert_close(run.results.critical[0].load_factor, 0.02 / 0.3, relative=1e-9)


PRESSED = """*HEADING
Straight column that a little presses to its wall
*NODE
1, 0., 0.
3, 1.0, 0.
*LINE, ELSET=COLUMN, NSET=COLUMN, TYPE=GE8
1, 3{elements}
*BEAM SECTION, ELSET=COLUMN, SECTION=STIFFNESS
1e8, 1.0
*BOUNDARY
1, {end}
3, 2
*OBSTACLE, NAME=WALL, TYPE=LINE
1.0, 0.001, 0., 0.001
*CONTACT, OBSTACLE=WALL, NSET=COLUMN
*MONITOR, NAME=shortening
3, U1, -1.0
*STEP
*ACCURACY, {accuracy}
*STATIC
0.1
*CLOAD
3, 1, {unit!r}
*DLOAD
COLUMN, PY, {across!r}
*STOP
LOAD, ABOVE, {stop!r}
*END STEP
"""


def pressed(across, accuracy, end="PINNED", elements="", stop=24.0):
    return dr.run_deck(PRESSED.format(across=across, accuracy=accuracy, end=end, elements=elements, stop=stop, unit=-math.pi**2))


@pytest.mark.parametrize("accuracy", [1e-3, 1e-5, 1e-6])
def test_what_presses_a_flat_next_to_nothing(accuracy):
    """Where the flat lets go is told as well as any bifurcation, and the mesh made for that.

    With k = P^(1/2) the free parts beside the hinges are pi/k long, and the flat between them, as between clamps, buckles where its k l
    is 2 pi, and twice the root of tan x = x. Slopes and P/EA change that by their squares, 1e-5.
    """
    run = pressed(1e-7, f"TOLERANCE={accuracy}")
    assert events(run) == ["C+", "BP", "BP", "EP"]
    for bifurcation, wave in zip(run.labelled("BP"), (2.0 * math.pi, 2.0 * 4.493409457909064)):
        load = (2.0 + wave / math.pi)**2
        assert bifurcation.error < accuracy * 24.0
        dr.assert_close(bifurcation.load_factor, load, absolute=bifurcation.error + 1e-5 * load)


@pytest.mark.parametrize("accuracy", ["TOLERANCE=1e-3", "TOLERANCE=1e-5", "TOLERANCE=1e-6"])
def test_what_presses_a_flat_does_not_hang_on_the_accuracy(accuracy):
    """A pressed flat has no bifurcation. How much that takes is the same however far iterations go."""
    assert events(pressed(1e-6, accuracy)) == ["C+", "EP"]


@pytest.mark.parametrize("elements", [16, 24, 32])
def test_a_flat_beside_a_span_that_moves_along_itself(elements):
    """The part beside a clamp, 2 pi/k long, may move along itself at next to no cost: its small eigenvalue is not that of the flat,
    which buckles at k L = 5 pi, but for how far what presses it has moved that part."""
    run = pressed(1e-7, "WIDEST=1", "ENCASTRE", f", {elements}", 27.0)
    assert events(run) == ["C+", "BP", "EP"]
    dr.assert_close(run.load("BP"), 25.0, relative=5e-4)


EIGHT = """*HEADING
A clamped column, bent as symmetrically as it is, until its ends meet
*NODE
1, 0., 0.
3, 1., 0.
*LINE, ELSET=COLUMN, TYPE=GE8
1, 3
*IMPERFECTION, ELSET=COLUMN, SHAPE=SINE
-1e-5, 1
-6e-6, 3
*BEAM SECTION, ELSET=COLUMN, SECTION=STIFFNESS
{stiffness}, 1.
*BOUNDARY
1, ENCASTRE
3, YSYMM
*MONITOR, NAME=shortening
3, U1, -1.0
*STEP
*ACCURACY, TOLERANCE={accuracy}
*STATIC
{first}
*CLOAD
3, 1, {unit!r}
*STOP
LOAD, ABOVE, 4.
*END STEP
"""


@pytest.mark.parametrize("stiffness", [2e4, 1e6])
@pytest.mark.parametrize("accuracy, first", [(1e-3, 0.1), (1e-5, 0.05), (1e-5, 0.1), (1e-5, 0.4), (1e-6, 0.1), (1e-6, 0.3)])
def test_meshes_of_a_symmetric_column_are_symmetric(accuracy, first, stiffness):
    """Shares count from the end that is held, and are not symmetric; what they ask for is, or the path swerved past its bifurcation.

    Where both ends are in one place the rod may turn about it: an eight, E(m) = K(m)/2, P = 16 K^2 EI/L^2, less by P/EA or so.
    """
    run = dr.run_deck(EIGHT.format(accuracy=accuracy, first=first, stiffness=stiffness, unit=-4.0 * math.pi**2))
    assert events(run) == ["BP", "EP"]
    load = (2.0 * 2.3210486 / math.pi)**2
    dr.assert_close(run.load("BP"), load, absolute=run.only("BP").error + load * (1e-4 + 4.0 * math.pi**2 * load / stiffness))


STANDING = """*HEADING
Column, clamped at both ends, with a symmetric imperfection between walls
*NODE
1, 0., 0.
2, 1., 0.
*LINE, ELSET=COLUMN, NSET=COLUMN, TYPE=GE8
1, 2{count}
*IMPERFECTION, ELSET=COLUMN, SHAPE=CLAMPED
0.001, 0.
*BEAM SECTION, ELSET=COLUMN, SECTION=STIFFNESS
1E8, 1.
*BOUNDARY
1, ENCASTRE
2, 2
2, 6
*OBSTACLE, NAME=TOP, TYPE=LINE
2., 0.05, -1., 0.05
*CONTACT, OBSTACLE=TOP, NSET=COLUMN
*OBSTACLE, NAME=BOTTOM, TYPE=LINE
-1., -0.05, 2., -0.05
*CONTACT, OBSTACLE=BOTTOM, NSET=COLUMN
*MONITOR, NAME=short
2, U1, -1.
*STEP
{accuracy}*STATIC
0.3, 1E-12, 0.025
*CLOAD
2, 1, -39.47841760435743
*STOP
LOAD, ABOVE, 20.
*END STEP
"""


@pytest.mark.parametrize("count, accuracy", [("", "*ACCURACY, TOLERANCE=1E-4\n"), (", 24", "")])
def test_the_load_stands_where_both_halves_buckle(count, accuracy):
    """Four times the critical load, but for the square of the slopes: the contact has just been a line, and the load hardly changes up
    to the other wall. A mesh made there must not turn the path round."""
    run = dr.run_deck(STANDING.format(count=count, accuracy=accuracy))
    found = [c for c in run.results.critical if c not in run.ways()]
    assert [c.label for c in found] in (["C+", "LP", "C+", "EP"], ["C+", "BP", "C+", "EP"])
    loads = [c.load_factor for c in found]
    assert loads[1] == pytest.approx(4.0, rel=(0.05 * np.pi)**2) and loads[3] == pytest.approx(20.0, rel=1e-9)
    dr.assert_close(loads[:3], [0.98309484, 3.98461403, 4.09064384], relative=1e-5)
    assert (np.diff(run.column("short")) > 0.0).all()

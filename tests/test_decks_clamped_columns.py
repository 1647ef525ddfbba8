"""Clamped columns whose imperfection has a symmetry, beside a wall and between two: free spans that are images of one another buckle
at one load, and contacts that are change at once.

A part of a straight rod between two clamped ends a distance apart buckles at the load that its S-shape has no moments at, (2 pi / l)^2,
whatever the distance. So the two halves beside a point of contact in the middle do at 4 Pcr, where the point becomes a line, too; an
imperfection parts these: with v0 = a/2 (1 - cos 2 pi x), and kl = 2 pi + th for the free parts beside a line of half length s, small
terms leave A th^2 + 2 b th + 2 b k s = 0 with b/A = 2 pi a / (24 (d + a/3)). The line begins at th = -2 b/A, is longest at -b/A, and
gone again at 0, where k = 4 pi and both halves buckle.
"""
import math

import numpy as np
import pytest

import deck_runner as dr

pytestmark = dr.once_in_release

PCR = 4.0 * math.pi**2
EA = 1e8
DECK = """*HEADING
Clamped column beside walls
*NODE
1, 0., 0.
2, 1., 0.
*LINE, ELSET=COLUMN, NSET=COLUMN, TYPE=GE8
1, 2{elements}
*IMPERFECTION, ELSET=COLUMN, SHAPE=CLAMPED
{waves}
*BEAM SECTION, ELSET=COLUMN, SECTION=STIFFNESS
{axial!r}, 1.
*BOUNDARY
1, ENCASTRE
2, 2
2, 6
*OBSTACLE, NAME=TOP, TYPE=LINE
2., {gap!r}, -1., {gap!r}
*CONTACT, OBSTACLE=TOP, NSET=COLUMN
{lower}*MONITOR, NAME=shortening
2, U1, -1.
*STEP
{accuracy}*STATIC
0.3, 1E-12, {largest!r}
*CLOAD
2, 1, {load!r}
*STOP
LOAD, ABOVE, 20.
shortening, ABOVE, {stop!r}
*END STEP
"""
LOWER = """*OBSTACLE, NAME=BOTTOM, TYPE=LINE
-1., {low!r}, 2., {low!r}
*CONTACT, OBSTACLE=BOTTOM, NSET=COLUMN
"""


def column(gap, waves, mesh, between=False, largest=None, stop=0.3):
    """`mesh`: number of elements, or the tolerance asked for."""
    given = mesh.isdigit()
    return dr.run_deck(DECK.format(gap=gap, waves=waves, axial=EA, load=-PCR, largest=largest or 0.5 * gap, stop=stop,
                                   elements=f", {mesh}" if given else "",
                                   lower=LOWER.format(low=-gap) if between else "",
                                   accuracy="" if given else f"*ACCURACY, TOLERANCE={mesh}\n"))


def events(run):
    """Without the bifurcations of contacts that change at once."""
    return [c.label for c in run.results.critical if c not in run.ways()]


def bifurcations(run):
    return [c for c in run.labelled("BP") if c not in run.ways()]


@pytest.mark.parametrize("gap, mesh", [(0.005, "24"), (0.005, "36"), (0.005, "1E-4"), (0.02, "24")])
def test_halves_buckle_as_the_line_between_them_vanishes(gap, mesh):
    """The load stands; what lies beyond is no limit point, and the point is one again."""
    wave = 0.02 * gap
    run = column(gap, f"{wave!r}, 0.", mesh)
    assert events(run) == ["C+", "BP", "EP"]
    buckles, last = run.only("BP"), run.results.critical[-1]
    # To the square of the slopes, and to the strain.
    dr.assert_close(buckles.load_factor, 4.0, relative=math.pi**2 * gap**2 + 4.0 * PCR / EA + buckles.error / 4.0)
    load, contact = run.column("load_factor"), run.results.contact
    length = contact.end[:, 0] - contact.start[:, 0]
    lines = np.flatnonzero(length > 0.0)
    at = buckles.point
    assert np.all(contact.count[run.only("C+").point:] == 1) and np.all(lines < at) and length[at] == 0.0
    b = 2.0 * math.pi * wave / (24.0 * (gap + wave / 3.0))
    # Second order in the imperfection; of the line's lengths those at the points are known.
    dr.assert_close(length[lines].max(), b / (4.0 * math.pi), relative=0.05)
    dr.assert_close(buckles.load_factor - load[lines[0] - 1], 4.0 - 4.0 * (1.0 - b / math.pi)**2, relative=0.05)
    # One half would rather buckle alone.
    assert np.all(run.column("negative_pivots")[at + 1:] == 1)
    assert np.all(np.diff(load[at:]) > -1e-7) and last.load_factor > 4.5


@pytest.mark.parametrize("gap", [0.005, 0.02, 0.05])
@pytest.mark.parametrize("part", [0.01, 0.002])
def test_lines_much_shorter_than_elements(gap, part):
    """The smaller the imperfection, the shorter the line between the halves: its longest length is b/(4 pi), here 4e-5 to 2e-4 of the
    column, and where it vanishes both halves buckle."""
    run = column(gap, f"{part * gap!r}, 0.", "1E-6", stop=0.03)
    assert events(run) == ["C+", "BP", "EP"]
    buckles = run.only("BP")
    dr.assert_close(buckles.load_factor, 4.0, relative=math.pi**2 * gap**2 + 4.0 * PCR / EA + buckles.error / 4.0)
    contact = run.results.contact
    b = 2.0 * math.pi * part / (24.0 * (1.0 + part / 3.0))
    length = (contact.end[:, 0] - contact.start[:, 0])[run.only("C+").point:]
    assert 0.0 < length.max() <= 1.05 * b / (4.0 * math.pi)


@pytest.mark.parametrize("part", [0.01, 1e-4])
def test_pushed_onto_a_wall_with_a_node_in_the_middle(part):
    """Where contact begins the load is that of a mesh with the contact, which may be finer than the one of two elements: what the node in
    the middle of this one errs by is no penetration. The load agrees with that of eight elements, and small deflections shorten the
    column by (pi gap)^2/4 more than P/EA, P = 4 pi^2 but for the imperfection."""
    gap, axial, way = 0.025, 1e4, 0.07
    wave = part * gap
    def pushed(elements):
        text = DECK.format(gap=gap, waves=f"{-wave!r}, 0.", axial=axial, load=-PCR, largest=0.05, stop=0.1, elements=f", {elements}",
                           lower="", accuracy="*ACCURACY, WIDEST=1\n")
        text = dr.changed(text, (f"2., {gap!r}, -1., {gap!r}", f"-1., {-gap!r}, 2., {-gap!r}"), ("*MONITOR", "*BOUNDARY\n2, 1\n*MONITOR"),
                          ("*STATIC\n0.3, 1E-12, 0.05", "*STATIC, METHOD=LOAD\n0.02, , 0.05"),
                          (f"*CLOAD\n2, 1, {-PCR!r}", f"*BOUNDARY\n2, 1, 1, {-way!r}"), ("LOAD, ABOVE, 20.", "LOAD, ABOVE, 0.1"))
        return dr.run_deck(text).only("C+")
    coarse, fine = pushed(2), pushed(8)
    assert abs(coarse.load_factor - fine.load_factor) <= coarse.error + fine.error
    # To the squares of the slopes, of the strain and of the imperfection.
    dr.assert_close(way * coarse.load_factor, (math.pi * gap)**2 / 4.0 * (1.0 - part**2) + PCR * (1.0 - part) / axial,
                    relative=(math.pi * gap)**2 + PCR / axial + part**2)


@pytest.mark.parametrize("gap, mesh, largest", [(0.0005, "1E-4", 2.5e-4), (0.0005, "1E-6", 2.5e-4), (0.0005, "1E-5", 1e-3),
                                                (0.05, "1E-6", 0.025)])
@pytest.mark.parametrize("between", [False, True])
def test_no_limit_point_where_the_load_stands(gap, mesh, largest, between):
    """It is flat to 4e-9: a mesh made for a tolerance has it fall by what it errs by, and finer elements say that it does not."""
    run = column(gap, f"{0.02 * gap!r}, 0.", mesh, between, largest, stop=0.03)
    # Between walls the other one is touched later.
    assert events(run)[:2] == ["C+", "BP"] and set(events(run)[2:]) <= ({"C+", "EP"} if between else {"EP"})
    buckles, = bifurcations(run)
    dr.assert_close(buckles.load_factor, 4.0, relative=math.pi**2 * gap**2 + 4.0 * PCR / EA + buckles.error / 4.0)
    assert np.all(np.diff(run.column("load_factor")[buckles.point:]) > -float(mesh) * 4.0)


NEARLY_PERFECT = """*HEADING
Clamped column beside a wall, with hardly any imperfection
*NODE
1, 0, 0
2, 1, 0
*LINE, ELSET=C, NSET=C
1, 2
*IMPERFECTION, ELSET=C, SHAPE=CLAMPED
1.0000000000000002e-10
*BEAM SECTION, ELSET=C, SECTION=STIFFNESS
10000000000.0, 1
*BOUNDARY
1, ENCASTRE
2, 2
2, 6
*OBSTACLE, NAME=TOP, TYPE=LINE
1, {gap}, 0, {gap}
*CONTACT, OBSTACLE=TOP, NSET=C
*MONITOR, NAME=force, OBSTACLE=TOP
RN
*STEP
*ACCURACY, TOLERANCE=1e-6
*STATIC, METHOD=CYLINDRICAL
{increments}
*CLOAD
2, 1, -39.47841760435743
*LOCATE
LOAD, 3.9
*STOP
LOAD, ABOVE, 8.5
LOAD, BELOW, 0.5
*END STEP
"""


@pytest.mark.parametrize("gap, increments", [("1e-02", "0.5"), ("1e-04", "0.5"), ("1e-05", "0.5, 1e-12, 1.0000000000000002e-06")])
def test_path_does_not_run_back_on_itself(gap, increments):
    """Where the halves buckle, moments decide which are 1E-13 of the load's. The run may end there if it tells so. It does not pass its
    own points once more: the column is straight before it touches the wall, and has the value 3.9 with a force of the wall once."""
    run = dr.run_deck(NEARLY_PERFECT.format(gap=gap, increments=increments), code=None)
    assert len([c for c in run.labelled("UZ") if c.monitors["force"] > 0.0]) == 1
    assert run.code == 2 or run.results.critical[-1].label == "EP"


@pytest.mark.parametrize("gap, mesh", [(0.005, "30"), (0.005, "36"), (0.02, "30"), (0.0005, "1E-6"), (0.005, "1E-4"), (0.005, "1E-5"),
                                       (0.02, "1E-6"), (0.05, "1E-5")])
def test_images_of_one_another(gap, mesh):
    """Between two walls the parts beyond the lines buckle at once, where the load turns: one of two zeros is the limit point's, the other
    a bifurcation. Further on both lines vanish at once, and both free parts touch at once: there the load is least."""
    run = column(gap, f"0., {0.02 * gap!r}", mesh, between=True)
    assert events(run)[:2] == ["BP", "C+"] and sorted(events(run)[2:4]) == ["BP", "LP"] and events(run)[4:] == ["C+", "LP", "EP"]
    first, second = bifurcations(run)
    assert [c.point for c in run.ways()] == [c.point for c in run.labelled("C+")]
    limit, least = run.labelled("LP")
    dr.assert_close(first.load_factor, 1.0, relative=0.02 * math.pi**2 * gap**2 + PCR / EA + 1e-8 + first.error)
    dr.assert_close(second.load_factor, limit.load_factor, relative=1e-9)
    pivots, load = run.column("negative_pivots"), run.column("load_factor")
    top = max(limit.point, second.point)
    touch = run.labelled("C+")[1].point
    assert least.point == touch
    assert np.all(pivots[top + 1:touch] == 2) and np.all(np.diff(load[top:touch]) < 0.0)
    contact = run.results.contact
    two = contact.count == 2
    # Rounding of moments tells ends the less the flatter the load.
    assert np.ptp(contact.start[two, 0] + contact.end[two, 1]) < 1e-6
    assert set(contact.count[:touch - 1]) == {0, 1, 2} and set(contact.count[touch:]) == {4}


def test_the_limit_load_does_not_hang_on_the_mesh():
    """Both bars hold where both events are one."""
    runs = [column(0.005, "0., 0.0001", mesh, between=True) for mesh in ("26", "40")]
    for label in ("LP", "BP"):
        coarse, fine = ([c for c in run.labelled(label) if c not in run.ways()][-1] for run in runs)
        assert abs(coarse.load_factor - fine.load_factor) <= coarse.error + fine.error
        assert coarse.error < 1e-5 * coarse.load_factor


WAVY = """*HEADING
Column with waves of its own between walls
*NODE
1, 0., 0.
2, 1., 0.
*LINE, ELSET=COLUMN, NSET=COLUMN, TYPE=GE8
1, 2{elements}
*IMPERFECTION, ELSET=COLUMN, SHAPE=SINE
-1.34e-4, 4
6.6e-6, 2
*BEAM SECTION, ELSET=COLUMN, SECTION=STIFFNESS
5.3e8, 1.
*BOUNDARY
1, ENCASTRE
2, 2
*OBSTACLE, NAME=TOP, TYPE=LINE
2., 0.00105, -1., 0.00105
*OBSTACLE, NAME=BOTTOM, TYPE=LINE
-1., -0.00312, 2., -0.00312
*CONTACT, OBSTACLE=TOP, NSET=COLUMN
*CONTACT, OBSTACLE=BOTTOM, NSET=COLUMN
*STEP
{accuracy}*STATIC
0.3, 1E-12, 5.2e-4
*CLOAD
2, 1, {load!r}
*STOP
LOAD, ABOVE, 18.4
*END STEP
"""


def test_a_rod_whose_own_curvature_changes_along_it():
    """What a point on it is more curved than its wall changes as it moves, though no moment does. Two of them become one on the way."""
    runs = [dr.run_deck(WAVY.format(elements=elements, accuracy=accuracy, load=-math.pi**2))
            for elements, accuracy in ((", 24", ""), ("", "*ACCURACY, TOLERANCE=1E-6\n"))]
    assert events(runs[0]) == events(runs[1]) == ["C+", "C+", "LP", "C+", "C-", "LP", "C+", "EP"]
    for one, other in zip(*(run.results.critical for run in runs)):
        # Where two points become one there is no estimate.
        if np.isfinite(one.error) and np.isfinite(other.error):
            assert abs(one.load_factor - other.load_factor) <= one.error + other.error


def test_which_of_two_changes_comes_first():
    """After the limit point the column touches the upper wall again 8E-5 of the load before it would leave the lower one: what a mesh
    for 1E-4 errs by has it the other way round, and the end elsewhere by 2.5E-3."""
    text = dr.changed(WAVY, ("-1.34e-4, 4", "-7.737e-6, 4"), ("6.6e-6, 2", "-1.14465e-6, 1"), ("5.3e8, 1.", "315939.17, 1."),
                      ("2, 2\n*OBSTACLE", "2, 2\n2, 6\n*OBSTACLE"), ("2., 0.00105, -1., 0.00105", "2., 0.00047818, -1., 0.00047818"),
                      ("-1., -0.00312, 2., -0.00312", "-1., -0.00047818, 2., -0.00047818"), ("1E-12, 5.2e-4", "1E-12, 2.3909e-4"),
                      ("ABOVE, 18.4", "ABOVE, 20.64"), ("*STEP\n", "*MONITOR, NAME=shortening\n2, U1, -1.\n*STEP\n"))
    given = dr.run_deck(text.format(elements=", 24", accuracy="", load=-math.pi**2))
    run = dr.run_deck(text.format(elements="", accuracy="*ACCURACY, TOLERANCE=1E-4\n", load=-math.pi**2))
    assert events(run) == events(given) == ["C+", "LP", "C+", "LP", "EP"]
    dr.assert_close(run.only("EP").monitors["shortening"], given.only("EP").monitors["shortening"], relative=1e-4)


def test_points_of_a_divided_one_go_apart():
    """Beside a free span of 4E-3 and a gap of 4E-12 curvatures are what a mesh errs by: moments tell where the points go."""
    text = dr.changed(WAVY, ("-1.34e-4, 4", "-8.2186e-9, 3"), ("6.6e-6, 2", "4.32262e-7, 2"), ("5.3e8, 1.", "1.5663e8, 1."),
                      ("1, ENCASTRE\n2, 2\n", "1, PINNED\n2, 2\n2, 6\n"), ("2., 0.00105, -1., 0.00105", "2., 4.48375e-5, -1., 4.48375e-5"),
                      ("-1., -0.00312, 2., -0.00312", "-1., -1.189243e-4, 2., -1.189243e-4"), ("1E-12, 5.2e-4", "1E-12, 2.24188e-5"),
                      ("ABOVE, 18.4", "ABOVE, 11."))
    given = dr.run_deck(text.format(elements=", 24", accuracy="", load=-math.pi**2))
    run = dr.run_deck(text.format(elements="", accuracy="*ACCURACY, TOLERANCE=1E-4\n", load=-math.pi**2))
    assert events(run) == events(given) == ["C+", "LP", "C-", "C+", "LP", "C-", "EP"]
    divides = run.labelled("C-")[1].point
    contact = run.results.contact
    assert np.all(contact.count[divides:] == 2) and np.all(np.diff(contact.start[divides:, 1] - contact.start[divides:, 0]) > 0.0)

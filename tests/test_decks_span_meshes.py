"""Columns against walls on many meshes: what happens, and where, does not hang on them.

Known otherwise: pinned columns by shooting (contact_cases), with which `opening` and `limit` below have been found.
"""
import functools
import math

import numpy as np
import pytest

import deck_runner as dr

COLUMN = """*HEADING
Column against walls
*NODE
1, 0., 0.
3, 1., 0.
*LINE, ELSET=COLUMN, NSET=COLUMN, TYPE=GE8
1, 3{elements}
*IMPERFECTION, ELSET=COLUMN, SHAPE=SINE
{waves}
*BEAM SECTION, ELSET=COLUMN, SECTION=STIFFNESS
200000.0, 1.0
*BOUNDARY
{supports}
*OBSTACLE, NAME=WALL, TYPE=LINE
1., {gap!r}, 0., {gap!r}
*CONTACT, OBSTACLE=WALL, NSET=COLUMN
{lower}*MONITOR, NAME=shortening
3, U1, -1
*MONITOR, NAME=push, OBSTACLE=WALL
RN
*STEP
*STATIC
0.1
*ACCURACY, {accuracy}
*CLOAD
3, 1, {unit!r}
*STOP
LOAD, ABOVE, 20.0
*END STEP
"""
LOWER = """*OBSTACLE, NAME=LOWER, TYPE=LINE
0., {gap!r}, 1., {gap!r}
*CONTACT, OBSTACLE=LOWER, NSET=COLUMN
"""


@functools.cache
def column(ends, gap, shape, tolerance=None, elements=24, walls=1):
    """The imperfection over the gap; on the program's own mesh where a tolerance is asked for."""
    return dr.run_deck(COLUMN.format(
        elements="" if tolerance else f", {elements}", waves="\n".join(f"{a * gap!r}, {n}" for a, n in shape), gap=gap,
        supports="1, PINNED\n3, 2" if ends == "hinged" else "1, ENCASTRE\n3, YSYMM",
        lower=LOWER.format(gap=-gap) if walls == 2 else "",
        accuracy=f"TOLERANCE={tolerance!r}" if tolerance else "WIDEST=1.", unit=-math.pi**2 * (1 if ends == "hinged" else 4)))


def labels(run):
    return [c.label for c in run.results.critical]


def assert_agree(run, other):
    """Events of two meshes, within their bars."""
    assert labels(run) == labels(other)
    for one, two in zip(run.results.critical, other.results.critical):
        assert abs(one.load_factor - two.load_factor) <= one.error + two.error + 1e-9 * abs(two.load_factor), (one, two)


@pytest.mark.parametrize("gap, shape, opening, limit, tolerance", [
    (0.005, ((0.07, 1), (0.06, 2)), 4.87638163543687, 16.804126101722108, 1e-5),
    (0.005, ((0.07, 1), (0.06, 2)), 4.87638163543687, 16.804126101722108, 2e-5),
    (0.005, ((0.07, 1), (0.06, 2)), 4.87638163543687, 16.804126101722108, 1e-4),
    (0.05, ((0.07, 1), (0.02, 2)), 4.785052440207491, 18.62293068348967, 1e-4)])
def test_a_line_lets_go_next_to_its_end(gap, shape, opening, limit, tolerance):
    """The free span that begins there has forces of the square of its length and a gap of the sixth power.

    It grows; that it becomes none is in balance, too, with a line that is pulled. Later the load falls as its end goes on, while the
    column hardly moves, until a contact is lost.
    """
    run = column("hinged", gap, shape, tolerance)
    assert labels(run) == ["C+", "C-", "LP", "C-", "LP", "EP"]
    for event, load in zip(run.results.critical[1:3], (opening, limit)):
        assert abs(event.load_factor - load) <= event.error + 1e-9 * load
        assert event.error <= 20.0 * tolerance
    row, contact = run.labelled("C-")[0].point, run.results.contact
    assert np.all(contact.start[row:row + 3, 1] > contact.end[row:row + 3, 0])


@dr.once_in_release
@pytest.mark.parametrize("gap, tolerance", [(0.005, 1e-5), (0.02, 1e-5), (0.02, 1e-4), (0.05, 2e-5), (0.05, 1e-4)])
def test_a_load_that_turns_as_the_end_of_a_line_goes_on(gap, tolerance):
    """The path goes back next to itself: a mesh errs by more in the load than the column moves by next to the limit point."""
    shape = ((0.07, 1), (0.02, 2))
    fine = column("clamped", gap, shape)
    assert labels(fine) == ["C+", "C-", "LP", "C-", "LP", "C-", "EP"]
    assert_agree(column("clamped", gap, shape, tolerance), fine)


@pytest.mark.parametrize("gap, elements", [(0.02, 32), (0.05, 36)])
def test_no_event_where_only_an_iteration_tells(gap, elements):
    """A span that has just opened is as good as flat: whether its end is more curved than the wall no iteration knows."""
    shape = ((0.07, 1), (0.02, 2))
    assert_agree(column("clamped", gap, shape, elements=elements), column("clamped", gap, shape))


@pytest.mark.parametrize("gap, tolerance", [(0.02, 1e-6), (0.05, 1e-5)])
def test_images_at_a_mirror_lie_down_at_once(gap, tolerance):
    """Two points on the lower wall, at loads that a mesh makes differ by less than the line of the first takes to have a length."""
    run = column("clamped", gap, ((0.05, 1), (-0.02, 3)), tolerance, walls=2)
    assert [c.label for c in run.results.critical if c not in run.ways()] == ["C+", "BP", "C+", "EP"]
    contact = run.results.contact
    assert contact.count[-1] == 3
    length = np.sort((contact.end - contact.start)[-1, :3])
    assert length[0] > 0.0
    dr.assert_close(length[0], length[1], relative=1e-2)

"""The path follower stays on its path, never goes back over it, and locates what it reports.

Shallow arches with all strategies are in test_decks_arches.py; what contact points cannot do yet, in test_decks_spans.py.
"""
import math

import numpy as np
import pytest

import deck_runner as dr


def assert_forward(run):
    """The arc length rises from point to point, over all steps."""
    dr.assert_monotone(run.column("arc_length"), rising=True)


def assert_events_have_a_place(run):
    """A limit point lies between its neighbours, by the arc length, and is the highest or lowest of the three."""
    length, load = run.column("arc_length"), run.column("load_factor")
    for point in run.labelled("LP"):
        row = point.point - 1
        assert 0 < row < len(load) - 1 and length[row - 1] <= length[row] <= length[row + 1]
        around = load[row - 1:row + 2]
        room = 1e-9 * np.max(np.abs(around))
        assert np.all(around <= load[row] + room) or np.all(around >= load[row] - room), f"{around} about a limit point"


def changes_without_event(run, first=0):
    """Rows from which on the number of negative pivots is another one, without a limit point or bifurcation there."""
    pivots = run.column("negative_pivots")
    special = {c.point - 1 for label in ("LP", "BP") for c in run.labelled(label)}
    changes = first + np.flatnonzero(np.diff(pivots[first:]))
    return [int(row) for row in changes if not special & {row, row + 1}]


# Arc length --------------------------------------------------------------------------------------------------------

@pytest.mark.parametrize("method", ["LOAD", "CYLINDRICAL", "LARGEST DISPLACEMENT"])
def test_arc_length_of_a_stretched_rod(method):
    """u = x P/EA at every point of two steps: its norm over the size, with the length of rod at each node as weight."""
    n, size, strain = 4, 2.0, 3e-3
    step = """*STEP
*STATIC, METHOD={method}
{first}
*CLOAD
2, 1, {load}
*LOCATE
LOAD, 0.35, 0.55
*STOP
LOAD, ABOVE, {end}
*END STEP
"""
    run = dr.run_deck(f"""*HEADING
stretched rod
*NODE
1, 0, 0
2, {size}, 0
*LINE, ELSET=E
1, 2, {n}
*BEAM SECTION, ELSET=E, SECTION=STIFFNESS
1000, 1
*BOUNDARY
1, ENCASTRE
*MONITOR, NAME=u
2, U1
""" + step.format(method=method, first=0.1, load=1000 * strain, end=1) +
                      step.format(method=method, first=0.3, load=200 * strain, end=1))
    x = np.arange(n + 1) / n
    weight = np.full(n + 1, 1.0 / n)
    weight[[0, -1]] *= 0.5
    assert len(run.labelled("EP")) == 2 and len(run.labelled("UZ")) == 4
    dr.assert_close(run.column("u")[-1], 1.2 * strain * size, relative=1e-9)
    norm = np.sqrt(np.sum(weight * x**2)) / size
    dr.assert_close(run.column("arc_length"), norm * run.column("u"), relative=1e-9, absolute=1e-15)


# First increments --------------------------------------------------------------------------------------------------

@pytest.mark.parametrize("first", ["10.", "100."])
def test_a_first_increment_far_beyond_buckling(first):
    """10 and 100 Euler loads: the path is that of the deck's own 0.1."""
    run = dr.run_deck(dr.with_static(dr.on_given_mesh("column"), "METHOD=CYLINDRICAL", f"{first}, 1E-12, 0.003"))
    assert [c.label for c in run.results.critical] == ["C+", "LP", "C-", "LP", "EP"]
    dr.assert_close([c.load_factor for c in run.labelled("LP")], [2.484036097, 1.025646944], relative=1e-7)
    assert_forward(run)


@pytest.mark.parametrize("first", ["1E3", "1E6"])
def test_a_first_increment_far_beyond_the_limit_load(first):
    """160 equal GE4: their critical load errs by 4E-6."""
    run = dr.run_deck(dr.changed(dr.on_given_mesh("ring"), ("0., 0., 160, 6.", "0., 0., 160"),
                                 ("\n1., 1E-9, 0.02", f"\n{first}, 1E-9, 0.02"),
                                 ("*LOCATE\nLOAD, 34., 57., 62., 28.\n", ""), ("ABOVE, 0.6", "ABOVE, 0.05")))
    dr.assert_close(run.load("LP"), 81.557427564661, relative=1e-5)


# Load control ------------------------------------------------------------------------------------------------------

SHEET = """*HEADING
Heavy sheet fed horizontally, drooping on a floor (w = 1, EI = 0.01): weight first, then the feeder comes down
*NODE
1, 0., 1.5
2, 2., 1.5
*LINE, ELSET=S, NSET=S, TYPE=GE6
1, 2, 100
*BEAM SECTION, ELSET=S, SECTION=STIFFNESS
1e5, 0.01, , 1.
*BOUNDARY
1, ENCASTRE
*OBSTACLE, NAME=FLOOR, TYPE=LINE
0., -1., 1., -1.
*CONTACT, OBSTACLE=FLOOR, NSET=S
*MONITOR, NAME=V
1, RF2
*STEP, NAME=WEIGHT
*STATIC, METHOD=LOAD
0.02
*DLOAD
S, GRAV, 1., 0., -1.
*END STEP
*STEP, NAME=DOWN
*STATIC, METHOD=LOAD
{increments}
*BOUNDARY
1, 2, 2, -2.1
*LOCATE
LOAD, 0.5
*STOP
LOAD, ABOVE, 0.55
*END STEP
"""


def any_end(text):
    """The run, which is complete or has stopped and says so."""
    try:
        return dr.run_deck(text)
    except AssertionError:
        run = dr.run_deck(text, code=2)
        assert run.results.status.startswith("stopped: ")
        return run


@dr.release_only
@pytest.mark.parametrize("increments", ["0.02", "0.005, 1e-9, 0.01"])
def test_load_control_gives_one_answer(increments):
    """The end of the sheet hangs upright, but for 4e-8, and stands on the floor: as a column it buckles at V = 1.78. A long
    increment meets the path of short ones, which turns there, or tells of a bifurcation: 4e-8 are too little for it to see
    that the path turns.
    """
    run, slow = any_end(SHEET.format(increments=increments)), dr.run_deck(SHEET.format(increments="0.001, 1e-9, 0.002"))
    if run.code == 0 and not run.labelled("BP"):
        dr.assert_close(run.only("UZ").monitors["V"], slow.only("UZ").monitors["V"], relative=1e-6)
    for one in (run, slow):
        assert not changes_without_event(one), "the stability changes without an event"


# Located or not ----------------------------------------------------------------------------------------------------

DEEP = """*HEADING
hinged arch of 215 degrees
*NODE
1, -0.9537169507482269, -0.3007057995042731
2, 0., 1.
3, 0.9537169507482269, -0.3007057995042731
*ARC, ELSET=ARCH, DIRECTION=CLOCKWISE, TYPE={element}
1, 2, 0., 0., {half}
2, 3, 0., 0., {half}
*BEAM SECTION, ELSET=ARCH, SECTION=STIFFNESS
{ea}, 1.
*BOUNDARY
1, PINNED
3, PINNED
*MONITOR, NAME=v
2, U2, -1.
*STEP
*STATIC
0.1
*CLOAD
2, 2, -1.
*STOP
v, ABOVE, 1.3
*END STEP
"""


@pytest.mark.parametrize("element, half, ea", [("GE4", 20, "1e9"), ("GE8", 80, "1e8"), ("GE8", 20, "1e11")])
def test_a_bifurcation_is_located_in_stiff_arches(element, half, ea):
    """Exact for EA = inf: 3.27628214, 9.463109. GE4: c (2 k h)^4 k L of test_decks_arches with k = 1.8 is 9e-6."""
    run = dr.run_deck(DEEP.format(element=element, half=half, ea=ea))
    limit = 1e-5 if element == "GE4" else 1e-6
    point, top = run.only("BP"), run.only("LP")
    assert point.located and top.located
    dr.assert_close(point.load_factor, 3.27628214, relative=limit)
    dr.assert_close(top.load_factor, 9.463109, relative=2.0 * limit)
    assert_events_have_a_place(run)


def test_a_sharp_bend_is_followed():
    """Sway of a column whose head a stiff spring keeps upright; the reaction of a strut from there to a roller is 1e-7 of the load.

    So the path turns into the sway, at cot(k L) = EI k/spring, P = EI k^2; beyond, the upright column is another, unstable path.
    GE4, 4 elements: c (2 k h)^4 k L is 1.4e-4.
    """
    side, young, spring, load = 0.0018731861874, 4.58823962439e+17, 3097904762.16, 670601.749603
    run = dr.run_deck(f"""*HEADING
column with a strut
*NODE
1, 0, 0
2, 0, 1
3, 0.60335828220972365, 0.57953147488339973
*LINE, ELSET=E, NSET=N, TYPE=GE4
1, 2, 4
2, 3, 4
*MATERIAL, NAME=M
*ELASTIC
{young}, 0.0773172143471
*BEAM SECTION, ELSET=E, SECTION=RECT, MATERIAL=M, SHEAR=RIGID
{side}, {side}
*BOUNDARY
1, PINNED
3, 2
*SPRING
2, 6, {spring}
*MONITOR, NAME=SWAY
2, U1
*STEP
*STATIC
0.263015094622
*CONTROLS, POINTS=300
*CLOAD
2, 2, {-load}
*LOCATE
SWAY, -1e-3, 1e-3
*STOP
LOAD, ABOVE, 2
*END STEP
""")
    ei = young * side**4 / 12.0
    low, high = 1.0, 0.5 * math.pi
    for _ in range(60):
        k = 0.5 * (low + high)
        low, high = (k, high) if math.cos(k) > ei * k / spring * math.sin(k) else (low, k)
    assert not run.labelled("BP") and np.all(run.column("negative_pivots") == 0)
    dr.assert_close(run.load("UZ"), ei * k**2 / load, relative=2e-4)


def test_a_located_bifurcation_is_as_exact_as_asked():
    """Euler's column, where the load tells the place: LOCATE is of the load, however long the increment."""
    text = """*HEADING
column
*NODE
1, 0., 0.
2, 1., 0.
*LINE, ELSET=E, TYPE=GE8
1, 2, 16
*BEAM SECTION, ELSET=E, SECTION=STIFFNESS
1e6, 1.
*BOUNDARY
1, PINNED
2, 2
*STEP
*STATIC
{first}, 1e-12, {largest}
*CONTROLS, LOCATE={locate}
*CLOAD
2, 1, -9.869604401089358
*STOP
LOAD, ABOVE, 1.8
*END STEP
"""
    # P (1 - P/EA) = pi^2 EI/L^2
    euler = math.pi**2
    exact = 0.5e6 * (1.0 - math.sqrt(1.0 - 4.0 * euler / 1e6)) / euler
    for locate in (1e-4, 1e-6, 1e-8, 1e-10):
        for first, largest in ((0.3, 0.1), (0.7, 10.0)):
            run = dr.run_deck(text.format(first=first, largest=largest, locate=locate))
            # 1e-9: Newton's tolerance
            dr.assert_close(run.load("BP"), exact, relative=locate + 1e-9)


@pytest.mark.parametrize("method, first", [("LOAD", 1.0), ("LOAD", 0.25), ("CYLINDRICAL", 0.2), ("SPHERICAL", 1.0)])
@pytest.mark.parametrize("locate", [1e-2, 1e-3, 1e-4, 1e-6])
def test_a_value_is_located_as_exactly_as_asked(method, first, locate):
    """The roller of a bent beam moves with the square of the load: at first it hardly does, and the load tells the place.

    The deflection is 1e-3 of the span: the square holds to its square, 1e-6, a tenth of the smallest LOCATE on 0.1 of the load.
    """
    text = """*HEADING
beam on a roller
*NODE
1, 0., 0.
2, 1., 0.
*LINE, ELSET=E, TYPE=GE8
1, 2, 8
*BEAM SECTION, ELSET=E, SECTION=STIFFNESS
1e9, 1.
*BOUNDARY
1, PINNED
2, 2
*MONITOR, NAME=u
2, U1, -1e6
*STEP
*STATIC, METHOD={method}
{first}, 1e-9, 1.
*CONTROLS, LOCATE={locate}
*DLOAD
E, PY, -0.05
{asked}*STOP
LOAD, ABOVE, 1.
*END STEP
"""
    end = dr.run_deck(text.format(method="LOAD", first=1, locate=1e-8, asked="")).column("u")[-1]
    shares = np.arange(1, 40) / 40.0
    asked = "*LOCATE\nu, " + ", ".join(f"{end * share**2:.15g}" for share in shares) + "\n"
    run = dr.run_deck(text.format(method=method, first=first, locate=locate, asked=asked))
    # of the load, but not of less than the increment changes it by
    dr.assert_close([c.load_factor for c in run.labelled("UZ")], shares, absolute=locate)


def test_contacts_are_gained_each_at_its_own_load():
    """Two stops under a beam, both passed within the first increment: w = q x (1 - 2 x^2 + x^3)/24 up to the first, and with its
    spring's force up to the second. GE8 are exact on such a polynomial but for w^2.
    """
    run = dr.run_deck("""*HEADING
beam above two stops
*NODE
1, 0., 0.
2, 0.25, 0.
3, 0.5, 0.
4, 1., 0.
*LINE, ELSET=E, TYPE=GE8
1, 2, 2
2, 3, 2
3, 4, 4
*BEAM SECTION, ELSET=E, SECTION=STIFFNESS
1e6, 1.
*BOUNDARY
1, PINNED
4, 2
*GAP, NAME=MIDDLE, STIFFNESS=40
3, 1e-6
*GAP, NAME=QUARTER
2, 2e-6
*STEP
*STATIC, METHOD=LOAD
1.
*DLOAD
E, PY, -1e-3
*END STEP
""")

    def by_force(x, a):
        """Deflection at x by a unit force at a, x <= a."""
        return x * (1.0 - a) * (1.0 - x**2 - (1.0 - a)**2) / 6.0

    def by_load(x):
        return 1e-3 * x * (1.0 - 2.0 * x**2 + x**3) / 24.0

    spring, middle, quarter = 40.0, 1e-6, 2e-6
    # force of the middle stop, F = spring (load w(1/2) - F b - middle), in 2e-6 = load w(1/4) - F by_force
    share = spring / (1.0 + spring * by_force(0.5, 0.5))
    rate = by_load(0.25) - share * by_load(0.5) * by_force(0.25, 0.5)
    second = (quarter - share * middle * by_force(0.25, 0.5)) / rate
    found = run.labelled("C+")
    assert all(c.located for c in found)
    dr.assert_close([c.load_factor for c in found], [middle / by_load(0.5), second], relative=1e-7)
    assert_forward(run)


@pytest.mark.parametrize("stiffness", [500, 1e5])
def test_a_stop_turns_a_falling_path(stiffness):
    """Half of an arch that snaps onto a stiff spring: the load is least where they touch, and nothing bifurcates.

    One contact that is gained takes a negative pivot exactly where it turns the load: both go by the sign of the compliance
    at the stop.
    """
    x, y = math.sin(0.3), math.cos(0.3)
    run = dr.run_deck(f"""*HEADING
half an arch that snaps onto a stop
*NODE
1, {-x!r}, {y!r}
2, 0., 1.
*ARC, ELSET=ARCH, DIRECTION=CLOCKWISE, TYPE=GE6
1, 2, 0., 0., 20
*BEAM SECTION, ELSET=ARCH, SECTION=STIFFNESS
7500., 1.
*BOUNDARY
1, PINNED
2, XSYMM
*GAP, NAME=STOP, STIFFNESS={stiffness}
2, 0.045
*MONITOR, NAME=v
2, U2, -1.
*STEP
*STATIC
0.1
*CLOAD
2, 2, -0.5
*STOP
LOAD, ABOVE, 25.
*END STEP
""")
    assert not run.labelled("BP")
    contact = run.only("C+")
    assert contact.located
    dr.assert_close(contact.monitors["v"], 0.045, relative=1e-8)
    load, pivots = run.column("load_factor"), run.column("negative_pivots")
    row = contact.point - 1
    dr.assert_close(np.min(load[row - 3:]), load[row], relative=1e-6)
    least = run.labelled("LP")[-1]
    assert least.point == contact.point and least.load_factor == contact.load_factor and least.error == contact.error
    assert pivots[row - 1] == 1 and np.all(pivots[row + 2:] == 0)


@pytest.mark.parametrize("increment", ["1.5e-05", "4.5e-06"])
def test_a_limit_point_at_a_hand_over(increment):
    """L/h = 100, d/L = 1e-4; 2.48626887 with 160 GE8 and any increments. 80 GE6: below 1e-7, as in test_decks_column.

    Nothing bifurcates on the way down to where the contact is lost, though the contact point passes from node to node.
    """
    run = dr.run_deck(f"""*HEADING
column beside a close wall
*NODE
1, 0., 0.
2, 0.5, 0.
3, 1.0, 0.
*LINE, ELSET=COLUMN, NSET=COLUMN, TYPE=GE6
1, 2, 40
2, 3, 40
*IMPERFECTION, ELSET=COLUMN, SHAPE=CLAMPED
7.e-06, 5.25e-06
*BEAM SECTION, ELSET=COLUMN, SECTION=STIFFNESS
120000.0, 1.0
*BOUNDARY
1, ENCASTRE
3, YSYMM
*OBSTACLE, NAME=WALL, TYPE=LINE
1.0, 0.0001, 0., 0.0001
*CONTACT, OBSTACLE=WALL, NSET=COLUMN, POINTS=ALONG
*STEP
*STATIC, METHOD=CYLINDRICAL
0.1, 1E-12, {increment}
*CONTROLS, POINTS=3000
*CLOAD
3, 1, -39.47841760435743
*STOP
LOAD, BELOW, 1.9
*END STEP
""")
    assert [c.label for c in run.results.critical] == ["C+", "LP", "C-", "EP"] and run.only("LP").located
    dr.assert_close(run.load("LP"), 2.48626887, relative=2e-7)
    assert_events_have_a_place(run)
    assert_forward(run)


@dr.release_only
@pytest.mark.parametrize("desired", [10, 15])
def test_the_end_is_located_after_long_increments(desired):
    """k R^4/EI = 1E6, 160 GE4: the limit load is 77.6460 with the 240 of ring-stiffness, errors as on the rigid cavity 4E-6."""
    run = dr.run_deck(f"""*HEADING
ring on a soft wall
*NODE
1, 0., 1.
2, 0., -1.
*ARC, ELSET=RING, NSET=RING, TYPE=GE4
1, 2, 0., 0., 160
*BEAM SECTION, ELSET=RING, SECTION=STIFFNESS
120000., 1.
*BOUNDARY
1, XSYMM
2, XSYMM
*OBSTACLE, NAME=MEDIUM, TYPE=CIRCLE, SIDE=INSIDE, REFERENCE=90., FOUNDATION=WINKLER, MODULUS=1E6
0., 0., 1.
*CONTACT, OBSTACLE=MEDIUM, NSET=RING, POINTS=ALONG
*MONITOR, NAME=v
1, U2, -1.
*STEP
*STATIC, METHOD=CYLINDRICAL
1., 1E-9, 0.02
*CONTROLS, DESIRED={desired}
*DLOAD
RING, PY, -1.
*STOP
v, ABOVE, 0.6
*END STEP
""")
    dr.assert_close(run.load("LP"), 77.6460, relative=1e-5)
    end = run.only("EP")
    assert end.located
    dr.assert_close(end.monitors["v"], 0.6, relative=1e-7)


# No way back -------------------------------------------------------------------------------------------------------

LINER = """*HEADING
Liner in a rigid host, R/t = 50, one lobe (half), gap/R = 0.004
*NODE
1, 0., 1.
2, -0.6427876096865393, 0.766044443118978
3, 0., -1.
*ARC, ELSET=LINER, NSET=LINER
1, 2, 0., 0., 80
2, 3, 0., 0., 60
*BEAM SECTION, ELSET=LINER, SECTION=STIFFNESS
30000, 1.
*BOUNDARY
1, XSYMM
3, XSYMM
*OBSTACLE, NAME=HOST, TYPE=CIRCLE, SIDE=INSIDE, REFERENCE=90.
0., 0.004, 1.004
*CONTACT, OBSTACLE=HOST, NSET=LINER, POINTS=AUTO
*MONITOR, NAME=v
1, U2, -1.
*STEP
*STATIC, METHOD=CYLINDRICAL
0.5, 1E-9, 0.01
*DLOAD
LINER, P, 1.
*CLOAD
1, 2, -0.001
*STOP
v, ABOVE, 0.3
*END STEP
"""
TUBE = """*HEADING
Ring flattened between two rigid plates: quarter ring, plate moves down
*NODE
1, 1., 0.
2, 0., 1.
*ARC, ELSET=RING, NSET=RING, TYPE=GE6
1, 2, 0., 0., 80
*BEAM SECTION, ELSET=RING, SECTION=STIFFNESS
1e7, 1.
*BOUNDARY
1, YSYMM
2, XSYMM
*OBSTACLE, NAME=PLATE, TYPE=LINE
3., 1., -3., 1.
*CONTACT, OBSTACLE=PLATE, NSET=RING
*MONITOR, NAME=F, OBSTACLE=PLATE
RF2, -2.
*STEP
*STATIC, METHOD=SPHERICAL
0.02
*OBSTACLE MOTION
PLATE, 0., -1.
*STOP
LOAD, ABOVE, 0.95
*LOCATE
LOAD, 0.1, 0.3, 0.5, 0.7
*END STEP
"""


def liner(gap, disturbance):
    return dr.changed(LINER, ("0., 0.004, 1.004", f"0., {gap}, {1.0 + gap!r}"), ("1, 2, -0.001", f"1, 2, -{disturbance}"))


@dr.release_only
def test_liner_with_a_gap():
    """The bottom point becomes two at p = 2.207, all below 94 degrees lies down at 7.0389, then comes the limit point."""
    run = dr.run_deck(LINER)
    dr.assert_close(run.load("LP"), 36.277501, relative=1e-6)


@pytest.mark.parametrize("gap, disturbance", [
    (0.002, 0.002), *(pytest.param(*one, marks=dr.release_only) for one in ((0.004, 0.001), (0.006, 0.001), (0.01, 0.0005)))])
def test_a_liner_does_not_go_back(gap, disturbance):
    """The load rises up to one limit point. Where much lies down at once, at one load, element after element does here, at
    loads that the mesh moves by less than 1e-4.
    """
    run = any_end(liner(gap, disturbance))
    limits = run.labelled("LP")
    assert len(limits) <= 1 and all(c.load_factor > 20.0 for c in limits)
    load = run.column("load_factor")[:limits[0].point if limits else None]
    assert np.all(load >= (1.0 - 1e-4) * np.maximum.accumulate(load)), "the path goes back"
    assert_forward(run)


@pytest.mark.parametrize("method", ["SPHERICAL", "LOAD"])
def test_a_tube_does_not_go_back(method):
    """Exact: the force rises with the plate's way, there is no limit point. (Nor is there a bifurcation, but as long as contact acts
    at nodes that depends on where they stand: test_decks_spans.)
    """
    run = any_end(TUBE.replace("SPHERICAL", method))
    assert not run.labelled("LP")
    dr.assert_monotone(run.column("load_factor"), rising=True)
    dr.assert_monotone(run.column("F")[1:], rising=True)
    assert_forward(run)


# A line on a wall -----------------------------------------------------------------------------------------------------

PINNED = """*HEADING
Pinned imperfect column beside a wall, a2/d = 0.02
*NODE
1, 0., 0.
{middle}3, 1.0, 0.
*LINE, ELSET=COLUMN, NSET=COLUMN, TYPE=GE4
{lines}
*IMPERFECTION, ELSET=COLUMN, SHAPE=SINE
0.0014, 1
0.0004, 2
*BEAM SECTION, ELSET=COLUMN, SECTION=STIFFNESS
480000.0, 1.0
*BOUNDARY
1, PINNED
3, 2
*OBSTACLE, NAME=WALL, TYPE=LINE
1.0, 0.02, 0., 0.02
*CONTACT, OBSTACLE=WALL, NSET=COLUMN
*MONITOR, NAME=shortening
3, U1, -1.0
{monitor}*STEP
*STATIC
0.1
*CLOAD
3, 1, -9.869604401089358
*STOP
shortening, ABOVE, {end}
*END STEP
"""


@dr.release_only
def test_a_line_contact_passes_a_node_with_a_monitor():
    """Exact: line contact from P/Pcr = 3.974122318, one line up to 4.804326 (shortening 0.001413); its end passes midspan.

    The load at a shortening of 0.0014 then converges with the fourth order.
    """
    def at_the_end(half):
        run = dr.run_deck(PINNED.format(middle="2, 0.5, 0.\n", lines=f"1, 2, {half}\n2, 3, {half}",
                                        monitor="*MONITOR, NAME=mid\n2, U2\n", end=0.0014))
        assert [c.label for c in run.results.critical] == ["C+", "EP"]
        assert np.max(run.results.contact.count) == 1
        return run.load("EP")

    loads = np.array([at_the_end(half) for half in (20, 40, 80)])
    assert 4.7 < loads[-1] < 4.804326
    dr.assert_order(np.diff(loads), 4.0, below=0.5)


# Tangents ----------------------------------------------------------------------------------------------------------

def slopes(run):
    """Of every monitor over the load: those told, and those of the parabola through a point and its neighbours, away from corners."""
    load, label = run.column("load_factor"), run.column("label")
    smooth = np.flatnonzero((label[:-2] == "") & (label[1:-1] == "") & (label[2:] == "")) + 1
    found = {}
    for name, column in run.results.monitors.items():
        told = column.rate / run.results.path["load_factor"].rate
        step, slope = np.diff(load), np.diff(column.values) / np.diff(load)
        between = (slope[smooth - 1] * step[smooth] + slope[smooth] * step[smooth - 1]) / (step[smooth - 1] + step[smooth])
        found[name] = load[smooth], told[smooth], between
    return found


@dr.release_only
@pytest.mark.parametrize("name, static, first", [("cantilever", "1., 1E-3, 1.", 0.25), ("indenter", "0.04, 1e-6, 0.1", 0.01),
                                                 ("winkler-weight", "0.02, 1e-6, 0.02", 0.02)])
def test_the_rates_of_the_path_are_its_derivatives(name, static, first):
    """Half the increments: differences come four times as near. Forces of contact, of foundations, displacements, rotations.

    Tangents are those of the last iterate, which errs by the root of what the point does: a hundredth at the most.
    """
    errors = []
    for increment in (first, first / 2.0):
        text = dr.changed(dr.on_given_mesh(name), (static, f"{increment}, 1E-6, {increment}"))
        run = dr.run_deck(text.replace("*END STEP", "*CONTROLS, TOLERANCE=1E-13\n*END STEP"), code=None)
        errors.append({monitor: np.max(np.abs(told - between)) / np.max(np.abs(told)) for monitor, (_, told, between) in slopes(run).items()})
        assert len(run.results.monitors) >= 2
    for monitor, error in errors[0].items():
        assert error < 0.1 and errors[1][monitor] < 0.35 * error + 0.01, f"{monitor}: {error}, {errors[1][monitor]}"


def test_a_limit_point_has_a_level_tangent():
    """The load stands still there, the monitor does not; where the path may go on in another direction nothing is told."""
    run = dr.run_deck(dr.example("lee-frame"))
    rate = run.results.path["load_factor"].rate
    row = run.labelled("LP")[0].point - 1
    assert abs(rate[row]) < 1e-6 * np.nanmax(np.abs(rate)) and abs(run.results.monitors["v"].rate[row]) > 0.1
    assert np.isnan(rate[0]) and np.count_nonzero(np.isnan(rate)) == 1

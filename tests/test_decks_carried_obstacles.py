"""Obstacles that a node carries: platens, dies and walls on springs, with contact anywhere along the rod.

Exact are beam theory, the elastica of a ring between plates, and the same scene where the obstacle is moved instead of pushed, or
where the structure has the spring instead of the obstacle: relative to each other they move alike.
"""
import functools
import math

import numpy as np
import pytest

import deck_runner as dr
import test_decks_rolled_rings as rolled

# A cantilever and a wall on a spring ----------------------------------------------------------------------------------

WALL = """*HEADING
Cantilever that comes to a wall on a spring
*NODE
1, 0, 0
2, 1, 0
9, 0.3, -0.5
*LINE, ELSET=BEAM, NSET=BEAM, TYPE=GE8
1, 2
*BEAM SECTION, ELSET=BEAM, SECTION=STIFFNESS
1e8, 1
*BOUNDARY
1, ENCASTRE
9, 1
9, 6
{spring}*OBSTACLE, NAME=WALL, TYPE=LINE, NODE=9
0, -1e-4, 1, -1e-4
*CONTACT, OBSTACLE=WALL, NSET=BEAM{points}
*MONITOR, NAME=tip
2, U2, -1
*MONITOR, NAME=wall
9, U2, -1
*MONITOR, NAME=force, OBSTACLE=WALL
RN
*MONITOR, NAME=support
9, RF2
*STEP
*ACCURACY, TOLERANCE=1e-6
*STATIC, METHOD=LOAD
1e-4, , 2e-4
*CLOAD
2, 2, -1
*STOP
LOAD, ABOVE, 2e-3
*END STEP
"""


@pytest.mark.parametrize("points", ["", ", POINTS=NODES"])
@pytest.mark.parametrize("k", [0.5, 30.0, 1e7])
def test_wall_on_a_spring(k, points):
    """Only the tip touches: it meets 3 EI/L^3 before the wall, and the spring of the wall beside it after that. The error of small
    deflections is their square; a stiff spring is a wall that stays.
    """
    if points:
        run = dr.run_deck(dr.changed(WALL.format(spring=f"*SPRING\n9, 2, {k!r}\n", points=points), ("1, 2\n*BEAM", "1, 2, 8\n*BEAM"),
                                     ("*ACCURACY, TOLERANCE=1e-6\n", "")))
    else:
        run = dr.run_deck(WALL.format(spring=f"*SPRING\n9, 2, {k!r}\n", points=points))
    tip, load = run.column("tip"), run.column("load_factor")
    wall = np.maximum(0.0, (load - 3e-4) / (3.0 + k))
    dr.assert_close(run.load("C+"), 3e-4, relative=1e-6)
    dr.assert_close(run.column("wall"), wall, absolute=1e-9)
    dr.assert_close(run.column("force"), k * wall, absolute=1e-8, relative=1e-6)
    dr.assert_close(run.column("support"), run.column("force"), absolute=1e-12, relative=1e-8)
    dr.assert_close(tip[1:], np.where(load < 3e-4, load / 3.0, 1e-4 + wall)[1:], absolute=1e-9)


def test_a_free_wall_is_told():
    run = dr.run_deck(dr.changed(WALL.format(spring="", points=""), ("*MONITOR, NAME=support\n9, RF2\n", "")), code=2)
    assert "node 9 belongs to no element and can move or turn without resistance" in run.stderr


# A ring between plates ------------------------------------------------------------------------------------------------

RISE = rolled.RISE

PRESS = """*HEADING
Half of a ring between two plates, both carried by nodes, the lower one on a spring
*NODE
1, 0, -1
2, 0, 1
8, 3, -7
9, 0, 1
*ARC, ELSET=RING, NSET=RING, TYPE=GE8
1, 2, 0, 0
*BEAM SECTION, ELSET=RING, SECTION={section}
*BOUNDARY
1, XSYMM
2, XSYMM
8, XSYMM
9, XSYMM
*SPRING
8, 2, 4
*OBSTACLE, NAME=HIGH, TYPE=LINE, NODE=9
1, 1, -1, 1
*OBSTACLE, NAME=LOW, TYPE=LINE, NODE=8
-1, -1, 1, -1
*CONTACT, OBSTACLE=HIGH, NSET=RING
*CONTACT, OBSTACLE=LOW, NSET=RING
*MONITOR, NAME=high
9, U2, -1
*MONITOR, NAME=low
8, U2, -1
*MONITOR, NAME=force, OBSTACLE=LOW
RN, 2
*STEP
*ACCURACY, TOLERANCE=1e-7
*STATIC
0.2, , 0.2
*CLOAD
9, 2, -0.5
*STOP
LOAD, ABOVE, 12
*LOCATE
LOAD, 6, 10
*END STEP
"""


@pytest.mark.parametrize("section", ["STIFFNESS\n1e8, 1", "INEXTENSIBLE\n1"])
def test_ring_between_plates_under_a_force(section):
    """The flattening is 1 - RISE/sqrt(F) once the ring lies on the plates; the spring of the lower one takes half of the force."""
    run = dr.run_deck(PRESS.format(section=section))
    for point, load in zip(run.labelled("UZ"), (6.0, 10.0)):
        dr.assert_close(point.load_factor, load, relative=1e-9)
        dr.assert_close(0.5 * (point.monitors["high"] - point.monitors["low"]), 1.0 - RISE / math.sqrt(load), absolute=3e-7)
        dr.assert_close(point.monitors["low"], load / 8.0, relative=1e-9)
        dr.assert_close(point.monitors["force"], load, relative=1e-9)
    assert not run.labelled("LP") and not run.labelled("BP")


def test_whole_ring_that_may_roll():
    """Clamped at one place of the floor, about which it rolls: no more than the clamp's half, and no bifurcation of it."""
    text = dr.changed(rolled.ring(end=0.7), ("NAME=HIGH, TYPE=LINE", "NAME=HIGH, TYPE=LINE, NODE=9"), ("*ARC", "9, 0, 0\n*ARC"),
                      ("1, ENCASTRE\n", "1, ENCASTRE\n9, XSYMM\n"), ("*STEP", "*MONITOR, NAME=v\n9, U2, -1\n*STEP"))
    before, rest = text.split("*OBSTACLE MOTION")
    text = before.replace("METHOD=LOAD\n0.02", "METHOD=CYLINDRICAL\n0.2") + "*CLOAD\n9, 2, -1\n" + rest[rest.index("*STOP"):]
    run = dr.run_deck(dr.changed(text, ("LOAD, ABOVE, 0.7", "LOAD, ABOVE, 22"), ("LOAD, 0.5, 0.7", "LOAD, 5, 15")))
    for point, load in zip(run.labelled("UZ"), (5.0, 15.0)):
        dr.assert_close(point.monitors["v"], 2.0 * (1.0 - RISE / math.sqrt(load)), absolute=1e-6)
    dr.assert_close(run.load("C+"), (RISE / (1.0 - rolled.FLAT))**2, relative=1e-6)
    assert not run.labelled("BP")


@pytest.mark.parametrize("points", ["NODES", "ALONG"])
def test_press_moved_or_pushed(points):
    """The same deck, as contact at the nodes has errors of its own: a plate moved by a support takes the force that moves it."""
    text = PRESS.format(section="STIFFNESS\n1e4, 1").replace("NSET=RING\n*", f"NSET=RING, POINTS={points}\n*")
    if points == "NODES":
        text = dr.changed(text, ("1, 2, 0, 0\n", "1, 2, 0, 0, 40\n"), ("*ACCURACY, TOLERANCE=1e-7\n", ""))
    text = dr.changed(text, ("LOAD, ABOVE, 12", "LOAD, ABOVE, 6"), ("LOAD, 6, 10", "LOAD, 3"))
    pushed = dr.run_deck(text).only("EP").monitors
    moved = dr.run_deck(dr.changed(text, ("9, XSYMM", "9, ENCASTRE"), ("*STATIC\n0.2, , 0.2", "*STATIC, METHOD=LOAD\n0.05"),
                                   ("*CLOAD\n9, 2, -0.5", f"*BOUNDARY\n9, 2, 2, {-pushed['high']!r}"), ("LOAD, ABOVE, 6", "LOAD, ABOVE, 1"),
                                   ("*LOCATE\nLOAD, 3\n", ""))).only("EP").monitors
    dr.assert_close(pushed["force"], 6.0, relative=1e-8)
    for name in ("force", "low"):
        dr.assert_close(moved[name], pushed[name], relative=2e-6)


# An arch under a platen -----------------------------------------------------------------------------------------------

PLATEN = """*HEADING
Half of a shallow arch under a flat platen that lies on it
*NODE
1, -0.5, 0.
2, 0., 0.1
9, 0., 0.1
*ARC, ELSET=ARCH, NSET=ARCH, TYPE=GE8, DIRECTION=CLOCKWISE
1, 2, 0., -1.2
*BEAM SECTION, ELSET=ARCH, SECTION=STIFFNESS
3600., 1.
*BOUNDARY
1, PINNED
2, XSYMM
{held}
*OBSTACLE, NAME=PLATEN, TYPE=LINE, NODE=9
1, 0.1, -1, 0.1
*CONTACT, OBSTACLE=PLATEN, NSET=ARCH
*MONITOR, NAME=way
9, U2, -1.
*MONITOR, NAME=force, OBSTACLE=PLATEN
RN
{total}*STEP
*ACCURACY, TOLERANCE=1E-6
{load}
*STOP
way, ABOVE, 0.09
*END STEP
"""
TOTAL = "*MONITOR, NAME=total\n9, RF2, -1\n"
BY_FORCE = PLATEN.format(total="", held="9, XSYMM", load="*STATIC\n0.5, 1E-9, 0.01\n*CLOAD\n9, 2, -1")
BY_WAY = PLATEN.format(total=TOTAL, held="9, ENCASTRE",
                       load="*STATIC, METHOD=LOAD\n0.005, , 0.005\n*BOUNDARY\n9, 2, 2, -1\n*TURNING POINTS\ntotal")
BY_MOTION = dr.changed(BY_WAY, ("9, ENCASTRE\n", ""), (", NODE=9", ""), ("*BOUNDARY\n9, 2, 2, -1", "*OBSTACLE MOTION\nPLATEN, 0, -1"),
                       ("9, 0., 0.1\n", ""), ("9, U2, -1.", "2, U2, -1."), (TOTAL, ""),
                       ("\ntotal", "\nforce"))


def test_limit_point_under_a_platen():
    """The largest force is the largest one over the way that a support or the step prescribes. Beyond it one eigenvalue is negative:
    the stiffness of the way is, and with the way fixed none is.
    """
    force, way, motion = (dr.run_deck(text) for text in (BY_FORCE, BY_WAY, BY_MOTION))
    limit = force.only("LP")
    for other, name in ((way, "total"), (motion, "force")):
        turn = other.only("TP")
        dr.assert_close(limit.load_factor, turn.monitors[name], relative=1e-6)
        dr.assert_close(limit.monitors["way"], turn.load_factor, absolute=limit.monitor_errors["way"] + turn.error + 1e-9)
    dr.assert_close(way.column("total"), way.column("force"), absolute=1e-7)
    for run in (way, motion):
        dr.assert_close(run.only("EP").monitors["force"], force.only("EP").load_factor, relative=1e-6)
    pivots = force.column("negative_pivots")
    place = force.column("way")
    assert np.all(pivots == (place > limit.monitors["way"] + 1e-9))
    assert not np.any(way.column("negative_pivots"))


# A round die on an arch -----------------------------------------------------------------------------------------------

ARCH = """*HEADING
Shallow arch under a round die
*NODE
1, -0.5, 0.
4, -0.3, 0.0649110640673518
5, 0.3, 0.0649110640673518
3, 0.5, 0.
9, 7., 5.
*ARC, ELSET=ARCH, TYPE=GE8, DIRECTION=CLOCKWISE
1, 4, 0., -1.2
5, 3, 0., -1.2
*ARC, ELSET=ARCH, NSET=TOP, TYPE=GE8, DIRECTION=CLOCKWISE
4, 5, 0., -1.2
*BEAM SECTION, ELSET=ARCH, SECTION=STIFFNESS
3600., 1.
"""
DIE = """*OBSTACLE, NAME=DIE, TYPE=CIRCLE, SIDE=OUTSIDE{node}
0, 0.3, 0.2
*CONTACT, OBSTACLE=DIE, NSET=TOP
*MONITOR, NAME=force, OBSTACLE=DIE
RF2, -1
"""
DIE_ON_SPRING = ARCH + """*BOUNDARY
1, PINNED
3, PINNED
9, 6
*SPRING
9, 1, {k!r}
""" + DIE.format(node=", NODE=9") + """*MONITOR, NAME=way
9, U2, -1
"""
ARCH_ON_SPRING = ARCH.replace("9, 7., 5.\n", "") + """*BOUNDARY
1, 2
3, 2
*EQUATION
3, 1, 1.
1, 1, -1.
*SPRING
1, 1, {k!r}
""" + DIE.format(node="")
PUSHED = "*STEP\n*ACCURACY, TOLERANCE=1E-6\n*STATIC\n0.5, , 0.01\n*CLOAD\n9, 2, -1\n*STOP\nway, ABOVE, 0.07\n*END STEP\n"
MOVED = """*STEP
*ACCURACY, TOLERANCE=1E-6
*STATIC, METHOD=LOAD
0.005, , 0.005
*OBSTACLE MOTION
DIE, 0, -1
*STOP
LOAD, ABOVE, 0.07
*END STEP
"""


@pytest.mark.parametrize("k", [20.0, 100.0, 1e4])
def test_die_that_slips_aside(k):
    """The arch sways under a die on a spring as an arch on that spring does under a die that cannot slip. The limit point is that of
    the arch under a force at its apex (tests/reference).
    """
    die, arch = dr.run_deck(DIE_ON_SPRING.format(k=k) + PUSHED), dr.run_deck(ARCH_ON_SPRING.format(k=k) + MOVED)
    sway, same = die.only("BP"), arch.only("BP")
    dr.assert_close(sway.load_factor, same.monitors["force"], relative=1e-8)
    dr.assert_close(sway.monitors["way"], same.load_factor, relative=1e-8)
    limit = die.only("LP")
    assert abs(limit.load_factor - 14.7083255434) <= limit.error
    place = die.column("way")
    assert np.all(die.column("negative_pivots") == 1 * (place > sway.monitors["way"] + 1e-9) + (
        place > limit.monitors["way"] + 1e-9))


def test_buckling_under_a_die():
    """Linear buckling at the force 1 is the same, too, in units of the force."""
    def loads(text, step):
        run = dr.run_deck(text + "*STEP\n*STATIC, METHOD=LOAD\n1.\n" + step + "*STEP, NAME=BUCKLE\n*BUCKLE\n1\n" + step.split("*STOP")[0]
                          + "*END STEP\n")
        return run.results.buckling["BUCKLE"].load_factor[0]

    k = 20.0
    pushed = loads(DIE_ON_SPRING.format(k=k), "*CLOAD\n9, 2, -1\n*STOP\nLOAD, ABOVE, 1\n*END STEP\n")
    moved = loads(ARCH_ON_SPRING.format(k=k), "*OBSTACLE MOTION\nDIE, 0, -0.0016\n*STOP\nforce, ABOVE, 1\n*END STEP\n")
    way = [dr.run_deck(DIE_ON_SPRING.format(k=k) + f"*STEP\n*STATIC, METHOD=LOAD\n{end!r}\n*CLOAD\n9, 2, -1\n*STOP\n"
                       f"LOAD, ABOVE, {end!r}\n*END STEP\n").column("way")[-1] for end in (0.99, 1.01)]
    slope = 0.02 / (way[1] - way[0])
    # A central difference of the stiffness; its third derivative is about the stiffness over the square of the rise.
    dr.assert_close(pushed, 0.0016 * moved * slope, relative=1e-5)


# A plate on an arch ---------------------------------------------------------------------------------------------------

PLATE = """*HEADING
Hinged arch, half angle 60 degrees, R = 1, under a flat plate
*NODE
1, ${{-sin(radians(60))}}, -0.5
2, ${{sin(radians(60))}}, -0.5
9, 0, 0
*ARC, ELSET=ARCH, NSET=ARCH, DIRECTION=CLOCKWISE
1, 2, 0, -1
*BEAM SECTION, ELSET=ARCH, SECTION=STIFFNESS
1e5, 1
*BOUNDARY
1, PINNED
2, PINNED
{held}
*OBSTACLE, NAME=PLATE, TYPE=LINE, NODE=9
1, 0, -1, 0
*CONTACT, OBSTACLE=PLATE, NSET=ARCH
*MONITOR, NAME=force, OBSTACLE=PLATE
RF2, -1
*MONITOR, NAME=way
9, U2, -1
*STEP
*ACCURACY, TOLERANCE=1e-5
{load}
*STOP
way, ABOVE, {end}
*END STEP
"""


@dr.release_only
def test_plate_on_an_arch():
    """Arches that lie on the plate buckle away from it, or sway, at the same way under a force as under a prescribed way."""
    pushed = dr.run_deck(PLATE.format(held="9, XSYMM", load="*STATIC\n0.5, , 0.02\n*CLOAD\n9, 2, -1", end=0.26))
    moved = dr.run_deck(PLATE.format(held="9, ENCASTRE", load="*STATIC\n0.01, , 0.02\n*BOUNDARY\n9, 2, 2, -1", end=0.26))
    for one, other in zip(pushed.labelled("BP"), moved.labelled("BP"), strict=True):
        assert abs(one.load_factor - other.monitors["force"]) <= 2.0 * (one.error + other.monitor_errors["force"])
        assert abs(one.monitors["way"] - other.load_factor) <= 2.0 * (one.monitor_errors["way"] + other.error)
    assert len(pushed.labelled("BP")) == 2


# A rod round a disc, under loads --------------------------------------------------------------------------------------

def disc(angle=0.0, mirror=1.0, at=None, section="STIFFNESS\n1e4, 1.", pressure=2.0, tolerance="1E-8", stop="LOAD, ABOVE, 1"):
    """Deck: a cantilever under dead loads, a pressure and a force at its tip bends round a disc on springs; all turned by an angle
    after a reflection in x. With `at`, the way of the disc, the step moves the disc instead.
    """
    c, s = math.cos(angle), math.sin(angle)

    def place(x, y):
        return f"{c * x - s * mirror * y!r}, {s * x + c * mirror * y!r}"

    px, py = place(0.0, -8.0).split(", ")
    qx, qy = place(-1.0, -1.0).split(", ")
    carried = at is None
    return f"""*HEADING
Cantilever round a disc
*NODE
1, 0, 0
2, {place(1, 0)}
3, {place(0.65, 0)}
9, {place(0.1, -1) if carried else place(1, 0)}
*LINE, ELSET=BEAM, NSET=BEAM, TYPE=GE8
1, 3
3, {"2" if carried else "9"}
*BEAM SECTION, ELSET=BEAM, SECTION={section}
*BOUNDARY
1, ENCASTRE
{"9, 6" if carried else "2, ENCASTRE"}
{"*SPRING" if carried else ""}
{"9, 1, 200." if carried else ""}
{"9, 2, 200." if carried else ""}
*OBSTACLE, NAME=DISC, TYPE=CIRCLE, SIDE=OUTSIDE{", NODE=9" if carried else ""}
{place(0.2, -0.801)}, 0.8
*CONTACT, OBSTACLE=DISC, NSET=BEAM
*MONITOR, NAME=ux
{"2" if carried else "9"}, U1
*MONITOR, NAME=uy
{"2" if carried else "9"}, U2
*MONITOR, NAME=mx
3, U1
*MONITOR, NAME=my
3, U2
*MONITOR, NAME=turn
3, UR
*MONITOR, NAME=dx
9, U1
*MONITOR, NAME=dy
9, U2
*MONITOR, NAME=fx, OBSTACLE=DISC
RF1
*MONITOR, NAME=fy, OBSTACLE=DISC
RF2
*CONTACT PRINT, OBSTACLE=DISC
START
END
*STEP
*ACCURACY, TOLERANCE={tolerance}
*STATIC, METHOD=LOAD
0.1
*CLOAD
{"2" if carried else "9"}, 1, {px}
{"2" if carried else "9"}, 2, {py}
*DLOAD
BEAM, PX, {qx}
BEAM, PY, {qy}
BEAM, P, {mirror * pressure!r}
{"" if carried else f"*OBSTACLE MOTION{chr(10)}DISC, {at[0]!r}, {at[1]!r}"}
*STOP
{stop}
*END STEP
""".replace("\n\n", "\n").replace("\n\n", "\n")


def last_region(run):
    """Where the rod lies on the disc at the end."""
    return run.results.contact.regions(run.only("EP").point)[0]


@functools.cache
def end_of(text):
    return dr.run_deck(text).only("EP").monitors


@pytest.mark.parametrize("section", ["STIFFNESS\n1e4, 1.", "INEXTENSIBLE\n1."])
def test_disc_on_springs(section):
    """The springs take the force of the disc, which acts as the disc does that the step has moved by as much. The rod lies on the disc
    under dead loads and a pressure, which the disc carries.
    """
    carried = end_of(disc(section=section))
    for force, way in (("fx", "dx"), ("fy", "dy")):
        dr.assert_close(carried[force], -200.0 * carried[way], absolute=1e-7)
    assert carried["fy"] > 1.0
    lying = last_region(dr.run_deck(disc(section=section)))
    assert lying.end - lying.start > 0.05
    moved = end_of(disc(at=(carried["dx"], carried["dy"]), section=section))
    for name in ("ux", "uy", "fx", "fy"):
        dr.assert_close(moved[name], carried[name], absolute=2e-7)


@pytest.mark.parametrize("angle, mirror", [(0.0, -1.0), (2.0, 1.0), (-0.7, -1.0)])
def test_disc_turned_and_mirrored(angle, mirror):
    upright, turned = end_of(disc()), end_of(disc(angle, mirror))
    c, s = math.cos(angle), math.sin(angle)
    for x, y in (("ux", "uy"), ("dx", "dy"), ("fx", "fy")):
        dr.assert_close(turned[x], c * upright[x] - s * mirror * upright[y], absolute=1e-7)
        dr.assert_close(turned[y], s * upright[x] + c * mirror * upright[y], absolute=1e-7)


@pytest.mark.parametrize("tolerance", ["1E-3", "1E-4", "1E-5"])
def test_bars_round_a_disc(tolerance):
    """Errors of displacements, also of a place that lies on the disc, of forces and of the ends of contact are within their bars."""
    coarse, fine = dr.run_deck(disc(tolerance=tolerance)), dr.run_deck(disc())
    end = coarse.only("EP")
    for name, value in end_of(disc()).items():
        assert abs(end.monitors[name] - value) <= end.monitor_errors[name], name
    one, other = last_region(coarse), last_region(fine)
    assert abs(one.start - other.start) <= one.start_error + other.start_error
    assert abs(one.end - other.end) <= one.end_error + other.end_error


def test_order_and_correction_round_a_disc():
    """Errors of GE4 fall with the fourth power of the length of the elements, and the estimate knows them but for a twentieth. The bar
    is 1.4 times the estimate, and 1.6 times where a body's displacement adds what touchdown points err by.
    """
    exact, errors = end_of(disc()), {}
    for n in (6, 12):
        text = dr.changed(disc(), ("TYPE=GE8", "TYPE=GE4"), ("1, 3\n3, 2\n", f"1, 3, {n}\n3, 2, {n}\n"),
                          ("*ACCURACY, TOLERANCE=1E-8\n", "*ACCURACY, WIDEST=1\n"))
        end = dr.run_deck(text).only("EP")
        errors[n] = {name: end.monitors[name] - value for name, value in exact.items()}
        for name, value in exact.items():
            assert abs(end.monitor_corrected[name] - value) <= 0.05 * abs(errors[n][name]), (n, name)
            assert 1.3 * abs(errors[n][name]) <= end.monitor_errors[name] <= 1.65 * abs(errors[n][name]), (n, name)
    for name in exact:
        dr.assert_order([errors[6][name], errors[12][name]], 4.0)


def test_a_place_on_the_disc_ends_the_step():
    """Where a monitor of a place that lies on the carried disc ends the step, that monitor has its value."""
    fine = dr.run_deck(disc(stop="my, BELOW, -0.165"))
    dr.assert_close(fine.only("EP").monitors["my"], -0.165, absolute=1e-9)
    lying = last_region(fine)
    assert lying.start < 0.65 < lying.end


# A strip that a disc presses into --------------------------------------------------------------------------------------

BRIDGE = """*HEADING
A strip clamped at both ends, into which a force presses a disc on springs, under a dead load and a pressure
*NODE
1, 0, 0
2, 1, 0
9, 0.4, 1
*LINE, ELSET=STRIP, NSET=STRIP, TYPE=GE8
1, 2
*BEAM SECTION, ELSET=STRIP, SECTION=STIFFNESS
2000., 1.
*BOUNDARY
1, ENCASTRE
2, ENCASTRE
9, 6
*SPRING
9, 1, 300.
*OBSTACLE, NAME=DISC, TYPE=CIRCLE, SIDE=OUTSIDE{node}
0.4, -1., 1.
*CONTACT, OBSTACLE=DISC, NSET=STRIP
*MONITOR, NAME=dx
9, U1
*MONITOR, NAME=dy
9, U2
*MONITOR, NAME=fx, OBSTACLE=DISC
RF1
*MONITOR, NAME=fy, OBSTACLE=DISC
RF2
*STEP
*ACCURACY, TOLERANCE=1E-6
*STATIC, METHOD={method}
0.25, , 0.25
*CLOAD
9, 2, 400
*DLOAD
STRIP, PX, 60
STRIP, PY, -20
STRIP, P, {pressure!r}
*STOP
LOAD, ABOVE, 1
*END STEP
"""


def bridged(pressure, at=None):
    """The run, with the disc pushed or, for `at`, moved by the step."""
    text = BRIDGE.format(node=", NODE=9", method="LOAD", pressure=pressure)
    if at is not None:
        text = dr.changed(text, (", NODE=9", ""), ("9, 6\n*SPRING\n9, 1, 300.\n", ""), ("9, 0.4, 1\n", ""),
                          ("*MONITOR, NAME=dx\n9, U1\n*MONITOR, NAME=dy\n9, U2\n", ""),
                          ("*CLOAD\n9, 2, 400\n", f"*OBSTACLE MOTION\nDISC, {at[0]!r}, {at[1]!r}\n"))
    return dr.run_deck(text)


@pytest.mark.parametrize("pressure", [0.0, -100.0, 50.0])
def test_strip_on_a_disc(pressure):
    """It takes the force of the disc, as of one that the step moves by as much; and Newton's method no more iterations, for all forces
    have a potential here.
    """
    carried = bridged(pressure)
    end = carried.only("EP").monitors
    dr.assert_close(end["fy"], 400.0, absolute=1e-6)
    dr.assert_close(end["fx"], -300.0 * end["dx"], absolute=1e-6)
    moved = bridged(pressure, (end["dx"], end["dy"]))
    for name in ("fx", "fy"):
        dr.assert_close(moved.only("EP").monitors[name], end[name], absolute=2e-6)
    assert max(carried.column("iterations")) <= max(moved.column("iterations"))


def test_mode_of_a_strip_on_a_disc():
    """In a buckling mode no place of the strip that lies on the disc moves into it or off it, and the disc moves along."""
    text = BRIDGE.format(node=", NODE=9", method="LOAD", pressure=0.0)
    run = dr.run_deck(dr.changed(text, ("1, 2\n*BEAM", "1, 2, 50\n*BEAM"), ("*ACCURACY, TOLERANCE=1E-6\n", ""),
                                 ("*STOP\nLOAD, ABOVE, 1\n", "*STOP\nLOAD, ABOVE, 1\n*FIELD OUTPUT\nDISPLACEMENT\n"))
                      + "*STEP, NAME=BUCKLING\n*BUCKLE\n1\n*CLOAD\n9, 2, 1\n*END STEP\n")
    mesh, mode = run.results.mesh, run.results.buckling["BUCKLING"].mode[0, :, :2]
    end, carrier = run.only("EP"), int(np.flatnonzero(mesh.node_label == 9)[0])
    moved = run.results.field("displacement", end.point)[:, :2]
    lies = run.results.contact.regions(end.point)[0]
    x = mesh.coordinates[:, 0]
    on = (x > lies.start) & (x < lies.end) & (np.arange(len(x)) != carrier)
    away = mesh.coordinates[on] + moved[on] - (np.array([0.4, -1.0]) + moved[carrier])
    assert np.count_nonzero(on) > 40 and np.linalg.norm(mode[carrier]) > 0.1
    dr.assert_close(np.linalg.norm(away, axis=1), np.ones(len(away)), absolute=1e-9)
    dr.assert_close(np.sum((mode[on] - mode[carrier]) * away, axis=1), np.zeros(len(away)), absolute=1e-7)


# A corner between a wall and a plate ----------------------------------------------------------------------------------

CORNER = """*HEADING
The tip of a bar slides along a fixed slope, pressed down by a plate
*NODE
1, 0, 0
2, 1, 0
9, 1, 1
*LINE, ELSET=BEAM, NSET=BEAM, TYPE=GE8
1, 2, 4
*BEAM SECTION, ELSET=BEAM, SECTION=STIFFNESS
100., 1.
*BOUNDARY
1, ENCASTRE
9, XSYMM
*NSET, NSET=TIP
2
*OBSTACLE, NAME=SLOPE, TYPE=LINE
0.5, -1, 1.5, 1
*CONTACT, OBSTACLE=SLOPE, NSET=TIP
{plate}*MONITOR, NAME=ux
2, U1
*MONITOR, NAME=uy
2, U2
*MONITOR, NAME=slope, OBSTACLE=SLOPE
RN
*STEP
*STATIC, METHOD=LOAD
0.1
*CLOAD
{loaded}, 2, -1
*TEMPERATURE
BEAM, 0.
*STOP
LOAD, ABOVE, 1
*END STEP
"""


def test_corner_of_a_slope_and_a_plate():
    """The tip that touches both goes along the slope under the plate's force as under a force of its own."""
    plate = "*OBSTACLE, NAME=PLATE, TYPE=LINE, NODE=9\n2, 0, 0, 0\n*CONTACT, OBSTACLE=PLATE, NSET=TIP\n"
    text = CORNER.replace("*TEMPERATURE\nBEAM, 0.\n", "")
    pressed = dr.run_deck(text.format(plate=plate, loaded=9)).only("EP").monitors
    alone = dr.run_deck(dr.changed(text.format(plate="", loaded=2), ("9, XSYMM\n", "9, ENCASTRE\n"))).only("EP").monitors
    for name in ("ux", "uy", "slope"):
        dr.assert_close(pressed[name], alone[name], absolute=1e-9)
    assert pressed["slope"] > 0.1


WEDGE = """*HEADING
A bar on a roller pushes a wedge up its guide
*NODE
1, 0, 0
2, 1, 0
9, 2, 0
*LINE, ELSET=BAR, NSET=BAR
1, 2, 4
*BEAM SECTION, ELSET=BAR, SECTION=STIFFNESS
100., 1.
*BOUNDARY
1, ENCASTRE
2, 2
9, 1
9, 6
*NSET, NSET=TIP
2
*SPRING
9, 2, 40.
*OBSTACLE, NAME=WEDGE, TYPE=LINE, NODE=9
{ends}
*CONTACT, OBSTACLE=WEDGE, NSET={set}
*MONITOR, NAME=bar
2, U1
*MONITOR, NAME=wedge
9, U2
*MONITOR, NAME=force, OBSTACLE=WEDGE
RN
*STEP
*STATIC, METHOD=LOAD
5.
*CLOAD
2, 1, 1
*STOP
LOAD, ABOVE, 20
*END STEP
"""


@pytest.mark.parametrize("touching", ["TIP", "BAR"])
@pytest.mark.parametrize("slope", [60.0, 110.0])
def test_wedge(slope, touching):
    """The wedge moves by -u tan(slope), u the displacement of the tip: P = u (EA/L + k tan(slope)^2), exactly, for any u."""
    t = math.radians(slope)
    ends = f"{1.0 - math.cos(t)!r}, {-math.sin(t)!r}, {1.0 + math.cos(t)!r}, {math.sin(t)!r}"
    run = dr.run_deck(WEDGE.format(ends=ends, set=touching))
    u = run.column("load_factor") / (100.0 + 40.0 * math.tan(t)**2)
    dr.assert_close(run.column("bar"), u, absolute=1e-12)
    dr.assert_close(run.column("wedge"), -u * math.tan(t), absolute=1e-12)
    dr.assert_close(run.column("force"), 40.0 * u * abs(math.tan(t) / math.cos(t)), absolute=1e-9)


# Two boards ------------------------------------------------------------------------------------------------------------

BOARDS = """*HEADING
A strip on two boards of one level, one of them on a spring
*NODE
1, 0, 0
3, 0.5, 0
2, 1, 0
9, 3, 3
*LINE, ELSET=STRIP, NSET=LEFT
1, 3
*LINE, ELSET=STRIP, NSET=RIGHT
3, 2
*BEAM SECTION, ELSET=STRIP, SECTION=STIFFNESS
1e4, 1.
*BOUNDARY
1, ENCASTRE
9, XSYMM
*SPRING
9, 2, 2.
*OBSTACLE, NAME=FIXED, TYPE=LINE
-1, 0, 1, 0
*OBSTACLE, NAME=SPRUNG, TYPE=LINE, NODE=9
-1, {level}, 1, {level}
*CONTACT, OBSTACLE=FIXED, NSET=LEFT
*CONTACT, OBSTACLE=SPRUNG, NSET=RIGHT
*MONITOR, NAME=board
9, U2, -1
*MONITOR, NAME=tip
2, U2, -1
*MONITOR, NAME=force, OBSTACLE=SPRUNG
RN
*STEP
*ACCURACY, TOLERANCE=1E-6
*STATIC
0.001, , 0.002
*CLOAD
2, 2, -1
*STOP
LOAD, ABOVE, 0.01
*END STEP
"""


@pytest.mark.parametrize("level", [0.0, -1e-4])
def test_two_boards(level):
    """Boards of one level are no single wall where a node carries one of them. The tip of a clamped beam with a support at its middle
    sinks by 7 P/96 EI, and the board on the spring with it. The error of small deflections is their square.
    """
    run = dr.run_deck(BOARDS.format(level=repr(level)))
    load, tip = run.column("load_factor"), run.column("tip")
    board = np.maximum((load + 96.0 / 7.0 * level) / (96.0 / 7.0 + 2.0), 0.0)
    dr.assert_close(run.column("board"), board, absolute=1e-6)
    dr.assert_close(tip, np.where(board > 0.0, board - level, load * 7.0 / 96.0), absolute=1e-6)
    dr.assert_close(run.column("force"), 2.0 * run.column("board"), absolute=1e-9)


# A die on a beam -------------------------------------------------------------------------------------------------------

TWO_BEAMS = """*HEADING
The tip of a cantilever carries a round die, which presses on a longer one below
*NODE
1, 0, 0.2
2, 1, 0.2
3, 0, 0
4, 1.3, 0
*LINE, ELSET=UPPER
1, 2
*LINE, ELSET=LOWER, NSET=LOWER
3, 4
*BEAM SECTION, ELSET=UPPER, SECTION=STIFFNESS
1e8, {ei!r}
*BEAM SECTION, ELSET=LOWER, SECTION=STIFFNESS
1e8, 1
*BOUNDARY
1, ENCASTRE
3, ENCASTRE
*OBSTACLE, NAME=DIE, TYPE=CIRCLE, SIDE=OUTSIDE, NODE=2
1, 0.05, 0.05
*CONTACT, OBSTACLE=DIE, NSET=LOWER
*MONITOR, NAME=tip
2, U2, -1
*MONITOR, NAME=force, OBSTACLE=DIE
RF2, -1
*STEP
*ACCURACY, TOLERANCE=1E-6
*STATIC, METHOD=LOAD
1e-3, , 1e-3
*CLOAD
2, 2, -1
*STOP
LOAD, ABOVE, 2e-3
*END STEP
"""


@pytest.mark.parametrize("ei", [1.0, 4.0])
def test_die_on_a_beam(ei):
    """A node of a rod may carry an obstacle. Both beams are bent by the tip's way of v = P/(3 EI + 3), the lower one by 3 v of it; the
    die touches it beside its middle by its radius times the slope, 1.5 v, whose part of the force is 3 times that.
    """
    run = dr.run_deck(TWO_BEAMS.format(ei=ei))
    load, tip = run.column("load_factor"), run.column("tip")
    v = load / (3.0 * ei + 3.0)
    dr.assert_close(tip, v, absolute=1e-3 * v[-1])
    dr.assert_close(run.column("force"), 3.0 * v, absolute=1e-2 * v[-1])
    dr.assert_close(run.column("force") + 3.0 * ei * tip, load, relative=1e-5, absolute=1e-12)


# A strip that comes to a disc ------------------------------------------------------------------------------------------

SAG = """*HEADING
A strip that sags onto a disc, which comes up against its spring
*NODE
1, 0, 0
2, 1, 0
9, 0, 0
*LINE, ELSET=STRIP, NSET=STRIP, TYPE={type}
1, 2{elements}
*BEAM SECTION, ELSET=STRIP, SECTION=STIFFNESS
1e4, 1.
*BOUNDARY
1, ENCASTRE
2, ENCASTRE
9, 6
*SPRING
9, 1, 30.
9, 2, 20.
*OBSTACLE, NAME=DISC, TYPE=CIRCLE, SIDE=OUTSIDE, NODE=9
0.47, -0.33, 0.3
*CONTACT, OBSTACLE=DISC, NSET=STRIP
*MONITOR, NAME=dx
9, U1
*MONITOR, NAME=dy
9, U2
*MONITOR, NAME=fx, OBSTACLE=DISC
RF1
*MONITOR, NAME=fy, OBSTACLE=DISC
RF2
*STEP
*ACCURACY, {accuracy}
*STATIC, METHOD=LOAD
0.1, , 0.2
*CLOAD
9, 2, 3
*DLOAD
STRIP, PY, -20
*STOP
LOAD, ABOVE, 1
*END STEP
"""


@pytest.mark.parametrize("elements", [5, 9])
def test_bars_where_contact_begins(elements):
    """The load at which the disc, on its way, meets the strip, its way there, and all numbers at the end: the estimate knows their
    errors but for a twentieth.
    """
    fine = dr.run_deck(SAG.format(type="GE8", elements="", accuracy="TOLERANCE=1E-9"))
    coarse = dr.run_deck(SAG.format(type="GE4", elements=f", {elements}", accuracy="WIDEST=1"))
    for label in ("C+", "EP"):
        one, exact = coarse.only(label), fine.only(label)
        dr.assert_close(one.corrected, exact.load_factor, absolute=0.05 * abs(one.load_factor - exact.load_factor) + 1e-12)
        for name in ("dy",) if label == "C+" else exact.monitors:
            value = exact.monitors[name]
            dr.assert_close(one.monitor_corrected[name], value, absolute=0.05 * abs(one.monitors[name] - value) + 1e-11)

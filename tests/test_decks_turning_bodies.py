"""Obstacles that turn with the node that carries them: levers, cams, rockers and discs about a pin.

Exact are beam theory, the balance of moments about the pin, the same obstacle where the deck puts it turned, and the same scene where
the structure turns about the pin instead of the obstacle.
"""
import functools
import math

import numpy as np
import pytest

import deck_runner as dr
import test_decks_carried_obstacles as carried

# A cantilever on a lever ----------------------------------------------------------------------------------------------

LEVER = """*HEADING
Tip of a cantilever that comes to a lever about a pin, with a rotational spring
*NODE
1, 0, 0
2, 1, 0
9, {pin!r}, -1e-4
*LINE, ELSET=BEAM, NSET=BEAM, TYPE=GE8
1, 2, 8
*BEAM SECTION, ELSET=BEAM, SECTION=STIFFNESS
1e8, 1
*BOUNDARY
1, ENCASTRE
9, PINNED
*SPRING
9, 6, {k!r}
*NSET, NSET=TIP
2
*OBSTACLE, NAME=LEVER, TYPE=LINE, NODE=9
0, -1e-4, 1, -1e-4
*CONTACT, OBSTACLE=LEVER, NSET={touching}
*MONITOR, NAME=tip
2, U2, -1
*MONITOR, NAME=turn
9, UR
*MONITOR, NAME=force, OBSTACLE=LEVER
RN
*MONITOR, NAME=pin
9, RF2
*STEP
*STATIC, METHOD=LOAD
1e-4, , 2e-4
*CLOAD
2, 2, -1
*STOP
LOAD, ABOVE, 2e-3
*END STEP
"""


@pytest.mark.parametrize("touching", ["BEAM", "TIP", "BEAM, POINTS=NODES"])
@pytest.mark.parametrize("pin, k", [(1.5, 0.5), (1.5, 1e6), (1.2, 3.0), (-3.0, 30.0)])
def test_lever(pin, k, touching):
    """The tip meets 3 EI/L^3 before the lever, and k/a^2 beside it after that. The error of small deflections is their square over
    the arm.
    """
    run = dr.run_deck(LEVER.format(pin=pin, k=k, touching=touching))
    load, a = run.column("load_factor"), pin - 1.0
    way = np.maximum(0.0, (load - 3e-4) / (3.0 + k / a**2))
    close = 2.0 * (way[-1] + 1e-4)**2 / abs(a)
    dr.assert_close(run.load("C+"), 3e-4, relative=1e-6)
    dr.assert_close(run.column("turn"), way / a, absolute=close / abs(a))
    dr.assert_close(run.column("force"), k * way / a**2, absolute=(3.0 + k / a**2) * close + 1e-9)
    dr.assert_close(run.column("pin"), run.column("force"), absolute=1e-4 * run.column("force")[-1])
    dr.assert_close(run.column("tip")[1:], np.where(load < 3e-4, load / 3.0, 1e-4 + way)[1:], absolute=close)
    assert run.column("force")[-1] > 1e-5


def test_a_free_lever_is_told():
    text = dr.changed(LEVER.format(pin=1.5, k=1.0, touching="BEAM"), ("*SPRING\n9, 6, 1.0\n", ""))
    assert "node 9 belongs to no element and can move or turn without resistance" in dr.run_deck(text, code=2).stderr


# A rocker on two props ------------------------------------------------------------------------------------------------

ROCKER = """*HEADING
A rocker about a pin presses on two props: at rest until it tips over
*NODE
1, 0.05, -1
2, 0.05, 0
3, 0.15, -1
4, 0.15, 0
9, 0.1, {height!r}
*LINE, ELSET=PROPS, TYPE=GE8
1, 2
3, 4
*BEAM SECTION, ELSET=PROPS, SECTION=STIFFNESS
50., 1e7
*BOUNDARY
1, ENCASTRE
3, ENCASTRE
9, 1
*SPRING
9, 6, 0.1
*NSET, NSET=LEFT
2
*NSET, NSET=RIGHT
4
*OBSTACLE, NAME=ROCKER, TYPE=LINE, NODE=9
1, 0, -1, 0
*CONTACT, OBSTACLE=ROCKER, NSET=LEFT{points}
*CONTACT, OBSTACLE=ROCKER, NSET=RIGHT{points}
*MONITOR, NAME=force, OBSTACLE=ROCKER
RN
*STEP
*STATIC, METHOD=LOAD
0.1, , 0.2
*CLOAD
9, 2, -1.
*STOP
LOAD, ABOVE, 0.1
*END STEP
*STEP, NAME=BUCKLING
*BUCKLE
1
*CLOAD
9, 2, -1.
*END STEP
"""


@pytest.mark.parametrize("points", ["", ", POINTS=NODES"])
@pytest.mark.parametrize("height", [-0.4, -1.5])
def test_rocker(height, points):
    """Each prop yields by 1/s, s = EA/L, at the arm a = 0.05 of a rocker whose pin is h below its surface. Turned by t it has the energy
    s (a tan t)^2 + k t^2/2 - P h/cos t, so it tips over at P = (2 s a^2 + k)/h; linear buckling says so at any force before.
    """
    exact = (2.0 * 50.0 * 0.05**2 + 0.1) / -height
    text = ROCKER.format(height=height, points=points)
    linear = dr.run_deck(text).results.buckling["BUCKLING"].load_factor[0]
    dr.assert_close(linear + 0.1, exact, relative=1e-5)
    run = dr.run_deck(dr.changed(text.split("*STEP, NAME")[0], ("LOAD, ABOVE, 0.1", f"LOAD, ABOVE, {1.3 * exact!r}")))
    tip = run.only("BP")
    dr.assert_close(tip.load_factor, exact, relative=1e-5)
    assert np.all(run.column("negative_pivots") == (run.column("load_factor") > tip.load_factor + 1e-9))


def test_a_rocker_that_hangs():
    """With its pin above the surface it never tips over."""
    run = dr.run_deck(dr.changed(ROCKER.format(height=0.4, points="").split("*STEP, NAME")[0], ("LOAD, ABOVE, 0.1", "LOAD, ABOVE, 3")))
    assert not np.any(run.column("negative_pivots")) and not run.labelled("BP")


# A strip on a plate that hangs -----------------------------------------------------------------------------------------

HANGING = """*HEADING
A strip lies on a plate that hangs from a pin above it
*NODE
1, -0.5, 0
2, 0.5, 0
3, 0, 0
9, 0, 0.4
*LINE, ELSET=STRIP, NSET=STRIP, TYPE=GE8
1, 3
3, 2
*BEAM SECTION, ELSET=STRIP, SECTION={section}
*BOUNDARY
3, 1
9, PINNED
*SPRING
9, 6, 2.
*OBSTACLE, NAME=PLATE, TYPE=LINE, NODE=9
-1, 0, 1, 0
*CONTACT, OBSTACLE=PLATE, NSET=STRIP
*STEP
*STATIC, METHOD=LOAD
1., , 1.5
*DLOAD
STRIP, {load}, -1.
*STOP
LOAD, ABOVE, {end}
*END STEP
*STEP, NAME=BUCKLING
*BUCKLE
1
*DLOAD
STRIP, {load}, -1.
*END STEP
"""


@pytest.mark.parametrize("load, section, ea", [("PY", "STIFFNESS\n100., 1.", 100.0), ("PY", "STIFFNESS\n1e6, 1.", 1e6),
                                               ("P", "STIFFNESS\n1e6, 1.", 1e6)])
def test_strip_on_a_hanging_plate(load, section, ea):
    """Turned by t the plate has the energy k t^2/2 - W h/cos t: it swings out at W = k/h = 5. A strip that stretches by its weight along
    the plate swings out where k = W h + W^2/(12 EA). A pressure pushes normal to the plate beside the pin, by h tan t.
    """
    exact = 6.0 * ea * (math.sqrt(0.16 + 8.0 / (12.0 * ea)) - 0.4)
    run = dr.run_deck(HANGING.format(load=load, section=section, end=7).split("*STEP, NAME")[0])
    # The tangent of a pressure is made symmetric at the free ends: an error of the order of W/EA.
    dr.assert_close(run.load("BP"), exact, relative=1e-7 if load == "PY" else 5.0 / ea)
    assert np.all(run.column("negative_pivots") == (run.column("load_factor") > exact + 1e-5))
    if ea < 1e6:
        return
    linear = dr.run_deck(HANGING.format(load=load, section=section, end=2)).results.buckling["BUCKLING"].load_factor[0]
    dr.assert_close(linear + 2.0, exact, relative=2e-6)


@pytest.mark.parametrize("load", ["PY", "P"])
def test_plate_whose_pin_yields(load):
    """A spring holds the pin in x: a way d of it moves the plate along the strip, whose weight then acts beside the pin. The plate
    swings out at K (k - W h) = W^2.
    """
    text = dr.changed(HANGING.format(load=load, section="STIFFNESS\n1e6, 1.", end=7).split("*STEP, NAME")[0], ("9, PINNED\n*SPRING\n", "9, 2\n*SPRING\n9, 1, 50.\n"))
    dr.assert_close(dr.run_deck(text).load("BP"), -10.0 + math.sqrt(200.0), relative=1e-5)


def test_soft_strip_on_a_swinging_plate():
    """Swung by a couple M: M = k t - W h sin(t)/cos(t)^2 - (W^2/(24 EA)) sin(2 t), for any t, as the strip stretches along the plate. As
    the tangent knows how it does, Newton's method converges quadratically.
    """
    text = dr.changed(HANGING.format(load="PY", section="STIFFNESS\n5., 1.", end=1).split("*STEP, NAME")[0],
                      ("METHOD=LOAD\n1., , 1.5\n", "METHOD=LOAD\n0.25, , 0.25\n*CLOAD\n9, 6, 0.5\n"), ("PY, -1.", "PY, -2."),
                      ("*STEP\n", "*MONITOR, NAME=turn\n9, UR\n*STEP\n"))
    run = dr.run_deck(text)
    turn, load = run.column("turn"), run.column("load_factor")
    weight = 2.0 * load
    dr.assert_close(2.0 * turn - 0.4 * weight * np.sin(turn) / np.cos(turn)**2 - weight**2 / 120.0 * np.sin(2.0 * turn), 0.5 * load, absolute=1e-8)
    assert turn[-1] > 0.4 and max(run.column("iterations")) <= 5


# A cam under a leaf ---------------------------------------------------------------------------------------------------

CAM = dr.example("cam")


def cam(e, mirror=1.0, **more):
    """The shipped deck with another eccentricity; its mirror image with mirror = -1."""
    text = dr.changed(CAM, ("e = 0.2", f"e = {e!r}"), ("0.005, , 0.1", f"{0.02 * e**2!r}, , {0.5 * e!r}"))
    if mirror < 0.0:
        text = dr.changed(text, ("${e}, ${-R}, ${R}", "${-e}, ${-R}, ${R}"), ("9, 6, 1.", "9, 6, -1."), ("9, UR", "9, UR, -1"))
    return dr.run_deck(text)


@pytest.mark.parametrize("e", [0.01, 0.02])
def test_cam_of_small_eccentricity(e):
    """The energy of the leaf is (48 EI/L^3) (e sin t)^2/2 but for e: half of the derivative is the couple, largest at 45 degrees."""
    run = cam(e)
    top, bottom = run.labelled("LP")
    dr.assert_close(top.load_factor, 3.0 * e**2, relative=2.0 * e)
    dr.assert_close(top.monitors["turn"], math.pi / 4.0, absolute=4.0 * e)
    turn = run.column("turn")
    dr.assert_close(run.column("load_factor"), 3.0 * e**2 * np.sin(2.0 * turn), absolute=2.0 * e * 3.0 * e**2)
    dr.assert_close(run.column("force")[1:], 6.0 * e * np.sin(turn[1:]), absolute=2.0 * e * 6.0 * e)


def test_cam_at_any_eccentricity():
    """No couple is left at the dead centre, where the scene is its own mirror image, and what it takes to get there comes back. The couple
    is the derivative of the energy of the leaf, which is there that of the force in the middle of it.
    """
    run = cam(0.2)
    top, bottom = run.labelled("LP")
    centre = run.only("UZ")
    assert abs(centre.load_factor) <= max(centre.error, 1e-9)
    dr.assert_close(bottom.load_factor, -top.load_factor, relative=1e-9)
    dr.assert_close(bottom.monitors["turn"] + top.monitors["turn"], math.pi, absolute=1e-7)
    image = cam(0.2, mirror=-1.0)
    for one, other in zip(run.results.critical, image.results.critical):
        assert one.label == other.label
        dr.assert_close(one.load_factor, other.load_factor, absolute=1e-9)
        dr.assert_close(one.monitors["turn"], other.monitors["turn"], absolute=1e-7)


def test_cam_turned_by_its_support():
    """The support's moment is the couple at the same angle, and it does the work of the leaf: the energy of an elastica, from a deck
    without a cam, in which a force lifts the middle.
    """
    text = dr.changed(CAM, ("9, PINNED\n", "9, ENCASTRE\n"), ("*STATIC\n0.005, , 0.1\n*CLOAD\n9, 6, 1.", "*STATIC, METHOD=LOAD\n"
                      "0.05, , 0.05\n*BOUNDARY\n9, 6, 6, 1."), ("RN\n", "RN\n*MONITOR, NAME=couple\n9, RM\n"))
    held, free = dr.run_deck(text), dr.run_deck(CAM)
    turn = held.column("turn")
    for point in free.labelled("LP"):
        near = np.argsort(np.abs(turn - point.monitors["turn"]))[:6]
        couple = np.polyval(np.polyfit(turn[near] - point.monitors["turn"], held.column("couple")[near], 5), 0.0)
        dr.assert_close(couple, point.load_factor, relative=1e-6)
    assert not np.any(held.column("negative_pivots"))
    lift = 0.2
    pushed = dr.run_deck(f"""*HEADING
The leaf, lifted in the middle
*NODE
1, -1., 0.
2, 1., 0.
3, 0., 0.
*LINE, ELSET=LEAF
1, 3
3, 2
*BEAM SECTION, ELSET=LEAF, SECTION=INEXTENSIBLE
1.
*BOUNDARY
1, 2
2, 2
3, 1
3, 2
*MONITOR, NAME=force
3, RF2
*STEP
*ACCURACY, TOLERANCE=1E-8
*STATIC, METHOD=LOAD
0.01, , 0.01
*BOUNDARY
3, 2, 2, 1.
*STOP
LOAD, ABOVE, {lift}
*END STEP
""")
    def work(run, by, force, end):
        x, y = run.column(by), run.column(force)
        fit = np.polynomial.Polynomial.fit(x[x < end + 1e-9], y[x < end + 1e-9], 16).integ()
        return fit(end) - fit(0.0)

    dr.assert_close(work(held, "turn", "couple", 0.5 * math.pi), work(pushed, "load_factor", "force", lift), relative=1e-7)


# A rod round a disc about a pin ---------------------------------------------------------------------------------------

PIN = "9, PINNED\n*SPRING\n9, 6, 2."
LOOSE = "*SPRING\n9, 1, 200.\n9, 2, 150.\n9, 6, 20."
SPRINGS = "9, 6\n*SPRING\n9, 1, 200.\n9, 2, 200."
def disc(held=PIN, **more):
    """As carried.disc, about a pin, or on three springs."""
    return dr.changed(carried.disc(**more), (SPRINGS, held), ("*MONITOR, NAME=fx", "*MONITOR, NAME=body\n9, UR\n*MONITOR, NAME=fx"),
                      ("METHOD=LOAD\n0.1\n", "METHOD=LOAD\n0.1\n*CONTROLS, TOLERANCE=1E-12\n"))


@functools.cache
def end_of(text):
    return dr.run_deck(text).only("EP").monitors


@pytest.mark.parametrize("section", ["STIFFNESS\n1e4, 1.", "INEXTENSIBLE\n1."])
@pytest.mark.parametrize("held", [PIN, LOOSE])
def test_disc_about_a_pin(held, section):
    """The rod lies on the disc under dead loads and a pressure as on a disc that is where this one has come to; the spring about the pin
    has the moment of the disc's force about its node, as all of that force passes near the disc's centre.
    """
    text = disc(held, section=section)
    end = end_of(text)
    lying = carried.last_region(dr.run_deck(text))
    assert lying.end - lying.start > 0.05 and abs(end["body"]) > 0.01
    turned = place_of((0.2, -0.801), end)
    placed = dr.changed(carried.disc(at=(0.0, 0.0), section=section), ("0.2, -0.801, 0.8", f"{turned[0]!r}, {turned[1]!r}, 0.8"))
    still = end_of(placed)
    for name in ("ux", "uy", "fx", "fy"):
        dr.assert_close(still[name], end[name], absolute=2e-7)
    # Contact without friction pushes along the radius.
    arm = np.array(turned) - np.array([0.1 + end["dx"], -1.0 + end["dy"]])
    dr.assert_close((2.0 if held == PIN else 20.0) * end["body"], -(arm[0] * end["fy"] - arm[1] * end["fx"]), absolute=2e-7)
    if held == LOOSE:
        dr.assert_close(end["fx"], -200.0 * end["dx"], absolute=2e-7)
        dr.assert_close(end["fy"], -150.0 * end["dy"], absolute=2e-7)


def place_of(x, end, pin=(0.1, -1.0)):
    """Where the body's place x is at the end."""
    c, s = math.cos(end["body"]), math.sin(end["body"])
    dx, dy = x[0] - pin[0], x[1] - pin[1]
    return pin[0] + end["dx"] + c * dx - s * dy, pin[1] + end["dy"] + s * dx + c * dy


@pytest.mark.parametrize("angle, mirror", [(0.0, -1.0), (2.0, 1.0), (-0.7, -1.0)])
def test_turned_and_mirrored(angle, mirror):
    upright, turned = end_of(disc()), end_of(disc(angle=angle, mirror=mirror))
    c, s = math.cos(angle), math.sin(angle)
    for x, y in (("ux", "uy"), ("mx", "my"), ("fx", "fy")):
        dr.assert_close(turned[x], c * upright[x] - s * mirror * upright[y], absolute=1e-7)
        dr.assert_close(turned[y], s * upright[x] + c * mirror * upright[y], absolute=1e-7)
    dr.assert_close(turned["body"], mirror * upright["body"], absolute=1e-7)


@pytest.mark.parametrize("held", [PIN, LOOSE])
@pytest.mark.parametrize("tolerance", ["1E-3", "1E-5"])
def test_bars(tolerance, held):
    """Errors of displacements, of a place on the disc, of the body, of forces and of the ends of contact are within the bars of both
    runs.
    """
    coarse, fine = dr.run_deck(disc(held, tolerance=tolerance)), dr.run_deck(disc(held))
    end = coarse.only("EP")
    other = fine.only("EP")
    for name, value in other.monitors.items():
        assert abs(end.monitors[name] - value) <= end.monitor_errors[name] + other.monitor_errors[name], name
    one, other = carried.last_region(coarse), carried.last_region(fine)
    assert abs(one.start - other.start) <= one.start_error + other.start_error
    assert abs(one.end - other.end) <= one.end_error + other.end_error


@pytest.mark.parametrize("held", [PIN, LOOSE])
def test_order_and_correction(held):
    """Errors of GE4 fall with the fourth power of the length of the elements, and the estimate knows them but for a twentieth."""
    fine = dr.run_deck(disc(held)).only("EP")
    exact, errors = fine.monitors, {}
    for n in (8, 16):
        text = dr.changed(disc(held), ("TYPE=GE8", "TYPE=GE4"), ("1, 3\n3, 2\n", f"1, 3, {n}\n3, 2, {n}\n"),
                          ("*ACCURACY, TOLERANCE=1E-8\n", "*ACCURACY, WIDEST=1\n"))
        end = dr.run_deck(text).only("EP")
        errors[n] = {name: end.monitors[name] - value for name, value in exact.items()}
        for name, value in exact.items():
            assert abs(end.monitor_corrected[name] - value) <= 0.05 * abs(errors[n][name]) + fine.monitor_errors[name], (n, name)
    for name in ("ux", "uy", "body", "fx", "fy"):
        dr.assert_order([errors[8][name], errors[16][name]], 4.0)


def test_a_place_on_the_disc():
    """The estimate knows the error of a place inside the rod that lies on the disc, too, and a step ends where such a place is."""
    def text(kind, stop="LOAD, ABOVE, 1"):
        given = dr.changed(disc(stop=stop), ("TYPE=GE8", f"TYPE={kind}"), ("1, 3\n3, 2\n", "1, 2, 20\n"), ("3, 0.65, 0.0\n", ""),
                           ("*ACCURACY, TOLERANCE=1E-8\n", "*ACCURACY, WIDEST=1\n"))
        # *LINE numbers its nodes from 10 on.
        return dr.changed(given, ("3, U1", "22, U1"), ("3, U2", "22, U2"), ("3, UR", "22, UR"))

    fine = dr.run_deck(text("GE8")).only("EP")
    coarse = dr.run_deck(text("GE4"))
    end, lies = coarse.only("EP"), carried.last_region(coarse)
    assert lies.start < 0.65 < lies.end
    for name, value in fine.monitors.items():
        error = abs(end.monitors[name] - value)
        assert error <= end.monitor_errors[name] + fine.monitor_errors[name], name
        assert abs(end.monitor_corrected[name] - value) <= 0.05 * error + fine.monitor_errors[name], name
    there = 0.9 * fine.monitors["my"]
    dr.assert_close(dr.run_deck(text("GE8", f"my, BELOW, {there!r}")).only("EP").monitors["my"], there, absolute=1e-9)


# Bodies of every shape, turned by their support -----------------------------------------------------------------------

SHAPES = """*HEADING
Cantilever on a body that its support turns away, or that the deck has turned
*NODE
1, 0, 0
2, 1, 0
9, -0.2, -0.9
*LINE, ELSET=BEAM, NSET=BEAM, TYPE=GE8
1, 2{elements}
*BEAM SECTION, ELSET=BEAM, SECTION=STIFFNESS
1e4, 1.
*BOUNDARY
1, ENCASTRE
9, ENCASTRE
*OBSTACLE, NAME=BODY, TYPE={shape}
*CONTACT, OBSTACLE=BODY, NSET=BEAM{points}
*MONITOR, NAME=ux
2, U1
*MONITOR, NAME=uy
2, U2
*MONITOR, NAME=fx, OBSTACLE=BODY
RF1
*MONITOR, NAME=fy, OBSTACLE=BODY
RF2
*STEP
{accuracy}*STATIC, METHOD=LOAD
0.1, , 0.2
*CLOAD
2, 2, -6
*DLOAD
BEAM, PX, -1
BEAM, PY, -3
{turn}*STOP
LOAD, ABOVE, 1
*END STEP
"""
PLACES = {
    "LINE": [(0.2, -0.05), (0.9, -0.1)],
    "POLYLINE, RADIUS=0.4": [(-0.2, -0.3), (0.35, -0.02), (1.2, -0.4)],
    "SPLINE": [(0.0, -0.15), (0.25, -0.03), (0.5, -0.04), (0.75, -0.15), (1.0, -0.4)],
}


@pytest.mark.parametrize("points", ["", ", POINTS=NODES"])
@pytest.mark.parametrize("shape", PLACES)
def test_bodies_of_every_shape(shape, points):
    """A body that its support has turned by -0.1 is one that begins there."""
    angle = -0.1
    more = dict(points=points, elements=", 16" if points else "", accuracy="" if points else "*ACCURACY, TOLERANCE=1E-8\n")

    def lines(turn):
        # The left of the sense of the points is the free side.
        at = [place_of(x, {"body": turn, "dx": 0.0, "dy": 0.0}, (-0.2, -0.9)) for x in PLACES[shape]]
        ends = [f"{x!r}, {y!r}" for x, y in at]
        return ", ".join(ends) if shape == "LINE" else "\n".join(ends)

    turned = dr.run_deck(SHAPES.format(shape=f"{shape}, NODE=9\n{lines(0.0)}", turn=f"*BOUNDARY\n9, 6, 6, {angle}\n", **more))
    placed = dr.run_deck(SHAPES.format(shape=f"{shape}\n{lines(angle)}", turn="", **more))
    one, other = turned.only("EP").monitors, placed.only("EP").monitors
    assert other["fy"] > 1.0
    for name in other:
        dr.assert_close(one[name], other[name], absolute=1e-7)


# The structure turns instead ------------------------------------------------------------------------------------------

BENT = """*HEADING
A heated strip bends onto a disc; either the disc turns about a pin, or the strip with its clamp
*NODE
1, 0, 0
2, 1, 0
9, 0.1, -0.5
*LINE, ELSET=STRIP, NSET=STRIP, TYPE=GE8
1, 2, 20
*BEAM SECTION, ELSET=STRIP, SECTION=STIFFNESS
1e4, 1., , , 0.001
*BOUNDARY
{held}
*SPRING
9, 6, 0.7
*OBSTACLE, NAME=DISC, TYPE=CIRCLE, SIDE=OUTSIDE{node}
0.5, -0.55, 0.5
*CONTACT, OBSTACLE=DISC, NSET=STRIP
*MONITOR, NAME=turn
9, UR
*MONITOR, NAME=force, OBSTACLE=DISC
RN
*STEP
*ACCURACY, POINTS=NONE
*STATIC, METHOD=LOAD
0.1, , 0.1
*TEMPERATURE
STRIP, 0., {curvature!r}
*STOP
LOAD, ABOVE, 0.6
*END STEP
"""


def test_structure_turns_instead():
    """Seen from the body it is the same scene, if no load has a direction of its own."""
    body = dr.run_deck(BENT.format(node=", NODE=9", held="1, ENCASTRE\n9, PINNED", curvature=2000.))
    rod = dr.run_deck(dr.changed(BENT.format(node="", held="9, PINNED", curvature=2000.),
                                 ("*BOUNDARY", "*MPC, TYPE=BEAM\n1, 9\n*BOUNDARY"),
                                 ("9, 0.1, -0.5\n", "9, 0.1, -0.5\n3, 0.2, 0\n"), ("1, 2, 20\n*BEAM", "3, 2, 16\n*LINE, ELSET=STRIP, TYPE=GE8\n1, 3, 4\n*BEAM")))
    one, other = body.only("EP").monitors, rod.only("EP").monitors
    assert abs(one["turn"]) > 0.3
    # Convergence of GE8 on twenty elements is far below the tolerance of Newton's method.
    dr.assert_close(one["turn"], -other["turn"], absolute=1e-8)
    dr.assert_close(one["force"], other["force"], relative=1e-7)


def test_the_balance_of_a_body_that_carries_a_couple_alone_is_measured_against_the_couple():
    """Before the cam touches, its couple and the spring in its pin are all the forces there are: their balance is rounding."""
    run = dr.run_deck("""*HEADING
cam on a spring in its pin
*NODE
1, 0, 0
2, 1, 0
9, 0.7, -0.45
*LINE, ELSET=LEAF, NSET=LEAF
1, 2
*BEAM SECTION, ELSET=LEAF, SECTION=STIFFNESS
480000, 1
*BOUNDARY
1, ENCASTRE
9, PINNED
*OBSTACLE, NAME=CAM, TYPE=CIRCLE, SIDE=OUTSIDE, NODE=9
0.56, -0.45, 0.43
*CONTACT, OBSTACLE=CAM, NSET=LEAF
*SPRING
9, 6, 0.75
*STEP
*STATIC, METHOD=LOAD
0.02, , 0.02
*CLOAD
9, 6, -0.87
*STOP
LOAD, ABOVE, 0.3
*END STEP
""")
    assert run.only("C+").load_factor > 0.1
    assert max(run.results.accuracy[name] for name in ("moment_balance", "node_balance")) < 1e-8   # the residual of Newton's method

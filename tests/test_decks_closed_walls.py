"""Closed walls: ellipses and closed splines. A circle said as either gives what CIRCLE gives, wherever the curve begins."""
import math
import re

import pytest

import deck_runner as dr

LINER = """*HEADING
Liner with room in a round host, half of it
*NODE
1, {c}, {s}
2, {mc}, {ms}
*ARC, ELSET=LINER, NSET=LINER
1, 2, 0, 0, 24
*BEAM SECTION, ELSET=LINER, SECTION=STIFFNESS
19200, 1
*BOUNDARY
1, XSYMM
2, ENCASTRE
{host}
*CONTACT, OBSTACLE=HOST, NSET=LINER, GAP={room}, POINTS=ALONG
*MONITOR, NAME=v
1, U2, -1
*STEP
*STATIC
0.5, , 0.005
*DLOAD
LINER, P, 1
*CLOAD
1, 2, -0.002
*STOP
v, ABOVE, 0.08
*END STEP
"""


def liner(host, room=0.0005):
    return dr.run_deck(LINER.format(c=0, s=1, mc=0, ms=-1, host="*OBSTACLE, NAME=HOST, TYPE=" + host, room=room)).only("LP")


def points(n, first):
    return "".join(f"${{cos(2*pi*{i + first}/{n})}}, ${{sin(2*pi*{i + first}/{n})}}\n" for i in range(n))


LIMIT = 47.01187314993       # on one CIRCLE, without its error


@pytest.mark.parametrize("host, room", [("CIRCLE\n0, 0, 1", 0.0005), ("ELLIPSE\n0, 0, 1, 1", 0.0005), ("ELLIPSE\n0, 0, 1.0003, 1.0003, 90", 0.0002)])
def test_ellipse_with_equal_axes_is_a_circle(host, room):
    """The lobe lies on the axis of symmetry, in the last case where the curve begins."""
    point = liner(host, room)
    assert abs(point.corrected - LIMIT) < 1e-10 * LIMIT
    assert point.error < 1e-9


@pytest.mark.parametrize("first", [0.0, 3.0])
def test_closed_spline_tends_to_the_circle(first):
    """The points stand every 12 and every 6 degrees; the error of a quintic spline falls with the sixth power of their distance."""
    error = [abs(liner("SPLINE, ENDS=CLOSED\n" + points(n, first * n / 12)).load_factor - LIMIT) for n in (30, 60)]
    assert error[0] < 1e-4
    assert error[1] < error[0] / 2**5


def arc_points(n, last):
    """Points every 180/n degrees from the top of the circle, anticlockwise."""
    return "".join(f"${{-sin(pi*{i}/{n})}}, ${{cos(pi*{i}/{n})}}\n" for i in range(n * last // 180 + 1))


def test_half_a_wall_and_its_mirror_image():
    """The lobe lies where half a spline begins: with its image it is the closed spline, and tends to the circle as fast."""
    error = []
    for n in 15, 30:
        half = liner("SPLINE, START=180, END=0\n" + arc_points(n, 180))
        assert abs(half.corrected - liner("SPLINE, ENDS=CLOSED\n" + points(2 * n, n / 2)).corrected) < 1e-9 * LIMIT
        error.append(abs(half.load_factor - LIMIT))
    assert error[1] < error[0] / 2**5


def test_quarter_of_a_wall_and_its_images():
    """Mirrors across both axes make a whole wall of a quarter."""
    half, quarter = (liner("SPLINE, START=180, END=" + end + arc_points(30, last)) for end, last in (("0\n", 180), ("270\n", 90)))
    assert abs(half.corrected - quarter.corrected) < 1e-9 * LIMIT


def height_on_heap(given, xs):
    """Where a stiff rod comes to rest on a heap that is symmetric in x = 0."""
    heap = "".join(f"{x}, {math.exp(-0.3 * x * x)!r}\n" for x in xs)
    return dr.run_deck(f"""*HEADING
Rod comes down on a heap
*NODE
1, 0.4, 1.5
2, 0.5, 1.5
*LINE, ELSET=ROD, NSET=ROD
1, 2, 1
*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS
1e9, 1e9
*BOUNDARY
1, 1
1, 6
*SPRING
1, 2, 1
*OBSTACLE, NAME=HEAP, TYPE=SPLINE{given}
{heap}*CONTACT, OBSTACLE=HEAP, NSET=ROD, POINTS=NODES
*MONITOR, NAME=y
1, U2
*STEP
*STATIC, METHOD=LOAD
0.5
*CLOAD
1, 2, -2
*END STEP
""").column("y")[-1]


@pytest.mark.parametrize("given, xs", [("START=0", range(0, 4)), ("END=0", range(-3, 1))])
def test_mirror_at_one_end(given, xs):
    """Half a heap and its image are the spline through all points: also on the side of the image."""
    dr.assert_close(height_on_heap(", " + given, xs), height_on_heap("", range(-3, 4)), absolute=1e-12)


@pytest.mark.parametrize("turn", [0, 37, 180])
def test_whole_ring_passes_where_the_curve_begins(turn):
    """input/ring-full.inp: at first all of the ring lies on the wall, also where the curve begins."""
    deck = dr.example("ring-full")
    line = re.search(r"\*OBSTACLE.*\n.*\n", deck)[0]
    run = dr.run_deck(dr.changed(deck, (line, f"*OBSTACLE, NAME=CAVITY, TYPE=ELLIPSE\n0, 0, 1, 1, {turn}\n"), ("57., 62., 28.", "57."),
                                 ("v, ABOVE, 0.6", "v, ABOVE, 0.1")))
    assert abs(run.only("LP").load_factor - 81.557427564661) < run.only("LP").error
    assert abs(run.column("sway")).max() < 1e-9


def test_oval_liner():
    """input/liner-oval.inp turned by 90 degrees (loads, supports and the axes of host and section with it) gives the same load; without
    ovality it is that of the circle."""
    deck = dr.example("liner-oval")
    oval, round_ = dr.run_deck(deck).only("LP"), dr.run_deck(deck, "--set", "oval=1e-9").only("LP")
    assert abs(round_.load_factor - LIMIT) < round_.error + 1e-7
    turned = dr.changed(deck, ("1, 0, 1\n", "1, -1, 0\n"), ("2, 0, -1\n", "2, 1, 0\n"), ("XSYMM", "YSYMM"), ("1, U2, -1", "1, U1"),
                        ("1, 2, -0.002", "1, 1, 0.002"), ("${1 - oval/2}", "${1 - oval/2}, 90"))
    point = dr.run_deck(turned).only("LP")
    assert abs(point.load_factor - oval.load_factor) < point.error + oval.error


@pytest.mark.parametrize("side, start, sign", [("INSIDE", 0.3, 1), ("OUTSIDE", 2.5, -1)])
def test_side_of_an_ellipse(side, start, sign):
    """A stiff rod is pushed to the end of the long axis, at 2, from inside and from outside."""
    run = dr.run_deck(f"""*HEADING
Rod in or beside an ellipse
*NODE
1, {start}, 0
2, {start + 0.1}, 0
*LINE, ELSET=ROD, NSET=ROD
1, 2, 1
*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS
1e9, 1e9
*BOUNDARY
1, 2, 6
*SPRING
1, 1, 1
*OBSTACLE, NAME=WALL, TYPE=ELLIPSE, SIDE={side}
0, 0, 1, 2, 90
*CONTACT, OBSTACLE=WALL, NSET=ROD, POINTS=NODES
*MONITOR, NAME=x
{2 if sign > 0 else 1}, U1
*STEP
*STATIC, METHOD=LOAD
0.5
*CLOAD
1, 1, {4 * sign}
*END STEP
""")
    dr.assert_close(run.column("x")[-1], 2.0 - (start + 0.1 if sign > 0 else start), absolute=1e-8)


@pytest.mark.parametrize("sides, first", [(8, 0.5), (8, 0.0), (5, 0.3)])
def test_wall_of_arcs_is_a_circle(sides, first):
    """Corners of radius 1 that fill a polygon around the circle: its joints, one of them at the lobe, are no joints at all."""
    half = math.pi / sides
    wall = "".join(f"{math.cos(2 * half * (i + first)) / math.cos(half)!r}, {math.sin(2 * half * (i + first)) / math.cos(half)!r}, 1\n"
                   for i in range(sides))
    assert abs(liner("POLYLINE, ENDS=CLOSED\n" + wall).corrected - LIMIT) < 1e-10 * LIMIT


def oval_of_arcs(turned, elements):
    """A liner in an oval of four arcs of 90 degrees, of radii 1.05 and 0.95, along the same arcs."""
    crown, side = 1.05, 0.95
    c = (crown - side) / math.sqrt(2)
    joint, corner = c + side / math.sqrt(2), c + side * math.sqrt(2)

    def at(x, y):
        return f"{-y!r}, {x!r}" if turned else f"{x!r}, {y!r}"
    nodes = [at(0, crown - c), at(-joint, side / math.sqrt(2)), at(-joint, -side / math.sqrt(2)), at(0, c - crown)]
    arcs = "".join(f"{i}, {i + 1}, {at(*centre)}{elements}\n" for i, centre in ((1, (0, -c)), (2, (-c, 0)), (3, (0, c))))
    wall = "".join(f"{at(x * corner, y * corner)}, {radius}\n" for x, y, radius in ((1, 0, side), (0, 1, crown), (-1, 0, side), (0, -1, crown)))
    deck = dr.changed(LINER.format(c=0, s=1, mc=0, ms=-1, host="*OBSTACLE, NAME=HOST, TYPE=POLYLINE, ENDS=CLOSED\n" + wall.strip(), room=0.0005),
                      ("1, 0, 1\n2, 0, -1\n", "".join(f"{i + 1}, {node}\n" for i, node in enumerate(nodes))),
                      ("1, 2, 0, 0, 24\n", arcs), ("2, ENCASTRE", "4, ENCASTRE"), ("ALONG", "NODES"))
    if turned:
        deck = dr.changed(deck, ("XSYMM", "YSYMM"), ("1, U2, -1", "1, U1"), ("1, 2, -0.002", "1, 1, 0.002"))
    return dr.run_deck(deck).only("LP")


@dr.once_in_release
def test_oval_of_arcs():
    """Contact at nodes, which passes the joints where the curvature jumps: turned by 90 degrees the same, and nearly on half as many elements."""
    upright, lying, coarse = (oval_of_arcs(turned, f", {elements}") for turned, elements in ((False, 130), (True, 130), (False, 65)))
    assert upright.load_factor < 0.97 * LIMIT
    assert abs(upright.load_factor - lying.load_factor) < 1e-8 * lying.load_factor
    assert abs(upright.load_factor - coarse.load_factor) < 2e-3 * upright.load_factor

"""Hinges, springs between nodes, ties, linear equations, rigid links and rods that cannot stretch, against closed forms."""
import math

import numpy as np
import pytest

import deck_runner as dr


def root(f, low, high):
    """Where f changes its sign, by bisection to the last bit."""
    negative = f(low) < 0
    for _ in range(200):
        middle = 0.5 * (low + high)
        if (f(middle) < 0) == negative:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def within_bar(critical, exact, slack=0.0):
    """The load factor is as near to the exact one as the run says; where it does not know, to 1e-6 (order 8, 4 elements a wave)."""
    error = critical.error if math.isfinite(critical.error) else 1e-6 * abs(exact)
    dr.assert_close(critical.load_factor, exact, absolute=error + slack * abs(exact))


# Three-hinged arch -----------------------------------------------------------------------------------------------


def test_three_hinged_arch():
    """Straight members under end forces are exact elements: the path P = 2 N y/l, its limit points and the members' buckling."""
    run = dr.run_deck(dr.on_given_mesh("three-hinged-arch"))
    ea, half = 1000.0, math.sqrt(0.75)

    def load(y):
        length = np.hypot(half, y)
        return 2 * ea * (1 - length) * y / length

    height = 0.5 - run.column("v")
    dr.assert_close(run.column("load_factor"), load(height), absolute=1e-7)
    # The members turn on their own, as rigid bars would.
    turn = np.arctan2(height, half) - math.radians(30)
    dr.assert_close(run.column("left"), turn, absolute=1e-9)
    dr.assert_close(run.column("right"), -turn, absolute=1e-9)
    longest = 0.75 ** (1 / 3)
    top = load(math.sqrt(longest**2 - 0.75))
    dr.assert_close([c.load_factor for c in run.labelled("LP")], [top, -top], relative=1e-10)
    force = root(lambda n: n * (1 - n / ea) - math.pi**2, 5, 20)
    length = 1 - force / ea
    buckles = 2 * force * math.sqrt(length**2 - 0.75) / length
    first = run.labelled("BP")[0]
    within_bar(first, buckles, slack=1e-8)
    assert first.note == "bifurcation, double"


# Roorda's frame --------------------------------------------------------------------------------------------------


def column_stiffness(p):
    """End moment over end rotation of a hinged column of length and EI 1 under p."""
    u = math.sqrt(p)
    return p / (1 - u / math.tan(u))


ROORDA = root(lambda p: column_stiffness(p) + 3, 11, 16)


def rate_of(f, at, step=1e-5):
    return (f(at + step) - f(at - step)) / (2 * step)


def roorda_slope():
    """Rate of the load over the buckling load with the corner's rotation t (anticlockwise), L = EI = 1; Koiter's 0.3805.

    To first order the beam's end moment is 3 t, so its corner is pushed up and the column down by 3 t; the column's is -3 t, so the
    beam is pressed by 3 t. To second order rods shorten by e t^2, which turns the chord of the other one: that of the column by
    -e_b t^2, that of the beam by e_c t^2. Moments at the corner, k(P + dP + 3 t) (t + e_b t^2) + b(3 t) (t - e_c t^2) = 0, with
    k = -3 and b(h) = 3 - h/5 of a beam under small compression h, give dP/t.
    """
    u = math.sqrt(ROORDA)
    x = (np.arange(20000) + 0.5) / 20000
    e_c = 0.5 * np.mean((3 / ROORDA * (u * np.cos(u * x) / math.sin(u) - 1)) ** 2)
    e_b = 0.5 * np.mean((0.5 * (3 * x**2 - 1)) ** 2)
    k_rate = rate_of(column_stiffness, ROORDA)
    return -(3 * k_rate - 3 * e_b - 3 * 0.2 - 3 * e_c) / k_rate / ROORDA


def test_roorda_frame():
    """The buckling load, and the slope of the buckled path at it: a parabola through the bifurcation and both branches."""
    dr.assert_close(roorda_slope(), -0.3805, absolute=5e-5)
    run = dr.run_deck(dr.on_given_mesh("roorda-frame"))
    within_bar(run.labelled("BP")[0], ROORDA)
    turn, load = [0.0], [1.0]
    for branch in run.results.branches.values():
        turn += list(branch.column("turn").values[1:5])
        load += list(branch.column("load_factor").values[1:5] / ROORDA)
    assert min(turn) < -0.005 and max(turn) > 0.005 and max(np.abs(turn)) < 0.05
    # The third power of rotations up to 0.05, not fitted, is 1e-4 of what the slope makes.
    slope = np.polyfit(turn, load, 4)[3]
    dr.assert_close(slope, roorda_slope(), relative=1e-4)


def roorda_limit(moment):
    """Limit load of Roorda's frame with a moment on the corner that turns it the way its load falls."""
    text = dr.changed(
        dr.on_given_mesh("roorda-frame"),
        ("METHOD=LOAD\n2., 1E-6, 2.\n*CLOAD\n2, 2, -1.\n*STOP", f"METHOD=LOAD\n1.\n*CLOAD\n2, 6, {moment}\n*END STEP\n*STEP\n"
         "*STATIC, METHOD=SPHERICAL\n1., , 0.05\n*CLOAD\n2, 2, -1.\n*STOP"),
        ("*BRANCH, NAME=BUCKLED, INCREMENT=0.001\nturn, ABOVE, 0.3\nturn, BELOW, -0.3\n", ""),
        ("LOAD, ABOVE, 15.", "turn, ABOVE, 0.3"),
    )
    return dr.run_deck(text).load("LP")


def test_roorda_imperfection():
    """Half-power law of asymmetric bifurcation: (dP - slope P t) k' t + moment = 0 is highest at dP = -2 sqrt(slope P moment/k')."""
    drop = []
    for moment in (1e-4, 1e-6):
        drop.append(ROORDA - roorda_limit(moment))
        first = 2 * math.sqrt(roorda_slope() * ROORDA * moment / rate_of(column_stiffness, ROORDA))
        # The next term of the series in the rotation.
        dr.assert_close(drop[-1], first, relative=10 * math.sqrt(moment))
    dr.assert_close(drop[0] / drop[1], 10.0, relative=0.1)


# Partial fixity ---------------------------------------------------------------------------------------------------

SPLICE = """*HEADING
Hinged column of length and EI 1 with a rotational spring of stiffness 1 at its middle
*NODE
1, 0, 0
2, 0, 0.5
3, 0, 1
4, 0, 0.5
*LINE, ELSET=COLUMN, NSET=LOWER, TYPE=GE8
1, 2, 4
*LINE, ELSET=COLUMN, NSET=UPPER, TYPE=GE8
{second}, 3, 4
{joint}
*BEAM SECTION, ELSET=COLUMN, SECTION=INEXTENSIBLE
1
*BOUNDARY
1, PINNED
3, 1
*MONITOR, NAME=mid
2, U1
*STEP
*STATIC, METHOD=LOAD
0.5, , 0.5
*CLOAD
3, 2, -1
*STOP
LOAD, ABOVE, 4
*END STEP
"""


@pytest.mark.parametrize(
    "second, joint",
    [("2", "*RELEASE\n2, 5, , , 1."), ("4", "*MPC, TYPE=PIN\n4, 2\n*SPRING\n2, 6, 1., 4"),
     ("4", "*EQUATION\n4, 1, 2.\n2, 1, -2.\n*EQUATION\n2, 2, 1.\n4, 2, -1.\n*SPRING\n4, 6, 1., 2")],
    ids=["released", "pinned", "equations"],
)
def test_spliced_column(second, joint):
    """P w = c 2 w' at the middle: u/2 tan(u/2) = c L/EI. Three ways to say it."""
    text = SPLICE.format(second=second, joint=joint)
    if second == "2":
        text = text.replace("4, 0, 0.5\n", "")
    half = root(lambda v: v * math.tan(v) - 1, 0.1, 1.5)
    within_bar(dr.run_deck(text).labelled("BP")[0], 4 * half**2)


def test_gerber_beam():
    """A beam on three supports with a hinge beyond the second, under its weight q: statically determinate. Slopes of 1e-4."""
    q = 1e-3
    run = dr.run_deck("""*HEADING
Gerber beam
*NODE
1, 0, 0
2, 1, 0
3, 1.25, 0
4, 2.25, 0
*LINE, ELSET=BEAM, TYPE=GE8
1, 2, 2
2, 3, 1
3, 4, 2
*RELEASE
3
*BEAM SECTION, ELSET=BEAM, SECTION=STIFFNESS
1e4, 1
*BOUNDARY
1, PINNED
2, 2
4, 2
*MONITOR, NAME=A
1, RF2
*MONITOR, NAME=B
2, RF2
*MONITOR, NAME=C
4, RF2
*STEP
*STATIC, METHOD=LOAD
1.
*DLOAD
BEAM, PY, -0.001
*FIELD OUTPUT
DISPLACEMENT, SECTION FORCES
*END STEP
""")
    dr.assert_close([run.column(name)[-1] for name in "ABC"], np.array([0.34375, 1.40625, 0.5]) * q, absolute=1e-7 * q)
    mesh = run.results.mesh
    assert mesh.releases.tolist() == [[2, len(mesh.node_label) - 1]] and mesh.hinges.tolist() == [2]
    rotation = run.results.field("displacement", 2)[mesh.releases[0], 2]
    # Half of it hangs on the cantilever of 0.25 beyond the first span, which turns at its support, too.
    end = -(0.25**3 / 6 + 0.5 * 0.25**2 / 2)
    support = 1 / 24 - (0.25**2 / 2 + 0.5 * 0.25) / 3
    sag = 0.25 * support - (0.25**4 / 8 + 0.5 * 0.25**3 / 3)
    dr.assert_close(rotation, np.array([support + end, -sag - 1 / 24]) * q, absolute=1e-7 * q)


# Rigid links ------------------------------------------------------------------------------------------------------

TIP = """*HEADING
Cantilever column of length 1, its tip {what}
*NODE
1, 0, 0
2, 0, 1
3, {x}, {y}
*LINE, ELSET=ROD, TYPE=GE8
1, 2, 6
{arm}
*BEAM SECTION, ELSET=ROD, SECTION=INEXTENSIBLE
1
*BOUNDARY
1, ENCASTRE
*MONITOR, NAME=u
3, U1
*MONITOR, NAME=v
3, U2
*MONITOR, NAME=turn
3, UR
*STEP
*STATIC, METHOD={method}
{increments}
*CLOAD
3, 2, -1
*STOP
LOAD, ABOVE, {last}
*END STEP
"""
LINK = "*MPC, TYPE=BEAM\n3, 2"


def test_column_with_rigid_end():
    """A rigid bar as long as the column goes on from its tip and carries the load at its end: u tan u = 1."""
    text = TIP.format(what="a rigid bar", x=0, y=2, arm=LINK, method="LOAD", increments="0.2, , 0.2", last=1)
    within_bar(dr.run_deck(text).labelled("BP")[0], root(lambda u: u * math.tan(u) - 1, 0.1, 1.5) ** 2)


def test_linear_buckling_with_rigid_end():
    """The same by *BUCKLE: elements of 1/6 that carry the wave to (u/6)^8 or so."""
    text = TIP.format(what="a rigid bar", x=0, y=2, arm=LINK, method="LOAD", increments="0.2", last=1)
    text = text.replace("*STATIC, METHOD=LOAD\n0.2\n", "*BUCKLE\n1\n").replace("*STOP\nLOAD, ABOVE, 1\n", "")
    factor = dr.run_deck(text).results.buckling["Step-1"].load_factor[0]
    dr.assert_close(factor, root(lambda u: u * math.tan(u) - 1, 0.1, 1.5) ** 2, relative=1e-6)


def test_large_turns_of_a_rigid_arm():
    """A load on an arm across the tip, to turns beyond a right angle, is a load and its moment about the tip where this is then:
    the same with the arm as a rod of EI 1e8."""
    options = dict(x=0.3, y=1, method="CYLINDRICAL", increments="0.2, , 0.2", last=6)
    rigid = dr.run_deck(TIP.format(what="a rigid arm", arm=LINK, **options))
    text = TIP.format(what="a stiff arm", arm="*LINE, ELSET=ARM, TYPE=GE8\n2, 3, 1", **options)
    stiff = dr.run_deck(text.replace("*BOUNDARY", "*BEAM SECTION, ELSET=ARM, SECTION=STIFFNESS\n1e8, 1e8\n*BOUNDARY"))
    assert abs(rigid.column("turn")[-1]) > 1.9
    for name in ("u", "v", "turn"):
        dr.assert_close(rigid.column(name)[-1], stiff.column(name)[-1], relative=1e-6)


SCISSOR = """*HEADING
Two crossed bars with a pin, feet at (-0.8, 0) and (0.8, 0), the left one hinged, the right one on a roller with a spring
*NODE
1, -0.8, 0
2, 0, 0.6
3, 0.8, 1.2
4, 0.8, 0
5, 0, 0.6
6, -0.8, 1.2
*LINE, ELSET=BARS
1, 2, 1
2, 3, 1
4, 5, 1
5, 6, 1
*MPC, TYPE=PIN
5, 2
*BEAM SECTION, ELSET=BARS, SECTION=INEXTENSIBLE
1e6
*BOUNDARY
1, PINNED
4, 2
*SPRING
4, 1, 10.
*MONITOR, NAME=out
4, U1
*MONITOR, NAME=down
3, U2, -1.
*STEP
*STATIC
0.2, , 0.1
*CLOAD
3, 2, -1.
6, 2, -1.
*STOP
down, ABOVE, 1.
*END STEP
"""


def test_scissor():
    """Bars of length 2: the work of both loads is that of the spring, 2 P dh = k out d(out), h^2 + (1.6 + out)^2 = 4. The bars
    bend by P L^2/EI of their length, 2e-5 at most."""
    # Two stiff bars nearly are a mechanism: with one element a bar the error bar at the limit point hangs on rounding, up to 14 % of `down`.
    run = dr.run_deck(SCISSOR.replace("*STEP\n", "*STEP\n*ACCURACY, WIDEST=0.3\n"))
    out = run.column("out")
    width = 1.6 + out
    height = np.sqrt(4 - width**2)
    dr.assert_close(1.2 - run.column("down"), height, absolute=1e-4)
    dr.assert_close(run.column("load_factor"), 0.5 * 10 * out * height / width, absolute=1e-4 * max(abs(run.column("load_factor"))))
    assert out[-1] > 0.35


# Rods that cannot stretch ------------------------------------------------------------------------------------------

ARCH = """*HEADING
Semicircular arch, hinged, with a load at the crown
*NODE
1, -1, 0
2, 0, 1
3, 1, 0
*ARC, ELSET=ARCH, TYPE=GE8, DIRECTION=CLOCKWISE
1, 2, 0, 0, 6
2, 3, 0, 0, 6
*BEAM SECTION, ELSET=ARCH, SECTION={section}1
*BOUNDARY
1, PINNED
3, PINNED
*MONITOR, NAME=v
2, U2, -1
*STEP
*STATIC
1, , 0.1
*CLOAD
2, 2, -1
*STOP
v, ABOVE, 0.5
*END STEP
"""


def test_arch_without_stretch():
    """Loads go to those of the inextensible arch with 1/EA, so two EA give them."""
    loads = {}
    for name, section in (("1e6", "STIFFNESS\n1e6, "), ("2e6", "STIFFNESS\n2e6, "), ("rigid", "INEXTENSIBLE\n")):
        run = dr.run_deck(ARCH.format(section=section))
        loads[name] = np.array([run.load("BP"), run.load("EP")])
    # What is left is of order (load/EA)^2.
    dr.assert_close(loads["rigid"], 2 * loads["2e6"] - loads["1e6"], relative=3e-9)


def test_indeterminate_bars():
    """A column that cannot stretch between two hinges, and a triangle with a bar too many."""
    column = SPLICE.format(second="2", joint="").replace("4, 0, 0.5\n", "").replace("3, 1\n", "3, PINNED\n")
    run = dr.run_deck(column, code=2)
    assert "rods that cannot stretch are statically indeterminate" in run.stderr and "element 1" in run.stderr
    assert dr.run_deck(column.replace("3, PINNED", "3, 1")).code == 0


def test_mechanisms():
    """Joints without which nothing stands still."""
    text = dr.changed(dr.on_given_mesh("three-hinged-arch"), ("*RELEASE, NSET=CROWN\n2, RIGHT",
                      "*RELEASE, NSET=CROWN\n2, RIGHT\n*RELEASE\n5"))
    run = dr.run_deck(text, code=2)
    assert "can move without resistance" in run.stderr and "mechanism" in run.stderr


# Links with a pin at each end --------------------------------------------------------------------------------------

LEANING = """*HEADING
A cantilever of length and EI 1 holds a leaning column of length 1 by a level link
*NODE
1, 0, 0
2, 0, 1
3, 1, 1
4, 1, 0
*LINE, ELSET=POST, TYPE=GE8
1, 2, 4
*MPC, TYPE=LINK
3, 4
2, 3
*BEAM SECTION, ELSET=POST, SECTION=STIFFNESS
1e4, 1
*BOUNDARY
1, ENCASTRE
3, 6
4, ENCASTRE
*MONITOR, NAME=sway
2, U1
*MONITOR, NAME=push
4, RF2
*STEP
*STATIC, METHOD=LOAD
0.5, , 0.7
*CLOAD
3, 2, -1
*STOP
LOAD, ABOVE, 3.5
*BRANCH, SIDE=PLUS
sway, ABOVE, 0.6
*FIELD OUTPUT
DISPLACEMENT
*END STEP
"""


def places(results, node, branch):
    """Rows: points of a branch; where the node of that number is."""
    part = results.branches[branch]
    row = list(results.mesh.node_label).index(node)
    return np.array([results.mesh.coordinates[row] + part.field("displacement", k)[row, :2] for k in range(1, part.n_points + 1)])


def test_leaning_column():
    """P/L = 3 EI/L^3; the links keep their lengths however far it sways."""
    run = dr.run_deck(LEANING)
    critical, = run.labelled("BP")
    within_bar(critical, 3.0)
    results = run.results
    assert results.branches[1].column("sway").values[-1] > 0.599
    foot, top, tip = (places(results, node, 1) for node in (4, 3, 2))
    dr.assert_close(np.linalg.norm(top - foot, axis=1), np.ones(len(top)), absolute=1e-9)
    dr.assert_close(np.linalg.norm(tip - top, axis=1), np.ones(len(top)), absolute=1e-9)


PENDULUM = """*HEADING
A weight 1 on a rigid link of length 1, with a level spring, pushed aside; a rod stands by
*NODE
1, 0, 0
2, 0, -1
11, 3, 0
12, 4, 0
*LINE, ELSET=ROD
11, 12, 1
*MPC, TYPE=LINK
2, 1
*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS
1e4, 1
*SPRING
2, 1, 1.
*BOUNDARY
1, ENCASTRE
2, 6
11, ENCASTRE
*MONITOR, NAME=x
2, U1
*MONITOR, NAME=y
2, U2
*MONITOR, NAME=pull
1, RF2
*STEP
*STATIC, METHOD=LOAD
0.25
*CLOAD
2, 2, -1
*END STEP
*STEP
*STATIC, METHOD=LOAD
0.1
*CONTROLS, TOLERANCE=1E-12
*CLOAD
2, 1, 5
*END STEP
"""


def test_pendulum():
    """Moments about the pin: (5 f - x) cos = sin, x = sin, at load factor f."""
    run = dr.run_deck(PENDULUM)
    rows = run.column("step") == 2
    x, load = run.column("x")[rows], 5 * run.column("load_factor")[rows]
    dr.assert_close(load, x + x / np.sqrt(1 - x**2), absolute=1e-7 * load[-1])
    dr.assert_close(run.column("y")[rows], 1 - np.sqrt(1 - x**2), absolute=1e-9)
    dr.assert_close(run.column("pull")[-1], 1.0, absolute=1e-7)
    assert x[-1] > 0.95


# Contact of rods with joints ---------------------------------------------------------------------------------------

FLOOR = """*HEADING
A heavy cantilever over a floor that rises, of two parts
*NODE
1, 0, 0
2, 1, 0
3, 2, 0
{extra}*LINE, ELSET=ROD, NSET=ROD, TYPE=GE8
1, 2, 8
*LINE, ELSET=SECOND, NSET=ROD, TYPE=GE8
{start}, 3, 8
*ELSET, ELSET=ALL
ROD, SECOND
{joint}
*BEAM SECTION, ELSET=ALL, SECTION=STIFFNESS
1e5, 1
*BOUNDARY
1, ENCASTRE
*OBSTACLE, NAME=F, TYPE=LINE{ground}
-1, -0.02, 3, -0.02
*CONTACT, OBSTACLE=F, NSET=ROD{points}
*MONITOR, NAME=tip
3, U2
*MONITOR, NAME=middle
2, U2
*MONITOR, NAME=turn
2, UR
*MONITOR, NAME=push, OBSTACLE=F
RF2
*STEP
*STATIC, METHOD=LOAD
0.1
*DLOAD
ALL, PY, -1
*END STEP
*STEP
*STATIC, METHOD=LOAD
0.25
*OBSTACLE MOTION
F, 0, 0.01
*CLOAD
3, 2, 0.05
*END STEP
"""


def on_floor(ground, points, start="2", joint="", code=0):
    text = FLOOR.format(extra="4, 1, 0\n" if start == "4" else "", start=start, joint=joint, ground=ground, points=points)
    # Where contact with soft ground passes a joint its load is known to some hundredths only.
    return dr.run_deck(text.replace("*STEP\n", "*STEP\n*ACCURACY, WIDEST=0.5\n"), code=code)


STIFF = {
    "released": ("2", "*RELEASE\n2, SECOND, 6, , 1e9"),
    "pinned": ("4", "*MPC, TYPE=PIN\n4, 2\n*SPRING\n2, 6, 1e9, 4"),
    "tied": ("4", "*MPC, TYPE=TIE\n4, 2"),
    "bar": ("4", "*MPC, TYPE=BEAM\n4, 2"),
    "equations": ("4", "*EQUATION\n4, 1, 2.\n2, 1, -2.\n*EQUATION\n4, 2, 1.\n2, 2, -1.\n*EQUATION\n4, 6, 1.\n2, 6, -1."),
}


@pytest.mark.parametrize("joint", STIFF)
@pytest.mark.parametrize("ground, points", [("", ", POINTS=NODES"), (", FOUNDATION=WINKLER, MODULUS=1e3", ""),
                                            (", FOUNDATION=WINKLER, MODULUS=1e3", ", POINTS=NODES")], ids=["rigid", "soft", "springs"])
def test_stiff_joints_in_contact(joint, ground, points):
    """A joint that holds everything is none: the rod is the continuous one. The spring gives by M/1e9."""
    whole, jointed = on_floor(ground, points), on_floor(ground, points, *STIFF[joint])
    for name in ("tip", "middle", "turn", "push"):
        dr.assert_close(jointed.column(name)[-1], whole.column(name)[-1], absolute=1e-8)


def test_joints_and_lines_of_contact():
    """By itself the program takes the nodes, with exit code 2; to ask for lines is refused."""
    joint = STIFF["released"]
    run, nodes = on_floor("", "", *joint, code=2), on_floor("", ", POINTS=NODES", *joint)
    assert "joint ties node" in run.stderr
    assert run.column("tip")[-1] == nodes.column("tip")[-1]
    assert "joint ties node" in on_floor("", ", POINTS=ALONG", *joint, code=1).stderr


LIFTED = """*HEADING
Rods of weight 0.01 on a floor, lifted
*NODE
1, 0, 0
2, 4, 0
{extra}*LINE, ELSET=R, NSET=R, TYPE=GE8
1, 2, {elements}
{more}*BEAM SECTION, ELSET=R, SECTION=STIFFNESS
1e4, 1
*BOUNDARY
2, ENCASTRE
{clamp}*OBSTACLE, NAME=BED, TYPE=LINE
-4, 0, 4, 0
*CONTACT, OBSTACLE=BED, NSET=R, POINTS=NODES
*MONITOR, NAME=up
1, U2
*STEP
*STATIC, METHOD=LOAD
1.
*DLOAD
R, PY, -0.01
*END STEP
*STEP
*STATIC, METHOD=LOAD
0.1
*CLOAD
1, 2, {force}
*END STEP
"""


def lifted(elements, hinge):
    parts = dict(extra="3, -4, 0\n", more=f"*LINE, ELSET=R, NSET=R, TYPE=GE8\n3, 1, {elements}\n*RELEASE\n1\n", clamp="3, ENCASTRE\n",
                 force="4e-3") if hinge else dict(extra="", more="", clamp="", force="2e-3")
    return dr.run_deck(LIFTED.format(elements=elements, **parts)).column("up")[-1]


def test_two_hinged_rods_on_a_floor():
    """Lifted at the hinge each half is a rod lifted at its end, off the floor on a length l = 2 F/q and F l^3/6 - q l^4/24 high
    (slopes of 1e-4). Contact at nodes errs by the second order."""
    exact = 2e-3 * 0.4**3 / 6 - 0.01 * 0.4**4 / 24
    errors = []
    for elements in (100, 200, 400):
        both = lifted(elements, True)
        dr.assert_close(both, lifted(elements, False), relative=1e-7)
        errors.append(both - exact)
    dr.assert_close(errors[-1], 0.0, absolute=2e-3 * exact)
    assert abs(errors[0]) > abs(errors[-1])


HANGING = """*HEADING
A rod over a {what}, at its end {load}
*NODE
1, 0, 0.1
2, 2, 0.1
{extra}*LINE, ELSET=ROD, NSET=ROD, TYPE=GE8
1, 2, 8
{more}*BEAM SECTION, ELSET=ALL, SECTION=STIFFNESS
1e6, 1
*BOUNDARY
1, ENCASTRE
*OBSTACLE, NAME=F, {obstacle}
*CONTACT, OBSTACLE=F, NSET=ROD
*MONITOR, NAME=tip
2, U2
*MONITOR, NAME=turn
2, UR
*STEP
*STATIC, METHOD=LOAD
0.1
{loads}
*END STEP
"""


@pytest.mark.parametrize("what, obstacle", [("floor", "TYPE=LINE\n-1, 0, 3, 0"), ("drum", "TYPE=CIRCLE, SIDE=OUTSIDE\n1, -2, 2")])
def test_a_rod_that_hangs_on_the_end_of_a_contact(what, obstacle):
    """A hinged rod hangs down at the end of one that spans of contact describe: its weight is all that it does. Its end goes
    along with the hinge, so it stays upright."""
    alone = dr.run_deck(HANGING.format(what=what, load="a weight", extra="", obstacle=obstacle, loads="*CLOAD\n2, 2, -3",
                                       more="*ELSET, ELSET=ALL\nROD\n"))
    hung = dr.run_deck(HANGING.format(what=what, load="another rod", extra="3, 2, -1.9\n", obstacle=obstacle,
                                      loads="*DLOAD\nHUNG, PY, -1.5",
                                      more="*LINE, ELSET=HUNG, TYPE=GE8\n2, 3, 4\n*ELSET, ELSET=ALL\nROD, HUNG\n*RELEASE\n2, HUNG\n*EQUATION\n3, 1, 1.\n2, 1, -1.\n"))
    assert "do not get on" not in alone.stdout + hung.stdout
    for name in ("tip", "turn"):
        dr.assert_close(hung.column(name)[-1], alone.column(name)[-1], absolute=1e-9)
    regions = [run.results.contact.regions(run.results.n_points) for run in (alone, hung)]
    assert [len(each) for each in regions] == [1, 1]
    dr.assert_close(regions[1][0].start, regions[0][0].start, absolute=1e-9)


# What joints cannot do ---------------------------------------------------------------------------------------------

ARM = """*HEADING
A foot on a rigid arm below a cantilever
*NODE
1, 0, 0
2, 1, 0
4, 1, -0.1
*LINE, ELSET=A, TYPE=GE8
1, 2, 8
*NSET, NSET=FOOT
4
*MPC, TYPE=BEAM
4, 2
*BEAM SECTION, ELSET=A, SECTION=STIFFNESS
1e5, 1
*BOUNDARY
1, ENCASTRE
{obstacle}
*MONITOR, NAME=foot
4, U2
*STEP
*STATIC, METHOD=LOAD
0.2
*CLOAD
2, 2, -1
*END STEP
"""
LEVEL = "*OBSTACLE, NAME=F, TYPE=LINE{}\n-1, -0.2, 3, -0.2\n*CONTACT, OBSTACLE=F, NSET=FOOT"


@pytest.mark.parametrize("obstacle, message", [
    (LEVEL.format(""), "node 4 follows another one and cannot touch a rigid obstacle"),
    (LEVEL.format(", BILATERAL"), "node 4 follows another one and cannot touch a rigid obstacle"),
    ("*GAP, NAME=F\n4, 0.1", "node 4 follows another one and cannot have a rigid stop")])
def test_rigid_obstacles_do_not_touch_what_follows(obstacle, message):
    assert message in dr.run_deck(ARM.format(obstacle=obstacle), code=1).stderr


@pytest.mark.parametrize("obstacle", [LEVEL.format(", FOUNDATION=WINKLER, MODULUS=1e9"), "*GAP, NAME=F, STIFFNESS=1e9\n4, 0.1"])
def test_soft_obstacles_push_what_follows(obstacle):
    """What pushes with a force does so through a rigid arm: a stiff spring holds the foot where a rod as an arm is held."""
    arm = dr.run_deck(ARM.format(obstacle=obstacle))
    rod = ARM.replace("*MPC, TYPE=BEAM\n4, 2", "*LINE, ELSET=ARM, TYPE=GE8\n2, 4, 1").replace(
        "*BOUNDARY", "*BEAM SECTION, ELSET=ARM, SECTION=STIFFNESS\n1e9, 1e9\n*BOUNDARY")
    stiff = dr.run_deck(rod.format(obstacle=obstacle))
    dr.assert_close(arm.column("foot")[-1], stiff.column("foot")[-1], absolute=1e-8)
    assert arm.column("foot")[-1] < -0.09


@pytest.mark.parametrize("extra, node", [("9, 5, 5\n", 9), ("", 3)])
def test_nodes_that_nothing_holds(extra, node):
    """A node by itself, and one between two links, which may turn."""
    text = LEANING.replace("3, 6\n", "" if node == 3 else "3, 6\n").replace("4, 1, 0\n", "4, 1, 0\n" + extra)
    assert f"node {node} belongs to no element and can move or turn" in dr.run_deck(text, code=2).stderr


PRESSED_HINGE = """*HEADING
Two cantilevers joined by a hinge, pressed on a table
*NODE
1, 0, 0
2, 100, 0
3, 200, 0
*LINE, ELSET=R, NSET=R
1, 2, 4
2, 3, 4
*BEAM SECTION, ELSET=R, SECTION=STIFFNESS
1e7, 437500
*RELEASE
2
*BOUNDARY
1, ENCASTRE
3, ENCASTRE
*OBSTACLE, NAME=T, TYPE=LINE
0, -1, 200, -1
*CONTACT, OBSTACLE=T, NSET=R, POINTS=NODES
*MONITOR, NAME=v
2, U2
*MONITOR, NAME=t, OBSTACLE=T
RF2
*STEP
*STATIC, METHOD=LOAD
0.1
*DLOAD
R, PY, -0.2
*END STEP
"""


def test_a_hinge_that_touches_pushes_once():
    """Both rods end at the hinge, but the obstacle pushes one point: twice what it takes for one of them, by contact spans."""
    whole = dr.run_deck(PRESSED_HINGE)
    half = dr.run_deck(dr.changed(PRESSED_HINGE, ("2, 3, 4\n", ""), ("3, 200, 0\n", ""), ("*RELEASE\n2\n", ""),
                                  ("3, ENCASTRE", "2, 1")))
    begins = [[c.load_factor for c in run.results.critical if c.label == "C+"] for run in (whole, half)]
    assert len(begins[0]) == len(begins[1]) == 1
    dr.assert_close(begins[0][0], begins[1][0], relative=1e-7)
    ends = [run.results.critical[-1].monitors["t"] for run in (whole, half)]
    dr.assert_close(ends[0], 2.0 * ends[1], relative=1e-6)


# Stays that go slack -------------------------------------------------------------------------------------------------------

STAYS = """*PARAMETER
EA = 29000*0.94
thin = {thin}
*HEADING
Strut held by a stay above it, loaded at its tip; a stay below it goes slack: a thin rod with a small imperfection
*NODE
1, 0., 0.
2, 100., 0.
3, 0., 10.
4, 0., -10.
*LINE, ELSET=STRUT
1, 2
*LINE, ELSET=UPPER
3, 2
*LINE, ELSET=LOWER
4, 2
*BEAM SECTION, ELSET=STRUT, SECTION=STIFFNESS
${{EA}}, 600000.
*BEAM SECTION, ELSET=UPPER, SECTION=STIFFNESS
${{EA}}, ${{thin}}
*BEAM SECTION, ELSET=LOWER, SECTION=STIFFNESS
${{EA}}, ${{thin}}
*IMPERFECTION, ELSET=LOWER, SHAPE=SINE
0.1, 1.
*BOUNDARY
1, PINNED
3, PINNED
4, PINNED
*RELEASE
2, UPPER
2, LOWER
*MONITOR, NAME=down
2, U2, -1.
*MONITOR, NAME=upper
3, RF1, -1.
*MONITOR, NAME=lower
4, RF1
*STEP
*STATIC, METHOD={method}
{first}
*CLOAD
2, 2, -10.
{stop}*END STEP
"""


def strut_and_stay(ea=29000 * 0.94, load=10.0, a=100.0, h=10.0):
    """Tip of a strut of length a that is hinged at its foot, in the direction -y, and the thrust of its one stay there: two bars."""
    stay = math.hypot(a, h)
    tip = np.array([a, 0.0])
    for _ in range(50):
        length = np.array([math.hypot(*tip), math.hypot(tip[0], tip[1] - h)])
        unit = np.array([tip / length[0], (tip - [0.0, h]) / length[1]])
        rest = np.array([a, stay])
        force = ea * (length - rest) / rest
        stiffness = sum(ea / rest[i] * np.outer(unit[i], unit[i]) + force[i] / length[i] * (np.eye(2) - np.outer(unit[i], unit[i]))
                        for i in (0, 1))
        tip = tip + np.linalg.solve(stiffness, np.array([0.0, -load]) - force @ unit)
    return -tip[1], force[1] * unit[1][0]


@pytest.mark.parametrize("thin", ["1e-2", "1e-3", "1e-5", "1e-7"])
@pytest.mark.parametrize("method, first, stop", [("LOAD", "0.01", ""), ("CYLINDRICAL", "0.01, , 0.05", "*STOP\nLOAD, ABOVE, 1.\n")])
def test_stays_of_next_to_no_stiffness(thin, method, first, stop):
    """The slack stay bends away at less than its Euler load; the taut one turns against its tension alone."""
    end = dr.run_deck(STAYS.format(thin=thin, method=method, first=first, stop=stop)).only("EP")
    down, thrust = strut_and_stay()
    euler = np.pi**2 * float(thin) / 100.0**2
    assert 0.5 * euler < end.monitors["lower"] < euler
    dr.assert_close(end.monitors["down"], down, relative=10.0 * euler / thrust + 1e-8)
    dr.assert_close(end.monitors["upper"], thrust, relative=10.0 * euler / thrust + 1e-8)

"""*AXIAL SOIL: soil that holds a straight rod along its axis, elastic with a limit.

References: the pull-out of an elastic bar, EA u'' = min(k u, t), in closed form, free and pressed flat on a bed; for a pipe lifted
off its bed finer meshes, and contact at nodes."""
import math

import pytest

import deck_runner as dr

K, T, EA, LENGTH = 2000.0, 1.0, 5e4, 30.0
LAMBDA = math.sqrt(K / EA)


def pulled_end(load, limited=True):
    """Displacement of the pulled end."""
    def holding(length):
        return EA * LAMBDA * T / K * math.tanh(LAMBDA * length)
    if not limited or load <= holding(LENGTH):
        return load / (EA * LAMBDA * math.tanh(LAMBDA * LENGTH))
    low, high = 0.0, LENGTH
    for _ in range(200):
        slip = (low + high) / 2
        low, high = (slip, high) if holding(LENGTH - slip) + T * slip < load else (low, slip)
    return T / K + holding(LENGTH - low) * low / EA + T * low**2 / (2 * EA)


def pull(*changes, options=(), code=0):
    return dr.run_deck(dr.changed(dr.example("pull-out"), *changes), *options, code=code)


@pytest.mark.parametrize("load", [3.0, 8.0, 15.0])
@pytest.mark.parametrize("sign", [1, -1])
def test_pull_out(load, sign):
    """Before and after slip has begun, pulled and pushed: the law's corner inside an element is found."""
    # EI = 1e4: the bar that is pushed does not buckle.
    run = pull(("2, 1, 1\n", f"2, 1, {sign}\n"), ("ABOVE, 15", f"ABOVE, {load}"), ("${EA}, 1\n", "${EA}, 1e4\n"))
    dr.assert_close(sign * run.column("u")[-1], pulled_end(load), relative=1e-9)
    dr.assert_close(sign * run.column("soil")[-1], -load, relative=1e-9)


def test_pull_out_in_any_direction():
    """On a rail, along the x axis and turned by 37 degrees."""
    along = []
    for angle in 0.0, math.radians(37):
        c, s = math.cos(angle), math.sin(angle)
        rail = f"*OBSTACLE, NAME=RAIL, TYPE=LINE, BILATERAL\n0, 0, {c!r}, {s!r}\n*CONTACT, OBSTACLE=RAIL, NSET=BAR\n"
        run = pull(("2, ${L}, 0", f"2, ${{{c!r}*L}}, ${{{s!r}*L}}"), ("2, 1, 1\n", f"2, 1, {c!r}\n2, 2, {s!r}\n"),
                   ("*BOUNDARY\n1, 2, 6\n2, 2\n", rail))
        along.append(run.column("u")[-1] / c)
    dr.assert_close(along[1], along[0], relative=1e-9)
    dr.assert_close(along[0], pulled_end(15.0), relative=1e-7)      # no node moves with the end of slip beside contact at nodes


@pytest.mark.parametrize("force", ["STIFFNESS=${k}", "LAW=L"])
def test_without_limit(force):
    """A stiffness alone, and a law of one straight line."""
    law = "*FOUNDATION LAW, NAME=L\n0, 0\n1, ${k}\n" if "LAW" in force else ""
    run = pull(("*AXIAL SOIL", law + "*AXIAL SOIL"), ("STIFFNESS=${k}, LIMIT=${t}", force))
    dr.assert_close(run.column("u")[-1], pulled_end(15.0, limited=False), relative=1e-9)


@pytest.mark.parametrize("kind, order", [("GE2", 2), ("GE4", 4)])
def test_order(kind, order):
    """Errors before slip fall with the order of the elements."""
    error = [abs(pull(("ELSET=BAR, NSET=BAR", f"ELSET=BAR, NSET=BAR, TYPE={kind}"), ("1, 2, 20", f"1, 2, {n}"), ("ABOVE, 15", "ABOVE, 3"),
                      code=None).column("u")[-1] - pulled_end(3.0)) for n in (15, 30)]
    assert error[0] / error[1] > 2**(order - 0.5)


BED = """*OBSTACLE, NAME=BED, TYPE=LINE
0, 0, {c}, {s}
*CONTACT, OBSTACLE=BED, NSET=BAR, POINTS={points}
"""
WEIGHT = """*STEP
*STATIC, METHOD=LOAD
1
*DLOAD
BAR, GRAV, 1, {s}, -{c}
*END STEP
"""


def on_bed(*changes, angle=0.0, points="ALONG", code=0):
    """The bar without supports, pressed on a rigid bed by its weight 1 before the step of the deck; in a direction."""
    c, s = math.cos(angle), math.sin(angle)
    return pull(("*BOUNDARY\n1, 2, 6\n2, 2\n", BED.format(c=c, s=s, points=points)), ("${EA}, 1\n", "${EA}, 1, , 1\n"),
                ("*STEP\n", WEIGHT.format(c=c, s=s) + "*STEP\n"), ("2, ${L}, 0", f"2, ${{{c!r}*L}}, ${{{s!r}*L}}"), *changes, code=code)


def test_flat_on_a_bed():
    """The line contact has the closed form of the free bar, and the bed carries the weight."""
    run = on_bed(("STIFFNESS=${k}, LIMIT=${t}", "STIFFNESS=${k}"), ("ABOVE, 15", "ABOVE, 8"),
                 ("*MONITOR, NAME=soil", "*MONITOR, NAME=bed, OBSTACLE=BED\nRN\n*MONITOR, NAME=soil"))
    dr.assert_close(run.column("u")[-1], pulled_end(8.0, False), relative=1e-9)
    dr.assert_close(run.column("soil")[-1], -8.0, relative=1e-9)
    dr.assert_close(run.column("bed")[-1], LENGTH, relative=1e-9)


def test_limit_on_a_bed():
    """With a limit the bed acts at the nodes, and the listing says why. EI = 1e4: the bar's sag between two nodes shortens it by
    1e-6 of the displacement."""
    run = on_bed(("${EA}, 1, , 1\n", "${EA}, 1e4, , 1\n"), points="AUTO", code=2)
    dr.assert_close(run.column("u")[-1], pulled_end(15.0), relative=1e-5)
    assert "linear soil" in run.stdout


def lifted(kind="GE4", elements=40, angle=0.0, points="ALONG"):
    """Height to which a pipe of EA = 1000, EI = 1 and length 6 is lifted and pulled by (1, 0.5) at its end, from a bed with soil of
    stiffness 50 along it."""
    c, s = math.cos(angle), math.sin(angle)
    run = on_bed(("k = 2000\nt = 1\nEA = 5e4\nL = 30", "k = 50\nEA = 1000\nL = 6"), ("STIFFNESS=${k}, LIMIT=${t}", "STIFFNESS=${k}"),
                 ("NSET=BAR\n1, 2, 20", f"NSET=BAR, TYPE={kind}\n1, 2, {elements}"), ("0.5, , 1", "0.1, 1e-7, 0.1"),
                 ("2, 1, 1\n", f"2, 1, {c - 0.5 * s!r}\n2, 2, {s + 0.5 * c!r}\n"), ("*STOP\nLOAD, ABOVE, 15\n", ""),
                 ("*MONITOR, NAME=soil", "*MONITOR, NAME=v\n2, U2\n*MONITOR, NAME=soil"), angle=angle, points=points)
    return c * run.column("v")[-1] - s * run.column("u")[-1]


def test_lifted_off_a_bed():
    """The error falls with the order of the elements, and contact at nodes tends to the same height, at least with order 2 in steps
    of 4 in which its last node in contact may lie anywhere; the height does not depend on the direction."""
    exact = lifted("GE8", 80)
    error = [abs(lifted(elements=n) - exact) for n in (20, 40)]
    assert error[0] / error[1] > 2**3.5
    error = [abs(lifted(elements=n, points="NODES") - exact) for n in (40, 160)]
    assert error[0] / error[1] > 4**1.5
    dr.assert_close(lifted(angle=0.5), lifted(), relative=1e-9)


@pytest.mark.parametrize("k", [50, 500, 2000])
def test_lifted_with_tolerance(k):
    """The mesh is made for the tolerance at every point, also at the first one behind the lift of the end: a long pipe needs more
    elements on the bed there than it had under its weight. Heights against a fine given mesh."""
    def height(line, accuracy):
        run = on_bed(("k = 2000\nt = 1\nEA = 5e4\nL = 30", f"k = {k}\nEA = 1000\nL = 30"), ("STIFFNESS=${k}, LIMIT=${t}", "STIFFNESS=${k}"),
                     ("NSET=BAR\n1, 2, 20", line), ("0.5, , 1", "0.1, 1e-7, 0.1" + accuracy), ("2, 1, 1\n", "2, 1, 0.5\n2, 2, 1\n"),
                     ("*STOP\nLOAD, ABOVE, 15\n", ""), ("*MONITOR, NAME=soil", "*MONITOR, NAME=v\n2, U2\n*MONITOR, NAME=soil"))
        return run.column("v")[-1]
    dr.assert_close(height("NSET=BAR\n1, 2", "\n*ACCURACY, TOLERANCE=1E-6"), height("NSET=BAR\n1, 2, 300", ""), relative=1e-6)


def test_curved_bed():
    """Over the humps of a curved bed, with soil along the chord: meshes for two tolerances agree within the larger."""
    def valley(tolerance):
        soil = "*AXIAL SOIL, NAME=SOIL, ELSET=PIPE, STIFFNESS=500\n*STEP\n"
        run = dr.run_deck(dr.changed(dr.example("pipe-humps"), ("1E-6", tolerance), ("*STEP\n", soil), ("1e6, 1.", "1e3, 1.")))
        return run.column("valley")[-1]
    dr.assert_close(valley("1E-4"), valley("1E-7"), relative=1e-4)

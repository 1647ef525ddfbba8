"""Limit points in two parameters (*LIMIT CURVE): each point of a curve is the limit point of an ordinary run.

reference/ring_winkler_critical.csv: boundary value problem of the paper's ring in a tensionless Winkler medium. Limit loads are
stationary along the path: they are as good as the square of what LOCATE leaves open.
"""
import functools

import numpy as np
import pytest

import contact_cases as cases
import deck_runner as dr

RIGID = 81.557427564661


def curve_of(run, name="CURVE"):
    return run.results.limit_curves[name]


def values(curve, column):
    return curve.column(column).values


def at(curve, parameter, column="load_factor"):
    """The one point with this value of the parameter that was asked for."""
    rows = [k for k, (value, label) in enumerate(zip(values(curve, "parameter"), values(curve, "label")))
            if abs(value - parameter) <= 1e-12 * abs(parameter) and str(label) in ("UZ", "EP", "")]
    rows = [k for k in rows if not values(curve, "rigid")[k]]
    assert len(rows) == 1, f"{len(rows)} points at {parameter}"
    return values(curve, column)[rows[0]]


def with_curve(text, card, data):
    """The text with a limit curve in its last step."""
    head, tail = text.rsplit("*END STEP", 1)
    return f"{head}*LIMIT CURVE, NAME=CURVE, {card}\n{data}\n*END STEP{tail}"


def limit_load(text, which=0):
    return dr.run_deck(text).labelled("LP")[which].load_factor


# ---- the paper's ring ----

@functools.cache
def ring_critical():
    return dr.run_deck(dr.example("ring-critical"))


def test_ring_over_the_modulus():
    """k R^4/EI = 1e3, 1e5, 3.6e6, 1e8 and rigid, asked 1e-6; with the obstacle rigid in contact spans."""
    table, curve = dr.reference("ring_winkler_critical"), ring_critical().results.limit_curves["CRITICAL"]
    assert "do not get on" not in ring_critical().stdout
    dr.assert_close([at(curve, k) for k in table["kbar"]], table["p"], relative=1e-6)
    dr.assert_close([at(curve, k, "v") for k in table["kbar"]], table["v"], relative=5e-3)
    rigid = values(curve, "rigid") == 1
    assert list(rigid) == [False] * (len(rigid) - 1) + [True]
    dr.assert_close(values(curve, "load_factor")[-1], RIGID, relative=1e-6)
    assert [str(label) for label in values(curve, "label")].count("UZ") == 3 and str(values(curve, "label")[-1]) == "EP"
    dr.assert_monotone(values(curve, "parameter")[:-1], rising=True)
    dr.assert_monotone(values(curve, "load_factor")[:-1], rising=True)
    assert (curve.step, curve.limit_point) == (1, 1)


def test_points_of_the_ring_are_limit_points():
    """In equilibrium, and the load stands still."""
    curve = ring_critical().results.limit_curves["CRITICAL"]
    assert np.all(values(curve, "residual") <= 1e-8)
    assert np.all(values(curve, "load_rate") <= 1e-3)


@dr.release_only
@pytest.mark.parametrize("points, given, limit", [("ALONG", "GE8, 4, 24, 16", 1e-6), ("NODES", "GE4, 16, 128, 80", 1e-3)])
def test_rigid_at_the_end(points, given, limit):
    """From 1e7 on, in contact spans or at nodes."""
    kind, *counts = given.split(", ")
    arcs = "".join(f"{i + 1}, {i + 2}, 0., 0., {n}\n" for i, n in enumerate(counts))
    text = dr.changed(dr.example("ring-critical"), ("2, 0., -1.\n", "2, -0.3420201433256687, 0.9396926207859084\n"
                                                    "3, -0.9063077870366499, 0.42261826174069944\n4, 0., -1.\n"), ("2, XSYMM", "4, XSYMM"),
                      ("TYPE=GE8\n1, 2, 0., 0.\n", f"TYPE={kind}\n{arcs}"), ("*ACCURACY, TOLERANCE=1E-6", "*ACCURACY, WIDEST=1"),
                      ("MODULUS=1E3", "MODULUS=1E7"), ("NSET=RING\n*MON", f"NSET=RING, POINTS={points}\n*MON"), ("0.25, 1E8, 0.25, 1E5, 3.6E6", "0.25, 1E8, 0.25"))
    curve = dr.run_deck(text).results.limit_curves["CRITICAL"]
    assert values(curve, "rigid")[-1] == 1
    dr.assert_close(values(curve, "load_factor")[-1], RIGID, relative=limit)


# ---- against ordinary runs ----

def plain_ring(modulus, gap=0.0):
    """A coarse one of elements that are good to 1e-7 whatever mesh the curve and the path end up on."""
    return dr.changed(dr.on_given_mesh("ring-winkler"), ("TYPE=GE4", "TYPE=GE8"),
                      ("1, 2, 0., 0., 32", "1, 2, 0., 0., 8"), ("2, 3, 0., 0., 256", "2, 3, 0., 0., 32"),
                      ("3, 4, 0., 0., 64", "3, 4, 0., 0., 16"), ("MODULUS=3.6E6", f"MODULUS={modulus!r}"),
                      ("OBSTACLE=MEDIUM, NSET=RING", f"OBSTACLE=MEDIUM, NSET=RING, GAP={gap!r}"),
                      ("LOAD, 34., 57., 62., 28.", "LOAD, 1E6"), ("v, ABOVE, 0.55", "v, ABOVE, 0.3"),
                      ("1., 1E-9, 0.02", "1., 1E-9, 0.005"))


@dr.release_only
def test_modulus():
    run = dr.run_deck(with_curve(plain_ring(1e3), "PARAMETER=MODULUS, OBSTACLE=MEDIUM, SCALE=LOG", "0.25, 1E5, 0.5, 4000., 2E4"))
    for modulus in (1e3, 4e3, 2e4, 1e5):
        dr.assert_close(at(curve_of(run), modulus), limit_load(plain_ring(modulus)), relative=1e-7)


@dr.release_only
def test_modulus_back():
    """Down along the same curve."""
    run = dr.run_deck(with_curve(plain_ring(1e5), "PARAMETER=MODULUS, OBSTACLE=MEDIUM, SCALE=LOG", "-0.25, 1E3, 0.5, 4000., 2E4"))
    for modulus in (1e5, 2e4, 4e3, 1e3):
        dr.assert_close(at(curve_of(run), modulus), limit_load(plain_ring(modulus)), relative=1e-7)


@dr.release_only
def test_gap():
    """More room, less load."""
    def held(modulus, gap=0.0):
        """Its foot is held, for a ring in the air is not."""
        return dr.changed(plain_ring(modulus, gap), ("4, XSYMM", "4, ENCASTRE"))
    # Beside 0.005 a node lifts off at the limit point: the path has two maxima, 1e-4 apart, which only short steps tell.
    gaps = (0.0, 0.006, 0.01, 0.02)
    run = dr.run_deck(with_curve(held(1e4), "PARAMETER=GAP, OBSTACLE=MEDIUM", "1E-3, 0.02, 4E-3, 0.006, 0.01"))
    found = [at(curve_of(run), gap) for gap in gaps]
    dr.assert_close(found, [limit_load(held(1e4, gap)) for gap in gaps], relative=1e-7)
    dr.assert_monotone(found, rising=False)


LINER = """*HEADING
Liner of two parts in a rigid host: a breakpoint lies in its line contact
*NODE
1, 0., 1.
2, -0.6427876096865393, 0.766044443118978
3, 0., -1.
*ARC, ELSET=LINER, NSET=LINER, TYPE=GE8
1, 2, 0., 0., 24
2, 3, 0., 0., 16
*BEAM SECTION, ELSET=LINER, SECTION=STIFFNESS
30000, 1.
*BOUNDARY
1, XSYMM
3, XSYMM
*OBSTACLE, NAME=HOST, TYPE=CIRCLE, SIDE=INSIDE, REFERENCE=90.
0., 0., 1
*CONTACT, OBSTACLE=HOST, NSET=LINER
*MONITOR, NAME=v
1, U2, -1.
*STEP
*STATIC
0.5, 1E-9, 0.01
*DLOAD
LINER, P, 1.
*CLOAD
1, 2, -0.005
*STOP
v, ABOVE, 0.1
*END STEP
"""


@dr.release_only
def test_gap_of_a_rigid_host():
    """With contact spans, on the mesh that they have at the limit point. A wider host is one that the liner lies on the bottom of."""
    run = dr.run_deck(with_curve(LINER, "PARAMETER=GAP, OBSTACLE=HOST", "0.0005, 0.004, 0.002, 0.001"))
    table = cases.liner_table()
    for gap in (0.001, 0.004):
        dr.assert_close(at(curve_of(run), gap), table[50, 1, 0.005, gap], relative=1e-6)


def arch(ea=3600.0, ei=1.0, bent=None, constant=None, moment=0.0):
    """The shallow arch on its symmetric path up to its limit point; bent: amplitude of half a sine; constant: P before."""
    text = dr.on_given_mesh("arch-shallow-hinged")
    start = text.index("*BRANCH")
    text = text[:start] + text[text.index("*STOP", start):]
    text = dr.changed(text, ("3600., 1.\n", f"{ea!r}, {ei!r}\n"), ("v, ABOVE, 0.25", "v, ABOVE, 0.1"),
                      ("0.5, 1E-9, 0.005", "0.5, 1E-9, 0.002"))
    if bent is not None:
        text = dr.changed(text, ("*BOUNDARY", f"*IMPERFECTION, ELSET=ARCH, SHAPE=SINE\n{bent!r}, 1\n*BOUNDARY"))
    if constant is not None:
        text = dr.changed(text, ("*STEP\n", "*STEP\n*STATIC, METHOD=LOAD\n0.25\n"
                                            f"*CLOAD\n2, 2, {-2.0 * constant!r}\n2, 6, {moment * constant!r}\n"
                                            f"*DLOAD\nARCH, PY, {-5.0 * constant!r}\n*END STEP\n*STEP\n"))
    return text


@pytest.mark.parametrize("card, data, other", [
    ("PARAMETER=EA, ELSET=ARCH", "200., 6000., 800., 4000., 5000.", lambda value: arch(ea=value)),
    ("PARAMETER=EA, ELSET=ARCH, SCALE=LOG", "-0.05, 2500., 0.1, 3300., 3000.", lambda value: arch(ea=value)),
    ("PARAMETER=EI, ELSET=ARCH", "0.05, 1.5, 0.1, 1.1, 1.25", lambda value: arch(ei=value)),
    ("PARAMETER=EI, ELSET=ARCH", "-0.05, 0.6, 0.2, 0.9, 0.75", lambda value: arch(ei=value))])
def test_stiffness(card, data, other):
    run = dr.run_deck(with_curve(arch(), card, data))
    _, last, _, *between = (float(value) for value in data.split(","))
    for value in (*between, last):
        dr.assert_close(at(curve_of(run), value), limit_load(other(value)), relative=1e-8)


def test_stiffness_in_proportion():
    """The load has the unit of EI over a length squared: EA and EI times 1.5 make it 1.5 times."""
    one = dr.run_deck(with_curve(arch(), "PARAMETER=EI, ELSET=ARCH", "0.1, 1.5"))
    two = dr.run_deck(with_curve(arch(3600.0 / 1.5), "PARAMETER=EA, ELSET=ARCH", "100., 3600."))
    dr.assert_close(at(curve_of(one), 1.5) / 1.5, values(curve_of(two), "load_factor")[0], relative=1e-8)


def test_model_imperfection():
    """A factor on the amplitude: a half sine that makes the arch lower, and through zero the other way."""
    run = dr.run_deck(with_curve(arch(bent=4e-3), "PARAMETER=IMPERFECTION, ELSET=ARCH", "-0.25, -1., 0.5, 0.5, 0., -0.5"))
    for factor in (1.0, 0.5, -0.5, -1.0):
        dr.assert_close(at(curve_of(run), factor), limit_load(arch(bent=4e-3 * factor)), relative=1e-8)
    zero = np.argmin(np.abs(values(curve_of(run), "parameter")))
    assert abs(values(curve_of(run), "parameter")[zero]) < 1e-12
    dr.assert_close(values(curve_of(run), "load_factor")[zero], limit_load(arch()), relative=1e-8)


@pytest.mark.parametrize("moment", [0.0, 0.1])
def test_constant_load(moment):
    """A factor on what the first step left: another load at the apex, a line load and a moment."""
    start = arch(constant=1.0, moment=moment)
    run = dr.run_deck(with_curve(start, "PARAMETER=CONSTANT LOAD", "0.25, 2., 0.5, 1.5"))
    for factor in (1.0, 1.5, 2.0):
        dr.assert_close(at(curve_of(run), factor), limit_load(arch(constant=factor, moment=moment)), relative=1e-8)


def test_constant_load_fades():
    """Without it, the arch has its own limit point; a moment that fades leads to the bifurcation."""
    down = dr.run_deck(with_curve(arch(constant=1.0), "PARAMETER=CONSTANT LOAD", "-0.25, 0., 0.5"))
    last = values(curve_of(down), "parameter")[-1], values(curve_of(down), "load_factor")[-1]
    dr.assert_close(last, [0.0, limit_load(arch())], relative=1e-8, absolute=1e-12)
    down = dr.run_deck(with_curve(arch(constant=1.0, moment=0.1), "PARAMETER=CONSTANT LOAD", "-0.25, 1E-6, 0.25"))
    # Koiter: c (1e-6)^(2/3) below it
    assert 0.0 < 14.3595205986 - values(curve_of(down), "load_factor")[-1] < 1e-3


def test_second_limit_point():
    """The least load of the arch, after its snap."""
    text = dr.changed(arch(), ("v, ABOVE, 0.1", "v, ABOVE, 0.2"))
    run = dr.run_deck(with_curve(text, "PARAMETER=EA, ELSET=ARCH, LIMIT=2", "200., 4400., 400., 4000."))
    assert curve_of(run).limit_point == 2
    dr.assert_close(values(curve_of(run), "load_factor")[0], -10.1496812160, relative=1e-8)
    for ea in (4000.0, 4400.0):
        other = dr.changed(arch(ea), ("v, ABOVE, 0.1", "v, ABOVE, 0.2"))
        dr.assert_close(at(curve_of(run), ea), limit_load(other, 1), relative=1e-8)


def test_where_limit_points_meet():
    """The softer the arch, the less it snaps: maximum and minimum of the load meet, the curve goes on as that of the minimum."""
    def text(**stiffness):
        return dr.changed(arch(**stiffness), ("v, ABOVE, 0.1", "v, ABOVE, 0.2"))
    run = dr.run_deck(with_curve(text(), "PARAMETER=EA, ELSET=ARCH, SCALE=LOG, POINTS=60", "-0.05, 10., 0.1, 3000., 1000."), code=2)
    curve = curve_of(run)
    ea, load, labels = (values(curve, name) for name in ("parameter", "load_factor", "label"))
    turn, = (k for k, label in enumerate(labels) if str(label) == "TP")
    least = np.argmin(ea)
    assert abs(turn - least) <= 1
    dr.assert_monotone(ea[:least + 1], rising=False)
    dr.assert_monotone(ea[least:], rising=True)
    dr.assert_monotone(load, rising=False)
    for value in (1000.0, 3000.0):
        rows = [k for k, label in enumerate(labels) if str(label) == "UZ" and abs(ea[k] - value) < 1e-9 * value]
        limits = [c.load_factor for c in dr.run_deck(text(ea=value)).labelled("LP")]
        dr.assert_close(load[rows], limits[:2], relative=1e-8)


# ---- what cannot be ----

def test_no_such_limit_point():
    run = dr.run_deck(with_curve(arch(), "PARAMETER=EA, ELSET=ARCH, LIMIT=3", "100., 4000."), code=2)
    assert "limit curve CURVE: the path has 1 limit point(s), not 3" in run.results.status


def test_too_few_points():
    run = dr.run_deck(with_curve(arch(), "PARAMETER=EA, ELSET=ARCH, POINTS=3", "10., 4000., 10."), code=2)
    assert "the allowed number of points was used up" in run.results.status
    assert len(values(curve_of(run), "parameter")) == 3


def test_the_path_does_not_notice():
    plain, other = dr.run_deck(arch()), dr.run_deck(with_curve(arch(), "PARAMETER=EI, ELSET=ARCH", "0.1, 1.5"))
    for name in ("load_factor", "v"):
        assert np.array_equal(plain.column(name), other.column(name))

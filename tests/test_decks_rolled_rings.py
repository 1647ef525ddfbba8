"""Whole rings between plates, clamped at one place of a plate, about which they may roll: loads do not tell how far.

Exact is the inextensible elastica: with no force along the plates EI k^2/2 = F/2 sin(theta) from the line of contact on, where
k = 0.
"""
import math

import numpy as np
import pytest

import deck_runner as dr

pytestmark = dr.once_in_release

RISE = math.sqrt(math.pi) * math.gamma(0.75) / (2.0 * math.gamma(1.25))    # integral of sin^(1/2) over a right angle
LENGTH = math.sqrt(math.pi) * math.gamma(0.25) / (2.0 * math.gamma(0.75))  # of sin^(-1/2)
FLAT = 1.0 - 0.5 * math.pi * RISE / LENGTH                                  # flattening at which a plate is as curved as the ring


def force(flattening):
    """Of both halves, in EI/R^2; once the ring lies on the plates."""
    return (RISE / (1.0 - flattening))**2


def line(flattening):
    """Half of a line of contact, in R."""
    return 0.5 * math.pi - LENGTH * (1.0 - flattening) / RISE


def half_width(flattening):
    return line(flattening) + 2.0 * (1.0 - flattening) / RISE


MESHES = {"GE8": ("GE8", ", 8", "WIDEST=1e9"), "GE6": ("GE6", ", 14", "WIDEST=1e9"), "1E-3": ("GE8", "", "TOLERANCE=1e-3"),
          "1E-4": ("GE8", "", "TOLERANCE=1e-4"), "1E-6": ("GE8", "", "TOLERANCE=1e-6")}


def ring(clamp=-90.0, other=180.0, mesh="GE8", ea=1e8, turned=0.0, mirrored=False, gap=0.0, method="LOAD", monitors="", pressure=0.0,
         push=0.0, end=0.75):
    """Deck: clamped at an angle; a second node stands further on by `other` degrees, with a force in y. All turned by an angle,
    mirrored before that."""
    def place(x, y):
        x = -x if mirrored else x
        c, s = math.cos(math.radians(turned)), math.sin(math.radians(turned))
        return f"{c * x - s * y!r}, {s * x + c * y!r}"

    def at(angle):
        return place(math.cos(math.radians(angle)), math.sin(math.radians(angle)))

    def plate(height):
        ends = [place(3.0, height), place(-3.0, height)]
        return ", ".join(ends if (height > 0.0) != mirrored else ends[::-1])

    element, elements, accuracy = MESHES[mesh]
    way = ", DIRECTION=CLOCKWISE" if mirrored else ""
    # The plate that the clamp does not lie on comes to it, or both do where it lies on none.
    high, low = (1.0, -1.0 - gap) if clamp > 0.0 else (1.0 + gap, -1.0)
    moving = "LOW" if clamp > 0.0 else "HIGH"
    motion = f"{moving}, {place(0.0, 2.0 if clamp > 0.0 else -2.0)}"
    if clamp == 0.0:
        motion = f"HIGH, {place(0.0, -1.0)}\nLOW, {place(0.0, 1.0)}"
    load = f"*DLOAD\nRING, P, {-pressure if mirrored else pressure}\n" if pressure else ""
    load += f"*CLOAD\n2, 2, {push}\n" if push else ""
    return f"""*HEADING
Ring between plates
*NODE
1, {at(clamp)}
2, {at(clamp + other)}
*ARC, ELSET=RING, NSET=RING, TYPE={element}{way}
1, 2, 0., 0.{elements}
2, 1, 0., 0.{elements}
*BEAM SECTION, ELSET=RING, SECTION=STIFFNESS
{ea!r}, 1.
*BOUNDARY
1, ENCASTRE
*OBSTACLE, NAME=HIGH, TYPE=LINE
{plate(high)}
*OBSTACLE, NAME=LOW, TYPE=LINE
{plate(low)}
*CONTACT, OBSTACLE=HIGH, NSET=RING
*CONTACT, OBSTACLE=LOW, NSET=RING
*MONITOR, NAME=F, OBSTACLE={moving}
RN
{monitors}*STEP
*ACCURACY, {accuracy}
*STATIC, METHOD={method}
0.02
*OBSTACLE MOTION
{motion}
{load}*STOP
LOAD, ABOVE, {end + 0.5 * gap!r}
*LOCATE
LOAD, {0.5 + 0.5 * gap!r}, {0.7 + 0.5 * gap!r}
*END STEP
"""


def located(run):
    """Force at half and at seven tenths of the diameter."""
    return [point.monitors["F"] for point in run.labelled("UZ")]


def lies_on_plates(run, gap=0.0, ea=1e8, mesh_error=1e-6):
    """Forces, the load at which lines begin, and lines as long as they are to be, before the clamp and after it."""
    dr.assert_close(located(run), [force(0.5), force(0.7)], relative=mesh_error + 10.0 / ea)
    assert [c.label for c in run.results.critical if c.label not in ("UZ", "EP")] == ["C+"] * (2 if gap else 1)
    dr.assert_close(run.labelled("C+")[-1].load_factor, FLAT + 0.5 * gap, absolute=10.0 * mesh_error)
    for point, flattening in zip(run.labelled("UZ"), (0.5, 0.7)):
        lines = sorted((region.start, region.end) for region in run.results.contact.regions(point.point))
        assert all(abs(end - start - 2.0 * line(flattening)) <= 10.0 * mesh_error for start, end in lines), lines
        assert len(lines) == 2


@pytest.mark.parametrize("mesh", MESHES)
@pytest.mark.parametrize("clamp", [-90.0, 90.0])
def test_clamped_on_a_plate(clamp, mesh):
    """Loads and forces are those of the elastica; that the rest is a choice is said in the listing and in the results."""
    run = dr.run_deck(ring(clamp, mesh=mesh))
    lies_on_plates(run, mesh_error=max(1e-6, float(mesh) if mesh[0] == "1" else 0.0))
    assert "the loads do not tell how far the rod rolls about node 1" in run.stdout
    dr.assert_close(run.results.accuracy["rolling"] * math.sqrt(8.0), line(0.75), absolute=1e-3)


@pytest.mark.parametrize("ea", [1e4, 1e6, 1e10])
def test_as_the_quarter_does(ea):
    """A quarter between its two planes of symmetry has nothing to choose. Pressure from inside lays lines down."""
    quarter = dr.run_deck(f"""*HEADING
Quarter of a ring
*NODE
1, 1., 0.
2, 0., 1.
*ARC, ELSET=RING, NSET=RING, TYPE=GE8
1, 2, 0., 0., 8
*BEAM SECTION, ELSET=RING, SECTION=STIFFNESS
{ea!r}, 1.
*BOUNDARY
1, YSYMM
2, XSYMM
*OBSTACLE, NAME=PLATE, TYPE=LINE
3., 1., -3., 1.
*CONTACT, OBSTACLE=PLATE, NSET=RING
*MONITOR, NAME=F, OBSTACLE=PLATE
RN, 2.
*STEP
*STATIC, METHOD=LOAD
0.02
*OBSTACLE MOTION
PLATE, 0., -1.
*DLOAD
RING, P, -1.5
*STOP
LOAD, ABOVE, 0.75
*LOCATE
LOAD, 0.5, 0.7
*END STEP
""")
    whole = dr.run_deck(ring(ea=ea, pressure=-1.5))
    assert abs(located(whole)[0] - force(0.5)) > 0.05 * force(0.5)
    dr.assert_close(located(whole), located(quarter), relative=1e-7)


@pytest.mark.parametrize("changes", [dict(mirrored=True), dict(turned=30.0), dict(turned=180.0, mirrored=True), dict(other=120.0),
                                     dict(other=240.0, mesh="1E-6"), dict(method="SPHERICAL"), dict(gap=0.05)])
def test_however_it_stands(changes):
    """Mirrored, turned, with other nodes, by arc length, and where the plate has to come first."""
    lies_on_plates(dr.run_deck(ring(**changes)), gap=changes.get("gap", 0.0))


@pytest.mark.parametrize("mesh", MESHES)
def test_force_on_a_plate(mesh):
    """A force across the plate on a node that lies on it goes into it, wherever the ring has rolled to."""
    run = dr.run_deck(ring(push=1.0, mesh=mesh))
    dr.assert_close(located(run), [force(0.5) + 0.5, force(0.7) + 0.7], relative=max(1e-6, float(mesh) if mesh[0] == "1" else 0.0))
    assert "the loads do not tell how far the rod rolls about node 1" in run.stdout


@pytest.mark.parametrize("mesh, gap", [("GE8", 0.0), ("GE6", 0.05), ("1E-6", 0.0)])
def test_force_off_a_plate(mesh, gap):
    """It lifts its node off the plate, which may come to the ring later than the force does; half of the ring does as the whole."""
    whole = dr.run_deck(ring(push=-1.0, mesh=mesh, gap=gap, end=0.72))
    half = dr.run_deck(dr.changed(ring(push=-1.0, mesh="1E-6", gap=gap, end=0.72), ("2, 1, 0., 0.\n", ""), ("RN\n", "RN, 2.\n"),
                                  ("1, ENCASTRE\n", "1, ENCASTRE\n2, XSYMM\n"), ("2, 2, -1.0\n", "2, 2, -0.5\n")))
    dr.assert_close(located(whole), located(half), relative=2e-6)


def test_what_hangs_on_the_choice():
    """Displacements of material points do; where the plates are does not. The former have no bar, and the run says so."""
    run = dr.run_deck(ring(other=90.0, monitors="*MONITOR, NAME=side\n2, U1\n*MONITOR, NAME=turn\n1, UR\n"), code=2)
    assert "the loads do not tell how far the rod rolls about node 1, nor what hangs on it: side" in run.results.status
    for point, flattening in zip(run.labelled("UZ"), (0.5, 0.7)):
        dr.assert_close(point.monitors["side"], half_width(flattening) - 1.0, absolute=1e-6)
        assert np.isnan(point.monitor_errors["side"]) and np.isfinite(point.monitor_errors["turn"])


def test_clamped_beside_the_plates():
    """Where it touches nothing the clamp holds the ring: everything has a bar."""
    run = dr.run_deck(ring(clamp=0.0, monitors="*MONITOR, NAME=far\n2, U1\n", end=0.72))
    dr.assert_close(located(run), [force(0.5), force(0.7)], relative=1e-6)
    assert "do not tell" not in run.stdout and run.results.accuracy["rolling"] == 0.0
    for point, flattening in zip(run.labelled("UZ"), (0.5, 0.7)):
        assert np.isfinite(point.monitor_errors["far"])
        dr.assert_close(point.monitors["far"], 2.0 - 2.0 * half_width(flattening), absolute=1e-6)

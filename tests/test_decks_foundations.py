"""What foundations do: bilateral ones, against closed forms of beams on elastic foundations.

Loads are so small, or rods so stiff along their axis, that the linear theory of the closed forms holds.
"""
import functools
import math

import numpy as np
import pytest

import deck_runner as dr

# Bilateral foundations -------------------------------------------------------------------------------------------

K, EI, LAMBDA = 64.0, 1.0, 2.0          # modulus, stiffness, (K/4 EI)^(1/4)
FORCE = 1e-4


@functools.cache
def beam(elements, force=-FORCE):
    """Twenty times 1/LAMBDA on either side of a force: exp(-20) = 2e-9 is left at the ends."""
    return dr.run_deck(f"""*HEADING
Beam on a bilateral foundation
*NODE
1, -10, 0
2, 0, 0
3, 10, 0
*LINE, ELSET=BEAM, NSET=BEAM
1, 2, {elements}
2, 3, {elements}
*BEAM SECTION, ELSET=BEAM, SECTION=STIFFNESS
1e6, 1
*BOUNDARY
2, 1
*OBSTACLE, NAME=GROUND, TYPE=LINE, FOUNDATION=WINKLER, MODULUS=32, WIDTH=2, BILATERAL
-20, -3, 20, -3
*CONTACT, OBSTACLE=GROUND, NSET=BEAM
*MONITOR, NAME=W
2, U2
*MONITOR, NAME=RN, OBSTACLE=GROUND
RN
*STEP
*STATIC, METHOD=LOAD
1
*CLOAD
2, 2, {force}
*FIELD OUTPUT
SECTION FORCES
*END STEP
""")


def middle_moment(run):
    nodes, elements = run.results.mesh.coordinates, run.results.mesh.elements
    left = np.flatnonzero(np.abs(nodes[elements[:, 1], 0]) < 1e-12)
    assert len(left) == 1
    return run.results.field("section_forces", run.results.n_points)[left[0], 1, 2]


def test_force_on_a_beam_that_the_ground_holds():
    """Hetenyi 1946: w0 = F lambda/2k, M0 = F/4 lambda. Springs at nodes are the trapezoidal rule,
    which misses w0 by the fourth order only: the slope of the reaction has no jump, other than that of the shear force."""
    w0, m0 = -FORCE * LAMBDA / (2.0 * K), FORCE / (4.0 * LAMBDA)
    runs = [beam(n) for n in (40, 80, 160, 320)]
    w = np.array([run.column("W")[-1] / w0 - 1.0 for run in runs])
    m = np.array([middle_moment(run) / m0 - 1.0 for run in runs])
    # lambda h is 1/2 on the coarsest mesh, 1/16 on the finest.
    dr.assert_order(w, 4, below=0.3, above=0.3)
    dr.assert_order(m, 2, below=0.3, above=0.3)
    assert abs(w[-1]) < 2e-7 and abs(m[-1]) < 2e-3


def held(obstacle, load, reaction_of="RN", motion=""):
    """A clamped rod of length 1, its tip held by an obstacle in y."""
    return dr.run_deck(f"""*HEADING
Propped cantilever
*NODE
1, 0, 0
2, 1, 0
*LINE, ELSET=ROD, NSET=ROD
1, 2, 8
*NSET, NSET=TIP
2
*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS
1e6, 1
*BOUNDARY
1, ENCASTRE
*OBSTACLE, NAME=PROP, {obstacle}
*CONTACT, OBSTACLE=PROP, NSET=TIP
*MONITOR, NAME=V
2, U2
*MONITOR, NAME=R, OBSTACLE=PROP
{reaction_of}
*STEP
*STATIC, METHOD=LOAD
1
{load}
*END STEP
""")


@pytest.mark.parametrize("sense", [1, -1])
@pytest.mark.parametrize("line", ["0, 0, 2, 0", "2, 0.5, 0, 0.5"])
def test_rigid_bilateral_prop_pushes_and_pulls(sense, line):
    """3/8 of an even load; the obstacle may lie anywhere, on either side: only its direction counts."""
    run = held(f"TYPE=LINE, BILATERAL\n{line}", f"*DLOAD\nROD, PY, {sense * 1e-3}", "RF2")
    dr.assert_close(run.column("V")[-1], 0.0, absolute=1e-15)
    dr.assert_close(run.column("R")[-1], -sense * 3e-3 / 8.0, relative=1e-6)
    assert run.results.accuracy["penetration"] < 1e-13 and run.results.accuracy["tension"] == 0.0


@pytest.mark.parametrize("dy", [1e-3, -1e-3])
def test_bilateral_obstacle_takes_the_tip_along(dy):
    run = held("TYPE=LINE, BILATERAL\n0, 0, 2, 0", f"*OBSTACLE MOTION\nPROP, 0, {dy}", "RF2")
    dr.assert_close(run.column("V")[-1], dy, absolute=1e-15)
    dr.assert_close(run.column("R")[-1], 3.0 * dy, relative=2e-6)      # w'^2 is 1e-6


@functools.cache
def rail(elements, step):
    """A weightless rail, hinged at its ends, on ground that holds it; modulus K, EI 1."""
    return dr.run_deck(f"""*HEADING
Buckling of a rail
*NODE
1, 0, 0
2, 5, 0
*LINE, ELSET=RAIL, NSET=RAIL
1, 2, {elements}
*BEAM SECTION, ELSET=RAIL, SECTION=STIFFNESS
1e8, 1
*BOUNDARY
1, PINNED
2, 2
*OBSTACLE, NAME=GROUND, TYPE=LINE, FOUNDATION=WINKLER, MODULUS=64, BILATERAL
0, 0, 5, 0
*CONTACT, OBSTACLE=GROUND, NSET=RAIL
*MONITOR, NAME=END
2, U1
*STEP
{step}
*CLOAD
2, 1, -1
*END STEP
""")


def rail_loads():
    """Hetenyi 1946: (m pi/L)^2 EI + k (L/m pi)^2, m half-waves."""
    a = (np.arange(1, 12) * math.pi / 5.0)**2
    return np.sort(a + K / a)


def test_rail_buckles_up_and_down():
    """The modes are sines, also with springs at the nodes: K/a is exact, and only the rod has errors, of its order 4."""
    errors = []
    for elements in (20, 40, 80, 160):
        buckling = rail(elements, "*BUCKLE\n3").results.buckling["Step-1"]
        errors.append(np.max(np.abs(np.sort(buckling.load_factor) / rail_loads()[:3] - 1.0)))
    dr.assert_order(errors, 4, below=0.3, above=0.3)
    assert errors[-1] < 1e-6, errors
    # The path finds the first two bifurcations; the prebuckling compression is 1.6e-7. One region all along, no events.
    path = rail(80, f"*STATIC, METHOD=LOAD\n1, , 1\n*STOP\nLOAD, ABOVE, {rail_loads()[1] * 1.01}")
    dr.assert_close([point.load_factor for point in path.labelled("BP")], rail_loads()[:2], relative=1e-5)
    assert np.all(path.results.contact.count == 1) and not path.labelled("C+") and not path.labelled("C-")

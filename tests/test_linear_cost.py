"""The cost of a run grows in proportion to its elements: no procedure executes sixteen times the instructions for four times the
elements. Instructions are counted by valgrind with a clock that stands still, so that the numbers are always the same.

Exempt is the linear complementarity problem of contact at nodes: its matrix is full.
"""
import math
import os
import shutil
import subprocess

import deck_runner as dr
import digest_command
import pytest

pytestmark = [dr.release_only, pytest.mark.skipif(not (shutil.which("valgrind") and shutil.which("cc")), reason="valgrind or cc is not here")]
STEEP = 1.5               # exponent between 1, in proportion, and 2
SHARE = 5e-4              # of all instructions: what is less cannot matter, even with a hundred times the elements
FULL_MATRIX = ("lcp", "lemke", "dswap_", "dgem", "dgetr", "dtrsm_", "dtrti", "dtrmm_", "dsyrk_", "factor_positive", "dlaswp_", "idamax_")

WINKLER = """*HEADING, JOB=deck
Heavy beam on a Winkler foundation, lifted off by a point load
*NODE
1, 0., 0.
2, 12.566370614359172, 0.
*LINE, ELSET=BEAM, NSET=BEAM, TYPE=GE4
1, 2, {elements}
*BEAM SECTION, ELSET=BEAM, SECTION=STIFFNESS
1e4, 1., , 1.
*BOUNDARY
1, XSYMM
*OBSTACLE, NAME=GROUND, TYPE=LINE, FOUNDATION=WINKLER, MODULUS=4.
0., 0., 1., 0.
*CONTACT, OBSTACLE=GROUND, NSET=BEAM
*MONITOR, NAME=sinking
1, U2, -1.
*STEP
*STATIC, METHOD=LOAD
1.
*DLOAD
BEAM, GRAV, 1e-4, 0., -1.
*END STEP
*STEP
*STATIC, METHOD=LOAD
0.6, 1e-6, 0.6
*CLOAD
1, 2, -0.0023140692632779265
*STOP
LOAD, ABOVE, 1.3
*FIELD OUTPUT
DISPLACEMENT, REACTION, GAP
*END STEP
"""
RING = """*HEADING, JOB=deck
Half ring in a rigid cavity, contact anywhere along it
*NODE
1, 0., 1.
2, 0., -1.
*ARC, ELSET=RING, NSET=RING, TYPE=GE4
1, 2, 0., 0., {elements}
*BEAM SECTION, ELSET=RING, SECTION=STIFFNESS
120000., 1.
*BOUNDARY
1, XSYMM
2, XSYMM
*OBSTACLE, NAME=CAVITY, TYPE=CIRCLE, SIDE=INSIDE, REFERENCE=90.
0., 0., 1.
*CONTACT, OBSTACLE=CAVITY, NSET=RING, POINTS=ALONG
*MONITOR, NAME=v
1, U2, -1.
*STEP
*STATIC, METHOD=CYLINDRICAL
1., 1E-9, 0.05
*DLOAD
RING, PY, -1.
*STOP
v, ABOVE, 0.012
*FIELD OUTPUT
DISPLACEMENT, REACTION, GAP
*END STEP
"""
ARCH = """*HEADING, JOB=deck
Shallow arch with its first buckling mode as imperfection: limit load over the amplitude
*NODE
1, -0.5, 0.
2, 0.5, 0.
*ARC, ELSET=ARCH, TYPE=GE4, DIRECTION=CLOCKWISE
1, 2, 0., -1.2, {elements}
*BEAM SECTION, ELSET=ARCH, SECTION=STIFFNESS
3600., 1.
*BOUNDARY
1, PINNED
2, PINNED
*STEP, NAME=MODES
*BUCKLE
2
*DLOAD
ARCH, PY, -1.
*END STEP
*STEP
*STATIC, METHOD=CYLINDRICAL
0.5, 1E-9, 0.02
*IMPERFECTION, SHAPE=MODE, ELSET=ARCH, STEP=MODES
1, 0.002
*DLOAD
ARCH, PY, -1.
*LIMIT CURVE, NAME=SMALLER, PARAMETER=IMPERFECTION, ELSET=ARCH
-0.1, 0.9
*STOP
LOAD, ABOVE, 40.
*FIELD OUTPUT
DISPLACEMENT, SECTION FORCES
*END STEP
"""
CANTILEVER = """*HEADING, JOB=deck
Inextensible cantilever under a dead tip load
*NODE
1, 0., 0.
2, 1., 0.
*LINE, ELSET=ROD, TYPE=GE4
1, 2, {elements}
*BEAM SECTION, ELSET=ROD, SECTION=INEXTENSIBLE
1.
*BOUNDARY
1, ENCASTRE
*STEP
*STATIC, METHOD=LOAD
1., 1E-3, 1.
*CLOAD
2, 2, 1.
*STOP
LOAD, ABOVE, 10.
*FIELD OUTPUT
DISPLACEMENT, SECTION FORCES
*END STEP
"""


def instructions(deck: str, folder) -> dict[str, int]:
    """Instructions of each procedure in a run, without those of the procedures that it calls."""
    (folder / "deck.inp").write_text(deck, encoding="utf-8")
    clock = folder / "clock.so"
    subprocess.run(["cc", "-shared", "-fPIC", "-x", "c", "-", "-o", str(clock)], input=digest_command.STANDING_CLOCK, encoding="utf-8", check=True)
    subprocess.run(["valgrind", "--tool=cachegrind", "--cache-sim=no", "--vex-guest-chase=no", "--cachegrind-out-file=counts", os.environ["UNILAT"], "--quiet", "deck.inp"],
                   cwd=folder, env=digest_command.environment() | {"LD_PRELOAD": str(clock)}, capture_output=True, check=True)
    counts: dict[str, int] = {}
    procedure = ""
    for line in (folder / "counts").read_text(encoding="utf-8").splitlines():
        if line.startswith("fn="):
            procedure = line[3:]
        elif line[:1].isdigit():
            counts[procedure] = counts.get(procedure, 0) + int(line.split()[1])
    return counts


@pytest.mark.parametrize("deck, elements", [(WINKLER, 40), (RING, 160), (ARCH, 40), (CANTILEVER, 40)],
                         ids=["winkler", "ring", "arch", "cantilever"])
def test_every_procedure_is_linear(deck, elements, tmp_path):
    few, many = (instructions(deck.format(elements=number), tmp_path) for number in (elements, 4 * elements))
    least = SHARE * sum(many.values())
    assert sum(many.values()) > 1e8
    steep = {name: round(math.log(count / max(few.get(name, 0), 1)) / math.log(4), 2)
             for name, count in many.items() if count > least and not any(word in name for word in FULL_MATRIX)}
    steep = {name: exponent for name, exponent in steep.items() if exponent > STEEP}
    assert not steep, f"more than in proportion to the elements: {steep}"

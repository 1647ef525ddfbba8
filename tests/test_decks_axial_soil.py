"""*AXIAL SOIL: soil that holds a straight rod along its axis, elastic with a limit.

References: the pull-out of an elastic bar, EA u'' = min(k u, t), in closed form."""
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
    run = pull(("2, 1, 1\n", f"2, 1, {sign}\n"), ("ABOVE, 15", f"ABOVE, {load}"))
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

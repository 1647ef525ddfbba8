"""Beams with free ends on tensionless Winkler ground that loads away from each other lift off: openings inside the contact, ends that
come up, one after the other. Small deflections, so that beams on elastic foundations tell everything: in contact w'''' + k w = -q,
where it has lifted off w'''' = -q, in between w = 0. EI = 1."""
import cmath
import functools

import numpy as np
import pytest

import deck_runner as dr

pytestmark = dr.once_in_release

WEIGHT = 0.05
SMALL = 1e-6  # times all loads


class Beam:
    def __init__(self, length, modulus, places, forces):
        """places: of two loads; forces: per unit of the load factor, upwards."""
        self.length, self.modulus, self.places, self.forces = length, modulus, places, forces

    def deck(self, accuracy, kind="GE8", count=""):
        a, b = self.places
        return f"""*HEADING
A beam lifted off its ground
*NODE
1, 0., 0.
2, {a!r}, 0.
3, {b!r}, 0.
4, {self.length!r}, 0.
*LINE, ELSET=BEAM, NSET=BEAM, TYPE={kind}
1, 2{count}
2, 3{count}
3, 4{count}
*BEAM SECTION, ELSET=BEAM, SECTION=STIFFNESS
1e4, 1.
*BOUNDARY
2, 1
*OBSTACLE, NAME=GROUND, TYPE=LINE, FOUNDATION=WINKLER, MODULUS={self.modulus!r}
0., 0., 1., 0.
*CONTACT, OBSTACLE=GROUND, NSET=BEAM
*MONITOR, NAME=v
2, U2
*STEP
*ACCURACY, {accuracy}
*STATIC, METHOD=LOAD
1.
*DLOAD
BEAM, PY, {-WEIGHT * SMALL!r}
*END STEP
*STEP
*ACCURACY, {accuracy}
*STATIC, METHOD=LOAD
0.1, 1E-10, 0.1
*CLOAD
2, 2, {self.forces[0] * SMALL!r}
3, 2, {self.forces[1] * SMALL!r}
*STOP
LOAD, ABOVE, 1.
*END STEP
"""

    def _basis(self, s, part, touches, exp=np.exp):
        """(4 derivatives, 4 solutions) and what the weight adds, at a distance s, or many, into a part of this length."""
        if not touches:
            zero = 0.0 * s
            powers = (zero, zero, zero, zero + 1.0, s, s**2 / 2, s**3 / 6)
            return np.array([powers[3 - d:7 - d] for d in range(4)]), -WEIGHT * np.array([s**4 / 24, s**3 / 6, s**2 / 2, s])
        beta = (self.modulus / 4.0) ** 0.25
        columns = []
        for root in (-1 + 1j, 1 + 1j):  # from either end: both stay small
            shift = s if root.real < 0 else s - part
            decay = exp(beta * root * shift)
            terms = [(beta * root) ** d * decay for d in range(4)]
            columns += [[t.real for t in terms], [t.imag for t in terms]]
        settled = 0.0 * s - WEIGHT / self.modulus
        return np.array(columns).swapaxes(0, 1), np.array([settled, 0.0 * s, 0.0 * s, 0.0 * s])

    @functools.lru_cache(4096)
    def _at(self, s, part, touches):
        """The same at one distance: from one step of an iteration to the next most parts stay."""
        return self._basis(float(s), float(part), touches, cmath.exp)

    def solve(self, load, ends):
        """Displacement and its derivatives as a function of the place, with contact between these ends (rising, in pairs)."""
        cuts = np.array(sorted({0.0, self.length, *self.places, *(e for e in ends if 0.0 < e < self.length)}))
        n = len(cuts) - 1
        touch = [any(ends[i] <= 0.5 * (cuts[k] + cuts[k + 1]) <= ends[i + 1] for i in range(0, len(ends), 2)) for k in range(n)]
        matrix, right = np.zeros((4 * n, 4 * n)), np.zeros(4 * n)
        parts = []
        for k in range(n):
            part = cuts[k + 1] - cuts[k]
            parts.append((self._at(0.0, part, touch[k]), self._at(part, part, touch[k])))
        row = 0
        for k, end in ((0, 0), (n - 1, 1)):
            basis, extra = parts[k][end]
            matrix[row:row + 2, 4 * k:4 * k + 4] = basis[2:]
            right[row:row + 2] = -extra[2:]
            row += 2
        for k in range(1, n):
            before, after = parts[k - 1][1], parts[k][0]
            matrix[row:row + 4, 4 * k - 4:4 * k] = -before[0]
            matrix[row:row + 4, 4 * k:4 * k + 4] = after[0]
            right[row:row + 4] = before[1] - after[1]
            for place, force in zip(self.places, self.forces):
                if abs(cuts[k] - place) < 1e-12:
                    right[row + 3] += load * force  # the shear force -w''' jumps by the load
            row += 4
        c = np.linalg.solve(matrix, right)

        def w(x):
            parts = np.clip(np.searchsorted(cuts, x) - 1, 0, n - 1)
            if np.ndim(x) == 0:
                basis, extra = self._at(x - cuts[parts], cuts[parts + 1] - cuts[parts], touch[parts])
                return basis @ c[4 * parts:4 * parts + 4] + extra
            values = np.empty((4, len(x)))
            for k in set(parts):
                basis, extra = self._basis(x[parts == k] - cuts[k], cuts[k + 1] - cuts[k], touch[k])
                values[:, parts == k] = np.tensordot(c[4 * k:4 * k + 4], basis, (0, 1)) + extra
            return values

        return w

    def settled(self, load, ends):
        """The same with the ends where w = 0; those of the beam itself stay."""
        ends = np.array(ends, float)
        free = [i for i, e in enumerate(ends) if 1e-9 < e < self.length - 1e-9]
        for _ in range(30):
            w = self.solve(load, ends)
            here = np.array([w(ends[i])[0] for i in free])
            if not free or max(abs(here)) < 1e-13 * WEIGHT / self.modulus:
                break
            slope = np.empty((len(free), len(free)))
            for j, i in enumerate(free):
                moved = ends.copy()
                moved[i] += 1e-6
                other = self.solve(load, moved)
                slope[:, j] = [(other(moved[m])[0] - here[q]) / 1e-6 for q, m in enumerate(free)]
            ends[free] -= np.clip(np.linalg.solve(slope, here), -0.05, 0.05)
        return self.solve(load, ends), ends

    def opening(self, load, ends, near):
        """The largest w beside a place in contact, and where."""
        w, ends = self.settled(load, ends)
        x = near
        for _ in range(30):
            value = w(x)
            x -= np.clip(value[1] / value[2], -0.05, 0.05)
        return w(x)[0]

    def peaks(self, load, ends):
        """Where w is largest inside the contact."""
        w, ends = self.settled(load, ends)
        x = np.linspace(0.0, self.length, 2000)
        touch = np.any([(x > ends[i]) & (x < ends[i + 1]) for i in range(0, len(ends), 2)], axis=0)
        value = w(x)[0]
        return [x[i] for i in range(1, len(x) - 1) if touch[i - 1:i + 2].all() and value[i] > max(value[i - 1], value[i + 1])]

    def opens(self, guess, ends):
        """The load next to a guess at which one of these is zero."""
        found = []
        for near in self.peaks(guess, ends):
            loads = [guess, guess * 1.001]
            values = [self.opening(one, ends, near) for one in loads]
            for _ in range(20):
                if abs(values[1] - values[0]) <= 0.0 or abs(loads[1] - guess) > guess:
                    break
                loads = [loads[1], loads[1] - values[1] * (loads[1] - loads[0]) / (values[1] - values[0])]
                values = [values[1], self.opening(loads[1], ends, near)]
            found.append(loads[1])
        return min(found, key=lambda load: abs(load - guess))


BEAMS = [Beam(15.0, 6.74, (2.4, 13.1), (-1.0, 0.3)), Beam(14.2, 150.0, (3.27, 11.6), (-1.0, 0.2)),
         Beam(17.2, 0.72, (2.75, 12.0), (-1.0, 0.3)), Beam(23.8, 6.8, (8.8, 16.8), (-0.4, 0.5)),
         Beam(10.4, 1.3, (3.1, 7.4), (-1.0, 0.25)), Beam(9.0, 10.0, (3.7, 6.3), (0.2, -0.7))]


# These open where meshes that do for the displacement of the loaded node are long.
FAR_AWAY = [Beam(11.263182303606017, 154.66968413095594, (1.7763912166553861, 7.497160594595536), (-1.0, 0.23704445511457448)),
            Beam(8.356242053908451, 117.97944709353467, (1.9666676238077403, 7.368072551015882), (-1.0, 0.10146298414035831)),
            Beam(8.4341645205765, 378.64819081210055, (2.6684162304877574, 6.256671789573047), (-1.0, 0.15978144158399457)),
            Beam(12.55200100265624, 995.4635266374788, (1.68415655372228, 9.452499668952047), (-1.0, 0.2930780026391636))]


def contact(run, point):
    """Ends of all regions at a point, the last one with -1."""
    one = run.results.contact
    return [e for k in range(one.count[point]) for e in (one.start[point, k], one.end[point, k])]


@pytest.mark.parametrize("accuracy", ["TOLERANCE=1E-4", "TOLERANCE=1E-6"])
@pytest.mark.parametrize("number", range(len(BEAMS)))
def test_splits_and_the_end_are_those_of_the_exact_beam(number, accuracy):
    beam, asked = BEAMS[number], float(accuracy.split("=")[1])
    run = dr.run_deck(beam.deck(accuracy))
    splits = [one for one in run.labelled("C-") if "splits" in one.note]
    assert splits
    for one in splits:
        exact = beam.opens(one.load_factor, contact(run, one.point - 1))
        assert abs(one.load_factor - exact) <= one.error + 1e-9 * exact
    w, ends = beam.settled(1.0, contact(run, -1))
    motion = np.max(np.abs(w(np.linspace(0.0, beam.length, 200))[0]))
    dr.assert_close(run.column("v")[-1] / SMALL, w(beam.places[0])[0], absolute=asked * motion)
    dr.assert_close(contact(run, -1), ends, absolute=asked * beam.length)


@pytest.mark.parametrize("accuracy", ["1E-3", "1E-6"])
@pytest.mark.parametrize("number", range(len(FAR_AWAY)))
def test_no_opening_is_missed(number, accuracy):
    """With the ends of contact that the run found the exact beam is nowhere open between them, and all that opened did so within its
    bar of the exact load."""
    beam = FAR_AWAY[number]
    run = dr.run_deck(beam.deck(f"TOLERANCE={accuracy}"))
    ends = contact(run, -1)
    w, _ = beam.settled(1.0, ends)
    x = np.linspace(0.0, beam.length, 1600)
    touches = np.any([(x > ends[i]) & (x < ends[i + 1]) for i in range(0, len(ends), 2)], axis=0)
    assert np.max(w(x[touches])[0]) < 1e-3 * WEIGHT / beam.modulus     # but for where the ends are
    splits = [one for one in run.labelled("C-") if "splits" in one.note]
    assert len(splits) >= 2
    for one in splits:
        exact = beam.opens(one.load_factor, contact(run, one.point - 1))
        assert abs(one.load_factor - exact) <= one.error + 1e-9 * exact


LIFTED_FAR = """*HEADING
A beam torn off its ground, its contact's end passes a loaded node
*NODE
1, 0., 0.
2, 3.269757998085277, 0.
3, 11.606767891727793, 0.
4, 14.222574290196015, 0.
*LINE, ELSET=B, NSET=B, TYPE=GE8
1, 2
2, 3
3, 4
*BEAM SECTION, ELSET=B, SECTION=STIFFNESS
1014.6544398270232, 1.
*BOUNDARY
2, 1
*OBSTACLE, NAME=G, TYPE=LINE, FOUNDATION=WINKLER, MODULUS=147.22456798522722
0., 0., 1., 0.
*CONTACT, OBSTACLE=G, NSET=B
*MONITOR, NAME=v
2, U2, -1.
*STEP
*ACCURACY, TOLERANCE=1E-6
*STATIC, METHOD=LOAD
1.
*DLOAD
B, PY, -0.05
*END STEP
*STEP
*ACCURACY, TOLERANCE=1E-6
*STATIC, METHOD=CYLINDRICAL
0.1, 1E-10, 0.1
*CLOAD
2, 2, -1.
3, 2, 0.48292218719437385
*STOP
LOAD, ABOVE, 3.
*END STEP
"""


def test_an_end_of_contact_passes_a_loaded_node():
    """The free elements beyond the node are some layers long, but where contact ends next to it: else no mesh without a mark there has
    an equilibrium, and the mark comes nearer to the node by half in every step."""
    run = dr.run_deck(LIFTED_FAR)
    assert [one.label for one in run.results.critical] == ["EP", "C-", "C-", "C-", "EP"]
    before = [k for k, load in enumerate(run.column("load_factor")) if load > 1.0 and contact(run, k)[-1] > 3.2698]
    assert before and contact(run, -1)[-1] < 3.2697


# A pipe between two walls, which hold it along its axis, over a bed, flat or with a rounded crest. Its right end is lifted until it hangs.
OFF_THE_BED = """*HEADING
A pipe in tension is lifted off its bed
*NODE
1, 0, 0
2, 60, 0
*LINE, ELSET=PIPE, NSET=PIPE
1, 2
*BEAM SECTION, ELSET=PIPE, SECTION=STIFFNESS
420.25, 1
*BOUNDARY
1, 1
2, 1, 2
*OBSTACLE, NAME=GROUND, {ground}
*CONTACT, OBSTACLE=GROUND, NSET=PIPE
*STEP
*ACCURACY, TOLERANCE={tolerance}
*STATIC, METHOD=LOAD
0.1, , 0.5
*DLOAD
PIPE, PY, -0.0044676
*END STEP
*STEP
*ACCURACY, TOLERANCE={tolerance}
*STATIC, METHOD=LOAD
0.02, , 0.1
*BOUNDARY
2, 2, 2, 16.44
*END STEP
"""


def test_the_last_contact_ends_on_any_ground_at_the_same_height():
    """Where contact ends the ground carries nothing, so neither its modulus nor its shape matters: the pipe hangs as it did before the
    step that lifts it on. Its contact region vanishes there, and the mesh must not keep the short elements of this region, whose
    rounding would exceed the stiffness of the pipe."""
    ends = []
    crest = "TYPE=POLYLINE, RADIUS=7.02, FOUNDATION=WINKLER, MODULUS={}\n-60, 0\n23.58, 0\n180, -17.83188"
    for ground in ("TYPE=LINE\n-60, 0, 180, 0", crest.format("1.5338"), crest.format("15.")):
        for tolerance in ("1E-4", "1E-6"):
            run = dr.run_deck(OFF_THE_BED.format(ground=ground, tolerance=tolerance))
            lost = [c for c in run.results.critical if c.step == 2 and c.label == "C-"]
            assert len(lost) == 1 and run.column("negative_pivots").max() == 0
            assert abs(lost[0].corrected - lost[0].load_factor) <= lost[0].error
            ends.append(lost[0])
    for end in ends:
        assert abs(end.load_factor - ends[1].load_factor) <= end.error + ends[1].error


HEAVY = """*HEADING
Half of a heavy strip that a force lifts at its middle
*NODE
1, 0, 0
2, 2.59, 0
3, 7, 0
*LINE, ELSET=STRIP, NSET=STRIP
1, 2
*LINE, ELSET=STRIP, NSET=STRIP
2, 3
*BEAM SECTION, ELSET=STRIP, SECTION=STIFFNESS
21000000, 257.25, , , 1E-5
*BOUNDARY
1, 1
1, 6
3, 1
*OBSTACLE, NAME=FLOOR, TYPE=LINE
-7, 0, 14, 0
*CONTACT, OBSTACLE=FLOOR, NSET=STRIP
*MONITOR, NAME=lift
1, U2
*STEP
*ACCURACY, TOLERANCE=1E-6
*STATIC, METHOD=LOAD
0.1, , 0.4
*DLOAD
STRIP, PY, -660.
*END STEP
*STEP
*ACCURACY, TOLERANCE=1E-6
*STATIC, METHOD=CYLINDRICAL
0.05, , 0.05
*TEMPERATURE
STRIP, 26.864660801879
*CLOAD
1, 2, {force!r}
*STOP
LOAD, ABOVE, 1
*END STEP
"""


@pytest.mark.parametrize("force", [6.006, 12.0])
def test_a_heavy_hot_strip_is_lifted_from_zero(force):
    """a = 3/2 F/q of the half strip, 1E-4 of its length, is lifted by q a^4/(72 EI), 1E-10 of it, and by the thrust N by a part of
    (N/EI) a^2 more. The node touches until it is."""
    run = dr.run_deck(HEAVY.format(force=force))
    a, thrust = 1.5 * force / 660.0, 21e6 * 1e-5 * 26.864660801879
    lift = 660.0 * a**4 / (72.0 * 257.25)
    assert 0.0 <= run.results.critical[-1].monitors["lift"] - lift <= thrust / 257.25 * a**2 * lift


LYING = """*HEADING
A heavy beam on a rigid floor that a force lifts at a node
*NODE
1, 0, 0
2, 24, 0
3, 40, 0
*LINE, ELSET=BEAM, NSET=BEAM
1, 2
2, 3
*BEAM SECTION, ELSET=BEAM, SECTION=STIFFNESS
1e4, 1
*BOUNDARY
1, 1
*OBSTACLE, NAME=FLOOR, TYPE=LINE
0, 0, 1, 0
*CONTACT, OBSTACLE=FLOOR, NSET=BEAM
*STEP
*STATIC, METHOD=LOAD
1.
*DLOAD
BEAM, PY, -1.
*END STEP
*STEP
*STATIC, METHOD=LOAD
0.05, , 0.1
*CLOAD
2, 2, {force!r}
*END STEP
"""


@pytest.mark.parametrize("force", [0.04, 4.0])
def test_where_a_force_begins_to_lift_a_lying_beam_is_zero_or_not_located(force):
    """Any force lifts the beam, by 3/4 F/q on both sides. A force of 0.04 lifts less than 2E-4 of its parts up to load factor 0.1."""
    run = dr.run_deck(LYING.format(force=force), code=None)
    opening = run.labelled("C-")[0]
    if opening.located:
        assert run.code == 0 and abs(opening.load_factor) <= 1e-6
    else:
        assert run.code == 2 and "between load factors" in run.stderr

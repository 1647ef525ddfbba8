"""What a run says: columns of contact in the listing, and progress on a terminal."""
import os
import pty
import subprocess
import tempfile

import deck_runner as dr


def critical_rows(stdout, label):
    """Rows of the table of critical points with a label, as words."""
    table = stdout.split("Critical points")[1].split("\n\n")[0]
    return [line.split() for line in table.splitlines() if line.startswith(f" {label} ")]


def test_table_2_in_the_listing():
    """The angles of separation of the paper's Table 2 stand beside its loads, as in the result file and near the exact ones."""
    run = dr.run_deck(dr.on_given_mesh("ring"))
    exact = dr.reference("ring_angles")
    assert "start angle, CAVITY" in run.stdout
    rows = critical_rows(run.stdout, "UZ")
    loads = [float(row[3]) for row in rows]
    angles = [float(row[6]) for row in rows]
    assert loads == [28.0, 34.0, 57.0, 62.0, 62.0, 57.0, 34.0, 28.0]
    points = [int(row[1]) for row in rows]
    stored = [min(region.angle_start for region in run.results.contact.regions(point)) for point in points]
    dr.assert_close(angles, stored, absolute=1e-5)
    # 34 and 57 on the way up, 62 and 28 on the way down; the exact angles are good to 1e-7 degrees, the mesh to 1e-6.
    exact = next(row for row in zip(*(exact[f"phi_{name}"] for name in ("34", "57", "cr", "62", "28"))) if abs(row[0] - 32.944) < 1e-3)
    top = float(critical_rows(run.stdout, "LP")[0][8])
    dr.assert_close([angles[1], angles[2], top, angles[4], angles[7]], exact, absolute=5e-6)


def test_columns_of_several_stretches():
    """A beam that comes down on a hump: a second stretch has columns of its own, empty before it is there."""
    deck = """*HEADING
A long rod over a hump
*NODE
1, 0, 0
2, 4, 0
*LINE, ELSET=ROD, NSET=ROD
1, 2, 8
*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS
1e4, 1
*BOUNDARY
1, PINNED
2, 2
*OBSTACLE, NAME=FIRST, TYPE=CIRCLE, SIDE=OUTSIDE
1, -2.05, 2
*CONTACT, OBSTACLE=FIRST, NSET=ROD
*CONTACT PRINT, OBSTACLE=FIRST
START
END
START, 2
*MONITOR, NAME=mid
ROD, U2
*STEP
*STATIC, METHOD=LOAD
0.05, , 0.05
*DLOAD
ROD, PY, -1
*STOP
LOAD, ABOVE, 0.4
*END STEP
"""
    run = dr.run_deck(deck)
    heads = next(line for line in run.stdout.splitlines() if "load factor" in line and "mid" in line)
    assert "start, FIRST" in heads and "end, FIRST" in heads and "start 2, FIRST" in heads
    touch = critical_rows(run.stdout, "C+")[0]
    # Where it first touches, over the hump's top, is where the stretch begins and ends; there is no second one.
    *_, mid, start, start_bar, end, end_bar = (float(word) for word in touch[1:] if word[0] in "-0123456789")
    assert mid < 0 and start == end and start_bar == end_bar < 1e-6
    dr.assert_close(start, 1.0, absolute=0.1)


@dr.release_only
def test_progress_on_a_terminal_only(shim):
    """A line that comes and goes where standard error is a terminal; nothing where it is not. The clock is that of kill_at_write.c, by
    which every run takes long enough."""
    program = os.environ["UNILAT"]
    text = dr.on_given_mesh("ring")
    reader, terminal = pty.openpty()
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.Popen([program, "-o", "a.h5"], stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=terminal,
                                cwd=folder, env={**os.environ, "LD_PRELOAD": dr.preload(shim), "KILL_AT": "0", "KILL_LOG": "count", "KILL_COPY": "copy"})
        os.close(terminal)
        done.stdin.write(text.encode())
        done.stdin.close()
        said = b""
        try:
            while chunk := os.read(reader, 4096):
                said += chunk
        except OSError:     # the other end is closed
            pass
        assert done.wait(timeout=120) == 0
        quiet = subprocess.run([program, "-o", "b.h5"], input=text, capture_output=True, text=True, cwd=folder, timeout=120)
    os.close(reader)
    assert b"step 1, " in said and b"load factor" in said and b"\n" not in said
    assert said.rstrip(b"\r").endswith(b" " * 79)
    assert quiet.returncode == 0 and quiet.stderr == ""


def test_an_obstacle_that_no_contact_names():
    """A forgotten card is seen; an obstacle left out of a comparison may stay in its deck."""
    contact = "*CONTACT, OBSTACLE=WALL, NSET=COLUMN, POINTS=ALONG\n"
    for text, said in ((dr.example("column"), False), (dr.changed(dr.example("column"), (contact, ""), (", REACTION\n", "\n")), True)):
        assert ("; no *CONTACT names it" in dr.run_deck(text, "--check").stdout) == said

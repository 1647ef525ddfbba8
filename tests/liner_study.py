"""Liners in rigid hosts: does every one run to its end, and is its limit point right?

    UNILAT=.build/release/unilat PYTHONPATH=postproc python3 tests/liner_study.py             # 240 runs, 16 GE8 each
    ... tests/liner_study.py --every 13 --kind GE4 --elements 140 --points NODES

R/t 25, 50, 100, one lobe and two, 5 disturbances x 8 gaps; exact limit points from reference/liner_limits.csv.

right:   complete (exit code 0), one limit point, within --tolerance of the exact one
wrong:   complete, but no limit point, several, or another one
stopped: another exit code; `at` is the last load factor, `LP` what was found until then
"""

from __future__ import annotations

import argparse
import collections
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field

import contact_cases as cases
import numpy as np
from unilat.results import ResultsError, read_results


@dataclass
class Outcome:
    code: int
    seconds: float = 0.0
    points: int = 0
    last: float = 0.0                                   # load factor
    limits: list = field(default_factory=list)
    bifurcations: int = 0
    reason: str = ""


def run(text: str) -> Outcome:
    """Runs a deck in a folder of its own, which is removed."""
    with tempfile.TemporaryDirectory(prefix="unilat-") as folder:
        (pathlib.Path(folder) / "deck.inp").write_text(text, encoding="utf-8")
        begin = time.perf_counter()
        try:
            done = subprocess.run([os.environ["UNILAT"], "deck.inp"], cwd=folder, capture_output=True, encoding="utf-8",
                                  timeout=120, check=False)
        except subprocess.TimeoutExpired:
            return Outcome(-1, 120.0, reason="time")
        outcome = Outcome(done.returncode, time.perf_counter() - begin)
        found = re.search(r"unilat: (.*)", done.stderr)
        outcome.reason = found[1][:110] if found else ""
        files = list(pathlib.Path(folder).glob("*.h5"))
        try:
            results = read_results(str(files[0]))
        except (IndexError, ResultsError, OSError):
            return outcome
        outcome.points = results.n_points
        outcome.last = float(results.column("load_factor").values[-1])
        outcome.limits = [c.load_factor for c in results.critical if c.label == "LP"]
        outcome.bifurcations = sum(c.label == "BP" for c in results.critical)
        return outcome


def main():
    from test_decks_span_accuracy import liner_deck
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--every", type=int, default=1, help="every n-th case")
    parser.add_argument("--kind", default="GE8")
    parser.add_argument("--elements", type=int, default=16)
    parser.add_argument("--points", help="of *CONTACT: NODES, ...")
    parser.add_argument("--tolerance", type=float, default=1e-6)
    parser.add_argument("--all", action="store_true", help="print right ones, too")
    options = parser.parse_args()
    counts, errors, seconds, groups = collections.Counter(), [], 0.0, collections.defaultdict(collections.Counter)
    print(f"{'R/t':>4} {'lobes':>5} {'disturb.':>8} {'gap':>7} {'exact':>11} {'LP':>11} {'error':>8}"
          f" {'points':>6} {'s':>6}  outcome")
    for (slenderness, lobes, disturbance, gap), exact in list(cases.liner_table().items())[::options.every]:
        text = liner_deck(slenderness, lobes, disturbance, gap, options.elements, options.kind)
        if options.points:
            text = text.replace("NSET=LINER\n*MONITOR", f"NSET=LINER, POINTS={options.points}\n*MONITOR")
        out = run(text)
        near = min(out.limits, key=lambda load: abs(load - exact), default=float("nan"))
        error = near / exact - 1.0
        if out.code != 0:
            verdict = "stopped"
        else:
            verdict = "right" if len(out.limits) == 1 and abs(error) <= options.tolerance else "wrong"
            errors += [abs(error)]
        note = {"stopped": f" at {out.last:.6g}: {out.reason}", "right": ""}.get(verdict, f" {len(out.limits)} LP")
        if out.bifurcations:
            note += f", {out.bifurcations} BP"
        counts[verdict] += 1
        groups[slenderness, lobes][verdict] += 1
        seconds += out.seconds
        if options.all or verdict != "right":
            print(f"{slenderness:4} {lobes:5} {disturbance:8g} {gap:7g} {exact:11.7f} {near:11.7f} {error:8.1e} {out.points:6}"
                  f" {out.seconds:6.2f}  {verdict}{note}", flush=True)
    print(f"\n{options.elements} {options.kind}: " + ", ".join(f"{name} {n}" for name, n in counts.most_common())
          + f" of {sum(counts.values())}; {seconds:.1f} s")
    for (slenderness, lobes), group in groups.items():
        print(f"  R/t {slenderness:3}, lobes {lobes}: " + ", ".join(f"{name} {n}" for name, n in group.most_common()))
    if errors:
        print(f"errors of complete runs: median {np.nanmedian(errors):.1e}, largest {np.nanmax(errors):.1e}")
    return 0 if set(counts) <= {"right"} else 1


if __name__ == "__main__":
    sys.exit(main())

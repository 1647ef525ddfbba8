"""Makes the runs of a study one after the other, so that their times are their own; a table and a picture of them."""

from __future__ import annotations

import csv
import math
import os
import platform

from ..plot import style
from ..results import read_results
from ..sweep.pool import Progress
from ..sweep.run_folder import RunFolder
from . import peer
from .study_file import Study
from .timed_run import Timed, timed
from .verdict import Finding, finding

LEAST = 1e-14       # errors below are drawn there


def make_study(study: Study, folder: RunFolder) -> list[tuple[str, dict, Timed, list[Finding]]]:
    """Rows: curve, parameters, what the run took, its findings. Without openseespy its curves are left out, and that is said."""
    rows = []
    runs = [run for run in study.runs if run[3] is None or peer.is_there()]
    for curve in dict.fromkeys(run[0] for run in study.runs if run not in runs):
        print(f"left out: {curve}: openseespy is not installed (pip install openseespy)")
    progress = Progress(len(runs))
    for curve, values, deck, settings in runs:
        place = folder if settings is None else peer.PeerFolder(folder, settings)
        took = timed(place, deck, study.repeats, study.timeout)
        name = place.results(place.key(deck))
        results = read_results(name) if took.code in (0, 2) and os.path.exists(name) else None
        rows.append((curve, values, took, [finding(check, values, took.code, results, study.name) for check in study.checks]))
        progress.add(took.code)
    return rows


def machine() -> str:
    """The processor's model."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            return next(line.split(":", 1)[1].strip() for line in file if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.machine()


def write_study(study: Study, rows, filename: str):
    """Errors and bars are relative; bar over error says how much wider than needed the bar is."""
    with open(f"{filename}.part", "w", newline="", encoding="utf-8") as file:
        file.write(f"# {study.title or study.name}\n# {machine()}; seconds: least of {study.repeats} runs, one at a time on one core\n")
        table = csv.writer(file, lineterminator="\n")
        names = list(dict.fromkeys(name for _, values, _, _ in rows for name in values))
        table.writerow(["curve", *names, "solver_seconds", "process_seconds", "megabytes",
                        *(f"{check.name} {what}" for check in study.checks for what in ("value", "error", "bar", "bar over error")),
                        "code", "message"])
        for curve, values, took, findings in rows:
            found = [part for each in findings for part in (repr(each.value), f"{each.error:.3g}", f"{each.bar:.3g}",
                                                            f"{each.bar / each.error:.3g}" if each.error else "")]
            table.writerow([curve, *(values.get(name, "") for name in names), f"{took.solver:.5f}", f"{took.wall:.5f}",
                            f"{took.megabytes:.1f}", *found, took.code, took.message])
    os.replace(f"{filename}.part", filename)


@style.drawing
def draw_study(study: Study, rows, filename: str):
    """The largest error of the checks over the program's own time. Hollow: the run ended with 2."""
    figure = style.new_figure(120.0, 85.0, 200.0, constrained_layout=True)
    axes = figure.add_subplot()
    for number, curve in enumerate(dict.fromkeys(row[0] for row in rows)):
        points = [(took.solver, max(max(each.error for each in findings), LEAST), took.code) for name, _, took, findings in rows
                  if name == curve and not math.isnan(took.solver) and not any(math.isnan(each.error) for each in findings)]
        look = style.look(number)
        axes.plot([x for x, _, _ in points], [y for _, y, _ in points], label=curve, **look)
        for x, y, code in points:
            axes.plot(x, y, marker="o", markersize=4, markerfacecolor="white" if code else look["color"],
                      markeredgecolor=look["color"], linestyle="none")
    axes.set(xscale="log", yscale="log", xlabel="time in the program (s)", ylabel="relative error")
    axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
    style.lay_out(figure)
    figure.savefig(filename)

"""Studies of all runs of several maps: the file that names them, the runs, and what is made of their cases.

A case is a value with an exact one, of one run. It has `scene`, the name of its map, and `values`, the parameters of its run.
"""

from __future__ import annotations

import csv
import os
from collections.abc import Callable

from matplotlib.lines import Line2D

from ..plot import style
from ..results import ResultsError
from ..sweep.pool import Progress, run_pool
from ..sweep.run_folder import RunFolder
from ..sweep.sweep_file import read_text, read_toml
from ..sweep.work import to_do
from .map_file import Map, read_map


def names_maps(filename: str, key: str) -> bool:
    """Whether the study is of the kind that names its maps under `key`."""
    return key in read_toml(read_text(filename), filename)


def read_maps(filename: str, key: str, program: str) -> list[Map]:
    """`program` reads their decks."""
    content = read_toml(read_text(filename), filename)
    if set(content) - {"title", key}:
        raise ResultsError(f"{filename}: such a study has title and {key} only, a list of maps")
    return [read_map(os.path.join(os.path.dirname(filename), name), program) for name in content[key]]


def make_runs(maps: list[Map], folder: RunFolder, jobs: int) -> list[list[str]]:
    """Makes what is not there yet; the keys of the runs, map by map."""
    keys = [[folder.key(deck) for deck in each.decks] for each in maps]
    missing = to_do(folder, {key: deck for each, own in zip(maps, keys) for key, deck in zip(own, each.decks)}, retry=False)
    run_pool(folder, missing, jobs, max(each.sweep.timeout or 60.0 for each in maps), Progress(len(missing)))
    folder.sweep_up()
    return keys


def make_study(filename: str, key: str, folder: RunFolder, jobs: int, cases_of: Callable, summary: Callable, remark: str,
               columns: dict[str, Callable], draw: Callable) -> list:
    """Makes the runs of all maps; a table of the cases, a summary, a picture. The cases.

    `cases_of(map, folder, keys)` gives those of a map, `summary(cases)` text, `columns` what stands in a row of the table beside the
    map and the parameters, `draw(axes, cases, colours)` all but the legend.
    """
    maps = read_maps(filename, key, folder.program)
    keys = make_runs(maps, folder, jobs)
    cases = [case for each, own in zip(maps, keys) for case in cases_of(each, folder, own)]
    stem = os.path.join(folder.folder, os.path.splitext(os.path.basename(filename))[0])
    write_cases(cases, remark, columns, f"{stem}.csv")
    if cases:
        text = summary(cases)
        with open(f"{stem}.txt", "w", encoding="utf-8") as file:
            file.write(text)
        print(text, end="")
        draw_cases(cases, draw, f"{stem}.png")
        print(f"table: {stem}.csv\npicture: {stem}.png")
    return cases


def write_cases(cases: list, remark: str, columns: dict[str, Callable], filename: str):
    names = list(dict.fromkeys(name for case in cases for name in case.values))
    with open(f"{filename}.part", "w", newline="", encoding="utf-8") as file:
        file.write(f"# {remark}; bar inf: the mesh is too coarse to tell\n")
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["map", *names, *columns])
        for case in cases:
            table.writerow([case.scene, *(case.values.get(name, "") for name in names), *(cell(case) for cell in columns.values())])
    os.replace(f"{filename}.part", filename)


def scenes_of(cases: list) -> list[str]:
    return list(dict.fromkeys(case.scene for case in cases))


@style.drawing
def draw_cases(cases: list, draw: Callable, filename: str):
    """One axes with logarithms, a colour a scene."""
    figure = style.new_figure(150.0, 90.0, 200.0, constrained_layout=True)
    axes = figure.add_subplot()
    colours = {name: style.COLOURS[number % len(style.COLOURS)] for number, name in enumerate(scenes_of(cases))}
    draw(axes, cases, colours)
    axes.set(xscale="log", yscale="log")
    axes.legend(handles=[Line2D([], [], marker="o", markersize=3.0, linestyle="none", color=colour, label=name)
                         for name, colour in colours.items()], loc="center left", bbox_to_anchor=(1.01, 0.5))
    style.lay_out(figure)
    figure.savefig(filename)

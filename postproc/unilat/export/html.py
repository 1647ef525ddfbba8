"""One page with a slider: the shape beside the path, for any browser, nothing to install."""

from __future__ import annotations

import html
import importlib.resources
import json
import os

import numpy as np

from ..chosen_points import branch_number, count
from ..options import Parser, positive, tell_unfinished
from ..results import Path, Results, ResultsError, read_results
from ..results.force_glyphs import Scales, glyphs, value_text
from ..results.mirror import mirror_line, mirrored
from ..results.motion import Frame, Motion
from ..results.obstacle_surface import strokes, surfaces
from ..results.rod_shape import Shape, contact_pieces, idle_pieces, join
from ..results.section_curves import between_ends, shape_at

DESCRIPTION = """\
Write one HTML page: the deformed shape beside the path and its branches, with a slider, a player and a choice of the quantities of both
axes. Between stored points the structure moves on along smooth curves; contact forces are arrows with their values, pressure is a
band, section forces are drawn when they are asked for, and the pointer shows values of the path and of the rods. The page holds
everything it needs; no network, no other files. The deck must have asked for *FIELD OUTPUT with DISPLACEMENT."""

EXAMPLES = """\
examples:
  unilat-plot html ring.h5 --mirror x=0             writes ring.html
  unilat-plot html column.h5 --x midspan --stretch-y 5
"""

PIECES = 200    # that a structure is drawn with, at least
DIGITS = 5      # of the size of the picture: far less than a pixel


def main(argv=None) -> int:
    parser = Parser("unilat-plot html", DESCRIPTION, EXAMPLES)
    parser.add_argument("file", metavar="RESULTS", help="result file of unilat (HDF5)")
    parser.add_argument("--branch", type=branch_number, default=0, metavar="K", help="branch K alone, instead of the path of the steps with "
                        "all branches")
    parser.add_argument("--x", metavar="NAME", help="quantity along x of the path (default: the first monitor, else point)")
    parser.add_argument("--y", metavar="NAME", default="load_factor", help="quantity along y (default load_factor)")
    parser.add_argument("--mirror", type=mirror_line, metavar="x=X|y=Y", help="add the mirror image over this line")
    parser.add_argument("--stretch-y", type=positive, default=1.0, metavar="F",
                        help="draw shapes with y F times larger (default 1: equal scales); the page says so")
    parser.add_argument("--frames", type=count, default=60, metavar="N", help="about as many shapes along the path, one at every stored "
                        "point among them (default 60; 1: the stored points alone)")
    parser.add_argument("-o", "--output", metavar="FILE", help="default: named after the result file, in the current folder")
    args = parser.parse_args(argv)
    results = read_results(args.file)
    path = results.path_number(args.branch)
    output = args.output or f"{os.path.splitext(os.path.basename(args.file))[0]}.html"
    data = page_data(results, path, args)
    template = importlib.resources.files(__package__).joinpath("page.html").read_text(encoding="utf-8")
    title = html.escape(results.title or os.path.basename(args.file))
    text = json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    try:
        with open(output, "w", encoding="utf-8") as file:
            file.write(template.replace("@TITLE@", title).replace("@DATA@", text))
    except OSError as problem:
        raise ResultsError(f"{output}: cannot be written: {problem.strerror or problem}") from problem
    shapes = len(data["frames"]) + sum(map(len, data["between"]))
    print(f"wrote {output} ({shapes} shapes, {os.path.getsize(output) // 1024} kB)")
    tell_unfinished([results])
    return 0


def page_data(results: Results, path: Path, args) -> dict:
    """All that the page draws, as JSON has it: the first path at the top, its branches in a list of the same kind."""
    if not has_shapes(path):
        raise ResultsError(f"{path.filename}: no displacements are stored (*FIELD OUTPUT)")
    branches = [branch for branch in results.branches.values() if has_shapes(branch)] if not args.branch else []
    moving = [Motion(each) for each in (path, *branches)]
    frames = [motion.frames(args.frames) for motion in moving]
    home = Shape(path.mesh)
    shapes = [home, *(frame.shape for group in frames for frame in group)]
    everything = np.concatenate([curve for shape in shapes for curve in mirrored(shape.curves(), args.mirror)])
    reach = float(np.max(np.ptp(everything, axis=0) * (1.0, args.stretch_y)))
    scales = Scales.of([(frame.forces, frame.pressures) for group in frames for frame in group])
    corners = [glyphs(frame.forces, frame.pressures, scales, reach, args.stretch_y).corners() for group in frames for frame in group]
    everything = np.concatenate([everything, *mirrored([each for each in corners if len(each)], args.mirror)])
    low, high = everything.min(axis=0), everything.max(axis=0)
    with_sections = any("section_forces" in each.field_names for each in (path, *branches))      # their diagrams need room
    margin = (0.18 if with_sections else 0.05) * np.max((high - low) * (1.0, args.stretch_y)) / np.array((1.0, args.stretch_y))
    drawn = Drawn(np.array((low - margin, high + margin)), reach, scales, int(np.clip(PIECES // len(path.mesh.elements), 2, 32)), args)
    x = path.column(args.x or next(iter(path.monitors), "point")).name
    y = path.column(args.y).name
    status = "" if results.complete else f"The run did not come to its end: {results.status}."
    scale = "" if args.stretch_y == 1.0 else f"y is drawn {args.stretch_y:g} times larger than x."
    first, *others = [drawn.path(motion, group) for motion, group in zip(moving, frames)]
    names = [f"branch {branch.number}: {branch.name}, {'plus' if branch.side > 0 else 'minus'}" for branch in branches]
    return {"step": drawn.step, "stretch": args.stretch_y, "limits": drawn.rounded(drawn.limits),
            "home": drawn.rounded(mirrored(home.curves(), args.mirror)), "obstacles": drawn.obstacles(path, path.points_with("displacement")[0] - 1),
            "samples": drawn.pieces, "x": x, "y": y, "note": f"{status} {scale}".strip(), "nodes": path.mesh.node_label.tolist(), "elements": path.mesh.elements.tolist(),
            **first, "branches": [{"name": name, **other} for name, other in zip(names, others)]}


def has_shapes(path: Path) -> bool:
    return "displacement" in path.field_names and path.points_with("displacement").size > 0


class Drawn:
    """What the page draws, in whole numbers of `step`."""

    def __init__(self, limits: np.ndarray, reach: float, scales: Scales, pieces: int, args):
        """`pieces`: straight ones that an element is drawn with."""
        self.limits, self.reach, self.scales, self.args = limits, reach, scales, args
        self.size = float(np.max((limits[1] - limits[0]) * (1.0, args.stretch_y)))
        self.pieces = pieces
        self.step = 10.0 ** (np.floor(np.log10(self.size)) - DIGITS)

    def rounded(self, curves) -> list:
        return [(np.round(np.asarray(curve) / self.step).astype(int)).tolist() for curve in curves]

    def obstacles(self, path: Path, row: float) -> dict:
        unit, lines, hatches = np.array((1.0, self.args.stretch_y)), [], []
        for obstacle in path.obstacles_between(float(row)):
            for surface, solid in surfaces(obstacle, self.limits, self.args.stretch_y):
                lines.append(surface)
                hatches += list(strokes(surface, solid, unit, self.size))
        return {"lines": self.rounded(lines), "strokes": self.rounded(hatches)}

    def path(self, motion: Motion, frames: list[Frame]) -> dict:
        """One path: its frames at stored points, those between, its columns with their rates, and what draws it."""
        path = motion.path
        sections = path.points_with("section_forces") if "section_forces" in path.field_names else np.zeros(0, dtype=int)
        stored, between = [], []
        for frame in frames:
            told = self.frame(path, frame)
            if frame.row == frame.nearest - 1:
                if frame.nearest in sections:
                    forces = between_ends(shape_at(path, frame.nearest), path.field("section_forces", frame.nearest), self.pieces)
                    told["sections"] = [[[float(f"{value:.5g}") for value in place] for place in element] for element in forces.tolist()]
                stored.append({"point": frame.nearest, **told})
                between.append([])
            else:
                between[-1].append({"row": round(frame.row, 4), **told})
        labels = path.path["label"].values if "label" in path.path else np.full(path.n_points, "")
        steps = path.path["step"].values if "step" in path.path else np.ones(path.n_points, dtype=int)
        arc = path.path["arc_length"].values if "arc_length" in path.path else np.arange(path.n_points)
        columns = [column for column in (path.column(name) for name in path.column_names()) if column.values.dtype.kind in "biuf"]
        return {"frames": stored, "between": between[:-1], "labels": [str(label) for label in labels],
                "stable": [not value for value in path.unstable().tolist()], "steps": steps.tolist(),
                "anew": [step for step, loads in path.loads.items() if loads.stress_free_start], "arc": arc.tolist(),
                "columns": {column.name: {"units": column.units, "values": _numbers(column.values),
                                          **({"rate": _numbers(column.rate)} if column.rate is not None else {})} for column in columns}}

    def frame(self, path: Path, frame: Frame) -> dict:
        """One shape with what touches and pushes it."""
        shape, mirror = frame.shape, self.args.mirror
        pieces, spots = contact_pieces(path, frame.nearest, shape, frame.regions)
        spots = [spot for each in mirrored([spots], mirror) for spot in each]
        pushed = glyphs(frame.forces, frame.pressures, self.scales, self.reach, self.args.stretch_y)
        told = {"rods": self.rounded(mirrored(shape.curves(self.pieces), mirror)),
                "contact": self.rounded(mirrored(join(pieces, shape, self.pieces), mirror)),
                "spots": self.rounded(spots)}
        idle = idle_pieces(path, frame.nearest, shape, frame.regions)
        if idle:
            told["idle"] = self.rounded(mirrored(join(idle, shape, self.pieces), mirror))
        if pushed.arrows:
            lines = mirrored([np.vstack((arrow.tail, arrow.tip)) for arrow in pushed.arrows], mirror)
            told["arrows"] = [[line, value_text(pushed.arrows[k % len(pushed.arrows)].value)] for k, line in enumerate(self.rounded(lines))]
        if pushed.bands:
            outlines = mirrored([np.vstack((band.outline, band.top, band.foot)) for band in pushed.bands], mirror)
            told["bands"] = [[line, value_text(pushed.bands[k % len(pushed.bands)].value)] for k, line in enumerate(self.rounded(outlines))]
        moving = path.contact is not None and path.contact.obstacle_shift is not None
        told["obstacles"] = self.obstacles(path, frame.row) if moving else None
        return told


def _numbers(values: np.ndarray) -> list:
    return [float(value) if np.isfinite(value) else None for value in values]

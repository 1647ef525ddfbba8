"""One page with a slider: the shape beside the path, for any browser, nothing to install."""

from __future__ import annotations

import html
import importlib.resources
import json
import os

import numpy as np

from ..chosen_points import branch_number
from ..options import Parser, positive, tell_unfinished
from ..results import Path, Results, ResultsError, read_results
from ..results.mirror import mirror_line, mirrored
from ..results.obstacle_surface import strokes, surfaces
from ..results.rod_shape import Shape, contact_pieces, join

DESCRIPTION = """\
Write one HTML page: the deformed shape at each stored point beside the path, with a slider, a player and a choice of the quantities
of both axes. The page holds everything it needs; no network, no other files. The deck must have asked for *FIELD OUTPUT with
DISPLACEMENT."""

EXAMPLES = """\
examples:
  unilat-plot html ring.h5 --mirror x=0             writes ring.html
  unilat-plot html column.h5 --x midspan --stretch-y 5
"""

DIGITS = 5      # of the size of the picture: far less than a pixel


def main(argv=None) -> int:
    parser = Parser("unilat-plot html", DESCRIPTION, EXAMPLES)
    parser.add_argument("file", metavar="RESULTS", help="result file of unilat (HDF5)")
    parser.add_argument("--branch", type=branch_number, default=0, metavar="K", help="branch K instead of the path of the steps")
    parser.add_argument("--x", metavar="NAME", help="quantity along x of the path (default: the first monitor, else point)")
    parser.add_argument("--y", metavar="NAME", default="load_factor", help="quantity along y (default load_factor)")
    parser.add_argument("--mirror", type=mirror_line, metavar="x=X|y=Y", help="add the mirror image over this line")
    parser.add_argument("--stretch-y", type=positive, default=1.0, metavar="F",
                        help="draw shapes with y F times larger (default 1: equal scales); the page says so")
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
    print(f"wrote {output} ({len(data['frames'])} shapes, {os.path.getsize(output) // 1024} kB)")
    tell_unfinished([results])
    return 0


def page_data(results: Results, path: Path, args) -> dict:
    """All that the page draws, as JSON has it."""
    if "displacement" not in path.field_names or path.points_with("displacement").size == 0:
        raise ResultsError(f"{path.filename}: no displacements are stored (*FIELD OUTPUT)")
    points = path.points_with("displacement")
    shapes = {int(point): Shape(path.mesh, path.field("displacement", point)) for point in points}
    home = Shape(path.mesh)
    everything = np.concatenate([curve for shape in (home, *shapes.values()) for curve in mirrored(shape.curves(), args.mirror)])
    low, high = everything.min(axis=0), everything.max(axis=0)
    margin = 0.05 * np.max((high - low) * (1.0, args.stretch_y)) / np.array((1.0, args.stretch_y))
    limits = np.array((low - margin, high + margin))
    size = float(np.max((limits[1] - limits[0]) * (1.0, args.stretch_y)))
    step = 10.0 ** (np.floor(np.log10(size)) - DIGITS)

    def rounded(curves) -> list:
        return [(np.round(np.asarray(curve) / step).astype(int)).tolist() for curve in curves]

    moving = path.contact is not None and path.contact.obstacle_shift is not None

    def drawn_obstacles(point: int) -> dict:
        unit, lines, hatches = np.array((1.0, args.stretch_y)), [], []
        for obstacle in path.obstacles_at(point):
            for surface, solid in surfaces(obstacle, limits, args.stretch_y):
                lines.append(surface)
                hatches += list(strokes(surface, solid, unit, size))
        return {"lines": rounded(lines), "strokes": rounded(hatches)}

    frames = []
    for point, shape in shapes.items():
        pieces, spots = contact_pieces(path, point, shape)
        spots = [spot for each in mirrored([spots], args.mirror) for spot in each]
        frames.append({"point": point, "rods": rounded(mirrored(shape.curves(), args.mirror)),
                       "contact": rounded(mirrored(join(pieces, shape), args.mirror)), "spots": rounded(spots),
                       "obstacles": drawn_obstacles(point) if moving else None})
    columns = [path.column(name) for name in path.column_names()]
    columns = [column for column in columns if column.values.dtype.kind in "biuf"]
    x = path.column(args.x or next(iter(path.monitors), "point")).name
    y = path.column(args.y).name
    pivots = path.path["negative_pivots"].values if "negative_pivots" in path.path else np.zeros(path.n_points)
    labels = path.path["label"].values if "label" in path.path else np.full(path.n_points, "")
    status = "" if results.complete else f"The run did not come to its end: {results.status}."
    scale = "" if args.stretch_y == 1.0 else f"y is drawn {args.stretch_y:g} times larger than x."
    return {"step": step, "stretch": args.stretch_y, "limits": rounded(limits), "home": rounded(mirrored(home.curves(), args.mirror)),
            "obstacles": drawn_obstacles(int(points[0])), "frames": frames, "x": x, "y": y, "note": f"{status} {scale}".strip(),
            "labels": [str(label) for label in labels], "stable": [bool(value == 0) for value in pivots],
            "columns": {column.name: {"units": column.units, "values": [float(value) if np.isfinite(value) else None
                                                                        for value in column.values]} for column in columns}}

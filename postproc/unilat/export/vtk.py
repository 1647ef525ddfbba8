"""Time series for ParaView, in VTK's own HDF5 format (VTKHDF)."""

from __future__ import annotations

import os

import h5py
import numpy as np

from ..chosen_points import branch_number, count
from ..options import Parser, tell_unfinished
from ..results import Path, ResultsError, read_results
from ..results.obstacle_surface import surfaces
from ..results.rod_shape import Shape, contact_pieces
from ..results.section_curves import between_ends

DESCRIPTION = """\
Write the deformed rods of all stored points as a time series for ParaView 5.12 or newer (VTKHDF); the time is the number of the
point, load factor and monitors are field data. The deck must have asked for *FIELD OUTPUT with DISPLACEMENT. Every element is
a polyline with points of its own, so section forces may jump between two; its axis and section forces are those of the pictures. Point
data, as far as the file has them: displacement, rotation, N, Q, M, reaction_density, gap and contact (1 where the rod touches).
Obstacles go to a second file, NAME-obstacles.vtkhdf."""

EXAMPLES = """\
examples:
  unilat-plot vtk ring.h5                 writes ring.vtkhdf and ring-obstacles.vtkhdf
  unilat-plot vtk arch.h5 --branch 1 --pieces 1 -o branch.vtkhdf
"""

POLYLINE = 4     # number of VTK's cell type


def main(argv=None) -> int:
    parser = Parser("unilat-plot vtk", DESCRIPTION, EXAMPLES)
    parser.add_argument("file", metavar="RESULTS", help="result file of unilat (HDF5)")
    parser.add_argument("--branch", type=branch_number, default=0, metavar="K", help="branch K instead of the path of the steps")
    parser.add_argument("--pieces", type=count, default=8, metavar="N", help="straight pieces an element (default 8)")
    parser.add_argument("-o", "--output", metavar="FILE", help="default: named after the result file, in the current folder")
    args = parser.parse_args(argv)
    results = read_results(args.file)
    path = results.path_number(args.branch)
    stem = os.path.splitext(args.output or os.path.basename(args.file))[0]
    stem += f"-branch-{args.branch}" if args.branch and not args.output else ""
    if "displacement" not in path.field_names or path.points_with("displacement").size == 0:
        raise ResultsError(f"{path.filename}: no displacements are stored (*FIELD OUTPUT)")
    points = path.points_with("displacement")
    limits = write_rods(f"{stem}.vtkhdf", path, points, args.pieces)
    print(f"wrote {stem}.vtkhdf ({len(points)} points of the path)")
    if path.obstacles:
        write_obstacles(f"{stem}-obstacles.vtkhdf", path, points, limits)
        print(f"wrote {stem}-obstacles.vtkhdf")
    tell_unfinished([results])
    return 0


def write_rods(filename: str, path: Path, points: np.ndarray, pieces: int) -> np.ndarray:
    """The rods at these points of the path; lower left and upper right corner of everything."""
    t = np.linspace(0.0, 1.0, pieces + 1)
    elements, size = path.mesh.elements, len(path.mesh.elements) * (pieces + 1)
    stress_free = Shape(path.mesh)
    home = np.concatenate([stress_free.piece(element, t) for element in range(len(elements))])
    data: dict[str, list] = {}
    places = []
    for point in points:
        displacement = path.field("displacement", point)
        shape = Shape(path.mesh, displacement)
        places.append(np.concatenate([shape.piece(element, t) for element in range(len(elements))]))
        values = {"displacement": np.column_stack((places[-1] - home, np.zeros(size))),
                  "rotation": _between(displacement[elements, 2], t), **_stored(path, point, shape, t)}
        if path.contact is not None:
            values["contact"] = np.zeros((len(elements), pieces + 1))
            for element, first, last in contact_pieces(path, point, shape)[0]:
                values["contact"][element, (t >= first) & (t <= last)] = 1.0
        for name, value in values.items():
            data.setdefault(name, []).append(value.reshape(size, -1).squeeze())
    fields = {column.name: column.values[points - 1] for column in (path.path["load_factor"], *path.monitors.values())}
    _write(filename, places, len(elements), pieces + 1, points, data, fields)
    everywhere = np.concatenate(places)
    return np.array((everywhere.min(axis=0), everywhere.max(axis=0)))


def write_obstacles(filename: str, path: Path, points: np.ndarray, limits: np.ndarray):
    """The obstacles where they are at these points, a tenth further than the rods reach."""
    margin = 0.1 * np.max(limits[1] - limits[0])
    limits = limits + np.array((-margin, margin))[:, None]
    lines = [[line for obstacle in path.obstacles_at(point) for line, _ in surfaces(obstacle, limits)] for point in points]
    longest = max(len(line) for group in lines for line in group)
    same = [[_resampled(line, longest) for line in group] for group in lines]
    _write(filename, [np.concatenate(group) for group in same], len(same[0]), longest, points, {}, {})


def _resampled(line: np.ndarray, number: int) -> np.ndarray:
    """The polyline with more corners: the first ones again."""
    return line if len(line) == number else np.vstack((np.repeat(line[:1], number - len(line), axis=0), line))


def _between(ends: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Values at both ends of elements (elements, 2) along them, (elements, len(t))."""
    return ends[:, :1] * (1.0 - t) + ends[:, 1:] * t


def _stored(path: Path, point: int, shape: Shape, t: np.ndarray) -> dict[str, np.ndarray]:
    """What else the file has at a point: (elements, len(t)) each. NaN where it does not say."""
    values, mesh = {}, path.mesh
    if "section_forces" in path.field_names:
        forces = np.full((len(mesh.elements), len(t), 3), np.nan)
        if point in path.points_with("section_forces"):
            forces = between_ends(shape, path.field("section_forces", point), len(t) - 1)
        values |= {name: forces[:, :, k] for k, name in enumerate("NQM")}
    for name in ("reaction_density", "gap"):
        if name in path.field_names:
            nodes = np.full(len(mesh.coordinates), np.nan)
            if point in path.points_with(name):
                nodes[path.contact.candidates] = path.field(name, point)
            values[name] = _between(nodes[mesh.elements], t)
    return values


def _write(filename: str, places: list[np.ndarray], n_cells: int, corners: int, times: np.ndarray,
           data: dict[str, list[np.ndarray]], fields: dict[str, np.ndarray]):
    """A temporal unstructured grid of polylines with `corners` points each; all times share the cells."""
    n, size = len(places), n_cells * corners
    try:
        file = h5py.File(filename, "w")
    except OSError as problem:
        raise ResultsError(f"{filename}: cannot be written: {problem.strerror or problem}") from problem
    with file:
        root = file.create_group("VTKHDF")
        root.attrs["Version"] = np.array((2, 0))
        root.attrs.create("Type", np.bytes_("UnstructuredGrid"))
        for name, each in (("NumberOfPoints", size), ("NumberOfCells", n_cells), ("NumberOfConnectivityIds", size)):
            root[name] = np.full(1, each, dtype="i8")
        everywhere = np.concatenate(places)
        root["Points"] = np.column_stack((everywhere, np.zeros(len(everywhere))))
        root["Connectivity"] = np.arange(size, dtype="i8")
        root["Offsets"] = np.arange(0, size + 1, corners, dtype="i8")
        root["Types"] = np.full(n_cells, POLYLINE, dtype="u1")
        steps = root.create_group("Steps")
        steps.attrs["NSteps"] = n
        steps["Values"] = times.astype(float)
        steps["PartOffsets"] = np.zeros(n, dtype="i8")      # one part, whose points move
        steps["NumberOfParts"] = np.ones(n, dtype="i8")
        steps["PointOffsets"] = size * np.arange(n, dtype="i8")
        for name in ("CellOffsets", "ConnectivityIdOffsets"):
            steps[name] = np.zeros((n, 1), dtype="i8")
        for name, values in data.items():
            root[f"PointData/{name}"] = np.concatenate(values)
            steps[f"PointDataOffsets/{name}"] = size * np.arange(n, dtype="i8")
        for name, values in fields.items():
            root[f"FieldData/{name.replace('/', '_')}"] = values.astype(float)
            steps[f"FieldDataOffsets/{name.replace('/', '_')}"] = np.arange(n, dtype="i8")
            steps[f"FieldDataSizes/{name.replace('/', '_')}"] = np.ones((n, 2), dtype="i8")

"""Result files as tables: columns of the same length, for text files and pandas; and as an xarray.Dataset."""

from __future__ import annotations

import importlib
import re
from dataclasses import replace

import numpy as np

from .results import Column, Path, Results, ResultsError

DISPLACEMENT = (("u", "length"), ("v", "length"), ("rotation", "radian"))
FORCES = (("N", "force"), ("Q", "force"), ("M", "moment"))
FIRST = ("step", "label", "load_factor", "arc_length")      # columns of the path that come first


def table(results: Results, name: str = "path", branch: int = 0) -> list[Column]:
    """A table of the path of the steps, or of a branch; ResultsError when the file has nothing for it.

    path: a row a point. critical: a row a critical point. contact: a row a region of contact at a point.
    displacement: a row a node at a stored point. forces: a row an end of an element at a stored point.
    candidates: a row a contact candidate at a stored point, with reactions and gaps. modes: a row a node of a buckling mode.
    curves: a row a point of a limit curve.
    """
    if name not in TABLES:
        raise ResultsError(f"no table '{name}' (known: {', '.join(TABLES)})")
    columns = TABLES[name](results.path_number(branch))
    if len(columns[0].values) == 0:
        raise ResultsError(f"{results.filename}: the table '{name}' would be empty")
    return [replace(column, units=results.units.of(column.units)) for column in columns]


def to_pandas(results: Results, name: str = "path", branch: int = 0):
    """A table as a pandas.DataFrame; its attrs hold units, deck, status and program version."""
    pandas = _package("pandas")
    columns = table(results, name, branch)
    frame = pandas.DataFrame({column.name: column.values for column in columns})
    frame.attrs = {"units": {column.name: column.units for column in columns}, **_origin(results)}
    return frame


def to_xarray(results: Results, branch: int = 0):
    """Path and fields as an xarray.Dataset.

    Dimensions: point (from 1), node and element (labels of the deck), end (1, 2), component, candidate. Fields are NaN at
    points that do not store them.
    """
    xarray = _package("xarray")
    path = results.path_number(branch)
    mesh, n = path.mesh, path.n_points
    # Names without blanks and strokes: data.error_v
    data = {re.sub(r"[ /]", "_", column.name): ("point", column.values, _attributes(column)) for column in _path_columns(path)[1:]}
    data["coordinates"] = (("node", "axis"), mesh.coordinates, {"units": results.units.of("length")})
    shapes = {"displacement": ("node", "freedom"), "section_forces": ("element", "end", "force"),
              "contact_point": ("candidate", "axis")}
    for name in path.field_names:
        sizes = tuple({"node": len(mesh.coordinates), "freedom": 3, "element": len(mesh.elements), "end": 2, "force": 3,
                       "axis": 2, "candidate": 0 if path.contact is None else len(path.contact.candidates)}[dimension]
                      for dimension in shapes.get(name, ("candidate",)))
        values = np.full((n, *sizes), np.nan)
        for point in path.points_with(name):
            values[point - 1] = path.field(name, point)
        data[name] = (("point", *shapes.get(name, ("candidate",))), values)
    places = {"point": np.arange(1, n + 1), "node": mesh.node_label, "element": mesh.element_label, "end": [1, 2],
              "axis": ["x", "y"], "freedom": [word for word, _ in DISPLACEMENT], "force": [word for word, _ in FORCES]}
    used = {dimension for dimensions, *_ in data.values() for dimension in np.atleast_1d(dimensions)}
    if path.contact is not None and "candidate" in used:
        data["arc_length_of_candidate"] = ("candidate", path.contact.arc_length, {"units": results.units.of("length")})
        data["contact_of_candidate"] = ("candidate", path.contact.candidate_contact)
    return xarray.Dataset(data, {name: values for name, values in places.items() if name in used}, _origin(results))


def _package(name: str):
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError as problem:
        raise ResultsError(f"this needs the Python package {name}: apt-get install python3-{name}, or pip install {name}; "
                           f"read_results and tables.table do without") from problem


def _origin(results: Results) -> dict[str, str]:
    return {"file": results.filename, "title": results.title, "status": results.status,
            "program": f"{results.program} {results.version}", "created": results.created, "deck": results.deck}


def _attributes(column: Column) -> dict[str, str]:
    return {"units": column.units, "description": column.description}


# The tables


def _path_columns(path: Path) -> list[Column]:
    names = [name for name in FIRST if name in path.path] + [name for name in path.path if name not in FIRST]
    monitors = [column if column.name not in path.path and column.name != "point" else
                Column(f"monitor/{column.name}", column.values, column.units, column.description)
                for column in path.monitors.values()]
    monitors = [column for monitor in monitors for column in (monitor, *_error(path, monitor.name))]
    leading = len([name for name in FIRST if name in path.path])
    columns = [path.path[name] for name in names]
    return [path.column("point"), *columns[:leading], *monitors, *columns[leading:]]


def _error(path: Path, name: str) -> list[Column]:
    """The error bars of a monitor, where the file has them."""
    if name not in path.errors:
        return []
    error = path.errors[name]
    return [Column(f"error {name}", error.values, error.units, error.description)]


def _critical(path: Path) -> list[Column]:
    rows = path.critical
    columns = [Column(name, np.array([getattr(row, name) for row in rows]))
               for name in ("point", "step", "label", "load_factor", "located", "multiplicity", "note")]
    if path.errors:
        columns[4:4] = [Column(name, np.array([getattr(row, name) for row in rows])) for name in ("error", "corrected")]
    for name, column in path.monitors.items():
        columns.append(Column(name, np.array([row.monitors.get(name, np.nan) for row in rows]), column.units, column.description))
        if name in path.errors:
            columns.append(Column(f"error {name}", np.array([row.monitor_errors.get(name, np.nan) for row in rows]), column.units))
    return columns


def _contact(path: Path) -> list[Column]:
    if path.contact is None:
        raise ResultsError(f"{path.filename}: the model has no contact")
    rows = [(point, region) for point in range(1, path.n_points + 1) for region in path.contact.regions(point)]
    points = np.array([point for point, _ in rows], dtype=int)
    units = [("contact", "1"), ("start", "length"), ("end", "length"), ("angle_start", "degree"), ("angle_end", "degree")]
    if path.contact.bars is not None:
        units += [(name, "length") for name in ("start_error", "end_error", "start_corrected", "end_corrected")]
    return [Column("point", points), Column("load_factor", path.path["load_factor"].values[points - 1])] + [
        Column(name, np.array([getattr(region, name) for _, region in rows]), unit) for name, unit in units]


def _long(path: Path, field: str, keys: list[Column], parts: tuple[tuple[str, str], ...]) -> list[Column]:
    """A row an item (as the keys have them) and stored point; `parts` name the last axis of the field."""
    points = path.points_with(field)
    values = [path.field(field, point).reshape(len(keys[0].values), len(parts)) for point in points]
    values = np.concatenate(values) if values else np.zeros((0, len(parts)))
    repeated = np.repeat(points, len(keys[0].values))
    return [Column("point", repeated), Column("load_factor", path.path["load_factor"].values[repeated - 1]),
            *(Column(key.name, np.tile(key.values, len(points)), key.units) for key in keys),
            *(Column(name, values[:, k], unit) for k, (name, unit) in enumerate(parts))]


def _displacement(path: Path) -> list[Column]:
    mesh = path.mesh
    keys = [Column("node", mesh.node_label), Column("x", mesh.coordinates[:, 0], "length"),
            Column("y", mesh.coordinates[:, 1], "length")]
    return _long(path, "displacement", keys, DISPLACEMENT)


def _forces(path: Path) -> list[Column]:
    mesh = path.mesh
    nodes = mesh.elements.ravel()
    keys = [Column("element", np.repeat(mesh.element_label, 2)), Column("node", mesh.node_label[nodes]),
            Column("x", mesh.coordinates[nodes, 0], "length"), Column("y", mesh.coordinates[nodes, 1], "length")]
    return _long(path, "section_forces", keys, FORCES)


def _candidates(path: Path) -> list[Column]:
    contact = path.contact
    names = [(name, unit) for name, unit in (("reaction", "force"), ("reaction_density", "force/length"), ("gap", "length"))
             if name in path.field_names]
    if contact is None or not names:
        raise ResultsError(f"{path.filename}: no reactions or gaps are stored (*FIELD OUTPUT, REACTION or GAP)")
    keys = [Column("contact", contact.candidate_contact), Column("node", path.mesh.node_label[contact.candidates]),
            Column("arc_length_of_candidate", contact.arc_length, "length")]
    stored = {name: {point: path.field(name, point) for point in path.points_with(name)} for name, _ in names}
    points = np.array(sorted(set().union(*stored.values())), dtype=int)
    nothing = np.full(len(contact.candidates), np.nan)
    repeated = np.repeat(points, len(nothing))
    return [Column("point", repeated), Column("load_factor", path.path["load_factor"].values[repeated - 1]),
            *(Column(key.name, np.tile(key.values, len(points)), key.units) for key in keys),
            *(Column(name, np.concatenate([stored[name].get(point, nothing) for point in points] or [nothing[:0]]), unit)
              for name, unit in names)]


def _modes(results: Results) -> list[Column]:
    if not getattr(results, "buckling", None):
        raise ResultsError(f"{results.filename}: holds no buckling modes (*BUCKLE)")
    mesh, parts = results.mesh, []
    for name, step in results.buckling.items():
        for k, factor in enumerate(step.load_factor):
            parts.append((name, k + 1, factor, step.mode[k]))
    nodes = len(mesh.node_label)
    values = np.concatenate([part[3] for part in parts]) if parts else np.zeros((0, 3))
    return [*(Column(name, np.repeat([part[k] for part in parts], nodes))
              for k, name in enumerate(("buckling_step", "mode", "load_factor"))),
            Column("node", np.tile(mesh.node_label, len(parts))),
            *(Column(name, values[:, k]) for k, (name, _) in enumerate(DISPLACEMENT))]


def _curves(results: Results) -> list[Column]:
    curves = list(getattr(results, "limit_curves", {}).values())
    if not curves:
        raise ResultsError(f"{results.filename}: holds no limit curves (*LIMIT CURVE)")
    columns = [Column("curve", np.concatenate([np.full(curve.n_points, curve.name) for curve in curves]))]
    for name in list(curves[0].columns) + list(curves[0].monitors):
        columns.append(Column(name, np.concatenate([curve.column(name).values for curve in curves]),
                              curves[0].column(name).units))
    return columns


TABLES = {"path": _path_columns, "critical": _critical, "contact": _contact, "displacement": _displacement, "forces": _forces,
          "candidates": _candidates, "modes": _modes, "curves": _curves}

"""Read a unilat result file (HDF5) into numpy arrays.

    from unilat import read_results

    ring = read_results("ring.h5")
    v = ring.column("v")              # a monitor, or any dataset of /path
    p = ring.column("load_factor")
    print(v.values, v.units, v.description)

    for critical in ring.critical:    # limit points, bifurcations, contact events
        print(critical.label, critical.load_factor, critical.monitors["v"])

    for region in ring.contact.histories():       # each stretch of contact, followed along the path
        print(region.points, region.angle_start)

    for branch in ring.branches.values():         # paths that leave at bifurcations, read like the file itself
        print(branch.name, branch.side, branch.column("v").values)

    print(ring.buckling["Step-1"].load_factor, ring.limit_curves["Curve-1"].column("parameter").values)

    u = ring.field("displacement", ring.field_points[-1])   # (nodes, 3): u, v, rotation
    x = ring.mesh.coordinates + u[:, :2]

Points are numbered from 1, as in the listing and in the file; point n is row n - 1 of every array. Everything
but the fields is read at once; a field is read from the file when it is asked for.

The file of a run that was stopped, killed or is still running is read as well. Its datasets may differ in length
by the point that was being written; all are cut to the shortest, so that rows always belong together.
"""

from __future__ import annotations

import os
from dataclasses import replace

import h5py
import numpy as np

from .file import ResultsError, dataset, one_line, open_file, scalar, text
from .foreign_storage import own_item, refuse_foreign
from .model_parts import read_loads, read_sets, read_supports
from .types import FIELD_NAMES, FORCE_LISTS, Branch, Buckling, Column, Contact, Critical, LimitCurve, Mesh, Obstacle, Results
from .units import Units, read_units

PROGRAMS = ("unilat", "opensees")       # that write such files, see unilat.opensees


def read_results(filename: str | os.PathLike) -> Results:
    """Read a result file; ResultsError when it is missing, damaged or not of unilat."""
    filename = os.fspath(filename)
    with open_file(filename) as file:
        try:
            refuse_foreign(file, filename)
            return _read(file, filename)
        except (OSError, RuntimeError, ValueError, KeyError, TypeError) as problem:
            raise ResultsError(f"{filename}: damaged: {one_line(problem)}") from problem


def read_short(filename: str, wanted: set[str]) -> Results:
    """As read_results, in a tenth of the time: only some columns of the path, the monitors, and where the critical points are.

    `wanted`: names of columns in small letters. All is read where one of them is not there, so that a message can say what is.
    """
    with open_file(filename) as file:
        try:
            names = {"path": wanted, "critical": {"label", "load_factor", "point"}, "path/monitor": None, "critical/monitor": None}
            parts: dict[str, dict] = {}
            for place, some in names.items():
                group = own_item(file, place, filename)
                parts[place] = {name: own_item(group, name, filename) for name in group or () if some is None or name.lower() in some}
            path, monitors = ({name: _column(item) for name, item in parts[place].items()} for place in ("path", "path/monitor"))
            n_points = min(len(column.values) for column in (*path.values(), *monitors.values()))
            path, monitors = _shortened(path, n_points), _shortened(monitors, n_points)
            short = Results(**_in_units({"path": path, "monitors": monitors, "errors": {}}, read_units(file)), filename=filename, group="",
                            n_points=n_points, mesh=None, contact=None, obstacles={}, field_points=np.zeros(0, int), field_names=(),
                            critical=_critical({"critical": {**parts["critical"], "monitor": parts["critical/monitor"]}}
                                               if "critical" in file else {}, path, monitors),
                            program=text(file.attrs["program"]), version=text(file.attrs["version"]), title="", created="", status="", deck="")
        except (OSError, RuntimeError, ValueError, KeyError, TypeError, AttributeError) as problem:
            raise ResultsError(f"{filename}: damaged: {one_line(problem)}") from problem
    found = {name.lower() for name in (*path, *monitors)} | {f"monitor/{name.lower()}" for name in monitors} | {"point"}
    return short if wanted <= found else read_results(filename)


# Reading the groups of the file


def _read(file: h5py.File, filename: str) -> Results:
    program = text(file.attrs.get("program", ""))
    if program not in PROGRAMS or not isinstance(file.get("path"), h5py.Group):
        raise ResultsError(f"{filename}: not a result file of unilat")
    mesh = _mesh(file, filename)
    obstacles = {name: _obstacle(name, item) for name, item in file.get("obstacles", {}).items()}
    deck = file.attrs.get("deck")
    if deck is None:
        deck = file["deck"][()] if "deck" in file else ""
    units = read_units(file)
    model = {"supports": read_supports(file), "loads": read_loads(file), "units": units}
    branches = {int(number): _branch(item, filename, mesh, obstacles, model)
                for number, item in file.get("branch", {}).items() if "path" in item}
    return Results(
        **_in_units(_path(file, filename, mesh, obstacles), units), **model, sets=read_sets(file), program=program, title=text(file.attrs.get("title", "")),
        version=text(file.attrs.get("version", "")), created=text(file.attrs.get("created", "")),
        status=text(file.attrs.get("status", "")), deck=text(deck), parameters=_parameters(file),
        branches=dict(sorted(branches.items())),
        buckling={name: _buckling(name, item, filename) for name, item in file.get("buckling", {}).items()},
        limit_curves={name: _limit_curve(name, item, filename) for name, item in file.get("limit_curve", {}).items()},
        performance={name: _column(item).values.tolist() for name, item in file.get("performance", {}).items()},
        accuracy=_accuracy(file.get("accuracy", {})))


def _accuracy(group) -> dict[str, float]:
    """Worst values by the names of the checks, which early files have as datasets of their own."""
    if "check" in group:
        return {text(name): float(value) for name, value in zip(group["check"][()], group["value"][()])}
    return {name: scalar(item[()]) for name, item in group.items()}


def _in_units(path: dict, units: Units) -> dict:
    """The members of a path, with columns in the units of the deck."""
    if units:
        for name in ("path", "monitors", "errors"):
            path[name] = {key: replace(column, units=units.of(column.units)) for key, column in path[name].items()}
    return path


def _parameters(file) -> dict:
    """Values of *PARAMETER."""
    if "parameters" not in file:
        return {}
    attrs = file["parameters"].attrs
    return {name: text(value) if isinstance(value, (bytes, str)) else scalar(value) for name, value in attrs.items()}


def _path(group: h5py.Group, filename: str, mesh: Mesh, obstacles: dict[str, Obstacle]) -> dict:
    """The members of a Path in a group: the file itself, or that of a branch."""
    path = {name: _column(item) for name, item in group["path"].items() if isinstance(item, h5py.Dataset)}
    monitors = {name: _column(item) for name, item in group.get("path/monitor", {}).items()}
    errors = {name: _column(item) for name, item in group.get("path/monitor_error", {}).items()}
    rates = {name: item[()] for name, item in group.get("path/monitor_rate", {}).items()}
    monitors = {name: replace(column, rate=rates.get(name)) for name, column in monitors.items()}
    if "error" in path:
        errors["load_factor"] = path["error"]
    if "load_factor" not in path:
        raise ResultsError(f"{filename}: {group.name.rstrip('/')}/path/load_factor is missing")
    if "load_rate" in path:
        rates["load_factor"] = path["load_rate"].values
        path["load_factor"] = replace(path["load_factor"], rate=rates["load_factor"])
    contact, n_contact = _contact(group, filename, mesh)
    n_points = min([len(c.values) for c in (*path.values(), *monitors.values(), *errors.values())]
                   + [len(rate) for rate in rates.values()] + n_contact)
    path, monitors, errors = (_shortened(columns, n_points) for columns in (path, monitors, errors))
    if contact is not None:
        contact = _cut(contact, n_points)
    field_points, field_names = _fields(group, n_points)
    has_lists = all(name in group for name in FORCE_LISTS)
    return dict(filename=filename, group=group.name.strip("/") + "/" if group.name != "/" else "", n_points=n_points,
                path=path, monitors=monitors, mesh=mesh, contact=contact, critical=_critical(group, path, monitors),
                obstacles=obstacles, field_points=field_points, field_names=field_names, errors=errors, has_force_lists=has_lists)


def _branch(group: h5py.Group, filename: str, mesh: Mesh, obstacles: dict[str, Obstacle], model: dict) -> Branch:
    numbers = {name: int(scalar(group.attrs[name])) for name in ("step", "of", "bifurcation", "mode", "side", "point")}
    return Branch(**_in_units(_path(group, filename, mesh, obstacles), model["units"]), **model, number=int(group.name.rsplit("/", 1)[1]),
                  name=text(group.attrs["name"]), **numbers)


def _buckling(name: str, group: h5py.Group, filename: str) -> Buckling:
    known = [dataset(group, item, filename)[()] for item in ("load_factor", "residual", "mode")]
    bars = [group[item][()] if item in group else np.full(len(known[0]), np.nan) for item in ("error", "corrected")]
    return Buckling(name, int(scalar(group.attrs.get("step", 0))), *known, *bars)


def _limit_curve(name: str, group: h5py.Group, filename: str) -> LimitCurve:
    columns = {item: _column(dataset(group, item, filename)) for item in ("parameter", "rigid", "load_factor")}
    columns |= {item: _column(data) for item, data in group.items()
                if isinstance(data, h5py.Dataset) and item not in columns}
    monitors = {item: _column(data) for item, data in group.get("monitor", {}).items()}
    n = min(len(column.values) for column in (*columns.values(), *monitors.values()))
    attrs = group.attrs
    return LimitCurve(filename, name, int(scalar(attrs.get("step", 0))), text(attrs.get("parameter", "")),
                      text(attrs.get("of", "")), int(scalar(attrs.get("limit_point", 1))), n,
                      _shortened(columns, n), _shortened(monitors, n))


def _shortened(columns: dict[str, Column], n: int) -> dict[str, Column]:
    return {name: replace(c, values=c.values[:n], rate=None if c.rate is None else c.rate[:n]) for name, c in columns.items()}


def _mesh(file: h5py.File, filename: str) -> Mesh:
    coordinates = dataset(file, "mesh/coordinates", filename)[()]
    elements = dataset(file, "mesh/elements", filename)[()]
    if coordinates.ndim != 2 or coordinates.shape[1] != 2 or elements.ndim != 2 or elements.shape[1] != 2:
        raise ResultsError(f"{filename}: /mesh/coordinates and /mesh/elements must have two columns")
    if elements.size and not 0 <= elements.min() <= elements.max() < len(coordinates):
        raise ResultsError(f"{filename}: /mesh/elements refers to nodes that do not exist")
    labels = [file[f"mesh/{name}"][()] if f"mesh/{name}" in file else np.arange(1, count + 1)
              for name, count in (("node_label", len(coordinates)), ("element_label", len(elements)))]
    joints = [file[f"joints/{name}"][()].astype(int) if f"joints/{name}" in file else np.zeros((0, columns), dtype=int)
              for name, columns in (("release", 2), ("released", 3), ("link", 2))]
    direction = file["mesh/direction"][()] if "mesh/direction" in file else None
    if direction is not None and direction.shape != elements.shape:
        raise ResultsError(f"{filename}: /mesh/direction must have two columns and a row an element")
    stiffness = file["mesh/bending_stiffness"][()] if "mesh/bending_stiffness" in file else None
    return Mesh(coordinates, elements.astype(int), *labels, joints[0], joints[1] > 0, joints[2], direction, stiffness)


def _contact(group: h5py.Group, filename: str, mesh: Mesh) -> tuple[Contact | None, list[int]]:
    """The contact group of a path as it is, and the lengths of its datasets along the path."""
    if "contact" not in group:
        return None, []
    file = group.file       # the candidates are the same for all paths
    spans = [dataset(group, f"contact/{name}", filename)[()]
             for name in ("start", "end", "angle_start", "angle_end", "contact")]
    count = dataset(group, "contact/count", filename)[()]
    reaction = dataset(group, "contact/reaction_total", filename)[()]
    width = min(span.shape[1] for span in spans)    # a kill may fall between two datasets growing by a region
    rows = {label: row for row, label in enumerate(mesh.node_label)}
    labels = dataset(file, "contact/candidates", filename)[()]
    if any(label not in rows for label in labels):
        raise ResultsError(f"{filename}: /contact/candidates refers to nodes that do not exist")
    contact = Contact(np.minimum(count, width).astype(int), *(span[:, :width] for span in spans), reaction,
                      np.array([rows[label] for label in labels], dtype=int),
                      dataset(file, "contact/candidate_contact", filename)[()].astype(int),
                      dataset(file, "contact/arc_length", filename)[()],
                      dataset(file, "contact/chain_length", filename)[()],
                      tuple(text(word) for word in dataset(file, "contact/points", filename)[()]),
                      tuple(text(name) for name in file["contact/obstacle"]) if "contact/obstacle" in file else (),
                      *(group[f"contact/{name}"][()] if f"contact/{name}" in group else None
                        for name in ("obstacle_shift", "obstacle_turn", "obstacle_force")),
                      _place_bars(group, width))
    moved = [len(values) for values in (contact.obstacle_shift, contact.obstacle_turn, contact.obstacle_force) if values is not None]
    told = [] if contact.bars is None else [contact.bars.shape[1]]
    return contact, [len(count), len(reaction), *(len(span) for span in spans), *moved, *told]


def _place_bars(group: h5py.Group, width: int) -> np.ndarray | None:
    """Error bars of starts and ends, and these corrected, as long as all of them are there."""
    names = [f"contact/{name}" for name in ("start_error", "end_error", "start_corrected", "end_corrected")]
    if not all(name in group for name in names):
        return None
    found = [group[name][()] for name in names]
    rows = min(len(values) for values in found)
    bars = np.full((len(found), rows, width), np.nan)
    for values, own in zip(found, bars):
        own[:, :min(width, values.shape[1])] = values[:rows, :width]
    return bars


def _cut(contact: Contact, n: int) -> Contact:
    along = ("count", "start", "end", "angle_start", "angle_end", "contact", "reaction_total", "obstacle_shift",
             "obstacle_turn", "obstacle_force")
    cut = {name: getattr(contact, name)[:n] for name in along if getattr(contact, name) is not None}
    if contact.bars is not None:
        cut["bars"] = contact.bars[:, :n]
    return replace(contact, **cut | {"contact": cut["contact"].astype(int)})


def _fields(group: h5py.Group, n_points: int) -> tuple[np.ndarray, tuple[str, ...]]:
    names = tuple(name for name in FIELD_NAMES if f"fields/{name}" in group)
    if not names or "fields/point" not in group:
        return np.zeros(0, dtype=int), ()
    shortest = min([len(group["fields/point"])] + [len(group[f"fields/{name}"]) for name in names])
    points = group["fields/point"][:shortest].astype(int)
    return points[points <= n_points], names


def _critical(path_group: h5py.Group, path: dict[str, Column], monitors: dict[str, Column]) -> list[Critical]:
    """The critical points; of a run killed before they were written, what the labels of the path tell."""
    group = path_group.get("critical")
    if group is None:
        if "label" not in path:
            return []
        step = path["step"].values if "step" in path else np.zeros(len(path["label"].values), dtype=int)
        return [Critical(str(label), float(path["load_factor"].values[row]), row + 1, int(step[row]), True, "",
                         {name: float(c.values[row]) for name, c in monitors.items()})
                for row, label in enumerate(path["label"].values) if label]
    columns = {name: group[name][()] for name in ("label", "load_factor", "point", "step", "located", "note",
                                                  "multiplicity", "error", "corrected") if name in group}
    values = {name: item[()] for name, item in group.get("monitor", {}).items()}
    errors, corrected = ({name: item[()] for name, item in group.get(what, {}).items()} for what in ("monitor_error", "monitor_corrected"))
    n = min(len(item) for item in (*columns.values(), *values.values(), *errors.values(), *corrected.values()))
    return [Critical(text(columns["label"][k]), float(columns["load_factor"][k]), int(columns["point"][k]),
                     int(columns["step"][k]) if "step" in columns else 0,
                     bool(columns["located"][k]) if "located" in columns else True,
                     text(columns["note"][k]) if "note" in columns else "",
                     {name: float(item[k]) for name, item in values.items()},
                     int(columns["multiplicity"][k]) if "multiplicity" in columns else 0, k + 1,
                     *(float(columns[name][k]) if name in columns else float("nan") for name in ("error", "corrected")),
                     *({name: float(item[k]) for name, item in each.items()} for each in (errors, corrected))) for k in range(n)]


def _obstacle(name: str, item: h5py.Group | h5py.Dataset) -> Obstacle:
    attrs = item.attrs
    kind = text(attrs["type"]).lower()
    if kind not in ("line", "circle", "arc", "polyline", "spline", "gap", "soil"):
        raise ValueError(f"obstacle {name} has the unknown type '{kind}'")
    if kind in ("line", "soil"):
        points = np.array(attrs["points"], dtype=float).reshape(2, 2)
    else:
        points = item["points"][()] if kind in ("polyline", "spline", "gap") else None
    return Obstacle(
        name, kind, text(attrs.get("side", "")).lower(), points=points,
        centre=np.array(attrs["centre"], dtype=float).reshape(2) if kind in ("circle", "arc") else None,
        radius=scalar(attrs["radius"]) if kind in ("circle", "arc", "polyline") else None,
        angles=np.array(attrs["angles"], dtype=float).reshape(2) if kind == "arc" else None,
        surface=item["surface"][()] if kind in ("arc", "polyline", "spline") else None,
        end=np.array(attrs["centre"], dtype=float).reshape(2) if kind == "gap" and "centre" in attrs else None,
        pivot=np.array(attrs["pivot"], dtype=float).reshape(2) if "pivot" in attrs else None,
        normal=np.array(attrs["normal"], dtype=float).reshape(2) if kind == "gap" else None, number=int(scalar(attrs.get("number", 0))),
        reference_angle=scalar(attrs.get("reference_angle", 0.0)),
        foundation=text(attrs.get("foundation", "rigid")).lower(), modulus=scalar(attrs.get("modulus", 0.0)))


def _column(item: h5py.Dataset) -> Column:
    values = item[()]
    if values.dtype.kind in "SO":
        values = np.array([text(value) for value in values], dtype=str)
    return Column(item.name.rsplit("/", 1)[1], values, text(item.attrs.get("units", "1")),
                  text(item.attrs.get("description", "")))

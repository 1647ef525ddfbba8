"""Read a unilat result file (HDF5) into numpy arrays.

    from unilat_results import read_results

    ring = read_results("ring.h5")
    v = ring.column("v")              # a monitor, or any dataset of /path
    p = ring.column("load_factor")
    print(v.values, v.units, v.description)

    for critical in ring.critical:    # limit points, bifurcations, contact events
        print(critical.label, critical.load_factor, critical.monitors["v"])

    for region in ring.contact.histories():       # each stretch of contact, followed along the path
        print(region.points, region.angle_start)

    u = ring.field("displacement", ring.field_points[-1])   # (nodes, 3): u, v, rotation
    x = ring.mesh.coordinates + u[:, :2]

Points are numbered from 1, as in the listing and in the file; point n is row n - 1 of every array. Everything
but the fields is read at once; a field is read from the file when it is asked for.

The file of a run that was stopped, killed or is still running is read as well. Its datasets may differ in length
by the point that was being written; all are cut to the shortest, so that rows always belong together.
"""

from __future__ import annotations

import csv
import difflib
import os
from dataclasses import dataclass, field

import h5py
import numpy as np

FIELD_NAMES = ("displacement", "section_forces", "reaction", "gap")


class ResultsError(Exception):
    """A file that cannot be read as asked; the message is one line and names the file."""


@dataclass(frozen=True)
class Column:
    """One quantity along the path."""

    name: str
    values: np.ndarray        # (points)
    units: str = "1"          # in words: "length", "force", "moment", "radian", "degree", "1", "second"
    description: str = ""


@dataclass(frozen=True)
class Mesh:
    coordinates: np.ndarray   # (nodes, 2) stress-free positions
    elements: np.ndarray      # (elements, 2) node rows, from 0
    node_label: np.ndarray    # (nodes) the deck's numbers
    element_label: np.ndarray


@dataclass(frozen=True)
class Obstacle:
    name: str
    kind: str                 # "line" or "circle"
    side: str                 # circle: the structure is "inside" or "outside"
    points: np.ndarray | None        # line: (2, 2), the free side is on the left of first -> second
    centre: np.ndarray | None        # circle: (2)
    radius: float | None
    reference_angle: float    # [degrees] direction that contact angles count from
    foundation: str           # "rigid" or "winkler"
    modulus: float            # force per unit length of rod and unit penetration


@dataclass(frozen=True)
class Critical:
    label: str                # LP, BP, C+, C-, UZ, EP
    load_factor: float
    point: int                # from 1
    step: int
    located: bool             # False: bracketed, not found to the tolerance
    note: str
    monitors: dict[str, float]


@dataclass(frozen=True)
class Region:
    """One stretch of contact at one point of the path."""

    contact: int              # which *CONTACT, from 1
    start: float              # stress-free arc length along the candidates
    end: float
    angle_start: float        # [degrees] from the obstacle's reference direction; NaN for lines
    angle_end: float


@dataclass
class History:
    """One stretch of contact followed along the path, as long as it exists."""

    contact: int
    points: np.ndarray        # numbers of the points, from 1, consecutive
    start: np.ndarray
    end: np.ndarray
    angle_start: np.ndarray
    angle_end: np.ndarray


@dataclass(frozen=True)
class Contact:
    """Contact regions: rows are points, columns regions in the order of the file, NaN where there is none."""

    count: np.ndarray         # (points)
    start: np.ndarray         # (points, regions)
    end: np.ndarray
    angle_start: np.ndarray
    angle_end: np.ndarray
    contact: np.ndarray       # (points, regions) which *CONTACT, from 1; 0 where there is none
    reaction_total: np.ndarray       # (points, contacts)
    candidates: np.ndarray           # node rows (from 0) of the candidates, contact after contact
    candidate_contact: np.ndarray    # which *CONTACT (from 1) each belongs to
    obstacles: tuple[str, ...] = ()  # name of the obstacle of each contact

    def regions(self, point: int) -> list[Region]:
        """The regions at a point (from 1)."""
        row = point - 1
        return [Region(int(self.contact[row, k]), *(float(values[row, k]) for values in self._spans()))
                for k in range(self.count[row])]

    def histories(self) -> list[History]:
        """Every region followed from point to point, in order of appearance.

        Regions open, close, split and merge, so that the same column of the file need not be the same region at
        two points. A region is continued by the one of the same contact whose ends are nearest, each used once.
        """
        done: list[tuple[int, list[int], list[Region]]] = []
        current: list[int] = []     # indices into done
        for point in range(1, len(self.count) + 1):
            regions = self.regions(point)
            pairs = sorted((abs(done[i][2][-1].start - region.start) + abs(done[i][2][-1].end - region.end), i, k)
                           for i in current for k, region in enumerate(regions) if done[i][0] == region.contact)
            follows: dict[int, int] = {}
            for _, i, k in pairs:
                if k not in follows and i not in follows.values():
                    follows[k] = i
            current = []
            for k, region in enumerate(regions):
                if k not in follows:
                    follows[k] = len(done)
                    done.append((region.contact, [], []))
                done[follows[k]][1].append(point)
                done[follows[k]][2].append(region)
                current.append(follows[k])
        return [History(contact, np.array(points), *(np.array([getattr(region, name) for region in regions])
                                                     for name in ("start", "end", "angle_start", "angle_end")))
                for contact, points, regions in done]

    def _spans(self) -> tuple[np.ndarray, ...]:
        return self.start, self.end, self.angle_start, self.angle_end


@dataclass(frozen=True)
class Results:
    filename: str
    title: str
    program: str
    version: str
    created: str
    status: str               # "complete", "stopped: why" or "running"
    deck: str
    n_points: int
    path: dict[str, Column]
    monitors: dict[str, Column]      # in the deck's order when the file keeps it, else by name
    mesh: Mesh
    contact: Contact | None   # None: a model without contact
    critical: list[Critical]
    obstacles: dict[str, Obstacle]
    field_points: np.ndarray  # numbers (from 1) of the points with stored fields, see points_with
    field_names: tuple[str, ...]     # of FIELD_NAMES, those in the file
    performance: dict[str, list] = field(default_factory=dict)     # phase, seconds, calls; counter, value
    accuracy: dict[str, float] = field(default_factory=dict)       # worst values over all points

    @property
    def complete(self) -> bool:
        return self.status == "complete"

    def column_names(self) -> list[str]:
        return ["point", *self.monitors, *self.path]

    def column(self, name: str) -> Column:
        """A quantity along the path by name: `point` (1, 2, ...), a dataset of /path or a monitor.

        Upper and lower case are the same. A monitor that has the name of a dataset of /path is `monitor/<name>`.
        """
        key = name.strip().lower()
        if key == "point":
            return Column("point", np.arange(1, self.n_points + 1), "1", "number of the point")
        for group, prefix in ((self.path, ""), (self.monitors, ""), (self.monitors, "monitor/")):
            for column in group.values():
                if prefix + column.name.lower() == key:
                    return column
        names = self.column_names()
        near = difflib.get_close_matches(key, [n.lower() for n in names], 1)
        hint = f"did you mean {next(n for n in names if n.lower() == near[0])}? " if near else ""
        raise ResultsError(f"{self.filename}: no path quantity or monitor '{name}' ({hint}known: {', '.join(names)})")

    def field(self, name: str, point: int) -> np.ndarray:
        """A stored field at a point (from 1).

        displacement (nodes, 3): u, v, rotation; section_forces (elements, 2, 3): N, Q, M at both ends;
        reaction, gap (candidates).
        """
        self._known_field(name)
        found = np.flatnonzero(self.field_points == point)
        if found.size == 0:
            raise ResultsError(f"{self.filename}: no fields are stored at point {point} "
                               f"({_nearest(self.field_points, point)})")
        with _open(self.filename) as file:
            values = _dataset(file, f"fields/{name}", self.filename)[found[0]]
        if np.all(np.isnan(values)):
            raise ResultsError(f"{self.filename}: field '{name}' is not stored at point {point}, its step did not ask")
        return values

    def points_with(self, name: str) -> np.ndarray:
        """Numbers of the points that hold this field: steps may ask for different ones."""
        self._known_field(name)
        with _open(self.filename) as file:
            item = _dataset(file, f"fields/{name}", self.filename)
            first = item[(slice(len(self.field_points)), *(0,) * (item.ndim - 1))]
        return self.field_points[np.isfinite(first)]

    def _known_field(self, name: str):
        if name not in self.field_names:
            stored = f"stored: {', '.join(self.field_names)}" if self.field_names else "the deck asked for none"
            raise ResultsError(f"{self.filename}: field '{name}' is not in the file ({stored})")


def read_results(filename: str | os.PathLike) -> Results:
    """Read a result file; ResultsError when it is missing, damaged or not of unilat."""
    filename = os.fspath(filename)
    with _open(filename) as file:
        try:
            return _read(file, filename)
        except (OSError, RuntimeError, ValueError, KeyError, TypeError) as problem:
            raise ResultsError(f"{filename}: damaged: {_one_line(problem)}") from problem


def read_table(filename: str | os.PathLike, x: str, y: str) -> tuple[np.ndarray, np.ndarray]:
    """Two columns of a reference table: CSV, `#` comment lines, one line of names, then numbers.

    Empty cells and `nan` become NaN; other columns may hold text.
    """
    filename = os.fspath(filename)
    try:
        with open(filename, newline="", encoding="utf-8") as file:
            rows = [(number, row) for number, row in _numbered_rows(file)]
    except (OSError, UnicodeDecodeError, csv.Error) as problem:
        raise ResultsError(f"{filename}: cannot be read: {_reason(problem)}") from problem
    if not rows:
        raise ResultsError(f"{filename}: holds no table")
    names = [name.strip() for name in rows[0][1]]
    picked = []
    for name in (x, y):
        if name not in names:
            raise ResultsError(f"{filename}: no column '{name}' (known: {', '.join(names)})")
        at = names.index(name)
        picked.append(np.array([_number(row, at, name, filename, number) for number, row in rows[1:]]))
    return picked[0], picked[1]


# Reading the groups of the file


def _read(file: h5py.File, filename: str) -> Results:
    program = _text(file.attrs.get("program", ""))
    if program != "unilat" or not isinstance(file.get("path"), h5py.Group):
        raise ResultsError(f"{filename}: not a result file of unilat")
    path = {name: _column(item) for name, item in file["path"].items() if isinstance(item, h5py.Dataset)}
    monitors = {name: _column(item) for name, item in file.get("path/monitor", {}).items()}
    if "load_factor" not in path:
        raise ResultsError(f"{filename}: /path/load_factor is missing")
    mesh = _mesh(file, filename)
    contact, n_contact = _contact(file, filename, mesh)
    n_points = min([len(c.values) for c in (*path.values(), *monitors.values())] + n_contact)
    path, monitors = ({name: Column(c.name, c.values[:n_points], c.units, c.description) for name, c in group.items()}
                      for group in (path, monitors))
    if contact is not None:
        contact = _cut(contact, n_points)
    field_points, field_names = _fields(file, n_points)
    deck = file.attrs.get("deck")
    if deck is None:
        deck = file["deck"][()] if "deck" in file else ""
    return Results(
        filename=filename, program=program, title=_text(file.attrs.get("title", "")),
        version=_text(file.attrs.get("version", "")), created=_text(file.attrs.get("created", "")),
        status=_text(file.attrs.get("status", "")), deck=_text(deck), n_points=n_points, path=path, monitors=monitors,
        mesh=mesh, contact=contact, critical=_critical(file, path, monitors),
        obstacles={name: _obstacle(name, item) for name, item in file.get("obstacles", {}).items()},
        field_points=field_points, field_names=field_names,
        performance={name: _column(item).values.tolist() for name, item in file.get("performance", {}).items()},
        accuracy={name: _scalar(item[()]) for name, item in file.get("accuracy", {}).items()})


def _mesh(file: h5py.File, filename: str) -> Mesh:
    coordinates = _dataset(file, "mesh/coordinates", filename)[()]
    elements = _dataset(file, "mesh/elements", filename)[()]
    if coordinates.ndim != 2 or coordinates.shape[1] != 2 or elements.ndim != 2 or elements.shape[1] != 2:
        raise ResultsError(f"{filename}: /mesh/coordinates and /mesh/elements must have two columns")
    if elements.size and not 0 <= elements.min() <= elements.max() < len(coordinates):
        raise ResultsError(f"{filename}: /mesh/elements refers to nodes that do not exist")
    labels = [file[f"mesh/{name}"][()] if f"mesh/{name}" in file else np.arange(1, count + 1)
              for name, count in (("node_label", len(coordinates)), ("element_label", len(elements)))]
    return Mesh(coordinates, elements.astype(int), *labels)


def _contact(file: h5py.File, filename: str, mesh: Mesh) -> tuple[Contact | None, list[int]]:
    """The contact group as it is, and the lengths of its datasets along the path."""
    if "contact" not in file:
        return None, []
    spans = [_dataset(file, f"contact/{name}", filename)[()]
             for name in ("start", "end", "angle_start", "angle_end", "contact")]
    count = _dataset(file, "contact/count", filename)[()]
    reaction = _dataset(file, "contact/reaction_total", filename)[()]
    width = min(span.shape[1] for span in spans)    # a kill may fall between two datasets growing by a region
    rows = {label: row for row, label in enumerate(mesh.node_label)}
    labels = _dataset(file, "contact/candidates", filename)[()]
    if any(label not in rows for label in labels):
        raise ResultsError(f"{filename}: /contact/candidates refers to nodes that do not exist")
    contact = Contact(np.minimum(count, width).astype(int), *(span[:, :width] for span in spans), reaction,
                      np.array([rows[label] for label in labels], dtype=int),
                      _dataset(file, "contact/candidate_contact", filename)[()].astype(int),
                      tuple(_text(name) for name in file["contact/obstacle"]) if "contact/obstacle" in file else ())
    return contact, [len(count), len(reaction), *(len(span) for span in spans)]


def _cut(contact: Contact, n: int) -> Contact:
    return Contact(contact.count[:n], contact.start[:n], contact.end[:n], contact.angle_start[:n],
                   contact.angle_end[:n], contact.contact[:n].astype(int), contact.reaction_total[:n],
                   contact.candidates, contact.candidate_contact, contact.obstacles)


def _fields(file: h5py.File, n_points: int) -> tuple[np.ndarray, tuple[str, ...]]:
    names = tuple(name for name in FIELD_NAMES if f"fields/{name}" in file)
    if not names or "fields/point" not in file:
        return np.zeros(0, dtype=int), ()
    shortest = min([len(file["fields/point"])] + [len(file[f"fields/{name}"]) for name in names])
    points = file["fields/point"][:shortest].astype(int)
    return points[points <= n_points], names


def _critical(file: h5py.File, path: dict[str, Column], monitors: dict[str, Column]) -> list[Critical]:
    """The critical points; of a run killed before they were written, what the labels of the path tell."""
    group = file.get("critical")
    if group is None:
        if "label" not in path:
            return []
        step = path["step"].values if "step" in path else np.zeros(len(path["label"].values), dtype=int)
        return [Critical(str(label), float(path["load_factor"].values[row]), row + 1, int(step[row]), True, "",
                         {name: float(c.values[row]) for name, c in monitors.items()})
                for row, label in enumerate(path["label"].values) if label]
    columns = {name: group[name][()] for name in ("label", "load_factor", "point", "step", "located", "note")
               if name in group}
    values = {name: item[()] for name, item in group.get("monitor", {}).items()}
    n = min(len(item) for item in (*columns.values(), *values.values()))
    return [Critical(_text(columns["label"][k]), float(columns["load_factor"][k]), int(columns["point"][k]),
                     int(columns["step"][k]) if "step" in columns else 0,
                     bool(columns["located"][k]) if "located" in columns else True,
                     _text(columns["note"][k]) if "note" in columns else "",
                     {name: float(item[k]) for name, item in values.items()}) for k in range(n)]


def _obstacle(name: str, item: h5py.Group | h5py.Dataset) -> Obstacle:
    attrs = item.attrs
    kind = _text(attrs["type"]).lower()
    circle = kind == "circle"
    if kind not in ("line", "circle"):
        raise ValueError(f"obstacle {name} has the unknown type '{kind}'")
    return Obstacle(
        name, kind, _text(attrs.get("side", "")).lower(),
        points=None if circle else np.array(attrs["points"], dtype=float).reshape(2, 2),
        centre=np.array(attrs["centre"], dtype=float).reshape(2) if circle else None,
        radius=_scalar(attrs["radius"]) if circle else None,
        reference_angle=_scalar(attrs.get("reference_angle", 0.0)),
        foundation=_text(attrs.get("foundation", "rigid")).lower(), modulus=_scalar(attrs.get("modulus", 0.0)))


# Small helpers


def _open(filename: str) -> h5py.File:
    if not os.path.exists(filename):
        raise ResultsError(f"{filename}: no such file")
    if not os.path.isfile(filename):
        raise ResultsError(f"{filename}: not a file")
    try:
        if not h5py.is_hdf5(filename):
            raise ResultsError(f"{filename}: not an HDF5 file")
        return h5py.File(filename, "r", locking=False)    # no lock: a run may still be writing
    except OSError as problem:
        raise ResultsError(f"{filename}: cannot be opened: {_reason(problem)}") from problem


def _dataset(file: h5py.File, name: str, filename: str) -> h5py.Dataset:
    item = file.get(name)
    if not isinstance(item, h5py.Dataset):
        raise ResultsError(f"{filename}: /{name} is missing")
    return item


def _column(item: h5py.Dataset) -> Column:
    values = item[()]
    if values.dtype.kind in "SO":
        values = np.array([_text(value) for value in values], dtype=str)
    return Column(item.name.rsplit("/", 1)[1], values, _text(item.attrs.get("units", "1")),
                  _text(item.attrs.get("description", "")))


def _text(value) -> str:
    """Text however it was stored: fixed or variable length, blank or null padded, scalar or one-element array."""
    if isinstance(value, np.ndarray):
        value = value.ravel()[0] if value.size else ""
    if isinstance(value, bytes):
        value = value.decode("utf-8", "replace")
    return str(value).rstrip("\0 ")


def _scalar(value) -> float:
    return float(np.ravel(value)[0])


def _nearest(points: np.ndarray, point: int) -> str:
    if points.size == 0:
        return "none are stored at all"
    below, above = points[points < point], points[points > point]
    near = [str(group) for group in ([below.max()] if below.size else []) + ([above.min()] if above.size else [])]
    return f"nearest: {', '.join(near)}"


def _numbered_rows(file):
    reader = csv.reader(line if not line.lstrip().startswith("#") else "\n" for line in file)
    for row in reader:
        if any(cell.strip() for cell in row):
            yield reader.line_num, row


def _number(row: list[str], at: int, name: str, filename: str, line: int) -> float:
    cell = row[at].strip() if at < len(row) else ""
    try:
        return float(cell) if cell else float("nan")
    except ValueError:
        raise ResultsError(f"{filename}:{line}: column '{name}': '{cell}' is not a number") from None


def _reason(problem: Exception) -> str:
    return getattr(problem, "strerror", None) or _one_line(problem)


def _one_line(problem: Exception) -> str:
    return " ".join(str(problem).split()) or type(problem).__name__

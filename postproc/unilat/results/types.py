"""What a unilat result file holds, as Python objects; reader reads them."""

from __future__ import annotations

import difflib
import math
import re
from dataclasses import dataclass, field, replace

import numpy as np

from .contact_history import History, follow
from .file import ResultsError, dataset, open_file
from .model_parts import Loads, Supports
from .units import Units
from .words import brief, column_words, path_table, path_words

FIELD_NAMES = ("displacement", "section_forces", "reaction", "reaction_density", "gap", "contact_point")
FORCE_LISTS = ("contact_force", "contact_pressure")     # groups with a row a force


@dataclass(frozen=True, repr=False)
class Column:
    """One quantity along the path."""

    name: str
    values: np.ndarray        # (points)
    units: str = "1"          # in words: "length", "force", "moment", "radian", "degree", "1", "second"; or as *UNITS names them
    description: str = ""
    rate: np.ndarray | None = None       # (points) d/d(arc length), NaN where it is not known; None: the file has none

    __repr__ = column_words


@dataclass(frozen=True, repr=False)
class Mesh:
    coordinates: np.ndarray   # (nodes, 2) stress-free positions
    elements: np.ndarray      # (elements, 2) node rows, from 0
    node_label: np.ndarray    # (nodes) the deck's numbers
    element_label: np.ndarray
    # (joints, 2) node rows: a node, and that of the ends released at it
    releases: np.ndarray = field(default_factory=lambda: np.zeros((0, 2), dtype=int))
    # (joints, 3) True: u, v, rotation are not the same
    released: np.ndarray = field(default_factory=lambda: np.zeros((0, 3), dtype=bool))
    # (rigid bars, 2) node rows: the node that turns a bar, and the node it carries
    links: np.ndarray = field(default_factory=lambda: np.zeros((0, 2), dtype=int))
    # (elements, 2) [rad] where the stress-free axis points to at both ends; None: the file has it not, as for elements that are straight
    direction: np.ndarray | None = None
    bending_stiffness: np.ndarray | None = None      # (elements) EI

    __repr__ = brief

    @property
    def hinges(self) -> np.ndarray:
        """Node rows of the releases that let ends turn."""
        return self.releases[self.released[:, 2], 0]


@dataclass(frozen=True, repr=False)
class Obstacle:
    name: str
    kind: str                 # "line", "circle", "arc", "polyline" or "spline"; "gap": the stops of a *GAP, "soil": *AXIAL SOIL
    side: str                 # circle: the structure is "inside" or "outside"; the others: "left" of the sense of the points
    points: np.ndarray | None        # line: (2, 2); polyline, spline: (points, 2); gap: (stops, 2)
    centre: np.ndarray | None        # circle, arc: (2)
    radius: float | None             # circle, arc; polyline: of its corners
    reference_angle: float    # [degrees] direction that contact angles count from
    foundation: str           # "rigid", "winkler" or "law"
    modulus: float            # force per unit length of rod and unit penetration; gap: force per unit penetration
    angles: np.ndarray | None = None     # arc: (2) [degrees] directions from the centre to its ends
    surface: np.ndarray | None = None    # arc, polyline, spline: (samples, 2) along it; it goes on straight beyond both ends, unless they meet
    number: int = 0           # in the deck, from 1; the stops of *GAP after the obstacles
    pivot: np.ndarray | None = None      # (2) about which it turns, where it begins
    normal: np.ndarray | None = None     # gap: (2) direction in which the stops push
    end: np.ndarray | None = None        # gap that is a MEMBER: (2) the bar's other end, where it begins

    __repr__ = brief

    def moved(self, shift: np.ndarray, turn: float = 0.0) -> Obstacle:
        """The obstacle somewhere else: turned (rad) about its pivot, and displaced."""
        c, s = math.cos(turn), math.sin(turn)
        pivot = np.zeros(2) if self.pivot is None else self.pivot
        moved = {name: (getattr(self, name) - pivot) @ np.array(((c, s), (-s, c))) + pivot + shift
                 for name in ("points", "centre", "surface") if getattr(self, name) is not None}
        if self.angles is not None:
            moved["angles"] = self.angles + math.degrees(turn)
        return replace(self, reference_angle=self.reference_angle + math.degrees(turn), **moved)


@dataclass(frozen=True)
class Critical:
    label: str                # LP, BP, TP, C+, C-, UZ, EP
    load_factor: float
    point: int                # from 1
    step: int
    located: bool             # False: bracketed, not found to the tolerance
    note: str
    monitors: dict[str, float]
    multiplicity: int = 0     # null vectors in the file: 0 none, 1 simple bifurcation, 2 double, ...
    row: int = 0              # its row in /critical, from 1
    error: float = float("nan")      # error bar of the load factor; NaN: no estimate, inf: the mesh is too coarse to tell
    corrected: float = float("nan")  # load factor less its estimated error
    monitor_errors: dict[str, float] = field(default_factory=dict)
    monitor_corrected: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Region:
    """One stretch of contact at one point of the path."""

    contact: int              # which *CONTACT, from 1
    start: float              # stress-free arc length along the candidates
    end: float
    angle_start: float        # [degrees] from the obstacle's reference direction; NaN for lines
    angle_end: float
    start_error: float = np.nan    # error bars of start and end, and these corrected; NaN: not told
    end_error: float = np.nan
    start_corrected: float = np.nan
    end_corrected: float = np.nan


@dataclass(frozen=True, repr=False)
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
    arc_length: np.ndarray           # (candidates) stress-free, along the candidates of each contact, which start and end count
    chain_length: np.ndarray         # (contacts) once round a closed chain, 0: open
    points: tuple[str, ...]          # of each contact, where reactions act: "nodes", "spans" or "distributed"
    obstacles: tuple[str, ...] = ()  # name of the obstacle of each contact
    obstacle_shift: np.ndarray | None = None     # (points, obstacles, 2) how far they have moved; None: they never do
    obstacle_turn: np.ndarray | None = None      # (points, obstacles) [rad] how far they have turned
    obstacle_force: np.ndarray | None = None     # (points, obstacles, 2) of each on the structure; None: a file from before
    bars: np.ndarray | None = None   # (4, points, regions) error bars of start and end, and these corrected; None: not told

    __repr__ = brief

    def regions(self, point: int) -> list[Region]:
        """The regions at a point (from 1)."""
        row = point - 1
        told = () if self.bars is None else self.bars
        return [Region(int(self.contact[row, k]), *(float(values[row, k]) for values in (*self._spans(), *told)))
                for k in range(self.count[row])]

    def histories(self) -> list[History]:
        """Every region followed from point to point until it ends, splits or merges, in order of appearance."""
        return follow(self)

    def _spans(self) -> tuple[np.ndarray, ...]:
        return self.start, self.end, self.angle_start, self.angle_end


@dataclass(frozen=True, kw_only=True, repr=False)
class Path:
    """A path of equilibrium points: that of the steps (see Results), or a branch."""

    filename: str
    group: str                # where it is in the file: "" or "branch/<k>/"
    n_points: int
    path: dict[str, Column]
    monitors: dict[str, Column]      # in the deck's order when the file keeps it, else by name
    mesh: Mesh
    contact: Contact | None   # None: a model without contact
    critical: list[Critical]
    obstacles: dict[str, Obstacle]
    field_points: np.ndarray  # numbers (from 1) of the points with stored fields, see points_with
    field_names: tuple[str, ...]     # of FIELD_NAMES, those in the file
    errors: dict[str, Column]        # error bars of load_factor and of monitors, where the file has them; NaN: no estimate
    has_force_lists: bool = False    # the file has the forces of contact spans, see force_list
    units: Units = Units()                                         # as *UNITS of the deck names them
    supports: Supports = field(default_factory=Supports)
    loads: dict[int, Loads] = field(default_factory=dict)          # by step

    def column_names(self) -> list[str]:
        return ["point", *self.monitors, *self.path]

    __repr__ = path_words
    _repr_html_ = path_table

    def __getitem__(self, name: str) -> np.ndarray:
        """The values of a quantity along the path: results["v"] is results.column("v").values."""
        return self.column(name).values

    def _ipython_key_completions_(self) -> list[str]:
        return self.column_names()

    def column(self, name: str) -> Column:
        """A quantity along the path by name: `point` (1, 2, ...), a dataset of /path or a monitor.

        Upper and lower case are the same. A monitor that has the name of a dataset of /path is `monitor/<name>`.
        """
        if name.strip().lower() == "point":
            return Column("point", np.arange(1, self.n_points + 1), "1", "number of the point")
        return find_column(self.filename, name, self.path, self.monitors, "path quantity or monitor",
                           self.column_names())

    def unstable(self) -> np.ndarray:
        """Points with an unstable direction; one in which contacts without force open, and that has no opposite, counts, too."""
        known = [self.path[name].values for name in ("free_pivots", "negative_pivots") if name in self.path]
        return known[0] > 0 if known else np.zeros(self.n_points, dtype=bool)

    def unit(self, word: str) -> str:
        """A unit in words, such as "force/length", in the units of the deck where it says them."""
        return self.units.of(word)

    def obstacles_at(self, point: int) -> list[Obstacle]:
        """The obstacles where they are at a point (from 1)."""
        return self.obstacles_between(point - 1)

    def obstacles_between(self, row: float) -> list[Obstacle]:
        """The obstacles where they are at a place of the path (rows from 0): between two points they move and turn evenly."""
        if self.contact is None or self.contact.obstacle_shift is None:
            return list(self.obstacles.values())
        low, high = int(np.floor(row)), int(np.ceil(row))

        def between(values: np.ndarray | None) -> np.ndarray:
            return np.zeros(len(self.obstacles)) if values is None else values[low] + (row - low) * (values[high] - values[low])

        shift, turn = between(self.contact.obstacle_shift), between(self.contact.obstacle_turn)
        return [obstacle.moved(shift[obstacle.number - 1], turn[obstacle.number - 1]) for obstacle in self.obstacles.values()]

    def field(self, name: str, point: int) -> np.ndarray:
        """A stored field at a point (from 1).

        displacement (nodes, 3): u, v, rotation; section_forces (elements, 2, 3): N, Q, M at both ends;
        reaction, reaction_density, gap (candidates); contact_point (candidates, 2): where these are.
        """
        self._known_field(name)
        found = np.flatnonzero(self.field_points == point)
        if found.size == 0:
            raise ResultsError(f"{self.filename}: no fields are stored at point {point} "
                               f"({_nearest(self.field_points, point)})")
        with open_file(self.filename) as file:
            values = dataset(file, f"{self.group}fields/{name}", self.filename)[found[0]]
        if np.all(np.isnan(values)):
            raise ResultsError(f"{self.filename}: field '{name}' is not stored at point {point}, its step did not ask")
        return values

    def points_with(self, name: str) -> np.ndarray:
        """Numbers of the points that hold this field: steps may ask for different ones."""
        self._known_field(name)
        with open_file(self.filename) as file:
            item = dataset(file, f"{self.group}fields/{name}", self.filename)
            first = item[(slice(len(self.field_points)), *(0,) * (item.ndim - 1))]
        return self.field_points[np.isfinite(first)]

    def force_list(self, name: str, point: int) -> np.ndarray:
        """`contact_force` or `contact_pressure` of a point, a row each (n, 6): contact, arc length, place, force. See contact_forces."""
        if not self.has_force_lists:
            return np.zeros((0, 6))
        with open_file(self.filename) as file:
            columns = [dataset(file, f"{self.group}{name}/{column}", self.filename)
                       for column in ("point", "contact", "arc_length", "place", "force")]
            rows = min(len(column) for column in columns)
            mine = np.flatnonzero(columns[0][:rows] == point)
            if mine.size == 0:
                return np.zeros((0, 6))
            part = slice(mine[0], mine[-1] + 1)        # a point's rows follow each other
            return np.column_stack([column[part] for column in columns[1:]])

    def null_vectors(self, critical: Critical) -> np.ndarray:
        """Null vectors (multiplicity, nodes, 3) of a bifurcation of this path; the largest translation is 1."""
        if critical.multiplicity == 0:
            raise ResultsError(f"{self.filename}: no null vectors are stored for {critical.label} at point "
                               f"{critical.point}")
        with open_file(self.filename) as file:
            return dataset(file, f"{self.group}critical/null_vector/{critical.row}", self.filename)[()]

    def _known_field(self, name: str):
        if name not in self.field_names:
            stored = f"stored: {', '.join(self.field_names)}" if self.field_names else "the deck asked for none"
            raise ResultsError(f"{self.filename}: field '{name}' is not in the file ({stored})")


@dataclass(frozen=True, kw_only=True, repr=False)
class Branch(Path):
    """A path that leaves another one at a bifurcation."""

    number: int               # from 1
    name: str                 # both sides have the same one
    step: int
    of: int                   # the branch it leaves, 0: the path of the steps
    bifurcation: int          # at the k-th BP of that path within the step
    mode: int                 # along this null vector
    side: int                 # 1 along it, -1 against it
    point: int                # number of that BP's point on the path it leaves, from 1


@dataclass(frozen=True, repr=False)
class Buckling:
    """The modes of a buckling step."""

    name: str                 # of the step
    step: int
    load_factor: np.ndarray   # (modes)
    residual: np.ndarray      # (modes)
    mode: np.ndarray          # (modes, nodes, 3) u, v, rotation, the largest translation is 1
    error: np.ndarray         # (modes) error bars of the load factors; NaN: no estimate
    corrected: np.ndarray     # (modes) load factors less their estimated errors

    __repr__ = brief


@dataclass(frozen=True, repr=False)
class LimitCurve:
    """Limit points of a step while a parameter varies."""

    filename: str
    name: str
    step: int
    parameter: str            # MODULUS, GAP, IMPERFECTION, EA, EI, CONSTANT LOAD
    of: str                   # name of the obstacle or element set
    limit_point: int          # of the step's path, from 1
    n_points: int
    columns: dict[str, Column]       # parameter, rigid, load_factor, iterations, residual, load_rate, label
    monitors: dict[str, Column]

    __repr__ = brief

    def column(self, name: str) -> Column:
        """A quantity along the curve by name, or a monitor; see Path.column."""
        return find_column(self.filename, name, self.columns, self.monitors, "quantity of limit curves or monitor",
                           [*self.columns, *self.monitors])

    @property
    def rigid(self) -> np.ndarray:
        """True where the obstacle was rigid."""
        return self.columns["rigid"].values > 0


@dataclass(frozen=True, kw_only=True, repr=False)
class Results(Path):
    """A result file. It is the path of the steps; the other things it holds are members."""

    title: str
    program: str
    version: str
    created: str
    status: str               # "complete", "stopped: why" or "running"
    deck: str
    branches: dict[int, Branch] = field(default_factory=dict)      # by number
    buckling: dict[str, Buckling] = field(default_factory=dict)    # by step name
    limit_curves: dict[str, LimitCurve] = field(default_factory=dict)
    performance: dict[str, list] = field(default_factory=dict)     # phase, seconds, calls; counter, value
    accuracy: dict[str, float] = field(default_factory=dict)       # worst values over all points
    parameters: dict[str, float | str] = field(default_factory=dict)    # values of *PARAMETER
    sets: dict[str, np.ndarray] = field(default_factory=dict)      # node rows of the sets

    @property
    def plot(self):
        """Pictures that notebooks show: results.plot.path(), results.plot.shape(label="LP"), ..."""
        from ..pictures import Plots     # needs matplotlib as soon as one is drawn
        return Plots(self.filename)

    def page(self, **options):
        """A page with a slider, as `unilat-plot html` writes it."""
        from ..pictures import page
        return page(self.filename, options)

    @property
    def complete(self) -> bool:
        return self.status == "complete"

    def path_number(self, number: int) -> Path:
        """Branch `number`, or for 0 the path of the steps."""
        if number == 0:
            return self
        if number not in self.branches:
            known = f"it has {', '.join(map(str, self.branches))}" if self.branches else "it has none"
            raise ResultsError(f"{self.filename}: no branch {number} ({known})")
        return self.branches[number]


def find_column(filename: str, name: str, columns: dict[str, Column], monitors: dict[str, Column], what: str,
                known: list[str]) -> Column:
    """A column by name; `monitor/<name>` is always a monitor. Upper and lower case are the same."""
    key = name.strip().lower()
    for group, prefix in ((columns, ""), (monitors, ""), (monitors, "monitor/")):
        for column in group.values():
            if prefix + column.name.lower() == key:
                return column
    near = difflib.get_close_matches(key, [n.lower() for n in known], 1)
    hint = f"did you mean {next(n for n in known if n.lower() == near[0])}? " if near else ""
    raise ResultsError(f"{filename}: no {what} '{name}' ({hint}known: {', '.join(known)})")


def _nearest(points: np.ndarray, point: int) -> str:
    if points.size == 0:
        return "none are stored at all"
    below, above = points[points < point], points[points > point]
    near = [str(group) for group in ([below.max()] if below.size else []) + ([above.min()] if above.size else [])]
    return f"nearest: {', '.join(near)}"

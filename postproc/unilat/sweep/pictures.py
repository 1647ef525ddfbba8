"""Pictures of a sweep: a quantity over one or two parameters, scatter and histogram."""

from __future__ import annotations

import os

import h5py
import numpy as np

from ..captions import escape
from ..plot import style
from ..results import ResultsError
from .sweep_file import Sweep

KINDS = ("line", "map", "scatter", "histogram")
KEYS = {"kind", "x", "y", "value", "over", "title", "x_label", "y_label", "label", "file", "bins", "x_scale", "y_scale"}
SHARES = (0.05, 0.5, 0.95)      # of the runs: below the band, the median, above it
PALETTE = "viridis"


@style.drawing
def draw(sweep: Sweep, folder: str) -> list[str]:
    """Draws every picture of the sweep file, or those that fit when it names none; their names."""
    name = os.path.join(folder, f"{sweep.name}.h5")
    if not os.path.exists(name):
        raise ResultsError(f"{name}: not there, nothing was gathered yet")
    with h5py.File(name) as file:
        table = {key: item[()] for key, item in file["runs"].items()}
    written = []
    for number, picture in enumerate(sweep.pictures or fitting(sweep, table), start=1):
        check(picture, sweep)
        figure = style.new_figure(89.0, 70.0, 300.0, constrained_layout=True)
        axes = figure.add_subplot()
        if not np.any(np.isfinite(np.asarray(table[picture.get("value") or picture.get("y") or picture["x"]], dtype=float))):
            raise ResultsError(f"{name}: no run has {picture.get('value') or picture.get('y') or picture['x']}")
        {"line": draw_line, "map": draw_map, "scatter": draw_scatter, "histogram": draw_histogram}[picture["kind"]](
            axes, table, picture)
        for axis in "xy":
            if f"{axis}_scale" in picture and picture["kind"] != "histogram":
                axes.set(**{f"{axis}scale": picture[f"{axis}_scale"]})
        if "title" in picture:
            axes.set_title(picture["title"])
        usual = f"{sweep.name}_{picture['kind']}{'' if number == 1 else f'-{number}'}.png"
        output = os.path.join(folder, picture.get("file", usual))
        style.lay_out(figure)
        figure.savefig(output)
        written.append(output)
    return written


def check(picture: dict, sweep: Sweep):
    needs = {"line": ("x", "y"), "map": ("x", "y", "value"), "scatter": ("x", "y"), "histogram": ("x",)}
    if picture.get("kind") not in KINDS:
        raise ResultsError(f"{sweep.name}: picture: kind is one of {', '.join(KINDS)}")
    for key in needs[picture["kind"]]:
        if key not in picture:
            raise ResultsError(f"{sweep.name}: picture {picture['kind']}: {key} is missing")
    unknown = set(picture) - KEYS
    if unknown:
        raise ResultsError(f"{sweep.name}: picture {picture['kind']}: '{min(unknown)}' is not known")


def fitting(sweep: Sweep, table: dict) -> list[dict]:
    """Of the first quantity: a map over two parameters that vary, a line over one, else a histogram; seeds do not count."""
    quantity = next(iter(sweep.gather))
    varying = [name for name in sweep.values[0] if sweep.group[name] != "seeds" and len(set(table[name].tolist())) > 1]
    if {"latin", "random", "seeds"} & set(sweep.group.values()):
        return [{"kind": "histogram", "x": quantity}] + [{"kind": "scatter", "x": name, "y": quantity} for name in varying]
    if len(varying) == 2:
        return [{"kind": "map", "x": varying[0], "y": varying[1], "value": quantity}]
    return [{"kind": "line", "x": name, "y": quantity} for name in varying]


def draw_line(axes, table: dict, picture: dict):
    """A curve over x, one for each value of `over`; where several runs have the same x, their median and a band."""
    over = picture.get("over")
    groups = sorted(set(table[over].tolist())) if over else [None]
    for k, group in enumerate(groups):
        mine = np.ones(len(table["code"]), dtype=bool) if group is None else table[over] == group
        x, y = (np.asarray(table[picture[key]], dtype=float)[mine] for key in "xy")
        places = np.unique(x[np.isfinite(y)])
        curves = np.array([np.quantile(y[(x == place) & np.isfinite(y)], SHARES) for place in places]).reshape(-1, 3).T
        several = any(np.sum((x == place) & np.isfinite(y)) > 1 for place in places)
        look = style.look(k)
        name = None if group is None else f"{named(over)} = {_short(group)}"
        axes.plot(places, curves[1], marker=".", markersize=4, label=name, **look)
        if several:
            axes.fill_between(places, curves[0], curves[2], alpha=0.15, linewidth=0, color=look["color"],
                              label="5 to 95 % of the runs" if k == len(groups) - 1 else None)
    if over or axes.get_legend_handles_labels()[1]:
        beside = {"loc": "center left", "bbox_to_anchor": (1.01, 0.5)} if len(groups) > 3 else {"loc": "best"}
        axes.legend(**beside)
    label(axes, picture, picture["x"], picture["y"])


def draw_map(axes, table: dict, picture: dict):
    """A value over two parameters: coloured fields of a grid with their values, coloured points elsewhere."""
    x, y, value = (np.asarray(table[picture[key]], dtype=float) for key in ("x", "y", "value"))
    columns, rows = np.unique(x), np.unique(y)
    if len(columns) * len(rows) <= 4 * len(x) and min(len(columns), len(rows)) > 1:
        field = np.array([[_median(value[(x == column) & (y == row)]) for column in columns] for row in rows])
        drawn = axes.pcolormesh(_edges(columns, picture.get("x_scale")), _edges(rows, picture.get("y_scale")), field, cmap=PALETTE)
        limits = np.nanquantile(field, (0.0, 0.5))
        if field.size <= 80:
            for (row, column), number in np.ndenumerate(field):
                text = f"{number:.3g}" if np.isfinite(number) else "none"
                axes.text(columns[column], rows[row], text, ha="center", va="center", fontsize=7,
                          color="white" if number < limits[1] else style.INK)
    else:
        there = np.isfinite(value)
        drawn = axes.scatter(x[there], y[there], c=value[there], s=14, cmap=PALETTE, zorder=3)
        axes.scatter(x[~there], y[~there], marker="x", s=12, color=style.REFERENCE, linewidths=0.8, zorder=3)
    axes.figure.colorbar(drawn, ax=axes, label=picture.get("label", named(picture["value"])))
    label(axes, picture, picture["x"], picture["y"])


def draw_scatter(axes, table: dict, picture: dict):
    """A dot a run, coloured by `value` if there is one."""
    x, y = (np.asarray(table[picture[key]], dtype=float) for key in "xy")
    there = np.isfinite(x) & np.isfinite(y)
    if "value" in picture:
        colour = np.asarray(table[picture["value"]], dtype=float)[there]
        drawn = axes.scatter(x[there], y[there], c=colour, s=9, cmap=PALETTE, zorder=3)
        axes.figure.colorbar(drawn, ax=axes, label=picture.get("label", named(picture["value"])))
    else:
        axes.scatter(x[there], y[there], s=9, color=style.COLOURS[0], alpha=0.7, linewidths=0, zorder=3)
    without(axes, len(x) - int(np.sum(there)))
    label(axes, picture, picture["x"], picture["y"])


def draw_histogram(axes, table: dict, picture: dict):
    """How the runs are spread, with mean, standard deviation and the 5 % quantile."""
    values = np.asarray(table[picture["x"]], dtype=float)
    there = values[np.isfinite(values)]
    bins = picture.get("bins") or (np.histogram_bin_edges(there, "fd") if len(there) < 10000 else 60)
    axes.hist(there, bins=bins if np.ndim(bins) == 0 or len(bins) < 80 else 60, color=style.COLOURS[0], alpha=0.55,
              edgecolor="white", linewidth=0.3, zorder=2)
    low = float(np.quantile(there, SHARES[0]))
    mean = float(np.mean(there))
    room = 1.25        # over the tallest bar, for the legend
    axes.axvline(mean, ymax=1.0 / room, color=style.INK, linewidth=1.0, label=f"mean {mean:.4g}, deviation {np.std(there):.2g}", zorder=3)
    axes.axvline(low, ymax=1.0 / room, color=style.CONTACT, linewidth=1.0, linestyle=(0, (4.5, 1.8)), zorder=3,
                 label=f"5 % of the runs are below {low:.4g}")
    axes.margins(x=0.03)
    axes.set_ylim(top=room * axes.get_ylim()[1])
    axes.legend(loc="upper left")
    without(axes, len(values) - len(there))
    label(axes, picture, picture["x"], None)
    axes.set_ylabel(picture.get("y_label", f"runs, of {len(there)}"))


def without(axes, number: int):
    """Says how many runs are not in the picture."""
    if number:
        axes.annotate(f"{number} run{'s' if number > 1 else ''} without a value", (1.0, 1.0), xycoords="axes fraction", xytext=(-1.0, 3.0),
                      textcoords="offset points", ha="right", va="bottom", fontsize=7.5, color=style.CONTACT)


def label(axes, picture: dict, x: str, y: str | None):
    axes.set_xlabel(picture.get("x_label", named(x)))
    if y is not None:
        axes.set_ylabel(picture.get("y_label", named(y)))


def named(name: str) -> str:
    return escape(name.replace("_", " "))


def _median(values: np.ndarray) -> float:
    values = values[np.isfinite(values)]
    return float(np.median(values)) if values.size else float("nan")


def _edges(places: np.ndarray, scale: str | None) -> np.ndarray:
    """Borders of fields about places."""
    at = np.log(places) if scale == "log" else places
    middle = 0.5 * (at[1:] + at[:-1])
    edges = np.concatenate(([2.0 * at[0] - middle[0]], middle, [2.0 * at[-1] - middle[-1]]))
    return np.exp(edges) if scale == "log" else edges


def _short(value) -> str:
    return value.decode() if isinstance(value, bytes) else f"{value:.4g}" if isinstance(value, float) else str(value)

"""The paper's Figs. 5, 6, 9, 10 and 11 from our runs, with the numbers that the paper prints and the exact paths."""

from __future__ import annotations

import os

import numpy as np
from matplotlib.lines import Line2D

from ..plot import path_curves, style
from ..plot.label_placing import place_labels
from ..plot.obstacle_drawing import draw_obstacle
from ..results import Results
from ..results.rod_shape import Shape, contact_curves
from .runs import MODULI, PAPERS_MODULUS
from .tables import ANGLES, COLUMN, PAPER, PIAN, STEIN, Sources, point_at, separation_angle

EXACT = {"color": "#b5b5b5", "linewidth": 3.2, "solid_capstyle": "butt", "zorder": 2}
PRINTED = {PIAN: ("s", "#009E73"), STEIN: ("D", "#CC79A7"), PAPER: ("o", "#D55E00")}
STRETCH = 5.0       # of y in Fig. 11
PANEL = 90.0         # [mm] of its panels for a unit of length


@style.drawing
def draw(runs, sources: Sources, folder: str) -> list[str]:
    """All figures; their names."""
    return [figure(runs, sources, os.path.join(folder, name)) for name, figure in
            (("figure-5.png", figure_5), ("figure-6.png", figure_6), ("figure-9.png", figure_9), ("figure-10.png", figure_10),
             ("figure-11.png", figure_11))]


def figure_5(runs, sources: Sources, output: str) -> str:
    """Load over the deflection of the ring's apex; critical loads of Table 1, loads of Table 2 with their angles."""
    figure, axes = empty(120.0, 90.0)
    ring = runs["ring"]
    axes.plot(*sources.curve("ring_rigid_Rh100", "v", "p"), **EXACT)
    curve(axes, ring, "v", 0)
    limit = next(critical for critical in ring.critical if critical.label == "LP")
    at = ring.column("v").values[limit.point - 1]
    for by, (marker, colour) in PRINTED.items():
        printed = float(sources.print_of("Table 1", by, "critical load")["load"])
        axes.plot(at, printed, marker=marker, color=colour, markersize=4.2, markerfacecolor="white", linestyle="none", zorder=7)
    texts = []
    for _, way, load in ANGLES:
        printed = [sources.print_of("Table 2", by, way, load)["value"] for by in (PIAN, PAPER)]
        point = point_at(ring, way, load)
        x, y = (ring.column(name).values[point - 1] for name in ("v", "load_factor"))
        axes.plot(x, y, ".", color=style.INK, markersize=4, zorder=6)
        texts.append((x, y, f"$\\phi$ = {separation_angle(ring, way, load):.2f} ({printed[0]}, {printed[1]})", style.INK))
    axes.set_xlim(0.0, 0.16)
    axes.set_ylim(0.0, 95.0)
    axes.set_xlabel("$v/R$")
    axes.set_ylabel("$pR^3/EI$")
    handles = [Line2D([], [], label="unilat, rigid cavity", **style.look(0)), Line2D([], [], label="exact", **without_order(EXACT)),
               *(Line2D([], [], marker=marker, color=colour, markerfacecolor="white", linestyle="none", markersize=4.2,
                        label=f"{by}: {sources.print_of('Table 1', by, 'critical load')['load']}")
                 for by, (marker, colour) in PRINTED.items())]
    axes.legend(handles=handles, loc="upper right", title="$\\phi$ in degrees: unilat (Pian, paper)", title_fontsize=8.5)
    place_labels(axes, texts)
    return saved(figure, output)


def figure_6(runs, sources: Sources, output: str) -> str:
    """The same for foundations of several stiffnesses."""
    figure, axes = empty(120.0, 90.0)
    for k, modulus in enumerate(MODULI):
        curve(axes, runs[f"medium-{modulus}"], "v", k)
    curve(axes, runs["ring"], "v", len(MODULI))
    paper = float(sources.print_of("Table 1", PAPER, "critical load")["load"])
    medium = runs[f"medium-{PAPERS_MODULUS}"]
    limit = next(critical for critical in medium.critical if critical.label == "LP")
    marker, colour = PRINTED[PAPER]
    axes.plot(medium.column("v").values[limit.point - 1], paper, marker=marker, color=colour, markersize=4.5,
              markerfacecolor="white", linestyle="none", zorder=7)
    axes.set_xlim(0.0, 0.3)
    axes.set_ylim(0.0, 95.0)
    axes.set_xlabel("$v/R$")
    axes.set_ylabel("$pR^3/EI$")
    handles = [Line2D([], [], label=f"$kR^4/EI$ = {powers(modulus)}", **style.look(k))
               for k, modulus in enumerate(MODULI)]
    handles += [Line2D([], [], label="rigid", **style.look(len(MODULI))),
                Line2D([], [], marker=marker, color=colour, markerfacecolor="white", linestyle="none", markersize=4.5,
                       label=f"paper, {powers(PAPERS_MODULUS)}: {paper:g}")]
    axes.legend(handles=handles, loc="upper right")
    return saved(figure, output)


def powers(number: str) -> str:
    """3.6E6 as it is printed."""
    factor, exponent = number.split("E")
    before = "" if factor == "1" else rf"{factor} \times "
    return f"${before}10^{exponent}$"


def figure_9(runs, sources: Sources, output: str) -> str:
    """Load of the column over its deflection at midspan."""
    return column_path(runs, sources, output, "midspan", "mid_over_h", "$(w+\\bar{w})/h$ at midspan", (-6.0, 5.0))


def figure_10(runs, sources: Sources, output: str) -> str:
    """Load of the column over its shortening."""
    return column_path(runs, sources, output, "shortening", "shortening_over_L", "end shortening $u/L$", (0.0, 0.006))


def column_path(runs, sources: Sources, output: str, x: str, exact: str, label: str, limits: tuple[float, float]) -> str:
    figure, axes = empty(120.0, 90.0)
    column = runs["column"]
    axes.plot(*sources.curve("column_clamped", exact, "P_over_Pcr"), **EXACT)
    curve(axes, column, x, 0)
    texts = []
    for name, point in stages(column).items():
        place = column.column(x).values[point - 1], column.column("load_factor").values[point - 1]
        if limits[0] <= place[0] <= limits[1]:
            axes.plot(*place, ".", color=style.INK, markersize=5, zorder=6)
            texts.append((*place, name, style.INK))
    marker, colour = PRINTED[PAPER]
    for name in COLUMN:
        printed = float(sources.print_of("Fig. 9", PAPER, name)["load"])
        axes.plot(column.column(x).values[stages(column)[name] - 1], printed, marker=marker, color=colour, markersize=5.5,
                  markerfacecolor="none", linestyle="none", zorder=7)
    axes.set_xlim(limits)
    axes.set_ylim(0.0, 2.8)
    axes.set_xlabel(label)
    axes.set_ylabel("$P/P_{cr}$")
    printed = ", ".join(f"{name} {sources.print_of('Fig. 9', PAPER, name)['load']}" for name in COLUMN)
    axes.legend(handles=[Line2D([], [], label="unilat, stable", **style.look(0)),
                         Line2D([], [], label="unilat, unstable", linestyle=path_curves.UNSTABLE, **style.look(0)),
                         Line2D([], [], label="exact", **without_order(EXACT)),
                         Line2D([], [], marker=marker, color=colour, markerfacecolor="none", linestyle="none", markersize=5.5,
                                label=f"paper: {printed}")], loc="lower left" if limits[0] < 0.0 else "lower right")
    place_labels(axes, texts)
    return saved(figure, output)


def figure_11(runs, sources: Sources, output: str) -> str:
    """Shapes of the column at the stages a0 to a5, one below the other, y drawn larger."""
    column = runs["column"]
    chosen, home = stages(column), Shape(column.mesh)
    shapes = {name: Shape(column.mesh, column.field("displacement", point)) for name, point in chosen.items()}
    lowest = [min(-0.008, float(shape.nodes[:, 1].min()) - 0.004) for shape in shapes.values()]
    highest = 0.026                     # a little behind the wall
    tall = [STRETCH * (highest - low) * PANEL for low in lowest]
    figure = style.new_figure(120.0, sum(tall) + 24.0, 300.0, constrained_layout=True)
    panels = figure.subplots(len(chosen), 1, sharex=True, gridspec_kw={"height_ratios": tall})
    for axes, (name, point), low in zip(panels, chosen.items(), lowest):
        shape, limits = shapes[name], np.array(((-0.02, low), (1.02, highest)))
        for obstacle in column.obstacles_at(point):
            draw_obstacle(axes, obstacle, limits, STRETCH)
        for each in home.curves():
            axes.plot(*each.T, **style.STRESS_FREE)
        for each in shape.curves():
            axes.plot(*each.T, color=style.COLOURS[0], linewidth=1.4, zorder=4)
        lines, spots = contact_curves(column, point, shape)
        for each in lines:
            axes.plot(*each.T, color=style.CONTACT, linewidth=2.2, zorder=5, solid_capstyle="butt")
        if len(spots):
            axes.plot(*np.array(spots).T, "o", color=style.CONTACT, markersize=3.6, zorder=6)
        axes.set_xlim(limits[:, 0])
        axes.set_ylim(limits[:, 1])
        axes.set_aspect(STRETCH)
        load = column.column("load_factor").values[point - 1]
        printed = f"\npaper {sources.print_of('Fig. 9', PAPER, name)['load']}" if name in COLUMN else ""
        axes.set_ylabel(f"{name}\n{load:.4f}{printed}", rotation=0, ha="right", va="center")
        axes.tick_params(labelleft=False, left=False, right=False, which="both")
    panels[-1].set_xlabel(f"$x/L$; $y$ is drawn {STRETCH:g} times larger. Left: $P/P_{{cr}}$, orange: contact")
    return saved(figure, output)


def stages(column: Results) -> dict[str, int]:
    """Points a0 to a5 of the paper's Figs. 9 to 11.

    a3 is half-way down in load from a2 to a4, a5 where the free column carries least: the paper tells no loads for both.
    """
    first = {label: next(critical.point for critical in column.critical if critical.label == label)
             for label in ("C+", "LP", "C-")}
    load = column.column("load_factor").values
    between = np.arange(first["LP"] + 1, first["C-"])
    middle = 0.5 * (load[first["LP"] - 1] + load[first["C-"] - 1])
    last = [critical.point for critical in column.critical if critical.label == "LP"][-1]
    return {"a0": 1, "a1": first["C+"], "a2": first["LP"], "a3": int(between[np.argmin(np.abs(load[between - 1] - middle))]),
            "a4": first["C-"], "a5": last}


def curve(axes, results: Results, x: str, number: int):
    path_curves.draw_path(axes, results, results.column(x), results.column("load_factor"), style.look(number))


def without_order(look: dict) -> dict:
    return {key: value for key, value in look.items() if key != "zorder"}


def empty(width: float, height: float):
    figure = style.new_figure(width, height, 300.0, constrained_layout=True)
    return figure, figure.add_subplot()


def saved(figure, output: str) -> str:
    style.lay_out(figure)
    figure.savefig(output)
    return output

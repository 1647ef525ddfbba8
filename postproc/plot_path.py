#!/usr/bin/env python3
"""Draw a load path: any path quantity or monitor against any other."""

from __future__ import annotations

import plot_style as style  # before matplotlib's own modules: it chooses the backend
from matplotlib.lines import Line2D

DESCRIPTION = """\
Draw a path of equilibrium points of one or more result files: any path quantity or monitor against any other,
the load factor over the first monitor when nothing else is asked. Stable parts (no negative pivot of the tangent)
are solid, unstable ones dashed; critical points are marked by their labels: LP limit point, BP bifurcation,
C+ contact gained, C- contact lost, UZ user value, EP end."""

EXAMPLES = """\
examples:
  plot_path.py ring.h5
  plot_path.py ring.h5 --x v --y load_factor --reference ring.csv --ref-x v --ref-y p --ref-name exact
  plot_path.py coarse.h5 fine.h5 --name "40 elements" --name "320 elements" -o ring.pdf
  plot_path.py column.h5 --x mid --x-scale 50 --x-label '$y/d$' --y-scale 0.02533 --mark LP,C+,C- --values
  plot_path.py ring.h5 --list
"""


def main(argv=None) -> int:
    parser = style.Parser(description=DESCRIPTION, epilog=EXAMPLES)
    style.add_files(parser)
    parser.add_argument("--x", metavar="NAME", help="quantity along x (default: the first monitor, else point)")
    parser.add_argument("--y", metavar="NAME", default="load_factor", help="quantity along y (default load_factor)")
    parser.add_argument("--list", action="store_true", help="list the quantities of the files and stop")
    style.add_marks(parser, "LP,BP,C+,C-,UZ")
    parser.add_argument("--values", action="store_true", help="write the value of y beside the labels")
    parser.add_argument("--points", action="store_true", help="show every computed point as a dot")
    style.add_axes(parser)
    style.add_reference(parser)
    style.add_output(parser, width=89, height=70)
    args = parser.parse_args(argv)
    everything = style.load(args)
    if args.list:
        return list_quantities(everything)

    figure, axes = style.new_figure(args, args.height)
    references = style.draw_references(axes, args)
    texts, handles, unstable, columns = [], [], False, None
    for k, (results, name) in enumerate(zip(everything, style.names(args, everything))):
        x = style.numbers(results, args.x or next(iter(results.monitors), "point"))
        y = style.numbers(results, args.y)
        columns = columns or (x, y)
        colour = style.COLOURS[k % len(style.COLOURS)]
        breaks = "load_factor" in (x.name, y.name)
        unstable |= style.draw_path(axes, results, args.x_scale * x.values, args.y_scale * y.values, colour, breaks)
        if args.points:
            axes.plot(args.x_scale * x.values, args.y_scale * y.values, ".", color=colour, markersize=2.6, zorder=5)

        def place(critical, results=results, x=x, y=y):
            return (args.x_scale * style.critical_value(results, critical, x),
                    args.y_scale * style.critical_value(results, critical, y))

        texts += style.draw_marks(axes, results, args.mark, place, colour,
                                  (lambda critical, place=place: place(critical)[1]) if args.values else None)
        handles.append(Line2D([], [], color=colour, label=name))
    if len(everything) == 1 and not references:
        handles = [Line2D([], [], color=style.COLOURS[0], label="stable")] if unstable else []
    if unstable:
        colour = style.COLOURS[0] if len(everything) == 1 else style.INK
        handles.append(Line2D([], [], color=colour, linestyle=style.UNSTABLE, label="unstable"))
    style.finish_axes(axes, args, style.column_label(columns[0], args.x_scale),
                      style.column_label(columns[1], args.y_scale))
    style.legend(axes, handles + references, loc="best")
    style.place_labels(axes, texts)
    return style.save(figure, args, everything, "path")


def list_quantities(everything) -> int:
    for results in everything:
        print(f"{results.filename}: {results.n_points} points, {results.status}")
        for name in results.column_names():
            column = results.column(name)
            print(f"   {name:<20} {column.units:<10} {column.description}".rstrip())
    return 0


if __name__ == "__main__":
    style.run(main)

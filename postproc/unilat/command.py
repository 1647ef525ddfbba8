"""The command unilat-plot: finds the module of a subcommand and tells what went wrong in one line."""

from __future__ import annotations

import importlib
import os
import sys

from .plain_text import printable_lines

COMMANDS = {
    "path": ("plot.path", "bifurcation diagram: the path and its branches over any quantity"),
    "shape": ("plot.shape", "deformed shapes, obstacles, the part in contact"),
    "model": ("plot.model", "the model of a deck before it is run: supports, loads, obstacles"),
    "contact": ("plot.contact", "where contact begins and ends along the path"),
    "reaction": ("plot.reaction", "contact reactions and gaps along the rod"),
    "forces": ("plot.forces", "normal force, shear force and bending moment along the rods"),
    "modes": ("plot.modes", "buckling modes"),
    "curve": ("plot.curve", "limit load over the parameter of a limit curve"),
    "animate": ("plot.animate", "the shape beside the path, as a GIF or MP4"),
    "csv": ("export.csv", "tables as text"),
    "vtk": ("export.vtk", "time series for ParaView"),
    "html": ("export.html", "one page with a slider, for any browser"),
}
PACKAGES = {"matplotlib": "csv, vtk and html do without"}


def usage() -> str:
    rows = "\n".join(f"   {name:<10} {what}" for name, (_, what) in COMMANDS.items())
    return f"usage: unilat-plot COMMAND RESULTS.h5 ... [option ...]\n       unilat-plot model DECK.inp [option ...]\n\n{rows}\n\nunilat-plot COMMAND --help tells the rest.\n"


def main(argv: list[str] | None = None) -> int:
    """The exit code: 0, or 2 when the input is wrong or a package is missing."""
    argv = sys.argv[1:] if argv is None else argv
    if not argv or argv[0] in ("-h", "--help"):
        print(usage(), end="")
        return 0 if argv else 2
    if argv[0] not in COMMANDS:
        return complain("unilat-plot", f"no command '{argv[0]}' (known: {', '.join(COMMANDS)})")
    return guarded(f"unilat-plot {argv[0]}", COMMANDS[argv[0]][0], argv[1:])


def guarded(command: str, module: str, argv: list[str]) -> int:
    """Runs main of a module of this package; what goes wrong is told in one line."""
    try:
        wrong = importlib.import_module(".results", __package__).ResultsError
        work = importlib.import_module(f".{module}", __package__).main
    except ModuleNotFoundError as problem:
        missing = (problem.name or "").split(".")[0]
        if missing == __package__:
            raise
        also = f"; {PACKAGES[missing]}" if missing in PACKAGES else ""
        return complain(command, f"needs the Python package {missing}: apt-get install python3-{missing}, or "
                                 f"pip install {missing}{also}")
    try:
        return work(argv)
    except wrong as problem:
        return complain(command, problem)
    except KeyboardInterrupt:
        print(f"\n{command}: interrupted", file=sys.stderr)
        return 130
    except BrokenPipeError:     # the reader of the output, such as head, has enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0


def complain(command: str, problem) -> int:
    print(f"{command}: error: {printable_lines(str(problem))}", file=sys.stderr)
    return 2

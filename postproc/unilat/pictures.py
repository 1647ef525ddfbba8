"""Pictures in Python: what unilat-plot draws, as objects that notebooks show."""

from __future__ import annotations

import contextlib
import html
import importlib
import io
import os
import tempfile

from . import command
from .results import ResultsError

NOT_DRAWN = ("csv", "vtk", "html", "model")     # commands that Plots has in another form, or not at all


class Picture:
    """A finished picture; notebooks show it, save() writes it."""

    def __init__(self, name: str, files: list[str], arguments: list[str], data: bytes):
        self._name, self._files, self._arguments, self._png = name, files, arguments, data

    def save(self, filename: str | os.PathLike) -> str:
        """Writes the picture: .png, .pdf or .svg; the name of the file."""
        _run(self._name, self._files, [*self._arguments, "-o", os.fspath(filename)])
        return os.fspath(filename)

    def _repr_png_(self) -> bytes:
        return self._png

    def __repr__(self) -> str:
        return f"<picture: unilat-plot {self._name} {' '.join(self._arguments)}>".replace(" >", ">")


class Page:
    """A page with a slider; notebooks show it in a frame."""

    def __init__(self, text: str, height: int = 760):
        self.text, self.height = text, height

    def save(self, filename: str | os.PathLike) -> str:
        with open(filename, "w", encoding="utf-8") as file:
            file.write(self.text)
        return os.fspath(filename)

    def _repr_html_(self) -> str:
        return (f'<iframe srcdoc="{html.escape(self.text)}" width="100%" height="{self.height}" style="border:0" '
                'sandbox="allow-scripts"></iframe>')

    def __repr__(self) -> str:
        return f"<page of {len(self.text) // 1024} kB>"


class Plots:
    """The pictures of some results: results.plot.shape(label="LP", mirror="x=0"). Options are those of unilat-plot, with _ for -;
    a list is written with commas, True is an option without a value."""

    def __init__(self, *files: str):
        self._files = list(files)

    def __getattr__(self, name: str):
        if name not in self.__dir__() or name.startswith("_"):
            raise AttributeError(f"no picture '{name}' (known: {', '.join(self.__dir__())})")

        def drawn(**options) -> Picture:
            return draw(name, self._files, options)
        drawn.__name__ = drawn.__qualname__ = name
        drawn.__doc__ = f"{command.COMMANDS[name][1]}; options as `unilat-plot {name} --help` has them."
        return drawn

    def __dir__(self) -> list[str]:
        return [name for name in command.COMMANDS if name not in (*NOT_DRAWN, "animate")]

    def __repr__(self) -> str:
        return f"<pictures: {', '.join(self.__dir__())}>"


def draw(name: str, files: list[str], options: dict) -> Picture:
    """A picture of unilat-plot."""
    arguments = arguments_of(options)
    with tempfile.TemporaryDirectory() as folder:
        output = os.path.join(folder, "picture.png")
        _run(name, files, [*arguments, "-o", output, *([] if "dpi" in options else ["--dpi", "160"])])
        with open(output, "rb") as file:
            return Picture(name, files, arguments, file.read())


def page(file: str, options: dict) -> Page:
    """The page of unilat-plot html."""
    with tempfile.TemporaryDirectory() as folder:
        output = os.path.join(folder, "page.html")
        _run("html", [file], [*arguments_of(options), "-o", output])
        with open(output, encoding="utf-8") as text:
            return Page(text.read())


def arguments_of(options: dict) -> list[str]:
    """Options of a command line."""
    words: list[str] = []
    for name, value in options.items():
        option = f"--{name.rstrip('_').replace('_', '-')}"
        if value is True:
            words.append(option)
        elif value is not None and value is not False:
            if name in ("x_range", "y_range"):
                words += [option, *map(str, value)]
            elif name in ("name", "nset", "set", "curve", "reference", "ref_name") and not isinstance(value, str):
                words += [word for each in value for word in (option, str(each))]
            else:
                words += [option, ",".join(map(str, value)) if isinstance(value, (list, tuple)) else str(value)]
    return words


def _run(name: str, files: list[str], arguments: list[str]):
    """A command of unilat-plot, its errors as exceptions."""
    said = io.StringIO()
    try:
        work = importlib.import_module(f".{command.COMMANDS[name][0]}", __package__).main
    except ModuleNotFoundError as problem:
        raise ResultsError(f"pictures need the Python package {problem.name}: apt-get install python3-{problem.name}, or pip install "
                           f"{problem.name}") from problem
    try:
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            work([*files, *arguments])
    except SystemExit as ended:
        if ended.code:
            raise ResultsError(said.getvalue().strip().replace("unilat-plot ", "").replace(" (see --help)", "")) from None

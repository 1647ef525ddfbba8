"""Running the commands of unilat-plot in the tests."""

from __future__ import annotations

import os
import runpy
import struct
import subprocess
import sys
import tempfile
import traceback
import warnings
from pathlib import Path

import matplotlib
import numpy as np
import pytest

TESTS = Path(__file__).resolve().parent
POSTPROC = TESTS.parent / "postproc"
sys.path[:0] = [str(TESTS), str(POSTPROC)]

from unilat import command  # noqa: E402
from unilat.plot import style  # noqa: E402


def draw(name, *arguments):
    """Runs a subcommand as its command line would; warnings are errors. Its exit code."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            return command.main([name, *(str(a) for a in arguments)])
        except SystemExit as ended:     # the parser of arguments
            return ended.code


@pytest.fixture
def axes_of(monkeypatch):
    """Gives the axes of the picture that a subcommand would save, with the look that it has."""
    figures = []
    monkeypatch.setattr(style, "save", lambda figure, *_: figures.append(figure) or 0)

    def drawn(name, *arguments):
        assert draw(name, *arguments) == 0
        return figures[-1].axes

    with matplotlib.rc_context(style.LOOK):
        yield drawn


def empty_axes(**options):
    """A figure and its only axes."""
    figure = style.new_figure(options.pop("width", 160.0), options.pop("height", 120.0), options.pop("dpi", 100.0))
    return figure, figure.add_subplot()


def command_line(folder, *arguments, **changes):
    """python3 -m unilat in a folder, with no display; changes of the environment, None takes a variable away."""
    environment = {**os.environ, "PYTHONPATH": str(POSTPROC), "DISPLAY": None, "MPLBACKEND": None, **changes}
    return subprocess.run([sys.executable, "-B", "-m", "unilat", *map(str, arguments)], cwd=folder,
                          env={name: value for name, value in environment.items() if value is not None},
                          capture_output=True, text=True, check=False)


def module_run(folder, module, *arguments, **changes):
    """python3 -m MODULE in a folder, as a fork of this process: numpy, h5py and matplotlib, which take longer than most of what is
    tested, are there already. Changes are of the environment."""
    import matplotlib.pyplot    # noqa: F401
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        sys.stdout.flush()
        child = os.fork()
        if child == 0:
            _run_and_leave(folder, module, [str(a) for a in arguments], changes, out.fileno(), err.fileno())
        code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        out.seek(0)
        err.seek(0)
        return subprocess.CompletedProcess(arguments, code, out.read().decode(), err.read().decode())


def _run_and_leave(folder, module, arguments, changes, out, err):
    code = 1
    try:
        os.chdir(folder)
        os.environ.update(changes)
        for number, file in ((0, os.open(os.devnull, os.O_RDONLY)), (1, out), (2, err)):
            os.dup2(file, number)
        sys.stdin, sys.stdout, sys.stderr = open(0, closefd=False), open(1, "w", closefd=False), open(2, "w", closefd=False)
        sys.argv = [module, *arguments]
        runpy.run_module(module, run_name="__main__", alter_sys=True)
        code = 0
    except SystemExit as ended:
        code = ended.code if isinstance(ended.code, int) else int(ended.code is not None)
        if isinstance(ended.code, str):
            print(ended.code, file=sys.stderr)
    except BaseException:       # whatever it is, this process must not go on with the tests
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


def png_size(name):
    head = Path(name).read_bytes()[:24]
    assert head[:8] == b"\x89PNG\r\n\x1a\n"
    return struct.unpack(">II", head[16:24])


def drawn_share(name):
    """Share of pixels that are not white."""
    import matplotlib.image
    return float(np.mean(np.any(matplotlib.image.imread(name)[:, :, :3] < 0.99, axis=2)))

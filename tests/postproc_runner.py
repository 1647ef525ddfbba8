"""Running the plot scripts of postproc in the tests."""

from __future__ import annotations

import struct
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest

TESTS = Path(__file__).resolve().parent
POSTPROC = TESTS.parent / "postproc"
sys.path[:0] = [str(POSTPROC)]

import plot_style  # noqa: E402


def draw(script, *arguments):
    """Run a script's main as its command line would; warnings are errors. Its exit code."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(SystemExit) as ended:
            plot_style.run(lambda: script.main([str(a) for a in arguments]))
    return ended.value.code


@pytest.fixture
def axes_of(monkeypatch):
    """Gives the axes of the picture that a script would save; it stays open until the end of the test."""
    figures = []
    monkeypatch.setattr(plot_style, "save", lambda figure, *_: figures.append(figure) or 0)

    def drawn(script, *arguments):
        assert draw(script, *arguments) == 0
        return figures[-1].axes

    yield drawn
    plot_style.plt.close("all")


def png_size(name):
    head = Path(name).read_bytes()[:24]
    assert head[:8] == b"\x89PNG\r\n\x1a\n"
    return struct.unpack(">II", head[16:24])


def drawn_share(name):
    """Share of pixels that are not white."""
    import matplotlib.image
    return float(np.mean(np.any(matplotlib.image.imread(name)[:, :, :3] < 0.99, axis=2)))

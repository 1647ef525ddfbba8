"""Mirror images, for structures of which symmetry left a half or a quarter."""

from __future__ import annotations

import argparse

import numpy as np


def mirrored(curves: list[np.ndarray], line: tuple[int, float] | None) -> list[np.ndarray]:
    """The curves, and their images over the line x (0) or y (1) = value."""
    if line is None:
        return list(curves)
    axis, at = line
    images = [np.array(curve) for curve in curves]
    for image in images:
        image[..., axis] = 2.0 * at - image[..., axis]
    return list(curves) + images


def mirror_line(text: str) -> tuple[int, float]:
    """Reads x=0 or y=1.5 of a command line."""
    axis, _, at = text.replace(" ", "").partition("=")
    try:
        return "xy".index(axis.lower() or "?"), float(at)
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is not a line such as x=0 or y=1.5") from None

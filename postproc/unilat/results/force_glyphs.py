"""How forces are drawn: arrows that end where the force acts, and bands as high as a pressure; for pictures, films and pages."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .contact_forces import Force, Pressure

ARROW = 0.13        # of the picture's size: the largest force
SHORTEST = 0.035    # and one that is nearly none
BAND = 0.09         # the largest pressure
NO_PRESSURE = 1e-6  # of the largest one
ALIKE = 0.97        # of the largest pressure: places as good for its value
VALUE = 0.04, 0.08  # of the picture's size: room for a value behind an arrow, and what it needs more beside it


@dataclass(frozen=True)
class Arrow:
    tail: np.ndarray          # (2)
    tip: np.ndarray           # (2)
    value: float


@dataclass(frozen=True)
class Band:
    outline: np.ndarray       # (n, 2) a closed polygon: along the rod, and back at the height of the pressure
    top: np.ndarray           # (2) of a place where it is about as high as anywhere
    foot: np.ndarray          # (2) the rod there
    value: float              # the pressure there


@dataclass(frozen=True)
class Glyphs:
    arrows: list[Arrow]
    bands: list[Band]
    size: float               # of the picture along x
    stretch: float = 1.0      # how many times larger y is drawn

    def corners(self) -> np.ndarray:
        """Points (n, 2) that a picture must have room for: arrows, bands, values beside them."""
        parts = [with_value(arrow.tail, arrow.tip, self.size, self.stretch) for arrow in self.arrows] + [band.outline for band in self.bands]
        parts += [with_value(band.top, band.foot, self.size, self.stretch) for band in self.bands]
        return np.concatenate(parts) if parts else np.zeros((0, 2))


@dataclass(frozen=True)
class Scales:
    """What the longest arrow and the highest band stand for."""

    force: float
    pressure: float

    @staticmethod
    def of(everything: list[tuple[list[Force], list[Pressure]]]) -> Scales:
        """So that all of these have room."""
        return Scales(max((force.size for forces, _ in everything for force in forces), default=0.0),
                      max((float(np.max(pressure.size)) for _, pressures in everything for pressure in pressures), default=0.0))


def glyphs(forces: list[Force], pressures: list[Pressure], scales: Scales, size: float, stretch: float = 1.0) -> Glyphs:
    """`size`: of the picture along x; `stretch`: how many times larger y is drawn."""
    arrows, bands = [], []
    for force in forces:
        if force.size > 0.0 and scales.force > 0.0:
            length = size * max(ARROW * force.size / scales.force, SHORTEST)
            arrows.append(Arrow(force.place - length * across(force.force[None, :], stretch)[0], force.place, force.size))
    for pressure in pressures:
        values = pressure.size
        if scales.pressure <= 0.0 or np.max(values) <= NO_PRESSURE * scales.pressure:
            continue
        tops = pressure.place - (size * BAND * values / scales.pressure)[:, None] * across(pressure.force, stretch)
        # Of places that are about as high the one that is furthest from the arrows.
        high = np.flatnonzero(values >= ALIKE * np.max(values))
        tips = np.array([arrow.tip for arrow in arrows]).reshape(-1, 2)
        away = [np.min(np.hypot(*(tips - pressure.place[k]).T)) for k in high] if len(tips) else -np.abs(high - 0.5 * len(values))
        highest = int(high[int(np.argmax(away))])
        bands.append(Band(np.concatenate((pressure.place, tops[::-1])), tops[highest], pressure.place[highest],
                          float(values[highest])))
    return Glyphs(arrows, bands, size, stretch)


def with_value(tail: np.ndarray, tip: np.ndarray, size: float, stretch: float = 1.0) -> np.ndarray:
    """Both ends of an arrow, its value behind it included."""
    away = (tail - tip) * (1.0, stretch)
    away = away / (np.hypot(*away) or 1.0)
    return np.vstack((tail + size * (VALUE[0] + VALUE[1] * abs(away[0])) * away / (1.0, stretch), tip))


def across(vectors: np.ndarray, stretch: float) -> np.ndarray:
    """Vectors of length 1 in the picture, in data; what is normal to a surface stays so in a stretched picture."""
    picture = vectors / (1.0, stretch)
    length = np.hypot(*picture.T)
    return picture / np.where(length > 0.0, length, 1.0)[:, None] / (1.0, stretch)


def value_text(value: float) -> str:
    """As it stands beside an arrow."""
    return f"{value:.4g}".replace("-", "\N{MINUS SIGN}")

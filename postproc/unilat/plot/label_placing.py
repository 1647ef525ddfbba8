"""Writing labels beside marked points of a picture."""

from __future__ import annotations

import numpy as np

import matplotlib.patheffects as patheffects
from matplotlib.transforms import Bbox

from . import style

DISTANCES = (4.0, 9.0, 15.0, 22.0, 30.0, 40.0, 50.0, 60.0)      # [pt] tried between a label and its mark
DIRECTIONS = 16
HIDING = 2.5                                        # what a bit of a curve under a label costs, in points of distance
TOGETHER = 7.0                                      # [pt] marks with the same label closer than this share it
SAME = 1.0                                          # [pt] marks closer than this are seen as one, whatever their labels
TURNED = (45.0, -45.0, 90.0, -90.0, 120.0, -120.0)        # [degrees] about its point: where a label may be instead
FAR = 12.0                                          # [pt] from here on a thin line joins them


def place_labels(axes, texts: list[tuple]):
    """Write each (x, y, text, colour) beside its point, where it hides least of curves and other labels.

    A place that is nearer to the point of another label is bad, too.
    """
    figure = axes.figure
    style.lay_out(figure)
    if not hasattr(figure, "get_layout_engine"):
        figure.canvas.draw()
    renderer = figure.canvas.get_renderer()
    inside = axes.get_window_extent(renderer)
    curve = _curve_pixels(axes)
    taken = [axes.get_legend().get_window_extent(renderer)] if axes.get_legend() else []
    point = figure.dpi / 72.0
    frames = []
    texts = sorted(_merged(axes, list(dict.fromkeys(texts))), key=lambda text: -text[1])     # from the top downwards
    marks = axes.transData.transform(np.array([text[:2] for text in texts]).reshape(-1, 2))
    for x, y, text, colour in texts:
        at = axes.transData.transform((x, y))
        if not inside.contains(*at):
            continue
        note = axes.annotate(text, (x, y), xytext=(0, 0), textcoords="offset points", ha="center", va="center",
                             fontsize=8.5, color=colour, zorder=7, annotation_clip=False)
        note.set_path_effects([patheffects.withStroke(linewidth=1.8, foreground="white")])
        note.set_in_layout(False)
        box = note.get_window_extent(renderer)
        best = None
        for distance in DISTANCES:
            for angle in np.linspace(0.0, 2.0 * np.pi, DIRECTIONS, endpoint=False):
                away = np.array((np.cos(angle), np.sin(angle)))
                beside = np.clip(1.5 * away, -1.0, 1.0) * (0.5 * box.width, 0.5 * box.height)
                centre = at + distance * point * away + beside
                frame = np.array((centre - (box.width / 2 + point, box.height / 2 + point),
                                  centre + (box.width / 2 + point, box.height / 2 + point)))
                cost = _cost(frame, curve, taken + frames, inside) + 1.5 * distance
                cost += 100.0 * _misleading(frame, at, marks) + 1000.0 * _crossings(at, np.clip(at, *frame), frames)
                if best is None or cost < best[0]:
                    best = (cost, centre, frame)
        note.set_position((best[1] - at) / point)
        frames.append(Bbox(best[2]))
        near = np.clip(at, *best[2])
        if np.hypot(*(near - at)) > FAR * point:
            axes.annotate("", (x, y), xytext=(near - at) / point, textcoords="offset points", annotation_clip=False, zorder=5,
                          arrowprops={"arrowstyle": "-", "color": colour, "linewidth": 0.4, "shrinkA": 0.0, "shrinkB": 2.0}
                          ).set_in_layout(False)


def uncover(axes):
    """Moves labels that hide lines or other labels about their points, at the same distance, to where they hide less."""
    renderer = axes.figure.canvas.get_renderer()
    inside, curve, point = axes.get_window_extent(renderer), _curve_pixels(axes), axes.figure.dpi / 72.0
    notes = [note for note in axes.texts if note.get_text() and inside.contains(*axes.transData.transform(note.xy))]
    frames = [note.get_window_extent(renderer) for note in notes]
    for k, note in enumerate(notes):
        others = [frame for frame in frames if frame is not frames[k]]
        at, size = axes.transData.transform(note.xy), np.array((frames[k].width, frames[k].height))
        centre = frames[k].min + 0.5 * size
        distance = np.hypot(*np.maximum(np.maximum(frames[k].min - at, at - frames[k].max), 0.0))
        aways = np.arctan2(*(centre - at)[::-1]) + np.radians(TURNED)
        aways = np.column_stack((np.cos(aways), np.sin(aways)))
        places = [centre, *(at + distance * away + np.clip(1.5 * away, -1.0, 1.0) * 0.5 * size for away in aways)]
        costs = [_cost(np.array((place - 0.5 * size - point, place + 0.5 * size + point)), curve, others, inside) for place in places]
        best = int(np.argmin(costs))
        if best > 0:
            note.set(ha="center", va="center")
            note.xyann = (places[best] - at) / point
            frames[k] = note.get_window_extent(renderer)


def _merged(axes, texts: list[tuple]) -> list[tuple]:
    """The same label of marks that lie on each other is written once, with how many they are; different ones in one row."""
    found: list[list] = []
    for x, y, text, colour in texts:
        at = axes.transData.transform((x, y))
        for group in found:
            if group[2:4] == [text, colour] and np.hypot(*(at - group[4])) < TOGETHER * axes.figure.dpi / 72.0:
                group[5] += 1
                break
        else:
            found.append([x, y, text, colour, at, 1])
    rows: list[list] = []
    for x, y, text, colour, at, n in found:
        text = text if n == 1 else f"{text} ({n})"
        for row in rows:
            if row[3] == colour and np.hypot(*(at - row[4])) < SAME * axes.figure.dpi / 72.0:
                row[2] += f", {text}"
                break
        else:
            rows.append([x, y, text, colour, at])
    return [tuple(row[:4]) for row in rows]


def _curve_pixels(axes) -> np.ndarray:
    """Points about two pixels apart along all lines of the axes, in pixels, and half the width of the line there."""
    pixels = [np.zeros((0, 3))]
    for line in axes.get_lines():
        vertices = line.get_transform().transform(np.column_stack(line.get_data(orig=False)))
        vertices = vertices[np.all(np.isfinite(vertices), axis=1)]
        if len(vertices) < 2:
            points, wide = np.repeat(vertices, 60, axis=0), 0.0     # a marker: not to be covered
        elif line.get_linestyle() == "None":
            points, wide = np.repeat(vertices, 10, axis=0), 0.0
        else:
            lengths = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(vertices, axis=0).T))))
            along = np.linspace(0.0, lengths[-1], int(min(lengths[-1] / 2.0, 20000)) + 2)
            points = np.column_stack([np.interp(along, lengths, vertices[:, k]) for k in (0, 1)])
            wide = 0.5 * line.get_linewidth() * axes.figure.dpi / 72.0
        pixels.append(np.column_stack((points, np.full(len(points), wide))))
    return np.concatenate(pixels)


def _cost(frame: np.ndarray, curve: np.ndarray, taken: list, inside) -> float:
    (left, bottom), (right, top) = frame
    x, y, wide = curve.T
    hidden = np.sum((x + wide > left) & (x - wide < right) & (y + wide > bottom) & (y - wide < top))
    overlaps = sum(left < other.x1 and right > other.x0 and bottom < other.y1 and top > other.y0 for other in taken)
    rim = 0.01 * inside.width
    outside = (left < inside.x0 + rim or right > inside.x1 - rim
               or bottom < inside.y0 + rim or top > inside.y1 - rim)
    return HIDING * float(hidden) + 5000.0 * overlaps + 8000.0 * outside


def _misleading(frame: np.ndarray, at: np.ndarray, marks: np.ndarray) -> bool:
    """Whether a mark at another place than `at` is as near to the frame, or further by less than its height."""
    own, *others = np.hypot(*np.maximum(np.maximum(frame[0] - (at, *marks), (at, *marks) - frame[1]), 0.0).T)
    elsewhere = np.any(np.abs(marks - at) > 1.0, axis=1)
    return bool(np.any(np.array(others)[elsewhere] <= own + (frame[1, 1] - frame[0, 1])))


def _crossings(start: np.ndarray, end: np.ndarray, frames: list) -> int:
    """How many frames the line between two points crosses."""
    line = start + np.linspace(0.0, 1.0, 30)[:, None] * (end - start)
    return sum(bool(np.any(np.all((line >= frame.min) & (line <= frame.max), axis=1))) for frame in frames)

"""What Python prints of result objects, and what notebooks show: a few lines instead of arrays."""

from __future__ import annotations

import html

import numpy as np

SHOWN = 12      # rows of a table


def short(value: float) -> str:
    return f"{value:.6g}" if np.isfinite(value) else str(value)


def path_words(path) -> str:
    """One line about a path."""
    kind = type(path).__name__
    what = f"{path.n_points} points"
    if path.n_points and "load_factor" in path.path:
        load = path.path["load_factor"].values
        what += f", load factor {short(float(load.min()))} to {short(float(load.max()))}"
    labels = [critical.label for critical in path.critical if critical.label != "EP"]
    found = ", ".join(f"{labels.count(label)} {label}" for label in dict.fromkeys(labels))
    more = "".join((f", {found}" if found else "", f", monitors {', '.join(path.monitors)}" if path.monitors else ""))
    name = f"'{path.title}'" if kind == "Results" else f"{path.number} '{path.name}'" if kind == "Branch" else ""
    status = f", {path.status}" if kind == "Results" else ""
    return f"<{kind} {name}: {what}{more}{status}>"


def path_table(path) -> str:
    """HTML: what the file is, and its critical points."""
    results = type(path).__name__ == "Results"
    title = path.title if results else f"branch {path.number}: {path.name}"
    rows = [f"<b>{html.escape(title or path.filename)}</b>"]
    if results:
        rows.append(html.escape(f"{path.program} {path.version}, {path.status}"))
    rows.append(html.escape(path_words(path).strip("<>").split(": ", 1)[-1]))
    parts = ["<br>".join(rows)]
    if path.critical:
        names = ["label", "step", "point", "load factor", *(["error bar"] if path.errors else []), *path.monitors, "note"]
        body = []
        for critical in path.critical[:SHOWN]:
            cells = [critical.label, str(critical.step), str(critical.point), f"{critical.load_factor:.10g}"]
            cells += [f"± {critical.error:.2g}" if np.isfinite(critical.error) else ""] if path.errors else []
            cells += [short(critical.monitors.get(name, np.nan)) for name in path.monitors] + [critical.note]
            body.append("<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in cells) + "</tr>")
        more = f"<p>and {len(path.critical) - SHOWN} more: .critical</p>" if len(path.critical) > SHOWN else ""
        parts.append("<table><thead><tr>" + "".join(f"<th>{html.escape(name)}</th>" for name in names) + f"</tr></thead><tbody>{''.join(body)}"
                     f"</tbody></table>{more}")
    return "".join(parts)


def values_words(name: str, value) -> str:
    """One member of an object."""
    if isinstance(value, np.ndarray):
        return f"{name} {value.dtype} {value.shape}"
    if isinstance(value, dict):
        return f"{name} {{{', '.join(map(str, value))}}}"
    return f"{name}={value!r}"


def brief(self) -> str:
    """A dataclass with shapes of arrays instead of their numbers."""
    members = ", ".join(values_words(name, getattr(self, name)) for name in self.__dataclass_fields__ if getattr(self, name) is not None)
    return f"<{type(self).__name__}: {members}>"


def column_words(column) -> str:
    values = column.values
    span = ""
    if values.size and values.dtype.kind in "biuf" and np.any(np.isfinite(values)):
        span = f", {short(float(np.nanmin(values)))} to {short(float(np.nanmax(values)))}"
    units = "" if column.units in ("", "1") else f" ({column.units})"
    return f"<Column {column.name}{units}: {len(values)} values{span}>"

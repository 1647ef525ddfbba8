"""Result files keep all their numbers: what points to other files is not followed, since these are whoever's."""

from __future__ import annotations

import h5py

from .file import ResultsError


def refuse_foreign(file: h5py.File, filename: str):
    """ResultsError where an HDF5 file has a link to another file, or a dataset whose numbers are in other files.

    Looks at every object of the file, and so by HDF5's own numbers for them: objects of h5py would take twice as long to make.
    """
    seen, waiting = set(), [h5py.h5g.open(file.id, b"/")]
    while waiting:
        group = waiting.pop()
        place = h5py.h5o.get_info(group).addr
        if place in seen:
            continue
        seen.add(place)
        for name in group:
            try:
                kind = group.links.get_info(name).type
                item = h5py.h5o.open(group, name) if kind == h5py.h5l.TYPE_HARD else None
                elsewhere = isinstance(item, h5py.h5d.DatasetID) and numbers_elsewhere(item)
            except (OSError, RuntimeError, KeyError, ValueError):
                continue        # being written, or damaged; who reads it will find out
            if kind == h5py.h5l.TYPE_EXTERNAL or elsewhere:
                own_item(h5py.Group(group), name.decode("utf-8", "surrogateescape"), filename)      # says what
            if isinstance(item, h5py.h5g.GroupID):
                waiting.append(item)


def numbers_elsewhere(item: h5py.h5d.DatasetID) -> bool:
    """True for a dataset whose numbers are in another file."""
    made = item.get_create_plist()
    return made.get_external_count() > 0 or made.get_layout() == h5py.h5d.VIRTUAL


def own_item(group: h5py.Group, name: str, filename: str) -> h5py.Group | h5py.Dataset | None:
    """A member of a group. None: not there, being written, or damaged; who reads it will find out."""
    try:
        kind = group.id.links.get_info(name.encode("utf-8", "surrogateescape")).type
        if kind == h5py.h5l.TYPE_EXTERNAL:
            raise ResultsError(f"{filename}: {_path(group, name)} is a link to another file, {group.get(name, getlink=True).filename}; "
                               "no such link is followed")
        item = group[name] if kind == h5py.h5l.TYPE_HARD else None
    except (OSError, RuntimeError, KeyError, ValueError):
        return None
    if isinstance(item, h5py.Dataset) and numbers_elsewhere(item.id):
        raise ResultsError(f"{filename}: the numbers of {_path(group, name)} are in another file; none is read")
    return item


def _path(group: h5py.Group, name: str) -> str:
    return f"{group.name.rstrip('/')}/{name}"

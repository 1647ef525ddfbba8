"""Result files keep all their numbers: what points to other files is not followed, since these are whoever's."""

from __future__ import annotations

import h5py

from .file import ResultsError


def refuse_foreign(file: h5py.File, filename: str):
    """ResultsError where an HDF5 file has a link to another file, or a dataset whose numbers are in other files."""
    seen, waiting = set(), [file["/"]]
    while waiting:
        group = waiting.pop()
        place = h5py.h5o.get_info(group.id).addr
        if place in seen:
            continue
        seen.add(place)
        for name in group:
            item = own_item(group, name, filename)
            if isinstance(item, h5py.Group):
                waiting.append(item)


def own_item(group: h5py.Group, name: str, filename: str) -> h5py.Group | h5py.Dataset | None:
    """A member of a group. None: not there, being written, or damaged; who reads it will find out."""
    path = f"{group.name.rstrip('/')}/{name}"
    try:
        link = group.get(name, getlink=True)
        if isinstance(link, h5py.ExternalLink):
            raise ResultsError(f"{filename}: {path} is a link to another file, {link.filename}; no such link is followed")
        item = group[name] if isinstance(link, h5py.HardLink) else None
    except (OSError, RuntimeError, KeyError, ValueError):
        return None
    if isinstance(item, h5py.Dataset) and (item.external or item.is_virtual):
        raise ResultsError(f"{filename}: the numbers of {path} are in another file; none is read")
    return item

"""Runs of OpenSees beside those of unilat: the same decks, the same records."""

from __future__ import annotations

import hashlib
import importlib.metadata
import importlib.util
import os
import sys

from ..sweep.run_folder import RunFolder

SETTINGS = ("control", "increment", "penalty")         # of a curve with program = "opensees": options of unilat.opensees


def is_there() -> bool:
    """True when openseespy is installed."""
    return importlib.util.find_spec("openseespy") is not None


class PeerFolder(RunFolder):
    """The folder of a study, where OpenSees is the program."""

    def __init__(self, folder: RunFolder, settings: dict):
        self.folder, self.runs, self.processes = folder.folder, folder.runs, folder.processes
        options = [word for name in SETTINGS if name in settings for word in (f"--{name}", str(settings[name]))]
        self.command = [sys.executable, "-m", "unilat.opensees", *options]
        told = hashlib.sha256("\n".join((importlib.metadata.version("openseespy"), *options)).encode())
        own = os.path.dirname(importlib.util.find_spec("unilat.opensees").origin)
        for name in sorted(os.listdir(own)):
            if name.endswith(".py"):
                with open(os.path.join(own, name), "rb") as file:
                    told.update(file.read())
        self.program_hash = told.hexdigest()

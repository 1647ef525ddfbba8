"""The runs behind the paper's tables and figures: example decks with a few words changed."""

from __future__ import annotations

import os
import subprocess
from concurrent.futures import ThreadPoolExecutor

from ..results import Results, ResultsError, read_results

LOADS = "LOAD, 34., 57., 62., 28."
FULL_OUTPUT = ("*FIELD OUTPUT, EVERY=5", "*FIELD OUTPUT")
MEDIUM = (("MODULUS=1E8", "MODULUS={k}"), ("*STOP\n", f"*LOCATE\n{LOADS}\n*STOP\n"))
COARSER = (("TOLERANCE=1E-6", "TOLERANCE=1E-4"),)
MODULI = ("1E3", "1E4", "1E5", "1E6", "3.6E6", "1E7", "1E8")
PAPERS_MODULUS = "3.6E6"

# Name of the run: deck, changes (old, new) of its cards.
RUNS: dict[str, tuple[str, tuple]] = {
    "ring": ("ring", ()),
    "ring-coarse": ("ring", COARSER),
    "ring-ul2": ("ring-ul2", ()),
    "ring-ul2-coarse": ("ring-ul2", (("1, 2, 0., 0., 320", "1, 2, 0., 0., 160"),)),
    **{f"medium-{k}": ("ring-stiffness", tuple((old, new.format(k=k)) for old, new in MEDIUM)) for k in MODULI},
    "medium-coarse": ("ring-stiffness", tuple((old, new.format(k=PAPERS_MODULUS)) for old, new in MEDIUM) + COARSER),
    "column": ("column", (FULL_OUTPUT,)),
    "column-coarse": ("column", COARSER),
}


class Runs:
    """Makes the runs, and reads their results."""

    def __init__(self, root: str, program: str, folder: str):
        self.root, self.program, self.folder = root, program, folder
        os.makedirs(folder, exist_ok=True)
        self._read: dict[str, Results] = {}

    def __getitem__(self, name: str) -> Results:
        if name not in self._read:
            self._read[name] = read_results(self._file(name, "h5"))
        return self._read[name]

    def make(self, jobs: int):
        """All runs anew, `jobs` at a time."""
        decks = {name: changed_deck(os.path.join(self.root, "input", f"{deck}.inp"), changes)
                 for name, (deck, changes) in RUNS.items()}
        with ThreadPoolExecutor(jobs) as pool:
            list(pool.map(lambda item: self._run(*item), decks.items()))

    def _run(self, name: str, deck: str):
        with open(self._file(name, "inp"), "w", encoding="utf-8") as file:
            file.write(deck)
        done = subprocess.run([self.program, "-o", self._file(name, "h5")], input=deck, capture_output=True, text=True,
                              env={**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}, check=False)
        if done.returncode:
            why = (done.stderr or done.stdout).strip()[-500:]
            raise ResultsError(f"{self._file(name, 'inp')}: exit code {done.returncode}: {why}")

    def _file(self, name: str, ending: str) -> str:
        return os.path.join(self.folder, f"{name}.{ending}")


def changed_deck(filename: str, changes) -> str:
    """The deck with each old text, which must stand once in its cards, replaced; without comments."""
    try:
        with open(filename, encoding="utf-8") as file:
            text = "".join(line for line in file if not line.startswith("**"))
    except OSError as problem:
        raise ResultsError(f"{filename}: cannot be read: {problem.strerror}") from problem
    for old, new in changes:
        if text.count(old) != 1:
            raise ResultsError(f"{filename}: '{old.strip()}' stands {text.count(old)} times in its cards, not once")
        text = text.replace(old, new)
    return text

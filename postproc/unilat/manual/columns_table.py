"""The table of the manual with the columns of the growing tables of a result file: names, units and words are those in the file."""

from __future__ import annotations

import pathlib
import re
import subprocess
import tempfile

import h5py

BEGIN = "<!-- Written by `input/run manual --pages` from result files. Changes of this table do not last. -->\n"
END = "<!-- The end of that table. -->\n"
DECKS = ("ring", "cantilever", "winkler-weight", "indenter", "ring-critical")      # together they have every column
TABLES = ("path", "critical", "contact", "fields", "contact_force", "contact_pressure", "limit_curve")
MONITORS = {"monitor": "value", "monitor_rate": "d(value)/d(arc length)", "monitor_error": "error bar", "monitor_corrected": "value less its estimated error"}
ONCE = ("candidates", "candidate_contact", "arc_length", "obstacle", "points", "chain_length")      # of /contact, which do not grow


def with_columns(page: str, program: str, input_folder: pathlib.Path) -> str:
    """The page with the table between its two comments written anew; KeyError when the page lacks them."""
    before, begin, rest = page.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not (begin and end):
        raise KeyError("the page has no place for the table of columns")
    return before + BEGIN + "\n" + columns_table(program, input_folder) + "\n" + END + after


def columns_table(program: str, input_folder: pathlib.Path) -> str:
    """One row a column. What depends on the deck, the units of monitors and of parameters, is left open."""
    columns: dict[str, dict[str, tuple[str, str]]] = {table: {} for table in TABLES}
    with tempfile.TemporaryDirectory(prefix="unilat-") as folder:
        for deck in DECKS:
            results = pathlib.Path(folder) / f"{deck}.h5"
            subprocess.run([program, "--model", str(input_folder / f"{deck}.inp"), "-o", str(results)], check=True, capture_output=True)
            with h5py.File(results) as file:
                for table in TABLES:
                    for name, units, words in _columns(file, table):
                        columns[table].setdefault(name, (units, words))
    rows = "".join(f"| {f'`/{table}`' if row == 0 else ''} | `{name}` | {units} | {words} |\n"
                   for table in TABLES for row, (name, (units, words)) in enumerate(columns[table].items())).replace("`/limit_curve`", "`/limit_curve/<name>`")
    return f"| table | column | unit | what |\n|---|---|---|---|\n{rows}"


def _columns(file: h5py.File, table: str):
    """Name, units and words of each column of a table that the file has."""
    for group in [file[table]] if table in file else []:
        for part in group.values() if table == "limit_curve" else [group]:
            for name, item in sorted(part.items(), key=lambda each: isinstance(each[1], h5py.Group)):     # datasets first, in their order
                if isinstance(item, h5py.Group):
                    if len(item) and name in MONITORS:
                        yield f"{name}/<name>", "its own", f"{MONITORS[name]} of each monitor"
                elif table != "contact" or name not in ONCE:
                    units = "its own" if (table, name) == ("limit_curve", "parameter") else re.sub("^1$", "", item.attrs["units"])
                    yield name, units, re.sub("[<|]", r"\\\g<0>", item.attrs["description"])

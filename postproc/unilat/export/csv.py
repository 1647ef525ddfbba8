"""Tables of a result file as text."""

from __future__ import annotations

import csv
import os
import sys

from ..chosen_points import branch_number
from ..options import Parser, tell_unfinished
from ..plain_text import cell, printable
from ..results import Column, Results, ResultsError, read_results
from ..tables import TABLES, table

DESCRIPTION = """\
Write a table of a result file as CSV: lines with # that tell where it comes from and the units, a line of names, a row a point
(or as the table has them). Numbers have all their digits. Tables: path (default), critical, contact (a row a region of
contact at a point), displacement, forces (section forces), candidates (reactions and gaps), modes, curves (limit curves)."""

EXAMPLES = """\
examples:
  unilat-plot csv ring.h5                          writes ring-path.csv
  unilat-plot csv ring.h5 --table critical -o -    to the terminal
  unilat-plot csv arch.h5 --branch 2
"""


def main(argv=None) -> int:
    parser = Parser("unilat-plot csv", DESCRIPTION, EXAMPLES)
    parser.add_argument("file", metavar="RESULTS", help="result file of unilat (HDF5)")
    parser.add_argument("--table", choices=tuple(TABLES), default="path", help="which one (default path)")
    parser.add_argument("--branch", type=branch_number, default=0, metavar="K", help="of branch K instead of the path of the steps")
    parser.add_argument("-o", "--output", metavar="FILE", help="- is the terminal (default: named after the result file)")
    args = parser.parse_args(argv)
    results = read_results(args.file)
    columns = table(results, args.table, args.branch)
    stem = os.path.splitext(os.path.basename(args.file))[0]
    output = args.output or f"{stem}-{args.table}{f'-branch-{args.branch}' if args.branch else ''}.csv"
    if output == "-":
        write(sys.stdout, results, args.table, columns)
        return 0
    try:
        with open(output, "w", newline="", encoding="utf-8") as file:
            write(file, results, args.table, columns)
    except OSError as problem:
        raise ResultsError(f"{output}: cannot be written: {problem.strerror or problem}") from problem
    print(f"wrote {output} ({len(columns[0].values)} rows)")
    tell_unfinished([results])
    return 0


def write(file, results: Results, name: str, columns: list[Column]):
    """The table with its head."""
    file.write(f"# {printable(' '.join(results.title.split()))}\n")
    origin = (f"table {name} of {os.path.basename(results.filename)}, {results.program} {results.version}, {results.created}, "
              f"status: {results.status}")
    file.write(f"# {printable(origin)}\n")
    units = ", ".join(f"{column.name}: {column.units}" for column in columns if column.units not in ("", "1"))
    if units:
        file.write(f"# units: {printable(units)}\n")
    rows = csv.writer(file, lineterminator="\n")
    rows.writerow(cell(column.name) for column in columns)
    values = [column.values.tolist() for column in columns]                   # floats as repr: all digits
    rows.writerows(zip(*([cell(value) for value in each] if column.values.dtype.kind in "USO" else each
                         for column, each in zip(columns, values))))

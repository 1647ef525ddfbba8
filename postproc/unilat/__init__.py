"""Reading, drawing and exporting the results of unilat.

    from unilat import read_results, to_pandas, to_xarray

    ring = read_results("ring.h5")          # numpy arrays, see unilat.results.reader
    frame = to_pandas(ring, "path")         # a pandas.DataFrame, when pandas is installed
    data = to_xarray(ring)                  # an xarray.Dataset, when xarray is installed

The commands are unilat-plot (or python3 -m unilat) and unilat-sweep (or python3 -m unilat.sweep).
"""

import importlib

_WHERE = {"read_results": "results", "ResultsError": "results", "to_pandas": "tables", "to_xarray": "tables"}
__all__ = list(_WHERE)


def __getattr__(name: str):
    """Imported when asked for, so that the commands can say which package is missing."""
    if name not in _WHERE:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    return getattr(importlib.import_module(f".{_WHERE[name]}", __name__), name)

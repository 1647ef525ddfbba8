"""Result files of unilat as Python objects."""

from .file import ResultsError
from .reader import read_results
from .types import Branch, Buckling, Column, Contact, Critical, LimitCurve, Mesh, Obstacle, Path, Region, Results
from .units import Units

__all__ = ["Branch", "Buckling", "Column", "Contact", "Critical", "LimitCurve", "Mesh", "Obstacle", "Path", "Region",
           "Results", "ResultsError", "Units", "read_results"]

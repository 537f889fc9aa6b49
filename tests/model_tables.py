"""The tables of the main model, by the names that tests use."""

from nsdrill.models.registry import IN_TRACE, described
from nsdrill.variables import MODEL

_told = described(MODEL)
VARIABLES = _told.variables
TRACE_VARIABLES = tuple(variable for variable in _told.trace if variable.only is None)
# Those that every results file has.
FEATURES = tuple(v.name for v in VARIABLES if v.origin == "feature" and v.only is None)
LABELS = tuple(v.name for v in VARIABLES if v.origin == "label" and v.only is None)
PEAKS = tuple(v.name for v in VARIABLES if v.origin == "peaks")
SECTION = tuple(v.name for v in VARIABLES if v.origin == "section")
STATE_UNITS = {name: IN_TRACE[name].units for name in _told.all_states}

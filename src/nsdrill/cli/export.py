"""nsdrill export."""

from __future__ import annotations

import csv
import os
import sys
from pathlib import Path
from typing import Annotated

from nsdrill.cli.building import Given, command_of, say, write
from nsdrill.errors import InputError
from nsdrill.late import deferred
from nsdrill.operations.arguments import Overwrite, ResultsLike, Stream, Switch, UnitsOfTable

with deferred():
    from nsdrill import store
    from nsdrill.app import datasets
    from nsdrill.app import table as tables
    from nsdrill.text import branches

SI_ONLY = " netCDF stays in SI units, which its attributes name."


@command_of(
    examples=(
        "export out.h5 -o out.csv --peaks",
        "export out.h5 -o out.csv --units field",
        "export out.h5 -o - | head",
        "export out.h5 -o out.nc",
    )
)
def command(
    given: Given,
    results: ResultsLike,
    output: Annotated[Stream, "File to write: .csv or .nc (netCDF-4); - is CSV to standard output."],
    peaks: Annotated[Switch, "CSV: with a column for every recorded peak."] = False,
    section: Annotated[Switch, "CSV: with a column for every recorded return to the Poincare section."] = False,
    states: Annotated[Switch, "CSV: with a column for every initial and final state."] = False,
    units: UnitsOfTable = "si",
    overwrite: Overwrite = False,
) -> int:
    """Write RESULTS as a table (CSV, units in the headings) or as netCDF (everything,
    in SI units).

    The table has one row for each point, of a trace one for each sample.
    """
    assert output is not None
    suffix = ".csv" if output == "-" else Path(output).suffix.lower()
    if suffix not in (".csv", ".nc"):
        raise InputError(f"{output}: found the ending {suffix or '(none)'}; allowed: .csv or .nc.")
    csv_options = [option for option, on in (("--peaks", peaks), ("--section", section), ("--states", states)) if on]
    if suffix == ".nc" and csv_options:
        raise InputError(f"{csv_options[0]}: found with netCDF, which holds everything; allowed: with .csv.")
    found = "branches" if datasets.is_branches(results) else ""
    if not found and os.path.lexists(results) and store.kind_of(results) == "trace":
        found = "a trace"
    if csv_options and found:
        raise InputError(f"{csv_options[0]}: found with {found}, whose table has everything; allowed: with results.")
    if output != "-":
        store.claim_file(output, overwrite)
    if suffix == ".nc":
        store.to_netcdf(results, output, overwrite=overwrite)
    elif found == "branches":
        write(output, branches.table(store.open_branches(results), units), overwrite)
    else:
        data = store.read_trace(results) if found else store.read_results(results)
        rows = tables.table(data, units, peaks=peaks, section=section, states=states)
        if output == "-":
            csv.writer(sys.stdout).writerows(rows)
        else:
            tables.write_rows(rows, output, overwrite)
    if output != "-":
        note = SI_ONLY if suffix == ".nc" and units == "field" else ""
        say(f"{output}: written.{note}")
    return 0

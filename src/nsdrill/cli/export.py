"""nsdrill export."""

from __future__ import annotations

import csv
import os
import sys
from pathlib import Path

import click

from nsdrill.cli import options
from nsdrill.errors import InputError

SI_ONLY = " netCDF stays in SI units, which its attributes name."


@click.command(
    "export",
    epilog=options.examples(
        "export out.h5 -o out.csv --peaks",
        "export out.h5 -o out.csv --units field",
        "export out.h5 -o - | head",
        "export out.h5 -o out.nc",
    ),
)
@options.file_argument("results")
@options.output("File to write: .csv or .nc (netCDF-4); - is CSV to standard output.", stream=True)
@click.option("--peaks", is_flag=True, help="CSV: with a column for every recorded peak.")
@click.option("--section", is_flag=True, help="CSV: with a column for every recorded return to the Poincare section.")
@click.option("--states", is_flag=True, help="CSV: with a column for every initial and final state.")
@options.units_of_table
@options.overwrite
def command(results: str, output: str, peaks: bool, section: bool, states: bool, units: str, overwrite: bool) -> int:
    """Write RESULTS as a table (CSV, units in the headings) or as netCDF (everything,
    in SI units).

    The table has one row for each point, of a trace one for each sample.
    """
    suffix = ".csv" if output == "-" else Path(output).suffix.lower()
    if suffix not in (".csv", ".nc"):
        raise InputError(f"{output}: found the ending {suffix or '(none)'}; allowed: .csv or .nc.")
    csv_options = [option for option, on in (("--peaks", peaks), ("--section", section), ("--states", states)) if on]
    if suffix == ".nc" and csv_options:
        raise InputError(f"{csv_options[0]}: found with netCDF, which holds everything; allowed: with .csv.")
    from nsdrill.app.reading import is_branches
    from nsdrill.app.table import table, write_rows
    from nsdrill.store import claim_file, kind_of, read_results, read_trace, to_netcdf

    found = "branches" if is_branches(results) else ""
    if not found and os.path.lexists(results) and kind_of(results) == "trace":
        found = "a trace"
    if csv_options and found:
        raise InputError(f"{csv_options[0]}: found with {found}, whose table has everything; allowed: with results.")
    if output != "-":
        options.check_not_input(results, output)
        claim_file(output, overwrite)
    if suffix == ".nc":
        to_netcdf(results, output, overwrite=overwrite)
    elif found == "branches":
        from nsdrill.cli.branches import table as text_of
        from nsdrill.store import open_branches

        options.write(output, text_of(open_branches(results), units), overwrite)
    else:
        data = read_trace(results) if found else read_results(results)
        rows = table(data, units, peaks=peaks, section=section, states=states)
        if output == "-":
            csv.writer(sys.stdout).writerows(rows)
        else:
            write_rows(rows, output, overwrite)
    if output != "-":
        note = SI_ONLY if suffix == ".nc" and units == "field" else ""
        click.echo(f"{output}: written.{note}", err=True)
    return 0

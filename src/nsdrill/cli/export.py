"""nsdrill export."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
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
@click.option("--peaks", is_flag=True, help="CSV: a column for every recorded peak.")
@click.option(
    "--section",
    is_flag=True,
    help="CSV: a column for every recorded return to the Poincare section.",
)
@click.option("--states", is_flag=True, help="CSV: a column for every initial and final state.")
@options.units
@options.overwrite
def command(
    results: str, output: str, peaks: bool, section: bool, states: bool, units: str, overwrite: bool
) -> int:
    """Write RESULTS as a table (CSV, units in the headings) or as netCDF (everything,
    in SI units).

    The table has one row a point; of a trace, as simulate and replay write it, one row
    a sample.
    """
    suffix = ".csv" if output == "-" else Path(output).suffix.lower()
    if suffix not in (".csv", ".nc"):
        raise InputError(f"{output}: found the ending {suffix or '(none)'}; allowed: .csv or .nc.")
    csv_options = [
        option
        for option, on in (("--peaks", peaks), ("--section", section), ("--states", states))
        if on
    ]
    if suffix == ".nc" and csv_options:
        raise InputError(
            f"{csv_options[0]}: found with netCDF, which holds everything; allowed: with .csv."
        )
    from nsdrill.app.reading import is_branches
    from nsdrill.app.table import print_csv, write_csv
    from nsdrill.store import kind_of, read_results

    if is_branches(results):
        if csv_options:
            raise InputError(
                f"{csv_options[0]}: found with branches, whose table has everything; "
                f"allowed: with results."
            )
        return _export_branches(results, output, suffix, units, overwrite)
    if os.path.lexists(results) and kind_of(results) == "trace":
        if csv_options:
            raise InputError(
                f"{csv_options[0]}: found with a trace, whose table has everything; "
                f"allowed: with results."
            )
        return _export_trace(results, output, suffix, units, overwrite)
    if output == "-":
        print_csv(
            read_results(results),
            sys.stdout,
            peaks=peaks,
            section=section,
            states=states,
            units=units,
        )
        return 0
    return _write_file(
        results,
        output,
        suffix,
        units,
        overwrite,
        lambda: write_csv(
            read_results(results),
            output,
            peaks=peaks,
            section=section,
            states=states,
            units=units,
            overwrite=overwrite,
        ),
    )


def _write_file(
    file: str, output: str, suffix: str, units: str, overwrite: bool, table: Callable[[], None]
) -> int:
    """Write ``file`` as netCDF, or call ``table``, depending on ``suffix``."""
    from nsdrill.store import claim_file, to_netcdf

    options.check_not_input(file, output)
    claim_file(output, overwrite)
    if suffix == ".nc":
        to_netcdf(file, output, overwrite=overwrite)
    else:
        table()
    click.echo(
        f"{output}: written.{SI_ONLY if suffix == '.nc' and units == 'field' else ''}", err=True
    )
    return 0


def _export_trace(file: str, output: str, suffix: str, units: str, overwrite: bool) -> int:
    """Export a trace."""
    from nsdrill.app.table import print_trace_csv, write_trace_csv
    from nsdrill.store import read_trace

    if output == "-":
        print_trace_csv(read_trace(file), sys.stdout, units=units)
        return 0
    return _write_file(
        file,
        output,
        suffix,
        units,
        overwrite,
        lambda: write_trace_csv(read_trace(file), output, units=units, overwrite=overwrite),
    )


def _export_branches(file: str, output: str, suffix: str, units: str, overwrite: bool) -> int:
    """Export a file of branches."""
    from nsdrill.cli.branches import table
    from nsdrill.store import open_branches, write_text

    data = open_branches(file)
    if output == "-":
        click.echo(table(data, units), nl=False)
        return 0
    return _write_file(
        file,
        output,
        suffix,
        units,
        overwrite,
        lambda: write_text(output, table(data, units), overwrite=overwrite),
    )

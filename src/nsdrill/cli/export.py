"""nsdrill export."""

from __future__ import annotations

from pathlib import Path

import click

from nsdrill.cli import options
from nsdrill.errors import InputError


@click.command("export")
@click.argument("results", type=click.Path())
@options.output("File to write: .csv or .nc (netCDF-4).")
@click.option("--peaks", is_flag=True, help="CSV: a column for every recorded peak.")
@click.option("--states", is_flag=True, help="CSV: a column for every initial and final state.")
@options.overwrite
def command(results: str, output: str, peaks: bool, states: bool, overwrite: bool) -> int:
    """Write RESULTS as a table (CSV) or as netCDF."""
    from nsdrill.store import claim_file, read_results, to_csv, to_netcdf

    suffix = Path(output).suffix.lower()
    if suffix not in (".csv", ".nc"):
        raise InputError(f"{output}: found the ending {suffix or '(none)'}; allowed: .csv or .nc.")
    claim_file(output, overwrite)
    if suffix == ".csv":
        to_csv(read_results(results), output, peaks=peaks, states=states)
    else:
        to_netcdf(results, output)
    click.echo(f"{output}: written.", err=True)
    return 0

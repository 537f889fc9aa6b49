"""The commands of the group Files."""

from __future__ import annotations

import csv
import os
import shlex
import sys
from pathlib import Path
from typing import Annotated

import click

from nsdrill.cli.building import Given, command_of, model_name, print_answer, say, write
from nsdrill.errors import InputError, count, printable
from nsdrill.late import deferred
from nsdrill.operations import questions, result_files, runs
from nsdrill.operations.arguments import (
    HDF5Path,
    Json,
    Model,
    Overwrite,
    ResultsLike,
    Stream,
    Switch,
    Units,
    UnitsOfTable,
)

with deferred():
    from nsdrill import data, store, study, variables
    from nsdrill.app import datasets, saving
    from nsdrill.text import diff as text
    from nsdrill.text import words


@command_of(
    questions.diff,
    examples=(
        "diff ideal.h5 soft_torque.h5 --units field",
        "diff a.h5 b.h5 --bits",
        "diff a.h5 b.h5 --json | jq .study",
        "diff --exit-code before.h5 after.h5 && echo reproduced",
    ),
)
def diff(
    given: Given,
    bits: Annotated[Switch, "Print which numbers differ, to the bit, and the versions and machines."] = False,
    json: Annotated[Json, "Print JSON, with --bits included."] = False,
    units: Units = None,
    exit_code: Annotated[Switch, "Exit with 1 if the studies or any numbers differ."] = False,
) -> int:
    """Compare the files A and B: results, .part files of runs that go
    on, traces or branches.

    First the keys of the studies, and what changed for the driller: the safe points,
    the borders of the window, the responses; then whether the numbers are the same.
    With --bits also versions and machines, and every variable that differs, to the bit.
    With --exit-code the exit code is 1 where anything differs but titles, times,
    versions and machines; without it 0.
    """
    assert units is not None
    differences = questions.diff(**given)
    differences["run"] = [
        {**row, **{side: text.attribute_text(row["name"], row[side], units) for side in ("a", "b")}}
        for row in differences["run"]
    ]
    print_answer(differences, map(printable, text.lines(differences, units, bits)), units, json)
    return int(exit_code and not (differences["same_study"] and differences["same_numbers"]))


@command_of(
    result_files.combine,
    examples=("combine soft.h5 medium.h5 hard.h5 -o rock.h5", "combine 1000m.h5 2000m.h5 -o depths.h5"),
)
def combine(given: Given, path: HDF5Path) -> int:
    """Join RESULTS whose studies differ in one number into one file, in which it is an
    axis.

    The file is the one that a sweep of that axis would have made, to the bit; nothing
    is run again. The files may also have other values of an axis that they all sweep.
    """
    combined, key = result_files.combine(**given)
    values = len(combined.coords[variables.dimension_of(key)])
    say(
        f"{path}: {count(len(given['results']), 'file')} along the {words.label_of(key)} ({key}), "
        f"{count(values, 'value')}; {count(combined.variables['status'].size, 'point')}."
    )
    return 0


SI_ONLY = " netCDF stays in SI units, which its attributes name."


@command_of(
    examples=(
        "export out.h5 -o out.csv --peaks",
        "export out.h5 -o out.csv --units field",
        "export out.h5 -o - | head",
        "export out.h5 -o out.nc",
    )
)
def export(
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
        write(output, saving.branches_table(store.open_branches(results), units), overwrite)
    else:
        data = store.read_trace(results) if found else store.read_results(results)
        rows = saving.table(data, units, peaks=peaks, section=section, states=states)
        if output == "-":
            csv.writer(sys.stdout).writerows(rows)
        else:
            saving.write_rows(rows, output, overwrite)
    if output != "-":
        note = SI_ONLY if suffix == ".nc" and units == "field" else ""
        say(f"{output}: written.{note}")
    return 0


@command_of(
    runs.classify,
    examples=(
        "classify out.h5 --set classify.whirl.wall_contact_fraction=0.05 -o relabelled.h5",
        "classify out.h5 --set classify.whirl.wall_contact_fraction=0.05",
        "classify out.h5",
    ),
)
def classify(given: Given, path: Annotated[HDF5Path, "Results file to write. Default: RESULTS itself."] = None) -> int:
    """Give RESULTS new labels with other thresholds, in place or as a new file. Nothing
    is run again.

    Without --set the thresholds of the study are restored. All keys of `classify` may
    change but stuck_below, which enters the run itself. The attribute `history` of the
    file records the change.
    """
    for name, (changed, total) in runs.classify(**given).changes.items():
        say(f"{name}: {changed} of {count(total, 'point')} changed.")
    if path is not None:
        say(f"{path}: written.")
    else:
        results = os.fspath(given["results"])
        back = f"nsdrill classify {shlex.quote(results)} gives those of the study again"
        say(f"{results}: relabelled in place; no feature changes, and {back}.")
    return 0


@command_of(result_files.cite, examples=("cite", "cite out.h5", "cite out.h5 --bibtex >> references.bib"))
def cite(given: Given) -> int:
    """Print what to cite: nsdrill; with FILE the version and the study that made it, and
    the works behind its model."""
    click.echo(result_files.cite(**given))
    return 0


@command_of(examples=("schema -o study.schema.json", "schema | less"))
def schema(
    given: Given,
    output: Annotated[Stream, "Schema file to write. Default, and -: standard output."] = None,
    model: Model = None,
    overwrite: Overwrite = False,
) -> int:
    """Print the JSON Schema of the study file, for editors and other programs."""
    text = data.json_text(study.json_schema(model_name(model)), indent=2)
    write(output, f"{text}\n", overwrite)
    if output not in (None, "-"):
        say(f"{output}: written. A study names it in its first line: # yaml-language-server: $schema={output}")
    return 0

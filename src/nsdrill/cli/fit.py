"""nsdrill fit."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import click

from nsdrill.cli import options
from nsdrill.errors import InputError

MIN_EFFECTIVE = 50  # samples; the intervals of fewer are rough


@click.command(
    "fit",
    epilog=options.examples(
        "fit study.yaml --data field.csv",
        "fit study.yaml --data field.csv -o adjusted.yaml --picture fit.png --units field",
        "fit study.yaml --data rig.csv --rename 'TQA=surface_torque' --ignore '*' --skip-gaps",
        "run adjusted.yaml -o out.h5",
    ),
)
@options.study_argument
@click.option(
    "--data",
    type=options.FileName(),
    required=True,
    metavar="FIELD.csv",
    help="Measurements: CSV with a name and a unit over every column, over operating points or over time.",
)
@options.output("Study to write, with the samples that the data leave as its section `uncertain`.", required=False)
@click.option("--picture", type=options.FileName(), metavar="FILE", help="Picture to write: .png, .pdf or .svg.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
@click.option(
    "--rename", multiple=True, metavar="HEAD=NAME", help="Name of a column: HEAD in the file is NAME of nsdrill."
)
@click.option("--ignore", multiple=True, metavar="HEAD", help="Ignore this column; '*' ignores all unknown ones.")
@click.option(
    "--error",
    "errors",
    multiple=True,
    metavar="NAME=Q",
    help="Standard deviation of a measured value with its unit, or in percent of it. Default: 5 percent.",
)
@click.option("--skip-gaps", is_flag=True, help="Leave out rows with gaps, which are refused otherwise.")
@options.quantity("--shortest", "s", "Over time: shortest stretch of constant settings that counts. Default: 120 s.")
@options.quantity("--settle", "s", "Over time: unused beginning of each stretch. Default: 60 s.")
@click.option(
    "--batch",
    type=click.IntRange(min=16, max=100_000),
    default=128,
    show_default=True,
    metavar="N",
    help="Samples per round; each is run at every operating point of the data.",
)
@click.option(
    "--rounds",
    type=click.IntRange(min=2, max=100),
    default=8,
    show_default=True,
    metavar="N",
    help="Largest number of rounds.",
)
@click.option(
    "--samples",
    type=click.IntRange(min=2, max=10_000),
    default=128,
    show_default=True,
    metavar="N",
    help="Samples in the written study.",
)
@options.workers
@options.settings
@options.units
@click.option(
    "--resume",
    is_flag=True,
    help="Continue the interrupted fit of the same -o: only missing runs are made. --rounds may differ.",
)
@options.large
@options.overwrite
@click.option("-q", "--quiet", is_flag=True, help="No progress; the summary, warnings and errors only.")
def command(
    study: str,
    data: str,
    output: str | None,
    picture: str | None,
    as_json: bool,
    rename: tuple[str, ...],
    ignore: tuple[str, ...],
    errors: tuple[str, ...],
    skip_gaps: bool,
    shortest: float | None,
    settle: float | None,
    batch: int,
    rounds: int,
    samples: int,
    workers: int | None,
    overrides: tuple[str, ...],
    units: str | None,
    resume: bool,
    large: bool,
    overwrite: bool,
    quiet: bool,
) -> int:
    """Adjust the unknowns of STUDY, the numbers of its section `uncertain`, to
    measurements.

    Their distributions are the prior. The model is run at the operating points of the
    data for many values of the unknowns, and each is weighed by how well its features
    agree. The summary says which unknowns the data determine and which not; the written
    study has samples that agree with the data.

    With -o, every round is kept in FILE.part until the study is written. After an
    interruption --resume gives the same study as an uninterrupted fit.
    """
    from nsdrill.cli.reading import load

    loaded = load(study, overrides)
    units = units or loaded.units
    if resume and output is None:
        raise InputError("--resume: found without -o; allowed: with the -o of the fit that was interrupted.")
    _claim_outputs(study, data, output, picture, overwrite)

    from nsdrill.app.fit import far_from_the_sweep, fit
    from nsdrill.app.measured import Reading, read_measured
    from nsdrill.app.rounds import Rounds
    from nsdrill.data import json_text
    from nsdrill.progress import reporting

    times = {"shortest": shortest, "settle": settle}
    reading = Reading(
        _parse_pairs("--rename", rename),
        ignore,
        _parse_pairs("--error", errors),
        skip_gaps,
        **{name: value for name, value in times.items() if value is not None},
    )
    measured = read_measured(data, loaded, reading)
    for warning in far_from_the_sweep(loaded, measured, units):
        click.echo(f"Warning: {warning}", err=True)
    kept = Rounds()
    if output is not None:
        kept = Rounds.beside(output, loaded, measured, batch, overwrite=overwrite, resume=resume)
    if resume and not kept.runs:
        click.echo("There is no interrupted fit to resume: a new one starts.", err=True)
    with kept.guarding():
        with reporting(not quiet) as watch:
            result = fit(
                loaded,
                measured,
                batch=batch,
                rounds=rounds,
                samples=samples,
                workers=workers,
                watch=watch,
                kept=kept,
                large=large,
            )
        if as_json:
            click.echo(json_text(summary_in(result.note, units), indent=2))
        else:
            for line in lines(result.note, units):
                click.echo(line)
        if picture is not None:  # before the study: then the rounds in FILE.part are deleted
            from nsdrill.plot import save

            save(result.picture(units), picture, overwrite=overwrite)
            click.echo(f"{picture}: drawn.", err=True)
        if output is not None:
            from nsdrill.store import write_text

            write_text(output, result.study, kept.recovery_text, overwrite=overwrite or resume)
            kept.discard()
            click.echo(f"{output}: written. Next: nsdrill run {output} -o out.h5", err=True)
    return 0


def _claim_outputs(study: str, data: str, output: str | None, picture: str | None, overwrite: bool) -> None:
    """Check, before anything is run, that the picture may be written and that no output
    is an input."""
    if picture is not None:
        options.claim_picture(study, picture, overwrite)
        options.check_not_input(data, picture)
    if output is not None:
        options.check_not_input(study, output)
        options.check_not_input(data, output)


def summary_in(summary: dict[str, Any], units: str) -> dict[str, Any]:
    """The summary as plain data, with the values of unknowns and features in the system
    ``units``."""
    if units == "si":
        return summary
    converted = dict(summary)
    for section, name, fields in (
        ("unknowns", "key", ("prior", "posterior")),
        ("features", "name", ("error", "spread")),
    ):
        converted[section] = []
        for row in summary[section]:
            converted_row = dict(row)
            for field in fields:
                values = row[field] if isinstance(row[field], list) else [row[field]]
                shown, converted_row["units"] = _in_shown_unit(row[name], values, row["units"], units, signs=False)
                converted_row[field] = shown if isinstance(row[field], list) else shown[0]
            converted[section].append(converted_row)
    return converted


def _parse_pairs(option: str, texts: tuple[str, ...]) -> dict[str, str]:
    """The values ``A=B`` of an option as a mapping."""
    pairs: dict[str, str] = {}
    for text in texts:
        key, equals, value = (part.strip() for part in text.partition("="))
        if not equals or not key or not value:
            raise InputError(f"{option}: found {text!r}; allowed: two names with = between them.")
        pairs[key] = value
    return pairs


def lines(summary: dict[str, Any], units: str) -> Iterator[str]:
    """The summary of a fit, in words."""
    from nsdrill.cli.words import count

    yield (
        f"{summary['data']}: {count(summary['points'], 'operating point')}, "
        f"{count(summary['values'], 'measured value')}."
    )
    for note in summary["notes"]:
        yield f"  {note}"
    failed = f", {summary['failed']} of them failed" if summary["failed"] else ""
    yield (
        f"{summary['samples']} samples in {count(summary['rounds'], 'round')}{failed}; effective "
        f"number of samples {summary['effective']:.0f}."
    )
    yield ""
    yield from _unknown_lines(summary, units)
    yield ""
    yield from _feature_lines(summary, units)
    for verdict in verdicts(summary):
        yield ""
        yield verdict


def _unknown_lines(summary: dict[str, Any], units: str) -> Iterator[str]:
    width = max(len(row["key"]) for row in summary["unknowns"])
    yield (f"{'':{width + 2}s} {'before, 5 to 95 %':>24s}   {'after, 5 to 95 %':>24s} {'median':>10s}")
    for row in summary["unknowns"]:
        numbers, unit = _in_shown_unit(row["key"], row["prior"] + row["posterior"], row["units"], units)
        before, after = (f"{a:.4g} to {b:.4g}" for a, b in ((numbers[0], numbers[2]), (numbers[3], numbers[5])))
        information = f"{100 * row['width']:.0f} % of the width before: {INFORMATION_WORDS[row['told']]}"
        yield (f"  {row['key']:{width}s} {before:>24s}   {after:>24s} {numbers[4]:10.4g} {unit:10s} {information}")


INFORMATION_WORDS = {"well": "determined", "partly": "partly determined", "not": "NOT DETERMINED by these data"}


def _feature_lines(summary: dict[str, Any], units: str) -> Iterator[str]:
    width = max(len(row["name"]) for row in summary["features"])
    yield f"{'':{width + 2}s} {'values':>6s} {'error':>10s} {'spread':>10s}"
    for row in summary["features"]:
        numbers, unit = _in_shown_unit(row["name"], [row["error"], row["spread"]], "", units)
        yield (
            f"  {row['name']:{width}s} {row['points']:6d} {numbers[0]:10.4g} {numbers[1]:10.4g} "
            f"{unit:10s} off by "
            f"{row['deviation']:.2g} deviations"
        )


def _in_shown_unit(name: str, values: list[float], si: str, units: str, signs: bool = True) -> tuple[list[float], str]:
    """Values in the unit in which the quantity ``name`` is shown, and that unit: its
    sign, or with ``signs`` False as a study writes it."""
    from nsdrill.quantity import find, shown_scale, sign

    known = find(name)
    unit, base = (known.unit(units), known.units) if known is not None else (si, si)
    scale = shown_scale(unit, base) if unit not in ("", "percent") else 1.0
    return [value / scale for value in values], sign(unit) if signs else unit


def verdicts(summary: dict[str, Any]) -> Iterator[str]:
    """The conclusions from a fit, in sentences."""
    undetermined = [row["key"] for row in summary["unknowns"] if row["told"] == "not"]
    if len(undetermined) == len(summary["unknowns"]):
        yield (
            "THE DATA DETERMINE NONE of the unknowns: they are as uncertain as before. Measure at other "
            "settings, or another quantity that the unknowns change."
        )
    elif undetermined:
        yield (f"THE DATA DO NOT DETERMINE {', '.join(undetermined)}, which is as uncertain as before.")
    for pair in summary["together"]:
        direction = "together" if pair["correlation"] > 0 else "against each other"
        yield (
            f"{' and '.join(pair['keys'])} go {direction} (correlation "
            f"{pair['correlation']:.2f}): the "
            f"data determine a "
            "combination of the two better than either. Use the joint samples of the written study."
        )
    for row in summary["unknowns"]:
        if row["at_the_end"]:
            yield (
                f"{row['key']} is at the {row['at_the_end']} end of its distribution: the data agree best with "
                "values beyond it. Widen the distribution, or doubt the data or the model."
            )
    if not summary["explained"]:
        worst = max(summary["features"], key=lambda row: float(row["deviation"]))["name"]
        yield (
            f"THE MODEL DOES NOT GIVE THESE DATA with any values of the unknowns: its best run is "
            f"off by "
            f"{summary['misfit'] ** 0.5:.2g} times the errors (probability "
            f"{summary['chance']:.1g}), "
            f"most in {worst}. The "
            "intervals above then mean little. Doubt the errors, the other numbers of the study, "
            "or the model."
        )
    if summary["beta"] < 1 or summary["effective"] < MIN_EFFECTIVE:
        yield (
            f"NOT FINISHED: only {summary['effective']:.0f} samples count; the intervals are rough"
            f"{' and too wide' if summary['beta'] < 1 else ''}. Give more with --rounds or --batch."
        )

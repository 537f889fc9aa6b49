"""nsdrill check."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import click

from nsdrill.cli import options

if TYPE_CHECKING:
    from nsdrill.study.study import Study


@click.command(
    "check",
    epilog=options.examples(
        "check study.yaml",
        "check study.yaml --set 'operation.depth=2000 m' --json | jq .coefficients.k_t.value",
        "check study.yaml --units field",
        "new | nsdrill check -",
    ),
)
@options.study_argument
@click.option("--json", "as_json", is_flag=True, help="The same for programs; warnings included.")
@options.units
@options.settings
def command(study: str, as_json: bool, units: str, overrides: tuple[str, ...]) -> int:
    """Validate STUDY and print its derived coefficients, what follows from them, and warnings. Runs nothing.

    The coefficients are those at the point `operation` of the study, at the start of its ramps; warnings are about its
    whole sweep and its ramps.
    """
    from nsdrill.cli.reading import load

    loaded = load(study, overrides)

    from nsdrill.app.check import MEANINGS, check
    from nsdrill.cli.words import cell, count, in_units, knots_text, label_of, value_text
    from nsdrill.data import json_text
    from nsdrill.errors import printable
    from nsdrill.files import amount
    from nsdrill.models.christoforou_yigit.coefficients import UNITS

    report = check(loaded, units)
    if as_json:
        click.echo(json_text(in_units(report.as_json(), units), indent=2))
        return 0
    operation = report.operation
    source = "standard input" if study == "-" else printable(study)
    click.echo(f"{source}: valid. {loaded.title}".rstrip())
    points = count(report.points, "point")
    if loaded.refined:
        points = f"{report.coarse_points} points, refined where the responses differ to at most {report.points}"
    if report.points:
        click.echo(f"{points}: {_sweep(loaded, report.chains, units)}.")
        click.echo(
            f"Size: up to {amount(report.disk)} on the disk, and as much again while the results file is written; "
            f"about {amount(report.memory)} of memory."
        )
    for name, ramp in report.ramps.items():
        replaced = "; the sweep takes its place in nsdrill run" if name in loaded.swept else ""
        knots = knots_text(name, ramp.times, ramp.values, units)
        click.echo(f"Ramp, for nsdrill simulate: {label_of(name)} {knots}{replaced}.")
    start = "At the start of the ramp: " if loaded.ramped else "At "
    depth = value_text("depth", operation.depth, units)
    others = [value_text(name, getattr(operation, name), units, both=True) for name in ("wob", "rotary_speed")]
    click.echo(f"\n{start}{', '.join((depth, *others))}:")
    width = 9 if units == "si" else 13
    for name, meaning in MEANINGS.items():
        value, unit = cell(float(getattr(report.coefficients, name)), UNITS[name], units)
        click.echo(f"  {name:17s} {value:12.6g} {unit:{width}s}  {meaning}")
    click.echo("")
    for name, figure in report.figures.items():
        value, unit = cell(0.0 if figure.value is None else figure.value, figure.units, units)
        number = f"{value:12.6g}" if figure.value is not None else f"{'none':>12s}"
        also = ""
        if figure.units == "rad/s" and figure.value is not None:
            other = f"{figure.value * 30 / math.pi:.4g} rpm" if units == "si" else f"{figure.value:.4g} rad/s"
            also = f" ({other}, {figure.value / (2 * math.pi):.4g} Hz)"
        click.echo(f"  {name:17s} {number} {unit:{width}s}  {figure.meaning}{also}")
    for warning in report.warnings:
        click.echo(f"Warning: {warning}", err=True)
    return 0


def _sweep(study: Study, chains: int, units: str) -> str:
    """The sweep in words."""
    from nsdrill.app.check import coarse_length
    from nsdrill.cli.words import count as counted
    from nsdrill.cli.words import label_of, value_text

    axes = []
    for name in study.swept:
        label = label_of(name)
        first, last = (value_text(name, float(study.axes[name][i]), units) for i in (0, -1))
        count = len(study.axes[name])
        values = f"{count} values"
        if name in study.refined:
            values = f"{coarse_length(study, name)} values, refined to {count}"
        axes.append(f"{label} {first} to {last} ({values})" if count > 1 else f"{label} {first}")
    most = "at most " if study.refined else ""
    if starts := study.initial.starts:
        kind = (
            f"a slice over {' and '.join(study.initial.slice)}"
            if study.initial.slice
            else (f"an ensemble, seed {study.initial.seed}")
        )
        how = f"every operating point from {starts} states, {kind}"
    elif study.procedure == "same" or study.along is None:
        how = "every point from the same initial state"
    else:
        way = {"up": "up", "down": "down", "up-down": "up and back down"}[study.procedure]
        along = label_of(study.along)
        how = f"the state carried {way} along the {along}, in {most}{counted(chains, 'chain')}"
    return "; ".join(filter(None, (", ".join(axes), how)))

"""nsdrill check."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING

import click

from nsdrill.cli import options

if TYPE_CHECKING:
    from nsdrill.study.study import Study


WIDTH = 100  # characters of a line of a warning


@click.command(
    "check",
    epilog=options.examples(
        "check study.yaml",
        "check study.yaml --set 'operation.depth=2000 m' --json | jq .coefficients.k_t.value",
        "check study.yaml --units field",
        "check study.yaml --all",
        "new | nsdrill check -",
    ),
)
@options.study_argument
@click.option("--json", "as_json", is_flag=True, help="Print JSON, with all quantities and warnings.")
@click.option(
    "--all",
    "everything",
    is_flag=True,
    help="Print further quantities: buckling, higher lateral modes, standing waves, damping by the mud.",
)
@options.units
@options.settings
def command(study: str, as_json: bool, everything: bool, units: str | None, overrides: tuple[str, ...]) -> int:
    """Validate STUDY and print its derived coefficients, what follows from them, and
    warnings. Runs nothing.

    The coefficients are those at the point `operation` of the study, at the start of
    its ramps; warnings are about its whole sweep and its ramps. The JSON has the
    further quantities in any case.
    """
    from nsdrill.cli.reading import load

    loaded = load(study, overrides, notes=False)
    units = units or loaded.units

    from nsdrill.app.check import check
    from nsdrill.cli.words import count, in_units, knots_text, label_of, value_text
    from nsdrill.data import json_text
    from nsdrill.errors import printable
    from nsdrill.files import amount
    from nsdrill.models.numbers import GROUPS

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
        click.echo(f"{points}: {_sweep_text(loaded, report.chains, units)}.")
        click.echo(
            f"Size: up to {amount(report.disk)} on the disk, and as much again while the results "
            f"file is written; "
            f"about {amount(report.memory)} of memory."
        )
    if report.method != ("explicit",):
        where = " at the points where it is steep, explicitly at the others" if len(report.method) > 1 else ""
        click.echo(f"Friction: integrated implicitly{where} (simulation.method: {loaded.simulation.method}).")
    for name, ramp in report.ramps.items():
        replaced = "; the sweep takes its place in nsdrill run" if name in loaded.swept else ""
        knots = knots_text(name, ramp.times, ramp.values, units)
        click.echo(f"Ramp, for nsdrill simulate: {label_of(name)} {knots}{replaced}.")
    if loaded.continuation is not None and not loaded.swept:
        click.echo("Section continue: nsdrill branches follows it; nsdrill run runs the one point.")
    shown = {name: derived for name, derived in report.figures.items() if everything or not derived.further}
    start = "At the start of the ramp: " if loaded.ramped else "At "
    depth = value_text("depth", operation.depth, units)
    others = [value_text(name, getattr(operation, name), units, both=True) for name in ("wob", "rotary_speed")]
    click.echo(f"\n{start}{', '.join((depth, *others))}{':' if shown else '.'}")
    if report.coefficients is not None:
        rows: list[tuple[str, float | None, str, str]] = [
            (name, float(getattr(report.coefficients, name)), *unit_and_meaning)
            for name, unit_and_meaning in report.explained.items()
        ]
        _print_table("Coefficients", rows, units, shown)
    for group, title in GROUPS.items():
        rows = [
            (name, derived.value, derived.units, derived.meaning)
            for name, derived in shown.items()
            if derived.group == group
        ]
        if rows:
            _print_table(title, rows, units, shown)
    if more := len(report.figures) - len(shown):
        click.echo(
            f"\n{more} further quantities with --all: buckling, higher lateral modes, standing "
            f"waves, damping by the mud."
        )
    for warning in report.warnings:
        click.echo(textwrap.fill(f"Warning: {warning}", WIDTH, break_on_hyphens=False), err=True)
    return 0


def _print_table(
    title: str, rows: Sequence[tuple[str, float | None, str, str]], units: str, shown: Collection[str]
) -> None:
    """Print quantities with their units and meanings below a title, aligned with all
    quantities that are ``shown``."""
    from nsdrill.cli.words import cell

    name_width, unit_width = max(17, *map(len, shown)), 9 if units == "si" else 13
    click.echo(f"\n{title}")
    for name, number, si, meaning in rows:
        value, unit = cell(0.0 if number is None else number, si, units)
        text = f"{value:12.6g}" if number is not None else f"{'none':>12s}"
        equivalent = ""
        if si == "rad/s" and number is not None:
            other = f"{number * 30 / math.pi:.4g} rpm" if units == "si" else f"{number:.4g} rad/s"
            equivalent = f" ({other}, {number / (2 * math.pi):.4g} Hz)"
        elif name.endswith("_half_wave") and units == "field":
            equivalent = f" ({value / 12:.4g} ft)"
        elif name.endswith("_inclination") and number is not None:
            equivalent = f" ({math.degrees(number):.3g} degrees)"
        click.echo(f"  {name:{name_width}s} {text} {unit:{unit_width}s}  {meaning}{equivalent}")


def _sweep_text(study: Study, chains: int, units: str) -> str:
    """The sweep in words."""
    from nsdrill.app.check import coarse_length
    from nsdrill.cli.words import count as number_of
    from nsdrill.cli.words import label_of, value_text
    from nsdrill.models.leaves import word_or_number, words_of

    axes = []
    for name in study.swept:
        label = label_of(name)
        first, last = (value_text(name, float(study.axes[name][i]), units) for i in (0, -1))
        count = len(study.axes[name])
        if words_of(name):
            axes.append(f"{label} {', '.join(str(word_or_number(name, value)) for value in study.axes[name])}")
            continue
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
        start = f"every operating point from {starts} states, {kind}"
    elif study.procedure == "same" or study.along is None:
        start = "every point from the same initial state"
    else:
        direction = {"up": "up", "down": "down", "up-down": "up and back down"}[study.procedure]
        along = label_of(study.along)
        start = f"the state carried {direction} along the {along}, in {most}{number_of(chains, 'chain')}"
    samples = ""
    if study.samples:
        unknowns = ", ".join(label_of(unknown.key) for unknown in study.unknowns)
        samples = f"{number_of(study.samples, 'sample')} of {unknowns}, in place of the values in their own sections"
    return "; ".join(filter(None, (", ".join(axes), samples, start)))

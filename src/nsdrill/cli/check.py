"""nsdrill check."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import click

from nsdrill.cli import options
from nsdrill.cli.reading import knots_text
from nsdrill.cli.show import label_of, value_text

if TYPE_CHECKING:
    from nsdrill.study.study import Study

AXES = {"depth": ("depth", "m"), "wob": ("weight on bit", "kN"), "rotary_speed": ("speed", "rad/s")}


@click.command(
    "check",
    epilog=options.examples(
        "check study.yaml",
        "check study.yaml --set 'operation.depth=2000 m' --json | jq .coefficients.k_t.value",
    ),
)
@options.study_argument
@click.option("--json", "as_json", is_flag=True, help="The same for programs, in SI units; warnings included.")
@options.settings
def command(study: str, as_json: bool, overrides: tuple[str, ...]) -> int:
    """Validate STUDY and print its derived coefficients, what follows from them, and warnings. Runs nothing.

    The coefficients are those at the point `operation` of the study, at the start of its ramps; warnings are about its
    whole sweep and its ramps.
    """
    from nsdrill.study import load_study

    loaded = load_study(study, overrides)

    from nsdrill.app.check import MEANINGS, check
    from nsdrill.data import json_text
    from nsdrill.errors import printable
    from nsdrill.files import amount
    from nsdrill.model.coefficients import UNITS
    from nsdrill.units import format_quantity

    report = check(loaded)
    if as_json:
        click.echo(json_text(report.as_json(), indent=2))
        return 0
    operation = report.operation
    click.echo(f"{printable(study)}: valid. {loaded.title}".rstrip())
    points = _count(report.points, "point")
    if loaded.refined:
        points = f"{report.coarse_points} points, refined where the responses differ to at most {report.points}"
    if report.points:
        click.echo(f"{points}: {_sweep(loaded, report.chains)}.")
        click.echo(
            f"Size: up to {amount(report.disk)} on the disk, and as much again while the results file is written; "
            f"about {amount(report.memory)} of memory.")
    for name, ramp in report.ramps.items():
        label, units = AXES[name]
        replaced = "; the sweep takes its place in nsdrill run" if name in loaded.swept else ""
        click.echo(f"Ramp, for nsdrill simulate: {label} {knots_text(ramp.times, ramp.values, units)}{replaced}.")
    start = "At the start of the ramp: " if loaded.ramped else "At "
    click.echo(
        f"\n{start}{format_quantity(operation.depth, 'm')}, {format_quantity(operation.wob, 'kN')} "
        f"({format_quantity(operation.wob, 'klbf', 4)}), {format_quantity(operation.rotary_speed, 'rad/s')} "
        f"({format_quantity(operation.rotary_speed, 'rpm', 4)}):")
    for name, meaning in MEANINGS.items():
        click.echo(f"  {name:17s} {float(getattr(report.coefficients, name)):12.6g} {UNITS[name]:9s}  {meaning}")
    click.echo("")
    for name, figure in report.figures.items():
        number = f"{figure.value:12.6g}" if figure.value is not None else f"{'none':>12s}"
        units = "" if figure.units == "1" else figure.units
        also = ""
        if figure.units == "rad/s" and figure.value is not None:
            also = f" ({figure.value * 30 / math.pi:.4g} rpm, {figure.value / (2 * math.pi):.4g} Hz)"
        click.echo(f"  {name:17s} {number} {units:9s}  {figure.meaning}{also}")
    for warning in report.warnings:
        click.echo(f"Warning: {warning}", err=True)
    return 0


def _sweep(study: Study, chains: int) -> str:
    """The sweep in words."""
    from nsdrill.app.check import coarse_length
    from nsdrill.variables import dimension_of

    axes = []
    for name in study.swept:
        label = label_of(dimension_of(name))
        first, last = (value_text(dimension_of(name), float(study.axes[name][i])) for i in (0, -1))
        count = len(study.axes[name])
        values = f"{count} values"
        if name in study.refined:
            values = f"{coarse_length(study, name)} values, refined to {count}"
        axes.append(f"{label} {first} to {last} ({values})" if count > 1 else f"{label} {first}")
    most = "at most " if study.refined else ""
    if starts := study.initial.starts:
        kind = f"a slice over {' and '.join(study.initial.slice)}" if study.initial.slice else (
            f"an ensemble, seed {study.initial.seed}")
        how = f"every operating point from {starts} states, {kind}"
    elif study.procedure == "same" or study.along is None:
        how = "every point from the same initial state"
    else:
        way = {"up": "up", "down": "down", "up-down": "up and back down"}[study.procedure]
        along = label_of(dimension_of(study.along))
        how = f"the state carried {way} along the {along}, in {most}{_count(chains, 'chain')}"
    return "; ".join(filter(None, (", ".join(axes), how)))


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"

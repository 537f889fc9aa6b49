"""nsdrill check."""

from __future__ import annotations

import json

import click

from nsdrill.cli import options


@click.command("check")
@options.study_argument
@click.option("--json", "as_json", is_flag=True, help="Machine-readable output.")
@options.settings
def command(study: str, as_json: bool, overrides: tuple[str, ...]) -> int:
    """Validate STUDY and print its derived coefficients, what follows from them, and warnings."""
    from nsdrill.study import load_study

    loaded = load_study(study, overrides)

    from nsdrill.app.check import MEANINGS, check
    from nsdrill.model.coefficients import UNITS
    from nsdrill.units import format_quantity

    report = check(loaded)
    if as_json:
        click.echo(json.dumps(report.as_json(), indent=2))
        return 0
    operation = report.operation
    click.echo(f"{study}: valid. {loaded.title}".rstrip())
    sweep = ", ".join(
        f"{name} {len(loaded.axes[name])} values" for name in loaded.swept)
    procedure = loaded.procedure + (f" along {loaded.along}" if loaded.along else "")
    click.echo(f"{report.points} points ({sweep}; {procedure}), {report.chains} chains.\n")
    click.echo(
        f"At {format_quantity(operation.depth, 'm')}, {format_quantity(operation.wob, 'kN')} "
        f"({format_quantity(operation.wob, 'klbf')}), {format_quantity(operation.rotary_speed, 'rad/s')} "
        f"({format_quantity(operation.rotary_speed, 'rpm')}):")
    for name, meaning in MEANINGS.items():
        click.echo(f"  {name:14s} {float(getattr(report.coefficients, name)):14.6g} {UNITS[name]:10s} {meaning}")
    click.echo("")
    for name, figure in report.figures.items():
        number = f"{figure.value:14.6g}" if figure.value is not None else f"{'none':>14s}"
        also = ""
        if figure.units == "rad/s" and figure.value is not None:
            also = f" ({figure.value * 30 / 3.141592653589793:.4g} rpm, {figure.value / 6.283185307179586:.4g} Hz)"
        click.echo(f"  {name:17s} {number} {figure.units:7s} {figure.meaning}{also}")
    for warning in report.warnings:
        click.echo(f"Warning: {warning}", err=True)
    return 0

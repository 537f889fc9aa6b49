"""nsdrill simulate."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import click

from nsdrill.app.wording import ENDINGS
from nsdrill.cli import options

if TYPE_CHECKING:
    from nsdrill.app.trajectory import Trajectory


@click.command(
    "simulate",
    epilog=options.examples(
        "simulate study.yaml -o trace.h5",
        "simulate study.yaml -o orbit.h5 --orbit branches.h5 --point 120",
        "simulate study.yaml -o trace.h5 --depth 3000m --wob '10 klbf' --rotary-speed 120rpm --duration 60s",
    ),
)
@options.study_argument
@options.output("Trace file to write (HDF5).", hdf5=True)
@options.point(
    "Depth. Default: operation.depth of the study, value or ramp.",
    "Weight on bit. Default: operation.wob.",
    "Rotary speed. Default: operation.rotary_speed.",
)
@options.start
@options.quantity(
    "--duration", "s", "Simulated time. Default: the study's transient and observed time; with a ramp, its last knot."
)
@options.quantity("--sample", "s", "Interval between samples. Default: 10 ms.")
@click.option(
    "--orbit",
    type=options.FileName(),
    metavar="BRANCHES.h5",
    help="Run one motion of this file of branches, stable or not, over one period.",
)
@click.option("--point", type=int, metavar="N", help="With --orbit: number of the point, as nsdrill show prints it.")
@options.settings
@options.units
@options.overwrite
def command(
    study: str,
    output: str,
    depth: str | None,
    wob: str | None,
    rotary_speed: str | None,
    at: tuple[str, ...],
    start: int | None,
    duration: float | None,
    sample: float | None,
    orbit: str | None,
    point: int | None,
    overrides: tuple[str, ...],
    units: str | None,
    overwrite: bool,
) -> int:
    """Simulate one operating point of STUDY, or along its ramps, and write the
    trajectory.

    Quantities are numbers with units: 3000m, '10 klbf', 120rpm. Exit code 3 where the
    run ends early; the trace then holds what was computed before.
    """
    from nsdrill.cli.reading import load

    if orbit is not None or point is not None:
        point_options = {
            "--depth": depth,
            "--wob": wob,
            "--rotary-speed": rotary_speed,
            "--at": at or None,
            "--start": start,
        }
        return _simulate_orbit(study, output, orbit, point, point_options, duration, sample, overrides, overwrite)
    requested = options.point_values(at, depth=depth, wob=wob, rotary_speed=rotary_speed)
    # A value of a key outside of `operation` overrides the study, which checks it.
    study_values = [
        text for text in at if text.partition("=")[0].strip() in requested and "." in text.partition("=")[0]
    ]
    loaded = load(study, [*overrides, *study_values])
    units = units or loaded.units
    options.check_not_input(study, output)

    from nsdrill.app.trajectory import DEFAULT_SAMPLE, simulate
    from nsdrill.progress import telling_compiling
    from nsdrill.store import claim_file

    claim_file(output, overwrite)
    with telling_compiling(lambda text: click.echo(text, err=True)):
        result = simulate(
            loaded,
            at_sample=requested.get("sample"),
            depth=requested.get("depth"),
            wob=requested.get("wob"),
            rotary_speed=requested.get("rotary_speed"),
            start=start,
            duration=duration,
            sample=DEFAULT_SAMPLE if sample is None else sample,
        )
    click.echo(
        f"Point: {_point_text(result.trace.attrs, requested, units)}{_sample_text(loaded, requested, units)}.", err=True
    )
    code = finish(result, output, overwrite)
    if loaded.record.exponent:
        click.echo(
            "A trace has no Lyapunov exponent (record.exponent): nsdrill run measures it at every "
            "point of a sweep, "
            "and nsdrill show prints it.",
            err=True,
        )
    return code


def _simulate_orbit(
    study: str,
    output: str,
    orbit: str | None,
    point: int | None,
    point_options: Mapping[str, Any],
    duration: float | None,
    sample: float | None,
    overrides: tuple[str, ...],
    overwrite: bool,
) -> int:
    """Simulate the motion of a point of a file of branches."""
    from nsdrill.cli.reading import load
    from nsdrill.errors import InputError

    if orbit is None or point is None:
        option, missing = ("--point", "--orbit") if orbit is None else ("--orbit", "--point")
        raise InputError(f"{option}: found without {missing}; allowed: with it.")
    for option, value in point_options.items():
        if value is not None:
            raise InputError(f"{option}: found with --orbit, whose point has its own; allowed: without --orbit.")
    loaded = load(study, overrides)
    options.check_not_input(study, output)
    options.check_not_input(orbit, output)

    from nsdrill.app.orbit import trace_of
    from nsdrill.quantity import quantity
    from nsdrill.store import claim_file
    from nsdrill.variables import dimension_of

    claim_file(output, overwrite)
    result, branch_point = trace_of(
        loaded, lambda texts: load(study, [*overrides, *texts]), orbit, point, duration=duration, sample=sample
    )
    numbers = ", ".join(quantity(dimension_of(key)).text(value, "si", 10) for key, value in branch_point.values.items())
    stable = (
        "stable"
        if branch_point.unstable == 0
        else f"unstable in {branch_point.unstable} direction{'s'[: branch_point.unstable - 1]}"
    )
    click.echo(f"Point {point}: {numbers}; period {branch_point.period:.6g} s; {stable}.", err=True)
    return finish(result, output, overwrite)


def _point_text(attrs: Mapping[str, Any], requested: Mapping[str, float], units: str) -> str:
    """The operating values of a trace in words; of a ramp its knots."""
    from nsdrill.cli.words import in_unit_of, knots_text, label_of, point_text
    from nsdrill.variables import AXES

    ramps = json.loads(attrs.get("ramps", "{}"))
    fixed = {name: in_unit_of(name, float(attrs[name]), requested) for name in AXES if name not in ramps}
    moving = [f"{label_of(name)} {knots_text(name, times, values, units)}" for name, (times, values) in ramps.items()]
    return "; ".join(part for part in (point_text(fixed, units), *moving) if part)


def _sample_text(study: Any, requested: Mapping[str, float], units: str) -> str:
    """The number of the requested sample, and its values except those of the operation;
    "" without one."""
    from nsdrill.cli.words import point_text
    from nsdrill.variables import AXES, SAMPLE

    if SAMPLE not in requested:
        return ""
    number = int(requested[SAMPLE])
    drawn = {
        unknown.name: float(study.drawn[unknown.short][number])
        for unknown in study.unknowns
        if unknown.short not in AXES
    }
    return f"{f', {point_text(drawn, units)}' if drawn else ''}, sample {number}"


def finish(result: Trajectory, output: str, overwrite: bool) -> int:
    """Write the trace and print how the run ended; the exit code."""
    from nsdrill.cli.words import count
    from nsdrill.store import write_trace
    from nsdrill.variables import OK

    write_trace(output, result.trace, overwrite=overwrite)
    time = result.trace.time
    click.echo(f"{output}: {count(len(time), 'sample')} over {time[-1] if len(time) else 0:g} s.", err=True)
    if result.status == OK:
        return 0
    status = str(result.trace.attrs["status"])
    words = ENDINGS.get(status, status) + (f"; {result.advice}" if result.advice else "")
    click.echo(f"The run ended early ({status}): {words}. The trace holds what was computed before.", err=True)
    return 3

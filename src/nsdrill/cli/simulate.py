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
        "simulate study.yaml -o trace.h5 --depth 3000m --wob '10 klbf' --rotary-speed 120rpm "
        "--duration 60s",
    ),
)
@options.study_argument
@options.output("Trace file to write (HDF5).")
@options.quantity("--depth", "m", "Depth. Default: operation.depth of the study, value or ramp.")
@options.quantity("--wob", "N", "Weight on bit. Default: operation.wob.")
@options.quantity("--rotary-speed", "rad/s", "Top-drive speed. Default: operation.rotary_speed.")
@options.at
@options.start
@options.quantity(
    "--duration",
    "s",
    "Simulated time. Default: the study's transient and observed time; with a ramp, its last knot.",
)
@options.quantity("--sample", "s", "Interval between samples. Default: 10 ms.")
@click.option(
    "--orbit",
    type=options.FileName(),
    metavar="BRANCHES.h5",
    help="Run the motion of one point of this file of branches, stable or not, over one period.",
)
@click.option(
    "--point",
    type=int,
    metavar="N",
    help="With --orbit: the number of the point, as nsdrill show tells it.",
)
@options.settings
@options.units
@options.overwrite
def command(
    study: str,
    output: str,
    depth: float | None,
    wob: float | None,
    rotary_speed: float | None,
    at: tuple[str, ...],
    start: int | None,
    duration: float | None,
    sample: float | None,
    orbit: str | None,
    point: int | None,
    overrides: tuple[str, ...],
    units: str,
    overwrite: bool,
) -> int:
    """Simulate one operating point of STUDY, or along its ramps, and write the
    trajectory.

    Quantities are numbers with units: 3000m, '10 klbf', 120rpm. Exit code 3 where the
    run ends early; the trace then holds what was computed before.
    """
    from nsdrill.cli.reading import load

    if orbit is not None or point is not None:
        apart = {
            "--depth": depth,
            "--wob": wob,
            "--rotary-speed": rotary_speed,
            "--at": at or None,
            "--start": start,
        }
        return _orbit(study, output, orbit, point, apart, duration, sample, overrides, overwrite)
    given = options.values(at, depth=depth, wob=wob, rotary_speed=rotary_speed)
    # A number that is no operating value is one of the study, and is checked as if it
    # stood there.
    further = [
        text
        for text in at
        if text.partition("=")[0].strip() in given
        and "." in text.partition("=")[0]
        and not text.startswith("operation.")
    ]
    loaded = load(study, [*overrides, *further])
    options.keep_apart(study, output)

    from nsdrill.app.trajectory import DEFAULT_SAMPLE, simulate
    from nsdrill.store import claim_file

    claim_file(output, overwrite)
    result = simulate(
        loaded,
        at_sample=given.get("sample"),
        depth=given.get("depth"),
        wob=given.get("wob"),
        rotary_speed=given.get("rotary_speed"),
        start=start,
        duration=duration,
        sample=DEFAULT_SAMPLE if sample is None else sample,
    )
    click.echo(
        f"Point: {_point(result.trace.attrs, given, units)}{_sample(loaded, given, units)}.",
        err=True,
    )
    return finish(result, output, overwrite)


def _orbit(
    study: str,
    output: str,
    orbit: str | None,
    point: int | None,
    apart: Mapping[str, Any],
    duration: float | None,
    sample: float | None,
    overrides: tuple[str, ...],
    overwrite: bool,
) -> int:
    """The motion of a point of a file of branches."""
    from nsdrill.cli.reading import load
    from nsdrill.errors import InputError

    if orbit is None or point is None:
        found, lacking = ("--point", "--orbit") if orbit is None else ("--orbit", "--point")
        raise InputError(f"{found}: found without {lacking}; allowed: with it.")
    for option, value in apart.items():
        if value is not None:
            raise InputError(
                f"{option}: found with --orbit, whose point has its own; allowed: without --orbit."
            )
    loaded = load(study, overrides)
    options.keep_apart(study, output)
    options.keep_apart(orbit, output)

    from nsdrill.app.orbit import trace_of
    from nsdrill.quantity import quantity
    from nsdrill.store import claim_file
    from nsdrill.variables import dimension_of

    claim_file(output, overwrite)
    result, wanted = trace_of(
        loaded,
        lambda texts: load(study, [*overrides, *texts]),
        orbit,
        point,
        duration=duration,
        sample=sample,
    )
    numbers = ", ".join(
        quantity(dimension_of(key)).text(value, "si", 10) for key, value in wanted.values.items()
    )
    stable = (
        "stable"
        if wanted.unstable == 0
        else f"unstable in {wanted.unstable} direction{'s'[: wanted.unstable - 1]}"
    )
    click.echo(f"Point {point}: {numbers}; period {wanted.period:.6g} s; {stable}.", err=True)
    return finish(result, output, overwrite)


def _point(attrs: Mapping[str, Any], given: Mapping[str, float], units: str) -> str:
    """The operating values of a trace, in words; of one that moves its knots."""
    from nsdrill.cli.words import as_asked, knots_text, label_of, point_text
    from nsdrill.variables import AXES

    ramps = json.loads(attrs.get("ramps", "{}"))
    fixed = {name: as_asked(name, float(attrs[name]), given) for name in AXES if name not in ramps}
    moving = [
        f"{label_of(name)} {knots_text(name, times, values, units)}"
        for name, (times, values) in ramps.items()
    ]
    return "; ".join(part for part in (point_text(fixed, units), *moving) if part)


def _sample(study: Any, given: Mapping[str, float], units: str) -> str:
    """The values of the sample that was asked for, but for those of the operation, and
    its number."""
    from nsdrill.cli.words import point_text
    from nsdrill.variables import AXES, SAMPLE

    if SAMPLE not in given:
        return ""
    number = int(given[SAMPLE])
    drawn = {
        one.name: float(study.drawn[one.short][number])
        for one in study.unknowns
        if one.short not in AXES
    }
    return f"{f', {point_text(drawn, units)}' if drawn else ''}, sample {number}"


def finish(result: Trajectory, output: str, overwrite: bool) -> int:
    """Write the trace and say how the run ended."""
    from nsdrill.cli.words import count
    from nsdrill.store import write_trace
    from nsdrill.variables import OK

    write_trace(output, result.trace, overwrite=overwrite)
    time = result.trace.time
    click.echo(
        f"{output}: {count(len(time), 'sample')} over {time[-1] if len(time) else 0:g} s.", err=True
    )
    if result.status == OK:
        return 0
    status = str(result.trace.attrs["status"])
    words = ENDINGS.get(status, status) + (f"; {result.advice}" if result.advice else "")
    click.echo(
        f"The run ended early ({status}): {words}. The trace holds what was computed before.",
        err=True,
    )
    return 3

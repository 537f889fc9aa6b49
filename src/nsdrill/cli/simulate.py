"""nsdrill simulate."""

from __future__ import annotations

import click

from nsdrill.cli import options


@click.command("simulate")
@options.study_argument
@options.output("Trace file to write (HDF5).")
@options.quantity("--depth", "m", "Depth; default: the study's operation.")
@options.quantity("--wob", "N", "Weight on bit.")
@options.quantity("--rotary-speed", "rad/s", "Top-drive speed.")
@options.quantity("--duration", "s", "Simulated time; default: the study's transient and observed time.")
@options.quantity("--sample", "s", "Interval between samples; default: 10 ms.")
@options.settings
@options.overwrite
def command(
    study: str, output: str, depth: float | None, wob: float | None, rotary_speed: float | None,
    duration: float | None, sample: float | None, overrides: tuple[str, ...], overwrite: bool,
) -> int:  # fmt: skip
    """Simulate one operating point of STUDY and write its trajectory."""
    from nsdrill.study import load_study

    loaded = load_study(study, overrides)

    from nsdrill.app.trajectory import DEFAULT_SAMPLE, simulate
    from nsdrill.store import claim_file

    claim_file(output, overwrite)
    result = simulate(
        loaded, depth=depth, wob=wob, rotary_speed=rotary_speed, duration=duration,
        sample=DEFAULT_SAMPLE if sample is None else sample,
    )  # fmt: skip
    return finish(result, output)


def finish(result, output: str) -> int:  # type: ignore[no-untyped-def]
    """Write the trace and say how the run ended."""
    from nsdrill.store import write_trace
    from nsdrill.variables import OK

    write_trace(output, result.trace)
    time = result.trace.time
    click.echo(f"{output}: {len(time)} samples over {time[-1] if len(time) else 0:g} s.", err=True)
    if result.status == OK:
        return 0
    click.echo(
        f"The run ended early: {result.trace.attrs['status']}. The trace holds what was computed before.", err=True)
    return 3

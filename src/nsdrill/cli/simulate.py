"""nsdrill simulate."""

from __future__ import annotations

from typing import TYPE_CHECKING

from nsdrill.cli.building import Given, command_of, say
from nsdrill.errors import ENDINGS
from nsdrill.late import deferred
from nsdrill.operations import runs
from nsdrill.operations.arguments import Overwrite, TracePath, Units

with deferred():
    from nsdrill import progress, store, variables
    from nsdrill.app import arguments, orbit
    from nsdrill.text import runs as text
    from nsdrill.text import words

if TYPE_CHECKING:
    from nsdrill.app.trajectory import Trajectory


@command_of(
    runs.simulate,
    examples=(
        "simulate study.yaml -o trace.h5",
        "simulate study.yaml -o orbit.h5 --orbit branches.h5 --point 120",
        "simulate study.yaml -o trace.h5 --depth 3000m --wob '10 klbf' --rotary-speed 120rpm --duration 60s",
    ),
)
def command(given: Given, output: TracePath, units: Units = None, overwrite: Overwrite = False) -> int:
    """Simulate one operating point of STUDY, or along its ramps, and write the
    trajectory.

    Quantities are numbers with units: 3000m, '10 klbf', 120rpm. Exit code 3 where the
    run ends early; the trace then holds what was computed before.
    """
    study, requested = given["study"], requested_values(given)
    store.claim_file(output, overwrite)
    with progress.telling_compiling(say):
        result = runs.simulate(**given)
    if "orbit" in given:
        say(text.orbit_text(orbit.orbit_point(given["orbit"], given["point"])[0]))
    else:
        point = text.simulated_text(result.trace.attrs, study, requested, units or study.units)
        say(f"Point: {point}.")
    code = finish(result, output, overwrite)
    if study.record.exponent:
        say(
            "A trace has no Lyapunov exponent (record.exponent): nsdrill run measures it at every "
            "point of a sweep, and nsdrill show prints it."
        )
    return code


def requested_values(given: Given) -> dict[str, float]:
    """The values of the operating point that were asked for, in SI, with their units."""
    values: dict[str, float | None] = {name: given.get(name) for name in ("depth", "wob", "rotary_speed")}
    return arguments.values_in(given.get("at"), None, **values)


def finish(result: Trajectory, output: str, overwrite: bool) -> int:
    """Write the trace and print how the run ended; the exit code."""
    store.write_trace(output, result.trace, overwrite=overwrite)
    time = result.trace.time
    say(f"{output}: {words.count(len(time), 'sample')} over {time[-1] if len(time) else 0:g} s.")
    if result.status == variables.OK:
        return 0
    status = str(result.trace.attrs["status"])
    ending = ENDINGS.get(status, status) + (f"; {result.advice}" if result.advice else "")
    say(f"The run ended early ({status}): {ending}. The trace holds what was computed before.")
    return 3

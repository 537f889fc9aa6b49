"""nsdrill replay."""

from __future__ import annotations

from nsdrill.cli.building import Given, command_of, say
from nsdrill.cli.simulate import finish, requested_values
from nsdrill.late import deferred
from nsdrill.operations import runs
from nsdrill.operations.arguments import Overwrite, TracePath, Units

with deferred():
    from nsdrill import progress, store
    from nsdrill.text import runs as text


@command_of(
    runs.replay,
    examples=(
        "replay out.h5 --rotary-speed 60rpm --procedure down -o trace.h5",
        "replay map.h5 --rotary-speed 60rpm --wob '15 klbf' -o trace.h5 --sample 1ms",
        "replay ensemble.h5 --rotary-speed 3rad/s --start 17 -o trace.h5",
    ),
)
def command(given: Given, output: TracePath, units: Units = None, overwrite: Overwrite = False) -> int:
    """Run one point of RESULTS again, from its stored initial state, and write its
    trajectory.

    It says whether the run ends in the stored final state, bit for bit, and if not,
    what differs from where the file was made. An axis along which the sweep has one
    value only may be left out. Failed points can be run again as well.
    """
    store.claim_file(output, overwrite)
    requested = requested_values(given)
    with progress.telling_compiling(say):
        result = runs.replay(**given)
    point = text.replayed_text(result.trace.attrs, given.get("start"), requested, units or "si")
    say(f"Point: {point}.")
    code = finish(result, output, overwrite)
    say("It ends in the stored final state, bit for bit." if result.same_bits else f"Warning: it {result.warning}")
    return code

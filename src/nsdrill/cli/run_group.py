"""The commands of the group Run: a study is written, checked, and run."""

from __future__ import annotations

import difflib
import re
import shlex
import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated

import click

from nsdrill.cli.building import (
    Given,
    command_of,
    following,
    model_name,
    print_answer,
    print_json,
    requested_values,
    say,
    write,
)
from nsdrill.cli.overview import EXIT_CODES
from nsdrill.errors import ENDINGS, InputError, count, printable
from nsdrill.late import deferred
from nsdrill.operations import questions, runs
from nsdrill.operations.argument import Argument, Text
from nsdrill.operations.arguments import (
    BranchesPath,
    Everything,
    Json,
    Model,
    Overwrite,
    ResultsLike,
    ResultsPath,
    Stream,
    StudyLike,
    Switch,
    TracePath,
    Units,
    examples,
)

with deferred():
    from nsdrill import data, progress, store, study, variables
    from nsdrill.app import check as checks
    from nsdrill.app.following import orbits
    from nsdrill.study import write as writing
    from nsdrill.text import run_text

if TYPE_CHECKING:
    from nsdrill.app.running.run import RunResult
    from nsdrill.app.simulating.trajectory import Trajectory


@command_of(
    examples=(
        "new -o study.yaml",
        "new --units field -o study.yaml",
        "new --all | less",
        "new --list",
        "new --example torsional_speed -o study.yaml",
        "new | nsdrill check -",
    )
)
def new(
    given: Given,
    output: Annotated[Stream, "Study file to write. Default, and -: standard output."] = None,
    model: Model = None,
    example: Annotated[
        str | None,
        Argument(
            "Write one of the studies that come with nsdrill; --list prints their names.",
            metavar="NAME",
            kind=Text(examples),
        ),
    ] = None,
    list: Annotated[Switch, "Print the examples with their titles."] = False,
    all: Annotated[Switch, "Write every key with its meaning and default."] = False,
    units: Units = None,
    overwrite: Overwrite = False,
) -> int:
    """Write a short study to start from: the numbers that differ from well to well, and
    a sweep of the rotary speed up and down."""
    if list:
        click.echo(_listing())
        return 0
    if example is not None:
        if model is not None or all:
            other = "--all" if all else "--model"
            raise InputError(f"--example: found with {other}; allowed: one of the two.")
        text = _example(example)
    elif all:
        text = study.template_text(model_name(model), units or "si")
    else:
        text = study.short_text(model_name(model), units or "si")
    write(output, text, overwrite)
    if output not in (None, "-"):
        follows = re.search(r"^continue:", text, re.MULTILINE)
        command = "branches" if follows and not re.search(r"^sweep:", text, re.MULTILINE) else "run"
        name = shlex.quote(output)
        say(f"{output}: written. Next: {following(f'check {name}')}; {following(f'{command} {name} -o out.h5')}")
    return 0


def _example(name: str) -> str:
    """The text of the example ``name``; InputError with the list of all for an unknown
    name."""
    paths = writing.examples()
    stem = name.replace("-", "_")
    match = next((example for example in paths if example.replace("-", "_") == stem), None)
    if match is not None:
        return paths[match].read_text(encoding="utf-8")
    near = difflib.get_close_matches(name, paths, n=1)
    hint = f" Did you mean {near[0]}?" if near else ""
    raise InputError(f"--example: found {name}, which is no example.{hint} Allowed:\n{_listing()}")


def _listing() -> str:
    """The names and titles of the examples."""
    return "\n".join(f"  {name:<27} {writing.title_of(path)}" for name, path in writing.examples().items())


WIDTH = 100  # characters of a line of a warning


@command_of(
    questions.check,
    examples=(
        "check study.yaml",
        "check study.yaml --set 'operation.depth=2000 m' --json | jq .coefficients.k_t.value",
        "check study.yaml --units field",
        "check study.yaml --all",
        "new | nsdrill check -",
    ),
    notes=False,
)
def check(
    given: Given,
    study: StudyLike,
    json: Annotated[Json, "Print JSON, with all quantities and warnings."] = False,
    everything: Annotated[
        Everything, "Print further quantities: buckling, higher lateral modes, standing waves."
    ] = False,
) -> int:
    """Validate STUDY and print its derived coefficients, what follows from them, and
    warnings. Runs nothing.

    The coefficients are those at the point `operation` of the study, at the start of
    its ramps; warnings are about its whole sweep and its ramps. The JSON has the
    further quantities in any case.
    """
    report, units = questions.check(**given), given["units"]
    if json:
        print_json(report.as_json(), units)
        return 0
    source = "standard input" if study == "-" else printable(str(study))
    for line in run_text.check_lines(given["study"], report, source, units, everything):
        click.echo(line)
    _say_warnings(report.warnings)
    return 0


def _say_warnings(warnings: Sequence[str]) -> None:
    for warning in warnings:
        say(textwrap.fill(f"Warning: {warning}", WIDTH, break_on_hyphens=False))


@command_of(
    runs.run,
    before=EXIT_CODES,
    examples=(
        "run study.yaml -o out.h5",
        "run study.yaml -o out.h5 --resume",
        "run study.yaml -o out.h5 --retry-failed --set simulation.max_steps=1000000",
        "run study.yaml -o heavy.h5 --set 'operation.wob=30 klbf' --set sweep.procedure=up",
    ),
)
def run(given: Given, study: StudyLike, path: ResultsPath, units: Units = None) -> int:
    """Run STUDY and write the results file.

    The warnings of `nsdrill check` come first. The file appears when all points are
    finished. After an interruption, by Ctrl-C or a signal of the batch system, finished
    points are kept, and --resume gives the same file as an uninterrupted run.
    """
    loaded = given["study"]
    if loaded.continuation is not None and not loaded.swept:
        say(f"{study} has no sweep: one point is run. nsdrill branches {study} -o {path} follows its section continue.")
    found = checks.warnings(loaded, units or loaded.units)
    _say_warnings([one for one in found if one not in loaded.notes])  # those are said by now
    outcome: RunResult = runs.run(**given)  # type: ignore[assignment]
    if given["progress"]:
        say(run_text.outcome_text(outcome, units or loaded.units))
    return 3 if outcome.failed else 0


@command_of(
    runs.simulate,
    examples=(
        "simulate study.yaml -o trace.h5",
        "simulate study.yaml -o orbit.h5 --orbit branches.h5 --point 120",
        "simulate study.yaml -o trace.h5 --depth 3000m --wob '10 klbf' --rotary-speed 120rpm --duration 60s",
        "simulate study.yaml -o trace.h5 --data rig.csv --rename 'RPMA=rotary_speed'",
    ),
    groups={"Along a log": ("data", "rename", "unit", "times", "columns", "only", "skip_gaps")},
)
def simulate(given: Given, output: TracePath, units: Units = None, overwrite: Overwrite = False) -> int:
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
        say(run_text.orbit_text(orbits.orbit_point(given["orbit"], given["point"])[0]))
    else:
        point = run_text.simulated_text(result.trace.attrs, study, requested, units or study.units)
        if point:
            say(f"Point: {point}.")
    code = finish(result, output, overwrite)
    if study.record.exponent:
        say(
            "A trace has no Lyapunov exponent (record.exponent): nsdrill run measures it at every "
            "point of a sweep, and nsdrill show prints it."
        )
    return code


def finish(result: Trajectory, output: str, overwrite: bool) -> int:
    """Write the trace and print how the run ended; the exit code."""
    store.write_trace(output, result.trace, overwrite=overwrite)
    time = result.trace.time
    say(f"{output}: {count(len(time), 'sample')} over {time[-1] if len(time) else 0:g} s.")
    if result.status == variables.OK:
        return 0
    status = str(result.trace.attrs["status"])
    ending = ENDINGS.get(status, status) + (f"; {result.advice}" if result.advice else "")
    say(f"The run ended early ({status}): {ending}. The trace holds what was computed before.")
    return 3


@command_of(
    runs.replay,
    examples=(
        "replay out.h5 --rotary-speed 60rpm --procedure down -o trace.h5",
        "replay map.h5 --rotary-speed 60rpm --wob '15 klbf' -o trace.h5 --sample 1ms",
        "replay ensemble.h5 --rotary-speed 3rad/s --start 17 -o trace.h5",
    ),
)
def replay(given: Given, output: TracePath, units: Units = None, overwrite: Overwrite = False) -> int:
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
    point = run_text.replayed_text(result.trace.attrs, given.get("start"), requested, units or "si")
    say(f"Point: {point}.")
    if result.after_failure:
        say(data.NOT_CARRIED_WORDS)
    code = finish(result, output, overwrite)
    say("It ends in the stored final state, bit for bit." if result.same_bits else f"Warning: it {result.warning}")
    return code


@command_of(
    runs.continue_branches,
    before=EXIT_CODES,
    examples=(
        "branches study.yaml -o branches.h5",
        "branches study.yaml -o branches.h5 --seeds out.h5",
        "branches study.yaml -o branches.h5 --resume",
        "branches study.yaml -o down.h5 --seeds out.h5 --at rotary_speed=5rad/s --set continue.direction=down",
        "branches other.yaml -o other.h5 --seeds branches.h5 --point 120",
        "plot branches.h5 --over out.h5 -o branches.png",
    ),
)
def branches(given: Given, path: BranchesPath) -> int:
    """Follow the motions of STUDY, stable or not, along the number that its section
    continue names, and write their branches with stability and special points.

    The motions are seeded by a results file, or settle first at some values. `nsdrill
    show` says what each special point means, `nsdrill plot` draws the branches, also
    over the peaks of a sweep.
    """
    continuation = runs.continue_branches(**given)
    if given["progress"]:
        say(f"{path}: {run_text.continuation_text(continuation)}")
    return 0


@command_of(
    runs.lyapunov_spectrum,
    examples=(
        "spectrum out.h5 --rotary-speed 3rad/s --procedure up",
        "spectrum forced.h5 --at parameters.force=0.35 --duration 2000s",
        "spectrum out.h5 --rotary-speed 3rad/s --procedure up --json | jq .dimension",
    ),
)
def spectrum(given: Given, results: ResultsLike, json: Json = False, units: Units = None) -> int:
    """Measure all Lyapunov exponents of one point of RESULTS, of the motion that goes on
    from the end of its run.

    A deviation in each direction is followed along the motion. It prints the exponents
    with their standard errors, their sum, and the Kaplan-Yorke dimension of the
    attractor.
    """
    found = runs.lyapunov_spectrum(**given)
    print_answer(found, run_text.spectrum_lines(found, units or "si"), units or "si", json)
    return 0

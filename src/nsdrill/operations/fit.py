"""The fit of a study to measurements, with its arguments."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated

from nsdrill.errors import InputError, RunWarning, warn
from nsdrill.late import deferred
from nsdrill.operations.argument import Argument, Choice, File, Texts, Whole
from nsdrill.operations.arguments import (
    FILE,
    ColumnsOf,
    Device,
    Ignore,
    Large,
    Only,
    Overwrite,
    PathLike,
    Rename,
    Reported,
    Resume,
    Settings,
    Settle,
    Shortest,
    SkipGaps,
    StudyLike,
    TimesOf,
    UnitOf,
    Units,
    Workers,
    texts_of,
)

with deferred():
    from nsdrill import files
    from nsdrill import progress as reports
    from nsdrill.app import conversion, picture_making
    from nsdrill.app.fitting import ensemble_fit, measured
    from nsdrill.app.running import place as places
    from nsdrill.app.running import unfinished

if TYPE_CHECKING:
    from nsdrill.app.fitting.ensemble_fit import Fit


Errors = Annotated[
    "Mapping[str, str | float] | None",
    Argument(
        'Standard deviations by name: ``{"surface_torque_max": "0.2 kft*lbf"}``, in percent, or in SI as numbers.',
        "mapping",
        "--error",
        "NAME=Q",
        Texts(pairs=True),
        "Standard deviation of a measured value with its unit, or in percent of it. Default: 5 percent.",
    ),
]
SurfaceTorque = Annotated[
    str,
    Argument(
        'Which torque a log has as surface_torque: that of the ``"string"``, or that of the ``"motor"``, which also '
        "accelerates the drive.",
        "str",
        "--surface-torque",
        "string|motor",
        Choice(("string", "motor")),
        "Which torque a log has: that of the string (default), or that of the motor, which also accelerates the drive.",
    ),
]
Batch = Annotated[
    int,
    Argument(
        "Samples per round; each is run at every operating point of the data.",
        "int",
        "--batch",
        "N",
        Whole(16, 100_000),
    ),
]
MostRounds = Annotated[int, Argument("Largest number of rounds.", "int", "--rounds", "N", Whole(2, 100))]
Samples = Annotated[int, Argument("Samples in the written study.", "int", "--samples", "N", Whole(2, 10_000))]
Measurements = Annotated[
    "PathLike",
    Argument(
        "A CSV file with a name and a unit over every column, over operating points or over time: a log.",
        FILE,
        "--data",
        "FIELD.csv",
        File(),
        "Measurements: CSV with a name and a unit over every column, over operating points or over time (a log).",
    ),
]
StudyPath = Annotated[
    "PathLike | None",
    Argument(
        "The adjusted study to write.",
        FILE,
        "-o --output",
        "FILE",
        File(writes=True),
        "Study to write, with the samples that the data leave as its section `uncertain`.",
    ),
]
PictureOfFit = Annotated[
    "str | None",
    Argument("Picture to write: .png, .pdf or .svg.", option="--picture", metavar="FILE", kind=File(writes=True)),
]


def fit(
    study: StudyLike,
    data: Measurements,
    path: StudyPath = None,
    *,
    picture: PictureOfFit = None,
    rename: Rename = None,
    ignore: Ignore = (),
    unit: UnitOf = None,
    times: TimesOf = (),
    columns: ColumnsOf = (),
    errors: Errors = None,
    only: Only = None,
    skip_gaps: SkipGaps = False,
    surface_torque: SurfaceTorque = "string",
    shortest: Shortest = "120 s",
    settle: Settle = "60 s",
    batch: Batch = 128,
    rounds: MostRounds = 8,
    samples: Samples = 128,
    workers: Workers = None,
    device: Device = "cpu",
    set: Settings = None,
    units: Units = None,
    resume: Annotated[
        Resume, "Continue the interrupted fit of the same output: only missing runs are made; rounds may differ."
    ] = False,
    large: Large = False,
    overwrite: Overwrite = False,
    progress: Reported = True,
) -> Fit:
    """Adjust the unknowns of a study, the numbers of its section ``uncertain``, to
    measurements.

    With ``path`` every round is saved next to it: after a KeyboardInterrupt, or a power cut,
    the same call with ``resume=True`` makes the missing runs, with the same bits as an
    uninterrupted fit.

    Returns
    -------
    Fit

    Raises
    ------
    InputError
        Where the study has no unknown, or something in the file cannot be used.

    Examples
    --------
    >>> found = nsdrill.fit("uncertain.yaml", "field.csv", batch=16, progress=False)
    >>> list(found.samples)
    ['bit.friction.static']
    """
    loaded = conversion.study_in(study, set)
    places.check_device(device)
    units = units or loaded.units
    output = conversion.output_in(path, study, data, resume=resume, overwrite=overwrite and picture is None)
    if output is not None and output.lower().endswith((".h5", ".hdf5", ".nc")):
        raise InputError(f"{output}: found the ending of results; allowed: that of a study, .yaml.")
    if picture is not None:
        picture_making.claim_picture(picture, overwrite)
    reading = measured.Reading(
        dict(rename or {}),
        texts_of(ignore),
        dict(errors or {}),
        skip_gaps,
        conversion.seconds_in("shortest", shortest),
        conversion.seconds_in("settle", settle),
        dict(unit or {}),
        texts_of(times),
        columns,
        surface_torque,
        dict(only or {}),
    )
    table = measured.read_measured(conversion.name_in(data, "data"), loaded, reading)
    for text in ensemble_fit.far_from_the_sweep(loaded, table, units):
        warn(text, RunWarning)
    calls = unfinished.Rounds()
    if output is not None:
        calls = unfinished.Rounds.beside(output, loaded, table, batch, overwrite=overwrite, resume=resume)
    if resume and not calls.runs:
        warn("There is no interrupted fit to resume: a new one starts.", RunWarning)
    with calls.guarding():
        with reports.reporting(progress) as watch:
            found = ensemble_fit.fit(
                loaded,
                table,
                batch=batch,
                rounds=rounds,
                samples=samples,
                workers=workers,
                watch=watch,
                kept=calls,
                large=large,
                device=device,
            )
        if picture is not None:  # before the study: then the rounds beside it are deleted
            picture_making.save_picture(found.picture(units), picture, overwrite)
        if output is not None:
            files.write_text(output, found.study, calls.recovery_text, overwrite=overwrite or resume)
            calls.discard()
    return found

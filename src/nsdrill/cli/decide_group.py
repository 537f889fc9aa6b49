"""The commands of the group Decide: answers for the driller."""

from __future__ import annotations

import os
import shlex
from typing import TYPE_CHECKING, Annotated

from nsdrill import interrupt
from nsdrill.cli.building import Given, command_of, following, print_answer, requested_values, say
from nsdrill.errors import Refusal, printable
from nsdrill.late import deferred
from nsdrill.operations import fit as fits
from nsdrill.operations import questions
from nsdrill.operations.arguments import (
    Everything,
    Json,
    Other,
    Overwrite,
    Picture,
    Rates,
    Reported,
    ResultsLike,
    Severity,
    Tried,
    Units,
    WithText,
)
from nsdrill.operations.fit import PictureOfFit, StudyPath

with deferred():
    from nsdrill import progress as reports
    from nsdrill.analysis import sensitivity as indices
    from nsdrill.analysis import window as regions
    from nsdrill.app import picture_making
    from nsdrill.app.answering import answers as found_in
    from nsdrill.app.answering import window_trials
    from nsdrill.text import contrast_text, uncertainty_text, window_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from nsdrill.data import Answer


@command_of(
    questions.window,
    examples=(
        "window map.h5",
        "window map.h5 --units field --picture window.png",
        "window ideal.h5 soft_torque.h5 --units field",
        "window map.h5 --trials",
        "window map.h5 --within rotary_speed=100rpm..180rpm",
        "window map.h5 --severity 1",
        "window uncertain.h5 --confidence 95",
        "window map.h5 --json | jq .maps[0].recommended",
    ),
)
def window(
    given: Given,
    results: ResultsLike,
    other: Other = None,
    units: Units = None,
    json: Annotated[Json, "Print JSON, with every map and region."] = False,
    everything: Annotated[Everything, "All warnings, and the numbers behind the answer."] = False,
    trials: Tried = False,
    picture: Annotated[Picture, "Picture to write as well: .png, .pdf or .svg."] = None,
    with_text: Annotated[WithText, "In the picture: the answer and its warnings as well."] = False,
    rates: Annotated[Rates, "In the picture: lines of equal rate of penetration as well."] = False,
    overwrite: Overwrite = False,
) -> int:
    """Find where to run, how to get there, and what never to exceed.

    RESULTS is a map over weight on bit, speed or depth, or a sweep along one of them.
    A setting is allowed if the string runs free of vibration there when it is brought
    up from below; the way down tells whether a vibration, once started, ends. The
    answer is the setting with enough room, what lies beside it, the way in, what ends a
    vibration, and what is seen at the surface. With uncertain numbers a setting is
    allowed with a stated probability.

    With OTHER, results over the same axes, it compares the two windows: points gained
    and lost, how far every border moved, where the responses begin, and the rate of
    penetration.
    """
    assert units is not None
    if picture is not None:
        picture_making.claim_picture(picture, overwrite)
    severity, confidence, within = (given.get(name) for name in ("severity", "confidence", "within"))
    names = [os.fspath(one) for one in (results, other) if one is not None]
    data = [found_in.results_for_window(name, severity, within) for name in names]
    found: Answer
    interrupted, answered = False, None
    if trials and other is not None:
        raise Refusal("trials", "two files", "one, as trials are of one answer")
    if other is None:
        found = regions.find_window(data[0], severity, confidence)
        if trials:
            with reports.reporting(True) as watch:
                found = window_trials.tried(found, data[0], names[0], watch=watch)
            answered = found["answer"]
            interrupted = answered.trials is not None and answered.trials.interrupted
        title = printable(f"{results}: operating window. {found['title']}".rstrip())
        lines = [title, *window_text.lines(found, units, everything)]
        found = found_in.plain_window(found, units)
    else:
        found = found_in.contrast(data[0], data[1], severity, confidence, [os.path.basename(name) for name in names])
        titles = [f"{file}: {one['title']}" for file, one in zip(names, found["windows"], strict=True)]
        lines = [printable(line) for line in contrast_text.contrast_lines(found, units, titles)]
        found = found_in.plain_contrast(found, units)
    print_answer(found, lines, units, json)
    if picture is not None:
        figure = picture_making.draw_windows(data, names, units, severity, confidence, with_text, rates, answered)
        _save(figure, picture, overwrite)
    if interrupted:
        say("Interrupted: the answer has the trials that ended.")
    return interrupt.EXIT_CODE if interrupted else 0


@command_of(
    questions.sensitivity,
    examples=(
        "sensitivity uncertain.h5",
        "sensitivity uncertain.h5 --wob 40kN --rotary-speed 100rpm --picture tornado.png",
        "sensitivity uncertain.h5 --json | jq .measure_first",
    ),
)
def sensitivity(
    given: Given,
    results: ResultsLike,
    severity: Severity = None,
    units: Units = None,
    json: Json = False,
    picture: Annotated[Picture, "Tornado picture to write as well: .png, .pdf or .svg."] = None,
    overwrite: Overwrite = False,
) -> int:
    """Rank the uncertain numbers: which matters most, and which to measure first.

    RESULTS is of a study with the section uncertain. For the safe run, stick-slip,
    lift-off and wall contact it prints the share of the variance that each unknown
    causes by itself (first) and together with the others (total), over all operating
    points or at the chosen ones.
    """
    assert units is not None
    if picture is not None:
        picture_making.claim_picture(picture, overwrite)
    data = found_in.results_for_sensitivity(results, severity, requested_values(given))
    summary = indices.sensitivity(data, severity)
    title = printable(f"{results}: sensitivity. {summary['title']}".rstrip())
    print_answer(summary, [title, *uncertainty_text.sensitivity_lines(summary, units)], units, json)
    if picture is not None:
        _save(picture_making.draw(data, "tornado", units=units, severity=severity), picture, overwrite)
    return 0


def _save(figure: Figure, picture: str, overwrite: bool) -> None:
    picture_making.save_picture(figure, picture, overwrite)
    say(f"{picture}: drawn.")


Progress = Annotated[Reported, "No progress; the summary, warnings and errors only."]


@command_of(
    fits.fit,
    examples=(
        "fit study.yaml --data field.csv",
        "fit study.yaml --data field.csv -o adjusted.yaml --picture fit.png --units field",
        "fit study.yaml --data rig.csv --rename 'TQA=surface_torque' --ignore '*' --skip-gaps",
        "run adjusted.yaml -o out.h5",
    ),
)
def fit(
    given: Given, path: StudyPath = None, picture: PictureOfFit = None, json: Json = False, progress: Progress = True
) -> int:
    """Adjust the unknowns of STUDY, the numbers of its section `uncertain`, to
    measurements.

    Their distributions are the prior. The model is run at the operating points of the
    data for many values of the unknowns, and each is weighed by how well its features
    agree. The summary says which unknowns the data determine and which not; the written
    study has samples that agree with the data.

    With -o, every round is kept in FILE.part until the study is written. After an
    interruption --resume gives the same study as an uninterrupted fit.
    """
    note, units = fits.fit(**given).note, given["units"]
    print_answer(note, uncertainty_text.fit_lines(note, units), units, json)
    if picture is not None:
        say(f"{picture}: drawn.")
    if path is not None:
        say(f"{path}: written. Next: {following(f'run {shlex.quote(str(path))} -o out.h5')}")
    return 0

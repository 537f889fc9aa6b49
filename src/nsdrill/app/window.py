"""The safe operating window, from a results file."""

from __future__ import annotations

import os
from contextlib import suppress
from dataclasses import replace

from nsdrill.analysis.probability import needed
from nsdrill.analysis.window import USES, find_window
from nsdrill.app.check import passed_over
from nsdrill.app.experiment import with_overrides
from nsdrill.data import IN_MEMORY, PASSED_OVER, Answer, Results, json_text, resolved_study
from nsdrill.errors import FileError, InputError, NsdrillError
from nsdrill.store import read_results
from nsdrill.study.study import study_from_resolved
from nsdrill.variables import TRUST


def window(
    source: Results | str | os.PathLike[str], severity: int | None = None, confidence: float | None = None
) -> Answer:
    """The safe operating window of the results, or the results file, ``source`` as
    plain data in SI units. ``severity`` is the greatest one allowed (0 to 4; None: by
    response), ``confidence`` (0 to 1) that of results with samples."""
    return window_of(read_for_window(source, severity), severity, confidence)


def window_of(results: Results, severity: int | None = None, confidence: float | None = None) -> Answer:
    """As :func:`nsdrill.analysis.window.find_window`, with the critical speeds that the
    sweep passes over."""
    return find_window(with_passed_over(results), severity, confidence)


def with_passed_over(results: Results) -> Results:
    """The ``results`` with the critical speeds below the first speed of their sweep
    among the root attributes, for the window in words and as a picture; without any
    where there are none, or where the file has no study of this version."""
    passed: list[Answer] = []
    with suppress(NsdrillError):
        passed = passed_over(study_from_resolved(resolved_study(results.attrs)))
    return replace(results, attrs={**results.attrs, PASSED_OVER: json_text(passed)})


def read_for_window(source: Results | str | os.PathLike[str], severity: int | None = None) -> Results:
    """The results, or the results file, ``source``; of a file only the variables on
    which the window depends are read."""
    if severity is not None and severity not in range(5):
        raise InputError(f"severity: found {severity!r}; allowed: 0 to 4.")
    path = IN_MEMORY if isinstance(source, Results) else source
    results = source if isinstance(source, Results) else read_results(source, [*needed(severity), *USES, *TRUST])
    check_severity(results, severity, path)
    return with_passed_over(with_overrides(results))


def check_severity(results: Results, severity: int | None, path: str | os.PathLike[str]) -> None:
    """FileError where the results lack what a window by ``severity`` needs."""
    if lacking := [name for name in needed(severity) if name not in results.variables]:
        raise FileError(
            f"{path}: found no {' and no '.join(lacking)}, which the first versions of nsdrill "
            f"did not write; allowed: "
            "the window without a severity. Or run the study again."
        )

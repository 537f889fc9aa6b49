"""The Lyapunov spectrum of a point of results: of the motion that goes on from its final
state."""

from __future__ import annotations

import os
from collections.abc import Mapping

import numpy as np

from nsdrill import interrupt
from nsdrill.app.simulating.trajectory import StoredPoint, point_in, seconds_text
from nsdrill.app.telling import Telling
from nsdrill.data import NOT_CARRIED_RUN, Answer, Array, Results, edited_together
from nsdrill.errors import FileError, InputError, Refusal, option
from nsdrill.kernel.settings import LONGEST
from nsdrill.models.base import SMOOTH, Symmetry
from nsdrill.models.choices import word_or_number
from nsdrill.models.own_parts import places_of_parts
from nsdrill.models.parts import values_at
from nsdrill.models.registry import model_named
from nsdrill.models.variant import variant_at
from nsdrill.orbit.flow import Flow, advance, equations_of
from nsdrill.orbit.spectrum import Lost, Spectrum, spectrum
from nsdrill.variables import OK, SAMPLE, end_of_run


def lyapunov_spectrum(
    source: Results | str | os.PathLike[str],
    *,
    at: Mapping[str, float],
    procedure: str | None = None,
    start: int | None = None,
    duration: float | None = None,
    workers: int = 1,
    told: Telling,
) -> Answer:
    """The Lyapunov exponents of the motion that goes on from the final state of the point
    nearest to ``at``, chosen as by :func:`nsdrill.app.simulating.trajectory.replay`, over
    ``duration`` [s], by default the observed time of the study.

    Plain data in SI: where it is (``at``, ``procedure``, ``start``, ``sample``),
    ``exponents`` and their standard ``errors`` [1/s], falling, their ``signs`` in words, their
    ``sum`` [1/s], the ends of the Kaplan-Yorke ``dimension``, ``seconds`` and ``intervals`` of
    the motion, whether the point had ``settled``, and whether its run was ``not_carried``, as
    one before it in its chain failed. InputError where there is no such point, where its run
    failed,
    or where the motion cannot be integrated with its deviations.
    """
    operation = {name: at[name] for name in ("depth", "wob", "rotary_speed") if name in at}
    further = {key: value for key, value in at.items() if key not in operation}
    point = point_in(source, **operation, at=further, procedure=procedure, start=start)
    status = int(point.stored["status"])
    if end_of_run(status) != OK:
        raise FileError(
            f"{point.path}: the run of that point failed, so there is no motion to go on with; allowed: a point that "
            f"was run to its end. nsdrill run {option('retry-failed')} runs failed points again."
        )
    if point.study.ramps:
        raise InputError(
            f"{point.path}: found a ramp in operation.{next(iter(point.study.ramps))}; allowed: a constant value, as "
            "exponents are means over a motion that goes on in one way."
        )
    seconds = float(point.study.simulation.observe if duration is None else duration)
    if not 0.0 < seconds <= LONGEST:
        raise Refusal(
            "duration",
            seconds_text(seconds if duration is None else duration),
            f"more than 0 s and at most {LONGEST:g} s",
        )
    found = _measured(point, seconds, workers, told)
    settled = point.stored.get("settled")
    return {
        "at": {key: word_or_number(key, value) for key, value in point.values.items()},
        "procedure": point.procedure,
        "start": point.start if point.starts else None,
        SAMPLE: point.sample if point.samples else None,
        "exponents": found.exponents.tolist(),
        "errors": found.errors.tolist(),
        "signs": found.signs,
        "sum": found.sum,
        "dimension": list(found.dimension),
        "seconds": found.seconds,
        "intervals": found.intervals,
        "settled": None if settled is None else bool(settled),
        NOT_CARRIED_RUN: point.after_failure,
        **edited_together(point.attrs),
    }


def _measured(point: StoredPoint, seconds: float, workers: int, told: Telling) -> Spectrum:
    """The spectrum of the motion from the final state of the ``point`` on."""
    study, model = point.study, model_named(point.study.model.name)
    variant = variant_at(model, study.parameters)
    values = values_at(study.parameters, study.initial, vars(point.operation))
    if jumping := model.jumping(values, places_of_parts(study.parameters)):
        raise InputError(
            f"{point.path}: found slopes of the model {model.name} that jump at {jumping[0]}; allowed: {SMOOTH}. "
            "Across a jump a deviation is not followed, so that its growth is not known."
        )

    def pack(numbers: Array) -> Array:
        n = len(numbers)
        values = values_at(
            study.parameters, study.initial, {key: np.full(n, one) for key, one in vars(point.operation).items()}
        )
        return model.pack(values, study.thresholds, n)

    flow = Flow(equations_of(variant, Symmetry(1, ()), pack, ()), workers=workers)
    still = model.undeviated(study.parameters)
    final, none = np.asarray(point.stored["final_state"], dtype=float), np.zeros((1, 0))
    task = spectrum(
        final[:-1],
        float(final[-1]),
        none[0],
        seconds,
        flow.state_scales(none)[0],
        float(flow.phase_rate(none)[0]),
        [place for place, name in enumerate(variant.states) if name not in still],
        lambda done: told.goes(f"{100.0 * done:.0f} % of the motion"),
    )
    try:
        return advance(flow, {0: task}, interrupt.check)[0]
    except Lost as lost:
        hint = (
            "; the friction of this study is steep, and record.exponent measures the largest exponent on the implicit "
            "tangent"
            if point.implicit
            else ""
        )
        raise InputError(
            f"{point.path}: {lost.time:.4g} s after the end of its run the motion or a deviation from it could not be "
            f"integrated explicitly to the accuracy that exponents need; allowed: a motion that can{hint}."
        ) from None

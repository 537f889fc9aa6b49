"""What a study plans: its points and chains, and what is kept of each. Imports nothing
that compiles."""

from __future__ import annotations

from typing import Any

from nsdrill.errors import InputError
from nsdrill.models.kept import Kept
from nsdrill.models.leaves import is_apart, parts_of, states_of_all, values_at
from nsdrill.models.registry import described
from nsdrill.study.study import Study
from nsdrill.sweep.method import Chosen
from nsdrill.sweep.plan import Plan


def plan_of(study: Study) -> Plan:
    """The points and chains of a study; one point for a study that sweeps nothing."""
    return Plan(study.axes, study.procedure, study.along, study.initial.starts, study.drawn)


def _derived(model: str) -> tuple[str, ...]:
    """The words of what is made from features, which files of any age need not have."""
    return tuple(dict.fromkeys(one.only for one in described(model).derived if one.only))


def kept_of(study: Study) -> Kept:
    """What is kept of each point of a study."""
    record, model = study.record, described(study.model)
    parts = parts_of(study.model, study.parameters, study.initial, study.axes)
    return Kept(
        record.peaks,
        record.poincare,
        record.exponent,
        study.initial.starts,
        study.simulation.verify,
        study.more,
        states_of_all([model.states(parameters) for parameters, _ in parts]),
        study.model,
        (
            *dict.fromkeys(word for parameters, _ in parts for word in _options(study, parameters)),
            *_derived(study.model),
        ),
        study.samples,
        study.unknowns,
        len(chosen_of(study).words()) > 1,
    )


def _options(study: Study, parameters: Any) -> tuple[str, ...]:
    """What brings features of its own to the points of a part with these
    ``parameters``."""
    unread = getattr(parameters, "unread", ())
    varied = {
        key: values
        for key, values in study.varied.items()
        if not is_apart(study.model, key) and key not in unread
    }
    return described(study.model).options(values_at(parameters, study.initial, varied).parameters)


def chosen_of(study: Study) -> Chosen:
    """Which points of a study are integrated implicitly. InputError where the study
    asks for what its model cannot."""
    check_method(study)
    return Chosen(
        plan_of(study), study.parameters, study.initial, study.model, study.simulation.method
    )


def check_method(study: Study) -> None:
    """InputError where a study asks for friction to be integrated implicitly and its
    model cannot."""
    every = parts_of(study.model, study.parameters, study.initial, study.axes)
    reasons = (described(study.model).explicit_only(parameters) for parameters, _ in every)
    reason = next((one for one in reasons if one is not None), None)
    if study.simulation.method == "implicit" and reason is not None:
        source = study.source or "the study"
        raise InputError(
            f"{source}: simulation.method: found implicit; allowed: auto or explicit, as {reason}."
        )

"""The plan of a study: its points and chains, and the record of each point. Imports no
compiler."""

from __future__ import annotations

from typing import Any

from nsdrill.errors import InputError
from nsdrill.models.description import Description
from nsdrill.models.kept import Kept
from nsdrill.models.leaves import is_compiled_in, parts_of, states_of_all, values_at
from nsdrill.study.study import Study
from nsdrill.sweep.method import Chosen
from nsdrill.sweep.plan import Plan


def plan_of(study: Study) -> Plan:
    """The points and chains of a study; one point for a study without a sweep."""
    return Plan(study.axes, study.procedure, study.along, study.initial.starts, study.drawn)


def _derived(model: Description) -> tuple[str, ...]:
    """The options of the derived variables of a model, which are optional in files."""
    return tuple(dict.fromkeys(one.only for one in model.derived if one.only))


def kept_of(study: Study) -> Kept:
    """The contents of the record of each point of a study."""
    record, model = study.record, study.model
    parts = parts_of(study.model, study.parameters, study.initial, study.axes)
    return Kept(
        record.peaks,
        record.poincare,
        record.exponent,
        study.initial.starts,
        study.simulation.verify,
        study.more,
        states_of_all([model.states(parameters) for parameters, _ in parts]),
        study.model.name,
        (
            *dict.fromkeys(word for parameters, _ in parts for word in _options(study, parameters)),
            *_derived(study.model),
        ),
        study.samples,
        study.unknowns,
        len(chosen_of(study).words()) > 1,
    )


def _options(study: Study, parameters: Any) -> tuple[str, ...]:
    """The options that add features to the points of a part of the study with these
    ``parameters``."""
    unread = getattr(parameters, "unread", ())
    varied = {
        key: values
        for key, values in study.varied.items()
        if not is_compiled_in(study.model, key) and key not in unread
    }
    return study.model.options(values_at(parameters, study.initial, varied).parameters)


def chosen_of(study: Study) -> Chosen:
    """The choice of the method, implicit or explicit, for each point of a study.
    InputError where its model does not support the method of the study."""
    check_method(study)
    return Chosen(plan_of(study), study.parameters, study.initial, study.model, study.simulation.method)


def check_method(study: Study) -> None:
    """InputError where a study requires the implicit integration of friction and its
    model does not support it."""
    parts = parts_of(study.model, study.parameters, study.initial, study.axes)
    reasons = (study.model.explicit_only(parameters) for parameters, _ in parts)
    reason = next((reason for reason in reasons if reason is not None), None)
    if study.simulation.method == "implicit" and reason is not None:
        source = study.source or "the study"
        raise InputError(f"{source}: simulation.method: found implicit; allowed: auto or explicit, as {reason}.")

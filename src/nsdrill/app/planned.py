"""What a study plans: its points and chains, and what is kept of each. Imports nothing that compiles."""

from __future__ import annotations

from nsdrill.errors import InputError
from nsdrill.models.kept import Kept
from nsdrill.models.leaves import values_at
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
    return Kept(
        record.peaks,
        record.poincare,
        record.exponent,
        study.initial.starts,
        study.simulation.verify,
        study.more,
        model.states(study.parameters),
        study.model,
        (*model.options(values_at(study.parameters, study.initial, study.varied).parameters), *_derived(study.model)),
        study.samples,
        study.unknowns,
        len(chosen_of(study).words()) > 1,
    )


def chosen_of(study: Study) -> Chosen:
    """Which points of a study are integrated implicitly. InputError where the study asks for what its model cannot."""
    check_method(study)
    return Chosen(plan_of(study), study.parameters, study.initial, study.model, study.simulation.method)


def check_method(study: Study) -> None:
    """InputError where a study asks for friction to be integrated implicitly and its model cannot."""
    reason = described(study.model).explicit_only(study.parameters)
    if study.simulation.method == "implicit" and reason is not None:
        source = study.source or "the study"
        raise InputError(f"{source}: simulation.method: found implicit; allowed: auto or explicit, as {reason}.")

"""What a study plans: its points and chains, and what is kept of each. Imports nothing that compiles."""

from __future__ import annotations

from nsdrill.models.kept import Kept
from nsdrill.models.leaves import values_at
from nsdrill.models.registry import described
from nsdrill.study.study import Study
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
    )

"""What a study plans: its points and chains, and what is kept of each. Imports nothing that compiles."""

from __future__ import annotations

from dataclasses import replace

from nsdrill.models.christoforou_yigit.options import options_of
from nsdrill.models.leaves import values_at
from nsdrill.study.study import Study
from nsdrill.sweep.plan import Plan
from nsdrill.variables import DRIVEN_STATE_NAMES, STATE_NAMES, Kept


def plan_of(study: Study) -> Plan:
    """The points and chains of a study; one point for a study that sweeps nothing."""
    return Plan(study.axes, study.procedure, study.along, study.initial.starts)


def kept_of(study: Study) -> Kept:
    """What is kept of each point of a study."""
    options = options_of(values_at(study.parameters, study.initial, study.axes).parameters)
    return replace(
        study.record.kept(study.initial.starts),
        verify=study.simulation.verify,
        axes=study.more,
        states=DRIVEN_STATE_NAMES if options.driven else STATE_NAMES,
        stabilized=bool(options.stabilizer),
        inclined=bool(options.weight),
    )

"""What a study plans: its points and chains, and what is kept of each. Imports nothing that compiles."""

from __future__ import annotations

from dataclasses import replace

from nsdrill.study.study import Study
from nsdrill.sweep.plan import Plan
from nsdrill.variables import DRIVEN_STATE_NAMES, STATE_NAMES, Kept


def plan_of(study: Study) -> Plan:
    """The points and chains of a study; one point for a study that sweeps nothing."""
    return Plan(study.axes, study.procedure, study.along, study.initial.starts)


def kept_of(study: Study) -> Kept:
    """What is kept of each point of a study."""
    states = STATE_NAMES if study.parameters.drive.ideal else DRIVEN_STATE_NAMES
    return replace(
        study.record.kept(study.initial.starts), verify=study.simulation.verify, axes=study.more, states=states
    )

"""Equilibria of branches at which the equations bend, so that no linear theory tells whether they
are stable."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from nsdrill.app.following.seeding import ContinuationSetup
from nsdrill.models.bends import bends
from nsdrill.models.own_parts import places_of_parts
from nsdrill.orbit.flow import Flow
from nsdrill.orbit.shooting import Orbit
from nsdrill.script.function_model import FunctionModel


def bending_of(setup: ContinuationSetup, flow: Flow) -> Callable[[Orbit], bool]:
    """Whether the equations bend at an equilibrium of a continuation. Those of nsdrill alone are
    taken as they are."""
    if not isinstance(setup.model, FunctionModel) and not places_of_parts(setup.study.parameters):
        return lambda orbit: False
    known: dict[bytes, bool] = {}

    def is_bent(orbit: Orbit) -> bool:
        key = orbit.state.tobytes() + orbit.values.tobytes()
        if key not in known:
            values = orbit.values[None]
            table = setup.model.pack(setup.values(values, (setup.continuation.along,)), setup.study.thresholds)
            columns = {name: np.asarray(column)[0] for name, column in setup.variant.by_name(table).items()}
            known[key] = bends(setup.variant.motion, columns, orbit.state, flow.state_scales(values)[0])
        return known[key]

    return is_bent

"""What is continued: a study, the numbers that are free, and the equations of their
motions."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from nsdrill.data import Array, value_at
from nsdrill.errors import InputError
from nsdrill.models.base import Model, Symmetry, Variant
from nsdrill.models.leaves import OPERATION, Values, as_value, values_at
from nsdrill.orbit.flow import Flow, equations_of
from nsdrill.study.continuation import Continuation
from nsdrill.study.study import Study
from nsdrill.variables import dimension_of

RANGE_PARTS = 10  # the range of a continued number over its natural scale


@dataclass(frozen=True)
class ContinuationSetup:
    """The inputs of a continuation: the study, its section ``continue``, the model, and
    the options and symmetry that are compiled in."""

    study: Study
    continuation: Continuation
    model: Model
    variant: Variant
    symmetry: Symmetry

    def values(self, numbers: Array, keys: tuple[str, ...]) -> Values:
        """The values of n points at ``numbers`` [n, keys] (SI) of the ``keys``."""
        study = self.study
        fixed = {name: np.full(len(numbers), getattr(study.operation, name)) for name in OPERATION}
        return values_at(study.parameters, study.initial, fixed | dict(zip(keys, numbers.T, strict=True)))

    def flow(self, keys: tuple[str, ...], scales: tuple[float, ...], workers: int, without: str = "") -> Flow:
        """The flow in which the numbers at ``keys``, with these natural ``scales``, are
        free; ``without`` names a contact to leave out where the model supports it."""

        def pack(numbers: Array) -> Array:
            with np.errstate(invalid="ignore"):  # Newton's method may leave the range of a number
                table = self.model.pack(self.values(numbers, keys), self.study.thresholds)
            released = self.model.released(table, without) if without else None
            return table if released is None else released

        return Flow(equations_of(self.model, self.variant, self.symmetry, pack, scales), workers=workers)


def continuation_setup(study: Study) -> ContinuationSetup:
    """The setup of the continuation of ``study``; InputError where it cannot be
    continued."""
    source = study.source or "the study"
    continuation = study.continuation
    if continuation is None:
        raise InputError(
            f"{source}: found no section continue; allowed: one that says what is followed, as "
            "continue: {along: rotary_speed, from: 2 rad/s, to: 8 rad/s}."
        )
    if study.ramped:
        raise InputError(
            f"{source}: found a ramp in operation.{study.ramped[0]}; allowed: a constant value, of which motions can "
            "repeat."
        )
    model = study.model.dynamics
    if model.switches(study.parameters) is not None:
        raise InputError(f"{source}: found drive.on_at; allowed: nothing that is switched on within the run.")
    ranges = _ranges(study, continuation)
    structures = []
    for corner in product(*ranges.values()):
        operation = {name: getattr(study.operation, name) for name in OPERATION}
        values = values_at(study.parameters, study.initial, operation | dict(zip(ranges, corner, strict=True)))
        try:
            structures.append((model.variant(values.parameters), model.symmetry(values)))
        except NotImplementedError:
            raise InputError(
                f"{source}: found the model {study.model.name}, which does not say how its motions repeat, or has no "
                "linearised equations; allowed: a model that does, as christoforou_yigit, torsion or beam. A sweep "
                "up and down (sweep.procedure: up-down) follows the stable motions of any model."
            ) from None
    if any(structure != structures[0] for structure in structures):
        raise InputError(
            f"{source}: found a range of {' and '.join(ranges)} at whose ends the equations have different "
            "symmetries, such as a hole that is vertical at one end and inclined at the other, or lobes of no "
            "height at one end; allowed: a range that leaves such an end out."
        )
    if structures[0][1].folds and {*continuation.motions} == {"stick_slip"}:
        raise InputError(
            f"{source}: continue.motions: found stick_slip alone, over lobes; allowed: a smooth rock, on which "
            "stick-slip is a cycle, or other motions. Over lobes it is a torus that is not followed: a sweep up and "
            "down (sweep.procedure: up-down) tells where it is stable."
        )
    return ContinuationSetup(study, continuation, model, *structures[0])


def _ranges(study: Study, continuation: Continuation) -> dict[str, tuple[float, float]]:
    """The ranges of the numbers that are free, by key; InputError where curves do not
    set out from the study's own value."""
    ranges = {continuation.along: (continuation.low, continuation.high)}
    if (curves := continuation.curves) is not None:
        start = number_of(study, dimension_of(curves.over))
        if not curves.low <= start <= curves.high:
            raise InputError(
                f"{study.source or 'the study'}: continue.curves: found {curves.over} from {curves.low:g} to "
                f"{curves.high:g} (SI); allowed: a range that has the study's own value, {start:g}, from where the "
                "curves set out."
            )
        ranges[curves.over] = (curves.low, curves.high)
    return ranges


def number_of(study: Study, name: str) -> float:
    """The value in the study [SI] along the axis whose dimension has this name."""
    if name in OPERATION:
        return float(getattr(study.operation, name))
    key = next(key for key in study.keys.axes if dimension_of(key) == name)
    return as_value(key, value_at(study.resolved, key))

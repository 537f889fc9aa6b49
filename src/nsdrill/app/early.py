"""Where stick-slip of results ends earlier than torsion alone explains, and what in their
study may be the reason."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from functools import cache
from typing import Any

from nsdrill.analysis.early import SPEED, ends_early
from nsdrill.app.check import checks_of
from nsdrill.data import Answer, Results, frozen_modes, resolved_study
from nsdrill.errors import NsdrillError
from nsdrill.models.leaves import Values, values_at
from nsdrill.models.registry import model_in
from nsdrill.study.study import study_from_resolved


def stick_slip_ends(results: Results) -> list[Answer]:
    """The settings of :func:`nsdrill.analysis.early.ends_early`, each with the values
    ``at`` which it is along the swept axes, the ``surface_amplitude`` of the lobes, 0
    where they do not move the bit, with its units, and whether the string turns ``only``.
    Empty where the model has no estimate of where stick-slip ends, or the file has no
    study of this version."""
    keys = {axis.name: axis.key for axis in results.more}

    @cache
    def study() -> Any:
        return study_from_resolved(resolved_study(results.attrs))

    def values(at: Mapping[str, float]) -> Values:
        # the estimate takes the depth of cut at the speed that it gives
        there = {keys.get(name, name): value for name, value in at.items()} | {SPEED: float(results.coords[SPEED][0])}
        return values_at(study().parameters, study().initial, there)

    def fold(at: Mapping[str, float], above: float) -> float | None:
        estimate = getattr(checks_of(study().model), "stick_slip_fold", None)
        return None if estimate is None else estimate(values(at), above)

    # the motions beside torsion that the string has
    motions = {"axial": "lift_off_fraction", "lateral": "wall_contact_fraction"}
    features = {feature.name for feature in model_in(results.attrs).features}
    others = [name for name, one in motions.items() if one in features and name not in frozen_modes(results.attrs)]
    found: list[Answer] = []
    with suppress(NsdrillError):
        found = ends_early(results, fold)
        for one in found:
            at = one.pop("all")
            parameters: Any = values(at).parameters
            modes = getattr(parameters, "modes", None)
            moves = modes is None or modes.axial == "free"
            height = float(getattr(parameters.bit, "surface_amplitude", 0.0)) if moves else 0.0
            one["at"] = {name: value for name, value in at.items() if name in results.swept}
            one["only"] = not others
            one["surface_amplitude"] = {"value": height, "units": "m"}
    return found

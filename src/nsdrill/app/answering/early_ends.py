"""Where stick-slip of results ends earlier than torsion alone explains, with what in their
study may be the reason."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import cache
from math import isinf, isnan
from typing import Any

from nsdrill.analysis.early_end import SPEED, ends_early
from nsdrill.app.answering.kept import kept
from nsdrill.data import Answer, Results, resolved_study
from nsdrill.errors import NsdrillError
from nsdrill.late import deferred
from nsdrill.models.dry import by_dry
from nsdrill.models.numbers import FOLD_ERROR
from nsdrill.models.operation import Values
from nsdrill.models.parts import values_at
from nsdrill.study.study import study_from_resolved

with deferred():  # what is kept of an answer before
    from nsdrill.app import check as checking


def stick_slip_ends(results: Results) -> list[Answer]:
    """The settings of :func:`nsdrill.analysis.early_end.ends_early`, each with the values
    ``at`` which it is along the swept axes, the number of ``lobes`` and their
    ``surface_amplitude`` with its units, both 0 where they do not move the bit: there only
    those that are followed by a free point; and the ``dry`` end, null at no speed, where torsion alone keeps
    it to a higher one by dry friction.
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

    def folds(settings: Sequence[Mapping[str, float]]) -> list[float | None]:
        return kept("folds", results, settings, lambda: estimated(settings)) if settings else []

    def estimated(settings: Sequence[Mapping[str, float]]) -> list[float | None]:
        estimates: Any = getattr(checking.checks_of(study().model), "stick_slip_folds", None)
        return [None] * len(settings) if estimates is None else estimates([values(at) for at in settings])

    def dry_ends(settings: Sequence[Mapping[str, float]]) -> list[float | None]:
        return kept("dry_folds", results, settings, lambda: estimated_dry(settings)) if settings else []

    def estimated_dry(settings: Sequence[Mapping[str, float]]) -> list[float | None]:
        """As a map is graded by them, None where they are not known."""
        estimates: Any = getattr(checking.checks_of(study().model), "stick_slip_folds", None)
        if estimates is None:
            return [None] * len(settings)
        _, found = by_dry(estimates, [values(at) for at in settings])
        return [None if one is None or isnan(one) else FOLD_ERROR * one for one in found]

    found: list[Answer] = []
    with suppress(NsdrillError):
        found = ends_early(results, folds)
        places = [one.pop("all") for one in found]
        for one, at, dry in zip(found, places, dry_ends(places), strict=True):
            if dry is not None and not dry <= one["alone"]["value"][1]:
                one["dry"] = {"value": None if isinf(dry) else dry, "units": "rad/s"}
            parameters: Any = values(at).parameters
            modes = getattr(parameters, "modes", None)
            lobed = "bit.surface_amplitude" not in getattr(parameters, "unread", ())
            moves = lobed and (modes is None or modes.axial == "free")
            height = float(getattr(parameters.bit, "surface_amplitude", 0.0)) if moves else 0.0
            one["at"] = {name: value for name, value in at.items() if name in results.swept}
            one["lobes"] = int(parameters.bit.lobes) if height > 0.0 else 0
            one["surface_amplitude"] = {"value": height, "units": "m"}
    # to whirl it gives way on a smooth rock as well, which is no riddle
    return [one for one in found if one["free"] or one["lobes"]]

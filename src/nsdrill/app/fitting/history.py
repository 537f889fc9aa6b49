"""Whether what a well does at the points of a fit may depend on how it came there."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from nsdrill.analysis.early_end import SPEED
from nsdrill.app.check import sticking_limits
from nsdrill.data import Answer, Array, evenly_spaced
from nsdrill.models.parts import values_at

if TYPE_CHECKING:
    from nsdrill.analysis.fitting import Measured
    from nsdrill.study.study import Study

MOST_POINTS, MOST_SAMPLES = 12, 16  # at which it is asked; each takes some 30 ms
LEAST_SHARE = 0.05  # of the samples, at one point, from which it counts


def two_motions(study: Study, measured: Measured, unknowns: Mapping[str, Array]) -> Answer | None:
    """At how many of the measured ``points``, ``of`` those that were asked, steady drilling is stable and stick-slip
    may last as well, by the checks of the model, in which ``share`` of samples of the ``unknowns`` [samples] where
    that is greatest. A well that came there another way than the runs of a fit, which begin as the study does, may
    have been in the other motion. None where both are possible nowhere, or the checks do not tell it."""
    limits = sticking_limits(study.model)
    if limits is None:
        return None
    own = {name: np.full(measured.points, float(value)) for name, value in vars(study.operation).items()}
    table = own | dict(measured.at)
    _, first = np.unique(np.column_stack([*table.values()]), axis=0, return_index=True)
    points = evenly_spaced(first.tolist(), MOST_POINTS)
    count = min(len(next(iter(unknowns.values()))), MOST_SAMPLES)
    settings = [
        {key: float(values[point]) for key, values in table.items()}
        | {key.removeprefix("operation."): float(values[sample]) for key, values in unknowns.items()}
        for point in points
        for sample in range(count)
    ]
    found = limits([values_at(study.parameters, study.initial, at) for at in settings])
    both = [
        ends is not None and ends[1] is not None and ends[0] < at[SPEED] <= ends[1]
        for ends, at in zip(found, settings, strict=True)
    ]
    shares = np.reshape(both, (len(points), count)).mean(axis=1)
    several = int(np.count_nonzero(shares >= LEAST_SHARE))
    return {"points": several, "of": len(points), "share": float(shares.max())} if several else None

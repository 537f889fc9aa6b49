"""How probable each answer is, from results with samples of uncertain numbers: as a
Dataset, and row by row."""

from __future__ import annotations

from typing import Any

import numpy as np

from nsdrill.analysis.probability import EVERY, SAFE, Chances, chances
from nsdrill.data import Results
from nsdrill.models.leaves import as_told
from nsdrill.models.registry import model_in
from nsdrill.store.layout import coordinate_attributes, stored_coordinate


def dataset(results: Results, severity: int | None = None) -> Any:
    """The Dataset of :func:`nsdrill.api.probability`."""
    import xarray

    found = _chances(results, severity)
    low, high = found.interval
    dims = ("history", "outcome", *results.axes)
    told = {
        "probability": (found.share, "part of the samples"),
        "low": (low, "lower end of the 95 % interval of the probability"),
        "high": (high, "upper end of the 95 % interval of the probability"),
    }
    data = {
        name: (dims, values, {"long_name": words, "units": "1"})
        for name, (values, words) in told.items()
    }
    unsure = found.open / found.total
    data["unknown"] = (
        ("history", *results.axes),
        unsure,
        {
            "long_name": "part of the samples of which a failed run leaves open whether they are "
            "safe",
            "units": "1",
        },
    )
    further = {axis.name: axis for axis in results.more}
    axes = {
        name: (
            (name,),
            stored_coordinate(name, results.coords[name]),
            coordinate_attributes(name, further.get(name)),
        )
        for name in results.axes
    }
    words = {
        "history": "procedure; every: safe in all of them, a response in any",
        "outcome": "safe: ended well without a critical response; or the response that is there",
    }
    coords = {
        "history": ("history", list(found.histories), {"long_name": words["history"]}),
        "outcome": ("outcome", list(found.outcomes), {"long_name": words["outcome"]}),
        **axes,
    }
    attrs = {"title": str(results.attrs.get("title") or ""), "samples": found.total}
    made = xarray.Dataset(data, coords, attrs)
    return made.squeeze([name for name in ("history", *results.axes) if made.sizes[name] == 1])


def rows(results: Results) -> list[dict[str, Any]]:
    """One row for each operating point, and for each procedure and for all of them
    where there are several: the axes in SI, and of each outcome the ``probability`` and
    the ends ``low`` and ``high`` of its 95 % interval."""
    found = _chances(results, None)
    share, (low, high) = found.share, found.interval
    made = []
    for number, history in enumerate(found.histories):
        for place in np.ndindex(*share.shape[2:]):
            at = {
                axis: as_told(axis, float(results.coords[axis][i]))
                for axis, i in zip(results.axes, place, strict=True)
            }
            row: dict[str, Any] = {**at, "history": history}
            for which, outcome in enumerate(found.outcomes):
                cell = (number, which, *place)
                row[outcome] = {
                    "probability": float(share[cell]),
                    "low": float(low[cell]),
                    "high": float(high[cell]),
                }
            made.append(row)
    return made


def _chances(results: Results, severity: int | None) -> Chances:
    return chances(results, severity, model_in(results.attrs).responses)


__all__ = ["EVERY", "SAFE", "dataset", "rows"]

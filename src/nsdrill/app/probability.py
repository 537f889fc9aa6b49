"""The probability of each outcome, from results with samples of uncertain numbers: as a
Dataset, and row by row."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from nsdrill.analysis.probability import EVERY, SAFE, Probabilities, probabilities_of
from nsdrill.data import Answer, Results
from nsdrill.models.leaves import word_or_number
from nsdrill.models.registry import model_in
from nsdrill.store.layout import coordinate_attributes, in_words

if TYPE_CHECKING:
    from xarray import Dataset


def dataset(results: Results, severity: int | None = None) -> Dataset:
    """The Dataset of :func:`nsdrill.api.probability`."""
    import xarray

    estimates = _probabilities(results, severity)
    low, high = estimates.interval
    dims = ("history", "outcome", *results.axes)
    variables = {
        "probability": (estimates.share, "part of the samples"),
        "low": (low, "lower end of the 95 % interval of the probability"),
        "high": (high, "upper end of the 95 % interval of the probability"),
    }
    data = {name: (dims, values, {"long_name": words, "units": "1"}) for name, (values, words) in variables.items()}
    unknown = estimates.open / estimates.total
    data["unknown"] = (
        ("history", *results.axes),
        unknown,
        {"long_name": "part of the samples of which a failed run leaves open whether they are safe", "units": "1"},
    )
    further = {axis.name: axis for axis in results.more}
    axes = {
        name: ((name,), in_words(name, results.coords[name]), coordinate_attributes(name, further.get(name)))
        for name in results.axes
    }
    words = {
        "history": "procedure; every: safe in all of them, a response in any",
        "outcome": "safe: ended well without a critical response; or the response that is there",
    }
    coords = {
        "history": ("history", list(estimates.histories), {"long_name": words["history"]}),
        "outcome": ("outcome", list(estimates.outcomes), {"long_name": words["outcome"]}),
        **axes,
    }
    attrs = {"title": str(results.attrs.get("title") or ""), "samples": estimates.total}
    result = xarray.Dataset(data, coords, attrs)
    return result.squeeze([name for name in ("history", *results.axes) if result.sizes[name] == 1])


def rows(results: Results) -> list[Answer]:
    """One row for each operating point, and for each procedure and for all of them
    where there are several: the axes in SI, and of each outcome the ``probability`` and
    the ends ``low`` and ``high`` of its 95 % interval."""
    estimates = _probabilities(results, None)
    share, (low, high) = estimates.share, estimates.interval
    table = []
    for number, history in enumerate(estimates.histories):
        for place in np.ndindex(*share.shape[2:]):
            values = {
                axis: word_or_number(axis, float(results.coords[axis][i]))
                for axis, i in zip(results.axes, place, strict=True)
            }
            row: Answer = {**values, "history": history}
            for which, outcome in enumerate(estimates.outcomes):
                cell = (number, which, *place)
                row[outcome] = {"probability": float(share[cell]), "low": float(low[cell]), "high": float(high[cell])}
            table.append(row)
    return table


def _probabilities(results: Results, severity: int | None) -> Probabilities:
    return probabilities_of(results, severity, model_in(results.attrs).responses)


__all__ = ["EVERY", "SAFE", "dataset", "rows"]

"""Results in memory as a source of points, to write them to a file."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from nsdrill.data import Array, Results
from nsdrill.errors import FileError
from nsdrill.models.registry import model_in
from nsdrill.store.read import kept_of
from nsdrill.store.records import pending_records, recorded


class ResultsSource:
    """The points of ``results`` as a :class:`nsdrill.store.Source`, for
    :func:`nsdrill.store.write_results`. FileError where variables are missing."""

    def __init__(self, results: Results) -> None:
        self.kept = kept_of(
            results.coords, results.more, results.variables, model_in(results.attrs).name, results.drawn
        )
        required = {variable.name for variable in recorded(self.kept)}
        if odd := sorted(required ^ set(results.variables)):
            raise FileError(
                f"these results are a part of a file only: {', '.join(odd)} missing, or without "
                f"what goes "
                "with it. Give all that the run made."
            )
        self.header: dict[str, Any] = {
            "coords": {name: results.coords[name] for name in results.grid}
            | {unknown.name: values for unknown, values in results.drawn.items()},
            "attrs": dict(results.attrs),
        }
        self.n_points = math.prod(results.shape)
        self._rows = {
            name: np.reshape(values, (self.n_points, *values.shape[len(results.shape) :]))
            for name, values in results.variables.items()
        }

    def read(self, start: int, stop: int) -> Array:
        """Records [stop - start] of the points from ``start``."""
        records = pending_records(stop - start, self.kept)
        for name, values in self._rows.items():
            records[name] = values[start:stop]
        return records

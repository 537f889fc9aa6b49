"""``data.nsdrill``: what an xarray Dataset of results is asked most often, without the
bits in which its variables keep it.

xarray knows the name once a function of nsdrill has given a Dataset, or after ``import
nsdrill.accessor``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from xarray import DataArray, Dataset, register_dataset_accessor

from nsdrill import api
from nsdrill.analysis.probability import SEVERITIES
from nsdrill.errors import InputError
from nsdrill.models.responses import BIT_BOUNCE, STICK_SLIP, WHIRL
from nsdrill.observe.motion import CHECK_FAILED, RESPONSE_DIFFERS, verdict
from nsdrill.operations.arguments import GRADES
from nsdrill.variables import INFERRED, OK, TRUST

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@register_dataset_accessor("nsdrill")
class Accessor:
    """What a Dataset of results says of each run: arrays of bool over procedure, axes
    and start or sample, as its variables.

    A run that failed, or has not been made, shows none of the responses and is not
    safe: its ``status`` says so.

    Examples
    --------
    >>> results = nsdrill.open_results("out.h5")
    >>> up = results.nsdrill.bouncing.sel(procedure="up").squeeze()
    >>> up.dims
    ('rotary_speed',)
    >>> bool(results.nsdrill.safe().all())
    False
    """

    def __init__(self, data: Dataset) -> None:
        self._data = data

    @property
    def bouncing(self) -> DataArray:
        """Where the bit bounces: it leaves the rock (bit-bounce)."""
        return self._shows(BIT_BOUNCE, "the bit bounces")

    @property
    def sticking(self) -> DataArray:
        """Where the bit sticks and slips, by the thresholds of the file."""
        return self._shows(STICK_SLIP, "the bit sticks and slips")

    @property
    def whirling(self) -> DataArray:
        """Where the collar whirls, by the thresholds of the file."""
        return self._shows(WHIRL, "the collar whirls")

    def safe(self, severity: int | None = None) -> DataArray:
        """Where a run is safe: it ended well, without a critical response, and no check of
        it gave another one.

        Parameters
        ----------
        severity : int, optional
            0 to 4: safe is a run none of whose severities exceeds this one, whatever its
            response.

        Returns
        -------
        DataArray
            Of bool, over procedure, axes and start or sample. The window of
            :func:`window` is where ``all("procedure")`` of it is true.

        Raises
        ------
        InputError
            For another severity, or results of a model without severities.

        Examples
        --------
        >>> results = nsdrill.open_results("out.h5")
        >>> whatever_the_history = results.nsdrill.safe(severity=2).all("procedure")
        >>> whatever_the_history.sizes["rotary_speed"]
        5
        """
        trusted = self._variable("status") == INFERRED  # the runs around it were checked
        if "trusted" in self._data:
            found = verdict({name: self._data[name].values for name in ("response", *TRUST)})
            trusted = trusted | ~np.isin(found, (RESPONSE_DIFFERS, CHECK_FAILED))
        else:
            trusted = trusted | True
        if severity is None:
            return _named(self._shows(None, "") & trusted, "the run is safe")
        GRADES.check("severity", severity)
        safe = trusted & (self._variable("status") == OK)
        graded = [name for name in SEVERITIES if name in self._data]
        if not graded:
            raise InputError("severity: found results without severities; allowed: None, for the responses.")
        for name in graded:
            safe = safe & (self._data[name] <= severity)
        return _named(safe, f"no severity of the run exceeds {severity}")

    def plot(self, kind: str | None = None, **options: Any) -> Figure:
        """Draw the results.

        Parameters
        ----------
        kind : str, optional
            As in :func:`plot`, as are all ``options``.

        Returns
        -------
        matplotlib.figure.Figure

        Raises
        ------
        InputError
            Where the kind, or an option, does not fit.

        Examples
        --------
        >>> figure = nsdrill.open_results("out.h5").nsdrill.plot("window")
        """
        return api.plot(self._data, kind, **options)

    def _shows(self, bit: int | None, words: str) -> DataArray:
        """Where the response of a run is known and has this bit; None: has none."""
        response = self._variable("response")
        found = response == 0 if bit is None else (response & bit) > 0
        return _named(found & self._variable("status").isin((OK, INFERRED)), words)

    def _variable(self, name: str) -> DataArray:
        if name not in self._data:
            raise InputError(
                f"data.nsdrill: found a Dataset without {name}; allowed: results of a sweep, as "
                f"run and open_results give them."
            )
        return self._data[name]


def _named(found: DataArray, words: str) -> DataArray:
    # of the variables from which it was found, not of this one
    return found.rename(None).drop_attrs(deep=False).assign_attrs(long_name=f"whether {words}")

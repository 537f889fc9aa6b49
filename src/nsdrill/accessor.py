"""``data.nsdrill``: what an xarray Dataset of results is asked most often, without the
bits in which its variables keep it.

xarray knows the name once a function of nsdrill has given a Dataset, or after ``import
nsdrill.accessor``.
"""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np
from xarray import DataArray, Dataset, register_dataset_accessor

from nsdrill import api
from nsdrill.analysis.counts import AFTER_FAILURE, TOP_SPEED, TURNED, after_failure, is_off_speed
from nsdrill.analysis.planes import UNJUDGED
from nsdrill.analysis.safety import unseen_responses
from nsdrill.analysis.unstable import FOLLOWED, resting, unstable_in
from nsdrill.data import Results, resolved_study
from nsdrill.errors import InputError, count
from nsdrill.models.registry import model_in
from nsdrill.models.responses import ungraded
from nsdrill.observe.motion_kinds import CHECK_FAILED, RESPONSE_DIFFERS, verdict
from nsdrill.operations.arguments import GRADES
from nsdrill.variables import INFERRED, OK, PENDING, TRUST, dimension_of, has_failed

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# the properties that show each response of a drill string
PARTICIPLES = {"bit_bounce": "bouncing", "stick_slip": "sticking", "whirl": "whirling", "stalled": "stalled"}


@register_dataset_accessor("nsdrill")
class Accessor:
    """What a Dataset of results says of each run: arrays over procedure, axes and start or
    sample, as its variables.

    The response of a run that failed, has not been made, or has features that are no
    numbers is not known. A response, as ``bouncing``, is an array of bool where all runs
    are known; else it has 1, 0 and NaN where it is not known, as other values that are
    missing in xarray: its mean is the share among the known runs, and it is compared by
    ``== 1``. One that the model does not have, or that is of a frozen motion, is NaN
    everywhere. ``safe`` is always of bool: a run that is not known is not safe. ``known``
    tells the known runs from the others.

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

    def __repr__(self) -> str:
        if not {"response", "status"} <= {*self._data.data_vars}:
            return "nsdrill: a Dataset without the responses of a sweep; plot(kind) draws it"
        status = self._variable("status")
        over = ", ".join(f"{name} ({length})" for name, length in status.sizes.items())
        model = model_in(self._data.attrs)
        unseen = unseen_responses(self._data.attrs)
        shown = {
            word: self._shows(name, "")
            for name, word in PARTICIPLES.items()
            if name in model.critical and name not in unseen
        }
        shown |= {f"shows({name!r})": self.shows(name) for name, one in model.critical.items() if one.is_own}
        rows = [f"  {name:10s}{int(found.sum()):8d}" for name, found in {**shown, "safe()": self.safe()}.items()]
        rows += [f"  {PARTICIPLES[name]:10s}not known: {why}" for name, why in unseen.items()]
        if unknown := int(status.size) - int(self._is_known().sum()):
            rows.append(f"  {'not known':10s}{unknown:8d}: {self._why_unknown()}")
        return "\n".join([f"nsdrill: {count(int(status.size), 'run')}{f' over {over}' if over else ''}", *rows])

    def _repr_html_(self) -> str:
        return f"<pre>{escape(repr(self))}</pre>"

    @property
    def bouncing(self) -> DataArray:
        """Where the bit bounces: it leaves the rock (bit-bounce)."""
        return self._shows("bit_bounce", "the bit bounces")

    @property
    def sticking(self) -> DataArray:
        """Where the bit sticks and slips, by the thresholds of the file."""
        return self._shows("stick_slip", "the bit sticks and slips")

    @property
    def whirling(self) -> DataArray:
        """Where the collar whirls, by the thresholds of the file."""
        return self._shows("whirl", "the collar whirls")

    @property
    def stalled(self) -> DataArray:
        """Where the bit is stalled: it stays stuck, and shows none of the other
        responses."""
        return self._shows("stalled", "the bit is stalled")

    def shows(self, response: str) -> DataArray:
        """Where a run shows the critical response of this name, by the thresholds of the
        file.

        Parameters
        ----------
        response : str
            One of those of the model: ``"stick_slip"``.

        Returns
        -------
        DataArray
            As of :attr:`sticking`.

        Raises
        ------
        InputError
            Where the model has no such response.

        Examples
        --------
        >>> sticks = nsdrill.open_results("out.h5").nsdrill.shows("stick_slip")
        """
        found = model_in(self._data.attrs).critical
        if response not in found:
            allowed = ", ".join(found) or "none, as the model defines no response"
            raise InputError(f"response: found {response!r}; allowed: {allowed}.")
        return self._shows(response, f"the run shows {found[response].words}")

    @property
    def known(self) -> DataArray:
        """Where the response of a run is known: it ended well, or was inferred from the runs
        around it. Not where it failed, has not been made, or comes after a failed one in
        a chain, from which nothing was carried to it; nor where it shows nothing and its
        drive is off its speed or its motion unstable, nor of a model without responses."""
        return _named(self._is_known(), "the response of the run is known")

    def safe(self, severity: int | None = None) -> DataArray:
        """Where a run is known to be safe: it ended well, without a critical response, and no
        check of it gave another one. A run that is not :attr:`known` is not.

        Parameters
        ----------
        severity : int, optional
            0 to 4: safe is a run none of whose severities exceeds this one, whatever its
            response; but a stalled one never is.

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
        status = self._status()
        trusted = status == INFERRED  # the runs around it were checked
        if "trusted" in self._data:
            values = {name: self._data[name].values for name in ("response", *TRUST)}
            found = verdict(values | {name: self._status(name).values for name in TRUST if name.endswith("status")})
            trusted = trusted | ~np.isin(found, (RESPONSE_DIFFERS, CHECK_FAILED))
        else:
            trusted = trusted | True
        if severity is None:
            return _named((self._variable("response") == 0) & self._is_known() & trusted, "the run is safe")
        GRADES.read("severity", severity)
        safe = trusted & self._is_known() & (status == OK)
        model = model_in(self._data.attrs)
        safe = safe & (self._variable("response") & ungraded(model.critical.values()) == 0)
        graded = [name for name in model.severities if name in self._data]
        if not graded:
            raise InputError("severity: found results without severities; allowed: None, for the responses.")
        for name in graded:
            safe = safe & (self._data[name] <= severity)
        others = [one.absence for one in model.critical.values() if one.severity is None]
        words = "".join(", and the bit is not stalled" if one == "not stalled" else f", and {one}" for one in others)
        return _named(safe, f"no severity of the run exceeds {severity}{words}")

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

    def _status(self, name: str = "status") -> DataArray:
        """How the runs, or one of their checks, ended, as far as their features say what
        they showed."""
        status, model, prefix = self._variable(name), model_in(self._data.attrs), name.removesuffix("status")
        there = [prefix + feature for feature in model.status_features if prefix + feature in self._data]
        features = {one: self._data[one].transpose(*status.dims).values for one in there}
        return status.copy(data=model.status_of(status.values, features, prefix))

    def _why_unknown(self) -> str:
        """Why responses are not known, of those reasons that there are."""
        status, is_known = self._status(), self._is_known()
        if not model_in(self._data.attrs).critical:
            return UNJUDGED
        ended, off, leaves = status.isin((OK, INFERRED)), self._off_speed(), self._is_unstable()
        causes = {
            "failed": has_failed(status),
            "not run yet": status == PENDING,
            "not carried": self._after_failure() & ended,
            "off speed": off & ~is_known,
            "an unstable motion": leaves & ~is_known,
        }
        return ", ".join(word for word, found in causes.items() if bool(found.any()))

    def _shows(self, name: str, words: str) -> DataArray:
        """Where the response of this ``name`` occurs; of NaN where that is not known, as everywhere of
        one that these results cannot show."""
        response = model_in(self._data.attrs).critical.get(name)
        known, found = self._is_known(), (self._variable("response") & (response.bit if response else 0)) > 0
        known = known & (response is not None and name not in unseen_responses(self._data.attrs))
        return _named(found if bool(known.all()) else found.where(known), words)

    def _is_known(self) -> DataArray:
        status = self._status()
        known = status.isin((OK, INFERRED))
        if "response" in self._data:
            known = known & ~((self._off_speed() | self._is_unstable()) & (self._data["response"] == 0))
        if not model_in(self._data.attrs).critical:  # nothing judges its runs
            known = known & False
        return known & ~self._after_failure()

    def _after_failure(self) -> DataArray:
        """Where a run before it in its chain failed, or was not made."""
        status = self._status()
        if AFTER_FAILURE.name in self._data.coords:
            return self._data[AFTER_FAILURE.name] != 0
        along = resolved_study(self._data.attrs).get("sweep", {}).get("along")
        if "procedure" not in self._data.coords or not along or dimension_of(along) not in status.dims:
            return status.copy(data=np.zeros(status.shape, dtype=bool))
        by_procedure = status if "procedure" in status.dims else status.expand_dims("procedure")
        ordered = by_procedure.transpose("procedure", ...)
        coords = {str(name): np.atleast_1d(self._data[name].values) for name in ordered.dims}
        after = ordered.copy(data=after_failure(Results(coords, {"status": ordered.values}, self._data.attrs)))
        return after if "procedure" in status.dims else after.squeeze("procedure")

    def _off_speed(self) -> DataArray:
        """Where the drive does not turn as it is set, so that a run that shows nothing is not known."""
        status = self._status()
        if any(name not in self._data for name in (*TURNED, "rotary_speed")):
            return status.copy(data=np.zeros(status.shape, dtype=bool))
        return is_off_speed(*(self._data[name] for name in (TOP_SPEED, "rotary_speed", "settled"))) & (status == OK)

    def _is_unstable(self) -> DataArray:
        """Where the motion is one that the slightest disturbance leaves, likewise."""
        status = self._status()
        names = [*FOLLOWED, *resting(model_in(self._data.attrs))]
        there = {name: self._data[name].transpose(*status.dims).values for name in names if name in self._data}
        found = unstable_in(there, self._data.attrs)
        return status.copy(data=np.zeros(status.shape, dtype=bool) if found is None else found) & (status == OK)

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

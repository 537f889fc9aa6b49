"""The type of a variable in a file, the codes of labels and statuses, and the variables
in the files of every model.

The variables of a model are defined in its folder. :mod:`nsdrill.models.model_description`
joins both in one table, which is used by the store, for the labels of exports and
plots, and for the file-format page of the documentation.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import cache
from typing import TYPE_CHECKING, Any

from nsdrill.records import dataclass

if TYPE_CHECKING:
    from numpy.typing import NDArray

AXES = ("depth", "wob", "rotary_speed")
POINT = ("procedure", *AXES)
PROCEDURES = ("same", "up", "down")
_WAYS: dict[str, tuple[str, ...]] = {"up-down": ("up", "down"), "all": ("up", "down", "same")}


def ways_of(procedure: str) -> tuple[str, ...]:
    """How every operating point is reached in a sweep with this ``sweep.procedure``: one
    of :data:`PROCEDURES` or several."""
    return _WAYS.get(procedure, (procedure,))


FORMAT_VERSION = 1
MEASURED_BY_SCRIPT = "measured by a script"  # Variable.only of what older traces of the model lack
NOTEBOOK = "a notebook"  # in place of the name of the script of a model
PACKAGE = "the package "  # before the name of an installed package that is in its place
MODEL = "christoforou_yigit"  # of a study without the key ``model``

PENDING, OK, DIVERGED, STEP_LIMIT, STEP_UNDERFLOW, INFERRED, UNMEASURED = range(7)


def end_of_run(status: int) -> int:
    """How a run with this status ended: an unmeasured one ended well."""
    return OK if status == UNMEASURED else status


def has_failed(status: NDArray[Any]) -> NDArray[Any]:
    """Which runs failed; an array of booleans from an array of statuses."""
    return (status != PENDING) & (status != OK) & (status != INFERRED)


NO_WHIRL, FORWARD, BACKWARD, BACKWARD_ROLLING, IRREGULAR, LOW_SIDE = range(6)
UNDETERMINED, EQUILIBRIUM, PERIODIC, QUASI_PERIODIC, CHAOTIC, UNSETTLED = range(6)


def dimension_of(key: str) -> str:
    """The name of the dimension of an axis by its dotted key."""
    return key.replace(".", "_")


# The names of the values of an operating point, those of the drill strings and of every
# other model that was imported.
OPERATED = {*AXES}


def declare_operated(names: Iterable[str]) -> None:
    """Add the ``names`` of the values of an operating point."""
    OPERATED.update(names)
    short_key.cache_clear()


@cache
def short_key(key: str) -> str:
    """The key of a number among those of axes and unknowns: ``wob`` for
    ``operation.wob``, any other as it is."""
    name = key.removeprefix("operation.")
    return name if name in OPERATED else key


def long_key(name: str) -> str:
    """The dotted key of a name among those of axes and unknowns: ``operation.wob`` for
    ``wob``."""
    return f"operation.{name}" if name in OPERATED else name


@dataclass(frozen=True)
class Axis:
    """A number of the study that a sweep varies: its ``key`` among those of axes, the SI
    ``units`` of its values as a study writes them, and its long name."""

    key: str
    units: str
    long_name: str

    @property
    def name(self) -> str:
        """The name of its dimension."""
        return dimension_of(self.key)


@dataclass(frozen=True)
class Unknown(Axis):
    """A number of the study that is uncertain: each sample has its own value. Its key and
    its name are the whole key, ``operation_wob`` for the weight on bit, as ``wob`` is the value
    in the study."""

    @property
    def short(self) -> str:
        """Its key among those of axes and unknowns: ``wob``."""
        return short_key(self.key)


# The greatest magnitudes of measured values by their units, decades beyond practice.
GREATEST = {
    "1": 1e6, "percent": 1e6, "m": 1e5, "rad s-1": 1e4, "m s-1": 1e3, "m s-2": 1e6, "N": 1e9, "N m": 1e9, "Pa": 1e13,
    "A": 1e6, "s-1": 1e4,
}  # fmt: skip


@dataclass(frozen=True)
class Variable:
    """One variable of a file.

    ``origin`` is ``run`` (bookkeeping), ``feature`` (measured during the run; a new
    classification does not change it), ``label`` (determined from features by the
    classification), ``trust`` (measured by the checks of a point), ``peaks``,
    ``section``, ``states`` or ``trace``. ``units`` are empty if those of its entries
    differ by state. If ``only`` names a part of the contents of a file
    (:class:`nsdrill.models.contents.Contents`) or a state, the variable is present only
    if that is; with ``MEASURED_BY_SCRIPT`` a trace has it only if the script was given when
    it was made. A feature that is an extreme or the mean of a quantity over time names that
    as its ``signal``: what holds of one holds of all features of it. A value below ``low``
    or above ``high`` cannot be measured; ``scale`` is the size from which it is one that
    counts, 1 for a fraction, 0 where it follows from the signal.
    ``label`` stands on pictures, where the long name is too long or field practice
    has a better one. ``measure`` is the declaration by which the observer measures a
    feature (:mod:`nsdrill.observe.channels`), without its name, where the record of the
    feature has it.
    """

    name: str
    dtype: str
    units: str
    long_name: str
    origin: str = "feature"
    dims: tuple[str, ...] = POINT
    flag_values: tuple[int, ...] | None = None
    flag_masks: tuple[int, ...] | None = None
    flag_meanings: str | None = None
    only: str | None = None
    label: str = ""
    measure: Any = None
    signal: str = ""
    low: float = -math.inf
    high: float = math.inf
    scale: float = 0.0

    @property
    def bounds(self) -> tuple[float, float]:
        """The least and the greatest value that can be measured."""
        greatest = GREATEST.get(self.units, 1e12)
        return max(self.low, -greatest), min(self.high, greatest)

    def words(self, value: int) -> str:
        """A flag value in words: ``ok``, or those of several bits with ``+`` between them;
        ``none`` for an empty mask, ``not_judged`` where there is no bit."""
        names = (self.flag_meanings or "").split()
        if self.flag_masks is not None:
            set_bits = "+".join(name for mask, name in zip(self.flag_masks, names, strict=True) if value & mask)
            return set_bits or ("none" if names else "not_judged")
        return dict(zip(self.flag_values or (), names, strict=True)).get(value, str(value))


def flag(name: str, long_name: str, words: str, only: str | None = None) -> Variable:
    """A label whose values 0, 1, 2, ... have these ``words``."""
    values = tuple(range(len(words.split())))
    return Variable(name, "i1", "1", long_name, "label", flag_values=values, flag_meanings=words, only=only)


def feature(name: str, units: str, long_name: str, only: str | None = None, **more: Any) -> Variable:
    """A quantity that is measured during a run; ``more`` are further fields."""
    return Variable(name, "f8", units, long_name, only=only, **more)


def fraction(name: str, long_name: str, only: str | None = None, **more: Any) -> Variable:
    """A fraction of the time."""
    return feature(name, "1", long_name, only, low=0.0, high=1.0, scale=1.0, **more)


def last_peaks(name: str, units: str, long_name: str, *, label: str = "") -> Variable:
    """The last local maxima of a quantity."""
    return Variable(name, "f8", units, long_name, "peaks", (*POINT, "peak"), only="peaks", label=label)


def at_section(name: str, units: str, long_name: str, *, label: str = "") -> Variable:
    """A quantity at the last returns to the Poincare section."""
    return Variable(
        f"section_{name}",
        "f8",
        units,
        f"{long_name} at the Poincare section",
        "section",
        (*POINT, "crossing"),
        only="returns",
        label=label,
    )


def in_trace(name: str, units: str, long_name: str, only: str | None = None, *, label: str = "") -> Variable:
    """A quantity of a trace."""
    return Variable(name, "f8", units, long_name, "trace", ("time",), only=only, label=label)


CHECKS = ("tight", "long")
# The variables from which the verdict on a checked point follows, besides its response.
TRUST = ("trusted", *(f"{check}_{what}" for what in ("response", "status") for check in CHECKS))

OUTRUN = "{}_outrun"  # of a quantity that a script measures: how far it varies faster than the steps
DRIVING = "{}_driving_fraction"  # of a contact with friction of a script: how long it drives in place of braking
DRIVES = "{}_drives"  # of such a contact, in a trace: whether it does, as 1 or 0
CREEP = "{}_creep"  # of a contact with friction of a script: which part of its slip counts as stuck
STEPPED = "{}_stepped_over"  # of a contact of a script: which part of its time lies within single steps
SAMPLE = "sample"
COUNTED = (SAMPLE, "start", "peak", "crossing")  # coordinates that count from 0
COORDINATES: dict[str, tuple[str, str]] = {
    "procedure": ("1", "how the state was chosen: same at every point, carried up, carried down"),
    "depth": ("m", "measured depth"),
    "wob": ("N", "weight on bit"),
    "rotary_speed": ("rad s-1", "rotary speed"),
    "peak": ("1", "peak number, oldest first"),
    "sample": ("1", "number of the sample of the uncertain numbers"),
    "start": ("1", "number of the state from which the run began"),
    "crossing": ("1", "number of the return to the Poincare section, oldest first"),
    "state": ("1", "state name"),
    "time": ("s", "time"),
}

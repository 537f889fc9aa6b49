"""What a results file keeps of each point of a sweep: the variables that results of any
model have, and which of them a file has."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from nsdrill.models.registry import described
from nsdrill.models.responses import label_type
from nsdrill.variables import CHECKS, MODEL, POINT, Axis, Unknown, Variable, feature, flag

if TYPE_CHECKING:
    from nsdrill.models.description import Description

_CHECKED = {"tight": "with a smaller tolerance", "long": "when continued for longer"}
_STATUS = Variable(
    "status",
    "i1",
    "1",
    "how the run ended",
    "run",
    flag_values=(0, 1, 2, 3, 4, 5, 6),
    flag_meanings="pending ok diverged step_limit step_underflow inferred unmeasured",
)
_LABELS = (
    flag("settled", "both halves of the observation agree, and no peaks keep rising", "unsettled settled"),
    flag("motion", "kind of motion", "undetermined equilibrium periodic quasi_periodic chaotic unsettled", "returns"),
    Variable(
        "period",
        "i2",
        "1",
        "period in returns to the Poincare section, 0 where there is none",
        "label",
        only="returns",
        label="Period",
    ),
    Variable(
        "attractor",
        "i2",
        "1",
        "attractor of the start, numbered alike along the axes: 1 has most starts, 0 none",
        "label",
        only="starts",
    ),
)
_MEASURED = (
    feature(
        "half_difference",
        "1",
        "largest disagreement between the halves of the observation",
        label="Disagreement of halves",
    ),
    feature(
        "zero_one",
        "1",
        "0-1 test for chaos on the returns: near 0 regular, near 1 chaotic",
        "returns",
        label="0-1 test $K$",
    ),
    feature("lyapunov_exponent", "s-1", "largest Lyapunov exponent", "exponent", label="Lyapunov exponent"),
    feature("lyapunov_error", "s-1", "standard error of the largest Lyapunov exponent", "exponent"),
    flag("trusted", "both checks find the same response and nearly the same features", "untrusted trusted", "verify"),
)
_RUN = (
    Variable(
        "method",
        "i1",
        "1",
        "how friction was integrated",
        "run",
        flag_values=(0, 1),
        flag_meanings="explicit implicit",
        only="method",
    ),
    Variable("steps", "i8", "1", "accepted steps", "run"),
    Variable("rejected", "i8", "1", "rejected steps", "run"),
)
_STATES = (
    Variable("initial_state", "f8", "", "state at the start of the run", "states", (*POINT, "state")),
    Variable("final_state", "f8", "", "state at the end of the run", "states", (*POINT, "state")),
)


def variables_of(model: Description) -> tuple[Variable, ...]:
    """Every variable of a results file of the ``model``, in its order."""
    return (
        _STATUS,
        _responses(model, "response", "critical responses present"),
        *model.labels,
        *_LABELS,
        *model.features,
        *model.derived,
        *_MEASURED,
        *(variable for check in CHECKS for variable in _check(model, check)),
        *_RUN,
        *model.peaks,
        *model.section,
        *_STATES,
    )


def _responses(model: Description, name: str, long_name: str, only: str | None = None) -> Variable:
    """A label of critical responses, with a bit for each response of the model."""
    found = model.critical.values()
    bits, words = tuple(one.bit for one in found), " ".join(model.critical)
    return Variable(name, label_type(found), "1", long_name, "label", flag_masks=bits, flag_meanings=words, only=only)


def _check(model: Description, name: str) -> tuple[Variable, ...]:
    """The variables of one of the checks of a point."""
    words = _CHECKED[name]
    units = {variable.name: variable.units for variable in model.features}
    return (
        _responses(model, f"{name}_response", f"critical responses {words}", "verify"),
        Variable(
            f"{name}_difference",
            "f8",
            "1",
            f"largest difference of the features {words}, in natural scales",
            "trust",
            only="verify",
        ),
        Variable(
            f"{name}_status",
            "i1",
            "1",
            f"how the run ended {words}",
            "trust",
            flag_values=(0, 1, 2, 3, 4, 6),
            flag_meanings="unchecked ok diverged step_limit step_underflow unmeasured",
            only="verify",
        ),
        *(
            Variable(f"{name}_{one}", "f8", units[one], f"{one} {words}", "trust", only="verify")
            for one in model.check_features
        ),
    )


@dataclass(frozen=True)
class Contents:
    """What is kept of each point beside features and labels.

    ``peaks`` and ``returns`` are the numbers of last maxima and of returns to the
    Poincare section, ``exponent`` says whether the Lyapunov exponent is kept,
    ``verify`` the checks of each point, ``method`` the method by which a point was
    integrated. ``starts`` is the number of states from which each operating point is
    started, 0 for a single one, without a dimension; ``samples`` the number of samples
    of the uncertain ``unknowns``, 0 where no number is uncertain. ``axes`` are those
    beside the ``axes`` of the model, ``states`` the names of the states, () for the
    default ones of the ``model``, ``options`` the words of its options that add
    variables.
    """

    peaks: int = 0
    returns: int = 0
    exponent: bool = False
    starts: int = 0
    verify: bool = False
    axes: tuple[Axis, ...] = ()
    states: tuple[str, ...] = ()
    model: str = MODEL
    options: tuple[str, ...] = ()
    samples: int = 0
    unknowns: tuple[Unknown, ...] = ()
    method: bool = False

    def __post_init__(self) -> None:
        model = described(self.model)
        # Plain data has lists and dicts here.
        object.__setattr__(self, "states", tuple(self.states) or model.state_sets[0])
        axes = tuple(axis if isinstance(axis, Axis) else Axis(**axis) for axis in self.axes)
        object.__setattr__(self, "axes", axes)
        unknowns = tuple(unknown if isinstance(unknown, Unknown) else Unknown(**unknown) for unknown in self.unknowns)
        object.__setattr__(self, "unknowns", unknowns)
        object.__setattr__(self, "options", tuple(self.options))

    @cached_property
    def variables(self) -> tuple[Variable, ...]:
        """The variables that are kept, in the order of a file."""
        return tuple(variable for variable in described(self.model).variables if self.has(variable))

    @cached_property
    def grid(self) -> tuple[str, ...]:
        """The dimensions over which points are numbered, the last fastest."""
        several = (("sample",) if self.samples else ()) + (("start",) if self.starts else ())
        return ("procedure", *described(self.model).axes, *(axis.name for axis in self.axes), *several)

    def dims(self, variable: Variable) -> tuple[str, ...]:
        """The dimensions of ``variable`` in a file."""
        return (*self.grid, *variable.dims[len(POINT) :])

    def has(self, variable: Variable) -> bool:
        """Whether ``variable`` is among what is kept."""
        only = variable.only
        return only is None or only in self.states or only in self.options or bool(getattr(self, only, False))

    def length(self, dimension: str) -> int:
        """The length of a dimension that is no axis."""
        lengths = {
            "sample": self.samples,
            "start": self.starts,
            "peak": self.peaks,
            "crossing": self.returns,
            "state": len(self.states),
        }
        return lengths[dimension]

"""What a results file keeps of each point of a sweep: which of the variables that results
of its model may have it has."""

from __future__ import annotations

from functools import cached_property

from nsdrill.models.registry import described
from nsdrill.records import dataclass
from nsdrill.variables import MODEL, POINT, Axis, Unknown, Variable


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

"""What can be drawn of which data, and the words for saying so.

Each file of :mod:`nsdrill.plot.kinds` declares its pictures as ``KINDS``; nothing else
knows their names. They bring matplotlib, so they are loaded when somebody asks.
"""

from __future__ import annotations

import difflib
import os
import pkgutil
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any

from nsdrill.data import Results, Trace
from nsdrill.errors import InputError, NsdrillError
from nsdrill.models.description import Description
from nsdrill.models.leaves import words_along
from nsdrill.variables import SAMPLE, TRUST

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FEW = 3  # so many values of a second axis stand side by side as columns of one figure
MAX_PANELS = 12

# What a picture is drawn of, as the documentation groups them.
LINE = "a sweep over one axis"
RETURNS = "a sweep with `record.poincare`"
STARTS = "several starts"
SAMPLES = "samples of uncertain numbers"
PLANE = "a sweep over two or three axes"
TRACE = "a trace"
RAMP = "a trace of a ramp"
STUDY = "a study (.yaml)"
VALUE = "a sweep, one value"
GROUPS = (LINE, RETURNS, STARTS, SAMPLES, PLANE, TRACE, RAMP, STUDY, VALUE)


@dataclass(frozen=True)
class Kind:
    """One kind of picture.

    ``words`` say what it shows and ``of`` what it is drawn of. ``place`` takes data and
    tells whether it can be drawn of them: None if not, else a number; of all kinds that
    fit, the one with the least is the default. Cheap: the data may be an outline
    without numbers. ``draw(data, units, **options)`` gives the figure; ``takes`` are
    the options that this kind knows beside the units, by name. ``uses`` gives the
    variables of a sweep of a model that it is drawn from, ``status``, ``response`` and
    those of checks always among them: nothing else is read. ``across`` is the variable
    along the x axis of the panels, None where they have none in common. ``advice`` says
    why it does not fit.
    """

    name: str
    words: str
    of: str
    place: Callable[[Any], float | None]
    draw: Callable[..., Figure]
    uses: Callable[[Description], tuple[str, ...]] = lambda model: ()
    takes: tuple[str, ...] = ()
    across: Callable[[Any], str | None] = lambda data: None
    advice: Callable[[Any], str] = lambda data: ""


@cache
def all_kinds() -> dict[str, Kind]:
    """All kinds by their names."""
    found: dict[str, Kind] = {}
    room = "nsdrill.plot.kinds"
    for module in sorted(one.name for one in pkgutil.iter_modules(import_module(room).__path__)):
        try:
            kinds = import_module(f"{room}.{module}").KINDS
        except Exception as error:  # of a kind under work
            raise NsdrillError(
                f"plot/kinds/{module}.py: {type(error).__name__}: {error}."
            ) from error
        for kind in kinds:
            assert kind.name not in found, f"two kinds of picture with the name {kind.name}"
            found[kind.name] = kind
    return found


def kinds_of(what: str) -> dict[str, Kind]:
    """The kinds that are drawn of ``what``: LINE, STUDY and so on."""
    return {name: kind for name, kind in all_kinds().items() if kind.of == what}


def kinds_for(data: Any) -> tuple[str, ...]:
    """The kinds in which ``data`` can be drawn, the default first."""
    places = {name: kind.place(data) for name, kind in all_kinds().items()}
    fitting = {name: place for name, place in places.items() if place is not None}
    return tuple(sorted(fitting, key=lambda name: fitting[name]))


def variables_for(kind: str, model: Description) -> tuple[str, ...]:
    """The variables of a sweep of this model that a picture of this kind is drawn from;
    nothing else has to be read."""
    return ("status", "response", *TRUST, *all_kinds()[kind].uses(model))


def choose_kind(data: Any, kind: str | None) -> Kind:
    """The kind to draw: the one asked for, the default if none was; an error that lists
    the choices otherwise."""
    allowed, known = kinds_for(data), all_kinds()
    if kind is None:
        return known[allowed[0]]
    if kind in allowed:
        return known[kind]
    if kind in kinds_of(STUDY):
        raise InputError(
            f"plot kind: found {kind!r} with {_what(data)}; allowed: with a study, a YAML file."
        )
    listing = "\n".join(f"  {name:<24} {known[name].words}" for name in allowed)
    if kind in known:
        if (
            isinstance(data, Results)
            and "start" in data.coords
            and known[kind].place(_one(data, "start")) is not None
        ):
            raise InputError(
                f"plot kind: found {kind!r}, which draws one start of every operating point, with "
                f"{_what(data)}; "
                f"allowed here:\n{listing}\nor {kind!r} with --start, 0 to "
                f"{len(data.coords['start']) - 1}."
            )
        if (
            isinstance(data, Results)
            and SAMPLE in data.coords
            and known[kind].place(_one(data, SAMPLE)) is not None
        ):
            raise InputError(
                f"plot kind: found {kind!r}, which draws one sample of the uncertain numbers, "
                f"with {_what(data)}; "
                f"allowed here:\n{listing}\nor {kind!r} with --at {SAMPLE}=..., 0 to "
                f"{len(data.coords[SAMPLE]) - 1}."
            )
        advice = known[kind].advice(data)
        raise InputError(
            f"plot kind: found {kind!r}, which does not fit "
            f"{_what(data)}{f' ({advice})' if advice else ''}; "
            f"allowed here:\n{listing}"
        )
    near = difflib.get_close_matches(kind, allowed, n=1)
    hint = f" Did you mean {near[0]!r}?" if near else ""
    raise InputError(
        f"plot kind: found {kind!r}, which is not known.{hint} Allowed for "
        f"{_what(data)}:\n{listing}"
    )


def check_options(kind: Kind, options: dict[str, Any]) -> None:
    """InputError where an option was given that this kind does not take."""
    for name in options:
        if name not in kind.takes:
            takers = ", ".join(other.name for other in all_kinds().values() if name in other.takes)
            raise InputError(
                f"--{name}: found with --kind {kind.name}; allowed: with --kind {takers}."
            )


def is_study(path: object) -> bool:
    """Whether this is the name of a study file, of which charts are drawn, rather than
    one of results."""
    return isinstance(path, str | os.PathLike) and str(os.fspath(path)).lower().endswith(
        (".yaml", ".yml")
    )


def is_sweep(data: Any) -> bool:
    """Whether these are results with one start and one sample of every operating point."""
    return isinstance(data, Results) and "start" not in data.coords and SAMPLE not in data.coords


def has_samples(data: Any) -> bool:
    """Whether these are results with several samples of uncertain numbers."""
    return isinstance(data, Results) and SAMPLE in data.coords


def needs_samples(data: Any) -> str:
    """The advice of pictures of samples."""
    if isinstance(data, Results) and SAMPLE not in data.coords:
        return "it needs samples of uncertain numbers: the section uncertain of a study"
    return ""


def fits_columns(data: Any) -> bool:
    """Whether a sweep is drawn over one axis, with a column for each of the few values
    of a second one."""
    if not is_sweep(data):
        return False
    others = [len(data.coords[axis]) for axis in data.swept if axis != longest(data)]
    return not others or (len(others) == 1 and others[0] <= FEW)


def is_plane(data: Any) -> bool:
    """Whether a sweep is drawn over two axes, with panels for the values of a third
    one."""
    return is_sweep(data) and len(data.swept) > 1


def longest(data: Any) -> str:
    """The axis across in pictures over one axis, of numbers rather than words; of a
    single point the speed."""
    return str(
        max(
            data.swept,
            key=lambda name: (not words_along(name), len(data.coords[name])),
            default="rotary_speed",
        )
    )


def needs_one_axis(data: Any) -> str:
    """The advice of pictures over one axis."""
    if not is_sweep(data) or fits_columns(data):
        return ""
    return (
        f"it shows one axis, or two of which one has at most {FEW} values: select one value of "
        f"the others"
    )


def needs_returns(data: Any) -> str:
    """The advice of pictures of the returns to the section."""
    if isinstance(data, Results) and "motion" not in data.variables:
        return "no returns to the Poincare section were recorded: run with record.poincare"
    return ""


def needs_starts(data: Any) -> str:
    """The advice of pictures of several starts."""
    if not isinstance(data, Results):
        return ""
    if "start" not in data.coords:
        return "it needs several starts of every operating point: initial.ensemble or initial.slice"
    return (
        "it shows one axis: select a value of the others" if data.swept else "it needs a swept axis"
    )


def _one(data: Results, dimension: str) -> Results:
    coords = {name: values for name, values in data.coords.items() if name != dimension}
    return Results(coords, data.variables, data.attrs, data.more)


def _what(data: Any) -> str:
    if isinstance(data, Trace):
        return "a trace"
    if not isinstance(data, Results):
        return "this file"
    axes = [f"{axis} ({len(data.coords[axis])} values)" for axis in data.swept]
    what = f"a sweep over {' and '.join(axes)}" if axes else "a single point"
    if SAMPLE in data.coords:
        return f"{what} with {len(data.coords[SAMPLE])} samples each"
    return (
        f"{what} with {len(data.coords['start'])} starts each" if "start" in data.coords else what
    )

"""Whether a model of another package is what models are to the rest of nsdrill.

What is wrong with one would otherwise be found far away, or be a wrong number: an angle
that is not measured from the drive, as its name was misspelt. So what it declares is
compared with its own names when it is first used, and what its methods give at every
call.
"""

from __future__ import annotations

import inspect
import sys
import traceback
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from functools import partial
from types import FunctionType
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np

from nsdrill.data import read_only
from nsdrill.equations.effects import output_to
from nsdrill.errors import InputError, NsdrillError
from nsdrill.models.operation import Values
from nsdrill.models.responses import Thresholds
from nsdrill.models.variant import Variant, variant_at
from nsdrill.observe import channels

if TYPE_CHECKING:
    from nsdrill.models.base import Model
    from nsdrill.models.model_description import Description

ARGUMENTS = 5  # (t, phase, s, p, o)
NOT_CALLED = {"equations", "solved", "options"}  # read as what they are


def sound(model: Model, base: type, description: Description) -> Model:
    """The model, whose methods beyond those of ``base`` tell what is wrong with them.
    InputError where what it declares does not fit together."""
    if type(model).columns is base.columns:  # type: ignore[attr-defined]
        _refuse(model, "columns", "no such method", "a method columns, as docs/dev/extending.md shows")
    _check_equations(model)
    for name, own in inspect.getmembers(type(model), inspect.isfunction):
        if name not in NOT_CALLED and not name.startswith("__") and own is not getattr(base, name, own):
            setattr(model, name, partial(_called, model, name, getattr(model, name)))
    if description.friction_rates is not None:
        rates = partial(_called, model, "friction_rates", description.friction_rates)
        object.__setattr__(description, "friction_rates", rates)
    _check_names(model, description)
    _check_compared(model, base, description)
    return model


def _refuse(model: Model, where: str, found: str, allowed: str, place: str = "") -> NoReturn:
    file = inspect.getsourcefile(type(model)) or ""
    raise InputError(f"the model {model.name}, {where} ({place or file}): found {found}; allowed: {allowed}.")


def _check_equations(model: Model) -> None:
    raw = inspect.getattr_static(type(model), "equations", None)
    allowed = "a function of (t, phase, s, p, o), as `equations = staticmethod(equations)`"
    if not isinstance(raw, staticmethod) or not isinstance(raw.__func__, FunctionType):
        _refuse(model, "equations", "none" if raw is None else f"a {type(raw).__name__}", allowed)
    taken = inspect.signature(raw.__func__).parameters
    required = [one for one in taken.values() if one.default is one.empty and one.kind is one.POSITIONAL_OR_KEYWORD]
    if len(required) != ARGUMENTS:
        code = raw.__func__.__code__
        place = f"{code.co_filename}, line {code.co_firstlineno}"
        _refuse(model, "equations", f"a function of ({', '.join(taken)})", allowed, place)


def _check_names(model: Model, description: Description) -> None:
    variant = variant_at(model, description.parameters())
    names, slopes = variant.names, variant.slope_names
    for what, rows in (("states", names.states), ("parameters", names.parameters)):
        if len(set(rows)) < len(rows):
            _refuse(model, f"names, {what}", ", ".join(rows), "each name once")
    singles = variant.names.first_order
    pairs = len(names.states) - singles
    if pairs < 0 or pairs % 2 or singles < 0 or model.singles not in (0, singles):
        told = f"singles = {model.singles}" if model.singles else f"slopes {', '.join(names.slopes)}"
        _refuse(
            model,
            "names, states",
            f"{', '.join(names.states)}, with {told}",
            "pairs of a position and its velocity, and after them the states of first order; a slope of each pair and "
            "of each of these",
        )
    if len(names.slopes) != len(slopes):
        _refuse(
            model, "names, slopes", ", ".join(names.slopes), f"one name for the slope of each of {', '.join(slopes)}"
        )
    _check_states(variant, description)
    positions = names.states[:pairs:2]
    declared: Iterable[tuple[str, Collection[str], Collection[str]]] = (
        ("relative", model.relative, positions),
        ("set_speed", [model.set_speed], names.parameters),
    )
    for where, found, known in declared:
        if wrong := [name for name in found if name not in known]:
            _refuse(model, where, ", ".join(wrong), f"of its names {', '.join(known)}")
    _check_frames(variant)
    try:
        channels.check(names, variant.declaration)
    except ValueError as error:
        raise InputError(
            f"the model {model.name}, declaration ({inspect.getsourcefile(type(model))}): {error}."
        ) from error
    _check_contacts(variant)


def _check_states(variant: Variant, description: Description) -> None:
    """The states of the equations are those of the description and have variables of a
    trace; those that the start gives are fields of it."""
    model, wanted = variant.model, (*variant.states, "drive_angle")
    found = tuple(description.states(description.parameters()))
    if found != wanted:
        text = ", ".join(wanted)
        _refuse(
            model,
            "description, states",
            ", ".join(found),
            f"those of its names, {text}; where the start gives fewer, states=lambda parameters: {wanted!r}",
        )
    traced = {variable.name for variable in description.trace_and_states}
    if missing := [name for name in wanted[:-1] if name not in traced]:
        allowed = "every state: in own_trace, or in untraced, one in_trace(name, units, meaning) for each"
        _refuse(model, "description, own_trace", f"no variable of {', '.join(missing)}", allowed)
    given, initial = model.start_names(variant.options), description.initial()
    if missing := [name for name in given if not hasattr(initial, name)]:
        allowed = (
            "fields of its start; where the start gives fewer states, start_names(o) returns their names and "
            "complete_states(points, values) the values of all"
        )
        _refuse(model, "start_names", ", ".join(missing), allowed)


def _check_frames(variant: Variant) -> None:
    """A position whose channel has the frame of the drive is measured from its angle, and one
    that is measured from it has that frame."""
    model = variant.model
    positions = variant.states[: len(variant.states) - variant.names.first_order : 2]
    for channel in variant.declaration.channels:
        if channel.value not in positions:
            continue
        has_frame, is_relative = channel.frame == model.set_speed, channel.value in model.relative
        if has_frame and not is_relative:
            found, allowed = f"no {channel.value}", f'"{channel.value}", as its channel has the frame {model.set_speed}'
            _refuse(model, "relative", found, allowed)
        if is_relative and not has_frame:
            found = f"{channel.value}, whose channel has the frame {channel.frame}"
            _refuse(model, "relative", found, f"the frame {model.set_speed} for what is measured from the drive")


def _check_compared(model: Model, base: type, description: Description) -> None:
    """The scales of the description in which runs are compared are those of the model."""
    parameters = description.parameters()
    if type(model).scales is base.scales:  # type: ignore[attr-defined]
        known: Collection[str] = model.names(model.options_of(parameters)).parameters
    else:
        operation = tuple(vars(description.operation()).values())
        known = model.scales(model.pack(Values(parameters, description.initial(), operation), Thresholds()))
    if wrong := [
        f"{name} in the scale {scale}" for name, scale in description.compared.items() if scale not in (None, *known)
    ]:
        allowed = f"a scale of {', '.join(known) or 'none'}, or None for a fraction of time"
        _refuse(model, "description, compared", ", ".join(wrong), allowed)


def _check_contacts(variant: Variant) -> None:
    from nsdrill.equations.trace import traced

    model, motion = variant.model, variant.motion
    gaps = traced(motion.equations, motion.states, motion.parameters, motion.options)[0].gaps if model.contacts else {}
    if wrong := [name for name in model.contacts if name not in gaps]:
        allowed = ", ".join(gaps) or "none, as the equations call touching(name, gap) of none"
        _refuse(model, "contacts", ", ".join(wrong), allowed)


def _called(model: Model, name: str, method: Callable[..., Any], *given: Any, **named: Any) -> Any:
    """What a method gives, which cannot write to the arrays that it is given; what it
    prints goes to the standard error."""
    given = tuple(map(_unwritten, given))
    try:
        with output_to(lambda text: sys.stderr.write(text)):
            found = method(*given, **{key: _unwritten(value) for key, value in named.items()})
    except NsdrillError:
        raise
    except (Exception, SystemExit) as error:
        if isinstance(error, NotImplementedError):
            raise  # says that the model does without
        last = traceback.extract_tb(error.__traceback__)[-1]
        said = f"{type(error).__name__}: {error}".rstrip(": ")
        if isinstance(error, ValueError) and "read-only" in said:
            said += " (it has numbers of the run itself: change a copy, as `wob = 2.0 * wob`)"
        place = f"{last.filename}, line {last.lineno}"
        raise InputError(
            f"the model {model.name}, {name} ({place}): {said}. Mend the package of this model."
        ) from error
    if (check := _CHECKS.get(name)) is not None:
        check(model, method, found, given)
    return found


def _unwritten(value: Any) -> Any:
    """An array, or a mapping of arrays, that cannot be written to."""
    if isinstance(value, Mapping):
        return {key: read_only(one) for key, one in value.items()}
    return read_only(value)


def _place(method: Callable[..., Any]) -> str:
    code = getattr(method, "__code__", None)
    return f"{code.co_filename}, line {code.co_firstlineno}" if code is not None else ""


def _numbers(value: object) -> np.ndarray | None:
    try:
        return np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        return None


def _check_columns(model: Model, method: Callable[..., Any], found: Any, given: tuple[Any, ...]) -> None:
    where = partial(_refuse, model, "columns", place=_place(method))
    if not isinstance(found, Mapping):
        where(repr(found)[:80], "a dictionary of the lane parameters by name")
    wanted = tuple(found) if model.is_naming else model.names(model.options_of(given[0].parameters)).parameters
    if missing := [name for name in wanted if name not in found]:
        where(f"nothing for {', '.join(missing)}, only {', '.join(map(str, found))}", "every parameter of its names")
    sizes = set()
    for name in wanted:
        values = _numbers(found[name])
        if values is None or values.ndim > 1 or np.isnan(values).any():
            where(f"{str(found[name])[:80]} as {name}", "a number, or an array of one for each point")
        sizes.add(values.size if values.ndim else 1)
    if len(sizes - {1}) > 1:
        where(f"arrays of {', '.join(map(str, sorted(sizes)))} numbers", "numbers, or arrays of one for each point")


def _check_scales(model: Model, method: Callable[..., Any], found: Any, given: tuple[Any, ...]) -> None:
    where = partial(_refuse, model, "natural_scales", place=_place(method))
    values = [_numbers(scale) for scale in found] if isinstance(found, (tuple, list, np.ndarray)) else []
    states = model.names(given[1]).states
    if len(values) != len(states):
        where(f"{len(values)} scales", f"one for each of the states {', '.join(states)}")
    speed = float(np.max(np.abs(np.asarray(given[0][model.set_speed], dtype=float)), initial=0.0))
    of_turning = {name: limit for one in model.relative for name, limit in _most_of(states, one, speed)}
    for name, scale in zip(states, values, strict=True):
        if scale is None or scale.ndim > 1 or not np.isfinite(scale).all() or not (scale > 0.0).all():
            where(f"{np.min(scale) if scale is not None else scale} as the scale of {name}", "finite numbers above 0")
        most = of_turning.get(name, MOST_SCALE)
        if not (scale <= most).all():
            where(
                f"{np.max(scale):.6g} as the scale of {name}",
                f"up to {most:.6g}, as no error below simulation.rtol times the scale is seen",
            )


MOST_SCALE, MOST_OF_TURNING = 1e9, 1e3  # of any state; [rad] of an angle, and times the set speed


def _most_of(states: Sequence[str], position: str, speed: float) -> Iterable[tuple[str, float]]:
    """The greatest scales of an angle that is measured from the drive and of its velocity."""
    place = list(states).index(position) if position in states else -2
    return zip(states[place : place + 2], (MOST_OF_TURNING, MOST_OF_TURNING * max(speed, 1.0)), strict=False)


def _check_fastest(model: Model, method: Callable[..., Any], found: Any, given: tuple[Any, ...]) -> None:
    rate, points = _numbers(found), len(given[0][model.set_speed])
    if rate is None or rate.shape not in ((), (1,), (points,)) or not np.isfinite(rate).all() or not (rate > 0.0).all():
        _refuse(
            model, "fastest", str(found)[:80].replace("\n", " "), "a finite rate above 0 [rad/s] for each point",
            _place(method),
        )  # fmt: skip


def _check_labels(model: Model, method: Callable[..., Any], found: Any, given: tuple[Any, ...]) -> None:
    where = partial(_refuse, model, "classify", place=_place(method))
    if not isinstance(found, Mapping) or not {"response", "settled"} <= found.keys():
        where(repr(found)[:80], "a dictionary of labels that has those of super().classify(...)")
    shape = np.shape(given[1])
    for name, values in found.items():
        if np.shape(values) != shape:
            where(f"{name} of the shape {np.shape(values)}", f"one label for each run, of the shape {shape}")


_CHECKS: dict[str, Callable[[Any, Callable[..., Any], Any, tuple[Any, ...]], None]] = {
    "columns": _check_columns, "natural_scales": _check_scales, "fastest": _check_fastest, "classify": _check_labels,
}  # fmt: skip

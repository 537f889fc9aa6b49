"""Drives of scripts: a function that gives the torque of the motor at the top of a string,
and the slopes of its own states if it has any, for every model with such a drive."""

from __future__ import annotations

import hashlib
import inspect
from collections.abc import Mapping
from dataclasses import replace
from numbers import Real
from types import FunctionType
from typing import Any, get_args

import numpy as np

from nsdrill.equations import plain
from nsdrill.equations.graph import Graph, Node, text_of
from nsdrill.equations.passes import Tangents
from nsdrill.equations.trace import Named, check_text, traced
from nsdrill.errors import InputError
from nsdrill.models.own_drives import (
    MOST_STATES,
    MOTION,
    READ,
    TAKEN,
    OwnDrive,
    lane_of,
    listed,
    numbers_taken,
    own_drive,
    register_drive,
    row_of,
)
from nsdrill.models.own_parts import remember
from nsdrill.origin import origin_of
from nsdrill.script.dimensions import check_dimensions
from nsdrill.script.signature import NAME_FORM, Signature, is_name, number_in

FORM = f"some of {', '.join(READ)}, states of its own with their values at the start, and after * numbers with defaults"


def drive(function: FunctionType) -> FunctionType:
    """Make a drive of a function, as a decorator above its ``def``, for every model with a
    drive at the top of its string. Its name is that of the function: ``drive: {kind: name}``
    in a study, beside its numbers.

    Parameters
    ----------
    function : function
        Of some of ``lag`` [rad], the angle of the top less that of the set point,
        ``drive_speed`` [rad/s], ``twist`` [rad], the angle of the bit less that of the set
        point, ``bit_speed`` and ``set_speed`` [rad/s]; then of states of its own with their
        values at the start; after ``*`` of its numbers with their defaults. It returns the
        torque of the motor [N m], or that and the slopes of its states, by their names or
        in their order.

    Returns
    -------
    function
        The function itself.

    Raises
    ------
    InputError
        Where the signature is another one, or a name is taken.
    NsdrillError
        Where it does what cannot be read once for all steps, with the line.

    Examples
    --------
    >>> @nsdrill.drive
    ... def braking(lag, drive_speed, set_speed, *, spring=900.0, brake=1500.0):
    ...     return -spring * lag - brake * (drive_speed - set_speed)
    >>> study = {"drive": {"kind": "braking", "spring": "800 N*m/rad"}}
    """
    made = _read(function)
    register_drive(made)

    def again() -> None:
        before = own_drive(made.name)
        assert before is not None
        now = replace(_read(function), origin=before.origin)
        if now.digest != before.digest:
            register_drive(now)

    remember(f"drive {made.name}", again)
    return function


def _read(function: object) -> OwnDrive:
    if not isinstance(function, FunctionType):
        raise InputError(
            f"nsdrill.drive: found {function!r:.80}; allowed: a function, as @nsdrill.drive above its def."
        )
    signature = _signature(function)
    check_text(function)
    own = OwnDrive(
        function.__name__,
        function,
        tuple(name for name in inspect.signature(function).parameters if name in READ),
        signature.start,
        signature.parameters,
        origin_of(function),
        "0",
    )
    _check_form(own, signature)
    graph, slopes = _traced(own, signature)
    _check_read(own, signature, graph, slopes)
    _check_scales(own, signature, graph, slopes)
    told = [(name, value.told) for name, value in (*own.states.items(), *own.numbers.items())]
    text = repr((own.name, own.reads, told, text_of(slopes)))
    return OwnDrive(**{**vars(own), "digest": hashlib.sha256(text.encode()).hexdigest()[:16]})


def _signature(function: FunctionType) -> Signature:
    """Its states and its numbers. InputError where the signature is none of a drive."""
    given = inspect.signature(function).parameters.values()
    signature = Signature(function, {}, {}, timed=False)
    places = [one for one in given if one.kind is inspect.Parameter.POSITIONAL_OR_KEYWORD]
    numbers = [one for one in given if one.kind is inspect.Parameter.KEYWORD_ONLY]
    if len(places) + len(numbers) < len(given):
        signature.refuse(f"({', '.join(map(str, given))})", FORM)
    motion = [one for one in places if one.name in READ]
    states = [one for one in places if one.name not in READ]
    if with_default := [one.name for one in motion if one.default is not inspect.Parameter.empty]:
        signature.refuse(f"{with_default[0]} with a default, which is given", FORM)
    if bare := [one.name for one in states if one.default is inspect.Parameter.empty]:
        signature.refuse(f"{bare[0]} without a default, which is none of {', '.join(READ)}", FORM)
    if not motion:
        signature.refuse("nothing of the motion", FORM)
    if len(states) > MOST_STATES:
        signature.refuse(f"{len(states)} states", f"at most {MOST_STATES}")
    if function.__name__ in _kinds():
        signature.refuse(f"the name {function.__name__}, a drive of nsdrill", "another name")
    keys = numbers_taken()
    for one in (*states, *numbers):
        if one.name in READ or (one in states and one.name in TAKEN) or (one in numbers and one.name in keys):
            of = f"drive.{one.name}" if one in numbers else one.name
            signature.refuse(f"the name {one.name}, and there is {of} already", "another name")
    for name in (function.__name__, *(one.name for one in (*states, *numbers))):
        if not is_name(name):
            signature.refuse(f"the name {name}", NAME_FORM)
    return Signature(
        function,
        {one.name: number_in(signature, one, FORM) for one in states},
        {one.name: number_in(signature, one, FORM) for one in numbers},
        timed=False,
    )


def _kinds() -> set[str]:
    """The kinds of drive of nsdrill."""
    from nsdrill.models.drive_laws import Kind

    return {*get_args(Kind)}


def _traced(own: OwnDrive, signature: Signature) -> tuple[Graph, dict[str, Node]]:
    """The graph of the torque and of the slopes; refused with its line where it does what
    lanes cannot."""

    def equations(t: Node, phase: Node, s: Named, p: Named, o: object) -> dict[str, Any]:
        torque, slopes = own.law(s, p)
        return {"torque": torque, **slopes}

    equations.__module__ = own.function.__module__  # what it does besides is looked for
    equations.__qualname__ = own.function.__qualname__
    equations.written = own.function  # type: ignore[attr-defined]  # for messages
    states = (*MOTION, *own.rows)
    graph, slopes, _ = traced(equations, states, ("set_speed", *own.lanes), ())
    check_dimensions(
        equations,
        {row_of(name): value for name, value in own.states.items()},
        {lane_of(name): value for name, value in own.numbers.items()},
        signature.returned,
        others={f"s.{name}": "rad/s" if "speed" in name else "rad" for name in MOTION} | {"p.set_speed": "rad/s"},
        wanted={"torque": "N m"},
    )
    return graph, slopes


def _check_form(own: OwnDrive, signature: Signature) -> None:
    """InputError where what it returns, called with numbers, is none of what it may."""
    given = dict.fromkeys(own.reads, 1.0) | {n: float(v) for n, v in (*own.states.items(), *own.numbers.items())}
    try:
        found: Any = own.function(**given)
    except Exception:  # what is wrong is told where it is traced
        return
    names = ", ".join(own.states)
    if not own.states and not isinstance(found, (Real, np.ndarray)):
        signature.refuse(f"{found!r:.80} as what it returns", "the torque alone, as it has no states of its own")
    if own.states:
        slopes = found[1] if isinstance(found, tuple) and len(found) == 2 else None
        named = (
            set(slopes) == set(own.states) if isinstance(slopes, Mapping) else len(listed(slopes)) == len(own.states)
        )
        if slopes is None or not named:
            signature.refuse(
                f"{found!r:.80} as what it returns",
                f"a pair of the torque and the slopes of its states, {names}, by name or in this order",
            )


def _check_read(own: OwnDrive, signature: Signature, graph: Graph, slopes: dict[str, Node]) -> None:
    """InputError where neither the torque nor a slope reads one of its numbers."""
    inputs = graph.inputs_of(slopes.values())
    if idle := [name for name in own.numbers if f"p.{lane_of(name)}" not in inputs]:
        signature.refuse(f"the number {idle[0]}, which nothing reads", "numbers that the torque or a slope reads")


def _check_scales(own: OwnDrive, signature: Signature, graph: Graph, slopes: dict[str, Node]) -> None:
    """InputError where a state has no natural scale, as the torque does not change with it
    at the set point."""
    given = {f"s.{name}": 0.0 for name in MOTION} | {f"s.{name}": v for name, v in own.start.items()}
    given |= {"s.drive_speed": 1.0, "s.bit_speed": 1.0, "p.set_speed": 1.0, "time": 0.0, "phase": 0.0}
    given |= {f"p.{lane_of(name)}": float(value) for name, value in own.numbers.items()}
    for name, value in own.states.items():
        seed = graph.input(f"s.{row_of(name)}")
        change = plain.values({"": Tangents(graph, {seed: 1.0}).of({"": slopes["torque"]})[""]}, given)[""]
        if value.scale is None and not np.any(change):
            signature.refuse(
                f"the state {name}, with which the torque does not change at the set point, so that its natural scale "
                "is not known",
                f"nsdrill.number({float(value):g}, scale=...) for it, a tenth of what it usually reaches",
            )

"""Right-hand sides written for one trajectory, put into lanes.

A model need not know lanes: a plain function of time, states and parameters, over
tuples, is called in a loop over the lanes, into which it disappears, and the loop
compiles to packed instructions. The function must not branch on values but select
(``a if condition else b``), and call nothing but what vectorises: arithmetic,
``np.sqrt``, ``np.floor`` and the functions of :mod:`nsdrill.elementary`.
"""

from __future__ import annotations

import hashlib
import inspect
from collections.abc import Callable, Sequence
from dataclasses import astuple
from functools import lru_cache
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any

import numpy as np
from numba import types

from nsdrill.abi import BUFFER, Rows, compiled, inlined
from nsdrill.generate import constants, define

STEP = 2.0**-20  # of a deviation: a power of two, so that scaling costs no bit
Slopes = Callable[..., Sequence[float]]


@lru_cache
def unobserved(lanes: int) -> tuple[Any, Any]:
    """A compiled observer and a marker that do nothing, for runs of which only the end
    is wanted."""

    @compiled(types.void(BUFFER, BUFFER), lanes)
    def watch_nothing(b, store):  # type: ignore[no-untyped-def]
        pass

    @compiled(
        types.void(BUFFER, BUFFER, types.int64, types.int64, types.float64[::1], types.int64), lanes
    )
    def mark_nothing(b, store, i, mark, report, column):  # type: ignore[no-untyped-def]
        pass

    return watch_nothing, mark_nothing


def in_lanes(slopes: Slopes, lanes: int, rows: Rows, deviation: Slopes | None = None) -> Any:
    """The compiled right-hand side of a model whose slopes are ``slopes(t, y, p)``.

    ``t`` is the time, ``y`` the tuple of the own states and ``p`` that of the
    parameters, in the order of ``rows``. The result is the tuple of the slopes: for
    each pair of position and velocity the velocity's, then those of the states of first
    order. Where the layout has tangent states, ``deviation(t, y, d, p)`` gives the
    slopes of a deviation ``d`` from the motion: the Jacobian times ``d``. Without it
    the difference of the slopes at two states, ``STEP`` times ``d`` apart about the
    motion, takes its place: as ``d`` has natural scales, its error is about 1e-8 of
    them.

    Either function may ask for the phase as one argument more, the last: the angle of
    the drive, less whole turns, when the time is zero. With the drive's speed among the
    parameters the angle now is ``phase + speed * t``.
    """
    W, own = lanes, rows.own
    state = _row("stage", range(own))
    deviated = _row("stage", range(own, 2 * own))
    parameters = _row("parameter", range(rows.parameters))
    slope = _row("acceleration", range(rows.own_slopes))
    follows = _row("acceleration", range(rows.own_slopes, rows.slopes))
    places = {
        name: W * getattr(rows, name)
        for name in ("stage", "acceleration", "stage_time", "phase", "parameter")
    }
    lines = [
        f"# {_signed(slopes)}{f', {_signed(deviation)}' if deviation else ''}",
        constants(W=W, **places),
        "def right_hand_side(b):",
        # The length is nothing that the compiler knows, or it would unroll the loop of
        # a small model before packing it.
        "    for i in range(min(W, len(b))):",
        "        t = b[stage_time + i]",
        f"        y = ({state})",
        f"        p = ({parameters})",
        f"        ({slope}) = slopes(t, y, p{_phase(slopes, 3)})",
    ]
    known = {"slopes": inlined(slopes)}
    if rows.tangent_states:
        if deviation is not None:
            lines.append(
                f"        ({follows}) = deviation(t, y, ({deviated}), p{_phase(deviation, 4)})"
            )
            known["deviation"] = inlined(deviation)
        else:
            for name, sign in (("above", "+"), ("below", "-")):
                moved = (
                    f"b[stage + {n} * W + i] {sign} {STEP!r} * b[stage + {own + n} * W + i], "
                    for n in range(own)
                )
                lines.append(
                    f"        {name} = slopes(t, ({''.join(moved)}), p{_phase(slopes, 3)})"
                )
            parts = (
                f"(above[{n}] - below[{n}]) * {0.5 / STEP!r}, " for n in range(rows.own_slopes)
            )
            lines.append(f"        ({follows}) = ({''.join(parts)})")
    function = define("right_hand_side", "\n".join(lines) + "\n", **known)
    return compiled(types.void(BUFFER), W, *astuple(rows))(function)


def _phase(function: Slopes, others: int) -> str:
    """The last argument of a function that asks for more than ``others``."""
    asked = inspect.signature(getattr(function, "py_func", function)).parameters
    return ", b[phase + i]" if len(asked) > others else ""


def _row(name: str, numbers: Sequence[int]) -> str:
    """The values of lane i in these rows, as the inside of a tuple."""
    return "".join(f"b[{name} + {number} * W + i], " for number in numbers)


def embedded(function: Callable[..., Any]) -> tuple[Any, str]:
    """``function`` as a helper that disappears into the text which calls it, and a line
    for that text which tells its code from any other. A function that is compiled
    already stays as it is."""
    line = _signed(function)
    if not isinstance(function, FunctionType):
        return function, line
    # Two functions of one name, as all lambdas are, would be one to the cache.
    name = f"{function.__name__.strip('<>')}_{hashlib.sha256(line.encode()).hexdigest()[:16]}"
    copy = FunctionType(
        function.__code__, function.__globals__, name, function.__defaults__, function.__closure__
    )
    copy.__qualname__ = name
    copy.__module__ = function.__module__
    return inlined(copy), line


def _signed(function: Callable[..., Any], callers: tuple[Any, ...] = ()) -> str:
    """The function's name with a digest of its code, of the file it stands in and of
    all that it refers to: other code must not meet machine code from before."""
    function = getattr(function, "py_func", function)
    name = (
        f"{getattr(function, '__module__', '')}.{getattr(function, '__qualname__', repr(function))}"
    )
    # What belongs to the package is in the digest of its sources.
    if not isinstance(function, FunctionType) or function in callers or name.startswith("nsdrill."):
        return name
    code, file = function.__code__, Path(inspect.getfile(function))
    digest = hashlib.sha256(file.read_bytes() if file.exists() else b"")
    digest.update(
        repr((code.co_code, code.co_names, code.co_varnames, _plain(code.co_consts))).encode()
    )
    known = inspect.getclosurevars(function)
    for word, value in sorted({**known.globals, **known.nonlocals}.items()):
        digest.update(f"{word} {_told(value, (*callers, function))}".encode())
    return f"{name} {digest.hexdigest()}"


def _plain(constants_of_code: tuple[Any, ...]) -> list[Any]:
    return [value for value in constants_of_code if not inspect.iscode(value)]


def _told(value: Any, callers: tuple[Any, ...]) -> str:
    """What a function refers to, by its contents."""
    if isinstance(value, ModuleType):
        return value.__name__
    if isinstance(value, np.ndarray):
        return f"{value.dtype} {value.shape} {hashlib.sha256(value.tobytes()).hexdigest()}"
    return _signed(value, callers) if callable(value) else repr(value)

"""Compiling in less time gives the same machine code, and leaves numba as it was."""

from __future__ import annotations

import gc
import math
import re

import numba
import numpy as np
import pytest
from numba import types
from numba.core.types.functions import BaseFunction
from numba.core.typing.templates import AbstractTemplate

from nsdrill import compiling


def sums(values, count):  # type: ignore[no-untyped-def]
    total = 0.0
    for i in range(count):
        total += math.sqrt(abs(values[2 * i + 1])) * 0.5 + max(values[i], 1) - min(i, 3)
    return np.floor(total) if total > 2 else -total


SIGNATURE = (types.float64[::1], types.int64)


def code() -> str:
    made = numba.njit(_nrt=False)(sums)
    made.compile(SIGNATURE)
    text = made.inspect_llvm(SIGNATURE)
    # numba numbers the functions of a process
    return re.sub(r"sumsB\d*v\d+B", "sumsB", text)


def test_the_code_is_that_of_numba_alone() -> None:
    alone = code()
    with compiling.compiling():
        code()
        remembered = code()
    assert len(alone) > 2000
    assert remembered == alone


def test_a_signature_is_asked_for_once(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []
    apply = AbstractTemplate.apply

    def count(self, args, kws):  # type: ignore[no-untyped-def]
        asked.append(args)
        return apply(self, args, kws)

    monkeypatch.setattr(AbstractTemplate, "apply", count)
    code()
    alone = len(asked)
    with compiling.compiling():
        code()
        asked.clear()
        code()
    assert 0 < len(asked) < alone / 2  # those of overloads are asked for again


def test_numba_is_as_before_also_after_an_error() -> None:
    before = BaseFunction.get_call_type

    def fails() -> None:
        with compiling.compiling():
            assert BaseFunction.get_call_type is not before
            numba.njit(lambda x: x + "a")(1.0)

    assert gc.isenabled()
    with pytest.raises(numba.TypingError):
        fails()
    assert BaseFunction.get_call_type is before
    assert gc.isenabled()

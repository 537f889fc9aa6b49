"""CVODE of SUNDIALS, BDF with Newton's method and a dense Jacobian, from the libraries
that scikit-sundae brings. The right-hand side is a C callback compiled in numba, so
that nothing of Python is timed."""

from __future__ import annotations

import ctypes
from functools import lru_cache
from pathlib import Path
from typing import Any, ClassVar

import numba
import numpy as np
from numba import types
from numba.extending import intrinsic

from benchmarks.peers import NO_OBSERVERS, MissingPeer, Result, Stopwatch
from benchmarks.peers.scalar import derivative
from benchmarks.workload import CONSTANTS, STATES, Problem

K = len(CONSTANTS)
BDF, NORMAL, MOST = 2, 1, 100_000_000
POINTER, LONG, REAL = ctypes.c_void_p, ctypes.c_long, ctypes.c_double


class Cvode:
    def __init__(self) -> None:
        self.name = "CVODE (scikit-sundae)"
        self.lacks = f"{NO_OBSERVERS}; RMS norm"
        self.library = _library()

    def run(self, problem: Problem, rtol: float) -> Result:
        end, evaluations = np.empty((len(problem), STATES)), 0
        right_hand_side = _compiled(self._data_in_content())
        # loaded before it is timed
        self._solve(right_hand_side, problem, 0, rtol, 1e-3, np.empty(STATES))
        with Stopwatch() as watch:
            for i in range(len(problem)):
                evaluations += self._solve(right_hand_side, problem, i, rtol, problem.duration, end[i])
        return Result(watch.wall, watch.cpu, evaluations, None, end)

    def _data_in_content(self) -> int:
        """The word of a serial vector's content that holds the address of its data: the
        second or the third, as the length before it has 32 bits or 64."""
        made, numbers = POINTER(), np.zeros(1)
        self.library.SUNContext_Create(0, ctypes.byref(made))
        vector = self.library.N_VMake_Serial(1, numbers.ctypes.data, made)
        words = ctypes.POINTER(ctypes.c_int64)
        content = ctypes.cast(ctypes.cast(vector, words)[0], words)
        place = 1 if content[1] == numbers.ctypes.data else 2
        self.library.N_VDestroy(vector)
        self.library.SUNContext_Free(ctypes.byref(made))
        return place

    def _solve(self, function: Any, problem: Problem, i: int, rtol: float, duration: float, out: np.ndarray) -> int:
        """Integrate point ``i`` and leave its end in ``out``, NaN where CVODE gives up;
        the number of evaluations."""
        call, made = self.library, POINTER()
        call.SUNContext_Create(0, ctypes.byref(made))
        state, scale = problem.initial[i].copy(), rtol * problem.state_scales[i]
        constants = np.ascontiguousarray(problem.constants[i])
        y, tolerance = (call.N_VMake_Serial(STATES, a.ctypes.data, made) for a in (state, scale))
        matrix = call.SUNDenseMatrix(STATES, STATES, made)
        solver = call.SUNLinSol_Dense(y, matrix, made)
        memory = POINTER(call.CVodeCreate(BDF, made))
        call.CVodeInit(memory, ctypes.cast(function.address, POINTER), 0.0, y)
        call.CVodeSVtolerances(memory, rtol, tolerance)
        call.CVodeSetUserData(memory, constants.ctypes.data)
        call.CVodeSetLinearSolver(memory, solver, matrix)
        call.CVodeSetMaxNumSteps(memory, MOST)
        call.CVodeSetStopTime(memory, duration)
        time, count, more = REAL(), LONG(), LONG()
        flag = call.CVode(memory, duration, y, ctypes.byref(time), NORMAL)
        out[:] = state if flag >= 0 else np.nan
        call.CVodeGetNumRhsEvals(memory, ctypes.byref(count))
        call.CVodeGetNumLinRhsEvals(memory, ctypes.byref(more))
        call.CVodeFree(ctypes.byref(memory))
        call.SUNLinSolFree(solver)
        call.SUNMatDestroy(matrix)
        for vector in (y, tolerance):
            call.N_VDestroy(vector)
        call.SUNContext_Free(ctypes.byref(made))
        return count.value + more.value


class _Library:
    """The functions of several shared libraries under one name, with their types."""

    TYPES: ClassVar = {
        "SUNContext_Create": (ctypes.c_int, [ctypes.c_int, POINTER]),
        "SUNContext_Free": (ctypes.c_int, [POINTER]),
        "N_VMake_Serial": (POINTER, [ctypes.c_int64, POINTER, POINTER]),
        "N_VDestroy": (None, [POINTER]),
        "SUNDenseMatrix": (POINTER, [ctypes.c_int64, ctypes.c_int64, POINTER]),
        "SUNMatDestroy": (None, [POINTER]),
        "SUNLinSol_Dense": (POINTER, [POINTER, POINTER, POINTER]),
        "SUNLinSolFree": (ctypes.c_int, [POINTER]),
        "CVodeCreate": (POINTER, [ctypes.c_int, POINTER]),
        "CVodeInit": (ctypes.c_int, [POINTER, POINTER, REAL, POINTER]),
        "CVodeSVtolerances": (ctypes.c_int, [POINTER, REAL, POINTER]),
        "CVodeSetUserData": (ctypes.c_int, [POINTER, POINTER]),
        "CVodeSetLinearSolver": (ctypes.c_int, [POINTER, POINTER, POINTER]),
        "CVodeSetMaxNumSteps": (ctypes.c_int, [POINTER, LONG]),
        "CVodeSetStopTime": (ctypes.c_int, [POINTER, REAL]),
        "CVode": (ctypes.c_int, [POINTER, REAL, POINTER, POINTER, ctypes.c_int]),
        "CVodeGetNumRhsEvals": (ctypes.c_int, [POINTER, POINTER]),
        "CVodeGetNumLinRhsEvals": (ctypes.c_int, [POINTER, POINTER]),
        "CVodeFree": (None, [POINTER]),
    }

    def __init__(self, libraries: list[ctypes.CDLL]) -> None:
        for name, (result, arguments) in self.TYPES.items():
            found = [library[name] for library in libraries if hasattr(library, name)]
            if not found:
                raise MissingPeer(f"a scikit-sundae whose libraries have {name}")
            found[0].restype, found[0].argtypes = result, arguments
            setattr(self, name, found[0])


@lru_cache
def _library() -> Any:
    try:
        import sksundae.cvode
    except ImportError as error:
        raise MissingPeer("pip install scikit-sundae") from error
    folder = Path(sksundae.__file__).parents[1] / "scikit_sundae.libs"
    names = ("core", "nvecserial", "sunmatrixdense", "sunlinsoldense", "cvode")
    paths = [next(iter(folder.glob(f"libsundials_{name}-*.so*")), None) for name in names]
    if None in paths:
        raise MissingPeer("scikit-sundae from a wheel of Linux, which brings the libraries of SUNDIALS")
    return _Library([ctypes.CDLL(str(path)) for path in paths])


@lru_cache
def _compiled(place: int) -> Any:
    """The right-hand side as CVODE calls it: time, vectors of the state and of the
    slopes, constants."""

    @intrinsic
    def numbers_at(typing: Any, address: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return builder.inttoptr(arguments[0], context.get_value_type(types.CPointer(types.float64)))

        return types.CPointer(types.float64)(types.intp), generate

    @intrinsic
    def words_at(typing: Any, address: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return builder.inttoptr(arguments[0], context.get_value_type(types.CPointer(types.intp)))

        return types.CPointer(types.intp)(types.intp), generate

    @numba.cfunc(
        types.int32(types.float64, *[types.CPointer(types.intp)] * 2, types.CPointer(types.float64)),
        fastmath=True,
        error_model="numpy",
    )
    def right_hand_side(t, state, slope, data):  # type: ignore[no-untyped-def]
        # A serial vector begins with the address of its content, which has that of the
        # numbers.
        y = numba.carray(numbers_at(words_at(state[0])[place]), (STATES,))
        out = numba.carray(numbers_at(words_at(slope[0])[place]), (STATES,))
        k = numba.carray(data, (K,))
        slopes = derivative(t, y[0], y[1], y[2], y[3], y[4], y[5], y[6], y[7], k)
        for i in range(STATES):
            out[i] = slopes[i]
        return 0

    return right_hand_side

"""The lane functions of the models: native code against that of numba, and of one width
of vectors against another, to the bit."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from pythons import SRC

from nsdrill.store import read_results

from .oracle import CASES, outcomes, run, works
from .running import WIDTHS, bits, machine_code

ALL = bool(os.environ.get("NSDRILL_TEST_ORACLE"))
QUICK = ["torsional_speed"]


def same_bits(one: np.ndarray, two: np.ndarray) -> bool:
    return bits(one) == bits(two)


@pytest.mark.timeout(3600)
@pytest.mark.parametrize("lanes", [1, 8, 16, 32] if ALL else [8])
@pytest.mark.parametrize("names", [[name] for name in CASES] if ALL else [QUICK], ids=" ".join)
def test_native_code_has_the_bits_of_numbas(names, lanes, tmp_path):
    file = tmp_path / "numba.npz"
    program = [sys.executable, Path(__file__).with_name("oracle.py"), file, str(lanes), *names]
    subprocess.run(program, env={**os.environ, "NSDRILL_COMPILER": "numba", "PYTHONPATH": str(SRC)}, check=True)
    with np.load(file) as made:
        wanted = dict(made)
    found = {
        f"{name}|{part}|{number}": buffer
        for name in names
        for part, (work, points) in enumerate(works(name))
        for number, buffer in enumerate(outcomes(work, points, lanes))
    }
    assert found.keys() == wanted.keys()
    assert len(found) > 80
    for key, buffer in found.items():
        assert same_bits(buffer, wanted[key]), key
    assert np.isfinite(np.concatenate(list(found.values()))).mean() > 0.9, "few numbers are NaN"

    run(tmp_path / "native.h5")
    native, numba = (read_results(tmp_path / f"{way}.h5") for way in ("native", "numba"))
    assert list(native.variables) == list(numba.variables)
    for name in native.variables:
        assert native[name].tobytes() == numba[name].tobytes(), name
    assert native["steps"].max() > 1000
    assert np.isfinite(native["zero_one"]).any()
    assert native["period"].max() == 1


@pytest.mark.parametrize("name", list(CASES) if ALL else ["exponent"])
@pytest.mark.parametrize("lanes", [1, 8, 32] if ALL else [8])
def test_the_bits_are_those_of_any_width(name, lanes):
    for work, points in works(name):
        runs = [
            outcomes(work, points, lanes, lambda f, width=width: machine_code(f.py_func, f.kinds, width))
            for width in (WIDTHS if lanes > 1 else (2, 16))
        ]
        for number, buffers in enumerate(zip(*runs, strict=True)):
            assert all(same_bits(buffers[0], other) for other in buffers[1:]), number

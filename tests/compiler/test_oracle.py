"""The lane functions of the models: native code against that of numba, and of one width
of vectors against another, to the bit."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from pythons import SRC

from nsdrill.store import read_results

from .oracle import CASES, CONFIGS, outcomes, works
from .running import WIDTHS, bits, machine_code

ALL = bool(os.environ.get("NSDRILL_TEST_ORACLE"))
QUICK = ["torsional_speed"]


def by_numba(file: Path, lanes: int, *names: str) -> dict[str, np.ndarray]:
    program = [sys.executable, str(Path(__file__).parent / "oracle.py"), str(file), str(lanes), *names]
    env = {**os.environ, "NSDRILL_COMPILER": "numba", "PYTHONPATH": str(SRC)}
    subprocess.run(program, env=env, check=True)
    with np.load(file) as found:
        return dict(found)


def same_bits(one: np.ndarray, two: np.ndarray) -> bool:
    return bits(one) == bits(two)


RUN = """
import sys
import nsdrill
nsdrill.run(sys.argv[1], sys.argv[2], workers=1, set={
    "sweep.rotary_speed": ["90 rpm", "150 rpm"], "record.poincare": 1200,
    "simulation.transient": "5 s", "simulation.observe": "720 s"})
print(sum(name.partition(".")[0] == "numba" for name in sys.modules))
"""


def test_a_run_has_the_bits_of_numbas(tmp_path: Path) -> None:
    """The loop over steps, periods and the 0-1 test included; and numba's way is the
    only one that imports it."""
    made = {}
    for way in ("native", "numba"):
        program = [sys.executable, "-c", RUN, str(CONFIGS / "torsional_speed.yaml")]
        env = {**os.environ, "NSDRILL_COMPILER": way, "PYTHONPATH": str(SRC)}
        done = subprocess.run(
            [*program, str(tmp_path / f"{way}.h5")], env=env, check=True, capture_output=True, text=True
        )
        assert (int(done.stdout.split()[-1]) > 0) == (way == "numba")
        made[way] = read_results(tmp_path / f"{way}.h5")
    found, wanted = made["native"], made["numba"]
    assert list(found.variables) == list(wanted.variables)
    for name in found.variables:
        assert found[name].tobytes() == wanted[name].tobytes(), name
    assert found["steps"].max() > 1000
    assert np.isfinite(found["zero_one"]).any()
    assert found["period"].max() == 1


@pytest.mark.timeout(3600)
@pytest.mark.parametrize("lanes", [1, 8, 16, 32] if ALL else [8])
@pytest.mark.parametrize("names", [[name] for name in CASES] if ALL else [QUICK], ids=" ".join)
def test_native_code_has_the_bits_of_numbas(names: list[str], lanes: int, tmp_path: Path) -> None:
    wanted = by_numba(tmp_path / "numba.npz", lanes, *names)
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


@pytest.mark.parametrize("name", list(CASES) if ALL else ["exponent"])
@pytest.mark.parametrize("lanes", [1, 8, 32] if ALL else [8])
def test_the_bits_are_those_of_any_width(name: str, lanes: int) -> None:
    for work, points in works(name):
        runs = [
            outcomes(work, points, lanes, lambda f, width=width: machine_code(f.py_func, f.kinds, width))
            for width in (WIDTHS if lanes > 1 else (2, 16))
        ]
        for number, buffers in enumerate(zip(*runs, strict=True)):
            assert all(same_bits(buffers[0], other) for other in buffers[1:]), number

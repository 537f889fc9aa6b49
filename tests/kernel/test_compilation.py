"""The same numbers without compilation."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
from sweep.runs import run_from, work_for

from kernel.motions import BOUNCING, RUBBING, SMOOTH, scaled_error, start_of
from nsdrill.kernel.settings import Simulation

TESTS = str(Path(__file__).parents[1])


PLAIN = """
import json, sys
sys.path.insert(0, {tests!r})
from kernel.test_compilation import few_steps
print(json.dumps(few_steps()))
"""


def few_steps() -> list[list[float]]:
    """State, steps and rejected of 50 ms of three motions: some steps of each."""
    found = []
    for case in (SMOOTH, BOUNCING, RUBBING):
        out = run_from(work_for(case, Simulation(0.0, 0.05, rtol=1e-8)), start_of(case)[None])
        found.append([*out["final_state"][0].tolist(), int(out["steps"][0]), int(out["rejected"][0])])
    return found


def test_plain_python_takes_the_same_steps():
    """NUMBA_DISABLE_JIT=1: the whole kernel interpreted, so that coverage can look at
    it. Equal to rounding.

    The fused multiply-add rounds twice there. Some ten roundings of 1e-16 in each of up
    to sixty steps, in units of the natural scales, which are a tenth of the states:
    below 1e-12. Before the impact of the third motion the estimated error is little
    more than rounding, so the steps differ in length, and the error that the impact
    makes depends on where it falls in a step: equal to the tolerance only.
    """
    done = subprocess.run(
        [sys.executable, "-c", PLAIN.format(tests=TESTS)],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        check=True,
    )
    assert not done.stderr  # no warnings of numpy's numbers
    cases = ((SMOOTH, 1e-12), (BOUNCING, 1e-12), (RUBBING, 1e-8))
    for (case, bound), mine, plain in zip(cases, few_steps(), json.loads(done.stdout), strict=True):
        assert mine[9:] == plain[9:]
        assert 2 <= mine[9] < 60
        assert scaled_error(case, np.array(mine[:8]), np.array(plain[:8])) < bound

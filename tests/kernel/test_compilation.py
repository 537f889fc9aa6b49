"""How the code is compiled: packed instructions, and the same numbers without
compilation."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from machine_code import needs_wide_registers, packed_and_single, printed
from sweep.runs import run_from, work_for

from kernel.motions import BOUNCING, RUBBING, SMOOTH, scaled_error, start_of
from nsdrill.kernel.explicit import ExplicitPair
from nsdrill.kernel.settings import Simulation
from nsdrill.kernel.steppers import STEPPERS

TESTS = str(Path(__file__).parents[1])
EXPLICIT = [name for name, stepper in STEPPERS.items() if isinstance(stepper, ExplicitPair)]

ASSEMBLY = """
import sys
from nsdrill.kernel.steppers import IMPLICIT, STEPPERS
from nsdrill.models.christoforou_yigit.implicit import make_solve
from nsdrill.models.christoforou_yigit.implicit_along import make_axial_solve
from nsdrill.models.christoforou_yigit.implicit_held import make_stabilizer_solve
from nsdrill.models.christoforou_yigit.rhs import aux_of, columns_of, rows_of
from nsdrill.models.christoforou_yigit.rhs import make_right_hand_side
from nsdrill.models.christoforou_yigit.options import Options
from nsdrill.models.registry import model_named
from nsdrill.variables import MODEL
from nsdrill.models.christoforou_yigit.events import make_events
from nsdrill.models.christoforou_yigit.layout import OBSERVED
rows = model_named(MODEL).rows(Options(), len(OBSERVED))
SPLIT = Options(implicit=1)
function = {
    "rhs": lambda: make_right_hand_side(8),
    **{f"law {n}": lambda n=n: make_right_hand_side(8, Options(friction=n)) for n in (1, 2, 3)},
    "drive": lambda: make_right_hand_side(8, Options(driven=1, limited=1)),
    "events 3": lambda: make_events(8, rows, friction=3)[1],
    "options": lambda: make_right_hand_side(8, Options(swirl=1, stabilizer=1, weight=1, axial_friction=1)),
    "stabilizer": lambda: make_right_hand_side(8, Options(hertz=1, stabilizer=1)),
    **{f"slips {W}": lambda W=W: make_solve(W, SPLIT, rows_of(SPLIT), columns_of(SPLIT), aux_of(SPLIT))
       for W in (8, 16)},
    **{f"{name} {W}": lambda W=W, make=make, o=o: make(W, o, rows_of(o), columns_of(o), aux_of(o))
       for name, make, o in (("held", make_stabilizer_solve, SPLIT._replace(stabilizer=1)),
                             ("along", make_axial_solve, SPLIT._replace(axial_friction=1))) for W in (8, 16)},
    **{f"implicit {W}": lambda W=W: STEPPERS[IMPLICIT].make(W, STEPPERS[IMPLICIT].rows(rows_of(SPLIT)))
       for W in (8, 16)},
    **{name: lambda stepper=stepper: stepper.make(8, stepper.rows(rows)) for name, stepper in STEPPERS.items()},
    "events": lambda: make_events(8, rows)[1],
}[sys.argv[1]]()
print("".join(function.inspect_asm().values()))
"""


@needs_wide_registers
@pytest.mark.parametrize(
    "part",
    [
        "rhs",
        "law 1",
        "law 2",
        "law 3",
        "drive",
        "options",
        "stabilizer",
        *EXPLICIT,
        "events",
        "events 3",
        "slips 8",
        "slips 16",
        "held 8",
        "held 16",
        "along 8",
        "along 16",
        "implicit 8",
        "implicit 16",
    ],
)
def test_lane_loops_compile_to_packed_instructions(part: str, tmp_path: Path) -> None:
    """One function call or branch in a lane loop, and LLVM goes back to one lane at a
    time: five times slower.

    Compiled afresh, as code from the cache shows no assembly.
    """
    packed, single = packed_and_single(printed(ASSEMBLY, tmp_path, part))
    assert packed > 50
    # A few scalar ones may be left around the loops; a loop that fell back has as many
    # as there are operations. (A loop whose length the compiler does not know keeps a
    # rest for one lane, which is never entered.)
    assert single < (0.25 if part == "slips 8" else 0.1) * packed


BESIDE = """
from nsdrill.models.christoforou_yigit.features import make_observer
from nsdrill.models.christoforou_yigit.options import Options
for implicit in (0, 1):
    print("".join(make_observer(16, Options(implicit=implicit))[0].inspect_asm().values()))
    print("NEXT")
"""


@needs_wide_registers
def test_the_observer_is_as_packed_with_implicit_friction_as_without(tmp_path: Path) -> None:
    """It has rare parts for one lane, which are the same in both, so it is compared
    with itself."""
    explicit, implicit = (
        packed_and_single(text) for text in printed(BESIDE, tmp_path).split("NEXT")[:2]
    )
    assert explicit[1] > 0
    assert implicit[1] <= explicit[1] + 10
    assert implicit[0] >= explicit[0]


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
        found.append(
            [*out["final_state"][0].tolist(), int(out["steps"][0]), int(out["rejected"][0])]
        )
    return found


def test_plain_python_takes_the_same_steps() -> None:
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
    cases = ((SMOOTH, 1e-12), (BOUNCING, 1e-12), (RUBBING, 1e-8))
    for (case, bound), mine, plain in zip(cases, few_steps(), json.loads(done.stdout), strict=True):
        assert mine[9:] == plain[9:]
        assert 2 <= mine[9] < 60
        assert scaled_error(case, np.array(mine[:8]), np.array(plain[:8])) < bound

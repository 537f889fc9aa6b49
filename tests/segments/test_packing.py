"""How the string of segments is compiled."""

from __future__ import annotations

from pathlib import Path

import pytest
from machine_code import needs_wide_registers, packed_and_single, printed

ASSEMBLY = """
import sys
from nsdrill.kernel.steppers import STEPPERS
from nsdrill.models.registry import model_named
model = model_named("segments")
function = {
    "rates": lambda: model.right_hand_side(8, (3, 2, 0)),
    "creep": lambda: model.right_hand_side(8, (3, 2, 0, 1)),
    "step": lambda: STEPPERS["tsitouras"].make(8, STEPPERS["tsitouras"].rows(model.rows((10, 10, 0), model.observed))),
}[sys.argv[1]]()
print("".join(function.inspect_asm().values()))
"""


@needs_wide_registers
@pytest.mark.parametrize(("part", "share"), [("rates", 0.9), ("creep", 0.9), ("step", 0.4)])
def test_many_states_compile_to_packed_instructions(
    part: str, share: float, tmp_path: Path
) -> None:
    """A loop over lanes whose number the compiler does not know has one body in packed
    instructions and one for what is left, lane by lane: fewer single instructions than
    packed ones, where a loop that fell back has none packed. The step has in addition
    the controller. Compiled afresh, as code from the cache shows no assembly."""
    packed, single = packed_and_single(printed(ASSEMBLY, tmp_path, part))
    assert packed > 200
    assert single < share * packed

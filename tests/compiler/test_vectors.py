"""What happens in every step works on all lanes: as vectors in the text that LLVM gets,
and in the machine code that it makes of them."""

import re
from collections.abc import Callable
from typing import Any

import pytest
from machine_code import instructions, packed_and_single, text_of
from main_model import MAIN

from nsdrill.kernel.steppers import STEPPERS, make_step, with_step
from nsdrill.models.beam.columns import Options as Beam
from nsdrill.models.christoforou_yigit.columns import Options
from nsdrill.models.registry import model_named
from nsdrill.variables import MODEL

ROWS = model_named(MODEL).rows(Options(), model_named(MODEL).observed)
SPLIT = Options(implicit=1)


def step(name: str, lanes: int, rows: Any) -> Any:
    return make_step(STEPPERS[name], lanes, with_step(STEPPERS[name], rows))


def slopes(model: str, *variant: int) -> Any:
    options = Beam(*variant) if model == "beam" else variant
    return model_named(model).right_hand_side(8, options)


# A compiled function, and the operations on all lanes that it has at least.
FUNCTIONS: dict[str, tuple[Callable[[], Any], int]] = {
    "slopes": (lambda: MAIN.right_hand_side(8, Options()), 100),
    **{f"friction law {n}": (lambda n=n: MAIN.right_hand_side(8, Options(friction=n)), 100) for n in (1, 2, 3)},
    "drive": (lambda: MAIN.right_hand_side(8, Options(driven=1, limited=1)), 100),
    "many options": (lambda: MAIN.right_hand_side(8, Options(swirl=1, stabilizer=1, weight=1, axial_friction=1)), 150),
    "Hertz": (lambda: MAIN.right_hand_side(8, Options(hertz=1, stabilizer=1)), 100),
    "tangent": (lambda: model_named(MODEL).tangent(8, Options(), 0), 150),
    "slips": (lambda: MAIN.right_hand_side(16, SPLIT), 300),
    "slips held": (lambda: MAIN.right_hand_side(8, SPLIT._replace(stabilizer=1)), 300),
    "slips along": (lambda: MAIN.right_hand_side(8, SPLIT._replace(axial_friction=1)), 300),
    "slips held along": (lambda: MAIN.right_hand_side(8, SPLIT._replace(stabilizer=1, axial_friction=1)), 300),
    "implicit step": (lambda: step("kennedy_carpenter", 16, MAIN.rows(SPLIT)), 300),
    **{f"step {name}": (lambda name=name: step(name, 8, ROWS), 300) for name in STEPPERS},
    "torsion": (lambda: slopes("torsion"), 20),
    **{
        f"beam {' '.join(map(str, o))}": (lambda o=o: slopes("beam", *o), 100)
        for o in ((1, 1), (2, 1), (5, 1), (5, 5), (4, 3, 1, 3, 5, 1))
    },
    "step of the beam": (lambda: step("tsitouras", 8, model_named("beam").rows(Beam(5, 5), 40)), 100),
    "segments": (lambda: slopes("segments", 3, 2, 0), 100),
    "segments that creep": (lambda: slopes("segments", 3, 2, 0, 1), 100),
    "step of segments": (lambda: step("tsitouras", 8, model_named("segments").rows((10, 10, 0), 40)), 100),
}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_lane_loops_are_vectors(name):
    """A loop over lanes that is one over ``range`` is compiled too, and takes several
    times as long."""
    make, least = FUNCTIONS[name]
    packed, single = packed_and_single(text_of(make()))
    assert packed >= least
    assert single == 0


@pytest.mark.parametrize(
    ("model", "variant"),
    [
        (MODEL, Options()),
        (MODEL, SPLIT),
        (MODEL, Options(driven=1, stabilizer=1, weight=1)),
        ("beam", Beam(2, 1)),
        ("torsion", ()),
    ],
)
def test_only_the_events_of_an_observer_are_on_one_lane(model, variant):
    """They are rare. Their function is called by the one that attends to every step."""
    text = text_of(model_named(model).observer(16, variant)[0])
    events, every_step = re.split(r"(?m)^define", text)[1:]
    packed, single = packed_and_single(every_step)
    assert packed >= 10
    assert single == 0
    assert packed_and_single(events)[1] > 0


@pytest.mark.parametrize("name", ["slopes", "slips", "step tsitouras", "beam 5 5"])
def test_llvm_keeps_the_vectors(name):
    text = text_of(FUNCTIONS[name][0]())
    wide, single = instructions(text)
    assert wide >= packed_and_single(text)[0]  # of two or four registers each
    assert single <= 10

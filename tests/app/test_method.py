"""Which method integrates friction: from the parameters, said in the file, the same for a replay."""

from __future__ import annotations

import pytest

from nsdrill.app.planned import chosen_of
from nsdrill.app.run import run_in_memory
from nsdrill.app.trajectory import replay, simulate
from nsdrill.errors import InputError
from nsdrill.study import parse_study

STEEP = """
operation: {depth: 5000 m, wob: 66.72 kN, rotary_speed: 1 rad/s}
modes: {axial: frozen, lateral: frozen}
sweep: {bit.friction.smoothing: [100 s/rad, 20000 s/rad]PROCEDURE}
simulation: {transient: 2 s, observe: 4 s, method: METHOD}
initial: {twist: -8 rad}
"""


def study_of(method: str = "auto", procedure: str = ""):  # type: ignore[no-untyped-def]
    return parse_study(STEEP.replace("METHOD", method).replace("PROCEDURE", procedure))


def test_the_default_study_is_explicit() -> None:
    assert chosen_of(parse_study("title: The default")).words() == ("explicit",)


def test_auto_is_implicit_where_friction_is_steep_and_the_file_says_so() -> None:
    found = run_in_memory(study_of())
    assert found.attrs["method"] == "explicit and implicit"
    assert found["method"].ravel().tolist() == [0, 1]
    both = {method: run_in_memory(study_of(method)) for method in ("explicit", "implicit")}
    for place, method in enumerate(both):
        assert both[method].attrs["method"] == method
        assert "method" not in both[method].variables
        one, other = (file["final_state"].reshape(2, -1)[place] for file in (found, both[method]))
        assert one.tobytes() == other.tobytes()


def test_a_carried_chain_has_one_method_and_is_replayed_by_it() -> None:
    found = run_in_memory(study_of(procedure=", procedure: up"))
    assert found.attrs["method"] == "implicit"
    again = replay(found, at={"bit.friction.smoothing": 100.0})
    assert again.same_bits
    assert again.trace.attrs["method"] == "implicit"


def test_a_model_that_cannot_says_why() -> None:
    study = parse_study("simulation: {method: implicit}\nstabilizer: {clearance: 12 mm}")
    for command in (chosen_of, run_in_memory, simulate):
        with pytest.raises(InputError, match=r"simulation\.method: found implicit; allowed: auto or explicit, as stab"):
            command(study)


def test_a_limit_of_steps_says_which_friction_and_what_to_set() -> None:
    text = STEEP.replace("METHOD", "explicit, max_steps: 1000").replace("PROCEDURE", "")
    found = simulate(parse_study(text.replace("modes:", "bit: {friction: {smoothing: 20000 s/rad}}\nmodes:")))
    assert found.trace.attrs["status"] == "step_limit"
    assert "bit.friction.smoothing" in found.advice
    assert "simulation.method: auto" in found.advice

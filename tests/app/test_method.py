"""Which method integrates friction: from the parameters, said in the file, the same for
a replay."""

import numpy as np
import pytest

from nsdrill.app.experiment import prepare
from nsdrill.app.running.run import Interrupted, run_in_memory, run_study
from nsdrill.app.simulating.trajectory import replay, simulate
from nsdrill.errors import InputError
from nsdrill.models.friction import advice
from nsdrill.models.operation import Values
from nsdrill.store import read_results
from nsdrill.study import parse_study

STEEP = """
operation: {depth: 5000 m, wob: 66.72 kN, rotary_speed: 1 rad/s}
modes: {axial: frozen, lateral: frozen}
sweep: {bit.friction.smoothing: [100 s/rad, 20000 s/rad]PROCEDURE}
simulation: {transient: 2 s, observe: 4 s, method: METHOD}
initial: {twist: -8 rad}
"""


def study_of(method: str = "auto", procedure: str = ""):
    return parse_study(STEEP.replace("METHOD", method).replace("PROCEDURE", procedure))


def test_the_default_study_is_explicit():
    assert prepare(parse_study("title: The default")).methods == ("explicit",)


def test_auto_is_implicit_where_friction_is_steep_and_the_file_says_so():
    found = run_in_memory(study_of())
    assert found.attrs["method"] == "explicit and implicit"
    assert found["method"].ravel().tolist() == [0, 1]
    both = {method: run_in_memory(study_of(method)) for method in ("explicit", "implicit")}
    for place, method in enumerate(both):
        assert both[method].attrs["method"] == method
        assert "method" not in both[method].variables
        one, other = (file["final_state"].reshape(2, -1)[place] for file in (found, both[method]))
        assert one.tobytes() == other.tobytes()


CHAIN = STEEP.replace("[100 s/rad, 20000 s/rad]PROCEDURE", "[A, B, C, D, E], procedure: up-down").replace(
    "METHOD", "auto"
)


def chain_of(*smoothings: float):
    text = CHAIN
    for letter, smoothing in zip("ABCDE", smoothings, strict=True):
        text = text.replace(f"{letter},", f"{smoothing} s/rad,").replace(f"{letter}]", f"{smoothing} s/rad]")
    return parse_study(text)


def test_a_chain_changes_the_method_between_points_and_hands_its_state_over():
    """Each point by its own method, from the state in which the one before has ended,
    on the way up and back."""
    found = run_in_memory(chain_of(100, 300, 5000, 20000, 80000))
    up, down = (found["method"].reshape(2, -1)).tolist()
    assert up == down == [0, 0, 1, 1, 1]
    first, last = (found[f"{name}_state"].reshape(2, 5, -1) for name in ("initial", "final"))
    assert first[0, 1:].tobytes() == last[0, :-1].tobytes()
    assert first[1, :-1].tobytes() == last[1, 1:].tobytes()
    for smoothing, method in ((100.0, "explicit"), (5000.0, "implicit")):
        again = replay(found, at={"bit.friction.smoothing": smoothing}, procedure="down")
        assert again.same_bits
        assert again.trace.attrs["method"] == method


def test_bits_of_a_chain_that_changes_its_method(tmp_path, monkeypatch):
    """The same on one lane and on eight, on one worker and on two, and of a run that
    was stopped and goes on."""
    study = chain_of(100, 300, 5000, 20000, 80000)
    files = {}
    for name, lanes, workers in (("one", 1, 1), ("eight", 8, 2)):
        files[name] = tmp_path / f"{name}.h5"
        run_study(study, files[name], lanes=lanes, workers=workers)
    count = 0

    def stop(progress):
        nonlocal count
        count += 1
        if progress.done >= 3:
            raise KeyboardInterrupt

    files["resumed"] = tmp_path / "resumed.h5"
    with pytest.raises(Interrupted):
        run_study(study, files["resumed"], lanes=1, workers=1, watch=stop)
    run_study(study, files["resumed"], resume=True)
    results = {name: read_results(path) for name, path in files.items()}
    for name, values in results["one"].variables.items():
        for other in ("eight", "resumed"):
            assert np.asarray(values).tobytes() == np.asarray(results[other][name]).tobytes(), (name, other)


def test_a_model_that_cannot_says_why():
    several = ", ".join(f"{{at: {place / 14:.3f}}}" for place in range(1, 14))
    study = parse_study(f"model: beam\nsimulation: {{method: implicit}}\nbeam: {{stations: [{several}]}}")
    with pytest.raises(InputError, match=r"as 13 stations rub on the same modes"):
        prepare(study).check_method()


def test_stabilisers_and_wall_with_friction_along_the_hole_are_implicit_together():
    """Three contacts, two of them with a slip in a plane: the same motion as by explicit
    steps. It is chaotic, so it is compared over a short time."""
    ends = []
    for method in ("explicit", "implicit"):
        study = parse_study(
            f"simulation: {{method: {method}, rtol: 1.0e-10}}\nstabilizer: {{clearance: 12 mm}}\n"
            "well: {axial_friction: true}\ninitial: {x: 78 mm, vy: -0.5 m/s}\n"
            "operation: {rotary_speed: 6 rad/s}"
        )
        trace = simulate(study, duration=0.3).trace
        assert trace.attrs["status"] == "ok"
        ends.append(np.array([trace.variables[name][-1] for name in ("x", "y", "z", "bit_speed")]))
    assert ends[1] == pytest.approx(ends[0], rel=1e-6, abs=1e-8)


def test_a_limit_of_steps_says_which_friction_and_what_to_set():
    text = STEEP.replace("METHOD", "explicit, max_steps: 1000").replace("PROCEDURE", "")
    found = simulate(parse_study(text.replace("modes:", "bit: {friction: {smoothing: 20000 s/rad}}\nmodes:")))
    assert found.trace.attrs["status"] == "step_limit"
    assert "bit.friction.smoothing" in found.advice
    assert "simulation.method: auto" in found.advice


def test_what_is_set_already_is_not_advised():
    """By the method auto steep friction is integrated implicitly already, and a point that is
    not needs more steps."""
    study = parse_study("bit: {friction: {smoothing: 20000 s/rad}}")
    here = study.operation
    at = Values(study.parameters, study.initial, (here.depth, here.wob, here.rotary_speed))
    assert "method: auto" in advice("explicit", study.model, at)
    assert {advice(method, study.model, at) for method in ("auto", "implicit")} == {"raise simulation.max_steps"}

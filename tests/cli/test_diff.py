"""What differs between two files, as a user asks for it."""

import json
import re
import shutil
from pathlib import Path

import h5py
import pytest

import nsdrill
from nsdrill.app.answering.summary import reclassify
from nsdrill.app.simulating.trajectory import simulate
from nsdrill.store import log_from_results, write_trace


def test_a_file_is_the_same_as_itself(call, shared):
    answer = call("diff", shared / "small.h5", shared / "small.h5", "--exit-code")
    assert answer.err == ""
    assert "The files are the same to the bit: 16 points, " in answer.out
    log_from_results(shared / "small.h5", "small.h5.part").close()
    found = json.loads(call("diff", shared / "small.h5", "small.h5.part", "--json").out)
    assert found["same_numbers"]
    assert found["same_study"]


def test_another_model_digest_is_named_without_asking(call, shared):
    """The files of a model may have changed: what numbers differ by is then not the study alone."""
    assert "model_digest" not in call("diff", shared / "small.h5", shared / "failing.h5").out
    shutil.copy(shared / "small.h5", "other.h5")
    with h5py.File("other.h5", "r+") as file:
        file.attrs["model_digest"] = "0123456789abcdef"
    answer = call("diff", shared / "small.h5", "other.h5")
    assert "  model_digest  " in answer.out
    assert "0123456789ab..." in answer.out
    assert "numbers may differ by that alone." in answer.out
    assert "OTHER CODE: a and b were computed by other code" in call("window", shared / "small.h5", "other.h5").out


def test_two_studies(call, shared):
    """The failing study is the small one with fewer steps: of the points that fail
    nothing is left but their status."""
    files = shared / "small.h5", shared / "failing.h5"
    call("diff", *files)
    answer = call("diff", *files, "--exit-code", code=1)
    assert "  simulation.max_steps  50000000  1000\n" in answer.out
    assert "Compared: all 16 points." in answer.out
    assert "-> step limit" in answer.out
    found = nsdrill.diff(*files)
    assert found == json.loads(call("diff", *files, "--json").out)
    assert found["study"] == [{"key": "simulation.max_steps", "a": "50000000", "b": "1000"}]
    failed = sum(one["points"] for one in found["responses"]["changes"] if one["to"] == "step_limit")
    status = next(row for row in found["variables"] if row["name"] == "status")
    assert status["points"] == failed > 0
    radius = next(row for row in found["variables"] if row["name"] == "radius_max")
    assert radius["undefined"] == failed


def test_what_changed_for_the_driller_is_said_first(call, shared):
    """The windows before the numbers; the bits only where they are asked for. Without
    the whirl of the greatest speed the window ends there."""
    shutil.copy(shared / "small.h5", "calm.h5")
    with h5py.File("calm.h5", "r+") as file:
        file["response"][...] = 0
        file["response"][..., 0] = 2
        # without a touch of the wall, a lift-off or an oscillation
        for name in ("lift_off_fraction", "wall_contact_fraction", "stick_slip_severity", "radius_max"):
            file[name][..., 1:] = 0.0
    answer = call("diff", shared / "small.h5", "calm.h5")
    found = nsdrill.diff(shared / "small.h5", "calm.h5")
    assert found["same_study"]
    first, _, numbers = answer.out.partition("Compared: all 16 points.")
    assert "Of 8 common points 7 are safe with b, " in " ".join(first.split())
    assert "moved borders" in first
    assert "Variables: " in numbers
    assert "--bits names the others." in numbers
    assert "largest difference" not in answer.out
    bits = call("diff", shared / "small.h5", "calm.h5", "--bits").out
    assert re.search(r"\n  response +\d+", bits)
    assert json.loads(call("diff", shared / "small.h5", "calm.h5", "--json").out) == found


def test_two_axes_and_no_common_point(call, shared):
    answer = call("diff", shared / "small.h5", shared / "map.h5")
    found = nsdrill.diff(shared / "small.h5", shared / "map.h5")["study"]
    changed = {row["key"]: (row["a"], row["b"]) for row in found}
    assert changed["sweep.wob"] == (None, "{from: 20 kN, to: 100 kN, points: 5}")
    assert changed["sweep.rotary_speed"][1] == "[30 rpm, 45 rpm, 60 rpm, 75 rpm]"
    assert changed["sweep.procedure"] == ("up-down", "same")
    assert "procedure: 2 and 1 values, 0 in common." in answer.out
    assert "no points in common" in answer.out


def test_two_weights_are_compared_and_samples_by_their_values(call):
    study = {
        "model": "torsion",
        "simulation": {"transient": "5 s", "observe": "5 s"},
        "sweep": {"rotary_speed": ["3 rad/s", "6 rad/s"]},
        "uncertain": {"bit.friction.static": {"uniform": [0.2, 0.6]}, "samples": 2},
    }
    for name, change in (("a", {}), ("b", {"operation.wob": "60 kN"}), ("c", {"uncertain.seed": 2})):
        nsdrill.run(study, f"{name}.h5", set=change, progress=False).close()
    answer = call("diff", "a.h5", "b.h5", "--units", "field")
    assert "wob: 5 klbf in a, 13.49 klbf in b; their points are compared all the same." in answer.out
    assert "Compared: all 4 points." in answer.out
    assert "28.65 rpm, sample 0" in call("diff", "a.h5", "b.h5", "--units", "field", "--bits").out
    answer = call("diff", "a.h5", "c.h5")
    assert "sample: 2 and 2 samples, 0 with the same values of the unknowns." in answer.out
    assert "The samples differ, so their runs are not compared one by one." in answer.out
    found = nsdrill.diff("a.h5", "c.h5")["probabilities"]
    assert found["points"] == 2
    for one in found["outcomes"]:
        for side, name in (("a", "a.h5"), ("b", "c.h5")):
            with nsdrill.open_results(name) as data:
                mean = nsdrill.probability(data)["probability"].sel(outcome=one["name"]).mean().item()
            assert one[side] == pytest.approx(mean)
    assert "Probabilities at 2 operating points, means and largest change:" in answer.out


def test_labels_of_another_threshold(call, shared):
    shutil.copy(shared / "small.h5", "labels.h5")
    reclassify("labels.h5", ["classify.whirl.wall_contact_fraction=0.9"])
    found = nsdrill.diff(shared / "small.h5", "labels.h5")
    assert found["study"] == [{"key": "classify.whirl.wall_contact_fraction", "a": "0.01", "b": "0.9"}]
    assert {row["name"] for row in found["variables"] if not row["same"]} <= {
        "response",
        "whirl_kind",
        "whirl_severity",
    }


@pytest.mark.parametrize("text", ["no JSON", "3", '{"well": {"stiffness": "x"}}'])
def test_a_study_that_is_none(call, shared, text):
    shutil.copy(shared / "small.h5", "odd.h5")
    with h5py.File("odd.h5", "r+") as file:
        file.attrs["study_resolved"] = text
    answer = call("diff", shared / "small.h5", "odd.h5", code=2)
    assert "does not hold a study" in answer.err or "should be a JSON object" in answer.err


def test_traces(call, shared):
    one, other = (
        simulate(nsdrill.load_study(shared / "small.yaml"), rotary_speed=speed, duration=1.0).trace
        for speed in (3.0, 4.0)
    )
    write_trace("one.h5", one)
    write_trace("other.h5", other)
    assert "The files are the same to the bit: 101 samples, 21 variables." in call("diff", "one.h5", "one.h5").out
    answer = call("diff", "one.h5", "other.h5", "--exit-code", code=1)
    assert "  rotary_speed  3.0 rad/s  4.0 rad/s" in answer.out
    assert "Compared: all 101 samples." in answer.out
    other.variables.update({name: values.copy() for name, values in one.variables.items()})
    other.variables["wall_friction"] = -other["wall_friction"]
    assert not other["wall_friction"].any(), "the collar is off the wall"
    write_trace("signs.h5", other)
    assert re.search(r"wall_friction +101 +the sign of zero alone", call("diff", "one.h5", "signs.h5").out)
    assert "One is a sweep, the other a trace" in call("diff", shared / "small.h5", "one.h5", "--exit-code", code=1).out


@pytest.mark.parametrize("words", [("nothing.h5", "small"), ("small", "text.h5"), ("small",), ()])
def test_what_is_no_file(call, shared, words):
    Path("text.h5").write_text("no")
    assert call("diff", *(shared / "small.h5" if word == "small" else word for word in words), code=2).out == ""

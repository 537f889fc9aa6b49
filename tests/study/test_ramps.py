"""Operating values that follow time: read, refused with a place, kept in the resolved
study."""

import json

import pytest

from nsdrill.errors import Fault, FileError, StudyError
from nsdrill.models.operation import Ramp
from nsdrill.study import json_schema, parse_study, study_from_resolved

SWEEP = "sweep: {wob: [1 kN, 2 kN]}\n"
KNOTS = "[[0 s, 30 rpm], [1 min, 60 rpm], [100 s, 6.5 rad/s]]"


def faults(text: str, *overrides: str) -> list[Fault]:
    with pytest.raises(StudyError) as caught:
        parse_study(text, "f.yaml", overrides)
    return caught.value.faults


def test_a_ramp_is_read_into_si():
    study = parse_study(f"operation:\n  wob: 3 kN\n  rotary_speed: {{ramp: {KNOTS}}}\n")
    assert study.swept == ()
    assert study.ramped == ("rotary_speed",)
    ramp = study.ramps["rotary_speed"]
    assert ramp.times == (0.0, 60.0, 100.0)
    assert ramp.values == pytest.approx((3.14159265, 6.28318531, 6.5))
    assert study.operation.rotary_speed == ramp.values[0]
    assert study.operation.wob == 3000.0


def test_all_three_may_ramp_and_overrides_give_ramps():
    study = parse_study(
        SWEEP,
        overrides=[
            "operation.depth={ramp: [[0 s, 1 km], [1 h, 1.1 km]]}",
            "operation.rotary_speed={ramp: [[0 s, 1 rad/s], [1 s, 2 rad/s]]}",
            "operation.wob={ramp: [[0 s, 0 N], [1 s, 5 klbf]]}",
        ],
    )
    assert set(study.ramps) == {"depth", "wob", "rotary_speed"}
    assert study.ramped == ("depth", "rotary_speed")  # the sweep replaces that of wob
    assert study.ramps["depth"] == Ramp((0.0, 3600.0), (1000.0, 1100.0))


@pytest.mark.parametrize(
    ("ramp", "key", "found", "allowed"),
    [
        ("[[0 s, 3 rad/s]]", ".ramp", "one knot", "two knots"),
        ("[]", ".ramp", "an empty list", "two knots"),
        ("3", ".ramp", "the number 3", "a list of knots"),
        ("null", ".ramp", "nothing", "a list of knots"),
        ("[[1 s, 3 rpm], [2 s, 3 rpm]]", ".ramp[0][0]", "1 s", "0 s"),
        ("[[0 s, 3 rpm], [2 s, 3 rpm], [2 s, 4 rpm]]", ".ramp[2][0]", "2 s", "ascend"),
        ("[[0 s, 3 rpm], [5, 4 rpm]]", ".ramp[1][0]", "without a unit", "s, min or h"),
        ("[[0 s, 3 rpm], [5 s, 4 m]]", ".ramp[1][1]", "units of length", "rad/s or rpm"),
        ("[[0 s, 3 rpm], [5 s, 0 rpm]]", ".ramp[1][1]", "0 rpm", "at least 1e-09 rad/s"),
        ("[[0 s, 3 rpm], [5 s]]", ".ramp[1]", "a list of 1", "[time, value]"),
        ("[[0 s, 3 rpm], 5 s]", ".ramp[1]", "5 s", "[time, value]"),
        ("[[0 s, 3 rpm], [5 s, [1 rpm]]]", ".ramp[1][1]", "a list", "rad/s or rpm"),
    ],
)
def test_one_fault_of_a_ramp(ramp, key, found, allowed):
    (fault,) = faults(f"operation:\n  rotary_speed:\n    {{ramp: {ramp}}}\n")
    assert fault.key == "operation.rotary_speed" + key
    assert fault.line == 3
    assert found in fault.found
    assert allowed in fault.allowed


@pytest.mark.parametrize(
    ("value", "key", "says"),
    [
        ("{}", "operation.wob.ramp", "{ramp: [[0 s, VALUE]"),
        ("{ramp: [[0 s, 1 N], [1 s, 2 N]], rate: 3}", "operation.wob.rate", "ramp"),
        ("[1 N, 2 N]", "operation.wob", "a number with its unit"),
        ("[[0 s, 1 N], [1 s, 2 N]]", "operation.wob", "a ramp, for nsdrill simulate, is {ramp: [[0 s, VALUE]"),
    ],
)
def test_something_else_than_a_ramp(value, key, says):
    (fault,) = faults(f"{SWEEP}operation: {{wob: {value}}}")
    assert fault.key == key
    assert says in fault.allowed


def test_every_depth_of_a_ramp_lies_below_the_collars():
    (fault,) = faults("operation:\n  depth: {ramp: [[0 s, 900 m], [1 s, 200 m], [2 s, 900 m]]}")
    assert fault.key == "operation.depth.ramp[1][1]"
    assert fault.line == 2
    assert "length of the collars" in fault.allowed


def test_a_ramp_is_not_carried():
    (fault,) = faults("sweep: {procedure: up}\noperation: {wob: {ramp: [[0 s, 1 N], [1 s, 2 N]]}}")
    assert fault.key == "sweep"


def test_the_resolved_study_holds_the_ramps():
    study = parse_study(f"operation: {{rotary_speed: {{ramp: {KNOTS}}}}}")
    again = study_from_resolved(json.loads(json.dumps(study.resolved)), study.text, study.source)
    assert again.resolved == study.resolved
    assert again.ramps == study.ramps
    assert again.sha256 == study.sha256
    other = parse_study("operation: {rotary_speed: {ramp: [[0 s, 30 rpm], [1 min, 60 rpm]]}}")
    assert other.sha256 != study.sha256


def test_digests_know_only_the_ramps_that_count():
    """A study without ramps has the digest that it always had; a ramp that a sweep
    replaces does not matter."""
    assert "ramps" not in parse_study(SWEEP).resolved
    replaced = parse_study(SWEEP + "operation: {wob: {ramp: [[0 s, 1 N], [1 s, 2 N]]}}")
    assert replaced.sha256 == parse_study(SWEEP).sha256


def test_damaged_ramps_are_a_file_error():
    resolved = parse_study(f"operation: {{rotary_speed: {{ramp: {KNOTS}}}}}").resolved
    for ramps in ({"mud": [[0.0, 1.0], [1.0, 2.0]]}, {"wob": [[0.0], [1.0]]}, {"wob": 3}):
        with pytest.raises(FileError, match=r"out\.h5"):
            study_from_resolved({**resolved, "ramps": ramps}, source="out.h5")


def test_the_schema_for_editors_takes_both_forms():
    jsonschema = pytest.importorskip("jsonschema")
    validator = jsonschema.Draft202012Validator(json_schema())
    good = ({"operation": {"wob": "3 kN"}}, {"operation": {"wob": {"ramp": [["0 s", "3 kN"], ["1 s", "4 kN"]]}}})
    for data in good:
        validator.validate(data)
    for data in ({"operation": {"wob": {"ramp": [["0 s", "3 kN", "1 N"]]}}}, {"operation": {"wob": {}}}):
        with pytest.raises(jsonschema.ValidationError):
            validator.validate(data)

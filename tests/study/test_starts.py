"""Ensembles and slices in the study file: what is read, and what is wrong with what."""

import json

import pytest

from nsdrill.errors import Fault, StudyError
from nsdrill.study import parse_study, study_from_resolved, template_text

SWEEP = "sweep: {depth: [1 km, 2 km]}\n"
PLANE = "{vx: {from: 1 m/s, to: -1 m/s, points: 4}, x: {from: -7 mm, to: 70 mm, points: 3}}"


def faults(text: str, *overrides: str) -> list[Fault]:
    with pytest.raises(StudyError) as caught:
        parse_study(text, "s.yaml", overrides)
    return caught.value.faults


def test_one_start_by_default():
    assert parse_study(SWEEP).initial.starts == 0
    assert parse_study(SWEEP + "initial: {ensemble: 1, x: 2 mm}").initial.starts == 0
    assert parse_study(SWEEP + "initial: {slice: null}").initial.starts == 0


def test_an_ensemble():
    study = parse_study(SWEEP + "initial: {ensemble: 64, seed: 3, spread: 0.5}")
    assert (study.initial.starts, study.initial.seed, study.initial.spread) == (64, 3, 0.5)
    assert study.sha256 != parse_study(SWEEP + "initial: {ensemble: 64, seed: 4, spread: 0.5}").sha256


def test_a_slice_in_the_order_of_the_states_ascending():
    study = parse_study(SWEEP + f"initial: {{y: 1 mm, slice: {PLANE}}}")
    assert study.initial.slice == {
        "x": {"from": -7e-3, "to": 70e-3, "points": 3},
        "vx": {"from": -1.0, "to": 1.0, "points": 4},
    }
    assert list(study.initial.slice) == ["x", "vx"]
    assert (study.initial.starts, study.initial.y) == (12, 1e-3)
    again = study_from_resolved(json.loads(json.dumps(study.resolved)))
    assert again.initial == study.initial
    assert again.sha256 == study.sha256


def test_the_template_may_become_an_ensemble():
    """It gives every state its default, which is no wish for a state."""
    assert parse_study(template_text(), overrides=["initial.ensemble=8"]).initial.starts == 8


@pytest.mark.parametrize(
    ("initial", "key", "found", "allowed"),
    [
        ("{ensemble: 8, x: 2 mm}", "initial.x", "with an ensemble, which draws all states", "left out"),
        ("{ensemble: 8, bit_speed: 3 rad/s}", "initial.bit_speed", "an ensemble", "left out"),
        ("{ensemble: -1}", "initial.ensemble", "-1", "at least 0"),
        ("{ensemble: 2, spread: 0}", "initial.spread", "0", "at least 1e-06 and at most 1"),
        ("{ensemble: 2, spread: 10 mm}", "initial.spread", "'10 mm'", "a number"),
        ("{ensemble: 2, seed: -3}", "initial.seed", "-3", "at least 0"),
        (f"{{ensemble: 8, slice: {PLANE}}}", "initial.ensemble", "8 beside initial.slice", "one of the two"),
        ("{slice: {x: {from: 0 mm, to: 1 mm, points: 2}}}", "initial.slice", "1 of them (x)", "two states"),
        ("{slice: 5}", "initial.slice", "5", "x, vx, y, vy, z, vz, twist, bit_speed, drive_angle"),
        ("{slice: {q: {from: 0 mm, to: 1 mm, points: 2}}}", "initial.slice.q", "an unknown key", "x, vx, y"),
        ("{slice: {x: {from: 0, to: 1 mm, points: 2}}}", "initial.slice.x.from", "without a unit", "mm"),
        ("{slice: {x: {from: 0 mm, points: 2}}}", "initial.slice.x.to", "nothing", "all of from, to and points"),
        ("{slice: {x: {from: 0 mm, to: 0 mm, points: 2}}}", "initial.slice.x", "the same", "that differ"),
        ("{slice: {x: {from: 0 mm, to: 1 mm, points: 1}}}", "initial.slice.x.points", "1", "at least 2"),
        (f"{{slice: {PLANE.replace('4', '400000')}}}", "initial.slice", "1.2e+06 starts", "at most 100 000"),
        (f"{{vx: 1 m/s, slice: {PLANE}}}", "initial.vx", "which initial.slice varies", "left out"),
        (f"{{y: 600 mm, slice: {PLANE}}}", "initial.slice", "604", "the gap"),
    ],
)
def test_faults(initial, key, found, allowed):
    fault = faults(SWEEP + f"initial: {initial}")[0]
    assert fault.key == key
    assert found in fault.found
    assert allowed in fault.allowed


@pytest.mark.parametrize("initial", ["ensemble: 8", f"slice: {PLANE}"])
@pytest.mark.parametrize("procedure", ["up", "down", "up-down"])
def test_starts_of_their_own_and_a_carried_state_exclude_each_other(initial, procedure):
    (fault,) = faults(SWEEP + f"initial: {{{initial}}}", f"sweep.procedure={procedure}")
    assert "carries the state on" in fault.found
    assert fault.allowed == "with sweep.procedure: same"


def test_starts_count_among_the_points():
    (fault,) = faults("sweep: {wob: {from: 1 N, to: 1 kN, points: 10001}}\ninitial: {ensemble: 10000}")
    assert "1e+08 points over all axes and starts" in fault.found

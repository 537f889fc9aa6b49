"""Checks of every point: right runs from right states, and the same file whatever
happened on the way."""

from dataclasses import replace

import numpy as np
import pytest
from interrupts import Interrupt, look_often
from same_bits import different

from nsdrill.analysis.maps import classes
from nsdrill.app.answering.summary import reclassify, summarize
from nsdrill.app.check import check
from nsdrill.app.running import stages
from nsdrill.app.running.run import Interrupted, run_in_memory, run_study
from nsdrill.observe.motion_kinds import RESPONSE_DIFFERS, verdict
from nsdrill.store import part_path, read_partial, read_results
from nsdrill.study import Study, parse_study
from nsdrill.variables import INFERRED, OK, PENDING, STEP_LIMIT

from .alike import starting_in

BASE = """
operation: {depth: 3000 m}
simulation: {transient: 5 s, observe: 15 s, verify: true}
record: {peaks: 2}
sweep:
  wob: {from: 20 kN, to: 100 kN, points: 3}
  rotary_speed: {from: 2 rad/s, to: 9 rad/s, points: 8}
"""
GRID = BASE
CHAINS = BASE + "  procedure: up-down\n  along: rotary_speed\n"
REFINED = BASE + "  refine: 1\n"
TEXTS = pytest.mark.parametrize("text", [GRID, CHAINS, REFINED], ids=["grid", "chains", "refined"])


def study_of(text: str, *overrides: str) -> Study:
    return parse_study(text, "s.yaml", overrides)


@TEXTS
def test_the_runs_are_those_of_the_unchecked_sweep(text):
    plain, checked = (run_in_memory(study_of(text, "simulation.verify=false")), run_in_memory(study_of(text)))
    for name, values in plain.variables.items():
        assert values.tobytes() == checked[name].tobytes(), name
    more = set(checked.variables) - set(plain.variables)
    assert len(more) == 15  # of each check 7, and trusted
    ran = checked["status"] == OK
    for name in more:
        if name.endswith("_status"):
            assert np.array_equal(checked[name] == OK, ran)
    assert np.all(np.isnan(checked["tight_difference"][checked["status"] == INFERRED]))


def test_each_check_is_the_run_that_it_says():
    """The same simulations made by hand: to a hundredth of the tolerance from the
    stored initial state, and on from the stored final state. In a carried sweep these
    states are no points of another study, so one axis of one value."""
    text = CHAINS.replace("{from: 20 kN, to: 100 kN, points: 3}", "40 kN")
    found = run_in_memory(study_of(text))
    tight, long = stages.checks(study_of(text).simulation)
    assert (tight.simulation.rtol, long.simulation.rtol) == (1e-8, 1e-6)
    plain = text.split("  procedure")[0]
    for check_, row in ((tight, "initial_state"), (long, "final_state")):
        states = found[row][1, 0, 0]
        # off the wall, as a study must begin
        inside = np.flatnonzero(np.hypot(states[:, 0], states[:, 2]) < 0.07)
        assert len(inside) > 1
        for i in inside[[0, -1]].tolist():
            speed = f"{float(found.coords['rotary_speed'][i])!r} rad/s"
            changes = ("simulation.verify=false", f"simulation.rtol={check_.simulation.rtol!r}")
            at = plain.replace("{from: 2 rad/s, to: 9 rad/s, points: 8}", speed)
            one = run_in_memory(study_of(at, *changes, *starting_in(states[i])))
            for name in ("lift_off_fraction", "stick_slip_index", "wall_contact_fraction"):
                assert one[name].item() == found[f"{check_.name}_{name}"][1, 0, 0, i], (check_.name, i, name)
            assert one["response"].item() == found[f"{check_.name}_response"][1, 0, 0, i]


def test_run_again_alike_nothing_differs(monkeypatch):
    monkeypatch.setattr("nsdrill.app.running.stages.TIGHTER", 1.0)
    found = run_in_memory(study_of(CHAINS))
    assert np.all(found["tight_difference"] == 0)
    assert np.array_equal(found["tight_response"], found["response"])
    assert np.any(found["long_difference"] > 0)


@TEXTS
@pytest.mark.parametrize("after", [1, 3])
def test_an_interrupted_run_goes_on(tmp_path, text, after, monkeypatch):
    look_often(monkeypatch)
    study, out, one = study_of(text), tmp_path / "out.h5", tmp_path / "one.h5"
    run_study(study, one, workers=2, lanes=8)
    stages = set()
    while not out.exists():
        try:
            run_study(study, out, resume=True, workers=1, lanes=8, watch=Interrupt(after))
        except Interrupted:
            there = read_partial(part_path(out))
            ran = there["status"] == OK
            stages.add(tuple(bool(np.any(there[f"{check_}_status"][ran] != PENDING)) for check_ in ("tight", "long")))
    assert len(stages) >= 2, "never interrupted in the middle of the checks"
    assert not different(one, out)
    before = out.read_bytes()
    assert run_study(study, out, resume=True).steps == 0
    assert out.read_bytes() == before


def test_checks_that_failed_are_retried(tmp_path, monkeypatch):
    """A check may take so many times the steps of the run; here as many, and most need
    more."""
    monkeypatch.setattr("nsdrill.app.running.stages.MORE_STEPS", 1)
    free = run_in_memory(study_of(GRID))
    limit = int((free["steps"] + free["rejected"]).max())
    out, whole = tmp_path / "out.h5", tmp_path / "whole.h5"
    outcome = run_study(study_of(GRID, f"simulation.max_steps={limit}"), out)
    assert outcome.failed == 0
    found = read_results(out)
    failed = found["tight_status"] == STEP_LIMIT
    assert failed.any()
    assert not np.any(found["trusted"][failed])
    assert np.all(np.isnan(found["tight_difference"][failed]))
    told = summarize(found)["trust"]
    assert told["failed_checks"]["tight"] == failed.sum()
    ran = found["status"] == OK
    other = [
        (found[f"{name}_status"] == OK) & (found[f"{name}_response"] != found["response"]) for name in ("tight", "long")
    ]
    assert told["response_differs"] == np.count_nonzero(ran & np.any(other, axis=0)), "a failed check found no response"
    assert told["check_failed"] == np.count_nonzero(failed & ~np.any(other, axis=0)) > 0
    run_study(study_of(GRID, "simulation.max_steps=50000000"), out, retry_failed=True)
    run_study(study_of(GRID), whole)
    assert not different(out, whole)


def test_new_thresholds_give_new_trust(tmp_path):
    out, other = tmp_path / "out.h5", tmp_path / "other.h5"
    thresholds = ["classify.trust.tolerance=20", "classify.stick_slip.stick_slip_index=30"]
    run_study(study_of(GRID), out)
    run_study(study_of(GRID, *thresholds), other)
    changed = reclassify(out, thresholds)
    assert changed["trusted"][0] > 0
    assert changed["tight_response"][0] > 0
    assert not different(out, other)


@pytest.fixture(scope="module")
def refined():
    return run_in_memory(study_of(REFINED))


def test_what_is_said_of_it(refined):
    found, told = refined, summarize(refined)["trust"]
    ran = int(np.count_nonzero(found["status"] == OK))
    assert told["agree"] + told["features_differ"] + told["response_differs"] == ran < found["status"].size
    assert told["agree"] == np.count_nonzero(found["trusted"])
    for check_ in ("tight", "long"):
        differs = (found[f"{check_}_response"] != found["response"]) & (found["status"] == OK)
        assert sum(row["points"] for row in told["changed"] if row["check"] == check_) == differs.sum()
    assert any("1e-08" in warning for warning in check(study_of(GRID)).warnings)
    assert not any("Verify" in warning for warning in check(study_of(GRID, "simulation.verify=false")).warnings)


def test_what_was_inferred_is_no_cause_of_distrust(refined):
    """For the operating window: it was not checked because it was not run."""
    assert np.any(refined["status"] == INFERRED)
    distrusted = classes(refined).distrusted
    untrusted = (refined["status"] == OK) & (verdict(refined) == RESPONSE_DIFFERS)
    assert distrusted.sum() == untrusted.sum() > 0


def test_starts_of_an_ensemble_are_checked_too():
    found = run_in_memory(study_of(GRID, "initial.ensemble=3", "sweep.wob=40 kN"))
    assert found["trusted"].shape == (1, 1, 1, 8, 3)
    assert np.all(found["tight_status"] == OK)
    told = summarize(found)["trust"]
    assert told["agree"] + told["features_differ"] + told["response_differs"] == 24


def test_the_tolerance_has_a_floor():
    simulation = replace(study_of(GRID).simulation, rtol=1e-12)
    assert stages.checks(simulation)[0].simulation.rtol == 1e-13

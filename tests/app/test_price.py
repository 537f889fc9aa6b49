"""How long a run takes, told before it begins. Times depend on the machine, so what is
compared here are steps: with a step of one second the price is their number."""

import numpy as np
import pytest

import nsdrill
from nsdrill.app.experiment import prepare
from nsdrill.app.running import price as pricing
from nsdrill.app.running.price import between, price_of, spread
from nsdrill.app.running.run import run_in_memory
from nsdrill.app.running.stages import work_of
from nsdrill.study import parse_study

SPEEDS = "rotary_speed: {from: 2 rad/s, to: 8 rad/s, points: 41}"
SHORT = "simulation: {transient: 60 s, observe: 30 s}\nrecord: {peaks: 0}\n"
CARRIED = f"{SHORT}sweep: {{{SPEEDS}, procedure: up-down}}\n"
STUDIES = {
    "one chain": CARRIED,
    "same start": f"{SHORT}sweep: {{{SPEEDS}, wob: [20 kN, 60 kN]}}\n",
    "starts": f"{SHORT}sweep: {{rotary_speed: [3 rad/s, 4 rad/s, 6 rad/s, 7 rad/s]}}\ninitial: {{ensemble: 16}}\n",
    "samples": f"{SHORT}sweep: {{rotary_speed: [3 rad/s, 5 rad/s, 7 rad/s], procedure: up}}\n"
    "uncertain: {bit.friction.static: {uniform: [0.3, 0.6]}, samples: 16}\n",
    "words": f"{SHORT}sweep: {{{SPEEDS}, drive.kind: [ideal, stiff]}}\n",
    "torsion": f"model: torsion\n{SHORT}sweep: {{{SPEEDS}, procedure: up}}\n",
    "segments": "model: segments\nsimulation: {transient: 2 s, observe: 2 s}\nrecord: {peaks: 0}\n"
    "segments: {pipe: 3, collar: 2}\nsweep: {rotary_speed: {from: 8 rad/s, to: 14 rad/s, points: 13}}\n",
    "implicit": f"{SHORT}sweep: {{{SPEEDS}, procedure: down}}\n".replace("30 s}", "30 s, method: implicit}"),
}


@pytest.fixture
def steps_for_seconds(monkeypatch):
    """A step of the lanes takes a second, and there is one lane, in which they are
    counted."""
    timed = pricing._timed
    monkeypatch.setenv("NSDRILL_LANES", "1")
    monkeypatch.setattr(pricing, "_timed", lambda *inputs: (timed(*inputs)[0], 1.0))
    monkeypatch.setattr(pricing, "TAIL", 0.0)
    monkeypatch.setattr(pricing, "TAIL_OF_CHAINS", 0.0)


@pytest.mark.parametrize("text", STUDIES.values(), ids=STUDIES)
def test_the_truth_is_half_to_twice_the_price(steps_for_seconds, text):
    found = price_of(parse_study(text), 1)
    results = run_in_memory(parse_study(text), workers=1)
    truth = float(np.sum(results["steps"] + results["rejected"]))
    assert found.runs == results["status"].size
    assert 0 < found.timed <= 24
    assert found.low < truth < found.high


def test_checks_and_refinement_are_told_for(steps_for_seconds):
    """Every point checked takes four times as long; of a refined map the coarse grid is the
    least, and the finest, 11 times 4 or so, the most."""
    text = f"{SHORT}sweep: {{rotary_speed: {{from: 2 rad/s, to: 8 rad/s, points: 11}}}}\n"
    plain = price_of(parse_study(text), 1)
    checked = price_of(parse_study(text.replace("30 s}", "30 s, verify: true}")), 1)
    assert checked.seconds == pytest.approx(4.1 * plain.seconds)
    carried = price_of(parse_study(CARRIED.replace("30 s}", "30 s, verify: true}")), 1)
    assert carried.seconds == pytest.approx(4.1 * price_of(parse_study(CARRIED), 1).seconds)  # with one lane
    refined = price_of(parse_study(text.replace("11}}", "11}, refine: 2}")), 1)
    assert refined.runs == 11
    assert refined.high / refined.low == pytest.approx(4.0 * 41 / 11)


def test_of_a_run_that_goes_on_the_missing_points_are_told_for(steps_for_seconds):
    """A tenth of the points, each run to its end as all are in both estimates."""
    text = (
        "simulation: {transient: 1 s, observe: 1 s}\nsweep: {rotary_speed: {from: 2 rad/s, to: 8 rad/s, points: 200}}\n"
    )
    experiment = prepare(parse_study(text))
    work = work_of(experiment)
    whole, part = (pricing.price(experiment, work, 1, missing) for missing in (None, 20))
    assert (whole.runs, part.runs) == (200, 20)
    assert part.high < 0.3 * whole.high


def test_points_are_spread_over_all_axes():
    study = parse_study(f"sweep: {{{SPEEDS}, wob: {{from: 1 kN, to: 90 kN, points: 30}}, procedure: up, along: wob}}")
    plan = prepare(study).plan
    numbers = spread(plan, 12)
    places = dict(zip(["procedure", *plan.axes], np.unravel_index(numbers, plan.grid), strict=True))
    wob, speed = places["wob"], places["rotary_speed"]
    assert len(numbers) == 12
    assert len({*speed.tolist()}) == 12
    assert len({*(wob // 10).tolist()}) == 3  # each third of the weights


def test_times_in_words():
    assert between(75.0, 300.0) == "1.2 to 5 min"
    assert between(3.0, 12.0) == "3 to 12 s"
    assert between(3600.0 * 30, 3600.0 * 120) == "1.2 to 5 days"


def test_a_long_run_begins_with_its_price_and_has_the_same_bits(tmp_path, capsys, monkeypatch):
    """It is told where it is worth it: not of runs of seconds."""
    study = parse_study(CARRIED)
    quiet = nsdrill.run(study, progress=False)
    capsys.readouterr()
    nsdrill.run(study)
    assert "Time:" not in capsys.readouterr().err
    monkeypatch.setattr(pricing, "WORTH", 0.0)
    told = nsdrill.run(study)
    lines = capsys.readouterr().err.splitlines()
    assert next(line for line in lines if "compil" not in line).startswith("Time: about ")
    assert quiet.equals(told)

"""An observation that is too short is told of wherever the results are."""

import pytest

import nsdrill
from nsdrill.app.check import check, lasting_motions
from nsdrill.models.registry import NAMES
from nsdrill.study import parse_study

TEXT = """
modes: {axial: frozen, lateral: frozen}
sweep: {rotary_speed: [4 rad/s, 6 rad/s], procedure: up}
simulation: {transient: TRANSIENT, observe: OBSERVE}
"""


@pytest.mark.parametrize(
    ("transient", "observe", "is_short"), [("11 s", "0.5 s", True), ("11 s", "65 s", False), ("5 s", "60 s", True)]
)
def test_a_short_observation_is_told_by_show_and_window(transient, observe, is_short):
    """The torsional period is 10.6 s."""
    text = TEXT.replace("OBSERVE", observe).replace("TRANSIENT", transient)
    results = nsdrill.run(parse_study(text))
    told = [one for one in check(parse_study(text)).warnings if one.startswith("Short:")]
    assert bool(told) == is_short
    found = nsdrill.window(results)
    assert found["short_observation"]["si"] == told
    warned = [one for one in found["answer"]["warnings"] if one.startswith("OBSERVED TOO SHORTLY")]
    assert len(warned) == is_short
    assert all(one.removeprefix("Short: ") in "".join(warned) for one in told)
    assert ("observed too shortly" in str(nsdrill.show(results))) == is_short


@pytest.mark.parametrize("model", NAMES)
def test_an_observation_of_few_torsional_periods_is_told_of_every_string(model):
    """The first torsional mode of each at its defaults has a period of 5.5 to 10.6 s."""
    text = "model: {}\nsweep: {{rotary_speed: [14 rad/s, 16 rad/s]}}\nsimulation: {{transient: 20 s, observe: {} s}}"
    short, long = (check(parse_study(text.format(model, seconds))).warnings for seconds in (20, 70))
    assert any(one.startswith("Short: the torsional period") for one in short)
    assert not any(one.startswith("Short: the torsional period") for one in long)


def test_a_sweep_that_begins_between_onset_and_fold_of_stick_slip():
    """At 22.24 kN the onset is 2.04 and the fold 4.10 rad/s. Below and above there is nothing
    to say, nor where nothing is brought up."""

    def names(first, procedure="up-down", model="modes: {axial: frozen, lateral: frozen}"):
        sweep = f"sweep: {{rotary_speed: [{first} rad/s, 6 rad/s], procedure: {procedure}}}"
        return [one["name"] for one in lasting_motions(parse_study(f"{model}\n{sweep}"))]

    assert names(2.2) == names(3.5, "up") == names(2.2, "all") == ["stick_slip_onset"]
    assert names(1.9) == names(4.2) == names(2.2, "same") == names(2.2, "down") == []
    shaken = "bit: {surface_amplitude: 1 mm}\ndrive: {kind: soft_torque}"  # to which speed it lasts is not known
    assert all("stick_slip_onset" in names(first, model=shaken) for first in (1.5, 2.2, 3.5, 4.5, 5.5))
    assert "stick_slip_onset" not in names(0.5, model=shaken)
    assert names(0.1, model="model: torsion") == names(5.9, model="model: torsion") == []

"""Stick-slip that ends, on the way up, below the speed at which torsion alone ends it."""

import json
from dataclasses import replace

import numpy as np
import pytest

import nsdrill
from analysis.grids import grid
from nsdrill.analysis.early_end import ends_early
from nsdrill.app.answering.early_ends import stick_slip_ends
from nsdrill.app.datasets import results_in
from nsdrill.study import parse_study
from nsdrill.units import to_si
from nsdrill.words.stick_slip_words import early_lines, early_text

SPEEDS = [to_si(f"{rpm} rpm", "rad/s") for rpm in (60, 75, 80, 85, 90, 110)]
WEIGHTS = [to_si(f"{weight} klbf", "N") for weight in (15, 20, 25)]
FOLD = to_si("101.7 rpm", "rad/s")


def found(*lines: str, fold: float | None = FOLD, way: str = "up") -> list:
    return ends_early(grid({way: [list(lines)]}, SPEEDS, WEIGHTS), lambda settings: [fold] * len(settings))


def test_an_end_below_nine_tenths_of_the_fold_is_told():
    """Of three weights one ends by 85 rpm, which is 0.84 of the fold, one by 110, and one
    gives way to whirl, which may hide it as well."""
    only, whirls = found("sssss.", "ssww..", "sss...")
    assert (only["all"]["wob"], only["free"]) == (WEIGHTS[2], True)
    assert (whirls["all"]["wob"], whirls["free"]) == (WEIGHTS[1], False)
    assert whirls["by"]["value"] == SPEEDS[2]
    other = {**whirls, "at": {"wob": WEIGHTS[1]}, "lobes": 3, "surface_amplitude": {"value": 1e-3, "units": "m"}}
    assert "at 20 klbf by 80 rpm, where it vibrates otherwise; torsion alone gives 101.7" in early_text(
        [other], "field"
    )
    assert only["last"]["value"] == SPEEDS[2]
    assert only["by"] == {"value": SPEEDS[3], "units": "rad/s"}
    assert only["alone"]["value"] == pytest.approx([FOLD, 1.02 * FOLD])
    place = {"at": {"wob": WEIGHTS[2]}, "contact": False}
    lobed = {**only, **place, "lobes": 3, "surface_amplitude": {"value": 1e-3, "units": "m"}}
    told = early_text([lobed], "field")
    assert told.startswith(
        "STICK-SLIP ENDS EARLY on the way up: at 25 klbf by 85 rpm; torsion alone gives 101.7 to 103.7 rpm. "
    )
    assert "bit.surface_amplitude" in told
    graded = early_text([{**lobed, "dry": {"value": 1.2 * FOLD, "units": "rad/s"}}], "field")
    assert "gives 101.7 to 103.7 rpm with the smoothed friction of the runs, and to 122 rpm by dry friction." in graded
    smooth = {**only, **place, "lobes": 0, "surface_amplitude": {"value": 0.0, "units": "m"}}
    alone = early_text([smooth], "field")
    assert "so a step of the sweep ended it" in alone


def test_whirl_that_makes_the_bit_stick_again_does_not_hide_that():
    only, _ = found("ss..SS", "sssssS", "ss...S")
    assert only["last"]["value"] == SPEEDS[1]


def test_a_higher_threshold_ends_no_stick_slip():
    """The bit goes on sticking, at an index of 120 %, to the end of the map; the labels end at 80 rpm."""
    one = grid({"up": [["sss..."] * 3]}, SPEEDS, WEIGHTS)
    one.variables["stick_slip_index"] = np.full(one.shape, 120.0)
    assert ends_early(one, lambda settings: [FOLD] * len(settings)) == []
    one["stick_slip_index"][..., 3:] = 5.0
    assert {found["by"]["value"] for found in ends_early(one, lambda settings: [FOLD] * len(settings))} == {SPEEDS[3]}


@pytest.mark.parametrize(
    ("lobes", "begins", "says", "never"),
    [
        (1, "The lobe of a PDC bit, 1 mm high", "a height of zero shows it", "roller cone"),
        (2, "The 2 lobes, 1 mm high", "the lowest that you expect", "roller cone"),
        (3, "The 3 lobes of a roller cone, 1 mm high", "the lowest that you expect", "PDC"),
    ],
)
def test_the_reason_speaks_of_the_bit_of_the_study(lobes, begins, says, never):
    only = found("sssss.", "ssww..", "sss...")[0]
    told = early_text([{**only, "at": {}, "lobes": lobes, "surface_amplitude": {"value": 1e-3, "units": "m"}}], "si")
    assert f". {begins} (bit.surface_amplitude), shake" in told
    assert says in told
    assert never not in told


def test_the_reason_has_the_lobes_of_the_study_that_was_run():
    """Three of 1 mm by default, where the bit may move along the hole."""
    for modes, lobes in (("{lateral: frozen}", 3), ("{axial: frozen, lateral: frozen}", 0)):
        study = f"""modes: {modes}
operation: {{depth: 5000 m, wob: 66.72 kN}}
sweep: {{rotary_speed: [3 rad/s, 5 rad/s, 6 rad/s], procedure: up}}
simulation: {{transient: 1 s, observe: 1 s}}
"""
        data = results_in(nsdrill.run(parse_study(study), progress=False), "early", ())
        codes = data["response"].copy()
        codes[...] = [2, 0, 0]  # it sticks at 3 rad/s, far below the fold, and is free from there on
        made = {"response": codes, "stick_slip_index": np.broadcast_to([120.0, 5.0, 5.0], codes.shape)}
        (only,) = stick_slip_ends(replace(data, variables={**data.variables, **made}))
        assert only["lobes"] == lobes
        assert (only["surface_amplitude"]["value"] > 0.0) == (lobes > 0)


def test_what_is_no_early_end_is_not_told():
    assert found("ssss..", "ssss..", "ssssss", fold=None) == []
    assert found("......", "sssss.", "ssssss") == []  # none, by 110 rpm, and not ended
    assert found("sss?..", "sssx..", "sss?..") == []  # what follows is not known
    assert found("sss...", "sss...", "sss...", way="down") == []  # a way down ends where stick-slip begins
    assert found("sss...", "sss...", "sss...", way="same") == []  # steady drilling need not begin to stick
    assert list(early_lines([], "si")) == []
    near = grid({"up": [["sss..."] * len(WEIGHTS)]}, SPEEDS, WEIGHTS)  # by 85 rpm, which is 0.95 of the fold
    assert ends_early(near, lambda settings: [SPEEDS[3] / 0.95] * len(settings)) == []


def test_the_lowest_end_is_named_first():
    first, second = found("s.....", "sss...", "sssss.")
    assert (first["all"]["wob"], second["all"]["wob"]) == (WEIGHTS[0], WEIGHTS[1])


def test_along_the_weight_no_stick_slip_is_carried_up_in_speed():
    """Each speed is swept by itself: a bit that does not stick there was never brought there
    sticking."""
    data = grid({"up": [["ss...."] * len(WEIGHTS)]}, SPEEDS, WEIGHTS)
    limit = 2.0 * SPEEDS[-1]
    for along, number in (("rotary_speed", len(WEIGHTS)), ("wob", 0)):
        data.attrs["study_resolved"] = json.dumps({"sweep": {"along": along}})
        assert len(ends_early(data, lambda settings: [limit] * len(settings))) == number

"""A bit that stays stuck is stalled: with a drive whose torque does not break it away, in
every model, with samples and starts; and what is told of it."""

import numpy as np
import pytest

import nsdrill
from nsdrill.models.responses import STALLED

SHORT = "simulation: {transient: 60 s, observe: 40 s}\n"
# The torque to break away is 2/3 x 0.1905 m x 66.72 kN x 0.5 = 4.24 kN m.
SOFT = """\
modes: {axial: frozen, lateral: frozen}
operation: {depth: 5000 m, wob: 66.72 kN}
drive: {kind: soft_torque, torque_limit: 3 kN*m}
initial: {bit_speed: 0 rad/s, drive_speed: 0 rad/s}
"""
SPEEDS = "sweep: {rotary_speed: {from: 3 rad/s, to: 9 rad/s, points: 3}}\n"
MAIN = SOFT + SPEEDS + SHORT
SEGMENTS = """\
model: segments
operation: {wob: 100 kN}
drive: {kind: stiff, torque_limit: 2 kN*m}
initial: {start: rest}
segments: {pipe: 3, collar: 2}
sweep: {rotary_speed: [3 rad/s, 4 rad/s]}
simulation: {transient: 20 s, observe: 20 s}
"""
# Without a limit: an ideal drive winds the string up slowly, and it is observed
# for less than a pause of its stick-slip.
TORSION = """\
model: torsion
operation: {depth: 5000 m, wob: 100 kN}
initial: {bit_speed: 0 rad/s}
sweep: {rotary_speed: [0.6 rad/s, 0.8 rad/s]}
simulation: {transient: 2 s, observe: 2 s}
"""
SAMPLES = SOFT + "uncertain: {bit.friction.static: {uniform: [0.45, 0.55]}, samples: 4}\n" + SPEEDS + SHORT


@pytest.mark.parametrize("study", [MAIN, SEGMENTS, TORSION], ids=["main", "segments", "torsion"])
def test_a_bit_that_does_not_turn_is_stalled_and_never_safe(study, tmp_path):
    path = tmp_path / "out.h5"
    data = nsdrill.run(nsdrill.load_study(study), path).load()
    assert (data.stuck_fraction > 0.99).all()
    assert (data.response == STALLED).all()
    assert data.nsdrill.stalled.all()
    assert not data.nsdrill.sticking.any()
    for severity in (None, 0, 4):
        assert not data.nsdrill.safe(severity).any()
        window = nsdrill.window(path, severity=severity)
        assert window["safe"] == 0
        unseen = {MAIN: ("bit_bounce", "whirl"), SEGMENTS: ("whirl",), TORSION: ("bit_bounce", "whirl")}[study]
        others = {name: None if name in unseen else 0 for name in ("bit_bounce", "stick_slip", "whirl")}
        assert window["obstacles"] == {**others, "stalled": data.response.size}
    assert "stalled" in str(nsdrill.show(path))


def test_by_its_own_threshold(tmp_path):
    path = tmp_path / "out.h5"
    nsdrill.run(nsdrill.load_study(MAIN), path)
    all_the_time = {"classify.stalled.stuck_fraction": 0.9999}
    assert nsdrill.classify(nsdrill.open_results(path).load(), all_the_time).nsdrill.stalled.all()
    with pytest.raises(nsdrill.NsdrillError, match=r"stuck_fraction: found the number 1 .*at most 0\.9999"):
        nsdrill.classify(nsdrill.open_results(path).load(), {"classify.stalled.stuck_fraction": 1.0})
    with pytest.raises(nsdrill.NsdrillError, match=r"classify\.stalled\.stuck_fraction"):
        nsdrill.load_study(MAIN + "classify: {stalled: {stuck_fraction: 1.5}}\n")


def test_a_bit_that_is_stuck_drills_at_its_own_speed(tmp_path):
    """Not at that of the drive, which winds the string up until it lets go."""
    data = nsdrill.run(
        "modes: {axial: frozen, lateral: frozen}\noperation: {wob: 150 kN}\ninitial: {bit_speed: 0 rad/s}\n"
        "sweep: {rotary_speed: [0.6 rad/s, 0.8 rad/s]}\nsimulation: {transient: 2 s, observe: 2 s}\n"
    ).load()
    assert data.nsdrill.stalled.all()
    assert (data.bit_speed_mean < 0.05).all()
    assert (data.rate_of_penetration == 0.0).all()


def test_with_samples_no_share_is_safe(tmp_path):
    path = tmp_path / "out.h5"
    nsdrill.run(nsdrill.load_study(SAMPLES), path)
    found = nsdrill.probability(path)
    assert not found.probability.sel(outcome="safe").any()
    assert (found.probability.sel(outcome="stalled") == 1.0).all()
    window = nsdrill.window(path)
    assert (window["safe"], window["critical"]) == (0, 3)


def test_starts_whose_bit_stalls_are_one_attractor(tmp_path):
    """The index of the creep differs from start to start and separated them."""
    text = SOFT.partition("initial")[0] + "initial: {ensemble: 6, seed: 1}\n" + SHORT
    data = nsdrill.run(nsdrill.load_study(text + "sweep: {rotary_speed: [8 rad/s]}\n"), tmp_path / "out.h5").load()
    assert data.nsdrill.stalled.all()
    assert float(np.ptp(data.stick_slip_index.values)) > 10.0
    assert (data.attractor == 1).all()


def test_files_and_json_have_its_word(tmp_path):
    path = tmp_path / "out.h5"
    data = nsdrill.run(nsdrill.load_study(MAIN), path)
    assert list(data.response.attrs["flag_masks"]) == [1, 2, 4, 8]
    assert data.response.attrs["flag_meanings"].split()[3] == "stalled"
    assert "  stalled                                 3  100.0 %" in str(nsdrill.show(path))
    limits = nsdrill.load_study(MAIN + "classify: {stalled: {stuck_fraction: 0.995}}\n")
    assert limits.resolved["classify"]["stalled"] == {"stuck_fraction": 0.995}
    assert limits.sha256 != nsdrill.load_study(MAIN).sha256

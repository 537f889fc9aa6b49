"""Angles that turn: a motion that repeats but for whole revolutions has settled."""

import numpy as np
import pytest

import nsdrill
from nsdrill.script.angles import REVOLUTION, without_revolutions

TURNING = """@nsdrill.model
def turning(angle=0.0, rate=nsdrill.number(0.5, scale=0.5), turned=0.0, *, damping=0.15, torque=0.25, stiff=0.4):
    return rate, torque - damping * rate - stiff * np.sin(angle + 0.3), rate
"""
FORCED = """@nsdrill.model
def swirling(t, angle=0.1, rate=0.0, *, torque=1.39, omega=0.667, damping=0.5):
    return {"angle": rate, "rate": -np.sin(angle) - damping * rate + torque * np.cos(omega * t)}
"""


def test_the_mean_of_an_angle_is_within_half_a_revolution():
    """Of the last one nothing is left: it turns on."""
    mean, half = np.array([0.9, -0.9, 0.1, 0.9]) * REVOLUTION, np.array([0.1, 0.1, 0.1, 0.6]) * REVOLUTION
    found = without_revolutions({"a_max": mean + half, "a_min": mean - half, "a_mean": mean}, "a")
    assert found["a_mean"] / REVOLUTION == pytest.approx([-0.1, 0.1, 0.1, 0.0])
    assert found["a_max"] / REVOLUTION == pytest.approx([0.0, 0.2, 0.2, 0.0])


@pytest.mark.parametrize(
    ("slope", "angles", "unread"),
    [
        ("np.sin(a) + np.cos(2 * a - b)", ("a", "b"), ()),
        ("np.sin(a - 3 * b) * v", ("a", "b"), ()),
        ("np.sin(a) + 0.1 * a", (), ("b",)),  # a spring winds up
        ("np.sin(0.5 * a)", (), ("b",)),  # two revolutions
        ("np.sin(a) + nsdrill.touching('stop', a - 100.0)", (), ("b",)),
        ("np.sin(a) * np.tanh(b)", ("a",), ()),
        ("np.sin(a * b)", (), ()),
        ("v", (), ("a", "b")),
    ],
)
def test_angles_are_found_in_the_graph(script, slope, angles, unread):
    made = script(
        f"@nsdrill.model\ndef several(a=0.1, v=0.0, b=0.2):\n    return v, -v + {slope}, 1.0 + 0.0 * v\n", "angles_of"
    ).several
    assert (made.reading.angles, made.reading.unread) == (angles, unread)


def test_a_motion_that_turns_has_settled_and_is_one_from_all_starts(script):
    """Below the torque at which it cannot rest, 0.4, a pendulum rests in one of many
    revolutions, or turns at a mean speed of about torque/damping (1.7 rad/s)."""
    made = script(TURNING, "turning_starts").turning
    assert (made.reading.angles, made.reading.unread) == (("angle",), ("turned",))
    assert made.model.scale["angle"] <= np.pi / 8, "a tenth of half a revolution, not of all that it turns"
    data = nsdrill.run(made.study(ensemble=16, spread=1.0, transient=200, observe=200), progress=False)
    turns = data.angle_max - data.angle_min > 2 * np.pi
    assert 0 < int(turns.sum()) < 16
    assert data.settled.values.all()
    assert len(np.unique(np.round((data.angle_mean.values[~turns.values]) / (2 * np.pi)))) > 1, "several revolutions"
    found = nsdrill.attractors(data)[0]["attractors"]
    assert sorted(one["members"] for one in found) == sorted([int(turns.sum()), 16 - int(turns.sum())])


def test_a_forced_motion_that_turns_has_a_period(script):
    """Once a period of the forcing it turns backwards: returns are the same but for a
    revolution."""
    made = script(FORCED, "swirling").swirling
    data = nsdrill.run(made.study(transient=600, observe=400, poincare=32, exponent=True), progress=False)
    steps = np.diff(data.section_angle.values.ravel())
    assert np.abs(steps[np.isfinite(steps)]) == pytest.approx(2 * np.pi, rel=1e-4)
    assert data.settled.values.all()
    assert data.motion.attrs["flag_meanings"].split()[int(data.motion.values.item())] == "periodic"
    assert data.period.values.item() == 1


WEARS = """@nsdrill.model
def pad(t, x=0.0, v=0.1, wear={}, *, force=0.3, rate=0.002):
    return {{"x": v, "v": -x - 0.2 * v + force * np.cos(0.8 * t), "wear": rate * v * v}}
"""


def test_a_state_that_grows_is_judged_where_a_response_is_about_it(script):
    """Nothing reads the wear; it is no angle. Without a response a check says that it does not count."""
    given = {"transient": 100, "observe": 100, "force": [0.4, 0.8]}
    plain = script(WEARS.format("0.0"), "wearing").pad
    assert nsdrill.run(plain.study(**given), progress=False).settled.values.all()
    (told,) = (one for one in nsdrill.check(plain.study(**given)).warnings if one.startswith("Not judged"))
    assert "nothing that pad computes reads wear, and no response is about it" in told
    text = WEARS.format("0.0").replace("def pad(", "def worn(")
    worn = script(text + "\n\nworn.response('gone', 'wear_max', 1.0, limits={'worn': 1.0})\n", "worn").worn
    assert worn.reading.unread == ("wear",), "the reading itself knows of no response"
    assert not any(one.startswith("Not judged") for one in nsdrill.check(worn.study(**given)).warnings)
    assert not nsdrill.run(worn.study(**given), progress=False).settled.values.any()
    text = WEARS.format("nsdrill.number(0.0, 'rad')").replace("def pad(", "def disc(")
    angle = script(text, "turned").disc
    assert not any(one.startswith("Not judged") for one in nsdrill.check(angle.study(**given)).warnings)

"""The drawn states: reproducible, the same whatever their number, and such as a string
can be in."""

from dataclasses import replace

import numpy as np
import pytest
from strings import starts

from nsdrill.models.christoforou_yigit.coefficients import derive
from nsdrill.models.christoforou_yigit.columns import STATE_NAMES
from nsdrill.models.christoforou_yigit.parameters import Bit, Initial, Parameters
from nsdrill.models.starts import hypercube

POINTS = {
    "depth": np.array([500.0, 5000.0, 9000.0]),
    "wob": np.array([0.0, 22.24e3, 100e3]),
    "rotary_speed": np.array([0.5, 3.0, 20.0]),
}


def drawn(
    count: int = 64, seed: int = 0, spread: float = 1.0, point: int = 1, number: object = None
) -> dict[str, np.ndarray]:
    initial = Initial(ensemble=count, seed=seed, spread=spread)
    at = {name: values[point] for name, values in POINTS.items()}
    states = starts(Parameters(), initial, **at, start=np.arange(count) if number is None else number)
    return dict(zip(STATE_NAMES, states.T, strict=True))


def test_the_words_are_those_of_the_generator():
    """Philox 4x64-10 is a published function: these are its first words for the key 0
    as numpy 1.17 to 2 give them."""
    words = np.random.Philox(key=0).random_raw(9)
    assert hypercube(0, 1, len(STATE_NAMES))[0].tolist() == [(int(word) >> 11) / 2**53 for word in words]
    assert hypercube(0, 3, len(STATE_NAMES))[2].tolist() != hypercube(1, 3, len(STATE_NAMES))[2].tolist()


@pytest.mark.parametrize("count", [2, 3, 64, 1000])
def test_a_start_is_the_same_however_many_there_are(count):
    few, many = drawn(count), drawn(1001)
    for name in STATE_NAMES:
        assert few[name].tobytes() == many[name][:count].tobytes(), name


def test_a_start_is_the_same_whatever_is_made_beside_it():
    initial = Initial(ensemble=50, seed=3)
    every = {name: np.repeat(values, 50) for name, values in POINTS.items()}
    together = starts(Parameters(), initial, **every, start=np.tile(np.arange(50), 3))
    some = np.array([149, 3, 77, 76])
    apart = starts(Parameters(), initial, **{n: v[some] for n, v in every.items()}, start=some % 50)
    assert apart.tobytes() == together[some].tobytes()


def test_the_same_number_at_every_point():
    """Common random numbers: in units of the operating point a start is the same
    everywhere."""
    shapes = []
    for point in range(3):
        states = drawn(point=point)
        shapes.append((states["bit_speed"] / POINTS["rotary_speed"][point], states["drive_angle"], states["x"]))
    for other in shapes[1:]:
        for a, b in zip(shapes[0], other, strict=True):
            np.testing.assert_allclose(a, b, rtol=1e-12)


@pytest.mark.parametrize("point", [0, 1, 2])
@pytest.mark.parametrize("spread", [1.0, 0.3])
def test_states_are_admissible_and_fill_their_range(point, spread):
    depth, wob, speed = (values[point] for values in POINTS.values())
    k = derive(Parameters(), depth, wob, speed)
    s = drawn(4000, spread=spread, point=point)
    assert all(np.all(np.isfinite(values)) for values in s.values())
    radius = np.hypot(s["x"], s["y"]) / (spread * k.gap)
    assert 0.99 < radius.max() <= 1.0, "inside the hole, and up to the wall"
    # Uniform over the disc: the square of the radius is uniform. Kolmogorov-Smirnov:
    # 1.63/sqrt(4000) at 1 %.
    assert np.max(np.abs(np.sort(radius**2) - np.linspace(0, 1, 4000))) < 0.026
    fastest = spread * max(k.gap * np.sqrt(k.k_bend / k.m_l), 0.1143 * speed)
    assert 0.98 < np.hypot(s["vx"], s["vy"]).max() / fastest <= 1.0
    rest = wob / (k.k_a + 25e6)
    depth_range = spread * 2 * (rest + 1e-3)
    assert np.abs(s["z"] + rest).max() <= depth_range
    assert s["z"].max() > 0.95 * depth_range - rest
    assert np.abs(s["vz"]).max() <= spread * 2 * 1e-3 * 3 * speed
    assert np.all(s["bit_speed"] >= (1 - spread) * speed)
    assert np.all(s["bit_speed"] <= (1 + spread) * speed)
    assert np.all(s["twist"] <= 0.0), "wound up, never beyond the unwound string"
    assert (s["drive_angle"].min() >= 0) & (s["drive_angle"].max() < 2 * np.pi)


def test_the_twist_reaches_beyond_the_torque_at_rest():
    k = derive(Parameters(), 5000.0, 22.24e3, 3.0)
    at_rest = (22.24e3 * (2 / 3 * 0.1905 * 0.5 + k.cutting_arm) + 50 * 3.0) / k.k_t
    twist = drawn(4000)["twist"]
    assert -1.5 * at_rest <= twist.min() < -1.45 * at_rest
    assert twist.max() > -0.05 * at_rest


def test_a_small_spread_is_steady_drilling():
    """Against the steady state worked out by hand: torques of rock and damping, mu at 3
    rad/s 0.3/10 + 0.2."""
    s = drawn(100, spread=1e-6)
    k = derive(Parameters(), 5000.0, 22.24e3, 3.0)
    torque = 22.24e3 * (2 / 3 * 0.1905 * 0.23 + k.cutting_arm) + 50 * 3.0
    np.testing.assert_allclose(s["twist"], -torque / k.k_t, rtol=1e-5)
    np.testing.assert_allclose(s["bit_speed"], 3.0, rtol=1e-5)
    np.testing.assert_allclose(s["z"], -22.24e3 / (k.k_a + 25e6), rtol=1e-5)
    assert np.abs([s["x"], s["y"], s["vx"], s["vy"], s["vz"]]).max() < 1e-6


def test_a_flat_rock_and_no_weight_are_allowed():
    flat = replace(Parameters(), bit=Bit(surface_amplitude=0.0))
    states = starts(flat, Initial(ensemble=5), 500.0, 0.0, 1.0, np.arange(5))
    assert np.all(states[:, STATE_NAMES.index("z")] == 0.0)


def test_a_slice_is_a_grid_and_the_rest_as_given():
    plane = {"vx": {"from": -1.0, "to": 1.0, "points": 3}, "x": {"from": 0.0, "to": 0.01, "points": 2}}
    initial = Initial(y=2e-3, slice=plane)
    assert initial.starts == 6
    states = starts(Parameters(), initial, 2000.0, 22.24e3, 3.0, np.arange(6))
    plain = starts(Parameters(), initial, 2000.0, 22.24e3, 3.0)[0]
    assert states[:, 0].tolist() == [0.0] * 3 + [0.01] * 3, "the order of the states, not that of the study"
    assert states[:, 1].tolist() == [-1.0, 0.0, 1.0] * 2
    assert np.all(states[:, 2:] == plain[2:])


def test_a_start_that_is_not_there_is_refused():
    with pytest.raises(ValueError, match="allowed: 0 to 63"):
        drawn(number=np.array([64]))

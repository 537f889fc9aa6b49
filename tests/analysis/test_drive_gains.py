"""The gains of a drive from logs of known drives."""

import numpy as np
import pytest
from scipy.signal import lfilter

import nsdrill
from nsdrill.analysis.drive_gains import Stretch, gains_of_drive

K_P, K_I, J = 4000.0, 6000.0, 2900.0


def synthetic(noise=0.0, step=0.1, inertia=0.0, seed=1):
    """A top that swings in stick-slip, and the torque of the law."""
    t = np.arange(0.0, 120.0, step)
    swing = 0.4 * np.sin(2 * np.pi * t / 4.1) + 0.15 * np.sin(2 * np.pi * t / 2.05 + 1.0)
    lag = -0.4 * 4.1 / (2 * np.pi) * np.cos(2 * np.pi * t / 4.1)
    lag -= 0.15 * 2.05 / (2 * np.pi) * np.cos(2 * np.pi * t / 2.05 + 1.0)
    rate = 0.4 * 2 * np.pi / 4.1 * np.cos(2 * np.pi * t / 4.1)
    rate += 0.15 * 2 * np.pi / 2.05 * np.cos(2 * np.pi * t / 2.05 + 1.0)
    draw = np.random.default_rng(seed).normal
    torque = 9000.0 - K_P * swing - K_I * lag - inertia * rate
    return Stretch(t, 7.0 + swing + draw(0, 0.1 * noise, len(t)), torque + draw(0, 1000 * noise, len(t)), 7.0)


def test_the_gains_of_an_exact_log():
    found = gains_of_drive([synthetic(step=0.02)])
    assert found.damping == pytest.approx(K_P, rel=1e-3)
    assert found.stiffness == pytest.approx(K_I, rel=1e-3)
    assert found.sure


def test_noise_is_in_the_errors():
    """The errors that are told are those of repeated logs."""
    several = [gains_of_drive([synthetic(0.3, seed=seed)]) for seed in range(40)]
    for name, place in (("damping", 0), ("stiffness", 1)):
        values = np.array([getattr(one, name) for one in several])
        told = np.median([one.errors[place] for one in several])
        assert 0.6 < told / values.std() < 1.7, name
    assert abs(np.mean([one.stiffness for one in several]) / K_I - 1) < 0.05


def test_a_set_speed_that_is_a_little_off_changes_nothing():
    log = synthetic(step=0.02)
    off = gains_of_drive([log._replace(set_speed=7.05)])
    assert off.stiffness == pytest.approx(K_I, rel=2e-3)


def test_the_torque_in_the_string_needs_the_inertia():
    log = synthetic(step=0.02, inertia=J)
    found = gains_of_drive([log], inertia=True)
    assert found.inertia == pytest.approx(J, rel=0.02)
    assert found.damping == pytest.approx(K_P, rel=0.01)


def test_what_says_nothing_of_the_gains_is_told():
    t = np.arange(0.0, 60.0, 0.1)
    noise = np.random.default_rng(1).normal(0.0, 1.0, (2, len(t)))
    alone = gains_of_drive([Stretch(t, 7.0 + 0.3 * noise[0], 9000.0 + 500 * noise[1], 7.0)])
    assert not alone.sure
    assert any("does not follow" in doubt for doubt in alone.doubts)
    held = gains_of_drive([Stretch(t, 7.0 + 1e-4 * noise[0], 9000.0 + 500 * noise[1], 7.0)])
    assert any("stiff drive" in doubt for doubt in held.doubts)
    for one in (alone, held):
        assert all("not determined" in line and "+-" not in line for line in one.sentences())
        assert one.study() == "# drive: its gains are not determined"
    log = synthetic(step=0.02)
    turned = gains_of_drive([log._replace(torque=-log.torque)])
    assert [doubt.partition(" is ")[0] for doubt in turned.doubts] == ["K_p", "K_i"]
    assert all("negative" in doubt for doubt in turned.doubts)
    sine = 0.4 * np.exp(2j * np.pi * t / 4.1)
    ratio = -(K_P + K_I / (2j * np.pi / 4.1) + J * 2j * np.pi / 4.1)
    single = gains_of_drive([Stretch(t, 7.0 + sine.real, 9000.0 + (ratio * sine).real, 7.0)], inertia=True)
    assert "a single period, 4.1 s" in single.doubts[0]
    assert f"without a delay K_p {K_P:.4g} and K_i/w - J w {ratio.imag:.4g} N m s/rad" in single.doubts[0]
    with pytest.raises(ValueError, match="no stretch with 30 rows"):
        gains_of_drive([Stretch(t[:20], t[:20], t[:20], 7.0)])


@pytest.mark.parametrize("model", ["christoforou_yigit", "segments"])
def test_the_gains_of_a_run_with_known_ones(model):
    """A string in stick-slip below a drive of known gains. The surface torque is that of
    the string, so the inertia of the machine is found too."""
    study = f"""
model: {model}
drive: {{kind: pi, inertia: 2900 kg*m^2, damping: 4000 N*m*s/rad, stiffness: 6000 N*m/rad}}
operation: {{depth: 3000 m, wob: 100 kN, rotary_speed: {"3 rad/s" if model != "segments" else "10 rad/s"}}}
""" + ("modes: {lateral: frozen, axial: frozen}\n" if model != "segments" else "initial: {start: rest}\n")
    trace = nsdrill.simulate(study, duration="120 s", sample="0.05 s").sel(time=slice(40, None))
    speed = float(nsdrill.load_study(study).operation.rotary_speed)
    found = gains_of_drive(
        [Stretch(trace.time.values, trace.drive_speed.values, trace.surface_torque.values, speed)], inertia=True
    )
    assert found.share > 0.99
    assert found.damping == pytest.approx(4000.0, rel=0.05)
    assert found.stiffness == pytest.approx(6000.0, rel=0.05)
    assert nsdrill.load_study({"drive": {"kind": "pi"}})
    assert found.study().startswith("drive: {kind: pi, damping: ")


TRUTH = {"damping": 1188.0, "stiffness": 3231.0, "inertia": 2900.0}
RPM = np.pi / 30.0


@pytest.fixture(scope="module")
def rig():
    """Ten minutes of stick-slip under a drive of known gains, as the string has the torque."""
    study = """
model: torsion
drillstring: {torsional_damping: 20 N*m*s/rad}
drive: {kind: pi, inertia: 2900 kg*m^2, damping: 1188 N*m*s/rad, stiffness: 3231 N*m/rad}
operation: {depth: 2000 m, wob: 120 kN, rotary_speed: 35 rpm}
bit: {friction: {static: 0.6, dynamic: 0.25}}
"""
    trace = nsdrill.simulate(study, duration="300 s", sample="0.1 s").sel(time=slice(60, None))
    return Stretch(trace.time.values, trace.drive_speed.values, trace.surface_torque.values, 35 * RPM)


def late(values, rows):
    return np.concatenate([np.full(rows, values[0]), values[:-rows]])


def smoothed(log):
    return log._replace(speed=np.convolve(log.speed, np.ones(11) / 11, "same"))


DRAW = np.random.default_rng(1)
AS_LOGGED = {
    "all": (lambda log: log, 0.0),
    "a sample a second": (lambda log: Stretch(*(one[::10] for one in log[:3]), log.set_speed), 0.0),
    "rounded to 1 rpm": (lambda log: log._replace(speed=np.round(log.speed / RPM) * RPM), 0.0),
    "torque late by 0.5 s": (lambda log: log._replace(torque=late(log.torque, 5)), 0.5),
    "torque late by 1 s": (lambda log: log._replace(torque=late(log.torque, 10)), 1.0),
    "speed late by 1 s": (lambda log: log._replace(speed=late(log.speed, 10)), -1.0),
    "noise of 2 rpm": (lambda log: log._replace(speed=log.speed + DRAW.normal(0, 2 * RPM, len(log.speed))), 0.0),
    "speed smoothed over 1.1 s": (smoothed, 0.0),
}


@pytest.mark.parametrize("name", AS_LOGGED)
def test_what_a_rig_does_to_a_log_does_not_change_the_gains(rig, name):
    change, delay = AS_LOGGED[name]
    found = gains_of_drive([change(rig)], inertia=True)
    assert found.sure
    for (gain, value), error in zip(TRUTH.items(), found.errors, strict=True):
        assert abs(getattr(found, gain) - value) < 2.0 * error, gain
        assert error < 0.1 * value, gain
    assert abs(found.delay[0] - delay) < 2.0 * found.delay[1]
    told = " ".join(found.sentences())
    assert (f"The log has the {'torque' if delay > 0 else 'speed'} {abs(delay):.2g} +- " in told) == (delay != 0.0)


def filtered(values, time):
    """After a filter of the first order, from samples of 0.1 s."""
    return lfilter([0.1 / time], [1.0, 0.1 / time - 1.0], values - values[0]) + values[0]


REFUSED = {
    "torque filtered by 1 s": (lambda log: log._replace(torque=filtered(log.torque, 1.0)), "off the law by"),
    "torque filtered by 4 s": (lambda log: log._replace(torque=filtered(log.torque, 4.0)), "the law explains"),
    "speed filtered by 1 s": (lambda log: log._replace(speed=filtered(log.speed, 1.0)), "off the law by"),
    "mean speed of 3 s": (
        lambda log: log._replace(speed=np.convolve(log.speed, np.ones(30) / 30, "same")),
        "speed less than the law needs",
    ),
    "torque late by 5 s": (lambda log: log._replace(torque=late(log.torque, 50)), ""),
    "torque cut off": (lambda log: log._replace(torque=np.minimum(log.torque, 7000.0)), ""),
    "rounded to 10 rpm": (lambda log: log._replace(speed=np.round(log.speed / RPM / 10) * RPM * 10), ""),
    "a sample in 2 s": (lambda log: Stretch(*(one[::20] for one in log[:3]), log.set_speed), "+-"),
    "a sample in 3 s": (lambda log: Stretch(*(one[::30] for one in log[:3]), log.set_speed), "a single period"),
    "no torque": (lambda log: log._replace(torque=np.full_like(log.torque, 5000.0)), "does not follow"),
    "torque of another log": (lambda log: log._replace(torque=log.torque[::-1]), "does not follow"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_log_that_is_not_one_of_the_law_is_refused_with_the_reason(rig, name):
    change, reason = REFUSED[name]
    found = gains_of_drive([change(rig)], inertia=True)
    assert not found.sure
    assert reason in " ".join(found.doubts)


@pytest.mark.parametrize("lost", ["some rows", "a gap", "rows without numbers", "times twice"])
def test_rows_that_are_missing_change_nothing(rig, lost):
    chance = np.random.default_rng(2).random(len(rig.time))
    kept = np.abs(rig.time - 180.0) > 8.0 if lost == "a gap" else chance > 0.3
    log = Stretch(*(one[kept] for one in rig[:3]), rig.set_speed)
    if lost == "rows without numbers":
        log = rig._replace(torque=np.where(kept, rig.torque, np.nan))
    if lost == "times twice":
        log = rig._replace(time=np.repeat(rig.time[::2], 2)[: len(rig.time)])
    found = gains_of_drive([log], inertia=True)
    assert found.sure
    for (gain, value), error in zip(TRUTH.items(), found.errors, strict=True):
        assert abs(getattr(found, gain) - value) < 2.0 * error, gain


def log_of_a_rig(seed, inertia):
    """(stretches, K_p, K_i, J) of a log with gains, period, harmonics, sampling, noise,
    rounding, smoothing and delay by chance."""
    draw = np.random.default_rng(seed)
    gains = np.exp(draw.uniform(np.log([400, 800, 1000]), np.log([4000, 8000, 4000])))
    period, length, decay = draw.uniform(3, 10), draw.uniform(60, 300), draw.uniform(0.15, 0.5)
    step = min(draw.choice([0.05, 0.1, 0.2, 0.5, 1.0]), period / 6)
    delay, smooth = draw.uniform(-1, 1) * draw.integers(2), draw.choice([0.0, 0.0, 0.3, 1.0])
    noise, rounding = RPM * draw.choice([0.0, 0.2, 0.5, 1.0, 2.0]), RPM * draw.choice([0.0, 0.1, 0.5, 1.0])
    draft, digits = draw.choice([0.0, 50.0, 200.0, 500.0]), draw.choice([0.0, 10.0, 100.0])
    base = draw.uniform(3, 10)
    stretches = []
    for place in range(draw.integers(1, 3)):
        t = np.arange(0.0, length, step)
        s = 2j * np.pi * (1 + 0.03 * place) / period * np.arange(1, 9)
        size = draw.uniform(0.1, 0.3) * base * decay ** np.arange(8) * draw.uniform(0.6, 1.4, 8)
        size = size * np.exp(2j * np.pi * draw.uniform(0, 1, 8))
        ratio = -(gains[0] + gains[1] / s + (gains[2] * s if inertia else 0.0)) * np.exp(-s * delay)
        waves = np.exp(np.outer(t, s))
        speed = (waves @ (size * np.sinc(np.abs(s) * smooth / 2 / np.pi))).real + base
        torque = (waves @ (size * ratio)).real + 9000.0
        speed, torque = speed + draw.normal(0, noise, len(t)), torque + draw.normal(0, draft, len(t))
        speed = np.round(speed / rounding) * rounding if rounding else speed
        torque = np.round(torque / digits) * digits if digits else torque
        stretches.append(Stretch(t, speed, torque, base))
    return stretches, gains[: 2 + inertia]


@pytest.mark.parametrize("inertia", [True, False])
def test_the_truth_is_within_two_errors(inertia):
    """In nine logs of ten that give gains; half of the logs do."""
    off = []
    for seed in range(60):
        stretches, gains = log_of_a_rig(seed, inertia)
        found = gains_of_drive(stretches, inertia=inertia)
        if found.sure:
            values = (found.damping, found.stiffness, found.inertia)[: 2 + inertia]
            off.append(np.abs(np.array(values) - gains) / found.errors)
    assert len(off) >= 30
    assert (np.array(off) < 2.0).mean(axis=0).min() >= 0.9
    assert np.mean(np.max(off, axis=1) < 2.0) >= 0.9
    assert np.median(off) > 0.1  # errors that contain the truth because they are large say nothing

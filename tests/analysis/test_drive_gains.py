"""The gains of a drive from logs of known drives."""

import numpy as np
import pytest

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
    assert "Do not use them" in held.sentences()[1]
    log = synthetic(step=0.02)
    turned = gains_of_drive([log._replace(torque=-log.torque)])
    assert [doubt.partition(" is ")[0] for doubt in turned.doubts] == ["K_p", "K_i"]
    assert all("negative" in doubt for doubt in turned.doubts)
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

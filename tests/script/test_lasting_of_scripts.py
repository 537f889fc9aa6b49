"""What a window says of a script's model beside free or not: what goes on once it has begun, and a rest that a
disturbance leaves."""

import numpy as np
import pytest

import nsdrill
from nsdrill.models import registry


def turning(angle=0.0, rate=0.0, *, torque=0.5, damping=0.1):
    """A pendulum under a constant torque: it rests up to 1, and turns on down to 4 damping / pi."""
    return rate, torque - np.sin(angle) - damping * rate


def resting(x=0.0, v=0.0, *, mu=0.05):
    """At rest where the slightest disturbance grows to a cycle of amplitude 2."""
    return v, mu * (1 - x**2) * v - x


@pytest.fixture
def model_of():
    made = []

    def model(equations, response):
        made.append(equations.__name__)
        return nsdrill.model(equations, responses={"bad": response})

    yield model
    for name in made:
        registry.withdraw(name)


def test_what_goes_on_once_it_has_begun_is_told(model_of, tmp_path):
    """The file's own way down shows it; the answer said that no run tells."""
    study = model_of(turning, ("rate_mean", 0.5)).study(
        torque=(0.05, 1.2, 24), procedure="up-down", transient=300, observe=100
    )
    nsdrill.run(study, tmp_path / "a.h5", progress=False)
    found = nsdrill.window(str(tmp_path / "a.h5"))
    assert found["answer"]["recover"]["outcome"] == "ends"
    assert found["answer"]["recover"]["at"]["parameters_torque"] == pytest.approx(4 * 0.1 / np.pi, abs=0.05)
    assert "once started, ends when lowered to torque 0.1" in found["answer"]["sentence"]
    assert "pick up" not in str(found)


def test_samples_tell_in_how_many_it_goes_on(model_of, tmp_path):
    study = model_of(turning, ("rate_mean", 0.5)).study(
        torque=(0.05, 1.2, 8),
        procedure="up-down",
        transient=200,
        observe=50,
        uncertain={"damping": {"uniform": [0.05, 0.4]}, "samples": 40},
    )
    nsdrill.run(study, tmp_path / "a.h5", progress=False)
    found = nsdrill.window(str(tmp_path / "a.h5"))["answer"]
    assert found["share"]["any_history"] < 0.5 < found["share"]["probability"]
    assert any("it may go on here in" in line for line in found["lines"])


def test_a_rest_that_a_disturbance_leaves_is_not_known(model_of, tmp_path):
    """Without a section there is no kind of motion, but what does not move rests."""
    study = model_of(resting, ("x_max", 0.5)).study(mu=(0.01, 0.1, 4), transient=50, observe=50, exponent=True)
    data = nsdrill.run(study, tmp_path / "a.h5", progress=False)
    assert not data.nsdrill.known.values.any()
    found = nsdrill.window(str(tmp_path / "a.h5"))
    assert found["unstable_motion"]["runs"] == 4
    assert found["answer"]["kind"] == "unknown"

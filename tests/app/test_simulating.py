"""The point of a simulation is judged as a study is."""

import pytest

import nsdrill


def test_a_value_that_replaces_an_axis_is_judged_as_that_of_a_study():
    """With an axis over the static coefficient its value in the study counts no more; that of the point does."""
    study = {
        "sweep": {"bit.friction.static": [0.5, 0.6], "procedure": "up-down", "along": "bit.friction.static"},
        "bit": {"friction": {"static": 0.5, "dynamic": 0.4}},
    }
    with pytest.raises(nsdrill.NsdrillError, match=r"allowed: at most bit\.friction\.static, which is the number 0\.1"):
        nsdrill.simulate(study, at={"bit.friction.static": 0.1}, duration=1.0)
    assert nsdrill.simulate(study, at={"bit.friction.static": 0.55}, duration=1.0).sizes["time"] > 1

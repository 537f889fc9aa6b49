"""A trace with too few samples for its motion says so: extremes that lie between two samples are
not in it, though each sample is right."""

import numpy as np
import pytest

import nsdrill
from nsdrill.analysis.coarse import coarse_samples
from nsdrill.errors import RunWarning

STUDY = """\
model: torsion
operation: {depth: 2000 m, wob: 100 kN, rotary_speed: 8 rad/s}
simulation: {transient: 10 s, observe: 20 s}
"""  # a stick-slip cycle of about 5 s


def simulated(sample):
    return nsdrill.simulate(nsdrill.study.load.parse_study(STUDY, "a study"), sample=sample)


def test_samples_farther_apart_than_a_tenth_of_the_period_are_told():
    fine = simulated("10 ms")
    with pytest.warns(RunWarning, match="COARSE SAMPLES: 5 samples, one every 7 s, and the shortest period that is"):
        coarse = simulated("7 s")
    places = np.rint(coarse.time.values / 0.01).astype(int)
    assert coarse.bit_speed.values == pytest.approx(fine.bit_speed.values[places], abs=1e-6)  # each is right
    assert float(coarse.bit_speed.max()) < 0.9 * float(fine.bit_speed.max())  # the extremes are not
    shown = nsdrill.show(coarse)
    assert "5 over 28 s of 30 s;" in shown
    assert "Least and greatest of 5 samples, one every 7 s:" in shown
    assert "COARSE SAMPLES: 5 samples" in shown
    assert "--sample" in shown or "sample=" in shown
    shown = nsdrill.show(fine)
    assert "Least and greatest of 3001 samples, one every 0.01 s:" in shown
    assert "COARSE" not in shown


@pytest.mark.parametrize(("sample", "is_coarse"), [("10 ms", False), ("7 s", True)])
def test_pictures_mark_coarse_samples_and_say_so(sample, is_coarse):
    from matplotlib.lines import Line2D

    with pytest.warns(RunWarning) if is_coarse else __import__("contextlib").nullcontext():
        data = simulated(sample)
    for kind in ("histories", "phase"):
        figure = nsdrill.plot(data, kind=kind)
        assert ("COARSE SAMPLES, one every 7 s" in figure.get_suptitle()) == is_coarse
        lines = [one for one in figure.findobj(Line2D) if str(one.get_gid()).startswith(("history:", "phase:"))]
        assert lines
        assert all((one.get_marker() == ".") == is_coarse for one in lines)


@pytest.mark.parametrize(("sample", "is_coarse"), [(0.1, False), (60.0, True)])
def test_where_no_period_is_known_the_steps_of_the_run_tell(sample, is_coarse):
    """2,000 steps in 600 s are 3.3 steps a second."""
    attrs = {"steps": 2000, "transient": 200.0, "observe": 400.0}
    told = coarse_samples(attrs, np.arange(0.0, 600.5, sample))
    assert bool(told) == is_coarse
    if is_coarse:
        assert "the run took 200 steps from one to the next" in told
        assert "has enough" in told


def test_one_sample_and_none_are_not_judged():
    for time in (np.zeros(0), np.zeros(1)):
        assert coarse_samples({"shortest_period": 5.0, "steps": 10}, time) == ""

"""One study up, down and from a start at every point: ``sweep.procedure: all``."""

import matplotlib.pyplot
import numpy as np
import pytest

import nsdrill
from app.alike import alike
from nsdrill.errors import InputError

STUDY = """
title: Three ways
operation: {depth: 2000 m}
sweep:
  wob: [20 kN, 60 kN]
  rotary_speed: [2 rad/s, 4 rad/s, 6 rad/s]
  procedure: all
  along: rotary_speed
simulation: {transient: 3 s, observe: 3 s}
record: {peaks: 4}
"""


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    path = tmp_path_factory.mktemp("all") / "all.h5"
    nsdrill.run(STUDY, path)
    return path


def test_each_way_has_the_bits_of_a_study_of_its_own(out):
    found = nsdrill.open_results(out)
    assert found.procedure.values.tolist() == ["up", "down", "same"]
    both = nsdrill.run(STUDY, set={"sweep.procedure": "up-down"})
    alone = nsdrill.run(STUDY, set={"sweep.procedure": "same"})
    alike(found.sel(procedure=["up", "down"]), both)
    alike(found.sel(procedure="same"), alone)
    assert not np.array_equal(found.final_state.sel(procedure="same"), found.final_state.sel(procedure="up"))


@pytest.mark.parametrize(
    "change", [{}, {"simulation.verify": True}, {"sweep.refine": 1}, {"simulation.method": "auto"}]
)
def test_an_interrupted_run_goes_on(tmp_path, change, monkeypatch):
    from nsdrill.app.running import stages

    change = {
        **change,
        **({"sweep.wob": {"from": "20 kN", "to": "60 kN", "points": 3}} if "sweep.refine" in change else {}),
    }
    whole = nsdrill.run(STUDY, set=change)
    written, store = [0], stages.RunStages.write

    def stopping(self, points, records):
        store(self, points, records)
        written[0] += len(points)
        if written[0] >= 5:
            raise KeyboardInterrupt

    monkeypatch.setattr(stages.RunStages, "write", stopping)
    with pytest.raises(KeyboardInterrupt):
        nsdrill.run(STUDY, tmp_path / "part.h5", set=change, workers=1)
    monkeypatch.setattr(stages.RunStages, "write", store)
    nsdrill.run(STUDY, tmp_path / "part.h5", set=change, resume=True, workers=2)
    alike(nsdrill.open_results(tmp_path / "part.h5"), whole)


def test_a_point_is_replayed_on_each_way(out):
    for way in ("up", "down", "same"):
        trace = nsdrill.replay(out, wob="60 kN", rotary_speed="4 rad/s", procedure=way)
        assert trace.attrs["procedure"] == way
    with pytest.raises(InputError, match="up and down and same"):
        nsdrill.replay(out, wob="60 kN", rotary_speed="4 rad/s")


@pytest.mark.parametrize("kind", ["bifurcation", "value", "map", "window"])
def test_pictures_show_all_three(out, kind):
    figure = nsdrill.plot(out, kind=kind)
    names = {str(artist.get_gid()) for artist in figure.findobj()}
    if kind in ("value", "bifurcation"):
        for way in ("up", "down", "same"):
            assert any(f":{way}" in name for name in names), way
    matplotlib.pyplot.close(figure)


def test_it_is_shown_answered_and_compared(out):
    for way in ("up", "down", "same"):
        assert f"Responses, {way}:" in nsdrill.show(out)
    assert nsdrill.window(out)["answer"]["sentence"]
    nsdrill.hysteresis(out)
    assert nsdrill.diff(out, nsdrill.run(STUDY, set={"bit.friction.static": 0.45}))

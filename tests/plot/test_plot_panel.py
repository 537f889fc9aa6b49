"""One panel of a picture alone, limits of the y axis, and the kinds that a file can be
drawn as."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from made_up import make_results
from matplotlib.figure import Figure

import nsdrill
from nsdrill import plot
from nsdrill.data import Results, Trace
from nsdrill.plot.look import look_of
from nsdrill.plot.registry import all_kinds
from nsdrill.store.dataset import to_dataset


def labels(figure: Figure) -> list[str]:
    return [axes.get_ylabel() for axes in figure.axes]


@pytest.mark.parametrize("kind", ["bifurcation", "summary"])
def test_a_panel_along_an_axis_is_the_same_alone(speeds: Results, kind: str) -> None:
    whole = plot.draw(speeds, kind)
    for axes in whole.axes[1:]:
        name = str(axes.get_label())
        (alone,) = plot.draw(speeds, kind, panel=name).axes
        assert alone.get_ylabel().replace("\n", " ") == axes.get_ylabel().replace("\n", " ")
        assert alone.get_xlabel() == "Rotary speed [rad/s]"
        assert alone.get_xlim() == axes.get_xlim()
        assert alone.get_ylim() == pytest.approx(axes.get_ylim())
        assert [line.get_gid() for line in alone.lines] == [line.get_gid() for line in axes.lines]
        for one, other in zip(alone.lines, axes.lines, strict=True):
            assert np.array_equal(one.get_xydata(), other.get_xydata(), equal_nan=True)


def test_a_name_may_be_shortened_where_it_is_clear(speeds: Results) -> None:
    assert labels(plot.draw(speeds, "bifurcation", panel="radius")) == ["Radial peaks $r$ [mm]"]
    with pytest.raises(nsdrill.InputError, match="found 'peaks'; allowed here: 'axial_peaks', 'bit_speed_peaks'"):
        plot.draw(speeds, panel="peaks")


def test_panels_of_maps_are_named_by_the_way_the_state_was_carried() -> None:
    data = make_results(wob=np.linspace(1e4, 6e4, 5), rotary_speed=np.linspace(1, 8, 9), procedures=("up", "down"))
    whole = plot.draw(data, "map")
    for number, name in enumerate(("up", "down", "compared")):
        (alone,) = plot.draw(data, "map", panel=name).axes
        assert alone.get_ylabel() == "Weight on bit [kN]"
        assert alone.get_title() == whole.axes[number].get_title()
        assert [one.get_gid() for one in alone.collections] == [one.get_gid() for one in whole.axes[number].collections]
    figure = plot.draw(data, "stick_slip_index", panel="down")
    assert [axes.get_label() for axes in figure.axes[1:]] == ["<colorbar>"]


@pytest.mark.parametrize(
    ("panel", "kind"), [("orbit", None), ("phase", "trace"), ("section", None), ("wall_force", "trace")]
)
def test_panels_of_a_trace(trace: Trace, panel: str, kind: str | None) -> None:
    """Those that were kinds of their own are drawn as they were."""
    figure = plot.draw(trace, kind, panel=panel)
    if panel in all_kinds():
        alone = plot.draw(trace, panel)
        assert labels(figure) == labels(alone)
        assert figure.get_size_inches() == pytest.approx(alone.get_size_inches())
    else:
        assert labels(figure) == ["Wall force [kN]"]


def test_every_panel_in_axes_of_a_user(speeds: Results, trace: Trace) -> None:
    """Also where the user's panels share their axes."""
    figure = Figure()
    left, right = figure.subplots(1, 2, sharex=True)
    left.set_title("mine")
    data = to_dataset(speeds)
    assert nsdrill.plot(data, panel="bit_speed_peaks", ax=left) is figure
    assert nsdrill.plot(data, "stick_slip_index", ax=right) is figure
    assert left.get_title() == "mine"
    assert left.get_ylabel().startswith("Bit speed peaks")
    assert right.get_ylabel().startswith("Stick-slip index")
    assert left.get_xlim() == right.get_xlim() == plot.draw(speeds).axes[-1].get_xlim()
    assert len(figure.axes) == 2
    axes = Figure().subplots()
    nsdrill.plot(to_dataset(trace), panel="bit_force", ax=axes)
    assert axes.get_ylabel().startswith("Bit force")
    assert axes.get_xlabel() == "Time [s]"


def test_limits_of_the_y_axis_with_units(speeds: Results) -> None:
    def shown(**look: Any) -> list[tuple[float, float]]:
        return [axes.get_ylim() for axes in plot.draw(speeds, look=look_of(**look)).axes]

    usual, limited = shown(), shown(ylim=("0 rpm", "60 rpm"))
    assert limited[2] == pytest.approx((0.0, 60 * np.pi / 30))
    assert [limited[i] for i in (0, 1, 3)] == [usual[i] for i in (0, 1, 3)]
    figure = plot.draw(speeds, "lift_off", look=look_of(ylim=("10 %", "50 %")))
    assert figure.axes[1].get_ylim() == pytest.approx((10, 50))
    figure = plot.draw(speeds, panel="radius_peaks", look=look_of(ylim=(0.0, 0.04)))
    assert figure.axes[0].get_ylim() == pytest.approx((0, 40))
    figure = plot.draw(speeds, "stick_slip_index", look=look_of(ylim=(0, 50)))
    assert not [one for one in figure.axes[1].lines if "beyond" in str(one.get_gid())]


def test_limits_of_an_axis_of_the_sweep_along_y() -> None:
    data = make_results(wob=np.linspace(1e4, 6e4, 6), rotary_speed=np.linspace(1, 8, 9))
    for kind in ("map", "stick_slip_index", "window"):
        figure = plot.draw(data, kind, look=look_of(ylim=("20 kN", "40 kN")))
        assert figure.axes[0].get_ylim() == pytest.approx((20, 40)), kind


@pytest.mark.parametrize(
    ("ends", "words"),
    [
        (("0 mm", "40 mm"), "found panels of axial_peaks, radius_peaks .* Choose it with panel"),
        (("0 kN", "40 kN"), "ylim: "),
        (("60 rpm", "0 rpm"), "ylim: found 6.28319 to 0 rad/s; allowed: the lower end first"),
    ],
)
def test_limits_that_do_not_fit(speeds: Results, ends: tuple[str, str], words: str) -> None:
    with pytest.raises(nsdrill.InputError, match=words):
        plot.draw(speeds, look=look_of(ylim=ends))

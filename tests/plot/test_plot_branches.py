"""Special points of branches that would lie on each other."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.text import Annotation
from seen import artists, legend_words
from xarray import Dataset

from nsdrill import plot
from nsdrill.analysis.bifurcations import DOUBLING, FOLD, TORUS
from nsdrill.errors import InputError
from nsdrill.plot.look import look_of


@pytest.fixture
def crowd() -> Dataset:
    """One branch with 41 special points of three kinds within 0.4 of 6 rad/s, and a
    fold by itself."""
    speed = np.linspace(2.0, 8.0, 601)
    label = np.zeros(601, dtype=int)
    label[400:441] = np.array([FOLD, TORUS, DOUBLING])[np.arange(41) % 3]
    label[100] = FOLD
    return Dataset(
        {
            "rotary_speed": ("point", speed),
            "radius_max": ("point", np.full(601, 0.05)),
            "unstable": ("point", np.zeros(601, dtype=int)),
            "label": ("point", label),
            "row_size": ("branch", np.array([601])),
            "motion": ("branch", np.array(["periodic"])),
        },
        attrs={"along": "rotary_speed", "continue_from": 2.0, "continue_to": 8.0},
    )


@pytest.mark.usefixtures("laid_out")
def test_special_points_that_lie_on_each_other_are_counted(crowd: Dataset) -> None:
    figure = plot.draw(crowd)
    (axes,) = figure.axes
    figure.draw_without_rendering()
    marked = np.array([axes.transData.transform(line.get_xydata()[0]) for line in artists(axes, "special:")])
    apart = np.diff(np.sort(marked[:, 0])) / figure.dpi
    assert apart.min() > 0.05, "inches: no marker, 0.055 wide, covers another one"
    numbers = [int(text.get_text()) for text in axes.texts if isinstance(text, Annotation)]
    assert sum(numbers) == 41
    alone = [line for line in artists(axes, "special:") if line.get_xdata()[0] == pytest.approx(3.0)]
    assert [line.get_gid() for line in alone] == ["special:fold"]
    words = legend_words(figure)
    assert "several special points" in words


def test_closer_to_them_they_are_apart(crowd: Dataset) -> None:
    far, near = (plot.draw(crowd, look=look_of(xlim=ends)) for ends in ((2.0, 8.0), ("5.95 rad/s", "6.25 rad/s")))
    assert len(artists(near.axes[0], "special:")) > 2 * len(artists(far.axes[0], "special:"))
    kinds = {line.get_gid() for line in artists(near.axes[0], "special:")}
    assert {"special:fold", "special:torus", "special:doubling"} <= kinds


def test_the_other_axes_fit_what_is_within_the_limits(crowd: Dataset) -> None:
    """The radius rises from 20 to 80 mm over the whole range, and by 5 mm within the limits."""
    crowd["radius_max"] = "point", np.linspace(0.02, 0.08, 601)
    low, high = plot.draw(crowd, look=look_of(xlim=(4.0, 4.5))).axes[0].get_ylim()
    assert 39.0 < low < 40.0
    assert 45.0 < high < 46.0


def test_branches_are_a_kind_like_others(crowd: Dataset) -> None:
    assert plot.kinds_for(crowd) == ("branches",)
    assert [axes.get_label() for axes in plot.draw(crowd, panel="radius").axes] == ["radius_max"]


def test_labels_are_broken_beside_low_panels(crowd: Dataset) -> None:
    labels = [
        plot.draw(crowd, look=look_of(width="3.3 in", height=height)).axes[0].get_ylabel()
        for height in ("5 in", "1.9 in")
    ]
    assert "\n" not in labels[0]
    assert labels[1].split() == labels[0].split()
    assert "\n" in labels[1]


def test_a_panel_is_one_name(crowd: Dataset) -> None:
    with pytest.raises(InputError, match="panel: found a value of the type list"):
        plot.draw(crowd, panel=["radius_max"])  # type: ignore[arg-type]

"""Pictures from Python: shown by a notebook, drawn into axes of a user's own, of files
and Datasets."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from matplotlib.figure import Figure

import nsdrill
from nsdrill.data import Results, Trace
from nsdrill.store.dataset import to_dataset

PNG = b"\x89PNG\r\n\x1a\n"


def test_a_notebook_shows_a_figure_without_pyplot(shared: Path) -> None:
    code = (
        "import sys, nsdrill; figure = nsdrill.plot(sys.argv[1]); assert figure._repr_png_()[:4] "
        "== b'\\x89PNG'; "
        "print('matplotlib.pyplot' in sys.modules)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(shared / "small.h5")], capture_output=True, text=True, check=True
    )
    assert done.stdout == "False\n"


def test_the_same_picture_of_a_file_and_of_a_dataset(shared: Path) -> None:
    with nsdrill.open_results(shared / "small.h5") as data:
        pictures = [nsdrill.plot(source, "summary")._repr_png_() for source in (shared / "small.h5", data)]
    assert pictures[0] == pictures[1]


def test_the_room_of_that_name_can_be_called(shared: Path) -> None:
    code = (
        "import sys, inspect, nsdrill.plot; from nsdrill.plot import draw; import nsdrill; "
        "assert 'ax' in inspect.signature(nsdrill.plot).parameters; "
        "print(type(nsdrill.plot(sys.argv[1], kind='summary', units='field')).__name__)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(shared / "small.h5")], capture_output=True, text=True, check=True
    )
    assert done.stdout == "Picture\n"


@pytest.mark.parametrize("kind", ["map", "lift_off", "window", "whirl_kind"])
def test_a_map_in_axes_of_a_user(plane: Results, kind: str) -> None:
    figure = Figure(figsize=(8, 4))
    left, right = figure.subplots(1, 2)
    right.set_title("mine")
    assert nsdrill.plot(to_dataset(plane), kind, ax=right) is figure
    assert not left.has_data()
    assert right.get_title() == "mine"
    assert right.get_xlabel().startswith("Rotary speed")
    assert right.collections
    alone = nsdrill.plot(to_dataset(plane), kind)
    assert [type(item) for item in right.collections] == [type(item) for item in alone.axes[0].collections]
    assert right.get_xlim() == alone.axes[0].get_xlim()
    words = [" ".join(text.get_text().split()) for text in right.get_legend().get_texts()] if right.get_legend() else []
    assert words == ([text.get_text() for text in alone.legends[0].get_texts()] if alone.legends else [])
    assert len(figure.axes) == 2 + (len(alone.axes) - 1)  # the colour bar


def test_an_orbit_in_axes_of_a_user(trace: Trace) -> None:
    figure = Figure()
    outer = figure.subfigures(1, 2)[0]
    axes = outer.subplots()
    assert nsdrill.plot(to_dataset(trace), "orbit", ax=axes) is figure
    assert axes.lines


@pytest.mark.parametrize("kind", [None, "summary", "value"])
def test_kinds_of_several_axes_say_so_and_draw_nothing(speeds: Results, kind: str | None) -> None:
    figure = Figure()
    axes = figure.subplots()
    with pytest.raises(
        nsdrill.InputError, match=r"^ax: found a picture with \d panels; allowed: one of them, by panel: 'strip', '"
    ):
        nsdrill.plot(to_dataset(speeds), kind, ax=axes)
    assert not axes.has_data()
    assert len(figure.axes) == 1


def test_figures_after_one_into_axes_are_figures_of_their_own(plane: Results) -> None:
    data, axes = to_dataset(plane), Figure().subplots()
    nsdrill.plot(data, "map", ax=axes)
    assert nsdrill.plot(data, "map") is not axes.figure
    with pytest.raises(nsdrill.InputError):
        nsdrill.plot(data, "nonsense", ax=axes)
    assert nsdrill.plot(data, "map") is not axes.figure


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ({"ax": 3}, "ax: found a value of the type int; allowed: axes of matplotlib"),
        ({"kind": "mapp"}, r"plot kind: found 'mapp', which is not known\. Did you mean 'map'\?"),
        ({"units": "metric"}, "found 'metric'; allowed: si or field"),
        ({"start": 1}, "start: found 1; allowed: nothing"),
        ({"states": ("z", "vz")}, "states: found with kind='map'; allowed: with kind='basin'"),
        ({"severity": 1}, "severity: found with kind=None; allowed: with kind='window'"),
        ({"severity": 7, "kind": "window"}, "severity: found 7; allowed: 0 to 4"),
        ({"rotary_speed": "300 rpm"}, "rotary_speed: found .*; allowed: .* as the sweep"),
        ({"at": {"bit.rock_stiffness": 1e6}}, r"at: found bit\.rock_stiffness; allowed: depth"),
        ({"over": "nowhere.h5"}, "there is no such file"),
    ],
)
def test_wrong_options_are_told(plane: Results, asked: dict[str, Any], words: str) -> None:
    with pytest.raises(nsdrill.InputError, match=words) as caught:
        nsdrill.plot(to_dataset(plane), **asked)
    assert "--" not in str(caught.value)


def test_a_trace_takes_no_options_of_a_sweep(trace: Trace) -> None:
    for name, value in (("wob", "3 kN"), ("start", 1), ("states", ["z", "vz"]), ("severity", 1)):
        with pytest.raises(nsdrill.InputError, match=f"{name}: found with a trace"):
            nsdrill.plot(to_dataset(trace), **{name: value})


def test_a_cut_in_a_text_with_units(plane: Results) -> None:
    data = to_dataset(plane)
    named = nsdrill.plot(data, "summary", depth="500 m")
    assert named._repr_png_() == nsdrill.plot(data, "summary", at={"depth": 500.0})._repr_png_()


def test_a_dataset_that_lacks_what_is_drawn(speeds: Results) -> None:
    data = to_dataset(speeds)
    with pytest.raises(nsdrill.InputError, match="plot: found results without status"):
        nsdrill.plot(data[["response", "axial_peaks"]])
    with pytest.raises(nsdrill.InputError, match="plot: found results without stick_slip_index"):
        nsdrill.plot(data.drop_vars("stick_slip_index"), "summary")


def test_a_figure_is_saved(plane: Results, tmp_path: Path) -> None:
    figure = nsdrill.plot(to_dataset(plane), "map")
    nsdrill.save(figure, tmp_path / "map.png")
    assert (tmp_path / "map.png").read_bytes()[:8] == PNG
    with pytest.raises(nsdrill.FileError, match="overwrite=True"):
        nsdrill.save(figure, tmp_path / "map.png")
    with pytest.raises(nsdrill.InputError, match=r"allowed: \.png, \.pdf, \.svg"):
        nsdrill.save(figure, tmp_path / "map.h5")


def test_window_by_severity(shared: Path) -> None:
    figure = nsdrill.plot(shared / "small.h5", "window", severity=2)
    with nsdrill.open_results(shared / "small.h5") as data:
        assert nsdrill.plot(data, "window", severity=2)._repr_png_() == figure._repr_png_()

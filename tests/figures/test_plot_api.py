"""What a caller of the room meets: kinds, errors, files; pictures from Python, in axes of a
user, of files and Datasets."""

import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made_up import make_results
from matplotlib.figure import Figure

import nsdrill
import nsdrill.figures.kinds
from nsdrill import figures
from nsdrill.errors import InputError, NsdrillError, RunWarning
from nsdrill.figures import picture_kinds
from nsdrill.figures.picture_kinds import GROUPS, all_kinds, choose_kind
from nsdrill.store.dataset import to_dataset
from nsdrill.variables import DIVERGED, PENDING


def test_default_kinds(speeds, plane, trace):
    assert figures.kinds_for(speeds)[:2] == ("bifurcation", "value")
    assert figures.kinds_for(plane)[:2] == ("map", "value")
    values = ("stick_slip_index", "lift_off", "wall_contact", "whirl_ratio", "radius")
    for name in (*values, "bit_force_max"):  # by name, though not in the list
        assert choose_kind(plane, name)[0].part_of == "value"
    assert figures.kinds_for(trace) == ("trace", "histories", "hole")
    for name in ("orbit", "phase", "section"):
        assert choose_kind(trace, name)[0].part_of == "trace"
    assert figures.kinds_for(make_results())[0] == "bifurcation"  # one point: its peaks


def test_few_values_of_a_second_axis_stand_side_by_side():
    two = make_results(wob=(22240.0, 66720.0), rotary_speed=np.linspace(1, 8, 9))
    assert figures.kinds_for(two)[0] == "bifurcation"
    assert "map" in figures.kinds_for(two)
    titles = [axes.get_title() for axes in figures.draw(two).axes]
    assert {"Weight on bit: 22.24 kN", "Weight on bit: 66.72 kN"} <= set(titles)


def test_unknown_kind_lists_the_kinds_with_a_line_each(speeds):
    with pytest.raises(InputError) as caught:
        figures.draw(speeds, "bifurcatoin")
    message = str(caught.value)
    assert "Did you mean 'bifurcation'?" in message
    for kind in figures.kinds_for(speeds):
        assert f"{kind} " in message
        assert figures.all_kinds()[kind].words in message


def test_numbers_of_checks_are_no_kinds_of_picture():
    assert {"radius_max", "half_difference", "lyapunov_error"} <= all_kinds().keys()
    assert not [name for name in all_kinds() if name.startswith(("tight_", "long_"))]


def test_a_kind_whose_place_fails_is_named_and_breaks_no_other(speeds, monkeypatch):
    def place(data):
        return data["no_such_variable"].size

    kinds = {**all_kinds(), "effort": replace(all_kinds()["summary"], name="effort", part_of="", place=place)}
    monkeypatch.setattr(picture_kinds, "all_kinds", lambda: kinds)
    said = r"plot kind effort: its place \(.*, line \d+\) fails with .*no_such_variable"
    with pytest.warns(RunWarning, match=said):
        assert figures.kinds_for(speeds)[0] == "bifurcation"
    with pytest.warns(RunWarning, match=said):
        figures.draw(speeds)
    with pytest.warns(RunWarning), pytest.raises(NsdrillError, match=said):
        figures.draw(speeds, "effort")


def test_results_say_which_names_they_have(speeds, trace):
    """As `place` of a kind may ask."""
    assert {"bit_speed_max", "rotary_speed"} <= {*speeds}
    assert "bit_speed_max" in speeds
    assert "rotary_speed" in speeds
    assert "no_such_variable" not in speeds
    assert {"time", "twist"} <= {*trace}
    assert "time" in trace
    assert "no_such_variable" not in trace


@pytest.mark.parametrize("kind", ["bifurcation", "summary", "orbit"])
def test_kind_that_does_not_fit_says_what_would(plane, kind):
    with pytest.raises(InputError, match=r"does not fit a sweep over depth .* and rotary_speed") as caught:
        figures.draw(plane, kind)
    assert "panel='NAME'" in str(caught.value) or "panel NAME" in str(caught.value)


def test_a_cut_of_a_map_is_a_bifurcation_diagram(plane):
    figure = figures.draw(plane, "bifurcation", at={"depth": 500.0})
    assert "500 m" in figure.get_suptitle()
    assert "500 m" in figures.draw(plane, "bifurcation", at={"depth": 510.0}).get_suptitle(), "the nearest one"
    with pytest.raises(InputError, match="as the sweep, of which the nearest value is drawn"):
        figures.draw(plane, "bifurcation", at={"depth": 20e3})
    with pytest.raises(InputError, match="allowed: depth, wob, rotary_speed"):
        figures.draw(plane, at={"mud": 1.0})


def test_unknown_unit_system(speeds):
    with pytest.raises(InputError, match="allowed: si, field"):
        figures.draw(speeds, units="metric")


@pytest.mark.usefixtures("laid_out")
@pytest.mark.parametrize("status", [DIVERGED, PENDING])
def test_nothing_to_draw_is_still_a_picture(speeds, plane, status):
    for data in (speeds, plane):
        data["status"][:] = status
        for v in data.variables.values():
            if v.dtype.kind == "f":
                v[:] = np.nan
        for kind in ("bifurcation", "summary") if data is speeds else ("map", "stick_slip_index"):
            figures.draw(data, kind)


@pytest.mark.usefixtures("laid_out")
def test_bytes_as_procedure_names_and_a_title_with_dollars(speeds):
    speeds.coords["procedure"] = np.array([b"up", b"down"])
    speeds.attrs["title"] = "A $50 rig_1^2 & more"
    assert figures.draw(speeds).get_suptitle().startswith("A $50 rig_1^2 & more\n5000 m, 22.24 kN")


@pytest.mark.parametrize("suffix", [".png", ".pdf", ".svg"])
def test_same_bytes_every_time(speeds, plane, tmp_path, suffix):
    data = plane if suffix == ".svg" else speeds
    first, second, third = (tmp_path / f"{name}{suffix}" for name in "abc")
    figure = figures.draw(data)
    figures.save(figure, first)
    figures.save(figure, second)
    figures.save(figures.draw(data), third)
    assert first.read_bytes() == second.read_bytes() == third.read_bytes()
    assert {path.name for path in tmp_path.iterdir()} == {first.name, second.name, third.name}


def test_same_bytes_in_another_process(tmp_path):
    script = (
        "import sys; sys.path[:0] = [sys.argv[1], sys.argv[1] + '/..']\n"
        "from made_up import make_trace; from nsdrill import figures; "
        "figures.save(figures.draw(make_trace(5.0), 'phase'), sys.argv[2]); print('matplotlib.pyplot' in sys.modules)"
    )
    for number in range(2):
        path = tmp_path / f"{number}.svg"
        out = subprocess.run(
            [sys.executable, "-c", script, str(Path(__file__).parent), str(path)],
            check=True,
            capture_output=True,
            text=True,
            env={"PYTHONHASHSEED": str(number), "PATH": "", "PYTHONPATH": os.environ.get("PYTHONPATH", "")},
        )
        assert out.stdout.strip() == "False", "pyplot was imported"
    assert (tmp_path / "0.svg").read_bytes() == (tmp_path / "1.svg").read_bytes()


def test_asking_for_kinds_imports_no_matplotlib():
    script = "import sys, nsdrill.figures; sys.exit('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", script], check=False).returncode == 0


def test_text_stays_text(speeds, tmp_path):
    figure = figures.draw(speeds)
    figures.save(figure, tmp_path / "a.svg")
    figures.save(figure, tmp_path / "a.pdf")
    assert "Rotary speed [rad/s]" in (tmp_path / "a.svg").read_text(encoding="utf-8")
    # TrueType, not the outlines of Type 3
    assert b"/CIDFontType2" in (tmp_path / "a.pdf").read_bytes()
    assert b"CreationDate" not in (tmp_path / "a.pdf").read_bytes()


def test_refused_files(trace, tmp_path):
    figure = figures.draw(trace, "orbit")
    for name in ("a.jpg", "a", "a.h5"):
        with pytest.raises(InputError, match=r"allowed: \.png, \.pdf, \.svg"):
            figures.save(figure, tmp_path / name)
    with pytest.raises(InputError, match="no folder"):
        figures.save(figure, tmp_path / "nowhere" / "a.png")
    (tmp_path / "folder.png").mkdir()
    with pytest.raises(InputError, match="cannot be written"):
        figures.save(figure, tmp_path / "folder.png")
    assert [path.name for path in tmp_path.iterdir()] == ["folder.png"]


def test_upper_case_suffix_and_an_old_picture_replaced(trace, tmp_path):
    path = tmp_path / "A.PNG"
    path.write_bytes(b"old")
    figures.save(figures.draw(trace, "orbit"), path)
    assert path.read_bytes().startswith(b"\x89PNG")


PNG = b"\x89PNG\r\n\x1a\n"


def test_a_notebook_shows_a_figure_without_pyplot(shared):
    code = (
        "import sys, nsdrill; figure = nsdrill.plot(sys.argv[1], kind='summary', units='field'); "
        "assert figure._repr_png_()[:4] == b'\\x89PNG'; print(type(figure).__name__, "
        "'matplotlib.pyplot' in sys.modules)"
    )
    command = [sys.executable, "-c", code, str(shared / "small.h5")]
    assert subprocess.run(command, capture_output=True, text=True, check=True).stdout == "Picture False\n"


@pytest.mark.parametrize(("kind", "more"), [("summary", {}), ("window", {"severity": 2})])
def test_the_same_picture_of_a_file_and_of_a_dataset(shared, kind, more):
    with nsdrill.open_results(shared / "small.h5") as data:
        pictures = [nsdrill.plot(source, kind, **more)._repr_png_() for source in (shared / "small.h5", data)]
    assert pictures[0] == pictures[1]


@pytest.mark.parametrize("kind", ["map", "lift_off", "window", "whirl_kind"])
def test_a_map_in_axes_of_a_user(plane, kind):
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


def test_an_orbit_in_axes_of_a_user(trace):
    figure = Figure()
    outer = figure.subfigures(1, 2)[0]
    axes = outer.subplots()
    assert nsdrill.plot(to_dataset(trace), "orbit", ax=axes) is figure
    assert axes.lines


@pytest.mark.parametrize("kind", [None, "summary", "value"])
def test_kinds_of_several_axes_say_so_and_draw_nothing(speeds, kind):
    figure = Figure()
    axes = figure.subplots()
    with pytest.raises(
        nsdrill.InputError, match=r"^ax: found a picture with \d panels; allowed: one of them, by panel: 'strip', '"
    ):
        nsdrill.plot(to_dataset(speeds), kind, ax=axes)
    assert not axes.has_data()
    assert len(figure.axes) == 1


def test_figures_after_one_into_axes_are_figures_of_their_own(plane):
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
def test_wrong_options_are_told(plane, asked, words):
    with pytest.raises(nsdrill.InputError, match=words) as caught:
        nsdrill.plot(to_dataset(plane), **asked)
    assert "--" not in str(caught.value)


def test_a_trace_takes_no_options_of_a_sweep(trace):
    for name, value in (("wob", "3 kN"), ("start", 1), ("states", ["z", "vz"]), ("severity", 1)):
        with pytest.raises(nsdrill.InputError, match=f"{name}: found with a trace"):
            nsdrill.plot(to_dataset(trace), **{name: value})


def test_a_cut_in_a_text_with_units(plane):
    data = to_dataset(plane)
    named = nsdrill.plot(data, "summary", depth="500 m")
    assert named._repr_png_() == nsdrill.plot(data, "summary", at={"depth": 500.0})._repr_png_()


def test_a_dataset_that_lacks_what_is_drawn(speeds):
    data = to_dataset(speeds)
    with pytest.raises(nsdrill.InputError, match="plot: found results without status"):
        nsdrill.plot(data[["response", "axial_peaks"]])
    with pytest.raises(nsdrill.InputError, match="plot: found results without stick_slip_index"):
        nsdrill.plot(data.drop_vars("stick_slip_index"), "summary")


def test_a_figure_is_saved(plane, tmp_path):
    figure = nsdrill.plot(to_dataset(plane), "map")
    nsdrill.save(figure, tmp_path / "map.png")
    assert (tmp_path / "map.png").read_bytes()[:8] == PNG
    with pytest.raises(nsdrill.FileError, match="overwrite=True"):
        nsdrill.save(figure, tmp_path / "map.png")
    with pytest.raises(nsdrill.InputError, match=r"allowed: \.png, \.pdf, \.svg"):
        nsdrill.save(figure, tmp_path / "map.h5")


PAGE = Path(__file__).parents[2] / "docs" / "dev" / "extending.md"


@pytest.fixture
def another(tmp_path, monkeypatch):
    """The kind of the page on extending, in a file beside the others."""
    (block,) = (b for b in re.findall(r"^```python\n(.*?)^```", PAGE.read_text(), re.M | re.S) if "KINDS = " in b)
    (tmp_path / "effort.py").write_text(block)
    monkeypatch.setattr(nsdrill.figures.kinds, "__path__", [*nsdrill.figures.kinds.__path__, str(tmp_path)])
    all_kinds.cache_clear()
    yield
    all_kinds.cache_clear()
    sys.modules.pop("nsdrill.figures.kinds.effort", None)


@pytest.mark.usefixtures("another")
def test_one_more_file_is_one_more_kind():
    data = make_results(rotary_speed=np.linspace(1, 8, 9))
    data.variables["steps"] = np.arange(9.0).reshape(1, 1, 1, 9)
    assert "effort" in figures.kinds_for(data)
    assert "steps" in figures.needed(data, "effort")
    (axes,) = figures.draw(data, "effort").axes
    assert axes.lines[0].get_ydata() == pytest.approx(np.arange(9.0))
    assert axes.get_xlabel() == "Rotary speed [rad/s]"


def test_every_kind_is_drawn_of_something_known():
    for kind in all_kinds().values():
        assert kind.of in GROUPS
        assert kind.words


def test_what_is_across_is_on_the_x_axis(speeds, plane, trace):
    """Every kind that names the variable along x has panels with that label."""
    from nsdrill.words.labels import quantity

    seen = set()
    for data in (speeds, plane, trace):
        for name in figures.kinds_for(data)[:8]:
            if across := all_kinds()[name].across(data):
                figure = figures.draw(data, name)
                panels = [*figure.axes, *(axes for part in figure.subfigs for axes in part.axes)]
                assert quantity(across).label in {axes.get_xlabel() for axes in panels}, name
                seen.add(name)
    assert {"bifurcation", "value", "map", "window", "histories", "trace"} <= seen

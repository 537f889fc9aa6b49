"""Kinds of picture that scripts and packages declare."""

import re

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray
from models.installed import python

import nsdrill
from nsdrill.figures import picture_kinds
from nsdrill.variables import STEP_LIMIT
from script.conftest import command

SWEEP = """\
title: Short
sweep: {rotary_speed: {from: 2 rad/s, to: 6 rad/s, points: 5}, procedure: up-down}
simulation: {transient: 0 s, observe: 1 s}
"""
EFFORT = '''\
@nsdrill.picture("effort", of="line")
def effort(axes, data, shown):
    """How many steps every point took"""
    speed = shown("rotary_speed")
    for way in data.procedure.values:
        axes.plot(data.rotary_speed / speed.scale, data.steps.sel(procedure=way), label=str(way))
    axes.set(xlabel=speed.label, ylabel="Steps")
'''
KNOCK = '''\
@nsdrill.picture("knock", of="{}")
def knock(axes, data, shown):
    """{}"""
    {}
'''


@pytest.fixture(autouse=True)
def pictures_of_this_test(monkeypatch):
    monkeypatch.setattr(picture_kinds, "_made", {})
    picture_kinds.all_kinds.cache_clear()
    yield
    picture_kinds.all_kinds.cache_clear()


@pytest.fixture(scope="module")
def data():
    return nsdrill.run(SWEEP, progress=False)


def knock(script, line, of="line", words="a knock", name="knocking"):
    """A picture that does this one line."""
    return script(KNOCK.format(of, words, line), name)


def test_a_picture_is_drawn_as_those_of_nsdrill_are(script, data):
    effort = script(EFFORT, "efforts").effort
    assert callable(effort), "the function stays what it was"
    figure = nsdrill.plot(data, "effort", units="field")
    [axes] = figure.axes
    assert axes.get_xlabel() == "Rotary speed [rpm]"
    up, down = axes.lines
    # 2 to 6 rad/s, of 9.5493 rpm each
    np.testing.assert_allclose(up.get_xdata(), np.linspace(2, 6, 5) * 30 / np.pi)
    np.testing.assert_array_equal(down.get_ydata(), data.steps.sel(procedure="down"))
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["up", "down"]
    assert figure.get_suptitle().startswith("Short\n")
    assert nsdrill.plot(data).axes[-1].get_ylabel() != "Steps", "not by default"


def test_it_is_drawn_into_axes_and_within_limits(script, data):
    script(EFFORT, "efforts")
    figure, (left, right) = plt.subplots(1, 2)
    assert nsdrill.plot(data, "effort", ax=right, xlim=("3 rad/s", "5 rad/s")) is figure
    assert not left.lines
    assert right.get_xlim() == (3.0, 5.0)
    assert len(right.lines[0].get_xdata()) == 3
    plt.close(figure)


def test_the_y_axis_has_limits_where_it_has_the_label_of_a_variable(script, data):
    line = 'axes.plot(data.rotary_speed, data.bit_speed_max[0]); axes.set_ylabel(shown("bit_speed_max").label)'
    knock(script, line)
    assert nsdrill.plot(data, "knock", ylim=("0 rad/s", "9 rad/s")).axes[0].get_ylim() == (0.0, 9.0)


@pytest.mark.parametrize("of", ["line", "plane", "trace", "branches"])
def test_it_fits_what_it_is_of_and_is_refused_elsewhere(script, data, of):
    knock(script, "axes.plot([0.0, 1.0])", of)
    plane = {"sweep": {"rotary_speed": ["2 rad/s", "3 rad/s"], "wob": ["20 kN", "30 kN"]}}
    plane["simulation"] = {"transient": "0 s", "observe": "1 s"}
    branches = xarray.Dataset(
        {"rotary_speed": ("point", [2.0, 3.0]), "row_size": ("branch", [2])}, attrs={"along": "rotary_speed"}
    )
    made = {
        "line": lambda: data,
        "plane": lambda: nsdrill.run(plane, progress=False),
        "trace": lambda: nsdrill.simulate(SWEEP, rotary_speed=3.0, duration=1.0),
        "branches": lambda: branches,
    }
    assert nsdrill.plot(made[of](), "knock").axes[0].lines
    other = "trace" if of == "line" else "line"
    with pytest.raises(nsdrill.InputError, match=r"found 'knock', which does not fit .*\(it shows .*\); allowed here"):
        nsdrill.plot(made[other](), "knock")


@pytest.mark.parametrize("name", ["map", "bit_speed_max", "list", "critical-speeds"])
def test_a_name_that_there_is_already_is_refused_with_its_line(script, name):
    with pytest.raises(nsdrill.InputError, match=rf"twice\.py, line 6: found a picture with the name {name}, which"):
        script(EFFORT.replace('"effort"', f'"{name}"'), "twice")
    assert not picture_kinds._made


def test_two_files_cannot_make_one_name_and_one_file_makes_it_anew(script, data):
    knock(script, "axes.plot([1.0])")
    knock(script, "axes.plot([2.0])")
    assert nsdrill.plot(data, "knock").axes[0].lines[0].get_ydata() == [2.0]
    with pytest.raises(
        nsdrill.InputError, match=r"other\.py, line 6: found a picture with the name knock, as in .*knocking"
    ):
        knock(script, "axes.plot([3.0])", name="other")


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ('"effort", of="sweep"', "of='sweep'; allowed: 'line', a sweep over one axis; 'plane'"),
        ('"an effort", of="line"', "the name 'an effort'; allowed: letters"),
        ("None, of='line'", "the name None; allowed: letters"),
    ],
)
def test_a_name_or_data_that_cannot_be_is_refused(script, given, said):
    with pytest.raises(nsdrill.InputError, match=re.escape(said)):
        script(EFFORT.replace('"effort", of="line"', given), "wrong")
    with pytest.raises(nsdrill.InputError, match="found 3; allowed: a function"):
        nsdrill.picture("effort", of="line")(3)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("axes.plot(data.rotary_speed, data.nothing)", "AttributeError: 'Dataset' object has no attribute 'nothing'"),
        ("axes.set_xlabel(shown('nothing').label)", "found no variable 'nothing'"),
        ("raise SystemExit(3)", "SystemExit: 3"),
        (r"axes.plot([1.0], label='$\\no$')", "ValueError"),
        (r"axes.set_title('$\\no$')", "ValueError"),
    ],
)
def test_an_error_names_its_line(script, data, line, said):
    knock(script, line)
    with pytest.raises(nsdrill.InputError, match=r"knocking\.py, line \d+: the picture knock: ") as caught:
        nsdrill.plot(data, "knock")
    assert said in str(caught.value)
    if "nothing" in line or "raise" in line:
        assert "knocking.py, line 9:" in str(caught.value)


def test_a_picture_of_nothing_is_refused(script, data):
    knock(script, "axes.set_ylabel('Nothing')")
    with pytest.raises(nsdrill.InputError, match="the name knock, which paints nothing"):
        nsdrill.plot(data, "knock")


def test_a_picture_does_not_change_the_data(script, data):
    before = data.steps.values.copy()
    knock(script, "axes.plot([1, 2]); data.steps.values[:] = 0")
    with pytest.raises(nsdrill.InputError, match=r"knocking.py, line 9: the picture knock: ValueError"):
        nsdrill.plot(data, "knock")
    assert np.array_equal(data.steps, before)


def test_runs_that_failed_are_told_of(script, data):
    script(EFFORT, "efforts")
    spoiled = data.copy(deep=True)
    spoiled["status"][0, 1] = STEP_LIMIT
    words = [text.get_text() for text in nsdrill.plot(spoiled, "effort").legends[0].get_texts()]
    assert words[:-1] == ["up", "down", "not known: 1 of 10 runs failed"]
    assert words[-1].startswith("NOT SEALED"), "its label still tells of a run that ended"


def test_bars_with_a_label_are_in_the_legend(script, data):
    knock(script, "axes.bar(data.rotary_speed, data.steps[0], label='steps')")
    assert [text.get_text() for text in nsdrill.plot(data, "knock").legends[0].get_texts()] == ["steps"]


SWINGING = "@nsdrill.model\ndef swinging(x=0.1, v=0.0, *, k=1.0):\n    return v, -k * x\n"


def test_a_value_of_a_later_model_wins(script):
    script(EFFORT.replace('"effort"', '"swing_mean"'), "efforts")
    assert picture_kinds.all_kinds()["swing_mean"].of == picture_kinds.LINE
    script(SWINGING, "swings").swinging.feature("swing", mean=True)(lambda v: v)
    with pytest.warns(nsdrill.RunWarning, match=r"efforts\.py, line 6: found a picture with the name swing_mean"):
        assert picture_kinds.all_kinds()["swing_mean"].of == picture_kinds.VALUE


def test_a_command_lists_draws_and_refuses_it(tmp_path, data):
    nsdrill.save(data, tmp_path / "out.h5")
    (tmp_path / "efforts.py").write_text(f"import nsdrill\n\n\n{EFFORT}")
    listed, _ = command(tmp_path, "plot", "out.h5", "--list", "--with", "efforts.py")
    assert re.search(r"^effort +How many steps every point took$", listed, re.M)
    command(tmp_path, "plot", "out.h5", "--kind", "effort", "-o", "e.png", "--with", "efforts.py")
    assert (tmp_path / "e.png").read_bytes()[:4] == b"\x89PNG"
    _, said = command(tmp_path, "plot", "out.h5", "--kind", "effort", "-o", "no.png", code=2)
    assert "found 'effort', which is not known" in said
    text = (tmp_path / "efforts.py").read_text()
    (tmp_path / "efforts.py").write_text(text.replace("data.steps", "data.steeps"))
    _, said = command(tmp_path, "plot", "out.h5", "--kind", "effort", "-o", "no.png", "--with", "efforts.py", code=2)
    assert re.search(r"efforts\.py, line 9: the picture effort: AttributeError", " ".join(said.split()))
    assert not [file for file in tmp_path.iterdir() if file.name.startswith("no")]


def test_a_package_makes_pictures_by_an_entry_point(tmp_path, data):
    nsdrill.save(data, tmp_path / "out.h5")
    (tmp_path / "efforts.py").write_text(f"import nsdrill\n\n\n{EFFORT}")
    (tmp_path / "broken.py").write_text("import nothing_there\n")
    about = tmp_path / "efforts-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: efforts\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text("[nsdrill]\nbroken = broken\nefforts = efforts\n")
    text = """\
import warnings
with warnings.catch_warnings(record=True) as said:
    warnings.simplefilter("always")
    import nsdrill
    print(nsdrill.plot("out.h5", "effort").axes[0].get_ylabel())
print(*{str(one.message) for one in said if "package" in str(one.message)})
"""
    drawn, said = python(tmp_path, text)
    assert drawn == "Steps"
    assert said.startswith("the entry point broken of the group nsdrill, broken: ModuleNotFoundError")
    assert "Mend its package, or remove it" in said

"""nsdrill plot: charts of a study, options for the look, films, and what is read for it."""

import os
import subprocess
from pathlib import Path

import matplotlib as mpl
import pytest
from PIL import Image

import nsdrill
from nsdrill.app.datasets import outline
from nsdrill.app.datasets import read_any as read
from nsdrill.data import Results
from nsdrill.errors import InputError
from nsdrill.figures import draw, kinds_for, needed
from nsdrill.figures.picture_kinds import all_kinds
from nsdrill.store import read_results

from .helpers import SCRIPT

KINDS = ("critical-speeds", "drive-card", "drive-tuning")


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_is_drawn(call, small, tmp_path, kind):
    answer = call("plot", small, "--kind", kind, "-o", "chart.png", "--units", "field")
    assert (answer.out, answer.err) == ("", "chart.png: drawn.\n")
    assert (tmp_path / "chart.png").read_bytes().startswith(b"\x89PNG")


def test_a_kind_in_the_spelling_of_python_and_no_picture_in_place_of_another(call, small, tmp_path):
    call("plot", small, "--kind", "drive_card", "-o", "chart.svg")
    drawn = (tmp_path / "chart.svg").read_bytes()
    call("plot", small, "--kind", "drive-card", "-o", "chart.svg", code=2)
    call("plot", small, "--kind", "drive-card", "-o", "other.svg")
    assert (tmp_path / "other.svg").read_bytes() == drawn == (tmp_path / "chart.svg").read_bytes()


def test_along_an_axis_of_the_study(call, small):
    call("plot", small, "--kind", "critical-speeds", "--along", "rotary_speed", "-o", "a.svg")
    call(
        f"plot {small} --kind critical-speeds --along drillstring.collar.span --set "
        f"'sweep={{drillstring.collar.span: {{from: 10 m, to: 40 m, points: 3}}}}' -o b.svg"
    )
    assert "Collar span [m]" in Path("b.svg").read_text()


def size(path: Path) -> tuple[int, int]:
    with Image.open(path) as image:
        return image.size


def test_a_picture_is_as_large_as_asked(call, shared, tmp_path):
    path = tmp_path / "a.png"
    call("plot", shared / "small.h5", "-o", path, "--width", "3.3in", "--height", "70mm", "--no-title")
    assert size(path) == pytest.approx((3.3 * 300, 70 / 25.4 * 300), abs=1)


def test_a_style_file_sets_the_resolution(call, shared, tmp_path):
    (tmp_path / "a.mplstyle").write_text("savefig.dpi: 100\n")
    call("plot", shared / "small.h5", "-o", tmp_path / "a.png", "--style", tmp_path / "a.mplstyle")
    assert size(tmp_path / "a.png")[0] == 700


def test_a_film_from_both_sides(call, shared, tmp_path, monkeypatch):
    """The command and the function give the same bytes; without ffmpeg both say that it
    is a GIF."""
    monkeypatch.setenv("PATH", str(tmp_path))
    trace = nsdrill.replay(shared / "small.h5", rotary_speed=3.0, procedure="up")
    nsdrill.save(trace, tmp_path / "trace.h5")
    part = (float(trace.time[0]), float(trace.time[0]) + 0.2)
    answer = call(
        "plot", tmp_path / "trace.h5", "--animate", "-o", tmp_path / "a.mp4", "--to", f"{part[1]} s", "--width", "2in"
    )
    assert "There is no ffmpeg here, which MP4 needs: a GIF is written in place of" in answer.err
    written = nsdrill.animate(trace, tmp_path / "b.mp4", time=part, width="2 in")
    assert os.path.basename(written) == "b.gif"
    assert (tmp_path / "a.gif").read_bytes() == (tmp_path / "b.gif").read_bytes()
    with pytest.raises(nsdrill.FileError):
        nsdrill.animate(trace, tmp_path / "b.gif")
    with pytest.raises(InputError, match="trace: found no collar"):
        nsdrill.animate(shared / "small.h5", tmp_path / "c.gif")


def test_python_takes_the_same_and_tells_in_its_words(shared):
    figure = nsdrill.plot(shared / "small.h5", "summary", width="3.3 in", style={"font.size": 6.0})
    assert figure.get_figwidth() == pytest.approx(3.3)
    assert mpl.rcParams["font.size"] != 6.0
    with pytest.raises(InputError, match=r"^time: found with results"):
        nsdrill.plot(shared / "small.h5", time=(0.0, 1.0))
    with pytest.raises(InputError, match=r"^font_size: found 'huge'"):
        nsdrill.plot(shared / "small.h5", font_size="huge")
    with pytest.warns(nsdrill.RunWarning, match="characters that no font here has"):
        nsdrill.plot(shared / "small.h5", title="\U0001fae8")


def test_the_list_of_kinds_is_short_and_all_names_are_taken(call, shared, tmp_path):
    """A line for each kind; those that are panels of others stand below."""
    listed = call("plot", shared / "small.h5", "--list")
    kinds = [line.split()[0] for line in listed.out.splitlines() if "--panel:" not in line]
    assert [name for name in kinds if name in all_kinds()] == ["bifurcation", "value", "window"]
    assert "value --panel: summary, stick_slip_index" in listed.out
    for name in ("summary", "radius_max", "lift_off"):
        call("plot", shared / "small.h5", "--kind", name, "-o", tmp_path / f"{name}.png")
    assert "map --panel: whirl_kind" in call("plot", shared / "map.h5", "--list").out
    call("plot", shared / "map.h5", "--kind", "whirl_kind", "-o", tmp_path / "w.png")
    call("plot", shared / "map.h5", "--kind", "map", "--panel", "whirl_kind", "-o", tmp_path / "p.png")
    assert (tmp_path / "p.png").read_bytes() == (tmp_path / "w.png").read_bytes()


def test_a_panel_and_limits_on_the_command_line(call, shared, tmp_path):
    options = ("--panel", "radius", "--ylim", "0 mm", "40 mm", "--units", "field")
    call("plot", shared / "small.h5", *options, "-o", tmp_path / "r.png")


WIDE = ("bifurcation", "summary", "map", "whirl_kind", "stick_slip_index", "lift_off", "radius_max")


@pytest.mark.parametrize("name", ["small", "map"])
def test_every_kind_can_be_drawn_from_the_variables_it_needs(shared, name):
    path = str(shared / f"{name}.h5")
    whole, seen = read(path), outline(path)
    assert isinstance(seen, Results)
    assert kinds_for(seen) == kinds_for(whole)
    assert set(seen.variables) == set(read_results(path).variables)
    for kind in (kind for kind in kinds_for(seen) if kind in WIDE):
        names = needed(seen, kind)
        data = read(path, names)
        assert isinstance(data, Results)
        assert set(data.variables) == set(names)
        draw(data, kind)


def test_a_cut_decides_what_is_needed(shared):
    seen = outline(str(shared / "map.h5"))
    assert isinstance(seen, Results)
    assert "axial_peaks" not in needed(seen)
    assert "axial_peaks" in needed(seen, at={"wob": 20e3})


def test_no_setting_of_matplotlib_of_the_user_changes_a_picture(shared, tmp_path, call):
    """A cell of a notebook hands on its backend, which need not exist here."""

    def made(folder, environment, *words):
        (tmp_path / folder).mkdir(exist_ok=True)
        return subprocess.run(
            [SCRIPT, words[0], shared / "small.h5", *words[1:]],
            cwd=tmp_path / folder,
            text=True,
            capture_output=True,
            env={**os.environ, **environment},
        )

    (tmp_path / "file").mkdir()
    words = "text.usetex: True\nfont.size: 20\naxes.facecolor: red\nbackend: nothing\nno.such: key\n"
    (tmp_path / "file" / "matplotlibrc").write_text(words)
    unknown = {"MPLBACKEND": "nothing"}
    call("plot", shared / "small.h5", "-o", "plain.png")
    for folder, environment in (("environment", unknown), ("file", {"MPLBACKEND": ""})):
        done = made(folder, environment, "plot", "-o", "a.png")
        assert (done.returncode, done.stderr) == (0, "a.png: drawn.\n")
        assert (tmp_path / folder / "a.png").read_bytes() == (tmp_path / "plain.png").read_bytes()
    done = made("environment", unknown, "report", "-o", "a.html", "--motions", "1")
    assert (done.returncode, done.stderr.count("bug")) == (0, 0), done.stderr


def test_settings_that_matplotlib_cannot_read_are_named(shared, tmp_path):
    (tmp_path / "matplotlibrc").write_bytes(b"font.family: caf\xe9\n")
    for words in (["plot", "-o", "a.png"], ["report", "-o", "a.html"]):
        done = subprocess.run(
            [SCRIPT, words[0], shared / "small.h5", *words[1:]], cwd=tmp_path, text=True, capture_output=True
        )
        assert done.returncode == 1
        assert "matplotlib, which draws, cannot start" in done.stderr
        assert "matplotlibrc" in done.stderr


def test_a_style_that_asks_for_latex_or_for_no_known_font(shared, tmp_path, call):
    (tmp_path / "tex.mplstyle").write_text("text.usetex: True\n")
    said = call("plot", shared / "small.h5", "-o", "a.png", "--style", "tex.mplstyle", code=2).err
    assert "found text.usetex: True" in said
    (tmp_path / "font.mplstyle").write_text("font.family: Nowhere Sans\n")
    words = [SCRIPT, "plot", shared / "small.h5", "-o", "a.png", "--style", "font.mplstyle"]
    done = subprocess.run(words, cwd=tmp_path, text=True, capture_output=True)
    assert done.returncode == 0
    lines = done.stderr.splitlines()
    assert len(lines) == len(set(lines)) <= 4
    assert any("'Nowhere Sans' not found" in line for line in lines)
    assert "characters that no font here has" not in done.stderr

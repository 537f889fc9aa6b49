"""The collar in the hole, and the film of it: everything to scale, at its moment."""

import json
import os
from pathlib import Path

import numpy as np
import pytest
from made_up import GAP, make_results, make_trace
from matplotlib.patches import Circle
from PIL import Image
from seen import artists

from nsdrill import figures
from nsdrill.data import Trace
from nsdrill.errors import InputError, NsdrillError
from nsdrill.figures import look_of
from nsdrill.figures.kinds.hole import FRAME_RATE, animate, film_name

COLLAR = 0.2286  # m, the usual outer diameter


@pytest.fixture
def whirl():
    trace = make_trace(12.0)
    trace.attrs["study_resolved"] = json.dumps({"drillstring": {"collar": {"outer_diameter": COLLAR}}})
    return trace


def test_hole_and_collar_are_to_scale(whirl):
    (axes,) = figures.draw(whirl, "hole").axes
    (wall,), (collar,) = artists(axes, "wall"), artists(axes, "collar")
    assert isinstance(wall, Circle)
    assert wall.get_radius() == pytest.approx(1e3 * (GAP + COLLAR / 2))
    assert collar.get_radius() == pytest.approx(1e3 * COLLAR / 2)
    assert collar.get_center() == pytest.approx((1e3 * whirl["x"][-1], 1e3 * whirl["y"][-1]))
    assert axes.get_aspect() == 1.0
    spoke = np.array(artists(axes, "spoke")[0].get_data())
    angle = np.arctan2(*(spoke[:, 1] - spoke[:, 0])[::-1])
    wanted = whirl["drive_angle"][-1] + whirl["twist"][-1]
    assert np.cos(angle - wanted) == pytest.approx(1.0), "the collar turns with the bit"


def test_the_point_says_how_wide_a_collar_is_that_was_an_axis(whirl):
    whirl.attrs["at"] = json.dumps({"drillstring.collar.outer_diameter": 0.2})
    (axes,) = figures.draw(whirl, "hole", units="field").axes
    assert artists(axes, "collar")[0].get_radius() == pytest.approx(0.1 / 0.0254)


def test_a_trace_without_widths_is_told(whirl, trace):
    with pytest.raises(InputError, match="no width of the hole or of the collar"):
        figures.draw(trace, "hole")
    whirl.attrs["gap"] = None
    with pytest.raises(InputError, match="no width"):
        figures.draw(whirl, "hole")


def test_the_direction_of_an_orbit_is_marked(whirl):
    """The triangles point along the motion at their places, and the dot is the last
    sample."""
    (axes,) = figures.draw(whirl, "orbit").axes
    (end,) = artists(axes, "end")
    assert (end.get_xdata()[0], end.get_ydata()[0]) == pytest.approx((1e3 * whirl["x"][-1], 1e3 * whirl["y"][-1]))
    marks = artists(axes, "direction")
    assert len(marks) == 2
    for mark in marks:
        place = int(np.argmin(np.hypot(1e3 * whirl["x"] - mark.get_xdata()[0], 1e3 * whirl["y"] - mark.get_ydata()[0])))
        # its tip is the second corner
        arrow = mark._marker.get_transform().transform(mark.get_marker().vertices)
        heading = np.arctan2(*(arrow[1] - arrow[3])[::-1])
        assert np.ptp(arrow @ [np.cos(heading), np.sin(heading)]) > 1.5 * np.ptp(
            arrow @ [-np.sin(heading), np.cos(heading)]
        )  # else one does not see where it points
        velocity = np.array([whirl["vx"][place], whirl["vy"][place]])
        assert velocity @ [np.cos(heading), np.sin(heading)] > 0.98 * np.hypot(*velocity)


def test_a_gif_has_every_frame_and_the_same_bytes(whirl, tmp_path):
    look = look_of(time=(2.0, 4.0), width="2.5in")
    for name in "ab":
        frames, seconds = animate(whirl, tmp_path / f"{name}.gif", look=look)
    assert (frames, seconds) == (2 * FRAME_RATE + 1, pytest.approx(2.0))
    assert (tmp_path / "a.gif").read_bytes() == (tmp_path / "b.gif").read_bytes()
    with Image.open(tmp_path / "a.gif") as film:
        assert film.n_frames == frames
        assert film.info["duration"] == 1000 / FRAME_RATE
        assert film.info["loop"] == 0
        pictures = []
        for number in (0, FRAME_RATE):
            film.seek(number)
            pictures.append(np.asarray(film.convert("RGB"), dtype=int))
    moved = np.any(np.abs(pictures[0] - pictures[1]) > 30, axis=-1)
    assert 0.01 < moved.mean() < 0.6, "what moves moves, the rest stands still"


def test_a_film_may_be_slower_than_nature(whirl, tmp_path):
    frames, seconds = animate(whirl, tmp_path / "a.gif", look=look_of(time=(2.0, 2.4), width="2in"), speed=0.25)
    assert (frames, seconds) == (41, pytest.approx(0.4))


def test_by_default_the_last_turns_of_the_bit(whirl, tmp_path):
    whirl.variables["bit_speed"][:] = 10.0
    _, seconds = animate(whirl, tmp_path / "a.gif", look=look_of(width="2in"))
    assert seconds == pytest.approx(5 * 2 * np.pi / 10, abs=1 / FRAME_RATE)


STAND_IN = """#!{python}
import sys
data = sys.stdin.buffer.read()
size = sys.argv[sys.argv.index("-s") + 1]
{end}
open(sys.argv[-1], "w").write(f"{{size}} {{len(data)}}")
"""


def stand_in(folder: Path, monkeypatch: pytest.MonkeyPatch, end: str = "") -> None:
    import sys

    folder.mkdir()
    (folder / "ffmpeg").write_text(STAND_IN.format(python=sys.executable, end=end))
    (folder / "ffmpeg").chmod(0o755)
    monkeypatch.setenv("PATH", str(folder), prepend=os.pathsep)


def test_ffmpeg_is_given_every_pixel(whirl, tmp_path, monkeypatch):
    stand_in(tmp_path / "bin", monkeypatch)
    assert film_name(tmp_path / "a.mp4") == str(tmp_path / "a.mp4")
    frames, _ = animate(whirl, tmp_path / "a.mp4", look=look_of(time=(2.0, 2.2), width="2.3in"))
    size, count = (tmp_path / "a.mp4").read_text().split()
    wide, high = map(int, size.split("x"))
    assert int(count) == frames * wide * high * 4
    assert wide % 2 == high % 2 == 0


def test_a_failing_ffmpeg_leaves_nothing(whirl, tmp_path, monkeypatch):
    stand_in(tmp_path / "bin", monkeypatch, "sys.exit('no encoder')")
    with pytest.raises(NsdrillError, match="ffmpeg could not write the film: no encoder"):
        animate(whirl, tmp_path / "a.mp4", look=look_of(time=(2.0, 2.2), width="2in"))
    assert [path.name for path in tmp_path.iterdir()] == ["bin"]


def test_without_ffmpeg_it_is_a_gif(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    assert film_name("whirl.mp4") == "whirl.gif"
    with pytest.raises(InputError, match=r"whirl\.avi: found '\.avi' as the kind of film; allowed: \.mp4, \.gif"):
        film_name("whirl.avi")


def test_what_cannot_be_a_film_is_told(whirl, tmp_path):
    path = tmp_path / "a.gif"
    with pytest.raises(InputError, match="trace: found no collar that moves"):
        animate(make_results(), path)
    with pytest.raises(InputError, match=r"speed: found 0; allowed"):
        animate(whirl, path, speed=0.0)
    with pytest.raises(InputError, match=r"trace: found 12 s of a trace, 299\d\d frames; allowed: 3000\. Choose"):
        animate(whirl, path, look=look_of(time=(0.0, None)), speed=0.01)
    assert not list(tmp_path.iterdir())


def test_arrows_of_a_straight_orbit_do_not_cover_each_other():
    """A collar that swings along a line passes the same places both ways."""
    time = np.linspace(0.0, 12.0, 1201)
    trace = make_trace(duration=12.01, sample=0.01)
    swing = 0.05 * np.sin(2 * np.pi * time / 2.0)  # the arrows of equal spacing would meet
    trace.variables |= {"x": swing, "y": 0.0 * swing, "vx": np.gradient(swing, time), "vy": 0.0 * swing}
    (axes,) = figures.draw(trace, "orbit").axes
    places = [mark.get_xdata()[0] for mark in (*artists(axes, "end"), *artists(axes, "direction"))]
    assert len(places) == 3
    assert np.diff(np.sort(places)).min() > 5.0  # mm


@pytest.mark.parametrize("samples", [2, 3, 4, 5, 21, 24])
def test_the_orbit_of_a_short_trace_is_drawn(whirl, samples):
    short = Trace(whirl.time[:samples], {k: v[:samples] for k, v in whirl.variables.items()}, whirl.attrs)
    (axes,) = figures.draw(short, "orbit").axes
    assert len(artists(axes, "end")) == (samples > 2)

"""Options of nsdrill plot for the look of a picture, and films."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import matplotlib as mpl
import pytest
from PIL import Image

import nsdrill
from nsdrill.errors import InputError


def size(path: Path) -> tuple[int, int]:
    with Image.open(path) as image:
        return image.size


def test_a_picture_is_as_large_as_asked(call: Any, shared: Path, tmp_path: Path) -> None:
    path = tmp_path / "a.png"
    answer = call(
        "plot",
        shared / "small.h5",
        "-o",
        path,
        "--width",
        "3.3in",
        "--height",
        "60mm",
        "--no-title",
    )
    assert answer.code == 0, answer.err
    assert size(path) == pytest.approx((3.3 * 300, 60 / 25.4 * 300), abs=1)


def test_a_style_file_sets_the_resolution(call: Any, shared: Path, tmp_path: Path) -> None:
    (tmp_path / "a.mplstyle").write_text("savefig.dpi: 100\n")
    answer = call(
        "plot", shared / "small.h5", "-o", tmp_path / "a.png", "--style", tmp_path / "a.mplstyle"
    )
    assert answer.code == 0, answer.err
    assert size(tmp_path / "a.png")[0] == 700


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--width", "3"), "--width: found '3', a number without a unit"),
        (("--title", "a", "--no-title"), "--title: found with --no-title"),
        (("--from", "3s"), "--from and --to: found with results"),
        (("--speed", "2"), "--speed: found without --animate"),
        (("--animate", "--kind", "map"), "--animate: found with --kind map"),
        (("--animate",), "found '.png' as the kind of film; allowed: .mp4, .gif"),
    ],
)
def test_wrong_options_leave_no_file(
    call: Any, shared: Path, tmp_path: Path, options: tuple[str, ...], message: str
) -> None:
    answer = call("plot", shared / "small.h5", "-o", tmp_path / "a.png", *options)
    assert answer.code == 2
    assert message in answer.err
    assert not list(tmp_path.iterdir())


def test_results_are_no_film(call: Any, shared: Path, tmp_path: Path) -> None:
    answer = call("plot", shared / "small.h5", "-o", tmp_path / "a.gif", "--animate")
    assert answer.code == 2
    assert "--animate: found no collar that moves in the hole; allowed: a trace" in answer.err


def test_a_film_from_both_sides(
    call: Any, shared: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The command and the function give the same bytes; without ffmpeg both say that it
    is a GIF."""
    monkeypatch.setenv("PATH", str(tmp_path))
    trace = nsdrill.replay(shared / "small.h5", rotary_speed=3.0, procedure="up")
    nsdrill.save(trace, tmp_path / "trace.h5")
    part = (float(trace.time[0]), float(trace.time[0]) + 0.2)
    answer = call(
        "plot",
        tmp_path / "trace.h5",
        "--animate",
        "-o",
        tmp_path / "a.mp4",
        "--to",
        f"{part[1]} s",
        "--width",
        "2in",
    )
    assert answer.code == 0, answer.err
    assert "There is no ffmpeg here, which MP4 needs: a GIF is written in place of" in answer.err
    written = nsdrill.animate(trace, tmp_path / "b.mp4", time=part, width="2 in")
    assert os.path.basename(written) == "b.gif"
    assert (tmp_path / "a.gif").read_bytes() == (tmp_path / "b.gif").read_bytes()
    with pytest.raises(nsdrill.FileError):
        nsdrill.animate(trace, tmp_path / "b.gif")
    with pytest.raises(InputError, match="trace: found results"):
        nsdrill.animate(shared / "small.h5", tmp_path / "c.gif")


def test_python_takes_the_same_and_tells_in_its_words(shared: Path) -> None:
    figure = nsdrill.plot(shared / "small.h5", "summary", width="3.3 in", style={"font.size": 6.0})
    assert figure.get_figwidth() == pytest.approx(3.3)
    assert mpl.rcParams["font.size"] != 6.0
    with pytest.raises(InputError, match=r"^time: found with results"):
        nsdrill.plot(shared / "small.h5", time=(0.0, 1.0))
    with pytest.raises(InputError, match=r"^font_size: found 'huge'"):
        nsdrill.plot(shared / "small.h5", font_size="huge")
    with pytest.warns(nsdrill.RunWarning, match="characters that no font here has"):
        nsdrill.plot(shared / "small.h5", title="\U0001fae8")

"""A whirl as a film: the collar in the hole, to scale, turning as it did. MP4 by
ffmpeg, or GIF by Pillow."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from PIL import Image

from nsdrill.data import Trace
from nsdrill.errors import InputError, NsdrillError
from nsdrill.files import replacing
from nsdrill.plot.kinds.hole import BIT, EDGE, MUD, ROCK, STEEL, Scene
from nsdrill.plot.kinds.orbit import has_orbit
from nsdrill.plot.limits import between
from nsdrill.plot.look import Look
from nsdrill.plot.style import (
    BLUE,
    VERMILLION,
    house_style,
    looking,
    new_figure,
    page_width,
    put_title,
    quiet_glyphs,
    settle,
    titled,
)
from nsdrill.plot.traces import check_length, title_of

SUFFIXES = (".mp4", ".gif")
RATE = 25  # frames per second
DOTS = 120  # per inch
LAST_TURNS = 5  # that are shown where no time is given
MOST_FRAMES = 3000
COLOURS = 96  # of a GIF: the picture is flat
KEY = ("#FFFFFF", ROCK, MUD, STEEL, EDGE, BIT, BLUE, VERMILLION)


def film_name(path: str | os.PathLike[str]) -> str:
    """The name of the film to be written: ``path``, or with the ending .gif where there
    is no ffmpeg for an MP4. InputError where it is the name of neither."""
    suffix = Path(path).suffix.lower()
    if suffix not in SUFFIXES:
        raise InputError(
            f"{os.fspath(path)}: found {suffix or 'no suffix'!r} as the kind of film; allowed: "
            f"{', '.join(SUFFIXES)}."
        )
    if suffix == ".mp4" and shutil.which("ffmpeg") is None:
        return str(Path(path).with_suffix(".gif"))
    return os.fspath(path)


def animate(
    trace: Trace,
    path: str | os.PathLike[str],
    *,
    units: str = "si",
    look: Look | None = None,
    speed: float = 1.0,
    overwrite: bool = True,
) -> tuple[int, float]:
    """Write the film of a trace to ``path`` (see :func:`film_name`), in one step; the
    numbers of frames and of seconds of the trace that it shows.

    The part of the trace is that of ``look.time``, by default the last turns of the
    bit; ``speed`` 2 is twice as fast as nature. InputError where the trace has no
    collar in a hole, or the film would be too long.
    """
    look = look or Look()
    if not isinstance(trace, Trace) or not has_orbit(trace):
        raise InputError(
            "--animate: found no collar that moves in the hole; allowed: a trace "
            "with lateral motion."
        )
    check_length(trace)
    if not 0.01 <= speed <= 100.0:
        raise InputError(f"--speed: found {speed:g}; allowed: 0.01 to 100 times as fast as nature.")
    times = _times(trace, look, speed)
    with looking(look), house_style(), quiet_glyphs():
        frames = _frames(trace, units, times)
        with replacing(Path(path), overwrite=overwrite) as unfinished:
            if Path(path).suffix.lower() == ".gif":
                _write_gif(frames, unfinished)
            else:
                _write_mp4(frames, unfinished)
    return len(times), float(times[-1] - times[0])


def _times(trace: Trace, look: Look, speed: float) -> Any:
    """The moments of the frames."""
    if look.time is not None:
        shown = between(trace, look.time).time
        first, last = float(shown[0]), float(shown[-1])
    else:
        last = float(trace.time[-1])
        turn = 2 * pi / max(float(np.nanmean(np.abs(trace["bit_speed"]))), 1e-3)
        first = max(float(trace.time[0]), last - LAST_TURNS * turn)
    count = int((last - first) / speed * RATE + 1e-6) + 1
    if count > MOST_FRAMES:
        raise InputError(
            f"--animate: found {last - first:.4g} s of a trace, {count} frames; allowed: "
            f"{MOST_FRAMES}. Choose a part "
            "of the trace with --from and --to, or a higher --speed."
        )
    return first + np.arange(max(count, 2)) * speed / RATE


def _frames(trace: Trace, units: str, times: Any) -> Iterator[Any]:
    """The pixels of every frame [rows, columns, RGBA]; what stands still is drawn once."""
    figure = new_figure(page_width(4.0), page_width(4.0) + (0.6 if titled() else 0.2))
    figure.set_dpi(DOTS)
    axes = figure.add_subplot()
    scene = Scene(axes, trace, units)
    put_title(figure, title_of(trace, units, width=50))
    settle(figure)
    canvas: Any = figure.canvas
    assert isinstance(canvas, FigureCanvasAgg)
    for artist in scene.moving:
        artist.set_animated(True)
    canvas.draw()
    still = canvas.copy_from_bbox(figure.bbox)
    for time in times:
        scene.show(min(float(time), float(trace.time[-1])))
        canvas.restore_region(still)
        for artist in scene.moving:
            axes.draw_artist(artist)
        pixels = np.asarray(canvas.buffer_rgba())
        # films want even numbers
        yield pixels[: pixels.shape[0] // 2 * 2, : pixels.shape[1] // 2 * 2].copy()


def _write_gif(frames: Iterator[Any], path: str | os.PathLike[str]) -> None:
    begin = Image.fromarray(next(frames)).convert("RGB")
    shown = begin.copy()
    for number, colour in enumerate(KEY):  # those of small things have a place as well
        shown.paste(colour, (40 * number, 0, 40 * number + 40, 40))
    palette = shown.quantize(
        COLOURS, Image.Quantize.MAXCOVERAGE, kmeans=2, dither=Image.Dither.NONE
    )
    first = begin.quantize(palette=palette, dither=Image.Dither.NONE)

    def rest() -> Iterator[Image.Image]:
        for frame in frames:
            yield (
                Image.fromarray(frame)
                .convert("RGB")
                .quantize(palette=palette, dither=Image.Dither.NONE)
            )

    first.save(
        path,
        format="GIF",
        save_all=True,
        append_images=rest(),
        duration=1000 // RATE,
        loop=0,
        optimize=False,
    )


def _write_mp4(frames: Iterator[Any], path: str | os.PathLike[str]) -> None:
    first = next(frames)
    command = [
        "ffmpeg",
        "-loglevel",
        "error",
        "-y",
        "-f",
        "rawvideo",
        "-pix_fmt",
        "rgba",
        "-s",
        f"{first.shape[1]}x{first.shape[0]}",
        "-r",
        str(RATE),
        "-i",
        "-",
        "-an",
        "-pix_fmt",
        "yuv420p",
        "-crf",
        "18",
        "-movflags",
        "+faststart",
        "-f",
        "mp4",
        os.fspath(path),
    ]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdin is not None
        assert process.stderr is not None
        try:
            process.stdin.write(first.tobytes())
            for frame in frames:
                process.stdin.write(frame.tobytes())
            process.stdin.close()
        except BrokenPipeError:  # it has said why on its standard error
            pass
        said = process.stderr.read().decode(errors="replace").strip().splitlines()
        code = process.wait()
    if code:
        raise NsdrillError(
            f"ffmpeg could not write the film: {said[-1] if said else f'exit code {code}'}."
        )

"""Animations of whirl: the collar in the hole, to scale, with its rotation. MP4 by
ffmpeg, or GIF by Pillow."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator
from math import pi
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from PIL import Image

from nsdrill.data import Trace
from nsdrill.errors import InputError, NsdrillError, Refusal, option
from nsdrill.files import CheckedFile, replacing
from nsdrill.models.registry import drawn_in
from nsdrill.plot.kinds.hole import BIT, EDGE, MUD, ROCK, STEEL, Scene, has_orbit, square_page
from nsdrill.plot.look import Look, between
from nsdrill.plot.page import freeze_layout
from nsdrill.plot.style import BLUE, VERMILLION, house_style, using_look, without_glyph_warnings
from nsdrill.plot.traces import check_length

SUFFIXES = (".mp4", ".gif")
FRAME_RATE = 25  # frames per second
DPI = 120
LAST_REVOLUTIONS = 5  # of the bit, shown where no time is given
MAX_FRAMES = 3000
PALETTE_SIZE = 96  # colours of a GIF: enough for a picture without shading
KEY_COLOURS = ("#FFFFFF", ROCK, MUD, STEEL, EDGE, BIT, BLUE, VERMILLION)


def film_name(path: str | os.PathLike[str]) -> str:
    """The path of the film to be written: ``path``, with the suffix .gif where ffmpeg
    is missing for an MP4. InputError where the suffix is neither."""
    suffix = Path(path).suffix.lower()
    if suffix not in SUFFIXES:
        raise InputError(
            f"{os.fspath(path)}: found {suffix or 'no suffix'!r} as the kind of film; allowed: {', '.join(SUFFIXES)}."
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
    """Write the film of a trace to ``path`` (see :func:`film_name`), in one step;
    returns the number of frames and the time [s] of the trace that it shows.

    The part of the trace is that of ``look.time``, by default the last revolutions of
    the bit; ``speed`` 2 is twice as fast as in reality. InputError where the trace has
    no lateral motion, or the film would be too long.
    """
    look = look or Look()
    if not isinstance(trace, Trace) or not has_orbit(trace):
        raise Refusal("trace", "no collar that moves in the hole", "a trace with lateral motion")
    check_length(trace)
    if not 0.01 <= speed <= 100.0:
        raise Refusal("speed", f"{speed:g}", "0.01 to 100 times as fast as nature")
    times = _frame_times(trace, look, speed)
    with using_look(look), house_style(), without_glyph_warnings():
        frames = _render_frames(trace, units, times)
        with replacing(Path(path), overwrite=overwrite) as file:
            if Path(path).suffix.lower() == ".gif":
                _write_gif(frames, file)
            else:
                _write_mp4(frames, file.name)
    return len(times), float(times[-1] - times[0])


def _frame_times(trace: Trace, look: Look, speed: float) -> Any:
    """The times of the frames [s]."""
    if look.time is not None:
        part = between(trace, look.time).time
        first, last = float(part[0]), float(part[-1])
    else:
        last = float(trace.time[-1])
        revolution = 2 * pi / max(float(np.nanmean(np.abs(trace[drawn_in(trace.attrs).speed]))), 1e-3)
        first = max(float(trace.time[0]), last - LAST_REVOLUTIONS * revolution)
    count = int((last - first) / speed * FRAME_RATE + 1e-6) + 1
    if count > MAX_FRAMES:
        raise InputError(
            f"{option('trace')}: found {last - first:.4g} s of a trace, {count} frames; allowed: "
            f"{MAX_FRAMES}. Choose a part "
            f"of the trace with {option('time')}, or a higher {option('speed')}."
        )
    return first + np.arange(max(count, 2)) * speed / FRAME_RATE


def _render_frames(trace: Trace, units: str, times: Any) -> Iterator[Any]:
    """The pixels of every frame [rows, columns, RGBA]. Static artists are drawn
    once."""
    figure, axes = square_page(trace, units, 0.6)
    figure.set_dpi(DPI)
    scene = Scene(axes, trace, units)
    freeze_layout(figure)
    canvas: Any = figure.canvas
    assert isinstance(canvas, FigureCanvasAgg)
    for artist in scene.moving_artists:
        artist.set_animated(True)
    canvas.draw()
    background = canvas.copy_from_bbox(figure.bbox)
    for time in times:
        scene.show(min(float(time), float(trace.time[-1])))
        canvas.restore_region(background)
        for artist in scene.moving_artists:
            axes.draw_artist(artist)
        pixels = np.asarray(canvas.buffer_rgba())
        # yuv420p requires even numbers of pixels
        yield pixels[: pixels.shape[0] // 2 * 2, : pixels.shape[1] // 2 * 2].copy()


def _write_gif(frames: Iterator[Any], file: CheckedFile) -> None:
    first_image = Image.fromarray(next(frames)).convert("RGB")
    sample = first_image.copy()
    # so that the palette has the colours of small artists too
    for number, colour in enumerate(KEY_COLOURS):
        sample.paste(colour, (40 * number, 0, 40 * number + 40, 40))
    palette = sample.quantize(PALETTE_SIZE, Image.Quantize.MAXCOVERAGE, kmeans=2, dither=Image.Dither.NONE)
    first_frame = first_image.quantize(palette=palette, dither=Image.Dither.NONE)

    def remaining_frames() -> Iterator[Image.Image]:
        for frame in frames:
            yield (Image.fromarray(frame).convert("RGB").quantize(palette=palette, dither=Image.Dither.NONE))

    first_frame.save(
        SimpleNamespace(write=file.write),  # with a descriptor Pillow would write by itself
        format="GIF",
        save_all=True,
        append_images=remaining_frames(),
        duration=1000 // FRAME_RATE,
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
        str(FRAME_RATE),
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
        except BrokenPipeError:  # the reason stands on its standard error, read below
            pass
        error_lines = process.stderr.read().decode(errors="replace").strip().splitlines()
        code = process.wait()
    if code:
        reason = error_lines[-1] if error_lines else f"exit code {code}"
        raise NsdrillError(f"ffmpeg could not write the film: {reason}.")

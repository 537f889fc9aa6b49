"""The collar in the hole, to scale, at one time of a trace; and films of whirl, sequences
of such pictures: MP4 by ffmpeg, or GIF by Pillow."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from collections.abc import Iterator
from math import pi
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.patches import Circle
from PIL import Image

from nsdrill.data import Array, Trace, flat, frozen_modes, resolved_study
from nsdrill.errors import InputError, NsdrillError, Refusal, option
from nsdrill.figures import check_suffix
from nsdrill.figures.look import Look, between
from nsdrill.figures.page import draw_page, freeze_layout, has_title, set_panel_title
from nsdrill.figures.painters import Page, Paint
from nsdrill.figures.picture_kinds import TRACE, Kind
from nsdrill.figures.style import (
    BLUE,
    REFERENCE,
    VERMILLION,
    Properties,
    Property,
    font_size,
    house_style,
    page_width,
    using_look,
    without_glyph_warnings,
)
from nsdrill.figures.traces import check_length, shown_part, title_of
from nsdrill.files import CheckedFile, replacing
from nsdrill.models.registry import drawn_in
from nsdrill.words.labels import quantity

ORBIT_REVOLUTIONS = 5  # of the drive: more of them cover each other


def square_page(trace: Trace, units: str, paint: dict[str, Paint], height_of_title: float) -> Page:
    """The page of one square panel of a trace."""
    check_length(trace)
    width = page_width(4.0)
    height = width + (height_of_title if has_title() else 0.2)
    return Page(paint, title_of(trace, units, width=50), width, height)


def cross_section(axes: Axes, half_width: float, x_label: str, y_label: str, **placed: Property) -> None:
    """Let a panel show the cross-section of the hole, with a small cross at its axis;
    ``placed`` are properties of the cross, as ``zorder`` or ``gid``."""
    ends = -half_width, half_width
    axes.set(xlim=ends, ylim=ends, xlabel=x_label, ylabel=y_label, aspect="equal")
    axes.plot([0], [0], marker="+", color=REFERENCE, markersize=6, markeredgewidth=0.6, linestyle="none", **placed)


def draw_circle(axes: Axes, radius: float, **properties: Property) -> None:
    """A circle around the axis of the hole: its wall, where the ``properties`` do not say
    otherwise."""
    axes.add_patch(Circle((0, 0), radius, **{"fill": False, "color": REFERENCE, "linewidth": 0.9, **properties}))


def has_orbit(trace: Trace) -> bool:
    """Whether the collar centre of the trace has a path in the hole."""
    return {"x", "y", "wall_force"} <= trace.variables.keys() and "lateral" not in frozen_modes(trace.attrs)


ROCK, MUD, STEEL, EDGE = "#CDBFA9", "#F5F2EA", "#C3CCD4", "#5A6570"
BIT, BLADES = "#8A7F6C", 3  # the bit below is a ring, with blades that rotate with it
PATH_REVOLUTIONS = 1.0  # of the bit: the length of the path up to the present time


def radii_of(trace: Trace) -> tuple[float, float]:
    """The radii of the hole and of the collar [m]; InputError where the attributes of
    the trace and its study lack them. The collar has the value of the axis where it was
    swept, else that of the study."""
    key, gap = drawn_in(trace.attrs).collar, trace.attrs.get("gap")
    value = {**dict(flat(resolved_study(trace.attrs))), **json.loads(str(trace.attrs.get("at") or "{}"))}.get(key)
    if gap is None or not isinstance(value, int | float):
        raise InputError(
            "trace: found no width of the hole or of the collar; allowed: a trace whose string has them. "
            "The kind orbit needs neither."
        )
    return float(gap) + 0.5 * value, 0.5 * value


class Scene:
    """Hole, bit and collar in one axes. The static artists are drawn once;
    :meth:`show` moves the others."""

    def __init__(self, axes: Axes, trace: Trace, units: str) -> None:
        across, up = quantity("x", units), quantity("y", units)
        self._hole, self._collar_radius = (radius / across.scale for radius in radii_of(trace))
        drawn = drawn_in(trace.attrs)
        self._trace, self._speed, self._shown_speed = trace, trace[drawn.speed], quantity(drawn.speed, units)
        self._x, self._y = (trace[name] / across.scale for name in ("x", "y"))
        # that of the bit is also that of the collar above it
        self._angle = sum(trace[name] for name in drawn.angle)
        self._revolution = 2 * pi / max(float(np.nanmean(np.abs(self._speed))), 1e-3)
        axes.set_facecolor(ROCK)
        draw_circle(axes, self._hole, fill=True, color=None, facecolor=MUD, edgecolor=REFERENCE, gid="wall")
        draw_circle(axes, 0.95 * self._hole, gid="bit", color=None, edgecolor=BIT, linewidth=0.6, linestyle="--")
        cross_section(axes, 1.1 * self._hole, across.label, up.label, zorder=4)
        self._blades = [axes.plot([], [], color=BIT, linewidth=3.0, gid="blade")[0] for _ in range(BLADES)]
        self._collar = Circle(
            (0, 0), self._collar_radius, gid="collar", facecolor=STEEL, edgecolor=EDGE, linewidth=0.9, zorder=2
        )
        axes.add_patch(self._collar)
        line: Properties = {"solid_capstyle": "round", "zorder": 3}
        dot: Properties = {"marker": "o", "linestyle": "none"}
        (self._spoke,) = axes.plot([], [], color=EDGE, linewidth=1.2, gid="spoke", **line)
        (self._path,) = axes.plot([], [], color=BLUE, linewidth=0.7, alpha=0.8, gid="path", **line)
        (self._centre,) = axes.plot([], [], color=BLUE, markersize=3.5, zorder=4, **dot)
        (self._contact,) = axes.plot([], [], color=VERMILLION, markersize=6, zorder=5, gid="touch", **dot)
        self._text = axes.text(
            0.02, 0.98, "", gid="clock", transform=axes.transAxes, va="top", fontsize=font_size(7), zorder=6
        )

    @property
    def moving_artists(self) -> list[Artist]:
        """The artists that :meth:`show` moves, in the order in which they are drawn."""
        return [*self._blades, self._collar, self._path, self._spoke, self._centre, self._contact, self._text]

    def show(self, time: float, since: float | None = None) -> None:
        """Move the artists to the ``time`` [s], with the path from ``since`` [s] on, or
        that of the last revolution."""
        times, hole, collar = self._trace.time, self._hole, self._collar_radius
        histories = (self._x, self._y, self._angle, self._trace["wall_force"], self._speed)
        x, y, angle, force, speed = (float(np.interp(time, times, values)) for values in histories)
        for number, blade in enumerate(self._blades):
            direction = angle + 2 * pi * number / BLADES
            blade.set_data(*np.outer([np.cos(direction), np.sin(direction)], [0.9 * hole, 0.985 * hole]))
        self._collar.set_center((x, y))
        self._spoke.set_data([x, x + collar * np.cos(angle)], [y, y + collar * np.sin(angle)])
        begin = time - PATH_REVOLUTIONS * self._revolution if since is None else since
        in_path = (times >= begin) & (times < time)
        self._path.set_data(np.append(self._x[in_path], x), np.append(self._y[in_path], y))
        self._centre.set_data([x], [y])
        radius = np.hypot(x, y)
        touches = force > 0.0 and radius > 0.0
        self._contact.set_data(*(([x / radius * hole], [y / radius * hole]) if touches else ([], [])))
        self._text.set_text(f"{time:.2f} s\nbit {speed / self._shown_speed.scale:.2f} {self._shown_speed.unit}")


def hole(trace: Trace, units: str = "si") -> Page:
    """The end of a trace."""

    def paint(axes: Axes) -> None:
        scene = Scene(axes, trace, units)
        part, words = shown_part(trace, ORBIT_REVOLUTIONS)
        scene.show(float(trace.time[-1]), float(trace.time[part][0]))
        set_panel_title(axes, f"{words or 'path'}; collar and bit at the end")

    return square_page(trace, units, {"hole": paint}, 0.6)


SUFFIXES = (".mp4", ".gif")
FRAME_RATE = 25  # frames per second
DPI = 120
FILM_REVOLUTIONS = 5  # of the bit, shown where no time is given
MAX_FRAMES = 3000
PALETTE_SIZE = 96  # colours of a GIF: enough for a picture without shading
KEY_COLOURS = ("#FFFFFF", ROCK, MUD, STEEL, EDGE, BIT, BLUE, VERMILLION)


def film_name(path: str | os.PathLike[str]) -> str:
    """The path of the film to be written: ``path``, with the suffix .gif where ffmpeg
    is missing for an MP4. InputError where the suffix is neither."""
    if check_suffix(path, SUFFIXES, "film") == ".mp4" and shutil.which("ffmpeg") is None:
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


def _frame_times(trace: Trace, look: Look, speed: float) -> Array:
    """The times of the frames [s]."""
    if look.time is not None:
        part = between(trace, look.time).time
        first, last = float(part[0]), float(part[-1])
    else:
        last = float(trace.time[-1])
        revolution = 2 * pi / max(float(np.nanmean(np.abs(trace[drawn_in(trace.attrs).speed]))), 1e-3)
        first = max(float(trace.time[0]), last - FILM_REVOLUTIONS * revolution)
    count = int((last - first) / speed * FRAME_RATE + 1e-6) + 1
    if count > MAX_FRAMES:
        raise InputError(
            f"{option('trace')}: found {last - first:.4g} s of a trace, {count} frames; allowed: {MAX_FRAMES}. "
            f"Choose a part of the trace with {option('time')}, or a higher {option('speed')}."
        )
    return first + np.arange(max(count, 2)) * speed / FRAME_RATE


def _render_frames(trace: Trace, units: str, times: Array) -> Iterator[Array]:
    """The pixels of every frame [rows, columns, RGBA]. Static artists are drawn
    once."""
    figure, panels = draw_page(square_page(trace, units, {"hole": lambda axes: None}, 0.6))
    figure.set_dpi(DPI)
    axes = panels["hole"]
    scene = Scene(axes, trace, units)
    freeze_layout(figure)
    canvas = figure.canvas
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


def _write_gif(frames: Iterator[Array], file: CheckedFile) -> None:
    first = next(frames)
    sample = Image.fromarray(first).convert("RGB")
    # so that the palette has the colours of small artists too
    for number, colour in enumerate(KEY_COLOURS):
        sample.paste(colour, (40 * number, 0, 40 * number + 40, 40))
    palette = sample.quantize(PALETTE_SIZE, Image.Quantize.MAXCOVERAGE, kmeans=2, dither=Image.Dither.NONE)

    def in_palette(frame: Array) -> Image.Image:
        return Image.fromarray(frame).convert("RGB").quantize(palette=palette, dither=Image.Dither.NONE)

    in_palette(first).save(
        SimpleNamespace(write=file.write),  # with a descriptor Pillow would write by itself
        format="GIF",
        save_all=True,
        append_images=map(in_palette, frames),
        duration=1000 // FRAME_RATE,
        loop=0,
        optimize=False,
    )


def _write_mp4(frames: Iterator[Array], path: str | os.PathLike[str]) -> None:
    first = next(frames)
    size = f"{first.shape[1]}x{first.shape[0]}"
    given = ["-f", "rawvideo", "-pix_fmt", "rgba", "-s", size, "-r", str(FRAME_RATE), "-i", "-", "-an"]
    written = ["-pix_fmt", "yuv420p", "-crf", "18", "-movflags", "+faststart", "-f", "mp4", os.fspath(path)]
    command = ["ffmpeg", "-loglevel", "error", "-y", *given, *written]
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


KINDS = (
    Kind(
        "hole",
        "the collar in the hole, to scale, with the path of its centre; animated, it whirls",
        of=TRACE,
        place=lambda data: 82.5 if isinstance(data, Trace) and has_orbit(data) else None,
        page=hole,
    ),
)

"""The palette is told apart by colour-blind readers, and without any colour."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.text import Text

from nsdrill import plot
from nsdrill.analysis.attractors import Attractor
from nsdrill.data import Results, Trace
from nsdrill.plot import look_of
from nsdrill.plot.kinds.starts import distinct_colours
from nsdrill.plot.page import panels_of
from nsdrill.plot.style import REFERENCE, RESPONSES, contrast, lightness_and_hue, luminance

# Machado, Oliveira & Fernandes (2009), full severity, on linear sRGB.
VISION = {
    "normal": np.eye(3),
    "protanopia": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "deuteranopia": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.01182, 0.04294, 0.968881]],
    "tritanopia": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.3039]],
}
# sRGB, D65
TO_XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
WHITE = np.array([0.9505, 1.0, 1.089])


def lab(colour: str, vision: str) -> np.ndarray:
    rgb = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    xyz = TO_XYZ @ np.clip(np.asarray(VISION[vision]) @ linear, 0, 1) / WHITE
    x, y, z = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16 / 116)
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


@pytest.mark.parametrize("vision", VISION)
def test_responses_differ_in_colour(vision: str) -> None:
    """At least 13 CIELAB units; 2.3 is the least difference that people notice (Mahy et
    al. 1994)."""
    for one, other in combinations(RESPONSES, 2):
        distance = np.linalg.norm(lab(one.colour, vision) - lab(other.colour, vision))
        assert distance > 13, f"{one.name} and {other.name} look alike under {vision}"


def test_responses_differ_in_shape_and_name() -> None:
    assert len({style.marker for style in RESPONSES}) == len(RESPONSES) == 8
    assert len({style.name for style in RESPONSES}) == 8


def test_every_mark_can_be_seen_on_a_dark_page(speeds: Results, trace: Trace) -> None:
    """The contrast of each line and marker, and of all words, is that which WCAG 2.1
    asks of text; grounds are near the page."""
    look = look_of(style="dark_background")
    for data, kind in ((speeds, None), (speeds, "value"), (trace, None)):
        figure = plot.draw(data, kind, look=look)
        page = np.array(to_rgb(figure.get_facecolor()))
        assert luminance(page) == 0.0
        for axes in panels_of(figure):
            for line in axes.lines:
                colour = line.get_markerfacecolor() if line.get_marker() != "None" else None
                colour = line.get_color() if colour in (None, "none") else colour
                hollow = np.array_equal(to_rgb(colour), page)
                colour = line.get_markeredgecolor() if hollow else colour
                assert contrast(np.array(to_rgb(colour)), page) >= 4.4, line.get_gid()
            for patch in axes.patches:
                if str(patch.get_gid()).startswith(("severity", "hysteresis")):
                    assert luminance(np.array(to_rgb(patch.get_facecolor()))) < 0.1
        for text in figure.findobj(Text):
            if text.get_text().strip():
                assert contrast(np.array(to_rgb(text.get_color())), page) >= 4.4, text


def test_a_light_page_keeps_its_colours(speeds: Results) -> None:
    for style in ("ggplot", "bmh", "tableau-colorblind10"):
        figure = plot.draw(speeds, look=look_of(style=style))
        colours = {line.get_color() for axes in figure.axes for line in axes.lines}
        assert colours <= {*(one.colour for one in RESPONSES), "k", REFERENCE}


def test_basins_have_colours_that_can_be_told_apart() -> None:
    """Eight attractors of one response, which were eight tints of one colour, by their
    distances in CIE L*a*b*, in which 2.3 can just be told apart side by side."""
    attractors = [Attractor(number, 5, {}, None, None, 10, 0, 0.1, 0.05, 0.2, {}) for number in range(1, 9)]
    colours = distinct_colours(attractors)
    places = [lightness_and_hue(colour) for colour in colours]
    distances = [np.linalg.norm(a - b) for a, b in combinations(places, 2)]
    assert colours[0] == RESPONSES[5].colour
    assert min(distances) > 25
    assert lightness_and_hue("#FFFFFF") == pytest.approx([100, 0, 0], abs=0.1)

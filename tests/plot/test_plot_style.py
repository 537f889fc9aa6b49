"""The palette is told apart by colour-blind readers, and without any colour."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from nsdrill.plot.style import RESPONSES

# Machado, Oliveira & Fernandes (2009), full severity, on linear sRGB.
VISION = {
    "normal": np.eye(3),
    "protanopia": [
        [0.152286, 1.052583, -0.204868],
        [0.114503, 0.786281, 0.099216],
        [-0.003882, -0.048116, 1.051998],
    ],
    "deuteranopia": [
        [0.367322, 0.860646, -0.227968],
        [0.280085, 0.672501, 0.047413],
        [-0.01182, 0.04294, 0.968881],
    ],
    "tritanopia": [
        [1.255528, -0.076749, -0.178779],
        [-0.078411, 0.930809, 0.147602],
        [0.004733, 0.691367, 0.3039],
    ],
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

"""Draw the model for its page: the string from the drive to the bit, the bit on its lobed
surface, and the cross-section of the collar in the hole.

    python docs/make_model.py

Nothing is to scale. The colours are those of Okabe and Ito, which colour-blind readers
tell apart, and every part has its name beside it.
"""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, FancyArrowPatch, Rectangle

PICTURE = Path(__file__).parent / "pictures" / "model.png"
STEEL, ROCK, WALL = "#0072B2", "#E69F00", "#8C8C8C"
FORCE, PATH = "#D55E00", "#009E73"
SMALL = 8


def arrow(axes: Axes, start: tuple[float, float], end: tuple[float, float], colour: str) -> None:
    axes.add_patch(FancyArrowPatch(start, end, arrowstyle="-|>", mutation_scale=10, color=colour, lw=1.6, zorder=5))


def turning(axes: Axes, x: float, y: float, width: float, colour: str) -> None:
    """An arrow around the vertical axis."""
    axes.add_patch(
        FancyArrowPatch(
            (x - 0.5 * width, y),
            (x + 0.5 * width, y),
            connectionstyle="arc3,rad=0.35",
            arrowstyle="-|>",
            mutation_scale=10,
            color=colour,
            lw=1.6,
            zorder=5,
        )
    )


def string(axes: Axes) -> None:
    """The string: its drive, the pipe, the collars between stabilisers, the bit."""

    def named(text: str, x: float, y: float) -> None:
        axes.plot([x, 0.95], [y, y], color="k", lw=0.6)
        axes.text(1.0, y, text, va="center", fontsize=SMALL)

    axes.set_xlim(-1.7, 3.1)
    axes.set_ylim(-0.5, 10.4)
    for side in (-1, 1):
        axes.plot([side * 0.68] * 2, [0.6, 8.2], color=WALL, lw=4, zorder=0)
    axes.add_patch(Rectangle((-0.5, 9.1), 1.0, 0.6, color="k"))
    named("drive, rotary speed $\\Omega$", 0.5, 9.4)
    turning(axes, 0, 8.8, 1.1, FORCE)
    axes.plot([0, 0], [5.2, 9.1], color=STEEL, lw=3)
    named("pipe: stiffness $k_t$ and $k_a$,\ntwist $\\psi$", 0.04, 7.0)
    axes.add_patch(Rectangle((-0.3, 1.1), 0.6, 4.1, color=STEEL))
    named("stabiliser", 0.6, 4.57)
    named("collars: mass $m_a$, inertia $J$;\nthe span between stabilisers bends", 0.3, 3.4)
    named("stabiliser", 0.6, 2.17)
    for height in (2.0, 4.4):
        for left in (-0.62, 0.3):
            axes.add_patch(Rectangle((left, height), 0.32, 0.35, color="k"))
    axes.fill([-0.45, 0.45, 0.3, -0.3], [0.55, 0.55, 1.1, 1.1], color="k")
    named("bit, speed $\\omega$, position $z$", 0.4, 0.95)
    wave = np.linspace(-1.2, 0.9, 200)
    surface = 0.42 + 0.1 * np.sin(3 * 2 * np.pi * (wave + 1.2) / 2.1)
    axes.fill_between(wave, -0.4, surface, color=ROCK)
    axes.text(1.0, 0.05, "rock with lobes: $k_c$, $s_0$, $n_b$", va="center", fontsize=SMALL)
    arrow(axes, (-1.15, 2.6), (-1.15, 1.2), FORCE)
    axes.text(-1.15, 2.75, "weight\non bit $W$", ha="center", fontsize=SMALL)
    axes.text(-1.7, 10.2, "The string", fontsize=SMALL + 1)
    axes.axis("off")


def hole(axes: Axes) -> None:
    """The collar in the hole, seen along its axis."""
    axes.set_xlim(-1.75, 1.75)
    axes.set_ylim(-1.9, 1.9)
    axes.set_aspect("equal")
    axes.add_patch(Circle((0, 0), 1.53, facecolor="none", edgecolor=WALL, lw=5))
    centre, radius, phi = np.array([0.4, 0.3]), 0.82, 2.2
    axes.add_patch(Circle(tuple(centre), radius, facecolor="#CCE3F0", edgecolor=STEEL, lw=2))
    axes.add_patch(Circle((0, 0), 1.5 - radius, facecolor="none", edgecolor="k", ls="--", lw=0.8))
    mass = centre + 0.3 * np.array([np.cos(phi), np.sin(phi)])
    axes.plot([0, centre[0]], [0, centre[1]], color=PATH, lw=1.8)
    axes.plot([centre[0], mass[0]], [centre[1], mass[1]], color=FORCE, lw=1.8)
    axes.plot(*mass, "s", color=FORCE, ms=5)
    axes.plot(*centre, "o", color=STEEL, ms=5)
    axes.plot(0, 0, "+", color="k", ms=8)
    axes.text(0.2, 0.02, "$r$, $\\theta$", color=PATH, fontsize=SMALL)
    axes.text(centre[0] + 0.08, centre[1], "centre $(x, y)$", va="center", fontsize=SMALL)
    axes.plot([mass[0], -0.3], [mass[1], 0.93], color="k", lw=0.6)
    axes.text(-0.3, 0.95, "mass\ncentre $e_0$", color=FORCE, ha="right", fontsize=SMALL)
    axes.plot([0, -0.72], [0, 0], color="k", lw=0.6)
    axes.text(-0.75, 0, "axis of\nthe hole", ha="right", va="center", fontsize=SMALL)
    turning(axes, 0.45, -0.28, 0.5, FORCE)
    axes.text(
        0,
        -0.9,
        "the centre is on this circle\nwhere the collar\ntouches the wall",
        ha="center",
        va="top",
        fontsize=SMALL,
    )
    arrow(axes, (-0.3, -0.9), (-0.24, -0.66), "k")
    axes.text(1.2, 1.2, "wall, $k_w$", fontsize=SMALL)
    axes.text(-1.7, 1.8, "The collar in the hole: whirl", fontsize=SMALL + 1)
    axes.axis("off")


def main() -> None:
    with mpl.rc_context({"font.family": "DejaVu Sans", "mathtext.fontset": "stix"}):
        figure = Figure(figsize=(7, 4.4), layout="constrained")
        left, right = figure.subplots(1, 2, width_ratios=(1, 1))
        string(left)
        hole(right)
        figure.savefig(PICTURE, dpi=200, metadata={"Software": None})


if __name__ == "__main__":
    main()

"""The cost of safety: the rate of penetration of every operating point against the
probability of a safe run there.

The points that no other point beats in both, the Pareto front, are joined by a line and
labelled with their settings.
"""

from __future__ import annotations

import numpy as np
from matplotlib import patheffects
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from nsdrill.analysis.probability import EVERY, SAFE, probabilities_of
from nsdrill.data import Array, Results
from nsdrill.plot.isolines import RATE_OF_PENETRATION
from nsdrill.plot.labels import fixed_values, heading, operating_point, quantity
from nsdrill.plot.legend import legend_below
from nsdrill.plot.registry import SAMPLES, Kind, has_samples, needs_samples
from nsdrill.plot.slices import robust_limits
from nsdrill.plot.style import BLACK, font_size, new_figure, page_width, put_title
from nsdrill.variables import SAMPLE

SPECIFIC_ENERGY = "mechanical_specific_energy"
# least distances between labels: part of the greatest rate, per cent of probability
RATE_SPACING, PROBABILITY_SPACING = 0.05, 30.0


def draw(results: Results, units: str = "si") -> Figure:
    probabilities = probabilities_of(results)
    probability, low, high = (100.0 * part.ravel() for part in probabilities.of(SAFE))
    shown, energy = quantity(RATE_OF_PENETRATION, units), quantity(SPECIFIC_ENERGY, units)
    rate = _mean(results, RATE_OF_PENETRATION) / shown.scale
    known = np.isfinite(rate)
    front = pareto_front(np.where(known, rate, -np.inf), probability)
    figure = new_figure(page_width(5.5), 4.6)
    axes = figure.add_subplot()
    labelled = front[_spread_out(probability[front], rate[front])] if front.size else front
    axes.errorbar(
        probability[labelled],
        rate[labelled],
        xerr=[(probability - low)[labelled], (high - probability)[labelled]],
        linestyle="none",
        ecolor="#808080",
        elinewidth=0.7,
        capsize=2,
        zorder=2,
        gid="interval",
    )
    axes.plot(probability[front], rate[front], color=BLACK, linewidth=0.8, zorder=2.5, gid="front")
    energies = (
        _mean(results, SPECIFIC_ENERGY) / energy.scale
        if SPECIFIC_ENERGY in results.variables
        else np.full(len(rate), np.nan)
    )
    has_energy = known & np.isfinite(energies)
    axes.scatter(
        probability[known & ~has_energy],
        rate[known & ~has_energy],
        s=14,
        facecolor="white",
        edgecolor=BLACK,
        linewidth=0.5,
        zorder=3,
        gid="points:no energy",
    )
    if has_energy.any():
        lowest, highest = robust_limits(energies[has_energy])
        points = axes.scatter(
            probability[has_energy],
            rate[has_energy],
            s=16,
            c=energies[has_energy],
            cmap="viridis",
            vmin=lowest,
            vmax=highest,
            edgecolor=BLACK,
            linewidth=0.4,
            zorder=3,
            gid="points",
        )
        figure.colorbar(points, ax=axes, label=energy.label, aspect=30, pad=0.01)
    halo = [patheffects.withStroke(linewidth=2.0, foreground="white")]
    for place in labelled:
        label_at_left = probability[place] > 55.0
        axes.annotate(
            _setting_text(results, int(place), units),
            (probability[place], rate[place]),
            fontsize=font_size(6),
            xytext=(-5 if label_at_left else 5, 4),
            textcoords="offset points",
            ha="right" if label_at_left else "left",
            path_effects=halo,
            zorder=4,
        )
    axes.set_xlim(-3.0, 103.0)
    axes.set_ylim(0.0, 1.08 * float(np.max(rate[known], initial=1e-9)))
    axes.set_xlabel(
        f"Probability of a safe run{', whatever the history' if EVERY in probabilities.histories else ''} [%]"
    )
    axes.set_ylabel(shown.label)
    samples = f"{len(results.coords[SAMPLE])} samples"
    put_title(
        figure,
        heading(
            results.attrs, "; ".join(filter(None, (operating_point(fixed_values(results), units), samples))), width=70
        ),
    )
    label = "not beaten in both, with the 95 % interval of the probability"
    legend_below(figure, [Line2D([], [], color=BLACK, linewidth=0.8, label=label)], 1)
    return figure


def pareto_front(rate: Array, probability: Array) -> Array:
    """The indices of the points that no other point beats in both rate and probability,
    the least probable first."""
    order = np.lexsort((-rate, -probability))  # the most probable first, among equals the fastest
    fastest, front = -np.inf, []
    for place in order.tolist():
        if rate[place] > fastest:
            fastest = rate[place]
            front.append(place)
    return np.array(front[::-1], dtype=int)


def _mean(results: Results, name: str) -> Array:
    """The mean of the finite values of a variable over procedures and samples, at every
    operating point; NaN where none is finite."""
    values = np.moveaxis(np.asarray(results[name], dtype=float), 0, -1)
    values = values.reshape(-1, values.shape[-2] * values.shape[-1])
    finite = np.isfinite(values)
    count = finite.sum(axis=1)
    total = np.where(finite, values, 0.0).sum(axis=1)
    return np.divide(total, count, out=np.full(len(count), np.nan), where=count > 0)


def _spread_out(probability: Array, rate: Array) -> Array:
    """The indices of the points of the front that are labelled, so that no two labels
    overlap: the most probable point, then each that is far enough from the last."""
    chosen = [len(rate) - 1]
    for place in range(len(rate) - 2, -1, -1):
        last = chosen[-1]
        rate_distance = (rate[place] - rate[last]) / (RATE_SPACING * max(float(rate.max()), 1e-300))
        distances = rate_distance, (probability[last] - probability[place]) / PROBABILITY_SPACING
        if np.hypot(*distances) >= 1.0:
            chosen.append(place)
    return np.array(chosen)


def _setting_text(results: Results, place: int, units: str) -> str:
    lengths = [len(results.coords[axis]) for axis in results.axes]
    at = dict(zip(results.axes, np.unravel_index(place, lengths), strict=True))
    return operating_point(
        {axis: float(results.coords[axis][i]) for axis, i in at.items() if axis in results.swept}, units
    )


KINDS = (
    Kind(
        "trade-off",
        "rate of penetration against the probability of a safe run, point by point",
        of=SAMPLES,
        place=lambda data: 52 if has_samples(data) and data.swept and RATE_OF_PENETRATION in data.variables else None,
        draw=draw,
        uses=lambda model: tuple(
            variable.name for variable in model.derived if variable.name in (RATE_OF_PENETRATION, SPECIFIC_ENERGY)
        ),
        advice=needs_samples,
    ),
)

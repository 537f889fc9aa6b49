"""What safety costs: the rate of penetration of every operating point against the
probability of a safe run there.

Points that no other one beats in both lie on a line, the front, and carry their
settings.
"""

from __future__ import annotations

import numpy as np
from matplotlib import patheffects
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from nsdrill.analysis.probability import EVERY, SAFE, chances
from nsdrill.data import Array, Results
from nsdrill.plot.equal import RATE
from nsdrill.plot.labels import fixed_values, heading, operating_point, quantity
from nsdrill.plot.legend import legend_below
from nsdrill.plot.registry import SAMPLES, Kind, has_samples, needs_samples
from nsdrill.plot.slices import robust_limits
from nsdrill.plot.style import BLACK, new_figure, page_width, put_title, type_size
from nsdrill.variables import SAMPLE

ENERGY = "mechanical_specific_energy"
# of the greatest rate, and percent of probability, that two names are apart
APART, WIDE = 0.05, 30.0


def draw(results: Results, units: str = "si") -> Figure:
    found = chances(results)
    probability, low, high = (100.0 * part.ravel() for part in found.of(SAFE))
    shown, energy = quantity(RATE, units), quantity(ENERGY, units)
    rate = _mean(results, RATE) / shown.scale
    known = np.isfinite(rate)
    best = front(np.where(known, rate, -np.inf), probability)
    figure = new_figure(page_width(5.5), 4.6)
    axes = figure.add_subplot()
    named = best[_named(probability[best], rate[best])] if best.size else best
    axes.errorbar(
        probability[named],
        rate[named],
        xerr=[(probability - low)[named], (high - probability)[named]],
        linestyle="none",
        ecolor="#808080",
        elinewidth=0.7,
        capsize=2,
        zorder=2,
        gid="interval",
    )
    axes.plot(probability[best], rate[best], color=BLACK, linewidth=0.8, zorder=2.5, gid="front")
    colours = (
        _mean(results, ENERGY) / energy.scale
        if ENERGY in results.variables
        else np.full(len(rate), np.nan)
    )
    told = known & np.isfinite(colours)
    axes.scatter(
        probability[known & ~told],
        rate[known & ~told],
        s=14,
        facecolor="white",
        edgecolor=BLACK,
        linewidth=0.5,
        zorder=3,
        gid="points:no energy",
    )
    if told.any():
        least, most = robust_limits(colours[told])
        drawn = axes.scatter(
            probability[told],
            rate[told],
            s=16,
            c=colours[told],
            cmap="viridis",
            vmin=least,
            vmax=most,
            edgecolor=BLACK,
            linewidth=0.4,
            zorder=3,
            gid="points",
        )
        figure.colorbar(drawn, ax=axes, label=energy.label, aspect=30, pad=0.01)
    halo = [patheffects.withStroke(linewidth=2.0, foreground="white")]
    for place in named:
        right = probability[place] > 55.0
        axes.annotate(
            _setting(results, int(place), units),
            (probability[place], rate[place]),
            fontsize=type_size(6),
            xytext=(-5 if right else 5, 4),
            textcoords="offset points",
            ha="right" if right else "left",
            path_effects=halo,
            zorder=4,
        )
    axes.set_xlim(-3.0, 103.0)
    axes.set_ylim(0.0, 1.08 * float(np.max(rate[known], initial=1e-9)))
    axes.set_xlabel(
        f"Probability of a safe "
        f"run{', whatever the history' if EVERY in found.histories else ''} [%]"
    )
    axes.set_ylabel(shown.label)
    samples = f"{len(results.coords[SAMPLE])} samples"
    put_title(
        figure,
        heading(
            results.attrs,
            "; ".join(filter(None, (operating_point(fixed_values(results), units), samples))),
            width=70,
        ),
    )
    words = "not beaten in both, with the 95 % interval of the probability"
    legend_below(figure, [Line2D([], [], color=BLACK, linewidth=0.8, label=words)], 1)
    return figure


def front(rate: Array, probability: Array) -> Array:
    """The places of the points that no other point beats in rate and probability, the
    least probable first."""
    order = np.lexsort((-rate, -probability))  # the most probable first, among equals the fastest
    fastest, best = -np.inf, []
    for place in order.tolist():
        if rate[place] > fastest:
            fastest = rate[place]
            best.append(place)
    return np.array(best[::-1], dtype=int)


def _mean(results: Results, name: str) -> Array:
    """A variable at every operating point, the mean over procedures and samples of what
    is finite, NaN for none."""
    values = np.moveaxis(np.asarray(results[name], dtype=float), 0, -1)
    values = values.reshape(-1, values.shape[-2] * values.shape[-1])
    there = np.isfinite(values)
    count = there.sum(axis=1)
    total = np.where(there, values, 0.0).sum(axis=1)
    return np.divide(total, count, out=np.full(len(count), np.nan), where=count > 0)


def _named(probability: Array, rate: Array) -> Array:
    """Which points of the front carry their settings, so that no two lie on one
    another: the most probable one first, then each that is far enough from the last."""
    named = [len(rate) - 1]
    for place in range(len(rate) - 2, -1, -1):
        last = named[-1]
        up = (rate[place] - rate[last]) / (APART * max(float(rate.max()), 1e-300))
        apart = up, (probability[last] - probability[place]) / WIDE
        if np.hypot(*apart) >= 1.0:
            named.append(place)
    return np.array(named)


def _setting(results: Results, place: int, units: str) -> str:
    lengths = [len(results.coords[axis]) for axis in results.axes]
    at = dict(zip(results.axes, np.unravel_index(place, lengths), strict=True))
    return operating_point(
        {axis: float(results.coords[axis][i]) for axis, i in at.items() if axis in results.swept},
        units,
    )


KINDS = (
    Kind(
        "trade-off",
        "rate of penetration against the probability of a safe run, point by point",
        of=SAMPLES,
        place=lambda data: (
            52 if has_samples(data) and data.swept and RATE in data.variables else None
        ),
        draw=draw,
        uses=lambda model: tuple(one.name for one in model.derived if one.name in (RATE, ENERGY)),
        advice=needs_samples,
    ),
)

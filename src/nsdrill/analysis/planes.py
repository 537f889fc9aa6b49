"""The axes of a sweep as those of maps, and how arrays on its grid are arranged as maps."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from nsdrill.data import Array, Results
from nsdrill.errors import InputError
from nsdrill.models.choices import words_along
from nsdrill.models.registry import model_in

# axes of the maps: the first of these that is swept is x, the next one y
ACROSS = ("rotary_speed", "wob", "depth")


def judges(results: Results) -> bool:
    """Whether the model of the results has responses, which tell safe points from others."""
    return bool(model_in(results.attrs).critical)


# of a model whose runs nothing judges
UNJUDGED = "its model declares no responses, so that no run is safe or critical"


def check_judged(results: Results, what: str) -> None:
    """InputError where nothing tells safe points from others."""
    if not judges(results):
        raise InputError(
            f"{what}: found results of the model {model_in(results.attrs).name}, which declares no responses, so that "
            "no run is safe or critical; allowed: those of a model that declares responses."
        )


def axes_of(results: Results) -> tuple[str, str | None, str | None] | None:
    """The axes of the maps: x, y, and the third one, which has a map for each value. An
    axis of words is always the third, as there is nothing between words. None where the
    axes of the sweep do not make maps."""
    swept = [
        axis for axis in (*ACROSS, *(axis for axis in results.axes if axis not in ACROSS)) if axis in results.swept
    ]
    words = [axis for axis in swept if words_along(axis)]
    numbers = [axis for axis in swept if axis not in words]
    if len(swept) > 3 or not numbers or len(words) > 1:
        return None
    third = words[0] if words else numbers[2] if len(numbers) == 3 else None
    return numbers[0], numbers[1] if len(numbers) > 1 else None, third


def axes_or_refusal(results: Results) -> tuple[str, str | None, str | None]:
    """As :func:`axes_of`. InputError where the axes do not make maps."""
    if (swept := axes_of(results)) is not None:
        return swept
    if not results.swept:
        raise InputError(
            "window: found a single operating point; allowed: a sweep of at least one axis. nsdrill show and "
            "report tell of a point."
        )
    raise InputError(
        f"window: found the axes {', '.join(results.swept)}; allowed: a sweep of one to three, among them words as "
        "one, beside one or two of numbers."
    )


Planes = Callable[[Array], Array]  # from the grid of the runs to [third, y, x, history]
Cell = tuple[int, int, int]  # of the maps: third, y, x


def planes_of(results: Results, x: str, y: str | None, third: str | None) -> Planes:
    """What arranges an array on the grid as [third, y, x, history]. Axes that are not
    swept have length 1; they are merged with the third one."""
    axes = results.axes
    order = [axis for axis in axes if axis not in (x, y)] + [axis for axis in (y, x) if axis]
    lengths = [len(results.coords[axis]) if axis else 1 for axis in (third, y, x)]

    def planes(array: Array) -> Array:
        transposed = np.moveaxis(array, 0, len(axes))
        transposed = transposed.transpose(*(axes.index(axis) for axis in order), *range(len(axes), array.ndim))
        return transposed.reshape(*lengths, -1)

    return planes


def mean_known(values: Array) -> Array:
    """The mean of the finite values over the last axis; NaN where there are none."""
    finite = np.isfinite(values)
    count = finite.sum(axis=-1)
    total = np.where(finite, values, 0.0).sum(axis=-1)
    return np.divide(total, count, out=np.full(count.shape, np.nan), where=count > 0)


def along_axis(values: Array, place: int, axes: int = 3) -> Array:
    """The ``values`` along the axis at this ``place`` of so many ``axes``, [third, y, x] of a map,
    in a shape that holds for all of them."""
    return values.reshape([-1 if one == place else 1 for one in range(axes)])


def stretches(chosen: Array) -> list[tuple[int, int]]:
    """The first and last place of each stretch of neighbours of ``chosen`` [n] that are
    true."""
    steps = np.flatnonzero(np.diff(np.pad(chosen.astype(int), 1))).tolist()
    return [(begin, end - 1) for begin, end in zip(steps[::2], steps[1::2], strict=True)]

"""The decorator that makes a kind of picture of a function: what it paints into axes is
drawn, listed and refused as the pictures of nsdrill are."""

from __future__ import annotations

import inspect
import traceback
from collections.abc import Callable, Iterator
from functools import partial
from types import FunctionType
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes

from nsdrill.analysis.counts import Counts, knowledge, known, open_words
from nsdrill.data import Results, Trace
from nsdrill.errors import InputError
from nsdrill.figures.kinds.branch_diagram import held_in
from nsdrill.figures.page import labelled, lay_up, line_entry
from nsdrill.figures.painters import Page
from nsdrill.figures.picture_kinds import BRANCHES, LINE, PLANE, TRACE, Kind, is_branches, is_plane, is_sweep, register
from nsdrill.figures.style import page_width
from nsdrill.figures.traces import title_of
from nsdrill.origin import origin_of
from nsdrill.store import to_dataset
from nsdrill.words.labels import Shown, heading, operating_point, quantity, sweep_title

if TYPE_CHECKING:
    from xarray import Dataset

LAST = 100.0  # its place: the default only where no kind of nsdrill fits
HEIGHT = 3.4  # inches
# What a picture may be of: a group of the registry, which data these are, and the variable
# along whose values --xlim selects them.
OF: dict[str, tuple[str, Callable[[object], bool], Callable[[Any], str | None]]] = {
    "line": (LINE, lambda data: is_sweep(data) and len(data.swept) == 1, lambda data: str(data.swept[0])),
    "plane": (PLANE, is_plane, lambda data: None),
    "trace": (TRACE, lambda data: isinstance(data, Trace), lambda data: "time"),
    "branches": (BRANCHES, is_branches, lambda data: None),
}


def picture(name: str, *, of: str) -> Callable[[FunctionType], FunctionType]:
    """Make a kind of picture of a function, as a decorator above its ``def``. The first line
    of its docstring says what it shows.

    Parameters
    ----------
    name : str
        The name of the kind, as ``plot --kind`` takes it.
    of : str
        What it is drawn of: ``"line"``, a sweep over one axis, ``"plane"``, one over two or
        three, ``"trace"``, or ``"branches"``.

    Returns
    -------
    decorator
        It returns the function, of the axes to paint into, the Dataset in SI, and
        ``shown``: ``shown("twist_max")`` has the ``label`` of a variable with its unit, and
        its ``scale``, the SI value of that unit. Labels of what is painted make the legend.

    Raises
    ------
    InputError
        Where there is a kind of this name already, or no such data.

    Examples
    --------
    >>> @nsdrill.picture("margin", of="line")
    ... def margin(axes, data, shown):
    ...     'distance to the wall'
    ...     radius = data.radius_max.isel(procedure=0, missing_dims="ignore")
    ...     axes.plot(data.rotary_speed, 0.0508 - radius)
    >>> nsdrill.plot("out.h5", "margin").axes[0].get_label()
    'margin'
    """

    def decorated(function: FunctionType) -> FunctionType:
        _Painted(name, of, function).register()
        return function

    return decorated


class _Painted:
    """A kind of picture of a function."""

    def __init__(self, name: object, of: object, function: object) -> None:
        if not isinstance(function, FunctionType):
            raise InputError(f"nsdrill.picture: found {function!r:.80}; allowed: a function, below the decorator.")
        self.function, self.origin = function, origin_of(function)
        if not isinstance(name, str) or not name.replace("-", "_").isidentifier():
            self._refuse(f"the name {name!r}", "letters, digits, underscores and hyphens, a letter first")
        try:
            inspect.signature(function).bind(None, None, None)
        except TypeError:
            self._refuse(f"the arguments {inspect.signature(function)}", "three, as (axes, data, shown)")
        if not isinstance(of, str) or of not in OF:
            self._refuse(f"of={of!r}", "; ".join(f"{word!r}, {group}" for word, (group, *_) in OF.items()))
        self.name, self.of = name, of

    def _refuse(self, found: str, allowed: str) -> NoReturn:
        raise InputError(f"{self.origin}: found a picture with {found}; allowed: {allowed}.")

    def register(self) -> None:
        """Make it known. InputError where another kind has its name."""
        group, fits, across = OF[self.of]
        first = (self.function.__doc__ or "").strip().partition("\n")[0]
        kind = Kind(
            self.name,
            first.rstrip(".") or f"a picture of {self.function.__module__}",
            of=group,
            place=lambda data: LAST if fits(data) else None,
            page=self.page,
            # which of them the function reads is not known before
            uses=lambda model: tuple(variable.name for variable in model.variables),
            across=across,
            advice=lambda data: f"it shows {group}",
        )
        register(kind, self.origin)

    def page(self, data: Results | Trace | Dataset, units: str = "si") -> Page:
        """The picture of these data."""
        given = to_dataset(data) if isinstance(data, Results | Trace) else data
        return Page(
            {self.name: partial(self.paint, given, units)},
            _title(data, units),
            page_width(),
            HEIGHT,
            entries=lambda panels: [*labelled(panels), *_unknown_entry(data)],
        )

    def paint(self, data: Dataset, units: str, axes: Axes) -> None:
        """Call the function. InputError, with its line, where it fails, where what it has
        painted cannot be drawn, and where it has painted nothing."""
        names: dict[str, str] = {}
        before = len(axes.get_children())

        def shown(name: str) -> Shown:
            try:
                found = quantity(name, units)
            except KeyError as error:
                raise InputError(f"found no variable {name!r}; allowed: one of the data") from error
            names[found.label] = name
            return found

        try:
            self.function(axes, _read_only(data), shown)
            _lay_out(axes)
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # also SystemExit
            said = " ".join(str(error).split()).rstrip(".")
            said = said if isinstance(error, InputError) else f"{type(error).__name__}: {said}".rstrip(": ")
            raise InputError(f"{self._line(error)}: the picture {self.name}: {said}.") from error
        if len(axes.get_children()) == before:
            self._refuse(f"the name {self.name}, which paints nothing", "what is painted into its first argument")
        if axes.get_ylabel() in names:
            lay_up(axes, names[axes.get_ylabel()])

    def _line(self, error: BaseException) -> str:
        """The file, and the last line of it that an error comes from."""
        lines = [one.lineno for one in traceback.extract_tb(error.__traceback__) if one.filename == self.origin.file]
        return f"{self.origin.file}, line {lines[-1]}" if lines else str(self.origin)


def _read_only(data: Dataset) -> Dataset:
    """The data whose numbers a function cannot change, as they are those of the caller."""
    found = data.copy()
    for name in found.data_vars:
        if isinstance(values := found[name].variable.data, np.ndarray):
            view = values.view()
            view.flags.writeable = False
            found[name].variable.data = view
    return found


def _lay_out(axes: Axes) -> None:
    """Raise now what else is raised when the words of a panel and of its legend are
    drawn."""
    words = [axes.text(0.5, 0.5, str(one), transform=axes.transAxes) for one in axes.get_legend_handles_labels()[1]]
    axes.get_tightbbox()
    for one in words:
        one.remove()


def _title(data: Results | Trace | Dataset, units: str) -> str:
    if isinstance(data, Trace):
        return title_of(data, units)
    return (
        sweep_title(data, units)
        if isinstance(data, Results)
        else heading(data.attrs, operating_point(held_in(data), units))
    )


def _unknown_entry(data: Results | Trace | Dataset) -> Iterator[Artist]:
    """A note on the runs that failed or are pending, which the function may leave out."""
    if isinstance(data, Results):
        status = data["status"]
        if words := open_words(Counts.over(knowledge(status, known(status))).at(), "runs"):
            yield line_entry(linestyle="none", label=f"not known: {words}")

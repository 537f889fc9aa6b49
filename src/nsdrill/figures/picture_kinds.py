"""The kinds of pictures, and which of them can be drawn of which data.

Each file of :mod:`nsdrill.figures.kinds` declares its pictures as ``KINDS``; their names
stand nowhere else. They import matplotlib, so they are loaded only when needed. A script
makes further kinds with :func:`register`; so does a package, in a module that an entry
point of the group ``nsdrill`` names (:func:`nsdrill.models.registry.import_modules`).
"""

from __future__ import annotations

import difflib
import logging
import pkgutil
import sys
import traceback
from collections.abc import Callable, Iterable, Mapping
from importlib import import_module
from typing import TYPE_CHECKING, Any, Generic, TypeAlias, TypeGuard, TypeVar

from nsdrill.analysis.counts import BEYOND
from nsdrill.analysis.grades import used_by_labels
from nsdrill.analysis.unstable import resting
from nsdrill.data import Attributes, Results, Trace
from nsdrill.errors import InputError, NsdrillError, RunWarning, on_command_line, option, warn
from nsdrill.models.choices import words_along
from nsdrill.models.model_description import Description
from nsdrill.models.numbers import CriticalSpeeds, DriveCard, DriveTuning
from nsdrill.models.registry import import_modules, model_in, of_known_models
from nsdrill.origin import Origin, check_new_name
from nsdrill.records import dataclass
from nsdrill.variables import SAMPLE

if TYPE_CHECKING:
    from xarray import Dataset

    from nsdrill.figures.painters import Page

    Drawable: TypeAlias = Results | Trace | Dataset | "Chart[Numbers]"  # what a picture is drawn of

Numbers = CriticalSpeeds | DriveCard | DriveTuning
N = TypeVar("N", bound=Numbers)


@dataclass(frozen=True)
class Chart(Generic[N]):
    """The numbers of a chart and the contents of its title: ``attrs`` are the title and
    the study, ``point`` the operating values that the chart holds fixed; ``speeds`` are
    the least and the greatest rotary speed [rad/s] of the study."""

    numbers: N
    attrs: Attributes
    point: Mapping[str, float]
    speeds: tuple[float, float]


MAX_COLUMNS = 3  # values of a second axis that stand side by side as columns of one figure
MAX_PANELS = 12

# What a picture is drawn of, as the documentation groups them.
LINE = "a sweep over one axis"
RETURNS = "a sweep with `record.poincare`"
STARTS = "several starts"
SAMPLES = "samples of uncertain numbers"
PLANE = "a sweep over two or three axes"
TRACE = "a trace"
RAMP = "a trace of a ramp"
BRANCHES = "branches"
STUDY = "a study (.yaml)"
VALUE = "a sweep, one value"
GROUPS = (LINE, RETURNS, STARTS, SAMPLES, PLANE, TRACE, RAMP, BRANCHES, STUDY, VALUE)


@dataclass(frozen=True)
class Kind:
    """One kind of picture.

    ``words``
        what it shows.
    ``of``
        what it is drawn of: one of ``GROUPS``.
    ``place(data)``
        None where it cannot be drawn of the data, else a number; of all kinds that fit,
        the one with the least number is the default. The data may be an outline without
        numbers.
    ``page(data, units, **options)``
        the picture before it is drawn, with the painters of its panels by name.
    ``uses(model)``
        the variables of a sweep of a model that it is drawn from, beside ``status``,
        ``response`` and those of checks. Nothing else is read.
    ``takes``
        the names of its options beside the units.
    ``across(data)``
        the variable along the x axis of the panels, None where they have none in
        common.
    ``advice(data)``
        why it does not fit the data.
    ``panels(data)``
        the names of its panels that could be those of other kinds.
    ``general``
        its words for a model that is no drill string, where they are others.
    ``part_of``
        the kind of which this one is a panel, so that it is not listed by itself.
    """

    name: str
    words: str
    of: str
    place: Callable[[object], float | None]
    page: Callable[..., Page]
    uses: Callable[[Description], tuple[str, ...]] = lambda model: ()
    takes: tuple[str, ...] = ()
    across: Callable[[Any], str | None] = lambda data: None
    advice: Callable[[object], str] = lambda data: ""
    panels: Callable[[Any], tuple[str, ...]] = lambda data: ()
    part_of: str = ""
    general: str = ""

    def fits(self, data: object) -> float | None:
        """Its :attr:`place`. NsdrillError, with the name of the kind, where that fails."""
        try:
            return self.place(data)
        except Exception as error:
            last = traceback.extract_tb(error.__traceback__)[-1]
            raise NsdrillError(
                f"plot kind {self.name}: its place ({last.filename}, line {last.lineno}) fails with "
                f"{describe(data)}: {type(error).__name__}: {str(error).rstrip('.')}. Mend it: it gives a number, or "
                "None for data that do not fit."
            ) from error


def fitting(data: object, kinds: Iterable[Kind]) -> dict[str, float]:
    """The places of those of the ``kinds`` that fit the data. One that cannot tell is
    left out, with a warning."""
    places: dict[str, float] = {}
    for kind in kinds:
        try:
            place = kind.fits(data)
        except NsdrillError as error:
            warn(f"{error} The other kinds are drawn without it.", RunWarning)
            continue
        if place is not None:
            places[kind.name] = place
    return places


@of_known_models
def all_kinds() -> dict[str, Kind]:
    """All kinds by their names, among them one value of those that the models measure; those
    of scripts and of other packages last."""
    kinds = _declared_kinds()
    import_modules()
    for name, made in _made.items():
        if name in kinds:
            found = f"found a picture with the name {name}, which now is one of nsdrill or a value of a model"
            warn(f"{made.origin}: {found}; allowed: another name. It is left out.", RunWarning)
        kinds.setdefault(name, made.kind)
    return kinds


def _declared_kinds() -> dict[str, Kind]:
    load_matplotlib()
    kinds: dict[str, Kind] = {}
    package = "nsdrill.figures.kinds"
    for module in sorted(module_info.name for module_info in pkgutil.iter_modules(import_module(package).__path__)):
        try:
            declared = import_module(f"{package}.{module}").KINDS
            declared = declared() if callable(declared) else declared
        except Exception as error:  # of a kind in development
            raise NsdrillError(f"figures/kinds/{module}.py: {type(error).__name__}: {error}.") from error
        for kind in declared:
            if kind.name in kinds:
                raise NsdrillError(
                    f"figures/kinds/{module}.py: found a second kind {kind.name}; allowed: another name."
                )
            kinds[kind.name] = kind
    return kinds


@dataclass(frozen=True)
class _Made:
    """A kind of a script or of another package, and where it was made."""

    kind: Kind
    origin: Origin


_made: dict[str, _Made] = {}


def register(kind: Kind, origin: Origin) -> None:
    """Make a kind of a script or of another package known to this process, in place of an
    earlier one from an earlier execution of its file. InputError where another kind has its
    name."""
    if kind.name in ("list", *_declared_kinds()):
        raise InputError(
            f"{origin}: found a picture with the name {kind.name}, which a kind of nsdrill has; allowed: another name."
        )
    if (before := _made.get(kind.name)) is not None:
        check_new_name("a picture", kind.name, before.origin, origin)
    _made[kind.name] = _Made(kind, origin)
    all_kinds.cache_clear()


def load_matplotlib() -> None:
    """Import matplotlib. NsdrillError where its own settings do not let it start. On a
    command line it logs each message once, and none about a matplotlibrc, which changes
    no picture."""
    if "matplotlib" in sys.modules:
        return
    said: set[str] = set()

    def is_news(record: logging.LogRecord) -> bool:
        text = record.getMessage()
        is_first = text not in said and "matplotlibrc" not in text
        said.add(text)
        return is_first

    if on_command_line():
        for name in ("matplotlib", "matplotlib.font_manager"):
            logging.getLogger(name).addFilter(is_news)
    try:
        import_module("matplotlib")
    except (ImportError, OSError, ValueError) as error:
        raise NsdrillError(
            f"matplotlib, which draws, cannot start: {error}. Are its settings damaged? It reads a file matplotlibrc "
            "in this folder or in its own, and the variables MATPLOTLIBRC and MPLBACKEND."
        ) from error


def kinds_of(group: str) -> dict[str, Kind]:
    """The kinds that are drawn of one of the ``GROUPS``: LINE, STUDY and so on."""
    return {name: kind for name, kind in all_kinds().items() if kind.of == group}


def kinds_for(data: object) -> tuple[str, ...]:
    """The kinds in which ``data`` can be drawn, the default first; not those that are
    panels of another one."""
    places = fitting(data, (kind for kind in all_kinds().values() if not kind.part_of))
    return tuple(sorted(places, key=lambda name: places[name]))


def words_for(kind: Kind, data: object = None) -> str:
    """What a kind shows of the ``data``, in words."""
    attrs = getattr(data, "attrs", None)
    return kind.words if attrs is None or model_in(attrs).drills else kind.general or kind.words


def listing(names: Iterable[str], data: object = None) -> str:
    """A line for each of these kinds: its name, and what it shows of the ``data``."""
    return "\n".join(f"  {name:<24} {words_for(all_kinds()[name], data)}" for name in names)


def variables_for(kind: str, model: Description) -> tuple[str, ...]:
    """The variables of a sweep of this model that a picture of this kind is drawn from;
    nothing else has to be read."""
    of_labels = (*used_by_labels(model.critical.values()), *resting(model))
    return ("status", "response", BEYOND, *of_labels, *all_kinds()[kind].uses(model))


def choose_kind(data: object, kind: str | None, panel: str | None = None) -> tuple[Kind, str | None]:
    """The kind to draw, ``kind`` or the default if it is None, and which ``panel`` of it
    alone, None for all. A panel that is declared as a kind is drawn as that one, and
    what follows its name after a blank, ``VALUE down``, is a panel of that; but without a
    ``kind`` the panels of the default come first. The InputError for a kind that does not
    fit lists those that do."""
    allowed, known = kinds_for(data), all_kinds()
    if not allowed:
        raise InputError(
            f"plot: found {describe(data)}, and no picture of it: nothing was swept, and its model declares no "
            "responses, whose shares of the samples could be drawn; allowed: data with an axis, or responses "
            "(nsdrill.model(responses=...))."
        )
    if kind is None and panel and any(panel in one for one in known[allowed[0]].panels(data)):
        return known[allowed[0]], panel
    name, _, rest = (panel or "").partition(" ")
    part = known.get(name)
    if part is not None and part.fits(data) is not None:
        is_map = kind == "map" and part.of == VALUE and is_plane(data)
        if kind in (None, part.part_of, part.name) or is_map:
            return part, rest or None
    if kind is None:
        return known[allowed[0]], panel
    if kind in known and known[kind].fits(data) is not None:
        return known[kind], panel
    if kind in kinds_of(STUDY):
        raise InputError(f"plot kind: found {kind!r} with {describe(data)}; allowed: with a study, a YAML file.")
    lines = listing(allowed, data)
    if kind in known:
        for dimension, of, argument in (
            ("start", "start of every operating point", option("start")),
            (SAMPLE, "sample of the uncertain numbers", option("at", f"{SAMPLE}=...")),
        ):
            if not isinstance(data, Results) or dimension not in data.coords:
                continue
            if known[kind].fits(_without(data, dimension)) is not None:
                raise InputError(
                    f"plot kind: found {kind!r}, which draws one {of}, with {describe(data)}; allowed "
                    f"here:\n{lines}\nor {kind!r} with {argument}, 0 to {len(data.coords[dimension]) - 1}."
                )
        advice = known[kind].advice(data)
        raise InputError(
            f"plot kind: found {kind!r}, which does not fit {describe(data)}{f' ({advice})' if advice else ''}; "
            f"allowed here:\n{lines}"
        )
    drawable = list(fitting(data, known.values()))
    close_matches = difflib.get_close_matches(kind, drawable, n=1) or [
        name for name in drawable if kind and kind in name.split("_")
    ]
    hint = f" Did you mean {close_matches[0]!r}?" if close_matches else ""
    raise InputError(f"plot kind: found {kind!r}, which is not known.{hint} Allowed for {describe(data)}:\n{lines}")


def check_options(kind: Kind, options: Iterable[str]) -> None:
    """InputError where an option was given that this kind does not take."""
    for name in options:
        if name not in kind.takes:
            kinds_that_take = ", ".join(sorted(other.name for other in all_kinds().values() if name in other.takes))
            raise InputError(
                f"{option(name)}: found with {option('kind', kind.name)}; allowed: with "
                f"{option('kind', kinds_that_take)}."
            )


def is_branches(data: object) -> bool:
    """Whether this is a Dataset of branches."""
    return "branch" in getattr(data, "dims", ())


def is_sweep(data: object) -> TypeGuard[Results]:
    """Whether these are results with one start and one sample of every operating point."""
    return isinstance(data, Results) and "start" not in data.coords and SAMPLE not in data.coords


def has_samples(data: object) -> TypeGuard[Results]:
    """Whether these are results with several samples of uncertain numbers."""
    return isinstance(data, Results) and SAMPLE in data.coords


def has_starts(data: object) -> TypeGuard[Results]:
    """Whether these are results with several starts of every operating point."""
    return isinstance(data, Results) and "start" in data.coords


def needs_samples(data: object) -> str:
    """Why pictures of samples do not fit the data."""
    if isinstance(data, Results) and SAMPLE not in data.coords:
        return "it needs samples of uncertain numbers: the section uncertain of a study"
    return ""


def fits_columns(data: object) -> TypeGuard[Results]:
    """Whether a sweep is drawn over one axis, with a column for each of the few values
    of a second one."""
    if not is_sweep(data):
        return False
    others = [len(data.coords[axis]) for axis in data.swept if axis != longest(data)]
    return not others or (len(others) == 1 and others[0] <= MAX_COLUMNS)


def is_plane(data: object) -> TypeGuard[Results]:
    """Whether a sweep is drawn over two axes, with panels for the values of a third
    one."""
    return is_sweep(data) and len(data.swept) > 1


def longest(data: Results) -> str:
    """The axis along x in pictures over one axis: the longest one, of numbers rather
    than words; of a single point the speed, or the last one that there is."""
    single = "rotary_speed" if "rotary_speed" in data.axes or not data.axes else data.axes[-1]
    return str(max(data.swept, key=lambda name: (not words_along(name), len(data.coords[name])), default=single))


def needs_one_axis(data: object) -> str:
    """Why pictures over one axis do not fit the data."""
    if not is_sweep(data) or fits_columns(data):
        return ""
    return f"it shows one axis, or two of which one has at most {MAX_COLUMNS} values: select one value of the others"


def needs_returns(data: object) -> str:
    """Why pictures of the returns to the section do not fit the data."""
    if isinstance(data, Results) and "motion" not in data.variables:
        return "no returns to the Poincare section were recorded: run with record.poincare"
    return ""


def needs_starts(data: object) -> str:
    """Why pictures of several starts do not fit the data."""
    if not isinstance(data, Results):
        return ""
    if "start" not in data.coords:
        return "it needs several starts of every operating point: initial.ensemble or initial.slice"
    return "it shows one axis: select a value of the others" if data.swept else "it needs a swept axis"


def _without(data: Results, dimension: str) -> Results:
    coords = {name: values for name, values in data.coords.items() if name != dimension}
    return Results(coords, data.variables, data.attrs, data.more)


def describe(data: object) -> str:
    if isinstance(data, Trace):
        return "a trace"
    if not isinstance(data, Results):
        return "branches" if is_branches(data) else "this file"
    axes = [f"{axis} ({len(data.coords[axis])} values)" for axis in data.swept]
    description = f"a sweep over {' and '.join(axes)}" if axes else "a single point"
    if SAMPLE in data.coords:
        return f"{description} with {len(data.coords[SAMPLE])} samples each"
    return f"{description} with {len(data.coords['start'])} starts each" if "start" in data.coords else description

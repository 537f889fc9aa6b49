"""What is drawn, of data and of studies: which data a picture needs, and the charts of a
study, which need no integration."""

from __future__ import annotations

import difflib
import os
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from importlib import import_module
from typing import TYPE_CHECKING, Any, TypeAlias, cast

import numpy as np

from nsdrill.app import datasets
from nsdrill.app.answering import answers
from nsdrill.app.check import ends_of, operation_of
from nsdrill.app.fitting.measured import Reading, read_measured
from nsdrill.data import OVERRIDES, Results, Trace, json_text, resolved_study
from nsdrill.errors import InputError, Refusal, option
from nsdrill.figures import check_suffix, cut, draw, look_of, needed, save
from nsdrill.figures.picture_kinds import STUDY, Chart, all_kinds, fitting, kinds_for, kinds_of, words_for
from nsdrill.late import deferred
from nsdrill.models import registry
from nsdrill.models.operation import Operation
from nsdrill.models.tree import with_values
from nsdrill.records import dataclass
from nsdrill.store import claim_file
from nsdrill.study.study import Study, study_from_resolved
from nsdrill.variables import dimension_of, short_key

with deferred():  # they import matplotlib
    from nsdrill.figures import measured_overlay
    from nsdrill.figures.kinds import hole, window_map

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from xarray import Dataset

    from nsdrill.analysis.advice import Advice
    from nsdrill.analysis.fitting import Measured
    from nsdrill.figures.picture_kinds import Numbers

    Drawable: TypeAlias = Dataset | Results | Trace

VALUES = 181  # along an axis
# depths of a chart without a swept depth: share of the part above the collars, factor
SHALLOWEST, DEEPEST = 0.15, 1.6
# The function of a model that makes each chart.
MAKERS = {"critical-speeds": "critical_speeds", "drive-card": "drive_card", "drive-tuning": "drive_tuning"}

Looks = Mapping[str, object]  # how a picture is to look, by the names of arguments


def claim_picture(path: str | os.PathLike[str], overwrite: bool) -> None:
    """Check, before anything is computed, that a picture may be written."""
    check_suffix(path)
    claim_file(path, overwrite)


def save_picture(figure: Figure, path: str | os.PathLike[str], overwrite: bool) -> None:
    """Write the figure, in one step."""
    claim_picture(path, overwrite)
    save(figure, path, overwrite=overwrite)


def kinds(data: Drawable | Study) -> Iterator[str]:
    """The kinds of picture of the data with their panels, or the charts of a study, in lines
    of text."""
    if isinstance(data, Study):
        charts: Any = import_module(data.model.charts) if data.model.charts else None
        own = {name: one for name, one in kinds_of(STUDY).items() if hasattr(charts, MAKERS[name])}
        yield from (f"{name:<24} {words_for(one, None)}" for name, one in own.items())
        if not own:
            yield f"None: the model {data.model.name} has no charts."
        return
    known = {name: all_kinds()[name] for name in kinds_for(data)}
    for name, one in known.items():
        yield f"{name:<24} {words_for(one, data)}"
    for name in known:
        panels = [*fitting(data, (part for part in all_kinds().values() if part.part_of == name))]
        if panels:
            yield textwrap.fill(f"{name} --panel: {', '.join(panels)}", 100, subsequent_indent="  ")


def cut_of(path: str, values: Mapping[str, float], start: int | None = None) -> Drawable:
    """What is in the file ``path``, without its numbers, at the ``values`` (SI) of some
    axes."""
    data = datasets.branches_in(path)
    return cut(datasets.outline(path) if data is None else data, values, start)


def draw_data(
    data: object,
    kind: str | None,
    *,
    values: dict[str, float],
    start: int | None,
    panel: str | None,
    over: object,
    severity: int | None,
    confidence: float | None,
    text: bool,
    rates: bool,
    states: Sequence[str] | None,
    units: str,
    looks: Looks,
    ax: Axes | None,
) -> Figure:
    """The picture ``kind`` of a Dataset or file, at the ``values`` (SI) of some axes; the
    other arguments are those of :func:`nsdrill.figures.draw`, the ``looks`` of
    :func:`nsdrill.figures.look.look_of`."""
    look = look_of(**looks)
    drawn, behind = _drawn(data, kind, values, start, panel, severity, over)
    options = {"over": behind, "states": states, "severity": severity, "confidence": confidence}
    options |= {"text": text or None, "rates": rates or None}
    with datasets.missing_variable_errors("plot"):
        return draw(drawn, kind, units=units, at=values or None, start=start, look=look, panel=panel, ax=ax, **options)


def _drawn(
    data: object,
    kind: str | None,
    values: dict[str, float],
    start: int | None,
    panel: str | None,
    severity: int | None,
    over: object,
) -> tuple[Drawable, Drawable | None]:
    """The data with what a picture is drawn of, and what is drawn behind it, or None."""
    if (branches := datasets.branches_in(data)) is not None:
        return branches, None if over is None else datasets.with_variables(
            datasets.data_in(over, None), option("over"), ("status",)
        )
    outline = datasets.outline_in(data)
    drawn: Drawable = outline
    if isinstance(outline, Results):
        drawn = _sweep_to_draw(data, outline, kind, values, start, panel, severity)
    if over is None:
        return drawn, None
    if (branches := datasets.branches_in(over)) is not None:
        return drawn, branches
    return drawn, datasets.results_in(over, option("over"), ("status", *registry.drawn_in(outline.attrs).peaks))


def _sweep_to_draw(
    data: object,
    outline: Results,
    kind: str | None,
    values: dict[str, float],
    start: int | None,
    panel: str | None,
    severity: int | None,
) -> Results:
    """The results with what a picture is drawn of."""
    if severity is None:
        found = datasets.with_variables(datasets.data_in(data, needed(outline, kind, values, start, panel)), "plot", ())
        return answers.with_lasting_motions(found) if kind == "window" else answers.with_samples_counted(found)
    if kind != "window":
        raise Refusal("severity", f"with kind={kind!r}", "with kind='window'")
    return answers.results_for_window(data, severity)


def overlaid(figure: Figure, path: str, data: Drawable, units: str, reading: Reading) -> tuple[int, Measured]:
    """Draw the measurements in the CSV file ``path`` over the ``figure`` of ``data``; how
    many are drawn, and all of them."""
    if not isinstance(data, Results) or "study_resolved" not in data.attrs:
        found = "a trace" if isinstance(data, Trace) else "branches"
        raise Refusal("data", f"with {found}", "with the results of a sweep")
    study = study_from_resolved(resolved_study(data.attrs))
    table = read_measured(path, study, reading)
    return measured_overlay.overlay(figure, data, table, units), table


@dataclass(frozen=True)
class Film:
    """A film: its file, and how many ``frames`` show how many ``seconds`` of the trace."""

    name: str
    frames: int
    seconds: float


def film(trace: object, path: str, units: str, looks: Looks, speed: float, overwrite: bool) -> Film:
    """Write the film of a trace, a Dataset or a file, to ``path``."""
    name = hole.film_name(path)
    data = cast("Trace", datasets.outline_in(trace))
    claim_file(name, overwrite)
    look = look_of(**looks)
    with datasets.missing_variable_errors("animate"):
        return Film(name, *hole.animate(data, name, units=units, look=look, speed=speed, overwrite=overwrite))


def draw_windows(
    data: Sequence[Results],
    names: Sequence[str],
    units: str,
    severity: int | None,
    confidence: float | None,
    text: bool = False,
    rates: bool = False,
    tried: Advice | None = None,
) -> Figure:
    """The picture of one window, or of two side by side; with ``text`` the answers, with
    ``rates`` lines of equal rate of penetration. Of one window the answer is that with trials,
    where it was ``tried``."""
    if len(data) == 1:
        options: dict[str, Any] = {"text": text or None, "rates": rates or None, "tried": tried}
        return draw(data[0], "window", units=units, severity=severity, confidence=confidence, **options)
    return window_map.draw_two(data[0], data[1], names, units, severity, confidence, text=text, rates=rates)


def draw_chart(
    study: Study, kind: str | None, along: str | None = None, *, units: str, looks: Looks, ax: Axes | None = None
) -> Figure:
    """The chart ``kind`` of a study as a figure. InputError where the kind is unknown,
    or the study lacks the quantities that it shows."""
    numbers = chart_of(study, kind, along)
    attrs = {
        "title": study.title,
        OVERRIDES: json_text(list(study.overrides)),
        "study_resolved": json_text(study.resolved),
    }
    operation = operation_of(study)
    axis = getattr(numbers, "axis", None)
    point = {name: value for name, value in vars(operation).items() if name != axis}
    return draw(Chart(numbers, attrs, point, ends_of(study, "rotary_speed")), units=units, look=look_of(**looks), ax=ax)


def chart_of(study: Study, kind: str | None, along: str | None = None) -> Numbers:
    """The numbers of the chart ``kind``, in SI, ``along`` an axis that the study
    sweeps; by default along the depth. InputError where the kind is unknown, or the study lacks the quantities that it
    shows."""
    name = (kind or "").replace("_", "-")  # spelled like the other kinds
    known = kinds_of(STUDY)
    if name not in known:
        near = difflib.get_close_matches(name, known, n=1)
        hint = f" Did you mean {near[0]!r}?" if near else ""
        listing = "\n".join(f"  {name:<24} {one.words}" for name, one in known.items())
        found = "a study without a kind" if kind is None else f"{kind!r} with a study"
        raise InputError(f"plot kind: found {found}.{hint} Allowed of a study, which is not run:\n{listing}")
    home = study.model.charts
    if not home:
        having = ", ".join(model for model, charts in registry.of_all(lambda model: model.charts) if charts)
        raise InputError(f"{option('kind', name)}: found a study of the model {study.model.name}; allowed: {having}.")
    charts: Any = import_module(home)
    if not hasattr(charts, MAKERS[name]):
        own = ", ".join(word for word, maker in MAKERS.items() if hasattr(charts, maker))
        raise InputError(
            f"{option('kind', name)}: found a study of the model {study.model.name}; allowed of this model: {own}."
        )
    if name in ("drive-card", "drive-tuning"):
        if along is not None:
            raise Refusal("along", f"with {option('kind', name)}, which is of one point", "with the other charts")
        modes = getattr(study.parameters, "modes", None)  # not every model has modes
        if modes is not None and modes.torsional == "frozen":
            raise InputError(f"{option('kind', name)}: found modes.torsional: frozen; allowed: a string that twists.")
        make = charts.drive_card if name == "drive-card" else charts.drive_tuning
        return make(study.parameters, operation_of(study))
    operation = operation_of(study)
    key = "depth" if along is None else _axis(study, along)
    x = _values(study, key, operation)
    points = _points(study.parameters, operation, key, x)
    try:
        return charts.critical_speeds(dimension_of(key), x, points)
    except ValueError as error:  # of a depth that does not reach below the collars
        raise InputError(f"{option('along')} {key}: {error}.") from error


def _axis(study: Study, along: str) -> str:
    """The key in the study of the axis ``along``; InputError where it is not swept."""
    keys = {dimension_of(key): key for key in (*study.swept, "depth")}
    wanted = dimension_of(short_key(along))
    if wanted not in keys:
        raise InputError(
            f"{option('along')}: found {along}, which the study does not sweep; allowed: {', '.join(keys.values())}. "
            f"Sweep it with {option('set', f'sweep.{along}={{from: ..., to: ..., points: ...}}')}."
        )
    return keys[wanted]


def _values(study: Study, key: str, operation: Operation) -> np.ndarray:
    """Values [SI] along an axis between the ends of the sweep, dense enough for a
    line."""
    if key in study.swept:
        low, high = float(study.axes[key][0]), float(study.axes[key][-1])
    else:
        collars = study.parameters.drillstring.collar.length
        low = collars + SHALLOWEST * (operation.depth - collars)
        high = DEEPEST * operation.depth
    if low == high:
        raise Refusal("along", f"one value of {key} in the sweep", "two or more")
    return np.linspace(low, high, VALUES)


def _points(parameters: object, operation: Operation, key: str, x: np.ndarray) -> Sequence[tuple[object, Operation]]:
    if key in operation.names():
        return [(parameters, replace(operation, **{key: float(value)})) for value in x]
    if key.startswith("initial."):
        raise Refusal("along", f"{key}, on which no chart depends", "a number of the string or the hole")
    return [(with_values(parameters, {key: float(value)}), operation) for value in x]

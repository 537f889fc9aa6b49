"""Operations that draw."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any

from nsdrill.errors import Refusal, RunWarning, printable
from nsdrill.late import deferred
from nsdrill.operations.arguments import (
    Along,
    AnyData,
    AnyFile,
    At,
    ATrace,
    Axes,
    BranchesOver,
    Confidence,
    Depth,
    FilmPath,
    FontSize,
    Height,
    KindOfChart,
    KindOfPicture,
    Over,
    Overwrite,
    Panel,
    Pixels,
    SettingsOfAStudy,
    Severity,
    Speed,
    SpeedOfFilm,
    Start,
    States,
    StudyLike,
    Style,
    Time,
    Title,
    Units,
    Weight,
    Width,
    XLim,
    YLim,
)

with deferred():
    from nsdrill.app import arguments, datasets
    from nsdrill.app import pictures as drawing
    from nsdrill.study import study as studies
    from nsdrill.web import explorer as pages
    from nsdrill.web import session

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from nsdrill.app.pictures import Film
    from nsdrill.web.explorer import Explorer, View


def plot(
    data: AnyData,
    kind: KindOfPicture = None,
    *,
    panel: Panel = None,
    ax: Axes = None,
    units: Units = None,
    depth: Annotated[Depth, "Cut a sweep of several axes at this depth."] = None,
    wob: Annotated[Weight, "Cut at this weight on bit."] = None,
    rotary_speed: Annotated[Speed, "Cut at this rotary speed."] = None,
    at: At = None,
    start: Start = None,
    states: States = None,
    over: Over = None,
    severity: Severity = None,
    confidence: Confidence = None,
    xlim: XLim = None,
    ylim: YLim = None,
    time: Time = None,
    width: Width = None,
    height: Height = None,
    font_size: FontSize = None,
    title: Title = None,
    style: Style = None,
) -> Figure:
    """Draw results, an unfinished run, a trace or branches, or a :func:`chart` of a study.

    A notebook shows the figure where it is the value of a cell; :func:`save` writes it to a
    file. It is not registered with pyplot.

    Returns
    -------
    matplotlib.figure.Figure
        With ``ax``, the figure of these axes.

    Raises
    ------
    InputError
        Where the kind, or an argument, does not fit the data.

    Examples
    --------
    >>> figure = nsdrill.plot("out.h5", panel="bit_speed", ylim=("0 rpm", "90 rpm"))
    >>> figure.axes[0].get_ylabel()
    'Bit speed peaks [rad/s]'
    """
    chosen = {"depth": depth, "wob": wob, "rotary_speed": rotary_speed}
    looks: dict[str, Any] = {"width": width, "height": height, "font_size": font_size, "title": title, "style": style}
    if datasets.is_study(data) or isinstance(data, studies.Study):
        given = {"panel": panel, **chosen, "at": at, "start": start, "states": states, "over": over}
        given |= {"severity": severity, "confidence": confidence, "xlim": xlim, "ylim": ylim, "time": time}
        refuse_with_a_study(given)
        return chart(data, kind, ax=ax, units=units, **looks)
    figure = drawing.draw_data(
        data,
        kind,
        values=arguments.values_in(at, None, **chosen),
        start=arguments.number_in("start", start),
        panel=panel,
        over=over,
        severity=severity,
        confidence=confidence,
        states=states,
        units=datasets.units_for(units, data),
        looks={"xlim": xlim, "time": time, "ylim": ylim, **looks},
        ax=ax,
    )
    if missing := getattr(figure, "missing", ""):
        text = f"The title has characters that no font here has: {printable(missing[:20])}. Install one that has them, "
        warnings.warn(f"{text}Noto Sans CJK say, or give another title.", RunWarning, stacklevel=3)
    return figure


def refuse_with_a_study(given: Mapping[str, object]) -> None:
    """A Refusal of an argument for which a chart has no use."""
    for name, value in given.items():
        if value not in (None, [], False):
            raise Refusal(name, "with a study", "with results", "set changes keys of the study.")


def animate(
    trace: ATrace,
    path: FilmPath,
    *,
    time: Time = None,
    speed: SpeedOfFilm = 1.0,
    units: Units = None,
    width: Width = None,
    font_size: FontSize = None,
    title: Title = None,
    style: Style = None,
    overwrite: Overwrite = False,
) -> Film:
    """Write a film of the collar in the hole, to scale, with bit and collar rotating.

    Returns
    -------
    str
        The name of the written file.

    Raises
    ------
    FileError
        Where the file exists, unless ``overwrite``.
    InputError
        Where the trace has no collar that moves in a hole, or the film would be too long.

    Examples
    --------
    >>> trace = nsdrill.simulate("study.yaml", duration="1 s")
    >>> nsdrill.animate(trace, "film.gif", time=("0.8 s", None), width="1.5 in")
    'film.gif'
    """
    if isinstance(speed, bool) or not isinstance(speed, int | float):
        raise Refusal("speed", repr(speed), "a number")
    looks = {"width": width, "font_size": font_size, "title": title, "style": style, "time": time}
    units = datasets.units_for(units, trace)
    return drawing.film(trace, arguments.name_in(path, "path"), units, looks, speed, overwrite)


def chart(
    study: StudyLike,
    kind: KindOfChart = None,
    *,
    along: Along = None,
    set: SettingsOfAStudy = None,
    ax: Axes = None,
    units: Units = None,
    width: Width = None,
    height: Height = None,
    font_size: FontSize = None,
    title: Title = None,
    style: Style = None,
) -> Figure:
    """Draw a chart of a study, without a run.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        Where the kind is not known, or the study does not have what it shows.

    Examples
    --------
    >>> figure = nsdrill.chart("study.yaml", "critical-speeds", units="field")
    >>> figure.axes[0].get_ylabel()
    'Rotary speed [rpm]'
    """
    loaded = arguments.study_in(study, set)
    looks = {"width": width, "height": height, "font_size": font_size, "title": title, "style": style}
    return drawing.draw_chart(loaded, kind, along, units=units or loaded.units, looks=looks, ax=ax)


def view(
    path: AnyFile, *, over: BranchesOver = None, set: SettingsOfAStudy = None, units: Units = None, height: Pixels = 900
) -> View:
    """Explore a file in the browser, as ``nsdrill view`` does.

    Returns
    -------
    View
        It runs until its ``close()`` or the end of this process.

    Raises
    ------
    FileError
        Where the file is none of these.

    Examples
    --------
    >>> with nsdrill.view("out.h5") as explorer:
    ...     print(explorer.url.startswith("http://127.0.0.1:"))
    True
    """
    if not arguments.is_whole(height) or not 100 <= height <= 10_000:
        raise Refusal("height", repr(height), "100 to 10000 pixels")
    return pages.View(explorer(path, over=over, set=set, units=units), height)


def explorer(
    path: object, *, over: object = None, set: object = None, units: str | None = None, port: int = 0
) -> Explorer:
    """The explorer of a file, not yet started, on this ``port`` or any that is free."""
    if units is not None:
        datasets.checked_units(units)
    if datasets.is_dataset(path):
        allowed = "the name of a file, as the explorer reads one"
        raise Refusal("path", "results in memory", allowed, 'Save them first: nsdrill.save(results, "out.h5").')
    above = None if over is None else arguments.name_in(over, "over")
    source = session.Session(arguments.name_in(path, "path"), units, arguments.texts_in(set, "set"), above)
    return pages.Explorer(source, port)

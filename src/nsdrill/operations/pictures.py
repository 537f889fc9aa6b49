"""Operations that draw."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any

from nsdrill.errors import Refusal, RunWarning, printable, warn
from nsdrill.late import deferred
from nsdrill.operations.argument import Argument, Ends, File, Number, Text, Texts, Whole, Words
from nsdrill.operations.arguments import (
    FILE,
    RESULTS,
    AnyData,
    AnyFile,
    At,
    ATrace,
    Confidence,
    Depth,
    Overwrite,
    PathLike,
    Quantity,
    Rates,
    Severity,
    Speed,
    Start,
    StudyLike,
    Units,
    Weight,
    WithText,
    changes,
)

with deferred():
    from nsdrill.app import conversion, datasets, picture_making
    from nsdrill.study import study as studies
    from nsdrill.web import explorer as pages
    from nsdrill.web import session

if TYPE_CHECKING:
    from matplotlib.axes import Axes as AxesOfMatplotlib
    from matplotlib.figure import Figure
    from xarray import Dataset

    from nsdrill.app.picture_making import Film
    from nsdrill.web.explorer import Explorer, View


def kinds() -> Iterable[str]:
    """The kinds of picture."""
    return ("list", *picture_making.all_kinds())


KindOfPicture = Annotated[
    "str | None",
    Argument(
        "The kind of picture, by default one that fits the data; the error for another one lists all that fit.",
        "str",
        "--kind",
        "KIND",
        Text(kinds),
        "What to draw; --list prints the kinds that fit FILE. Default: the first of them.",
    ),
]
KindOfChart = Annotated[
    "str | None",
    Argument(
        '``"critical-speeds"`` against depth, or ``along`` another axis; ``"drive-card"``, the share of a torsional '
        "wave that each drive reflects; "
        '``"drive-tuning"``, the decrease of friction with speed that a soft-torque drive stabilises, over its gain '
        "and frequency.",
        "str",
        "--kind",
        "KIND",
        Text(kinds),
        "What to draw; --list prints the kinds that fit FILE. Default: the first of them.",
    ),
]
Along = Annotated[
    "str | None",
    Argument(
        "The key of an axis that the study sweeps.",
        "str",
        "--along",
        "KEY",
        help="With a study and --kind critical-speeds: a swept axis to draw along.",
    ),
]
Panel = Annotated[
    "str | None",
    Argument(
        "One panel of the picture alone, by its name or a clear part of it; the error for another one lists them. "
        "A map of one value in one way has both names: ``'VALUE down'``.",
        "str",
        "--panel",
        "NAME",
        help="Draw one panel alone, by its name or a part of it: --panel radius, --panel 'VALUE down'.",
    ),
]
Axes = Annotated[
    "AxesOfMatplotlib | None",
    Argument(
        "Axes into which one panel is drawn, of a map of several ways the first; their title is unchanged.",
        "matplotlib.axes.Axes",
    ),
]
States = Annotated[
    "Sequence[str] | None",
    Argument(
        "The two states of a basin drawn from an ensemble.",
        "sequence of str",
        "--states",
        "A,B",
        Words(),
        "Two states over which to draw the basin of an ensemble, such as z,vz.",
    ),
]
XLim = Annotated[
    "tuple[Quantity, Quantity] | None",
    Argument(
        "Ends of the x axis, in SI or with units.",
        "pair of float or str",
        "--xlim",
        "Q Q",
        Ends(),
        "Ends of the x axis: --xlim 3rad/s 6rad/s.",
    ),
]
YLim = Annotated[
    "tuple[Quantity, Quantity] | None",
    Argument(
        "Ends of the y axis, in SI or with units.",
        "pair of float or str",
        "--ylim",
        "Q Q",
        Ends(),
        "Ends of the y axis: --ylim 0mm 80mm.",
    ),
]
Time = Annotated[
    "tuple[Quantity | None, Quantity | None] | None",
    Argument("The part of a trace that is drawn [s], from None: its beginning, to None: its end.", "pair"),
]
Width = Annotated[
    "Quantity | None",
    Argument("Width of the picture; 3.3in is a column of a journal. Default: 7in.", "float [m] or str", "--width", "Q"),
]
Height = Annotated[
    "Quantity | None",
    Argument("Height of the picture. Default: depends on the kind.", "float [m] or str", "--height", "Q"),
]
FontSize = Annotated[
    "float | str | None",
    Argument(
        "Size of the type in points. Default: 8.",
        "float",
        "--font-size",
        "POINTS",
        help="Size of the type. Default: 8.",
    ),
]
Title = Annotated[
    "str | bool | None",
    Argument(
        "A text in place of the usual title, or False for none.",
        "str or bool",
        "--title",
        "TEXT",
        help="Title. Default: that of the study, and the operating point.",
    ),
]
Style = Annotated[
    "PathLike | Mapping[str, object] | None",
    Argument(
        "A style file of matplotlib, one of its styles, or a mapping of its settings. Changes of matplotlib's "
        "``rcParams`` apply as well.",
        "str, Path or mapping",
        "--style",
        "FILE",
        help="Style file of matplotlib (.mplstyle), or the name of one of its styles.",
    ),
]
SPEED_OF_FILM = Argument(
    "Speed of the film, 1 for real time, 0.5 for half as fast.",
    "float",
    "--speed",
    "FACTOR",
    Number(),
    "With --animate: speed of the film, 1 for real time (default), 0.5 for half as fast.",
)
SpeedOfFilm = Annotated[float, SPEED_OF_FILM]
Pixels = Annotated[int, Argument("Pixels of the frame in a notebook.", "int", kind=Whole(100, 10_000))]
Over = Annotated[
    "Dataset | PathLike | None",
    Argument(
        "A sweep below the ``ramp`` of a trace or below branches, or branches over a map.",
        RESULTS,
        "--over",
        "FILE.h5",
        File(),
        "With branches, or with a ramp and --kind ramp: sweep whose peaks are drawn below. With a "
        "map over two axes: file of branches whose curves are drawn over it.",
    ),
]
BranchesOver = Annotated[
    "PathLike | None",
    Argument("With results: draw these branches over their peaks.", FILE, "--over", "BRANCHES.h5", File()),
]
FilmPath = Annotated[
    "PathLike",
    Argument("Ends in ``.gif`` or ``.mp4``; without ffmpeg, which MP4 requires, a GIF is written instead.", FILE),
]
SettingsOfAStudy = Annotated[
    "Mapping[str, object] | Sequence[str] | None",
    Argument(
        'With a study: keys to change, a mapping by dotted keys, or texts "key=value".',
        "mapping or sequence of str",
        "--set",
        "KEY=VALUE",
        Texts(changes),
        "With a study: change a key of it, e.g. --set 'operation.wob=30 kN'. May be given more than once.",
    ),
]


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
    text: WithText = False,
    rates: Rates = False,
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
        given |= {"severity": severity, "confidence": confidence, "text": text, "rates": rates}
        given |= {"xlim": xlim, "ylim": ylim, "time": time}
        refuse_with_a_study(given)
        return chart(data, kind, ax=ax, units=units, **looks)
    figure = picture_making.draw_data(
        data,
        kind,
        values=conversion.values_in(at, None, **chosen),
        start=start,
        panel=panel,
        over=over,
        severity=severity,
        confidence=confidence,
        text=text,
        rates=rates,
        states=states,
        units=datasets.units_for(units, data),
        looks={"xlim": xlim, "time": time, "ylim": ylim, **looks},
        ax=ax,
    )
    if missing := getattr(figure, "missing", ""):
        found = (
            f"The title has characters that no font here has: {printable(missing[:20])}. Install one that has them, "
        )
        warn(f"{found}Noto Sans CJK say, or give another title.", RunWarning)
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
    looks = {"width": width, "font_size": font_size, "title": title, "style": style, "time": time}
    units = datasets.units_for(units, trace)
    return picture_making.film(trace, conversion.name_in(path, "path"), units, looks, speed, overwrite)


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
    loaded = conversion.study_in(study, set)
    looks = {"width": width, "height": height, "font_size": font_size, "title": title, "style": style}
    return picture_making.draw_chart(loaded, kind, along, units=units or loaded.units, looks=looks, ax=ax)


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
    return pages.View(explorer(path, over=over, set=set, units=units), height)


def explorer(
    path: object, *, over: object = None, set: object = None, units: str | None = None, port: int = 0
) -> Explorer:
    """The explorer of a file, not yet started, on this ``port`` or any that is free."""
    if datasets.is_dataset(path):
        allowed = "the name of a file, as the explorer reads one"
        raise Refusal("path", "results in memory", allowed, 'Save them first: nsdrill.save(results, "out.h5").')
    from nsdrill.figures.picture_kinds import load_matplotlib

    load_matplotlib()
    above = None if over is None else conversion.name_in(over, "over")
    source = session.Session(conversion.name_in(path, "path"), units, conversion.texts_in(set, "set"), above)
    return pages.Explorer(source, port)

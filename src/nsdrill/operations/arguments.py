"""The arguments of operations: each once, for Python, the command line and the pages."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, TypeAlias

from nsdrill.errors import Refusal, option
from nsdrill.late import deferred
from nsdrill.operations.argument import Argument, Choice, File, Flag, Percent, Text, Texts, Whole
from nsdrill.operations.argument import Units as System

with deferred():
    from nsdrill import data, variables
    from nsdrill.app import conversion, datasets
    from nsdrill.models import choices, registry
    from nsdrill.study import keys, write

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from xarray import Dataset

    from nsdrill.progress import Progress
    from nsdrill.study.keys import Leaf
    from nsdrill.study.study import Study

PathLike: TypeAlias = str | os.PathLike[str]
Quantity: TypeAlias = float | str
FILE = "str or Path"
RESULTS = "Dataset, str or Path"


# --- what a shell completes


def changes() -> Iterator[str]:
    """The keys of studies with the sign that follows them, and of a choice each word."""
    for _, of_model in registry.of_all(keys.keys_of):
        yield from _assignments(of_model.leaves)


def thresholds() -> Iterator[str]:
    return (text for text in changes() if text.startswith("classify."))


def points() -> Iterator[str]:
    """The keys of axes, as :func:`changes`."""
    yield from _assignments(keys.axes_of_all())
    yield f"{keys.SAMPLE}="


def points_of(file: str) -> Iterator[str]:
    """As :func:`points`, those that a study reads, or the axes of results with their
    words; none of a trace or branches, which are of one point."""
    if datasets.is_study(file):
        study = conversion.study_in(file, None)
        read = (study.keys.leaf(leaf.key, study.resolved) for leaf in study.keys.axes.values())
        unread = getattr(study.parameters, "unread", ())
        yield from _assignments({variables.short_key(leaf.key): leaf for leaf in read if leaf.key not in unread})
    elif not datasets.is_branches(file) and isinstance(results := datasets.outline(file), data.Results):
        for key in (*keys.axes_of_all(), keys.SAMPLE):
            values = results.coords.get(variables.dimension_of(key), ())
            if len(values) > 1 and choices.words_of(key):
                yield from (f"{key}={choices.word_or_number(key, value)}" for value in values)
            elif len(values) > 1:
                yield f"{key}="


def models() -> Iterable[str]:
    registry.import_modules()
    return registry.model_names()


def examples() -> Iterable[str]:
    return write.examples()


def _assignments(of_keys: Mapping[str, Leaf]) -> Iterator[str]:
    for key, leaf in of_keys.items():
        yield f"{key}="
        yield from (f"{key}={word}" for word in leaf.choices)


# --- what is read

StudyLike = Annotated[
    "Study | PathLike | Mapping[str, object]",
    Argument(
        "The name of a YAML file; YAML text, a string with a line break or with a colon and a blank; or a "
        "mapping with the keys of a study file, nested or dotted, with values as in a file.",
        "str, Path, mapping or Study",
        "STUDY",
        kind=File(stream=True),
    ),
]
Settings = Annotated[
    "Mapping[str, object] | Sequence[str] | None",
    Argument(
        'Keys of the study to change: a mapping by dotted keys, or texts "key=value".',
        "mapping or sequence of str",
        "--set",
        "KEY=VALUE",
        Texts(changes),
        "Change a key of the study, e.g. --set 'operation.wob=30 kN'. May be given more than once.",
    ),
]
Thresholds = Annotated[
    "Mapping[str, object] | Sequence[str] | None",
    Argument(
        'Keys of ``classify`` with their new values, a mapping or texts "key=value"; without any, the '
        "thresholds of the study are restored.",
        "mapping or sequence of str",
        "--set",
        "KEY=VALUE",
        Texts(thresholds),
        "Change a threshold, e.g. --set classify.stick_slip.stick_slip_index=60. May be given more than once.",
    ),
]
ResultsLike = Annotated[
    "Dataset | PathLike",
    Argument("Results of a sweep: a Dataset, or the name of a file.", RESULTS, "RESULTS", kind=File()),
]
ManyResults = Annotated[
    "Sequence[Dataset | PathLike]",
    Argument("Two or more.", f"sequence of {RESULTS}", "RESULTS", kind=File(several=True)),
]
Other = Annotated[
    "Dataset | PathLike | None",
    Argument("Results over the same axes, whose window is compared with the first.", RESULTS, "[OTHER]", kind=File()),
]
AnyData = Annotated[
    "Dataset | PathLike", Argument("Results, an unfinished run, branches or a trace.", RESULTS, "FILE", kind=File())
]
CitedData = Annotated[
    "Dataset | PathLike | None",
    Argument("Results, an unfinished run, branches or a trace that are to be cited.", RESULTS, "[FILE]", kind=File()),
]
ATrace = Annotated[
    "Dataset | PathLike", Argument("Of :func:`simulate` or :func:`replay`.", RESULTS, "FILE", kind=File())
]
One = Annotated["Dataset | PathLike", Argument("What is compared.", RESULTS, "A", kind=File())]
Two = Annotated["Dataset | PathLike", Argument("What it is compared with.", RESULTS, "B", kind=File())]
A_FILE = Argument("The name of a file.", FILE, "FILE", kind=File())
AnyFile = Annotated["PathLike", A_FILE]
NameOfFile = Annotated[str, A_FILE]
Seeds = Annotated[
    "Dataset | PathLike | None",
    Argument(
        "Follow the settled points of these results instead of continue.seeds.", RESULTS, "--seeds", "OUT.h5", File()
    ),
]
Orbit = Annotated[
    "PathLike | None",
    Argument(
        "A file of branches: the trace is the motion at its ``point`` over one period, stable or not; the study "
        "is that of the branches.",
        FILE,
        "--orbit",
        "BRANCHES.h5",
        File(),
        "Run one motion of this file of branches, stable or not, over one period.",
    ),
]
PointOfOrbit = Annotated[
    "int | None",
    Argument(
        "The number of a point of ``orbit``, from 0.",
        "int",
        "--point",
        "N",
        Whole(),
        "With --orbit: number of the point, as nsdrill show prints it.",
    ),
]
Overlay = Annotated[
    "str | None",
    Argument(
        "CSV of measurements to draw over a picture along one axis or over a map; nsdrill fit reads the same.",
        option="--data",
        metavar="FIELD.csv",
        kind=File(),
    ),
]

# --- what is written

ResultsPath = Annotated[
    "PathLike | None",
    Argument(
        "The results file to write.",
        FILE,
        "-o --output",
        "FILE",
        File(writes=True, hdf5=True),
        "Results file to write (HDF5). While the run goes on, its points are in FILE.part.",
    ),
]
BranchesPath = Annotated[
    "PathLike | None",
    Argument(
        "The file of branches to write.",
        FILE,
        "-o --output",
        "FILE",
        File(writes=True, hdf5=True),
        "File of branches to write (HDF5). Until it is there, what is finished is in FILE.part.",
    ),
]
HDF5Path = Annotated[
    "PathLike | None", Argument("Results file to write.", FILE, "-o --output", "FILE", File(writes=True, hdf5=True))
]
TracePath = Annotated[
    str,
    Argument("Trace file to write (HDF5).", option="-o --output", metavar="FILE", kind=File(writes=True, hdf5=True)),
]
OUTPUT = Argument("", option="-o --output", metavar="FILE", kind=File(writes=True))
Stream = Annotated[
    "str | None", Argument("", option="-o --output", metavar="FILE", kind=File(writes=True, stream=True))
]
Picture = Annotated["str | None", Argument("", option="--picture", metavar="FILE", kind=File(writes=True))]
SavePath = Annotated[
    "PathLike",
    Argument(
        "HDF5 (``.h5``), netCDF (``.nc``) or a table (``.csv``, one row for each point or sample, with units in the "
        "headings); of a figure ``.png``, ``.pdf`` or ``.svg``.",
        FILE,
    ),
]
Saved = Annotated["Dataset | Figure", Argument("What is written.", "Dataset or matplotlib.figure.Figure")]
Overwrite = Annotated[
    bool,
    Argument(
        "An existing file may be replaced.", "bool", "--overwrite", kind=Flag(), help="Replace the output if it exists."
    ),
]
Resume = Annotated[
    bool,
    Argument(
        "Go on with an interrupted run of the same study.",
        "bool",
        "--resume",
        kind=Flag(),
        help="Continue an interrupted run: only missing points are run.",
    ),
]

# --- the point

At = Annotated[
    "Mapping[str, Quantity] | Sequence[tuple[str, str]] | None",
    Argument(
        "Values of any axes by their keys, as ``{'bit.rock_stiffness': '25 MN/m'}``, or ``{'sample': 17}`` where "
        "numbers are uncertain.",
        "mapping",
        "--at",
        "KEY=VALUE",
        Texts(points, points_of, pairs=True),
        "Value of any axis by its key, e.g. --at 'bit.rock_stiffness=25 MN/m', or --at sample=17 "
        "with uncertain numbers. May be given more than once.",
    ),
]
Depth = Annotated["Quantity | None", Argument("Depth.", "float [m] or str", "--depth", "Q")]
Weight = Annotated["Quantity | None", Argument("Weight on bit.", "float [N] or str", "--wob", "Q")]
Speed = Annotated["Quantity | None", Argument("Rotary speed.", "float [rad/s] or str", "--rotary-speed", "Q")]
Start = Annotated[
    "int | None",
    Argument("Number of the start, from 0, if operating points have several.", "int", "--start", "K", Whole()),
]
Procedure = Annotated[
    "str | None",
    Argument(
        "Sweep of the point; needed if the file has up and down.",
        '{"same", "up", "down"}',
        "--procedure",
        kind=Choice(("same", "up", "down")),
    ),
]
Duration = Annotated[
    "Quantity | None",
    Argument(
        "Simulated time. Default: the study's transient and observed time; with a ramp, its last knot.",
        "float [s] or str",
        "--duration",
        "Q",
    ),
]
Sample = Annotated[
    "Quantity | None", Argument("Interval between samples. Default: 10 ms.", "float [s] or str", "--sample", "Q")
]
GRADES = Whole(0, 4)
Severity = Annotated[
    "int | None",
    Argument(
        "0 to 4: a run is safe if none of its severities exceeds this one and the bit is not stalled; by default, if "
        "no response is critical.",
        "int",
        "--severity",
        "N",
        GRADES,
        "Call a run safe if no severity exceeds N and the bit is not stalled. Default: if no response is critical.",
    ),
]
Confidence = Annotated[
    "float | None",
    Argument(
        "0.01 to 0.9999: with uncertain numbers, the least probability of a safe run at a safe point (0.9).",
        "float",
        "--confidence",
        "PERCENT",
        Percent(1.0, 99.99),
        "With uncertain numbers: least probability of a safe run at a safe point. Default: 90.",
    ),
]
Within = Annotated[
    "Mapping[str, Sequence[Quantity]] | Sequence[tuple[str, str]] | None",
    Argument(
        "Between which weights or speeds one drills, as ``{'rotary_speed': ('100 rpm', '180 rpm')}``: other points "
        "are run-up only, and never allowed.",
        "mapping",
        "--within",
        "KEY=FROM..TO",
        Texts(pairs=True),
        "Where one drills, e.g. --within rotary_speed=100rpm..180rpm: other points are run-up only, and never "
        "allowed. Also for wob.",
    ),
]

WithText = Annotated[
    bool,
    Argument(
        "Write the answer and its warnings into the picture of a window.",
        "bool",
        "--text",
        kind=Flag(),
        help="In the picture of a window: the answer and its warnings as well.",
    ),
]
Rates = Annotated[
    bool,
    Argument(
        "Draw lines of equal rate of penetration over a window.",
        "bool",
        "--rates",
        kind=Flag(),
        help="In the picture of a window: lines of equal rate of penetration as well.",
    ),
]

# --- how it is run

Workers = Annotated[
    "int | None", Argument("Number of parallel workers. Default: all processors.", "int", "-j --workers", "N", Whole(1))
]
Engine = Annotated[
    str,
    Argument(
        "Threads of this process, or workers of a Dask cluster. The numbers are the same.",
        '{"threads", "dask"}',
        "--engine",
        kind=Choice(("threads", "dask")),
    ),
]
Scheduler = Annotated[
    "str | None",
    Argument(
        "With Dask: address of a running scheduler, tcp://host:8786. Default: a cluster on this machine.",
        "str",
        "--scheduler",
        "ADDR",
        help="With --engine dask: address of a running scheduler, tcp://host:8786. Default: a cluster on this machine.",
    ),
]
DEVICES = ("cpu", "gpu", "auto")
Device = Annotated[
    str,
    Argument(
        "The processor, a GPU of NVIDIA, or whichever suits the number of chains. The numbers are the same.",
        '{"cpu", "gpu", "auto"}',
        "--device",
        kind=Choice(DEVICES),
        help="The processor (cpu), a GPU of NVIDIA (gpu), or whichever suits the number of chains (auto). The "
        "numbers are the same.",
    ),
]
RetryFailed = Annotated[
    bool,
    Argument(
        "Run failed points again, too.",
        "bool",
        "--retry-failed",
        kind=Flag(),
        help="Like --resume, and run failed points again, in a carried sweep with those that follow "
        "them. simulation.max_steps may be larger than before.",
    ),
]
Large = Annotated[
    bool,
    Argument(
        "More than a million runs are meant.",
        "bool",
        "--large",
        kind=Flag(),
        help="Allow more than a million runs, which are refused with their cost otherwise.",
    ),
]
Reported = Annotated[
    "bool | Callable[[Progress], object]",
    Argument(
        "True for a bar on stderr in terminals and notebooks, or a line every 10 s elsewhere; False for none; or a "
        "function that is called with a :class:`Progress` a few times a second. An exception from it ends the run, "
        "which can be resumed.",
        "bool or callable",
        "-q --quiet",
        kind=Flag(off=True),
        help="No progress and no summary; warnings and errors only.",
    ),
]
Lines = Annotated[
    "bool | Callable[[str], object]",
    Argument(
        "True for lines on stderr, or a function that is called with each of them.",
        "bool or callable",
        "-q --quiet",
        kind=Flag(off=True),
        help="No progress and no summary; warnings and errors only.",
    ),
]


# --- units

Units = Annotated[
    "str | None",
    Argument(
        "m, kN and rad/s, or ft, klbf and rpm; by default those of the study.",
        '{"si", "field"}',
        "--units",
        kind=System(),
        help="Units of the answer: m, kN, rad/s (si) or ft, klbf, rpm (field). Default: NSDRILL_UNITS, else the key "
        "units of the study, else si.",
    ),
]
UnitsOfTable = Annotated[
    str,
    Argument(
        "Units of the answer: m, kN, rad/s (si) or ft, klbf, rpm (field). Default: NSDRILL_UNITS, else si.",
        option="--units",
        kind=System(),
    ),
]
Begin = Annotated["str | None", Argument("With a trace: first time to draw.", option="--from", metavar="Q")]
End = Annotated["str | None", Argument("With a trace: last time to draw.", option="--to", metavar="Q")]
NoTitle = Annotated[
    bool,
    Argument(
        "No title: for a picture with a caption. Headings that tell panels apart, and notes, stay.",
        option="--no-title",
        kind=Flag(),
    ),
]

# --- tables of measurements

Rename = Annotated[
    "Mapping[str, str] | None",
    Argument(
        "The names of nsdrill by heads of the file.",
        "mapping",
        "--rename",
        "HEAD=NAME",
        Texts(pairs=True),
        "Name of a column: HEAD in the file is NAME of nsdrill.",
    ),
]
Ignore = Annotated[
    "Sequence[str]",
    Argument(
        'Heads to pass over; ``"*"`` for all that are not known.',
        "sequence of str",
        "--ignore",
        "HEAD",
        Texts(),
        "Ignore this column; '*' ignores all unknown ones.",
    ),
]
UnitOf = Annotated[
    "Mapping[str, str] | None",
    Argument(
        "Units by heads of the file, in place of those there.",
        "mapping",
        "--unit",
        "HEAD=UNIT",
        Texts(pairs=True),
        "Unit of a column, as --unit 'Time=s', where the file has none or another one.",
    ),
]
TimesOf = Annotated[
    "Sequence[str]",
    Argument(
        "Heads of the time of a log: one, or that of the date and that of the time of day. Default: what looks like "
        "it.",
        "sequence of str",
        "--time",
        "HEAD",
        Texts(),
        "Column of the time of a log; twice for a date and a time of day. Default: what looks like it.",
    ),
]
ColumnsOf = Annotated[
    "Sequence[str] | str",
    Argument(
        'Names with units of all columns of a file without heads, ``"-"`` for one that is not used.',
        "sequence of str or str",
        "--columns",
        "'NAME [UNIT], -, ...'",
        help="Names with units of all columns of a file without heads, with commas between them, - for one that is not "
        "used.",
    ),
]
Shortest = Annotated[
    "Quantity",
    Argument(
        "Over time: shortest stretch of constant settings that counts. Default: 120 s.",
        "float [s] or str",
        "--shortest",
        "Q",
    ),
]
Settle = Annotated[
    "Quantity",
    Argument("Over time: unused beginning of each stretch. Default: 60 s.", "float [s] or str", "--settle", "Q"),
]
SkipGaps = Annotated[
    bool,
    Argument(
        "Leave out rows with gaps. Otherwise a gap ends a stretch of a log, and is refused in a table over operating "
        "points.",
        "bool",
        "--skip-gaps",
        kind=Flag(),
    ),
]
Only = Annotated[
    "Mapping[str, str] | None",
    Argument(
        'What the rows that are used have, by heads of the file, as ``{"well": "B"}``.',
        "mapping",
        "--only",
        "HEAD=VALUE",
        Texts(pairs=True),
        "Use only the rows with VALUE in a column, as --only 'well=B'.",
    ),
]
LogToFollow = Annotated[
    "PathLike | None",
    Argument(
        "A log whose depth, weight and speed the run follows, over its longest part without an interruption.",
        FILE,
        "--data",
        "LOG.csv",
        File(),
        "Log whose depth, weight and speed the run follows, over its longest part without an interruption.",
    ),
]


def refuse_without(needed: str, value: object, given: Mapping[str, object]) -> None:
    """A Refusal of arguments that mean something only beside the one that is ``needed``, where
    that has no ``value``."""
    for name, one in given.items():
        if value is None and one:
            raise Refusal(name, f"without {option(needed)}", "with it")


def texts_of(given: Sequence[str] | str) -> tuple[str, ...]:
    """Texts, of which one may be given by itself."""
    return (given,) if isinstance(given, str) else tuple(given)


# --- answers

Everything = Annotated[
    bool,
    Argument(
        "Every row of a long table, every special point of branches.",
        "bool",
        "--all",
        kind=Flag(),
        help="Print every row of a long table, every special point of branches.",
    ),
]
Tried = Annotated[
    bool,
    Argument(
        "Run trials of the answer: the ways in and disturbances at its setting, and where no setting has room, single "
        "changes of the string that may help. They confirm or withdraw the answer.",
        "bool",
        "--trials",
        kind=Flag(),
        help="Run trials of the answer, which confirm or withdraw it; where no setting has room, of changes that may "
        "help. They take seconds to minutes.",
    ),
]
Json = Annotated[bool, Argument("Print JSON.", option="--json", kind=Flag())]
Model = Annotated[
    "str | None",
    Argument("Model of the string. Default: christoforou_yigit.", option="--model", metavar="NAME", kind=Text(models)),
]
Switch = Annotated[bool, Argument("", kind=Flag())]

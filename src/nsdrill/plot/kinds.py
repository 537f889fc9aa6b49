"""What can be drawn of which data, and the words for saying so. No matplotlib here: asking is cheap."""

from __future__ import annotations

import difflib
import os

from nsdrill.data import Results, Trace, frozen_modes
from nsdrill.errors import InputError
from nsdrill.models.description import Description
from nsdrill.models.registry import drawn_in
from nsdrill.models.vocabulary import BY_NAME
from nsdrill.plot.schedule import moving
from nsdrill.variables import POINT, SAMPLE, TRUST

FEW = 3  # so many values of a second axis stand side by side as columns of one figure
MAX_PANELS = 12
RATE = "rate_of_penetration"  # of which lines are drawn over maps and window

SWEEP_KINDS = {
    "bifurcation": "peaks of the three motions along one axis, coloured by response, hysteresis shaded",
    "summary": "stick-slip index, lift-off, wall contact and whirl ratio along one axis",
}
SECTION_KINDS = {
    "poincare": "every return to the Poincare section along one axis, coloured by the kind of motion",
    "motion": "the kind of motion: along one axis with Lyapunov exponent, 0-1 test and period, or over two axes",
}
POINT_KINDS = {"section": "the Poincare section of one operating point: orbit, axial and torsional plane"}
MAP_KINDS = {
    "map": "the responses over two axes",
    "whirl_kind": "the kind of whirl over two axes",
    "motion": SECTION_KINDS["motion"],
    "window": "where all procedures are safe, where only some, and the recommended operating point",
}
START_KINDS = {
    "shares": "shares of the starts by response and attractor along one axis, with 95 % intervals",
    "attractors": "radius, axial range and stick-slip index of each attractor along one axis, size by share",
    "basin": "which start goes to which attractor, over two states; of one operating point",
}
SAMPLE_KINDS = {
    "probability": "how probable a safe run and each response are: maps over two axes, with bands along one",
    "trade-off": "rate of penetration against the probability of a safe run, point by point",
    "tornado": "which uncertain number moves the safe run, stick-slip, lift-off and contact how far",
}
ALIASES = {"lift_off": "lift_off_fraction", "wall_contact": "wall_contact_fraction", "radius": "radius_max"}
TRACE_KINDS = {
    "trace": "one page with everything: histories, orbit in the hole, phase planes",
    "histories": "the three motions and the contact forces against time",
    "orbit": "path of the collar centre in the hole",
    "phase": "phase planes of the axial, torsional and lateral motion",
    "section": "the Poincare section: the motion once in every revolution of the bit",
}
RAMP_KINDS = {
    "ramp": "peaks of the three motions against the value that was moved: a bifurcation diagram made by a real ramp"
}
CHART_KINDS = {
    "critical-speeds": "lateral, torsional and axial critical speeds against depth, or along another axis",
    "buckling": "loads at which collars and pipe buckle against the inclination of the hole, or along an axis",
    "drive-card": "how much of a torsional wave each drive throws back, and the slope of friction that it holds",
    "drive-tuning": "the slope of friction that a soft-torque drive holds, over its gain and its frequency",
}
_VALUES = {name: v.long_name for name, v in BY_NAME.items() if v.dtype == "f8" and v.dims == POINT}
_VALUES |= {alias: _VALUES[name] for alias, name in ALIASES.items()}

DESCRIPTIONS = {
    **SWEEP_KINDS, **SECTION_KINDS, **POINT_KINDS, **MAP_KINDS, **START_KINDS, **SAMPLE_KINDS, **TRACE_KINDS,
    **RAMP_KINDS, **CHART_KINDS,
    **{k: f"{words}: one value" for k, words in _VALUES.items()},
}  # fmt: skip


def is_study(path: object) -> bool:
    """Whether this is the name of a study file, of which charts are drawn, rather than one of results."""
    return isinstance(path, str | os.PathLike) and str(os.fspath(path)).lower().endswith((".yaml", ".yml"))


def value_name(kind: str) -> str | None:
    """The variable that a value kind shows, None for the other kinds."""
    name = ALIASES.get(kind, kind)
    return name if name in _VALUES else None


def variables_for(kind: str, model: Description) -> tuple[str, ...]:
    """The variables of a sweep of this model that a picture of this kind is drawn from; nothing else has to be read."""
    drawn, section = model.drawn, tuple(variable.name for variable in model.section)
    shown = {
        "bifurcation": (*drawn.peaks, *(panel.greatest for panel in drawn.panels)),
        "summary": drawn.summary,
        "map": (RATE,),
        "window": (RATE,),
        "whirl_kind": ("whirl_kind",),
        "poincare": ("motion", *section),
        "motion": ("motion", "period", "zero_one", "lyapunov_exponent", "lyapunov_error"),
        "section": ("motion", "period", *section),
        "shares": ("attractor", "whirl_kind", "settled"),
        "attractors": (
            "attractor",
            "whirl_kind",
            "settled",
            *(name for one in drawn.attractors for name in one[:2] if name),
        ),
        "tornado": model.check_features,
        "trade-off": (RATE, "mechanical_specific_energy"),
        "basin": ("attractor", "whirl_kind", "settled", "initial_state"),
    }.get(kind, (name,) if (name := value_name(kind)) else ())
    return ("status", "response", *TRUST, *shown)


def kinds_for(data: Results | Trace) -> tuple[str, ...]:
    """The kinds in which ``data`` can be drawn, the default first."""
    if isinstance(data, Trace):
        kinds = tuple(kind for kind in TRACE_KINDS if kind != "orbit" or has_orbit(data))
        return (*kinds, *(RAMP_KINDS if moving(data) else ()))
    if "start" in data.coords:
        return _start_kinds(data)
    if SAMPLE in data.coords:
        return _sample_kinds(data)
    drawn = drawn_in(data.attrs)
    first = ("stick_slip_index", *ALIASES, "whirl_ratio")  # the named ones before the rest
    values = tuple(dict.fromkeys((*first, *(name for name in _VALUES if name in data.variables))))
    values = tuple(kind for kind in values if ALIASES.get(kind, kind) in data.variables)
    lengths = sorted(len(data.coords[axis]) for axis in data.swept)
    lines = tuple(kind for kind in SWEEP_KINDS if kind != "bifurcation" or drawn.peaks[0] in data.variables)
    returns = tuple(SECTION_KINDS) if "motion" in data.variables else ()
    if not lengths:
        return (*(POINT_KINDS if returns else ()), *lines, *returns, *values)
    if len(lengths) == 1:
        return (*lines, *returns, "window", *values)
    maps = tuple(kind for kind in MAP_KINDS if kind in ("map", "window") or kind in data.variables)
    if len(lengths) == 3:
        return (*maps, *values)
    if lengths[0] <= FEW:  # a handful of values is a comparison, not a plane
        return (*lines, *dict.fromkeys((*returns, *maps)), *values)
    return (*maps, *values)


def has_orbit(trace: Trace) -> bool:
    """Whether the collar centre of the trace has a path in the hole."""
    return {"x", "y"} <= trace.variables.keys() and "lateral" not in frozen_modes(trace.attrs)


def fits_columns(data: Results) -> bool:
    """Whether a sweep is drawn over one axis, with a column for each of the few values of a second one."""
    lengths = sorted(len(data.coords[axis]) for axis in data.swept)
    return len(lengths) < 2 or (len(lengths) == 2 and lengths[0] <= FEW)


def _start_kinds(data: Results) -> tuple[str, ...]:
    """Of operating points with several starts; along axes there is no line to draw but one start's own. Over two axes
    only the window sums the starts up."""
    if len(data.swept) != 1:
        return ("window", "basin") if data.swept else ("basin",)
    return (*(START_KINDS if not data.slice else ("basin", "shares", "attractors")), "window")


def _sample_kinds(data: Results) -> tuple[str, ...]:
    """Of operating points with several samples; one sample has a picture of its own."""
    swept = len(data.swept)
    return (
        *(["probability"] if swept < 3 else []),
        *(["window"] if 0 < swept < 4 else []),
        *(["trade-off"] if swept and RATE in data.variables else []),
        "tornado",
    )


def choose_kind(data: Results | Trace, kind: str | None) -> str:
    """The kind to draw: the one asked for, the default if none was; an error that lists the choices otherwise."""
    allowed = kinds_for(data)
    if kind in CHART_KINDS:
        raise InputError(f"plot kind: found {kind!r} with {_what(data)}; allowed: with a study, a YAML file.")
    if kind is None:
        return allowed[0]
    if kind in allowed:
        return kind
    listing = "\n".join(f"  {name:<24} {DESCRIPTIONS[name]}" for name in allowed)
    of_one_start = kind in DESCRIPTIONS and kind not in (*START_KINDS, "window")
    if isinstance(data, Results) and "start" in data.coords and of_one_start:
        raise InputError(
            f"plot kind: found {kind!r}, which draws one start of every operating point, with {_what(data)}; allowed "
            f"here:\n{listing}\nor {kind!r} with --start, 0 to {len(data.coords['start']) - 1}."
        )
    if isinstance(data, Results) and SAMPLE in data.coords and kind in DESCRIPTIONS and kind not in SAMPLE_KINDS:
        raise InputError(
            f"plot kind: found {kind!r}, which draws one sample of the uncertain numbers, with {_what(data)}; allowed "
            f"here:\n{listing}\nor {kind!r} with --at {SAMPLE}=..., 0 to {len(data.coords[SAMPLE]) - 1}."
        )
    if kind in DESCRIPTIONS:
        raise InputError(
            f"plot kind: found {kind!r}, which does not fit {_what(data)}{_advice(data, kind)}; "
            f"allowed here:\n{listing}"
        )
    near = difflib.get_close_matches(kind, allowed, n=1)
    hint = f" Did you mean {near[0]!r}?" if near else ""
    raise InputError(f"plot kind: found {kind!r}, which is not known.{hint} Allowed for {_what(data)}:\n{listing}")


def _what(data: Results | Trace) -> str:
    if isinstance(data, Trace):
        return "a trace"
    axes = [f"{axis} ({len(data.coords[axis])} values)" for axis in data.swept]
    what = f"a sweep over {' and '.join(axes)}" if axes else "a single point"
    if SAMPLE in data.coords:
        return f"{what} with {len(data.coords[SAMPLE])} samples each"
    return f"{what} with {len(data.coords['start'])} starts each" if "start" in data.coords else what


def _advice(data: Results | Trace, kind: str) -> str:
    if kind in POINT_KINDS and isinstance(data, Results) and "motion" in data.variables:
        return " (it shows one operating point: select a value of every axis)"
    if kind in (*SECTION_KINDS, *POINT_KINDS) and isinstance(data, Results) and "motion" not in data.variables:
        return " (no returns to the Poincare section were recorded: run with record.poincare)"
    if kind in START_KINDS and isinstance(data, Results):
        if "start" not in data.coords:
            return " (it needs several starts of every operating point: initial.ensemble or initial.slice)"
        return " (it shows one axis: select a value of the others)" if data.swept else " (it needs a swept axis)"
    if kind == "bifurcation" and isinstance(data, Results) and drawn_in(data.attrs).peaks[0] not in data.variables:
        return " (no peaks were recorded: run with record.peaks)"
    if kind in ("lyapunov_exponent", "lyapunov_error") and isinstance(data, Results):
        return " (it was not measured: run with record.exponent: true)"
    if kind == "zero_one" and isinstance(data, Results):
        return " (no returns to the Poincare section were recorded: run with record.poincare)"
    if kind in SWEEP_KINDS and isinstance(data, Results):
        return f" (it shows one axis, or two of which one has at most {FEW} values: select one value of the others)"
    if kind in RAMP_KINDS and isinstance(data, Trace):
        return " at one operating point (it shows a run along a ramp)"
    if kind == "orbit" and "lateral" in frozen_modes(data.attrs):
        return " of a string whose lateral motion is frozen (it shows the collar centre, which stays in the middle)"
    return ""

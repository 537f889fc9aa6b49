"""What a critical response is, and those of a drill string, each declared once: from
which feature and threshold it follows, how bad it is, and the words and signs for it. A
model names those that it can show, or declares its own.

A bit that stays stuck is *stalled*. Such a run is critical, and it has no other
response: what the bit and the collar do beside that is in the features alone.
"""

from __future__ import annotations

import keyword
import math
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import asdict, field, fields, make_dataclass, replace
from string import ascii_uppercase
from typing import Any

import numpy as np

from nsdrill.data import Array
from nsdrill.observe.thresholds import Attractors, MotionThresholds, Settled, Trust
from nsdrill.ranges import Checked, parameter, section
from nsdrill.records import dataclass
from nsdrill.units import plain_units
from nsdrill.variables import CHECKS, OK, Variable, flag


@dataclass(frozen=True)
class BitBounce(Checked):
    """Bit-bounce: the bit is off the rock for more than ``lift_off_fraction`` of the
    time.

    The other bounds grade it by the same fraction f. While in contact the bit bears on
    average 1/(1 - f) times the weight on bit, as the two balance over a long time: 1.1
    times at the second bound, 1.4 and 2.5 times at the last two.
    """

    lift_off_fraction: float = parameter(
        0.01,
        "",
        "R: one percent of the time",
        "convention",
        high=1.0,
        meaning="Bit-bounce above this fraction of time off the rock",
    )
    light_fraction: float = parameter(
        0.01,
        "",
        "R: as the response",
        "convention",
        high=1.0,
        meaning="Severity light above this fraction of time off the rock",
    )
    moderate_fraction: float = parameter(0.1, "", "R", "convention", high=1.0, meaning="Severity moderate above this")
    strong_fraction: float = parameter(0.3, "", "R", "convention", high=1.0, meaning="Severity strong above this")
    severe_fraction: float = parameter(0.6, "", "R", "convention", high=1.0, meaning="Severity severe above this")


@dataclass(frozen=True)
class StickSlip(Checked):
    """Stick-slip: the index (max - min) / (2 mean) exceeds ``stick_slip_index``
    percent, the onset of full stall.

    The other bounds are those of the severity table of the directional-drilling paper
    (D): below the first negligible vibration, then torsional oscillation, then medium
    (mitigate), onset of full stall, severe.
    """

    stick_slip_index: float = parameter(
        80.0,
        "percent",
        "D: onset of full stall",
        "convention",
        low=0.01,
        high=1e5,
        meaning="Stick-slip above this index, (max - min) / (2 mean) of the bit speed",
    )
    oscillation_index: float = parameter(
        40.0, "percent", "D", "convention", low=0.01, high=1e5, meaning="Severity torsional oscillation above this"
    )
    medium_index: float = parameter(
        60.0, "percent", "D", "convention", low=0.01, high=1e5, meaning="Severity medium above this"
    )
    stall_index: float = parameter(
        80.0, "percent", "D", "convention", low=0.01, high=1e5, meaning="Severity onset of full stall above this"
    )
    severe_index: float = parameter(
        100.0, "percent", "D", "convention", low=0.01, high=1e5, meaning="Severity severe above this"
    )


@dataclass(frozen=True)
class Whirl(Checked):
    """Whirl: the collar is on the wall for more than ``wall_contact_fraction`` of the
    time, and does not merely lie on the low side.

    Its kind: backward rolling where the rolling ratio is within ``rolling_tolerance``
    of one and the contact lasts at least ``rolling_contact`` of the time; else forward
    or backward by the sign of the whirl ratio, and irregular where that is below
    ``direction`` in size. Of these a collar lies on the low side that is on average in the lower half of an
    inclined hole, with a lateral acceleration up to ``light_acceleration``: there its weight
    holds it, and that is no whirl. One that is on the wall for less than ``rolling_contact``
    of the time taps it, half of its mean radius below the middle or more. One that strikes
    the wall harder is irregular.

    The accelerations [m/s^2] grade it by the r.m.s. lateral acceleration of the collar,
    on the wall or not, which is what a downhole tool measures: about a quarter, a half,
    three quarters and one standard gravity. Each manufacturer of tools has its own
    table; these four are a convention to be adapted.
    """

    wall_contact_fraction: float = parameter(
        0.01,
        "",
        "R: one percent of the time",
        "convention",
        high=1.0,
        meaning="Whirl above this fraction of time on the wall",
    )
    rolling_tolerance: float = parameter(
        0.1,
        "",
        "R",
        "convention",
        high=100.0,
        meaning="Backward rolling within this distance of a rolling ratio of one",
    )
    rolling_contact: float = parameter(
        0.5, "", "R", "convention", high=1.0, meaning="Least fraction of time on the wall for backward rolling"
    )
    direction: float = parameter(
        0.1, "", "R", "convention", high=1000.0, meaning="Irregular below this size of the whirl ratio"
    )
    light_acceleration: float = parameter(
        2.5,
        "m/s^2",
        "R: a quarter of g",
        "convention",
        high=1e5,
        meaning="Severity light above this r.m.s. lateral acceleration",
    )
    moderate_acceleration: float = parameter(
        5.0, "m/s^2", "R: half of g", "convention", high=1e5, meaning="Severity moderate above this"
    )
    strong_acceleration: float = parameter(
        7.5, "m/s^2", "R: three quarters of g", "convention", high=1e5, meaning="Severity strong above this"
    )
    severe_acceleration: float = parameter(
        10.0, "m/s^2", "R: g", "convention", high=1e5, meaning="Severity severe above this"
    )


@dataclass(frozen=True)
class Stalled(Checked):
    """Stalled: the bit is stuck for more than ``stuck_fraction`` of the time. A run in
    which the mean bit speed is zero, or the bit never turns faster than a tenth of
    ``stuck_below``, is stalled, too."""

    stuck_fraction: float = parameter(
        0.99,
        "",
        "R: all but one percent of the time",
        "convention",
        high=0.9999,
        meaning="Stalled above this fraction of time with the bit stuck",
    )


@dataclass(frozen=True)
class Thresholds(Checked):
    """All thresholds; ``stuck_below`` [rad/s] is the bit speed under which the bit
    counts as stuck."""

    bit_bounce: BitBounce = section(BitBounce, "Bit-bounce; the bounds of its severity must ascend")
    stick_slip: StickSlip = section(StickSlip, "Stick-slip; the bounds of its severity must ascend")
    whirl: Whirl = section(Whirl, "Whirl; the bounds of its severity must ascend")
    stalled: Stalled = section(Stalled, "Stalled: the bit stays stuck, and no other response counts")
    settled: Settled = section(Settled, "Settled motion")
    trust: Trust = section(Trust, "Trust, where points were checked")
    motion: MotionThresholds = section(MotionThresholds, "Kind of motion, from the returns to the Poincare section")
    attractors: Attractors = section(Attractors, "Attractors, where every operating point has several starts")
    stuck_below: float = parameter(
        5 * math.pi / 30,
        "rad/s",
        "field practice: bit-stuck time below 5 rpm",
        "high",
        low=1e-6,
        high=1e3,
        meaning="Bit speed at or below which the bit is stuck",
    )


@dataclass(frozen=True)
class General(Checked):
    """The thresholds of a model that shows none of the critical responses of a drill
    string."""

    settled: Settled = section(Settled, "Settled motion")
    trust: Trust = section(Trust, "Trust, where points were checked")
    motion: MotionThresholds = section(MotionThresholds, "Kind of motion, from the returns to the Poincare section")
    attractors: Attractors = section(Attractors, "Attractors, where every operating point has several starts")


BIT_BOUNCE, STICK_SLIP, WHIRL, STALLED = 1, 2, 4, 8
MILD_TO_SEVERE = ("none", "light", "moderate", "strong", "severe")
# The bits of a model's own responses begin here: that of a drill string is never one of them.
FIRST_OWN, MOST_OWN = 16, 6
# Paul Tol's bright colours and markers for those that have none of their own.
_OWN_LOOKS = (
    ("#EE6677", "^"), ("#4477AA", "s"), ("#CCBB44", "D"), ("#AA3377", "P"), ("#66CCEE", "X"), ("#999933", "v"),
)  # fmt: skip
_TAKEN = (
    "none", "safe", "critical", "borderline", "unknown", "settled", "trust", "motion", "attractors",
    "stuck_below", "not_judged", "unmeasured", "failed",
)  # fmt: skip


@dataclass(frozen=True)
class Response:
    """A critical response.

    It is present where ``feature`` exceeds the threshold of that name in the section
    ``thresholds`` of a study's ``classify`` that has the ``name`` of the response, and has
    this ``bit`` in the label ``response``. A model that declares its own gives the
    ``threshold`` [SI], and in ``limits`` the names and lower bounds of up to four bands of
    severity; what else it leaves out follows from the feature (:func:`own`).

    The label ``severity`` is the band, 0 to 4, of the feature
    ``graded`` among the thresholds ``bounds``; on pictures the bands are named
    ``bands``, and an axis of ``feature`` reaches ``axis`` percent at least. A response
    without a severity is never safe. ``share`` says whether the feature is a fraction
    of the time, not a percentage. A map of the feature has ``lines`` at the bounds.
    Where ``at_least`` is set, a response that is present has at least the band 1,
    whatever its threshold; where ``turning`` is set, it is a motion of a bit that
    turns, and has the band 0 where the bit is stalled.

    The label ``kind`` tells several kinds of it apart, if there is one. A motion of a kind
    in ``harmless`` is named by that label, and is not the response: it has not its bit.

    ``words``, one ``letter``, a ``colour`` and a ``marker`` stand for it on pictures;
    ``verb`` is what a string may
    do, ``limit`` from where it counts, and ``measured`` how much of it an attractor
    has, both of the feature, a fraction in percent; ``absent`` stands for a run without
    it, by default its words after "no".
    """

    name: str
    bit: int = 0
    feature: str = ""
    words: str = ""
    letter: str = ""
    verb: str = ""
    limit: str = ""
    measured: str = ""
    colour: str = ""
    marker: str = ""
    threshold: float | None = None
    limits: Mapping[str, float] = field(default_factory=dict)
    thresholds: type | None = None
    severity: Variable | None = None
    graded: str = ""
    bounds: tuple[str, ...] = ()
    kind: Variable | None = None
    harmless: tuple[str, ...] = ()
    bands: tuple[str, ...] = MILD_TO_SEVERE
    axis: float = 5.0
    at_least: bool = True
    turning: bool = False
    share: bool = True
    lines: bool = False
    absent: str = ""

    @property
    def is_own(self) -> bool:
        """Whether it is no response of a drill string."""
        return self.bit >= FIRST_OWN

    @property
    def does(self) -> str:
        """What a run with it does, for a sentence: ``sticks``."""
        return f"{self.verb}s" if self.verb else f"shows {self.words}"

    @property
    def above(self) -> str:
        """The threshold of it in a sentence, of the feature as :attr:`limit` has it: ``above
        {:g} %``."""
        return f"above {self.limit.rpartition(' above ')[2]}" if self.is_own else "above {:g} %"

    def limit_in(self, thresholds: Thresholds) -> float:
        """The threshold."""
        return float(getattr(getattr(thresholds, self.name), self.feature))

    @property
    def absence(self) -> str:
        """The words for a run without it: ``no whirl``."""
        return self.absent or f"no {self.words}"

    def bounds_in(self, thresholds: Thresholds) -> tuple[float, ...]:
        """The bounds of severity."""
        return tuple(getattr(getattr(thresholds, self.name), bound) for bound in self.bounds)

    def is_harmless(self, kinds: Array) -> Array:
        """Where the labels ``kind`` are harmless."""
        names = (self.kind.flag_meanings or "").split() if self.kind else []
        return np.isin(kinds, [names.index(one) for one in self.harmless])

    @property
    def words_of_kinds(self) -> tuple[str, ...]:
        """The words of the label ``kind``, the first for no response."""
        _, *kinds = ((self.kind and self.kind.flag_meanings) or "none").split()
        return self.absence, *(kind.replace("_", " ") for kind in kinds)

    def percent(self, value: float) -> float:
        """The value of the feature in percent."""
        return 100 * value if self.share else value


OF_MOTION = {"axial": ("bit_bounce",), "torsional": ("stick_slip", "stalled"), "lateral": ("whirl",)}
"""The responses of a drill string that it cannot show without each of its motions."""


def _is_word(name: str) -> bool:
    """Whether keys and fields of records may have this name."""
    return name.isidentifier() and not keyword.iskeyword(name)


def own(declared: Response, feature: Variable, place: int, letters: Collection[str]) -> Response:
    """The response that a model declares as its ``place``-th own one, complete: what it
    leaves out follows from its ``feature``. None of the ``letters`` is free for it.
    ValueError where it cannot be one."""
    name = declared.name
    bit = declared.bit or FIRST_OWN << place
    if not _is_word(name) or name in _TAKEN or name in RESPONSES:
        raise ValueError(
            f"responses: found the name {name!r}; allowed: another word than {', '.join((*_TAKEN, *RESPONSES))}, "
            "and no keyword of Python"
        )
    if place >= MOST_OWN or bit not in (FIRST_OWN << number for number in range(MOST_OWN)):
        most = FIRST_OWN << (MOST_OWN - 1)
        raise ValueError(
            f"responses: found {name} with the bit {bit}; allowed: at most {MOST_OWN}, powers of two "
            f"{FIRST_OWN} to {most}"
        )
    if (declared.threshold is None) == (declared.thresholds is None):
        raise ValueError(f"responses: found {name} with no threshold, or two; allowed: the threshold of its feature")
    steps = [*declared.limits.values()]
    words_fit = all(_is_word(word) and word != "none" for word in declared.limits)
    if len(steps) > 4 or steps != sorted(steps) or not words_fit:
        raise ValueError(
            f"responses: found the limits {dict(declared.limits)} of {name}; allowed: up to four words, none of them "
            "none, with bounds that ascend"
        )
    units, share = plain_units(feature.units), (feature.low, feature.high) == (0.0, 1.0)
    units = "" if units == "1" else units
    unit, bands = " %" if share else f" {units}".rstrip(), ("none", *declared.limits)
    severity = flag(f"{name}_severity", f"severity band of the {feature.long_name}", " ".join(bands))
    colour, marker = _OWN_LOOKS[place]
    words = declared.words or name.replace("_", " ")
    free = [one for one in f"{words}{ascii_uppercase}".upper() if one.isalpha() and one not in letters]
    found = replace(
        declared,
        bit=bit,
        words=words,
        letter=declared.letter or free[0],
        limit=declared.limit or f"{feature.long_name} above {{:g}}{unit}",
        measured=declared.measured or f"{feature.long_name} {{:.3g}}{unit}",
        colour=declared.colour or colour,
        marker=declared.marker or marker,
        graded=declared.graded or (declared.feature if steps else ""),
        bounds=declared.bounds or tuple(declared.limits),
        bands=tuple(word.replace("_", " ") for word in bands) if steps else declared.bands,
        severity=declared.severity or (severity if steps else None),
        share=share,
        axis=100 * declared.threshold if share and declared.threshold is not None else declared.axis,
    )
    return found if found.thresholds else replace(found, thresholds=_section(found, feature, units))


def _section(declared: Response, feature: Variable, units: str) -> type:
    """The section ``classify`` of a study that has the thresholds of an own response."""
    low, high = feature.bounds
    about = {declared.feature: (declared.threshold, f"{declared.words} above this {feature.long_name}")}
    about |= {word: (bound, f"Severity {word.replace('_', ' ')} above this") for word, bound in declared.limits.items()}
    numbers = [
        (word, float, parameter(bound, units, low=low, high=high, meaning=meaning[:1].upper() + meaning[1:]))
        for word, (bound, meaning) in about.items()
    ]
    return make_dataclass(declared.name, numbers, bases=(Checked,), frozen=True)


def with_sections(base: type, responses: Iterable[Response], again: Callable[..., Any], key: Any) -> type:
    """The thresholds ``base`` and a section for each of these own ``responses``. An instance
    is pickled as its numbers, from which the function ``again(key, numbers)`` makes it."""
    sections: list[Any] = [
        (one.name, one.thresholds, section(one.thresholds, one.words[:1].upper() + one.words[1:]))
        for one in responses
        if one.thresholds is not None
    ]
    reduced = {"__reduce__": lambda self: (again, (key, asdict(self)))}
    return make_dataclass(base.__name__, sections, bases=(base,), frozen=True, namespace=reduced)


def made_of(kind: Any, numbers: Mapping[str, Any]) -> Any:
    """An instance of the dataclass ``kind`` from :func:`dataclasses.asdict` of one."""
    sections: dict[str, Any] = {item.name: item.default_factory for item in fields(kind)}
    return kind(**{name: sections[name](**one) if isinstance(one, dict) else one for name, one in numbers.items()})


def label_type(responses: Iterable[Response]) -> str:
    """The type of the label that has the bits of these responses."""
    return "i1" if sum(one.bit for one in responses) < 128 else "i2"


def ungraded(responses: Iterable[Response]) -> int:
    """The bits of the responses without a severity."""
    return sum(one.bit for one in responses if one.severity is None)


def severity_words(responses: Iterable[Response], level: int) -> str:
    """What the band of a ``level`` of severity of these responses is called: of own ones by their words, ``hard``, of
    those of a drill string together by the common ones."""
    graded = [one for one in responses if one.severity is not None]
    bands = [one.bands if one.is_own else MILD_TO_SEVERE for one in graded] or [MILD_TO_SEVERE]
    return " or ".join(dict.fromkeys(band[min(level, len(band) - 1)] for band in bands))


def severity_levels(responses: Iterable[Response]) -> range:
    """The levels that allow something and not everything: above none and below the greatest of these responses."""
    return range(1, max((len(one.bands) for one in responses if one.severity is not None), default=1) - 1)


def severity_labels(responses: Iterable[Response]) -> tuple[str, ...]:
    """The labels of severity of these responses."""
    return tuple(one.severity.name for one in responses if one.severity is not None)


VIBRATIONS = ("bit_bounce", "stick_slip", "whirl")  # of a string
RESPONSES = {
    response.name: response
    for response in (
        Response(
            "bit_bounce",
            BIT_BOUNCE,
            "lift_off_fraction",
            severity=flag("bounce_severity", "severity band of the time off the rock", " ".join(MILD_TO_SEVERE)),
            graded="lift_off_fraction",
            bounds=("light_fraction", "moderate_fraction", "strong_fraction", "severe_fraction"),
            words="bit-bounce",
            letter="B",
            verb="bounce",
            limit="off the rock for more than {:g} % of the time",
            measured="off the rock {:.1f} %",
            colour="#56B4E9",
            marker="^",
            thresholds=BitBounce,
        ),
        Response(
            "stick_slip",
            STICK_SLIP,
            "stick_slip_index",
            severity=flag(
                "stick_slip_severity",
                "severity band of the stick-slip index",
                "none torsional_oscillation medium onset_of_full_stall severe",
            ),
            graded="stick_slip_index",
            bounds=("oscillation_index", "medium_index", "stall_index", "severe_index"),
            words="stick-slip",
            letter="S",
            verb="stick",
            limit="index above {:g} %",
            measured="index {:.0f} %",
            colour="#E69F00",
            marker="s",
            thresholds=StickSlip,
            bands=("none", "oscillation", "medium", "onset of stall", "severe"),
            axis=110.0,
            at_least=False,
            turning=True,
            share=False,
            lines=True,
        ),
        Response(
            "whirl",
            WHIRL,
            "wall_contact_fraction",
            severity=flag(
                "whirl_severity", "severity band of the r.m.s. lateral acceleration", " ".join(MILD_TO_SEVERE)
            ),
            graded="lateral_acceleration_rms",
            bounds=("light_acceleration", "moderate_acceleration", "strong_acceleration", "severe_acceleration"),
            words="whirl",
            letter="W",
            verb="whirl",
            limit="on the wall for more than {:g} % of the time",
            measured="",
            colour="#CC79A7",
            marker="D",
            thresholds=Whirl,
            kind=flag("whirl_kind", "kind of whirl", "none forward backward backward_rolling irregular low_side"),
            harmless=("low_side",),
        ),
        Response(
            "stalled",
            STALLED,
            "stuck_fraction",
            words="stalled",
            letter="T",
            verb="stall",
            limit="stuck for more than {:g} % of the time",
            measured="stuck {:.1f} %",
            colour="#2E2E2E",
            marker="v",
            thresholds=Stalled,
            absent="not stalled",
        ),
    )
}
# The labels of severity.
SEVERITIES = tuple(response.severity.name for response in RESPONSES.values() if response.severity)


# The kinds of a response, by the names of their labels.
RESPONSE_KINDS = {response.kind.name: response for response in RESPONSES.values() if response.kind}


CREEPS = 0.1  # of the speed below which the bit is stuck: one that is never faster stands


BIT_SPEEDS = ("bit_speed_min", "bit_speed_mean", "bit_speed_max")
# of the greatest speed, and rad/s of one that creeps: a mean that lies further beyond least and greatest is none
SLACK, LEAST_SLACK = 0.05, 0.1


def misread(features: Mapping[str, Array], responses: Iterable[Response]) -> Array | bool:
    """Where ``features``, those of the ``responses`` and what these are graded by, cannot
    have been measured: no number, infinite, negative or a share above one where it is a share
    or that of a drill string, or a mean bit speed that is not
    between the least and the greatest. The index of a bit whose mean speed is zero is
    infinite."""
    found: Array | bool = False
    with np.errstate(invalid="ignore"):
        for one in responses:
            for name in {one.feature, one.graded} & features.keys():
                values = np.asarray(features[name])
                is_infinite = np.isinf(values)
                if name == RESPONSES["stick_slip"].feature and "bit_speed_mean" in features:
                    is_infinite = is_infinite & (np.asarray(features["bit_speed_mean"]) != 0.0)
                found = found | np.isnan(values) | is_infinite
                if one.share or not one.is_own:
                    found = found | (values < 0.0)
                if name == one.feature and one.share:
                    found = found | (values > 1.0)
        if {*BIT_SPEEDS} <= features.keys():
            low, mean, high = (np.asarray(features[name]) for name in BIT_SPEEDS)
            slack = LEAST_SLACK + SLACK * np.maximum(np.abs(low), np.maximum(np.abs(high), np.abs(mean)))
            found = found | (mean < low - slack) | (mean > high + slack)
    return found


def present(
    features: Mapping[str, Array], thresholds: Thresholds, responses: Mapping[str, Response] | None = None
) -> Array:
    """The critical responses as a sum of bits, of those of the ``responses``, by default of a
    drill string, whose feature is among ``features``; a stalled run has no other."""
    bits: Any = np.int64(0)
    with np.errstate(invalid="ignore"):
        for one in (RESPONSES if responses is None else responses).values():
            if one.feature in features and hasattr(thresholds, one.name):
                bits = bits + one.bit * (np.asarray(features[one.feature]) > one.limit_in(thresholds))
        if not hasattr(thresholds, "stuck_below"):
            return np.asarray(bits + np.zeros(np.shape(features["half_difference"]), dtype=np.int64))
        # The index is infinite where the mean bit speed is zero; with friction that is smoothed
        # a bit that stands creeps.
        stands = np.isposinf(features.get(RESPONSES["stick_slip"].feature, 0.0))
        turns = [np.asarray(features.get(name, np.inf)) for name in ("bit_speed_max", "bit_speed_mean")]
        stands = stands | (np.maximum(*turns) < CREEPS * thresholds.stuck_below)
    return np.asarray(np.where((bits & STALLED > 0) | stands, STALLED, bits))


def severities(
    features: Mapping[str, Array],
    response: Array,
    thresholds: Thresholds,
    responses: Mapping[str, Response] | None = None,
) -> dict[str, Array]:
    """The severity bands of the ``responses``, by default those of a drill string, whose
    features the model measures; a bound belongs to the band below it."""
    labels = {}
    for one in (RESPONSES if responses is None else responses).values():
        if one.severity and one.graded in features and hasattr(thresholds, one.name):
            band = np.digitize(np.nan_to_num(features[one.graded]), one.bounds_in(thresholds), right=True)
            least = response & one.bit > 0 if one.at_least else 0
            graded = np.where(one.turning & (response & STALLED > 0), 0, band)
            labels[one.severity.name] = np.asarray(np.maximum(graded, least))
    return labels


def trust_labels(
    checks: Mapping[str, Array],
    response: Array,
    thresholds: Thresholds,
    responses: Callable[[Mapping[str, Array], Thresholds], Array],
) -> dict[str, Array]:
    """The labels ``tight_response``, ``long_response`` and ``trusted`` of points with
    this ``response``; ``checks`` has the status of their checks, the features from
    which ``responses`` are determined, and the differences. A feature that a check did
    not measure is that of the point."""
    labels = {}
    trusted = np.ones(np.shape(response), dtype=bool)
    for check in CHECKS:
        succeeded = checks[f"{check}_status"] == OK
        prefix, other = f"{check}_", (f"{check}_status", f"{check}_difference", f"{check}_response")
        measured = {
            name.removeprefix(prefix): checks[name] for name in checks if name.startswith(prefix) and name not in other
        }
        found = responses({**checks, **measured}, thresholds)
        labels[f"{check}_response"] = np.where(succeeded, found, 0).astype(np.asarray(response).dtype)
        with np.errstate(invalid="ignore"):
            near = checks[f"{check}_difference"] <= thresholds.trust.tolerance
        trusted &= succeeded & near & (labels[f"{check}_response"] == response)
    return {**labels, "trusted": trusted.astype(np.int8)}

"""The critical responses of a drill string, each declared once: from which feature and
threshold it follows, how bad it is, and the words and signs for it. A model names those
that it can show.

A bit that stays stuck is *stalled*. Such a run is critical, and it has no other
response: what the bit and the collar do beside that is in the features alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from nsdrill.data import Array
from nsdrill.observe.thresholds import Attractors, Motion, Settled, Trust
from nsdrill.ranges import Checked, parameter, section
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
    ``direction`` in size. Of these a collar lies on the low side that is on the wall for
    ``rolling_contact`` of the time in the lower half of an inclined hole, with a lateral
    acceleration up to ``light_acceleration``: there its weight holds it, and that is no
    whirl. One that strikes the wall harder is irregular.

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
    motion: Motion = section(Motion, "Kind of motion, from the returns to the Poincare section")
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
    motion: Motion = section(Motion, "Kind of motion, from the returns to the Poincare section")
    attractors: Attractors = section(Attractors, "Attractors, where every operating point has several starts")


BIT_BOUNCE, STICK_SLIP, WHIRL, STALLED = 1, 2, 4, 8
MILD_TO_SEVERE = ("none", "light", "moderate", "strong", "severe")


@dataclass(frozen=True)
class Response:
    """A critical response.

    It is present where ``feature`` exceeds the threshold of that name in the section of
    :class:`Thresholds` that has the ``name`` of the response, and has this ``bit`` in
    the label ``response``. The label ``severity`` is the band, 0 to 4, of the feature
    ``graded`` among the thresholds ``bounds``; on pictures the bands are named
    ``bands``, and an axis of ``feature`` reaches ``axis`` percent at least. A response
    without a severity is never safe. ``share`` says whether the feature is a fraction
    of the time, not a percentage. A map of the feature has ``lines`` at the bounds.
    Where ``at_least`` is set, a response that is present has at least the band 1,
    whatever its threshold; where ``turning`` is set, it is a motion of a bit that
    turns, and has the band 0 where the bit is stalled.

    The label ``kind`` tells several kinds of it apart, if there is one. A motion of a kind
    in ``harmless`` is named by that label, and is not the response: it has not its bit.

    ``words`` and one ``letter`` stand for it on pictures; ``verb`` is what a string may
    do, ``limit`` from where it counts, and ``measured`` how much of it an attractor
    has, both of the feature in percent; ``absent`` stands for a run without it, by
    default its words after "no".
    """

    name: str
    bit: int
    feature: str
    words: str
    letter: str
    verb: str
    limit: str
    measured: str
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


def misread(features: Mapping[str, Array]) -> Array | bool:
    """Where ``features``, those of a response and what it is graded by, cannot have been
    measured: no number, negative, infinite, a share above one, or a mean bit speed that is not
    between the least and the greatest. The index of a bit whose mean speed is zero is
    infinite."""
    found: Array | bool = False
    with np.errstate(invalid="ignore"):
        for one in RESPONSES.values():
            for name in {one.feature, one.graded} & features.keys():
                values = np.asarray(features[name])
                is_infinite = np.isinf(values)
                if name == RESPONSES["stick_slip"].feature and "bit_speed_mean" in features:
                    is_infinite = is_infinite & (np.asarray(features["bit_speed_mean"]) != 0.0)
                found = found | np.isnan(values) | (values < 0.0) | is_infinite
                if name == one.feature and one.share:
                    found = found | (values > 1.0)
        if {*BIT_SPEEDS} <= features.keys():
            low, mean, high = (np.asarray(features[name]) for name in BIT_SPEEDS)
            slack = LEAST_SLACK + SLACK * np.maximum(np.abs(low), np.maximum(np.abs(high), np.abs(mean)))
            found = found | (mean < low - slack) | (mean > high + slack)
    return found


def present(features: Mapping[str, Array], thresholds: Thresholds) -> Array:
    """The critical responses as a sum of bits, of those whose feature is among
    ``features``; a stalled run has no other."""
    bits: Any = np.int64(0)
    with np.errstate(invalid="ignore"):
        for one in RESPONSES.values():
            if one.feature in features and hasattr(thresholds, one.name):
                limit = getattr(getattr(thresholds, one.name), one.feature)
                bits = bits + one.bit * (np.asarray(features[one.feature]) > limit)
        if not hasattr(thresholds, "stuck_below"):
            return np.asarray(bits + np.zeros(np.shape(features["half_difference"]), dtype=np.int64))
        # The index is infinite where the mean bit speed is zero; with friction that is smoothed
        # a bit that stands creeps.
        stands = np.isposinf(features.get(RESPONSES["stick_slip"].feature, 0.0))
        turns = [np.asarray(features.get(name, np.inf)) for name in ("bit_speed_max", "bit_speed_mean")]
        stands = stands | (np.maximum(*turns) < CREEPS * thresholds.stuck_below)
    return np.asarray(np.where((bits & STALLED > 0) | stands, STALLED, bits))


def severities(features: Mapping[str, Array], response: Array, thresholds: Thresholds) -> dict[str, Array]:
    """The severity bands of the responses whose features the model measures; a bound
    belongs to the band below it."""
    labels = {}
    for one in RESPONSES.values():
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
        labels[f"{check}_response"] = np.where(succeeded, found, 0).astype(np.int8)
        with np.errstate(invalid="ignore"):
            near = checks[f"{check}_difference"] <= thresholds.trust.tolerance
        trusted &= succeeded & near & (labels[f"{check}_response"] == response)
    return {**labels, "trusted": trusted.astype(np.int8)}

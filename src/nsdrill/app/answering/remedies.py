"""What would make a string safe: one change of its study at a time, run as one way up."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field, replace

import numpy as np

from nsdrill.analysis.graded import SLACK, Graded, graded
from nsdrill.analysis.grades import lasting
from nsdrill.analysis.histories import Grade
from nsdrill.analysis.room import room
from nsdrill.analysis.sticking import sticks_past
from nsdrill.analysis.trials import HOLDS_WEIGHT, OTHER_BIT, PONY_SPAN, Change, deepest, narrowed
from nsdrill.analysis.untried import jumps_of, stretches_run
from nsdrill.app.answering.answers import drilled_within, with_lasting_motions
from nsdrill.app.check import damping_of_torsion, dampings_of_torsion, lasting_motions
from nsdrill.app.experiment import prepare
from nsdrill.app.running.price import cost_of_second
from nsdrill.app.running.run import run_in_memory
from nsdrill.app.simulating.motions import Motions
from nsdrill.data import Array, Resolved, value_at
from nsdrill.errors import NsdrillError, count
from nsdrill.models.aggressive import ROLLER_CONE, usual_of
from nsdrill.models.damped import KEY, LOW, USUAL
from nsdrill.models.friction import LAWS
from nsdrill.quantity import quantity
from nsdrill.records import dataclass
from nsdrill.study import parse_study
from nsdrill.study.load import default_study
from nsdrill.study.study import Study
from nsdrill.study.write import study_text
from nsdrill.units import format_quantity, from_si, to_si
from nsdrill.variables import has_failed

SPEEDS, MOST_SPEEDS = 25, 65  # of a change; with those between, where a motion begins that may last
SETTLE, OBSERVE = 60.0, 60.0  # s
TIMED = 20.0  # s of each motion by which changes are priced
COLLARS = (3.125, 3.5, 4.125, 4.75, 6.5, 8.0, 9.5, 11.0)  # in, common outer diameters of drill collars
LARGEST_COLLAR = 0.8  # of the hole
STRAIGHT = 2e-3  # m, the eccentricity of a collar that has been checked
CLOSER = (0.75, 0.5)  # of the length between stabilisers
JOINTS = {"ft": (30.0, 15.0), "m": (9.5, 3.0)}  # of a drill collar, and of a pony collar, which is shorter
WITH_PONY = " with pony collars"
STIFF = ("ideal", "stiff", "pi")  # kinds of drive that hold the speed
SPAN, COLLAR = "drillstring.collar.span", "drillstring.collar.outer_diameter"
COUNT, FRICTION, COEFFICIENTS = "bit.lobes", "bit.friction", ("static", "dynamic")
LOBES, ECCENTRICITY, DRIVE = "bit.surface_amplitude", "drillstring.eccentricity", "drive.kind"


AS_IT_IS = Change("none", "", "", "as it is")


@dataclass(frozen=True)
class Changed:
    """The changes of the string at ``values`` of the axes, and at other ``weights`` [N] of the file, over the range of
    its ``speeds`` [rad/s]; ``within`` has the least and the greatest weight [N] and speed [rad/s] at which one drills,
    where these are given: no change leaves them."""

    motions: Motions
    values: Mapping[str, float]
    speeds: Array
    severity: int | None = None
    within: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    weights: tuple[float, ...] = ()

    def all(self) -> list[Change]:
        """The changes that the model reads, and that are not there already."""
        study = self.motions.at(self.values)
        unread = getattr(study.parameters, "unread", ())
        known = {key for key in study.keys.axes if key not in unread}
        found = (one for one in self._all(known) if one.key.removeprefix("operation.") in known)
        return [AS_IT_IS, *found]

    def _all(self, known: set[str]) -> Iterator[Change]:
        resolved = self.motions.resolved(self.values)
        is_field = resolved.get("units") == "field"

        def now(key: str) -> float:
            return float(value_at(resolved, key)) if key in known else 0.0

        length, small = ("ft", "in") if is_field else ("m", "mm")
        if SPAN in known:
            for text, words in closer(now(SPAN), length).items():
                yield Change(PONY_SPAN if WITH_PONY in words else "span", SPAN, text, words)
        if DRIVE in known and value_at(resolved, DRIVE) in STIFF:
            yield Change("drive", DRIVE, "soft_torque", "soft torque")
        weight = _rounded(2 / 3 * self.values["wob"], "klbf" if is_field else "kN")
        if to_si(weight, "N") >= self.within.get("wob", (0.0,))[0]:
            yield Change("weight", "operation.wob", weight, f"{weight} on the bit")
        hole = now("well.diameter")
        larger = [size * 0.0254 for size in COLLARS if now(COLLAR) * 1.01 < size * 0.0254 <= LARGEST_COLLAR * hole]
        if larger:
            text = f"{from_si(larger[0], small):.4g} {small}"
            yield Change("collar", COLLAR, text, f"{text} collars")
        if (eccentricity := now(ECCENTRICITY)) > 0.0:
            straight = STRAIGHT if eccentricity > STRAIGHT else eccentricity / 4
            text = f"{1e3 * straight:.2g} mm"
            shown_text = quantity(ECCENTRICITY).text(straight, "field", 2) if is_field else text
            yield Change("eccentricity", ECCENTRICITY, text, f"collars straight to {shown_text}")
        if now(LOBES) > 0.0:
            yield from _other_bit(self.motions.at(self.values), resolved)

    def run(self, change: Change) -> Change:
        """The ``change`` with where it is free from below, and how much room it has, at each of its weights. A value
        that a study cannot have, or runs that failed, are why it is not known."""
        first, *others = self._run_at(change, self.wobs(change))
        return replace(first, others=tuple(others))

    def wobs(self, change: Change) -> list[float]:
        """The weights [N] at which a ``change`` is run, that of the :attr:`values` first; its own of one of the
        weight."""
        if change.name == "weight":
            return [to_si(change.value, "N")]
        here = self.values["wob"]
        return [here, *(wob for wob in self.weights if wob != here)]

    def _run_at(self, change: Change, wobs: Sequence[float]) -> list[Change]:
        """The ``change`` at each of these weights [N], which are run side by side."""
        try:
            results = run_in_memory(self.study_of(change, wobs), workers=1)
        except NsdrillError as error:
            return [replace(change, wob=wob, why=str(error).splitlines()[0].rstrip(".")) for wob in wobs]
        drilled = drilled_within(results, {axis: ends for axis, ends in self.within.items() if axis == "rotary_speed"})
        maps, found = graded(with_lasting_motions(drilled), self.severity), []
        for wob in wobs:
            row = int(np.abs(maps.results.coords["wob"] - wob).argmin())
            status = np.take(results["status"], row, axis=1 + results.axes.index("wob"))
            failed, of = int(np.count_nonzero(has_failed(status))), status.size
            one = replace(change, wob=wob, why=f"{failed} of {of} runs failed" if failed else "")
            found.append(one if failed == of else shown(one, maps, 0, row if maps.y == "wob" else 0))
        return found

    def held_in_weight(self, change: Change) -> Change:
        """The ``change`` with the weights to which a driller holds it, and of the speeds those alone that its way up
        at each of these weights is free over as well: a trial in a corner shows no more than that one spot. A weight
        that leaves no room, or is not known, is none of them, and :attr:`Change.why` says so."""
        wob = self.point(change)[1]["wob"]
        lightest, heaviest = self.within.get("wob", (0.0, np.inf))
        light = max(wob - HOLDS_WEIGHT, lightest) if wob > HOLDS_WEIGHT else wob
        ends = sorted({min(light, wob), max(min(wob + HOLDS_WEIGHT, heaviest), wob)} - {wob})
        return self._held_at(change, wob, ends)

    def _held_at(self, change: Change, wob: float, ends: Sequence[float], how: str = "") -> Change:
        """The ``change`` at its weight ``wob`` and those of the ``ends`` [N] that leave room, as these motions have
        it; ``how`` is what sets them apart."""
        held, why = {wob}, [change.why] if change.why else []
        unit = "klbf" if self.motions.resolved(self.values).get("units") == "field" else "kN"
        for end, one in zip(ends, self.at_weights(change, ends), strict=True):
            less = _within_free(change, one)
            if less is not None and less.has_room:
                change = less
                held.add(end)
            else:
                known = "has no room" if one.room is not None else "is not known"
                why.append(f"at {format_quantity(end, unit, 3)}{how} its way up {known}")
        return replace(change, weights=(min(held), max(held)), why="; ".join(why))

    def at_weights(self, change: Change, wobs: Sequence[float]) -> list[Change]:
        """The way up of a ``change`` at each of these weights [N]."""
        if not wobs:
            return []
        return self._run_at(AS_IT_IS if change.name == "weight" else replace(change, others=()), wobs)

    def with_usual_damping(self, change: Change) -> Change:
        """The ``change`` with what it allows as well where torsion is damped as in strings, by one way up at each of
        the weights to which it is held, and whether that leaves room at its own; as it was where the damping of the
        study is usual, or lower."""
        study = self.study_of(change)
        damping = damping_of_torsion(study)
        if damping is None or damping.ratio < USUAL or change.widest is None:
            return change
        usual = self._damped(change, damping.usual)
        ran = usual.run(change)
        if ran.room is None:
            return replace(change, why=f"with a usual damping of torsion not known: {ran.why}")
        less = usual._less(change, ran, " with a usual damping of torsion")
        return replace(change, holds_usual=False) if less is None else replace(less, holds_usual=True)

    def with_low_damping(self, change: Change) -> Change:
        """The ``change`` with its damping ratio and, where that is not the least that is usual, what is left with that:
        stick-slip then lasts farthest."""
        found = dampings_of_torsion(self.study_of(change))
        if not found or change.widest is None:
            return change
        damping = max(found, key=lambda one: one.ratio)
        change = replace(change, ratio=damping.ratio)
        if damping.is_low or not change.has_room:
            return change
        with_low = self._damped(change, damping.low)
        ran = with_low.run(change)
        if ran.room is None:
            how = f"with a damping ratio of {LOW:g} not known: {ran.why}"
            return replace(change, why="; ".join(filter(None, (change.why, how))))
        less = with_low._less(change, ran, f" with a damping ratio of {LOW:g}")
        return replace(change, low=replace(less or replace(change, room=0.0), low=None))

    def _damped(self, change: Change, damping: float) -> Changed:
        """These at the point of a ``change``, with another ``damping`` of torsion [N m s/rad]."""
        resolved = self.motions.resolved(self._at(change))
        section, name = KEY.split(".")
        resolved[section] |= {name: damping}
        motions = Motions(prepare(parse_study(study_text(resolved), "the study")))
        return replace(self, motions=motions, values=self._at(change), weights=())

    def _less(self, change: Change, ran: Change, how: str) -> Change | None:
        """What a ``change`` allows as well as these motions have it, of which it ``ran`` at its own weight, at each of
        the weights to which it is held; None where that leaves no room. ``how`` is what sets these apart."""
        assert change.widest is not None
        low, high = change.widest
        both = [narrowed(change, max(low, first), min(high, last)) for first, last in ran.free]
        less = max(map(deepest, both), key=lambda one: one.room or 0.0, default=None)
        if less is None or not less.has_room:
            return None
        if change.weights is None:
            return less
        wob = self.point(change)[1]["wob"]
        return self._held_at(less, wob, sorted({*change.weights} - {wob}), how)

    def study_of(self, change: Change, wobs: Sequence[float] = ()) -> Study:
        """The study of a change: its way up over the speeds of the file, finer where steps may jump across speeds at
        which a motion begins that may last; at these weights [N], by default at its own."""
        change = replace(change, wob=wobs[0] if wobs else change.wob)
        ends = float(np.min(self.speeds)), float(np.max(self.speeds))
        resolved = self.motions.resolved(self._at(change))
        resolved["simulation"] |= {"transient": self.held[0], "observe": self.held[1], "verify": False}

        def along(speeds: Array) -> Study:
            resolved["sweep"] = {
                "rotary_speed": [float(one) for one in speeds],
                "procedure": "up",
                "along": "rotary_speed",
                "refine": 0,
            }
            if len(wobs) > 1:
                resolved["sweep"]["wob"] = sorted(wobs)
            return self._parsed(resolved, change)

        speeds = np.linspace(*ends, SPEEDS)
        coarse = along(speeds)
        for one in filter(None, (each.get("jumped") for each in lasting_motions(coarse))):
            low, high = max(one["from"], ends[0]), min(one["to"], ends[1])
            steps = int(np.ceil((high - low) / one["enough"] - SLACK)) if high > low else 0
            if 0 < steps <= MOST_SPEEDS - len(speeds):
                speeds = np.union1d(speeds, np.linspace(low, high, steps + 1))
        return along(speeds) if len(speeds) > SPEEDS else coarse

    @property
    def held(self) -> tuple[float, float]:
        """How long each speed is held, and how long of that after it is observed [s]."""
        own = self.motions.study.simulation
        return max(SETTLE, own.transient), max(OBSERVE, own.observe)

    def seconds(self, change: Change) -> float:
        """How much time a change simulates in its longest chain [s]; none of one that no study can have."""
        try:
            return len(self.study_of(change, self.wobs(change)).axes["rotary_speed"]) * sum(self.held)
        except NsdrillError:
            return 0.0

    def rate(self) -> float:
        """How much time a second of the string as it is takes [s/s], at all its weights side by side, on this machine,
        now."""
        wobs = self.wobs(AS_IT_IS)
        return cost_of_second(self.study_of(AS_IT_IS, wobs), TIMED) * len(wobs)

    def _at(self, change: Change, **more: float) -> dict[str, float]:
        """The values of the axes at which a ``change`` is run, with ``more``."""
        wob = {} if change.wob is None or change.name == "weight" else {"wob": change.wob}
        return {**self.values, **wob, **more}

    def _parsed(self, resolved: Resolved, change: Change) -> Study:
        keys = ((change.key, change.value), *change.also) if change.key else ()
        return parse_study(study_text(resolved), "the study", [f"{key}={value}" for key, value in keys])

    def point(self, change: Change) -> tuple[Motions, dict[str, float]]:
        """The motions of the string with a ``change``, and the values of its operating point: at
        the speed with the most room."""
        assert change.speed is not None
        study = self._parsed(self.motions.resolved(self._at(change, rotary_speed=change.speed)), change)
        return Motions(prepare(study)), {name: float(value) for name, value in vars(study.operation).items()}


def _other_bit(study: Study, resolved: Resolved) -> Iterator[Change]:
    """The bit without lobes: of a roller cone a PDC bit, with all that comes with that. None where the friction of a
    PDC bit cannot stand in the study, as where a torque was measured of its own bit."""
    if usual_of(study.parameters.bit) is not ROLLER_CONE:
        friction = _friction_words(resolved["bit"]["friction"])
        words = f"a bit without lobes{f' (friction {friction}, as now)' if friction else ''}"
        yield Change(OTHER_BIT, LOBES, "0 m", words)
        return
    usual, own = (one["bit"]["friction"] for one in (default_study(study.model.name).resolved, resolved))
    if not _friction_words(usual) or not _friction_words(own) or COUNT not in study.keys.leaves:
        return
    also = ((f"{FRICTION}.{name}", f"{usual[name]:g}") for name in COEFFICIENTS)
    words = f"a PDC bit without lobes (friction {_friction_words(usual)})"
    yield Change(OTHER_BIT, LOBES, "0 m", words, also=((COUNT, "1"), *also))


def _friction_words(friction: Resolved) -> str:
    """The coefficients of a bit at rest and at speed: ``0.5/0.2``; "" of one whose friction is another."""
    if any(friction.get(name) is not None for name in ("static_torque", "dynamic_torque")):
        return ""
    law = LAWS.get(str(friction.get("law")))
    if law is None or "static" not in law.keys:
        return ""
    found = [friction.get(name) for name in COEFFICIENTS]
    return "/".join(f"{one:g}" for one in found if isinstance(one, float)) if None not in found else ""


def closer(span: float, unit: str) -> dict[str, str]:
    """The lengths between stabilisers to which a ``span`` [m] is reduced, as texts in a ``unit``, each with the change
    in words: the greatest that joints of collars make up, with a pony collar where that comes nearer."""
    joint, pony = JOINTS[unit]
    found = {}
    for share in CLOSER:
        most = share * from_si(span, unit) * (1.0 + SLACK)
        length, words = max((most // joint * joint, ""), ((most - pony) // joint * joint + pony, WITH_PONY))
        if length > 0.0:
            found[f"{length:g} {unit}"] = f"stabilisers {length:g} {unit} apart{words}"
    return found


def _within_free(change: Change, other: Change) -> Change | None:
    """The ``change`` with what an ``other`` is free over as well, at its setting where that has room there, else where
    most is; None where it is free over nothing of that."""
    if change.widest is None:
        return None
    low, high = change.widest
    both = [(max(low, first), min(high, last)) for first, last in other.free if first <= high and last >= low]
    less = [narrowed(change, *ends) for ends in both]
    here = [one for one in less if one.holds_setting and one.has_room]
    return here[0] if here else max(map(deepest, less), key=lambda one: one.room or 0.0, default=None)


def shown(change: Change, maps: Graded, number: int, row: int) -> Change:
    """The ``change`` with where a row of ``maps``, brought up along the speed, is free from below, and with what room.
    Where steps may jump across a motion, what is free ends there."""
    x, free = maps.values(maps.x), maps.fields[0][number, row]
    found = stretches_run(maps, free)
    rooms = np.zeros(len(x))
    for first, last in found:
        part = np.zeros(len(x), dtype=bool)
        part[first : last + 1] = True
        rooms = np.maximum(rooms, room(part[None], (None, np.zeros(1)), (maps.x, x))[0])
    deepest = int(np.argmax(rooms))
    widest = next(((first, last) for first, last in found if first <= deepest <= last), None)
    unknown = int(np.count_nonzero(maps.grade[number, row] == Grade.UNKNOWN))
    jumps = [one for one in jumps_of(maps) if one.motion is not None and one.axis == maps.x]
    return replace(
        change,
        free=tuple((float(x[first]), float(x[last])) for first, last in found),
        room=float(max(rooms[deepest], 0.0)),
        widest=None if widest is None else (float(x[widest[0]]), float(x[widest[1]])),
        why=change.why or (f"{unknown} of {count(len(x), 'point')} are not known" if unknown else ""),
        speed=None if widest is None else float(x[deepest]),
        jump=jumps[0] if jumps else None,
        sticks_past=widest is not None and _sticks_past(maps, number, row, float(x[widest[0]])),
    )


def _sticks_past(maps: Graded, number: int, row: int, begins: float) -> bool:
    """Whether stick-slip takes the way up of a row past the wall's speeds to where it is free, which ``begins`` above
    them."""
    wall = next((one for one in lasting(maps.results) if one["name"] == "wall_speed" and one.get("range")), None)
    if wall is None or "up" not in maps.ways or begins <= wall["range"]["to"]:
        return False
    values = maps.values(maps.x)
    inside = (values >= wall["range"]["from"]) & (values <= wall["range"]["to"])
    return bool(sticks_past(maps.bits_on("up")[number, row], inside))


def _rounded(value: float, unit: str) -> str:
    """An SI ``value`` to two digits, as one would set it."""
    return format_quantity(to_si(f"{from_si(value, unit):.2g} {unit}", _SI[unit]), unit, 4)


_SI = {"ft": "m", "m": "m", "klbf": "N", "kN": "N"}

"""The names that columns of a table of measurements may have: those of a study, and those
that rigs use for them."""

from __future__ import annotations

import re

import numpy as np

from nsdrill.data import Array
from nsdrill.models.parts import values_in_parts
from nsdrill.models.registry import model_named, of_all
from nsdrill.records import dataclass
from nsdrill.study.keys import Keys
from nsdrill.study.study import Study
from nsdrill.units import plain_units
from nsdrill.variables import Variable, dimension_of

GRADES = (0.0, 4.0)  # the range of a severity
TIME = "time"
ERROR = "_error"
MEAN, CHANGE = "_mean", "_change"
PERIOD = "stick_slip_period"
# What rigs call a setting or a result: its name here, over operating points and over time.
RIG_NAMES = {
    name: (point, signal)
    for names, point, signal in (
        (
            "rpm rpma rpm_avg rotary_rpm rotary_speed surface_rpm td_rpm tdrpm top_drive_rpm top_drive_speed "
            "average_rotary_speed average_rotary_rpm drehzahl string_rpm table_rpm rotary speed",
            "rotary_speed",
            "rotary_speed",
        ),
        (
            "wob swob wob_avg woba weight_on_bit averaged_wob average_wob average_weight_on_bit surface_wob "
            "bohrandruck andruck bit_weight",
            "wob",
            "wob",
        ),
        (
            "depth md dmea dbtm bit_depth hole_depth measured_depth depth_bit depth_hole bohrteufe teufe",
            "depth",
            "depth",
        ),
        (
            "torque trq tqa tq tor stor surface_tq surface_torque average_surface_torque top_drive_torque td_torque "
            "tdtrq rotary_torque drehmoment torq",
            "surface_torque_mean",
            "surface_torque",
        ),
        ("bitrpm bit_rpm downhole_rpm dh_rpm bit_speed rpm_bit", "bit_speed_mean", "bit_speed"),
        ("hkld hkla hookload hook_load hakenlast", "hook_load_mean", "hook_load"),
        ("rop ropa rop_avg", "rate_of_penetration", "rate_of_penetration"),
        ("mse", "mechanical_specific_energy", "mechanical_specific_energy"),
        ("ssi stick_slip", "stick_slip_index", "stick_slip_index"),
        ("period torsional_period period_of_stick_slip", "stick_slip_period", "stick_slip_period"),
    )
    for name in names.split()
}
_NAMES_OF_TIME = "time zeit uhrzeit timestamp time_stamp datetime date_time elapsed_time etime rtime tid"
TIMES = frozenset(_NAMES_OF_TIME.split())


@dataclass(frozen=True)
class Names:
    """The valid names of columns of a ``study``: ``settings`` maps them to its keys,
    ``results`` (features and severities of a run) and ``signals`` (of a trace) to SI
    units; ``features`` are the variables of results that are no severities."""

    study: Study
    keys: Keys
    settings: dict[str, str]
    results: dict[str, str]
    signals: dict[str, str]
    features: dict[str, Variable]

    @classmethod
    def of(cls, study: Study) -> Names:
        keys, model = study.keys, study.model
        options = (*model.states(study.parameters), *model.options(study.parameters), "drilled")
        settings = {name: key for key in keys.axes for name in (key, keys.axes[key].key, dimension_of(key))}
        present = [v for v in (*model.features, *model.derived) if v.only is None or v.only in options]
        results = {v.name: v.units for v in present} | {name: "" for name in model.severities}
        signals = {v.signal: v.units for v in present if v.signal}
        return cls(
            study,
            keys,
            settings,
            {name: "" if u == "1" else plain_units(u) for name, u in results.items()},
            {name: "" if u == "1" else plain_units(u) for name, u in signals.items()},
            {v.name: v for v in present},
        )

    def bounds(self, name: str) -> tuple[float, float]:
        """The least and the greatest value of a result, of its error, or of a signal,
        whose noise may go below zero."""
        if name in self.features:
            return self.features[name].bounds
        if name in self.results:
            return GRADES
        if name.endswith(ERROR) and name.removesuffix(ERROR) in self.results:
            low, high = self.bounds(name.removesuffix(ERROR))
            return 0.0, high - low
        greatest = max(v.bounds[1] for v in self.features.values() if v.signal == name)
        return -greatest, greatest

    def sizes(self, settings: dict[str, Array], values: dict[str, Array]) -> dict[str, float]:
        """The size that counts of each result in ``values``: the greatest value of all
        that come from one signal, and not less than the natural scale at these
        ``settings``, as that of a speed is the set speed."""
        study, model = self.study, self.study.model
        operation = vars(study.operation) | settings
        points = dict(zip(operation, np.broadcast_arrays(*map(np.atleast_1d, operation.values())), strict=True))
        natural: dict[str, float] = {}
        computed = model_named(model.name)
        for at, _ in values_in_parts(model, study.parameters, study.initial, points):
            for scale, column in computed.scales(computed.pack(at, study.thresholds)).items():
                natural[scale] = max(natural.get(scale, 0.0), float(np.max(column)))
        of_signals: dict[str, float] = {}
        for name, column in values.items():
            signal = self.signal(name)
            of_signals[signal] = max(of_signals.get(signal, 0.0), float(np.nanmax(np.abs(column))))
        return {
            name: max(
                of_signals[self.signal(name)],
                natural.get(model.compared.get(name) or "", 0.0),
                self.features[name].scale if name in self.features else 0.0,
            )
            for name in values
        }

    def signal(self, name: str) -> str:
        """The signal of a result, or itself."""
        return (name in self.features and self.features[name].signal) or name

    def units(self, name: str, timed: bool) -> str | None:
        """The SI units of the column ``name``; None where the name is unknown."""
        if name in self.settings:
            return self.keys.axes[self.settings[name]].units
        if timed:
            return "s" if name == TIME else self.signals.get(name)
        return self.results.get(name.removesuffix(ERROR))

    def known(self, timed: bool) -> list[str]:
        return [*self.settings, *([TIME, *self.signals] if timed else self.results)]

    def some_results(self) -> str:
        return f"a feature that a run has, as {', '.join(list(self.results)[:6])}"


def plain(head: str) -> str:
    """A head in the form of names: small letters, with one underscore for blanks and dashes, and
    none about an equals sign, where a command leaves blanks out."""
    return re.sub(r"_?=_?", "=", re.sub(r"[\s\-_]+", "_", head.strip().lower()))


def models_with(name: str) -> list[str]:
    """The models whose runs or traces have this value."""
    ends = ("", MEAN, "_max", f"{CHANGE}_max")
    return [
        model
        for model, features in of_all(lambda model: model.features)
        if {f"{name}{end}" for end in ends} & {one.name for one in features}
    ]

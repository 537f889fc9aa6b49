"""Every quantity that is displayed, defined once: its words, its SI units, and the
units in which it is displayed.

The names, long names and SI units of the variables in files come from
:mod:`nsdrill.variables`, those of the numbers of a study from its parameters. Pictures,
tables, messages and exports take words and units from here.
"""

from __future__ import annotations

from functools import lru_cache

from nsdrill.models.choices import choices_of, further_axes, words_of
from nsdrill.models.model_description import Description
from nsdrill.models.registry import of_all, spoken
from nsdrill.records import dataclass
from nsdrill.units import from_si, plain_units, readable, rounded_from_si, to_si
from nsdrill.variables import AXES, COORDINATES, dimension_of, short_key

SYSTEMS = ("si", "field")
DIGITS = 4  # of a number in an answer, wherever it is given; settings are given to six
LONG = 3.0  # m, from which a length is given in feet, not in inches

# SI units -> units of display in SI, as engineers write them, and in field units; both
# as nsdrill.units reads them.
SHOWN: dict[str, tuple[str, str]] = {
    "m": ("mm", "in"),
    "N": ("kN", "klbf"),
    "N m": ("kN*m", "kft*lbf"),
    "rad/s": ("rad/s", "rpm"),
    "rad/s^2": ("rad/s^2", "rpm/s"),
    "m/s": ("m/s", "ft/s"),
    "m/s^2": ("m/s^2", "gravity"),
    "rad": ("rad", "rev"),
    "Pa": ("GPa", "psi"),
    "kg/m^3": ("kg/m^3", "ppg"),
    "kg": ("kg", "lb"),
    "kg/m": ("kg/m", "lb/ft"),
    "kg m^2": ("kg m^2", "lb*ft^2"),
    "N/m": ("MN/m", "lbf/in"),
    "N/m^1.5": ("N/m^1.5", "lbf/in^1.5"),
    "N s/m": ("N s/m", "lbf*s/ft"),
    "N s^2/m^2": ("N s^2/m^2", "lbf*s^2/ft^2"),
    "N m/rad": ("N m/rad", "kft*lbf/rad"),
    "N m s/rad": ("N m s/rad", "ft*lbf*s/rad"),
    "s/m": ("s/m", "s/ft"),
    "W": ("kW", "hp"),
}
_SHOWN_OF_NAME = {
    "depth": ("m", "ft"),
    "well_inclination": ("deg", "deg"),
    "rate_of_penetration": ("m/h", "ft/h"),
    "mechanical_specific_energy": ("MPa", "ksi"),
}
# The written form of a unit, where it differs from that in a study.
_SIGNS = {
    "kN*m": "kN m",
    "kft*lbf": "kft-lbf",
    "kft*lbf/rad": "kft-lbf/rad",
    "ft*lbf*s/rad": "ft-lbf s/rad",
    "lb*ft^2": "lb ft^2",
    "m/s^2": "m/s²",
    "gravity": "g",
    "percent": "%",
}

# Words in a sentence, where the long name in files is too long.
_WORDS = {"depth": "depth", "wob": "weight on bit", "rotary_speed": "speed"}
# Labels of coordinates on pictures, where the long name is too long; variables have their
# own.
_LABELS = {
    "depth": "Measured depth",
    "wob": "Weight on bit",
    "rotary_speed": "Rotary speed",
    "drive_matching": "Drive matching [pipe impedances]",
    "time": "Time",
}


@dataclass(frozen=True)
class Quantity:
    """A quantity by its ``name`` in files and studies: ``long_name``, as in files;
    ``words`` for a sentence; ``label`` for the axis of a picture; its SI ``units`` as a
    study writes them, "" for a plain number; and in ``shown`` the units of display in
    SI and in field units, as :mod:`nsdrill.units` reads them. ``choice`` is the key of
    a choice, "" for a number."""

    name: str
    long_name: str
    words: str
    label: str
    units: str
    shown: tuple[str, str]
    choice: str = ""

    @property
    def choices(self) -> tuple[str, ...]:
        """The words of a choice, whose values are their indices; () for a number."""
        return words_of(self.choice) if self.choice else ()

    def unit(self, system: str) -> str:
        """The unit of display in the ``system``, "si" or "field"; "" for a plain
        number."""
        return self.shown[SYSTEMS.index(system)]

    def in_answers(self, value: float, system: str) -> str:
        """An SI ``value`` with its unit of display, as answers, pictures and pages write
        it; for a choice its word."""
        if self.choices:
            return self.choices[int(value)]
        unit = self.unit(system)
        scale = 1.0 if unit in ("", "percent") else shown_scale(unit, self.units)
        return f"{short(value / scale)} {sign(unit)}".rstrip()

    def text(self, value: float, system: str, digits: int = 6) -> str:
        """An SI ``value`` with its unit, chosen so that the number is neither large nor
        small; for a choice its word."""
        if self.choices:
            return self.choices[int(value)]
        if self.units in SHOWN and self.shown == (self.units, self.units):
            return amount(value, self.units, digits)  # in which it is declared
        if system == "si" and self.name not in (*AXES, *_SHOWN_OF_NAME):
            return readable(value, self.units, digits)
        unit = self.unit(system)
        return amount(value, "ft" if unit == "in" and abs(value) >= LONG else unit, digits)


def short(number: float) -> str:
    """A number with :data:`DIGITS`, or all before the point where these are not many."""
    return f"{number:.0f}" if 1e4 <= abs(number) < 1e12 else f"{number:.{DIGITS}g}"


def amount(value: float, unit: str, digits: int = 6) -> str:
    """An SI ``value`` in ``unit``, with so many digits or all before the point, and no
    more where these are five: ``11483 ft``."""
    if unit in ("", "percent"):
        return f"{value:.{digits}g} {sign(unit)}".strip()
    number = from_si(value, unit)
    text = f"{number:.{digits}g}"
    if ("e+" in text or abs(number) >= 1e4) and abs(number) < 1e9:
        text = f"{number:.0f}"
    return f"{text} {sign(unit)}"


def sign(unit: str) -> str:
    """The written form of a unit: ``kft-lbf`` for ``kft*lbf``."""
    return _SIGNS.get(unit, unit)


def in_system(value: float, units: str, system: str) -> tuple[float, str]:
    """An SI ``value`` for programs, and its unit: in SI as it is, in field units in
    that of display. ``units`` are SI, as in a study or in the attributes of a
    file."""
    unit = unit_in(units, system)
    return (value, units) if unit is None else (rounded_from_si(value, unit), unit)


def unit_in(units: str, system: str) -> str | None:
    """The field unit for SI ``units``; None where the value stays as it is."""
    plain = plain_units(units)
    return SHOWN[plain][1] if system == "field" and plain in SHOWN else None


@lru_cache
def shown_scale(unit: str, units: str) -> float:
    """The size of one ``unit`` in SI ``units``."""
    return to_si(f"1 {unit}", units) if unit and unit != units else 1.0


@lru_cache
def _quantities(model: Description) -> dict[str, Quantity]:
    """The quantities of a model by name."""
    quantities = {}
    rows = [(v.name, v.units, v.long_name, v.label) for v in (*model.variables, *model.trace_and_states)]
    rows += [(name, units, long_name, _LABELS.get(name, "")) for name, (units, long_name) in COORDINATES.items()]
    for name, cf, long_name, label in rows:
        units = "" if cf == "1" else plain_units(cf)
        shown = _shown(model, name, units)
        label = label or long_name[:1].upper() + long_name[1:]
        quantities[name] = Quantity(name, long_name, _WORDS.get(name, long_name), label, units, shown)
    choices = choices_of(model)
    for name, (key, units) in further_axes(model).items():
        words = key.removeprefix("drillstring.").removeprefix("parameters.").replace(".", " ").replace("_", " ")
        words = words.replace("stabilizer", "stabiliser")
        shown = _shown(model, name, units)
        choice = key if key in choices else ""
        label = _LABELS.get(name, words[:1].upper() + words[1:])
        quantities[name] = Quantity(name, words, words, label, units, shown, choice)
    return quantities


def _shown(model: Description, name: str, units: str) -> tuple[str, str]:
    """The units of display of a quantity of the model: of one that is no drill string those
    in which it is declared, in place of what engineers of a rig write."""
    own = (units, units)
    return _SHOWN_OF_NAME.get(name) or SHOWN.get(units, own) if model.drills else own


def find(name: str) -> Quantity | None:
    """The quantity with this ``name``, that of a variable or coordinate of a file
    (``wob``, ``operation_wob``) or the dotted key of a number of a study; None if there
    is none. It is that of the script or of the other package whose names are meant
    (:func:`nsdrill.models.registry.spoken`), else of the first model that has one."""
    wanted = dimension_of(short_key(name.replace("operation_", "operation.", 1)))
    own = spoken()
    if own is not None and wanted in _quantities(own):
        return _quantities(own)[wanted]
    return next((quantities[wanted] for _, quantities in of_all(_quantities) if wanted in quantities), None)


def quantity(name: str) -> Quantity:
    """As :func:`find`; KeyError if there is none."""
    found = find(name)
    if found is None:
        raise KeyError(name)
    return found

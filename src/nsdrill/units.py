"""Quantities as people write them ("15 in", "5 klbf", "60 rpm") to SI floats and back.

The text is taken apart by a small grammar, which evaluates nothing, and each unit name is looked up in a table of exact
factors. So the result is the float nearest to the value written: "9 in" is 0.2286 and "5 klbf" is 22241.1080763025.

Angles are a dimension here: without one "1 Hz" would do for "1 rad/s", wrong by 2 pi.
"""

from __future__ import annotations

import difflib
import math
import re
from fractions import Fraction
from functools import lru_cache

from nsdrill.errors import InputError

USUAL: dict[str, tuple[str, ...]] = {
    "m": ("m", "mm", "in", "ft"),
    "N": ("kN", "N", "klbf", "lbf", "tonne_force"),
    "rad/s": ("rad/s", "rpm"),
    "rad": ("rad", "deg"),
    "s": ("s", "min", "h"),
    "m/s": ("m/s", "mm/s", "ft/s"),
    "m/s^2": ("m/s^2", "gravity", "ft/s^2"),
    "kg/m^3": ("kg/m^3", "g/cm^3", "ppg"),
    "Pa": ("Pa", "MPa", "GPa", "psi"),
    "N/m": ("N/m", "kN/m", "MN/m", "lbf/in"),
    "N/m^1.5": ("N/m^1.5", "kN/m^1.5", "MN/m^1.5"),
    "N s/m": ("N*s/m", "kN*s/m", "lbf*s/ft"),
    "N m s/rad": ("N*m*s/rad", "kN*m*s/rad", "ft*lbf*s/rad"),
    "N m": ("N*m", "kN*m", "ft*lbf"),
    "1/s": ("1/s",),
    "s/m": ("s/m", "s/ft"),
    "s/rad": ("s/rad", "s/deg"),
}
"""Units to suggest and to display in, by the SI units of the quantity; SI engineering units first."""

CF = {
    "": "1", "percent": "percent", "m": "m", "N": "N", "rad/s": "rad s-1", "rad": "rad", "s": "s", "m/s": "m s-1",
    "m/s^2": "m s-2", "kg/m^3": "kg m-3", "Pa": "Pa", "N/m": "N m-1", "N/m^1.5": "N m-1.5", "N s/m": "N s m-1",
    "N m s/rad": "N m s rad-1", "N m": "N m", "1/s": "s-1", "s/m": "s m-1", "s/rad": "s rad-1",
}  # fmt: skip
"""Units as the attributes of files have them, by the SI units of a key."""

_PLAIN_OF_CF = {cf: plain for plain, cf in CF.items()}

_LONGEST = 80  # characters; no quantity needs more, and it bounds the work done on hostile input
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_QUANTITY = re.compile(rf"({_NUMBER})\s*(\S.*)?", re.ASCII)
_TOKEN = re.compile(
    r"\s*(?:(?P<name>[A-Za-zµμ°][A-Za-z_]*)|(?P<one>1)(?=\s*/)|(?P<mark>[*/()])|(?P<end>$))", re.ASCII
)
_EXPONENT = re.compile(
    r"\s*(?:\^|\*\*)\s*(?:(?P<plain>[-+]?\d{1,2}(?:\.\d{1,4})?)|\((?P<ratio>-?\d{1,2}(?:/[1-9])?)\))|(?P<bare>-?\d(?:\.\d{1,4})?)",
    re.ASCII,
)
_PLAIN = str.maketrans({"·": "*", "⋅": "*", "×": "*", "∙": "*", "−": "-", "\u00a0": " ", "\u202f": " "})
_SUPERSCRIPT = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")
_SUPERSCRIPTS = re.compile("[⁰¹²³⁴⁵⁶⁷⁸⁹⁻]+")

_PI = Fraction(math.pi)  # the float, so that 60 rpm is the 2 pi of every other program
_DEFINITIONS = f"""
m meter metre = 1 [length]
g gram = 1/1000 [mass]
s sec second = 1 [time]
rad radian = 1 [angle]
pi = {_PI}
min minute = 60 s
h hr hrs hour = 60 min
d day = 24 h
week = 7 d
year yr yrs = 365.25 d
turn revolution rev cycle circle = {2 * _PI} rad
deg degree arcdeg ° = {_PI / 180} rad
arcmin arcminute = 1/60 deg
arcsec arcsecond = 1/60 arcmin
gon grad = {_PI / 200} rad
rpm revolutions_per_minute = 1 rev/min
rps revolutions_per_second = 1 rev/s
Hz hertz = 1 1/s
in inch inches international_inch = 0.0254 m
ft foot feet international_foot = 12 in
yd yard = 3 ft
mi mile = 5280 ft
thou = 1/1000 in
nmi nautical_mile = 1852 m
µ micron = 1/1000000 m
l L liter litre = 1/1000 m^3
cc = 1/1000000 m^3
gal gallon = 231 in^3
oil_barrel oil_bbl = 42 gal
lb pound avoirdupois_pound = 453.59237 g
oz ounce = 1/16 lb
gr grain = 1/7000 lb
ton short_ton = 2000 lb
long_ton = 2240 lb
t tonne metric_ton = 1000000 g
ppg pound_per_gallon = 1 lb/gal
gravity standard_gravity g_0 g_n = 9.80665 m/s^2
slug = 1 lbf*s^2/ft
N newton = 1 kg*m/s^2
dyn dyne = 1/100000 N
gf gram_force = 1 g*gravity
kgf kilogram_force = 1 kg*gravity
tf tonne_force metric_ton_force = 1 t*gravity
lbf pound_force = 1 lb*gravity
ozf ounce_force = 1 oz*gravity
ton_force short_ton_force = 1 ton*gravity
kip = 1000 lbf
pdl poundal = 1 lb*ft/s^2
Pa pascal = 1 N/m^2
bar = 100000 Pa
atm atmosphere standard_atmosphere = 101325 Pa
psi pound_force_per_square_inch = 1 lbf/in^2
ksi = 1000 psi
J joule = 1 N*m
foot_pound ft_lb = 1 ft*lbf
W watt = 1 J/s
hp horsepower = 550 ft*lbf/s
kn kt knot = 1 nmi/h
mph mile_per_hour = 1 mi/h
kph = 1 km/h
mps = 1 m/s
fps = 1 ft/s
"""
_FORCES = {"klb klbs": "klbf", "lb lbs pound pounds": "lbf", "t tonne tonnes": "tonne_force"}
_PREFIXES = {
    name: Fraction(10) ** power for names, power in (
        ("n nano", -9), ("µ μ u micro", -6), ("m milli", -3), ("c centi", -2), ("d deci", -1), ("da deca deka", 1),
        ("h hecto", 2), ("k kilo", 3), ("M mega", 6), ("G giga", 9), ("T tera", 12)) for name in names.split()
}  # fmt: skip

Dimensions = dict[str, Fraction]


class QuantityError(InputError, ValueError):
    """A quantity that cannot be read: what was found, what is allowed, and perhaps what was meant."""

    def __init__(self, found: str, allowed: str, suggestion: str | None = None) -> None:
        self.found, self.allowed, self.suggestion = found, allowed, suggestion
        text = f"found {found}; allowed: {allowed}."
        super().__init__(f"{text} {suggestion}" if suggestion else text)


class Asked(float):
    """An SI value that remembers the ``unit`` in which it was asked for, so that the answer can name it in that."""

    def __new__(cls, value: float, unit: str) -> Asked:
        made = super().__new__(cls, value)
        made.unit = unit
        return made

    unit: str


def asked(text: str, units: str) -> Asked:
    """As :func:`to_si`, and the unit that the text names."""
    value = to_si(text, units)
    match = _QUANTITY.fullmatch(_tidy(text))
    return Asked(value, match[2] if match else units)


def to_si(text: str, units: str) -> float:
    """The value of ``text`` in the SI ``units`` ("m", "N s/m", "N/m^1.5", ...).

    Raises :class:`QuantityError` where the text is not one finite number with a unit of the same dimension.
    """
    match = _QUANTITY.fullmatch(_tidy(text)) if len(text) <= _LONGEST else None
    if match is None:
        raise QuantityError(quoted(text), allowed_units(units), _comma_hint(text))
    number, unit = match.groups()
    if unit is None:
        raise QuantityError(f"{quoted(text)}, a number without a unit", allowed_units(units))
    factor, dimensions = _meaning(unit, text, units)
    base, target = _meaning(units, units, units)
    if dimensions != target:
        raise _wrong_dimension(text, units, unit, dimensions)
    value = float(number)  # first as a float: a fraction of 1e999999999 would take for ever
    if math.isinf(value) or (value == 0.0 and re.search("[1-9]", re.split("[eE]", number)[0])):
        raise QuantityError(f"{quoted(text)}, beyond the range of floating-point numbers", allowed_units(units))
    try:
        return float(Fraction(number) * factor / base) + 0.0  # + 0.0: no negative zero
    except OverflowError:
        found = f"{quoted(text)}, beyond the range of floating-point numbers"
        raise QuantityError(found, allowed_units(units)) from None


def from_si(value: float, units: str) -> float:
    """An SI ``value`` expressed in ``units``, any name that :func:`to_si` reads. NaN and infinities stay."""
    if not math.isfinite(value):
        return value
    factor, _ = _meaning(units, units, units)
    return float(Fraction(value) / factor)


def format_quantity(value: float, units: str, digits: int = 6) -> str:
    """An SI ``value`` for people, in ``units`` and to ``digits`` significant digits: ``format_quantity(22240, "kN")``
    is "22.24 kN"."""
    return f"{from_si(value, units):.{digits}g} {units}"


def readable(value: float, units: str, digits: int = 6) -> str:
    """An SI ``value`` for people, in the first of its usual units in which it is neither large nor small:
    ``readable(2.2e4, "N")`` is "22 kN"; a plain number stays one. A value that was asked for in a unit is in that."""
    if units in ("", "percent"):
        return f"{value:.{digits}g}"
    if isinstance(value, Asked):
        return format_quantity(value, value.unit, digits)
    candidates = USUAL.get(units, (units,))
    fitting = [unit for unit in candidates if 1.0 <= abs(from_si(value, unit)) < 1e4]
    return format_quantity(value, (fitting or candidates)[0], digits)


def plain_units(cf: str) -> str:
    """The units of an attribute as :func:`to_si` reads them."""
    return _PLAIN_OF_CF.get(cf, cf)


def exact_text(value: float, units: str) -> str:
    """The text that :func:`to_si` reads back as exactly ``value``, in that of the usual units that needs the fewest
    digits: 0.2286 m is "9 in"."""
    candidates = []
    for unit in USUAL.get(units, ()):
        number = f"{from_si(value, unit):.12g}"
        if (value == 0.0 or 1.0 <= abs(float(number)) < 1e4) and to_si(f"{number} {unit}", units) == value:
            candidates.append((len(number.replace(".", "").strip("-0")), f"{number} {unit}"))
    if not candidates:
        return f"{value!r} {units.replace(' ', '*')}"
    return min(candidates, key=lambda candidate: candidate[0])[1]


def allowed_units(units: str) -> str:
    """What may stand where a quantity of these SI units is wanted, in words."""
    names = USUAL.get(units, (units.replace(" ", "*"),))
    head, last = ", ".join(names[:-1]), names[-1]
    return f"a number with its unit ({head} or {last})" if head else f"a number with its unit ({last})"


def quoted(text: str) -> str:
    """The text as found, in quotes, fit for one line of a message."""
    if len(text) > _LONGEST:
        return f"a text of {len(text)} characters that begins {text[:30]!r}"
    return repr(text)


def _comma_hint(text: str) -> str | None:
    if re.match(r"\s*[-+]?\d+,\d", text[:_LONGEST]):
        return "Write a decimal point and no thousands separators."
    return None


def _tidy(text: str) -> str:
    """Signs that people paste (·, ², −) in plain ASCII."""
    plain = text.translate(_PLAIN).strip()
    return _SUPERSCRIPTS.sub(lambda match: "^" + match.group().translate(_SUPERSCRIPT), plain)


def _wrong_dimension(text: str, units: str, unit: str, dimensions: Dimensions) -> QuantityError:
    if units == "N" and dimensions == {"[mass]": 1}:
        meant = next((force for masses, force in _FORCES.items() if unit in masses.split()), None)
        hint = f" Did you mean {meant}?" if meant else ""
        return QuantityError(
            f"{quoted(text)}, a mass", allowed_units(units),
            f"'{unit}' is a unit of mass, not of force: write kN, klbf, lbf or tonne_force.{hint}",
        )
    if units == "rad/s" and dimensions == {"[time]": -1}:
        return QuantityError(
            f"{quoted(text)}, an ambiguous speed of rotation", allowed_units(units),
            f"'{unit}' does not say whether it counts revolutions or radians: write rpm or rad/s.",
        )
    if units == "m/s^2" and dimensions == {"[mass]": 1}:
        return QuantityError(
            f"{quoted(text)}, a mass", allowed_units(units), "g is the gram here: write gravity, as in 0.25 gravity.")
    return QuantityError(f"{quoted(text)}, in units of {_in_words(dimensions)}", allowed_units(units))


def _in_words(dimensions: Dimensions) -> str:
    def power(name: str, exponent: Fraction) -> str:
        size = abs(exponent)
        return name.strip("[]") + ("" if size == 1 else f"^{float(size):g}")

    above = " ".join(power(name, e) for name, e in sorted(dimensions.items()) if e > 0)
    below = " ".join(power(name, e) for name, e in sorted(dimensions.items()) if e < 0)
    if not below:
        return above or "no dimension"
    return f"{above or '1'}/{below}" if " " not in below else f"{above or '1'}/({below})"


@lru_cache(maxsize=1)
def _table() -> dict[str, tuple[Fraction, str]]:
    """What each unit name stands for: how many of which compound unit; a dimension stands for itself."""
    table: dict[str, tuple[Fraction, str]] = {}
    for line in _DEFINITIONS.strip().splitlines():
        names, _, meaning = line.partition(" = ")
        number, _, unit = meaning.partition(" ")
        table |= dict.fromkeys(names.split(), (Fraction(number), unit))
    return table


def _meaning(unit: str, text: str, wanted: str) -> tuple[Fraction, Dimensions]:
    """Factor to SI and dimensions of a compound unit; errors speak of ``text`` and ``wanted``."""
    try:
        return _evaluate(_tidy(unit))
    except KeyError as error:
        name = str(error.args[0])
        usual = USUAL.get(wanted, ())
        folded = {candidate.lower(): candidate for candidate in usual}
        near = difflib.get_close_matches(unit.lower(), folded, n=1, cutoff=0.5)
        hint = f"Did you mean {folded[near[0]]}? (Capitals matter.)" if near else None
        found = f"{quoted(text)}, with an unknown unit '{name[:30]}'"
        raise QuantityError(found, allowed_units(wanted), hint) from None
    except SyntaxError:
        raise QuantityError(f"{quoted(text)}, whose unit cannot be read", allowed_units(wanted)) from None


@lru_cache(maxsize=1024)
def _evaluate(unit: str) -> tuple[Fraction, Dimensions]:
    """KeyError(name) for an unknown unit name, SyntaxError for anything outside the grammar."""
    factor, dimensions = Fraction(1), Dimensions()
    for name, exponent in _powers(unit):
        base, parts = _named(name)
        factor *= Fraction(base**exponent)  # exact for whole exponents and for units of size one
        for part, power in parts.items():
            dimensions[part] = dimensions.get(part, Fraction(0)) + power * exponent
    return factor, {part: power for part, power in dimensions.items() if power}


@lru_cache(maxsize=1024)
def _named(name: str) -> tuple[Fraction, Dimensions]:
    """Factor to SI and dimensions of a unit name, with a prefix or in the plural perhaps; KeyError(name) for none."""
    # No plural of a short symbol: "Ns" is no number of newtons.
    for singular in (name, name.removesuffix("s") if len(name) > 3 or name == "lbs" else name):
        for length in range(len(name)):
            prefix, unit = singular[:length], singular[length:]
            if unit in _table() and (not prefix or prefix in _PREFIXES):
                number, meaning = _table()[unit]
                number *= _PREFIXES.get(prefix, Fraction(1))
                if meaning.startswith("["):
                    return number, {meaning: Fraction(1)}
                factor, dimensions = _evaluate(meaning) if meaning else (Fraction(1), Dimensions())
                return number * factor, dimensions
    raise KeyError(name)


def _powers(unit: str) -> list[tuple[str, Fraction]]:
    """The grammar: names with exponents, joined by ``*``, ``/`` or a space, left to right, with parentheses.

    ``N*m*s/rad``, ``kg/m^3``, ``kg/m3``, ``N m s/rad``, ``1/s``, ``N/(m/s)``, ``N/m^(3/2)``.
    """
    found: list[tuple[str, Fraction]] = []
    signs = [1]  # sign of the enclosing group, one entry per open parenthesis
    place, sign, after_operand = 0, 1, False
    while True:
        token = _TOKEN.match(unit, place)
        if token is None:
            raise SyntaxError(unit)
        place = token.end()
        mark = token["mark"]
        if token["name"] is not None or token["one"] is not None:
            if token["name"] is not None:
                exponent = _EXPONENT.match(unit, place)
                power = Fraction(1)
                if exponent is not None:
                    place = exponent.end()
                    power = Fraction(exponent["plain"] or exponent["ratio"] or exponent["bare"])
                if abs(power) > 9:
                    raise SyntaxError(unit)
                found.append((token["name"], power * sign * signs[-1]))
            sign, after_operand = 1, True
        elif mark == "(":
            signs.append(signs[-1] * sign)
            sign, after_operand = 1, False
        elif not after_operand:
            raise SyntaxError(unit)
        elif mark == ")":
            if len(signs) == 1:
                raise SyntaxError(unit)
            signs.pop()
        elif mark is not None:
            sign, after_operand = (-1 if mark == "/" else 1), False
        else:
            break
    if len(signs) != 1 or not found:
        raise SyntaxError(unit)
    return found

"""Quantities with units ("15 in", "5 klbf", "60 rpm") to SI floats and back.

The text is parsed by a small grammar, without evaluating any code, and each unit name
is looked up in a table of exact factors. So the result is the float nearest to the
value written: "9 in" is 0.2286 and "5 klbf" is 22241.1080763025. Sizes may be written as on a drill
floor: ``8 1/2 in``, ``9-5/8"``.

Angle is a dimension here: otherwise "1 Hz" would be accepted for "1 rad/s", wrong by a
factor of 2 pi.
"""

from __future__ import annotations

import difflib
import math
import re
from fractions import Fraction
from functools import lru_cache
from itertools import takewhile

from nsdrill.errors import InputError
from nsdrill.unit_table import CF, FIELD, KINDS, OF_BOTH, PREFIXES, TABLE, USUAL

_PLAIN_OF_CF = {cf: plain for plain, cf in CF.items()}

_LONGEST = 80  # characters: bounds the work on hostile input
_NUMBER = r"[-+]?(?:(?:\d+[ -])?\d+/\d+|(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)"
_QUANTITY = re.compile(rf"({_NUMBER})\s*([^\s,].*)?", re.ASCII)
# 60-180 rpm, 60 rpm to 180 rpm, 10..40 klbf
_RANGE = re.compile(
    rf"(?P<low>{_NUMBER})\s*(?P<first>[^\s\d]*?)\s*(?:to|\.\.+|[-–—…])\s*(?P<high>{_NUMBER})\s*(?P<last>[A-Za-zµμ°%].*)?",
    re.ASCII,
)
_TOKEN = re.compile(
    r"\s*(?:(?P<name>[A-Za-zµμ°][A-Za-z_]*)|(?P<one>1)(?=\s*/)|(?P<operator>[*/()])|(?P<end>$))", re.ASCII
)
_EXPONENT = re.compile(
    r"\s*(?:\^|\*\*)\s*(?:(?P<plain>[-+]?\d{1,2}(?:\.\d{1,4})?)|\((?P<ratio>-?\d{1,2}(?:/[1-9])?)\))|(?P<bare>-?\d(?:\.\d{1,4})?)",
    re.ASCII,
)
_PLAIN = str.maketrans(
    {"·": "*", "⋅": "*", "×": "*", "∙": "*", "−": "-", "\u00a0": " ", "\u202f": " "}
    | {"½": " 1/2", "¼": " 1/4", "¾": " 3/4", "⅛": " 1/8", "⅜": " 3/8", "⅝": " 5/8", "⅞": " 7/8"}
)
# 8.5" and 65', as people write inches and feet
_MARKS = {'"': " in", "″": " in", "”": " in", "'": " ft", "′": " ft", "’": " ft"}
_SUPERSCRIPT = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")
_SUPERSCRIPTS = re.compile("[⁰¹²³⁴⁵⁶⁷⁸⁹⁻]+")

_FORCES = {"klb klbs": "klbf", "lb lbs pound pounds": "lbf", "t tonne tonnes": "tonne_force"}

JOINED = re.compile(r"(?<=[A-Za-z])[.\-·](?=[A-Za-z])")
"""What joins units as rigs write them: kft.lbf and kft-lbf are kft*lbf."""
# Units of logs that are none of the table, in small letters and without signs.
_RIG_UNITS = {
    name: unit
    for unit, names in {
        "kN": "kn",
        "daN": "dan",
        "kdaN": "kdan",
        "klbf": "klbf klb klbs klbsf 1000lbf 1000lb 1000lbs kip kips",
        "lbf": "lbf lb lbs lbsf",
        "tonne_force": "tonf tonneforce",
        "kkgf": "kkgf",
        "N*m": "nm",
        "kN*m": "knm",
        "ft*lbf": "ftlbf ftlb ftlbs ftlbsf lbft lbfft lbsft lbffeet",
        "kft*lbf": "kftlbf kftlb kftlbs kftlbsf klbft klbfft klbsft 1000ftlb 1000ftlbf 1000ftlbs kflb kflbs",
        "rpm": "rpm revmin rmin cmin 1min min1 min−1 upm umin",
        "s": "s sec secs seconds",
        "min": "min",
        "h": "h hr hrs",
        "m": "m",
        "ft": "ft feet",
        "ft/h": "fthr fth fph",
        "m/h": "mhr mh",
        "psi": "psi",
    }.items()
    for name in names.split()
}

Dimensions = dict[str, Fraction]


class QuantityError(InputError, ValueError):
    """A quantity that cannot be read: what was found, what is allowed, and possibly
    what was meant."""

    def __init__(self, found: str, allowed: str, suggestion: str | None = None) -> None:
        self.found, self.allowed, self.suggestion = found, allowed, suggestion
        text = f"found {found}; allowed: {allowed}."
        super().__init__(f"{text} {suggestion}" if suggestion else text)


class WithUnit(float):
    """An SI value with the ``unit`` in which the user wrote it, in which answers give
    it."""

    def __new__(cls, value: float, unit: str) -> WithUnit:
        instance = super().__new__(cls, value)
        instance.unit = unit
        return instance

    def __getnewargs__(self) -> tuple[float, str]:  # type: ignore[override]  # to be copied
        return float(self), self.unit

    unit: str


def parse_with_unit(text: str, units: str) -> WithUnit:
    """As :func:`to_si`, and the unit that the text names."""
    value = to_si(text, units)
    match = _QUANTITY.fullmatch(_tidy(text))
    return WithUnit(value, match[2] if match else units)


def system_of(text: str) -> str | None:
    """The system of units, "field" or "si", in which ``text`` is written: of the field if
    any of its units is; None for what is no quantity, and for units of both systems, as
    rpm and s."""
    match = _QUANTITY.fullmatch(_tidy(text)) if len(text) <= _LONGEST else None
    if match is None or match[2] is None:
        return None
    try:
        names = {_parts_of(name)[1] for name, _ in _powers(match[2])}
    except (KeyError, SyntaxError):
        return None
    return "field" if names & FIELD else "si" if names - OF_BOTH else None


def to_si(text: str, units: str) -> float:
    """The value of ``text`` in the SI ``units`` ("m", "N s/m", "N/m^1.5", ...).

    Raises :class:`QuantityError` where the text is not one finite number with a unit of
    the same dimension.
    """
    match = _QUANTITY.fullmatch(_tidy(text)) if len(text) <= _LONGEST else None
    if match is None:
        raise QuantityError(quoted(text), allowed_units(units), form_hint(text, units) or _odd_hint(text))
    number, unit = match.groups()
    if unit is None:
        raise QuantityError(f"{quoted(text)}, a number without a unit", allowed_units(units))
    factor, dimensions = _factor_and_dimensions(unit, text, units)
    base, target = _factor_and_dimensions(units, units, units)
    if dimensions != target:
        raise _wrong_dimension(text, units, unit, dimensions)
    if counts_cycles(unit) and not counts_cycles(units):
        raise QuantityError(
            f"{quoted(text)}, a number of cycles in a second",
            allowed_units(units),
            f"'{unit}' does not say whether a cycle is 1 or 2 pi here: write 1/s.",
        )
    try:
        return float(_exact(number) * factor / base) + 0.0  # + 0.0: no negative zero
    except ValueError:
        found = f"{quoted(text)}, a whole number and a fraction that is not below one"
        raise QuantityError(found, allowed_units(units)) from None
    except ZeroDivisionError:
        raise QuantityError(f"{quoted(text)}, a fraction over zero", allowed_units(units)) from None
    except OverflowError:
        found = f"{quoted(text)}, beyond the range of floating-point numbers"
        raise QuantityError(found, allowed_units(units)) from None


def _exact(number: str) -> Fraction:
    """The number of a text, ``8.5``, ``8.5e3``, ``8 1/2`` or ``1/2``; OverflowError beyond
    the range of floating-point numbers, ValueError for ``8 3/2``."""
    if "/" in number:
        whole, _, part = number.lstrip("+-").replace("-", " ").rpartition(" ")
        if whole and Fraction(part) >= 1:
            raise ValueError(number)
        size = Fraction(whole or 0) + Fraction(part)
        return -size if number.startswith("-") else size
    value = float(number)  # first as a float: a Fraction of 1e999999999 would not end
    if math.isinf(value) or (value == 0.0 and re.search("[1-9]", re.split("[eE]", number)[0])):
        raise OverflowError(number)
    return Fraction(number)


def counts_cycles(units: str) -> bool:
    """Whether such a unit is one of frequency by its name, as Hz is, and 1/s is not."""
    return bool(units) and bool(cycles_in(units))


def cycles_in(units: str) -> Fraction:
    """The power of cycles in such a unit, one in Hz: a cycle is no number, but 2 pi rad."""
    return sum((power for name, power in _powers(_tidy(units)) if _parts_of(name)[1] in ("Hz", "hertz")), Fraction(0))


def is_unit(text: str) -> bool:
    """Whether ``text`` is a unit, or percent, also as rigs write it."""
    return text in ("%", "percent") or _squeezed(text) in _RIG_UNITS or dimensions_of(JOINED.sub("*", text)) is not None


def _squeezed(text: str) -> str:
    """The letters of a unit of a log, by which :data:`_RIG_UNITS` knows it."""
    return re.sub(r"[\s.\-_*·⋅^()/]", "", text[:_LONGEST]).lower()


def dimensions_of(unit: str) -> Dimensions | None:
    """The powers of length, mass, time, angle and current in a unit, None where it is not
    known."""
    try:
        return _evaluate(_tidy(unit))[1] if 0 < len(unit) <= _LONGEST else None
    except (KeyError, SyntaxError):
        return None


def rig_unit(text: str, units: str) -> tuple[float, str] | None:
    """The SI value of one unit of a log, and how that unit is written here; None where it
    is none of a quantity in SI ``units``. Exponents, dots and capitals of rigs are read:
    ``KFT-LBS`` is kft*lbf. A pound is one of force where a force or a torque is meant,
    and 1/min of a rotation are revolutions; kilograms and tonnes are masses."""
    joined = JOINED.sub("*", text.strip())
    if (found := dimensions_of(joined)) is not None and found == _evaluate(_tidy(units))[1]:
        return to_si(f"1 {joined}", units), joined
    if (unit := _RIG_UNITS.get(_squeezed(text))) and dimensions_of(unit) == _evaluate(_tidy(units))[1]:
        return to_si(f"1 {unit}", units), unit
    return None


def si_factor(units: str) -> float:
    """How much one of these units is in SI. QuantityError where they are not known."""
    return float(_factor_and_dimensions(units, units, units)[0])


def from_si(value: float, units: str) -> float:
    """An SI ``value`` expressed in ``units``, any name that :func:`to_si` reads. NaN
    and infinities stay, and what is beyond the range of floating-point numbers in
    ``units`` is infinite."""
    if not math.isfinite(value):
        return value
    factor, _ = _factor_and_dimensions(units, units, units)
    try:
        return float(Fraction(value) / factor)
    except OverflowError:
        return math.copysign(math.inf, value)


def rounded_from_si(value: float, units: str) -> float:
    """As :func:`from_si`, to the 15 digits of which a float is sure: 8 klbf stay 8 klbf,
    and are not the 7.999999999999999 that the nearest float in newtons is."""
    return float(f"{from_si(value, units):.15g}")


def format_quantity(value: float, units: str, digits: int = 6) -> str:
    """An SI ``value`` for people, in ``units`` and to ``digits`` significant digits:
    ``format_quantity(22240, "kN")`` is "22.24 kN"."""
    return f"{from_si(value, units):.{digits}g} {units}"


def readable(value: float, units: str, digits: int = 6) -> str:
    """An SI ``value`` as text, in the first of its usual units of SI in which the number
    is neither large nor small, else in the first: ``readable(2.2e4, "N")`` is "22 kN"; a
    plain number has no unit. An :class:`WithUnit` value is given in its own unit."""
    if units in ("", "percent"):
        return f"{value:.{digits}g}"
    if isinstance(value, WithUnit):
        return format_quantity(value, value.unit, digits)
    candidates = _usual_of_si(units)
    fitting = [unit for unit in candidates if 1.0 <= abs(from_si(value, unit)) < 1e4]
    return format_quantity(value, (fitting or candidates)[0], digits)


@lru_cache
def _usual_of_si(units: str) -> tuple[str, ...]:
    """The usual units for ``units`` that stand before the first one of the field."""
    usual = USUAL.get(units, (units,))
    return tuple(takewhile(lambda unit: system_of(f"1 {unit}") != "field", usual)) or usual


def plain_units(cf: str) -> str:
    """The units of a file's attribute in the form that :func:`to_si` reads."""
    return _PLAIN_OF_CF.get(cf, cf)


def cf_units(units: str) -> str:
    """The units of a file's attribute for SI ``units``, which :func:`plain_units` gives back;
    what a script names beyond the usual ones stands as it is, as UDUNITS reads it."""
    return CF.get(units, units)


def exact_text(value: float, units: str) -> str:
    """The text that :func:`to_si` reads back as exactly ``value``, in the usual unit
    that needs the fewest digits: 0.2286 m is "9 in"; and where it is small or large in
    all of them, the fewest characters: 0.0002 m is "0.2 mm"."""
    candidates = []
    for unit in USUAL.get(units, ()):
        number = f"{from_si(value, unit):.12g}"
        handy = value == 0.0 or 1.0 <= abs(float(number)) < 1e4
        if (handy or 1e-4 <= abs(float(number)) < 1e6) and to_si(f"{number} {unit}", units) == value:
            digits = len(number.replace(".", "").strip("-0")) if handy else len(number)
            candidates.append((not handy, digits, f"{number} {unit}"))
    if not candidates:
        return f"{value!r} {units.replace(' ', '*')}"
    return min(candidates, key=lambda candidate: candidate[:2])[2]


def allowed_units(units: str) -> str:
    """What is allowed for a quantity of these SI units, in words."""
    names = USUAL.get(units, (units.replace(" ", "*"),))
    head, last = ", ".join(names[:-1]), names[-1]
    return f"a number with its unit ({head} or {last})" if head else f"a number with its unit ({last})"


def quoted(text: str) -> str:
    """The text in quotes, shortened to fit in one line of a message."""
    if len(text) > _LONGEST:
        return f"a text of {len(text)} characters that begins {text[:30]!r}"
    return repr(text)


def form_hint(text: str, units: str) -> str | None:
    """What to write, for a quantity in SI ``units``, in place of a range or of numbers
    with commas."""
    found = _RANGE.fullmatch(re.sub(r"(?<=\d),(?=\d{3}(?!\d))", "", _tidy(text[:_LONGEST])))
    if found is None:
        return _comma_hint(text, units)
    last = _as_force(found["last"] or found["first"] or ("UNIT" if units else ""), units)
    first = _as_force(found["first"], units) or last
    ends = f"from: {found['low']} {first}".rstrip(), f"to: {found['high']} {last}".rstrip()
    return f"A range stands under sweep: {{{', '.join(ends)}, points: 13}}."


def _comma_hint(text: str, units: str) -> str | None:
    """What to write in place of a number with commas, or of several: 5.5 klbf, 11482 ft,
    0.5, or a list."""
    if text.rstrip()[-1:] in (",", ";"):
        return f"Leave out the {text.rstrip()[-1]} at the end."
    parts = text[:_LONGEST].split(",")
    if len(parts) < 2 or not re.match(r"\s*[-+]?\d+", text):
        return None
    spaced = all(part[:1].isspace() and not re.search("[A-Za-z]", part) for part in parts[1:])
    if (spaced or re.search("[A-Za-z]", parts[0])) and all(_QUANTITY.fullmatch(_tidy(part)) for part in parts):
        listed = ", ".join(part.strip() for part in parts)
        return f"A list of values stands in brackets: [{listed}]."
    found = re.fullmatch(r"\s*([-+]?\d+(?:,\d+)+)(\.\d+)?\s*([^\s\d,].*)?", text[:_LONGEST])
    if found is None:
        return "Write a decimal point, no thousands separators, and a list of values in brackets."
    number, decimals, unit = found[1], found[2] or "", f" {_as_force(found[3] or '', units)}".rstrip()
    joined, pointed = number.replace(",", ""), number.replace(",", ".")
    if not re.fullmatch(r"[-+]?[1-9]\d{0,2}(,\d{3})+", number):  # 5,5 are no thousands
        return f"Write a decimal point: {pointed}{unit}." if number.count(",") == 1 else None
    if number.count(",") > 1 or decimals:
        return f"Write no thousands separators: {joined}{decimals}{unit}."
    return f"Write {joined}{unit} without a thousands separator, or {pointed}{unit} with a decimal point."


def _odd_hint(text: str) -> str | None:
    """What in a text is no part of a quantity: a comment, or a character from elsewhere."""
    if "#" in text:
        return "A comment begins with a blank and #."
    odd = next((char for char in _tidy(text[:_LONGEST]) if not (char.isascii() or char in "µμ°")), None)
    return f"It has the character {ascii(odd)[1:-1]} (U+{ord(odd):04X}): type it anew." if odd else None


def _tidy(text: str) -> str:
    """``text`` in plain ASCII, without typographic signs (·, ², −, ½), and with ``in``
    and ``ft`` for the marks of inches and feet, and rpm for r/min, as ISO 80000 has it, and c/min, as
    WITSML."""
    plain = text.translate(_PLAIN).strip()
    if plain[-1:] in _MARKS and re.search(r"\d\s*$", plain[:-1], re.ASCII):
        plain = plain[:-1] + _MARKS[plain[-1]]
    plain = re.sub(r"\b[rc]/min\b", "rpm", plain)
    return _SUPERSCRIPTS.sub(lambda match: "^" + match.group().translate(_SUPERSCRIPT), plain)


def _wrong_dimension(text: str, units: str, unit: str, dimensions: Dimensions) -> QuantityError:
    if units == "N" and dimensions == {"[mass]": 1}:
        meant = _as_force(unit, units)
        hint = f" Did you mean {meant}?" if meant != unit else ""
        return QuantityError(
            f"{quoted(text)}, a mass",
            allowed_units(units),
            f"'{unit}' is a unit of mass, not of force: write kN, klbf, lbf or tonne_force.{hint}",
        )
    if units == "rad/s" and dimensions == {"[time]": -1}:
        return QuantityError(
            f"{quoted(text)}, an ambiguous speed of rotation",
            allowed_units(units),
            f"'{unit}' does not say whether it counts revolutions or radians: write rpm or rad/s.",
        )
    if units == "m/s^2" and dimensions == {"[mass]": 1}:
        return QuantityError(
            f"{quoted(text)}, a mass", allowed_units(units), "g is the gram here: write gravity, as in 0.25 gravity."
        )
    return QuantityError(
        f"{quoted(text)}, in units of {_in_words(dimensions)}",
        allowed_units(units),
        _pounds(units, unit, dimensions) or _other_capitals(units, unit),
    )


def _as_force(unit: str, units: str) -> str:
    """The unit of force that is meant by a ``unit`` of mass where newtons are needed; any
    other unit as it is."""
    return next((force for masses, force in _FORCES.items() if units == "N" and unit in masses.split()), unit)


def _other_capitals(units: str, unit: str) -> str | None:
    """The suggestion where a usual unit is written with other capitals, kn for kN."""
    meant = [usual for usual in USUAL.get(units, ()) if usual.lower() == unit.lower()]
    return f"Did you mean {meant[0]}? (Capitals matter.)" if meant else None


def _pounds(units: str, unit: str, dimensions: Dimensions) -> str | None:
    """The suggestion where a pound as a mass is written for a pound as a force: ft*lbf
    for ft*lb."""
    wanted = _evaluate(_tidy(units))[1]
    force, mass = _evaluate("N")[1], {"[mass]": Fraction(1)}
    names = {*dimensions, *force}
    as_force = {n: dimensions.get(n, Fraction(0)) + force.get(n, Fraction(0)) - mass.get(n, Fraction(0)) for n in names}
    if {n: power for n, power in as_force.items() if power} != wanted or not re.search(r"lbs?\b", unit):
        return None
    meant = re.sub(r"lbs?\b", "lbf", unit)
    return f"A pound is a mass here: write {meant}."


def kind_of(units: str) -> str:
    """The kind of a quantity with these SI units, in words: "force" for N; the units
    themselves if there is no word."""
    return KINDS.get(units, units)


def _in_words(dimensions: Dimensions) -> str:
    for units, kind in KINDS.items():
        if _evaluate(_tidy(units))[1] == dimensions:
            return kind

    def power(name: str, exponent: Fraction) -> str:
        size = abs(exponent)
        return name.strip("[]") + ("" if size == 1 else f"^{float(size):g}")

    numerator = " times ".join(power(name, e) for name, e in sorted(dimensions.items()) if e > 0)
    denominator = " times ".join(power(name, e) for name, e in sorted(dimensions.items()) if e < 0)
    if not denominator:
        return numerator or "no dimension"
    return f"{numerator or '1'}/{denominator}" if " " not in denominator else f"{numerator or '1'}/({denominator})"


def _factor_and_dimensions(unit: str, text: str, wanted: str) -> tuple[Fraction, Dimensions]:
    """Factor to SI and dimensions of a compound unit. QuantityError names ``text`` and
    the SI units ``wanted``."""
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
        found = f"{quoted(text)}, whose unit cannot be read"
        raise QuantityError(found, allowed_units(wanted), form_hint(text, wanted) or _odd_hint(text)) from None


@lru_cache(maxsize=1024)
def _evaluate(unit: str) -> tuple[Fraction, Dimensions]:
    """KeyError(name) for an unknown unit name, SyntaxError for anything outside the
    grammar."""
    factor, dimensions = Fraction(1), Dimensions()
    for name, exponent in _powers(unit):
        base, parts = _unit(name)
        factor *= Fraction(base**exponent)  # exact for integer exponents and for factors of one
        for part, power in parts.items():
            dimensions[part] = dimensions.get(part, Fraction(0)) + power * exponent
    return factor, {part: power for part, power in dimensions.items() if power}


@lru_cache(maxsize=1024)
def _unit(name: str) -> tuple[Fraction, Dimensions]:
    """Factor to SI and dimensions of a unit name, possibly with a prefix or in the
    plural; KeyError(name) if there is none."""
    prefix, unit = _parts_of(name)
    number, definition = TABLE[unit]
    number *= PREFIXES.get(prefix, Fraction(1))
    if definition.startswith("["):
        return number, {definition: Fraction(1)}
    factor, dimensions = _evaluate(definition) if definition else (Fraction(1), Dimensions())
    return number * factor, dimensions


def _parts_of(name: str) -> tuple[str, str]:
    """The prefix and the name in the table of a unit name; KeyError(name) if there is
    none."""
    # Short symbols have no plural: "Ns" is not several newtons.
    for singular in (name, name.removesuffix("s") if len(name) > 3 or name == "lbs" else name):
        for length in range(len(name)):
            prefix, unit = singular[:length], singular[length:]
            if unit in TABLE and (not prefix or prefix in PREFIXES):
                return prefix, unit
    raise KeyError(name)


def _powers(unit: str) -> list[tuple[str, Fraction]]:
    """The grammar: names with exponents, joined by ``*``, ``/`` or a space, left to
    right, with parentheses.

    ``N*m*s/rad``, ``kg/m^3``, ``kg/m3``, ``N m s/rad``, ``1/s``, ``N/(m/s)``,
    ``N/m^(3/2)``.
    """
    found: list[tuple[str, Fraction]] = []
    signs = [1]  # sign of the enclosing group, one entry per open parenthesis
    position, sign, after_operand = 0, 1, False
    while True:
        token = _TOKEN.match(unit, position)
        if token is None:
            raise SyntaxError(unit)
        position = token.end()
        operator = token["operator"]
        if token["name"] is not None or token["one"] is not None:
            if token["name"] is not None:
                exponent = _EXPONENT.match(unit, position)
                power = Fraction(1)
                if exponent is not None:
                    position = exponent.end()
                    power = Fraction(exponent["plain"] or exponent["ratio"] or exponent["bare"])
                if abs(power) > 9:
                    raise SyntaxError(unit)
                found.append((token["name"], power * sign * signs[-1]))
            sign, after_operand = 1, True
        elif operator == "(":
            signs.append(signs[-1] * sign)
            sign, after_operand = 1, False
        elif not after_operand:
            raise SyntaxError(unit)
        elif operator == ")":
            if len(signs) == 1:
                raise SyntaxError(unit)
            signs.pop()
        elif operator is not None:
            sign, after_operand = (-1 if operator == "/" else 1), False
        else:
            break
    if len(signs) != 1 or not found:
        raise SyntaxError(unit)
    return found

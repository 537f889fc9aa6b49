"""The units in which a quantity may be written: a table of definitions with exact
factors; and by the SI units of a quantity its usual units, its kind, and its units in
files."""

from __future__ import annotations

import math
from fractions import Fraction

_PI = Fraction(math.pi)  # the float, so that 60 rpm is the 2 pi of every other program
_DEFINITIONS = f"""
m meter metre = 1 [length]
g gram = 1/1000 [mass]
s sec second = 1 [time]
rad radian = 1 [angle]
pi = {_PI}
min minute MIN = 60 s
h hr hrs hour = 60 min
d day = 24 h
week = 7 d
year yr yrs = 365.25 d
turn revolution rev cycle circle = {2 * _PI} rad
deg degree arcdeg ° = {_PI / 180} rad
arcmin arcminute = 1/60 deg
arcsec arcsecond = 1/60 arcmin
gon grad = {_PI / 200} rad
rpm RPM revolutions_per_minute = 1 rev/min
rps revolutions_per_second = 1 rev/s
Hz hertz = 1 1/s
in inch inches international_inch IN = 0.0254 m
ft foot feet international_foot FT = 12 in
yd yard = 3 ft
mi mile = 5280 ft
thou = 1/1000 in
nmi nautical_mile = 1852 m
µ micron = 1/1000000 m
l L liter litre = 1/1000 m^3
cc = 1/1000000 m^3
gal gallon = 231 in^3
oil_barrel oil_bbl = 42 gal
lb lbm pound avoirdupois_pound = 453.59237 g
oz ounce = 1/16 lb
gr grain = 1/7000 lb
ton short_ton = 2000 lb
long_ton = 2240 lb
t tonne metric_ton = 1000000 g
ppg pound_per_gallon PPG = 1 lb/gal
pcf pound_per_cubic_foot PCF = 1 lb/ft^3
sg SG specific_gravity = 1000 kg/m^3
gravity standard_gravity g_0 g_n = 9.80665 m/s^2
slug = 1 lbf*s^2/ft
N newton = 1 kg*m/s^2
daN = 10 N
Nm newton_metre newton_meter = 1 N*m
dyn dyne = 1/100000 N
gf gram_force = 1 g*gravity
kgf kilogram_force = 1 kg*gravity
tf tonne_force metric_ton_force = 1 t*gravity
lbf pound_force LBF = 1 lb*gravity
KLBF = 1000 lbf
ozf ounce_force = 1 oz*gravity
ton_force short_ton_force = 1 ton*gravity
kip = 1000 lbf
pdl poundal = 1 lb*ft/s^2
Pa pascal = 1 N/m^2
bar = 100000 Pa
atm atmosphere standard_atmosphere = 101325 Pa
psi pound_force_per_square_inch PSI = 1 lbf/in^2
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
A ampere amp = 1 [current]
V volt = 1 W/A
ohm = 1 V/A
H henry = 1 V*s/A
"""
PREFIXES = {
    name: Fraction(10) ** power
    for names, power in (
        ("n nano", -9),
        ("µ μ u micro", -6),
        ("m milli", -3),
        ("c centi", -2),
        ("d deci", -1),
        ("da deca deka", 1),
        ("h hecto", 2),
        ("k kilo", 3),
        ("M mega", 6),
        ("G giga", 9),
        ("T tera", 12),
    )
    for name in names.split()
}


def _names(text: str) -> frozenset[str]:
    return frozenset(text.split())


# Units of the field, not of SI; of the others those of time and angle belong to both.
FIELD = _names("""
    in inch inches international_inch IN ft foot feet international_foot FT yd yard mi mile thou gal
    gallon oil_barrel oil_bbl lb lbm pound avoirdupois_pound oz ounce gr grain ton short_ton long_ton
    ppg pound_per_gallon PPG pcf pound_per_cubic_foot PCF slug lbf pound_force LBF KLBF ozf ounce_force
    ton_force short_ton_force kip pdl poundal psi pound_force_per_square_inch PSI ksi foot_pound ft_lb hp horsepower mph
    mile_per_hour fps
""")
OF_BOTH = _names("""
    s sec second min minute MIN h hr hrs hour d day week year yr yrs deg degree arcdeg ° arcmin
    arcminute arcsec arcsecond gon grad turn revolution rev cycle circle pi rpm RPM
    revolutions_per_minute rps revolutions_per_second Hz hertz gravity standard_gravity g_0 g_n A
    ampere amp V volt ohm H henry
""")


def _read(definitions: str) -> dict[str, tuple[Fraction, str]]:
    table: dict[str, tuple[Fraction, str]] = {}
    for line in definitions.strip().splitlines():
        names, _, meaning = line.partition(" = ")
        number, _, unit = meaning.partition(" ")
        table |= dict.fromkeys(names.split(), (Fraction(number), unit))
    return table


TABLE = _read(_DEFINITIONS)
"""The definition of each unit name: (factor, compound unit). A dimension in brackets is
a base unit."""

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
    "N s^2/m^2": ("N*s^2/m^2", "kN*s^2/m^2", "lbf*s^2/ft^2"),
    "N m s/rad": ("N*m*s/rad", "kN*m*s/rad", "ft*lbf*s/rad"),
    "N m": ("N*m", "kN*m", "ft*lbf"),
    "1/s": ("1/s",),
    "s/m": ("s/m", "s/ft"),
    "s/rad": ("s/rad", "s/deg"),
    "s^2/rad^2": ("s^2/rad^2", "s^2/deg^2"),
    "N m/rad": ("N*m/rad", "kN*m/rad", "ft*lbf/rad"),
    "kg m^2": ("kg*m^2",),
    "Hz": ("Hz",),
    "kg": ("kg", "lb"),
    "kg/m": ("kg/m", "lb/ft"),
    "m^3/s": ("m^3/s", "l/min", "gal/min"),
    "Pa s": ("Pa*s", "mPa*s"),
    "A": ("A", "kA"),
    "H": ("H", "mH"),
    "ohm": ("ohm", "mohm"),
    "V s/rad": ("V*s/rad",),
}
"""Units to suggest and to display in, by the SI units of the quantity; SI engineering
units first."""

KINDS = {
    "m": "length",
    "N": "force",
    "rad/s": "speed of rotation",
    "rad": "angle",
    "s": "time",
    "m/s": "speed",
    "m/s^2": "acceleration",
    "kg/m^3": "density",
    "Pa": "pressure",
    "N/m": "stiffness",
    "N m": "torque",
    "kg": "mass",
    "kg/m": "weight per length",
    "Hz": "frequency",
    "m^3/s": "flow",
}
"""The kind of a quantity, in words, by its SI units."""

CF = {
    "": "1",
    "percent": "percent",
    "m": "m",
    "N": "N",
    "rad/s": "rad s-1",
    "rad": "rad",
    "s": "s",
    "m/s": "m s-1",
    "m/s^2": "m s-2",
    "kg/m^3": "kg m-3",
    "Pa": "Pa",
    "N/m": "N m-1",
    "N/m^1.5": "N m-1.5",
    "N s/m": "N s m-1",
    "N m s/rad": "N m s rad-1",
    "N m": "N m",
    "1/s": "s-1",
    "s/m": "s m-1",
    "s/rad": "s rad-1",
    "N s^2/m^2": "N s2 m-2",
    "N m/rad": "N m rad-1",
    "kg m^2": "kg m2",
    "Hz": "Hz",
    "s^2/rad^2": "s2 rad-2",
    "kg": "kg",
    "kg/m": "kg m-1",
    "m^3/s": "m3 s-1",
    "Pa s": "Pa s",
    "A": "A",
    "H": "H",
    "ohm": "ohm",
    "V s/rad": "V s rad-1",
}
"""Units in the attributes of files, by the SI units of a key."""

"""The units in which a quantity may be written: a table of definitions with exact
factors."""

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
rpm RPM revolutions_per_minute = 1 rev/min
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

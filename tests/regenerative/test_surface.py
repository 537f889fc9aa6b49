"""The surface between two blades: thresholds and cycles against closed forms, the exact
characteristic equation and a reference with the delay itself."""

import math
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

import nsdrill
from nsdrill.models import linear, surface
from nsdrill.models.operation import Operation, Values
from nsdrill.models.regenerative.checks import cutting_at, drilling_at
from nsdrill.models.regenerative.model import Regenerative
from nsdrill.models.responses import Thresholds
from regenerative.reference import measured

# The numbers of the public code of Aarsnes & van de Wouw for the bit, and those that go with the
# model of Richard, Germay & Detournay 2007 for the string, to which a spring and dampers are added.
STRING = """\
drillstring: {{axial_mass: 34000 kg, axial_stiffness: {k} kN/m, axial_damping: {c} kN*s/m, rotary_inertia: 116 kg*m^2,
  torsional_stiffness: 938 N*m/rad, torsional_damping: {D} N*m*s/rad}}
"""
RPM = math.pi / 30


def text(k: float = 700, c: float = 15.6, D: float = 32.9, states: int = 12, **more: Any) -> str:
    """A study of this string; ``more`` are the rpm, the weight on bit [kN] and the wear flats
    [mm], and lines of the study."""
    rpm, wob, wear = more.get("rpm", 120), more.get("wob", 15.876), more.get("wear", 1.2)
    return (
        f"model: regenerative\n{STRING.format(k=k, c=c, D=D)}"
        f"bit: {{blades: {more.get('blades', 4)}, radius: 108 mm, wear_length: {wear} mm, states: {states}}}\n"
        f"operation: {{depth: 1000 m, wob: {wob} kN, rotary_speed: {rpm} rpm}}\n{more.get('lines', '')}"
    )


def lanes_of(study: nsdrill.Study) -> dict[str, Any]:
    operation = study.operation
    points = Values(study.parameters, study.initial, (operation.depth, operation.wob, operation.rotary_speed))
    return dict(Regenerative().columns(points, Thresholds()))


@pytest.mark.parametrize(("states", "error"), [(4, 2e-3), (5, 1e-4), (6, 2e-6), (8, 1e-9)])
def test_the_axial_threshold_without_spring_and_damper(states, error):
    """2 sqrt(2 psi/n) of Richard, Germay & Detournay 2007, 144.414 rpm here, at any weight: a
    mass alone, on the delay of these states."""
    psi = 0.6 * 60e6 * 0.108 * 116 / (34000 * 938)
    exact = 2 * math.sqrt(2 * psi / 4) * math.sqrt(938 / 116)
    assert exact / RPM == pytest.approx(144.414, abs=1e-3)
    closed = surface.axial_threshold(34000.0, 0.0, 0.0, 4 * 0.6 * 60e6 * 0.108, 4)
    assert closed.speed == pytest.approx(exact, rel=1e-12)

    def growth(speed: float) -> float:
        matrix = delayed(states, 4 * speed / (2 * math.pi))
        whole = np.zeros((states + 1, states + 1))
        whole[0, 1:] = 4 * 0.6 * 60e6 * 0.108 / 34000  # the velocity up, by the depth
        whole[1:, 1:], whole[1, 0] = matrix, -1.0
        roots = np.linalg.eigvals(whole)
        return float(roots[np.abs(roots.imag) > 1.0].real.max())

    found = brentq(growth, 60 * RPM, 260 * RPM, xtol=1e-12)
    assert 0.0 < abs(found / exact - 1) < error


@pytest.mark.parametrize("chosen", [(116.0, 938.0, 0.108, 60e6, 0.6), (300.0, 500.0, 0.2, 25e6, 0.8)])
def test_four_numbers_without_dimension_decide(chosen):
    """psi, lambda, beta and n of a paper, with any inertia, stiffness, radius, specific energy and
    zeta: twist, small deviations and threshold in the units of time and of length."""
    J, torsion, a, energy, zeta = chosen
    psi, lam, beta, n, weight, speed = 13.9, 0.7, 0.3, 4, 1.4, 3.0
    time, length = math.sqrt(J / torsion), 2 * torsion / (energy * a * a)
    mass, flats = zeta * energy * a * J / (psi * torsion), 2 * zeta * torsion * lam / (energy * a * a)
    wob, set_speed = weight * zeta * energy * a * length, speed / time
    report = nsdrill.check(
        f"model: regenerative\ndrillstring: {{axial_mass: {mass!r} kg, axial_stiffness: 0 N/m, axial_damping: 0 N*s/m, "
        f"rotary_inertia: {J} kg*m^2, torsional_stiffness: {torsion} N*m/rad, torsional_damping: 0 N*m*s/rad}}\n"
        f"bit: {{blades: {n}, radius: {a} m, specific_energy: {energy} Pa, zeta: {zeta}, contact_stress: {energy} Pa, "
        f"wear_length: {flats!r} m, friction: {beta / zeta!r}}}\n"
        f"operation: {{wob: {wob!r} N, rotary_speed: {set_speed!r} rad/s}}\n"
    )
    found = {name: figure.value for name, figure in report.figures.items()}
    assert found["blade_depth"] / length * n == pytest.approx(weight - lam, rel=1e-9)
    assert found["static_twist"] == pytest.approx(-(weight - lam) - beta * lam, rel=1e-9)
    assert found["axial_threshold"] * time == pytest.approx(2 * math.sqrt(2 * psi / n), rel=1e-9)

    def exact(s: complex) -> complex:
        axial, torsional, back = s * s / psi, s * s + 1, 1 - np.exp(-s * 2 * math.pi / (n * speed))
        return (axial + n * back) * torsional - axial * (weight - lam) * n / (2 * math.pi) * back

    deviation = complex(found["growth"], found["growth_frequency"]) * time
    assert deviation == pytest.approx(root_near(deviation, exact), rel=1e-8)


def delayed(states: int, rate: float) -> np.ndarray:
    """The matrix of the surface's states while the bit cuts, column by column."""
    columns = []
    for unit in np.eye(states):
        below, behind, front = surface.sums_of(unit)
        # as deep as the surface is high, so that nothing is left behind the blade
        columns.append(surface.rates_of(below, behind, front, front, 0.0, rate))
    return np.array(columns).T


@pytest.mark.parametrize("states", [2, 3, 5, 8])
def test_its_transfer_function_is_the_pade_approximation_of_the_delay(states):
    """[N-1/N] of exp(-z): numerator and denominator in closed form."""
    factorial, N = math.factorial, states
    top, bottom = (
        [
            sign**j * factorial(2 * N - 1 - j) * factorial(m) / (factorial(2 * N - 1) * factorial(j) * factorial(m - j))
            for j in range(m + 1)
        ]
        for m, sign in ((N - 1, -1), (N, 1))
    )
    matrix, unit = delayed(states, 1.0), np.eye(states)
    for z in (0.3 + 1j, 2j, 5j, 9j):
        # of h before the blade to u': (1 - R)/z
        solved = np.linalg.solve(z * unit - matrix, unit[0])
        given = 1.0 - z * surface.sums_of(solved)[2]
        wanted = np.polyval(top[::-1], z) / np.polyval(bottom[::-1], z)
        assert given == pytest.approx(wanted, rel=1e-9, abs=1e-12)


def test_the_threshold_falls_with_the_root_of_the_number_of_blades():
    """With the same cutting stiffness of all blades together it is 1/n; with that of each
    blade n^(-1/2), which is how the rock enters."""
    speeds = [surface.axial_threshold(34000.0, 0.0, 0.0, n * 3.888e6, n).speed for n in (3, 4, 6, 8)]
    assert np.array(speeds) * np.sqrt([3, 4, 6, 8]) == pytest.approx(np.full(4, speeds[0] * math.sqrt(3)), rel=1e-12)


def test_the_threshold_with_a_spring_and_a_damper_is_that_of_the_characteristic_equation():
    """At the threshold m s^2 + c s + k + F (1 - exp(-s tau)) = 0 with s = i w; no faster speed
    has a root there. The least cutting stiffness of chatter theory is 2 k z (1 + z)."""
    mass, stiffness, damping, cutting = 34000.0, 7e5, 15600.0, 15.552e6
    found = surface.axial_threshold(mass, stiffness, damping, cutting, 4)
    w, tau = found.frequency, 2 * math.pi / (4 * found.speed)
    left = stiffness - mass * w * w + 1j * damping * w + cutting * (1 - np.exp(-1j * w * tau))
    assert abs(left) < 1e-9 * cutting
    z, k = 0.1, 1e7
    damping, least = 2 * z * math.sqrt(k * mass), 2 * k * z * (1 + z)
    assert surface.axial_threshold(mass, k, damping, 0.9999 * least, 4).speed == 0.0
    assert surface.axial_threshold(mass, k, damping, 1.0001 * least, 4).speed > 0.0


def characteristic(s: complex, speed: float, D: float, k: float, c: float, wob: float) -> complex:
    """The determinant of axial and torsional motion with the exact delay."""
    force, torque = 4 * 0.6 * 60e6 * 0.108, 4 * 60e6 * 0.108**2 / 2
    depth = (wob - 60e6 * 0.108 * 1.2e-3) / force
    advance, back = depth * 4 / (2 * math.pi), 1 - np.exp(-s * 2 * math.pi / (4 * speed))
    axial, torsional = 34000 * s * s + c * s + k, 116 * s * s + D * s + 938
    return complex((axial + force * back) * torsional - axial * torque * advance * back)


def root_near(guess: complex, equation: Callable[..., complex], *given: float) -> complex:
    """A root of a characteristic equation, by Newton's method."""
    for _ in range(50):
        h = 1e-6
        slope = (equation(guess + h, *given) - equation(guess - h, *given)) / (2 * h)
        guess -= equation(guess, *given) / slope
    return guess


@pytest.mark.parametrize(("states", "error"), [(6, 2e-4), (12, 1e-8)])
def test_the_hopf_point_of_axial_and_torsional_motion_together(states, error):
    """15.0774 rad/s at 15.876 kN, by the exact characteristic equation and by the equations of
    the model, differentiated."""

    def rate(speed: float) -> float:
        return root_near(30.5j, characteristic, speed, 32.9, 7e5, 15600.0, 15876.0).real

    exact = brentq(rate, 14.5, 15.7, xtol=1e-12)
    assert exact == pytest.approx(15.07742, abs=2e-5)
    string = drilling_at(nsdrill.load_study(text(states=states)).parameters, Operation(1000.0, 15876.0, 4.0)).string
    found = brentq(lambda v: linear.grows(string, np.array([v]))[0], 14.5, 15.7)
    assert 0.0 < abs(found / exact - 1) < error


@pytest.mark.parametrize("damping", [0.0, 32.9])
def test_the_least_stable_deviation_far_above_the_threshold(damping):
    """Torsion without damping is unstable even at 200 rpm, weakly."""
    speed, force = 200 * RPM, 4 * 0.6 * 60e6 * 0.108
    wob = 60e6 * 0.108 * 1.2e-3 + force * 15 / 3600 * 2 * math.pi / (4 * speed)
    exact = root_near(2.85j - 0.1, characteristic, speed, damping, 0.0, 0.0, wob)
    study = nsdrill.load_study(text(k=0, c=0, D=damping, wob=wob / 1e3, states=8))
    string = drilling_at(study.parameters, Operation(1000.0, wob, 4.0)).string
    (rate,), (frequency,) = linear.growth(linear.matrix_of(string, np.array([speed])))
    assert complex(rate, frequency) == pytest.approx(exact, abs=2e-5)
    assert (rate > 0.0) == (damping == 0.0)
    if damping == 0.0:
        assert exact == pytest.approx(6.295e-4 + 2.8511j, abs=1e-4)


CYCLES = {
    "clipped": ({"states": 8}, 30.0, 10.0, 0.01, 0.01),
    "bounce": ({"rpm": 100, "wear": 0, "wob": 8.1}, 30.0, 15.0, 0.012, 0.04),
    "stick-slip": ({"rpm": 60, "wear": 6, "wob": 55.08, "D": 0, "states": 8}, 50.0, 20.0, 0.01, 0.01),
}


@pytest.mark.parametrize("name", CYCLES)
def test_a_cycle_is_that_of_the_exact_delay(name):
    """Axial swing, greatest rate of penetration, bit speeds and mean torque; bounds with them,
    and of the greatest depth of cut, in which a bit that lands leaves a kink."""
    about, transient, observe, within, of_depth = CYCLES[name]
    study = nsdrill.load_study(
        text(**about, lines=f"simulation: {{transient: {transient} s, observe: {observe} s, rtol: 1.0e-7}}\n")
    )
    exact = measured(lanes_of(study), transient, observe, study.initial.vz)
    data = nsdrill.run(study, progress=False)
    found = {name: float(data[name].values.squeeze()) for name in data.data_vars if data[name].size == 1}
    scale = study.operation.rotary_speed
    assert found["axial_max"] - found["axial_min"] == pytest.approx(exact.swing, rel=within)
    assert found["axial_velocity_min"] == pytest.approx(exact.axial_velocity_min, rel=within)
    assert found["bit_speed_min"] == pytest.approx(exact.bit_speed_min, abs=within * scale)
    assert found["bit_speed_max"] == pytest.approx(exact.bit_speed_max, rel=within)
    assert found["surface_torque_mean"] == pytest.approx(exact.surface_torque_mean, rel=within)
    assert found["lift_off_fraction"] == pytest.approx(exact.lift_off_fraction, abs=within)
    assert found["blade_depth_max"] == pytest.approx(exact.blade_depth_max, rel=of_depth)
    assert (found["lift_off_fraction"] > 0.3) == (name == "bounce")
    assert (found["stuck_fraction"] > 0.1) == (name == "stick-slip")
    assert int(data["beyond_validity"].values.squeeze()) == (1 if name == "bounce" else 0)


@pytest.mark.parametrize(("stiffness", "slopes"), [(0.0, (-21.6, -12.8)), (700.0, (8.2, 7.0))])
def test_axial_vibration_changes_the_mean_torque_with_speed(stiffness, slopes):
    """That of the bit, without the damping of the string, between 85 and 95 and between 125 and
    135 rpm: under a constant hook load it falls with speed, as Besselink and others found, of a
    top that is fed at a constant rate it rises. Above the threshold it does not change."""
    study = text(k=stiffness, lines="simulation: {transient: 40 s, observe: 40 s}\n")
    speeds = ", ".join(f"{rpm} rpm" for rpm in (85, 95, 125, 135, 170, 180))
    data = nsdrill.run(f"{study}sweep: {{rotary_speed: [{speeds}]}}\n", progress=False)
    speed = data["rotary_speed"].values
    torque = data["surface_torque_mean"].values.squeeze() - 32.9 * speed
    slow, fast, steady = (np.diff(torque) / np.diff(speed))[::2]
    assert (slow, fast) == pytest.approx(slopes, abs=1.0)
    assert steady == pytest.approx(0.0, abs=0.01)


def test_so_damping_decides_on_stick_slip_below_the_threshold():
    """At 100 rpm, with worn blades: 32.9 N m s/rad prevent what none does not."""
    studies = (text(rpm=100, wear=6, wob=55.08, D=D, lines="simulation: {transient: 200 s, observe: 40 s}\n")
               for D in (0, 32.9))  # fmt: skip
    free, damped = (nsdrill.run(one, progress=False)["stick_slip_index"].values.squeeze() for one in studies)
    assert free > 70.0
    assert damped < 5.0


@pytest.mark.parametrize("rpm", [90, 95, 100, 110])
def test_a_bounce_is_right_with_as_many_states_as_check_asks_for(rpm):
    """A third of the time off bottom, without wear: the cycle to 0.5 %, the greatest depth of cut
    to 3 %; at 100 rpm not with 12."""
    lines = "simulation: {transient: 30 s, observe: 15 s, rtol: 1.0e-7}\n"
    about: dict[str, Any] = {"rpm": rpm, "wear": 0, "wob": 8.1, "lines": lines}
    asked = int(nsdrill.check(text(**about)).figures["states_off_bottom"].value)
    assert 12 < asked < 16
    study = nsdrill.load_study(text(**about))
    exact = measured(lanes_of(study), 30.0, 15.0, study.initial.vz)
    errors = {}
    for states in (12, asked):
        data = nsdrill.run(text(**about, states=states), progress=False)
        found = {name: float(data[name].values.squeeze()) for name in ("axial_max", "axial_min", "blade_depth_max")}
        swing = abs((found["axial_max"] - found["axial_min"]) / exact.swing - 1)
        fastest = abs(float(data["axial_velocity_min"].squeeze()) / exact.axial_velocity_min - 1)
        errors[states] = max(swing, fastest), abs(found["blade_depth_max"] / exact.blade_depth_max - 1)
    print(f"{rpm} rpm, off bottom {exact.lift_off_fraction:.0%}: {errors}")
    assert errors[asked][0] < 0.005
    assert errors[asked][1] < 0.03
    assert rpm != 100 or (errors[12][0] > 0.005 and errors[12][1] > 0.03)


@pytest.mark.parametrize(
    ("axial", "of_mean", "of_steady", "stopped"), [((700.0, 15.6), 2.21, 2.21, 0.118), ((0.0, 0.0), 2.22, 2.39, 0.131)]
)
def test_the_rate_of_penetration_of_an_axial_cycle(axial, of_mean, of_steady, stopped):
    """At 120 rpm, by the model and by the reference: its greatest, over its mean and over that of
    steady drilling, which are the same only where the top is fed at a constant rate; and the
    part of the time below 2 % of the mean."""
    k, c = axial
    study = nsdrill.load_study(text(k=k, c=c, lines="simulation: {transient: 150 s, observe: 20 s, rtol: 1.0e-7}\n"))
    steady = float(np.ravel(lanes_of(study)["penetration"])[0])
    exact = measured(lanes_of(study), 150.0, 20.0, study.initial.vz)
    assert (steady - exact.axial_velocity_min) / steady == pytest.approx(of_steady, abs=0.01)
    trace = nsdrill.simulate(study, duration="170 s")
    late = trace["time"].values > 150.0
    rate = steady - trace["vz"].values[late]
    time = trace["time"].values[late]
    mean = float(np.trapezoid(rate, time) / (time[-1] - time[0]))
    assert rate.max() / steady == pytest.approx(of_steady, abs=0.01)
    assert rate.max() / mean == pytest.approx(of_mean, abs=0.015)
    slow = np.where(rate < 0.02 * mean, 1.0, 0.0)
    assert float(np.trapezoid(slow, time) / (time[-1] - time[0])) == pytest.approx(stopped, abs=0.006)


def test_check_says_theta_the_states_and_the_threshold(tmp_path):
    study = nsdrill.load_study(text())
    one = cutting_at(study.parameters, study.operation)
    figures = nsdrill.check(study).figures
    assert figures["theta"].value == pytest.approx(one.delay * math.sqrt(2 * 15.552e6 / 34000), rel=0.03)
    assert figures["states_needed"].value == math.ceil(3 + 1.75 * one.theta / math.pi)
    assert figures["states_off_bottom"].value == math.ceil(2.5 * (3 + 1.75 * one.theta / math.pi))
    assert figures["axial_threshold"].value == pytest.approx(15.143, abs=1e-3)
    assert figures["steady_threshold"].value == pytest.approx(15.0774, abs=1e-4)
    assert figures["growth"].value > 0.0
    slow = nsdrill.check(text(rpm=20)).warnings
    assert any("Few states" in one and "bit.states: 16" in one for one in slow)
    assert not any("Few states" in one for one in nsdrill.check(text(rpm=20, states=16)).warnings)


class Prescribed:
    """A bit at 6 rad/s, whose blades are a right angle apart, with torsion of 2.85 rad/s so
    wide that it turns back by an angle [rad] in each cycle, as one that sticks may; while it
    turns forward it advances, by a fifth more or less. All are functions of time."""

    def __init__(self, back: float) -> None:
        self.spacing, self.omega, self.rate = math.pi / 2, 6.0, 2.85
        self.period = 2 * math.pi / self.rate

        def turned(swing: float) -> float:
            first = self.rest(swing)
            return self.omega * (2 * first - self.period) + 2 * swing * math.sin(self.rate * first)

        least = self.omega / self.rate * (1 + 1e-9)
        self.swing = brentq(lambda one: turned(one) - back, least, 60.0)
        first = self.rest(self.swing)
        ends = [0.0]
        for k in range(6):
            ends += [k * self.period + first, (k + 1) * self.period - first]
        self.parts, depth = [], 0.0  # begin, end, depth of the bit at the beginning; forward and back by turns
        for begin, end in pairwise(ends):
            self.parts.append((begin, end, depth))
            depth += self.gained(begin, end) if len(self.parts) % 2 else 0.0

    def rest(self, swing: float) -> float:
        """When a bit that vibrates so much first comes to rest [s]."""
        return math.acos(-self.omega / (swing * self.rate)) / self.rate

    def angle(self, t: float) -> float:
        return self.omega * t + self.swing * math.sin(self.rate * t)

    def speed(self, t: float) -> float:
        return self.omega + self.swing * self.rate * math.cos(self.rate * t)

    def gained(self, begin: float, end: float) -> float:
        """How much deeper the bit is after it has turned forward."""
        low, high = self.angle(begin), self.angle(end)
        return (high - low + 0.2 / 1.3 * (math.sin(1.3 * high) - math.sin(1.3 * low))) / self.spacing

    def advance(self, t: float) -> float:
        return max(self.speed(t), 0.0) / self.spacing * (1 + 0.2 * math.cos(1.3 * self.angle(t)))

    def exact(self, t: float) -> float:
        """The depth of cut, with nothing rounded: the bit less where it was when a blade
        last turned forward past this place, at a time that is solved for. As the bit never
        rises, that pass left the deepest surface."""
        last = next(k for k, (_, end, _) in enumerate(self.parts) if t <= end)
        begin, _, depth = self.parts[last]
        here, found = depth + (self.gained(begin, t) if last % 2 == 0 else 0.0), -math.inf
        for blade in range(-1, 10):  # the next one too, which has passed where the bit turned back past it
            place = self.angle(t) - blade * self.spacing
            for k in range(last - last % 2, -1, -2):
                begin, end, depth = self.parts[k]
                end = min(end, t)
                if (blade or k < last) and self.angle(begin) <= place <= self.angle(end):
                    time = brentq(lambda one, place=place: self.angle(one) - place, begin, end, xtol=1e-13)
                    found = max(found, depth + self.gained(begin, time))
                    break
        return max(here - found, 0.0)


def recut(back: float, states: int, held: bool = False) -> tuple[float, float]:
    """Of a prescribed motion along which the bit turns back by an angle [rad] in each cycle:
    how wrong the depth of cut is, rms over the greatest, and its mean, relative. A ``held``
    surface rests meanwhile."""
    motion, steps, every = Prescribed(back), 3000, 20
    dt = motion.period / steps

    def slopes(t: float, h: np.ndarray) -> np.ndarray:
        below, behind, front = surface.sums_of(h.tolist())
        passed = max(motion.speed(t), 0.0) if held else motion.speed(t)
        rates = surface.rates_of(below, behind, front, max(front, 0.0), motion.advance(t), passed / motion.spacing)
        return np.array(rates)

    h, found = np.zeros(states), []
    h[:2] = 0.5  # in depths of steady drilling
    for i in range(3 * steps):
        t = i * dt
        if i >= steps and i % every == 0:
            found.append((max(surface.sums_of(h.tolist())[2], 0.0), motion.exact(t)))
        k1 = slopes(t, h)
        k2 = slopes(t + dt / 2, h + dt / 2 * k1)
        k3 = slopes(t + dt / 2, h + dt / 2 * k2)
        h = h + dt / 6 * (k1 + 2 * k2 + 2 * k3 + slopes(t + dt, h + dt * k3))
    ours, exact = np.array(found).T
    return float(np.sqrt(np.mean((ours - exact) ** 2)) / exact.max()), float(ours.mean() / exact.mean() - 1)


def test_a_bit_that_turns_back_recuts_what_it_left():
    """Against the exact surface of a prescribed motion: where the bit turns back by 0.24 rad, a
    sixth of the spacing, the depth of cut is wrong by 9 % of the greatest with 16 states and
    by 5 % with 40, the most, as the step that it leaves in the surface is as wide as a
    state: 3 % is beyond. Its mean is right. A surface that rested meanwhile would be wrong by
    four times as much."""
    few, many, held = recut(0.24, 16), recut(0.24, 40), recut(0.24, 16, held=True)
    assert 0.06 < few[0] < 0.09
    assert 0.03 < many[0] < 0.06
    assert max(abs(few[1]), abs(many[1])) < 0.03
    assert held[0] > 0.25
    # a small step is crossed as slowly as the bit turns, and is wrong for longer
    assert few[0] < recut(0.01, 16)[0] < 0.15
    assert recut(1.6, 16)[0] > 0.1  # past a blade, which beyond_validity tells


def test_nonsense_is_refused_and_what_is_beyond_the_model_is_said():
    for found, words in (
        ("blades: 0", "at least 1"),
        ("blades: 4.5", "whole number"),
        ("wear_length: 2 m", "three radii"),
        ("states: 1", "at least 2"),
    ):
        with pytest.raises(nsdrill.StudyError, match=words):
            nsdrill.load_study(f"model: regenerative\nbit: {{{found}}}\n")
    dull = nsdrill.check(text(wear=6, wob=30))
    assert any(one.startswith("Dull") and "38.88 kN" in one for one in dull.warnings)
    assert dull.figures["rate_of_penetration"].value is None
    assert any(one.startswith("Worn") for one in nsdrill.check(text(wear=80, wob=1000)).warnings)
    assert any("Constant hook load" in one for one in nsdrill.check(text(k=0)).warnings)


def test_a_dull_bit_does_not_advance():
    data = nsdrill.run(text(wear=6, wob=30, lines="simulation: {transient: 5 s, observe: 5 s}\n"), progress=False)
    assert float(data["rate_of_penetration"].values.squeeze()) < 1e-5  # 36 mm/h
    assert float(data["blade_depth_max"].values.squeeze()) < 2e-5


def test_the_damping_of_the_pipe_is_that_of_a_wave():
    """A sqrt(E rho) of 5 by 4.276 in steel, by hand."""
    area = math.pi / 4 * (0.127**2 - 0.1086**2)
    found = nsdrill.check("model: regenerative\n").coefficients
    assert found.c_a == pytest.approx(area * math.sqrt(210e9 * 7850), rel=1e-9)
    given = nsdrill.check("model: regenerative\ndrillstring: {axial_damping: 4 kN*s/m}\n").coefficients
    assert given.c_a == pytest.approx(4000.0)
    assert replace(given, c_a=found.c_a) == found

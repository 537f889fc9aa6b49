"""The string as it is known: by sections, by its stiffness and inertia, by the torques of its
friction. Exact waves here are those of transfer matrices, made without the package."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

import nsdrill
from nsdrill.models import waves
from nsdrill.models.christoforou_yigit.coefficients import derive
from nsdrill.models.sections import Material, Section, lateral_in, lumped, parts_of, stretch_of, torsion_of
from nsdrill.models.segments.checks import torsional_frequencies
from nsdrill.models.segments.string import string_of
from nsdrill.study import parse_study

IN = 0.0254
PIPE, HEAVY, COLLAR = (5 * IN, 4.276 * IN), (5 * IN, 3 * IN), (8 * IN, 2.8125 * IN)
STEEL = Material()


def string(*rows, depth):
    """The parts of a string: diameters of the first section, then (length, diameters)."""
    first, *others = rows
    sections = (Section(None, *first), *(Section(float(length), *tube) for length, tube in others))
    return parts_of(sections, STEEL, float(depth))


def exact(parts, of, count):
    """The first ``count`` frequencies [rad/s] below a held top, from the 2 x 2 matrices that take
    (rotation, torque) or (shift, force) along each part, on a fine scan."""

    def load_at_bit(w):
        state = np.array([0.0, 1.0])
        for part in parts:
            section, modulus = (part.polar, part.shear) if of == "torsion" else (part.area, part.young)
            angle, z = w * part.length * math.sqrt(part.density / modulus), section * math.sqrt(modulus * part.density)
            c, s = math.cos(angle), math.sin(angle)
            state = np.array([[c, s / (z * w)], [-z * w * s, c]]) @ state
        return state[1]

    grid = np.linspace(1e-3, 60.0, 60_000)
    values = np.array([load_at_bit(w) for w in grid])
    places = np.flatnonzero(values[1:] * values[:-1] < 0.0)[:count]
    return np.array([brentq(load_at_bit, grid[k], grid[k + 1], xtol=1e-13) for k in places])


TAPERED = string((5.5 * IN, 4.778 * IN), (1500, PIPE), (200, HEAVY), (100, COLLAR), depth=3000)


@pytest.mark.parametrize("of", ["torsion", "axial"])
def test_waves_of_all_sections_are_those_of_transfer_matrices(of):
    carriers = waves.torsional(TAPERED) if of == "torsion" else waves.axial(TAPERED)
    assert waves.standing(carriers, 0.0, 5) == pytest.approx(exact(TAPERED, of, 5), rel=1e-9)


def test_waves_of_sections_of_different_steel():
    parts = parts_of(
        (Section(None, *PIPE, shear_modulus=61e9), Section(150.0, *COLLAR, density=7950.0, shear_modulus=73e9)),
        STEEL,
        2000.0,
    )
    assert waves.standing(waves.torsional(parts), 0.0, 4) == pytest.approx(exact(parts, "torsion", 4), rel=1e-9)


def test_lumping_is_rayleighs_quotient_of_the_static_shape():
    """Against an integral over 200 000 places of the energies of that shape."""
    stiffness, inertia = torsion_of(TAPERED)
    ends = np.cumsum([0.0, *(part.length for part in TAPERED)])
    x = (np.arange(200_000) + 0.5) / 200_000 * ends[-1]
    at = np.searchsorted(ends, x) - 1
    polar = np.array([part.polar for part in TAPERED])[at]
    twist = np.cumsum(1.0 / (STEEL.shear_modulus * polar)) * (ends[-1] / 200_000)
    assert stiffness == pytest.approx(1.0 / twist[-1], rel=1e-5)
    assert inertia == pytest.approx(np.mean(STEEL.density * polar * (twist / twist[-1]) ** 2) * ends[-1], rel=1e-4)


def test_pipe_with_stiff_collars_has_the_formulas_of_pipe_and_collars():
    """k = k_p and J = J_c + J_p / 3."""
    assert lumped([500.0, 1e15], [90.0, 400.0]) == pytest.approx((500.0, 430.0), rel=1e-9)
    assert lumped([500.0], [90.0]) == pytest.approx((500.0, 30.0), rel=1e-12)


def test_a_section_may_be_divided():
    whole = string(PIPE, (200, COLLAR), depth=2000)
    parts = string(PIPE, (700, PIPE), (50, COLLAR), (150, COLLAR), depth=2000)
    for of in (torsion_of, stretch_of):
        assert of(parts) == pytest.approx(of(whole), rel=1e-12)


# The table of docs/theory.md: how far the lumped torsional frequency is above the first wave.
@pytest.mark.parametrize(
    ("rows", "depth", "error"),
    [
        ([PIPE, (200, (9 * IN, 3 * IN))], 3000, 0.004),
        ([PIPE, (300, HEAVY), (150, COLLAR)], 3000, 0.010),
        ([(5.5 * IN, 4.778 * IN), (1500, PIPE), (200, HEAVY), (100, COLLAR)], 5000, 0.036),
        ([PIPE, (100, HEAVY)], 9000, 0.095),
        ([PIPE], 1000, 0.103),
    ],
)
def test_the_documented_error_of_the_first_torsional_frequency(rows, depth, error):
    parts = string(*rows, depth=depth)
    stiffness, inertia = torsion_of(parts)
    assert math.sqrt(stiffness / inertia) / exact(parts, "torsion", 1)[0] - 1 == pytest.approx(error, abs=0.0006)


def test_the_collar_that_bends_is_the_lowest_section_as_long_as_the_span():
    assert lateral_in([None, 100.0, 30.0, 2.0], 20.0) == 2
    assert lateral_in([None, 10.0, 2.0], 20.0) == 0
    assert lateral_in([5.0, 9.0, 2.0], 20.0) == 1


SECTIONS = (
    "drillstring: {sections: [{outer_diameter: 5 in, inner_diameter: 4.276 in}, "
    "{length: 300 m, outer_diameter: 5 in, inner_diameter: 3 in}, "
    "{length: 150 m, outer_diameter: 8 in, inner_diameter: 2.8125 in}]}\n"
)


def test_main_model_and_torsion_have_the_numbers_of_all_sections():
    stiffness, inertia = torsion_of(string(PIPE, (300, HEAVY), (150, COLLAR), depth=2500))
    for model in ("christoforou_yigit", "torsion", "beam"):
        study = SECTIONS + f"model: {model}\noperation: {{depth: 2500 m}}\n"
        if model == "beam":
            study += "beam: {axial_load: static}\n"
            parameters = parse_study(study).parameters
            assert parameters.drillstring.collar.outer_diameter == 8 * IN
            continue
        found = nsdrill.check(study).coefficients
        assert (found.k_t, found.J) == pytest.approx((stiffness, inertia), rel=1e-12)


def test_the_first_section_stretches_with_the_depth():
    study = parse_study(SECTIONS + "sweep: {depth: [1500 m, 2500 m]}\n")
    k = derive(study.parameters, study.axes["depth"], 1e4, 5.0)
    for place, depth in enumerate((1500, 2500)):
        stiffness, inertia = torsion_of(string(PIPE, (300, HEAVY), (150, COLLAR), depth=depth))
        assert (k.k_t[place], k.J[place]) == (float(stiffness), float(inertia))


def test_check_shows_the_waves_of_the_sections_beside_the_lumped_string():
    text = SECTIONS + "operation: {depth: 2500 m}\n"
    parts = string(PIPE, (300, HEAVY), (150, COLLAR), depth=2500)
    for model in ("christoforou_yigit", "torsion", "segments"):
        more = "" if model == "christoforou_yigit" else f"model: {model}\n"
        more += "well: {diameter: 12.25 in}\n" if model == "segments" else ""
        quantities = nsdrill.check(text + more).figures
        found = [quantities[f"torsional_wave_{number}"].value for number in (1, 2, 3, 4)]
        assert found == pytest.approx(exact(parts, "torsion", 4), rel=1e-9)
        assert quantities["torsional"].value == pytest.approx(found[0], rel=0.02)


SEGMENTS = (
    "model: segments\ndrive: {kind: ideal}\nsimulation: {transient: 3 s, observe: 4 s}\n"
    "sweep: {rotary_speed: [13 rad/s]}\n"
)
SAME = (
    "drillstring: {sections: [{outer_diameter: 101 mm, inner_diameter: 84.8 mm}, "
    "{length: 200 m, outer_diameter: 171 mm, inner_diameter: 57.1 mm}]}\noperation: {depth: 2200 m}\n"
)


def test_segments_of_two_sections_have_the_bits_of_pipe_and_collars():
    one, other = (nsdrill.run(text, progress=False) for text in (SEGMENTS, SEGMENTS + SAME))
    for name in ("bit_speed_max", "surface_torque_max", "axial_max", "steps"):
        assert one[name].values == other[name].values


def test_segments_follow_the_sections_and_approach_their_waves():
    text = SECTIONS + "model: segments\nwell: {diameter: 12.25 in}\noperation: {depth: 2500 m}\n"
    expected = exact(string(PIPE, (300, HEAVY), (150, COLLAR), depth=2500), "torsion", 2)
    errors = []
    for count in (10, 20):
        parameters = parse_study(
            text + f"segments: {{pipe: {count}, collar: {count}}}\nbit: {{mass: 0 kg}}\n"
        ).parameters
        made = string_of(parameters, 2500.0)
        assert [n for _, n in made.parts] == [count, round(2 * count / 3), round(count / 3)]
        errors.append(np.abs(torsional_frequencies(made, 2) / expected - 1))
    assert np.all(errors[0] < [2e-3, 1e-2])
    assert np.all(errors[1] < 0.3 * errors[0])  # of second order


def test_a_run_of_three_sections_in_segments():
    text = SECTIONS + SEGMENTS + "well: {diameter: 12.25 in}\noperation: {depth: 2500 m}\n"
    text += "bit: {surface_amplitude: 0 mm}\n"
    data = nsdrill.run(text, progress=False)
    steady = nsdrill.check(text).figures["mean_torque"].value
    assert data.status.values.item() == 1
    assert data.surface_torque_mean.values.item() == pytest.approx(steady, rel=0.05)


OFF_BOTTOM = "modes: {axial: frozen, lateral: frozen}\noperation: {wob: 0 kN, rotary_speed: 5 rad/s}\n"
MEASURED = "torsional_stiffness: 470 N*m/rad, rotary_inertia: 370 kg*m^2"


def test_given_stiffness_and_inertia_replace_geometry():
    text = f"drillstring: {{{MEASURED}}}\n" + OFF_BOTTOM
    found = nsdrill.check(text)
    assert (found.coefficients.k_t, found.coefficients.J) == (470.0, 370.0)
    assert found.figures["torsional"].value == pytest.approx(math.sqrt(470.0 / 370.0), rel=1e-12)
    assert "torsional_wave_2" not in found.figures  # which no geometry tells


def test_coulomb_stick_slip_off_bottom_is_that_of_the_closed_form():
    """Static 4 kN m, dynamic 1 kN m, no damping: a = (T_s - T_d) / (J w); the peak is v + sqrt(v^2 +
    a^2). The law falls over 50 mrad/s."""
    text = (
        f"drillstring: {{{MEASURED}, torsional_damping: 0 N*m*s/rad}}\n{OFF_BOTTOM}"
        "bit: {friction: {law: linear, static: 4 kN*m, dynamic: 1 kN*m, "
        "dynamic_from: 0.05 rad/s, smoothing: 1.0e+8 s/rad}}\n"
        "initial: {bit_speed: 0 rad/s}\nsimulation: {transient: 40 s, observe: 40 s, rtol: 1.0e-8}\n"
    )
    data = nsdrill.run(text, progress=False)
    w = math.sqrt(470.0 / 370.0)
    a = 3e3 / (370.0 * w)
    assert data.bit_speed_max.values.item() == pytest.approx(5.0 + math.hypot(5.0, a), rel=1e-2)
    assert data.bit_torque_max.values.item() == pytest.approx(4e3, rel=5e-3)
    assert data.response.values.item() == 2  # stick-slip; off bottom nothing bounces
    estimates = nsdrill.check(text).figures
    assert estimates["stick_slip_peak"].value == pytest.approx(data.bit_speed_max.values.item(), rel=2e-2)


@pytest.mark.parametrize("model", ["christoforou_yigit", "torsion"])
def test_torques_are_those_of_a_weight_as_a_lever(model):
    """T = mu W 2/3 r: the invented weight of 400 kN and the torques give the same motion."""
    frozen = "modes: {axial: frozen, lateral: frozen}\n" if model == "christoforou_yigit" else ""
    rest = f"model: {model}\n{frozen}simulation: {{transient: 10 s, observe: 20 s}}\ninitial: {{bit_speed: 0 rad/s}}\n"
    lever = 400e3 * 2 / 3 * 0.1905
    zeta = ", cutting: {zeta: 0}" if model == "christoforou_yigit" else ""
    one = f"bit: {{friction: {{static: 0.2, dynamic: 0.1}}{zeta}}}\noperation: {{wob: 400 kN}}\n"
    other = (
        f"bit: {{friction: {{static: {0.2 * lever!r} N*m, dynamic: {0.1 * lever!r} N*m}}}}\noperation: {{wob: 0 kN}}\n"
    )
    a, b = (nsdrill.run(rest + text, progress=False) for text in (one, other))
    for name in ("bit_speed_max", "stuck_fraction", "surface_torque_max"):
        assert b[name].values == pytest.approx(a[name].values, rel=1e-5)


def test_torques_do_not_depend_on_the_force_on_the_bit():
    text = "bit: {friction: {static: 6 kN*m, dynamic: 5 kN*m}}\nsweep: {wob: [20 kN, 90 kN]}\n"
    text += "simulation: {transient: 20 s, observe: 10 s}\noperation: {rotary_speed: 8 rad/s}\n"
    data = nsdrill.run(text, progress=False)
    assert np.all(data.bit_torque_max.values <= 6e3)
    assert data.bit_force_max.values[0] != data.bit_force_max.values[1]


def test_without_weight_and_frozen_nothing_warns_of_buckling_or_bounce():
    soft = "drillstring: {collar: {span: 60 m}, eccentricity: 300 mm}\noperation: {wob: 900 kN}\n"
    words = " ".join(nsdrill.check(soft).warnings)
    assert "Buckled" in words
    assert "Eccentric:" in words
    quiet = " ".join(nsdrill.check(soft + "modes: {axial: frozen, lateral: frozen}\n").warnings)
    assert "Buckled" not in quiet
    assert "Eccentric:" not in quiet


def test_without_weight_the_lobes_are_spoken_of():
    assert any(word.startswith("Off bottom") for word in nsdrill.check("operation: {wob: 0 kN}").warnings)
    assert not any(word.startswith("Off bottom") for word in nsdrill.check(OFF_BOTTOM).warnings)


def test_what_default_geometry_still_gives_is_told():
    words = nsdrill.check(f"drillstring: {{{MEASURED}}}\ndrive: {{kind: soft_torque}}\n").warnings
    (told,) = [word for word in words if word.startswith("Geometry")]
    assert "axial motion" in told
    assert "impedance" in told
    assert not any(
        word.startswith("Geometry") for word in nsdrill.check(f"drillstring: {{{MEASURED}}}\n" + OFF_BOTTOM).warnings
    )

"""The surface that the blades leave, under a string of segments."""

import math

import numpy as np
import pytest
from deviations import followed_and_quotient, tangent_and_difference

import nsdrill
from nsdrill.analysis.bifurcations import HOPF
from nsdrill.app.experiment import prepare
from nsdrill.app.running.run import work_of
from nsdrill.errors import InputError
from nsdrill.models import linear, surface
from nsdrill.models.operation import Values
from nsdrill.models.registry import model_named
from nsdrill.models.responses import Thresholds
from nsdrill.models.segments import checks
from nsdrill.models.variant import variant_at
from nsdrill.study import parse_study

# A string of few segments and a light pipe, so that a run is short.
FEW = "model: segments\nsegments: {pipe: 2, collar: 2}\n"
ROCK = "law: regenerative, blades: 4, specific_energy: 60 MPa"


def text(rpm=100, wob=40, states=8, drive="ideal", lines=""):
    return (
        f"{FEW}bit: {{rock: {{{ROCK}, states: {states}}}}}\ndrive: {{kind: {drive}}}\n"
        f"operation: {{wob: {wob} kN, rotary_speed: {rpm} rpm}}\n{lines}"
    )


DISTURBED = "initial: {z: 0.2 mm}\n"


def uniform(eta, spacing, gain, segments):
    """A uniform string with distributed damping, as Aarsnes and van de Wouw have it: eta is
    exp(-k), negative of a top under constant force, positive of one that is fed; the delay
    and the ``gain`` K_a of the cutting force over the impedance of the pipe are in units of
    the time in which a torsional wave passes the string."""
    length, outer, inner, density, young = 2000.0, 0.127, 0.1086, 7850.0, 2.1e11
    area, fast = math.pi / 4 * (outer**2 - inner**2), math.sqrt(young / density)
    unit = 1.6 * length / fast
    energy = gain * area * math.sqrt(young * density) / unit / (4 * 0.6 * 0.108)
    annulus, flow = math.pi / 4 * (0.2**2 - outer**2), 0.02
    # of the mud's drag, linear in the velocity of the string: k per unit of time
    factor = -math.log(abs(eta)) / unit * density * area / (0.25 * 1000.0 * math.pi * outer * flow / annulus)
    return f"""
model: segments
drillstring:
  pipe: {{outer_diameter: {outer} m, inner_diameter: {inner} m}}
  collar: {{outer_diameter: {outer} m, inner_diameter: {inner} m, length: {length / 2} m}}
  material: {{young_modulus: {young} Pa, density: {density} kg/m^3}}
segments:
  pipe: {segments}
  collar: {segments}
  top: {{stiffness: {1e13 if eta > 0 else 1.0} N/m, mass: 0 kg, damping: 0 N*s/m}}
  kelly: {{length: 0 m}}
  material_damping: {{axial: 0 s, torsional: 0 s}}
  hydraulics: {{flow: {flow} m^3/s, pulsation: 0 m^3/s, annulus_factor: {factor!r}, bore_factor: 0}}
mud: {{density: 1000 kg/m^3}}
well: {{diameter: 0.2 m}}
bit:
  mass: 0 kg
  radius: 0.108 m
  rock: {{law: regenerative, blades: 4, specific_energy: {energy!r} Pa, zeta: 0.6, wear_length: 0 m}}
drive: {{kind: ideal}}
operation: {{depth: {length} m, wob: 1 N, rotary_speed: {2 * math.pi / (4 * spacing * unit)!r} rad/s}}
"""


@pytest.mark.parametrize(
    ("eta", "spacing", "gain"),
    [
        (0.7, 1.0, 1.729),
        (0.7, 0.5, 1.341),
        (0.7, 0.25, 2.119),
        (-0.7, 1.0, 0.649),
        (-0.7, 0.5, 1.238),
        (-0.7, 0.25, 2.418),
    ],
)
def test_the_critical_gain_of_a_distributed_string_is_the_published_one(eta, spacing, gain):
    """With the definitions of the public code of Aarsnes and van de Wouw, to 2 %: axial
    deviations decay below, and grow above."""
    for factor, grows in ((0.98, False), (1.02, True)):
        study = parse_study(uniform(eta, spacing, factor * gain, 20))
        string = checks.drilling_at(study.parameters, study.operation).string
        matrix = linear.matrix_of(string, np.array([study.operation.rotary_speed]))
        names = string.motion.states
        axial = [k for k, name in enumerate(names) if name[:2] in ("u_", "v_", "z", "vz") or name.startswith("surf")]
        (rate,), _ = linear.growth(matrix[:, axial][:, :, axial])
        assert (rate > 0.0) == grows


def test_the_threshold_of_one_mass_is_that_of_its_closed_form():
    for damping in (0.0, 15.6e3, 60e3):
        axial = 34e3, 0.7e6, damping, 15.552e6
        mass, stiffness = axial[:2]
        found, greatest = surface.fed_by(
            lambda w, c=damping, m=mass, k=stiffness: k - m * w * w + 1j * c * w, axial[3], 4, 100.0
        )
        exact = surface.axial_threshold(*axial, 4)
        assert tuple(found) == pytest.approx(tuple(exact), rel=1e-6)
        assert greatest == pytest.approx(surface.greatest_frequency(*axial), rel=1e-6)


def test_check_has_the_threshold_above_which_nothing_grows_along_the_hole():
    study = parse_study(text())
    bit = checks.cutting_at(study.parameters, study.operation)
    string = checks.drilling_at(study.parameters, study.operation).string
    rates, frequencies = linear.growth(linear.matrix_of(string, bit.threshold.speed * np.array([0.995, 1.005])))
    assert rates[0] > rates[1]
    assert frequencies[0] == pytest.approx(bit.threshold.frequency, rel=0.02)
    assert frequencies[1] < 0.5 * bit.threshold.frequency  # torsion
    found = nsdrill.check(text(states=3))
    assert found.figures["theta"].value == pytest.approx(bit.theta, rel=1e-9)
    needed = int(found.figures["states_needed"].value)
    assert needed == math.ceil(3 + 1.75 * bit.theta / math.pi)
    assert any(f"bit.rock.states: {needed}" in one for one in found.warnings)
    assert not [name for name in found.figures if name.startswith(("stick_slip", "slope_held"))]


def test_a_light_string_with_a_heavy_bit_is_the_model_of_its_own():
    """Within the mass of the string, a 500th of that of the bit: swing, speeds and depth of
    cut of an axial cycle."""
    lines = "simulation: {transient: 4 s, observe: 4 s, rtol: 1.0e-8}\n"
    steel = "material: {density: 30 kg/m^3}"
    tubes = "pipe: {outer_diameter: 0.127 m, inner_diameter: 0.1086 m}, collar: {outer_diameter: 0.127 m, "
    tubes = f"{tubes}inner_diameter: 0.1086 m, length: 200 m}}"
    rock = "blades: 4, specific_energy: 60 MPa, wear_length: 1.2 mm, states: 8"
    point = "operation: {depth: 1000 m, wob: 15.88 kN, rotary_speed: 100 rpm}\n"
    study = parse_study(
        f"model: segments\ndrillstring: {{{tubes}, {steel}}}\n"
        "segments: {pipe: 1, collar: 1, hydraulics: null, top: {stiffness: 1.0e12 N/m, damping: 0 N*s/m}, "
        "material_damping: {axial: 10 ms, torsional: 10 ms}}\nmud: {viscosity: 0 Pa*s}\ndrive: {kind: ideal}\n"
        f"bit: {{mass: 34 t, radius: 108 mm, rock: {{law: regenerative, {rock}}}}}\n{point}{lines}"
        "initial: {z: 0.2 mm}\n"
    )
    segments = nsdrill.run(study, progress=False)
    string = checks.string_of(study.parameters, 1000.0)
    own = nsdrill.run(
        f"model: regenerative\ndrillstring: {{axial_mass: 34 t, axial_stiffness: {float(string.axial)!r} N/m, "
        f"axial_damping: {0.01 * float(string.axial)!r} N*s/m, rotary_inertia: {17e3 * 0.108**2!r} kg*m^2, "
        f"torsional_stiffness: {float(string.torsional)!r} N*m/rad, "
        f"torsional_damping: {0.01 * float(string.torsional)!r} N*m*s/rad}}\n"
        f"bit: {{radius: 108 mm, {rock}}}\n{point}{lines}initial: {{z: 0.2 mm, vz: 0 m/s}}\n",
        progress=False,
    )
    for name in ("axial_velocity_max", "axial_velocity_min", "blade_depth_max", "bit_force_max"):
        assert float(segments[name].squeeze()) == pytest.approx(float(own[name].squeeze()), rel=0.01), name
    assert float((own["axial_max"] - own["axial_min"]).squeeze()) > 1e-4


def test_friction_is_implicit_too():
    lines = DISTURBED + "simulation: {transient: 3 s, observe: 3 s, rtol: 1.0e-9, method: WORD}\n"
    study = text(60, lines=lines)
    explicit, implicit = (nsdrill.run(study.replace("WORD", word), progress=False) for word in ("explicit", "implicit"))
    for name in ("bit_speed_max", "axial_max", "axial_min", "bit_force_max", "surface_torque_mean", "blade_depth_max"):
        assert float(implicit[name].squeeze()) == pytest.approx(float(explicit[name].squeeze()), rel=1e-4), name


@pytest.mark.parametrize("implicit", [False, True])
def test_the_tangent_is_the_derivative_of_the_slopes(implicit):
    """At random states, cutting and off bottom, turning forward and back."""
    study = parse_study(text(states=5))
    model, at, lanes = model_named("segments"), study.operation, 16
    variant = variant_at(model, study.parameters)
    variant = variant.implicit if implicit else variant
    points = Values(
        study.parameters, study.initial, tuple(np.full(lanes, v) for v in (at.depth, at.wob, at.rotary_speed))
    )
    table, rng = model.pack(points, Thresholds()), np.random.default_rng(7)
    size, names = variant.state_scales(table).T, variant.states
    state = model.starts(points, 0)[:, : len(names)].T + rng.normal(size=size.shape) * size
    state[names.index("surface_0")] += np.where(np.arange(lanes) % 2, 8.0, -8.0) * size[names.index("surface_0")]
    state[names.index("bit_speed"), ::4] *= -1.0
    deviation = rng.normal(size=size.shape) * size
    contact = surface.sums_of(state[[names.index(name) for name in surface.names(5)]])[2]
    found, exact = tangent_and_difference(
        variant, table, state, deviation, contact, step=1e-5, implicit=implicit, time=0.3
    )
    bound = (1e-4 if implicit else 1e-8) * np.abs(exact).max(axis=1, keepdims=True)
    assert np.all(np.abs(found - exact) <= bound + 1e-14 * np.abs(exact).max())


def test_the_deviation_is_the_derivative_of_the_motion():
    lines = DISTURBED + "simulation: {transient: 0 s, observe: 1 s, rtol: 1.0e-10}\n"
    work = work_of(prepare(parse_study(text(60, states=5, lines=lines))))
    followed, quotient = followed_and_quotient(work, 1e-12)
    assert np.linalg.norm(followed - quotient) < 1e-3 * np.linalg.norm(quotient)


def test_runs_have_exponents_sections_and_labels_and_go_on_to_the_same_bits(tmp_path):
    lines = DISTURBED + "simulation: {transient: 2 s, observe: 8 s}\nrecord: {exponent: true, poincare: 4}\n"
    lines += "sweep: {rotary_speed: [60 rpm, 100 rpm], procedure: up-down}\n"
    whole = nsdrill.run(text(states=5, lines=lines), tmp_path / "whole.h5", progress=False)
    assert np.all(np.isfinite(whole["lyapunov_exponent"].values))
    assert set(np.unique(whole["beyond_validity"].values)) <= {0, 1, 2, 3}
    assert np.all(np.isfinite(whole["section_current"].values))
    assert list(whole["state"].values[-7:-1]) == ["current", *surface.names(5)]
    trace = nsdrill.replay(tmp_path / "whole.h5", rotary_speed="60 rpm", procedure="down")
    at = whole.sel(procedure="down").isel(rotary_speed=0)
    for name in ("z", "bit_speed", "twist"):
        assert float(trace[name][-1]) == float(at["final_state"].sel(state=name).squeeze())


def test_rocks_are_an_axis_and_every_drive_takes_the_surface():
    lines = DISTURBED + "simulation: {transient: 1 s, observe: 1 s}\n"
    both = nsdrill.run(text(lines=f"{lines}sweep: {{bit.rock.law: [lobed, regenerative]}}\n"), progress=False)
    assert both["bit_force_max"].size == 2
    assert np.all(both["status"].values == 1)
    for kind in ("soft_torque", "lqr", "dc_motor"):
        found = nsdrill.run(text(drive=kind, lines=lines), progress=False)
        assert int(found["status"].squeeze()) == 1
        assert float(found["rate_of_penetration"].squeeze()) > 0.0


def test_the_hopf_point_of_a_continuation_is_the_threshold():
    study = text(states=8, lines=DISTURBED + "simulation: {rtol: 1.0e-8, transient: 20 s, observe: 5 s}\n")
    study = study.replace(
        "segments: {", "segments: {material_damping: {axial: 5 ms, torsional: 200 ms}, hydraulics: null, "
    )
    threshold = nsdrill.check(study).figures["steady_threshold"].value
    branch = nsdrill.continue_branches(
        study.replace("100 rpm", f"{1.1 * threshold!r} rad/s")
        + f"continue: {{along: rotary_speed, from: {1.1 * threshold!r} rad/s, to: {0.97 * threshold!r} rad/s, "
        "points: 20}\n",
        progress=False,
    )
    found = branch["rotary_speed"].values[branch["label"].values == HOPF]
    assert len(found) > 0
    assert found[0] == pytest.approx(threshold, rel=1e-4)


def test_a_bit_of_another_size_than_the_hole_is_told_with_both():
    def told(lines):
        return [one for one in nsdrill.check(parse_study(lines)).warnings if one.startswith("Bit and hole")]

    study = f"{FEW}bit: {{rock: {{{ROCK}}}}}\n"
    (one,) = told(f"{study}well: {{diameter: 216 mm}}\n")
    assert "200 mm" in one
    assert "216 mm" in one
    assert "bit.radius: 108 mm" in one
    assert not told(study)
    assert not told(f"{FEW}bit: {{radius: 108 mm, rock: {{{ROCK}}}}}\nwell: {{diameter: 216 mm}}\n")
    assert not told(f"{FEW}well: {{diameter: 216 mm}}\n")  # on lobes


def test_what_the_rock_does_not_read_is_refused():
    for line, key in (
        ("bit: {rock: {law: regenerative}, lobes: 2}", "bit.lobes"),
        ("bit: {rock: {law: regenerative}, friction: {level: 0.1}}", "bit.friction.level"),
        ("bit: {rock: {law: regenerative}, cutting: {slow: 0.1 rad/s}}", "bit.cutting.slow"),
        ("bit: {rock: {law: regenerative}}\nsegments: {rock_damping: 1 kN*s/m}", "segments.rock_damping"),
        ("bit: {rock: {blades: 4}}", "bit.rock.blades"),
        ("bit: {rock: {law: regenerative, wear_length: 1 m}}", "bit.rock.wear_length"),
        ("bit: {rock: {law: regenerative}}\nsweep: {bit.rock_stiffness: [10 MN/m, 20 MN/m]}", "bit.rock_stiffness"),
    ):
        with pytest.raises(InputError, match=key.replace(".", "[.]")):
            parse_study(f"model: segments\n{line}\n")


def test_an_interrupted_run_goes_on_to_the_same_bits(tmp_path):
    chain = DISTURBED + "simulation: {transient: 1 s, observe: 1 s}\n"
    chain += "sweep: {rotary_speed: {from: 60 rpm, to: 90 rpm, points: 3}, procedure: up-down}\n"
    whole, cut = tmp_path / "whole.h5", tmp_path / "cut.h5"
    nsdrill.run(text(states=5, lines=chain), whole, progress=False)

    def stopped(progress):
        if progress.done >= 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        nsdrill.run(text(states=5, lines=chain), cut, progress=stopped)
    nsdrill.run(text(states=5, lines=chain), cut, progress=False, resume=True)
    first, second = nsdrill.open_results(whole), nsdrill.open_results(cut)
    for name in ("final_state", "bit_speed_max", "axial_min", "blade_depth_max", "steps"):
        assert first[name].values.tobytes() == second[name].values.tobytes(), name

"""The exponent of a bit that sticks, with explicit and with implicit steps."""

import numpy as np
import pytest

import nsdrill
from nsdrill.models.parts import values_at
from nsdrill.models.registry import model_named
from nsdrill.models.variant import variant_at
from nsdrill.variables import CHAOTIC

FROZEN = {"axial": "frozen", "lateral": "frozen"}
STUDY = {
    "operation": {"depth": "3000 m", "wob": "60 kN"},
    "bit": {"friction": {"static": 0.6, "dynamic": 0.25, "decay": "3 s/rad"}},
    "simulation": {"transient": "150 s", "observe": "60 s"},
    "record": {"poincare": 200, "exponent": True},
}


def found(speeds: list[float], **sections: dict) -> dict[str, np.ndarray]:
    study = STUDY | {"sweep": {"rotary_speed": [f"{v} rad/s" for v in speeds], "procedure": "same"}}
    for name, section in sections.items():
        study[name] = study.get(name, {}) | section
    data = nsdrill.run(study, progress=False)
    return {name: np.ravel(values) for name, values in data.data_vars.items()}


@pytest.mark.parametrize("method", ["explicit", "implicit"])
def test_a_limit_cycle_of_two_states_has_exponent_zero(method):
    """Torsional stick-slip, stuck for a fifth to a half of the time."""
    out = found([3.0, 5.0, 7.0], modes=FROZEN, simulation={"method": method})
    assert (out["stuck_fraction"] > 0.2).all()
    assert (np.abs(out["lyapunov_exponent"]) < 0.01).all()
    assert (np.abs(out["lyapunov_exponent"]) < 2 * out["lyapunov_error"]).all()
    assert (out["lyapunov_error"] < 0.05).all()
    assert not (out["motion"] == CHAOTIC).any()


@pytest.mark.parametrize("method", ["explicit", "implicit"])
def test_nor_do_steps_disturb_an_axial_motion_that_hardly_moves(method):
    """On a smooth rock the bit does not bounce: a limit cycle of four states. Its axial
    deviation is not damped by a step as long as the stick-slip allows."""
    out = found(
        [3.0, 6.0],
        modes={"lateral": "frozen"},
        bit={"surface_amplitude": "0 mm"},
        simulation={"method": method, "observe": "200 s"},
    )
    assert (out["stuck_fraction"] > 0.2).all()
    assert (np.abs(out["lyapunov_exponent"]) < 0.005).all()
    assert not (out["motion"] == CHAOTIC).any()


@pytest.mark.parametrize("method", ["explicit", "implicit"])
def test_a_bit_that_bounces_and_sticks_stays_chaotic(method):
    out = found(
        [3.0, 4.0], modes={"lateral": "frozen"}, bit={"surface_amplitude": "1 mm"}, simulation={"method": method}
    )
    assert (out["stuck_fraction"] > 0.01).all()
    assert (out["motion"] == CHAOTIC).all()
    assert ((out["lyapunov_exponent"] > 0.1) & (out["lyapunov_exponent"] < 1.0)).all()


@pytest.mark.parametrize(
    ("study", "dimension"),
    [
        ({"modes": FROZEN}, 2),  # twist and bit speed
        ({"model": "torsion"}, 2),
        ({"modes": FROZEN, "drive": {"kind": "soft_torque"}}, 4),  # lag and speed of the drive
        ({"modes": FROZEN, "drive": {"kind": "dc_motor"}}, 5),  # and the torque of its motor
        ({"modes": {"lateral": "frozen", "torsional": "frozen"}}, 3),  # height, its rate, the lobes' phase
        ({"modes": {"lateral": "frozen"}}, 5),
        ({"modes": {"lateral": "frozen"}, "bit": {"surface_amplitude": "0 mm"}}, 4),  # nothing depends on the phase
        ({"modes": {"axial": "frozen", "torsional": "frozen"}}, 5),  # the eccentric collar turns
        ({"operation": {"wob": "20 kN"}}, 9),
    ],
)
def test_the_dimension_of_a_flow_counts_what_moves_and_has_an_effect(study, dimension):
    loaded = nsdrill.load_study(study)
    model, operation = model_named(loaded.model.name), loaded.operation
    at = {name: np.array([getattr(operation, name)]) for name in ("depth", "wob", "rotary_speed")}
    points = values_at(loaded.parameters, loaded.initial, at)
    variant, held = variant_at(model, points.parameters), frozenset(model.undeviated(points.parameters))
    assert variant.dimension(model.pack(points, loaded.thresholds), held).tolist() == [dimension]


def test_an_axis_of_the_amplitude_of_lobes_has_several_dimensions():
    """Labelled again: the same labels."""
    study = STUDY | {
        "modes": {"lateral": "frozen"},
        "sweep": {"bit.surface_amplitude": ["0 mm", "1 mm"], "rotary_speed": ["3 rad/s"], "procedure": "same"},
        "simulation": {"transient": "50 s", "observe": "60 s"},
    }
    data = nsdrill.run(study, progress=False)
    assert np.array_equal(nsdrill.classify(data, {}).motion, data.motion)

"""What follows from the equations of a model, beside what is known of it otherwise."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import nsdrill
from nsdrill.equations.library import choose, friction
from nsdrill.errors import InputError
from nsdrill.models.base import Model, Symmetry
from nsdrill.models.friction import friction_rates, hyperbolic, numbers_of
from nsdrill.models.model_description import STICK_ONSET
from nsdrill.models.operation import ModelParameters, Operation, Values
from nsdrill.models.registry import described, model_named
from nsdrill.models.responses import Thresholds
from nsdrill.models.turning import TurningStart
from nsdrill.models.variant import Variant, variant_at
from nsdrill.observe.channels import Channel, Declaration


def pushed(model, **more):
    study = nsdrill.load_study({"model": model, **more})
    options = model_named(study.model.name).options_of(study.parameters)
    return model_named(study.model.name).pushed(options)


# The velocities on which friction acts: of the collar at the wall, of the bit under torque,
# along the hole where friction there is on or the bit has wear flats.
@pytest.mark.parametrize(
    ("model", "more", "wanted"),
    [
        ("torsion", {}, ("bit_speed",)),
        ("christoforou_yigit", {}, ("vx", "vy", "bit_speed")),
        ("christoforou_yigit", {"well.axial_friction": True}, ("vx", "vy", "vz", "bit_speed")),
        ("christoforou_yigit", {"bit.rock.law": "regenerative"}, ("vx", "vy", "vz", "bit_speed")),
        ("beam", {"beam.modes": 2}, ("vx_1", "vy_1", "bit_speed", "vx_2", "vy_2")),
        ("segments", {}, ("bit_speed",)),
        ("segments", {"bit.rock.law": "regenerative"}, ("vz", "bit_speed")),
        ("regenerative", {}, ("vz", "bit_speed")),
    ],
)
def test_friction_pushes_the_velocities_in_its_slips(model, more, wanted):
    assert pushed(model, **more) == wanted


def test_friction_at_rest_brakes_as_its_law_says():
    """(2/pi) eps T / J (docs/numerics.md, steep friction)."""
    about = described("torsion")
    points = Values(about.parameters(), about.initial(), (1000.0, np.array([2e4, 9e4]), 5.0))
    table = model_named(about.name).columns(points, Thresholds())
    wanted = 2 / math.pi * table["bit_smoothing"] * table["torque"] / table["inertia"]
    (key, found), *others = friction_rates(about, points).items()
    assert key == "bit.friction.smoothing"
    assert not others
    np.testing.assert_allclose(found, wanted, rtol=1e-12)


def equations(t, phase, s, p, o):
    slip = s.bit_speed - p.drive_speed
    rub = friction("table", slip=slip, normal=p.normal, law=hyperbolic, numbers=numbers_of(p, "table"))
    return {"bit_speed": -s.twist - rub + p.jump * choose(s.twist > 0.1, s.bit_speed, 0.0)}


class Rubbed(Model):
    """A block that rubs on a table which moves; where its spring is long, a damper may act."""

    name, equations, relative = "rubbed", staticmethod(equations), ("twist",)

    def __init__(self, jump, grazing=()):
        self.jump = jump
        self.description = SimpleNamespace(
            parameters=ModelParameters, initial=TurningStart, operation=Operation, grazing=grazing
        )
        self.declared = Declaration((Channel("bit speed", "bit_speed", "bit_speed_rate"),), ())

    def columns(self, points, thresholds):
        numbers = {"table_smoothing": 50.0, "table_decay": 3.0, "table_rise": 0.1, "table_dynamic": 0.2}
        return {"normal": 2.0, **numbers, "jump": self.jump, "drive_speed": 3.0}


POINTS = Values(SimpleNamespace(point=Operation), TurningStart(), (1000.0, 1e5, 3.0))


def test_names_rates_and_symmetry_of_a_model_that_says_none_of_them():
    model = Rubbed(0.0)
    names = model.names(model.options())
    assert names.states == ("twist", "bit_speed")
    assert names.slopes == ("bit_speed_rate",)
    assert names.parameters[0] == "normal"
    assert names.parameters[-1] == "drive_speed"
    # at the speed of the table: 2 N (2/pi) 50 (0.1 + 0.2) over 1 kg
    assert model.friction_rates(POINTS)["table"] == pytest.approx(2.0 * 2 / math.pi * 50.0 * 0.3)
    assert model.symmetry(POINTS) == Symmetry(0, (0, 1))
    table = {name: np.array([value]) for name, value in model.columns(POINTS, Thresholds()).items()}
    assert model.fastest(table, model.options()).shape == (1,)


def test_branches_of_a_model_whose_slopes_jump_are_refused():
    with pytest.raises(InputError, match=r"rubbed: found slopes that jump at a condition on twist \(.*: equations\)"):
        Rubbed(5.0).symmetry(POINTS)


def test_the_onset_of_sticking_needs_the_speed_below_which_a_bit_counts_as_stuck():
    model = Rubbed(0.0, (STICK_ONSET,))
    with pytest.raises(InputError, match=r"grazing of bit, .* a level that is a lane parameter"):
        Variant(model, model.options()).levels  # noqa: B018
    channel = replace(model.declared.channels[0], level="normal")
    model.declared = Declaration((channel,), ())
    model.measured = ()
    (level,) = Variant(model, model.options()).levels
    assert (level.velocity, level.parameter) == (1, 0)
    for name in ("torsion", "regenerative", "christoforou_yigit"):
        about = described(name)
        variant = variant_at(model_named(name), about.parameters())
        (found,) = variant.levels
        assert variant.names.parameters[found.parameter] in ("stuck", "stuck_below")
        assert not variant_at(model_named("beam"), described("beam").parameters()).levels

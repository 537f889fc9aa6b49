"""How much further stick-slip lasts by dry friction, against a cycle that is integrated piecewise here."""

import json
import math

import pytest
from figures.test_wording import FREE, ROLLS, made
from scipy.integrate import solve_ivp
from scipy.optimize import bisect

from nsdrill.analysis.window import find_window
from nsdrill.app.answering.answers import plain_window
from nsdrill.app.check import check
from nsdrill.data import STICKS_TO, json_text
from nsdrill.models.christoforou_yigit.coefficients import bit_arm, bit_load, derive, static_arm
from nsdrill.models.dry import by_dry
from nsdrill.models.parts import values_at
from nsdrill.models.registry import checks_of
from nsdrill.study import parse_study
from nsdrill.units import to_si

STRING = """
drillstring:
  collar: {outer_diameter: 6 1/2 in, inner_diameter: 2.8125 in, length: 540 ft, span: 30 ft}
  pipe: {outer_diameter: 5 in, inner_diameter: 4.276 in}
  torsional_damping: 11 ft*lbf*s/rad
well: {diameter: 8 1/2 in}
bit: {lobes: 1, friction: {static: 0.6, dynamic: 0.4}}
drive: {kind: ideal}
operation: {depth: 10000 ft, wob: 12 klbf, rotary_speed: 120 rpm}
"""


def dry_fold(study) -> float:
    """The greatest speed [rad/s] of a held top at which a bit that breaks away comes to rest again."""
    parameters, (depth, wob, _) = study.parameters, (3048.0, float(study.operation.wob), 0.0)
    k = derive(parameters, depth, wob, 10.0)
    load, damping = float(bit_load(parameters, wob)), float(parameters.drillstring.torsional_damping)

    def slips_on(speed: float) -> float:
        at = derive(parameters, depth, wob, speed)  # the depth of cut is that of steady drilling

        def slope(_, state):
            twist, bit = state
            torque = load * float(bit_arm(parameters, at, max(bit, 0.0), "unsmoothed"))
            return speed - bit, (k.k_t * twist - damping * bit - torque) / k.J

        def rests(time, state):
            return state[1] - 1e-5 if time > 0.1 else 1.0

        rests.terminal, rests.direction = True, -1.0
        start = [load * float(static_arm(parameters, at)) / k.k_t, 1e-5]
        found = solve_ivp(slope, (0.0, 12.0), start, events=rests, rtol=1e-8, atol=1e-10)
        return -1.0 if found.t_events[0].size else 1.0

    return bisect(slips_on, 4.0, 14.0, xtol=0.01)


def fold_of(study) -> float:
    return check(study).figures["stick_slip_fold"].value


def folds_of(study, wob="12 klbf", smoothing=500.0):
    """Those of the study and of dry friction [rad/s]."""
    at = {"depth": 3048.0, "wob": to_si(wob, "N"), "rotary_speed": 10.0, "bit.friction.smoothing": smoothing}
    folds = checks_of(study.model).stick_slip_folds
    (now,), (dry,) = by_dry(folds, [values_at(study.parameters, study.initial, at)])
    return now, dry


def test_the_end_is_that_of_a_dry_cycle():
    study = parse_study(STRING)
    now, dry = folds_of(study)
    assert now == pytest.approx(fold_of(study))
    assert dry == pytest.approx(dry_fold(study), rel=0.02)
    assert 1.07 < dry / now < 1.13
    meaning = check(study).figures["stick_slip_fold"].meaning
    more = f"by dry friction, without smoothing, {100 * (dry / now - 1):.0f} % more"
    assert meaning.endswith(f"(by its cycle, to 2 %; {more})")


@pytest.mark.parametrize("wob", ["8 klbf", "14 klbf", "17 klbf", "20 klbf"])
def test_steeper_friction_sticks_to_no_lower_speed(wob):
    """Of a bit that comes to rest in a step the torque does not fall in it: at 17 klbf a smoothing of 1e5 s/rad gave
    108 rpm, and 500 s/rad 114.6."""
    study = parse_study(STRING)
    found = [folds_of(study, wob, steep)[0] for steep in (500.0, 2e3, 1e4, 3e4, 9e4)]
    assert found == sorted(found)
    assert folds_of(study, wob)[1] == pytest.approx(found[-1], rel=2e-3)


def test_steeper_friction_is_nearer_to_dry():
    steep = parse_study(STRING, overrides=["bit.friction.smoothing=1e6 s/rad"])
    now, dry = folds_of(steep, smoothing=1e6)
    assert now == dry
    assert fold_of(steep) == pytest.approx(dry_fold(steep), rel=0.02)
    assert check(steep).figures["stick_slip_fold"].meaning.endswith("(by its cycle, to 2 %)")


def test_friction_without_smoothing_has_none():
    study = parse_study(STRING, overrides=["bit.friction={law: rational}"])
    now, dry = folds_of(study)
    assert now == dry


def ends_of(own, dry):
    """Those that are told where the ``own`` search of smoothed friction and that of ``dry`` friction give these."""
    one = values_at(
        parse_study(STRING).parameters, parse_study(STRING).initial, {"depth": 3048.0, "wob": 5e4, "rotary_speed": 10.0}
    )
    return by_dry(lambda settings: [own, dry][: len(settings)], [one])[1][0]


@pytest.mark.parametrize(
    ("own", "dry", "told"), [(4.0, 5.0, 5.0), (4.0, 3.99, 4.0), (None, 5.0, 5.0), (0.0, 0.0, 0.0), (None, None, None)]
)
def test_dry_friction_sticks_to_no_lower_speed(own, dry, told):
    assert ends_of(own, dry) == told


@pytest.mark.parametrize(("own", "dry"), [(4.0, None), (4.0, math.nan), (math.nan, 5.0), (math.nan, math.inf)])
def test_an_end_by_dry_friction_that_is_not_found_is_not_known(own, dry):
    assert math.isnan(ends_of(own, dry))


def test_a_dry_cycle_at_every_speed_is_no_end():
    assert math.isinf(ends_of(4.0, math.inf))


def test_a_dry_end_that_a_torque_limit_hides_is_told(monkeypatch):
    """The cycle of dry friction needs more torque of the motor than that of smoothed friction."""
    study = parse_study(STRING)
    monkeypatch.setattr("nsdrill.models.dry.by_dry", lambda folds, settings: ([9.0], [math.nan]))
    assert "by dry friction, without smoothing, not known)" in check(study).figures["stick_slip_fold"].meaning


@pytest.mark.parametrize(("dry", "first"), [(86.0, 90.0), (75.0, 80.0), (71.0, 80.0)])
def test_what_to_stay_within_begins_above_the_end_by_dry_friction(dry, first):
    """It goes from 80 rpm on, and stick-slip lasts to 71 rpm in the runs, by dry friction to 86 or 75."""
    results, shown = made(up=FREE, down=ROLLS), to_si("71 rpm", "rad/s")
    ends = {"over": [], "unstable_to": [0.0], "lasts_to": [to_si(f"{dry} rpm", "rad/s")], "shown_to": [shown]}
    results.attrs.update({STICKS_TO: json_text({**ends, "from_rest": False})})
    found = find_window(results)
    assert found["answer"].stay_within["rotary_speed"].low == pytest.approx(to_si(f"{first} rpm", "rad/s"))
    assert found["answer"].point["rotary_speed"] > ends["lasts_to"][0]
    data = json.dumps(plain_window(found, "field")["answer"])
    assert ("stick-slip of dry friction" in data) == ('"is_dry": true' in data) == (dry == 86.0)

"""How much further stick-slip lasts by dry friction, against a cycle that is integrated piecewise here."""

import math

import pytest
from figures.test_wording import FREE, ROLLS, made
from scipy.integrate import solve_ivp
from scipy.optimize import bisect

from nsdrill.analysis.window import find_window
from nsdrill.app.check import check, dry_friction
from nsdrill.data import DRY_FRICTION, STICKS_TO, json_text
from nsdrill.models.christoforou_yigit.coefficients import bit_arm, bit_load, derive, static_arm
from nsdrill.models.dry import dry_friction as ratio_of
from nsdrill.models.parts import values_at
from nsdrill.models.registry import checks_of
from nsdrill.study import parse_study
from nsdrill.units import to_si
from nsdrill.words.answer import warnings

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


def test_the_ratio_is_that_of_a_dry_cycle():
    study = parse_study(STRING)
    ratio = dry_friction(study)
    assert ratio * fold_of(study) == pytest.approx(dry_fold(study), rel=0.02)
    assert 1.07 < ratio < 1.13
    meaning = check(study).figures["stick_slip_fold"].meaning
    more = f"by dry friction, without smoothing, {100 * (ratio - 1):.0f} % more"
    assert meaning.endswith(f"(by its cycle, to 2 %; {more})")


def test_steeper_friction_is_nearer_to_dry():
    steep = parse_study(STRING, overrides=["bit.friction.smoothing=1e6 s/rad"])
    assert dry_friction(steep) is None
    assert fold_of(steep) == pytest.approx(dry_fold(steep), rel=0.02)
    assert check(steep).figures["stick_slip_fold"].meaning.endswith("(by its cycle, to 2 %)")


def test_friction_without_smoothing_has_none():
    study = parse_study(STRING, overrides=["bit.friction={law: rational}"])
    values = values_at(study.parameters, study.initial, {"depth": 3048.0, "wob": 5e4, "rotary_speed": 10.0})
    assert ratio_of(checks_of(study.model).stick_slip_folds, [values]) is None


@pytest.mark.parametrize(("more", "is_told"), [(1.2, True), (1.05, False), (0.0, False)])
def test_a_window_tells_where_one_may_stay_below_the_end_by_dry_friction(more, is_told):
    """It goes from 80 rpm on, and stick-slip lasts to 71 rpm: to 86 by dry friction, or to 75."""
    results = made(up=FREE, down=ROLLS)
    ends = {"over": [], "unstable_to": [0.0], "lasts_to": [to_si("71 rpm", "rad/s")], "from_rest": False}
    results.attrs.update({STICKS_TO: json_text(ends), DRY_FRICTION: more})
    found = find_window(results)
    told = [text for text in warnings(found, "field") if text.startswith("SMOOTHED FRICTION")]
    assert bool(told) == is_told
    assert math.isclose(found["dry_friction"] or 0.0, more)
    if is_told:
        assert "lasts to 86 rpm, not to 71 rpm" in told[0]

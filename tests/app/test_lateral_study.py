"""Swirl, stabilisers, inclination and the wall in a study: what is refused, what files
say, the label of the low side, a start on the wall."""

import numpy as np
import pytest

import nsdrill
from nsdrill import StudyError
from nsdrill.app.answering.summary import reclassify
from nsdrill.app.running.run import run_in_memory
from nsdrill.models.christoforou_yigit.parameters import Parameters, Stabilizer
from nsdrill.study import parse_study
from nsdrill.variables import IRREGULAR, LOW_SIDE

from .alike import starting_in

WHIRL = """
modes: {axial: frozen, torsional: frozen}
drillstring: {lateral_softening: static}
operation: {wob: 66.72 kN}
simulation: {transient: 100 s, observe: 40 s}
"""


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("stabilizer: {clearance: 80 mm}", r"stabilizer.clearance: found '80 mm'; allowed: below the gap .* 76.2 mm"),
        ("stabilizer: {clearance: 70 mm}\nsweep: {well.diameter: [14 in, 15 in]}", r"below the gap .* 63.5 mm"),
        ("sweep: {stabilizer.clearance: [0 mm, 80 mm]}", "80 mm at the greatest of sweep.stabilizer.clearance"),
        ("stabilizer: {friction: {static: 0.4}}", "stabilizer.clearance: null does without"),
        (
            "sweep: {stabilizer.friction.decay: [0 s/m, 3 s/m]}",
            "axis over stabilizer.friction.decay, which stabilizer.clearance: null does without",
        ),
        (
            "stabilizer: {clearance: 0 mm, friction: {static: 0.2}}",
            "at least stabilizer.friction.dynamic, which is 0.3",
        ),
        ("modes: {lateral: frozen}\nwell: {inclination: 30 deg}", "'30 deg', which modes.lateral: frozen"),
        ("modes: {lateral: frozen}\nstabilizer: {clearance: 1 mm}", "which modes.lateral: frozen"),
        ("modes: {lateral: frozen}\nsweep: {mud.swirl: [0, 0.5]}", "which modes.lateral: frozen"),
        ("modes: {axial: frozen}\nwell: {axial_friction: true}", "found true, which modes.axial: frozen"),
        ("well: {inclination: 91 deg}", "at least 0 and at most 90 deg"),
        ("well: {inclination: 30}", "without a unit"),
        ("well: {axial_friction: 1}", "true or false"),
        ("mud: {swirl: -0.1}", "at least 0 and at most 1"),
    ],
)
def test_what_cannot_be_is_refused(text, said):
    with pytest.raises(nsdrill.StudyError, match=said):
        parse_study(text)


def test_records_check_the_clearance_too():
    with pytest.raises(ValueError, match=r"stabilizer\.clearance: found 0.08 m, allowed: below the gap"):
        Parameters(stabilizer=Stabilizer(0.08))


def test_a_span_that_nothing_holds_is_told():
    soft = "operation: {wob: 3 MN}\nwell: {stiffness: 0.1 MN/m}"
    assert any(word.startswith("Unheld") for word in nsdrill.check(soft).warnings)
    assert any(word.startswith("Buckled") for word in nsdrill.check("operation: {wob: 3 MN}").warnings)


@pytest.fixture(scope="module")
def inclined(tmp_path_factory):
    path = tmp_path_factory.mktemp("inclined") / "out.h5"
    study = (
        f"{WHIRL}\nsweep: {{well.inclination: [0 deg, 60 deg], rotary_speed: [3 rad/s, 12 rad/s]}}\n"
        "stabilizer: {clearance: 2 mm, friction: {static: 0, dynamic: 0}}"
    )
    nsdrill.run(study, path)
    return path


def test_a_collar_on_the_low_side_is_called_so(inclined):
    found = nsdrill.open_results(inclined)
    rides = found.sel(well_inclination=np.radians(60), rotary_speed=3.0, method="nearest")
    assert int(rides.whirl_kind) == LOW_SIDE
    assert (float(rides.wall_contact_fraction), abs(float(rides.whirl_ratio))) == pytest.approx((1.0, 0.0), abs=1e-2)
    # It climbs against the drive.
    assert (float(rides.x_mean), float(rides.y_mean)) == pytest.approx((-0.0141, -0.0713), abs=1e-3)
    assert float(rides.stabilizer_contact_fraction) == 1.0
    upright = found.isel(well_inclination=0)
    assert np.isnan(upright.y_mean.values).all()
    assert not np.any(upright.whirl_kind.values == LOW_SIDE)
    assert found.whirl_kind.attrs["flag_meanings"].split()[LOW_SIDE] == "low_side"


def test_labels_of_a_file_can_be_made_anew(inclined, tmp_path):
    """A collar that is never that long on the wall is irregular, and low side comes
    back with the old threshold."""
    path = tmp_path / "again.h5"
    path.write_bytes(inclined.read_bytes())
    rides = nsdrill.open_results(path).load().whirl_kind.values == LOW_SIDE
    assert rides.any()
    reclassify(path, ["classify.whirl.direction=0"])
    kind = nsdrill.open_results(path).load().whirl_kind.values
    assert not np.any(kind == LOW_SIDE)
    assert not np.any(kind == IRREGULAR)
    assert reclassify(path, [])["whirl_kind"][0] > 0
    now = nsdrill.open_results(path).load().whirl_kind.values
    assert np.array_equal(now == LOW_SIDE, rides)


def test_points_are_replayed_to_the_bit(inclined):
    """Also the vertical one, which a replay runs without the code of the option."""
    for degrees in (0.0, 60.0):
        at = {"well.inclination": f"{degrees} deg"}
        assert nsdrill.replay(inclined, rotary_speed="3 rad/s", at=at).attrs["same_bits"]


# 67 kN buckle the span, so the collar leans on the wall, and at 10 rad/s it rolls all
# the time.
ROLLING = """\
operation: {depth: 3000 m, wob: 66.72 kN}
sweep: {rotary_speed: [10 rad/s]}
simulation: {transient: 20 s, observe: 5 s}
record: {peaks: 4}
"""


def test_the_final_state_of_a_rolling_run_is_the_start_of_another():
    first = run_in_memory(parse_study(ROLLING))
    assert first["wall_contact_fraction"].item() == 1.0
    final = first["final_state"].ravel()
    gap = (0.381 - 0.2286) / 2
    assert np.hypot(final[0], final[2]) > gap + 1e-3
    second = run_in_memory(parse_study(ROLLING, "s", [*starting_in(final), "simulation.transient=0 s"]))
    assert second["initial_state"].tobytes() == first["final_state"].tobytes()
    assert second["wall_contact_fraction"].item() == 1.0
    assert second["rolling_ratio"].item() == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize(
    ("wall", "deepest"),
    # The gap, 76.2 mm, and what 10 MN press: F/k, or (F/k)^(2/3) with the Hertz law.
    [("stiffness: 1 GN/m", 0.0762 + 0.01), ("law: hertz, stiffness: 1e10 N/m^1.5", 0.0762 + 0.01)],
)
def test_how_deep_in_the_wall(wall, deepest):
    parse_study(f"{ROLLING}well: {{{wall}}}\ninitial: {{x: 0 m, y: {deepest - 1e-6} m}}")
    with pytest.raises(StudyError, match=r"at most 86.2 mm: the gap between collar and wall, 76.2 mm"):
        parse_study(f"{ROLLING}well: {{{wall}}}\ninitial: {{x: 0 m, y: {deepest + 1e-6} m}}")

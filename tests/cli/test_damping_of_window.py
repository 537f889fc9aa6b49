"""What a window and its page say of a damping of torsion that is unusual, of torques above those
off bottom, and of the speed at which a sweep is to begin."""

import json
import re

import pytest

import nsdrill
from nsdrill.app.check import lasting_motions
from nsdrill.models.begin import begin_below
from nsdrill.store.results import read_results
from nsdrill.study.load import load_study

STUDY = """units: si
drillstring: {{eccentricity: 0 mm{damping}}}
bit: {{lobes: 1, surface_amplitude: 0 mm}}
modes: {{axial: frozen, lateral: frozen}}
operation: {{depth: 3000 m, wob: 60 kN}}
sweep: {{rotary_speed: [3 rad/s, 4 rad/s, 14 rad/s, 15 rad/s, 16 rad/s], procedure: up-down, along: rotary_speed}}
simulation: {{transient: 60 s, observe: 40 s}}
"""


@pytest.fixture
def ran(call, tmp_path):
    def run(damping=""):
        study, found = tmp_path / "study.yaml", tmp_path / f"of{len(damping)}.h5"
        study.write_text(STUDY.format(damping=damping))
        call("run", study, "-o", found)
        return found

    return run


def test_a_damping_that_decides_is_among_the_first_warnings(call, ran):
    warning = "THE DEFAULT DAMPING OF TORSION IS UNUSUAL"
    found = ran()
    assert warning in call("window", found).out
    said = next(one for one in json.loads(call("window", found, "--json").out)["answer"]["warnings"] if warning in one)
    low, high = (float(re.search(rf"{words} up to ([\d.]+) rad/s", said)[1]) for words in ("alone lasts", "study"))
    assert low > high
    answer = json.loads(call("window", found, "--json", "--units", "si").out)["answer"]
    assert 0.0 <= high - answer["sticks_to"]["rotary_speed"] < 0.1, "the same speed, rounded outwards to 0.1 rad/s"
    usual = re.search(r"With 0.03, ([\d.]+ \S+)", said)[1]
    assert "DAMPING OF TORSION" not in call("window", ran(f", torsional_damping: {usual}"), "--all").out


def test_a_damping_is_judged_with_the_numbers_of_the_samples():
    """Friction that a fit has moved: with that of the study itself stick-slip would last to twice the speed."""
    samples = "{bit.friction.static: [0.35, 0.36], bit.friction.dynamic: [0.25, 0.245]}"
    of_samples = STUDY.format(damping="") + f"uncertain: {{samples: 2, table: {samples}}}\n"
    friction = "surface_amplitude: 0 mm, friction: {static: 0.36, dynamic: 0.245}"
    of_them = STUDY.format(damping="").replace("surface_amplitude: 0 mm", friction)
    drawn, moved, nominal = (
        nsdrill.window(nsdrill.run(text, progress=False)) for text in (of_samples, of_them, STUDY.format(damping=""))
    )
    (one,), (other,), (far,) = (found["damping_of_torsion"]["lasts"] for found in (drawn, moved, nominal))
    for end in ("now", "usual"):
        assert one[end] == pytest.approx(other[end], rel=1e-6)
        assert far[end] > 1.5 * one[end]
    assert drawn["damping_of_torsion"]["sample"] == 1
    said = next(text for text in drawn["answer"]["warnings"] if "DAMPING OF TORSION" in text)
    assert "in the sample where it lasts longest" in said


def test_torques_are_those_above_off_bottom_at_their_speed(call, ran):
    """By the damping of the string, 50 N m s/rad, which is all that turns it off bottom."""
    found = ran()
    answer = json.loads(call("window", found, "--json", "--units", "si").out)["answer"]
    seen, point = answer["surface"], answer["point"]
    results = read_results(str(found))
    place = results.coords["rotary_speed"].tolist().index(point["rotary_speed"])
    whole = float(results["surface_torque_mean"][0].ravel()[place])
    assert seen["off_bottom"]["surface_torque_mean"] == pytest.approx(50.0 * point["rotary_speed"], rel=1e-6)
    assert seen["torque"]["surface_torque_mean"] == pytest.approx(whole - 50.0 * point["rotary_speed"], rel=1e-6)
    at = seen["sticking_at"]["rotary_speed"]
    least = float(results["surface_torque_min"][0].ravel()[results.coords["rotary_speed"].tolist().index(at)])
    assert seen["sticking"]["from"] == pytest.approx(least - 50.0 * at, rel=1e-6)
    told = " ".join(call("window", found, "--units", "si").out.split())
    assert "Surface, above the torque off bottom: free" in told
    assert f"; stick-slip at {at:g} rad/s" in told


@pytest.mark.usefixtures("words_only")
def test_a_page_names_the_damping_and_the_friction_that_decide(call, ran, tmp_path):
    call("report", ran(), "--one-page", "-o", tmp_path / "page.html")
    page = re.sub(r"<[^>]+>", " ", (tmp_path / "page.html").read_text())
    assert "These decide, as by default: torsional damping and bit friction." in page
    assert re.search(r"torsional damping 50 .*; .*bit friction static", page)


def test_check_and_window_ask_for_the_same_begin(call, tmp_path):
    """Lobes may shake the bit loose where the sweep begins, so that no run sticks below; the
    begin that check asks for silences it."""
    study = tmp_path / "study.yaml"
    study.write_text(
        STUDY.format(damping=", torsional_damping: 20 N*m*s/rad")
        .replace("axial: frozen, ", "")
        .replace("lobes: 1, surface_amplitude: 0 mm", "lobes: 3, surface_amplitude: 3 mm")
        .replace("[3 rad/s, 4 rad/s, ", "[6 rad/s, 8 rad/s, ")
    )
    asked = re.search(r"Begin the sweep below ([\d.]+ rad/s)", " ".join(call("check", study).err.split()))[1]
    over = [one for one in lasting_motions(load_study(study)) if one["from"] is not None]
    assert float(asked.split()[0]) == pytest.approx(begin_below(over), rel=1e-3)
    lower = float(asked.split()[0]) - 0.1
    assert "Start:" not in call("check", study, "--set", f"sweep.rotary_speed=[{lower:g} rad/s, 8 rad/s]").err

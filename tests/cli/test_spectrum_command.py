"""The command that measures all Lyapunov exponents of a point."""

import json

import pytest
import yaml

import nsdrill

SWEEP = {"operation": {"wob": "20 kN"}, "sweep": {"rotary_speed": ["6 rad/s", "12 rad/s"], "procedure": "up"}}
TIMES = {"simulation": {"transient": "5 s", "observe": "3 s"}}


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    path = tmp_path_factory.mktemp("spectrum") / "out.h5"
    nsdrill.run(yaml.safe_dump(SWEEP | TIMES), path, progress=False)
    return str(path)


def test_one_point_of_a_drill_string(swept, call):
    answer = json.loads(call("spectrum", swept, "--rotary-speed", "12rad/s", "--json", "-q").out)
    exponents = answer["exponents"]
    assert exponents == sorted(exponents, reverse=True)
    assert len(exponents) == len(answer["errors"])
    assert answer["at"]["rotary_speed"] == 12.0
    assert answer["procedure"] == "up"
    assert answer["seconds"] == 3.0
    assert answer["sum"] == pytest.approx(sum(exponents))
    text = call("spectrum", swept, "--rotary-speed", "12rad/s", "--duration", "2s", "-q").out
    assert "over 2 s from the end of its run" in text
    assert "Kaplan-Yorke dimension" in text
    assert "had not settled" in text  # after 5 s it cannot have


def test_a_frozen_mode_has_no_exponents():
    study = yaml.safe_dump(SWEEP | TIMES | {"modes": {"lateral": "frozen"}})
    found = nsdrill.lyapunov_spectrum(nsdrill.run(study, progress=False), rotary_speed="12 rad/s", duration="3 s")
    assert len(found["exponents"]) == 4
    assert all(exponent != 0.0 for exponent in found["exponents"])

"""What a study says of units, and what is taken but may not be meant."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import nsdrill
from nsdrill.study.load import parse_study

from .helpers import Call

STUDY = """\
title: Field units
units: field
operation: {wob: 15 klbf}
well: {diameter: 12 1/4 in}
drillstring: {collar: {outer_diameter: 8"}}
sweep: {rotary_speed: {from: 100 RPM, to: 40 RPM, points: 4}}
simulation: {transient: 1 s, observe: 2 s}
"""


@pytest.fixture
def study(tmp_path: Path) -> Path:
    path = tmp_path / "study.yaml"
    path.write_text(STUDY, encoding="utf-8")
    return path


@pytest.fixture
def results(study: Path, tmp_path: Path) -> Path:
    nsdrill.run(study, tmp_path / "out.h5", progress=False)
    return tmp_path / "out.h5"


def test_sizes_are_taken_as_people_write_them() -> None:
    found = parse_study(STUDY)
    assert found.parameters.well.diameter == pytest.approx(12.25 * 0.0254)
    assert found.parameters.drillstring.collar.outer_diameter == pytest.approx(8 * 0.0254)
    assert found.units == "field"
    assert parse_study("title: none").units == "si"


def test_units_change_no_number_and_may_differ_on_resume(study: Path, call: Call) -> None:
    other = STUDY.replace("units: field\n", "")
    assert parse_study(STUDY).sha256 == parse_study(other).sha256
    call("run", study, "-o", "out.h5")
    study.write_text(other, encoding="utf-8")
    call("run", study, "-o", "out.h5", "--resume")


def test_the_study_decides_the_units_of_check(study: Path, call: Call) -> None:
    assert "At 16404.2 ft, 15 klbf (66.72 kN)" in call("check", study).out
    assert "At 5000 m, 66.7233 kN (15 klbf)" in call("check", study, "--units", "si").out
    asked = json.loads(call("check", study, "--json").out)
    assert asked["coefficients"]["gap"]["units"] == "in"
    plain = json.loads(call("check", study, "--json", "--set", "units=si").out)
    assert plain["coefficients"]["gap"] == pytest.approx({"value": (12.25 - 8) * 0.0254 / 2, "units": "m"})


def test_the_study_decides_the_units_of_what_is_shown(
    results: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert "40 rpm to 100 rpm" in call("show", results).out
    assert "rpm" not in call("show", results, "--units", "si").out
    window = ["window", results, "--severity", "4"]
    assert "ksi" in call(*window).out
    assert "MPa" in call(*window, "--units", "si").out
    assert "rpm" in nsdrill.show(results)
    assert "rpm" in nsdrill.show(nsdrill.open_results(results))
    assert "rpm" not in nsdrill.show(results, units="si")
    labels = [axis.get_xlabel() for axis in nsdrill.plot(results).axes]
    assert any("rpm" in label for label in labels)
    call("plot", results, "-o", "out.svg")
    call("report", results, "-o", "out.html", "--motions", "0")
    assert "rpm" in Path("out.html").read_text(encoding="utf-8")
    monkeypatch.setenv("NSDRILL_UNITS", "si")
    assert "rpm" not in call("show", results).out


def test_a_table_for_programs_stays_in_si(results: Path, call: Call) -> None:
    assert "rotary_speed [rad s-1]" in call("export", results, "-o", "-").out
    assert "rotary_speed [rpm]" in call("export", results, "-o", "-", "--units", "field").out


def test_the_written_study_keeps_its_units(results: Path, call: Call) -> None:
    text = call("show", results, "--study").out
    assert "\nunits: field " in text
    assert parse_study(text).units == "field"


def test_wrong_units_are_refused(call: Call) -> None:
    Path("bad.yaml").write_text("units: metric\n", encoding="utf-8")
    assert "bad.yaml, line 1: units: found 'metric'; allowed: si or field." in call("check", "bad.yaml", code=2).err


def test_a_range_that_descends_is_said(study: Path, call: Call) -> None:
    said = "sweep.rotary_speed goes from 100 RPM down to 40 RPM"
    assert said in call("check", study).err
    assert any(said in text for text in json.loads(call("check", study, "--json").out)["warnings"])
    answer = call("run", study, "-o", "out.h5", "--quiet")
    assert answer.err.count(said) == 1
    study.write_text(STUDY.replace("from: 100 RPM, to: 40", "from: 40 RPM, to: 100"))
    assert "goes from" not in call("check", study).err


def test_an_output_without_the_ending_of_hdf5_is_said(study: Path, call: Call) -> None:
    assert "out.csv will be an HDF5 file whatever its name" in call("run", study, "-o", "out.csv").err
    assert "whatever its name" not in call("run", study, "-o", "out.h5").err
    assert "trace will be an HDF5" in call("simulate", study, "-o", "trace").err

"""Units on the command line: the same numbers in field units, answers in the unit asked,
what a study says of units."""

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nsdrill
from nsdrill.store import read_results
from nsdrill.study.load import parse_study
from nsdrill.text.words import in_units
from nsdrill.units import from_si

from .helpers import Call, unwrapped

KLBF, FOOT, INCH, RPM, TURN = 4448.2216152605, 0.3048, 0.0254, np.pi / 30, 2 * np.pi


def both(call: Call, *words: object) -> tuple[Any, Any]:
    si, field = (json.loads(call(*words, "--json", "--units", units).out) for units in ("si", "field"))
    return si, field


def test_warnings_of_check(call, small):
    more = ["--set", "drillstring.eccentricity=10 cm", "--set", "simulation.observe=20 s"]
    said = unwrapped(call("check", small, *more, "--units", "field").err)
    assert "the eccentricity (3.937 in) exceeds the clearance (3 in)" in said
    assert "at 9.549 rpm the observation of" in said
    assert both(call, "check", small, *more)[1]["warnings"][0] in said


def test_csv(call, shared):
    call("export", shared / "map.h5", "-o", "si.csv", "--peaks", "--states")
    call("export", shared / "map.h5", "-o", "field.csv", "--peaks", "--states", "--units", "field")
    (heads, *rows), (shown, *others) = (
        list(csv.reader(Path(f"{name}.csv").read_text().splitlines())) for name in ("si", "field")
    )
    assert len(rows) == len(others) == 20
    changed = {
        "wob [N]": ("wob [klbf]", KLBF),
        "depth [m]": ("depth [ft]", FOOT),
        "axial_peaks_0 [m]": ("axial_peaks_0 [in]", INCH),
        "final_state_twist [rad]": ("final_state_twist [rev]", TURN),
        "initial_state_x [m]": ("initial_state_x [in]", INCH),
        "bit_speed_max [rad s-1]": ("bit_speed_max [rpm]", RPM),
    }
    for head, (other, scale) in changed.items():
        column, same = heads.index(head), shown.index(other)
        assert column == same
        values = [float(row[column]) / scale for row in rows]
        assert [float(row[same]) for row in others] == pytest.approx(values, nan_ok=True)
    for column, (head, other) in enumerate(zip(heads, shown, strict=True)):
        if head == other:
            assert [row[column] for row in rows] == [row[column] for row in others]
    wob = read_results(shared / "map.h5").coords["wob"]
    assert others[0][shown.index("wob [klbf]")] == repr(from_si(float(wob[0]), "klbf"))


def test_netcdf_stays_in_si_and_says_so(call, shared):
    assert "stays in SI units" in call("export", shared / "map.h5", "-o", "a.nc", "--units", "field").err
    assert "SI" not in call("export", shared / "map.h5", "-o", "b.nc").err
    assert Path("a.nc").read_bytes() == Path("b.nc").read_bytes()


def test_the_variable_sets_the_default_and_the_option_wins(call, shared, monkeypatch):
    plain, field = (call("show", shared / "map.h5", "--units", units).out for units in ("si", "field"))
    assert plain != field
    monkeypatch.setenv("NSDRILL_UNITS", "Field")
    assert call("show", shared / "map.h5").out == field
    assert call("show", shared / "map.h5", "--units", "SI").out == plain
    monkeypatch.setenv("NSDRILL_UNITS", "")
    assert call("show", shared / "map.h5").out == plain


@pytest.mark.parametrize(
    "words",
    [
        ["check", "small.yaml"],
        ["show", "map.h5"],
        ["window", "map.h5"],
        ["export", "map.h5", "-o", "new.csv"],
        ["plot", "map.h5", "-o", "new.png"],
        ["diff", "map.h5", "map.h5"],
        ["replay", "map.h5", "-o", "new.h5"],
    ],
)
def test_another_system_is_an_error_in_words(call, shared, monkeypatch, words):
    words = [str(shared / word) if (shared / word).exists() else word for word in words]
    answer = call(*words, "--units", "metric", code=2)
    assert answer.out == ""
    assert answer.err == "Error: --units: found 'metric'; allowed: si or field.\n"
    monkeypatch.setenv("NSDRILL_UNITS", "imperial")
    answer = call(*words, code=2)
    assert answer.out == ""
    assert answer.err == "Error: NSDRILL_UNITS: found 'imperial'; allowed: si or field.\n"
    assert not list(Path().iterdir())


def test_every_value_that_is_printed_can_be_given_back(call, tmp_path):
    study = tmp_path / "odd.yaml"
    study.write_text(
        "sweep: {depth: {from: 1000 m, to: 7000 m, points: 14}, wob: [5 klbf, 10 klbf]}\n"
        "simulation: {transient: 0.1 s, observe: 0.1 s}\n"
    )
    call("run", study, "-o", "odd.h5")
    si = json.loads(call("show", "odd.h5", "--json").out)
    assert si["axes"]["depth"]["points"] == 14
    for asked in ("2846.15 m", "9337.77 ft"):  # the fifth, 1000 + 4 * 6000 / 13
        assert "nearest" not in call("plot", "odd.h5", "--depth", asked, "-o", "cut.png", "--overwrite").err


@pytest.mark.parametrize("units", ["si", "field"])
def test_one_point_is_one(call, tmp_path, units):
    study = tmp_path / "one.yaml"
    study.write_text("simulation: {transient: 0.1 s, observe: 0.1 s}\n")
    said = call("check", study, "--units", units).out
    answer = call("run", study, "-o", "one.h5")
    said += answer.err + call("show", "one.h5", "--units", units).out + call("diff", "one.h5", "one.h5").out
    assert "1 point" in said
    assert "1 points" not in said


def test_only_values_of_quantities_are_changed():
    data = {
        "kind": "x",
        "wob": [4448.2216152605],
        "made": [{"name": "python", "value": 3.11, "from": 1.0}],
        "points": 5,
        "share": 0.5,
        "depth": {"open": [[304.8, 609.6]], "closes": None, "share": {"safe": 0.5}},
        "bit.rock_stiffness": 25e6,
        "size": {"value": 1.0, "units": "B"},
        "time": 3.0,
    }
    assert in_units(data, "si") is data
    found = in_units(data, "field")
    assert found["wob"] == pytest.approx([1.0], rel=1e-15)
    assert found["depth"] == {"open": [[1000.0, 2000.0]], "closes": None, "share": {"safe": 0.5}}
    assert found["units"] == {"wob": "klbf", "depth": "ft", "bit.rock_stiffness": "lbf/in"}
    for name in ("kind", "made", "points", "share", "size", "time"):
        assert found[name] == data[name]


def test_an_answer_in_field_units_has_no_value_in_si():
    """The same quantity never in two units; every converted one has its unit beside it."""
    data = {
        "answer": {
            "surface": {"torque": 1355.8179483314, "sticking": [-1355.8179483314, 0.0], "acceleration": 3.048},
            "way_in": {"passing_rate": np.pi / 30},
        },
        "maps": [
            {"safe": 3, "rows": [{"at": {"wob": 4448.2216152605}, "axis": "rotary_speed", "safe": [[np.pi, 6.0]]}]}
        ],
        "lasting_motions": [{"axis": "rotary_speed", "lasts": [np.pi / 30, np.pi], "weights": [0.0, 4448.2216152605]}],
    }
    found = in_units(data, "field")
    surface = found["answer"]["surface"]
    assert surface["torque"] == pytest.approx(1.0, rel=1e-9)
    assert surface["sticking"] == pytest.approx([-1.0, 0.0], rel=1e-9)
    assert found["units"]["torque"] == found["units"]["sticking"] == "kft*lbf"
    assert surface["acceleration"] == pytest.approx(3.048 / 9.80665)
    assert found["answer"]["way_in"]["passing_rate"] == pytest.approx(1.0)
    assert found["units"]["passing_rate"] == "rpm/s"
    assert found["maps"][0]["safe"] == 3
    assert found["maps"][0]["rows"][0]["safe"] == [pytest.approx([30.0, 180.0 / np.pi])]
    assert found["lasting_motions"][0]["lasts"] == pytest.approx([1.0, 30.0])
    assert found["lasting_motions"][0]["weights"] == pytest.approx([0.0, 1.0])


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
def study(tmp_path):
    path = tmp_path / "study.yaml"
    path.write_text(STUDY, encoding="utf-8")
    return path


@pytest.fixture
def results(study, tmp_path):
    nsdrill.run(study, tmp_path / "out.h5", progress=False)
    return tmp_path / "out.h5"


def test_sizes_are_taken_as_people_write_them():
    found = parse_study(STUDY)
    assert found.parameters.well.diameter == pytest.approx(12.25 * 0.0254)
    assert found.parameters.drillstring.collar.outer_diameter == pytest.approx(8 * 0.0254)
    assert found.units == "field"
    assert parse_study("title: none").units == "si"


def test_units_change_no_number_and_may_differ_on_resume(study, call):
    other = STUDY.replace("units: field\n", "")
    assert parse_study(STUDY).sha256 == parse_study(other).sha256
    call("run", study, "-o", "out.h5")
    study.write_text(other, encoding="utf-8")
    call("run", study, "-o", "out.h5", "--resume")


def test_the_study_decides_the_units_of_check(study, call):
    assert "At 16404 ft, 15 klbf (66.7233 kN)" in call("check", study).out
    assert "At 5000 m, 66.7233 kN (15 klbf)" in call("check", study, "--units", "si").out
    asked = json.loads(call("check", study, "--json").out)
    assert asked["coefficients"]["gap"]["units"] == "in"
    plain = json.loads(call("check", study, "--json", "--set", "units=si").out)
    assert plain["coefficients"]["gap"] == pytest.approx({"value": (12.25 - 8) * 0.0254 / 2, "units": "m"})


def test_the_study_decides_the_units_of_what_is_shown(results, call, monkeypatch):
    assert "40 rpm to 100 rpm" in call("show", results).out
    assert "rpm" not in call("show", results, "--units", "si").out
    window = ["window", results, "--severity", "4", "--all"]
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


def test_a_table_for_programs_stays_in_si(results, call):
    assert "rotary_speed [rad s-1]" in call("export", results, "-o", "-").out
    assert "rotary_speed [rpm]" in call("export", results, "-o", "-", "--units", "field").out


def test_the_written_study_keeps_its_units(results, call):
    text = call("show", results, "--study").out
    assert "\nunits: field " in text
    assert parse_study(text).units == "field"


def test_a_range_that_descends_is_said(study, call):
    said = "sweep.rotary_speed goes from 100 RPM down to 40 RPM"
    assert said in call("check", study).err
    assert any(said in text for text in json.loads(call("check", study, "--json").out)["warnings"])
    answer = call("run", study, "-o", "out.h5", "--quiet")
    assert answer.err.count(said) == 1
    study.write_text(STUDY.replace("from: 100 RPM, to: 40", "from: 40 RPM, to: 100"))
    assert "goes from" not in call("check", study).err

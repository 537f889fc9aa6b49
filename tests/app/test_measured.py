"""Tables as rigs export them: what is read, in which unit, and what is refused with its
line."""

from pathlib import Path

import numpy as np
import pytest

import nsdrill
from nsdrill.app.fitting.measured import Reading, read_measured
from nsdrill.errors import FileError, InputError, Refusal

STUDY = nsdrill.load_study({"title": "a"})
SEGMENTS = nsdrill.load_study({"model": "segments"})


@pytest.fixture
def table(tmp_path):
    def write(text, how=None, study=STUDY):
        path = tmp_path / "field.csv"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return read_measured(path, study, how)

    return write


def test_units_stand_in_the_head(table):
    found = table(
        "Rotary Speed [rpm], WOB (klbf), depth [ft], surface_torque_mean [kft.lbf], stick_slip_index [%], "
        "stuck_fraction [%], lateral_acceleration_rms [gravity], whirl_severity\n"
        "60, 10, 9500, 3.5, 40, 5, 0.5, 2\n90, 20, 9500, 4.5, 10, 0, 1, 3\n"
    )
    assert found.points == 2
    np.testing.assert_allclose(found.at["rotary_speed"], [2 * np.pi, 3 * np.pi])
    np.testing.assert_allclose(found.at["wob"], [44482.216152605, 88964.43230521])
    np.testing.assert_allclose(found.at["depth"], 2895.6)
    expected = {
        "surface_torque_mean": [3500 * 1.3558179483314, 4500 * 1.3558179483314],
        "stick_slip_index": [40, 10],
        "stuck_fraction": [0.05, 0.0],
        "lateral_acceleration_rms": [4.903325, 9.80665],
        "whirl_severity": [2, 3],
    }
    assert found.values.keys() == expected.keys()
    for name, values in expected.items():
        np.testing.assert_allclose(found.values[name], values, err_msg=name)
    assert found.errors["whirl_severity"].tolist() == [0.5, 0.5]
    assert found.where == ("line 2", "line 3")
    assert any(note.startswith("error assumed of") for note in found.notes)


def test_units_may_have_a_row_of_their_own_and_columns_another_name(table):
    """As exports have it: semicolons, a byte order mark, comments, columns of no use."""
    text = "\ufeff# rig 7\nTIME_STR;RPM;WOBA;TQA\n;rpm;klbf;kft-lbf\na;60;10;3.5\nb;90;20;4.5\n"
    how = Reading(
        {"RPM": "rotary_speed", "WOBA": "wob", "TQA": "surface_torque_mean"}, ["*"], {"surface_torque_mean": "2 %"}
    )
    found = table(text, how)
    np.testing.assert_allclose(found.values["surface_torque_mean"], [4745.3628, 6101.1808], rtol=1e-6)
    np.testing.assert_allclose(found.errors["surface_torque_mean"], 0.02 * found.values["surface_torque_mean"])
    assert found.notes == ("ignored: TIME_STR", "not measured, and so as in the study: depth 5000 m")


def test_errors_may_have_columns(table):
    found = table("wob [kN],bit_force_max [kN],bit_force_max_error [N]\n10,20,500\n20,30,600\n")
    assert found.errors["bit_force_max"].tolist() == [500.0, 600.0]


def test_values_that_are_not_measured_are_passed_over(table):
    text = "wob [kN],bit_force_max [kN],stick_slip_index [%]\n10,20,\n20,-999.25,40\n,30,50\n30,,\n"
    with pytest.raises(FileError, match=r"line 2: stick_slip_index: found a gap; allowed: a number. skip_gaps=True"):
        table(text)
    found = table(text, Reading(gaps=True))
    assert found.at["wob"].tolist() == [10e3, 20e3]
    assert np.isnan(found.values["bit_force_max"]).tolist() == [False, True]
    values, errors, there = found.flat
    names = list(found.values)
    assert dict(zip([(names[place // 2], place % 2) for place in there], values, strict=True)) == {
        ("bit_force_max", 0): 20e3,
        ("stick_slip_index", 1): 40.0,
    }
    assert np.isfinite(errors).all()


def log(change=lambda rows: rows, step=0.5, name="surface_torque"):
    """Two stretches of 200 s: a sine of 0.2 kN m and one of 1 kN m about 4 and 6 kN m."""
    time = np.arange(0.0, 400.0, step)
    second = time >= 200.0
    speed, size = np.where(second, 90.0, 60.0), np.where(second, 1.0, 0.2)
    torque = np.where(second, 6.0, 4.0) + size * np.sin(2 * np.pi * time / 5.0)
    rows = [f"{t:g},{s:g},50,{q:.6f}" for t, s, q in zip(time, speed, torque, strict=True)]
    return "\n".join([f"time [s],rotary_speed [rpm],wob [kN],{name} [kN.m]", *change(rows)])


def test_stretches_of_constant_settings_give_features(table):
    found = table(log())
    np.testing.assert_allclose(found.at["rotary_speed"], [2 * np.pi, 3 * np.pi])
    np.testing.assert_allclose(found.values["surface_torque_mean"], [4e3, 6e3], atol=2.0)
    np.testing.assert_allclose(found.values["surface_torque_max"], [4.2e3, 7e3], rtol=0.01)
    np.testing.assert_allclose(found.values["surface_torque_min"], [3.8e3, 5e3], rtol=0.015)
    assert found.notes[0] == "2 stretches of constant settings, without their first 60 s"
    assert found.where[1].endswith("(260 to 399.5 s)")


def test_noise_of_a_setting_is_no_change_of_it(table):
    rng = np.random.default_rng(1)

    def noisy(rows):
        split = [row.split(",") for row in rows]
        return [",".join((t, s, f"{float(w) * (1 + 0.01 * rng.standard_normal()):.4f}", q)) for t, s, w, q in split]

    assert table(log(noisy)).points == 2


def test_a_hole_in_time_ends_a_stretch(table):
    # 50 to 75 s: what is before is too short
    found = table(log(lambda rows: [*rows[:100], *rows[150:]]))
    assert found.points == 2
    assert found.where[0].endswith("(135 to 199.5 s)")
    assert "1 shorter than 120 s" in found.notes[0]


def test_a_signal_that_is_zero_throughout_needs_an_error(table):
    """Of 0 no share is an error: a dead sensor made every run wrong by 10^5 deviations."""

    def dead(rows):
        return [f"{row.rpartition(',')[0]},0" for row in rows]

    with pytest.raises(FileError) as caught:
        table(log(dead))
    assert "surface_torque_min, surface_torque_max: found 0 at every operating point" in str(caught.value)
    assert "Was the sensor connected?" in str(caught.value)
    errors = {name: "0.1 kN*m" for name in ("surface_torque_mean", "surface_torque_min", "surface_torque_max")}
    assert np.all(table(log(dead), Reading(errors=errors)).errors["surface_torque_max"] == 100.0)


def test_a_name_of_another_model_is_not_taken_for_what_is_near(table):
    """A mean torque is no least torque."""
    torsion = nsdrill.load_study({"model": "torsion"})
    with pytest.raises(FileError) as caught:
        table("wob [kN],surface_torque_mean [kN.m],periods [s]\n100,3,4\n", study=torsion)
    assert "surface_torque_mean is one of the model christoforou_yigit" in str(caught.value)
    assert "surface_torque_min'" not in str(caught.value)


def test_slow_samples_give_means_only(table):
    found = table(log(step=5.0))
    assert list(found.values) == ["surface_torque_mean"]
    assert any("only means" in note for note in found.notes)


def test_a_coarse_log_of_a_model_without_means_is_told(table):
    torsion = nsdrill.load_study({"model": "torsion"})
    with pytest.raises(FileError, match="a sample every 5 s, which misses extremes, and no mean of it in the model"):
        table(log(step=5.0), study=torsion)


def test_a_log_of_constant_settings_lasts_as_long_as_it(tmp_path):
    """It was followed for the default duration of a run."""
    path = tmp_path / "log.csv"
    path.write_text("time [s],wob [kN],rotary_speed [rpm]\n" + "".join(f"{10 * i},100,70\n" for i in range(10)))
    with pytest.warns(nsdrill.RunWarning, match="are followed, 90 s"):
        trace = nsdrill.simulate("model: torsion\n", data=path, sample="1 s")
    assert float(trace.time[-1]) == 90.0
    assert float(trace.drive_speed[-1]) == pytest.approx(70 * np.pi / 30)


def test_the_hook_load_of_a_string_of_segments_is_told_about_its_mean(table):
    found = table(log(name="hook_load").replace("kN.m", "kN"), study=SEGMENTS)
    np.testing.assert_allclose(found.values["hook_load_change_max"], [200.0, 1000.0], rtol=0.05)
    np.testing.assert_allclose(found.values["hook_load_change_min"], [-200.0, -1000.0], rtol=0.05)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("wob [kN],bit_force_max\n10,20\n", "line 1: bit_force_max: found no unit; allowed: bit_force_max [klbf] or"),
        ("wob [m],bit_force_max [kN]\n10,20\n", "line 1: wob: found 'm', in units of length; allowed: a unit (kN, N"),
        ("wob [kg],bit_force_max [kN]\n10,20\n", "'kg' is a unit of mass, not of force"),
        ("wob [kN],bit_force [kN]\n10,20\n", "the column 'bit_force', which is not known. Did you mean bit_force_max"),
        ("wob [kN],bit_force [kN]\n10,20\n", "bit_force by itself is a signal over time, which needs a column time."),
        ("wob,bit_force_max [kN]\n10,20\n", "wob: found no unit; allowed: wob [klbf] or another unit of force in"),
        ("wob [kN],gamma [api]\n10,20\n", "ignore=['gamma'] passes over it"),
        ("wob [kN],bit_force_max [kN]\n10,2x\n", "line 2: bit_force_max: found '2x'; allowed: a number."),
        ('wob [kN],bit_force_max [kN]\n10,"2,500"\n', "Write a decimal point"),
        (
            "wob [kN],rotary_speed [rpm],bit_force_max [kN]\n10,70,1\n10,5, 70,5, 1,40\n",
            "line 3: found 6 cells under 3 columns; allowed: a cell for each column. Write a decimal",
        ),
        ("wob,bit_force_max\nkN,kN,kN\n10,20\n", "line 2: found 3 cells under 2 columns"),
        ("wob [kN],bit_force_max [kN]\n1_000,20\n", "line 2: wob: found '1_000'; allowed: a number"),
        ("wob [kN],bit_force_max [kN]\n10,٢٠\n", "line 2: bit_force_max: found '٢٠'; allowed: a num"),
        ("wob [kN],bit_force_max [kN]\n10\n", "line 2: bit_force_max: found a gap"),
        ("wob [kN],wob [N],bit_force_max [kN]\n1,1,1\n", "found two columns of wob"),
        ("wob [kN]\n10\n", "line 1: found no measured value; allowed: a feature that a run has"),
        ("wob [kN],bit_force_max [kN]\n", "found no table"),
        ("", "found no table"),
        (b"wob [kN]\n\x00\x01\n", "this is no text; a table in CSV is needed here"),
        ("wob [kN],bit_force_max [kN]\n-10,20\n", "line 2: wob: found -10 kN; allowed:"),
        ("stick_slip_index [rpm],wob [kN]\n1,10\n", "stick_slip_index: found the unit 'rpm'; allowed: percent, or 1"),
        (
            "bit_force_max [kN],bit_force_max_error [kN],wob [kN]\n1,1,10\n1,0,10\n",
            "line 3: bit_force_max_error: found an",
        ),
        (log(lambda rows: rows[:100]), "found no stretch of at least 120 s"),
        (log(name="gamma"), "the column 'gamma', which is not known"),
        (log(name="TQA"), "rename={'TQA': 'surface_torque'} says what it is"),
        ("RPM [rpm],bit_force_max [kN]\n60,20\n", "Did you mean rotary_speed? Allowed"),
        ("RPM [rpm],bit_force_max [kN]\n60,20\n", "rename={'RPM': 'rotary_speed'}"),
        ("TQA [kN*m],wob [kN]\n5,20\n", "Did you mean surface_torque_mean?"),
        ("time [s],wob [kN],hook_load [kN]\n0,1,2\n", "It is one of the model segments; the study has another."),
        ("time [s],wob [kN]\n0,1\n1,1\n", "found no signal (bit_speed, axial, bit_force, bit_torque, radius"),
    ],
)
def test_what_cannot_be_used_is_told_with_its_line(table, text, said):
    with pytest.raises(FileError) as caught:
        table(text)
    assert said in str(caught.value)
    assert "field.csv" in str(caught.value)


def test_wrong_options(table):
    text = "wob [kN],bit_force_max [kN]\n10,20\n"
    for how, said in (
        (Reading(rename={"TQA": "surface_torque"}), "rename: found no column 'TQA'; allowed: those of the file"),
        (Reading(ignore=["TQA"]), "ignore: found no column 'TQA'"),
        (Reading(errors={"bit_force_max": "5 rpm"}), "errors bit_force_max: found '5 rpm'"),
        (Reading(errors={"bit_force_max": "-5 percent"}), "errors bit_force_max: found '-5 percent'"),
        (Reading(errors={"radius_max": "1 mm"}), "errors: found radius_max, which is not measured"),
    ):
        with pytest.raises(InputError) as caught:
            table(text, how)
        assert said in str(caught.value)


def test_no_such_file(tmp_path):
    with pytest.raises(FileError, match="No such file"):
        read_measured(Path(tmp_path / "none.csv"), STUDY)


def test_errors_may_be_numbers_in_si(table):
    text = "wob [kN],bit_force_max [kN],stick_slip_index [%]\n10,20,30\n20,30,40\n"
    found = table(text, Reading(errors={"bit_force_max": 500.0, "stick_slip_index": 3}))
    assert found.errors["bit_force_max"].tolist() == [500.0, 500.0]
    assert found.errors["stick_slip_index"].tolist() == [3.0, 3.0]
    for wrong in (0.0, -1.0, float("nan"), True, [1.0]):
        with pytest.raises(InputError, match=r"errors, bit_force_max: found .*; allowed: a number above 0 in SI \[N\]"):
            table(text, Reading(errors={"bit_force_max": wrong}))


def test_features_of_one_signal_have_an_error_of_its_size(table):
    """The least bit speed of stick-slip is near zero, and its sensor is that of the
    greatest: 5 % of the value and 5 % of the range at that point."""
    rpm = np.pi / 30
    found = table("wob [kN],bit_speed_min [rpm],bit_speed_max [rpm]\n60,-0.7,95\n70,0.2,190\n")
    least, greatest = (found.errors[f"bit_speed_{name}"] / rpm for name in ("min", "max"))
    spread = 0.05 * np.array([95.7, 189.8])
    np.testing.assert_allclose(least, np.hypot(0.05 * np.array([-0.7, 0.2]), spread))
    np.testing.assert_allclose(greatest, np.hypot(0.05 * np.array([95, 190]), spread))


def test_an_extreme_by_itself_has_an_error_of_the_natural_size_of_its_signal(table):
    """That of a speed is the set speed, of the row or of the study (3 rad/s)."""
    alone = table("wob [kN],bit_speed_min [rad/s]\n60,0\n").errors["bit_speed_min"]
    assert alone == pytest.approx(0.02 * 3.0)
    alone = table("wob [kN],rotary_speed [rad/s],bit_speed_min [rad/s]\n60,8,0\n70,4,0\n").errors["bit_speed_min"]
    np.testing.assert_allclose(alone, 0.02 * 8.0)
    shares = table("wob [kN],stuck_fraction [%],stick_slip_index [%]\n60,0.01,0.3\n")
    assert shares.errors["stuck_fraction"] == pytest.approx(0.02, rel=1e-3)
    assert shares.errors["stick_slip_index"] == pytest.approx(2.0, rel=1e-3)


@pytest.mark.parametrize(
    ("head", "cell", "said"),
    [
        ("bit_speed_max [rad/s]", "1e308", r"line 2: bit_speed_max: found 1e\+308 rad/s; allowed: at least -10 000"),
        ("surface_torque_max [kft*lbf]", "1e308", "line 2: surface_torque_max: found inf N.m; allowed: at least"),
        ("surface_torque_max [N*m]", "1e999", "line 2: surface_torque_max: found '1e999'; allowed: a number"),
        ("stuck_fraction", "-0.01", "line 2: stuck_fraction: found -0.01; allowed: at least 0 and at most 1"),
        ("stuck_fraction [%]", "101", "line 2: stuck_fraction: found 1.01; allowed: at least 0 and at most 1"),
        ("stick_slip_index [%]", "-3", "line 2: stick_slip_index: found -3 percent; allowed: at least 0"),
        ("radius_max [mm]", "-3", "line 2: radius_max: found -0.003 m; allowed: at least 0"),
        ("whirl_severity", "5", "line 2: whirl_severity: found 5; allowed: at least 0 and at most 4"),
        ("radius_max [mm],radius_max_error [mm]", "3,1e308", "line 2: radius_max_error: found 1e\\+305 m; allowed"),
    ],
)
def test_impossible_values_are_refused_with_row_and_column(table, head, cell, said):
    with pytest.raises(FileError, match=said):
        table(f"wob [kN],{head}\n60,{cell}\n")


@pytest.mark.parametrize(
    ("least", "greatest"), [("bit_speed_min", "bit_speed_max"), ("bit_speed_mean", "bit_speed_max")]
)
def test_a_least_value_above_the_greatest_is_refused(table, least, greatest):
    with pytest.raises(FileError, match=rf"line 3: {least}: found 8, above {greatest}, 7 .*Are the columns exchanged"):
        table(f"wob [kN],{least} [rad/s],{greatest} [rad/s]\n60,1,7\n70,8,7\n")


def test_an_impossible_value_of_a_signal_ends_a_stretch(table):
    rows = "".join(f"{t},60,{1e300 if t == 150 else 5}\n" for t in range(300))
    found = table(f"time [s],wob [kN],bit_speed [rad/s]\n{rows}")
    assert found.where == ("lines 62 to 151 (60 to 149 s)", "lines 213 to 301 (211 to 299 s)")
    assert any("(line 152: found 1e+300 rad/s; allowed: at least -10 000" in note for note in found.notes)


def test_an_error_that_says_nothing_is_refused(table):
    text = "wob [kN],bit_speed_max [rad/s]\n60,5\n"
    for error in (1e308, "1e308 rad/s", "1e308 percent"):
        with pytest.raises(InputError, match=r"bit_speed_max: found .*; allowed: an error of at most 20 000 rad/s"):
            table(text, Reading(errors={"bit_speed_max": error}))


def test_the_model_gives_data_that_it_made_itself(tmp_path):
    """Stick-slip down to standstill, with a noise of 0.3 rpm on the bit speed."""
    study = {
        "modes": {"axial": "frozen", "lateral": "frozen"},
        "operation": {"depth": "2000 m", "wob": "60 kN", "rotary_speed": "4 rad/s"},
        "simulation": {"transient": "60 s", "observe": "60 s"},
    }
    made = nsdrill.simulate(study, duration="180 s", sample="100 ms")
    speed = made.bit_speed.values + np.random.default_rng(3).normal(0.0, 0.03, made.time.size)
    assert speed[1000:].min() < 0.0 < 8.0 < speed[1000:].max()
    rows = "".join(f"{t:.1f},60,4,{v:.4f}\n" for t, v in zip(made.time.values, speed, strict=True))
    data = tmp_path / "log.csv"
    data.write_text(f"time [s],wob [kN],rotary_speed [rad/s],bit_speed [rad/s]\n{rows}")
    unknown = {"bit.friction.static": {"uniform": [0.3, 0.6]}, "bit.friction.dynamic": {"uniform": [0.1, 0.3]}}
    found = nsdrill.fit(study | {"uncertain": unknown}, data, batch=48, rounds=3, progress=False).note
    assert found["explained"]
    assert all(feature["deviation"] < 2.0 for feature in found["features"])


def test_a_setting_at_which_the_study_does_not_hold_is_told_with_its_line(table):
    """Of the main model, whose natural scales need the string."""
    for text in (
        "depth [m],rotary_speed [rpm],surface_torque_max [kN*m]\n2,60,5\n",
        "time [s],depth [m],rotary_speed [rpm],surface_torque [kN*m]\n0,2,60,5\n1,2,60,5\n2,2,60,6\n3,2,60,5\n",
    ):
        with pytest.raises(FileError, match=r"line.* 2.*: operation\.depth: found '2 m'.*; allowed: above drillstring"):
            table(text, Reading(shortest=1.0, settle=0.0))


def test_times_below_zero_and_stretches_that_are_settled_away_are_told(table):
    with pytest.raises(Refusal, match="shortest: found -5 s; allowed: at least 0 s"):
        Reading(shortest=-5.0)
    with pytest.raises(Refusal, match="settle"):
        Reading(settle=-1.0)
    text = "time [s],rotary_speed [rpm],surface_torque [kN*m]\n0,60,5\n1,60,5\n2,60,6\n3,60,5\n"
    with pytest.raises(FileError, match=r"with 3 rows after its first 100 s.*settle uses more of each.*lasts 3 s"):
        table(text, Reading(shortest=1.0, settle=100.0))
    with pytest.raises(FileError, match=r"no two rows that can be used, of 1; allowed: more\.$"):
        table(text.partition("1,60")[0])

"""A fit from end to end: values that are known come back from runs of the model with
noise; what the data cannot tell is said."""

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import nsdrill
from nsdrill.analysis.fitting import Measured
from nsdrill.app.fitting.ensemble_fit import _adjusted_text, _Simulator, _unknown_values, unknowns_of
from nsdrill.errors import InputError
from nsdrill.figures.measured_overlay import _entries
from nsdrill.text.uncertainty_text import fit_lines

TRUTH = {"static": 0.45, "dynamic": 0.12}
STRING = {"model": "torsion", "simulation": {"transient": "60 s", "observe": "60 s"}}
PRIOR = """\
model: torsion
simulation: {transient: 60 s, observe: 60 s}
sweep: {rotary_speed: [3 rad/s, 6 rad/s]}
uncertain:
  bit.friction.static: {uniform: [0.2, 0.8]}
  bit.friction.dynamic: {uniform: [0.05, 0.2]}
"""
STEADY_PRIOR = """\
model: torsion
operation: {rotary_speed: 25 rad/s}
bit: {friction: {static: 0.6}}
simulation: {transient: 60 s, observe: 30 s}
uncertain: {bit.friction.dynamic: {uniform: [0.2, 0.6]}}
"""
NAMES = ("stick_slip_index", "surface_torque_max", "surface_torque_min")
ROUGHLY = ("--set", "classify.settled.tolerance=100")  # 60 s hold few periods of stick-slip
LONGER = ("--set", "simulation.transient=300 s")
STEADY = ("--set", "simulation.transient=1500 s", "--error", "stick_slip_index=20")  # until it has settled
POINTS = [(2.0, 30e3), (4.0, 50e3), (6.0, 60e3), (9.0, 60e3)]  # rad/s, N


@pytest.fixture(scope="module")
def truth():
    """The features of the model with known friction [names, points]."""
    found = []
    for speed, wob in POINTS:
        study = {
            **STRING,
            "bit": {"friction": TRUTH},
            "operation": {"rotary_speed": f"{speed} rad/s", "wob": f"{wob} N"},
        }
        point = nsdrill.run(nsdrill.load_study(study))
        found.append([point[name].item() for name in NAMES])
    return np.array(found).T


def write_data(values, error=0.03):
    """The table, in field units, with noise."""
    noise = np.random.default_rng(5).standard_normal(values.shape)
    values = values * (1 + error * noise)
    lines = [
        "rotary_speed [rpm], wob [klbf], stick_slip_index [%], surface_torque_max [kft.lbf], surface_torque_min [N m]"
    ]
    for (speed, wob), (index, most, least) in zip(POINTS, values.T, strict=True):
        row = (speed * 30 / np.pi, wob / 4448.2216152605, index, most / 1355.8179483314, least)
        lines.append(", ".join(f"{number:.9g}" for number in row))
    Path("field.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    Path("study.yaml").write_text(PRIOR, encoding="utf-8")


def test_known_values_come_back(call, truth):
    write_data(truth)
    errors = [word for name in NAMES for word in ("--error", f"{name}=3 percent")]
    answer = call(
        "fit",
        "study.yaml",
        "--data",
        "field.csv",
        "--json",
        "-o",
        "adjusted.yaml",
        "--picture",
        "fit.png",
        "--batch",
        "64",
        "--quiet",
        *errors,
        *ROUGHLY,
    )
    note = json.loads(answer.out)
    assert note["explained"]
    assert not {"unsettled", "unfinished"} & {*note["doubts"]}
    for one in note["unknowns"]:
        low, middle, high = one["posterior"]
        deviation = (high - low) / (2 * 1.645)
        assert abs(middle - TRUTH[one["key"].rpartition(".")[2]]) < 3 * deviation
        assert one["width"] < 0.5
        # at these points steady drilling lasts beside the stick-slip of the runs
        assert one["told"] == "on_this_branch"
    assert note["doubts"] == ["history"]
    told = "\n".join(fit_lines(note, "si"))
    assert "DETERMINED ONLY IF the well was in the motion of the runs" in told
    assert ": determined" not in told
    assert "bit.friction.static on this branch" in Path("adjusted.yaml").read_text(encoding="utf-8")
    assert Path("fit.png").stat().st_size > 10_000
    adjusted = nsdrill.load_study("adjusted.yaml")
    assert adjusted.samples == 128
    assert adjusted.resolved["uncertain"]["doubts"] == ["history"]  # answers from it tell so
    (static,) = (one for one in note["unknowns"] if one["key"] == "bit.friction.static")
    assert np.quantile(adjusted.drawn["bit.friction.static"], [0.05, 0.95]) == pytest.approx(
        [static["posterior"][0], static["posterior"][2]], abs=0.3 * (static["posterior"][2] - static["posterior"][0])
    )
    assert adjusted.axes["rotary_speed"].tolist() == [3.0, 6.0]  # the sweep is left as it is


def test_a_wrong_scale_of_the_torque_is_said_as_no_deviation_shows_it(call):
    """Steady drilling: a torque that is 25 % too high makes the friction as much too high, and more, as a part
    of it is damping."""
    Path("study.yaml").write_text(STEADY_PRIOR, encoding="utf-8")
    string = {"model": "torsion", "bit": {"friction": {"static": 0.6, "dynamic": 0.4}}}
    sweep = {"wob": ["20 kN", "30 kN", "40 kN"]}
    settings = {"operation": {"rotary_speed": "25 rad/s"}, "simulation": {"transient": "60 s", "observe": "30 s"}}
    torques = nsdrill.run({**string, **settings, "sweep": sweep})["surface_torque_max"].values.ravel()
    medians = []
    for scale in (1.0, 1.25):
        rows = [f"{wob}, {scale * torque}" for wob, torque in zip((20, 30, 40), torques, strict=True)]
        Path("field.csv").write_text("wob [kN], surface_torque_max [N m]\n" + "\n".join(rows) + "\n")
        given = ("fit", "study.yaml", "--data", "field.csv", "--batch", "64", "--quiet")
        note = json.loads(call(*given, "--json").out)
        medians.append(note["unknowns"][0]["posterior"][1])
        assert note["explained"]
    damping = 50.0 * 25.0 / torques.mean()  # the share of the torque that is no friction [N m s/rad, rad/s]
    assert medians[1] / medians[0] == pytest.approx((1.25 - damping) / (1 - damping), rel=0.05)
    assert medians[1] / medians[0] > 1.25
    assert note["scale_not_seen"] == {"unknowns": ["bit.friction.dynamic"], "others": []}
    told = " ".join(call(*given).out.split())
    assert "scale is off at all points alike makes bit.friction.dynamic off by that share or more" in told


def test_what_the_data_cannot_tell_is_said(call, truth):
    """Smooth drilling at high speed hardly knows the friction of a bit at rest."""
    write_data(truth)
    Path("field.csv").write_text("rotary_speed [rpm], wob [klbf], stick_slip_index [%]\n200, 13, 1\n", encoding="utf-8")
    answer = call(
        "fit study.yaml --data field.csv --batch 32 --quiet --error stick_slip_index=20 --set "
        "'bit.friction.decay=50 s/rad'"
    )
    assert "THE DATA DETERMINE NONE of the unknowns" in answer.out
    assert "NOT DETERMINED by these data" in answer.out


def test_data_that_the_model_cannot_give_are_refused_credit(call, truth):
    values = truth.copy()
    values[1] *= 5.0  # five times the torque of any friction that is allowed
    write_data(values)
    answer = call("fit", "study.yaml", "--data", "field.csv", "--batch", "32", "--rounds", "3", "--quiet", *LONGER)
    assert "THE MODEL DOES NOT GIVE THESE DATA" not in answer.out  # a short search does not know
    assert "NO RUN SO FAR GIVES THESE DATA" in answer.out
    first, *_ = (line for line in answer.out.splitlines() if line[:1].isupper())
    assert first.startswith("NOT FINISHED")
    assert "most in surface_torque_max" in answer.out
    # steady drilling far above the onset: no friction that is allowed makes it oscillate
    steady = "rotary_speed [rad/s], stick_slip_index [%]\n14,60\n16,60\n18,60\n"
    Path("field.csv").write_text(steady)
    answer = call("fit", "study.yaml", "--data", "field.csv", "--batch", "64", "--quiet", *LONGER, *STEADY)
    assert "NOT FINISHED" not in answer.out
    assert "THE MODEL DOES NOT GIVE THESE DATA with any values of the unknowns" in answer.out


def test_motions_that_had_not_settled_are_no_reason_to_doubt_the_model(call):
    """Steady drilling at 8 rad/s and more: with the true friction the index is below 0.1 % after
    400 s, and some 20 % after 20 s, so no friction that is allowed gives it then."""
    Path("field.csv").write_text("rotary_speed [rad/s], stick_slip_index [%]\n8,0.01\n10,0.01\n12,0.01\n")
    prior = PRIOR.replace("[0.05, 0.2]", "[0.1, 0.29]").replace("[0.2, 0.8]", "[0.3, 0.6]")
    Path("study.yaml").write_text(prior + "operation: {wob: 66.72 kN}\n")
    answer = call("fit", "study.yaml", "--data", "field.csv", "--batch", "32", "--quiet")
    assert "THE MODEL DOES NOT GIVE THESE DATA" not in answer.out
    assert "NOT SETTLED: in 100 % of the samples, by weight, the best one among them," in answer.out
    assert "let the motions settle" in answer.out
    assert ": determined" not in answer.out


def test_what_passing_motions_or_few_samples_give_is_not_determined(call, truth):
    write_data(truth)
    errors = [word for name in NAMES for word in ("--error", f"{name}=3 percent")]
    fit = ("fit", "study.yaml", "--data", "field.csv", "--quiet", *errors)
    for more, doubt, why in (
        (("--batch", "64"), "unsettled", "as motions had not settled"),
        (("--batch", "16", "--rounds", "2", *ROUGHLY), "unfinished", "as too few samples count"),
    ):
        told, note = call(*fit, *more).out, json.loads(call(*fit, *more, "--json").out)
        assert note["doubts"][0] == doubt
        assert {one["told"] for one in note["unknowns"]} <= {"unknown", "not"}
        assert f"NOT KNOWN, {why}" in told
        assert "determined" not in told.replace("NOT DETERMINED", "")


def test_peaks_that_keep_rising_have_not_settled_in_a_fit_either(call, monkeypatch):
    """The halves agree by a tolerance of 100 times the range, so that the peaks alone decide."""
    Path("field.csv").write_text("rotary_speed [rpm], stick_slip_index [%]\n40,60\n", encoding="utf-8")
    Path("study.yaml").write_text(PRIOR + "classify: {settled: {tolerance: 100}}\n", encoding="utf-8")
    words = ("fit", "study.yaml", "--data", "field.csv", "--batch", "16", "--rounds", "2", "--quiet")
    assert "NOT SETTLED" not in call(*words).out
    monkeypatch.setattr("nsdrill.models.base.keeps_rising", lambda peaks, greatest, *_: np.isfinite(greatest))
    assert "NOT SETTLED: in 100 % of the samples" in call(*words).out


def test_settings_far_from_the_sweep_are_doubted_before_anything_is_run(call):
    Path("study.yaml").write_text(PRIOR, encoding="utf-8")
    Path("field.csv").write_text("rotary_speed [rpm],stick_slip_index [%]\n40,1\n3,2\n", encoding="utf-8")
    words = ("fit", "study.yaml", "--data", "field.csv", "--batch", "16", "--rounds", "2", "--quiet")
    said = "Warning: field.csv, line 3: rotary_speed is 3 rpm, and the study sweeps 3 rad/s to 6 rad/s."
    assert said in call(*words).err
    Path("field.csv").write_text("rotary_speed [rpm],stick_slip_index [%]\n40,1\n80,2\n", encoding="utf-8")
    assert "Warning" not in call(*words).err


def test_a_setting_far_from_that_of_the_study_is_doubted(call):
    """A weight in tonnes under a head of kN, of a study that does not sweep it."""
    Path("study.yaml").write_text(f"{PRIOR}operation: {{wob: 60 kN}}\n", encoding="utf-8")
    Path("field.csv").write_text("wob [kN],stick_slip_index [%]\n6.1,1\n", encoding="utf-8")
    words = ("fit", "study.yaml", "--data", "field.csv", "--batch", "16", "--rounds", "2", "--quiet")
    assert "Warning: field.csv, line 2: wob is 6.1 kN, and the study has 60 kN. Is the unit" in call(*words).err
    Path("field.csv").write_text("wob [kN],stick_slip_index [%]\n80,1\n", encoding="utf-8")
    assert "Warning" not in call(*words).err
    Path("study.yaml").write_text(PRIOR, encoding="utf-8")  # a default says nothing of the well
    Path("field.csv").write_text("wob [kN],stick_slip_index [%]\n120,1\n", encoding="utf-8")
    assert "Warning" not in call(*words).err


def test_outputs_are_claimed_before_anything_is_run(call, truth):
    write_data(truth)
    for option, name in (("-o", "study.yaml"), ("--picture", "field.csv"), ("--picture", "fit.gif")):
        call("fit", "study.yaml", "--data", "field.csv", option, name, code=2)
    Path("there.yaml").write_text("title: mine\n", encoding="utf-8")
    call("fit", "study.yaml", "--data", "field.csv", "-o", "there.yaml", code=2)
    assert Path("there.yaml").read_text(encoding="utf-8") == "title: mine\n"


def test_from_python(tmp_path, monkeypatch, truth):
    monkeypatch.chdir(tmp_path)
    write_data(truth)
    errors = dict.fromkeys(NAMES, "3 percent")
    found = nsdrill.fit("study.yaml", "field.csv", errors=errors, batch=32, rounds=3, samples=16, progress=False)
    assert found.note["kind"] == "fit"
    assert nsdrill.load_study(found.study).samples == 16
    assert len(found.picture("field").axes) == 5
    Path("field.csv").write_text("wob [kN],stick_slip_index [%]\n10,\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"skip_gaps=True passes over rows"):
        nsdrill.fit("study.yaml", "field.csv", progress=False)
    Path("field.csv").write_text("wob [kN],gamma [%]\n10,1\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"rename=\{'gamma': 'NAME'\} says what it is, ignore=\['gamma'\] passes"):
        nsdrill.fit("study.yaml", "field.csv", progress=False)


def test_its_runs_have_the_bits_of_studies_of_their_own(tmp_path):
    """Rows of a table, in the order of the measurements, whatever the order in which
    they are run."""
    study = nsdrill.load_study(PRIOR)
    at = {"rotary_speed": np.array([6.0, 2.0, 4.0]), "wob": np.array([60e3, 30e3, 50e3])}
    values = {"stick_slip_index": np.ones(3), "surface_torque_max": np.ones(3)}
    measured = Measured("made up", at, values, values, ("a", "b", "c"))
    z = np.array([[0.3, -0.2], [-1.0, 0.7]])
    keys = unknowns_of(study)
    found = _Simulator(study, measured, keys, 2, lambda progress: None, 10)(z)
    drawn = _unknown_values(keys, z)
    for sample in range(2):
        for point in range(3):
            sets = {"sweep": {}, "uncertain": {}, **{key: float(one[sample]) for key, one in drawn.items()}}
            sets |= {"operation.wob": f"{float(at['wob'][point])} N"}
            sets |= {"operation.rotary_speed": f"{float(at['rotary_speed'][point])} rad/s"}
            own = nsdrill.run(study, set=sets, progress=False)
            assert [own[name].item() for name in values] == found[sample, [point, 3 + point]].tolist()


def test_the_weight_on_bit_may_be_an_unknown_under_either_key(call):
    Path("field.csv").write_text(
        "operation.rotary_speed [rad/s], stick_slip_index [%], surface_torque_max [N m]\n4, 150, 2500\n9, 10, 2000\n"
    )
    wanted = "  operation.wob: {uniform: [30 kN, 70 kN]}\n  bit.friction.static"
    Path("study.yaml").write_text(PRIOR.replace("  bit.friction.static", wanted))
    words = ("fit", "study.yaml", "--data", "field.csv", "--json", "-o", "adjusted.yaml")
    rows = json.loads(call(*words, "--picture", "fit.png").out)["unknowns"]
    assert "operation.wob" in [row["key"] for row in rows]
    adjusted = nsdrill.load_study("adjusted.yaml").drawn["wob"]
    assert 30e3 < adjusted.min() < adjusted.max() < 70e3


def test_the_written_study_tells_of_samples_that_failed():
    study = nsdrill.load_study({"uncertain": {"bit.friction.static": {"uniform": [0.3, 0.6]}, "samples": 4}})
    note = {"points": 6, "values": 24, "effective": 9.0, "unknowns": [], "samples": 40}
    note |= {
        "unsettled": 0.0,
        "best_settled": True,
        "undefined": {},
        "history": None,
        "notes": [],
        "doubts": [],
        "misfit": 1.0,
    }
    drawn = {"bit.friction.static": np.array([0.4, 0.5])}
    told = [
        _adjusted_text(study, SimpleNamespace(source="rig.csv"), drawn, note | {"failed": failed}) for failed in (3, 0)
    ]
    assert "NOT KNOWN: 3 of 40 samples failed" in told[0]
    assert "the truth may lie outside" in told[0].replace("\n# ", " ")
    assert "NOT KNOWN" not in told[1]
    passing = _adjusted_text(study, SimpleNamespace(source="rig.csv"), drawn, note | {"failed": 0, "unsettled": 0.4})
    assert "NOT SETTLED: 40 % of the samples" in passing
    assert "NOT SETTLED" not in told[1]


DAMPED = """\
model: torsion
operation: {depth: 2000 m, wob: 60 kN}
drillstring: {torsional_damping: 25 N*m*s/rad}
simulation: {transient: 100 s, observe: 60 s}
uncertain: {bit.friction.static: {uniform: [0.2, 0.8]}, bit.friction.dynamic: {uniform: [0.1, 0.5]}}
"""


def test_samples_that_failed_leave_the_intervals_not_known(call):
    """With 6000 steps some samples fail, and the intervals may then leave out the truth, 0.5."""
    Path("study.yaml").write_text(DAMPED, encoding="utf-8")
    Path("field.csv").write_text(
        "rotary_speed [rad/s], surface_torque_max [N m], surface_torque_min [N m], bit_speed_max [rad/s]\n"
        "6, 5766.0, -1269.8, 13.065\n10, 2493.4, 1922.1, 10.580\n16, 2537.0, 2136.1, 16.412\n",
        encoding="utf-8",
    )
    fit = ("fit", "study.yaml", "--data", "field.csv", "--batch", "32", "--rounds", "3", "--quiet")
    cut = (*fit, "--set", "simulation.max_steps=6000")
    told, note = call(*cut).out, json.loads(call(*cut, "--json").out)
    assert note["failed"] > 0
    assert note["beta"] < 1
    assert {one["told"] for one in note["unknowns"]} <= {"unknown", "not"}
    assert "too wide" not in told
    assert "NOT KNOWN, as samples failed" in told
    assert ": determined" not in told
    assert "The intervals are not known: they may be too narrow, and the truth may lie outside." in told
    fit = (*fit, "--batch", "64", "--rounds", "10", *ROUGHLY)
    told, note = call(*fit).out, json.loads(call(*fit, "--json").out)
    assert note["failed"] == 0
    assert "not known" not in told
    assert note["doubts"] == ["history"]
    assert "on_this_branch" in {one["told"] for one in note["unknowns"]}


def test_the_picture_tells_of_samples_that_failed():
    labels = ["\n".join(str(one.get_label()) for one in _entries(9.0, failed)) for failed in (3, 0)]
    assert "NOT KNOWN: 3 samples failed, the truth may lie outside" in labels[0]
    assert "NOT KNOWN" not in labels[1]


PERIODS = "model: torsion\nsimulation: {transient: 20 s, observe: 60 s}\nuncertain:\n"
PERIODS += "  bit.friction.static: {uniform: [0.2, 0.8]}\n  bit.friction.dynamic: {uniform: [0.1, 0.19]}\n"


def test_samples_without_a_period_have_not_failed(call):
    """Where static friction is small, the string rotates steadily at 100 kN and 6 rad/s."""
    Path("study.yaml").write_text(PERIODS, encoding="utf-8")
    Path("field.csv").write_text("wob [kN], rotary_speed [rad/s], stick_slip_period [s]\n100, 6, 7\n", encoding="utf-8")
    fit = ("fit", "study.yaml", "--data", "field.csv", "--batch", "16", "--rounds", "2", "--quiet")
    answer = call(*fit)
    assert " without stick_slip_period; effective" in answer.out
    assert "WITHOUT stick_slip_period:" in answer.out
    assert "as it rotates steadily, or has fewer than three cycles" in answer.out
    assert "FAILED" not in answer.out
    assert "max_steps" not in answer.out
    found = json.loads(call(*fit, "--json").out)
    assert found["failed"] == 0
    assert 0 < found["undefined"]["stick_slip_period"] < found["samples"]


def test_a_period_that_no_run_can_have_is_refused_before_any_run(call):
    Path("study.yaml").write_text(PERIODS, encoding="utf-8")
    Path("field.csv").write_text("rotary_speed [rad/s], stick_slip_period [s]\n5, 7\n4, 21\n", encoding="utf-8")
    answer = call("fit", "study.yaml", "--data", "field.csv", code=2)
    assert "field.csv, line 3: stick_slip_period: found 21 s; allowed: at most 20 s, as a period needs 3" in answer.err
    assert "--set simulation.observe=126s is long enough" in answer.err


def test_it_says_why_no_run_gives_the_data(call):
    Path("study.yaml").write_text(PERIODS.replace("[0.2, 0.8]", "[0.2, 0.21]"), encoding="utf-8")
    Path("field.csv").write_text("wob [kN], rotary_speed [rad/s], stick_slip_period [s]\n20, 14, 7\n", encoding="utf-8")
    fit = ("fit", "study.yaml", "--data", "field.csv", "--batch", "16", "--quiet")
    answer = call(*fit, code=2)
    assert "field.csv, line 2: stick_slip_period: found a value, where 100 % of 32 runs" in answer.err
    assert "A run has none as it rotates steadily" in answer.err
    Path("study.yaml").write_text(PERIODS.replace("model: torsion", "modes: {axial: frozen}"), encoding="utf-8")
    answer = call(*fit, "--set", "simulation.max_steps=1000", code=2)
    assert "in every sample; 32 runs of them: the run took more than simulation.max_steps steps." in answer.err


DOUBTFUL = """
model: torsion
operation: {depth: 2000 m, wob: 60 kN}
drillstring: {torsional_damping: 25 N*m*s/rad}
simulation: {transient: 20 s, observe: 20 s}
sweep: {rotary_speed: [4 rad/s, 16 rad/s]}
uncertain:
  doubts: [failed, unmatched]
  table: {bit.friction.static: [0.4, 0.5], bit.friction.dynamic: [0.2, 0.3]}
"""
TOLD = "samples failed, so that the truth may lie outside and no run gives the data"


def test_what_a_doubtful_fit_wrote_is_told_of_by_every_answer(call):
    """A window of a fit that found no match, or of which samples failed, is no better than the fit."""
    Path("adjusted.yaml").write_text(DOUBTFUL, encoding="utf-8")
    for words in (("check", "adjusted.yaml"), ("run", "adjusted.yaml", "-o", "out.h5", "--quiet")):
        assert f"Doubtful fit: the uncertain numbers are those of a fit in which {TOLD}" in " ".join(
            call(*words).err.split()
        )
    for words in (("window", "out.h5"), ("show", "out.h5")):
        told = " ".join(call(*words).out.split())
        assert "DOUBTFUL FIT" in told
        assert TOLD in told
    assert json.loads(call("window", "out.h5", "--json").out)["doubtful_fit"] == ["failed", "unmatched"]
    assert json.loads(call("show", "out.h5", "--json").out)["doubtful_fit"] == ["failed", "unmatched"]
    call("report", "out.h5", "-o", "out.html")
    assert "DOUBTFUL FIT" in Path("out.html").read_text(encoding="utf-8")
    drawn = nsdrill.plot("out.h5", kind="probability").legends[0].get_texts()
    assert any("DOUBTFUL FIT" in one.get_text() for one in drawn)
    with pytest.warns(UserWarning, match="Doubtful fit"):
        nsdrill.run(nsdrill.load_study("adjusted.yaml"), progress=False)
    assert "doubts: [failed, unmatched]" in call("show", "out.h5", "--study").out


def test_a_fit_without_a_match_writes_so_into_the_study(call):
    study = DOUBTFUL.replace("  doubts: [failed, unmatched]\n", "").replace(
        "table: {bit.friction.static: [0.4, 0.5], bit.friction.dynamic: [0.2, 0.3]}",
        "bit.friction.static: {uniform: [0.3, 0.6]}",
    )
    Path("study.yaml").write_text(study, encoding="utf-8")
    Path("field.csv").write_text("rotary_speed [rad/s], surface_torque_max [N m]\n6, 90000\n", encoding="utf-8")
    words = ("fit", "study.yaml", "--data", "field.csv", "--batch", "16", "--rounds", "2", "--samples", "4", "--quiet")
    note = json.loads(call(*words, "--json", "-o", "adjusted.yaml").out)
    assert "unmatched" in note["doubts"]
    text = Path("adjusted.yaml").read_text(encoding="utf-8")
    assert "# NO RUN GIVES THESE DATA: the best is off by" in text
    assert nsdrill.load_study("adjusted.yaml").resolved["uncertain"]["doubts"] == note["doubts"]


def test_what_no_run_gives_determines_nothing(call):
    """Torques that are ten times too great, as in another unit: narrow intervals about them are no knowledge."""
    Path("study.yaml").write_text(DAMPED, encoding="utf-8")
    Path("field.csv").write_text("rotary_speed [rad/s], surface_torque_max [N m]\n10, 24934\n16, 25370\n")
    fit = ("fit", "study.yaml", "--data", "field.csv", "--batch", "16", "--rounds", "2", "--quiet")
    told, note = call(*fit, "-o", "adjusted.yaml", "--overwrite").out, json.loads(call(*fit, "--json").out)
    assert "unmatched" in note["doubts"]
    assert {one["told"] for one in note["unknowns"]} <= {"unknown", "not"}
    assert "NOT KNOWN, as no run gives the data" in told
    assert note["together"] == []
    assert "a combination of the two" not in told
    assert "determined" not in told.replace("NOT DETERMINED", "")
    assert " well" not in Path("adjusted.yaml").read_text().split("What the data tell:")[1].split("\n# NO")[0]
    label = "\n".join(str(one.get_label()) for one in _entries(9.0, 0, ["unmatched", "unfinished"]))
    assert "DOUBTFUL: no run gives the data\nDOUBTFUL: too few samples count" in label


def test_data_of_a_well_that_came_there_another_way_are_doubtful(call):
    """One that was slowed to 50 rpm drills on steadily, where every run from rest sticks with the truth."""
    string = {**STRING, "bit": {"friction": {"static": 0.5, "dynamic": 0.25}}, "operation": {"wob": "60 kN"}}
    sweep = {"rotary_speed": {"from": "30 rpm", "to": "110 rpm", "points": 9}, "procedure": "up-down"}
    data = nsdrill.run({**string, "sweep": sweep, "simulation": {"transient": "120 s", "observe": "60 s"}})
    up, down = (data.isel(procedure=way, rotary_speed=2).squeeze() for way in (0, 1))
    assert float(down["stick_slip_index"]) < 5.0 < 50.0 < float(up["stick_slip_index"])
    torque = float(down["surface_torque_max"])
    Path("field.csv").write_text(f"rotary_speed [rpm], wob [kN], surface_torque_max [N m]\n50, 60, {torque}\n")
    Path("study.yaml").write_text(PRIOR, encoding="utf-8")
    given = ("fit", "study.yaml", "--data", "field.csv", "--batch", "16", "--rounds", "2", "--quiet")
    answer = call(*given, "-o", "adjusted.yaml")
    assert "HISTORY DECIDES at 1 of 1 setting" in answer.out
    assert "history" in nsdrill.load_study("adjusted.yaml").resolved["uncertain"]["doubts"]
    fast = f"rotary_speed [rpm], wob [kN], surface_torque_max [N m]\n600, 60, {torque}\n"
    Path("field.csv").write_text(fast)  # where no stick-slip lasts
    assert "HISTORY" not in call(*given).out

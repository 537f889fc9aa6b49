"""What a page shows of motions and branches is what the files hold, bit for bit."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner

import nsdrill
from nsdrill.analysis.bifurcations import CYCLE, PERIODIC, motion_text
from nsdrill.app.simulating import trajectory
from nsdrill.app.simulating.motions import Motions
from nsdrill.cli.main import group
from nsdrill.errors import FileError, InputError
from nsdrill.figures.kinds.branch_diagram import COLOURS
from nsdrill.models.registry import IN_TRACE
from nsdrill.store import hdf5, read_results, write_branches
from nsdrill.study import parse_study
from nsdrill.web.asked import packed
from nsdrill.web.branch_curves import read_branches
from nsdrill.web.session import Session


def test_a_replay_ends_in_the_stored_state_and_shows_the_same_samples(shared, session):
    results = read_results(shared / "small.h5")
    whole = trajectory.replay(results, at={"rotary_speed": 4.0}, procedure="down", sample=0.005)
    place = (1, 0, 0, 3)
    assert results["rotary_speed"][3] == 4.0
    motion = session.motions.replay(place, 1.5, 0.005)
    assert motion.same_bits
    assert np.array_equal(motion.final, results["final_state"][place])
    last = whole.trace.time >= 2.5
    assert np.allclose(motion.time, whole.trace.time[last], rtol=0, atol=1e-9)
    for name, values in motion.variables.items():
        size = np.max(np.abs(whole.trace[name])) or 1.0
        there = whole.trace[name][last]
        if name == "whirl_angle":  # counted from where the samples begin
            there = there - 2 * np.pi * np.round((there[0] - values[0]) / (2 * np.pi))
        assert np.allclose(values, there, rtol=0, atol=1e-6 * size), name


def test_a_stored_point_has_the_numbers_of_a_study_of_it(session):
    place = (1, 0, 0, 5)
    stored = session.motions.stored(place)
    read = session.motions.at(session.motions.values(place))
    for name in ("parameters", "initial", "operation", "simulation", "resolved"):
        assert getattr(stored, name) == getattr(read, name), name


def test_a_wrong_state_in_the_file_is_noticed(shared):
    results = read_results(shared / "small.h5")
    results.variables["final_state"] = results["final_state"].copy()
    results.variables["final_state"][0, 0, 0, 2, 4] += 1e-16
    from nsdrill.app.experiment import stored_experiment

    motions = Motions(stored_experiment("x", results), results)
    assert motions.replay((0, 0, 0, 2), 1.0, 0.01).same_bits is False
    assert motions.replay((0, 0, 0, 3), 1.0, 0.01).same_bits is True


def test_going_on_with_nothing_changed_is_the_next_run_of_a_carried_sweep(shared, session):
    """The point after it in the chain began in the final state of the one before."""
    results, motions = session.results, session.motions
    before, after = (0, 0, 0, 4), (0, 0, 0, 5)
    state = np.array(results["final_state"][before])
    simulation = session.study.simulation
    motion = motions.run_from(
        motions.at(motions.values(after)), state, 1.0, 0.01, settle=simulation.transient, observe=simulation.observe
    )
    assert np.array_equal(motion.final, results["final_state"][after])
    for name in ("response", "bit_speed_max", "radius_mean", "stick_slip_index"):
        assert motion.found[name] == results[name][after], name


def test_a_changed_number_is_that_of_a_study_with_it(session):
    motions = session.motions
    study = motions.at(motions.own, {"bit.rock_stiffness": "40 MN/m", "wob": "30 kN"})
    own = parse_study(
        session.study.text,
        overrides=["bit.rock_stiffness=40 MN/m", "operation.wob=30 kN", "operation.rotary_speed=5 rad/s", "sweep={}"],
    )
    assert study.parameters == own.parameters
    assert study.operation == own.operation
    start = motions.start(study)
    motion = motions.run_from(study, start, 3.0, 0.01)
    there = trajectory.simulate(own, duration=3.0)
    assert np.array_equal(motion.final, there.trace.attrs["final_state"])


def test_a_saved_study_goes_on_where_the_page_was(session):
    head, _ = session.replay({"place": [0, 0, 0, 5], "seconds": 1.0})
    asked = {"place": [0, 0, 0, 5], "state": head["state"].tolist(), "changes": {"well.stiffness": "30 MN/m"}}
    text = session.saved(asked)["text"]
    saved = parse_study(text, "saved.yaml")
    assert saved.parameters.well.stiffness == 30e6
    assert saved.operation.rotary_speed == session.motions.values((0, 0, 0, 5))["rotary_speed"]
    live, _ = session.live({**asked, "seconds": 3.0})
    there = trajectory.simulate(saved, duration=3.0)
    assert np.array_equal(there.trace.attrs["initial_state"], head["state"])
    assert np.array_equal(there.trace.attrs["final_state"], live["state"])


MODELS = {
    "torsion": "model: torsion\noperation: {wob: 60 kN}\n",
    "frozen": "modes: {axial: frozen, lateral: frozen}\n",
    "drive": "drive: {kind: soft_torque}\n",
    "beam": "model: beam\nbeam: {modes: 2}\n",
}
SHORT = "simulation: {transient: 1 s, observe: 1 s}\n"


@pytest.mark.parametrize("name", MODELS)
def test_every_model_moves(tmp_path, name):
    path = tmp_path / "study.yaml"
    path.write_text(MODELS[name] + SHORT)
    session = Session(path)
    meta = json.loads(packed(session.meta(), {})[4:])
    keys = {one["key"] for one in meta["sliders"]}
    assert {"rotary_speed", "wob", "depth"} <= keys
    head, columns = session.live({})
    assert head["ended"] == ""
    assert not np.isnan(columns["bit_speed"]).any()
    state = head["state"].tolist()
    speed = head["values"]["rotary_speed"]
    on, _ = session.live({"state": state, "changes": {"rotary_speed": 1.1 * speed}, "seconds": 2.0})
    assert on["values"]["rotary_speed"] == 1.1 * speed
    again, _ = session.live({"state": state, "changes": {"rotary_speed": 1.1 * speed}, "seconds": 2.0})
    assert np.array_equal(on["state"], again["state"])
    for moved in meta["drawn"]["histories"]:
        assert moved in columns
    orbit = name != "torsion" and name != "frozen"
    assert meta["drawn"]["orbit"] == orbit
    assert (head["hole"] is not None) == (name != "torsion")
    if name != "torsion":
        hole, collar = head["hole"]
        gap = session.study.parameters.well.diameter - session.study.parameters.drillstring.collar.outer_diameter
        assert hole - collar == pytest.approx(1e3 * gap / 2)
    text = session.saved({"state": on["state"].tolist(), "changes": {"rotary_speed": 1.1 * speed}})["text"]
    assert parse_study(text).operation.rotary_speed == 1.1 * speed


def test_a_failed_point_is_shown_as_far_as_it_came(shared):
    session = Session(shared / "failing.h5")
    results = session.results
    place = [int(i) for i in np.argwhere(results["status"] == 3)[0]]
    head, columns = session.replay({"place": place})
    assert head["same_bits"]
    assert head["ended"].startswith("step limit: the run took more than simulation.max_steps steps")
    assert head["state"] is None
    assert head["labels"] == ["step limit"]
    assert 0 < columns["time"][-1] < 4.0


def test_a_run_that_ends_early_gives_no_state_and_no_nan_in_json(tmp_path):
    path = tmp_path / "study.yaml"
    path.write_text(SHORT)
    session = Session(path, overrides=["simulation.max_steps=1000", "simulation.observe=300 s"])
    head, columns = session.live({})
    assert head["state"] is None
    assert head["ended"]
    body = packed(head, columns)
    size = int.from_bytes(body[:4], "little")
    json.loads(body[4 : 4 + size], parse_constant=lambda name: pytest.fail(name))
    with pytest.raises(InputError, match="Choose a point again"):
        session.motions.validated_state(session.motions.at(session.motions.own), np.full(9, np.nan))


def test_a_part_file_can_be_explored(shared, tmp_path):
    from nsdrill import load_study
    from nsdrill.app.experiment import prepare
    from nsdrill.app.running.run import header_of
    from nsdrill.store import RunLog
    from nsdrill.store.points import pending_records

    study = load_study(shared / "small.yaml")
    done = read_results(shared / "small.h5")
    experiment = prepare(study)
    plan, kept = experiment.plan, experiment.contents
    with RunLog.create(tmp_path / "half.h5.part", header_of(experiment), plan.points, kept) as log:
        records = pending_records(3, kept)
        for variable in kept.variables:
            values = done[variable.name].reshape(plan.points, *done[variable.name].shape[4:])
            records[variable.name] = values[:3]
        log.write(np.arange(3), records)
    session = Session(tmp_path / "half.h5.part")
    head, _ = session.replay({"place": [0, 0, 0, 2], "seconds": 1.0})
    assert head["same_bits"]
    with pytest.raises(InputError, match="not been run"):
        session.replay({"place": [0, 0, 0, 5]})
    _, columns = session.diagram({"y": "radius_peaks"})
    assert (columns["outcome"] == -1).sum() == 13


FEATURES = ("axial_max", "bit_speed_max", "radius_max", "bit_speed_min")


def write(path: Path, shared: Path, **changes: Any) -> Path:
    """A file of two branches of four points each, whose motions are those that a sweep
    ended in."""
    results = read_results(shared / "small.h5")
    names = [str(name) for name in results.coords["state"][:-1]]
    speeds = np.tile(results.coords["rotary_speed"][:4], 2)
    points = [(p, 0, 0, i) for p in (0, 1) for i in range(4)]
    data: dict[str, Any] = {
        "row_size": np.array([4, 4]),
        "lobes": np.array([1, 2]),
        "rotary_speed": speeds,
        "depth": np.full(8, 2000.0),
        "wob": np.full(8, 22240.0),
        "period": 2 * np.pi / (3 * speeds),
        "unstable": np.array([0, 0, 1, 1, 0, 0, 0, 0], np.int16),
        "label": np.array([9, 0, 5, 9, 9, 102, 0, 9], np.int16),
        "state": np.array([results["final_state"][place][:-1] for place in points]),
        **{name: np.array([results[name][place] for place in points]) for name in FEATURES},
        "motion": ["periodic", "limit_cycle"],
        "end_reason": ["end of the range", "a fold"],
        **changes,
    }
    per_branch = ("row_size", "lobes", "motion", "end_reason", "parent", "parent_point", "closed")
    data |= {name: np.zeros(2, int) for name in per_branch[4:]}
    data |= {name: np.zeros(8) for name in ("multiplier_real", "multiplier_imag", "branch_of_point", "arclength")}
    attrs = {**results.attrs, "along": "rotary_speed", "along_key": "rotary_speed", "rtol": 1e-9}
    variables = {
        name: (("branch",) if name in per_branch else ("point", "component")[: np.ndim(values)], values)
        for name, values in data.items()
        if values is not None
    }
    write_branches(path, xr.Dataset(variables, attrs=attrs))
    assert names[0] in IN_TRACE
    return path


@pytest.fixture
def branches(shared, tmp_path):
    return write(tmp_path / "branches.h5", shared)


def test_peaks_beyond_the_range_of_branches_are_not_drawn_beneath_them(branches, shared):
    """Else they set the limits of the panels."""
    data, sweep = nsdrill.open_results(branches), nsdrill.open_results(shared / "small.h5")
    low, high = (float(end(data["rotary_speed"].values)) for end in (np.min, np.max))
    assert sweep["rotary_speed"].values.max() > high
    figure = nsdrill.plot(data.assign_attrs(continue_from=low, continue_to=high), over=sweep)
    lines = [line for axes in figure.axes for line in axes.lines if str(line.get_gid()).startswith("sweep")]
    across = np.concatenate([line.get_xdata() for line in lines])
    assert across.size
    assert low <= across.min() <= across.max() <= high


def test_they_are_drawn_over_a_sweep(branches, shared):
    session = Session(shared / "small.h5", over=branches)
    head, columns = session.diagram({"y": "radius_peaks"})
    results = read_results(shared / "small.h5")
    assert np.allclose(columns["curve y"][:4], 1e3 * results["radius_max"][0, 0, 0, :4])
    assert columns["curve x"].tolist() == [1.0, 2.0, 3.0, 4.0] * 2
    assert head["curves"]["sizes"].tolist() == [4, 4]
    drawn = head["curves"]
    words = [[point, drawn["marks"][mark]["name"]] for point, mark in drawn["special"]]
    assert words == [[2, "fold"], [5, "wall reached"]]
    kinds = [drawn["kinds"][kind] for kind in drawn["kind"]]
    assert [kind["name"] for kind in kinds] == ["periodic over 1 lobe", "limit cycle"]
    assert [kind["colour"] for kind in kinds] == [COLOURS[PERIODIC], COLOURS[CYCLE]]
    other, _ = session.diagram({"y": "bit_torque_max"})
    assert other["note"] == "The branches have no such feature."


def test_their_motions_have_the_words_of_texts_and_the_colours_of_pictures(shared, tmp_path):
    motions = ["equilibrium", "invariant_circle"]
    session = Session(write(tmp_path / "b.h5", shared, motion=motions))
    head, _ = session.diagram({"y": "radius_peaks"})
    assert head["curves"]["kinds"] == [
        {"name": "steady drilling", "colour": COLOURS["equilibrium"]},
        {"name": "whirl on an invariant circle over 2 lobes", "colour": COLOURS["invariant_circle"]},
    ]
    begins = [session.orbit({"point": point})[0]["begins"] for point in (0, 4)]
    assert ["its period is" in text for text in begins] == [False, True]  # steady drilling repeats at once
    told = [motion_text(motion, lobes) for motion, lobes in zip(motions, (1, 2), strict=True)]
    assert [one["name"] for one in head["curves"]["kinds"]] == told


def test_they_are_not_drawn_where_they_are_not(shared, tmp_path):
    session = Session(shared / "small.h5", over=write(tmp_path / "b.h5", shared, wob=np.full(8, 30e3)))
    head, columns = session.diagram({"y": "radius_peaks"})
    assert "curve x" not in columns
    assert head["note"] == "The branches are at Weight on bit 30 kN."


def test_another_string_is_told_and_units_are_those_of_the_page(shared, tmp_path):
    session = Session(shared / "small.h5", "field", over=write(tmp_path / "b.h5", shared, wob=np.full(8, 30e3)))
    assert session.diagram({"y": "radius_peaks"})[0]["note"] == "The branches are at Weight on bit 6.744 klbf."
    other = write(tmp_path / "c.h5", shared)
    with hdf5.writing(other, copy_of=other) as file:
        resolved = json.loads(file.attrs["study_resolved"])
        resolved["bit"]["lobes"] = 7
        file.attrs["study_resolved"] = json.dumps(resolved)
    head, columns = Session(shared / "small.h5", over=other).diagram({"y": "radius_peaks"})
    assert "curve x" not in columns
    assert "bit.lobes is 7 there, 3 here." in head["note"]
    with hdf5.writing(other, copy_of=other) as file:
        resolved["bit"]["lobes"] = 3
        resolved["well"]["diameter"] = 0.5
        file.attrs["study_resolved"] = json.dumps(resolved)
    head, _ = Session(shared / "small.h5", "field", over=other).diagram({"y": "radius_peaks"})
    assert "well.diameter is 19.685 in there, 15 in here." in head["note"]


def test_a_click_runs_the_motion_of_a_branch(branches):
    session = Session(branches)
    assert session.meta()["kind"] == "branches"
    found = read_branches(branches)
    for point in (1, 2):
        head, columns = session.orbit({"point": point})
        period = found.period[point]
        seconds = head["samples"] * head["interval"]
        assert seconds == pytest.approx(period if found.unstable[point] else 20.0, rel=0.05)
        first = [columns[name][0] * IN_SI[name] for name in IN_SI]
        names = ("x", "vx", "y", "vy", "z", "vz", "twist", "bit_speed")
        assert np.allclose(first, [found.state[point][names.index(name)] for name in IN_SI], rtol=1e-12)
        assert head["values"]["rotary_speed"] == found.numbers[point]
        assert head["changes"]["rotary_speed"] == found.numbers[point]
    assert "branch 0, periodic over 1 lobe, unstable in 1 direction, fold" in head["begins"]
    live, _ = session.live({"state": head["state"].tolist(), "changes": {"rotary_speed": 3.5}, "seconds": 1.0})
    assert live["values"]["rotary_speed"] == 3.5


IN_SI = {"x": 1e-3, "z": 1e-3, "bit_speed": 1.0, "vz": 1.0}


@pytest.mark.parametrize("point", [-1, 8, True, "1", None])
def test_a_point_that_is_not_there(branches, session, point):
    with pytest.raises(InputError, match="point"):
        Session(branches).orbit({"point": point})
    with pytest.raises(InputError, match="point"):
        session.orbit({"point": 0})


@pytest.mark.parametrize(
    "changes",
    [{"row_size": np.array([4, 5])}, {"state": None}, {"period": None}, {"rotary_speed": None}, {"lobes": None}],
)
def test_a_damaged_file_is_said(shared, tmp_path, changes):
    path = write(tmp_path / "b.h5", shared, **changes)
    with pytest.raises(FileError, match=r"is missing|as many points as they say"):
        Session(path)


def test_other_files_are_no_branches(shared, branches):
    with pytest.raises(FileError, match="results file; a file of branches"):
        Session(shared / "small.h5", over=shared / "map.h5")
    with pytest.raises(InputError, match="over: found"):
        Session(shared / "small.yaml", over=branches)


@pytest.mark.usefixtures("words_only")
def test_the_report_has_them(branches, shared, tmp_path):
    out = tmp_path / "r.html"
    arguments = ["report", str(shared / "small.h5"), str(branches), "-o", str(out), "--motions", "0"]
    done = CliRunner().invoke(group, arguments)
    assert done.exit_code == 0, done.output
    text = out.read_text()
    for wanted in (
        "Branch 0",
        "fold at 3 rad/s (point 2)",
        "wall reached at 2 rad/s (point 5)",
        "ends: a fold",
        "1 rad/s to 4 rad/s",
        "8 on 2 branches",
        "nsdrill branches branches_study.yaml -o branches_again.h5",
        f"nsdrill show {branches} --study &gt; branches_study.yaml",
    ):
        assert wanted in text, wanted

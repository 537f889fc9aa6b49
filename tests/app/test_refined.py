"""A refined sweep: the runs of the full grid, fewer of them, and the same file whatever
happened on the way."""

import numpy as np
import pytest
from interrupts import Interrupt, look_often
from model_tables import FEATURES
from same_bits import different

import nsdrill
from nsdrill.app.answering.summary import reclassify, summarize
from nsdrill.app.check import check
from nsdrill.app.running.run import Interrupted, run_in_memory, run_study
from nsdrill.app.simulating.trajectory import replay
from nsdrill.errors import InputError, StudyError
from nsdrill.store import part_path, read_attributes, read_partial, read_results
from nsdrill.study import Study, parse_study
from nsdrill.variables import INFERRED, OK, PENDING, STEP_LIMIT

GRID = """
operation: {depth: 3000 m}
simulation: {transient: 5 s, observe: 15 s}
record: {peaks: 2}
sweep:
  wob: {from: 20 kN, to: 100 kN, points: 4}
  rotary_speed: {from: 1 rad/s, to: 9 rad/s, points: 5}
  refine: 2
"""
CHAINS = GRID.replace("points: 5", "points: 9") + "  procedure: up-down\n  along: wob\n"
TEXTS = pytest.mark.parametrize("text", [GRID, CHAINS], ids=["grid", "chains"])


def study_of(text: str, *overrides: str) -> Study:
    return parse_study(text, "s.yaml", overrides)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    path = tmp_path_factory.mktemp("refined") / "whole.h5"
    run_study(study_of(GRID), path)
    return path


def test_what_was_run_has_the_bits_of_the_full_grid(whole):
    full = run_in_memory(
        study_of(GRID.replace("points: 4", "points: 13").replace("points: 5", "points: 17"), "sweep.refine=0")
    )
    found = read_results(whole)
    for axis in ("wob", "rotary_speed"):
        assert np.array_equal(found.coords[axis], full.coords[axis])
    ran, inferred = found["status"] == OK, found["status"] == INFERRED
    assert np.all(ran | inferred)
    assert 0.1 < inferred.mean() < 0.9
    for name, values in found.variables.items():
        assert values[ran].tobytes() == full[name][ran].tobytes(), name
    for name in FEATURES:
        if name in found.variables:
            assert np.all(np.isnan(found[name][inferred]))
    assert not np.any(found["whirl_kind"][inferred])
    # Every neighbour of an inferred point that was run has its response.
    response = found["response"]
    for axis in (2, 3):
        n = response.shape[axis]
        first, second = (np.take(response, range(k, n - 1 + k), axis) for k in (0, 1))
        mixed = np.take(ran, range(n - 1), axis) != np.take(ran, range(1, n), axis)
        assert np.array_equal(first[mixed], second[mixed])


def test_the_coarse_values_keep_their_bits():
    coarse, fine = study_of(GRID, "sweep.refine=0").axes, study_of(GRID, "sweep.refine=5").axes
    for axis in ("wob", "rotary_speed"):
        assert np.array_equal(fine[axis][::32], coarse[axis])
    odd = "sweep: {wob: {from: 1.1 lbf, to: 0.7 MN, points: 38}, refine: 6}"
    assert np.array_equal(study_of(odd).axes["wob"][::64], study_of(odd, "sweep.refine=0").axes["wob"])


def test_what_the_file_says_of_it(whole):
    attrs, summary = read_attributes(whole), summarize(read_results(whole))
    status = read_results(whole)["status"]
    told = summary["refinement"]
    assert told["points_run"] == np.count_nonzero(status == OK)
    assert told["points_run"] + told["points_inferred"] == 13 * 17
    assert told["border_spacing"] == pytest.approx({"wob": 80e3 / 12, "rotary_speed": 0.5})
    assert attrs["refine"] == 2
    assert summary["finished"]
    assert not summary["failed"]
    assert sum(summary["responses"]["same"].values()) == 13 * 17
    report = check(study_of(GRID))
    assert (report.coarse_points, report.points) == (20, 13 * 17)


@TEXTS
@pytest.mark.parametrize("after", [1, 4])
def test_an_interrupted_run_goes_on(tmp_path, text, after, monkeypatch):
    look_often(monkeypatch)
    study, out, one = study_of(text), tmp_path / "out.h5", tmp_path / "one.h5"
    run_study(study, one, workers=2, lanes=8)
    resumed = 0
    while not out.exists():
        try:
            run_study(study, out, resume=True, workers=1, lanes=8, watch=Interrupt(after))
        except Interrupted:
            resumed += 1
            assert not np.any(read_partial(part_path(out), ["status"])["status"] == INFERRED)
    assert resumed >= 2
    assert not different(one, out)
    before = out.read_bytes()
    outcome = run_study(study, out, resume=True)
    assert outcome.steps == 0
    assert out.read_bytes() == before
    assert not part_path(out).exists()


def test_chains_are_run_whole_and_where_neighbours_differ(tmp_path):
    out = tmp_path / "out.h5"
    run_study(study_of(CHAINS), out)
    found = read_results(out)
    assert found.shape == (2, 1, 4, 33)  # the axis along which the state is carried stays as it is
    ran = found["status"][:, 0] == OK
    assert np.all(ran.all(axis=(0, 1)) == ran.any(axis=(0, 1)))
    assert np.all(ran[:, :, ::4])
    chains = ran.all(axis=(0, 1))
    kind = found["response"][:, 0].reshape(8, -1)
    assert chains.sum() < 33
    for left in np.flatnonzero(~chains):
        assert np.array_equal(kind[:, left], kind[:, left - 1])
    one = run_in_memory(
        study_of(
            CHAINS.replace("from: 1 rad/s, to: 9 rad/s, points: 9", "from: 1 rad/s, to: 9 rad/s, points: 33"),
            "sweep.refine=0",
        )
    )
    for name, values in found.variables.items():
        assert values[found["status"] == OK].tobytes() == one[name][found["status"] == OK].tobytes()


def test_failed_points_are_surrounded_and_retried(tmp_path, whole):
    steps = read_results(whole)["steps"]
    limit = int(np.quantile(steps[steps > 0], 0.85))
    out = tmp_path / "out.h5"
    first = run_study(study_of(GRID, f"simulation.max_steps={limit}"), out)
    status = read_results(out)["status"]
    failed = status == STEP_LIMIT
    assert first.failed == failed.sum() > 0
    coarse = np.zeros_like(failed)
    coarse[..., ::4, ::4] = True
    for _, _, w, s in np.argwhere(failed & coarse):
        assert not np.any(status[0, 0, max(w - 1, 0) : w + 2, max(s - 1, 0) : s + 2] == INFERRED)
    run_study(study_of(GRID, "simulation.max_steps=50000000"), out, retry_failed=True)
    assert not different(out, whole)


def test_new_labels_are_inferred_anew_or_refused(tmp_path, whole):
    out = tmp_path / "out.h5"
    out.write_bytes(whole.read_bytes())
    before = read_results(out)
    ran, inferred = before["status"] == OK, before["status"] == INFERRED
    # A threshold that no run exceeds takes a bit from all.
    reclassify(out, ["classify.bit_bounce.lift_off_fraction=1"])
    after = read_results(out)
    assert np.array_equal(after["response"], before["response"] & ~1)
    assert np.any(before["response"][inferred] & 1)
    reclassify(out, [])
    assert not different(out, whole)
    run_study(study_of(GRID), out, resume=True)
    # Between two coarse points that agreed a new border is not known.
    index = before["stick_slip_index"]
    threshold = float(np.nanquantile(index[ran], 0.05))
    with pytest.raises(InputError, match=r"at least \d+ more points?"):
        reclassify(out, [f"classify.stick_slip.stick_slip_index={threshold}"])
    assert not different(out, whole)


@pytest.mark.parametrize("more", [["record.poincare=12"], ["simulation.verify=true", "record.exponent=true"]])
def test_the_labels_of_the_study_are_those_in_the_file(tmp_path, more):
    out = tmp_path / "out.h5"
    run_study(study_of(GRID, *more), out)
    assert not any(changed for changed, _ in reclassify(out, []).values())


def test_an_inferred_point_cannot_be_replayed(whole):
    found = read_results(whole)
    _, _, w, s = np.argwhere(found["status"] == INFERRED)[0]
    place = {"wob": float(found.coords["wob"][w]), "rotary_speed": float(found.coords["rotary_speed"][s])}
    with pytest.raises(InputError, match=r"was not run.*nearest point that was run: wob='\S+kN' rotary_speed='"):
        replay(whole, **place)


def test_without_a_file(whole):
    found, there = run_in_memory(study_of(GRID)), read_results(whole)
    assert all(found[name].tobytes() == there[name].tobytes() for name in there.variables)
    assert found.attrs["points_run"] == there.attrs["points_run"]
    assert not np.any(found["status"] == PENDING)


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        (["sweep.refine=7"], "at least 0 and at most 6"),
        (["sweep.wob=[20 kN, 30 kN]", "sweep.procedure=up", "sweep.along=rotary_speed"], "beside rotary_speed"),
        (["sweep.wob=20 kN", "sweep.rotary_speed=[1 rad/s]"], "with no axis to refine"),
        (["sweep.wob.points=10000000"], "over all axes, refined"),
    ],
)
def test_what_cannot_be_refined(overrides, words):
    with pytest.raises(StudyError, match=words):
        study_of(GRID, *overrides)


def test_a_part_counts_its_own_runs_and_a_window_those_that_were_not_made(whole):
    data = nsdrill.open_results(whole)
    part = data.isel(rotary_speed=slice(0, 5))
    inferred = int((part.status == 5).sum())
    told = f"{part.status.size - inferred} of {part.status.size} points run, of {data.status.size} in the whole file"
    assert told in str(nsdrill.show(part))
    assert "in the whole file" not in str(nsdrill.show(data))
    assert nsdrill.window(data)["inferred_runs"] == int((data.status == 5).sum()) > 0

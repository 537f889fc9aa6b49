"""Failed points once more: the file becomes that of an undisturbed run with the limit
that is now given."""

import json
from pathlib import Path

import numpy as np
import pytest
from interrupts import Interrupt, look_often
from same_bits import different

import nsdrill
from nsdrill.app.answering.summary import reclassify
from nsdrill.app.experiment import prepare
from nsdrill.app.running.run import Interrupted, run_study
from nsdrill.cli.main import main
from nsdrill.errors import FileError
from nsdrill.store import RunLog, part_path, read_attributes, read_results
from nsdrill.study import Study, parse_study
from nsdrill.variables import OK, STEP_LIMIT

GRID = """
simulation: {transient: 5 s, observe: 10 s}
record: {peaks: 2}
sweep:
  wob: [20 kN, 60 kN]
  rotary_speed: {from: 1 rad/s, to: 9 rad/s, points: 12}
"""
CHAINS = GRID + "  procedure: up-down\n  along: rotary_speed\n"
TEXTS = pytest.mark.parametrize("text", [GRID, CHAINS], ids=["grid", "chains"])


def study_of(text: str, max_steps: int) -> Study:
    return parse_study(text, "s.yaml", (f"simulation.max_steps={max_steps}",))


@pytest.fixture
def out(tmp_path):
    return tmp_path / "out.h5"


@pytest.fixture(scope="module")
def free(tmp_path_factory):
    """Of each text the file in which no point fails."""
    folder = tmp_path_factory.mktemp("free")
    made = {GRID: folder / "grid.h5", CHAINS: folder / "chains.h5"}
    for text, path in made.items():
        run_study(study_of(text, 10**7), path)
    return made


def limits(path: Path) -> tuple[int, int]:
    """Two limits of steps: under the first many points fail, under the second few."""
    free = read_results(path)
    tried = free["steps"] + free["rejected"]
    return int(np.quantile(tried, 0.4)), int(np.quantile(tried, 0.8))


@TEXTS
def test_with_nothing_changed_the_file_stays_what_it_was(out, text, free):
    low, _ = limits(free[text])
    study = study_of(text, low)
    first = run_study(study, out)
    assert 0 < first.failed < first.points
    out.with_name("before.h5").write_bytes(out.read_bytes())
    again = run_study(study, out, retry_failed=True)
    assert again.failed == first.failed
    assert again.already < first.points
    assert not different(out, out.with_name("before.h5"))
    assert not part_path(out).exists()


@TEXTS
def test_a_larger_limit_gives_the_file_of_a_run_with_it(out, tmp_path, text, free):
    low, high = limits(free[text])
    run_study(study_of(text, low), out)
    for limit in (high, 10**7):
        outcome = run_study(study_of(text, limit), out, retry_failed=True)
        assert outcome.already > 0
        run_study(study_of(text, limit), tmp_path / "whole.h5", overwrite=True)
        assert not different(out, tmp_path / "whole.h5")
    made, whole = read_attributes(out), read_attributes(tmp_path / "whole.h5")
    assert {name for name in whole if made[name] != whole[name]} <= {"created", "history"}
    history = made["history"].splitlines()
    assert len(history) == 3
    assert history[2].endswith(f"run --retry-failed simulation.max_steps={10**7} (was {high})")
    assert json.loads(made["study_resolved"])["simulation"]["max_steps"] == 10**7
    assert np.all(read_results(out)["status"] == OK)


@TEXTS
@pytest.mark.parametrize("after", [1, 3])
def test_an_interrupted_retry_goes_on(out, tmp_path, text, after, monkeypatch, free):
    """Of a chain nothing stays that followed from a point that has become another."""
    look_often(monkeypatch)
    low, high = limits(free[text])
    run_study(study_of(text, low), out)
    with pytest.raises(Interrupted):
        run_study(study_of(text, high), out, retry_failed=True, workers=1, lanes=1, watch=Interrupt(after))
    plan = prepare(study_of(text, high)).plan
    with RunLog.open(part_path(out)) as log:
        done = log.done()[plan.points_of(np.arange(plan.chains)[:, None], np.arange(plan.chain_length))]
    assert not np.any(done[:, 1:] & ~done[:, :-1])
    with pytest.raises(FileError, match="another study"):
        run_study(study_of(text, low), out, resume=True)
    run_study(study_of(text, high), out, resume=True)
    run_study(study_of(text, high), tmp_path / "whole.h5")
    assert not different(out, tmp_path / "whole.h5")


def test_an_unfinished_run_takes_the_larger_limit_too(out, tmp_path, monkeypatch, free):
    look_often(monkeypatch)
    low, _ = limits(free[GRID])
    with pytest.raises(Interrupted):
        run_study(study_of(GRID, low), out, workers=1, lanes=1, watch=Interrupt())
    with RunLog.open(part_path(out)) as log:
        missing = int(np.count_nonzero(~log.done()))
    assert missing > 0
    run_study(study_of(GRID, 10**7), out, retry_failed=True)
    assert not different(out, free[GRID])
    assert sorted(p.name for p in tmp_path.iterdir()) == ["out.h5"]


def test_what_may_not_differ(out, free):
    low, high = limits(free[GRID])
    run_study(study_of(GRID, high), out)
    before = out.read_bytes()
    with pytest.raises(FileError, match=f"max_steps: {high} there, {low} here.* only simulation.max_steps may differ"):
        run_study(study_of(GRID, low), out, retry_failed=True)
    other = GRID.replace("20 kN", "21 kN")
    with pytest.raises(FileError, match=r"only simulation\.max_steps may differ, and only be larger"):
        run_study(study_of(other, high), out, retry_failed=True)
    with pytest.raises(FileError, match="to the points that failed: retry_failed=True"):
        run_study(study_of(GRID, 10**7), out, resume=True)
    with pytest.raises(FileError, match="exclude each other"):
        run_study(study_of(GRID, high), out, retry_failed=True, overwrite=True)
    assert out.read_bytes() == before
    assert not part_path(out).exists()


def test_other_labels_are_not_mixed_with_those_of_the_study(out, free):
    low, high = limits(free[GRID])
    run_study(study_of(GRID, low), out)
    reclassify(out, ["classify.stick_slip.stick_slip_index=60"])
    with pytest.raises(FileError, match="nsdrill classify without set"):
        run_study(study_of(GRID, high), out, retry_failed=True)
    reclassify(out, [])
    run_study(study_of(GRID, high), out, retry_failed=True)
    assert np.any(read_results(out)["status"] == STEP_LIMIT)


def test_where_nothing_failed_nothing_changes(out):
    # and where nothing is there, it is a run like any other
    nsdrill.run(study_of(GRID, 10**7), out, retry_failed=True)
    before = out.read_bytes()
    assert run_study(study_of(GRID, 10**8), out, retry_failed=True).already == 24
    assert out.read_bytes() == before


@pytest.mark.parametrize("where", ["os.replace", "nsdrill.store.RunLog._write_slots"])
def test_a_full_disk_leaves_the_failed_points_where_they_are(out, tmp_path, monkeypatch, where, free):
    low, _ = limits(free[GRID])
    run_study(study_of(GRID, low), out)
    before = out.read_bytes()
    real = RunLog._write_slots

    def refuse(*inputs):
        error = OSError(28, "No space left on device")
        if not isinstance(log := inputs[0], RunLog):
            raise error
        if ".tmp-" not in log.path.name:
            return real(*inputs)
        log._raise_write_error(error)

    with monkeypatch.context() as patch:
        patch.setattr(where, refuse)
        with pytest.raises(
            nsdrill.NsdrillError, match=r"out.h5.part: could not be rewritten: no space left on device. Nothing was ch"
        ):
            run_study(study_of(GRID, 10**7), out, retry_failed=True)
    assert out.read_bytes() == before
    run_study(study_of(GRID, 10**7), out, retry_failed=True)
    assert not different(out, free[GRID])
    assert sorted(p.name for p in tmp_path.iterdir()) == ["out.h5"]


def test_the_command(out, tmp_path, monkeypatch, free):
    low, _ = limits(free[GRID])
    study = tmp_path / "s.yaml"
    study.write_text(GRID)
    words = ["nsdrill", "run", str(study), "-o", str(out), "--quiet"]
    for more, code in ((["--set", f"simulation.max_steps={low}"], 3), (["--retry-failed"], 0)):
        monkeypatch.setattr("sys.argv", [*words, *more])
        with pytest.raises(SystemExit) as end:
            main()
        assert end.value.code == code

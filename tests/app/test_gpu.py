"""Sweeps on a GPU, in whose place this processor runs its code: whole files with the bits
of the processor, however they are begun, interrupted and finished."""

import signal
import time
from pathlib import Path

import numpy as np
import pytest
from cli.helpers import call_here, finish, start
from same_bits import different

import nsdrill
from nsdrill.app.experiment import prepare
from nsdrill.app.running import place
from nsdrill.app.running.place import place_for
from nsdrill.app.running.run import Interrupted, run_study
from nsdrill.app.running.stages import work_of
from nsdrill.errors import DeviceError, DeviceMemoryError, InputError, NsdrillError
from nsdrill.kernel.launcher import Host, HostKernel
from nsdrill.store import part_path, read_attributes
from nsdrill.study import parse_study

NAME = Host.name
GRID = """\
title: Grid
operation: {depth: 2000 m}
sweep:
  wob: [20 kN, 60 kN]
  rotary_speed: {from: 1 rad/s, to: 9 rad/s, points: 5}
simulation: {transient: 1 s, observe: 2 s}
record: {peaks: 4}
"""
CARRIED = GRID.replace("points: 5}", "points: 5}\n  procedure: up-down\n  along: rotary_speed")
STUDIES = {
    "grid": GRID,
    "more points than threads": GRID.replace("points: 5", "points: 40").replace("2 s}", "0.5 s}"),
    "carried": CARRIED,
    "all three ways": CARRIED.replace("up-down", "all"),
    "long chains": CARRIED.replace("points: 5", "points: 70").replace("1 s, observe: 2 s", "0.1 s, observe: 0.1 s"),
    "starts": GRID + "initial: {ensemble: 3, seed: 2}\n",
    "samples": GRID + "uncertain: {bit.rock_stiffness: {uniform: [20 MN/m, 30 MN/m]}, samples: 4}\n",
    "verified": GRID.replace("2 s}", "2 s, verify: true}"),
    "refined": GRID.replace("points: 5}", "points: 9}\n  refine: 2"),
    "implicit": GRID.replace("2 s}", "2 s, method: implicit}"),
    "implicit where friction is steep": CARRIED.replace(
        "wob: [20 kN, 60 kN]", "bit.friction.smoothing: [100 s/rad, 100000 s/rad]"
    ),
    "friction as an axis": GRID.replace("wob: [20 kN, 60 kN]", "bit.friction.law: [hyperbolic, linear]"),
    "a limit of steps": CARRIED.replace("2 s}", "20 s, max_steps: 3000}"),
    "returns and the exponent": GRID.replace("peaks: 4", "peaks: 0, poincare: 20, exponent: true"),
    "other model": "model: torsion\n" + GRID.replace("operation: {depth: 2000 m}\n", ""),
}


@pytest.fixture(autouse=True)
def gpu(monkeypatch):
    monkeypatch.setenv("NSDRILL_GPU", "host")
    monkeypatch.setattr(place, "LEAST_CHAINS", 2)
    monkeypatch.setattr(place, "OF_EACH", 1)


@pytest.mark.parametrize("text", STUDIES.values(), ids=STUDIES)
def test_a_file_has_the_bits_of_the_processor(tmp_path, text):
    study = parse_study(text, "s.yaml")
    for name in ("cpu", "gpu"):
        run_study(study, tmp_path / f"{name}.h5", workers=2, device=name)
    assert not different(tmp_path / "cpu.h5", tmp_path / "gpu.h5")
    here, there = (read_attributes(tmp_path / f"{name}.h5") for name in ("cpu", "gpu"))
    assert {name for name in here if here[name] != there[name]} <= {"device", "created", "history"}
    assert (here["device"], there["device"]) == ("cpu", NAME)


def test_a_fit_has_the_bits_of_the_processor(tmp_path):
    text = "model: torsion\nsimulation: {transient: 5 s, observe: 5 s}\n"
    text += "uncertain: {bit.friction.static: {uniform: [0.2, 0.8]}}\n"
    data = tmp_path / "rig.csv"
    data.write_text("rotary_speed [rad/s], wob [kN], stick_slip_index [%]\n2, 30, 150\n4, 50, 60\n", encoding="utf-8")
    here, there = (
        nsdrill.fit(text, data, batch=16, rounds=2, samples=16, progress=False, device=name) for name in ("cpu", "gpu")
    )
    assert here.study == there.study
    assert all(np.array_equal(here.predicted[name], there.predicted[name], equal_nan=True) for name in here.predicted)


@pytest.mark.parametrize(
    "text", [CARRIED, STUDIES["refined"], STUDIES["verified"]], ids=["carried", "refined", "verified"]
)
@pytest.mark.parametrize(("one", "other"), [("cpu", "gpu"), ("gpu", "cpu")])
def test_a_run_goes_on_on_the_other_device(tmp_path, monkeypatch, text, one, other):
    study = parse_study(text, "s.yaml")
    run_study(study, tmp_path / "whole.h5", workers=2)
    path = tmp_path / "out.h5"
    monkeypatch.setattr("nsdrill.sweep.engine.QUANTUM", 1e-6)
    monkeypatch.setattr("nsdrill.kernel.batch.STEPS_PER_CALL", 2000)
    monkeypatch.setattr("nsdrill.kernel.device_batch.FIRST_BUDGET", 200)
    with pytest.raises(Interrupted) as stopped:
        run_study(study, path, workers=1, device=one, watch=_after(3))
    assert stopped.value.done >= 3
    run_study(study, path, workers=2, device=other, resume=True)
    assert not different(tmp_path / "whole.h5", path)
    assert set(read_attributes(path)["device"].split(" and ")) == {"cpu", NAME}


def _after(points: int):
    """Ctrl-C once so many points are there."""

    def watch(progress):
        if progress.done >= points:
            raise KeyboardInterrupt

    return watch


def test_a_command_is_interrupted_and_goes_on(tmp_path):
    (tmp_path / "s.yaml").write_text(GRID.replace("observe: 2 s", "observe: 2000 s"), encoding="utf-8")
    process = start("run", "s.yaml", "-o", "out.h5", "--device", "gpu", cwd=tmp_path)
    while not (tmp_path / "out.h5.part").exists() and process.poll() is None:
        time.sleep(0.05)
    time.sleep(1.0)
    process.send_signal(signal.SIGINT)
    answer = finish(process)
    assert answer.code == 130, answer.err
    assert "Device: this processor as a GPU, 10 chains, and a GPU pays from some 1000 on." in answer.err
    assert part_path(tmp_path / "out.h5").exists()


def test_auto_counts_chains(tmp_path, monkeypatch, capfd):
    monkeypatch.setattr(place, "LEAST_CHAINS", 11)
    monkeypatch.chdir(tmp_path)
    Path("few.yaml").write_text(GRID, encoding="utf-8")
    Path("chains.yaml").write_text(CARRIED, encoding="utf-8")
    Path("many.yaml").write_text(GRID.replace("points: 5", "points: 6"), encoding="utf-8")
    told = {}
    for name in ("few", "chains", "many"):
        told[name] = call_here(capfd, monkeypatch, f"run {name}.yaml -o {name}.h5 --device auto").err
    assert "Device: the processor: 10 chains, and a GPU pays from some 11 on." in told["few"]
    assert "Device: the processor: 2 chains, and a GPU pays from some 11 on." in told["chains"]
    assert f"Device: {NAME}, 12 chains." in told["many"]
    assert [read_attributes(f"{name}.h5")["device"] for name in told] == ["cpu", "cpu", NAME]
    assert f"device         {NAME}" in call_here(capfd, monkeypatch, "show many.h5").out
    assert "device  " not in call_here(capfd, monkeypatch, "show few.h5").out


def test_more_processors_need_more_chains(monkeypatch):
    monkeypatch.setattr(place, "OF_EACH", 64)
    work = work_of(prepare(parse_study(GRID, "s.yaml")))
    assert place_for("auto", [work], 64 * 32, 32).gpu is not None
    found = place_for("auto", [work], 64 * 32 - 1, 32)
    assert (found.gpu, found.told) == (None, "the processor: 2047 chains, and a GPU pays from some 2048 on")


def test_a_gpu_that_is_slow_in_double_precision_is_left_alone(monkeypatch):
    monkeypatch.setattr(Host, "ratio", 64)
    work = work_of(prepare(parse_study(GRID, "s.yaml")))
    found = place_for("auto", [work], 5000, 1)
    assert (found.gpu, found.told) == (None, f"the processor: {NAME} has 1/64 of its speed in double precision")
    assert place_for("gpu", [work], 5000, 1).gpu is not None


def test_without_a_driver(tmp_path, monkeypatch, capfd):
    from nsdrill.kernel import device as driver

    monkeypatch.delenv("NSDRILL_GPU")
    monkeypatch.setattr(driver, "LIBRARIES", dict.fromkeys(("linux", "darwin", "win32"), ("nowhere.so",)))
    driver._driver.cache_clear()
    driver.open_gpu.cache_clear()
    monkeypatch.chdir(tmp_path)
    Path("s.yaml").write_text(GRID, encoding="utf-8")
    answer = call_here(capfd, monkeypatch, "run s.yaml -o out.h5 --device gpu", code=2)
    assert "--device gpu: the driver of NVIDIA's GPUs is not installed (nowhere.so is not found)." in answer.err
    assert "Run with --device cpu." in answer.err
    assert not list(tmp_path.glob("out*"))
    answer = call_here(capfd, monkeypatch, "run s.yaml -o out.h5 --device auto")
    assert (
        "Device: the processor: the driver of NVIDIA's GPUs is not installed (nowhere.so is not found)." in answer.err
    )


def test_what_has_no_code_for_a_gpu_is_named_and_runs_on_the_processor(monkeypatch):
    def refuse(self, function):
        raise NsdrillError("model.py, line 7: force: math.erf: erf is a function of the C library")

    monkeypatch.setattr(Host, "load", refuse)
    with pytest.raises(InputError, match=r"^device='gpu': model.py, line 7: force: .*erf is a function"):
        nsdrill.run(GRID, device="gpu", progress=False)
    assert nsdrill.run(GRID, device="auto", progress=False).attrs["device"] == "cpu"


def test_what_does_not_go_together(monkeypatch):
    with pytest.raises(InputError, match=r"device: found gpu with engine dask; allowed: .* engine='threads'"):
        nsdrill.run(GRID, device="gpu", engine="dask", progress=False)
    with pytest.raises(InputError, match="device: found 'tpu'; allowed: cpu, gpu, auto"):
        nsdrill.run(GRID, device="tpu", progress=False)
    monkeypatch.setattr(place, "route", lambda: "numba")
    with pytest.raises(
        InputError, match=r"device: found gpu, and numba as compiler .*; allowed: gpu with the native compiler"
    ):
        nsdrill.run(GRID, device="gpu", progress=False)
    assert nsdrill.run(GRID, device="auto", progress=False).attrs["device"] == "cpu"


def test_finished_points_are_kept_where_the_gpu_fails(tmp_path, monkeypatch):
    path, study = tmp_path / "out.h5", parse_study(STUDIES["more points than threads"], "s.yaml")
    launch, seen = HostKernel.launch, [0]
    monkeypatch.setattr("nsdrill.sweep.engine.QUANTUM", 1e-6)

    def failing(self, threads, given):
        if seen[0]:
            raise DeviceError("H200: a launch failed (CUDA_ERROR_LAUNCH_FAILED).")
        launch(self, threads, given)

    monkeypatch.setattr(HostKernel, "launch", failing)
    with pytest.raises(NsdrillError, match=r"a launch failed .* Finished points are kept: .* resume=True"):
        run_study(study, path, device="gpu", watch=lambda progress: seen.append(seen.pop() or progress.done))
    assert part_path(path).exists()
    monkeypatch.setattr(HostKernel, "launch", launch)
    result = run_study(study, path, resume=True)
    assert 0 < result.already < result.points
    run_study(study, tmp_path / "whole.h5")
    assert not different(tmp_path / "whole.h5", path)


def test_little_memory_is_slower_and_not_wrong(tmp_path, monkeypatch, capfd):
    study = parse_study(STUDIES["more points than threads"].replace("points: 40", "points: 150"), "s.yaml")
    zeros = Host.zeros

    def small(self, size, dtype=np.float64):
        if 8 * size > 60_000:
            raise DeviceMemoryError("no room")
        return zeros(self, size, dtype)

    run_study(study, tmp_path / "whole.h5")
    monkeypatch.setattr(Host, "zeros", small)
    nsdrill.run(study, tmp_path / "out.h5", device="gpu").close()
    assert not different(tmp_path / "whole.h5", tmp_path / "out.h5")
    assert f"Memory: {NAME} has memory for " in capfd.readouterr().err


def test_the_price_of_a_gpu_is_not_known(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    Path("s.yaml").write_text(GRID, encoding="utf-8")
    answer = call_here(capfd, monkeypatch, "check s.yaml --price --device gpu")
    assert f"Device: {NAME}, 10 chains" in answer.out
    assert "Time: on a GPU not known before it has run" in answer.out
    report = nsdrill.check(GRID, price=True, device="gpu").as_json()
    assert report["price"] is None
    monkeypatch.setattr(place, "LEAST_CHAINS", 1000)
    answer = call_here(capfd, monkeypatch, "check s.yaml --price --device auto")
    assert "Device: the processor: 10 chains" in answer.out
    assert "Time: about " in answer.out
    call_here(capfd, monkeypatch, "check s.yaml --device gpu", code=2)


def test_a_point_is_replayed_by_the_processor(tmp_path):
    nsdrill.run(CARRIED, tmp_path / "out.h5", device="gpu", progress=False).close()
    for way in ("up", "down"):
        trace = nsdrill.replay(tmp_path / "out.h5", wob="60 kN", rotary_speed="5 rad/s", procedure=way)
        assert trace.attrs["same_bits"] == 1

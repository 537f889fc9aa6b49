"""A batch on a device: the bits of a batch on the processor, however many threads and
launches there are. The device is this processor, with the code of one thread."""

import math
import os
import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from kernel.devices import DriverOfNone, device_batch, differing, left_by, runs_of
from nsdrill.abi import OBSERVER
from nsdrill.app.experiment import prepare
from nsdrill.app.running.run import work_of
from nsdrill.app.simulating.integration import schedule_of
from nsdrill.compiler.functions import anew, claim, compiled
from nsdrill.compiler.language import LanguageError
from nsdrill.errors import DeviceError, DeviceMemoryError
from nsdrill.kernel import device
from nsdrill.kernel import device_batch as module
from nsdrill.kernel.batch import Batch, Compiled, unobserved
from nsdrill.kernel.device import Driver, Gpu, GpuKernel
from nsdrill.kernel.device_batch import DeviceBatch
from nsdrill.kernel.launcher import Host
from nsdrill.kernel.thread import kept_rows, parked_rows
from nsdrill.models.ramp import Ramps
from nsdrill.models.registry import model_named
from nsdrill.models.variant import variant_at
from nsdrill.study import parse_study
from nsdrill.sweep.work import Work, compiled_parts
from nsdrill.variables import DIVERGED, OK, STEP_LIMIT

ALL = bool(os.environ.get("NSDRILL_TEST_ORACLE"))  # as in tests/compiler/test_oracle.py
SWEEP = """
model: {model}
sweep:
  rotary_speed: {{from: 2 rad/s, to: 12 rad/s, points: 11}}
  wob: [{wob}]
  procedure: {procedure}{along}
simulation: {{transient: {transient}, observe: {observe}, method: {method}, max_steps: {max_steps}}}
record: {{peaks: 4, poincare: {poincare}, exponent: {exponent}}}
"""
# Times long enough for events of every kind: sticking and peaks in torsion, contacts
# with rock and wall; the elastic models take more steps a second.
TIMES = {
    "torsion": (5, 15),
    "christoforou_yigit": (2, 4),
    "beam": (0.5, 0.5),
    "segments": (0.3, 0.3),
    "regenerative": (2, 4),
}
KINDS: dict[str, dict[str, Any]] = {
    "explicit": {},
    "implicit": {"method": "implicit"},
    "exponent": {"exponent": "true"},
    "section": {"poincare": 20},
}
CARRIED = {"procedure": "up-down", "wob": "40 kN, 80 kN", "along": "\n  along: rotary_speed"}
CASES = [("torsion", kind) for kind in KINDS] + [("christoforou_yigit", "explicit")]
EVERY = [(model, kind) for model in TIMES for kind in KINDS]


def work_for(model: str = "torsion", **changes: Any) -> Work:
    """A sweep over the speed, explicit unless it is said."""
    transient, observe = TIMES[model]
    given = {"method": "explicit", "poincare": 0, "exponent": "false", "procedure": "same", "max_steps": 10**6}
    given |= {"wob": "60 kN", "along": ""}
    given |= {"transient": f"{transient} s", "observe": f"{observe} s"} | changes
    work = work_of(prepare(parse_study(SWEEP.format(model=model, **given))))
    return work.by(given["method"])


def on_processor(work: Work) -> dict[str, np.ndarray]:
    points = np.arange(work.plan.points)
    return runs_of(work, work.new_batch(8, len(points)), points)


@pytest.mark.timeout(3600 if ALL else 600)
@pytest.mark.parametrize(("model", "kind"), EVERY if ALL else CASES)
def test_a_device_has_the_bits_of_the_processor(model, kind):
    """With more points than threads and slots, so that each is used again."""
    work = work_for(model, **KINDS[kind])
    wanted = on_processor(work)
    assert (wanted["status"] == OK).all()
    assert np.ptp(wanted["accepted"]) > 0
    points = np.arange(work.plan.points)
    for independent in (True, False):
        with device_batch(work, Host(), threads=3, slots=5, independent=independent) as batch:
            assert batch.lanes == 3
            assert batch.slots == 5
            assert not differing(runs_of(work, batch, points), wanted), independent
            assert batch.idle
            assert batch.free == 5
            assert batch.lane_steps == np.sum(wanted["accepted"] + wanted["rejected"])
            assert batch.packed_steps * 3 >= batch.lane_steps


@pytest.fixture(scope="module")
def stick_slip():
    """Runs of which some stick, and what they leave on the processor."""
    work = work_for()
    return work, on_processor(work)


@pytest.mark.parametrize("threads", [1, 4, 11])
@pytest.mark.parametrize("steps", [1, 137, 10**7])
@pytest.mark.parametrize("independent", [True, False])
def test_threads_and_launches_do_not_matter(stick_slip, threads, steps, independent, monkeypatch):
    work, wanted = stick_slip
    monkeypatch.setattr(module, "FIRST_BUDGET", steps)
    monkeypatch.setattr(module, "FEWEST_STEPS", steps)
    monkeypatch.setattr(module, "FASTER", 1.0)
    points = np.arange(3 if steps == 1 else 11)
    batch = device_batch(work, Host(), threads=threads, slots=11, independent=independent)
    found = runs_of(work, batch, points, seconds=30.0)
    assert not differing(found, {name: values[: len(points)] for name, values in wanted.items()})


def test_runs_may_be_added_at_any_time(stick_slip):
    """One after the other, between launches of a few steps."""
    work, wanted = stick_slip
    parts = compiled_parts(1, work.program)
    for independent in (True, False):
        batch, done = device_batch(work, Host(), threads=3, slots=11, independent=independent), []
        for point in range(11):
            batch.add_many(np.array([point]), work.prepare(np.array([point])))
            done.append(batch.advance(parts, 0.0, True))
            assert batch.waiting <= 11
        while not batch.idle:
            done.append(batch.advance(parts, 0.05, True))
        assert not differing(left_by(done), wanted)


def test_without_a_transient_the_observation_begins_at_once():
    work = work_for(transient="0 s")
    wanted = on_processor(work)
    for independent in (True, False):
        batch = device_batch(work, Host(), threads=4, independent=independent)
        assert not differing(runs_of(work, batch, np.arange(11)), wanted)


def chains_of(work: Work) -> list[np.ndarray]:
    return [work.plan.points_of(chain, np.arange(work.plan.lengths(chain))) for chain in range(work.plan.chains)]


@pytest.mark.parametrize("max_steps", [10**6, 2500])
def test_chains_are_carried_as_on_the_processor(max_steps):
    """Also past runs that reach the limit of steps: the next begins from its own start."""
    work = work_for("christoforou_yigit", **CARRIED, max_steps=max_steps)
    found = []
    small = work.new_batch(8, 1)
    width = small._outbox.shape[1] - 3 - small.rows.states - 1
    chains = chains_of(work)
    assert len(chains) == 2
    for batch in (
        Batch(8, work.plan.points, work.program.rows, small._store, width, work.simulation),
        device_batch(work, Host(), threads=2, slots=work.plan.points),
    ):
        for chain in chains:
            batch.add(chain, work.prepare(chain))
        parts, done = compiled_parts(1 if isinstance(batch, DeviceBatch) else 8, work.program), []
        while not batch.idle:
            done.append(batch.advance(parts, 0.02, True))
        found.append(left_by(done))
    assert not differing(*found)
    assert STEP_LIMIT in found[0]["status"] if max_steps == 2500 else (found[0]["status"] == OK).all()
    assert not (found[0]["initial"][1:11] == found[0]["initial"][:10]).all()


def test_segments_of_chains_are_added_beside_others():
    """The state that a run of a chain has reached stays, when others are added to slots on
    both sides of it."""
    work = work_for("christoforou_yigit", **CARRIED, transient="1 s", observe="1 s")
    first, second = chains_of(work)
    wanted: dict[str, np.ndarray] = {}
    found: dict[str, np.ndarray] = {}
    small = work.new_batch(8, 1)
    width = small._outbox.shape[1] - 3 - small.rows.states - 1
    for kept, batch in (
        (wanted, Batch(8, 44, work.program.rows, small._store, width, work.simulation)),
        (found, device_batch(work, Host(), threads=2, slots=44)),
    ):
        parts, done = compiled_parts(1 if isinstance(batch, DeviceBatch) else 8, work.program), []
        batch.add(first[:3], work.prepare(first[:3]))
        batch.add(second, work.prepare(second))
        while sum(len(d.job) for d in done) < 4:
            done.append(batch.advance(parts, 0.0, True))
        batch.add(first[3:], work.prepare(first[3:]))
        while not batch.idle:
            done.append(batch.advance(parts, 0.02, True))
        kept |= left_by(done)
    assert not differing(wanted, found)


def test_chains_need_a_batch_for_them():
    work = work_for("christoforou_yigit", **CARRIED)
    batch = device_batch(work, Host(), threads=1, slots=4, independent=True)
    with pytest.raises(ValueError, match="a chain is added to a batch that was made for independent runs"):
        batch.add(np.arange(2), work.prepare(np.arange(2)))
    assert batch.free == 4


def test_runs_fail_as_on_the_processor():
    """By a number that is none, a velocity that overflows, and the limit of steps."""
    work = work_for("christoforou_yigit", max_steps=1500)
    points = np.arange(11)
    runs = work.prepare(points)
    runs.initial[1, 5], runs.initial[4, 3], runs.initial[7, 1] = np.inf, 1e200, np.nan
    found = []
    for batch in (
        work.new_batch(8, 11),
        device_batch(work, Host(), threads=3, slots=11, independent=True),
        device_batch(work, Host(), threads=3, slots=11),
    ):
        batch.add_many(points, runs)
        parts, done = compiled_parts(1 if isinstance(batch, DeviceBatch) else 8, work.program), []
        while not batch.idle:
            done.append(batch.advance(parts, 0.05, True))
        found.append(left_by(done))
    assert set(found[0]["status"]) == {OK, DIVERGED, STEP_LIMIT}
    assert not differing(found[0], found[1])
    assert not differing(found[0], found[2])


def test_launches_end_early_where_all_runs_fail_and_stay_short():
    """The number of steps of a launch follows from launches that used it up."""
    work = work_for()
    batch = device_batch(work, Host(), threads=2, slots=4, independent=True)
    parts = compiled_parts(1, work.program)
    for _ in range(40):
        runs = work.prepare(np.arange(2))
        runs.initial[:, 1] = np.nan
        batch.add_many(np.arange(2), runs)
        while not batch.idle:
            assert (batch.advance(parts, 0.05, False).status == DIVERGED).all()
    assert batch._budget < 10**7


def test_a_ramp_has_the_same_bits():
    """The parameters move with time: the segments of a ramp, each from its own start."""
    study = parse_study("model: torsion\noperation: {rotary_speed: {ramp: [[0 s, 3 rad/s], [4 s, 9 rad/s]]}}\n")
    fixed = variant_at(model_named(study.model.name), study.parameters)
    cuts = schedule_of(study, {}).cuts(4.0, 6)
    ramps = Ramps(fixed)
    table = ramps.pack(study.parameters, study.initial, schedule_of(study, {}), cuts, study.thresholds)
    rows = fixed.rows(columns=len(ramps.columns))
    work = work_for()
    start = np.tile(work.prepare(np.array([0])).initial, (len(table), 1))
    simulation, found = replace(work.simulation, transient=0.0, observe=1.0), []
    for lanes in (8, 1):
        parts = Compiled(ramps.right_hand_side(lanes), *unobserved())
        batch = (
            Batch(8, len(table), rows, np.zeros(1), 0, simulation)
            if lanes == 8
            else DeviceBatch(Host(), parts, rows, np.zeros(1), 0, simulation, threads=2)
        )
        batch.add_many(np.arange(len(table)), fixed.runs(table, start))
        done = []
        while not batch.idle:
            done.append(batch.advance(parts, 0.1, True))
        found.append(left_by(done))
    assert not differing(*found)
    assert len({row.tobytes() for row in found[0]["final"]}) == len(table)


def test_rows_that_a_step_writes_first_are_not_kept():
    rows = work_for().program.rows
    kept = kept_rows(rows)
    assert not set(range(rows.stepper, rows.total)) & set(kept)
    assert set(range(rows.observer, rows.stepper)) < set(kept)
    assert not set(range(rows.observer, rows.stepper)) & set(parked_rows(rows))


def test_a_batch_of_a_device_stays_in_its_process():
    batch = device_batch(work_for(), Host(), threads=1, slots=1)
    with pytest.raises(TypeError, match="cannot be sent to another process"):
        pickle.dumps(batch)


def test_too_little_memory_makes_a_batch_smaller_and_is_said():
    work = work_for()
    wanted = on_processor(work)

    class Small(Host):
        name = "a small device"

        def free_memory(self):
            return 150_000

    with device_batch(work, Small(), threads=64, slots=256, independent=True) as batch:
        assert batch.lanes <= batch.slots < 256
        assert batch.shortage.startswith(f"a small device has memory for {batch.lanes} of 64 threads")
        assert not differing(runs_of(work, batch, np.arange(11)), wanted)
    assert not device_batch(work, Host(), threads=64, slots=256).shortage

    class Full(Host):
        def zeros(self, size, dtype=np.float64):
            raise DeviceMemoryError("no room")

    with pytest.raises(DeviceMemoryError, match="no room"):
        device_batch(work, Full())


def test_a_function_of_the_c_library_is_refused_with_its_place():
    """A model of a user may call it on the processor."""

    @compiled(OBSERVER)
    def observer(b, store):
        store[0] = math.exp(b[0])

    work = work_for()
    parts = replace(compiled_parts(1, work.program), observer=observer)
    with pytest.raises(LanguageError, match=r"observer: store\[0\] = math.exp.*a GPU does not have"):
        DeviceBatch(Host(), parts, work.program.rows, np.zeros(9), 0, work.simulation)


# The driver.


@pytest.fixture
def driver(monkeypatch):
    """One that is none; a kernel that is loaded into its GPU can be launched."""
    made = DriverOfNone()
    load = GpuKernel.__init__

    def loaded(self, gpu, function):
        load(self, gpu, function)
        made.functions[self._function.value] = function

    monkeypatch.setattr(GpuKernel, "__init__", loaded)
    return made


@pytest.mark.parametrize("independent", [True, False])
def test_the_calls_of_a_driver(driver, stick_slip, independent):
    """What is copied, given to a kernel and launched, with as many threads as run at the
    same time: two blocks on each of two multiprocessors."""
    work, wanted = stick_slip
    gpu = Gpu(Driver(driver))
    room = driver.room
    with device_batch(work, gpu, slots=700, independent=independent) as batch:
        assert batch.lanes == 512
        assert driver.text.startswith(b"//\n// Generated by LLVM NVPTX Back-End")
        assert not differing(runs_of(work, batch, np.arange(11)), wanted)
        assert driver.room < room
    assert driver.room == room
    assert driver.calls.count("cuLaunchKernel") >= 2


def test_little_memory_of_a_gpu(driver, stick_slip):
    work, wanted = stick_slip
    driver.room = 500_000
    with device_batch(work, Gpu(Driver(driver)), slots=700, independent=True) as batch:
        assert 32 <= batch.lanes < 512
        assert batch.shortage.startswith(f"GPU of a test has memory for {batch.lanes} of 512 threads and for")
        assert not differing(runs_of(work, batch, np.arange(11)), wanted)
    with pytest.raises(DeviceMemoryError, match=r"GPU of a test: its memory has no room for 8 MB more .*nvidia-smi"):
        Gpu(Driver(driver)).zeros(1_000_000)


FAULTS = {
    "cuDevicePrimaryCtxRetain": (46, "another program holds it (CUDA_ERROR_46)"),
    "cuModuleLoadDataEx": (222, "its driver is older than the code (CUDA_ERROR_222). Update the driver"),
    "cuLaunchKernel": (701, "a thread needs more registers or stack than it has (CUDA_ERROR_701)"),
    "cuCtxSynchronize": (719, "a launch failed, which is a fault of nsdrill or of the GPU (CUDA_ERROR_719)"),
    "cuMemcpyDtoH_v2": (999, "cuMemcpyDtoH_v2 failed (CUDA_ERROR_999). Look at nvidia-smi"),
}


@pytest.mark.parametrize("call", FAULTS)
def test_what_fails_is_said_with_a_remedy(driver, stick_slip, call):
    work, _ = stick_slip
    number, said = FAULTS[call]
    driver.faults[call] = number

    def launched():
        with device_batch(work, Gpu(Driver(driver)), slots=4, threads=4) as batch:
            batch.add_many(np.arange(3), work.prepare(np.arange(3)))
            batch.advance(compiled_parts(1, work.program), 0.1, True)

    with pytest.raises(DeviceError) as error:
        launched()
    assert f"GPU of a test: {said}" in str(error.value)
    assert "device='cpu'" in str(error.value)


def test_a_gpu_that_is_too_old_or_closed_is_refused():
    for change, said in (
        ({"capability": (6, 1)}, r"found compute capability 6\.1; allowed: 7\.0 or newer"),
        ({"mode": 2}, "its compute mode lets no program use it"),
    ):
        driver = DriverOfNone()
        for name, value in change.items():
            setattr(driver, name, value)
        with pytest.raises(DeviceError, match=said):
            Gpu(Driver(driver))


@pytest.mark.parametrize(
    ("platform", "said"),
    [
        ("linux", "libcuda.so.1 is not found"),
        ("win32", "nvcuda.dll is not found"),
        ("darwin", "allowed: Linux, and Windows"),
    ],
)
def test_without_a_driver(platform, said, monkeypatch):
    def missing(name):
        raise OSError(name)

    monkeypatch.setattr(device.sys, "platform", platform)
    monkeypatch.setattr(device.ctypes, "CDLL", missing)
    device._driver.cache_clear()
    with pytest.raises(DeviceError, match=rf"device='gpu': .*{said}.*Run with device='cpu'"):
        device._driver()


def test_a_driver_without_a_gpu(monkeypatch):
    for faults, said in (({"cuInit": 100}, "there is no GPU of NVIDIA"), ({"cuInit": 803}, "of different versions")):
        library = DriverOfNone(**faults)
        monkeypatch.setattr(device.ctypes, "CDLL", lambda name, library=library: library)
        device._driver.cache_clear()
        with pytest.raises(DeviceError, match=said):
            device.open_gpu()
    library = DriverOfNone()
    monkeypatch.setattr(device.ctypes, "CDLL", lambda name: library)
    device._driver.cache_clear()
    device.open_gpu.cache_clear()
    assert device.open_gpu().name == "GPU of a test"
    with pytest.raises(DeviceError, match="there is no GPU of NVIDIA"):
        device.open_gpu(1)
    device._driver.cache_clear()
    device.open_gpu.cache_clear()


def test_the_words_of_threads_in_plain_python():
    counters = np.array([3, 4])
    assert claim(counters, 1, 2) == 4
    assert counters.tolist() == [3, 6]
    assert anew(7) == 7

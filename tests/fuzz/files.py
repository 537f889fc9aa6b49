"""Files that another program has changed and sealed again: results, traces, branches,
logs of unfinished runs and tables of measurements. They are read, drawn and exported,
or refused in a short sentence, with finite numbers in all JSON.

Mutated are small files of made-up numbers, one of every kind of study, and the branches
of the smallest model. Attributes and datasets are deleted, replaced, filled and linked;
the text of logs and tables is changed. Each batch runs in a process of its
own, so that a crash of the HDF5 library is seen.
"""

import collections
import gc
import json
import math
import multiprocessing
import os
import random
import resource
import shutil
import sys
import tempfile
import time
import zlib
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import h5py
import numpy as np

import nsdrill
from nsdrill.app.experiment import prepare, provenance
from nsdrill.app.following.continuing import orbit_point, settings_for
from nsdrill.data import Trace, resolved_study
from nsdrill.errors import NsdrillError
from nsdrill.models.christoforou_yigit.columns import STATE_NAMES
from nsdrill.models.registry import BY_NAME, described
from nsdrill.store import MemoryLog, RunLog, from_dataset, log_format, pending_records, write_results, write_trace
from nsdrill.store.hdf5 import seal, unseal
from nsdrill.study import parse_study
from nsdrill.study.load import study_from_resolved
from nsdrill.variables import MODEL
from nsdrill.web.branch_curves import read_branches

from .common import Broken, arguments, check_json, command, time_limit

SECONDS = 60.0  # of one file, all commands; the machine may be busy
MEMORY = 6 << 30  # bytes of address space, most of it never touched
SPEEDS = "rotary_speed: {from: 1 rad/s, to: 8 rad/s, points: 5}"
STUDIES = {
    "one": f"sweep: {{{SPEEDS}}}\nrecord: {{peaks: 3}}",
    "both": f"sweep: {{{SPEEDS}, procedure: up-down}}\nrecord: {{peaks: 3, poincare: 9, exponent: true}}",
    "map": f"sweep: {{{SPEEDS}, wob: [10 kN, 20 kN, 30 kN]}}\nrecord: {{peaks: 0}}",
    "refined": f"sweep: {{{SPEEDS}, wob: {{from: 10 kN, to: 50 kN, points: 3}}, refine: 1}}\nrecord: {{peaks: 0}}",
    "depths": f"sweep: {{{SPEEDS}, depth: [1 km, 2 km], wob: [10 kN, 20 kN]}}\nsimulation: {{verify: true}}\n"
    "mud: {swirl: 1}",
    "further": f"sweep: {{{SPEEDS}, well.friction.dynamic: [0.1, 0.2], bit.rock_stiffness: "
    f"{{from: 10 MN/m, "
    "to: 80 MN/m, points: 4, spacing: log}}",
    "ensemble": "sweep: {rotary_speed: [3 rad/s, 4 rad/s]}\ninitial: {ensemble: 6}\nrecord: {poincare: 4}",
    "slice": "sweep: {rotary_speed: [3 rad/s]}\ninitial: {slice: {x: {from: 0 mm, to: 9 mm, "
    "points: 3}, "
    "vx: {from: 0 m/s, to: 1 m/s, points: 4}}}",
    "large": "sweep: {rotary_speed: {from: 1 rad/s, to: 8 rad/s, points: 1500}}\nrecord: {peaks: 0}",
    "trace": f"sweep: {{{SPEEDS}}}",
    "ramp": "operation: {rotary_speed: {ramp: [[0 s, 3 rad/s], [9 s, 8 rad/s]]}}",
}
BRANCHES = """\
model: torsion
operation: {wob: 22.24 kN}
simulation: {transient: 50 s, observe: 50 s}
continue: {along: rotary_speed, from: 1.5 rad/s, to: 6 rad/s, seeds: {rotary_speed: [5 rad/s]}, points: 15}
"""
LOG = "sweep: {rotary_speed: {from: 1 rad/s, to: 8 rad/s, points: 12}}\nrecord: {peaks: 2}"
TABLE = """\
rotary_speed [rpm],wob [kN],surface_torque_max [kN*m],error of surface_torque_max [kN*m]
20,10,4.5,0.2
30,20,5.5,0.2
40,30,6.5,0.2
50,30,7.5,0.2
"""
HOLD_JSON = ("study_resolved", "ramps", "border_spacing", "study_overrides", "at", "seeds")  # attributes
OTHERS = ("branches", "curves", "log", "table")
VALUES: tuple[Any, ...] = (
    0,
    -1,
    7,
    2**62,
    1.5,
    -1e308,
    1e308,
    math.inf,
    -math.inf,
    math.nan,
    "",
    "a",
    "\u202e\x1b[31m",
    "日本",
    "x" * 70000,
    "[]",
    "{}",
    "5",
    "null",
    "[1]",
    '{"a": 1}',
    "NaN",
    '{"a": NaN}',
    "1e999",
    "[" * 5000,
    '"' * 9,
    "9" * 5000,
    b"\xff\xfe",
    b"",
    np.zeros(3),
    np.full(9, np.nan),
    np.zeros((2, 2)),
    np.zeros(0),
    1j,
    h5py.Empty("f8"),
    np.array(["a", "b"], object),
    np.void(b"\0\1"),
    True,
)


def make_bases(folder: Path) -> None:
    """A sound file of every kind of study, and the ``OTHERS``."""
    chance = np.random.default_rng(1)
    _make_others(folder)
    for name, text in STUDIES.items():
        study = parse_study(f"title: {name}\n{text}")
        path = folder / f"{name}.h5"
        if name in ("trace", "ramp"):
            made = {v.name: np.abs(chance.normal(0.05, 0.02, 200)) for v in described(MODEL).trace if v.only is None}
            made |= {"depth": np.full(200, 5e3), "wob": np.full(200, 2e4)}
            made["drive_speed"] = np.linspace(3.0, 8.0, 200) if name == "ramp" else np.full(200, 3.0)
            extra: dict[str, Any] = {"procedure": "same", "replay_of": "x.h5"}
            if name == "ramp":
                extra = {"ramps": json.dumps({"rotary_speed": [[0.0, 9.0], [3.0, 8.0]]})}
            state = {"initial_state": np.zeros(9), "final_state": np.ones(9), "status": "ok", "steps": 9, "rejected": 1}
            point = {"depth": 5e3, "wob": 2e4, "rotary_speed": 3.0, "transient": 1.0, "observe": 1.0, "rtol": 1e-6}
            write_trace(
                path, Trace(np.linspace(0, 9, 200), made, {**provenance(study, "simulate"), **point, **state, **extra})
            )
            continue
        experiment = prepare(study)
        plan, kept = experiment.plan, experiment.contents
        records = pending_records(plan.points, kept)
        for variable in records.dtype.names or ():
            about, kind, shape = BY_NAME[variable], records.dtype[variable], records[variable].shape
            if kind.base.kind == "f":
                real = np.abs(chance.normal(0.5, 0.3, shape))
                records[variable] = np.where(chance.random(shape) < 0.02, np.nan, real)
            elif about.flag_masks or about.flag_values:
                records[variable] = chance.integers(0, 1 + max(about.flag_masks or about.flag_values or (1,)), shape)
        records["status"] = np.where(chance.random(plan.points) < 0.1, chance.integers(1, 5, plan.points), 1)
        coords: dict[str, Any] = {"procedure": list(plan.procedures), **plan.dimensions}
        if study.initial.starts:
            coords["start"] = list(range(study.initial.starts))
            records["attractor"] = chance.integers(0, 3, plan.points)
        attrs = provenance(study, "run")
        if study.refined:
            attrs |= {"refine": 1, "points_run": 9, "points_inferred": plan.points - 9, "border_spacing": {"wob": 1e3}}
        log = MemoryLog({"coords": coords, "attrs": attrs}, plan.points, kept)
        log.write(np.arange(plan.points), records)
        write_results(path, log)


def _make_others(folder: Path) -> None:
    (folder / "table.csv").write_text(TABLE)
    (folder / "study.yaml").write_text(BRANCHES)
    nsdrill.continue_branches(folder / "study.yaml", folder / "branches.h5")
    branches = nsdrill.open_results(folder / "branches.h5")
    numbers = np.linspace(2.0, 3.0, 6)
    curves = {
        "curve_label": ("curve", np.array([3, 5], np.int16)),
        "curve_motion": ("curve", np.array(["equilibrium", "limit_cycle"], object)),
        "curve_lobes": ("curve", np.array([1, 1])),
        "curve_branch": ("curve", np.array([0, 1])),
        "curve_end_reason": ("curve", np.array(["the end of the range"] * 2, object)),
        "curve_row_size": ("curve", np.array([4, 2])),
        "curve_unstable": ("curve_point", np.zeros(6, np.int16)),
        "curve_rotary_speed": ("curve_point", numbers, branches.rotary_speed.attrs),
        "curve_wob": ("curve_point", 1e4 * numbers, branches.wob.attrs),
    }
    nsdrill.save(branches.assign(curves).assign_attrs(over="wob", over_key="wob"), folder / "curves.h5")
    experiment = prepare(parse_study(LOG))
    plan, kept = experiment.plan, experiment.contents
    coords: dict[str, Any] = {"procedure": list(plan.procedures), **plan.dimensions}
    header = {"coords": coords, "attrs": provenance(parse_study(LOG), "run")}
    records = pending_records(plan.points, kept)
    for name in records.dtype.names or ():
        if records.dtype[name].base.kind == "f":
            records[name] = 0.5
    records["status"] = 1
    with RunLog.create(folder / "log.h5.part", header, plan.points, kept) as log:
        log.write(np.arange(9), records[:9])


def _scratch(data: bytes, chance: random.Random) -> bytes:
    """A few bytes taken out, put in or changed."""
    for _ in range(chance.choice((1, 1, 2, 5))):
        start = chance.randrange(len(data) + 1)
        end = min(len(data), start + chance.choice((0, 1, 1, 10, 4000)))
        pieces = (b"", b"\0", b"\xff", b",", b"\n", b'"', b"1e999", b"nan", "\u202e\x1b[31m".encode(), b"x" * 70000)
        data = data[:start] + chance.choice(pieces) + data[end:]
    return data


def _log(path: Path, chance: random.Random) -> str:
    """A changed log of an unfinished run, mostly with a right checksum."""
    data = path.read_bytes()
    length = log_format._PREFIX.unpack_from(data)[3]
    begin = log_format._PREFIX.size
    body, rest = data[begin : begin + length], data[begin + length :]
    text, _, numbers = body.partition(b"\n")
    fields, told = json.loads(text), "bytes"
    if chance.random() < 0.7:
        inside, keys = fields, []
        while True:
            key = chance.choice(list(inside) if isinstance(inside, dict) else range(len(inside)))
            keys.append(key)
            if not (isinstance(inside[key], dict | list) and inside[key]) or chance.random() < 0.2:
                break
            inside = inside[key]
        plain = [value for value in VALUES if isinstance(value, str | int | float | bool)]
        inside[key] = value = chance.choice((None, [], {}, [1], *plain))
        text, told = json.dumps(fields).encode(), f"{keys} = {value!r:.60}"
        body = text + b"\n" + numbers
    elif chance.random() < 0.5:
        body = _scratch(body, chance)
    else:
        rest = _scratch(rest, chance)
    right = log_format._PREFIX.pack(log_format.MAGIC, log_format.LOG_VERSION, zlib.crc32(body), len(body))
    path.write_bytes((right if chance.random() < 0.9 else data[:begin]) + body + rest)
    return told


def _attempt_other(base: str, folder: Path, bases: Path, chance: random.Random, note: Callable[[str], None]) -> bool:
    """As :func:`attempt`, of one of the ``OTHERS``."""
    if base == "table":
        table = folder / "table.csv"
        table.write_bytes(_scratch(TABLE.encode(), chance))
        note(repr(table.read_bytes())[:400])
        words = ("--kind", "surface_torque_max", "--data", table, "-o", folder / "out.png", "--overwrite")
        return command("plot", bases / "one.h5", *words) is not None
    if base == "log":
        path = folder / "out.h5.part"
        shutil.copyfile(bases / "log.h5.part", path)
        note(_log(path, chance))
        out = command("show", path, "--json")
        check_json(out)
        command("show", path)
        command("plot", path, "-o", folder / "out.png", "--overwrite")
        command("show", path, "--study", ours=False)
        return out is not None
    path = folder / "out.h5"
    shutil.copyfile(bases / f"{base}.h5", path)
    note("; ".join(mutate(path, chance)))
    out = command("show", path, "--json")
    check_json(out)
    command("show", path)
    command("show", path, "--study", ours=False)
    command("diff", path, bases / f"{base}.h5")
    check_json(command("diff", bases / f"{base}.h5", path, "--json"))
    command("export", path, "-o", folder / "out.csv", "--overwrite", "--units", "field")
    command("plot", path, "-o", folder / "out.png", "--overwrite")
    if base == "curves" and chance.random() < 0.3:
        command("plot", bases / "map.h5", "--over", path, "-o", folder / "out.png", "--overwrite")
    with suppress(NsdrillError):
        read_branches(path)
    with suppress(NsdrillError):
        settings_for(study_of_file(path), orbit_point(path, 3)[0])
    return out is not None


def study_of_file(path: Path) -> Any:
    """The study from which a file of branches was made."""
    return study_from_resolved(resolved_study(nsdrill.open_results(path).attrs))


def mutate(path: Path, chance: random.Random) -> list[str]:
    """A few changes of the file, in words."""
    unseal(path)
    told = []
    with h5py.File(path, "r+") as file:
        for _ in range(chance.choice((1, 1, 1, 2, 4))):
            change = chance.choice((_attribute, _attribute, _json, _dataset, _dataset, _numbers, _numbers, _coordinate))
            try:
                told.append(change(file, chance))
            except (OSError, ValueError, TypeError, KeyError, RuntimeError, IndexError, AttributeError) as error:
                told.append(f"({change.__name__}: {type(error).__name__})")  # h5py refused
    seal(path)
    return told


def _attribute(file: Any, chance: random.Random) -> str:
    thing = file if chance.random() < 0.7 else file[chance.choice(list(file))]
    name = chance.choice([*thing.attrs, "new", "classification", "classification_resolved", "ramps"])
    kind = chance.random()
    if kind < 0.25 and name in thing.attrs:
        del thing.attrs[name]
        return f"{thing.name}@{name} deleted"
    value = chance.choice(VALUES)
    if kind < 0.4 and isinstance(value, str | bytes):
        value = np.bytes_(value if isinstance(value, bytes) else value.encode())
    thing.attrs[name] = value
    return f"{thing.name}@{name} = {value!r:.60}"


def _json(file: Any, chance: random.Random) -> str:
    """One value inside an attribute that holds JSON."""
    found = [name for name in HOLD_JSON if name in file.attrs]
    name = chance.choice(found)
    data = json.loads(file.attrs[name])
    inside, path = data, []
    while isinstance(inside, dict | list) and inside:
        key = chance.choice(list(inside) if isinstance(inside, dict) else range(len(inside)))
        path.append(key)
        if not isinstance(inside[key], dict | list) or chance.random() < 0.2:
            break
        inside = inside[key]
    if not path:
        return f"{name} is empty"
    if chance.random() < 0.2:
        del inside[path[-1]]
        what = "deleted"
    else:
        value = chance.choice((None, 0, -1, 10**30, 1e308, math.nan, math.inf, "", "x", [], {}, [1, 2], True, "up"))
        inside[path[-1]], what = value, f"= {value!r}"
    file.attrs[name] = json.dumps(data)
    return f"@{name} {path} {what}"


def _dataset(file: Any, chance: random.Random) -> str:
    name = chance.choice(list(file))
    old = file[name]
    # it may be a giant by now
    shape, kind = old.shape if math.prod(old.shape or ()) < 10**6 else (3,), old.dtype
    change = chance.choice(
        (
            "delete",
            "shape",
            "type",
            "group",
            "soft",
            "external",
            "virtual",
            "raw",
            "giant",
            "hard",
            "empty",
            "new",
            "chunk",
        )
    )
    if change != "new":
        del file[name]
    numbers = np.zeros(shape, "f8" if kind.kind not in "iuf" else kind)
    if change == "shape":
        other = ((), (0,), (1,), (3, 3), (*shape, 1), shape[:-1], tuple(2 * n for n in shape))
        file[name] = np.zeros(chance.choice(other))
    elif change == "type":
        file[name] = numbers.astype(chance.choice(("f2", ">f8", "i8", "u1", "c16", "?", "S3", "f4")))
    elif change == "group":
        file.create_group(name)
    elif change == "soft":
        file[name] = h5py.SoftLink(chance.choice(("/status", "/nowhere", f"/{name}", "/")))
    elif change == "external":
        other = chance.choice(("other.h5", "/dev/zero", file.filename))
        file[name] = h5py.ExternalLink(other, chance.choice(list(file)))
    elif change == "virtual":
        layout = h5py.VirtualLayout(shape, "f8")
        layout[...] = h5py.VirtualSource("other.h5", "status", shape)
        file.create_virtual_dataset(name, layout)
    elif change == "raw":
        file.create_dataset(name, shape, "f8", external=[("/etc/hostname", 0, h5py.h5f.UNLIMITED)])
    elif change == "giant":
        file.create_dataset(name, (10 ** chance.randrange(7, 13),), "f8", chunks=(1000,), fillvalue=1.0)
    elif change == "chunk":
        file.create_dataset(
            name, shape, "f8", chunks=tuple(10**4 for _ in shape), maxshape=(None,) * len(shape), compression="gzip"
        )
    elif change == "hard":
        file[name] = file[chance.choice(list(file))]
    elif change == "empty":
        file[name] = h5py.Empty("f8")
    elif change == "new":
        name = chance.choice(("a", "start", "peak", "crossing", "trusted", "lyapunov_exponent", "motion", "é"))
        file[name] = np.arange(chance.choice((0, 1, 5)))
    return f"{name} {change}"


def _numbers(file: Any, chance: random.Random) -> str:
    sound = [name for name in file if isinstance(file.get(name), h5py.Dataset) and file[name].nbytes < 10**7]
    name = chance.choice(sound)
    values = np.atleast_1d(file[name][()])
    if values.dtype.kind not in "iuf":
        file[name][...] = chance.choice(("same", "up", "", "\x1b", "x" * 100, *STATE_NAMES))
        return f"{name} other text"
    some = np.random.default_rng(chance.randrange(10**9)).random(values.shape) < chance.choice((0.1, 0.5, 1.1))
    new = chance.choice((0, 1, -1, 5, 77, 127, math.nan, math.inf, -math.inf, 1e308, -1e308, 1e-320, 1e15))
    if values.dtype.kind in "iu":
        limits = np.iinfo(values.dtype)
        new = chance.choice((0, 1, 2, 3, 4, 5, 6, -1, limits.max, limits.min))
    values[some] = new
    file[name][...] = values.reshape(file[name].shape)
    return f"{name} partly {new}"


def _coordinate(file: Any, chance: random.Random) -> str:
    names = ("depth", "wob", "rotary_speed", "procedure", "state", "start", "time", "peak")
    name = chance.choice([name for name in names if name in file])
    if file[name].nbytes > 10**7:
        return f"{name} is giant"
    values = file[name][()]
    kind = chance.choice(("back", "same", "shorter", "longer", "scaled"))
    if kind == "back":
        values = values[::-1]
    elif kind == "same":
        values[:] = values[:1]
    elif kind == "scaled" and values.dtype.kind == "f":
        values = values * chance.choice((1e300, 1e-300, -1.0, 1e3, math.nan))
    elif kind in ("shorter", "longer"):
        values = values[:-1] if kind == "shorter" else np.concatenate([values, values])
        text = h5py.string_dtype() if values.dtype.kind == "O" else None
        del file[name]
        file.create_dataset(name, data=values, dtype=text)
        return f"{name} {kind}"
    file[name][...] = values
    return f"{name} {kind}"


def attempt(folder: Path, bases: Path, seed: int, number: int, note: Callable[[str], None]) -> bool:
    """Broken unless every command takes the file or refuses it in words; True where it
    can be shown."""
    chance = random.Random(f"{seed} {number}")
    path = folder / "out.h5"
    gc.collect()
    base = chance.choice((*STUDIES, *OTHERS, "branches", "curves"))
    if base in OTHERS:
        note(base)
        return _attempt_other(base, folder, bases, chance, note)
    shutil.copyfile(bases / f"{base}.h5", path)
    note(f"{base}: {'; '.join(mutate(path, chance))}")
    out = command("show", path, "--json")
    check_json(out)
    severity = chance.choice(((), ("--severity", "1")))
    if number % 2:  # the forms of an answer that have most in common take turns
        command("show", path)
        check_json(command("window", path, "--json", *severity))
        command("export", path, "-o", folder / "out.nc", "--overwrite")
    else:
        command("window", path, "--units", "field")
        command("export", path, "-o", folder / "out.csv", "--overwrite", "--peaks", "--states")
    if number % 3 == 1 and base not in ("trace", "ramp"):
        check_json(command("window", path, bases / f"{base}.h5", "--json"))
    listed = command("plot", path, "--kind", "list")
    if listed and number % 3 == 0:
        kind = chance.choice(listed.splitlines()).split()[0]
        note(f"--kind {kind}")
        more = chance.choice(((), ("--units", "field"), ("--start", "1"), ("--wob", "20 kN")))
        command("plot", path, "--kind", kind, "-o", folder / "out.png", "--overwrite", *more)
    for ask in (nsdrill.attractors, nsdrill.hysteresis, nsdrill.window):
        with suppress(NsdrillError):
            ask(path)
    with suppress(NsdrillError), nsdrill.open_results(path) as data:
        from_dataset(data)
    if base not in ("trace", "ramp"):
        command("classify", path, *chance.choice(((), ("--set", "classify.whirl.direction=0.2"))))
        check_json(command("show", path, "--json"))
    return out is not None


def _worker(examples: range, seed: int, bases: str, pipe: Any) -> None:
    """Runs examples in order and tells what becomes of each."""
    gc.freeze()  # what the tests before have left behind is not looked at before every file
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
    with tempfile.TemporaryDirectory() as folder:
        for number in examples:
            said: list[str] = []
            pipe.send((number, "begun", ""))
            try:
                with time_limit(SECONDS):
                    found = "shown" if attempt(Path(folder), Path(bases), seed, number, said.append) else "refused"
                pipe.send((number, found, ""))
            except Broken as error:
                pipe.send((number, f"broken: {error}", f"example {number}: {' '.join(said)}"))
            except Exception as error:
                pipe.send((number, f"broken: {type(error).__name__}: {error}", f"example {number}: {' '.join(said)}"))


def run(examples: int, seed: int, first: int = 0, keep_going: bool = False) -> dict[str, int]:
    """How many of the files could be shown and were refused; Broken at the first that
    is neither, or all counted."""
    found: dict[str, int] = collections.Counter()
    context = multiprocessing.get_context("fork")
    with tempfile.TemporaryDirectory() as bases:
        make_bases(Path(bases))
        number, end = first, first + examples
        while number < end:
            here, there = context.Pipe(duplex=False)
            worker = context.Process(target=_worker, args=(range(number, end), seed, bases, there))
            worker.start()
            there.close()
            outcome, words, begun = "", "", time.monotonic()
            try:
                while number < end:
                    if not here.poll(2 * SECONDS):  # a hang where no signal handler runs
                        worker.kill()
                        outcome = "broken: it hangs"
                        break
                    number, outcome, words = here.recv()
                    if outcome == "begun":
                        continue
                    if outcome.startswith("broken"):
                        break
                    found[outcome] += 1
                    number += 1
                    if number % 100 == 0:
                        print(f"{number}: {dict(found)}, {time.monotonic() - begun:.0f} s", file=sys.stderr)
            except EOFError:
                worker.join()
                outcome = f"broken: the process ended by signal {-(worker.exitcode or 0)}"
            if outcome.startswith("broken"):
                worker.kill()
                said = f"{words or f'example {number}'}: {outcome}"
                if not keep_going:
                    raise Broken(said)
                if not found[outcome[:100]]:
                    print(ascii(said), file=sys.stderr)
                found[outcome[:100]] += 1
                number += 1
            worker.join()
    return dict(found)


if __name__ == "__main__":
    given = arguments(__doc__)
    print(run(given.examples, given.seed, given.first, given.keep_going))

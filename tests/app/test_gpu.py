"""Sweeps on a GPU, in whose place this processor runs its code: whole files with the bits
of the processor, however they are begun, interrupted and finished."""

import signal
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from interrupts import Interrupt
from same_bits import different

import nsdrill
from app.alike import alike
from cli.helpers import call_here, finish, start
from nsdrill.app import device
from nsdrill.app.device import place_for
from nsdrill.app.experiment import prepare
from nsdrill.app.run import Interrupted, run_study
from nsdrill.app.stages import work_of
from nsdrill.errors import DeviceError, DeviceMemoryError, InputError, NsdrillError
from nsdrill.kernel.launcher import Host, HostKernel
from nsdrill.store import open_results, part_path, read_attributes
from nsdrill.study import parse_study
from nsdrill.sweep.gpu import Gpu

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
    "implicit where friction is steep": CARRIED.replace("wob: [20 kN, 60 kN]", "bit.friction.smoothing: [100 s/rad, 100000 s/rad]"),
    "friction as an axis": GRID.replace("wob: [20 kN, 60 kN]", "bit.friction.law: [hyperbolic, linear]"),
    "a limit of steps": CARRIED.replace("2 s}", "2 s, max_steps: 400}"),
    "returns and the exponent": GRID.replace("peaks: 4", "peaks: 0, poincare: 20, exponent: true"),
    "other model": "model: torsion\n" + GRID.replace("operation: {depth: 2000 m}\n", ""),
}


@pytest.fixture(autouse=True)
def gpu(monkeypatch):
    monkeypatch.setenv("NSDRILL_GPU", "host")
    monkeypatch.setattr(device, "LEAST_CHAINS", 2)


@pytest.mark.parametrize("text", STUDIES.values(), ids=STUDIES)
def test_a_file_has_the_bits_of_the_processor(tmp_path, text):
    study = parse_study(text, "s.yaml")
    for name in ("cpu", "gpu"):
        run_study(study, tmp_path / f"{name}.h5", workers=2, device=name)
    assert not different(tmp_path / "cpu.h5", tmp_path / "gpu.h5")
    here, there = (read_attributes(tmp_path / f"{name}.h5") for name in ("cpu", "gpu"))
    assert {name for name in here if here[name] != there[name]} <= {"device", "created", "history"}
    assert (here["device"], there["device"]) == ("cpu", "this processor as a GPU")

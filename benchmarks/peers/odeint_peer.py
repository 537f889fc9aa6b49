"""Boost.Odeint in C++: compiled here, run as a process of its own that times itself."""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np

from benchmarks.peers import NO_OBSERVERS, MissingPeer, Result
from benchmarks.workload import STATES, Problem

SOURCE = Path(__file__).with_name("odeint.cpp")


class Odeint:
    """``fast`` compiles with -ffast-math; ``skip`` leaves out contact forces by
    branches where there is no contact."""

    def __init__(self, fast: bool, skip: bool) -> None:
        flags = ["-std=c++17", "-O3", "-march=native", *(["-ffast-math"] if fast else []), f"-DSKIP={int(skip)}"]
        self.name = "Odeint dopri5" + (", fast-math" if fast else "") + (", skips contacts" if skip else "")
        self.lacks = f"{NO_OBSERVERS}; C++ compiled for one model; proportional controller"
        self._binary = _build(flags)

    def run(self, problem: Problem, rtol: float) -> Result:
        with tempfile.TemporaryDirectory() as folder:
            given, taken = Path(folder, "in"), Path(folder, "out")
            rows = np.concatenate(
                [problem.constants, problem.state_scales, problem.first_step[:, None], problem.initial], axis=1
            )
            given.write_bytes(np.array([len(problem), problem.duration, rtol]).tobytes() + rows.tobytes())
            told = subprocess.run([self._binary, given, taken], check=True, capture_output=True, text=True).stdout
            out = np.frombuffer(taken.read_bytes()).reshape(-1, STATES + 2)
        wall, cpu, evaluations, _ = (float(word) for word in told.split())
        # First same as last: one evaluation to begin with, six for each try.
        steps = (int(evaluations) - len(problem)) // 6
        return Result(wall, cpu, int(evaluations), steps, out[:, :STATES].copy())


def _build(flags: list[str]) -> Path:
    """The program for these flags, compiled once for each source, compiler and
    machine."""
    compiler = os.environ.get("CXX") or shutil.which("g++") or shutil.which("c++")
    if compiler is None:
        raise MissingPeer("a C++ compiler")
    version = subprocess.run([compiler, "--version"], capture_output=True).stdout
    key = hashlib.sha256(SOURCE.read_bytes() + version + " ".join(flags).encode()).hexdigest()[:16]
    folder = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "nsdrill-benchmarks"
    folder.mkdir(parents=True, exist_ok=True)
    binary = folder / f"odeint-{key}"
    if not binary.exists():
        done = subprocess.run([compiler, *flags, SOURCE, "-o", binary], capture_output=True, text=True)
        if done.returncode:
            lines = [line for line in done.stderr.splitlines() if "error" in line]
            raise MissingPeer(f"the Boost headers (libboost-dev): {lines[0] if lines else 'compilation failed'}")
    return binary

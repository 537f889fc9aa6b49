"""Where a measurement was made, and how it is written down."""

from __future__ import annotations

import json
import os
import platform
import subprocess
import time
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np

PACKAGES = ("nsdrill", "numba", "llvmlite", "numpy", "scipy", "numbalsoda", "jax", "diffrax", "clode")


def alone(cpu: int | None = None) -> int:
    """Tie this process and its children to one processor, and ask every library for one
    thread. Call it before jax, numpy's BLAS or an OpenCL runtime start their
    threads."""
    for name in (
        "OMP_NUM_THREADS",
        "OPENBLAS_NUM_THREADS",
        "MKL_NUM_THREADS",
        "NUMBA_NUM_THREADS",
        "POCL_MAX_PTHREAD_COUNT",
    ):
        os.environ[name] = "1"
    os.environ.setdefault("XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1")
    os.environ.setdefault("JAX_PLATFORMS", "cpu")
    os.environ.setdefault("POCL_DEVICES", "basic")  # pocl's device without threads
    if not hasattr(os, "sched_setaffinity"):
        return -1
    allowed = sorted(os.sched_getaffinity(0))
    chosen = allowed[-1] if cpu is None else cpu
    os.sched_setaffinity(0, {chosen})
    return chosen


def describe() -> dict[str, Any]:
    """Machine, compilers, versions, date."""
    versions = {"python": platform.python_version()}
    for name in PACKAGES:
        try:
            versions[name] = version(name)
        except PackageNotFoundError:
            continue
    return {
        "date": time.strftime("%Y-%m-%d %H:%M UTC", time.gmtime()),
        "processor": _processor(),
        "cores": os.cpu_count(),
        "load at the start": [round(x, 2) for x in os.getloadavg()] if hasattr(os, "getloadavg") else None,
        "system": f"{platform.system()} {platform.release()}",
        "C++ compiler": _first_line([os.environ.get("CXX", "c++"), "--version"]),
        "versions": versions,
    }


def _processor() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()


def _first_line(command: list[str]) -> str:
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()[0]
    except (OSError, subprocess.CalledProcessError, IndexError):
        return "none"


def spread(values: Sequence[float], form: str = "{:.3g}") -> str:
    """Median, and the least and the largest."""
    if len(values) == 0:
        return "-"
    return f"{form.format(np.median(values))} ({form.format(min(values))} to {form.format(max(values))})"


def table(head: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """A Markdown table; the first column to the left, the others to the right."""
    cells = [[str(c) for c in row] for row in (head, *rows)]
    widths = [max(len(row[i]) for row in cells) for i in range(len(head))]

    def line(row: Sequence[str]) -> str:
        return (
            "| "
            + " | ".join(c.ljust(w) if i == 0 else c.rjust(w) for i, (c, w) in enumerate(zip(row, widths, strict=True)))
            + " |"
        )

    rule = "|" + "|".join("-" * (w + 2) if i == 0 else "-" * (w + 1) + ":" for i, w in enumerate(widths)) + "|"
    return "\n".join([line(cells[0]), rule, *(line(row) for row in cells[1:])])


def where(machine: dict[str, Any]) -> str:
    """The machine in Markdown."""
    lines = [f"- {name}: {value}" for name, value in machine.items() if name != "versions"]
    lines.append("- versions: " + ", ".join(f"{k} {v}" for k, v in machine["versions"].items()))
    return "\n".join(lines)


def write(out: Path | None, markdown: str, data: dict[str, Any]) -> None:
    """Print the Markdown; with ``out`` also write it there, and the numbers next to it
    as JSON."""
    print(markdown)
    if out is not None:
        out.with_suffix(".md").write_text(markdown + "\n")
        out.with_suffix(".json").write_text(json.dumps(data, indent=1, default=_plain) + "\n")
        print(f"\nwritten: {out.with_suffix('.md')}, {out.with_suffix('.json')}")


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, (np.ndarray, np.generic)) else str(value)

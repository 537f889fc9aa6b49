"""What a factory compiles to: its assembly, and how much of it works on all lanes at
once."""

from __future__ import annotations

import os
import platform
import re
import subprocess
import sys
from pathlib import Path

import pytest

_OPERATION = r"\bv(?:fn?m(?:add|sub)\d+|mul|add|sub|div|sqrt)"


def has_wide_registers() -> bool:
    import llvmlite.binding as llvm

    features = llvm.get_host_cpu_features()
    return platform.machine().lower() in ("x86_64", "amd64") and bool(
        features.get("avx2") and features.get("fma")
    )


needs_wide_registers = pytest.mark.skipif(
    not has_wide_registers(), reason="an x86 processor with AVX2 and FMA is needed"
)


def printed(program: str, folder: Path, *arguments: str) -> str:
    """What a Python program prints that compiles into the empty ``folder``: code from a
    cache shows no assembly."""
    return subprocess.run(
        [sys.executable, "-c", program, *arguments],
        env={**os.environ, "NUMBA_CACHE_DIR": str(folder)},
        capture_output=True,
        text=True,
        check=True,
    ).stdout


def packed_and_single(assembly: str) -> tuple[int, int]:
    """The operations on all lanes, and those on one."""
    packed = re.findall(rf"{_OPERATION}pd\b[^\n]*%[yz]mm", assembly)
    return len(packed), len(re.findall(rf"{_OPERATION}sd\b", assembly))

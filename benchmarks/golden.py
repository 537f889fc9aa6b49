"""Digests of every number of some forty short studies, beside those that are kept.

    python -m benchmarks.golden [--src OTHER/src] [--keep FOLDER] [--against FOLDER] [NAME ...]
    python -m benchmarks.golden --write

The studies call for every model and every way to integrate, to observe and to sweep.
They run through the command line, of this checkout or of another one (``--src``); every
variable of their files and every line that they print has a digest, and the digests
are compared with those of ``golden.json``. Exit code 1 where they differ. How many numbers
differ, and by how much, is seen beside the files of another run: ``--keep A``, then
``--against A``. ``--write`` takes the digests as the new ones.

They are the same with any number of workers, jobs and lanes (``NSDRILL_LANES``), and
should be on any processor with the same versions of Python and llvmlite and the
same C library (docs/numerics.md, "The same bits"); numpy may matter in numbers made after a run.
"""

from __future__ import annotations

import argparse
import contextlib
import hashlib
import io
import json
import multiprocessing
import os
import platform
import runpy
import signal
import sys
import tempfile
import time
from importlib.metadata import version
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from benchmarks.golden_studies import DATA, STUDIES
from benchmarks.machine import table

HERE = Path(__file__).parent
KEPT = HERE / "golden.json"
PACKAGES = ("numpy", "llvmlite", "scipy", "h5py")
# Attributes of files that say who made them, when and with what.
PASSED_OVER = {
    "created",
    "history",
    "study_sha256",
    "study_path",
    "nsdrill_version",
    "model_digest",
    "libm_digest",
    "python",
    "python_version",
    "llvmlite",
    "numpy_version",
    "numba_version",
    "compiler",
    "device",
    "h5py_version",
    "processor",
    "platform",
    "hostname",
}
WITH_WORKERS = ("run", "branches", "fit")


def command(words: list[str]) -> tuple[int, str, str]:
    """Exit code and both outputs of ``nsdrill WORDS``, in this process."""
    out, err = (io.TextIOWrapper(io.BytesIO(), "utf-8") for _ in range(2))
    code: Any = 0
    sys.argv = ["nsdrill", *words]
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            runpy.run_module("nsdrill", run_name="__main__")
    except SystemExit as end:
        code = end.code
    for number in (signal.SIGINT, signal.SIGTERM):  # ignored at the end of a command
        signal.signal(number, signal.SIG_DFL)
    out.flush(), err.flush()
    return int(code or 0), *(s.buffer.getvalue().decode() for s in (out, err))


def make(job: tuple[str, str, int]) -> tuple[str, float, str]:
    """Run the study ``name`` in its folder. Processor seconds, and what went wrong."""
    name, folder, workers = job
    study, *commands = STUDIES[name]
    (place := Path(folder, name)).mkdir(parents=True)
    os.chdir(place)
    begun, wrong = time.process_time(), ""
    text = (HERE.parent / "configs" / study).read_text() if study.endswith(".yaml") else study
    Path("study.yaml").write_text(text)
    Path("rig.csv").write_text(DATA)
    for number, line in enumerate(commands):
        words = line if isinstance(line, list) else line.split()
        if words[0] in WITH_WORKERS:
            words = [*words, "--workers", str(workers), "--quiet"]
        code, out, err = command(words)
        if out:
            Path(f"{number}-{words[0]}.txt").write_text(out)
        if code:
            wrong += f"{name}: exit code {code} of nsdrill {' '.join(words)}\n{err}"
    return name, time.process_time() - begun, wrong


def numbers(path: Path) -> dict[str, np.ndarray]:
    """Every variable of a file: of HDF5 the datasets and attributes, else the lines."""
    if path.suffix != ".h5":
        return {"lines": np.array(path.read_text().splitlines())}
    found: dict[str, Any] = {}
    described = []
    with h5py.File(path) as file:

        def visit(name: str, thing: Any) -> None:
            described.append((name, sorted((k, str(v)) for k, v in _attributes(thing))))
            if isinstance(thing, h5py.Dataset):
                text = h5py.check_string_dtype(thing.dtype)
                found[name] = np.array(thing.asstr()[()], str) if text else np.asarray(thing[()])

        file.visititems(visit)
        found |= {f"@{k}": np.asarray(v) for k, v in _attributes(file) if k not in PASSED_OVER}
    found["@ of variables"] = np.array([str(row) for row in sorted(described)])
    return found


def _attributes(thing: Any) -> list[tuple[str, Any]]:
    """The attributes but those of dimension scales, which hold addresses."""
    hidden = ("REFERENCE_LIST", "DIMENSION_LIST", "_Netcdf4Coordinates", "_Netcdf4Dimid")
    return [(k, v) for k, v in thing.attrs.items() if k not in hidden]


def digest(values: np.ndarray) -> str:
    """Of type, shape and bits; all NaN are one."""
    if values.dtype.kind in "fc":
        values = np.where(np.isnan(values), np.nan, values)
    told = hashlib.sha256(f"{values.dtype.str} {values.shape} ".encode())
    told.update(np.ascontiguousarray(values).tobytes())
    return told.hexdigest()[:10]


def variables(folder: Path, name: str) -> dict[str, np.ndarray]:
    """Every variable of the files of a study, by file and name."""
    files = sorted(p for p in (folder / name).iterdir() if p.name not in ("study.yaml", "rig.csv"))
    return {f"{p.stem}: {k}": v for p in files for k, v in numbers(p).items()}


def difference(a: np.ndarray | None, b: np.ndarray | None) -> tuple[str, str]:
    """How many numbers differ, and the greatest difference over the greatest number."""
    if a is None or b is None or a.shape != b.shape:
        return "another shape" if a is not None and b is not None else "only one has it", ""
    if a.dtype.kind not in "iufb" or b.dtype.kind not in "iufb":
        return f"{np.sum(a != b)} of {a.size}", ""
    x, y = a.astype(float), b.astype(float)
    differs = ~((x == y) | (np.isnan(x) & np.isnan(y)))
    with np.errstate(all="ignore"):
        far = np.nanmax(np.abs(x - y)[differs], initial=0.0) / np.nanmax(np.abs(x), initial=0.0)
    return f"{np.sum(differs)} of {a.size}", f"{far:.1e}"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help="studies; default: all")
    parser.add_argument("--src", type=Path, help="folder with the package nsdrill to run")
    parser.add_argument("--keep", type=Path, help="new folder for the files that are made")
    parser.add_argument("--against", type=Path, help="compare number by number with such a folder")
    parser.add_argument("--write", action="store_true", help="keep the digests in golden.json")
    parser.add_argument("--workers", type=int, default=1, help="of nsdrill (1)")
    parser.add_argument("--jobs", type=int, default=2, help="studies side by side (2)")
    arguments = parser.parse_args()
    names = arguments.names or list(STUDIES)
    if unknown := [name for name in names if name not in STUDIES]:
        parser.error(f"found {', '.join(unknown)}; allowed: {', '.join(STUDIES)}")
    if arguments.write and arguments.names:
        parser.error("--write keeps the digests of all studies; leave out the names")
    source = (arguments.src or HERE.parent / "src").resolve()
    os.environ["PYTHONPATH"] = os.pathsep.join([str(source), str(HERE.parent)])
    sys.path.insert(0, str(source))
    failed = False
    with tempfile.TemporaryDirectory() as temporary:
        folder = (arguments.keep or Path(temporary, "made")).resolve()
        folder.mkdir(parents=True)
        jobs = [(name, str(folder), arguments.workers) for name in names]
        taken = {}
        with multiprocessing.get_context("spawn").Pool(arguments.jobs) as pool:
            for name, seconds, wrong in pool.imap_unordered(make, jobs):
                taken[name], failed = seconds, failed or bool(wrong)
                print(f"{name}: {seconds:.1f} s\n{wrong}".strip(), file=sys.stderr, flush=True)
        made = {name: variables(folder, name) for name in names}
        digests = {n: {v: digest(x) for v, x in found.items()} for n, found in made.items()}
        versions = {"python": platform.python_version()} | {p: version(p) for p in PACKAGES}
        kept = json.loads(KEPT.read_text()) if KEPT.exists() else {"versions": {}, "digests": {}}
        other = {name: variables(arguments.against, name) if arguments.against else {} for name in names}
    print(f"{sum(taken.values()):.0f} s of processor time, {sum(map(len, digests.values()))} variables")
    rows = []
    for name, found in digests.items():
        if arguments.against:
            before = {v: digest(x) for v, x in other[name].items()}
        else:
            before = kept["digests"].get(name, {})
        for key in sorted(found.keys() | before.keys()):
            if found.get(key) != before.get(key):
                how = ("", "") if not arguments.against else difference(other[name].get(key), made[name].get(key))
                rows.append((name, key, before.get(key, "-"), found.get(key, "-"), *how))
    if arguments.write:
        text = json.dumps({"versions": versions, "digests": digests}, indent=0, ensure_ascii=False)
        KEPT.write_text(text + "\n")
    if rows:
        print(table(("study", "variable", "before", "now", "differ", "greatest / range"), rows))
        changed = {k: f"{kept['versions'].get(k)} -> {v}" for k, v in versions.items()}
        changed = {k: v for k, v in changed.items() if kept["versions"].get(k) != versions[k]}
        print(f"{len(rows)} variables differ. Versions that differ: {changed or 'none'}")
    else:
        print("All digests are those kept.")
    return int(failed or (bool(rows) and not arguments.write))


if __name__ == "__main__":
    sys.exit(main())

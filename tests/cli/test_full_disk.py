"""A disk that fills up, and a limit on the size of files: whatever is written, the last
good file stays, the message names the file and the reason, and work goes on."""

import os
import resource
import shutil
import subprocess
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path

import pytest

import nsdrill
from nsdrill.app.running.unfinished import Part

from .test_continue import STUDY as BRANCHES
from .test_fit_resume import DATA, OPTIONS
from .test_fit_resume import STUDY as UNKNOWNS

ROOM = 2048  # bytes that may be written
Filled = Callable[..., AbstractContextManager[None]]


REASONS = ["file too large", "no space left on device"]


@pytest.fixture(params=REASONS)
def disk(request, tmp_path):
    """A folder, a context in which no more than some bytes are written there, and the
    reason that the system gives: by a limit on the size of files, and by a small file
    system that is full, which only root can make."""
    folder = tmp_path / "disk"
    folder.mkdir()
    if request.param == "file too large":
        yield folder, limited, request.param
        return
    made = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=16M", "none", folder], capture_output=True, check=False)
    if made.returncode:
        pytest.skip("a file system cannot be mounted here")

    @contextmanager
    def filled(room=ROOM):
        with open(folder / "ballast", "wb") as ballast:
            free = os.statvfs(folder)
            os.posix_fallocate(ballast.fileno(), 0, free.f_bavail * free.f_bsize - 2 * room)
        yield
        (folder / "ballast").unlink()

    try:
        yield folder, filled, request.param
    finally:
        subprocess.run(["umount", "--lazy", folder], check=True)


@contextmanager
def limited(room: int = ROOM) -> Iterator[None]:
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (room, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


OUTPUTS = [
    ("trace.h5", ["simulate", "small.yaml", "--duration", "20s", "-o"]),
    ("trace.csv", ["export", "trace.h5", "-o"]),
    ("table.csv", ["export", "small.h5", "--peaks", "-o"]),
    ("field.csv", ["export", "small.h5", "--peaks", "--units", "field", "-o"]),
    ("copy.nc", ["export", "small.h5", "-o"]),
    ("page.html", ["report", "small.h5", "--motions", "0", "-o"]),
    ("picture.png", ["plot", "small.h5", "-o"]),
    ("picture.svg", ["plot", "small.h5", "-o"]),
    ("picture.pdf", ["plot", "small.h5", "-o"]),
    ("film.gif", ["plot", "trace.h5", "--from", "19.6 s", "--animate", "-o"]),
    ("study.yaml", ["new", "--all", "-o"]),
    ("schema.json", ["schema", "-o"]),
    ("both.h5", ["combine", "small.h5", "other.h5", "-o"]),
]


@pytest.mark.parametrize(
    ("disk", "name", "words"),
    # what the system says reaches every kind of file; where it says something else, one of each library
    [(REASONS[0], *output) for output in OUTPUTS]
    + [(REASONS[1], *output) for output in OUTPUTS if output[0] in ("trace.h5", "table.csv", "copy.nc")],
    indirect=["disk"],
)
def test_the_last_good_file_stays(disk, name, words, call, shared):
    folder, filled, why = disk
    for one in ("small.yaml", "small.h5"):
        shutil.copy(shared / one, one)
    if "trace.h5" in words:
        call("simulate", "small.yaml", "--duration", "20s", "-o", "trace.h5")
    if "combine" in words:
        nsdrill.run("small.yaml", "other.h5", set={"operation.wob": "30 kN"}, progress=False)
    output = folder / name
    call(*words, output, "--overwrite")
    good = output.read_bytes()
    assert len(good) > 2 * ROOM
    with filled():
        assert f"{name}: could not be written: {why}" in call(*words, output, "--overwrite", code=1).err
        assert {*os.listdir(folder)} <= {name, "ballast"}
    assert output.read_bytes() == good
    call(*words, output, "--overwrite")


def test_labels_stay_as_they_were(disk, call, shared):
    folder, filled, why = disk
    results = folder / "out.h5"
    shutil.copy(shared / "small.h5", results)
    good = results.read_bytes()
    with filled():
        answer = call("classify", results, "--set", "classify.whirl.wall_contact_fraction=0.9", code=1)
    assert f"out.h5: could not be written: {why}" in answer.err
    assert results.read_bytes() == good


@pytest.mark.parametrize(("disk", "kind"), [(REASONS[0], "fit"), (REASONS[1], "branches")], indirect=["disk"])
def test_what_is_kept_of_unfinished_work_stays(disk, kind, call, monkeypatch):
    """The disk fills up after the first state is kept, and again after the last; the
    work then goes on to the bits of an undisturbed one."""
    folder, filled, why = disk
    Path("study.yaml").write_text(UNKNOWNS if kind == "fit" else BRANCHES)
    Path("rig.csv").write_text(DATA)
    words = ["fit", "study.yaml", "--data", "rig.csv", *OPTIONS]
    if kind == "branches":
        words = ["branches", "study.yaml", "--set", "continue.points=60"]
    output = folder / "out"
    part = Path(f"{output}.part")
    kept = []
    filling = []
    real, last = Part.write, 0

    def write(self, *more):
        real(self, *more)
        kept.append(self.path.read_bytes())
        is_last = len(kept) == last
        if len(kept) == 1 or is_last:
            filling.append(filled(ROOM if is_last else len(kept[0]) + 10))
            filling[-1].__enter__()

    with monkeypatch.context() as patch:
        patch.setattr(Part, "write", lambda *more: (kept.append(b""), real(*more)))
        call(*words, "-o", "whole")
    last = len(kept)
    assert last > 1
    kept.clear()
    monkeypatch.setattr(Part, "write", write)
    for option, file, told in (
        ("--overwrite", part, "What it held before is kept: "),
        ("--resume", output, f"are kept in {part}"),
    ):
        answer = call(*words, "-o", output, option, code=1)
        filling.pop().__exit__(None, None, None)
        assert f"{file}: could not be written: {why}" in answer.err
        assert told in answer.err
        assert part.read_bytes() == kept[-1]
        assert os.listdir(folder) == [part.name]
        assert "which nsdrill show describes" in call("show", output, code=2).err
        assert f"an unfinished {'fit' if kind == 'fit' else 'continuation'}" in call("show", part).out
    call(*words, "-o", output, "--resume")
    assert os.listdir(folder) == [output.name]
    if kind == "fit":
        assert output.read_text() == Path("whole").read_text()
    else:
        one, two = nsdrill.open_results("whole"), nsdrill.open_results(output)
        assert all(one[name].identical(two[name]) for name in one.variables)

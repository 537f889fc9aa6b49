"""A package that is edited, or whose data are, between a run and what is done with its file:
every command refuses it, and nothing goes on with other numbers."""

import json
import shutil

import pytest

from .installed import HERE, install, python

# What the model takes from beside it: a module that reads data and calls another one.
BESIDE = """
import json
from pathlib import Path

from further import strength

DATA = json.loads((Path(__file__).parent / "data.json").read_text())


def power(greatest):
    return strength() * DATA["share"][0] * greatest**2
"""
FURTHER = "def strength():\n    return 2.0\n"
MODEL = (
    ('peaks="u_peaks"),)', 'peaks="u_peaks"), Derived("power", lambda u_max: beside.power(u_max)))'),
    ("Declaration, Extremes", "Declaration, Derived, Extremes"),
    ('"least voltage"))', '"least voltage"), feature("power", "1", "power"))'),
    ("import numpy as np\n", "import beside\nimport numpy as np\n"),
)
STUDY = "model: bare\nsweep: {parameters.mu: [1, 2, 3]}\nsimulation: {transient: 1 s, observe: 2 s}\n"
FIRST = """
import sys
import nsdrill

def stop(now):
    if now.note != "compiling":
        raise KeyboardInterrupt

nsdrill.run(sys.argv[1], "whole.h5", progress=False, workers=1).close()
try:
    nsdrill.run(sys.argv[1], "part.h5", progress=stop, workers=1)
except KeyboardInterrupt:
    pass
"""
AFTER = """
import json, sys, warnings
import nsdrill

said = {}
for name, ask in {
    "show": lambda: str(nsdrill.show("whole.h5")),
    "part": lambda: str(nsdrill.show("part.h5.part")),
    "replay": lambda: nsdrill.replay("whole.h5", at={"parameters.mu": 2.0}),
    "plot": lambda: nsdrill.plot("whole.h5"),
    "classify": lambda: nsdrill.classify("whole.h5", path="again.h5"),
    "retry": lambda: nsdrill.run(sys.argv[1], "whole.h5", retry_failed=True, progress=False),
    "resume": lambda: nsdrill.run(sys.argv[1], "part.h5", resume=True, progress=False),
}.items():
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        try:
            ask()
            said[name] = " ".join(str(one.message) for one in told)
        except nsdrill.NsdrillError as error:
            said[name] = f"refused: {error}"
print(json.dumps(said))
"""
EDITS = {
    "nothing": None,
    "a data file": ("data.json", "0.5", "0.25"),
    "a module that the model imports": ("beside.py", "greatest**2", "greatest"),
    "a module that this imports": ("further.py", "2.0", "4.0"),
    "the model": ("bare.py", "1.0 - s.u**2", "1.0 - s.u**4"),
}


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A folder with the package, a finished file and an unfinished one."""
    folder = tmp_path_factory.mktemp("edited")
    text = (HERE / "bare.py").read_text()
    for old, new in MODEL:
        assert text.count(old) == 1
        text = text.replace(old, new)
    install(folder, "bare")
    (folder / "bare.py").write_text(text)
    (folder / "beside.py").write_text(BESIDE)
    (folder / "further.py").write_text(FURTHER)
    (folder / "data.json").write_text('{"share": [0.5]}')
    python(folder, FIRST, STUDY)
    return folder


@pytest.mark.parametrize("edit", EDITS)
def test_a_file_is_refused_after_an_edit(edit, made, tmp_path):
    folder = shutil.copytree(made, tmp_path / "copy")
    if (change := EDITS[edit]) is not None:
        name, old, new = change
        text = (folder / name).read_text()
        assert text.count(old) == 1
        (folder / name).write_text(text.replace(old, new))
    said = json.loads(python(folder, AFTER, STUDY)[-1])
    if change is None:
        assert not any("changed since" in words or "digest" in words for words in said.values()), said
        return
    for name in ("show", "part", "replay", "plot", "classify"):
        assert said[name].startswith("refused: ")
        assert "CHANGED SINCE THE RUNS: made with the model bare of another package, whose files or data" in said[name]
    for name in ("retry", "resume"):
        assert said[name].startswith("refused: ")
        assert "model digest" in said[name] or "CHANGED SINCE THE RUNS" in said[name]

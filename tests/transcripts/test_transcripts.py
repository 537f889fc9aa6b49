"""What commands print, whole: each file is a session in a folder of its own with the
studies of ``given``. ``pytest tests/transcripts --write`` writes the files again."""

import os
import shutil
from functools import partial
from pathlib import Path

import pytest
from cli.helpers import call_here

from .played import written

HERE = Path(__file__).parent
TRANSCRIPTS = sorted(HERE.glob("*.txt"))


@pytest.mark.parametrize("path", TRANSCRIPTS, ids=lambda path: path.stem)
def test_commands_print_what_is_in_the_transcript(path, capfd, monkeypatch, tmp_path, request):
    shutil.copytree(HERE / "given", tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")
    for name in [name for name in os.environ if name.startswith("NSDRILL_") and name != "NSDRILL_LANES"]:
        monkeypatch.delenv(name)
    before = path.read_text(encoding="utf-8")
    after = written(before, partial(call_here, capfd, monkeypatch), tmp_path)
    if request.config.getoption("--write", default=False):
        path.write_text(after, encoding="utf-8")
    else:
        assert after == before

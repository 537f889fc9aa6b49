"""Who may write under the asked name."""

import os

import pytest

from nsdrill.errors import FileError, InputError
from nsdrill.models.contents import Contents
from nsdrill.store import RunLog, claim, claim_file, part_path

from .samples import POINTS, header, made


def unfinished(path):
    with RunLog.create(part_path(path), header(), POINTS, Contents(0)) as log:
        log.write([0, 1], made(2, 0))


@pytest.mark.parametrize("options", [{}, {"overwrite": True}, {"resume": True}])
def test_a_free_name_is_new(path, options):
    assert claim(path, **options) == "new"
    assert list(path.parent.iterdir()) == []


def test_a_finished_file_is_kept_unless_told(path):
    path.write_text("precious")
    with pytest.raises(FileError, match=r"the file exists.*overwrite=True") as caught:
        claim(path)
    assert caught.value.exit_code == 2
    assert claim(path, overwrite=True) == "new"
    assert path.read_text() == "precious"  # until the new one replaces it
    assert claim(path, resume=True) == "finished"


def test_an_unfinished_run_is_kept_unless_told(path):
    unfinished(path)
    with pytest.raises(FileError, match=rf"2 of {POINTS} points.*resume=True.*overwrite=True"):
        claim(path)
    assert claim(path, resume=True) == "resume"
    assert part_path(path).exists()
    assert claim(path, overwrite=True) == "new"
    assert not part_path(path).exists()


def test_an_unfinished_run_beside_a_finished_file_is_resumed(path):
    path.write_text("old")
    unfinished(path)
    assert claim(path, resume=True) == "resume"


def test_a_run_in_progress_is_left_alone(path):
    with RunLog.create(part_path(path), header(), POINTS, Contents(0)):
        for options in ({}, {"overwrite": True}):
            with pytest.raises(FileError, match="another process is writing"):
                claim(path, **options)
    assert part_path(path).exists()


def test_a_damaged_log_can_be_overwritten_but_not_the_file_of_another(path):
    unfinished(path)
    part = part_path(path)
    part.write_bytes(part.read_bytes()[:100])
    assert claim(path, overwrite=True) == "new"
    part.write_bytes(b"a download")
    with pytest.raises(FileError, match="no run log of nsdrill"):
        claim(path, overwrite=True)
    assert part.read_bytes() == b"a download"


def test_overwrite_and_resume_exclude_each_other(path):
    with pytest.raises(InputError, match="exclude each other"):
        claim(path, overwrite=True, resume=True)


@pytest.mark.parametrize("check", [claim, claim_file])
@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("", "no name for a file"),
        ("a\0b", "no name for a file"),
        ("folder", "this is a folder"),
        ("folder/", "this is a folder"),
        ("none/out.h5", "there is no folder"),
        ("text/out.h5", "there is no folder"),
        ("n" * 250, "too long"),
        ("n" * 300, "too long"),
        ("pipe", "device or a pipe"),
    ],
)
def test_impossible_names_are_refused_in_words(check, name, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder").mkdir()
    (tmp_path / "text").write_text("")
    os.mkfifo("pipe")
    with pytest.raises(FileError, match=words):
        check(name, overwrite=True)


def test_a_folder_that_may_not_be_written(path, monkeypatch):
    # root may write everywhere, so the system is not asked
    monkeypatch.setattr(os, "access", lambda *args: False)
    with pytest.raises(FileError, match="may not be written"):
        claim(path)


def test_one_step_outputs_follow_the_same_rule(path):
    claim_file(path)
    path.write_text("x")
    with pytest.raises(FileError, match="overwrite=True"):
        claim_file(path)
    claim_file(path, overwrite=True)

"""The cache of compiled functions: whatever is wrong with it, the numbers are right,
and one warning says so."""

import os
import resource
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from machine_code import machine

from nsdrill import cache
from nsdrill.cache import cache_directory
from nsdrill.compiler import functions, native, objects
from nsdrill.compiler.functions import BUFFER, compiled
from nsdrill.errors import CacheWarning

NOBODY = 65534
as_root = pytest.mark.skipif(os.geteuid() != 0, reason="only root can give files away")


def third() -> Any:
    """A small compiled function, made anew."""

    @compiled(BUFFER)
    def divided(b):
        b[0] = b[0] / 3.0

    return divided


def told() -> tuple[bool, list[str]]:
    """Make the function as another process would: whether it came from the cache, and
    the warnings."""
    cache._has_warned = False
    cache._folder.cache_clear()
    cache._allowed.clear()
    functions._addresses.clear()
    b = np.ones(1)
    with warnings.catch_warnings(record=True) as caught, pytest.MonkeyPatch.context() as patch:
        warnings.simplefilter("always")
        made_one, made = functions._made, []
        patch.setattr(functions, "_made", lambda *given: made.append(given) or made_one(*given))
        third()(b)
    assert b[0] == 1.0 / 3.0
    assert all(warning.category is CacheWarning for warning in caught)
    return not made, [str(warning.message) for warning in caught]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty cache, not yet made."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "made" / "cache"))
    monkeypatch.setattr(cache, "_has_warned", False)
    return cache_directory()


@pytest.fixture
def kept(folder):
    """The file of the function in the cache."""
    assert told() == (False, [])
    (path,) = folder.iterdir()
    return path


def test_the_second_process_finds_the_code(kept):
    def written():
        """What writing a file changes; reading it changes the time of access only."""
        found = kept.stat()
        return found.st_ino, found.st_size, found.st_mtime_ns, found.st_ctime_ns

    before = written()
    assert told() == (True, [])
    assert written() == before


def test_folders_and_files_are_their_owners_alone(kept):
    assert kept.stat().st_mode & 0o777 == 0o600
    for folder in list(kept.parents)[:3]:
        assert folder.stat().st_mode & 0o777 == 0o700


def flip(path: Path, position: int) -> None:
    content = bytearray(path.read_bytes())
    content[position] ^= 1
    path.write_bytes(content)


DAMAGES: dict[str, Callable[[Path], object]] = {
    "empty": lambda path: path.write_bytes(b""),
    "cut in the checksum": lambda path: os.truncate(path, 20),
    "cut in the middle": lambda path: os.truncate(path, path.stat().st_size // 2),
    "without its last byte": lambda path: os.truncate(path, path.stat().st_size - 1),
    "a bit of the checksum": lambda path: flip(path, 5),
    "a bit of the code": lambda path: flip(path, path.stat().st_size // 2),
    "the last bit": lambda path: flip(path, -1),
    "zeros": lambda path: path.write_bytes(bytes(path.stat().st_size)),
    "text": lambda path: path.write_text("no machine code"),
    "no object, well sealed": lambda path: seal(path, b"no machine code"),
    "no object with the name of the function": lambda path: seal(path, symbol(path).encode()),
    "an object cut in the middle": lambda path: seal(path, code(path)[: len(code(path)) // 2]),
    "an object without its last byte": lambda path: seal(path, code(path)[:-1]),
    "no tables": lambda path: seal(path, code(path)[:40] + bytes(len(code(path)) - 40)),
    "another function's": lambda path: seal(path, functions._made(compiled(BUFFER)(nothing), "nothing")),
    "a name without code": lambda path: seal(path, native.object_code(f"declare i64 @{symbol(path)}()\n" + CALLED)),
    "another processor's": lambda path: seal(path, functions_of("aarch64-unknown-linux-gnu", symbol(path))),
    "another system's": lambda path: seal(path, functions_of("x86_64-apple-macosx", symbol(path))),
    "code that needs more": lambda path: seal(path, native.object_code(NEEDY.format(symbol(path)))),
    "the seal of another name": lambda path: path.write_bytes(cache._digest("other", code(path)) + code(path)),
    "a dangling link": lambda path: (path.unlink(), path.symlink_to("nowhere")),
    "a link to the code": lambda path: (path.rename(path.parent.parent / "x"), path.symlink_to("../x")),
    "a pipe": lambda path: (path.unlink(), os.mkfifo(path)),
    "writable by all": lambda path: path.chmod(0o666),
}


CALLED = "define i64 @other() {\n ret i64 0\n}\n"
NEEDY = "declare i64 @elsewhere()\ndefine i64 @{}() {{\n %x = call i64 @elsewhere()\n ret i64 %x\n}}\n"


def sealed(path: Path, content: bytes) -> bytes:
    return cache._digest(path.stem, content) + content


def seal(path: Path, content: bytes) -> None:
    """Write ``content`` as if the cache had."""
    path.write_bytes(sealed(path, content))


def code(path: Path) -> bytes:
    return path.read_bytes()[32:]


def symbol(path: Path) -> str:
    return f"lanes_{path.stem.rpartition('-')[2]}"


def functions_of(triple: str, name: str) -> bytes:
    """An object of another platform with a function of this name."""
    return native.object_code(f"define i64 @{name}() {{\n ret i64 0\n}}\n", machine(triple))


def nothing(b) -> None:
    pass


@pytest.mark.parametrize("damage", DAMAGES.values(), ids=list(DAMAGES))
def test_a_damaged_file_is_replaced(kept, damage):
    damage(kept)
    hit, (message,) = told()
    assert not hit
    assert str(kept) in message
    assert "compiled again" in message
    assert told() == (True, [])
    assert os.listdir(kept.parent) == [kept.name]


@as_root
def test_a_file_of_another_user_is_not_used(kept):
    """Also in a folder that was open to all for a while."""
    os.chown(kept, NOBODY, NOBODY)
    kept.parent.chmod(0o777)
    hit, (message,) = told()
    assert not hit
    assert "belongs to another user" in message
    assert told() == (True, [])


@pytest.mark.parametrize("mode", [0o777, 0o775, 0o1777])
def test_a_folder_of_ours_that_others_may_write_is_closed(kept, mode):
    kept.parent.chmod(mode)
    assert told() == (True, [])
    assert kept.parent.stat().st_mode & 0o777 == 0o700


@pytest.mark.parametrize("mode", [0o777, 0o775])
def test_a_folder_that_others_may_write_and_that_stays_so_is_not_used(kept, mode, monkeypatch):
    kept.parent.chmod(mode)
    monkeypatch.setattr(Path, "chmod", lambda *args: None)  # a file system without modes
    hit, (message,) = told()
    assert not hit
    assert f"{kept.parent}: " in message
    assert "other users may write it" in message
    assert "NUMBA_CACHE_DIR" in message


@as_root
def test_a_folder_of_another_user_is_not_used(kept):
    os.chown(kept.parent, NOBODY, NOBODY)
    before = kept.read_bytes()
    hit, (message,) = told()
    assert not hit
    assert f"{kept.parent}: " in message
    assert "belongs to another user" in message
    assert kept.read_bytes() == before


def test_folders_that_cannot_be_made(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("mine")
    (tmp_path / "link").symlink_to("nowhere")
    for place, why in (
        ("file", "no folder"),
        ("link", "no folder"),
        ("file/cache", "no folder"),
        ("n" * 300, "too long"),
        ("/proc/self/cache", "no such file"),
    ):
        monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / place))
        hit, (message,) = told()
        assert not hit
        assert str(tmp_path / place).removesuffix("/cache") in message
        assert why in message.lower()
        assert "NUMBA_CACHE_DIR" in message
    assert (tmp_path / "file").read_text() == "mine"


def test_a_file_where_the_folder_should_be(folder):
    folder.parent.mkdir(parents=True)
    folder.write_text("mine")
    hit, (message,) = told()
    assert not hit
    assert f"{folder}: " in message
    assert folder.read_text() == "mine"


@pytest.mark.skipif(os.geteuid() == 0, reason="nothing is forbidden to root")
@pytest.mark.parametrize("mode", [0o000, 0o500])
def test_a_folder_without_permission(kept, mode):
    kept.unlink()
    kept.parent.chmod(mode)
    hit, (message,) = told()
    kept.parent.chmod(0o700)
    assert not hit
    assert str(kept.parent) in message
    assert "permission denied" in message


@pytest.mark.parametrize("failing", ["mkdir", "open", "replace"])
def test_what_the_system_forbids(failing, folder, monkeypatch):
    """As for a user who may not; root may everything, so the system is not asked."""

    def refuse(*args, **more):
        raise PermissionError(13, "Permission denied", str(args[0]))

    monkeypatch.setattr(os, failing, refuse)
    hit, (message,) = told()
    assert not hit
    assert str(folder.parents[1]) in message
    assert "permission denied" in message


def test_no_home(monkeypatch):
    def homeless():
        raise RuntimeError("Could not determine home directory.")

    for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME", "HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(Path, "home", homeless)
    hit, (message,) = told()
    assert not hit
    assert "could not determine home directory" in message
    assert "NUMBA_CACHE_DIR" in message


def test_a_full_disk(folder):
    """A limit on the length of files takes the place of the full disk."""
    limit = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, limit[1]))
    try:
        hit, (message,) = told()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limit)
    assert not hit
    assert f"{folder}: " in message
    assert "file too large" in message
    assert list(folder.iterdir()) == []
    assert told() == (False, [])
    assert told() == (True, [])


def test_one_warning_in_a_process(kept):
    kept.write_bytes(b"")
    assert len(told()[1]) == 1
    kept.write_bytes(b"")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        functions._addresses.clear()
        assert third().address


def test_other_processes_see_a_whole_file_or_none(folder, monkeypatch):
    moves = []
    replace = os.replace

    def watched(source, target):
        content = Path(source).read_bytes()
        moves.append((Path(source).parent, Path(target).exists(), content == sealed(Path(target), content[32:])))
        replace(source, target)

    monkeypatch.setattr(os, "replace", watched)
    assert told() == (False, [])
    assert moves == [(folder, False, True)]


@pytest.mark.parametrize("triple", ["x86_64-unknown-linux-gnu", "x86_64-apple-macosx", "x86_64-pc-windows-msvc-elf"])
def test_no_bytes_of_an_object_are_trusted(triple):
    """Whatever is changed, an object is right or refused by ValueError."""
    text = (
        "declare double @log(double)\ndefine i64 @here(double %x) {\n %y = call double @log(double %x)\n ret i64 0\n}\n"
    )
    good = native.object_code(text, machine(triple))
    assert objects.check(good, "here", good) == ["log"]
    with pytest.raises(ValueError, match="no function of this name"):
        objects.check(good, "there", good)
    rng = np.random.default_rng(1)
    for trial in range(3000):
        bad = bytearray(good[: rng.integers(len(good))] if trial % 3 == 0 else good)
        for place in rng.integers(0, max(len(bad), 1), 3) if bad and trial % 3 else ():
            bad[place] = rng.integers(256)
        try:
            assert objects.check(bytes(bad), "here", good) is not None
        except ValueError:
            continue


# How large it becomes.


def files(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def filled(folder: Path, ages: dict[str, float], size: int = 1000) -> None:
    """Files of these names, used so many days ago."""
    now = time.time()
    for name, days in ages.items():
        (folder / name).write_bytes(bytes(size))
        os.utime(folder / name, (now, now - days * cache.DAY))


def an_hour_passes(folder: Path) -> None:
    """Since the last look into the folder."""
    looked = folder.with_suffix(".looked")
    last = looked.stat().st_mtime - cache.HOUR
    os.utime(looked, (last, last))


def test_what_was_not_used_for_long_is_removed(kept):
    an_hour_passes(kept.parent)
    filled(kept.parent, {"old.code": 91, "used.code": 89, ".x.code.tmp-0": 2, ".y.code.tmp-0": 0.5, "mine.txt": 500})
    kept.unlink()
    assert told() == (False, [])
    assert files(kept.parent) == {kept.name, "used.code", ".y.code.tmp-0", "mine.txt"}


def test_a_large_folder_loses_what_was_not_used_for_longest(kept, monkeypatch):
    monkeypatch.setattr(cache, "LIMIT", 100_000)
    an_hour_passes(kept.parent)
    filled(kept.parent, {f"{days}.code": days for days in range(1, 81)}, 2000)
    kept.unlink()
    assert told() == (False, [])
    left = files(kept.parent) - {kept.name}
    assert left == {f"{days}.code" for days in range(1, len(left) + 1)}
    total = sum(path.stat().st_size for path in kept.parent.iterdir())
    assert 70_000 < total <= cache.KEPT * cache.LIMIT


def test_a_folder_of_the_right_size_is_looked_through_seldom(kept, monkeypatch):
    looks = []
    look = cache._remove_unused
    monkeypatch.setattr(cache, "_remove_unused", lambda folder: looks.append(folder) or look(folder))
    monkeypatch.setattr(cache, "LIMIT", 80_000)
    cache._allowed.clear()
    an_hour_passes(kept.parent)
    for number in range(65):
        cache.save(f"{number}", bytes(1000))
    assert 7 <= len(looks) <= 8  # at first, and after each eighth of the limit
    assert len(files(kept.parent)) == 66
    for number in range(65, 100):
        cache.save(f"{number}", bytes(1000))
        assert sum(path.stat().st_size for path in kept.parent.iterdir()) <= 1.125 * cache.LIMIT
    assert len(files(kept.parent)) < 80


def test_a_process_does_not_look_where_another_has_just_looked(kept):
    filled(kept.parent, {"old.code": 91})
    kept.unlink()
    assert told() == (False, [])
    assert files(kept.parent) == {kept.name, "old.code"}
    kept.unlink()
    an_hour_passes(kept.parent)
    assert told() == (False, [])
    assert files(kept.parent) == {kept.name}


def test_use_is_remembered_to_a_day(kept):
    now = time.time()
    os.utime(kept, (now, now - 10 * cache.DAY))
    assert told() == (True, [])
    assert abs(kept.stat().st_mtime - now) < 60.0


def test_a_file_that_another_process_removes_is_compiled_again(kept, monkeypatch):
    """Between the look into the folder and the removal, and before it is read."""
    an_hour_passes(kept.parent)
    filled(kept.parent, {"old.code": 100})
    kept.unlink()
    unlink = os.unlink
    monkeypatch.setattr(os, "unlink", lambda path: (unlink(path), unlink(path)))
    assert told() == (False, [])
    assert files(kept.parent) == {kept.name}

"""What several rooms' tests need: small studies, and their results, made once."""

import gc
import os
import signal
import sys
import time
from collections.abc import Callable, Generator
from pathlib import Path
from typing import Any

# The tests have a processor each, and matrices of a few rows: threads of BLAS would
# only wait for each other, with all processors busy. NumPy reads it when it is imported.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import pytest
from hypothesis import HealthCheck
from hypothesis import settings as hypothesis_settings
from quick import QUICK

from nsdrill import progress
from nsdrill.compiler import functions
from nsdrill.interrupt import SIGNALS

# The bits do not depend on the lanes, and to compile everything for three numbers of
# them takes longer than all runs together. Tests of just that, and of the choice, ask
# for others.
os.environ.setdefault("NSDRILL_LANES", "8")

# Two seconds settle nothing; they are enough to follow a point through all rooms.
SMALL = """\
title: Small
operation: {depth: 2000 m, wob: 22.24 kN, rotary_speed: 3 rad/s}
sweep:
  rotary_speed: {from: 1 rad/s, to: 8 rad/s, points: 8}
  procedure: up-down
simulation: {transient: 2 s, observe: 2 s}
record: {peaks: 4}
"""
MAP = """\
title: Small map
operation: {depth: 2000 m}
sweep:
  wob: {from: 20 kN, to: 100 kN, points: 5}
  rotary_speed: [60 rpm, 30 rpm, 45 rpm, 75 rpm]
simulation: {transient: 2 s, observe: 2 s}
record: {peaks: 4}
"""


# No test measures how long an example takes: on a busy machine any may take long.
hypothesis_settings.register_profile("any machine", deadline=None, suppress_health_check=[HealthCheck.too_slow])
hypothesis_settings.load_profile("any machine")


# How many functions this process and, with xdist, its workers have compiled, and the
# processor time of that [s].
COMPILED = {"functions": 0, "seconds": 0.0}


def untraced(function: Callable[..., Any]) -> Callable[..., Any]:
    """``function`` without coverage, which would look at every call within it, none of
    which is ours: half as much time again."""

    def called(*arguments: Any, **options: Any) -> Any:
        trace = sys.gettrace()
        sys.settrace(None)
        try:
            return function(*arguments, **options)
        finally:
            sys.settrace(trace)

    return called


def counted(compile_one: Callable[..., Any]) -> Callable[..., Any]:
    """``compile_one``, counted."""

    def called(*arguments: Any) -> Any:
        start = time.process_time()
        try:
            return compile_one(*arguments)
        finally:
            COMPILED["functions"] += 1
            COMPILED["seconds"] += time.process_time() - start

    return called


@pytest.fixture(scope="session", autouse=True)
def compiling_is_counted():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(functions, "_made", untraced(counted(functions._made)))
        # what a command writes does not depend on what is in the cache
        patch.setattr(progress, "COMPILING_SECONDS", 1e6)
        yield


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """A process of the tests holds millions of objects to its end: assertions, thousands of
    tests, libraries. To search them again and again for garbage took a third of the time
    of the collection and a tenth of that of the tests."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.set_threshold(20_000, 20, 20)
        gc.enable()


TESTS = Path(__file__).parent


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """For ``-m quick`` the files without a quick test, whose imports take longer than
    the quick tests."""
    if config.getoption("markexpr") != "quick" or collection_path.suffix != ".py":
        return None
    return collection_path.relative_to(TESTS).as_posix() not in QUICK or None


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Quick tests are marked. What waits for processes and browsers comes first: the last tests are short, so
    that processes beside each other end together."""
    for item in items:
        functions = QUICK.get(item.path.relative_to(TESTS).as_posix())
        if functions is not None and (not functions or item.name.partition("[")[0] in functions):
            item.add_marker("quick")
    items.sort(key=lambda item: item.path.parent.name not in ("docs", "fuzz", "survival", "web"))


def pytest_sessionfinish(session: pytest.Session) -> None:
    if hasattr(session.config, "workeroutput"):
        session.config.workeroutput["compiled"] = COMPILED


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any) -> None:
    for name, value in getattr(node, "workeroutput", {}).get("compiled", {}).items():
        COMPILED[name] += value


def pytest_terminal_summary(terminalreporter: Any) -> None:
    terminalreporter.write_line(
        "compiled: {functions} functions in {seconds:.1f} s of processor time".format(**COMPILED)
    )


@pytest.fixture(scope="session", autouse=True)
def drawing_is_untraced():
    with pytest.MonkeyPatch.context() as patch:
        if sys.gettrace() is not None:
            from matplotlib.figure import Figure

            for name in ("draw_without_rendering", "savefig"):
                patch.setattr(Figure, name, untraced(getattr(Figure, name)))
        yield


@pytest.fixture(scope="session", autouse=True)
def signals_as_in_a_terminal():
    """Processes that tests start heed all signals, even where the tests themselves run
    under nohup or a supervisor."""
    ignored = [number for number in SIGNALS if signal.getsignal(number) is signal.SIG_IGN]
    for number in ignored:
        signal.signal(number, lambda number, frame: None)
    yield
    for number in ignored:
        signal.signal(number, signal.SIG_IGN)


@pytest.fixture(autouse=True)
def signals_as_before():
    """A command that a test runs in this process changes what signals do, and leaves
    them ignored at its end."""
    before = {number: signal.getsignal(number) for number in SIGNALS}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.fixture(scope="session")
def shared(tmp_path_factory):
    """A folder with studies and their results, to be read only: small, map, uncertain, and
    failing, of which some points fail."""
    from nsdrill import load_study
    from nsdrill.app.running.run import run_study

    folder = tmp_path_factory.mktemp("shared")
    studies = ("small", SMALL, ()), ("map", MAP, ()), ("uncertain", SMALL, DRAWN), ("failing", SMALL, STEP_LIMIT)
    for name, text, changes in studies:
        (folder / f"{name}.yaml").write_text(text)
        run_study(load_study(folder / f"{name}.yaml", changes), folder / f"{name}.h5", workers=1)
    return folder


STEP_LIMIT = ("simulation.max_steps=1000",)
DRAWN = ("uncertain={bit.friction.static: {uniform: [0.3, 0.6]}, samples: 2}",)


@pytest.fixture
def small(tmp_path):
    """The small study in a folder of its own."""
    path = tmp_path / "small.yaml"
    path.write_text(SMALL)
    return path


@pytest.fixture
def rendered():
    """For tests that look at pictures, or where things stand on a page."""


@pytest.fixture
def words_only(request, monkeypatch):
    """To lay out pictures and to write them into a page takes most of the time of both, and
    their words do not depend on it: they are drawn, and no more."""
    if "rendered" not in request.fixturenames:
        monkeypatch.setattr("matplotlib.figure.Figure.draw_without_rendering", lambda figure: None)
        for room in ("answers", "one_page"):
            monkeypatch.setattr(f"nsdrill.web.{room}.svg", lambda figure: "<svg></svg>")


@pytest.fixture(autouse=True)
def pictures_of_this_test():
    """No test leaves a picture of a script behind."""
    pictures = sys.modules.get("nsdrill.figures.registry")
    before = {} if pictures is None else dict(pictures._made)
    yield
    pictures = sys.modules.get("nsdrill.figures.registry")
    if pictures is not None and pictures._made != before:
        pictures._made.clear()
        pictures._made.update(before)
        pictures.all_kinds.cache_clear()

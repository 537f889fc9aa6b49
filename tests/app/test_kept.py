"""What the study of results says of them is found once, and never old."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import nsdrill
from nsdrill.analysis.window import find_window
from nsdrill.app.answering import early_ends, foreseen, kept
from nsdrill.app.answering.answers import results_for_window
from nsdrill.store import read_results


@pytest.fixture
def found(monkeypatch, tmp_path):
    """How often something is found, in a cache of its own."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    calls = []

    def find(results, what="number"):
        return kept.kept(
            what, results, None, lambda: calls.append(what) or [float("inf"), None, {"a": np.float64(0.1)}]
        )

    find.calls = calls
    return find


@pytest.fixture(scope="module")
def results(shared):
    return read_results(shared / "small.h5", ("status",))


def test_it_is_found_once_with_every_bit(results, found):
    """Numbers that are not finite are kept as they are."""
    assert found(results) == found(results) == [float("inf"), None, {"a": 0.1}]
    assert found.calls == ["number"]


def test_variables_do_not_matter(results, found):
    found(results)
    found(replace(results, variables={}))
    assert found.calls == ["number"]


@pytest.mark.parametrize("other", ["study", "values", "question", "sources", "script", "part"])
def test_it_is_not_that_of_another(results, found, other, monkeypatch):
    found(results)
    there, what = results, "number"
    if other == "study":
        there = replace(results, attrs={**results.attrs, "study_resolved": "{}"})
    elif other == "values":
        there = replace(results, coords={**results.coords, "wob": results.coords["wob"] + 1.0})
    elif other == "question":
        what = "another"
    elif other == "sources":
        monkeypatch.setattr(kept, "sources", lambda: "of another version")
    elif other == "script":
        there = replace(results, attrs={**results.attrs, "used_scripts": '{"pumped": ["drive.py", "0"]}'})
    else:
        there = replace(results, part_of=(results, "wob", np.array([0])))
    found(there, what)
    assert len(found.calls) == 2


def test_an_edited_file_is_told_by_its_time_and_length(tmp_path):
    (tmp_path / "room").mkdir()
    file = tmp_path / "room" / "new.py"
    file.write_text("a = 1\n")
    before = sorted(kept._written(str(tmp_path)))
    file.write_text("a = 10\n")
    longer = sorted(kept._written(str(tmp_path)))
    os.utime(file, ns=(0, before[0][2] + 1))
    assert len(before) == 1
    assert before != longer != sorted(kept._written(str(tmp_path)))


def test_all_files_of_nsdrill_count():
    root = Path(nsdrill.__file__).parent
    told = kept.sources()
    assert [file for file in root.rglob("*.py") if "examples" not in file.parts and repr(str(file)) not in told] == []


def test_a_window_is_the_same_without_what_is_kept(shared, monkeypatch, tmp_path):
    """Nor is anything computed of a study the second time."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    first = results_for_window(shared / "map.h5")
    assert [file.name[:7] for file in (tmp_path / "cache" / "compiled").glob("answer-*")]
    monkeypatch.setattr(foreseen, "of_study", None)
    monkeypatch.setattr(early_ends.checking, "checks_of", None)
    second = results_for_window(shared / "map.h5")
    assert second.attrs == first.attrs
    assert find_window(second)["answer"] == find_window(first)["answer"]

"""JSON that every program reads: no NaN and no Infinity, whatever the numbers."""

from __future__ import annotations

import ast
import json
import math
from pathlib import Path

import numpy as np

import nsdrill
from nsdrill.data import json_text


def test_undefined_numbers_are_null() -> None:
    data = {"a": math.nan, "b": [math.inf, (-math.inf, np.float64("nan"))], "c": np.array([1.0, np.nan]), 3: np.int8(2)}
    assert json.loads(json_text(data)) == {"a": None, "b": [None, [None, None]], "c": [1.0, None], "3": 2}


def test_no_json_is_written_that_may_hold_nan() -> None:
    calls = [
        call
        for path in Path(nsdrill.__file__).parent.rglob("*.py")
        for call in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(call, ast.Call) and ast.unparse(call.func) in ("json.dumps", "json.dump", "dumps", "dump")
    ]
    assert calls
    for call in calls:
        assert [ast.unparse(word.value) for word in call.keywords if word.arg == "allow_nan"] == ["False"]

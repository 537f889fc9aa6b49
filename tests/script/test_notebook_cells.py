"""Models in cells of notebooks: found as a kernel compiles them, and refused in words where
other processes are to run them."""

import ast
import linecache
from concurrent.futures import ProcessPoolExecutor

import pytest

import nsdrill
from nsdrill.errors import InputError
from nsdrill.script.elsewhere import knowing

CELL = """import numpy as np
import nsdrill


@nsdrill.model
def in_cell(t, x=0.1, v=0.0, *, damping=0.2, force=0.3):
    closed = nsdrill.touching("stop", x - 1.0)
    return v, force * np.cos(t) - damping * v - x - 10.0 * closed
"""


def executed(text: str, name: str) -> dict:
    """The names after a cell, each statement of which a kernel compiles by itself, with its
    text where a traceback finds it."""
    linecache.cache[name] = len(text), None, text.splitlines(keepends=True), name
    found: dict = {"__name__": "__main__"}
    for statement in ast.parse(text).body:
        exec(compile(ast.Module([statement], []), name, "exec"), found)
    return found


def test_a_cell_that_imports_what_its_model_calls():
    model = executed(CELL, "/tmp/ipykernel_1/1.py")["in_cell"]
    data = nsdrill.run(model.study(force=[0.1, 0.4], transient=5, observe=10), progress=False)
    assert (data.x_max > 0.0).all()
    again = executed(CELL.replace("10.0", "20.0"), "/tmp/ipykernel_1/2.py")["in_cell"]
    assert again.reading.digest != model.reading.digest, "the cell was changed and executed again"


def test_other_processes_refuse_it_in_words():
    study = executed(CELL, "/tmp/ipykernel_1/3.py")["in_cell"].study()
    with (
        ProcessPoolExecutor(1) as executor,
        pytest.raises(InputError, match=r"the model in_cell: found other processes .* of a notebook.*threads of this"),
    ):
        knowing(executor, study)

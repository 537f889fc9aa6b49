"""The quick tests are some of every room."""

import ast
from pathlib import Path

from quick import QUICK

HERE = Path(__file__).parent
OTHER = {"fuzz"}  # which is long by its nature


def test_every_room_has_quick_tests():
    rooms = {path.parent.name for path in HERE.glob("*/test_*.py")}
    assert rooms - OTHER == {Path(file).parent.name for file in QUICK} - {""}


def test_every_quick_test_exists():
    for file, names in QUICK.items():
        tree = ast.parse((HERE / file).read_text(encoding="utf-8"))
        there = {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}
        assert {*names} <= there, file

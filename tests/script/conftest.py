"""The scripts of the examples, each imported once."""

import importlib
import sys
from pathlib import Path

import pytest

SCRIPTS = Path(__file__).parents[2] / "configs" / "scripts"
EXAMPLES = {
    "duffing": "duffing", "brake": "brake", "impact": "ball", "rotor": "rotor", "lorenz": "lorenz",
    "three_inertias": "three_inertias",
}  # fmt: skip


def example(script: str):
    """The model of a script."""
    if str(SCRIPTS) not in sys.path:
        sys.path.append(str(SCRIPTS))
    return getattr(importlib.import_module(script), EXAMPLES[script])


@pytest.fixture
def duffing():
    return example("duffing")

"""The scripts of the examples, each imported once; no test leaves a model behind."""

import importlib
import sys
from pathlib import Path

import pytest

from nsdrill.models import registry

SCRIPTS = Path(__file__).parents[2] / "configs" / "scripts"
EXAMPLES = {
    "duffing": "duffing", "brake": "brake", "impact": "ball", "rotor": "rotor", "lorenz": "lorenz",
    "three_inertias": "three_inertias",
}  # fmt: skip


def example(script: str):
    """The model of a script."""
    if str(SCRIPTS) not in sys.path:
        sys.path.append(str(SCRIPTS))
    found = getattr(importlib.import_module(script), EXAMPLES[script])
    if registry.scripted(EXAMPLES[script]) is None:  # another test has withdrawn it
        found.register()
    return found


@pytest.fixture(autouse=True)
def models_of_this_test():
    before = set(registry.model_names())
    yield
    registry.withdraw(*(set(registry.model_names()) - before))


@pytest.fixture
def duffing():
    return example("duffing")

"""The scripts of the examples, each imported once; no test leaves a model behind."""

import contextlib
import importlib
import io
import shutil
import sys
from pathlib import Path

import pytest

from nsdrill.cli.main import main
from nsdrill.figures import picture_kinds
from nsdrill.models import friction, own_drives, registry

SCRIPTS = Path(__file__).parents[2] / "configs" / "scripts"
EXAMPLES = {
    "duffing": "duffing", "brake": "brake", "impact": "ball", "rotor": "rotor", "lorenz": "lorenz",
    "three_inertias": "three_inertias", "planet": "planet",
}  # fmt: skip

HEAD = "import numpy as np\nimport nsdrill\nfrom nsdrill import number\n\n\n"
STUDY = """\
model: duffing
parameters: {dry: 0.0}
sweep:
  parameters.force: [0.1, 0.3]
simulation: {transient: 20 s, observe: 30 s}
record: {peaks: 4, poincare: 4}
"""


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
    forget(set(registry.model_names()) - before)


def forget(models):
    """Nothing of scripts is known but models that are none of these."""
    registry.withdraw(*models)
    own_drives.withdraw_drives(*(one.name for one in own_drives.own_drives()))
    friction.withdraw_laws(*(set(friction.laws()) - set(friction.LAWS)))
    registry.withdraw_features(*registry.NAMES)


def command(folder, *words, code=0):
    """What a command prints, and its messages. As in a process of its own it knows of no
    script but those that it is given, of which nothing is known afterwards."""
    out, err = io.StringIO(), io.StringIO()
    with (
        no_scripts({Path(str(word).rpartition("=")[2]).stem for word in words if str(word).endswith(".py")}),
        pytest.MonkeyPatch.context() as patch,
        contextlib.chdir(folder),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
    ):
        patch.setattr(sys, "argv", ["nsdrill", *map(str, words)])
        with pytest.raises(SystemExit) as end:
            main()
    assert int(end.value.code or 0) == code, err.getvalue()
    assert "Traceback" not in err.getvalue()
    return out.getvalue(), err.getvalue()


@contextlib.contextmanager
def no_scripts(modules):
    """Nothing is known of the scripts of this test, and then nothing of those that were
    executed meanwhile, as ``modules`` of these names."""

    def scripted():
        return set(registry.model_names()) - set(registry.NAMES)

    imported = {name: sys.modules.pop(name) for name in modules & set(sys.modules)}
    models = [registry.scripted(name) for name in scripted()]
    forget(scripted())
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(picture_kinds, "_made", {})
        picture_kinds.all_kinds.cache_clear()
        yield
    forget(scripted())
    for name in modules:
        sys.modules.pop(name, None)
    sys.modules.update(imported)
    for model in models:
        registry.register(model)


@pytest.fixture
def duffing():
    return example("duffing")


@pytest.fixture
def script(tmp_path, monkeypatch):
    """Import a script with this text, as a module of the name of a file."""
    monkeypatch.syspath_prepend(tmp_path)

    def made(text: str, name: str):
        file = tmp_path / f"{name}.py"
        file.write_text(f"{HEAD}{text}", encoding="utf-8")
        sys.modules.pop(name, None)
        importlib.invalidate_caches()
        return importlib.import_module(name)

    yield made
    for file in tmp_path.glob("*.py"):
        file.unlink()  # another test may have a model of this name


@pytest.fixture
def folder(tmp_path):
    shutil.copy(SCRIPTS / "duffing.py", tmp_path)
    (tmp_path / "study.yaml").write_text(STUDY, encoding="utf-8")
    return tmp_path

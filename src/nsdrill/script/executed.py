"""Scripts that are executed for the models, the laws and all else that they make known:
those that a command is given, never one that a study or a file names."""

from __future__ import annotations

import os
import sys
import traceback
from contextlib import redirect_stdout
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

from nsdrill.equations.effects import is_foreign
from nsdrill.errors import InputError, NsdrillError, option


def execute(path: str | os.PathLike[str]) -> None:
    """Execute the Python script at ``path`` as a module of its name, so that what stands
    under ``if __name__ == "__main__"`` is left out. What it prints goes to the standard
    error. InputError, with the line, where it fails."""
    file = Path(path).resolve()
    where = f"{option('with')} {path}"
    if not file.is_file():
        raise InputError(f"{where}: found no such file; allowed: a Python script with models.")
    if file.suffix != ".py" or not file.stem.isidentifier() or not is_foreign(file.stem):
        raise InputError(
            f"{where}: found the name {file.name}; allowed: a name of letters, digits and underscores with the ending "
            ".py, which is none of Python or of nsdrill."
        )
    known = sys.modules.get(file.stem)
    if known is not None and Path(getattr(known, "__file__", None) or "").resolve() != file:
        raise InputError(
            f"{where}: found a module with the name {file.stem} already; allowed: another name of the file."
        )
    if known is None:
        _load(file, where)


def _load(file: Path, where: str) -> None:
    spec = spec_from_file_location(file.stem, file)
    assert spec is not None
    assert spec.loader is not None  # of a file with this ending
    module = module_from_spec(spec)
    sys.path.insert(0, str(file.parent))  # as Python does for a script
    sys.modules[file.stem] = module
    try:
        with redirect_stdout(sys.stderr):  # what a script prints is no data
            spec.loader.exec_module(module)
    except BaseException as error:
        del sys.modules[file.stem]
        if isinstance(error, (NsdrillError, KeyboardInterrupt)):
            raise
        said = f"{type(error).__name__}: {error}".rstrip(": ").rstrip(".")
        raise InputError(f"{where}{_line(error, file)}: {said}.") from error
    finally:
        sys.path.remove(str(file.parent))


def _line(error: BaseException, file: Path) -> str:
    """The last line of the script that an error comes from."""
    if isinstance(error, SyntaxError) and error.filename == str(file):
        return f", line {error.lineno}"
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(file)]
    return f", line {lines[-1]}" if lines else ""

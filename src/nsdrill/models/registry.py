"""The models by the names that a study gives them, and the variables of all models by
their names. A name of a variable means the same in every model that has it.

A new model is a folder or a file beside these and a line here. A script makes models with
:func:`register`, in its own process alone. A package makes them, and all else that a
script can make, in modules that entry points of the group ``nsdrill`` name
(:func:`import_modules`). Where such a module holds a ``DESCRIPTION`` and a ``MODEL``, the
name of the entry point is that of the model. What a package measures of the model
``torsion`` is in a module of the group ``nsdrill.torsion``, which every study of that model
imports (:func:`import_additions`).
"""

from __future__ import annotations

import copyreg
import importlib
import os
import sys
import traceback
from collections import ChainMap
from collections.abc import Callable, Container, Iterator, Mapping
from contextlib import contextmanager, nullcontext, redirect_stdout, suppress
from contextvars import ContextVar
from dataclasses import fields, is_dataclass
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from nsdrill.data import Attributes, frozen_modes
from nsdrill.errors import InputError, NsdrillError, RunWarning, warn
from nsdrill.models.model_description import Description, Drawn
from nsdrill.origin import Origin, check_new_name
from nsdrill.records import dataclass
from nsdrill.units import QuantityError, plain_units, to_si
from nsdrill.variables import MODEL, Variable

if TYPE_CHECKING:
    from functools import _lru_cache_wrapper
    from importlib.metadata import EntryPoint

    from nsdrill.models.base import Model
    from nsdrill.models.responses import Response

T = TypeVar("T")

# The description and the class of each model, imported at first use.
_LOCATIONS = {
    MODEL: (
        "nsdrill.models.christoforou_yigit.description:DESCRIPTION",
        "nsdrill.models.christoforou_yigit.model:ChristoforouYigit",
    ),
    "segments": ("nsdrill.models.segments.description:DESCRIPTION", "nsdrill.models.segments.model:Segments"),
    "beam": ("nsdrill.models.beam.description:DESCRIPTION", "nsdrill.models.beam.model:ElasticCollar"),
    "regenerative": (
        "nsdrill.models.regenerative.description:DESCRIPTION",
        "nsdrill.models.regenerative.model:Regenerative",
    ),
    "torsion": ("nsdrill.models.torsion:DESCRIPTION", "nsdrill.models.torsion:Torsion"),
}


NAMES = tuple(_LOCATIONS)  # those of nsdrill; models of packages are added where they are imported


# Models of scripts and of packages.


@dataclass(frozen=True)
class Scripted:
    """The model of a script: its description and its model, the ``digest`` of what it
    computes, and its ``origin``; the digests of its ``parts`` by their words."""

    description: Description
    model: Model
    digest: str
    origin: Origin
    parts: Mapping[str, str]


_scripted: dict[str, Scripted] = {}
_forgetting: list[Callable[[], None]] = []  # what empties the caches of what all models have


_GROUP = "nsdrill"
_imported_entries: set[tuple[str, str, str]] = set()  # group, name and value
_second: dict[str, str] = {}  # the module with another model of the name of one that a package has
_importing: EntryPoint | None = None
_told: set[str] = set()  # what is wrong with packages


def import_modules() -> None:
    """Import the modules of the entry points of the group ``nsdrill``, once: as a script does,
    they make models, drives, laws and pictures known, or hold a model. One that
    fails is told of. Called where a name is unknown, or all are
    listed, as kinds of pictures are where one is drawn. Before them those of
    :func:`import_additions` are imported, of all models."""
    for entry in sorted(_entry_points(), key=lambda entry: entry.group == _GROUP):
        _import(entry)


def import_additions(model: str) -> None:
    """Import the modules of the entry points of the group ``nsdrill.<model>``, once: what they
    measure of this model is in every run of it. A group of a model that there is not is told
    of."""
    for entry in _entry_points():
        if entry.group == _group_of(model):
            _import(entry)
        elif entry.group != _GROUP and (named := entry.group.removeprefix(f"{_GROUP}.")) not in model_names():
            import_modules()
            if named not in model_names() and (entry.group, "", "") not in _imported_entries:
                _imported_entries.add((entry.group, "", ""))
                _warn(entry, f"found no model {named}; allowed: {', '.join(model_names())}", "nothing of it is")


def _group_of(model: str) -> str:
    return f"{_GROUP}.{model}"


def is_added_always(model: str, module: str) -> bool:
    """Whether what this module makes now for a model is made in every study of it: it, or the
    one that imports it, is of the group of that model."""
    among = {_module_of(entry) for entry in _entry_points() if entry.group == _group_of(model)}
    return _importing is None or not among.isdisjoint({module, _module_of(_importing)})


@cache
def _entry_points() -> tuple[EntryPoint, ...]:
    """The entry points of ``nsdrill`` and of ``nsdrill.<model>``."""
    if not _may_have_some():
        return ()
    from importlib.metadata import entry_points

    try:
        all_of = entry_points()
        found = [entry for group in all_of.groups for entry in all_of.select(group=group)]
    except Exception:  # one package, of whatever use, has entry points that are no such text
        found = list(_readable_entry_points())
    ours = (entry for entry in found if entry.group.partition(".")[0] == _GROUP)
    return tuple(sorted(ours, key=lambda entry: entry.group))


def _readable_entry_points() -> Iterator[EntryPoint]:
    """Those of the packages whose entry points can be read; of another one is told."""
    from importlib.metadata import distributions

    names = set()
    for package in distributions():
        name, place = "", package.locate_file("")
        try:
            name = str(package.metadata["Name"])
            entries = tuple(package.entry_points)
        except Exception as error:
            warn(
                f"the package {name or 'without a name'} in {place}: its entry points cannot be read, "
                f"{type(error).__name__}: {error}; allowed: UTF-8 text with lines such as 'name = "
                f"package.module' below [{_GROUP}]; nothing of it is known. Mend that package, or remove it.",
                RunWarning,
            )
            continue
        if (plain := name.lower().replace("-", "_")) not in names:  # the first on the path is the one that is imported
            names.add(plain)
            yield from entries


def _may_have_some() -> bool:
    """Whether some installed distribution may have entry points for nsdrill. Importing
    importlib.metadata takes 70 ms, reading these files 2 ms."""
    finders = [finder for finder in sys.meta_path if hasattr(finder, "find_distributions")]
    if len(finders) != 1:  # another one than that of Python
        return True
    for folder in sys.path:
        if os.path.isfile(folder):  # an archive
            return True
        with suppress(OSError):
            for name in os.listdir(folder or os.curdir):
                if name.lower().endswith("-info"):
                    with suppress(OSError):
                        if f"[{_GROUP}".encode() in Path(folder, name, "entry_points.txt").read_bytes():
                            return True
    return False


def _import(entry: EntryPoint) -> None:
    if (key := (entry.group, entry.name, entry.value)) in _imported_entries:
        return
    _imported_entries.add(key)  # also while it is imported
    global _importing
    has_models, before = entry.group == _GROUP, _importing
    _importing = entry
    try:
        with _aside():
            module = import_module(_module_of(entry))
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # also SystemExit
        said = str(error) if isinstance(error, NsdrillError) else f"{_words(error)}{_origin(error)}"
        _warn(entry, said.rstrip("."), "what it would add from there on is not")
        if has_models and _add_model(entry):
            _described[entry.name] = _not_given(entry.name, error)  # where a study names it
        return
    finally:
        _importing = before
    if has_models and (hasattr(module, "MODEL") or hasattr(module, "DESCRIPTION")) and not _add_model(entry):
        _tell_of_second(entry)


@contextmanager
def _aside() -> Iterator[None]:
    """While a module of a package is imported: what it prints is no data, and files stay
    relative to the folder in which nsdrill works, whichever the module changes to."""
    here = ""
    with suppress(OSError):  # the folder may be gone
        here = os.getcwd()
    try:
        with redirect_stdout(sys.stderr):
            yield
    finally:
        if here:
            os.chdir(here)


def _tell_of_second(entry: EntryPoint) -> None:
    """Of a model of a package whose name another one has: that of nsdrill or of a script
    stays, and of two of packages nobody knows which is meant."""
    if (first := _LOCATIONS.get(entry.name, ("",))[0].partition(":")[0]) == _module_of(entry):
        return
    if entry.name in NAMES or not first:
        owner = "nsdrill" if first else "a script"
        _warn(entry, f"found the name {entry.name}, which a model of {owner} has; allowed: another", "it is not")
        return
    _second[entry.name] = _module_of(entry)
    _described.pop(entry.name, None)
    forget_known()


def _warn(entry: EntryPoint, said: str, left: str) -> None:
    if said in _told:  # of a module with several entry points
        return
    _told.add(said)
    warn(
        f"the entry point {entry.name} of the group {entry.group}, {entry.value}: {said}; {left} known. Mend "
        "its package, or remove it.",
        RunWarning,
    )


def package_with(file: str) -> str:
    """The package, or the module at the top, of an entry point for nsdrill of which
    this file is a module that has been imported; "" where it is of none."""
    tops = {_module_of(entry).partition(".")[0] for entry in _entry_points()}
    modules = [(name.partition(".")[0], module) for name, module in sys.modules.items()]
    return next((top for top, one in modules if top in tops and getattr(one, "__file__", None) == file), "")


def take_for_model(name: str) -> None:
    """Take the entry point of this name, where there is one, for that of a model, though its
    module holds none: who asks for the model is told what is wrong with it."""
    for entry in _entry_points():
        if (entry.group, entry.name) == (_GROUP, name):
            _add_model(entry)


def _module_of(entry: EntryPoint) -> str:
    """The module that an entry point names, without the extras."""
    return entry.value.partition("[")[0].strip()


def _add_model(entry: EntryPoint) -> bool:
    """Whether the model of an entry point is known now: it cannot replace one that was."""
    if entry.name in model_names():
        return False
    module = _module_of(entry)
    _LOCATIONS[entry.name] = f"{module}:DESCRIPTION", f"{module}:MODEL"
    forget_known()
    return True


def model_names() -> tuple[str, ...]:
    """The names of all models, those of scripts last."""
    return (*_LOCATIONS, *_scripted)


def of_known_models(function: Callable[..., T]) -> _lru_cache_wrapper[T]:
    """A cache of what all models that are known give, until a script makes another."""
    cached = cache(function)
    _forgetting.append(cached.cache_clear)
    return cached


def forget_known() -> None:
    """Empty the caches of what all models have, and of what studies may say."""
    for forget in _forgetting:
        forget()


def register(made: Scripted) -> None:
    """Make the model of a script known to this process, in place of an earlier one from
    an earlier execution of the same script. InputError where another model has its name."""
    name = made.description.name
    if name in _LOCATIONS:
        raise InputError(
            f"{made.origin}: found a model with the name {name}, which a model of nsdrill or of a package has; "
            "allowed: another name for the function."
        )
    if (before := _scripted.get(name)) is not None:
        check_new_name("a model", name, before.origin, made.origin)
    _scripted[name] = made
    made.model.description = made.description
    _described[name] = made.description
    forget_known()


def extend_models(names: tuple[str, ...], change: Callable[[Description], Description]) -> None:
    """Describe models with a ``change``, a function that is given once."""
    for name in names:
        _changed.setdefault(name, {})[change] = None
        _described.pop(name, None)
    forget_known()


_changed: dict[str, dict[Callable[[Description], Description], None]] = {}
_measured: dict[str, tuple[Any, ...]] = {}  # :class:`nsdrill.models.own_quantities.Measured`


def own_features(model: str) -> tuple[Any, ...]:
    """What scripts measure of a model of nsdrill or of a package."""
    return _measured.get(model, ())


def register_feature(model: str, made: Any) -> None:
    """Make what a script measures of a model known to this process."""
    _measured[model] = (*(one for one in own_features(model) if one.name != made.name), made)


def withdraw_features(*models: str) -> None:
    """Measure nothing of scripts any more of these models."""
    for model in models:
        if _measured.pop(model, ()):
            _described.pop(model, None)
    forget_known()


def withdraw(*models: str) -> None:
    """Make models of scripts unknown again; those that are not known are passed over."""
    for name in models:
        if _scripted.pop(name, None) is not None:
            del _described[name]
    forget_known()


# Names of variables and numbers mean the same in every model of nsdrill that has them; a
# script and a package call their own as they like.
_spoken = ""
_shown: ContextVar[str | None] = ContextVar("shown", default=None)


def speak_of(model: str) -> None:
    """Give names the meaning that they have in this model, until another is spoken of."""
    global _spoken
    _spoken = _foreign(model)


@contextmanager
def showing(attrs: Attributes) -> Iterator[None]:
    """While the block runs, names are those of the model of a file with the root attributes
    ``attrs``, whichever is spoken of."""
    token = _shown.set(_foreign(str(attrs.get("model") or MODEL)))
    try:
        yield
    finally:
        _shown.reset(token)


def _foreign(model: str) -> str:
    return model if model in model_names() and model not in NAMES else ""


def spoken() -> Description | None:
    """The model of a script or of another package whose names are meant, None where it is one
    of nsdrill."""
    shown = _shown.get()
    found = _described.get(_spoken if shown is None else shown)  # none while its own module is imported
    return None if isinstance(found, InputError) else found


def checks_of(model: Description) -> Any:
    """The module with the checks of the ``model``, which it names; None where it names
    none."""
    return import_module(model.checks) if model.checks else None


def scripted(name: str) -> Scripted | None:
    """The model of a script by this name, None where it is another's or unknown."""
    return _scripted.get(name)


def of_all(function: Callable[[Description], T], without: Container[str] = ()) -> Iterator[tuple[str, T]]:
    """The names of the models with the value of ``function`` of each, those of nsdrill
    first, ``without`` some. A model of another package in which it fails is passed over: what is wrong
    with it is said where a study or a file names that model."""
    for name in model_names():
        if name in without:
            continue
        try:
            value = function(described(name))
        except KeyboardInterrupt:
            raise
        except BaseException:  # also SystemExit, which a module may raise
            if name in NAMES:
                raise
            continue
        yield name, value


def _loaded(name: str, which: int, expected: type) -> Any:
    """The description (``which`` 0) or the class (1) of the model of this name, an
    instance of ``expected`` or a class whose instances are. InputError where another
    package fails to give it."""
    module, _, attribute = _LOCATIONS[name][which].partition(":")
    try:
        with _aside() if name not in NAMES else nullcontext():
            place = import_module(module)
        if not hasattr(place, attribute):
            raise AttributeError(f"{module} has no {attribute}")
        found = getattr(place, attribute)
        made: Any = found() if isinstance(found, type) else found
        if not isinstance(made, expected) or getattr(made, "name", "") != name:
            what = ("the description", "the class")[which]
            raise TypeError(f"{attribute} is {found!r:.80}, not {what} of a model with the name {name}")
        return made
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        if name in NAMES:
            raise
        raise _not_given(name, error) from error


def _module_with(name: str) -> str:
    """The module with the description of this model."""
    return _LOCATIONS[name][0].partition(":")[0]


def _not_given(name: str, error: BaseException) -> InputError:
    return InputError(
        f"the model {name}, in {_module_with(name)}: {_words(error)}{_origin(error)}; allowed: an "
        f"entry point that names a module with a DESCRIPTION and a MODEL ({name} = package.module). Mend the package "
        "of this model, or remove it."
    )


def _words(error: BaseException) -> str:
    """The kind of an error and its text, which an error of another package may fail to give."""
    try:
        return f"{type(error).__name__}: {error}"
    except Exception:
        return f"{type(error).__name__}, without a text"


def _origin(error: BaseException) -> str:
    """The line of another package in which an error was found, for a message."""
    own = ("<frozen importlib", __file__, importlib.__file__)
    frames = [frame for frame in traceback.extract_tb(error.__traceback__) if not frame.filename.startswith(own)]
    return f" ({frames[-1].filename}, line {frames[-1].lineno})" if frames else ""


def described(name: str) -> Description:
    """The description of the model of this name. KeyError where there is none,
    InputError where another package fails to give it, or where it names variables that
    the model does not have."""
    if name not in model_names():
        import_modules()
    if name not in _described:
        # A faulty module is imported once. One that asks for the variables of all models
        # while it is imported comes here again, so that this is no cached function.
        try:
            _described[name] = _checked(name)
        except InputError as error:
            _described[name] = error
    found = _described[name]
    if isinstance(found, InputError):
        raise found
    return found


_described: dict[str, Description | InputError] = {}
# another process has the same models by these names
copyreg.pickle(Description, lambda description: (described, (description.name,)))


def _checked(name: str) -> Description:
    """The description of the model of this name, of which nothing is wrong."""
    if name in _second:
        raise InputError(
            f"the model {name}: found two of this name, in {_module_with(name)} and in {_second[name]}; allowed: one. "
            "Rename an entry point, or remove one of the packages."
        )
    description: Description = _loaded(name, 0, Description)
    for change in _changed.get(name, ()):
        description = change(description)
    if unknown := description.unknown():
        raise InputError(
            f"the model {name}: found {'; '.join(unknown)} in its description; allowed: what stands there among its "
            "features, labels, peaks, section and own_trace."
        )
    if name not in NAMES:
        sources_of(name)
        data_of(name)
        _check_meanings(name, description)
        _check_own(name, description)
    return description


def _check_meanings(name: str, description: Description) -> None:
    """InputError where a model of another package gives a name another meaning than a
    model of nsdrill does."""
    for attribute in ("variables", "trace_and_states"):
        built_in = [(model, variable) for model in NAMES for variable in getattr(described(model), attribute)]
        for variable in getattr(description, attribute):
            meanings = [
                (model, other.units, other.long_name) for model, other in built_in if other.name == variable.name
            ]
            if variable.name == "drive_angle" and variable.units == "rad":
                continue  # the phase, of whatever it is
            if meanings and not any(tuple(meaning) == (variable.units, variable.long_name) for _, *meaning in meanings):
                model, units, words = meanings[0]
                raise InputError(
                    f"the model {name}: found the variable {variable.name}, {variable.long_name} [{variable.units}], "
                    f"which is {words} [{units}] in the model {model}; allowed: another name, or that variable as "
                    "nsdrill.models.registry has it."
                )


def _check_own(name: str, description: Description) -> None:
    """InputError where a model of another package has a default outside its range, shows
    a response twice, or one that none of its features tells."""
    made = ""
    try:
        for made in ("parameters", "initial"):
            getattr(description, made)()
    except ValueError as error:
        raise InputError(
            f"the model {name}, {made}: found a default outside its range, {error}; allowed: one within."
        ) from error
    _check_units(name, description)
    _check_operation(name, description)
    features = {variable.name for variable in description.features}
    names = [one if isinstance(one, str) else one.name for one in description.responses]
    for place, (response, one) in enumerate(zip(names, map(description.critical.get, names), strict=True)):
        if one is None or response in names[:place]:
            raise InputError(f"the model {name}, responses: found {response} twice; allowed: each once.")
        # a stall is told from the stick-slip where its own feature is not measured
        if response != "stalled" and one.feature not in features:
            raise InputError(
                f"the model {name}, responses: found {response}, and no feature {one.feature}, which "
                "tells whether it is there; allowed: that feature in the declaration and the description."
            )


# The values of an operating point that mean the same in every model, in which units; and what
# else has a name of its own in a study or a file.
_OPERATED = {"depth": "m", "wob": "N", "rotary_speed": "rad/s"}
_TAKEN = (
    *("title", "units", "model", "sweep", "operation", "initial", "simulation", "classify", "record", "uncertain"),
    *("continue", "procedure", "along", "refine", "sample", "samples", "seed", "design", "correlations", "table"),
    *("start", "peak", "crossing", "state", "time", "status", "axes", "unknowns", "dimensions", "method"),
)


def _check_operation(name: str, description: Description) -> None:
    """InputError where a value of the operating point has a name that is taken, or a name of
    a drill string with another unit."""
    sections, variables = description.sections, {variable.name for variable in description.variables}
    for item in fields(description.operation):
        units = str(item.metadata.get("units") or "")
        if units != _OPERATED.get(item.name, units):
            found = f"{item.name} [{units}]"
            allowed = f"{item.name} in {_OPERATED[item.name]}, or another name"
        elif item.name in (*_TAKEN, *sections, *variables):
            found, allowed = f"the name {item.name}, which is taken", "another name"
        else:
            continue
        raise InputError(f"the model {name}, operating point: found {found}; allowed: {allowed}.")


def other_packages() -> tuple[str, ...]:
    """The models of other packages that this process has imported, for messages: an
    error may be the fault of such a model."""
    return tuple(name for name in _LOCATIONS if name not in NAMES and _module_with(name) in sys.modules)


def _check_units(name: str, description: Description) -> None:
    """InputError where a number or a variable of a model of another package has a unit
    that is not known, or a section is no dataclass with defaults."""
    units: list[tuple[str, str]] = [(one.name, one.units) for one in (*description.variables, *description.trace)]
    for section in fields(description.parameters):
        if not is_dataclass(section.default_factory):
            raise InputError(
                f"the model {name}, parameters: found {section.name} without its dataclass; allowed: "
                f"{section.name}: Section = field(default_factory=Section)."
            )
    todo: list[Any] = [description.parameters(), description.initial()]
    while todo:
        record = todo.pop()
        for item in fields(record):
            if is_dataclass(value := getattr(record, item.name)):
                todo.append(value)
            units.append((item.name, str(item.metadata.get("units") or "")))
    for what, unit in units:
        try:
            if unit not in ("", "1", "percent", "%"):
                to_si(f"1 {plain_units(unit)}", plain_units(unit))
        except QuantityError as error:
            raise InputError(
                f"the model {name}: found the unit {unit!r} of {what}, which is not known; allowed: SI units, such as "
                "'kg m^2' of a number and 'rad s-1' of a variable, and '' or '1' where there is none."
            ) from error


def place_in_other_packages(error: BaseException) -> str:
    """The innermost line of a model of another package that an error comes from, for
    messages."""
    modules = [sys.modules[_module_with(name)] for name in other_packages()]
    folders = tuple(str(Path(str(module.__file__)).parent) for module in modules if getattr(module, "__file__", None))
    frames = [frame for frame in traceback.extract_tb(error.__traceback__) if frame.filename.startswith(folders)]
    return f" ({frames[-1].filename}, line {frames[-1].lineno})" if folders and frames else ""


_imported: dict[str, str] = {}  # the digests of packages of models when they were imported
_held: dict[str, str] = {}  # and of their data


def sources_of(name: str) -> str:
    """Digest of the Python files of the package of this model and of what it imports, when it
    was imported; "" for a model of nsdrill, whose files are in the digest of compiled sources; "unknown" where
    the package is not installed."""
    if name in NAMES:
        return ""
    if name in _scripted:
        return _scripted[name].digest
    if name not in _imported:
        _imported[name] = _sources_now(name)
    return _imported[name]


def data_of(name: str) -> str:
    """Digest of the numbers that the package of this model held when it was imported, as of a
    data file or the environment; "" for other models."""
    if name not in _held:
        from nsdrill.models.packages import data_digest

        is_another = name in _LOCATIONS and name not in NAMES
        _held[name] = data_digest(_top_of(name)) if is_another else ""
    return _held[name]


def package_digest(name: str) -> str:
    """Digest of the files and the data of the package of this model, as they were
    imported."""
    return f"{sources_of(name)}-{data_of(name)}"


def check_unchanged(name: str) -> None:
    """InputError where the files of the package of this model are no longer those that were
    imported: with a part of them imported anew equations and what reads them would not
    belong together."""
    if name not in (*NAMES, *_scripted) and _sources_now(name) != sources_of(name):
        raise InputError(
            f"the model {name}: its files were changed after this process had imported them; allowed: those that were "
            "imported, as old and new parts must not be mixed. Start Python, or the kernel of the notebook, again."
        )


def _sources_now(name: str) -> str:
    from nsdrill.models.packages import files_digest

    return files_digest(_top_of(name)) if name in _LOCATIONS else "unknown"


def _top_of(name: str) -> str:
    """The package or module at the top in which a model is."""
    return _module_with(name).partition(".")[0]


def model_named(name: str) -> Model:
    """The model of this name. KeyError where there is none, InputError where another
    package fails to give it."""
    if name in _scripted:
        return _scripted[name].model
    if name not in _models or _models[name].description is not described(name):
        _models[name] = _model(name)
    return _models[name]


_models: dict[str, Model] = {}


def _model(name: str) -> Model:
    from nsdrill.models.base import Model

    model: Model = _loaded(name, 1, Model)
    model.description, model.measured = described(name), own_features(name)
    if name in NAMES:
        return model
    from nsdrill.models.soundness import sound

    return sound(model, Model, described(name))


def model_in(attrs: Attributes) -> Description:
    """The description of the model of a file with the root attributes ``attrs``: the
    default model where they name none."""
    return described(str(attrs.get("model") or MODEL))


def named_in(attrs: Attributes) -> Mapping[str, Variable]:
    """The variables of a results file with the root attributes ``attrs`` by name: those of its
    model, then those of others."""
    return BY_NAME.beside(model_in(attrs))


def responses_in(attrs: Attributes) -> Mapping[str, Response]:
    """The critical responses, by name, that the model of a file with the root attributes
    ``attrs`` can show."""
    return model_in(attrs).critical


def drawn_in(attrs: Attributes) -> Drawn:
    """What pictures show of a file with the root attributes ``attrs``, without the
    modes that are frozen."""
    return model_in(attrs).drawn.without(frozen_modes(attrs))


class _ByName(Mapping[str, Variable]):
    """Variables by name, each from the first model that has it. The other models are
    imported only for a name that this one lacks."""

    def __init__(self, attribute: str) -> None:
        self._attribute = attribute
        self._by_model: dict[str, dict[str, Variable]] = {}
        self._found: dict[str, Variable] = {}
        _forgetting.append(self._forget)

    def _forget(self) -> None:
        self._by_model.clear()
        self._found.clear()

    def beside(self, model: Description) -> Mapping[str, Variable]:
        """Those of this model, then those of others."""
        return ChainMap(self._of(model), self)  # type: ignore[arg-type]

    def _of(self, model: Description) -> dict[str, Variable]:
        if model.name not in self._by_model:
            self._by_model[model.name] = {variable.name: variable for variable in getattr(model, self._attribute)}
        return self._by_model[model.name]

    def __getitem__(self, name: str) -> Variable:
        own = spoken()
        if own is not None and name in (variables := self._of(own)):
            return variables[name]
        if name not in self._found:
            self._found[name] = self._first(name)
        return self._found[name]

    def _first(self, name: str) -> Variable:
        for _, variables in of_all(self._of):
            if name in variables:
                return variables[name]
        raise KeyError(name)

    def __iter__(self) -> Iterator[str]:
        return iter(dict.fromkeys(name for _, variables in of_all(self._of) for name in variables))

    def __len__(self) -> int:
        return len(list(iter(self)))


BY_NAME = _ByName("variables")
IN_TRACE = _ByName("trace_and_states")


def known(*names: str) -> tuple[Variable, ...]:
    """The variables of a results file by these names, for a model that has some of
    another."""
    return tuple(BY_NAME[name] for name in names)


def known_in_trace(*names: str) -> tuple[Variable, ...]:
    """As :func:`known`, of a trace."""
    return tuple(IN_TRACE[name] for name in names)

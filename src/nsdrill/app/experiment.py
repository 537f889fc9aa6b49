"""An experiment: a study with what follows from it for every run; what the files made from it
say of its origin, and the study that a file holds. Executes no compiler before it is
needed."""

from __future__ import annotations

import hashlib
import json
import math
import os
import platform
from array import array
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from datetime import UTC, datetime
from functools import cached_property, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from nsdrill.data import (
    MEASURED_BY,
    MODEL_PARTS,
    OVERRIDES,
    USED_SCRIPTS,
    Array,
    Attributes,
    Results,
    Trace,
    json_text,
    overrides,
)
from nsdrill.errors import FileError, FileWarning, InputError, NsdrillError, count, printable, warn
from nsdrill.late import deferred
from nsdrill.models.choices import is_compiled_in, words_of
from nsdrill.models.contents import Contents
from nsdrill.models.friction import why_explicit
from nsdrill.models.parts import parts_of, states_of_all, values_at
from nsdrill.models.registry import (
    check_unchanged,
    data_of,
    described,
    model_named,
    own_features,
    package_digest,
    package_with,
    scripted,
    sources_of,
)
from nsdrill.models.responses import Thresholds
from nsdrill.models.starts import Starts
from nsdrill.origin import Origin
from nsdrill.records import dataclass
from nsdrill.study.study import Study, as_kept, study_from_resolved
from nsdrill.sweep.plan import Chosen, Plan
from nsdrill.variables import MODEL, NOTEBOOK, PACKAGE, dimension_of
from nsdrill.version import __version__

if TYPE_CHECKING:
    from nsdrill.models.own_parts import Part

with deferred():  # the compiled sources, and the parser, which most files do not need
    from nsdrill import abi
    from nsdrill.compiler import functions
    from nsdrill.kernel import steppers
    from nsdrill.models import base, variant
    from nsdrill.models import own_features as features
    from nsdrill.models.own_parts import own_part, parts_in, places_of_parts
    from nsdrill.study import load as loading
    from nsdrill.study import write as writing


@dataclass(frozen=True)
class Experiment:
    """A ``study`` and its ``plan``: its points and chains, one point for a study without a
    sweep. What follows from these is computed once, when it is first asked for."""

    study: Study
    plan: Plan

    @cached_property
    def parts(self) -> list[tuple[Any, Starts]]:
        """The parameters and the start of each part with compiled code of its own."""
        study = self.study
        return parts_of(study.model, study.parameters, study.initial, study.axes)

    @cached_property
    def chosen(self) -> Chosen:
        """The choice of the method, implicit or explicit, for each point. InputError where
        the model does not support the method of the study."""
        self.check_method()
        study = self.study
        return Chosen(self.plan, study.parameters, study.initial, study.model, study.simulation.method)

    def check_method(self) -> None:
        """InputError where the study requires the implicit integration of friction and its
        model does not support it."""
        study = self.study
        reasons = (why_explicit(study.model, parameters) for parameters, _ in self.parts)
        reason = next((reason for reason in reasons if reason is not None), None)
        if study.simulation.method == "implicit" and reason is not None:
            source = study.source or "the study"
            raise InputError(f"{source}: simulation.method: found implicit; allowed: auto or explicit, as {reason}.")

    def check_exponent(self) -> None:
        """InputError where the study measures the exponent of a string with a drive or a law of
        a script that makes slopes jump, across which a deviation is not followed. A model of a
        script is refused with its study."""
        study = self.study
        for parameters, initial in self.parts if study.record.exponent else ():
            points = values_at(parameters, initial, vars(study.operation))
            places = places_of_parts(parameters)
            jumping = model_named(study.model.name).jumping(points, places) if places else ()
            if jumping:
                source = study.source or "the study"
                raise InputError(
                    f"{source}: record.exponent: found true with slopes that jump at {jumping[0]}; allowed: false, or "
                    f"{base.SMOOTH}."
                )

    @cached_property
    def methods(self) -> tuple[str, ...]:
        """The methods that the points use: explicit, implicit, or both."""
        return self.chosen.words()

    @cached_property
    def contents(self) -> Contents:
        """The contents of the record of each point."""
        study, model = self.study, self.study.model
        options = [word for parameters, _ in self.parts for word in self._options(parameters)]
        derived = [one.only for one in model.derived if one.only]  # optional in files
        return Contents(
            study.record.peaks,
            study.record.poincare,
            study.record.exponent,
            study.initial.starts,
            study.simulation.verify,
            study.more,
            states_of_all([model.states(parameters) for parameters, _ in self.parts]),
            model.name,
            (*dict.fromkeys(options), *dict.fromkeys(derived)),
            study.samples,
            study.unknowns,
            len(self.methods) > 1,
        )

    def _options(self, parameters: Any) -> tuple[str, ...]:
        """The options that add features to the points of a part with these
        ``parameters``."""
        study, unread = self.study, getattr(parameters, "unread", ())
        varied = {
            key: values
            for key, values in study.varied.items()
            if not is_compiled_in(study.model, key) and key not in unread
        }
        return study.model.options(values_at(parameters, study.initial, varied).parameters)


def prepare(study: Study) -> Experiment:
    """The experiment of a study, which everything that runs or explains it takes. InputError
    where the files of a model of another package were changed since they were imported."""
    check_unchanged(study.model.name)
    return Experiment(study, Plan(study.axes, study.procedure, study.along, study.initial.starts, study.drawn))


# The study of a file as it was run, the experiment that it describes, and the changes by
# ``--set`` in it, which for files that do not record them follow from the text of the
# study.


Data = TypeVar("Data", Results, Trace)


def overrides_of(attrs: Attributes) -> list[str]:
    """The overrides ``key=value`` of a file with the root attributes ``attrs``.

    Where they are not recorded, as in early replays, they are the keys in which the
    study that was run differs from its text; empty where that text is not a study of
    this version.
    """
    if found := overrides(attrs):
        return [f"{key}={value}" for key, value in found.items()]
    if OVERRIDES in attrs and "replay_of" not in attrs:
        return []
    try:
        resolved = json.loads(attrs["study_resolved"])
        return [
            f"{key}={value}"
            for key, _, value in writing.changes(loading.parse_study(attrs["study"]).resolved, resolved)
            if value is not None
        ]  # None: a key that the version of the file lacks
    except (NsdrillError, KeyError, TypeError, ValueError, AttributeError):
        return []


def with_overrides(data: Data) -> Data:
    """``data`` with the overrides set in its root attributes."""
    data.attrs[OVERRIDES] = json_text(overrides_of(data.attrs))
    return data


def unread_keys(attrs: Attributes) -> frozenset[str]:
    """The keys of the study of a file with these root attributes that its string does not
    read, as the lobes of a bit that cuts its own surface; none of a choice that is an
    axis."""
    study = study_from_resolved(json.loads(attrs["study_resolved"]))
    return (
        frozenset()
        if any(map(words_of, (*study.axes, *study.drawn)))
        else getattr(study.parameters, "unread", frozenset())
    )


def leaves_a_surface(attrs: Attributes) -> bool:
    """Whether the bit of the study of a file with these root attributes cuts the surface that
    its blades leave."""
    study = study_from_resolved(json.loads(attrs["study_resolved"]))
    return any(name.startswith("surface_") for name in study.model.states(study.parameters))


def own_keys(attrs: Attributes) -> dict[str, str]:
    """The values, as in a study file, of the keys of the study of a file with the root
    attributes ``attrs`` that differ from the defaults of its model, but for its title
    and units and the axes of its sweep."""
    study = study_from_resolved(json.loads(attrs["study_resolved"]))
    default = loading.default_study(study.model.name).resolved
    return {
        key: value
        for key, _, value in writing.changes(default, study.resolved)
        if value is not None and key.partition(".")[0] not in ("title", "units", "sweep")
    }


def study_of(path: str | os.PathLike[str], attrs: Attributes) -> str:
    """The study of the file ``path`` with the root attributes ``attrs`` as a study
    file: every key, with the overrides applied. FileError where the file has no
    study that this version can use."""
    if "study_resolved" not in attrs:
        raise FileError(f"{path}: found no study in the file; allowed: an output of nsdrill run, simulate or replay.")

    study = study_from_resolved(json.loads(attrs["study_resolved"]), source=str(path))
    head = [f"The study as nsdrill {attrs.get('nsdrill_version', '')} ran it on {attrs.get('created', '')}: every key."]
    if found := overrides_of(attrs):
        head.append(f"Changed by --set: {'; '.join(found)}")
    return writing.study_text(study.resolved, head)


def with_samples(study: Study, results: Results) -> Study:
    """The ``study`` with the samples that its ``results`` hold, if they do: another version of
    SciPy may draw other ones."""
    samples = {unknown.short: values for unknown, values in results.drawn.items()}
    if set(samples) != set(study.drawn):
        return study
    return replace(study, drawn={key: samples[key] for key in study.drawn})


def stored_experiment(path: str | os.PathLike[str], results: Results) -> Experiment:
    """The experiment of the study in the ``results`` of the file ``path``, or of
    :data:`nsdrill.data.IN_MEMORY`, with their samples. FileError where there is no study,
    or where its points are not theirs."""
    attrs, coords = results.attrs, results.coords
    if "study_resolved" not in attrs:
        raise FileError(f"{path}: found no study in the file; allowed: a results file of nsdrill run.")
    resolved, text = json.loads(attrs["study_resolved"]), attrs.get("study", "")
    study = study_from_resolved(resolved, text, str(path), overrides_of(attrs))
    experiment = prepare(with_samples(study, results))
    if other := _coordinate_differences(experiment.plan, coords):
        raise FileError(
            f"{path}: found {'; '.join(other)}; allowed: all points of the run, as its study numbers these, and labels "
            "and replays are made from the study. Take the whole results and select afterwards; of a file that was "
            "edited, make it again."
        )
    return experiment


def check_coordinates(path: str | os.PathLike[str], results: Results) -> None:
    """FileError where the ``results`` of the file ``path``, or of
    :data:`nsdrill.data.IN_MEMORY`, are at other values than their study has, whole or a
    part of them. Of a file without a study of this version nothing is known."""
    text = results.attrs.get("study_resolved")
    if not isinstance(text, str):
        return
    for name, values in _values_in(text).items():
        found = results.coords.get(name, np.empty(0))
        places = [values.index(value) if value in values else -1 for value in found.tolist()]
        if min(places, default=0) >= 0 and places == sorted(places):
            continue
        what = f"other values of {name} than in its study"
        if name == "procedure":
            what = f"procedure {' and '.join(map(str, found))}, of {' and '.join(map(str, values))} in its study"
        raise FileError(
            f"{path}: found {what}; allowed: all points of the run, or a part of them in the order of its study. Take "
            "the results as they were and select from them; of a file that was edited, make it again."
        )


@lru_cache(maxsize=8)
def _values_in(resolved: str) -> dict[str, list[Any]]:
    """The procedures and the values of the axes, by dimension, of a resolved study as JSON;
    none where it is not one of this version."""
    try:
        study = study_from_resolved(json.loads(resolved))
    except (NsdrillError, TypeError, ValueError, RecursionError):
        return {}
    plan = Plan(study.axes, study.procedure, study.along, study.initial.starts, study.drawn)
    swept = {name: values.tolist() for name, values in plan.dimensions.items()}
    # an operating value that is uncertain is that of the sample
    free = {dimension_of(key) for key in study.drawn}
    return {"procedure": list(plan.procedures)} | {name: one for name, one in swept.items() if name not in free}


def _coordinate_differences(plan: Plan, coords: Mapping[str, Array]) -> list[str]:
    """The differences, in words, between ``coords`` and the ``plan`` of their study."""
    differences = []
    if tuple(coords["procedure"]) != plan.procedures:
        differences.append(
            f"procedure {' and '.join(coords['procedure'])}, of {' and '.join(plan.procedures)} in its study"
        )
    if (starts := len(coords.get("start", ()))) != plan.starts:
        differences.append(
            f"{count(starts, 'start') if starts else 'no starts'}, of {plan.starts or 'none'} in its study"
        )
    if (samples := len(coords.get("sample", ()))) != plan.samples:
        differences.append(
            f"{count(samples, 'sample') if samples else 'no samples'}, of {plan.samples or 'none'} in its study"
        )
    for name, values in plan.dimensions.items():
        in_file = coords.get(name, np.empty(0))
        if len(in_file) != len(values):
            differences.append(f"{count(len(in_file), 'value')} of {name}, of {len(values)} in its study")
        elif not np.array_equal(values, in_file):
            differences.append(f"other values of {name} than in its study")
    return differences


# Root attributes that can change the bits of a result, with their names in messages.
_DECISIVE = {
    "nsdrill_version": "nsdrill",
    "python": "Python",
    "llvmlite": "llvmlite",
    "libm_digest": "C library (digest of its mathematics)",
    "model_digest": "model digest",
    USED_SCRIPTS: "drives and laws of scripts",
}


def provenance(study: Study, command: str) -> Attributes:
    """Root attributes for a file made from ``study`` by ``command`` (``run``,
    ``simulate``, ...)."""
    from importlib.metadata import version

    now = datetime.now(UTC).isoformat(timespec="seconds")
    return {
        "title": study.title,
        "model": study.model.name,
        "study": study.text,
        "study_source": printable(study.source),
        "study_overrides": json_text(study.overrides),
        "study_resolved": json_text(as_kept(study.resolved, study.model)),
        "study_sha256": study.sha256,
        "created": now,
        "history": f"{now} nsdrill {__version__} {command}",
        **versions(study.model.name),
        **scripts_of(parts_in(study.resolved)),
        **measured_of(study.model.name),
        "h5py_version": version("h5py"),
        "numba_version": version("numba"),  # which is installed: it computed where the compiler is numba
        "compiler": functions.route(),
        "python_version": platform.python_version(),
        "processor": processor(),
        **_model_attributes(study),
    }


def _model_attributes(study: Study) -> Attributes:
    attributes = study.model.attributes
    return {} if attributes is None else attributes(study.parameters, study.initial, study.varied)


def versions(model: str = MODEL) -> dict[str, str]:
    """The versions and digests of this process for a model, as root attributes."""
    from importlib.metadata import version

    return {
        "nsdrill_version": __version__,
        "python": platform.python_version(),
        "numpy_version": version("numpy"),
        "llvmlite": version("llvmlite"),
        "libm_digest": _libm_digest(),
        "model_digest": model_digest(model),
        **_script_of(model),
        **_package_of(model),
    }


def _package_of(model: str) -> dict[str, str]:
    """The digest of the files and the data of the package of a model, as a root attribute."""
    if scripted(model) is not None or not sources_of(model):
        return {}
    return {"model_package": package_digest(model)}


def _script_of(model: str) -> dict[str, str]:
    """The name of the script of a model and the digest of its graph, as root attributes."""
    found = scripted(model)
    if found is None:
        return {}
    parts = {MODEL_PARTS: json_text(dict(found.parts))}
    return {"model_script": maker_of(found.origin), "model_graph": found.digest, **parts}


def maker_of(origin: Origin) -> str:
    """The name of the file of a script, without its folder; of what an installed package makes
    that of the package."""
    if package := package_with(origin.file):
        return f"{PACKAGE}{package}"
    return Path(origin.file).name if os.path.isfile(origin.file) else NOTEBOOK


def scripts_of(parts: Mapping[str, Part | None]) -> dict[str, str]:
    """Of drives and laws of scripts each the name of its script and the digest of what it
    computes, as a root attribute; none without any."""
    found = {name: ["", ""] if one is None else [maker_of(one.origin), one.digest] for name, one in parts.items()}
    return {USED_SCRIPTS: json_text(found)} if found else {}


def measured_of(model: str) -> dict[str, str]:
    """The same of the quantities that scripts measure of a model of nsdrill or of a package."""
    found = {one.name: [maker_of(one.origin), one.digest] for one in own_features(model)}
    return {MEASURED_BY: json_text(found)} if found else {}


def model_digest(model: str = MODEL) -> str:
    """Digest of everything that may change the bits of a result: the compiled sources
    and the code that compiles them, the sources of a model of another package and its
    equations as they were read, the constants of the methods, the version of Python, and
    the mathematics library."""
    constants = [(pair, pair.positions, pair.position_error) for pair in steppers.STEPPERS.values()]
    parts: tuple[object, ...] = (
        abi.source_digest(),
        constants,
        _decisive("python", platform.python_version()),
        _libm_digest(),
    )
    if own := sources_of(model):
        parts = (*parts, own, data_of(model), _as_read(model))
    if own_features(model):
        parts = (*parts, features.digest_of(model))
    return hashlib.sha256(repr(parts).encode()).hexdigest()[:16]


def _as_read(model: str) -> str:
    """Digest of the equations and the lane parameters of a model of another package with
    its defaults. They have the numbers that its files take from elsewhere: other
    modules, data files, the environment."""
    with suppress(Exception):  # a faulty model is refused by name where it is to run
        description, computing = described(model), model_named(model)
        parameters = description.parameters()
        source = variant.variant_at(computing, parameters).right_hand_side(1).source
        operation = description.operation()
        point = values_at(parameters, description.initial(), vars(operation))
        table = computing.columns(point, Thresholds()).items()
        text = repr((source and source.text, sorted((name, np.asarray(value).tolist()) for name, value in table)))
        return hashlib.sha256(text.encode()).hexdigest()
    return ""


def unlike(there: Attributes, *more: str) -> list[str]:
    """The differences, in words, between this process and the one that made a file with
    the root attributes ``there``, in all that may change the bits of a result; ``more``
    names further attributes to compare. Missing attributes are not compared, except for
    the model digest, which covers them."""
    found = {"python": there.get("python_version"), "model_digest": "unknown", **there}
    here = {**versions(str(there.get("model") or MODEL)), "processor": processor()}
    used = {name: own_part(name) for name in json.loads(there.get(USED_SCRIPTS) or "{}")}
    here[USED_SCRIPTS] = scripts_of(used).get(USED_SCRIPTS, "")
    names = {**{name: name.removesuffix("_version") for name in more}, **_DECISIVE}
    pairs = {name: (_decisive(name, found.get(name)), _decisive(name, here[name])) for name in names}
    return [f"{names[name]} {old} there, {new} here" for name, (old, new) in pairs.items() if old not in ("None", new)]


def made_otherwise(there: Attributes) -> str:
    """In words how unfinished work with the root attributes ``there`` was made otherwise than this
    process would make it, and with what to finish it; empty where it was not."""
    if not (differing := unlike(there)):
        return ""
    told = "; ".join(differing)
    of_scripts = (_DECISIVE["model_digest"], _DECISIVE[USED_SCRIPTS])
    is_scripted = scripted(str(there.get("model") or MODEL)) is not None or there.get(USED_SCRIPTS) is not None
    if is_scripted and all(one.startswith(of_scripts) for one in differing):
        return (
            f"CHANGED SINCE THE RUNS: the script of its model, drive or law, or what that uses, is another one now "
            f"({told}). Finish it with that as it was"
        )
    return f"made with other versions, whose numbers may differ ({told}). Finish it with those"


def has_other_code(there: Attributes) -> bool:
    """Whether the model that made a file with these root attributes had other code than that
    of this process."""
    return (
        "model_digest" in there and there["model_digest"] != versions(str(there.get("model") or MODEL))["model_digest"]
    )


def of_other_code(attrs: Attributes) -> str:
    """By which other code data with these root attributes were made, in a few words; empty
    where it is that of this process, and where they do not say that a model made them."""
    if not has_other_code(attrs):
        return ""
    here = versions(str(attrs.get("model") or MODEL))["model_digest"]
    return f"model digest {printable(str(attrs['model_digest']))[:16]} there, {here} here"


def told_of_other_code(where: str | os.PathLike[str], attrs: Attributes, means: str) -> str:
    """The end of the line of history of what is made from data of other code, empty of data
    of the same; a FileWarning says so too, and what it ``means``."""
    if not (other := of_other_code(attrs)):
        return ""
    warn(f"{where}: RUN BY OTHER CODE ({other}): {means}.", FileWarning)
    return f" (of runs by other code: {other})"


def _decisive(name: str, value: object) -> str:
    """The part of an attribute that can change the bits, as text: of the version of
    Python the first two numbers."""
    return ".".join(str(value).split(".")[:2]) if name == "python" else str(value)


@lru_cache(maxsize=1)
def _libm_digest() -> str:
    """Digest of values of the functions of the C library that results depend on. Their
    last bits are not defined by standards, and depend on the library and on whether the
    processor has fused multiply-adds."""
    places = [0.001 * i for i in range(1, 5001)]
    values = array(
        "d",
        [
            value
            for x in places
            for value in (math.sin(x), math.cos(x), math.atan2(x, 1.7), math.log(x), x**2, x**3, x**4)
        ],
    )
    return hashlib.sha256(values.tobytes()).hexdigest()[:16]


def processor() -> str:
    """The name of the processor, or of its architecture where the system does not give
    one."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8", errors="replace") as file:
            for line in file:
                if line.startswith("model name"):
                    return line.split(":", 1)[1].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()


def coarse_points(study: Study, points: int) -> int:
    """How many of the ``points`` of a sweep lie on the coarse grid."""
    for axis in study.refined:
        points = points // len(study.axes[axis]) * coarse_length(study, axis)
    return points


def coarse_length(study: Study, axis: str) -> int:
    """The number of values of an axis on the coarse grid, before refinement."""
    values = len(study.axes[axis])
    return (values - 1) // 2**study.refine + 1 if axis in study.refined else values

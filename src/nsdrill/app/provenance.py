"""The provenance of a file: the root attributes from which it can be made again, and
those that decide its bits."""

from __future__ import annotations

import hashlib
import math
import platform
from array import array
from datetime import UTC, datetime
from functools import lru_cache
from importlib.metadata import version

from nsdrill import __version__
from nsdrill.abi import source_digest
from nsdrill.data import Attributes, json_text
from nsdrill.errors import printable
from nsdrill.kernel.steppers import STEPPERS
from nsdrill.models.registry import sources_of
from nsdrill.study.study import Study
from nsdrill.variables import MODEL

# Root attributes that can change the bits of a result, with their names in messages.
_DECISIVE = {
    "nsdrill_version": "nsdrill",
    "python": "Python",
    "llvmlite": "llvmlite",
    "libm_digest": "C library (digest of its mathematics)",
    "model_digest": "model digest",
}


def provenance(study: Study, command: str) -> Attributes:
    """Root attributes for a file made from ``study`` by ``command`` (``run``,
    ``simulate``, ...)."""
    now = datetime.now(UTC).isoformat(timespec="seconds")
    return {
        "title": study.title,
        "model": study.model.name,
        "study": study.text,
        "study_source": printable(study.source),
        "study_overrides": json_text(study.overrides),
        "study_resolved": json_text(study.resolved),
        "study_sha256": study.sha256,
        "created": now,
        "history": f"{now} nsdrill {__version__} {command}",
        **versions(study.model.name),
        "h5py_version": version("h5py"),
        "python_version": platform.python_version(),
        "processor": processor(),
        **_model_attributes(study),
    }


def _model_attributes(study: Study) -> Attributes:
    attributes = study.model.attributes
    return {} if attributes is None else attributes(study.parameters, study.initial, study.varied)


def versions(model: str = MODEL) -> dict[str, str]:
    """The versions and digests of this process for a model, as root attributes."""
    return {
        "nsdrill_version": __version__,
        "python": platform.python_version(),
        "numpy_version": version("numpy"),
        "llvmlite": version("llvmlite"),
        "libm_digest": _libm_digest(),
        "model_digest": model_digest(model),
    }


def model_digest(model: str = MODEL) -> str:
    """Digest of everything that may change the bits of a result: the compiled sources
    and the code that compiles them, the sources of a model of another package, the
    constants of the methods, the version of Python, and the mathematics library."""
    constants = [(pair, pair.positions, pair.position_error) for pair in STEPPERS.values()]
    parts: tuple[object, ...] = (
        source_digest(),
        constants,
        _decisive("python", platform.python_version()),
        _libm_digest(),
    )
    if own := sources_of(model):
        parts = (*parts, own)
    return hashlib.sha256(repr(parts).encode()).hexdigest()[:16]


def unlike(there: Attributes, *more: str) -> list[str]:
    """The differences, in words, between this process and the one that made a file with
    the root attributes ``there``, in all that may change the bits of a result; ``more``
    names further attributes to compare. Missing attributes are not compared, except for
    the model digest, which covers them."""
    found = {"python": there.get("python_version"), "model_digest": "unknown", **there}
    here = {**versions(str(there.get("model") or MODEL)), "processor": processor()}
    names = {**{name: name.removesuffix("_version") for name in more}, **_DECISIVE}
    pairs = {name: (_decisive(name, found.get(name)), _decisive(name, here[name])) for name in names}
    return [f"{names[name]} {old} there, {new} here" for name, (old, new) in pairs.items() if old not in ("None", new)]


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

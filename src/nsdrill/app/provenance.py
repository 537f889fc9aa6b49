"""Where a file comes from: the root attributes that let anyone run it again."""

from __future__ import annotations

import platform
from datetime import UTC, datetime
from importlib.metadata import version
from typing import Any

from nsdrill import __version__
from nsdrill.abi import source_digest
from nsdrill.data import json_text
from nsdrill.errors import printable
from nsdrill.model.coefficients import derive
from nsdrill.study.study import Study


def provenance(study: Study, command: str) -> dict[str, Any]:
    """Root attributes for a file made from ``study`` by ``command`` (``run``, ``simulate``, ...)."""
    operation = study.operation
    now = datetime.now(UTC).isoformat(timespec="seconds")
    return {
        "title": study.title,
        "study": study.text,
        "study_source": printable(study.source),
        "study_overrides": json_text(study.overrides),
        "study_resolved": json_text(study.resolved),
        "study_sha256": study.sha256,
        "nsdrill_version": __version__,
        "model_digest": source_digest(),
        "created": now,
        "history": f"{now} nsdrill {__version__} {command}",
        **{f"{name}_version": version(name) for name in ("numpy", "numba", "h5py")},
        "python_version": platform.python_version(),
        "processor": processor(),
        "gap": derive(study.parameters, float(study.axes["depth"][0]), operation.wob, operation.rotary_speed).gap,
    }


def processor() -> str:
    """The processor's name, as far as the system tells."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8", errors="replace") as file:
            for line in file:
                if line.startswith("model name"):
                    return line.split(":", 1)[1].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()

"""The study of a file as it was run, and the changes by ``--set`` in it, which for
files that do not record them follow from the text of the study."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from typing import Any, TypeVar

from nsdrill.data import OVERRIDES, Results, Trace, json_text, overrides
from nsdrill.errors import FileError, NsdrillError
from nsdrill.study.study import study_from_resolved

Data = TypeVar("Data", Results, Trace)


def overrides_of(attrs: Mapping[str, Any]) -> list[str]:
    """The overrides ``key=value`` of a file with the root attributes ``attrs``.

    Where they are not recorded, as in early replays, they are the keys in which the
    study that was run differs from its text; empty where that text is not a study of
    this version.
    """
    if found := overrides(attrs):
        return [f"{key}={value}" for key, value in found.items()]
    if OVERRIDES in attrs and "replay_of" not in attrs:
        return []
    # late: the parser is slow to import, and most files do not need it
    from nsdrill.study import parse_study
    from nsdrill.study.write import changes

    try:
        resolved = json.loads(attrs["study_resolved"])
        return [
            f"{key}={value}"
            for key, _, value in changes(parse_study(attrs["study"]).resolved, resolved)
            if value is not None
        ]  # None: a key that the version of the file lacks
    except (NsdrillError, KeyError, TypeError, ValueError, AttributeError):
        return []


def with_overrides(data: Data) -> Data:
    """``data`` with the overrides set in its root attributes."""
    data.attrs[OVERRIDES] = json_text(overrides_of(data.attrs))
    return data


def study_of(path: str | os.PathLike[str], attrs: Mapping[str, Any]) -> str:
    """The study of the file ``path`` with the root attributes ``attrs`` as a study
    file: every key, with the overrides applied. FileError where the file has no
    study that this version can use."""
    if "study_resolved" not in attrs:
        raise FileError(f"{path}: found no study in the file; allowed: an output of nsdrill run, simulate or replay.")
    from nsdrill.study.write import study_text

    study = study_from_resolved(json.loads(attrs["study_resolved"]), source=str(path))
    head = [f"The study as nsdrill {attrs.get('nsdrill_version', '')} ran it on {attrs.get('created', '')}: every key."]
    if found := overrides_of(attrs):
        head.append(f"Changed by --set: {'; '.join(found)}")
    return study_text(study.resolved, head)

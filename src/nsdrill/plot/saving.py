"""A figure to a file: the same bytes every time, all of it or nothing."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nsdrill.errors import InputError, NsdrillError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# A date in the file would make two equal figures differ.
FORMATS: dict[str, dict[str, Any]] = {
    ".png": {},
    ".pdf": {"CreationDate": None, "ModDate": None},
    ".svg": {"Date": None},
}


def check_suffix(path: str | os.PathLike[str]) -> str:
    """The format of ``path`` by its name; so that a wrong name is told before anything is drawn."""
    suffix = Path(path).suffix.lower()
    if suffix not in FORMATS:
        raise InputError(f"{os.fspath(path)}: found {suffix or 'no suffix'!r} as the kind of picture; "
                         f"allowed: {', '.join(FORMATS)}.")
    return suffix


def save(figure: Figure, path: str | os.PathLike[str]) -> None:
    """Write the figure as PNG (300 dpi), PDF or SVG, by the suffix of ``path``.

    It is written beside ``path`` and then moved there, so that a reader never sees half a picture.
    """
    from nsdrill.plot.style import RASTER_DPI, house_style

    suffix, target = check_suffix(path), Path(path)
    if not target.parent.is_dir():
        raise InputError(f"{target}: found no folder {str(target.parent)!r}; allowed: a folder that exists.")
    unfinished = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        with house_style():
            figure.savefig(unfinished, format=suffix[1:], dpi=RASTER_DPI, metadata=FORMATS[suffix])
        os.replace(unfinished, target)
    except (PermissionError, IsADirectoryError, FileNotFoundError) as error:
        raise InputError(f"{target}: found that it cannot be written ({error.strerror}); "
                         "allowed: a file that you may write.") from error
    except OSError as error:
        raise NsdrillError(f"{target}: the picture could not be written: {error}.") from error
    finally:
        unfinished.unlink(missing_ok=True)

"""nsdrill combine."""

from __future__ import annotations

from nsdrill.cli.building import Given, command_of, say
from nsdrill.late import deferred
from nsdrill.operations import files
from nsdrill.operations.arguments import HDF5Path

with deferred():
    from nsdrill import variables
    from nsdrill.text import words


@command_of(
    files.combine, examples=("combine soft.h5 medium.h5 hard.h5 -o rock.h5", "combine 1000m.h5 2000m.h5 -o depths.h5")
)
def command(given: Given, path: HDF5Path) -> int:
    """Join RESULTS whose studies differ in one number into one file, in which it is an
    axis.

    The file is the one that a sweep of that axis would have made, to the bit; nothing
    is run again. The files may also have other values of an axis that they all sweep.
    """
    combined, key = files.combine(**given)
    values = len(combined.coords[variables.dimension_of(key)])
    say(
        f"{path}: {words.count(len(given['results']), 'file')} along the {words.label_of(key)} ({key}), "
        f"{words.count(values, 'value')}; {words.count(combined.variables['status'].size, 'point')}."
    )
    return 0

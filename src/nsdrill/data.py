"""What a sweep and a simulation give back, in memory: plain arrays with names, in SI units.

The file rooms fill and read these, the plots draw them; neither knows the other.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

Array = np.ndarray[Any, np.dtype[Any]]


@dataclass
class Results:
    """The results of a sweep.

    ``coords`` holds the 1-D coordinates (``procedure``, ``depth`` [m], ``wob`` [N], ``rotary_speed`` [rad/s], ``peak``,
    ``state``); ``variables`` one array per entry of :data:`nsdrill.variables.VARIABLES`, shaped by its ``dims``;
    ``attrs`` the root attributes of the file.
    """

    coords: dict[str, Array]
    variables: dict[str, Array]
    attrs: dict[str, Any] = field(default_factory=dict)

    def __getitem__(self, name: str) -> Array:
        return self.variables[name] if name in self.variables else self.coords[name]

    @property
    def shape(self) -> tuple[int, int, int, int]:
        """(procedures, depths, WOBs, speeds)."""
        p, d, w, s = (len(self.coords[name]) for name in ("procedure", "depth", "wob", "rotary_speed"))
        return p, d, w, s

    @property
    def swept(self) -> list[str]:
        """The axes with more than one value, in file order."""
        return [name for name in ("depth", "wob", "rotary_speed") if len(self.coords[name]) > 1]


@dataclass
class Trace:
    """One trajectory sampled in time: ``time`` [s] and one array [samples] per entry of
    :data:`nsdrill.variables.TRACE_VARIABLES`; ``attrs`` holds the operating point and what is needed to draw the hole.
    """

    time: Array
    variables: dict[str, Array]
    attrs: dict[str, Any] = field(default_factory=dict)

    def __getitem__(self, name: str) -> Array:
        return self.time if name == "time" else self.variables[name]

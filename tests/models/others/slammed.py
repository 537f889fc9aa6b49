"""The oscillator of ``forced`` with two critical responses of its own: it is fast, which is
graded, and it leans to one side."""

from dataclasses import replace

from forced import DESCRIPTION as FORCED
from forced import Forced

from nsdrill.models.responses import Response


class Slammed(Forced):
    name = "slammed"


MODEL = Slammed
DESCRIPTION = replace(
    FORCED,
    name="slammed",
    responses=(
        Response("fast", feature="pace_max", threshold=0.6, limits={"mild": 0.6, "hard": 1.0}, words="fast swing"),
        Response("leaning", feature="place_mean", threshold=0.2, colour="#AA3377"),
    ),
)

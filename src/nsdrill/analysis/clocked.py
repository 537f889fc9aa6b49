"""Of a model that reads the time as a value: for which times its runs tell."""

from __future__ import annotations

from nsdrill.data import Answer, Attributes, resolved_study
from nsdrill.models.registry import model_in

CLOCKED = "TIME IS A VALUE"


def clocked(attrs: Attributes) -> Answer:
    """The ``seconds`` for which the runs of these results tell, and whether they are ``carried``
    along a chain; empty of a model that does not read the time, or as a forcing that repeats."""
    if not model_in(attrs).clocked:
        return {}
    resolved = resolved_study(attrs)
    simulation, sweep = resolved.get("simulation", {}), resolved.get("sweep", {})
    seconds = float(simulation.get("transient", 0.0)) + float(simulation.get("observe", 0.0))
    return {"seconds": seconds, "carried": sweep.get("procedure", "same") != "same"}


def clocked_short(found: Answer) -> str:
    """What :func:`clocked` has found, in a few words."""
    return f"runs tell of 0 to {found['seconds']:.6g} s alone"


def clocked_words(found: Answer) -> str:
    """The same, in words."""
    again = ", and each point begins at 0 s again, with the state of the one before but not its time"
    return (
        f"the equations, or what is measured, read it, and do not repeat: {clocked_short(found)}"
        f"{again if found['carried'] else ''}. What a motion does later, or while a setting is changed slowly, they do "
        "not show. Make simulation.transient as long as a setting is kept"
    )

"""What the string does that its model leaves out, where the answer goes there."""

from __future__ import annotations

from collections.abc import Iterator

from nsdrill.analysis.unmodelled import NEAR
from nsdrill.data import LEFT_OUT, Answer
from nsdrill.quantity import in_system, sign
from nsdrill.words.values import Formatter


def left_out_texts(summary: Answer, fmt: Formatter, units: str) -> Iterator[str]:
    """The warnings of weights and speeds that the answer allows."""
    told, allowed = summary[LEFT_OUT], _greatest(summary)
    heaviest, fastest = allowed.get("wob"), allowed.get("rotary_speed")
    weight, second, held = told.get("collar_weight"), told.get("second_mode"), told.get("held_from")
    if weight is not None and heaviest is not None and heaviest > weight:
        yield f"HEAVIER THAN THE COLLARS: {_of_pipe(weight, told.get('pipe_buckles') or weight, heaviest, fmt)}"
    if second is not None and summary["ranges"].get("rotary_speed", (0.0, fastest or 0.0))[1] > NEAR * second:
        yield (
            f"A SECOND BENDING MODE IS LEFT OUT: the span swings in two half waves at "
            f"{fmt.value('rotary_speed', second)}. Near that speed the collar may reach the wall though no run does: "
            f"nothing above {fmt.value('rotary_speed', NEAR * second)} is allowed. The model beam has that mode with "
            "beam.modes: 2."
        )
    if held is not None and heaviest is not None and heaviest >= held["wob"]:
        needed, available = (_torque(held[name], units) for name in ("needed", "available"))
        yield (
            f"A BIT THAT STOPS MAY STAY STOPPED from {fmt.value('wob', held['wob'])} on: to break it away takes "
            f"{needed}, and the drive has {available} at most. Take weight off before it stops, or pick up."
        )


def _of_pipe(weight: float, buckles: float, heaviest: float, fmt: Formatter) -> str:
    """To which weight [N] an answer holds that goes to the ``heaviest``, above the ``weight`` of the collars, of a pipe
    that ``buckles``."""
    collars = fmt.value("wob", weight) if weight > 0.0 else "nothing, in this mud"
    goes = f"the answer goes to {fmt.value('wob', heaviest)}, and the collars weigh {collars}."
    most = fmt.value("wob", buckles)
    if heaviest <= buckles:
        return (
            f"{goes} It holds: the pipe above them is in compression, but in this inclined hole it does not buckle "
            f"below {most}; its drag and wear are left out."
        )
    holds = f"It holds to {most}" if most != collars and buckles > 0.0 else "It holds to that"
    return (
        f"{goes} {holds}: above, the pipe over them may buckle, which the model leaves out; usual are at most 80 to "
        "90 % of their weight."
    )


def _torque(value: float, units: str) -> str:
    number, unit = in_system(value, "N m", units)
    return f"{1e-3 * value:.3g} kN m" if units == "si" else f"{number:.3g} {sign(unit)}"


def _greatest(summary: Answer) -> dict[str, float]:
    """The greatest weight and speed that the answer allows, or has all the time; empty where it
    names no setting."""
    answer = summary["answer"]
    if not answer.point:
        return {}
    found = {**{key: value for key, value in summary["fixed"].items() if isinstance(value, int | float)}}
    found |= {**answer.held, **answer.point}
    return found | {axis: max(one.high, found.get(axis, one.high)) for axis, one in answer.stay_within.items()}

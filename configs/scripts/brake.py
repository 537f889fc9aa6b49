"""A block on a moving belt, held by a spring: friction falls with the slip, so that the
block squeals, and heats the belt, a state of first order."""

import nsdrill


@nsdrill.model
def brake(
    x=0.0, v=0.1, heat=0.0, *, belt=0.2, load=10.0, static=0.4, dynamic=0.25, decay=10.0, steep=500.0, damping=0.1
):
    """A block on a belt, with friction that falls and heats"""
    slip = v - belt
    rub = nsdrill.friction(
        "belt", slip=slip, normal=load, law="exponential", static=static, dynamic=dynamic, decay=decay, smoothing=steep
    )
    return v, -100.0 * x - damping * v - rub, rub * slip - 0.5 * heat

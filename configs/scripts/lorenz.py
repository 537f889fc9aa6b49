"""The equations of Lorenz (1963)."""

import nsdrill


@nsdrill.model
def lorenz(x=1.0, y=1.0, z=20.0, *, sigma=10.0, rho=28.0, beta=8 / 3):
    """Lorenz's model of convection"""
    return sigma * (y - x), x * (rho - z) - y, x * y - beta * z

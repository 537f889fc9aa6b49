"""Which side what emanates at a Hopf bifurcation or a doubling is on: normal forms in
closed form, and branches that say it by where they go."""

import numpy as np
import pytest

from nsdrill.analysis.bifurcations import DOUBLING, HOPF, SUBCRITICAL, SUPERCRITICAL, UNKNOWN
from nsdrill.orbit.normal_form import doubling_coefficient, lyapunov_coefficient


def close(form, wanted):
    """Whether a coefficient is the wanted one, and its error no more than it says."""
    assert form.error < 1e-5 * max(abs(wanted), 1.0)
    return form.coefficient == pytest.approx(wanted, abs=max(10.0 * form.error, 1e-9))


@pytest.mark.parametrize(("b", "criticality"), [(1.0, SUPERCRITICAL), (-1.0, SUBCRITICAL)])
def test_rayleigh(b, criticality):
    """x'' + x = -b x'^3: with x = R cos t, dR/dt = -3/8 b R^3 (averaging); R is 2**0.5
    times the amplitude along the eigenvector of length 1."""
    form = lyapunov_coefficient(lambda y: np.column_stack([y[:, 1], -y[:, 0] - b * y[:, 1] ** 3]), 2)
    assert close(form, -0.75 * b)
    assert form.criticality(HOPF) == criticality


def test_a_hopf_point_with_quadratic_terms():
    """Guckenheimer & Holmes 1983, equation 3.4.11, of x' = -w y + f, y' = w x + g."""
    w, (fxx, fxy, fyy, gxx, gxy, gyy, fxxx, gyyy) = 1.7, (0.3, -0.8, 1.1, 0.6, 0.9, -0.4, 0.5, -1.3)

    def rates(z):
        x, y = z.T
        f = fxx * x * x / 2 + fxy * x * y + fyy * y * y / 2 + fxxx * x**3 / 6
        g = gxx * x * x / 2 + gxy * x * y + gyy * y * y / 2 + gyyy * y**3 / 6
        return np.column_stack([-w * y + f, w * x + g])

    a = (fxxx + gyyy) / 16 + (fxy * (fxx + fyy) - gxy * (gxx + gyy) - fxx * gxx + fyy * gyy) / (16 * w)
    assert close(lyapunov_coefficient(rates, 2), 2.0 * a / w)


def test_lorenz_jumps():
    """The Hopf bifurcation of Lorenz 1963 at r = 470/19 is subcritical (Marsden & McCracken
    1976)."""
    r = 470.0 / 19.0
    c = (8.0 / 3.0 * (r - 1.0)) ** 0.5

    def rates(d):
        x, y, z = (d + np.array([c, c, r - 1.0])).T
        return np.column_stack([10.0 * (y - x), x * (r - z) - y, x * y - 8.0 / 3.0 * z])

    assert lyapunov_coefficient(rates, 3).criticality(HOPF) == SUBCRITICAL


def test_a_bend_is_not_known():
    """Of x'' + x = -|x'| x' the cubic coefficient does not exist."""
    form = lyapunov_coefficient(lambda y: np.column_stack([y[:, 1], -y[:, 0] - np.abs(y[:, 1]) * y[:, 1]]), 2)
    assert form.criticality(HOPF) == UNKNOWN


def test_doublings_of_maps():
    """c = f''' / 6 + (f'' / 2)^2 of one number; the logistic map at 3 has f'' = -6."""
    logistic = doubling_coefficient(lambda x: -x - 3.0 * x * x, np.array([[-1.0]]))
    assert close(logistic, 9.0)
    assert logistic.criticality(DOUBLING) == SUPERCRITICAL
    cubic = doubling_coefficient(lambda x: -x - x**3, np.array([[-1.0]]))
    assert close(cubic, -1.0)
    assert cubic.criticality(DOUBLING) == SUBCRITICAL


def test_a_corner_is_not_known():
    """Where multipliers jump past the unit circle, at a contact, none is critical."""
    cubic = doubling_coefficient(lambda x: -1.4 * x - x**3, np.array([[-1.4]]))
    assert cubic.criticality(DOUBLING) == UNKNOWN

    def rates(y):
        return np.column_stack([y[:, 1], -y[:, 0] + 0.2 * y[:, 1] - y[:, 1] ** 3])

    assert lyapunov_coefficient(rates, 2).criticality(HOPF) == UNKNOWN

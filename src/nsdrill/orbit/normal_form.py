"""Whether what emanates at a Hopf bifurcation or a period doubling is stable beside it:
the cubic coefficient of the normal form, after Kuznetsov, Elements of Applied
Bifurcation Theory, sections 5.4 and 8.7.

The second and third derivatives of the equations, or of the map over one period, are
differences of fourth order along directions in natural scales. A difference is too
coarse where its step is long, and too noisy where it is short: of a ladder of steps that
one counts whose neighbours agree best. How far they differ is the error.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from nsdrill.analysis.bifurcations import DOUBLING, EQUILIBRIUM, HOPF, NONE, SUBCRITICAL, SUPERCRITICAL, UNKNOWN
from nsdrill.data import Array
from nsdrill.orbit.branch import TOLERANCE_RATIO, Branch, problem_of
from nsdrill.orbit.flow import Flow
from nsdrill.orbit.periodic import Cycle, Periodic, corotating_rates
from nsdrill.orbit.shooting import Orbit
from nsdrill.records import dataclass

Map = Callable[[Array], Array]  # displacements [k, n] to values [k, n]

STEPS = 0.1 * 0.5 ** np.arange(9)  # of the differences, in natural scales
LINEAR_STEP = 1e-3
OFF_CRITICAL = 1e-3  # of a multiplier from -1, or of an eigenvalue from the imaginary axis: at a corner none is there
CERTAIN = 4.0  # errors that a coefficient is away from 0 where its sign is known
# The error of a point's place alone makes a coefficient that is 0 there so large, in natural scales; terms that small
# decide nothing at amplitudes within reach. So it is where a system conserves energy at the point.
NEGLIGIBLE = 1e-8
RETURNS = 5  # Newton's steps to the plane of the start of a cycle
# of a function at -3 to 3 steps: its second and third derivatives, to fourth order
SECOND = np.array([0.0, -1.0, 16.0, -30.0, 16.0, -1.0, 0.0]) / 12.0
THIRD = np.array([1.0, -8.0, 13.0, 0.0, -13.0, 8.0, -1.0]) / 8.0
OFFSETS = np.arange(-3, 4)


@dataclass(frozen=True)
class NormalForm:
    """The cubic ``coefficient`` of a normal form with its ``error``, both without unit
    and in natural scales; NaN where they are not known. Of a Hopf bifurcation it is the
    first Lyapunov coefficient, of a doubling that of the map -x + c x³."""

    coefficient: float = np.nan
    error: float = np.nan

    def criticality(self, label: int) -> int:
        """Which side the emanating motion is on, as of :mod:`nsdrill.analysis.bifurcations`,
        at a point with this ``label``."""
        if label not in (HOPF, DOUBLING):
            return NONE
        if not abs(self.coefficient) > max(CERTAIN * self.error, NEGLIGIBLE):
            return UNKNOWN
        return SUPERCRITICAL if (self.coefficient > 0.0) == (label == DOUBLING) else SUBCRITICAL


def normal_forms(flow: Flow, branches: list[Branch], poll: Callable[[], None] = lambda: None) -> list[NormalForm]:
    """The normal forms of all points of all branches, in order; NaN of those that are
    neither Hopf bifurcations of equilibria nor doublings. ``poll`` is called once a
    point, and may raise to stop."""
    fine = Flow(flow.equations, rtol=TOLERANCE_RATIO * flow.rtol, workers=flow.workers)
    forms = []
    for branch in branches:
        for entry in branch.marked:
            poll()
            is_hopf = entry.label == HOPF and branch.motion == EQUILIBRIUM
            of = hopf_form if is_hopf else doubling_form if entry.label == DOUBLING else None
            forms.append(NormalForm() if of is None else of(fine, branch, entry.point.found))
    return forms


def hopf_form(flow: Flow, branch: Branch, orbit: Orbit) -> NormalForm:
    """The first Lyapunov coefficient of an equilibrium."""
    free = list(orbit.free)
    scales = flow.state_scales(orbit.values)[0][free]

    def rates(displacements: Array) -> Array:
        states = np.tile(orbit.state, (len(displacements), 1))
        states[:, free] += displacements * scales
        return corotating_rates(flow, states, orbit.values)[:, free] / scales

    return lyapunov_coefficient(rates, len(free))


def doubling_form(flow: Flow, branch: Branch, orbit: Orbit) -> NormalForm:
    """The coefficient of the doubling of a motion over one period, of a cycle in the
    plane of its phase condition."""
    problem = problem_of(flow, branch, orbit)
    free, scales = problem.free, problem.state_scales
    n = len(free)
    assert orbit.monodromy is not None
    basis, monodromy = np.eye(n), orbit.monodromy
    if isinstance(problem, Cycle):
        along = corotating_rates(flow, orbit.state[None], orbit.values)[0][free] / scales
        # all unit vectors but the first are normal to the flow
        basis = np.linalg.qr(np.column_stack([problem.normal, np.eye(n)]))[0][:, 1:]
        monodromy = monodromy - np.outer(along, problem.normal @ monodromy) / (problem.normal @ along)

    def returns(displacements: Array) -> Array:
        states = np.tile(orbit.state, (len(displacements), 1))
        states[:, free] += (displacements @ basis.T) * scales
        ends = _returned(flow, problem, orbit, states)
        return (ends[:, free] - orbit.state[free]) / scales @ basis

    return doubling_coefficient(returns, basis.T @ monodromy @ basis)


def _returned(flow: Flow, problem: Periodic | Cycle, orbit: Orbit, states: Array) -> Array:
    """The ends [n, states] of motions from ``states`` over one period, in the frame of the
    drive; of a cycle in the plane of its phase condition. NaN where a run fails."""
    one = replace(problem, segments=1)
    values, periods = np.tile(orbit.values, (len(states), 1)), np.full(len(states), orbit.period)
    for _ in range(RETURNS if isinstance(one, Cycle) else 1):
        reached = flow.run(one.legs(states[:, None], values, periods, np.zeros(len(states), bool)))
        ends = one.shots(reached, values, periods)[0].reshape(states.shape)
        ends[~reached.ok.ravel()] = np.nan
        if isinstance(one, Cycle):
            weights = one.normal / one.state_scales
            distance = (ends - orbit.state)[:, one.free] @ weights
            speed = corotating_rates(flow, ends, orbit.values)[:, one.free] @ weights
            periods = periods - distance / speed
    return ends


def lyapunov_coefficient(rates: Map, n: int) -> NormalForm:
    """The first Lyapunov coefficient at the equilibrium 0 of ``rates`` of n states. With
    r the amplitude along the critical eigenvector of length 1, and ω its frequency, dr/dt
    is ω times the coefficient times r³."""
    offsets = LINEAR_STEP * np.concatenate([k * np.eye(n) for k in (-2, -1, 1, 2)])
    matrix = np.tensordot(np.array([1.0, -8.0, 8.0, -1.0]), rates(offsets).reshape(4, n, n), 1).T / (12.0 * LINEAR_STEP)
    if not np.isfinite(matrix).all():
        return NormalForm()
    eigenvalues, vectors = np.linalg.eig(matrix)
    pairs = np.flatnonzero(eigenvalues.imag > 1e-9 * np.max(np.abs(eigenvalues)))
    if not len(pairs):
        return NormalForm()
    critical = pairs[np.argmin(np.abs(eigenvalues[pairs].real))]
    if abs(eigenvalues[critical].real) > OFF_CRITICAL * eigenvalues[critical].imag:
        return NormalForm()
    omega, q = float(eigenvalues[critical].imag), vectors[:, critical] / np.linalg.norm(vectors[:, critical])
    p = _adjoint(matrix, eigenvalues[critical], q)

    def coefficient(forms: _Forms) -> float:
        mean = -np.linalg.solve(matrix, forms.second(q, q.conj()))
        double = np.linalg.solve(2j * omega * np.eye(n) - matrix, forms.second(q, q))
        sum_ = forms.third(q) + 2.0 * forms.second(q, mean) + forms.second(q.conj(), double)
        return float((p @ sum_).real) / (2.0 * omega)

    return _most_certain(coefficient(_Forms(rates, step)) for step in STEPS)


def doubling_coefficient(mapped: Map, matrix: Array) -> NormalForm:
    """The coefficient c of the normal form -x + c x³ of a map with the fixed point 0 and the
    Jacobian ``matrix`` [n, n] there, x along the critical eigenvector of length 1:
    positive where the doubled motion is stable."""
    eigenvalues, vectors = np.linalg.eig(matrix)
    critical = int(np.argmin(np.abs(eigenvalues + 1.0)))
    if abs(eigenvalues[critical] + 1.0) > OFF_CRITICAL:
        return NormalForm()
    q = np.real(vectors[:, critical]) / np.linalg.norm(np.real(vectors[:, critical]))
    p = np.real(_adjoint(matrix, eigenvalues[critical].real, q))

    def coefficient(forms: _Forms) -> float:
        mean = np.linalg.solve(matrix - np.eye(len(matrix)), forms.second(q, q))
        return float(np.real(p @ (forms.third(q) / 6.0 - 0.5 * forms.second(q, mean))))

    return _most_certain(coefficient(_Forms(mapped, step)) for step in STEPS)


def _adjoint(matrix: Array, eigenvalue: complex, q: Array) -> Array:
    """The left eigenvector p [n] with p q = 1."""
    values, vectors = np.linalg.eig(matrix.T)
    p = vectors[:, int(np.argmin(np.abs(values - eigenvalue)))]
    return np.asarray(p / (p @ q))


@dataclass(frozen=True)
class _Forms:
    """The second and third derivatives of a ``function`` at 0 as symmetric forms, from
    differences over a ``step``."""

    function: Map
    step: float

    def second(self, a: Array, b: Array) -> Array:
        """B(a, b) [n] of complex vectors."""
        parts = [(x, y) for x in (a.real, a.imag) for y in (b.real, b.imag)]
        plus = self._along([x + y for x, y in parts], SECOND, 2)
        minus = self._along([x - y for x, y in parts], SECOND, 2)
        rr, ri, ir, ii = (plus - minus) / 4.0
        return np.asarray(rr - ii + 1j * (ri + ir))

    def third(self, q: Array) -> Array:
        """C(q, q, q*) [n] of a complex vector."""
        r, i = q.real, q.imag
        rrr, iii, plus, minus = self._along([r, i, r + i, r - i], THIRD, 3)
        rri, rii = (plus - minus - 2.0 * iii) / 6.0, (plus + minus - 2.0 * rrr) / 6.0
        return np.asarray(rrr + rii + 1j * (rri + iii))

    def _along(self, directions: list[Array], weights: Array, order: int) -> Array:
        """The derivatives of this ``order`` [directions, n] along directions of any
        length."""
        lengths = np.array([np.linalg.norm(one) for one in directions])
        units = np.stack(directions) / np.where(lengths > 0.0, lengths, 1.0)[:, None]
        values = self.function((self.step * OFFSETS[:, None, None] * units).reshape(-1, units.shape[1]))
        along = np.tensordot(weights, values.reshape(len(OFFSETS), *units.shape), 1) / self.step**order
        return np.asarray(along * lengths[:, None] ** order)


def _most_certain(coefficients: Iterator[float]) -> NormalForm:
    """Of coefficients from ever shorter steps the one that differs least from both
    neighbours, and by how much."""
    found = np.array([*coefficients])
    changes = np.abs(np.diff(found))
    errors = np.maximum(changes[1:], changes[:-1])
    if not np.isfinite(errors).any():
        return NormalForm()
    best = int(np.nanargmin(errors))
    return NormalForm(float(found[best + 1]), float(errors[best]))

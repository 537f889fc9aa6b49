"""Implicit friction of bit and stations, as its stepper needs it
(:mod:`nsdrill.kernel.additive`).

Stations rub on the same modes, so every friction load changes the slip at every other
contact. With the tangent e_j = (y_j, -x_j)/r_j of station j, the torque's own forces
t_n = n^3 k_T (x_n, y_n) on the modes, and

    G_j = R + Q_j (e_jy cos phi - e_jx sin phi),    Q_j = sum_n q_n phi_jn,
    G_b = 1 + sum_n q_n (t_ny cos phi - t_nx sin phi)

of a unit load, a stage that moves velocities by c times the push has the slips (contact
0 is the bit)::

    v_a = v_a* - c sum_b K_ab L_b(v_b)
    K_jk = sum_n phi_jn phi_kn e_j . e_k / m + G_j G_k / J_e
    K_0k = G_k / J_e,   K_00 = G_b / J_e
    K_j0 = G_j G_b / J_e + e_j . sum_n phi_jn t_n / m

Newton's method solves for all of them, by elimination without pivoting (K is positive).
Each lane iterates until it has converged, and one without contact once, as where no
lane has contact and the bit is solved for alone: so a result does not depend on
neighbours.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from nsdrill.models.beam.options import Options, lateral, slopes_of

if TYPE_CHECKING:
    from nsdrill.models.beam.rhs import Writer

MAX_ITERATIONS = 12
# Relative tolerances of the loads, whose error one more iteration squares; the second
# one where differences of two states are taken.
TOLERANCE, TANGENT_TOLERANCE = 1e-5, 1e-8
STATION_ROWS = ("normal", "ex", "ey", "arm", "coupling")
CONTACT_ROWS = ("free", "estimate", "load", "dload", "step")


def aux_of(options: Options) -> tuple[str, ...]:
    """The names of the auxiliary rows of the solve."""
    stations, contacts = range(1, options.stations + 1), range(options.stations + 1)
    names = ["arm_0"]
    names += [f"{name}_{j}" for j in stations for name in STATION_ROWS]
    names += [f"{name}_{c}" for c in contacts for name in CONTACT_ROWS]
    names += [f"c_{a}_{b}" for a in contacts for b in contacts]
    # The velocities after the pushes at the two states about the motion, for a
    # deviation.
    return (
        *names,
        *(f"{name}_{k}" for name in ("above", "below") for k in range(2 * options.modes + 1)),
    )


def pushed(options: Options) -> int:
    """A bit for each slope in which friction acts: all but the axial one."""
    slopes = slopes_of(options.modes)
    return sum(1 << k for k, name in enumerate(slopes) if name != "az")


def velocities(options: Options) -> tuple[str, ...]:
    """The names of the velocities that a push moves, in the order of the pushes."""
    index_of = {"ax": 1, "ay": 3}
    return tuple(
        "bit_speed" if slope == "bit_acceleration" else lateral(int(slope[3:]))[index_of[slope[:2]]]
        for slope in slopes_of(options.modes)
        if slope != "az"
    )


class Solve:
    """Writes the solve of the friction loads, with the rows and the methods of a
    :class:`.rhs.Writer`; ``for_tangent`` selects the smaller tolerance."""

    def __init__(self, writer: Writer, for_tangent: bool) -> None:
        self.writer, self.options = writer, writer.options
        self.modes, self.stations = writer.modes, writer.stations
        self.tolerance = TANGENT_TOLERANCE if for_tangent else TOLERANCE

    def lines(self) -> list[str]:
        """The lines from the positions of the stations and the rock's force to the
        loads, the pushes and the velocities after them."""
        loop = self.writer.loop
        touching = " | ".join(f"touching_{j}" for j in self.stations)
        lines = [
            f"    {' = '.join(f'touching_{j}' for j in self.stations)} = 0",
            *loop(self._bit()),
        ]
        for j in self.stations:
            lines += loop(self._station(j))
        contacts = [0, *self.stations]
        lines += [
            f"    touching = {touching}",
            "    if touching == 0:",
            *self._indented(loop(self._bit_alone())),
            *self._indented(self._pushes([0])),
            "    else:",
        ]
        for j in self.stations:
            lines += self._indented(loop(self._couplings(j)))
        for j in self.stations:
            lines += self._indented(loop(self._initial_guess(j)))
        lines += self._indented(loop(self._initial_guess_of_bit()))
        lines += [
            f"        for iteration in range({MAX_ITERATIONS}):",
            "            unconverged, first = 0, 1.0 if iteration == 0 else 0.0",
        ]
        for c in contacts:
            lines += self._indented(self._indented(loop(self._friction_law(c))))
        lines += self._indented(self._indented(loop(self._newton(contacts, last=False))))
        lines += ["            if unconverged == 0:", "                break"]
        for c in contacts:
            lines += self._indented(loop(self._friction_law(c)))
        lines += self._indented(loop(self._newton(contacts, last=True)))
        return lines + self._indented(self._pushes(contacts))

    @staticmethod
    def _indented(lines: Iterable[str]) -> list[str]:
        return [f"    {line}" for line in lines]

    def _bit(self) -> list[str]:
        """G_b, the response of the bit to a unit of torque, and the rate at which slip
        grows where friction falls with speed."""
        load, store = self.writer.load, self.writer.store
        lines = [*self.writer.rock(), *load("per_inertia")]
        response = "1.0"
        if self.options.torque:
            lines += load(
                "softening_torque", *(x for n in self.options.eccentric for x in lateral(n)[::2])
            )
            for n in self.options.eccentric:
                x, _, y, _ = lateral(n)
                lines += load(f"unbalance_arm_{n}")
                arm = f"{float(n**3)!r} * softening_torque * unbalance_arm_{n}"
                response = f"fma({arm}, fma({y}, c, -({x} * s)), {response})"
        return [
            *lines,
            f"arm = {response}",
            *store(
                arm_0="arm",
                force="force",
                cosine="c",
                sine="s",
                friction="0.0",
                wall_contacts="0.0",
                slip_sum="0.0",
                free_0="bit_speed",
                falling="arm * per_inertia * force * bit_rise * bit_decay",
            ),
        ]

    def _station(self, j: int) -> list[str]:
        """Position, slip without friction and normal force; G_j, the response of the
        bit to a unit of friction."""
        load, total = self.writer.load, self.writer.total
        shapes = {n: f"phi_{j}_{n}" for n in self.modes}
        lines = load(*shapes.values(), *(name for n in self.modes for name in lateral(n)))
        for k, name in enumerate(("px", "vx", "py", "vy")):
            lines.append(f"{name} = {total([(shapes[n], lateral(n)[k]) for n in self.modes])}")
        arms = [f"unbalance_arm_{n}" for n in self.options.eccentric]
        lever = (
            total(list(zip(arms, (shapes[n] for n in self.options.eccentric), strict=True)))
            if arms
            else "0.0"
        )
        return [
            *lines,
            *load(
                *arms,
                f"gap_{j}",
                f"wall_stiffness_{j}",
                "collar_radius",
                "bit_speed",
                "cosine",
                "sine",
            ),
            "radius = np.sqrt(max(fma(px, px, py * py), 1e-60))",
            f"touching_{j} |= 1 if radius > gap_{j} else 0",
            "per = 1.0 / radius",
            "ex, ey = py * per, -(px * per)",
            f"penetration = max(radius - gap_{j}, 0.0)",
            f"normal = wall_stiffness_{j} * penetration",
            *(["normal = normal * np.sqrt(penetration)"] if self.options.hertz else []),
            f"arm = fma({lever}, fma(ey, cosine, -(ex * sine)), collar_radius)",
            *self.writer.store(
                **{
                    f"ex_{j}": "ex",
                    f"ey_{j}": "ey",
                    f"normal_{j}": "normal",
                    f"arm_{j}": "arm",
                    f"free_{j}": "fma(bit_speed, collar_radius, -fma(ex, vx, ey * vy))",
                }
            ),
        ]

    def _bit_alone(self) -> list[str]:
        """The torque of the bit where no station touches: two iterations, which are
        enough for one contact, in the operations of :meth:`_newton`, to the bit."""
        load, store = self.writer.load, self.writer.store
        newton = [
            "f, df = hyperbolic(v, bit_smoothing, bit_decay, bit_rise, bit_dynamic)",
            "f, df = force * f, force * df",
            "step = (free_0 - (v + relaxed * f)) * (1.0 / fma(relaxed, df, 1.0))",
        ]
        return [
            *load(
                "relax",
                "force",
                "arm_0",
                "per_inertia",
                "free_0",
                "bit_smoothing",
                "bit_decay",
                "bit_rise",
                "bit_dynamic",
            ),
            "relaxed = relax * arm_0 * per_inertia",
            "v = first_slip(free_0, relaxed * force, bit_smoothing, bit_decay, bit_rise, bit_dynamic)",
            *newton,
            "v = kept(v, v + step)",
            *newton,
            *store(load_0="fma(df, step, f)", **{f"load_{j}": "0.0" for j in self.stations}),
        ]

    def _couplings(self, j: int) -> list[str]:
        """Row and column j of the matrix K, times the relaxation time c of the
        stage."""
        load, total = self.writer.load, self.writer.total
        others = [k for k in self.stations if k >= j]
        names = [f"{name}_{k}" for k in others for name in ("ex", "ey", "arm")]
        shapes = sorted({f"phi_{k}_{n}" for k in others for n in self.modes})
        lines = load(
            *names,
            *shapes,
            "relax",
            "per_lateral_mass",
            "per_inertia",
            "arm_0",
            f"normal_{j}",
            "falling",
            "wall_rise",
            "wall_decay",
        )
        values = {}
        for k in others:
            shape = total([(f"phi_{j}_{n}", f"phi_{k}_{n}") for n in self.modes])
            along = f"fma(ex_{j}, ex_{k}, ey_{j} * ey_{k})"
            coupling = f"fma({shape}, {along} * per_lateral_mass, arm_{j} * arm_{k} * per_inertia)"
            if k == j:
                lines.append(f"self_coupling = {coupling}")
                values["falling"] = (
                    f"fma(self_coupling * normal_{j}, wall_rise * wall_decay, falling)"
                )
            values[f"c_{j}_{k}"] = f"relax * {'self_coupling' if k == j else coupling}"
            if k > j:
                values[f"c_{k}_{j}"] = self.writer.row[f"c_{j}_{k}"]
        values[f"c_0_{j}"] = f"relax * arm_{j} * per_inertia"
        bit_to_station = f"arm_{j} * arm_0 * per_inertia"
        if self.options.torque:
            lines += load("softening_torque", *(x for n in self.modes for x in lateral(n)[::2]))
            torque_terms = [
                (f"{float(n**3)!r} * phi_{j}_{n}", f"fma(ex_{j}, x_{n}, ey_{j} * y_{n})")
                for n in self.modes
            ]
            bit_to_station = (
                f"fma(softening_torque * per_lateral_mass, {total(torque_terms)}, {bit_to_station})"
            )
        values[f"c_{j}_0"] = f"relax * ({bit_to_station})"
        values["c_0_0"] = "relax * arm_0 * per_inertia"
        return [*lines, *self.writer.store(**values)]

    def _initial_guess(self, j: int) -> list[str]:
        law = "wall_smoothing, wall_decay, wall_rise, wall_dynamic"
        return [
            *self.writer.load(f"free_{j}", f"c_{j}_{j}", f"normal_{j}", *law.split(", ")),
            f"v = first_slip(free_{j}, c_{j}_{j} * normal_{j}, {law})",
            f"f, df = hyperbolic(v, {law})",
            *self.writer.store(**{f"estimate_{j}": "v", f"load_{j}": f"normal_{j} * f"}),
        ]

    def _initial_guess_of_bit(self) -> list[str]:
        law = "bit_smoothing, bit_decay, bit_rise, bit_dynamic"
        rubbed = self.writer.total([(f"c_0_{j}", f"load_{j}") for j in self.stations])
        couplings = [f"{name}_{j}" for j in self.stations for name in ("c_0", "load")]
        return [
            *self.writer.load("free_0", "c_0_0", "force", *couplings, *law.split(", ")),
            *self.writer.store(estimate_0=f"first_slip(free_0 - {rubbed}, c_0_0 * force, {law})"),
        ]

    def _friction_law(self, c: int) -> list[str]:
        side, scale = ("bit", "force") if c == 0 else ("wall", f"normal_{c}")
        law = f"{side}_smoothing, {side}_decay, {side}_rise, {side}_dynamic"
        return [
            *self.writer.load(f"estimate_{c}", scale, *law.split(", ")),
            f"f, df = hyperbolic(estimate_{c}, {law})",
            *self.writer.store(**{f"load_{c}": f"{scale} * f", f"dload_{c}": f"{scale} * df"}),
        ]

    def _newton(self, contacts: list[int], *, last: bool) -> list[str]:
        """One iteration, which updates the estimates of the slips; the ``last`` one
        updates the loads along their tangents instead."""
        load, total = self.writer.load, self.writer.total
        rows = [f"c_{a}_{b}" for a in contacts for b in contacts]
        lines = load(
            *rows,
            *(f"{name}_{c}" for c in contacts for name in ("free", "estimate", "load", "dload")),
        )
        if not last:
            scales = ["force", *(f"normal_{j}" for j in self.stations)]
            lines += load(*scales, "bit_rise", "bit_dynamic", "wall_rise", "wall_dynamic")
            lines += [
                f"bound_{c} = {self.tolerance!r} * {scale} * ({side}_rise + {side}_dynamic)"
                for c, (scale, side) in enumerate(
                    zip(scales, ["bit", *["wall"] * len(self.stations)], strict=True)
                )
            ]
        lines += [
            f"residual_{a} = free_{a} - fma(1.0, estimate_{a}, "
            f"{total([(f'c_{a}_{b}', f'load_{b}') for b in contacts])})"
            for a in contacts
        ]
        if not last:
            excess = "0.0"
            for a in contacts:
                allowed = total(
                    [(f"abs(c_{a}_{b})", f"bound_{b}") for b in contacts], f"1e-14 * abs(free_{a})"
                )
                excess = f"max(abs(residual_{a}) - {allowed}, {excess})"
            lines += [
                f"excess = {excess}",
                f"touches = {' + '.join(scales[1:])} > 0.0",
                "active = (1.0 if excess > 0.0 else 0.0) if touches else first",
                "unconverged |= 1 if (excess > 0.0) & touches else 0",
            ]
        lines += [
            f"m_{a}_{b} = "
            f"{f'fma(c_{a}_{b}, dload_{b}, 1.0)' if a == b else f'c_{a}_{b} * dload_{b}'}"
            for a in contacts
            for b in contacts
        ]
        for p in contacts:
            lines.append(f"per_{p} = 1.0 / m_{p}_{p}")
            for a in contacts[p + 1 :]:
                lines.append(f"l = -(m_{a}_{p} * per_{p})")
                lines += [f"m_{a}_{b} = fma(l, m_{p}_{b}, m_{a}_{b})" for b in contacts[p + 1 :]]
                lines.append(f"residual_{a} = fma(l, residual_{p}, residual_{a})")
        for a in reversed(contacts):
            solved = [(f"m_{a}_{b}", f"step_{b}") for b in contacts[a + 1 :]]
            lines.append(
                f"step_{a} = {f'(residual_{a} - {total(solved)})' if solved else f'residual_{a}'} * per_{a}"
            )
        if last:
            return [
                *lines,
                *self.writer.store(
                    **{f"load_{c}": f"fma(dload_{c}, step_{c}, load_{c})" for c in contacts}
                ),
            ]
        estimates = {
            f"estimate_{c}": f"kept(estimate_{c}, fma(active, step_{c}, estimate_{c}))"
            for c in contacts
        }
        return [*lines, *self.writer.store(**estimates)]

    def _pushes(self, contacts: list[int]) -> list[str]:
        """The pushes and the velocities after them; that of the bit is stored last, as
        its acceleration enters all others."""
        loop, load, total = self.writer.loop, self.writer.load, self.writer.total
        names = velocities(self.options)
        bit_load = total([(f"arm_{c}", f"load_{c}") for c in contacts])
        bit = names.index("bit_speed")
        loops = loop(
            [
                *load(
                    *(f"{name}_{c}" for c in contacts for name in ("arm", "load")), "per_inertia"
                ),
                *self.writer.store(
                    **{f"push_{bit}": f"-({bit_load}) * per_inertia", "torque": "load_0"}
                ),
            ]
        )
        stations = contacts[1:]
        for n in self.modes:
            x, vx, y, vy = lateral(n)
            eccentric = n in self.options.eccentric
            lines = load(vx, vy, "relax", "per_lateral_mass")
            lines += load(*(f"{name}_{j}" for j in stations for name in ("ex", "ey", "load")))
            lines += load(*(f"phi_{j}_{n}" for j in stations))
            lines += (
                load("cosine", "sine", f"unbalance_arm_{n}", f"push_{bit}") if eccentric else []
            )
            lines += [f"rub_{j} = phi_{j}_{n} * load_{j}" for j in stations]
            if self.options.torque:
                lines += [
                    *load("softening_torque", "torque", x, y),
                    f"twisted = {float(n**3)!r} * softening_torque * torque",
                ]
            values = {}
            for axis, place, velocity in (("x", x, vx), ("y", y, vy)):
                terms = [(f"rub_{j}", f"e{axis}_{j}") for j in stations]
                terms += [("twisted", place)] if self.options.torque else []
                push = f"({total(terms)}) * per_lateral_mass" if terms else "0.0"
                if eccentric:
                    trig = "sine" if axis == "x" else "-cosine"
                    push = f"fma(unbalance_arm_{n} * push_{bit}, {trig}, {push})"
                lines.append(f"push_{axis} = {push}")
                values[f"push_{names.index(velocity)}"] = f"push_{axis}"
                values[f"moved_{names.index(velocity)}"] = f"fma(relax, push_{axis}, {velocity})"
            loops += loop([*lines, *self.writer.store(**values)])
        return loops + loop(
            [
                *load("relax", "bit_speed", f"push_{bit}"),
                *self.writer.store(**{f"moved_{bit}": f"fma(relax, push_{bit}, bit_speed)"}),
            ]
        )

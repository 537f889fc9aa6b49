"""The studies of :mod:`benchmarks.golden`: for each a text, or the name of a file of
configs/, and the commands that run it."""

from __future__ import annotations

RUN = "run study.yaml -o out.h5"
SIMULATE = "simulate study.yaml -o trace.h5 --sample 50ms"
SHORT = ["--set", "simulation={transient: 40 s, observe: 40 s}"]
KEPT = ["--set", "record={peaks: 8, poincare: 20}"]


def run(*settings: str) -> list[str]:
    """nsdrill run with 40 s of transient and of observation, and these settings."""
    return [*RUN.split(), *SHORT, *(w for s in settings for w in ("--set", s))]


STICK_SLIP = "modes: {axial: frozen, lateral: frozen}\ninitial: {bit_speed: 0 rad/s}\n"
TORSION = "model: torsion\noperation: {depth: 5000 m, wob: 60 kN}\ninitial: {bit_speed: 0 rad/s}\n"
BEAM = "model: beam\nbeam: {modes: 3, stations: [{at: 0.2}, {at: 0.5}]}\n"
SEGMENTS = """\
model: segments
segments: {pipe: 3, collar: 2}
operation: {depth: 2200 m, wob: 100 kN}
initial: {start: rest}
"""
SPEEDS = "sweep: {rotary_speed: [1 rad/s, 3 rad/s, 5 rad/s, 8 rad/s]}\n"
ROCK = "law: regenerative, states: 6"
SLOW = "sweep: {rotary_speed: [4 rad/s, 8 rad/s, 11 rad/s]}\n"  # off bottom for long, for a part, and steady
FAST = "sweep: {rotary_speed: [13 rad/s, 30 rad/s]}\n"
STEEP = "bit: {friction: {smoothing: 1.0e+5 s/rad}}\n"
STEEP_WALL = "well: {friction: {smoothing: 1.0e+4 s/m}}\n"
RECORD = "record: {peaks: 8, poincare: 20}\n"
EXPONENT = "record: {peaks: 8, poincare: 20, exponent: true}\n"
DOWN = "{rotary_speed: {from: 2 rad/s, to: 8 rad/s, points: 4}, procedure: up-down}"
DATA = """\
rotary_speed [rad/s], wob [kN], stick_slip_index [%], surface_torque_max [kN*m]
2, 30, 150, 4
4, 50, 60, 4
9, 60, 3, 2
"""

STUDIES: dict[str, tuple] = {
    # the main model
    "fig4": (
        "fig4_speed_22kN.yaml",
        [*run("sweep.rotary_speed.points=6"), *KEPT],
        "replay out.h5 --rotary-speed 5rad/s --procedure down -o replay.h5 --sample 50ms",
        "export out.h5 -o - --peaks --section --states",
        "check study.yaml --json",
    ),
    "map": (
        "map_wob_speed.yaml",
        run("sweep.wob.points=5", "sweep.rotary_speed.points=6"),
        "window out.h5",
        "window out.h5 --json",
    ),
    "same": ("operation: {wob: 40 kN}\n" + RECORD, run("sweep={depth: {from: 1000 m, to: 8000 m, points: 28}}")),
    "dormand-prince": (SPEEDS, run("simulation.pair=dormand_prince")),
    "implicit": (STEEP + STEEP_WALL + SPEEDS + RECORD, run("simulation.method=implicit")),
    "auto": ("sweep: {bit.friction.smoothing: [100 s/rad, 1.0e+4 s/rad], rotary_speed: [2 rad/s, 7 rad/s]}\n", run()),
    "exponent": (EXPONENT.replace("exponent", "section: lobe, exponent"), run(f"sweep={DOWN}")),
    "exponent-implicit": (STEEP + STEEP_WALL + SPEEDS + EXPONENT, run("simulation.method=implicit")),
    "drives": ("drives_speed_67kN.yaml", run("sweep.rotary_speed=[2 rad/s, 4 rad/s]")),
    "soft-torque": (SPEEDS + EXPONENT + "drive: {kind: soft_torque}\n", run()),
    "soft-torque-implicit": (STEEP + SPEEDS + "drive: {kind: soft_torque}\n", run()),
    "pi": (
        SPEEDS
        + "drive: {kind: pi, twist_gain: 50 N*m/rad, speed_gain: 20 N*m*s/rad,"
        + " shaft_damping: 30 N*m*s/rad, torque_limit: 20 kN*m}\n",
        run(),
    ),
    "dc-motor": (SPEEDS + "drive: {kind: dc_motor}\n", run()),
    "laws": (
        STICK_SLIP + "operation: {wob: 66.72 kN}\n",
        run("sweep={bit.friction.law: [hyperbolic, linear, exponential, rational], rotary_speed: [2 rad/s, 6 rad/s]}"),
    ),
    "rational": (SPEEDS + "bit: {friction: {law: rational}}\n", run()),
    "lateral": (
        SPEEDS
        + "mud: {swirl: 0.5}\nstabilizer: {clearance: 5 mm}\ninitial: {x: 70 mm}\n"
        + "well: {inclination: 20 deg, axial_friction: true, law: hertz, stiffness: 1 GN/m^1.5}\n",
        run(),
    ),
    "stabilizer-implicit": (
        SPEEDS
        + "mud: {swirl: 0.5}\nstabilizer: {clearance: 5 mm}\ninitial: {x: 70 mm}\n"
        + "well: {inclination: 20 deg, friction: {smoothing: 1.0e+4 s/m}}\n",
        run("simulation.method=implicit"),
    ),
    "axial-implicit": (
        SPEEDS + "initial: {x: 70 mm}\nwell: {axial_friction: true, friction: {smoothing: 1.0e+4 s/m}}\n",
        run("simulation.method=implicit"),
    ),
    "clearance": (
        "whirl_clearance.yaml",
        run("sweep.rotary_speed.points=4", "sweep.stabilizer.clearance=[0 mm, 12.7 mm]"),
    ),
    "softening": (SPEEDS + "drillstring: {lateral_softening: static, eccentric_mass: steel}\n", run()),
    "ramp": ("operation: {rotary_speed: {ramp: [[0 s, 3 rad/s], [20 s, 8 rad/s], [40 s, 3 rad/s]]}}\n", SIMULATE),
    "ramp-implicit": (
        STEEP
        + STEEP_WALL
        + "operation: {wob: {ramp: [[0 s, 66 kN], [20 s, 15 kN]]},"
        + " depth: {ramp: [[0 s, 3000 m], [30 s, 3100 m]]}}\n",
        SIMULATE,
    ),
    "ensemble": ("initial: {ensemble: 12, seed: 1}\n" + SPEEDS, run()),
    "basin": ("basin_slice.yaml", run("initial.slice.x.points=5", "initial.slice.vx.points=5")),
    "refined": (
        "sweep: {wob: {from: 20 kN, to: 100 kN, points: 3},"
        " rotary_speed: {from: 1 rad/s, to: 9 rad/s, points: 5}, refine: 2}\n",
        run(),
    ),
    "verified": (SPEEDS + RECORD, run("simulation.verify=true")),
    "verified-torsion": (STICK_SLIP + SPEEDS + RECORD, run("simulation.verify=true")),
    "uncertain": (
        "uncertain_window.yaml",
        run("sweep.wob=[40 kN, 80 kN]", "sweep.rotary_speed=[80 rpm, 120 rpm]", "uncertain.samples=16"),
        "window out.h5",
        "sensitivity out.h5",
    ),
    "branches": ("branches_stick_slip.yaml", "branches study.yaml -o branches.h5"),
    "branches-circle": (
        "branches_speed_22kN.yaml",
        [
            *("branches", "study.yaml", "-o", "branches.h5", "--set", "continue.points=8"),
            *("--set", "simulation.transient=300 s"),
            *("--set", "continue.seeds={rotary_speed: [6.6 rad/s]}"),
        ],
    ),
    # the others
    "torsion": (TORSION + SPEEDS + EXPONENT, run()),
    "torsion-implicit": (TORSION + STEEP + SPEEDS + EXPONENT, run("simulation.method=implicit")),
    "fit": (
        "model: torsion\nsimulation: {transient: 20 s, observe: 20 s}\n"
        "uncertain:\n  bit.friction.static: {uniform: [0.2, 0.8]}\n"
        "  bit.friction.dynamic: {uniform: [0.05, 0.2]}\n",
        "fit study.yaml --data rig.csv -o adjusted.yaml --batch 16 --rounds 3 --samples 16",
    ),
    "beam": (BEAM + SPEEDS + RECORD, run()),
    "beam-contact": ("beam_wob_contact.yaml", run("sweep.wob=[100 kN, 350 kN]")),
    "beam-implicit": (BEAM + STEEP + STEEP_WALL + SPEEDS + EXPONENT, run("simulation.method=implicit")),
    "beam-torque": (
        "model: beam\nbeam: {modes: 2, stations: [{at: 0.5}], torque: cy}\n" + SPEEDS + EXPONENT,
        run("drillstring.eccentricity_shape=uniform"),
    ),
    "segments": (SEGMENTS + EXPONENT + "sweep: {rotary_speed: [13 rad/s, 30 rad/s], procedure: down}\n", run()),
    "segments-implicit": (SEGMENTS + FAST + RECORD, run("simulation.method=implicit")),
    "segments-lqr": (
        SEGMENTS + FAST + "drive: {kind: lqr}\n",
        run(),
        "simulate study.yaml -o trace.h5 --set drive.on_at=5s --duration 10s",
    ),
    "segments-soft-torque": (SEGMENTS + FAST + "drive: {kind: soft_torque}\n", run()),
    "segments-surface": (SEGMENTS + FAST + f"bit: {{rock: {{{ROCK}}}}}\n", run()),
    "surface": (f"bit: {{rock: {{{ROCK}}}}}\noperation: {{wob: 44 kN}}\n" + SLOW + RECORD, run()),
    "cutting": ("model: regenerative\noperation: {wob: 44 kN}\n" + SLOW + EXPONENT, run()),
    "cutting-implicit": (
        "model: regenerative\nbit: {smoothing: 1.0e+4 s/rad}\ndrive: {kind: soft_torque}\n" + SLOW,
        run("simulation.method=implicit", "bit.states=8", "operation.wob=44kN"),
    ),
    "segments-ramp": (
        SEGMENTS.replace("100 kN", "100 kN, rotary_speed: {ramp: [[0 s, 13 rad/s], [10 s, 30 rad/s]]}"),
        SIMULATE,
    ),
}

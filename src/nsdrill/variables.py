"""Every variable of a results or trace file, once: name, type, dimensions, units, meaning.

The store writes from this table, the export and the plots label from it, and the file-format page of the documentation
is checked against it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

AXES = ("depth", "wob", "rotary_speed")
POINT = ("procedure", *AXES)
STATE_NAMES = ("x", "vx", "y", "vy", "z", "vz", "twist", "bit_speed", "drive_angle")
DRIVEN_STATE_NAMES = (*STATE_NAMES[:-1], "lag", "drive_speed", STATE_NAMES[-1])  # with a drive that is not ideal
STATE_UNITS = {
    "x": "m",
    "vx": "m s-1",
    "y": "m",
    "vy": "m s-1",
    "z": "m",
    "vz": "m s-1",
    "twist": "rad",
    "bit_speed": "rad s-1",
    "lag": "rad",
    "drive_speed": "rad s-1",
    "drive_angle": "rad",
}
PROCEDURES = ("same", "up", "down")
FORMAT_VERSION = 2
MODEL = "christoforou_yigit"

PENDING, OK, DIVERGED, STEP_LIMIT, STEP_UNDERFLOW, INFERRED = range(6)


def has_failed(status: Any) -> Any:
    """Which runs came to no good end; an array of booleans from an array of statuses."""
    return (status != PENDING) & (status != OK) & (status != INFERRED)


BIT_BOUNCE, STICK_SLIP, WHIRL = 1, 2, 4
NO_WHIRL, FORWARD, BACKWARD, BACKWARD_ROLLING, IRREGULAR, LOW_SIDE = range(6)
UNDETERMINED, EQUILIBRIUM, PERIODIC, QUASI_PERIODIC, CHAOTIC, UNSETTLED = range(6)


def dimension_of(key: str) -> str:
    """The name of the dimension of an axis by its dotted key."""
    return key.replace(".", "_")


@dataclass(frozen=True)
class Axis:
    """A number of the study that a sweep varies: its dotted ``key`` as the study has it, the SI ``units`` of its values
    as a study writes them, and what it is."""

    key: str
    units: str
    long_name: str

    @property
    def name(self) -> str:
        """Its name as a dimension."""
        return dimension_of(self.key)


@dataclass(frozen=True)
class Variable:
    """One variable. ``room`` says who makes it: ``run`` (bookkeeping), ``feature`` (measured during the run; a new
    classification leaves it alone), ``label`` (made from features by the classification), ``trust`` (measured by the
    checks of a point), ``peaks``, ``section``, ``states``. ``units`` are empty where those of its entries differ
    (:data:`STATE_UNITS`). Where ``only`` names something to keep (:class:`Kept`), the variable is there only if that
    is kept."""

    name: str
    dtype: str
    units: str
    long_name: str
    room: str = "feature"
    dims: tuple[str, ...] = POINT
    flag_values: tuple[int, ...] | None = None
    flag_masks: tuple[int, ...] | None = None
    flag_meanings: str | None = None
    only: str | None = None


@dataclass(frozen=True)
class Kept:
    """What is kept of each point beside features and labels: how many peaks and returns to the Poincare section, and
    whether the Lyapunov exponent; from how many states each operating point is started, 0 where from one only,
    without a dimension for it; whether there are checks of each point; the axes beside those of the operation; the names
    of the states; whether the stabilisers have room or friction; and whether the hole is inclined somewhere."""

    peaks: int = 0
    returns: int = 0
    exponent: bool = False
    starts: int = 0
    verify: bool = False
    axes: tuple[Axis, ...] = ()
    states: tuple[str, ...] = STATE_NAMES
    stabilized: bool = False
    inclined: bool = False

    def __post_init__(self) -> None:
        # As plain data has them.
        object.__setattr__(self, "states", tuple(self.states))
        made = tuple(axis if isinstance(axis, Axis) else Axis(**axis) for axis in self.axes)
        object.__setattr__(self, "axes", made)

    @property
    def driven(self) -> bool:
        """Whether the drive has states of its own."""
        return "lag" in self.states

    @property
    def grid(self) -> tuple[str, ...]:
        """The dimensions over which points are numbered, the last fastest."""
        return (*POINT, *(axis.name for axis in self.axes), *(("start",) if self.starts else ()))

    def dims(self, variable: Variable) -> tuple[str, ...]:
        """The dimensions of ``variable`` in a file."""
        return (*self.grid, *variable.dims[len(POINT) :])

    def has(self, variable: Variable) -> bool:
        """Whether ``variable`` is among what is kept."""
        return variable.only is None or bool(getattr(self, variable.only))

    def length(self, dimension: str) -> int:
        """The length of a dimension that is no axis."""
        lengths = {"start": self.starts, "peak": self.peaks, "crossing": self.returns, "state": len(self.states)}
        return lengths[dimension]


def _feature(name: str, units: str, long_name: str, only: str | None = None) -> Variable:
    return Variable(name, "f8", units, long_name, only=only)


def _peaks(name: str, units: str, long_name: str) -> Variable:
    return Variable(name, "f8", units, long_name, "peaks", (*POINT, "peak"), only="peaks")


def _section(name: str, units: str, long_name: str) -> Variable:
    return Variable(
        f"section_{name}",
        "f8",
        units,
        f"{long_name} at the Poincare section",
        "section",
        (*POINT, "crossing"),
        only="returns",
    )


CHECKS = ("tight", "long")
CHECK_FEATURES = ("lift_off_fraction", "stick_slip_index", "wall_contact_fraction")  # those that responses follow from
_CHECKED = {"tight": "with a smaller tolerance", "long": "when continued for longer"}


def _check(name: str) -> tuple[Variable, ...]:
    """What is known of the point from one of its checks."""
    how = _CHECKED[name]
    return (
        Variable(
            f"{name}_response",
            "i1",
            "1",
            f"critical responses {how}",
            "label",
            flag_masks=(1, 2, 4),
            flag_meanings="bit_bounce stick_slip whirl",
            only="verify",
        ),
        Variable(
            f"{name}_difference",
            "f8",
            "1",
            f"largest difference of the features {how}, in natural sizes",
            "trust",
            only="verify",
        ),
        Variable(
            f"{name}_status",
            "i1",
            "1",
            f"how the run ended {how}",
            "trust",
            flag_values=(0, 1, 2, 3, 4),
            flag_meanings="unchecked ok diverged step_limit step_underflow",
            only="verify",
        ),
        *(
            Variable(
                f"{name}_{feature}",
                "f8",
                "percent" if feature == "stick_slip_index" else "1",
                f"{feature} {how}",
                "trust",
                only="verify",
            )
            for feature in CHECK_FEATURES
        ),
    )


VARIABLES: tuple[Variable, ...] = (
    Variable(
        "status",
        "i1",
        "1",
        "how the run ended",
        "run",
        flag_values=(0, 1, 2, 3, 4, 5),
        flag_meanings="pending ok diverged step_limit step_underflow inferred",
    ),
    Variable(
        "response",
        "i1",
        "1",
        "critical responses present",
        "label",
        flag_masks=(1, 2, 4),
        flag_meanings="bit_bounce stick_slip whirl",
    ),
    Variable(
        "whirl_kind",
        "i1",
        "1",
        "kind of whirl",
        "label",
        flag_values=(0, 1, 2, 3, 4, 5),
        flag_meanings="none forward backward backward_rolling irregular low_side",
    ),
    Variable(
        "stick_slip_severity",
        "i1",
        "1",
        "severity band of the stick-slip index",
        "label",
        flag_values=(0, 1, 2, 3, 4),
        flag_meanings="none torsional_oscillation medium onset_of_full_stall severe",
    ),
    Variable(
        "bounce_severity",
        "i1",
        "1",
        "severity band of the time off the rock",
        "label",
        flag_values=(0, 1, 2, 3, 4),
        flag_meanings="none light moderate strong severe",
    ),
    Variable(
        "whirl_severity",
        "i1",
        "1",
        "severity band of the r.m.s. lateral acceleration",
        "label",
        flag_values=(0, 1, 2, 3, 4),
        flag_meanings="none light moderate strong severe",
    ),
    Variable(
        "settled",
        "i1",
        "1",
        "both halves of the observed window agree",
        "label",
        flag_values=(0, 1),
        flag_meanings="unsettled settled",
    ),
    Variable(
        "motion",
        "i1",
        "1",
        "kind of motion",
        "label",
        flag_values=(0, 1, 2, 3, 4, 5),
        flag_meanings="undetermined equilibrium periodic quasi_periodic chaotic unsettled",
        only="returns",
    ),
    Variable(
        "period", "i2", "1", "period in returns to the Poincare section, 0 where there is none", "label", only="returns"
    ),
    Variable(
        "attractor",
        "i2",
        "1",
        "attractor of the start, numbered alike along the axes: 1 has most starts, 0 none",
        "label",
        only="starts",
    ),
    _feature("bit_speed_min", "rad s-1", "least bit speed"),
    _feature("bit_speed_max", "rad s-1", "greatest bit speed"),
    _feature("bit_speed_mean", "rad s-1", "mean bit speed"),
    _feature("stick_slip_index", "percent", "stick-slip index (max - min) / (2 mean) of bit speed"),
    _feature("stuck_fraction", "1", "fraction of time with the bit stuck"),
    _feature("axial_min", "m", "lowest bit position"),
    _feature("axial_max", "m", "highest bit position"),
    _feature("lift_off_fraction", "1", "fraction of time with the bit off the rock"),
    _feature("bit_force_max", "N", "greatest force on the bit"),
    _feature("bit_torque_max", "N m", "greatest torque on the bit"),
    _feature("radius_max", "m", "greatest radial displacement of the collar"),
    _feature("radius_mean", "m", "mean radial displacement of the collar"),
    _feature("wall_contact_fraction", "1", "fraction of time with the collar on the wall"),
    _feature("wall_force_max", "N", "greatest normal force on the wall"),
    _feature(
        "stabilizer_contact_fraction", "1", "fraction of time with the stabilisers on the wall", "stabilized"
    ),
    _feature("x_mean", "m", "mean displacement of the collar across an inclined hole, x", "inclined"),
    _feature("y_mean", "m", "mean displacement of the collar in an inclined hole, y, the low side at -y", "inclined"),
    _feature("whirl_speed_mean", "rad s-1", "mean whirl speed"),
    _feature("whirl_ratio", "1", "mean whirl speed over mean bit speed"),
    _feature("rolling_ratio", "1", "rolling ratio while on the wall: 1 rolls backward without slip, 0 does not roll"),
    _feature("surface_torque_min", "N m", "least torque at the surface"),
    _feature("surface_torque_max", "N m", "greatest torque at the surface"),
    _feature("surface_torque_mean", "N m", "mean torque at the surface"),
    _feature("drive_speed_min", "rad s-1", "least speed of the drive", "driven"),
    _feature("drive_speed_max", "rad s-1", "greatest speed of the drive", "driven"),
    _feature("drive_speed_mean", "rad s-1", "mean speed of the drive", "driven"),
    _feature("lateral_acceleration_rms", "m s-2", "r.m.s. lateral acceleration of the collar centre"),
    _feature("axial_acceleration_rms", "m s-2", "r.m.s. axial acceleration of the bit"),
    _feature("half_difference", "1", "largest disagreement between the halves of the observed window"),
    _feature("zero_one", "1", "0-1 test for chaos on the returns: near 0 regular, near 1 chaotic", "returns"),
    _feature("lyapunov_exponent", "s-1", "largest Lyapunov exponent", "exponent"),
    _feature("lyapunov_error", "s-1", "standard error of the largest Lyapunov exponent", "exponent"),
    Variable(
        "trusted",
        "i1",
        "1",
        "both checks find the same response and nearly the same features",
        "label",
        flag_values=(0, 1),
        flag_meanings="untrusted trusted",
        only="verify",
    ),
    *_check("tight"),
    *_check("long"),
    Variable("steps", "i8", "1", "accepted steps", "run"),
    Variable("rejected", "i8", "1", "rejected steps", "run"),
    _peaks("axial_peaks", "m", "last local maxima of the bit position"),
    _peaks("bit_speed_peaks", "rad s-1", "last local maxima of the bit speed"),
    _peaks("radius_peaks", "m", "last local maxima of the radial displacement"),
    _section("radius", "m", "radial displacement"),
    _section("radial_velocity", "m s-1", "radial velocity"),
    _section("whirl_angle", "rad", "whirl angle relative to the bit angle"),
    _section("whirl_speed", "rad s-1", "whirl speed"),
    _section("axial", "m", "bit position"),
    _section("axial_velocity", "m s-1", "axial velocity"),
    _section("twist", "rad", "twist of the string"),
    _section("bit_speed", "rad s-1", "bit speed"),
    Variable("initial_state", "f8", "", "state at the start of the run", "states", (*POINT, "state")),
    Variable("final_state", "f8", "", "state at the end of the run", "states", (*POINT, "state")),
)

TRACE_VARIABLES: tuple[Variable, ...] = tuple(
    Variable(name, "f8", units, long_name, "trace", ("time",))
    for name, units, long_name in (
        ("x", "m", "lateral position of the collar centre, x"),
        ("vx", "m s-1", "lateral velocity, x"),
        ("y", "m", "lateral position of the collar centre, y"),
        ("vy", "m s-1", "lateral velocity, y"),
        ("z", "m", "bit position above its mean cutting surface, positive up"),
        ("vz", "m s-1", "axial velocity of the bit"),
        ("twist", "rad", "twist of the string: bit angle less drive angle"),
        ("bit_speed", "rad s-1", "bit speed"),
        ("drive_angle", "rad", "drive angle at the top"),
        ("radius", "m", "radial displacement of the collar centre"),
        ("radial_velocity", "m s-1", "radial velocity of the collar centre"),
        ("whirl_angle", "rad", "whirl angle of the collar centre, unwrapped"),
        ("whirl_speed", "rad s-1", "whirl speed of the collar centre"),
        ("bit_force", "N", "force of the rock on the bit"),
        ("bit_torque", "N m", "torque of the rock on the bit"),
        ("wall_force", "N", "normal force of the wall on the collar"),
        ("wall_friction", "N", "friction force of the wall on the collar"),
        ("surface_torque", "N m", "torque at the surface"),
        ("drive_speed", "rad s-1", "top-drive speed"),
        ("wob", "N", "weight on bit"),
        ("depth", "m", "measured depth"),
    )
)
SCHEDULED = {"depth": "depth", "wob": "wob", "rotary_speed": "drive_speed"}  # where a trace has the operating values

BY_NAME = {variable.name: variable for variable in VARIABLES}
# Those that every results file has.
FEATURES = tuple(v.name for v in VARIABLES if v.room == "feature" and v.only is None)
LABELS = tuple(v.name for v in VARIABLES if v.room == "label" and v.only is None)
PEAKS = tuple(v.name for v in VARIABLES if v.room == "peaks")
SECTION = tuple(v.name for v in VARIABLES if v.room == "section")
# What the verdict on a checked point is made from, beside its response.
TRUST = ("trusted", *(f"{check}_{what}" for what in ("response", "status") for check in CHECKS))

COORDINATES: dict[str, tuple[str, str]] = {
    "procedure": ("1", "how the state was chosen: same at every point, carried up, carried down"),
    "depth": ("m", "measured depth"),
    "wob": ("N", "weight on bit"),
    "rotary_speed": ("rad s-1", "top-drive speed"),
    "peak": ("1", "peak number, oldest first"),
    "start": ("1", "number of the state from which the run began"),
    "crossing": ("1", "number of the return to the Poincare section, oldest first"),
    "state": ("1", "state name"),
    "time": ("s", "time"),
}

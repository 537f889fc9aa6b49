"""Which keys of a study a string of segments reads, by the kind of its drive."""

from __future__ import annotations

from nsdrill.models.drives import kinds

_MOTOR = ("inductance", "resistance", "torque_constant", "gear", "motor_inertia", "table_inertia", "table_damping")
_WEIGHTS = ("control_weight", "lag_weight", "drive_speed_weight", "current_weight", "twist_weight", "bit_speed_weight")
DRIVE = kinds(("inertia", "on_at"), dc_motor=(*_MOTOR, "gains", "on_at"), lqr=(*_MOTOR, *_WEIGHTS, "on_at"))

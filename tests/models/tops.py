"""Drives at the top of a string, of every kind, and a motion below one."""

GAINS = "gains: [0.03, 42.0, 2.2, -33.0, 14.0]"
SCRIPT = """
import nsdrill


@nsdrill.drive
def forgets(lag, drive_speed, set_speed, wound=0.0, *, gain=900.0, brake=1500.0, slow=50.0):
    return -gain * wound - brake * (drive_speed - set_speed), drive_speed - set_speed - wound / slow
"""
DRIVES = {
    "stiff": "kind: stiff, shaft_damping: 30 N*m*s/rad",
    "soft_torque": "kind: soft_torque",
    "equal_damping": "kind: equal_damping, torque_limit: 5 kN*m",
    "z_torque": "kind: z_torque",
    "lqr": "kind: lqr",
    "pi": "kind: pi, twist_gain: 50 N*m/rad, speed_gain: 30 N*m*s/rad, torque_limit: 5 kN*m",
    "motor": "kind: dc_motor",
    "regulated motor": f"kind: dc_motor, {GAINS}",
    "of a script": "kind: forgets",
}
MOVING = {"twist": -9.0, "bit_speed": 1.5, "lag": -0.4, "drive_speed": 5.0, "motor_torque": 3e3, "drive_wound": -0.3}

"""What models share whose collar moves in a round hole: their labels, their returns in
the frame of the bit, and the scales by which their motions are compared."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from nsdrill.models.base import Array, Model, Variant
from nsdrill.models.christoforou_yigit import compare
from nsdrill.models.christoforou_yigit.columns import STATES, axial_scale
from nsdrill.models.christoforou_yigit.observed import in_the_bit_frame
from nsdrill.models.leaves import Values
from nsdrill.models.numbers import drilled
from nsdrill.models.responses import WHIRL, Thresholds
from nsdrill.variables import BACKWARD, BACKWARD_ROLLING, FORWARD, IRREGULAR, LOW_SIDE, NO_WHIRL


class CollarInHole(Model):
    """Every string of such a model has the lane parameters of the hole, the rock and
    the set speed."""

    def labels(self, features: Mapping[str, Array], response: Array, thresholds: Thresholds) -> dict[str, Array]:
        """The ``whirl_kind``."""
        t, whirl = thresholds.whirl, response & WHIRL > 0
        ratio = np.nan_to_num(features["whirl_ratio"])
        on_wall = features["wall_contact_fraction"] >= t.rolling_contact
        rolling = (np.abs(features["rolling_ratio"] - 1.0) <= t.rolling_tolerance) & on_wall
        no_precession = np.abs(ratio) < t.direction
        low = np.zeros(whirl.shape, bool)  # whether the mean position is in the lower half
        if "y_mean" in features:  # of an inclined hole
            with np.errstate(invalid="ignore"):
                low = np.asarray(features["y_mean"] < 0.0)
        kind = np.select(
            [~whirl, rolling, no_precession & on_wall & low, no_precession, ratio > 0.0],
            [NO_WHIRL, BACKWARD_ROLLING, LOW_SIDE, IRREGULAR, FORWARD],
            default=BACKWARD,
        )
        return {"whirl_kind": kind}

    def returns(self, section: Mapping[str, Array]) -> Array:
        return in_the_bit_frame(section)

    def seen(self, state_scales: Array) -> Array:
        """Those of string and bit, without a drive or higher modes."""
        return state_scales[..., : len(STATES)]

    def still(self, features: Mapping[str, Array], state_scales: Array, absolute: float) -> Array:
        """Whether bit and collar move by no more than ``absolute`` times the natural
        scales of their states."""
        least = np.nan_to_num(features["section_radius"], nan=np.inf).min(axis=-1)
        axial, bit_speed = STATES.index("z"), STATES.index("bit_speed")
        return np.asarray(
            (features["axial_max"] - features["axial_min"] <= absolute * state_scales[..., axial])
            & (features["bit_speed_max"] - features["bit_speed_min"] <= absolute * state_scales[..., bit_speed])
            & (features["radius_max"] - least <= absolute * state_scales[..., 0])
        )

    def derived(self, features: Mapping[str, Array], points: Values) -> dict[str, Array]:
        parameters, (_, wob, speed) = points.parameters, points.operation
        torque, speed = features["surface_torque_mean"], features.get("drive_speed_mean", speed)
        return drilled(torque, speed, parameters.bit.cutting, wob, parameters.well.diameter / 2)

    def scales(self, table: Array) -> dict[str, Array]:
        """The ``gap`` [m] between collar and wall, the ``drive_speed`` [rad/s], and
        ``lobe`` [m], the amplitude of the lobed surface, or the static penetration of
        the rock where the surface has no lobes."""
        p = self.by_name(table)
        amplitude = p["surface_amplitude"]
        return {
            "gap": p["gap"],
            "drive_speed": p[self.set_speed],
            "lobe": np.where(amplitude > 0, amplitude, axial_scale(p)),
        }

    def coordinates(self, features: Mapping[str, Array], table: Array, variant: Variant) -> tuple[Array, Array]:
        p = self.by_name(table)
        speed, gap, axial = (scale[:, None] for scale in (p[self.set_speed], p["gap"], axial_scale(p)))
        scaled = compare.scaled(features, speed, gap)
        matched = [scaled * compare.WEIGHTS, compare.extent(features, speed, gap, axial)]
        return scaled, np.concatenate(matched, axis=-1)

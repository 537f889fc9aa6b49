"""What models of a string below a drive (:mod:`nsdrill.models.top`) have in common."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from nsdrill.models import motor, top
from nsdrill.models.base import Model, Symmetry
from nsdrill.models.operation import Numeric, P, Values
from nsdrill.models.responses import Thresholds


class Driven(Model[P]):
    """Twist and lag are measured from the angle of the set speed; of a drive that is not ideal a
    start may give the lag and the speed."""

    set_speed = "set_speed"
    relative = ("twist", "lag")

    def start_names(self, o: Any) -> tuple[str, ...]:
        """Those of every string: a drive has natural values unless the study gives them."""
        given = {*self.description.initial.states()} - {*top.pair_of(o)}
        return tuple(name for name in (*self.names(o).states, "drive_angle") if name in given)

    def complete_states(self, points: Values[P], values: Mapping[str, Numeric]) -> Mapping[str, Numeric]:
        """All states from those of the start; a drive begins with the set speed unless the
        study says otherwise."""
        of_drive = top.start_of(_drive_of(points))
        return {**self.initial_values(points, ("lag", "drive_speed")), **of_drive, **values}

    def symmetry(self, points: Values[P]) -> Symmetry:
        """InputError, too, where the drive holds no angle."""
        motor.check_holds(_drive_of(points), self.columns(points, Thresholds()))
        return super().symmetry(points)


def _drive_of(points: Values[Any]) -> Any:
    return points.parameters.drive

"""The robot's end of the link to a team's coordinator: the cell that it keeps to, and until when it may drive.

It keeps to one cell, the one it has *adopted*. It looks at a cell only if its number is higher than that of any it has
looked at (*decided*), and adopts it only if the segment on which it would brake lies in it, or is no farther outside
than of the present cell. It drives only within the *lease*, a time from the newest of its own stamps that was echoed.
docs/explanation/teams.md gives the reasons.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.core.half_planes import excess_m
from touchline.schemas.messages import Guidance, Whereabouts
from touchline.schemas.messages.team_messages import FIRST_CELL
from touchline.schemas.onboard import TeamLimits

Floats = NDArray[np.float64]
Segment = tuple[complex, complex]

# Distance (m) outside its cell that rounding may give to a robot at one of its sides.
_ROUNDING_M: Final = 1e-9


class CellKeeper:
    """Cell, target and lease of a guided robot.

    Attributes:
        half_planes: (k, 3) of the adopted cell; none where the robot stood at the start.
        target_m: Target, x + iy.
        until_s: Time by the robot's own clock after which it brakes.
    """

    def __init__(self, limits: TeamLimits) -> None:
        """Make a keeper without a cell, so that the robot stands."""
        self._limits = limits
        self._decided = self._adopted = FIRST_CELL
        self.half_planes: Floats = np.zeros((0, 3))
        self.target_m = 0j
        self.until_s = -math.inf

    def receive(self, guidance: Guidance, segment: Segment) -> bool:
        """Take guidance from the coordinator, in whatever order it arrives.

        Args:
            guidance: Message to this robot.
            segment: Place of the robot, and its stopping point if it braked now, x + iy (m).

        Returns:
            False if the message is ignored because it is malformed or not finite.
        """
        rows = np.array(guidance.half_planes, dtype=np.float64)
        numbers = np.append(rows, (guidance.target_x_m, guidance.target_y_m, guidance.echo_s))
        if len(rows) % 3 or not np.isfinite(numbers).all():
            return False
        self.until_s = max(self.until_s, guidance.echo_s + self._limits.lease_s)
        if guidance.number > self._decided:
            self._decided = guidance.number
            cell = rows.reshape(-1, 3)
            # A robot that is outside already, as an estimate has moved, is outside newer cells, too, which share its
            # sides.
            most_m = max(self._limits.doubt_m, _outside_m(self.half_planes, segment)) + _ROUNDING_M
            if _outside_m(cell, segment) <= most_m:
                self._adopted, self.half_planes = guidance.number, cell
                self.target_m = complex(guidance.target_x_m, guidance.target_y_m)
        return True

    def report(self, stamp_s: float, segment: Segment) -> Whereabouts:
        """Make the message to the coordinator.

        Args:
            stamp_s: Time by the robot's own clock.
            segment: As in `receive`.
        """
        here, stop = segment
        return Whereabouts(
            stamp_s=stamp_s,
            x_m=here.real,
            y_m=here.imag,
            stop_x_m=stop.real,
            stop_y_m=stop.imag,
            adopted=self._adopted,
            decided=self._decided,
        )


def _outside_m(half_planes: Floats, segment: Segment) -> float:
    """Return the distance of a segment outside a cell; negative inside."""
    return float(max(excess_m(half_planes, end) for end in segment))

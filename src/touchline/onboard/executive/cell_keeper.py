"""The robot's end of its link to a team's coordinator: which cell it keeps to, and until when it may drive.

It keeps to one cell, the one it has *adopted*; looks at a cell only if its number is higher than that of any it has
looked at (*decided*), and adopts it if the segment on which it would brake lies in it, or is no farther outside than
of the cell that it keeps to, else never; and drives only within the *lease*, a time from the newest stamp of its own
that it was echoed. docs/explanation/teams.md says why.
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

# Rounding may leave who stands at a side of its cell this far (m) beyond it.
_ROUNDING_M: Final = 1e-9


class CellKeeper:
    """See the module.

    Attributes:
        half_planes: (k, 3) of the cell that it keeps to; none where it stood at the start.
        target_m: Where it should go, x + iy.
        until_s: By its own clock; later than that it brakes.
    """

    def __init__(self, limits: TeamLimits) -> None:
        """It has no cell yet, and stands."""
        self._limits = limits
        self._decided = self._adopted = FIRST_CELL
        self.half_planes: Floats = np.zeros((0, 3))
        self.target_m = 0j
        self.until_s = -math.inf

    def receive(self, told: Guidance, segment: Segment) -> bool:
        """Take what the coordinator tells, in whatever order it comes; False if it is passed over, not being finite.

        Args:
            told: To this robot.
            segment: Where it is and where it would stand if it braked now, x + iy (m).
        """
        rows = np.array(told.half_planes, dtype=np.float64)
        numbers = np.append(rows, (told.target_x_m, told.target_y_m, told.echo_s))
        if len(rows) % 3 or not np.isfinite(numbers).all():
            return False
        self.until_s = max(self.until_s, told.echo_s + self._limits.lease_s)
        if told.number > self._decided:
            self._decided = told.number
            cell = rows.reshape(-1, 3)
            # Who is outside already, as an estimate has moved, is so in newer cells, which share its sides, too.
            most_m = max(self._limits.doubt_m, _outside_m(self.half_planes, segment)) + _ROUNDING_M
            if _outside_m(cell, segment) <= most_m:
                self._adopted, self.half_planes = told.number, cell
                self.target_m = complex(told.target_x_m, told.target_y_m)
        return True

    def say(self, stamp_s: float, segment: Segment) -> Whereabouts:
        """What to tell the coordinator.

        Args:
            stamp_s: By its own clock.
            segment: As of `receive`.
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
    """How far a segment is outside a cell; negative inside."""
    return float(max(excess_m(half_planes, end) for end in segment))

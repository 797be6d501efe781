"""Turns in place: the reference of the heading between two legs."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.onboard import tracking_state as tracking
from touchline.onboard.interface import TICK_S
from touchline.onboard.trajectory import path_projection as t
from touchline.onboard.trajectory.turn import TurnInPlace

CREEP_RADPS = 0.05
"""Lowest reference rate before the end."""
MAX_LAG_RAD = 0.2
"""Error beyond which the reference waits for the robot."""
ARRIVED_RAD = math.radians(0.3)
ARRIVED_RADPS = 0.05
PATIENCE_S = 1.5
"""Time after the reference has ended, after which the next leg has to remove the remaining error."""


class TurnLimits(NamedTuple):
    """Limits of a turn in one tick.

    Attributes:
        brake: True to brake the turn.
        harder: Factor on the planned deceleration when it is braked.
        rate_radps: Largest rate, for things in the way.
    """

    brake: bool
    harder: float = 1.0
    rate_radps: float = math.inf


class Turning:
    """A turn in progress. Its reference runs by time, so that lagging behind it shows as a heading error."""

    def __init__(self, turn: TurnInPlace, start_heading_rad: float) -> None:
        """Make a turn at its start, from an unwrapped heading.

        Args:
            turn: Angle and limits.
            start_heading_rad: Heading of the robot at the start.
        """
        self._turn = turn
        self._start_rad = start_heading_rad
        self._sign = math.copysign(1.0, turn.angle_rad)
        self._angle = abs(turn.angle_rad)
        self._done_rad = 0.0
        self._rate = 0.0
        self._waited_s = 0.0

    @property
    def moving(self) -> bool:
        """True while the reference turns."""
        return self._rate > 0.0

    @property
    def done(self) -> bool:
        """True if the reference has arrived."""
        return self._done_rad >= self._angle

    def arrived(self, now: NDArray[np.float64]) -> bool:
        """Return True if the robot has arrived, too, or its time is over; count the time of this tick."""
        if not self.done:
            return False
        self._waited_s += TICK_S
        settled = abs(now[tracking.HEADING_ERROR]) < ARRIVED_RAD and abs(now[tracking.YAW_RATE]) < ARRIVED_RADPS
        return bool(settled) or self._waited_s > PATIENCE_S

    def hold(self, heading_rad: float) -> None:
        """Restart the reference from the heading of the standing robot."""
        turned = self._sign * math.remainder(heading_rad - self._start_rad - self._sign * self._done_rad, math.tau)
        self._done_rad = min(max(self._done_rad + turned, 0.0), self._angle)
        self._rate = 0.0

    @property
    def left_rad(self) -> float:
        """Angle that the reference has still to turn, negative to the right."""
        return self._sign * (self._angle - self._done_rad)

    def step(
        self,
        heading_rad: float,
        limits: TurnLimits,
        now: NDArray[np.float64],
        ahead: NDArray[np.float64],
    ) -> None:
        """Advance the reference by a tick; fill in the errors and the path ahead, as `track` does.

        Args:
            heading_rad: Heading of the robot.
            limits: Limits of this tick.
            now: (NOW,) of `tracking_state`; its errors are filled in.
            ahead: (k, AHEAD_COLUMNS) of `path_projection`, filled in.
        """
        behind = self._sign * math.remainder(self._start_rad + self._sign * self._done_rad - heading_rad, math.tau)
        if not limits.brake and behind > MAX_LAG_RAD:
            self._rate = 0.0
        done, rate = self._done_rad, self._rate
        before = rate
        for i in range(-1, len(ahead)):
            rate = self._next_rate(done, before, limits)
            mean = 0.5 * (before + rate)
            done = min(done + mean * TICK_S, self._angle)
            if i < 0:
                self._done_rad, self._rate = done, rate
            else:
                ahead[i, t.A_SPEED] = 0.0
                ahead[i, t.A_YAW_RATE] = self._sign * mean
            before = rate
        reference = self._start_rad + self._sign * self._done_rad
        now[tracking.LATERAL] = now[tracking.NOZZLE_LATERAL] = now[tracking.REFERENCE_SPEED] = 0.0
        now[tracking.HEADING_ERROR] = math.remainder(heading_rad - reference, math.tau)

    def _next_rate(self, done: float, rate: float, limits: TurnLimits) -> float:
        step = self._turn.acceleration_radps2 * TICK_S
        left = self._angle - done
        if limits.brake:
            return max(rate - step * limits.harder, 0.0)
        if left <= 0.0:
            return 0.0
        # From this rate the rest of the tick and braking fit into the remaining angle.
        fastest = math.sqrt(2.0 * self._turn.acceleration_radps2 * left + 0.25 * step * step) - 0.5 * step
        return min(rate + step, self._turn.rate_radps, max(fastest, CREEP_RADPS), limits.rate_radps)

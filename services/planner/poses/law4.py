"""The speed law of a student report on a network of TurtleBots, with two of its faults corrected."""

import math
from typing import Final, NamedTuple

import numpy as np

from touchline.services.planner.geometry.clothoid import Floats, PiecePath
from touchline.services.planner.limits import Limits
from touchline.services.planner.speed.timing import SpeedProfile

STEP_S: Final = 0.1
SLOW_MPS, FAST_MPS, GAIN_MPS2 = 0.2, 0.5, 0.5
DEAD_BAND_RADPS: Final = 0.05
ARRIVED_M: Final = 0.01
"""So near to the goal it counts as there: p·d creeps, and comes to the goal itself never."""


class Law4(NamedTuple):
    """v = v_min while it turns, else min(v_prev + a·Δt, v_max, p·d), with d the distance to the goal.

    As printed it turns where v_angular > 0, which right turns are not; and α is added, a speed per step. Here it turns
    where |ω| is beyond a dead band, and α is an acceleration times the step. All else is kept: no look ahead, speeds
    that step, and a goal that is passed with what p·d or v_min leave.

    Attributes:
        gain_1ps: p.
    """

    gain_1ps: float

    def speeds(self, path: PiecePath, arrived_m: float = ARRIVED_M, entry_mps: float = 0.0) -> Floats:
        """Speeds, one for each control step, until the goal is near along the path.

        Args:
            path: That is driven.
            arrived_m: What is near.
            entry_mps: At which it begins (m/s).

        Returns:
            (n,) m/s, the first one that at which it begins.
        """
        ends = np.cumsum([piece.length_m for piece in path.pieces])
        bent = [abs(piece.curvature_1pm) for piece in path.pieces]
        whole, goal = float(ends[-1]), path.end.point
        station, speed = 0.0, entry_mps
        driven = [speed]
        while whole - station > arrived_m:
            turning = SLOW_MPS * bent[int(np.searchsorted(ends, station, side="right"))] > DEAD_BAND_RADPS
            x, y, _, _ = path.sample(np.array([station]))
            distance = math.hypot(goal.real - x[0], goal.imag - y[0])
            speed = SLOW_MPS if turning else min(speed + GAIN_MPS2 * STEP_S, FAST_MPS, self.gain_1ps * distance)
            station += STEP_S * speed
            driven.append(speed)
        return np.array(driven)

    def profile(self, path: PiecePath, braking_m: float, limits: Limits, entry_mps: float = 0.0) -> SpeedProfile:
        """The law as a trajectory, which ends at rest: when the goal is near the robot brakes.

        Args:
            path: That is driven; longer than `braking_m`.
            braking_m: From so near to the goal on it brakes.
            limits: By whose acceleration, or harder if it would not come to rest before the goal.
            entry_mps: At which it begins (m/s).

        Returns:
            Entries at the ends of the control steps; the last one tells where the robot comes to rest.
        """
        speeds = self.speeds(path, braking_m, entry_mps)
        stations = STEP_S * np.concatenate(([0.0], np.cumsum(speeds[1:])))
        rest_m = min(stations[-1] + limits.stopping_distance_m(float(speeds[-1])), path.length_m)
        return SpeedProfile(np.append(stations, rest_m), np.append(speeds, 0.0))

"""Speed law of a student report on a network of TurtleBots, with two of its faults corrected."""

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
"""Distance at which the goal counts as reached: with p·d the robot creeps, and never reaches it exactly."""


class Law4(NamedTuple):
    """Law v = v_min in turns, else min(v_prev + a·Δt, v_max, p·d), with d the distance to the goal.

    As printed, a turn is v_angular > 0, which misses right turns; and α is added, a speed per step. Here a turn is |ω|
    beyond a dead band, and α is an acceleration times the step. All else is kept: no lookahead, speeds that step, and a
    goal that is passed at the speed of p·d or v_min.

    Attributes:
        gain_1ps: Gain p (1/s).
    """

    gain_1ps: float

    def speeds(self, path: PiecePath, arrived_m: float = ARRIVED_M, entry_mps: float = 0.0) -> Floats:
        """Simulate the law until the goal is near along the path.

        Args:
            path: Path to drive.
            arrived_m: Distance from the goal that counts as near.
            entry_mps: Initial speed (m/s).

        Returns:
            (n,) speed (m/s) at each control step, the initial one first.
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
        """Convert the law to a profile that ends at rest: when the goal is near the robot brakes.

        Args:
            path: Path to drive; longer than `braking_m`.
            braking_m: Distance from the goal at which braking begins.
            limits: Limits with the deceleration, which is exceeded if the robot would overshoot the goal.
            entry_mps: Initial speed (m/s).

        Returns:
            Profile with entries at the ends of the control steps; the robot rests at the last one.
        """
        speeds = self.speeds(path, braking_m, entry_mps)
        stations = STEP_S * np.concatenate(([0.0], np.cumsum(speeds[1:])))
        rest_m = min(stations[-1] + limits.stopping_distance_m(float(speeds[-1])), path.length_m)
        return SpeedProfile(np.append(stations, rest_m), np.append(speeds, 0.0))

"""Body twist to wheel speeds within the wheels' limits."""

from __future__ import annotations

from schemas.vehicle import Vehicle
from services.robot_sim.frames import TICK_S

MAX_LEAD_TICKS = 14


def lead_ticks(vehicle: Vehicle) -> int:
    """How many ticks ahead of time a steadily changing speed must be commanded to come true: the motors' lag.

    The mean of that tick, not its start, is what its command stands for: that makes up for the command being held.
    """
    return min(round(vehicle.motor_time_constant_s / TICK_S), MAX_LEAD_TICKS)


class Wheels:
    """Differential drive, inverse kinematics and limits."""

    def __init__(self, vehicle: Vehicle) -> None:
        """The limits of this vehicle."""
        self._half_track_m = vehicle.half_track_m
        self._max_radps = vehicle.max_wheel_speed_radps
        # A first-order motor accelerates by (command − speed) / lag.
        self._reach_radps = vehicle.max_wheel_acceleration_radps2 * max(vehicle.motor_time_constant_s, TICK_S)

    def command(
        self, wanted: tuple[float, float], actual: tuple[float, float], radii_m: tuple[float, float]
    ) -> tuple[float, float]:
        """Wheel speeds (left, right) [rad/s] for a wanted twist (m/s, rad/s), given the actual one.

        Too fast is scaled down with the curvature kept; too sudden for the wheels is cut off.
        """
        left, right = self._wheels(wanted, radii_m)
        fastest = max(abs(left), abs(right))
        if fastest > self._max_radps:
            left, right = left * self._max_radps / fastest, right * self._max_radps / fastest
        turning = self._wheels(actual, radii_m)
        return self._within_reach(left, turning[0]), self._within_reach(right, turning[1])

    def _wheels(self, twist: tuple[float, float], radii_m: tuple[float, float]) -> tuple[float, float]:
        rim = self._half_track_m * twist[1]
        return (twist[0] - rim) / radii_m[0], (twist[0] + rim) / radii_m[1]

    def _within_reach(self, wanted: float, turning: float) -> float:
        near = min(max(wanted, turning - self._reach_radps), turning + self._reach_radps)
        return min(max(near, -self._max_radps), self._max_radps)

"""A follower that steers by the nozzle's distance from its line, and its comparison with the shipped ones."""

from typing import NamedTuple

import touchline
from touchline import FollowerAhead, FollowerState

__all__ = ["Comparison", "LineKeeper", "compared"]


class LineKeeper:
    """Follower by the nozzle's lateral distance and the heading error.

    Args:
        length_m: Distance in which an error fades.
        delay_ticks: Delay of the drive, in ticks of 10 ms, by which the reference is read ahead.
    """

    def __init__(self, length_m: float = 0.4, delay_ticks: int = 5) -> None:
        self.length_m, self.delay_ticks = length_m, delay_ticks

    def __call__(self, state: FollowerState, ahead: FollowerAhead) -> tuple[float, float]:
        """Speed (m/s) and yaw rate (rad/s) of the next tick."""
        speed_mps = float(ahead.speed_mps[self.delay_ticks])
        correction = state.nozzle_lateral_m / self.length_m + 2.0 * state.heading_error_rad
        yaw_rate_radps = float(ahead.yaw_rate_radps[self.delay_ticks]) - abs(speed_mps) * correction / self.length_m
        return speed_mps, yaw_rate_radps


class Comparison(NamedTuple):
    """Mean distance of the nozzle from its line while it marks, in truth."""

    own_m: float
    shipped_m: dict[str, float]


def compared(template: str, own: LineKeeper, shipped: tuple[str, ...] = ("mpc", "pure-pursuit")) -> Comparison:
    """Drive a template by the own follower and by shipped ones, with the same noise."""
    plan = touchline.plan(template)
    errors_m = {name: touchline.simulate(plan, seed=3, follower=name).errors()["lateral_mean_m"] for name in shipped}
    return Comparison(touchline.simulate(plan, seed=3, follower=own).errors()["lateral_mean_m"], errors_m)

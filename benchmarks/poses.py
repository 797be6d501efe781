"""Paths to poses: limits at every millisecond, free headings, and speed; `touchline study tracking` has their times."""

import math
import time

import numpy as np

from touchline.schemas.errors import PlanningError
from touchline.schemas.messages import PlanOptions, PoseGoal
from touchline.schemas.plugins import SPEED_LAWS
from touchline.schemas.vehicles.shipped import TURTLEBOT3_WAFFLE_PI
from touchline.services.core.jit import kernel
from touchline.services.planner.geometry.clothoid import Floats
from touchline.services.planner.goal_plan import plan_to_goal
from touchline.services.planner.plan import Plan
from touchline.services.planner.poses.cubic_path import CubicPath
from touchline.services.planner.poses.kernels.free_heading import shortest_lengths
from touchline.services.planner.steering.plain_words import plain_word
from touchline.services.study.tracking.studied_robot import ORIGIN, WAFFLE, goals_anywhere


def main() -> None:
    """Print all figures."""
    _quickness()
    _limits()
    _free_headings()


def _quickness() -> None:
    goals = goals_anywhere(500)
    took = []
    for goal in goals:
        begin = time.perf_counter()
        found = CubicPath().between(ORIGIN, goal, WAFFLE)
        took.append((time.perf_counter() - begin, bool(found.progress)))
    curves = [1e3 * seconds for seconds, cubic in took if cubic]
    falls = [1e3 * seconds for seconds, cubic in took if not cubic]
    print(f"a cubic path: median {np.median(curves):.2f} ms, 95 % {np.percentile(curves, 95):.2f} ms;")
    print(f"  by g2 instead {np.median(falls):.2f} ms, for {len(falls) / len(took):.0%}")


def _limits() -> None:
    goals, options = goals_anywhere(1000), PlanOptions(start=ORIGIN)
    print("1,000 goals, cubic method, at every millisecond: largest share of each limit")
    for law in SPEED_LAWS.names():
        worst, refused = np.zeros(4), 0
        for goal in goals:
            asked = PoseGoal(x_m=goal.x_m, y_m=goal.y_m, heading_rad=goal.heading_rad, method="cubic", law=law)
            try:
                worst = np.maximum(worst, _shares(plan_to_goal(asked, TURTLEBOT3_WAFFLE_PI, options)))
            except PlanningError:
                refused += 1
        told = ", ".join(f"{name} {share:.4f}" for name, share in zip(_SHARES, worst, strict=True))
        print(f"  {law:8} {told}; {refused} refused")


_SHARES = ("speed", "yaw rate", "wheels", "along")


def _shares(planned: Plan) -> Floats:
    """(4,) the largest share of its limit of speed, yaw rate, a wheel's speed and acceleration along the path."""
    drive, limits, speeds = TURTLEBOT3_WAFFLE_PI.drive, planned.limits, planned.speeds
    station = np.arange(0.0, speeds.station_m[-1], 1e-3 * limits.transit_speed_mps)
    speed = speeds.speed_at(station)
    ends = np.array([each.end_m for each in planned.sent])
    bent = np.array([abs(each.curve.curvature_1pm) for each in planned.sent])
    yaw = speed * bent[np.searchsorted(ends, station)]
    spins = [abs(spin.rate_radps) for spin in speeds.spins]
    yaw_most = max(float(yaw.max()), *spins) if spins else float(yaw.max())
    rim = max(float((speed + drive.half_track_m * yaw).max()), drive.half_track_m * max(spins, default=0.0))
    gain = np.abs(np.diff(np.square(speeds.speed_mps))) / (2.0 * np.diff(speeds.station_m))
    return np.array(
        (
            speed.max() / limits.transit_speed_mps,
            yaw_most / drive.max_yaw_rate_radps,
            rim / drive.max_speed_mps,
            gain.max() / limits.acceleration_mps2,
        )
    )


@kernel
def _longest_excess(goals: Floats, headings: int, found: Floats) -> float:
    """By how much (radii) a free heading's path is longer than with the best of some headings, at most."""
    word, worst = np.empty(3), -math.inf
    for i in range(len(goals)):
        for k in range(headings):
            length, _ = plain_word(goals[i, 0], goals[i, 1], 2.0 * math.pi * k / headings, 1.0, word)
            worst = max(worst, found[i, 0] - length)
    return worst


def _free_headings() -> None:
    rng = np.random.default_rng(8)
    goals = rng.uniform(-4.0, 4.0, (1_000_000, 2))
    shortest_lengths(goals[:2], 1.0)
    begin = time.perf_counter()
    found = shortest_lengths(goals, 1.0)
    took = time.perf_counter() - begin
    excess = _longest_excess(goals, 16, found)
    print(f"1,000,000 free headings in {took:.2f} s; longer than any of 16 headings by {excess:.1e} radii at most")
    gaps, word = [], np.empty(3)
    for (x, y), (length, heading) in zip(goals[:1000].tolist(), found[:1000].tolist(), strict=True):
        sampled = min(plain_word(x, y, a, 1.0, word)[0] for a in np.linspace(0.0, 2.0 * math.pi, 721))
        own = plain_word(x, y, heading, 1.0, word)[0]
        gaps.append((abs(own - length), length - min(own, sampled)))
    worst = np.max(gaps, axis=0)
    print(f"  1,000 of them: {worst[0]:.1e} off Dubins' word to their own heading, {worst[1]:.1e} over 722 headings")

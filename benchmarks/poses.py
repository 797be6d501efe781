"""Paths to poses: limits at every millisecond, free headings, and speed; `touchline study tracking` has their times.

`python -m benchmarks poses`; `goals` are planned to, with `headings` of them free.
"""

import math
import time
from collections.abc import Sequence

import numpy as np

from benchmarks._settings import Small
from touchline.core.jit import kernel
from touchline.schemas.errors import PlanningError
from touchline.schemas.messages import PlanOptions, PoseGoal
from touchline.schemas.plugins import SPEED_LAWS
from touchline.schemas.vehicles.shipped import TURTLEBOT3_WAFFLE_PI
from touchline.services.planner.geometry.clothoid import Floats, PathPose
from touchline.services.planner.goal_plan import plan_to_goal
from touchline.services.planner.plan import Plan
from touchline.services.planner.poses.cubic_path import CubicPath
from touchline.services.planner.poses.kernels.free_heading import shortest_lengths
from touchline.services.planner.steering.plain_words import plain_word
from touchline_research.tracking.studied_robot import ORIGIN, WAFFLE, goals_anywhere

SMALL = Small(
    {"goals": 20, "headings": 1000},
    (
        "a cubic path: median # ms, # % # ms;",
        "by g2 instead # ms, for #%",
        "# goals, cubic method, at every millisecond: largest share of each limit",
        *(f"{law} speed #, yaw rate #, wheels #, along #; # refused" for law in SPEED_LAWS.names()),
        "# free headings in # s; longer than any of # headings by # radii at most",
        "# of them: # off Dubins' word to their own heading, # over # headings",
    ),
)
CHECKED = 1000


def main(goals: int = 1000, headings: int = 1_000_000) -> None:
    """Run the benchmark, and print its figures."""
    _quickness(goals_anywhere(goals))
    _limits(goals_anywhere(goals))
    _free_headings(headings)


def _quickness(goals: Sequence[PathPose]) -> None:
    took = []
    for goal in goals:
        begin = time.perf_counter()
        found = CubicPath().between(ORIGIN, goal, WAFFLE)
        took.append((time.perf_counter() - begin, bool(found.progress)))
    curves = [1e3 * seconds for seconds, cubic in took if cubic]
    falls = [1e3 * seconds for seconds, cubic in took if not cubic]
    print(f"a cubic path: median {np.median(curves):.2f} ms, 95 % {np.percentile(curves, 95):.2f} ms;")
    instead = f"{np.median(falls):.2f} ms, for {len(falls) / len(took):.0%}" if falls else "never"
    print(f"  by g2 instead {instead}")


def _limits(goals: Sequence[PathPose]) -> None:
    options = PlanOptions(start=ORIGIN)
    print(f"{len(goals):,} goals, cubic method, at every millisecond: largest share of each limit")
    for law in SPEED_LAWS.names():
        worst, refused = np.zeros(4), 0
        for goal in goals:
            asked = PoseGoal(x_m=goal.x_m, y_m=goal.y_m, heading_rad=goal.heading_rad, method="cubic", law=law)
            try:
                worst = np.maximum(worst, _shares(plan_to_goal(asked, TURTLEBOT3_WAFFLE_PI, options)))
            except PlanningError:
                refused += 1
        shares = ", ".join(f"{name} {share:.4f}" for name, share in zip(_SHARES, worst, strict=True))
        print(f"  {law:8} {shares}; {refused} refused")


_SHARES = ("speed", "yaw rate", "wheels", "along")


def _shares(planned: Plan) -> Floats:
    """Maximum fractions (4,) of the limits of speed, yaw rate, wheel speed and acceleration along the path."""
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
    """Maximum excess length (radii) of free-heading paths over those with the best of some headings."""
    word, worst = np.empty(3), -math.inf
    for i in range(len(goals)):
        for k in range(headings):
            length, _ = plain_word(goals[i, 0], goals[i, 1], 2.0 * math.pi * k / headings, 1.0, word)
            worst = max(worst, found[i, 0] - length)
    return worst


def _free_headings(count: int) -> None:
    rng = np.random.default_rng(8)
    goals = rng.uniform(-4.0, 4.0, (count, 2))
    shortest_lengths(goals[:2], 1.0)
    begin = time.perf_counter()
    found = shortest_lengths(goals, 1.0)
    took = time.perf_counter() - begin
    excess = _longest_excess(goals, 16, found)
    print(f"{count:,} free headings in {took:.2f} s; longer than any of 16 headings by {excess:.1e} radii at most")
    gaps, word = [], np.empty(3)
    for (x, y), (length, heading) in zip(goals[:CHECKED].tolist(), found[:CHECKED].tolist(), strict=True):
        sampled = min(plain_word(x, y, a, 1.0, word)[0] for a in np.linspace(0.0, 2.0 * math.pi, 721))
        own = plain_word(x, y, heading, 1.0, word)[0]
        gaps.append((abs(own - length), length - min(own, sampled)))
    worst = np.max(gaps, axis=0)
    off = f"{worst[0]:.1e} off Dubins' word to their own heading, {worst[1]:.1e} over 722 headings"
    print(f"  {len(gaps):,} of them: {off}")

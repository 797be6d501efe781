"""Paths to poses: limits at every millisecond, and speed; `touchline study tracking` has their times.

`python -m benchmarks poses`; `goals` are planned to.
"""

import time
from collections.abc import Sequence

import numpy as np

from benchmarks._settings import Small
from touchline.schemas.errors import PlanningError
from touchline.schemas.messages import PlanOptions, PoseGoal
from touchline.schemas.plugins import SPEED_LAWS
from touchline.schemas.vehicles.shipped import TURTLEBOT3_WAFFLE_PI
from touchline.services.planner.geometry.clothoid import Floats, PathPose
from touchline.services.planner.goal_plan import plan_to_goal
from touchline.services.planner.plan import Plan
from touchline.services.planner.poses.cubic_path import CubicPath
from touchline_research.tracking.studied_robot import ORIGIN, WAFFLE, goals_anywhere

SMALL = Small(
    {"goals": 20},
    (
        "a cubic path: median # ms, # % # ms;",
        "by g2 instead # ms, for #%",
        "# goals, cubic method, at every millisecond: largest share of each limit",
        *(f"{law} speed #, yaw rate #, wheels #, along #; # refused" for law in SPEED_LAWS.names()),
    ),
)


def main(goals: int = 1000) -> None:
    """Run the benchmark, and print its figures."""
    _quickness(goals_anywhere(goals))
    _limits(goals_anywhere(goals))


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

"""A team as in the study: each robot on its own Dubins path to its next goal, whoever is in the way.

A robot takes its next goal when it has come to rest at the last, or stands off the one that it has now: to spread, the
centroid of its Voronoi cell. Speeds are by the study's law; the robot brakes when the goal is near, as one that stands
alone takes another path.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.schemas.errors import CommandRefused
from touchline.schemas.messages import PlanOptions, Trajectory
from touchline.schemas.team import TeamScenario
from touchline.schemas.vehicles import Vehicle
from touchline.services.fleet.tasks import ARRIVED_M, Deploy, TeamTask
from touchline.services.planner.geometry.clothoid import PathPose, PiecePath
from touchline.services.planner.plan import finished
from touchline.services.planner.poses.law4 import Law4
from touchline.services.planner.poses.shipped_methods import BEARING, DUBINS_FREE
from touchline.services.planner.poses.traveller import Traveller
from touchline.services.planner.route.worked_route import WorkedRoute
from touchline.services.planner.segments.section import TRANSITION, Section
from touchline.services.planner.segments.sent_segments import send
from touchline.services.robot_sim.emulator import Taking
from touchline.services.runs.team.team_guide import BelievedApart
from touchline.services.runs.team.team_robot import TeamRobot

Floats = NDArray[np.float64]

RADIUS_M: Final = 0.3
LAW: Final = Law4(gain_1ps=1.0)
BRAKING_M: Final = 0.07
"""So near to the goal the robot brakes: from 0.2 m/s it comes to rest within 3 cm of it."""


class StudyDriver:
    """Plans paths of the study for one kind of robot."""

    def __init__(self, vehicle: Vehicle, *, free: bool) -> None:
        """To goals without a heading.

        Args:
            vehicle: That drives.
            free: Whether the heading is free; else it is the bearing.

        Raises:
            PlanningError: The vehicle cannot turn so tightly.
        """
        self._vehicle = vehicle
        self._traveller = Traveller.of(vehicle, PlanOptions(kappa_max_1pm=1.0 / RADIUS_M))
        self._method = DUBINS_FREE if free else BEARING

    def trajectory(self, start: PathPose, goal: Floats) -> Trajectory:
        """The way to a goal, from rest to rest.

        Args:
            start: Where the robot stands.
            goal: (2,) m, farther than BRAKING_M away.

        Raises:
            PlanningError: There is none.
        """
        limits = self._traveller.limits
        path = self._method.between(start, PathPose(float(goal[0]), float(goal[1]), math.nan), self._traveller).path
        speeds = LAW.profile(path, BRAKING_M, limits.acceleration_mps2)
        sections = [Section(TRANSITION, _until(path, float(speeds.station_m[-1])))]
        sent = send(sections, lambda done: None, curvature_max_1pm=limits.drive.curvature_max_1pm)
        return finished(WorkedRoute(sections), sent, [], speeds, self._vehicle, limits).trajectory


def _until(path: PiecePath, end_m: float) -> PiecePath:
    """A path up to an arc length."""
    last = path.index_at(end_m)
    piece = path.pieces[last]._replace(length_m=end_m - path.stations[last])
    return PiecePath(path.start, (*path.pieces[:last], piece))


class PathGuide:
    """See `TeamGuide`."""

    def __init__(self, team: TeamScenario, robots: Mapping[str, TeamRobot]) -> None:
        """Robots stand.

        Raises:
            PlanningError: Such a robot cannot drive like this.
        """
        self._robots, self._update_ticks = robots, round(100 * team.update_s)
        self._driver = StudyDriver(team.vehicle, free=team.path == "free")
        self._task: TeamTask | None = None
        self.believed = BelievedApart()

    @property
    def step_ticks(self) -> int:
        """See `TeamGuide`."""
        return self._update_ticks

    def places(self) -> dict[str, tuple[float, float]]:
        """See `TeamGuide`."""
        estimates = {name: robot.emulator.onboard.estimate for name, robot in self._robots.items()}
        known = {name for name, robot in self._robots.items() if robot.emulator.onboard.aligned}
        return {name: (at[0], at[1]) for name, at in estimates.items() if name in known}

    def begin(self, task: TeamTask, tick: int) -> None:
        """See `TeamGuide`."""
        self._task = task

    def talk(self, tick: int, *, update: bool) -> None:
        """See `TeamGuide`."""
        waiting = [name for name, robot in self._robots.items() if not robot.emulator.active]
        if not waiting:
            return
        goals = self._goals()
        for name in waiting:
            self._send_off(self._robots[name], goals[name])

    def _goals(self) -> dict[str, Floats]:
        """Where each robot shall go, from where all believe to be (m)."""
        assert self._task is not None, "it has begun"
        names = list(self._robots)
        places = np.array([self._robots[name].emulator.onboard.estimate[:2] for name in names])
        task = self._task
        goals = task.centroids(places) if isinstance(task, Deploy) else task.goals(names, places)
        return dict(zip(names, goals, strict=True))

    def _send_off(self, robot: TeamRobot, goal: Floats) -> None:
        """Let a standing robot drive to its goal, if it is not there and can."""
        emulator = robot.emulator
        start = PathPose(*emulator.onboard.estimate[:3])
        if abs(complex(*goal) - start.point) <= ARRIVED_M:
            return
        try:
            emulator.load(self._driver.trajectory(start, goal), taking=Taking.HERE)
        except CommandRefused:
            return  # it does not know where it is for now, or has stopped for good: its status tells
        emulator.start()

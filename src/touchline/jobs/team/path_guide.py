"""Team as in the study: each robot on its own Dubins path to its next goal, without collision avoidance.

A robot takes its next goal when it is near to the last, without a stop if its computer takes the path while driving;
to spread, that is the centroid of its Voronoi cell. If it is there already, it comes to rest and stays until its goal
has moved away. Speeds are by the study's law.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import Final, NamedTuple, Self

import numpy as np

from touchline.coordination.free_area import FreeArea
from touchline.coordination.interventions import Interventions
from touchline.coordination.tasks import ARRIVED_M, TeamTask, task_of
from touchline.jobs.team.team_guide import BelievedApart, Place, run_over
from touchline.jobs.team.team_robot import TeamRobot
from touchline.schemas.errors import CommandRefused, SpecError
from touchline.schemas.messages import LeavingTrajectory, PlanOptions, Trajectory, TraversalStatus
from touchline.schemas.task_requests import DispatchTask
from touchline.schemas.team import TeamScenario
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.driven_part import DrivenPart
from touchline.services.planner.geometry.clothoid import PathPose, PiecePath
from touchline.services.planner.plan import finished
from touchline.services.planner.poses.law4 import FAST_MPS, Law4
from touchline.services.planner.poses.shipped_methods import BEARING, DUBINS_FREE
from touchline.services.planner.poses.traveller import Traveller
from touchline.services.planner.route.worked_route import WorkedRoute
from touchline.services.planner.running_leg import RunningLeg
from touchline.services.planner.segments.section import TRANSITION, Section
from touchline.services.planner.segments.sent_segments import send
from touchline.services.robot_sim.loaded_job import Taking

RADIUS_M: Final = 0.3
LAW: Final = Law4(gain_1ps=1.0)
BRAKING_M: Final = 0.06
"""Braking distance at a goal without successor: from 0.2 m/s it comes to rest within 2 cm of it."""
LOOKING_TICKS: Final = 10
"""Ticks between looks at robots: the study's control rate."""
KEEP_S: Final = 0.6
"""Time for which a robot that takes another path while driving keeps to the last one: its computer asks for 0.3 s, and
evens out what is just behind that, too.
"""
LEAVING_M: Final = 0.07
"""Distance before its end at which a path is left for another one: within ARRIVED_M of the goal."""
OVER_M: Final = 0.01
"""Distance from its end below which a path is not left: the robot comes to rest first."""


class Departure(NamedTuple):
    """Start of a robot's next path: where it stands, or on its last path.

    Attributes:
        pose: The pose there.
        speed_mps: The speed there.
        kept: What it drives until then, unless it stands.
    """

    pose: PathPose
    speed_mps: float = 0.0
    kept: DrivenPart | None = None

    @classmethod
    def under_way(cls, leaving: LeavingTrajectory) -> Self:
        """Create the departure of a driving robot."""
        leg = RunningLeg.of(leaving)
        kept, _ = leg.kept(leaving)
        pose, _, speed_mps = leg.end_of(kept)
        return cls(pose, speed_mps, kept)

    def is_off(self, goal: Place) -> bool:
        """Return whether a goal (m) is not reached there."""
        return abs(complex(*goal) - self.pose.point) > ARRIVED_M


class StudyDriver:
    """Planner of the study's paths for one kind of robot."""

    def __init__(self, vehicle: Vehicle, *, free: bool) -> None:
        """Plan to goals without a heading.

        Args:
            vehicle: The vehicle.
            free: Whether the heading is free; else it is the bearing.

        Raises:
            PlanningError: The vehicle cannot turn so tightly.
            SpecError: It is too slow.
        """
        fastest_mps = vehicle.drive.transit_speed_mps
        if fastest_mps < FAST_MPS:
            problem = f"is {fastest_mps:g} m/s, less than the {FAST_MPS:g} m/s of the study's law"
            raise SpecError("vehicle", "drive.transit_speed_mps", problem, "give a faster vehicle, or avoid: cells")
        self._vehicle = vehicle
        self._traveller = Traveller.of(vehicle, PlanOptions(kappa_max_1pm=1.0 / RADIUS_M))
        self._method = DUBINS_FREE if free else BEARING

    def trajectory(self, departure: Departure, goal: Place) -> Trajectory:
        """Plan to a goal (m) that is not reached yet; the path ends at rest.

        Raises:
            PlanningError: There is no path.
        """
        limits = self._traveller.limits
        path = self._method.between(departure.pose, PathPose(*goal, math.nan), self._traveller).path
        speeds = LAW.profile(path, BRAKING_M, limits, departure.speed_mps)
        sections = [Section(TRANSITION, _until(path, float(speeds.station_m[-1])))]
        sent = send(sections, lambda done: None, curvature_max_1pm=limits.drive.curvature_max_1pm)
        ideal_m, sent_m = ([0.0, *ends] for ends in ([each.ideal_to_m for each in sent], [each.end_m for each in sent]))
        part = DrivenPart(sections, sent, replace(speeds, station_m=np.interp(speeds.station_m, ideal_m, sent_m)))
        if departure.kept is not None:
            part = departure.kept.then(part)
        return finished(WorkedRoute(part.sections), part.sent, [], part.speeds, self._vehicle, limits).trajectory


def _until(path: PiecePath, end_m: float) -> PiecePath:
    """Return a path up to an arc length."""
    last = path.index_at(end_m)
    piece = path.pieces[last]._replace(length_m=end_m - path.stations[last])
    return PiecePath(path.start, (*path.pieces[:last], piece))


class PathGuide:
    """Guide of a team along the study's paths."""

    def __init__(self, team: TeamScenario, area: FreeArea, robots: Mapping[str, TeamRobot]) -> None:
        """Guide robots that stand.

        Raises:
            PlanningError: Such a robot cannot turn like this.
            SpecError: It is too slow.
        """
        self._robots = robots
        self._driver = StudyDriver(team.vehicle, free=team.path == "free")
        self._team, self._area = team, area
        self._task: TeamTask | None = None
        self._begun_tick = 0
        self._driven: dict[str, Trajectory] = {}
        self.believed, self.interventions, self.problem = BelievedApart(), Interventions(), ""

    @property
    def step_ticks(self) -> int:
        """Ticks until the next exchange, as of `TeamGuide`."""
        return LOOKING_TICKS

    @property
    def task(self) -> TeamTask | None:
        """The team's task, as of `TeamGuide`."""
        return self._task

    @property
    def waits_for(self) -> tuple[str, ...]:
        """Return robots that are not localized, as of `TeamGuide`."""
        return tuple(name for name, robot in self._robots.items() if not robot.emulator.onboard.aligned)

    def _places(self) -> dict[str, Place]:
        """Return where each robot believes to be (m)."""
        return {name: _pose(robot)[:2] for name, robot in self._robots.items()}

    def finished(self, tick: int) -> bool:
        """Return whether the run is over, as of `TeamGuide`."""
        return run_over(self._team, self._task, tick - self._begun_tick, self._places())

    def blockage(self, name: str) -> str:
        """Return why a robot does not arrive, as of `TeamGuide`."""
        return ""

    def talk(self, tick: int, awake: Collection[str]) -> bool:
        """Send robots to their next goals, as of `TeamGuide`."""
        if tick % round(100 * self._team.update_s) == 0 and self._task is None and not self.waits_for:
            team, self._begun_tick = self._team, tick
            assert not isinstance(team.task, DispatchTask), "nobody dispatches robots that avoid nobody"
            self._task = task_of(team.task, self._area, self._places(), team.radius_m)
        if self._task is None:
            return False
        self._send_on(awake)
        return (tick - self._begun_tick) % round(100 * self._team.update_s) == 0

    def _send_on(self, awake: Collection[str]) -> None:
        """Give robots near the end of their paths the next one."""
        found = {name: self._departure(name) for name in awake}
        departures = {name: each for name, each in found.items() if each is not None}
        if not departures:
            return
        goals = self._goals(departures)
        for name, departure in departures.items():
            if departure.is_off(goals[name]):
                self._send_off(name, self._driver.trajectory(departure, goals[name]))

    def _departure(self, name: str) -> Departure | None:
        """Return where a robot can take another path, if it stands or is near the end of the last."""
        emulator = self._robots[name].emulator
        if emulator.onboard.state != TraversalStatus.RUNNING:
            return None if emulator.active else Departure(_pose(self._robots[name]))
        status = emulator.onboard.status
        speed_mps, at_m = emulator.onboard.estimate[3], status.arc_length_m
        if not OVER_M < status.total_length_m - at_m <= LEAVING_M + KEEP_S * speed_mps:
            return None
        return Departure.under_way(LeavingTrajectory(trajectory=self._driven[name], arc_length_m=at_m, keep_s=KEEP_S))

    def _goals(self, departures: Mapping[str, Departure]) -> dict[str, Place]:
        """Return each robot's goal, from where some depart and the others believe to be (m)."""
        assert self._task is not None, "it has begun"
        task, names = self._task, list(self._robots)
        poses = [departures[name].pose if name in departures else _pose(self._robots[name]) for name in names]
        places = np.array([pose[:2] for pose in poses])
        goals = task.coverage.deployment(places).centroids if task.coverage else task.goals(names, places)
        return {name: (x, y) for name, (x, y) in zip(names, goals.tolist(), strict=True)}

    def _send_off(self, name: str, trajectory: Trajectory) -> None:
        """Let a robot drive, if it can."""
        emulator = self._robots[name].emulator
        under_way = emulator.onboard.state == TraversalStatus.RUNNING
        try:
            emulator.load(trajectory, taking=Taking.UNDER_WAY if under_way else Taking.HERE)
        except CommandRefused:
            return  # its computer wants it to stand first, or is not localized, or has stopped it for good
        self._driven[name] = trajectory
        if not under_way:
            emulator.start()


def _pose(robot: TeamRobot) -> PathPose:
    """Return where a robot believes to be."""
    return PathPose(*robot.emulator.onboard.estimate[:3])

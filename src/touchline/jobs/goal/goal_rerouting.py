"""Drives of an emulated robot to its goal, in one process: each way is planned as soon as it is asked for."""

from __future__ import annotations

from collections.abc import Callable

from touchline.jobs.single.simulation import GivenDrive
from touchline.schemas.errors import PlanningError
from touchline.schemas.known_ground import KnownGround
from touchline.schemas.messages import PlanOptions, PoseGoal
from touchline.services.planner.goal_plan import plan_to_goal
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.goal_way.goal_pursuit import GoalPursuit
from touchline.services.robot_sim.goal_way.seen_ground import SeenGround
from touchline.services.robot_sim.goal_way.way_request import ChosenWay, PlannedWay, Planning, Result, WayRequest
from touchline.services.robot_sim.loaded_job import Taking


class GoalRerouting:
    """Drives of a robot to one goal, as `Rerouting` asks for them.

    Args:
        emulator: The robot, with a lidar.
        goal: The goal.
        options: Planning options without a start.
        ground: Ground that is known.
    """

    def __init__(self, emulator: Emulator, goal: PoseGoal, options: PlanOptions, ground: KnownGround) -> None:
        self._vehicle, self._job = emulator.vehicle, GoalPursuit(emulator, goal, options, SeenGround(ground))

    @property
    def driven_s(self) -> float:
        """Time for which the robot had been under way before the present drive."""
        return self._job.driven_s

    def begins(self, drive: GivenDrive, told: Callable[[], None]) -> None:
        """See `Rerouting`."""
        self._job.begins(drive.trajectory)

    def gives_up(self) -> str:
        """See `Rerouting`."""
        self._job.look()
        return self._planned(self._job.stops())

    def replacement(self) -> GivenDrive | None:
        """See `Rerouting`."""
        return _drive(self._planned(self._job.replaces()), Taking.UNDER_WAY)

    def next_drive(self) -> GivenDrive | None:
        """See `Rerouting`."""
        return _drive(self._job.next_way(), Taking.HERE)

    def refused(self, why: str) -> None:
        """See `Rerouting`; the report has why."""

    def _planned(self, planning: Planning[Result]) -> Result:
        """Go through a choice of a way, and plan what it asks for."""
        try:
            request = next(planning)
            while True:
                request = planning.send(self._answer(request))
        except StopIteration as end:
            chosen: Result = end.value
            return chosen

    def _answer(self, request: WayRequest) -> PlannedWay | str:
        goal, options, leaving = request.goal, request.options, request.leaving
        try:
            plan = plan_to_goal(goal, self._vehicle, options, leaving, request.ground, request.search)
        except PlanningError as error:
            return str(error)
        return PlannedWay(plan.trajectory, plan.report.total_time_s)


def _drive(way: ChosenWay | None, taking: Taking) -> GivenDrive | None:
    return None if way is None else GivenDrive(way.trajectory, None, taking, way.cause)

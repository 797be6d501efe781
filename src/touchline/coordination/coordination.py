"""Coordination of a team from its first messages on: waits until all are localized, then guides them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from touchline.coordination.algorithms.algorithm_task import AlgorithmTask, External, task_with_algorithm
from touchline.coordination.body_contacts import body_radius_m
from touchline.coordination.dispatch.dispatch_memory import DispatchMemory
from touchline.coordination.dispatch.dispatched_task import DispatchedTask, dispatched
from touchline.coordination.dispatch.dispatcher import TaskDispatcher
from touchline.coordination.free_area import FreeArea
from touchline.coordination.hub import Hub, TeamSettings
from touchline.coordination.plans.plan_hub import FollowedPlan, PlanHub, PlanSettings
from touchline.coordination.plans.team_plan_limits import plan_limits
from touchline.coordination.tasks import ARRIVED_M, TeamTask, task_of
from touchline.schemas.errors import SpecError
from touchline.schemas.messages import Guidance, PlanState, TeamCell, Whereabouts
from touchline.schemas.messages.team_messages import FIRST_CELL
from touchline.schemas.task_requests import DispatchTask
from touchline.schemas.team import TaskSpec, TeamScenario

Reported = Whereabouts | PlanState
"""Message of a robot to its coordinator."""

RESTS_M: Final = 0.01
"""A robot that would stop within this distance stands, as far as an estimate can show."""
LOST_S: Final = 30.0
"""Sim time, s, in which standing robots must be localized."""


def margin_of(team: TeamScenario) -> float:
    """Return the distance (m) by which robots may be off their cells or plans; 0: any, as nothing keeps them apart."""
    return 0.0 if team.avoid == "none" else max(_margin_m(team), 0.0)


def _margin_m(team: TeamScenario) -> float:
    return team.radius_m - body_radius_m(team.vehicle)


def settings_of(team: TeamScenario) -> TeamSettings:
    """Return the common settings of a scenario's robots."""
    drive, lease_s = team.vehicle.drive, team.onboard.team.lease_s
    wall_radius_m = team.radius_m + max(_margin_m(team), 0.0) + team.onboard.team.doubt_m
    return TeamSettings(team.radius_m, wall_radius_m, drive.max_acceleration_mps2, drive.transit_speed_mps, lease_s)


def plan_settings_of(team: TeamScenario, *, certain: bool = True) -> PlanSettings:
    """Return the common settings of a scenario's robots, if they drive by plans.

    Args:
        team: The team.
        certain: Whether what is sent arrives at once if the links lose nothing.
    """
    assert team.avoid != "cells", "it drives by plans"
    return PlanSettings(
        plan_limits(team),
        team.vehicle.drive.motor_time_constant_s,
        _margin_m(team),
        certain=team.links.lossless and not team.faulty and certain,
        avoid=team.avoid,
    )


class Coordination:
    """Coordinator of a team, before and after it begins.

    Args:
        team: Task and settings.
        area: The area.
        external: Makes the decider that asks other processes for wishes, where there is a bus.
        certain: Whether what is sent arrives at once if the team's links lose nothing.

    Attributes:
        hub: The hub, once the team has begun.
        task: The team's task, likewise.
    """

    def __init__(
        self, team: TeamScenario, area: FreeArea, external: External | None = None, *, certain: bool = True
    ) -> None:
        self._team, self._area, self._external, self._certain = team, area, external, certain
        self._first: dict[str, Reported] = {}
        self._begun_s = math.inf
        self._names: tuple[str, ...] = team.names
        self._kept: DispatchMemory | None = None
        self._out: set[str] = set()
        self._charges: dict[str, float] = {}
        self.hub: Hub | PlanHub | None = None
        self.task: TeamTask | None = None

    def hear(self, name: str, reported: Reported, now_s: float) -> None:
        """Take a robot's message; a standing one that is not in the team yet joins it.

        Args:
            name: Name of the robot.
            reported: Its message.
            now_s: Sim time.
        """
        if name in self._out:
            return
        if self.hub is None:
            self._first[name] = reported
        elif isinstance(self.hub, PlanHub):
            if name in self.hub.names and isinstance(reported, PlanState):
                self.hub.receive(name, reported, now_s)
        elif isinstance(reported, Whereabouts):
            self._hear_in_cell(self.hub, name, reported, now_s)

    def _hear_in_cell(self, hub: Hub, name: str, whereabouts: Whereabouts, now_s: float) -> None:
        if name in hub.names and not self._begins_anew(hub, name, whereabouts):
            hub.receive(name, whereabouts, now_s)
        elif (
            _is_new(whereabouts)
            and math.hypot(whereabouts.stop_x_m - whereabouts.x_m, whereabouts.stop_y_m - whereabouts.y_m) < RESTS_M
        ):
            if name in hub.names:
                hub.leave(name)
            hub.join(name, whereabouts, now_s)

    def hear_charge(self, name: str, share: float) -> None:
        """Take the charge of a robot's battery, a share of the whole."""
        self._charges[name] = share

    def remove(self, name: str) -> None:
        """Remove a robot that has been carried away: nobody keeps off it, and it is ignored until `admit`."""
        if isinstance(self.hub, Hub) and name in self.hub.names:
            self.hub.leave(name)
        self._out.add(name)

    def admit(self, name: str) -> None:
        """Admit a removed robot again, once it stands and has no cell; it may be elsewhere by then."""
        self._out.discard(name)

    @property
    def out(self) -> frozenset[str]:
        """Robots that have been removed."""
        return frozenset(self._out)

    def check_removal(self, name: str, forced: bool) -> None:
        """Check whether a robot may be removed.

        Args:
            name: Name of the robot.
            forced: Whether somebody guarantees that it does not drive.

        Raises:
            SpecError: It may not; the message gives the reason.
        """
        names = self.hub.names if self.hub is not None else ()
        if name not in names:
            raise SpecError("team", "robot", f"{name} is not in the team", f"use {', '.join(names) or 'it later'}")
        if isinstance(self.hub, PlanHub):
            raise SpecError("team", "robot", f"{name} has a plan among the others'", "stop the team, and begin anew")
        if len(names) == 1:
            raise SpecError("team", "robot", f"{name} is the only robot of the team", "stop the team")
        if self.hub is not None and not forced and name not in self.hub.resting:
            remedy = f"switch it off and ask again {self.hub.settings.resting_s + 1.0:g} s later, or use --force"
            raise SpecError("team", "robot", f"{name} sends messages, or did a moment ago: it may drive", remedy)

    @staticmethod
    def _begins_anew(hub: Hub, name: str, whereabouts: Whereabouts) -> bool:
        """Return whether a robot that counts as an obstacle has lost its cell as its process was restarted."""
        return name in hub.resting and whereabouts.decided == FIRST_CELL and hub.decided(name) > FIRST_CELL

    def update(self, now_s: float) -> None:
        """Make new cells, or begin if all robots are there.

        Args:
            now_s: Sim time.

        Raises:
            SegmentsMeet: A robot has not kept to its cell.
            SpecError: The task names an unknown robot.
        """
        if self.hub is None:
            if self.waits_for:
                return
            self.task = self._task_of(self._team.task, _places(self._first))
            self.hub = self._hub(self.task, now_s)
            self._begun_s = now_s
            if self._kept is not None and self.dispatcher is not None:
                self.dispatcher.restore(self._kept)
                self._begun_s = min(self._kept.begun_s, now_s - self._kept.time_s)  # the clock may be another
        if (task := dispatched(self.task)) is not None:
            task.observe(now_s - self._begun_s, self._charges, self.hub.resting)
        self.hub.update(now_s)

    @property
    def dispatcher(self) -> TaskDispatcher | None:
        """Dispatcher of the team's task, once that has begun, if it has one."""
        return None if (task := dispatched(self.task)) is None else task.dispatcher

    @property
    def dispatch_memory(self) -> DispatchMemory | None:
        """Memory of the dispatcher, if there is one."""
        return None if self.dispatcher is None else self.dispatcher.memory(self._begun_s)

    def _hub(self, task: TeamTask, now_s: float) -> Hub | PlanHub:
        """Return the hub that begins a task.

        Raises:
            TooNear: Robots stand too near to each other or to a wall.
            SegmentsMeet: Two stand at the same place.
        """
        if self._team.by_plans:
            states = {name: each for name, each in self._first.items() if isinstance(each, PlanState)}
            settings = plan_settings_of(self._team, certain=self._certain)
            return PlanHub(self._area, task, states, now_s, settings)
        places = {name: each for name, each in self._first.items() if isinstance(each, Whereabouts)}
        return Hub(self._area, task, places, now_s, settings_of(self._team))

    def expect(self, robots: Sequence[str]) -> None:
        """Begin with these robots, some of which may have joined the team; others of the team have been removed."""
        self._names = tuple(sorted(robots))
        self._out = set(self._team.names) - set(robots)

    def go_on(self, tasks: DispatchMemory | None) -> None:
        """Begin, once all robots have no cell any more, where another coordinator has ended.

        Args:
            tasks: Memory of its dispatcher; None: it had none.
        """
        self._kept = tasks

    def resume(self, followed: Mapping[str, FollowedPlan], now_s: float, tasks: DispatchMemory | None = None) -> None:
        """Begin with robots that drive by plans of another coordinator.

        Args:
            followed: State and plan of each robot of the team, by its name.
            now_s: Sim time, an update period before the next update.
            tasks: Memory of its dispatcher, if it had one.

        Raises:
            TooNear: Two plans, or one and a wall, are nearer than plans may be.
            SpecError: The task names an unknown robot.
        """
        self._first = {name: each.state for name, each in followed.items()}
        self.task = self._task_of(self._team.task, _places(self._first))
        # Robots are out of step at first, and may miss a plan: both plans are kept clear until they have reported.
        settings = plan_settings_of(self._team, certain=False)
        self.hub = PlanHub(self._area, self.task, followed, now_s, settings)
        self._begun_s = now_s
        if tasks is not None and self.dispatcher is not None:
            self.dispatcher.restore(tasks)
            self._begun_s = tasks.begun_s

    def set_first_task(self, spec: TaskSpec) -> None:
        """Set the task that begins once all robots are localized."""
        self._team = self._team.model_copy(update={"task": spec})

    def set_task(self, spec: TaskSpec) -> None:
        """Continue with another task.

        Raises:
            SpecError: It names an unknown robot, or the team has not begun.
        """
        if self.hub is None:
            raise SpecError("team", "task", "comes before all robots know where they are", "send it again in a moment")
        places = dict(zip(self.hub.names, ((float(x), float(y)) for x, y in self.hub.places), strict=True))
        self.task = self._task_of(spec, places)
        self.hub.set_task(self.task)

    def _task_of(self, spec: TaskSpec, places: Mapping[str, tuple[float, float]]) -> TeamTask:
        """Return a task, with the team's algorithm if it has one; the algorithm itself stays the same.

        Raises:
            SpecError: The task names an unknown robot, or the algorithm cannot be used.
        """
        given: TeamTask
        if isinstance(spec, DispatchTask):
            given = DispatchedTask(spec, self._team, self._area, places)
        else:
            given = task_of(spec, self._area, places, settings_of(self._team).wall_radius_m)
        if isinstance(self.task, AlgorithmTask):
            return AlgorithmTask(self._team, self._area, given, self.task.decider)
        return (
            given
            if self._team.algorithm is None
            else task_with_algorithm(self._team, self._area, given, self._external)
        )

    def arrived(self) -> list[str]:
        """Return the robots that believe to be at their last goals; empty if the task has none."""
        if self.hub is None or self.task is None or not self.task.ends_on_arrival:
            return []
        last = self.task.last
        at = zip(self.hub.names, self.hub.places, strict=True)
        return [name for name, place in at if np.hypot(*(place - last.get(name, place))) <= ARRIVED_M]

    def finished(self, now_s: float) -> bool:
        """Return whether the team's time is up, or all believe to be at their last goals.

        Args:
            now_s: Sim time.
        """
        if self.hub is None:
            return False
        late = now_s - self._begun_s >= self._team.duration_s - 1e-6
        return late or self.all_arrived

    @property
    def all_arrived(self) -> bool:
        """Return whether all believe to be at their last goals, or their dispatcher has nothing left to do."""
        if self.dispatcher is not None:
            return self.dispatcher.done
        return self.hub is not None and len(self.arrived()) == len(self.hub.names)

    @property
    def waits_for(self) -> tuple[str, ...]:
        """Robots that are not localized, keep to a cell, or are silent, while the team has not begun."""
        if self.hub is not None:
            return ()
        return tuple(name for name in self._names if name not in self._first or not _is_new(self._first[name]))

    def guidance(self) -> dict[str, Guidance]:
        """Return the guidance of each robot now, by name."""
        if self.hub is not None:
            return self.hub.guidance()
        return {name: Guidance(echo_s=whereabouts.stamp_s) for name, whereabouts in self._first.items()}

    def cells(self) -> list[TeamCell]:
        """Return the cells as they are published for observers."""
        if (hub := self.hub) is None:
            return []
        guidance, goals, outside_m = hub.guidance(), hub.goals, hub.outside_m
        return [
            TeamCell(
                name=name,
                number=guidance[name].number,
                x_m=corners[:, 0],
                y_m=corners[:, 1],
                goal_x_m=goals[name][0],
                goal_y_m=goals[name][1],
                target_x_m=guidance[name].target_x_m,
                target_y_m=guidance[name].target_y_m,
                outside_m=outside_m[name],
                resting=name in hub.resting,
                stuck=name in hub.stuck,
            )
            for name, corners in hub.corners.items()
        ]


def _is_new(whereabouts: Reported) -> bool:
    """Return whether a robot is localized and has looked at no cell yet: only such a one can join."""
    return whereabouts.aligned and whereabouts.decided == FIRST_CELL


def _places(whereabouts: dict[str, Reported]) -> dict[str, tuple[float, float]]:
    return {name: (each.x_m, each.y_m) for name, each in whereabouts.items()}

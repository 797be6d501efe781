"""A team from its first messages on: waits until all know where they are, then coordinates those that come and go."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from touchline.fleet.body_contacts import body_radius_m
from touchline.fleet.free_area import FreeArea
from touchline.fleet.hub import Hub, TeamSettings
from touchline.fleet.tasks import ARRIVED_M, GoalLists, TeamTask, task_of
from touchline.schemas.errors import SpecError
from touchline.schemas.messages import Guidance, TeamCell, Whereabouts
from touchline.schemas.messages.team_messages import FIRST_CELL
from touchline.schemas.team import TaskSpec, TeamScenario

RESTS_M: Final = 0.01
"""Who would stop within this stands, as far as an estimate can tell."""
LOST_S: Final = 30.0
"""Sim time: robots that stand for so long without knowing where will not drive."""


def settings_of(team: TeamScenario) -> TeamSettings:
    """What the robots of a scenario have in common."""
    drive, lease_s = team.vehicle.drive, team.onboard.team.lease_s
    margin_m = team.radius_m - body_radius_m(team.vehicle)
    wall_radius_m = team.radius_m + max(margin_m, 0.0) + team.onboard.team.doubt_m
    return TeamSettings(team.radius_m, wall_radius_m, drive.max_acceleration_mps2, drive.transit_speed_mps, lease_s)


class Coordination:
    """See the module.

    Args:
        team: What it is to do, and how.
        area: Where.

    Attributes:
        hub: The coordinator, once the team has begun.
        task: What the team does, likewise.
    """

    def __init__(self, team: TeamScenario, area: FreeArea) -> None:
        self._team, self._area = team, area
        self._first: dict[str, Whereabouts] = {}
        self._begun_s = math.inf
        self._out: set[str] = set()
        self.hub: Hub | None = None
        self.task: TeamTask | None = None

    def hear(self, name: str, said: Whereabouts, now_s: float) -> None:
        """Take what a robot says; one that is not of the team yet, and stands, joins it.

        Args:
            name: The robot's.
            said: By it.
            now_s: Sim time.
        """
        if name in self._out:
            return
        if self.hub is None:
            self._first[name] = said
        elif name in self.hub.names and not self._begins_anew(self.hub, name, said):
            self.hub.receive(name, said, now_s)
        elif _is_new(said) and math.hypot(said.stop_x_m - said.x_m, said.stop_y_m - said.y_m) < RESTS_M:
            if name in self.hub.names:
                self.hub.leave(name)
            self.hub.join(name, said, now_s)

    def remove(self, name: str) -> None:
        """Take a robot out that has been carried away: nobody keeps off it, and it is not heard before `admit`."""
        if self.hub is not None and name in self.hub.names:
            self.hub.leave(name)
        self._out.add(name)

    def admit(self, name: str) -> None:
        """Take a robot in again that was taken out, once it stands and has no cell; it may be elsewhere by then."""
        self._out.discard(name)

    @property
    def out(self) -> frozenset[str]:
        """Who has been taken out."""
        return frozenset(self._out)

    def check_removal(self, name: str, forced: bool) -> None:
        """See whether a robot may be taken out.

        Args:
            name: The robot's.
            forced: Whether somebody answers for it that it does not drive.

        Raises:
            SpecError: It may not; the reason.
        """
        names = self.hub.names if self.hub is not None else ()
        if name not in names:
            raise SpecError("team", "robot", f"{name} is not in the team", f"use {', '.join(names) or 'it later'}")
        if len(names) == 1:
            raise SpecError("team", "robot", f"{name} is all of the team", "stop the team")
        if self.hub is not None and not forced and name not in self.hub.resting:
            remedy = f"switch it off and ask again {self.hub.settings.resting_s + 1.0:g} s later, or use --force"
            raise SpecError("team", "robot", f"{name} is heard, or was a moment ago: it may drive", remedy)

    @staticmethod
    def _begins_anew(hub: Hub, name: str, said: Whereabouts) -> bool:
        """Whether a robot that counts as an obstacle has lost its cell: its process is another one."""
        return name in hub.resting and said.decided == FIRST_CELL and hub.decided(name) > FIRST_CELL

    def update(self, now_s: float) -> None:
        """Make new cells, or begin if all are there.

        Args:
            now_s: Sim time.

        Raises:
            SegmentsMeet: A robot has not kept to its cell.
            SpecError: The task is of a robot that there is not.
        """
        if self.hub is None:
            if self.waits_for:
                return
            self.task = task_of(self._team.task, self._area, _places(self._first))
            self.hub = Hub(self._area, self.task, self._first, now_s, settings_of(self._team))
            self._begun_s = now_s
        self.hub.update(now_s)

    def set_first_task(self, spec: TaskSpec) -> None:
        """What the team is to do once all know where they are."""
        self._team = self._team.model_copy(update={"task": spec})

    def set_task(self, spec: TaskSpec) -> None:
        """Go on with another task.

        Raises:
            SpecError: It is of a robot that there is not, or the team has not begun.
        """
        if self.hub is None:
            raise SpecError("team", "task", "comes before all robots know where they are", "send it again in a moment")
        places = dict(zip(self.hub.names, ((float(x), float(y)) for x, y in self.hub.places), strict=True))
        self.task = task_of(spec, self._area, places)
        self.hub.set_task(self.task)

    def arrived(self) -> list[str]:
        """Who believes to be at its last goal; nobody if the task has none."""
        if self.hub is None or not isinstance(self.task, GoalLists):
            return []
        last = self.task.last
        at = zip(self.hub.names, self.hub.places, strict=True)
        return [name for name, place in at if np.hypot(*(place - last.get(name, place))) <= ARRIVED_M]

    def finished(self, now_s: float) -> bool:
        """Whether the team has had its time, or all believe to be at their last goals.

        Args:
            now_s: Sim time.
        """
        if self.hub is None:
            return False
        late = now_s - self._begun_s >= self._team.duration_s - 1e-6
        return late or self.all_arrived

    @property
    def all_arrived(self) -> bool:
        """Whether all believe to be at their last goals."""
        return self.hub is not None and len(self.arrived()) == len(self.hub.names)

    @property
    def waits_for(self) -> tuple[str, ...]:
        """Who does not know where it is, keeps to a cell, or has said nothing, while the team has not begun."""
        if self.hub is not None:
            return ()
        return tuple(name for name in self._team.names if name not in self._first or not _is_new(self._first[name]))

    def say(self) -> dict[str, Guidance]:
        """What to tell the robots now, by name."""
        if self.hub is not None:
            return self.hub.say()
        return {name: Guidance(echo_s=said.stamp_s) for name, said in self._first.items()}

    def cells(self) -> list[TeamCell]:
        """The cells as they are told to whoever watches."""
        if (hub := self.hub) is None:
            return []
        told, goals, strays_m = hub.say(), hub.goals, hub.strays_m
        return [
            TeamCell(
                name=name,
                number=told[name].number,
                x_m=cell.corners[:, 0],
                y_m=cell.corners[:, 1],
                goal_x_m=goals[name][0],
                goal_y_m=goals[name][1],
                target_x_m=told[name].target_x_m,
                target_y_m=told[name].target_y_m,
                outside_m=strays_m[name],
                resting=name in hub.resting,
                stuck=name in hub.stuck,
            )
            for name, cell in hub.cells.items()
        ]


def _is_new(said: Whereabouts) -> bool:
    """Whether a robot knows where it is, and has looked at no cell yet: only such a one can be taken in."""
    return said.aligned and said.decided == FIRST_CELL


def _places(said: dict[str, Whereabouts]) -> dict[str, tuple[float, float]]:
    return {name: (each.x_m, each.y_m) for name, each in said.items()}

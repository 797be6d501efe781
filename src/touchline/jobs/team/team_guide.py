"""Interface of a team's guidance: by cells or plans that keep robots apart, or as in the study."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Protocol

from touchline.coordination.interventions import Interventions
from touchline.coordination.tasks import ARRIVED_M, TeamTask
from touchline.schemas.team import TeamScenario

Place = tuple[float, float]


@dataclass
class BelievedApart:
    """Separation of robots by their own estimates; infinite without cells or plans.

    Attributes:
        nearest_m: Smallest distance of two stopping segments, or of two robots' plans, at an update.
        outside_m: Largest distance of a stopping segment outside its robot's cell, or of a robot from its plan.
    """

    nearest_m: float = math.inf
    outside_m: float = -math.inf


def run_over(team: TeamScenario, task: TeamTask | None, ticks: int, places: Mapping[str, Place]) -> bool:
    """Return whether a team's time is up, or all are at their last goals.

    Args:
        team: The team.
        task: Its task; None: it has not begun.
        ticks: Ticks since it began.
        places: Where each robot believes to be (m).
    """
    if task is None:
        return False
    late = ticks >= 100.0 * team.duration_s - 0.5
    if late or not task.ends_on_arrival:
        return late
    return all(math.dist(at, task.last.get(name, at)) <= ARRIVED_M for name, at in places.items())


class TeamGuide(Protocol):
    """Guides robots in lockstep with them.

    Attributes:
        believed: Separation so far.
        problem: Why it has stopped all robots, if it has.
    """

    believed: BelievedApart
    problem: str

    @property
    def interventions(self) -> Interventions:
        """Changes of wishes so far."""
        ...

    @property
    def step_ticks(self) -> int:
        """Ticks for which robots may drive on until the next exchange."""
        ...

    @property
    def task(self) -> TeamTask | None:
        """The team's task, once all robots are localized."""
        ...

    @property
    def waits_for(self) -> tuple[str, ...]:
        """Return robots that are not localized, while the team has not begun."""
        ...

    def talk(self, tick: int, awake: Collection[str]) -> bool:
        """Exchange messages with the robots.

        Args:
            tick: Now.
            awake: Robots whose computers run.

        Returns:
            Whether goals were updated.

        Raises:
            PlanningError: There is no path to a goal.
        """
        ...

    def finished(self, tick: int) -> bool:
        """Return whether the team's time is up, or all believe to be at their last goals."""
        ...

    def blockage(self, name: str) -> str:
        """Return why a robot does not reach its goal, as far as is known."""
        ...

"""What tells the robots of a team where to drive; by cells that keep them apart, or as in the study."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass
from typing import Protocol

from touchline.fleet.tasks import TeamTask


@dataclass
class BelievedApart:
    """How well robots keep apart, as they believe; infinite where nothing keeps them.

    Attributes:
        nearest_segments_m: The least distance of two stopping segments at an update.
        outside_cell_m: How far a stopping segment was outside the cell that its robot kept to, at most.
    """

    nearest_segments_m: float = math.inf
    outside_cell_m: float = -math.inf


class TeamGuide(Protocol):
    """Guides robots in lockstep with them.

    Attributes:
        believed: So far.
        problem: Why it has stopped all robots, if it has.
    """

    believed: BelievedApart
    problem: str

    @property
    def step_ticks(self) -> int:
        """For so long robots may drive on before they are talked to again."""
        ...

    @property
    def task(self) -> TeamTask | None:
        """What the team does, once all know where they are."""
        ...

    @property
    def waits_for(self) -> tuple[str, ...]:
        """Who does not know where it is, while the team has not begun."""
        ...

    def talk(self, tick: int, awake: Collection[str]) -> bool:
        """Hear robots and tell them what to do.

        Args:
            tick: Now.
            awake: Robots whose computers do not stand still.

        Returns:
            Whether goals were thought over.

        Raises:
            PlanningError: There is no way to a goal.
        """
        ...

    def finished(self, tick: int) -> bool:
        """Whether the team has had its time, or all believe to be at their last goals."""
        ...

    def hindrance(self, name: str) -> str:
        """Why a robot does not get to its goal, as far as is known."""
        ...

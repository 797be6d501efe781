"""What tells the robots of a team where to drive; by cells that keep them apart, or as in the study."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

from touchline.services.fleet.tasks import TeamTask


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
    """

    believed: BelievedApart

    @property
    def step_ticks(self) -> int:
        """For so long robots may drive on before they are talked to again; updates are a multiple of it."""
        ...

    def places(self) -> dict[str, tuple[float, float]]:
        """Where robots believe to be, by the names of those that know (m)."""
        ...

    def begin(self, task: TeamTask, tick: int) -> None:
        """All know where they are.

        Args:
            task: What the team does.
            tick: Now.

        Raises:
            SegmentsMeet: Two stand at the same place.
        """
        ...

    def talk(self, tick: int, *, update: bool) -> None:
        """Hear robots and tell them what to do.

        Args:
            tick: Now.
            update: Whether goals are to be thought over.

        Raises:
            SegmentsMeet: A robot has not kept to its cell.
            PlanningError: There is no way to a goal.
        """
        ...

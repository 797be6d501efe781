"""Requests for ways to a goal, and what becomes of them: they are answered at once, or while the robot goes on."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from functools import cached_property
from typing import Final, NamedTuple, TypeAlias, TypeVar

from touchline.schemas.known_ground import OPEN_GROUND, KnownGround
from touchline.schemas.messages import LeavingTrajectory, PlanOptions, PoseGoal, Trajectory, WaySearch
from touchline.schemas.plan_cause import LeftDrive, PlanCause
from touchline.services.robot_sim.goal_way.kept_things import PlannedThings, cut_out

Result = TypeVar("Result")
EVERYWHERE: Final = WaySearch()


class SeenPlaces(NamedTuple):
    """Places where a robot has seen something, at one moment, and the ground that is known.

    Attributes:
        known: The known ground, with a boundary.
        beside: Parts of its obstacles near to where the way begins, which are moved off.
        things: What was seen besides, by kinds.
    """

    known: KnownGround
    beside: PlannedThings
    things: tuple[PlannedThings, ...]


@dataclass(frozen=True, eq=False)
class WayRequest:
    """A way to be planned.

    Attributes:
        goal: Where it leads.
        options: Planning options, with the margin, and with a start unless a drive is left.
        seen: What the body keeps off; None: nothing.
        search: Extent of the search.
        leaving: The present drive, if the robot moves.
    """

    goal: PoseGoal
    options: PlanOptions
    seen: SeenPlaces | None = None
    search: WaySearch = EVERYWHERE
    leaving: LeavingTrajectory | None = None

    @cached_property
    def ground(self) -> KnownGround:
        """Known ground with outlines of what was seen; in any thread, as it may take a fifth of a second."""
        if self.seen is None:
            return OPEN_GROUND
        known, beside, things = self.seen
        named = cut_out(known.obstacles, beside.clear)
        seen = (outline for each in things for outline in each.outlines("seen"))
        return KnownGround(boundary=known.boundary, obstacles=(*named, *beside.outlines("beside"), *seen))

    @property
    def cause(self) -> PlanCause:
        """Inputs of the plan, for the recording."""
        leaves = None if self.leaving is None else LeftDrive.of(self.leaving)
        known = () if self.seen is None else self.seen.known.obstacles
        return PlanCause(
            options=self.options, goal=self.goal, ground=self.ground, search=self.search, leaves=leaves, known=known
        )


class PlannedWay(NamedTuple):
    """Answer to a request.

    Attributes:
        trajectory: The plan.
        total_time_s: Its duration.
    """

    trajectory: Trajectory
    total_time_s: float


class ChosenWay(NamedTuple):
    """A way that the robot is to take.

    Attributes:
        trajectory: The plan.
        cause: Inputs of the plan.
    """

    trajectory: Trajectory
    cause: PlanCause


Planning: TypeAlias = Generator[WayRequest, PlannedWay | str, Result]
"""Choice of a way: yields requests, and is sent the plan of each, or why there is none."""

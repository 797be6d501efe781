"""Messages between regions, and between regions and robots; each may be lost, late, doubled or out of order."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from touchline.schemas.messages import Guidance

Floats = NDArray[np.float64]


class RegionLife(NamedTuple):
    """Region, and which of its lives: a region that starts anew has a later one, and knows nothing of those before."""

    region: int
    life: int


@dataclass(frozen=True, eq=False)
class TimedPlan:
    """Plan of a robot: samples (m, 5) of `timed_motion` from `start_s` on, which it must have before `branch_s`."""

    samples: Floats
    start_s: float
    branch_s: float


Plans: TypeAlias = Mapping[int, TimedPlan]
"""Plans of a robot by their numbers: those that it may be following."""


class RobotClaims(NamedTuple):
    """From the owner of a robot: all plans that the robot may be following; the newest epoch and version counts."""

    robot: str
    epoch: int
    version: int
    plans: Plans


class ClaimsAnswer(NamedTuple):
    """Answer to claims of a version: granted, so they are kept clear until a newer version comes, or refused."""

    robot: str
    epoch: int
    version: int
    granted: bool


class HandoverOffer(NamedTuple):
    """Offer to hand over a robot that is owned in an epoch."""

    robot: str
    epoch: int


class HandoverAccept(NamedTuple):
    """Acceptance of an offer: the sender may be made the owner."""

    robot: str
    epoch: int


class ClaimsRequest(NamedTuple):
    """Request of a region that has started, for all claims that another one knows."""


class AllClaims(NamedTuple):
    """Answer to a request by this life: all claims that the sender knows."""

    life: int
    claims: tuple[RobotClaims, ...]


class OwnerOrder(NamedTuple):
    """To a robot: its owner from now on, in a new epoch."""

    robot: str
    owner: RegionLife
    epoch: int


class PlanOrder(NamedTuple):
    """To a robot, from its owner: a plan that continues the plan `base`."""

    robot: str
    owner: RegionLife
    epoch: int
    number: int
    base: int
    plan: TimedPlan

    @property
    def guidance(self) -> Guidance:
        """The same as a robot takes it."""
        end = self.plan.samples[-1]
        return Guidance(
            number=self.number,
            target_x_m=float(end[0]),
            target_y_m=float(end[1]),
            plan=self.plan.samples.ravel(),
            plan_start_s=self.plan.start_s,
            plan_branch_s=self.plan.branch_s,
            plan_base=self.base,
        )


class OwnedState(NamedTuple):
    """From a robot to all: its owner and epoch, the plan that it follows, and the highest number decided on."""

    robot: str
    stamp_s: float
    owner: RegionLife | None
    epoch: int
    adopted: int
    decided: int
    plan: TimedPlan


ToRegion: TypeAlias = RobotClaims | ClaimsAnswer | HandoverOffer | HandoverAccept | ClaimsRequest | AllClaims
ToRobot: TypeAlias = OwnerOrder | PlanOrder


class Letter(NamedTuple):
    """Message between two lives of regions."""

    sender: RegionLife
    to: int
    message: ToRegion

"""Accounts of a robot's work on one job: paint, areas, its path, contacts, and the error of its estimate."""

from __future__ import annotations

from collections.abc import Sequence

from touchline.onboard.interface import Estimate
from touchline.services.robot_sim.accounting.area_account import AreaAccount
from touchline.services.robot_sim.estimator_error import NO_ERROR, EstimatorError
from touchline.services.robot_sim.paint.ledger import PaintLedger
from touchline.services.robot_sim.paint.track import Track
from touchline.services.robot_sim.world.objects.surroundings import Contact
from touchline.services.robot_sim.world.world import World


class WorkAccounts:
    """Accounts of one job, from its taking to that of the next.

    Args:
        ledger: Ledger of the paint.
        account: Account of the areas; None unless a covering tool works on areas.
        errors: Sums (SUMS,) of the estimate's error by the part of the job that another process has driven.

    Attributes:
        ledger, account: The accounts given.
        track: Path of the robot.
        estimator_error: Error of the estimate.
        contacts: Contacts of the robot with things.
    """

    def __init__(
        self, ledger: PaintLedger, account: AreaAccount | None = None, errors: Sequence[float] = NO_ERROR
    ) -> None:
        self.ledger, self.account, self.track = ledger, account, Track()
        self.estimator_error = EstimatorError(errors)
        self.contacts: list[Contact] = []

    def record(self, tick: int, world: World, estimate: Estimate | None) -> None:
        """Enter a tick.

        Args:
            tick: The tick.
            world: World at its end.
            estimate: Estimate of the pose; None unless a traversal is under way.
        """
        self.ledger.record(world.trace)
        self.track.enter(tick, world.pose, self.ledger.points)
        if estimate is not None:
            self.estimator_error.add(world.pose, world.state.speed_mps, estimate)

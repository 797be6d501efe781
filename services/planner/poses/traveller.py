"""Who drives between two poses: its limits, and what it may do beside driving forward."""

from dataclasses import dataclass, replace
from typing import Self

from touchline.schemas.messages import PlanOptions
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.limits import SHARPNESS_RANGE_1PM2, Limits

# Turns are made for these shares of the transit speed.
TURN_SHARES = (0.3, 0.45, 0.6, 0.8, 1.0)


@dataclass(frozen=True)
class Traveller:
    """A vehicle between two poses.

    Attributes:
        limits: It keeps to them.
        arc_curvature_1pm: That of arcs, for methods that turn in arcs of one radius.
        can_reverse: Whether it may drive backward.
        can_spin: Whether it may turn on the spot.
    """

    limits: Limits
    arc_curvature_1pm: float
    can_reverse: bool = False
    can_spin: bool = False

    @classmethod
    def of(cls, vehicle: Vehicle, options: PlanOptions) -> Self:
        """A vehicle with what the options leave of its limits: curvature, sharpness, speed, and driving forward only.

        Where the options say nothing of sharpness, it is what the drive does at the speed of its slowest turns.

        Raises:
            PlanningError: An option cannot be met.
        """
        limits, drive = Limits.of(vehicle, options), vehicle.drive
        if not options.sigma_max_1pm2:
            sharpest = limits.drive.sharpness_at(TURN_SHARES[0] * limits.transit_speed_mps)
            limits = replace(limits, sharpness_max_1pm2=min(sharpest, SHARPNESS_RANGE_1PM2[1]))
        arcs = options.kappa_max_1pm or min(drive.default_kappa_max_1pm, limits.curvature_max_1pm)
        free = not options.forward_only
        return cls(limits, arcs, drive.can_reverse and free, drive.can_spin and free)

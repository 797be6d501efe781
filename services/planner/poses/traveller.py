"""Vehicle that drives between two poses: limits, and abilities besides driving forward."""

from dataclasses import dataclass, replace
from typing import Self

from touchline.schemas.messages import PlanOptions
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.limits import SHARPNESS_RANGE_1PM2, Limits

# Speeds of turns as fractions of the transit speed.
TURN_SHARES = (0.3, 0.45, 0.6, 0.8, 1.0)
# A turn that is wider is none (1/m): at full speed no wheel can be faster than the other, but for rounding.
LEAST_CURVATURE_1PM = 0.01


@dataclass(frozen=True)
class Traveller:
    """A vehicle between two poses.

    Attributes:
        limits: Limits of the plan.
        arc_curvature_1pm: Curvature of arcs, for methods with arcs of one radius.
        can_reverse: Whether it may drive backward.
        can_spin: Whether it may turn on the spot.
    """

    limits: Limits
    arc_curvature_1pm: float
    can_reverse: bool = False
    can_spin: bool = False

    @classmethod
    def of(cls, vehicle: Vehicle, options: PlanOptions) -> Self:
        """Limit a vehicle by the options: curvature, sharpness, speed, and driving forward only.

        The default sharpness is that of the drive at the speed of its slowest turns.

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

    @property
    def turns(self) -> dict[tuple[float, float], float]:
        """Maximum curvature (1/m) and sharpness (1/m²) of turns, each with its speed (m/s), the slowest first."""
        speeds = [share * self.limits.transit_speed_mps for share in TURN_SHARES]
        turns = {self.limits.turn_at(speed): speed for speed in speeds}
        return {turn: speed for turn, speed in turns.items() if turn[0] >= LEAST_CURVATURE_1PM}

"""The machine that covers an area, as coverage methods see it."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

from touchline.schemas.errors import PlanningError
from touchline.schemas.template import Position
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.geometry.clothoid import Piece
from touchline.services.planner.limits import Limits


@dataclass(frozen=True)
class CoverageMachine:
    """A machine whose tool works forward and backward, and lies across the body's origin.

    Attributes:
        width_m: Width of the tool.
        outline: Corners of the body relative to the middle of the tool (m).
        curvature_max_1pm: Maximum curvature of paths.
        sharpness_max_1pm2: Maximum change of curvature along a path; curvature may step at rest.
        speed_mps: Speed on straights.
        acceleration_mps2: Acceleration and deceleration.
        can_reverse: Whether it may drive backward.
        spin_lever_m: Distance from the tool's middle of a point that moves as fast in a turn on the spot as the
            machine does straight on; infinite if it cannot turn on the spot.
        bend_speed_mps: Speed in the tightest bends; infinite if they are as fast as straights.
    """

    width_m: float
    outline: tuple[Position, ...]
    curvature_max_1pm: float
    sharpness_max_1pm2: float
    speed_mps: float
    acceleration_mps2: float
    can_reverse: bool = True
    spin_lever_m: float = math.inf
    bend_speed_mps: float = math.inf

    @cached_property
    def nose_m(self) -> float:
        """Length of the body ahead of the tool (m)."""
        return max(x for x, _ in self.outline)

    @cached_property
    def tail_m(self) -> float:
        """Length of the body behind the tool (m)."""
        return -min(x for x, _ in self.outline)

    @cached_property
    def beside_m(self) -> float:
        """Distance of the tool's middle from a wall beside it (m): the body may be wider than the tool."""
        return max(0.5 * self.width_m, *(abs(y) for _, y in self.outline))

    @property
    def can_spin(self) -> bool:
        """True if the machine turns on the spot."""
        return math.isfinite(self.spin_lever_m)

    @property
    def bend_s_per_m(self) -> float:
        """Extra seconds per metre of a bend, compared with a straight."""
        return max(1.0 / self.bend_speed_mps - 1.0 / self.speed_mps, 0.0)

    @cached_property
    def reach_m(self) -> float:
        """Distance of the body's furthest corner from the middle of the tool (m)."""
        return max(math.hypot(x, y) for x, y in self.outline)

    def run_s(self, length_m: float, standstills: int = 2) -> float:
        """Seconds for a stretch in one direction, at rest at this many of its ends and at full speed otherwise."""
        speed, gain = self.speed_mps, self.acceleration_mps2
        if standstills == 2 and length_m < speed * speed / gain:
            return 2.0 * math.sqrt(length_m / gain)
        return length_m / speed + 0.5 * standstills * speed / gain

    def seconds(self, pieces: Iterable[Piece]) -> float:
        """Seconds for pieces of a path from rest to rest, with stops at cusps and turns on the spot."""
        total, lengths, turned_s, direction = 0.0, list[float](), 0.0, 0
        for piece in pieces:
            if lengths and (piece.direction != direction or piece.spin_rad):
                total, lengths = total + self.run_s(sum(lengths)), []
            if piece.spin_rad:
                turned_s += self.run_s(abs(piece.spin_rad) * self.spin_lever_m)
            if piece.length_m or not piece.spin_rad:
                lengths.append(piece.length_m)
            if piece.curvature_1pm or piece.sharpness_1pm2:
                turned_s += piece.length_m * self.bend_s_per_m
            direction = piece.direction
        return total + (self.run_s(sum(lengths)) if lengths else 0.0) + turned_s

    def edges(self) -> Iterator[tuple[Position, Position]]:
        """Sides of the body, each as two corners."""
        return pairwise((*self.outline, self.outline[0]))


def machine_of(vehicle: Vehicle, limits: Limits) -> CoverageMachine:
    """Describe a vehicle within the limits of a plan as a coverage machine.

    Its bends are as tight as the drive allows, at the speed and sharpness that this takes.

    Raises:
        PlanningError: The tool is not at the body's origin.
    """
    if vehicle.tool.point_m != (0.0, 0.0):
        x_m, y_m = vehicle.tool.point_m
        problem = f"is for {vehicle.name}, whose tool is at ({x_m:g}, {y_m:g}) m of the body"
        raise PlanningError(
            "", problem, "use the area method parallel, or a vehicle with its tool at the body's origin"
        )
    bend_mps = limits.steady_speed_mps(limits.curvature_max_1pm)
    return CoverageMachine(
        vehicle.tool.width_m,
        vehicle.body.footprint_m,
        limits.curvature_max_1pm,
        min(limits.sharpness_max_1pm2, limits.drive.sharpness_at(bend_mps)),
        limits.paint_speed_mps,
        limits.acceleration_mps2,
        vehicle.drive.can_reverse,
        limits.caps.drive.spin_lever_m() if vehicle.drive.can_spin else math.inf,
        bend_mps,
    )

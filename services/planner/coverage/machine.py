"""What coverage methods need to know of the machine that covers an area."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

from touchline.schemas.template import Position
from touchline.services.planner.geometry.clothoid import Piece


@dataclass(frozen=True)
class CoverageMachine:
    """A machine that works what its tool passes over, whichever way it goes; the tool lies across the body's origin.

    Attributes:
        width_m: Of the tool.
        outline: Corners of the body, seen from the middle of the tool (m).
        curvature_max_1pm: No path is tighter.
        sharpness_max_1pm2: Curvature changes no faster along it; it may step where the machine stands.
        speed_mps: At which it drives where nothing slows it down.
        acceleration_mps2: From and to standstill.
        can_reverse: Whether it may drive backward.
        spin_lever_m: Distance from the tool's middle that moves as fast in a turn on the spot as the machine does
            straight on; infinite if it does not turn on the spot.
        bend_speed_mps: Speed in the tightest bends, if they are driven more slowly than straights.
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
        """How far the body reaches ahead of the tool."""
        return max(x for x, _ in self.outline)

    @cached_property
    def tail_m(self) -> float:
        """How far the body reaches behind the tool."""
        return -min(x for x, _ in self.outline)

    @cached_property
    def beside_m(self) -> float:
        """Distance of the tool's middle from a wall that it is driven along: the body may be wider than the tool."""
        return max(0.5 * self.width_m, *(abs(y) for _, y in self.outline))

    @property
    def can_spin(self) -> bool:
        """Whether it turns on the spot."""
        return math.isfinite(self.spin_lever_m)

    @property
    def bend_s_per_m(self) -> float:
        """Seconds that a metre of a bend takes longer than a metre straight on."""
        return max(1.0 / self.bend_speed_mps - 1.0 / self.speed_mps, 0.0)

    @cached_property
    def reach_m(self) -> float:
        """The distance of the body's furthest corner from the middle of the tool."""
        return max(math.hypot(x, y) for x, y in self.outline)

    def run_s(self, length_m: float, standstills: int = 2) -> float:
        """Seconds for a stretch in one direction that begins or ends at so many standstills, at full speed else."""
        speed, gain = self.speed_mps, self.acceleration_mps2
        if standstills == 2 and length_m < speed * speed / gain:
            return 2.0 * math.sqrt(length_m / gain)
        return length_m / speed + 0.5 * standstills * speed / gain

    def seconds(self, pieces: Iterable[Piece]) -> float:
        """Seconds for pieces of a path from rest to rest; the machine rests at cusps and to turn on the spot, too."""
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
        """The body's sides."""
        return pairwise((*self.outline, self.outline[0]))

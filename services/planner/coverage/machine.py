"""What coverage methods need to know of the machine that covers an area."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

from touchline.schemas.template import Position


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
    """

    width_m: float
    outline: tuple[Position, ...]
    curvature_max_1pm: float
    sharpness_max_1pm2: float
    speed_mps: float
    acceleration_mps2: float
    can_reverse: bool = True

    @cached_property
    def nose_m(self) -> float:
        """How far the body reaches ahead of the tool."""
        return max(x for x, _ in self.outline)

    @cached_property
    def tail_m(self) -> float:
        """How far the body reaches behind the tool."""
        return -min(x for x, _ in self.outline)

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

    def edges(self) -> Iterator[tuple[Position, Position]]:
        """The body's sides."""
        return pairwise((*self.outline, self.outline[0]))

"""Slides off a wall: S-bends that lead a body away from a wall without swinging out much."""

from dataclasses import dataclass

import numpy as np

from touchline.services.planner.coverage.coverage_machine import CoverageMachine
from touchline.services.planner.geometry.clothoid import PathPose, Piece, PiecePath

# Beside a wall the tail swings out at the beginning of a turn: before it the machine slides this far (m) off.
SLIDE_M = 0.2
# A slide that swings out too far is made gentler by this factor, at most this many times.
GENTLER, GENTLER_MOST = 0.8, 24
# Samples along a slide.
SAMPLES = 100


@dataclass(frozen=True)
class WallSlide:
    """Offset and sharpness of a machine's slides off a wall.

    Attributes:
        off_m: Lateral offset.
        forward_1pm2: Sharpness of its bends off a wall forward, and to a wall backward.
        backward_1pm2: Sharpness of its bends off a wall backward, and to a wall forward.
        both: Whether strokes are left forward and joined by slides, too, since a turn would swing the body out.
    """

    off_m: float
    forward_1pm2: float
    backward_1pm2: float
    both: bool

    @classmethod
    def of(cls, machine: CoverageMachine, swing_m: float) -> "WallSlide":
        """Sharpest slide of a machine whose body may swing out by a distance (m)."""
        sharpest = machine.sharpness_max_1pm2
        if _swing_m(machine, sharpest, -1) <= swing_m:
            return cls(SLIDE_M, sharpest, sharpest, both=False)
        return cls(SLIDE_M, _sharpness(machine, swing_m, 1), _sharpness(machine, swing_m, -1), both=True)

    def pieces(self, direction: int, *, onto: bool = False) -> tuple[Piece, ...]:
        """Pieces of a slide to the left of the heading, off a wall or onto a stroke beside one."""
        return _slide(self.forward_1pm2 if (direction > 0) != onto else self.backward_1pm2, direction)


def _slide(sharpness_1pm2: float, direction: int) -> tuple[Piece, ...]:
    ramp = (0.5 * SLIDE_M / sharpness_1pm2) ** (1.0 / 3.0)
    peak = sharpness_1pm2 * ramp
    signs = ((0.0, 1.0), (peak, -1.0), (0.0, -1.0), (-peak, 1.0))
    return tuple(Piece(ramp, bend, sign * sharpness_1pm2, direction) for bend, sign in signs)


def _sharpness(machine: CoverageMachine, swing_m: float, direction: int) -> float:
    """Largest sharpness (1/m²) within the swing, to the factor `GENTLER`."""
    sharpness = machine.sharpness_max_1pm2
    for _ in range(GENTLER_MOST):
        if _swing_m(machine, sharpness, direction) <= swing_m:
            break
        sharpness *= GENTLER
    return sharpness


def _swing_m(machine: CoverageMachine, sharpness_1pm2: float, direction: int) -> float:
    """Distance (m) by which the body swings beyond a wall on its right on a slide to the left."""
    path = PiecePath(PathPose(0.0, 0.0, 0.0), _slide(sharpness_1pm2, direction))
    _, y, heading, _ = path.sample(np.linspace(0.0, path.length_m, SAMPLES))
    sides = [y + np.sin(heading) * ahead + np.cos(heading) * left for ahead, left in machine.outline]
    return float(-machine.beside_m - np.min(sides))

"""Slides off a wall: an S beside a wall that leads a body away from it without swinging out much."""

from dataclasses import dataclass

import numpy as np

from touchline.services.planner.coverage.machine import CoverageMachine
from touchline.services.planner.geometry.clothoid import PathPose, Piece, PiecePath

# Beside a wall the tail swings out at the beginning of a turn: on its way back the machine slides so far (m) off it.
SLIDE_M = 0.2
# A slide that swings out too far is made gentler by this factor, at most so often.
GENTLER, GENTLER_MOST = 0.8, 24
# Places of a slide that are looked at.
LOOKED_AT = 100


@dataclass(frozen=True)
class WallSlide:
    """How far a machine slides off a wall, and how sharply.

    Attributes:
        off_m: Across.
        forward_1pm2: Sharpness of its bends off a wall forward, and to a wall backward.
        backward_1pm2: Sharpness of its bends off a wall backward, and to a wall forward.
        both: Whether strokes are left forward and joined by slides, too: a turn would swing the body into the wall.
    """

    off_m: float
    forward_1pm2: float
    backward_1pm2: float
    both: bool

    @classmethod
    def of(cls, machine: CoverageMachine, swing_m: float) -> "WallSlide":
        """The sharpest slide of a machine whose body may swing out by so much (m)."""
        sharpest = machine.sharpness_max_1pm2
        if _swing_m(machine, sharpest, -1) <= swing_m:
            return cls(SLIDE_M, sharpest, sharpest, both=False)
        return cls(SLIDE_M, _sharpness(machine, swing_m, 1), _sharpness(machine, swing_m, -1), both=True)

    def pieces(self, direction: int, *, onto: bool = False) -> tuple[Piece, ...]:
        """Two bends that lead to the left of the heading, off a wall, or onto a stroke beside one."""
        return _slide(self.forward_1pm2 if (direction > 0) != onto else self.backward_1pm2, direction)


def _slide(sharpness_1pm2: float, direction: int) -> tuple[Piece, ...]:
    ramp = (0.5 * SLIDE_M / sharpness_1pm2) ** (1.0 / 3.0)
    peak = sharpness_1pm2 * ramp
    signs = ((0.0, 1.0), (peak, -1.0), (0.0, -1.0), (-peak, 1.0))
    return tuple(Piece(ramp, bend, sign * sharpness_1pm2, direction) for bend, sign in signs)


def _sharpness(machine: CoverageMachine, swing_m: float, direction: int) -> float:
    """The largest sharpness (1/m²) that keeps the swing, about."""
    sharpness = machine.sharpness_max_1pm2
    for _ in range(GENTLER_MOST):
        if _swing_m(machine, sharpness, direction) <= swing_m:
            break
        sharpness *= GENTLER
    return sharpness


def _swing_m(machine: CoverageMachine, sharpness_1pm2: float, direction: int) -> float:
    """How far the body gets beyond a wall at its right on a slide to the left."""
    path = PiecePath(PathPose(0.0, 0.0, 0.0), _slide(sharpness_1pm2, direction))
    _, y, heading, _ = path.sample(np.linspace(0.0, path.length_m, LOOKED_AT))
    sides = [y + np.sin(heading) * ahead + np.cos(heading) * left for ahead, left in machine.outline]
    return float(-machine.beside_m - np.min(sides))

"""Runs of a path between standstills, as the curves that are travelled."""

import math
from typing import NamedTuple

from touchline.services.planner.geometry.clothoid import PathPose, Piece, PiecePath


class Run(NamedTuple):
    """A turn on the spot (or none: 0), then a path driven in one direction.

    The path's heading is the direction of travel, opposite to the robot's heading if it drives backward; `goal` is its
    end but for rounding.
    """

    spin_rad: float
    direction: int
    path: PiecePath
    goal: PathPose | None = None


def runs(path: PiecePath, goal: PathPose | None = None) -> list[Run]:
    """Divide a path into runs; the last one leads to `goal`, which is the path's end but for rounding."""
    found: list[Run] = []
    for piece, before in zip(path.pieces, path.knots, strict=False):
        last = found[-1] if found else None
        if last and not piece.spin_rad and piece.direction == last.direction:
            driven = PiecePath(last.path.start, (*last.path.pieces, _as_travelled(piece)))
            found[-1] = last._replace(path=driven)
        else:
            turned = before._replace(heading_rad=before.heading_rad + piece.spin_rad)
            pieces = (_as_travelled(piece),) if piece.length_m else ()
            start = _travelling(turned, piece.direction)
            found.append(Run(piece.spin_rad, piece.direction, PiecePath(start, pieces)))
    if found and goal is not None and found[-1].path.pieces:
        found[-1] = found[-1]._replace(goal=_travelling(goal, found[-1].direction))
    return found


def _travelling(pose: PathPose, direction: int) -> PathPose:
    """Replace the heading of a pose by the direction of travel."""
    return pose if direction > 0 else pose._replace(heading_rad=pose.heading_rad + math.pi)


def _as_travelled(piece: Piece) -> Piece:
    """Convert a piece to one driven forward: backward, the robot's left is the path's right."""
    sign = piece.direction
    return Piece(piece.length_m, sign * piece.curvature_1pm, sign * piece.sharpness_1pm2)

"""What a plan passes over with a tool that covers, all along it or as far as its robot has come."""

import math

import numpy as np

from touchline.services.planner.coverage.drum_sweep import swept
from touchline.services.planner.coverage.shapes import Area as Ground
from touchline.services.planner.geometry.clothoid import Piece, PiecePath
from touchline.services.planner.plan import Plan


def swept_by(plan: Plan, width_m: float, until_m: float = math.inf) -> Ground:
    """What is passed over until an arc length of what is sent.

    Args:
        plan: The plan.
        width_m: Of its tool, which lies across its way.
        until_m: How far the robot has come.
    """
    ideal_at = np.array([0.0, *(line.ideal_to_m for line in plan.sent)])
    sent_at = np.array([0.0, *(line.end_m for line in plan.sent)])
    left_m = float(np.interp(until_m, sent_at, ideal_at))
    paths = list[PiecePath]()
    for section in plan.sections:
        if left_m <= 0.0:
            break
        paths.append(begun_of(section.path, left_m))
        left_m -= section.path.length_m
    return swept(paths, width_m)


def begun_of(path: PiecePath, length_m: float) -> PiecePath:
    """A path as far as that, or all of it."""
    pieces, left_m = list[Piece](), length_m
    for piece in path.pieces:
        if left_m <= 0.0:
            break
        pieces.append(piece._replace(length_m=min(piece.length_m, left_m)))
        left_m -= piece.length_m
    return PiecePath(path.start, tuple(pieces))

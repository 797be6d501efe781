"""Paths of a moving robot that join a way from rest without a stop."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from touchline.services.planner.free_space.legs import WalledBody
from touchline.services.planner.free_space.rounded_legs import path_is_free
from touchline.services.planner.geometry.clothoid import PathPose, PiecePath, joined
from touchline.services.planner.poses.g2_path import moving_paths
from touchline.services.planner.poses.traveller import Traveller
from touchline.services.planner.speed.topp import path_time
from touchline.services.planner.steering.method import CurveEnd

# Places at which a way may be joined: their spacing along it, and the furthest (m).
SPACING_M: Final = 0.4
FURTHEST_M: Final = 6.0


def joining_paths(start: CurveEnd, way: PiecePath, traveller: Traveller, body: WalledBody) -> list[PiecePath]:
    """Paths from amid a drive that go over into a way on one of its forward straights, the quickest first.

    Args:
        start: Pose, curvature and speed of the robot.
        way: The way from rest at that pose.
        traveller: The vehicle.
        body: The body among walls.
    """
    found = []
    for place, rest in _straights(way):
        for path in moving_paths(start, CurveEnd(place, 0.0), traveller):
            if all(piece.direction > 0 and not piece.spin_rad for piece in path.pieces) and path_is_free(path, body):
                found.append(PiecePath(path.start, joined((*path.pieces, *rest.pieces))))
                break
    return sorted(found, key=lambda path: _seconds(path, start.speed_mps, traveller))


def _straights(way: PiecePath) -> Iterator[tuple[PathPose, PiecePath]]:
    """Places on the forward straights of a way, and the way from there."""
    for k, (piece, station) in enumerate(zip(way.pieces, way.stations, strict=False)):
        if piece.spin_rad or piece.direction < 0 or piece.curvature_1pm or piece.sharpness_1pm2:
            continue
        count = 1 + int(min(piece.length_m, max(FURTHEST_M - station, 0.0)) / SPACING_M)
        for at in np.linspace(0.0, piece.length_m, count, endpoint=False).tolist() if station < FURTHEST_M else ():
            place = way.knots[k].moved(piece.displacement_at(at), 0.0)
            rest = (piece._replace(length_m=piece.length_m - at), *way.pieces[k + 1 :])
            yield place, PiecePath(place, rest)


def _seconds(path: PiecePath, speed_mps: float, traveller: Traveller) -> float:
    table = np.array(path.pieces, dtype=np.float64).reshape(-1, 5)
    return float(path_time(table, len(table), speed_mps, 0.0, traveller.limits.caps))

"""Durations of paths from rest to rest."""

from collections.abc import Sequence

import numpy as np

from touchline.services.planner.geometry.clothoid import Piece
from touchline.services.planner.poses.traveller import Traveller
from touchline.services.planner.speed.topp import path_time


def rest_to_rest_s(pieces: Sequence[Piece], traveller: Traveller) -> float:
    """Minimum time (s) from rest to rest along pieces."""
    table = np.array(pieces, dtype=np.float64).reshape(-1, 5)
    return float(path_time(table, len(table), 0.0, 0.0, traveller.limits.caps))


def quickest(offers: Sequence[tuple[Piece, ...]], traveller: Traveller) -> tuple[Piece, ...]:
    """Choose the quickest offer; the first of equals."""
    return min(offers, key=lambda pieces: rest_to_rest_s(pieces, traveller))

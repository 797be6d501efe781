"""Retry limit: number of times that the robot continues by itself before it asks its operator."""

from __future__ import annotations

import math

MAX_TRIES = 3
"""Largest number of tries from about the same place."""
SAME_PLACE_M = 1.0


class Tries:
    """Counter of successive tries to continue by itself from one place."""

    def __init__(self) -> None:
        """Begin without tries."""
        self._count, self._place_m = 0, -math.inf

    def another(self, place_m: float) -> bool:
        """Count a try at this arc length [m]; return False if it is one too many."""
        self._count = self._count + 1 if abs(place_m - self._place_m) < SAME_PLACE_M else 1
        self._place_m = place_m
        return self._count <= MAX_TRIES

    def forgive(self) -> None:
        """Start counting anew, because the operator has looked."""
        self._count = 0

"""Borders of regions: a grid of rectangles, and the halo in which the robots of one may come near to another's."""

from __future__ import annotations

import math
from bisect import bisect_right
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Final

from touchline.coordination.plans.plan_kernels import PlanLimits
from touchline.core import timed_motion as t

SLACK_M: Final = 0.1
"""Distance that a region's plans may lead beyond its border, more than a plan reaches."""


def reach_m(limits: PlanLimits) -> float:
    """Return how far a plan leads from where it begins, at most: v·T + v²/(2·a)."""
    speed_mps = limits.speed_max_mps
    return speed_mps * limits.brakes_at * t.STEP_S + 0.5 * speed_mps * speed_mps / limits.acceleration_mps2


def halo_m(limits: PlanLimits) -> float:
    """Return the width of the halo: two reaches, the least distance of two plans and the slack."""
    return 2.0 * reach_m(limits) + limits.apart_m + SLACK_M


@dataclass(frozen=True)
class RegionBorders:
    """Rectangles of regions, in rows.

    Attributes:
        xs_m: Borders across x, rising; the outermost belong to the area.
        ys_m: Borders across y.
        halo_m: Width of the halo outside a region.
    """

    xs_m: tuple[float, ...]
    ys_m: tuple[float, ...]
    halo_m: float

    @cached_property
    def _rectangles(self) -> list[tuple[float, float, float, float]]:
        return [self.rectangle(region) for region in range(self.count)]

    @property
    def count(self) -> int:
        """Number of regions."""
        return (len(self.xs_m) - 1) * (len(self.ys_m) - 1)

    def rectangle(self, region: int) -> tuple[float, float, float, float]:
        """Return a region's least x and y, and greatest x and y (m)."""
        row, column = divmod(region, len(self.xs_m) - 1)
        return self.xs_m[column], self.ys_m[row], self.xs_m[column + 1], self.ys_m[row + 1]

    def at(self, x_m: float, y_m: float) -> int:
        """Return the region of a place; outside of the area the nearest one's."""
        column = min(max(bisect_right(self.xs_m, x_m) - 1, 0), len(self.xs_m) - 2)
        row = min(max(bisect_right(self.ys_m, y_m) - 1, 0), len(self.ys_m) - 2)
        return row * (len(self.xs_m) - 1) + column

    def off_m(self, region: int, x_m: float, y_m: float) -> float:
        """Return the distance of a place from a region; 0 within."""
        left, low, right, high = self._rectangles[region]
        return math.hypot(max(left - x_m, 0.0, x_m - right), max(low - y_m, 0.0, y_m - high))

    def near(self, x_m: float, y_m: float) -> frozenset[int]:
        """Return the regions within whose halo a plan begins: of others no plan can come near to it."""
        return frozenset(each for each in range(self.count) if self.off_m(each, x_m, y_m) <= self.halo_m)

    def neighbours(self, region: int) -> frozenset[int]:
        """Return the regions that border on one, corners included."""
        columns = len(self.xs_m) - 1
        row, column = divmod(region, columns)
        rows = range(max(row - 1, 0), min(row + 2, len(self.ys_m) - 1))
        beside = range(max(column - 1, 0), min(column + 2, columns))
        return frozenset(r * columns + c for r, c in product(rows, beside)) - {region}

"""Figures of one line's paint."""

from typing import NamedTuple

from touchline.services.robot_sim.paint.paint_areas import Areas


class LateralError(NamedTuple):
    """Distance of the nozzle from its line over the painted ticks [m]; zeros when nothing was painted."""

    mean_m: float
    p95_m: float
    max_m: float


class SegmentMetrics(NamedTuple):
    """Figures of one line."""

    id: str
    length_m: float
    covered_m: float
    within_m: float
    """Length over which the middle of the paint is within the tolerance."""
    width_m: float
    """Painted area per length of the line along which that paint runs; 0 without paint."""
    areas: Areas
    lateral: LateralError

    @property
    def gap_m(self) -> float:
        """Length without paint."""
        return max(0.0, self.length_m - self.covered_m)

    @property
    def coverage_pct(self) -> float:
        """Share of the length under paint [%]."""
        return min(100.0, 100.0 * self.covered_m / self.length_m)

    @property
    def area_coverage_pct(self) -> float:
        """Share of the area under paint [%]."""
        return min(100.0, 100.0 * self.areas.covered_m2 / self.areas.wanted_m2)

    @property
    def lacks_m(self) -> float:
        """Length without paint within the tolerance."""
        return max(0.0, self.length_m - self.within_m)

    @property
    def within_pct(self) -> float:
        """Share of the length over which the middle of the paint is within the tolerance [%]."""
        return min(100.0, 100.0 * self.within_m / self.length_m)

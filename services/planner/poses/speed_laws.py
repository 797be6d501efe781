"""Speed laws between two poses: as fast as the limits allow, or by a polynomial of time.

With τ = t/T from 0 to 1, a law s(τ) drives a curve p(s) with v = |p'(s)|·s'(τ)/T, where T may be given if it is not
below the minimum of the limits (Siciliano et al., "Robotics: Modelling, Planning and Control", 4.2 and 11.5.3). Where
the robot stops, at cusps and turns on the spot, the law applies to each stretch in between, over its arc length.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from touchline.schemas.errors import PlanningError
from touchline.services.planner.geometry.clothoid import Floats
from touchline.services.planner.limits import Limits
from touchline.services.planner.poses.kernels.law_fits import fits
from touchline.services.planner.poses.pose_method import CurveProgress
from touchline.services.planner.speed.path_grid import PathGrid
from touchline.services.planner.speed.timing import SpeedProfile, speed_profile, spins_of

if TYPE_CHECKING:
    from scipy.interpolate import CubicHermiteSpline

# τ of the first entry after a standstill, and ratio of the τ of successive entries; likewise at the end. So v², linear
# between entries, is within 0.5 % of the law.
FIRST_ENTRY, ENTRY_RATIO = 1e-3, 1.06
HALVINGS = 60
# Fraction by which a duration may be below the minimum, as rounding.
ROUNDING = 1e-6


class SpeedLaw(NamedTuple):
    """Law s(τ) and its derivative, from rest to rest unless `moving`; both functions map (n,) to (n,)."""

    s: Callable[[Floats], Floats]
    rate: Callable[[Floats], Floats]
    moving: bool = False


LIMITS: Final = None
UNIFORM: Final = SpeedLaw(lambda tau: tau, np.ones_like, moving=True)
CUBIC: Final = SpeedLaw(lambda tau: tau**2 * (3.0 - 2.0 * tau), lambda tau: 6.0 * tau * (1.0 - tau))
QUINTIC: Final = SpeedLaw(
    lambda tau: tau**3 * (10.0 - 15.0 * tau + 6.0 * tau**2), lambda tau: 30.0 * (tau * (1.0 - tau)) ** 2
)


def rates_over(law: SpeedLaw, s: Floats) -> Floats:
    """Rates s'(τ) (n,) of a law at values of s (n,), from 0 to 1."""
    return np.asarray(law.rate(_when(law.s, s)))


def _when(s_of: Callable[[Floats], Floats], wanted: Floats) -> Floats:
    """Values of τ (n,), from 0 to 1, at which an increasing function has the wanted values (n,), by bisection."""
    low, high = np.zeros(len(wanted)), np.ones(len(wanted))
    for _ in range(HALVINGS):
        tau = 0.5 * (low + high)
        beyond = s_of(tau) > wanted
        low, high = np.where(beyond, low, tau), np.where(beyond, tau, high)
    return 0.5 * (low + high)


@dataclass(frozen=True)
class LawStretch:
    """Stretch of path between standstills, from arc length `start_m` to `end_m`, and its law."""

    start_m: float
    end_m: float
    law: SpeedLaw
    progress: CubicHermiteSpline

    def entries_m(self) -> Floats:
        """Arc lengths (n,) of the entries of the profile."""
        count = math.ceil(math.log(0.5 / FIRST_ENTRY) / math.log(ENTRY_RATIO))
        early = np.geomspace(FIRST_ENTRY, 0.5, count)
        tau = np.concatenate((early, 1.0 - early[-2::-1]))
        return np.asarray(self.start_m + (self.end_m - self.start_m) * self.progress(self.law.s(tau)))

    def speeds(self, station_m: Floats) -> Floats:
        """Speeds (n,) (m/s) at arc lengths (n,), for a duration of one second."""
        length_m = self.end_m - self.start_m
        tau = _when(lambda at: self.progress(self.law.s(at)), (station_m - self.start_m) / length_m)
        speed = length_m * self.progress(self.law.s(tau), 1) * self.law.rate(tau)
        if not self.law.moving:
            speed[[0, -1]] = 0.0
        return np.asarray(speed)


def timed(
    grid_of: Callable[[Floats], PathGrid],
    law: SpeedLaw | None,
    duration_s: float,
    limits: Limits,
    progress: CurveProgress | None = None,
) -> SpeedProfile:
    """Compute the speed profile along a path for a wanted duration.

    Args:
        grid_of: Creates the path's cells, with additional borders at arc lengths (n,).
        law: Speed law; None: as fast as the limits allow, slowed evenly.
        duration_s: Wanted duration; 0: the minimum.
        limits: Limits of the plan.
        progress: Progress along a curve with a parameter of its own.

    Raises:
        PlanningError: The duration is shorter than the minimum, which the error gives, or the law cannot stop.
    """
    grid = grid_of(np.zeros(0))
    fastest = (
        speed_profile(grid, (), limits) if law is None else _by_law(grid_of, _stretches(grid, law, progress), limits)
    )
    return fastest if duration_s == 0.0 else _slowed(fastest, duration_s)


def _slowed(fastest: SpeedProfile, duration_s: float) -> SpeedProfile:
    """Scale a profile to a longer duration; turns on the spot stay as they are."""
    least_s, turning_s = fastest.total_time_s, float(fastest.dwell_s.sum())
    if not duration_s >= least_s * (1.0 - ROUNDING):
        raise PlanningError(
            "", f"has duration_s = {duration_s:g}", f"give at least {math.ceil(1e3 * least_s) / 1e3:g} s, or 0"
        )
    if not math.isfinite(duration_s):
        raise PlanningError("", f"has duration_s = {duration_s:g}", "give seconds, or 0 for the least")
    slower = (duration_s - turning_s) / (least_s - turning_s)
    return replace(fastest, speed_mps=fastest.speed_mps / slower)


def _stretches(grid: PathGrid, law: SpeedLaw, progress: CurveProgress | None) -> list[LawStretch]:
    """Divide a path at its standstills into stretches of the law.

    Raises:
        PlanningError: The law cannot stop.
    """
    if law.moving and (grid.stops or grid.spins):
        raise PlanningError(
            "",
            "has a uniform speed law, but the path has cusps or turns on the spot, where the robot stops",
            "give another speed law, or a pose method without cusps (dubins, or g2 with forward_only)",
        )
    along = _shares(progress)
    stops = np.unique([0, *grid.stops, len(grid.station_m) - 1])
    return [LawStretch(*ends, law, along) for ends in pairwise(grid.station_m[stops].tolist())]


def _shares(progress: CurveProgress | None) -> CubicHermiteSpline:
    """Fraction of a curve's length as a function of its parameter; None: its arc length is the parameter."""
    from scipy.interpolate import CubicHermiteSpline

    if progress is None:
        return CubicHermiteSpline([0.0, 1.0], [0.0, 1.0], [1.0, 1.0])
    whole_m = progress.station_m[-1]
    return CubicHermiteSpline(progress.at, progress.station_m / whole_m, progress.rate_m / whole_m)


def _by_law(grid_of: Callable[[Floats], PathGrid], stretches: list[LawStretch], limits: Limits) -> SpeedProfile:
    """Fastest profile in which every stretch keeps its law."""
    grid = grid_of(np.concatenate([stretch.entries_m() for stretch in stretches]))
    speed = np.zeros(len(grid.station_m))
    for stretch in stretches:
        first, last = np.searchsorted(grid.station_m, (stretch.start_m, stretch.end_m))
        knots, cells = slice(first, last + 1), slice(first, last)
        shape = stretch.speeds(grid.station_m[knots])
        speed[knots] = np.maximum(speed[knots], shape * math.sqrt(_largest(grid, cells, np.square(shape), limits)))
    return SpeedProfile(grid.station_m, speed, spins_of(grid, limits))


def _largest(grid: PathGrid, cells: slice, square: Floats, limits: Limits) -> float:
    """Factor on v² (n + 1,) of some cells that brings them to the limits."""
    columns = (grid.length_m[cells], grid.curvature_1pm[cells], grid.sharpness_1pm2[cells], grid.square_cap[cells])
    high = float(np.min(columns[3] / np.maximum(square[1:], square[:-1])))
    low = 0.0
    if fits(*columns, high * square, limits.caps):
        return high
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if fits(*columns, middle * square, limits.caps) else (low, middle)
    return low

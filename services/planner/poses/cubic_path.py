"""Method `cubic`: one cubic curve from pose to pose (see kernels/cubic_curve.py), approximated by clothoids.

With given tangent lengths it is that of a study on a small robot; else they are chosen for the quickest curve that the
vehicle can drive. Where no such curve is found, or none is worth it, the path is planned by `g2`.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from touchline.schemas.errors import PlanningError
from touchline.services.planner.geometry.clothoid import PathPose, Piece, PiecePath
from touchline.services.planner.poses.cubic_clothoids import Clothoids, clothoids
from touchline.services.planner.poses.dubins_paths import with_heading
from touchline.services.planner.poses.g2_path import G2Path
from touchline.services.planner.poses.kernels.cubic_curve import (
    FINE,
    QUICKER,
    SLOWEST_SHARE,
    CubicCurve,
    Terms,
    cubic_curve,
    price,
    quickest_lengths,
    tangent,
)
from touchline.services.planner.poses.kernels.turned_line import turned_line_s
from touchline.services.planner.poses.pose_method import CurveProgress, PosePath
from touchline.services.planner.poses.speed_laws import SpeedLaw, rates_over
from touchline.services.planner.poses.traveller import Traveller

# Tolerance of clothoids (m): together with the arcs that approximate them, they stay within a millimetre of the curve.
NEAR_M = 1e-4
CELLS_LEAST, CELLS_MOST = 24, 1536
# A curve that turns by less over its whole length (rad) is a line.
STRAIGHT_RAD = 1e-11
ORIGIN: Final = PathPose(0.0, 0.0, 0.0)
# Fraction of the maximum curvature that curves may use, as clothoids bend a little more than the curve.
CURVATURE_SHARE = 0.98


@dataclass(frozen=True)
class CubicPath:
    """Cubic curves with tangents of given lengths (m), or of chosen ones.

    Attributes:
        tangents_m: k_i and k_f, one for both, or none to choose them. Negative: driven backward.
        law: Speed law of the drive, which decides which curve is the quickest.
    """

    tangents_m: tuple[float, ...] = ()
    law: SpeedLaw | None = None

    def between(self, start: PathPose, goal: PathPose, traveller: Traveller) -> PosePath:
        """Plan the curve; see `PoseMethod`.

        Raises:
            PlanningError: The vehicle cannot drive the curve with the given lengths.
        """
        aimed, note = with_heading(start, goal, traveller.limits.curvature_max_1pm)
        terms = self._terms(abs(aimed.point - start.point), traveller)
        if self.tangents_m:
            lengths = self.tangents_m[0], self.tangents_m[-1]
            _check(lengths, curve_of(start, aimed, lengths), terms, traveller)
        else:
            seen, turn = aimed.seen_from(start)
            lengths = chosen_lengths(seen, turn, traveller, terms)
        made = None
        if math.isfinite(lengths[0]):
            made = made_of_clothoids(
                start, curve_of(start, aimed, lengths), lengths[0], traveller.limits.curvature_max_1pm
            )
        if made:
            return PosePath(made.path, note, made.progress)
        fallback = G2Path().between(start, aimed, traveller)
        wanted = " that is as quick as turn, line, turn" if _must_be_quick(traveller, terms) else ""
        bound = f"no cubic curve within {traveller.limits.curvature_max_1pm:.3g} 1/m found{wanted}, so by g2"
        return PosePath(fallback.path, "; ".join(filter(None, (note, bound))))

    def _terms(self, distance_m: float, traveller: Traveller) -> Terms:
        rates = rates_over(self.law, np.linspace(0.0, 1.0, FINE + 1)) if self.law else np.zeros(0)
        tightest = CURVATURE_SHARE * traveller.limits.curvature_max_1pm
        return Terms(tightest, SLOWEST_SHARE * distance_m, rates, traveller.limits.caps)


def chosen_lengths(goal: complex, turn: float, traveller: Traveller, terms: Terms) -> tuple[float, float]:
    """Tangent lengths (k_i, k_f) (m) of the quickest cubic curve from the origin, heading along +x, if worth it.

    With bounded curvature, some goals take long detours. A vehicle that can turn on the spot is quicker by turn, line,
    turn; so a curve must not take longer than that. With a speed law it may: that law would begin again after each
    standstill or, as the uniform one, cannot stand at all.

    Args:
        goal: x + iy (m).
        turn: Heading at the goal (rad).
        traveller: Vehicle with its limits and abilities.
        terms: Constraints of the drive.

    Returns:
        NaN twice, if no candidate keeps to the terms, or the quickest is not worth it.
    """
    lengths: tuple[float, float] = quickest_lengths(goal, turn, traveller.can_reverse, terms)
    if not _must_be_quick(traveller, terms) or math.isnan(lengths[0]):
        return lengths
    curve = curve_of(ORIGIN, ORIGIN.moved(goal, turn), lengths)
    turned_s = turned_line_s(goal, turn, traveller.can_reverse, terms)
    slow = price(curve, terms, FINE) > turned_s * (1.0 + QUICKER)
    return (math.nan, math.nan) if slow else lengths


def _must_be_quick(traveller: Traveller, terms: Terms) -> bool:
    return traveller.can_spin and len(terms.rates) == 0


def curve_of(start: PathPose, goal: PathPose, tangents_m: tuple[float, float]) -> CubicCurve:
    """Cubic curve between two poses with tangents of these lengths (m)."""
    leaving, arriving = tangents_m
    curve: CubicCurve = cubic_curve(start.point, goal.point, leaving * start.direction, arriving * goal.direction)
    return curve


def made_of_clothoids(start: PathPose, curve: CubicCurve, tangent_m: float, tightest_1pm: float) -> PosePath | None:
    """Approximate a cubic curve by clothoids, driven backward if `tangent_m` is negative; None if it takes too many.

    They are within NEAR_M of it, with a curvature of at most `tightest_1pm`.

    Args:
        start: Start of the path (m, rad).
        curve: Cubic curve.
        tangent_m: Length of its first tangent; negative: driven backward.
        tightest_1pm: Maximum curvature of the clothoids.
    """
    sense = 1 if tangent_m > 0.0 else -1
    cells = CELLS_LEAST
    while cells <= CELLS_MOST:
        found = clothoids(curve, cells)
        if found.off <= NEAR_M and np.abs(found.curvature).max() <= tightest_1pm:
            return PosePath(PiecePath(start, _pieces(found, sense)), progress=_progress(curve, found))
        cells *= 2
    return None


def _pieces(found: Clothoids, sense: int) -> tuple[Piece, ...]:
    """Pieces of clothoids; curvature changes its sign where the robot drives backward."""
    length, curvature = found.length, sense * found.curvature
    if np.abs(curvature).max() * length.sum() < STRAIGHT_RAD:
        return (Piece(float(length.sum()), direction=sense),)
    rows = zip(length.tolist(), curvature[:-1].tolist(), (np.diff(curvature) / length).tolist(), strict=True)
    return tuple(Piece(*row, sense) for row in rows)


def _progress(curve: CubicCurve, found: Clothoids) -> CurveProgress:
    return CurveProgress(found.at, np.concatenate(([0.0], np.cumsum(found.length))), np.abs(tangent(curve, found.at)))


def _check(lengths: tuple[float, float], curve: CubicCurve, terms: Terms, traveller: Traveller) -> None:
    """Refuse tangent lengths with which the vehicle cannot drive the curve.

    Raises:
        PlanningError: The curve is too tight, or needs reversing.
    """
    given = ", ".join(f"{length:g}" for length in lengths)
    if not all(map(math.isfinite, lengths)) or lengths[0] * lengths[1] <= 0.0:
        raise PlanningError("", f"has k = {given}", "give one or two lengths (m) of one sign, or none: they are chosen")
    if lengths[0] < 0.0 and not traveller.can_reverse:
        raise PlanningError("", f"has k = {given}, but may not drive backward", "give positive lengths, or none")
    if math.isinf(price(curve, terms, FINE)):
        raise PlanningError(
            "",
            f"has k = {given}, with which the curve bends by more than {traveller.limits.curvature_max_1pm:.3g} 1/m or "
            "nearly stands",
            "leave k out: it is chosen, or give the pose method g2",
        )

"""Minimum times to goals within the studied robot's limits: the study's curves, chosen ones, and others."""

import math
from typing import Final

import numpy as np

from touchline.services.planner.geometry.clothoid import Floats, PathPose, PiecePath
from touchline.services.planner.poses.cubic_path import CURVATURE_SHARE, chosen_lengths, curve_of
from touchline.services.planner.poses.g2_path import paths_by_g2
from touchline.services.planner.poses.kernels.cubic_curve import SLOWEST_SHARE, Terms, price, quickest_lengths
from touchline.services.planner.poses.shipped_methods import TURN_LINE_TURN
from touchline_research.target_table import TargetRow, TargetTable, against_targets
from touchline_research.tracking.studied_robot import (
    ORIGIN,
    SPEED_MPS,
    STUDY_CAPS,
    STUDY_TANGENT_M,
    WAFFLE,
    YAW_RADPS,
    goals_anywhere,
)

BY_LIMITS: Final = np.zeros(0)
ANY: Final = Terms(math.inf, 0.0, BY_LIMITS, STUDY_CAPS)
TIGHTEST_1PM: Final = CURVATURE_SHARE * WAFFLE.limits.curvature_max_1pm
# Samples of a cubic curve with a standstill, and of a piece of a path.
VERY_FINE, PER_PIECE = 20_000, 33
# Targets: the median, its ratio to the median of k = 10 (25.0 s in the source of those figures), the mean of ratios.
MEDIAN_S, OF_MEDIAN, RATIO = 16.2, 16.2 / 25.0, 0.61


def least_times(count: int) -> TargetTable:
    """Create the table over a number of goals."""
    goals = goals_anywhere(count)
    fixed = np.array([_given_s(goal, STUDY_TANGENT_M) for goal in goals])
    by_g2 = np.array([_g2_s(goal) for goal in goals])
    kept, ours = (np.array([seconds_to(goal) for goal in goals]) for seconds_to in (_kept_s, _worthwhile_s))
    found, taken = (f"{np.isfinite(seconds).mean():.0%}" for seconds in (kept, ours))
    methods: list[tuple[str, Floats, bool]] = [
        ("k = 10: the study", fixed, False),
        ("k = distance", np.array([_given_s(goal, abs(goal.point)) for goal in goals]), False),
        ("chosen k, forward", np.array([_chosen_s(goal, backward=False) for goal in goals]), False),
        ("chosen k, and backward", np.array([_chosen_s(goal, backward=True) for goal in goals]), False),
        (f"the same, curvature kept ({found}), else g2", np.where(np.isfinite(kept), kept, by_g2), False),
        (
            f"ours: cubic, curvature kept, if as quick as turn, line, turn ({taken}), else g2",
            np.where(np.isfinite(ours), ours, by_g2),
            True,
        ),
        ("ours: g2, curvature kept", by_g2, True),
        ("turn, line, turn", np.array([_turning_s(goal) for goal in goals]), False),
    ]
    note = (
        f"Within {SPEED_MPS} m/s and {YAW_RADPS} rad/s, each by itself, without a limit of acceleration. Kept means at "
        f"most {WAFFLE.limits.curvature_max_1pm:.2f} 1/m, the robot's. Straight there at full speed, turned or not, "
        f"would take {np.median([abs(goal.point) / SPEED_MPS for goal in goals]):.2f} s."
    )
    return TargetTable(
        f"Least time to {count} goals in [-5, 5]² m with any heading",
        ("path", "median", "mean ratio to k = 10", "slower than that", "reached"),
        tuple(_row(name, seconds, fixed, ours=ours) for name, seconds, ours in methods),
        note,
    )


def _row(name: str, seconds: Floats, fixed: Floats, *, ours: bool) -> TargetRow:
    there = np.isfinite(seconds)
    found, ratio = int(np.count_nonzero(there)), float(np.mean((seconds / fixed)[there]))
    median, slower = float(np.median(seconds)), int(np.count_nonzero((seconds > fixed * (1.0 + 1e-9))[there]))
    asked = [
        (f"median ≤ {MEDIAN_S} s", median <= MEDIAN_S),
        (f"≤ {OF_MEDIAN:.3f} of that of k = 10", median <= OF_MEDIAN * float(np.median(fixed))),
        (f"ratio ≤ {RATIO}", ratio <= RATIO),
        ("none slower", slower == 0),
        ("all reached", found == len(seconds)),
    ]
    figures = {"median_s": median, "mean_ratio": ratio, "slower": slower, "reached": found}
    cells = (name, f"{median:.2f} s", f"{ratio:.3f}", str(slower), f"{found} of {len(seconds)}")
    return TargetRow(cells, *against_targets(asked if ours else []), figures)


def _given_s(goal: PathPose, tangent_m: float) -> float:
    return float(price(curve_of(ORIGIN, goal, (tangent_m, tangent_m)), ANY, VERY_FINE))


def _chosen_s(goal: PathPose, *, backward: bool) -> float:
    """Seconds along the chosen cubic curve, of any curvature."""
    return _curve_s(goal, quickest_lengths(goal.point, goal.heading_rad, backward, _terms(goal, math.inf)))


def _kept_s(goal: PathPose) -> float:
    """Seconds along the chosen curve within the robot's curvature; infinite if there is none."""
    return _curve_s(goal, quickest_lengths(goal.point, goal.heading_rad, True, _terms(goal, TIGHTEST_1PM)))


def _worthwhile_s(goal: PathPose) -> float:
    """Seconds along the curve that the method `cubic` chooses."""
    return _curve_s(goal, chosen_lengths(goal.point, goal.heading_rad, WAFFLE, _terms(goal, TIGHTEST_1PM)))


def _terms(goal: PathPose, tightest_1pm: float) -> Terms:
    return Terms(tightest_1pm, SLOWEST_SHARE * abs(goal.point), BY_LIMITS, STUDY_CAPS)


def _curve_s(goal: PathPose, lengths: tuple[float, float]) -> float:
    return float(price(curve_of(ORIGIN, goal, lengths), ANY, VERY_FINE)) if math.isfinite(lengths[0]) else math.inf


def _g2_s(goal: PathPose) -> float:
    """Seconds along the quickest path of `g2` within these limits, without its own limits of acceleration."""
    return min(_path_s(path) for path in paths_by_g2(ORIGIN, goal, WAFFLE))


def _turning_s(goal: PathPose) -> float:
    return _path_s(TURN_LINE_TURN.between(ORIGIN, goal, WAFFLE).path)


def _path_s(path: PiecePath) -> float:
    """Seconds along pieces, turns on the spot included."""
    seconds = 0.0
    for piece in path.pieces:
        curvature = np.abs(piece.curvature_1pm + piece.sharpness_1pm2 * np.linspace(0.0, piece.length_m, PER_PIECE))
        pace = np.maximum(1.0 / SPEED_MPS, curvature / YAW_RADPS)
        seconds += piece.length_m * float(np.mean(pace)) + abs(piece.spin_rad) / YAW_RADPS
    return seconds

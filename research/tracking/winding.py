"""Total turn of cubic curves to goals ahead: with long tangents they wind."""

import math

import numpy as np

from touchline.services.planner.geometry.clothoid import Floats, PathPose
from touchline.services.planner.poses.cubic_path import CubicPath, curve_of
from touchline.services.planner.poses.kernels.cubic_curve import tangent
from touchline_research.target_table import TargetRow, TargetTable, against_targets
from touchline_research.tracking.studied_robot import ORIGIN, STUDY_TANGENT_M, WAFFLE, goals_ahead

# Samples of a curve for the sum of its turns.
FINE_HEADINGS = 20_000
WOUND_DEG, MOST_DEG = 200.0, 150.0


def winding(count: int) -> TargetTable:
    """Create the table over a number of goals."""
    goals = goals_ahead(count)
    rows = (
        _row("k = 10: the study", np.array([_given_deg(goal, STUDY_TANGENT_M) for goal in goals]), ours=False),
        _row("k = distance", np.array([_given_deg(goal, abs(goal.point)) for goal in goals]), ours=False),
        _row("ours: chosen k", np.array([_chosen_deg(goal) for goal in goals]), ours=True),
    )
    title = f"Turning on the way to {count} goals 0.3 to 8 m off, bearing within ±60°, heading within ±60° of that"
    return TargetTable(title, ("path", "median", "most", f"more than {WOUND_DEG:.0f}°"), rows)


def _row(name: str, turned_deg: Floats, *, ours: bool) -> TargetRow:
    median, most = float(np.median(turned_deg)), float(turned_deg.max())
    wound = float(np.mean(turned_deg > WOUND_DEG))
    asked = [(f"≤ {MOST_DEG:.0f}° in all", most <= MOST_DEG)]
    figures = {"median_deg": median, "most_deg": most, "wound_share": wound}
    return TargetRow(
        (name, f"{median:.0f}°", f"{most:.0f}°", f"{wound:.0%}"), *against_targets(asked if ours else []), figures
    )


def _given_deg(goal: PathPose, tangent_m: float) -> float:
    tangents = tangent(curve_of(ORIGIN, goal, (tangent_m, tangent_m)), np.linspace(0.0, 1.0, FINE_HEADINGS))
    return math.degrees(float(np.abs(np.angle(tangents[1:] / tangents[:-1])).sum()))


def _chosen_deg(goal: PathPose) -> float:
    path = CubicPath().between(ORIGIN, goal, WAFFLE).path
    return math.degrees(sum(abs(piece.turn_at(piece.length_m)) for piece in path.pieces))

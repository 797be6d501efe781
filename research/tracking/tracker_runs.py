"""Trackers on cubic references: started on the path, off it, and facing backward."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np

from touchline.onboard.control.timed.dynamic import DynamicLaw
from touchline.onboard.control.timed.linear import LinearLaw
from touchline.onboard.control.timed.linear_scaled import ScaledLinearLaw
from touchline.onboard.control.timed.nonlinear import NonlinearLaw
from touchline.onboard.control.timed.regularised import RegularisedLaw
from touchline.services.planner.geometry.clothoid import PathPose
from touchline.services.planner.poses.cubic_path import CURVATURE_SHARE, curve_of
from touchline.services.planner.poses.kernels.cubic_curve import (
    FINE,
    SLOWEST_SHARE,
    CubicCurve,
    Terms,
    quickest_lengths,
)
from touchline.services.planner.poses.speed_laws import CUBIC, UNIFORM, SpeedLaw, rates_over
from touchline_research.target_table import TargetRow, TargetTable, against_targets
from touchline_research.tracking.cubic_reference import SLOWER, timed_curve
from touchline_research.tracking.studied_robot import (
    ORIGIN,
    SPEED_MPS,
    STUDY_CAPS,
    STUDY_TANGENT_M,
    WAFFLE,
    YAW_RADPS,
    goals_ahead,
)
from touchline_research.tracking.tracking_loop import (
    IDEAL,
    STEP_S,
    STUDIED,
    Disturbances,
    Tracked,
    by_law,
    track_reference,
)

A_RADPS, ZETA, SCALE_1PM2 = 1.0, 1.0, 10.0
SLOW_MPS: Final = 0.02
LAWS: Final[Mapping[str, Any]] = {
    "linear": LinearLaw(A_RADPS, ZETA),
    "linear-scaled": ScaledLinearLaw(ZETA, SCALE_1PM2),
    "nonlinear": NonlinearLaw(ZETA, SCALE_1PM2),
    "regularised": RegularisedLaw(A_RADPS, ZETA, SLOW_MPS),
    "dynamic": DynamicLaw(A_RADPS, ZETA, SLOW_MPS, STEP_S),
}
SLOWS_MPS: Final = (0.05, 0.01)
"""Further speeds v_ε of the regularised law, for comparison."""
NEAREST_M: Final = 1.0
STARTS: Final = {"on": (0.0, 0.0, 0.0), "off": (-0.15, 0.2, -0.6), "back": (-0.15, 0.2, 2.8)}
"""Initial errors: forward and left (m), heading (rad)."""
SETTLED_M: Final = 0.02
GROUND_TRUTH: Final = IDEAL._replace(most=(SPEED_MPS, YAW_RADPS))

CurveTo = Callable[[PathPose], CubicCurve]


def by_study(goal: PathPose) -> CubicCurve:
    """Create the study's curve, with k = 10."""
    return curve_of(ORIGIN, goal, (STUDY_TANGENT_M, STUDY_TANGENT_M))


def by_distance(goal: PathPose) -> CubicCurve:
    """Create the curve with k as the distance."""
    return curve_of(ORIGIN, goal, (abs(goal.point), abs(goal.point)))


def by_choice(goal: PathPose) -> CubicCurve:
    """Create the quickest curve by the cubic law, forward, within the robot's curvature.

    Raises:
        ValueError: There is no such curve.
    """
    tightest = CURVATURE_SHARE * WAFFLE.limits.curvature_max_1pm
    rates = rates_over(CUBIC, np.linspace(0.0, 1.0, FINE + 1))
    lengths = quickest_lengths(
        goal.point, goal.heading_rad, False, Terms(tightest, SLOWEST_SHARE * abs(goal.point), rates, STUDY_CAPS)
    )
    if math.isnan(lengths[0]):
        raise ValueError(f"no cubic curve within {tightest:.3g} 1/m to {goal}: take a goal ahead")
    return curve_of(ORIGIN, goal, lengths)


class TrackerBounds(NamedTuple):
    """Targets of a tracker; NaN: no target.

    Attributes:
        end_m: 95th percentile of the distance at the end.
        turned_deg: 95th percentile of the heading error there.
        settled_s: Mean time until it stays near, started off the path.
    """

    end_m: float
    turned_deg: float
    settled_s: float


OURS: Final = TrackerBounds(0.003, 1.0, 3.5)


@dataclass(frozen=True)
class TrackerCase:
    """Tracker with its references.

    Attributes:
        name: Name in the table.
        law: Tracking law with its gains.
        curve_to: Creates the reference's curve.
        timing: Speed law of the reference.
        disturbances: Disturbances of robot and measurements.
        asked: Targets; None: for information.
    """

    name: str
    law: Any
    curve_to: CurveTo = by_distance
    timing: SpeedLaw = CUBIC
    disturbances: Disturbances = STUDIED
    asked: TrackerBounds | None = None

    def row(self, goals: Sequence[PathPose]) -> TargetRow:
        """Track to all goals, each with its own noise."""
        references = [timed_curve(self.curve_to(goal), self.timing) for goal in goals]
        runs = {
            start: [
                track_reference(by_law(self.law), reference, offset, self.disturbances, seed)
                for seed, reference in enumerate(references)
            ]
            for start, offset in STARTS.items()
        }
        return _row(self.name, runs, self.asked)


def _row(name: str, runs: Mapping[str, Sequence[Tracked]], asked: TrackerBounds | None) -> TargetRow:
    on, off, back = (runs[start] for start in STARTS)
    rms_m = float(np.sqrt(np.mean(np.concatenate([np.square(run.distance_m) for run in on]))))
    end_m = float(np.percentile([run.distance_m[-1] for run in on], 95.0))
    turned = np.degrees([abs(run.errors[-1, 2]) for run in on])
    turned_deg, most_turned_deg = float(np.percentile(turned, 95.0)), float(turned.max())
    turning, turning_off = _most(on, 1), _most(off, 1)
    settled_s = float(np.mean([settled_after_s(run) for run in off]))
    right = sum(looks_ahead(run) for run in back)
    targets: list[tuple[str, bool]] = []
    if asked:
        targets = [
            (f"at T p95 ≤ {1e2 * asked.end_m:g} cm, {asked.turned_deg:g}°",
             end_m <= asked.end_m and turned_deg <= asked.turned_deg),
            (f"|ω| ≤ {YAW_RADPS} rad/s, on the path and off it", max(turning, turning_off) <= YAW_RADPS),
            (f"settled in ≤ {asked.settled_s:g} s", settled_s <= asked.settled_s),
            (f"{len(back)} of {len(back)} right", right == len(back)),
        ]  # fmt: skip
    cells = (
        name,
        f"{1e2 * rms_m:.2f} cm",
        f"{1e2 * end_m:.2f} cm, {turned_deg:.1f}° (most {most_turned_deg:.1f}°)",
        f"{turning:.3g} rad/s",
        f"{settled_s:.2f} s",
        f"{turning_off:.3g} rad/s, {_most(off, 0):.2f} m/s",
        f"{right} of {len(back)}",
        f"{_most(back, 1):.3g} rad/s",
    )
    figures = {
        "rms_m": rms_m,
        "end_p95_m": end_m,
        "turned_p95_deg": turned_deg,
        "turned_most_deg": most_turned_deg,
        "asked_radps": turning,
        "settled_s": settled_s,
        "asked_off_radps": turning_off,
        "looks_ahead": right,
    }
    return TargetRow(cells, *against_targets(targets), figures)


COLUMNS: Final = (
    "tracker",
    "on the path: rms",
    "at T: p95",
    "largest |ω| asked",
    "0.25 m, 0.6 rad off: settled within 2 cm, mean",
    "largest |ω|, |v| asked",
    "2.8 rad off: ends looking ahead",
    "largest |ω| asked",
)


def _most(runs: Sequence[Tracked], column: int) -> float:
    return max(float(np.abs(run.commands[:, column]).max()) for run in runs)


def settled_after_s(run: Tracked) -> float:
    """Time (s) from which it stays within SETTLED_M of the reference; if it never does, the whole duration."""
    away = np.flatnonzero(run.distance_m > SETTLED_M)
    return STEP_S * float(away[-1] + 1 if len(away) else 0)


def looks_ahead(run: Tracked) -> bool:
    """True if a run ends within a right angle of the reference's heading."""
    return math.cos(run.errors[-1, 2]) > 0.0


def set_up_of_the_study(count: int) -> TargetTable:
    """Table of the study's set-up: its curves, its tracker, ground truth; and ours under the same conditions."""
    cases = (
        TrackerCase("the study: k = 10, linear, uniform law", LAWS["linear"], by_study, UNIFORM, GROUND_TRUTH),
        TrackerCase("the study: k = 10, linear, cubic law", LAWS["linear"], by_study, CUBIC, GROUND_TRUTH),
        TrackerCase("chosen k, linear, cubic law", LAWS["linear"], by_choice, CUBIC, GROUND_TRUTH),
        TrackerCase(
            "ours: chosen k, regularised, cubic law", LAWS["regularised"], by_choice, CUBIC, GROUND_TRUTH, OURS
        ),
    )
    goals = goals_ahead(count, NEAREST_M)
    note = (
        "The study gives no figures, one picture only: these are of our reproduction of its set-up, with goals, "
        f"durations ({SLOWER} times the least) and limits ({SPEED_MPS} m/s, {YAW_RADPS} rad/s) that it does not give."
    )
    title = f"The study's set-up: {count} goals ahead, 1 to 8 m off, ground truth, no noise, 50 Hz"
    return TargetTable(title, COLUMNS, tuple(case.row(goals) for case in cases), note)


def disturbed(count: int) -> TargetTable:
    """Table of all trackers under the same disturbances."""
    cases = [TrackerCase(name, law) for name, law in LAWS.items() if name != "regularised"]
    cases += [TrackerCase(f"regularised, v_ε {v:g} m/s", RegularisedLaw(A_RADPS, ZETA, v)) for v in SLOWS_MPS]
    cases.append(TrackerCase(f"ours: regularised, v_ε {SLOW_MPS:g} m/s", LAWS["regularised"], asked=OURS))
    goals = goals_ahead(count, NEAREST_M)
    note = (
        f"k = distance, cubic law, {SLOWER} times the least duration, 50 Hz, a = 1 rad/s, ζ = 1, b = 10 1/m²; "
        "actuators lag by 0.1 s, drive 2 % too little and turn 3 % too much; 5 mm and 0.3° of white noise are seen. "
        "Speed and yaw rate are scaled down together to the limits. Started 0.24 m behind, trackers ask for more than "
        f"{SPEED_MPS} m/s at first; what they must not ask for is more than {YAW_RADPS} rad/s."
    )
    title = f"Trackers under disturbances: {count} goals ahead, 1 to 8 m off"
    return TargetTable(title, COLUMNS, tuple(case.row(goals) for case in cases), note)

"""The figures of a plan.

Gaps, lengths and times are of what is sent; curvature is the largest of what is sent and of the ideal curve that it
stands for. Sharpness, wheel speed and wheel acceleration are of the ideal curve: what is sent consists of arcs, whose
curvature steps by what the tolerance needs. Where the ideal curve steps too (method `dubins-padded`), sharpness and
wheel acceleration are infinite.
"""

import math
from itertools import pairwise

import numpy as np

from schemas.curves import Curve, wrap_angle
from schemas.messages import PlanReport, Trajectory
from schemas.vehicle import Vehicle
from services.planner.clothoid import Floats
from services.planner.route import TRANSITION, Section
from services.planner.sending import Sent
from services.planner.timing import SpeedProfile

CURVATURE_STEP_1PM = 1e-9
# Speed and curvature are both smooth between borders; this many points of each stretch find the outer wheel's fastest.
POINTS = 5


def measure(
    trajectory: Trajectory, sections: list[Section], sent: list[Sent], speeds: SpeedProfile, vehicle: Vehicle
) -> PlanReport:
    """The report on a plan, its planning time left at 0."""
    painted = [s for s in sent if s.stroke]
    paint_length = sum(s.end_m - s.start_m for s in painted)
    paint_time = sum(speeds.time_at(s.end_m) - speeds.time_at(s.start_m) for s in painted)
    position_gap, heading_gap = gaps(trajectory)
    sharpness, wheel_speed, wheel_acceleration = wheels(sections, sent, speeds, vehicle)
    return PlanReport(
        paint_length_m=paint_length,
        transition_length_m=sent[-1].end_m - paint_length,
        total_length_m=sent[-1].end_m,
        paint_time_s=paint_time,
        transition_time_s=speeds.total_time_s - paint_time,
        total_time_s=speeds.total_time_s,
        painted_segments=len(painted),
        transitions=sum(section.label == TRANSITION and section.stroke is None for section in sections),
        max_curvature_1pm=max(s.curvature_1pm for s in sent),
        max_sharpness_1pm2=sharpness,
        max_wheel_speed_radps=wheel_speed,
        max_wheel_acceleration_radps2=wheel_acceleration,
        position_gap_m=position_gap,
        heading_gap_rad=heading_gap,
    )


def gaps(trajectory: Trajectory) -> tuple[float, float]:
    """The largest distance (m) and turn (rad) between the end of a segment of the message and the start of the next."""
    curves = [Curve.from_message(segment.curve) for segment in trajectory.path.segments]
    position = heading = 0.0
    for last, following in pairwise(curves):
        x, y, end_heading = last.end
        position = max(position, math.hypot(following.x_m - x, following.y_m - y))
        heading = max(heading, abs(wrap_angle(following.heading_rad - end_heading)))
    return position, heading


def wheels(
    sections: list[Section], sent: list[Sent], speeds: SpeedProfile, vehicle: Vehicle
) -> tuple[float, float, float]:
    """Largest |dκ/ds| (1/m²), wheel speed (rad/s) and wheel acceleration (rad/s²) along the ideal curve.

    A rim runs at v(1 ± κr) and accelerates with a(1 ± κr) ± v²σr. Between borders (of pieces, cuts and speed entries) a
    and σ are constant and v² and κ linear in arc length, so its acceleration is largest at a border.
    """
    pieces = np.array([piece[:3] for section in sections for piece in section.path.pieces])
    ends = np.cumsum(pieces[:, 0])
    starts = np.concatenate(([0.0], ends[:-1]))
    ideal_at = np.array([0.0, *(s.ideal_to_m for s in sent)])
    sent_at = np.array([0.0, *(s.end_m for s in sent)])
    border = np.unique(np.concatenate((ideal_at, ends, np.interp(speeds.station_m, sent_at, ideal_at))))
    border = border[np.concatenate((np.diff(border) > 1e-9, [True]))]
    middle = 0.5 * (border[1:] + border[:-1])
    index = np.minimum(np.searchsorted(ends, middle), len(pieces) - 1)
    sharpness = pieces[index, 2]

    share = np.linspace(0.0, 1.0, POINTS)[:, None]
    station = border[:-1] + share * np.diff(border)
    curvature = pieces[index, 1] + sharpness * (station - starts[index])
    square = np.square(speeds.speed_at(np.interp(station, ideal_at, sent_at)))
    acceleration = (square[-1] - square[0]) / (2.0 * np.diff(border))

    reach = 0.5 * vehicle.track_width_m * curvature
    turning = 0.5 * vehicle.track_width_m * square * sharpness
    rim_speed = np.sqrt(square) * (1.0 + np.abs(reach))
    rim_acceleration = np.maximum(
        np.abs(acceleration * (1.0 + reach) + turning), np.abs(acceleration * (1.0 - reach) - turning)
    )
    steps = _has_steps(pieces)
    return (
        math.inf if steps else float(np.abs(pieces[:, 2]).max()),
        float(rim_speed.max()) / vehicle.wheel_radius_m,
        math.inf if steps else float(rim_acceleration.max()) / vehicle.wheel_radius_m,
    )


def _has_steps(pieces: Floats) -> bool:
    curvature_end = pieces[:, 1] + pieces[:, 2] * pieces[:, 0]
    return bool(np.any(np.abs(pieces[1:, 1] - curvature_end[:-1]) > CURVATURE_STEP_1PM))

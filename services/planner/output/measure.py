"""Report on a plan.

Gaps, lengths and times are of what is sent; curvature is the maximum of what is sent and of the ideal curve that it
approximates. Sharpness and actuator motion are of the ideal curve, as what is sent consists of arcs, whose curvature
steps. Where the ideal curve steps, too (method `dubins-padded`), sharpness and the actuators' rates are infinite.
"""

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from touchline.core.plain_sum import plain_sum
from touchline.schemas.curves import Curve, wrap_angle
from touchline.schemas.messages import ActuatorExtremes, LinearDirection, PlanReport, Trajectory
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.drives.planned_drive import PlannedDrive, planned_drive
from touchline.services.planner.geometry.clothoid import Floats
from touchline.services.planner.route.worked_route import WorkedRoute
from touchline.services.planner.segments.section import RUN_IN, RUN_OUT, Section
from touchline.services.planner.segments.sent_segments import Sent
from touchline.services.planner.speed.energy import battery_wh
from touchline.services.planner.speed.timing import SpeedProfile

CURVATURE_STEP_1PM = 1e-9
# Speed and curvature are smooth between borders; this many samples of each stretch find the outer wheel's maximum.
POINTS = 5


def measure(
    trajectory: Trajectory,
    worked: WorkedRoute,
    sent: list[Sent],
    speeds: SpeedProfile,
    vehicle: Vehicle,
) -> PlanReport:
    """Compute the report on a plan; its planning time stays 0.

    Args:
        trajectory: Message, whose gaps are measured.
        worked: Ideal curve, and the work along it.
        sent: Lines and arcs that approximate it.
        speeds: Speeds along what is sent.
        vehicle: Vehicle that drives it.
    """
    sections, at_work = worked.sections, [s for s in sent if s.worked]
    paint_length = plain_sum(s.end_m - s.start_m for s in at_work)
    paint_time = plain_sum(speeds.time_at(s.end_m) - speeds.time_at(s.start_m) for s in at_work)
    position_gap, heading_gap = gaps(trajectory)
    planned = planned_drive(vehicle)
    figures = extremes(sections, sent, speeds, vehicle, planned)
    pieces = [piece for section in sections for piece in section.path.pieces]
    return PlanReport(
        paint_length_m=paint_length,
        transition_length_m=sent[-1].end_m - paint_length,
        total_length_m=sent[-1].end_m,
        paint_time_s=paint_time,
        transition_time_s=speeds.total_time_s - paint_time,
        total_time_s=speeds.total_time_s,
        painted_segments=len(at_work),
        transitions=sum(not section.work_id and section.label not in (RUN_IN, RUN_OUT) for section in sections),
        max_curvature_1pm=max(s.curvature_1pm for s in sent),
        max_sharpness_1pm2=figures.sharpness_1pm2,
        actuators=figures.actuators,
        position_gap_m=position_gap,
        heading_gap_rad=heading_gap,
        max_curvature_step_1pm=_curvature_step(sent),
        max_lateral_acceleration_mps2=figures.lateral_mps2,
        cusps=sum(last.direction != following.direction for last, following in pairwise(pieces)),
        spins=sum(piece.spin_rad != 0.0 for piece in pieces),
        wet_crossings=worked.wet.total,
        wet_crossings_unavoidable=worked.wet.unavoidable,
        # The pump's flow is that of a line painted at the vehicle's default speed.
        paint_l=vehicle.tool.flow_lps * paint_time,
        battery_wh=battery_wh(sent, speeds, vehicle, planned),
        coverage=worked.coverage,
        left_out=worked.left_out,
    )


def gaps(trajectory: Trajectory) -> tuple[float, float]:
    """Maximum distance (m) and turn (rad) between the end of a segment of the message and the start of the next.

    The heading is the robot's, which faces backward along a curve of direction BACKWARD.
    """
    position = heading = 0.0
    at: tuple[float, float, float] | None = None
    for segment in trajectory.path.segments:
        arc = segment.curve.arc[0] if segment.curve.arc else None
        if arc and arc.start == arc.center:
            if at:  # before the first curve the robot's heading is undefined
                position = max(position, math.hypot(arc.start.x - at[0], arc.start.y - at[1]))
                at = (at[0], at[1], at[2] + arc.sweep_angle)
            continue
        curve = Curve.from_message(segment.curve)
        turned = math.pi if segment.direction.value == LinearDirection.BACKWARD else 0.0
        if at:
            position = max(position, math.hypot(curve.x_m - at[0], curve.y_m - at[1]))
            heading = max(heading, abs(wrap_angle(curve.heading_rad + turned - at[2])))
        x, y, end_heading = curve.end
        at = (x, y, end_heading + turned)
    return position, heading


def _curvature_step(sent: list[Sent]) -> float:
    """Maximum step of curvature (1/m) of what is sent, except at standstills."""
    return max(
        (
            abs(following.curve.curvature_1pm - last.curve.curvature_1pm)
            for last, following in pairwise(sent)
            if last.direction == following.direction != 0
        ),
        default=0.0,
    )


class Extremes(NamedTuple):
    """Maximum sharpness, actuator motion and lateral acceleration."""

    sharpness_1pm2: float
    actuators: tuple[ActuatorExtremes, ...]
    lateral_mps2: float


def extremes(
    sections: list[Section], sent: list[Sent], speeds: SpeedProfile, vehicle: Vehicle, planned: PlannedDrive
) -> Extremes:
    """Maximum |dκ/ds|, value and rate of each actuator, and lateral acceleration along the ideal curve.

    Between borders (of pieces, cuts and speed entries) acceleration and σ are constant and v² and κ linear in arc
    length, so actuator motion has its maximum near a border.

    Args:
        sections: Ideal curve.
        sent: Lines and arcs that approximate it.
        speeds: Speeds along what is sent.
        vehicle: Vehicle that drives it.
        planned: Planning model of its drive.
    """
    pieces = np.array([piece for section in sections for piece in section.path.pieces], dtype=np.float64)
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

    motion = planned.actuation(*np.broadcast_arrays(pieces[index, 3], square, acceleration, curvature, sharpness))
    steps = _has_steps(pieces)
    actuators = tuple(
        ActuatorExtremes(
            name=actuator.name,
            quantity=actuator.quantity,
            unit=actuator.unit,
            max=float(np.abs(value).max()),
            max_rate=math.inf if steps else float(np.abs(rate).max()),
        )
        for actuator, value, rate in zip(vehicle.drive.actuators, motion.value, motion.rate, strict=True)
    )
    sharpest = math.inf if steps else float(np.abs(pieces[:, 2]).max())
    return Extremes(sharpest, actuators, float((square * np.abs(curvature)).max()))


def _has_steps(pieces: Floats) -> bool:
    """True if curvature steps elsewhere than at a cusp or a turn on the spot."""
    curvature_end = pieces[:, 1] + pieces[:, 2] * pieces[:, 0]
    going_on = (pieces[1:, 3] == pieces[:-1, 3]) & (pieces[1:, 4] == 0.0) & (pieces[:-1, 0] > 0.0)
    return bool(np.any(going_on & (np.abs(pieces[1:, 1] - curvature_end[:-1]) > CURVATURE_STEP_1PM)))

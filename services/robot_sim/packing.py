"""Packing of single messages of the robot, from plain values to payload."""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.onboard import Onboard
from touchline.onboard.interface import AuxiliarySample, CameraSample, MoveOffWarning, OnboardEvent, Pause, Status
from touchline.onboard.perception.perception import Perception
from touchline.onboard.perception.tracks import THING
from touchline.onboard.protection.protection_zones import ProtectionZones
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.cdr import encode
from touchline.schemas.frames import MAP_FRAME
from touchline.schemas.sensor_names import LIDAR, RANGER
from touchline.schemas.template import Template
from touchline.schemas.topics import Topic
from touchline.schemas.vehicles import SensorSpec
from touchline.services.robot_sim import layouts
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.order_log import ObeyedOrder
from touchline.services.robot_sim.paint.ledger import Marks, PaintLedger
from touchline.services.robot_sim.sensors.gnss_truth import GnssReport
from touchline.services.robot_sim.sensors.suite import Sensors
from touchline.services.robot_sim.world.battery import NOMINAL_V, voltage_of

Payload = tuple[Topic, bytes]
Stamp = tuple[int, int]
"""Seconds and nanoseconds of sim time."""

_NAVSAT_STATUS: Final = {
    m.GnssStatus.NONE: m.NavSatStatus.STATUS_NO_FIX,
    m.GnssStatus.SINGLE: m.NavSatStatus.STATUS_FIX,
    m.GnssStatus.FLOAT: m.NavSatStatus.STATUS_GBAS_FIX,
    m.GnssStatus.FIXED: m.NavSatStatus.STATUS_GBAS_FIX,
}


def stamp(tick: int) -> Stamp:
    """Return (seconds, nanoseconds) of sim time at the end of `tick`."""
    return tick // 100, tick % 100 * 10_000_000


def stamp_of(time_s: float) -> Stamp:
    """Return (seconds, nanoseconds) of a time that need not be a whole tick; not before 0."""
    nanoseconds = max(round(time_s * 1e9), 0)
    return nanoseconds // 1_000_000_000, nanoseconds % 1_000_000_000


def header(tick: int) -> m.Header:
    """Make the header of a message in the map frame that is sent after `tick`."""
    sec, nanosec = stamp(tick)
    return m.Header(stamp=m.Time(sec=sec, nanosec=nanosec), frame_id=MAP_FRAME)


def gnss(report: GnssReport) -> list[Payload]:
    """Pack a fix and its RTK state, stamped with the time of validity."""
    time = stamp_of(report.stamp_s)
    variance = report.variance_m2
    fix = layouts.GNSS_FIX.pack(
        *time,
        _NAVSAT_STATUS[report.fix],
        m.NavSatStatus.SERVICE_GPS,
        report.latitude_deg,
        report.longitude_deg,
        report.altitude_m,
        *(variance, 0.0, 0.0, 0.0, variance, 0.0, 0.0, 0.0, report.vertical_variance_m2),
        m.NavSatFix.COVARIANCE_TYPE_DIAGONAL_KNOWN if report.fix else m.NavSatFix.COVARIANCE_TYPE_UNKNOWN,
    )
    status = layouts.GNSS_STATUS.pack(
        *time, report.fix, report.satellites, report.correction_age_s, math.sqrt(2.0 * variance)
    )
    return [(topics.GNSS_FIX, fix), (topics.GNSS_STATUS, status)]


def camera_pose(sample: CameraSample) -> Payload:
    """Pack a pose of the overhead camera, stamped with the time of its picture."""
    half, covariance = 0.5 * sample.heading_rad, [0.0] * 36
    covariance[0] = covariance[7] = sample.sigma_m**2
    covariance[35] = sample.sigma_rad**2
    pose = layouts.CAMERA_POSE.pack(
        *stamp_of(sample.stamp_s),
        *(sample.east_m, sample.north_m, 0.0),
        *(0.0, 0.0, math.sin(half), math.cos(half)),
        *covariance,
    )
    return topics.CAMERA_POSE, pose


def positions(sensors: Sensors) -> list[Payload]:
    """Pack the fixes or poses that arrived in the last tick."""
    fixes = [payload for report in sensors.gnss_reports for payload in gnss(report)]
    return fixes + [camera_pose(sample) for sample in sensors.camera_poses]


def sensor_samples(samples: Sequence[AuxiliarySample], specs: Mapping[str, SensorSpec]) -> list[Payload]:
    """Pack measurements of auxiliary sensors, stamped with their times.

    Args:
        samples: The measurements.
        specs: Data sheet of each sensor, by its name.
    """
    return [_sensor_sample(each, specs[each.sensor]) for each in samples]


def _sensor_sample(sample: AuxiliarySample, spec: SensorSpec) -> Payload:
    if spec.kind == LIDAR:
        beams = len(sample.values)
        begin = stamp_of(sample.stamp_s - spec.scan_s)
        last_rad, time_s = spec.first_rad + (beams - 1) * spec.step_rad, spec.scan_s / (beams - 1)
        angles = (spec.first_rad, last_rad, spec.step_rad)
        limits = (time_s, 1.0 / spec.rate_hz, spec.min_m, spec.max_m)
        return topics.SCAN, layouts.scan(spec.name, beams).pack(*begin, *angles, *limits, *sample.values)
    head = m.Header(stamp=m.Time.of_ns(round(sample.stamp_s * 1e9)), frame_id=sample.sensor)
    if spec.kind == RANGER:
        message = m.Range(
            header=head,
            radiation_type=m.Range.ULTRASOUND,
            field_of_view=spec.cone_rad,
            min_range=spec.min_m,
            max_range=spec.max_m,
            range=sample.values[0],
            variance=spec.sigma_m**2,
        )
        return topics.RANGE, encode(message)
    return topics.SENSOR_SAMPLE, encode(m.SensorSample(header=head, kind=spec.kind, values=tuple(sample.values)))


def obstacles(tick: int, perception: Perception) -> Payload:
    """Pack what a robot sees near it.

    Args:
        tick: Tick after which it is sent.
        perception: Perception of the robot's computer.
    """
    unknown = [
        m.Obstacle(
            id=each.number,
            kind=each.kind,
            moving=each.moving,
            x_m=each.x_m,
            y_m=each.y_m,
            position_sigma_m=each.place_sigma_m,
            vx_mps=each.vx_mps,
            vy_mps=each.vy_mps,
            velocity_sigma_mps=each.speed_sigma_mps,
            outline_x_m=each.outline_m[:, 0],
            outline_y_m=each.outline_m[:, 1],
            last_seen=m.Time.of_ns(round(each.seen_s * 1e9)),
        )
        for each in perception.tracks
    ]
    known = [
        m.Obstacle(
            id=each.place,
            kind=THING,
            known=True,
            missing=each.missing,
            x_m=float(each.outline_m[:, 0].mean()),
            y_m=float(each.outline_m[:, 1].mean()),
            outline_x_m=each.outline_m[:, 0],
            outline_y_m=each.outline_m[:, 1],
            last_seen=m.Time.of_ns(round(max(each.seen_s, 0.0) * 1e9)),
        )
        for each in perception.seen_outlines
    ]
    return topics.OBSTACLES, encode(m.Obstacles(header=header(tick), obstacles=(*unknown, *known)))


def zones(tick: int, found: ProtectionZones) -> list[Payload]:
    """Pack the zones of a robot's protection.

    Args:
        tick: Tick after which they are sent.
        found: The zones.
    """
    outlines = ((topics.STOP_ZONE, found.stop_m), (topics.SLOW_ZONE, found.slow_m))
    return [(topic, _polygon(stamp(tick), outline)) for topic, outline in outlines]


def _polygon(time: Stamp, outline: NDArray[np.float64]) -> bytes:
    """Pack an outline; as messages, its corners would take a millisecond."""
    empty, points = _empty_polygon(), np.zeros((len(outline), 3), dtype="<f4")
    points[:, :2] = outline
    return empty[:4] + struct.pack("<iI", *time) + empty[12:-4] + struct.pack("<I", len(points)) + points.tobytes()


@cache
def _empty_polygon() -> bytes:
    """Pack a polygon without corners: encoding, stamp, frame, and the number of its corners."""
    return encode(m.PolygonStamped(header=m.Header(frame_id=MAP_FRAME)))


def whereabouts(time: Stamp, message: m.Whereabouts) -> bytes:
    """Pack a guided robot's message to its coordinator."""
    return whereabouts_at(
        time, message, message.stamp_s, (message.x_m, message.y_m, message.stop_x_m, message.stop_y_m)
    )


def whereabouts_at(time: Stamp, message: m.Whereabouts, stamp_s: float, place: Sequence[float]) -> bytes:
    """Pack a guided robot's message at another time and place, as `whereabouts`.

    Args:
        time: Stamp of the message.
        message: The message, except for time and place.
        stamp_s: Time of the robot's computer.
        place: x, y, and those of the stopping point (m).
    """
    return layouts.WHEREABOUTS.pack(*time, stamp_s, message.aligned, *place, message.adopted, message.decided)


def plan_state(time: Stamp, message: m.PlanState) -> bytes:
    """Pack the message of a robot that is guided by plans."""
    motion = message.x_m, message.y_m, message.heading_rad, message.speed_mps, message.yaw_rate_radps
    return plan_state_at(time, message, message.stamp_s, motion)


def plan_state_at(time: Stamp, message: m.PlanState, stamp_s: float, motion: Sequence[float]) -> bytes:
    """Pack the message of a robot that is guided by plans at another time and place, as `plan_state`.

    Args:
        time: Stamp of the message.
        message: The message, except for time and motion.
        stamp_s: Time of the robot's computer.
        motion: x, y (m), heading (rad), speed (m/s), yaw rate (rad/s).
    """
    return layouts.PLAN_STATE.pack(
        *time, stamp_s, message.aligned, *motion, message.adopted, message.decided, message.stays
    )


def status(time: Stamp, current: Status, speed_mps: float, onboard: Onboard) -> Payload:
    """Pack the status of the traversal, as estimated by the onboard computer.

    Args:
        time: Stamp of the message.
        current: The status.
        speed_mps: Estimated speed.
        onboard: Computer with the estimated paint.
    """
    painted = onboard.painted
    layout = layouts.status(current.reason, current.segment_id, painted.ids)
    return topics.STATUS, layout.pack(
        *time,
        current.state,
        current.segment_index,
        current.segment_count,
        current.arc_length_m,
        current.total_length_m,
        painted.coverage_pct,
        *painted.fractions,
        speed_mps,
        current.elapsed_s,
        current.remaining_s,
        onboard.lateral_error_m,
        onboard.spraying,
    )


def pause_status(tick: int, pause: Pause | None) -> Payload:
    """Pack the status of a pause.

    Args:
        tick: Tick after which it is sent.
        pause: The pause; None if there is none.
    """
    if pause is None:
        return topics.PAUSE_STATUS, encode(m.PauseStatus(header=header(tick)))
    earliest = m.Time()
    if pause.ends_by_itself:
        earliest = header(pause.earliest_tick).stamp
    return topics.PAUSE_STATUS, encode(
        m.PauseStatus(
            header=header(tick),
            cause=pause.cause,
            source=pause.source,
            ends_by_itself=pause.ends_by_itself,
            earliest=earliest,
        )
    )


def about_to_move(tick: int, warning: MoveOffWarning | None) -> Payload:
    """Pack the warning before the robot moves after `tick`; None: it ends."""
    message = m.AboutToMove(header=header(tick))
    if warning is not None:
        earliest = header(warning.earliest_tick).stamp
        message = m.AboutToMove(header=message.header, active=True, earliest=earliest, reason=warning.reason)
    return topics.ABOUT_TO_MOVE, encode(message)


def true_coverage(time: Stamp, emulator: Emulator, *, flowing: bool) -> Payload:
    """Pack the true coverage, and whether paint flows."""
    ledger, account = emulator.work.ledger, emulator.work.account
    if account is None:
        ids, coverage_pct, fractions = ledger.ids, ledger.coverage_pct, ledger.fractions
    else:
        account.take(ledger)
        ids, coverage_pct, fractions = account.ids, account.standing.coverage_pct, account.fractions
    layout = layouts.true_coverage(ids)
    return topics.TRUE_COVERAGE, layout.pack(*time, coverage_pct, *fractions, ledger.lateral_m, flowing)


def battery(time: Stamp, left_wh: float, power_w: float, capacity_wh: float) -> bytes:
    """Pack the state of the battery, its voltage linear in its charge.

    Args:
        time: Stamp of the message.
        left_wh: Charge in it.
        power_w: Power taken from it; negative: it is charged.
        capacity_wh: Charge of the full battery.
    """
    share = left_wh / capacity_wh
    voltage: float = voltage_of(share)
    return layouts.BATTERY.pack(
        *time,
        voltage,
        math.nan,
        -power_w / voltage,
        left_wh / NOMINAL_V,
        capacity_wh / NOMINAL_V,
        capacity_wh / NOMINAL_V,
        share,
        m.BatteryState.POWER_SUPPLY_STATUS_CHARGING
        if power_w < 0.0
        else m.BatteryState.POWER_SUPPLY_STATUS_DISCHARGING,
        m.BatteryState.POWER_SUPPLY_HEALTH_GOOD,
        m.BatteryState.POWER_SUPPLY_TECHNOLOGY_LION,
        True,
    )


def job_payloads(trajectory: m.Trajectory, template: Template | None) -> list[Payload]:
    """Make the payloads of the plan and its template, if there is one, which are published once."""
    return [
        (topics.PLAN, encode(trajectory)),
        (topics.TEMPLATE, encode(m.String(data=template.model_dump_json() if template is not None else ""))),
    ]


def order_payload(order: ObeyedOrder) -> Payload:
    """Pack an order that was carried out."""
    message = m.RobotOrder(header=header(order.tick), name=order.name, details_json=order.details_json)
    return topics.ORDERS, encode(message)


def event_payload(event: OnboardEvent, tick: int) -> Payload:
    """Pack an event for the operator."""
    message = m.Event(
        header=header(tick), severity=event.severity, source=topics.ROBOT_SIM, code=event.code, text=event.text
    )
    return topics.EVENTS, encode(message)


def paint_payloads(ledger: PaintLedger, strokes: list[Marks], time: Stamp) -> list[Payload]:
    """Pack strokes of a ledger, each with the id of the line that it belongs to, "" for none."""
    return [
        (
            topics.PAINT,
            layouts.paint_marks(ledger.ids[marks.target] if marks.target >= 0 else "", len(marks.x_m)).pack(
                *time, marks.first_index, marks.width_m, *marks.x_m.tolist(), *marks.y_m.tolist()
            ),
        )
        for marks in strokes
    ]

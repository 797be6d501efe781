"""Sensors of a log at the ticks of the robot's computer, 100 per second.

Rates (of a gyro, of an odometry) are interpolated linearly to the middle of each tick, totals (distances, turns, angles
of wheels) to its end, so that no angle and no distance is lost. Gaps stay empty. Fixes stay as they are.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.recordings.logs.foreign_sensors import FIXED, ForeignSensors, RateSeries
from touchline.recordings.logs.log_table import Floats, LogError
from touchline.recordings.logs.reversals import Span, reversals, within
from touchline.schemas.log_mapping import LogMapping
from touchline.schemas.vehicles import Vehicle
from touchline.schemas.vehicles.differential_drive import DifferentialDrive

TICKS_PER_S: Final = 100
LONGEST_S: Final = 24 * 3600.0
_GAP_PERIODS, _GAP_S = 5.0, 0.3  # a longer pause than both is a gap
_PERIODS_S = {"fixes": (0.005, 150.0), "imu": (4e-4, 5.0), "wheels": (4e-4, 5.0)}
_STANDING_TICKS = 50  # before the estimator may start
_MOVED_RAD = 0.1  # turn of a wheel from which on the magnetometer is left out

Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class TickSensors:
    """Sensors at n ticks, of which the first ends at `begin_s`.

    Attributes:
        begin_s: Log's clock.
        imu: (n, 6) rates and specific force, body axes; NaN where a sensor is missing.
        imu_there: (n,) whether there is a sample.
        angles_rad: (n, 2) angles of the left and right wheel.
        wheels_there: (n,) whether there is a sample.
        heading_rad: (n,) by the magnetometer; NaN where it is left out.
        starts: Why the estimator cannot start; empty if it can.
        reverses: Stretches in which wheels without a sign are taken to turn backward, log's clock.
    """

    begin_s: float
    imu: Floats
    imu_there: Flags
    angles_rad: Floats
    wheels_there: Flags
    heading_rad: Floats
    starts: str = ""
    reverses: tuple[Span, ...] = ()

    @property
    def ticks(self) -> int:
        """Number of ticks n."""
        return len(self.imu)

    @property
    def drives(self) -> bool:
        """True if wheels show motion, without which nothing can be estimated."""
        return bool(self.wheels_there.any())


def tick_sensors(sensors: ForeignSensors, mapping: LogMapping, vehicle: Vehicle) -> TickSensors:
    """Return the sensors at ticks.

    Args:
        sensors: Sensors of the log.
        mapping: Time window, and how to find the heading at the start.
        vehicle: Vehicle whose wheels they become.

    Raises:
        LogError: The window is empty, the streams do not overlap, or the vehicle's wheels cannot be derived.
    """
    begin_s, end_s = _window(sensors, mapping)
    n = max(int((end_s - begin_s) * TICKS_PER_S), 1)
    ends = begin_s + np.arange(1, n + 1) / TICKS_PER_S
    imu, imu_there = _imu(sensors, ends)
    angles, wheels_there, travelled = _wheels(sensors, ends, vehicle)
    if sensors.rates is None and sensors.turn is None:
        imu_there |= wheels_there  # samples of no numbers, as of an IMU that is broken
    if mapping.standing:
        wheels_there[:] = imu_there[:] = True
        imu[:, :3] = np.nan_to_num(imu[:, :3])
    turned = np.cumsum(np.nan_to_num(imu[:, 2])) / TICKS_PER_S if np.isfinite(imu[:, 2]).any() else travelled[:, 1]
    reverses: tuple[Span, ...] = ()
    if mapping.wheels is not None and mapping.wheels.unsigned:
        turn_radps = np.diff(turned, prepend=turned[0]) * TICKS_PER_S
        reverses = reversals(ends, travelled[:, 0], turn_radps, _fixed(sensors))
        angles, wheels_there, travelled = _wheels(_signed(sensors, reverses), ends, vehicle)
    ways = np.column_stack([travelled[:, 0], turned])
    heading, starts = _magnetometer(sensors, mapping, ends, angles, ways)
    return TickSensors(begin_s, imu, imu_there, angles, wheels_there, heading, starts, reverses)


def _fixed(sensors: ForeignSensors) -> Floats:
    """Return (k, 4) time [s], east, north and σ [m] of the RTK-fixed positions."""
    fixes = sensors.fixes
    if fixes is None:
        return np.zeros((0, 4))
    fixed: Floats = np.column_stack([fixes.time_s, fixes.place_m[:, :2], fixes.sigma_m])[fixes.fix == FIXED]
    return fixed


def _signed(sensors: ForeignSensors, reverses: tuple[Span, ...]) -> ForeignSensors:
    """Return the sensors with wheels that turn backward in some stretches; a turn of their own stays."""
    joints, travel = sensors.joints, sensors.travel
    if joints is not None:
        return replace(sensors, joints=_backward(joints, reverses, 2))
    return sensors if travel is None else replace(sensors, travel=_backward(travel, reverses, 1))


def _backward(series: RateSeries, reverses: tuple[Span, ...], columns: int) -> RateSeries:
    """Return readings whose first columns have a minus in some stretches."""
    values = np.diff(series.values, axis=0, prepend=series.values[:1]) if series.cumulative else series.values.copy()
    values[within(series.time_s, reverses), :columns] *= -1.0
    if series.cumulative:
        values = series.values[0] + np.cumsum(values, axis=0)
    return replace(series, values=values)


def _window(sensors: ForeignSensors, mapping: LogMapping) -> tuple[float, float]:
    """Return beginning and end, log's clock."""
    parts = {
        "fixes": sensors.fixes,
        "imu": sensors.rates or sensors.turn,
        "wheels": sensors.travel or sensors.joints,
    }
    there = {name: series.time_s for name, series in parts.items() if series is not None}
    _check_periods(there)
    spans = {name: (float(time_s[0]), float(time_s[-1])) for name, time_s in there.items()}
    if max(span[0] for span in spans.values()) > min(span[1] for span in spans.values()):
        extents = ", ".join(f"{name} {span[0]:,.1f} to {span[1]:,.1f} s" for name, span in spans.items())
        raise LogError(
            f"the streams do not overlap in time ({extents}); give time_offset_s of one of them in the mapping"
        )
    first_s = min(span[0] for span in spans.values())
    begin_s = first_s + mapping.from_s
    end_s = max(span[1] for span in spans.values())
    if begin_s > end_s:
        raise LogError(f"nothing remains from from_s on: the log has {end_s - first_s:,.1f} s; give less")
    if mapping.until_s is not None:
        end_s = min(end_s, first_s + mapping.until_s)
    elif mapping.fixes is not None:
        end_s += mapping.fixes.latency_s + 1.0 / TICKS_PER_S  # until the last fix has come
    if end_s - begin_s > LONGEST_S:
        raise LogError(f"the log spans {end_s - begin_s:,.0f} s; cut it to a day at most by from_s and until_s")
    # A little before the first reading, at a whole tick.
    return math.floor(begin_s * TICKS_PER_S - 1) / TICKS_PER_S, end_s


def _check_periods(stamps: dict[str, Floats]) -> None:
    """Refuse stamps in another unit than seconds, by the time between two of them.

    Raises:
        LogError: No such sensor has this period.
    """
    for part, time_s in stamps.items():
        period_s = float(np.median(np.diff(time_s))) if len(time_s) > 1 else _PERIODS_S[part][0]
        if not _PERIODS_S[part][0] <= period_s <= _PERIODS_S[part][1]:
            raise LogError(
                f"{part}.stream: by its stamps a reading comes every {period_s:.3g} s, so they are not in seconds; "
                "name the column with the time by its unit: time_s, time_ms, time_us or time_ns"
            )


def _there(series: RateSeries, at_s: Floats) -> Flags:
    """Return at which times there are readings nearby, and not a gap."""
    time_s = series.time_s
    if len(time_s) < 2:
        return np.zeros(len(at_s), dtype=bool)
    steps = np.diff(time_s)
    longest = max(_GAP_PERIODS * float(np.median(steps)), _GAP_S)
    after = np.searchsorted(time_s, at_s)
    inside: Flags = (after > 0) & (after < len(time_s))
    inside &= steps[(after - 1).clip(0, len(steps) - 1)] <= longest
    return inside


def _at(series: RateSeries, at_s: Floats) -> Floats:
    """Return (n, k) readings by linear interpolation."""
    return np.column_stack([np.interp(at_s, series.time_s, column) for column in series.values.T])


def _imu(sensors: ForeignSensors, ends: Floats) -> tuple[Floats, Flags]:
    imu, there = np.full((len(ends), 6), np.nan), np.zeros(len(ends), dtype=bool)
    middles = ends - 0.5 / TICKS_PER_S
    if sensors.rates is not None:
        imu[:, :3] = _at(sensors.rates, middles)
        there = _there(sensors.rates, middles)
    elif sensors.turn is not None:
        imu[:, :2] = 0.0
        if sensors.turn.cumulative:
            total = _at(sensors.turn, np.concatenate((ends[:1] - 1.0 / TICKS_PER_S, ends)))[:, 0]
            imu[:, 2] = np.diff(total) * TICKS_PER_S
        else:
            imu[:, 2] = _at(sensors.turn, middles)[:, 0]
        there = _there(sensors.turn, middles)
    if sensors.force is not None:
        imu[:, 3:] = _at(sensors.force, middles)
    return imu, there


def _wheels(sensors: ForeignSensors, ends: Floats, vehicle: Vehicle) -> tuple[Floats, Flags, Floats]:
    """Return angles of the wheels, where they exist, and their total (distance, turn)."""
    n, drive = len(ends), vehicle.drive
    if sensors.joints is None and sensors.travel is None:
        return np.zeros((n, 2)), np.zeros(n, dtype=bool), np.zeros((n, 2))
    if not isinstance(drive, DifferentialDrive):
        raise LogError(
            f"{vehicle.name} has no two driven wheels; name a vehicle with a differential drive in the mapping"
        )
    radius_m, half_m = drive.wheel_radius_m, drive.half_track_m
    if sensors.joints is not None:
        angles = _at(sensors.joints, ends)
        left, right = angles.T * radius_m
        return (
            angles,
            _there(sensors.joints, ends),
            np.column_stack([(left + right) / 2, (right - left) / (2 * half_m)]),
        )
    travel = sensors.travel
    assert travel is not None
    if travel.cumulative:
        total = _at(travel, ends)
    else:
        middles = ends - 0.5 / TICKS_PER_S
        there = _there(travel, middles)
        total = np.cumsum(np.where(there[:, None], _at(travel, middles), 0.0), axis=0) / TICKS_PER_S
    distance, turn = total.T
    angles = np.column_stack([distance - half_m * turn, distance + half_m * turn]) / radius_m
    return angles, _there(travel, ends), total


def _magnetometer(
    sensors: ForeignSensors, mapping: LogMapping, ends: Floats, angles: Floats, ways: Floats
) -> tuple[Floats, str]:
    """Return the heading while the robot stands at the start, and why it is unknown.

    Args:
        sensors: Sensors of the log.
        mapping: How to find it.
        ends: (n,) ends of the ticks.
        angles: (n, 2) angles of the wheels.
        ways: (n, 2) distance and turn, total.
    """
    heading = np.full(len(ends), np.nan)
    fixes = sensors.fixes
    if fixes is None:
        return heading, "the log has no fixes"
    begin, first = _start(ends, angles, fixes.time_s[fixes.fix == FIXED])
    if first < 0:
        if not (fixes.fix == FIXED).any():
            return heading, "none of the fixes is RTK-fixed"
        return heading, (
            "the robot never stands for 0.5 s with an RTK-fixed position; if its wheels read a little at rest, give "
            "wheels.standing_mps"
        )
    moved = np.flatnonzero(np.abs(angles[first:] - angles[first]).max(axis=1) > _MOVED_RAD)
    last = first + int(moved[0]) if len(moved) else len(ends)
    if mapping.standing:
        heading[begin:last] = mapping.heading.start_rad or 0.0
        return heading, ""
    if mapping.heading.start_rad is not None:
        return _headings(mapping.heading.start_rad + ways[begin, 1], begin, last, ways), ""
    there_s = fixes.time_s
    after = (there_s >= ends[begin]) & (fixes.fix != 0)
    tick = np.searchsorted(ends, there_s[after]).clip(0, len(ends) - 1)
    east, north = _dead_reckoned(ways[begin:])
    displacement = (east + 1j * north)[tick - begin]
    place = fixes.place_m[after, 0] + 1j * fixes.place_m[after, 1]
    standing = tick <= last
    if not standing.any():
        return heading, "there is no fix while the robot stands at the start"
    far = np.flatnonzero(np.abs(displacement) >= mapping.heading.course_m)
    if not len(far):
        if sensors.joints is None and sensors.travel is None:
            return (
                heading,
                "the log has no wheels, which would show the direction of the start; give heading.start_rad",
            )
        return heading, f"by its wheels the robot never gets {mapping.heading.course_m:g} m away from its start"
    used = slice(0, int(far[0]) + 1)
    course = np.sum(np.conj(displacement[used]) * (place[used] - place[standing].mean()))
    return _headings(float(np.angle(course)), begin, last, ways), ""


def _headings(there_rad: float, begin: int, last: int, ways: Floats) -> Floats:
    """Return (n,) headings by that of a standstill, before which the estimator may start, too; NaN after it."""
    heading = np.full(len(ways), np.nan)
    heading[:begin] = there_rad + ways[:begin, 1] - ways[begin, 1]
    heading[begin:last] = there_rad
    return heading


def _start(ends: Floats, angles: Floats, fixed_s: Floats) -> tuple[int, int]:
    """Return the tick from which on the robot stands, and that in which the estimator starts by a fix; −1: none."""
    moving = np.abs(np.diff(angles, axis=0, prepend=angles[:1])).max(axis=1) >= 1e-4
    last_moving = np.maximum.accumulate(np.where(moving, np.arange(len(ends)), -1))
    for tick in np.searchsorted(ends, fixed_s).clip(0, len(ends) - 1):
        begin = int(last_moving[tick]) + 1
        if tick - begin >= _STANDING_TICKS:
            return begin, int(tick)
    return -1, -1


def _dead_reckoned(ways: Floats) -> tuple[Floats, Floats]:
    """Return (x, y) [m] by distances and turns, from heading 0."""
    steps = np.diff(ways[:, 0], prepend=ways[0, 0])
    turned = ways[:, 1] - ways[0, 1]
    middle = turned - 0.5 * np.diff(turned, prepend=0.0)
    return np.cumsum(steps * np.cos(middle)), np.cumsum(steps * np.sin(middle))

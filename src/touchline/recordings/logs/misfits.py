"""Misfits of a mapping: fields that do not fit the log, by the log's own sensors against each other."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from touchline.recordings.logs.agreement import Agreement, agreement
from touchline.recordings.logs.fix_misfits import of_reference, of_sigma, of_start
from touchline.recordings.logs.foreign_sensors import ForeignSensors
from touchline.recordings.logs.imu_misfits import of_gravity, of_push
from touchline.recordings.logs.log_table import Floats
from touchline.recordings.logs.tick_sensors import TICKS_PER_S, TickSensors
from touchline.schemas.log_mapping import LogMapping
from touchline.schemas.vehicles import Vehicle
from touchline.schemas.vehicles.differential_drive import DifferentialDrive

_FITS_RATIO: Final = 1.4
_UNIT_RATIO: Final = 1.08
_TURN_UNIT_RATIO: Final = 1.2
_LENGTHS: Final = {3.28084: "feet instead of metres", 100.0: "cm instead of metres", 1000.0: "mm instead of metres"}
_SPEEDS: Final = {3.6: "km/h instead of m/s", 1.94384: "knots instead of m/s", 2.23694: "mph instead of m/s"}
_ANGLES: Final = {180.0 / math.pi: "degrees instead of radians"}
_TURNS: Final = _ANGLES | {60.0 / math.tau: "rpm instead of rad/s", 1000.0: "mrad instead of radians"}
_SPEEDS_MPS: Final = (0.02, 20.0)
_RATES_RADPS: Final = (0.005, 6.0)
"""Range of the 95th percentile of a drive that is possible."""
_MOVED_M: Final = 10.0


def misfits(mapping: LogMapping, sensors: ForeignSensors, at_ticks: TickSensors, vehicle: Vehicle) -> list[str]:
    """Return what does not fit, a line each that begins with fields of the mapping and ends with the remedy.

    Args:
        mapping: The mapping.
        sensors: Sensors of the log by it.
        at_ticks: The same at ticks.
        vehicle: Vehicle whose wheels they have become.
    """
    found = of_reference(sensors)
    if mapping.standing or not isinstance(vehicle.drive, DifferentialDrive):
        return found + of_sigma(mapping, sensors)
    compared = agreement(sensors.fixes, at_ticks, vehicle.drive)
    moved = _of_one_wheel(sensors, at_ticks, vehicle.drive, compared) or _of_mirror(sensors, compared)
    if not moved:
        force = of_gravity(mapping, at_ticks, vehicle.drive, compared)
        by_gravity = any(line.startswith("imu.axes") for line in force)
        turns = _of_turns(sensors, at_ticks, compared, gyro=not by_gravity)
        distance = _of_distance(sensors, at_ticks, vehicle.drive, compared)
        moved = distance + turns + force
        if not turns and not force:
            moved += of_push(mapping, compared) + of_start(mapping, compared)
    return moved + found + ([] if moved else of_sigma(mapping, sensors))


def does_not_fit(lines: Sequence[str]) -> str:
    """Return what a session has whose mapping has misfits, in words."""
    return f"the mapping does not fit the log: {'; '.join(lines)}"


def _off(factor: float) -> bool:
    """Return whether a factor is told, and not about 1."""
    return math.isfinite(factor) and not 1.0 / _FITS_RATIO < factor < _FITS_RATIO


def _opposite_sense(factor: float) -> bool:
    return math.isfinite(factor) and factor < 0.0 and not _off(-factor)


def _fields(part: str, quantities: Sequence[str]) -> str:
    """Return the names of columns in a mapping."""
    *first, last = quantities
    return f"{part}.columns.{' and '.join(filter(None, (', '.join(first), last)))}"


def _unit(factor: float, units: dict[float, str]) -> tuple[float, str]:
    """Return the factor by which a unit explains another, and that as an aside; itself and nothing if none does."""
    size = min(units, key=lambda each: abs(math.log(max(factor, 1.0 / factor) / each)))
    within = _TURN_UNIT_RATIO if units == _TURNS else _UNIT_RATIO
    if not 1.0 / within < max(factor, 1.0 / factor) / size < within:
        return factor, ""
    if factor > 1.0:
        return size, f", as of {units[size]}"
    return 1.0 / size, f", as if it were converted from {units[size].split(' ')[0]} and is not"


def _excess(factor: float, units: dict[float, str]) -> str:
    """Return cause and remedy of values that are this factor too large, or have the opposite sign besides."""
    exact, aside = _unit(abs(factor), units)
    return f"{aside}; give it a scale {math.copysign(1.0 / exact, factor):.4g} times that of now"


def _possible(steps: Floats, span: tuple[float, float], factor: float = 1.0) -> bool:
    """Return whether the steps of ticks, divided by a factor, are those of a robot."""
    there = np.abs(steps[np.isfinite(steps)]) * TICKS_PER_S / abs(factor)
    return bool(len(there) and span[0] < np.percentile(there, 95) < span[1])


def _of_one_wheel(
    sensors: ForeignSensors, at_ticks: TickSensors, drive: DifferentialDrive, compared: Agreement
) -> list[str]:
    """Return which of two wheels counts backward, if all fits with its sign changed."""
    if sensors.joints is None or not (_off(compared.driven) or math.isnan(compared.driven)):
        return []
    for name, signs in zip(sensors.columns["wheels"], ((-1.0, 1.0), (1.0, -1.0)), strict=True):
        changed = agreement(sensors.fixes, replace(at_ticks, angles_rad=at_ticks.angles_rad * signs), drive)
        if all(math.isfinite(each) and not _off(each) for each in (changed.driven, changed.wheels_by_gyro)):
            told = "with the opposite sign wheels, gyro and fixes go together, as it is they do not"
            return [f"{_fields('wheels', [name])}: {told}; give it the opposite sign"]
    return []


def _of_mirror(sensors: ForeignSensors, compared: Agreement) -> list[str]:
    """Return that the course of the fixes turns to the other side than all else."""
    told = {name: each for name, each in (("imu", compared.gyro), ("wheels", compared.wheels)) if math.isfinite(each)}
    alone = len(told) == 1 and (compared.one_source or math.isnan(compared.wheels_by_gyro))
    if not told or max(told.values()) > 0.0 or not (alone or len(told) > 1):
        return []
    (part, *_) = told
    other = f"; or else {_fields(part, sensors.columns[part])} counts clockwise: give it the opposite sign"
    return [
        (
            f"{_fields('fixes', sensors.columns['fixes'])}: their course turns to the other side than gyro and wheels "
            f"do; exchange the two columns{other if alone else ''}"
        )
    ]


def _of_distance(
    sensors: ForeignSensors, at_ticks: TickSensors, drive: DifferentialDrive, compared: Agreement
) -> list[str]:
    driven = compared.driven
    if "wheels" not in sensors.columns or not _off(driven):
        return []
    joints, places = sensors.joints is not None, sensors.columns["fixes"]
    wheels = _fields("wheels", sensors.columns["wheels"] if joints else sensors.columns["wheels"][:1])
    fixes = _fields("fixes", places)
    if driven == 0.0:
        if compared.fixes_m < _MOVED_M:
            return []
        return [f"{wheels}: the wheels stand while the fixes move by {compared.fixes_m:.0f} m; give them another scale"]
    told = f"the wheels drive {driven:.3g} m for each metre of the fixes"
    by_vehicle = f", or wheels of {drive.wheel_radius_m / driven:.2g} m radius to the vehicle" if joints else ""
    at_wheels = f"{wheels}: {told}{_excess(driven, _ANGLES if joints else _LENGTHS | _SPEEDS)}{by_vehicle}"
    if places[0] == "latitude_deg":
        if abs(sensors.origin.latitude_deg) < 0.5 * math.pi and driven > 10.0:  # less than 57: meridians draw near
            return [f"{fixes}: {told}, as of radians instead of degrees; give them a scale of {math.degrees(1.0):.4f}"]
        return [at_wheels]
    at_fixes = f"{fixes}: {told}{_excess(1.0 / driven, _LENGTHS)}"
    step_m = np.diff(at_ticks.angles_rad.mean(axis=1)) * drive.wheel_radius_m
    possible = tuple(_possible(step_m, _SPEEDS_MPS, each) for each in (1.0, driven))
    if possible[0] != possible[1]:
        return [at_fixes if possible[0] else at_wheels]
    return [at_wheels if _unit(driven, _SPEEDS)[1] else f"{at_wheels}; or else {at_fixes}"]


def _of_turns(sensors: ForeignSensors, at_ticks: TickSensors, compared: Agreement, *, gyro: bool) -> list[str]:
    """Return what does not turn as the course of the fixes does, or as each other.

    Args:
        sensors: The sensors.
        at_ticks: The same at ticks.
        compared: Their agreement.
        gyro: Whether the gyro counts.
    """
    found, by_gyro = list[str](), compared.wheels_by_gyro
    still = math.isnan(compared.gyro) and math.isfinite(compared.wheels) and "imu" in sensors.columns
    if gyro and (_off(compared.gyro) or still):
        found.append(f"{_fields('imu', sensors.columns['imu'])}: {_gyro(compared)}")
    scaled = _off(compared.driven) and sensors.joints is not None  # then their turn is, too
    if _off(compared.wheels) and not (scaled and compared.wheels > 0.0):
        found.append(_wheels(sensors, compared.wheels, "course of the fixes"))
    if math.isnan(compared.gyro) and math.isnan(compared.wheels) and gyro and _off(by_gyro) and not scaled:
        found.append(_apart(sensors, at_ticks, by_gyro))
    return found


def _gyro(compared: Agreement) -> str:
    if math.isfinite(compared.gyro):
        if _opposite_sense(compared.gyro):
            return "it turns to the other side than the course of the fixes; give it the opposite sign"
        told = f"it turns {compared.gyro:.3g} rad for each radian of the fixes' course"
        return told + _excess(compared.gyro, _TURNS)
    for axis, factor in zip(("forward", "to the left"), compared.gyro_axes, strict=False):
        if math.isfinite(factor):
            return (
                f"the axis that is mapped {axis} turns with the course of the fixes, and not the one that is mapped "
                "up; name it as the last of imu.axes"
            )
    return "it does not turn as wheels and course of the fixes do; name the axis that points up as the last of imu.axes"


def _wheels(sensors: ForeignSensors, factor: float, witness: str) -> str:
    columns, joints = sensors.columns["wheels"], sensors.joints is not None
    field = _fields("wheels", columns if joints else columns[-1:])
    if _opposite_sense(factor):
        remedy = "exchange the two columns, or give both the opposite sign" if joints else "give it the opposite sign"
        return f"{field}: they turn to the other side than the {witness}; {remedy}"
    told = f"they turn by {factor:.3g} rad for each radian of the {witness}"
    if joints:
        return f"{field}: {told}; give a vehicle whose track is {abs(factor):.3g} times as wide, or mend their scales"
    return f"{field}: {told}{_excess(factor, _TURNS)}"


def _apart(sensors: ForeignSensors, at_ticks: TickSensors, factor: float) -> str:
    """Return which of wheels and gyro is wrong where no fixes tell it: what no robot does."""
    turn_rad = at_ticks.imu[:, 2] / TICKS_PER_S
    possible = _possible(turn_rad, _RATES_RADPS), _possible(turn_rad, _RATES_RADPS, 1.0 / factor)
    imu = _fields("imu", sensors.columns["imu"])
    if _opposite_sense(factor):
        return f"{_wheels(sensors, factor, 'gyro')}; or else {imu} counts clockwise"
    if factor > 0.0 and possible == (False, True):
        return f"{imu}: it turns {1.0 / factor:.3g} rad for each radian of the wheels{_excess(1.0 / factor, _TURNS)}"
    return _wheels(sensors, factor, "gyro") + ("" if possible == (True, False) else f", or of {imu}")

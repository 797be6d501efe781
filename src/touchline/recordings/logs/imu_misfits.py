"""Misfits of an IMU: axes by gravity and by the pushes of the drive, unit and sign of its accelerometer."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from touchline.recordings.logs.agreement import Agreement, pushed_rad
from touchline.recordings.logs.tick_sensors import TickSensors
from touchline.schemas.log_mapping import LogMapping
from touchline.schemas.vehicles.differential_drive import DifferentialDrive

_G_MPS2: Final = 9.80665
_GRAVITY_MPS2: Final = (8.8, 10.8)
_LEFT_OUT_MPS2: Final = 3.0
_G_RATIO: Final = 1.2
_UPRIGHT: Final = 0.8
_TURNED_RAD: Final = math.radians(60.0)


def of_gravity(mapping: LogMapping, at_ticks: TickSensors, drive: DifferentialDrive, compared: Agreement) -> list[str]:
    """Return what the mean force has against unit, sign and axes of the accelerometer."""
    force = compared.force_mps2
    size = float(np.linalg.norm(force))
    if mapping.imu is None or not math.isfinite(size):
        return []
    columns = "imu.columns.accel_x_mps2, accel_y_mps2 and accel_z_mps2"
    told = f"the mean of the accelerometer is {size:.3g} m/s², which is not gravity"
    if 1.0 / _G_RATIO < size < _G_RATIO:
        return [f"{columns}: {told}, as of g instead of m/s²; give them {_G_MPS2:.4g} times the scale of now"]
    if size < _LEFT_OUT_MPS2:
        return [f'{columns}: {told}: it has been left out; name columns with it, or say "accelerometer": false of imu']
    if not _GRAVITY_MPS2[0] < size < _GRAVITY_MPS2[1]:
        return [f"{columns}: {told}; give them {_G_MPS2 / size:.4g} times the scale of now"]
    if force[2] > _UPRIGHT * size:
        return []
    largest = int(np.abs(force).argmax())
    rightly = compared.gyro > 0.0 or (compared.wheels_by_gyro > 0.0 and not compared.one_source)
    if largest == 2 and rightly and not compared.gyro < 0.0:
        return [f"{columns}: gravity points down, though the gyro turns rightly; give them the opposite sign"]
    sign = float(np.sign(force[largest]))
    axes, certain = _upright(mapping, at_ticks, drive, largest, sign)
    up = _signed(mapping.imu.axes[largest], sign)
    other = "" if certain else ", or these turned about the last one"
    return [f"imu.axes: by gravity the sensor's {up} points up, and not {mapping.imu.axes[2]}; give {axes}{other}"]


def _upright(
    mapping: LogMapping, at_ticks: TickSensors, drive: DifferentialDrive, largest: int, sign: float
) -> tuple[str, bool]:
    """Return axes of which the last points up, and whether the others are told, by the pushes of the drive."""
    assert mapping.imu is not None
    turned = np.zeros((3, 3))
    for row, column in enumerate(((largest + 1) % 3, (largest + 2) % 3, largest)):
        turned[row, column] = 1.0
    turned[1:] *= sign
    pushed = pushed_rad(at_ticks, drive, turned)
    axes = [_signed(mapping.imu.axes[int(np.abs(row).argmax())], row.sum()) for row in turned]
    return _named(axes, 0.0 if math.isnan(pushed) else pushed), math.isfinite(pushed)


def of_push(mapping: LogMapping, compared: Agreement) -> list[str]:
    """Return what changes of speed and curves have against the axes."""
    if mapping.imu is None or not abs(compared.pushed) > _TURNED_RAD:
        return []
    backward = round(abs(compared.pushed) / (0.5 * math.pi)) == 2
    other = ", or if the wheels count backward, give them the opposite sign" if backward else ""
    named = _named(mapping.imu.axes, compared.pushed)
    return [
        (
            f"imu.axes: the accelerometer feels changes of speed and curves "
            f"{abs(math.degrees(compared.pushed)):.0f}° from where wheels and gyro have them; give {named}{other}"
        )
    ]


def _named(axes: Sequence[str], pushed: float) -> str:
    """Return axes that are turned about the last one until a push at an angle is one forward, as JSON."""
    forward, left, up = axes
    quarters = {
        0: (forward, left),
        1: (left, _signed(forward, -1.0)),
        2: (_signed(forward, -1.0), _signed(left, -1.0)),
        3: (_signed(left, -1.0), forward),
    }
    named = ", ".join(f'"{axis}"' for axis in (*quarters[round(pushed / (0.5 * math.pi)) % 4], up))
    return f"[{named}]"


def _signed(axis: str, sign: float) -> str:
    if sign > 0.0:
        return axis
    return axis[1:] if axis.startswith("-") else f"-{axis}"

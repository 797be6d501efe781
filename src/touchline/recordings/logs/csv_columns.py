"""Usual names of columns with their units: ``lat``, ``Longitude [deg]``, ``speed (km/h)``."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Final

import numpy as np

from touchline.recordings.logs.log_table import Floats

_UNITS: Final[Mapping[str, float]] = {
    "deg": 1.0,
    "degree": 1.0,
    "degrees": 1.0,
    "°": 1.0,
    "m": 1.0,
    "cm": 1e-2,
    "mm": 1e-3,
    "ft": 0.3048,
    "m/s": 1.0,
    "km/h": 1.0 / 3.6,
    "kmh": 1.0 / 3.6,
    "kph": 1.0 / 3.6,
    "kn": 1852.0 / 3600.0,
    "knots": 1852.0 / 3600.0,
    "mph": 0.44704,
    "rad": 1.0,
    "rad/s": 1.0,
    "deg/s": math.pi / 180.0,
    "°/s": math.pi / 180.0,
    "m/s2": 1.0,
    "m/s^2": 1.0,
    "m/s²": 1.0,
    "g": 9.80665,
}
"""Factors to metres, seconds and radians; to degrees for coordinates."""
_WRITTEN: Final[Mapping[str, str]] = {
    "latitude_deg": "lat latitude lat_deg gps_lat gps_latitude position_lat",
    "longitude_deg": "lon lng long longitude lon_deg long_deg gps_lon gps_lng gps_longitude position_long",
    "altitude_m": "alt altitude ele elevation height alt_m height_m ele_m gps_altitude",
    "east_m": "east easting e x x_m easting_m pos_x",
    "north_m": "north northing n y y_m northing_m pos_y",
    "up_m": "up z z_m pos_z",
    "speed_mps": "speed velocity speed_m_s v twist_twist_linear_x twist_linear_x linear_x",
    "yaw_rate_radps": "yaw_rate yawrate yaw_rate_rad_s twist_twist_angular_z twist_angular_z angular_z",
    "sigma_m": "hacc h_acc accuracy horizontal_accuracy sigma hacc_m",
    "satellites": "sats nsat numsv num_sv satellites_used num_sats",
    **{f"gyro_{axis}_radps": f"gyro_{axis} gyr_{axis} g{axis} gyro{axis} angular_velocity_{axis}" for axis in "xyz"},
    **{
        f"accel_{axis}_mps2": f"accel_{axis} acc_{axis} a{axis} accel{axis} linear_acceleration_{axis}"
        for axis in "xyz"
    },
}
_USUAL: Final = {quantity: tuple(names.split()) for quantity, names in _WRITTEN.items()}
_QUANTITY_OF: Final = {name: quantity for quantity, names in _USUAL.items() for name in (quantity, *names)}
_OF_TOPIC: Final = "field_"  # of `rostopic echo -p`
_UNIT: Final = re.compile(r"\s*[\[(]([^\[\]()]*)[\])]\s*$")


def plain_name(name: str) -> tuple[str, str]:
    """Return a column's name in lower case with underscores, and its unit in brackets: ``("longitude", "deg")``."""
    unit = _UNIT.search(name)
    bare = name[: unit.start()] if unit else name
    words = re.sub(r"[^a-z0-9]+", "_", bare.lower()).strip("_")
    return words.removeprefix(_OF_TOPIC), unit[1].strip().lower() if unit else ""


def with_usual_names(columns: Mapping[str, Floats]) -> dict[str, Floats]:
    """Return the columns, those of usual names under the quantity's name, too, in its unit."""
    found = dict(columns)
    for name, values in columns.items():
        bare, unit = plain_name(name)
        quantity = _QUANTITY_OF.get(bare)
        factor = _UNITS.get(unit, 1.0 if not unit else math.nan)
        if quantity is None or quantity in found or math.isnan(factor):
            continue
        if unit == "rad" and quantity.endswith("_deg"):
            factor = 180.0 / math.pi
        found[quantity] = values * factor
    return found


def mistaken_degrees(columns: Mapping[str, Floats]) -> str:
    """Return why a latitude or longitude is impossible, with the mapping that helps; empty if it is possible."""
    for quantity, most in (("latitude_deg", 90.0), ("longitude_deg", 360.0)):
        values = columns.get(quantity, np.zeros(0))
        size = float(np.median(np.abs(values[np.isfinite(values)]))) if np.isfinite(values).any() else 0.0
        if size > most:
            name = next(each for each in columns if plain_name(each)[0] in (quantity, *_USUAL[quantity]))
            remedy = f'"columns": {{"{quantity}": {{"column": "{name}", "scale": 1e-7}}}} in the mapping'
            return f"the column {name!r} is no {quantity} ({size:g}); if it counts 1e-7 degrees, say {remedy}"
    return ""

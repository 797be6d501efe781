"""Local east-north-up ↔ WGS 84, exact in both directions.

Both directions go through earth-centred coordinates, so a point of the tangent plane maps to its true latitude,
longitude and height. The geodetic latitude is found by Bowring's iteration (B. R. Bowring, "Transformation from
spatial to geographical coordinates", 1976), which near the surface converges to rounding in two rounds.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel

SEMI_MAJOR_M: Final = 6378137.0
FLATTENING: Final = 1.0 / 298.257223563
SEMI_MINOR_M: Final = SEMI_MAJOR_M * (1.0 - FLATTENING)
_E2: Final = FLATTENING * (2.0 - FLATTENING)
_EP2: Final = _E2 / (1.0 - _E2)

# A frame: sine and cosine of latitude and longitude, and the origin in earth-centred coordinates.
_SIN_LAT, _COS_LAT, _SIN_LON, _COS_LON, _X, _Y, _Z = range(7)
FRAME_SIZE: Final = 7

Floats = NDArray[np.float64]


@kernel
def _to_ecef(latitude: float, longitude: float, height_m: float) -> tuple[float, float, float]:
    sin_lat = math.sin(latitude)
    normal_m = SEMI_MAJOR_M / math.sqrt(1.0 - _E2 * sin_lat * sin_lat)
    outward = (normal_m + height_m) * math.cos(latitude)
    return (
        outward * math.cos(longitude),
        outward * math.sin(longitude),
        (normal_m * (1.0 - _E2) + height_m) * sin_lat,
    )


@kernel
def _from_ecef(x: float, y: float, z: float) -> tuple[float, float, float]:
    outward = math.hypot(x, y)
    reduced = math.atan2(z * SEMI_MAJOR_M, outward * SEMI_MINOR_M)
    latitude = 0.0
    for _ in range(3):
        sin, cos = math.sin(reduced), math.cos(reduced)
        latitude = math.atan2(z + _EP2 * SEMI_MINOR_M * sin * sin * sin, outward - _E2 * SEMI_MAJOR_M * cos * cos * cos)
        reduced = math.atan2((1.0 - FLATTENING) * math.sin(latitude), math.cos(latitude))
    sin_lat, cos_lat = math.sin(latitude), math.cos(latitude)
    normal_m = SEMI_MAJOR_M / math.sqrt(1.0 - _E2 * sin_lat * sin_lat)
    height = outward * cos_lat + z * sin_lat - normal_m * (1.0 - _E2 * sin_lat * sin_lat)
    return math.degrees(latitude), math.degrees(math.atan2(y, x)), height


@kernel
def to_geodetic(frame: Floats, east_m: float, north_m: float, up_m: float) -> tuple[float, float, float]:
    """Convert a local point to (latitude [°], longitude [°], height above the ellipsoid [m]).

    Args:
        frame: (FRAME_SIZE,) from `local_frame`.
        east_m: East coordinate.
        north_m: North coordinate.
        up_m: Up coordinate.
    """
    outward = frame[_COS_LAT] * up_m - frame[_SIN_LAT] * north_m
    geodetic: tuple[float, float, float] = _from_ecef(
        frame[_X] + frame[_COS_LON] * outward - frame[_SIN_LON] * east_m,
        frame[_Y] + frame[_SIN_LON] * outward + frame[_COS_LON] * east_m,
        frame[_Z] + frame[_COS_LAT] * north_m + frame[_SIN_LAT] * up_m,
    )
    return geodetic


@kernel
def to_local(frame: Floats, latitude_deg: float, longitude_deg: float, altitude_m: float) -> tuple[float, float, float]:
    """Convert a geodetic point to (east, north, up) [m].

    Args:
        frame: (FRAME_SIZE,) from `local_frame`.
        latitude_deg: WGS 84 latitude.
        longitude_deg: WGS 84 longitude.
        altitude_m: Height above the ellipsoid.
    """
    x, y, z = _to_ecef(math.radians(latitude_deg), math.radians(longitude_deg), altitude_m)
    x, y, z = x - frame[_X], y - frame[_Y], z - frame[_Z]
    outward = frame[_COS_LON] * x + frame[_SIN_LON] * y
    return (
        frame[_COS_LON] * y - frame[_SIN_LON] * x,
        frame[_COS_LAT] * z - frame[_SIN_LAT] * outward,
        frame[_COS_LAT] * outward + frame[_SIN_LAT] * z,
    )


@kernel
def _fill(frame: Floats, latitude: float, longitude: float, altitude_m: float) -> None:
    frame[_SIN_LAT], frame[_COS_LAT] = math.sin(latitude), math.cos(latitude)
    frame[_SIN_LON], frame[_COS_LON] = math.sin(longitude), math.cos(longitude)
    frame[_X], frame[_Y], frame[_Z] = _to_ecef(latitude, longitude, altitude_m)


def local_frame(latitude_deg: float, longitude_deg: float, altitude_m: float) -> Floats:
    """East-north-up tangent plane (FRAME_SIZE,) at an origin on or near the ellipsoid."""
    frame = np.zeros(FRAME_SIZE)
    _fill(frame, math.radians(latitude_deg), math.radians(longitude_deg), altitude_m)
    return frame

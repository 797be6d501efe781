"""Local east-north-up ↔ WGS 84, exact both ways.

Both directions go through earth-centred coordinates, so a point of the tangent plane maps to its true latitude,
longitude and height. The geodetic latitude is found by Bowring's iteration (B. R. Bowring, "Transformation from
spatial to geographical coordinates", 1976), which near the surface converges to rounding in two rounds.
"""

from __future__ import annotations

import math
from typing import Final

SEMI_MAJOR_M: Final = 6378137.0
FLATTENING: Final = 1.0 / 298.257223563
SEMI_MINOR_M: Final = SEMI_MAJOR_M * (1.0 - FLATTENING)
_E2: Final = FLATTENING * (2.0 - FLATTENING)
_EP2: Final = _E2 / (1.0 - _E2)


class LocalFrame:
    """The east-north-up tangent plane at an origin on or near the ellipsoid.

    Args:
        latitude_deg: Of the origin, WGS 84.
        longitude_deg: Of the origin.
        altitude_m: Of the origin, above the ellipsoid.
    """

    def __init__(self, latitude_deg: float, longitude_deg: float, altitude_m: float) -> None:
        """See the class."""
        latitude, longitude = math.radians(latitude_deg), math.radians(longitude_deg)
        self._sin_lat, self._cos_lat = math.sin(latitude), math.cos(latitude)
        self._sin_lon, self._cos_lon = math.sin(longitude), math.cos(longitude)
        self._origin = _to_ecef(latitude, longitude, altitude_m)

    def to_geodetic(self, east_m: float, north_m: float, up_m: float) -> tuple[float, float, float]:
        """(latitude [°], longitude [°], height above the ellipsoid [m]) of a local point."""
        outward = self._cos_lat * up_m - self._sin_lat * north_m
        x = self._origin[0] + self._cos_lon * outward - self._sin_lon * east_m
        y = self._origin[1] + self._sin_lon * outward + self._cos_lon * east_m
        z = self._origin[2] + self._cos_lat * north_m + self._sin_lat * up_m
        return _from_ecef(x, y, z)

    def to_local(self, latitude_deg: float, longitude_deg: float, altitude_m: float) -> tuple[float, float, float]:
        """(east, north, up) [m] of a geodetic point."""
        point = _to_ecef(math.radians(latitude_deg), math.radians(longitude_deg), altitude_m)
        x, y, z = point[0] - self._origin[0], point[1] - self._origin[1], point[2] - self._origin[2]
        outward = self._cos_lon * x + self._sin_lon * y
        east = self._cos_lon * y - self._sin_lon * x
        north = self._cos_lat * z - self._sin_lat * outward
        up = self._cos_lat * outward + self._sin_lat * z
        return east, north, up


def _to_ecef(latitude: float, longitude: float, height_m: float) -> tuple[float, float, float]:
    sin_lat = math.sin(latitude)
    normal_m = SEMI_MAJOR_M / math.sqrt(1.0 - _E2 * sin_lat * sin_lat)
    outward = (normal_m + height_m) * math.cos(latitude)
    return (
        outward * math.cos(longitude),
        outward * math.sin(longitude),
        (normal_m * (1.0 - _E2) + height_m) * sin_lat,
    )


def _from_ecef(x: float, y: float, z: float) -> tuple[float, float, float]:
    outward = math.hypot(x, y)
    reduced = math.atan2(z * SEMI_MAJOR_M, outward * SEMI_MINOR_M)
    latitude = 0.0
    for _ in range(3):
        sin, cos = math.sin(reduced), math.cos(reduced)
        latitude = math.atan2(z + _EP2 * SEMI_MINOR_M * sin**3, outward - _E2 * SEMI_MAJOR_M * cos**3)
        reduced = math.atan2((1.0 - FLATTENING) * math.sin(latitude), math.cos(latitude))
    sin_lat, cos_lat = math.sin(latitude), math.cos(latitude)
    normal_m = SEMI_MAJOR_M / math.sqrt(1.0 - _E2 * sin_lat * sin_lat)
    height = outward * cos_lat + z * sin_lat - normal_m * (1.0 - _E2 * sin_lat * sin_lat)
    return math.degrees(latitude), math.degrees(math.atan2(y, x)), height

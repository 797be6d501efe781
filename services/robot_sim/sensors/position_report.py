"""Columns of a position report: the message of a GNSS receiver or of the camera on its way to the computer."""

from __future__ import annotations

from typing import Final

TICK: Final = 0  # of validity
STAMP_S: Final = 1  # time of validity by the sensor's clock
LATITUDE: Final = 2  # this and the next two by a receiver alone [°, °, m]
LONGITUDE: Final = 3
ALTITUDE: Final = 4
VARIANCE: Final = 5  # per horizontal axis [m²]
VERTICAL_VARIANCE: Final = 6
FIX: Final = 7  # as in `gnss_truth`; a camera's poses count as fixed
SATELLITES: Final = 8
CORRECTION_AGE: Final = 9
EAST: Final = 10  # of a receiver's antenna, converted back from the three above; of the body by a camera [m]
NORTH: Final = 11
HEADING: Final = 12  # this and the next by a camera alone [rad]
HEADING_VARIANCE: Final = 13  # [rad²]
COLUMNS: Final = 14

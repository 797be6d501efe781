"""Misfits beside the motion: σ of the fixes, heading at the start, heading of the reference."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from touchline.recordings.logs.agreement import Agreement, heading_fit, scatter_m
from touchline.recordings.logs.foreign_sensors import FIXED, ForeignSensors
from touchline.schemas.log_mapping import LogMapping

_HEADING_OFF_RAD: Final = (math.radians(30.0), math.radians(150.0))
"""Beyond it a heading is another one; beyond the second the robot may have begun backward."""
_LEAST_SIGMA_M: Final = 1e-3
_MOST_SCATTER_SIGMAS: Final = 8.0
_LEAST_RATE_HZ: Final = 2.0
_MOST_SIGMA_M: Final = 1.0
_MOST_SIGMA_SCATTERS: Final = {True: 50.0, False: 2000.0}
"""σ over scatter of receivers with RTK-fixed positions, and of others, which smooth theirs."""


def of_start(mapping: LogMapping, compared: Agreement) -> list[str]:
    """Return what the first courses of the fixes have against the heading at the start."""
    given, found = mapping.heading.start_rad, compared.start_rad
    if given is None or math.isnan(found):
        return []
    off = abs(math.remainder(given - found, math.tau))
    if not _HEADING_OFF_RAD[0] < off < _HEADING_OFF_RAD[1]:
        return []
    from_north = abs(math.remainder(0.5 * math.pi - given - found, math.tau)) < _HEADING_OFF_RAD[0]
    aside = ", as if clockwise from north" if from_north else ""
    return [
        (
            f"heading.start_rad: it is {given:.2f}, and by the first courses of the fixes the robot heads "
            f"{found % math.tau:.2f} rad from east to north{aside}; give that, or leave it out"
        )
    ]


def of_sigma(mapping: LogMapping, sensors: ForeignSensors) -> list[str]:
    """Return what the scatter of the fixes has against their σ."""
    fixes = sensors.fixes
    if fixes is None or mapping.fixes is None or not (fixes.fix > 0).any():
        return []
    field = "fixes.sigma_m" if mapping.fixes.sigma_m is not None else "fixes.columns.sigma_m"
    sigma_m, scatter = float(np.median(fixes.sigma_m[fixes.fix > 0])), scatter_m(fixes)
    told = f"fixes report σ {sigma_m:.2g} m, and scatter by {scatter:.2g} m from one to the next"
    often = float(np.median(np.diff(fixes.time_s))) < 1.0 / _LEAST_RATE_HZ if len(fixes.time_s) > 1 else False
    if sigma_m < _LEAST_SIGMA_M or (often and scatter > _MOST_SCATTER_SIGMAS * sigma_m):
        return [f'{field}: {told}, as of a variance; give its root, "sigma_m": {math.sqrt(sigma_m):.2g} of fixes']
    fixed = bool(np.median(fixes.fix) == FIXED)
    if sigma_m > _MOST_SIGMA_M and sigma_m > _MOST_SIGMA_SCATTERS[fixed] * scatter:
        return [f"{field}: {told}, as of mm instead of metres; give it a scale 0.001 times that of now"]
    return []


def of_reference(sensors: ForeignSensors) -> list[str]:
    """Return what the course of the reference has against its heading."""
    if sensors.reference is None or (fit := heading_fit(sensors.reference)) is None:
        return []
    field = "reference.columns.heading_rad"
    if fit.scale == 0.0:
        return [f"{field}: it does not follow the course of the reference; of a quaternion the order is x, y, z, w"]
    if fit.scale == 1.0 and abs(fit.offset_rad) < _HEADING_OFF_RAD[0]:
        return []
    unit = " in degrees" if abs(fit.scale) < 1.0 else ""
    sense = " clockwise" if fit.scale < 0.0 else " from north" if unit == "" else ""
    return [
        (
            f"{field}: it follows the course of the reference as one that counts{unit}{sense} does; give it a scale "
            f"{fit.scale:.4g} times that of now, and the offset that makes it 0 to the east"
        )
    ]

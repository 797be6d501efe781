"""The real robot: the vehicle's file, changed by what the scenario's truth says of it."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TypeVar

from touchline.schemas.errors import SpecError
from touchline.schemas.spec import Spec
from touchline.schemas.truth import Truth
from touchline.schemas.vehicles import Vehicle

_Part = TypeVar("_Part", bound=Spec)


def true_vehicle(vehicle: Vehicle, truth: Truth) -> Vehicle:
    """Return the vehicle as it really is: world, sensors and accounts of the truth use it, the computer does not.

    A leaning mast is a lever at the height of the antenna. What a drive with two wheels does not have in common, and
    all that is of sensors, is in the truth alone.

    Args:
        vehicle: Vehicle as the computer is told.
        truth: Deviations from it.

    Raises:
        SpecError: The truth is about a part that the vehicle does not have.
    """
    if truth == Truth():
        return vehicle
    drive = _scaled(vehicle.drive, ("wheel_radius_m", "drum_radius_m"), "wheel_radius_relative", truth)
    drive = _scaled(drive, ("track_width_m", "wheelbase_m"), "track_width_relative", truth)
    return vehicle.model_copy(update={"drive": drive, "tool": _tool(vehicle, truth), "body": _body(vehicle, truth)})


def _scaled(part: _Part, names: Iterable[str], figure: str, truth: Truth) -> _Part:
    """Return a part with the one of these lengths that it has multiplied by one more than a figure of the truth."""
    share: float = getattr(truth, figure)
    if share == 0.0:
        return part
    name = next((each for each in names if each in type(part).model_fields), "")
    if not name:
        raise SpecError("scenario", f"truth.{figure}", "is of no use: the drive has no such length", "give 0")
    return part.model_copy(update={name: getattr(part, name) * (1.0 + share)})


def _tool(vehicle: Vehicle, truth: Truth) -> Spec:
    moved = {"nozzle_x_m": truth.nozzle_x_m, "nozzle_y_m": truth.nozzle_y_m}
    drifts = truth.drift_east_m, truth.drift_north_m
    if not any((*moved.values(), *drifts)):
        return vehicle.tool
    if not moved.keys() <= type(vehicle.tool).model_fields.keys():
        name = "drift_east_m" if any(drifts) else "nozzle_x_m"
        raise SpecError("scenario", f"truth.{name}", "is of no use: the vehicle has no nozzle", "give 0")
    return vehicle.tool.model_copy(update={name: getattr(vehicle.tool, name) + by for name, by in moved.items()})


def _body(vehicle: Vehicle, truth: Truth) -> Spec:
    body = vehicle.body
    height_m, ahead, left = body.gnss_antenna_z_m + truth.antenna_z_m, truth.mast_ahead_rad, truth.mast_left_rad
    place = {
        "gnss_antenna_x_m": body.gnss_antenna_x_m + truth.antenna_x_m + height_m * math.sin(ahead),
        "gnss_antenna_y_m": body.gnss_antenna_y_m + truth.antenna_y_m + height_m * math.sin(left) * math.cos(ahead),
        "gnss_antenna_z_m": height_m * math.cos(left) * math.cos(ahead),
    }
    return body.model_copy(update=place)

"""The body of a vehicle: what every one has, whatever drives it and whatever it carries."""

from typing import Annotated

from pydantic import Field

from touchline.schemas.spec import Spec
from touchline.schemas.vehicles.quantities import BodyPoint, Length, Mass, Place


class VehicleBody(Spec):
    """Mass, outline, antenna and battery, in the frame whose origin the drive defines (REP-103)."""

    mass_empty_kg: Mass = 56.0
    """Mass without paint."""
    radius_of_gyration_m: Length = 0.3
    """Radius of gyration about the vertical axis."""
    footprint_m: Annotated[tuple[BodyPoint, ...], Field(min_length=3, max_length=100)] = (
        (0.75, -0.33),
        (0.75, 0.33),
        (-0.35, 0.33),
        (-0.35, -0.33),
        (-0.15, -0.33),
        (-0.15, -0.50),
        (0.15, -0.50),
        (0.15, -0.33),
    )
    """Outline of the body with its tool, corner by corner (x, y)."""
    gnss_antenna_x_m: Place = 0.0
    """Antenna ahead of the axle."""
    gnss_antenna_y_m: Place = 0.0
    """Antenna to the left."""
    gnss_antenna_z_m: Place = 0.6
    """Antenna above the ground."""
    battery_wh: Annotated[float, Field(gt=0, le=1_000_000)] = 680.0
    """Energy of the full battery."""
    idle_power_w: Annotated[float, Field(ge=0, le=100_000)] = 45.0
    """Power of computer, receiver and pump.

    With what the motors draw on grass the battery lasts a bit over 5 h of work.
    """

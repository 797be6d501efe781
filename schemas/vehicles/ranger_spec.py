"""Ultrasonic rangers: data sheet of one in a vehicle's file."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from touchline.schemas.given_angles import Angle
from touchline.schemas.misfit import misfit
from touchline.schemas.vehicles.quantities import Length
from touchline.schemas.vehicles.sensor_spec import SensorSpec


class RangerSpec(SensorSpec):
    """Ultrasonic ranger: the distance of the nearest thing in its cone [m]; infinite without an echo.

    The echo may come from anywhere on the arc. Rangers with the same `rate_hz` fire together and hear each other.
    """

    kind: Literal["ranger"] = "ranger"
    rate_hz: Literal[1, 2, 4, 5, 10, 20] = 10
    height_m: Length = 0.2
    """Height above the ground."""
    direction_rad: Angle = 0.0
    """Direction of the cone's axis in the body frame."""
    cone_rad: Annotated[float, Field(gt=0, le=2)] = 0.26
    """Full angle of the cone: 15°."""
    min_m: Annotated[float, Field(ge=0, le=10)] = 0.02
    """Shortest range."""
    max_m: Annotated[float, Field(gt=0, le=20)] = 4.0
    """Longest range."""
    sigma_m: Annotated[float, Field(ge=0, le=1)] = 0.01
    """Noise of a range, 1 σ (assumed)."""

    @model_validator(mode="after")
    def _has_a_range(self) -> Self:
        if self.max_m <= self.min_m:
            raise misfit("max_m", self.max_m, f"give more than min_m, {self.min_m:g} m")
        return self

"""Errors of emulated lidars, by the weather, the ground and the mounting."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from touchline.schemas.given_angles import Angle
from touchline.schemas.sensor_truth import SensorTruth

_Share = Annotated[float, Field(ge=0, le=0.5)]


class LidarTruth(SensorTruth):
    """Errors of the lidars beyond their data sheets.

    No public figures of dropouts and false returns were found: all are assumed.
    """

    kind: Literal["lidar"] = "lidar"
    dropout_share: _Share = 0.005
    """Share of beams without a return (assumed; in rain 0.05)."""
    false_share: _Share = 0.0
    """Share of beams with a false return (assumed: drizzle 0.0001, heavy rain 0.001)."""
    false_within_m: Annotated[float, Field(gt=0, le=200)] = 2.0
    """Longest range of false returns (assumed)."""
    sun_rad: Angle | None = None
    """Direction of a low sun in the map frame, towards it; null: it is high or hidden."""
    sun_dropout_share: _Share = 0.2
    """Share of beams towards the sun without a return (assumed)."""
    sun_half_rad: Annotated[float, Field(gt=0, le=1)] = 0.1745
    """Half the angle in which the sun dazzles: 10° (assumed)."""
    pitch_error_rad: Annotated[float, Field(ge=-0.2, le=0.2)] = 0.0
    """Error of the plane's angle, nose down positive: mounting, or grass under the wheels."""
    ground_sigma_relative: _Share = 0.03
    """Noise of returns of the ground, 1 σ as a share of the range: grass is uneven (assumed)."""

    @model_validator(mode="after")
    def _leaves_some(self) -> Self:
        if max(self.dropout_share, self.sun_dropout_share) + self.false_share >= 1.0:
            raise ValueError("dropouts and false returns must be less than all beams")
        return self

"""2D lidars: data sheet of one in a vehicle's file."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from touchline.schemas.given_angles import Angle
from touchline.schemas.vehicles.quantities import Length
from touchline.schemas.vehicles.sensor_spec import SensorSpec

FULL_TURN_RAD = 6.283185307179586
OLDEST_BEAM_S = 0.6
"""Age up to which the robot's computer knows where it was when a beam was measured."""


class LidarSpec(SensorSpec):
    """Lidar that scans a plane; by default a 360° scanner of the RPLIDAR S2's class.

    A measurement has the range of every beam [m], counter-clockwise; infinite without a return. Its stamp is the time
    of the last beam.
    """

    kind: Literal["lidar"] = "lidar"
    rate_hz: Literal[1, 2, 4, 5, 10, 20, 25] = 10
    height_m: Length = 0.18
    """Height of the scanned plane above the ground."""
    pitch_rad: Annotated[float, Field(ge=-0.2, le=0.2)] = 0.0
    """Angle of the plane to the body's, nose down positive (assumed 0 unless measured)."""
    first_rad: Angle = -3.141592653589793
    """Direction of the first beam in the body frame."""
    step_rad: Annotated[float, Field(gt=0, le=0.1)] = 0.008726646259971648
    """Angle from beam to beam."""
    beams: Annotated[int, Field(ge=2, le=4000)] = 720
    """Beams of a scan."""
    scan_s: Annotated[float, Field(ge=0, le=1)] = 0.1
    """Time from the first beam to the last."""
    min_m: Annotated[float, Field(ge=0, le=10)] = 0.05
    """Shortest range."""
    max_m: Annotated[float, Field(gt=0, le=200)] = 30.0
    """Longest range, of a light surface."""
    dark_m: Annotated[float, Field(gt=0, le=200)] = 10.0
    """Longest range of a dark surface: a person's clothes."""
    sigma_m: Annotated[float, Field(ge=0, le=1)] = 0.01
    """Noise of a range, 1 σ."""
    sigma_relative: Annotated[float, Field(ge=0, le=0.2)] = 0.0
    """Part of the noise that grows with the range, 1 σ as a share."""
    systematic_m: Annotated[float, Field(ge=0, le=1)] = 0.03
    """Largest error that a whole session shares."""
    beam_rad: Annotated[float, Field(ge=0, le=0.1)] = 0.005
    """Width of a beam: at an edge the range may lie between both surfaces."""

    @model_validator(mode="after")
    def _within_a_turn(self) -> Self:
        if (self.beams - 1) * self.step_rad > FULL_TURN_RAD:
            raise ValueError(f"beams × step_rad must be at most a full turn, {FULL_TURN_RAD:.4f} rad")
        if self.scan_s * self.rate_hz > 1.0 + 1e-9:
            raise ValueError("scan_s must be at most the time from scan to scan, 1 / rate_hz")
        if self.scan_s + self.latency_s > OLDEST_BEAM_S:
            raise ValueError(
                f"scan_s + latency_s must be at most {OLDEST_BEAM_S} s; give a smaller scan_s or latency_s"
            )
        return self

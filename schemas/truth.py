"""Truth of a scenario: what differs between the real robot and the file that its computer is told."""

from typing import Annotated

from pydantic import Field

from touchline.schemas.spec import GrownSpec

_Share = Annotated[float, Field(ge=-0.2, le=0.2)]
_Offset = Annotated[float, Field(ge=-0.5, le=0.5)]
_Lean = Annotated[float, Field(ge=-0.3, le=0.3)]


class Truth(GrownSpec):
    """The real robot where it is not as its file says; all figures are 0 by default, which is as the file says.

    Written only if a figure is not: scenarios without any, and their hashes, are what they were before.
    """

    wheel_radius_relative: _Share = 0.0
    """Radius of the driven wheels or the drum beyond the file's, as a share: wear, pressure (1 %: assumed)."""
    wheel_difference_relative: _Share = 0.0
    """Radius of the right wheel beyond that of the left, as a share of both; of drives with two (assumed)."""
    tyre_load_relative: _Share = 0.0
    """Tyres' radius with a full tank beyond that with an empty one, as a share (assumed).

    The mean is the file's. Of drives with two wheels.
    """
    tyre_warming_relative: _Share = 0.0
    """Growth of the tyres' radius as they get warm, as a share, with a time constant of 600 s (assumed).

    Of drives with two wheels.
    """
    track_width_relative: _Share = 0.0
    """Track width, or wheelbase of a steered drive, beyond that in the file, as a share (1 %: assumed)."""
    antenna_x_m: _Offset = 0.0
    """Place of the antenna ahead of that in the file (1 cm by tape measure)."""
    antenna_y_m: _Offset = 0.0
    """The same, to the left."""
    antenna_z_m: _Offset = 0.0
    """The same, above."""
    mast_ahead_rad: _Lean = 0.0
    """Lean of the antenna's mast forward, about its foot on the ground: 1° at 0.6 m is a lever of 10 mm (assumed)."""
    mast_left_rad: _Lean = 0.0
    """The same, to the left."""
    nozzle_x_m: _Offset = 0.0
    """Place of the nozzle ahead of that in the file (assumed)."""
    nozzle_y_m: _Offset = 0.0
    """The same, to the left."""
    gyro_scale_relative: _Share = 0.0
    """Error of the gyro's scale about z: 0.01 reads 1 % too much (MPU-6050: 3 %)."""
    gyro_lean_x_rad: _Lean = 0.0
    """Lean of the gyro's z axis forward: it then reads as much of the roll rate (MPU-6050: 2 % across axes)."""
    gyro_lean_y_rad: _Lean = 0.0
    """The same, to the left: of the pitch rate."""
    hard_iron_x_t: Annotated[float, Field(ge=-1e-4, le=1e-4)] = 0.0
    """Hard iron ahead, beside what the seed draws; 0.3 µT turn the heading by 1° (assumed)."""
    hard_iron_y_t: Annotated[float, Field(ge=-1e-4, le=1e-4)] = 0.0
    """The same, to the left."""
    stamp_offset_s: Annotated[float, Field(ge=-0.5, le=0.5)] = 0.0
    """Stamps of fixes less the time of measurement (50 to 200 ms if a driver stamps the arrival)."""
    stamp_jitter_s: Annotated[float, Field(ge=0, le=0.1)] = 0.0
    """Random part of that, 1 σ, drawn anew for each fix (assumed)."""
    base_east_m: Annotated[float, Field(ge=-10, le=10)] = 0.0
    """Error of the base station's position on that day, east: fixes and float solutions have it (assumed)."""
    base_north_m: Annotated[float, Field(ge=-10, le=10)] = 0.0
    """The same, north."""
    crab_rad: _Lean = 0.0
    """Angle of the motion beyond the heading: to the left forward, to the right in reverse (assumed)."""
    wander_rad: Annotated[float, Field(ge=0, le=0.3)] = 0.0
    """Random part of that angle, 1 σ, a Gauss-Markov process over the distance (log of a mower: 0.020)."""
    wander_m: Annotated[float, Field(ge=0.05, le=100)] = 1.1
    """Length over which that process is correlated (log of the same mower)."""
    vibration_mps2: Annotated[float, Field(ge=0, le=10)] = 0.0
    """Vibration of the drive above 10 Hz at 1 m/s, 1 σ an axis of the accelerometer, in proportion to the speed.

    0.3 to 0.5 beside rough ground explain logs of two robots on grass and paths.
    """
    patch_slip_relative: Annotated[float, Field(ge=0, le=0.3)] = 0.0
    """Slip of the wheels that depends on the place, 1 σ as a share: patches of moss, mud or long grass (assumed)."""
    patch_m: Annotated[float, Field(ge=0.2, le=100)] = 3.0
    """Distance at which the slip of two places is correlated by 0.61 (assumed)."""
    drift_east_m: _Offset = 0.0
    """Place of the paint beside the nozzle's because of wind, east.

    Drops of 0.2 mm that fall 10 cm at 10 m/s drift by 2 mm in a wind of 5 m/s by Stokes' drag (assumed).
    """
    drift_north_m: _Offset = 0.0
    """The same, north."""

    later_fields = ("vibration_mps2", "patch_slip_relative", "patch_m", "drift_east_m", "drift_north_m")

"""What the differential drive has of its own in the world's state, and its figures."""

from __future__ import annotations

from typing import Final, NamedTuple

from touchline.services.robot_sim.world.body import ANGLES, DRIVE
from touchline.services.robot_sim.world.drives.dc_motor import DcMotor

LEFT_ANGLE: Final = ANGLES
RIGHT_ANGLE: Final = ANGLES + 1

# State.
LEFT_RATE: Final = DRIVE  # rad/s
RIGHT_RATE: Final = DRIVE + 1
LEFT_SLIP: Final = DRIVE + 2  # random share of ground speed lost; the tyres' own slip comes on top
RIGHT_SLIP: Final = DRIVE + 3
REFERENCE: Final = DRIVE + 4  # left, right: the drives' speed profile [rad/s]
TORQUE: Final = DRIVE + 6  # left, right: of the motors at the wheels [Nm]
INTEGRAL: Final = DRIVE + 8  # left, right: of the drives' controllers [Nm]
CASTER_X: Final = DRIVE + 10  # direction in which the casters roll, body frame, unit vector
CASTER_Y: Final = DRIVE + 11
LEFT_TRACTION: Final = DRIVE + 12  # N, of the tyres, in the last step
RIGHT_TRACTION: Final = DRIVE + 13
STATE_SIZE: Final = 14  # of these


class TrueDifferential(NamedTuple):
    """The drive as it is: each seed has its own errors of radius and track on top of the nominal figures.

    Attributes:
        radius_m: Of the left and the right wheel.
        track_m: Between them.
        max_rate_radps: Of the wheels' speed profile.
        max_step_radps: By which it changes in one step at most.
        lag: Share of the difference to the command that it makes up in one step.
        inertia_kgm2: Of a wheel, motor's share included.
        motor: Of either wheel.
        friction_nm: At the wheel, dry.
        viscous_nms: At the wheel, Nm per rad/s.
        ahead_common_kgm2: Feed-forward of both wheels speeding up together.
        ahead_turn_kgm2: And against each other.
        caster_x_m: Of the casters, ahead of the axle.
        caster_share: Of the weight, on the casters.
        caster_trail_m: Theirs.
    """

    radius_m: tuple[float, float]
    track_m: float
    max_rate_radps: float
    max_step_radps: float
    lag: float
    inertia_kgm2: float
    motor: DcMotor
    friction_nm: float
    viscous_nms: float
    ahead_common_kgm2: float
    ahead_turn_kgm2: float
    caster_x_m: float
    caster_share: float
    caster_trail_m: float

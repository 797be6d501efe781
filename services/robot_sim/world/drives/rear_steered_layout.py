"""What the rear-steered drive has of its own in the world's state, and its figures."""

from __future__ import annotations

from typing import Final, NamedTuple

from touchline.services.robot_sim.world.body import ANGLES, DRIVE
from touchline.services.robot_sim.world.drives.dc_motor import DcMotor

DRUM_ANGLE: Final = ANGLES
STEERING: Final = ANGLES + 1  # as its encoder sees it: positive turns the wheel to the left

# State.
DRUM_RATE: Final = DRIVE  # rad/s
DRUM_SLIP: Final = DRIVE + 1  # random share of ground speed lost; the drum's own slip comes on top
REFERENCE: Final = DRIVE + 2  # the drum's speed profile [rad/s]
TORQUE: Final = DRIVE + 3  # of the motor at the drum [Nm]
INTEGRAL: Final = DRIVE + 4  # of its controller [Nm]
TRACTION: Final = DRIVE + 5  # N, of the drum, in the last step
SIDE_FORCE: Final = DRIVE + 6  # N, of the steered wheel across itself, in the last step
STATE_SIZE: Final = 7  # of these


class TrueRearSteered(NamedTuple):
    """The drive as it is: each seed has its own errors of radius, wheelbase and steering on top of the nominal figures.

    Attributes:
        radius_m: Of the drum.
        base_m: From axle to axle.
        behind_m: Of the centre of mass behind the drum's axle.
        drum_share: Of the weight, on the drum.
        offset_rad: Of the wheel beyond its encoder's angle.
        stop_rad: Where the steering ends, to either side.
        steering_step_rad: By which it turns in one step at most.
        steering_lag: Share of the way to the command that it makes in one step.
        max_rate_radps: Of the drum's speed profile.
        max_step_radps: By which it changes in one step at most.
        lag: Share of the difference to the command that it makes up in one step.
        inertia_kgm2: Of the drum, motor's share included.
        motor: The drum's.
        friction_nm: At the drum, dry.
        viscous_nms: At the drum, Nm per rad/s.
        ahead_kgm2: Feed-forward of drum and mass speeding up.
    """

    radius_m: float
    base_m: float
    behind_m: float
    drum_share: float
    offset_rad: float
    stop_rad: float
    steering_step_rad: float
    steering_lag: float
    max_rate_radps: float
    max_step_radps: float
    lag: float
    inertia_kgm2: float
    motor: DcMotor
    friction_nm: float
    viscous_nms: float
    ahead_kgm2: float

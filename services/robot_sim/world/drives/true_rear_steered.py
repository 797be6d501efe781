"""What the rear-steered drive has of its own in the world: its state and its figures."""

from __future__ import annotations

from typing import NamedTuple

from touchline.core.records import Record
from touchline.services.robot_sim.world.drives.dc_motor import DcMotor


class RearSteeredState(Record):
    """Of the drum and its motor, and the steered wheel's force. Of the body's angles the second is the steering's.

    It is that which its encoder sees: positive turns the wheel to the left.
    """

    rate_radps: float
    """The drum's."""
    slip: float
    """Random share of ground speed lost; the drum's own slip comes on top."""
    reference_radps: float
    """Of the drum's speed profile."""
    torque_nm: float
    """Of the motor at the drum."""
    integral_nm: float
    """Of its controller."""
    traction_n: float
    """Of the drum, in the last step."""
    side_force_n: float
    """Of the steered wheel across itself, in the last step."""


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

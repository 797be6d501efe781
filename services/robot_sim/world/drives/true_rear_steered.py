"""State and parameters of the rear-steered drive in the world."""

from __future__ import annotations

from typing import NamedTuple

from touchline.core.records import Record
from touchline.services.robot_sim.world.drives.dc_motor import DcMotor


class RearSteeredState(Record):
    """State of the drum and its motor, and the steered wheel's force.

    The steering angle is the second of the body's angles: that of its encoder, positive with the wheel to the left.
    """

    rate_radps: float
    """Rate of the drum."""
    slip: float
    """Random share of ground speed lost, in addition to the drum's own slip."""
    reference_radps: float
    """Reference of the drum's speed profile."""
    torque_nm: float
    """Torque of the motor at the drum."""
    integral_nm: float
    """Integral of its controller."""
    traction_n: float
    """Traction of the drum in the last step."""
    side_force_n: float
    """Lateral force of the steered wheel in the last step."""


class TrueRearSteered(NamedTuple):
    """Parameters of the true drive: each seed has its own errors of radius, wheelbase and steering.

    Attributes:
        radius_m: Radius of the drum.
        base_m: Wheelbase.
        behind_m: Distance of the centre of mass behind the drum's axle.
        drum_share: Share of the weight on the drum.
        offset_rad: Angle of the wheel beyond its encoder's reading.
        stop_rad: Largest steering angle, to either side.
        steering_step_rad: Largest change of the steering in one step.
        steering_lag: Share of the way to the command that it makes in one step.
        max_rate_radps: Largest rate of the drum's speed profile.
        max_step_radps: Largest change of that in one step.
        lag: Share of the difference to the command that it makes up in one step.
        inertia_kgm2: Inertia of the drum, motor's share included.
        motor: Motor of the drum.
        friction_nm: Dry friction at the drum.
        viscous_nms: Viscous friction at the drum, Nm per rad/s.
        ahead_kgm2: Feed-forward for accelerating drum and mass.
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

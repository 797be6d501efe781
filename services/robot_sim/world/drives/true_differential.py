"""What the differential drive has of its own in the world: its state and its figures."""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.records import Record
from touchline.services.robot_sim.world.drives.dc_motor import DcMotor

Floats = NDArray[np.float64]


class DifferentialState(Record):
    """Of the left and the right wheel, their motors, and the casters."""

    rate_radps: Annotated[Floats, 2]
    slip: Annotated[Floats, 2]
    """Random share of ground speed lost; the tyres' own slip comes on top."""
    reference_radps: Annotated[Floats, 2]
    """Of the speed profiles."""
    torque_nm: Annotated[Floats, 2]
    """Of the motors at the wheels."""
    integral_nm: Annotated[Floats, 2]
    """Of the motors' controllers."""
    traction_n: Annotated[Floats, 2]
    """Of the tyres, in the last step."""
    caster_x: float = 1.0
    """With `caster_y` the direction in which the casters roll, body frame, unit vector."""
    caster_y: float


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

"""State and parameters of the differential drive in the world."""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.records import Record
from touchline.services.robot_sim.world.drives.dc_motor import DcMotor

Floats = NDArray[np.float64]


class DifferentialState(Record):
    """State of the left and the right wheel, their motors, and the casters."""

    rate_radps: Annotated[Floats, 2]
    slip: Annotated[Floats, 2]
    """Random share of ground speed lost, in addition to the tyres' own slip."""
    reference_radps: Annotated[Floats, 2]
    """References of the speed profiles."""
    torque_nm: Annotated[Floats, 2]
    """Torques of the motors at the wheels."""
    integral_nm: Annotated[Floats, 2]
    """Integrals of the motors' controllers."""
    traction_n: Annotated[Floats, 2]
    """Traction of the tyres in the last step."""
    warm_relative: float = 1.0
    """Radius of the tyres, relative to that of cold ones."""
    caster_x: float = 1.0
    """Rolling direction of the casters, body frame, unit vector with `caster_y`."""
    caster_y: float


class TrueDifferential(NamedTuple):
    """Parameters of the true drive: each seed has its own errors of radius and track in addition to the nominal values.

    Attributes:
        radius_m: Radius of the left and the right wheel.
        load_1pkg: Growth of that with the robot's mass, as a share.
        mean_kg: Mass at which it is `radius_m`.
        warming: Final growth of it as the tyres get warm, as a share.
        track_m: Distance between the wheels.
        max_rate_radps: Largest rate of the wheels' speed profile.
        max_step_radps: Largest change of that in one step.
        lag: Share of the difference to the command that it makes up in one step.
        inertia_kgm2: Inertia of a wheel, motor's share included.
        motor: Motor of either wheel.
        friction_nm: Dry friction at the wheel.
        viscous_nms: Viscous friction at the wheel, Nm per rad/s.
        ahead_common_kgm2: Feed-forward for accelerating both wheels together.
        ahead_turn_kgm2: Feed-forward for accelerating them against each other.
        caster_x_m: Position of the casters ahead of the axle.
        caster_share: Share of the weight on the casters.
        caster_trail_m: Trail of the casters.
    """

    radius_m: tuple[float, float]
    load_1pkg: float
    mean_kg: float
    warming: float
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

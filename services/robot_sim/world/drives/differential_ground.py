"""The robot on the ground: tyres that slip, casters that drag, a slope, and the body's own inertia.

The tyres' forces (`tyres`) are integrated implicitly, linear in the new speeds with the stiffness of the old slip,
because on grass at walking pace a tyre settles within a millisecond. Casters roll along a direction that follows their
motion within the trail's length; their rolling resistance acts along it, so after a turn or a reversal they pull the
robot aside.
"""

from __future__ import annotations

import math

from touchline.core.jit import kernel
from touchline.core.physical_constants import GRAVITY_MPS2
from touchline.services.robot_sim.world.body import STEP_S, BodyFigures, BodyState
from touchline.services.robot_sim.world.drives.dc_motor import drag
from touchline.services.robot_sim.world.drives.true_differential import DifferentialState, TrueDifferential
from touchline.services.robot_sim.world.drives.tyres import ROLLING_MPS, held, stiffness
from touchline.services.robot_sim.world.effects import Effects

_PARKED_MPS = 0.002
_PARKED_RADPS = 1e-3


@kernel
def _caster(
    drive: TrueDifferential, state: BodyState, wheels: DifferentialState, body: BodyFigures, load_n: float
) -> tuple[float, float]:
    """Turn the casters by their motion; return their force on the body (x, y) [N]."""
    vx = state.speed_mps
    vy = state.side_speed_mps + drive.caster_x_m * state.yaw_rate_radps
    cx, cy = wheels.caster_x, wheels.caster_y
    rolling = vx * cx + vy * cy
    pull = min(STEP_S / drive.caster_trail_m, 1.0)
    cx += pull * (vx - rolling * cx)
    cy += pull * (vy - rolling * cy)
    length = math.sqrt(cx * cx + cy * cy)
    wheels.caster_x, wheels.caster_y = cx / length, cy / length
    force = -body.rolling * load_n * min(max(rolling / ROLLING_MPS, -1.0), 1.0)
    return force * wheels.caster_x, force * wheels.caster_y


@kernel
def _parked(state: BodyState, wheels: DifferentialState, body: BodyFigures) -> bool:
    """Return True if the robot stands, is commanded to, and the tyres hold it on this slope."""
    told = abs(wheels.reference_radps[0]) < _PARKED_RADPS and abs(wheels.reference_radps[1]) < _PARKED_RADPS
    slow = abs(state.speed_mps) + abs(state.side_speed_mps) + 0.3 * abs(state.yaw_rate_radps) < _PARKED_MPS
    parked: bool = held(state, body) and told and slow
    return parked


@kernel
def roll_on(
    drive: TrueDifferential,
    state: BodyState,
    wheels: DifferentialState,
    body: BodyFigures,
    effects: Effects,
    mass_kg: float,
) -> None:
    """Advance the speeds of body and wheels by one step under the motors' torques.

    The wheels turn along the mean of their old and new rates. That a tyre's force is linear in its slip at first and
    then saturates, the same for both directions together, is as in brush models (H. B. Pacejka, "Tire and Vehicle
    Dynamics", ch. 3); the curve between, see the module, is this project's own choice.

    Args:
        drive: Parameters of the drive.
        state: State of the body with the slip of its place; speeds, yaw rate and the wheels' angles are updated.
        wheels: State of the drive; rates, traction and the casters' direction are updated.
        body: Parameters of the body.
        effects: Effects of faults: blocked wheels, and slip of each wheel.
        mass_kg: Mass of the whole robot.
    """
    left_rate, right_rate = wheels.rate_radps[0], wheels.rate_radps[1]
    if _parked(state, wheels, body):
        state.speed_mps, state.side_speed_mps, state.yaw_rate_radps = 0.0, 0.0, 0.0
        for wheel in range(2):
            wheels.rate_radps[wheel], wheels.traction_n[wheel] = 0.0, 0.0
        state.angles_rad[0] += 0.5 * left_rate * STEP_S
        state.angles_rad[1] += 0.5 * right_rate * STEP_S
        return
    weight = mass_kg * GRAVITY_MPS2 * state.up_z
    load = 0.5 * weight * (1.0 - drive.caster_share)
    half = 0.5 * drive.track_m
    caster_x, caster_y = _caster(drive, state, wheels, body, weight * drive.caster_share)
    speed, side, yaw = state.speed_mps, state.side_speed_mps, state.yaw_rate_radps

    # Each wheel's new speed is linear in the ground's under it: force = stiff·(free − ground).
    pressed = wheels.warm_relative * (1.0 + drive.load_1pkg * (mass_kg - drive.mean_kg))
    k0, f0, r0, k1, f1, r1, across = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for wheel in range(2):
        rate = wheels.rate_radps[wheel]
        radius = pressed * drive.radius_m[wheel]
        grip = radius * (1.0 - wheels.slip[wheel] - effects.slip[wheel] - state.patch_slip[wheel])
        beneath = speed + (2 * wheel - 1) * half * yaw
        if effects.blocked[wheel]:
            stiff, sideways = stiffness(0.0, beneath, side, load, body)
            free = 0.0
        else:
            stiff, sideways = stiffness(grip * rate, beneath, side, load, body)
            inertia = drive.inertia_kgm2 + STEP_S * drag(rate, drive.viscous_nms, drive.friction_nm)
            free = grip * (drive.inertia_kgm2 * rate + STEP_S * wheels.torque_nm[wheel]) / inertia
            stiff /= 1.0 + stiff * STEP_S * grip * radius / inertia
        across += sideways
        rolling = body.rolling * load / max(abs(beneath), ROLLING_MPS)
        if wheel == 0:
            k0, f0, r0 = stiff, free, rolling
        else:
            k1, f1, r1 = stiff, free, rolling

    inertia = mass_kg * body.gyration_m2
    a11 = mass_kg / STEP_S + k0 + r0 + k1 + r1
    a12 = half * (k1 + r1 - k0 - r0)
    a22 = inertia / STEP_S + half * half * (k0 + r0 + k1 + r1)
    b1 = mass_kg / STEP_S * speed + k0 * f0 + k1 * f1 + caster_x
    b1 += mass_kg * (side * yaw - GRAVITY_MPS2 * state.up_x)
    b2 = inertia / STEP_S * yaw + half * (k1 * f1 - k0 * f0) + drive.caster_x_m * caster_y
    determinant = a11 * a22 - a12 * a12
    speed = (b1 * a22 - b2 * a12) / determinant
    yaw = (a11 * b2 - a12 * b1) / determinant
    pushed = mass_kg / STEP_S * side + caster_y - mass_kg * (speed * yaw + GRAVITY_MPS2 * state.up_y)
    state.side_speed_mps = pushed / (mass_kg / STEP_S + across)
    state.speed_mps, state.yaw_rate_radps = speed, yaw

    for wheel in range(2):
        beneath = speed + (2 * wheel - 1) * half * yaw
        force = k0 * (f0 - beneath) if wheel == 0 else k1 * (f1 - beneath)
        wheels.traction_n[wheel] = force
        if effects.blocked[wheel]:
            wheels.rate_radps[wheel] = 0.0
        else:
            rate = wheels.rate_radps[wheel]
            momentum = drive.inertia_kgm2 * rate + STEP_S * (
                wheels.torque_nm[wheel] - pressed * drive.radius_m[wheel] * force
            )
            wheels.rate_radps[wheel] = momentum / (
                drive.inertia_kgm2 + STEP_S * drag(rate, drive.viscous_nms, drive.friction_nm)
            )
    state.angles_rad[0] += 0.5 * (left_rate + wheels.rate_radps[0]) * STEP_S
    state.angles_rad[1] += 0.5 * (right_rate + wheels.rate_radps[1]) * STEP_S

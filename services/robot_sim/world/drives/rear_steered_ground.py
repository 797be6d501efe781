"""The roller on the ground: a bicycle whose front, the drum, is driven and whose rear wheel steers; both slip.

Drum and wheel push as tyres do (`tyres`), along and across the drum and across the wheel, which rolls freely. All
forces are integrated implicitly, linear in the new speeds with the stiffness of the old slip. The speeds are those of
the drum's middle; the centre of mass is behind it, by the shares of the weight. Scuffing of a wide drum in a turn and
yielding of clay are not modelled: no data are known.
"""

from __future__ import annotations

import math

from touchline.core.jit import kernel
from touchline.core.physical_constants import GRAVITY_MPS2
from touchline.services.robot_sim.world.body import STEP_S, BodyFigures, BodyState
from touchline.services.robot_sim.world.drives.dc_motor import drag
from touchline.services.robot_sim.world.drives.true_rear_steered import RearSteeredState, TrueRearSteered
from touchline.services.robot_sim.world.drives.tyres import ROLLING_MPS, held, stiffness
from touchline.services.robot_sim.world.effects import Effects

_PARKED_MPS = 0.002
_PARKED_RADPS = 1e-3


@kernel
def _parked(state: BodyState, drum: RearSteeredState, body: BodyFigures) -> bool:
    """Return True if the robot stands, is commanded to, and drum and wheel hold it on this slope."""
    told = abs(drum.reference_radps) < _PARKED_RADPS
    slow = abs(state.speed_mps) + abs(state.side_speed_mps) + abs(state.yaw_rate_radps) < _PARKED_MPS
    parked: bool = told and slow and held(state, body)
    return parked


@kernel
def _drum(
    drive: TrueRearSteered, state: BodyState, drum: RearSteeredState, body: BodyFigures, effects: Effects, load: float
) -> tuple[float, float, float]:
    """Return stiff, free and the stiffness across: along, the drum's force is stiff·(free − new speed)."""
    speed, side, rate = state.speed_mps, state.side_speed_mps, drum.rate_radps
    if effects.blocked[0]:
        stiff, across = stiffness(0.0, speed, side, load, body)
        return stiff, 0.0, across
    here = 0.5 * (state.patch_slip[0] + state.patch_slip[1])
    grip = drive.radius_m * (1.0 - drum.slip - effects.slip[0] - here)
    stiff, across = stiffness(grip * rate, speed, side, load, body)
    inertia = drive.inertia_kgm2 + STEP_S * drag(rate, drive.viscous_nms, drive.friction_nm)
    free = grip * (drive.inertia_kgm2 * rate + STEP_S * drum.torque_nm) / inertia
    return stiff / (1.0 + stiff * STEP_S * grip * drive.radius_m / inertia), free, across


@kernel
def _turn_drum(
    drive: TrueRearSteered, state: BodyState, drum: RearSteeredState, effects: Effects, before: float, force: float
) -> None:
    """Update the drum's rate under torque and traction; it turns along the mean of old and new."""
    drum.traction_n = force
    if effects.blocked[0]:
        drum.rate_radps = 0.0
    else:
        momentum = drive.inertia_kgm2 * before + STEP_S * (drum.torque_nm - drive.radius_m * force)
        dragged = drive.inertia_kgm2 + STEP_S * drag(before, drive.viscous_nms, drive.friction_nm)
        drum.rate_radps = momentum / dragged
    state.angles_rad[0] += 0.5 * (before + drum.rate_radps) * STEP_S


@kernel
def roll_on(
    drive: TrueRearSteered,
    state: BodyState,
    drum: RearSteeredState,
    body: BodyFigures,
    effects: Effects,
    mass_kg: float,
) -> None:
    """See `world_drive.roll_on`: body and drum under the motor's torque, by one implicit step of Newton's laws.

    The single-track ("bicycle") model (R. Rajamani, "Vehicle Dynamics and Control", 2nd ed., ch. 2) with the
    longitudinal motion, driven in front and steered behind. The drum turns along the mean of its old and new rates. The
    traction of the drum and the lateral force of the wheel are recorded [N].
    """
    rate = drum.rate_radps
    if _parked(state, drum, body):
        state.speed_mps, state.side_speed_mps, state.yaw_rate_radps = 0.0, 0.0, 0.0
        drum.rate_radps, drum.traction_n, drum.side_force_n = 0.0, 0.0, 0.0
        state.angles_rad[0] += 0.5 * rate * STEP_S
        return
    speed, side, yaw = state.speed_mps, state.side_speed_mps, state.yaw_rate_radps
    base, behind = drive.base_m, drive.behind_m
    weight = mass_kg * GRAVITY_MPS2 * state.up_z
    front = weight * drive.drum_share
    rear = weight - front
    stiff, free, across = _drum(drive, state, drum, body, effects, front)
    rolling = body.rolling * front / max(abs(speed), ROLLING_MPS)

    # Steered wheel: its contact's speed along t = (cos, sin) and across n = (−sin, cos).
    angle = state.angles_rad[1] + drive.offset_rad + effects.offset_rad[1]
    cos, sin = math.cos(angle), math.sin(angle)
    beneath = side - base * yaw
    along, aside = cos * speed + sin * beneath, cos * beneath - sin * speed
    _, hold = stiffness(along, along, aside, rear, body)
    hold *= 1.0 - effects.slip[1]
    drags = body.rolling * rear / max(abs(along), ROLLING_MPS)
    # Its force on the body is −K·(u, v_y − L·ω) with K symmetric.
    kxx = drags * cos * cos + hold * sin * sin
    kxy = (drags - hold) * cos * sin
    kyy = drags * sin * sin + hold * cos * cos

    # Newton along and across, and about the drum's middle, in (u, v_y, ω): M·(new − old)/dt = forces.
    push = mass_kg / STEP_S
    inertia = mass_kg * (body.gyration_m2 + behind * behind) / STEP_S
    b1 = push * speed + stiff * free + mass_kg * ((side - behind * yaw) * yaw - GRAVITY_MPS2 * state.up_x)
    outward = mass_kg * (speed * yaw + GRAVITY_MPS2 * state.up_y)
    b2 = push * (side - behind * yaw) - outward
    b3 = inertia * yaw + behind * (outward - push * side)
    a11, a12, a13 = push + stiff + rolling + kxx, kxy, -base * kxy
    a22, a23 = push + across + kyy, -behind * push - base * kyy
    a33 = inertia + base * base * kyy
    # Symmetric and positive: eliminate u, then v_y.
    m22, m23, c2 = a22 - a12 * a12 / a11, a23 - a12 * a13 / a11, b2 - a12 * b1 / a11
    m33, c3 = a33 - a13 * a13 / a11, b3 - a13 * b1 / a11
    yaw = (c3 - m23 * c2 / m22) / (m33 - m23 * m23 / m22)
    side = (c2 - m23 * yaw) / m22
    speed = (b1 - a12 * side - a13 * yaw) / a11
    state.speed_mps, state.side_speed_mps, state.yaw_rate_radps = speed, side, yaw
    drum.side_force_n = -hold * (cos * (side - base * yaw) - sin * speed)
    _turn_drum(drive, state, drum, effects, rate, stiff * (free - speed))

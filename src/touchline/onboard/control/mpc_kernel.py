"""Quadratic programme of the MPC, condensed to actuator commands, in one kernel call."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.core.records import Record
from touchline.onboard.drives import onboard_drive
from touchline.onboard.interface import ACTUATORS, TICK_S
from touchline.onboard.tracking_state import COMMAND, HEADING_ERROR, LATERAL, SPEED, YAW_RATE
from touchline.onboard.trajectory.path_projection import A_SPEED, A_YAW_RATE

Floats = NDArray[np.float64]

_STATES = 4  # lateral error, heading error, speed, yaw rate
_SPEED_LIMIT_MPS = 0.3  # limits of the disturbances
_YAW_LIMIT_RADPS = 0.5
_DRIFT_LIMIT_MPS = 0.05
_CREEP_MPS = 0.02  # below which the path's curvature cannot be computed from its yaw rate
_CRAB_SPEED_MPS = 0.2  # below which a drift cannot be compensated by steering


@kernel
def _bound(value: float, limit: float) -> float:
    return min(max(value, -limit), limit)


class MpcParameters(NamedTuple):
    """Parameters of the controller: the robot and the weights.

    Attributes:
        lag_s: Lag of actuators and tyres.
        limit: Largest commands of the actuators, in their units.
        reach: Largest difference between a command and the actuator's present value.
        nozzle_x_m: Distance of the nozzle ahead of the drive's origin.
        lateral_weight: Cost of the nozzle's distance from the path [1/m²]; this and all others per second.
        heading_weight: Cost of the heading error [1/rad²].
        speed_weight: Cost of the speed error [s²/m²].
        move_weight: Cost of a change of each command in a second, over its unit squared.
        one_way: True for actuators that turn in the direction of the reference only.
        terminal_factor: Factor on the costs of the last step.
        disturbance_gain: Share per tick by which the speed and yaw rate disturbances are updated.
        drift_gain: Share per tick by which the lateral drift is updated.
        lead_ticks: Lead of the feed-forward.
        side_slip_rad_per_mps2: Side slip angle per lateral acceleration.
    """

    lag_s: float
    limit: tuple[float, ...]
    reach: tuple[float, ...]
    nozzle_x_m: float
    lateral_weight: float
    heading_weight: float
    speed_weight: float
    move_weight: tuple[float, ...]
    one_way: tuple[bool, ...]
    terminal_factor: float
    disturbance_gain: float
    drift_gain: float
    lead_ticks: int
    side_slip_rad_per_mps2: float


class MpcMemory(Record):
    """Memory of the controller from tick to tick."""

    push_mps: float
    """Disturbance of the speed that a command leads to."""
    twist_radps: float
    """Disturbance of the yaw rate."""
    drift_mps: float
    """Lateral drift beyond the nominal side slip."""
    valid: bool
    """True if there was a tick before this one, of which the next four are."""
    speed_mps: float
    yaw_rate_radps: float
    lateral_m: float
    heading_error_rad: float
    added: Annotated[Floats, ACTUATORS]
    """Additions to the feed-forward of the actuators in the last tick."""


class NominalStep(Record):
    """Motion in a step of the horizon under the feed-forward alone; at its end unless noted otherwise."""

    lateral_m: float
    heading_rad: float
    """Heading error against the path, as the lateral one is."""
    speed_mps: float
    """Difference to the reference speed."""
    drift_mps: float
    """Sideways drift."""
    travel_mps: float
    """Mean reference speed over the step, signed."""
    curvature_1pm: float
    """Mean over the step."""
    drive_mps: float
    """Mean feed-forward speed over the step."""
    turn_radps: float
    """Mean feed-forward yaw rate."""
    actuator: Annotated[Floats, ACTUATORS]
    """Values of the actuators at the step's start."""


class Controller(NamedTuple):
    """Data of a controller.

    Attributes:
        ticks: (N,) lengths of the horizon's steps in ticks.
        p: Parameters.
        memory: (1,) updated in every tick.
        nominal: (N,) scratch, the motion in each step.
        drive: Parameters of the drive.
    """

    ticks: NDArray[np.int64]
    p: MpcParameters
    memory: Sequence[MpcMemory]
    nominal: Sequence[NominalStep]
    drive: Any


@kernel
def _observe(now: Floats, controller: Controller) -> None:
    """Estimate the disturbances from the error of the last tick's prediction: this makes the MPC offset-free.

    See `mpc` for the sources.
    """
    p, memory, drive = controller.p, controller.memory[0], controller.drive
    v, w = now[SPEED], now[YAW_RATE]
    if memory.valid:
        stay = math.exp(-TICK_S / p.lag_s)
        v_c, w_c = onboard_drive.twist(drive, now[COMMAND:], now)
        v_then, w_then = memory.speed_mps, memory.yaw_rate_radps
        v_model = stay * v_then + (1.0 - stay) * (v_c + memory.push_mps)
        w_model = stay * w_then + (1.0 - stay) * (w_c + memory.twist_radps)
        gain = p.disturbance_gain / (1.0 - stay)
        memory.push_mps = _bound(memory.push_mps + gain * (v - v_model), _SPEED_LIMIT_MPS)
        memory.twist_radps = _bound(memory.twist_radps + gain * (w - w_model), _YAW_LIMIT_RADPS)
        expected = memory.lateral_m + TICK_S * (
            v * math.sin(memory.heading_error_rad) - p.side_slip_rad_per_mps2 * v * v * w
        )
        drift = (now[LATERAL] - expected) / TICK_S
        memory.drift_mps = _bound(memory.drift_mps + p.drift_gain * (drift - memory.drift_mps), _DRIFT_LIMIT_MPS)
    memory.speed_mps, memory.yaw_rate_radps = v, w
    memory.lateral_m, memory.heading_error_rad = now[LATERAL], now[HEADING_ERROR]
    memory.valid = True


@kernel
def _roll_out(now: Floats, ahead: Floats, controller: Controller) -> None:
    """Predict the free response, under the feed-forward alone, tick by tick so that no arc of the path is missed."""
    ticks, p, drive = controller.ticks, controller.p, controller.drive
    memory, lag, lead = controller.memory[0], p.lag_s, p.lead_ticks
    stay = math.exp(-TICK_S / lag)
    settle = lag * (1.0 - stay) / TICK_S  # share of the old value in the tick's mean
    push, twist = memory.push_mps, memory.twist_radps
    drift = memory.drift_mps
    lateral, heading, speed, yaw_rate = now[LATERAL], now[HEADING_ERROR], now[SPEED], now[YAW_RATE]
    tick = 0
    for j in range(ticks.shape[0]):
        step = controller.nominal[j]
        present = onboard_drive.actuators_of(drive, speed, yaw_rate, now)
        for actuator in range(len(step.actuator)):
            step.actuator[actuator] = present[actuator]
        travel, turned, led, turn = 0.0, 0.0, 0.0, 0.0
        for _ in range(ticks[j]):
            v_ref, w_ref = ahead[tick, A_SPEED], ahead[tick, A_YAW_RATE]
            v_c, w_c = ahead[tick + lead, A_SPEED], ahead[tick + lead, A_YAW_RATE]
            led, turn = led + v_c, turn + w_c
            v_c, w_c = v_c + push, w_c + twist
            v_mean = v_c + settle * (speed - v_c)
            w_mean = w_c + settle * (yaw_rate - w_c)
            drift = memory.drift_mps - p.side_slip_rad_per_mps2 * v_ref * v_ref * w_ref
            kappa = w_ref / v_ref if abs(v_ref) > _CREEP_MPS else 0.0
            change = (w_mean - w_ref - kappa * (v_mean - v_ref)) * TICK_S
            lateral += (v_ref * (heading + 0.5 * change) + drift) * TICK_S
            heading += change
            speed = v_c + stay * (speed - v_c)
            yaw_rate = w_c + stay * (yaw_rate - w_c)
            travel, turned = travel + v_ref, turned + w_ref
            tick += 1
        step.lateral_m, step.heading_rad = lateral, heading
        step.speed_mps = speed - 0.5 * (ahead[tick - 1, A_SPEED] + ahead[tick, A_SPEED])
        step.travel_mps = travel / ticks[j]
        step.curvature_1pm = turned / travel if abs(travel) > _CREEP_MPS * ticks[j] else 0.0
        step.drift_mps = drift
        step.drive_mps, step.turn_radps = led / ticks[j], turn / ticks[j]


class Programme(NamedTuple):
    """A quadratic programme of N steps with k actuators: minimise ½uᵀHu + fᵀu, lower ≤ (u; pull) ≤ upper.

    Attributes:
        hessian: H, (kN, kN).
        gradient: f, (kN,).
        lower: (2kN,) kN bounds on u, then kN on the pull.
        upper: (2kN,) likewise.
        forward: (k,) feed-forward of the coming tick.
    """

    hessian: Floats
    gradient: Floats
    lower: Floats
    upper: Floats
    forward: Floats


@kernel
def build(now: Floats, ahead: Floats, controller: Controller, programme: Programme) -> None:
    """Build the programme for this tick.

    u holds the additions to the feed-forward of all actuators in each of the N steps; pull is the difference between
    each one's command and its speed at the step's start (rows from `mpc`). The free response is that of the
    feed-forward, rolled out tick by tick; the forced one is linear along it: first-order actuators v̇ = (v_c − v)/lag
    and likewise ω, and the tangent dynamics ė_θ = ω − κ·v, ė_y = v̄·e_θ + drift, integrated exactly over each step. The
    states are eliminated, so that u is the only unknown (J. M. Maciejowski, Predictive Control with Constraints,
    Prentice Hall 2002, chapter 3).

    Args:
        now: (NOW,) of `tracking_state`.
        ahead: (enough rows for the horizon and the lead, AHEAD_COLUMNS) of `path_projection`.
        controller: Parameters and memory; the memory is updated.
        programme: Filled in.
    """
    hessian, gradient, lower, upper, forward = programme
    ticks, p, memory, nominal, drive = controller
    _observe(now, controller)
    _roll_out(now, ahead, controller)
    steps = ticks.shape[0]
    count = len(forward)
    size = count * steps
    lag = p.lag_s
    for i in range(size):
        gradient[i] = 0.0
        for k in range(size):
            hessian[i, k] = 0.0

    sens = np.zeros((_STATES, size))
    row = np.zeros(size)
    for j in range(steps):
        step = nominal[j]
        h, kappa, travel = ticks[j] * TICK_S, step.curvature_1pm, step.travel_mps
        stay = math.exp(-h / lag)
        once = lag * (1.0 - stay)  # ∫ of the decaying part
        once_in = h - once
        twice = lag * h - lag * once  # ∬ of the decaying part
        twice_in = 0.5 * h * h - twice
        cols = count * j
        for k in range(cols):
            turn = sens[3, k] - kappa * sens[2, k]
            sens[0, k] += travel * (h * sens[1, k] + twice * turn)
            sens[1, k] += once * turn
            sens[2, k] *= stay
            sens[3, k] *= stay
        for actuator in range(count):
            v_c, w_c = onboard_drive.gain(drive, actuator, now)
            turn_c = w_c - kappa * v_c
            sens[0, cols + actuator] = travel * twice_in * turn_c
            sens[1, cols + actuator] = once_in * turn_c
            sens[2, cols + actuator] = (1.0 - stay) * v_c
            sens[3, cols + actuator] = (1.0 - stay) * w_c
        cols += count

        weight = h * (p.terminal_factor if j == steps - 1 else 1.0)
        crab = step.heading_rad
        if abs(travel) > _CRAB_SPEED_MPS:
            crab += step.drift_mps / travel  # a heading error that compensates a drift is none
        for output in range(3):
            if output == 0:
                # The nozzle's place follows the heading, whatever the cause of the heading error.
                error = step.lateral_m + p.nozzle_x_m * step.heading_rad
                q = weight * p.lateral_weight
                for k in range(cols):
                    row[k] = sens[0, k] + p.nozzle_x_m * sens[1, k]
            elif output == 1:
                error, q = crab, weight * p.heading_weight
                for k in range(cols):
                    row[k] = sens[1, k]
            else:
                error, q = step.speed_mps, weight * p.speed_weight
                for k in range(cols):
                    row[k] = sens[2, k]
            for i in range(cols):
                scaled = q * row[i]
                gradient[i] += scaled * error
                for k in range(i, cols):
                    hessian[i, k] += scaled * row[k]

        bases = onboard_drive.actuators_of(drive, step.drive_mps, step.turn_radps, now)
        for actuator in range(count):
            i, base, pay = count * j + actuator, bases[actuator], p.move_weight[actuator] / h
            if j == 0:
                forward[actuator] = base
                gradient[i] -= pay * memory[0].added[actuator]
            else:
                hessian[i - count, i - count] += pay
                hessian[i - count, i] -= pay
            hessian[i, i] += pay
            limit, reach = p.limit[actuator], p.reach[actuator]
            lower[i], upper[i] = -limit - base, limit - base
            if p.one_way[actuator] and step.drive_mps > 0.0:
                lower[i] = -base
            elif p.one_way[actuator] and step.drive_mps < 0.0:
                upper[i] = -base
            pull = base - step.actuator[actuator]
            lower[size + i], upper[size + i] = -reach - pull, reach - pull
    for i in range(size):
        for k in range(i):
            hessian[i, k] = hessian[k, i]


@kernel
def answer(
    forward: Floats, added: Floats, limit: tuple[float, ...], drive: Any, now: Floats, actuators: Floats
) -> tuple[float, float]:
    """Compute the twist of the coming tick.

    Args:
        forward: (k,) feed-forward of the actuators.
        added: (at least k,) additions to it; the solver keeps to the limits but for its tolerance.
        limit: Largest commands of the actuators.
        drive: Parameters of the drive.
        now: (NOW,) of `tracking_state`.
        actuators: (k,) filled with the commands that lead to the twist.

    Returns:
        Speed [m/s] and yaw rate [rad/s].
    """
    for i in range(len(actuators)):
        actuators[i] = _bound(forward[i] + added[i], limit[i])
    speed_mps, yaw_rate_radps = onboard_drive.twist(drive, actuators, now)
    return speed_mps, yaw_rate_radps

"""The quadratic programme of the MPC, condensed to actuator commands, in one kernel call."""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.services.core.jit import kernel
from touchline.services.onboard.drives import onboard_drive
from touchline.services.onboard.interface import TICK_S
from touchline.services.onboard.tracking_state import COMMAND, HEADING_ERROR, LATERAL, SPEED, YAW_RATE
from touchline.services.onboard.trajectory.path_projection import A_SPEED, A_YAW_RATE

Floats = NDArray[np.float64]

# Parameters.
M_LAG: Final = 0  # of actuators and tyres
M_LIMIT: Final = 1  # largest commands of both actuators
M_REACH: Final = 3  # by which the commands of both may differ from what they do
M_NOZZLE_X: Final = 5
M_W_LATERAL: Final = 6
M_W_HEADING: Final = 7
M_W_SPEED: Final = 8
M_W_TERMINAL: Final = 9  # factor on the last step
M_DISTURBANCE_GAIN: Final = 10  # per tick, of the speed and yaw rate disturbances
M_DRIFT_GAIN: Final = 11  # per tick, of the lateral drift
M_LEAD: Final = 12  # ticks by which the feed-forward is ahead
M_SIDE_SLIP: Final = 13  # rad per m/s² across
M_W_MOVE: Final = 14  # of both actuators
PARAMETERS: Final = 16

# The nominal motion at the end of each step, one row a step.
N_LATERAL: Final = 0  # errors if nothing is added to the feed-forward
N_HEADING: Final = 1
N_SPEED: Final = 2
N_TRAVEL: Final = 3  # mean reference speed over the step, signed
N_CURVATURE: Final = 4  # mean over the step
N_DRIVE: Final = 5  # mean feed-forward speed over the step
N_TURN: Final = 6  # mean feed-forward yaw rate
N_ACTUATOR: Final = 7  # what both actuators do at the step's start
N_DRIFT: Final = 9  # lateral drift at the step's end [m/s]
NOMINAL: Final = 10

# Memory from tick to tick.
D_SPEED: Final = 0  # disturbance of the speed that a command leads to [m/s]
D_YAW_RATE: Final = 1  # of the yaw rate [rad/s]
D_DRIFT: Final = 2  # lateral drift beyond the nominal side slip [m/s]
D_LAST: Final = 3  # speed, yaw rate, lateral and heading error of the last tick
D_VALID: Final = 7
D_ADDED: Final = 8  # what was added to the feed-forward of both actuators in the last tick
MEMORY: Final = 10

_STATES = 4  # lateral error, heading error, speed, yaw rate
_SPEED_LIMIT_MPS = 0.3  # of the disturbances
_YAW_LIMIT_RADPS = 0.5
_DRIFT_LIMIT_MPS = 0.05
_CREEP_MPS = 0.02  # below which the path's curvature cannot be told from its yaw rate
_CRAB_SPEED_MPS = 0.2  # below which a drift cannot be steered against


@kernel
def _bound(value: float, limit: float) -> float:
    return min(max(value, -limit), limit)


class Controller(NamedTuple):
    """What a controller has from tick to tick.

    Attributes:
        ticks: (N,) lengths of the horizon's steps in ticks.
        p: (PARAMETERS,).
        memory: (MEMORY,) updated in every tick.
        drive: Figures of the drive.
    """

    ticks: NDArray[np.int64]
    p: Floats
    memory: Floats
    drive: Any


@kernel
def _observe(now: Floats, controller: Controller) -> None:
    """Estimate the disturbances from the error of the last tick's prediction: this makes the MPC offset-free.

    The sources are named in `mpc`.
    """
    p, memory, drive = controller.p, controller.memory, controller.drive
    v, w = now[SPEED], now[YAW_RATE]
    if memory[D_VALID] > 0.0:
        stay = math.exp(-TICK_S / p[M_LAG])
        v_c, w_c = onboard_drive.twist(drive, now[COMMAND:], now)
        v_then, w_then = memory[D_LAST], memory[D_LAST + 1]
        v_model = stay * v_then + (1.0 - stay) * (v_c + memory[D_SPEED])
        w_model = stay * w_then + (1.0 - stay) * (w_c + memory[D_YAW_RATE])
        gain = p[M_DISTURBANCE_GAIN] / (1.0 - stay)
        memory[D_SPEED] = _bound(memory[D_SPEED] + gain * (v - v_model), _SPEED_LIMIT_MPS)
        memory[D_YAW_RATE] = _bound(memory[D_YAW_RATE] + gain * (w - w_model), _YAW_LIMIT_RADPS)
        expected = memory[D_LAST + 2] + TICK_S * (v * math.sin(memory[D_LAST + 3]) - p[M_SIDE_SLIP] * v * v * w)
        drift = (now[LATERAL] - expected) / TICK_S
        memory[D_DRIFT] = _bound(memory[D_DRIFT] + p[M_DRIFT_GAIN] * (drift - memory[D_DRIFT]), _DRIFT_LIMIT_MPS)
    memory[D_LAST], memory[D_LAST + 1] = v, w
    memory[D_LAST + 2], memory[D_LAST + 3] = now[LATERAL], now[HEADING_ERROR]
    memory[D_VALID] = 1.0


@kernel
def _roll_out(now: Floats, ahead: Floats, controller: Controller, nominal: Floats) -> None:
    """Predict the free response, under the feed-forward alone, tick by tick so that no arc of the path is missed."""
    ticks, p, memory, drive = controller
    lag, lead = p[M_LAG], int(p[M_LEAD])
    stay = math.exp(-TICK_S / lag)
    settle = lag * (1.0 - stay) / TICK_S  # share of the old value in the tick's mean
    push, twist = memory[D_SPEED], memory[D_YAW_RATE]
    drift = memory[D_DRIFT]
    lateral, heading, speed, yaw_rate = now[LATERAL], now[HEADING_ERROR], now[SPEED], now[YAW_RATE]
    tick = 0
    for j in range(ticks.shape[0]):
        first, second = onboard_drive.actuators_of(drive, speed, yaw_rate, now)
        nominal[j, N_ACTUATOR], nominal[j, N_ACTUATOR + 1] = first, second
        travel, turned, led, turn = 0.0, 0.0, 0.0, 0.0
        for _ in range(ticks[j]):
            v_ref, w_ref = ahead[tick, A_SPEED], ahead[tick, A_YAW_RATE]
            v_c, w_c = ahead[tick + lead, A_SPEED], ahead[tick + lead, A_YAW_RATE]
            led, turn = led + v_c, turn + w_c
            v_c, w_c = v_c + push, w_c + twist
            v_mean = v_c + settle * (speed - v_c)
            w_mean = w_c + settle * (yaw_rate - w_c)
            drift = memory[D_DRIFT] - p[M_SIDE_SLIP] * v_ref * v_ref * w_ref
            kappa = w_ref / v_ref if abs(v_ref) > _CREEP_MPS else 0.0
            change = (w_mean - w_ref - kappa * (v_mean - v_ref)) * TICK_S
            lateral += (v_ref * (heading + 0.5 * change) + drift) * TICK_S
            heading += change
            speed = v_c + stay * (speed - v_c)
            yaw_rate = w_c + stay * (yaw_rate - w_c)
            travel, turned = travel + v_ref, turned + w_ref
            tick += 1
        nominal[j, N_LATERAL], nominal[j, N_HEADING] = lateral, heading
        nominal[j, N_SPEED] = speed - 0.5 * (ahead[tick - 1, A_SPEED] + ahead[tick, A_SPEED])
        nominal[j, N_TRAVEL] = travel / ticks[j]
        nominal[j, N_CURVATURE] = turned / travel if abs(travel) > _CREEP_MPS * ticks[j] else 0.0
        nominal[j, N_DRIFT] = drift
        nominal[j, N_DRIVE], nominal[j, N_TURN] = led / ticks[j], turn / ticks[j]


class Programme(NamedTuple):
    """A quadratic programme of N steps: minimise ½uᵀHu + fᵀu, lower ≤ (u; pull) ≤ upper.

    Attributes:
        hessian: H, (2N, 2N).
        gradient: f, (2N,).
        lower: (4N,) 2N bounds on u, then 2N on the pull.
        upper: (4N,) likewise.
        forward: (2,) feed-forward of the coming tick.
    """

    hessian: Floats
    gradient: Floats
    lower: Floats
    upper: Floats
    forward: Floats


@kernel
def build(now: Floats, ahead: Floats, controller: Controller, programme: Programme) -> None:
    """Write the programme for this tick.

    u holds the additions to the feed-forward of both actuators in each of the N steps; pull is by how much each one's
    command differs from its speed at the step's start (rows from `mpc`). The free response is that of the feed-forward,
    rolled out tick by tick; the forced one is linear along it: first-order actuators v̇ = (v_c − v)/lag and likewise ω,
    and the tangent dynamics ė_θ = ω − κ·v, ė_y = v̄·e_θ + drift, integrated exactly over each step. The states are
    eliminated, so that u is all that is left to find (J. M. Maciejowski, Predictive Control with Constraints, Prentice
    Hall 2002, chapter 3).

    Args:
        now: (NOW,) of `tracking_state`.
        ahead: (enough rows for the horizon and the lead, AHEAD_COLUMNS) of `path_projection`.
        controller: Its memory is updated.
        programme: Filled.
    """
    hessian, gradient, lower, upper, forward = programme
    ticks, p, memory, drive = controller
    _observe(now, controller)
    steps = ticks.shape[0]
    nominal = np.zeros((steps, NOMINAL))
    _roll_out(now, ahead, controller, nominal)
    size = 2 * steps
    lag = p[M_LAG]
    for i in range(size):
        gradient[i] = 0.0
        for k in range(size):
            hessian[i, k] = 0.0

    sens = np.zeros((_STATES, size))
    row = np.zeros(size)
    for j in range(steps):
        h, kappa, travel = ticks[j] * TICK_S, nominal[j, N_CURVATURE], nominal[j, N_TRAVEL]
        stay = math.exp(-h / lag)
        once = lag * (1.0 - stay)  # ∫ of the decaying part
        once_in = h - once
        twice = lag * h - lag * once  # ∬ of the decaying part
        twice_in = 0.5 * h * h - twice
        cols = 2 * j
        for k in range(cols):
            turn = sens[3, k] - kappa * sens[2, k]
            sens[0, k] += travel * (h * sens[1, k] + twice * turn)
            sens[1, k] += once * turn
            sens[2, k] *= stay
            sens[3, k] *= stay
        for actuator in range(2):
            v_c, w_c = onboard_drive.gain(drive, actuator, now)
            turn_c = w_c - kappa * v_c
            sens[0, cols + actuator] = travel * twice_in * turn_c
            sens[1, cols + actuator] = once_in * turn_c
            sens[2, cols + actuator] = (1.0 - stay) * v_c
            sens[3, cols + actuator] = (1.0 - stay) * w_c
        cols += 2

        weight = h * (p[M_W_TERMINAL] if j == steps - 1 else 1.0)
        crab = nominal[j, N_HEADING]
        if abs(travel) > _CRAB_SPEED_MPS:
            crab += nominal[j, N_DRIFT] / travel  # the heading error that a drift makes necessary is none
        for output in range(3):
            if output == 0:
                # The nozzle is where the heading has it, whatever the heading is good for.
                error = nominal[j, N_LATERAL] + p[M_NOZZLE_X] * nominal[j, N_HEADING]
                q = weight * p[M_W_LATERAL]
                for k in range(cols):
                    row[k] = sens[0, k] + p[M_NOZZLE_X] * sens[1, k]
            elif output == 1:
                error, q = crab, weight * p[M_W_HEADING]
                for k in range(cols):
                    row[k] = sens[1, k]
            else:
                error, q = nominal[j, N_SPEED], weight * p[M_W_SPEED]
                for k in range(cols):
                    row[k] = sens[2, k]
            for i in range(cols):
                scaled = q * row[i]
                gradient[i] += scaled * error
                for k in range(i, cols):
                    hessian[i, k] += scaled * row[k]

        bases = onboard_drive.actuators_of(drive, nominal[j, N_DRIVE], nominal[j, N_TURN], now)
        for actuator in range(2):
            i, base, pay = 2 * j + actuator, bases[actuator], p[M_W_MOVE + actuator] / h
            if j == 0:
                forward[actuator] = base
                gradient[i] -= pay * memory[D_ADDED + actuator]
            else:
                hessian[i - 2, i - 2] += pay
                hessian[i - 2, i] -= pay
            hessian[i, i] += pay
            limit, reach = p[M_LIMIT + actuator], p[M_REACH + actuator]
            lower[i], upper[i] = -limit - base, limit - base
            pull = base - nominal[j, N_ACTUATOR + actuator]
            lower[size + i], upper[size + i] = -reach - pull, reach - pull
    for i in range(size):
        for k in range(i):
            hessian[i, k] = hessian[k, i]


@kernel
def answer(forward: Floats, added: Floats, drive: Any, now: Floats) -> tuple[float, float, float, float]:
    """The twist of the coming tick [m/s, rad/s], and the commands of both actuators that lead to it.

    Args:
        forward: (2,) feed-forward of the actuators.
        added: (at least 2,) what is added to it.
        drive: Figures of the drive.
        now: (NOW,) of `tracking_state`.
    """
    actuators = np.empty(2)
    actuators[0], actuators[1] = forward[0] + added[0], forward[1] + added[1]
    speed_mps, yaw_rate_radps = onboard_drive.twist(drive, actuators, now)
    return speed_mps, yaw_rate_radps, actuators[0], actuators[1]

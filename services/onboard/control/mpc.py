"""Model predictive control of the nozzle point, solved by DAQP every tick.

Each tick the programme of `mpc_kernel` is built for the way ahead and solved from the last active set. What the motors
did and the model did not expect is estimated as constant disturbances, so that a lasting slip or drift leaves no
lasting offset. If the solver cannot finish within its iteration cap, or the robot is so far off that the tangent model
says nothing, pure pursuit takes the tick and is counted.
"""

from __future__ import annotations

import math

import daqp
import numpy as np
from numpy.typing import NDArray

from touchline.schemas.vehicles import Vehicle
from touchline.services.onboard.control import mpc_kernel as k
from touchline.services.onboard.control.pure_pursuit import PurePursuitFollower
from touchline.services.onboard.control.wheel_limits import lead_ticks
from touchline.services.onboard.interface import TICK_S
from touchline.services.onboard.trajectory.path_projection import HEADING_ERROR, LATERAL

HORIZON_TICKS = (1, 2, 3, 4, 5, 5, 6, 8, 10, 12, 14, 16)
"""Steps of the horizon, 0.86 s in all: fine where the next command acts, coarse where only the course matters."""
LATERAL_SCALE_M = 0.004
HEADING_SCALE_RAD = 0.03
SPEED_SCALE_MPS = 0.03
MOVE_SCALE_RADPS = 8.0
"""Errors that cost the same: what the weights of the programme are made from. A move is one of this size in a
second."""
TERMINAL_FACTOR = 4.0
ITERATION_CAP = 60
DISTURBANCE_TIME_S = 0.3
TYRE_LAG_S = 0.012
"""By which the body follows the wheels' turning at 1 m/s on grass: tyres push only as far as they slip, and the slip
is a share of the speed. ρ²·v / (0.8·g·C·r²) for a radius of gyration ρ, 0.8 of the load on the wheels, tyres of
stiffness C and half the track r: 12 ms on dry grass, 20 ms on wet."""
DRIFT_TIME_S = 2.0
MAX_LATERAL_M = 0.5
MAX_HEADING_RAD = 0.7
_MIN_LAG_S = 0.005
_SOLVED = 1


class MpcFollower:
    """See the module."""

    name = "mpc"
    can_fail = False
    problem = ""

    def __init__(self, vehicle: Vehicle) -> None:
        """A follower at rest; the solver's workspace is allocated at the first step."""
        size = 2 * len(HORIZON_TICKS)
        self._p = _parameters(vehicle)
        self._ticks = np.array(HORIZON_TICKS)
        self._memory = np.zeros(k.MEMORY)
        self._hessian = np.eye(size)
        self._gradient = np.zeros(size)
        self._lower = np.full(2 * size, -1.0)
        self._upper = np.full(2 * size, 1.0)
        self._forward = np.zeros(2)
        self._pull = _pull_rows(max(vehicle.drive.motor_time_constant_s, _MIN_LAG_S))
        self._solver: daqp.Model | None = None
        self._pursuit = PurePursuitFollower(vehicle)
        self.ahead_rows = self.fine_rows = sum(HORIZON_TICKS) + max(1, int(self._p[k.M_LEAD]))
        self.fallbacks = 0
        """Ticks that pure pursuit had to take."""

    def reset(self) -> None:
        """Forget the disturbances and the active set."""
        self._memory[:] = 0.0
        self._solver = None
        self._pursuit.reset()

    def step(self, now: NDArray[np.float64], ahead: NDArray[np.float64]) -> tuple[float, float]:
        """As `Follower.step`."""
        k.build(
            now,
            ahead,
            self._ticks,
            self._p,
            self._memory,
            self._hessian,
            self._gradient,
            self._lower,
            self._upper,
            self._forward,
        )
        if abs(now[LATERAL]) < MAX_LATERAL_M and abs(now[HEADING_ERROR]) < MAX_HEADING_RAD:
            solution = self._solve()
            if solution is not None:
                return solution
        self._memory[k.D_ADDED : k.D_ADDED + 2] = 0.0
        self.fallbacks += 1
        return self._pursuit.step(now, ahead[: self._pursuit.fine_rows])

    def _solve(self) -> tuple[float, float] | None:
        solver = self._solver
        if solver is None:
            solver = self._solver = daqp.Model()
            solver.setup(self._hessian, self._gradient, self._pull, self._upper, self._lower)
            solver.settings = {"iter_limit": ITERATION_CAP}
        else:
            solver.update(H=self._hessian, f=self._gradient, bupper=self._upper, blower=self._lower)
        u, _, flag, _ = solver.solve()
        if flag != _SOLVED:
            self._solver = None
            return None
        self._memory[k.D_ADDED : k.D_ADDED + 2] = u[:2]
        left, right = self._forward.tolist()
        return left + float(u[0]), right + float(u[1])


def _parameters(vehicle: Vehicle) -> NDArray[np.float64]:
    p = np.zeros(k.PARAMETERS)
    p[k.M_HALF_TRACK] = vehicle.drive.half_track_m
    motor_lag_s = max(vehicle.drive.motor_time_constant_s, _MIN_LAG_S)
    p[k.M_LAG] = motor_lag_s + TYRE_LAG_S
    p[k.M_MAX_RATE] = vehicle.drive.max_wheel_speed_radps
    # A first-order motor accelerates by (command − speed) / lag.
    p[k.M_REACH] = vehicle.drive.max_wheel_acceleration_radps2 * motor_lag_s
    p[k.M_NOZZLE_X] = vehicle.tool.nozzle_x_m
    p[k.M_W_LATERAL] = LATERAL_SCALE_M**-2
    p[k.M_W_HEADING] = HEADING_SCALE_RAD**-2
    p[k.M_W_SPEED] = SPEED_SCALE_MPS**-2
    p[k.M_W_MOVE] = MOVE_SCALE_RADPS**-2
    p[k.M_W_TERMINAL] = TERMINAL_FACTOR
    p[k.M_DISTURBANCE_GAIN] = TICK_S / DISTURBANCE_TIME_S
    p[k.M_DRIFT_GAIN] = TICK_S / DRIFT_TIME_S
    p[k.M_LEAD] = lead_ticks(vehicle)
    p[k.M_SIDE_SLIP] = vehicle.drive.side_slip_rad_per_mps2
    return p


def _pull_rows(lag_s: float) -> NDArray[np.float64]:
    """(2N, 2N) rows that turn what is added to the commands into what it adds to command less wheel speed.

    A wheel's acceleration is proportional to that difference, and the speed at a step's start is the lagged sum of
    the commands before.
    """
    size = 2 * len(HORIZON_TICKS)
    rows = np.zeros((size, size))
    wheel_speed = np.zeros((2, size))
    for j, ticks in enumerate(HORIZON_TICKS):
        stay = math.exp(-ticks * TICK_S / lag_s)
        for wheel in range(2):
            i = 2 * j + wheel
            rows[i] = -wheel_speed[wheel]
            rows[i, i] += 1.0
            wheel_speed[wheel] *= stay
            wheel_speed[wheel, i] += 1.0 - stay
    return rows

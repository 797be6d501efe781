"""Model predictive control of the nozzle point, solved by DAQP every tick.

Each tick the programme of `mpc_kernel` is built for the path ahead and solved from the last active set. The model's
error is estimated as constant disturbances, so that a lasting slip or drift leaves no lasting offset. If the solver
cannot finish within its iteration cap, or the robot is too far off for the tangent model, pure pursuit takes the tick
and is counted.

Disturbances for offset-free control: G. Pannocchia and J. B. Rawlings, Disturbance models for offset-free
model-predictive control, AIChE Journal 49(2), 2003. The solver: D. Arnström, A. Bemporad and D. Axehill, A dual
active-set solver for embedded quadratic programming using recursive LDLᵀ updates, IEEE Transactions on Automatic
Control 67(8), 2022.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import daqp
import numpy as np
from numpy.typing import NDArray

from touchline.onboard.control import mpc_kernel as k
from touchline.onboard.control.follower import BodyTwist
from touchline.onboard.control.lead import lead_ticks
from touchline.onboard.control.pure_pursuit import PurePursuitFollower
from touchline.onboard.drives.onboard_drive import OnboardDrive, drive_of
from touchline.onboard.interface import TICK_S
from touchline.onboard.tracking_state import HEADING_ERROR, LATERAL
from touchline.schemas.vehicles import Vehicle

LATERAL_SCALE_M = 0.004
HEADING_SCALE_RAD = 0.03
SPEED_SCALE_MPS = 0.03
"""Errors that cost the same as each other and as a change by `OnboardDrive.move_scale` in a second: the basis of the
weights of the programme."""
TERMINAL_FACTOR = 4.0
ITERATION_CAP = 60
DISTURBANCE_TIME_S = 0.3
TYRE_LAG_S = 0.012
"""Lag of the body behind the wheels' turning at 1 m/s on grass: tyres push only by slipping, and the slip is a share of
the speed. ρ²·v / (0.8·g·C·r²) for a radius of gyration ρ, 0.8 of the load on the wheels, tyres of stiffness C and half
the track r: 12 ms on dry grass, 20 ms on wet."""
DRIFT_TIME_S = 2.0
MAX_LATERAL_M = 0.5
MAX_HEADING_RAD = 0.7
_MIN_LAG_S = 0.005
_SOLVED = 1


class MpcFollower:
    """Follower by model predictive control, with pure pursuit as the fallback."""

    name = "mpc"
    can_fail = False
    timed = False
    problem = ""

    def __init__(self, vehicle: Vehicle) -> None:
        """Make a follower at rest; the solver's workspace is allocated at the first step."""
        drive = drive_of(vehicle)
        count = len(drive.limit)
        size = count * len(drive.horizon_ticks)
        p = _parameters(vehicle, drive)
        self._memory = k.MpcMemory.sized(count)()
        nominal = k.NominalStep.sized(count).row(len(drive.horizon_ticks))
        self._controller = k.Controller(np.array(drive.horizon_ticks), p, self._memory.array, nominal, drive.figures)
        self._programme = k.Programme(
            np.eye(size), np.zeros(size), np.full(2 * size, -1.0), np.full(2 * size, 1.0), np.zeros(count)
        )
        self._actuators = np.zeros(count)
        self._pull = _pull_rows(count, drive.horizon_ticks, max(drive.lag_s, _MIN_LAG_S))
        self._solver: daqp.Model | None = None
        self._build: Callable[..., None] | None = None  # for the types of its arguments, which do not change
        self._answer: Callable[..., tuple[float, float]] | None = None
        self._pursuit = PurePursuitFollower(vehicle)
        self.ahead_rows = self.fine_rows = sum(drive.horizon_ticks) + max(1, p.lead_ticks)
        self.fallbacks = 0
        """Ticks in which pure pursuit stood in."""

    def reset(self) -> None:
        """Forget the disturbances and the active set."""
        self._memory.reset()
        self._solver = None
        self._pursuit.reset()

    def step(self, now: NDArray[np.float64], ahead: NDArray[np.float64]) -> BodyTwist:
        """See `Follower.step`."""
        arguments = (now, ahead, self._controller, self._programme)
        if self._build is None:
            self._build = k.build.for_types_of(arguments)
        self._build(*arguments)
        if abs(now[LATERAL]) < MAX_LATERAL_M and abs(now[HEADING_ERROR]) < MAX_HEADING_RAD:
            solution = self._solve(now)
            if solution is not None:
                return solution
        self._memory.added[:] = 0.0
        self.fallbacks += 1
        return self._pursuit.step(now, ahead[: self._pursuit.fine_rows])

    def _solve(self, now: NDArray[np.float64]) -> BodyTwist | None:
        solver, programme = self._solver, self._programme
        if solver is None:
            solver = self._solver = daqp.Model()
            solver.setup(programme.hessian, programme.gradient, self._pull, programme.upper, programme.lower)
            solver.settings = {"iter_limit": ITERATION_CAP}
        else:
            solver.update(H=programme.hessian, f=programme.gradient, bupper=programme.upper, blower=programme.lower)
        u, _, flag, _ = solver.solve()
        if flag != _SOLVED:
            self._solver = None
            return None
        self._memory.added[:] = u[: len(self._actuators)]
        arguments = (programme.forward, u, self._controller.p.limit, self._controller.drive, now, self._actuators)
        if self._answer is None:
            self._answer = k.answer.for_types_of(arguments)
        speed_mps, yaw_rate_radps = self._answer(*arguments)
        return BodyTwist(speed_mps, yaw_rate_radps, tuple(self._actuators.tolist()))


def _parameters(vehicle: Vehicle, drive: OnboardDrive) -> k.MpcParameters:
    return k.MpcParameters(
        lag_s=max(drive.lag_s, _MIN_LAG_S) + TYRE_LAG_S,
        limit=tuple(drive.limit.tolist()),
        reach=tuple(drive.reach.tolist()),
        nozzle_x_m=vehicle.tool.point_m[0],
        lateral_weight=LATERAL_SCALE_M**-2,
        heading_weight=HEADING_SCALE_RAD**-2,
        speed_weight=SPEED_SCALE_MPS**-2,
        move_weight=tuple((np.broadcast_to(drive.move_scale, drive.limit.shape) ** -2).tolist()),
        one_way=tuple(np.broadcast_to(drive.one_way, drive.limit.shape).tolist()),
        terminal_factor=TERMINAL_FACTOR,
        disturbance_gain=TICK_S / DISTURBANCE_TIME_S,
        drift_gain=TICK_S / DRIFT_TIME_S,
        lead_ticks=lead_ticks(drive.lag_s),
        side_slip_rad_per_mps2=drive.side_slip_rad_per_mps2,
    )


def _pull_rows(count: int, horizon_ticks: Sequence[int], lag_s: float) -> NDArray[np.float64]:
    """Compute the (kN, kN) linear map from additions to the commands of k actuators to those to each pull.

    An actuator's acceleration is proportional to its pull (see `mpc_kernel.build`), command less speed, and the speed
    at a step's start is the lagged sum of the commands before.
    """
    size = count * len(horizon_ticks)
    rows = np.zeros((size, size))
    state = np.zeros((count, size))
    for j, ticks in enumerate(horizon_ticks):
        stay = math.exp(-ticks * TICK_S / lag_s)
        for actuator in range(count):
            i = count * j + actuator
            rows[i] = -state[actuator]
            rows[i, i] += 1.0
            state[actuator] *= stay
            state[actuator, i] += 1.0 - stay
    return rows

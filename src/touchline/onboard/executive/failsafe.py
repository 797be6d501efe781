"""The failsafe: what stops the robot whatever its pose (bumper, operator, fence, wheels, paint, battery).

Three answers, in this order: an emergency latches until a reset; a stop lasts until somebody says `resume`, and resume
is refused as long as the cause can still be seen; the rest is the localization monitor's.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.onboard import filter_model as m
from touchline.onboard.computer_state import FLOW_WINDOW_TICKS, Computer, ComputerState, SafetyFindings
from touchline.onboard.drives.onboard_drive import drive_of
from touchline.onboard.executive.geofence import Geofence, beyond_m
from touchline.onboard.interface import TICK_S, Pause
from touchline.schemas import supplies
from touchline.schemas.messages import PauseStatus
from touchline.schemas.vehicles import Vehicle

Floats = NDArray[np.float64]

OPERATOR_TIMEOUT_S: Final = 2.0
HEADING_DOUBT: Final = 2.0
"""σ of the heading: until driving has made it known, the body may be turned by so much, and is not beyond the fence."""
LOW_BATTERY: Final = supplies.LOW_BATTERY
LOW_TANK_L: Final = supplies.LOW_TANK_L
DRY_TANK_L: Final = 0.0005
ACTUATOR_TIMEOUT_S: Final = 0.4
LEAK_SHARE: Final = 0.4
"""Of the nominal flow, over the window, while the valve is closed: the valve is stuck open."""
DRY_SHARE: Final = 0.8
"""Of the nominal flow, over the window, while it is open: nothing comes out, or so little that the line is narrow."""
REFILL_L: Final = 0.02
"""No flow changes the level so much in a tick: somebody filled or changed the tank, or the sensor did."""


# What may stop the robot.
NOTHING: Final = 0
BUMPER: Final = 1
FENCE: Final = 2
OPERATOR: Final = 3
EMPTY_TANK: Final = 4
LOW_TANK: Final = 5
BATTERY: Final = 6
DRY: Final = 20
LEAK: Final = 21
ACTUATOR: Final = 22  # the first one; one more for each after it

_HAZARDS: Final = {
    EMPTY_TANK: "tank-empty",
    LOW_TANK: "tank-low",
    BATTERY: "battery-low",
    DRY: "too-little-paint",
    LEAK: "valve-leaks",
}
"""Names of what only stops the robot; that of an actuator is `actuator`."""


class FenceArrays(NamedTuple):
    """A geofence, as `geofence.beyond_m` takes it; without corners there is none."""

    outline: Floats
    body: Floats


@kernel
def judge_safety(tick: int, computer: Computer, fence: FenceArrays) -> None:
    """Judge a tick, during which the last command was in force.

    Args:
        tick: That the estimator has seen.
        computer: (1,) the findings `safety` are updated.
        fence: Round the loaded plan.
    """
    c = computer[0]
    found, robot, valve = c.safety, c.frame, c.command.valve
    found.bumper, found.battery_fraction = robot.bumper, robot.battery_fraction
    found.emergency = BUMPER if robot.bumper else _outside(c, fence)
    operator = _operator(robot.operator_alive, found)
    disobeyed = _disobeyed(c) if robot.encoder_tick == tick else NOTHING
    sprays = found.nominal_l > 0.0  # else there is neither tank nor valve
    flow = _paint(robot.tank_l, valve, found) if sprays else NOTHING
    if operator != NOTHING:
        found.lasting = operator
    elif sprays and robot.tank_l < LOW_TANK_L:
        found.lasting = EMPTY_TANK if robot.tank_l <= DRY_TANK_L else LOW_TANK
    elif robot.battery_fraction < LOW_BATTERY:
        found.lasting = BATTERY
    else:
        found.lasting = NOTHING if valve else flow
    found.stop = found.lasting
    if found.stop == NOTHING:
        found.stop = disobeyed if disobeyed != NOTHING else flow


@kernel
def _outside(c: ComputerState, fence: FenceArrays) -> int:
    outline, body = fence
    found, slot = c.safety, c.times.tick % m.RING
    if len(outline) == 0 or c.times.first_tick < 0:
        return NOTHING
    x = c.filter.states[slot]
    doubt_m = HEADING_DOUBT * math.sqrt(c.filter.covariances[slot, m.HEADING, m.HEADING]) * found.body_radius_m
    beyond = beyond_m(outline, body, found.body_radius_m, x[m.EAST], x[m.NORTH], x[m.HEADING])
    found.outside_s = 0.0 if beyond <= found.fence_margin_m + doubt_m else found.outside_s + TICK_S
    return FENCE if found.outside_s >= found.fence_timeout_s else NOTHING


@kernel
def _operator(alive: bool, found: SafetyFindings) -> int:
    found.unheard_s = 0.0 if alive else found.unheard_s + TICK_S
    return OPERATOR if found.unheard_s > OPERATOR_TIMEOUT_S else NOTHING


@kernel
def _disobeyed(c: ComputerState) -> int:
    found, problem = c.safety, NOTHING
    for i in range(len(found.expected)):
        expected = found.expected[i]
        change = found.lag_share[i] * (c.command.actuators[i] - expected)
        expected += min(max(change, -found.max_step[i]), found.max_step[i])
        found.expected[i] = expected
        tolerance = max(found.tolerance[i], found.tolerance_share[i] * abs(expected))
        follows = abs(c.buffer.measured[i] - expected) <= tolerance
        found.astray_s[i] = 0.0 if follows else found.astray_s[i] + TICK_S
        if found.astray_s[i] >= ACTUATOR_TIMEOUT_S:
            problem = ACTUATOR + i
    return problem


@kernel
def _paint(tank_l: float, valve: bool, found: SafetyFindings) -> int:
    found.dry_s = 0.0
    used_l = found.tank_l - tank_l
    found.tank_l = tank_l
    if tank_l <= DRY_TANK_L:
        _restart_flow(found)
        found.dry_s = TICK_S
        return NOTHING
    if valve != found.valve or not abs(used_l) < REFILL_L:
        _restart_flow(found)
    found.valve = valve
    found.valve_ticks += 1
    if found.valve_ticks > found.settle_ticks:
        _add_flow(used_l, found)
    if found.flow_count < FLOW_WINDOW_TICKS:
        return NOTHING
    share = found.flow_sum_l / (FLOW_WINDOW_TICKS * found.nominal_l)
    if valve and share < DRY_SHARE:
        found.dry_s = _dry_ticks(found) * TICK_S
        return DRY
    return LEAK if not valve and share > LEAK_SHARE else NOTHING


@kernel
def _add_flow(used_l: float, found: SafetyFindings) -> None:
    """Enter what has left the tank in a tick, in place of the oldest entry if the ring is full."""
    if found.flow_count == FLOW_WINDOW_TICKS:
        found.flow_sum_l -= found.flow_l[found.flow_first]
        found.flow_l[found.flow_first] = used_l
        found.flow_first = (found.flow_first + 1) % FLOW_WINDOW_TICKS
    else:
        found.flow_l[(found.flow_first + found.flow_count) % FLOW_WINDOW_TICKS] = used_l
        found.flow_count += 1
    found.flow_sum_l += used_l


@kernel
def _dry_ticks(found: SafetyFindings) -> int:
    """For how many ticks the flow has been what it is now: the step from nominal that fits the window best."""
    best, fewest, total, squares, before = math.inf, 0, 0.0, 0.0, 0.0
    for i in range(found.flow_count):
        before += (found.flow_l[(found.flow_first + i) % FLOW_WINDOW_TICKS] - found.nominal_l) ** 2
    for ticks in range(1, found.flow_count + 1):
        used = found.flow_l[(found.flow_first + found.flow_count - ticks) % FLOW_WINDOW_TICKS]
        total += used
        squares += used * used
        before -= (used - found.nominal_l) ** 2
        misfit = before + squares - total * total / ticks
        if misfit < best:
            best, fewest = misfit, ticks
    begins_with_it = fewest == found.flow_count and found.valve_ticks <= found.settle_ticks + FLOW_WINDOW_TICKS
    return int(found.valve_ticks) if begins_with_it else fewest


@kernel
def _restart_flow(found: SafetyFindings) -> None:
    found.flow_first = found.flow_count = found.valve_ticks = 0
    found.flow_sum_l = 0.0


@kernel
def restart_flow(computer: Computer) -> None:
    """Begin the observation of the flow of paint anew."""
    _restart_flow(computer[0].safety)


class Failsafe:
    """See the module.

    Attributes:
        findings: Of the last tick.
    """

    def __init__(self, vehicle: Vehicle, computer: ComputerState, fence_timeout_s: float) -> None:
        """Nothing seen yet."""
        self._computer, self.findings = computer, computer.safety
        self._drive = drive = drive_of(vehicle)
        self.findings.reset(
            fence_timeout_s=fence_timeout_s,
            lag_share=drive.lag_share,
            max_step=drive.max_step,
            tolerance=drive.tolerance,
            tolerance_share=drive.tolerance_share,
            nominal_l=vehicle.tool.flow_lps * TICK_S,
            settle_ticks=math.ceil(max(vehicle.tool.opens_s, vehicle.tool.closes_s) / TICK_S) + 2,
        )
        self._fence: Geofence | None = None
        self.fence_arrays = FenceArrays(np.zeros((0, 2)), np.zeros((0, 2)))
        """As kernels take it."""

    @property
    def fence(self) -> Geofence | None:
        """Round the loaded plan."""
        return self._fence

    @fence.setter
    def fence(self, fence: Geofence) -> None:
        self._fence = fence
        self.fence_arrays = FenceArrays(np.ascontiguousarray(fence.outline), np.ascontiguousarray(fence.body))
        self.findings.fence_margin_m, self.findings.body_radius_m = fence.margin_m, fence.radius_m

    def take_fence_away(self) -> None:
        """There is no plan any more."""
        self._fence, self.fence_arrays = None, FenceArrays(np.zeros((0, 2)), np.zeros((0, 2)))

    def forget(self) -> None:
        """Start all observations over time anew, as the operator wants to go on."""
        self.findings.astray_s[:] = 0.0
        self.findings.outside_s = 0.0
        restart_flow(self._computer.array)

    def look(self, tick: int) -> None:
        """Judge a tick."""
        judge_safety(tick, self._computer.array, self.fence_arrays)

    @property
    def emergency(self) -> str:
        """Why to stop as hard as possible and latch, "" if nothing is wrong."""
        return self._words(self.findings.emergency)

    @property
    def stop(self) -> str:
        """Why to stop until told to resume, "" if nothing is wrong."""
        return self._words(self.findings.stop)

    @property
    def pause(self) -> Pause:
        """Who or what orders the stop."""
        code = self.findings.stop
        if code == OPERATOR:
            return Pause(PauseStatus.LINK, "operator not heard")
        return Pause(PauseStatus.HAZARD, _HAZARDS.get(code, "actuator"))

    @property
    def lasting(self) -> str:
        """The part of `stop` that can be seen at standstill, too, and speaks against going on."""
        return self._words(self.findings.lasting)

    def _words(self, code: int) -> str:
        """What a finding means to people; "" if all is well."""
        if code == NOTHING:
            return ""
        if code == FENCE and self._fence is not None:
            return f"the robot has left {self._fence.name} by more than {self._fence.margin_m:g} m"
        if code >= ACTUATOR:
            return self._drive.disobeyed[code - ACTUATOR]
        return {
            BUMPER: "the bumper is pressed",
            OPERATOR: f"the operator has not been heard for {OPERATOR_TIMEOUT_S:.0f} s",
            EMPTY_TANK: "the tank is empty",
            LOW_TANK: "the tank is all but empty",
            BATTERY: f"the battery is low ({100.0 * self.findings.battery_fraction:.0f} %)",
            DRY: "the valve is open, but too little paint comes out",
            LEAK: "paint comes out although the valve is closed",
        }[code]

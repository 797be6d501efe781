"""Failsafe: stops the robot whatever its pose (bumper, operator, fence, wheels, paint, battery).

In every tick it updates the observations that take several ticks, and then takes the first hazard present of each
answer, in the order of the table `HAZARDS` (`hazards.py`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.onboard import filter_model as m
from touchline.onboard.computer_state import FLOW_WINDOW_TICKS, Computer, ComputerState, SafetyFindings
from touchline.onboard.drives.onboard_drive import drive_of
from touchline.onboard.estimation.claimed_covariance import claimed_heading_sigma
from touchline.onboard.executive.geofence import FenceArrays, Geofence, beyond_m
from touchline.onboard.executive.hazards import (
    DRY_TANK_L,
    HAZARD_CHAINS,
    HAZARDS,
    NOTHING,
    Hazard,
    HazardChains,
    HazardContext,
    SafetyMoment,
    by_code,
    chains_of,
    first_found,
    too_little_flows,
)
from touchline.onboard.interface import TICK_S, Pause
from touchline.schemas.vehicles import Vehicle

Floats = NDArray[np.float64]

HEADING_DOUBT: Final = 2.0
"""Factor on the σ of the heading: until driving has made the heading known, the body may be turned by so much without
counting as beyond the fence."""
REFILL_L: Final = 0.02
"""Largest change of the level in a tick that counts as flow: above it, somebody filled or changed the tank, or the
sensor failed."""


@kernel
def evaluate_safety(tick: int, computer: Computer, fence: FenceArrays) -> None:
    """Evaluate a tick, during which the last command was in force, by the hazards of the table.

    Args:
        tick: Tick that the estimator has seen.
        computer: (1,) the findings `safety` are updated.
        fence: Fence round the loaded plan.
    """
    evaluate_hazards(tick, computer, fence, HAZARD_CHAINS)


@kernel
def evaluate_hazards(tick: int, computer: Computer, fence: FenceArrays, hazards: HazardChains) -> None:
    """Evaluate a tick as `evaluate_safety`, by other hazards.

    Args:
        tick: Tick that the estimator has seen.
        computer: (1,) the findings `safety` are updated.
        fence: Fence round the loaded plan.
        hazards: Hazards in their order of priority.
    """
    c = computer[0]
    _observe(tick, c, fence)
    found, moment = c.safety, SafetyMoment(tick, fence)
    found.emergency = first_found(hazards.emergency, moment, c)
    found.lasting = first_found(hazards.lasting, moment, c)
    found.stop = found.lasting
    if found.stop == NOTHING:
        found.stop = first_found(hazards.passing, moment, c)


@kernel
def _observe(tick: int, c: ComputerState, fence: FenceArrays) -> None:
    """Update the observations that take more than this tick."""
    found, robot = c.safety, c.frame
    found.bumper, found.battery_fraction = robot.bumper, robot.battery_fraction
    if not robot.bumper:
        _observe_fence(c, fence)
    found.unheard_s = 0.0 if robot.operator_alive else found.unheard_s + TICK_S
    if robot.encoder_tick == tick:
        _observe_actuators(c)
    if found.nominal_l > 0.0:  # else there is neither tank nor valve
        _observe_paint(robot.tank_l, c.command.valve, found)


@kernel
def _observe_fence(c: ComputerState, fence: FenceArrays) -> None:
    outline, body = fence
    found, slot = c.safety, c.times.tick % m.RING
    if len(outline) == 0 or c.times.first_tick < 0:
        return
    x = c.filter.states[slot]
    doubt_m = HEADING_DOUBT * claimed_heading_sigma(c) * found.body_radius_m
    beyond = beyond_m(outline, body, found.body_radius_m, x[m.EAST], x[m.NORTH], x[m.HEADING])
    found.outside_s = 0.0 if beyond <= found.fence_margin_m + doubt_m else found.outside_s + TICK_S


@kernel
def _observe_actuators(c: ComputerState) -> None:
    found = c.safety
    for i in range(len(found.expected)):
        expected = found.expected[i]
        change = found.lag_share[i] * (c.command.actuators[i] - expected)
        expected += min(max(change, -found.max_step[i]), found.max_step[i])
        found.expected[i] = expected
        tolerance = max(found.tolerance[i], found.tolerance_share[i] * abs(expected))
        follows = abs(c.buffer.measured[i] - expected) <= tolerance
        found.astray_s[i] = 0.0 if follows else found.astray_s[i] + TICK_S


@kernel
def _observe_paint(tank_l: float, valve: bool, found: SafetyFindings) -> None:
    found.dry_s = 0.0
    used_l = found.tank_l - tank_l
    found.tank_l = tank_l
    if tank_l <= DRY_TANK_L:
        _restart_flow(found)
        found.dry_s = TICK_S
        return
    if valve != found.valve or not abs(used_l) < REFILL_L:
        _restart_flow(found)
    found.valve = valve
    found.valve_ticks += 1
    if found.valve_ticks > found.settle_ticks:
        _add_flow(used_l, found)
    if valve and too_little_flows(found):
        found.dry_s = _dry_ticks(found) * TICK_S


@kernel
def _add_flow(used_l: float, found: SafetyFindings) -> None:
    """Add the paint that has left the tank in a tick, in place of the oldest entry if the ring is full."""
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
    """Return the ticks since the flow took its present value: the step from nominal that fits the window best."""
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
    """Restart the observation of the flow of paint."""
    _restart_flow(computer[0].safety)


class Failsafe:
    """Monitor of all hazards but the pose.

    Args:
        vehicle: The monitored robot.
        computer: State with its estimate, command and frame.
        fence_timeout_s: Time for which the body may be beyond the fence.
        hazards: Hazards to look for; kernels that run many ticks look for those of `HAZARDS`.

    Attributes:
        findings: Findings of the last tick.
        seen: Data for the texts about hazards.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        computer: ComputerState,
        fence_timeout_s: float,
        hazards: Sequence[Hazard] = HAZARDS,
    ) -> None:
        """Begin without findings."""
        self._computer, self.findings = computer, computer.safety
        self._others = None if hazards is HAZARDS else chains_of(hazards)
        self._rows = by_code(hazards)
        drive = drive_of(vehicle)
        self.seen = HazardContext(computer.safety, drive.disobeyed)
        self.findings.reset(
            fence_timeout_s=fence_timeout_s,
            lag_share=drive.lag_share,
            max_step=drive.max_step,
            tolerance=drive.tolerance,
            tolerance_share=drive.tolerance_share,
            nominal_l=vehicle.tool.flow_lps * TICK_S,
            settle_ticks=math.ceil(max(vehicle.tool.opens_s, vehicle.tool.closes_s) / TICK_S) + 2,
        )
        self.fence_arrays = FenceArrays(np.zeros((0, 2)), np.zeros((0, 2)))
        """Fence for kernels."""

    @property
    def fence(self) -> Geofence | None:
        """Fence round the loaded plan."""
        return self.seen.fence

    @fence.setter
    def fence(self, fence: Geofence) -> None:
        self.seen.fence = fence
        self.fence_arrays = FenceArrays(np.ascontiguousarray(fence.outline), np.ascontiguousarray(fence.body))
        self.findings.fence_margin_m, self.findings.body_radius_m = fence.margin_m, fence.radius_m

    def take_fence_away(self) -> None:
        """Remove the fence, because there is no plan any more."""
        self.seen.fence, self.fence_arrays = None, FenceArrays(np.zeros((0, 2)), np.zeros((0, 2)))

    def forget(self) -> None:
        """Restart all observations over time, because the operator wants to continue."""
        self.findings.astray_s[:] = 0.0
        self.findings.outside_s = 0.0
        restart_flow(self._computer.array)

    def look(self, tick: int) -> None:
        """Evaluate a tick."""
        if self._others is None:
            evaluate_safety(tick, self._computer.array, self.fence_arrays)
        else:
            evaluate_hazards(tick, self._computer.array, self.fence_arrays, self._others)

    @property
    def emergency(self) -> str:
        """Reason for an emergency stop, which latches; "" if there is none."""
        return self._words(self.findings.emergency)

    @property
    def stop(self) -> str:
        """Reason for a stop until `resume`; "" if there is none."""
        return self._words(self.findings.stop)

    @property
    def pause(self) -> Pause:
        """Cause and source of the stop."""
        hazard = self._rows[self.findings.stop]
        return Pause(hazard.by, hazard.name)

    @property
    def lasting(self) -> str:
        """The part of `stop` that can be seen at standstill, too, and prevents resuming."""
        return self._words(self.findings.lasting)

    def _words(self, code: int) -> str:
        """Return the text about a finding; "" if all is well."""
        if code == NOTHING:
            return ""
        hazard = self._rows[code]
        return hazard.words(self.seen, code - hazard.code)

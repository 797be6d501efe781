"""The failsafe: what stops the robot whatever its pose (bumper, operator, fence, wheels, paint, battery).

Three answers, in this order: an emergency latches until a reset; a stop lasts until somebody says `resume`, and resume
is refused as long as the cause can still be seen; the rest is `safety.Watch`'s.
"""

from __future__ import annotations

import math
from collections import deque
from typing import Final

from touchline.schemas import supplies
from touchline.schemas.vehicles import Vehicle
from touchline.services.onboard.estimation.filter import Estimator
from touchline.services.onboard.executive.geofence import Geofence
from touchline.services.onboard.interface import TICK_S, Command, SensorFrame

OPERATOR_TIMEOUT_S: Final = 2.0
HEADING_DOUBT: Final = 2.0
"""σ of the heading: until driving has made it known, the body may be turned by so much, and is not beyond the fence."""
LOW_BATTERY: Final = supplies.LOW_BATTERY
LOW_TANK_L: Final = supplies.LOW_TANK_L
DRY_TANK_L: Final = 0.0005
WHEEL_TIMEOUT_S: Final = 0.4
WHEEL_TOLERANCE_RADPS: Final = 0.7
WHEEL_TOLERANCE: Final = 0.4
"""Share of the expected speed."""
FLOW_WINDOW_TICKS: Final = 50
LEAK_SHARE: Final = 0.4
"""Of the nominal flow, over the window, while the valve is closed: the valve is stuck open."""
DRY_SHARE: Final = 0.8
"""Of the nominal flow, over the window, while it is open: nothing comes out, or so little that the line is narrow."""
REFILL_L: Final = 0.02
"""No flow changes the level so much in a tick: somebody filled or changed the tank, or the sensor did."""


class Failsafe:
    """See the module.

    Attributes:
        emergency: Why to stop as hard as possible and latch, "" if nothing is wrong.
        stop: Why to stop until told to resume, "" if nothing is wrong.
        lasting: The part of it that can be seen at standstill, too, and speaks against going on.
        bumper: Whether the bumper is pressed.
        fence: Round the loaded plan.
        dry_s: For how long no paint, or too little, has come out of the open valve, when that is why to stop.
    """

    def __init__(self, vehicle: Vehicle, estimator: Estimator, fence_timeout_s: float) -> None:
        """Nothing seen yet."""
        self._estimator = estimator
        self._fence_timeout_s = fence_timeout_s
        self._lag = 1.0 - math.exp(-TICK_S / max(vehicle.drive.motor_time_constant_s, TICK_S))
        self._max_step = vehicle.drive.max_wheel_acceleration_radps2 * TICK_S
        self._nominal_l = vehicle.tool.paint_l_per_m * vehicle.tool.paint_speed_mps * TICK_S
        self._settle_ticks = math.ceil(max(vehicle.tool.valve_on_delay_s, vehicle.tool.valve_off_delay_s) / TICK_S) + 2
        self.emergency = self.stop = self.lasting = ""
        self.bumper = False
        self.dry_s = 0.0
        self.fence: Geofence | None = None
        self._outside_s = 0.0
        self._unheard_s = 0.0
        self._expected = [0.0, 0.0]
        self._wheel_s = [0.0, 0.0]
        self._tank_l = math.nan
        self._flow: deque[float] = deque(maxlen=FLOW_WINDOW_TICKS)
        self._flow_sum_l = 0.0
        self._valve = False
        self._valve_ticks = 0

    def forget(self) -> None:
        """The operator wants to go on: what was observed over time starts anew."""
        self._wheel_s = [0.0, 0.0]
        self._outside_s = 0.0
        self._restart_flow()

    def look(self, frame: SensorFrame, command: Command) -> None:
        """Judge a tick; `command` was in force during it."""
        self.emergency = "the bumper is pressed" if frame.bumper else self._outside()
        self.bumper = frame.bumper
        operator, battery = self._operator(frame.operator_alive), _low_battery(frame.battery_fraction)
        wheels, flow = self._wheels(frame, command), self._paint(frame.tank_l, command.valve)
        tank = _low_tank(frame.tank_l)
        self.lasting = operator or tank or battery or ("" if command.valve else flow)
        self.stop = self.lasting or wheels or flow

    def _outside(self) -> str:
        if self.fence is None or not self._estimator.started:
            return ""
        doubt_m = HEADING_DOUBT * self._estimator.heading_sigma_rad * self.fence.radius_m
        inside = self.fence.beyond_m(*self._estimator.state[:3].tolist()) <= self.fence.margin_m + doubt_m
        self._outside_s = 0.0 if inside else self._outside_s + TICK_S
        if self._outside_s < self._fence_timeout_s:
            return ""
        return f"the robot has left {self.fence.name} by more than {self.fence.margin_m:g} m"

    def _operator(self, alive: bool) -> str:
        self._unheard_s = 0.0 if alive else self._unheard_s + TICK_S
        if self._unheard_s <= OPERATOR_TIMEOUT_S:
            return ""
        return f"the operator has not been heard for {OPERATOR_TIMEOUT_S:.0f} s"

    def _wheels(self, frame: SensorFrame, command: Command) -> str:
        if frame.encoder_age_ticks > 0:
            return ""
        problem = ""
        for i, (wanted, rate) in enumerate(zip(command[:2], self._estimator.intake.encoder_rates, strict=True)):
            change = self._lag * (wanted - self._expected[i])
            self._expected[i] += min(max(change, -self._max_step), self._max_step)
            tolerance = max(WHEEL_TOLERANCE_RADPS, WHEEL_TOLERANCE * abs(self._expected[i]))
            follows = abs(rate - self._expected[i]) <= tolerance
            self._wheel_s[i] = 0.0 if follows else self._wheel_s[i] + TICK_S
            if self._wheel_s[i] >= WHEEL_TIMEOUT_S:
                problem = f"the {('left', 'right')[i]} wheel does not turn as commanded"
        return problem

    def _paint(self, tank_l: float, valve: bool) -> str:
        self.dry_s = 0.0
        used_l, self._tank_l = self._tank_l - tank_l, tank_l
        if tank_l <= DRY_TANK_L:
            self._restart_flow()
            self.dry_s = TICK_S
            return ""
        if valve != self._valve or not abs(used_l) < REFILL_L:
            self._restart_flow()
        self._valve = valve
        self._valve_ticks += 1
        if self._valve_ticks > self._settle_ticks:
            if len(self._flow) == FLOW_WINDOW_TICKS:
                self._flow_sum_l -= self._flow[0]
            self._flow.append(used_l)
            self._flow_sum_l += used_l
        if len(self._flow) == FLOW_WINDOW_TICKS:
            share = self._flow_sum_l / (FLOW_WINDOW_TICKS * self._nominal_l)
            if valve and share < DRY_SHARE:
                self.dry_s = self._dry_ticks() * TICK_S
                return "the valve is open, but too little paint comes out"
            if not valve and share > LEAK_SHARE:
                return "paint comes out although the valve is closed"
        return ""

    def _dry_ticks(self) -> int:
        """For how many ticks the flow has been what it is now: the step from nominal that fits the window best."""
        best, fewest, total, squares = math.inf, 0, 0.0, 0.0
        before = sum((used - self._nominal_l) ** 2 for used in self._flow)
        for ticks, used in enumerate(reversed(self._flow), start=1):
            total, squares = total + used, squares + used * used
            before -= (used - self._nominal_l) ** 2
            misfit = before + squares - total * total / ticks
            if misfit < best:
                best, fewest = misfit, ticks
        begins_with_it = fewest == len(self._flow) and self._valve_ticks <= self._settle_ticks + FLOW_WINDOW_TICKS
        return self._valve_ticks if begins_with_it else fewest

    def _restart_flow(self) -> None:
        self._flow.clear()
        self._flow_sum_l = 0.0
        self._valve_ticks = 0


def _low_battery(fraction: float) -> str:
    return f"the battery is low ({100.0 * fraction:.0f} %)" if fraction < LOW_BATTERY else ""


def _low_tank(tank_l: float) -> str:
    if tank_l <= DRY_TANK_L:
        return "the tank is empty"
    return "the tank is all but empty" if tank_l < LOW_TANK_L else ""

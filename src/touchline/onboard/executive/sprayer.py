"""Valve control: open where the plan sprays, once only, and only while painting is allowed.

The valve is switched within the tick in which the robot passes the place, not at the tick's ends: at 1 m/s a tick is a
centimetre.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.arrays import count_up_to
from touchline.core.jit import kernel
from touchline.onboard.computer_state import Computer, ComputerState, SprayState
from touchline.onboard.executive.painted import Painted
from touchline.onboard.interface import TICK_S, PaintBelief
from touchline.onboard.trajectory.trajectory import LoadedTrajectory
from touchline.schemas.messages import Actuation
from touchline.schemas.vehicles import Vehicle

MISSED_TOLERANCE_M = 0.01
"""Largest distance beyond the place where paint stopped from which the robot may continue without going back; a
remainder of a line that is shorter than this is not owed."""
JOINT_OVERLAP_M = 0.005
"""Distance by which paint begins before it stopped: a joint may be painted twice by 2 cm, but open by 1 cm only, and
the estimate's error scatters it either way."""

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

_VALVE: Final = int(Actuation.VALVE)


class Switches(NamedTuple):
    """Planned actuation along the path.

    Attributes:
        switch_m: (n,) arc lengths at which it changes, ascending.
        masks: (n,) bit masks of `Actuation` from each of them on; nothing before the first.
    """

    switch_m: Floats
    masks: Integers


@kernel
def wanted_at(plan: Switches, place_m: float, speed_mps: float) -> int:
    """Return the planned actuation at the start or at the end of a tick.

    Args:
        plan: Planned actuation.
        place_m: Arc length of the nozzle at the start of the tick.
        speed_mps: Speed along the path; negative counts as 0.

    Returns:
        Bit mask of `Actuation`.
    """
    switch_m, masks = plan
    wanted: int = _wanted(switch_m, masks, place_m, speed_mps)
    return wanted


@kernel
def _wanted(switch_m: Floats, masks: Integers, place_m: float, speed_mps: float) -> int:
    mask: int = _mask(switch_m, masks, place_m) | _mask(switch_m, masks, place_m + TICK_S * max(speed_mps, 0.0))
    return mask


@kernel
def _mask(switch_m: Floats, masks: Integers, place_m: float) -> int:
    """Return the planned actuation at a place."""
    index = count_up_to(switch_m, place_m) - 1
    return masks[index] if index >= 0 else 0


@kernel
def lies_behind(computer: Computer, place_m: float) -> bool:
    """Return True if the nozzle has passed the place from which paint is owed by more than MISSED_TOLERANCE_M.

    Args:
        computer: (1,) whose `spray` is read.
        place_m: Arc length of the nozzle.
    """
    behind: bool = _behind(computer[0].spray, place_m)
    return behind


@kernel
def _behind(spray: SprayState, place_m: float) -> bool:
    return not math.isnan(spray.owed_from_m) and place_m > spray.owed_from_m + MISSED_TOLERANCE_M


@kernel
def due(plan: Switches, computer: Computer, place_m: float, speed_mps: float) -> bool:
    """Return True if the valve should be open at any time of the coming tick: owed paint first, then the plan's.

    Args:
        plan: Planned actuation.
        computer: (1,) whose `spray` is read.
        place_m: Arc length of the nozzle at the start of the tick.
        speed_mps: Speed along the path; negative counts as 0.
    """
    switch_m, masks = plan
    is_due: bool = _due(switch_m, masks, computer[0].spray, place_m, speed_mps)
    return is_due


@kernel
def _due(switch_m: Floats, masks: Integers, spray: SprayState, place_m: float, speed_mps: float) -> bool:
    if math.isnan(spray.owed_from_m):
        return bool(_wanted(switch_m, masks, place_m, speed_mps) & _VALVE != 0)
    opens_m = spray.owed_from_m - max(speed_mps, 0.0) * spray.on_delay_s
    return place_m + TICK_S * max(speed_mps, 0.0) >= opens_m and not _behind(spray, place_m)


@kernel
def switch(plan: Switches, computer: Computer, place_m: float, speed_mps: float) -> float:
    """Decide on the valve for the coming tick, driving forward on the plan with permission to paint.

    Args:
        plan: Planned actuation.
        computer: (1,) its `spray` is updated.
        place_m: Arc length of the nozzle.
        speed_mps: Speed along the path.

    Returns:
        Time in the tick at which the valve switches to its new state [s].
    """
    switch_m, masks = plan
    spray, speed_mps = computer[0].spray, max(speed_mps, 0.0)
    valve, at_m = _next(switch_m, masks, spray, place_m, speed_mps)
    spray.last_m = place_m
    if valve == spray.valve:
        return 0.0
    spray.valve = valve
    if valve:
        spray.owed_from_m = math.nan
        spray.falls_from_m = at_m + speed_mps * spray.on_delay_s
        spray.falls_to_m = math.inf
    else:
        spray.falls_to_m = at_m + speed_mps * spray.off_delay_s
        spray.closed = True
    return min((at_m - place_m) / speed_mps, TICK_S) if at_m > place_m else 0.0


@kernel
def _next(switch_m: Floats, masks: Integers, spray: SprayState, place_m: float, speed_mps: float) -> tuple[bool, float]:
    """Return the valve's state at the end of the coming tick, and the place of the nozzle when it has to change."""
    open_soon = _due(switch_m, masks, spray, place_m, speed_mps)
    if not math.isnan(spray.owed_from_m):
        return open_soon, max(spray.owed_from_m - speed_mps * spray.on_delay_s, place_m)
    if not open_soon:
        return False, place_m
    now = _mask(switch_m, masks, place_m) & _VALVE != 0
    if now == spray.valve and (_mask(switch_m, masks, place_m + TICK_S * speed_mps) & _VALVE != 0) != now:
        return not now, switch_m[count_up_to(switch_m, place_m)]
    return True, place_m


class Sprayer:
    """Valve along one trajectory, and the arc length from which paint is owed.

    Attributes:
        state: State of the valve, and of paint that falls or is owed.
        switches: Planned actuation.
        painted: Estimated paint.
    """

    def __init__(self, plan: LoadedTrajectory, vehicle: Vehicle, computer: ComputerState) -> None:
        """Begin with nothing painted and nothing owed.

        Args:
            plan: The trajectory.
            vehicle: Vehicle with the delays of the valve.
            computer: State of the computer; its `spray` is reset.
        """
        self._plan = plan
        self.switches = Switches(np.array(plan.switch_m), np.array(plan.actuation, dtype=np.int64))
        self._computer, self.state = computer, computer.spray
        self.state.reset(on_delay_s=vehicle.tool.opens_s, off_delay_s=vehicle.tool.closes_s)
        self.painted = Painted(plan, vehicle)

    @property
    def valve(self) -> bool:
        """True if the valve is commanded open, at the end of the coming tick at the latest."""
        return self.state.valve

    @property
    def owed_from_m(self) -> float | None:
        """Place where paint is to begin again although the robot has passed it; None if no paint is owed."""
        owed_m = self.state.owed_from_m
        return None if math.isnan(owed_m) else owed_m

    def disc_at(self, arc_length_m: float, speed_mps: float) -> bool:
        """Return True if the plan wants the disc down in the tick that begins here.

        Args:
            arc_length_m: Arc length of the nozzle.
            speed_mps: Speed along the path.
        """
        return bool(wanted_at(self.switches, arc_length_m, speed_mps) & Actuation.DISC)

    def due(self, arc_length_m: float, speed_mps: float) -> bool:
        """See the kernel `due`."""
        return bool(due(self.switches, self._computer.array, arc_length_m, speed_mps))

    def step(self, arc_length_m: float, speed_mps: float, allowed: bool) -> tuple[bool, float]:
        """Decide on the valve for the coming tick, driving forward on the plan.

        Args:
            arc_length_m: Arc length of the nozzle.
            speed_mps: Speed along the path.
            allowed: True if the robot may paint.

        Returns:
            State of the valve by the end of the tick, and the time in the tick at which it takes that state [s].
        """
        if not allowed and self.due(arc_length_m, speed_mps):
            self.close(arc_length_m, speed_mps)
            self.skip(arc_length_m + TICK_S * max(speed_mps, 0.0), speed_mps)
            return False, 0.0
        after_s = switch(self.switches, self._computer.array, arc_length_m, speed_mps)
        self.count_closed()
        return self.state.valve, after_s

    def close(self, arc_length_m: float, speed_mps: float) -> None:
        """Close the valve here; if it was open and the line continues, paint is owed from where the last drop falls.

        Args:
            arc_length_m: Arc length of the nozzle.
            speed_mps: Speed along the path.
        """
        state = self.state
        if not state.valve:
            return
        state.valve, state.closed = False, True
        state.falls_to_m = arc_length_m + max(speed_mps, 0.0) * state.off_delay_s
        self.count_closed()
        if self._goes_on(arc_length_m):
            opened = arc_length_m >= state.falls_from_m
            state.owed_from_m = state.falls_to_m - JOINT_OVERLAP_M if opened else state.falls_from_m

    def dry(self, arc_length_m: float, speed_mps: float, dry_s: float) -> None:
        """Close the valve here; if it was open and dry, paint is owed from the last good drop on.

        Args:
            arc_length_m: Arc length of the nozzle.
            speed_mps: Speed along the path.
            dry_s: Time for which too little paint has come out.
        """
        state = self.state
        if state.valve and dry_s > 0.0:
            fell_m = arc_length_m - self._plan.distance_m(arc_length_m, dry_s)
            self.painted.add(state.falls_from_m, fell_m)
            state.owed_from_m = max(fell_m - JOINT_OVERLAP_M, state.falls_from_m)
            state.valve, state.falls_to_m = False, fell_m
        self.close(arc_length_m, speed_mps)

    def owe_moved(self, ahead_m: float) -> None:
        """Owe paint from further back if the estimated position has been moved back.

        The robot cannot tell whether it was wrong when the valve closed, or only since: paint falls twice rather than
        not at all, so that a move ahead changes nothing.

        Args:
            ahead_m: Distance by which the position has been moved ahead; negative: back.
        """
        state = self.state
        if not math.isnan(state.owed_from_m):
            from_m = min(state.falls_from_m, state.owed_from_m)
            state.owed_from_m = max(state.owed_from_m + min(ahead_m, 0.0), from_m)

    def skip(self, arc_length_m: float, speed_mps: float) -> None:
        """Arrive here with the valve closed; paint planned between the last place and here becomes owed.

        Args:
            arc_length_m: Arc length of the nozzle.
            speed_mps: Speed along the path.
        """
        self.close(arc_length_m, speed_mps)
        state = self.state
        if self.owed_from_m is None:
            owed = self._plan.first_spray_between(state.last_m, arc_length_m)
            if owed is not None and owed > state.last_m:  # place of the command; paint falls once the valve is open
                owed += state.on_delay_s * self._plan.speed_at(owed)
            elif owed is not None and not self._goes_on(owed):
                owed = None
            state.owed_from_m = math.nan if owed is None else owed
        state.last_m = arc_length_m

    def pass_by(self, arc_length_m: float) -> None:
        """Arrive here on a leg that paints nothing, or at the end of one that does: nothing is owed any more."""
        state = self.state
        if state.valve:
            self.painted.add(state.falls_from_m, arc_length_m)
        state.valve, state.owed_from_m, state.last_m = False, math.nan, arc_length_m

    def resume_at(self, arc_length_m: float, owed_from_m: float | None) -> None:
        """Continue from the checkpoint of another process.

        Args:
            arc_length_m: Arc length of the robot.
            owed_from_m: Place from which paint is owed; None if none is.
        """
        self.state.last_m = arc_length_m
        self.state.owed_from_m = math.nan if owed_from_m is None else owed_from_m
        self.painted.restore(arc_length_m if owed_from_m is None else owed_from_m)

    def count_closed(self) -> None:
        """Count the paint that has fallen, the last drop included, if the valve has been closed."""
        if self.state.closed:
            self.painted.add(self.state.falls_from_m, self.state.falls_to_m)
            self.state.closed = False

    def belief(self, arc_length_m: float) -> PaintBelief:
        """Return the paint when the nozzle is at an arc length."""
        return self.painted.belief(self.state.falls_from_m, arc_length_m) if self.valve else self.painted.belief()

    def owed_if_it_ended(self, arc_length_m: float) -> float | None:
        """Return the place from which paint would be owed if computer and flow stopped now; None if none would be."""
        state, owed_m = self.state, self.owed_from_m
        if state.valve and not self._goes_on(arc_length_m):
            return None
        falling = state.valve or (owed_m is not None and arc_length_m < state.falls_to_m)
        return max(arc_length_m - JOINT_OVERLAP_M, state.falls_from_m) if falling else owed_m

    def closed(self) -> None:
        """Note that the valve has had its time to close: nothing falls from it any more."""
        self.state.falls_to_m = -math.inf

    def must_go_back(self, arc_length_m: float) -> bool:
        """Return True if the place from which paint is owed lies behind."""
        return bool(lies_behind(self._computer.array, arc_length_m))

    def _goes_on(self, arc_length_m: float) -> bool:
        return bool(self._plan.actuation_at(arc_length_m + MISSED_TOLERANCE_M) & Actuation.VALVE)

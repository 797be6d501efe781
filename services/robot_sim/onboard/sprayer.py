"""When the valve is open: where the plan says so, never twice, and only with leave."""

from __future__ import annotations

from schemas.messages import Actuation
from schemas.vehicle import Vehicle
from services.robot_sim.frames import TICK_S
from services.robot_sim.onboard.trajectory import LoadedTrajectory

MISSED_TOLERANCE_M = 0.01
"""How far beyond the place where paint stopped the robot may be and still go on from there; what is left of a line
that is shorter than this is not owed."""


class Sprayer:
    """Keeps the arc length from which paint is owed.

    Attributes:
        valve: Whether the valve is commanded open.
        owed_from_m: Where paint stopped, or could not start, although the plan asks for it; None if nothing is owed.
    """

    def __init__(self, plan: LoadedTrajectory, vehicle: Vehicle) -> None:
        """Nothing painted, nothing owed."""
        self._plan = plan
        self._on_delay_s = vehicle.valve_on_delay_s
        self._off_delay_s = vehicle.valve_off_delay_s
        self._last_m = 0.0
        self._same, self._same_from_m, self._same_to_m = Actuation.NONE, 0.0, 0.0
        self.valve = False
        self.owed_from_m: float | None = None

    def wanted_at(self, arc_length_m: float, speed_mps: float) -> int:
        """The plan's actuation for the tick that begins here: all that it asks for at its start or its end.

        A line is then never too short for the tick that it fell into, at most a tick's way too long.
        """
        ahead_m = arc_length_m + TICK_S * max(speed_mps, 0.0)
        if self._same_from_m <= arc_length_m and ahead_m < self._same_to_m:
            return self._same
        at = self._plan.actuation_at(arc_length_m)
        self._same_from_m, self._same_to_m, self._same = (*self._plan.actuated_alike(arc_length_m), at)
        return at | self._plan.actuation_at(ahead_m)

    def due(self, arc_length_m: float, speed_mps: float) -> bool:
        """Whether the valve should be open in the coming tick: owed paint first, then the plan's."""
        if self.owed_from_m is None:
            return bool(self.wanted_at(arc_length_m, speed_mps) & Actuation.VALVE)
        opens_m = arc_length_m + max(speed_mps, 0.0) * (self._on_delay_s + TICK_S)
        return opens_m >= self.owed_from_m and not self.must_go_back(arc_length_m)

    def step(self, arc_length_m: float, speed_mps: float, allowed: bool) -> bool:
        """The valve for the coming tick, while driving forward along the plan."""
        due = self.due(arc_length_m, speed_mps)
        if due and not allowed:
            self.close(arc_length_m, speed_mps)
            self.skip(arc_length_m + TICK_S * max(speed_mps, 0.0), speed_mps)
            return False
        if due:
            self.owed_from_m = None
        self.valve = due
        self._last_m = arc_length_m
        return self.valve

    def close(self, arc_length_m: float, speed_mps: float) -> None:
        """Close the valve here; if it was open and the line goes on, paint is owed from where the last drop falls."""
        if self.valve and self._goes_on(arc_length_m):
            self.owed_from_m = arc_length_m + max(speed_mps, 0.0) * self._off_delay_s
        self.valve = False

    def dry(self, arc_length_m: float, speed_mps: float, dry_s: float) -> None:
        """Close the valve here; if it was open and dry for `dry_s`, paint is owed from where the last drop fell."""
        if self.valve and dry_s > 0.0:
            self.owed_from_m = arc_length_m - max(speed_mps, 0.0) * dry_s
            self.valve = False
        self.close(arc_length_m, speed_mps)

    def skip(self, arc_length_m: float, speed_mps: float) -> None:
        """Be here with the valve closed, whatever the plan says: what it sprays since the last place is owed."""
        self.close(arc_length_m, speed_mps)
        if self.owed_from_m is None:
            owed = self._plan.first_spray_between(self._last_m, arc_length_m)
            if owed is not None and owed > self._last_m:  # where the command is due; paint falls when the valve is open
                owed += self._on_delay_s * self._plan.speed_at(owed)
            elif owed is not None and not self._goes_on(owed):
                owed = None
            self.owed_from_m = owed
        self._last_m = arc_length_m

    def pass_by(self, arc_length_m: float) -> None:
        """Be here on a leg that paints nothing, or at the end of one that does: all that was owed is painted."""
        self.valve = False
        self.owed_from_m = None
        self._last_m = arc_length_m

    def resume_at(self, arc_length_m: float, owed_from_m: float | None) -> None:
        """Go on where another process left off."""
        self._last_m, self.owed_from_m = arc_length_m, owed_from_m

    def owed_if_it_ended(self, arc_length_m: float) -> float | None:
        """From where paint would be owed if this were the last tick: nothing flows without the computer."""
        if self.valve and self._goes_on(arc_length_m):
            return arc_length_m
        return self.owed_from_m

    def must_go_back(self, arc_length_m: float) -> bool:
        """Whether the place from which paint is owed lies behind."""
        return self.owed_from_m is not None and arc_length_m > self.owed_from_m + MISSED_TOLERANCE_M

    def _goes_on(self, arc_length_m: float) -> bool:
        return bool(self._plan.actuation_at(arc_length_m + MISSED_TOLERANCE_M) & Actuation.VALVE)

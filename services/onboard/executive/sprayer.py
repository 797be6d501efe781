"""When the valve is open: where the plan says so, never twice, and only with leave.

The valve is switched within the tick in which the robot passes the place, not at the tick's ends: at 1 m/s a tick is a
centimetre.
"""

from __future__ import annotations

import math

from touchline.schemas.messages import Actuation
from touchline.schemas.vehicles import Vehicle
from touchline.services.onboard.executive.painted import Painted
from touchline.services.onboard.interface import TICK_S, PaintBelief
from touchline.services.onboard.trajectory.trajectory import LoadedTrajectory

MISSED_TOLERANCE_M = 0.01
"""How far beyond the place where paint stopped the robot may be and still go on from there; what is left of a line
that is shorter than this is not owed."""
JOINT_OVERLAP_M = 0.005
"""Paint begins again so far before it stopped: a joint may be painted twice by 2 cm, but open by 1 cm only, and the
estimate's error scatters it either way."""


class Sprayer:
    """Keeps the arc length from which paint is owed.

    Attributes:
        valve: Whether the valve is commanded open, at the end of the coming tick at the latest.
        painted: What has been painted, as far as the robot knows.
        owed_from_m: Where paint is to begin again, although the robot has passed; None if nothing is owed.
        falls_from_m, falls_to_m: Where the paint of the open or last opened valve falls: from → to, as far as known.
    """

    def __init__(self, plan: LoadedTrajectory, vehicle: Vehicle) -> None:
        """Nothing painted, nothing owed."""
        self._plan = plan
        self._on_delay_s = vehicle.tool.valve_on_delay_s
        self._off_delay_s = vehicle.tool.valve_off_delay_s
        self._last_m = 0.0
        self._same, self._same_from_m, self._same_to_m = Actuation.NONE, 0.0, 0.0
        self.valve = False
        self.painted = Painted(plan, vehicle)
        self.owed_from_m: float | None = None
        self.falls_from_m, self.falls_to_m = math.inf, -math.inf

    def wanted_at(self, arc_length_m: float, speed_mps: float) -> int:
        """All that the plan asks for at the start or the end of the tick that begins here."""
        ahead_m = arc_length_m + TICK_S * max(speed_mps, 0.0)
        if self._same_from_m <= arc_length_m and ahead_m < self._same_to_m:
            return self._same
        at = self._plan.actuation_at(arc_length_m)
        self._same_from_m, self._same_to_m, self._same = (*self._plan.actuated_alike(arc_length_m), at)
        return at | self._plan.actuation_at(ahead_m)

    def due(self, arc_length_m: float, speed_mps: float) -> bool:
        """Whether the valve should be open at any time of the coming tick: owed paint first, then the plan's."""
        if self.owed_from_m is None:
            return bool(self.wanted_at(arc_length_m, speed_mps) & Actuation.VALVE)
        opens_m = self.owed_from_m - max(speed_mps, 0.0) * self._on_delay_s
        return arc_length_m + TICK_S * max(speed_mps, 0.0) >= opens_m and not self.must_go_back(arc_length_m)

    def step(self, arc_length_m: float, speed_mps: float, allowed: bool) -> tuple[bool, float]:
        """The valve by the end of the coming tick, and when in it that is to be so [s]; driving forward on the plan."""
        speed_mps = max(speed_mps, 0.0)
        due = self.due(arc_length_m, speed_mps)
        if due and not allowed:
            self.close(arc_length_m, speed_mps)
            self.skip(arc_length_m + TICK_S * speed_mps, speed_mps)
            return False, 0.0
        valve, place_m = self._next(arc_length_m, speed_mps, due)
        if valve == self.valve:
            self._last_m = arc_length_m
            return valve, 0.0
        after_s = min((place_m - arc_length_m) / speed_mps, TICK_S) if place_m > arc_length_m else 0.0
        self.valve, self._last_m = valve, arc_length_m
        if valve:
            self.owed_from_m = None
            self.falls_from_m, self.falls_to_m = place_m + speed_mps * self._on_delay_s, math.inf
        else:
            self.falls_to_m = place_m + speed_mps * self._off_delay_s
            self.note_closed()
        return valve, after_s

    def _next(self, arc_length_m: float, speed_mps: float, due: bool) -> tuple[bool, float]:
        """The valve by the end of the coming tick, and where the robot is when it has to change."""
        if self.owed_from_m is not None:
            return due, max(self.owed_from_m - speed_mps * self._on_delay_s, arc_length_m)
        if not due:
            return False, arc_length_m
        now = self._sprays_at(arc_length_m)
        if now == self.valve and self._sprays_at(arc_length_m + TICK_S * speed_mps) != now:
            return not now, self._plan.actuated_alike(arc_length_m)[1]
        return True, arc_length_m

    def close(self, arc_length_m: float, speed_mps: float) -> None:
        """Close the valve here; if it was open and the line goes on, paint is owed from where the last drop falls."""
        if not self.valve:
            return
        self.valve = False
        speed_mps = max(speed_mps, 0.0)
        self.falls_to_m = arc_length_m + speed_mps * self._off_delay_s
        self.note_closed()
        if self._goes_on(arc_length_m):
            opened = arc_length_m >= self.falls_from_m
            self.owed_from_m = self.falls_to_m - JOINT_OVERLAP_M if opened else self.falls_from_m

    def dry(self, arc_length_m: float, speed_mps: float, dry_s: float) -> None:
        """Close the valve here; if it was open and dry for `dry_s`, paint is owed from the last good drop on."""
        if self.valve and dry_s > 0.0:
            fell_m = arc_length_m - self._plan.way_m(arc_length_m, dry_s)
            self.painted.add(self.falls_from_m, fell_m)
            self.owed_from_m = max(fell_m - JOINT_OVERLAP_M, self.falls_from_m)
            self.valve, self.falls_to_m = False, fell_m
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
        if self.valve:
            self.painted.add(self.falls_from_m, arc_length_m)
        self.valve = False
        self.owed_from_m = None
        self._last_m = arc_length_m

    def resume_at(self, arc_length_m: float, owed_from_m: float | None) -> None:
        """Go on where another process left off."""
        self._last_m, self.owed_from_m = arc_length_m, owed_from_m
        self.painted.restore(arc_length_m if owed_from_m is None else owed_from_m)

    def note_closed(self) -> None:
        """Count what has fallen from the valve that has just been closed, its last drop included."""
        self.painted.add(self.falls_from_m, self.falls_to_m)

    def belief(self, arc_length_m: float) -> PaintBelief:
        """What has been painted when the nozzle is here."""
        return self.painted.belief(self.falls_from_m, arc_length_m) if self.valve else self.painted.belief()

    def owed_if_it_ended(self, arc_length_m: float) -> float | None:
        """From where paint would be owed if this were the last tick: nothing flows without the computer."""
        if self.valve and not self._goes_on(arc_length_m):
            return None
        falling = self.valve or (self.owed_from_m is not None and arc_length_m < self.falls_to_m)
        return max(arc_length_m - JOINT_OVERLAP_M, self.falls_from_m) if falling else self.owed_from_m

    def closed(self) -> None:
        """The valve has had its time to close: nothing falls any more, wherever the robot goes."""
        self.falls_to_m = -math.inf

    def must_go_back(self, arc_length_m: float) -> bool:
        """Whether the place from which paint is owed lies behind."""
        return self.owed_from_m is not None and arc_length_m > self.owed_from_m + MISSED_TOLERANCE_M

    def _sprays_at(self, arc_length_m: float) -> bool:
        return bool(self._plan.actuation_at(arc_length_m) & Actuation.VALVE)

    def _goes_on(self, arc_length_m: float) -> bool:
        return self._sprays_at(arc_length_m + MISSED_TOLERANCE_M)

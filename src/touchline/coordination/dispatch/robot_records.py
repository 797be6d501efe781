"""Records of a team's robots, as their dispatcher knows them."""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass, field
from typing import Any, Final

from touchline.coordination.dispatch.task_records import TaskRecord

MOVED_M: Final = 0.05
"""A robot that has not come as far as this stands."""


@dataclass
class RobotJob:
    """Task that a robot does now.

    Attributes:
        record: The task.
        stop: Number of the next stop.
        there_s: Time since which it works at that; nan: it is not there.
        why: Why the robot charges, if it does.
        dock: Dock of a charging task; "": it waits for one.
    """

    record: TaskRecord
    why: str = ""
    stop: int = 0
    there_s: float = math.nan
    dock: str = ""

    @property
    def charges(self) -> bool:
        """True if the task is to charge."""
        return not self.record.stops


@dataclass
class RobotTotals:
    """Totals of a robot: distance, energy, and times by what it did."""

    driven_m: float = 0.0
    used_wh: float = 0.0
    charged_wh: float = 0.0
    busy_s: float = 0.0
    idle_s: float = 0.0
    charging_s: float = 0.0
    waiting_s: float = 0.0
    out_s: float = 0.0


@dataclass
class RobotRecord:
    """A robot.

    Attributes:
        name: Its name.
        home: Where it started, x + iy (m).
        place: Where it is.
        rest: Where it stays while it has no task.
        battery_wh: Charge of its battery when that is full.
        charge: Share of the whole.
        job: What it does.
        route: TaskTable that it is to do next.
        out: Why it cannot be used; "": it can.
        out_since_s: Time since when.
        target: Where it is to be now, as its task needs it.
        claim_s: Time at which it came near to that; inf: it is not.
        held: Where it stands while another is at its target; None: nobody is.
        waits_for: Robot that it waits for.
        stood: Place at which it was when it last moved.
        stood_s: Time of that.
        left_s: Least time that its task was expected to take still.
        left_since_s: Time of that.
        totals: Totals of its whole time.
    """

    name: str
    home: complex
    place: complex
    rest: complex
    battery_wh: float
    charge: float = 1.0
    job: RobotJob | None = None
    route: list[TaskRecord] = field(default_factory=list)
    out: str = ""
    out_since_s: float = math.nan
    target: complex | None = None
    claim_s: float = math.inf
    held: complex | None = None
    waits_for: str = ""
    stood: complex = complex(math.nan, math.nan)
    stood_s: float = 0.0
    left_s: float = math.inf
    left_since_s: float = 0.0
    totals: RobotTotals = field(default_factory=RobotTotals)

    def see(self, place: complex, charge: float, elapsed_s: float, now_s: float) -> None:
        """Take what is known of it at an update; a charge that is not known is nan."""
        totals = self.totals
        totals.driven_m += abs(place - self.place) if cmath.isfinite(self.place) else 0.0
        self.place = place
        if not abs(place - self.stood) <= MOVED_M:
            self.stood, self.stood_s = place, now_s
        if math.isfinite(charge):
            gained_wh = (charge - self.charge) * self.battery_wh
            totals.charged_wh += max(gained_wh, 0.0)
            totals.used_wh += max(-gained_wh, 0.0)
            self.charge = charge
        if self.out:
            totals.out_s += elapsed_s
        elif self.job is None:
            totals.idle_s += elapsed_s
        elif self.job.charges:
            totals.charging_s += elapsed_s
        elif self.held is not None:
            totals.waiting_s += elapsed_s
        else:
            totals.busy_s += elapsed_s

    def figures(self) -> dict[str, Any]:
        """Return the robot as a JSON object."""
        job = self.job
        state = "out" if self.out else "idle" if job is None else "charging" if job.charges else "busy"
        return {
            "state": state,
            "task": "" if job is None else job.record.id,
            "next": [each.id for each in self.route],
            "reason": self.out or (f"waits for {self.waits_for}" if self.waits_for else ""),
            "charge": round(self.charge, 4),
            **{name: round(value, 3) for name, value in vars(self.totals).items()},
        }

"""Keeper of a robot's committed plan: which one it follows, and which it refuses.

It follows a newer plan only if that continues the one that it follows, and arrives before it may differ from that. So a
coordinator that keeps both clear until it hears which one is followed never has a robot elsewhere.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.core.timed_motion import COLUMNS, SPEED, STEP_S, YAW_RATE, Y
from touchline.onboard.interface import TICKS_PER_S
from touchline.schemas.messages import Guidance
from touchline.schemas.messages.team_messages import FIRST_CELL

Floats = NDArray[np.float64]

_LEAST_ROWS: Final = 2


class PlanKeeper:
    """Keeper of one robot's plan.

    Attributes:
        plan: (m, 5) samples of `timed_motion`; none where the robot stood at the start.
        plan_tick: Tick of the first.
        longest_m: Length of the longest plan so far.
        adopted: Number of the plan.
        decided: Highest number that it has adopted or refused.
    """

    def __init__(self) -> None:
        """Start without a plan."""
        self.plan: Floats = np.zeros((0, COLUMNS))
        self.plan_tick, self.longest_m = 0, 0.0
        self.adopted = self.decided = FIRST_CELL

    def over(self, tick: int) -> bool:
        """Return whether its plan is at rest by a tick."""
        return tick >= self.plan_tick + math.ceil(len(self.plan) * STEP_S * TICKS_PER_S)

    def receive(self, guidance: Guidance, tick: int, *, halts: bool = False) -> bool:
        """Take guidance, in any order, late or doubled.

        Args:
            guidance: The message.
            tick: Now.
            halts: Whether the robot is to stand, so that it refuses newer plans.

        Returns:
            Whether it holds a plan that can be followed by anybody.
        """
        numbers = np.array(guidance.plan, dtype=np.float64)
        times = guidance.plan_start_s, guidance.plan_branch_s
        if len(numbers) % COLUMNS or len(numbers) < _LEAST_ROWS * COLUMNS:
            return False
        plan = numbers.reshape(-1, COLUMNS)
        if not np.isfinite((*numbers, *times)).all() or plan[-1, SPEED] or plan[-1, YAW_RATE]:
            return False
        if guidance.number > self.decided:
            self.decided = guidance.number
            branch_tick = round(guidance.plan_branch_s * TICKS_PER_S)
            if guidance.plan_base == self.adopted and tick <= branch_tick and not halts:
                self.adopted, self.plan = guidance.number, plan
                self.plan_tick = round(guidance.plan_start_s * TICKS_PER_S)
                steps_m = np.diff(plan[:, : Y + 1], axis=0)
                self.longest_m = max(self.longest_m, float(np.hypot(*steps_m.T).sum()))
        return True

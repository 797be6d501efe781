"""Committed plans of a team: each robot always holds a plan that ends at rest, and no two plans ever come too near.

A plan is one period of a speed and a yaw rate, then braking to rest. Invariant: any two committed plans are at least
2·r_s apart at every time from now on, and each as far from walls as it must be. In each update robots choose one after
another; a new plan must keep apart from those of all others: the new ones of those who have chosen, the rest of the old
ones of those who have not. So each replacement keeps the invariant; a robot without any other permitted plan keeps the
rest of its old one, which always qualifies. docs/explanation/teams.md has the reasons. After Petti, Fraichard, "Safe
motion planning in dynamic environments", IROS 2005, and Bekris, Tsianos, Kavraki, IROS 2007.

What a robot wishes decides only how fast it arrives, not whether it is safe:

- it drives to its goal on the shortest way round walls, on the right of that way until it sees its goal;
- far from its goal it drives a little to the right of it, so that robots who change places go round each other;
- the wished velocity is changed so that it leads into nobody soon (sampled velocity obstacles);
- near its goal it takes the plan whose place of rest is nearest to it, else it would circle its goal;
- who is nearest to its goal chooses first;
- a *token* goes to a robot that has come no nearer for a while: it chooses before all others, and who stands in its
  way is pushed aside first, and so on (priority inheritance, Okumura et al., Artificial Intelligence 310, 2022).
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.free_area import FreeArea
from touchline.coordination.plans import plan_kernels as k
from touchline.coordination.plans.next_legs import Manner, NextLeg
from touchline.coordination.plans.ways import Ways
from touchline.core import timed_motion as t
from touchline.core.angles import wrapped
from touchline.schemas.errors import TouchlineError

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Bools = NDArray[np.bool_]

_RIGHT_RAD: Final = math.radians(21.0)
_FAR_M: Final = 2.0
_KEEP_RIGHT_M: Final = 0.3
"""Distance to the right of its way at which a robot drives while a wall is between it and its goal…"""
_MEETS_M: Final = 4.0
"""…and another robot is so near."""
_ROUNDING_M: Final = 1e-9
_STOPS_M: Final = 0.6
_THERE_M: Final = 0.03
"""A robot that rests this near to its goal stays."""
_AT_GOAL_M: Final = 0.1
# A robot that is to drive on a line turns nearly to it first: share of full speed until then, and the angle.
_TURNS: Final = 0.05
_FACES_RAD: Final = 0.4
_NEARER_M: Final = 0.1
_PATIENCE_S: Final = 3.0
_SOON_S: Final = 1.0
"""Patience with a robot in the way that is at its goal…"""
_BEFORE: Final = 1.5
"""…nearer than the least distance of two plans times this."""
_TOKEN_S: Final = 15.0
_FREED_M: Final = 0.5
"""Way by which who has the token comes nearer until it gives it back."""


class TooNear(TouchlineError):
    """Robots that stand too near to each other or to a wall at the start: no plan keeps them apart."""


class CommittedPlans:
    """Plans of a team of robots, known by their numbers.

    Attributes:
        plans: (n, m, 5) of `plan_kernels`, of which the first sample is now.
        token: Robot that has the token; −1: none.
    """

    def __init__(self, poses: Floats, area: FreeArea, limits: k.PlanLimits) -> None:
        """Let all robots stay where they stand.

        Args:
            poses: (n, 3) x, y (m), heading (rad).
            area: The area.
            limits: Limits of plans.

        Raises:
            TooNear: Two robots, or one and a wall, are nearer than plans may be.
        """
        self._limits = limits
        self._around = k.AreaBorders(np.ascontiguousarray(area.sides), np.ascontiguousarray(area.walls))
        self.plans: Floats = np.zeros((len(poses), k.samples_of(limits), t.COLUMNS))
        self.plans[:, :, :3] = poses[:, None]
        if (apart_m := k.closest_plans_m(self.plans)) < limits.apart_m:
            raise TooNear(f"two robots stand {apart_m:.3f} m apart, plans need {limits.apart_m:g} m: move them apart")
        if not all(k.clear_of_walls(plan, self._around, limits) for plan in self.plans):
            raise TooNear(f"a robot stands nearer than {limits.wall_m:g} m to a wall: move it away")
        self._ways = Ways(area, limits.wall_m, limits.apart_m)
        self._velocities: Complexes = np.zeros(len(poses), dtype=np.complex128)
        self._nearest_m = np.full(len(poses), math.inf)
        self._nearer_s = np.zeros(len(poses))
        self._now_s = self._token_s = self._token_m = 0.0
        self.token = -1

    @property
    def places(self) -> Complexes:
        """(n,) where each plan is now, x + iy (m)."""
        found: Complexes = self.plans[:, 0, t.X] + 1j * self.plans[:, 0, t.Y]
        return found

    @property
    def closest_m(self) -> float:
        """Least distance of any two plans from now on (m)."""
        return float(k.closest_plans_m(self.plans))

    def update(self, goals: Floats) -> None:
        """Let a period pass, and all robots choose new plans.

        Args:
            goals: (n, 2) where each wants to be (m).
        """
        self._pass_time()
        wanted = goals[:, 0] + 1j * goals[:, 1]
        legs = self._ways.legs(self.places, self.plans[:, -1, t.X] + 1j * self.plans[:, -1, t.Y], wanted, self._now_s)
        left_m = np.array([leg.left_m for leg in legs])
        self._look_for_token(legs, left_m)
        chosen: set[int] = set()
        if self.token >= 0:
            self._drive_first(self.token, legs[self.token], chosen)
        for who in np.argsort(left_m, kind="stable").tolist():
            if who not in chosen:
                self._choose(who, legs[who])

    def choose_by(self, wishes: Complexes, order: Sequence[int]) -> None:
        """Let a period pass, and robots choose plans by wished velocities, whatever these are.

        Args:
            wishes: (n,) m/s.
            order: Robots in the order in which they choose; others keep the rest of their plans.
        """
        self._pass_time()
        for who in order:
            self._drive(who, complex(wishes[who]))

    def _pass_time(self) -> None:
        k.advance(self.plans, self._limits.period_steps)
        self._now_s += self._limits.period_steps * t.STEP_S

    def _choose(self, who: int, leg: NextLeg) -> None:
        """Commit a robot to a plan along its leg."""
        aim, left_m, manner = leg
        if manner is Manner.WAIT:
            self._drive(who, 0j)
            return
        places = self.places
        ahead = aim - complex(places[who])
        if left_m <= _STOPS_M or (manner is Manner.EXACT and abs(ahead) <= _STOPS_M):
            self._stop_at(who, aim)
            return
        wish = self._straight(ahead)
        if manner is Manner.EXACT:
            off = abs(wrapped(cmath.phase(ahead) - self.plans[who, 0, t.HEADING]))
            self._drive(who, wish if off <= _FACES_RAD else _TURNS * wish)
            return
        free, round_corner = manner is Manner.FREE, left_m > abs(ahead) + _ROUNDING_M
        if free and round_corner and np.count_nonzero(np.abs(places - places[who]) < _MEETS_M) > 1:
            wish = self._straight(ahead - 1j * _KEEP_RIGHT_M * wish / self._limits.speed_max_mps)
        if free and abs(ahead) > _FAR_M:
            wish *= cmath.exp(-1j * _RIGHT_RAD)
        self._drive(who, k.avoiding(places, self._velocities, who, wish, self._limits))

    @staticmethod
    def _waits(place: complex, leg: NextLeg) -> bool:
        """Return whether a robot waits for others, as its leg tells it to."""
        return leg.manner is Manner.WAIT or (leg.manner is Manner.EXACT and abs(leg.aim - place) <= _AT_GOAL_M)

    def _stop_at(self, who: int, goal: complex) -> None:
        """Commit a robot to the plan whose place of rest is nearest to its goal (m)."""
        rest = self.plans[who, -1]
        if abs(goal - complex(rest[t.X], rest[t.Y])) <= _THERE_M:
            self._velocities[who] = 0j
            return
        k.choose(self.plans, who, goal, True, self._around, self._limits)
        self._note_velocity(who)

    def _drive(self, who: int, wish: complex) -> None:
        """Commit a robot to the plan nearest to a wished velocity (m/s)."""
        k.choose(self.plans, who, wish, False, self._around, self._limits)
        self._note_velocity(who)

    def _note_velocity(self, who: int) -> None:
        end = self.plans[who, self._limits.period_steps]
        self._velocities[who] = cmath.rect(end[t.SPEED], end[t.HEADING])

    def _straight(self, way: complex) -> complex:
        """Return full speed (m/s) along a way (m)."""
        return way / abs(way) * self._limits.speed_max_mps if way else 0j

    def _drive_first(self, who: int, leg: NextLeg, chosen: set[int]) -> None:
        """Commit the robot with the token to a plan straight to its goal, after all in its way have made way."""
        wish = self._straight(leg.aim - self.places[who])
        self._clear_way(who, wish, chosen)
        if leg.left_m <= _STOPS_M or leg.manner is Manner.EXACT:
            self._choose(who, leg)
        else:
            self._drive(who, wish)

    def _clear_way(self, who: int, wish: complex, chosen: set[int]) -> None:
        """Push aside all that stand in a robot's way, and first those that stand in theirs."""
        chosen.add(who)
        while (other := k.blocker(self.plans, who, wish, self._around, self._limits)) >= 0 and other not in chosen:
            aside = self._aside(other, who, wish)
            self._clear_way(other, aside, chosen)
            self._drive(other, aside)

    def _aside(self, who: int, by: int, wish: complex) -> complex:
        """Return the velocity (m/s) by which a robot makes way for another with a wish.

        It goes away from it and aside, or only away if a wall is beside it.
        """
        here = self.places[who]
        off = here - self.places[by]
        side = 1j * wish if (wish.conjugate() * off).imag > 0.0 else -1j * wish
        aside = self._straight(0.5 * off / abs(off) + side / max(abs(side), 1e-9))
        ways = np.zeros((2, t.COLUMNS))
        ways[:, t.X], ways[:, t.Y] = np.real((here, here + aside)), np.imag((here, here + aside))
        return aside if k.clear_of_walls(ways, self._around, self._limits) else self._straight(off)

    def _look_for_token(self, legs: Sequence[NextLeg], left_m: Floats) -> None:
        """Give the token to who has waited too long, if nobody has it; take it from who is there, or had it too long.

        Args:
            legs: NextLeg of each robot.
            left_m: (n,) length of each robot's way.
        """
        waits = np.array([self._waits(*each) for each in zip(self.places.tolist(), legs, strict=True)])
        nearer = (left_m < self._nearest_m - _NEARER_M) | waits
        self._nearest_m[nearer], self._nearer_s[nearer] = left_m[nearer], self._now_s
        there = left_m <= _AT_GOAL_M
        self._nearer_s[there] = self._now_s
        self._nearest_m[there] = math.inf  # who is pushed away from its goal begins anew
        freed = there | (left_m < self._token_m - _FREED_M)
        if self.token >= 0 and (freed[self.token] or self._now_s - self._token_s > _TOKEN_S):
            self._nearer_s[self.token] = self._now_s
            self._nearest_m[self.token] = left_m[self.token]
            self.token = -1
        waited_s = self._now_s - self._nearer_s
        for who in np.argsort(-waited_s, kind="stable").tolist() if self.token < 0 else ():
            if waited_s[who] > _PATIENCE_S or (
                waited_s[who] > _SOON_S and self._is_shut_out(who, legs[who].aim, there)
            ):
                self.token, self._token_s, self._token_m = who, self._now_s, float(left_m[who])
                break

    def _is_shut_out(self, who: int, aim: complex, there: Bools) -> bool:
        """Return whether a robot stands before another one that is at its goal, and will not go by itself."""
        off = self.places - self.places[who]
        before = (np.abs(off) < _BEFORE * self._limits.apart_m) & ((off * np.conj(aim - self.places[who])).real > 0.0)
        return bool((before & there).any())

"""Committed plans of a team: each robot always holds a plan that ends at rest, and no two plans ever come too near.

A plan is one period of a speed and a yaw rate, then braking to rest. Invariant: any two committed plans are at least
2·r_s apart at every time from now on, and each as far from walls as it must be. In each update robots choose one after
another; a new plan must keep apart from those of all others: the new ones of those who have chosen, the rest of the old
ones of those who have not. So each replacement keeps the invariant; a robot without any other permitted plan keeps the
rest of its old one, which always qualifies. Where messages may be lost, both the old and the new plan of a robot are
kept clear until it is known which it follows. docs/explanation/teams.md has the reasons. After Petti, Fraichard, "Safe
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
from collections.abc import Collection, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.algorithms.team_algorithm import GoalWish, PathWish, TwistWish, VelocityWish, Wish
from touchline.coordination.algorithms.wish_geometry import ALONG_M, aim_of, velocity_of
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
_STANDS_MPS: Final = 1e-9
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
        plans: (n, m, 5) of `plan_kernels`, of which the first sample is now: those that robots are known to follow.
        changes: (n, 2) change of the speed (m/s) and yaw rate (rad/s) that each robot has wished at the last update.
        token: Robot that has the token; −1: none.
    """

    def __init__(
        self,
        poses: Floats,
        area: FreeArea,
        limits: k.PlanLimits,
        *,
        certain: bool = True,
        apart: bool = True,
    ) -> None:
        """Let all robots stay where they stand, or follow the plans that they have.

        Args:
            poses: (n, 3) x, y (m), heading (rad); or (n, m, 5) plans under way.
            area: The area.
            limits: Limits of plans.
            certain: Whether all robots follow what is chosen at once; else new plans are proposals until `settle`.
            apart: False: every wish is granted, whoever or whatever is in the way.

        Raises:
            TooNear: Two robots, or one and a wall, are nearer than plans may be.
        """
        self._certain = certain
        self._limits = limits = limits if apart else limits._replace(apart_m=0.0)
        sides, walls = (area.sides, area.walls) if apart else (area.sides[:0], area.walls[:0])
        self._around = k.AreaBorders(np.ascontiguousarray(sides), np.ascontiguousarray(walls))
        n = len(poses)
        rows = n if certain else 2 * n
        plans: Floats = np.zeros((rows, k.samples_of(limits), t.COLUMNS))
        self._claims = k.Claims(plans, np.full(rows, -1, dtype=np.int64))
        plans[:n, :, : poses.shape[-1]], self._claims.owners[:n] = (
            poses if poses.ndim > 2 else poses[:, None],
            np.arange(n),
        )
        self.plans = plans[:n]
        if (apart_m := self.closest_m) < limits.apart_m - _ROUNDING_M:
            raise TooNear(f"two robots stand {apart_m:.3f} m apart, plans need {limits.apart_m:g} m: move them apart")
        at_walls = limits._replace(wall_m=limits.wall_m - _ROUNDING_M)
        if not all(k.clear_of_walls(plan, self._around, at_walls) for plan in self.plans):
            raise TooNear(f"a robot stands nearer than {limits.wall_m:g} m to a wall: move it away")
        self._ways = Ways(area, limits.wall_m, limits.apart_m)
        self._velocities: Complexes = np.zeros(len(poses), dtype=np.complex128)
        self.changes: Floats = np.zeros((len(poses), 2))
        self._nearest_m = np.full(len(poses), math.inf)
        self._nearer_s = np.zeros(len(poses))
        self._now_s = self._token_s = self._token_m = 0.0
        self._turns = 0
        self.token = -1

    @property
    def places(self) -> Complexes:
        """(n,) where each plan is when a new one may begin to differ, x + iy (m)."""
        begins = self.plans[:, self._limits.lead_steps]
        found: Complexes = begins[:, t.X] + 1j * begins[:, t.Y]
        return found

    @property
    def closest_m(self) -> float:
        """Least distance of two robots' plans from now on (m), proposals included."""
        return float(k.closest_plans_m(self._claims))

    @property
    def proposed(self) -> Bools:
        """(n,) whether a robot may be following its proposal instead of its plan, until `settle`."""
        return (
            np.zeros(len(self.plans), dtype=np.bool_) if self._certain else self._claims.owners[len(self.plans) :] >= 0
        )

    @property
    def proposals(self) -> Floats:
        """(n, m, 5) proposals, where there are any; without them the plans."""
        return self.plans if self._certain else self._claims.plans[len(self.plans) :]

    def settle(self, who: int, *, follows: bool) -> None:
        """Take note whether a robot follows its proposal from now on, or never will."""
        proposal = len(self.plans) + who
        if follows:
            self.plans[who] = self._claims.plans[proposal]
        self._claims.owners[proposal] = -1

    def update(self, wishes: Sequence[Wish], staying: Collection[int] = ()) -> None:
        """Let a period pass, and robots choose new plans.

        Args:
            wishes: Wish of each.
            staying: Robots that keep the rest of their plans.
        """
        self._pass_time()
        self.changes[:] = 0.0
        # Those with proposals cannot be asked anything else yet.
        chosen = {*np.flatnonzero(self.proposed).tolist(), *staying}
        legs = self._legs(wishes)
        left_m, stays = np.array([leg.left_m for leg in legs]), np.zeros(len(legs), dtype=np.bool_)
        stays[list(staying)] = True
        self._velocities[stays] = 0j
        self._look_for_token(legs, left_m, stays)
        if self.token >= 0 and self.token not in chosen:
            self._drive_first(self.token, legs[self.token], chosen)
        self._turns += 1  # those without a way choose first, each in its turn
        order = np.roll(np.arange(len(legs)), -self._turns)
        for who in order[np.argsort(left_m[order], kind="stable")].tolist():
            if who in chosen:
                continue
            wish, leg = wishes[who], legs[who]
            if isinstance(wish, GoalWish) or (isinstance(wish, PathWish) and leg.left_m <= _STOPS_M):
                self._choose(who, leg)
            elif isinstance(wish, PathWish):
                self._drive(who, self._straight(leg.aim - complex(self.places[who])))
            else:
                self._drive(who, self._velocity(who, wish))

    def _legs(self, wishes: Sequence[Wish]) -> list[NextLeg]:
        """Return the next part of the way of each robot; those that wish no place have come to its end."""
        places = self.places
        legs = [self._own_leg(place, wish) for place, wish in zip(places.tolist(), wishes, strict=True)]
        if not any(isinstance(wish, GoalWish) for wish in wishes):
            return legs
        wanted = zip(wishes, legs, strict=True)
        goals = [complex(wish.x_m, wish.y_m) if isinstance(wish, GoalWish) else leg.aim for wish, leg in wanted]
        rests = self.plans[:, -1, t.X] + 1j * self.plans[:, -1, t.Y]
        to_goals = self._ways.legs(places, rests, np.array(goals), self._now_s)
        return [
            to_goal if isinstance(wish, GoalWish) else leg
            for wish, leg, to_goal in zip(wishes, legs, to_goals, strict=True)
        ]

    def _own_leg(self, place: complex, wish: Wish) -> NextLeg:
        """Return the next part of a path that a robot wishes; for other wishes one of no length."""
        if not isinstance(wish, PathWish):
            return NextLeg(place, 0.0)
        aims = (aim_of(wish, place, along_m) for along_m in ALONG_M)
        aim = next((aim for aim in aims if self._ways.sees(place, aim)), aim_of(wish, place, ALONG_M[-1]))
        return NextLeg(aim, abs(aim - place) + abs(complex(*wish.points_m[-1]) - aim))

    def _velocity(self, who: int, wish: Wish) -> complex:
        """Return a wished velocity (m/s); one of a robot that is to stand keeps its heading."""
        now = self.plans[who, self._limits.lead_steps]
        if isinstance(wish, TwistWish):
            forward = TwistWish(max(wish.speed_mps, _STANDS_MPS), wish.yaw_rate_radps)
            return velocity_of(forward, now[t.HEADING], self._limits.drive_steps * t.STEP_S)
        velocity = complex(wish.x_mps, wish.y_mps) if isinstance(wish, VelocityWish) else 0j
        return velocity if abs(velocity) > _STANDS_MPS else cmath.rect(_STANDS_MPS, now[t.HEADING])

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
        k.advance(self._claims.plans, self._limits.update_steps)
        self._now_s += self._limits.update_steps * t.STEP_S

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
            off = abs(wrapped(cmath.phase(ahead) - self.plans[who, self._limits.lead_steps, t.HEADING]))
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
        self._commit(who, goal, stops=True)

    def _drive(self, who: int, wish: complex) -> None:
        """Commit a robot to the plan nearest to a wished velocity (m/s)."""
        self._commit(who, wish, stops=False)

    def _commit(self, who: int, aim: complex, *, stops: bool) -> None:
        """Commit a robot to the plan nearest to an aim, as of `plan_kernels.choose`."""
        into = who if self._certain else len(self.plans) + who
        plans, owners = self._claims
        if into != who and owners[into] == who:
            return  # what it follows must be known first
        self.changes[who] = k.choose(self._claims, who, into, aim, stops, self._around, self._limits)
        chosen = plans[into] if owners[into] == who else plans[who]
        end = chosen[self._limits.brakes_at]
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
        while (other := k.blocker(self._claims, who, wish, self._around, self._limits)) >= 0 and other not in chosen:
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

    def _look_for_token(self, legs: Sequence[NextLeg], left_m: Floats, stays: Bools) -> None:
        """Give the token to who has waited too long, if nobody has it; take it from who is there, or had it too long.

        Args:
            legs: NextLeg of each robot.
            left_m: (n,) length of each robot's way.
            stays: (n,) whether it keeps its plan, so that the token is of no use to it.
        """
        waits = np.array([self._waits(*each) for each in zip(self.places.tolist(), legs, strict=True)]) | stays
        nearer = (left_m < self._nearest_m - _NEARER_M) | waits
        self._nearest_m[nearer], self._nearer_s[nearer] = left_m[nearer], self._now_s
        there = left_m <= _AT_GOAL_M
        self._nearer_s[there] = self._now_s
        self._nearest_m[there] = math.inf  # who is pushed away from its goal begins anew
        freed = stays | there | (left_m < self._token_m - _FREED_M)
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


def warm_up_plans(limits: k.PlanLimits) -> None:
    """Compile or load the kernels by which a robot is pushed aside, which the first exchanges do not need."""
    apart_m = limits.apart_m + _ROUNDING_M
    far_m = 4.0 * (apart_m + limits.wall_m)
    room = FreeArea.of([(-far_m, -far_m), (far_m, -far_m), (far_m, far_m), (-far_m, far_m)])
    team = CommittedPlans(np.array([(0.0, 0.0, 0.0), (apart_m, 0.0, 0.0)]), room, limits)
    team._clear_way(0, complex(limits.speed_max_mps), set())

"""Plans of one region: for the robots that it owns, clear of its own claims and of all that neighbours have sent."""

from __future__ import annotations

import cmath
import math
from collections.abc import Collection, Mapping
from typing import Final
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.free_area import FreeArea
from touchline.coordination.plans import plan_kernels as k
from touchline.coordination.regions.region import Neighbourhood, Region
from touchline.coordination.regions.region_borders import SLACK_M, RegionBorders, reach_m
from touchline.coordination.regions.region_messages import RegionLife, TimedPlan
from touchline.core import timed_motion as t

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_STOPS_M: Final = 0.6
_RIGHT_RAD: Final = math.radians(21.0)
_FAR_M: Final = 2.0
_MEETS_M: Final = 3.0
"""Distance of others that a wish avoids."""
_ROUNDING_M: Final = 1e-9


class RegionHub:
    """Coordinator of one region.

    Attributes:
        region: Claims and handovers.
    """

    def __init__(
        self,
        name: RegionLife,
        started_s: float,
        borders: RegionBorders,
        area: FreeArea,
        robots: Collection[str],
        limits: k.PlanLimits,
    ) -> None:
        """Start without any memory.

        Args:
            name: The region, and a life later than all before.
            started_s: Robots' clock.
            borders: Borders of all regions, with a halo of `halo_m(limits)`.
            area: The area of all.
            robots: Names of all robots of the team.
            limits: Limits of plans.
        """
        self._borders, self._limits = borders, limits
        self._found = WeakKeyDictionary[TimedPlan, frozenset[int]]()
        places = Neighbourhood(borders.neighbours(name.region), self._near)
        self.region = Region(name, started_s, places, robots, self._in_the_way)
        self._around = k.AreaBorders(np.vstack((area.sides, self._zone(name.region))), area.walls)
        self._now_s = 0.0
        self._rows: list[tuple[str, int]] = []
        self._laid: dict[str, int] = {}
        self._claims = k.Claims(np.zeros((0, k.samples_of(limits), t.COLUMNS)), np.zeros(0, dtype=np.int64))

    def _near(self, plan: TimedPlan) -> frozenset[int]:
        """Return the regions near which a plan begins."""
        if (found := self._found.get(plan)) is None:
            x_m, y_m = plan.samples[0, : t.HEADING].tolist()
            found = self._found[plan] = self._borders.near(x_m, y_m)
        return found

    def _zone(self, region: int) -> Floats:
        """Return sides (4, 3), beyond which no plan of the region's leads."""
        left, low, right, high = self._borders.rectangle(region)
        beyond_m = reach_m(self._limits) + SLACK_M + self._limits.wall_m
        offsets = (right + beyond_m, beyond_m - left, high + beyond_m, beyond_m - low)
        return np.array(
            [(x, y, each) for (x, y), each in zip(((1, 0), (-1, 0), (0, 1), (0, -1)), offsets, strict=True)]
        )

    def update(self, now_s: float, goals: Mapping[str, tuple[float, float]]) -> None:
        """Propose a plan for each robot that may get one, nearest to its goal first, and offer those that leave.

        Args:
            now_s: Robots' clock.
            goals: Goal of each own robot (m).
        """
        self._lay_claims(now_s)
        own = self.region.own
        free = [number for number, name in enumerate(own) if self.region.free(name)]
        names = list(own)
        starts = self._claims.plans[: len(own), self._limits.lead_steps]
        off = {n: complex(*goals[names[n]]) - complex(starts[n, t.X], starts[n, t.Y]) for n in free}
        for number in sorted(free, key=lambda each: abs(off[each])):
            self._propose(names[number], number, off[number], complex(*goals[names[number]]))
        for name, robot in own.items():
            end = robot.claims[max(robot.claims)].samples[-1]
            at = self._borders.at(float(end[t.X]), float(end[t.Y]))
            self.region.offer(name, at if at != self.region.name.region else None)

    def _lay_claims(self, now_s: float) -> None:
        """Lay out all claims from now on: plans followed by own robots, their proposals, and claims of others."""
        self._now_s, own = now_s, self.region.own
        followed = [(name, robot.followed) for name, robot in own.items()]
        open_now = [(name, robot.proposal or -1) for name, robot in own.items()]
        plans = [own[name].claims[number] for name, number in followed]
        plans += [own[name].claims.get(number, own[name].claims[own[name].followed]) for name, number in open_now]
        owners = [*range(len(own)), *(n if number >= 0 else -1 for n, (_, number) in enumerate(open_now))]
        for number, claims in enumerate(self.region.foreign.values(), len(own)):
            plans += claims.plans.values()
            owners += [number] * len(claims.plans)
        self._rows = [*followed, *open_now]
        self._laid = {name: robot.epoch for name, robot in own.items()}
        m = k.samples_of(self._limits)
        steps = np.array([round((now_s - plan.start_s) / t.STEP_S) for plan in plans], dtype=np.int64)
        rows = np.clip(np.arange(m) + steps[:, None], 0, m - 1)
        samples = np.array([plan.samples for plan in plans]).reshape(-1, m, t.COLUMNS)
        rest = samples[np.arange(len(plans))[:, None], rows]
        self._claims = k.Claims(np.ascontiguousarray(rest), np.array(owners, dtype=np.int64))

    def _propose(self, name: str, number: int, off: complex, goal: complex) -> None:
        """Propose the plan nearest to a robot's wish, unless it is the rest of the one that it follows."""
        into = len(self.region.own) + number
        stops = abs(off) <= _STOPS_M
        wish = off / abs(off) * self._limits.speed_max_mps if off else 0j
        wish *= cmath.exp(-1j * _RIGHT_RAD) if abs(off) > _FAR_M else 1.0
        aim = goal if stops else self._avoiding(number, wish)
        k.choose(self._claims, number, into, aim, stops, self._around, self._limits)
        if self._claims.owners[into] == number:
            branch_s = self._now_s + self._limits.lead_steps * t.STEP_S
            self.region.propose(name, TimedPlan(self._claims.plans[into].copy(), self._now_s, branch_s))
            self._rows[into] = name, self.region.own[name].proposal or 0

    def _avoiding(self, number: int, wish: complex) -> complex:
        """Return the velocity (m/s) near to a wish that leads into nobody soon."""
        (plans, owners), at = self._claims, self._limits.brakes_at
        begins = plans[:, self._limits.lead_steps]
        away_m = np.hypot(begins[:, t.X] - begins[number, t.X], begins[:, t.Y] - begins[number, t.Y])
        others = np.flatnonzero((away_m < _MEETS_M) & (owners >= 0) & (owners != number))
        seen = np.concatenate(((number,), others))
        places = begins[seen, t.X] + 1j * begins[seen, t.Y]
        velocities = plans[seen, at, t.SPEED] * np.exp(1j * plans[seen, at, t.HEADING])
        return complex(k.avoiding(places, velocities, 0, wish, self._limits))

    def _in_the_way(self, robot: str, plan: TimedPlan) -> list[tuple[str, int]]:
        """Return own claims that are too near to a plan of a robot of another region."""
        plans, owners = self._claims
        rest, own, count = self._rest(plan), self.region.own, len(self._rows)
        away_m = np.hypot(plans[:count, 0, t.X] - rest[0, t.X], plans[:count, 0, t.Y] - rest[0, t.Y])
        near = np.flatnonzero((away_m < self._borders.halo_m) & (owners[:count] >= 0))
        laid = [(self._rows[row], plans[row]) for row in near.tolist() if self._is_laid(self._rows[row])]
        others = [name for name, each in own.items() if self._laid.get(name) != each.epoch]  # got since then
        got = [((name, number), self._rest(each)) for name in others for number, each in own[name].claims.items()]
        enough = (self._limits.apart_m - _ROUNDING_M) ** 2
        return [
            claim
            for claim, each in (*laid, *got)
            if claim[0] != robot and k.apart_squared_of(rest, each, enough) < enough
        ]

    def _is_laid(self, claim: tuple[str, int]) -> bool:
        """Return whether a claim that was laid out is still one."""
        own = self.region.own.get(claim[0])
        return own is not None and own.epoch == self._laid[claim[0]] and claim[1] in own.claims

    def _rest(self, plan: TimedPlan) -> Floats:
        """Return what is left of a plan, (m, 5)."""
        steps = round((self._now_s - plan.start_s) / t.STEP_S)
        m = len(plan.samples)
        return np.ascontiguousarray(plan.samples[np.clip(np.arange(m) + steps, 0, m - 1)])

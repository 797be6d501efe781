"""Plans that keep apart by barrier certificates: all robots' commands are changed together, as little as possible.

A command (speed and yaw rate) drives a robot for a period; the backup is to brake to rest. With D the least distance of
two plans, h = D − 2·r_s if both brake at once. Commands must keep D ≥ 2·r_s + (1 − γ)·h; with γ = 1 that is what
committed plans keep. D is linearised at braking, which so satisfies every row, and a quadratic program finds the
commands nearest to the wishes. As D is not linear, the answer is checked with the exact distances, and robots of pairs
that violate them are scaled towards braking, which is always permitted: it is the rest of the old plan. Where messages
may be lost, distances to the old plans and open proposals of others are rows, too, and a robot whose proposal cannot
keep them gets none.

After Wang, Ames, Egerstedt, "Safety barrier certificates for collisions-free multirobot systems", IEEE Transactions on
Robotics 33(3), 2017, with a backup as in Gurriet et al., IEEE Access 8, 2020.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Collection, Sequence
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.algorithms.team_algorithm import Wish
from touchline.coordination.free_area import FreeArea
from touchline.coordination.plans import barrier_kernels as b
from touchline.coordination.plans import plan_kernels as k
from touchline.coordination.plans.committed_plans import CommittedPlans
from touchline.core import timed_motion as t

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

GAMMA: Final = 1.0
"""Share of h that may be used up in a period."""
_TURNING_WEIGHT: Final = 0.05
"""Weight of a changed yaw rate against a changed speed (m²/rad²)."""
_STEPS: Final = (0.02, 0.05)
"""Steps of finite differences: speed (m/s), yaw rate (rad/s)."""
_TOLERANCES_M: Final = (1e-6, 1e-5)
"""Tolerances of rows, the first one usually; rows that meet at braking need the second one."""
_HALVINGS: Final = 6
_ROUNDING_M: Final = 1e-9
_APPROACH_1PS: Final = 1.0
"""Speed towards a goal at which a robot is to stop, by distance."""


class BarrierPlans(CommittedPlans):
    """Plans of a team by barrier certificates; wishes are those of `CommittedPlans`.

    Attributes:
        infeasible: Updates in which the quadratic program had no answer.
    """

    def __init__(self, poses: Floats, area: FreeArea, limits: k.PlanLimits, *, certain: bool = True) -> None:
        """Let all robots stay where they stand, or follow the plans that they have.

        Args:
            poses: (n, 3) x, y (m), heading (rad); or (n, m, 5) plans under way.
            area: The area.
            limits: Limits of plans.
            certain: Whether all robots follow what is chosen at once; else new plans are proposals until `settle`.

        Raises:
            TooNear: Two robots, or one and a wall, are nearer than plans may be.
        """
        super().__init__(poses, area, limits, certain=certain)
        self.infeasible = 0
        self._asked = np.zeros(len(poses), dtype=np.complex128)

    def update(self, wishes: Sequence[Wish], staying: Collection[int] = ()) -> None:
        """Let a period pass, and change the wishes of all robots as little as possible, but of those that stay."""
        self._asked[:] = 0.0
        super().update(wishes, staying)
        self._filter(staying)

    def choose_by(self, wishes: NDArray[np.complex128], order: Sequence[int]) -> None:
        """Let a period pass, and robots wish velocities (m/s); those that are not in the order wish to stand."""
        self._asked[:] = 0.0
        super().choose_by(wishes, order)
        self._filter()

    def _commit(self, who: int, aim: complex, *, stops: bool) -> None:
        """Note a wished velocity; all are looked at together."""
        way = aim - complex(*self.plans[who, 0, :2]) if stops else aim
        speed_mps = min(_APPROACH_1PS * abs(way), self._limits.speed_max_mps) if stops else abs(way)
        self._asked[who] = cmath.rect(speed_mps, cmath.phase(way)) if way else 0j
        self._velocities[who] = self._asked[who]

    def _filter(self, staying: Collection[int] = ()) -> None:
        """Choose the commands nearest to the wishes that keep all apart; robots with an open proposal keep that."""
        stays = np.isin(np.arange(len(self.plans)), list(staying))
        free = np.flatnonzero(~self.proposed & ~stays)
        if not len(free):
            return
        limits, around, begin = self._limits, self._around, self.plans[free, self._limits.lead_steps]
        most = self._most_radps(begin)
        low = np.column_stack((np.maximum(begin[:, t.SPEED] - self._gain_mps, 0.0), -most))
        high = np.column_stack((np.minimum(begin[:, t.SPEED] + self._gain_mps, limits.speed_max_mps), most))
        wished = np.clip(self._commands(free, begin), low, high)
        braking = np.column_stack((low[:, 0], np.zeros(len(free))))
        trials = _Trials(free, *self._fixed(stays))
        backup = self._rolled_out(trials, np.zeros_like(braking))
        pairs = trials.near_pairs(backup, self._range_m)
        at, need = np.zeros(len(pairs) + len(free)), np.full(len(pairs) + len(free), limits.wall_m)
        need[: len(pairs)] = limits.apart_m
        b.distances_m(backup, pairs, around, at)
        rows = self._rows(trials, braking, backup, pairs, at)
        commands = self._nearest(wished, braking, (low, high), rows, at - need)
        found, kept = self._kept_apart(trials, commands, braking, backup, pairs, need)
        unhindered = self._rolled_out(trials, wished)[: len(free)]
        end = limits.brakes_at
        driven = np.where(kept[:, None, None], found, self.plans[free])
        self.changes[free, 0] = driven[:, end, t.SPEED] - unhindered[:, end, t.SPEED]
        self.changes[free, 1] = driven[:, end, t.YAW_RATE] - unhindered[:, end, t.YAW_RATE]
        self._take(free[kept], found[kept])

    def _fixed(self, stays: NDArray[np.bool_]) -> tuple[Floats, Ints]:
        """Return plans that cannot be changed now, and their robots.

        Args:
            stays: (n,) whether a robot keeps its plan; the only ones if all others follow what is chosen at once.
        """
        plans, owners = self._claims
        held = (owners >= 0) & (stays[owners] | (not self._certain))
        return plans[held], owners[held]

    def _take(self, who: Ints, found: Floats) -> None:
        """Commit robots to plans, or propose these."""
        into = who if self._certain else len(self.plans) + who
        self._claims.plans[into], self._claims.owners[into] = found, who

    @property
    def _gain_mps(self) -> float:
        """Change of speed within a period."""
        return self._limits.acceleration_mps2 * self._limits.drive_steps * t.STEP_S

    @property
    def _range_m(self) -> float:
        """Distance beyond which two robots cannot come too near whatever they do."""
        limits = self._limits
        reach_m = limits.speed_max_mps * (limits.brakes_at * t.STEP_S + limits.speed_max_mps / limits.acceleration_mps2)
        return limits.apart_m + 2.0 * reach_m

    def _most_radps(self, begin: Floats) -> Floats:
        """Return (n,) the largest yaw rate of robots whose plans may differ from samples (n, 5) on."""
        limits, speeds = self._limits, np.maximum(begin[:, t.SPEED] + self._gain_mps, 1e-3)
        fastest = np.minimum(speeds, limits.speed_max_mps)
        return np.minimum(limits.yaw_rate_max_radps, limits.lateral_acceleration_mps2 / fastest)

    def _commands(self, who: Ints, begin: Floats) -> Floats:
        """Return (n, 2) the commands that robots wish: to turn to the velocity, and drive as far as it lies ahead.

        Args:
            who: (n,) robots.
            begin: (n, 5) samples from which on their plans may differ.
        """
        period_s = self._limits.drive_steps * t.STEP_S
        asked = self._asked[who]
        turns = np.array([math.remainder(cmath.phase(each), math.tau) for each in asked.tolist()]) - begin[:, t.HEADING]
        turns = np.where(np.abs(asked) > 0.0, np.remainder(turns + math.pi, math.tau) - math.pi, 0.0)
        return np.column_stack((np.abs(asked) * np.maximum(np.cos(turns), 0.0), turns / period_s))

    def _rolled_out(self, trials: _Trials, commands: Floats) -> Floats:
        """Return the plans of commands (n, 2), and behind them those that are fixed."""
        plans = self.plans[trials.who]
        b.roll_out_all(plans, np.ascontiguousarray(commands), self._limits)
        return np.concatenate((plans, trials.fixed))

    def _rows(self, trials: _Trials, braking: Floats, backup: Floats, pairs: Ints, at: Floats) -> Floats:
        """Return (p + n, 2n) how the distances of pairs, and from walls, change with all commands.

        Args:
            trials: Robots that get commands, and fixed plans.
            braking: (n, 2) commands at which they are taken.
            backup: Plans of these, and fixed ones.
            pairs: (p, 2) robots near to each other.
            at: (p + n,) distances of these plans (m).
        """
        n, p = len(braking), len(pairs)
        rows, slope = np.zeros((p + n, 2 * n)), np.zeros((p + n, 2))
        every, each = np.arange(p), np.arange(n)
        for column, step in enumerate(_STEPS):
            changed = braking.copy()
            changed[:, column] += step
            b.slopes(backup, self._rolled_out(trials, changed), step, pairs, self._around, at, slope)
            rows[every, 2 * pairs[:, 0] + column] = slope[:p, 0]
            chosen = pairs[:, 1] < n
            rows[every[chosen], 2 * pairs[chosen, 1] + column] = slope[:p, 1][chosen]
            rows[p + each, 2 * each + column] = slope[p:, 0]
        return rows

    def _nearest(
        self, wished: Floats, braking: Floats, bounds: tuple[Floats, Floats], rows: Floats, spare_m: Floats
    ) -> Floats:
        """Return the commands (n, 2) nearest to the wished ones that the linear rows permit.

        Args:
            wished: (n, 2).
            braking: (n, 2) at which rows are taken.
            bounds: Least and largest commands, (n, 2) each.
            rows: (k, 2n) as of `_rows`.
            spare_m: (k,) distances if all brake less what they must be.
        """
        import daqp

        n = len(wished)
        needed = np.isfinite(spare_m)
        least = rows @ braking.ravel() - GAMMA * np.where(needed, np.maximum(spare_m, 0.0), 0.0)
        weights = np.tile((1.0, _TURNING_WEIGHT), n)
        lower = np.concatenate((bounds[0].ravel(), least[needed]))
        upper = np.concatenate((bounds[1].ravel(), np.full(int(needed.sum()), 1e30)))
        matrix = np.ascontiguousarray(rows[needed])
        for tolerance_m in _TOLERANCES_M:
            answer: tuple[Any, ...] = daqp.solve(
                np.diag(weights), -weights * wished.ravel(), matrix, upper, lower, primal_tol=tolerance_m
            )
            if answer[2] > 0:
                return np.clip(np.reshape(answer[0], (n, 2)), *bounds)
        self.infeasible += 1
        return braking

    def _kept_apart(
        self, trials: _Trials, commands: Floats, braking: Floats, backup: Floats, pairs: Ints, need: Floats
    ) -> tuple[Floats, NDArray[np.bool_]]:
        """Scale commands towards braking where the exact distances ask for it.

        Returns:
            Plans (n, m, 5), and (n,) whether each may be followed: braking always, if no plans are fixed.
        """
        n, p = len(commands), len(pairs)
        share, at, kept = np.ones(n), np.zeros(p + n), np.ones(n, dtype=np.bool_)
        plans = self._rolled_out(trials, commands)
        for halving in range(_HALVINGS + 1):
            b.distances_m(plans, pairs, self._around, at)
            short = at < need - _ROUNDING_M
            if not short.any():
                return plans[:n], kept
            wrong = np.zeros(len(plans), dtype=np.bool_)
            wrong[pairs[short[:p]].ravel()] = True
            wrong[:n] |= short[p:]
            share[wrong[:n]] *= 0.5 if halving < _HALVINGS - 1 else 0.0
            scaled = self._rolled_out(trials, braking + share[:, None] * (commands - braking))[:n]
            plans[:n] = np.where((share > 0.0)[:, None, None], scaled, backup[:n])
        if self._certain:
            return backup[:n], kept
        return plans[:n], self._without_conflict(plans, pairs, need)

    def _without_conflict(self, plans: Floats, pairs: Ints, need: Floats) -> NDArray[np.bool_]:
        """Return (n,) which new plans keep all distances, to the plans that others then still may be following."""
        n, p = len(need) - len(pairs), len(pairs)
        at = np.zeros(p + n)
        b.distances_m(plans, pairs, self._around, at)
        short = at < need - _ROUNDING_M
        wrong = np.zeros(len(plans), dtype=np.bool_)
        wrong[pairs[short[:p]].ravel()] = True
        kept: NDArray[np.bool_] = ~(wrong[:n] | short[p:])
        return kept


class _Trials(NamedTuple):
    """Robots that get commands together, and plans that cannot be changed now.

    Attributes:
        who: (n,) robots.
        fixed: (q, m, 5) plans.
        owners: (q,) robot of each.
    """

    who: Ints
    fixed: Floats
    owners: Ints

    def near_pairs(self, plans: Floats, range_m: float) -> Ints:
        """Return (p, 2) numbers of two plans that begin so near to each other, of two robots, and not both fixed."""
        pairs: Ints = b.near_pairs(plans, range_m)
        if not len(self.fixed):
            return pairs
        owners = np.concatenate((self.who, self.owners))
        wanted = (owners[pairs[:, 0]] != owners[pairs[:, 1]]) & (pairs[:, 1] < len(self.who))
        return np.ascontiguousarray(pairs[wanted, ::-1])

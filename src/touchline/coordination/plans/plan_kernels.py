"""Kernels: plans that end at rest, whether they keep apart, and which of many is chosen; points are x + iy (m).

A plan is (m, 5) samples of `timed_motion`, of which the first is now and the last is at rest. Between two samples the
place moves along a straight line, so distances of plans are exact.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.angles import wrapped
from touchline.core.arcs import unit
from touchline.core.half_planes import NORMAL_X, NORMAL_Y, OFFSET
from touchline.core.jit import kernel
from touchline.core.polygons import apart_squared, off_squared
from touchline.core.timed_motion import COLUMNS, HEADING, SPEED, STEP_S, YAW_RATE, X, Y

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Complexes = NDArray[np.complex128]

# Primitives: speeds within reach, and yaw rates, of which the last one turns towards the wish.
SPEEDS: Final = 7
RATES: Final = 22
PRIMITIVES: Final = SPEEDS * RATES
# Cost of a primitive against a wished velocity: m/s per radian that its heading is off.
_OFF_HEADING: Final = 0.12
# Cost of a place of rest against a goal: share of its distance, for a heading away from the goal.
_FACING: Final = 0.15
# Cost of changing the yaw rate (m or m/s per rad/s): of two alike primitives the straighter one.
_CALM: Final = 1e-3
# Velocity obstacles: directions, speeds, horizon (s), and costs of a near collision (m) and of passing on the left.
_DIRECTIONS: Final = 32
_FRACTIONS: Final = 3
_HORIZON_S: Final = 4.0
_SOONER_M: Final = 0.2
_LEFT: Final = 0.15
_AT_ONCE_S: Final = 0.05


class PlanLimits(NamedTuple):
    """Limits of plans, common to all robots.

    Attributes:
        speed_max_mps: Largest speed.
        acceleration_mps2: Acceleration and deceleration.
        lateral_acceleration_mps2: Largest lateral acceleration.
        yaw_rate_max_radps: Largest yaw rate.
        yaw_acceleration_radps2: Largest change of the yaw rate.
        apart_m: Least distance of two plans: 2·r_s.
        wall_m: Least distance of a plan from walls.
        lead_steps: Steps after which a new plan may differ from the old one: it may take as long to arrive.
        drive_steps: Steps from then on for which a plan drives, before it brakes.
        update_steps: Steps from one update to the next.
    """

    speed_max_mps: float
    acceleration_mps2: float
    lateral_acceleration_mps2: float
    yaw_rate_max_radps: float
    yaw_acceleration_radps2: float
    apart_m: float
    wall_m: float
    lead_steps: int
    drive_steps: int
    update_steps: int

    @property
    def brakes_at(self) -> int:
        """Number of the sample at which a new plan begins to brake."""
        return self.lead_steps + self.drive_steps


class Claims(NamedTuple):
    """Plans that robots may be following.

    Attributes:
        plans: (k, m, 5); of n robots the first n are those that they are known to follow.
        owners: (k,) number of the robot that may be following each; −1: nobody.
    """

    plans: Floats
    owners: Ints


class AreaBorders(NamedTuple):
    """Borders of the area: half-planes of its sides (h, 3), and its other walls (e, 4) x₁ y₁ x₂ y₂ (m)."""

    sides: Floats
    walls: Floats


@kernel
def samples_of(limits: PlanLimits) -> int:
    """Return how many samples a plan needs, so that it ends at rest whatever it begins with."""
    braking_s = max(
        limits.speed_max_mps / limits.acceleration_mps2, limits.yaw_rate_max_radps / limits.yaw_acceleration_radps2
    )
    return limits.lead_steps + limits.drive_steps + int(braking_s / STEP_S) + 2


@kernel
def roll_out(plan: Floats, speed: float, rate: float, limits: PlanLimits, until: int) -> None:
    """Fill in a plan from the sample on at which it may differ: to a speed and a yaw rate, then to rest.

    Args:
        plan: (m, 5); the first lead_steps + 1 rows are given.
        speed: Wanted (m/s).
        rate: Wanted yaw rate (rad/s).
        limits: Limits.
        until: Number of samples to fill in.
    """
    gain, turn_gain = limits.acceleration_mps2 * STEP_S, limits.yaw_acceleration_radps2 * STEP_S
    brakes_at = limits.lead_steps + limits.drive_steps
    for k in range(limits.lead_steps + 1, until):
        v, w, heading = plan[k - 1, SPEED], plan[k - 1, YAW_RATE], plan[k - 1, HEADING]
        goal_v = speed if k <= brakes_at else 0.0
        goal_w = rate if k <= brakes_at else 0.0
        after_v = v + min(max(goal_v - v, -gain), gain)
        after_w = w + min(max(goal_w - w, -turn_gain), turn_gain)
        turned = 0.5 * (w + after_w) * STEP_S
        way = unit(heading + 0.5 * turned) * (0.5 * (v + after_v) * STEP_S)
        plan[k, X], plan[k, Y] = plan[k - 1, X] + way.real, plan[k - 1, Y] + way.imag
        plan[k, HEADING], plan[k, SPEED], plan[k, YAW_RATE] = heading + turned, after_v, after_w


@kernel
def advance(plans: Floats, steps: int) -> None:
    """Let time pass: of each plan (n, m, 5) the rest is left, and a stay at its end."""
    m = plans.shape[1]
    for i in range(len(plans)):
        for k in range(m):
            for c in range(COLUMNS):
                plans[i, k, c] = plans[i, min(k + steps, m - 1), c]


@kernel
def apart_squared_of(one: Floats, other: Floats, enough: float) -> float:
    """Return the least squared distance (m²) of two plans at the same time; early, once it is less than `enough`.

    Args:
        one: (m, 5).
        other: (m, 5).
        enough: m².
    """
    least = math.inf
    before = complex(one[0, X] - other[0, X], one[0, Y] - other[0, Y])
    for k in range(1, len(one)):
        after = complex(one[k, X] - other[k, X], one[k, Y] - other[k, Y])
        least = min(least, off_squared(0j, before, after))
        if least < enough:
            break
        before = after
    return least


@kernel
def first_conflict(plan: Floats, who: int, claims: Claims, limits: PlanLimits) -> int:
    """Return the first robot of whose plans one is too near to this one; −1: none.

    Args:
        plan: (m, 5).
        who: Number of its robot.
        claims: Plans of all.
        limits: Limits.
    """
    plans, owners = claims
    enough = limits.apart_m * limits.apart_m
    reach_m = 2.0 * limits.speed_max_mps * STEP_S * (len(plan) - 1) + limits.apart_m
    for j in range(len(plans)):
        if owners[j] == who or owners[j] < 0:
            continue
        x, y = plans[j, 0, X] - plan[0, X], plans[j, 0, Y] - plan[0, Y]
        if x * x + y * y < reach_m * reach_m and apart_squared_of(plan, plans[j], enough) < enough:
            return int(owners[j])
    return -1


@kernel
def clear_of_walls(plan: Floats, around: AreaBorders, limits: PlanLimits) -> bool:
    """Return whether a plan (m, 5) keeps its distance from all walls and sides of the area."""
    for s in range(len(around.sides)):
        x, y, offset = around.sides[s, NORMAL_X], around.sides[s, NORMAL_Y], around.sides[s, OFFSET]
        for k in range(len(plan)):
            if x * plan[k, X] + y * plan[k, Y] > offset - limits.wall_m:
                return False
    for w in range(len(around.walls)):
        a = complex(around.walls[w, 0], around.walls[w, 1])
        b = complex(around.walls[w, 2], around.walls[w, 3])
        for k in range(1, len(plan)):
            before, after = complex(plan[k - 1, X], plan[k - 1, Y]), complex(plan[k, X], plan[k, Y])
            if apart_squared(before, after, a, b) < limits.wall_m * limits.wall_m:
                return False
    return True


@kernel
def borders_near(start: Floats, around: AreaBorders, limits: PlanLimits, samples: int) -> AreaBorders:
    """Return the borders that plans of so many samples from a start (5,) may come near to."""
    reach_m = limits.wall_m + limits.speed_max_mps * STEP_S * samples
    here, count = complex(start[X], start[Y]), 0
    near = np.empty(len(around.walls), np.int64)
    for w in range(len(around.walls)):
        a = complex(around.walls[w, 0], around.walls[w, 1])
        b = complex(around.walls[w, 2], around.walls[w, 3])
        if off_squared(here, a, b) <= reach_m * reach_m:
            near[count] = w
            count += 1
    return AreaBorders(around.sides, around.walls[near[:count]])


@kernel
def closest_plans_m(claims: Claims) -> float:
    """Return the least distance (m) of two robots' plans from now on; inf for a single robot."""
    plans, owners = claims
    least = math.inf
    for i in range(len(plans)):
        for j in range(i):
            if owners[i] >= 0 and owners[j] >= 0 and owners[i] != owners[j]:
                least = min(least, apart_squared_of(plans[i], plans[j], 0.0))
    return math.sqrt(least)


@kernel
def primitive(now: Floats, number: int, bearing: float, limits: PlanLimits) -> tuple[float, float]:
    """Return the speed (m/s) and the yaw rate (rad/s) of a primitive.

    Args:
        now: (5,) sample at which the plan may differ.
        number: Less than PRIMITIVES.
        bearing: Bearing to which the last of the rates turns (rad).
        limits: Limits.
    """
    period_s = limits.drive_steps * STEP_S
    low = max(now[SPEED] - limits.acceleration_mps2 * period_s, 0.0)
    high = min(now[SPEED] + limits.acceleration_mps2 * period_s, limits.speed_max_mps)
    speed = low + (high - low) * (number % SPEEDS) / (SPEEDS - 1)
    fastest = max(now[SPEED], speed, 1e-3)
    turn, most = number // SPEEDS, min(limits.yaw_rate_max_radps, limits.lateral_acceleration_mps2 / fastest)
    if turn < RATES - 1:
        return speed, most * (2.0 * turn / (RATES - 2) - 1.0)
    return speed, min(max(wrapped(bearing - now[HEADING]) / period_s, -most), most)


@kernel
def choose(
    claims: Claims, who: int, into: int, aim: complex, stops: bool, around: AreaBorders, limits: PlanLimits
) -> tuple[float, float]:
    """Choose the plan nearest to a robot's aim that keeps apart from all plans of others and from walls.

    Args:
        claims: Plans of all robots.
        who: Number of the robot.
        into: Where to put the plan; nothing is put there if none is permitted.
        aim: Wished velocity (m/s), or the goal (m) to which it is to come to rest as near as possible.
        stops: Whether the aim is a goal.
        around: Borders of the area.
        limits: Limits.

    Returns:
        Change of the speed (m/s) and of the yaw rate (rad/s) at the end of the period, against the plan nearest to the
        aim.
    """
    plans, owners = claims
    trial, costs = plans[who].copy(), np.empty(PRIMITIVES)
    near = borders_near(trial[0], around, limits, len(trial))
    begin, end, chosen = trial[limits.lead_steps], limits.lead_steps + limits.drive_steps, who
    speed_mps, rate_radps, first = 0.0, 0.0, True
    toward = aim - complex(begin[X], begin[Y]) if stops else aim
    bearing = math.atan2(toward.imag, toward.real)
    for number in range(PRIMITIVES):
        speed, rate = primitive(begin, number, bearing, limits)
        roll_out(trial, speed, rate, limits, len(trial) if stops else end + 1)
        costs[number] = _of_rest(trial, aim) if stops else _of_motion(trial[end], aim, bearing)
        costs[number] += _CALM * abs(rate)
    for number in np.argsort(costs, kind="mergesort"):
        speed, rate = primitive(begin, number, bearing, limits)
        roll_out(trial, speed, rate, limits, len(trial))
        if first:
            speed_mps, rate_radps, first = trial[end, SPEED], trial[end, YAW_RATE], False
        if first_conflict(trial, who, claims, limits) < 0 and clear_of_walls(trial, near, limits):
            plans[into], owners[into], chosen = trial, who, into
            break
    return plans[chosen, end, SPEED] - speed_mps, plans[chosen, end, YAW_RATE] - rate_radps


@kernel
def blocker(claims: Claims, who: int, wish: complex, around: AreaBorders, limits: PlanLimits) -> int:
    """Return the robot that keeps another from the plan nearest to its wish; −1: none.

    Args:
        claims: Plans of all robots.
        who: Number of the robot that is kept.
        wish: Wished velocity (m/s).
        around: Borders of the area.
        limits: Limits.
    """
    alone = Claims(claims.plans[who : who + 1].copy(), np.zeros(1, np.int64))
    choose(alone, 0, 0, wish, False, around, limits)
    return int(first_conflict(alone.plans[0], who, claims, limits))


@kernel
def _of_motion(end: Floats, wish: complex, bearing: float) -> float:
    """Return the cost of a primitive that ends its period with a sample (5,), against a wished velocity (m/s)."""
    off_mps = abs(wish - unit(end[HEADING]) * end[SPEED])
    return float(off_mps + _OFF_HEADING * abs(wrapped(bearing - end[HEADING])))


@kernel
def _of_rest(plan: Floats, goal: complex) -> float:
    """Return the cost of a plan (m, 5) for a robot that is to come to rest at a goal (m)."""
    end = plan[len(plan) - 1]
    left = goal - complex(end[X], end[Y])
    off = wrapped(math.atan2(left.imag, left.real) - end[HEADING])
    return abs(left) * (1.0 + _FACING * (1.0 - math.cos(off)))


@kernel
def avoiding(places: Complexes, velocities: Complexes, who: int, wish: complex, limits: PlanLimits) -> complex:
    """Return the velocity (m/s) near to a wish that leads into nobody soon, by sampled velocity obstacles.

    Args:
        places: (n,) of all robots (m).
        velocities: (n,) that they have last chosen (m/s).
        who: Number of the robot.
        wish: Its wished velocity (m/s).
        limits: Limits.
    """
    size = abs(wish)
    if size == 0.0:
        return 0j
    ahead = wish / size
    best, least = 0j, size + _soon(places, velocities, who, 0j, limits)
    for speed in range(_FRACTIONS):
        for direction in range(_DIRECTIONS):
            tried = ahead * unit(math.tau * direction / _DIRECTIONS) * (size * (speed + 1) / _FRACTIONS)
            left = max((ahead.conjugate() * tried).imag, 0.0)
            cost = abs(tried - wish) + _LEFT * left
            if cost < least:
                cost += _soon(places, velocities, who, tried, limits)
            if cost < least:
                best, least = tried, cost
    return best


@kernel
def _soon(places: Complexes, velocities: Complexes, who: int, tried: complex, limits: PlanLimits) -> float:
    """Return the cost of the first collision that a velocity (m/s) leads to."""
    first_s, square = _HORIZON_S, limits.apart_m * limits.apart_m
    for j in range(len(places)):
        off, toward = places[j] - places[who], tried - velocities[j]
        closing = off.real * toward.real + off.imag * toward.imag
        if j == who or closing <= 0.0:
            continue
        speed_squared = toward.real * toward.real + toward.imag * toward.imag
        too_far = off.real * off.real + off.imag * off.imag - square
        under = closing * closing - speed_squared * too_far
        if under > 0.0:
            first_s = min(first_s, max((closing - math.sqrt(under)) / speed_squared, _AT_ONCE_S))
    return _SOONER_M * (1.0 / first_s - 1.0 / _HORIZON_S)

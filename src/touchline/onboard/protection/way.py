"""Way to come: the poses through which the robot is about to drive, and the speed that the clearance there allows.

A thing at distance c from the body at a pose may be touched once v_h·t, the way that it can move in the time t since it
was seen, is as long as c. So a speed is allowed if, at every pose up to where the robot would stop, it has gone by or
stands before that time. The clearances are measured once for each scan; what they allow is worked out in every tick.

Ways are measured in metres along the path; in turns on the spot, at a lever from the origin.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from touchline.core.angles import wrapped
from touchline.core.jit import kernel
from touchline.onboard import filter_model as m
from touchline.onboard import tracking_state as tracking
from touchline.onboard.computer_state import Computer, WayState
from touchline.onboard.drives import onboard_drive
from touchline.onboard.estimation.filter_tick import speed_now_mps
from touchline.onboard.interface import TICK_S
from touchline.onboard.protection.stopping import (
    CREPT_MPS,
    StopFigures,
    latest_at,
    speed_to_stop_in,
    stopping_m,
)
from touchline.onboard.trajectory.path_projection import LegArrays, piece_at, pose_on

Floats = NDArray[np.float64]

# Kinds of ways.
NOT_LAID: Final = 0
ALONG_LEG: Final = 1
TURN: Final = 2
STRAIGHT: Final = 3

# Reasons why the robot may not move.
CLEAR: Final = 0
IN_THE_WAY: Final = 1
SILENT: Final = 2

DOUBTFUL_MPS: Final = 0.3
"""Speed at which the robot passes what may be ground."""
_CREEPS_MPS: Final = 0.03
"""Allowed speed below which a robot that stands does not move on."""
OFF_AGAIN_M: Final = 0.05
"""Clearance from things that may move, beyond what is needed and the error of hits, at which the robot comes to rest as
planned: at the limit the noise of hits would not let it drive away again."""
_SWING_M: Final = 0.02
"""Distance by which a robot that leaves a thing, or stood beside it, may come nearer: its nose swings, and scans have
noise."""
_WRONG_M: Final = 0.05
"""Distance from things from which on it may come no nearer at all: as much may returns be wrong."""
_LEFT_M: Final = 0.1
"""Distance that it is farther away then."""
_NEAR_SHARE: Final = 0.4
"""Poses are closer together near the robot: there their distance is this share of the mean."""
_EXACT_M: Final = 1e-6
"""Rounding of clearances and ways."""


@kernel
def _begin(computer: Computer, kind: int, sense: float, start: float, horizon: float) -> None:
    """Begin a way at the robot's present pose."""
    c = computer[0]
    way, pose = c.way, c.filter.states[c.times.tick % m.RING]
    way.kind, way.sense, way.start = kind, sense, start
    last = len(way.ahead_m) - 1
    for j in range(last + 1):
        share = j / last
        way.ahead_m[j] = horizon * share * (_NEAR_SHARE + (1.0 - _NEAR_SHARE) * share)
    way.east_m[0], way.north_m[0], way.heading_rad[0] = pose[m.EAST], pose[m.NORTH], pose[m.HEADING]


@kernel
def lay_along_leg(computer: Computer, leg: LegArrays, sense: float, back: bool) -> None:
    """Lay the way along a leg of the path; beyond its end it goes straight on.

    Args:
        computer: (1,) whose way is laid.
        leg: Arrays of the leg.
        sense: +1 if the leg is driven forward, −1 if backward.
        back: True if the robot returns along it.
    """
    state, way = computer[0].leg, computer[0].way
    along = -1.0 if back else 1.0
    _begin(computer, ALONG_LEG, along, state.arc_m, way.horizon_m)
    piece, turn = state.piece, 0.0
    for j in range(1, len(way.ahead_m)):
        s = state.arc_m + along * way.ahead_m[j]
        piece = piece_at(leg.pieces, piece, s)
        way.east_m[j], way.north_m[j], heading = pose_on(leg.pieces, sense, piece, s)
        if j == 1:  # the same heading as the estimate's, which may be some full turns away
            turn = wrapped(heading - way.heading_rad[0]) - (heading - way.heading_rad[0])
        way.heading_rad[j] = heading + turn


@kernel
def lay_turn(computer: Computer, angle_rad: float) -> None:
    """Lay the way of a turn on the spot.

    Args:
        computer: (1,) whose way is laid.
        angle_rad: Angle that is left.
    """
    c = computer[0]
    way, heading = c.way, c.filter.states[c.times.tick % m.RING][m.HEADING]
    sense = math.copysign(1.0, angle_rad)
    _begin(computer, TURN, sense, heading, min(way.horizon_m, abs(angle_rad) * way.lever_m + CREPT_MPS))
    for j in range(1, len(way.ahead_m)):
        way.east_m[j], way.north_m[j] = way.east_m[0], way.north_m[0]
        way.heading_rad[j] = heading + sense * way.ahead_m[j] / way.lever_m


@kernel
def lay_straight(computer: Computer) -> None:
    """Lay the way straight ahead.

    Args:
        computer: (1,) whose way is laid.
    """
    way = computer[0].way
    _begin(computer, STRAIGHT, 1.0, 0.0, way.horizon_m)
    cos, sin = math.cos(way.heading_rad[0]), math.sin(way.heading_rad[0])
    for j in range(1, len(way.ahead_m)):
        way.east_m[j] = way.east_m[0] + cos * way.ahead_m[j]
        way.north_m[j] = way.north_m[0] + sin * way.ahead_m[j]
        way.heading_rad[j] = way.heading_rad[0]


@kernel
def _nearest_m(way: WayState) -> float:
    """Return the distance from the nearest thing to the body where it is."""
    nearest_m: float = min(way.clear_m[0], way.standing_m[0]) + way.slack_m[0]
    return nearest_m


@kernel
def _needed_m(way: WayState, j: int, off_m: float) -> float:
    """Return the clearance that is needed at a pose from things that stand.

    A robot that is nearer than that already may move as long as it does not come nearer still, or hardly nearer than it
    stood: where it is, its distance from the path is measured with the rest.
    """
    nearest_m = min(_nearest_m(way), max(way.stood_m - _SWING_M, _WRONG_M))
    needed_m: float = min(way.margin_m + way.error_m + off_m, nearest_m - way.slack_m[j])
    return needed_m


@kernel
def _before_m(way: WayState, j: int, off_m: float) -> float:
    """Return the way up to which the robot may come before a pose that it may not reach.

    One that is nearer to something than it may be stops at the pose before: half of the way to the next one in each
    scan would be a creep into contact.
    """
    before_m: float = way.ahead_m[max(j - 1, 0)]
    if _nearest_m(way) >= way.margin_m + way.error_m + off_m:
        before_m = 0.5 * (before_m + way.ahead_m[j])
    return before_m


@kernel
def _stopping(way: WayState) -> StopFigures:
    return StopFigures(way.reaction_s, way.braking_mps2, way.creep_s, way.braking_mps2 * way.lag_s)


@kernel
def _ends_m(way: WayState, j: int) -> tuple[float, float]:
    """Return the stretch of the way for which a pose stands: half of the way to the one before, and to the next."""
    before, after = max(j - 1, 0), min(j + 1, len(way.ahead_m) - 1)
    return 0.5 * (way.ahead_m[before] + way.ahead_m[j]), 0.5 * (way.ahead_m[j] + way.ahead_m[after])


@kernel
def _allowed_mps(way: WayState, travelled_m: float, off_m: float, age_s: float) -> float:
    """Return the highest speed [m/s] from which the robot stops without touching what may be there until then.

    A speed that a pose does not allow is lowered to the one with which the robot stops before that pose, or is at rest
    in time, whichever is higher; so each pose lowers it once at most.

    Args:
        way: Way with its clearances.
        travelled_m: Way that the robot has gone since.
        off_m: Distance of the body from the poses.
        age_s: Time since the hits were measured.
    """
    v, last, lowered = way.fastest_mps, len(way.ahead_m) - 1, True
    stopping = _stopping(way)
    most_s = age_s + stopping.reaction_s + v / stopping.braking_mps2 + stopping.creep_s
    unhindered = way.fixed_room_m >= off_m and way.room_m >= off_m + way.thing_mps * most_s
    if unhindered and travelled_m + stopping_m(v, stopping) <= way.ahead_m[last]:
        return v
    while lowered and v > 0.0:
        lowered = False
        reach_m = travelled_m + stopping_m(v, stopping)
        if reach_m > way.ahead_m[last] + _EXACT_M:
            v, lowered = speed_to_stop_in(way.ahead_m[last] - travelled_m, stopping), True
            continue
        for j in range(last + 1):
            near_m, far_m = _ends_m(way, j)
            if near_m > reach_m - _EXACT_M and j > 0:
                break
            if far_m < travelled_m:
                continue
            needed_m = _needed_m(way, j, off_m)
            room_m, fixed = way.clear_m[j] - needed_m, way.standing_m[j] < needed_m - _EXACT_M
            by_s = latest_at(far_m - travelled_m, v, stopping)
            if not fixed and room_m >= way.thing_mps * (age_s + by_s) - _EXACT_M:
                continue
            slower = speed_to_stop_in(_before_m(way, j, off_m) - travelled_m, stopping) if j > 0 else 0.0
            if way.thing_mps > 0.0 and not fixed:
                left_s = room_m / way.thing_mps - age_s - stopping.reaction_s - stopping.creep_s
                slower = max(slower, stopping.braking_mps2 * left_s)
            if slower < v:
                v, lowered = max(slower, 0.0), True
                break
    return v


@kernel
def _motion(computer: Computer) -> tuple[float, float, float]:
    """Return the way that the robot has gone since the way was laid, its speed, and its distance from the poses."""
    c = computer[0]
    way, x = c.way, c.filter.states[c.times.tick % m.RING]
    if way.kind == TURN:
        speed = way.sense * x[m.YAW_RATE] * way.lever_m
        return way.sense * (x[m.HEADING] - way.start) * way.lever_m, speed, 0.0
    speed = speed_now_mps(computer)
    if way.kind == ALONG_LEG:
        now = c.leg.now
        off_m = abs(now[tracking.LATERAL]) + way.radius_m * abs(now[tracking.HEADING_ERROR])
        # The arc length is that of the tick before.
        return way.sense * (c.leg.arc_m - way.start) + abs(speed) * TICK_S, abs(speed), off_m
    east, north, turned = x[m.EAST] - way.east_m[0], x[m.NORTH] - way.north_m[0], x[m.HEADING] - way.heading_rad[0]
    cos, sin = math.cos(way.heading_rad[0]), math.sin(way.heading_rad[0])
    # The robot turns by this, too, until it has stopped to turn.
    rate = abs(x[m.YAW_RATE])
    turned = abs(turned) + rate * (2.0 * TICK_S + way.lag_s + 0.5 * rate * way.lever_m / way.braking_mps2)
    off_m = abs(cos * north - sin * east) + way.radius_m * turned
    return cos * east + sin * north, abs(speed), off_m


@kernel
def _leaves(way: WayState) -> bool:
    """Return whether the way leads away from what is near, without coming nearer before than a nose swings."""
    now_m = way.clear_m[0] + way.slack_m[0]
    for j in range(1, len(way.ahead_m)):
        there_m = way.clear_m[j] + way.slack_m[j]
        if there_m < now_m - _SWING_M:
            return False
        if there_m > now_m + _LEFT_M:
            return True
    return False


@kernel
def _note_rest(way: WayState, speed_mps: float, off_m: float) -> None:
    """Note how near to things the robot stands, until it is as far away as it has to be."""
    nearest_m = _nearest_m(way)
    if abs(speed_mps) < CREPT_MPS:
        way.stood_m = nearest_m
    elif nearest_m >= way.margin_m + way.error_m + off_m:
        way.stood_m = math.inf


@kernel
def find_stop(computer: Computer) -> None:
    """Find the place up to which the robot may come to rest with hits as old as they get, and the least room.

    They are `stop_m`, `room_m` and `fixed_room_m`; `stood_m` is updated, too.

    Args:
        computer: (1,) whose clearances are measured; updated.
    """
    way = computer[0].way
    _, speed_mps, off_m = _motion(computer)
    _note_rest(way, speed_mps, off_m)
    grown_m = way.thing_mps * (way.late_ticks * TICK_S + way.reaction_s + way.creep_s)
    now_m = way.clear_m[0] + way.slack_m[0] - _EXACT_M
    kept_m = max(way.margin_m + way.error_m + grown_m, now_m - _SWING_M) - _EXACT_M
    leaves = way.thing_mps > 0.0 and _leaves(way)
    way.stop_m = way.room_m = way.fixed_room_m = math.inf
    for j in range(len(way.ahead_m)):
        needed_m = _needed_m(way, j, off_m) - _EXACT_M
        nearer = way.thing_mps > 0.0 and way.clear_m[j] + way.slack_m[j] < now_m
        passes = leaves and way.clear_m[j] + way.slack_m[j] >= kept_m and way.standing_m[j] >= needed_m
        if math.isinf(way.stop_m) and not passes:
            if way.clear_m[j] < needed_m + grown_m or way.standing_m[j] < needed_m:
                way.stop_m = _before_m(way, j, off_m)
            elif nearer and way.clear_m[j] < needed_m + grown_m + way.error_m + OFF_AGAIN_M:
                way.stop_m = way.ahead_m[j - 1]
        needed_m = _needed_m(way, j, 0.0) - _EXACT_M
        way.room_m = min(way.room_m, way.clear_m[j] - needed_m)
        way.fixed_room_m = min(way.fixed_room_m, way.standing_m[j] - needed_m)


@kernel
def watch_way(computer: Computer) -> None:
    """Work out what the clearance along the way allows in this tick: `limit_mps`, `cap_mps` and `blocked`.

    The reference slows down to where the robot may come to rest as planned braking can, and to what will still be
    allowed when the hits are as old as they get: so it stays clear of the cap, unless something comes up.

    Args:
        computer: (1,) whose estimator has seen the tick; its way and the limit of its leg are updated.
    """
    c = computer[0]
    way = c.way
    age = c.times.tick - way.scan_tick
    if age > way.silent_ticks or way.kind == NOT_LAID:
        way.limit_mps, way.cap_mps, way.blocked = 0.0, 0.0, SILENT if age > way.silent_ticks else IN_THE_WAY
        c.leg.limit_mps = 0.0
        return
    travelled_m, speed, off_m = _motion(computer)
    limit = _allowed_mps(way, travelled_m, off_m, max(age, way.late_ticks) * TICK_S)
    way.cap_mps, way.blocked = limit, CLEAR
    if limit < way.fastest_mps and age < way.late_ticks:
        way.cap_mps = _allowed_mps(way, travelled_m, off_m, age * TICK_S)
    slowing_m, passing_m = max(way.stop_m - travelled_m, 0.0), max(way.slow_m - travelled_m, 0.0)
    way.limit_mps = min(
        limit,
        math.sqrt(2.0 * way.planned_mps2 * slowing_m),
        math.sqrt(2.0 * way.planned_mps2 * passing_m + DOUBTFUL_MPS * DOUBTFUL_MPS),
    )
    if way.cap_mps < CREPT_MPS or (way.limit_mps < _CREEPS_MPS and speed < CREPT_MPS):
        way.blocked = IN_THE_WAY
    c.leg.limit_mps = way.free_mps if way.limit_mps >= way.fastest_mps else way.limit_mps


@kernel
def measure_zones(computer: Computer, slow_m: Floats) -> float:
    """Measure how near to the way to come a thing that may move stops the robot, and slows it down.

    It is slowed down by what is in reach of the poses up to where it would be at rest if it began to brake as planned,
    as in `find_stop`, or to stop, as its speed is allowed in `watch_way`.

    Args:
        computer: (1,) whose way is laid.
        slow_m: (poses,) filled in: the distance from the body at each pose; 0 where the way is too far ahead.

    Returns:
        The distance from the body, where it is now, within which a thing stops it.
    """
    c = computer[0]
    way = c.way
    travelled_m, speed, off_m = _motion(computer)
    stopping, age_s = _stopping(way), max(c.times.tick - way.scan_tick, way.late_ticks) * TICK_S
    fixed_m = way.margin_m + way.error_m + off_m
    stop_m: float = fixed_m + way.thing_mps * (way.late_ticks * TICK_S + way.reaction_s + way.creep_s)
    planned_m, braked_m = speed * speed / (2.0 * way.planned_mps2), stopping_m(speed, stopping)
    for j in range(len(way.ahead_m)):
        near_m, far_m = _ends_m(way, j)
        slow_m[j] = 0.0
        if far_m < travelled_m:
            continue
        if near_m <= travelled_m + planned_m:
            slow_m[j] = stop_m
        if near_m <= travelled_m + braked_m:
            slow_m[j] = max(
                slow_m[j], fixed_m + way.thing_mps * (age_s + latest_at(far_m - travelled_m, speed, stopping))
            )
    return stop_m


@kernel
def _sense(way: WayState) -> float:
    """Return the sign of the speed at which the robot drives along a way, or of the yaw rate at which it turns."""
    if way.kind == TURN:
        return float(way.sense)
    cos, sin = math.cos(way.heading_rad[1]), math.sin(way.heading_rad[1])
    return math.copysign(1.0, cos * (way.east_m[2] - way.east_m[1]) + sin * (way.north_m[2] - way.north_m[1]))


@kernel
def hold_to_cap(drive: Any, computer: Computer, actuators: Floats) -> None:
    """Lower commands that are faster than the cap, along the same circle, but never brake harder than a stop does.

    Against the way a robot only creeps, if it may move at all: nothing is known of the clearance there.

    Args:
        drive: Parameters of the drive.
        computer: (1,) whose way has been watched in this tick.
        actuators: (actuators,) commands, updated.
    """
    c = computer[0]
    way, now = c.way, c.leg.now
    speed, rate = onboard_drive.twist(drive, actuators, now)
    wanted, moves = (rate * way.lever_m, now[tracking.YAW_RATE] * way.lever_m)
    if way.kind != TURN:
        wanted, moves = speed, now[tracking.SPEED]
    share, sense = 1.0, _sense(way)
    most = max(way.cap_mps, abs(moves) - way.lead_mps)
    if way.kind != NOT_LAID and sense * wanted < -CREPT_MPS:
        braking, creeps = abs(moves) - way.lead_mps, min(CREPT_MPS, way.cap_mps)
        share = (math.copysign(braking, sense * moves) if braking > creeps else -creeps) / (sense * wanted)
    elif abs(wanted) > most:
        share = most / abs(wanted)
    if share < 1.0:
        slower = onboard_drive.actuators_of(drive, speed * share, rate * share, now)
        for i in range(len(actuators)):
            actuators[i] = slower[i]

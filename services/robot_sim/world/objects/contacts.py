"""Contacts of the robot's outline with things, in every step of the physics.

A step solves for the impulses that keep the outline and what is near it apart: along each normal no faster together
than the gap closes in a step, across it Coulomb's friction, by sequential impulses (E. Catto, "Iterative dynamics with
temporal coherence", GDC 2005). As the gap is looked at before it is closed, nothing gets in, however fast. Contacts are
plastic. The wheels feel the ground through the drive's own model and slip or stall.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import borrowing
from touchline.onboard.interface import TICK_S
from touchline.services.robot_sim.world.body import STEP_S, BodyFigures, BodyState
from touchline.services.robot_sim.world.objects.moving import hurry, move_on, walk
from touchline.services.robot_sim.world.objects.things import (
    C_CLOSING_MPS,
    C_EAST,
    C_ENERGY_J,
    C_NORTH,
    C_ROBOT_MPS,
    C_THING,
    EAST,
    EAST_MPS,
    F_BOUND,
    F_EAST,
    F_NORTH,
    F_RADIUS,
    M_MASS,
    M_RADIUS,
    M_SOFT,
    MOST_NEW,
    NEAR_FIXED,
    NEAR_MOVERS,
    NEW_CONTACTS,
    NORTH,
    NORTH_MPS,
    PINNED_EAST,
    PINNED_NORTH,
    PUSHED,
    TOUCHED,
    Things,
)

Floats = NDArray[np.float64]

STANDING_MPS: Final = 0.02
"""Below this speed the robot stands."""

_FRICTION: Final = 0.4
_ROUNDS: Final = 10
_RECOVERY_MPS: Final = 0.3  # at most so fast does the robot leave what it was put into
_MARGIN_M: Final = 0.05
_TOUCHING_M: Final = 0.02  # more than anything closes in a step
_GAIN_MPS: Final = 0.2  # gain of speed in a tick, but for blows, for which there is the margin
_APART_TICKS: Final = 50  # a touch so long after the last one is another contact
_PUSH_TICKS: Final = 100  # for so long the robot moves by the push of what has run into it, and springs back

# Columns of a contact point.
_P_X: Final = 0  # place relative to the centre of mass, map frame
_P_Y: Final = 1
_P_NX: Final = 2  # normal, from the robot to the thing
_P_NY: Final = 3
_P_LEAST: Final = 4  # least speed apart along the normal
_P_INVERSE: Final = 5  # inverse mass of the thing along the normal
_P_NORMAL: Final = 6  # impulse along the normal so far, and across it
_P_ACROSS: Final = 7
_P_THING: Final = 8
_P_ARC: Final = 9  # way along the outline
_P_CLOSING: Final = 10  # speed together and speed of the robot before the impulses
_P_ROBOT: Final = 11
POINT_COLUMNS: Final = 12
MOST_POINTS: Final = 64


@borrowing
def look_round(things: Things, state: BodyState) -> None:
    """List what is within reach of the robot in a tick, and move on what is not.

    Args:
        things: Marks and the list are updated, and movers out of reach.
        state: State of the robot's body at the start of the tick.
    """
    marks, fixed, movers, near = things.marks, things.fixed, things.movers, things.near
    marks[NEW_CONTACTS] = marks[TOUCHED] = 0
    for strip in range(len(things.pressed_n)):
        things.pressed_n[strip] = 0.0
    turning = things.reach_m * abs(state.yaw_rate_radps)
    speed = math.sqrt(state.speed_mps * state.speed_mps + state.side_speed_mps * state.side_speed_mps) + turning
    travel = (speed + _GAIN_MPS) * TICK_S
    count = 0
    things.clear[0] -= travel
    if things.clear[0] <= 0.0:
        clear = math.inf
        for i in range(len(fixed)):
            east, north = fixed[i, F_EAST] - state.east_m, fixed[i, F_NORTH] - state.north_m
            gap = math.sqrt(east * east + north * north) - fixed[i, F_BOUND] - things.reach_m - travel - _MARGIN_M
            clear = min(clear, gap)
            if gap <= 0.0:
                near[count] = i
                count += 1
        things.clear[0] = clear
    marks[NEAR_FIXED] = count
    for i in range(len(movers)):
        east, north = movers[i, EAST] - state.east_m, movers[i, NORTH] - state.north_m
        own = math.hypot(movers[i, EAST_MPS], movers[i, NORTH_MPS]) * TICK_S
        reach = things.reach_m + travel + _MARGIN_M + own + things.figures[i, M_RADIUS]
        if east * east + north * north <= reach * reach:
            near[count] = i
            count += 1
        else:
            walk(things, i, TICK_S)
    marks[NEAR_MOVERS] = count - marks[NEAR_FIXED]


@borrowing
def _nearest(corners: Floats, first: int, end: int, x: float, y: float) -> tuple[float, float, float, int, float]:
    """Find the point of an outline nearest to a point.

    Args:
        corners: (n, 2 or more) corners, counter-clockwise.
        first: First corner of the outline.
        end: Corner after its last.
        x: The point, with `y`, in the same frame.
        y: See `x`.

    Returns:
        Distance, negative inside; unit vector out of the outline there; the edge's first corner, and the share of the
        edge at which it is.
    """
    best, best_edge, best_share, inside = math.inf, first, 0.0, False
    best_x, best_y = 0.0, 0.0
    for i in range(first, end):
        j = i + 1 if i + 1 < end else first
        ax, ay, bx, by = corners[i, 0], corners[i, 1], corners[j, 0], corners[j, 1]
        ex, ey, wx, wy = bx - ax, by - ay, x - ax, y - ay
        share = min(max((wx * ex + wy * ey) / (ex * ex + ey * ey), 0.0), 1.0)
        dx, dy = wx - share * ex, wy - share * ey
        square = dx * dx + dy * dy
        if square < best:
            best, best_edge, best_share, best_x, best_y = square, i, share, dx, dy
        if (ay > y) != (by > y) and wx < ex * wy / ey:
            inside = not inside
    distance = math.sqrt(best)
    if distance > 1e-9:
        sign = -1.0 if inside else 1.0
        return sign * distance, sign * best_x / distance, sign * best_y / distance, best_edge, best_share
    j = best_edge + 1 if best_edge + 1 < end else first
    ex, ey = corners[j, 0] - corners[best_edge, 0], corners[j, 1] - corners[best_edge, 1]
    length = math.sqrt(ex * ex + ey * ey)
    return 0.0, ey / length, -ex / length, best_edge, best_share


@borrowing
def _arc(outline: Floats, edge: int, share: float) -> float:
    """Return the way along the robot's outline to a point of it [m]."""
    arc: float = outline[edge, 2] + share * (outline[edge, 3] - outline[edge, 2])
    return arc


@borrowing
def _enter(
    points: Floats,
    count: int,
    place: tuple[float, float, float, float],
    gap: float,
    inverse: float,
    thing: int,
    arc: float,
) -> int:
    """Enter a contact point, place and normal, if it may touch within a step; return their number."""
    if gap > _TOUCHING_M or count >= len(points):
        return count
    point = points[count]
    point[_P_X], point[_P_Y], point[_P_NX], point[_P_NY] = place
    point[_P_LEAST] = -gap / STEP_S if gap > 0.0 else min(-0.2 * gap / STEP_S, _RECOVERY_MPS)
    point[_P_INVERSE], point[_P_NORMAL], point[_P_ACROSS] = inverse, 0.0, 0.0
    point[_P_THING], point[_P_ARC] = thing, arc
    return count + 1


@borrowing
def _disc_point(
    things: Things,
    count: int,
    pose: tuple[float, float, float, float],
    disc: tuple[float, float, float],
    inverse: float,
    thing: int,
) -> int:
    """Enter the point at which a disc may touch the outline; return the number of points."""
    outline, (east, north, cos, sin) = things.outline, pose
    wx, wy = disc[0] - east, disc[1] - north
    x, y = cos * wx + sin * wy, cos * wy - sin * wx
    distance, nx, ny, edge, share = _nearest(outline, 0, len(outline), x, y)
    px, py = x - distance * nx - things.centre_x_m, y - distance * ny
    place = (cos * px - sin * py, sin * px + cos * py, cos * nx - sin * ny, sin * nx + cos * ny)
    arc = _arc(outline, edge, share)
    entered: int = _enter(things.contacts, count, place, distance - disc[2], inverse, thing, arc)
    return entered


@borrowing
def _outline_points(things: Things, count: int, pose: tuple[float, float, float, float], thing: int) -> int:
    """Enter the points at which a fixed outline may touch that of the robot; return the number of points."""
    outline, vertices, (east, north, cos, sin) = things.outline, things.vertices, pose
    first, end = things.first[thing], things.first[thing + 1]
    for i in range(len(outline)):
        x, y = outline[i, 0], outline[i, 1]
        distance, nx, ny, _, _ = _nearest(vertices, first, end, east + cos * x - sin * y, north + sin * x + cos * y)
        px = x - things.centre_x_m
        place = (cos * px - sin * y, sin * px + cos * y, -nx, -ny)
        count = _enter(things.contacts, count, place, distance, 0.0, thing, outline[i, 2])
    for i in range(first, end):
        count = _disc_point(things, count, pose, (vertices[i, 0], vertices[i, 1], 0.0), 0.0, thing)
    return count


@borrowing
def _gather(things: Things, state: BodyState) -> int:
    """Enter all points at which something may touch the robot in a step; return their number."""
    cos, sin = math.cos(state.heading_rad), math.sin(state.heading_rad)
    pose = (state.east_m, state.north_m, cos, sin)
    count, fixed, marks = 0, things.marks[NEAR_FIXED], things.marks
    for place in range(fixed):
        i = things.near[place]
        thing = things.fixed[i]
        if thing[F_RADIUS] > 0.0:
            disc = (thing[F_EAST], thing[F_NORTH], thing[F_RADIUS])
            count = _disc_point(things, count, pose, disc, 0.0, i)
        else:
            count = _outline_points(things, count, pose, i)
    for place in range(fixed, fixed + marks[NEAR_MOVERS]):
        i = things.near[place]
        mover, figures = things.movers[i], things.figures[i]
        before = count
        disc = (mover[EAST], mover[NORTH], figures[M_RADIUS])
        count = _disc_point(things, count, pose, disc, 1.0 / figures[M_MASS], len(things.fixed) + i)
        if count > before:
            point = things.contacts[before]
            if point[_P_NX] * mover[PINNED_EAST] + point[_P_NY] * mover[PINNED_NORTH] < -0.1:
                point[_P_INVERSE] = 0.0  # something fixed is behind it
    return count


@borrowing
def _apart(things: Things, point: Floats, motion: Floats, x: float, y: float) -> float:
    """Return the speed of a contact's thing less that of the robot along a direction [m/s]."""
    robot = (motion[0] - motion[2] * point[_P_Y]) * x + (motion[1] + motion[2] * point[_P_X]) * y
    mover = int(point[_P_THING]) - len(things.fixed)
    thing = 0.0
    if mover >= 0:
        thing = things.movers[mover, EAST_MPS] * x + things.movers[mover, NORTH_MPS] * y
    apart: float = thing - robot
    return apart


@borrowing
def _push(
    things: Things, point: Floats, motion: Floats, inverse: tuple[float, float], x: float, y: float, impulse: float
) -> None:
    """Apply an impulse along a direction to a contact's thing, and the opposite one to the robot."""
    motion[0] -= inverse[0] * impulse * x
    motion[1] -= inverse[0] * impulse * y
    motion[2] -= inverse[1] * impulse * (point[_P_X] * y - point[_P_Y] * x)
    mover = int(point[_P_THING]) - len(things.fixed)
    if mover >= 0:
        things.movers[mover, EAST_MPS] += point[_P_INVERSE] * impulse * x
        things.movers[mover, NORTH_MPS] += point[_P_INVERSE] * impulse * y


@borrowing
def _compliance(point: Floats, inverse: tuple[float, float], x: float, y: float) -> float:
    """Return the change of the speed apart per impulse along a direction [1/kg]."""
    arm = point[_P_X] * y - point[_P_Y] * x
    compliance: float = point[_P_INVERSE] + inverse[0] + inverse[1] * arm * arm
    return compliance


@borrowing
def _solve(things: Things, count: int, inverse: tuple[float, float]) -> None:
    """Change the motion of the robot and of what touches it by the impulses of all contacts."""
    points, motion = things.contacts, things.motion
    for _ in range(_ROUNDS):
        for k in range(count):
            point = points[k]
            nx, ny = point[_P_NX], point[_P_NY]
            lacking = point[_P_LEAST] - _apart(things, point, motion, nx, ny)
            before = point[_P_NORMAL]
            point[_P_NORMAL] = max(before + lacking / _compliance(point, inverse, nx, ny), 0.0)
            _push(things, point, motion, inverse, nx, ny, point[_P_NORMAL] - before)
            sliding = _apart(things, point, motion, -ny, nx)
            before, most = point[_P_ACROSS], _FRICTION * point[_P_NORMAL]
            wanted = before - sliding / _compliance(point, inverse, -ny, nx)
            point[_P_ACROSS] = min(max(wanted, -most), most)
            _push(things, point, motion, inverse, -ny, nx, point[_P_ACROSS] - before)


@borrowing
def _note(things: Things, point: Floats, inverse: tuple[float, float], centre: tuple[float, float], tick: int) -> None:
    """Note a contact in which an impulse has passed: its force, and in the log if it is a new one."""
    marks, thing = things.marks, int(point[_P_THING])
    marks[TOUCHED] = 1
    mover = thing - len(things.fixed)
    if mover < 0 or things.figures[mover, M_SOFT] == 0.0:
        force_n = point[_P_NORMAL] / TICK_S
        things.pressed_n[-1] += force_n
        for s in range(len(things.strips)):
            begin, end = things.strips[s, 0], things.strips[s, 1]
            arc = point[_P_ARC]
            if begin <= arc <= end or (end < begin and (arc >= begin or arc <= end)):
                things.pressed_n[s] += force_n
    last, level = things.touched[thing, 0], things.touched[thing, 1]
    robot, closing = point[_P_ROBOT], point[_P_CLOSING]
    begins = tick - last > _APART_TICKS or last == 0
    pushed = marks[PUSHED] > 0 and tick - marks[PUSHED] < _PUSH_TICKS
    moving = 1 if abs(robot) > STANDING_MPS and (begins or robot > 0.0) and not pushed else 0
    things.touched[thing, 0] = tick
    if level == 0 and robot < -STANDING_MPS and not begins:
        marks[PUSHED] = tick  # by what ran into it: away from that it goes on
    if begins:
        things.touched[thing, 2] = tick
        if moving == 0:
            marks[PUSHED] = tick
    elif moving <= level or marks[NEW_CONTACTS] >= MOST_NEW:
        return
    things.touched[thing, 1] = moving
    if marks[NEW_CONTACTS] >= MOST_NEW:
        return
    row = things.log[marks[NEW_CONTACTS]]
    marks[NEW_CONTACTS] += 1
    row[C_THING], row[C_EAST], row[C_NORTH] = thing, centre[0] + point[_P_X], centre[1] + point[_P_Y]
    row[C_ROBOT_MPS], row[C_CLOSING_MPS] = abs(robot) if moving else 0.0, max(closing, 0.0)
    row[C_ENERGY_J] = 0.5 * max(closing, 0.0) ** 2 / _compliance(point, inverse, point[_P_NX], point[_P_NY])


@borrowing
def _touch(things: Things, state: BodyState, mass: tuple[float, float], tick: int) -> bool:
    """Change the speeds of the robot and of what touches it; return True if an impulse has passed."""
    points, motion = things.contacts, things.motion
    count = _gather(things, state)
    if count == 0:
        return False
    cos, sin, centre_x_m = math.cos(state.heading_rad), math.sin(state.heading_rad), things.centre_x_m
    side = state.side_speed_mps + centre_x_m * state.yaw_rate_radps
    motion[0], motion[1] = cos * state.speed_mps - sin * side, sin * state.speed_mps + cos * side
    motion[2] = state.yaw_rate_radps
    for k in range(count):
        point = points[k]
        nx, ny = point[_P_NX], point[_P_NY]
        point[_P_CLOSING] = -_apart(things, point, motion, nx, ny)
        x, y = motion[0] - motion[2] * point[_P_Y], motion[1] + motion[2] * point[_P_X]
        towards = -1.0 if x * nx + y * ny < STANDING_MPS else 1.0
        point[_P_ROBOT] = towards * math.sqrt(x * x + y * y)
    inverse = (1.0 / mass[0], 1.0 / mass[1])
    _solve(things, count, inverse)
    centre = (state.east_m + cos * centre_x_m, state.north_m + sin * centre_x_m)
    pressed = False
    for k in range(count):
        if points[k, _P_NORMAL] > 0.0:
            pressed = True
            _note(things, points[k], inverse, centre, tick)
    if pressed:
        state.yaw_rate_radps = motion[2]
        state.speed_mps = cos * motion[0] + sin * motion[1]
        state.side_speed_mps = cos * motion[1] - sin * motion[0] - centre_x_m * motion[2]
    return pressed


@borrowing
def press(things: Things, state: BodyState, body: BodyFigures, mass_kg: float, tick: int) -> bool:
    """Let the things within reach move and touch the robot in a step; return True if an impulse has passed.

    Args:
        things: Movers, marks, forces and the log are updated.
        state: State of the robot's body; its speeds are updated.
        body: Constants of the body.
        mass_kg: Mass of the whole robot.
        tick: The tick.
    """
    marks = things.marks
    first, last = marks[NEAR_FIXED], marks[NEAR_FIXED] + marks[NEAR_MOVERS]
    for place in range(first, last):
        hurry(things, things.near[place], STEP_S)
    pressed: bool = _touch(things, state, (mass_kg, mass_kg * body.gyration_m2), tick)
    for place in range(first, last):
        move_on(things, things.near[place], STEP_S)
    return pressed

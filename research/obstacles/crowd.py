"""Crowd round a robot: people who walk at random, aim at the robot, or step out ahead of it.

The robot drives along x with the product's own kernels of protection, or by zones; its actuators have a lag. People are
discs, seen all round as points on their outline. A person who touches the robot is moved away, so that others have
their turn.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.core.random import uniform
from touchline.core.records import Record
from touchline.onboard import filter_model as m
from touchline.onboard.computer_state import Computer, ComputerState
from touchline.onboard.drives.onboard_drive import drive_of
from touchline.onboard.interface import TICK_S
from touchline.onboard.protection.clearance import HitArrays, clearance, measure_clearances
from touchline.onboard.protection.protector import Protector
from touchline.onboard.protection.stopping import CREPT_MPS
from touchline.onboard.protection.way import CLEAR, find_stop, lay_straight, watch_way
from touchline.schemas.vehicles import Vehicle
from touchline_research.obstacles.speed_zones import NO_ZONES, OWN_RULE, SpeedZones, watch_zones

Floats = NDArray[np.float64]

PERSON_M: Final = 0.25
"""Radius of a person."""
PEOPLE: Final = 16
"""Most people in a world."""
OUTLINE: Final = 36
"""Points of a person's outline that the lidar sees."""
SCAN_TICKS: Final = 10
"""Time from scan to scan."""
DELAY_TICKS: Final = 2
"""Time after which a command reaches the actuators: as much as protection allows for."""
WALKER, INTERCEPTOR, STEPPER = range(3)
EIGHT: Final = (WALKER, INTERCEPTOR, STEPPER, WALKER, INTERCEPTOR, STEPPER, INTERCEPTOR, STEPPER)
"""People of whom three aim at the robot and three step out ahead of it."""
_AWAY_M: Final = 4.0
_AHEAD_M, _SIDE_M = 18.0, 6.0  # half the sides of the area round the robot in which people are
_STEP_LIMIT_MPS2: Final = 3.0


class Crowd(Record):
    """People round a robot, and what happened."""

    seed: int
    draws: int
    """Number of random numbers so far."""
    count: int
    kinds: Annotated[NDArray[np.int64], PEOPLE]
    x_m: Annotated[Floats, PEOPLE]
    y_m: Annotated[Floats, PEOPLE]
    course_rad: Annotated[Floats, PEOPLE]
    speed_mps: Annotated[Floats, PEOPLE]
    until_s: Annotated[Floats, PEOPLE]
    """Time at which a walker takes another course, or a stepper steps out."""
    fastest_mps: float
    bias_m: float
    """Distance by which the lidar sees people farther away than they are."""
    blind_rad: float
    """Sector behind the robot that the lidar does not see."""
    lag_s: float
    """Time constant of the true actuators, and their deceleration."""
    braking_mps2: float
    accelerate_mps2: float
    planned_mps: float
    """Speed that it drives at where nothing is in its way."""
    pause_ticks: int
    """Time for which the way has to be clear before the robot drives on after a stop."""
    line_m: float = math.inf
    """Way after which it has arrived."""

    time_s: float
    robot_x_m: float
    robot_mps: float
    command_mps: float
    due_mps: Annotated[Floats, DELAY_TICKS]
    """Commands that have not yet reached the actuators."""
    clear_tick: int
    way_m: float
    """Way that it has driven."""
    moving: int
    """Contacts with the robot in motion, above CREPT_MPS."""
    behind: int
    """Those of them from the blind sector."""
    standing: int
    """Contacts with the robot at rest."""
    closest_m: float = math.inf
    """Least distance of a person while it moved."""


@kernel
def _draw(crowd: Sequence[Crowd], low: float, high: float) -> float:
    """Draw from the uniform distribution between two numbers."""
    crowd[0].draws += 1
    drawn: float = low + (high - low) * uniform(crowd[0].seed, 0, crowd[0].draws, 0)
    return drawn


@kernel
def _place(crowd: Sequence[Crowd], i: int) -> None:
    """Place a person anew, away from the robot and not on its tail."""
    c = crowd[0]
    ahead_m = side_m = 0.0
    while math.hypot(ahead_m, side_m) < _AWAY_M:
        ahead_m, side_m = _draw(crowd, -_AHEAD_M, _AHEAD_M), _draw(crowd, -_SIDE_M, _SIDE_M)
    c.x_m[i], c.y_m[i] = c.robot_x_m + ahead_m, side_m
    c.course_rad[i], c.speed_mps[i] = _draw(crowd, -math.pi, math.pi), _draw(crowd, 0.0, c.fastest_mps)
    c.until_s[i] = c.time_s + _draw(crowd, 0.5, 4.0)


@kernel
def _walk(crowd: Sequence[Crowd], i: int) -> None:
    """Move a person by one tick."""
    c = crowd[0]
    ahead_m, side_m = c.x_m[i] - c.robot_x_m, c.y_m[i]
    if c.kinds[i] == INTERCEPTOR:
        c.course_rad[i], c.speed_mps[i] = math.atan2(-side_m, -ahead_m), c.fastest_mps
    elif c.kinds[i] == WALKER:
        if c.time_s > c.until_s[i]:
            c.course_rad[i], c.speed_mps[i] = (
                _draw(crowd, -math.pi, math.pi),
                _draw(crowd, 0.0, c.fastest_mps),
            )
            c.until_s[i] = c.time_s + _draw(crowd, 0.5, 4.0)
    elif c.time_s > c.until_s[i]:
        # Beside the way ahead first, and then across it.
        side = math.copysign(1.0, side_m)
        if 0.5 < ahead_m < 2.5 and 0.8 < abs(side_m) < 2.0:
            c.course_rad[i], c.speed_mps[i] = -side * 0.5 * math.pi, c.fastest_mps
            c.until_s[i] = c.time_s + _draw(crowd, 1.5, 3.0)
        else:
            c.course_rad[i] = math.atan2(side * 1.4 - side_m, 1.5 - ahead_m)
            c.speed_mps[i] = c.fastest_mps
    if abs(side_m) > _SIDE_M or abs(ahead_m) > _AHEAD_M:
        _place(crowd, i)
        return
    c.x_m[i] += c.speed_mps[i] * math.cos(c.course_rad[i]) * TICK_S
    c.y_m[i] += c.speed_mps[i] * math.sin(c.course_rad[i]) * TICK_S


@kernel
def _see(crowd: Sequence[Crowd], points: Floats) -> int:
    """Fill in the points that the lidar sees; return their number."""
    c = crowd[0]
    seen = 0
    for i in range(c.count):
        ahead_m, side_m = c.x_m[i] - c.robot_x_m, c.y_m[i]
        far_m = math.hypot(ahead_m, side_m)
        if math.pi - abs(math.atan2(side_m, ahead_m)) < 0.5 * c.blind_rad:
            continue
        moved = 1.0 + c.bias_m / max(far_m, 0.01)
        for k in range(OUTLINE):
            at = 2.0 * math.pi * k / OUTLINE
            points[seen, 0] = c.robot_x_m + moved * ahead_m + PERSON_M * math.cos(at)
            points[seen, 1] = moved * side_m + PERSON_M * math.sin(at)
            seen += 1
    return seen


@kernel
def _drive(crowd: Sequence[Crowd], computer: Computer) -> None:
    """Move the robot by one tick, as its protection allows.

    Its commands brake without a lead on the lag of the actuators: nothing may depend on that.
    """
    c, way = crowd[0], computer[0].way
    tick = computer[0].times.tick
    if way.blocked != CLEAR:
        c.clear_tick = tick + c.pause_ticks
    wanted = min(way.limit_mps, c.planned_mps) if tick >= c.clear_tick else 0.0
    up, down, brake = c.accelerate_mps2 * TICK_S, _STEP_LIMIT_MPS2 * TICK_S, way.braking_mps2 * TICK_S
    wanted = max(min(wanted, c.command_mps + up), c.command_mps - down)
    c.command_mps = max(min(wanted, way.cap_mps), c.command_mps - brake, 0.0)
    share = 1.0 - math.exp(-TICK_S / c.lag_s)
    step = min(
        max(share * (c.due_mps[tick % DELAY_TICKS] - c.robot_mps), -c.braking_mps2 * TICK_S), c.braking_mps2 * TICK_S
    )
    c.due_mps[tick % DELAY_TICKS] = c.command_mps
    way_m = (c.robot_mps + 0.5 * step) * TICK_S
    c.robot_mps, c.robot_x_m, c.way_m = c.robot_mps + step, c.robot_x_m + way_m, c.way_m + way_m


@kernel
def _enter_contacts(crowd: Sequence[Crowd], computer: Computer, body: Floats, middle: Floats) -> None:
    """Count contacts, and move away who touches the robot."""
    c, radius_m = crowd[0], computer[0].way.radius_m
    for i in range(c.count):
        middle[0, 0], middle[0, 1] = c.x_m[i], c.y_m[i]
        apart_m = clearance(body, radius_m, (c.robot_x_m, 0.0, 0.0), middle, 10.0)[0] - PERSON_M
        moves = c.robot_mps > CREPT_MPS
        if moves:
            c.closest_m = min(c.closest_m, apart_m)
        if apart_m > 0.0:
            continue
        if not moves:
            c.standing += 1
        else:
            c.moving += 1
            bearing = abs(math.atan2(c.y_m[i], c.x_m[i] - c.robot_x_m))
            if math.pi - bearing < 0.5 * c.blind_rad:
                c.behind += 1
        _place(crowd, i)


@kernel
def take_scan(computer: Computer, body: Floats, zones: SpeedZones, points: Floats) -> None:
    """Take the hits of a scan, by zones or by the robot's own protection.

    Args:
        computer: (1,) state of the robot's computer, with its pose; its way is updated.
        body: (k, 2) outline of the robot.
        zones: Zones of the robot.
        points: (n, 2) hits, map frame [m].
    """
    if zones.kind != NO_ZONES:
        watch_zones(computer, zones, body, points)
        return
    none = np.zeros((0, 2))
    computer[0].way.scan_tick = computer[0].times.tick
    lay_straight(computer)
    measure_clearances(computer, body, HitArrays(points, none, none), 5.0)
    find_stop(computer)


@kernel
def take_scans(computer: Computer, body: Floats, zones: SpeedZones, points: Floats, count: int) -> None:
    """Take a scan many times over, and watch the way in the ticks after each, for measurements of time.

    Args:
        computer: (1,) state of the robot's computer, with its pose; its way is updated.
        body: (k, 2) outline of the robot.
        zones: Zones of the robot.
        points: (n, 2) hits, map frame [m].
        count: Number of scans.
    """
    for _ in range(count):
        take_scan(computer, body, zones, points)
        if zones.kind == NO_ZONES:
            for _ in range(SCAN_TICKS):
                watch_way(computer)


@kernel
def meet(crowd: Sequence[Crowd], computer: Computer, body: Floats, zones: SpeedZones, ticks: int) -> None:
    """Let a robot drive among people for a time, or until it arrives.

    Args:
        crowd: (1,) people and robot, updated.
        computer: (1,) state of the robot's computer, with the figures of its protection; updated.
        body: (k, 2) outline of the robot.
        zones: Zones by which it drives, instead of its protection.
        ticks: Duration.
    """
    c, state = crowd[0], computer[0]
    points, middle = np.zeros((PEOPLE * OUTLINE, 2)), np.zeros((1, 2))
    state.buffer.accel_mps2 = math.nan
    for i in range(c.count):
        _place(crowd, i)
    for tick in range(ticks):
        if c.robot_x_m >= c.line_m:
            break
        c.time_s += TICK_S
        state.times.tick = tick
        pose = state.filter.states[tick % m.RING]
        pose[:] = 0.0
        pose[m.EAST], pose[m.SPEED] = c.robot_x_m, c.robot_mps
        if tick % SCAN_TICKS == 0:
            seen = _see(crowd, points)
            take_scan(computer, body, zones, points[:seen])
        if zones.kind == NO_ZONES:
            watch_way(computer)
        _drive(crowd, computer)
        for i in range(c.count):
            _walk(crowd, i)
        _enter_contacts(crowd, computer, body, middle)


class Met(NamedTuple):
    """Contacts and motion of a robot among people.

    Attributes:
        moving: Contacts with the robot in motion, above CREPT_MPS.
        behind: Those of them from where its lidar does not see.
        standing: Contacts of people with the robot at rest.
        closest_m: Least distance of a person while it moved.
        way_m: Way of the robot.
        time_s: Its time.
    """

    moving: int
    behind: int
    standing: int
    closest_m: float
    way_m: float
    time_s: float

    @property
    def mean_mps(self) -> float:
        """Mean speed of the robot."""
        return self.way_m / self.time_s


def protected(vehicle: Vehicle, grip: float = 0.6) -> ComputerState:
    """Return the state of a robot's computer with the figures of its protection.

    Args:
        vehicle: Vehicle with a lidar.
        grip: Grip of the ground.
    """
    computer = ComputerState.sized(len(vehicle.drive.actuators))()
    Protector(vehicle, grip, drive_of(vehicle), computer, print)
    return computer


def meet_people(
    vehicle: Vehicle,
    computer: ComputerState,
    kinds: Sequence[int],
    minutes: float,
    zones: SpeedZones = OWN_RULE,
    **more: float,
) -> Met:
    """Let a robot drive among people.

    Args:
        vehicle: The robot.
        computer: State of its computer, from `protected`, perhaps with other figures.
        kinds: WALKER, INTERCEPTOR or STEPPER for each person.
        minutes: Duration; less if it arrives.
        zones: Zones by which it drives, instead of its protection.
        more: Fields of `Crowd`.
    """
    drive = drive_of(vehicle)
    crowd = Crowd()
    crowd.seed = 1
    crowd.count = len(kinds)
    crowd.kinds[: len(kinds)] = kinds
    crowd.fastest_mps, crowd.lag_s = 1.5, drive.lag_s
    crowd.braking_mps2, crowd.accelerate_mps2 = computer.way.braking_mps2, vehicle.drive.max_acceleration_mps2
    crowd.planned_mps = vehicle.drive.transit_speed_mps
    for name, value in more.items():
        setattr(crowd, name, value)
    ticks = round(minutes * 60.0 / TICK_S)
    meet(crowd.array, computer.array, np.array(vehicle.body.footprint_m), zones, ticks)
    return Met(crowd.moving, crowd.behind, crowd.standing, crowd.closest_m, crowd.way_m, crowd.time_s)

"""The RTK-GNSS receiver: its solution, its error and what it reports about it move together.

A fix is held as long as corrections and the sky allow; when they do not, the solution falls at once to the best that is
left, and climbs again step by step: first position, float, fix. Each solution has errors of its own, all of them
stationary processes that run whether or not they are heard, so that a fault changes when they are heard and nothing
else. The position is reported as latitude, longitude and height, and converted back from there for the computer.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.services.core.geodesy import to_geodetic, to_local
from touchline.services.core.jit import kernel
from touchline.services.core.random import (
    STREAM_FAULT,
    STREAM_GNSS,
    STREAM_LOOSE_FIX,
    STREAM_RECEIVER,
    normal,
    uniform,
)
from touchline.services.onboard.interface import TICK_S, TICKS_PER_S
from touchline.services.robot_sim.sensors.zones import VALUE_1, VALUE_2, VALUE_3, distance
from touchline.services.robot_sim.world import body
from touchline.services.robot_sim.world import effects as e
from touchline.services.robot_sim.world.physics import leaning

NONE: Final = 0.0
SINGLE: Final = 1.0
FLOAT: Final = 2.0
FIXED: Final = e.FIXED

MIN_REPORTED_VARIANCE_M2: Final = 1e-6
"""A receiver never claims better than a millimetre."""
UNKNOWN_VARIANCE_M2: Final = 1e4
"""Reported with no position."""
VERTICAL_FACTOR: Final = 2.0
"""Vertical errors against horizontal ones."""
_FALLING_TAU_S = 5.0  # how fast a float solution leaves the fix that it was
_HELD_ADMITTED = 0.5  # share of the drift of a held fix that the reported variance knows

# Parameters.
R_PERIOD_TICKS: Final = 0
R_LATENCY_S: Final = 1
R_JITTER_S: Final = 2
R_WHITE: Final = 3  # m
R_SIGMA: Final = 4  # m: Gauss-Markov 1, Gauss-Markov 2, float, single
R_DECAY: Final = 8  # per period, of the same four
R_OVERCONFIDENT: Final = 12
R_CLAIMED: Final = 13  # m
R_HOLD_S: Final = 14
R_HOLD_DRIFT: Final = 15  # m/s
R_WAIT_TICKS: Final = 16  # before a first position, before float
R_CONVERGE_MIN_TICKS: Final = 18
R_CONVERGE_MAX_TICKS: Final = 19
R_ANTENNA: Final = 20  # x, y, z in the body [m]
PARAMETERS: Final = 23

# State.
G_FIX: Final = 0
G_READY_TICK: Final = 1  # when the next better solution is there; −1: nothing better can be had
G_SINCE_TICK: Final = 2  # when the present solution began
G_FELL: Final = 3  # whether it is what was left of a better one
G_CLAIMS: Final = 4  # whether this float spell is over-confident
G_HELD_TICKS: Final = 5  # without corrections
G_DRIFT_EAST: Final = 6  # unit vector
G_DRIFT_NORTH: Final = 7
G_WANDER: Final = 8  # three axes × four processes
G_LAST: Final = 20  # reported east, north, up with the last position
STATE_SIZE: Final = 23

# A report.
TICK: Final = 0  # of validity
STAMP_S: Final = 1  # the same by the receiver's clock
LATITUDE: Final = 2
LONGITUDE: Final = 3
ALTITUDE: Final = 4
VARIANCE: Final = 5
VERTICAL_VARIANCE: Final = 6
FIX: Final = 7
SATELLITES: Final = 8
CORRECTION_AGE: Final = 9
EAST: Final = 10  # converted back from the three above
NORTH: Final = 11
COLUMNS: Final = 12

_TURN_ON = -1
_CHANNELS = 3  # of an axis in STREAM_GNSS: white and the two Gauss-Markov terms
_SATELLITES = (4.0, 9.0, 14.0, 24.0)  # by solution

# The white part of a fixed error: the share of the fixes of each of three kinds, and their standard deviation against
# that of all. With 4.71 mm an axis, and two slow terms of 2.5 mm, the horizontal error has the quantiles of 12,510
# ZED-F9P fixes of an antenna that turned at 2.3 m/s on a 0.61 m arm (ArduSimple, "Testing simpleRTK2B accuracy in RTK
# base-rover configuration", 5 Hz, unfiltered, start and stop included): 68 % within 7 mm, 95.45 % within 17 mm, 99.73 %
# within 38 mm. Fitted by solving for the three.
GOOD_SHARE: Final = 0.85
POOR_SHARE: Final = 0.13  # the rest, 2 %, are the tail
KIND_SIGMAS: Final = (0.4353, 2.0236, 3.9155)
_KIND_CHANNEL = 3 * _CHANNELS

Floats = NDArray[np.float64]


@kernel
def white(seed: int, tick: int, axis: int) -> float:
    """Draw the white part of a fixed position's error, with standard deviation 1; a fix is as bad along each axis."""
    kind = uniform(seed, STREAM_GNSS, tick, _KIND_CHANNEL)
    sigma = KIND_SIGMAS[0 if kind < GOOD_SHARE else 1 if kind < GOOD_SHARE + POOR_SHARE else 2]
    drawn: float = sigma * normal(seed, STREAM_GNSS, tick, axis * _CHANNELS)
    return drawn


@kernel
def _wander_draw(seed: int, tick: int, axis: int, process: int) -> float:
    if process < 2:
        drawn: float = normal(seed, STREAM_GNSS, tick, axis * _CHANNELS + 1 + process)
        return drawn
    loose: float = normal(seed, STREAM_LOOSE_FIX, tick, axis * 2 + process - 2)
    return loose


@kernel
def switch_on(gnss: Floats, r: Floats, seed: int) -> None:
    """A receiver that has had its fix for long; `gnss` is (STATE_SIZE,)."""
    gnss[G_FIX], gnss[G_READY_TICK] = FIXED, -1.0
    for axis in range(3):
        for process in range(4):
            draw = _wander_draw(seed, _TURN_ON, axis, process)
            gnss[G_WANDER + 4 * axis + process] = r[R_SIGMA + process] * draw


@kernel
def _wander(gnss: Floats, r: Floats, seed: int, tick: int) -> None:
    for axis in range(3):
        for process in range(4):
            sigma, decay = r[R_SIGMA + process], r[R_DECAY + process]
            if sigma > 0.0:
                at = G_WANDER + 4 * axis + process
                fresh = sigma * math.sqrt(1.0 - decay * decay)
                gnss[at] = decay * gnss[at] + fresh * _wander_draw(seed, tick, axis, process)


@kernel
def _look_up(sky: Floats, vertices: Floats, x: float, y: float) -> tuple[float, float]:
    """The best solution that the sky allows at (x, y), and the factor on the white noise."""
    best, factor = FIXED, 1.0
    for index in range(len(sky)):
        away = distance(sky[index], vertices, x, y)
        if away <= 0.0:
            best = min(best, sky[index, VALUE_1])
        if away < sky[index, VALUE_2]:
            near = 1.0 - away / sky[index, VALUE_2]
            factor = max(factor, 1.0 + (sky[index, VALUE_3] - 1.0) * near)
    return best, factor


@kernel
def _solve(gnss: Floats, r: Floats, best: float, seed: int, tick: int) -> None:
    """Fall to the best solution that can be had at once, or climb a step towards it when it is time."""
    fix = gnss[G_FIX]
    if best == fix:
        gnss[G_READY_TICK] = -1.0
        return
    if best > fix:
        if gnss[G_READY_TICK] < 0.0:
            if fix < FLOAT:
                wait = r[R_WAIT_TICKS + int(fix)]
            else:
                span = r[R_CONVERGE_MAX_TICKS] - r[R_CONVERGE_MIN_TICKS]
                wait = r[R_CONVERGE_MIN_TICKS] + span * uniform(seed, STREAM_RECEIVER, tick, 0)
            gnss[G_READY_TICK] = tick + wait
        if tick < gnss[G_READY_TICK]:
            return
    gnss[G_FELL] = 1.0 if best < fix else 0.0
    gnss[G_FIX] = best if best < fix else fix + 1.0
    gnss[G_SINCE_TICK], gnss[G_READY_TICK] = tick, -1.0
    if gnss[G_FIX] == FLOAT:
        gnss[G_CLAIMS] = 1.0 if uniform(seed, STREAM_RECEIVER, tick, 1) < r[R_OVERCONFIDENT] else 0.0


@kernel
def _corrections(gnss: Floats, r: Floats, lost: bool, seed: int, tick: int) -> None:
    if not lost:
        gnss[G_HELD_TICKS] = 0.0
        return
    if gnss[G_HELD_TICKS] == 0.0:
        angle = 2.0 * math.pi * uniform(seed, STREAM_RECEIVER, tick, 2)
        gnss[G_DRIFT_EAST], gnss[G_DRIFT_NORTH] = math.cos(angle), math.sin(angle)
    gnss[G_HELD_TICKS] += r[R_PERIOD_TICKS]


@kernel
def _error(gnss: Floats, r: Floats, effects: Floats, axis: int, factor: float, seed: int, tick: int) -> float:
    """Error of the present solution along one axis [m]."""
    at = G_WANDER + 4 * axis
    fix = gnss[G_FIX]
    error: float = gnss[at] + gnss[at + 1]
    if r[R_WHITE] > 0.0:
        error += r[R_WHITE] * factor * white(seed, tick, axis)
    if effects[e.GNSS_WHITE_M] > 0.0:
        error += effects[e.GNSS_WHITE_M] * normal(seed, STREAM_FAULT, tick, axis)
    if fix == FLOAT:
        blend = 1.0
        if gnss[G_FELL] > 0.0:
            blend = 1.0 - math.exp(-(tick - gnss[G_SINCE_TICK]) * TICK_S / _FALLING_TAU_S)
        error += blend * gnss[at + 2]
    elif fix == SINGLE:
        error += gnss[at + 3]
    elif fix == FIXED and axis < 2:
        error += TICK_S * gnss[G_HELD_TICKS] * r[R_HOLD_DRIFT] * gnss[G_DRIFT_EAST + axis]
        error += effects[e.OFFSET_EAST_M + axis]
    return error


@kernel
def _reported_variance(gnss: Floats, r: Floats, effects: Floats, factor: float) -> float:
    """What the receiver says of its horizontal error, per axis [m²]."""
    fix = gnss[G_FIX]
    if fix == NONE:
        return UNKNOWN_VARIANCE_M2
    if fix == FIXED:
        drift = _HELD_ADMITTED * TICK_S * gnss[G_HELD_TICKS] * r[R_HOLD_DRIFT]
        noise = r[R_WHITE] * factor
        variance = noise * noise + r[R_SIGMA] * r[R_SIGMA] + r[R_SIGMA + 1] * r[R_SIGMA + 1] + drift * drift
    elif effects[e.CLAIMED_M] > 0.0:
        variance = effects[e.CLAIMED_M] * effects[e.CLAIMED_M]
    elif fix == FLOAT and gnss[G_CLAIMS] > 0.0:
        variance = r[R_CLAIMED] * r[R_CLAIMED]
    else:
        sigma = r[R_SIGMA + 2] if fix == FLOAT else r[R_SIGMA + 3]
        variance = sigma * sigma
    admitted = effects[e.GNSS_WHITE_M] ** 2 - effects[e.GNSS_HIDDEN_M] ** 2
    reported: float = max(variance + max(admitted, 0.0), MIN_REPORTED_VARIANCE_M2)
    return reported


@kernel
def take(
    world: Floats,
    gnss: Floats,
    r: Floats,
    frame: Floats,
    sky: Floats,
    vertices: Floats,
    effects: Floats,
    seed: int,
    tick: int,
    report: Floats,
) -> None:
    """Take a position.

    Args:
        world: The truth, as of `body`.
        gnss: (STATE_SIZE,) the receiver's state, changed in place.
        r: (PARAMETERS,) its figures.
        frame: The map's tangent plane, of `geodesy.local_frame`.
        sky: (n, places.COLUMNS) obstructions: best solution, margin [m], noise factor.
        vertices: (m, 2) their corners [m].
        effects: (effects.SIZE,) what faults do.
        seed: Of the scenario.
        tick: Of validity.
        report: (COLUMNS,) filled.
    """
    _wander(gnss, r, seed, tick)
    cos, sin = math.cos(world[body.HEADING]), math.sin(world[body.HEADING])
    x, y, z = leaning(world, r[R_ANTENNA], r[R_ANTENNA + 1], r[R_ANTENNA + 2])
    east = world[body.EAST] + cos * x - sin * y
    north = world[body.NORTH] + sin * x + cos * y
    best, factor = _look_up(sky, vertices, east, north)
    best = min(best, effects[e.FIX_CAP])
    _corrections(gnss, r, effects[e.CORRECTIONS_LOST] > 0.0, seed, tick)
    if gnss[G_HELD_TICKS] > 0.0:  # what there is can be held, but nothing better be had than a single position
        best = min(best, max(gnss[G_FIX], SINGLE))
    if TICK_S * gnss[G_HELD_TICKS] > r[R_HOLD_S]:
        best = min(best, SINGLE)
    _solve(gnss, r, best, seed, tick)
    if gnss[G_FIX] > NONE:
        gnss[G_LAST] = east + _error(gnss, r, effects, 0, factor, seed, tick)
        gnss[G_LAST + 1] = north + _error(gnss, r, effects, 1, factor, seed, tick)
        vertical = VERTICAL_FACTOR * _error(gnss, r, effects, 2, factor, seed, tick)
        gnss[G_LAST + 2] = world[body.HEIGHT] + z + vertical
    latitude, longitude, altitude = to_geodetic(frame, gnss[G_LAST], gnss[G_LAST + 1], gnss[G_LAST + 2])
    time_s = tick / TICKS_PER_S
    report[TICK] = tick
    report[STAMP_S] = time_s + effects[e.CLOCK_OFFSET_S] + effects[e.CLOCK_DRIFT] * time_s
    report[LATITUDE], report[LONGITUDE], report[ALTITUDE] = latitude, longitude, altitude
    report[VARIANCE] = _reported_variance(gnss, r, effects, factor)
    report[VERTICAL_VARIANCE] = report[VARIANCE] * VERTICAL_FACTOR * VERTICAL_FACTOR
    report[FIX] = gnss[G_FIX]
    report[SATELLITES] = math.floor(_SATELLITES[int(gnss[G_FIX])] / math.sqrt(factor))
    report[CORRECTION_AGE] = (tick - gnss[G_HELD_TICKS]) % 100.0 / 100.0 + TICK_S * gnss[G_HELD_TICKS]
    report[EAST], report[NORTH], _ = to_local(frame, latitude, longitude, altitude)

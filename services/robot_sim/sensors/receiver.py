"""The RTK-GNSS receiver: its solution, its error and what it reports about it move together.

A fix is held as long as corrections and the sky allow; when they do not, the solution falls at once to the best that is
left, and climbs again step by step: first position, float, fix. Each solution has errors of its own, all of them
stationary processes that run whether or not they are heard, so that a fault changes when they are heard and nothing
else. The position is reported as latitude, longitude and height, and converted back from there for the computer.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Final

import numpy as np
from numpy.typing import NDArray

from touchline.core.geodesy import FRAME_SIZE, to_geodetic, to_local
from touchline.core.jit import kernel
from touchline.core.random import STREAM_FAULT, STREAM_GNSS, STREAM_LOOSE_FIX, STREAM_RECEIVER, normal, uniform
from touchline.core.records import Record
from touchline.onboard.interface import TICK_S, TICKS_PER_S
from touchline.services.robot_sim.sensors.moment import Moment
from touchline.services.robot_sim.sensors.position_report import (
    ALTITUDE,
    COLUMNS,
    CORRECTION_AGE,
    EAST,
    FIX,
    HEADING,
    HEADING_VARIANCE,
    LATITUDE,
    LONGITUDE,
    NORTH,
    SATELLITES,
    STAMP_S,
    TICK,
    VARIANCE,
    VERTICAL_VARIANCE,
)
from touchline.services.robot_sim.sensors.zones import Zones, distance
from touchline.services.robot_sim.world import effects as e
from touchline.services.robot_sim.world.effects import Effects
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


class ReceiverFigures(Record):
    """Of one receiver in one scenario; an array of four has Gauss-Markov 1, Gauss-Markov 2, float, single."""

    period_ticks: int
    """Between two positions; 0: the robot has no receiver."""
    latency_s: float
    jitter_s: float
    white_m: float
    sigma_m: Annotated[Floats, 4]
    decay: Annotated[Floats, 4]
    """Per period."""
    overconfident_share: float
    """Of the float spells."""
    claimed_m: float
    """In those."""
    hold_s: float
    hold_drift_mps: float
    wait_ticks: Annotated[Floats, 2]
    """Before a first position, before float."""
    converge_min_ticks: float
    """From float to a fix, and at most:"""
    converge_max_ticks: float
    antenna_m: Annotated[Floats, 3]
    """x, y, z in the body."""
    frame: Annotated[Floats, FRAME_SIZE]
    """The map's tangent plane, of `geodesy.local_frame`."""


class Receiver(Record):
    """Its state."""

    figures: ReceiverFigures
    fix: float
    """The present solution, NONE … FIXED."""
    ready_tick: float
    """When the next better one is there; −1: nothing better can be had."""
    since_tick: int
    """When the present one began."""
    fell: bool
    """Whether it is what was left of a better one."""
    claims: bool
    """Whether this float spell is over-confident."""
    held_ticks: int
    """Without corrections."""
    drift: Annotated[Floats, 2]
    """Of a held fix: direction east, north, unit vector."""
    wander_m: Annotated[Floats, 3, 4]
    """By axis east, north, up: the four processes."""
    last_m: Annotated[Floats, 3]
    """Reported east, north, up with the last position."""
    report: Annotated[Floats, COLUMNS]
    """The last one taken."""


@kernel
def white(seed: int, tick: int, axis: int) -> float:
    """Draw the white part of a fixed position's error, with standard deviation 1; a fix is as bad along each axis.

    A mixture of three normal distributions; where it comes from is said at `KIND_SIGMAS`.

    Args:
        seed: Of the scenario.
        tick: Of validity.
        axis: 0 east, 1 north, 2 up.
    """
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
def switch_on(receiver: Sequence[Receiver], seed: int) -> None:
    """Make it a receiver that has had its fix for long.

    Args:
        receiver: (1,) with its figures; the rest is filled in.
        seed: Of the scenario.
    """
    g = receiver[0]
    g.fix, g.ready_tick = FIXED, -1.0
    for axis in range(3):
        for process in range(4):
            g.wander_m[axis, process] = g.figures.sigma_m[process] * _wander_draw(seed, _TURN_ON, axis, process)


@kernel
def _wander(receiver: Sequence[Receiver], seed: int, tick: int) -> None:
    g = receiver[0]
    for axis in range(3):
        for process in range(4):
            sigma, decay = g.figures.sigma_m[process], g.figures.decay[process]
            if sigma > 0.0:
                fresh = sigma * math.sqrt(1.0 - decay * decay)
                g.wander_m[axis, process] = decay * g.wander_m[axis, process] + fresh * _wander_draw(
                    seed, tick, axis, process
                )


@kernel
def _look_up(sky: Zones, x: float, y: float) -> tuple[float, float]:
    """The best solution that the sky allows at (x, y), and the factor on the white noise."""
    best, factor = FIXED, 1.0
    for index in range(len(sky.places)):
        place = sky.places[index]
        away = distance(place.outline, sky.vertices, x, y)
        if away <= 0.0:
            best = min(best, place.best_fix)
        if away < place.margin_m:
            near = 1.0 - away / place.margin_m
            factor = max(factor, 1.0 + (place.noise_factor - 1.0) * near)
    return best, factor


@kernel
def _solve(receiver: Sequence[Receiver], best: float, seed: int, tick: int) -> None:
    """Fall to the best solution that can be had at once, or climb a step towards it when it is time."""
    g, f = receiver[0], receiver[0].figures
    fix = g.fix
    if best == fix:
        g.ready_tick = -1.0
        return
    if best > fix:
        if g.ready_tick < 0.0:
            if fix < FLOAT:
                wait = f.wait_ticks[int(fix)]
            else:
                span = f.converge_max_ticks - f.converge_min_ticks
                wait = f.converge_min_ticks + span * uniform(seed, STREAM_RECEIVER, tick, 0)
            g.ready_tick = tick + wait
        if tick < g.ready_tick:
            return
    g.fell = best < fix
    g.fix = best if best < fix else fix + 1.0
    g.since_tick, g.ready_tick = tick, -1.0
    if g.fix == FLOAT:
        g.claims = uniform(seed, STREAM_RECEIVER, tick, 1) < f.overconfident_share


@kernel
def _corrections(receiver: Sequence[Receiver], lost: bool, seed: int, tick: int) -> None:
    g = receiver[0]
    if not lost:
        g.held_ticks = 0
        return
    if g.held_ticks == 0:
        angle = 2.0 * math.pi * uniform(seed, STREAM_RECEIVER, tick, 2)
        g.drift[0], g.drift[1] = math.cos(angle), math.sin(angle)
    g.held_ticks += g.figures.period_ticks


@kernel
def _error(moment: Moment, receiver: Sequence[Receiver], axis: int, factor: float) -> float:
    """Error of the present solution along one axis [m]."""
    seed, tick, effects = moment.seed, moment.tick, moment.effects[0]
    g, f = receiver[0], receiver[0].figures
    fix = g.fix
    error: float = g.wander_m[axis, 0] + g.wander_m[axis, 1]
    if f.white_m > 0.0:
        error += f.white_m * factor * white(seed, tick, axis)
    if effects.gnss_white_m > 0.0:
        error += effects.gnss_white_m * normal(seed, STREAM_FAULT, tick, axis)
    if fix == FLOAT:
        blend = 1.0
        if g.fell:
            blend = 1.0 - math.exp(-(tick - g.since_tick) * TICK_S / _FALLING_TAU_S)
        error += blend * g.wander_m[axis, 2]
    elif fix == SINGLE:
        error += g.wander_m[axis, 3]
    elif fix == FIXED and axis < 2:
        error += TICK_S * g.held_ticks * f.hold_drift_mps * g.drift[axis]
        error += effects.gnss_offset_m[axis]
    return error


@kernel
def _reported_variance(effects: Effects, receiver: Sequence[Receiver], factor: float) -> float:
    """What the receiver says of its horizontal error, per axis [m²]."""
    g, f = receiver[0], receiver[0].figures
    fix = g.fix
    if fix == NONE:
        return UNKNOWN_VARIANCE_M2
    if fix == FIXED:
        drift = _HELD_ADMITTED * TICK_S * g.held_ticks * f.hold_drift_mps
        noise = f.white_m * factor
        variance = noise * noise + f.sigma_m[0] * f.sigma_m[0] + f.sigma_m[1] * f.sigma_m[1] + drift * drift
    elif effects.claimed_m > 0.0:
        variance = effects.claimed_m * effects.claimed_m
    elif fix == FLOAT and g.claims:
        variance = f.claimed_m * f.claimed_m
    else:
        sigma = f.sigma_m[2] if fix == FLOAT else f.sigma_m[3]
        variance = sigma * sigma
    admitted = effects.gnss_white_m**2 - effects.gnss_hidden_m**2
    reported: float = max(variance + max(admitted, 0.0), MIN_REPORTED_VARIANCE_M2)
    return reported


@kernel
def take(moment: Moment, receiver: Sequence[Receiver], sky: Zones) -> None:
    """Take a position.

    The slow errors are first-order Gauss-Markov processes, x(t + T) = x(t)·exp(−T/τ) + σ·√(1 − exp(−2T/τ))·w
    (A. Gelb, ed., "Applied Optimal Estimation", 1974, sec. 2.2); the white one is at `white`.

    Args:
        moment: Of validity.
        receiver: (1,) its state, changed; `report` is filled.
        sky: Obstructions, of `SkyPlace`.
    """
    seed, tick, state, effects = moment.seed, moment.tick, moment.state[0], moment.effects[0]
    g, f = receiver[0], receiver[0].figures
    _wander(receiver, seed, tick)
    cos, sin = math.cos(state.heading_rad), math.sin(state.heading_rad)
    x, y, z = leaning(state, f.antenna_m[0], f.antenna_m[1], f.antenna_m[2])
    east = state.east_m + cos * x - sin * y
    north = state.north_m + sin * x + cos * y
    best, factor = _look_up(sky, east, north)
    best = min(best, effects.fix_cap)
    _corrections(receiver, effects.corrections_lost, seed, tick)
    if g.held_ticks > 0:  # what there is can be held, but nothing better be had than a single position
        best = min(best, max(g.fix, SINGLE))
    if TICK_S * g.held_ticks > f.hold_s:
        best = min(best, SINGLE)
    _solve(receiver, best, seed, tick)
    if g.fix > NONE:
        g.last_m[0] = east + _error(moment, receiver, 0, factor)
        g.last_m[1] = north + _error(moment, receiver, 1, factor)
        g.last_m[2] = state.height_m + z + VERTICAL_FACTOR * _error(moment, receiver, 2, factor)
    latitude, longitude, altitude = to_geodetic(f.frame, g.last_m[0], g.last_m[1], g.last_m[2])
    time_s, report = tick / TICKS_PER_S, g.report
    report[TICK] = tick
    report[STAMP_S] = time_s + effects.clock_offset_s + effects.clock_drift * time_s
    report[LATITUDE], report[LONGITUDE], report[ALTITUDE] = latitude, longitude, altitude
    report[VARIANCE] = _reported_variance(effects, receiver, factor)
    report[VERTICAL_VARIANCE] = report[VARIANCE] * VERTICAL_FACTOR * VERTICAL_FACTOR
    report[FIX] = g.fix
    report[SATELLITES] = math.floor(_SATELLITES[int(g.fix)] / math.sqrt(factor))
    report[CORRECTION_AGE] = (tick - g.held_ticks) % 100.0 / 100.0 + TICK_S * g.held_ticks
    report[EAST], report[NORTH], _ = to_local(f.frame, latitude, longitude, altitude)
    report[HEADING] = report[HEADING_VARIANCE] = math.nan

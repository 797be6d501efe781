"""Emulated RTK-GNSS receiver: its solution, the error of that, and the variance that it reports.

A fix is held as long as corrections and the sky allow. When they do not, the solution falls at once to the best that is
left, and climbs again step by step: first position, float, fix. Each solution has errors of its own, all of them
stationary processes that go on whether or not they are in use, so that a fault changes when they are used and nothing
else. The position is reported as latitude, longitude and height, and converted back from there for the computer.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.geodesy import FRAME_SIZE, local_frame, to_geodetic, to_local
from touchline.core.jit import kernel
from touchline.core.random import (
    STREAM_FAULT,
    STREAM_GNSS,
    STREAM_LOOSE_FIX,
    STREAM_RECEIVER,
    STREAM_STAMP,
    normal,
    uniform,
)
from touchline.core.records import Record
from touchline.onboard.interface import TICK_S, TICKS_PER_S, GnssSample
from touchline.schemas.scenario import Scenario
from touchline.schemas.vehicles import GNSS, Vehicle
from touchline.services.robot_sim.sensors.gnss_bursts import BurstFigures, Bursts, burst_figures, go_on
from touchline.services.robot_sim.sensors.moment import TURN_ON_TICK, Moment
from touchline.services.robot_sim.sensors.multipath import bend_m
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
from touchline.services.robot_sim.sensors.transport import usual_arrival
from touchline.services.robot_sim.sensors.zones import PlaceOutline, Zones, distance, make_zones
from touchline.services.robot_sim.world import effects as e
from touchline.services.robot_sim.world.effects import Effects
from touchline.services.robot_sim.world.physics import leaning

NONE: Final = 0.0
SINGLE: Final = 1.0
FLOAT: Final = 2.0
FIXED: Final = e.FIXED
FIX_NAMES: Final = {"none": NONE, "single": SINGLE, "float": FLOAT, "fixed": FIXED}
"""Solutions by the names that scenarios and faults have for them."""

MIN_REPORTED_VARIANCE_M2: Final = 1e-6
"""Smallest variance per axis that a receiver reports: that of a millimetre."""
UNKNOWN_VARIANCE_M2: Final = 1e4
"""Variance that it reports without a position."""
VERTICAL_FACTOR: Final = 2.0
"""Ratio of vertical errors to horizontal ones."""
_FALLING_TAU_S = 5.0  # how fast a float solution leaves the fix that it was
_HELD_ADMITTED = 0.5  # share of the drift of a held fix that the reported variance knows

_CHANNELS = 3  # of an axis in STREAM_GNSS: white and the two Gauss-Markov terms
_JITTER: Final = 3  # channel of STREAM_RECEIVER
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


class SkyPlace(Record):
    """Obstruction of the sky in the scenario."""

    outline: PlaceOutline
    best_fix: float
    """Best solution inside of it, NONE … FIXED."""
    margin_m: float
    """Width of the border around it in which the noise grows."""
    noise_factor: float
    """Factor on the white noise at its outline."""


class GnssFigures(Record):
    """Figures of one receiver in one scenario; arrays of four: Gauss-Markov 1, Gauss-Markov 2, float, single."""

    period_ticks: int
    """Ticks between two positions; 0: the robot has no receiver."""
    latency_s: float
    jitter_s: float
    white_m: float
    """Standard deviation of the white error of a fix, per axis."""
    sigma_m: Annotated[Floats, 4]
    """Standard deviations of the slow errors, per axis."""
    decay: Annotated[Floats, 4]
    """Shares of the slow errors that are left after a period."""
    overconfident_share: float
    """Share of the float solutions that are over-confident."""
    claimed_m: float
    """Standard deviation that those report."""
    hold_s: float
    """Time for which a fix is held without corrections."""
    hold_drift_mps: float
    """Drift of such a fix."""
    wait_ticks: Annotated[Floats, 2]
    """Ticks from no position to single, and from single to float."""
    converge_min_ticks: float
    """Ticks from float to fixed at least."""
    converge_max_ticks: float
    """Ticks from float to fixed at most."""
    antenna_m: Annotated[Floats, 3]
    """Place of the antenna, body frame x, y, z."""
    frame: Annotated[Floats, FRAME_SIZE]
    """Tangent plane of the map, of `geodesy.local_frame`."""
    base_m: Annotated[Floats, 2]
    """Error of the base station's position: east, north."""
    stamp_offset_s: float
    """Stamps less the time of measurement."""
    stamp_jitter_s: float
    """Random part of that, 1 σ."""
    bursts: BurstFigures


class GnssState(Record):
    """State of the receiver."""

    figures: GnssFigures
    bursts: Bursts
    fix: float
    """Present solution, NONE … FIXED."""
    ready_tick: float
    """Tick in which the next better solution is ready; −1: none can be had."""
    since_tick: int
    """Tick in which the present solution began."""
    fell: bool
    """True if the present solution is what is left of a better one."""
    claims: bool
    """True if this float solution is over-confident."""
    held_ticks: int
    """Ticks without corrections."""
    drift: Annotated[Floats, 2]
    """Direction in which a held fix drifts: unit vector east, north."""
    wander_m: Annotated[Floats, 3, 4]
    """Slow errors by axis east, north, up."""
    last_m: Annotated[Floats, 3]
    """Position that was reported last: east, north, up."""
    report: Annotated[Floats, COLUMNS]
    """Last report, columns of `position_report`."""


class GnssReport(NamedTuple):
    """Position as the receiver reports it."""

    stamp_s: float
    """Time of validity by the receiver's clock."""
    latitude_deg: float
    longitude_deg: float
    altitude_m: float
    variance_m2: float
    """Variance per horizontal axis."""
    vertical_variance_m2: float
    fix: int
    satellites: int
    correction_age_s: float


@kernel
def white(seed: int, tick: int, axis: int) -> float:
    """Draw the white part of a fixed position's error, with standard deviation 1; a fix is as bad along each axis.

    Mixture of three normal distributions; see `KIND_SIGMAS` for its source.

    Args:
        seed: Seed of the scenario.
        tick: Tick of validity.
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
def switch_on(gnss: Sequence[GnssState], seed: int) -> None:
    """Put the receiver into the state of one that has had its fix for long.

    Args:
        gnss: (1,) state with its figures; the rest is filled in.
        seed: Seed of the scenario.
    """
    g = gnss[0]
    g.fix, g.ready_tick = FIXED, -1.0
    for axis in range(3):
        for process in range(4):
            g.wander_m[axis, process] = g.figures.sigma_m[process] * _wander_draw(seed, TURN_ON_TICK, axis, process)


@kernel
def _wander(gnss: Sequence[GnssState], seed: int, tick: int) -> None:
    g = gnss[0]
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
    """Best solution that the sky allows at (x, y), and the factor on the white noise."""
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
def _solve(gnss: Sequence[GnssState], best: float, seed: int, tick: int) -> None:
    """Fall to the best solution that can be had at once, or climb a step towards it when it is time."""
    g, f = gnss[0], gnss[0].figures
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
def _corrections(gnss: Sequence[GnssState], lost: bool, seed: int, tick: int) -> None:
    g = gnss[0]
    if not lost:
        g.held_ticks = 0
        return
    if g.held_ticks == 0:
        angle = 2.0 * math.pi * uniform(seed, STREAM_RECEIVER, tick, 2)
        g.drift[0], g.drift[1] = math.cos(angle), math.sin(angle)
    g.held_ticks += g.figures.period_ticks


@kernel
def _error(moment: Moment, gnss: Sequence[GnssState], axis: int, factor: float) -> float:
    """Error of the present solution along one axis [m]."""
    seed, tick, effects = moment.seed, moment.tick, moment.effects[0]
    g, f = gnss[0], gnss[0].figures
    fix = g.fix
    error: float = g.wander_m[axis, 0] + g.wander_m[axis, 1] + factor * g.bursts.error_m[axis]
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
    if fix >= FLOAT and axis < 2:
        error += f.base_m[axis]
    return error


@kernel
def _reported_variance(effects: Effects, gnss: Sequence[GnssState], factor: float) -> float:
    """Variance that the receiver reports of its horizontal error, per axis [m²]."""
    g, f = gnss[0], gnss[0].figures
    fix = g.fix
    if fix == NONE:
        return UNKNOWN_VARIANCE_M2
    if fix == FIXED:
        drift = _HELD_ADMITTED * TICK_S * g.held_ticks * f.hold_drift_mps
        noise = f.white_m * factor
        variance = noise * noise + f.sigma_m[0] * f.sigma_m[0] + f.sigma_m[1] * f.sigma_m[1] + drift * drift
        variance += f.bursts.share * (factor * f.bursts.sigma_m) ** 2
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
def due(tick: int, gnss: Sequence[GnssState]) -> bool:
    """Return whether the receiver takes a position at the end of a tick.

    Args:
        tick: Tick of the onboard computer.
        gnss: (1,) state.
    """
    period_ticks = gnss[0].figures.period_ticks
    taken: bool = period_ticks > 0 and tick % period_ticks == 0
    return taken


@kernel
def measure(moment: Moment, gnss: Sequence[GnssState], sky: Zones, multipath: Zones) -> None:
    """Take a position.

    The slow errors are first-order Gauss-Markov processes, x(t + T) = x(t)·exp(−T/τ) + σ·√(1 − exp(−2T/τ))·w
    (A. Gelb, ed., "Applied Optimal Estimation", 1974, sec. 2.2); see `white` for the white one.

    Args:
        moment: End of the tick of validity.
        gnss: (1,) state, updated; `report` is filled in.
        sky: Places of kind `SkyPlace`.
        multipath: Places of kind `MultipathPlace`.
    """
    seed, tick, state, effects = moment.seed, moment.tick, moment.state[0], moment.effects[0]
    g, f = gnss[0], gnss[0].figures
    _wander(gnss, seed, tick)
    go_on(moment, f.bursts, g.bursts)
    cos, sin = math.cos(state.heading_rad), math.sin(state.heading_rad)
    x, y, z = leaning(state, f.antenna_m[0], f.antenna_m[1], f.antenna_m[2])
    east = state.east_m + cos * x - sin * y
    north = state.north_m + sin * x + cos * y
    best, factor = _look_up(sky, east, north)
    best = min(best, effects.fix_cap)
    _corrections(gnss, effects.corrections_lost, seed, tick)
    if g.held_ticks > 0:  # what there is can be held, but nothing better be had than a single position
        best = min(best, max(g.fix, SINGLE))
    if TICK_S * g.held_ticks > f.hold_s:
        best = min(best, SINGLE)
    _solve(gnss, best, seed, tick)
    if g.fix > NONE:
        g.last_m[0] = east + _error(moment, gnss, 0, factor)
        g.last_m[1] = north + _error(moment, gnss, 1, factor)
        g.last_m[2] = state.height_m + z + VERTICAL_FACTOR * _error(moment, gnss, 2, factor)
        for index in range(len(multipath.places)):
            bend_m(moment, index, multipath, east, north, g.last_m)
    latitude, longitude, altitude = to_geodetic(f.frame, g.last_m[0], g.last_m[1], g.last_m[2])
    time_s, report = tick / TICKS_PER_S, g.report
    report[TICK] = tick
    report[STAMP_S] = time_s + effects.clock_offset_s + effects.clock_drift * time_s + f.stamp_offset_s
    if f.stamp_jitter_s > 0.0:
        report[STAMP_S] += f.stamp_jitter_s * normal(seed, STREAM_STAMP, tick, 0)
    report[LATITUDE], report[LONGITUDE], report[ALTITUDE] = latitude, longitude, altitude
    report[VARIANCE] = _reported_variance(effects, gnss, factor)
    report[VERTICAL_VARIANCE] = report[VARIANCE] * VERTICAL_FACTOR * VERTICAL_FACTOR
    report[FIX] = g.fix
    report[SATELLITES] = math.floor(_SATELLITES[int(g.fix)] / math.sqrt(factor))
    report[CORRECTION_AGE] = (tick - g.held_ticks) % 100.0 / 100.0 + TICK_S * g.held_ticks
    report[EAST], report[NORTH], _ = to_local(f.frame, latitude, longitude, altitude)
    report[HEADING] = report[HEADING_VARIANCE] = math.nan


@kernel
def arrival_tick(moment: Moment, gnss: Sequence[GnssState]) -> int:
    """Return the tick in which a report of this moment arrives, but for faults of its messages.

    Args:
        moment: End of the tick of validity.
        gnss: (1,) state.
    """
    tick, f = moment.tick, gnss[0].figures
    drawn = uniform(moment.seed, STREAM_RECEIVER, tick, _JITTER)
    arrival: int = usual_arrival(tick, f.latency_s, f.jitter_s, drawn)
    return arrival


def unpack(row: list[float]) -> tuple[GnssReport, GnssSample]:
    """Return the position in a report, and what the computer makes of it: the antenna's place in the map frame.

    Args:
        row: (COLUMNS,) numbers of `position_report`.
    """
    _, stamp_s, latitude, longitude, altitude, variance, vertical, fix, satellites, age, east, north, _, _ = row
    return (
        GnssReport(stamp_s, latitude, longitude, altitude, variance, vertical, int(fix), int(satellites), age),
        GnssSample(stamp_s, east, north, variance, int(fix), int(satellites), age),
    )


def make_gnss(vehicle: Vehicle, scenario: Scenario) -> GnssState:
    """Make a receiver that was switched on long ago; it takes no positions if the vehicle is positioned otherwise.

    Args:
        vehicle: Real robot, with its kind of positioning and the place of the antenna.
        scenario: Effective scenario, which has noise, origin, stamps and base.
    """
    noise, origin, truth, made = scenario.gnss, scenario.origin, scenario.truth, GnssState()
    processes = (
        (noise.gauss_markov_1_m, noise.gauss_markov_1_tau_s),
        (noise.gauss_markov_2_m, noise.gauss_markov_2_tau_s),
        (noise.float_m, noise.float_tau_s),
        (noise.single_m, noise.single_tau_s),
    )
    antenna = (vehicle.body.gnss_antenna_x_m, vehicle.body.gnss_antenna_y_m, vehicle.body.gnss_antenna_z_m)
    made.figures.reset(
        period_ticks=TICKS_PER_S // noise.rate_hz if vehicle.positioning == GNSS else 0,
        latency_s=noise.latency_s,
        jitter_s=noise.latency_jitter_s,
        white_m=noise.white_m,
        sigma_m=[sigma for sigma, _ in processes],
        decay=[math.exp(-1.0 / (noise.rate_hz * tau)) for _, tau in processes],
        overconfident_share=noise.float_overconfident_share,
        claimed_m=noise.float_claimed_m,
        hold_s=noise.hold_s,
        hold_drift_mps=noise.hold_drift_mps,
        wait_ticks=[TICKS_PER_S * noise.reacquire_s, TICKS_PER_S * noise.float_after_s],
        converge_min_ticks=TICKS_PER_S * noise.converge_min_s,
        converge_max_ticks=TICKS_PER_S * noise.converge_max_s,
        antenna_m=antenna,
        frame=local_frame(origin.latitude_deg, origin.longitude_deg, origin.altitude_m),
        base_m=(truth.base_east_m, truth.base_north_m),
        stamp_offset_s=truth.stamp_offset_s,
        stamp_jitter_s=truth.stamp_jitter_s,
    )
    made.figures.bursts.reset(**burst_figures(noise))
    switch_on(made.array, scenario.seed)
    return made


def sky_of(scenario: Scenario) -> Zones:
    """Make the scenario's places of kind `SkyPlace`."""
    places = ((each.outline, (FIX_NAMES[each.best_fix], each.margin_m, each.noise_factor)) for each in scenario.sky)
    return make_zones(SkyPlace, places)

"""The RTK-GNSS receiver: late, correlated and reported in WGS 84, as on the roof of the real robot.

Each axis carries white noise plus two stationary Gauss-Markov terms (the slow wander of an RTK solution). The position
is reported as latitude, longitude and height; what the robot's computer gets is converted back from that report.
"""

from __future__ import annotations

import math
from collections import deque
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from schemas.messages import GnssStatus
from schemas.scenario import Scenario
from schemas.vehicle import Vehicle
from services.robot_sim.frames import TICK_S, GnssSample
from services.robot_sim.sensors.geodesy import LocalFrame
from services.robot_sim.world import body
from services.robot_sim.world.randomness import STREAM_GNSS, normal

PERIOD_TICKS: Final = 10
CORRECTION_PERIOD_TICKS: Final = 100
SATELLITES: Final = 24
MIN_REPORTED_VARIANCE_M2: Final = 1e-6
"""A receiver never claims better than a millimetre."""
VERTICAL_FACTOR: Final = 2.0
"""Vertical errors against horizontal ones."""
_TURN_ON: Final = -1
_CHANNELS: Final = 3  # white and the two Gauss-Markov terms, per axis


class GnssReport(NamedTuple):
    """One fix as the receiver reports it."""

    tick: int
    """Onboard tick of validity."""
    latitude_deg: float
    longitude_deg: float
    altitude_m: float
    variance_m2: float
    """Per horizontal axis."""
    vertical_variance_m2: float
    fix: int
    satellites: int
    correction_age_s: float


class GnssReceiver:
    """Takes a fix every 100 ms and hands it over `latency_s` later (rounded up to a whole tick)."""

    def __init__(self, vehicle: Vehicle, scenario: Scenario) -> None:
        """`scenario` must be effective; its origin carries the map frame."""
        noise, origin = scenario.gnss, scenario.origin
        self._frame = LocalFrame(origin.latitude_deg, origin.longitude_deg, origin.altitude_m)
        self._lever = (vehicle.gnss_antenna_x_m, vehicle.gnss_antenna_y_m, vehicle.gnss_antenna_z_m)
        self._seed = scenario.seed
        self._latency_ticks = math.ceil(noise.latency_s / TICK_S - 1e-9)
        self._white = noise.white_m
        self._sigmas = (noise.gauss_markov_1_m, noise.gauss_markov_2_m)
        period_s = PERIOD_TICKS * TICK_S
        self._decays = tuple(
            math.exp(-period_s / tau) for tau in (noise.gauss_markov_1_tau_s, noise.gauss_markov_2_tau_s)
        )
        total = noise.white_m**2 + noise.gauss_markov_1_m**2 + noise.gauss_markov_2_m**2
        self._variance = max(total, MIN_REPORTED_VARIANCE_M2)
        self._wander = [
            [sigma * self._draw(_TURN_ON, axis, 1 + term) for term, sigma in enumerate(self._sigmas)]
            for axis in range(3)
        ]
        self._in_flight: deque[GnssReport] = deque()

    def step(self, tick: int, state: NDArray[np.float64]) -> GnssReport | None:
        """Take a fix if one is due; the report that arrives in this tick, if one does."""
        if tick % PERIOD_TICKS == 0:
            self._in_flight.append(self._take(tick, state))
        if self._in_flight and self._in_flight[0].tick + self._latency_ticks <= tick:
            return self._in_flight.popleft()
        return None

    def sample(self, report: GnssReport) -> GnssSample:
        """What the onboard computer makes of `report`: the antenna in the map frame."""
        east, north, _ = self._frame.to_local(report.latitude_deg, report.longitude_deg, report.altitude_m)
        return GnssSample(
            report.tick / 100, east, north, report.variance_m2, report.fix, report.satellites, report.correction_age_s
        )

    def _draw(self, tick: int, axis: int, channel: int) -> float:
        return float(normal(self._seed, STREAM_GNSS, tick, axis * _CHANNELS + channel))

    def _error(self, tick: int, axis: int) -> float:
        error = self._white * self._draw(tick, axis, 0) if self._white > 0.0 else 0.0
        wander = self._wander[axis]
        for term, (sigma, decay) in enumerate(zip(self._sigmas, self._decays, strict=True)):
            if sigma > 0.0:
                fresh = sigma * math.sqrt(1.0 - decay * decay)
                wander[term] = decay * wander[term] + fresh * self._draw(tick, axis, 1 + term)
            error += wander[term]
        return error

    def _take(self, tick: int, state: NDArray[np.float64]) -> GnssReport:
        east, north, heading = state[body.EAST : body.HEADING + 1].tolist()
        x, y, up = self._lever
        cos, sin = math.cos(heading), math.sin(heading)
        latitude, longitude, altitude = self._frame.to_geodetic(
            east + cos * x - sin * y + self._error(tick, 0),
            north + sin * x + cos * y + self._error(tick, 1),
            up + VERTICAL_FACTOR * self._error(tick, 2),
        )
        return GnssReport(
            tick,
            latitude,
            longitude,
            altitude,
            self._variance,
            self._variance * VERTICAL_FACTOR**2,
            GnssStatus.FIXED,
            SATELLITES,
            (tick % CORRECTION_PERIOD_TICKS) / 100,
        )

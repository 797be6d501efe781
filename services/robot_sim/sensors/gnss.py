"""A position as the receiver reports it, and the receiver's figures for one scenario."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.schemas.scenario import Scenario
from touchline.schemas.vehicles import Vehicle
from touchline.services.onboard.interface import GnssSample
from touchline.services.robot_sim.sensors import receiver

FIX_NAMES: Final = {
    "none": receiver.NONE,
    "single": receiver.SINGLE,
    "float": receiver.FLOAT,
    "fixed": receiver.FIXED,
}


class GnssReport(NamedTuple):
    """One position as the receiver reports it."""

    stamp_s: float
    """Time of validity by the receiver's clock."""
    latitude_deg: float
    longitude_deg: float
    altitude_m: float
    variance_m2: float
    """Per horizontal axis."""
    vertical_variance_m2: float
    fix: int
    satellites: int
    correction_age_s: float


def unpack(row: list[float]) -> tuple[GnssReport, GnssSample]:
    """The report in a row of `receiver`, and what the computer makes of it: the antenna in the map frame."""
    _, stamp_s, latitude, longitude, altitude, variance, vertical, fix, satellites, age, east, north = row
    return (
        GnssReport(stamp_s, latitude, longitude, altitude, variance, vertical, int(fix), int(satellites), age),
        GnssSample(stamp_s, east, north, variance, int(fix), int(satellites), age),
    )


def parameters(vehicle: Vehicle, scenario: Scenario) -> NDArray[np.float64]:
    """(receiver.PARAMETERS,) figures; `scenario` must be effective."""
    noise = scenario.gnss
    r = np.zeros(receiver.PARAMETERS)
    r[receiver.R_PERIOD_TICKS] = 100 // noise.rate_hz
    r[receiver.R_LATENCY_S], r[receiver.R_JITTER_S] = noise.latency_s, noise.latency_jitter_s
    r[receiver.R_WHITE] = noise.white_m
    processes = (
        (noise.gauss_markov_1_m, noise.gauss_markov_1_tau_s),
        (noise.gauss_markov_2_m, noise.gauss_markov_2_tau_s),
        (noise.float_m, noise.float_tau_s),
        (noise.single_m, noise.single_tau_s),
    )
    for index, (sigma, tau) in enumerate(processes):
        r[receiver.R_SIGMA + index] = sigma
        r[receiver.R_DECAY + index] = math.exp(-1.0 / (noise.rate_hz * tau))
    r[receiver.R_OVERCONFIDENT], r[receiver.R_CLAIMED] = noise.float_overconfident_share, noise.float_claimed_m
    r[receiver.R_HOLD_S], r[receiver.R_HOLD_DRIFT] = noise.hold_s, noise.hold_drift_mps
    r[receiver.R_WAIT_TICKS], r[receiver.R_WAIT_TICKS + 1] = 100 * noise.reacquire_s, 100 * noise.float_after_s
    r[receiver.R_CONVERGE_MIN_TICKS] = 100 * noise.converge_min_s
    r[receiver.R_CONVERGE_MAX_TICKS] = 100 * noise.converge_max_s
    antenna = (vehicle.body.gnss_antenna_x_m, vehicle.body.gnss_antenna_y_m, vehicle.body.gnss_antenna_z_m)
    r[receiver.R_ANTENNA : receiver.R_ANTENNA + 3] = antenna
    return r

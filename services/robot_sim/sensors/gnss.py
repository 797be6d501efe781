"""A position as the receiver reports it, and the receiver of one scenario."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

from touchline.core.geodesy import local_frame
from touchline.onboard.interface import TICKS_PER_S, GnssSample
from touchline.schemas.scenario import Scenario
from touchline.schemas.vehicles import GNSS, Vehicle
from touchline.services.robot_sim.sensors import receiver
from touchline.services.robot_sim.sensors.receiver import Receiver

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
    """The report in a row of `position_report`, and what the computer makes of it: the antenna in the map frame."""
    _, stamp_s, latitude, longitude, altitude, variance, vertical, fix, satellites, age, east, north, _, _ = row
    return (
        GnssReport(stamp_s, latitude, longitude, altitude, variance, vertical, int(fix), int(satellites), age),
        GnssSample(stamp_s, east, north, variance, int(fix), int(satellites), age),
    )


def make_receiver(vehicle: Vehicle, scenario: Scenario) -> Receiver:
    """One with the figures of this vehicle and scenario, which must be effective, switched on long ago.

    There is none if the vehicle is positioned otherwise.
    """
    noise, origin, made = scenario.gnss, scenario.origin, Receiver()
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
    )
    receiver.switch_on(made.array, scenario.seed)
    return made

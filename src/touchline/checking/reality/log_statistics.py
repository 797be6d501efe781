"""All statistics of a log's errors, each with a number or with the reason why the log does not tell it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.checking.estimating.receiver_figures import standing
from touchline.checking.reality import imu_statistics as imu
from touchline.checking.reality import receiver_statistics as receiver
from touchline.checking.reality import track_statistics as track
from touchline.checking.reality.log_samples import LogSamples, stretches
from touchline.checking.reality.told import Told

Floats = NDArray[np.float64]

LENGTHS_M: Final = (1, 2, 5, 10, 20)
"""Lengths of the lateral wander."""
CHORD_M: Final = 2.0
"""Length of a slip."""
JUMP_M: Final = 0.08
"""Smallest jump of a fix against dead reckoning."""
AUTOCORRELATION_S: Final = 60.0
LEAST_REST_S: Final = 120.0
"""Shortest rest that tells of the receiver."""
_PER_LAG: Final = 3.0
_AWAY_S: Final = 5.0
"""Time after coming to rest and before setting off that is left out, in which an antenna may move a little."""
_LEAST_DRIVE_M: Final = 20.0
_MOVING_MPS: Final = 0.2
_MOST_RTK_M: Final = 0.05
_OWN_M: Final = 0.001
_OWN_SHARE: Final = 0.1
_NOISE_SHARE: Final = 0.5

LATERAL: Final = {length: f"lateral_{length}m" for length in LENGTHS_M}
DIFFERENCE: Final = {lag: f"difference_{lag:g}s" for lag in receiver.LAGS_S}
SLIP, SCATTER, JUMPS = "slip", "scatter", "jumps"
SIGMA, AUTOCORRELATION = "sigma", "autocorrelation"
GYRO_NOISE, BIAS_WALK = "gyro_noise", "bias_walk"
SHAKING, ROLLING = "vertical_vibration", "roll_and_pitch_rate"


class Meaning(NamedTuple):
    """Meaning of a statistic.

    Attributes:
        name: Name for people.
        unit: Unit of the table.
        scale: Factor from SI units to that.
    """

    name: str
    unit: str
    scale: float


MEANINGS: Final[Mapping[str, Meaning]] = {
    **{key: Meaning(f"lateral distance after {length} m", "mm", 1e3) for length, key in LATERAL.items()},
    SLIP: Meaning(f"slip over {CHORD_M:g} m", "%", 100.0),
    SCATTER: Meaning("scatter of fixes while moving", "mm", 1e3),
    SIGMA: Meaning("σ of fixes at rest", "mm", 1e3),
    **{key: Meaning(f"difference of fixes after {lag:g} s", "mm", 1e3) for lag, key in DIFFERENCE.items()},
    AUTOCORRELATION: Meaning(f"autocorrelation of fixes at {AUTOCORRELATION_S:g} s", "", 1.0),
    JUMPS: Meaning(f"jumps of fixes by {JUMP_M * 100:g} cm and more in 1,000 s", "", 1.0),
    GYRO_NOISE: Meaning("density of the gyro's noise", "°/s/√Hz", math.degrees(1.0)),
    BIAS_WALK: Meaning("walk of the gyro's bias", "°/s/√h", math.degrees(60.0)),
    SHAKING: Meaning("vertical acceleration that driving adds", "m/s²", 1.0),
    ROLLING: Meaning("roll and pitch rate that driving adds", "°/s", math.degrees(1.0)),
}
"""Statistics in the order of a table."""


def log_statistics(log: LogSamples) -> dict[str, Told]:
    """Return all statistics of a log.

    Args:
        log: Its samples.

    Returns:
        By the keys of `MEANINGS`, in SI units.
    """
    at_rest = _of_receiver(log)
    found = {**_of_track(log, at_rest), **at_rest, **_of_imu(log)}
    return {key: found[key] for key in MEANINGS}


def jumps_of(log: LogSamples) -> Floats:
    """Return the jumps of a log's fixes: (j, 3) time [s], east and north [m]; none if it does not tell them."""
    if _against_driving(log):
        return np.zeros((0, 3))
    matched = track.matched(log.time_s, log.antenna_track, log.fixes)
    errors = track.step_errors(matched).map_m
    jumped = _jumped(matched, errors)
    return np.column_stack([matched.time_s[1:][jumped], errors[jumped]])


def _jumped(matched: track.MatchedTrack, errors_m: Floats) -> NDArray[np.bool_]:
    """Return the (k − 1,) steps in which a fix has jumped."""
    return np.asarray((np.hypot(*errors_m.T) > JUMP_M) & track.successive(matched.time_s))


def _against_driving(log: LogSamples) -> str:
    """Return why a log tells nothing of its fixes against dead reckoning; empty if it does."""
    if not len(log.fixes):
        return "it has no RTK-fixed positions"
    if log.reported_m > _MOST_RTK_M:
        return f"its fixes report σ {log.reported_m:.2g} m: that is no RTK"
    driven_m = float(log.antenna_track[-1, 2])
    return "" if driven_m >= _LEAST_DRIVE_M else f"it drives {driven_m:.0f} m"


def _of_track(log: LogSamples, at_rest: Mapping[str, Told]) -> dict[str, Told]:
    keys = (*LATERAL.values(), SLIP, SCATTER, JUMPS)
    if against := _against_driving(log):
        return dict.fromkeys(keys, Told(None, against))
    matched = track.matched(log.time_s, log.antenna_track, log.fixes)
    found = {}
    for length, key in LATERAL.items():
        value = track.lateral_sigma_m(matched, float(length))
        found[key] = Told(value, "" if value is not None else "it drives for too short a distance")
    errors = track.step_errors(matched).own_m
    moving = np.interp(matched.time_s[1:], log.time_s, np.abs(log.speed_mps)) > _MOVING_MPS
    scatter = track.scatter_m(errors[moving, 1])
    found[SCATTER] = Told(scatter)
    spans = float(matched.time_s[-1] - matched.time_s[0])
    found[JUMPS] = Told(1000.0 * float(_jumped(matched, errors).sum()) / spans)
    found[SLIP] = _slip(matched, errors[moving], max(scatter, at_rest[DIFFERENCE[1.0]].value or 0.0))
    return found


def _slip(matched: track.MatchedTrack, errors_m: Floats, noise_m: float) -> Told:
    ahead, left = track.robust_sigma(errors_m[:, 0]), track.robust_sigma(errors_m[:, 1])
    if ahead < min(_OWN_M, _OWN_SHARE * left):
        return Told(None, f"its wheels' distance is that of the fixes: they agree within {ahead * 1e3:.1f} mm a step")
    ratios = track.chord_ratios(matched, CHORD_M)
    if len(ratios) < 10:
        return Told(None, "it does not drive straight")
    slip = track.robust_sigma(ratios)
    by_noise = math.sqrt(2.0) * noise_m / CHORD_M
    if by_noise**2 > _NOISE_SHARE * slip**2:
        return Told(None, f"the fixes' noise alone looks like {100.0 * by_noise:.1f} %")
    return Told(slip)


def _of_receiver(log: LogSamples) -> dict[str, Told]:
    keys = (SIGMA, *DIFFERENCE.values(), AUTOCORRELATION)
    if not len(log.fixes):
        return dict.fromkeys(keys, Told(None, "it has no RTK-fixed positions"))
    first, last = max(stretches(log.rests), key=lambda each: each[1] - each[0], default=(0, 0))
    begin_s, end_s = log.time_s[first], log.time_s[last - 1] if last > first else log.time_s[first]
    resting = standing(log.fixes[(log.fixes[:, 0] >= begin_s) & (log.fixes[:, 0] <= end_s)])
    stood_s = float(resting[-1, 0] - resting[0, 0]) if len(resting) else 0.0
    if stood_s < LEAST_REST_S:
        return dict.fromkeys(keys, Told(None, f"it rests for {stood_s:.0f} s at most"))
    inside = (resting[:, 0] >= resting[0, 0] + _AWAY_S) & (resting[:, 0] <= resting[-1, 0] - _AWAY_S)
    off = receiver.each_second(resting[inside])
    found = {SIGMA: Told(receiver.sigma_m(off))}
    for lag, key in DIFFERENCE.items():
        long_enough = stood_s >= _PER_LAG * lag
        against = f"it rests for {stood_s:.0f} s at most"
        found[key] = Told(receiver.difference_m(off, lag)) if long_enough else Told(None, against)
    found[AUTOCORRELATION] = Told(receiver.autocorrelation(off, AUTOCORRELATION_S))
    return found


def _of_imu(log: LogSamples) -> dict[str, Told]:
    rests = stretches(log.rests)
    found = {}
    gyro = log.imu[:, 2]
    means = imu.second_means(gyro, rests)
    density = imu.noise_density(means) if _varies(gyro) else None
    why = "it has no gyro" if not _varies(gyro) else "it rests too shortly"
    found[GYRO_NOISE] = Told(density, "" if density is not None else why)
    if density is None:
        found[BIAS_WALK] = Told(None, why)
    else:
        walk = imu.bias_walk(imu.biases_at_rest(log.time_s, gyro, rests), density)
        found[BIAS_WALK] = Told(walk, "" if walk is not None else "its rests differ by no more than the noise")
    drives, still = np.abs(log.speed_mps) > _MOVING_MPS, log.rests
    for key, columns, what in ((SHAKING, (5,), "accelerometer"), (ROLLING, (0, 1), "gyro about x and y")):
        if not all(_varies(log.imu[:, column]) for column in columns):
            found[key] = Told(None, f"it has no {what}")
        elif drives.sum() < 1000 or still.sum() < 300:
            found[key] = Told(None, "it does not both drive and rest")
        else:
            added = [imu.added_by_driving(log.imu[:, column], drives, still) for column in columns]
            found[key] = Told(float(np.sqrt(np.mean(np.square(added)))))
    return found


def _varies(values: Floats) -> bool:
    there = values[np.isfinite(values)]
    return len(there) > 0 and float(np.ptp(there)) > 0.0

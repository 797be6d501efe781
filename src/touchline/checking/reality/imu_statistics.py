"""Statistics of an IMU: noise and walk of the gyro's bias at rest, and what driving adds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.checking.reality.log_samples import stretches

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

PIECE_S: Final = 10.0
"""Time over which a bias at rest is averaged."""
_TICKS_PER_S: Final = 100
_DETRENDED_TICKS: Final = 100
_KINK: Final = 1e-9
_ALL_BENT: Final = 0.97


def second_means(values: Floats, rests: Sequence[tuple[int, int]]) -> list[Floats]:
    """Return means of a second each, one array of each rest.

    Args:
        values: (n,) readings at ticks.
        rests: First and behind-last tick of each rest.
    """
    found = []
    for first, last in rests:
        count = (last - first) // _TICKS_PER_S
        found.append(values[first : first + count * _TICKS_PER_S].reshape(count, _TICKS_PER_S).mean(axis=1))
    return found


def noise_density(means: Sequence[Floats]) -> float | None:
    """Return the density of white noise, by the Allan deviation at one second (IEEE Std 952-1997, annex C).

    Args:
        means: Means of a second each, of each rest.

    Returns:
        Unit of the readings /√Hz; None with less than ten differences.
    """
    differences = np.concatenate([np.diff(each) for each in means] or [np.zeros(0)])
    differences = differences[np.isfinite(differences)]
    return float(np.sqrt(0.5 * np.mean(differences**2))) if len(differences) >= 10 else None


def bias_walk(biases: Floats, density: float) -> float | None:
    """Return the random walk of a bias, by the differences of successive means at rest.

    A difference has the variance K²·Δt + 2·N²/T, with the time Δt between the middles of both means, each over T.

    Args:
        biases: (b, 2) time in the middle [s], and mean over `PIECE_S`.
        density: Density N of white noise.

    Returns:
        K in the unit of the readings /√s; None if noise explains the differences.
    """
    if len(biases) < 3:
        return None
    apart_s, changes = np.diff(biases, axis=0).T
    walked = float((changes**2 - 2.0 * density**2 / PIECE_S).sum() / apart_s.sum())
    return float(np.sqrt(walked)) if walked > 0.0 else None


def biases_at_rest(time_s: Floats, values: Floats, rests: Sequence[tuple[int, int]]) -> Floats:
    """Return (b, 2) times and means of the pieces of `PIECE_S` of each rest."""
    size = round(PIECE_S * _TICKS_PER_S)
    pieces = [(at, at + size) for first, last in rests for at in range(first, last - size + 1, size)]
    found = [(time_s[first:last].mean(), values[first:last].mean()) for first, last in pieces]
    return np.array([each for each in found if np.isfinite(each[1])]).reshape(-1, 2)


def added_by_driving(values: Floats, drives: Flags, rests: Flags) -> float:
    """Return the standard deviation while driving beyond that at rest; means over a second are removed.

    Args:
        values: (n,) readings at ticks.
        drives: (n,) True while the robot drives.
        rests: (n,) True while it rests.
    """
    there = np.isfinite(values)
    filled = np.where(there, values, 0.0)
    weights = np.ones(_DETRENDED_TICKS)
    mean = np.convolve(filled, weights, "same") / np.maximum(np.convolve(there, weights, "same"), 1.0)
    quick = values - mean
    moving, still = quick[drives & there], quick[rests & there]
    return float(np.sqrt(max(np.var(moving) - np.var(still), 0.0)))


def native_rate_hz(values: Floats) -> float:
    """Return the rate at which readings were taken that an import has interpolated linearly to ticks.

    Second differences are zero but for the two ticks about each reading, or the one at which it was taken.

    Args:
        values: (n,) readings at ticks.

    Returns:
        Less than 50 Hz if they are interpolated, else 100 Hz.
    """
    bends = np.abs(np.diff(values[np.isfinite(values)], n=2))
    if not len(bends) or not bends.any():
        return float(_TICKS_PER_S)
    bent = bends > _KINK * bends.max()
    if bent.mean() > _ALL_BENT:
        return float(_TICKS_PER_S)
    readings = sum((last - first + 1) // 2 for first, last in stretches(bent))
    return float(_TICKS_PER_S * readings / len(bent))


def sampled(time_s: Floats, imu: Floats, rate_hz: float) -> Floats:
    """Return an IMU's readings as an import makes them of one with another rate, interpolated linearly.

    Its gyro integrates between two readings, as most do; its accelerometer does not, whose filter no log tells.

    Args:
        time_s: (n,) ticks.
        imu: (n, 6) gyro, then accelerometer, at ticks.
        rate_hz: Rate of the IMU.
    """
    if rate_hz >= _TICKS_PER_S:
        return imu
    at = np.round(np.arange(0.0, len(time_s), _TICKS_PER_S / rate_hz)).astype(np.int64)
    at = at[at < len(time_s)]
    counts = np.diff(np.append(at, len(time_s)))
    means = np.add.reduceat(imu[:, :3], at) / counts[:, None]
    middle_s = np.add.reduceat(time_s, at) / counts
    gyro = [np.interp(time_s, middle_s, column) for column in means.T]
    return np.column_stack([*gyro, *(np.interp(time_s, time_s[at], column[at]) for column in imu[:, 3:].T)])

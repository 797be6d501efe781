"""Estimator alone on the sensor frames of many ticks, which are all known beforehand.

One kernel does what `Estimator.step` does tick by tick, with the same bits.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.arrays import copy
from touchline.core.jit import kernel
from touchline.onboard import filter_model as m
from touchline.onboard.computer_state import Computer, ReceivedFix
from touchline.onboard.estimation.claimed_covariance import claimed_heading_sigma, claimed_position_sigma
from touchline.onboard.estimation.filter_tick import enter_estimate, take_frame

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

SPEED: Final = 3
COVARIANCE: Final = 5
TWIST_COVARIANCE: Final = COVARIANCE + 9
SIGMAS: Final = TWIST_COVARIANCE + 4
COLUMNS: Final = SIGMAS + 2
"""Columns of an estimate: fields of `interface.Estimate`, covariances row by row, then σ of position and heading."""


class FrameSeries(NamedTuple):
    """Sensor frames of n ticks, one after the other.

    Attributes:
        first_tick: First of the n ticks.
        readings: (n, READINGS) newest samples, as in `interface`.
        measured: (n, 3) ticks in which those of each of `interface.SAMPLED` were measured.
        fixes: (k,) fixes and poses, in the order of their arrival.
        arrived: (n + 1,) indices: those of the i-th tick are `fixes[arrived[i]:arrived[i + 1]]`.
    """

    first_tick: int
    readings: Floats
    measured: Integers
    fixes: Sequence[ReceivedFix]
    arrived: Integers


class EstimateSeries(NamedTuple):
    """Results of the estimator after each of n ticks.

    Attributes:
        rows: (n, COLUMNS) estimates.
        counters: (n,) counters of the filter.
    """

    rows: Floats
    counters: Sequence[m.FilterCounters]


@kernel
def estimate_series(
    begin: int, end: int, frames: FrameSeries, drive: Any, computer: Computer, out: EstimateSeries
) -> None:
    """Run ticks of an estimator that has been started.

    Args:
        begin: First row of `frames` to be run.
        end: Row behind the last one.
        frames: Sensor frames.
        drive: Figures of the drive.
        computer: (1,) state, updated.
        out: Results, filled in the same rows.
    """
    for i in range(begin, end):
        tick = frames.first_tick + i
        frame, first = computer[0].frame, frames.arrived[i]
        copy(frames.readings[i], frame.readings)
        frame.imu_tick, frame.mag_tick = frames.measured[i, 0], frames.measured[i, 1]
        frame.encoder_tick = frames.measured[i, 2]
        take_frame(tick, frames.fixes[first:], frames.arrived[i + 1] - first, drive, computer)
        note_estimate(computer, out.rows[i])
        out.counters[i] = computer[0].filter.counters  # type: ignore[index]


@kernel
def note_estimate(computer: Computer, row: Floats) -> None:
    """Note the estimate of an estimator that has been started.

    Args:
        computer: (1,) state.
        row: (COLUMNS,) filled in.
    """
    enter_estimate(computer, row[:SIGMAS])
    row[SIGMAS], row[SIGMAS + 1] = claimed_position_sigma(computer[0]), claimed_heading_sigma(computer[0])

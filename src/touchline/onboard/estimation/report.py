"""Consistency report of the filter."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.onboard.filter_model import FilterCounters
from touchline.onboard.interface import CONSISTENCY_COUNTS, Consistency

Floats = NDArray[np.float64]


@kernel
def enter_report(n: FilterCounters, position_sigma_m: float, heading_sigma_rad: float, values: Floats) -> None:
    """Enter the counters of the filter's kernels, and the standard deviations of the estimate.

    Args:
        n: Counters, an element of their array.
        position_sigma_m: Standard deviation of the position [m].
        heading_sigma_rad: Standard deviation of the heading [rad].
        values: (fields of `Consistency`,) filled in, in their order.
    """
    values[0], values[1] = n.innovation_east_m, n.innovation_north_m
    values[2], values[3] = n.fix_nis_last, n.fix_nis_recent
    values[4] = n.fix_nis_sum / max(n.fixes, 1)
    values[5] = n.encoder_nis_sum / max(n.encoders, 1)
    values[6] = n.mag_nis_sum / max(n.mags, 1)
    values[7], values[8] = position_sigma_m, heading_sigma_rad
    values[9] = n.encoders_rejected_recent
    values[10], values[11] = n.fixes, n.fixes_rejected
    values[12], values[13], values[14] = n.fixes_late, n.fixes_duplicate, n.fixes_out_of_order
    values[15], values[16], values[17] = n.gyro_rejected, n.encoders_rejected, n.mags_rejected
    values[18] = n.recoveries


def report(counters: FilterCounters, position_sigma_m: float = 0.0, heading_sigma_rad: float = 0.0) -> Consistency:
    """Return the report; arguments are those of `enter_report`."""
    values = np.zeros(len(Consistency._fields))
    enter_report(counters.array[0], position_sigma_m, heading_sigma_rad, values)
    figures = values.tolist()
    return Consistency._make((*figures[:CONSISTENCY_COUNTS], *map(int, figures[CONSISTENCY_COUNTS:])))

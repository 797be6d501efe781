"""The consistency report of the filter."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from touchline.services.onboard import filter_model as m
from touchline.services.onboard.interface import Consistency


def report(counters: NDArray[np.float64], position_sigma_m: float = 0.0, heading_sigma_rad: float = 0.0) -> Consistency:
    """Name the counters (COUNTERS,) of the filter's kernels."""
    n = counters.tolist()
    return Consistency(
        innovation_east_m=n[m.INNOVATION_EAST],
        innovation_north_m=n[m.INNOVATION_NORTH],
        fix_nis=n[m.NIS_FIX_LAST],
        fix_nis_recent=n[m.NIS_FIX_RECENT],
        fix_nis_mean=n[m.NIS_FIX_SUM] / max(n[m.N_FIXES], 1.0),
        encoder_nis_mean=n[m.NIS_ENCODER_SUM] / max(n[m.N_ENCODER], 1.0),
        mag_nis_mean=n[m.NIS_MAG_SUM] / max(n[m.N_MAG], 1.0),
        position_sigma_m=position_sigma_m,
        heading_sigma_rad=heading_sigma_rad,
        slip=n[m.ENCODER_REJECTED_RECENT],
        fixes=int(n[m.N_FIXES]),
        fixes_rejected=int(n[m.N_FIX_REJECTED]),
        fixes_too_late=int(n[m.N_FIX_LATE]),
        fixes_duplicate=int(n[m.N_FIX_DUPLICATE]),
        fixes_out_of_order=int(n[m.N_FIX_OUT_OF_ORDER]),
        gyro_rejected=int(n[m.N_GYRO_REJECTED]),
        encoders_rejected=int(n[m.N_ENCODER_REJECTED]),
        mag_rejected=int(n[m.N_MAG_REJECTED]),
        recoveries=int(n[m.N_RECOVERIES]),
    )

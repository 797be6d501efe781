"""What the filter says about its own consistency."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from services.robot_sim.onboard.estimator import model as m


class EstimatorReport(NamedTuple):
    """Counts since the filter was started. A consistent filter has a mean NIS of the measurement's dimension."""

    fixes: int
    fixes_rejected: int
    fixes_too_late: int
    fixes_duplicate: int
    fixes_out_of_order: int
    recoveries: int
    fix_nis_mean: float
    """2 expected."""
    encoders_rejected: int
    encoder_nis_mean: float
    """2 expected."""
    mag_rejected: int
    mag_nis_mean: float
    """1 expected."""
    slip: float
    """Share of the last wheel readings that contradict the rest."""


def report(counters: NDArray[np.float64]) -> EstimatorReport:
    """The counters (COUNTERS,) of the filter's kernel in words."""
    n = counters.tolist()
    return EstimatorReport(
        int(n[m.N_FIXES]),
        int(n[m.N_FIX_REJECTED]),
        int(n[m.N_FIX_LATE]),
        int(n[m.N_FIX_DUPLICATE]),
        int(n[m.N_FIX_OUT_OF_ORDER]),
        int(n[m.N_RECOVERIES]),
        n[m.NIS_FIX_SUM] / max(n[m.N_FIXES], 1.0),
        int(n[m.N_ENCODER_REJECTED]),
        n[m.NIS_ENCODER_SUM] / max(n[m.N_ENCODER], 1.0),
        int(n[m.N_MAG_REJECTED]),
        n[m.NIS_MAG_SUM] / max(n[m.N_MAG], 1.0),
        n[m.ENCODER_REJECTED_RECENT],
    )

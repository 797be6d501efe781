"""The consistency report of the filter."""

from __future__ import annotations

from touchline.services.onboard.filter_model import FilterCounters
from touchline.services.onboard.interface import Consistency


def report(n: FilterCounters, position_sigma_m: float = 0.0, heading_sigma_rad: float = 0.0) -> Consistency:
    """What the counters of the filter's kernels say, and the estimate's own σ."""
    return Consistency(
        innovation_east_m=n.innovation_east_m,
        innovation_north_m=n.innovation_north_m,
        fix_nis=n.fix_nis_last,
        fix_nis_recent=n.fix_nis_recent,
        fix_nis_mean=n.fix_nis_sum / max(n.fixes, 1),
        encoder_nis_mean=n.encoder_nis_sum / max(n.encoders, 1),
        mag_nis_mean=n.mag_nis_sum / max(n.mags, 1),
        position_sigma_m=position_sigma_m,
        heading_sigma_rad=heading_sigma_rad,
        slip=n.encoders_rejected_recent,
        fixes=n.fixes,
        fixes_rejected=n.fixes_rejected,
        fixes_too_late=n.fixes_late,
        fixes_duplicate=n.fixes_duplicate,
        fixes_out_of_order=n.fixes_out_of_order,
        gyro_rejected=n.gyro_rejected,
        encoders_rejected=n.encoders_rejected,
        mag_rejected=n.mags_rejected,
        recoveries=n.recoveries,
    )

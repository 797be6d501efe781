"""Consistency monitor: whether the innovations of fixes are correlated over time, while the robot moves.

Those of a filter whose assumptions hold are independent (R. K. Mehra, "On the identification of variances and adaptive
Kalman filtering", IEEE Trans. Automatic Control 15(2), 1970). A gyro's scale, a lever arm or a delay that the files do
not have makes them alike for seconds, long before anything contradicts the fixes, and the claimed σ is too small then.
"""

from __future__ import annotations

import math
from typing import Final

from touchline.core.jit import kernel
from touchline.onboard.filter_model import FilterCounters

REMEMBERED_FIXES: Final = 300
"""Number of fixes over which correlations are averaged exponentially: half a minute at 10 Hz."""
INCONSISTENT_FROM: Final = 0.15
"""Correlation of successive innovations from which the filter is inconsistent. In 12 emulated tennis jobs with right
files it is 0.06 at most."""
CONSISTENT_UNTIL: Final = 0.1
"""Correlation below which it is consistent again."""
MOVING_MPS: Final = 0.05
"""Speed from which fixes count: standing receivers wander, and scatter less than their data sheets say."""
CLIP: Final = 3.0


@kernel
def note_innovation(n: FilterCounters, speed_mps: float) -> None:
    """Note the last fix's innovation.

    Args:
        n: Counters with its normalised innovation, updated.
        speed_mps: Speed when it was measured.
    """
    white_0 = min(max(n.fix_white_0, -CLIP), CLIP)
    white_1 = min(max(n.fix_white_1, -CLIP), CLIP)
    if abs(speed_mps) < MOVING_MPS:
        return
    if not math.isnan(n.fix_before_0):
        share = 1.0 / REMEMBERED_FIXES
        n.fix_cross += share * (white_0 * n.fix_before_0 + white_1 * n.fix_before_1 - n.fix_cross)
        n.fix_power += share * (white_0 * white_0 + white_1 * white_1 - n.fix_power)
    n.fix_before_0, n.fix_before_1 = white_0, white_1
    limit = CONSISTENT_UNTIL if n.inconsistent else INCONSISTENT_FROM
    n.inconsistent = n.fix_cross > limit * n.fix_power

"""Consistency monitor: whether the innovations of fixes are correlated over time, while the robot moves.

Those of a filter whose assumptions hold are independent (R. K. Mehra, "On the identification of variances and adaptive
Kalman filtering", IEEE Trans. Automatic Control 15(2), 1970). A gyro's scale, a lever arm or a delay that the files do
not have makes them alike for seconds, long before anything contradicts the fixes, and the claimed σ is too small then.
The receiver's own bursts do so, too, since one Gauss-Markov term stands for them. They are told apart by their size and
by time: innovations are bounded, and compared with those before most of a burst's correlation is gone. Fixes that are
rejected because the receiver has jumped are alike for as long as it stays there, and say nothing of the estimate: they
do not count.

Beside it, the unrest of the innovations is measured: the variance of their sums over half a second, across the heading
and along it. A robot that wanders, or an antenna that shakes, makes it larger for as long as it drives; a constant that
the files are wrong about does so only until it has been learned. So it tells how far to believe the σ of constants.
"""

from __future__ import annotations

import math
from typing import Final

from touchline.core.jit import kernel
from touchline.onboard.filter_model import FIX_LAG, FilterCounters

REMEMBERED_FIXES: Final = 300
"""Number of fixes over which correlations are averaged exponentially: half a minute at 10 Hz."""
INCONSISTENT_FROM: Final = 0.2
"""Correlation of innovations from which the filter is inconsistent, if there are as many; of fewer it has to be larger.
In 20 emulated tennis jobs with right files it is 0.14 at most."""
CONSISTENT_UNTIL: Final = 0.15
"""Correlation below which it is consistent again."""
MOVING_MPS: Final = 0.05
"""Speed from which fixes count: standing receivers wander, and scatter less than their data sheets say."""
_FEWER: Final = 0.75  # power of the share that is missing: more than chance asks for, since bursts last for seconds
_CLIP: Final = 3.0
_LEAST_POWER: Final = 0.2  # mean square of innovations that are so small that σ is too large rather than too small
_BURST_CLIP: Final = 0.7  # σ: innovations are smaller without a burst, and larger in one
_RESTLESS_FROM: Final = 60  # fixes: a burst among fewer would look like unrest
_AT_REST: Final = (0.25, 0.4)  # across and along: 0.33 and 0.5 at most in 40 jobs of 20 s with right files or constants


def compared_innovations(lag: int) -> str:
    """Return which innovations are compared, for people, by the number of fixes between them."""
    return "successive innovations of fixes" if lag == 1 else f"innovations {lag} fixes apart"


@kernel
def note_innovation(n: FilterCounters, heading_rad: float, speed_mps: float, bursts: bool) -> None:
    """Note the last fix's innovation.

    Args:
        n: Counters with its normalised innovation, updated.
        heading_rad: Heading when it was measured.
        speed_mps: Speed then.
        bursts: Whether the receiver errs in bursts, which correlate successive innovations.
    """
    if abs(speed_mps) < MOVING_MPS:
        return
    lag, clip = (FIX_LAG, _BURST_CLIP) if bursts else (1, _CLIP)
    white_0 = min(max(n.fix_white_0, -clip), clip)
    white_1 = min(max(n.fix_white_1, -clip), clip)
    if n.fixes_noted >= lag:
        slot = (n.fixes_noted - lag) % FIX_LAG
        count = min(n.fixes_noted - lag + 1, REMEMBERED_FIXES)
        share = 1.0 / count
        n.fix_cross += share * (white_0 * n.fix_before[slot, 0] + white_1 * n.fix_before[slot, 1] - n.fix_cross)
        n.fix_power += share * (white_0 * white_0 + white_1 * white_1 - n.fix_power)
        limit = (CONSISTENT_UNTIL if n.inconsistent else INCONSISTENT_FROM) * (REMEMBERED_FIXES * share) ** _FEWER
        n.inconsistent = n.fix_cross > limit * max(n.fix_power, _LEAST_POWER)
    slot = n.fixes_noted % FIX_LAG
    n.fix_before[slot, 0], n.fix_before[slot, 1] = white_0, white_1
    n.fixes_noted += 1
    _note_unrest(n, heading_rad)


@kernel
def _note_unrest(n: FilterCounters, heading_rad: float) -> None:
    """Note how far the last innovations are on one side, across and along the heading."""
    east = north = 0.0
    for slot in range(FIX_LAG):
        east += min(max(n.fix_before[slot, 0], -_BURST_CLIP), _BURST_CLIP)
        north += min(max(n.fix_before[slot, 1], -_BURST_CLIP), _BURST_CLIP)
    cos, sin = math.cos(heading_rad), math.sin(heading_rad)
    aside, along = cos * north - sin * east, cos * east + sin * north
    share = 1.0 / min(n.fixes_noted, REMEMBERED_FIXES)
    n.fix_aside += share * (aside * aside / FIX_LAG - n.fix_aside)
    n.fix_along += share * (along * along / FIX_LAG - n.fix_along)
    if n.fixes_noted >= _RESTLESS_FROM:
        n.fix_unrest = max(n.fix_unrest, n.fix_aside / _AT_REST[0], n.fix_along / _AT_REST[1])

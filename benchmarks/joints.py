"""Joints of lines after every kind of interruption: true paint, default noise.

`python -m benchmarks joints`; `runs` are made with each cause, or those whose name begins with `only`, of
three joints each.
"""

from __future__ import annotations

import numpy as np

from benchmarks._joints import CAUSES, interrupted, joints
from benchmarks._settings import Small

MAX_GAP_M = 0.01
MAX_DOUBLE_M = 0.02
SMALL = Small(
    {"runs": 1, "only": "pause"},
    (
        "[mm] joints open: mean worst twice: mean worst beyond # open or # twice",
        "pause # # # # # #",
        "pause, jolted # # # # # #",
    ),
)


def main(runs: int = 20, only: str = "") -> None:
    """Print the worst and the mean gap and double paint of each cause."""
    print(f"{'[mm]':20s} joints   open: mean  worst   twice: mean  worst   beyond 10 open or 20 twice")
    for cause in (cause for cause in CAUSES if cause.startswith(only)):
        found = np.array([joint for seed in range(1, runs + 1) for joint in joints(*interrupted(cause, seed))])
        gaps, doubles = found[:, 0], found[:, 1]
        beyond = int(np.count_nonzero((gaps > MAX_GAP_M) | (doubles > MAX_DOUBLE_M)))
        print(
            f"{cause:20s} {len(found):6d}   {1e3 * gaps.mean():10.1f} {1e3 * gaps.max():6.1f}   "
            f"{1e3 * doubles.mean():11.1f} {1e3 * doubles.max():6.1f}   {beyond:6d}"
        )

"""Scheduling priorities: control loop and stop requests first, then the console, then all else."""

import os
import sys
from contextlib import suppress

#: Of the robot's control loop, and of an order that stops it.
FIRST = -10
#: Of the operator's console, which has much to draw besides.
SOON = -5
USUAL = 0
_SWITCH_S = 0.001


def run_at(nice: int) -> None:
    """Give this process, and those that it starts from now on, a niceness, where that is allowed."""
    with suppress(OSError):
        os.setpriority(os.PRIO_PROCESS, 0, nice)


def switch_threads_soon() -> None:
    """Make Python switch threads within a millisecond."""
    sys.setswitchinterval(_SWITCH_S)

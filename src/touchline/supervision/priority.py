"""Scheduling priorities: control loop and stop requests first, then the console, then all else."""

import os
import sys
from contextlib import suppress

#: Niceness of the robot's control loop, and of an order that stops it.
FIRST = -10
#: Niceness of the operator's console, which has much to draw besides.
SOON = -5
USUAL = 0
_SWITCH_S = 0.001


def run_at(nice: int) -> None:
    """Set the niceness of this process, and of those that it starts from now on, where that is allowed."""
    with suppress(OSError):
        os.setpriority(os.PRIO_PROCESS, 0, nice)


def switch_threads_soon() -> None:
    """Make Python switch threads within a millisecond."""
    sys.setswitchinterval(_SWITCH_S)

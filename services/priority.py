"""How urgently the operating system runs a process: what stops the robot goes before what else the machine does."""

import os
from contextlib import suppress

#: Of the robot's control loop, and of an order that stops it.
FIRST = -10
#: Of the operator's console, which has much to draw besides.
SOON = -5
USUAL = 0


def run_at(nice: int) -> None:
    """Give this process, and those that it starts from now on, a niceness, where that is allowed."""
    with suppress(OSError):
        os.setpriority(os.PRIO_PROCESS, 0, nice)

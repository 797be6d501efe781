"""What a worker is given to do; a process that begins with it loads nothing else of the tests."""

import os


def signal_itself(_shared: None, number: int) -> int:
    """Send its own process a signal, and live to tell."""
    os.kill(os.getpid(), number)
    return number


def divide(shared: float, by: float) -> float:
    """What is shared, divided."""
    return shared / by

"""Stopwatch for figures of speed: the time that work takes once its kernels are there."""

import time

from touchline.core.jit import PREPARING


class Stopwatch:
    """Measures from when it is made; compiling and loading kernels, which a first call does, is left out."""

    def __init__(self) -> None:
        self._begun_s = time.perf_counter() - PREPARING.spent_s

    @property
    def elapsed_s(self) -> float:
        """Wall-clock time so far, s."""
        return time.perf_counter() - PREPARING.spent_s - self._begun_s

"""Stopwatch for benchmarks that leaves out the compilation of kernels."""

import time

from touchline.core.jit import PREPARING


class Stopwatch:
    """Wall-clock time from creation on, without compiling and loading kernels, which happens at first calls."""

    def __init__(self) -> None:
        self._begun_s = time.perf_counter() - PREPARING.spent_s

    @property
    def elapsed_s(self) -> float:
        """Wall-clock time so far, s."""
        return time.perf_counter() - PREPARING.spent_s - self._begun_s

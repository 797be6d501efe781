"""Observation of compilations in this process, of our kernels and of other functions."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from types import TracebackType
from typing import Any, Self

Step = tuple[str, Callable[[], object]]
_listening: list[Compilations] = []
_inside = threading.local()


class Compilations:
    """Context that records compiled functions; loading them does not count.

    Args:
        begin: Called with a function's name before it is compiled, in the compiling thread.
        end: Called with it afterwards.

    Attributes:
        names: Names of the functions compiled so far.
    """

    def __init__(
        self, begin: Callable[[str], object] = lambda _name: None, end: Callable[[str], object] = lambda _name: None
    ) -> None:
        self.names: list[str] = []
        self.begin, self.end = begin, end

    def __enter__(self) -> Self:
        _hear_numba()
        _listening.append(self)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        _listening.remove(self)


@contextmanager
def compiling(function: Any) -> Iterator[None]:
    """Compile a function, and report it to who listens; what is compiled for it is a part of that."""
    if getattr(_inside, "one", False):
        yield
        return
    name = f"{function.__module__.rpartition('.')[2]}.{function.__name__}"
    heard, _inside.one = list(_listening), True
    try:
        for each in heard:
            each.begin(name)
        yield
    finally:
        _inside.one = False
        _hear_numba()
        for each in heard:
            each.names.append(name)
            each.end(name)


def _hear_numba() -> None:
    """Report what others have Numba compile, too, once it has been imported."""
    if "numba" in sys.modules:
        from touchline.core.numba_events import forward

        forward(compiling)


def run_steps(steps: Iterable[Step], report: Callable[[str], object]) -> None:
    """Run the steps of a warm-up.

    Args:
        steps: Name and function of each step.
        report: Called before each kernel that has to be compiled, with a line such as "compiling 3 of 6 (sensors):
            sampling.sense", and at the end; not at all if nothing has to be compiled.
    """
    steps, begun_s, doing = list(steps), time.perf_counter(), ""
    with Compilations(lambda name: report(f"compiling {doing}: {name}")) as compiled:
        for number, (name, step) in enumerate(steps, start=1):
            doing = f"{number} of {len(steps)} ({name})"
            step()
    if compiled.names:
        report(f"compiled {len(compiled.names)} kernels in {time.perf_counter() - begun_s:.1f} s")

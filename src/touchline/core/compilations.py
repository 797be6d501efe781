"""Compilations of this process by Numba, of our kernels and of anybody's functions, as they happen."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from types import TracebackType
from typing import Any, Final, Self

from numba.core import event

_COMPILE: Final = "numba:compile"
Step = tuple[str, Callable[[], object]]


class Compilations(event.Listener):
    """Functions that are compiled while this context is entered; loading them from the cache does not count.

    Args:
        begin: Called with a function's name before it is compiled, in the thread that needs it.
        end: Called with it afterwards.

    Attributes:
        names: Of those compiled so far.
    """

    def __init__(
        self, begin: Callable[[str], object] = lambda _name: None, end: Callable[[str], object] = lambda _name: None
    ) -> None:
        self.names: list[str] = []
        self._begin, self._end = begin, end

    def __enter__(self) -> Self:
        event.register(_COMPILE, self)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        event.unregister(_COMPILE, self)

    def on_start(self, event: Any) -> None:
        """Numba begins to compile a function."""
        self._begin(_name(event))

    def on_end(self, event: Any) -> None:
        """It is done with that."""
        self.names.append(_name(event))
        self._end(self.names[-1])


def _name(event: Any) -> str:
    function = event.data["dispatcher"].py_func
    return f"{function.__module__.rpartition('.')[2]}.{function.__name__}"


def run_steps(steps: Iterable[Step], report: Callable[[str], object]) -> None:
    """Run the steps of a warm-up.

    Args:
        steps: Name and function of each.
        report: Called before each kernel that has to be compiled, with a line such as "compiling 3 of 6 (sensors):
            fast.measure", and at the end; not at all if every kernel is in the cache.
    """
    steps, begun_s, doing = list(steps), time.perf_counter(), ""
    with Compilations(lambda name: report(f"compiling {doing}: {name}")) as compiled:
        for number, (name, step) in enumerate(steps, start=1):
            doing = f"{number} of {len(steps)} ({name})"
            step()
    if compiled.names:
        report(f"compiled {len(compiled.names)} kernels in {time.perf_counter() - begun_s:.1f} s")
